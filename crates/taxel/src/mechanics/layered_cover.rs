//! How a load spreads in soft layers bonded to each other and to a rigid base.
//!
//! Unbounded sideways, small strain. At each wave number k the surface pressure p(k) sinks the
//! surface by W(k) p(k) and arrives at the base as S(k) p(k); a tangential traction moves it by
//! A(k) in the plane of the wave and by B(k) across it. In a layer the state of the wave,
//! displacements and tractions, grows upwards by a matrix exponential that is finite at
//! ν = 1/2; carried up from the base are the compliance and the traction that arrives, which
//! only the two growing solutions decide, so that nothing overflows or cancels.

use std::f64::consts::PI;

use taxel_numerics::roots::ridders;
use taxel_numerics::special::{complete_elliptic_e, complete_elliptic_k, gauss_points, j0, j1};

/// One soft layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverLayer {
    /// Thickness, m; above zero.
    pub thickness: f64,
    /// Shear modulus G, Pa; above zero.
    pub shear_modulus: f64,
    /// Poisson's ratio ν, 1; above −1, at most 0.5.
    pub poisson: f64,
}

/// What is no cover.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoverError {
    /// There is no layer.
    #[error("a cover has at least one layer")]
    NoLayer,
    /// A number of a layer is outside its range.
    #[error("{quantity} of layer {layer} from the top is {given}: it must be {allowed}")]
    OutOfRange {
        /// Number of the layer, from 1 at the top.
        layer: usize,
        /// The quantity with its unit.
        quantity: &'static str,
        /// What was given.
        given: f64,
        /// What is allowed.
        allowed: &'static str,
    },
}

/// An even area of load or measurement, its middle at the point that is given with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CoverArea {
    /// Half sides along x and y, m.
    Rectangle([f64; 2]),
    /// Radius, m.
    Disc(f64),
}

/// Soft layers on a rigid base, bonded to it and to each other.
///
/// # Example: what a pressure chip under 6 mm of rubber reads of a disc of 6 mm
/// ```
/// use taxel::mechanics::{CoverLayer, LayeredCover};
/// let rubber = CoverLayer { thickness: 6e-3, shear_modulus: 0.2e6, poisson: 0.49 };
/// let cover = LayeredCover::new(&[rubber])?;
/// let area = std::f64::consts::PI * 3e-3 * 3e-3;
/// assert!((area * cover.base_pressure(3e-3, 0.0) - 0.4185).abs() < 5e-5);
/// # Ok::<(), taxel::mechanics::CoverError>(())
/// ```
///
/// # Example: a layer that cannot be
/// ```
/// use taxel::mechanics::{CoverLayer, LayeredCover};
/// let layer = CoverLayer { thickness: 6e-3, shear_modulus: 0.2e6, poisson: 0.6 };
/// let error = LayeredCover::new(&[layer]).unwrap_err();
/// assert!(error.to_string().starts_with("Poisson's ratio of layer 1"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredCover {
    /// From the base up.
    layers: Vec<Layer>,
    thickness: f64,
    top: CoverLayer,
}

/// A layer with the first three powers of its matrix: d(U, V, t, s)/d(kz) = A (U, V, t, s).
#[derive(Debug, Clone, PartialEq)]
struct Layer {
    thickness: f64,
    shear_modulus: f64,
    powers: [[[f64; 4]; 4]; 3],
}

/// Displacements (along the wave, out of the layer) per traction, times k, 1/Pa, and tractions
/// on the base per traction on the surface.
struct Wave {
    compliance: [[f64; 2]; 2],
    arrival: [[f64; 2]; 2],
}

/// Where 4q²exp(−2q), what the base leaves of the surface's own displacements at kt = q for a
/// top layer of thickness t, is below 1e-17.
const SURFACE_END: f64 = 23.0;
/// Where 2(1 + q)exp(−q), what arrives at the base at kh = q, is below 1e-17.
const BASE_END: f64 = 45.0;
/// Longest panel in kh, as in the cover of one layer; the first is halved so many times, because
/// a stiff skin brings the nearest pole closer to zero.
const PANEL: f64 = 1.5;
const HALVINGS: i32 = 8;
/// Longest panel in the phase of a Bessel function: three periods, for which 16 points leave
/// 1e-12 of what has not decayed there.
const PHASE: f64 = 6.0 * PI;
/// Farthest distance that is searched for pressure on the base, thicknesses.
const FARTHEST: f64 = 256.0;
/// Pressure of unit force times thickness² that a repeated load may add to a mean: the images
/// within one decay length are some hundred.
const IMAGES: f64 = 1e-12;

