//! Columns of the loads on a sheet of microchannels.

use crate::mechanics::{ClosingCurve, CurveSource, PaperLaw, PressureLaw, Stretch};
use crate::predict::{Load, LoadColumn, LoadKind, LoadRefused};
use crate::quantity::{AREA, FORCE, LENGTH, STRESS, at_most};

/// Largest loads that are taken for loads on a soft sheet, Pa, N and m².
const HIGHEST_PRESSURE: f64 = 100e6;
const LARGEST_FORCE: f64 = 1e3;
const LARGEST_AREA: f64 = 1.0;
/// Smallest area, m²: 1 um².
const SMALLEST_AREA: f64 = 1e-12;

/// Column of the pressure on the surface, Pa.
pub const PRESSURE: usize = 0;
/// Column of the pressing force, N.
pub const FORCE_Z: usize = 1;
/// Column of the area under the force, m².
pub const AREA_COLUMN: usize = 2;
/// Column of the share of a channel's length under the pressure.
pub const LOADED_SHARE: usize = 3;
/// Column of the length of a patch along x, m.
pub const PATCH_X: usize = 4;
/// Column of the length of a patch along y, m.
pub const PATCH_Y: usize = 5;
/// Column of the diameter of a punch, m.
pub const PUNCH: usize = 6;
/// Column of the middle of patch or punch along x, m.
pub const CENTRE_X: usize = 7;
/// Column of the middle of patch or punch along y, m.
pub const CENTRE_Y: usize = 8;

/// Columns of one load: those of a second one that presses at the same time follow in the
/// same order.
pub const SECOND: usize = 9;

/// The pressure of the load whose columns begin at `first` (0 or [`SECOND`]) in Pa, and the
/// column that names it.
pub fn pressure_of(load: &Load<'_>, first: usize) -> (usize, f64) {
    let number = |column: usize| load.number(first + column);
    match (number(FORCE_Z), number(AREA_COLUMN)) {
        (Some(force), Some(area)) => (first + FORCE_Z, force / area),
        _ => (first + PRESSURE, number(PRESSURE).unwrap_or(0.0)),
    }
}

/// True if a column of a second load is given.
pub fn is_double(given: &[bool]) -> bool {
    given.iter().skip(SECOND).any(|given| *given)
}

/// The parts of a microchannel under a load: the pressed one, that of the second load if
/// there is one, and the rest.
///
/// # Errors
/// Shares that are more than the whole microchannel together.
pub fn stretches_of(load: &Load<'_>) -> Result<Vec<Stretch>, LoadRefused> {
    let share = |first: usize| load.number(first + LOADED_SHARE);
    let mut stretches = vec![Stretch {
        share: share(0).unwrap_or(1.0),
        pressure: pressure_of(load, 0).1,
    }];
    if let Some(second) = share(SECOND) {
        stretches.push(Stretch {
            share: second,
            pressure: pressure_of(load, SECOND).1,
        });
    }
    let sum: f64 = stretches.iter().map(|part| part.share).sum();
    // Shares are often quotients of lengths.
    if !at_most(sum, 1.0) {
        return Err(LoadRefused {
            column: SECOND + LOADED_SHARE,
            message: format!(
                "the two loads take {sum:.6} of the length of a microchannel; they lie beside each other and can take 1 \
                 at most"
            ),
            help: String::from(
                "give smaller shares; where two pressures lie on one place, give their sum there",
            ),
        });
    }
    stretches.push(Stretch {
        share: (1.0 - sum).max(0.0),
        pressure: 0.0,
    });
    Ok(stretches)
}

/// Shortest part of a channel under a load, in thicknesses of the sheet, whose ends may be left
/// out: the sheet carries load over about its thickness.
const SHORTEST_PART: f64 = 1.4;

/// Error of the change of resistance, as a share, where loads press on parts of a channel that are
/// not shorter: what a hundred random sheets need (`docs/theory/microchannel.md`, section 9). Not known
/// of points that were typed in.
pub(super) fn part_error(closing: &ClosingCurve) -> Option<f64> {
    match closing.source() {
        CurveSource::Tabulated { .. } | CurveSource::Solved { .. } => Some(0.3),
        CurveSource::LoadPath => Some(0.6),
        CurveSource::Points => None,
    }
}

/// Error of the change of resistance, as a share, with the whole top pressed by plane-strain cells,
/// which leave the other layer out: too small by this at most on sixty random sheets, with a liquid
/// that can leave and with that of P4 (`docs/theory/microchannel.md`, section 9). None of a path that
/// was solved with both layers; not known of points that were typed in.
pub(super) fn whole_top_error(closing: &ClosingCurve, liquid: &PressureLaw) -> Option<f64> {
    let stiffens = |law: &PaperLaw| at_most(PAPER_EXPANSION, law.expansion);
    match (closing.source(), liquid) {
        (CurveSource::Points | CurveSource::LoadPath, _) | (_, PressureLaw::Sealed) => None,
        (_, PressureLaw::Paper(law)) if stiffens(law) => Some(0.25),
        _ => Some(0.7),
    }
}

