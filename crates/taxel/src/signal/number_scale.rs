//! Numbers of a frame to the quantity that a board reads.

/// The numbers of a frame beside the input of the last stage: input = `at_zero` +
/// `per_number` x number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberScale {
    /// Input at the number zero, SI.
    pub at_zero: f64,
    /// Input per number, SI.
    pub per_number: f64,
    /// Numbers at or beyond these say nothing but "outside".
    pub ends: [f64; 2],
    /// Step of the numbers: of an instrument the largest one that its noise allows; zero
    /// where it is not known.
    pub step: f64,
}

/// Where a number of a frame lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Position {
    /// Between the ends of the range.
    Inside,
    /// No number, or one at the low end, where a line without signal reads.
    Dead,
    /// At an end of the range that a signal reaches.
    AtEnd,
}

impl NumberScale {
    /// Frames that carry the values themselves, without known ends.
    pub const VALUES: Self = Self {
        at_zero: 0.0,
        per_number: 1.0,
        ends: [f64::NEG_INFINITY, f64::INFINITY],
        step: 0.0,
    };

    /// Input that reads as `number`, SI.
    pub fn input(&self, number: f64) -> f64 {
        self.at_zero + self.per_number * number
    }

    /// The number that `input`, SI, reads as, without ends and steps.
    pub fn number(&self, input: f64) -> f64 {
        (input - self.at_zero) / self.per_number
    }

    /// Where `number` lies.
    pub fn position(&self, number: f64) -> Position {
        let [low, high] = self.ends;
        if number > low && number < high {
            Position::Inside
        } else if number >= high || (self.is_signed() && number <= low) {
            Position::AtEnd
        } else {
            Position::Dead
        }
    }

    /// The range in which a channel is neither dead nor at an end: of a signed quantity
    /// nothing is dead at the low end.
    pub fn alive(&self) -> [f64; 2] {
        let [low, high] = self.ends;
        [
            if self.is_signed() {
                f64::NEG_INFINITY
            } else {
                low
            },
            high,
        ]
    }

    /// True if the low end is below zero: a signal may reach it, a dead line does not.
    fn is_signed(&self) -> bool {
        self.ends[0] < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instrument(range: [f64; 2]) -> NumberScale {
        NumberScale {
            ends: range,
            ..NumberScale::VALUES
        }
    }

    #[test]
    fn a_line_is_dead_at_the_low_end_only_where_no_signal_is_below_zero() {
        let plain = instrument([0.0, 1.0]);
        let signed = instrument([-1.0, 1.0]);
        for (scale, number, position) in [
            (plain, 0.5, Position::Inside),
            (plain, 0.0, Position::Dead),
            (plain, 1.0, Position::AtEnd),
            (plain, 7.0, Position::AtEnd),
            (plain, f64::NAN, Position::Dead),
            (signed, 0.0, Position::Inside),
            (signed, -1.0, Position::AtEnd),
            (signed, -7.0, Position::AtEnd),
            (signed, 1.0, Position::AtEnd),
            (signed, f64::NAN, Position::Dead),
        ] {
            assert_eq!(scale.position(number), position, "{scale:?} {number}");
        }
    }
}
