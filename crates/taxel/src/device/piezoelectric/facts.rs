//! Quantities derived from the drawing of a piezoelectric array.

use std::f64::consts::TAU;

use super::PiezoelectricArray;
use crate::device::timing;
use crate::electronics::LastStage;
use crate::estimation::{ChargeOptions, ChargeReader};
use crate::mechanics::{Base, BondedDisc, ContactPressure, SoftCover};
use crate::summary::{Fact, Value, fact, number, text};
use taxel_numerics::linear_chain::Transfer;

pub(super) fn facts(array: &PiezoelectricArray<'_>) -> Vec<Fact> {
    let masked = array.masked().into_iter().filter(|masked| *masked).count();
    let mut facts = vec![
        fact(
            "device",
            "channels",
            text(&array.layout().taxels()),
            "one per element",
        ),
        fact("device", "masked_elements", text(&masked), "mask"),
    ];
    facts.extend(mechanics(array));
    facts.extend(transduction(array));
    facts.extend(electronics(array));
    facts.extend(estimation(array));
    facts.extend(numerics());
    facts
}

fn mechanics(array: &PiezoelectricArray<'_>) -> Vec<Fact> {
    let (description, element) = (array.description, &array.element);
    let mut facts = Vec::new();
    if let (Ok(pressed), Ok(path)) = (description.preloaded(), array.path()) {
        facts.extend([
            fact(
                "mechanics",
                "preloaded_thickness",
                number(pressed.thickness, "m", "mm", 1e-3),
                "law of the cover under its preload",
            ),
            fact(
                "mechanics",
                "silicone_stiffness",
                number(path.stiffness, "n_per_m", "N/m", 1.0),
                "k_s of the column over one element (P3 Eq. 17)",
            ),
            fact(
                "mechanics",
                "silicone_retardation",
                number(path.damping / path.stiffness, "s", "ms", 1e-3),
                "b_s/k_s",
            ),
            fact(
                "mechanics",
                "compression_per_displacement",
                number(
                    path.stiffness / (path.stiffness + element.stiffness),
                    "",
                    "",
                    1.0,
                ),
                "static G2 = k_s/(k_s + k_p)",
            ),
            fact(
                "mechanics",
                "resonance",
                number(element.natural_frequency(path) / TAU, "hz", "MHz", 1e6),
                "of the element in the silicone",
            ),
        ]);
    }
    facts.push(fact(
        "mechanics",
        "depth",
        number(description.depth(), "m", "mm", 1e-3),
        "silicone above the elements, without preload: it spreads a touch",
    ));
    let cover = SoftCover {
        thickness: description.depth(),
        base: Base::Rigid,
        contact: ContactPressure::Point,
    };
    let side = description.ceramic.side;
    let half_pitch = 0.5 * array.layout().pitch[0];
    for (name, offset, source) in [
        (
            "share_over_an_element",
            0.0,
            "of a point load over the middle of an element",
        ),
        (
            "share_between_elements",
            half_pitch,
            "of a point load half way between two elements, on each",
        ),
    ] {
        let share = cover.share([offset, 0.0], side);
        facts.push(fact(
            "mechanics",
            name,
            number(share, "", "%", 0.01),
            source,
        ));
    }
    facts.extend(under_a_disc(array));
    facts
}

