//! P2: the three-axis capacitive array.

use crate::ledger::{Answer, Ours};
use taxel::device::ThreeAxisArray;
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::{Bar, Cavity, Grip, STRIPS, SideContact, UnitCompliance};
use taxel::sensor::Sensor;
use taxel::transduction::ThreeAxisModel;

const MILLINEWTON: f64 = 1e-3;
const CAPACITORS: [&str; 4] = ["C11", "C12", "C21", "C22"];
const AXES: [&str; 3] = ["x", "y", "z"];

pub(crate) fn fill(ours: &mut Ours) {
    let (Some(array), Some(unit)) = (
        Sensor::shipped("three-axis-8x8"),
        Sensor::shipped("three-axis-unit"),
    ) else {
        return;
    };
    let (Ok(drawn), Ok(unit)) = (array.three_axis(), unit.three_axis()) else {
        return;
    };
    // The paper computes plates alone, without their edges.
    let mut plates_alone = drawn.element.clone();
    plates_alone.plates.parallel_capacitance = Some([0.0; 4]);
    let array = drawn.with_element(&plates_alone);
    equations(ours, &array);
    structure(ours, &array);
    unit_measurement(ours, &array, &drawn);
    elastic_unit(ours, &drawn);
    model_results(ours, &array);
    distribution(ours, &array);
    figures(ours, &unit.unit_model());
}

/// A force of `millinewton` along one axis, N.
fn along(axis: usize, millinewton: f64) -> [f64; 3] {
    let mut force = [0.0; 3];
    force[axis] = millinewton * MILLINEWTON;
    force
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs().max(b.abs())
}

fn equations(ours: &mut Ours, array: &ThreeAxisArray<'_>) {
    let element = array.element;
    let suspension = array.unit_model().suspension;
    let (force, lever) = (along(0, 20.0), element.lever());
    let tilt = suspension.deform(force).displacement[0] / suspension.centre_distance;
    let torque = element.torsion(suspension.stiffness())[0] * tilt;
    ours.holds(
        "eq_1",
        (torque / (force[0] * lever * tilt.cos()) - 1.0).abs() < 1e-5,
    )
    .with("lost", 1.0 - tilt.cos());
    ours.holds("eq_2", near(torque, force[0] * lever));
    let slope = suspension.deform(force).slope[0];
    ours.holds("eq_3", near(slope, tilt));
    signs(ours, array);
    let mut parallel = array.unit_model();
    parallel.suspension.tile_tilt = 0.0;
    let load = [11e-3, -7e-3, 13e-3];
    let found = parallel.effective_force(parallel.rest(), parallel.predict(load).1.capacitance());
    for (axis, id) in ["eq_7", "eq_8", "eq_9"].into_iter().enumerate() {
        // Capacitances keep 12 digits of a displacement of a micrometre.
        let exact = found.is_some_and(|found| (found[axis] / load[axis] - 1.0).abs() < 1e-10);
        ours.holds(id, exact);
    }
}

/// Eqs. 4 to 6 have gaps where Eqs. 7 and 8 have their decrease.
fn signs(ours: &mut Ours, array: &ThreeAxisArray<'_>) {
    let unit = array.unit_model();
    // Mean gap of the side that a force along the axis closes, less the other.
    let bracket = |axis: usize| {
        let closing = unit.suspension.deform(along(axis, 15.0)).closing;
        let gap: [f64; 4] = std::array::from_fn(|i| unit.plates.rest_gap(i) - closing[i]);
        match axis {
            0 => 0.5 * (gap[1] + gap[3] - gap[2] - gap[0]),
            _ => 0.5 * (gap[1] + gap[0] - gap[2] - gap[3]),
        }
    };
    for (id, axis) in [("eq_4", 0), ("eq_5", 0), ("eq_6", 1)] {
        ours.holds(id, bracket(axis) > 0.0);
    }
}

