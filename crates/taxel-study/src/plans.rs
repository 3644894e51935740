//! Plans: which designs a sweep computes, as shares of the way of each variable, 0 to 1.

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::Rng as _;

pub use taxel_numerics::{SOBOL_DIMENSIONS, sobol};

/// A draw, 0 to 1 without 1, in 53 bits.
pub(crate) fn draw(random: &mut ChaCha12Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Random numbers that begin with `seed`.
pub(crate) fn seeded(seed: u64) -> ChaCha12Rng {
    ChaCha12Rng::seed_from_u64(seed)
}

/// Random plans of a Latin hypercube from which the best is taken.
const TRIALS: usize = 100;
/// Above this number of points the least distance costs more than it is worth: one plan.
const MOST_COMPARED: usize = 2000;

/// A Latin hypercube: each variable takes each of `points` equal parts once. Of 100 random
/// ones that with the greatest least distance; rows of `dimensions` shares.
pub fn latin_hypercube(dimensions: usize, points: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = seeded(seed);
    let mut best: Option<(f64, Vec<Vec<f64>>)> = None;
    let trials = if points > MOST_COMPARED { 1 } else { TRIALS };
    for _ in 0..trials {
        let columns: Vec<Vec<f64>> = (0..dimensions)
            .map(|_| {
                let mut parts: Vec<usize> = (0..points).collect();
                parts.shuffle(&mut random);
                let within = |part: usize, random: &mut ChaCha12Rng| {
                    (part as f64 + draw(random)) / points as f64
                };
                parts
                    .into_iter()
                    .map(|part| within(part, &mut random))
                    .collect()
            })
            .collect();
        let plan: Vec<Vec<f64>> = (0..points)
            .map(|row| columns.iter().map(|column| column[row]).collect())
            .collect();
        let least = if trials == 1 {
            0.0
        } else {
            least_distance(&plan)
        };
        if best.as_ref().is_none_or(|(known, _)| least > *known) {
            best = Some((least, plan));
        }
    }
    best.map_or_else(Vec::new, |(_, plan)| plan)
}

fn least_distance(plan: &[Vec<f64>]) -> f64 {
    let mut least = f64::INFINITY;
    for (index, one) in plan.iter().enumerate() {
        for other in &plan[..index] {
            let square: f64 = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
            least = least.min(square);
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latin_hypercube_has_one_point_in_each_part() {
        let plan = latin_hypercube(3, 20, 1);
        for dimension in 0..3 {
            let mut parts: Vec<usize> = plan
                .iter()
                .map(|row| (row[dimension] * 20.0) as usize)
                .collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..20).collect::<Vec<_>>());
        }
        assert_eq!(plan, latin_hypercube(3, 20, 1));
        assert_ne!(plan, latin_hypercube(3, 20, 2));
    }
}
