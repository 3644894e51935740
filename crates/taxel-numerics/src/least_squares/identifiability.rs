//! Combinations of parameters that the readings do not identify.

use super::Problem;
use super::dense::Spectrum;

/// Combination of parameters that the readings do not identify to within the
/// sizes of its members.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// The parameters that move together along it, the largest share first.
    pub members: Vec<Member>,
    /// Standard deviation along it, in sizes of the parameters; above 1.
    pub deviation: f64,
    /// Measurement that would identify it, as a sentence without a full stop; may
    /// be empty.
    pub remedy: String,
}

/// One parameter of a combination.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// Its index.
    pub parameter: usize,
    /// Its movement, in its size, for one step along the combination; from −1 to 1.
    pub share: f64,
}

/// Members that move by less than this share of the largest are left out.
const NEGLIGIBLE: f64 = 0.25;

/// The combinations that the slopes (per size and noise) of the parameters
/// `free` leave open, by their `spectrum`, the worst first.
pub(super) fn directions(
    problem: &dyn Problem,
    spectrum: &Spectrum,
    free: &[usize],
) -> Vec<Direction> {
    let Spectrum { values, vectors } = spectrum;
    let least = spectrum.floor();
    let mut order: Vec<usize> = (0..values.len()).filter(|k| values[*k] < 1.0).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let direction = |k: usize| {
        let column: Vec<f64> = vectors.iter().map(|row| row[k]).collect();
        let members = members(&column, free);
        let together: Vec<usize> = members.iter().map(|member| member.parameter).collect();
        Direction {
            members,
            deviation: 1.0 / values[k].max(least),
            remedy: problem.remedy(&together),
        }
    };
    order.into_iter().map(direction).collect()
}

fn members(column: &[f64], free: &[usize]) -> Vec<Member> {
    let largest = column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut members: Vec<Member> = column
        .iter()
        .zip(free)
        .filter(|(share, _)| share.abs() >= NEGLIGIBLE * largest)
        .map(|(&share, &parameter)| Member { parameter, share })
        .collect();
    members.sort_by(|a, b| b.share.abs().total_cmp(&a.share.abs()));
    // The first one counts as moving up.
    if members.first().is_some_and(|first| first.share < 0.0) {
        for member in &mut members {
            member.share = -member.share;
        }
    }
    members
}
