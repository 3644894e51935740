//! Checks of the readings of piezoelectric elements.

use super::columns::{
    CYCLES, DEVIATION, DISPLACEMENT, DWELL, FIRST_PEAK, FORCE_Z, HOLD_OUT, PERIOD, RAMP,
    SECOND_PEAK, TIME_AT, VOLTAGE_AT,
};
use super::peaks::plausible;
use super::problem::{Device, Drive, Reading, Table, What};
use super::{InputError, PiezoelectricCalibrator, ReadingTable, Remark};
use crate::clock::no_delay;
use taxel::mechanics::Profile;

/// Cycles of a cyclic load that does not say how many: it has settled.
const USUAL_CYCLES: f64 = 8.0;

/// The readings of `data`, checked.
pub(super) fn table(
    calibrator: &PiezoelectricCalibrator<'_>,
    data: &ReadingTable,
    remarks: &mut Vec<Remark>,
) -> Result<Table, InputError> {
    let (drive, load) = drive(data)?;
    let mut table = Table {
        device: Device::new(calibrator.named.sensor, drive),
        readings: Vec::new(),
        profiles: Vec::new(),
        path: Vec::new(),
    };
    match (data.given[VOLTAGE_AT], data.given[FIRST_PEAK]) {
        (true, false) => samples(data, load, &mut table)?,
        (false, true) => peaks(data, load, &mut table)?,
        (both, _) => {
            let message = if both {
                "a voltage over time and peaks are both there"
            } else {
                "there is neither a voltage over time nor a peak"
            };
            let help = "give time and voltage [mV] of a recording, or ramp, a1 [mV] and a2 [mV] of test loads";
            return Err(data.error("voltage", message, help));
        }
    }
    clipped(calibrator, &mut table, remarks);
    table.loads(&table.readings).enough(data)?;
    one_moment(data, &table)?;
    plausible(calibrator, data, &table)?;
    Ok(table)
}

/// Refuses a recording whose voltages would follow its load if they had been read
/// earlier or later.
fn one_moment(data: &ReadingTable, table: &Table) -> Result<(), InputError> {
    let drawn = table.device.drawn();
    let model = table
        .device
        .voltages(&table.profiles, &table.readings, &table.path, &drawn);
    let (Some(model), false) = (model, table.path.is_empty()) else {
        return Ok(());
    };
    let pairs = model.into_iter().zip(&table.readings);
    let series = pairs.map(|(model, read)| [model, read.voltage]).collect();
    let steps = table.path.windows(2).map(|pair| pair[1][0] - pair[0][0]);
    let column = table.loads(&[]).column;
    no_delay(data, column, &[series], steps.collect())
}

fn drive(data: &ReadingTable) -> Result<(Drive, usize), InputError> {
    match (data.given[DISPLACEMENT], data.given[FORCE_Z]) {
        (true, false) => Ok((Drive::Displacement, DISPLACEMENT)),
        (false, true) => Ok((Drive::Force, FORCE_Z)),
        (both, _) => {
            let message = if both {
                "displacement and force_z are both there"
            } else {
                "there is neither displacement nor force_z"
            };
            let help = "keep what the bench drives: the signal per displacement depends on the silicone, the one per \
                        force does not";
            Err(data.error("displacement", message, help))
        }
    }
}

fn reading(data: &ReadingTable, row: usize, load: f64, voltage: f64, what: What) -> Reading {
    Reading {
        line: data.line(row),
        load,
        voltage,
        deviation: data
            .number(row, DEVIATION)
            .filter(|deviation| *deviation > 0.0),
        marked: data.number(row, HOLD_OUT).is_some_and(|mark| mark != 0.0),
        what,
    }
}

fn samples(data: &ReadingTable, load: usize, table: &mut Table) -> Result<(), InputError> {
    if !data.given[TIME_AT] {
        return Err(data.error(
            "time",
            "a voltage over time needs its times",
            "add a column time [s]",
        ));
    }
    for row in 0..data.len() {
        let (Some(time), Some(moved)) = (data.number(row, TIME_AT), data.number(row, load)) else {
            continue;
        };
        table.path.push([time, moved]);
        if let Some(voltage) = data.number(row, VOLTAGE_AT) {
            let what = What::Sample(time);
            table
                .readings
                .push(reading(data, row, moved, voltage, what));
        }
    }
    Ok(())
}

fn peaks(data: &ReadingTable, load: usize, table: &mut Table) -> Result<(), InputError> {
    for row in 0..data.len() {
        let Some(moved) = data.number(row, load) else {
            continue;
        };
        let profile = profile(data, row)?;
        let known = table.profiles.iter().position(|known| *known == profile);
        let place = known.unwrap_or_else(|| {
            table.profiles.push(profile);
            table.profiles.len() - 1
        });
        for (column, first) in [(FIRST_PEAK, true), (SECOND_PEAK, false)] {
            if let Some(voltage) = data.number(row, column) {
                let what = What::Peak {
                    profile: place,
                    first,
                };
                table
                    .readings
                    .push(reading(data, row, moved, voltage, what));
            }
        }
    }
    Ok(())
}

/// The test load of a row: with a period cyclic, with a dwell an impact, else
/// a step.
fn profile(data: &ReadingTable, row: usize) -> Result<Profile, InputError> {
    let positive = |column: usize| data.number(row, column).filter(|x| *x > 0.0);
    let line = data.line(row);
    let Some(ramp) = positive(RAMP) else {
        let message = format!("line {line}: this test load has no ramp above zero");
        let help = "give the duration of its ramp: a sudden load would have no finite peak";
        return Err(data.error("ramp", message, help));
    };
    match (positive(PERIOD), data.number(row, DWELL)) {
        (Some(_), Some(_)) => {
            let message = format!("line {line}: a test load has a dwell or a period, not both");
            Err(data.error("dwell", message, "leave one of them empty"))
        }
        (Some(period), None) if ramp > 0.5 * period => {
            let message = format!(
                "line {line}: a ramp of {ramp} s does not fit into half a period of {period} s"
            );
            Err(data.error("ramp", message, "correct the ramp or the period"))
        }
        (Some(period), None) => Ok(Profile::Cyclic {
            ramp,
            period,
            cycles: data.number(row, CYCLES).unwrap_or(USUAL_CYCLES).round() as u32,
        }),
        (None, Some(dwell)) => Ok(Profile::Impact { ramp, dwell }),
        (None, None) => Ok(Profile::Step { ramp }),
    }
}

/// Leaves out what stands at an end of the output's range.
fn clipped(calibrator: &PiezoelectricCalibrator<'_>, table: &mut Table, remarks: &mut Vec<Remark>) {
    let [low, high] = calibrator.span;
    let most = 0.999 * high.max(-low);
    let cut: Vec<usize> = table
        .readings
        .iter()
        .filter(|r| r.voltage.abs() >= most && r.voltage.abs() < 2.0 * most)
        .map(|r| r.line)
        .collect();
    if let Some(first) = cut.first() {
        let message = format!(
            "{} readings at the end of the output's range are left out, from here on",
            cut.len()
        );
        remarks.push(Remark::at(*first, &message));
        table.readings.retain(|r| !cut.contains(&r.line));
    }
}
