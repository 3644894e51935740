//! Intervals of totals and of events, devices by loads by faults: 95 % of them hold the truth.
//!
//! What fabrication scatters is drawn for each piece, as the noise is.
//!
//! The whole table: `cargo test --release -p taxel --test all coverage -- --ignored --nocapture`; of one
//! device: `coverage::whole::piezo` and so on in the place of `coverage`.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use taxel::acquisition::{Delivery, Frame, Stimulus, Twin};
use taxel::estimation::{Certainty, Contact, Touch, TouchEvent, TouchSession};
use taxel::sensor::{Element, Sensor};

/// Frames of the rest capture, as in the paper.
const REST_FRAMES: usize = 50;

struct Device {
    sensor: &'static str,
    taxel: [usize; 2],
    /// Loads on that taxel, in the unit.
    loads: [f64; 3],
    unit: &'static str,
    /// A channel of that taxel, and how it may fail so that it shows: a reading at its end looks like
    /// an overload where nothing contradicts it.
    channel: usize,
    faults: &'static [Fault],
    /// Pieces of the long and of the short table. Elements that give charge are read a thousand times
    /// a second.
    pieces: [u64; 2],
    /// A finger that slides over the array: radius and half of the way, mm, force in the unit, and
    /// speed, mm/s. None for an array of one taxel and where layers cross: a finger over two rows and
    /// two columns has no certain position. Speeds along the rows of elements that give charge
    /// are those of `p3_slip::ninety_five_per_cent_intervals_hold_the_speed_of_two_hundred_ridges`.
    slide: Option<[f64; 4]>,
}

const DEVICES: [Device; 6] = [
    Device {
        sensor: "three-axis-8x8",
        taxel: [4, 4],
        loads: [2.0, 8.0, 15.0],
        unit: "mN",
        channel: 4 * 36 + 2,
        faults: &[Fault::Dead, Fault::Stuck, Fault::Saturated],
        pieces: PIECES,
        slide: Some([4.0, 4.0, 90.0, 16.0]),
    },
    Device {
        sensor: "in-plane-50um",
        taxel: [0, 0],
        loads: [1.0, 4.0, 8.0],
        unit: "N",
        channel: 0,
        faults: &SHOWN,
        pieces: PIECES,
        slide: None,
    },
    Device {
        sensor: "force-4x4",
        taxel: [1, 2],
        loads: [0.5, 2.0, 5.0],
        unit: "N",
        channel: 3 * 6 + 2,
        faults: &SHOWN,
        pieces: PIECES,
        slide: Some([6.0, 5.0, 8.0, 20.0]),
    },
    Device {
        sensor: "resistive-mat-8x8",
        taxel: [3, 3],
        loads: [1.0, 3.0, 5.0],
        unit: "N",
        channel: 27,
        faults: &SHOWN,
        pieces: PIECES,
        slide: Some([16.0, 20.0, 20.0, 80.0]),
    },
    Device {
        sensor: "liquid-metal-2x4",
        taxel: [0, 1],
        loads: [2.0, 3.5, 5.0],
        unit: "mN",
        channel: 3,
        faults: &SHOWN,
        pieces: PIECES,
        slide: None,
    },
    Device {
        sensor: "piezo-2.3mm",
        taxel: [0, 1],
        loads: [50.0, 150.0, 300.0],
        unit: "mN",
        channel: 1,
        faults: &SHOWN,
        pieces: [100, 0],
        slide: None,
    },
];

/// What a channel reads that fails as the load is on.
#[derive(Debug, Clone, Copy)]
enum Fault {
    /// Nothing.
    Dead,
    /// What it read at rest.
    Stuck,
    /// The end of what can be read.
    Saturated,
}

/// Of the long table the share of a row is known to 0.7 % then.
const PIECES: [u64; 2] = [1000, 12];
const SHOWN: [Fault; 2] = [Fault::Dead, Fault::Stuck];

/// A load is held so long, s, in one row.
const HELD: usize = 5;

/// The rest is captured before, s.
const BEGIN: f64 = 1.5;
/// A channel fails then, s, and is known to be stuck after [`NOTICED`].
const FAILS: f64 = BEGIN + 0.3;
const NOTICED: f64 = 1.2;

