//! The table of a solved load path: its stated errors hold where it was not made, it is read like a closed
//! form, and only by its own drawing.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "figures are printed"
)]

use std::sync::OnceLock;

use taxel::calibration::MicrochannelModel;
use taxel::mechanics::{PressureLaw, Stretch};
use taxel::sensor::Sensor;
use taxel::solutions::{Question, Solutions, Solver};
use taxel::transduction::{MicrochannelLayer, PathTable};
use taxel_bodies::mechanics::crossing_microchannels::{Crossing, CrossingStudy};
use taxel_bodies::mechanics::microchannel_cell::{Filling, WallContact};
use taxel_bodies::transduction::{Leaps, SolvedInPlane, TableOptions};
use taxel_bodies::{FiniteElements, tabulate};
use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::{CrossingVoids, VoidShape};
use taxel_numerics::OnCurve;

const OPTIONS: TableOptions = TableOptions {
    tolerance: 1e-3,
    most_intervals: 64,
    leaps: Leaps::Refused,
};

/// One table, here.
struct Here<'t>(&'t str);

impl Solutions for Here<'_> {
    fn kept(&mut self, _: &Question) -> Option<String> {
        None
    }

    fn keep(&mut self, _: &Question, _: &str) {}

    fn solver(&self) -> Option<Box<dyn Solver>> {
        Some(Box::new(FiniteElements))
    }

    fn table(&mut self, name: &str) -> Result<String, String> {
        (name == "path.json")
            .then(|| self.0.to_owned())
            .ok_or_else(|| format!("no {name}"))
    }
}

fn table() -> &'static PathTable {
    static TABLE: OnceLock<PathTable> = OnceLock::new();
    TABLE.get_or_init(|| {
        let sensor = Sensor::shipped("in-plane-50um").unwrap();
        tabulate(&sensor, &OPTIONS, "test", &mut |_| {}).unwrap()
    })
}

/// The shipped file with the table, and one change.
fn text(old: &str, new: &str) -> String {
    let text = Sensor::shipped_text("in-plane-50um").unwrap();
    assert!(text.contains(old));
    let text = text.replacen(old, new, 1);
    with_key(&text)
}

/// The text of a sensor file that names the table.
fn with_key(text: &str) -> String {
    let key = "\nmechanics = { table = \"path.json\" }\n\n[array]";
    text.replacen("\n[array]", key, 1)
}

fn with_table() -> Sensor {
    with(table())
}

fn with(table: &PathTable) -> Sensor {
    Sensor::parse_with(
        "mine.toml",
        &text("schema", "schema"),
        &mut Here(&table.text()),
    )
    .unwrap()
}

#[test]
fn the_stated_errors_hold_at_loads_that_the_table_has_not_seen() {
    assert!(hold(table(), &OPTIONS, &[0.93]) >= 20);
}

#[test]
#[ignore = "two minutes: cargo test -p taxel-bodies --test all path_table -- --ignored --nocapture"]
fn the_stated_errors_of_the_default_tolerance_hold_at_unseen_loads() {
    let sensor = Sensor::shipped("in-plane-50um").unwrap();
    let options = TableOptions::default();
    let table = tabulate(&sensor, &options, "test", &mut |_| {}).unwrap();
    assert!(hold(&table, &options, &[0.97, 0.83, 0.43]) >= 50);
}

