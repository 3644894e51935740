//! Outputs to other programs; each is a subscriber of the same messages as the page.

mod frame;
mod lines;

pub(crate) use lines::Lines;
pub use lines::{LineFormat, LineOutput, LineOutputError, LineSummary};
