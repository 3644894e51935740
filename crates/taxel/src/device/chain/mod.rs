//! Any device that is a [`Chain`]: what is asked of a device, written once from its parts.

mod drawing;
mod facts;
mod predict;
mod reader;
mod registry;
mod twin;

use super::{Device, check_mask, fits};
use crate::acquisition::{Quantity, Simulated, Stream};
use crate::drawing::Drawing;
use crate::electronics::LastStage;
use crate::estimation::{FrameError, ObserverOptions, Reader};
use crate::information::{Information, InformationOptions, NoInformation, Unknown};
use crate::layout::Layout;
use crate::predict::{Load, LoadColumn, Predictor};
use crate::quantity::{Dimension, FORCE, RESISTANCE};
use crate::sensor::{Broken, Sensor, check_scan_time, masked_capacitors, micrometres, require};
use crate::stage::{Board, CellEstimate, CellLoad, CellState, Chain, Memory, PartError, Parts};
use crate::summary::Fact;

pub use predict::ChainPredictor;
pub use reader::ChainReader;
pub(super) use reader::{CONTACT_DEVIATIONS, CONTACT_SHARE};
pub use registry::Registry;
pub(super) use twin::Piece;

/// A device that is a chain of stages.
#[derive(Debug)]
pub struct ChainDevice<'a> {
    sensor: &'a Sensor,
    chain: Chain,
    /// Standard deviation of each number of a part, over its value, where the file states it.
    fabrication: Vec<(String, f64)>,
}

impl<'a> ChainDevice<'a> {
    /// The device of these parts on the board of `sensor`.
    ///
    /// # Errors
    /// Keys of the readouts that can read it, where that of the sensor file cannot.
    pub(crate) fn new(
        sensor: &'a Sensor,
        parts: Parts,
        fabrication: Vec<(String, f64)>,
    ) -> Result<Self, Vec<&'static str>> {
        let signal = parts.network.quantity(parts.cell.quantity());
        let board = Board::new(&sensor.electronics, signal)?;
        let array = &sensor.array;
        let masked = masked_capacitors(&sensor.mask, array.rows, array.columns);
        let masked = masked.iter().map(|channels| channels.contains(&true));
        Ok(Self {
            chain: Chain::new(Layout::new(array), parts, board, masked.collect()),
            sensor,
            fabrication,
        })
    }

    /// The chain as drawn, or as calibrated.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Standard deviation of each number that is made otherwise than drawn, by its name: over its value,
    /// or in its unit ([`crate::stage::PartParameter::absolute`]).
    pub fn fabrication(&self) -> &[(String, f64)] {
        &self.fabrication
    }

    fn scatter(&self, name: &str) -> Option<f64> {
        let found = self.fabrication.iter().find(|(key, _)| key == name);
        found.map(|(_, share)| *share)
    }

    /// Reader of frames whose values are `quantity`.
    ///
    /// # Errors
    /// [`FrameError::Quantity`] when these cannot be frames of its board.
    pub fn chain_reader(&self, quantity: Quantity) -> Result<ChainReader, FrameError> {
        let sides = |(name, share): &(String, f64)| {
            [1.0, -1.0].map(|side| {
                let (mut chain, mut own) = (self.chain.clone(), false);
                chain.parameters(&mut |parameter, value| {
                    if parameter.name == name {
                        *value += side * parameter.off(*value, *share);
                        own = parameter.per_cell;
                    }
                });
                (chain, own)
            })
        };
        // A network that knows its make has that in its deviations.
        let apart = (!self.chain.network.knows_its_make()).then_some(&self.fabrication);
        let made = apart.into_iter().flatten().flat_map(sides);
        ChainReader::new(self.chain.clone(), made.collect(), quantity)
    }

    /// The chain as it may have been made: each number whose deviation the sensor file states is off
    /// by that times a number of `normal`.
    pub fn scattered(&self, normal: &mut dyn FnMut() -> f64) -> Chain {
        self.chain.scattered(&|name| self.scatter(name), normal)
    }

    /// One piece of fabrication: the same for the same seed.
    pub fn piece(&self, seed: u64) -> Box<dyn Simulated> {
        let mut noise = taxel_numerics::Noise::seeded(seed);
        let chain = self.scattered(&mut || noise.normal().clamp(-CUT, CUT));
        Box::new(Piece::new(chain))
    }
}

