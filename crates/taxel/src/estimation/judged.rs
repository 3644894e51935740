//! Why a sum over taxels is exact, a least one, or not known.

use super::certainty::Certainty;
use super::touch::{State, TaxelTouch};

/// How much a sum over taxels says, and why.
///
/// A sum is exact while all that may carry force is part of it with a value. A taxel that gives a
/// bound, and one that is left out whatever its state, may carry more. Where nothing pulls the sum
/// is then a least one; a device that shows tension too says nothing. Masked taxels of a device are
/// left out too: something may press there. Only cells that a map does not have carry nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Judged {
    pub(super) certainty: Certainty,
    pub(super) reason: Option<State>,
}

impl Judged {
    /// One that is no more than `certainty` because of `state`: the worse one counts, and of two
    /// that are alike the first, but a fault before a mask.
    pub(super) fn limit(&mut self, certainty: Certainty, state: State) {
        let masked = self.reason == Some(State::Masked);
        if certainty > self.certainty || certainty == self.certainty && masked {
            (self.certainty, self.reason) = (certainty, Some(state));
        }
    }

    /// Takes what a taxel of a device, on which something `pulls` or not, adds.
    pub(super) fn add(&mut self, taxel: &TaxelTouch, pulls: bool) {
        let least = match (taxel.counted, taxel.state) {
            // A reading at its low end bounds from above.
            (true, State::Saturated) => taxel.pressed() > 0.0,
            (true, state) if state.is_bound() => !pulls || taxel.pressed() > 0.0,
            (true, State::BelowZero) | (false, _) => !pulls,
            (true, _) => return,
        };
        let certainty = if least {
            Certainty::AtLeast
        } else {
            Certainty::Unknown
        };
        self.limit(certainty, taxel.state);
    }
}
