//! Normal stress on a plane as a picture, with the elements that lie in it.
//! Deterministic: the same numbers give the same text.

use std::fmt::Write as _;

use crate::figure::ticks_within;
use crate::svg::escape;

/// Normal stress on a rectangle of a plane, in equal square cells.
#[derive(Debug, Clone, PartialEq)]
pub struct StressMap {
    /// What the picture shows, for readers that cannot see it.
    pub title: String,
    /// Lower left corner, m.
    pub low: [f64; 2],
    /// Side of a cell, m.
    pub cell: f64,
    /// Number of cells along x.
    pub columns: usize,
    /// Mean normal stress of each cell, Pa, positive where it presses; row by row from below.
    /// What is not finite is left white.
    pub stress: Vec<f64>,
    /// Centres of the elements, m, with their names.
    pub elements: Vec<([f64; 2], String)>,
    /// Side of an element, m.
    pub element_side: f64,
    /// Centres and radii of the contacts, m.
    pub contacts: Vec<([f64; 2], f64)>,
}

/// Width of the plane in the picture, px.
const WIDTH: f64 = 560.0;
/// Left and right margin, and room below for axis and bar, px.
const MARGIN: f64 = 50.0;
const BELOW: f64 = 96.0;
const ABOVE: f64 = 14.0;
/// Shades of one sign: neighbouring cells of one shade are one rectangle.
const SHADES: f64 = 40.0;
/// Size of the bar of shades, px.
const BAR: [f64; 2] = [280.0, 10.0];
/// Room for a value below the bar, px.
const LABEL: f64 = 40.0;
/// Pulling stress that is shown, as a share of the greatest pressing one.
const LEAST_PULL: f64 = 0.01;

impl StressMap {
    /// Rows of cells.
    fn rows(&self) -> usize {
        self.stress.len() / self.columns.max(1)
    }

    /// Least and greatest stress of the scale, Pa: zero is in it.
    fn limits(&self) -> [f64; 2] {
        let finite = self.stress.iter().filter(|stress| stress.is_finite());
        let [low, high] = finite.fold([0.0_f64, 0.0_f64], |[low, high], stress| {
            [low.min(*stress), high.max(*stress)]
        });
        let pulled = -low > LEAST_PULL * high;
        [if pulled { low } else { 0.0 }, high]
    }

