//! How far the closed form of a layer's force is known to be off.

use std::sync::LazyLock;

use super::compressed_layer::{CompressedLayer, TopFace};
use super::electrodes::{ElectrodeStiffness, Electrodes};
use super::end_condition::EndCondition;
use super::layer_range::{LARGEST_COMPRESSION, LayerRange};
use crate::solved_table::{Curve, SolvedTable};
use taxel_numerics::table::interpolate;

/// The differences of `tables/p1_force_error.csv`.
struct Differences {
    /// Of [`EndCondition::Free`]: H/L, and the difference against the compression.
    free: Vec<(f64, Curve)>,
    /// Of [`EndCondition::ShortLayer`] and [`EndCondition::WideLayer`].
    short: f64,
    wide: f64,
    /// What a gripped face adds, against the compression. The elements end soon after.
    gripped: Curve,
    /// What stiffer electrodes add, against their modulus over that of the layer.
    stiff: Curve,
}

static DIFFERENCES: LazyLock<Differences> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p1_force_error.csv"));
    let curve = |part: &str, x: &str| table.curve(x, "difference", |row| row.text("part") == part);
    let one = |part: &str| {
        let mut rows = table.rows().filter(|row| row.text("part") == part);
        rows.next().map_or(f64::NAN, |row| row.number("difference"))
    };
    let mut aspects: Vec<f64> = Vec::new();
    for row in table.rows().filter(|row| row.text("part") == "free") {
        if aspects.last() != Some(&row.number("at")) {
            aspects.push(row.number("at"));
        }
    }
    let free = |aspect: &f64| {
        let curve = table.curve("compression", "difference", |row| {
            row.text("part") == "free" && row.number("at") == *aspect
        });
        (1.0 / aspect, curve)
    };
    Differences {
        free: aspects.iter().map(free).collect(),
        short: one("short"),
        wide: one("wide"),
        gripped: curve("gripped", "compression"),
        stiff: curve("stiff", "at"),
    }
});

/// Largest known difference of the force of the closed form from that of finite
/// elements, as a share of it, at a relative compression.
///
/// The parts of the ends, of a gripped face and of stiffer electrodes are added.
/// `None` where no elements were solved.
///
/// ```
/// use taxel::mechanics::force_error;
/// let sensor = taxel::sensor::Sensor::shipped("in-plane-50um").unwrap();
/// let model = sensor.in_plane().unwrap().model();
/// let error = force_error(&model.layer, &model.electrodes, 0.1).unwrap();
/// assert!((error - 0.081).abs() < 1e-12);
/// assert_eq!(force_error(&model.layer, &model.electrodes, 0.5), None);
/// ```
pub fn force_error(
    layer: &CompressedLayer,
    electrodes: &Electrodes,
    compression: f64,
) -> Option<f64> {
    if layer.range(compression) != LayerRange::Within {
        return None;
    }
    Some(
        of_ends(layer, compression)?
            + of_grip(layer.top, compression)?
            + of_electrodes(layer, electrodes)?,
    )
}

fn of_ends(layer: &CompressedLayer, compression: f64) -> Option<f64> {
    // A calibrated end factor belongs to a device, not to a drawing.
    if layer.end_scale != 1.0 {
        return None;
    }
    match layer.end_condition {
        EndCondition::Free => of_free_ends(1.0 / layer.aspect(), compression),
        EndCondition::ShortLayer => Some(DIFFERENCES.short),
        EndCondition::WideLayer => Some(DIFFERENCES.wide),
        EndCondition::Tapered(_) | EndCondition::Tail(_) | EndCondition::Given(_) => None,
    }
}

fn of_free_ends(inverse_aspect: f64, compression: f64) -> Option<f64> {
    let free = &DIFFERENCES.free;
    let places: Vec<f64> = free.iter().map(|(inverse, _)| *inverse).collect();
    let solved = *places.first()?..=*places.last()?;
    let within = solved.contains(&inverse_aspect) && compression <= free.first()?.1.end();
    let column: Vec<f64> = free
        .iter()
        .map(|(_, curve)| curve.at(compression))
        .collect();
    within.then(|| interpolate(&places, &column, inverse_aspect))
}

fn of_grip(top: TopFace, compression: f64) -> Option<f64> {
    let gripped = &DIFFERENCES.gripped;
    match top {
        TopFace::Frictionless => (compression <= LARGEST_COMPRESSION).then_some(0.0),
        TopFace::Gripped => (compression <= gripped.end()).then(|| gripped.at(compression)),
    }
}

fn of_electrodes(layer: &CompressedLayer, electrodes: &Electrodes) -> Option<f64> {
    let ElectrodeStiffness::Modulus(stiff) = electrodes.stiffness else {
        return Some(0.0);
    };
    let ratio = stiff.youngs_modulus / layer.youngs_modulus;
    let stiff = &DIFFERENCES.stiff;
    (stiff.start()..=stiff.end())
        .contains(&ratio)
        .then(|| stiff.at(ratio))
}
