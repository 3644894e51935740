//! P1: the in-plane capacitive sensor.

use crate::ledger::Ours;
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::{
    ElectrodeStiffness, EndCondition, EndShear, LayerKinematics, LayerState, PlaneStress,
    StressConstants,
};
use taxel::sensor::Sensor;
use taxel::transduction::{
    CapacitanceLaw, InPlaneInverse, InPlaneModel, StudyParameter, VACUUM_PERMITTIVITY, study,
};

/// The published gaps, um, as the shipped sensors are named.
const GAPS: [u32; 3] = [20, 50, 100];
/// Compression of the examples in words.
const EXAMPLE: f64 = 0.1;

pub(crate) fn fill(ours: &mut Ours) {
    let models = GAPS.map(|gap| {
        let sensor = Sensor::shipped(&format!("in-plane-{gap}um"))?;
        Some(sensor.in_plane().ok()?.model())
    });
    // The shipped files are valid; a test keeps them so.
    let [Some(narrow), Some(middle), Some(wide)] = models else {
        return;
    };
    let Ok(kinematics) = LayerKinematics::new(EXAMPLE) else {
        return;
    };
    let models = [narrow, middle, wide];
    let [narrow, ..] = &models;
    kinematic_equations(ours, &kinematics, narrow);
    stress_equations(ours, &kinematics);
    force_equation(ours, &kinematics, narrow);
    capacitance_equations(ours, &models);
    device_numbers(ours, &models);
    table_1(ours, &models);
    statements(ours, &models);
    figures(ours, &models);
}

fn kinematic_equations(ours: &mut Ours, kinematics: &LayerKinematics, model: &InPlaneModel) {
    let a = kinematics.unknown();
    let heights = [0.0, 0.2, 0.5, 0.8, 1.0];
    let agrees = |printed: &dyn Fn(f64) -> f64, model: &dyn Fn(f64) -> f64| {
        let same = |y: &f64| (printed(*y) - model(*y)).abs() < 1e-12;
        heights.iter().all(same)
    };
    ours.holds(
        "eq_1a",
        kinematics.stretch_excess(0.0) == 0.0 && kinematics.stretch_excess(1.0) > 0.0,
    );
    ours.holds(
        "eq_1b",
        (kinematics.height(1.0) - 1.0 + EXAMPLE).abs() < 1e-14,
    );
    ours.holds(
        "eq_2",
        agrees(&|y| (a * y).cos() + a.tan() * (a * y).sin(), &|y| {
            kinematics.stretch(y)
        }),
    );
    ours.holds(
        "eq_3",
        agrees(&|y| printed_height(a, y), &|y| kinematics.height(y)),
    );
    ours.holds(
        "unknown_alpha",
        (1.0 - a.cos() * a.tan().asinh() / a - EXAMPLE).abs() < 1e-14,
    );
    ours.holds(
        "boundary_values",
        kinematics.stretch(0.0) == 1.0 && kinematics.stretch_slope(1.0) == 0.0,
    );
    ours.number(
        "layer_thinning",
        100.0 * (1.0 - layer_height(model, 0.4) / model.layer.thickness),
    );
    finite_elements(ours);
}

/// Both results count as agreeing when no place differs by more: the width of a line
/// in a figure.
const AGREES: f64 = 0.01;

/// Our finite elements against the closed form, from the run `interior` of the table.
fn finite_elements(ours: &mut Ours) {
    let rows = ours.table.run("interior").map_or(&[][..], |run| &run.rows);
    let column = |index: usize| rows.iter().filter_map(move |row| row.get(index).copied());
    let (across, height) = (column(1).fold(0.0, f64::max), column(2).fold(0.0, f64::max));
    let last = column(0).next_back().unwrap_or(f64::NAN);
    let (low, high) = column(3).fold((f64::INFINITY, 0.0_f64), |(low, high), ratio| {
        (low.min(ratio), high.max(ratio))
    });
    ours.holds(
        "finite_elements",
        last >= 0.4 && across.max(height) < AGREES,
    )
    .with("last", last)
    .with("across", across)
    .with("height", height)
    .with("low", low)
    .with("high", high);
}

