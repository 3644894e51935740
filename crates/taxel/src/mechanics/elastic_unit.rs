//! The elastic unit of P2 from its drawing: closing of the electrodes per force, read from
//! solved cases (`tables/solved_p2_unit.csv`) and scaled to the drawing.

use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::quantity::{self, BarHeight, Checked, PositiveStress};
use crate::solved_table::{SolvedRow, SolvedTable, interpolated};

/// What the stiffness of a unit follows from beside its drawing.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElasticDescription {
    /// Young's modulus of the elastomer, Pa. Its Poisson's ratio is taken as 0.49; nearly
    /// incompressible rubber changes the stiffness by less than 1 %.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub modulus: f64,
    /// Where a side force enters the bump.
    pub side_contact: SideContact,
    /// Whether air can leave the cavities.
    pub cavity: Cavity,
}

/// Where a side force enters the bump.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SideContact {
    /// At the flat top, as by a glued plate or a finger.
    Top,
    /// At one flank, by a bar.
    Bar(Bar),
}

/// A bar that pushes one flank of the bump.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bar {
    /// Height of the line where it touches, over the height of the bump.
    #[serde(deserialize_with = "quantity::one::<BarHeight, _>")]
    #[schemars(with = "Checked<BarHeight>")]
    pub height: f64,
    /// Whether the flank moves along the bar.
    pub grip: Grip,
}

/// Whether the flank moves along the bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// The bar holds the flank at its height, with a downward force.
    Sticks,
    /// The flank rises along the bar, which pushes sideways alone.
    Slips,
}

/// Air in the cavities under the electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Cavity {
    /// Air leaves freely.
    Vented,
    /// Each capacitor keeps its air.
    Sealed,
}

/// Lengths of a unit that its stiffness follows from, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitDrawing {
    /// Side of the square electrodes.
    pub electrode: f64,
    /// Thickness of the electrodes.
    pub electrode_thickness: f64,
    /// Distance between the centres of the electrodes.
    pub centre_distance: f64,
    /// Side of the unit: the outer ends of its cavities.
    pub unit_side: f64,
    /// Width of the wall between the cavities.
    pub wall_width: f64,
    /// Elastomer under the lower face of the insulation.
    pub lower_layer: f64,
    /// Elastomer between the air gap and the bump.
    pub upper_layer: f64,
    /// Height of the bump.
    pub bump_height: f64,
    /// Side of the bump at its base.
    pub bump_base: f64,
    /// Side of the flat top.
    pub bump_top: f64,
    /// Mean air gap.
    pub air_gap: f64,
    /// Insulation.
    pub insulation: f64,
    /// Distance between the centres of units: the side of the block that is one unit.
    pub pitch: f64,
}

/// Answers to a force on one strip of a flank; side force along x on the flank at −x.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FlankCompliance {
    /// d_x and d_z per side force, Pa m/N.
    pub by_side_force: [f64; 2],
    /// d_x and d_z per downward force at the same strip, Pa m/N.
    pub by_downward_force: [f64; 2],
    /// Downward force per side force that keeps the strip from rising.
    pub stick: f64,
}

/// Closing of the electrodes of a unit per force, times Young's modulus.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitCompliance {
    /// Mean closing per normal force on the flat top, Pa m/N.
    pub c_zz: f64,
    /// d_x per side force on the flat top, Pa m/N.
    pub c_xx: f64,
    /// Largest closing anywhere over the mean of a tile, under a normal force.
    pub hot_z: f64,
    /// The same under a side force.
    pub hot_x: f64,
    /// Slope of the closing outward over a tile under a normal force, times half its side,
    /// over the mean closing.
    pub tilt_z: f64,
    /// Slopes of a tile along and across a side force, over d_x/L.
    pub tilt_x: [f64; 2],
    /// The strips of [`STRIPS`].
    pub strips: [FlankCompliance; 4],
    /// Volume that one cavity loses per normal force, Pa m³/N.
    pub volume_by_force: f64,
    /// Volume that the four cavities gain per pressure in them, Pa m³/Pa.
    pub volume_by_pressure: f64,
    /// Mean opening of the tiles per pressure in the cavities, Pa m/Pa.
    pub opening_by_pressure: f64,
    /// Volume of one cavity, m³.
    pub cavity_volume: f64,
    /// Largest relative error of the closings per force.
    pub error: f64,
}

