//! Columns of the loads on a sheet of microchannels.

use crate::predict::{Load, LoadColumn, LoadKind};
use crate::quantity::{AREA, FORCE, LENGTH, STRESS};

/// Largest loads that are taken for loads on a soft sheet, Pa, N and m².
const HIGHEST_PRESSURE: f64 = 100e6;
const LARGEST_FORCE: f64 = 1e3;
const LARGEST_AREA: f64 = 1.0;
/// Smallest area, m²: 1 um².
const SMALLEST_AREA: f64 = 1e-12;

pub(super) const PRESSURE: usize = 0;
pub(super) const FORCE_Z: usize = 1;
pub(super) const AREA_COLUMN: usize = 2;
pub(super) const LOADED_SHARE: usize = 3;
pub(super) const PATCH_X: usize = 4;
pub(super) const PATCH_Y: usize = 5;
pub(super) const PUNCH: usize = 6;
pub(super) const CENTRE_X: usize = 7;
pub(super) const CENTRE_Y: usize = 8;

/// The pressure of a load in Pa, and the column that names it.
pub(super) fn pressure_of(load: &Load<'_>) -> (usize, f64) {
    match (load.number(FORCE_Z), load.number(AREA_COLUMN)) {
        (Some(force), Some(area)) => (FORCE_Z, force / area),
        _ => (PRESSURE, load.number(PRESSURE).unwrap_or(0.0)),
    }
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

pub(super) static LOADS: [LoadColumn; 9] = [
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

/// Columns of the position of a load on the block.
const PLACE: [usize; 5] = [PATCH_X, PATCH_Y, PUNCH, CENTRE_X, CENTRE_Y];

/// True if these columns put a load on a part of the top.
pub(super) fn is_local(given: &[bool]) -> bool {
    PLACE.iter().any(|column| given.get(*column) == Some(&true))
}
