//! The bump on its four tiles: a rigid pyramid on a spring (P2, figures 6, 7).

use schemars::JsonSchema;
use serde::Deserialize;

use taxel_numerics::dense;

use super::elastic_unit::{ElasticDescription, OutsideUnit, UnitCompliance, UnitDrawing};
use super::solved_unit::SolvedStiffness;
use crate::of_drawing::OfDrawing;
use crate::quantity::{
    self, Checked, Fraction, OneOrList, PositiveLength, PositiveStiffness, Ratio,
};

/// Side of each capacitor 11, 12, 21, 22 along x: `1j` is at -x, `i2` at +x.
pub const SIDE_X: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];
/// Side of each capacitor along y: row `1j` is at +y.
pub const SIDE_Y: [f64; 4] = [1.0, 1.0, -1.0, -1.0];

/// The suspension as a sensor file gives it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuspensionDescription {
    /// Distance between the centres of neighbouring capacitors of a unit, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub centre_distance: f64,
    /// Spring constants for x, y and z, N/m: force over the displacements of
    /// the published inverse (P2 Eqs. 7-9). Typed in; without them the table
    /// `from_drawing` is needed.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<3, PositiveStiffness, _>"
    )]
    #[schemars(with = "Option<[Checked<PositiveStiffness>; 3]>")]
    pub stiffness: Option<[f64; 3]>,
    /// Share of the bump's tilt that each tile follows: 1, the four tiles are
    /// one rigid plane; 0, each tile sinks parallel. Goes with `stiffness`.
    #[serde(default, deserialize_with = "quantity::optional::<Fraction, _>")]
    #[schemars(with = "Option<Checked<Fraction>>")]
    pub tile_tilt: Option<f64>,
    /// Normal force that a unit of side force along x, y adds because the
    /// probe sinks into the soft bump (even in the side force). Goes with
    /// `stiffness`.
    #[serde(
        default,
        deserialize_with = "quantity::optional_one_or_list::<2, Ratio, _>"
    )]
    #[schemars(with = "Option<OneOrList<2, Ratio>>")]
    pub bump_sinking: Option<[f64; 2]>,
    /// The stiffness follows from the drawing of wall, cavities, layers and
    /// bump, in the place of `stiffness`, `tile_tilt` and `bump_sinking`.
    #[serde(default)]
    pub from_drawing: Option<ElasticDescription>,
    /// The closings that were solved, where the drawing is beside the table.
    #[serde(skip)]
    #[schemars(skip)]
    pub(crate) solved: OfDrawing<SolvedStiffness>,
}

/// The mechanics of one unit: force on the bump to motion of its four tiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspension {
    /// Displacement per force, m/N; diagonal unless cross-talk is calibrated.
    pub compliance: [[f64; 3]; 3],
    /// Distance between the centres of neighbouring capacitors, m.
    pub centre_distance: f64,
    /// Share of the bump's tilt that each tile follows, 0 to 1.
    pub tile_tilt: f64,
    /// Added normal force per side force along x, y.
    pub bump_sinking: [f64; 2],
    /// How much nearer the nearest point of a tile comes than its centre, over the closing
    /// there: of d_x, d_y and d_z. Zero where the tiles are plane.
    pub bulge: [f64; 3],
}

/// Motion of the four tiles of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeAxisDeformation {
    /// d_x, d_y, d_z of P2 Eqs. 7-9, m: differences of closing between the two
    /// sides for x and y, mean closing for z.
    pub displacement: [f64; 3],
    /// Closing at the centre of the capacitors 11, 12, 21, 22, m; positive
    /// makes the gap smaller.
    pub closing: [f64; 4],
    /// Slopes of the tiles along x and y.
    pub slope: [f64; 2],
    /// How much nearer the nearest point of each tile comes than its centre, m; beside what
    /// the slopes do.
    pub bulge: [f64; 4],
}

