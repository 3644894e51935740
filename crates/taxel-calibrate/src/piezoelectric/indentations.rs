//! Presses at known places: a table with the place of each press and the
//! signals of all elements.

use super::columns::{CHARGES, DEVIATION, MOST_ELEMENTS, RADIUS, VOLTAGES, X, Y, with_elements};
use super::problem::Indentation;
use super::{InputError, PiezoelectricCalibrator, ReadingTable, Remark};
use crate::clock::one_clock;
use crate::loads::span;
use crate::split::picked;

/// Fewer presses are no map and leave nothing to hold out.
const LEAST: usize = 20;
/// The work grows with the third power of the presses, live with the second.
const MOST: usize = 1000;
/// Axes of the places.
const AXES: [&str; 2] = ["x", "y"];

/// True if a table is one of presses at places.
pub(super) fn has(data: &ReadingTable) -> bool {
    data.given[X] && data.given[Y]
}

impl PiezoelectricCalibrator<'_> {
    /// The presses of `data`, checked.
    pub(super) fn indentations(
        &self,
        data: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<Vec<Indentation>, InputError> {
        one_clock(data, with_elements(&self.unit))?;
        let (name, first, per_newton) = self.channels(data)?;
        let elements = self.layout.taxels();
        let usual = (self.deviation / self.output_per_newton).abs();
        let (mut all, mut lines, mut short) = (Vec::new(), Vec::new(), Vec::new());
        for row in 0..data.len() {
            let [x, y] = [X, Y].map(|column| data.number(row, column));
            let read = (0..elements).map(|element| data.number(row, first + element));
            let (Some(x), Some(y), Some(read)) = (x, y, read.collect::<Option<Vec<f64>>>()) else {
                short.push(data.line(row));
                continue;
            };
            let own = data.positive(row, DEVIATION);
            let press = Indentation {
                deviation: own.map_or(usual, |own| (own / per_newton).abs()),
                forces: read.iter().map(|signal| signal / per_newton).collect(),
                place: [x, y],
                radius: data.positive(row, RADIUS),
            };
            self.inside(data, row, &press)?;
            all.push(press);
            lines.push(data.line(row));
        }
        let is_weak: Vec<bool> = all.iter().map(Indentation::is_weak).collect();
        let presses = picked(&all, &is_weak, false);
        let weak = picked(&lines, &is_weak, true);
        turned(data, &presses, weak.len())?;
        let what = "presses without place or without all signals are left out";
        remarks.extend(Remark::from_here_on(&short, what));
        let what = "presses hardly above the noise are left out";
        remarks.extend(Remark::from_here_on(&weak, what));
        let count = presses.len();
        if !(LEAST..=MOST).contains(&count) {
            let message =
                format!("there are {count} usable presses; must be from {LEAST} to {MOST}");
            return Err(data.error("x", message, "press at positions 0.5 to 1 mm apart"));
        }
        self.spanned(data, &presses)?;
        // The weak ones, too: over an element whose signal is wrong all may be.
        self.answers(data, name, &all)?;
        Ok(presses)
    }

    /// Length of the array along an axis with so many elements more, m.
    fn length(&self, axis: usize, more: f64) -> f64 {
        let cells = [self.layout.columns, self.layout.rows][axis];
        (cells as f64 + more) * self.layout.pitch[axis]
    }

    /// Presses along one line say nothing of the places beside it.
    fn spanned(&self, data: &ReadingTable, presses: &[Indentation]) -> Result<(), InputError> {
        for (axis, name) in AXES.into_iter().enumerate() {
            let reach = span(presses.iter().map(|press| press.place[axis]));
            let least = 0.5 * self.length(axis, -1.0);
            if reach < least {
                let message = format!(
                    "the presses span {:.4} mm along {name}; at least {:.4} mm are needed",
                    1e3 * reach,
                    1e3 * least
                );
                return Err(data.error(name, message, "press all over the elements"));
            }
        }
        Ok(())
    }

    /// Name of the signals, column of the first element's, and the signal per force.
    fn channels(&self, data: &ReadingTable) -> Result<(&'static str, usize, f64), InputError> {
        let elements = self.layout.taxels();
        let charges = ("charge", CHARGES, self.charge_per_force);
        // Of a board that gives charges a voltage says nothing.
        let kinds = match self.unit.quantity {
            "charge" => [charges; 2],
            _ => [("voltage", VOLTAGES, self.output_per_newton), charges],
        };
        let there = |first: &usize| data.given[*first..*first + MOST_ELEMENTS].contains(&true);
        let found = kinds.into_iter().find(|(_, first, _)| there(first));
        let Some((name, first, per_newton)) = found.filter(|_| elements <= MOST_ELEMENTS) else {
            let message = "a table of presses has no signal of an element";
            let help = "give voltage_1 [mV], voltage_2 [mV] ... or charge_1 [pC] ... for all elements, row by row from 1";
            return Err(data.error("voltage_1", message, help));
        };
        let missing = (0..elements).find(|element| !data.given[first + element]);
        let Some(element) = missing else {
            return Ok((name, first, per_newton));
        };
        let column = format!("{name}_{}", element + 1);
        let message = format!("column {column} is missing: the sensor has {elements} elements");
        Err(data.error(&column, message, "give the signals of all elements"))
    }

    /// A press farther than a pitch outside the outer elements is no press.
    fn inside(
        &self,
        data: &ReadingTable,
        row: usize,
        press: &Indentation,
    ) -> Result<(), InputError> {
        for (axis, name) in AXES.into_iter().enumerate() {
            let most = 0.5 * self.length(axis, 1.0);
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
