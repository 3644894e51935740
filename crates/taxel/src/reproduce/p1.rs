//! P1: the in-plane capacitive sensor.

use super::{Basis, Ledger};
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::mechanics::{
    ElectrodeStiffness, EndCondition, EndShear, LayerKinematics, LayerState, PlaneStress,
    StressConstants,
};
use crate::sensor::Sensor;
use crate::transduction::{
    CapacitanceLaw, InPlaneInverse, InPlaneModel, StudyParameter, VACUUM_PERMITTIVITY, study,
};

/// The published gaps, um, as the shipped sensors are named.
const GAPS: [u32; 3] = [20, 50, 100];
/// Compression of the examples in words.
const EXAMPLE: f64 = 0.1;

pub(super) fn fill(ledger: &mut Ledger) {
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
    kinematic_equations(ledger, &kinematics, &narrow);
    stress_equations(ledger, &kinematics);
    force_equation(ledger, &kinematics, &narrow);
    capacitance_equations(ledger, &models);
    device_numbers(ledger, &models);
    table_1(ledger, &models);
    statements(ledger, &models);
    figures(ledger, &models);
}

fn kinematic_equations(ledger: &mut Ledger, kinematics: &LayerKinematics, model: &InPlaneModel) {
    let a = kinematics.unknown();
    let heights = [0.0, 0.2, 0.5, 0.8, 1.0];
    let agrees = |printed: &dyn Fn(f64) -> f64, ours: &dyn Fn(f64) -> f64| {
        let same = |y: &f64| (printed(*y) - ours(*y)).abs() < 1e-12;
        heights.iter().all(same)
    };
    ledger
        .statement(
            "Eq. 1a",
            "displacement along the gap",
            "u1 = x1 (f(x2) - 1)",
            kinematics.stretch_excess(0.0) == 0.0 && kinematics.stretch_excess(1.0) > 0.0,
            Basis::Ours,
        )
        .note("nothing moves at the bonded base, the pressed face spreads");
    ledger
        .statement(
            "Eq. 1b",
            "displacement upwards",
            "u2 = g(x2) - x2",
            (kinematics.height(1.0) - 1.0 + EXAMPLE).abs() < 1e-14,
            Basis::Ours,
        )
        .note("at the pressed face it is -U");
    ledger
        .statement(
            "Eq. 2",
            "sideways stretch f",
            "cos(alpha x2) + tan(alpha H) sin(alpha x2)",
            agrees(&|y| (a * y).cos() + a.tan() * (a * y).sin(), &|y| {
                kinematics.stretch(y)
            }),
            Basis::Ours,
        )
        .note("the same as cos(alpha (H - x2))/cos(alpha H)");
    ledger
        .statement(
            "Eq. 3",
            "present height g",
            "(cos(alpha H)/alpha) (log ... - log ...)",
            agrees(&|y| printed_height(a, y), &|y| kinematics.height(y)),
            Basis::Ours,
        )
        .note("correct as printed, including its factor 1; ours is one logarithm without cancellation");
    ledger
        .statement(
            "2.1",
            "alpha H from g(H) = h",
            "a look-up table, in reference 7 of the paper",
            (1.0 - a.cos() * a.tan().asinh() / a - EXAMPLE).abs() < 1e-14,
            Basis::Ours,
        )
        .note("U/H = 1 - cos(a) asinh(tan a)/a, solved in brackets: the equation has meaningless roots above pi/2");
    ledger
        .statement(
            "Fig. 3",
            "boundary-value problem: bonded below, uniform U on top, no shear there",
            "f(0) = 1, no shear at x2 = H",
            kinematics.stretch(0.0) == 1.0 && kinematics.stretch_slope(1.0) == 0.0,
            Basis::Ours,
        )
        .note("holds where the probe slides; a probe that grips makes two layers of half the thickness");
    ledger
        .number(
            "2.1",
            "layer thinning at U/H = 0.4",
            "40 %",
            100.0 * (1.0 - layer_height(model, 0.4) / model.layer.thickness),
            Basis::Ours,
        )
        .note("the largest compression for which finite elements were compared");
    finite_elements(ledger);
}

