//! Faults of frames and bytes, from a seed. No I/O.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

use super::faults::Faults;
use super::truth::Done;

/// Changes frames and bytes.
#[derive(Debug)]
pub(super) struct Damage {
    faults: Faults,
    random: ChaCha12Rng,
    /// Bytes of a burst that are still to come.
    burst: usize,
    /// Bytes per second, for the rate of bursts.
    bytes_per_second: f64,
}

/// What becomes of a frame before it is encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    Sent,
    Lost,
    Repeated,
    Swapped,
}

impl Damage {
    pub(super) fn new(faults: &Faults, seed: u64) -> Self {
        Self {
            faults: faults.clone(),
            random: ChaCha12Rng::seed_from_u64(seed),
            burst: 0,
            bytes_per_second: 0.0,
        }
    }

    fn happens(&mut self, probability: f64) -> bool {
        // Nothing is drawn for what cannot happen: one fault more leaves the others where they are.
        probability > 0.0 && self.random.random::<f64>() < probability
    }

    /// What becomes of the next frame.
    pub(super) fn fate(&mut self) -> Fate {
        let frames = self.faults.frames;
        if self.happens(frames.lose) {
            Fate::Lost
        } else if self.happens(frames.repeat) {
            Fate::Repeated
        } else if self.happens(frames.swap) {
            Fate::Swapped
        } else {
            Fate::Sent
        }
    }

    /// The number that goes on the wire in place of `sequence`, if it is wrong.
    pub(super) fn counter(&mut self, sequence: u64) -> Option<u64> {
        if !self.happens(self.faults.frames.bad_counter) {
            return None;
        }
        // One bit of the low sixteen: as a fault of memory would leave it.
        Some(sequence ^ (1 << self.random.random_range(0..16)))
    }

    /// Changes the bytes of a packet that is one of `rate` a second.
    pub(super) fn bytes(&mut self, packet: &mut Vec<u8>, rate: f64, done: &mut Done) {
        let wire = self.faults.wire;
        if let Some(burst) = wire.burst {
            self.bytes_per_second = rate * packet.len().max(1) as f64;
            let per_byte = burst.rate / self.bytes_per_second;
            for byte in packet.iter_mut() {
                if self.burst == 0 && self.happens(per_byte) {
                    self.burst = burst.bytes;
                }
                if self.burst > 0 {
                    self.burst -= 1;
                    *byte = self.random.random();
                    done.burst += 1;
                }
            }
        }
        if wire.flip + wire.drop + wire.insert > 0.0 {
            let mut changed = Vec::with_capacity(packet.len() + 4);
            for mut byte in packet.drain(..) {
                if self.happens(wire.drop) {
                    done.dropped += 1;
                    continue;
                }
                if self.happens(wire.flip) {
                    byte ^= 1 << self.random.random_range(0..8);
                    done.flipped += 1;
                }
                changed.push(byte);
                if self.happens(wire.insert) {
                    changed.push(self.random.random());
                    done.inserted += 1;
                }
            }
            *packet = changed;
        }
        if self.faults.link.wrong_baud {
            self.wrong_baud(packet);
            done.burst += packet.len() as u32;
        }
    }

    /// What a receiver of another rate sees: edges at the wrong places, long levels.
    fn wrong_baud(&mut self, packet: &mut [u8]) {
        const LEVELS: [u8; 7] = [0x00, 0xff, 0x80, 0xf8, 0xe0, 0xfe, 0xc0];
        for byte in packet {
            let level = self.random.random_range(0..10);
            *byte = LEVELS.get(level).copied().unwrap_or(*byte | 0x80);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn damaged(text: &str, seed: u64) -> (Vec<u8>, Done) {
        let faults = Faults::parse("faults.toml", text).unwrap();
        let mut damage = Damage::new(&faults, seed);
        let mut done = Done::default();
        let mut bytes = vec![0x55; 10_000];
        damage.bytes(&mut bytes, 100.0, &mut done);
        (bytes, done)
    }

    #[test]
    fn faults_come_as_often_as_stated_and_from_the_seed() {
        let text = "[wire]\nflip = 1e-2\ndrop = 2e-2\ninsert = 1e-2\n";
        let (bytes, done) = damaged(text, 3);
        assert_eq!((bytes.clone(), done.clone()), damaged(text, 3));
        assert_ne!(bytes, damaged(text, 4).0);
        // Five standard deviations of the counts, 10 and 14.
        assert!(
            done.flipped.abs_diff(100) < 50 && done.inserted.abs_diff(100) < 50,
            "{done:?}"
        );
        assert!(done.dropped.abs_diff(200) < 70, "{done:?}");
        assert_eq!(bytes.len() as u32, 10_000 - done.dropped + done.inserted);
        let (bytes, done) = damaged("", 3);
        assert!(!done.damaged() && bytes == vec![0x55; 10_000]);
    }

    #[test]
    fn a_burst_is_as_long_as_stated() {
        // A megabyte a second: a burst of 100 bytes a hundred times a second is 1 % of the bytes.
        let (_, done) = damaged("[wire]\nburst = { rate = \"100 Hz\", bytes = 100 }\n", 1);
        assert!(done.burst <= 600, "{done:?}");
        let faults = "[frames]\nlose = 0.25\nrepeat = 0.25\nswap = 0.25\nbad_counter = 0.5\n";
        let faults = Faults::parse("faults.toml", faults).unwrap();
        let mut damage = Damage::new(&faults, 1);
        let fates: Vec<_> = (0..1000).map(|_| damage.fate()).collect();
        let count = |fate| fates.iter().filter(|one| **one == fate).count();
        assert!(
            count(Fate::Lost).abs_diff(250) < 70,
            "{}",
            count(Fate::Lost)
        );
        assert!(
            (0..1000)
                .filter_map(|n| damage.counter(n))
                .count()
                .abs_diff(500)
                < 80
        );
    }
}