    /// The picture as an SVG document.
    ///
    /// ```
    /// use taxel_ground::stress_map::StressMap;
    /// let map = StressMap {
    ///     title: "two cells".into(),
    ///     low: [0.0, 0.0],
    ///     cell: 1e-3,
    ///     columns: 2,
    ///     stress: vec![2e3, -1e3],
    ///     elements: vec![([1e-3, 0.5e-3], "1".into())],
    ///     element_side: 1e-3,
    ///     contacts: Vec::new(),
    /// };
    /// let svg = map.svg();
    /// assert!(svg.contains("-1.0") && svg.contains("2.0 kPa"));
    /// ```
    pub fn svg(&self) -> String {
        let columns = self.columns.max(1) as f64;
        let scale = WIDTH / (columns * self.cell);
        let height = self.rows() as f64 * self.cell * scale;
        let size = [WIDTH + 2.0 * MARGIN, ABOVE + height + BELOW];
        let place = |[x, y]: [f64; 2]| {
            [
                MARGIN + (x - self.low[0]) * scale,
                ABOVE + height - (y - self.low[1]) * scale,
            ]
        };
        let mut text = String::new();
        let _ = write!(
            text,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0} {:.0}\" width=\"{:.0}\" height=\"{:.0}\" \
             font-family=\"sans-serif\" font-size=\"11\" fill=\"#333\" role=\"img\"><title>{}</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            size[0],
            size[1],
            size[0],
            size[1],
            escape(&self.title)
        );
        let limits = self.limits();
        self.cells(&mut text, limits, scale, place(self.low));
        // What reaches beyond the plane is cut at its frame.
        let _ = writeln!(
            text,
            "<svg x=\"{MARGIN}\" y=\"{ABOVE}\" width=\"{WIDTH}\" height=\"{height:.1}\" \
             viewBox=\"{MARGIN} {ABOVE} {WIDTH} {height:.1}\">"
        );
        self.outlines(&mut text, scale, place);
        text += "</svg>\n";
        let _ = writeln!(
            text,
            "<rect x=\"{MARGIN}\" y=\"{ABOVE}\" width=\"{WIDTH}\" height=\"{height:.1}\" fill=\"none\" stroke=\"#999\"/>"
        );
        self.axes(&mut text, columns, place);
        bar(&mut text, limits, ABOVE + height + 54.0);
        text += "</svg>\n";
        text
    }

    /// Cells of one shade beside each other are one rectangle.
    fn cells(&self, text: &mut String, limits: [f64; 2], scale: f64, [left, bottom]: [f64; 2]) {
        let side = self.cell * scale;
        for (number, row) in self.stress.chunks(self.columns.max(1)).enumerate() {
            let top = bottom - (number + 1) as f64 * side;
            let shades: Vec<Option<i32>> = row.iter().map(|of| shade(*of, limits)).collect();
            let mut first = 0;
            while first < shades.len() {
                let alike = shades[first..]
                    .iter()
                    .take_while(|of| **of == shades[first]);
                let count = alike.count();
                if let Some(shade) = shades[first].filter(|shade| *shade != 0) {
                    // A little larger than its place, so that no seams show.
                    let _ = writeln!(
                        text,
                        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
                        left + first as f64 * side,
                        top,
                        count as f64 * side + 0.4,
                        side + 0.4,
                        colour(shade)
                    );
                }
                first += count;
            }
        }
    }

    fn outlines(&self, text: &mut String, scale: f64, place: impl Fn([f64; 2]) -> [f64; 2]) {
        let side = self.element_side * scale;
        for (centre, name) in &self.elements {
            let [x, y] = place(*centre);
            let _ = writeln!(
                text,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{side:.1}\" height=\"{side:.1}\" fill=\"none\" stroke=\"#111\" \
                 stroke-width=\"1.2\"/><text x=\"{:.1}\" y=\"{:.1}\" paint-order=\"stroke\" stroke=\"#fff\" \
                 stroke-width=\"3\">{}</text>",
                x - 0.5 * side,
                y - 0.5 * side,
                x - 0.5 * side + 4.0,
                y - 0.5 * side + 13.0,
                escape(name)
            );
        }
        for (centre, radius) in &self.contacts {
            let [x, y] = place(*centre);
            let _ = writeln!(
                text,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\" fill=\"none\" stroke=\"#111\" stroke-dasharray=\"5 3\"/>",
                radius * scale
            );
        }
    }

    /// Round millimetres along x and y.
    fn axes(&self, text: &mut String, columns: f64, place: impl Fn([f64; 2]) -> [f64; 2]) {
        let [x, y] = self.low;
        let [width, height] = [columns, self.rows() as f64].map(|count| count * self.cell);
        let [left, bottom] = place(self.low);
        for (millimetres, label) in ticks_within(1e3 * x, 1e3 * (x + width)) {
            let [at, _] = place([1e-3 * millimetres, y]);
            let _ = writeln!(
                text,
                "<path d=\"M{at:.1} {bottom:.1}v4\" stroke=\"#999\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
                 text-anchor=\"middle\">{label}</text>",
                bottom + 16.0
            );
        }
        for (millimetres, label) in ticks_within(1e3 * y, 1e3 * (y + height)) {
            let [_, at] = place([x, 1e-3 * millimetres]);
            let _ = writeln!(
                text,
                "<path d=\"M{left:.1} {at:.1}h-4\" stroke=\"#999\"/><text x=\"{:.1}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{label}</text>",
                left - 7.0,
                at + 4.0
            );
        }
        let _ = writeln!(
            text,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">x and y in mm</text>",
            MARGIN + 0.5 * WIDTH,
            bottom + 32.0
        );
    }
}

