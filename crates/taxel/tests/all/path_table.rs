//! The table of a solved load path: its stated errors hold where it was not made, it is read like a closed
//! form, and only by its own drawing.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "figures are printed"
)]

use std::sync::OnceLock;

use taxel::sensor::Sensor;
use taxel::solutions::{Question, Solutions};
use taxel::transduction::{Leaps, PathTable, SolvedInPlane, TableOptions};

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
        let device = sensor.device().unwrap();
        device.tabulate(&OPTIONS, "test", &mut |_| {}).unwrap()
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
#[ignore = "two minutes: cargo test -p taxel --test all path_table -- --ignored --nocapture"]
fn the_stated_errors_of_the_default_tolerance_hold_at_unseen_loads() {
    let sensor = Sensor::shipped("in-plane-50um").unwrap();
    let options = TableOptions::default();
    let device = sensor.device().unwrap();
    let table = device.tabulate(&options, "test", &mut |_| {}).unwrap();
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

/// Sensor of microchannels.
const CHANNELS: &str = "liquid-metal-2x4";

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
        let device = sensor.device().unwrap();
        let refused = device.tabulate(&TableOptions::default(), "test", &mut |_| {});
        assert!(
            refused.unwrap_err().to_string().contains("help: "),
            "{name}"
        );
    }
}
