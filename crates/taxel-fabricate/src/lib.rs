//! From the drawing of a sensor to what a workshop needs: masks, moulds, a bill of layers.
//!
//! [`Plan::of`] reads a sensor and says what can be drawn of it, and what cannot because the sensor
//! file does not say it. [`files`] writes the plan: masks as DXF R12 and GDSII, moulds as binary
//! STL, the bill as CSV and the dimensioned drawing as SVG. Nothing is opened here: a file is its
//! name and its bytes.
//!
//! # Example
//! ```
//! use taxel::sensor::Sensor;
//! use taxel_fabricate::{Options, Plan, files};
//!
//! let sensor = Sensor::shipped("in-plane-50um").unwrap();
//! let plan = Plan::of(&sensor)?;
//! let electrodes = &plan.masks[0];
//! // Two electrodes of 1 mm x 10 mm, m².
//! assert!((electrodes.area() - 2.0 * 1e-3 * 10e-3).abs() < 1e-15);
//! assert!(plan.missing.iter().any(|what| what.contains("leads")));
//! let names: Vec<_> = files(&plan, &Options::default(), "taxel")?.into_iter().map(|file| file.name).collect();
//! assert_eq!(names, ["masks.dxf", "masks.gds", "mould-tray.stl", "layers.csv", "drawing.svg"]);
//! # Ok::<(), taxel_fabricate::Refused>(())
//! ```

mod bill;
mod devices;
mod dxf;
mod error;
mod figures;
mod gds;
mod mask;
mod options;
mod plan;
mod rectangle;
mod relief;
mod stl;
mod text;
mod write;

pub use bill::{Layer, bill};
pub use error::Refused;
pub use mask::{Mask, Mould};
pub use options::{Options, Polarity};
pub use plan::Plan;
pub use rectangle::Rectangle;
pub use relief::{Mesh, Relief};
pub use write::{File, files};
