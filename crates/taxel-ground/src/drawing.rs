//! Drawings of a device to scale, as SVG: what taxel understood of a sensor
//! file, so that a wrong one is seen at once.

use crate::svg::{Anchor, Svg};

/// A device from above and cut open.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawing {
    /// Name of the device.
    pub title: String,
    /// Top view first, then sections and details.
    pub views: Vec<View>,
}

/// One view; its scale is the same across and upwards.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct View {
    /// View, such as `cross-section at y = 0`.
    pub title: String,
    /// Shapes in the order of painting. Lengths in m, y upwards.
    pub shapes: Vec<Shape>,
    /// Lengths with their arrows.
    pub dimensions: Vec<DimensionLine>,
    /// Names at places.
    pub labels: Vec<Label>,
}

/// Something with an outline.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Part of the device that the shape shows.
    pub part: Part,
    /// Its outline.
    pub outline: Outline,
}

/// Outline of a shape, m.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// From the lower left to the upper right corner.
    Rectangle([f64; 2], [f64; 2]),
    /// Closed through these corners.
    Polygon(Vec<[f64; 2]>),
    /// Centre and radius.
    Circle([f64; 2], f64),
}

/// Part of a device; gives its colour and its name in the key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// The rigid base.
    Base,
    /// Soft body.
    Elastomer,
    /// A bump on the soft body.
    Bump,
    /// Conductor.
    Electrode,
    /// Soft insulation.
    Insulation,
    /// Air.
    Air,
    /// Piezoelectric ceramic.
    Ceramic,
    /// Liquid metal.
    LiquidMetal,
    /// Permanent magnet.
    Magnet,
    /// A chip.
    Chip,
    /// Region of a taxel, dashed.
    Taxel,
}

/// A length between two points, drawn beside them.
#[derive(Debug, Clone, PartialEq)]
pub struct DimensionLine {
    /// From here, m.
    pub from: [f64; 2],
    /// To here, m; level with `from` or straight above or below it.
    pub to: [f64; 2],
    /// Offset of the arrow from the points, px: up or right is positive.
    pub beside: f64,
    /// Text, such as `H = 950 um`.
    pub text: String,
}

/// A name at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Middle of the text, m.
    pub at: [f64; 2],
    /// The text.
    pub text: String,
}

impl Shape {
    /// A rectangle from its lower left to its upper right corner, m.
    pub fn rectangle(part: Part, low: [f64; 2], high: [f64; 2]) -> Self {
        Self {
            part,
            outline: Outline::Rectangle(low, high),
        }
    }

    /// A circle, m.
    pub fn circle(part: Part, centre: [f64; 2], radius: f64) -> Self {
        Self {
            part,
            outline: Outline::Circle(centre, radius),
        }
    }

    /// Lower left and upper right corner of the box around it, m.
    fn bounds(&self) -> [[f64; 2]; 2] {
        match &self.outline {
            Outline::Rectangle(low, high) => [*low, *high],
            Outline::Circle(centre, radius) => {
                [centre.map(|c| c - radius), centre.map(|c| c + radius)]
            }
            Outline::Polygon(corners) => corners
                .iter()
                .fold(NOTHING, |bounds, corner| join(bounds, [*corner, *corner])),
        }
    }
}

impl DimensionLine {
    /// A length with its name, `H` and 950e-6 to `H = 950 um`.
    pub fn new(from: [f64; 2], to: [f64; 2], beside: f64, name: &str) -> Self {
        let length = (from[0] - to[0]).hypot(from[1] - to[1]);
        let length = length_text(length);
        let text = if name.is_empty() {
            length
        } else {
            format!("{name} {length}")
        };
        Self {
            from,
            to,
            beside,
            text,
        }
    }
}

impl DimensionLine {
    /// The same with the standard deviation of made devices, m, such as `D 50 um, σ 1 um`; nothing
    /// for one of 0.
    #[must_use]
    pub fn made_within(mut self, deviation: f64) -> Self {
        if deviation > 0.0 {
            self.text = format!("{}, σ {}", self.text, length_text(deviation));
        }
        self
    }
}

/// A length for people: in mm from 1 mm on, below in um.
pub fn length_text(length: f64) -> String {
    let rounded = |value: f64| (value * 1e3).round() / 1e3;
    if length >= 0.99995e-3 {
        format!("{} mm", rounded(length * 1e3))
    } else {
        format!("{} um", rounded(length * 1e6))
    }
}

