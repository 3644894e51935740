//! Check that the signals of indentations are of the positions and of the elements that
//! the table says.

use super::problem::Indentation;
use super::{InputError, PiezoelectricCalibrator, ReadingTable};
use crate::loads::range;
use taxel::estimation::ProfileModel;
use taxel::mechanics::ShareTable;
use taxel_numerics::dense::dot;

/// A correlation counts above this many of its deviations.
const CLEAR: f64 = 3.0;
/// A size off by more than this is nearer to a wrong prefix than to none.
const HALF_PREFIX: f64 = 31.6;
/// An element counts as pressed when a press gives it this share of what one
/// right above it would.
const PRESSED: f64 = 0.5;
/// Columns that a message names.
const NAMED: usize = 8;

impl PiezoelectricCalibrator<'_> {
    /// Names signals that stand still or are a factor of a thousand from the
    /// others, those of other elements, and places with a turned sign.
    pub(super) fn answers(
        &self,
        data: &ReadingTable,
        name: &str,
        presses: &[Indentation],
    ) -> Result<(), InputError> {
        let model = &self.profile;
        let signals: Vec<Vec<f64>> = (0..model.rows * model.columns)
            .map(|element| presses.iter().map(|press| press.forces[element]).collect())
            .collect();
        let shares = shares(model, presses);
        let highest = |values: &Vec<f64>| values.iter().copied().fold(0.0, f64::max);
        let pressed: Vec<usize> = (0..signals.len())
            .filter(|element| highest(&shares[*element]) >= PRESSED)
            .collect();
        let column = |element: usize| format!("{name}_{}", element + 1);
        for element in &pressed {
            let [low, high] = range(signals[*element].iter().copied());
            if low >= high {
                let message = format!("{} is the same in all presses", column(*element));
                let help = "is the channel connected? mask it in the sensor file or read it again";
                return Err(data.error(&column(*element), message, help));
            }
        }
        sizes(data, &column, &pressed, &signals, &shares)?;
        let places = Places::new(&pressed, &signals, &shares);
        places.turned(data, model)?;
        places.swapped(data, &column, off(model, presses))
    }
}

/// Force of each press on each element by the drawing, over that of a press right
/// above it. An unknown radius counts as the middle one of the drawing, which
/// hardly changes where an element responds.
fn shares(model: &ProfileModel, presses: &[Indentation]) -> Vec<Vec<f64>> {
    let usual = model.radii.get(model.radii.len() / 2).copied();
    let radius = |press: &Indentation| press.radius.or(usual).unwrap_or(model.side);
    let mut tables: Vec<(f64, ShareTable)> = Vec::new();
    for radius in presses.iter().map(radius) {
        if tables.iter().all(|(known, _)| *known != radius) {
            tables.push((radius, model.cover(radius).table()));
        }
    }
    let share = |at: &[f64; 2], press: &Indentation| {
        let known = tables.iter().find(|(known, _)| *known == radius(press));
        let offset = [at[0] - press.place[0], at[1] - press.place[1]];
        let share = |(_, table): &(f64, ShareTable)| {
            table.share(offset, model.side) / table.share([0.0; 2], model.side)
        };
        known.map_or(0.0, share)
    };
    let of = |at: &[f64; 2]| presses.iter().map(|press| share(at, press)).collect();
    model.centroid().positions.iter().map(of).collect()
}

/// Names a signal whose size is not that of the others.
fn sizes(
    data: &ReadingTable,
    column: &dyn Fn(usize) -> String,
    pressed: &[usize],
    signals: &[Vec<f64>],
    shares: &[Vec<f64>],
) -> Result<(), InputError> {
    let length = |values: &[f64]| dot(values, values).sqrt();
    let size = |element: &usize| length(&signals[*element]) / length(&shares[*element]);
    let mut sorted: Vec<f64> = pressed.iter().map(size).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(middle) = sorted.get(sorted.len() / 2) else {
        return Ok(());
    };
    for element in pressed {
        let factor = size(element) / middle;
        if (1.0 / HALF_PREFIX..=HALF_PREFIX).contains(&factor) {
            continue;
        }
        let name = column(*element);
        let message = format!("{name} is {factor:.3e} times as large as the signals of the others");
        let help = "is the unit of this column right, and its channel whole?";
        return Err(data.error(&name, message, help));
    }
    Ok(())
}

/// Which element's share each signal follows.
struct Places<'a> {
    pressed: &'a [usize],
    /// Correlation of each signal with its own share.
    own: Vec<f64>,
    /// The element with the highest correlation, and the correlation.
    like: Vec<(usize, f64)>,
    /// Deviation of Fisher's z of a correlation.
    deviation: f64,
}

