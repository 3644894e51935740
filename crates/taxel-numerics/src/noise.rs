//! Noise with a seed: the same seed is the same noise on every machine.

use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};

/// Draws of the standard normal distribution.
#[derive(Debug, Clone)]
pub struct Noise(ChaCha12Rng);

impl Noise {
    /// Noise that begins with `seed`.
    pub fn seeded(seed: u64) -> Self {
        Self(ChaCha12Rng::seed_from_u64(seed))
    }

    /// The next draw: mean 0, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}
