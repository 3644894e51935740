//! Relaxation and creep: Prony series of a stress that was held, or of a strain under a load that was.

use crate::material::{MOST_RELAXED, Relaxation};
use crate::minimum::{simplex, solved};

/// A test that was held at a stretch or under a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Times from the begin of the loading, s, and what was measured: stress in Pa, or strain.
    pub points: Vec<[f64; 2]>,
    /// Length of the ramp to what is held, s; none where nobody says.
    pub ramp: Option<f64>,
    /// True if a load was held and strains were measured.
    pub creeps: bool,
}

/// Why there is no series.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RelaxationError {
    /// Too few points.
    #[error("{found} points behind the ramp; a series needs {needed}")]
    Few {
        /// Points found.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// The record begins late.
    #[error(
        "the first reading is {first:.3} s after the ramp, later than a tenth of the {length:.3} s of the record: what relaxes before is not known"
    )]
    Late {
        /// Time of the first reading after the ramp, s.
        first: f64,
        /// Length of the record, s.
        length: f64,
    },
    /// A value that cannot be.
    #[error("the value {value} at {time} s is not above 0: look at the sign and at the columns")]
    Value {
        /// Value.
        value: f64,
        /// Time, s.
        time: f64,
    },
    /// More relaxes than a rubber does.
    #[error(
        "the fractions sum up to {sum:.3}; more than {MOST_RELAXED} is no solid: the record may end before it is at rest"
    )]
    Liquid {
        /// Sum.
        sum: f64,
    },
}

/// A series that was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxationFit {
    /// Terms of the stress, fractions of the sudden one, the fastest first.
    pub terms: Vec<Relaxation>,
    /// What a sudden load would give, in the unit of the points; none where the ramp is not known.
    pub sudden: Option<f64>,
    /// What is left after a long time.
    pub long: f64,
    /// Relative rms.
    pub rms: f64,
    /// AICc of one to five terms.
    pub criteria: Vec<f64>,
}

/// Most terms that are tried.
const MOST_TERMS: usize = 5;
/// Fewest readings.
const FEWEST: usize = 8;
/// Starts of the search of each number of terms, as parts of the range of times between which the first
/// ones are spread evenly in logarithms.
const STARTS: [[f64; 2]; 3] = [[0.1, 0.9], [0.0, 0.7], [0.3, 1.0]];
/// A misfit of this size is rounding of the file: more terms gain nothing.
const ROUNDING: f64 = 1e-18;

/// `(tau/T)(exp(T/tau) - 1) exp(-t/tau)`: what is left of a term at `time` from the begin of a ramp of length
/// `ramp`.
fn left(time: f64, ramp: f64, tau: f64) -> f64 {
    if ramp == 0.0 {
        return (-time / tau).exp();
    }
    let x = ramp / tau;
    // exp(T/tau) alone overflows where a term is much faster than the ramp.
    ((ramp - time) / tau).exp() * -(-x).exp_m1() / x
}