/// Solves ways to shares of the whole one, whose states lie between the nodes, and compares; how many.
fn hold(table: &PathTable, options: &TableOptions, shares: &[f64]) -> usize {
    assert!(
        table.interpolation.loads >= 8 && table.mesh.loads == 5,
        "{:?}",
        table.mesh
    );
    let stated = ["force", "change"].map(|of| table.interpolation.of(of));
    let kept = stated.iter().all(|error| *error <= options.tolerance);
    assert!(kept || options.leaps == Leaps::Stated, "{stated:?}");
    let drawn = Sensor::shipped("in-plane-50um").unwrap();
    let sensor = with(table);
    let (model, solved) = (
        sensor.in_plane().unwrap().model(),
        drawn.in_plane().unwrap().model(),
    );
    let inverse = model.inverse().unwrap();
    let end = model.respond(table.end()).unwrap();
    let area = model.layer.contact_area();
    let (mut seen, mut found_worst, mut worst_bias) = (0, [0.0_f64; 2], 0.0_f64);
    for share in shares {
        let most = share * table.end();
        let way = SolvedInPlane::solve(&solved, most, &|_| false, &mut |_| {}).unwrap();
        for step in 1..=24 {
            // A state of the way, not one between two of them.
            let state = way.at(most * f64::from(step) / 24.0).unwrap();
            let force = area * state.mean_stress;
            let change = way.rest().capacitance - state.capacitance;
            let found = model.respond(state.compression).unwrap();
            let errors = [
                (found.layer.force - force).abs() / end.layer.force,
                (found.change - change).abs() / end.change,
            ];
            for (worst, error) in found_worst.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
            // What an estimator reads of the solved capacitance is the solved force: the error of
            // the change is worth a force by the slope there.
            if change <= inverse.last().change {
                let bias = (inverse.force_from_change(change) - force).abs();
                let slope = model.sensitivity(state.compression).unwrap();
                let allowed = stated[0] * end.layer.force + stated[1] * end.change / slope;
                worst_bias = worst_bias.max(bias / allowed);
            }
            seen += 1;
        }
    }
    println!(
        "{} nodes, {} loads between them: stated {stated:?}, found at {seen} others {found_worst:?}; \
         bias of the estimate over what that allows {worst_bias:.2}",
        table.nodes(),
        table.interpolation.loads,
    );
    for (found, stated) in found_worst.iter().zip(stated) {
        assert!(*found <= stated, "{found_worst:?} above {stated:?}");
    }
    assert!(worst_bias <= 1.0, "{worst_bias}");
    seen
}

/// Sensor whose table is below.
const CHANNELS: &str = "liquid-metal-2x4";
/// `taxel tabulate liquid-metal-2x4 -o crates/taxel-bodies/tests/tables/liquid-metal-2x4.json`
fn of_channels() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let kept = "/tests/tables/liquid-metal-2x4.json";
        std::fs::read_to_string([env!("CARGO_MANIFEST_DIR"), kept].concat()).unwrap()
    })
}

fn channels(table: &str) -> Sensor {
    let text = with_key(Sensor::shipped_text(CHANNELS).unwrap());
    Sensor::parse_with("mine.toml", &text, &mut Here(table)).unwrap()
}

/// The crossing cell of the shipped sensor as its predictions solve it, posed here anew.
fn crossing_cell() -> CrossingStudy {
    let sensor = Sensor::shipped(CHANNELS).unwrap();
    let element = sensor.microchannels().unwrap().element;
    let (height, pitch) = (element.section.height, sensor.array.pitch[0]);
    let cell = CrossingVoids {
        width: element.section.width,
        pitch,
        base: element.base,
        lower: height,
        between: element.rows.roof - element.columns.roof - height,
        upper: height,
        cover: element.columns.roof,
        smallest: height,
        growth: 2.0,
        largest: pitch / 4.0,
        shape: VoidShape::Rectangle,
    };
    let PressureLaw::Paper(liquid) = &element.liquid.pressure else {
        panic!("another law");
    };
    let filling = Filling::Gas(liquid.expansion * liquid.atmosphere);
    let taxel::mechanics::Hyperelastic::MooneyRivlin(constants) = element.material;
    let solid = Material::incompressible(Law::MooneyRivlin {
        c10: constants.c10,
        c01: constants.c01,
    });
    CrossingStudy::new(&cell, solid, &filling, WallContact::default()).unwrap()
}

