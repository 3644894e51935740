//! Where a law is stable: over a range of stretches before a computation, and at one
//! point within it. [`Material::require_stable`] and [`ellipticity`] are for solvers.

use super::homogeneous::{Mode, diagonal};
use super::principal::principal;
use super::{Law, Material, Response};
use crate::scalar::{PAIRS, PLACE, Symmetric, Tensor, determinant};
use std::fmt;

/// A loss of stability.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Instability {
    /// A solid that resists no small shear.
    #[error("has a shear modulus of {modulus:.4} Pa at small strain, which must be greater than 0")]
    ShearModulus {
        /// Shear modulus, Pa.
        modulus: f64,
    },
    /// A stretch from which on the law is not stable.
    #[error("loses stability at stretch {stretch:.4} in {mode}: {criterion}")]
    Stretch {
        /// Loading that stretches the solid.
        mode: Mode,
        /// Stretch of the first axis.
        stretch: f64,
        /// Criterion that does not hold any more.
        criterion: Criterion,
    },
}

/// A condition of stability.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// `d tau : d ln l > 0` for all changes of the stretches that keep the volume.
    Drucker,
    /// `(tau_i - tau_j)(l_i - l_j) > 0`: the larger stress in the direction of the larger
    /// stretch.
    BakerEricksen,
}

impl fmt::Display for Criterion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drucker => "the tangent modulus is not positive (Drucker)",
            Self::BakerEricksen => "the larger stretch has the smaller stress (Baker-Ericksen)",
        })
    }
}

/// Check of [`Material::require_stable`] over a range of stretches.
pub(super) fn over_range(law: &Law, smallest: f64, largest: f64) -> Result<(), Instability> {
    let modulus = law.shear_modulus();
    // Not a number is no modulus either.
    if modulus.is_nan() || modulus <= 0.0 {
        return Err(Instability::ShearModulus { modulus });
    }
    let mut first: Option<(f64, Instability)> = None;
    for mode in Mode::ALL {
        for end in [largest, smallest] {
            let Some((size, loss)) = first_loss(law, mode, end) else {
                continue;
            };
            // Uniaxial tension is equibiaxial compression too: the first name stays.
            if first.is_none_or(|(least, _)| size < least * (1.0 - 1e-9)) {
                first = Some((size, loss));
            }
        }
    }
    first.map_or(Ok(()), |(_, loss)| Err(loss))
}

/// The first loss on the way from no stretch to the stretch `end`, with the largest
/// logarithmic stretch there.
fn first_loss(law: &Law, mode: Mode, end: f64) -> Option<(f64, Instability)> {
    let lost = |logarithm: f64| lost_criterion(law, mode.stretches(logarithm.exp()));
    let end = end.ln();
    let steps = (end.abs() / 0.005).ceil();
    let step = end / steps;
    let bad = (1..=steps as u32).find(|&n| lost(f64::from(n) * step).is_some())?;
    let (mut good, mut bad) = (f64::from(bad - 1) * step, f64::from(bad) * step);
    for _ in 0..50 {
        let middle = f64::midpoint(good, bad);
        if lost(middle).is_some() {
            bad = middle;
        } else {
            good = middle;
        }
    }
    let stretch = bad.exp();
    let loss = Instability::Stretch {
        mode,
        stretch,
        criterion: lost(bad)?,
    };
    let size = |most: f64, l: f64| most.max(l.ln().abs());
    Some((mode.stretches(stretch).into_iter().fold(0.0, size), loss))
}

fn lost_criterion(law: &Law, stretches: [f64; 3]) -> Option<Criterion> {
    let response = law.response(&diagonal(stretches));
    let modulus = drucker(&response);
    if modulus.is_nan() || modulus <= 0.0 {
        return Some(Criterion::Drucker);
    }
    let tau = response.stress;
    let ordered = [(0, 1), (1, 2), (0, 2)].into_iter().all(|(i, j)| {
        // Equal stretches are Drucker's case.
        let difference: f64 = stretches[i] - stretches[j];
        difference.abs() < 1e-6 || (tau[i] - tau[j]) * difference > 0.0
    });
    (!ordered).then_some(Criterion::BakerEricksen)
}

/// Least eigenvalue of `d tau_i / d ln l_j` among changes that keep the volume, Pa, for a
/// deformation along the axes.
fn drucker(response: &Response<f64>) -> f64 {
    let h = |i: usize, j: usize| {
        let own = if i == j {
            2.0 * response.stress[i]
        } else {
            0.0
        };
        response.tangent[i][j] + own
    };
    // In the orthonormal basis (1, -1, 0) / sqrt 2, (1, 1, -2) / sqrt 6.
    let a = f64::midpoint(h(0, 0), h(1, 1)) - h(0, 1);
    let b = (h(0, 0) + 2.0 * h(0, 1) + h(1, 1) - 4.0 * (h(0, 2) + h(1, 2) - h(2, 2))) / 6.0;
    let c = (h(0, 0) - h(1, 1) - 2.0 * (h(0, 2) - h(1, 2))) / 12.0_f64.sqrt();
    f64::midpoint(a, b) - ((a - b) / 2.0).hypot(c)
}

