//! Which devices can be calibrated: a device is added here.

use taxel::sensor::{Element, Sensor};

use crate::cells::{self, CellsCalibrator};
use crate::driver::Calibrator;
use crate::in_plane_capacitor::{self, InPlaneCalibrator};
use crate::microchannel::{self, MicrochannelCalibrator};
use crate::options::NamedSensor;
use crate::piezoelectric::{self, PiezoelectricCalibrator};
use crate::three_axis_capacitor::{self, ThreeAxisCalibrator};

/// Sensors that cannot be calibrated together from readings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoCalibrator {
    /// Not this kind.
    #[error("a {element} of this sensor file cannot be calibrated from readings")]
    Kind {
        /// Key of the element.
        element: &'static str,
    },
    /// No load on a whole channel is read.
    #[error(
        "element.microchannel.liquid.pressure: a sealed liquid carries what presses on the whole length of a channel, whose \
         resistance then says nothing of the load; calibrate with pressure = \"vented\", a gas ({{ paper = … }}) or measured points"
    )]
    Unanswered,
    /// Learned, not fitted.
    #[error(
        "an array with the element `{element}` has no physical model and no synthetic calibration data; train it alone with `taxel calibrate`"
    )]
    Learned {
        /// Key of the element.
        element: &'static str,
    },
    /// Nothing to fit.
    #[error(
        "there is nothing to calibrate: the board of an array with the element `{element}` gives forces already; `taxel live SENSOR` takes their zero at its start, scale and noise stand in electronics.readout.measured"
    )]
    Measured {
        /// Key of the element.
        element: &'static str,
    },
    /// The sensors are not of one kind.
    #[error("{name} is a {element}, the others are not; calibrate them apart")]
    Mixed {
        /// The first one that differs.
        name: String,
        /// Key of its element.
        element: &'static str,
    },
    /// One sensor at a time.
    #[error("a {element} is calibrated alone: give the readings of each sensor a table of its own")]
    Alone {
        /// Key of the element.
        element: &'static str,
    },
    /// There is none.
    #[error("there is no sensor to calibrate")]
    None,
}

/// The calibrator of these sensors together.
///
/// # Errors
/// [`NoCalibrator`].
pub fn calibrator<'a>(
    sensors: &'a [NamedSensor<'a>],
) -> Result<Box<dyn Calibrator + 'a>, NoCalibrator> {
    let first = sensors.first().ok_or(NoCalibrator::None)?;
    let element = first.sensor.element.key();
    if let Some(other) = sensors
        .iter()
        .find(|other| other.sensor.element.key() != element)
    {
        return Err(NoCalibrator::Mixed {
            name: other.name.to_owned(),
            element: other.sensor.element.key(),
        });
    }
    match first.sensor.element {
        Element::InPlaneCapacitor(_) => boxed(InPlaneCalibrator::new(sensors), element),
        Element::ThreeAxisCapacitor(_)
        | Element::Piezoelectric(_)
        | Element::Cells(_)
        | Element::MagneticSkin(_)
        | Element::Body(_)
            if sensors.len() > 1 =>
        {
            Err(NoCalibrator::Alone { element })
        }
        Element::ThreeAxisCapacitor(_) => boxed(ThreeAxisCalibrator::new(first), element),
        Element::Piezoelectric(_) => boxed(PiezoelectricCalibrator::new(first), element),
        Element::Trained(_) => Err(NoCalibrator::Learned { element }),
        Element::Microchannel(_) => match MicrochannelCalibrator::new(sensors) {
            Some(calibrator) => Ok(Box::new(calibrator)),
            None => Err(NoCalibrator::Unanswered),
        },
        Element::MeasuredForce(_) => Err(NoCalibrator::Measured { element }),
        Element::Cells(_) | Element::MagneticSkin(_) | Element::Body(_) => {
            boxed(CellsCalibrator::new(first), element)
        }
        Element::Own(_) => Err(NoCalibrator::Kind { element }),
    }
}

fn boxed<'a>(
    calibrator: Option<impl Calibrator + 'a>,
    element: &'static str,
) -> Result<Box<dyn Calibrator + 'a>, NoCalibrator> {
    match calibrator {
        Some(calibrator) => Ok(Box::new(calibrator)),
        None => Err(NoCalibrator::Kind { element }),
    }
}

/// Puts calibrated values in the place of a sensor file's constants.
///
/// # Errors
/// The name of a parameter that is missing.
pub(crate) fn apply(
    sensor: &mut Sensor,
    model: &str,
    prefix: &str,
    value: &dyn Fn(&str) -> Option<f64>,
) -> Result<(), String> {
    match sensor.element {
        Element::InPlaneCapacitor(_) => in_plane_capacitor::apply(sensor, model, prefix, value),
        Element::ThreeAxisCapacitor(_) => three_axis_capacitor::apply(sensor, prefix, value),
        Element::Piezoelectric(_) => piezoelectric::apply(sensor, prefix, value),
        Element::Microchannel(_) => microchannel::apply(sensor, value),
        Element::Cells(_) | Element::MagneticSkin(_) | Element::Body(_) => {
            cells::apply(sensor, value)
        }
        // The maps of one are tables, and no parameters; the others have none.
        Element::Trained(_) | Element::MeasuredForce(_) | Element::Own(_) => Ok(()),
    }
}

/// Columns of the answers of `taxel predict` that get a standard deviation.
pub(crate) fn uncertain(sensor: &Sensor) -> &'static [&'static str] {
    match sensor.element {
        Element::InPlaneCapacitor(_) => &["force_z", "capacitance"],
        Element::ThreeAxisCapacitor(_) => &[
            "capacitance_11",
            "capacitance_12",
            "capacitance_21",
            "capacitance_22",
        ],
        Element::Piezoelectric(_) => &["a1", "a2", "a1_plus_a2"],
        Element::Microchannel(_) => &microchannel::UNCERTAIN,
        Element::Cells(_) => &["conductance", "port_pressure"],
        Element::MagneticSkin(_) => &["magnet_x", "magnet_y", "magnet_z"],
        Element::Body(_) => &["depth"],
        Element::Trained(_) | Element::MeasuredForce(_) | Element::Own(_) => &[],
    }
}