/// P1 Eq. 3 at the relative height `y`, over H, as printed.
fn printed_height(a: f64, y: f64) -> f64 {
    let log = |x: f64| ((1.0 + x) / (1.0 - x)).ln();
    let q = (a.tan() - (0.5 * a * y).tan()) * a.cos();
    a.cos() / a * (log(a.sin()) - log(q))
}

fn layer_height(model: &InPlaneModel, compression: f64) -> f64 {
    let thickness = model.layer.thickness;
    LayerKinematics::new(compression).map_or(f64::NAN, |kinematics| {
        model.layer.slab(&kinematics, 0.0, thickness)
    })
}

/// Stress over μ at a material point, by Eqs. 4 and 5.
type StressField<'a> = &'a dyn Fn([f64; 2]) -> PlaneStress;

fn stress_equations(ours: &mut Ours, kinematics: &LayerKinematics) {
    let material = StressConstants { c1: 0.7, c2: -0.3 };
    let model = |point: [f64; 2]| kinematics.stress(material, 0.5, point);
    let printed = |point: [f64; 2]| PlaneStress {
        sigma22: printed_upward_stress(kinematics, material, point),
        ..model(point)
    };
    let [across, upwards] = residual(kinematics, &model);
    let [_, misprinted] = residual(kinematics, &printed);
    // Central differences over 2e-5: 1e-9.
    let balanced = across.abs() < 1e-7 && upwards.abs() < 1e-7;
    for id in ["eq_4a", "eq_4b", "eq_5"] {
        ours.holds(id, balanced);
    }
    ours.holds("eq_4c", misprinted.abs() < 1e-7)
        .with("misprinted", misprinted);
    ours.holds("constant_a", curvature_is_minus_square(kinematics));
}

/// P1 Eq. 4c with the primes lost, over μ.
fn printed_upward_stress(
    kinematics: &LayerKinematics,
    material: StressConstants,
    [x1, y]: [f64; 2],
) -> f64 {
    let (f, g) = (kinematics.stretch(y), kinematics.height(y));
    -kinematics.pressure(material, 0.5, [x1, y])
        + material.c1 * g * g
        + material.c2 * (f * f + x1 * x1 * f * f)
}

/// Residual of equilibrium along 1 and 2 at x₁ = 1, x₂ = 0.4, by differences of
/// the nominal stress P = σ F⁻ᵀ.
fn residual(kinematics: &LayerKinematics, stress: StressField<'_>) -> [f64; 2] {
    let nominal = |point: [f64; 2]| {
        let (f, squeeze) = (
            kinematics.stretch(point[1]),
            kinematics.height_slope(point[1]),
        );
        let shear = point[0] * kinematics.stretch_slope(point[1]);
        let PlaneStress {
            sigma11,
            sigma12,
            sigma22,
        } = stress(point);
        [
            [sigma11 * squeeze - sigma12 * shear, sigma12 * f],
            [sigma12 * squeeze - sigma22 * shear, sigma22 * f],
        ]
    };
    let (x, y, h) = (1.0, 0.4, 1e-5);
    let along = [nominal([x - h, y]), nominal([x + h, y])];
    let upwards = [nominal([x, y - h]), nominal([x, y + h])];
    std::array::from_fn(|i| {
        (along[1][i][0] - along[0][i][0] + upwards[1][i][1] - upwards[0][i][1]) / (2.0 * h)
    })
}

fn curvature_is_minus_square(kinematics: &LayerKinematics) -> bool {
    let (y, h) = (0.4, 1e-4);
    let curvature = (kinematics.stretch_slope(y + h) - kinematics.stretch_slope(y - h)) / (2.0 * h);
    let expected = -kinematics.unknown().powi(2) * kinematics.stretch(y);
    // The difference is good to a⁴h²/6, 1e-9.
    (curvature / expected - 1.0).abs() < 1e-7
}

