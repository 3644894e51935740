//! Two crossing layers of liquid-metal channels as a sensor file describes them.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Solvable;
use super::checks::{self, Broken, micrometres, require};
use crate::layout::ArrayDescription;
use crate::mechanics::{
    CellGeometry, ClosingCurve, ClosingPoint, ForceHysteresis, Hyperelastic, LinearElastic,
    MicrochannelError, MicrochannelSection, PressureLaw, SectionShape, SolvedCell, VoidStack,
};
use crate::quantity::{
    self, Checked, NonNegativeLength, PositiveLength, PositiveResistivity, PositiveStress, below,
};
use crate::solutions::{OfDrawing, Solutions};
use crate::transduction::{Conductor, DrawnLayers, LayersTable, MicrochannelLayer, ThinnestPoint};
use taxel_numerics::Noise;

/// Names of the layers in the file, in the order of [`Microchannel::layers`].
const NAMES: [&str; 2] = ["rows", "columns"];

/// Channels along x, one for each row of taxels, and channels along y, one for
/// each column (P4). A taxel is where two of them cross.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Microchannel {
    /// Cross-section of all channels.
    pub section: SectionDescription,
    /// The soft solid around them.
    pub material: Hyperelastic,
    /// Constants for the closed form of P4 (Eq. 1), which is reported beside.
    pub closed_form: LinearElastic,
    /// Liquid in the microchannels.
    pub liquid: Liquid,
    /// Solid below the lower channels, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub base: f64,
    /// The channels along x.
    pub rows: LayerDescription,
    /// The channels along y.
    pub columns: LayerDescription,
    /// Scatter of fabricated devices about the drawing; used by the twin.
    pub fabrication: MicrochannelFabrication,
    /// Constants that a calibration found; `None` as drawn.
    #[serde(skip)]
    #[schemars(skip)]
    pub found: Option<FoundChannels>,
    /// Solved cells of the row and of the column layer, where no table has them.
    #[serde(skip)]
    #[schemars(skip)]
    pub(crate) solved: OfDrawing<[Option<SolvedCell>; 2]>,
    /// Its load path by finite elements, where `mechanics` names a table.
    #[serde(skip)]
    #[schemars(skip)]
    pub(crate) table: OfDrawing<Arc<LayersTable>>,
}

/// Constants that a calibration finds of the microchannels of one device.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundChannels {
    /// Pressures of the closing curves over those of the drawing, of the row
    /// and of the column layer.
    pub stiffness: [f64; 2],
    /// Resistance at rest of each channel over that of the drawing, rows first.
    pub rest: Vec<f64>,
    /// Signal from which each channel reads no more, V or Ω as the board gives it, rows first;
    /// that of the drawing where it was not reached.
    pub saturation: Vec<f64>,
    /// Leads in series with each channel, Ω.
    pub lead: f64,
    /// Hysteresis of the pressure, where slow loops identified it.
    pub hysteresis: Option<ForceHysteresis>,
}

/// Scatter of the made channels about their drawing.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MicrochannelFabrication {
    /// Standard deviation of the height from channel to channel, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub height_deviation: f64,
    /// Seed of this scatter: the same seed is the same piece.
    pub seed: u64,
}

/// A cross-section.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionDescription {
    /// Width along the surface, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub width: f64,
    /// Height, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub height: f64,
    /// Its shape; a rectangle without the key.
    #[serde(default)]
    pub shape: SectionShape,
}

/// A conducting liquid.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Liquid {
    /// Resistivity, Ω m.
    #[serde(deserialize_with = "quantity::one::<PositiveResistivity, _>")]
    #[schemars(with = "Checked<PositiveResistivity>")]
    pub resistivity: f64,
    /// Law of its pressure.
    pub pressure: PressureLaw,
    /// Gauge pressure at rest of over-filled microchannels, Pa; without it zero. The law then
    /// counts pressures and volumes from the filled state, and areas are over those at rest.
    #[serde(default, deserialize_with = "quantity::some::<PositiveStress, _>")]
    #[schemars(with = "Option<Checked<PositiveStress>>")]
    pub initial_pressure: Option<f64>,
}

