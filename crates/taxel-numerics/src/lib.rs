//! Numerics that taxel's crates share: nonlinear least squares that say what the
//! data do not determine, linear chains solved exactly, special functions, roots,
//! tables and small dense algebra.
//!
//! Nothing here knows a sensor. Angles are in rad, times in s; everything else
//! carries the caller's units.
//!
//! # Example: a charge amplifier that forgets a held load
//! ```
//! use taxel_numerics::linear_chain::{Chain, Transfer};
//!
//! // 2 V per unit of charge, time constant 0.25 s.
//! let amplifier = Chain::new(&Transfer::high_pass(2.0, 0.25))?;
//! // A load that rises within 1 ms and stays: pairs of time and charge.
//! let load = [[0.0, 0.0], [1e-3, 1.0]];
//! let volts = amplifier.respond(&load, &[1e-3, 0.25, 2.5]);
//! assert!((volts[0] - 2.0).abs() < 0.01);
//! assert!((volts[1] - 2.0 * f64::exp(-1.0)).abs() < 0.01);
//! assert!(volts[2].abs() < 1e-3);
//! # Ok::<(), taxel_numerics::linear_chain::ChainError>(())
//! ```
//!
//! # Example: a decay with its uncertainty
//! ```
//! use taxel_numerics::least_squares::{FitOptions, Parameter, Problem, fit};
//!
//! struct Decay {
//!     times: Vec<f64>,
//!     values: Vec<f64>,
//!     deviation: f64,
//! }
//!
//! impl Problem for Decay {
//!     fn readings(&self) -> usize {
//!         self.times.len()
//!     }
//!
//!     fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
//!         for (i, residual) in residuals.iter_mut().enumerate() {
//!             let model = at[0] * (-at[1] * self.times[i]).exp();
//!             *residual = (self.values[i] - model) / self.deviation;
//!         }
//!         true
//!     }
//! }
//!
//! let decay = Decay {
//!     times: vec![0.0, 1.0, 2.0, 3.0],
//!     values: vec![2.01, 1.20, 0.74, 0.45],
//!     deviation: 0.01,
//! };
//! let parameters = [Parameter::new("amplitude", 1.0), Parameter::new("rate", 1.0)];
//! let found = fit(&decay, &parameters, &FitOptions::default())?;
//! assert!((found.estimates[1].value - 0.5).abs() < 0.02);
//! # Ok::<(), taxel_numerics::least_squares::FitError>(())
//! ```

mod bicgstab;
pub mod dense;
mod kriging;
pub mod least_squares;
pub mod linear_chain;
mod monotone_curve;
mod noise;
pub mod play;
pub mod roots;
mod sobol;
pub mod special;
mod split_mix;
pub mod table;

pub use bicgstab::bicgstab;
pub use kriging::{Answer, Kriging};
pub use monotone_curve::{CurveError, MonotoneCurve, OnCurve};
pub use noise::Noise;
pub use sobol::{SOBOL_DIMENSIONS, sobol};
pub use split_mix::split_mix;
