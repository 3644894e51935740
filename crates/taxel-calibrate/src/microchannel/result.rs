//! Results of the fit of crossing microchannels: residuals, curves, scope.

use super::{BIAS, CHANNEL, Fitted, MicrochannelCalibrator, Reading, checks};
use crate::loads::range;
use crate::outcome::{ResidualSummary, Scope};
use taxel::figure::{Axis, Chart, Figure, Series, Style};

impl MicrochannelCalibrator<'_> {
    /// Residuals of the voltage of one channel, V.
    fn misfits(&self, fitted: &Fitted, readings: &[Reading], channel: usize) -> Vec<f64> {
        let at = fitted.fit.values();
        let bench = self.bench_of(&checks::channels(&fitted.readings), readings);
        let of = readings.iter().filter(|r| r.channel == channel);
        of.filter_map(|r| Some(r.voltage - bench.predict(&at, r)?))
            .collect()
    }

    pub(super) fn residuals(&self, fitted: &Fitted, readings: &[Reading]) -> Vec<ResidualSummary> {
        let summary = |channel: &usize| {
            let name = format!("{CHANNEL}_{channel}.voltage");
            let range = voltages(&fitted.readings, *channel);
            ResidualSummary::of(name, "V", &self.misfits(fitted, readings, *channel), range)
        };
        checks::channels(&fitted.readings)
            .iter()
            .map(summary)
            .collect()
    }

    /// Residual of the voltages over their range, all channels together.
    pub(super) fn relative(&self, fitted: &Fitted, readings: &[Reading]) -> f64 {
        let summaries = self.residuals(fitted, readings);
        let square = |s: &ResidualSummary| {
            let share = s.root_mean_square / s.range.max(f64::MIN_POSITIVE);
            s.count as f64 * share * share
        };
        let count: usize = summaries.iter().map(|s| s.count).sum();
        (summaries.iter().map(square).sum::<f64>() / count.max(1) as f64).sqrt()
    }

    pub(super) fn figures(&self, fitted: &Fitted) -> Vec<Figure> {
        let at = fitted.fit.values();
        let bench = self.bench_of(&checks::channels(&fitted.readings), &fitted.readings);
        let figure = |channel: &usize| {
            let of = fitted.readings.iter().filter(|r| r.channel == *channel);
            let mut of: Vec<&Reading> = of.collect();
            let pressure = |r: &Reading| r.load.pressure(at[BIAS]) * 1e-3;
            of.sort_by(|a, b| pressure(a).total_cmp(&pressure(b)));
            let marks = of.iter().map(|r| [pressure(r), r.voltage * 1e3]).collect();
            let curve = of
                .iter()
                .filter_map(|r| Some([pressure(r), bench.predict(&at, r)? * 1e3]));
            let left = of
                .iter()
                .filter_map(|r| Some([pressure(r), (r.voltage - bench.predict(&at, r)?) * 1e3]));
            let chart = |title: &str, series| Chart {
                title: title.into(),
                x: Axis::new("pressure", "kPa"),
                y: Axis::new("voltage", "mV"),
                series,
            };
            Figure {
                title: format!("channel {channel}"),
                charts: vec![
                    chart(
                        "Voltage",
                        vec![
                            Series::new("readings", marks, Style::Marks),
                            Series::new("cell", curve.collect(), Style::Line),
                        ],
                    ),
                    chart(
                        "Readings less model",
                        vec![Series::new("cell", left.collect(), Style::Marks)],
                    ),
                ],
                caption:
                    "Curve and residuals of the model that was fitted to the readings of loading."
                        .into(),
            }
        };
        checks::channels(&fitted.readings)
            .iter()
            .map(figure)
            .collect()
    }
}

/// Range of the pressures.
pub(super) fn scope(fitted: &Fitted) -> Vec<Scope> {
    let bias = fitted.fit.estimates[BIAS].value;
    let pressures = fitted.readings.iter().map(|r| r.load.pressure(bias));
    vec![Scope {
        name: "pressure".into(),
        unit: "Pa",
        range: range(pressures),
    }]
}

/// Range of the voltages of a channel, V.
fn voltages(readings: &[Reading], channel: usize) -> f64 {
    let of = readings.iter().filter(|r| r.channel == channel);
    let [low, high] = range(of.map(|r| r.voltage));
    (high - low).max(0.0)
}
