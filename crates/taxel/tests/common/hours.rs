//! Hours of touches on the twin of a device, interval by interval: the test `hours` runs
//! a short form, the benchmark of that name the long one.

use std::fmt::Write as _;

use taxel::acquisition::{Delivery, Frame, Quantity, Stimulus, Twin};
use taxel::estimation::{ChargeOptions, State, TouchEventKind, TouchSession};
use taxel::sensor::{Element, Sensor};
use taxel_numerics::Noise;

/// What a device goes through.
#[derive(Debug, Clone)]
pub(crate) struct Course {
    /// The device.
    pub(crate) sensor: Sensor,
    /// A channel that reads code zero throughout; the taxel of this index, which reads
    /// from it, is not touched.
    pub(crate) dead: Option<[usize; 2]>,
    /// Least and largest force of a touch, N.
    pub(crate) forces: [f64; 2],
    /// Force of every twentieth touch, N, beyond what the device can measure.
    pub(crate) overload: Option<[f64; 3]>,
    /// Shortest and longest pause between touches, s.
    pub(crate) pauses: [f64; 2],
    /// Drift of the channels.
    pub(crate) drift: Drift,
    /// Length, and that of an interval, s of device time.
    pub(crate) length: f64,
    /// The first interval is of this length, too.
    pub(crate) interval: f64,
}

/// How the empty channels drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Drift {
    /// Not at all.
    None,
    /// Each channel at a rate of its own, up to this many deviations of a reading per
    /// second.
    Steady(f64),
    /// All channels together: a step of temperature every hour, approached within
    /// minutes, the fastest at this many deviations per second.
    Temperature(f64),
    /// The body creeps: each channel comes to read this share more of what a touch
    /// changes, within minutes, and loses it again.
    Creep(f64),
}

/// What one interval showed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Interval {
    /// Touches whose held part lay in it, and those that were found on their taxel.
    pub(crate) touches: [usize; 2],
    /// Overloads among them, and those whose taxel says that its force is a bound.
    pub(crate) overloads: [usize; 2],
    /// Frames without a touch, and those that show a contact.
    pub(crate) empty: [usize; 2],
    /// Touches and releases among the events, and all other events but steps.
    pub(crate) events: [usize; 3],
    /// Mean of the stated deviation of the total force, or of those of the taxels where a
    /// device knows no total, empty and touched, N.
    pub(crate) stated: [f64; 2],
    /// Share of the true forces within the 95 % intervals, empty and touched.
    pub(crate) within: [f64; 2],
    /// Root mean square of the errors over their stated deviations, empty and touched: one where
    /// the deviations are those of the errors, whatever the shape of their distribution.
    pub(crate) ratio: [f64; 2],
    /// Resident memory near its end, MB.
    pub(crate) memory: f64,
    sums: [Sums; 2],
    looked: Option<u64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    forces: f64,
    within: f64,
    stated: f64,
    squares: f64,
}

/// A touch of the script: taxel, force, time from which and to which it is held.
#[derive(Debug, Clone, Copy)]
struct Planned {
    taxel: usize,
    held: [f64; 2],
    overload: bool,
}

/// Length of the script of touches, which repeats, s.
const SCRIPT: f64 = 1200.0;
/// Each so many touches one is an overload.
const OVERLOAD_EVERY: usize = 20;
/// Time of coming and going, s.
const RAMP: f64 = 0.1;
/// Time after a touch in which nothing is expected yet, s.
const AFTER: f64 = 1.0;
/// Readings from which the noise of the channels is taken.
const QUIET: usize = 200;
/// Deviation of a reading that always rounds to the same count.
const ROUNDING: f64 = 0.3;
/// Time of creep, s.
const CREEP: f64 = 100.0;
/// A step of temperature has this time constant, s, and comes every hour.
const WARMING: f64 = 600.0;
const HOUR: f64 = 3600.0;

