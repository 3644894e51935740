//! P3: the piezoelectric array in silicone.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use crate::ledger::Ours;
use taxel::device::{Drive, PiezoelectricArray, PiezoelectricPredictor};
use taxel::electronics::{ChargeMode, FirstOrderFilter, Output, Readout};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::{
    Base, BondedDisc, ContactPressure, DiscGrip, LayerLaw, LayerRim, Plate, Profile, SeatedSetting,
    SoftCover, SoftLayer, bending_stiffness,
};
use taxel::sensor::Sensor;
use taxel::stress_map::StressMap;
use taxel::transduction::{
    Ceramic, PiezoelectricElement, PiezoelectricLaw, SiliconePath, VACUUM_PERMITTIVITY,
};
use taxel_numerics::linear_chain::{Chain, Transfer};

/// Profiles of our values; the paper prints no ramp.
const STEP: Profile = Profile::Step { ramp: 0.01 };
const IMPACT: Profile = Profile::Impact {
    ramp: 0.01,
    dwell: 0.2,
};
const CYCLIC: Profile = cycles(0.35);
const PROFILES: [(&str, Profile); 3] = [("step", STEP), ("impact", IMPACT), ("cyclic", CYCLIC)];

const fn cycles(period: f64) -> Profile {
    Profile::Cyclic {
        ramp: 0.01,
        period,
        cycles: 12,
    }
}

const THICKNESSES: [&str; 2] = ["1.5 mm", "2.3 mm"];
/// The same samples in the names of the rows.
const SAMPLES: [&str; 2] = ["thin", "thick"];
/// Thickness of the ceramic, m: a stock sheet, the paper prints none.
const STOCK_SHEET: f64 = 0.127e-3;

/// One of the two prototypes.
struct Prototype<'a> {
    array: &'a PiezoelectricArray<'a>,
    predictor: PiezoelectricPredictor,
    path: SiliconePath,
    thickness: f64,
    /// D of figures 11 to 13, m.
    smallest: f64,
    /// Area on which the tester presses, m².
    tester_area: f64,
    /// The filter that section 2.4 names.
    filter: FirstOrderFilter,
}

impl<'a> Prototype<'a> {
    fn new(array: &'a PiezoelectricArray<'a>, ours: &Ours) -> Option<Self> {
        Some(Self {
            predictor: PiezoelectricPredictor::new(array),
            path: array.path().ok()?,
            thickness: array.description.preloaded().ok()?.thickness,
            smallest: ours.printed("smallest_displacement", -6),
            tester_area: ours.printed("contact_area", -6),
            filter: match array.readout() {
                Readout::VoltageAmplifier(stage) => stage.filter?,
                _ => return None,
            },
            array,
        })
    }

    /// A1 and A2, V, for a top displacement, m.
    fn peaks(&self, profile: &Profile, displacement: f64) -> [f64; 2] {
        let answer = self
            .predictor
            .test(profile, Drive::Displacement(displacement));
        answer.map_or([f64::NAN; 2], |answer| [answer.first, answer.second])
    }

    fn sum(&self, profile: &Profile) -> f64 {
        let [first, second] = self.peaks(profile, 10.0 * self.smallest);
        first + second
    }

    /// Voltage to which the paper refers its signals, V.
    fn limit(&self) -> f64 {
        self.array.board.output.limit
    }

    /// Force on the whole area of the tester, N.
    fn tester_force(&self, displacement: f64) -> f64 {
        let cover = &self.array.description.cover;
        self.path.stiffness * displacement * self.tester_area / cover.column_area
    }
}

pub(crate) fn fill(ours: &mut Ours) {
    let sensors = ["piezo-1.5mm", "piezo-2.3mm"].map(Sensor::shipped);
    let [Some(thin), Some(thick)] = &sensors else {
        return;
    };
    let (Ok(thin), Ok(thick)) = (thin.piezoelectric(), thick.piezoelectric()) else {
        return;
    };
    let (Some(thin), Some(thick)) = (Prototype::new(&thin, ours), Prototype::new(&thick, ours))
    else {
        return;
    };
    let both = [thin, thick];
    introduction(ours, &both[0]);
    inputs(ours, &both);
    element_equations(ours, &both[0]);
    law_equations(ours);
    chain_equations(ours, &both[0]);
    table_1(ours, &both[0]);
    smallest_deformation(ours, &both[0]);
    plate_equations(ours);
    conditioning(ours, &both[0]);
    experiments(ours, &both);
    results(ours, &both);
    arrays(ours, &both[0]);
    shear(ours, &both[0]);
    table_2(ours, &both);
    conclusion(ours, &both[0]);
    figures(ours, &both);
}

/// True if two numbers agree to rounding.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs()
}

fn same_at(a: &Transfer, b: impl Fn(Complex64) -> Complex64) -> bool {
    [0.01, 1.0, 8.68, 1e3, 1e6].into_iter().all(|hertz| {
        let s = Complex64::new(0.0, TAU * hertz);
        (a.at(s) - b(s)).norm() <= 1e-9 * b(s).norm()
    })
}

