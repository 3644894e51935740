//! The clock of a virtual device, and the way of its packets. No I/O.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

use super::faults::{Faults, Jitter, TimeFaults};

/// Bytes that an FTDI adapter sends at once.
const FTDI_FULL: usize = 62;

/// Says when packets leave and what the clock of the device shows.
#[derive(Debug)]
pub(super) struct Timing {
    faults: TimeFaults,
    random: ChaCha12Rng,
    rate_error: f64,
    /// Time of the last reading, and of the device's clock then, s.
    time: f64,
    device_time: f64,
    /// Nothing leaves before this time, s.
    held_until: f64,
    /// Bytes that wait in an FTDI adapter, and when it sends them, s.
    waiting: usize,
    flush_at: f64,
}

impl Timing {
    pub(super) fn new(faults: &Faults, seed: u64) -> Self {
        Self {
            faults: faults.time,
            // Other draws than those of damage.
            random: ChaCha12Rng::seed_from_u64(seed ^ 0x7469_6d65),
            rate_error: faults.time.rate_error,
            time: 0.0,
            device_time: 0.0,
            held_until: 0.0,
            waiting: 0,
            flush_at: 0.0,
        }
    }

    /// Time of the device's clock, ns, at the true time `time`, s; times only grow.
    pub(super) fn device_time_ns(&mut self, time: f64) -> u64 {
        let step = (time - self.time).max(0.0);
        if self.faults.wander > 0.0 {
            // The sum of twelve draws is normal enough for a drift.
            let normal: f64 = (0..12).map(|_| self.random.random::<f64>()).sum::<f64>() - 6.0;
            self.rate_error += self.faults.wander * step.sqrt() * normal;
        }
        self.device_time += step * (1.0 + self.rate_error);
        self.time = time;
        (self.device_time * 1e9).round() as u64
    }

    /// When a packet of `bytes` bytes leaves that is ready at `time`, s; never before the one
    /// before it.
    pub(super) fn leaves(&mut self, time: f64, period: f64, bytes: usize) -> f64 {
        if let Some(pause) = self.faults.pause
            && self.random.random::<f64>() < pause.rate * period
        {
            let [from, to] = pause.of;
            let long = from + (to - from) * self.random.random::<f64>();
            self.held_until = self.held_until.max(time + long);
        }
        let exponential =
            |mean: f64, random: &mut ChaCha12Rng| -mean * (1.0 - random.random::<f64>()).ln();
        let leaves = match self.faults.jitter {
            None => time,
            Some(Jitter::Usb(every)) => (time / every).ceil() * every,
            Some(Jitter::Ftdi(every)) => {
                if time >= self.flush_at {
                    self.waiting = 0;
                    self.flush_at = time + every;
                }
                self.waiting += bytes;
                if self.waiting >= FTDI_FULL {
                    self.waiting %= FTDI_FULL;
                    time
                } else {
                    self.flush_at
                }
            }
            Some(Jitter::Exponential(mean)) => time + exponential(mean, &mut self.random),
            Some(Jitter::Wifi(mean)) => {
                let slow = self.random.random::<f64>() < 0.02;
                let mean = if slow { 10.0 * mean } else { mean };
                time + exponential(mean, &mut self.random)
            }
        };
        self.held_until = self.held_until.max(leaves);
        self.held_until
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(text: &str) -> Timing {
        Timing::new(&Faults::parse("faults.toml", text).unwrap(), 7)
    }

    #[test]
    fn the_clock_runs_fast_by_what_is_stated() {
        let mut timing = timing("[time]\nrate_error = 1e-3\n");
        (0..=1000).for_each(|i| {
            timing.device_time_ns(f64::from(i));
        });
        assert_eq!(timing.device_time_ns(1000.0), 1_001_000_000_000);
    }

    #[test]
    fn packets_stay_in_order_and_never_leave_early() {
        for jitter in ["usb", "ftdi", "wifi", "exponential"] {
            let text = format!(
                "[time]\njitter = {{ {jitter} = \"5 ms\" }}\npause = {{ rate = \"1 Hz\", of = [\"50 ms\", \"60 ms\"] }}\n"
            );
            let mut timing = timing(&text);
            let (mut last, mut longest) = (0.0, 0.0_f64);
            for i in 0..10_000 {
                let time = f64::from(i) * 1e-3;
                let leaves = timing.leaves(time, 1e-3, 20);
                assert!(leaves >= time && leaves >= last, "{jitter}");
                longest = longest.max(leaves - time);
                last = leaves;
            }
            assert!(longest > 0.04 && longest < 2.0, "{jitter}: {longest}");
        }
    }
}
