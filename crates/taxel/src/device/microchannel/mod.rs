//! Two crossing layers of liquid-metal channels (P4).

mod check;
mod drawing;
mod facts;
pub mod loads;
mod predict;
mod simulated;

use super::{Device, carries};
use crate::acquisition::{Simulated, Stream};
use crate::calibration::{ChannelScale, MicrochannelCalibration, MicrochannelModel};
use crate::drawing::Drawing;
use crate::electronics::{DividerBoard, Stage};
use crate::estimation::{
    FrameError, MicrochannelOptions, MicrochannelReader, ObserverOptions, Reader,
};
use crate::information::{Information, InformationOptions, NoInformation, Unknown};
use crate::layout::Layout;
use crate::mechanics::{MicrochannelError, VoidStack};
use crate::predict::{Load, LoadColumn, Predictor};
use crate::quantity::{Dimension, RESISTANCE, STRESS, VOLTAGE};
use crate::sensor::{Broken, Microchannel, Sensor, masked_capacitors};
use crate::summary::Fact;
use crate::transduction::MicrochannelLayer;

pub use predict::{
    LayerAnswer, MicrochannelLayerState, MicrochannelPrediction, MicrochannelPredictor, PartAnswer,
};

/// A plateau reads below itself by less than so many deviations of a reading.
const BELOW_PLATEAU: f64 = 4.0;

/// Crossing channels with their board.
///
/// The channels of a frame are the rows, from +y to -y, then the columns, from
/// -x to +x: for 2 x 4 taxels channels 0 and 1 run along x, 2 to 5 along y.
#[derive(Debug, Clone)]
pub struct MicrochannelArray<'a> {
    sensor: &'a Sensor,
    /// Element of the array.
    pub element: &'a Microchannel,
    /// Models of the row and of the column layer.
    pub layers: [MicrochannelLayer; 2],
    /// The board.
    pub board: DividerBoard,
}

/// Names of the layers of microchannels, in the order of [`MicrochannelArray::layers`].
pub const LAYERS: [&str; 2] = ["row", "column"];

impl<'a> MicrochannelArray<'a> {
    /// `None` when the board takes no resistance, or a layer has no model; the
    /// second is found when a file is read.
    pub(crate) fn new(sensor: &'a Sensor, element: &'a Microchannel) -> Option<Self> {
        let array = &sensor.array;
        let mut layers = element.layers(array.pitch).ok()?;
        if let Some(found) = &element.found {
            // A prediction is of the mean channel of its layer.
            let (rows, columns) = found.rest.split_at(array.rows.min(found.rest.len()));
            for (layer, rest) in layers.iter_mut().zip([rows, columns]) {
                let mean = rest.iter().sum::<f64>() / rest.len().max(1) as f64;
                layer.conductor.resistivity *= mean;
            }
        }
        let mut board = DividerBoard::new(&sensor.electronics, array.rows + array.columns)?;
        if let Some(found) = &element.found {
            board.signal = board.signal.with_lead(found.lead);
        }
        Some(Self {
            sensor,
            element,
            layers,
            board,
        })
    }

    /// The stage between a channel and a voltage, if there is one.
    pub fn first_stage(&self) -> Option<Stage> {
        self.sensor.electronics.first_stage()
    }

    /// Where the taxels are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// Channels of the row and of the column layer.
    pub fn counts(&self) -> [usize; 2] {
        [self.sensor.array.rows, self.sensor.array.columns]
    }

    /// Share of the length of a row and of a column channel that one taxel
    /// takes: the pitch along the channel over its length.
    pub fn taxel_share(&self) -> [f64; 2] {
        let pitch = self.sensor.array.pitch;
        std::array::from_fn(|layer| pitch[layer] / self.layers[layer].conductor.length)
    }

    /// Resistance at rest of a channel of a layer, Ω.
    fn rest_resistance(&self, layer: usize, channel: usize) -> f64 {
        let conductor = self.layers[layer].conductor;
        let found = self.element.found.as_ref();
        match found.and_then(|found| found.rest.get(channel)) {
            Some(rest) => {
                self.element.liquid.resistivity / conductor.resistivity
                    * conductor.rest_resistance()
                    * rest
            }
            None => conductor.rest_resistance(),
        }
    }

    /// Signal from which a channel counts as saturated: below a plateau that was found by
    /// what noise does, and at the end of what the board reads.
    fn saturation(&self, channel: usize) -> f64 {
        let board = &self.board;
        let drawn = board.saturation.min(board.last.range()[1]);
        let found = self.element.found.as_ref();
        match found.and_then(|found| found.saturation.get(channel)) {
            Some(found) if *found < drawn => found - BELOW_PLATEAU * board.deviation(),
            _ => drawn,
        }
    }