impl ThreeAxisDeformation {
    /// The same motion at `share` of the way from rest.
    #[must_use]
    pub fn at_share(&self, share: f64) -> Self {
        Self {
            displacement: self.displacement.map(|d| share * d),
            closing: self.closing.map(|w| share * w),
            slope: self.slope.map(|slope| share * slope),
            bulge: self.bulge.map(|bulge| share * bulge),
        }
    }
}

impl SuspensionDescription {
    /// The model this description states for the lengths of `unit`.
    ///
    /// # Errors
    /// [`OutsideUnit`] when the stiffness does not follow from this drawing.
    pub fn model(&self, unit: &UnitDrawing) -> Result<Suspension, OutsideUnit> {
        match &self.from_drawing {
            Some(elastic) => {
                let [cut_out, _] = self.closings(unit)?;
                Ok(Suspension::of_drawing(elastic, unit, &cut_out))
            }
            None => Ok(self.typed_in()),
        }
    }

    /// Closings per force of a unit that is cut out of the array, and of one among others: of
    /// the table, or as solved.
    ///
    /// # Errors
    /// [`OutsideUnit`] for a drawing that is beside the table and was not solved.
    pub fn closings(&self, unit: &UnitDrawing) -> Result<[UnitCompliance; 2], OutsideUnit> {
        match (self.solved.0, unit.compliance()) {
            (Some(solved), Err(_)) => Ok(solved.sides),
            (_, cut_out) => Ok([cut_out?, unit.compliance_in_array()?]),
        }
    }

    /// True if the closings were solved: no table has the drawing.
    pub fn is_solved(&self, unit: &UnitDrawing) -> bool {
        self.solved.0.is_some() && unit.compliance().is_err()
    }

    /// The model of the constants that are typed in; rigid where there are none.
    pub(crate) fn typed_in(&self) -> Suspension {
        let [x, y, z] = self.stiffness.unwrap_or([f64::INFINITY; 3]);
        Suspension {
            compliance: [
                [1.0 / x, 0.0, 0.0],
                [0.0, 1.0 / y, 0.0],
                [0.0, 0.0, 1.0 / z],
            ],
            centre_distance: self.centre_distance,
            tile_tilt: self.tile_tilt.unwrap_or_default(),
            bump_sinking: self.bump_sinking.unwrap_or_default(),
            bulge: [0.0; 3],
        }
    }
}

impl Suspension {
    /// The suspension of an elastic unit: d = (1/E) c F, a bar's downward force as sinking,
    /// the slope of the tiles along a side force as their tilt.
    ///
    /// What bends a tile without tilting it along the force enters where tiles touch: as how
    /// much nearer the hottest point comes.
    pub fn of_drawing(
        elastic: &ElasticDescription,
        unit: &UnitDrawing,
        compliance: &UnitCompliance,
    ) -> Self {
        let z = compliance.normal(elastic.modulus, elastic.cavity);
        let (x, sinking) = compliance.side(elastic.modulus, elastic.side_contact);
        Self {
            compliance: [[x, 0.0, 0.0], [0.0, x, 0.0], [0.0, 0.0, z]],
            centre_distance: unit.centre_distance,
            tile_tilt: compliance.tilt_x[0],
            bump_sinking: [sinking; 2],
            bulge: [compliance.hot_x, compliance.hot_x, compliance.hot_z].map(|hot| hot - 1.0),
        }
    }

    /// Motion of the tiles under `force` = (F_x, F_y, F_z) on the bump, N.
    ///
    /// F_z,apparent = F_z + c_x|F_x| + c_y|F_y|;  d = S·F;
    /// w_i = d_z + sx_i d_x/2 + sy_i d_y/2;  slope = η d/L (P2 section 4).
    ///
    /// Pressing is positive F_z; positive F_x closes 12 and 22, positive F_y
    /// closes 11 and 12.
    pub fn deform(&self, force: [f64; 3]) -> ThreeAxisDeformation {
        let [x, y, z] = force;
        let apparent = [
            x,
            y,
            z + self.bump_sinking[0] * x.abs() + self.bump_sinking[1] * y.abs(),
        ];
        self.deformation_of(self.compliance.map(|row| dense::dot3(row, apparent)))
    }

