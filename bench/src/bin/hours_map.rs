//! Hours of touches on a map of 32 x 32 sensels: the figures of every hour beside those of
//! the first. Sensels have a noise of 1.2 counts, as it is or with zeros below 3 counts as the
//! programs of the makers write them; three always read 5 more. A fingertip comes every 2 to
//! 30 s, slides by up to 5 mm, and stays for 1 to 5 s. Ends with 1 when a touch is not exactly
//! one contact at its place, or an event is neither its begin nor its end.
//!
//!     cargo run --release --bin hours_map [HOURS]

use std::process::ExitCode;

use taxel::acquisition::{Frame, Quantity, SignalUnit, Stream};
use taxel::estimation::{MapNoise, MapOptions, TouchEventKind, TouchSession};
use taxel_numerics::Noise;

/// Sensels of a side, their pitch, m, and frames per second.
const SIDE: usize = 32;
const PITCH: f64 = 1.27e-3;
const RATE: f64 = 20.0;
/// Pressure of a count, Pa.
const COUNT: f64 = 1e3;
/// Noise of a sensel, and the least that is not written as zero, counts.
const NOISE: f64 = 1.2;
const SUPPRESSED: f64 = 3.0;
/// Sensels that read this many counts more.
const STUCK: [usize; 3] = [77, 500, 901];
const STUCK_COUNTS: f64 = 5.0;
/// The converter has eight bits.
const MOST_COUNTS: f64 = 255.0;
/// Radius of a fingertip, m.
const RADIUS: f64 = 5e-3;
/// Frames at the start without a touch, and frames from which the noise is known: those of
/// ten minutes, as a recording has them.
const QUIET: usize = 200;
const KNOWN: usize = (600.0 * RATE) as usize;

/// A fingertip on the map: frames from which and to which it is there, where it comes down,
/// by how much it has moved at the end, m, and counts in its middle.
struct Fingertip {
    frames: [usize; 2],
    at: [f64; 2],
    moved: [f64; 2],
    most: f64,
}

impl Fingertip {
    fn after(end: usize, random: &mut Noise) -> Self {
        let mut between = |low: f64, high: f64| {
            let share = 0.5 * libm::erfc(-random.normal() / std::f64::consts::SQRT_2);
            low + (high - low) * share
        };
        let start = end + (RATE * between(2.0, 30.0)) as usize;
        let length = SIDE as f64 * PITCH;
        Self {
            frames: [start, start + (RATE * between(1.0, 5.0)) as usize],
            at: [(); 2].map(|()| between(2.5 * RADIUS, length - 2.5 * RADIUS)),
            moved: [(); 2].map(|()| between(-5e-3, 5e-3)),
            most: between(20.0, 200.0),
        }
    }

    fn place(&self, frame: usize) -> Option<[f64; 2]> {
        let [start, end] = self.frames;
        let share = frame.checked_sub(start)? as f64 / (end - start) as f64;
        (frame < end).then(|| std::array::from_fn(|axis| self.at[axis] + share * self.moved[axis]))
    }

    fn counts(&self, frame: usize, sensel: usize) -> f64 {
        let Some(place) = self.place(frame) else {
            return 0.0;
        };
        let middle = |index: usize| (index as f64 + 0.5) * PITCH;
        let [x, y] = [
            middle(sensel % SIDE) - place[0],
            middle(sensel / SIDE) - place[1],
        ];
        self.most * (1.0 - (x * x + y * y) / (RADIUS * RADIUS)).max(0.0)
    }
}

/// What an hour showed.
#[derive(Default)]
struct Hour {
    touches: usize,
    found: usize,
    wrong_frames: usize,
    events: [usize; 3],
    /// Largest distance of a contact from its fingertip, m.
    off: f64,
}

fn main() -> ExitCode {
    let hours: f64 = std::env::args()
        .nth(1)
        .map_or(8.0, |text| text.parse().expect("a number of hours"));
    println!(
        "{:10} {:>4} {:>8} {:>6} {:>7} {:>6} {:>8} {:>6} {:>7} {:>6}",
        "noise", "hour", "touches", "found", "false", "touch", "release", "other", "off mm", "MB"
    );
    let wrong = [false, true].map(|suppresses| run(hours, suppresses));
    ExitCode::from(u8::from(wrong.contains(&true)))
}

