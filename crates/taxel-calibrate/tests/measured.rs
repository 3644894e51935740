//! Calibration of devices whose board gives the physical value: the readings are in its unit,
//! and the constants of the synthetic device come back.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use taxel::sensor::Sensor;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, NoCalibrator, Outcome, Provenance,
    ReadingTable, SyntheticOptions, calibrator,
};
use taxel_numerics::least_squares::Status;

/// A shipped sensor read by an instrument.
fn text_of(name: &str, measured: &str) -> String {
    let text = Sensor::shipped_text(name).unwrap();
    let (head, _) = text.split_once("[electronics.readout").unwrap();
    format!("{head}[electronics.readout.measured]\n{measured}")
}

fn named<'a>(text: &'a str, sensor: &'a Sensor) -> NamedSensor<'a> {
    NamedSensor {
        name: "measured.toml",
        text,
        sensor,
    }
}

/// Synthetic data of the device, its columns, and the fit of them.
fn calibrated(text: &str) -> (String, Outcome, Sensor) {
    let sensor = Sensor::parse("measured.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let sensors = [named(text, &sensor)];
    let calibrator = calibrator(&sensors).unwrap();
    let options = SyntheticOptions {
        noise: 1e-3,
        ..SyntheticOptions::default()
    };
    let data = calibrator.synthetic(&options);
    let table = ReadingTable::parse("data.csv", &data, calibrator.columns(), calibrator.group())
        .unwrap_or_else(|error| panic!("{error}"));
    let outcome = calibrator
        .calibrate(&table, &CalibrateOptions::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let file = outcome.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "data.csv",
        data_hash: "0",
    });
    let file = CalibrationFile::parse("c.toml", &file).unwrap_or_else(|error| panic!("{error}"));
    let found = file.apply("c.toml", &sensors[0]).unwrap();
    (data, outcome, found)
}

#[test]
fn constants_come_back_from_readings_in_the_unit_of_the_instrument() {
    for (name, measured, title) in [
        (
            "in-plane-50um",
            "unit = \"pF\"\nnoise = \"0.05 fF\"\nrange = [\"0 pF\", \"3 pF\"]\n",
            "capacitance",
        ),
        (
            "three-axis-unit",
            "unit = \"pF\"\nnoise = \"0.05 fF\"\nrange = [\"0 pF\", \"3 pF\"]\n",
            "capacitance_11",
        ),
        (
            "liquid-metal-2x4",
            "unit = \"ohm\"\nnoise = \"1 mohm\"\nrange = [\"0 ohm\", \"1 kohm\"]\n",
            "resistance [ohm]",
        ),
        (
            "piezo-1.5mm",
            "unit = \"pC\"\nnoise = \"0.1 pC\"\nrange = [\"-1 nC\", \"1 nC\"]\n",
            "a1 [pC]",
        ),
    ] {
        let (data, outcome, found) = calibrated(&text_of(name, measured));
        assert!(
            data.contains(title),
            "{name}: {}",
            &data[..400.min(data.len())]
        );
        // The table states its truths as comments: each that is identified is near.
        let truths = data
            .lines()
            .filter_map(|line| line.strip_prefix("# truth "));
        for (key, value) in truths.filter_map(|line| line.split_once('=')) {
            let value = value.split_whitespace().next().unwrap();
            let Ok(truth) = value.parse::<f64>() else {
                continue;
            };
            for (parameter, estimate) in &outcome.parameters {
                let same = parameter.name.ends_with(key.trim());
                if same && estimate.status == Status::Identified {
                    let off = (estimate.value - truth).abs();
                    assert!(
                        off <= 6.0 * estimate.deviation,
                        "{name} {key}: {estimate:?} {truth}"
                    );
                }
            }
        }
        let identified = outcome.parameters.iter();
        let identified = identified.filter(|(_, estimate)| estimate.status == Status::Identified);
        assert!(identified.count() > 0, "{name}");
        // The calibrated device still reads frames of its board.
        assert!(found.device().is_ok(), "{name}");
    }
}

/// Twelve channels under one force, each with an offset of its own.
#[test]
fn the_magnet_of_a_skin_comes_back_from_forces_along_all_axes() {
    let text = Sensor::shipped_text("magnet-over-four-hall").unwrap();
    let (data, outcome, found) = calibrated(text);
    assert!(data.contains("channel,force_x [N],force_y [N],force_z [N],flux_density [T]"));
    for (name, truth) in [
        ("magnet_height", 4e-3),
        ("remanence", 1.2),
        ("softness_x", 1.0),
        ("softness_y", 1.0),
        ("softness_z", 1.0),
    ] {
        let mut parameters = outcome.parameters.iter();
        let (_, estimate) = parameters.find(|(one, _)| one.name == name).unwrap();
        // Once in 10⁴ by noise alone.
        let off = (estimate.value - truth).abs();
        assert!(off <= 4.0 * estimate.deviation, "{name}: {estimate:?}");
        // Readings tell more than the drawing, which has 2 and 3 %, and of the height 50 um.
        let drawn = if name == "magnet_height" { 50e-6 } else { 0.02 };
        assert!(estimate.deviation < drawn, "{name}: {estimate:?}");
    }
    assert!(found.device().is_ok());
}

#[test]
fn a_saturation_of_a_measured_resistance_is_in_ohms() {
    let text = text_of(
        "liquid-metal-2x4",
        "unit = \"ohm\"\nnoise = \"1 mohm\"\nrange = [\"0 ohm\", \"1 kohm\"]\n",
    );
    let (_, outcome, found) = calibrated(&text);
    let (parameter, estimate) = outcome.parameters.last().unwrap();
    assert!(
        parameter.name.ends_with("saturation_resistance"),
        "{}",
        parameter.name
    );
    assert_eq!((parameter.unit, estimate.interval[1]), ("ohm", 1000.0));
    let lead = outcome
        .parameters
        .iter()
        .find(|(one, _)| one.name == "lead_resistance");
    let lead = lead.unwrap().1.value;
    let array = found.microchannels().unwrap();
    assert!((array.board.signal.lead() - lead).abs() <= 1e-12 * lead.abs().max(1.0));
}

#[test]
fn measured_forces_have_nothing_to_calibrate() {
    let text = Sensor::shipped_text("force-4x4").unwrap();
    let sensor = Sensor::shipped("force-4x4").unwrap();
    let Err(error) = calibrator(&[named(text, &sensor)]) else {
        panic!("forces are forces")
    };
    assert!(matches!(error, NoCalibrator::Measured { .. }));
    assert!(
        error.to_string().contains("nothing to calibrate"),
        "{error}"
    );
}
