//! Heat maps: a number for every pair of two lengths.

use crate::svg::{Anchor, Svg};

/// One or more maps of the same grid, beside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title of all maps.
    pub title: String,
    /// What the colours mean, with the unit.
    pub value: String,
    /// Name and places of the columns.
    pub across: (String, Vec<String>),
    /// Name and places of the rows, from below.
    pub upward: (String, Vec<String>),
    /// Title and numbers of each map, row by row from below; a mark behind a number
    /// says what else holds there.
    pub maps: Vec<(String, Vec<MapCell>)>,
    /// What the marks mean.
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

const FIELD: [f64; 2] = [30.0, 20.0];
const MARGIN: [f64; 2] = [62.0, 48.0];
const PER_LINE: usize = 3;

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
        let size = [one[0] * beside as f64 + 16.0, one[1] * lines as f64 + 84.0];
        let mut svg = Svg::default();
        svg.text("title", [16.0, 24.0], Anchor::Start, &self.title);
        svg.text("note", [16.0, 42.0], Anchor::Start, &self.value);
        let limits = self.limits();
        for (number, (title, cells)) in self.maps.iter().enumerate() {
            let corner = [
                one[0] * (number % PER_LINE) as f64,
                52.0 + one[1] * (number / PER_LINE) as f64,
            ];
            self.map(&mut svg, corner, title, cells, limits);
        }
        svg.text("note", [16.0, size[1] - 12.0], Anchor::Start, &self.caption);
        svg.finish(
            size,
            &self.title,
            ".title{font:600 15px sans-serif}.note,.label{font:11px sans-serif;fill:#444}.cell{font:9px sans-serif}\
             .dark{fill:#fff}.light{fill:#111}.head{font:600 12px sans-serif}",
        )
    }

    /// A page that holds the figure and needs nothing else.
    pub fn html(&self) -> String {
        format!(
            "<!doctype html>\n<meta charset=\"utf-8\">\n<title>{}</title>\n{}",
            crate::svg::escape(&self.title),
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
            let share = (value / limits[0]).ln() / (limits[1] / limits[0]).ln();
            let (colour, dark) = colour(share.clamp(0.0, 1.0));
            svg.raw(&format!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{}\" height=\"{}\" fill=\"{colour}\"/>",
                at[0], at[1], FIELD[0], FIELD[1]
            ));
            let class = if dark { "cell dark" } else { "cell light" };
            let text = if value < 10.0 {
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
        share < 0.55,
    )
}