/// What the layer makes of a rigid disc as large as the preload: stiffness, and the charge of
/// an element under its middle with the interval of what a drawing leaves open.
fn under_a_disc(array: &PiezoelectricArray<'_>) -> Vec<Fact> {
    let (description, cover) = (array.description, &array.description.cover);
    let disc = BondedDisc {
        radius: (cover.preload_area / std::f64::consts::PI).sqrt(),
        thickness: cover.thickness,
        rim: cover.rim,
        grip: cover.grip,
    };
    let Ok(pressed) = disc.pressed() else {
        return Vec::new();
    };
    let side = description.ceramic.side;
    let mut facts = vec![fact(
        "mechanics",
        "disc_stiffness",
        number(pressed.stiffness(cover.modulus), "n_per_m", "N/mm", 1e3),
        "rigid disc of preload_area on the bonded layer",
    )];
    let Some(share) = pressed.share([0.0; 2], side) else {
        return facts;
    };
    let charge = |name: &str, si: f64, source: &'static str| {
        fact(
            "transduction",
            name,
            number(si, "c_per_n", "pC/N", 1e-12),
            source,
        )
    };
    facts.push(fact(
        "mechanics",
        "share_under_disc",
        number(share, "", "%", 0.01),
        "of that disc's force, on an element under its middle",
    ));
    facts.push(charge(
        "charge_per_disc_force",
        share * description.ceramic.charge_per_force,
        "d33 times that share, stress in the plane left out",
    ));
    let setting = description.seated(cover.preload_area);
    let interval = description
        .charge_constants()
        .and_then(|constants| setting.charge_interval(constants).ok());
    if let Some(interval) = interval {
        let [least, greatest] = interval.map(|one| one * setting.element_area / setting.disc_area);
        let open =
            "by seat, rim, edge of the layer, ceramic, d33 +-20 %, with d31; no stiff sheets";
        facts.push(charge("charge_per_disc_force_least", least, open));
        facts.push(charge("charge_per_disc_force_greatest", greatest, open));
    }
    facts
}

fn transduction(array: &PiezoelectricArray<'_>) -> Vec<Fact> {
    let element = &array.element;
    let mut facts = vec![
        fact(
            "transduction",
            "charge_per_compression",
            number(element.charge_per_compression(), "c_per_m", "C/m", 1.0),
            "K = d33 k_p (P3 Eq. 2)",
        ),
        fact(
            "transduction",
            "open_voltage_per_force",
            number(
                element.charge_per_force / element.capacitance,
                "v_per_n",
                "V/N",
                1.0,
            ),
            "d33/C, above the corner of the leak",
        ),
        fact(
            "transduction",
            "leak_time_constant",
            number(element.time_constant(), "s", "ms", 1e-3),
            "tau = R C (P3 Eq. 8)",
        ),
        fact(
            "transduction",
            "leak_corner",
            number(1.0 / (TAU * element.time_constant()), "hz", "Hz", 1.0),
            "1/(2 pi R C)",
        ),
    ];
    if let Ok(path) = array.path() {
        let gain = element.charge_per_compression() / element.capacitance * path.stiffness
            / (path.stiffness + element.stiffness);
        facts.push(fact(
            "transduction",
            "open_voltage_per_displacement",
            number(gain, "v_per_m", "mV/um", 1e3),
            "K/C k_s/(k_s + k_p): per displacement of the surface over the element",
        ));
    }
    facts
}

/// The gain where the output is most sensitive, between its two corners: a
/// frequency in Hz and the size of `transfer` there.
fn in_the_band(array: &PiezoelectricArray<'_>, transfer: &Transfer) -> [f64; 2] {
    let band = &array.board.band;
    let time = band
        .low_pass
        .map_or(0.0, |low_pass| (band.high_pass * low_pass).sqrt());
    // Without a filter far above the corner of the high-pass, where all of the
    // signal passes; of a charge meter at any frequency.
    let time = if time > 0.0 && time.is_finite() {
        time
    } else if band.high_pass.is_finite() {
        0.01 * band.high_pass
    } else {
        1.0 / TAU
    };
    let hertz = 1.0 / (TAU * time);
    [hertz, transfer.at_frequency(hertz).norm()]
}

/// A value of the output with its units.
fn output(array: &PiezoelectricArray<'_>, value: f64) -> Value {
    let unit = array.board.unit();
    number(value, unit.key, unit.symbol, unit.si_per_unit)
}

