//! Checks of the readings of in-plane sensors.

use super::columns::{
    CAPACITANCE, CAPACITANCE_DEVIATION, DISPLACEMENT, FORCE_DEVIATION, FORCE_Z, GAP, HOLD_OUT, TIME,
};
use super::problem::{Load, Reading};
use super::{InPlaneCalibrator, OWN};
use crate::device_model::DeviceReadings;
use crate::hysteresis::{loss_in_words, on_loading};
use crate::loads::{LEAST_SPAN, Loads, span};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::split::{Branch, branches, turns};
use crate::table_checks::{at_rest, follows, of_this_device, pressing, right_prefix};
use taxel::InputError;
use taxel::mechanics::LARGEST_COMPRESSION;
use taxel::transduction::{CapacitanceLaw, InPlaneModel};
use taxel_numerics::least_squares::Fit;

/// A row belongs to the sensor whose drawn gap is as near as this share.
const SAME_GAP: f64 = 0.2;
/// Least readings of a sensor: its own parameters and three more.
const LEAST: usize = OWN + 3;
/// Noise that is not given starts at this share of the range.
const FIRST_NOISE: f64 = 0.01;

impl DeviceReadings for InPlaneCalibrator<'_> {
    type Reading = Reading;
    type Context = ();

    fn readings(
        &self,
        data: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<((), Vec<Reading>), InputError> {
        if !data.given[FORCE_Z] && !data.given[DISPLACEMENT] {
            let message = "neither a force nor a displacement";
            let help = "give a column force_z, displacement, or both, with their units";
            return Err(data.error("force_z", message, help));
        }
        let mut readings = Vec::with_capacity(data.len());
        let (mut beyond, mut without_load) = (Vec::new(), Vec::new());
        for row in 0..data.len() {
            let sensor = self.sensor_of(data, row)?;
            let read = |column| data.number(row, column);
            let load = match (read(DISPLACEMENT), read(FORCE_Z)) {
                (Some(displacement), Some(force)) => Load::Both {
                    displacement,
                    force,
                },
                (Some(displacement), None) => Load::Displacement(displacement),
                (None, Some(force)) => Load::Force(force),
                (None, None) => {
                    without_load.push(data.line(row));
                    continue;
                }
            };
            let Some(capacitance) = read(CAPACITANCE) else {
                continue;
            };
            let deviations = [FORCE_DEVIATION, CAPACITANCE_DEVIATION];
            let reading = Reading {
                sensor,
                time: read(TIME),
                load,
                capacitance,
                deviation: deviations.map(|column| data.positive(row, column)),
                marked: data.flag(row, HOLD_OUT),
            };
            let most = LARGEST_COMPRESSION * self.models[sensor].layer.thickness;
            if reading.displacement().is_some_and(|u| u > most) {
                beyond.push(data.line(row));
            } else {
                readings.push(reading);
            }
        }
        if data.given[DISPLACEMENT] && 2 * beyond.len() > data.len() {
            let message = format!(
                "{} of {} displacements are more than {LARGEST_COMPRESSION} of the layer",
                beyond.len(),
                data.len()
            );
            let help = "is the unit of the column right, and the sensor file?";
            return Err(data.error("displacement", message, help));
        }
        let what = format!("readings beyond a compression of {LARGEST_COMPRESSION} are left out");
        remarks.extend(Remark::from_here_on(&beyond, &what));
        let what = "rows with neither a force nor a displacement are left out";
        remarks.extend(Remark::from_here_on(&without_load, what));
        let without = readings
            .iter()
            .filter(|r| r.displacement().is_none())
            .count();
        if data.given[DISPLACEMENT] && without > 0 {
            remarks.push(Remark::whole(format!(
                "{without} readings without a displacement take their force as exact"
            )));
        }
        let without = readings.iter().filter(|r| r.force().is_none()).count();
        if without > 0 {
            remarks.push(Remark::whole(format!(
                "{without} readings without a force say nothing of the stiffness: without others \
                 that have both, forces are those of the drawing"
            )));
        }
        for sensor in 0..self.models.len() {
            self.units(data, &readings, sensor)?;
        }
        Ok(((), readings))
    }

    fn loading(&self, (): &(), of: &[Reading], remarks: &mut Vec<Remark>) -> Vec<Reading> {
        let name = self.name(of[0].sensor);
        let loads: Vec<f64> = of.iter().map(Reading::drive).collect();
        let branches = branches(&loads);
        if of.iter().all(|r| r.time.is_none()) && turns(&branches) * 8 > of.len() {
            let message = "the rows are in no order of loading; all are used as one branch";
            remarks.push(Remark::whole(format!("{name}: {message}")));
            return of.to_vec();
        }
        let note = hysteresis(of, &branches).map_or_else(String::new, |share| {
            format!("; {}", loss_in_words(share, "force"))
        });
        let unloading: Vec<bool> = branches.iter().map(|b| *b == Branch::Unloading).collect();
        on_loading(name, of, &unloading, &note, remarks)
    }

    fn loads(&self, (): &(), of: &[Reading]) -> Vec<Loads> {
        let sensor = of.first().map_or(0, |r| r.sensor);
        let forces: Option<Vec<f64>> = of.iter().map(Reading::force).collect();
        let (column, unit, values) = if let Some(forces) = forces {
            ("force_z", ("N", 1.0), forces)
        } else {
            let displacements = of.iter().filter_map(Reading::displacement);
            ("displacement", ("um", 1e-6), displacements.collect())
        };
        vec![Loads {
            name: self.name(sensor).to_owned(),
            column,
            unit,
            values,
            least: LEAST,
            span: LEAST_SPAN,
            from_rest: true,
        }]
    }
}

