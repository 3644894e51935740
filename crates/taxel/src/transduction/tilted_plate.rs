//! Capacitance of a plane tile tilted over a plane electrode.
//!
//! C = ε₀ ∫∫ dx dy / (g + αx + βy) = ε₀ a b · m(g, p, q), with
//! p = |α|a/2 and q = |β|b/2 (P2, exact form of its parallel-plate EGD).
//!
//! The textbook four-term form of m cancels: at slopes of 1e-9 it is wrong by
//! 10 %. Two forms without cancellation cover the whole domain p + q ≤ g;
//! `docs/theory/three-axis-capacitive.md` derives both.

/// Vacuum permittivity, F/m (CODATA 2022).
pub const VACUUM_PERMITTIVITY: f64 = 8.8541878188e-12;

/// The mean of 1/gap over a tilted tile, 1/m, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanInverseGap {
    /// m, 1/m.
    pub value: f64,
    /// ∂m/∂g, 1/m².
    pub by_gap: f64,
    /// ∂m/∂p, 1/m².
    pub by_p: f64,
    /// ∂m/∂q, 1/m².
    pub by_q: f64,
}

/// [`MeanInverseGap`] of several tiles that are tilted alike, field by field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeanInverseGaps<const N: usize> {
    pub(super) value: [f64; N],
    pub(super) by_gap: [f64; N],
    pub(super) by_p: [f64; N],
    pub(super) by_q: [f64; N],
}

impl<const N: usize> MeanInverseGaps<N> {
    fn at(&self, i: usize) -> MeanInverseGap {
        MeanInverseGap {
            value: self.value[i],
            by_gap: self.by_gap[i],
            by_p: self.by_p[i],
            by_q: self.by_q[i],
        }
    }
}

/// Below this (p + q)/g the power series is used: at most 29 terms.
const SERIES_LIMIT: f64 = 0.5;

/// Weights 1/((2n+1)(n+1)) of the power series.
const WEIGHTS: [f64; 30] = {
    let mut weights = [0.0; 30];
    let mut n = 0;
    while n < weights.len() {
        weights[n] = 1.0 / ((2 * n + 1) * (n + 1)) as f64;
        n += 1;
    }
    weights
};

/// Mean of 1/(g + p s + q t) over s, t in [-1, 1] (section 3 of the physics
/// of P2), relative error below 1e-14.
///
/// `gap` > 0 is the gap at the tile's centre, `p` and `q` ≥ 0 half the rise
/// along each side, all in m. `None` when p + q > gap: the tile would pass
/// through the electrode, which is contact and not a number to extrapolate.
///
/// ```
/// use taxel::transduction::mean_inverse_gap;
/// let parallel = mean_inverse_gap(8e-6, 0.0, 0.0).unwrap();
/// assert_eq!(parallel.value, 1.0 / 8e-6);
/// // Tilt alone raises the capacitance.
/// assert!(mean_inverse_gap(8e-6, 1e-6, 0.0).unwrap().value > parallel.value);
/// assert!(mean_inverse_gap(8e-6, 5e-6, 4e-6).is_none());
/// ```
pub fn mean_inverse_gap(gap: f64, p: f64, q: f64) -> Option<MeanInverseGap> {
    let possible = gap > 0.0 && gap.is_finite() && p >= 0.0 && q >= 0.0 && p + q <= gap;
    if !possible {
        return None;
    }
    if p + q < SERIES_LIMIT * gap {
        Some(by_series([gap], p, q).at(0))
    } else if p >= q {
        Some(by_logarithms(gap, p, q))
    } else {
        let swapped = by_logarithms(gap, q, p);
        Some(MeanInverseGap {
            by_p: swapped.by_q,
            by_q: swapped.by_p,
            ..swapped
        })
    }
}

/// [`mean_inverse_gap`] of four tiles that are tilted alike, at less than half
/// the cost of one after the other.
pub(super) fn mean_inverse_gaps(gap: [f64; 4], p: f64, q: f64) -> Option<MeanInverseGaps<4>> {
    if p >= 0.0 && q >= 0.0 && gap.iter().all(|gap| p + q < SERIES_LIMIT * gap) {
        return Some(by_series(gap, p, q));
    }
    let [a, b, c, d] = gap.map(|gap| mean_inverse_gap(gap, p, q));
    let means = [a?, b?, c?, d?];
    Some(MeanInverseGaps {
        value: means.map(|mean| mean.value),
        by_gap: means.map(|mean| mean.by_gap),
        by_p: means.map(|mean| mean.by_p),
        by_q: means.map(|mean| mean.by_q),
    })
}