/// Plays a map whose program writes zeros in the place of noise, or not. True if something
/// was wrong.
fn run(hours: f64, suppresses: bool) -> bool {
    let stream = Stream {
        name: "map".into(),
        rows: SIDE,
        columns: SIDE,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Pressure,
            symbol: "kPa".into(),
            si_per_unit: 1e3,
        },
        pitch: Some([PITCH; 2]),
        period: Some(1.0 / RATE),
        threshold: None,
        present: vec![true; SIDE * SIDE],
    };
    let mut random = Noise::seeded(7);
    let mut script = Noise::seeded(11);
    let mut read = |at: usize, fingertip: &Fingertip| Frame {
        sequence: at as u64,
        time_ns: (at as f64 / RATE * 1e9) as u64,
        values: (0..SIDE * SIDE)
            .map(|sensel| {
                let rest = NOISE * random.normal();
                let stuck = f64::from(u8::from(STUCK.contains(&sensel))) * STUCK_COUNTS;
                let counts = (rest + stuck + fingertip.counts(at, sensel)).round();
                let zero = suppresses && counts < SUPPRESSED;
                COUNT * if zero { 0.0 } else { counts.min(MOST_COUNTS) }
            })
            .collect(),
        ..Frame::default()
    };
    let mut noise = MapNoise::default();
    let mut fingertip = Fingertip::after(QUIET, &mut script);
    for at in 0..KNOWN {
        noise.push(&read(at, &fingertip));
        if at > fingertip.frames[1] {
            fingertip = Fingertip::after(at, &mut script);
        }
    }
    let options = MapOptions {
        noise,
        all_events: false,
        ..MapOptions::default()
    };
    let mut session = TouchSession::map(&stream, &options);
    let mut fingertip = Fingertip::after(QUIET, &mut script);
    let mut wrong = false;
    let mut at = 0;
    let name = if suppresses { "suppressed" } else { "as it is" };
    for number in 1..=hours.ceil() as usize {
        let mut hour = Hour::default();
        let end = (3600.0 * RATE * hours.min(number as f64)) as usize;
        while at < end {
            hour.take(&mut session, &read(at, &fingertip), at, &fingertip);
            at += 1;
            // A second is left for the release.
            if at > fingertip.frames[1] + RATE as usize {
                fingertip = Fingertip::after(at, &mut script);
            }
        }
        let Hour { touches, found, .. } = hour;
        println!(
            "{name:10} {number:>4} {touches:>8} {found:>6} {:>7} {:>6} {:>8} {:>6} {:>7.2} {:>6.1}",
            hour.wrong_frames,
            hour.events[0],
            hour.events[1],
            hour.events[2],
            1e3 * hour.off,
            memory()
        );
        wrong |= found != touches || hour.wrong_frames > 0 || hour.events[2] > 0;
    }
    wrong
}

impl Hour {
    fn take(&mut self, session: &mut TouchSession, frame: &Frame, at: usize, tip: &Fingertip) {
        let observed = session.push(frame).expect("a frame of the map");
        for event in observed.events {
            match event.kind {
                TouchEventKind::Touch => self.events[0] += 1,
                TouchEventKind::Release => self.events[1] += 1,
                _ => self.events[2] += 1,
            }
        }
        let contacts = &observed.touch.contacts;
        let Some(place) = tip.place(at) else {
            self.wrong_frames += usize::from(!contacts.is_empty());
            return;
        };
        if at != usize::midpoint(tip.frames[0], tip.frames[1]) {
            return;
        }
        self.touches += 1;
        if let [contact] = &contacts[..] {
            let half = 0.5 * SIDE as f64 * PITCH;
            let [x, y] = contact.centre;
            let [x, y] = [x + half - place[0], half - y - place[1]];
            self.off = self.off.max(x.hypot(y));
            self.found += usize::from(x.hypot(y) < PITCH);
        }
    }
}

/// Resident memory of this process, MB; NaN where the system does not say.
fn memory() -> f64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let resident = pages.and_then(|text| text.split(' ').nth(1)?.parse::<f64>().ok());
    resident.map_or(f64::NAN, |pages| pages * 4096e-6)
}