fn electronics(array: &PiezoelectricArray<'_>) -> Vec<Fact> {
    let board = &array.board;
    let band = &board.band;
    let [low, high] = board.span();
    let mut facts = timing(
        board.period(),
        board.scan_time(),
        "time for all elements of a frame",
    );
    facts.push(fact(
        "electronics",
        "carried_over",
        number(board.carried_over(), "", "%", 0.01),
        "of the channel before, by the settling of the multiplexer",
    ));
    if band.high_pass.is_finite() {
        facts.push(fact(
            "electronics",
            "high_pass_corner",
            number(1.0 / (TAU * band.high_pass), "hz", "Hz", 1.0),
            "leak of the element, or feedback of the charge amplifier",
        ));
    }
    if let Some(time) = band.low_pass {
        facts.push(fact(
            "electronics",
            "low_pass_corner",
            number(1.0 / (TAU * time), "hz", "Hz", 1.0),
            "1/(2 pi R_f C_f)",
        ));
    }
    let quantity = board.unit().quantity;
    let ends = |end: f64| match board.last {
        LastStage::Converter(_) => number(end, "v", "V", 1.0),
        LastStage::Instrument(_) => output(array, end),
    };
    let [range, noise] = match board.last {
        LastStage::Converter(_) => [
            "converter range and limit of the output",
            "output noise and rounding to counts",
        ],
        LastStage::Instrument(_) => [
            "electronics.readout.measured.range",
            "electronics.readout.measured.noise, and that of the stage before it",
        ],
    };
    let mut of = |name: String, value, source| {
        facts.push(fact("electronics", name, value, source));
    };
    let rest = output(array, board.output.offset);
    of(format!("rest_{quantity}"), rest, "offset of the output");
    of(format!("lowest_{quantity}"), ends(low), range);
    of(format!("highest_{quantity}"), ends(high), range);
    if let LastStage::Converter(_) = board.last {
        let step = output(array, board.step());
        of("step".into(), step, "one count of the converter");
    }
    let deviation = output(array, board.deviation());
    of("noise_of_a_reading".into(), deviation, noise);
    facts
}

fn estimation(array: &PiezoelectricArray<'_>) -> Vec<Fact> {
    let [low, high] = array.board.span();
    let room = (high - array.board.output.offset).min(array.board.output.offset - low);
    let deviation = array.board.deviation();
    let [hertz, per_force] = in_the_band(array, &array.output_per_force());
    let charge = array.board.unit().key == "c";
    // Per volt, or per coulomb of a charge that is measured.
    let per = |value, keys: [&'static str; 2], units: [&'static str; 2], volts| {
        let scale = if charge { 1e-9 } else { volts };
        let which = usize::from(charge);
        number(value, keys[which], units[which], scale)
    };
    let mut facts = vec![
        fact(
            "estimation",
            "band_centre",
            number(hertz, "hz", "Hz", 1.0),
            "where the sensitivities below hold",
        ),
        fact(
            "estimation",
            "sensitivity_per_force",
            per(per_force, ["v_per_n", "c_per_n"], ["V/N", "nC/N"], 1.0),
            "output per force on the element",
        ),
    ];
    let ranges = |facts: &mut Vec<Fact>, name: &str, gain: f64, unit: [&'static str; 2], scale| {
        facts.push(fact(
            "estimation",
            format!("range_{name}"),
            number(room / gain, unit[0], unit[1], scale),
            "amplitude at which the output is cut",
        ));
        facts.push(fact(
            "estimation",
            format!("resolution_{name}"),
            number(deviation / gain, unit[0], unit[1], scale),
            "one standard deviation of one reading",
        ));
    };
    ranges(&mut facts, "force", per_force, ["n", "mN"], 1e-3);
    if let Ok(path) = array.path() {
        let [_, per_metre] = in_the_band(array, &array.output_per_displacement(path));
        facts.push(fact(
            "estimation",
            "sensitivity_per_displacement",
            per(per_metre, ["v_per_m", "c_per_m"], ["mV/um", "nC/m"], 1e3),
            "output per displacement of the surface over the element",
        ));
        ranges(&mut facts, "displacement", per_metre, ["m", "um"], 1e-6);
    }
    let estimator = ChargeReader::new(array.model(), ChargeOptions::default());
    facts.extend([
        fact(
            "estimation",
            "full_scale",
            number(array.description.full_scale, "n", "mN", 1e-3),
            "element",
        ),
        fact(
            "estimation",
            "resolution_force_live",
            number(estimator.deviation(), "n", "mN", 1e-3),
            "one standard deviation of the force that live shows, high-pass undone",
        ),
    ]);
    facts
}

fn numerics() -> Vec<Fact> {
    let options = ChargeOptions::default();
    vec![
        fact(
            "numerics",
            "drift_guard",
            number(options.drift_guard, "s", "s", 1.0),
            "the value of an element fades with this time constant while its force is held; default",
        ),
        fact(
            "numerics",
            "smoothing",
            number(options.smoothing, "s", "ms", 1e-3),
            "time constant of the force that live shows; default",
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
    ]
}