/// One layer of equal parallel channels.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerDescription {
    /// All that lies above the channels, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub roof: f64,
    /// Length of a channel from lead to lead, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub length: f64,
    /// Closing curve of a cross-section under net pressure.
    pub closing: ClosingDescription,
    /// The thinnest section for a mean one, where it is known; an empty list
    /// is a layer whose sections are taken for equal.
    pub thinnest: Vec<ThinnestPoint>,
    /// Shape of the sections that `closing.points` and `thinnest` were found for; a rectangle
    /// without the key. Points of another shape than `section.shape` are refused.
    #[serde(default)]
    pub points_of: SectionShape,
}

/// Where the closing curve of a layer comes from.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ClosingDescription {
    /// A plane-strain cell with the section, roof and pitch of this layer: tabulated, or
    /// solved once and kept.
    PlaneStrainCell(PlaneStrainCell),
    /// Points of a curve, from low to high net pressure; rest is not among
    /// them.
    Points(Vec<ClosingPoint>),
}

/// Parameters of a plane-strain cell.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneStrainCell {
    /// Thickness of its sheet, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
}

impl Solvable for Microchannel {
    fn check_lengths(&self, array: &ArrayDescription) -> Result<(), Broken> {
        check_stack(self, array.pitch)
    }

    fn solve(
        &mut self,
        array: &ArrayDescription,
        table: Option<(&str, &str)>,
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken> {
        self.table = OfDrawing(None);
        match table {
            Some((name, text)) => self.take_table(array.pitch, name, text)?,
            None => self.solve_cells(array.pitch, solutions)?,
        }
        self.check(array.pitch)
    }
}

impl Microchannel {
    /// Cross-section at rest.
    pub fn section(&self) -> MicrochannelSection {
        MicrochannelSection {
            width: self.section.width,
            height: self.section.height,
            shape: self.section.shape,
        }
    }

    /// Models of the row and of the column layer; `pitch` is the spacing of
    /// the taxels along x and y, m.
    ///
    /// # Errors
    /// [`MicrochannelError`] for a cell that is not tabulated or points that are
    /// not monotone, after the name of the layer's section in the file.
    pub fn layers(
        &self,
        pitch: [f64; 2],
    ) -> Result<[MicrochannelLayer; 2], (&'static str, MicrochannelError)> {
        let mut rows = self.layer(0, pitch).map_err(|error| (NAMES[0], error))?;
        let mut columns = self.layer(1, pitch).map_err(|error| (NAMES[1], error))?;
        if let Some(found) = &self.found {
            rows.closing = rows.closing.stiffened(found.stiffness[0]);
            columns.closing = columns.closing.stiffened(found.stiffness[1]);
        }
        Ok([rows, columns])
    }

    /// The row and the column layer.
    fn described(&self) -> [&LayerDescription; 2] {
        [&self.rows, &self.columns]
    }

    /// The plane-strain cell of a layer (rows, columns).
    fn cell(&self, layer: usize, drawn: PlaneStrainCell, pitch: [f64; 2]) -> CellGeometry {
        CellGeometry {
            section: self.section(),
            roof: self.described()[layer].roof,
            thickness: drawn.thickness,
            // Channels along x lie side by side along y.
            pitch: pitch[1 - layer],
        }
    }

    fn layer(
        &self,
        number: usize,
        pitch: [f64; 2],
    ) -> Result<MicrochannelLayer, MicrochannelError> {
        let layer = self.described()[number];
        let modulus = self.material.shear_modulus();
        if let Some(table) = &self.table.0 {
            let closing = table.closing[number].clone();
            let liquid = self.liquid.pressure.clone();
            return MicrochannelLayer::new(closing, liquid, self.conductor(number), &[]);
        }
        let closing = match &layer.closing {
            ClosingDescription::Points(points) => ClosingCurve::from_points(points)?,
            ClosingDescription::PlaneStrainCell(drawn) => {
                let solved = self.solved.0.as_ref();
                match solved.and_then(|solved| solved[number].as_ref()) {
                    Some(solved) => solved.curve(modulus)?,
                    None => ClosingCurve::of_cell(&self.cell(number, *drawn, pitch), modulus)?,
                }
            }
        };
        let drawn = MicrochannelLayer::new(
            closing,
            self.liquid.pressure.clone(),
            self.conductor(number),
            &layer.thinnest,
        )?;
        match self.liquid.initial_pressure {
            Some(pressure) => drawn.filled(pressure),
            None => Ok(drawn),
        }
    }

    /// The conductor in a channel of a layer.
    fn conductor(&self, number: usize) -> Conductor {
        Conductor {
            resistivity: self.liquid.resistivity,
            length: self.described()[number].length,
            section: self.section(),
        }
    }

