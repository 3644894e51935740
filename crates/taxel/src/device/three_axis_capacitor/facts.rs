//! Quantities derived from the drawing of a three-axis array.

use super::ThreeAxisArray;
use crate::device::capacitor_board;
use crate::estimation::{Outcome, SearchOptions, ThreeAxisOptions, estimate_unit};
use crate::summary::{Fact, fact, number, text};
use crate::transduction::{
    EdgeEnvironment, EdgeLaw, EdgeSection, GROUNDED, INNER_DISTANCE, OUTER_DISTANCE, TileWithEdges,
};

pub(super) fn facts(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let masked = array.masked();
    let masked = masked.iter().flatten().filter(|masked| **masked).count();
    let mut facts = vec![
        fact(
            "device",
            "channels",
            text(&(4 * array.layout().taxels())),
            "four capacitors per taxel",
        ),
        fact("device", "masked_capacitors", text(&masked), "mask"),
    ];
    facts.extend(mechanics(array));
    facts.extend(transduction(array));
    facts.extend(capacitor_board(&array.board));
    facts.extend(estimation(array));
    facts.extend(numerics());
    facts
}

fn mechanics(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let (element, sensor) = (array.element, array.sensor);
    let unit = element.unit_model();
    let least_gap = unit
        .plates
        .air_gap
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let [kappa_x, kappa_y] = element.torsion();
    let mut facts = vec![
        fact(
            "mechanics",
            "lever",
            number(element.lever(), "m", "um", 1e-6),
            "bump, bump layer and electrode layer",
        ),
        fact(
            "mechanics",
            "torsion_x",
            number(kappa_x, "n_m_per_rad", "mN m/rad", 1e-3),
            "k_x h L (P2 Eqs. 1-5)",
        ),
        fact(
            "mechanics",
            "torsion_y",
            number(kappa_y, "n_m_per_rad", "mN m/rad", 1e-3),
            "k_y h L",
        ),
    ];
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let displacement = element.full_scale / element.suspension.stiffness[axis];
        facts.push(fact(
            "mechanics",
            format!("full_scale_displacement_{name}"),
            number(displacement, "m", "um", 1e-6),
            "full scale / stiffness",
        ));
    }
    let top = element.outline.bump_top;
    facts.extend([
        fact(
            "mechanics",
            "closure_force_z",
            number(least_gap * element.suspension.stiffness[2], "n", "mN", 1e-3),
            "air gap x stiffness, parallel motion",
        ),
        fact(
            "mechanics",
            "full_scale_pressure_on_bump_top",
            number(element.full_scale / (top * top), "pa", "kPa", 1e3),
            "full scale / top of the bump: not a pressure range of the skin",
        ),
        fact(
            "mechanics",
            "full_scale_pressure_on_cell",
            number(
                element.full_scale / (sensor.array.pitch[0] * sensor.array.pitch[1]),
                "pa",
                "kPa",
                1e3,
            ),
            "full scale / cell of the array",
        ),
    ]);
    facts
}

fn transduction(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let (unit, element) = (array.unit_model(), array.element);
    let mut facts = Vec::new();
    for (i, name) in ["11", "12", "21", "22"].into_iter().enumerate() {
        facts.push(fact(
            "transduction",
            format!("rest_capacitance_{name}"),
            number(unit.plates.rest_capacitance(i), "f", "fF", 1e-15),
            "C_par + eps0 a b/(air + insulation/eps_r)",
        ));
    }
    facts.extend(edges(array));
    facts.push(fact(
        "transduction",
        "rest_gap_11",
        number(unit.plates.rest_gap(0), "m", "um", 1e-6),
        "equivalent gap: air + insulation/eps_r",
    ));
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let sensitivity = 1.0 / (element.suspension.stiffness[axis] * unit.plates.rest_gap(0));
        facts.push(fact(
            "transduction",
            format!("sensitivity_{name}"),
            number(sensitivity, "per_n", "%/mN", 10.0),
            "1/(k g): of the plate at rest; for x and y the difference of the two sides",
        ));
    }
    let full = [element.full_scale; 3];
    let least = unit.predict(full).1.least_air_gap();
    facts.push(fact(
        "transduction",
        "least_air_gap_at_full_scale_on_all_axes",
        number(least, "m", "um", 1e-6),
        "zero or less: the three full scales together close a gap",
    ));
    facts
}

