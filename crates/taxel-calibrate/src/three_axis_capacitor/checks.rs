//! Checks of the readings of three-axis units.

use super::columns::{
    CAPACITANCE_AT, COLUMNS, COUNTS_AT, DEVIATION_AT, FORCE_AT, HOLD_OUT, PARALLEL_AT,
    PARALLEL_DEVIATION, REST, TAXEL,
};
use super::problem::{AXES, CAPACITORS, Measured, Reading};
use super::{InputError, ReadingTable, Remark, ThreeAxisCalibrator};
use crate::loads::{LEAST_SPAN, Loads, right_prefix};
use crate::split::by_series;
use taxel::mechanics::{SIDE_X, SIDE_Y};
use taxel_numerics::least_squares::linear;

/// A rest capacitance off by more than this factor is of another sensor.
const OTHER: f64 = 3.0;
/// Least readings of a taxel: 48 capacitances for 19 unknowns.
const LEAST: usize = 12;
/// A slope counts above this many of its deviations.
const CLEAR: f64 = 6.0;

/// The readings of `data` with their taxels, checked.
pub(super) fn readings(
    calibrator: &ThreeAxisCalibrator<'_>,
    data: &ReadingTable,
    remarks: &mut Vec<Remark>,
) -> Result<Vec<Reading>, InputError> {
    let counts = is_counts(data)?;
    let mut readings = Vec::with_capacity(data.len());
    let (mut unread, mut too_high) = (Vec::new(), Vec::new());
    for row in 0..data.len() {
        let taxel = taxel(calibrator, data, row)?;
        let line = data.line(row);
        let Some(capacitance) = capacitances(calibrator, data, row, counts) else {
            unread.push(line);
            continue;
        };
        let rest = data.number(row, REST).is_some_and(|rest| rest != 0.0);
        let force = FORCE_AT.map(|column| data.number(row, column).unwrap_or(0.0));
        let reading = Reading {
            taxel,
            line,
            force: if rest { [0.0; 3] } else { force },
            gauged: FORCE_AT.map(|column| !rest && data.given[column]),
            capacitance,
            deviation: DEVIATION_AT.map(|column| {
                data.number(row, column)
                    .filter(|deviation| *deviation > 0.0)
            }),
            marked: data.number(row, HOLD_OUT).is_some_and(|mark| mark != 0.0),
        };
        let closed = |i: usize| calibrator.drawn.plates.closed_capacitance(i);
        let most = (0..4).map(closed).fold(0.0, f64::max);
        if capacitance
            .iter()
            .any(|c| *c > OTHER * most && *c < 100.0 * most)
        {
            too_high.push(line);
        } else {
            readings.push(reading);
        }
    }
    for (lines, what) in [
        (
            &unread,
            "readings without four capacitances, or with a clipped code, are left out",
        ),
        (
            &too_high,
            "readings above what a closed gap can give are left out",
        ),
    ] {
        if let Some(first) = lines.first() {
            let message = format!("{} {what}, from here on", lines.len());
            remarks.push(Remark::at(*first, &message));
        }
    }
    for of in by_series(&readings) {
        for loads in loads(&of) {
            loads.enough(data)?;
        }
        channels(data, of[0].taxel, &of)?;
        units(calibrator, data, of[0].taxel, &of)?;
    }
    if readings.is_empty() {
        let help = "give four capacitances or four codes in each row";
        return Err(data.error("capacitance_11", "no row has a complete reading", help));
    }
    Ok(readings)
}

/// Parallel capacitances that the table gives, from its first row that has
/// them.
pub(super) fn measured(data: &ReadingTable) -> Result<Measured, InputError> {
    if !PARALLEL_AT.iter().any(|column| data.given[*column]) {
        return Ok(None);
    }
    for row in 0..data.len() {
        let values = PARALLEL_AT.map(|column| data.number(row, column));
        let deviation = data.number(row, PARALLEL_DEVIATION).filter(|d| *d > 0.0);
        if let ([Some(a), Some(b), Some(c), Some(d)], Some(deviation)) = (values, deviation) {
            return Ok(Some(([a, b, c, d], deviation)));
        }
    }
    let help = "give all four, and parallel_capacitance_deviation above zero, in the same row";
    let message = "no row has the four parallel capacitances and their deviation";
    Err(data.error("parallel_capacitance_11", message, help))
}

