//! P3: the piezoelectric array in silicone.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::Basis::{Input, Ours, Printed};
use super::Ledger;
use crate::device::{Drive, PiezoelectricArray, PiezoelectricPredictor};
use crate::electronics::{ChargeMode, FirstOrderFilter, Output, Readout};
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::mechanics::{Base, Contact, Plate, Profile, SoftCover, bending_stiffness};
use crate::sensor::Sensor;
use crate::transduction::{
    Ceramic, PiezoelectricElement, PiezoelectricLaw, SiliconePath, VACUUM_PERMITTIVITY,
};
use taxel_numerics::linear_chain::{Chain, Transfer};

/// D of figures 11 to 13, m.
const SMALLEST: f64 = 4.63e-6;
/// Area on which the tester presses, m².
const TESTER_AREA: f64 = 100e-6;
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

/// Slopes of table 2 for 1.5 and 2.3 mm, in the order of [`PROFILES`].
const SLOPES: [[(&str, f64); 2]; 3] = [
    [("0.0778", 0.0778), ("0.0695", 0.0695)],
    [("0.1208", 0.1208), ("0.1086", 0.1086)],
    [("0.1014", 0.1014), ("0.0902", 0.0902)],
];
const THICKNESSES: [&str; 2] = ["1.5 mm", "2.3 mm"];
const ASSUMED: &str = "Ramps of 10 ms, impact of 200 ms, cycles of 350 ms (the twelfth); leak of 276 Mohm, d33 of 650 pC/N, \
                       linear preload";

/// One of the two prototypes.
struct Prototype<'a> {
    array: &'a PiezoelectricArray<'a>,
    predictor: PiezoelectricPredictor,
    path: SiliconePath,
    thickness: f64,
    /// The filter that section 2.4 names.
    filter: FirstOrderFilter,
}