    /// Motion of the tiles for given displacements d_x, d_y, d_z, m.
    fn deformation_of(&self, displacement: [f64; 3]) -> ThreeAxisDeformation {
        let [x, y, z] = displacement;
        let closing = std::array::from_fn(|i| z + 0.5 * (SIDE_X[i] * x + SIDE_Y[i] * y));
        let share = self.tile_tilt / self.centre_distance;
        let [over_x, over_y, over_z] = self.bulge;
        let bulge = std::array::from_fn(|i| {
            over_z * z + 0.5 * (over_x * SIDE_X[i] * x + over_y * SIDE_Y[i] * y)
        });
        ThreeAxisDeformation {
            displacement,
            closing,
            slope: [share * x, share * y],
            bulge,
        }
    }

    /// Spring constants of the displacements d_x, d_y, d_z, each under its own force, N/m.
    pub fn stiffness(&self) -> [f64; 3] {
        std::array::from_fn(|axis| 1.0 / self.compliance[axis][axis])
    }

    /// ∂d/∂F at `force`, m/N, rows d_x, d_y, d_z; the bump's sinking included.
    pub fn displacement_by_force(&self, force: [f64; 3]) -> [[f64; 3]; 3] {
        let sink_x = self.bump_sinking[0] * sign(force[0]);
        let sink_y = self.bump_sinking[1] * sign(force[1]);
        self.compliance
            .map(|[x, y, z]| [x + z * sink_x, y + z * sink_y, z])
    }

    /// Force that makes the displacements `displacement`, N: the inverse of
    /// [`Suspension::deform`] without its capacitors.
    ///
    /// `None` when the compliance is singular.
    pub fn force_from_displacement(&self, displacement: [f64; 3]) -> Option<[f64; 3]> {
        let [x, y, apparent] = dense::solve3(self.compliance, displacement)?;
        let z = apparent - self.bump_sinking[0] * x.abs() - self.bump_sinking[1] * y.abs();
        Some([x, y, z])
    }
}

/// Slope of |x|, 0 at 0.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn suspension() -> Suspension {
        SuspensionDescription {
            centre_distance: 700e-6,
            stiffness: Some([9620.0, 10400.0, 10400.0]),
            tile_tilt: Some(1.0),
            bump_sinking: Some([0.1, 0.2]),
            from_drawing: None,
            solved: OfDrawing(None),
        }
        .typed_in()
    }

    #[test]
    fn positive_side_forces_close_their_own_side() {
        let x = suspension().deform([1e-3, 0.0, 0.0]);
        assert!(x.closing[1] > x.closing[0] && x.closing[3] > x.closing[2]);
        let y = suspension().deform([0.0, 1e-3, 0.0]);
        assert!(y.closing[0] > y.closing[2] && y.closing[1] > y.closing[3]);
    }

    #[test]
    fn force_from_displacement_inverts_deform() {
        let mut model = suspension();
        model.compliance[0][1] = 3e-6;
        model.compliance[2][0] = -2e-6;
        let force = [3e-3, -7e-3, 11e-3];
        let back = model
            .force_from_displacement(model.deform(force).displacement)
            .unwrap();
        for (a, b) in back.iter().zip(force) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    #[test]
    fn displacement_by_force_is_the_derivative() {
        let model = suspension();
        let force = [3e-3, -7e-3, 11e-3];
        let jacobian = model.displacement_by_force(force);
        for axis in 0..3 {
            let (mut up, mut down) = (force, force);
            up[axis] += 1e-6;
            down[axis] -= 1e-6;
            let (up, down) = (
                model.deform(up).displacement,
                model.deform(down).displacement,
            );
            for row in 0..3 {
                // deform is piecewise linear, so the difference is exact up to rounding.
                assert!(((up[row] - down[row]) / 2e-6 - jacobian[row][axis]).abs() < 1e-13);
            }
        }
    }
}