/// m·g = f(A, B) = Σ wₙ (Aⁿ⁺¹ − Bⁿ⁺¹)/(A − B), A = (P+Q)², B = (P−Q)²,
/// wₙ = 1/((2n+1)(n+1)): the divided difference h[A, B] of h(x) = Σ wₙ xⁿ⁺¹.
///
/// Its slopes are h[A, A, B] and h[A, B, B]. Repeated Horner schemes give all
/// three from positive terms only, so nothing cancels, also for A = B.
fn by_series<const N: usize>(gap: [f64; N], p: f64, q: f64) -> MeanInverseGaps<N> {
    let inverse = gap.map(|gap| 1.0 / gap);
    let sum = inverse.map(|inverse| (p + q) * inverse);
    let difference = inverse.map(|inverse| (p - q) * inverse);
    let (a, b) = (sum.map(|x| x * x), difference.map(|x| x * x));
    let (mut quotient, mut f) = ([0.0; N], [0.0; N]);
    let (mut f_a, mut f_b) = ([0.0; N], [0.0; N]);
    let terms = terms(a.iter().copied().fold(0.0, f64::max));
    for weight in WEIGHTS[..terms].iter().rev() {
        for i in 0..N {
            f_a[i] = f[i] + a[i] * f_a[i];
            f_b[i] = f[i] + b[i] * f_b[i];
            quotient[i] = weight + a[i] * quotient[i];
            f[i] = quotient[i] + b[i] * f[i];
        }
    }
    let square = inverse.map(|inverse| 2.0 * inverse * inverse);
    let along: [f64; N] = std::array::from_fn(|i| sum[i] * f_a[i] * square[i]);
    let across: [f64; N] = std::array::from_fn(|i| difference[i] * f_b[i] * square[i]);
    let value: [f64; N] = std::array::from_fn(|i| f[i] * inverse[i]);
    let by_p: [f64; N] = std::array::from_fn(|i| along[i] + across[i]);
    let by_q: [f64; N] = std::array::from_fn(|i| along[i] - across[i]);
    MeanInverseGaps {
        value,
        // m is homogeneous of degree -1 in (g, p, q).
        by_gap: std::array::from_fn(|i| -(value[i] + p * by_p[i] + q * by_q[i]) * inverse[i]),
        by_p,
        by_q,
    }
}

/// Terms after which the rest of f_A, the slowest sum, is below Aⁿ⁻¹/3 < 4e-17.
fn terms(a: f64) -> usize {
    let (mut power, mut terms) = (1.0, 1);
    while power > 1e-16 && terms < WEIGHTS.len() {
        power *= a;
        terms += 1;
    }
    terms
}

/// m = [ln((g+p)/(g−p)) + φ(q/(g+p)) − φ(q/(g−p))] / (2p) for p ≥ q, where
/// φ(e) = [(1+e)ln(1+e) − (1−e)ln(1−e)] / (2e).
///
/// With p ≥ g/4 each bracket is of the order of one. A corner that touches
/// (p + q = g) has a finite m; its slopes are infinite.
fn by_logarithms(gap: f64, p: f64, q: f64) -> MeanInverseGap {
    let (far, near) = (gap + p, gap - p);
    if near <= 0.0 {
        // The whole edge touches: the integral diverges.
        let inf = f64::INFINITY;
        return MeanInverseGap {
            value: inf,
            by_gap: -inf,
            by_p: inf,
            by_q: inf,
        };
    }
    let (e_far, e_near) = (q / far, q / near);
    let slit = (near - q) / near; // 1 − e_near without losing digits
    let (psi_far, psi_near) = (atanh_ratio(e_far, 1.0 - e_far), atanh_ratio(e_near, slit));
    let value = ((far / near).ln() + phi(e_far, 1.0 - e_far) - phi(e_near, slit)) / (2.0 * p);
    let by_gap = (psi_far / far - psi_near / near) / (2.0 * p);
    // (ψ(e) − 1)/e² instead of ψ(e): small q would cancel.
    let (excess_far, excess_near) = (atanh_excess(e_far, psi_far), atanh_excess(e_near, psi_near));
    let by_q = q * (excess_near / (near * near) - excess_far / (far * far)) / (2.0 * p);
    MeanInverseGap {
        value,
        by_gap,
        by_p: -(value + gap * by_gap + q * by_q) / p,
        by_q,
    }
}

/// φ(e) with `slit` = 1 − e; φ(0) = 1, φ(1) = ln 2.
fn phi(e: f64, slit: f64) -> f64 {
    if e < 0.1 {
        // φ = atanh(e)/e + ln(1−e²)/2
        return atanh_ratio(e, slit) + 0.5 * (-e * e).ln_1p();
    }
    let lower = if slit > 0.0 { slit * slit.ln() } else { 0.0 };
    ((1.0 + e) * e.ln_1p() - lower) / (2.0 * e)
}

