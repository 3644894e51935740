//! `taxel recording compare`: where touch is no longer the recorded one.

use std::path::Path;
use std::sync::mpsc;
use taxel::shown;

use taxel_recording::mcap::{Message, Topic, TouchMessage};
use taxel_serve::{RecordTo, Recorded, run_headless};

use super::{Compare, known, played, reader, unreadable};
use crate::commands::live;
use crate::{Done, Stop, outputs};

/// Frames that may wait between the estimator and the comparison.
const WAITING: usize = 256;

/// Touch of the frames of a file, one after the other.
struct Touches {
    reader: super::Reader,
}

impl Touches {
    /// The bytes of the next one.
    fn next(&mut self, path: &Path) -> Result<Option<Vec<u8>>, Stop> {
        loop {
            let entry = self
                .reader
                .next()
                .map_err(|error| unreadable(path, &error))?;
            match entry {
                Some(entry) if entry.topic == Topic::Touch => {
                    return Ok(Some(entry.bytes.to_vec()));
                }
                Some(_) => {}
                None => return Ok(None),
            }
        }
    }
}

pub(super) fn run(arguments: &Compare) -> Result<Done, Stop> {
    let file = arguments.file.as_path();
    let mut touches = Touches {
        reader: reader(file)?,
    };
    let (name, outcome) = if let Some(other) = &arguments.other {
        let mut others = Touches {
            reader: reader(other)?,
        };
        let outcome = compared(&mut touches, file, &mut || others.next(other))?;
        known(other, others.reader.findings())?;
        (shown::path(other), outcome)
    } else {
        ("this program".into(), played_again(&mut touches, file)?)
    };
    known(file, touches.reader.findings())?;
    let (text, done) = match outcome {
        Outcome::Same(frames) => (format!("same touch in {frames} frames\n"), Done::Complete),
        Outcome::Parted { frames, at } => (
            format!("same touch in {frames} frames, then:\n  {at}\n"),
            Done::WithLosses,
        ),
    };
    outputs::print(&format!("{} and {name}: {text}", shown::path(file)))?;
    Ok(done)
}

/// Compares with the touch that this program estimates from the frames of the file.
fn played_again(touches: &mut Touches, file: &Path) -> Result<Outcome, Stop> {
    let live = played(file)?;
    let (sender, receiver) = mpsc::sync_channel(WAITING);
    let mut session = live::session(&live, live::options(&live)?)?;
    session.options.record = Some(RecordTo::Messages(sender));
    let running = std::thread::spawn(move || run_headless(session));
    let outcome = compared(touches, file, &mut || {
        Ok(receiver.iter().find_map(|message| match message {
            Recorded::Touch(touch) => Some(bytes_of(&touch)),
            _ => None,
        }))
    })?;
    drop(receiver);
    if let Ok(Ok(summary)) = running.join()
        && let Some(failure) = summary.failure
    {
        note!("note: {failure}");
    }
    Ok(outcome)
}

enum Outcome {
    Same(u64),
    Parted { frames: u64, at: String },
}

fn compared(
    touches: &mut Touches,
    file: &Path,
    other: &mut dyn FnMut() -> Result<Option<Vec<u8>>, Stop>,
) -> Result<Outcome, Stop> {
    let mut frames = 0;
    loop {
        let at = match (touches.next(file)?, other()?) {
            (None, None) => return Ok(Outcome::Same(frames)),
            (Some(one), Some(two)) if one == two => {
                frames += 1;
                continue;
            }
            (Some(one), Some(two)) => difference(&one, &two),
            (Some(one), None) => format!("{} is not in the other", frame(&one)),
            (None, Some(two)) => format!("{} is in the other alone", frame(&two)),
        };
        return Ok(Outcome::Parted { frames, at });
    }
}

fn bytes_of(touch: &TouchMessage) -> Vec<u8> {
    let mut bytes = Vec::new();
    touch.encode(&mut bytes);
    bytes
}

fn frame(bytes: &[u8]) -> String {
    TouchMessage::decode(bytes).map_or("a frame that cannot be read".into(), |touch| {
        let seconds = touch.device_time_ns as f64 * 1e-9;
        format!("frame {} at {seconds:.6} s", touch.sequence)
    })
}

/// The first field that is not the same.
fn difference(one: &[u8], two: &[u8]) -> String {
    let (Some(a), Some(b)) = (TouchMessage::decode(one), TouchMessage::decode(two)) else {
        return "a touch that cannot be read".into();
    };
    if a.sequence != b.sequence {
        return format!("{} stands where the other has {}", frame(one), frame(two));
    }
    let lists = [
        ("value", &a.values, &b.values),
        ("deviation", &a.deviations, &b.deviations),
        ("residual", &a.residuals, &b.residuals),
    ];
    let in_lists = lists.iter().find_map(|(name, a, b)| {
        let mut pairs = a.iter().zip(*b).enumerate();
        let (at, (x, y)) = pairs.find(|(_, (x, y))| x.to_bits() != y.to_bits())?;
        Some(format!("{name} {at} is {x:e} and {y:e} (SI)"))
    });
    let states = || {
        let mut pairs = a.states.iter().zip(&b.states).enumerate();
        let (at, (x, y)) = pairs.find(|(_, (x, y))| x != y)?;
        Some(format!("the state of taxel {at} is {x} and {y}"))
    };
    let contacts = || {
        (a.contacts != b.contacts).then(|| {
            let (x, y) = (a.contacts.len(), b.contacts.len());
            format!("contacts are not the same ({x} and {y} of them)")
        })
    };
    let what = in_lists.or_else(states).or_else(contacts);
    let what = what.unwrap_or_else(|| "totals or counts are not the same".into());
    format!("{}: {what}", frame(one))
}