/// Fits one to five terms to what was measured while a stretch or a load was held, and takes the
/// number that the corrected criterion of Akaike says. A creep becomes the relaxation that belongs to it.
///
/// # Errors
/// [`RelaxationError`]
pub fn relaxed(test: &Held) -> Result<RelaxationFit, RelaxationError> {
    let creeps = test.creeps;
    let ramp = test.ramp.unwrap_or(0.0);
    let points: Vec<[f64; 2]> = test
        .points
        .iter()
        .copied()
        .filter(|[time, _]| *time >= ramp && time.is_finite())
        .collect();
    if points.len() < FEWEST {
        return Err(RelaxationError::Few {
            found: points.len(),
            needed: FEWEST,
        });
    }
    if let Some([time, value]) = points.iter().find(|[_, value]| *value <= 0.0) {
        return Err(RelaxationError::Value {
            value: *value,
            time: *time,
        });
    }
    let times = points.iter().map(|[time, _]| *time);
    let last = times.clone().fold(0.0, f64::max);
    let first = times.fold(f64::INFINITY, f64::min);
    if first - ramp > 0.1 * (last - ramp) {
        return Err(RelaxationError::Late {
            first: first - ramp,
            length: last - ramp,
        });
    }
    // Without a ramp the shortest time that the record can tell follows from its first readings.
    let positive = points
        .iter()
        .map(|[time, _]| *time)
        .filter(|time| *time > 0.0);
    let shortest = if ramp > 0.0 {
        ramp / 5.0
    } else {
        positive.fold(last, f64::min)
    };
    let ends = [shortest.ln(), (3.0 * last).ln()];
    let count = points.len() as f64;
    let mut best: Option<(f64, Series)> = None;
    let mut criteria = Vec::new();
    for terms in 1..=MOST_TERMS {
        let parameters = 2 * terms + 1;
        if points.len() < parameters + 2 {
            break;
        }
        let series = searched(&points, (ramp, creeps), terms, ends);
        let k = parameters as f64 + 1.0;
        let misfit = (series.misfit / count).max(ROUNDING);
        let criterion = count * misfit.ln() + 2.0 * k + 2.0 * k * (k + 1.0) / (count - k - 1.0);
        criteria.push(criterion);
        if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
            best = Some((criterion, series));
        }
    }
    let Some((_, series)) = best else {
        return Err(RelaxationError::Few {
            found: points.len(),
            needed: FEWEST,
        });
    };
    // P0 (1 - sum g) and P0 g of each term; of a creep e0 and e0 j.
    let sum: f64 = series.factors.iter().sum();
    let (sudden, long) = if creeps {
        (series.factors[0], sum)
    } else {
        (sum, series.factors[0])
    };
    let mut terms: Vec<Relaxation> = series
        .times
        .iter()
        .zip(&series.factors[1..])
        .filter(|(_, factor)| **factor > 0.0)
        .map(|(time, factor)| Relaxation {
            fraction: factor / sudden,
            time: *time,
        })
        .collect();
    terms.sort_by(|one, other| one.time.total_cmp(&other.time));
    if creeps {
        terms = relaxation_of_creep(&terms);
    }
    let sum: f64 = terms.iter().map(|term| term.fraction).sum();
    if sum > MOST_RELAXED {
        return Err(RelaxationError::Liquid { sum });
    }
    Ok(RelaxationFit {
        terms,
        sudden: test.ramp.map(|_| sudden),
        long,
        rms: (series.misfit / count).sqrt(),
        criteria,
    })
}

/// A series with the long-time value, then the factor of each time.
struct Series {
    times: Vec<f64>,
    factors: Vec<f64>,
    misfit: f64,
}

/// The best factors of given times, none below zero: relative residuals.
fn with_times(points: &[[f64; 2]], (ramp, creeps): (f64, bool), times: &[f64]) -> Series {
    let column = |tau: Option<f64>| -> Vec<f64> {
        let term = |time: f64, tau: f64| {
            let left = left(time, ramp, tau);
            if creeps { 1.0 - left } else { left }
        };
        let of = |[time, value]: &[f64; 2]| tau.map_or(1.0, |tau| term(*time, tau)) / value;
        points.iter().map(of).collect()
    };
    let mut columns = vec![column(None)];
    columns.extend(times.iter().map(|tau| column(Some(*tau))));
    let factors = not_negative(&columns, points.len());
    let misfit = (0..points.len())
        .map(|row| {
            let model: f64 = columns.iter().zip(&factors).map(|(c, f)| c[row] * f).sum();
            (1.0 - model).powi(2)
        })
        .sum();
    Series {
        times: times.to_vec(),
        factors,
        misfit,
    }
}

