//! Quantities derived from the drawing of crossing microchannels.

use super::loads::{part_error, shortest_part, whole_top_error};
use super::{LAYERS, MicrochannelArray};
use crate::device::{of_table, timing};
use crate::electronics::LastStage;
use crate::estimation::MicrochannelOptions;
use crate::mechanics::{ClosingCurve, ClosingState, CurveSource, SectionShape, Stretch};
use crate::signal::ResistanceSignal;
use crate::summary::{Fact, Value, fact, number, text};
use crate::transduction::MicrochannelLayer;

pub(super) fn facts(array: &MicrochannelArray<'_>) -> Vec<Fact> {
    let [rows, columns] = array.counts();
    let mut facts = vec![fact(
        "device",
        "channels",
        text(&format!("{rows} along x, then {columns} along y")),
        "one for each row, one for each column",
    )];
    facts.extend(mechanics(array));
    facts.extend(transduction(array));
    facts.extend(electronics(array));
    facts.extend(estimation(array));
    facts.push(fact(
        "numerics",
        "contact_threshold",
        text(&format!(
            "{} sigma",
            MicrochannelOptions::default().contact_deviations
        )),
        "default",
    ));
    facts
}

/// Layers with their names.
fn named<'a>(
    array: &'a MicrochannelArray<'_>,
) -> impl Iterator<Item = (&'static str, &'a MicrochannelLayer)> {
    LAYERS.into_iter().zip(&array.layers)
}

fn kilopascal(pressure: f64) -> Value {
    number(pressure, "pa", "kPa", 1e3)
}

fn mechanics(array: &MicrochannelArray<'_>) -> Vec<Fact> {
    let element = array.element;
    let section = element.section();
    let mut facts = vec![
        fact(
            "mechanics",
            "stack_thickness",
            number(element.thickness(), "m", "um", 1e-6),
            "base, channel and the larger roof",
        ),
        fact(
            "mechanics",
            "shear_modulus",
            kilopascal(element.material.shear_modulus()),
            "2 (C10 + C01)",
        ),
        fact(
            "mechanics",
            "closed_form_closing_pressure",
            kilopascal(section.closing_pressure(&element.closed_form)),
            "E h/(2 (1 - nu^2) w): where P4 Eq. 1 ends",
        ),
    ];
    if let Some(drawn) = &element.table.0 {
        facts.extend(of_table("mechanics", &drawn.table));
    }
    for (name, layer) in named(array) {
        facts.extend(origin(name, &layer.closing));
        facts.push(fact(
            "mechanics",
            format!("{name}_compliance"),
            number(layer.closing.compliance(), "per_pa", "%/kPa", 1e-5),
            "share of the area lost per net pressure at rest",
        ));
        let [net, ratio] = layer.closing.end();
        facts.push(fact(
            "mechanics",
            format!("{name}_curve_ends_at_net_pressure"),
            kilopascal(net),
            "last point of the closing curve",
        ));
        facts.push(fact(
            "mechanics",
            format!("{name}_curve_ends_at_area_ratio"),
            number(ratio, "", "", 1.0),
            "last point of the closing curve",
        ));
        facts.extend(whole_channel_limits(name, layer));
    }
    facts
}

/// Where the closing curve of a layer comes from, and how good it is.
fn origin(name: &str, closing: &ClosingCurve) -> Vec<Fact> {
    let percent = |share: f64| number(share, "share", "%", 1e-2);
    let words = closing.source().words();
    let (from, error) = match closing.source() {
        CurveSource::Tabulated { error } => (
            "closing; a shipped table",
            Some((*error, "largest error of the net pressure in the table")),
        ),
        CurveSource::Solved { error, ended } => (
            match ended {
                None => "closing; the cell of the drawing",
                Some(_) => {
                    "closing; the cell of the drawing, up to where its corners fold too far to be followed"
                }
            },
            Some((
                *error,
                "of the net pressure: difference of a coarser mesh, at least 0.1 %",
            )),
        ),
        CurveSource::Points => ("closing; the sensor file", None),
        CurveSource::LoadPath => ("mechanics.table", None),
    };
    let name_of = |what: &str| format!("{name}_closing_curve{what}");
    let mut facts = vec![fact("mechanics", name_of(""), text(words), from)];
    facts.extend(
        error.map(|(error, source)| fact("mechanics", name_of("_error"), percent(error), source)),
    );
    facts
}

/// Pressures on the whole channel at which the roof touches and the curve ends.
fn whole_channel_limits(name: &str, layer: &MicrochannelLayer) -> Vec<Fact> {
    let open = |state| matches!(state, ClosingState::Open | ClosingState::Bulging);
    let known = |state| !matches!(state, ClosingState::Beyond { .. });
    let touch = layer
        .closing
        .touch()
        .and_then(|_| last_pressure(layer, open));
    let limits = [
        (
            "first_touch_pressure",
            touch,
            "roof on floor, loaded all over",
        ),
        (
            "curve_ends_at_pressure",
            last_pressure(layer, known),
            "end of the closing curve, loaded all over",
        ),
    ];
    limits
        .into_iter()
        .filter_map(|(what, pressure, source)| {
            Some(fact(
                "mechanics",
                format!("{name}_{what}"),
                kilopascal(pressure?),
                source,
            ))
        })
        .collect()
}

