//! From a sensor file to the device that it describes.

use taxel_material::Material;

use crate::InputError;

use super::{
    ChainDevice, Device, InPlaneArray, MeasuredForceArray, MicrochannelArray, PiezoelectricArray,
    ThreeAxisArray, TrainedArray, check_masked_channels,
};
use crate::quantity::{CAPACITANCE, CHARGE, Dimension, FORCE, RESISTANCE, STRESS, VOLTAGE};
use crate::sensor::{Broken, Element, Sensor, Unreadable, check_instrument, check_keys};
use crate::solutions::{Solutions, TablesOnly};

impl Sensor {
    /// Reads a sensor file; `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake, with its place, key path, allowed range and unit.
    ///
    /// # Example
    /// ```
    /// # let text = taxel::sensor::Sensor::shipped_text("three-axis-8x8").unwrap();
    /// let sensor = taxel::sensor::Sensor::parse("three-axis-8x8.toml", text)?;
    /// assert_eq!(sensor.array.rows, 8);
    /// # Ok::<(), taxel::InputError>(())
    /// ```
    ///
    /// # Example: a wrong unit is shown under the very word
    /// ```
    /// # let text = taxel::sensor::Sensor::shipped_text("three-axis-8x8").unwrap();
    /// let text = text.replace("pitch = \"2 mm\"", "pitch = \"2 mN\"");
    /// let error = taxel::sensor::Sensor::parse("bad.toml", &text).unwrap_err();
    /// assert_eq!(error.key, "array.pitch");
    /// assert!(error.to_string().contains("\"mN\" is a unit of force; a length is needed here"));
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        Self::parse_with(file, text, &mut TablesOnly)
    }

    /// Reads a sensor file; what its drawing needs and no shipped table has comes from
    /// `solutions`.
    ///
    /// # Errors
    /// As [`Self::parse`], and a drawing that has no solution.
    ///
    /// `taxel_bodies::Afresh` solves it by finite elements.
    pub fn parse_with(
        file: &str,
        text: &str,
        solutions: &mut dyn Solutions,
    ) -> Result<Self, InputError> {
        Self::drawn(file, text)?.sound(file, text, solutions)
    }

    /// The sensor with what is solved of its drawing, if no rule between keys is broken.
    pub(crate) fn sound(
        mut self,
        file: &str,
        text: &str,
        solutions: &mut dyn Solutions,
    ) -> Result<Self, InputError> {
        let sound = check_keys(&self)
            .and_then(|()| self.check_lengths())
            .and_then(|()| self.check_board())
            .and_then(|()| self.solve(solutions))
            .and_then(|()| self.check_element());
        sound.map_err(|broken| broken.at(file, text))?;
        Ok(self)
    }

    /// Reads the keys of a sensor file and nothing that follows from several of them: what
    /// was drawn, whether or not it can work.
    ///
    /// # Errors
    /// The first mistake of one key.
    pub fn drawn(file: &str, text: &str) -> Result<Self, InputError> {
        taxel_material::parse_sensor(file, text, &|_| 1.0)
    }

    /// Reads a sensor file as [`Self::parse_with`], of a piece whose materials have `factor` times the
    /// moduli of their laws.
    ///
    /// # Errors
    /// As [`Self::parse_with`].
    pub fn made_of(
        file: &str,
        text: &str,
        factor: &dyn Fn(&Material) -> f64,
        solutions: &mut dyn Solutions,
    ) -> Result<Self, InputError> {
        let drawn: Self = taxel_material::parse_sensor(file, text, factor)?;
        drawn.sound(file, text, solutions)
    }

    /// Rules of the board of an element that is solved, as far as they need no solution: nobody waits
    /// half a minute for the mistake of an amplifier.
    fn check_board(&self) -> Result<(), Broken> {
        match &self.element {
            Element::ThreeAxisCapacitor(_) => self
                .three_axis()
                .map(|array| check_instrument(self).and_then(|()| array.check_board())),
            Element::InPlaneCapacitor(_) => self
                .in_plane()
                .map(|array| check_instrument(self).and_then(|()| array.check_board())),
            _ => Ok(Ok(())),
        }
        .unwrap_or_else(|unreadable| Err(of_unreadable(&unreadable)))
    }

    /// Rules of the element, which know the board that reads it.
    fn check_element(&self) -> Result<(), Broken> {
        let device = self
            .device()
            .map_err(|unreadable| of_unreadable(&unreadable))?;
        check_instrument(self)?;
        device.check()?;
        check_masked_channels(self, device.as_ref())
    }

    /// Device of this sensor.
    ///
    /// # Errors
    /// [`Unreadable`] when the board cannot read the element; never after
    /// [`Self::parse`].
    pub fn device(&self) -> Result<Box<dyn Device + '_>, Unreadable> {
        match &self.element {
            Element::ThreeAxisCapacitor(_) => Ok(Box::new(self.three_axis()?)),
            Element::InPlaneCapacitor(_) => Ok(Box::new(self.in_plane()?)),
            Element::Piezoelectric(_) => Ok(Box::new(self.piezoelectric()?)),
            Element::Microchannel(_) => Ok(Box::new(self.microchannels()?)),
            Element::Trained(_) => Ok(Box::new(self.trained()?)),
            Element::MeasuredForce(_) => Ok(Box::new(self.measured_force()?)),
            Element::Cells(_) | Element::MagneticSkin(_) | Element::Body(_) | Element::Own(_) => {
                Ok(Box::new(self.cells()?))
            }
        }
    }

    /// The array of three-axis units with its board, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn three_axis(&self) -> Result<ThreeAxisArray<'_>, Unreadable> {
        let Element::ThreeAxisCapacitor(element) = &self.element else {
            return Err(self.unreadable(&CAPACITOR));
        };
        ThreeAxisArray::new(self, element).ok_or_else(|| self.unreadable(&CAPACITOR))
    }

    /// The array of piezoelectric elements with its board, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn piezoelectric(&self) -> Result<PiezoelectricArray<'_>, Unreadable> {
        let Element::Piezoelectric(element) = &self.element else {
            return Err(self.unreadable(&PIEZOELECTRIC));
        };
        PiezoelectricArray::new(self, element).ok_or_else(|| self.unreadable(&PIEZOELECTRIC))
    }

    /// The array of in-plane capacitors with its board, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn in_plane(&self) -> Result<InPlaneArray<'_>, Unreadable> {
        let Element::InPlaneCapacitor(element) = &self.element else {
            return Err(self.unreadable(&CAPACITOR));
        };
        InPlaneArray::new(self, element).ok_or_else(|| self.unreadable(&CAPACITOR))
    }

    /// The crossing microchannels with their board, if it is such an array.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn microchannels(&self) -> Result<MicrochannelArray<'_>, Unreadable> {
        let Element::Microchannel(element) = &self.element else {
            return Err(self.unreadable(&MICROCHANNEL));
        };
        MicrochannelArray::new(self, element).ok_or_else(|| self.unreadable(&MICROCHANNEL))
    }

    /// The body whose channels are learned, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn trained(&self) -> Result<TrainedArray<'_>, Unreadable> {
        let Element::Trained(element) = &self.element else {
            return Err(self.unreadable(&TRAINED));
        };
        TrainedArray::new(self, element).ok_or_else(|| self.unreadable(&TRAINED))
    }

    /// The array of taxels whose board gives forces, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn measured_force(&self) -> Result<MeasuredForceArray<'_>, Unreadable> {
        let Element::MeasuredForce(element) = &self.element else {
            return Err(self.unreadable(&FORCE_BOARD));
        };
        MeasuredForceArray::new(self, element).ok_or_else(|| self.unreadable(&FORCE_BOARD))
    }

    /// The array as a chain of stages, if it is one: cells, a magnetic skin, a body or a user's own.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn cells(&self) -> Result<ChainDevice<'_>, Unreadable> {
        let (parts, fabrication) = match &self.element {
            Element::Cells(cells) => {
                let stated = cells.fabrication.iter();
                let lines = [self.array.rows, self.array.columns];
                let parts = cells.parts(lines, self.electronics.reference());
                (
                    parts,
                    stated
                        .map(|(name, share)| (name.clone(), share.0))
                        .collect(),
                )
            }
            Element::MagneticSkin(skin) => (
                skin.parts(&self.layout(), &self.electronics),
                skin.fabrication.by_name(),
            ),
            Element::Body(body) => (
                body.parts(self.layout().taxels(), &self.electronics),
                body.deviations(),
            ),
            Element::Own(own) => (own.element.parts(), Vec::new()),
            _ => return Err(self.unreadable(&FORCE_BOARD)),
        };
        ChainDevice::new(self, parts, fabrication).map_err(|allowed| Unreadable::Stage {
            element: self.element.key(),
            readout: self.electronics.readout.key(),
            allowed: allowed.join(", "),
        })
    }

    /// Why the board cannot read an element that is read by `readings`.
    fn unreadable(&self, readings: &Readings) -> Unreadable {
        let (element, readout) = (self.element.key(), &self.electronics.readout);
        let Some(measured) = self.electronics.measured() else {
            let stages = readings.stages.iter().chain(readings.alone);
            return Unreadable::Stage {
                element,
                readout: readout.key(),
                allowed: stages
                    .copied()
                    .chain(["measured"])
                    .collect::<Vec<_>>()
                    .join(", "),
            };
        };
        let unit = &measured.unit;
        let here = readings.measured.contains(&unit.dimension);
        if let Some(stage) = &measured.stage
            && (here || *unit.dimension == VOLTAGE)
        {
            let help = match readings.stages {
                [] => "leave the stage out".into(),
                stages => format!(
                    "leave the stage out, or give \"V\" with one of: {}",
                    stages.join(", ")
                ),
            };
            return Unreadable::Before {
                element,
                symbol: unit.symbol,
                stage: stage.key(),
                help,
            };
        }
        let each = |of: fn(&Dimension) -> String| {
            let all = readings.measured.iter().map(|dimension| of(dimension));
            all.collect::<Vec<_>>()
        };
        let mut units = each(Dimension::symbols).join(", ");
        if !readings.stages.is_empty() && !here {
            let stages = readings.stages.join(", ");
            let volts = format!("; or V with electronics.readout.measured.stage: {stages}");
            units.push_str(&volts);
        }
        Unreadable::Unit {
            element,
            symbol: unit.symbol,
            found: unit.dimension.noun(),
            needed: each(|dimension| dimension.name.to_owned()).join(" or "),
            units,
        }
    }
}

