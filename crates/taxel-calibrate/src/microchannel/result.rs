//! Results of the fit of crossing microchannels: residuals, curves, scope.

use super::{BIAS, CHANNEL, Fitted, MicrochannelCalibrator, Reading};
use crate::device_model::{Findings, Judged};
use crate::figures::FitFigure;
use crate::hysteresis::Loops;
use crate::loads::span;
use crate::outcome::{Constants, ResidualSummary, Scope};
use crate::remark::Remark;
use crate::split::series_of;
use taxel::figure::{Axis, Figure, Series, Style};

impl Findings for MicrochannelCalibrator<'_> {
    /// Residuals of the signal of each channel.
    fn residuals(&self, of: &Judged<'_, Self>) -> Vec<ResidualSummary> {
        let fitted = &of.fits[0];
        let at = fitted.fit.values();
        let channels = series_of(&fitted.readings);
        let bench = self.bench_of(&channels, &of.readings[0]);
        let (name, unit) = self.board.signal.unit();
        let summary = |channel: &usize| {
            let own = |r: &&Reading| r.channel == *channel;
            let readings = of.readings[0].iter().filter(own);
            let misfits = readings.filter_map(|r| Some(r.signal - bench.predict(&at, r)?));
            let misfits: Vec<f64> = misfits.collect();
            let range = span(fitted.readings.iter().filter(own).map(|r| r.signal));
            ResidualSummary::of(format!("{CHANNEL}_{channel}.{name}"), unit, &misfits, range)
        };
        channels.iter().map(summary).collect()
    }

    fn beside(&self, of: &Judged<'_, Self>, remarks: &mut Vec<Remark>) -> Constants {
        let beyond = of.fits[0].noise.beyond;
        if beyond > 0 {
            remarks.push(Remark::whole(format!(
                "{beyond} readings lie beyond the end of the closing curves and are left out"
            )));
        }
        self.saturations(of, remarks)
    }

    fn noise(&self, _: &[Fitted]) -> String {
        ", of each channel apart".into()
    }

    fn hysteresis(&self, of: &Judged<'_, Self>) -> Vec<Loops> {
        let loops = self.loops(&of.fits[0], of.series, of.held);
        loops.into_iter().collect()
    }

    fn scope(&self, of: &Judged<'_, Self>) -> Vec<Scope> {
        let bias = of.fits[0].fit.estimates[BIAS].value;
        let pressures = of.readings[0].iter().map(|r| r.load.pressure(bias));
        vec![Scope::of("pressure", "Pa", pressures)]
    }

    fn figures(&self, of: &Judged<'_, Self>, _: &[Vec<Fitted>]) -> Vec<Figure> {
        let fitted = &of.fits[0];
        let at = fitted.fit.values();
        let channels = series_of(&fitted.readings);
        let bench = self.bench_of(&channels, &fitted.readings);
        let (name, _) = self.board.signal.unit();
        let (unit, scale) = self.board.signal.shown();
        let figure = |channel: &usize| {
            let own = fitted.readings.iter().filter(|r| r.channel == *channel);
            let mut of: Vec<&Reading> = own.collect();
            let pressure = |r: &Reading| r.load.pressure(at[BIAS]) * 1e-3;
            of.sort_by(|a, b| pressure(a).total_cmp(&pressure(b)));
            let marks = of.iter().map(|r| [pressure(r), r.signal / scale]);
            let model = of.iter().filter_map(|r| Some((r, bench.predict(&at, r)?)));
            let curve = model.clone().map(|(r, v)| [pressure(r), v / scale]);
            let left = model.map(|(r, v)| [pressure(r), (r.signal - v) / scale]);
            Figure::from(FitFigure {
                title: format!("channel {channel}"),
                caption: "Curve and residuals of the model that was fitted to the readings of loading.",
                x: Axis::new("pressure", "kPa"),
                signal: if self.board.signal.is_voltage() {
                    "Voltage"
                } else {
                    "Resistance"
                },
                labels: [name; 2],
                unit,
                curves: vec![
                    Series::new("readings", marks.collect(), Style::Marks),
                    Series::new("cell", curve.collect(), Style::Line),
                ],
                left: vec![Series::new("cell", left.collect(), Style::Marks)],
            })
        };
        channels.iter().map(figure).collect()
    }
}
