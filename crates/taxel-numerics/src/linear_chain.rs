//! Linear chains with straight lines as input, solved exactly.
//!
//! A [`Transfer`] is a rational function of s, built stage by stage. A
//! [`Chain`] holds its partial fractions: every pole is a mode of its own, so
//! that a 3 MHz element beside a leak of 0.2 s costs nothing and loses
//! nothing. The input is a straight line between samples, for which a step of
//! any length is exact: the values do not depend on the sampling rate.

use std::f64::consts::PI;

use num_complex::Complex64;

/// A rational transfer function K Π(s − zᵢ)/Π(s − pᵢ); s in 1/s.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    factor: f64,
    zeros: Vec<Complex64>,
    poles: Vec<Complex64>,
}

impl Transfer {
    /// The constant `gain`.
    pub fn constant(gain: f64) -> Self {
        Self {
            factor: gain,
            zeros: Vec::new(),
            poles: Vec::new(),
        }
    }

    /// gain/(1 + τs), `time_constant` τ > 0 in s.
    pub fn low_pass(gain: f64, time_constant: f64) -> Self {
        Self {
            factor: gain / time_constant,
            zeros: Vec::new(),
            poles: vec![Complex64::from(-1.0 / time_constant)],
        }
    }

    /// gain·τs/(1 + τs), `time_constant` τ > 0 in s.
    pub fn high_pass(gain: f64, time_constant: f64) -> Self {
        Self {
            factor: gain,
            zeros: vec![Complex64::from(0.0)],
            poles: vec![Complex64::from(-1.0 / time_constant)],
        }
    }

    /// gain·(1 + as)/(1 + bs), `lead` a and `lag` b > 0 in s.
    pub fn lead(gain: f64, lead: f64, lag: f64) -> Self {
        Self {
            factor: gain * lead / lag,
            zeros: vec![Complex64::from(-1.0 / lead)],
            poles: vec![Complex64::from(-1.0 / lag)],
        }
    }

    /// (b s + k)/(m s² + c s + q) with `numerator` = [k, b] and `denominator`
    /// = [q, c, m]; k, q and m above zero.
    pub fn second_order(numerator: [f64; 2], denominator: [f64; 3]) -> Self {
        let [k, b] = numerator;
        let [q, c, m] = denominator;
        let (factor, zeros) = if b == 0.0 {
            (k / m, Vec::new())
        } else {
            (b / m, vec![Complex64::from(-k / b)])
        };
        Self {
            factor,
            zeros,
            poles: quadratic_roots(q / m, c / m).to_vec(),
        }
    }

    /// This stage, then `next`.
    #[must_use]
    pub fn then(mut self, next: &Self) -> Self {
        self.factor *= next.factor;
        self.zeros.extend(&next.zeros);
        self.poles.extend(&next.poles);
        self
    }

    /// The factor K.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// The zeros zᵢ, 1/s.
    pub fn zeros(&self) -> &[Complex64] {
        &self.zeros
    }

    /// The poles pᵢ, 1/s.
    pub fn poles(&self) -> &[Complex64] {
        &self.poles
    }

    /// Value at the complex frequency `s`, 1/s.
    pub fn at(&self, s: Complex64) -> Complex64 {
        let zeros: Complex64 = self.zeros.iter().map(|zero| s - zero).product();
        let poles: Complex64 = self.poles.iter().map(|pole| s - pole).product();
        zeros * self.factor / poles
    }

    /// Value at a frequency of `hertz`, s = 2πi f.
    pub fn at_frequency(&self, hertz: f64) -> Complex64 {
        self.at(Complex64::new(0.0, 2.0 * PI * hertz))
    }
}

/// Roots of s² + c s + q for q > 0: of two real ones the smaller is taken from
/// the larger, so that neither cancels.
fn quadratic_roots(q: f64, c: f64) -> [Complex64; 2] {
    let half = 0.5 * c;
    let square = half * half - q;
    if square < 0.0 {
        let root = Complex64::new(-half, (-square).sqrt());
        [root, root.conj()]
    } else {
        let large = -half - square.sqrt().copysign(half);
        [Complex64::from(large), Complex64::from(q / large)]
    }
}

