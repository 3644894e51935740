//! The map of device time to host time, on models of four kinds of links.
#![allow(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a panic is how a test fails, and figures are printed"
)]

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use taxel_board::{ClockEvent, DeviceClockMap};

/// Delays of a link, s.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Path {
    Usb,
    Ftdi,
    Wifi,
    Bluetooth,
}

impl Path {
    /// The smallest delay, s.
    fn least(self) -> f64 {
        match self {
            Self::Usb => 0.0004,
            Self::Ftdi => 0.0003,
            Self::Wifi => 0.001,
            Self::Bluetooth => 0.003,
        }
    }

    fn delay(self, now: f64, phase: f64, random: &mut impl Rng) -> f64 {
        let mut exponential = |mean: f64| -mean * (1.0 - random.random::<f64>()).ln();
        let more = match self {
            Self::Usb => 0.001 * exponential(1.0).fract() + exponential(0.0003),
            Self::Ftdi => {
                let polls = (now + phase) / 0.016;
                (polls.ceil() - polls) * 0.016 + exponential(0.0003)
            }
            Self::Wifi => {
                exponential(0.0005)
                    + if exponential(1.0) > 1.2 {
                        exponential(0.004)
                    } else {
                        0.0
                    }
            }
            Self::Bluetooth => 0.015 * exponential(1.0).fract() + exponential(0.004),
        };
        self.least() + more
    }
}

/// Median error of the last second less the smallest delay, and of the rate, after `seconds`.
fn errors(path: Path, seconds: f64, seed: u64) -> (f64, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let phase = random.random::<f64>() * 0.016;
    let rate = 60e-6;
    let mut map = DeviceClockMap::new(None);
    let frames = (seconds * 100.0) as u64;
    let mut arrival = 0.0_f64;
    let mut pause_until = 0.0;
    let mut errors = Vec::new();
    for frame in 0..frames {
        let device = frame as f64 / 100.0;
        let host = device * (1.0 + rate) + 12.345;
        if random.random::<f64>() < 1.0 / 3000.0 {
            pause_until = host + 0.05 + 0.45 * random.random::<f64>();
        }
        let delayed = host + path.delay(host, phase, &mut random);
        arrival = arrival
            .max(delayed)
            .max(if host < pause_until { pause_until } else { 0.0 });
        map.push((device * 1e9) as u64, (arrival * 1e9) as u64);
        if frame + 100 >= frames {
            let found = map
                .host((device * 1e9) as u64)
                .map_or(f64::NAN, |host| host.time_ns as f64 * 1e-9);
            errors.push(found - host - path.least());
        }
    }
    errors.sort_by(f64::total_cmp);
    assert_eq!(map.segments(), 1, "{path:?}");
    (errors[errors.len() / 2], map.rate_difference() - rate)
}

#[test]
fn the_hull_finds_offset_and_rate() {
    // Spread after a minute and after five: the goals of the measured prototypes.
    for (path, spread, minute, five) in [
        (Path::Usb, 60.0, 0.05e-3, 0.05e-3),
        (Path::Ftdi, 60.0, 0.4e-3, 0.15e-3),
        (Path::Wifi, 60.0, 0.1e-3, 0.05e-3),
        (Path::Bluetooth, 60.0, 1.0e-3, 0.4e-3),
    ] {
        for (seconds, bound, ppm) in [(spread, minute, 15e-6), (300.0, five, 3e-6)] {
            for seed in 0..6 {
                let (offset, rate) = errors(path, seconds, seed);
                println!(
                    "{path:?} {seconds} {seed} {:.4} ms {:.2} ppm",
                    1e3 * offset,
                    1e6 * rate
                );
                assert!(offset.abs() < bound, "{path:?} {seconds} s: {offset} s");
                assert!(rate.abs() < ppm, "{path:?} {seconds} s: {rate}");
            }
        }
    }
}

/// What a path and a clock do, beyond what the map was made with.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Case {
    /// One of the four models, with pauses of up to 0.5 s.
    Known(Path),
    /// Delays of a Pareto law: no mean square.
    HeavyTail,
    /// Good and bad spells of some seconds, as a radio has them.
    Spells,
    /// Polled every 16 ms by a clock that is 10 ppm off: the phases of frame and poll beat.
    Beating,
    /// A USB path and a clock whose rate wanders by 1e-8 in a second.
    Wander,
    /// A USB path and a clock that warms up: 3 ppm in the first minutes.
    Warming,
    /// A USB path whose pauses last up to 3 s.
    LongPauses,
}