/// The weakest shear band of a material point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipticity {
    /// Least `m . Q(n) m` over unit vectors, Pa; not positive: ellipticity is lost, and the
    /// solid may localise in a band. Per reference volume.
    pub least: f64,
    /// Normal `n` of that band in the deformed shape.
    pub normal: [f64; 3],
    /// Direction `m` of its motion.
    pub motion: [f64; 3],
}

impl Ellipticity {
    /// True if the point is strongly elliptic.
    pub fn holds(&self) -> bool {
        self.least > 0.0
    }
}

/// Strong ellipticity of a material at the deformation gradient `f` and the mean stress
/// `pressure` (tension positive, Pa).
///
/// The acoustic tensor is `Q_ij = n_k n_l (c_ikjl + delta_ij tau_kl)`, plus
/// `J^2 dp/dJ n x n`; without compressibility only motions across `n` count. The
/// pressure itself cancels, since `J` is a null Lagrangian. The least value is
/// looked for from 150 normals on a half sphere, then refined near the best; this takes
/// some 0.2 ms, so it is for the end of a step, not for every iteration.
pub fn ellipticity(material: &Material, f: &Tensor<f64>, pressure: f64) -> Ellipticity {
    let response = material.law.response(f);
    let j = determinant(f);
    let (_, compliance) = material.volumetric.volume_ratio(pressure);
    let bulk = (compliance != 0.0).then(|| j * j / compliance);
    let at = |normal: [f64; 3]| weakest(&response, bulk, normal);
    let mut best = at([0.0, 0.0, 1.0]);
    for sample in 0..SAMPLES {
        best = weaker(best, at(spiral(sample)));
    }
    // Steps along the sphere, from the spacing of the samples on; the value is known to
    // the square of the last step. No number at all, not one that is less, ends it too.
    let mut step = 0.15;
    while step > 1e-7 {
        let [one, other] = across(best.normal);
        let mut moved = best;
        for (axis, sign) in [(one, 1.0), (one, -1.0), (other, 1.0), (other, -1.0)] {
            let normal = std::array::from_fn(|i| best.normal[i] + sign * step * axis[i]);
            moved = weaker(moved, at(unit(normal)));
        }
        if moved.least < best.least {
            best = moved;
        } else {
            step *= 0.5;
        }
    }
    best
}

const SAMPLES: u32 = 150;

/// Normal number `sample` of an even spiral over a half sphere.
fn spiral(sample: u32) -> [f64; 3] {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let height = (f64::from(sample) + 0.5) / f64::from(SAMPLES);
    let radius = (1.0 - height * height).sqrt();
    let angle = golden * f64::from(sample);
    [radius * libm::cos(angle), radius * libm::sin(angle), height]
}

fn weaker(one: Ellipticity, other: Ellipticity) -> Ellipticity {
    if other.least < one.least { other } else { one }
}

/// The weakest motion for one normal. Without a bulk stiffness the motion along the
/// normal is taken out by a stiffness above all others.
fn weakest(response: &Response<f64>, bulk: Option<f64>, n: [f64; 3]) -> Ellipticity {
    let q = acoustic(response, n);
    let q = match bulk {
        Some(bulk) => std::array::from_fn(|v| q[v] + bulk * dyad(n)[v]),
        None => tangential(&q, n),
    };
    let (values, directions) = principal(&q);
    let least = (0..3).fold(0, |k, i| if values[i] < values[k] { i } else { k });
    Ellipticity {
        least: values[least],
        normal: n,
        motion: directions[least],
    }
}

fn acoustic(response: &Response<f64>, n: [f64; 3]) -> Symmetric<f64> {
    let mut q = [0.0; 6];
    for (v, (i, j)) in PAIRS.into_iter().enumerate() {
        for (k, l) in (0..9).map(|m| (m / 3, m % 3)) {
            let geometric = if i == j {
                response.stress[PLACE[k][l]]
            } else {
                0.0
            };
            q[v] += n[k] * n[l] * (response.tangent[PLACE[i][k]][PLACE[j][l]] + geometric);
        }
    }
    q
}