/// Middles of the strips of a flank, over the height of the bump.
pub const STRIPS: [f64; 4] = [0.125, 0.375, 0.625, 0.875];
/// Pressure of the air around, Pa: 1013 hPa.
pub const AIR_PRESSURE: f64 = 101.3e3;
/// Relative error of the closings of the solved cases, and of a solution on the usual cells at
/// least: finer meshes of another family close by more, at the base case by 2.1 % (c_zz) and 3.0 %
/// (c_xx), with walls of 200 um by 3.7 and 4.2 % (tests of `graded` cells in `tests/blocks.rs` of
/// `taxel-fem`).
pub const SOLVED_ERROR: f64 = 0.05;

/// A drawing whose stiffness the table does not give, by its first length that is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutsideUnit {
    /// Key of the sensor file, below the element.
    pub key: &'static str,
    /// Length that is off.
    pub quantity: &'static str,
    /// The length, m.
    pub given: f64,
    /// Least and greatest length, m.
    pub range: [f64; 2],
}

impl std::fmt::Display for OutsideUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [given, least, greatest] = [self.given, self.range[0], self.range[1]].map(|m| m * 1e6);
        let quantity = self.quantity;
        write!(
            f,
            "the table of stiffnesses has {quantity} from {least:.1} um to {greatest:.1} um, not \
             {given:.1} um"
        )
    }
}

/// A length that was varied.
struct Varied {
    /// The least and the greatest length over that of the base case for which the table is
    /// interpolated, among others that differ, too.
    near: [f64; 2],
    /// The length of the key over that in the columns.
    whole: f64,
    /// Columns whose sum it is.
    columns: &'static [&'static str],
    /// Its key, below the element, and its name.
    key: &'static str,
    quantity: &'static str,
    /// The length of a drawing that stands in the columns.
    of: fn(&UnitDrawing) -> f64,
}

/// The lengths that were varied in the table.
const VARIED: [Varied; 7] = [
    Varied {
        near: NEAR,
        whole: 2.0,
        columns: &["wall_half_um"],
        key: "outline.wall_width",
        quantity: "a wall",
        of: |unit| 0.5 * unit.wall_width,
    },
    Varied {
        near: CLEARANCES,
        whole: 2.0,
        columns: &["cavity_outer_um"],
        key: "outline.unit_side",
        quantity: "the side of a unit",
        of: |unit| 0.5 * unit.unit_side,
    },
    Varied {
        near: NEAR,
        whole: 1.0,
        columns: &["lower_um"],
        key: "outline.electrode_layer",
        quantity: "the lower layer",
        of: |unit| unit.lower_layer,
    },
    Varied {
        near: NEAR,
        whole: 1.0,
        columns: &["base_um", "upper_um"],
        key: "outline.bump_layer",
        quantity: "the layers between air gap and bump",
        of: |unit| unit.upper_layer,
    },
    Varied {
        near: NEAR,
        whole: 1.0,
        columns: &["bump_height_um", "bump_top_half_um"],
        key: "outline.bump_height",
        quantity: "the bump's height",
        of: |unit| unit.bump_height,
    },
    Varied {
        near: NEAR,
        whole: 1.0,
        columns: &["air_um"],
        key: "plates.air_gap",
        quantity: "an air gap",
        of: |unit| unit.air_gap,
    },
    Varied {
        near: NEAR,
        whole: 1.0,
        columns: &["insulation_um"],
        key: "plates.insulation",
        quantity: "an insulation",
        of: |unit| unit.insulation,
    },
];

/// Lengths over those of the base case near which the exponents are within [`NEAR_ERROR`].
const NEAR: [f64; 2] = [1.0 / 1.2, 1.2];
/// The same of the side of a unit: cavities that end 50 to 150 um from the electrodes.
const CLEARANCES: [f64; 2] = [1200.0 / 1300.0, 1400.0 / 1300.0];
/// The same of the pitch, which was not varied: a narrower frame gives way.
const PITCHES: [f64; 2] = [0.98, 1.2];
/// Relative error of the answers near the base case: of a hundred random drawings of the test
/// `drawings_near_the_base_are_within_their_stated_error` of `p2_unit_solved`, which differ by up to
/// 4.6 % from their solutions on the usual cells, and of these.
const NEAR_ERROR: f64 = 0.08;
/// Relative deviation of the lengths that were not varied, and of a case from itself.
const SAME: f64 = 0.01;
const ROUNDING: f64 = 1e-9;
/// One um, and one mN/um of a closing per force for a modulus of 1 MPa, in SI.
const UM: f64 = 1e-6;
const PER_MODULUS: f64 = 1e3;