/// Errors of a table of the shipped channels at a solved state, over those that it states: of the
/// change under this pressure on the whole top, and of the pressure that is estimated of one
/// taxel which alone has the net pressure of this state. The rows are the lower layer.
fn errors_of_channels(sensor: &Sensor, table: &PathTable, state: &Crossing) -> [f64; 2] {
    let array = sensor.microchannels().unwrap();
    let mut worst = [0.0_f64; 2];
    for (layer, (below, name)) in [(1, "row_change"), (0, "column_change")]
        .into_iter()
        .enumerate()
    {
        let model = &array.layers[layer];
        let stated = table.interpolation.of(name);
        let full = change_of_all(model, table.end());
        let solved = state.resistance_ratio[below];
        let error = change_of_all(model, state.pressure) - (solved - 1.0);
        worst[0] = worst[0].max(error.abs() / (stated * full));

        // One taxel: its liquid is that of the whole channel, the rest of which bulges.
        let share = array.taxel_share()[layer];
        let net = state.pressure - state.inside[below];
        let bulge = |inside: f64| 1.0 + model.closing.compliance() * inside;
        let PressureLaw::Paper(law) = &model.liquid else {
            panic!("another law");
        };
        // The law falls with the volume, which rises with the pressure of the liquid.
        let (mut inside, mut high) = (0.0, net);
        for _ in 0..200 {
            let middle = 0.5 * (inside + high);
            let volume = share * state.volume_ratio[below] + (1.0 - share) * bulge(middle);
            if middle < law.pressure(volume) {
                inside = middle;
            } else {
                high = middle;
            }
        }
        let change = share * solved + (1.0 - share) / bulge(inside) - 1.0;
        let of_taxel = MicrochannelModel::new(model, share, 1.0, f64::INFINITY).unwrap();
        let OnCurve::Inside { value, slope } = of_taxel.pressure.at(change) else {
            continue;
        };
        let bias = value - (net + inside);
        let used = bias.abs() / (stated * full * share * slope);
        assert!(used.is_finite(), "{value} {net} {inside}");
        worst[1] = worst[1].max(used);
    }
    worst
}

/// R/R₀ − 1 of a channel that is pressed all along.
fn change_of_all(layer: &MicrochannelLayer, pressure: f64) -> f64 {
    let whole = Stretch {
        share: 1.0,
        pressure,
    };
    layer.respond(&[whole]).unwrap().change
}

#[test]
fn a_table_states_the_error_of_loaded_parts() {
    let facts = taxel::summary::summary(&channels(of_channels())).unwrap();
    for name in ["row_loaded_part_error", "column_loaded_part_error"] {
        let fact = facts.iter().find(|fact| fact.name == name).unwrap();
        // That of `loaded_parts`.
        let taxel::summary::Value::Number { si, .. } = fact.value else {
            panic!("{name}")
        };
        assert_eq!(si, 0.6);
    }
}

#[test]
fn the_table_of_channels_holds_at_a_load_that_it_has_not_seen() {
    let sensor = channels(of_channels());
    let table: PathTable = serde_json::from_str(of_channels()).unwrap();
    assert!(table.interpolation.loads >= 8 && table.mesh.loads == 5);
    assert!(table.interpolation.largest() <= TableOptions::default().tolerance);
    let state = crossing_cell().press(0.4321 * table.end()).unwrap();
    let worst = errors_of_channels(&sensor, &table, &state);
    assert!(worst.iter().all(|worst| *worst <= 1.0), "{worst:?}");
    // By the keys of the file 3 % of the change are missing.
    let drawn = Sensor::shipped(CHANNELS).unwrap();
    let [by_table, by_keys] = [&sensor, &drawn]
        .map(|sensor| change_of_all(&sensor.microchannels().unwrap().layers[0], 24.9e3));
    assert!(
        (by_table / by_keys - 1.032).abs() < 0.002,
        "{by_table} {by_keys}"
    );
    let back = sensor
        .by_closed_forms(&mut taxel::solutions::TablesOnly)
        .unwrap();
    let back = &back.microchannels().unwrap().layers[0];
    assert_eq!(change_of_all(back, 24.9e3), by_keys);
}

#[test]
#[ignore = "minutes: cargo test -p taxel-bodies --test all path_table::the_table_of_channels -- --ignored --nocapture"]
fn the_table_of_channels_holds_at_fifty_loads_that_it_has_not_seen() {
    let drawn = Sensor::shipped(CHANNELS).unwrap();
    let made = tabulate(&drawn, &TableOptions::default(), "test", &mut |_| {});
    let text = made.unwrap().text();
    let sensor = channels(&text);
    let table: PathTable = serde_json::from_str(&text).unwrap();
    let mut study = crossing_cell();
    let mut worst = [0.0_f64; 2];
    for load in 0..50 {
        // Between eighths of the nodes, wherever these are.
        let share = (f64::from(load) + 0.37 + 0.26 * f64::from(load % 3) / 2.0) / 50.0;
        let state = study.press(share * table.end()).unwrap();
        for (worst, error) in worst
            .iter_mut()
            .zip(errors_of_channels(&sensor, &table, &state))
        {
            *worst = worst.max(error);
        }
    }
    println!(
        "{} nodes to {:.3} kPa, {} loads between them: stated {:?}, mesh {:?}; of the stated, at 50 others: \
         change {:.2}, estimate {:.2}",
        table.nodes(),
        table.end() / 1e3,
        table.interpolation.loads,
        table.interpolation.of_full_scale,
        table.mesh.of_full_scale,
        worst[0],
        worst[1]
    );
    assert!(worst.iter().all(|worst| *worst <= 1.0), "{worst:?}");
    // The table beside the tests is this one: the last digits are those of the machine.
    let kept: PathTable = serde_json::from_str(of_channels()).unwrap();
    assert_eq!(kept.drawing, table.drawing);
    assert_eq!(kept.nodes(), table.nodes());
    assert!((kept.end() / table.end() - 1.0).abs() < 1e-6);
}