/// Expansion of the liquid of P4.
const PAPER_EXPANSION: f64 = 0.2;

/// Length of the shortest part, m, for which [`part_error`] holds.
pub(super) fn shortest_part(thickness: f64) -> f64 {
    SHORTEST_PART * thickness
}

/// Largest coordinate of a position on a sheet, m.
const LARGEST_LENGTH: f64 = 1.0;

const fn length(name: &'static str, short: &'static str, about: &'static str) -> LoadColumn {
    LoadColumn {
        name,
        short,
        kind: LoadKind::Quantity(&LENGTH, [0.0, LARGEST_LENGTH]),
        required: false,
        about,
    }
}

const fn coordinate(name: &'static str, short: &'static str, about: &'static str) -> LoadColumn {
    LoadColumn {
        kind: LoadKind::Quantity(&LENGTH, [-LARGEST_LENGTH, LARGEST_LENGTH]),
        ..length(name, short, about)
    }
}

/// Columns of one load.
const ONE: [LoadColumn; SECOND] = [
    LoadColumn {
        name: "pressure",
        short: "p",
        kind: LoadKind::Quantity(&STRESS, [0.0, HIGHEST_PRESSURE]),
        required: false,
        about: "pressure on the surface",
    },
    LoadColumn {
        name: "force_z",
        short: "fz",
        kind: LoadKind::Quantity(&FORCE, [0.0, LARGEST_FORCE]),
        required: false,
        about: "pressing force, with area",
    },
    LoadColumn {
        name: "area",
        short: "area",
        kind: LoadKind::Quantity(&AREA, [SMALLEST_AREA, LARGEST_AREA]),
        required: false,
        about: "area under the force",
    },
    LoadColumn {
        name: "loaded_share",
        short: "share",
        kind: LoadKind::Number([1e-6, 1.0]),
        required: false,
        about: "share of the channel's length under the pressure; 1 without it",
    },
    length(
        "patch_x",
        "px",
        "length along x of a pressed patch, with fem",
    ),
    length(
        "patch_y",
        "py",
        "length along y of a pressed patch, with fem",
    ),
    length(
        "punch_diameter",
        "punch",
        "diameter of a flat punch under the force, with fem",
    ),
    coordinate(
        "centre_x",
        "cx",
        "middle of patch or punch along x, from that of the taxels; 0 without it",
    ),
    coordinate("centre_y", "cy", "the same along y"),
];

/// A column of the second load: that of the first under other names.
const fn second(
    name: &'static str,
    short: &'static str,
    column: usize,
    about: &'static str,
) -> LoadColumn {
    LoadColumn {
        name,
        short,
        about,
        ..ONE[column]
    }
}

/// Columns of one load, then those of a second one.
pub static LOADS: [LoadColumn; 2 * SECOND] = [
    ONE[PRESSURE],
    ONE[FORCE_Z],
    ONE[AREA_COLUMN],
    ONE[LOADED_SHARE],
    ONE[PATCH_X],
    ONE[PATCH_Y],
    ONE[PUNCH],
    ONE[CENTRE_X],
    ONE[CENTRE_Y],
    second(
        "pressure_2",
        "p2",
        PRESSURE,
        "pressure of a second load at the same time",
    ),
    second(
        "force_z_2",
        "fz2",
        FORCE_Z,
        "pressing force of the second load, with area_2",
    ),
    second(
        "area_2",
        "area2",
        AREA_COLUMN,
        "area under the second force",
    ),
    second(
        "loaded_share_2",
        "share2",
        LOADED_SHARE,
        "share of the channel's length under the second pressure",
    ),
    second(
        "patch_x_2",
        "px2",
        PATCH_X,
        "the same as patch_x of the second load",
    ),
    second(
        "patch_y_2",
        "py2",
        PATCH_Y,
        "the same as patch_y of the second load",
    ),
    second(
        "punch_diameter_2",
        "punch2",
        PUNCH,
        "the same as punch_diameter of the second load",
    ),
    second(
        "centre_x_2",
        "cx2",
        CENTRE_X,
        "the same as centre_x of the second load",
    ),
    second(
        "centre_y_2",
        "cy2",
        CENTRE_Y,
        "the same as centre_y of the second load",
    ),
];

/// Columns of the position of a load on the block.
const PLACE: [usize; 5] = [PATCH_X, PATCH_Y, PUNCH, CENTRE_X, CENTRE_Y];

/// True if these columns put a load on a place of the top.
pub fn is_local(given: &[bool]) -> bool {
    let at = |column: usize| given.get(column) == Some(&true);
    PLACE
        .iter()
        .any(|column| at(*column) || at(SECOND + *column))
}