/// Why a transfer function is no [`Chain`].
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ChainError {
    /// It would differentiate its input without limit.
    #[error("{zeros} zeros and {poles} poles: there must be no more zeros than poles")]
    Improper {
        /// Number of zeros.
        zeros: usize,
        /// Number of poles.
        poles: usize,
    },
    /// A part of it grows or stays for ever.
    #[error("a pole at {real} 1/s; every pole must have a negative real part")]
    Unstable {
        /// Real part of the pole, 1/s.
        real: f64,
    },
}

/// Poles nearer to each other than this, relatively, are drawn apart by it.
///
/// The true response changes by the square of it for a pair of poles, and the
/// partial fractions lose rounding over it: both below 1e-10.
const APART: f64 = 3e-6;

/// A stable transfer function as the sum of its modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    static_gain: f64,
    real: Vec<Mode<f64>>,
    /// The pole above the axis of each conjugate pair.
    pairs: Vec<Mode<Complex64>>,
}

/// One pole p with its weight: z′ = p(z − x), output weight·(z − x), so that a
/// settled mode gives exactly nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mode<T> {
    pole: T,
    weight: T,
}

/// Memory of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    input: f64,
    real: Vec<f64>,
    pairs: Vec<Complex64>,
}

/// A step of one length, prepared for many samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    real: Vec<Factors<f64>>,
    pairs: Vec<Factors<Complex64>>,
}

/// z ← decay·z + first·x₀ + last·x₁, with the weight of the mode.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Factors<T> {
    decay: T,
    first: T,
    last: T,
    weight: T,
}

impl Chain {
    /// Splits `transfer` into its modes.
    ///
    /// # Errors
    /// [`ChainError::Improper`] or [`ChainError::Unstable`].
    ///
    /// # Example
    /// ```
    /// use taxel_numerics::linear_chain::{Chain, Transfer};
    /// let chain = Chain::new(&Transfer::high_pass(2.0, 0.25))?;
    /// let mut memory = chain.settled(0.0);
    /// // A ramp of 1/s for 0.1 s: 2·0.25·(1 − exp(−0.1/0.25)).
    /// let value = chain.advance(&mut memory, &chain.step(0.1), 0.1);
    /// assert!((value - 0.5 * (1.0 - f64::exp(-0.4))).abs() < 1e-15);
    /// # Ok::<(), taxel_numerics::linear_chain::ChainError>(())
    /// ```
    pub fn new(transfer: &Transfer) -> Result<Self, ChainError> {
        let (zeros, poles) = (transfer.zeros.len(), transfer.poles.len());
        if zeros > poles {
            return Err(ChainError::Improper { zeros, poles });
        }
        if let Some(pole) = transfer.poles.iter().find(|pole| !falls(pole)) {
            return Err(ChainError::Unstable { real: pole.re });
        }
        let poles = drawn_apart(&transfer.poles);
        let modes: Vec<_> = (0..poles.len())
            .map(|i| mode(transfer, &poles, i))
            .collect();
        let real = |mode: &Mode<Complex64>| Mode {
            pole: mode.pole.re,
            weight: mode.weight.re,
        };
        let on_axis = |mode: &&Mode<Complex64>| mode.pole.im == 0.0;
        let above = |mode: &&Mode<Complex64>| mode.pole.im > 0.0;
        Ok(Self {
            static_gain: transfer.at(Complex64::from(0.0)).re,
            real: modes.iter().filter(on_axis).map(real).collect(),
            pairs: modes.iter().filter(above).copied().collect(),
        })
    }

    /// The memory after the input has been `input` for ever.
    pub fn settled(&self, input: f64) -> Memory {
        Memory {
            input,
            real: vec![input; self.real.len()],
            pairs: vec![Complex64::from(input); self.pairs.len()],
        }
    }

    /// Prepares a step of `duration` ≥ 0, s.
    pub fn step(&self, duration: f64) -> Step {
        let real = |mode: &Mode<f64>| mode.over(duration);
        let pair = |mode: &Mode<Complex64>| mode.over(duration);
        Step {
            real: self.real.iter().map(real).collect(),
            pairs: self.pairs.iter().map(pair).collect(),
        }
    }