/// Step of the scale, negative where it pulls; `None` for what is not a number. The greater
/// end of the scale is the darkest step of both signs.
fn shade(stress: f64, [low, high]: [f64; 2]) -> Option<i32> {
    let end = high.max(-low);
    if !stress.is_finite() || end <= 0.0 {
        return None;
    }
    let step = (stress.clamp(low, high) / end * SHADES).round();
    Some(step as i32)
}

/// White at zero, red where it presses, blue where it pulls.
fn colour(shade: i32) -> String {
    let dark: [f64; 3] = if shade > 0 {
        [150.0, 20.0, 30.0]
    } else {
        [25.0, 60.0, 150.0]
    };
    let share = (f64::from(shade.abs()) / SHADES).powf(0.7);
    let [red, green, blue] = dark.map(|end| 255.0 + share * (end - 255.0));
    format!("#{:02x}{:02x}{:02x}", red as u8, green as u8, blue as u8)
}

/// The shades with the values at the ends and at zero.
fn bar(text: &mut String, [low, high]: [f64; 2], top: f64) {
    const STEPS: i32 = 80;
    let span = high - low;
    if span <= 0.0 {
        return;
    }
    let left = MARGIN + 0.5 * (WIDTH - BAR[0]);
    let step = BAR[0] / f64::from(STEPS);
    for number in 0..STEPS {
        let value = low + (f64::from(number) + 0.5) / f64::from(STEPS) * span;
        let Some(shade) = shade(value, [low, high]) else {
            continue;
        };
        let _ = writeln!(
            text,
            "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{}\" fill=\"{}\"/>",
            left + f64::from(number) * step,
            step + 0.4,
            BAR[1],
            colour(shade)
        );
    }
    let mut places = vec![high];
    if low < 0.0 {
        places.push(low);
    }
    let far_from_zero = |value: &f64| value.abs() / span * BAR[0] >= LABEL;
    if places.iter().all(far_from_zero) {
        places.push(0.0);
    }
    for value in places {
        let unit = if value == high { " kPa" } else { "" };
        let _ = writeln!(
            text,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{:.1}{unit}</text>",
            left + (value - low) / span * BAR[0],
            top + BAR[1] + 14.0,
            value * 1e-3
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">normal stress on the elements' plane, pressing positive</text>",
        MARGIN + 0.5 * WIDTH,
        top + BAR[1] + 30.0
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(stress: Vec<f64>) -> StressMap {
        StressMap {
            title: "a < b".into(),
            low: [-1e-3, 0.0],
            cell: 1e-3,
            columns: 2,
            stress,
            elements: Vec::new(),
            element_side: 1e-3,
            contacts: vec![([0.0, 0.0], 1e-3)],
        }
    }

    #[test]
    fn pressing_is_red_pulling_blue_and_zero_white() {
        let limits = [-1e3, 2e3];
        assert_eq!(shade(2e3, limits), Some(40));
        assert_eq!(shade(-1e3, limits), Some(-20));
        assert_eq!(shade(f64::NAN, limits), None);
        assert_eq!(
            (colour(40), colour(0)),
            ("#96141e".into(), "#ffffff".into())
        );
        let svg = map(vec![2e3, -1e3, 0.0, f64::NAN]).svg();
        assert!(
            svg.contains("a &lt; b") && svg.contains(&colour(40)) && svg.contains(&colour(-20))
        );
    }

    #[test]
    fn a_little_pull_is_no_scale_of_its_own() {
        assert_eq!(map(vec![2e3, -1.0]).limits(), [0.0, 2e3]);
        assert_eq!(map(vec![f64::NAN; 2]).limits(), [0.0, 0.0]);
        // Nothing to show is a frame.
        assert!(map(vec![0.0; 4]).svg().contains("<circle"));
    }
}
