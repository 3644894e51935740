//! How far the closed form of a layer's force is known to be off.

use super::compressed_layer::{CompressedLayer, TopFace};
use super::electrodes::{ElectrodeStiffness, Electrodes};
use super::end_condition::EndCondition;
use super::layer_range::{LARGEST_COMPRESSION, LayerRange};
use taxel_numerics::table::interpolate;

/// H/L of the rows of [`FREE`] ...
const INVERSE_ASPECTS: [f64; 6] = [0.1, 0.2, 0.25, 1.0 / 3.0, 0.4, 0.5];
/// ... and relative compressions of its columns, the last to which all were solved.
const FREE_COMPRESSIONS: [f64; 3] = [0.02, 0.05, 0.1];
/// Difference of [`EndCondition::Free`], electrodes as soft as the layer, base wider than
/// the load or not, whichever is larger.
const FREE: [[f64; 3]; 6] = [
    [0.038, 0.044, 0.085],
    [0.069, 0.077, 0.107],
    [0.078, 0.089, 0.129],
    [0.081, 0.100, 0.149],
    [0.079, 0.103, 0.159],
    [0.076, 0.103, 0.164],
];
/// Largest difference of [`EndCondition::ShortLayer`].
const SHORT: f64 = 0.023;
/// Scatter of the elements behind [`EndCondition::WideLayer`].
const WIDE: f64 = 0.03;
/// Compressions of [`GRIPPED`].
const GRIPPED_COMPRESSIONS: [f64; 3] = [0.05, 0.1, 0.2];
/// What a gripped face adds, for L/H from 1.8 to 5. The elements end soon after.
const GRIPPED: [f64; 3] = [0.0, 0.01, 0.16];
/// Moduli of the electrodes over that of the layer ...
const STIFFNESSES: [f64; 3] = [1.0, 1.75, 3.5];
/// ... and what electrodes 1 mm wide add, the most that was solved.
const STIFF: [f64; 3] = [0.0, 0.058, 0.15];

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
        EndCondition::ShortLayer => Some(SHORT),
        EndCondition::WideLayer => Some(WIDE),
        EndCondition::Tapered(_) | EndCondition::Tail(_) | EndCondition::Given(_) => None,
    }
}

fn of_free_ends(inverse_aspect: f64, compression: f64) -> Option<f64> {
    let solved = |nodes: &[f64]| nodes[0]..=nodes[nodes.len() - 1];
    let within = solved(&INVERSE_ASPECTS).contains(&inverse_aspect)
        && compression <= FREE_COMPRESSIONS[FREE_COMPRESSIONS.len() - 1];
    let column = FREE.map(|row| interpolate(&FREE_COMPRESSIONS, &row, compression));
    within.then(|| interpolate(&INVERSE_ASPECTS, &column, inverse_aspect))
}

fn of_grip(top: TopFace, compression: f64) -> Option<f64> {
    let solved = GRIPPED_COMPRESSIONS[GRIPPED_COMPRESSIONS.len() - 1];
    match top {
        TopFace::Frictionless => (compression <= LARGEST_COMPRESSION).then_some(0.0),
        TopFace::Gripped => (compression <= solved)
            .then(|| interpolate(&GRIPPED_COMPRESSIONS, &GRIPPED, compression)),
    }
}

fn of_electrodes(layer: &CompressedLayer, electrodes: &Electrodes) -> Option<f64> {
    let ElectrodeStiffness::Modulus(stiff) = electrodes.stiffness else {
        return Some(0.0);
    };
    let ratio = stiff.youngs_modulus / layer.youngs_modulus;
    let solved = STIFFNESSES[0]..=STIFFNESSES[STIFFNESSES.len() - 1];
    solved
        .contains(&ratio)
        .then(|| interpolate(&STIFFNESSES, &STIFF, ratio))
}