impl InPlaneCalibrator<'_> {
    fn sensor_of(&self, data: &ReadingTable, row: usize) -> Result<usize, InputError> {
        let mut gaps = self.models.iter().map(|model| model.electrodes.gap);
        let line = data.line(row);
        let Some(gap) = data.number(row, GAP) else {
            if self.models.len() == 1 {
                return Ok(0);
            }
            let message = format!("line {line} does not say of which sensor it is");
            let help = "add a column gap with the drawn gap of each row";
            return Err(data.error("gap", message, help));
        };
        let near = gaps.position(|drawn| (gap / drawn - 1.0).abs() <= SAME_GAP);
        near.ok_or_else(|| {
            let drawn = |model: &InPlaneModel| format!("{} um", micrometres(model));
            let drawn: Vec<String> = self.models.iter().map(drawn).collect();
            let message = format!(
                "line {line}: a gap of {:.4} um is that of none of the sensors ({})",
                gap * 1e6,
                drawn.join(", ")
            );
            let help = "name the other sensors with --with, or remove these rows";
            data.error("gap", message, help)
        })
    }

    /// True if forces and capacitances can be of this sensor.
    fn units(
        &self,
        data: &ReadingTable,
        readings: &[Reading],
        sensor: usize,
    ) -> Result<(), InputError> {
        let model = &self.models[sensor];
        let of: Vec<&Reading> = readings.iter().filter(|r| r.sensor == sensor).collect();
        if of.is_empty() {
            let gap = model.electrodes.gap * 1e6;
            let message = format!("no reading is of the sensor with a gap of {gap:.4} um");
            let help = "leave this sensor out, or add its readings";
            return Err(data.error("gap", message, help));
        }
        let forces = of.iter().filter_map(|r| r.force());
        let (column, what, most) = if let Some(most) = forces.reduce(f64::max) {
            ("force_z", "force", most)
        } else {
            let most = of.iter().map(|r| r.drive()).fold(0.0, f64::max);
            ("displacement", "displacement", most)
        };
        pressing(data, column, what, most)?;
        let rows: Vec<_> = of.iter().map(|r| ([r.drive()], r.capacitance)).collect();
        follows(data, "capacitance", self.name(sensor), &rows)?;
        let (rest, drawn) = (rest_of(readings, sensor), model.rest_capacitance());
        let expected = format!(", {:.3} fF at rest", drawn * 1e15);
        right_prefix(data, "capacitance", rest / drawn, &expected)?;
        let words = |c: f64| format!("{:.1} fF", c * 1e15);
        let help = "name the sensor file of this device";
        of_this_device(data, "capacitance", "", [rest, drawn], words, help)?;
        match expected_force(model, &of, rest) {
            Some((force, at)) => {
                right_prefix(data, "force_z", at / force, &format!(", {force:.3} N"))
            }
            None => Ok(()),
        }
    }
}

/// The drawn gap, um.
pub(super) fn micrometres(model: &InPlaneModel) -> f64 {
    (model.electrodes.gap * 1e9).round() / 1e3
}

/// The largest force by the drawing, and as read: from the displacement, or
/// from the fall of the capacitance. `None` where no force was read.
fn expected_force(model: &InPlaneModel, readings: &[&Reading], rest: f64) -> Option<(f64, f64)> {
    let read = readings.iter().filter_map(|r| Some((*r, r.force()?)));
    let (most, force) = read.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let expected = if let Some(displacement) = most.displacement() {
        let compression = displacement / model.layer.thickness;
        model.compress(compression.max(0.0)).ok()?.force
    } else {
        let mut drawn = model.clone();
        drawn.law = CapacitanceLaw::Mechanics;
        let fall = rest - most.capacitance;
        drawn.inverse().ok()?.force_from_change(fall)
    };
    (expected > 0.0).then_some((expected, force))
}

