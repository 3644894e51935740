//! The zero of the last run of a sensor: whether something pressed by it while a new one was taken.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use taxel::acquisition::Frame;
use taxel::estimation::{Rest, TouchSession};
use taxel::shown;

use crate::tare::unix_s;

/// Keeps the zero of a sensor from one run to the next, in a file.
pub struct LastZero {
    path: PathBuf,
    past: Option<Past>,
}

/// The estimates of the capture by the zero of the last run.
struct Past {
    session: TouchSession,
    /// Time since that zero, s.
    age: f64,
}

/// What the file has.
#[derive(Serialize, Deserialize)]
struct Kept {
    unix_s: f64,
    /// Reading of each channel at rest, SI; none where it is not known.
    values: Vec<Option<f64>>,
    captured: Vec<Option<[f64; 2]>>,
    at_end: Vec<bool>,
}

/// What the zero of the last run says of a new one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Nothing pressed.
    Alike(String),
    /// Something did, or the readings have moved since.
    Doubted(String),
}

impl LastZero {
    /// The zero that `path` has, for a sensor that `session` estimates; a file that is missing or of other
    /// channels is none.
    pub fn new(path: PathBuf, mut session: TouchSession) -> Self {
        let kept = std::fs::read(&path).ok();
        let kept = kept.and_then(|bytes| serde_json::from_slice::<Kept>(&bytes).ok());
        let channels = session.estimator().channels().len();
        let past = kept
            .filter(|kept| kept.values.len() == channels)
            .and_then(|kept| {
                let values = kept.values.iter().map(|value| value.unwrap_or(f64::NAN));
                let rest = Rest::of_parts(values.collect(), kept.captured, kept.at_end)?;
                session.restore_rest(&rest);
                let age = (unix_s() - kept.unix_s).max(0.0);
                Some(Past { session, age })
            });
        Self { path, past }
    }

    /// Takes a frame of the first rest capture. It comes so long after the zero as the sensor may have
    /// drifted.
    pub(crate) fn push(&mut self, frame: &Frame) {
        if let Some(past) = &mut self.past {
            let age = std::time::Duration::from_secs_f64(past.age.min(LONGEST));
            let later = Frame {
                time_ns: frame.time_ns.saturating_add(age.as_nanos() as u64),
                ..frame.clone()
            };
            // A frame of another device ends the run where it is estimated.
            let _ = past.session.push(&later);
        }
    }

    /// What the frames of the first capture say; `None` without an earlier zero, and after the first.
    pub(crate) fn verdict(&mut self) -> Option<Verdict> {
        let Past { session, age } = self.past.take()?;
        let ago = ago(age);
        let Some(pressed) = session.pressed() else {
            return Some(Verdict::Alike(format!(
                "nothing touches by the zero of {ago} before, either"
            )));
        };
        let pressed = pressed.place();
        Some(Verdict::Doubted(format!(
            "by the zero of {ago} before, something pressed at {pressed} while this one was taken: take it off and tare; \
             if nothing did, the sensor has drifted since: tare all the same, and this zero counts"
        )))
    }

    /// Keeps a zero for the next run; an error in words.
    pub(crate) fn keep(&self, rest: &Rest) -> Result<(), String> {
        let finite = |value: &f64| value.is_finite().then_some(*value);
        let kept = Kept {
            unix_s: unix_s(),
            values: rest.values().iter().map(finite).collect(),
            captured: rest.captured().to_vec(),
            at_end: rest.at_end().to_vec(),
        };
        let write = || {
            if let Some(folder) = self.path.parent() {
                std::fs::create_dir_all(folder)?;
            }
            // Whole or not at all: another run may read it.
            let new = self
                .path
                .with_extension(format!("{}.new", std::process::id()));
            std::fs::write(&new, serde_json::to_vec(&kept)?)?;
            std::fs::rename(&new, &self.path)
        };
        write().map_err(|error: std::io::Error| {
            format!(
                "the zero cannot be kept for the next run in {}: {error}",
                shown::path(&self.path)
            )
        })
    }
}

/// A year, s: longer ago says no more.
const LONGEST: f64 = 365.0 * 86_400.0;

/// A time in words.
fn ago(seconds: f64) -> String {
    let [minutes, hours, days] = [60.0, 3600.0, 86_400.0].map(|unit| seconds / unit);
    match seconds {
        _ if minutes < 1.0 => format!("{seconds:.0} s"),
        _ if hours < 1.0 => format!("{minutes:.0} min"),
        _ if days < 1.0 => format!("{hours:.0} h"),
        _ => format!("{days:.0} days"),
    }
}

#[cfg(test)]
mod tests {
    use taxel::acquisition::{Delivery, Stimulus, Twin};
    use taxel::sensor::Sensor;

    use super::*;

    /// What is said of a capture under so much force, N, and the zero that it gave.
    fn captured(path: &std::path::Path, force: f64) -> (Option<Verdict>, LastZero, Rest) {
        let sensor = Sensor::shipped("force-4x4").unwrap();
        let held = |time: f64| {
            format!("{{ time = \"{time} s\", force = [\"0 N\", \"0 N\", \"{force} N\"] }}")
        };
        let script = format!(
            "schema = 1\nname = \"held\"\nduration = \"9 s\"\n[[probe]]\ntaxel = [1, 2]\npath = [{}, {}]\n",
            held(0.0),
            held(9.0)
        );
        let stimulus = Stimulus::parse("held", &script).unwrap();
        let mut twin = Twin::new(&sensor, &stimulus, 1).unwrap();
        let device = sensor.device().unwrap();
        let mut session = device.session(&twin.stream()).unwrap();
        let again = device.session(&twin.stream()).unwrap();
        let mut last_zero = LastZero::new(path.to_owned(), again);
        session.begin_rest_capture(50);
        while session.capturing() {
            if let Delivery::Frame(frame) = twin.next_delivery() {
                session.push(&frame).unwrap();
                last_zero.push(&frame);
            }
        }
        (last_zero.verdict(), last_zero, session.rest())
    }

    #[test]
    fn a_load_that_rests_throughout_is_seen_by_the_zero_of_the_last_run() {
        let folder = std::env::temp_dir().join(format!("last_zero-{}", std::process::id()));
        let path = folder.join("zeros/one.json");
        let (verdict, last_zero, rest) = captured(&path, 0.0);
        assert_eq!(verdict, None);
        last_zero.keep(&rest).unwrap();
        let (verdict, ..) = captured(&path, 0.0);
        assert!(matches!(verdict, Some(Verdict::Alike(_))), "{verdict:?}");
        let (verdict, ..) = captured(&path, 2.0);
        let Some(Verdict::Doubted(words)) = verdict else {
            panic!("{verdict:?}")
        };
        assert!(words.contains("row 1, column 2 with"), "{words}");
        // What is no such file is none.
        std::fs::write(&path, "{}").unwrap();
        assert_eq!(captured(&path, 2.0).0, None);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
