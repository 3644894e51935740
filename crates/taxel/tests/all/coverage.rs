//! Intervals of totals and of events, devices by loads by faults: 95 % of them hold the truth.
//!
//! What fabrication scatters is drawn for each piece, as the noise is.
//!
//! The whole table: `cargo test --release -p taxel --test all coverage -- --ignored --nocapture`; of one
//! device `coverage::whole::piezo` in the place of `coverage`, of one of its kinds of rows
//! `coverage::whole::piezo::impacts`. Trained arrays have theirs: `-p taxel-calibrate --test intervals`.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::ops::Add;

use rayon::prelude::*;
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
    /// a second, and a frame below soft rubber takes a millisecond.
    pieces: [u64; 2],
    /// A finger that slides over the array: radius and half of the way, mm, force in the unit, and
    /// speed, mm/s. None for an array of one taxel and where layers cross: a finger over two rows and
    /// two columns has no certain position. Speeds along the rows of elements that give charge
    /// are those of `p3_slip::ninety_five_per_cent_intervals_hold_the_speed_of_two_hundred_ridges`.
    slide: Option<[f64; 4]>,
    /// False where hardly a step or impact is known: the force of a contact is uncertain by what its cells
    /// do not see of it, and six deviations of that are about as much as the force.
    changes: bool,
    /// Standard deviations of each component of a uniform field, uT, and of the warming of magnets, %,
    /// as the sensor file states them, which the script of a twin has not.
    around: Option<[f64; 2]>,
}

const DEVICES: [Device; 8] = [
    Device {
        sensor: "three-axis-8x8",
        taxel: [4, 4],
        loads: [2.0, 8.0, 15.0],
        unit: "mN",
        channel: 4 * 36 + 2,
        faults: &[Fault::Dead, Fault::Stuck, Fault::Saturated],
        pieces: PIECES,
        slide: Some([4.0, 4.0, 90.0, 16.0]),
        changes: true,
        around: None,
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
        changes: true,
        around: None,
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
        changes: true,
        around: None,
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
        changes: true,
        around: None,
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
        changes: true,
        around: None,
    },
    Device {
        sensor: "piezo-2.3mm",
        taxel: [0, 1],
        loads: [50.0, 150.0, 300.0],
        unit: "mN",
        channel: 1,
        faults: &SHOWN,
        pieces: [400, 0],
        slide: None,
        changes: true,
        around: None,
    },
    Device {
        sensor: "pressure-chips-1x8",
        taxel: [0, 4],
        loads: [0.1, 0.3, 0.6],
        unit: "N",
        channel: 4,
        faults: &SHOWN,
        pieces: [300, 3],
        slide: Some([8.0, 16.0, 0.5, 60.0]),
        changes: false,
        around: None,
    },
    Device {
        sensor: "magnet-over-four-hall",
        taxel: [0, 0],
        loads: [0.1, 0.4, 0.8],
        unit: "N",
        channel: 2,
        faults: &SHOWN,
        pieces: PIECES,
        slide: None,
        changes: true,
        around: Some([65.0, 0.6]),
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

/// The rest is captured before, s, and magnetometers are turned in the field between the two.
const BEGIN: f64 = 1.5;
const TURNED: f64 = 1.4;
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
            Element::Cells(_) | Element::MagneticSkin(_) => {
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

/// What is around the magnetometers of a piece: the field in uT before and after it is turned, which it is
/// as soon as the rest is captured, and how much weaker the magnets become meanwhile.
struct Around {
    fields: [[f64; 3]; 2],
    warmer: f64,
}

impl Around {
    fn new([field, warming]: [f64; 2], seed: u64) -> Self {
        let mut noise = taxel_numerics::Noise::seeded(seed);
        Self {
            fields: [(); 2].map(|()| [(); 3].map(|()| field * noise.normal())),
            warmer: 1e-2 * warming * noise.normal(),
        }
    }

    /// Readings, T, three of each magnetometer.
    fn disturb(&self, readings: &mut [f64], turned: bool) {
        let factor = if turned { 1.0 + self.warmer } else { 1.0 };
        for (channel, reading) in readings.iter_mut().enumerate() {
            let field = 1e-6 * self.fields[usize::from(turned)][channel % 3];
            *reading = factor * *reading + field;
        }
    }
}

/// Frames and the true pressing force, N, until a time, s.
fn frames(
    device: &Device,
    seed: u64,
    twin: &mut Twin,
    until: f64,
    mut take: impl FnMut(Frame, f64, f64),
) {
    let around = device.around.map(|around| Around::new(around, seed));
    loop {
        let Delivery::Frame(mut frame) = twin.next_delivery() else {
            continue;
        };
        let time = frame.time_ns as f64 * 1e-9;
        if time > until {
            return;
        }
        if let Some(around) = &around {
            around.disturb(&mut frame.values, time > TURNED);
        }
        let forces = twin.true_forces(frame.time_ns);
        let truth: f64 = forces.iter().map(|force| force[2]).sum();
        take(frame, time, truth);
    }
}

/// Intervals of 95 %: how many there are, how many hold the truth, and the sum of the squares of the
/// errors in deviations.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    all: usize,
    held: usize,
    squares: f64,
}

impl Count {
    fn of(value: f64, deviation: f64, truth: f64) -> Self {
        let off = (value - truth) / deviation;
        Self {
            all: 1,
            held: usize::from(off.abs() <= 1.96),
            squares: off * off,
        }
    }

    /// Of a lower bound, which holds also where it is far below.
    fn of_bound(least: f64, deviation: f64, truth: f64) -> Self {
        let mut count = Self::of(least, deviation, truth);
        count.held = usize::from(least - truth <= 1.96 * deviation.max(0.0));
        count
    }
}

impl Add for Count {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            all: self.all + other.all,
            held: self.held + other.held,
            squares: self.squares + other.squares,
        }
    }
}