const CASES: [Case; 10] = [
    Case::Known(Path::Usb),
    Case::Known(Path::Ftdi),
    Case::Known(Path::Wifi),
    Case::Known(Path::Bluetooth),
    Case::HeavyTail,
    Case::Spells,
    Case::Beating,
    Case::Wander,
    Case::Warming,
    Case::LongPauses,
];

impl Case {
    fn path(self) -> Path {
        match self {
            Self::Known(path) => path,
            Self::Beating => Path::Ftdi,
            Self::Spells => Path::Wifi,
            _ => Path::Usb,
        }
    }

    /// Delay of a frame, s.
    fn delay(self, now: f64, phase: f64, random: &mut impl Rng) -> f64 {
        let least = self.path().least();
        match self {
            Self::HeavyTail => {
                let share: f64 = 1.0 - random.random::<f64>();
                least + 0.2e-3 * (share.powf(-1.0 / 1.5) - 1.0).min(2e3)
            }
            Self::Spells => {
                let bad = ((now + 100.0 * phase) / 3.7).sin() > 0.6;
                let mean = if bad { 0.030 } else { 0.001 };
                least - mean * (1.0 - random.random::<f64>()).ln()
            }
            Self::Beating => {
                let polls = (now * (1.0 + 10e-6) + phase) / 0.016;
                least + (polls.ceil() - polls) * 0.016
            }
            _ => self.path().delay(now, phase, random),
        }
    }

    /// Longest pause, s.
    fn pause(self) -> f64 {
        match self {
            Self::LongPauses => 3.0,
            _ => 0.5,
        }
    }
}

/// A second of a run: the errors of the map, of its bound and of its rate.
#[derive(Debug, Clone, Copy)]
struct Second {
    /// Map less truth less the smallest delay, s.
    offset: f64,
    /// Found rate less the true one.
    rate: f64,
    /// How far the truth lies outside of the bound, s; 0 inside.
    outside: f64,
    /// Width of the bound less the stated uncertainty of the delay, s.
    scatter: f64,
}

/// Seconds of a run of a case at 100 Hz. The smallest delay lies anywhere in what is stated of it.
fn run(case: Case, seconds: usize, seed: u64) -> Vec<Second> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let phase = random.random::<f64>() * 0.016;
    let least = case.path().least();
    let share: f64 = random.random();
    let stated = [least - 0.2e-3 * share, least + 0.2e-3 * (1.0 - share)];
    let (mut known, mut unknown) = (DeviceClockMap::new(Some(stated)), DeviceClockMap::new(None));
    let mut rate = 200e-6 * (random.random::<f64>() - 0.5);
    let (mut host, mut arrival, mut pause_until) = (12.345_f64, 0.0_f64, 0.0);
    let mut found = Vec::new();
    for frame in 0..seconds * 100 {
        let device = frame as f64 / 100.0;
        let pace = match case {
            Case::Wander => {
                let kick: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
                rate += 1e-8 * 0.1 * kick;
                rate
            }
            Case::Warming => rate + 3e-6 * (1.0 - (-device / 100.0).exp()),
            _ => rate,
        };
        if frame > 0 {
            host += 0.01 * (1.0 + pace);
        }
        if random.random::<f64>() < 1.0 / 3000.0 {
            pause_until = host + 0.05 + (case.pause() - 0.05) * random.random::<f64>();
        }
        arrival = arrival
            .max(host + case.delay(host, phase, &mut random))
            .max(if host < pause_until { pause_until } else { 0.0 });
        let stamp = [(device * 1e9).round() as u64, (arrival * 1e9) as u64];
        known.push(stamp[0], stamp[1]);
        unknown.push(stamp[0], stamp[1]);
        if frame % 100 != 99 {
            continue;
        }
        let (Some(with), Some(without)) = (known.host(stamp[0]), unknown.host(stamp[0])) else {
            panic!("{case:?}: no time after a stamp");
        };
        let error = with.time_ns as f64 * 1e-9 - host;
        let bare = without.time_ns as f64 * 1e-9 - host;
        let before = with.before.expect("the delay is stated");
        found.push(Second {
            offset: bare - least,
            rate: known.rate_difference() - pace,
            outside: (error - before)
                .max(-error - with.behind)
                .max(-bare - without.behind)
                .max(0.0),
            scatter: with.behind - 0.1e-3,
        });
    }
    found
}

