//! Results of the fit of an array of cells.

use super::{CellsCalibrator, Reading};
use crate::device_model::{Findings, Fitted, Judged};
use crate::figures::FitFigure;
use crate::loads::span;
use crate::outcome::{ResidualSummary, Scope};
use crate::split::by_series;
use taxel::figure::{Axis, Figure, Series, Style};

impl Findings for CellsCalibrator<'_> {
    /// Residuals of the channel of each cell that was pressed, at the input of the last stage.
    fn residuals(&self, of: &Judged<'_, Self>) -> Vec<ResidualSummary> {
        let at = of.fits[0].fit.values();
        let summary = |series: &Vec<Reading>| {
            let predicted = self.bench(series).follow(&at);
            let pairs = series.iter().zip(predicted);
            let left = pairs.map(|(reading, signal)| {
                self.chain.input(reading.signal) - self.chain.input(signal)
            });
            let range = span(
                series
                    .iter()
                    .map(|reading| self.chain.input(reading.signal)),
            );
            let name = format!(
                "{}.reading",
                self.series_name(series)
                    .replace(", ", ".")
                    .replace(' ', "_")
            );
            ResidualSummary::of(name, self.unit(), &left.collect::<Vec<_>>(), range)
        };
        by_series(&of.readings[0]).iter().map(summary).collect()
    }

    fn scope(&self, of: &Judged<'_, Self>) -> Vec<Scope> {
        let pressed = of.readings[0].iter().map(Reading::pressure);
        let (column, _, _, unit) = self.pressing();
        vec![Scope::of(column, unit, pressed)]
    }

    fn figures(&self, of: &Judged<'_, Self>, _: &[Vec<Fitted<Reading, ()>>]) -> Vec<Figure> {
        let at = of.fits[0].fit.values();
        let figure = |series: &Vec<Reading>| {
            let mut series = series.clone();
            series.sort_by(|a, b| a.pressure().total_cmp(&b.pressure()));
            let predicted = self.bench(&series).follow(&at);
            let (column, unit, size, _) = self.pressing();
            let shown = |pressure: f64, input: f64| [pressure / size, input];
            let pairs = || series.iter().zip(&predicted);
            let read = |reading: &Reading| self.chain.input(reading.signal);
            let marks = series
                .iter()
                .map(|r| shown(r.pressure(), read(r)))
                .collect();
            let curve = pairs()
                .map(|(r, signal)| shown(r.pressure(), self.chain.input(*signal)))
                .collect();
            let left = pairs()
                .map(|(r, signal)| shown(r.pressure(), read(r) - self.chain.input(*signal)))
                .collect();
            Figure::from(FitFigure {
                title: self.series_name(&series),
                caption: "Curve and residuals of the model that was fitted to the readings of loading.",
                x: Axis::new(column, unit),
                signal: "Reading",
                labels: ["reading", "residual"],
                unit: self.unit(),
                curves: vec![
                    Series::new("readings", marks, Style::Marks),
                    Series::new("cells", curve, Style::Line),
                ],
                left: vec![Series::new("cells", left, Style::Marks)],
            })
        };
        by_series(&of.fits[0].readings).iter().map(figure).collect()
    }
}

impl CellsCalibrator<'_> {
    /// SI unit at the input of the last stage.
    fn unit(&self) -> &'static str {
        match self.column().0 {
            super::COUNTS => "",
            super::CAPACITANCE => "F",
            super::RESISTANCE => "ohm",
            super::PORT_PRESSURE => "Pa",
            super::FLUX_DENSITY => "T",
            _ => "V",
        }
    }
}
