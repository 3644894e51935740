//! Results of the fits of three-axis units.

use super::problem::{AXES, CAPACITORS, COMPLIANCE, GAP, Reading, far_enough, misfit};
use super::stiffness::{Observation, fit_stiffness};
use super::{Fitted, PREFIX, Remark, ThreeAxisCalibrator, linear, taxel};
use crate::hysteresis::loss_in_words;
use crate::loads::range;
use crate::outcome::{Derived, ResidualSummary, Scope, open_in_words};
use crate::split::{Branch, branches};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::transduction::UnitModel;
use taxel_numerics::least_squares::{Status, student_quantile};

/// Taxels of which a report shows figures.
const SHOWN: usize = 8;
/// Steps from the gauge's force to that of the capacitances: Newton's, so that
/// a tenth between them becomes 1e-8.
const STEPS: usize = 4;
/// Less force at unloading than this is not worth a remark.
const WORTH_A_REMARK: f64 = 0.005;

/// Readings of a taxel that it was fitted to, or was not.
type Pair<'a> = (&'a Fitted, &'a Vec<Reading>);

pub(super) fn scope(series: &[Vec<Reading>]) -> Vec<Scope> {
    let of = |axis: usize| Scope {
        name: format!("force_{}", AXES[axis]),
        unit: "N",
        range: range(series.iter().flatten().map(|r| r.force[axis])),
    };
    (0..3).map(of).collect()
}

/// Gauge less model: the force along each gauged axis by which the gauge
/// stands off the four capacitances, N; `None` where a tile touches.
pub(super) fn force_error(unit: &UnitModel, reading: &Reading) -> Option<[f64; 3]> {
    let axes: Vec<usize> = (0..3).filter(|axis| reading.gauged[*axis]).collect();
    let mut moved = *reading;
    for _ in 0..STEPS {
        let misfit = misfit(unit, &moved)?;
        let jacobian = unit.linearise(moved.force)?.jacobian;
        let own = |row: &[f64; 3]| axes.iter().map(|axis| row[*axis]).collect();
        let design: Vec<Vec<f64>> = jacobian.iter().map(own).collect();
        let found = linear::solve(&design, &misfit)?;
        for (axis, step) in axes.iter().zip(found.coefficients) {
            moved.force[*axis] += step;
        }
    }
    Some(std::array::from_fn(|axis| {
        reading.force[axis] - moved.force[axis]
    }))
}

