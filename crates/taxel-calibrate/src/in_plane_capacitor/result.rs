//! Results of the fits of in-plane sensors: residuals, curves, scope.

use super::checks;
use super::problem::{FACTOR_BOUNDS, Reading};
use super::{Fitted, InPlaneCalibrator, MODELS, law};
use crate::loads::range;
use crate::outcome::{Derived, ResidualSummary, Scope};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::{EndCondition, EndShear};
use taxel::transduction::CapacitanceLaw;
use taxel_numerics::roots;

impl InPlaneCalibrator<'_> {
    /// Residual of the capacitance over its range in `all`, all sensors
    /// together.
    pub(super) fn relative(&self, fitted: &Fitted, readings: &[Reading], all: &[Reading]) -> f64 {
        let bench = self.bench_of(fitted, readings);
        let at = fitted.fit.values();
        let ranges: Vec<f64> = (0..self.models.len())
            .map(|sensor| checks::range(all, sensor, |r| r.capacitance))
            .collect();
        let mut square = 0.0;
        let mut count = 0;
        for (index, reading) in readings.iter().enumerate() {
            if let Some([_, misfit]) = bench.misfits(&at, index) {
                square += (misfit / ranges[reading.sensor].max(f64::MIN_POSITIVE)).powi(2);
                count += 1;
            }
        }
        (square / f64::from(count.max(1))).sqrt()
    }

    /// Residuals of each sensor's capacitance, and of its force where a
    /// displacement was read, with the ranges of `all`.
    pub(super) fn residuals(
        &self,
        fitted: &Fitted,
        readings: &[Reading],
        all: &[Reading],
    ) -> Vec<ResidualSummary> {
        let bench = self.bench_of(fitted, readings);
        let at = fitted.fit.values();
        let mut summaries = Vec::new();
        for (sensor, prefix) in self.prefixes.iter().enumerate() {
            let misfits: Vec<[f64; 2]> = (0..readings.len())
                .filter(|i| readings[*i].sensor == sensor)
                .filter_map(|i| bench.misfits(&at, i))
                .collect();
            let kinds = [("capacitance", "F", 1), ("force_z", "N", 0)];
            for (name, unit, kind) in kinds.into_iter().take(1 + usize::from(bench.with_force())) {
                let values: Vec<f64> = misfits.iter().map(|misfit| misfit[kind]).collect();
                let range = checks::range(all, sensor, |r| [r.force, r.capacitance][kind]);
                let name = format!("{prefix}{name}");
                summaries.push(ResidualSummary::of(name, unit, &values, range));
            }
        }
        summaries
    }

    /// ζ at the m of the drawing, where its end condition has them.
    pub(super) fn derived(&self, fitted: &Fitted) -> Vec<Derived> {
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
        let estimate = fitted.fit.estimates[1];
        let layer = &self.models[0].layer;
        // These end conditions have one factor for all compressions.
        let drawn = layer.end_condition.factor(layer.aspect(), 0.1);
        let drawn = drawn.unwrap_or(1.0);
        let mut interval = estimate.interval.map(|scale| zeta(scale * drawn));
        interval.sort_by(f64::total_cmp);
        vec![Derived {
            name: "zeta".into(),
            value: zeta(estimate.value * drawn),
            interval,
            about: format!(
                "of the end condition at m = {m}: only its end factor is identified, never zeta and m both"
            ),
        }]
    }

    pub(super) fn figures(&self, candidates: &[Vec<Fitted>]) -> Vec<Figure> {
        let readings = &candidates[0][0].readings;
        let mut figures = Vec::new();
        for (sensor, prefix) in self.prefixes.iter().enumerate() {
            let of: Vec<Reading> = readings
                .iter()
                .filter(|r| r.sensor == sensor)
                .copied()
                .collect();
            let name = prefix.trim_end_matches('.').replace('_', " ");
            let mut sorted = of.clone();
            sorted.sort_by(|a, b| a.force.total_cmp(&b.force));
            let shown = |x: f64, y: f64| [x, y * 1e15];
            let marks = of.iter().map(|r| shown(r.force, r.capacitance)).collect();
            let mut curves = vec![Series::new("readings", marks, Style::Marks)];
            let mut left = Vec::new();
            for fitted in candidates.iter().flatten() {
                let (bench, at) = (self.bench_of(fitted, &sorted), fitted.fit.values());
                let points = (0..sorted.len()).filter_map(|i| Some((i, bench.predict(&at, i)?)));
                let points: Vec<_> = points.collect();
                let curve = points.iter().map(|(_, [force, c])| shown(*force, *c));
                let mut curve: Vec<[f64; 2]> = curve.collect();
                curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
                curves.push(Series::new(MODELS[fitted.model].name, curve, Style::Line));
                if law(fitted) == CapacitanceLaw::Mechanics {
                    continue;
                }
                let residual =
                    |(i, [force, c]): &(usize, [f64; 2])| shown(*force, sorted[*i].capacitance - c);
                let residuals = points.iter().map(residual).collect();
                left.push(Series::new(
                    MODELS[fitted.model].name,
                    residuals,
                    Style::Marks,
                ));
            }
            let chart = |title: &str, y: &str, series| Chart {
                title: title.into(),
                x: Axis::new("force", "N"),
                y: Axis::new(y, "fF"),
                series,
            };
            figures.push(Figure {
                title: name,
                charts: vec![
                    chart("Capacitance", "capacitance", curves),
                    chart("Readings less model", "residual", left),
                ],
                caption: "Curves and residuals of the models that were fitted to the readings of loading.".into(),
            });
        }
        figures
    }

    pub(super) fn scope(&self, fitted: &Fitted) -> Vec<Scope> {
        let readings = &fitted.readings;
        let bench = self.bench_of(fitted, readings);
        let at = fitted.fit.values();
        let compressions = (0..readings.len()).filter_map(|i| bench.compression(&at, i));
        vec![
            Scope {
                name: "force_z".into(),
                unit: "N",
                range: range(readings.iter().map(|r| r.force)),
            },
            Scope {
                name: "compression".into(),
                unit: "",
                range: range(compressions),
            },
        ]
    }
}