/// A solved case as the table has it: its columns of answers in um, mN and MPa.
#[derive(Debug, Clone)]
struct Case {
    lengths: [f64; VARIED.len()],
    answers: Vec<f64>,
}

/// The columns of answers: those that keep their sign, and those that do not.
const RATIOS: [&str; 24] = [
    "c_zz", "c_xx", "hot_z", "hot_x", "V_z", "V_p", "c_p", "cxx_1", "czz_1", "cxz_1", "stick_1",
    "cxx_2", "czz_2", "cxz_2", "stick_2", "cxx_3", "czz_3", "cxz_3", "stick_3", "cxx_4", "czz_4",
    "cxz_4", "stick_4", "tilt_z",
];
const SUMS: [&str; 6] = ["tilt_xx", "tilt_xy", "czx_1", "czx_2", "czx_3", "czx_4"];

/// The solved cases with free sides and a Poisson's ratio of 0.49, and the base case among
/// its neighbours.
#[derive(Debug)]
struct Cases {
    base: Case,
    others: Vec<Case>,
    neighbours: Option<Case>,
    /// Lengths of the base case that were not varied, um: half a bump's base, half its top.
    top: f64,
}

static CASES: LazyLock<Cases> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/solved_p2_unit.csv"));
    let rows = |sides: &'static str| {
        table.rows().filter(move |row: &SolvedRow<'_>| {
            row.text("sides") == sides && (row.number("poisson") - 0.49).abs() < 1e-9
        })
    };
    let base = rows("free").find(|row| row.text("case") == "base");
    let missing = || Case {
        lengths: [f64::NAN; VARIED.len()],
        answers: vec![f64::NAN; RATIOS.len() + SUMS.len()],
    };
    Cases {
        base: base.map_or_else(missing, |row| Case::read(&row)),
        others: rows("free").map(|row| Case::read(&row)).collect(),
        neighbours: rows("neighbours").next().map(|row| Case::read(&row)),
        top: base.map_or(f64::NAN, |row| row.number("bump_top_half_um")),
    }
});

impl Case {
    fn read(row: &SolvedRow<'_>) -> Self {
        let length = |varied: &Varied| -> f64 {
            let columns = varied.columns.iter();
            // The top of the bump follows from its height and its flanks.
            let columns = columns.filter(|column| **column != "bump_top_half_um");
            columns.map(|column| row.number(column)).sum()
        };
        Self {
            lengths: std::array::from_fn(|place| length(&VARIED[place])),
            answers: RATIOS
                .iter()
                .chain(&SUMS)
                .map(|column| row.number(column))
                .collect(),
        }
    }
}

impl Cases {
    /// True for the lengths of a solved case, um.
    fn has(&self, lengths: &[f64; VARIED.len()]) -> bool {
        self.others.iter().any(|case| {
            let mut pairs = case.lengths.iter().zip(lengths);
            pairs.all(|(a, b)| (a / b - 1.0).abs() < ROUNDING)
        })
    }

    /// The answers of the table for lengths in um.
    fn at(&self, lengths: &[f64; VARIED.len()]) -> Vec<f64> {
        let mut answers = self.base.answers.clone();
        for (place, length) in lengths.iter().enumerate() {
            let from = self.base.lengths[place];
            // Cases that differ from the base in this length alone.
            let mut alone: Vec<&Case> = self
                .others
                .iter()
                .filter(|case| {
                    (0..VARIED.len()).all(|k| k == place || case.lengths[k] == self.base.lengths[k])
                })
                .collect();
            alone.sort_by(|a, b| a.lengths[place].total_cmp(&b.lengths[place]));
            alone.dedup_by(|a, b| a.lengths[place] == b.lengths[place]);
            let x = (length / from).ln();
            for (k, answer) in answers.iter_mut().enumerate() {
                let base = self.base.answers[k];
                let ratio = k < RATIOS.len();
                let points: Vec<[f64; 2]> = alone
                    .iter()
                    .map(|case| {
                        let y = case.answers[k];
                        let change = if ratio { (y / base).ln() } else { y - base };
                        [(case.lengths[place] / from).ln(), change]
                    })
                    .collect();
                if points.len() < 2 {
                    continue;
                }
                let change = interpolated(&points, x);
                if ratio {
                    *answer *= change.exp();
                } else {
                    *answer += change;
                }
            }
        }
        answers
    }
}