impl ThreeAxisCalibrator<'_> {
    fn pairs<'b>(
        &'b self,
        fits: &'b [Fitted],
        taxels: &'b [Vec<Reading>],
    ) -> impl Iterator<Item = (Pair<'b>, UnitModel)> {
        let pairs = fits.iter().zip(taxels);
        pairs.map(|(fitted, of)| ((fitted, of), self.unit(fitted)))
    }

    /// Residual of the capacitances over their range in `all`.
    pub(super) fn relative(
        &self,
        fits: &[Fitted],
        taxels: &[Vec<Reading>],
        all: &[Vec<Reading>],
    ) -> f64 {
        let (mut square, mut count) = (0.0, 0);
        for (((_, of), unit), all) in self.pairs(fits, taxels).zip(all) {
            let ranges: [f64; 4] = std::array::from_fn(|i| {
                let [low, high] = range(all.iter().map(|r| r.capacitance[i]));
                (high - low).max(f64::MIN_POSITIVE)
            });
            for misfit in of.iter().filter_map(|r| misfit(&unit, r)) {
                for (misfit, range) in misfit.iter().zip(ranges) {
                    square += (misfit / range).powi(2);
                    count += 1;
                }
            }
        }
        (square / f64::from(count.max(1))).sqrt()
    }

    /// Residuals of each taxel's capacitances together and of each gauged
    /// force, with the ranges of `all`.
    pub(super) fn residuals(
        &self,
        fits: &[Fitted],
        taxels: &[Vec<Reading>],
        all: &[Vec<Reading>],
    ) -> Vec<ResidualSummary> {
        let mut summaries = Vec::new();
        for (((fitted, of), unit), all) in self.pairs(fits, taxels).zip(all) {
            let misfits: Vec<f64> = of
                .iter()
                .filter_map(|r| misfit(&unit, r))
                .flatten()
                .collect();
            let [low, high] = range(all.iter().flat_map(|r| r.capacitance));
            let name = format!("{PREFIX}{}.capacitance", taxel(&fitted.readings));
            summaries.push(ResidualSummary::of(name, "F", &misfits, high - low));
            for (axis, label) in AXES.iter().enumerate() {
                let gauged = of.iter().filter(|r| r.gauged[axis]);
                let errors = gauged.filter_map(|r| Some(force_error(&unit, r)?[axis]));
                let errors: Vec<f64> = errors.collect();
                if errors.is_empty() {
                    continue;
                }
                let [low, high] = range(all.iter().map(|r| r.force[axis]));
                let name = format!("{PREFIX}{}.force_{label}", taxel(&fitted.readings));
                summaries.push(ResidualSummary::of(name, "N", &errors, high - low));
            }
        }
        summaries
    }

    /// Combinations that the readings do not identify: first in short, then each.
    pub(super) fn open(&self, fits: &[Fitted]) -> Vec<String> {
        let mut open = Vec::new();
        for fitted in fits {
            let estimates = &fitted.fit.estimates;
            let stiffness = &estimates[COMPLIANCE + 8];
            let mut together = estimates[..COMPLIANCE].iter().chain([stiffness]);
            if together.any(|e| e.status == Status::NotIdentifiable) {
                let mean = |places: std::ops::Range<usize>| {
                    let count = places.len() as f64;
                    estimates[places].iter().map(|e| e.deviation).sum::<f64>() / count
                };
                open.push(format!(
                    "{PREFIX}{}: parallel capacitance, gap and stiffness cannot be identified separately: sigma {:.2} fF, {:.2} um \
                     and {:.0} N/m; {} fix it",
                    taxel(&fitted.readings),
                    mean(0..GAP) * 1e15,
                    mean(GAP..COMPLIANCE) * 1e6,
                    stiffness.deviation / stiffness.value.powi(2),
                    far_enough(&self.drawn)
                ));
            }
            open.extend(open_in_words(&fitted.parameters, &fitted.fit));
        }
        open
    }

    /// The stiffness matrix of the published inverse: least squares of the
    /// gauge's forces on its three displacements, never on the twist.
    pub(super) fn derived(&self, fits: &[Fitted]) -> Vec<Derived> {
        let mut derived = Vec::new();
        for fitted in fits {
            let (of, unit) = (&fitted.readings, self.unit(fitted));
            let rest = unit.rest();
            let observation = |r: &Reading| Observation {
                displacement: unit.effective_motion(rest, r.capacitance).displacement,
                force: r.force,
            };
            let observations: Vec<Observation> = of.iter().map(observation).collect();
            let Some(rows) = fit_stiffness(&observations) else {
                continue;
            };
            let quantile = student_quantile(0.975, observations.len() - 4);
            for (row, force) in rows.iter().zip(AXES) {
                for (column, axis) in AXES.iter().enumerate() {
                    let value = row.coefficients[column];
                    let half = quantile * row.deviations[column];
                    derived.push(Derived {
                        name: format!("{PREFIX}{}.stiffness_{force}{axis}", taxel(&fitted.readings)),
                        value,
                        interval: [value - half, value + half],
                        about: format!(
                            "N/m, force_{force} over d_{axis} of the published inverse by a straight line, R^2 {:.6}",
                            row.r_squared
                        ),
                    });
                }
            }
        }
        derived
    }

    /// Remarks on taxels that were not read, and on unloading.
    pub(super) fn remark_on(
        &self,
        fits: &[Fitted],
        taxels: &[Vec<Reading>],
        remarks: &mut Vec<Remark>,
    ) {
        let left = self.made.len() - taxels.len();
        if left > 0 {
            let message = format!("{left} taxels were not read and stay as drawn");
            remarks.push(Remark::whole(message));
        }
        for ((fitted, of), unit) in self.pairs(fits, taxels) {
            for (axis, name) in AXES.iter().enumerate() {
                let Some(share) = lost(&unit, of, axis) else {
                    continue;
                };
                if share.abs() > WORTH_A_REMARK {
                    remarks.push(Remark::whole(format!(
                        "{PREFIX}{}: {}",
                        taxel(&fitted.readings),
                        loss_in_words(share, &format!("force_{name}"))
                    )));
                }
            }
        }
    }

    pub(super) fn figures(&self, fits: &[Fitted]) -> Vec<Figure> {
        let figure = |fitted: &Fitted| {
            let (of, unit) = (&fitted.readings, self.unit(fitted));
            Figure {
            title: format!("taxel {}", taxel(&fitted.readings)),
            charts: vec![capacitances(&unit, of), forces(&unit, of)],
            caption: "Capacitances against the pressing force, side forces included, and what the gauge reads less what \
                      the four capacitances say."
                .into(),
        }
        };
        fits.iter().take(SHOWN).map(figure).collect()
    }
}