const NOTHING: [[f64; 2]; 2] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];

fn join(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [
        std::array::from_fn(|i| a[0][i].min(b[0][i])),
        std::array::from_fn(|i| a[1][i].max(b[1][i])),
    ]
}

impl Part {
    fn class(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::Elastomer => "elastomer",
            Self::Bump => "bump",
            Self::Electrode => "electrode",
            Self::Insulation => "insulation",
            Self::Air => "air",
            Self::Ceramic => "ceramic",
            Self::LiquidMetal => "liquid",
            Self::Magnet => "magnet",
            Self::Chip => "chip",
            Self::Taxel => "taxel",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::LiquidMetal => "liquid metal",
            part => part.class(),
        }
    }
}

/// Width of the page, and least room on either side of the shapes of a view, px.
const WIDTH: f64 = 760.0;
const MARGIN: f64 = 165.0;
/// From the arrow of an upright dimension to its text, and from a text to the edge of the page, px.
const TEXT_GAP: f64 = 7.0;
const EDGE: f64 = 4.0;
/// Size of the texts of dimensions, px.
pub const TEXT_SIZE: f64 = 12.0;
/// Largest mean width of a character in its size: the font is that of the viewer.
const CHARACTER: f64 = 0.62;
const HIGHEST: f64 = 440.0;
const TITLE: f64 = 34.0;
const VIEW_TITLE: f64 = 26.0;
/// Room above and below the shapes of a view for dimensions, px.
const ROOM: f64 = 62.0;
const STYLE: &str = ".paper{fill:#fff}.title{font-size:16px;font-weight:600;fill:#111}\
    .view{font-size:13px;font-weight:600;fill:#111}.text{font-size:12px;fill:#111}\
    .base{fill:#b8bcc2;stroke:#555}.elastomer{fill:#f3e7cf;stroke:#8a7a55}\
    .bump{fill:#e3cda0;stroke:#8a7a55}.electrode{fill:#d9a400;stroke:#6b5200}\
    .insulation{fill:#cfe8d5;stroke:#4d7a58}.air{fill:#eef6fc;stroke:#8fb3cc}\
    .ceramic{fill:#b8a9d9;stroke:#55428a}.liquid{fill:#8597ad;stroke:#33475e}.magnet{fill:#b5534a;stroke:#5e211b}.chip{fill:#3d4a4f;stroke:#161c1f}\
    .taxel{fill:none;stroke:#d55e00;stroke-dasharray:5 3}\
    rect,path,circle{stroke-width:1;vector-effect:non-scaling-stroke}\
    .arrow{stroke:#111;stroke-width:1}.help{stroke:#111;stroke-width:.5;stroke-dasharray:2 2}\
    .halo{font-size:12px;fill:#111;paint-order:stroke;stroke:#fff;stroke-width:3px}";

impl Drawing {
    /// The drawing as an SVG document.
    pub fn svg(&self) -> String {
        let mut svg = Svg::default();
        let frames: Vec<Frame> = self.views.iter().map(Frame::new).collect();
        let height = TITLE + frames.iter().map(Frame::height).sum::<f64>() + 34.0;
        svg.rectangle("paper", [0.0, 0.0], [WIDTH, height]);
        svg.text("title", [WIDTH / 2.0, 22.0], Anchor::Middle, &self.title);
        let mut top = TITLE;
        for (view, frame) in self.views.iter().zip(&frames) {
            view.draw(&mut svg, frame, top);
            top += frame.height();
        }
        self.key(&mut svg, top + 12.0);
        svg.finish([WIDTH, height], &self.title, STYLE)
    }

    /// Key of the colours.
    fn key(&self, svg: &mut Svg, top: f64) {
        let shapes = self.views.iter().flat_map(|view| &view.shapes);
        let mut parts: Vec<Part> = shapes.map(|shape| shape.part).collect();
        parts.sort_unstable();
        parts.dedup();
        let mut left = 20.0;
        for part in parts {
            svg.rectangle(part.class(), [left, top], [14.0, 12.0]);
            svg.text(
                "text",
                [left + 20.0, top + 10.0],
                Anchor::Start,
                part.name(),
            );
            left += 38.0 + 7.0 * part.name().len() as f64;
        }
    }
}