impl UnitDrawing {
    /// Closing of the electrodes per force, of a unit that is cut out of the array: free
    /// sides, the bottom held.
    ///
    /// c ~ c₀ Π (length/length₀)^p with p from solved cases that differ in one length. The
    /// drawing is scaled to the electrode of the table: c E depends on ratios of lengths and
    /// falls as 1/length. Another drawing is solved: [`SolvedStiffness`](super::SolvedStiffness).
    ///
    /// # Errors
    /// [`OutsideUnit`] for a drawing that is neither a case nor near the base case.
    pub fn compliance(&self) -> Result<UnitCompliance, OutsideUnit> {
        self.compliance_by(&CASES.base)
    }

    /// The same among neighbours, as in an array.
    ///
    /// # Errors
    /// As [`UnitDrawing::compliance`].
    pub fn compliance_in_array(&self) -> Result<UnitCompliance, OutsideUnit> {
        self.compliance_by(CASES.neighbours.as_ref().unwrap_or(&CASES.base))
    }

    fn compliance_by(&self, sides: &Case) -> Result<UnitCompliance, OutsideUnit> {
        let cases = &*CASES;
        let scale = self.electrode / ELECTRODE;
        let lengths = VARIED
            .each_ref()
            .map(|varied| (varied.of)(self) / (scale * UM));
        let error = if cases.has(&lengths) {
            SOLVED_ERROR
        } else {
            for ((varied, length), base) in VARIED.iter().zip(lengths).zip(cases.base.lengths) {
                within(
                    (varied.key, varied.quantity),
                    varied.whole * length * scale * UM,
                    varied
                        .near
                        .map(|end| varied.whole * end * base * scale * UM),
                )?;
            }
            NEAR_ERROR
        };
        self.check_same(scale)?;
        let mut answers = cases.at(&lengths);
        for (k, answer) in answers.iter_mut().enumerate() {
            if k < RATIOS.len() {
                *answer *= sides.answers[k] / cases.base.answers[k];
            } else {
                *answer += sides.answers[k] - cases.base.answers[k];
            }
        }
        let named = |column: &str| -> f64 {
            let place = RATIOS.iter().chain(&SUMS).position(|name| *name == column);
            place
                .and_then(|place| answers.get(place))
                .copied()
                .unwrap_or(f64::NAN)
        };
        let closing = |column: &str| named(column) * PER_MODULUS / scale;
        let strips = std::array::from_fn(|n| {
            let at = |name: &str| closing(&format!("{name}_{}", n + 1));
            FlankCompliance {
                by_side_force: [at("cxx"), at("czx")],
                by_downward_force: [at("cxz"), at("czz")],
                stick: named(&format!("stick_{}", n + 1)),
            }
        });
        let side = 0.5 * (self.unit_side - self.wall_width);
        Ok(UnitCompliance {
            c_zz: closing("c_zz"),
            c_xx: closing("c_xx"),
            hot_z: named("hot_z"),
            hot_x: named("hot_x"),
            tilt_z: named("tilt_z"),
            tilt_x: [named("tilt_xx"), named("tilt_xy")],
            strips,
            volume_by_force: named("V_z") * UM * UM * PER_MODULUS * scale,
            volume_by_pressure: named("V_p") * UM * UM * UM * scale.powi(3),
            opening_by_pressure: named("c_p") * UM * scale,
            cavity_volume: side * side * self.air_gap,
            error,
        })
    }

    /// Lengths that were the same in all cases.
    fn check_same(&self, scale: f64) -> Result<(), OutsideUnit> {
        let base = CASES.base.lengths[4];
        // Flanks of the base case.
        let steepness = (0.5 * BUMP_BASE - CASES.top * UM) / (base * UM);
        for (name, given, needed) in [
            (
                ("suspension.centre_distance", "centres apart"),
                self.centre_distance,
                CENTRES * scale,
            ),
            (
                ("outline.bump_base", "a bump's base"),
                self.bump_base,
                BUMP_BASE * scale,
            ),
            (
                (
                    "outline.bump_top",
                    "a bump's top with the flanks of a wet-etched mould",
                ),
                self.bump_top,
                self.bump_base - 2.0 * steepness * self.bump_height,
            ),
        ] {
            let slack = SAME * self.bump_base;
            within(name, given, [needed - slack, needed + slack])?;
        }
        let thickness = NEAR.map(|end| end * ELECTRODE_THICKNESS * scale);
        within(
            ("outline.electrode_thickness", "an electrode's thickness"),
            self.electrode_thickness,
            thickness,
        )?;
        let pitches = PITCHES.map(|end| end * PITCH * scale);
        within(("array.pitch", "a pitch"), self.pitch, pitches)
    }
}

