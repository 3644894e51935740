//! Properties of every law: one list of laws, one test for each property.

use super::dual::Dual;
use super::energy::EnergyFunction;
use super::invariants::isochoric;
use super::{Law, Material, MaterialError, OgdenTerm, Response, Volumetric};
use crate::scalar::{
    Lanes, PAIRS, PLACE, Scalar, Symmetric, Tensor, determinant, inverse, left_cauchy_green,
};
use proptest::prelude::*;

/// Every law, with constants far from special; shear modulus near one.
pub(super) const LAWS: [Law; 7] = [
    Law::MooneyRivlin { c10: 0.5, c01: 0.0 },
    Law::MooneyRivlin { c10: 0.4, c01: 0.1 },
    Law::Yeoh {
        c10: 0.5,
        c20: -0.02,
        c30: 0.003,
    },
    Law::Gent {
        shear: 1.2,
        limit: 80.0,
    },
    Law::Ogden {
        terms: [
            term(0.6, 1.3),
            term(0.01, 5.0),
            term(-0.2, -2.0),
            term(0.3, -0.7),
        ],
    },
    Law::LinearElastic { shear: 1.1 },
    Law::Energy(EnergyFunction::new(own_energy)),
];

/// An energy with all its derivatives.
fn own_energy([i1, i2]: [Dual; 2]) -> Dual {
    let (x, y) = (i1 - 3.0, i2 - 3.0);
    0.4 * x + 0.1 * y + 0.02 * x * y + 0.01 * y * y + 0.05 * ((0.1 * x).exp() - 1.0)
}

const fn term(modulus: f64, exponent: f64) -> OgdenTerm {
    OgdenTerm { modulus, exponent }
}

/// Energy with its derivatives, by a way that does not use stress or tangent.
pub(super) fn energy(law: &Law, f: &Tensor<Dual>) -> Dual {
    if let Law::Ogden { terms } = law {
        let b = left_cauchy_green(f);
        let r = determinant(f).inverse_cube_root();
        return terms.iter().fold(Dual::constant(0.0), |sum, t| {
            let trace = trace_of_power(&b.map(|x| x * r * r), t.exponent / 2.0);
            sum + Dual::constant(t.modulus / t.exponent) * (trace - Dual::constant(3.0))
        });
    }
    if let Law::Energy(energy) = law {
        let at = isochoric(f);
        return energy.of([at.first, at.second]);
    }
    law.response(f).energy
}

/// `tr b^s` by the binomial series of `m^s (1 + (b / m - 1))^s`: no principal values, so
/// that it may be derived where they are equal.
fn trace_of_power(b: &Symmetric<Dual>, s: f64) -> Dual {
    let zero = Dual::constant(0.0);
    // Half of an upper bound of the largest principal value: the series converges.
    let m = 0.5 * (b[0] + b[1] + b[2]).value;
    let x: Tensor<Dual> = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = Dual::constant(f64::from(u8::from(i == j)));
            b[PLACE[i][j]] * Dual::constant(1.0 / m) - unit
        })
    });
    let mut power: Tensor<Dual> = std::array::from_fn(|i| {
        std::array::from_fn(|j| Dual::constant(f64::from(u8::from(i == j))))
    });
    let mut sum = zero;
    for n in 0..4000 {
        sum = sum + power[0][0] + power[1][1] + power[2][2];
        let next = Dual::constant((s - f64::from(n)) / f64::from(n + 1));
        power = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let product = (0..3).fold(zero, |sum, k| sum + power[i][k] * x[k][j]);
                next * product
            })
        });
        let left = power.iter().flatten().fold(0.0, |most: f64, x| {
            most.max(x.value.abs())
                .max(x.first.abs())
                .max(x.second.abs())
                .max(x.mixed.abs())
        });
        if left < 1e-18 {
            break;
        }
    }
    sum * Dual::constant(m.powf(s))
}

