//! Electric fields in deformed bodies, and load paths by finite elements.

mod edge_section;
pub mod electrode_section;
mod in_plane_field;
mod in_plane_path;
mod microchannel_path;
mod path_solution;
mod response_solution;
mod section_solution;
mod solved_edges;

pub use edge_section::EdgeSection;
pub use in_plane_field::{FieldState, NoField, SolvedInPlane};
pub use in_plane_path::tabulate_section;
pub use microchannel_path::tabulate_layers;
pub use path_solution::{Leaps, NoTable, TableOptions};
pub(crate) use response_solution::{Batch, tabulate as solve_response};
pub use response_solution::{NoPoints, NoResponse, PointAnswer, PointEnd, Points, ResponseOptions};
pub(crate) use section_solution::solve_section;
pub(crate) use solved_edges::solve_edges;
