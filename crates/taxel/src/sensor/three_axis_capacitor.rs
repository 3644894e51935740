//! The three-axis capacitive taxel as a sensor file describes it.

use schemars::JsonSchema;
use serde::Deserialize;

use super::checks::{self, Broken, micrometres, require};
use super::{Solvable, no_table};
use crate::layout::{ArrayDescription, Mount};
use crate::mechanics::{
    BentGap, ForceHysteresis, RelaxationTerm, SolvedStiffness, SuspensionDescription, UnitDrawing,
};
use crate::quantity::{
    self, Checked, NonNegativeLength, PositiveForce, PositiveLength, at_most, below, decimal,
};
use crate::solutions::Solutions;
use crate::transduction::{
    DrawnEdges, EdgeDrawing, OutsideEdges, PlatesDescription, SolvedEdges, ThreeAxisModel,
};
use taxel_numerics::Noise;

/// Four capacitors under one bump (P2).
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThreeAxisCapacitor {
    /// The four plate pairs.
    pub plates: PlatesDescription,
    /// Suspension that carries the bump and the upper plates.
    pub suspension: SuspensionDescription,
    /// Relaxing springs beside the long-time stiffness; an empty list is a
    /// unit that does not creep.
    pub relaxation: Vec<RelaxationTerm>,
    /// Force on each axis that the device is meant for, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub full_scale: f64,
    /// Force on each axis up to which the model was verified, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub usable_force: f64,
    /// The drawing around the electrodes.
    pub outline: Outline,
    /// Scatter of fabricated devices about the drawing; used by the twin.
    pub fabrication: Fabrication,
    /// Taxels that were calibrated, in the place of their drawing: a sensor
    /// file has no such key, a calibration file sets it.
    #[serde(skip)]
    pub calibrated: Vec<CalibratedUnit>,
    /// Hysteresis of the force along x, y and z, where a calibration identified it.
    #[serde(skip)]
    pub hysteresis: [Option<ForceHysteresis>; 3],
}

/// The model of one calibrated taxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedUnit {
    /// Number of the taxel, row by row.
    pub taxel: usize,
    /// Its model.
    pub unit: ThreeAxisModel,
}

/// Scatter of the made device about its drawing.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fabrication {
    /// Standard deviation of the air gap from capacitor to capacitor, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub air_gap_deviation: f64,
    /// Seed of this scatter: the same seed is the same piece.
    pub seed: u64,
}

/// Lengths of the drawing that the electrical model does not use.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outline {
    /// Side of the unit, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub unit_side: f64,
    /// Width of the wall between neighbouring capacitors, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub wall_width: f64,
    /// Side of the bump at its base, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_base: f64,
    /// Side of the flat top of the bump, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_top: f64,
    /// Height of the bump, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_height: f64,
    /// Layer between bump and upper electrode layer, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_layer: f64,
    /// Electrode layer with its electrodes, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub electrode_layer: f64,
    /// Electrode thickness, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub electrode_thickness: f64,
}

impl Solvable for ThreeAxisCapacitor {
    fn check_lengths(&self, array: &ArrayDescription) -> Result<(), Broken> {
        check_lengths(self, array.pitch)
    }