/// Largest pressure on a whole channel whose state is `wanted`, Pa; `None`
/// when the liquid lets no pressure leave it.
fn last_pressure(layer: &MicrochannelLayer, wanted: impl Fn(ClosingState) -> bool) -> Option<f64> {
    let holds = |pressure| {
        let load = [Stretch {
            share: 1.0,
            pressure,
        }];
        let response = layer.respond(&load).ok()?;
        Some(wanted(response.channel.sections[0].state))
    };
    let (mut low, mut high) = (0.0, 1e9);
    if holds(high)? {
        return None;
    }
    // 1e9 Pa halved 60 times is 1e-9 Pa.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

fn transduction(array: &MicrochannelArray<'_>) -> Vec<Fact> {
    let mut facts = Vec::new();
    for (index, (name, layer)) in named(array).enumerate() {
        facts.push(fact(
            "transduction",
            format!("{name}_rest_resistance"),
            number(layer.conductor.rest_resistance(), "ohm", "ohm", 1.0),
            match array.element.section.shape {
                _ if layer.initial_pressure > 0.0 => {
                    "resistivity x length/area at rest, without leads"
                }
                SectionShape::Rectangle => "resistivity x length/(width x height), without leads",
                SectionShape::Ellipse => {
                    "resistivity x length/(pi/4 width x height), without leads"
                }
            },
        ));
        if layer.initial_pressure > 0.0 {
            facts.push(fact(
                "transduction",
                format!("{name}_filled_area_ratio"),
                number(layer.bulged(), "", "", 1.0),
                if layer.closing.knows_bulging() {
                    "area at rest over the drawn one: the over-filled microchannel as solved"
                } else {
                    "area at rest over the drawn one: the over-filled microchannel bulges by its slope at rest"
                },
            ));
        }
        let one = array.taxel_share()[index];
        for (what, share, source) in [
            (
                "sensitivity",
                1.0,
                "dR/R0 per pressure at rest, loaded all over",
            ),
            (
                "sensitivity_of_one_taxel",
                one,
                "the same, one taxel loaded",
            ),
        ] {
            // 1 Pa is 1e-4 of the closing pressure of the softest channel.
            let load = [
                Stretch {
                    share,
                    pressure: 1.0,
                },
                Stretch {
                    share: 1.0 - share,
                    pressure: 0.0,
                },
            ];
            if let Ok(response) = layer.respond(&load) {
                facts.push(fact(
                    "transduction",
                    format!("{name}_{what}"),
                    number(response.change, "per_pa", "%/kPa", 1e-5),
                    source,
                ));
            }
        }
    }
    let errors = named(array).filter_map(|(name, layer)| {
        Some(fact(
            "transduction",
            format!("{name}_loaded_part_error"),
            number(part_error(&layer.closing)?, "share", "%", 1e-2),
            "of the change of resistance under loads on parts of a channel, most that a hundred random sheets need",
        ))
    });
    facts.extend(errors);
    let errors = named(array).filter_map(|(name, layer)| {
        Some(fact(
            "transduction",
            format!("{name}_whole_top_error"),
            number(whole_top_error(&layer.closing, &layer.liquid)?, "share", "%", 1e-2),
            "change of resistance too small by this at most with the whole top pressed, up to half the area: the other layer is \
             left out; taxel tabulate and --mechanics fem have both",
        ))
    });
    facts.extend(errors);
    facts.push(fact(
        "transduction",
        "shortest_loaded_part",
        number(shortest_part(array.element.thickness()), "m", "um", 1e-6),
        "1.4 times the stack: the ends of a shorter part carry more of its load",
    ));
    facts
}

fn electronics(array: &MicrochannelArray<'_>) -> Vec<Fact> {
    let (board, signal) = (&array.board, &array.board.signal);
    let mut facts = timing(
        board.period(),
        board.scan_time(),
        "time for all channels of a frame",
    );
    let ohms = |resistance| number(resistance, "ohm", "ohm", 1.0);
    let (noise, source) = match (signal, board.last) {
        (ResistanceSignal::Divider { .. }, LastStage::Converter(_)) => (
            number(board.deviation(), "v", "mV", 1e-3),
            "noise and rounding to counts",
        ),
        (ResistanceSignal::Divider { .. }, LastStage::Instrument(_)) => (
            number(board.deviation(), "v", "mV", 1e-3),
            "noise of divider and instrument",
        ),
        (ResistanceSignal::Resistance { .. }, _) => (
            ohms(board.deviation()),
            "electronics.readout.measured.noise",
        ),
    };
    facts.push(fact("electronics", "noise_of_a_reading", noise, source));
    if signal.is_voltage() {
        for (name, layer) in named(array) {
            let rest = signal.of(layer.conductor.rest_resistance());
            facts.push(fact(
                "electronics",
                format!("{name}_rest_voltage"),
                number(rest, "v", "V", 1.0),
                "V_S R/(R_ref + R) (P4 Eq. 3)",
            ));
        }
    }
    let source = if signal.is_voltage() {
        "resistance at the saturation voltage"
    } else {
        "electronics.readout.measured.range"
    };
    facts.push(fact(
        "electronics",
        "saturation_resistance",
        ohms(signal.resistance(board.saturation)),
        source,
    ));
    facts
}

/// Range and resolution of one taxel of a microchannel.
fn estimation(array: &MicrochannelArray<'_>) -> Vec<Fact> {
    let Ok(calibration) = array.calibration() else {
        return Vec::new();
    };
    let models = [calibration.rows.first(), calibration.columns.first()];
    let mut facts = Vec::new();
    for (name, model) in LAYERS.into_iter().zip(models) {
        let Some(model) = model else { continue };
        facts.push(fact(
            "estimation",
            format!("{name}_resolution"),
            number(
                model.rest_pressure_deviation(&calibration.scale),
                "pa",
                "Pa",
                1.0,
            ),
            "one standard deviation of the pressure on one taxel, one frame at rest",
        ));
        facts.push(fact(
            "estimation",
            format!("{name}_highest_pressure"),
            kilopascal(model.highest_pressure()),
            "pressure on one taxel at which its closing curve ends",
        ));
    }
    facts
}
