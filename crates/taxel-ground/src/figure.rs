//! Figures: charts of curves and marks as SVG or as a page of their own.
//! Deterministic: the same numbers give the same text.

use std::fmt::Write as _;

use crate::svg::{Anchor, Svg};

pub use crate::svg::escape;

/// One or more charts under one title.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Title.
    pub title: String,
    /// Charts, one below the other.
    pub charts: Vec<Chart>,
    /// Contents and assumptions; may be empty.
    pub caption: String,
}

/// Curves over one pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title; may be empty.
    pub title: String,
    /// Axis across.
    pub x: Axis,
    /// Axis upwards.
    pub y: Axis,
    /// Curves and marks.
    pub series: Vec<Series>,
}

/// An axis of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity.
    pub label: String,
    /// Unit of the numbers in the series; empty for a plain number.
    pub unit: String,
    /// True if the axis is logarithmic; only positive values are drawn then.
    pub logarithmic: bool,
}

/// A curve or a set of marks.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points in the units of the axes; those that are not finite interrupt
    /// the curve.
    pub points: Vec<[f64; 2]>,
    /// Style of the series.
    pub style: Style,
}

/// Style of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
    /// A mark at each point.
    Marks,
}

impl Axis {
    /// A linear axis.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            unit: unit.into(),
            logarithmic: false,
        }
    }

    /// A logarithmic axis.
    pub fn logarithmic(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            logarithmic: true,
            ..Self::new(label, unit)
        }
    }

    fn title(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} [{}]", self.label, self.unit)
        }
    }
}

impl Series {
    /// A series.
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>, style: Style) -> Self {
        Self {
            name: name.into(),
            points,
            style,
        }
    }
}

/// Width of a figure and height of one chart, px.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 400.0;
/// Room left of, right of, above and below the field of a chart, px.
const LEFT: f64 = 78.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 52.0;
const TITLE: f64 = 34.0;
/// Lines of a legend, px apart, and series in one of its rows.
const LEGEND_ROW: f64 = 20.0;
const LEGEND_COLUMNS: usize = 3;
/// Colours that stay apart in print and for the colour-blind (Okabe and Ito).
const COLOURS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#000000",
];

impl Figure {
    /// A figure of one chart.
    pub fn of(title: impl Into<String>, chart: Chart, caption: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            charts: vec![chart],
            caption: caption.into(),
        }
    }

    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let mut svg = Svg::default();
        let heights: Vec<f64> = self.charts.iter().map(Chart::height).collect();
        let size = [WIDTH, TITLE + heights.iter().sum::<f64>()];
        svg.rectangle("paper", [0.0, 0.0], size);
        svg.text("title", [WIDTH / 2.0, 22.0], Anchor::Middle, &self.title);
        let mut top = TITLE;
        for (chart, height) in self.charts.iter().zip(heights) {
            chart.draw(&mut svg, top);
            top += height;
        }
        svg.finish(size, &self.title, &style())
    }

    /// The figure with pictures below it, each an SVG document with its title, as one SVG
    /// document.
    pub fn svg_with(&self, pictures: &[(String, String)]) -> String {
        let charts = self.svg();
        if pictures.is_empty() {
            return charts;
        }
        let mut bottom = size_of(&charts)[1];
        let mut inside = charts;
        for (title, picture) in pictures {
            let [width, height] = size_of(picture);
            let shown = height * WIDTH / width;
            let _ = write!(
                inside,
                "<text x=\"{}\" y=\"{:.0}\" text-anchor=\"middle\" font-family=\"sans-serif\" font-size=\"13\">{}</text>\n\
                 <svg y=\"{:.0}\" width=\"{WIDTH}\" height=\"{shown:.0}\" viewBox=\"0 0 {width} {height}\">{picture}</svg>\n",
                WIDTH / 2.0,
                bottom + 20.0,
                escape(title),
                bottom + TITLE,
            );
            bottom += TITLE + shown;
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {bottom:.0}\" width=\"{WIDTH}\" height=\"{bottom:.0}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{inside}</svg>\n"
        )
    }

    /// The figure as a page that needs nothing else.
    pub fn html(&self) -> String {
        self.html_with(&[])
    }

    /// The same with pictures below it, as [`Figure::svg_with`].
    pub fn html_with(&self, pictures: &[(String, String)]) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>body{{font-family:system-ui,sans-serif;max-width:760px;margin:2rem auto;padding:0 1rem}}\
             svg{{max-width:100%;height:auto}}</style>\n{}<p>{}</p>\n</html>\n",
            self.svg_with(pictures),
            escape(&self.caption),
            title = escape(&self.title),
        )
    }
}

