//! Whether the readings at rest have moved over a reconnect.

use std::collections::VecDeque;

/// Frames before and after the reconnect that are compared.
const FRAMES: usize = 50;
/// A mean that moved by more than so many standard deviations of a reading has moved.
const DEVIATIONS: f64 = 5.0;

/// Remembers the last readings, and compares them with the first after a reconnect.
#[derive(Debug, Default)]
pub(crate) struct MovedRest {
    newest: VecDeque<Vec<f64>>,
    before: Option<Vec<[f64; 2]>>,
}

impl MovedRest {
    /// The link is open again.
    pub(crate) fn reconnected(&mut self) {
        if self.newest.len() == FRAMES {
            self.before = Some(mean_and_deviation(&self.newest));
        }
        self.newest.clear();
    }

    /// Takes the readings of a frame; advice once enough are there after a reconnect.
    pub(crate) fn push(&mut self, values: &[f64]) -> Option<String> {
        // The room of the oldest is used again.
        let mut room = match self.newest.len() {
            FRAMES => self.newest.pop_front().unwrap_or_default(),
            _ => Vec::with_capacity(values.len()),
        };
        room.clear();
        room.extend_from_slice(values);
        self.newest.push_back(room);
        if self.newest.len() < FRAMES {
            return None;
        }
        let before = self.before.take()?;
        let after = mean_and_deviation(&self.newest);
        let moved = before
            .iter()
            .zip(&after)
            .filter(|([then, spread], [now, spread_now])| {
                (now - then).abs() > DEVIATIONS * spread.max(*spread_now)
            })
            .count();
        (moved > 0).then(|| {
            format!(
                "the readings have moved over the reconnect: {moved} of {} channels by more than five standard deviations; the rest values are those from before; if nothing touches the sensor, tare",
                before.len()
            )
        })
    }
}

/// Mean and standard deviation of each channel.
fn mean_and_deviation(frames: &VecDeque<Vec<f64>>) -> Vec<[f64; 2]> {
    let channels = frames.front().map_or(0, Vec::len);
    let count = frames.len().max(2) as f64;
    let of = |channel: usize| {
        let values = || frames.iter().filter_map(|frame| frame.get(channel));
        let mean = values().sum::<f64>() / count;
        let squares: f64 = values().map(|value| (value - mean).powi(2)).sum();
        [mean, (squares / (count - 1.0)).sqrt()]
    };
    (0..channels).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advice after 60 frames about zero, a reconnect, and 60 about `rest`.
    fn advice(rest: f64) -> Vec<String> {
        let mut watched = MovedRest::default();
        let noise = |i: u32| f64::from(i % 7) - 3.0;
        let mut advice = Vec::new();
        for i in 0..60 {
            advice.extend(watched.push(&[noise(i), noise(i + 3)]));
        }
        watched.reconnected();
        for i in 0..60 {
            advice.extend(watched.push(&[noise(i), noise(i) + rest]));
        }
        advice
    }

    #[test]
    fn a_tare_is_advised_when_the_rest_has_moved() {
        // The standard deviation of the noise is 2.
        assert!(advice(9.0).is_empty());
        let found = advice(12.0);
        assert_eq!(found.len(), 1);
        assert!(found[0].contains("1 of 2 channels"), "{}", found[0]);
    }
}
