//! Presses at known places: a table with the place of each press and the
//! signals of all elements.

use super::answers::answers;
use super::columns::{CHARGES, COLUMNS, DEVIATION, MOST_ELEMENTS, PLACE, RADIUS, VOLTAGES};
use super::problem::Indentation;
use super::{InputError, PiezoelectricCalibrator, ReadingTable, Remark};
use crate::clock::one_clock;
use crate::loads::range;
use crate::split::picked;

/// Fewer presses are no map and leave nothing to hold out.
const LEAST: usize = 20;
/// The work grows with the third power of the presses, live with the second.
const MOST: usize = 1000;
/// True if a table is one of presses at places.
pub(super) fn has(data: &ReadingTable) -> bool {
    PLACE.iter().all(|column| data.given[*column])
}

/// The presses of `data`, checked.
pub(super) fn read(
    calibrator: &PiezoelectricCalibrator<'_>,
    data: &ReadingTable,
    remarks: &mut Vec<Remark>,
) -> Result<Vec<Indentation>, InputError> {
    one_clock(data, &COLUMNS)?;
    let (name, first, per_newton) = channels(calibrator, data)?;
    let elements = calibrator.layout.taxels();
    let usual = (calibrator.deviation / calibrator.volt_per_newton).abs();
    let (mut all, mut lines, mut short) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..data.len() {
        let [x, y] = PLACE.map(|column| data.number(row, column));
        let read = (0..elements).map(|element| data.number(row, first + element));
        let (Some(x), Some(y), Some(read)) = (x, y, read.collect::<Option<Vec<f64>>>()) else {
            short.push(data.line(row));
            continue;
        };
        let forces: Vec<f64> = read.iter().map(|signal| signal / per_newton).collect();
        let own = data.number(row, DEVIATION).filter(|own| *own > 0.0);
        let press = Indentation {
            deviation: own.map_or(usual, |own| (own / per_newton).abs()),
            forces,
            place: [x, y],
            radius: data.number(row, RADIUS).filter(|radius| *radius > 0.0),
        };
        inside(calibrator, data, row, &press)?;
        all.push(press);
        lines.push(data.line(row));
    }
    let is_weak: Vec<bool> = all.iter().map(Indentation::is_weak).collect();
    let (presses, weak) = (
        picked(&all, &is_weak, false),
        picked(&lines, &is_weak, true),
    );
    turned(data, &presses, weak.len())?;
    for (lines, why) in [
        (short, "without place or without all signals"),
        (weak, "hardly above the noise"),
    ] {
        if let Some(first) = lines.first() {
            let message = format!("{} presses {why} are left out, from here on", lines.len());
            remarks.push(Remark::at(*first, &message));
        }
    }
    let count = presses.len();
    if !(LEAST..=MOST).contains(&count) {
        let message = format!("there are {count} usable presses; must be from {LEAST} to {MOST}");
        return Err(data.error("x", message, "press at positions 0.5 to 1 mm apart"));
    }
    spanned(calibrator, data, &presses)?;
    // The weak ones, too: over an element whose signal is wrong all may be.
    answers(calibrator, data, name, &all)?;
    Ok(presses)
}

/// Presses along one line say nothing of the places beside it.
fn spanned(
    calibrator: &PiezoelectricCalibrator<'_>,
    data: &ReadingTable,
    presses: &[Indentation],
) -> Result<(), InputError> {
    let layout = &calibrator.layout;
    let cells = [layout.columns, layout.rows];
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let [low, high] = range(presses.iter().map(|press| press.place[axis]));
        let least = 0.5 * (cells[axis] - 1) as f64 * layout.pitch[axis];
        if high - low < least {
            let message = format!(
                "the presses span {:.4} mm along {name}; at least {:.4} mm are needed",
                1e3 * (high - low),
                1e3 * least
            );
            return Err(data.error(name, message, "press all over the elements"));
        }
    }
    Ok(())
}

/// Name of the signals, column of the first element's, and the signal per force.
fn channels(
    calibrator: &PiezoelectricCalibrator<'_>,
    data: &ReadingTable,
) -> Result<(&'static str, usize, f64), InputError> {
    let elements = calibrator.layout.taxels();
    let kinds = [
        ("voltage", VOLTAGES, calibrator.volt_per_newton),
        ("charge", CHARGES, calibrator.charge_per_force),
    ];
    let there = |first: &usize| data.given[*first..*first + MOST_ELEMENTS].contains(&true);
    let found = kinds.into_iter().find(|(_, first, _)| there(first));
    let Some((name, first, per_newton)) = found.filter(|_| elements <= MOST_ELEMENTS) else {
        let message = "a table of presses has no signal of an element";
        let help = "give voltage_1 [mV], voltage_2 [mV] ... or charge_1 [pC] ... for all elements, row by row from 1";
        return Err(data.error("voltage_1", message, help));
    };
    let missing = (0..elements).find(|element| !data.given[first + element]);
    match missing {
        None => Ok((name, first, per_newton)),
        Some(element) => {
            let column = format!("{name}_{}", element + 1);
            let message = format!("column {column} is missing: the sensor has {elements} elements");
            Err(data.error(&column, message, "give the signals of all elements"))
        }
    }
}

/// A press farther than a pitch outside the outer elements is no press.
fn inside(
    calibrator: &PiezoelectricCalibrator<'_>,
    data: &ReadingTable,
    row: usize,
    press: &Indentation,
) -> Result<(), InputError> {
    let layout = &calibrator.layout;
    let cells = [layout.columns, layout.rows];
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let most = 0.5 * (cells[axis] + 1) as f64 * layout.pitch[axis];
        if press.place[axis].abs() > most {
            let message = format!(
                "line {}: {name} = {:.4} mm is outside the array, which reaches from {:.4} to {:.4} mm",
                data.line(row),
                1e3 * press.place[axis],
                -1e3 * most,
                1e3 * most
            );
            let help = "is the unit right? the origin is the middle of the array, y grows from the last row to the first";
            return Err(data.error(name, message, help));
        }
    }
    Ok(())
}

/// Names a turned sign.
fn turned(data: &ReadingTable, presses: &[Indentation], weak: usize) -> Result<(), InputError> {
    if presses.len() >= weak {
        return Ok(());
    }
    let message =
        "most presses have no positive signal above the noise, with the gain of the drawing";
    let help = "turn the sign of the signals; pressing is positive before the board, and the drawing says whether it inverts";
    Err(data.error("voltage_1", message, help))
}
