//! Stress that relaxes: linear viscoelasticity at finite strain.
//!
//! The second Piola-Kirchhoff stress of the isochoric law `S0` relaxes by a Prony series
//! `g(t) = 1 - sum g_i (1 - exp(-t / tau_i))` (Simo 1987; Holzapfel 2000, section 6.10):
//! `S = (1 - sum g_i) S0 + sum H_i`, `H_i' + H_i / tau_i = g_i S0'`. The law holds the
//! answer to a sudden load. Every stress rides on the reference shape, so that
//! rotations do not matter. The pressure does not relax; what part of the relaxing
//! stress is mean stress in the deformed shape adds to it.
//!
//! Over a step `S0` is taken as linear in time, and the rest is exact: with
//! `x = dt / tau_i`, `H_i <- e^-x H_i + g_i (1 - e^-x) / x (S0 - S0_before)`. So in a step
//! `S = factor S0 + carried`, with one factor for all points and a stress for each point
//! that stays the same in all iterations: see [`History::begin_step`] and
//! [`Response::relaxed`].

use super::constants::{positive, within};
use super::{Law, MaterialError, Response};
use crate::scalar::{PAIRS, PLACE, Scalar, Symmetric, Tensor, determinant, inverse};

/// One term of a Prony series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PronyTerm {
    /// Part of the sudden stress that this term loses, 0 to 1.
    pub fraction: f64,
    /// Relaxation time, s.
    pub time: f64,
}

/// A Prony series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Relaxation {
    terms: Vec<PronyTerm>,
}

impl Relaxation {
    /// A series of checked terms; none is an elastic solid.
    ///
    /// # Errors
    /// [`MaterialError::OutOfRange`] for a negative fraction, fractions that leave no
    /// stress in the end, or a time that is not positive.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::material::viscoelastic::{PronyTerm, Relaxation};
    ///
    /// let slow = PronyTerm { fraction: 0.2, time: 5.0 };
    /// let relaxation = Relaxation::new(&[slow])?;
    /// assert!((relaxation.remaining(f64::INFINITY) - 0.8).abs() < 1e-15);
    /// # Ok::<(), taxel_fem::material::MaterialError>(())
    /// ```
    pub fn new(terms: &[PronyTerm]) -> Result<Self, MaterialError> {
        for term in terms {
            let g = term.fraction;
            within(
                "relaxation fraction",
                g,
                "0 to less than 1",
                (0.0..1.0).contains(&g),
            )?;
            positive("relaxation time [s]", term.time)?;
        }
        let sum = terms.iter().map(|term| term.fraction).sum::<f64>();
        within(
            "sum of the relaxation fractions",
            sum,
            "less than 1",
            sum < 1.0,
        )?;
        Ok(Self {
            terms: terms.to_vec(),
        })
    }

    /// The terms.
    pub fn terms(&self) -> &[PronyTerm] {
        &self.terms
    }

    /// Part of the sudden stress that is left after `time` in s, `g(t)`.
    pub fn remaining(&self, time: f64) -> f64 {
        let lost = |term: &PronyTerm| term.fraction * libm::expm1(-time / term.time);
        1.0 + self.terms.iter().map(lost).sum::<f64>()
    }
}

/// History of the points of a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    relaxation: Relaxation,
    /// `S0` of each point at the end of the last step, Pa.
    elastic: Vec<Symmetric<f64>>,
    /// `H_i` of each point, the terms of a point side by side, Pa.
    relaxing: Vec<Symmetric<f64>>,
    carried: Vec<Symmetric<f64>>,
    /// `e^-x` and `g_i (1 - e^-x) / x` of each term in this step.
    step: Vec<(f64, f64)>,
}

impl History {
    /// Points that have been without stress for ever.
    pub fn new(relaxation: &Relaxation, points: usize) -> Self {
        let terms = relaxation.terms.len();
        Self {
            relaxation: relaxation.clone(),
            elastic: vec![[0.0; 6]; points],
            relaxing: vec![[0.0; 6]; points * terms],
            carried: vec![[0.0; 6]; points],
            step: vec![(1.0, 0.0); terms],
        }
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.elastic.len()
    }

    /// Starts a step of `duration` in s and returns its factor: isochoric stress and tangent
    /// of all points are multiplied by it. Zero is a sudden load, infinity the final rest.
    /// A step that failed is started again with another duration.
    ///
    /// # Errors
    /// [`MaterialError::OutOfRange`] for a negative duration.
    pub fn begin_step(&mut self, duration: f64) -> Result<f64, MaterialError> {
        within(
            "duration of a step [s]",
            duration,
            "0 or greater",
            duration >= 0.0,
        )?;
        let mut factor = 1.0;
        for (step, term) in self.step.iter_mut().zip(&self.relaxation.terms) {
            let x = duration / term.time;
            let mean = mean_decay(x);
            *step = (libm::exp(-x), term.fraction * mean);
            factor -= term.fraction * (1.0 - mean);
        }
        for point in 0..self.elastic.len() {
            self.carried[point] = self.carry(point);
        }
        Ok(factor)
    }

