//! One three-axis unit: mechanics and plates together, the model that
//! estimation inverts.

use super::{PlateSlopes, Plates, RestReading, ThreeAxisResponse};
use crate::mechanics::{SIDE_X, SIDE_Y, Suspension, ThreeAxisDeformation};

/// Force on the bump to four capacitances: [`Suspension`], then [`Plates`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeAxisModel {
    /// Force to motion of the tiles.
    pub suspension: Suspension,
    /// Motion of the tiles to capacitance.
    pub plates: Plates,
}

/// Capacitances with their slopes against the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeAxisLinearisation {
    /// Capacitances 11, 12, 21, 22, F.
    pub capacitance: [f64; 4],
    /// ∂C/∂F, F/N: one row per capacitor, columns x, y, z.
    pub jacobian: [[f64; 3]; 4],
}

/// Displacements read from four capacitances by the published inverse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectiveMotion {
    /// d_x, d_y, d_z, m (P2 Eqs. 7-9).
    pub displacement: [f64; 3],
    /// (D11 + D22 − D12 − D21)/4, m: zero for any rigid or parallel motion.
    pub twist: f64,
}

impl ThreeAxisModel {
    /// Deformation and response under `force`, N. Beyond first contact both
    /// stay as they are there: bounds.
    pub fn predict(&self, force: [f64; 3]) -> (ThreeAxisDeformation, ThreeAxisResponse) {
        let free = self.suspension.deform(force);
        let deformation = free.at_share(self.plates.open_share(&free));
        (deformation, self.plates.respond(&free))
    }

    /// Share of `force`, N, at which the first tile touches on the straight way
    /// from rest; 1 while all are open.
    pub fn open_share(&self, force: [f64; 3]) -> f64 {
        self.plates.open_share(&self.suspension.deform(force))
    }

    /// Capacitances at rest, F.
    pub fn rest(&self) -> [f64; 4] {
        std::array::from_fn(|i| self.plates.rest_capacitance(i))
    }

    /// Capacitances and analytic Jacobian at `force`, N; `None` when a tile
    /// touches there.
    pub fn linearise(&self, force: [f64; 3]) -> Option<ThreeAxisLinearisation> {
        let deformation = self.suspension.deform(force);
        let at = self.plates.respond_with_slopes(&deformation)?;
        Some(self.chain(force, &at))
    }

    /// The same continued past first contact
    /// ([`Plates::respond_past_contact`]).
    pub fn linearise_past_contact(&self, force: [f64; 3]) -> Option<ThreeAxisLinearisation> {
        let deformation = self.suspension.deform(force);
        let at = self.plates.respond_past_contact(&deformation)?;
        Some(self.chain(force, &at))
    }

    /// Slopes against the force from those against the motion.
    fn chain(&self, force: [f64; 3], at: &PlateSlopes) -> ThreeAxisLinearisation {
        let by_force = self.suspension.displacement_by_force(force);
        let share = self.suspension.tile_tilt / self.suspension.centre_distance;
        let by_z = at.by_closing;
        let [by_x, by_y] = [(0, SIDE_X), (1, SIDE_Y)].map(|(axis, side)| -> [f64; 4] {
            std::array::from_fn(|i| 0.5 * side[i] * by_z[i] + share * at.by_slope[axis][i])
        });
        let jacobian = std::array::from_fn(|i| {
            std::array::from_fn(|axis| {
                by_x[i] * by_force[0][axis]
                    + by_y[i] * by_force[1][axis]
                    + by_z[i] * by_force[2][axis]
            })
        });
        ThreeAxisLinearisation {
            capacitance: at.capacitance,
            jacobian,
        }
    }

    /// The published small-motion inverse (P2 Eqs. 4-9, signs corrected):
    /// effective gap d_eff = ε₀ab/(C − C_par), D = d_eff(rest) − d_eff; with edges from the
    /// drawing that gap at which a parallel tile has the capacitance C.
    ///
    /// `rest` and `capacitance` in F. Exact for parallel tiles; with tilted
    /// tiles off by less than 2 % of full scale.
    pub fn effective_motion(&self, rest: [f64; 4], capacitance: [f64; 4]) -> EffectiveMotion {
        PublishedInverse::new(self.plates, rest).motion(capacitance)
    }

    /// Force by the published inverse, N; `None` for a singular compliance.
    pub fn effective_force(&self, rest: [f64; 4], capacitance: [f64; 4]) -> Option<[f64; 3]> {
        let motion = self.effective_motion(rest, capacitance);
        self.suspension.force_from_displacement(motion.displacement)
    }

    /// Nearly the force by the published inverse from the rest of the model, N: where a search
    /// begins. `None` for a singular compliance.
    pub fn nearly_force(&self, capacitance: [f64; 4]) -> Option<[f64; 3]> {
        let closing = std::array::from_fn(|i| self.plates.nearly_closing(i, capacitance[i]));
        let motion = motion_of(closing);
        self.suspension.force_from_displacement(motion.displacement)
    }

    /// The same unit with the air gaps that its measured rest capacitances
    /// imply: g = ε₀ab/(C₀ − C_par − C_edge), air = g − d_ins/ε_ins.
    ///
    /// `rest` in F, NaN for a capacitor without a reading, whose gap is kept.
    /// `None` when a rest value leaves no air.
    pub fn at_rest(&self, rest: [f64; 4]) -> Option<Self> {
        let mut unit = *self;
        for (i, rest) in rest
            .into_iter()
            .enumerate()
            .filter(|(_, rest)| !rest.is_nan())
        {
            let plates = &mut unit.plates;
            let air = plates.air_gap_from(i, rest);
            if !(air > 0.0 && air.is_finite()) {
                return None;
            }
            plates.air_gap[i] = air;
        }
        Some(unit)
    }
}

/// [`ThreeAxisModel::effective_motion`] of many readings from one rest, whose gaps are looked for once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedInverse {
    plates: Plates,
    rest: [RestReading; 4],
}

impl PublishedInverse {
    /// The inverse from the capacitances `rest`, F.
    pub fn new(plates: Plates, rest: [f64; 4]) -> Self {
        Self {
            plates,
            rest: std::array::from_fn(|i| plates.rest_reading(i, rest[i])),
        }
    }

    /// Motion from rest to `capacitance`, F.
    pub fn motion(&self, capacitance: [f64; 4]) -> EffectiveMotion {
        let closing = |i| {
            self.plates
                .effective_closing(i, self.rest[i], capacitance[i])
        };
        motion_of(std::array::from_fn(closing))
    }
}

/// Motion of parallel tiles that have closed by so much, m.
fn motion_of([c11, c12, c21, c22]: [f64; 4]) -> EffectiveMotion {
    EffectiveMotion {
        displacement: [
            0.5 * (c12 + c22 - c11 - c21),
            0.5 * (c11 + c12 - c21 - c22),
            0.25 * (c11 + c12 + c21 + c22),
        ],
        twist: 0.25 * (c11 + c22 - c12 - c21),
    }
}