fn capacitances(unit: &UnitModel, of: &[Reading]) -> Chart {
    let mut series = Vec::new();
    for (i, name) in CAPACITORS.iter().enumerate() {
        let read = of
            .iter()
            .map(|r| [r.force[2] * 1e3, r.capacitance[i] * 1e15]);
        series.push(Series::new(*name, read.collect(), Style::Marks));
    }
    let [_, most] = range(of.iter().map(|r| r.force[2]));
    for (i, name) in CAPACITORS.iter().enumerate() {
        let point = |k: u32| {
            let force = most * f64::from(k) / 40.0;
            let capacitance = unit.predict([0.0, 0.0, force]).1.capacitance()[i];
            [force * 1e3, capacitance * 1e15]
        };
        let curve = (0..=40).map(point).collect();
        series.push(Series::new(
            format!("{name}, pressed only"),
            curve,
            Style::Line,
        ));
    }
    Chart {
        title: "Capacitance".into(),
        x: Axis::new("pressing force", "mN"),
        y: Axis::new("capacitance", "fF"),
        series,
    }
}

fn forces(unit: &UnitModel, of: &[Reading]) -> Chart {
    let series = (0..3).filter_map(|axis| {
        let gauged = of.iter().filter(|r| r.gauged[axis]);
        let points =
            gauged.filter_map(|r| Some([r.force[axis] * 1e3, force_error(unit, r)?[axis] * 1e3]));
        let points: Vec<[f64; 2]> = points.collect();
        (!points.is_empty()).then(|| Series::new(AXES[axis], points, Style::Marks))
    });
    Chart {
        title: "Gauge less model".into(),
        x: Axis::new("force of the gauge", "mN"),
        y: Axis::new("difference", "mN"),
        series: series.collect(),
    }
}

/// Hysteresis loss along an axis, as a share of loading; `None` where it is within the
/// noise.
fn lost(unit: &UnitModel, of: &[Reading], axis: usize) -> Option<f64> {
    let sizes: Vec<f64> = of.iter().map(|r| r.force[axis].abs()).collect();
    let [_, most] = range(sizes.iter().copied());
    let branches = branches(&sizes);
    // Slopes of the error over the force, for both branches.
    let slope = |wanted: Branch| -> Option<[f64; 2]> {
        let pairs = of.iter().zip(&branches).zip(&sizes);
        let along = |r: &Reading| r.force.iter().all(|f| f.abs() <= r.force[axis].abs());
        let of = pairs
            .filter(|((r, branch), size)| along(r) && **branch == wanted && **size > 0.1 * most);
        let points = of.filter_map(|((r, _), size)| {
            Some((*size, force_error(unit, r)?[axis] * r.force[axis].signum()))
        });
        let (design, target): (Vec<Vec<f64>>, Vec<f64>) =
            points.map(|(size, error)| (vec![size], error)).unzip();
        let found = linear::solve(&design, &target)?;
        let variance = found.misfit / (target.len().max(2) - 1) as f64;
        Some([found.coefficients[0], variance * found.covariance[0][0]])
    };
    let (up, down) = (slope(Branch::Loading)?, slope(Branch::Unloading)?);
    let difference = up[0] - down[0];
    (difference.abs() > 4.0 * (up[1] + down[1]).sqrt()).then_some(difference / (1.0 + up[0]))
}
