//! Kind of a contact event by the two peaks of one element's signal (P3,
//! section 4.1).

/// Kind of an event that a high-pass signal shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// No peak.
    Nothing,
    /// One peak: a load that came and stays.
    Step,
    /// The peak of the unloading is the smaller one: a load that came and went.
    Impact,
    /// Two equal peaks: a load that comes and goes again and again.
    Cyclic,
}

/// A second peak below this share of the first is none: what a step leaves
/// after the end of its ramp is below it.
const NO_SECOND_PEAK: f64 = 0.05;
/// Peaks that differ by less than this share are equal: from the fourth cycle
/// on, with a leak of 0.25 s and 350 ms, they are.
const EQUAL: f64 = 0.02;

impl Event {
    /// The kind of an event with its peak `first` ≥ 0 in the direction of
    /// loading and `second` ≥ 0 in the other one, in any one unit.
    ///
    /// One peak: step; A1 > A2: impact; A1 = A2: cyclic. The first cycle of a
    /// cyclic load looks like an impact, as P3 says.
    ///
    /// ```
    /// use taxel::estimation::Event;
    /// assert_eq!(Event::of_peaks(1.0, 0.0), Event::Step);
    /// assert_eq!(Event::of_peaks(1.0, 0.55), Event::Impact);
    /// assert_eq!(Event::of_peaks(1.0, 0.995), Event::Cyclic);
    /// ```
    pub fn of_peaks(first: f64, second: f64) -> Self {
        let largest = first.max(second);
        // Not a number is no peak.
        if !(largest > 0.0 && largest.is_finite()) {
            Self::Nothing
        } else if second < NO_SECOND_PEAK * first {
            Self::Step
        } else if (first - second).abs() < EQUAL * largest {
            Self::Cyclic
        } else {
            Self::Impact
        }
    }

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Step => "step",
            Self::Impact => "impact",
            Self::Cyclic => "cyclic",
        }
    }
}