    /// Which of the upper (0) and the lower layer (1) the rows are, which the columns.
    pub(crate) fn position(&self) -> [usize; 2] {
        if self.rows.roof < self.columns.roof {
            [0, 1]
        } else {
            [1, 0]
        }
    }

    /// The crossing cell for finite elements; `pitch` as for [`Microchannel::layers`].
    ///
    /// # Errors
    /// A sentence for a drawing that is not solved.
    pub fn void_stack(&self, pitch: [f64; 2]) -> Result<VoidStack, String> {
        let [along_x, along_y] = pitch;
        if self.liquid.initial_pressure.is_some() {
            return Err(String::from(
                "the finite elements of the crossing cell begin without pressure in the liquid: leave \
                 element.microchannel.liquid.initial_pressure out, or use the closing curves",
            ));
        }
        if along_x != along_y {
            return Err(format!(
                "the crossing cell needs one spacing for both layers; array.pitch is {} along x and {} along y: \
                 give equal spacings or use the closed form",
                micrometres(along_x),
                micrometres(along_y)
            ));
        }
        let roofs = [self.rows.roof, self.columns.roof];
        Ok(VoidStack {
            section: self.section(),
            pitch: along_x,
            base: self.base,
            between: (roofs[0] - roofs[1]).abs() - self.section.height,
            cover: roofs[0].min(roofs[1]),
            material: self.material,
            liquid: self.liquid.pressure.clone(),
        })
    }

    /// The layers whose load path is tabulated.
    ///
    /// # Errors
    /// As [`Microchannel::void_stack`].
    pub fn drawn_layers(&self, pitch: [f64; 2]) -> Result<DrawnLayers, String> {
        Ok(DrawnLayers {
            stack: self.void_stack(pitch)?,
            position: self.position(),
        })
    }

    /// Takes the text of the table that the sensor file names.
    ///
    /// # Errors
    /// A drawing that has no table, a text that is none, and the table of another drawing.
    fn take_table(&mut self, pitch: [f64; 2], name: &str, text: &str) -> Result<(), Broken> {
        let drawn = self
            .drawn_layers(pitch)
            .map_err(|message| Broken::new("mechanics.table", message, "leave mechanics out"))?;
        let table = drawn
            .read(text)
            .map_err(|wrong| checks::wrong_table(name, &wrong))?;
        self.table = OfDrawing(Some(Arc::new(table)));
        Ok(())
    }

    /// Solves the cells that no table has.
    ///
    /// # Errors
    /// The key of a layer whose cell makes no sense or has no solution.
    fn solve_cells(
        &mut self,
        pitch: [f64; 2],
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken> {
        // Before minutes are spent on what does not fit.
        self.check_shapes()?;
        let mut solved = [None, None];
        for (number, name) in NAMES.into_iter().enumerate() {
            let ClosingDescription::PlaneStrainCell(drawn) = &self.described()[number].closing
            else {
                continue;
            };
            let cell = self.cell(number, *drawn, pitch);
            // The tables do not have how a channel bulges.
            let bulges = self.liquid.initial_pressure.is_some();
            if ClosingCurve::is_tabulated(&cell) && !bulges {
                continue;
            }
            check_cell(&cell, name)?;
            let what = format!("closing curve of the {name}");
            let answer = SolvedCell::of_cell(&cell, &what, solutions);
            let key = format!("element.microchannel.{name}.closing");
            solved[number] = checks::solved(answer, &key, "change the drawing")?.0;
        }
        self.solved = OfDrawing(Some(solved));
        Ok(())
    }

    /// Rules that concern the models of the two layers.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    fn check(&self, pitch: [f64; 2]) -> Result<(), Broken> {
        self.check_shapes()?;
        self.layers(pitch).map(|_| ()).map_err(|(layer, error)| {
            let message = format!("{layer}: {error}");
            match error {
                MicrochannelError::Filling { .. } => Broken::new(
                    "element.microchannel.liquid.initial_pressure",
                    message,
                    "give a lower pressure, or a stiffer drawing of this layer",
                ),
                _ => Broken::new(
                    &format!("element.microchannel.{layer}"),
                    message,
                    "correct this layer, or the pressure law of the liquid",
                ),
            }
        })
    }

    /// Points that were typed in belong to one shape of the section.
    fn check_shapes(&self) -> Result<(), Broken> {
        let layers = self.described().into_iter().zip(NAMES);
        let mut checked = layers.map(|(layer, name)| self.check_points(layer, name));
        checked.find(Result::is_err).unwrap_or(Ok(()))
    }

