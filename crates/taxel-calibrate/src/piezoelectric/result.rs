//! Results of the fit of a piezoelectric sensor.

use super::problem::Table;
use super::problem::{Drive, LEAK, Reading, What};
use super::{Fitted, PiezoelectricCalibrator};
use crate::loads::range;
use crate::outcome::{Derived, ResidualSummary, Scope};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::Profile;
use taxel_numerics::least_squares::student_quantile;

pub(super) fn scope(table: &Table) -> Vec<Scope> {
    let (name, unit) = match table.device.drive {
        Drive::Displacement => ("displacement", "m"),
        Drive::Force => ("force_z", "N"),
    };
    let mut scope = vec![Scope {
        name: name.into(),
        unit,
        range: range(table.readings.iter().map(|r| r.load)),
    }];
    if !table.profiles.is_empty() {
        let ramp = |profile: &Profile| match *profile {
            Profile::Step { ramp }
            | Profile::Impact { ramp, .. }
            | Profile::Cyclic { ramp, .. } => ramp,
            Profile::Sine { period, .. } => 0.5 * period,
        };
        scope.push(Scope {
            name: "ramp".into(),
            unit: "s",
            range: range(table.profiles.iter().map(ramp)),
        });
    }
    scope
}

impl PiezoelectricCalibrator<'_> {
    /// Measured less modelled voltages, V.
    pub(super) fn misfits(&self, fitted: &Fitted, table: &Table, readings: &[Reading]) -> Vec<f64> {
        let bench = self.problem(table, readings);
        let at = fitted.fit.values();
        let model = table
            .device
            .voltages(bench.profiles, readings, bench.path, &at)
            .unwrap_or_default();
        let pairs = readings.iter().zip(model);
        pairs
            .map(|(reading, model)| reading.voltage - model)
            .collect()
    }

    /// Residual of the voltages over their range.
    pub(super) fn relative(&self, fitted: &Fitted, table: &Table, readings: &[Reading]) -> f64 {
        let residuals = self.residuals(fitted, table, readings);
        let all = residuals.first();
        all.map_or(0.0, |all| {
            all.root_mean_square / all.range.max(f64::MIN_POSITIVE)
        })
    }

    pub(super) fn residuals(
        &self,
        fitted: &Fitted,
        table: &Table,
        readings: &[Reading],
    ) -> Vec<ResidualSummary> {
        let misfits = self.misfits(fitted, table, readings);
        let [low, high] = range(table.readings.iter().map(|r| r.voltage));
        vec![ResidualSummary::of(
            "voltage".into(),
            "V",
            &misfits,
            high - low,
        )]
    }

    /// The time constant, and the slope of A1 + A2 over the load for each test
    /// load.
    pub(super) fn derived(&self, fitted: &Fitted, table: &Table) -> Vec<Derived> {
        let mut derived = Vec::new();
        if let Ok(array) = self.named.sensor.piezoelectric() {
            let estimate = fitted.fit.estimates[LEAK];
            let capacitance = array.element.capacitance;
            derived.push(Derived {
                name: "leak_time_constant".into(),
                value: estimate.value * capacitance,
                interval: estimate.interval.map(|resistance| resistance * capacitance),
                about: "s, leak_resistance times the capacitance of the drawing".into(),
            });
        }
        for (place, profile) in table.profiles.iter().enumerate() {
            derived.extend(slope(table, place, profile));
        }
        derived
    }

    pub(super) fn figures(&self, fitted: &Fitted, table: &Table) -> Vec<Figure> {
        let misfits = self.misfits(fitted, table, &table.readings);
        let (label, unit, scale) = match table.device.drive {
            Drive::Displacement => ("displacement", "um", 1e6),
            Drive::Force => ("force", "mN", 1e3),
        };
        let x = |reading: &Reading| match reading.what {
            What::Peak { .. } => reading.load * scale,
            What::Sample(time) => time,
        };
        let axis = || {
            if table.path.is_empty() {
                Axis::new(label, unit)
            } else {
                Axis::new("time", "s")
            }
        };
        let pairs = || table.readings.iter().zip(&misfits);
        let style = if table.path.is_empty() {
            Style::Marks
        } else {
            Style::Line
        };
        let read = table.readings.iter().map(|r| [x(r), r.voltage * 1e3]);
        let model = pairs().map(|(r, misfit)| [x(r), (r.voltage - misfit) * 1e3]);
        let left = pairs().map(|(r, misfit)| [x(r), misfit * 1e3]);
        let chart = |title: &str, series| Chart {
            title: title.into(),
            x: axis(),
            y: Axis::new("voltage", "mV"),
            series,
        };
        vec![Figure {
            title: "Output of an element".into(),
            charts: vec![
                chart(
                    "Voltage",
                    vec![
                        Series::new("readings", read.collect(), style),
                        Series::new("model", model.collect(), style),
                    ],
                ),
                chart(
                    "Readings less model",
                    vec![Series::new("residual", left.collect(), Style::Marks)],
                ),
            ],
            caption: "All readings, those held out included.".into(),
        }]
    }
}

/// Slope of A1 + A2 over the load through zero, as the paper gives it, with
/// R² about the mean; `None` for fewer than three loads.
fn slope(table: &Table, place: usize, profile: &Profile) -> Option<Derived> {
    let mut sums: Vec<(usize, [f64; 2])> = Vec::new();
    for reading in &table.readings {
        let What::Peak { profile, .. } = reading.what else {
            continue;
        };
        if profile != place {
            continue;
        }
        match sums.iter_mut().find(|(line, _)| *line == reading.line) {
            Some((_, point)) => point[1] += reading.voltage,
            None => sums.push((reading.line, [reading.load.abs(), reading.voltage])),
        }
    }
    if sums.len() < 3 {
        return None;
    }
    let count = sums.len() as f64;
    let points = || sums.iter().map(|(_, point)| *point);
    let square: f64 = points().map(|[x, _]| x * x).sum();
    let value = points().map(|[x, y]| x * y).sum::<f64>() / square;
    let misfit: f64 = points().map(|[x, y]| (y - value * x).powi(2)).sum();
    let mean = points().map(|[_, y]| y).sum::<f64>() / count;
    let spread: f64 = points().map(|[_, y]| (y - mean).powi(2)).sum();
    let half = student_quantile(0.975, sums.len() - 1) * (misfit / (count - 1.0) / square).sqrt();
    if !(value.is_finite() && half.is_finite() && spread > 0.0) {
        return None;
    }
    let (name, shape) = match *profile {
        Profile::Step { ramp } => ("step", format!("ramp {ramp} s")),
        Profile::Impact { ramp, dwell } => ("impact", format!("ramp {ramp} s, dwell {dwell} s")),
        Profile::Cyclic { ramp, period, .. } => {
            ("cyclic", format!("ramp {ramp} s, period {period} s"))
        }
        Profile::Sine { period, .. } => ("sine", format!("period {period} s")),
    };
    let unit = match table.device.drive {
        Drive::Displacement => "V/m",
        Drive::Force => "V/N",
    };
    Some(Derived {
        name: format!("slope_{name}_{place}"),
        value,
        interval: [value - half, value + half],
        about: format!(
            "{unit}, a1 + a2 over the load, {shape}, R^2 {:.5}",
            1.0 - misfit / spread
        ),
    })
}
