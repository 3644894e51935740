//! Checks of the readings of three-axis units.

use super::columns::{
    CAPACITANCE_DEVIATION, CAPACITANCES, COLUMNS, COUNTS, FORCE_DEVIATION, FORCE_DEVIATIONS,
    FORCES, HOLD_OUT, PARALLEL, PARALLEL_DEVIATION, REST, TAXEL, TIME,
};
use super::problem::{AXES, CAPACITORS, KINDS, Measured, Reading};
use super::{ThreeAxisCalibrator, in_words, name_of};
use crate::device_model::DeviceReadings;
use crate::hysteresis::{on_loading, unloading};
use crate::loads::{LEAST_SPAN, Loads};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::split::{branches, by_series, turns};
use crate::table_checks::{follows, is_second, of_this_device, right_prefix};
use taxel::InputError;
use taxel::mechanics::{SIDE_X, SIDE_Y};
use taxel::signal::Position;
use taxel::transduction::ThreeAxisModel;
use taxel_numerics::least_squares::linear;

/// Capacitances above those of a closed gap by this factor are none, unless their unit
/// is wrong.
const ABOVE: [f64; 2] = [3.0, 100.0];
/// Least readings of a taxel: 48 capacitances for 19 unknowns.
const LEAST: usize = 12;
/// A load that turns more often than at each of so many readings is in no
/// order: noise, or forces at random.
const IN_ORDER: usize = 4;
/// A slope counts above this many of its deviations.
const CLEAR: f64 = 6.0;

/// Properties of a whole table.
pub(crate) struct Context {
    pub(super) measured: Measured,
    /// True if the rows have times, which say which readings are of unloading.
    pub(super) in_time: bool,
}

