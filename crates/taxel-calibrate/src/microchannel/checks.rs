//! Checks of the readings of crossing microchannels.

use super::columns::{
    AREA, DEVIATION, FORCE_Z, HOLD_OUT, NUMBER, PRESSURE, RESISTANCE, RESISTANCE_DEVIATION, SHARE,
    VOLTAGE,
};
use super::problem::{Load, Reading};
use super::saturation::Plateau;
use super::{CHANNEL, MicrochannelCalibrator};
use crate::device_model::DeviceReadings;
use crate::hysteresis::on_loading;
use crate::loads::{LEAST_SPAN, Loads};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::split::{Branch, branches, by_series, series_of};
use crate::table_checks::{at_rest, follows, of_this_device, pressing};
use taxel::InputError;
use taxel::mechanics::{ClosingState, SectionClosure, Stretch};
use taxel::signal::ResistanceSignal;

/// Least readings of a channel.
const LEAST: usize = 6;
/// Most readings of a channel that are fitted one by one.
const MOST: usize = 500;
/// Between readings and drawing, a factor beyond this is a wrong unit.
const WRONG_UNIT: f64 = 300.0;

impl DeviceReadings for MicrochannelCalibrator<'_> {
    type Reading = Reading;
    /// The plateau of each channel that reached one.
    type Context = Vec<Option<Plateau>>;

    fn readings(
        &self,
        data: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<(Self::Context, Vec<Reading>), InputError> {
        let readings = self.checked(data, remarks)?;
        let mut readings = thinned(readings, remarks);
        Ok((self.plateaus(&mut readings), readings))
    }

    /// Those that are not saturated.
    fn loading(
        &self,
        _: &Self::Context,
        of: &[Reading],
        remarks: &mut Vec<Remark>,
    ) -> Vec<Reading> {
        let loads: Vec<f64> = of.iter().map(|r| r.load.pressure(0.0)).collect();
        // Saturated readings say which way the load goes, too.
        let pairs = of.iter().zip(branches(&loads));
        let (of, unloading): (Vec<Reading>, Vec<bool>) = pairs
            .filter(|(r, _)| !r.saturated)
            .map(|(r, branch)| (*r, branch == Branch::Unloading))
            .unzip();
        let Some(first) = of.first() else {
            return Vec::new();
        };
        let name = format!("{CHANNEL}_{}", first.channel);
        on_loading(&name, &of, &unloading, "", remarks)
    }

    fn loads(&self, _: &Self::Context, of: &[Reading]) -> Vec<Loads> {
        vec![Loads {
            name: format!("{CHANNEL} {}", of.first().map_or(0, |r| r.channel)),
            column: "pressure",
            unit: ("kPa", 1e3),
            values: of.iter().map(|r| r.load.pressure(0.0)).collect(),
            least: LEAST,
            span: LEAST_SPAN,
            from_rest: true,
        }]
    }
}