impl LayeredCover {
    /// A cover of these layers, the top one first; the last is bonded to the rigid base.
    ///
    /// # Errors
    /// [`CoverError`] without a layer, or when a number is outside its range.
    pub fn new(layers: &[CoverLayer]) -> Result<Self, CoverError> {
        let top = *layers.first().ok_or(CoverError::NoLayer)?;
        for (index, layer) in layers.iter().enumerate() {
            let positive = |value: f64| value > 0.0 && value.is_finite();
            let poisson = layer.poisson;
            let rules = [
                (
                    "the thickness, m,",
                    layer.thickness,
                    positive(layer.thickness),
                    "above zero",
                ),
                (
                    "the shear modulus, Pa,",
                    layer.shear_modulus,
                    positive(layer.shear_modulus),
                    "above zero",
                ),
                (
                    "Poisson's ratio",
                    poisson,
                    poisson > -1.0 && poisson <= 0.5,
                    "above -1 and at most 0.5",
                ),
            ];
            for (quantity, given, holds, allowed) in rules {
                if !holds {
                    let layer = index + 1;
                    return Err(CoverError::OutOfRange {
                        layer,
                        quantity,
                        given,
                        allowed,
                    });
                }
            }
        }
        Ok(Self {
            layers: layers.iter().rev().map(Layer::new).collect(),
            thickness: layers.iter().map(|layer| layer.thickness).sum(),
            top,
        })
    }

    /// W(k), m/Pa: sinking of the surface per pressure on it; `wave_number` k ≥ 0 in 1/m.
    pub fn sinking_transform(&self, wave_number: f64) -> f64 {
        let k = self.above_zero(wave_number);
        self.wave(k).compliance[1][1] / k
    }

    /// S(k), 1: pressure on the base per pressure on the surface; S(0) = 1.
    pub fn base_transform(&self, wave_number: f64) -> f64 {
        self.wave(self.above_zero(wave_number)).arrival[1][1]
    }

    /// A(k) and B(k), m/Pa: displacement of the surface per tangential traction that points
    /// along the wave, and across it.
    pub fn tangential_transforms(&self, wave_number: f64) -> [f64; 2] {
        let k = self.above_zero(wave_number);
        [self.wave(k).compliance[0][0] / k, self.across(k) / k]
    }

    /// Sinking of the surface, m/N, at a distance, m, from the axis of an even pressure on a disc
    /// of radius `load_radius`, m (0: a point, under which it is infinite), per force.
    ///
    /// Positive into the layer; the surface rises around the load.
    pub fn sinking(&self, load_radius: f64, radius: f64) -> f64 {
        let stiffness = (1.0 - self.top.poisson) / self.top.shear_modulus;
        let rest = self.surface(load_radius + radius, |k| {
            let rest = self.wave(k).compliance[1][1] - stiffness;
            rest * disc_transform(k * load_radius) * j0(k * radius)
        });
        rest + stiffness * half_space_sinking(load_radius, radius)
    }

    /// Displacement of the surface away from a pressing point force at this distance, m/N.
    pub fn radial_displacement(&self, radius: f64) -> f64 {
        let stiffness = (2.0 * self.top.poisson - 1.0) / (2.0 * self.top.shear_modulus);
        let rest = self.surface(radius, |k| {
            (-self.wave(k).compliance[0][1] - stiffness) * j1(k * radius)
        });
        rest + stiffness / (2.0 * PI * radius)
    }

    /// Displacement of the surface along a tangential point force, m/N, at this distance from
    /// it, m, along the force and across it.
    pub fn tangential_displacement(&self, radius: f64) -> [f64; 2] {
        let half_space = [1.0 - self.top.poisson, 1.0].map(|part| part / self.top.shear_modulus);
        let parts = |k: f64| {
            let (in_plane, across) = (self.wave(k).compliance[0][0], self.across(k));
            [in_plane - half_space[0], across - half_space[1]]
        };
        [(1.0, half_space[1]), (-1.0, half_space[0])].map(|(sign, half_space)| {
            let rest = self.surface(radius, |k| {
                let [in_plane, across] = parts(k);
                let (x, zeroth) = (k * radius, j0(k * radius));
                let second = if x > 0.0 {
                    2.0 * j1(x) / x - zeroth
                } else {
                    0.0
                };
                0.5 * ((in_plane + across) * zeroth - sign * (in_plane - across) * second)
            });
            rest + half_space / (2.0 * PI * radius)
        })
    }

