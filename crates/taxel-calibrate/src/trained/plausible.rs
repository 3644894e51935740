//! What recordings say that cannot be meant.

use super::readings::Run;
use taxel::InputError;

/// A force this many times the full scale is in another unit, or the full scale is.
const FAR: f64 = 20.0;
/// A scale whose lowest reading is this many times as far from nothing as its highest has the other
/// sign: what sticks pulls less than it was pressed.
const PULLS: f64 = 2.0;

/// Refuses forces of another sign or unit, and runs that are given twice; `full_scale` in N.
pub(super) fn check(runs: &[Run], full_scale: f64) -> Result<(), InputError> {
    for (number, run) in runs.iter().enumerate() {
        let wrong = |message: String, key: &str, help: &str| {
            Err(InputError::whole(&run.name, message).key(key).help(help))
        };
        if let Some(force) = &run.session.force {
            let readings = force.rows().iter().map(|row| row[0]);
            let [low, high] = readings.fold([0.0_f64; 2], |[low, high], force| {
                [low.min(force), high.max(force)]
            });
            if -low > PULLS * high {
                return wrong(
                    format!(
                        "the force goes from {low:.3} N to {high:.3} N, and pressing is positive"
                    ),
                    "force_z",
                    "change the sign of the column",
                );
            }
            if high > FAR * full_scale {
                return wrong(
                    format!("the largest force is {high:.3} N, of a full scale of {full_scale} N"),
                    "force_z",
                    "correct the unit of the column, or element.trained.full_scale",
                );
            }
        }
        let same = |other: &&Run| other.session.sensor.rows() == run.session.sensor.rows();
        if let Some(other) = runs[..number].iter().find(same) {
            return wrong(
                format!("it has the same readings as {}", other.name),
                "time",
                "give each run once: two of them say how runs differ",
            );
        }
    }
    Ok(())
}