pub(super) fn tensor(entry: impl Fn(usize, usize) -> f64) -> Tensor<f64> {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

pub(super) fn product(a: &Tensor<f64>, b: &Tensor<f64>) -> Tensor<f64> {
    tensor(|i, j| (0..3).map(|k| a[i][k] * b[k][j]).sum())
}

pub(super) fn transposed(a: &Tensor<f64>) -> Tensor<f64> {
    tensor(|i, j| a[j][i])
}

pub(super) fn tensor_of_stress(stress: &Symmetric<f64>) -> Tensor<f64> {
    tensor(|i, j| stress[PLACE[i][j]])
}

/// First Piola-Kirchhoff stress `P = tau F^-T`.
fn nominal(response: &Response<f64>, f: &Tensor<f64>) -> Tensor<f64> {
    let tau = tensor_of_stress(&response.stress);
    product(&tau, &transposed(&inverse(f, determinant(f))))
}

/// The size of a response: what its errors are measured against.
fn size(response: &Response<f64>) -> f64 {
    let entries = response
        .stress
        .iter()
        .chain(response.tangent.iter().flatten());
    entries.fold(0.0, |most: f64, entry| most.max(entry.abs()))
}

/// Rotation of a quaternion that need not be of unit length.
pub(super) fn rotation(q: [f64; 4]) -> Tensor<f64> {
    let n = q.iter().map(|x| x * x).sum::<f64>();
    let [w, x, y, z] = q;
    let s = 2.0 / n;
    [
        [
            1.0 - s * (y * y + z * z),
            s * (x * y - w * z),
            s * (x * z + w * y),
        ],
        [
            s * (x * y + w * z),
            1.0 - s * (x * x + z * z),
            s * (y * z - w * x),
        ],
        [
            s * (x * z - w * y),
            s * (y * z + w * x),
            1.0 - s * (x * x + y * y),
        ],
    ]
}

fn rotations() -> impl Strategy<Value = Tensor<f64>> {
    let q = prop::array::uniform4(-1.0..1.0);
    q.prop_filter("not zero", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.01)
        .prop_map(rotation)
}

/// Deformation gradients with stretches of 0.4 to 2.2 and a volume ratio of 0.3 to 3.
fn gradients() -> impl Strategy<Value = Tensor<f64>> {
    let stretches = prop::array::uniform3(0.4..2.2);
    (rotations(), stretches, rotations())
        .prop_filter("volume ratio", |(_, l, _)| {
            (0.3..3.0).contains(&(l[0] * l[1] * l[2]))
        })
        .prop_map(|(left, l, right)| product(&left, &tensor(|i, j| l[i] * right[i][j])))
}

/// A potential and its derivatives for two entries of the deformation gradient.
pub(super) fn derivatives_of(
    potential: &dyn Fn(&Tensor<Dual>) -> Dual,
    f: &Tensor<f64>,
    one: (usize, usize),
    other: (usize, usize),
) -> Dual {
    let at: Tensor<Dual> = std::array::from_fn(|i| {
        std::array::from_fn(|j| Dual {
            value: f[i][j],
            first: f64::from(u8::from((i, j) == one)),
            second: f64::from(u8::from((i, j) == other)),
            mixed: 0.0,
        })
    });
    potential(&at)
}

fn derivatives(law: &Law, f: &Tensor<f64>, one: (usize, usize), other: (usize, usize)) -> Dual {
    derivatives_of(&|f| energy(law, f), f, one, other)
}

// Each answer is a sum of some tens of products, none much larger than the size of
// the response times (largest / smallest stretch)^2 = 30: 1e-16 x 30 x 100.
const ROUNDING: f64 = 3e-13;

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

    #[test]
    fn the_stress_is_the_gradient_of_the_energy(f in gradients()) {
        for law in LAWS {
            let response = law.response(&f);
            let p = nominal(&response, &f);
            for (i, j) in (0..9).map(|n| (n / 3, n % 3)) {
                let exact = derivatives(&law, &f, (i, j), (0, 0));
                prop_assert!((p[i][j] - exact.first).abs() < ROUNDING * size(&response), "{law:?}");
                prop_assert!((response.energy - exact.value).abs() < ROUNDING * size(&response));
            }
        }
    }

    #[test]
    fn the_tangent_is_the_gradient_of_the_stress(f in gradients()) {
        for law in LAWS {
            let response = law.response(&f);
            let g = inverse(&f, determinant(&f));
            for ((i, a), (j, b)) in (0..81).map(|n| ((n / 27, n / 9 % 3), (n / 3 % 3, n % 3))) {
                let mut found = 0.0;
                for (k, l) in (0..9).map(|n| (n / 3, n % 3)) {
                    let c = response.tangent[PLACE[i][k]][PLACE[j][l]];
                    let tau = response.stress[PLACE[k][l]];
                    let geometric = if i == j { tau } else { 0.0 };
                    found += g[a][k] * g[b][l] * (c + geometric);
                }
                let exact = derivatives(&law, &f, (i, a), (j, b)).mixed;
                // Two inverses, of at most 1/0.4 each.
                prop_assert!((found - exact).abs() < 10.0 * ROUNDING * size(&response), "{law:?} {found} {exact}");
            }
        }
    }

    #[test]
    fn rotations_after_and_before_change_nothing(f in gradients(), q in rotations()) {
        for law in LAWS {
            let p = nominal(&law.response(&f), &f);
            let size = size(&law.response(&f));
            let after = product(&q, &f);
            let before = product(&f, &q);
            let (p_after, p_before) = (nominal(&law.response(&after), &after), nominal(&law.response(&before), &before));
            let (turned, isotropic) = (product(&q, &p), product(&p, &q));
            for (i, j) in PAIRS {
                prop_assert!((p_after[i][j] - turned[i][j]).abs() < ROUNDING * size, "{law:?}");
                prop_assert!((p_before[i][j] - isotropic[i][j]).abs() < ROUNDING * size, "{law:?}");
            }
        }
    }

    #[test]
    fn the_answer_is_isochoric_and_symmetric(f in gradients(), scale in 0.5..2.0) {
        for law in LAWS {
            let response = law.response(&f);
            let trace: f64 = response.stress[..3].iter().sum();
            prop_assert!(trace.abs() < ROUNDING * size(&response));
            let blown_up = law.response(&tensor(|i, j| scale * f[i][j]));
            prop_assert!((blown_up.energy - response.energy).abs() < ROUNDING * size(&response));
            for v in 0..6 {
                prop_assert!((blown_up.stress[v] - response.stress[v]).abs() < ROUNDING * size(&response));
                for w in 0..v {
                    prop_assert_eq!(response.tangent[v][w], response.tangent[w][v]);
                }
            }
        }
    }

    #[test]
    fn lanes_answer_as_single_numbers_do(fs in prop::array::uniform8(gradients())) {
        let lanes: Tensor<Lanes> =
            std::array::from_fn(|i| std::array::from_fn(|j| Lanes(fs.map(|f| f[i][j]))));
        for law in LAWS {
            let together = law.response(&lanes);
            for (lane, f) in fs.iter().enumerate() {
                let alone = law.response(f);
                // The cube root may differ in its last digit.
                let close = |a: f64, b: f64| (a - b).abs() < 2e-14 * size(&alone);
                prop_assert!(close(together.energy.0[lane], alone.energy));
                for v in 0..6 {
                    prop_assert!(close(together.stress[v].0[lane], alone.stress[v]));
                    for w in 0..6 {
                        prop_assert!(close(together.tangent[v][w].0[lane], alone.tangent[v][w]));
                    }
                }
            }
        }
    }
}