impl Device {
    fn newtons(&self) -> f64 {
        if self.unit == "mN" { 1e-3 } else { 1.0 }
    }

    /// The piece of fabrication of this seed under a script of this text.
    fn piece(&self, script: &str, seed: u64) -> (Twin, TouchSession) {
        let text = Sensor::shipped_text(self.sensor).unwrap();
        let text: String = text
            .lines()
            .map(|line| {
                if line.starts_with("seed = ") {
                    format!("seed = {seed}\n")
                } else {
                    format!("{line}\n")
                }
            })
            .collect();
        let sensor = Sensor::parse("piece.toml", &text).unwrap();
        let stimulus = Stimulus::parse("script", script).unwrap();
        let twin = match &sensor.element {
            Element::Cells(_) => {
                let piece = sensor.cells().unwrap().piece(seed);
                Twin::of_piece(piece, &sensor, &stimulus, seed).unwrap()
            }
            _ => Twin::new(&sensor, &stimulus, seed).unwrap(),
        };
        let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
        session.begin_rest_capture(REST_FRAMES);
        (twin, session)
    }

    /// A probe on the taxel whose force passes through these points: time after the beginning, s,
    /// and force in the unit.
    fn pressed(
        &self,
        points: impl IntoIterator<Item = [f64; 2]>,
        seed: u64,
    ) -> (Twin, TouchSession) {
        let (mut path, mut last) = (String::new(), 0.0);
        for [after, force] in points {
            last = BEGIN + after;
            let unit = self.unit;
            writeln!(
                path,
                "{{ time = \"{last} s\", force = [\"0 {unit}\", \"0 {unit}\", \"{force:.6} {unit}\"] }},"
            )
            .unwrap();
        }
        let script = format!(
            "schema = 1\nname = \"probe\"\nduration = \"{} s\"\n[[probe]]\ntaxel = {:?}\npath = [\n{path}]\n",
            last + 2.0,
            self.taxel
        );
        self.piece(&script, seed)
    }

    /// The load holds each of `levels` for 0.9 s, with ramps of 0.1 s between them.
    fn held(&self, levels: &[f64], seed: u64) -> (Twin, TouchSession) {
        let mut last = 0.0;
        let points = levels.iter().enumerate().flat_map(|(number, level)| {
            let before = std::mem::replace(&mut last, *level);
            [(0.0, before), (0.1, *level), (0.99, *level)]
                .map(|(time, force)| [number as f64 + time, force])
        });
        self.pressed(points.collect::<Vec<_>>(), seed)
    }

    /// The pressing force that is stated of all that presses, with how much it says: the total, or
    /// where the device has none the one contact.
    fn stated(&self, touch: &Touch) -> Option<([f64; 2], Certainty)> {
        let of_total = [touch.total.force[2], touch.total_deviation()[2]];
        if !self.sensor.starts_with("piezo") {
            return Some((of_total, touch.total_certainty));
        }
        let of = |contact: &Contact| [contact.force[2], contact.force_covariance[2][2].sqrt()];
        let [contact] = &touch.contacts[..] else {
            return None;
        };
        Some((of(contact), contact.certainty))
    }
}

/// Frames and the true pressing force, N, until a time, s.
fn frames(twin: &mut Twin, until: f64, mut take: impl FnMut(Frame, f64, f64)) {
    loop {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        let time = frame.time_ns as f64 * 1e-9;
        if time > until {
            return;
        }
        let forces = twin.true_forces(frame.time_ns);
        let truth: f64 = forces.iter().map(|force| force[2]).sum();
        take(frame, time, truth);
    }
}

/// How many hold the truth, and how many there are.
type Count = [usize; 2];

fn count(counts: &mut Count, holds: bool) {
    *counts = [counts[0] + usize::from(holds), counts[1] + 1];
}

/// Exact totals of `pieces` pieces under a load, each at the end of 0.3 s of the last of `levels`, which
/// last 1 s each.
fn totals(device: &Device, levels: &[f64], pieces: u64) -> Count {
    let mut counts = [0; 2];
    for seed in 1..=pieces {
        let (mut twin, mut session) = device.held(levels, seed);
        let mut last = f64::NAN;
        let until = FAILS + (levels.len() - 1) as f64;
        frames(&mut twin, until, |frame, _, truth| {
            session.push(&frame).unwrap();
            last = truth;
        });
        let stated = device.stated(session.estimator().touch());
        if let Some(([force, deviation], Certainty::Exact)) = stated {
            count(&mut counts, (force - last).abs() <= 1.96 * deviation);
        }
    }
    counts
}

