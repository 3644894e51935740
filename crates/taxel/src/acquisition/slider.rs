//! A wavy slider: ridges that move along a line.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Patch;
use crate::quantity::{
    self, AnyLength, Checked, NonNegativeTime, PositiveForce, PositiveLength, PositiveSpeed,
};

/// A part with a wavy surface that is pulled over the array (P3, figure 21):
/// round ridges one wavelength apart, the first one at `from` at the start.
///
/// A ridge presses from `from` to `to`; within one radius of both ends it
/// comes down and lifts off along a straight line.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Slider {
    /// Distance between the ridges, m; longer than the way is a single ridge.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub wavelength: f64,
    /// Speed, m/s.
    #[serde(deserialize_with = "quantity::one::<PositiveSpeed, _>")]
    #[schemars(with = "Checked<PositiveSpeed>")]
    pub speed: f64,
    /// Pressing force of one ridge, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub amplitude: f64,
    /// Radius of the contact of a ridge, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub radius: f64,
    /// When the first ridge comes down, s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub start: f64,
    /// Start of the way on the developed surface [x, y], m.
    #[serde(deserialize_with = "quantity::list::<2, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 2]")]
    pub from: [f64; 2],
    /// End of the way, m.
    #[serde(deserialize_with = "quantity::list::<2, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 2]")]
    pub to: [f64; 2],
}

/// Most ridges that press at once.
const MOST_RIDGES: f64 = 100.0;

impl Slider {
    /// Length of the way, m.
    fn length(&self) -> f64 {
        (self.to[0] - self.from[0]).hypot(self.to[1] - self.from[1])
    }

    /// When the first ridge leaves, s.
    pub(super) fn end(&self) -> f64 {
        self.start + self.length() / self.speed
    }

    /// Mistake in it: the key, the message and what to do.
    pub(super) fn mistake(&self, duration: f64) -> Option<(&'static str, String, &'static str)> {
        let length = self.length();
        if length < 2.0 * self.radius {
            let message = format!(
                "a way of {} mm is shorter than the contact of a ridge",
                length * 1e3
            );
            return Some(("to", message, "give a longer way or a smaller radius"));
        }
        if length > MOST_RIDGES * self.wavelength {
            let message = format!("more than {MOST_RIDGES} ridges would press at once");
            return Some(("wavelength", message, "give a longer wavelength"));
        }
        (self.end() > duration).then(|| {
            let message = format!(
                "the first ridge arrives at {} s, after the end of the script, {duration} s",
                self.end()
            );
            (
                "speed",
                message,
                "make the duration longer or the slider faster",
            )
        })
    }

    /// The ridges that press at `time` of the script, s.
    pub(super) fn ridges(&self, time: f64) -> impl Iterator<Item = Patch> {
        let (length, travelled) = (self.length(), self.speed * (time - self.start));
        let ridge = move |index: usize| travelled - index as f64 * self.wavelength;
        let first = ((travelled - length) / self.wavelength).ceil().max(0.0) as usize;
        (first..)
            .map(ridge)
            .take_while(|way| *way > 0.0)
            .map(move |way| Patch {
                centre: std::array::from_fn(|axis| {
                    self.from[axis] + (self.to[axis] - self.from[axis]) * way / length
                }),
                radius: self.radius,
                force: [0.0, 0.0, self.amplitude * self.ease(way.min(length - way))],
            })
    }

    /// Share of the force at a distance from the nearer end.
    fn ease(&self, distance: f64) -> f64 {
        (distance / self.radius).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slider() -> Slider {
        Slider {
            wavelength: 5e-3,
            speed: 10e-3,
            amplitude: 0.4,
            radius: 1e-3,
            start: 1.0,
            from: [-10e-3, 0.0],
            to: [10e-3, 0.0],
        }
    }

    #[test]
    fn ridges_follow_each_other_and_end_with_the_way() {
        let slider = slider();
        let places = |time: f64| -> Vec<f64> {
            slider
                .ridges(time)
                .map(|ridge| ridge.centre[0] * 1e3)
                .collect()
        };
        assert!(places(0.9).is_empty());
        let near = |found: Vec<f64>, expected: &[f64]| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            for (found, expected) in found.iter().zip(expected) {
                // Rounding of millimetres.
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
        };
        near(places(1.2), &[-8.0]);
        near(places(2.2), &[2.0, -3.0, -8.0]);
        near(places(3.2), &[7.0, 2.0, -3.0, -8.0]);
    }

    #[test]
    fn a_ridge_comes_down_within_its_radius() {
        let force = |time| slider().ridges(time).next().map(|ridge| ridge.force[2]);
        assert_eq!(force(1.0), None);
        // Half a radius of way.
        assert!((force(1.05).unwrap() - 0.2).abs() < 1e-12);
        assert!((force(1.5).unwrap() - 0.4).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_is_named() {
        assert_eq!(slider().mistake(3.0), None);
        assert_eq!(slider().mistake(2.9).unwrap().0, "speed");
        let mut short = slider();
        short.to = [-9e-3, 0.0];
        assert_eq!(short.mistake(3.0).unwrap().0, "to");
        let mut fine = slider();
        fine.wavelength = 1e-4;
        assert_eq!(fine.mistake(3.0).unwrap().0, "wavelength");
    }
}