/// Our finite elements against the closed form; a test solves them anew.
const INTERIOR: &str = include_str!("p1_interior.csv");
/// Both results count as agreeing when no place differs by more: the width of a line
/// in a figure.
const AGREES: f64 = 0.01;

/// Rows of [`INTERIOR`]: U/H, largest error across and upwards, force over that of χ = 1.
fn interior() -> Vec<[f64; 4]> {
    let row = |line: &str| {
        let mut cells = line.split(',').map(|cell| cell.parse::<f64>().ok());
        Some([
            cells.next()??,
            cells.next()??,
            cells.next()??,
            cells.next()??,
        ])
    };
    INTERIOR.lines().filter_map(row).collect()
}

fn finite_elements(ledger: &mut Ledger) {
    let rows = interior();
    let worst = |column: usize| rows.iter().map(|row| row[column]).fold(0.0, f64::max);
    let (across, height) = (worst(1), worst(2));
    let last = rows.last().map_or(f64::NAN, |row| row[0]);
    let force = rows.iter().map(|row| row[3]);
    let (low, high) = force.fold((f64::INFINITY, 0.0_f64), |(low, high), ratio| {
        (low.min(ratio), high.max(ratio))
    });
    ledger
        .statement(
            "2.1",
            "analytical and finite-element results agree",
            "up to U/H = 0.4",
            last >= 0.4 && across.max(height) < AGREES,
            Basis::Ours,
        )
        .note(format!(
            "our finite elements of a layer 4 H long, up to U/H = {last}: in its middle the places differ from Eqs. 1 \
             to 3 by less than {across:.0e} across and {height:.0e} H upwards; its free ends leave {low:.3} to \
             {high:.3} of the force of Eq. 6 with chi = 1"
        ));
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

fn stress_equations(ledger: &mut Ledger, kinematics: &LayerKinematics) {
    let material = StressConstants { c1: 0.7, c2: -0.3 };
    let ours = |point: [f64; 2]| kinematics.stress(material, 0.5, point);
    let printed = |point: [f64; 2]| PlaneStress {
        sigma22: printed_upward_stress(kinematics, material, point),
        ..ours(point)
    };
    let [across, upwards] = residual(kinematics, &ours);
    let [_, misprinted] = residual(kinematics, &printed);
    // Central differences over 2e-5: 1e-9.
    let balanced = across.abs() < 1e-7 && upwards.abs() < 1e-7;
    for (place, what, form) in [
        (
            "Eq. 4a",
            "stress along the gap",
            "-P + C1 (f^2 + (x1 f')^2) + C2 g'^2",
        ),
        ("Eq. 4b", "shear stress", "(C1 - C2) x1 f' g'"),
        (
            "Eq. 5",
            "pressure",
            "C2 x1^2 f'^2 + (C1 - C2)/2 A x1^2 f^2 + ...",
        ),
    ] {
        ledger
            .statement(place, what, form, balanced, Basis::Ours)
            .note("equilibrium along and across holds, with the primes of Eq. 4c restored");
    }
    ledger
        .statement(
            "Eq. 4c",
            "stress upwards",
            "-P + C1 g^2 + C2 (f^2 + x1^2 f^2)",
            misprinted.abs() < 1e-7,
            Basis::Ours,
        )
        .contradicts(format!(
            "Eqs. 4b and 5: vertical equilibrium is violated by {misprinted:.2} mu/H at x1 = H, x2 = 0.4 H; \
             with g'^2 and f'^2 it holds, and the dimensions fit. Whether the primes are missing in print or only in the \
             text at hand is not known"
        ));
    ledger
        .statement(
            "2.2",
            "the constant A",
            "A = -alpha^2, negative",
            curvature_is_minus_square(kinematics),
            Basis::Ours,
        )
        .note("f'' = A f");
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

fn force_equation(ledger: &mut Ledger, kinematics: &LayerKinematics, model: &InPlaneModel) {
    let (aspect, chi) = (model.layer.aspect(), 1.0);
    let constant = kinematics.pressure_constant(aspect, chi);
    let stretch = kinematics.top_stretch();
    let square = (kinematics.unknown() * aspect * stretch).powi(2);
    let printed = -stretch * (square / 6.0 + 0.5 / (stretch * stretch) - constant);
    let ours = kinematics.mean_stress(aspect, chi);
    ledger
        .statement(
            "Eq. 6",
            "contact force",
            "2 w_c L_c lambda (-(C1 - C2)/6 A L^2 lambda^2 + ... - Pi)",
            (printed / ours - 1.0).abs() < 1e-12,
            Basis::Ours,
        )
        .note(
            "negative in compression; L is L_c, and the primes have no part in it. Ours reports -F",
        );
    ledger
        .open("2.2", "Pi from global equilibrium with zeta and m", "calibration factors")
        .not_determined(
            "zeta and m are not defined. Ours: one factor chi on the bottom shear, from two readings of zeta and m or \
             from finite elements",
        );
    ledger
        .open("2.2", "loaded length and depth 2 L_c, w_c", "no values")
        .not_determined("the shipped files choose 3.5 mm and 10 mm");
}

fn capacitance_equations(ledger: &mut Ledger, models: &[InPlaneModel; 3]) {
    let published: Vec<InPlaneModel> = models.iter().map(under_published_law).collect();
    let change = |model: &InPlaneModel, e: f64| model.respond(e).map_or(f64::NAN, |s| s.change);
    let falls = published
        .iter()
        .all(|model| change(model, 0.0) == 0.0 && change(model, EXAMPLE) > 0.0);
    ledger
        .statement(
            "Eq. 7",
            "change of capacitance, C0 - C",
            "eps0 eps_r w_e (T/D - t/d) q (U/D)^gamma",
            falls,
            Basis::Ours,
        )
        .note("zero at rest, then positive; its slope at rest is infinite for gamma < 0, so it states no sensitivity there");
    ledger
        .open("Eq. 7", "electrode depth w_e, width b", "no values")
        .not_determined("the shipped files choose 10 mm and 1 mm; per depth Eq. 7 needs neither");
    let thickness = |e: f64| thickness_by_fit(&models[0], e);
    ledger
        .statement(
            "Eq. 8",
            "electrode thickness",
            "t_min + (T - t_min) exp(-n U/H)",
            (thickness(0.0) - 1.0).abs() < 1e-15 && thickness(0.4) < 0.701,
            Basis::Ours,
        )
        .note("a fit, taken as it is");
    let [by_table, by_layer] = thickness_by_mechanics(&models[0], 0.3);
    ledger
        .number(
            "Eq. 8",
            "least thickness t/T, at U/H = 0.3 and D = 20 um",
            "0.7",
            by_table,
            Basis::Ours,
        )
        .contradicts(format!(
            "Eqs. 2 and 3: an incompressible layer alone thins to {by_layer:.3} there and on; there is no floor"
        ));
}

fn under_published_law(model: &InPlaneModel) -> InPlaneModel {
    InPlaneModel {
        law: CapacitanceLaw::Published,
        ..*model
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

fn device_numbers(ledger: &mut Ledger, models: &[InPlaneModel; 3]) {
    let (layer, electrodes) = (&models[0].layer, &models[0].electrodes);
    let width = Sensor::shipped("in-plane-20um")
        .and_then(|sensor| Some(sensor.in_plane().ok()?.element.layer_width));
    let electrode_modulus = match electrodes.stiffness {
        ElectrodeStiffness::Modulus(modulus) => modulus.youngs_modulus,
        ElectrodeStiffness::AsLayer => f64::NAN,
    };
    for (place, what, printed, ours) in [
        ("3", "layer thickness H", "950 um", layer.thickness * 1e6),
        (
            "3",
            "layer width w_d",
            "3500 um",
            width.unwrap_or(f64::NAN) * 1e6,
        ),
        (
            "3",
            "electrode thickness T",
            "100 um",
            electrodes.thickness * 1e6,
        ),
        (
            "3",
            "height S of the electrodes",
            "550 um",
            electrodes.height * 1e6,
        ),
        (
            "3",
            "modulus E_d of the layer",
            "1.2 MPa",
            layer.youngs_modulus * 1e-6,
        ),
        (
            "3",
            "modulus E_e of the electrodes",
            "2.1 MPa",
            electrode_modulus * 1e-6,
        ),
        (
            "4.1",
            "relative permittivity",
            "2.4",
            models[0].dielectric.permittivity,
        ),
    ] {
        ledger.number(place, what, printed, ours, Basis::Input);
    }
    for (model, gap) in models.iter().zip(GAPS) {
        ledger.number(
            "3",
            "gap D",
            &format!("{gap} um"),
            model.electrodes.gap * 1e6,
            Basis::Input,
        );
    }
    ledger
        .number(
            "4.1",
            "permittivity of vacuum",
            "8.8541 pF/m",
            VACUUM_PERMITTIVITY * 1e12,
            Basis::Ours,
        )
        .contradicts("CODATA 2022, 8.8541878 pF/m, rounds to 8.8542: the printed number is cut off. 1e-5 of the capacitance");
}

fn table_1(ledger: &mut Ledger, models: &[InPlaneModel; 3]) {
    let shear = EndShear { zeta: 20.0, m: 1.0 };
    let chi = |end: EndCondition| end.factor(2.0, EXAMPLE).unwrap_or(f64::NAN);
    let [tapered, tail] = [EndCondition::Tapered(shear), EndCondition::Tail(shear)].map(chi);
    // n as a person would read it from mechanics: the first slope of t/T.
    let slope = |model: &InPlaneModel| (1.0 - thickness_by_mechanics(model, 1e-3)[0]) / 1e-3;
    for ((model, gap), [n, q, gamma]) in models.iter().zip(GAPS).zip([
        ["25", "1.85", "-0.4"],
        ["10", "2.65", "-0.3"],
        ["5", "0.65", "-0.3"],
    ]) {
        for (what, printed) in [("zeta", "20"), ("m", "1")] {
            ledger
                .open("Table 1", &format!("{what}, D = {gap} um"), printed)
                .not_determined(format!(
                    "not defined; tapered inside the contact chi = {tapered:.3}, with a tail outside {tail:.3}"
                ));
        }
        let Some(fit) = model.published_fit else {
            continue;
        };
        for (what, printed, ours) in [
            ("t_min/T", "0.7", fit.thinning.least_thickness),
            ("n", n, fit.thinning.rate),
            ("q", q, fit.fringe.scale),
            ("gamma", gamma, fit.fringe.exponent),
        ] {
            let what = format!("{what}, D = {gap} um");
            let note = "the measurements it was fitted to are not printed";
            ledger
                .number("Table 1", &what, printed, ours, Basis::Input)
                .note(note);
        }
        ledger
            .number(
                "Table 1",
                &format!("n from the first slope of t/T by mechanics, D = {gap} um"),
                n,
                slope(model) / (1.0 - fit.thinning.least_thickness),
                Basis::Ours,
            )
            .contradicts(
                "Eqs. 2 and 3: the first slope of t/T is -1.3, with stiffer electrodes about -1.5, whatever the gap",
            );
    }
}

fn statements(ledger: &mut Ledger, models: &[InPlaneModel; 3]) {
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
    ledger
        .statement(
            "Fig. 1",
            "working principle",
            "pressure spreads the layer, the capacitance falls",
            models.iter().all(opens),
            Basis::Ours,
        )
        .note("the gap opens and the electrodes thin");
    ledger
        .statement(
            "Fig. 2",
            "section and flow: U to alpha to force; U to d and t to capacitance",
            "C(F)",
            models.iter().all(reads_back),
            Basis::Ours,
        )
        .note(
            "forward, and back from capacitance to force inside the range that taxel check prints",
        );
    let bends = |model: &InPlaneModel| {
        let [half, full] = [0.1, 0.2].map(|e| change(model, e) / force(model, e));
        half > 1.05 * full
    };
    ledger
        .statement(
            "Abstract",
            "relation of force and capacitance",
            "non-linear",
            models.iter().all(bends),
            Basis::Ours,
        )
        .note("change per force falls by more than 5 % from U/H = 0.1 to 0.2");
    comparisons(ledger, models);
    whole_range(ledger, &models[0]);
    without_numbers(ledger);
}

fn comparisons(ledger: &mut Ledger, models: &[InPlaneModel; 3]) {
    let [narrow, middle, wide] = models.map(|model| {
        let state = model.respond(EXAMPLE);
        state.map_or(f64::NAN, |state| state.change)
    });
    ledger
        .statement(
            "Abstract",
            "smaller gaps",
            "higher sensing capability",
            narrow > middle && middle > wide,
            Basis::Ours,
        )
        .note("change at one compression, and at one force");
    ledger
        .statement(
            "Abstract",
            "softer materials",
            "higher sensing capability",
            softer_feels_more(&models[1]),
            Basis::Ours,
        )
        .note("half the modulus, half the force for the same change");
    let share =
        models.map(|model| model.rest_capacitance() / model.rest_capacitance_without_fringe());
    ledger
        .statement(
            "Abstract",
            "parallel plates fall short most for large gaps",
            "especially for large gaps",
            share[0] < share[1] && share[1] < share[2],
            Basis::Ours,
        )
        .note(format!(
            "at rest the whole is {:.2}, {:.2}, {:.2} times the facing sides. The change is nearly theirs alone: in the \
             field 0.995 to 1.107 of it",
            share[0], share[1], share[2]
        ));
}

fn whole_range(ledger: &mut Ledger, narrow: &InPlaneModel) {
    let published = under_published_law(narrow);
    let inverse = published.inverse().ok();
    let turning = inverse.as_ref().and_then(InPlaneInverse::turning);
    let explanation = inverse.zip(turning).map_or(String::new(), |(inverse, turning)| {
        format!(
            "Eqs. 7 and 8 with Table 1, D = 20 um: the curve has a maximum at U/H = {:.3} and a minimum at {:.3}, and \
             can be read back only up to {:.3}",
            turning.maximum,
            turning.minimum,
            inverse.last().layer.kinematics.compression()
        )
    });
    ledger
        .statement(
            "4.1",
            "Model 1 predicts the response",
            "over its entire sensing range",
            turning.is_none(),
            Basis::Ours,
        )
        .contradicts(explanation);
}

fn without_numbers(ledger: &mut Ledger) {
    for (place, what, printed, missing) in [
        (
            "4.1",
            "agreement of Model 1 with the experiment",
            "exceptional",
            "the measured points are in the figure only, its axes without values in the text",
        ),
        (
            "4.1, 5",
            "parametric studies: layer and electrode modulus, location, thickness, gap",
            "carried out in reference 6",
            "no results are printed but the two in the abstract; taxel::transduction::study computes all five",
        ),
        (
            "5",
            "finite contact probe",
            "a rigorous shear stress integration",
            "not described; ours is the factor chi of the end condition",
        ),
        (
            "Fig. 4",
            "photographs of moulding and sensors",
            "no numbers",
            "about making; nothing here models it",
        ),
    ] {
        ledger.open(place, what, printed).not_determined(missing);
    }
}

/// Whether capacitance leads back to the force it came from.
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
    let mut soft = *model;
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

fn figures(ledger: &mut Ledger, models: &[InPlaneModel; 3]) {
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
    ledger.figure("Figure 5", figure);
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
