//! Four capacitances to a three-axis force with covariance (P2 section 8).

use crate::transduction::ThreeAxisModel;
use taxel_numerics::dense::dot3;

/// Options of the search; the defaults suit every unit of the papers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Most steps of the search; default 25.
    pub most_steps: usize,
    /// The search ends when one more step would lower the misfit by less than
    /// this; default 1e-14, which is a step of 1e-7 standard deviations.
    pub least_gain: f64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
            most_steps: 25,
            least_gain: 1e-14,
        }
    }
}

/// End of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// At the least misfit.
    Converged,
    /// The best fit lies beyond first contact: the force is that of first
    /// contact on the straight way to it.
    Blocked,
    /// After the allowed number of steps.
    NotConverged,
    /// Fewer than three usable capacitances: no force.
    TooFew,
}

/// Force on one unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitEstimate {
    /// Force x, y, z, N; `NaN` when there is none.
    pub force: [f64; 3],
    /// Covariance (Jᵀ W J)⁻¹, N².
    pub covariance: [[f64; 3]; 3],
    /// Misfit Σ((C − C(F))/σ)² of the best fit; `NaN` with three capacitors, which leave no
    /// check.
    pub chi2: f64,
    /// sign(C11 − C11(F))·√chi2: one standard deviation wide when the model
    /// holds. It detects one bad capacitor but cannot name it.
    pub signed_residual: f64,
    /// End of the search.
    pub outcome: Outcome,
}

impl UnitEstimate {
    /// Standard deviations of the force, N.
    pub fn deviation(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.covariance[axis][axis].sqrt())
    }

    fn without_force() -> Self {
        Self {
            force: [f64::NAN; 3],
            covariance: [[f64::NAN; 3]; 3],
            chi2: f64::NAN,
            signed_residual: f64::NAN,
            outcome: Outcome::TooFew,
        }
    }
}

/// Least-squares force for four capacitances by Gauss-Newton from the
/// published inverse. The search may pass first contact, so that the misfit of
/// a closed unit is judged like any other; the force may not.
///
/// `capacitance` and `sigma` (standard deviations) in F, order 11, 12, 21, 22;
/// a capacitor counts only where `usable` is set. Three usable capacitors
/// determine the force without a check; fewer give none.
///
/// ```
/// use taxel::transduction::ThreeAxisModel;
/// use taxel::estimation::{Outcome, SearchOptions, estimate_unit};
/// # let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
/// # let unit: ThreeAxisModel = sensor.three_axis().unwrap().unit_model();
/// let readings = unit.predict([3e-3, 0.0, 8e-3]).1.capacitance();
/// let found = estimate_unit(&unit, readings, [1e-16; 4], [true; 4], &SearchOptions::default());
/// assert_eq!(found.outcome, Outcome::Converged);
/// assert!((found.force[2] - 8e-3).abs() < 1e-9);
/// ```
pub fn estimate_unit(
    unit: &ThreeAxisModel,
    capacitance: [f64; 4],
    sigma: [f64; 4],
    usable: [bool; 4],
    options: &SearchOptions,
) -> UnitEstimate {
    let count = usable.iter().filter(|usable| **usable).count();
    if count < 3 {
        return UnitEstimate::without_force();
    }
    let weight: [f64; 4] = std::array::from_fn(|i| if usable[i] { 1.0 / sigma[i] } else { 0.0 });
    // A capacitor without weight may read NaN; filled, it drops out.
    let capacitance = fill_missing(unit, capacitance, usable);
    let mut search = Search::new(unit, capacitance, weight);
    if !search.start() {
        return UnitEstimate::without_force();
    }
    let outcome = search.run(options);
    search.finish(outcome, count)
}

/// State of a search: a force within the formula with its residuals and slopes.
struct Search<'a> {
    unit: &'a ThreeAxisModel,
    capacitance: [f64; 4],
    weight: [f64; 4],
    force: [f64; 3],
    /// (C − C(F))/σ.
    residual: [f64; 4],
    /// ∂(C(F)/σ)/∂F: for each axis of the force, the four capacitors.
    slopes: [[f64; 4]; 3],
    /// (Jᵀ W J)⁻¹; `None` when it is singular.
    covariance: Option<[[f64; 3]; 3]>,
    chi2: f64,
}

impl<'a> Search<'a> {
    fn new(unit: &'a ThreeAxisModel, capacitance: [f64; 4], weight: [f64; 4]) -> Self {
        Self {
            unit,
            capacitance,
            weight,
            force: [0.0; 3],
            residual: [0.0; 4],
            slopes: [[0.0; 4]; 3],
            covariance: None,
            chi2: f64::INFINITY,
        }
    }

    /// Moves to nearly the published inverse, scaled until the formula holds.
    fn start(&mut self) -> bool {
        let guess = self.unit.nearly_force(self.capacitance);
        // Zero force is always free of contact, so some scale of the guess is.
        if let Some(guess) = guess.filter(|guess| guess.iter().all(|value| value.is_finite())) {
            let mut scale = 1.0;
            while scale > 7e-4 {
                if self.move_to(guess.map(|value| scale * value)) {
                    return true;
                }
                scale *= 0.7;
            }
        }
        self.move_to([0.0; 3])
    }