/// Width and height of an SVG document, px; a square where it has none.
fn size_of(svg: &str) -> [f64; 2] {
    let sizes = svg
        .split_once("viewBox=\"0 0 ")
        .and_then(|(_, rest)| rest.split_once('"'));
    let mut numbers = sizes
        .map_or("", |(sizes, _)| sizes)
        .split(' ')
        .map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(width)), Some(Ok(height))) if width > 0.0 => [width, height],
        _ => [WIDTH, WIDTH],
    }
}

/// Widths of the first curves of a chart and of all later ones, px.
const WIDTHS: [f64; 4] = [3.6, 2.8, 2.0, 1.4];

fn style() -> String {
    let mut style = String::from(
        ".paper{fill:#fff}.title{font-size:16px;font-weight:600;fill:#111}\
         .chart{font-size:13px;font-weight:600;fill:#111}.label{font-size:13px;fill:#111}\
         .tick{font-size:12px;fill:#333}.grid{stroke:#ddd;stroke-width:1}\
         .frame{fill:none;stroke:#333;stroke-width:1}.zero{stroke:#888;stroke-width:1}\
         .curve{fill:none;stroke-linejoin:round}.dashed{stroke-dasharray:7 4}",
    );
    for (index, colour) in COLOURS.iter().enumerate() {
        let _ = write!(
            style,
            ".s{index}{{stroke:{colour}}}.m{index}{{fill:{colour}}}"
        );
    }
    for (index, width) in WIDTHS.iter().enumerate() {
        let _ = write!(style, ".w{index}{{stroke-width:{width}}}");
    }
    style
}

fn mark(index: usize) -> String {
    format!("m{}", index % COLOURS.len())
}

/// Value to place along one axis.
#[derive(Debug, Clone)]
struct Scale {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    logarithmic: bool,
}

impl Scale {
    fn new(values: impl Iterator<Item = f64>, logarithmic: bool) -> Self {
        let usable = values.filter(|value| value.is_finite() && (!logarithmic || *value > 0.0));
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        if low > high {
            return Self::linear(0.0, 1.0);
        }
        if logarithmic {
            return Self::decades(low, high);
        }
        // A curve that begins near zero is read better against zero.
        let low = if low > 0.0 && low < 0.35 * high {
            0.0
        } else {
            low
        };
        let high = if high < 0.0 && high > 0.35 * low {
            0.0
        } else {
            high
        };
        Self::linear(low, high)
    }

    fn linear(low: f64, high: f64) -> Self {
        let span = if high > low {
            high - low
        } else {
            low.abs().max(1.0)
        };
        let step = nice_step(span / 6.0);
        // What rounding left just beyond a tick needs no further one.
        let first = (low / step + 1e-6).floor();
        let last = (high / step - 1e-6).ceil().max(first + 1.0);
        let ticks = (0..=(last - first) as usize).map(|i| (first + i as f64) * step);
        Self {
            low: first * step,
            high: last * step,
            ticks: ticks.collect(),
            logarithmic: false,
        }
    }

    fn decades(low: f64, high: f64) -> Self {
        let first = low.log10().floor();
        let last = high.log10().ceil().max(first + 1.0);
        let every = ((last - first) / 8.0).ceil().max(1.0);
        let count = ((last - first) / every).floor() as usize;
        Self {
            low: 10.0_f64.powf(first),
            high: 10.0_f64.powf(last),
            ticks: (0..=count)
                .map(|i| 10.0_f64.powf(first + every * i as f64))
                .collect(),
            logarithmic: true,
        }
    }