    /// Second Piola-Kirchhoff stress, Pa, that the past adds at a point in this step.
    ///
    /// # Panics
    /// Where there is no such point.
    pub fn carried(&self, point: usize) -> &Symmetric<f64> {
        &self.carried[point]
    }

    /// Greatest change of `S0` from another history of the same points to this one, and the
    /// greatest `S0` of both, Pa.
    pub(crate) fn change_from(&self, before: &Self) -> (f64, f64) {
        let (mut change, mut size) = (0.0_f64, 0.0_f64);
        for (now, old) in self.elastic.iter().zip(&before.elastic) {
            for (now, old) in now.iter().zip(old) {
                change = change.max((now - old).abs());
                size = size.max(now.abs()).max(old.abs());
            }
        }
        (change, size)
    }

    /// Ends the step at a point, once, at its deformation gradient `f`.
    ///
    /// # Panics
    /// Where there is no such point.
    pub fn end_step(&mut self, point: usize, law: &Law, f: &Tensor<f64>) {
        let elastic = pulled_back(&law.response(f).stress, f);
        let terms = self.step.len();
        let relaxing = &mut self.relaxing[point * terms..(point + 1) * terms];
        for (stress, (decay, share)) in relaxing.iter_mut().zip(&self.step) {
            for v in 0..6 {
                let change = elastic[v] - self.elastic[point][v];
                stress[v] = decay * stress[v] + share * change;
            }
        }
        self.elastic[point] = elastic;
    }

    /// `sum (e^-x H_i - g_i (1 - e^-x) / x S0_before)`.
    fn carry(&self, point: usize) -> Symmetric<f64> {
        let terms = self.step.len();
        let relaxing = &self.relaxing[point * terms..(point + 1) * terms];
        let mut carried = [0.0; 6];
        for (stress, (decay, share)) in relaxing.iter().zip(&self.step) {
            for v in 0..6 {
                carried[v] += decay * stress[v] - share * self.elastic[point][v];
            }
        }
        carried
    }
}

/// `(1 - e^-x) / x`, the mean of `e^-x` over a step.
fn mean_decay(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -libm::expm1(-x) / x }
}

impl<S: Scalar> Response<S> {
    /// The response of a solid that relaxes, from that of its law at `f`: the factor of the
    /// step and the carried stress (second Piola-Kirchhoff, Pa) of a [`History`].
    ///
    /// `tau = factor tau0 + F S F^T`; the tangent is only scaled, since `S` is constant. The
    /// energy becomes the potential of the step, `factor W + S : (F^T F - 1) / 2`.
    #[inline(always)]
    #[must_use]
    pub fn relaxed(mut self, f: &Tensor<S>, factor: f64, carried: &Symmetric<S>) -> Self {
        let k = S::constant(factor);
        let pushed = pushed_forward(carried, f);
        let trace = pushed[0] + pushed[1] + pushed[2];
        let rest = carried[0] + carried[1] + carried[2];
        self.energy = self.energy * k + (trace - rest) * S::constant(0.5);
        for v in 0..6 {
            self.stress[v] = self.stress[v] * k + pushed[v];
            for w in 0..6 {
                self.tangent[v][w] = self.tangent[v][w] * k;
            }
        }
        self
    }
}

/// `F S F^T`.
#[inline(always)]
fn pushed_forward<S: Scalar>(s: &Symmetric<S>, f: &Tensor<S>) -> Symmetric<S> {
    let row = |i: usize| {
        let [x, y, z] = f[i];
        [
            x * s[0] + y * s[3] + z * s[5],
            x * s[3] + y * s[1] + z * s[4],
            x * s[5] + y * s[4] + z * s[2],
        ]
    };
    let fs = [row(0), row(1), row(2)];
    let entry = |i: usize, j: usize| fs[i][0] * f[j][0] + fs[i][1] * f[j][1] + fs[i][2] * f[j][2];
    [
        entry(0, 0),
        entry(1, 1),
        entry(2, 2),
        entry(0, 1),
        entry(1, 2),
        entry(0, 2),
    ]
}

