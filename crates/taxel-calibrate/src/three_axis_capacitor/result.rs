//! Results of the fits of three-axis units.

use super::problem::{
    AXES, CAPACITANCE, CAPACITORS, COMPLIANCE, GAP, Reading, far_enough, force_error, misfit,
};
use super::{Fitted, Model, ThreeAxisCalibrator, even_between, in_words, name_of};
use crate::device_model::{Findings, Judged};
use crate::hysteresis::{Loops, loss_in_words};
use crate::loads::{range, span};
use crate::outcome::{Constants, Derived, ResidualSummary, Scope, open_in_words};
use crate::remark::Remark;
use crate::split::{Branch, branches};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::transduction::ThreeAxisModel;
use taxel_numerics::least_squares::{Estimate, Status, linear};

/// Taxels of which a report shows figures.
const SHOWN: usize = 8;
/// Less force at unloading than this is not worth a remark.
const WORTH_A_REMARK: f64 = 0.005;

impl ThreeAxisCalibrator<'_> {
    /// Remarks on parallel capacitances that the drawing says something about: with which
    /// deviation it counts, and where the readings disagree.
    fn by_the_drawing(&self, of: &Judged<'_, Self>, remarks: &mut Vec<Remark>) {
        let free = |fitted: &&Fitted| Model::ALL[fitted.model] != Model::AsDrawn;
        let fits: Vec<&Fitted> = of.fits.iter().filter(free).collect();
        let (Some([least, greatest]), false) = (self.beside_edges, fits.is_empty()) else {
            return;
        };
        let [least, greatest] = [least, greatest].map(|end| end * 1e15);
        let [middle, deviation] = even_between([least, greatest]);
        remarks.push(Remark::whole(format!(
            "the surroundings of the drawing add {least:.1} to {greatest:.1} fF to the edges of a capacitor, which counts \
             as a measured parallel_capacitance of {middle:.1} fF with a deviation of {deviation:.1} fF, common to the four; leads and board are not in it: \
             measure them, or type parallel_capacitance in"
        )));
        let beyond = |fitted: &&Fitted| {
            let gaps = &fitted.fit.estimates[..GAP];
            let parallel = gaps.iter().map(|estimate| estimate.value * 1e15);
            let mut numbered = parallel.zip(CAPACITORS);
            let (parallel, capacitor) =
                numbered.find(|(parallel, _)| !(least..=greatest).contains(parallel))?;
            let name = name_of(&fitted.readings);
            Some(format!("{name} {parallel:.1} fF (capacitor {capacitor})"))
        };
        let beyond: Vec<String> = fits.iter().filter_map(beyond).collect();
        let what = "parallel to a capacitor the readings have what the surroundings of the drawing do not explain, so give the measured \
             parallel_capacitance_11 to _22 [fF], or type parallel_capacitance in";
        remarks.extend(Remark::of_each(what, &beyond));
    }
}