/// Totals of `pieces` pieces one of whose channels fails under a load: exact ones, and bounds.
fn failing(device: &Device, fault: Fault, pieces: u64) -> [Count; 2] {
    let mut counts = [[0; 2]; 2];
    let load = device.loads[1];
    for seed in 1..=pieces {
        let (mut twin, mut session) = device.held(&[load, load, load], seed);
        let [low, high] = session.estimator().channels()[device.channel].span;
        let (mut rest, mut last) = (None, f64::NAN);
        let until = FAILS + NOTICED;
        frames(&mut twin, until, |mut frame, time, truth| {
            let reading = &mut frame.values[device.channel];
            let rest = *rest.get_or_insert(*reading);
            if time > FAILS {
                *reading = match fault {
                    Fault::Dead if low.is_finite() => low.min(0.0),
                    Fault::Dead => f64::NAN,
                    Fault::Stuck => rest,
                    Fault::Saturated => high,
                };
            }
            session.push(&frame).unwrap();
            last = truth;
        });
        match device.stated(session.estimator().touch()) {
            Some(([force, deviation], Certainty::Exact)) => {
                count(&mut counts[0], (force - last).abs() <= 1.96 * deviation);
            }
            Some(([force, deviation], Certainty::AtLeast)) => {
                count(&mut counts[1], force - last <= 1.96 * deviation.max(0.0));
            }
            _ => {}
        }
    }
    counts
}

/// Events of one kind of `pieces` pieces; `run` gives a piece by its seed, and `truth` the true
/// value of an event at a time after the beginning, s.
fn events(
    kind: &str,
    pieces: u64,
    until: f64,
    run: impl Fn(u64) -> (Twin, TouchSession),
    truth: impl Fn(u64, f64) -> f64,
) -> Count {
    let mut counts = [0; 2];
    for seed in 1..=pieces {
        let (mut twin, mut session) = run(seed);
        frames(&mut twin, BEGIN + until, |frame, time, _| {
            let observed = session.push(&frame).unwrap().events;
            let of_kind = |event: &&TouchEvent| event.kind.name() == kind;
            for event in observed.iter().filter(of_kind) {
                let off = event.value - truth(seed, time - BEGIN);
                count(&mut counts, off.abs() <= 1.96 * event.deviation);
            }
        });
    }
    counts
}

/// Steps from one held load to another.
fn steps(device: &Device, pieces: u64, each: usize) -> Count {
    let [low, middle, high] = device.loads;
    let cycle = [low, high, middle, high, low, middle];
    let levels: Vec<f64> = (0..each).map(|step| cycle[step % cycle.len()]).collect();
    let truth = |_, after: f64| {
        let now = after as usize;
        let before = now.checked_sub(1).map_or(0.0, |before| levels[before]);
        device.newtons() * (levels[now] - before)
    };
    let run = |seed| device.held(&levels, seed);
    events("step", pieces, each as f64, run, truth)
}

/// Forces that come and go within [`PULSE`].
fn impacts(device: &Device, pieces: u64, each: usize) -> Count {
    let peak = |number: usize| device.loads[number % 3];
    // Not in step with the frames, nor alike in time: equal periods are a cyclic load.
    let begin = |seed: u64, number: usize| {
        let share = (seed as f64 + number as f64 * 0.618).fract();
        1.5 * number as f64 + 0.37 * share
    };
    let pulse = |seed: u64, number: usize| {
        (0..=240).map(move |point| {
            let share = f64::from(point) / 240.0;
            let height = (std::f64::consts::PI * share).sin().powi(2);
            [begin(seed, number) + PULSE * share, peak(number) * height]
        })
    };
    let run = |seed| device.pressed((0..each).flat_map(|number| pulse(seed, number)), seed);
    let truth = |seed, after: f64| {
        let mut begun = (0..each).filter(|number| begin(seed, *number) < after);
        device.newtons() * begun.next_back().map_or(0.0, peak)
    };
    events("impact", pieces, 1.5 * each as f64 + 2.0, run, truth)
}