impl Device for ChainDevice<'_> {
    fn check(&self) -> Result<(), Broken> {
        check_scan_time(
            self.sensor,
            self.chain
                .scan
                .duration(self.sensor.array.rows, self.sensor.array.columns),
        )?;
        check_mask(self.sensor)?;
        let element = self.sensor.element.key();
        let key = |below: &str| format!("element.{element}.{below}");
        let broken = |error: PartError| Broken::new(&key(&error.key), error.message, &error.help);
        if let Some(cover) = &self.chain.cover {
            cover.fits(self.chain.layout.pitch).map_err(broken)?;
        }
        self.chain
            .network
            .joins(self.chain.count())
            .map_err(broken)?;
        for stage in self.chain.stages() {
            stage.check().map_err(broken)?;
        }
        let (laws, cells) = (self.chain.laws(), self.chain.count());
        require(
            laws == 1 || laws == cells,
            &key("cell"),
            || format!("there are curves of {laws} cells, and the array has {cells}"),
            "give one for all, or one for each cell, row by row",
        )?;
        require(
            self.chain.network.takes(self.chain.cell(0).quantity()),
            &key("network"),
            || "this network joins resistors alone".into(),
            "leave it out: the cells are read one by one",
        )?;
        let largest = self.chain.cell(0).largest();
        require(
            self.chain.full_scale <= largest,
            &key("full_scale"),
            || {
                let [end, largest] = [self.chain.full_scale, largest].map(|load| load / 1e3);
                format!("{end} kPa is beyond the last point of the curve, at {largest} kPa")
            },
            "give at most the pressure of the last point",
        )?;
        let (area, pitch) = (self.chain.cell_area(), self.chain.layout.pitch);
        require(
            area[0] <= pitch[0] && area[1] <= pitch[1],
            "array.pitch",
            || {
                let [x, y] = area.map(micrometres);
                format!("cells of {x} x {y} overlap at this pitch")
            },
            "give a pitch of at least the sides of a cell",
        )?;
        let mut names = Vec::new();
        let mut chain = self.chain.clone();
        chain.parameters(&mut |parameter, _| names.push(parameter.name));
        for (name, _) in &self.fabrication {
            require(
                names.contains(&name.as_str()),
                &key(&format!("fabrication.{name}")),
                || format!("no part of this device has a number \"{name}\""),
                &format!("use one of: {}", names.join(", ")),
            )?;
        }
        require(
            self.chain.deviation() > 0.0,
            "electronics.readout",
            || "a board without any noise gives no uncertainty".into(),
            "give the noise of one reading, such as \"1 mV\"",
        )?;
        let [low, high] = self.chain.last.range();
        let (symbol, size) = match &self.chain.last {
            LastStage::Converter(_) => ("V", 1.0),
            LastStage::Instrument(measured) => (measured.unit.symbol, measured.unit.si_per_unit),
        };
        for (what, input) in (0..laws).flat_map(|cell| self.inputs(cell)) {
            require(
                low < input && input < high,
                self.sensor.electronics.range_key(),
                || {
                    let [input, low, high] = [input, low, high].map(|value| value / size);
                    format!(
                        "{what} the board has {input:.4} {symbol} at its last stage, outside of {low} to {high} {symbol}"
                    )
                },
                "change the range, or the gain of the stage before it",
            )?;
        }
        Ok(())
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(ChainPredictor::new(self.chain.clone())))
    }

    fn information_loads(&self) -> &'static [LoadColumn] {
        predict::loads(&self.chain)
    }

    fn information_noise(&self) -> &'static Dimension {
        let signal = self.chain.network.quantity(self.chain.cell(0).quantity());
        signal.dimension.unwrap_or(&RESISTANCE)
    }

    fn information(
        &self,
        load: &Load<'_>,
        options: &InformationOptions,
    ) -> Result<Information, NoInformation> {
        if self.chain.cell(0).load() == CellLoad::Force {
            return Ok(self.of_forces(load, options));
        }
        let predictor = ChainPredictor::new(self.chain.clone());
        let asked = predictor.pressures(load);
        let beyond = NoInformation::Beyond("the load needs pressure or force_z".into());
        let (pressures, direction) = asked.map(|(p, at)| (p, self.direction(at))).ok_or(beyond)?;
        let slopes = self.chain.slopes(&pressures, &direction);
        let noise = options.noise.unwrap_or_else(|| self.chain.deviation());
        Ok(Information {
            unknowns: vec![Unknown {
                name: "force_z",
                dimension: &FORCE,
                full_scale: self.chain.full_scale * self.chain.area(),
                beside: false,
            }],
            jacobian: slopes
                .iter()
                .map(|slope| vec![slope / self.chain.area()])
                .collect(),
            noise: vec![noise; slopes.len()],
            prior: vec![0.0],
        })
    }

    fn stages(&self) -> Option<Chain> {
        Some(self.chain.clone())
    }

    fn crosstalk(&self, load: &Load<'_>) -> Result<f64, NoInformation> {
        if self.chain.cell(0).load() == CellLoad::Force {
            return Err(NoInformation::Kind);
        }
        let predictor = ChainPredictor::new(self.chain.clone());
        let Some((pressures, Some(at))) = predictor.pressures(load) else {
            return Err(NoInformation::Beyond(
                "crosstalk needs a load on one cell".into(),
            ));
        };
        let (rest, pressed) = (self.chain.rest(), self.chain.respond(&pressures).signals);
        let change = |cell: usize| (pressed[cell] - rest[cell]).abs();
        let others = (0..rest.len()).filter(|cell| *cell != at).map(change);
        Ok(others.fold(0.0, f64::max) / change(at))
    }

    fn time_constants(&self) -> Vec<f64> {
        self.chain
            .memory
            .as_deref()
            .map_or_else(Vec::new, Memory::times)
    }

    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        (!self.fabrication.is_empty())
            .then(|| Box::new(ChainPredictor::new(self.scattered(normal))) as Box<dyn Predictor>)
    }

    /// The cells that a file states no deviation for are as drawn.
    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(self.piece(PIECE))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        fits(stream, self.chain.channels(), self.chain.layout.columns)?;
        Ok(Box::new(self.chain_reader(stream.unit.quantity)?))
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream).on(&self.chain.layout)
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}