    /// Pressure on the base, 1/m², at a distance, m, from the axis of an even pressure on a disc
    /// of radius `load_radius`, m (0: a point), per force.
    pub fn base_pressure(&self, load_radius: f64, radius: f64) -> f64 {
        let points = self.wave_numbers(BASE_END / self.thickness, load_radius + radius);
        let part = |(k, weight): (f64, f64)| {
            let arrival = self.wave(k).arrival[1][1] * disc_transform(k * load_radius);
            weight * k * arrival * j0(k * radius)
        };
        points.map(part).sum::<f64>() / (2.0 * PI)
    }

    /// Mean pressure on the base over `footprint` per pressure on `patch` of the surface, 1,
    /// when the middle of the patch is at `offset`, m, from that of the footprint.
    ///
    /// As [`LayeredCover::base_pressure_means`] for one offset.
    pub fn base_pressure_mean(
        &self,
        footprint: CoverArea,
        patch: CoverArea,
        offset: [f64; 2],
    ) -> f64 {
        self.base_pressure_means(footprint, patch, [&offset[..1], &offset[1..]], 0.0)[0]
    }

    /// The same for all pairs of offsets along x and along y, m, row by row: the x of a row, then
    /// the next y.
    ///
    /// With the patch repeated far away the mean is a sum over kx and ky, which is exact up to
    /// what the images add and the transform cut at 45/h leaves: below 1e-9 together. Patches
    /// whose edge is farther from that of the footprint than [`LayeredCover::reach`] of
    /// `least_share` count as zero: each mean is off by less than that share times the area of
    /// the patch over the thickness squared.
    pub fn base_pressure_means(
        &self,
        footprint: CoverArea,
        patch: CoverArea,
        offsets: [&[f64]; 2],
        least_share: f64,
    ) -> Vec<f64> {
        let images = self.reach(IMAGES);
        let cut = if least_share > IMAGES {
            self.reach(least_share)
        } else {
            f64::INFINITY
        };
        let sizes = [0, 1].map(|axis| footprint.half(axis) + patch.half(axis));
        let counts = offsets.map(<[f64]>::len);
        let near = [0, 1].map(|axis: usize| -> Vec<usize> {
            let is_near = |index: &usize| offsets[axis][*index].abs() <= sizes[axis] + cut;
            (0..counts[axis]).filter(is_near).collect()
        });
        let end = BASE_END / self.thickness;
        let steps = [0, 1].map(|axis| {
            let farthest = near[axis].iter().map(|&index| offsets[axis][index].abs());
            2.0 * PI / (farthest.fold(0.0, f64::max) + sizes[axis] + images)
        });
        // Weight of a wave number times the cosine, for all offsets.
        let cosines = [0, 1].map(|axis: usize| -> Vec<Vec<f64>> {
            let wave_numbers = (0..=(end / steps[axis]) as usize).map(|m| m as f64 * steps[axis]);
            let row = |k: f64| {
                let once = if k == 0.0 { 1.0 } else { 2.0 };
                let weight = once * footprint.along(axis, k) * patch.along(axis, k);
                near[axis]
                    .iter()
                    .map(|&index| weight * (k * offsets[axis][index]).cos())
                    .collect()
            };
            wave_numbers.map(row).collect()
        });
        let scale = patch.area() * steps[0] * steps[1] / (4.0 * PI * PI);
        let mut means = vec![0.0; counts[0] * counts[1]];
        for (n, along_y) in cosines[1].iter().enumerate() {
            let mut row = vec![0.0; near[0].len()];
            for (m, along_x) in cosines[0].iter().enumerate() {
                let k = f64::hypot(m as f64 * steps[0], n as f64 * steps[1]);
                if k > end {
                    break;
                }
                let arrival = scale * self.base_transform(k) * footprint.round(k) * patch.round(k);
                for (sum, cosine) in row.iter_mut().zip(along_x) {
                    *sum += arrival * cosine;
                }
            }
            for (&y, cosine) in near[1].iter().zip(along_y) {
                for (&x, sum) in near[0].iter().zip(&row) {
                    means[y * counts[0] + x] += sum * cosine;
                }
            }
        }
        means
    }

