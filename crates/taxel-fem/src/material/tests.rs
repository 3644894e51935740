//! What must hold for every law: one list of laws, one test for each property.

use super::dual::Dual;
use super::{Law, Response};
use crate::scalar::{Lanes, PAIRS, PLACE, Tensor, determinant, inverse};
use proptest::prelude::*;

/// Every law, with constants far from special; shear modulus near one.
const LAWS: [Law; 2] = [
    Law::MooneyRivlin { c10: 0.5, c01: 0.0 },
    Law::MooneyRivlin { c10: 0.4, c01: 0.1 },
];

/// Energy with its derivatives, by a way that does not use stress or tangent.
fn energy(law: &Law, f: &Tensor<Dual>) -> Dual {
    law.response(f).energy
}

fn tensor(entry: impl Fn(usize, usize) -> f64) -> Tensor<f64> {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

fn product(a: &Tensor<f64>, b: &Tensor<f64>) -> Tensor<f64> {
    tensor(|i, j| (0..3).map(|k| a[i][k] * b[k][j]).sum())
}

fn transposed(a: &Tensor<f64>) -> Tensor<f64> {
    tensor(|i, j| a[j][i])
}

/// First Piola-Kirchhoff stress `P = tau F^-T`.
fn nominal(response: &Response<f64>, f: &Tensor<f64>) -> Tensor<f64> {
    let tau = tensor(|i, j| response.stress[PLACE[i][j]]);
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
fn rotation(q: [f64; 4]) -> Tensor<f64> {
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

/// Energy and its derivatives for two entries of the deformation gradient.
fn derivatives(law: &Law, f: &Tensor<f64>, one: (usize, usize), other: (usize, usize)) -> Dual {
    let at: Tensor<Dual> = std::array::from_fn(|i| {
        std::array::from_fn(|j| Dual {
            value: f[i][j],
            first: f64::from(u8::from((i, j) == one)),
            second: f64::from(u8::from((i, j) == other)),
            mixed: 0.0,
        })
    });
    energy(law, &at)
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
