//! Two conducting bars side by side in a pressed layer: their shape, and the
//! capacitance between them in the deformed section.
//!
//! The layer's cells carry the field as they lie deformed; what is around them is meshed
//! anew for each state.

mod section;
mod tied;

use taxel_fem::field::FieldError;
use taxel_fem::material::Material;
use taxel_fem::solver::failure::{Failure, Reason};
use taxel_fem::study::layer::{Bar, Layer, LayerStudy};

pub use section::Section;

/// Shape of the bars; present over initial lengths where it says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarShape {
    /// Gap between the facing sides, mean over their height at rest, m.
    pub gap: f64,
    /// Gap at the lower edges, m.
    pub gap_bottom: f64,
    /// Gap at the upper edges, m.
    pub gap_top: f64,
    /// Thickness at the facing side, m.
    pub thickness_at_face: f64,
    /// Thickness, mean along the width at rest, m.
    pub thickness: f64,
    /// Width at half thickness, m.
    pub width: f64,
}

/// Media around the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Media {
    /// Relative permittivity of the layer.
    pub layer: f64,
    /// Relative permittivity above and beside it.
    pub above: f64,
    /// Relative permittivity below the base plane; none when that plane is at zero.
    pub below: Option<f64>,
}

/// Capacitances between the bars per depth over the permittivity of vacuum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarCapacitance {
    /// With the bars at plus and minus half the voltage.
    pub differential: f64,
    /// Between the bars alone, with the base guarded; without a base at zero the same.
    pub mutual: f64,
}

/// A pressed layer with its bars.
pub struct BarStudy {
    /// The pressed layer.
    pub study: LayerStudy,
    bar: Bar,
}

impl BarStudy {
    /// Poses the problem of a layer whose side face comes to lie on the base or has the
    /// layer going on.
    ///
    /// # Errors
    /// When the lengths make no layer.
    pub fn new(
        layer: Layer,
        bar: Bar,
        material: Material,
        stiff: Material,
    ) -> Result<Self, Failure> {
        let layer = Layer {
            bar: Some(bar),
            ..layer
        };
        LayerStudy::new(layer, material, Some(stiff)).map(|study| Self { study, bar })
    }

    /// Lines of nodes through corners of the bar: present places with initial ones.
    fn line(&self, along: usize, at: f64, range: [f64; 2]) -> Vec<(f64, [f64; 3])> {
        let mesh = &self.study.solver.problem().mesh;
        let places = self.study.solver.state().places(mesh);
        let near = 1e-9 * self.study.layer().thickness;
        let mut line: Vec<(f64, [f64; 3])> = mesh
            .points
            .iter()
            .zip(places)
            .filter(|(x, _)| {
                (x[1 - along] - at).abs() < near
                    && x[along] > range[0] - near
                    && x[along] < range[1] + near
            })
            .map(|(x, place)| (x[along], place))
            .collect();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        line
    }

    /// Shape of the bars at the present state.
    pub fn shape(&self) -> BarShape {
        let Bar {
            inner,
            width,
            height,
            thickness,
        } = self.bar;
        let (across, upward) = ([inner, inner + width], [height, height + thickness]);
        let face = self.line(1, inner, upward);
        let back = self.line(1, inner + width, upward);
        let [lower, upper] = upward.map(|at| self.line(0, at, across));
        let mean = |line: &[(f64, [f64; 3])], component: usize| average(line, component);
        let end = |line: &[(f64, [f64; 3])], component: usize| {
            line.last().map_or(f64::NAN, |point| point.1[component])
        };
        let start = |line: &[(f64, [f64; 3])], component: usize| {
            line.first().map_or(f64::NAN, |point| point.1[component])
        };
        BarShape {
            gap: 2.0 * mean(&face, 0),
            gap_bottom: 2.0 * start(&face, 0),
            gap_top: 2.0 * end(&face, 0),
            thickness_at_face: end(&face, 1) - start(&face, 1),
            thickness: mean(&upper, 1) - mean(&lower, 1),
            width: middle(&back) - middle(&face),
        }
    }

    /// Capacitances in the present shape, all media at once.
    ///
    /// # Errors
    /// When the deformed section makes no mesh for the field.
    pub fn capacitance(&self, media: &[Media]) -> Result<Vec<BarCapacitance>, Failure> {
        let solve = || -> Result<Vec<BarCapacitance>, FieldError> {
            let section = self.section(self.study.solver.state().displacement.as_slice())?;
            media.iter().map(|media| section.solve(*media)).collect()
        };
        solve().map_err(|error| Failure::at_start(Reason::Field(error)))
    }

    /// The deformed section with its surroundings.
    ///
    /// # Errors
    /// [`FieldError`] when the blocks fit no circle.
    pub fn section(&self, displacement: &[[f64; 3]]) -> Result<Section, FieldError> {
        let mesh = &self.study.solver.problem().mesh;
        Section::new(mesh, displacement, self.study.layer())
    }
}

/// Mean of a component along the initial length, by Simpson's rule on each cell.
fn average(line: &[(f64, [f64; 3])], component: usize) -> f64 {
    let mut sum = 0.0;
    for cell in line.windows(3).step_by(2) {
        let values: [f64; 3] = std::array::from_fn(|k| cell[k].1[component]);
        sum += (cell[2].0 - cell[0].0) * (values[0] + 4.0 * values[1] + values[2]) / 6.0;
    }
    let length = line.last().map_or(0.0, |end| end.0) - line.first().map_or(0.0, |start| start.0);
    sum / length
}

/// Place across at the middle of an upright line, where its cells meet or have a node.
fn middle(line: &[(f64, [f64; 3])]) -> f64 {
    let (Some(first), Some(last)) = (line.first(), line.last()) else {
        return f64::NAN;
    };
    let at = f64::midpoint(first.0, last.0);
    let nearest = line
        .iter()
        .min_by(|a, b| (a.0 - at).abs().total_cmp(&(b.0 - at).abs()));
    nearest.map_or(f64::NAN, |point| point.1[0])
}