/// Plays the course.
///
/// # Panics
/// When the script does not fit the device.
pub(crate) fn run(course: &Course, seed: u64) -> Vec<Interval> {
    let sensor = &course.sensor;
    let (script, planned) = script(course, seed);
    let stimulus = Stimulus::parse("hours", &script).expect("a script");
    let mut twin = Twin::new(sensor, &stimulus, seed).expect("a twin");
    let device = sensor.device().expect("a device");
    let mut session = device.session(&twin.stream()).expect("a session");
    session.begin_rest_capture(50);
    let rounding = match twin.stream().unit.quantity {
        Quantity::Counts => ROUNDING,
        // An instrument gives values that are not rounded.
        _ => 0.0,
    };
    let mut drift = Drifting::new(course.drift, seed, rounding);
    let mut changes = Changes::of(sensor);
    let mut intervals = vec![Interval::default(); (course.length / course.interval) as usize];
    loop {
        let Delivery::Frame(mut frame) = twin.next_delivery() else {
            continue;
        };
        let time = frame.time_ns as f64 * 1e-9;
        let index = (time / course.interval) as usize;
        let Some(interval) = intervals.get_mut(index) else {
            break;
        };
        drift.apply(time, &mut frame);
        if let Some([channel, _]) = course.dead {
            frame.values[channel] = 0.0;
        }
        let truth = twin.true_forces(frame.time_ns);
        let mut truth: Vec<f64> = truth.iter().map(|force| force[2]).collect();
        changes.pass(time, &mut truth);
        interval.take(&mut session, &frame, &truth, &planned);
        // Seldom: the system is asked.
        if frame.sequence % 1000 == 0 {
            interval.memory = memory();
        }
    }
    for interval in &mut intervals {
        interval.finish();
    }
    intervals
}

impl Interval {
    fn take(
        &mut self,
        session: &mut TouchSession,
        frame: &Frame,
        truth: &[f64],
        planned: &[Planned],
    ) {
        let capturing = session.capturing();
        let observed = session.push(frame).expect("a frame of the device");
        for event in observed.events {
            match event.kind {
                TouchEventKind::Touch => self.events[0] += 1,
                TouchEventKind::Release => self.events[1] += 1,
                TouchEventKind::Step => {}
                _ => self.events[2] += 1,
            }
        }
        let touch = observed.touch;
        let time = (frame.time_ns as f64 * 1e-9) % SCRIPT;
        let near = planned
            .partition_point(|one| one.held[1] + RAMP + AFTER < time)
            .min(planned.len() - 1);
        let one = planned[near];
        let touched = one.held[0] <= time && time < one.held[1];
        if capturing || !touched && time > one.held[0] - RAMP - 0.1 {
            return;
        }
        let beyond = touched && one.overload;
        let sums = &mut self.sums[usize::from(touched)];
        match touch.pressing_force() {
            _ if beyond => {}
            Some(total) => sums.take(total, truth.iter().sum()),
            // A device without a total force: the force of each taxel.
            None => {
                for (taxel, &truth) in touch.taxels.iter().zip(truth) {
                    if !taxel.pressed().is_nan() {
                        sums.take([taxel.pressed(), taxel.pressed_deviation()], truth);
                    }
                }
            }
        }
        if !touched {
            self.empty[0] += 1;
            self.empty[1] += usize::from(!touch.contacts.is_empty());
            return;
        }
        // Looked at once, in the middle of what is held.
        let script = (frame.time_ns as f64 * 1e-9 / SCRIPT) as u64;
        let this = script * planned.len() as u64 + near as u64;
        if time > f64::midpoint(one.held[0], one.held[1]) && self.looked != Some(this) {
            self.looked = Some(this);
            self.touches[0] += 1;
            let here = touch
                .contacts
                .iter()
                .any(|contact| contact.peak_taxel == one.taxel);
            self.touches[1] += usize::from(here);
            let bound = touch.taxels[one.taxel].state == State::Closed;
            self.overloads[0] += usize::from(beyond);
            self.overloads[1] += usize::from(beyond && bound);
        }
    }