impl MicrochannelCalibrator<'_> {
    /// The readings of `data`; those from the saturation of the sensor file on are
    /// marked.
    pub(super) fn checked(
        &self,
        data: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<Vec<Reading>, InputError> {
        let signal = &self.board.signal;
        complete(data, signal)?;
        let (name, unit) = signal.unit();
        if data.given[VOLTAGE] && data.given[RESISTANCE] {
            let unused = if signal.is_voltage() {
                "resistance"
            } else {
                "voltage"
            };
            remarks.push(Remark::whole(format!(
                "{unused} is not used: the board of the sensor file gives the {name}"
            )));
        }
        let largest = signal.largest();
        if self.layers.iter().any(|layer| layer.initial_pressure > 0.0) {
            remarks.push(Remark::whole(
                "the bulging at rest is that of the drawing: a stiffness that is not 1 stands for an initial_pressure as \
                 many times that of the sensor file",
            ));
        }
        let mut readings = Vec::with_capacity(data.len());
        let (mut saturated, mut impossible) = (0, 0);
        for row in 0..data.len() {
            let channel = self.channel_of(data, row)?;
            let (Some(load), Some(read)) = (load(data, row), self.signal(data, row)) else {
                let message = format!("no load or no {name}; the row is left out");
                remarks.push(Remark::at(data.line(row), &message));
                continue;
            };
            if read <= 0.0 || read >= largest {
                impossible += 1;
                continue;
            }
            readings.push(Reading {
                channel,
                layer: self.layer_of(channel),
                load,
                share: data.number(row, SHARE).unwrap_or(1.0),
                signal: read,
                deviation: data.positive(row, deviation_of(signal)),
                saturated: self.board.saturated(read),
                marked: data.flag(row, HOLD_OUT),
            });
            saturated += usize::from(self.board.saturated(read));
        }
        if 2 * impossible > data.len() {
            let message = format!(
                "{impossible} of {} {name}s do not lie between 0 and {}, {largest} {unit}",
                data.len(),
                end_of(signal),
            );
            return Err(data.error(name, message, "is the unit of the column right?"));
        }
        let at_end = format!("saturated readings, from the {name} that the sensor file names,");
        let outside = format!("{name}s outside 0 {unit} to {}", end_of(signal));
        for (count, what) in [(impossible, outside), (saturated, at_end)] {
            if count > 0 {
                remarks.push(Remark::whole(format!("{count} {what} are left out")));
            }
        }
        if readings.is_empty() {
            let message = format!(
                "no row has a load and a {name} between 0 and {}",
                end_of(signal)
            );
            return Err(data.error(name, message, "give both in each row"));
        }
        for of in by_series(&readings) {
            let rows: Vec<_> = of
                .iter()
                .map(|r| ([r.load.pressure(0.0) * r.share], r.signal))
                .collect();
            follows(data, name, &format!("{CHANNEL} {}", of[0].channel), &rows)?;
        }
        let unsaturated: Vec<Reading> = readings.iter().filter(|r| !r.saturated).copied().collect();
        self.units(data, &unsaturated)?;
        Ok(readings)
    }

    /// The plateau of each channel that reached one; marks its readings.
    pub(super) fn plateaus(&self, all: &mut [Reading]) -> Vec<Option<Plateau>> {
        let mut plateaus = vec![None; self.all.len()];
        for of in by_series(all) {
            let loading = self.loading(&Vec::new(), &of, &mut Vec::new());
            let drawn = |pressure: f64| self.drawn_signal(&of[0], pressure);
            plateaus[of[0].channel] =
                Plateau::find(&loading).filter(|plateau| plateau.stands_out(drawn));
        }
        for reading in all {
            let plateau = plateaus[reading.channel];
            reading.saturated |= plateau.is_some_and(|plateau| plateau.holds(reading));
        }
        plateaus
    }

    /// Signal of the drawn channel of a reading under a pressure, Pa, as far as its closing curve is
    /// known.
    fn drawn_signal(&self, reading: &Reading, pressure: f64) -> Option<f64> {
        let stretch = |share, pressure| Stretch { share, pressure };
        let rest = stretch(1.0 - reading.share, 0.0);
        let response =
            self.layers[reading.layer].respond(&[stretch(reading.share, pressure), rest]);
        let response = response.ok()?;
        let beyond = |part: &SectionClosure| matches!(part.state, ClosingState::Beyond { .. });
        let resistance = self.drawn_rest(reading.channel) * (1.0 + response.change);
        (!response.channel.sections.iter().any(beyond)).then(|| self.board.signal.of(resistance))
    }

    fn channel_of(&self, data: &ReadingTable, row: usize) -> Result<usize, InputError> {
        let number = data.number(row, NUMBER).unwrap_or(f64::NAN);
        let known = self.all.iter().find(|channel| **channel as f64 == number);
        known.copied().ok_or_else(|| {
            let message = format!("line {}: there is no channel {number}", data.line(row));
            let last = self.all.len().saturating_sub(1);
            let help = format!("channels go from 0 to {last}, rows first");
            data.error(CHANNEL, message, &help)
        })
    }

    fn signal(&self, data: &ReadingTable, row: usize) -> Option<f64> {
        let signal = &self.board.signal;
        // A given resistance has the leads in it already.
        let of = |resistance: f64| signal.of(resistance - signal.lead());
        let read = data.number(row, VOLTAGE).filter(|_| signal.is_voltage());
        read.or(data.number(row, RESISTANCE).map(of))
    }

    /// True if voltages and loads can be of this array.
    fn units(&self, data: &ReadingTable, readings: &[Reading]) -> Result<(), InputError> {
        for channel in series_of(readings) {
            let signal = &self.board.signal;
            let drawn = signal.of(self.drawn_rest(channel));
            let pair = [rest_signal(readings, channel), drawn];
            let (unit, scale) = signal.shown();
            let words = |signal: f64| format!("{:.4} {unit}", signal / scale);
            let help = "is the unit of the column right, and the sensor file?";
            of_this_device(
                data,
                signal.unit().0,
                &format!("channel {channel}: "),
                pair,
                words,
                help,
            )?;
        }
        let pressures = readings.iter().map(|r| r.load.pressure(0.0));
        let largest = pressures.fold(0.0, f64::max);
        let known = self.highest[0].max(self.highest[1]);
        pressing(data, "pressure", "load", largest)?;
        if largest > WRONG_UNIT * known || largest < known / WRONG_UNIT {
            let message = format!(
                "the largest pressure is {:.4e} kPa; the drawing closes its channels at {:.4e} kPa",
                largest * 1e-3,
                known * 1e-3
            );
            let help = "are the units of pressure, force and area right?";
            return Err(data.error("pressure", message, help));
        }
        Ok(())
    }
}