fn structure(ours: &mut Ours, array: &ThreeAxisArray<'_>) {
    let element = array.element;
    let (plates, outline) = (&element.plates, &element.outline);
    let layout = array.layout();
    let um = 1e6;
    for (id, value) in [
        ("air_gap", plates.air_gap[0]),
        ("insulation", plates.insulation),
        ("electrode", plates.electrode[0]),
        ("wall_width", outline.wall_width),
        ("bump_height", outline.bump_height),
    ] {
        ours.number(id, value * um);
    }
    let corners = near(outline.bump_base, element.suspension.centre_distance);
    ours.holds("bump_corners", corners);
    ours.number("unit_side", outline.unit_side * um);
    ours.number("lever", outline.bump_height * um)
        .with("lever", element.lever() * um);
    ours.number("centre_distance", element.suspension.centre_distance * um);
    ours.number("largest_gap", array.unit_model().plates.rest_gap(0) * um);
    let units = layout.taxels();
    ours.number("units", units as f64);
    ours.number("capacitors", 4.0 * units as f64);
    ours.number("pitch", layout.pitch[0] * 1e3);
    let outer = layout.pitch[0] * (layout.columns as f64 - 1.0) + outline.unit_side;
    ours.number("side", outer * 1e3);
    let side = array.unit_model();
    let found = side.effective_force(side.rest(), side.predict(along(0, 15.0)).1.capacitance());
    ours.holds(
        "independence",
        found.is_some_and(|force| force[2].abs() < 0.1e-3),
    );
    // In %, beside the step of the gauge over the largest side force.
    let beside = ours.table.run("crosstalk").map(|run| &run.values);
    let step = 100.0 * ours.printed("gauge_resolution", 0) / ours.printed("usable_force", 0);
    ours.holds(
        "crosstalk",
        beside.is_some_and(|values| values.values().all(|closing| closing.abs() < step)),
    );
}

fn unit_measurement(ours: &mut Ours, array: &ThreeAxisArray<'_>, drawn: &ThreeAxisArray<'_>) {
    let femtofarad = array.unit_model().rest()[0] * 1e15;
    ours.number("rest_capacitance", femtofarad);
    let unit = drawn.unit_model();
    let plates = &unit.plates;
    let femtofarad = unit.rest()[0] * 1e15;
    let Ok(edges) = drawn.edges() else {
        return;
    };
    let interval = edges.surroundings.map(|edges| {
        let edges = edges.parallel(plates.electrode, plates.air_gap[0]);
        (plates.plate_capacitance(0) + edges) * 1e15
    });
    for id in ["rest_c11", "rest_c12", "rest_c21", "rest_c22"] {
        let measured = ours.printed(id, 0);
        let gap = unit
            .at_rest([measured * 1e-15; 4])
            .map_or(f64::NAN, |thin| thin.plates.air_gap[0] * 1e6);
        let wider = 100.0 * (gap / (plates.air_gap[0] * 1e6) - 1.0);
        ours.number(id, femtofarad)
            .between(interval)
            .with("gap", gap)
            .with("wider", wider)
            .with("excess", measured - femtofarad);
    }
}

/// Moduli of this rubber that are published, by curing at 25 to 200 degrees C, Pa.
const MODULI: [f64; 2] = [1.32e6, 2.97e6];

/// What the elastic unit of the drawing makes of the printed stiffness: the paper reads
/// displacements as effective gaps, so that a true stiffness is larger by the factor of
/// such a reading.
fn elastic_unit(ours: &mut Ours, drawn: &ThreeAxisArray<'_>) {
    let drawing = drawn.unit_drawing();
    let Ok([cut_out, in_array]) = drawn.element.suspension.closings(&drawing) else {
        return;
    };
    let unit = drawn.unit_model();
    let [raw, normalised] = unit.plates.effective_gap_factors(0);
    let printed = ours.printed("stiffness_z", 0);
    // True stiffness per modulus over the factor: what an effective gap reads.
    let apparent = |of: &UnitCompliance, modulus: f64, factor: f64| {
        1.0 / of.normal(modulus, Cavity::Vented) / factor
    };
    let z = [
        apparent(&cut_out, MODULI[0], normalised),
        apparent(&in_array, MODULI[1], raw),
    ];
    let modulus = |of: &UnitCompliance, factor: f64| 1e-6 * printed * factor * of.c_zz;
    let words = |answer: &mut Answer| {
        answer
            .with("raw", raw)
            .with("normalised", normalised)
            .with("true_raw", 1e-3 * printed * raw)
            .with("true_normalised", 1e-3 * printed * normalised)
            .with("raw_least", modulus(&in_array, raw))
            .with("raw_greatest", modulus(&cut_out, raw))
            .with("normalised_least", modulus(&in_array, normalised))
            .with("normalised_greatest", modulus(&cut_out, normalised));
    };
    words(ours.words("stiffness_z").between(z));
    side_stiffness(ours, &cut_out, printed);
    mechanical_model(ours, &cut_out);
    // The tiles nearest to the crossing of the walls touch first.
    let touch = |factor: f64| {
        let modulus = printed * factor * cut_out.c_zz;
        cut_out.first_touch(modulus, unit.plates.air_gap[0]) * 1e3
    };
    ours.holds("gap_closes", touch(raw) < touch(1.0))
        .with("least", touch(raw))
        .with("greatest", touch(1.0));
}