    fn finish(&mut self) {
        for (index, sums) in self.sums.iter().enumerate() {
            self.stated[index] = sums.stated / sums.forces;
            self.within[index] = sums.within / sums.forces;
            self.ratio[index] = (sums.squares / sums.forces).sqrt();
        }
    }
}

impl Sums {
    fn take(&mut self, [force, deviation]: [f64; 2], truth: f64) {
        self.forces += 1.0;
        self.stated += deviation;
        let ratio = (force - truth) / deviation;
        self.within += f64::from(u8::from(ratio.abs() <= 1.96));
        self.squares += ratio * ratio;
    }
}

/// The changes of force of a device that knows no force that stays: a high-pass of first
/// order, as theory (19) and (19a) of the piezoelectric array have it.
struct Changes {
    /// Time constant, s; `None` for a device whose force stays.
    fades: Option<f64>,
    last: f64,
    forces: Vec<f64>,
    passed: Vec<f64>,
}

impl Changes {
    fn of(sensor: &Sensor) -> Self {
        let piezoelectric = matches!(sensor.element, Element::Piezoelectric(_));
        Self {
            fades: piezoelectric.then(|| ChargeOptions::default().drift_guard),
            last: 0.0,
            forces: Vec::new(),
            passed: Vec::new(),
        }
    }

    /// Puts the changes in the place of the forces.
    fn pass(&mut self, time: f64, forces: &mut [f64]) {
        let Some(fades) = self.fades else { return };
        self.forces.resize(forces.len(), 0.0);
        self.passed.resize(forces.len(), 0.0);
        // What is new came in the middle of the step.
        let half = (-0.5 * (time - self.last) / fades).exp();
        self.last = time;
        let kept = self.passed.iter_mut().zip(&mut self.forces);
        for (force, (change, last)) in forces.iter_mut().zip(kept) {
            *change = (*change * half + *force - *last) * half;
            // What the guard took is given back when the force is gone.
            if *force == 0.0 {
                *change = 0.0;
            }
            *last = std::mem::replace(force, *change);
        }
    }
}

/// Drift that is added to the values of a frame.
struct Drifting {
    kind: Drift,
    /// Least deviation of a reading, in its unit.
    rounding: f64,
    noise: Noise,
    quiet: Vec<Vec<f64>>,
    channels: Vec<Drifted>,
    last: f64,
}

/// One channel that drifts.
struct Drifted {
    /// Mean of its first readings, and their deviation.
    rest: f64,
    deviation: f64,
    /// Share of the fastest drift.
    share: f64,
    crept: f64,
}

impl Drifting {
    fn new(kind: Drift, seed: u64, rounding: f64) -> Self {
        Self {
            kind,
            rounding,
            noise: Noise::seeded(seed ^ 0x5eed),
            quiet: Vec::new(),
            channels: Vec::new(),
            last: 0.0,
        }
    }

    fn apply(&mut self, time: f64, frame: &mut Frame) {
        if self.channels.is_empty() {
            self.quiet.push(frame.values.clone());
            if self.quiet.len() == QUIET {
                let quiet = std::mem::take(&mut self.quiet);
                self.channels = (0..frame.values.len())
                    .map(|channel| {
                        let [rest, deviation] = mean_and_scatter(&quiet, channel);
                        Drifted {
                            rest,
                            deviation: deviation.max(self.rounding),
                            share: (0.6 * self.noise.normal()).clamp(-1.0, 1.0),
                            crept: 0.0,
                        }
                    })
                    .collect();
            }
            return;
        }
        let approach = 1.0 - (-(time - self.last) / CREEP).exp();
        self.last = time;
        for (value, channel) in frame.values.iter_mut().zip(&mut self.channels) {
            *value += match self.kind {
                Drift::None => 0.0,
                Drift::Steady(fastest) => channel.deviation * channel.share * fastest * time,
                Drift::Temperature(fastest) => channel.deviation * fastest * temperature(time),
                Drift::Creep(share) => {
                    let most = share * (*value - channel.rest);
                    channel.crept += approach * (most - channel.crept);
                    channel.crept
                }
            };
        }
    }
}