/// Refuses a length outside its range; `name` is its key and what it is.
fn within(
    (key, quantity): (&'static str, &'static str),
    given: f64,
    range: [f64; 2],
) -> Result<(), OutsideUnit> {
    let [least, greatest] = range;
    if given >= least * (1.0 - ROUNDING) && given <= greatest * (1.0 + ROUNDING) {
        return Ok(());
    }
    Err(OutsideUnit {
        key,
        quantity,
        given,
        range,
    })
}

/// Lengths of the base case that are the same in every row, m: side of an electrode, distance
/// of the centres, base of the bump, side of the block.
const ELECTRODE: f64 = 400e-6;
const ELECTRODE_THICKNESS: f64 = 20e-6;
const CENTRES: f64 = 700e-6;
const BUMP_BASE: f64 = 700e-6;
const PITCH: f64 = 2e-3;

impl UnitCompliance {
    /// Mean closing per normal force, m/N, with the air of the cavities kept in them or not.
    ///
    /// Sealed, at constant temperature: c = (1/E) [c_zz − c_p V_z (P₀/V₀)/(E + P₀ V_p/V₀)].
    ///
    /// `modulus` in Pa.
    pub fn normal(&self, modulus: f64, cavity: Cavity) -> f64 {
        let kept = match cavity {
            Cavity::Vented => 0.0,
            Cavity::Sealed => {
                let air = AIR_PRESSURE / self.cavity_volume;
                let lost = self.opening_by_pressure * self.volume_by_force * air;
                lost / (modulus + self.volume_by_pressure * air)
            }
        };
        (self.c_zz - kept) / modulus
    }

    /// Largest relative error of [`Self::normal`]: of sealed cavities, whose air takes most of the
    /// closing back, as many times that of the closings as they are stiffer than vented ones.
    pub fn normal_error(&self, modulus: f64, cavity: Cavity) -> f64 {
        self.error * self.normal(modulus, Cavity::Vented) / self.normal(modulus, cavity)
    }

    /// d_x per side force and normal force per side force that the contact adds, m/N and
    /// without unit: at the flat top none; a bar that sticks keeps its line from rising.
    ///
    /// The same with sealed cavities: how their air resists a tilt is not in the table.
    ///
    /// `modulus` in Pa.
    pub fn side(&self, modulus: f64, contact: SideContact) -> (f64, f64) {
        let Bar { height, grip } = match contact {
            SideContact::Top => return (self.c_xx / modulus, 0.0),
            SideContact::Bar(bar) => bar,
        };
        let along = |of: fn(&FlankCompliance) -> f64| {
            let points: [[f64; 2]; 4] = std::array::from_fn(|n| [STRIPS[n], of(&self.strips[n])]);
            interpolated(&points, height)
        };
        let down = match grip {
            Grip::Sticks => along(|strip| strip.stick),
            Grip::Slips => 0.0,
        };
        let x = along(|strip| strip.by_side_force[0])
            + down * along(|strip| strip.by_downward_force[0]);
        let z = along(|strip| strip.by_side_force[1])
            + down * along(|strip| strip.by_downward_force[1]);
        (x / modulus, z / self.c_zz)
    }

    /// Normal force on the flat top at which the electrodes of a vented unit touch at the
    /// hottest point, N: F = a E/(hot c_zz).
    pub fn first_touch(&self, modulus: f64, air_gap: f64) -> f64 {
        air_gap * modulus / (self.hot_z * self.c_zz)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_read() {
        let cases = &*CASES;
        assert!(cases.others.len() >= 14 && cases.neighbours.is_some());
        for case in cases.others.iter().chain(&cases.neighbours) {
            let numbers = case.lengths.iter().chain(&case.answers);
            assert!(numbers.clone().all(|number| number.is_finite()), "{case:?}");
        }
    }
}