    /// Which of the upper (0) and the lower layer (1) the rows are, which the columns.
    pub fn position(&self) -> [usize; 2] {
        self.element.position()
    }

    /// The crossing cell for finite elements.
    ///
    /// # Errors
    /// A sentence for a drawing that is not solved.
    pub fn void_stack(&self) -> Result<VoidStack, String> {
        self.element.void_stack(self.sensor.array.pitch)
    }

    /// The calibration that the drawing implies: every channel as drawn, noise
    /// from the board's own figures.
    ///
    /// # Errors
    /// [`MicrochannelError`] when pressing a taxel does not change its channels one
    /// way; never after the file was read.
    pub fn calibration(&self) -> Result<MicrochannelCalibration, MicrochannelError> {
        let (board, share) = (&self.board, self.taxel_share());
        let channels = |layer: usize| {
            let (noise, saturation) = (board.deviation(), board.saturation);
            let drawn =
                MicrochannelModel::new(&self.layers[layer], share[layer], noise, saturation)?;
            let first = layer * self.counts()[0];
            let model = |index: usize| MicrochannelModel {
                rest_resistance: self.rest_resistance(layer, first + index),
                saturation: self.saturation(first + index),
                ..drawn.clone()
            };
            Ok::<_, MicrochannelError>((0..self.counts()[layer]).map(model).collect())
        };
        let layout = self.layout();
        Ok(MicrochannelCalibration {
            rows: channels(0)?,
            columns: channels(1)?,
            scale: ChannelScale {
                numbers: board.last.scale(),
                signal: board.signal,
                unit: board.last.unit(),
            },
            hysteresis: self
                .element
                .found
                .as_ref()
                .and_then(|found| found.hysteresis),
            masked: masked_capacitors(&self.sensor.mask, layout.rows, layout.columns)
                .iter()
                .map(|masked| masked.contains(&true))
                .collect(),
            layout,
        })
    }
}

impl Device for MicrochannelArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        check::check(self)
    }

    fn way(&self) -> String {
        let [rows, columns] = self
            .layers
            .each_ref()
            .map(|layer| layer.closing.source().words());
        format!("rows {rows}, columns {columns}")
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        let deviation = self.element.fabrication.height_deviation;
        let mut predictor = MicrochannelPredictor::new(self);
        predictor.heighten([(); 2].map(|()| deviation * normal()));
        Some(Box::new(predictor))
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(MicrochannelPredictor::new(self)))
    }

    fn information_loads(&self) -> &'static [LoadColumn] {
        // Of the pressure on one taxel.
        &loads::LOADS[..loads::SECOND]
    }

    fn information_noise(&self) -> &'static Dimension {
        if self.board.signal.is_voltage() {
            &VOLTAGE
        } else {
            &RESISTANCE
        }
    }

    fn information(
        &self,
        load: &Load<'_>,
        options: &InformationOptions,
    ) -> Result<Information, NoInformation> {
        let beyond = |message: String| NoInformation::Beyond(message);
        let calibration = self
            .calibration()
            .map_err(|error| beyond(error.to_string()))?;
        let (_, pressure) = loads::pressure_of(load, 0);
        let models = [calibration.rows.first(), calibration.columns.first()];
        let mut found = Information {
            unknowns: vec![Unknown {
                name: "pressure",
                dimension: &STRESS,
                full_scale: f64::INFINITY,
                beside: false,
            }],
            jacobian: Vec::new(),
            noise: Vec::new(),
            prior: vec![0.0],
        };
        for model in models.into_iter().flatten() {
            let slope = model
                .signal_slope(pressure, &calibration.scale)
                .ok_or_else(|| {
                    beyond(format!(
                        "its closing curve ends at {:.4} kPa on one taxel",
                        model.highest_pressure() / 1e3
                    ))
                })?;
            let largest = &mut found.unknowns[0].full_scale;
            *largest = largest.min(model.highest_pressure());
            found.jacobian.push(vec![slope]);
            found.noise.push(options.noise.unwrap_or(model.deviation));
        }
        Ok(found)
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(Box::new(simulated::Piece::new(self)))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        let expected = self.counts().iter().sum();
        let wrong = FrameError::Channels {
            found: stream.channels(),
            expected,
        };
        if stream.channels() != expected {
            return Err(wrong);
        }
        carries(stream, &self.board.last)?;
        // Reading the file has shown that there is a calibration.
        let calibration = self.calibration().map_err(|_| wrong)?;
        let options = MicrochannelOptions::default();
        Ok(Box::new(MicrochannelReader::new(calibration, options)))
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        let mut options = ObserverOptions::new(stream).on(&self.layout());
        // A channel that reads no more is one that the load has closed.
        options.events.saturation_is_closure = true;
        options
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
