//! From a sensor file to the device that it describes.

use taxel_recording::InputError;

use super::{
    Device, InPlaneArray, MicrochannelArray, PiezoelectricArray, ThreeAxisArray, TrainedArray,
    check_masked_channels,
};
use crate::sensor::{Broken, Element, Sensor, Unreadable, check_keys, renamed_key};
use crate::toml_input;

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
        if let Some(error) = renamed_key(file, text) {
            return Err(error);
        }
        let sensor: Self = toml_input::parse(file, text)?;
        let sound = check_keys(&sensor).and_then(|()| sensor.check_element());
        sound.map_err(|broken| broken.at(file, text))?;
        Ok(sensor)
    }

    /// Rules of the element, which know the board that reads it.
    fn check_element(&self) -> Result<(), Broken> {
        let device = self.device().map_err(|unreadable| {
            Broken::new(
                "electronics.readout",
                unreadable.to_string(),
                "give one of those stages",
            )
        })?;
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
        }
    }

    /// The array of three-axis units with its board, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn three_axis(&self) -> Result<ThreeAxisArray<'_>, Unreadable> {
        let Element::ThreeAxisCapacitor(element) = &self.element else {
            return Err(self.unreadable("charge_amplifier"));
        };
        ThreeAxisArray::new(self, element).ok_or_else(|| self.unreadable("charge_amplifier"))
    }

    /// The array of piezoelectric elements with its board, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn piezoelectric(&self) -> Result<PiezoelectricArray<'_>, Unreadable> {
        let allowed = "voltage_amplifier, charge_mode";
        let Element::Piezoelectric(element) = &self.element else {
            return Err(self.unreadable(allowed));
        };
        PiezoelectricArray::new(self, element).ok_or_else(|| self.unreadable(allowed))
    }

    /// The array of in-plane capacitors with its board, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn in_plane(&self) -> Result<InPlaneArray<'_>, Unreadable> {
        let Element::InPlaneCapacitor(element) = &self.element else {
            return Err(self.unreadable("charge_amplifier"));
        };
        InPlaneArray::new(self, element).ok_or_else(|| self.unreadable("charge_amplifier"))
    }

    /// The crossing microchannels with their board, if it is such an array.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn microchannels(&self) -> Result<MicrochannelArray<'_>, Unreadable> {
        let Element::Microchannel(element) = &self.element else {
            return Err(self.unreadable("voltage_divider"));
        };
        MicrochannelArray::new(self, element).ok_or_else(|| self.unreadable("voltage_divider"))
    }

    /// The body whose channels are learned, if it is one.
    ///
    /// # Errors
    /// [`Unreadable`] for another element or another board.
    pub fn trained(&self) -> Result<TrainedArray<'_>, Unreadable> {
        let Element::Trained(element) = &self.element else {
            return Err(self.unreadable("digital"));
        };
        TrainedArray::new(self, element).ok_or_else(|| self.unreadable("digital"))
    }

    fn unreadable(&self, allowed: &'static str) -> Unreadable {
        Unreadable {
            element: self.element.key(),
            readout: self.electronics.readout.key(),
            allowed,
        }
    }
}
