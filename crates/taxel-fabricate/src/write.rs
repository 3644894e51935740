//! All files of a plan.

use taxel::work::Parts;

use crate::bill::bill;
use crate::dxf::dxf;
use crate::error::Refused;
use crate::figures::drawn;
use crate::gds::gds;
use crate::options::{Options, Polarity};
use crate::plan::Plan;
use crate::stl::stl;

/// A file that was not written yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// Height of the letters of notes, as a share of the longer side of the field.
const LETTERS: f64 = 0.015;

/// Writes a plan: `masks.dxf`, `masks.gds`, a file for each mould, `layers.csv`, `drawing.svg`.
///
/// `origin` says what wrote the files and stands in each that takes notes: version, commit, hash of
/// the sensor file.
///
/// # Errors
/// [`Refused::Grid`] if rounding to the grid moves an edge by more than 0.1 % of the smallest
/// distance between edges of its mask; [`Refused::Reach`] for an array beyond GDSII's numbers.
pub fn files(plan: &Plan, options: &Options, origin: &str) -> Result<Vec<File>, Refused> {
    let masks = drawn(plan, options)?;
    let notes = notes(plan, options, origin);
    let [x, y] = plan.field.size();
    let letters = LETTERS * x.max(y);
    let at = [plan.field.low[0], plan.field.low[1] - 0.1 * x.max(y)];
    let parts = Parts::new("files for the workshop", 4 + plan.moulds.len() as u64);
    let file = |name: &str, bytes: Vec<u8>| {
        parts.done(1);
        File {
            name: name.into(),
            bytes,
        }
    };
    let mut files = vec![
        file(
            "masks.dxf",
            dxf(&masks, options.grid, &notes, at, letters).into_bytes(),
        ),
        file(
            "masks.gds",
            gds(&masks, options.grid, &notes, at, 1.6 * letters),
        ),
    ];
    for mould in &plan.moulds {
        let mesh = mould.mesh(options.shrink);
        files.push(file(&format!("{}.stl", mould.name), stl(&mesh, origin)));
    }
    files.push(file("layers.csv", bill(&plan.layers).into_bytes()));
    files.push(file("drawing.svg", plan.drawing.svg().into_bytes()));
    Ok(files)
}

/// Lines of the layer of notes.
fn notes(plan: &Plan, options: &Options, origin: &str) -> Vec<String> {
    let mut notes = vec![plan.name.clone(), origin.to_owned()];
    if options.mirror {
        notes.push("MIRRORED along x".into());
    }
    if options.polarity == Polarity::Inverted {
        notes.push("INVERTED: figures are what is left of the field around the parts".into());
    }
    notes.push("NOT COMPLETE. Not in the sensor file, and so not drawn:".into());
    notes.extend(plan.missing.iter().map(|what| format!("- {what}")));
    notes
}
