//! DXF of release 12: closed polylines in mm, one layer for each mask.

use std::fmt::Write as _;

use crate::figures::Drawn;
use crate::text::ascii;

/// Layer of the notes.
const NOTES: &str = "NOTES";

/// The drawing; `grid` in m, `notes` from `at` downwards in letters of `height`, m.
pub(crate) fn dxf(
    masks: &[Drawn],
    grid: f64,
    notes: &[String],
    at: [f64; 2],
    height: f64,
) -> String {
    let mut text = String::from(
        "999\nlengths in mm\n  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  1\nAC1009\n  0\nENDSEC\n",
    );
    layers(&mut text, masks);
    text.push_str("  0\nSECTION\n  2\nENTITIES\n");
    for mask in masks {
        let name = layer(mask.name);
        for (layer, figures) in [
            (name.clone(), &mask.figures),
            (format!("{name}-MARKS"), &mask.marks),
        ] {
            for figure in figures {
                polyline(&mut text, &layer, figure, grid);
            }
        }
    }
    for (line, note) in notes.iter().enumerate() {
        let y = at[1] - 1.6 * height * line as f64;
        let [x, y, height] = [at[0], y, height].map(millimetres);
        let note = ascii(note);
        let _ = write!(
            text,
            "  0\nTEXT\n  8\n{NOTES}\n 10\n{x}\n 20\n{y}\n 30\n0\n 40\n{height}\n  1\n{note}\n"
        );
    }
    text.push_str("  0\nENDSEC\n  0\nEOF\n");
    text
}

/// The table of layers; each has a colour of its own.
fn layers(text: &mut String, masks: &[Drawn]) {
    let mut names = Vec::new();
    for mask in masks {
        names.push(layer(mask.name));
        if !mask.marks.is_empty() {
            names.push(format!("{}-MARKS", layer(mask.name)));
        }
    }
    names.push(NOTES.into());
    let _ = write!(
        text,
        "  0\nSECTION\n  2\nTABLES\n  0\nTABLE\n  2\nLAYER\n 70\n{}\n",
        names.len()
    );
    for (number, name) in names.iter().enumerate() {
        let colour = number % 6 + 1;
        let _ = write!(
            text,
            "  0\nLAYER\n  2\n{name}\n 70\n0\n 62\n{colour}\n  6\nCONTINUOUS\n"
        );
    }
    text.push_str("  0\nENDTAB\n  0\nENDSEC\n");
}

fn polyline(text: &mut String, layer: &str, corners: &[[i32; 2]; 4], grid: f64) {
    let _ = write!(
        text,
        "  0\nPOLYLINE\n  8\n{layer}\n 66\n1\n 10\n0\n 20\n0\n 30\n0\n 70\n1\n"
    );
    for corner in corners {
        let [x, y] = corner.map(|coordinate| millimetres(f64::from(coordinate) * grid));
        let _ = write!(
            text,
            "  0\nVERTEX\n  8\n{layer}\n 10\n{x}\n 20\n{y}\n 30\n0\n"
        );
    }
    let _ = write!(text, "  0\nSEQEND\n  8\n{layer}\n");
}

/// Names of release 12 have capitals.
fn layer(name: &str) -> String {
    name.to_ascii_uppercase()
}

/// A length in mm to a picometre, without trailing zeros.
fn millimetres(length: f64) -> String {
    let text = format!("{:.9}", length * 1e3);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}