fn force_equation(ours: &mut Ours, kinematics: &LayerKinematics, model: &InPlaneModel) {
    let (aspect, chi) = (model.layer.aspect(), 1.0);
    let constant = kinematics.pressure_constant(aspect, chi);
    let stretch = kinematics.top_stretch();
    let square = (kinematics.unknown() * aspect * stretch).powi(2);
    let printed = -stretch * (square / 6.0 + 0.5 / (stretch * stretch) - constant);
    let stress = kinematics.mean_stress(aspect, chi);
    ours.holds("eq_6", (printed / stress - 1.0).abs() < 1e-12);
}

fn capacitance_equations(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let published: Vec<InPlaneModel> = models.iter().map(under_published_law).collect();
    let change = |model: &InPlaneModel, e: f64| model.respond(e).map_or(f64::NAN, |s| s.change);
    let falls = published
        .iter()
        .all(|model| change(model, 0.0) == 0.0 && change(model, EXAMPLE) > 0.0);
    ours.holds("eq_7", falls);
    let thickness = |e: f64| thickness_by_fit(&models[0], e);
    ours.holds(
        "eq_8",
        (thickness(0.0) - 1.0).abs() < 1e-15 && thickness(0.4) < 0.701,
    );
    let [by_table, by_layer] = thickness_by_mechanics(&models[0], 0.3);
    ours.number("least_thickness", by_table)
        .with("by_layer", by_layer);
}

fn under_published_law(model: &InPlaneModel) -> InPlaneModel {
    InPlaneModel {
        law: CapacitanceLaw::Published,
        ..model.clone()
    }
}

/// t/T by P1 Eq. 8.
fn thickness_by_fit(model: &InPlaneModel, compression: f64) -> f64 {
    let state = under_published_law(model).respond(compression);
    state.map_or(f64::NAN, |state| {
        state.electrodes.thickness / model.electrodes.thickness
    })
}

/// t/T by mechanics, for the electrodes as they are and for soft ones.
fn thickness_by_mechanics(model: &InPlaneModel, compression: f64) -> [f64; 2] {
    let Ok(kinematics) = LayerKinematics::new(compression) else {
        return [f64::NAN; 2];
    };
    let electrodes = &model.electrodes;
    let deformed = electrodes.deform(&model.layer, &kinematics);
    let top = electrodes.height + electrodes.thickness;
    [
        deformed.map_or(f64::NAN, |deformed| deformed.thickness),
        model.layer.slab(&kinematics, electrodes.height, top),
    ]
    .map(|thickness| thickness / electrodes.thickness)
}

fn device_numbers(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let (layer, electrodes) = (&models[0].layer, &models[0].electrodes);
    let width = Sensor::shipped("in-plane-20um")
        .and_then(|sensor| Some(sensor.in_plane().ok()?.element.layer_width));
    let electrode_modulus = match electrodes.stiffness {
        ElectrodeStiffness::Modulus(modulus) => modulus.youngs_modulus,
        ElectrodeStiffness::AsLayer => f64::NAN,
    };
    for (id, value) in [
        ("layer_thickness", layer.thickness * 1e6),
        ("layer_width", width.unwrap_or(f64::NAN) * 1e6),
        ("electrode_thickness", electrodes.thickness * 1e6),
        ("electrode_height", electrodes.height * 1e6),
        ("layer_modulus", layer.youngs_modulus * 1e-6),
        ("electrode_modulus", electrode_modulus * 1e-6),
        ("permittivity", models[0].dielectric.permittivity),
    ] {
        ours.number(id, value);
    }
    for (model, gap) in models.iter().zip(GAPS) {
        ours.number(&format!("gap_{gap}"), model.electrodes.gap * 1e6);
    }
    ours.number("vacuum_permittivity", VACUUM_PERMITTIVITY * 1e12);
}

