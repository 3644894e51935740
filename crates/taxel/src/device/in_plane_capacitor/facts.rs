//! Quantities derived from the drawing of an in-plane sensor.

use super::InPlaneArray;
use crate::device::chain::{CONTACT_DEVIATIONS, CONTACT_SHARE};
use crate::device::{capacitor_board, of_table};
use crate::mechanics::{ElectrodeStiffness, LayerRange};
use crate::summary::{Fact, fact, number, text};
use crate::transduction::{CapacitanceLaw, InPlaneInverse, InPlaneModel, Surroundings};

/// Compressions at which the error of the force is looked up: its curves have a dozen points each.
const ERROR_STEPS: usize = 60;

/// Compression at which a sensitivity is stated where there is none at rest.
const REFERENCE: f64 = 0.01;

pub(super) fn facts(array: &InPlaneArray<'_>) -> Vec<Fact> {
    let mut facts = vec![fact(
        "device",
        "channels",
        text(&array.layout().taxels()),
        "one capacitor per taxel",
    )];
    let model = array.model();
    // A device that was read from a file has an inverse.
    let Ok(inverse) = model.inverse() else {
        return facts;
    };
    facts.extend(mechanics(&model, &inverse));
    facts.extend(transduction(&model, &inverse));
    facts.extend(capacitor_board(&array.board));
    facts.extend(estimation(array, &inverse));
    facts.push(fact(
        "numerics",
        "contact_threshold",
        text(&format!(
            "{CONTACT_DEVIATIONS} sigma and {} % of full scale",
            100.0 * CONTACT_SHARE
        )),
        "default",
    ));
    facts
}

fn mechanics(model: &InPlaneModel, inverse: &InPlaneInverse) -> Vec<Fact> {
    let layer = &model.layer;
    let last = inverse.last();
    let verified = match last.layer.range {
        LayerRange::Within => String::from("whole range"),
        LayerRange::CompressionAbove { limit } => format!("up to a compression of {limit}"),
        LayerRange::AspectBelow { aspect, limit } => {
            format!("no: half length of {aspect:.3} thicknesses, below {limit}")
        }
    };
    // That of the range that was compared, which may end before the invertible one.
    let end = match last.layer.range {
        LayerRange::CompressionAbove { limit } => limit,
        _ => last.layer.kinematics.compression(),
    };
    let at = |step: usize| model.force_error(end * step as f64 / ERROR_STEPS as f64);
    let error = (0..=ERROR_STEPS)
        .filter_map(at)
        .reduce(f64::max)
        .map_or_else(
            || text("unknown: not compared"),
            |share| number(share, "share", "%", 1e-2),
        );
    let force_source = match (
        model.solved.as_ref().map(|solved| solved.errors().force),
        model.electrodes.stiffness,
    ) {
        _ if model.table.is_some() => "a table of finite elements",
        (Some(Some(_)), _) => "the solved cross-section, with its electrodes as stiff as they are",
        (_, ElectrodeStiffness::AsLayer) => "end condition and aspect",
        (_, ElectrodeStiffness::Modulus(_)) => {
            "end condition and aspect; what stiffer electrodes carry is left out"
        }
    };
    let mut facts = vec![
        fact(
            "mechanics",
            "shear_modulus",
            number(layer.shear_modulus(), "pa", "kPa", 1e3),
            "E/3",
        ),
        fact(
            "mechanics",
            "aspect",
            number(layer.aspect(), "ratio", "", 1.0),
            "contact half length / layer thickness",
        ),
        fact(
            "mechanics",
            "force_compared_with_finite_elements",
            text(&verified),
            force_source,
        ),
        fact(
            "mechanics",
            "force_error",
            error,
            "largest known difference from finite elements, in the same range",
        ),
        fact(
            "mechanics",
            "largest_force",
            number(last.layer.force, "n", "N", 1.0),
            "at the end of the invertible range",
        ),
        fact(
            "mechanics",
            "largest_mean_stress",
            number(last.layer.mean_stress, "pa", "kPa", 1e3),
            "largest force / loaded area",
        ),
    ];
    if let Ok(rest) = model.closed_layer().compress(0.0) {
        facts.insert(
            2,
            fact(
                "mechanics",
                "end_factor_at_rest",
                number(rest.end_factor, "ratio", "", 1.0),
                "end condition",
            ),
        );
    }
    facts
}

