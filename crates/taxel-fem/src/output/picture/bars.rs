//! Scale bars of a picture: length and colours.

use std::fmt::Write as _;

use super::{BAR, Colours, MARGIN, METRE, Picture, View};
use crate::output::escape;

impl Picture<'_> {
    /// A bar of a round length, about a fifth of the drawing; of a narrow one, more, so that the
    /// bar still shows.
    pub(super) fn draw_scale_bar(&self, view: &View, text: &mut String) {
        let fifth = view.size[0].max(100.0) / 5.0 / view.scale;
        let mut fitting = self
            .units
            .iter()
            .rev()
            .filter(|unit| unit.1 <= fifth * (1.0 + 1e-9));
        let fitting = fitting.next().or(self.units.first());
        let (name, unit) = fitting.copied().unwrap_or(METRE);
        let per_unit = view.scale * unit;
        let length = round_step(fifth / unit);
        let (x, y) = (MARGIN, view.size[1] + 2.0 * MARGIN + 6.0);
        let end = x + length * per_unit;
        let label = escape(&format!("{} {name}", number(length, length)));
        let _ = writeln!(
            text,
            "<path fill=\"none\" stroke=\"#222\" stroke-width=\"1.5\" \
             d=\"M{x:.2} {:.2}v8m0 -4H{end:.2}m0 -4v8\"/>\n\
             <text x=\"{:.2}\" y=\"{:.2}\">{label}</text>",
            y - 4.0,
            end + 8.0,
            y + 4.5,
        );
    }

    pub(super) fn draw_colour_bar(&self, view: &View, text: &mut String) {
        const STEPS: usize = 64;
        let Some(colours) = self.colours else { return };
        let [low, high] = self.range(&colours);
        let x = view.size[0] + 2.0 * MARGIN + 16.0;
        let (top, height) = (MARGIN + 24.0, (view.size[1] - 24.0).max(120.0));
        let title = escape(&caption(&colours));
        let _ = writeln!(
            text,
            "<text x=\"{x:.2}\" y=\"{:.2}\">{title}</text>",
            MARGIN + 10.0
        );
        let step = height / STEPS as f64;
        for k in 0..STEPS {
            let fill = colours.map.hex((k as f64 + 0.5) / STEPS as f64);
            let y = top + height - (k + 1) as f64 * step;
            let _ = writeln!(
                text,
                "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"16\" height=\"{:.2}\" fill=\"{fill}\"/>",
                // Overlap hides the seams.
                step + if k == 0 { 0.0 } else { 0.5 },
            );
        }
        let tick = round_step((high - low) / 5.0);
        let mut k = (low / tick - 1e-9).ceil();
        while k * tick <= high + 1e-9 * tick {
            let y = top + height * (1.0 - (k * tick - low) / (high - low));
            let label = number(k * tick, tick);
            let _ = writeln!(
                text,
                "<path stroke=\"#222\" d=\"M{:.2} {y:.2}h5\"/>\
                 <text x=\"{:.2}\" y=\"{:.2}\">{label}</text>",
                x + 16.0,
                x + 25.0,
                y + 4.5,
            );
            k += 1.0;
        }
    }
}

/// Width that the colour bar takes beside the body, with its title: letters of 13 px are at most
/// 7.5 px wide on average.
pub(super) fn bar_width(colours: &Colours<'_>) -> f64 {
    BAR.max(16.0 + 7.5 * caption(colours).chars().count() as f64)
}

fn caption(colours: &Colours<'_>) -> String {
    match colours.unit {
        "" => colours.title.to_owned(),
        unit => format!("{} [{unit}]", colours.title),
    }
}

/// The nearest of 1, 2, 5, 10, ... below.
pub(super) fn round_step(length: f64) -> f64 {
    if !(length.is_finite() && length > 0.0) {
        return 1.0;
    }
    let power = libm::pow(10.0, length.log10().floor());
    // Rounding must not turn 1.9999999 into 1.
    let lead = length * (1.0 + 1e-9) / power;
    let round = [5.0, 2.0].into_iter().find(|&round| lead >= round);
    power * round.unwrap_or(1.0)
}

/// A number with the digits that its step needs.
pub(super) fn number(value: f64, step: f64) -> String {
    let value = if value.abs() < 1e-9 * step {
        0.0
    } else {
        value
    };
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs().max(step)) {
        return format!("{value:.1e}");
    }
    let digits = (-step.log10() - 1e-9).ceil().clamp(0.0, 6.0) as usize;
    format!("{value:.digits$}")
}