fn table_1(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let chi = |end: EndCondition| end.factor(2.0, EXAMPLE).unwrap_or(f64::NAN);
    // n as a person would read it from mechanics: the first slope of t/T.
    let slope = |model: &InPlaneModel| (1.0 - thickness_by_mechanics(model, 1e-3)[0]) / 1e-3;
    for (model, gap) in models.iter().zip(GAPS) {
        let shear = EndShear {
            zeta: ours.printed(&format!("zeta_{gap}"), 0),
            m: ours.printed(&format!("m_{gap}"), 0),
        };
        for name in ["zeta", "m"] {
            ours.words(&format!("{name}_{gap}"))
                .with("tapered", chi(EndCondition::Tapered(shear)))
                .with("tail", chi(EndCondition::Tail(shear)));
        }
        let Some(fit) = model.published_fit else {
            continue;
        };
        for (name, value) in [
            ("t_min", fit.thinning.least_thickness),
            ("n", fit.thinning.rate),
            ("q", fit.fringe.scale),
            ("gamma", fit.fringe.exponent),
            (
                "first_slope",
                slope(model) / (1.0 - fit.thinning.least_thickness),
            ),
        ] {
            ours.number(&format!("{name}_{gap}"), value);
        }
    }
}

fn statements(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let change = |model: &InPlaneModel, e: f64| model.respond(e).map_or(f64::NAN, |s| s.change);
    let force = |model: &InPlaneModel, e: f64| {
        let state = model.layer.compress(e);
        state.map_or(f64::NAN, |state| state.force)
    };
    let opens = |model: &InPlaneModel| {
        model.respond(EXAMPLE).is_ok_and(|state| {
            state.electrodes.gap > model.electrodes.gap
                && state.electrodes.thickness < model.electrodes.thickness
                && state.change > 0.0
        })
    };
    ours.holds("working_principle", models.iter().all(opens));
    ours.holds("chain", models.iter().all(reads_back));
    let bends = |model: &InPlaneModel| {
        let [half, full] = [0.1, 0.2].map(|e| change(model, e) / force(model, e));
        half > 1.05 * full
    };
    ours.holds("non_linear", models.iter().all(bends));
    comparisons(ours, models);
    whole_range(ours, &models[0]);
    figure_5(ours, models);
}

/// Figure 5: the two models of the paper beside each other, and ours beside the first.
fn figure_5(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let ratios = |e: f64| {
        models.each_ref().map(|model| {
            let at = |layer: LayerState| {
                let published = model.change_as_published(&layer)?;
                let plates = model.change_of_parallel_plates(&layer)?;
                let mechanics = model.change_by_mechanics(&layer).ok()?;
                Some([published / plates, mechanics / published])
            };
            let found = model.layer.compress(e).ok().and_then(at);
            found.unwrap_or([f64::NAN; 2])
        })
    };
    let (example, last) = (ratios(EXAMPLE), ratios(0.3));
    // q (U/D)^gamma falls through one at U/D = q^(-1/gamma).
    let wide = &models[2];
    let fit = wide.published_fit.as_ref().map(|fit| &fit.fringe);
    let crossing = fit.map_or(f64::NAN, |fringe| {
        fringe.scale.powf(-1.0 / fringe.exponent) * wide.electrodes.gap / wide.layer.thickness
    });
    ours.holds("figure_5_models", example[2][0] >= 1.0)
        .with("ratio_20", example[0][0])
        .with("ratio_50", example[1][0])
        .with("ratio_100", example[2][0])
        .with("crossing", crossing);
    ours.words("figure_5_curves")
        .with("less_20", example[0][1])
        .with("less_50", example[1][1])
        .with("less_100", example[2][1])
        .with("more_20", last[0][1])
        .with("more_50", last[1][1])
        .with("more_100", last[2][1]);
}

