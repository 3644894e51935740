//! Kinds of skins that nothing was tuned on, as the example `skins` draws them: live on a further run is not worse than
//! the best of plain regressions. All kinds, and other further runs, take minutes: `cargo run --release -p
//! taxel-calibrate --example skins`.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(dead_code, reason = "the example uses the rest")]

#[path = "../examples/skins/baseline.rs"]
mod baseline;
#[path = "../examples/skins/kinds.rs"]
mod kinds;
#[path = "../examples/skins/table.rs"]
mod table;

use kinds::{Further, KINDS, Skin};
use table::{REST, Table, live};
use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainedOutcome, TrainingFile, train,
};

/// A further run may err by this much more than the best of five regressions, chosen on that very run.
const WORSE: f64 = 1.1;

fn trained(sensor: &str, runs: &[String]) -> (TrainedOutcome, CalibrationFile) {
    let described = Sensor::parse("sensor.toml", sensor).unwrap();
    let named = NamedSensor {
        name: "sensor.toml",
        text: sensor,
        sensor: &described,
    };
    let file = |(number, text): (usize, &String)| {
        vec![TrainingFile {
            name: format!("run{number}.csv"),
            text: text.clone(),
        }]
    };
    let groups: Vec<_> = runs.iter().enumerate().map(file).collect();
    let outcome = train(&named, &groups, &CalibrateOptions::default()).unwrap();
    let text = outcome.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "runs",
        data_hash: "0",
    });
    (outcome, CalibrationFile::parse("c.toml", &text).unwrap())
}

/// Of a kind the errors on a further run, of the best plain regression and live: of the force, and of the position
/// along x where there is one; and what training said.
fn errors(name: &str) -> (Vec<[f64; 2]>, TrainedOutcome) {
    let kind = KINDS.into_iter().find(|kind| kind.name == name).unwrap();
    let skin = Skin::new(kind, 1);
    let runs: Vec<String> = (1..=3).map(|n| skin.run(n, Further::Alike)).collect();
    let (outcome, file) = trained(&skin.sensor(), &runs);
    let text = skin.sensor();
    let described = Sensor::parse("sensor.toml", &text).unwrap();
    let named = NamedSensor {
        name: "sensor.toml",
        text: &text,
        sensor: &described,
    };
    let calibrated = file.apply("c.toml", &named).unwrap();
    let array = calibrated.trained().unwrap();
    let reader = calibrated
        .device()
        .unwrap()
        .reader(&array.stream())
        .unwrap();
    let mut estimator = ArrayEstimator::new(reader);
    estimator.begin_unasked_rest_capture(REST);
    let further = Table::of(&skin.run(4, Further::Alike)).unwrap();
    let (found, wrong) = live(&mut estimator, &further).unwrap();
    // A press on one channel is no fault.
    assert!(wrong * 100 < further.frames.len(), "{name}: {wrong} frames");
    let tables: Vec<Table> = runs.iter().map(|run| Table::of(run).unwrap()).collect();
    let inputs: Vec<_> = tables.iter().map(|table| &table.inputs).collect();
    let judged = ["force", "x"].into_iter().zip([0, 3]).filter(|(name, _)| {
        let known = further.target(name).into_iter().flatten();
        known.clone().any(|value| value.is_finite())
    });
    let judged = judged.map(|(name, at)| {
        let targets: Vec<_> = tables
            .iter()
            .filter_map(|table| table.target(name).cloned())
            .collect();
        let plain = baseline::estimates(&inputs, &targets, &further.inputs);
        let (_, least) = baseline::best(&plain, |own| further.error(name, own));
        let own: Vec<f64> = found[at].iter().map(|[value, _]| *value).collect();
        [least, further.error(name, &own)]
    });
    (judged.collect(), outcome)
}

/// Of `coarse` some positions are unlike all of training: they are where the map has them, and not in the middle.
#[test]
fn live_is_not_worse_than_plain_regressions() {
    for kind in ["few", "coarse"] {
        let (errors, outcome) = errors(kind);
        assert_eq!(errors.len(), 2, "{kind}");
        assert!(!sees_changes(&outcome), "{kind}");
        for [plain, own] in errors {
            assert!(own < WORSE * plain, "{kind}: {own} for {plain}");
        }
    }
}

fn sees_changes(outcome: &TrainedOutcome) -> bool {
    let mut said = outcome.outcome.remarks.iter().map(ToString::to_string);
    said.any(|text| text.contains("the channels see changes"))
}

/// Channels that read zero while a force is held.
#[test]
fn channels_that_see_changes_only_are_named() {
    let kind = KINDS.into_iter().find(|kind| kind.name == "changes");
    let skin = Skin::new(kind.unwrap(), 2);
    let runs: Vec<String> = (1..=2).map(|n| skin.run(n, Further::Alike)).collect();
    let (outcome, _) = trained(&skin.sensor(), &runs);
    assert!(sees_changes(&outcome));
}

/// A rig writes columns for a position that a strip of one channel does not have.
#[test]
fn empty_columns_of_a_position_are_none() {
    let (errors, outcome) = errors("strip");
    let [[plain, own]] = errors[..] else {
        panic!("{errors:?}");
    };
    assert!(own < WORSE * plain, "{own} for {plain}");
    assert!(outcome.maps.position.is_none() && outcome.maps.place.is_none());
    let said = outcome.outcome.remarks.iter().map(ToString::to_string);
    assert_eq!(
        said.filter(|text| text.contains("x and y are empty"))
            .count(),
        3
    );
}