fn is_counts(data: &ReadingTable) -> Result<bool, InputError> {
    let all = |columns: [usize; 4]| columns.iter().all(|column| data.given[*column]);
    match (all(CAPACITANCE_AT), all(COUNTS_AT)) {
        (true, false) => Ok(false),
        (false, true) => Ok(true),
        (both, _) => {
            let message = if both {
                "capacitances and codes are both there"
            } else {
                "capacitances (or codes) of the four capacitors are missing"
            };
            let titles: Vec<String> = CAPACITANCE_AT
                .iter()
                .map(|column| COLUMNS[*column].title())
                .collect();
            let help = format!("give {}; or counts_11 to counts_22", titles.join(", "));
            Err(data.error("capacitance_11", message, &help))
        }
    }
}

fn capacitances(
    calibrator: &ThreeAxisCalibrator<'_>,
    data: &ReadingTable,
    row: usize,
    counts: bool,
) -> Option<[f64; 4]> {
    let columns = if counts { COUNTS_AT } else { CAPACITANCE_AT };
    let mut found = [0.0; 4];
    for (place, column) in found.iter_mut().zip(columns) {
        let value = data.number(row, column)?;
        *place = if counts {
            calibrator.channel.capacitance(value)?
        } else {
            value
        };
    }
    Some(found)
}

fn taxel(
    calibrator: &ThreeAxisCalibrator<'_>,
    data: &ReadingTable,
    row: usize,
) -> Result<usize, InputError> {
    let Some(number) = data.number(row, TAXEL) else {
        return Ok(0);
    };
    let count = calibrator.made.len();
    if number.fract() == 0.0 && number >= 0.0 && (number as usize) < count {
        return Ok(number as usize);
    }
    let message = format!(
        "line {}: {number} is no taxel of this sensor",
        data.line(row)
    );
    let help = format!("taxels are numbered row by row from 0 to {}", count - 1);
    Err(data.error("taxel", message, &help))
}

/// The loads of one taxel: the normal forces, and the side forces that a gauge read.
pub(super) fn loads(of: &[Reading]) -> Vec<Loads> {
    let names = ["force_x", "force_y", "force_z"];
    let along = |axis: usize| Loads {
        name: format!("taxel {}", super::taxel(of)),
        column: names[axis],
        unit: ("N", 1.0),
        values: if axis == 2 {
            of.iter().map(|r| r.force[axis]).collect()
        } else {
            let gauged = of.iter().filter(|r| r.gauged[axis]);
            gauged.map(|r| r.force[axis]).collect()
        },
        least: if axis == 2 { LEAST } else { 0 },
        span: LEAST_SPAN,
        from_rest: axis == 2,
    };
    let all = [2, 0, 1].map(along).into_iter();
    all.filter(|loads| loads.from_rest || !loads.values.is_empty())
        .collect()
}

/// Capacitances at rest: the mean of the readings without load, or else of the
/// fiftieth part with the least load.
pub(super) fn rest_of(of: &[Reading]) -> [f64; 4] {
    let size = |r: &Reading| r.force.iter().map(|f| f * f).sum::<f64>();
    let mut sorted: Vec<&Reading> = of.iter().collect();
    sorted.sort_by(|a, b| size(a).total_cmp(&size(b)));
    let free = sorted.iter().filter(|r| size(r) == 0.0).count();
    let few = free.max(of.len() / 50).max(1).min(of.len());
    std::array::from_fn(|i| {
        let sum: f64 = sorted.iter().take(few).map(|r| r.capacitance[i]).sum();
        sum / few.max(1) as f64
    })
}