#[test]
fn the_undeformed_solid_has_no_energy_and_no_stress_and_the_shear_modulus() {
    let identity = tensor(|i, j| f64::from(u8::from(i == j)));
    for law in LAWS {
        let response = law.response(&identity);
        let g = law.shear_modulus();
        assert_eq!(response.energy, 0.0, "{law:?}");
        for v in 0..6 {
            assert!(response.stress[v].abs() < 1e-15 * g, "{law:?}");
            for w in 0..6 {
                // 2 G times the deviator: 2 G (Is - 1 x 1 / 3).
                let same = if v == w {
                    if v < 3 { 1.0 } else { 0.5 }
                } else {
                    0.0
                };
                let mean = if v < 3 && w < 3 { 1.0 / 3.0 } else { 0.0 };
                let exact = 2.0 * g * (same - mean);
                assert!(
                    (response.tangent[v][w] - exact).abs() < 2e-15 * g,
                    "{law:?}"
                );
            }
        }
    }
}

#[test]
fn at_small_strain_the_stress_is_that_of_linear_elasticity() {
    let strain = [[0.3, 0.2, -0.1], [0.2, -0.5, 0.4], [-0.1, 0.4, 0.9]];
    let mean = (0.3 - 0.5 + 0.9) / 3.0;
    let small = 1e-6;
    let f = tensor(|i, j| f64::from(u8::from(i == j)) + small * strain[i][j]);
    for law in LAWS {
        let response = law.response(&f);
        for (v, (i, j)) in PAIRS.into_iter().enumerate() {
            let deviator = strain[i][j] - if i == j { mean } else { 0.0 };
            let linear = 2.0 * law.shear_modulus() * small * deviator;
            // What is left is of second order.
            assert!(
                (response.stress[v] - linear).abs() < 10.0 * small * small,
                "{law:?}"
            );
        }
    }
}

/// Ogden's law of one term with this shear modulus.
fn one_term(exponent: f64) -> Law {
    Law::ogden(&[term(2.0 / exponent, exponent)]).expect("constants in range")
}