    /// Takes the input along a straight line to `input` in one step and
    /// returns the output there.
    pub fn advance(&self, memory: &mut Memory, step: &Step, input: f64) -> f64 {
        let before = memory.input;
        memory.input = input;
        let mut output = self.static_gain * input;
        for (step, z) in step.real.iter().zip(&mut memory.real) {
            output += step.advance(z, before, input);
        }
        for (step, z) in step.pairs.iter().zip(&mut memory.pairs) {
            output += step.advance(z, before, input);
        }
        output
    }

    /// Output of [`Chain::advance`] over `duration` ≥ 0, s, for a single look.
    fn peek(&self, memory: &Memory, duration: f64, input: f64) -> f64 {
        let before = memory.input;
        let mut output = self.static_gain * input;
        for (mode, mut z) in self.real.iter().zip(memory.real.iter().copied()) {
            output += mode.over(duration).advance(&mut z, before, input);
        }
        for (mode, mut z) in self.pairs.iter().zip(memory.pairs.iter().copied()) {
            output += mode.over(duration).advance(&mut z, before, input);
        }
        output
    }

    /// Outputs at `times` (ascending, s) for the input through `knots`
    /// (ascending time in s, value), joined by straight lines, constant before
    /// and after.
    pub fn respond(&self, knots: &[[f64; 2]], times: &[f64]) -> Vec<f64> {
        let mut walk = Walk::new(self, knots);
        times.iter().map(|&time| walk.to(time)).collect()
    }

    /// The least and the greatest output between the times `from` and `to`,
    /// s, for the input of [`Chain::respond`]; zero is always among them.
    ///
    /// Each stretch between two knots is searched on a grid that also resolves
    /// its start, then to the peak itself by golden section: relative error
    /// below 1e-9 for a chain without oscillation.
    pub fn extremes(&self, knots: &[[f64; 2]], from: f64, to: f64) -> [f64; 2] {
        let mut walk = Walk::new(self, knots);
        walk.to(from);
        let inner = knots.iter().map(|knot| knot[0]);
        let mut corners: Vec<f64> = inner.filter(|time| *time > from && *time < to).collect();
        corners.push(to);
        let mut found = [0.0_f64; 2];
        for corner in corners {
            let [least, most] = least_and_greatest(|time| walk.at(time), walk.time, corner);
            found[0] = found[0].min(least);
            found[1] = found[1].max(most);
            walk.to(corner);
        }
        found
    }
}

/// True if a pole dies out; not a number does not.
fn falls(pole: &Complex64) -> bool {
    pole.re < 0.0 && pole.im.is_finite()
}

fn mode(transfer: &Transfer, poles: &[Complex64], i: usize) -> Mode<Complex64> {
    let pole = poles[i];
    let zeros: Complex64 = transfer.zeros.iter().map(|zero| pole - zero).product();
    let others: Complex64 = (0..poles.len())
        .filter(|&j| j != i)
        .map(|j| pole - poles[j])
        .product();
    let twice = if pole.im > 0.0 { 2.0 } else { 1.0 };
    // Of z′ = p(z − x) the residue is −p.
    let weight = zeros * (twice * transfer.factor) / others / -pole;
    Mode { pole, weight }
}

/// The poles with pairs that nearly coincide drawn apart, about their middle.
fn drawn_apart(poles: &[Complex64]) -> Vec<Complex64> {
    let mut poles = poles.to_vec();
    for i in 0..poles.len() {
        for j in i + 1..poles.len() {
            let middle = 0.5 * (poles[i] + poles[j]);
            if (poles[i] - poles[j]).norm() < APART * middle.norm() {
                poles[i] = middle * (1.0 + 0.5 * APART);
                poles[j] = middle * (1.0 - 0.5 * APART);
            }
        }
    }
    poles
}

