//! Outputs to other programs; each is a subscriber of the same messages as the page.

mod datagrams;
mod frame;
mod lines;
mod lsl;
mod lsl_query;
mod osc;
mod output;
mod plot_juggler;
mod sink;
mod table;
mod tcp;

pub(crate) use frame::{Columns, ContactOfFrame, FrameMessage};
pub(crate) use output::Outlet;
pub use output::{LineOutput, LineOutputError, LineSummary};
pub use sink::LineFormat;
pub use table::TouchTable;
pub(crate) use table::{Rows, TableWriter};
