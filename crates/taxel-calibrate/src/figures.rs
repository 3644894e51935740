//! The figure of a fit that several kinds of devices share.

use taxel::figure::{Axis, Chart, Figure, Series};

/// Readings with the curves of models, and below them what the models leave.
pub(crate) struct FitFigure {
    pub(crate) title: String,
    pub(crate) caption: &'static str,
    pub(crate) x: Axis,
    /// Title of the upper chart.
    pub(crate) signal: &'static str,
    /// Labels of the upper and of the lower chart.
    pub(crate) labels: [&'static str; 2],
    pub(crate) unit: &'static str,
    pub(crate) curves: Vec<Series>,
    pub(crate) left: Vec<Series>,
}

impl From<FitFigure> for Figure {
    fn from(of: FitFigure) -> Self {
        let chart = |title: &str, label: &str, series| Chart {
            title: title.into(),
            x: of.x.clone(),
            y: Axis::new(label, of.unit),
            series,
        };
        Self {
            title: of.title,
            charts: vec![
                chart(of.signal, of.labels[0], of.curves),
                chart("Readings less model", of.labels[1], of.left),
            ],
            caption: of.caption.into(),
        }
    }
}