/// Static value.
fn at_rest(transfer: &Transfer) -> f64 {
    transfer.at(Complex64::from(0.0)).re
}

/// Slope of table 2 for a profile and a sample, per N.
fn slope_id(profile: &str, sample: usize) -> String {
    format!("slope_{profile}_{}", SAMPLES[sample])
}

fn introduction(ours: &mut Ours, prototype: &Prototype<'_>) {
    let table = ours.table;
    let slopes = || {
        let ids = PROFILES
            .iter()
            .flat_map(|(name, _)| [slope_id(name, 0), slope_id(name, 1)]);
        ids.map(|id| table.number(&id, 0))
    };
    ours.number("least_sensitivity", slopes().fold(f64::INFINITY, f64::min));
    ours.number("greatest_sensitivity", slopes().fold(0.0, f64::max));
    // Table 1 read as pC/N, in nm/V.
    ours.number("range_low", table.number("table_1_e33", -12));
    ours.number("range_high", prototype.array.element.charge_per_force * 1e9);
}

/// Currents at the element while the surface rises: K x′, C V′ and V/R.
fn currents(prototype: &Prototype<'_>) -> Option<[f64; 3]> {
    let element = &prototype.array.element;
    let voltage = Chain::new(&element.voltage_per_displacement(prototype.path)).ok()?;
    let compression = Chain::new(&element.compression_per_displacement(prototype.path)).ok()?;
    let knots = STEP.knots(prototype.smallest);
    let (time, step) = (5e-3, 1e-4);
    let times = [time - step, time, time + step];
    let slope = |values: &[f64]| (values[2] - values[0]) / (2.0 * step);
    let volts = voltage.respond(&knots, &times);
    let metres = compression.respond(&knots, &times);
    Some([
        element.charge_per_compression() * slope(&metres),
        element.capacitance * slope(&volts),
        volts[1] / element.leak_resistance,
    ])
}

fn element_equations(ours: &mut Ours, prototype: &Prototype<'_>) {
    let (element, path) = (&prototype.array.element, prototype.path);
    let compression = at_rest(&element.compression_per_displacement(path));
    let force = path.stiffness * (1.0 - compression);
    ours.holds("eq_1", same(compression, force / element.stiffness));
    let charge = at_rest(&element.charge_per_displacement(path));
    let constant = element.charge_per_compression();
    ours.holds("eq_2", same(charge, constant * compression));
    ours.holds("eq_3", same(charge / force, element.charge_per_force));
    let farad = VACUUM_PERMITTIVITY * 3138.0 * ours.printed("table_1_area", 0) / STOCK_SHEET;
    let measured = ours.printed("capacitance", 0);
    ours.holds("eq_4", (farad * 1e12).round() == measured);
    let [source, capacitor, leak] = currents(prototype).unwrap_or([f64::NAN; 3]);
    // Central differences over 0.1 ms of a signal that leaks in 0.24 s.
    let balance = |a: f64, b: f64| (a - b).abs() < 1e-6 * source.abs();
    ours.holds("eq_5", balance(source, capacitor + leak));
    ours.holds("eq_6_first", balance(source, capacitor - leak));
    ours.holds("eq_6_second", balance(capacitor, source - leak));
    ours.holds("eq_7", balance(capacitor, source - leak));
    let tau = element.time_constant();
    let sensitivity = constant / element.capacitance;
    let formula = |s: Complex64| sensitivity * tau * s / (tau * s + 1.0);
    ours.holds("eq_8", same_at(&element.voltage_per_compression(), formula));
}

/// Eqs. 9 to 11.
fn law_equations(ours: &mut Ours) {
    let law = PiezoelectricLaw {
        stiffness: [1.2e11, 0.8e11, 1.1e11],
        piezoelectric: [-6.0, 20.0],
        permittivity: 1.5e-8,
    };
    let field = law.respond(0.0, 0.0, 1e3);
    let strain = law.respond(1e-5, 2e-5, 0.0);
    let y = same(strain.stress_y, 1.2e6 + 1.6e6) && same(field.stress_y, 6e3);
    let z = same(strain.stress_z, 0.8e6 + 2.2e6) && same(field.stress_z, -20e3);
    ours.holds("eq_9", y);
    ours.holds("eq_10", z);
    ours.holds("eq_11", field.electric_displacement < 0.0);
}

/// Eqs. 12 to 17.
fn chain_equations(ours: &mut Ours, prototype: &Prototype<'_>) {
    let (element, path) = (&prototype.array.element, prototype.path);
    let compression = at_rest(&element.compression_per_displacement(path));
    let equivalent = element.stiffness + path.stiffness;
    // Static x2/x1 of a vanishing ceramic stiffness by the printed (13).
    let soft = PiezoelectricElement {
        stiffness: 1e-9 * path.stiffness,
        ..*element
    };
    let printed = 2.0 * path.stiffness / (soft.stiffness + path.stiffness);
    let alone = at_rest(&soft.compression_per_displacement(path));
    ours.holds(
        "eq_12",
        same(-path.stiffness, path.stiffness * (1.0 - compression)),
    );
    ours.holds("eq_13", same(printed, alone));
    ours.holds(
        "eq_14",
        same(element.stiffness - path.stiffness, equivalent),
    );
    let transfer = element.compression_per_displacement(path);
    let (w, zeta) = (element.natural_frequency(path), element.damping_ratio(path));
    let standard = |s: Complex64| {
        w * w / equivalent * (path.damping * s + path.stiffness)
            / (s * s + 2.0 * zeta * w * s + w * w)
    };
    let as_printed = |s: Complex64| standard(s) * (2.0 / (w * w));
    ours.holds("eq_15", same_at(&transfer, as_printed));
    let product = element.voltage_per_compression().then(&transfer);
    let whole = element.voltage_per_displacement(path);
    ours.holds("eq_16", same_at(&whole, |s| product.at(s)));
    let column = printed_column(ours, prototype.thickness);
    let holds = same(column.stiffness, path.stiffness) && same(column.damping, path.damping);
    ours.holds("eq_17", holds);
}