impl Mode<f64> {
    fn over(&self, duration: f64) -> Factors<f64> {
        let [decay, first, last] = factors((self.pole * duration).into()).map(|factor| factor.re);
        Factors {
            decay,
            first,
            last,
            weight: self.weight,
        }
    }
}

impl Mode<Complex64> {
    fn over(&self, duration: f64) -> Factors<Complex64> {
        let [decay, first, last] = factors(self.pole * duration);
        Factors {
            decay,
            first,
            last,
            weight: self.weight,
        }
    }
}

impl Factors<f64> {
    /// Takes the mode `z` one step on; returns its part of the output.
    #[inline]
    fn advance(&self, z: &mut f64, before: f64, input: f64) -> f64 {
        *z = self.decay * *z + self.first * before + self.last * input;
        self.weight * (*z - input)
    }
}

impl Factors<Complex64> {
    /// The same for a pair of modes.
    #[inline]
    fn advance(&self, z: &mut Complex64, before: f64, input: f64) -> f64 {
        *z = self.decay * *z + self.first * before + self.last * input;
        (self.weight * (*z - input)).re
    }
}

/// Decay, first and last factor of z′ = p(z − x) over a step with p·dt = `h`: with
/// φ₁ = (eʰ − 1)/h and φ₂ = (φ₁ − 1)/h, z ← eʰz − h(φ₁ − φ₂)x₀ − hφ₂x₁.
fn factors(h: Complex64) -> [Complex64; 3] {
    let grown = exp_minus_one(h);
    let last = -mean_growth(h, grown);
    [grown + 1.0, -grown - last, last]
}

/// eʰ − 1 without cancellation.
fn exp_minus_one(h: Complex64) -> Complex64 {
    let turn = (0.5 * h.im).sin();
    let (growth, scale) = (h.re.exp_m1(), h.re.exp());
    Complex64::new(growth - 2.0 * scale * turn * turn, scale * h.im.sin())
}

/// h φ₂(h) = (eʰ − 1 − h)/h with `grown` = eʰ − 1; a series where it cancels.
fn mean_growth(h: Complex64, grown: Complex64) -> Complex64 {
    if h.norm() > 0.5 {
        return grown / h - 1.0;
    }
    let mut term = 0.5 * h;
    let mut sum = term;
    for k in 3..18 {
        term *= h / f64::from(k);
        sum += term;
    }
    sum
}

/// A chain on its way along knots.
#[derive(Clone)]
struct Walk<'a> {
    chain: &'a Chain,
    knots: &'a [[f64; 2]],
    memory: Memory,
    time: f64,
}

impl<'a> Walk<'a> {
    fn new(chain: &'a Chain, knots: &'a [[f64; 2]]) -> Self {
        let [time, input] = knots.first().copied().unwrap_or_default();
        Self {
            chain,
            knots,
            memory: chain.settled(input),
            time,
        }
    }

    /// Goes on to `time` and returns the output there; a time that has passed
    /// counts as now.
    fn to(&mut self, time: f64) -> f64 {
        while let Some(&[at, input]) = self.knots.first().filter(|knot| knot[0] <= time) {
            self.knots = &self.knots[1..];
            self.straight(at, input);
        }
        let input = self.input_at(time);
        self.straight(time, input)
    }

    /// The output at `time` without going there.
    fn at(&self, time: f64) -> f64 {
        if self.knots.first().is_some_and(|knot| knot[0] <= time) {
            return self.clone().to(time);
        }
        let duration = (time - self.time).max(0.0);
        self.chain.peek(&self.memory, duration, self.input_at(time))
    }

    fn input_at(&self, time: f64) -> f64 {
        let here = self.memory.input;
        match self.knots.first() {
            Some(&[at, input]) if at > self.time => {
                let share = ((time - self.time) / (at - self.time)).max(0.0);
                here + (input - here) * share
            }
            _ => here,
        }
    }

    fn straight(&mut self, time: f64, input: f64) -> f64 {
        let step = self.chain.step((time - self.time).max(0.0));
        self.time = self.time.max(time);
        self.chain.advance(&mut self.memory, &step, input)
    }
}

