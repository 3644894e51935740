//! Heat maps: a number for every pair of two lengths.

use taxel_ground::svg::{Anchor, Svg};

/// One or more maps of the same grid, beside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title of all maps.
    pub title: String,
    /// Meaning of the colours, with the unit.
    pub value: String,
    /// Name and places of the columns.
    pub across: (String, Vec<String>),
    /// Name and places of the rows, from below.
    pub upward: (String, Vec<String>),
    /// Title and numbers of each map, row by row from below; a mark behind a number
    /// says what else holds there.
    pub maps: Vec<(String, Vec<MapCell>)>,
    /// Meaning of the marks.
    pub caption: String,
}

/// One field of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapCell {
    /// The number; none where there is none.
    pub value: Option<f64>,
    /// A mark behind it, such as "*".
    pub mark: &'static str,
}

const FIELD: [f64; 2] = [36.0, 20.0];
const MARGIN: [f64; 2] = [62.0, 48.0];
const PER_LINE: usize = 3;
/// Width in which title, bar and caption find their place.
const LEAST_WIDTH: f64 = 620.0;
/// Size of the bar that shows the colours.
const BAR: [f64; 2] = [240.0, 10.0];

impl HeatMap {
    /// The figure.
    pub fn svg(&self) -> String {
        let columns = self.across.1.len() as f64;
        let rows = self.upward.1.len() as f64;
        let one = [
            MARGIN[0] + columns * FIELD[0] + 16.0,
            MARGIN[1] + rows * FIELD[1] + 42.0,
        ];
        let lines = self.maps.len().div_ceil(PER_LINE);
        let beside = self.maps.len().clamp(1, PER_LINE);
        let size = [
            (one[0] * beside as f64 + 16.0).max(LEAST_WIDTH),
            one[1] * lines as f64 + 112.0,
        ];
        let mut svg = Svg::default();
        svg.text("title", [16.0, 24.0], Anchor::Start, &self.title);
        svg.text("note", [16.0, 42.0], Anchor::Start, &self.value);
        let limits = self.limits();
        bar(&mut svg, limits);
        for (number, (title, cells)) in self.maps.iter().enumerate() {
            let corner = [
                one[0] * (number % PER_LINE) as f64,
                80.0 + one[1] * (number / PER_LINE) as f64,
            ];
            self.map(&mut svg, corner, title, cells, limits);
        }
        svg.text("note", [16.0, size[1] - 12.0], Anchor::Start, &self.caption);
        svg.finish(
            size,
            &self.title,
            ".title{font:600 15px sans-serif}.note,.label{font:11px sans-serif;fill:#444}.cell{font:10px sans-serif}\
             .dark{fill:#fff}.light{fill:#111}.head{font:600 12px sans-serif}",
        )
    }

    /// A page that holds the figure and needs nothing else.
    pub fn html(&self) -> String {
        format!(
            "<!doctype html>\n<meta charset=\"utf-8\">\n<title>{}</title>\n{}",
            taxel_ground::svg::escape(&self.title),
            self.svg()
        )
    }

    fn limits(&self) -> [f64; 2] {
        let values = self.maps.iter().flat_map(|(_, cells)| cells);
        let found = values.filter_map(|cell| cell.value.filter(|value| *value > 0.0));
        found.fold([f64::INFINITY, 0.0], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
    }

    fn map(
        &self,
        svg: &mut Svg,
        corner: [f64; 2],
        title: &str,
        cells: &[MapCell],
        limits: [f64; 2],
    ) {
        let columns = self.across.1.len();
        let rows = self.upward.1.len();
        let origin = [corner[0] + MARGIN[0], corner[1] + MARGIN[1] - 20.0];
        let height = rows as f64 * FIELD[1];
        svg.text("head", [origin[0], corner[1] + 18.0], Anchor::Start, title);
        for (number, cell) in cells.iter().enumerate() {
            let (row, column) = (number / columns, number % columns);
            let at = [
                origin[0] + column as f64 * FIELD[0],
                origin[1] + height - (row + 1) as f64 * FIELD[1],
            ];
            let Some(value) = cell.value else { continue };
            // Changes spread over decades: the colours are those of the logarithm.
            let (colour, dark) = colour(share(value, limits));
            svg.raw(&format!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{}\" height=\"{}\" fill=\"{colour}\"/>",
                at[0], at[1], FIELD[0], FIELD[1]
            ));
            let class = if dark { "cell dark" } else { "cell light" };
            let text = if value < 9.995 {
                format!("{value:.2}{}", cell.mark)
            } else {
                format!("{value:.1}{}", cell.mark)
            };
            let middle = [at[0] + FIELD[0] / 2.0, at[1] + FIELD[1] / 2.0 + 3.0];
            svg.text(class, middle, Anchor::Middle, &text);
        }
        for (column, label) in self.across.1.iter().enumerate() {
            let x = origin[0] + (column as f64 + 0.5) * FIELD[0];
            svg.text(
                "label",
                [x, origin[1] + height + 14.0],
                Anchor::Middle,
                label,
            );
        }
        for (row, label) in self.upward.1.iter().enumerate() {
            let y = origin[1] + height - (row as f64 + 0.5) * FIELD[1] + 4.0;
            svg.text("label", [origin[0] - 6.0, y], Anchor::End, label);
        }
        let middle = origin[0] + columns as f64 * FIELD[0] / 2.0;
        svg.text(
            "label",
            [middle, origin[1] + height + 30.0],
            Anchor::Middle,
            &self.across.0,
        );
        svg.upward_text(
            "label",
            [corner[0] + 14.0, origin[1] + height / 2.0],
            &self.upward.0,
        );
    }
}