    /// Share of the way from the low to the high end.
    fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    fn label(&self, tick: f64) -> String {
        if self.logarithmic {
            return scientific(tick, 0);
        }
        let step = (self.high - self.low) / (self.ticks.len() - 1) as f64;
        let largest = self.low.abs().max(self.high.abs());
        // Rounding in the multiples of the step must not show as -0.
        let tick = if tick.abs() < 1e-9 * step { 0.0 } else { tick };
        let exponent = step.log10().floor();
        if (1e-4..1e6).contains(&largest) {
            // Steps of 2.5 need one more decimal than their power of ten says.
            let finer = (step / 10.0_f64.powf(exponent)).fract().abs() > 1e-6;
            let decimals = (f64::from(finer) - exponent).max(0.0) as usize;
            format!("{tick:.decimals$}")
        } else if tick == 0.0 {
            String::from("0")
        } else {
            let digits = (largest.log10().floor() - exponent).max(0.0) as usize;
            scientific(tick, digits)
        }
    }
}

/// Round values from `low` to `high` with their texts.
pub(crate) fn ticks_within(low: f64, high: f64) -> Vec<(f64, String)> {
    let scale = Scale::linear(low, high);
    let rounding = 1e-9 * (high - low);
    let inside = |tick: &&f64| (low - rounding..=high + rounding).contains(*tick);
    let ticks = scale.ticks.iter().filter(inside);
    ticks.map(|tick| (*tick, scale.label(*tick))).collect()
}