/// Capacitance at rest: the mean of a sensor's readings at its least loads.
pub(super) fn rest_of(readings: &[Reading], sensor: usize) -> f64 {
    let of = readings.iter().filter(|r| r.sensor == sensor);
    at_rest(of.map(|r| [r.drive(), r.capacitance]))
}

/// Range of a quantity over the readings of a sensor that have it.
pub(super) fn range(
    readings: &[Reading],
    sensor: usize,
    of: impl Fn(&Reading) -> Option<f64>,
) -> f64 {
    span(
        readings
            .iter()
            .filter(|r| r.sensor == sensor)
            .filter_map(of),
    )
}

/// Standard deviations of force and capacitance of each reading, and whether
/// the bench gives them all.
pub(super) fn noise(readings: &[Reading], sensors: usize) -> (Vec<[f64; 2]>, bool) {
    let ranges: Vec<[f64; 2]> = (0..sensors)
        .map(|sensor| {
            [
                range(readings, sensor, Reading::force),
                range(readings, sensor, |r| Some(r.capacitance)),
            ]
        })
        .collect();
    let with_force = readings.iter().any(Reading::has_both);
    let given = readings
        .iter()
        .all(|r| r.deviation[1].is_some() && (r.deviation[0].is_some() || !with_force));
    let of = |r: &Reading| {
        std::array::from_fn(|kind| {
            let first = (FIRST_NOISE * ranges[r.sensor][kind]).max(f64::MIN_POSITIVE);
            r.deviation[kind].unwrap_or(first)
        })
    };
    (readings.iter().map(of).collect(), given)
}

/// Replaces each noise that is not given by what the residuals show, of each
/// sensor and kind of reading; the largest relative change.
pub(super) fn weigh_again(readings: &[Reading], found: &Fit, noise: &mut [[f64; 2]]) -> f64 {
    let sensors = readings.iter().map(|r| r.sensor + 1).max().unwrap_or(0);
    let count = readings.len();
    let mut changed = 0.0_f64;
    for sensor in 0..sensors {
        for kind in 0..2 {
            // Residuals of the capacitance come first.
            let offset = if kind == 1 { 0 } else { count };
            let mut square = 0.0;
            let mut freedom = 0.0;
            for (index, reading) in readings.iter().enumerate() {
                let unknown = reading.sensor == sensor && reading.deviation[kind].is_none();
                let read = kind == 1 || reading.has_both();
                if let (true, true, Some(residual)) =
                    (unknown, read, found.residuals.get(offset + index))
                {
                    square += residual * residual;
                    freedom += 1.0 - found.leverage[offset + index];
                }
            }
            if freedom < 1.0 || square <= 0.0 {
                continue;
            }
            let factor = (square / freedom).sqrt();
            changed = changed.max((factor - 1.0).abs());
            for (reading, noise) in readings.iter().zip(noise.iter_mut()) {
                if reading.sensor == sensor && reading.deviation[kind].is_none() {
                    noise[kind] *= factor;
                }
            }
        }
    }
    changed
}

/// Hysteresis: share of force lost on unloading at the same displacement, mean over
/// the displacements; `None` without displacements or forces.
fn hysteresis(readings: &[Reading], branches: &[Branch]) -> Option<f64> {
    let curve = |wanted: Branch| -> Option<Vec<(f64, f64)>> {
        let pairs = readings.iter().zip(branches);
        let of = pairs.filter(|(_, branch)| **branch == wanted);
        let points = of.map(|(r, _)| Some((r.displacement()?, r.force()?)));
        let mut points: Vec<(f64, f64)> = points.collect::<Option<_>>()?;
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(points)
    };
    let (up, down) = (curve(Branch::Loading)?, curve(Branch::Unloading)?);
    let places: Vec<f64> = up.iter().map(|point| point.0).collect();
    let forces: Vec<f64> = up.iter().map(|point| point.1).collect();
    let inside = down
        .iter()
        .filter(|(u, _)| places.first() <= Some(u) && Some(u) <= places.last());
    let (mut lost, mut whole) = (0.0, 0.0);
    for (displacement, force) in inside {
        let loading = taxel_numerics::table::interpolate(&places, &forces, *displacement);
        lost += loading - force;
        whole += loading;
    }
    (whole > 0.0).then_some(lost / whole)
}