/// Placement of a view in the page.
struct Frame {
    bounds: [[f64; 2]; 2],
    /// px per m.
    scale: f64,
}

impl Frame {
    fn new(view: &View) -> Self {
        let bounds = view.shapes.iter().map(Shape::bounds).fold(NOTHING, join);
        let [low, high] = bounds;
        let size: [f64; 2] = std::array::from_fn(|i| (high[i] - low[i]).max(1e-9));
        let sides = view.dimensions.iter().map(DimensionLine::room_beside);
        let margin = sides.fold(MARGIN, f64::max);
        let scale = ((WIDTH - 2.0 * margin) / size[0]).min(HIGHEST / size[1]);
        Self { bounds, scale }
    }

    fn height(&self) -> f64 {
        let tall = (self.bounds[1][1] - self.bounds[0][1]).max(0.0);
        VIEW_TITLE + 2.0 * ROOM + tall * self.scale
    }

    fn place(&self, top: f64, [x, y]: [f64; 2]) -> [f64; 2] {
        let [low, high] = self.bounds;
        let middle = 0.5 * (low[0] + high[0]);
        [
            WIDTH / 2.0 + (x - middle) * self.scale,
            top + VIEW_TITLE + ROOM + (high[1] - y) * self.scale,
        ]
    }
}

impl View {
    fn draw(&self, svg: &mut Svg, frame: &Frame, top: f64) {
        svg.text("view", [20.0, top + 16.0], Anchor::Start, &self.title);
        let place = |point: [f64; 2]| frame.place(top, point);
        for shape in &self.shapes {
            let class = shape.part.class();
            match &shape.outline {
                Outline::Rectangle(low, high) => {
                    let corner = place([low[0], high[1]]);
                    let size = [0, 1].map(|i| (high[i] - low[i]) * frame.scale);
                    svg.rectangle(class, corner, size);
                }
                Outline::Circle(centre, radius) => {
                    svg.circle(class, place(*centre), radius * frame.scale);
                }
                Outline::Polygon(corners) => {
                    let corners: Vec<_> = corners.iter().map(|corner| place(*corner)).collect();
                    svg.path(class, &corners, true);
                }
            }
        }
        for dimension in &self.dimensions {
            dimension.draw(svg, place(dimension.from), place(dimension.to));
        }
        for label in &self.labels {
            let [x, y] = place(label.at);
            svg.text("halo", [x, y + 4.0], Anchor::Middle, &label.text);
        }
    }
}

/// True for a length that lies, not stands.
fn level(from: [f64; 2], to: [f64; 2]) -> bool {
    (from[1] - to[1]).abs() < (from[0] - to[0]).abs()
}

/// Largest width of a text in a font of this size, px.
pub fn text_width(text: &str, size: f64) -> f64 {
    CHARACTER * size * text.chars().count() as f64
}

impl DimensionLine {
    /// Width that an upright dimension and its text take beside the shapes, px.
    fn room_beside(&self) -> f64 {
        if level(self.from, self.to) {
            return 0.0;
        }
        self.beside.abs() + TEXT_GAP + text_width(&self.text, TEXT_SIZE) + EDGE
    }

    fn draw(&self, svg: &mut Svg, from: [f64; 2], to: [f64; 2]) {
        let level = level(from, to);
        let shift = if level {
            [0.0, -self.beside]
        } else {
            [self.beside, 0.0]
        };
        let [a, b] = [from, to].map(|point| [point[0] + shift[0], point[1] + shift[1]]);
        svg.line("help", from, a);
        svg.line("help", to, b);
        svg.line("arrow", a, b);
        // Ticks across the ends: arrow heads would not fit a thin layer.
        for end in [a, b] {
            svg.line(
                "arrow",
                [end[0] - 3.5, end[1] + 3.5],
                [end[0] + 3.5, end[1] - 3.5],
            );
        }
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let (at, anchor) = match (level, self.beside < 0.0) {
            (true, false) => ([middle[0], middle[1] - 5.0], Anchor::Middle),
            (true, true) => ([middle[0], middle[1] + 14.0], Anchor::Middle),
            (false, false) => ([middle[0] + TEXT_GAP, middle[1] + 4.0], Anchor::Start),
            (false, true) => ([middle[0] - TEXT_GAP, middle[1] + 4.0], Anchor::End),
        };
        svg.text("halo", at, anchor, &self.text);
    }
}