    fn check_points(&self, layer: &LayerDescription, name: &str) -> Result<(), Broken> {
        let typed = match (&layer.closing, layer.thinnest.is_empty()) {
            (ClosingDescription::Points(_), _) => "closing",
            (_, false) => "thinnest",
            _ => return Ok(()),
        };
        let words = |shape: SectionShape| match shape {
            SectionShape::Rectangle => "rectangle",
            SectionShape::Ellipse => "ellipse",
        };
        let (own, drawn) = (words(layer.points_of), words(self.section.shape));
        require(
            typed != "closing"
                || layer.points_of == SectionShape::Rectangle
                || self.liquid.initial_pressure.is_none(),
            "element.microchannel.liquid.initial_pressure",
            || {
                format!(
                    "the points of element.microchannel.{name}.closing say how an elliptic channel closes, not how far it \
                     bulges when it is over-filled"
                )
            },
            "let the cell be solved (closing.plane_strain_cell.thickness = …, thinnest = []), or leave initial_pressure out",
        )?;
        let help = match typed {
            "closing" => format!(
                "let the cell be solved (closing.plane_strain_cell.thickness = …, thinnest = []), or give the points of \
                 the {drawn} and say so: points_of = \"{drawn}\""
            ),
            _ => format!(
                "leave them out (thinnest = []), or give those of the {drawn} and say so: points_of = \"{drawn}\""
            ),
        };
        require(
            layer.points_of == self.section.shape,
            &format!("element.microchannel.{name}.{typed}"),
            || {
                format!(
                    "these points are of sections of the shape \"{own}\" (points_of), and element.microchannel.section.shape \
                     is \"{drawn}\""
                )
            },
            &help,
        )
    }

    /// The conductors of the channels of one piece of fabrication, rows first:
    /// heights scattered about the drawing, cut at three standard deviations.
    pub fn fabricate(
        &self,
        layers: &[MicrochannelLayer; 2],
        channels: [usize; 2],
    ) -> Vec<Conductor> {
        let mut scatter = Noise::seeded(self.fabrication.seed);
        let drawn = layers.iter().zip(channels);
        drawn
            .flat_map(|(layer, count)| std::iter::repeat_n(layer.conductor, count))
            .map(|mut made| {
                made.section.height +=
                    self.fabrication.height_deviation * scatter.normal().clamp(-3.0, 3.0);
                made
            })
            .collect()
    }

    /// Thickness of the whole stack, m.
    pub fn thickness(&self) -> f64 {
        self.base + self.section.height + self.rows.roof.max(self.columns.roof)
    }
}

/// Lengths of a cell that leave solid all round the channel.
fn check_cell(cell: &CellGeometry, name: &str) -> Result<(), Broken> {
    require(
        below(cell.section.width, cell.pitch),
        "element.microchannel.section.width",
        || {
            format!(
                "channels of {} leave no wall at a pitch of {}",
                micrometres(cell.section.width),
                micrometres(cell.pitch)
            )
        },
        "give narrower channels or a larger pitch",
    )?;
    let need = cell.roof + cell.section.height;
    require(
        below(need, cell.thickness),
        &format!("element.microchannel.{name}.closing.plane_strain_cell.thickness"),
        || {
            format!(
                "a sheet of {} has no solid below a channel of {} under a roof of {}",
                micrometres(cell.thickness),
                micrometres(cell.section.height),
                micrometres(cell.roof)
            )
        },
        &format!("give more than {}", micrometres(need)),
    )
}

/// Channels must fit beside and above one another.
fn check_stack(element: &Microchannel, pitch: [f64; 2]) -> Result<(), Broken> {
    for pitch in pitch {
        require(
            below(element.section.width, pitch),
            "element.microchannel.section.width",
            || {
                format!(
                    "channels of {} leave no wall at a pitch of {}",
                    micrometres(element.section.width),
                    micrometres(pitch)
                )
            },
            "give narrower channels or a larger pitch",
        )?;
    }
    let between = (element.rows.roof - element.columns.roof).abs();
    require(
        below(element.section.height, between),
        "element.microchannel.rows.roof",
        || {
            format!(
                "the layers lie {} apart, within the height of {} of a channel",
                micrometres(between),
                micrometres(element.section.height)
            )
        },
        "count all that lies above the lower channels into their roof",
    )
}
