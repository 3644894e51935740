//! Outputs to other programs; each is a subscriber of the same messages as the page.

mod frame;
mod lines;
mod table;

pub(crate) use lines::Lines;
pub use lines::{LineFormat, LineOutput, LineOutputError, LineSummary};
pub use table::TouchTable;
pub(crate) use table::{Rows, TableWriter};
