//! Checks of the readings of crossing microchannels.

use super::columns::{LOAD_AT, RESISTANCE, VOLTAGE};
use super::problem::{Load, Reading};
use super::{CHANNEL, InputError, MicrochannelCalibrator, ReadingTable, Remark};

/// Least readings of a channel.
pub(super) const LEAST: usize = 6;
/// A rest voltage off by more than this factor is of another divider.
const OTHER: f64 = 3.0;
/// Between readings and drawing, a factor beyond this is a wrong unit.
const WRONG_UNIT: f64 = 300.0;

/// The readings of `data`, checked; the saturated ones are marked.
pub(super) fn readings(
    calibrator: &MicrochannelCalibrator<'_>,
    data: &ReadingTable,
    remarks: &mut Vec<Remark>,
) -> Result<Vec<Reading>, InputError> {
    complete(data)?;
    let divider = calibrator.board.divider;
    let mut readings = Vec::with_capacity(data.len());
    let (mut saturated, mut impossible) = (0, 0);
    for row in 0..data.len() {
        let channel = channel_of(calibrator, data, row)?;
        let (Some(load), Some(voltage)) = (load(data, row), voltage(calibrator, data, row)) else {
            let message = "no load or no voltage; the row is left out";
            remarks.push(Remark::at(data.line(row), message));
            continue;
        };
        if voltage <= 0.0 || voltage >= divider.supply {
            impossible += 1;
            continue;
        }
        readings.push(Reading {
            channel,
            layer: calibrator.layer_of(channel),
            load,
            share: data.number(row, 5).unwrap_or(1.0),
            voltage,
            deviation: data.number(row, 8).filter(|deviation| *deviation > 0.0),
            saturated: divider.saturated(voltage),
            marked: data.number(row, 9).is_some_and(|mark| mark != 0.0),
        });
        saturated += usize::from(divider.saturated(voltage));
    }
    if 2 * impossible > data.len() {
        let message = format!(
            "{impossible} of {} voltages do not lie between 0 and the supply, {} V",
            data.len(),
            divider.supply
        );
        return Err(data.error("voltage", message, "is the unit of the column right?"));
    }
    for (count, what) in [
        (impossible, "voltages outside 0 V to the supply"),
        (
            saturated,
            "saturated readings, from the voltage that the sensor file names,",
        ),
    ] {
        if count > 0 {
            remarks.push(Remark::whole(format!("{count} {what} are left out")));
        }
    }
    if readings.is_empty() {
        let message = "no row has a load and a voltage between 0 and the supply";
        return Err(data.error("voltage", message, "give both in each row"));
    }
    let unsaturated: Vec<Reading> = readings.iter().filter(|r| !r.saturated).copied().collect();
    units(calibrator, data, &unsaturated)?;
    Ok(readings)
}

fn channel_of(
    calibrator: &MicrochannelCalibrator<'_>,
    data: &ReadingTable,
    row: usize,
) -> Result<usize, InputError> {
    let number = data.number(row, 1).unwrap_or(f64::NAN);
    let known = calibrator
        .all
        .iter()
        .find(|channel| **channel as f64 == number);
    known.copied().ok_or_else(|| {
        let message = format!("line {}: there is no channel {number}", data.line(row));
        let help = format!(
            "channels go from 0 to {}, rows first",
            calibrator.all.len().saturating_sub(1)
        );
        data.error(CHANNEL, message, &help)
    })
}

/// Checks that the table has the columns of a load and of a signal.
fn complete(data: &ReadingTable) -> Result<(), InputError> {
    let [pressure, force, area] = LOAD_AT.map(|column| data.given[column]);
    if !(pressure || force && area) {
        let message = "no pressure, and no force with its area";
        let help = "give a column pressure, or force_z and area: a force alone says no pressure";
        return Err(data.error("pressure", message, help));
    }
    if !(data.given[VOLTAGE] || data.given[RESISTANCE]) {
        let message = "neither voltage nor resistance";
        return Err(data.error("voltage", message, "give one of the two columns"));
    }
    Ok(())
}

fn load(data: &ReadingTable, row: usize) -> Option<Load> {
    match LOAD_AT.map(|column| data.number(row, column)) {
        [Some(pressure), _, _] => Some(Load::Pressure(pressure)),
        [None, Some(force), Some(area)] => Some(Load::Force(force, area)),
        _ => None,
    }
}

fn voltage(
    calibrator: &MicrochannelCalibrator<'_>,
    data: &ReadingTable,
    row: usize,
) -> Option<f64> {
    let divider = calibrator.board.divider;
    // A given resistance has the leads in it already.
    let of = |resistance: f64| divider.voltage(resistance - divider.lead);
    let read = data.number(row, VOLTAGE);
    read.or(data.number(row, RESISTANCE).map(of))
}

/// Checks that voltages and loads can be of this array.
fn units(
    calibrator: &MicrochannelCalibrator<'_>,
    data: &ReadingTable,
    readings: &[Reading],
) -> Result<(), InputError> {
    for channel in &calibrator.all {
        if !readings.iter().any(|r| r.channel == *channel) {
            continue;
        }
        let drawn = calibrator
            .board
            .divider
            .voltage(calibrator.drawn_rest(*channel));
        let rest = rest_voltage(readings, *channel);
        if !(drawn / OTHER..=drawn * OTHER).contains(&rest) {
            let message = format!(
                "channel {channel}: {:.4} mV at rest; the sensor file says {:.4} mV",
                rest * 1e3,
                drawn * 1e3
            );
            let help = "is the unit of the column right, and the sensor file?";
            return Err(data.error("voltage", message, help));
        }
    }
    let largest = readings
        .iter()
        .map(|r| r.load.pressure(0.0))
        .fold(0.0, f64::max);
    let known = calibrator.highest[0].max(calibrator.highest[1]);
    if largest <= 0.0 {
        let message = "no load is above zero; pressing is positive";
        return Err(data.error("pressure", message, "turn the sign of the column"));
    }
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

/// The channels that were read, in their order.
pub(super) fn channels(readings: &[Reading]) -> Vec<usize> {
    let mut channels: Vec<usize> = readings.iter().map(|r| r.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    channels
}

/// The largest force, N; zero when all loads are pressures.
pub(super) fn largest_force(readings: &[Reading]) -> f64 {
    let force = |reading: &Reading| match reading.load {
        Load::Force(force, _) => force,
        Load::Pressure(_) => 0.0,
    };
    readings.iter().map(force).fold(0.0, f64::max)
}

/// Voltage at rest: the mean of a channel's readings at its least loads, V.
pub(super) fn rest_voltage(readings: &[Reading], channel: usize) -> f64 {
    let mut of: Vec<&Reading> = readings.iter().filter(|r| r.channel == channel).collect();
    of.sort_by(|a, b| a.load.pressure(0.0).total_cmp(&b.load.pressure(0.0)));
    let few = (of.len() / 50).max(1);
    let least = of.iter().take(few).map(|r| r.voltage);
    least.sum::<f64>() / few as f64
}