/// Place of a value in the scale, 0 to 1, by its logarithm; the middle where all values
/// are the same, the start for what has no logarithm.
fn share(value: f64, [low, high]: [f64; 2]) -> f64 {
    if value <= 0.0 {
        0.0
    } else if high > low {
        ((value / low).ln() / (high / low).ln()).clamp(0.0, 1.0)
    } else {
        0.5
    }
}

/// The colours with the values at their ends and in the middle.
fn bar(svg: &mut Svg, [low, high]: [f64; 2]) {
    const STEPS: usize = 48;
    if high <= low {
        return;
    }
    let corner = [16.0, 52.0];
    let width = BAR[0] / STEPS as f64;
    for step in 0..STEPS {
        let (colour, _) = colour((step as f64 + 0.5) / STEPS as f64);
        // A little wider than its place, so that no seams show.
        svg.raw(&format!(
            "<rect x=\"{:.1}\" y=\"{}\" width=\"{:.1}\" height=\"{}\" fill=\"{colour}\"/>",
            corner[0] + step as f64 * width,
            corner[1],
            width + if step + 1 < STEPS { 0.5 } else { 0.0 },
            BAR[1]
        ));
    }
    let ends = [
        (0.0, Anchor::Start),
        (0.5, Anchor::Middle),
        (1.0, Anchor::End),
    ];
    for (place, anchor) in ends {
        let value = low * (high / low).powf(place);
        let at = [corner[0] + place * BAR[0], corner[1] + BAR[1] + 12.0];
        svg.text("label", at, anchor, &format!("{value:.2}"));
    }
}

/// A perceptual scale from dark blue over green to yellow, and whether it is dark.
fn colour(share: f64) -> (String, bool) {
    const SCALE: [[f64; 3]; 6] = [
        [68.0, 1.0, 84.0],
        [65.0, 68.0, 135.0],
        [42.0, 120.0, 142.0],
        [34.0, 168.0, 132.0],
        [122.0, 209.0, 81.0],
        [253.0, 231.0, 37.0],
    ];
    let place = share * (SCALE.len() - 1) as f64;
    let below = (place as usize).min(SCALE.len() - 2);
    let part = place - below as f64;
    let mix: [f64; 3] =
        std::array::from_fn(|k| SCALE[below][k] * (1.0 - part) + SCALE[below + 1][k] * part);
    (
        format!("rgb({:.0},{:.0},{:.0})", mix[0], mix[1], mix[2]),
        share < 0.45,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: &[f64]) -> HeatMap {
        let cells = values.iter().map(|&value| MapCell {
            value: Some(value),
            mark: "*",
        });
        HeatMap {
            title: String::from("maps"),
            value: String::from("value"),
            across: (
                String::from("a"),
                values.iter().map(|_| "1".into()).collect(),
            ),
            upward: (String::from("b"), vec!["1".into()]),
            maps: vec![(String::from("one"), cells.collect())],
            caption: String::new(),
        }
    }

    #[test]
    fn values_without_a_range_have_a_colour() {
        for values in [&[2.0][..], &[2.0, 2.0], &[0.0], &[-1.0, 3.0]] {
            assert!(!of(values).svg().contains("NaN"), "{values:?}");
        }
    }

    #[test]
    fn a_number_never_grows_beyond_its_field() {
        let svg = of(&[9.996, 9.99]).svg();
        assert!(svg.contains(">10.0*<") && svg.contains(">9.99*<"), "{svg}");
    }
}