/// `F^-1 tau F^-T`.
fn pulled_back(tau: &Symmetric<f64>, f: &Tensor<f64>) -> Symmetric<f64> {
    let g = inverse(f, determinant(f));
    PAIRS.map(|(i, j)| {
        let products = (0..9).map(|n| (n / 3, n % 3));
        products
            .map(|(k, l)| g[i][k] * g[j][l] * tau[PLACE[k][l]])
            .sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::dual::Dual;
    use crate::material::tests::{
        LAWS, derivatives_of, product, rotation, tensor, tensor_of_stress, transposed,
    };

    const TERMS: [PronyTerm; 2] = [
        PronyTerm {
            fraction: 0.3,
            time: 0.2,
        },
        PronyTerm {
            fraction: 0.25,
            time: 4.0,
        },
    ];
    const STRETCHED: Tensor<f64> = [[1.3, 0.4, -0.1], [0.2, 0.9, 0.3], [-0.2, 0.1, 0.8]];

    fn relaxation() -> Relaxation {
        Relaxation::new(&TERMS).expect("in range")
    }

    fn shear(amount: f64) -> Tensor<f64> {
        [[1.0, amount, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    }

    /// One step of one point to `f`; its stress.
    fn step(history: &mut History, law: &Law, duration: f64, f: &Tensor<f64>) -> Symmetric<f64> {
        let factor = history.begin_step(duration).expect("not negative");
        let carried = *history.carried(0);
        let stress = law.response(f).relaxed(f, factor, &carried).stress;
        history.end_step(0, law, f);
        stress
    }

    fn close(found: &Symmetric<f64>, exact: &Symmetric<f64>, tolerance: f64) {
        let size = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        for v in 0..6 {
            assert!(
                (found[v] - exact[v]).abs() < tolerance * size,
                "{found:?} {exact:?}"
            );
        }
    }

    #[test]
    fn a_sudden_deformation_relaxes_by_the_series_however_time_is_cut() {
        for law in LAWS {
            let mut history = History::new(&relaxation(), 1);
            let sudden = law.response(&STRETCHED).stress;
            close(&step(&mut history, &law, 0.0, &STRETCHED), &sudden, 1e-15);
            let mut time = 0.0;
            for duration in [1e-9, 1e-3, 0.07, 0.5, 3.0, 0.01, 20.0, f64::INFINITY] {
                time += duration;
                let found = step(&mut history, &law, duration, &STRETCHED);
                let left = sudden.map(|x| relaxation().remaining(time) * x);
                // Pulled back and pushed forward, some products each.
                close(&found, &left, 1e-13);
            }
        }
    }

    #[test]
    fn a_ramp_in_one_step_or_many_has_its_closed_form() {
        // H_i = g_i S0 tau_i / T (1 - exp(-T / tau_i)).
        let law = Law::neo_hookean(1.0);
        let (total, small) = (0.7, 1e-6);
        let exact = 1.0 - TERMS.iter().map(|t| t.fraction).sum::<f64>()
            + TERMS
                .iter()
                .map(|t| t.fraction * t.time / total * (1.0 - (-total / t.time).exp()))
                .sum::<f64>();
        for cuts in [&[1.0][..], &[0.1, 0.15, 0.5, 0.51, 0.9, 1.0]] {
            let mut history = History::new(&relaxation(), 1);
            let (mut before, mut stress) = (0.0, [0.0; 6]);
            for cut in cuts {
                let duration = (cut - before) * total;
                stress = step(&mut history, &law, duration, &shear(cut * small));
                before = *cut;
            }
            // S0 is linear in the shear but for the square of it.
            assert!((stress[3] / small - exact).abs() < 1e-11, "{cuts:?}");
        }
    }

    #[test]
    fn very_short_and_very_long_steps_have_their_limits() {
        let mut history = History::new(&relaxation(), 1);
        assert_eq!(history.begin_step(0.0).expect("zero"), 1.0);
        let rest = history.begin_step(f64::INFINITY).expect("infinity");
        assert!((rest - 0.45).abs() < 1e-15);
        for x in [1e-15, 1e-12, 1e-8, 1e-5] {
            // 1 - x / 2 + x^2 / 6, the next term below the rounding.
            assert!(
                (mean_decay(x) - (1.0 - x / 2.0 + x * x / 6.0)).abs() < 3e-16,
                "{x}"
            );
        }
        assert!(history.begin_step(-1.0).is_err());
        assert!(history.begin_step(f64::NAN).is_err());
    }

    #[test]
    fn series_out_of_range_are_refused() {
        let one = |fraction, time| Relaxation::new(&[PronyTerm { fraction, time }]);
        for bad in [
            one(-0.1, 1.0),
            one(1.0, 1.0),
            one(0.5, 0.0),
            one(f64::NAN, 1.0),
        ] {
            assert!(matches!(bad, Err(MaterialError::OutOfRange { .. })));
        }
        let half = PronyTerm {
            fraction: 0.5,
            time: 1.0,
        };
        let message = Relaxation::new(&[half, half]).unwrap_err().to_string();
        assert!(
            message.contains("sum of the relaxation fractions = 1.0"),
            "{message}"
        );
    }

    /// Work per reference volume of the last of some cycles of shear.
    fn work_of_a_cycle(law: &Law, amplitude: f64, frequency: f64) -> f64 {
        let mut history = History::new(&relaxation(), 1);
        let (cycles, steps) = (20, 400);
        let duration = std::f64::consts::TAU / frequency / f64::from(steps);
        let (mut work, mut before) = (0.0, ([0.0; 6], 0.0));
        for n in 1..=cycles * steps {
            let angle = std::f64::consts::TAU * f64::from(n) / f64::from(steps);
            let amount = amplitude * angle.sin();
            let f = shear(amount);
            let stress = step(&mut history, law, duration, &f);
            if n > (cycles - 1) * steps {
                // In simple shear P12 = tau12 does all work.
                work += 0.5 * (stress[3] + before.0[3]) * (amount - before.1);
            }
            before = (stress, amount);
        }
        work
    }

    #[test]
    fn a_small_cycle_costs_the_loss_modulus() {
        // pi amplitude^2 G sum g_i w tau_i / (1 + w^2 tau_i^2).
        let law = Law::neo_hookean(2.0);
        for frequency in [0.3, 1.0, 6.0] {
            let loss = |t: &PronyTerm| {
                let x = frequency * t.time;
                t.fraction * x / (1.0 + x * x)
            };
            let modulus = 2.0 * TERMS.iter().map(loss).sum::<f64>();
            let exact = std::f64::consts::PI * 1e-8 * modulus;
            let found = work_of_a_cycle(&law, 1e-4, frequency);
            // 400 straight pieces for a circle: (2 pi / 400)^2 / 6 = 4e-5.
            assert!(
                (found / exact - 1.0).abs() < 1e-4,
                "{frequency}: {found} {exact}"
            );
        }
    }

    #[test]
    fn no_cycle_gives_energy() {
        for law in LAWS {
            for (amplitude, frequency) in [(0.05, 1e-3), (0.3, 0.1), (0.6, 2.0), (0.8, 100.0)] {
                let work = work_of_a_cycle(&law, amplitude, frequency);
                assert!(work > 0.0, "{law:?} {amplitude} {frequency}: {work}");
            }
        }
    }

    #[test]
    fn a_rotation_that_grows_turns_the_stress_and_changes_nothing_else() {
        for law in LAWS {
            let (mut still, mut turning) = (
                History::new(&relaxation(), 1),
                History::new(&relaxation(), 1),
            );
            for n in 1..8 {
                let amount = 0.1 * f64::from(n);
                let q = rotation([1.0, amount, -2.0 * amount, 0.3 * amount]);
                let f = shear(amount);
                let tau = step(&mut still, &law, 0.3, &f);
                let turned = step(&mut turning, &law, 0.3, &product(&q, &f));
                let exact = product(&q, &product(&tensor_of_stress(&tau), &transposed(&q)));
                close(&turned, &PAIRS.map(|(i, j)| exact[i][j]), 1e-13);
            }
        }
    }

    #[test]
    fn stress_and_tangent_of_a_step_are_those_of_its_potential() {
        let law = Law::MooneyRivlin { c10: 0.4, c01: 0.1 };
        let carried = [0.3, -0.2, 0.1, 0.25, -0.15, 0.05];
        let response = law.response(&STRETCHED).relaxed(&STRETCHED, 0.7, &carried);
        let g = inverse(&STRETCHED, determinant(&STRETCHED));
        let tau = tensor_of_stress(&response.stress);
        let potential = |f: &Tensor<Dual>| {
            law.response(f)
                .relaxed(f, 0.7, &carried.map(Dual::constant))
                .energy
        };
        for ((i, a), (j, b)) in (0..81).map(|n| ((n / 27, n / 9 % 3), (n / 3 % 3, n % 3))) {
            let exact = derivatives_of(&potential, &STRETCHED, (i, a), (j, b));
            let p: f64 = (0..3).map(|k| tau[i][k] * g[a][k]).sum();
            assert!((p - exact.first).abs() < 1e-13);
            let mut found = 0.0;
            for (k, l) in (0..9).map(|n| (n / 3, n % 3)) {
                let c = response.tangent[PLACE[i][k]][PLACE[j][l]];
                found += g[a][k] * g[b][l] * (c + if i == j { tau[k][l] } else { 0.0 });
            }
            assert!((found - exact.mixed).abs() < 1e-12, "{found} {exact:?}");
        }
        // Pulling back and pushing forward undo each other.
        let back = pushed_forward(&pulled_back(&response.stress, &STRETCHED), &STRETCHED);
        close(&back, &response.stress, 1e-13);
        assert_eq!(tensor(|i, j| tau[j][i]), tau);
    }
}