impl DeviceReadings for ThreeAxisCalibrator<'_> {
    type Reading = Reading;
    type Context = Context;

    fn readings(
        &self,
        data: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<(Context, Vec<Reading>), InputError> {
        let counts = is_counts(data)?;
        let closed = (0..4).map(|i| self.drawn.plates.closed_capacitance(i));
        let closed = closed.fold(0.0, f64::max);
        let [most, wrong_unit] = ABOVE.map(|factor| factor * closed);
        let mut readings = Vec::with_capacity(data.len());
        let (mut unread, mut touching) = (Vec::new(), Vec::new());
        for row in 0..data.len() {
            let taxel = self.taxel_of(data, row)?;
            let Some(capacitance) = self.capacitances(data, row, counts) else {
                unread.push(data.line(row));
                continue;
            };
            let rest = data.flag(row, REST);
            let force = FORCES.map(|column| data.number(row, column).unwrap_or(0.0));
            if capacitance.iter().any(|c| *c > most && *c < wrong_unit) {
                touching.push(data.line(row));
                continue;
            }
            readings.push(Reading {
                taxel,
                force: if rest { [0.0; 3] } else { force },
                gauged: FORCES.map(|column| !rest && data.given[column]),
                capacitance,
                deviation: deviations(data, row),
                marked: data.flag(row, HOLD_OUT),
            });
        }
        let what = "readings without four capacitances, or with a clipped code, are left out";
        remarks.extend(Remark::from_here_on(&unread, what));
        let what = "readings above what a closed gap can give are left out";
        remarks.extend(Remark::from_here_on(&touching, what));
        let mut context = Context {
            measured: None,
            in_time: data.given[TIME],
        };
        for of in by_series(&readings) {
            for loads in self.loads(&context, &of) {
                loads.enough(data)?;
            }
            channels(data, &of)?;
            self.units(data, &of)?;
        }
        if readings.is_empty() {
            let help = "give four capacitances or four codes in each row";
            return Err(data.error("capacitance_11", "no row has a complete reading", help));
        }
        context.measured = measured(data)?;
        if !context.in_time {
            let message = "without a column time all readings are fitted as of loading";
            remarks.push(Remark::whole(message));
        }
        Ok((context, readings))
    }

    /// Those at which no axis unloads.
    fn loading(
        &self,
        context: &Context,
        of: &[Reading],
        remarks: &mut Vec<Remark>,
    ) -> Vec<Reading> {
        if !context.in_time {
            return of.to_vec();
        }
        let mut down = vec![false; of.len()];
        for axis in 0..AXES.len() {
            let forces: Vec<f64> = of.iter().map(|r| r.force[axis]).collect();
            let sizes: Vec<f64> = forces.iter().map(|force| force.abs()).collect();
            if IN_ORDER * turns(&branches(&sizes)) > of.len() {
                continue;
            }
            for (down, unloading) in down.iter_mut().zip(unloading(&forces)) {
                *down |= unloading;
            }
        }
        on_loading(&name_of(of), of, &down, "", remarks)
    }

    /// The normal forces, and the side forces that a gauge read.
    fn loads(&self, _: &Context, of: &[Reading]) -> Vec<Loads> {
        let names = ["force_x", "force_y", "force_z"];
        let along = |axis: usize| Loads {
            name: in_words(of),
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
}

impl ThreeAxisCalibrator<'_> {
    fn capacitances(&self, data: &ReadingTable, row: usize, counts: bool) -> Option<[f64; 4]> {
        let columns = if counts { COUNTS } else { CAPACITANCES };
        let mut found = [0.0; 4];
        for (place, column) in found.iter_mut().zip(columns) {
            let value = data.number(row, column)?;
            *place = if counts {
                Some(self.channel.input(value))
                    .filter(|_| self.channel.position(value) == Position::Inside)?
            } else {
                value
            };
        }
        Some(found)
    }

    fn taxel_of(&self, data: &ReadingTable, row: usize) -> Result<usize, InputError> {
        let Some(number) = data.number(row, TAXEL) else {
            return Ok(0);
        };
        let count = self.made.len();
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

    /// True if capacitances and forces can be of this sensor.
    fn units(&self, data: &ReadingTable, of: &[Reading]) -> Result<(), InputError> {
        let (rest, drawn) = (rest_of(of), self.drawn.rest());
        for (i, capacitor) in CAPACITORS.iter().enumerate() {
            let column = format!("capacitance_{capacitor}");
            let rows: Vec<_> = of.iter().map(|r| (r.force, r.capacitance[i])).collect();
            let name = format!("{}: capacitor {capacitor}", in_words(of));
            follows(data, &column, &name, &rows)?;
            right_prefix(data, &column, rest[i] / drawn[i], "")?;
            let name = format!("{}: capacitor {capacitor} has ", in_words(of));
            let words = |c: f64| format!("{:.1} fF", c * 1e15);
            let help =
                "name the sensor file of this device, or mask the taxel's channel and leave it out";
            of_this_device(data, &column, &name, [rest[i], drawn[i]], words, help)?;
        }
        for (axis, name) in AXES.iter().enumerate() {
            let Some([slope, deviation]) = compliance(&self.drawn, of, axis) else {
                continue;
            };
            if slope.abs() > CLEAR * deviation {
                let ratio = self.drawn.suspension.compliance[axis][axis] / slope.abs();
                right_prefix(data, &format!("force_{name}"), ratio, "")?;
            }
        }
        Ok(())
    }
}

/// Deviations of the forces along x, y and z and of a capacitance that a row gives; a force
/// of deviation 0 is exact.
fn deviations(data: &ReadingTable, row: usize) -> [Option<f64>; KINDS] {
    let of = |column: usize| data.number(row, column).filter(|value| *value >= 0.0);
    let [x, y, z] = FORCE_DEVIATIONS.map(|column| of(column).or_else(|| of(FORCE_DEVIATION)));
    [x, y, z, data.positive(row, CAPACITANCE_DEVIATION)]
}

/// Parallel capacitances that the table gives, from its first row that has
/// them.
fn measured(data: &ReadingTable) -> Result<Measured, InputError> {
    if !PARALLEL.iter().any(|column| data.given[*column]) {
        return Ok(None);
    }
    for row in 0..data.len() {
        let values = PARALLEL.map(|column| data.number(row, column));
        let deviation = data.positive(row, PARALLEL_DEVIATION);
        if let ([Some(a), Some(b), Some(c), Some(d)], Some(deviation)) = (values, deviation) {
            return Ok(Some(([a, b, c, d], deviation)));
        }
    }
    let help = "give all four, and parallel_capacitance_deviation above zero, in the same row";
    let message = "no row has the four parallel capacitances and their deviation";
    Err(data.error("parallel_capacitance_11", message, help))
}

fn is_counts(data: &ReadingTable) -> Result<bool, InputError> {
    let there = [CAPACITANCES, COUNTS].map(|four| four.iter().all(|column| data.given[*column]));
    let titles = CAPACITANCES.map(|column| COLUMNS[column].title());
    let help = format!("give {}; or counts_11 to counts_22", titles.join(", "));
    let messages = [
        "capacitances and codes are both there",
        "capacitances (or codes) of the four capacitors are missing",
    ];
    is_second(data, there, "capacitance_11", messages, &help)
}

/// Displacement of a unit of the drawn air gaps along an axis for the force that a
/// gauge read, with its deviation, m/N; `None` where the forces do not determine it.
pub(super) fn compliance(unit: &ThreeAxisModel, of: &[Reading], axis: usize) -> Option<[f64; 2]> {
    let rest = rest_of(of);
    let gauged: Vec<&Reading> = of.iter().filter(|r| r.gauged[axis]).collect();
    let design: Vec<Vec<f64>> = gauged.iter().map(|r| vec![r.force[axis], 1.0]).collect();
    let motion = |r: &&Reading| unit.effective_motion(rest, r.capacitance).displacement[axis];
    let target: Vec<f64> = gauged.iter().map(motion).collect();
    let line = linear::solve(&design, &target)?;
    let variance = line.misfit / (target.len().max(3) - 2) as f64;
    Some([
        line.coefficients[0],
        (variance * line.covariance[0][0]).sqrt(),
    ])
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

/// True if each channel rises and falls with the side forces as its place
/// under the bump demands; names channels that are swapped.
fn channels(data: &ReadingTable, of: &[Reading]) -> Result<(), InputError> {
    let name = in_words(of);
    let axes: Vec<usize> = (0..3)
        .filter(|axis| of.iter().any(|r| r.gauged[*axis]))
        .collect();
    let Some(signs) = signs(of, &axes) else {
        return Ok(());
    };
    if axes.contains(&2) && signs.iter().all(|sign| sign[2] == -1.0) {
        let message = format!("{name}: all capacitances fall when force_z rises");
        let help = "turn the sign of the column; pressing is positive";
        return Err(data.error("force_z", message, help));
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
    let message = format!("{name}: channels are swapped: {}", moved.join(", "));
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