/// Least squares to a target of ones with no factor below zero (Lawson and Hanson): columns join one by
/// one, and leave where they would be negative.
fn not_negative(columns: &[Vec<f64>], rows: usize) -> Vec<f64> {
    let count = columns.len();
    let mut factors = vec![0.0; count];
    let mut free = vec![false; count];
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // Each turn frees one column; a column that comes back ends the search.
    for _ in 0..3 * count {
        let rest: Vec<f64> = (0..rows)
            .map(|row| {
                1.0 - columns
                    .iter()
                    .zip(&factors)
                    .map(|(c, f)| c[row] * f)
                    .sum::<f64>()
            })
            .collect();
        let gain = |k: usize| dot(&columns[k], &rest) / dot(&columns[k], &columns[k]).sqrt();
        let next = (0..count)
            .filter(|k| !free[*k])
            .max_by(|a, b| gain(*a).total_cmp(&gain(*b)));
        let Some(next) = next.filter(|k| gain(*k) > 1e-14 * (rows as f64).sqrt()) else {
            break;
        };
        free[next] = true;
        loop {
            let chosen: Vec<usize> = (0..count).filter(|k| free[*k]).collect();
            let part: Vec<Vec<f64>> = chosen.iter().map(|k| columns[*k].clone()).collect();
            let Some((solved, _)) = solved(part, vec![1.0; rows]) else {
                free[next] = false;
                break;
            };
            if solved.iter().all(|factor| *factor > 0.0) {
                for (k, factor) in chosen.iter().zip(&solved) {
                    factors[*k] = *factor;
                }
                break;
            }
            // As far towards the solution as no factor turns negative.
            let mut part = 1.0_f64;
            for (k, factor) in chosen.iter().zip(&solved) {
                if *factor <= 0.0 {
                    part = part.min(factors[*k] / (factors[*k] - factor));
                }
            }
            for (k, factor) in chosen.iter().zip(&solved) {
                factors[*k] += part * (factor - factors[*k]);
                if factors[*k] <= 1e-15 {
                    (factors[*k], free[*k]) = (0.0, false);
                }
            }
            if !free[next] {
                return factors;
            }
        }
    }
    factors
}

fn searched(points: &[[f64; 2]], ramp: (f64, bool), terms: usize, ends: [f64; 2]) -> Series {
    let mut best: Option<Series> = None;
    for [from, to] in STARTS {
        let at = |part: f64| ends[0] + part * (ends[1] - ends[0]);
        let start: Vec<f64> = (0..terms)
            .map(|n| at(from + (to - from) * (n as f64 + 0.5) / terms as f64))
            .collect();
        let value = |x: &[f64]| {
            if x.iter().all(|x| (ends[0]..=ends[1]).contains(x)) {
                let times: Vec<f64> = x.iter().map(|x| x.exp()).collect();
                with_times(points, ramp, &times).misfit
            } else {
                f64::INFINITY
            }
        };
        let mut x = start;
        let mut least = f64::INFINITY;
        let mut size = 0.5;
        // A simplex that has shrunk on a slope begins anew, until nothing is gained.
        for _ in 0..12 {
            let (found, misfit) = simplex(&x, &vec![size; terms], (1e-14, 0.0), &value);
            let gained = least - misfit > 1e-9 * misfit;
            (x, least) = (found, misfit);
            size *= 0.4;
            if !gained {
                break;
            }
        }
        let times: Vec<f64> = x.iter().map(|x| x.exp()).collect();
        let series = with_times(points, ramp, &times);
        if best.as_ref().is_none_or(|best| series.misfit < best.misfit) {
            best = Some(series);
        }
    }
    best.unwrap_or_else(|| with_times(points, ramp, &[]))
}

/// Creep that belongs to a relaxation: the compliance after a long time over the sudden one, and
/// the terms of what is added to it, each with its share of the sudden compliance and its retardation
/// time. The times are the poles of the compliance, one between each two relaxation times and one
/// beyond the last.
///
/// # Example
/// ```
/// use taxel_material::{Relaxation, creep};
///
/// let (long, terms) = creep(&[Relaxation { fraction: 0.3, time: 2.0 }]);
/// assert!((long - 1.0 / 0.7).abs() < 1e-12);
/// assert!((terms[0].time - 2.0 / 0.7).abs() < 1e-12);
/// ```
pub fn creep(terms: &[Relaxation]) -> (f64, Vec<Relaxation>) {
    let sum: f64 = terms.iter().map(|term| term.fraction).sum();
    // s G(s) = 1 - sum g / (1 + tau s).
    (1.0 / (1.0 - sum), reciprocal(terms, -1.0))
}