/// The load that `model` reads on the cell `at`, which alone has a load on `made`; a capture at rest
/// of `made` comes before it if `tared`. `None` where the law of `made` ends before this load, where
/// no load belongs to the reading, and where the capture is refused.
pub fn read_back(
    made: &Chain,
    model: &Chain,
    tared: bool,
    at: usize,
    load: f64,
) -> Option<CellEstimate> {
    if load.abs() > made.full_scale {
        return None;
    }
    let quantity = model.last.unit().quantity;
    let mut reader = ChainReader::new(model.clone(), Vec::new(), quantity).ok()?;
    if tared {
        let rest = made.rest();
        let of_unit = rest.chunks(made.channels_per_taxel());
        let mut problems = of_unit
            .enumerate()
            .filter_map(|(unit, rest)| reader.rest_problem(unit, rest));
        if problems.next().is_some() {
            return None;
        }
        let noise = reader.noise();
        reader.set_rest(&rest, &noise);
    }
    let mut loads = vec![0.0; made.count()];
    *loads.get_mut(at)? = load;
    let estimates = reader.estimates(&made.respond(&loads).signals);
    let found = estimates.get(at).copied();
    found.filter(|found| found.state == CellState::Ok)
}

/// Seed of the piece of fabrication that the twin is: the same for each run.
const PIECE: u64 = 1;
/// Standard deviations at which what is made is sorted out.
const CUT: f64 = 3.0;

impl ChainDevice<'_> {
    /// The pressed cell alone, or all of them.
    fn direction(&self, at: Option<usize>) -> Vec<f64> {
        let pressed = |cell| f64::from(u8::from(at.is_none_or(|at| at == cell)));
        (0..self.chain.count()).map(pressed).collect()
    }

    /// What one frame says of the force on a taxel, counted from a capture at rest, with all else that
    /// moves the signals.
    fn of_forces(&self, load: &Load<'_>, options: &InformationOptions) -> Information {
        let predictor = ChainPredictor::new(self.chain.clone());
        let (taxel, loads) = predictor.forces(load);
        let tared = self.chain.at_rest(&self.chain.rest());
        let chain = tared.as_ref().unwrap_or(&self.chain);
        let noise = |channel: usize| {
            let of_board = chain.deviation_along(chain.of_channel(channel).1);
            options.noise.unwrap_or(of_board)
        };
        let noise: Vec<f64> = (0..chain.channels()).map(noise).collect();
        let values = chain.values(&loads);
        if let Some(known) = chain.network.information(&values, taxel, &noise) {
            return known;
        }
        let (count, first) = (chain.axes.count(), chain.axes.first());
        let slopes = |slot| chain.slopes(&loads, &self.direction(Some(count * taxel + slot)));
        let columns: Vec<Vec<f64>> = (0..count).map(slopes).collect();
        let unknown = |name| Unknown {
            name,
            dimension: &FORCE,
            full_scale: chain.full_scale,
            beside: false,
        };
        let row = |channel: usize| columns.iter().map(|column| column[channel]).collect();
        Information {
            unknowns: ["force_x", "force_y", "force_z"][first..]
                .iter()
                .map(|name| unknown(name))
                .collect(),
            jacobian: (0..noise.len()).map(row).collect(),
            noise,
            prior: vec![0.0; count],
        }
    }

    /// Inputs of the last stage at rest, and with this cell alone at full scale: of several channels
    /// that of the largest.
    fn inputs(&self, cell: usize) -> [(&'static str, f64); 2] {
        let chain = &self.chain;
        let mut loads = vec![0.0; chain.count()];
        let (taxel, _) = chain.of_cell(cell);
        loads[chain.axes.count() * (taxel + 1) - 1] = chain.full_scale;
        let per_taxel = chain.channels_per_taxel();
        let channels = match chain.channel_of(cell) {
            Some(channel) => channel..channel + 1,
            None => per_taxel * taxel..per_taxel * (taxel + 1),
        };
        let [rest, pressed] = [chain.rest(), chain.respond(&loads).signals].map(|signals| {
            let inputs = signals[channels.clone()]
                .iter()
                .map(|signal| chain.input(*signal));
            inputs
                .max_by(|a, b| a.abs().total_cmp(&b.abs()))
                .unwrap_or(f64::NAN)
        });
        [("at rest", rest), ("with one cell at full scale", pressed)]
    }
}