/// `(1 - n x n) q (1 - n x n) + large n x n`.
fn tangential(q: &Symmetric<f64>, n: [f64; 3]) -> Symmetric<f64> {
    let qn: [f64; 3] = std::array::from_fn(|i| (0..3).map(|k| q[PLACE[i][k]] * n[k]).sum());
    let nqn: f64 = (0..3).map(|i| n[i] * qn[i]).sum();
    let large = q.iter().fold(0.0, |sum, x| sum + x.abs()) * 10.0;
    std::array::from_fn(|v| {
        let (i, j) = PAIRS[v];
        q[v] - n[i] * qn[j] - qn[i] * n[j] + (nqn + large) * n[i] * n[j]
    })
}

fn dyad(n: [f64; 3]) -> Symmetric<f64> {
    PAIRS.map(|(i, j)| n[i] * n[j])
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.map(|x| x / length)
}

/// Two unit vectors across a unit vector and each other.
fn across(n: [f64; 3]) -> [[f64; 3]; 2] {
    let least = (0..3).fold(0, |k, i| if n[i].abs() < n[k].abs() { i } else { k });
    let one = unit(std::array::from_fn(|i| {
        f64::from(u8::from(i == least)) - n[least] * n[i]
    }));
    let other = [
        n[1] * one[2] - n[2] * one[1],
        n[2] * one[0] - n[0] * one[2],
        n[0] * one[1] - n[1] * one[0],
    ];
    [one, other]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Volumetric;
    use crate::material::dual::Dual;
    use crate::material::tests::{LAWS, energy};
    use crate::scalar::Scalar;

    #[test]
    fn laws_of_positive_constants_are_stable_everywhere() {
        over_range(&Law::neo_hookean(1.0), 0.05, 20.0).unwrap();
        let law = Law::MooneyRivlin { c10: 0.4, c01: 0.1 };
        over_range(&law, 0.05, 20.0).unwrap();
    }

    #[test]
    fn a_softening_law_fails_where_its_tension_is_greatest() {
        // W = c x - d x^2: the slope of tau_1 - tau_3 = 2 w' (l^2 - 1/l) vanishes.
        let (c, d) = (1.0, 0.1);
        let law = Law::Yeoh {
            c10: c,
            c20: -d,
            c30: 0.0,
        };
        let Some((_, Instability::Stretch { stretch: l, .. })) =
            first_loss(&law, Mode::Uniaxial, 4.0)
        else {
            panic!("stable")
        };
        let (a, b) = (l * l, 1.0 / l);
        let slope = (c - 2.0 * d * (a + 2.0 * b - 3.0)) * (2.0 * a + b) - 4.0 * d * (a - b).powi(2);
        assert!(slope.abs() < 1e-12, "{l} {slope}");
        // A plane change of shape is worse; equal losses have the name of the first mode.
        let Err(Instability::Stretch { mode, stretch, .. }) = over_range(&law, 0.4, 4.0) else {
            panic!("stable")
        };
        assert!(mode == Mode::PureShear && stretch > 1.8 && stretch < l);
    }

    #[test]
    fn a_negative_second_constant_breaks_the_order_of_stresses() {
        // c10 + l^2 c01 > 0 is asked for by Baker and Ericksen; Drucker is stricter here.
        let law = Law::MooneyRivlin {
            c10: 1.0,
            c01: -0.1,
        };
        for mode in Mode::ALL {
            let Some((_, Instability::Stretch { stretch, .. })) = first_loss(&law, mode, 10.0)
            else {
                panic!("stable")
            };
            assert!(
                stretch > 1.0 && stretch < 10.0_f64.sqrt() + 1e-6,
                "{stretch}"
            );
            assert_eq!(first_loss(&law, mode, 0.999999 * stretch), None);
        }
    }

    #[test]
    fn the_linear_law_is_refused_at_large_strain_only() {
        let law = Law::LinearElastic { shear: 1.0 };
        let stretch = |smallest, largest| match over_range(&law, smallest, largest) {
            Err(Instability::Stretch { stretch, .. }) => stretch,
            other => panic!("{other:?}"),
        };
        // Baker and Ericksen ask for I1 > 3/2 l^2 across the axis of tension.
        let limit = 4.0_f64.cbrt();
        assert!((stretch(1.0, 2.0) - limit).abs() < 1e-9);
        // In pure shear the stress of the shorter axis overtakes that of the middle one.
        let Some((
            _,
            Instability::Stretch {
                stretch: l,
                criterion,
                ..
            },
        )) = first_loss(&law, Mode::PureShear, 3.0)
        else {
            panic!("stable")
        };
        assert_eq!(criterion, Criterion::BakerEricksen);
        let first = l * l + 1.0 + 1.0 / (l * l);
        assert!((first / 3.0 - l * l / 2.0).abs() < 1e-9, "{l}");
    }

    #[test]
    fn the_weakest_band_of_a_neo_hookean_solid_is_across_its_shortest_axis() {
        let f = diagonal([2.0, 0.4, 1.25]);
        let material = Material::new(Law::neo_hookean(3.0), Volumetric::Incompressible).unwrap();
        let found = ellipticity(&material, &f, -7.0);
        // m . Q m = G n . b n for m across n.
        assert!((found.least - 3.0 * 0.16).abs() < 1e-12, "{found:?}");
        assert!((found.normal[1].abs() - 1.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn an_undeformed_compressible_solid_has_the_moduli_of_its_waves() {
        // G for shear, K + 4/3 G for pressure; the smaller counts.
        let identity = diagonal([1.0; 3]);
        for (law, bulk, least) in [
            (Law::neo_hookean(3.0), 10.0, 3.0),
            (Law::LinearElastic { shear: 3.0 }, 0.5, 3.0),
            // Outside of what may be made, to see the other wave.
            (Law::neo_hookean(3.0), -2.0, 2.0),
        ] {
            let volumetric = Volumetric::Quadratic(bulk);
            let found = ellipticity(&Material { law, volumetric }, &identity, 0.0).least;
            assert!((found - least).abs() < 1e-14, "{found}");
        }
    }

    #[test]
    fn a_softening_solid_localises_where_theory_says() {
        // W = w(I1), in the plane of the largest and smallest stretch: lost when
        // w' + 2 w'' (l1 - l3)^2 = 0, with tan^2 of the normal's angle from axis 1 = l1 / l3.
        let (c, d) = (1.0, 0.1);
        let law = Law::Yeoh {
            c10: c,
            c20: -d,
            c30: 0.0,
        };
        let material = Material::new(law, Volumetric::Incompressible).unwrap();
        // Pure shear: I1 - 3 = (l - 1/l)^2 = y, so c - 2 d y - 4 d y = 0.
        let y = c / (6.0 * d);
        let l = f64::midpoint(y.sqrt(), (y + 4.0).sqrt());
        let at = |l: f64| ellipticity(&material, &diagonal(Mode::PureShear.stretches(l)), 0.3);
        assert!(at(0.9999 * l).holds());
        assert!(!at(1.0001 * l).holds());
        let found = at(l);
        assert!(found.least.abs() < 1e-12, "{found:?}");
        let tangent = found.normal[2] / found.normal[0];
        // The place of a least value is known to the root of its rounding.
        assert!(
            (tangent * tangent / (l * l) - 1.0).abs() < 1e-6,
            "{found:?}"
        );
    }

    #[test]
    fn the_weakest_band_is_that_of_the_energy() {
        // d2/ds2 of W + K/2 (J - 1)^2 along F + s m x (F^T n), for the band found and others.
        let f = [[1.3, 0.4, -0.1], [0.2, 0.9, 0.3], [-0.2, 0.1, 0.8]];
        // A negative bulk modulus may not be made; it lets the motion along n win.
        for (law, bulk) in LAWS.into_iter().flat_map(|law| [(law, 0.8), (law, -2.0)]) {
            let volumetric = Volumetric::Quadratic(bulk);
            let curvature = |m: [f64; 3], n: [f64; 3]| {
                let at: Tensor<Dual> = std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        let slope = m[i] * (0..3).map(|k| n[k] * f[k][j]).sum::<f64>();
                        Dual {
                            value: f[i][j],
                            first: slope,
                            second: slope,
                            mixed: 0.0,
                        }
                    })
                });
                let change = determinant(&at) - Dual::constant(1.0);
                (energy(&law, &at) + Dual::constant(bulk / 2.0) * change * change).mixed
            };
            let pressure = bulk * (determinant(&f) - 1.0);
            let found = ellipticity(&Material { law, volumetric }, &f, pressure);
            let exact = curvature(found.motion, found.normal);
            assert!(
                (found.least - exact).abs() < 1e-13,
                "{law:?} {found:?} {exact}"
            );
            for (n, m) in (0..SAMPLES)
                .flat_map(|n| (0..SAMPLES).map(move |m| (n, m)))
                .step_by(7)
            {
                assert!(
                    curvature(spiral(m), spiral(n)) > found.least - 1e-13,
                    "{law:?}"
                );
            }
        }
    }

    #[test]
    fn a_point_that_is_no_deformation_is_not_elliptic() {
        let material = Material::neo_hookean(1.0, 0.3).unwrap();
        assert!(!ellipticity(&material, &[[f64::NAN; 3]; 3], 0.0).holds());
        assert!(!ellipticity(&material, &[[0.0; 3]; 3], 0.0).holds());
    }
}
