//! Homogeneous states of an incompressible solid, pulled along the first axis: the
//! tests that laws are fitted to. The pressure follows from the free third axis.

use super::Law;
use crate::scalar::Tensor;
use std::fmt;

/// Loading of a specimen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Along one axis, the sides free.
    Uniaxial,
    /// Along two axes by the same stretch.
    Equibiaxial,
    /// Along one axis, the second one held: a wide strip.
    PureShear,
}

impl Mode {
    /// All modes.
    pub const ALL: [Self; 3] = [Self::Uniaxial, Self::Equibiaxial, Self::PureShear];

    /// The three principal stretches, of product one, for the stretch of the first axis.
    pub fn stretches(self, stretch: f64) -> [f64; 3] {
        match self {
            Self::Uniaxial => [stretch, 1.0 / stretch.sqrt(), 1.0 / stretch.sqrt()],
            Self::Equibiaxial => [stretch, stretch, 1.0 / (stretch * stretch)],
            Self::PureShear => [stretch, 1.0, 1.0 / stretch],
        }
    }

    /// Force along the first axis per undeformed area, Pa: `P = (tau_1 - tau_3) / stretch`.
    pub fn nominal_stress(self, law: &Law, stretch: f64) -> f64 {
        let stress = law.response(&diagonal(self.stretches(stretch))).stress;
        (stress[0] - stress[2]) / stretch
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Uniaxial => "uniaxial stretching",
            Self::Equibiaxial => "equibiaxial stretching",
            Self::PureShear => "pure shear",
        })
    }
}

/// Nominal stress of a uniaxial test in Pa; `P = 2 (l - l^-2)(W1 + W2 / l)` for laws in
/// the invariants. `stretch` is positive.
pub fn uniaxial(law: &Law, stretch: f64) -> f64 {
    Mode::Uniaxial.nominal_stress(law, stretch)
}

/// Nominal stress of an equibiaxial test in Pa; `P = 2 (l - l^-5)(W1 + l^2 W2)`.
pub fn equibiaxial(law: &Law, stretch: f64) -> f64 {
    Mode::Equibiaxial.nominal_stress(law, stretch)
}

/// Nominal stress of a pure shear test in Pa; `P = 2 (l - l^-3)(W1 + W2)`.
pub fn pure_shear(law: &Law, stretch: f64) -> f64 {
    Mode::PureShear.nominal_stress(law, stretch)
}

