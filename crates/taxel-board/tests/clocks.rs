//! The map of device time to host time, on models of four kinds of links.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use taxel_board::{ClockEvent, DeviceClockMap};

/// Delays of a link, s.
#[derive(Debug, Clone, Copy)]
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
                assert!(offset.abs() < bound, "{path:?} {seconds} s: {offset} s");
                assert!(rate.abs() < ppm, "{path:?} {seconds} s: {rate}");
            }
        }
    }
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
