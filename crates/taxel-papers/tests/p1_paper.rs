//! Published numbers of paper P1: entries of its ledger (`papers/p1.toml`) and the
//! numbers behind them.
#![allow(clippy::unwrap_used)]

use taxel::sensor::Sensor;
use taxel::transduction::{CapacitanceLaw, InPlaneModel};
use taxel_papers::{Ledger, Paper, Verdict};

fn ledger() -> Ledger {
    Paper::P1.ledger()
}

fn model(gap: u32, law: CapacitanceLaw) -> InPlaneModel {
    let sensor = Sensor::shipped(&format!("in-plane-{gap}um")).unwrap();
    let model = sensor.in_plane().unwrap().model();
    InPlaneModel { law, ..model }
}

#[test]
fn p1_every_equation_and_table_entry_is_there() {
    let ledger = ledger();
    for place in [
        "Eq. 1a", "Eq. 1b", "Eq. 2", "Eq. 3", "Eq. 4a", "Eq. 4b", "Eq. 4c", "Eq. 5", "Eq. 6",
        "Eq. 7", "Eq. 8", "Fig. 1", "Fig. 2", "Fig. 3", "Fig. 4",
    ] {
        assert!(
            ledger.entries.iter().any(|entry| entry.row.place == place),
            "{place}"
        );
    }
    for gap in [20, 50, 100] {
        for what in ["zeta", "m", "t_min", "n", "q", "gamma"] {
            assert!(ledger.entry(&format!("{what}_{gap}")).is_some());
        }
    }
    assert_eq!(ledger.figures.len(), 1);
    let charts = &ledger.figures[0].figure.charts;
    assert_eq!(charts.len(), 3);
    for series in charts.iter().flat_map(|chart| &chart.series) {
        assert!(series.points.len() > 12, "{}", series.name);
        assert!(
            series
                .points
                .iter()
                .flatten()
                .all(|value| value.is_finite())
        );
    }
}

/// Inputs agree by construction and are counted apart.
#[test]
fn p1_inputs_are_distinguished() {
    let ledger = ledger();
    assert_eq!(ledger.counts(), [0, 0, 22, 23, 0, 0, 6, 14, 0]);
}

/// Numbers that come from a model, not from the sensor file.
#[test]
fn p1_computed_numbers() {
    let ledger = ledger();
    for (id, expected, verdict) in [
        ("layer_thinning", 40.0, Verdict::Input),
        // From the finite elements: t/T at 0.3, and 1 − t/T at 0.01 over 0.003.
        ("least_thickness", 0.57557, Verdict::Contradicts),
        ("first_slope_20", 4.837, Verdict::Contradicts),
        ("first_slope_50", 4.967, Verdict::Contradicts),
        ("first_slope_100", 4.843, Verdict::Reproduced),
    ] {
        let entry = ledger.entry(id).unwrap();
        // The secant to 0.01 against the slope at 0.001, 7e-4, and factors of
        // four digits.
        assert!(
            (entry.ours.unwrap() / expected - 1.0).abs() < 1e-3,
            "{entry:?}"
        );
        assert_eq!(entry.verdict, verdict, "{entry:?}");
    }
    let range = ledger.entry("sensing_range").unwrap();
    assert_eq!(range.verdict, Verdict::Contradicts);
    for number in ["0.098", "0.228", "0.063"] {
        assert!(range.note.contains(number), "{}", range.note);
    }
}

/// The numbers of the ledger's page that come from the shipped files.
#[test]
fn p1_shipped_devices() {
    for (gap, rest, facing, last, sensitivity) in [
        (20, 1874.4, 1062.5, 740.30, 30.791),
        (50, 1114.9, 425.00, 313.59, 13.370),
        (100, 811.83, 212.50, 162.23, 6.9801),
    ] {
        let model = model(gap, CapacitanceLaw::Mechanics);
        let inverse = model.inverse().unwrap();
        for (found, expected) in [
            (model.rest_capacitance(), rest),
            (model.rest_capacitance_without_fringe(), facing),
            (inverse.last().change, last),
            (model.sensitivity(0.0).unwrap(), sensitivity),
        ] {
            // Five printed digits.
            assert!(
                (found * 1e15 / expected - 1.0).abs() < 5e-5,
                "{gap}: {found}"
            );
        }
        assert_eq!(inverse.turning(), None);
        assert!((inverse.last().layer.force - 61.540).abs() < 5e-4);
    }
}

/// Model 1 over Model 2 is q (U/D)^γ: it does not grow with the gap, and is
/// below one for the widest.
#[test]
fn p1_figure_5_factors() {
    for (gap, expected) in [(20, 0.992), (50, 2.186), (100, 0.660)] {
        let model = model(gap, CapacitanceLaw::Published);
        let layer = model.layer.compress(0.1).unwrap();
        let factor = model.change_as_published(&layer).unwrap()
            / model.change_of_parallel_plates(&layer).unwrap();
        // Three decimals.
        assert!((factor - expected).abs() < 5e-4, "{gap}: {factor}");
    }
}