    /// Distance, m, from a point force beyond which the pressure on the base per force stays
    /// below `share` of one over the square of the thickness; 256 thicknesses at most.
    pub fn reach(&self, share: f64) -> f64 {
        let step = 0.5 * self.thickness;
        let limit = share / (self.thickness * self.thickness);
        let mut searched = 8.0 * self.thickness;
        loop {
            let points = self.wave_numbers(BASE_END / self.thickness, searched);
            let points: Vec<(f64, f64)> = points
                .map(|(k, weight)| (k, weight * k * self.wave(k).arrival[1][1]))
                .collect();
            let is_above = |radius: &f64| {
                let pressure: f64 = points.iter().map(|(k, part)| part * j0(k * radius)).sum();
                pressure.abs() >= 2.0 * PI * limit
            };
            let count = (searched / step).round() as usize;
            let last = (0..count).rev().map(|i| i as f64 * step).find(is_above);
            let reach = last.map_or(0.0, |last| last + step);
            // A decay that goes on for as long again does not come back.
            if 2.0 * reach <= searched || searched >= FARTHEST * self.thickness {
                return reach;
            }
            searched *= 2.0;
        }
    }

    /// Wavelength, m, above which the base receives more than this share of a pattern of
    /// pressure: where S(2π/λ) is the noise of one frame over the pattern, what is shorter is
    /// lost in it. `None` unless the share is above 1e-17 and below 1.
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{CoverLayer, LayeredCover};
    /// let layer = CoverLayer { thickness: 1e-3, shear_modulus: 0.2e6, poisson: 0.49 };
    /// let length = LayeredCover::new(&[layer])?.resolution_length(0.0788).unwrap();
    /// assert!((length / 1.26e-3 - 1.0).abs() < 0.01);
    /// # Ok::<(), taxel::mechanics::CoverError>(())
    /// ```
    pub fn resolution_length(&self, noise_over_pattern: f64) -> Option<f64> {
        let lost = |k: f64| noise_over_pattern - self.base_transform(k);
        if !(noise_over_pattern > 1e-17 && noise_over_pattern < 1.0) {
            return None;
        }
        // As fine as the points of the quadrature, between which S is smooth.
        let step = PANEL / self.thickness / 16.0;
        let count = (BASE_END / self.thickness / step) as usize;
        let mut ends = (1..=count).map(|i| i as f64 * step);
        let end = ends.find(|&k| lost(k) >= 0.0)?;
        Some(2.0 * PI / ridders([end - step, end], lost))
    }

    /// ∫₀^∞ f(k) dk/(2π) for what falls as the surface's own displacements do.
    fn surface(&self, reach: f64, f: impl Fn(f64) -> f64) -> f64 {
        let points = self.wave_numbers(SURFACE_END / self.top.thickness, reach);
        points.map(|(k, weight)| weight * f(k)).sum::<f64>() / (2.0 * PI)
    }

    /// Points and weights up to `end`, 1/m, for Bessel functions of k times `reach`, m, at most.
    fn wave_numbers(&self, end: f64, reach: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
        let count = (end * self.thickness / PANEL)
            .max(end * reach / PHASE)
            .ceil();
        let width = end / count;
        let halved = (0..HALVINGS)
            .rev()
            .map(move |i| [i + 1, i].map(|i| width * 0.5_f64.powi(i)));
        let rest = (1..count as usize).map(move |i| [i, i + 1].map(|i| i as f64 * width));
        let first = [0.0, width * 0.5_f64.powi(HALVINGS)];
        let panels = std::iter::once(first).chain(halved).chain(rest);
        panels.flat_map(|[from, to]| gauss_points(from, to))
    }

    /// Where kh is below 1e-9, the transforms are those at zero to rounding.
    fn above_zero(&self, wave_number: f64) -> f64 {
        wave_number.max(1e-9 / self.thickness)
    }

    fn wave(&self, k: f64) -> Wave {
        let mut wave = Wave {
            compliance: [[0.0; 2]; 2],
            arrival: [[1.0, 0.0], [0.0, 1.0]],
        };
        for layer in &self.layers {
            let [uu, ut, tu, tt] = layer.growth(k);
            let twice = 2.0 * layer.shear_modulus;
            let below = wave.compliance.map(|row| row.map(|entry| entry * twice));
            let traction = inverse(sum(product(&tu, &below), tt));
            let compliance = product(&sum(product(&uu, &below), ut), &traction);
            let decay = (-k * layer.thickness).exp();
            let arrival = product(&wave.arrival, &traction);
            wave.compliance = compliance.map(|row| row.map(|entry| entry / twice));
            wave.arrival = arrival.map(|row| row.map(|entry| entry * decay));
        }
        wave
    }

    /// Displacement across the wave per traction, times k, 1/Pa: u' = τ/G, τ' = G k² u.
    fn across(&self, k: f64) -> f64 {
        self.layers.iter().fold(0.0, |below, layer| {
            let (g, tanh) = (layer.shear_modulus, (k * layer.thickness).tanh());
            (below + tanh / g) / (g * below * tanh + 1.0)
        })
    }
}