/// Steps up and down, one every hour, over the fastest rate, s.
fn temperature(time: f64) -> f64 {
    let steps = (time / HOUR) as usize;
    (0..=steps)
        .map(|step| {
            let since = time - HOUR * step as f64 - 0.25 * HOUR;
            let sign = if step % 2 == 0 { 1.0 } else { -1.0 };
            let share = if since > 0.0 {
                1.0 - (-since / WARMING).exp()
            } else {
                0.0
            };
            sign * WARMING * share
        })
        .sum()
}

fn mean_and_scatter(frames: &[Vec<f64>], channel: usize) -> [f64; 2] {
    let count = frames.len() as f64;
    let mean = frames.iter().map(|frame| frame[channel]).sum::<f64>() / count;
    let squares = frames.iter().map(|frame| (frame[channel] - mean).powi(2));
    [mean, (squares.sum::<f64>() / count).sqrt()]
}

/// Touches one after the other, each on one taxel.
fn script(course: &Course, seed: u64) -> (String, Vec<Planned>) {
    let layout = course.sensor.layout();
    let mut random = Noise::seeded(seed ^ 0x70);
    let mut between = move |[low, high]: [f64; 2]| {
        let share = 0.5 * libm::erfc(-random.normal() / std::f64::consts::SQRT_2);
        low * (high / low).powf(share)
    };
    let mut planned = Vec::new();
    let mut paths = vec![String::new(); layout.taxels()];
    let mut time = 5.0;
    loop {
        let start = time + between(course.pauses);
        let held = between([1.0, 5.0]);
        time = start + held + 2.0 * RAMP;
        if time > SCRIPT - 2.0 {
            break;
        }
        let mut taxel = ((between([1.0, std::f64::consts::E]).ln() * layout.taxels() as f64)
            as usize)
            .min(layout.taxels() - 1);
        if course.dead.is_some_and(|[_, dead]| dead == taxel) {
            taxel = (taxel + 1) % layout.taxels();
        }
        let ordinary = [0.0, 0.0, between(course.forces)];
        let overload = course
            .overload
            .filter(|_| planned.len() % OVERLOAD_EVERY == OVERLOAD_EVERY - 1);
        let force = overload.unwrap_or(ordinary);
        for (at, [x, y, z]) in [
            (start, [0.0; 3]),
            (start + RAMP, force),
            (start + RAMP + held, force),
            (time, [0.0; 3]),
        ] {
            let _ = writeln!(
                paths[taxel],
                "{{ time = \"{at} s\", force = [\"{x} N\", \"{y} N\", \"{z} N\"] }},"
            );
        }
        planned.push(Planned {
            taxel,
            held: [start + RAMP, start + RAMP + held],
            overload: overload.is_some(),
        });
    }
    let mut text = format!("schema = 1\nname = \"hours\"\nduration = \"{SCRIPT} s\"\n");
    for (taxel, path) in paths
        .iter()
        .enumerate()
        .filter(|(_, path)| !path.is_empty())
    {
        let place = [taxel / layout.columns, taxel % layout.columns];
        let _ = writeln!(text, "[[probe]]\ntaxel = {place:?}\npath = [\n{path}]");
    }
    (text, planned)
}

/// Resident memory of this process, MB; NaN where the system does not say.
fn memory() -> f64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let resident = pages.and_then(|text| text.split(' ').nth(1)?.parse::<f64>().ok());
    resident.map_or(f64::NAN, |pages| pages * 4096e-6)
}
