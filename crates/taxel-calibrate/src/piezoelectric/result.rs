//! Results of the fit of a piezoelectric sensor.

use super::problem::{Drive, LEAK, Reading, Table, What};
use super::{Fitted, PiezoelectricCalibrator};
use crate::device_model::{Findings, Judged};
use crate::figures::FitFigure;
use crate::loads::span;
use crate::outcome::{Constants, Derived, ResidualSummary, Scope};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use taxel::InputError;
use taxel::figure::{Axis, Figure, Series, Style};
use taxel::mechanics::Profile;
use taxel_numerics::least_squares::student_quantile;

impl Findings for PiezoelectricCalibrator<'_> {
    fn residuals(&self, of: &Judged<'_, Self>) -> Vec<ResidualSummary> {
        let table = of.context;
        let pairs = table.beside_model(&of.readings[0], &of.fits[0].fit.values());
        let misfits: Vec<f64> = pairs.map(|(read, model)| read.voltage - model).collect();
        let range = span(table.readings.iter().map(|r| r.voltage));
        vec![ResidualSummary::of(
            self.unit.quantity.into(),
            self.si_unit(),
            &misfits,
            range,
        )]
    }

    fn explained(&self, of: &Judged<'_, Self>, table: &ReadingTable) -> Result<(), InputError> {
        self.fits_its_columns(table, of.context, &of.fits[0].fit.values())
    }

    fn beside(&self, of: &Judged<'_, Self>, remarks: &mut Vec<Remark>) -> Constants {
        remarks.push(Remark::whole(match of.context.device.drive {
            Drive::Displacement => {
                "charge_per_force stands for its product with the silicone's stiffness, which stays that of the drawing"
            }
            Drive::Force => "the viscosity does not act between a force and its signal and stays that of the drawing",
        }));
        Vec::new()
    }

    /// The time constant, and the slope of A1 + A2 over the load for each test
    /// load.
    fn derived(&self, of: &Judged<'_, Self>) -> Vec<Derived> {
        let mut derived = Vec::new();
        if let Ok(array) = self.named.sensor.piezoelectric() {
            let estimate = of.fits[0].fit.estimates[LEAK];
            let capacitance = array.element.capacitance;
            derived.push(Derived::of_parameter(
                "leak_time_constant",
                &estimate,
                |resistance| resistance * capacitance,
                "s, leak_resistance times the capacitance of the drawing".into(),
            ));
        }
        let slope = |place: usize| slope(of.context, place);
        derived.extend((0..of.context.profiles.len()).filter_map(slope));
        derived
    }

    fn noise(&self, fits: &[Fitted]) -> String {
        let deviation = fits[0].fit.scale * self.deviation / self.unit.si_per_unit;
        format!(": {deviation:.4} {}", self.unit.symbol)
    }

    fn scope(&self, of: &Judged<'_, Self>) -> Vec<Scope> {
        let table = of.context;
        let (name, unit) = match table.device.drive {
            Drive::Displacement => ("displacement", "m"),
            Drive::Force => ("force_z", "N"),
        };
        let mut scope = vec![Scope::of(name, unit, table.readings.iter().map(|r| r.load))];
        if !table.profiles.is_empty() {
            let ramp = |profile: &Profile| match *profile {
                Profile::Step { ramp }
                | Profile::Impact { ramp, .. }
                | Profile::Cyclic { ramp, .. } => ramp,
                Profile::Sine { period, .. } => 0.5 * period,
            };
            scope.push(Scope::of("ramp", "s", table.profiles.iter().map(ramp)));
        }
        scope
    }

    fn figures(&self, of: &Judged<'_, Self>, _: &[Vec<Fitted>]) -> Vec<Figure> {
        let table = of.context;
        let (label, unit, scale) = match table.device.drive {
            Drive::Displacement => ("displacement", "um", 1e6),
            Drive::Force => ("force", "mN", 1e3),
        };
        let (x, style) = if table.is_recorded() {
            (Axis::new("time", "s"), Style::Line)
        } else {
            (Axis::new(label, unit), Style::Marks)
        };
        let pairs = table.beside_model(&table.readings, &of.fits[0].fit.values());
        let output = &self.unit;
        let points = |y: fn(f64, f64) -> f64| {
            let point = |(reading, model): (&Reading, f64)| {
                let x = match reading.what {
                    What::Peak { .. } => reading.load * scale,
                    What::Sample(time) => time,
                };
                [x, y(reading.voltage, model) / output.si_per_unit]
            };
            pairs.clone().map(point).collect()
        };
        vec![Figure::from(FitFigure {
            title: "Output of an element".into(),
            caption: "All readings, those held out included.",
            x,
            signal: if output.quantity == "charge" {
                "Charge"
            } else {
                "Voltage"
            },
            labels: [output.quantity; 2],
            unit: output.symbol,
            curves: vec![
                Series::new("readings", points(|read, _| read), style),
                Series::new("model", points(|_, model| model), style),
            ],
            left: vec![Series::new(
                "residual",
                points(|read, model| read - model),
                Style::Marks,
            )],
        })]
    }
}

impl PiezoelectricCalibrator<'_> {
    /// SI unit of the output.
    fn si_unit(&self) -> &'static str {
        match self.unit.quantity {
            "charge" => "C",
            _ => "V",
        }
    }
}

/// Slope of A1 + A2 over the load through zero, as the paper gives it, with
/// R² about the mean; `None` for fewer than three loads.
fn slope(table: &Table, place: usize) -> Option<Derived> {
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
    let half = student_quantile(0.975, count - 1.0) * (misfit / (count - 1.0) / square).sqrt();
    if !(value.is_finite() && half.is_finite() && spread > 0.0) {
        return None;
    }
    let (name, shape) = match table.profiles[place] {
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
        interval: Some([value - half, value + half]),
        about: format!(
            "{unit}, a1 + a2 over the load, {shape}, R^2 {:.5}",
            1.0 - misfit / spread
        ),
    })
}