/// What `of` counts of each of `pieces` pieces, by their seeds.
fn sum<T: Default + Add<Output = T> + Send>(pieces: u64, of: impl Fn(u64) -> T + Send + Sync) -> T {
    (1..=pieces)
        .into_par_iter()
        .map(of)
        .reduce(T::default, T::add)
}

/// Exact totals of `pieces` pieces under a load, each at the end of 0.3 s of the last of `levels`, which
/// last 1 s each.
fn totals(device: &Device, levels: &[f64], pieces: u64) -> Count {
    sum(pieces, |seed| {
        let (mut twin, mut session) = device.held(levels, seed);
        let mut last = f64::NAN;
        let until = FAILS + (levels.len() - 1) as f64;
        frames(device, seed, &mut twin, until, |frame, _, truth| {
            session.push(&frame).unwrap();
            last = truth;
        });
        match device.stated(session.estimator().touch()) {
            Some(([force, deviation], Certainty::Exact)) => Count::of(force, deviation, last),
            _ => Count::default(),
        }
    })
}

/// Totals of pieces one of whose channels fails under a load.
#[derive(Default)]
struct Failing {
    exact: Count,
    bounds: Count,
}

impl Add for Failing {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            exact: self.exact + other.exact,
            bounds: self.bounds + other.bounds,
        }
    }
}

fn failing(device: &Device, fault: Fault, pieces: u64) -> Failing {
    let load = device.loads[1];
    sum(pieces, |seed| {
        let (mut twin, mut session) = device.held(&[load, load, load], seed);
        let [low, high] = session.estimator().channels()[device.channel].span;
        let (mut rest, mut last) = (None, f64::NAN);
        let until = FAILS + NOTICED;
        frames(device, seed, &mut twin, until, |mut frame, time, truth| {
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
        let mut counts = Failing::default();
        match device.stated(session.estimator().touch()) {
            Some(([force, deviation], Certainty::Exact)) => {
                counts.exact = Count::of(force, deviation, last);
            }
            Some(([force, deviation], Certainty::AtLeast)) => {
                counts.bounds = Count::of_bound(force, deviation, last);
            }
            _ => {}
        }
        counts
    })
}

/// Events of one kind of `pieces` pieces; `run` gives a piece by its seed, and `truth` the true
/// value of an event at a time after the beginning, s.
fn events(
    device: &Device,
    kind: &str,
    pieces: u64,
    run: impl Fn(u64) -> (Twin, TouchSession, f64) + Sync,
    truth: impl Fn(u64, f64) -> f64 + Sync,
) -> Count {
    sum(pieces, |seed| {
        let mut counts = Count::default();
        let (mut twin, mut session, until) = run(seed);
        frames(device, seed, &mut twin, BEGIN + until, |frame, time, _| {
            let observed = session.push(&frame).unwrap().events;
            let of_kind = |event: &&TouchEvent| event.kind.name() == kind;
            for event in observed.iter().filter(of_kind) {
                let truth = truth(seed, time - BEGIN);
                counts = counts + Count::of(event.value, event.deviation, truth);
            }
        });
        counts
    })
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
    let run = |seed| {
        let (twin, session) = device.held(&levels, seed);
        (twin, session, each as f64)
    };
    events(device, "step", pieces, run, truth)
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
    let run = |seed| {
        let pulses = (0..each).flat_map(|number| pulse(seed, number));
        let (twin, session) = device.pressed(pulses, seed);
        (twin, session, 1.5 * each as f64 + 2.0)
    };
    let truth = |seed, after: f64| {
        let mut begun = (0..each).filter(|number| begin(seed, *number) < after);
        device.newtons() * begun.next_back().map_or(0.0, peak)
    };
    events(device, "impact", pieces, run, truth)
}

/// A force that comes and goes so fast, s, is an impact.
const PULSE: f64 = 0.24;

/// Slips of a finger to and fro, with a stop of 0.7 s after each. Each piece has a speed of its own:
/// where the way of a quarter of a second is a number of cells, the error of the grid is the same at both ends.
fn slips(device: &Device, pieces: u64, each: usize) -> Count {
    let Some([radius, half, force, speed]) = device.slide else {
        return Count::default();
    };
    let speed = |seed: u64| speed * (0.8 + 0.4 * (seed as f64 * 0.445).fract());
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
            (time, x) = (time + 2.0 * half / speed(seed), -x);
            point(time, x, force);
        }
        let script = format!(
            "schema = 1\nname = \"slide\"\nduration = \"{} s\"\n[[finger]]\nradius = \"{radius} mm\"\npath = [\n{path}]\n",
            time + 1.0
        );
        let (twin, session) = device.piece(&script, seed);
        (twin, session, time - BEGIN)
    };
    events(device, "slip", pieces, run, |seed, _| 1e-3 * speed(seed))
}