/// atanh(e)/e with `slit` = 1 − e; 1 at e = 0.
fn atanh_ratio(e: f64, slit: f64) -> f64 {
    if e < 1e-4 {
        let square = e * e;
        return 1.0 + square / 3.0 + square * square / 5.0;
    }
    if e < 0.5 {
        return e.atanh() / e;
    }
    0.5 * ((1.0 + e) / slit).ln() / e
}

/// (ψ(e) − 1)/e² for `psi` = ψ(e) = atanh(e)/e; 1/3 at e = 0.
fn atanh_excess(e: f64, psi: f64) -> f64 {
    let square = e * e;
    if e < 0.05 {
        return 1.0 / 3.0 + square * (0.2 + square * (1.0 / 7.0 + square / 9.0));
    }
    (psi - 1.0) / square
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The four-term form, good where p and q are large.
    fn four_term(g: f64, p: f64, q: f64) -> f64 {
        let h = |u: f64| if u > 0.0 { u * u.ln() } else { 0.0 };
        (h(g + p + q) - h(g - p + q) - h(g + p - q) + h(g - p - q)) / (4.0 * p * q)
    }

    #[test]
    fn agrees_with_the_four_term_form_where_that_is_good() {
        for (p, q) in [
            (0.3, 0.25),
            (0.3, 0.6),
            (0.55, 0.4),
            (0.7, 0.3),
            (0.2, 0.29),
            (0.5, 0.5),
        ] {
            let m = mean_inverse_gap(1.0, p, q).unwrap().value;
            // The four-term form itself loses about g²/(pq) units in the last place.
            assert!(
                (m / four_term(1.0, p, q) - 1.0).abs() < 1e-13,
                "{p} {q}: {m}"
            );
        }
    }

    #[test]
    fn both_forms_meet_at_the_border() {
        for ratio in [0.0, 1e-9, 1e-5, 1e-3, 0.1, 0.5, 1.0] {
            let p = SERIES_LIMIT / (1.0 + ratio);
            let series = by_series([1.0], p, ratio * p).at(0);
            let logs = by_logarithms(1.0, p, ratio * p);
            assert!((series.value / logs.value - 1.0).abs() < 5e-15, "{ratio}");
            assert!((series.by_gap / logs.by_gap - 1.0).abs() < 1e-13, "{ratio}");
            assert!((series.by_p / logs.by_p - 1.0).abs() < 1e-12, "{ratio}");
            assert!((series.by_q - logs.by_q).abs() < 1e-13, "{ratio}");
        }
    }

    #[test]
    fn four_tiles_at_once_are_four_tiles() {
        // The last gap is beyond the series.
        for gap in [[1.0, 0.8, 0.9, 1.3], [1.0, 0.8, 0.9, 0.31]] {
            let four = mean_inverse_gaps(gap, 0.1, 0.2).unwrap();
            for (i, gap) in gap.into_iter().enumerate() {
                let mean = four.at(i);
                let one = mean_inverse_gap(gap, 0.1, 0.2).unwrap();
                // A term more or less at the end of the series.
                assert!((mean.value / one.value - 1.0).abs() < 1e-15);
                assert!((mean.by_gap / one.by_gap - 1.0).abs() < 1e-15);
                assert!((mean.by_p / one.by_p - 1.0).abs() < 2e-15);
                assert!((mean.by_q / one.by_q - 1.0).abs() < 2e-15);
            }
        }
        assert_eq!(mean_inverse_gaps([1.0, 1.0, 1.0, 0.2], 0.1, 0.2), None);
    }

    #[test]
    fn one_tilt_is_atanh() {
        for p in [1e-12, 1e-6, 0.01, 0.3, 0.7, 0.999] {
            let exact: f64 = f64::atanh(p) / p;
            assert!((mean_inverse_gap(1.0, p, 0.0).unwrap().value / exact - 1.0).abs() < 1e-14);
            assert!((mean_inverse_gap(1.0, 0.0, p).unwrap().value / exact - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn touching_corner_is_finite_and_touching_edge_is_not() {
        let corner = mean_inverse_gap(1.0, 0.6, 0.4).unwrap().value;
        assert!((corner / four_term(1.0, 0.6, 0.4) - 1.0).abs() < 1e-13);
        assert_eq!(
            mean_inverse_gap(1.0, 1.0, 0.0).unwrap().value,
            f64::INFINITY
        );
    }

    #[test]
    fn impossible_gaps_have_no_value() {
        for (g, p, q) in [
            (1.0, 0.6, 0.5),
            (0.0, 0.0, 0.0),
            (-1.0, 0.0, 0.0),
            (f64::NAN, 0.0, 0.0),
            (1.0, f64::NAN, 0.0),
        ] {
            assert_eq!(mean_inverse_gap(g, p, q), None);
        }
    }
}