/// Figures 6 and 7: a rigid bump on springs, beside the elastic unit under forces on its top.
fn mechanical_model(ours: &mut Ours, compliance: &UnitCompliance) {
    let [along, across] = compliance.tilt_x;
    // A rigid plane has the slope d_x/L along the force and none across it.
    ours.holds("figure_6", same_to(along, 1.0) && across.abs() < RIGID)
        .with("tilt", along)
        .with("across", across);
    let (closing, sinking) = compliance.side(1.0, SideContact::Top);
    ours.holds("figure_7_side", closing > 0.0 && sinking == 0.0);
    ours.holds("figure_7_normal", compliance.tilt_z.abs() < RIGID)
        .with("lean", 100.0 * compliance.tilt_z.abs());
}

/// Up to here, as a share, a plane counts as rigid: what the bench resolves, 1 mN of 15 mN.
const RIGID: f64 = 0.07;

fn same_to(a: f64, b: f64) -> bool {
    (a - b).abs() <= RIGID * b.abs()
}

/// The ratio of the printed k_x and k_z, or k_y and k_z, by where a bar touches that sticks.
fn side_stiffness(ours: &mut Ours, compliance: &UnitCompliance, printed: f64) {
    let ratio = |height: f64| {
        let bar = Bar {
            height,
            grip: Grip::Sticks,
        };
        let (x, sinking) = compliance.side(1.0, SideContact::Bar(bar));
        let z = compliance.normal(1.0, Cavity::Vented);
        (z / x, sinking, sinking * z / x)
    };
    let [low, high] = [STRIPS[0], STRIPS[3]];
    let ends = [ratio(high).0, ratio(low).0].map(|ratio| ratio * printed);
    for axis in ["x", "y"] {
        let id = format!("stiffness_{axis}");
        let wanted = ours.printed(&id, 0) / printed;
        // The ratio falls with the height.
        let (mut below, mut above) = (low, high);
        for _ in 0..60 {
            let middle = f64::midpoint(below, above);
            if ratio(middle).0 > wanted {
                below = middle;
            } else {
                above = middle;
            }
        }
        ours.words(&id).between(ends).with("height", 100.0 * below);
    }
    let [first, second] = [STRIPS[1], STRIPS[2]].map(ratio);
    let presses = first.1 > 0.0 && second.1 > 0.0;
    ours.holds("asymmetry", presses)
        .with("less", second.1.min(first.1))
        .with("more", second.1.max(first.1));
    let whole = STRIPS.map(|height| ratio(height).2);
    let least = whole.into_iter().fold(f64::INFINITY, f64::min);
    ours.holds("figure_8_side", least > 0.0)
        .with("lower", ratio(STRIPS[1]).2)
        .with("upper", ratio(STRIPS[3]).2);
}

fn model_results(ours: &mut Ours, array: &ThreeAxisArray<'_>) {
    let element = array.element;
    let unit = array.unit_model();
    let stiffness = unit.suspension.stiffness();
    let gap = unit.plates.rest_gap(0);
    let mut parallel = unit;
    parallel.suspension.tile_tilt = 0.0;
    // Read back from the displacement by the published inverse at 15 mN.
    let read_back = |unit: &ThreeAxisModel, axis: usize| {
        let readings = unit.predict(along(axis, 15.0)).1.capacitance();
        15e-3 / unit.effective_motion(unit.rest(), readings).displacement[axis]
    };
    for (axis, name) in AXES.iter().enumerate() {
        ours.words(&format!("stiffness_{name}"))
            .with("back", read_back(&parallel, axis))
            .with("tilting", read_back(&unit, axis));
        ours.number(
            &format!("sensitivity_{name}"),
            0.1 / (stiffness[axis] * gap),
        );
    }
    let full = element.full_scale;
    ours.number("full_scale", full * 1e3);
    let top = element.outline.bump_top;
    ours.number("full_scale_pressure", full / (top * top) * 1e-3)
        .with("top_area", top * top * 1e6);
    ours.number("usable_force", element.usable_force * 1e3);
    figure_claims(ours, array);
}

