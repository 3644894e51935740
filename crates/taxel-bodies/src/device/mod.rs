//! Devices by finite elements of their drawings: predictors, and load paths as tables.

mod body;
mod in_plane_capacitor;
mod microchannel;
mod three_axis_capacitor;

use crate::mechanics::check_stack;
use crate::transduction::{
    NoTable, SolvedInPlane, TableOptions, tabulate_layers, tabulate_section,
};
use taxel::predict::Predictor;
use taxel::sensor::{Element, Sensor};
use taxel::transduction::PathTable;

pub use body::{solve_point, tabulate_body};
pub use in_plane_capacitor::{InPlaneFieldPrediction, InPlaneFieldPredictor};
pub use microchannel::{MicrochannelFieldPredictor, WholeTopPredictor};
pub use three_axis_capacitor::ThreeAxisFieldPredictor;

/// Why the mechanics of a device is not solved by finite elements.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotSolvable {
    /// No device of this kind is.
    #[error("this kind of device has no mechanics by finite elements; use --mechanics closed-form")]
    Kind,
    /// Its stiffness does not follow from its drawing.
    #[error(
        "suspension.stiffness is typed in, so that nothing is left to solve by finite elements\n\
         help: replace stiffness, tile_tilt and bump_sinking by a table suspension.from_drawing with the modulus of \
         the elastomer, or use --mechanics closed-form"
    )]
    TypedIn,
    /// Its stiffness is that of a calibration.
    #[error(
        "the stiffness is calibrated, so that nothing is left to solve by finite elements; use --mechanics closed-form, \
         or leave the calibration out"
    )]
    Calibrated,
    /// Finite elements do not solve its drawing.
    #[error("{0}")]
    Drawing(String),
}

/// Why the solved load path of a device is not tabulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotTabulated {
    /// Its closed form is what a table would have.
    #[error(
        "the closed form of this kind of device needs no table: there is no way to solve beforehand\n\
         help: leave mechanics out of the sensor file"
    )]
    ClosedForm,
    /// Finite elements do not solve its drawing.
    #[error("{0}")]
    Drawing(String),
    /// The solver.
    #[error(transparent)]
    NoTable(#[from] NoTable),
}

/// The predictor of a sensor by finite elements of its drawing; nothing is solved yet.
///
/// # Errors
/// [`NotSolvable`] for a device whose mechanics is not solved that way.
///
/// # Example: a pressure on all channels, in seconds
/// ```no_run
/// use taxel::predict::Loads;
/// let sensor = taxel::sensor::Sensor::shipped("liquid-metal-2x4").unwrap();
/// let mut predictor = taxel_bodies::field_predictor(&sensor).unwrap();
/// let loads = Loads::one("p=10 kPa", predictor.load_columns()).unwrap();
/// predictor.prepare(&loads, &mut |_| {}).unwrap();
/// let mut answer = Vec::new();
/// predictor.answer(&loads.load(0), &mut answer).unwrap();
/// ```
pub fn field_predictor(sensor: &Sensor) -> Result<Box<dyn Predictor>, NotSolvable> {
    let drawing = |error: &dyn std::fmt::Display| NotSolvable::Drawing(error.to_string());
    match &sensor.element {
        Element::ThreeAxisCapacitor(_) => {
            let array = sensor.three_axis().map_err(|error| drawing(&error))?;
            Ok(Box::new(ThreeAxisFieldPredictor::new(&array)?))
        }
        Element::InPlaneCapacitor(_) => {
            let array = sensor.in_plane().map_err(|error| drawing(&error))?;
            SolvedInPlane::check(&array.model()).map_err(|error| drawing(&error))?;
            Ok(Box::new(InPlaneFieldPredictor::new(&array)))
        }
        Element::Microchannel(_) => {
            let array = sensor.microchannels().map_err(|error| drawing(&error))?;
            let stack = array.void_stack().map_err(NotSolvable::Drawing)?;
            check_stack(&stack).map_err(|error| drawing(&error))?;
            Ok(Box::new(MicrochannelFieldPredictor::new(&array)))
        }
        _ => Err(NotSolvable::Kind),
    }
}

/// The way by finite elements of the drawing of a sensor as a table; `program` is what makes it,
/// `progress` hears the fraction.
///
/// # Errors
/// [`NotTabulated`] for a device that needs or has no such table, and what stops the solver.
pub fn tabulate(
    sensor: &Sensor,
    options: &TableOptions,
    program: &str,
    progress: &mut dyn FnMut(f64),
) -> Result<PathTable, NotTabulated> {
    match &sensor.element {
        Element::InPlaneCapacitor(element) => Ok(tabulate_section(
            &element.model(),
            options,
            program,
            progress,
        )?),
        Element::Microchannel(element) => {
            let layers = element.drawn_layers(sensor.array.pitch);
            let layers = layers.map_err(NotTabulated::Drawing)?;
            Ok(tabulate_layers(&layers, options, program, progress)?)
        }
        _ => Err(NotTabulated::ClosedForm),
    }
}