/// The element of table 1, its charge read as 110e-12 C/N; the thickness of
/// the ceramic, m, is not printed.
fn printed_element(ours: &Ours, thickness: f64) -> PiezoelectricElement {
    let ceramic = Ceramic {
        area: ours.printed("table_1_area", 0),
        thickness,
        modulus: ours.printed("table_1_modulus", 0),
        density: 7800.0,
        damping_ratio: ours.printed("table_1_damping", 0),
    };
    PiezoelectricElement::new(
        &ceramic,
        ours.printed("table_1_e33", -21),
        ours.printed("table_1_capacitance", -12),
        ours.printed("table_1_resistance", 3),
    )
}

/// A column of silicone of `thickness`, m, with the printed constants.
fn printed_column(ours: &Ours, thickness: f64) -> SiliconePath {
    SiliconePath::of_layer(
        ours.printed("silicone_modulus", 6),
        ours.printed("table_1_viscosity", 0),
        ours.printed("table_1_column_area", 0),
        thickness,
    )
}

fn table_1(ours: &mut Ours, prototype: &Prototype<'_>) {
    let element = printed_element(ours, STOCK_SHEET);
    ours.number("table_1_e33", ours.printed("table_1_e33", -21));
    ours.number(
        "table_1_modulus",
        prototype.array.description.ceramic.modulus,
    );
    ours.number("table_1_area", ours.printed("element_side", -3).powi(2));
    let fitted = prototype.array.element.leak_resistance * 1e-3;
    ours.number("table_1_resistance", fitted);
    ours.number("table_1_capacitance", ours.printed("capacitance", 0));
    ours.number(
        "table_1_damping",
        prototype.array.description.ceramic.damping_ratio,
    );
    let w = (element.stiffness / element.mass).sqrt();
    ours.number("table_1_frequency", w);
    ours.number(
        "table_1_silicone_modulus",
        ours.printed("silicone_modulus", 6),
    );
    ours.number(
        "table_1_viscosity",
        prototype.array.description.cover.viscosity,
    );
    ours.number(
        "table_1_column_area",
        prototype.array.description.cover.column_area,
    );
    ours.holds(
        "table_1_thickness",
        (0.05e-3..=0.5e-3).contains(&prototype.thickness),
    );
}

/// Numbers of section 2.3.
fn smallest_deformation(ours: &mut Ours, prototype: &Prototype<'_>) {
    let least = |thickness: f64| {
        let element = printed_element(ours, thickness);
        element.capacitance * ours.printed("smallest_voltage", -3)
            / element.charge_per_compression()
            * 1e9
    };
    let (stock, thicker) = (least(STOCK_SHEET), least(0.130e-3));
    ours.number("smallest_deformation", stock)
        .with("thicker", thicker);
    let step = prototype.array.board.step() * 1e3;
    ours.number("smallest_voltage", step);
}

fn plate_equations(ours: &mut Ours) {
    // Any signal of element 1 and the step of the converter, V.
    let (first, step) = (0.1, ours.printed("smallest_voltage", -3));
    let second = first - step;
    ours.holds("eq_18", same(first - second, step));
    ours.holds("eq_19", same(first + step, second));
    let (k, c, r, rate) = (1.0, ours.printed("capacitance", -12), 276e6, 5.0);
    let solved = (c * rate + (first + step) / r) / k;
    let back = k * solved - (first + step) / r;
    ours.holds("eq_20", same(back, c * rate));
    let (modulus, thickness) = (
        ours.printed("silicone_modulus", 6),
        ours.printed("preloaded_thin", -3),
    );
    let plate = Plate {
        bending_stiffness: bending_stiffness(modulus, thickness, 0.5),
        mass_per_area: 1.07,
        damping: 200.0,
    };
    ours.holds("eq_21", plate_residual(&plate) < 1e-3);
    ours.holds(
        "eq_22",
        same(plate.bending_stiffness, modulus * thickness.powi(3) / 9.0),
    );
    // The momentum of the plate after a unit impulse, by the printed factor.
    let factor = 4.0 * PI.powi(2) / TAU.sqrt();
    ours.holds("eq_23", same(factor, 1.0))
        .with("factor", factor);
    ours.holds("eq_24", same(first + step, second));
}

