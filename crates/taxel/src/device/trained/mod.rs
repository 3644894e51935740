//! A body without a physical model, whose channels are learned.

mod drawing;
mod facts;
mod predict;

use super::{Device, check_mask};
use crate::acquisition::{Quantity, SignalUnit, Simulated, Stream};
use crate::drawing::Drawing;
use crate::electronics::{LastStage, Readout};
use crate::estimation::{FrameError, ObserverOptions, Reader, Scale, TrainedArea, TrainedReader};
use crate::layout::Mount;
use crate::predict::Predictor;
use crate::sensor::{Broken, Sensor, TrainedBody, masked_capacitors, require};
use crate::signal::NumberScale;
use crate::summary::Fact;

pub use predict::TrainedPredictor;

/// A body with its chips.
#[derive(Debug, Clone)]
pub struct TrainedArray<'a> {
    sensor: &'a Sensor,
    /// Description in the sensor file, with the learned maps.
    pub body: &'a TrainedBody,
    /// Quantity and unit of the numbers that the chips deliver.
    pub unit: ReadingUnit,
}

/// Unit of the numbers of chips or of an instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingUnit {
    /// The quantity.
    pub quantity: Quantity,
    /// Its unit for people.
    pub symbol: &'static str,
    /// SI value of that unit; 1 of numbers without one.
    pub si_per_unit: f64,
    /// SI unit as it ends a key; empty of numbers without one.
    pub key: &'static str,
}

impl ReadingUnit {
    /// `None` for a board that delivers no numbers of its own.
    fn of(readout: &Readout) -> Option<Self> {
        match readout {
            Readout::Digital(digital) => Some(Self {
                quantity: Quantity::Counts,
                symbol: digital.unit.symbol(),
                si_per_unit: 1.0,
                key: "",
            }),
            Readout::Measured(measured) if measured.stage.is_none() => Some(Self {
                quantity: measured.unit.signal().quantity,
                symbol: measured.unit.symbol,
                si_per_unit: measured.unit.si_per_unit,
                key: measured.unit.key(),
            }),
            _ => None,
        }
    }

    fn signal(&self) -> SignalUnit {
        SignalUnit {
            quantity: self.quantity,
            symbol: self.symbol.to_owned(),
            si_per_unit: self.si_per_unit,
        }
    }
}

impl<'a> TrainedArray<'a> {
    /// `None` for a board that delivers no numbers.
    pub(crate) fn new(sensor: &'a Sensor, body: &'a TrainedBody) -> Option<Self> {
        Some(Self {
            sensor,
            body,
            unit: ReadingUnit::of(&sensor.electronics.readout)?,
        })
    }

    /// Meaning of the frames of the device: one row of channels.
    pub fn stream(&self) -> Stream {
        let channels = self.body.channels().len();
        Stream {
            name: self.sensor.name.clone(),
            rows: 1,
            columns: channels,
            channels_per_taxel: 1,
            unit: self.unit.signal(),
            pitch: None,
            period: Some(self.sensor.electronics.period()),
            threshold: None,
            present: vec![true; channels],
        }
    }

    /// The area that can be touched.
    pub fn area(&self) -> TrainedArea {
        let array = &self.sensor.array;
        TrainedArea {
            rows: array.rows,
            columns: array.columns,
            pitch: array.pitch,
        }
    }
}

impl Device for TrainedArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        self.body.check()?;
        let array = &self.sensor.array;
        check_mask(self.sensor)?;
        let noise = match &self.sensor.electronics.readout {
            Readout::Digital(chips) => chips.noise,
            _ => None,
        };
        require(
            noise.is_none(),
            "electronics.readout.digital.noise",
            || "the noise of learned channels is learned".into(),
            "leave it out",
        )?;
        require(
            array.mount == Mount::Flat,
            "array.mount",
            || "positions are learned on a plane".into(),
            "write mount = \"flat\"; x and y are then those of the stage",
        )
    }

    fn named_channels(&self) -> Vec<String> {
        self.body.channels()
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    /// The fitted surface of the channels over the position, once it was learned.
    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        let maps = self.body.maps.as_ref()?;
        let predictor = TrainedPredictor::new(&self.body.channels(), maps, self.unit)?;
        Some(Box::new(predictor))
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        None
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        let names = self.body.channels();
        let (found, expected) = (stream.channels(), names.len());
        if found != expected {
            return Err(FrameError::Channels { found, expected });
        }
        let quantity = stream.unit.quantity;
        // Recordings without a header are numbers in the unit of the sensor file.
        let bare = matches!(quantity, Quantity::Counts | Quantity::Raw);
        if quantity != self.unit.quantity && !bare {
            return Err(FrameError::quantity(quantity, &self.unit.signal()));
        }
        let maps = self.body.maps.clone().ok_or(FrameError::Untrained)?;
        let masked_channels = self.body.masked(&self.sensor.mask);
        let needed = |channel: &usize| masked_channels[*channel] && maps.use_channel(*channel);
        if let Some(channel) = (0..expected).find(needed) {
            let channel = names[channel].clone();
            return Err(FrameError::TrainedWithMasked { channel });
        }
        let array = &self.sensor.array;
        let masked = masked_capacitors(&self.sensor.mask, array.rows, array.columns);
        // A calibration file was checked when it was read.
        let reader = TrainedReader::new(
            maps,
            self.area(),
            names,
            Scale::new("reading", self.unit.symbol, 1.0),
            self.body.full_scale,
        )
        .map_err(|_| FrameError::Untrained)?;
        let reader = match self.sensor.electronics.measured() {
            Some(measured) => {
                // The maps know the numbers as people read them.
                let numbers = LastStage::Instrument(*measured).scale();
                let si = self.unit.si_per_unit;
                if bare {
                    let numbers = NumberScale {
                        ends: numbers.ends.map(|end| end / si),
                        step: numbers.step / si,
                        ..numbers
                    };
                    reader.with_instrument(numbers, measured.deviation() / si)
                } else {
                    let numbers = NumberScale {
                        per_number: 1.0 / si,
                        ..numbers
                    };
                    reader.with_instrument(numbers, measured.deviation())
                }
            }
            None => reader,
        };
        let cells = masked.iter().map(|cell| cell.contains(&true));
        Ok(Box::new(reader.with_masked(cells, &masked_channels)))
    }

    /// The contact moves in metres, whatever the channels.
    fn observed(&self, stream: &Stream) -> ObserverOptions {
        let [x, y] = self.sensor.array.pitch;
        ObserverOptions::new(&Stream {
            pitch: Some([y, x]),
            ..stream.clone()
        })
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