/// Checks that capacitances and forces can be of this sensor.
fn units(
    calibrator: &ThreeAxisCalibrator<'_>,
    data: &ReadingTable,
    taxel: usize,
    of: &[Reading],
) -> Result<(), InputError> {
    let rest = rest_of(of);
    let drawn = calibrator.drawn.rest();
    for i in 0..4 {
        let column = format!("capacitance_{}", CAPACITORS[i]);
        let ratio = rest[i] / drawn[i];
        right_prefix(data, &column, ratio, "")?;
        if !(1.0 / OTHER..=OTHER).contains(&ratio) {
            let message = format!(
                "taxel {taxel}: capacitor {} has {:.1} fF at rest; the sensor file says {:.1} fF",
                CAPACITORS[i],
                rest[i] * 1e15,
                drawn[i] * 1e15
            );
            let help =
                "name the sensor file of this device, or mask the taxel's channel and leave it out";
            return Err(data.error(&column, message, help));
        }
    }
    let compliance = calibrator.drawn.suspension.compliance;
    for axis in 0..3 {
        let gauged: Vec<&Reading> = of.iter().filter(|r| r.gauged[axis]).collect();
        let motion = |r: &&Reading| {
            calibrator
                .drawn
                .effective_motion(rest, r.capacitance)
                .displacement[axis]
        };
        let design: Vec<Vec<f64>> = gauged.iter().map(|r| vec![r.force[axis], 1.0]).collect();
        let target: Vec<f64> = gauged.iter().map(motion).collect();
        if let Some(line) = linear::solve(&design, &target) {
            let variance = line.misfit / (target.len().max(3) - 2) as f64;
            let slope = line.coefficients[0].abs();
            if slope <= CLEAR * (variance * line.covariance[0][0]).sqrt() {
                continue;
            }
            let ratio = compliance[axis][axis] / slope;
            right_prefix(data, &format!("force_{}", AXES[axis]), ratio, "")?;
        }
    }
    Ok(())
}

/// Checks that each channel rises and falls with the side forces as its place
/// under the bump demands; names channels that are swapped.
fn channels(data: &ReadingTable, taxel: usize, of: &[Reading]) -> Result<(), InputError> {
    let axes: Vec<usize> = (0..3)
        .filter(|axis| of.iter().any(|r| r.gauged[*axis]))
        .collect();
    let Some(signs) = signs(of, &axes) else {
        return Ok(());
    };
    if axes.contains(&2) && signs.iter().all(|sign| sign[2] == -1.0) {
        let message = format!("taxel {taxel}: all capacitances fall when force_z rises");
        return Err(data.error(
            "force_z",
            message,
            "turn the sign of the column; pressing is positive",
        ));
    }
    let agrees = |channel: usize, capacitor: usize| {
        let wanted = [SIDE_X[capacitor], SIDE_Y[capacitor]];
        (0..2).all(|axis| signs[channel][axis] == 0.0 || signs[channel][axis] == wanted[axis])
    };
    if (0..4).all(|i| agrees(i, i)) {
        return Ok(());
    }
    let moved: Vec<String> = (0..4)
        .filter(|i| !agrees(*i, *i))
        .map(|i| {
            let like: Vec<&str> = (0..4)
                .filter(|j| agrees(i, *j))
                .map(|j| CAPACITORS[j])
                .collect();
            format!("{} behaves like {}", CAPACITORS[i], like.join(" or "))
        })
        .collect();
    let message = format!("taxel {taxel}: channels are swapped: {}", moved.join(", "));
    let sign = (0..2).filter(|axis| {
        let wanted = [SIDE_X, SIDE_Y][*axis];
        (0..4).all(|i| signs[i][*axis] == -wanted[i])
    });
    let sign: Vec<&str> = sign.map(|axis| AXES[axis]).collect();
    let help = if sign.is_empty() {
        "rename the columns; or force_x and force_y are swapped".to_owned()
    } else {
        format!(
            "rename the columns, or turn the sign of force_{}",
            sign.join(" and of force_")
        )
    };
    Err(data.error("capacitance_11", message, &help))
}

/// Sign of the slope of each capacitance along each axis, 0 where it is not
/// clear; `None` when the loads do not move the axes apart.
fn signs(of: &[Reading], axes: &[usize]) -> Option<[[f64; 3]; 4]> {
    let design: Vec<Vec<f64>> = of
        .iter()
        .map(|r| {
            axes.iter()
                .map(|axis| r.force[*axis])
                .chain([1.0])
                .collect()
        })
        .collect();
    let mut signs = [[0.0; 3]; 4];
    for (i, sign) in signs.iter_mut().enumerate() {
        let target: Vec<f64> = of.iter().map(|r| r.capacitance[i]).collect();
        let found = linear::solve(&design, &target)?;
        let variance = found.misfit / (of.len() - axes.len() - 1) as f64;
        for (k, axis) in axes.iter().enumerate() {
            let slope = found.coefficients[k];
            if slope.abs() > CLEAR * (variance * found.covariance[k][k]).sqrt() {
                sign[*axis] = slope.signum();
            }
        }
    }
    Some(signs)
}