impl<'a> Prototype<'a> {
    fn new(array: &'a PiezoelectricArray<'a>) -> Option<Self> {
        Some(Self {
            predictor: PiezoelectricPredictor::new(array),
            path: array.path().ok()?,
            thickness: array.description.preloaded().ok()?.thickness,
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
        let [first, second] = self.peaks(profile, 10.0 * SMALLEST);
        first + second
    }

    /// Voltage to which the paper refers its signals, V.
    fn limit(&self) -> f64 {
        self.array.board.output.limit
    }

    /// Force on the whole area of the tester, N.
    fn tester_force(&self, displacement: f64) -> f64 {
        let cover = &self.array.description.cover;
        self.path.stiffness * displacement * TESTER_AREA / cover.column_area
    }
}

pub(super) fn fill(ledger: &mut Ledger) {
    let sensors = ["piezo-1.5mm", "piezo-2.3mm"].map(Sensor::shipped);
    let [Some(thin), Some(thick)] = &sensors else {
        return;
    };
    let (Ok(thin), Ok(thick)) = (thin.piezoelectric(), thick.piezoelectric()) else {
        return;
    };
    let (Some(thin), Some(thick)) = (Prototype::new(&thin), Prototype::new(&thick)) else {
        return;
    };
    let both = [thin, thick];
    introduction(ledger);
    inputs(ledger, &both);
    element_equations(ledger, &both[0]);
    law_equations(ledger);
    chain_equations(ledger, &both[0]);
    table_1(ledger, &both[0]);
    smallest_deformation(ledger, &both[0]);
    plate_equations(ledger);
    conditioning(ledger, &both[0]);
    experiments(ledger, &both);
    results(ledger, &both);
    arrays(ledger, &both[0]);
    table_2(ledger, &both);
    conclusion(ledger, &both[0]);
    figures(ledger, &both);
}

/// Whether two numbers agree to rounding.
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

fn introduction(ledger: &mut Ledger) {
    let slopes = SLOPES.iter().flatten().map(|(_, slope)| *slope);
    let least = slopes.clone().fold(f64::INFINITY, f64::min);
    ledger
        .number(
            "Abstract",
            "least sensitivity, normalised to 3 V, per N",
            "0.07",
            least,
            Printed,
        )
        .note("table 2");
    ledger
        .number(
            "Abstract",
            "greatest sensitivity",
            "0.12",
            slopes.fold(0.0, f64::max),
            Printed,
        )
        .note("table 2");
    ledger
        .number(
            "Section 1",
            "sensitivity of piezoelectric elements, low end",
            "15 nm/V",
            0.11,
            Printed,
        )
        .contradicts(
            "the 110 of table 1, read as pC/N, is 0.11 nm/V; the maker's 650 pC/N is 0.65 nm/V",
        );
    ledger
        .number(
            "Section 1",
            "sensitivity of piezoelectric elements, high end",
            "65 nm/V",
            0.65,
            Printed,
        )
        .contradicts("as above: a ceramic moves less than a nanometre per volt");
}

/// Currents at the element while the surface rises: K x′, C V′ and V/R.
fn currents(prototype: &Prototype<'_>) -> Option<[f64; 3]> {
    let element = &prototype.array.element;
    let voltage = Chain::new(&element.voltage_per_displacement(prototype.path)).ok()?;
    let compression = Chain::new(&element.compression_per_displacement(prototype.path)).ok()?;
    let knots = STEP.knots(SMALLEST);
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

fn element_equations(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    let (element, path) = (&prototype.array.element, prototype.path);
    let compression = at_rest(&element.compression_per_displacement(path));
    let force = path.stiffness * (1.0 - compression);
    ledger
        .statement(
            "Eq. 1",
            "compression of the ceramic x = F/k",
            "x = F/k",
            same(compression, force / element.stiffness),
            Ours,
        )
        .note("the force through the silicone at rest");
    let charge = at_rest(&element.charge_per_displacement(path));
    let constant = element.charge_per_compression();
    ledger
        .statement(
            "Eq. 2",
            "charge",
            "q = K x",
            same(charge, constant * compression),
            Ours,
        )
        .note("K = d33 k_p");
    ledger
        .statement(
            "Eq. 3",
            "direct effect",
            "q = (K/k) F",
            same(charge / force, element.charge_per_force),
            Ours,
        )
        .note("K/k in C/N is d33, not e33");
    let farad = VACUUM_PERMITTIVITY * 3138.0 * 4e-6 / 0.127e-3;
    ledger
        .statement("Eq. 4", "capacitance of the element", "C_s = eps0 eps_r A/t", (farad * 1e12).round() == 875.0, Ours)
        .note("eps_r = 3138 at 0.127 mm gives the measured 875 pF; the names of eps0 and eps_r are shifted in the text");
    let [source, capacitor, leak] = currents(prototype).unwrap_or([f64::NAN; 3]);
    // Central differences over 0.1 ms of a signal that leaks in 0.24 s.
    let balance = |a: f64, b: f64| (a - b).abs() < 1e-6 * source.abs();
    ledger
        .statement(
            "Eq. 5",
            "current of the source",
            "i_s = dq/dt = K dx/dt",
            balance(source, capacitor + leak),
            Ours,
        )
        .note("against the currents through C and R, in the middle of a ramp");
    ledger
        .statement(
            "Eq. 6",
            "Kirchhoff's law, first half",
            "i_s = i_c - i_R",
            balance(source, capacitor - leak),
            Ours,
        )
        .contradicts("its second half, i_c = i_s - i_R");
    ledger.statement(
        "Eq. 6",
        "Kirchhoff's law, second half",
        "i_c = i_s - i_R",
        balance(capacitor, source - leak),
        Ours,
    );
    ledger.statement(
        "Eq. 7",
        "voltage at the amplifier",
        "C dV/dt = K dx/dt - V/R",
        balance(capacitor, source - leak),
        Ours,
    );
    let tau = element.time_constant();
    let sensitivity = constant / element.capacitance;
    let formula = |s: Complex64| sensitivity * tau * s / (tau * s + 1.0);
    ledger
        .statement(
            "Eq. 8",
            "voltage per compression G1",
            "K_s tau s/(tau s + 1)",
            same_at(&element.voltage_per_compression(), formula),
            Ours,
        )
        .note("per compression of the ceramic");
}

/// Eqs. 9 to 11.
fn law_equations(ledger: &mut Ledger) {
    let law = PiezoelectricLaw {
        stiffness: [1.2e11, 0.8e11, 1.1e11],
        piezoelectric: [-6.0, 20.0],
        permittivity: 1.5e-8,
    };
    let field = law.respond(0.0, 0.0, 1e3);
    let strain = law.respond(1e-5, 2e-5, 0.0);
    let y = same(strain.stress_y, 1.2e6 + 1.6e6) && same(field.stress_y, 6e3);
    let z = same(strain.stress_z, 0.8e6 + 2.2e6) && same(field.stress_z, -20e3);
    ledger
        .statement(
            "Eq. 9",
            "stress along y",
            "c11 e_y + c31 e_z - e31 E_z",
            y,
            Ours,
        )
        .note("c are stiffnesses, not compliances");
    ledger.statement(
        "Eq. 10",
        "stress along z",
        "c31 e_y + c33 e_z - e33 E_z",
        z,
        Ours,
    );
    ledger
        .statement("Eq. 11", "electric displacement", "e13 e_y + e33 e_z - lambda33 E_z", field.electric_displacement < 0.0, Ours)
        .contradicts("(9) and (10) with their signs have D = e31 e_y + e33 e_z + eps33 E_z; with a minus the permittivity would be negative");
}

/// Eqs. 12 to 17.
fn chain_equations(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    let (element, path) = (&prototype.array.element, prototype.path);
    let compression = at_rest(&element.compression_per_displacement(path));
    let equivalent = element.stiffness + path.stiffness;
    // Static x2/x1 of a vanishing ceramic stiffness by the printed (13).
    let soft = PiezoelectricElement {
        stiffness: 1e-9 * path.stiffness,
        ..*element
    };
    let printed = 2.0 * path.stiffness / (soft.stiffness + path.stiffness);
    let ours = at_rest(&soft.compression_per_displacement(path));
    ledger
        .statement(
            "Eq. 12",
            "force on the silicone",
            "F = -b_s x1' - k_s x1",
            same(-path.stiffness, path.stiffness * (1.0 - compression)),
            Ours,
        )
        .contradicts(
            "(13), where the silicone between x1 and x2 carries b_s (x1' - x2') + k_s (x1 - x2)",
        );
    ledger
        .statement(
            "Eq. 13",
            "motion of the ceramic",
            "terms with x2 - x1 and with x1",
            same(printed, ours),
            Ours,
        )
        .contradicts(
            "it holds the force of the silicone twice: without a ceramic x2 would be 2 x1",
        );
    ledger
        .statement(
            "Eq. 14",
            "equivalent damping and stiffness",
            "b_p - b_s, k_p - k_s",
            same(element.stiffness - path.stiffness, equivalent),
            Printed,
        )
        .contradicts("(13), from which b_p + b_s and k_p + k_s follow");
    let transfer = element.compression_per_displacement(path);
    let (w, zeta) = (element.natural_frequency(path), element.damping_ratio(path));
    let standard = |s: Complex64| {
        w * w / equivalent * (path.damping * s + path.stiffness)
            / (s * s + 2.0 * zeta * w * s + w * w)
    };
    let as_printed = |s: Complex64| standard(s) * (2.0 / (w * w));
    ledger
        .statement(
            "Eq. 15",
            "compression per displacement G2",
            "(2/k_eq)(b_s s + k_s)/(s^2 + 2 zeta w_n s + w_n^2)",
            same_at(&transfer, as_printed),
            Ours,
        )
        .contradicts(
            "G2 has no unit; (w_n^2/k_eq) in place of (2/k_eq) makes it so and agrees with ours",
        );
    let product = element.voltage_per_compression().then(&transfer);
    let whole = element.voltage_per_displacement(path);
    ledger
        .statement(
            "Eq. 16",
            "voltage per displacement",
            "G = G1 G2",
            same_at(&whole, |s| product.at(s)),
            Ours,
        )
        .note("V/X1 = V/X2 X2/X1; printed with V/X1 X1/X2, and with the factors of (15)");
    let column = SiliconePath::of_layer(80e3, 10.0, 4e-6, prototype.thickness);
    let holds = same(column.stiffness, path.stiffness) && same(column.damping, path.damping);
    ledger.statement(
        "Eq. 17",
        "silicone column",
        "b_s = mu A_e/t_e, k_s = E_e A_e/t_e",
        holds,
        Ours,
    );
}

/// The element of table 1, its charge read as 110e-12 C/N; the thickness of
/// the ceramic, m, is not printed.
fn printed_element(thickness: f64) -> PiezoelectricElement {
    let ceramic = Ceramic {
        area: 4e-6,
        thickness,
        modulus: 8e9,
        density: 7800.0,
        damping_ratio: 1.0,
    };
    PiezoelectricElement::new(&ceramic, 110e-12, 610e-12, 160e3)
}

fn table_1(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    let element = printed_element(0.127e-3);
    ledger
        .number("Table 1", "e33", "110e9 C/N", 110e-12, Printed)
        .contradicts("u_zmin = 0.027 nm of section 2.3, which follows from 110e-12 C/N; a charge per force is d33");
    ledger
        .number(
            "Table 1",
            "modulus of the ceramic E_p",
            "8e9 N/m^2",
            prototype.array.description.ceramic.modulus,
            Ours,
        )
        .not_determined(
            "the maker's sheet of PSI-5H4E says 50 GPa; 8 GPa is what 0.027 nm was computed with",
        );
    ledger
        .number("Table 1", "area A", "4e-6 m^2", 2e-3_f64.powi(2), Printed)
        .note("2 x 2 mm");
    let fitted = prototype.array.element.leak_resistance * 1e-3;
    ledger
        .number("Table 1", "resistance R", "160 kohm", fitted, Ours)
        .contradicts("impact/step and cyclic/step of table 2: with 160 kohm both ratios are 2.000; tau = 0.242 s fits both");
    ledger
        .number("Table 1", "capacitance C", "610 pF", 875.0, Printed)
        .contradicts("875 pF, the measured mean of three in section 2.4");
    ledger
        .number(
            "Table 1",
            "damping ratio Z",
            "1",
            prototype.array.description.ceramic.damping_ratio,
            Input,
        )
        .note("read as zeta. The maker's Q of 32 would be 0.0156");
    let w = (element.stiffness / element.mass).sqrt();
    ledger
        .number("Table 1", "natural frequency w_n", "63", w, Printed)
        .contradicts("E_p and A of the same table with any stock thickness give 5e6 to 8e6 rad/s; this is 0.127 mm");
    ledger
        .number(
            "Table 1",
            "modulus of the silicone E_e",
            "8e6 N/m^2",
            0.08e6,
            Printed,
        )
        .contradicts("0.08 N/mm^2 of section 3.3, a hundredth of it");
    ledger
        .number(
            "Table 1",
            "M",
            "10",
            prototype.array.description.cover.viscosity,
            Input,
        )
        .note("read as the viscosity mu, Pa s");
    ledger.number(
        "Table 1",
        "area A_e",
        "4e-6 m^2",
        prototype.array.description.cover.column_area,
        Input,
    );
    ledger
        .statement(
            "Table 1",
            "thickness t_e",
            "0.05-0.5 mm",
            (0.05e-3..=0.5e-3).contains(&prototype.thickness),
            Ours,
        )
        .contradicts("1 mm and 1.11 mm in section 3.3");
}

/// Numbers of section 2.3.
fn smallest_deformation(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    let least = |thickness: f64| {
        610e-12 * 1.2e-3 / printed_element(thickness).charge_per_compression() * 1e9
    };
    ledger
        .number("Section 2.3", "smallest deformation u_zmin", "0.027 nm", least(0.127e-3), Printed)
        .not_determined(format!(
            "C dV/(d33 k_p) with table 1 and 110e-12 C/N needs the thickness of the ceramic: 0.127 mm, a stock sheet, gives ours, \
             0.130 mm gives {:.4} nm. It is a compression of the ceramic, not a motion of the surface",
            least(0.130e-3)
        ));
    let step = prototype.array.board.step() * 1e3;
    ledger
        .number(
            "Section 2.3",
            "smallest voltage difference",
            "1.2 mV",
            step,
            Ours,
        )
        .note("14 bits over -10 to 10 V, as the converter named in section 3.2 has them");
}

fn plate_equations(ledger: &mut Ledger) {
    // Any signal of element 1 and the step of the converter, V.
    let (first, step) = (0.1, 1.2e-3);
    let second = first - step;
    ledger
        .statement(
            "Eq. 18",
            "difference of neighbours",
            "V1 - V2 = dV",
            same(first - second, step),
            Printed,
        )
        .note("a definition: V2 = V1 - dV");
    ledger
        .statement("Eq. 19", "balance of element 2", "C d(V1 + dV)/dt = K du/dt - (V1 + dV)/R", same(first + step, second), Printed)
        .contradicts("(18): V2 is V1 - dV. It also takes the deflection of the plate as the compression of the ceramic, which is 2e-7 of it");
    let (k, c, r, rate) = (1.0, 875e-12, 276e6, 5.0);
    let solved = (c * rate + (first + step) / r) / k;
    let back = k * solved - (first + step) / r;
    ledger
        .statement(
            "Eq. 20",
            "the same, solved for du/dt",
            "(1/K)(C d(V1 + dV)/dt + (V1 + dV)/R)",
            same(back, c * rate),
            Printed,
        )
        .note("follows from (19) and inherits its sign");
    let plate = Plate {
        bending_stiffness: bending_stiffness(8e4, 1e-3, 0.5),
        mass_per_area: 1.07,
        damping: 200.0,
    };
    ledger
        .statement("Eq. 21", "plate equation", "m u_tt + beta u_t + D lap^2 u = q", plate_residual(&plate) < 1e-3, Ours)
        .note("our impulse response satisfies it by differences over 20 um and 2 us, to 1e-3 of its largest term");
    ledger
        .statement(
            "Eq. 22",
            "bending stiffness",
            "D = E t^3/(12 (1 - nu^2))",
            same(plate.bending_stiffness, 8e4 * 1e-9 / 9.0),
            Ours,
        )
        .note("nu = 1/2");
    // The momentum of the plate after a unit impulse, by the printed factor.
    let factor = 4.0 * std::f64::consts::PI.powi(2) / TAU.sqrt();
    ledger
        .statement("Eq. 23", "impulse response", "1/(m sqrt(2 pi)) times the integral over k", same(factor, 1.0), Ours)
        .contradicts(format!(
            "(21): the plate would get {factor:.2} times the impulse; the factor is 1/(4 pi^2 m), and k^2 = kx^2 + ky^2, not k"
        ));
    ledger
        .statement("Eq. 24", "smallest distance", "du/dt(x_min) = (1/K)(C d(V1 + dV)/dt + (V1 + dV)/R)", same(first + step, second), Printed)
        .contradicts("(18), as (19). It gives no useful distance: the difference is reached within micrometres, and the plate is not the mounted sensor");
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
fn inputs(ledger: &mut Ledger, [thin, thick]: &[Prototype<'_>; 2]) {
    let (array, cover) = (&thin.array, &thin.array.description.cover);
    let layout = array.layout();
    let limit = thin.limit();
    let filter = thin.filter;
    for (place, what, printed, ours) in [
        (
            "Section 1",
            "columns of the array",
            "4",
            layout.columns as f64,
        ),
        ("Section 1", "rows of the array", "2", layout.rows as f64),
        (
            "Figure 1",
            "side of an element",
            "2 mm",
            array.description.ceramic.side * 1e3,
        ),
        (
            "Section 2.4",
            "R_f",
            "390 kohm",
            filter.feedback_resistance * 1e-3,
        ),
        (
            "Section 2.4",
            "R_i'",
            "82 kohm",
            filter.input_resistance * 1e-3,
        ),
        (
            "Section 2.4",
            "C_f",
            "47 nF",
            filter.feedback_capacitance * 1e9,
        ),
        (
            "Section 3.3",
            "preload of the 1.5 mm sample",
            "2.68 N",
            cover.preload,
        ),
        (
            "Section 3.3",
            "preload of the 2.3 mm sample",
            "4.2 N",
            thick.array.description.cover.preload,
        ),
        (
            "Section 3.3",
            "modulus of the silicone",
            "0.08 N/mm^2",
            cover.modulus * 1e-6,
        ),
        (
            "Section 3.3",
            "contact area",
            "100 mm^2",
            cover.preload_area * 1e6,
        ),
        (
            "Section 3.3",
            "smallest displacement D",
            "4.63 um",
            SMALLEST * 1e6,
        ),
        (
            "Section 4.1",
            "largest input of the converter",
            "3 V",
            limit,
        ),
    ] {
        ledger.number(place, what, printed, ours, Input);
    }
}

fn conditioning(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    let element = &prototype.array.element;
    let filter = prototype.filter;
    let charge_mode = ChargeMode {
        feedback_resistance: filter.feedback_resistance,
        feedback_capacitance: filter.feedback_capacitance,
        open_loop_gain: 1e4,
        filter: None,
        output: Output::IDEAL,
    };
    let voltage = element.charge_per_force / element.capacitance;
    let fast = element
        .voltage_per_force()
        .at_frequency(1e4 / element.time_constant())
        .norm();
    ledger
        .statement(
            "Eq. 25",
            "voltage mode",
            "V_e = Q_p/(C_p + C_c + C_i)",
            (fast / voltage - 1.0).abs() < 1e-6,
            Ours,
        )
        .note("above the corner of the leak, 0.66 Hz");
    ledger.number(
        "Section 2.4",
        "capacitance of the element C_p",
        "875 pF",
        element.capacitance * 1e12,
        Input,
    );
    let band = charge_mode.band(element.capacitance, element.leak_resistance);
    let above = band.transfer().at_frequency(1e3 * 8.68).norm() * filter.feedback_capacitance;
    ledger
        .statement("Eq. 26", "charge mode", "V_s = -Q_p/C_f", (above - 1.0).abs() < 1e-3, Ours)
        .note("above its corner; a gain of 1e4 changes it by 0.01 %. It would give a signal 250 times smaller than the voltage mode");
    let tau = filter.time_constant();
    let formula = |s: Complex64| -390.0 / 82.0 / (1.0 + s * tau);
    ledger.statement(
        "Eq. 27",
        "low-pass",
        "-(R_f/R_i')/(1 + j w tau_f)",
        same_at(&filter.transfer(), formula),
        Ours,
    );
    ledger.number(
        "Section 2.4",
        "least gain of the amplifier, 80 dB",
        "1e4",
        10.0_f64.powf(80.0 / 20.0),
        Printed,
    );
    ledger
        .number(
            "Section 2.4",
            "static gain",
            "4.75",
            -filter.gain(),
            Printed,
        )
        .contradicts("R_f/R_i' = 390/82 = 4.756");
    ledger
        .number(
            "Section 2.4",
            "cut-off frequency",
            "8.67 Hz",
            1.0 / (TAU * tau),
            Printed,
        )
        .contradicts("1/(2 pi R_f C_f) with 390 kohm and 47 nF is 8.683 Hz");
}

fn experiments(ledger: &mut Ledger, [thin, thick]: &[Prototype<'_>; 2]) {
    ledger
        .open("Section 3.1", "spin-coated layers", "0.375 mm")
        .not_determined("two of them are 0.75 mm; how 1.5 and 2.3 mm come about is not described");
    ledger
        .open("Section 3.2", "accuracy of the drive", "3.7 nm")
        .not_determined("nothing here depends on it");
    ledger
        .number(
            "Section 3.3",
            "preloaded thickness, 1.5 mm under 2.68 N",
            "1 mm",
            thin.thickness * 1e3,
            Ours,
        )
        .note("t0 (1 - P/(A E)) with 0.08 N/mm^2 and 100 mm^2");
    ledger
        .number(
            "Section 3.3",
            "preloaded thickness, 2.3 mm under 4.2 N",
            "1.11 mm",
            thick.thickness * 1e3,
            Ours,
        )
        .contradicts("4.2 N, 0.08 N/mm^2 and 100 mm^2 give 1.0925 mm");
    ledger
        .number(
            "Section 4.1",
            "largest displacement, 10 D",
            "46 um",
            10.0 * SMALLEST * 1e6,
            Printed,
        )
        .note("D = 4.63 um");
    ledger
        .number(
            "Section 4.1",
            "slowest cycles, period 500 ms",
            "2 Hz",
            1.0 / 0.5,
            Printed,
        )
        .note("");
    ledger
        .number(
            "Section 4.1",
            "fastest cycles, period 200 ms",
            "5 Hz",
            1.0 / 0.2,
            Printed,
        )
        .note("");
}

fn results(ledger: &mut Ledger, [thin, thick]: &[Prototype<'_>; 2]) {
    let ratio = thin.sum(&STEP) / thick.sum(&STEP);
    ledger.number("Figures 14-16", "trend of the thick sample, t_e times", "1.1", ratio, Ours)
        .note("per displacement, by the preloaded thicknesses; per force the thickness is not in the signal");
    ledger
        .number(
            "Section 4.1",
            "change of steepness with the thickness",
            "10 %",
            (ratio - 1.0) * 100.0,
            Ours,
        )
        .note("per displacement; table 2 gives 12.0, 11.2, 12.4 %, a neo-Hookean preload 12.6 %");
    let [first, second] = thin.peaks(&STEP, SMALLEST);
    ledger
        .statement(
            "Section 4.1",
            "a step has one amplitude",
            "A1",
            second < 0.01 * first,
            Ours,
        )
        .note("");
    let [first, second] = thin.peaks(&IMPACT, SMALLEST);
    ledger
        .statement(
            "Section 4.1",
            "an impact is asymmetric",
            "A1 and A2 differ",
            first > 1.2 * second,
            Ours,
        )
        .note("A1 > A2: the signal has leaked when the load leaves");
    let [first, second] = thin.peaks(&CYCLIC, SMALLEST);
    ledger
        .statement(
            "Figure 16",
            "cycles become symmetric",
            "A1 = A2 after the first",
            same_to(first, second, 1e-3),
            Ours,
        )
        .note("to 0.3 % in the fifth cycle, 0.02 % in the seventh");
    let higher = PROFILES
        .iter()
        .all(|(_, profile)| thin.sum(profile) > thick.sum(profile));
    ledger
        .statement(
            "Section 4.1",
            "the thinner layer answers more",
            "in each case",
            higher,
            Ours,
        )
        .note("per displacement");
    let change = thin.sum(&cycles(0.5)) / thin.sum(&cycles(0.2));
    ledger
        .statement("Section 4.1", "cycles of 2-5 Hz", "no changes in the amplitude", same_to(change, 1.0, 0.05), Ours)
        .not_determined(format!(
            "the form of the cycles is not printed: ramps of 10 ms give a factor {change:.2} from 5 to 2 Hz, sines {:.2}",
            thin.sum(&sine(0.5)) / thin.sum(&sine(0.2))
        ));
    let order = thin.sum(&STEP) < thin.sum(&CYCLIC) && thin.sum(&CYCLIC) < thin.sum(&IMPACT);
    ledger
        .statement(
            "Figure 17",
            "order of the sums",
            "step < cyclic < impact",
            order,
            Ours,
        )
        .note("");
    let linear = (thin.sum(&STEP) / (10.0 * thin.peaks(&STEP, SMALLEST)[0]) - 1.0).abs() < 0.01;
    ledger
        .statement(
            "Figures 14-17",
            "amplitude against load",
            "straight lines",
            linear,
            Ours,
        )
        .note("our chain is linear");
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
        contact: Contact::Uniform(radius),
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

/// Figures 18 to 21: which elements feel a touch.
fn arrays(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    let note = "pitch 4 mm, 0.75 mm of silicone above the elements: both are choices";
    let first = shares(prototype, [-6e-3, 2e-3], 1.5e-3);
    let alone = first[1..].iter().all(|share| *share < 0.1 * first[0]);
    ledger
        .statement(
            "Figure 18",
            "touch on sensel 1",
            "only sensel 1 is active",
            alone,
            Ours,
        )
        .note(note);
    let gap = shares(prototype, [-2e-3, 0.0], 2.5e-3);
    let pair = (0..8).all(|i| i == 1 || i == 5 || gap[i] < 0.2 * gap[1]);
    ledger
        .statement(
            "Figure 19",
            "touch between sensels 2 and 6",
            "2 and 6 are active",
            pair && same_to(gap[1], gap[5], 1e-6),
            Ours,
        )
        .note(note);
    let four = shares(prototype, [4e-3, 0.7e-3], 3.5e-3);
    let near = four[2].min(four[3]) > four[6].max(four[7]);
    let active = four[6].min(four[7]) > 3.0 * four[1].max(four[5]);
    ledger
        .statement(
            "Figure 20",
            "touch between 3, 4, 7, 8, nearer to 3 and 4",
            "these four, 3 and 4 higher",
            near && active,
            Ours,
        )
        .note(note);
    let strongest: Vec<usize> = (0..4)
        .map(|column| {
            let x = (f64::from(column) - 1.5) * 4e-3;
            let row = &shares(prototype, [x, 0.0], 2.5e-3)[..4];
            (0..4).fold(0, |best, i| if row[i] > row[best] { i } else { best })
        })
        .collect();
    ledger.statement("Figure 21", "slider from column 1/5 to 4/8", "activation in this order", strongest == [0, 1, 2, 3], Ours)
        .note("which of the two sensels of a column comes first depends on irregularities of the slider, not on anything printed");
}

fn table_2(ledger: &mut Ledger, both: &[Prototype<'_>; 2]) {
    for ((name, profile), slopes) in PROFILES.iter().zip(SLOPES) {
        for ((prototype, (printed, _)), thickness) in both.iter().zip(slopes).zip(THICKNESSES) {
            let force = prototype.tester_force(10.0 * SMALLEST);
            let slope = prototype.sum(profile) / prototype.limit() / force;
            ledger
                .number("Table 2", &format!("slope a of {name}, {thickness}, per N of the tester"), printed, slope, Ours)
                .not_determined("the gain is not printed: d33, the capacitance at work and the share of the load on the element. Ours shares the load over 100 mm^2");
        }
    }
    for (index, thickness) in THICKNESSES.into_iter().enumerate() {
        for kind in [1, 2] {
            let name = PROFILES[kind].0;
            let ratio = SLOPES[kind][index].1 / SLOPES[0][index].1;
            let ours = both[index].sum(&PROFILES[kind].1) / both[index].sum(&STEP);
            ledger
                .number("Table 2", &format!("{name}/step, {thickness}, from the slopes"), &format!("{ratio:.2}"), ours, Ours)
                .not_determined("ramps and times of the profiles; one leak of 276 Mohm was fitted to all four ratios");
        }
    }
    for ((name, profile), slopes) in PROFILES.iter().zip(SLOPES) {
        let printed = slopes[0].1 / slopes[1].1;
        let ours = both[0].sum(profile) / both[1].sum(profile);
        ledger
            .number("Table 2", &format!("1.5 mm/2.3 mm, {name}, from the slopes"), &format!("{printed:.2}"), ours, Ours)
            .not_determined("the law of the silicone at strains of 34 and 53 %: the linear one of the paper gives ours, a neo-Hookean one 1.126. The slopes are per force, where this model gives 1.00");
    }
    ledger
        .open("Table 2", "least R^2", "0.9984")
        .not_determined("noise and scatter of the tests are not described");
}

fn conclusion(ledger: &mut Ledger, prototype: &Prototype<'_>) {
    ledger
        .number(
            "Section 5",
            "density with sensels of 1.5 mm",
            "25 sensels/cm^2",
            (10.0_f64 / 2.0).powi(2),
            Printed,
        )
        .note("a pitch of 2.0 mm, gaps of 0.5 mm");
    let gain = prototype.array.output_per_force().at_frequency(2.39).norm();
    let noise = prototype.array.board.deviation() / gain * 1e3;
    ledger.number("Section 5", "force resolution", "50 mN", noise, Ours)
        .not_determined("noise and place of the load; ours is one deviation of one reading, of the force on one element");
    ledger
        .open("Section 5", "stretch", "300 %")
        .not_determined("nothing here models stretching");
    ledger
        .open("Section 5", "thickness of the electrodes", "100 um")
        .not_determined("not part of the electrical model");
}

fn figures(ledger: &mut Ledger, both: &[Prototype<'_>; 2]) {
    ledger.figure("Figure 5", figure_5());
    for (place, index) in [("Figure 14", 0), ("Figure 15", 1), ("Figure 16", 2)] {
        ledger.figure(place, amplitudes(both, index));
    }
    ledger.figure("Figure 17", figure_17(both));
}

/// Voltage over time for five thicknesses.
fn figure_5() -> Figure {
    let element = printed_element(0.127e-3);
    let times: Vec<f64> = (0..=400).map(|i| f64::from(i) * 5e-5).collect();
    let series = [0.05e-3, 0.1e-3, 0.2e-3, 0.35e-3, 0.5e-3]
        .into_iter()
        .filter_map(|thickness| {
            let path = SiliconePath::of_layer(8e4, 10.0, 4e-6, thickness);
            let chain = Chain::new(&element.voltage_per_displacement(path)).ok()?;
            let volts = chain.respond(&STEP.knots(10.0 * SMALLEST), &times);
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
                let displacement = f64::from(n) * SMALLEST;
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
            "{ASSUMED}. Displacements from D to {steps} D. The paper draws the amplitudes against the load; per force the two thicknesses \
             coincide in this model, per displacement the thinner one answers more. The case without silicone is left out: it has no model."
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
            let volts = chain.respond(&profile.knots(5.0 * SMALLEST), &times);
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
        let displacement = f64::from(n) * SMALLEST;
        let share = amplitude(displacement) / prototype.limit();
        [prototype.tester_force(displacement), share]
    });
    Series::new(name, points.collect(), Style::Line)
}

fn figure_17(both: &[Prototype<'_>; 2]) -> Figure {
    let charts = both
        .iter()
        .zip(THICKNESSES)
        .enumerate()
        .map(|(index, (prototype, thickness))| {
            let mut series = Vec::new();
            for ((name, profile), slopes) in PROFILES.iter().zip(SLOPES) {
                let sum = |displacement: f64| prototype.peaks(profile, displacement).iter().sum();
                series.push(line(prototype, name, sum));
                let end = prototype.tester_force(10.0 * SMALLEST);
                let slope = slopes[index].1;
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
            "{ASSUMED}. Dashed: the measured slopes of table 2. The gain is not printed, so only the ratios of the lines can be compared."
        ),
    }
}
