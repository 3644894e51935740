//! Check of each column of voltages: peaks in the direction of loading, peaks against it,
//! or an output over time.

use super::problem::{Reading, Table, What};
use super::{InputError, PiezoelectricCalibrator, ReadingTable};
use crate::loads::range;
use crate::table_checks::right_prefix;

/// A finding on a column counts above this many deviations. A column of the right model
/// falls behind its mean with half as many: once in 700 tables at worst.
const CLEAR: f64 = 6.0;
/// Exchanged columns must explain so much of the squared misfit: three
/// quarters. What hysteresis or drift take from the peaks of one direction, the
/// leak takes up.
const EXPLAINED: f64 = 0.75;

/// A column of voltages, and whether a reading is of it.
type Column = (&'static str, fn(&Reading) -> bool);

const VOLTAGES: [Column; 3] = [
    ("voltage", |r| matches!(r.what, What::Sample(_))),
    ("a1", |r| matches!(r.what, What::Peak { first: true, .. })),
    ("a2", |r| matches!(r.what, What::Peak { first: false, .. })),
];

/// Voltages of the columns that the table has, each beside the model `at`.
fn by_column(table: &Table, at: &[f64]) -> Vec<(&'static str, Vec<[f64; 2]>)> {
    let pairs = table.beside_model(&table.readings, at);
    let of = |(name, holds): Column| {
        let own = pairs.clone().filter(|(reading, _)| holds(reading));
        (name, own.map(|(r, model)| [r.voltage, model]).collect())
    };
    let columns = VOLTAGES.into_iter().map(of);
    columns
        .filter(|(_, pairs): &(_, Vec<_>)| !pairs.is_empty())
        .collect()
}

/// Readings and model of one column in sums.
struct Sums {
    count: f64,
    /// Sum of squares of readings and of model about their means.
    scatter: [f64; 2],
    /// Sum of squares of their differences.
    misfit: f64,
}

impl Sums {
    fn of(pairs: &[[f64; 2]]) -> Self {
        let count = pairs.len() as f64;
        let scatter = |k: usize| {
            let mean = pairs.iter().map(|pair| pair[k]).sum::<f64>() / count;
            pairs.iter().map(|pair| (pair[k] - mean).powi(2)).sum()
        };
        Self {
            count,
            scatter: [scatter(0), scatter(1)],
            misfit: pairs
                .iter()
                .map(|[read, model]| (read - model).powi(2))
                .sum(),
        }
    }

    /// True if the model moves clearly more than readings that are noise and
    /// nothing else, of at least the `deviation` of the board.
    fn is_clear(&self, deviation: f64) -> bool {
        let variance = (self.scatter[0] / self.count).max(deviation * deviation);
        self.scatter[1] > CLEAR * CLEAR * variance
    }
}

impl PiezoelectricCalibrator<'_> {
    /// Names a column that stands still, has a turned sign, or is a factor of a
    /// thousand from the drawing.
    pub(super) fn plausible(&self, data: &ReadingTable, table: &Table) -> Result<(), InputError> {
        for (column, pairs) in by_column(table, &table.device.drawn()) {
            let [low, high] = range(pairs.iter().map(|pair| pair[0]));
            if low >= high && Sums::of(&pairs).is_clear(self.deviation) {
                let unit = &self.unit;
                let message = format!(
                    "{column} is always {:.4} {} while the load changes",
                    low / unit.si_per_unit,
                    unit.symbol
                );
                let help = format!(
                    "give the {}s that the board read, in {}; leave out a column that was not read",
                    unit.quantity, unit.symbol
                );
                return Err(data.error(column, message, &help));
            }
            unit(data, column, &pairs)?;
        }
        Ok(())
    }

    /// Names columns that are exchanged, or that the fit `at` explains no better than
    /// their mean does.
    pub(super) fn fits_its_columns(
        &self,
        data: &ReadingTable,
        table: &Table,
        at: &[f64],
    ) -> Result<(), InputError> {
        let columns = by_column(table, at);
        let sums: Vec<Sums> = columns.iter().map(|(_, pairs)| Sums::of(pairs)).collect();
        let squares: f64 = sums.iter().map(|sums| sums.misfit).sum();
        self.exchanged(data, table, squares)?;
        let behind = |sums: &Sums| sums.misfit >= sums.scatter[0];
        let worst = sums
            .iter()
            .position(|sums| behind(sums) && sums.is_clear(self.deviation));
        let scatter: f64 = sums.iter().map(|sums| sums.scatter[0]).sum();
        let place = match worst {
            Some(place) => place,
            None if squares >= scatter => 0,
            None => return Ok(()),
        };
        let Some((column, _)) = columns.get(place) else {
            return Ok(());
        };
        let (unit, quantity) = (self.unit.symbol, self.unit.quantity);
        let root = |square: f64| (square / sums[place].count).sqrt() / self.unit.si_per_unit;
        let message = format!(
            "the model fits {column} to {:.4} {unit}, no better than its mean does ({:.4} {unit}): these {quantity}s do not \
             belong to these loads",
            root(sums[place].misfit),
            root(sums[place].scatter[0]),
        );
        let help = format!(
            "is each row's {quantity} of its own load, and the test load as in ramp, dwell and period?"
        );
        Err(data.error(column, message, &help))
    }

    /// Names peaks of loading and of unloading that are exchanged.
    fn exchanged(&self, data: &ReadingTable, table: &Table, misfit: f64) -> Result<(), InputError> {
        let turned = |reading: &Reading| match reading.what {
            What::Peak { profile, first } => Some(Reading {
                what: What::Peak {
                    profile,
                    first: !first,
                },
                ..*reading
            }),
            What::Sample(_) => None,
        };
        let turned: Option<Vec<Reading>> = table.readings.iter().map(turned).collect();
        // A misfit within what the board reads needs no explanation.
        let within = table.readings.len() as f64 * self.deviation.powi(2);
        let Some(turned) = turned.filter(|_| misfit > within) else {
            return Ok(());
        };
        let drawn = table.device.drawn();
        let ratio = table.ratio(&turned, &drawn);
        let pairs = table.beside_model(&turned, &drawn);
        let other: f64 = pairs.map(|(r, m)| (r.voltage - ratio * m).powi(2)).sum();
        // Twice the logarithm of a likelihood is of chi-square.
        let better = turned.len() as f64 * (misfit / other).ln();
        if other > (1.0 - EXPLAINED) * misfit || better < CLEAR * CLEAR {
            return Ok(());
        }
        let (unit, scale) = (self.unit.symbol, self.unit.si_per_unit);
        let message = format!(
            "a1 and a2 are exchanged: the other way round the drawing fits to {:.4} {unit}, as given to {:.4} {unit}",
            (other / turned.len() as f64).sqrt() / scale,
            (misfit / turned.len() as f64).sqrt() / scale
        );
        let help =
            "rename the columns: a1 is the peak in the direction of loading, a2 the one against it";
        Err(data.error("a1", message, help))
    }
}

/// Names a factor of a thousand, or a turned sign.
fn unit(data: &ReadingTable, column: &str, pairs: &[[f64; 2]]) -> Result<(), InputError> {
    let square: f64 = pairs.iter().map(|[_, model]| model * model).sum();
    let ratio = pairs.iter().map(|[read, model]| read * model).sum::<f64>() / square;
    let misfit = pairs
        .iter()
        .map(|[read, model]| (read - ratio * model).powi(2));
    let deviation = (misfit.sum::<f64>() / pairs.len() as f64 / square).sqrt();
    // Not a number where the drawing gives no voltage.
    let clear = ratio.abs() > CLEAR * deviation;
    if !clear {
        return Ok(());
    }
    if ratio < 0.0 {
        let message = "the readings have the other sign than the board of the drawing gives";
        let help = "turn the sign of the readings, or of the load; pressing is positive, and so are both peaks";
        return Err(data.error(column, message, help));
    }
    right_prefix(data, column, ratio, "")
}