fn comparisons(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let [narrow, middle, wide] = models.each_ref().map(|model| {
        let state = model.respond(EXAMPLE);
        state.map_or(f64::NAN, |state| state.change)
    });
    ours.holds("smaller_gaps", narrow > middle && middle > wide);
    ours.holds("softer_materials", softer_feels_more(&models[1]));
    let share = models
        .each_ref()
        .map(|model| model.rest_capacitance() / model.rest_capacitance_without_fringe());
    ours.holds(
        "parallel_plates",
        share[0] < share[1] && share[1] < share[2],
    )
    .with("share_20", share[0])
    .with("share_50", share[1])
    .with("share_100", share[2]);
}

fn whole_range(ours: &mut Ours, narrow: &InPlaneModel) {
    let published = under_published_law(narrow);
    let inverse = published.inverse().ok();
    let turning = inverse.as_ref().and_then(InPlaneInverse::turning);
    let row = ours.holds("sensing_range", turning.is_none());
    if let Some((inverse, turning)) = inverse.zip(turning) {
        row.with("maximum", turning.maximum)
            .with("minimum", turning.minimum)
            .with("last", inverse.last().layer.kinematics.compression());
    }
}

/// True if capacitance leads back to the force it came from.
fn reads_back(model: &InPlaneModel) -> bool {
    let round = || {
        let pressed = model.respond(EXAMPLE).ok()?;
        let inverse = model.inverse().ok()?;
        let back = inverse.state_from_capacitance(pressed.capacitance).ok()?;
        Some((back.layer.force / pressed.layer.force - 1.0).abs() < 1e-9)
    };
    round() == Some(true)
}

fn softer_feels_more(model: &InPlaneModel) -> bool {
    let mut soft = model.clone();
    soft.electrodes.stiffness = ElectrodeStiffness::AsLayer;
    let modulus = model.layer.youngs_modulus;
    let curves = study(
        &soft,
        StudyParameter::LayerModulus,
        &[0.5 * modulus, modulus],
        &[EXAMPLE],
    );
    let points: Vec<_> = curves
        .iter()
        .filter_map(|curve| curve.points.as_ref().ok()?.first())
        .collect();
    matches!(points[..], [soft, stiff]
        if soft.change == stiff.change && (2.0 * soft.force / stiff.force - 1.0).abs() < 1e-12)
}

fn figures(ours: &mut Ours, models: &[InPlaneModel; 3]) {
    let charts = models.iter().zip(GAPS).map(|(model, gap)| Chart {
        title: format!("D = {gap} um"),
        x: Axis::new("normal force", "N"),
        y: Axis::new("C0 - C", "fF"),
        series: vec![
            curve("Model 1, published fit", model, Style::Line, |layer| {
                model.change_as_published(layer)
            }),
            curve("Model 2, parallel plates", model, Style::Dashed, |layer| {
                model.change_of_parallel_plates(layer)
            }),
            curve("ours, by mechanics", model, Style::Marks, |layer| {
                model.change_by_mechanics(layer).ok()
            }),
        ],
    });
    let figure = Figure {
        title: String::from("Change of capacitance against normal force"),
        charts: charts.collect(),
        caption: String::from(
            "The paper's axes have no values in the text. Assumed here: loaded area 3.5 mm x 10 mm, electrodes 10 mm \
             long and 1 mm wide, free ends by finite elements, a uniform dielectric; compression up to 0.3. The \
             measured points are not printed as numbers.",
        ),
    };
    ours.figure("Figure 5", figure);
}

fn curve(
    name: &str,
    model: &InPlaneModel,
    style: Style,
    change: impl Fn(&LayerState) -> Option<f64>,
) -> Series {
    let steps = if style == Style::Marks { 12 } else { 120 };
    let points = (0..=steps).filter_map(|step| {
        let compression = 0.3 * f64::from(step) / f64::from(steps);
        let layer = model.layer.compress(compression).ok()?;
        Some([layer.force, change(&layer)? * 1e15])
    });
    Series::new(name, points.collect(), style)
}
