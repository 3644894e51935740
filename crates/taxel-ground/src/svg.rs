//! Scalable vector graphics: the few elements that figures and drawings need.
//! The same input gives the same text.

use std::fmt::Write as _;

use crate::shown;

/// An SVG document in the making.
#[derive(Debug, Clone, Default)]
pub struct Svg {
    body: String,
}

/// Where a text stands relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

impl Svg {
    /// Anything, such as a path; the caller vouches for its form.
    pub fn raw(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    /// A straight line.
    pub fn line(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        let _ = writeln!(
            self.body,
            "<line class=\"{class}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>",
            short(from[0]),
            short(from[1]),
            short(to[0]),
            short(to[1])
        );
    }

    /// A rectangle from its upper left corner.
    pub fn rectangle(&mut self, class: &str, corner: [f64; 2], size: [f64; 2]) {
        let _ = writeln!(
            self.body,
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            short(corner[0]),
            short(corner[1]),
            short(size[0]),
            short(size[1])
        );
    }

    /// A circle.
    pub fn circle(&mut self, class: &str, centre: [f64; 2], radius: f64) {
        let _ = writeln!(
            self.body,
            "<circle class=\"{class}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>",
            short(centre[0]),
            short(centre[1]),
            short(radius)
        );
    }

    /// An open or closed line through points.
    pub fn path(&mut self, class: &str, points: &[[f64; 2]], closed: bool) {
        let _ = write!(self.body, "<path class=\"{class}\" d=\"");
        for (index, [x, y]) in points.iter().enumerate() {
            let word = if index == 0 { 'M' } else { 'L' };
            let _ = write!(self.body, "{word}{} {}", short(*x), short(*y));
        }
        self.raw(if closed { "Z\"/>" } else { "\"/>" });
    }

    /// A text.
    pub fn text(&mut self, class: &str, at: [f64; 2], anchor: Anchor, text: &str) {
        let _ = writeln!(
            self.body,
            "<text class=\"{class}\" x=\"{}\" y=\"{}\" text-anchor=\"{}\">{}</text>",
            short(at[0]),
            short(at[1]),
            anchor.name(),
            escape(&shown::units(text))
        );
    }

    /// A text that reads upwards.
    pub fn upward_text(&mut self, class: &str, at: [f64; 2], text: &str) {
        let _ = writeln!(
            self.body,
            "<text class=\"{class}\" transform=\"translate({} {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            short(at[0]),
            short(at[1]),
            escape(&shown::units(text))
        );
    }

    /// The whole document: size in pixels, name for those who cannot see it,
    /// style sheet.
    pub fn finish(self, size: [f64; 2], title: &str, style: &str) -> String {
        let [width, height] = size.map(short);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             role=\"img\" font-family=\"system-ui, sans-serif\">\n<title>{}</title>\n<style>{style}</style>\n{}</svg>\n",
            escape(title),
            self.body
        )
    }
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// Hundredths of a pixel are enough for a picture, and the text stays short.
fn short(value: f64) -> String {
    let rounded = (value * 100.0).round() / 100.0;
    // No negative zero in the text.
    format!("{}", rounded + 0.0)
}

/// Text inside XML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
