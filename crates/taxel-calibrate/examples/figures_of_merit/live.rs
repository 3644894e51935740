//! Forces as `taxel calibrate` and `taxel estimate` give them: trained on recordings, and then frame
//! by frame.

use std::fmt::Write as _;
use std::fs;

use taxel::acquisition::Frame;
use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel_calibrate::training::Series;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainingFile, train,
};

use crate::Run;

/// Frames of the rest capture that the commands begin with.
const REST: usize = 50;

/// Force and its standard deviation, N, of every frame of `tested`, by maps of `training`, each run
/// up to a time, s.
pub(crate) fn forces(training: &[(&Run, f64)], tested: &Run) -> Result<Series, String> {
    let shown = |error: &dyn std::fmt::Display| error.to_string();
    let text = sensor(tested.session.sensor.width());
    let sensor = Sensor::parse("array.toml", &text).map_err(|error| shown(&error))?;
    let named = NamedSensor {
        name: "array.toml",
        text: &text,
        sensor: &sensor,
    };
    let groups = training.iter().map(|(run, end)| recorded(run, *end));
    let groups: Vec<Vec<TrainingFile>> = groups.collect::<Result<_, _>>()?;
    let trained =
        train(&named, &groups, &CalibrateOptions::default()).map_err(|error| shown(&error))?;
    let file = trained.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "recordings",
        data_hash: "0",
    });
    let file = CalibrationFile::parse("c.toml", &file).map_err(|error| shown(&error))?;
    let calibrated = file
        .apply("c.toml", &named)
        .map_err(|error| shown(&error))?;
    let stream = calibrated
        .trained()
        .map_err(|error| shown(&error))?
        .stream();
    let device = calibrated.device().map_err(|error| shown(&error))?;
    let reader = device.reader(&stream).map_err(|error| shown(&error))?;
    let mut estimator = ArrayEstimator::new(reader);
    estimator.begin_unasked_rest_capture(REST);
    let sensor = &tested.session.sensor;
    let start = sensor.times()[0];
    let mut rows = Vec::new();
    for ((sequence, time), values) in (0..).zip(sensor.times()).zip(sensor.rows()) {
        let frame = Frame {
            sequence,
            time_ns: ((time - start) * 1e9).round() as u64,
            values: values.clone(),
            ..Frame::default()
        };
        let (touch, _) = estimator.push(&frame).map_err(|error| shown(&error))?;
        rows.push(touch.pressing_force().unwrap_or([f64::NAN; 2]).to_vec());
    }
    Series::new(sensor.times().to_vec(), rows).ok_or_else(|| String::from("the times do not rise"))
}

/// The files of a run with the rows before a time, s.
fn recorded(run: &Run, end: f64) -> Result<Vec<TrainingFile>, String> {
    let file = |name: &str| {
        let path = run.path.join(name);
        let text = fs::read_to_string(&path).map_err(|error| error.to_string())?;
        let before = |line: &&str| {
            let time = line.split(',').next().and_then(|cell| cell.parse().ok());
            time.is_none_or(|time: f64| time < end)
        };
        let lines: Vec<&str> = text.lines().filter(before).collect();
        Ok(TrainingFile {
            name: format!("{}/{name}", run.name),
            text: lines.join("\n") + "\n",
        })
    };
    ["sensor.csv", "states.csv"].into_iter().map(file).collect()
}

/// A sensor file of an array with so many channels, chips of three axes.
fn sensor(channels: usize) -> String {
    let mut text = String::from(
        "schema = 2\nname = \"array\"\n[array]\nrows = 8\ncolumns = 8\npitch = \"4 mm\"\nmount = \"flat\"\n\
         [element.trained]\nfull_scale = \"35 N\"\ngroups = [",
    );
    for chip in 1..=channels / 3 {
        write!(
            text,
            "{{ name = \"chip {chip}\", channels = [\"x\", \"y\", \"z\"] }}, "
        )
        .expect("a text takes all");
    }
    text + "]\n[electronics]\nframe_rate = \"28 Hz\"\nscan = \"simultaneous\"\n\
            readout = { digital = { unit = \"counts\" } }\n"
}
