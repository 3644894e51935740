//! P2: the three-axis capacitive array.

use super::Ledger;

pub(super) fn fill(_ledger: &mut Ledger) {}