/// Value that a share of all stays below.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

/// Runs the cases with so many seeds and prints the figures: offset (half of the span that holds
/// nine of ten) and rate after one minute and after five, how often the truth lies in the bound,
/// how far outside it lies at most, and how wide the bound is.
fn coverage(seeds: u64) -> Vec<(Case, f64, f64)> {
    println!(
        "case, offset at 60 s [ms], rate at 60 s [ppm], offset at 300 s [ms], rate at 300 s [ppm], inside [%], furthest outside [ms], scatter stated, median [ms]"
    );
    let mut shares = Vec::new();
    for case in CASES {
        let runs: Vec<_> = (0..seeds).map(|seed| run(case, 420, seed)).collect();
        let spread = |from: usize| {
            let near = || runs.iter().flat_map(move |run| &run[from..from + 20]);
            let offsets = || near().map(|second| second.offset);
            let rates = near().map(|second| second.rate.abs());
            (
                0.5e3 * (quantile(offsets(), 0.95) - quantile(offsets(), 0.05)),
                1e6 * quantile(rates, 0.9),
            )
        };
        let all = || runs.iter().flat_map(|run| run.iter());
        let inside =
            all().filter(|second| second.outside == 0.0).count() as f64 / all().count() as f64;
        let furthest = all().map(|second| second.outside).fold(0.0, f64::max);
        let (minute, five) = (spread(60), spread(300));
        println!(
            "{case:?}, {:.3}, {:.1}, {:.3}, {:.2}, {:.2}, {:.3}, {:.3}",
            minute.0,
            minute.1,
            five.0,
            five.1,
            1e2 * inside,
            1e3 * furthest,
            1e3 * quantile(all().map(|second| second.scatter), 0.5),
        );
        shares.push((case, inside, furthest));
    }
    shares
}

/// Long form: `TAXEL_CLOCK_SEEDS=50 cargo test --release -p taxel-board --test clocks -- --nocapture coverage`
#[test]
fn coverage_of_the_stated_bound() {
    let seeds =
        std::env::var("TAXEL_CLOCK_SEEDS").map_or(3, |text| text.parse().expect("a number"));
    for (case, inside, furthest) in coverage(seeds) {
        assert!(inside >= 0.99, "{case:?}: {inside}, {furthest} s outside");
    }
}

#[test]
fn what_is_older_than_the_window_says_nothing() {
    let mut map = DeviceClockMap::new(None);
    // The first stamp was the fastest by far; then both clocks go alike for half an hour.
    for step in 0..180_000_u64 {
        let device = step * 10_000_000;
        let delay = if step == 0 { 0 } else { 2_000_000 };
        map.push(device, 1_000_000_000 + device + delay);
    }
    let device = 179_999 * 10_000_000;
    let host = map.host(device).expect("there were stamps");
    assert!(host.time_ns.abs_diff(1_000_000_000 + device + 2_000_000) < 1000);
    assert!(host.behind < 1e-6, "{host:?}");
}

#[test]
fn a_restart_and_a_jump_of_the_clock_begin_a_segment() {
    let mut map = DeviceClockMap::new(Some([0.2e-3, 1e-3]));
    let mut segments = 0;
    for frame in 0..3000_u64 {
        // The board begins again at 1000; its clock jumps by 10 s at 2000.
        let device = match frame {
            0..1000 => frame * 10_000_000,
            1000..2000 => (frame - 1000) * 10_000_000,
            _ => (frame - 1000) * 10_000_000 + 10_000_000_000,
        };
        let host = 7_000_000_000 + frame * 10_000_000 + (frame * 7919 % 13) * 50_000;
        segments += u64::from(map.push(device, host) == ClockEvent::Segment);
        let now = map.host(device);
        assert!(now.is_some_and(|now| now.behind >= 0.4e-3));
    }
    assert_eq!((segments, map.segments()), (3, 3));
}

#[test]
fn inside_a_segment_the_map_never_goes_back() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut map = DeviceClockMap::new(None);
    let mut last = 0;
    for frame in 0..20_000_u64 {
        let device = frame * 10_000_000;
        let delay = (random.random::<f64>() * 5e6) as u64;
        map.push(device, 1_000_000_000 + device + delay);
        let host = map.host(device).map_or(0, |host| host.time_ns);
        assert!(host > last, "frame {frame}");
        last = host;
    }
}
