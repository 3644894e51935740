//! Latencies in a histogram of fixed size.

/// Counts of durations in logarithmic classes 2 % wide, from 0.1 us up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Latencies {
    classes: Vec<u64>,
    count: u64,
    /// Largest, ns.
    largest: u64,
}

const LEAST: f64 = 1e-7;
const WIDTH: f64 = 1.02;
/// Classes up to 100 s.
const CLASSES: usize = 1048;

impl Default for Latencies {
    fn default() -> Self {
        Self {
            classes: vec![0; CLASSES],
            count: 0,
            largest: 0,
        }
    }
}

impl Latencies {
    /// Counts one duration, s.
    pub fn push(&mut self, seconds: f64) {
        let class = (seconds.max(LEAST) / LEAST).ln() / WIDTH.ln();
        self.classes[(class as usize).min(CLASSES - 1)] += 1;
        self.count += 1;
        self.largest = self.largest.max((seconds * 1e9) as u64);
    }

    /// Number of counted values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Largest, s.
    pub fn largest(&self) -> f64 {
        self.largest as f64 * 1e-9
    }

    /// The duration, s, that a share of all stays below, to 2 %; zero without
    /// any.
    pub fn quantile(&self, share: f64) -> f64 {
        let wanted = (share * self.count as f64).ceil() as u64;
        let mut seen = 0;
        for (class, count) in self.classes.iter().enumerate() {
            seen += count;
            if seen >= wanted && seen > 0 {
                return (LEAST * WIDTH.powf(class as f64 + 1.0)).min(self.largest());
            }
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_to_two_percent() {
        let mut latencies = Latencies::default();
        (1..=1000).for_each(|i| latencies.push(f64::from(i) * 1e-5));
        for (share, expected) in [(0.5, 5e-3), (0.99, 9.9e-3), (1.0, 1e-2)] {
            assert!((latencies.quantile(share) / expected - 1.0).abs() < 0.02);
        }
        assert_eq!(Latencies::default().quantile(0.5), 0.0);
    }
}