/// Residual of the plate equation at r = 4 mm, t = 1 ms, over its largest term.
fn plate_residual(plate: &Plate) -> f64 {
    let (r, t, h, dt) = (4e-3, 1e-3, 2e-5, 2e-6);
    let u = |r: f64, t: f64| {
        plate
            .impulse_response(r, t)
            .map_or(f64::NAN, |motion| motion.deflection)
    };
    let laplace = |f: &dyn Fn(f64) -> f64, r: f64| {
        (f(r + h) - 2.0 * f(r) + f(r - h)) / (h * h) + (f(r + h) - f(r - h)) / (2.0 * h * r)
    };
    let inner = |r: f64| laplace(&|r| u(r, t), r);
    let inertia = plate.mass_per_area * (u(r, t + dt) - 2.0 * u(r, t) + u(r, t - dt)) / (dt * dt);
    let drag = plate.damping * (u(r, t + dt) - u(r, t - dt)) / (2.0 * dt);
    let bending = plate.bending_stiffness * laplace(&inner, r);
    (inertia + drag + bending).abs() / inertia.abs().max(bending.abs())
}

/// Printed numbers that the sensor files take as they stand.
fn inputs(ours: &mut Ours, [thin, thick]: &[Prototype<'_>; 2]) {
    let (array, cover) = (&thin.array, &thin.array.description.cover);
    let layout = array.layout();
    let limit = thin.limit();
    let filter = thin.filter;
    for (id, value) in [
        ("columns", layout.columns as f64),
        ("rows", layout.rows as f64),
        ("element_side", array.description.ceramic.side * 1e3),
        ("feedback_resistance", filter.feedback_resistance * 1e-3),
        ("input_resistance", filter.input_resistance * 1e-3),
        ("feedback_capacitance", filter.feedback_capacitance * 1e9),
        ("preload_thin", cover.preload),
        ("preload_thick", thick.array.description.cover.preload),
        ("silicone_modulus", cover.modulus * 1e-6),
        ("contact_area", cover.preload_area * 1e6),
        ("smallest_displacement", thin.smallest * 1e6),
        ("converter_limit", limit),
    ] {
        ours.number(id, value);
    }
}

fn conditioning(ours: &mut Ours, prototype: &Prototype<'_>) {
    let element = &prototype.array.element;
    let filter = prototype.filter;
    let charge_mode = ChargeMode {
        feedback_resistance: filter.feedback_resistance,
        feedback_capacitance: filter.feedback_capacitance,
        open_loop_gain: ours.printed("open_loop_gain", 0),
        filter: None,
        output: Output::IDEAL,
    };
    let voltage = element.charge_per_force / element.capacitance;
    let fast = element
        .voltage_per_force()
        .at_frequency(1e4 / element.time_constant())
        .norm();
    ours.holds("eq_25", (fast / voltage - 1.0).abs() < 1e-6);
    ours.number("capacitance", element.capacitance * 1e12);
    let band = charge_mode.band(element.capacitance, element.leak_resistance);
    let above = band.transfer().at_frequency(1e3 * 8.68).norm() * filter.feedback_capacitance;
    ours.holds("eq_26", (above - 1.0).abs() < 1e-3);
    let tau = filter.time_constant();
    let gain = ours.printed("feedback_resistance", 0) / ours.printed("input_resistance", 0);
    let formula = |s: Complex64| -gain / (1.0 + s * tau);
    ours.holds("eq_27", same_at(&filter.transfer(), formula));
    ours.number("open_loop_gain", 10.0_f64.powf(80.0 / 20.0));
    ours.derived(
        "static_gain",
        ["feedback_resistance", "input_resistance"],
        |[feedback, input]| feedback / input,
    );
    // kohm and nF.
    ours.derived(
        "cut_off",
        ["feedback_resistance", "feedback_capacitance"],
        |[resistance, capacitance]| 1e6 / (TAU * resistance * capacitance),
    );
}

fn experiments(ours: &mut Ours, [thin, thick]: &[Prototype<'_>; 2]) {
    for (id, sample, preload) in [
        ("preloaded_thin", thin, "preload_thin"),
        ("preloaded_thick", thick, "preload_thick"),
    ] {
        let rows = [preload, "silicone_modulus", "contact_area"];
        let thickness = sample.array.description.cover.thickness * 1e3;
        ours.derived(id, rows, |[force, modulus, area]| {
            thickness * (1.0 - force / (modulus * area))
        });
    }
    ours.number("largest_displacement", 10.0 * thin.smallest * 1e6);
    ours.number("slowest_cycles", 1.0 / 0.5);
    ours.number("fastest_cycles", 1.0 / 0.2);
}

fn results(ours: &mut Ours, [thin, thick]: &[Prototype<'_>; 2]) {
    let ratio = thin.sum(&STEP) / thick.sum(&STEP);
    let slopes = PROFILES
        .map(|(name, _)| ours.printed(&slope_id(name, 0), 0) / ours.printed(&slope_id(name, 1), 0));
    ours.number("thickness_trend", ratio);
    let answer = ours.number("steepness_change", (ratio - 1.0) * 100.0);
    answer.with("neo_hookean", 100.0 * (neo_hookean([thin, thick]) - 1.0));
    for (name, printed) in ["step", "impact", "cyclic"].into_iter().zip(slopes) {
        answer.with(name, 100.0 * (printed - 1.0));
    }
    let [first, second] = thin.peaks(&STEP, thin.smallest);
    ours.holds("step_amplitude", second < 0.01 * first);
    let [first, second] = thin.peaks(&IMPACT, thin.smallest);
    ours.holds("impact_amplitudes", first > 1.2 * second);
    let [first, second] = thin.peaks(&CYCLIC, thin.smallest);
    ours.holds("cycles_symmetric", same_to(first, second, 1e-3));
    let higher = PROFILES
        .iter()
        .all(|(_, profile)| thin.sum(profile) > thick.sum(profile));
    ours.holds("thinner_answers_more", higher);
    let change = thin.sum(&cycles(0.5)) / thin.sum(&cycles(0.2));
    ours.holds("cycle_frequency", same_to(change, 1.0, 0.05))
        .with("change", change)
        .with("sine", thin.sum(&sine(0.5)) / thin.sum(&sine(0.2)));
    let order = thin.sum(&STEP) < thin.sum(&CYCLIC) && thin.sum(&CYCLIC) < thin.sum(&IMPACT);
    ours.holds("order_of_sums", order);
    let linear =
        (thin.sum(&STEP) / (10.0 * thin.peaks(&STEP, thin.smallest)[0]) - 1.0).abs() < 0.01;
    ours.holds("straight_lines", linear);
}

const fn sine(period: f64) -> Profile {
    Profile::Sine { period, cycles: 12 }
}

fn same_to(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * b.abs()
}

/// Shares of the elements 1 to 8 of a touch at `at`, m.
fn shares(prototype: &Prototype<'_>, at: [f64; 2], radius: f64) -> Vec<f64> {
    let cover = SoftCover {
        thickness: prototype.array.description.depth(),
        base: Base::Rigid,
        contact: ContactPressure::Uniform(radius),
    };
    let (table, layout) = (cover.table(), prototype.array.layout());
    (0..layout.taxels())
        .map(|taxel| {
            let [x, y] = layout.flat_position(taxel);
            table.share(
                [x - at[0], y - at[1]],
                prototype.array.description.ceramic.side,
            )
        })
        .collect()
}

/// Sections 1 and 5: a shear force on the surface presses the elements in front of it and
/// pulls those behind.
fn shear(ours: &mut Ours, prototype: &Prototype<'_>) {
    let description = prototype.array.description;
    let cover = SoftCover {
        thickness: description.depth(),
        base: Base::Rigid,
        contact: ContactPressure::Uniform(2e-3),
    };
    let side = description.ceramic.side;
    let shares = |x: f64, y: f64| cover.shear_shares([x, y], side)[0];
    let (front, behind) = (shares(side, 0.0), shares(-side, 0.0));
    let beside = shares(0.0, side);
    let normal = cover.share([side, 0.0], side);
    let pattern = front > 0.0 && same_to(behind, -front, 1e-6) && beside.abs() < 1e-6 * front;
    for id in ["shear_picked_up", "shear_measured"] {
        ours.holds(id, pattern)
            .with("front", front)
            .with("normal", normal)
            .with("change", 50.0 * front / normal);
    }
}

/// A touch of figures 18 to 20.
struct DrawnTouch {
    place: &'static str,
    /// Where it is, in words.
    on: &'static str,
    /// Its middle and its radius, m.
    at: [f64; 2],
    radius: f64,
}

const TOUCHES: [DrawnTouch; 3] = [
    DrawnTouch {
        place: "Figure 18",
        on: "on sensel 1",
        at: [-6e-3, 2e-3],
        radius: 1.5e-3,
    },
    DrawnTouch {
        place: "Figure 19",
        on: "between sensels 2 and 6",
        at: [-2e-3, 0.0],
        radius: 2.5e-3,
    },
    DrawnTouch {
        place: "Figure 20",
        on: "between sensels 3, 4, 7 and 8, nearer to 3 and 4",
        at: [4e-3, 0.7e-3],
        radius: 3.5e-3,
    },
];

/// Side of a cell of a picture, m.
const MAP_CELL: f64 = 0.2e-3;

impl DrawnTouch {
    /// The silicone above the elements under the touch.
    fn cover(&self, prototype: &Prototype<'_>) -> SoftCover {
        SoftCover {
            thickness: prototype.array.description.depth(),
            base: Base::Rigid,
            contact: ContactPressure::Uniform(self.radius),
        }
    }

    /// Part (c) of the figure: the stress on the plane of the elements under 1 N.
    fn map(&self, prototype: &Prototype<'_>) -> StressMap {
        let layout = prototype.array.layout();
        let half = [layout.columns, layout.rows];
        let half: [f64; 2] =
            std::array::from_fn(|axis| 0.5 * layout.pitch[axis] * half[axis] as f64);
        let counts = half.map(|half| (2.0 * half / MAP_CELL).round() as usize);
        let from_touch = [0, 1].map(|axis| -half[axis] - self.at[axis]);
        let elements = (0..layout.taxels()).map(|taxel| {
            let centre = layout.flat_position(taxel);
            (centre, (taxel + 1).to_string())
        });
        StressMap {
            title: format!(
                "Stress on the plane of the elements under a touch {} with 1 N",
                self.on
            ),
            low: half.map(|half| -half),
            cell: MAP_CELL,
            columns: counts[0],
            stress: self.cover(prototype).base_stress(
                [0.0, 0.0, 1.0],
                from_touch,
                MAP_CELL,
                counts,
            ),
            elements: elements.collect(),
            element_side: prototype.array.description.ceramic.side,
            contacts: vec![(self.at, self.radius)],
        }
    }

    /// Pressure on the base along both rows of sensels, per newton.
    fn pressures(&self, prototype: &Prototype<'_>) -> Figure {
        let layout = prototype.array.layout();
        let cover = self.cover(prototype);
        let series = (0..layout.rows).map(|row| {
            let first = row * layout.columns;
            let y = layout.flat_position(first)[1];
            let points = (0..=180).map(|i| {
                let x = (f64::from(i) - 90.0) * 1e-4;
                let distance = (x - self.at[0]).hypot(y - self.at[1]);
                [x * 1e3, cover.base_pressure(distance) * 1e-3]
            });
            let name = format!("sensels {} to {}", first + 1, first + layout.columns);
            Series::new(name, points.collect(), Style::Line)
        });
        let chart = Chart {
            title: String::from("pressure on the base along the rows, per newton"),
            x: Axis::new("x", "mm"),
            y: Axis::new("pressure", "kPa/N"),
            series: series.collect(),
        };
        Figure::of(
            format!("Pressure under a touch {}", self.on),
            chart,
            "Even pressure over a disc on the silicone above the elements, by the transmission of a bonded layer. Pitch, radius \
             and depth are choices: the paper prints none. The sensels lie at -6, -2, 2 and 6 mm.",
        )
    }
}

/// Figures 18 to 21: elements that respond to a touch.
fn arrays(ours: &mut Ours, prototype: &Prototype<'_>) {
    let [first, gap, four] = [&TOUCHES[0], &TOUCHES[1], &TOUCHES[2]]
        .map(|touch| shares(prototype, touch.at, touch.radius));
    let alone = first[1..].iter().all(|share| *share < 0.1 * first[0]);
    ours.holds("figure_18", alone);
    let pair = (0..8).all(|i| i == 1 || i == 5 || gap[i] < 0.2 * gap[1]);
    ours.holds("figure_19", pair && same_to(gap[1], gap[5], 1e-6));
    let near = four[2].min(four[3]) > four[6].max(four[7]);
    let active = four[6].min(four[7]) > 3.0 * four[1].max(four[5]);
    ours.holds("figure_20", near && active);
    let strongest: Vec<usize> = (0..4)
        .map(|column| {
            let x = (f64::from(column) - 1.5) * 4e-3;
            let row = &shares(prototype, [x, 0.0], 2.5e-3)[..4];
            (0..4).fold(0, |best, i| if row[i] > row[best] { i } else { best })
        })
        .collect();
    ours.holds("figure_21", strongest == [0, 1, 2, 3]);
}

/// Gain of the thin sample over that of the thick one when a neo-Hookean layer carries the preload.
fn neo_hookean(both: [&Prototype<'_>; 2]) -> f64 {
    let [thin, thick] = both.map(|prototype| {
        let cover = &prototype.array.description.cover;
        let layer = SoftLayer {
            thickness: cover.thickness,
            modulus: cover.modulus,
            law: LayerLaw::NeoHookean,
        };
        let pressed = layer.preloaded(cover.preload, cover.preload_area);
        pressed.map_or(f64::NAN, |pressed| pressed.stiffness_per_area)
    });
    thin / thick
}

/// An element under the middle of the tester on the bonded layer: charge over that of d33 and
/// an even pressure.
struct Bonded {
    /// By d33 alone, the layer without the element.
    share: f64,
    /// With d31: in the middle of the layer, on the base, and in the middle of a layer that
    /// goes on and slides along the tester.
    middle: f64,
    base: f64,
    wide: f64,
    /// Over all that is not printed.
    interval: [f64; 2],
}

impl Bonded {
    fn new(prototype: &Prototype<'_>) -> Self {
        let description = prototype.array.description;
        let (cover, ceramic) = (&description.cover, &description.ceramic);
        let disc = BondedDisc {
            radius: (prototype.tester_area / PI).sqrt(),
            thickness: cover.thickness,
            rim: LayerRim::Flush,
            grip: DiscGrip::Gripped,
        };
        let setting = SeatedSetting {
            disc_area: prototype.tester_area,
            element_area: ceramic.side * ceramic.side,
            element_thickness: ceramic.thickness,
            thickness: cover.thickness,
        };
        let share = disc
            .pressed()
            .ok()
            .and_then(|pressed| pressed.share([0.0; 2], ceramic.side));
        let constants = description.charge_constants().unwrap_or([f64::NAN; 2]);
        let middle = 0.5 * cover.thickness;
        let of = |height, rim, grip| {
            let element = setting.element(height, rim, grip);
            element.map_or(f64::NAN, |element| {
                element.charge_per_force(constants) / constants[0]
            })
        };
        let interval = setting.charge_interval(constants);
        Self {
            share: share.unwrap_or(f64::NAN) * setting.disc_area / setting.element_area,
            middle: of(middle, LayerRim::Flush, DiscGrip::Gripped),
            base: of(0.5 * ceramic.thickness, LayerRim::Flush, DiscGrip::Gripped),
            wide: of(middle, LayerRim::Wide, DiscGrip::Slip),
            interval: interval
                .unwrap_or([f64::NAN; 2])
                .map(|charge| charge / constants[0]),
        }
    }
}

fn table_2(ours: &mut Ours, both: &[Prototype<'_>; 2]) {
    let step = [both[0].sum(&STEP), both[1].sum(&STEP)];
    let layers = [Bonded::new(&both[0]), Bonded::new(&both[1])];
    for (name, profile) in &PROFILES {
        let sums = [both[0].sum(profile), both[1].sum(profile)];
        for (sample, prototype) in both.iter().enumerate() {
            let force = prototype.tester_force(10.0 * prototype.smallest);
            let slope = sums[sample] / prototype.limit() / force;
            let bonded = &layers[sample];
            ours.number(&slope_id(name, sample), slope * bonded.share)
                .with("even", slope)
                .with("least", slope * bonded.interval[0])
                .with("greatest", slope * bonded.interval[1]);
            if *name != "step" {
                let id = format!("over_step_{name}_{}", SAMPLES[sample]);
                ours.number(&id, sums[sample] / step[sample])
                    .with("leak", prototype.array.element.leak_resistance * 1e-6);
            }
        }
        if *name == "step" {
            without_silicone(ours, &both[0], sums[0], layers[0].share);
        }
        let ratio = |of: fn(&Bonded) -> f64| of(&layers[0]) / of(&layers[1]);
        ours.number(&format!("over_thick_{name}"), ratio(|layer| layer.middle))
            .with("share", ratio(|layer| layer.share))
            .with("base", ratio(|layer| layer.base))
            .with("wide", ratio(|layer| layer.wide))
            .with("displacement", sums[0] / sums[1])
            .with("neo_hookean", neo_hookean([&both[0], &both[1]]));
    }
}

/// Figure 14: the tester stands on the elements themselves, which carry its whole force.
/// `sum` is the amplitude of a step through even silicone, V; `bonded` the share of an element
/// in the bonded layer over that of an even pressure.
fn without_silicone(ours: &mut Ours, prototype: &Prototype<'_>, sum: f64, bonded: f64) {
    let side = prototype.array.description.ceramic.side;
    let even = side * side / prototype.tester_area;
    let force = prototype.tester_force(10.0 * prototype.smallest);
    let slope = sum / prototype.limit() / force / even;
    let share = even * bonded;
    ours.holds("without_silicone", 0.25 * slope > 2.0 * slope * share)
        .with("one", 1.0 / share)
        .with("bonded", 100.0 * share)
        .with("one_slope", slope)
        .with("four_slope", 0.25 * slope)
        .with("end", 1.0 / slope);
}

fn conclusion(ours: &mut Ours, prototype: &Prototype<'_>) {
    ours.number("density", (10.0_f64 / 2.0).powi(2));
    let gain = prototype.array.output_per_force().at_frequency(2.39).norm();
    let noise = prototype.array.board.deviation() / gain * 1e3;
    ours.number("force_resolution", noise);
}

fn figures(ours: &mut Ours, both: &[Prototype<'_>; 2]) {
    ours.figure("Figure 5", figure_5(ours, &both[0]));
    for (place, index) in [("Figure 14", 0), ("Figure 15", 1), ("Figure 16", 2)] {
        ours.figure(place, amplitudes(both, index));
    }
    ours.figure("Figure 17", figure_17(ours, both));
    for touch in TOUCHES {
        let map = touch.map(&both[0]);
        let pictures = vec![(map.title.clone(), map.svg())];
        ours.figure_with(touch.place, touch.pressures(&both[0]), pictures);
    }
}

/// Assumptions of the figures beyond the paper.
fn assumed(prototype: &Prototype<'_>) -> String {
    let element = &prototype.array.element;
    format!(
        "Ramps of 10 ms, impact of 200 ms, cycles of 350 ms (the twelfth); leak of {:.0} Mohm, d33 of {:.0} pC/N, \
         linear preload",
        element.leak_resistance * 1e-6,
        element.charge_per_force * 1e12
    )
}

/// Voltage over time for five thicknesses.
fn figure_5(ours: &Ours, prototype: &Prototype<'_>) -> Figure {
    let element = printed_element(ours, STOCK_SHEET);
    let times: Vec<f64> = (0..=400).map(|i| f64::from(i) * 5e-5).collect();
    let series = [0.05e-3, 0.1e-3, 0.2e-3, 0.35e-3, 0.5e-3]
        .into_iter()
        .filter_map(|thickness| {
            let path = printed_column(ours, thickness);
            let chain = Chain::new(&element.voltage_per_displacement(path)).ok()?;
            let volts = chain.respond(&STEP.knots(10.0 * prototype.smallest), &times);
            let points = times.iter().zip(volts).map(|(t, v)| [t * 1e3, v * 1e6]);
            Some(Series::new(
                format!("t_e {} mm", thickness * 1e3),
                points.collect(),
                Style::Line,
            ))
        });
    let chart = Chart {
        title: String::from("voltage at the element for a step of 46.3 um"),
        x: Axis::new("time", "ms"),
        y: Axis::new("voltage", "uV"),
        series: series.collect(),
    };
    Figure::of(
        "Dependence on the thickness of the silicone",
        chart,
        "Per displacement of the surface, as Eq. 16 has it, not per force. Table 1 with d33 = 110 pC/N, E_e = 0.08 N/mm^2, a ceramic \
         of 0.127 mm and a ramp of 10 ms, which the paper does not print; with its R of 160 kohm the voltage follows the speed. \
         The axes of the printed figure carry no usable numbers.",
    )
}

/// A response over time, then the amplitudes against the displacement.
fn amplitudes(both: &[Prototype<'_>; 2], index: usize) -> Figure {
    let (name, profile) = PROFILES[index];
    let steps = if index == 2 { 6 } else { 10 };
    let mut charts = vec![response(both, &profile)];
    for (peak, label) in [(0, "A1"), (1, "A2")] {
        // A step has no second amplitude.
        if peak == 1 && index == 0 {
            continue;
        }
        let series = both.iter().zip(THICKNESSES).map(|(prototype, thickness)| {
            let points = (1..=steps).map(|n| {
                let displacement = f64::from(n) * prototype.smallest;
                let volts = prototype.peaks(&profile, displacement)[peak];
                [displacement * 1e6, volts / prototype.limit()]
            });
            Series::new(thickness, points.collect(), Style::Marks)
        });
        charts.push(Chart {
            title: format!("{label} over 3 V"),
            x: Axis::new("displacement", "um"),
            y: Axis::new(label, ""),
            series: series.collect(),
        });
    }
    Figure {
        title: format!("Response to the {name} input"),
        charts,
        caption: format!(
            "{}. Displacements from D to {steps} D. The paper draws the amplitudes against the load; per force the two thicknesses \
             coincide in this model, per displacement the thinner one answers more. The case without silicone is left out: it has no model.",
            assumed(&both[0])
        ),
    }
}

fn response(both: &[Prototype<'_>; 2], profile: &Profile) -> Chart {
    let end = profile
        .knots(1.0)
        .last()
        .map_or(1.0, |knot| knot[0])
        .min(1.5)
        + 0.6;
    let times: Vec<f64> = (0..=600).map(|i| end * f64::from(i) / 600.0).collect();
    let series = both
        .iter()
        .zip(THICKNESSES)
        .filter_map(|(prototype, thickness)| {
            let chain =
                Chain::new(&prototype.array.output_per_displacement(prototype.path)).ok()?;
            let volts = chain.respond(&profile.knots(5.0 * prototype.smallest), &times);
            let points = times.iter().zip(volts).map(|(t, v)| [*t, -v * 1e3]);
            Some(Series::new(thickness, points.collect(), Style::Line))
        });
    Chart {
        title: String::from("response to 5 D"),
        x: Axis::new("time", "s"),
        y: Axis::new("output, loading upwards", "mV"),
        series: series.collect(),
    }
}

/// Amplitude over 3 V against the load of the tester at D, 2 D, ….
fn line(prototype: &Prototype<'_>, name: &str, amplitude: impl Fn(f64) -> f64) -> Series {
    let points = (1..=10).map(|n| {
        let displacement = f64::from(n) * prototype.smallest;
        let share = amplitude(displacement) / prototype.limit();
        [prototype.tester_force(displacement), share]
    });
    Series::new(name, points.collect(), Style::Line)
}

fn figure_17(ours: &Ours, both: &[Prototype<'_>; 2]) -> Figure {
    let charts = both
        .iter()
        .zip(THICKNESSES)
        .enumerate()
        .map(|(index, (prototype, thickness))| {
            let mut series = Vec::new();
            for (name, profile) in &PROFILES {
                let sum = |displacement: f64| prototype.peaks(profile, displacement).iter().sum();
                series.push(line(prototype, name, sum));
                let end = prototype.tester_force(10.0 * prototype.smallest);
                let slope = ours.printed(&slope_id(name, index), 0);
                let printed = vec![[0.0, 0.0], [end, slope * end]];
                series.push(Series::new(
                    format!("{name}, table 2"),
                    printed,
                    Style::Dashed,
                ));
            }
            Chart {
                title: String::from(thickness),
                x: Axis::new("load on 100 mm^2", "N"),
                y: Axis::new("(A1 + A2) over 3 V", ""),
                series,
            }
        });
    Figure {
        title: String::from("Sum of the amplitudes for all inputs"),
        charts: charts.collect(),
        caption: format!(
            "{}. Dashed: the measured slopes of table 2. The gain is not printed, so only the ratios of the lines can be compared.",
            assumed(&both[0])
        ),
    }
}
