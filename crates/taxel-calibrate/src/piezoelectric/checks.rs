//! Checks of the readings of piezoelectric elements.

use super::columns::{
    CYCLES, DEVIATION, DISPLACEMENT, DWELL, FIRST_PEAK, FORCE_Z, HOLD_OUT, PERIOD, RAMP,
    SECOND_PEAK, TIME, VOLTAGE,
};
use super::problem::{Device, Drive, Reading, Table, What};
use super::{InputError, PiezoelectricCalibrator, ReadingTable, Remark};
use crate::clock::no_delay;
use crate::device_model::DeviceReadings;
use crate::loads::Loads;
use crate::table_checks::is_second;
use taxel::mechanics::Profile;

/// Cycles of a cyclic load that does not say how many: it has settled.
const USUAL_CYCLES: f64 = 8.0;

impl DeviceReadings for PiezoelectricCalibrator<'_> {
    type Reading = Reading;
    type Context = Table;

    fn readings(
        &self,
        data: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<(Table, Vec<Reading>), InputError> {
        let (drive, load) = drive(data)?;
        let mut table = Table::new(Device::new(self.named.sensor, drive));
        let there = [data.given[VOLTAGE], data.given[FIRST_PEAK]];
        let messages = [
            "a voltage over time and peaks are both there",
            "there is neither a voltage over time nor a peak",
        ];
        let help =
            "give time and voltage [mV] of a recording, or ramp, a1 [mV] and a2 [mV] of test loads";
        if is_second(data, there, "voltage", messages, help)? {
            peaks(data, load, &mut table)?;
        } else {
            samples(data, load, &mut table)?;
        }
        self.clipped(&mut table, remarks);
        table.loads(&table.readings).enough(data)?;
        one_moment(data, &table)?;
        self.plausible(data, &table)?;
        let readings = table.readings.clone();
        Ok((table, readings))
    }

    fn loads(&self, table: &Table, of: &[Reading]) -> Vec<Loads> {
        vec![table.loads(of)]
    }
}

impl PiezoelectricCalibrator<'_> {
    /// Leaves out what stands at an end of the output's range.
    fn clipped(&self, table: &mut Table, remarks: &mut Vec<Remark>) {
        let [low, high] = self.span;
        let most = 0.999 * high.max(-low);
        let is_cut = |r: &Reading| r.voltage.abs() >= most && r.voltage.abs() < 2.0 * most;
        let cut = table.readings.iter().filter(|r| is_cut(r));
        let cut: Vec<usize> = cut.map(|r| r.line).collect();
        let what = "readings at the end of the output's range are left out";
        remarks.extend(Remark::from_here_on(&cut, what));
        table.readings.retain(|r| !cut.contains(&r.line));
    }
}

/// Refuses a recording whose voltages would follow its load if they had been read
/// earlier or later.
fn one_moment(data: &ReadingTable, table: &Table) -> Result<(), InputError> {
    if !table.is_recorded() {
        return Ok(());
    }
    let pairs = table.beside_model(&table.readings, &table.device.drawn());
    let series = pairs.map(|(read, model)| [model, read.voltage]).collect();
    let steps = table.path.windows(2).map(|pair| pair[1][0] - pair[0][0]);
    let column = table.loads(&[]).column;
    no_delay(data, column, &[series], steps.collect())
}

/// Kind of load of the bench, and its column.
fn drive(data: &ReadingTable) -> Result<(Drive, usize), InputError> {
    let there = [data.given[DISPLACEMENT], data.given[FORCE_Z]];
    let messages = [
        "displacement and force_z are both there",
        "there is neither displacement nor force_z",
    ];
    let help = "keep what the bench drives: the signal per displacement depends on the silicone, the one per \
                force does not";
    let force = is_second(data, there, "displacement", messages, help)?;
    Ok(if force {
        (Drive::Force, FORCE_Z)
    } else {
        (Drive::Displacement, DISPLACEMENT)
    })
}

fn reading(data: &ReadingTable, row: usize, load: f64, voltage: f64, what: What) -> Reading {
    Reading {
        line: data.line(row),
        load,
        voltage,
        deviation: data.positive(row, DEVIATION),
        marked: data.flag(row, HOLD_OUT),
        what,
    }
}

fn samples(data: &ReadingTable, load: usize, table: &mut Table) -> Result<(), InputError> {
    if !data.given[TIME] {
        let message = "a voltage over time needs its times";
        return Err(data.error("time", message, "add a column time [s]"));
    }
    for row in 0..data.len() {
        let (Some(time), Some(moved)) = (data.number(row, TIME), data.number(row, load)) else {
            continue;
        };
        table.path.push([time, moved]);
        if let Some(voltage) = data.number(row, VOLTAGE) {
            let read = reading(data, row, moved, voltage, What::Sample(time));
            table.readings.push(read);
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
                let read = reading(data, row, moved, voltage, what);
                table.readings.push(read);
            }
        }
    }
    Ok(())
}

/// The test load of a row: with a period cyclic, with a dwell an impact, else
/// a step.
fn profile(data: &ReadingTable, row: usize) -> Result<Profile, InputError> {
    let line = data.line(row);
    let Some(ramp) = data.positive(row, RAMP) else {
        let message = format!("line {line}: this test load has no ramp above zero");
        let help = "give the duration of its ramp: a sudden load would have no finite peak";
        return Err(data.error("ramp", message, help));
    };
    match (data.positive(row, PERIOD), data.number(row, DWELL)) {
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