/// Means of as many consecutive readings of a channel as leave at most [`MOST`] of each:
/// a board reads thousands a second, and a press takes seconds. What scatters within a mean
/// need not be independent, so deviations of single readings are not those of means: the
/// scatter of the means says theirs.
fn thinned(readings: Vec<Reading>, remarks: &mut Vec<Remark>) -> Vec<Reading> {
    let channels = by_series(&readings);
    let most = channels.iter().map(Vec::len).max().unwrap_or(0);
    let block = most.div_ceil(MOST);
    if block <= 1 {
        return readings;
    }
    remarks.push(Remark::whole(format!(
        "up to {most} readings of a channel: of each {block} in a row their mean is fitted"
    )));
    let alike = channels.iter().flat_map(|of| of.chunk_by(alike));
    let blocks = alike.flat_map(|of| of.chunks(block));
    blocks.map(mean).collect()
}

/// True if two readings differ only in what was read and how much pressed.
fn alike(a: &Reading, b: &Reading) -> bool {
    let area = |load: Load| match load {
        Load::Pressure(_) => None,
        Load::Force(_, area) => Some(area),
    };
    a.marked == b.marked && a.share == b.share && area(a.load) == area(b.load)
}

/// One reading for several in a row that are alike.
fn mean(of: &[Reading]) -> Reading {
    let mean =
        |value: &dyn Fn(&Reading) -> f64| of.iter().map(value).sum::<f64>() / of.len() as f64;
    let pressed = mean(&|r| match r.load {
        Load::Pressure(pressed) | Load::Force(pressed, _) => pressed,
    });
    let load = match of[0].load {
        Load::Pressure(_) => Load::Pressure(pressed),
        Load::Force(_, area) => Load::Force(pressed, area),
    };
    Reading {
        load,
        signal: mean(&|r| r.signal),
        deviation: None,
        saturated: of.iter().any(|r| r.saturated),
        ..of[0]
    }
}

/// Checks that the table has the columns of a load and of a signal.
fn complete(data: &ReadingTable, signal: &ResistanceSignal) -> Result<(), InputError> {
    let given = |column: usize| data.given[column];
    if !(given(PRESSURE) || given(FORCE_Z) && given(AREA)) {
        let message = "no pressure, and no force with its area";
        let help = "give a column pressure, or force_z and area: a force alone says no pressure";
        return Err(data.error("pressure", message, help));
    }
    if !signal.is_voltage() && !given(RESISTANCE) {
        let message = "no resistance, which the board of the sensor file gives";
        let help = "give a column resistance; voltages belong to a sensor file with their divider";
        return Err(data.error("resistance", message, help));
    }
    if !(given(VOLTAGE) || given(RESISTANCE)) {
        let message = "neither voltage nor resistance";
        return Err(data.error("voltage", message, "give one of the two columns"));
    }
    Ok(())
}

/// The column with the deviation of a signal.
fn deviation_of(signal: &ResistanceSignal) -> usize {
    match signal {
        ResistanceSignal::Divider { .. } => DEVIATION,
        ResistanceSignal::Resistance { .. } => RESISTANCE_DEVIATION,
    }
}

/// End of what a signal can be, in words.
fn end_of(signal: &ResistanceSignal) -> &'static str {
    match signal {
        ResistanceSignal::Divider { .. } => "the supply",
        ResistanceSignal::Resistance { .. } => "the end of the range",
    }
}

fn load(data: &ReadingTable, row: usize) -> Option<Load> {
    match [PRESSURE, FORCE_Z, AREA].map(|column| data.number(row, column)) {
        [Some(pressure), _, _] => Some(Load::Pressure(pressure)),
        [None, Some(force), Some(area)] => Some(Load::Force(force, area)),
        _ => None,
    }
}

/// The largest force, N; zero when all loads are pressures.
pub(super) fn largest_force(readings: &[Reading]) -> f64 {
    let force = |reading: &Reading| match reading.load {
        Load::Force(force, _) => force,
        Load::Pressure(_) => 0.0,
    };
    readings.iter().map(force).fold(0.0, f64::max)
}

/// Signal at rest: the mean of a channel's readings at its least loads.
pub(super) fn rest_signal(readings: &[Reading], channel: usize) -> f64 {
    let of = readings.iter().filter(|r| r.channel == channel);
    at_rest(of.map(|r| [r.load.pressure(0.0), r.signal]))
}