#[test]
fn ogden_of_exponents_two_and_minus_two_is_mooney_and_rivlin() {
    let pairs = [
        (one_term(2.0), Law::MooneyRivlin { c10: 0.5, c01: 0.0 }),
        (one_term(-2.0), Law::MooneyRivlin { c10: 0.0, c01: 0.5 }),
    ];
    let q = rotation([0.3, -0.5, 0.7, 0.2]);
    // Equal stretches, nearly equal ones down to nothing, and a fair spread.
    let differences = [0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4, 1e-3, 0.1, 1.0];
    for (spectral, invariant) in pairs {
        for (start, small) in differences.into_iter().flat_map(|d| [(1.0, d), (0.7, d)]) {
            for stretches in [
                [start, start + small, start],
                [start, start + small, start + 2.0 * small],
                [start + 1.0, start, start + small],
            ] {
                let f = product(&q, &tensor(|i, j| stretches[i] * q[j][i]));
                let (found, exact) = (spectral.response(&f), invariant.response(&f));
                // As for two ways of summing the same: no loss where stretches meet.
                let close = |a: f64, b: f64| (a - b).abs() < 2e-14 * size(&exact);
                assert!(close(found.energy, exact.energy), "{stretches:?}");
                for v in 0..6 {
                    assert!(close(found.stress[v], exact.stress[v]), "{stretches:?}");
                    for w in 0..6 {
                        assert!(
                            close(found.tangent[v][w], exact.tangent[v][w]),
                            "{stretches:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_linear_law_is_hookes_at_any_rotation() {
    // E = 1/2 (F^T F - 1) of a stretch of 1e-7 and a large rotation.
    let small = 1e-7;
    let q = rotation([0.3, -0.5, 0.7, 0.2]);
    let f = product(
        &q,
        &tensor(|i, j| {
            f64::from(u8::from(i == j))
                + if (i, j) == (0, 1) || (i, j) == (1, 0) {
                    small
                } else {
                    0.0
                }
        }),
    );
    let response = Law::LinearElastic { shear: 1.0 }.response(&f);
    let tau = tensor(|i, j| response.stress[PLACE[i][j]]);
    let back = product(&transposed(&q), &product(&tau, &q));
    for (i, j) in PAIRS {
        let exact = if (i, j) == (0, 1) { 2.0 * small } else { 0.0 };
        assert!(
            (back[i][j] - exact).abs() < 4.0 * small * small + 1e-15,
            "{back:?}"
        );
    }
}

#[test]
fn constants_out_of_range_are_named() {
    let message = |found: Result<Material, MaterialError>| found.unwrap_err().to_string();
    let kept = Volumetric::Incompressible;
    assert!(message(Material::mooney_rivlin(1.0, -1.0, 0.0)).starts_with("c10 + c01 [Pa] = 0.0"));
    assert!(message(Material::mooney_rivlin(f64::NAN, 1.0, 0.0)).starts_with("c10 [Pa] = NaN"));
    assert!(message(Material::mooney_rivlin(1.0, 0.0, -1.0)).starts_with("d1 [1/Pa] = -1.0"));
    assert!(message(Material::neo_hookean(1e6, 0.51)).starts_with("Poisson's ratio = 0.51"));
    assert!(message(Material::neo_hookean(0.0, 0.5)).starts_with("Young's modulus [Pa] = 0.0"));
    let law = Law::neo_hookean(1.0);
    assert!(message(Material::new(law, Volumetric::Quadratic(0.0))).starts_with("bulk modulus"));
    let law = Law::LinearElastic {
        shear: f64::INFINITY,
    };
    assert!(message(Material::new(law, kept)).starts_with("shear modulus [Pa] = inf"));
    assert!(
        Law::ogden(&[term(1.0, 0.0)])
            .unwrap_err()
            .to_string()
            .contains("exponent")
    );
    assert!(Law::ogden(&[]).unwrap_err().to_string().contains("0 terms"));
    assert!(
        Law::ogden(&[term(1.0, 2.0); 5])
            .unwrap_err()
            .to_string()
            .contains("1 to 4")
    );
}

#[test]
fn moduli_follow_from_constants() {
    let soft = Material::neo_hookean(3e5, 0.5).expect("in range");
    assert_eq!(soft.volumetric, Volumetric::Incompressible);
    assert!((soft.law.shear_modulus() / 1e5 - 1.0).abs() < 1e-15);
    let stiff = Material::linear_elastic(70e9, 0.3).expect("in range");
    assert!((stiff.law.shear_modulus() / (70e9 / 2.6) - 1.0).abs() < 1e-15);
    let bulk = stiff.volumetric.bulk_modulus().expect("compressible");
    assert!((bulk / (70e9 / 1.2) - 1.0).abs() < 1e-15);
    let rubber = Material::mooney_rivlin(1e5, 1e4, 1e-9).expect("in range");
    assert_eq!(rubber.volumetric.bulk_modulus(), Some(2.0 / 1e-9));
}

#[test]
fn a_solver_refuses_what_is_not_stable_in_its_range() {
    let law = Law::Yeoh {
        c10: 1e5,
        c20: -1e4,
        c30: 0.0,
    };
    let material = Material::new(law, Volumetric::Incompressible).expect("in range");
    material.require_stable(0.9, 1.1).expect("stable");
    let message = material.require_stable(0.3, 3.0).unwrap_err().to_string();
    assert!(
        message.starts_with("the material loses stability at stretch 1.9"),
        "{message}"
    );
    assert!(material.require_stable(1.2, 3.0).is_err());
    assert!(material.require_stable(0.5, f64::NAN).is_err());
}