fn transduction(model: &InPlaneModel, inverse: &InPlaneInverse) -> Vec<Fact> {
    let last = inverse.last();
    let range_source = match inverse.turning() {
        Some(_) => "the curve turns: beyond, a change belongs to several compressions",
        None => "the model ends there",
    };
    let mut facts = origin(model);
    facts.extend([
        fact(
            "transduction",
            "rest_capacitance",
            number(model.rest_capacitance(), "f", "fF", 1e-15),
            "facing sides, coplanar strips, surroundings",
        ),
        fact(
            "transduction",
            "rest_capacitance_without_fringe",
            number(model.rest_capacitance_without_fringe(), "f", "fF", 1e-15),
            "eps0 eps_r w_e T/D",
        ),
        fact(
            "transduction",
            "invertible_compression",
            number(last.layer.kinematics.compression(), "ratio", "", 1.0),
            range_source,
        ),
        fact(
            "transduction",
            "invertible_change",
            number(last.change, "f", "fF", 1e-15),
            range_source,
        ),
    ]);
    let (compression, source) = match model.law {
        CapacitanceLaw::Mechanics => (0.0, "slope of C0 - C against force at rest"),
        CapacitanceLaw::Published => (REFERENCE, "slope at a compression of 0.01: none at rest"),
    };
    if let Ok(sensitivity) = model.sensitivity(compression) {
        facts.push(fact(
            "transduction",
            "sensitivity",
            number(sensitivity, "f_per_n", "fF/N", 1e-15),
            source,
        ));
        facts.push(fact(
            "transduction",
            "relative_sensitivity",
            number(sensitivity / model.rest_capacitance(), "per_n", "%/N", 1e-2),
            source,
        ));
    }
    facts
}

/// Most by which the closed form is low at rest beside the field, in the section of P1 with its three
/// gaps: in a uniform medium and in the others.
const REST_ERROR: [f64; 2] = [0.022, 0.035];

/// Largest difference of the change of capacitance by the closed form from the field in the solved
/// section: gaps of 20 to 100 um, electrodes as stiff as the layer to 3.5 times, compressions of 0.01 to
/// 0.28. It is 8.4 % at 50 um and 3.5 times, 3.3 % for the shipped sensors.
const CHANGE_ERROR: f64 = 0.09;

/// Where shape and capacitance of the electrodes come from, and how good they are.
fn origin(model: &InPlaneModel) -> Vec<Fact> {
    if let Some(drawn) = &model.table {
        let place = fact(
            "transduction",
            "electrodes_and_capacitance",
            text("a table of finite elements"),
            "mechanics.table",
        );
        let mut facts = vec![place];
        facts.extend(of_table("transduction", &drawn.table));
        return facts;
    }
    let Some(solved) = &model.solved else {
        let known = |error: f64| {
            if model.is_compared() {
                number(error, "share", "%", 1e-2)
            } else {
                text("unknown: not compared")
            }
        };
        return vec![
            fact(
                "transduction",
                "electrodes_and_capacitance",
                text("closed form, tables"),
                "stretch of the layer, facing sides and strips; stiff electrodes and surroundings from tables",
            ),
            fact(
                "transduction",
                "rest_capacitance_error",
                known(
                    REST_ERROR[usize::from(model.dielectric.surroundings != Surroundings::Uniform)],
                ),
                "low by this at most, with electrodes 8 thicknesses wide or wider and gaps of 1.2 or less",
            ),
            fact(
                "transduction",
                "change_error",
                known(CHANGE_ERROR),
                "of C0 - C at a compression, beside the field in the cross-section of P1, electrodes up to 3.5 times as stiff \
                 as the layer; --mechanics fem solves it",
            ),
        ];
    };
    let percent = |share: f64| number(share, "share", "%", 1e-2);
    let of_mesh = "difference of a coarser mesh, and at least what reference tables showed";
    let errors = solved.errors();
    vec![
        fact(
            "transduction",
            "electrodes_and_capacitance",
            text("solved, kept"),
            match solved.ended() {
                None => "the cross-section of the drawing; no table has it",
                Some(_) => {
                    "the cross-section of the drawing, as far as its surface can be followed; no table has it"
                }
            },
        ),
        fact(
            "transduction",
            "solved_compression",
            number(solved.largest_compression(), "ratio", "", 1.0),
            "largest compression that was solved",
        ),
        fact(
            "transduction",
            "rest_capacitance_error",
            percent(errors.capacitance),
            of_mesh,
        ),
        fact(
            "transduction",
            "change_error",
            percent(errors.change),
            of_mesh,
        ),
    ]
}

fn estimation(array: &InPlaneArray<'_>, inverse: &InPlaneInverse) -> Vec<Fact> {
    if inverse.check().is_err() {
        return vec![fact(
            "estimation",
            "resolution_at_rest",
            text("none"),
            "a reading belongs to several compressions: loads are predicted, forces are not read",
        )];
    }
    let half = inverse
        .state_from_change(0.5 * inverse.last().change)
        .map_or(0.0, |state| state.layer.kinematics.compression());
    let deviation = |compression: f64| {
        let information = array.information_at(compression, None).ok();
        information
            .and_then(|information| information.deviation("force_z"))
            .unwrap_or(f64::NAN)
    };
    vec![
        fact(
            "estimation",
            "resolution_at_rest",
            number(deviation(0.0), "n", "mN", 1e-3),
            "one standard deviation of one frame at rest",
        ),
        fact(
            "estimation",
            "resolution_at_half_range",
            number(deviation(half), "n", "mN", 1e-3),
            "the same at half of the invertible change",
        ),
    ]
}
