//! Soft solids at large strain, and the electric fields in their deformed shape.
//!
//! The way of a solution: [`mesh`] and [`material`] make a problem with supports,
//! loads and contact; Newton's method finds the deformed shape step by step; static
//! fields are then read off that shape.
//!
//! # Example: a block of rubber between two plates
//! ```
//! # use taxel_fem::mesh::{Axis, Grid2};
//! # use taxel_fem::material::{Law, Material};
//! # use taxel_fem::problem::{Kinematics, Motion, Problem, Rule};
//! # use taxel_fem::solver::newton::{Continue, Solver};
//! let axes = [Axis::uniform(0.0, 20e-3, 8)?, Axis::uniform(0.0, 10e-3, 4)?]; // m
//! let mut mesh = Grid2::new(axes, "rubber").mesh()?;
//! mesh.name_boundary("below", |[_, y, _]| y < 1e-9);
//! mesh.name_boundary("above", |[_, y, _]| y > 10e-3 - 1e-9);
//! let mut block = Problem::new(mesh, Kinematics::PlaneStrain)?;
//! let rubber = Law::MooneyRivlin { c10: 75.5e3, c01: 5.7e3 }; // Pa
//! block.materials.push(Material::incompressible(rubber));
//! block.clamp("below")?;
//! block.support("above", 0, Motion::Fixed)?;
//! let travel = block.parameter("travel", Rule::Given);
//! block.support("above", 1, Motion::Driven(travel, -1.0))?;
//! let mut solver = Solver::new(block)?;
//! solver.load_to(&[1e-3], |_, _| Continue::Yes)?; // compressed by 1 mm
//! assert!(solver.evaluate()?.along[0] > 0.0); // force that does the work, N per metre of depth
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Laws and kernels run inside loops that are compiled for the widest registers of
// the machine at hand: what is not inlined there runs at the narrowest.
#![allow(clippy::inline_always)]
// Tensors read best with the indices of their equations.
#![allow(clippy::needless_range_loop)]
// Tabulated points keep the digits of their source.
#![allow(clippy::excessive_precision)]
// Numbers of nodes, cells and dimensions are far below 2^31.
#![allow(clippy::cast_possible_wrap)]

pub mod assembly;
pub mod field;
pub mod material;
pub mod mesh;
pub mod output;
pub mod problem;
pub mod scalar;
pub mod solver;
pub mod sparse;
pub mod study;
pub mod verify;

/// Version of the solver: a solution that is kept says which one found it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