fn figure_claims(ours: &mut Ours, array: &ThreeAxisArray<'_>) {
    let unit = array.unit_model();
    let rest = unit.rest();
    let rises = |axis: usize| {
        let now = unit.predict(along(axis, 15.0)).1.capacitance();
        let changes: [bool; 4] = std::array::from_fn(|i| now[i] > rest[i]);
        changes
    };
    ours.holds("figure_5_x", rises(0) == [false, true, false, true]);
    ours.holds("figure_5_y", rises(1) == [true, true, false, false]);
    ours.holds("figure_5_z", rises(2) == [true; 4]);
    let closure = unit.plates.air_gap[0] / unit.suspension.compliance[2][2];
    ours.words("gap_closes").with("closure", closure * 1e3);
    let displacement = unit.suspension.deform(along(2, 15.0)).displacement;
    ours.holds(
        "figure_8_z",
        displacement[0] == 0.0 && displacement[1] == 0.0 && displacement[2] > 0.0,
    );
}

fn distribution(ours: &mut Ours, array: &ThreeAxisArray<'_>) {
    let capacitors = 4 * array.layout().taxels();
    ours.number("frame_rate", 1.0 / (capacitors as f64 * 651e-6));
    let rate = 1.0 / array.board.period();
    ours.holds("dedicated_board", rate > 30.0)
        .with("rate", rate);
    ours.number("response_time", 1e3 / ours.printed("frame_rate", 0));
}

fn figures(ours: &mut Ours, unit: &ThreeAxisModel) {
    let rest = unit.rest();
    let normalised = |axis: usize, capacitor: usize| -> Vec<[f64; 2]> {
        (0..=40)
            .map(|i| 0.5 * f64::from(i))
            .map(|force| {
                let now = unit.predict(along(axis, force)).1.capacitance();
                [force, now[capacitor] / rest[capacitor]]
            })
            .collect()
    };
    let chart = |title: String, x: &str, y: Axis, series| Chart {
        title,
        x: Axis::new(x, "mN"),
        y,
        series,
    };
    let charts = AXES.iter().enumerate().map(|(axis, name)| {
        let series = CAPACITORS
            .iter()
            .enumerate()
            .map(|(i, capacitor)| Series::new(*capacitor, normalised(axis, i), Style::Line));
        chart(
            format!("force along {name}"),
            "force",
            Axis::new("C/C0", ""),
            series.collect(),
        )
    });
    ours.figure(
        "Figure 5",
        Figure {
            title: String::from("Normalised capacitances over force"),
            charts: charts.collect(),
            caption: String::from(
                "The unit three-axis-unit: rest values as measured, the excess over 172 fF taken as parallel \
                 capacitance. The four tiles move as one rigid plane, and the probe does not sink into the bump; the \
                 printed curves bend for C12 and C22 in (c), which a parallel plane of these constants does not.",
            ),
        },
    );
    let displacement = |loaded: usize, axis: usize| -> Vec<[f64; 2]> {
        (0..=30)
            .map(|i| 0.5 * f64::from(i))
            .map(|force| {
                let readings = unit.predict(along(loaded, force)).1.capacitance();
                let motion = unit.effective_motion(rest, readings).displacement;
                [force, motion[axis] * 1e6]
            })
            .collect()
    };
    let charts = AXES.iter().enumerate().map(|(loaded, name)| {
        let series = AXES.iter().enumerate().map(|(axis, along)| {
            Series::new(
                format!("d_{along}"),
                displacement(loaded, axis),
                Style::Line,
            )
        });
        chart(
            format!("force along {name}"),
            "force",
            Axis::new("displacement", "um"),
            series.collect(),
        )
    });
    ours.figure(
        "Figure 8",
        Figure {
            title: String::from("Displacements by Eqs. 7 to 9 over force"),
            charts: charts.collect(),
            caption: String::from(
                "Computed from the capacitances of the unit three-axis-unit as the paper does, with its spring \
                 constants and the parallel capacitance known. The small d_z under side forces is the error of the \
                 parallel gap for tilted tiles, not the sinking that the paper saw.",
            ),
        },
    );
}