impl<'a> Places<'a> {
    fn new(pressed: &'a [usize], signals: &[Vec<f64>], shares: &[Vec<f64>]) -> Self {
        let standard = |all: &[Vec<f64>]| -> Vec<Vec<f64>> {
            pressed
                .iter()
                .map(|element| standardised(&all[*element]))
                .collect()
        };
        let (signals, shares) = (standard(signals), standard(shares));
        let like = |signal: &Vec<f64>| {
            let all = shares.iter().map(|share| dot(signal, share)).enumerate();
            all.fold((0, f64::NEG_INFINITY), |best, one| {
                if one.1 > best.1 { one } else { best }
            })
        };
        let count = signals.first().map_or(0, Vec::len);
        Self {
            pressed,
            own: signals
                .iter()
                .zip(&shares)
                .map(|(a, b)| dot(a, b))
                .collect(),
            like: signals.iter().map(like).collect(),
            deviation: 1.0 / (count.max(4) as f64 - 3.0).sqrt(),
        }
    }

    /// True if a signal clearly follows another element than its own.
    fn moved(&self, k: usize) -> bool {
        let (like, best) = self.like[k];
        let apart = fisher(best) - fisher(self.own[k]);
        like != k && apart > CLEAR * 2.0_f64.sqrt() * self.deviation
    }

    /// True if a signal follows the element it is most like beyond what the best
    /// of many chances gives.
    fn is_like(&self, k: usize) -> bool {
        fisher(self.like[k].1) > 2.0 * CLEAR * self.deviation
    }

    /// Names places whose sign is turned: each signal follows the mirror image
    /// of its element.
    fn turned(&self, data: &ReadingTable, model: &ProfileModel) -> Result<(), InputError> {
        if !(0..self.pressed.len()).any(|k| self.moved(k)) {
            return Ok(());
        }
        let image = |element: usize, [x, y]: [bool; 2]| {
            let (row, column) = (element / model.columns, element % model.columns);
            let turned = |at: usize, count: usize, turn| if turn { count - 1 - at } else { at };
            turned(row, model.rows, y) * model.columns + turned(column, model.columns, x)
        };
        for (axes, column, name) in [
            ([true, false], "x", "x has"),
            ([false, true], "y", "y has"),
            ([true, true], "x", "x and y have"),
        ] {
            let mirrored = |(element, (like, _)): (&usize, &(usize, f64))| {
                self.pressed[*like] == image(*element, axes)
            };
            if self.pressed.iter().zip(&self.like).all(mirrored) {
                let message = format!(
                    "{name} the other sign than the signals: each follows the mirror image of its element"
                );
                let help = "turn the sign; x grows from the first column to the last, y from the last row to the first";
                return Err(data.error(column, message, help));
            }
        }
        Ok(())
    }

    /// Names signals of other elements, and those that follow none; `off` is how far
    /// the centres of the signals lie from the places.
    fn swapped(
        &self,
        data: &ReadingTable,
        column: &dyn Fn(usize) -> String,
        off: f64,
    ) -> Result<(), InputError> {
        let silent = |k: &usize| fisher(self.own[*k]) < CLEAR * self.deviation;
        let wrong: Vec<usize> = (0..self.pressed.len())
            .filter(|k| self.moved(*k) || silent(k))
            .collect();
        let Some(first) = wrong.first() else {
            return Ok(());
        };
        if wrong.len() > NAMED.max(self.pressed.len() / 2) || wrong.len() == self.pressed.len() {
            let message = format!(
                "the positions do not belong to these signals: {} of {} do not follow their elements, and the centres of \
                 the signals lie {:.2} mm (root mean square) from the positions",
                wrong.len(),
                self.pressed.len(),
                1e3 * off
            );
            let help = "is each row's place of its own press, and are x and y those of the sensor?";
            return Err(data.error("x", message, help));
        }
        let name = |k: usize| column(self.pressed[k]);
        let words: Vec<String> = wrong
            .iter()
            .map(|k| {
                if self.moved(*k) && self.is_like(*k) {
                    format!("{} behaves like {}", name(*k), name(self.like[*k].0))
                } else {
                    format!("{} does not answer to presses over its element", name(*k))
                }
            })
            .collect();
        let help = "rename columns that are swapped; turn the sign of one that falls, or read its channel again";
        Err(data.error(&name(*first), words.join(", "), help))
    }
}

/// Values less their mean, of length one; zeros where they are all the same.
fn standardised(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let left: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let length = dot(&left, &left).sqrt();
    left.iter()
        .map(|x| x / length.max(f64::MIN_POSITIVE))
        .collect()
}

/// Fisher's z of a correlation, which is nearly normal.
fn fisher(correlation: f64) -> f64 {
    // An exact one would be infinite.
    correlation.clamp(-0.999_999, 0.999_999).atanh()
}

/// Root of the mean square distance of the signals' centres from the places, m.
fn off(model: &ProfileModel, presses: &[Indentation]) -> f64 {
    let positions = model.centroid().positions;
    let square = |press: &Indentation| {
        let sum = press.forces.iter().map(|force| force.max(0.0)).sum::<f64>();
        let along = |axis: usize| {
            let pairs = press.forces.iter().zip(&positions);
            let centre: f64 = pairs.map(|(force, at)| force.max(0.0) * at[axis]).sum();
            centre / sum.max(f64::MIN_POSITIVE) - press.place[axis]
        };
        along(0).powi(2) + along(1).powi(2)
    };
    (presses.iter().map(square).sum::<f64>() / presses.len() as f64).sqrt()
}