/// 1, 2, 2.5 or 5 times a power of ten, at least `raw`.
fn nice_step(raw: f64) -> f64 {
    let power = 10.0_f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 2.5, 5.0, 10.0]
        .into_iter()
        .find(|factor| factor * power >= raw * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

fn scientific(value: f64, decimals: usize) -> String {
    let exponent = value.abs().log10().floor() as i32;
    if decimals == 0 && (-3..=3).contains(&exponent) {
        return format!("{}", 10.0_f64.powi(exponent).max(value));
    }
    format!("{value:.decimals$e}")
}

impl Chart {
    fn legend_rows(&self) -> usize {
        self.series.len().div_ceil(LEGEND_COLUMNS)
    }

    fn height(&self) -> f64 {
        HEIGHT + LEGEND_ROW * self.legend_rows() as f64
    }

    fn draw(&self, svg: &mut Svg, top: f64) {
        let all = || self.series.iter().flat_map(|series| &series.points);
        let across = Scale::new(all().map(|point| point[0]), self.x.logarithmic);
        let upward = Scale::new(all().map(|point| point[1]), self.y.logarithmic);
        let (left, right) = (LEFT, WIDTH - RIGHT);
        let (low, high) = (top + HEIGHT - BOTTOM, top + TOP);
        let x = |value: f64| left + (right - left) * across.share(value);
        let y = |value: f64| low + (high - low) * upward.share(value);
        svg.text("chart", [left, top + 22.0], Anchor::Start, &self.title);
        for tick in &across.ticks {
            let at = x(*tick);
            svg.line("grid", [at, low], [at, high]);
            svg.text(
                "tick",
                [at, low + 18.0],
                Anchor::Middle,
                &across.label(*tick),
            );
        }
        for tick in &upward.ticks {
            let at = y(*tick);
            svg.line("grid", [left, at], [right, at]);
            svg.text(
                "tick",
                [left - 8.0, at + 4.0],
                Anchor::End,
                &upward.label(*tick),
            );
        }
        if upward.low < 0.0 && upward.high > 0.0 && !upward.logarithmic {
            svg.line("zero", [left, y(0.0)], [right, y(0.0)]);
        }
        svg.rectangle("frame", [left, high], [right - left, low - high]);
        let middle = [0.5 * (left + right), 0.5 * (low + high)];
        svg.text(
            "label",
            [middle[0], low + 40.0],
            Anchor::Middle,
            &self.x.title(),
        );
        svg.upward_text("label", [18.0, middle[1]], &self.y.title());
        for (index, series) in self.series.iter().enumerate() {
            series.draw(svg, index, |[a, b]| {
                let drawable = a.is_finite()
                    && b.is_finite()
                    && (!across.logarithmic || a > 0.0)
                    && (!upward.logarithmic || b > 0.0);
                drawable.then(|| [x(a), y(b)])
            });
            let column = (index % LEGEND_COLUMNS) as f64;
            let row = (index / LEGEND_COLUMNS) as f64;
            let width = (right - left) / LEGEND_COLUMNS as f64;
            let at = [left + column * width, low + 62.0 + row * LEGEND_ROW];
            series.key(svg, index, at);
        }
    }
}

impl Series {
    fn draw(&self, svg: &mut Svg, index: usize, place: impl Fn([f64; 2]) -> Option<[f64; 2]>) {
        match self.style {
            Style::Marks => {
                for at in self.points.iter().filter_map(|point| place(*point)) {
                    svg.circle(&mark(index), at, 3.0);
                }
            }
            Style::Line | Style::Dashed => {
                let mut run: Vec<[f64; 2]> = Vec::new();
                for point in self.points.iter().map(|point| place(*point)).chain([None]) {
                    match point {
                        Some(at) => run.push(at),
                        None if run.len() > 1 => {
                            svg.path(&self.class(index), &std::mem::take(&mut run), false);
                        }
                        None => run.clear(),
                    }
                }
            }
        }
    }

    fn class(&self, index: usize) -> String {
        // The first curves are the wider ones: a later one on top of them
        // leaves their edges visible.
        let (colour, width) = (index % COLOURS.len(), index.min(WIDTHS.len() - 1));
        let dashed = if self.style == Style::Dashed {
            " dashed"
        } else {
            ""
        };
        format!("curve s{colour} w{width}{dashed}")
    }

    fn key(&self, svg: &mut Svg, index: usize, [x, y]: [f64; 2]) {
        match self.style {
            Style::Marks => svg.circle(&mark(index), [x + 12.0, y - 4.0], 3.0),
            _ => svg.path(
                &self.class(index),
                &[[x, y - 4.0], [x + 24.0, y - 4.0]],
                false,
            ),
        }
        svg.text("tick", [x + 30.0, y], Anchor::Start, &self.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_hold_the_data() {
        for (low, high) in [
            (0.0, 1.0),
            (-3.2, 7.9),
            (1e-9, 4.3e-9),
            (1.0, 1.0),
            (-5.0, -4.9),
        ] {
            let scale = Scale::new([low, high].into_iter(), false);
            assert!(scale.low <= low && scale.high >= high, "{scale:?}");
            assert!((2..=12).contains(&scale.ticks.len()), "{scale:?}");
            for value in [low, high] {
                assert!((0.0..=1.0).contains(&scale.share(value)));
            }
        }
        let scale = Scale::new([0.02, 300.0].into_iter(), true);
        assert_eq!((scale.low.log10(), scale.high.log10()), (-2.0, 3.0));
    }

    #[test]
    fn labels_are_short() {
        let scale = Scale::linear(0.0, 15.0);
        let labels: Vec<_> = scale.ticks.iter().map(|tick| scale.label(*tick)).collect();
        assert_eq!(labels, ["0.0", "2.5", "5.0", "7.5", "10.0", "12.5", "15.0"]);
        assert_eq!(Scale::decades(1e-2, 1e5).label(1e-2), "0.01");
        assert_eq!(Scale::decades(1e-9, 1e5).label(1e-9), "1e-9");
    }

    #[test]
    fn what_is_not_a_number_interrupts_a_curve_and_never_reaches_the_text() {
        let points = vec![
            [0.0, 1.0],
            [1.0, 2.0],
            [f64::NAN, 3.0],
            [3.0, f64::INFINITY],
            [4.0, 0.0],
            [5.0, 1.0],
        ];
        let chart = Chart {
            title: String::new(),
            x: Axis::new("a < b", "m"),
            y: Axis::new("c", ""),
            series: vec![Series::new("s", points, Style::Line)],
        };
        let text = Figure::of("t", chart, "").svg();
        assert_eq!(text.matches("class=\"curve s0 w0\"").count(), 3); // two runs and the legend
        assert!(!text.contains("NaN") && !text.contains("inf"));
        assert!(text.contains("a &lt; b [m]"));
    }
}
