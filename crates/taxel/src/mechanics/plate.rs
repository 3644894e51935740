//! Impulse response of an infinite thin plate with damping: the paper's model
//! for the distance between elements (P3 Eqs. 21-23).

use std::f64::consts::PI;

use taxel_numerics::special::{gauss_panel, i0_scaled, i1_scaled, sine_integral};

/// A thin plate, m u_tt + β u_t + D ∇⁴u = q (P3 Eq. 21).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Bending stiffness D, N m; above zero.
    pub bending_stiffness: f64,
    /// Mass per area m, kg/m²; above zero.
    pub mass_per_area: f64,
    /// Damping β, N s/m³; zero or more.
    pub damping: f64,
}

/// Motion of a plate after an impulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlateMotion {
    /// Deflection u, m.
    pub deflection: f64,
    /// Velocity u′, m/s.
    pub velocity: f64,
}

/// D = E t³/(12(1 − ν²)), N m (P3 Eq. 22): `modulus` in Pa, `thickness` in m.
pub fn bending_stiffness(modulus: f64, thickness: f64, poisson_ratio: f64) -> f64 {
    modulus * thickness.powi(3) / (12.0 * (1.0 - poisson_ratio * poisson_ratio))
}

impl Plate {
    /// Deflection at once and at the impulse, 1/(8√(mD)), m for 1 N s.
    pub fn first_deflection(&self) -> f64 {
        1.0 / (8.0 * (self.mass_per_area * self.bending_stiffness).sqrt())
    }

    /// Motion at `distance` r, m, and `time` t > 0, s, after an impulse of
    /// 1 N s; linear in the impulse.
    ///
    /// u = exp(−at)/(4π√(mD)) ∫_z^∞ I₀(at√(1 − z²/y²)) sin(y)/y dy with
    /// a = β/(2m), z = r²/(4gt), g = √(D/m): P3 Eq. 23 with its factor
    /// 1/(4π²m), integrated over the direction of k.
    ///
    /// Error of u below 1e-10 of [`Plate::first_deflection`] for at < 100;
    /// `None` for a time that is not above zero or a negative distance.
    ///
    /// ```
    /// use taxel::mechanics::Plate;
    /// let plate = Plate { bending_stiffness: 8.9e-6, mass_per_area: 1.07, damping: 0.0 };
    /// let motion = plate.impulse_response(0.0, 1e-3).unwrap();
    /// assert!((motion.deflection / plate.first_deflection() - 1.0).abs() < 1e-12);
    /// assert!(plate.impulse_response(0.0, 0.0).is_none());
    /// ```
    pub fn impulse_response(&self, distance: f64, time: f64) -> Option<PlateMotion> {
        let possible = time > 0.0 && time.is_finite() && distance >= 0.0 && distance.is_finite();
        if !possible {
            return None;
        }
        let g = (self.bending_stiffness / self.mass_per_area).sqrt();
        let a = self.damping / (2.0 * self.mass_per_area);
        let z = distance * distance / (4.0 * g * time);
        let at = a * time;
        // exp(−at) I₀(at q) and exp(−at) I₁(at q)/q, for q = √(1 − z²/y²).
        let zero = |q: f64| i0_scaled(at * q) * (at * (q - 1.0)).exp();
        let one = |q: f64| {
            let ratio = if at * q < 1e-8 {
                0.5 * at
            } else {
                i1_scaled(at * q) / q
            };
            ratio * (at * (q - 1.0)).exp()
        };
        let scale = 2.0 * self.first_deflection() / PI;
        let deflection = scale * weighted_sine_integral(z, &zero, at == 0.0);
        let growth = a * weighted_sine_integral(z, &one, at == 0.0);
        Some(PlateMotion {
            deflection,
            velocity: scale * ((-at).exp() * z.sin() / time + growth) - a * deflection,
        })
    }
}

/// Half periods integrated before the alternating rest is averaged.
const DIRECT: usize = 24;
/// Half periods whose partial sums are averaged.
const AVERAGED: usize = 24;

/// ∫_z^∞ w(√(1 − z²/y²)) sin(y)/y dy for a smooth weight w that changes
/// slowly at large y: w(1)[π/2 − Si(z)] plus the rest, half period by half
/// period, the last ones by repeated averaging of the partial sums.
fn weighted_sine_integral(z: f64, weight: &impl Fn(f64) -> f64, constant: bool) -> f64 {
    let far = weight(1.0);
    let closed = far * (0.5 * PI - sine_integral(z));
    if constant || z == 0.0 {
        return closed;
    }
    // y = z cosh v makes the start smooth: q = tanh v, dy/y = tanh v dv.
    let integrand = |v: f64| {
        let q = v.tanh();
        (weight(q) - far) * (z * v.cosh()).sin() * q
    };
    let first = (z / PI).floor() + 1.0;
    let corner = |i: usize| ((first + i as f64) * PI / z).acosh();
    let mut from = 0.0;
    let mut sum = 0.0;
    let mut sums = [0.0; AVERAGED];
    for i in 0..DIRECT + AVERAGED {
        let to = corner(i);
        sum += smooth_integral(from, to, &integrand);
        if i >= DIRECT {
            sums[i - DIRECT] = sum;
        }
        from = to;
    }
    closed + averaged(sums)
}

/// Integral over panels of at most 1/2, in which tanh and cosh are smooth.
fn smooth_integral(from: f64, to: f64, f: &impl Fn(f64) -> f64) -> f64 {
    let panels = (2.0 * (to - from)).ceil().max(1.0);
    let width = (to - from) / panels;
    (0..panels as usize)
        .map(|i| gauss_panel(from + i as f64 * width, from + (i + 1) as f64 * width, f))
        .sum()
}

/// Repeated averaging of neighbouring partial sums of an alternating series.
fn averaged(mut sums: [f64; AVERAGED]) -> f64 {
    for length in (1..AVERAGED).rev() {
        for i in 0..length {
            sums[i] = 0.5 * (sums[i] + sums[i + 1]);
        }
    }
    sums[0]
}