/// The relaxation that belongs to a creep of these terms, as [`creep`] gives them.
pub fn relaxation_of_creep(terms: &[Relaxation]) -> Vec<Relaxation> {
    // s J(s) = 1 + sum j / (1 + theta s).
    let mut found = reciprocal(terms, 1.0);
    found.sort_by(|one, other| one.time.total_cmp(&other.time));
    found
}

/// Terms of the reciprocal of `1 + sign sum f / (1 + t s)`, from the slowest rate on: its zeros lie at s = -rate, one
/// before each pole 1/t where the sign is negative and one behind each where it is positive, with residues that say by
/// how much the reciprocal changes.
fn reciprocal(terms: &[Relaxation], sign: f64) -> Vec<Relaxation> {
    let value = |rate: f64| {
        let terms = terms
            .iter()
            .map(|term| term.fraction / (1.0 - term.time * rate));
        1.0 + sign * terms.sum::<f64>()
    };
    let slope = |rate: f64| {
        let of = |term: &Relaxation| term.fraction * term.time / (1.0 - term.time * rate).powi(2);
        terms.iter().map(of).sum::<f64>()
    };
    let mut ends: Vec<f64> = terms.iter().map(|term| 1.0 / term.time).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    if sign < 0.0 {
        ends.insert(0, 0.0);
    } else if let Some(last) = ends.last() {
        // Behind the last pole the sum is above zero at this rate at the latest.
        let all: f64 = terms.iter().map(|term| term.fraction).sum();
        ends.push((1.0 + all) * 2.0 * last);
    }
    let zero = |pair: &[f64]| {
        let (mut low, mut high) = (pair[0], pair[1]);
        // Halved until no number lies between.
        loop {
            let middle = f64::midpoint(low, high);
            if middle <= low || middle >= high {
                break middle;
            }
            if sign * value(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
    };
    let rates = ends.windows(2).map(zero);
    rates
        .map(|rate| Relaxation {
            fraction: 1.0 / (rate * slope(rate)),
            time: 1.0 / rate,
        })
        .collect()
}

/// Share of the sudden stress that a pull of constant rate measures after `time`.
pub fn constant_rate(terms: &[Relaxation], time: f64) -> f64 {
    let lost = |term: &Relaxation| {
        let x = time / term.time;
        if x == 0.0 {
            return 0.0;
        }
        term.fraction * (1.0 + (-x).exp_m1() / x)
    };
    1.0 - terms.iter().map(lost).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TERMS: [Relaxation; 3] = [
        Relaxation {
            fraction: 0.08,
            time: 0.4,
        },
        Relaxation {
            fraction: 0.12,
            time: 6.0,
        },
        Relaxation {
            fraction: 0.05,
            time: 90.0,
        },
    ];

    fn held(ramp: f64, error: impl Fn(usize) -> f64) -> Held {
        // Sixty readings, evenly in logarithms, to 300 s.
        let points = (0..120).map(|n| {
            let time = ramp * (600.0_f64).powf(n as f64 / 119.0);
            let of = |term: &Relaxation| term.fraction * (1.0 - left(time, ramp, term.time));
            let stress = 100.0 * (1.0 - TERMS.iter().map(of).sum::<f64>());
            [time, stress * (1.0 + error(n))]
        });
        Held {
            points: points.collect(),
            ramp: Some(ramp),
            creeps: false,
        }
    }

    #[test]
    fn exact_readings_give_the_terms_and_the_sudden_stress() {
        let fit = relaxed(&held(0.5, |_| 0.0)).unwrap();
        assert_eq!(fit.terms.len(), 3, "{fit:?}");
        for (found, known) in fit.terms.iter().zip(TERMS) {
            // The search ends at the rounding of the misfit: its root.
            assert!((found.fraction - known.fraction).abs() < 1e-6, "{fit:?}");
            assert!((found.time / known.time - 1.0).abs() < 1e-5, "{fit:?}");
        }
        assert!((fit.sudden.unwrap() - 100.0).abs() < 1e-4);
        assert!((fit.long - 75.0).abs() < 1e-4);
    }

    #[test]
    fn without_a_ramp_there_is_no_sudden_stress() {
        let unknown = Held {
            ramp: None,
            ..held(0.5, |_| 0.0)
        };
        assert_eq!(relaxed(&unknown).unwrap().sudden, None);
    }

    #[test]
    fn what_no_series_can_say_is_refused() {
        let late = held(0.5, |_| 0.0);
        let tail = late.points[100..].to_vec();
        let late = Held {
            points: tail,
            ramp: Some(0.5),
            creeps: false,
        };
        assert!(matches!(relaxed(&late), Err(RelaxationError::Late { .. })));
        let few = Held {
            points: late.points[..3].to_vec(),
            ramp: None,
            creeps: false,
        };
        assert!(matches!(
            relaxed(&few),
            Err(RelaxationError::Few { found: 3, .. })
        ));
        let liquid = Held {
            points: (0..50)
                .map(|n| f64::from(n) * 0.2)
                .map(|time| [time, (-time).exp()])
                .collect(),
            ramp: Some(0.0),
            creeps: false,
        };
        assert!(matches!(
            relaxed(&liquid),
            Err(RelaxationError::Liquid { .. })
        ));
    }

    #[test]
    fn creep_and_relaxation_are_each_other_s_inverse() {
        let (long, terms) = creep(&TERMS);
        assert!((long - 1.0 / 0.75).abs() < 1e-12);
        // The sudden compliance and all terms are that after a long time.
        let sum: f64 = terms.iter().map(|term| term.fraction).sum();
        assert!((1.0 + sum - long).abs() < 1e-9, "{terms:?}");
        for (found, known) in relaxation_of_creep(&terms).iter().zip(TERMS) {
            // Bisection to the last bits; the slope at a pole takes some of them.
            assert!((found.fraction - known.fraction).abs() < 1e-9, "{found:?}");
            assert!((found.time / known.time - 1.0).abs() < 1e-9, "{found:?}");
        }
        let (long, one) = creep(&[Relaxation {
            fraction: 0.3,
            time: 2.0,
        }]);
        assert!((long - 1.428571).abs() < 1e-6 && (one[0].time - 2.857143).abs() < 1e-6);
        let back = relaxation_of_creep(&one);
        assert!((back[0].fraction - 0.3).abs() < 1e-9 && (back[0].time - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_creep_gives_the_relaxation_that_belongs_to_it() {
        let one = Relaxation {
            fraction: 0.3,
            time: 2.0,
        };
        let (_, terms) = creep(&[one]);
        let strain =
            |time: f64| 0.1 * (1.0 + terms[0].fraction * -(-time / terms[0].time).exp_m1());
        let test = Held {
            points: (0..60)
                .map(|n| 0.05 * 1.12_f64.powi(n))
                .map(|time| [time, strain(time)])
                .collect(),
            ramp: Some(0.0),
            creeps: true,
        };
        let fit = relaxed(&test).unwrap();
        // As the search of the relaxation.
        assert!((fit.terms[0].fraction - 0.3).abs() < 1e-6, "{fit:?}");
        assert!((fit.terms[0].time / 2.0 - 1.0).abs() < 1e-5, "{fit:?}");
        assert!((fit.sudden.unwrap() - 0.1).abs() < 1e-7 && (fit.long - 0.1 / 0.7).abs() < 1e-6);
    }

    #[test]
    fn a_pull_of_constant_rate_lies_between_sudden_and_long() {
        assert!((constant_rate(&TERMS, 0.0) - 1.0).abs() < 1e-15);
        assert!((constant_rate(&TERMS, 1e9) - 0.75).abs() < 1e-6);
    }
}
