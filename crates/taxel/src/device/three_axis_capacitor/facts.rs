//! Quantities derived from the drawing of a three-axis array.

use super::ThreeAxisArray;
use crate::device::capacitor_board;
use crate::estimation::ThreeAxisOptions;
use crate::layout::Mount;
use crate::mechanics::{Cavity, ElasticDescription, STRIPS, SideContact, UnitCompliance};
use crate::summary::{Fact, fact, number, text};

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
    let unit = array.unit_model();
    let stiffness = unit.suspension.stiffness();
    let least_gap = unit
        .plates
        .air_gap
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let [kappa_x, kappa_y] = element.torsion(stiffness);
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
        let displacement = element.full_scale / stiffness[axis];
        facts.push(fact(
            "mechanics",
            format!("full_scale_displacement_{name}"),
            number(displacement, "m", "um", 1e-6),
            "full scale / stiffness",
        ));
    }
    facts.extend(elasticity(array));
    facts.extend(bending(array));
    let top = element.outline.bump_top;
    facts.extend([
        fact(
            "mechanics",
            "closure_force_z",
            number(least_gap * stiffness[2], "n", "mN", 1e-3),
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
    let unit = array.unit_model();
    let element = array.element;
    let rest = if unit.plates.edges.is_some() {
        "plate and edges from the drawing, all other electrodes grounded"
    } else {
        "C_par, typed in, + eps0 a b/(air + insulation/eps_r)"
    };
    let mut facts = Vec::new();
    for (i, name) in ["11", "12", "21", "22"].into_iter().enumerate() {
        facts.push(fact(
            "transduction",
            format!("rest_capacitance_{name}"),
            number(unit.plates.rest_capacitance(i), "f", "fF", 1e-15),
            rest,
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
        let sensitivity = unit.suspension.compliance[axis][axis] / unit.plates.rest_gap(0);
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

/// Capacitor 11 in parts, and what an effective gap makes of them.
fn edges(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let unit = array.unit_model();
    let Ok(drawn) = array.edges() else {
        return Vec::new();
    };
    let edges = drawn.grounded;
    let typed_in = unit.plates.edges.is_none();
    let mut plates = unit.plates;
    let air = plates.air_gap[0];
    if typed_in {
        plates.parallel_capacitance = [0.0; 4];
        plates.edges = Some(edges);
    }
    let capacitance = |name: &str, si: f64, source: &'static str| {
        fact("transduction", name, number(si, "f", "fF", 1e-15), source)
    };
    let of_edges = if typed_in {
        "four edges by the drawing, all other electrodes grounded: the model has the typed-in \
         parallel_capacitance in their place"
    } else {
        "four edges by the drawing, all other electrodes grounded"
    };
    let mut facts = vec![
        capacitance(
            "plate_capacitance_11",
            plates.plate_capacitance(0),
            "eps0 a b/(air + insulation/eps_r)",
        ),
        capacitance(
            "edge_capacitance_11",
            edges.parallel(plates.electrode, air),
            of_edges,
        ),
        capacitance(
            "corner_capacitance_11",
            edges.corners,
            "four corners, which the edges count twice; by the drawing of P2, of others in proportion to the gap",
        ),
        capacitance(
            "capacitance_with_edges_11",
            plates.rest_capacitance(0),
            "plates, edges and corners, all other electrodes grounded",
        ),
    ];
    let [least, greatest] = drawn.surroundings;
    let plate = plates.plate_capacitance(0);
    facts.extend([
        fact(
            "transduction",
            "edge_error",
            number(drawn.error, "ratio", "%", 1e-2),
            if array
                .element
                .edge_drawing(&array.sensor.array)
                .tabulated()
                .is_ok()
            {
                "largest error of the edges: the shipped table"
            } else {
                "largest error of the edges: solved, kept; no table has this drawing"
            },
        ),
        capacitance(
            "capacitance_with_edges_least_11",
            plate + least.parallel(plates.electrode, air),
            "plates and edges over a grounded plane, without corners",
        ),
        capacitance(
            "capacitance_with_edges_greatest_11",
            plate + greatest.parallel(plates.electrode, air),
            "plates and edges of a capacitor alone, without corners",
        ),
    ]);
    facts.push(fact(
        "transduction",
        "capacitance_by_air_gap_11",
        number(plates.slope_by_air_gap(0), "f_per_m", "fF/um", 1e-9),
        "plates and edges, all other electrodes grounded",
    ));
    let factors = plates.effective_gap_factors(0);
    for (name, factor, source) in [
        (
            "effective_gap_factor_raw",
            factors[0],
            "closing that eps0 a b (1/C0 - 1/C) reads per closing: a stiffness read so, times it, is the true one",
        ),
        (
            "effective_gap_factor_normalised",
            factors[1],
            "closing that g0 (1 - C0/C) reads per closing, g0 = air + insulation/eps_r",
        ),
    ] {
        let value = number(factor, "ratio", "", 1.0);
        facts.push(fact("transduction", name, value, source));
    }
    facts
}

/// What the stiffness is and where it is from.
fn elasticity(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let element = array.element;
    let unit = array.unit_model();
    let drawing = array.unit_drawing();
    let stiffness = unit.suspension.stiffness();
    let elastic = element.suspension.from_drawing;
    let from = match elastic {
        Some(_) if element.suspension.is_solved(&drawing) => {
            "the drawing and its modulus, a unit cut out of the array: solved, kept; no table has it"
        }
        Some(_) => "the drawing and its modulus, a unit cut out of the array: table",
        None => "typed in: the drawing of wall, cavities, layers and bump does not enter",
    };
    let word = if elastic.is_some() {
        "from the drawing"
    } else {
        "typed in"
    };
    let mut facts = vec![fact("mechanics", "stiffness_from", text(word), from)];
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let value = number(stiffness[axis], "n_per_m", "kN/m", 1e3);
        facts.push(fact("mechanics", format!("stiffness_{name}"), value, from));
    }
    let ratio = number(stiffness[0] / stiffness[2], "ratio", "", 1.0);
    facts.push(fact("mechanics", "stiffness_x_over_z", ratio, from));
    if let Ok([cut_out, in_array]) = element.suspension.closings(&drawing) {
        match &elastic {
            Some(elastic) => {
                facts.extend(from_drawing(array, elastic, [&cut_out, &in_array]));
            }
            None => facts.extend(typed_in(stiffness, [&cut_out, &in_array])),
        }
    }
    let air = unit.plates.air_gap.into_iter().sum::<f64>() / 4.0;
    let side = 0.5 * (element.outline.unit_side - element.outline.wall_width);
    let energy = stiffness[2] * air * air / (8.0 * side * side);
    facts.push(fact(
        "mechanics",
        "restoring_energy",
        number(energy, "j_per_m2", "J/m2", 1.0),
        "k_z air^2/(2 facing area): a unit that touches stays closed where clean rubber sticks with more, about 0.05 J/m2",
    ));
    facts
}

/// Error of d_x under a bar: 5 % of the closings of a strip, and what 8 % of the downward
/// force leave where most of it turns the bump back.
const FLANK_ERROR: f64 = 0.1;

/// Stiffness from the drawing: intervals, first touch, and a warning for kept air.
fn from_drawing(
    array: &ThreeAxisArray<'_>,
    elastic: &ElasticDescription,
    [cut_out, in_array]: [&UnitCompliance; 2],
) -> Vec<Fact> {
    let (modulus, unit) = (elastic.modulus, array.unit_model());
    let k = |of: &UnitCompliance| 1.0 / of.normal(modulus, elastic.cavity);
    let [cut_out_z, in_array_z] = [k(cut_out), k(in_array)];
    let error = cut_out.normal_error(modulus, elastic.cavity);
    let error_of = if array.element.suspension.is_solved(&array.unit_drawing()) {
        "difference of a coarser mesh, and at least what the table showed"
    } else {
        "of the solved cases and of the exponents between them"
    };
    let ends = [
        cut_out_z.min(in_array_z) * (1.0 - error),
        cut_out_z.max(in_array_z) * (1.0 + error),
    ];
    let mut facts = Vec::new();
    for (name, end, source) in [
        (
            "stiffness_z_least",
            ends[0],
            "of a unit cut out of the array and one among others the softer, less the error",
        ),
        (
            "stiffness_z_greatest",
            ends[1],
            "the stiffer of both, and the error",
        ),
    ] {
        facts.push(fact(
            "mechanics",
            name,
            number(end, "n_per_m", "kN/m", 1e3),
            source,
        ));
    }
    facts.push(fact(
        "mechanics",
        "stiffness_error",
        number(error, "ratio", "%", 1e-2),
        error_of,
    ));
    let side = match elastic.side_contact {
        SideContact::Top => cut_out.error + error,
        SideContact::Bar(_) => FLANK_ERROR + error,
    };
    facts.push(fact(
        "mechanics",
        "stiffness_x_over_z_error",
        number(side, "ratio", "%", 1e-2),
        match elastic.side_contact {
            SideContact::Top => "of both closings",
            SideContact::Bar(_) => "of both closings and the downward force; twice as much in the lowest quarter of the bump",
        },
    ));
    facts.push(fact(
        "mechanics",
        "normal_force_per_side_force",
        number(unit.suspension.bump_sinking[0], "ratio", "", 1.0),
        match elastic.side_contact {
            SideContact::Bar(bar) if bar.height < STRIPS[1] => {
                "pressing that the contact of the side force adds; a bar this low: from the table, by our own \
                 finite elements up to a third more"
            }
            _ => "pressing that the contact of the side force adds",
        },
    ));
    facts.push(fact(
        "mechanics",
        "hottest_over_mean_z",
        number(cut_out.hot_z, "ratio", "", 1.0),
        "largest closing over the mean of a tile, at its corner next to the crossing of the walls",
    ));
    facts.push(fact(
        "mechanics",
        "tile_slope_z",
        number(cut_out.tilt_z, "ratio", "", 1.0),
        "closing falls outward over half a tile by this share of its mean",
    ));
    facts.extend(cavities(array, elastic, [cut_out, in_array]));
    facts
}

/// First touch of a unit with vented cavities, and a warning for sealed ones.
fn cavities(
    array: &ThreeAxisArray<'_>,
    elastic: &ElasticDescription,
    [cut_out, in_array]: [&UnitCompliance; 2],
) -> Vec<Fact> {
    let (modulus, unit, error) = (elastic.modulus, array.unit_model(), cut_out.error);
    let mut facts = Vec::new();
    if elastic.cavity == Cavity::Vented {
        let air = unit
            .plates
            .air_gap
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        let [touch, among] = [cut_out, in_array].map(|of| of.first_touch(modulus, air));
        for (name, force, source) in [
            (
                "first_touch_z",
                touch,
                "air E/(hottest c_zz): the first electrodes touch",
            ),
            (
                "first_touch_z_least",
                touch.min(among) / (1.0 + 2.0 * error),
                "cut out of the array or among others, less both errors",
            ),
            (
                "first_touch_z_greatest",
                touch.max(among) * (1.0 + 2.0 * error),
                "the later of both, and both errors",
            ),
        ] {
            facts.push(fact(
                "mechanics",
                name,
                number(force, "n", "mN", 1e-3),
                source,
            ));
        }
    } else {
        let open = 1.0 / cut_out.normal(modulus, Cavity::Vented);
        facts.push(fact(
            "mechanics",
            "stiffness_z_vented",
            number(open, "n_per_m", "kN/m", 1e3),
            "the same unit with vented cavities",
        ));
        facts.push(fact(
            "mechanics",
            "warning_sealed_cavities",
            text(&format!(
                "the air kept in the cavities makes the unit {:.1} times as stiff along z; it leaves through the \
                 rubber within tens of seconds, and the rest drifts with temperature and weather",
                cut_out.normal(modulus, Cavity::Vented) / cut_out.normal(modulus, Cavity::Sealed)
            )),
            "suspension.from_drawing.cavity: a vent such as 20 um x 6 um in the spacer lets it out in milliseconds",
        ));
    }
    facts
}

/// What the drawing says beside a stiffness that is typed in.
fn typed_in(stiffness: [f64; 3], [cut_out, in_array]: [&UnitCompliance; 2]) -> Vec<Fact> {
    let per_modulus = |of: &UnitCompliance| number(1.0 / of.c_zz, "m", "kN/m per MPa", 1e-3);
    let modulus = |of: &UnitCompliance| number(stiffness[2] * of.c_zz, "pa", "MPa", 1e6);
    vec![
        fact(
            "mechanics",
            "drawn_stiffness_z_per_modulus",
            per_modulus(cut_out),
            "by the drawing, cut out of the array, vented cavities",
        ),
        fact(
            "mechanics",
            "drawn_stiffness_z_per_modulus_in_array",
            per_modulus(in_array),
            "by the drawing, among neighbours, vented cavities",
        ),
        fact(
            "mechanics",
            "drawn_stiffness_x_over_z",
            number(cut_out.c_zz / cut_out.c_xx, "ratio", "", 1.0),
            "by the drawing, side force at the flat top",
        ),
        fact(
            "mechanics",
            "modulus_for_stiffness_z_least",
            modulus(in_array),
            "modulus with which the drawing has the typed-in stiffness, among neighbours",
        ),
        fact(
            "mechanics",
            "modulus_for_stiffness_z_greatest",
            modulus(cut_out),
            "the same, cut out of the array",
        ),
    ]
}

/// What a cylinder does to the air gaps.
fn bending(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let (element, drawn) = (array.element, &array.sensor.array);
    let Mount::Cylinder(cylinder) = drawn.mount else {
        return Vec::new();
    };
    let um = |name: &str, si: f64, source: &'static str| {
        fact("mechanics", name, number(si, "m", "um", 1e-6), source)
    };
    if let Some(bent) = element.bent(drawn) {
        return vec![
            um(
                "closing_by_bending",
                bent.closing,
                "taken off the air gaps; bottom sliding, Poisson's ratio 0.49, error 4 %",
            ),
            um(
                "closing_by_bending_glued",
                bent.glued,
                "the same for a glued bottom and a Poisson's ratio of 0.499",
            ),
        ];
    }
    if cylinder.unstretched_plane.is_some() {
        return vec![fact(
            "mechanics",
            "closing_by_bending",
            text("not known: this section was not solved"),
            "array.mount.cylinder",
        )];
    }
    let unit = element.unit_drawing(drawn.pitch);
    let plane = |height: f64| unit.bent(drawn.pitch[0], cylinder.radius, height);
    let bottom = -(unit.lower_layer + unit.insulation + unit.air_gap);
    let mut facts = vec![fact(
        "mechanics",
        "warning_bending",
        text("the closing of the air gaps by bending is not determined"),
        "give array.mount.cylinder.unstretched_plane, the height of the plane that bending does not stretch",
    )];
    if let (Some(bottom), Some(top)) = (plane(bottom), plane(unit.upper_layer)) {
        facts.push(um(
            "closing_by_bending_greatest",
            bottom.glued.max(bottom.closing),
            "unstretched bottom, glued",
        ));
        facts.push(um(
            "closing_by_bending_least",
            top.closing,
            "unstretched top",
        ));
    }
    facts
}

/// Noise-limited resolution: the standard deviation of the force of one frame.
fn estimation(array: &ThreeAxisArray<'_>) -> Vec<Fact> {
    let element = array.element;
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
    let Ok(information) = array.information_at([0.0; 3], None) else {
        return facts;
    };
    for axis in ["x", "y", "z"] {
        if let Some(deviation) = information.deviation(&format!("force_{axis}")) {
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
