//! From a test of rubber, or its hardness, to a law that says how well it is known and what
//! its test cannot know. Files of tests to laws, and laws by name or file in the descriptions of
//! sensors and problems; it knows no sensor and opens no file.
//!
//! The order of work: [`read`] a file, take out what is no loading of the material
//! ([`prepare`]), fit laws ([`fits`]), [`choose`] among them.
//!
//! # Example
//! ```
//! use taxel_material::{Mode, Steps, choose, prepare, read};
//!
//! // A neo-Hookean pull of 100 kPa.
//! let rows = (1..=20).map(|n| {
//!     let l = 1.0 + 0.05 * f64::from(n);
//!     format!("{},{}\n", l - 1.0, 100.0 * (l - l.powi(-2)))
//! });
//! let text = format!("strain [1],stress [kPa]\n{}", rows.collect::<String>());
//! let test = read("pull.csv", &text, None)?;
//! assert_eq!(test.mode, Mode::Uniaxial);
//! let (tests, _) = prepare(&[test], &Steps::default())?;
//! let choice = choose(&tests, &Default::default())?;
//! let chosen = choice.chosen().expect("a law that holds");
//! assert!((chosen.shear_modulus - 100e3).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod answer;
mod choose;
mod file;
mod fit;
mod hardness;
mod interval;
mod law;
mod library;
mod material;
mod minimum;
mod named;
mod relaxation;
mod stability;
mod steps;

pub use choose::{Candidate, Choice, Options, choose};
pub use file::{Test, read};
pub use fit::{
    Fit, FitError, Form, MOST_TERMS, Measure, Slack, Weights, fits, profile, with_interval,
};
pub use hardness::{Hardness, HardnessError, Scale};
pub use interval::{SpecimenInterval, specimens};
pub use law::{Law, LawError, Mode};
pub use library::{all, named, near};
pub use material::{Material, Part, Relaxation, Tested};
pub use named::{Used, parse_problem, parse_sensor, schema, unread_files, used, with_file};
pub use relaxation::{
    Held, RelaxationError, RelaxationFit, constant_rate, creep, relaxation_of_creep, relaxed,
};
pub use stability::{Loss, SANE, equibiaxial_ratio, first_loss};
pub use steps::{Cycle, FEWEST, Specimen, Steps, prepare};