/// The deformation gradient of principal stretches along the axes.
pub(super) fn diagonal(stretches: [f64; 3]) -> Tensor<f64> {
    let mut f = [[0.0; 3]; 3];
    for i in 0..3 {
        f[i][i] = stretches[i];
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Tensor;

    const ONES: Law = Law::MooneyRivlin { c10: 1.0, c01: 1.0 };

    #[test]
    fn the_three_tests_follow_their_closed_forms() {
        for l in [0.3_f64, 0.9, 1.0, 1.5, 4.0, 7.6] {
            let (c10, c01) = (0.7, 0.2);
            let law = Law::MooneyRivlin { c10, c01 };
            let close = |found: f64, exact: f64| {
                // Two stresses of this size are subtracted.
                let size = (l * l + 1.0 / l.powi(4)) * l.max(1.0 / l);
                assert!((found - exact).abs() < 1e-14 * size, "{l}: {found} {exact}");
            };
            let exact = 2.0 * (l - l.powi(-2)) * (c10 + c01 / l);
            close(uniaxial(&law, l), exact);
            let exact = 2.0 * (l - l.powi(-5)) * (c10 + l * l * c01);
            close(equibiaxial(&law, l), exact);
            let exact = 2.0 * (l - l.powi(-3)) * (c10 + c01);
            close(pure_shear(&law, l), exact);
        }
        // Printed digits.
        assert!((uniaxial(&ONES, 1.5) - 3.518518519).abs() < 5e-10);
        assert!((equibiaxial(&ONES, 1.5) - 8.894033).abs() < 5e-7);
        assert!((pure_shear(&ONES, 1.5) - 4.814815).abs() < 5e-7);
    }

    #[test]
    fn gent_stiffens_up_to_its_limit_and_ends_there() {
        let law = Law::Gent {
            shear: 1.2,
            limit: 9.0,
        };
        for mode in Mode::ALL {
            for l in [0.75_f64, 0.999, 1.001, 1.3, 1.6] {
                let squares = mode.stretches(l).map(|l| l * l);
                let first: f64 = squares.iter().sum();
                let exact = 1.2 * (squares[0] - squares[2]) / l / (1.0 - (first - 3.0) / 9.0);
                let found = mode.nominal_stress(&law, l);
                // Two stresses of this size are subtracted.
                assert!(
                    (found - exact).abs() < 1e-14 * squares[0].max(squares[2]) * 4.0,
                    "{mode} {l}"
                );
            }
        }
        // I1 = 12 at a stretch of 3.37 in uniaxial stretching.
        assert!(uniaxial(&law, 3.3).is_finite());
        assert!(uniaxial(&law, 3.4).is_nan());
    }

    #[test]
    fn simple_shear_has_rivlins_universal_relation() {
        let f: Tensor<f64> = [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let stress = ONES.response(&f).stress;
        assert!((stress[3] - 2.0).abs() < 1e-14);
        assert!((stress[0] - stress[1] - 1.0).abs() < 1e-14);
        for law in crate::material::tests::LAWS {
            let stress = law.response(&f).stress;
            assert!(
                (stress[0] - stress[1] - 0.5 * stress[3]).abs() < 1e-13,
                "{law:?}"
            );
        }
    }

    /// Treloar 1944, uniaxial: stretch, nominal stress in kgf/cm^2.
    const TRELOAR: [(f64, f64); 11] = [
        (1.000, 0.00),
        (1.240, 2.30),
        (1.585, 4.16),
        (2.180, 6.00),
        (3.020, 8.80),
        (4.030, 12.5),
        (4.760, 16.2),
        (5.750, 23.6),
        (6.850, 38.5),
        (7.250, 49.6),
        (7.600, 64.4),
    ];

    /// Constants of laws of unit constants that fit Treloar's data best, with the root
    /// mean square of what is left; MPa.
    fn fitted<const N: usize>(units: [Law; N]) -> ([f64; N], f64) {
        let row = |l: f64| units.map(|law| uniaxial(&law, l));
        let mut normal = [[0.0; N]; N];
        let mut right = [0.0; N];
        let data = TRELOAR.map(|(l, stress)| (row(l), stress * 0.0980665));
        for (row, stress) in data {
            for i in 0..N {
                right[i] += row[i] * stress;
                for j in 0..N {
                    normal[i][j] += row[i] * row[j];
                }
            }
        }
        let c = solved(normal, right);
        let square = |(row, stress): ([f64; N], f64)| {
            let model: f64 = (0..N).map(|i| row[i] * c[i]).sum();
            (model - stress) * (model - stress)
        };
        let rms = (data.into_iter().map(square).sum::<f64>() / 11.0).sqrt();
        (c, rms)
    }

    /// Gauss's elimination; the matrix is positive definite.
    fn solved<const N: usize>(mut a: [[f64; N]; N], mut x: [f64; N]) -> [f64; N] {
        for p in 0..N {
            for i in 0..N {
                if i != p {
                    let factor = a[i][p] / a[p][p];
                    x[i] -= factor * x[p];
                    for j in 0..N {
                        a[i][j] -= factor * a[p][j];
                    }
                }
            }
        }
        std::array::from_fn(|i| x[i] / a[i][i])
    }

    #[test]
    fn treloar_by_yeoh() {
        let unit = |c10, c20, c30| Law::Yeoh { c10, c20, c30 };
        let ([c10, c20, c30], rms) = fitted([
            unit(1.0, 0.0, 0.0),
            unit(0.0, 1.0, 0.0),
            unit(0.0, 0.0, 1.0),
        ]);
        // The digits of an independent fit (FElupe 11.3.0).
        assert!((c10 - 0.18229).abs() < 5e-6, "{c10}");
        assert!((c20 - -0.002148).abs() < 5e-7, "{c20}");
        assert!((c30 - 5.1e-5).abs() < 5e-7, "{c30}");
        assert!((rms - 0.101).abs() < 5e-4, "{rms}");
    }

    #[test]
    fn treloar_by_mooney_and_rivlin_is_refused() {
        let unit = |c10, c01| Law::MooneyRivlin { c10, c01 };
        let ([c10, c01], rms) = fitted([unit(1.0, 0.0), unit(0.0, 1.0)]);
        assert!((c10 - 0.4326).abs() < 5e-5, "{c10}");
        assert!((c01 - -0.8410).abs() < 5e-5, "{c01}");
        assert!((rms - 0.680).abs() < 5e-4, "{rms}");
        let refused = crate::material::stability::over_range(&unit(c10, c01), 1.0, 7.6);
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("shear modulus of -0.81"), "{message}");
        crate::material::Material::mooney_rivlin(c10, c01, 0.0).unwrap_err();
    }
}