/// A force that comes and goes so fast, s, is an impact.
const PULSE: f64 = 0.24;

/// Slips of a finger to and fro, with a stop of 0.7 s after each.
fn slips(device: &Device, pieces: u64, each: usize) -> Count {
    let Some([radius, half, force, speed]) = device.slide else {
        return [0; 2];
    };
    let run = |seed: u64| {
        let (mut path, mut time, unit) = (String::new(), BEGIN, device.unit);
        let mut point = |time: f64, x: f64, force: f64| {
            writeln!(
                path,
                "{{ time = \"{time} s\", at = [\"{x} mm\", \"{} mm\"], \
                 force = [\"0 {unit}\", \"0 {unit}\", \"{force} {unit}\"] }},",
                // Anywhere across the rows.
                0.5 * (seed as f64 * 0.618).fract()
            )
            .unwrap();
        };
        let mut x = -half;
        point(time, x, 0.0);
        for _ in 0..each {
            time += 0.7 + 0.1 * (seed as f64 * 0.618).fract();
            point(time, x, force);
            (time, x) = (time + 2.0 * half / speed, -x);
            point(time, x, force);
        }
        let script = format!(
            "schema = 1\nname = \"slide\"\nduration = \"{} s\"\n[[finger]]\nradius = \"{radius} mm\"\npath = [\n{path}]\n",
            time + 1.0
        );
        device.piece(&script, seed)
    };
    let until = each as f64 * (0.8 + 2.0 * half / speed);
    events("slip", pieces, until, run, |_, _| 1e-3 * speed)
}

/// The long or the short table, with three events a piece, and the rows whose share is not within the
/// bounds of 93 to 97 % and `slack`; a bound may hold always. So may a slip: the error of a position by
/// the grid is bounded, and 1.96 of its deviations are beyond all of it.
fn table(devices: &[Device], length: usize, slack: f64) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut row = |what: String, most: f64, [held, all]: Count| {
        if all == 0 {
            return;
        }
        let share = held as f64 / all as f64;
        println!("{what:<52} {share:.3} of {all}");
        if !(0.93 - slack..=most + slack).contains(&share) {
            wrong.push(format!("{what}: {share:.3} of {all}"));
        }
    };
    for device in devices {
        let (sensor, pieces) = (device.sensor, device.pieces[length]);
        for load in device.loads {
            let what = format!("{sensor}, {load} {}, total", device.unit);
            row(what, 0.97, totals(device, &[load], pieces));
        }
        let held = totals(device, &[device.loads[1]; HELD], pieces);
        row(format!("{sensor}, total held {HELD} s"), 0.97, held);
        for fault in device.faults {
            let [exact, bounds] = failing(device, *fault, pieces);
            let what = format!("{sensor}, {fault:?}");
            row(format!("{what}, exact total"), 0.97, exact);
            row(format!("{what}, bound of the total"), 1.0, bounds);
        }
        let (steps, impacts) = (steps(device, pieces, 3), impacts(device, pieces, 3));
        row(format!("{sensor}, steps"), 0.97, steps);
        row(format!("{sensor}, impacts"), 0.97, impacts);
        row(format!("{sensor}, slips"), 1.0, slips(device, pieces, 3));
    }
    wrong
}

/// The rows of a device; ten minutes at most.
macro_rules! whole {
    ($($name:ident: $device:literal,)*) => {
        mod whole {
            $(#[test]
            #[ignore = "minutes"]
            fn $name() {
                let device = &super::DEVICES[$device];
                assert!(device.sensor.starts_with(&stringify!($name).replace('_', "-")));
                let wrong = super::table(std::slice::from_ref(device), 0, 0.0);
                assert!(wrong.is_empty(), "{wrong:#?}");
            })*
        }
    };
}

whole! {
    three_axis: 0,
    in_plane: 1,
    force: 2,
    resistive_mat: 3,
    liquid_metal: 4,
    piezo: 5,
}

/// The short form: of few pieces the share of a row is that of so many draws, give or take three of
/// its deviations.
#[test]
fn a_part_of_the_table_is_near_95_per_cent() {
    let slack = 3.0 * (0.95 * 0.05 / PIECES[1] as f64).sqrt();
    let wrong = table(&DEVICES, 1, slack);
    assert!(wrong.is_empty(), "{wrong:#?}");
}