#[test]
fn a_table_of_channels_is_of_its_drawing_alone() {
    let shipped = with_key(Sensor::shipped_text(CHANNELS).unwrap());
    let read = |old: &str, new: &str, table: &str| {
        assert!(shipped.contains(old), "{old}");
        let text = shipped.replacen(old, new, 1);
        Sensor::parse_with("mine.toml", &text, &mut Here(table))
    };
    for (old, new, word) in [
        ("height = \"20 um\"", "height = \"21 um\"", "height"),
        ("width = \"400 um\"", "width = \"390 um\"", "width"),
        ("pitch = \"600 um\"", "pitch = \"610 um\"", "pitch"),
        ("base = \"100 um\"", "base = \"110 um\"", "base"),
        ("c10 = \"75.5 kPa\"", "c10 = \"75.6 kPa\"", "c10"),
        ("expansion = 0.2", "expansion = 0.21", "expansion"),
        ("roof = \"140 um\"", "roof = \"150 um\"", "between"),
        ("roof = \"140 um\"", "roof = \"500 um\"", "upper"),
    ] {
        let error = read(old, new, of_channels()).unwrap_err();
        assert_eq!(error.key, "mechanics.table");
        let message = error.to_string();
        assert!(
            message.contains("another drawing") && message.contains(word),
            "{message}"
        );
    }
    // What is no part of the solution may change.
    for (old, new) in [
        ("noise = \"10 uV\"", "noise = \"20 uV\""),
        (
            "resistivity = \"294 nohm m\"",
            "resistivity = \"300 nohm m\"",
        ),
        (
            "height_deviation = \"0.5 um\"",
            "height_deviation = \"0.4 um\"",
        ),
    ] {
        assert!(read(old, new, of_channels()).is_ok(), "{old}");
    }
    let begins =
        of_channels().replacen("[\n      0.0,\n      1.0,", "[\n      0.0,\n      0.99,", 1);
    assert_ne!(begins, of_channels());
    for damaged in [
        &of_channels()[..of_channels().len() - 200],
        &of_channels().replacen("\"nodes\": [", "\"nodes\": [7,", 1),
        &of_channels().replacen("\"row_net_pressure_pa\"", "\"net_pressure_pa\"", 1),
        &begins,
    ] {
        let error = read("schema", "schema", damaged).unwrap_err();
        assert_eq!(error.key, "mechanics.table");
        let message = error.to_string();
        assert!(
            message.contains("no table of `taxel tabulate`"),
            "{message}"
        );
    }
    let gas = "[element.microchannel.liquid.pressure.paper]\nexpansion = 0.2\natmosphere = \"101.325 kPa\"";
    let file = Sensor::shipped_text(CHANNELS).unwrap();
    assert!(file.contains(gas));
    let file = file.replacen(gas, "", 1).replacen(
        "resistivity = ",
        "pressure = \"sealed\"\nresistivity = ",
        1,
    );
    let sealed = Sensor::parse("sealed.toml", &file).unwrap();
    let refused = tabulate(&sealed, &TableOptions::default(), "test", &mut |_| {});
    let refused = refused.unwrap_err().to_string();
    assert!(
        refused.contains("sealed") && refused.contains("help: "),
        "{refused}"
    );
}

