//! Results of the fits of in-plane sensors: residuals, curves, scope.

use super::checks::range;
use super::problem::{FACTOR_BOUNDS, Reading};
use super::{Fitted, InPlaneCalibrator, MODELS, law};
use crate::device_model::{Findings, Judged};
use crate::figures::FitFigure;
use crate::hysteresis::Loops;
use crate::outcome::{Derived, ResidualSummary, Scope};
use taxel::figure::{Axis, Figure, Series, Style};
use taxel::mechanics::{EndCondition, EndShear};
use taxel::transduction::CapacitanceLaw;
use taxel_numerics::roots;

impl Findings for InPlaneCalibrator<'_> {
    /// Residuals of each sensor's capacitance, and of its force where it was read beside a
    /// displacement.
    fn residuals(&self, of: &Judged<'_, Self>) -> Vec<ResidualSummary> {
        let (readings, all) = (&of.readings[0], &of.all[0]);
        let bench = self.bench_of(&of.fits[0], readings);
        let at = of.fits[0].fit.values();
        let mut summaries = Vec::new();
        for (sensor, prefix) in self.prefixes.iter().enumerate() {
            let of = |i: &usize| readings[*i].sensor == sensor;
            let misfits: Vec<(bool, [f64; 2])> = (0..readings.len())
                .filter(of)
                .filter_map(|i| Some((readings[i].has_both(), bench.misfits(&at, i)?)))
                .collect();
            let kinds = [("capacitance", "F", 1), ("force_z", "N", 0)];
            for (name, unit, kind) in kinds {
                let read = misfits.iter().filter(|(both, _)| kind == 1 || *both);
                let values: Vec<f64> = read.map(|(_, misfit)| misfit[kind]).collect();
                if values.is_empty() {
                    continue;
                }
                let range = range(all, sensor, |r| [r.force(), Some(r.capacitance)][kind]);
                let name = format!("{prefix}{name}");
                summaries.push(ResidualSummary::of(name, unit, &values, range));
            }
        }
        summaries
    }

    fn hysteresis(&self, of: &Judged<'_, Self>) -> Vec<Loops> {
        let pairs = of.series.iter().zip(of.held);
        let loops = pairs.filter_map(|(series, held)| self.loops(&of.fits[0], series, held));
        loops.collect()
    }

    fn noise(&self, _: &[Fitted]) -> String {
        ", of each sensor's forces and capacitances apart".into()
    }

    /// ζ at the m of the drawing, where its end condition has them.
    fn derived(&self, of: &Judged<'_, Self>) -> Vec<Derived> {
        let with = |zeta: f64, m: f64| -> Option<EndCondition> {
            let shear = EndShear { zeta, m };
            match self.models[0].layer.end_condition {
                EndCondition::Tapered(_) => Some(EndCondition::Tapered(shear)),
                EndCondition::Tail(_) => Some(EndCondition::Tail(shear)),
                _ => None,
            }
        };
        let m = match self.models[0].layer.end_condition {
            EndCondition::Tapered(shear) | EndCondition::Tail(shear) => shear.m,
            _ => return Vec::new(),
        };
        let factor = |log: f64| {
            with(log.exp(), m)
                .and_then(|end| end.factor(2.0, 0.1).ok())
                .unwrap_or(FACTOR_BOUNDS[0])
        };
        let range = [0.02_f64.ln(), 1e5_f64.ln()];
        let rising = factor(range[1]) > factor(range[0]);
        let zeta = |chi: f64| {
            let misfit = |log: f64| {
                if rising {
                    factor(log) - chi
                } else {
                    chi - factor(log)
                }
            };
            roots::ridders(range, misfit).exp()
        };
        if of.readings[0].iter().all(|r| r.force().is_none()) {
            return Vec::new();
        }
        let estimate = of.fits[0].fit.estimates[1];
        let layer = &self.models[0].layer;
        // These end conditions have one factor for all compressions.
        let drawn = layer.end_condition.factor(layer.aspect(), 0.1);
        let drawn = drawn.unwrap_or(1.0);
        vec![Derived::of_parameter(
            "zeta",
            &estimate,
            |scale| zeta(scale * drawn),
            format!(
                "of the end condition at m = {m}: only its end factor is identified, never zeta and m both"
            ),
        )]
    }

    fn figures(&self, _: &Judged<'_, Self>, candidates: &[Vec<Fitted>]) -> Vec<Figure> {
        let figure = |sensor: usize| {
            let all = candidates[0][0].readings.iter();
            let mut of: Vec<Reading> = all.filter(|r| r.sensor == sensor).copied().collect();
            // Over the force where it was read, else over the displacement.
            let by_force = of.iter().all(|r| r.force().is_some());
            let (x, per) = if by_force {
                (Axis::new("force", "N"), 1.0)
            } else {
                (Axis::new("displacement", "um"), 1e-6)
            };
            let load = |r: &Reading| r.force().filter(|_| by_force).unwrap_or_else(|| r.drive());
            let shown = |x: f64, y: f64| [x / per, y * 1e15];
            let marks = of.iter().map(|r| shown(load(r), r.capacitance)).collect();
            let mut curves = vec![Series::new("readings", marks, Style::Marks)];
            let mut left = Vec::new();
            of.sort_by(|a, b| load(a).total_cmp(&load(b)));
            for fitted in candidates.iter().flatten() {
                let name = MODELS[fitted.model].name;
                let (bench, at) = (self.bench_of(fitted, &of), fitted.fit.values());
                let points = (0..of.len()).filter_map(|i| Some((&of[i], bench.predict(&at, i)?)));
                let points: Vec<_> = points.collect();
                let at = |r: &Reading, force: f64| if by_force { force } else { r.drive() };
                let curve = points
                    .iter()
                    .map(|(r, [force, c])| shown(at(r, *force), *c));
                let mut curve: Vec<[f64; 2]> = curve.collect();
                curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
                curves.push(Series::new(name, curve, Style::Line));
                if law(fitted) == CapacitanceLaw::Mechanics {
                    continue;
                }
                let residuals = points
                    .iter()
                    .map(|(r, [force, c])| shown(at(r, *force), r.capacitance - c));
                left.push(Series::new(name, residuals.collect(), Style::Marks));
            }
            Figure::from(FitFigure {
                title: self.title(sensor),
                caption: "Curves and residuals of the models that were fitted to the readings of loading.",
                x,
                signal: "Capacitance",
                labels: ["capacitance", "residual"],
                unit: "fF",
                curves,
                left,
            })
        };
        (0..self.models.len()).map(figure).collect()
    }

    fn scope(&self, of: &Judged<'_, Self>) -> Vec<Scope> {
        let readings = &of.readings[0];
        let bench = self.bench_of(&of.fits[0], readings);
        let at = of.fits[0].fit.values();
        let compressions = (0..readings.len()).filter_map(|i| bench.compression(&at, i));
        let mut scope = vec![Scope::of("compression", "", compressions)];
        let forces: Vec<f64> = readings.iter().filter_map(Reading::force).collect();
        if !forces.is_empty() {
            scope.insert(0, Scope::of("force_z", "N", forces.into_iter()));
        }
        scope
    }
}