    /// Solves the edges of the electrodes and the unit where edges and stiffness are to follow from
    /// a drawing that no table has.
    fn solve(
        &mut self,
        array: &ArrayDescription,
        table: Option<(&str, &str)>,
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken> {
        no_table("three_axis_capacitor", table.is_some())?;
        self.solve_edges(array, solutions)?;
        let drawing = self.unit_drawing(array.pitch);
        // The rules between keys say what makes no unit.
        let beside = drawing.is_unit() && drawing.compliance().is_err();
        if self.suspension.from_drawing.is_none() || !beside {
            return Ok(());
        }
        let solved = SolvedStiffness::of_unit(&drawing, solutions);
        self.suspension.solved = checks::solved(
            solved,
            "element.three_axis_capacitor.suspension.from_drawing",
            "change the lengths of the unit, or type the stiffness in (stiffness, tile_tilt, bump_sinking) in the place of \
             from_drawing",
        )?;
        Ok(())
    }
}

impl ThreeAxisCapacitor {
    fn solve_edges(
        &mut self,
        array: &ArrayDescription,
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken> {
        let drawing = self.edge_drawing(array);
        let beside = drawing.is_section() && drawing.tabulated().is_err();
        if self.plates.parallel_capacitance.is_some() || !beside {
            return Ok(());
        }
        let [along_x, along_y] = drawing.electrode;
        let (side, [_, widest]) = (along_x.min(along_y), drawing.air_gap);
        require(
            at_most(widest, side),
            &key("plates.air_gap"),
            || {
                format!(
                    "an air gap of {} is wider than electrodes of {}, and leaves no edges to solve",
                    micrometres(widest),
                    micrometres(side)
                )
            },
            &format!(
                "give at most {}, larger electrodes, or type parallel_capacitance in",
                micrometres(side)
            ),
        )?;
        let solved = SolvedEdges::of_unit(&drawing, solutions);
        self.plates.solved_edges = checks::solved(
            solved,
            "element.three_axis_capacitor.plates",
            "change the lengths of the plates, or type parallel_capacitance in",
        )?;
        Ok(())
    }

    /// The edges of the electrodes by the drawing: from the table, or as they were solved.
    ///
    /// # Errors
    /// [`OutsideEdges`] for a drawing that the table has not and that was not solved.
    pub fn edges(&self, array: &ArrayDescription) -> Result<DrawnEdges, OutsideEdges> {
        let drawing = self.edge_drawing(array);
        drawing.tabulated().or_else(|outside| {
            let solved = self.plates.solved_edges.0.as_ref();
            solved.map(|solved| solved.edges(&drawing)).ok_or(outside)
        })
    }

    /// The model of one unit of an array.
    ///
    /// What does not follow from the drawing is left out; the check of a sensor file refuses
    /// such drawings.
    pub fn unit_model(&self, array: &ArrayDescription) -> ThreeAxisModel {
        let typed_in = || self.suspension.typed_in();
        let edges = self.edges(array).ok();
        let mut plates = self.plates.model(edges.map(|edges| edges.grounded));
        if let Some(bent) = self.bent(array) {
            for air in &mut plates.air_gap {
                *air -= bent.closing;
            }
        }
        let unit = self.unit_drawing(array.pitch);
        ThreeAxisModel {
            suspension: self.suspension.model(&unit).unwrap_or_else(|_| typed_in()),
            plates,
        }
    }

    /// What the mount does to the air gaps; `None` on a plane, without the plane that is not
    /// stretched, and for a drawing that was not solved.
    pub fn bent(&self, array: &ArrayDescription) -> Option<BentGap> {
        let Mount::Cylinder(cylinder) = array.mount else {
            return None;
        };
        let plane = cylinder.unstretched_plane?;
        self.unit_drawing(array.pitch)
            .bent(array.pitch[0], cylinder.radius, plane)
    }

    /// The models of all taxels: as calibrated, or else as drawn.
    pub fn unit_models(&self, array: &ArrayDescription) -> Vec<ThreeAxisModel> {
        self.with_calibrated(vec![self.unit_model(array); array.rows * array.columns])
    }

    fn with_calibrated(&self, mut units: Vec<ThreeAxisModel>) -> Vec<ThreeAxisModel> {
        for calibrated in &self.calibrated {
            if let Some(unit) = units.get_mut(calibrated.taxel) {
                *unit = calibrated.unit;
            }
        }
        units
    }

    /// The units of one piece of fabrication: the air gap of each capacitor
    /// scattered about its drawing, cut at three standard deviations; taxels
    /// that were calibrated are as found.
    pub fn fabricate(&self, array: &ArrayDescription) -> Vec<ThreeAxisModel> {
        let mut scatter = Noise::seeded(self.fabrication.seed);
        let drawn = self.unit_model(array);
        let made = (0..array.rows * array.columns).map(|_| {
            let mut unit = drawn;
            for air in &mut unit.plates.air_gap {
                *air += self.fabrication.air_gap_deviation * scatter.normal().clamp(-3.0, 3.0);
            }
            unit
        });
        self.with_calibrated(made.collect())
    }

    /// The lengths that the edges of the electrodes follow from.
    pub fn edge_drawing(&self, array: &ArrayDescription) -> EdgeDrawing {
        let (plates, outline) = (&self.plates, &self.outline);
        let distance = self.suspension.centre_distance;
        let lines = [array.columns, array.rows];
        let gaps = plates.air_gap.into_iter();
        EdgeDrawing {
            electrode: plates.electrode,
            air_gap: [
                gaps.clone().fold(f64::INFINITY, f64::min),
                gaps.fold(0.0, f64::max),
            ],
            insulation: plates.insulation,
            permittivity: plates.insulation_permittivity,
            electrode_thickness: outline.electrode_thickness,
            cavity: plates.electrode.map(|side| {
                [
                    0.5 * (distance - side - outline.wall_width),
                    0.5 * (outline.unit_side - distance - side),
                ]
            }),
            above: outline.electrode_layer + outline.bump_layer,
            // Both electrode layers are cast alike.
            below: outline.electrode_layer - outline.electrode_thickness,
            inner: plates.electrode.map(|side| distance - side),
            outer: std::array::from_fn(|axis| {
                (lines[axis] > 1).then(|| array.pitch[axis] - distance - plates.electrode[axis])
            }),
        }
    }

    /// The lengths that the stiffness of a unit follows from.
    pub fn unit_drawing(&self, pitch: [f64; 2]) -> UnitDrawing {
        let (plates, outline) = (&self.plates, &self.outline);
        UnitDrawing {
            electrode: plates.electrode[0],
            electrode_thickness: outline.electrode_thickness,
            centre_distance: self.suspension.centre_distance,
            unit_side: outline.unit_side,
            wall_width: outline.wall_width,
            // Both electrode layers are cast alike.
            lower_layer: outline.electrode_layer,
            upper_layer: outline.electrode_layer + outline.bump_layer,
            bump_height: outline.bump_height,
            bump_base: outline.bump_base,
            bump_top: outline.bump_top,
            air_gap: plates.air_gap.into_iter().sum::<f64>() / 4.0,
            insulation: plates.insulation,
            // The nearer neighbours stiffen a unit more.
            pitch: pitch[0].min(pitch[1]),
        }
    }

    /// Height of the bump's top above the air gap, m: the lever of a side force.
    pub fn lever(&self) -> f64 {
        self.outline.bump_height + self.outline.bump_layer + self.outline.electrode_layer
    }

    /// Torsion coefficients κ = k·h·L about y (from x forces) and about x,
    /// N m/rad (P2 Eqs. 1-5 with height h and centre distance L kept apart).
    pub fn torsion(&self, stiffness: [f64; 3]) -> [f64; 2] {
        let arm = self.lever() * self.suspension.centre_distance;
        [stiffness[0] * arm, stiffness[1] * arm]
    }
}

fn key(name: &str) -> String {
    format!("element.three_axis_capacitor.{name}")
}

/// Rules between the lengths of a unit, which need no solution.
///
/// # Errors
/// The first broken rule, shown at its key.
fn check_lengths(element: &ThreeAxisCapacitor, pitch: [f64; 2]) -> Result<(), Broken> {
    let outline = &element.outline;
    let distance = element.suspension.centre_distance;
    for side in element.plates.electrode {
        require(
            at_most(side, distance),
            &key("suspension.centre_distance"),
            || {
                format!(
                    "electrodes of {} at centres {} apart overlap",
                    micrometres(side),
                    micrometres(distance)
                )
            },
            "give a larger centre distance or smaller electrodes",
        )?;
        let unit = distance + side;
        require(
            at_most(unit, outline.unit_side),
            &key("outline.unit_side"),
            || {
                format!(
                    "two electrodes and their distance need {}",
                    micrometres(unit)
                )
            },
            "give a larger unit side",
        )?;
    }
    for pitch in pitch {
        require(
            at_most(outline.unit_side, pitch),
            "array.pitch",
            || {
                format!(
                    "units of {} overlap at a pitch of {}",
                    micrometres(outline.unit_side),
                    micrometres(pitch)
                )
            },
            "give a larger pitch or a smaller unit side",
        )?;
    }
    require(
        at_most(outline.bump_top, outline.bump_base),
        &key("outline.bump_top"),
        || "the bump is wider at its top than at its base".into(),
        "give a top that is at most as wide as the base",
    )?;
    require(
        at_most(outline.bump_base, outline.unit_side),
        &key("outline.bump_base"),
        || "the bump is wider than its unit".into(),
        "give a smaller base",
    )?;
    require(
        at_most(element.usable_force, element.full_scale),
        &key("usable_force"),
        || "the usable force is above the full scale".into(),
        "give at most the full scale",
    )?;
    if element.suspension.from_drawing.is_none() {
        return Ok(());
    }
    let [x, y] = element.plates.electrode;
    require(
        decimal(x) == decimal(y),
        &key("plates.electrode"),
        || {
            format!(
                "the stiffness follows from the drawing of square electrodes, not of {} by {}",
                micrometres(x),
                micrometres(y)
            )
        },
        "give equal sides, or type the stiffness in (stiffness, tile_tilt, bump_sinking) in the place of from_drawing",
    )?;
    check_unit(&element.unit_drawing(pitch))
}

/// A unit whose stiffness follows from its drawing has electrodes within its cavities, and
/// elastomer between it and the next one.
fn check_unit(drawing: &UnitDrawing) -> Result<(), Broken> {
    let [inner, outer] = [-1.0, 1.0].map(|side| drawing.centre_distance + side * drawing.electrode);
    require(
        below(drawing.wall_width, inner),
        &key("outline.wall_width"),
        || {
            format!(
                "a wall of {} reaches the electrodes, which are {} apart",
                micrometres(drawing.wall_width),
                micrometres(inner)
            )
        },
        "give a narrower wall, or a larger centre distance",
    )?;
    require(
        below(outer, drawing.unit_side),
        &key("outline.unit_side"),
        || {
            format!(
                "the electrodes end {} from each other and need cavities wider than that, not of {}",
                micrometres(outer),
                micrometres(drawing.unit_side)
            )
        },
        "give a larger unit side",
    )?;
    require(
        drawing.insulation > 0.0,
        &key("plates.insulation"),
        || "the stiffness follows from the drawing of units with an insulation".into(),
        "give an insulation of more than 0 um, or type the stiffness in",
    )?;
    let layer = drawing.lower_layer.min(drawing.upper_layer);
    require(
        below(drawing.electrode_thickness, layer),
        &key("outline.electrode_thickness"),
        || {
            format!(
                "electrodes of {} are as thick as a layer of {} in which they lie",
                micrometres(drawing.electrode_thickness),
                micrometres(layer)
            )
        },
        "give thinner electrodes, or thicker layers",
    )?;
    require(
        below(inner, drawing.bump_base) && below(drawing.bump_base, outer),
        &key("outline.bump_base"),
        || {
            format!(
                "a bump's base of {} does not end over the electrodes: the stiffness follows from the drawing for more \
                 than {} and less than {}",
                micrometres(drawing.bump_base),
                micrometres(inner),
                micrometres(outer)
            )
        },
        "change the base, or type the stiffness in (stiffness, tile_tilt, bump_sinking) in the place of from_drawing",
    )?;
    require(
        below(drawing.unit_side, drawing.pitch),
        "array.pitch",
        || {
            format!(
                "units of {} at a pitch of {} have no elastomer between them",
                micrometres(drawing.unit_side),
                micrometres(drawing.pitch)
            )
        },
        "give a larger pitch or a smaller unit side",
    )
}