#[test]
fn a_table_takes_the_place_of_the_closed_form_everywhere() {
    let drawn = Sensor::shipped("in-plane-50um").unwrap();
    let sensor = with_table();
    let (table, closed) = (
        sensor.in_plane().unwrap().model(),
        drawn.in_plane().unwrap().model(),
    );
    let at = |model: &taxel::transduction::InPlaneModel| {
        let compression = model.compression_from_force(10.0).unwrap();
        model.respond(compression).unwrap().change
    };
    // 108.1 fF by the closed form, 101.28 fF by finite elements of all of the way; the table is within
    // its tolerance, a share of the whole change of some 500 fF.
    assert!((at(&closed) - 108.1e-15).abs() < 0.1e-15, "{}", at(&closed));
    assert!((at(&table) - 101.284e-15).abs() < 0.5e-15, "{}", at(&table));
    // A made gap scatters as it does in the closed form.
    let gap = |mut model: taxel::transduction::InPlaneModel, by: f64| {
        model.electrodes.gap += by;
        model.rest_capacitance()
    };
    let [by_table, by_form] =
        [&table, &closed].map(|model| gap(model.clone(), 1e-6) - gap(model.clone(), 0.0));
    assert!(
        (by_table / by_form - 1.0).abs() < 0.02,
        "{by_table} {by_form}"
    );
    let facts = taxel::summary::summary(&sensor).unwrap();
    assert!(
        facts
            .iter()
            .any(|fact| fact.name == "table_mesh_error_of_change")
    );
    // Back to the closed form, as --mechanics closed-form asks.
    let back = sensor
        .by_closed_forms(&mut taxel::solutions::TablesOnly)
        .unwrap();
    assert_eq!(at(&back.in_plane().unwrap().model()), at(&closed));
}

#[test]
fn the_table_of_another_drawing_is_refused_at_its_key() {
    let whole = table().text();
    for (old, new, word) in [
        ("gap = \"50 um\"", "gap = \"51 um\"", "gap_over_thickness"),
        (
            "thickness = \"950 um\"",
            "thickness = \"940 um\"",
            "half_length_over_thickness",
        ),
        ("permittivity = 2.4", "permittivity = 2.5", "permittivity"),
        (
            "\ndepth = \"10 mm\"",
            "\ndepth = \"9 mm\"",
            "electrode_depth",
        ),
        (
            "youngs_modulus = \"1.2 MPa\"",
            "youngs_modulus = \"1.3 MPa\"",
            "modulus_of_bars_over_layer",
        ),
    ] {
        let error =
            Sensor::parse_with("mine.toml", &text(old, new), &mut Here(&whole)).unwrap_err();
        assert_eq!(error.key, "mechanics.table");
        let message = error.to_string();
        assert!(
            message.contains("another drawing") && message.contains(word),
            "{message}"
        );
    }
    // Noise, board and fabrication are none of its business.
    let board = text("feedback = \"1.5 pF\"", "feedback = \"1.6 pF\"");
    assert!(Sensor::parse_with("mine.toml", &board, &mut Here(&whole)).is_ok());
}

#[test]
fn damaged_tables_and_wrong_devices_are_refused() {
    let whole = table().text();
    let file = text("schema", "schema");
    for damaged in [
        String::new(),
        whole[..whole.len() / 2].to_owned(),
        whole.replacen("\"taxel_table\": 2", "\"taxel_table\": 1", 1),
        whole.replacen("\"nodes\": [", "\"nodes\": [0.1,", 1),
    ] {
        let error = Sensor::parse_with("mine.toml", &file, &mut Here(&damaged)).unwrap_err();
        assert_eq!(error.key, "mechanics.table");
        assert!(
            error.to_string().contains("no table of `taxel tabulate`"),
            "{error}"
        );
    }
    let missing = Sensor::parse("mine.toml", &file).unwrap_err();
    assert!(
        missing.to_string().contains("cannot be opened here"),
        "{missing}"
    );
    let other = Sensor::shipped_text("piezo-1.5mm").unwrap();
    let error = Sensor::parse_with("other.toml", &with_key(other), &mut Here(&whole)).unwrap_err();
    assert!(error.to_string().contains("takes no table"), "{error}");
    let channels = Sensor::shipped_text(CHANNELS).unwrap();
    let error =
        Sensor::parse_with("other.toml", &with_key(channels), &mut Here(&whole)).unwrap_err();
    assert!(
        error.to_string().contains("another kind of device"),
        "{error}"
    );
    for name in ["three-axis-8x8", "piezo-1.5mm"] {
        let sensor = Sensor::shipped(name).unwrap();
        let refused = tabulate(&sensor, &TableOptions::default(), "test", &mut |_| {});
        assert!(
            refused.unwrap_err().to_string().contains("help: "),
            "{name}"
        );
    }
}