/// What the grid does to a position and what the neighbours of a contact carry that the centre leaves out
/// are functions of where the load is in the grid, which have bounds that normal errors have not; and the
/// deviation adds the two as if they had nothing to do with each other, while both come from the edge of the
/// load: of two as large as each other it is larger than the error by the root of two.
const OF_ONE_CAUSE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// What is asked of the rows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rows {
    Totals,
    Faults,
    Steps,
    Impacts,
    Slips,
}

const ROWS: [Rows; 5] = [
    Rows::Totals,
    Rows::Faults,
    Rows::Steps,
    Rows::Impacts,
    Rows::Slips,
];

/// The long or the short table, with three events a piece, and the rows whose share is not within the
/// bounds of 93 to 97 %, give or take so many `deviations` of a share of so few draws. A lower bound may
/// hold always, and so may slips whose errors in deviations have no less than [`OF_ONE_CAUSE`].
fn table(device: &Device, rows: Rows, length: usize, deviations: f64) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut row = |what: String, most: f64, count: Count| {
        if count.all == 0 {
            // Only of a failing channel it is left open which of the two rows there is.
            let asked = match rows {
                Rows::Totals => true,
                Rows::Faults => false,
                Rows::Steps | Rows::Impacts => device.changes,
                Rows::Slips => device.slide.is_some(),
            };
            if asked && device.pieces[length] > 0 {
                wrong.push(format!("{}, {what}: none", device.sensor));
            }
            return;
        }
        let share = count.held as f64 / count.all as f64;
        let scatter = (count.squares / count.all as f64).sqrt();
        let line = format!("{}, {what}", device.sensor);
        let slack = deviations * (0.95 * 0.05 / count.all as f64).sqrt();
        println!("{line:<52} {share:.3} of {}, {scatter:.2}", count.all);
        let bounded = rows == Rows::Slips && scatter >= OF_ONE_CAUSE;
        let most = if bounded { 1.0 } else { most };
        if !(0.93 - slack..=most + slack).contains(&share) {
            wrong.push(format!("{line}: {share:.3} of {}", count.all));
        }
    };
    let (pieces, unit) = (device.pieces[length], device.unit);
    match rows {
        Rows::Totals => {
            for load in device.loads {
                let count = totals(device, &[load], pieces);
                row(format!("{load} {unit}, total"), 0.97, count);
            }
            let held = totals(device, &[device.loads[1]; HELD], pieces);
            row(format!("total held {HELD} s"), 0.97, held);
        }
        Rows::Faults => {
            for fault in device.faults {
                let Failing { exact, bounds } = failing(device, *fault, pieces);
                row(format!("{fault:?}, exact total"), 0.97, exact);
                row(format!("{fault:?}, bound of the total"), 1.0, bounds);
            }
        }
        Rows::Steps => row("steps".into(), 0.97, steps(device, pieces, 3)),
        Rows::Impacts => row("impacts".into(), 0.97, impacts(device, pieces, 3)),
        Rows::Slips => row("slips".into(), 0.97, slips(device, pieces, 3)),
    }
    wrong
}

/// The rows of a device; some minutes each.
macro_rules! whole {
    ($($name:ident: $device:literal,)*) => {
        mod whole {
            $(mod $name {
                use super::super::{DEVICES, Rows, table};

                fn whole(rows: Rows) {
                    let device = &DEVICES[$device];
                    assert!(device.sensor.starts_with(&stringify!($name).replace('_', "-")));
                    let wrong = table(device, rows, 0, 0.0);
                    assert!(wrong.is_empty(), "{wrong:#?}");
                }

                #[test]
                #[ignore = "minutes"]
                fn totals() {
                    whole(Rows::Totals);
                }

                #[test]
                #[ignore = "minutes"]
                fn faults() {
                    whole(Rows::Faults);
                }

                #[test]
                #[ignore = "minutes"]
                fn steps() {
                    whole(Rows::Steps);
                }

                #[test]
                #[ignore = "minutes"]
                fn impacts() {
                    whole(Rows::Impacts);
                }

                #[test]
                #[ignore = "minutes"]
                fn slips() {
                    whole(Rows::Slips);
                }
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
    pressure_chips: 6,
    magnet: 7,
}

/// The short form.
#[test]
fn a_part_of_the_table_is_near_95_per_cent() {
    let rows = |device| {
        ROWS.into_iter()
            .flat_map(move |rows| table(device, rows, 1, 3.0))
    };
    let wrong: Vec<String> = DEVICES.iter().flat_map(rows).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