impl Layer {
    /// With U along the wave, V out of the layer, t and s the shear and normal traction over 2Gk
    /// and c = ν/(1 − ν): U' = V + 2t, V' = −cU + (1 − c)s, t' = (1 + c)U + cs, s' = −t.
    fn new(layer: &CoverLayer) -> Self {
        let c = layer.poisson / (1.0 - layer.poisson);
        let first = [
            [0.0, 1.0, 2.0, 0.0],
            [-c, 0.0, 0.0, 1.0 - c],
            [1.0 + c, 0.0, 0.0, c],
            [0.0, 0.0, -1.0, 0.0],
        ];
        let second = product(&first, &first);
        Self {
            thickness: layer.thickness,
            shear_modulus: layer.shear_modulus,
            powers: [first, second, product(&second, &first)],
        }
    }

    /// exp(Aq − q) for q = kh in four blocks: of displacements and of tractions, each by
    /// displacements and by tractions below. (A² − 1)² = 0, so that a cubic in A is enough.
    fn growth(&self, k: f64) -> [[[f64; 2]; 2]; 4] {
        let q = k * self.thickness;
        let sinh = -0.5 * (-2.0 * q).exp_m1();
        let cosh = 1.0 - sinh;
        let (square, cube) = (0.5 * q * sinh, 0.5 * (q * cosh - sinh));
        let factors = [sinh - cube, square, cube];
        let block = |row: usize, column: usize| {
            let entry = |i: usize, j: usize| {
                let powers = self.powers.iter().zip(factors);
                let of_powers: f64 = powers.map(|(power, factor)| power[i][j] * factor).sum();
                of_powers + if i == j { cosh - square } else { 0.0 }
            };
            std::array::from_fn(|i| std::array::from_fn(|j| entry(row + i, column + j)))
        };
        [block(0, 0), block(0, 2), block(2, 0), block(2, 2)]
    }
}

impl CoverArea {
    fn half(self, axis: usize) -> f64 {
        match self {
            Self::Rectangle(halves) => halves[axis],
            Self::Disc(radius) => radius,
        }
    }

    fn area(self) -> f64 {
        match self {
            Self::Rectangle([x, y]) => 4.0 * x * y,
            Self::Disc(radius) => PI * radius * radius,
        }
    }

    /// The part of the transform of the mean that belongs to one axis.
    fn along(self, axis: usize, k: f64) -> f64 {
        match self {
            Self::Rectangle(halves) if k * halves[axis] > 0.0 => {
                (k * halves[axis]).sin() / (k * halves[axis])
            }
            _ => 1.0,
        }
    }

    /// The part that belongs to the whole wave number.
    fn round(self, k: f64) -> f64 {
        match self {
            Self::Rectangle(_) => 1.0,
            Self::Disc(radius) => disc_transform(k * radius),
        }
    }
}

/// 2 J₁(x)/x; x²/8 is the next term of the series.
fn disc_transform(x: f64) -> f64 {
    if x < 1e-8 { 1.0 } else { 2.0 * j1(x) / x }
}

/// Sinking of a half space with (1 − ν)/G = 1 under unit force on a disc (Love 1929), 1/m.
fn half_space_sinking(load_radius: f64, radius: f64) -> f64 {
    let scale = 2.0 / (PI * PI);
    if load_radius == 0.0 {
        0.5 / (PI * radius)
    } else if radius <= load_radius {
        let ratio = radius / load_radius;
        let complement = ((1.0 - ratio) * (1.0 + ratio)).sqrt();
        scale / load_radius * complete_elliptic_e(complement)
    } else {
        let ratio = load_radius / radius;
        let square = (1.0 - ratio) * (1.0 + ratio);
        let complement = square.sqrt();
        // Where the radii agree to rounding, K is infinite and its product zero.
        let of_k = if square > 0.0 {
            square * complete_elliptic_k(complement)
        } else {
            0.0
        };
        let difference = complete_elliptic_e(complement) - of_k;
        scale * radius / (load_radius * load_radius) * difference
    }
}

fn product<const N: usize>(a: &[[f64; N]; N], b: &[[f64; N]; N]) -> [[f64; N]; N] {
    let entry = |i: usize, j: usize| (0..N).map(|k| a[i][k] * b[k][j]).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

fn sum(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let determinant = a * d - b * c;
    [[d, -b], [-c, a]].map(|row| row.map(|entry| entry / determinant))
}
