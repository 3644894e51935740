//! The test profiles of P3: how a load rises, stays and falls (figures 11-13).

use std::f64::consts::PI;

/// Form of a test load. All ramps are finite: a sudden displacement would give
/// an infinite force in the dashpot of the silicone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Profile {
    /// Up, and stays (figure 11).
    Step {
        /// Duration of the ramp, s.
        ramp: f64,
    },
    /// Up, stays for a time, and back (figure 12).
    Impact {
        /// Duration of each ramp, s.
        ramp: f64,
        /// Time at the top, s.
        dwell: f64,
    },
    /// Ramps up at the start and down at the middle of each period (figure 13).
    Cyclic {
        /// Duration of each ramp, s, at most half the period.
        ramp: f64,
        /// Period, s.
        period: f64,
        /// Number of periods.
        cycles: u32,
    },
    /// (1 − cos(2πt/T))/2 in place of ramps, as [`SINE_POINTS`] straight lines
    /// per period: 3e-5 of the amplitude from the sine.
    Sine {
        /// Period T, s.
        period: f64,
        /// Number of periods.
        cycles: u32,
    },
}

/// Straight lines in a period of [`Profile::Sine`].
pub const SINE_POINTS: u32 = 400;

impl Profile {
    /// Knots (time in s, value) of the load from rest at time 0, with the top
    /// at `amplitude`, in whatever unit that is.
    ///
    /// ```
    /// use taxel::mechanics::Profile;
    /// let impact = Profile::Impact { ramp: 0.25, dwell: 0.5 };
    /// assert_eq!(impact.knots(2.0), [[0.0, 0.0], [0.25, 2.0], [0.75, 2.0], [1.0, 0.0]]);
    /// ```
    pub fn knots(&self, amplitude: f64) -> Vec<[f64; 2]> {
        match *self {
            Self::Step { ramp } => vec![[0.0, 0.0], [ramp, amplitude]],
            Self::Impact { ramp, dwell } => vec![
                [0.0, 0.0],
                [ramp, amplitude],
                [ramp + dwell, amplitude],
                [2.0 * ramp + dwell, 0.0],
            ],
            Self::Cyclic {
                ramp,
                period,
                cycles,
            } => (0..cycles)
                .flat_map(|cycle| {
                    let (start, middle) = (f64::from(cycle), f64::from(cycle) + 0.5);
                    [
                        [start * period, 0.0],
                        [start * period + ramp, amplitude],
                        [middle * period, amplitude],
                        [middle * period + ramp, 0.0],
                    ]
                })
                .collect(),
            Self::Sine { period, cycles } => (0..=cycles * SINE_POINTS)
                .map(|i| {
                    let turns = f64::from(i) / f64::from(SINE_POINTS);
                    let height = 0.5 * (1.0 - (2.0 * PI * turns).cos());
                    [turns * period, amplitude * height]
                })
                .collect(),
        }
    }
}
