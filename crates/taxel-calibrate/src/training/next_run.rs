//! How far the next run lies from the runs that trained a map.

use taxel_numerics::least_squares::student_quantile;

use super::NORMAL_95;

/// Knowledge before any run is held out: deviation of the gain of one run from that of another,
/// and of the offset over the largest force. The public recordings of a printed lattice, one run
/// under the best maps of the other, have gains of 0.1 to 1.3 % and offsets of 0 to 0.25 N of 32 N.
pub(super) const USUAL: [f64; 2] = [0.01, 0.003];
/// Degrees of freedom that this knowledge counts for.
const USUAL_DEGREES: usize = 2;

/// Variance of a run about the mean of so many others, over that of runs about their mean.
pub(super) fn of_mean(runs: usize) -> f64 {
    1.0 + 1.0 / runs.max(1) as f64
}

/// Share of the distance of a held-out run from the mean of the others that it has from the mean of all.
pub(super) fn share(runs: usize) -> f64 {
    (runs - 1) as f64 / runs as f64
}

/// Deviation of the next run from the map of so many `trained` runs, with Student's factor in it.
///
/// `usual` is the variance of one run from another that is expected, `squares` the sum of the squares by
/// which so many `held_out` runs lie from their mean, less what noise gives them: R − 1 degrees of
/// freedom beside [`USUAL_DEGREES`].
pub(super) fn deviation(usual: f64, squares: f64, held_out: usize, trained: usize) -> f64 {
    let degrees = USUAL_DEGREES + held_out - 1;
    let student = student_quantile(0.975, degrees as f64) / NORMAL_95;
    let usual = USUAL_DEGREES as f64 * usual / of_mean(1);
    let variance = (usual + squares.max(0.0)) / degrees as f64;
    student * (of_mean(trained) * variance).sqrt()
}