/// Evenly spaced points of the search on a stretch.
const EVEN: i32 = 64;
/// Points that halve the distance to the start of the stretch.
const HALVING: i32 = 40;

/// The least and the greatest value of `f` from `from` to `to`.
fn least_and_greatest(f: impl Fn(f64) -> f64, from: f64, to: f64) -> [f64; 2] {
    let length = to - from;
    let halving = (1..=HALVING)
        .rev()
        .map(|i| 0.5_f64.powi(i) / f64::from(EVEN));
    let even = (1..=EVEN).map(|i| f64::from(i) / f64::from(EVEN));
    let grid: Vec<f64> = std::iter::once(0.0)
        .chain(halving)
        .chain(even)
        .map(|share| from + length * share)
        .collect();
    let values: Vec<f64> = grid.iter().map(|&time| f(time)).collect();
    let greatest = |sign: f64| {
        let value = |i: usize| sign * values[i];
        let best = (0..grid.len()).fold(0, |best, i| if value(i) > value(best) { i } else { best });
        let low = grid[best.saturating_sub(1)];
        let high = grid[(best + 1).min(grid.len() - 1)];
        value(best).max(golden_section(|time| sign * f(time), low, high))
    };
    [-greatest(-1.0), greatest(1.0)]
}

/// The value at the peak of `f` between `low` and `high`, to about 1e-12 of it
/// where `f` is smooth.
fn golden_section(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const SHARE: f64 = 0.381_966_011_250_105_2;
    let (mut a, mut b) = (low + SHARE * (high - low), high - SHARE * (high - low));
    let (mut at_a, mut at_b) = (f(a), f(b));
    for _ in 0..40 {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = low + SHARE * (high - low);
            at_a = f(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = high - SHARE * (high - low);
            at_b = f(b);
        }
    }
    at_a.max(at_b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn improper_and_unstable_chains_are_refused() {
        let mut transfer = Transfer::high_pass(1.0, 1.0);
        transfer.zeros.push(Complex64::from(0.0));
        assert_eq!(
            Chain::new(&transfer),
            Err(ChainError::Improper { zeros: 2, poles: 1 })
        );
        assert_eq!(
            Chain::new(&Transfer::low_pass(1.0, -1.0)),
            Err(ChainError::Unstable { real: 1.0 })
        );
        assert!(Chain::new(&Transfer::low_pass(1.0, f64::NAN)).is_err());
    }

    #[test]
    fn equal_poles_give_the_response_of_a_double_pole() {
        let stage = Transfer::low_pass(1.0, 0.1);
        let chain = Chain::new(&stage.clone().then(&stage)).unwrap();
        for time in [0.01, 0.1, 0.7] {
            let value = chain.respond(&[[0.0, 0.0], [1.0, 1.0]], &[time])[0];
            let x = time / 0.1;
            // Ramp of slope 1 through 1/(1 + τs)².
            let expected = 0.1 * (x - 2.0 + (x + 2.0) * f64::exp(-x));
            // See APART: both its errors, and the rounding of weights of 3e5.
            assert!((value - expected).abs() < 1e-10 * time, "{time}");
        }
    }

    #[test]
    fn an_oscillation_is_exact_over_any_step() {
        // ω₀ = 1000/s, damping ratio 0.05, static gain 1.
        let chain = Chain::new(&Transfer::second_order([1e6, 0.0], [1e6, 100.0, 1.0])).unwrap();
        let times: Vec<f64> = (1..=200).map(|i| f64::from(i) * 1e-4).collect();
        let ramp = [[0.0, 0.0], [1.0, 1.0]];
        let decay = 50.0_f64;
        let turn = (1e6 - decay * decay).sqrt();
        for (time, value) in times.iter().zip(chain.respond(&ramp, &times)) {
            let wave = (decay * decay - turn * turn) / turn * (turn * time).sin()
                + 2.0 * decay * (turn * time).cos();
            let expected = time - 1e-4 + f64::exp(-decay * time) * wave / 1e6;
            // 200 steps of rounding of values below 0.02.
            assert!(
                (value - expected).abs() < 1e-15,
                "{time} {value} {expected}"
            );
        }
    }
}