/// How an element can be read.
struct Readings {
    /// Stages that make a voltage of it.
    stages: &'static [&'static str],
    /// Readouts that need no further stage.
    alone: &'static [&'static str],
    /// What an instrument at the element itself gives.
    measured: &'static [&'static Dimension],
}

static CAPACITOR: Readings = Readings {
    stages: &["charge_amplifier"],
    alone: &[],
    measured: &[&CAPACITANCE],
};
static PIEZOELECTRIC: Readings = Readings {
    stages: &["voltage_amplifier", "charge_mode"],
    alone: &[],
    measured: &[&CHARGE, &VOLTAGE],
};
static MICROCHANNEL: Readings = Readings {
    stages: &["voltage_divider"],
    alone: &[],
    measured: &[&RESISTANCE],
};
static TRAINED: Readings = Readings {
    stages: &[],
    alone: &["digital"],
    measured: &[
        &CAPACITANCE,
        &VOLTAGE,
        &RESISTANCE,
        &CHARGE,
        &FORCE,
        &STRESS,
    ],
};
static FORCE_BOARD: Readings = Readings {
    stages: &[],
    alone: &[],
    measured: &[&FORCE],
};

/// A board that cannot read the element, at its key.
fn of_unreadable(unreadable: &Unreadable) -> Broken {
    Broken::new(unreadable.key(), unreadable.to_string(), &unreadable.help())
}