/// Capacitor 11 with its edges, beside the model of plates: only for the drawing whose
/// edges are known.
fn edges(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let Some(tile) = tile_with_edges(array) else {
        return Vec::new();
    };
    let air = array.element.plates.air_gap[0];
    let capacitance = |name: &str, si: f64, source: &'static str| {
        fact("transduction", name, number(si, "f", "fF", 1e-15), source)
    };
    let mut facts = vec![
        capacitance(
            "plate_capacitance_11",
            tile.plate(air),
            "eps0 a b/(air + insulation/eps_r)",
        ),
        capacitance(
            "edge_capacitance_11",
            tile.edges(air, GROUNDED),
            "four edges, all other electrodes grounded: not in the model",
        ),
        capacitance(
            "capacitance_with_edges_11",
            tile.total(air),
            "plates, edges and corners, all other electrodes grounded",
        ),
        fact(
            "transduction",
            "capacitance_by_air_gap_11",
            number(tile.slope(air), "f_per_m", "fF/um", 1e-9),
            "plates and edges, all other electrodes grounded",
        ),
    ];
    if let Ok([least, greatest]) = tile.surroundings(air) {
        facts.push(capacitance(
            "capacitance_with_edges_least_11",
            least,
            "plates and edges over a grounded plane, without corners",
        ));
        facts.push(capacitance(
            "capacitance_with_edges_greatest_11",
            greatest,
            "plates and edges of a capacitor alone, without corners",
        ));
    }
    facts
}

/// The tile with its edges, if the drawing is the one whose edges are known.
fn tile_with_edges(array: &ThreeAxisArray<'_>) -> Option<TileWithEdges> {
    let (element, pitch) = (array.element, array.sensor.array.pitch);
    let (plates, outline) = (&element.plates, &element.outline);
    let [side, other] = plates.electrode;
    let distance = element.suspension.centre_distance;
    let drawn = EdgeSection::drawn(plates.air_gap[0], EdgeEnvironment::Isolated);
    let cavity = 0.5 * (0.5 * (outline.unit_side - outline.wall_width) - side);
    let lengths = [
        (side, 2.0 * drawn.half_width),
        (other, side),
        (plates.insulation, drawn.insulation),
        (outline.electrode_thickness, drawn.electrode_thickness),
        (outline.electrode_layer + outline.bump_layer, drawn.above),
        (cavity, drawn.cavity),
        (distance - side, INNER_DISTANCE),
        (pitch[0] - distance - side, OUTER_DISTANCE),
        (pitch[1], pitch[0]),
    ];
    let same = |(given, known): (f64, f64)| (given - known).abs() < 1e-9;
    let known = lengths.into_iter().all(same)
        && (plates.insulation_permittivity - drawn.permittivity).abs() < 1e-9
        && EdgeLaw::AIR_GAPS.contains(&plates.air_gap[0]);
    known.then(|| TileWithEdges {
        side,
        insulation_gap: plates.insulation / plates.insulation_permittivity,
    })
}

/// Noise-limited resolution: the standard deviation of the force of one frame.
fn estimation(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let (unit, element) = (array.unit_model(), array.element);
    let sigma = [array.board.deviation(); 4];
    let mut facts = vec![
        fact(
            "estimation",
            "full_scale",
            number(element.full_scale, "n", "mN", 1e-3),
            "element",
        ),
        fact(
            "estimation",
            "usable_force",
            number(element.usable_force, "n", "mN", 1e-3),
            "element",
        ),
    ];
    let found = estimate_unit(
        &unit,
        unit.rest(),
        sigma,
        [true; 4],
        &SearchOptions::default(),
    );
    if found.outcome == Outcome::Converged {
        for (deviation, axis) in found.deviation().into_iter().zip(["x", "y", "z"]) {
            facts.push(fact(
                "estimation",
                format!("resolution_{axis}"),
                number(deviation, "n", "uN", 1e-6),
                "one standard deviation of one frame at rest",
            ));
        }
    }
    facts
}

fn numerics() -> Vec<Fact> {
    let options = ThreeAxisOptions::default();
    vec![
        fact(
            "numerics",
            "search_steps",
            text(&options.search.most_steps),
            "default",
        ),
        fact(
            "numerics",
            "search_least_gain",
            text(&options.search.least_gain),
            "default",
        ),
        fact(
            "numerics",
            "contact_threshold",
            text(&format!(
                "{} sigma and {} % of full scale",
                options.contact_deviations,
                100.0 * options.contact_share
            )),
            "default",
        ),
        fact(
            "numerics",
            "residual_bound",
            text(&format!(
                "{} for {} frames, or {}",
                options.residual_bound, options.residual_persistence, options.residual_alarm
            )),
            "default",
        ),
    ]
}