    /// Takes `force` when the formula holds there.
    fn move_to(&mut self, force: [f64; 3]) -> bool {
        let Some(at) = self.unit.linearise_past_contact(force) else {
            return false;
        };
        let weight = self.weight;
        self.force = force;
        self.residual =
            std::array::from_fn(|i| (self.capacitance[i] - at.capacitance[i]) * weight[i]);
        self.slopes =
            std::array::from_fn(|axis| std::array::from_fn(|i| at.jacobian[i][axis] * weight[i]));
        self.covariance = inverse_normal(&self.slopes);
        self.chi2 = dot4(&self.residual, &self.residual);
        true
    }

    fn run(&mut self, options: &SearchOptions) -> Outcome {
        let (mut settled, mut last) = (false, 0.0);
        for _ in 0..options.most_steps {
            let Some(covariance) = &self.covariance else {
                return Outcome::NotConverged;
            };
            let gradient = self.slopes.map(|slopes| dot4(&slopes, &self.residual));
            let step = covariance.map(|row| dot3(row, gradient));
            // δᵀ Jᵀ W J δ: what a full step takes off the misfit if the model
            // is linear.
            let predicted = dot3(step, gradient);
            // Gauss-Newton converges at least linearly: the gain of the step after
            // this one is at most this share of its own.
            let rate = (predicted / last).min(1.0);
            if predicted * rate < options.least_gain {
                self.take_last_step(step);
                return Outcome::Converged;
            }
            last = predicted;
            // Of so small a gain the misfit shows only its rounding.
            settled = predicted < 1e-9 * (1.0 + self.chi2);
            match self.advance(step, settled) {
                Advance::Moved => {}
                Advance::Wall => return Outcome::Blocked,
                Advance::Stuck => return Outcome::NotConverged,
            }
        }
        if settled {
            Outcome::Converged
        } else {
            Outcome::NotConverged
        }
    }

    /// The last step is too small to change the slopes: residuals move linearly.
    fn take_last_step(&mut self, step: [f64; 3]) {
        let [x, y, z] = &self.slopes;
        for (i, residual) in self.residual.iter_mut().enumerate() {
            *residual -= dot3([x[i], y[i], z[i]], step);
        }
        self.force = std::array::from_fn(|axis| self.force[axis] + step[axis]);
        self.chi2 = dot4(&self.residual, &self.residual);
    }

    /// Halves `step` until the formula holds and, unless `settled`, the misfit
    /// falls.
    fn advance(&mut self, step: [f64; 3], settled: bool) -> Advance {
        let (from, before) = (self.force, self.chi2);
        let mut scale = 1.0;
        let mut wall = false;
        for _ in 0..30 {
            if !self.move_to(std::array::from_fn(|axis| from[axis] + scale * step[axis])) {
                wall = true;
            } else if settled || self.chi2 < before {
                return Advance::Moved;
            }
            scale *= 0.5;
        }
        self.move_to(from);
        if wall { Advance::Wall } else { Advance::Stuck }
    }

    fn finish(&self, outcome: Outcome, count: usize) -> UnitEstimate {
        let (chi2, signed_residual) = if count == 4 {
            let sign = if self.residual[0] < 0.0 { -1.0 } else { 1.0 };
            (self.chi2, sign * self.chi2.sqrt())
        } else {
            (f64::NAN, f64::NAN)
        };
        let share = self.unit.open_share(self.force);
        let touches = share < 1.0 && outcome == Outcome::Converged;
        UnitEstimate {
            force: self.force.map(|force| share * force),
            covariance: self.covariance.unwrap_or([[f64::NAN; 3]; 3]),
            chi2,
            signed_residual,
            outcome: if touches { Outcome::Blocked } else { outcome },
        }
    }
}

enum Advance {
    Moved,
    Wall,
    Stuck,
}

/// A missing capacitor gets the value for which the twist is zero.
fn fill_missing(unit: &ThreeAxisModel, capacitance: [f64; 4], usable: [bool; 4]) -> [f64; 4] {
    let Some(missing) = usable.iter().position(|usable| !usable) else {
        return capacitance;
    };
    let plates = &unit.plates;
    let closing = |i: usize| plates.air_gap[i] - plates.air_gap_from(i, capacitance[i]);
    // D11 + D22 = D12 + D21: the one opposite stands on the same side.
    let opposite = 3 - missing;
    let others: f64 = (0..4)
        .filter(|i| *i != missing && *i != opposite)
        .map(closing)
        .sum();
    let closed = others - closing(opposite);
    let mut filled = capacitance;
    filled[missing] = if closed < plates.rest_gap(missing) {
        plates.parallel_reading(missing, closed)
    } else {
        plates.rest_capacitance(missing)
    };
    filled
}

fn dot4(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    (a[0] * b[0] + a[2] * b[2]) + (a[1] * b[1] + a[3] * b[3])
}

/// (J Jᵀ)⁻¹ for the three rows of `slopes`, by cofactors; `None` when singular.
/// Its condition number stays below a few hundred for any unit of this kind, so
/// nothing is lost against a factorisation.
fn inverse_normal([x, y, z]: &[[f64; 4]; 3]) -> Option<[[f64; 3]; 3]> {
    let (xx, xy, xz) = (dot4(x, x), dot4(x, y), dot4(x, z));
    let (yy, yz, zz) = (dot4(y, y), dot4(y, z), dot4(z, z));
    let first = [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy];
    let scale = 1.0 / dot3([xx, xy, xz], first);
    let [ixx, ixy, ixz] = first.map(|cofactor| cofactor * scale);
    let iyy = (xx * zz - xz * xz) * scale;
    let iyz = (xy * xz - xx * yz) * scale;
    let izz = (xx * yy - xy * xy) * scale;
    let invertible = scale > 0.0 && scale.is_finite();
    invertible.then_some([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
}