impl Findings for ThreeAxisCalibrator<'_> {
    /// Residuals of each taxel's capacitances together and of each gauged force.
    fn residuals(&self, of: &Judged<'_, Self>) -> Vec<ResidualSummary> {
        let mut summaries = Vec::new();
        for ((fitted, readings), all) in of.fits.iter().zip(of.readings).zip(of.all) {
            let (unit, name) = (self.unit(fitted), name_of(&fitted.readings));
            let misfits = readings.iter().filter_map(|r| misfit(&unit, r));
            let misfits: Vec<f64> = misfits.flatten().collect();
            let range = span(all.iter().flat_map(|r| r.capacitance));
            let kind = format!("{name}.capacitance");
            summaries.push(ResidualSummary::of(kind, "F", &misfits, range));
            for (axis, label) in AXES.iter().enumerate() {
                let gauged = readings.iter().filter(|r| r.gauged[axis]);
                let errors = gauged.filter_map(|r| Some(force_error(&unit, r)?[axis]));
                let errors: Vec<f64> = errors.collect();
                if errors.is_empty() {
                    continue;
                }
                let range = span(all.iter().map(|r| r.force[axis]));
                let kind = format!("{name}.force_{label}");
                summaries.push(ResidualSummary::of(kind, "N", &errors, range));
            }
        }
        summaries
    }

    /// Residuals of each capacitance over its own range.
    fn relative(&self, of: &Judged<'_, Self>) -> f64 {
        let (mut square, mut count) = (0.0, 0);
        for ((fitted, readings), all) in of.fits.iter().zip(of.readings).zip(of.all) {
            let unit = self.unit(fitted);
            let range = |i: usize| span(all.iter().map(|r| r.capacitance[i]));
            let ranges = [0, 1, 2, 3].map(|i| range(i).max(f64::MIN_POSITIVE));
            for misfit in readings.iter().filter_map(|r| misfit(&unit, r)) {
                for (misfit, range) in misfit.iter().zip(ranges) {
                    square += (misfit / range).powi(2);
                    count += 1;
                }
            }
        }
        (square / f64::from(count.max(1))).sqrt()
    }

    /// Remarks on taxels that were not read, and on unloading.
    fn beside(&self, of: &Judged<'_, Self>, remarks: &mut Vec<Remark>) -> Constants {
        let left = self.made.len() - of.series.len();
        if left > 0 {
            let message = format!("{left} taxels were not read and stay as drawn");
            remarks.push(Remark::whole(message));
        }
        if of.context.measured.is_none() {
            self.by_the_drawing(of, remarks);
        }
        let mut losses = Vec::new();
        for (fitted, series) in of.fits.iter().zip(of.series) {
            let (unit, name) = (self.unit(fitted), name_of(series));
            for (axis, label) in AXES.iter().enumerate() {
                let share = lost(&unit, series, axis).unwrap_or(0.0);
                if share.abs() > WORTH_A_REMARK {
                    let loss = loss_in_words(share, &format!("force_{label}"));
                    losses.push(format!("{name} {loss}"));
                }
            }
        }
        remarks.extend(Remark::of_each("unloading", &losses));
        Vec::new()
    }

    fn hysteresis(&self, of: &Judged<'_, Self>) -> Vec<Loops> {
        if of.context.in_time {
            self.loops(of.fits, of.series, &of.held.concat())
        } else {
            Vec::new()
        }
    }

    fn body(&self, fitted: &Fitted) -> Option<String> {
        Some(name_of(&fitted.readings))
    }

    /// First in short, then each combination.
    fn open(&self, fitted: &Fitted) -> Vec<String> {
        let estimates = &fitted.fit.estimates;
        let stiffness = &estimates[COMPLIANCE + 8];
        let mut together = estimates[..COMPLIANCE].iter().chain([stiffness]);
        let mut open = Vec::new();
        if together.any(|e| e.status == Status::NotIdentifiable) {
            let mean =
                |of: &[Estimate]| of.iter().map(|e| e.deviation).sum::<f64>() / of.len() as f64;
            open.push(format!(
                "{}: parallel capacitance, gap and stiffness cannot be identified separately: sigma {:.2} fF, {:.2} um \
                 and {:.0} N/m; {} fix it",
                name_of(&fitted.readings),
                mean(&estimates[..GAP]) * 1e15,
                mean(&estimates[GAP..COMPLIANCE]) * 1e6,
                stiffness.deviation / stiffness.value.powi(2),
                far_enough(&self.drawn)
            ));
        }
        open.extend(open_in_words(&fitted.parameters, &fitted.fit));
        open
    }

    /// The stiffness of the published inverse along the axes that a gauge read, with the whole
    /// covariance of the fit.
    fn derived(&self, of: &Judged<'_, Self>) -> Vec<Derived> {
        let of_taxel = |fitted: &Fitted| self.stiffnesses(fitted).unwrap_or_default();
        of.fits.iter().flat_map(of_taxel).collect()
    }

    fn noise(&self, fits: &[Fitted]) -> String {
        let most = |kind: usize| {
            let all = fits.iter().map(|fitted| fitted.noise.common[kind]);
            all.fold(0.0, f64::max)
        };
        let gauged = |axis: usize| {
            let mut readings = fits.iter().flat_map(|fitted| &fitted.readings);
            readings.any(|r| r.gauged[axis] && r.deviation[axis].is_none())
        };
        let axes = (0..AXES.len()).filter(|axis| gauged(*axis));
        let gauge = axes.map(|axis| format!("{} {:.4} mN, ", AXES[axis], most(axis) * 1e3));
        let capacitances = most(CAPACITANCE) * 1e15;
        format!(
            ": gauge {}capacitances {capacitances:.4} fF",
            gauge.collect::<String>()
        )
    }

    fn scope(&self, of: &Judged<'_, Self>) -> Vec<Scope> {
        let along = |axis: usize| {
            let forces = of.series.iter().flatten().map(|r| r.force[axis]);
            Scope::of(format!("force_{}", AXES[axis]), "N", forces)
        };
        (0..3).map(along).collect()
    }

    fn figures(&self, of: &Judged<'_, Self>, _: &[Vec<Fitted>]) -> Vec<Figure> {
        let figure = |fitted: &Fitted| {
            let (readings, unit) = (&fitted.readings, self.unit(fitted));
            Figure {
                title: in_words(readings),
                charts: vec![capacitances(&unit, readings), forces(&unit, readings)],
                caption: "Capacitances against the pressing force, side forces included, and what the gauge reads less \
                          what the four capacitances say."
                    .into(),
            }
        };
        of.fits.iter().take(SHOWN).map(figure).collect()
    }
}

fn capacitances(unit: &ThreeAxisModel, of: &[Reading]) -> Chart {
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

fn forces(unit: &ThreeAxisModel, of: &[Reading]) -> Chart {
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
fn lost(unit: &ThreeAxisModel, of: &[Reading], axis: usize) -> Option<f64> {
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
