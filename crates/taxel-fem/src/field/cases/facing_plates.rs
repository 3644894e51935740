//! Two thick plates that face each other across air and an insulation, in a layer:
//! the plane section across one straight edge, with what stands beside it.

use super::grid::{Sizes, line, name_nodes, plane};
use super::{check, growth};
use crate::field::FieldError;
use crate::field::electrostatics::{Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use crate::field::geometry::Geometry;
use crate::field::laplace::{Coefficient, Domain, Motion};

/// What stands beside the plates, on both sides alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beside {
    /// Nothing.
    Nothing,
    /// Another pair of plates, both at zero.
    Grounded(Neighbour),
    /// Another pair of plates, the upper driven with the own one, the lower at zero.
    Driven(Neighbour),
}

impl Beside {
    fn neighbour(self) -> Option<Neighbour> {
        match self {
            Self::Nothing => None,
            Self::Grounded(neighbour) | Self::Driven(neighbour) => Some(neighbour),
        }
    }
}

/// Another pair of plates at the same heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Distance from edge to edge.
    pub distance: f64,
    /// Width.
    pub width: f64,
}

/// The plates and their layer, lengths in any one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacingPlates {
    /// Air between insulation and upper plate.
    pub air: f64,
    /// Insulation on the lower plate.
    pub insulation: f64,
    /// Relative permittivity of insulation and layer.
    pub permittivity: f64,
    /// Thickness of a plate.
    pub plate: f64,
    /// Half of the width of the plates.
    pub half_width: f64,
    /// Air beyond the edges, between the walls.
    pub cavity: f64,
    /// What stands beside.
    pub beside: Beside,
    /// Layer above the lower face of the upper plate, air above it.
    pub above: f64,
    /// Layer below the lower plate.
    pub below: f64,
    /// A plane at zero under the layer.
    pub grounded_plane: bool,
    /// Where the field ends beyond the last air of the section. It ends at the lower face of the
    /// layer too.
    pub margin: f64,
    /// Air above the solid, up to the outer boundary.
    pub air_above: f64,
}

impl FacingPlates {
    /// Charge of the own lower plate per edge, metre and volt on the own upper plate, over
    /// the permittivity of vacuum, less what plates without edges would have. Half of the
    /// section is solved; nothing passes its outer boundary.
    ///
    /// # Errors
    /// [`FieldError`] for lengths, ratios or levels out of range.
    pub fn edge_excess(&self, level: u32) -> Result<f64, FieldError> {
        let neighbour = self.beside.neighbour();
        self.check(level)?;
        let least = self.air.min(self.plate).min(self.insulation);
        let edge = Some(0.05 * least / f64::from(level));
        let wall = Some(0.5 * self.air);
        let half = self.half_width;
        let mut across = vec![(0.0, None), (half, edge), (half + self.cavity, wall)];
        let mut last = half + self.cavity;
        if let Some(Neighbour { distance, width }) = neighbour {
            let (near, far) = (half + distance, half + distance + width);
            last = far + self.cavity;
            across.extend([
                (near - self.cavity, wall),
                (near, edge),
                (far, edge),
                (last, wall),
            ]);
        }
        let end = last + self.margin;
        across.push((end, None));
        let insulated = -self.air - self.insulation;
        let base = insulated - self.plate - self.below;
        let up = vec![
            (base, None),
            (insulated - self.plate, edge),
            (insulated, edge),
            (-self.air, edge),
            (0.0, edge),
            (self.plate, edge),
            (self.above, None),
            (self.above + self.air_above, None),
        ];
        let sizes = Sizes {
            growth: growth(level),
            largest: 0.25 * self.margin / f64::from(level),
        };
        let region = |place: [f64; 2]| Some(self.region(place));
        let mut mesh = plane(&line(sizes, &across), &line(sizes, &up), &region);
        let mut zero = Vec::new();
        if neighbour.is_some() {
            zero.push("ground");
        }
        if self.grounded_plane {
            name_nodes(&mut mesh, "plane", &|p| p[1] == base);
            zero.push("plane");
        }
        // Alone, the two plates carry opposite charges: one of them is the zero.
        let alone = zero.is_empty();
        let conductors: &[&str] = if alone {
            zero.push("lower");
            &["upper"]
        } else {
            &["upper", "lower"]
        };
        let found = Electrostatics {
            domain: Domain {
                mesh: &mesh,
                geometry: Geometry::Plane,
                motion: Motion::None,
                exterior: None,
            },
            permittivities: &[
                ("air", Coefficient::Scalar(1.0)),
                ("layer", Coefficient::Scalar(self.permittivity)),
            ],
            conductors,
            floating: &[],
            zero: &zero,
            infinity: Infinity::Free,
        }
        .capacitance()?;
        let charge = if alone {
            found.matrix[0][0]
        } else {
            -found.matrix[1][0]
        };
        let gap = self.air + self.insulation / self.permittivity;
        Ok(charge / VACUUM_PERMITTIVITY - half / gap)
    }

    /// Refuses lengths, ratios and levels out of range.
    fn check(&self, level: u32) -> Result<(), FieldError> {
        let unit = self.air;
        check(
            level,
            &[
                ("insulation over air", self.insulation / unit),
                ("plate over air", self.plate / unit),
                ("half width over air", self.half_width / unit),
                ("cavity over air", self.cavity / unit),
                ("layer above over air", self.above / unit),
                ("layer below over air", self.below / unit),
                ("margin over air", self.margin / unit),
                ("air above over air", self.air_above / unit),
                ("permittivity", self.permittivity),
            ],
        )?;
        if let Some(Neighbour { distance, width }) = self.beside.neighbour()
            && !(distance > 2.0 * self.cavity
                && distance.is_finite()
                && width > 0.0
                && width.is_finite())
        {
            return Err(FieldError::OutOfRange {
                quantity: "distance of the neighbour",
                value: distance,
                allowed: "above twice the cavity beyond an edge",
            });
        }
        Ok(())
    }

    /// The part of the section at a place.
    fn region(&self, [x, y]: [f64; 2]) -> &'static str {
        let (half, insulated) = (self.half_width, -self.air - self.insulation);
        let own = x < half;
        let (mut other, mut open) = (false, x < half + self.cavity);
        if let Some(Neighbour { distance, width }) = self.beside.neighbour() {
            let (near, far) = (half + distance, half + distance + width);
            other = x > near && x < far;
            open |= x > near - self.cavity && x < far + self.cavity;
        }
        let driven = matches!(self.beside, Beside::Driven(_));
        let upper = y > 0.0 && y < self.plate;
        let lower = y < insulated && y > insulated - self.plate;
        match () {
            () if own && upper => "upper",
            () if own && lower => "lower",
            () if other && upper && driven => "upper",
            () if other && (upper || lower) => "ground",
            () if open && y > -self.air && y < 0.0 => "air",
            () if y > self.above => "air",
            () => "layer",
        }
    }
}
