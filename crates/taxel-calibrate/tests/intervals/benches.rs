//! `calibrate` and `predict --calibration` on synthetic benches.

use crate::tally::{Case, Printed};
use std::fmt::Write as _;
use taxel::mechanics::{EndCondition, GivenFactor};
use taxel::predict::{Loads, Predictor};
use taxel::sensor::{Element, Sensor};
use taxel::table::Cell;
use taxel::transduction::{CapacitanceLaw, ThreeAxisModel};
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, HoldOut, NamedSensor, Outcome, Propagated, Provenance,
    ReadingTable, SyntheticOptions, calibrator,
};
use taxel_numerics::Noise;
use taxel_numerics::least_squares::{Status, linear};

/// Noise of the benches that the truth is read from, over that of the others: the fit
/// to them is off by so many of its deviations.
const QUIET: f64 = 1e-3;
/// Half a 95 % interval in deviations.
const WIDTH: f64 = 1.96;

/// A table for a seed and a share of the noise.
type Table = Box<dyn Fn(&[Sensor], u64, f64) -> String + Sync>;

/// A kind of bench: sensors, their table for a seed and a share of the noise, and a load.
struct Bench {
    sensors: Vec<Sensor>,
    table: Table,
    /// The load of `predict`; empty where it is not asked.
    load: &'static str,
    /// What the surroundings of a three-axis unit may add to its edges, F.
    surroundings: Option<[f64; 2]>,
}

impl Bench {
    fn new(sensors: Vec<Sensor>, table: Table, load: &'static str) -> Self {
        Self {
            surroundings: surroundings(&sensors[0]),
            sensors,
            table,
            load,
        }
    }

    /// What they add on the bench of a seed, F: anything between the limits alike.
    fn added(&self, seed: u64) -> f64 {
        let Some([least, greatest]) = self.surroundings else {
            return 0.0;
        };
        // Multiples of the golden ratio fill the interval evenly.
        let share = (seed as f64 * 0.618_033_988_749_895).fract();
        least + share * (greatest - least)
    }

    /// The table of a seed, in its surroundings.
    fn table(&self, seed: u64, share: f64) -> String {
        let text = (self.table)(&self.sensors, seed, share);
        match self.added(seed) {
            0.0 => text,
            added => with_added(&text, added),
        }
    }
}

/// Least and greatest capacitance that the surroundings of a drawing may add to its edges, F.
fn surroundings(sensor: &Sensor) -> Option<[f64; 2]> {
    let array = sensor.three_axis().ok()?;
    let plates = array.unit_model().plates;
    let drawn = plates.edge_capacitance(0)?;
    let limits = array.edges().ok()?.surroundings;
    Some(limits.map(|edges| edges.parallel(plates.electrode, plates.air_gap[0]) - drawn))
}

/// A table with so much, F, added to each of its capacitances.
fn with_added(text: &str, added: f64) -> String {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let head = lines.next().unwrap_or_default();
    let is_one = |name: &str| name.starts_with("capacitance_") && !name.contains("deviation");
    let places: Vec<bool> = head.split(',').map(is_one).collect();
    let mut table = format!("{head}\n");
    for line in lines {
        let fields = line.split(',').zip(&places).map(|(field, is_one)| {
            if *is_one {
                format!("{:.9}", field.parse::<f64>().unwrap() + 1e15 * added)
            } else {
                field.to_owned()
            }
        });
        table += &fields.collect::<Vec<_>>().join(",");
        table.push('\n');
    }
    table
}

pub(crate) fn all() -> Vec<Case> {
    let options = SyntheticOptions::default();
    let noise = |noise: f64| SyntheticOptions { noise, ..options };
    let unit = || vec![shipped("three-axis-8x8")];
    let piezo = || vec![shipped("piezo-1.5mm")];
    let (p2, p1) = ("fx=1 mN, fz=8 mN", "u=150 um");
    let p3 = "profile=impact, x=40 um, ramp=10 ms, dwell=200 ms";
    let gaps = ["in-plane-20um", "in-plane-50um", "in-plane-100um"];
    let crossing = SyntheticOptions {
        compression: 0.39,
        ..noise(0.0005)
    };
    vec![
        case("P2, 1 % noise", true, twin(unit(), noise(0.01), p2)),
        case("P2, 0.7 % noise", false, twin(unit(), noise(0.007), "")),
        case("P2, 0.2 % noise", false, twin(unit(), noise(0.002), p2)),
        case("P2, pressed only", true, pressed(unit())),
        case(
            "P2, gauge of 1 mN along z, exact side loads",
            false,
            coarse(unit(), false),
        ),
        case(
            "P2, the same with deviations given",
            false,
            coarse(unit(), true),
        ),
        case(
            "P1, one gap",
            true,
            twin(vec![shipped(gaps[1])], options, p1),
        ),
        case(
            "P1, one gap, published law",
            true,
            twin(vec![published(gaps[1])], options, p1),
        ),
        case(
            "P1, three gaps",
            false,
            twin(gaps.map(published).into(), options, ""),
        ),
        case("P3, peaks, 1 % noise", true, twin(piezo(), options, p3)),
        case(
            "P4",
            false,
            twin(vec![shipped("liquid-metal-2x4")], crossing, "p=15 kPa"),
        ),
        case(
            "cells, resistive mat",
            true,
            twin(vec![shipped("resistive-mat-8x8")], options, "fz=5 N"),
        ),
        case(
            "cells, pressure chips",
            true,
            twin(vec![shipped("pressure-chips-1x8")], options, "fz=0.2 N"),
        ),
    ]
}

/// What a rig adds to a bench, singly and together: name of the case, sensor, force of loading over that
/// of unloading less one, drift over the range, and tilt of the probe in degrees.
const FAULTS: [(&str, &str, f64, f64, f64); 18] = [
    ("rig, P1: hysteresis", "in-plane-50um", 0.05, 0.0, 0.0),
    ("rig, P1: drift", "in-plane-50um", 0.0, 0.02, 0.0),
    ("rig, P1: tilt", "in-plane-50um", 0.0, 0.0, 1.0),
    ("rig, P1: all", "in-plane-50um", 0.05, 0.02, 1.0),
    ("rig, P2: hysteresis", "three-axis-8x8", 0.05, 0.0, 0.0),
    ("rig, P2: drift", "three-axis-8x8", 0.0, 0.02, 0.0),
    ("rig, P2: tilt", "three-axis-8x8", 0.0, 0.0, 1.0),
    ("rig, P2: all", "three-axis-8x8", 0.05, 0.02, 1.0),
    ("rig, P3: drift", "piezo-1.5mm", 0.0, 0.02, 0.0),
    ("rig, P4: hysteresis", "liquid-metal-2x4", 0.05, 0.0, 0.0),
    ("rig, P4: drift", "liquid-metal-2x4", 0.0, 0.02, 0.0),
    ("rig, P4: all", "liquid-metal-2x4", 0.05, 0.02, 0.0),
    ("rig, mat: hysteresis", "resistive-mat-8x8", 0.05, 0.0, 0.0),
    ("rig, mat: drift", "resistive-mat-8x8", 0.0, 0.02, 0.0),
    ("rig, mat: all", "resistive-mat-8x8", 0.05, 0.02, 0.0),
    (
        "rig, chips: hysteresis",
        "pressure-chips-1x8",
        0.05,
        0.0,
        0.0,
    ),
    ("rig, chips: drift", "pressure-chips-1x8", 0.0, 0.02, 0.0),
    ("rig, chips: all", "pressure-chips-1x8", 0.05, 0.02, 0.0),
];

/// Benches on rigs with faults. The intervals of constants hold the truth, or the report says that the
/// model does not fit.
pub(crate) fn on_rigs() -> Vec<Case> {
    let of = |(name, sensor, hysteresis, drift, tilt): (&'static str, &str, f64, f64, f64)| {
        let options = SyntheticOptions {
            hysteresis,
            drift,
            tilt: tilt.to_radians(),
            ..SyntheticOptions::default()
        };
        case(name, false, twin(vec![shipped(sensor)], options, ""))
    };
    FAULTS.into_iter().map(of).collect()
}

/// What `calibrate` prints of a normal sweep alone.
pub(crate) fn pressed_only() -> String {
    let bench = pressed(vec![shipped("three-axis-8x8")]);
    calibrated(&bench.sensors, &bench.table(1, 1.0)).text()
}

fn shipped(name: &str) -> Sensor {
    Sensor::shipped(name).unwrap()
}

/// A shipped sensor under the published law with a known end factor.
fn published(name: &str) -> Sensor {
    let mut sensor = shipped(name);
    if let Element::InPlaneCapacitor(element) = &mut sensor.element {
        element.law = CapacitanceLaw::Published;
        element.layer.end_condition = EndCondition::Given(GivenFactor { chi: 0.909 });
    }
    sensor
}

/// The bench of `taxel twin --calibration-data`; of a three-axis array without times, so that
/// all of its readings count.
fn twin(sensors: Vec<Sensor>, options: SyntheticOptions, load: &'static str) -> Bench {
    let table = move |sensors: &[Sensor], seed: u64, share: f64| {
        // The truth is that of a bench without noise, on a rig without faults.
        let fault = if share < 1.0 { 0.0 } else { 1.0 };
        let options = SyntheticOptions {
            seed,
            noise: share * options.noise,
            hysteresis: fault * options.hysteresis,
            drift: fault * options.drift,
            tilt: fault * options.tilt,
            ..options
        };
        let text = calibrator(&named(sensors)).unwrap().synthetic(&options);
        match sensors[0].element {
            Element::ThreeAxisCapacitor(_) => without_times(&text),
            _ => text,
        }
    };
    Bench::new(sensors, Box::new(table), load)
}

/// A table without its first column.
fn without_times(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let rest = lines.filter_map(|line| line.split_once(','));
    rest.flat_map(|(_, rest)| [rest, "\n"]).collect()
}

/// A normal sweep that closes two thirds of the air, its side forces not in the table.
fn pressed(sensors: Vec<Sensor>) -> Bench {
    let table = |sensors: &[Sensor], seed: u64, share: f64| {
        rows(
            &made(sensors),
            [0.02, 0.1].map(|deviation| share * deviation),
            seed,
            |place| [0.0, 0.0, 40.0 * place],
        )
        .lines()
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            fields[2..].join(",") + "\n"
        })
        .collect()
    };
    Bench::new(sensors, Box::new(table), "fz=8 mN")
}

/// Side loads that are exact beside a gauge of 1 mN along z.
fn coarse(sensors: Vec<Sensor>, given: bool) -> Bench {
    let table = move |sensors: &[Sensor], seed: u64, share: f64| {
        let path = |place: f64| {
            let turn = 40.0 * place;
            [
                12.0 * turn.sin(),
                12.0 * (0.7 * turn).cos(),
                5.0 + 25.0 * place,
            ]
        };
        let text = rows(&made(sensors), [share, 0.1 * share], seed, path);
        if !given {
            return text;
        }
        let mut lines = text.lines();
        let head = lines.next().unwrap_or_default();
        let rest = lines.map(|line| format!("{line},0,0,{share},{}\n", 0.1 * share));
        format!(
            "{head},force_x_deviation [mN],force_y_deviation [mN],force_z_deviation [mN],capacitance_deviation [fF]\n{}",
            rest.collect::<String>()
        )
    };
    Bench::new(sensors, Box::new(table), "")
}

fn made(sensors: &[Sensor]) -> ThreeAxisModel {
    sensors[0].three_axis().unwrap().made()[0]
}

/// A table of 160 forces, mN, of which the gauge reads that along z with a deviation,
/// mN, and the capacitances with another, fF.
fn rows(
    unit: &ThreeAxisModel,
    deviations: [f64; 2],
    seed: u64,
    path: impl Fn(f64) -> [f64; 3],
) -> String {
    let mut noise = Noise::seeded(seed);
    let mut text = String::from(
        "force_x [mN],force_y [mN],force_z [mN],capacitance_11 [fF],capacitance_12 [fF],capacitance_21 [fF],capacitance_22 [fF]\n",
    );
    for k in 0..160 {
        let [x, y, z] = path(f64::from(k) / 159.0);
        let read = unit.predict([x, y, z].map(|f| 1e-3 * f)).1.capacitance();
        let z = z + deviations[0] * noise.normal();
        write!(text, "{x:.9},{y:.9},{z:.9}").unwrap();
        for c in read {
            let c = 1e15 * c + deviations[1] * noise.normal();
            write!(text, ",{c:.9}").unwrap();
        }
        text.push('\n');
    }
    text
}

fn named(sensors: &[Sensor]) -> Vec<NamedSensor<'_>> {
    let named = |sensor| NamedSensor {
        name: "sensor",
        text: "",
        sensor,
    };
    sensors.iter().map(named).collect()
}

fn calibrated(sensors: &[Sensor], text: &str) -> Outcome {
    let named = named(sensors);
    let calibrator = calibrator(&named).unwrap();
    let table = ReadingTable::parse("bench.csv", text, calibrator.columns(), calibrator.group());
    let options = CalibrateOptions {
        hold_out: HoldOut::None,
        ..CalibrateOptions::default()
    };
    calibrator.calibrate(&table.unwrap(), &options).unwrap()
}

/// The file of a calibration, read back.
fn file(outcome: &Outcome) -> CalibrationFile {
    let about = Provenance {
        version: "0",
        date: "2000-01-01",
        data: "bench.csv",
        data_hash: "00",
    };
    CalibrationFile::parse("calibration.toml", &outcome.to_toml(&about)).unwrap()
}

/// Answers of `predict --calibration` with their names.
fn predicted(sensors: &[Sensor], outcome: &Outcome, load: &str) -> Vec<(String, f64)> {
    let (named, file) = (named(sensors), file(outcome));
    let predictor = |sensor: &Sensor| sensor.device().unwrap().predictor().unwrap();
    let name = "calibration.toml";
    let centre = predictor(&file.apply(name, &named[0]).unwrap());
    let sides = file.spread(name, &named[0]).unwrap();
    let sides = sides
        .iter()
        .map(|[below, above]| [predictor(below), predictor(above)]);
    let names = CalibrationFile::uncertain_columns(&sensors[0]);
    let propagated = Propagated::new(centre, sides.collect(), names);
    let loads = Loads::one(load, propagated.load_columns()).unwrap();
    let mut row = Vec::new();
    propagated.answer(&loads.load(0), &mut row).unwrap();
    let pairs = propagated.columns().into_iter().zip(row);
    let number = |(column, cell): (taxel::table::Column, Cell)| match cell {
        Cell::Number(value) => Some((column.name, value)),
        _ => None,
    };
    pairs.filter_map(number).collect()
}

/// A case of a bench, whose truth is what the same bench gives without noise; what surroundings
/// add is part of every capacitance, and of nothing else.
fn case(name: &'static str, short: bool, bench: Bench) -> Case {
    let truth = std::sync::OnceLock::new();
    let run = move |seed: u64| {
        let (sensors, load) = (&bench.sensors, bench.load);
        let (truth, expected) = truth.get_or_init(|| {
            let truth = calibrated(sensors, &(bench.table)(sensors, 1, QUIET));
            let expected = if load.is_empty() {
                Vec::new()
            } else {
                predicted(sensors, &truth, load)
            };
            (truth, expected)
        });
        let added = bench.added(seed);
        let text = bench.table(seed, 1.0);
        let found = calibrated(sensors, &text);
        let lines = match sensors[0].element {
            Element::ThreeAxisCapacitor(_) => straight_lines(&made(sensors), &text),
            _ => Vec::new(),
        };
        let mut all = printed(&found, truth, &lines, added);
        if !load.is_empty() {
            let answers = predicted(sensors, &found, load);
            let value = |of: &[(String, f64)], name: &str| {
                of.iter().find(|(known, _)| known == name).map(|(_, v)| *v)
            };
            for (name, deviation) in &answers {
                let Some(own) = name.strip_suffix("_deviation") else {
                    continue;
                };
                let beside = if own.starts_with("capacitance") {
                    added
                } else {
                    0.0
                };
                let off = value(&answers, own).unwrap() - value(expected, own).unwrap() - beside;
                all.push((format!("predict {name}"), off.abs() <= WIDTH * deviation));
            }
        }
        all
    };
    Case {
        name,
        short,
        reached: 1.0,
        run: Box::new(run),
    }
}

/// Stiffnesses of a unit by straight lines through what it reads under the forces of a
/// table: they depend on the loads that the lines are drawn through.
fn straight_lines(unit: &ThreeAxisModel, text: &str) -> Vec<(String, f64)> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |axis: &str| {
        let title = format!("force_{axis} [mN]");
        names.iter().position(|name| *name == title)
    };
    let axes: Vec<(usize, &str)> = ["x", "y", "z"].into_iter().enumerate().collect();
    let read = axes.iter().filter(|(_, axis)| place(axis).is_some());
    let read: Vec<&(usize, &str)> = read.collect();
    let force = |line: &str| -> [f64; 3] {
        let fields: Vec<&str> = line.split(',').collect();
        ["x", "y", "z"].map(|axis| {
            let field = place(axis).and_then(|at| fields[at].parse::<f64>().ok());
            1e-3 * field.unwrap_or(0.0)
        })
    };
    let forces: Vec<[f64; 3]> = lines.map(force).collect();
    let row = |force: &[f64; 3]| {
        let capacitance = unit.predict(*force).1.capacitance();
        let motion = unit.effective_motion(unit.rest(), capacitance).displacement;
        let along = read.iter().map(|(axis, _)| motion[*axis]);
        along.chain([1.0]).collect()
    };
    let design: Vec<Vec<f64>> = forces.iter().map(row).collect();
    let of_axis = |(axis, name): &&(usize, &str)| {
        let target: Vec<f64> = forces.iter().map(|force| force[*axis]).collect();
        let line = linear::solve(&design, &target).unwrap().coefficients;
        let named = |(slope, (_, along)): (f64, &&(usize, &str))| {
            (format!("taxel_0.stiffness_{name}{along}"), slope)
        };
        line.into_iter().zip(&read).map(named).collect::<Vec<_>>()
    };
    read.iter().flat_map(of_axis).collect()
}

fn printed(found: &Outcome, truth: &Outcome, lines: &[(String, f64)], added: f64) -> Vec<Printed> {
    let inside = |[low, high]: [f64; 2], truth: f64| low <= truth && truth <= high;
    let mut all = Vec::new();
    for (parameter, estimate) in &found.parameters {
        let known =
            |(one, _): &&(taxel_numerics::least_squares::Parameter, _)| one.name == parameter.name;
        let Some((_, exact)) = truth.parameters.iter().find(known) else {
            continue;
        };
        if matches!(estimate.status, Status::Fixed | Status::NotIdentifiable) {
            continue;
        }
        let is_parallel = parameter.name.contains("parallel_capacitance");
        let beside = if is_parallel { added } else { 0.0 };
        let status = if estimate.status == Status::Identified {
            String::new()
        } else {
            format!(" ({})", estimate.status.name())
        };
        all.push((
            format!("{}{status}", parameter.name),
            inside(estimate.interval, exact.value + beside),
        ));
    }
    for derived in &found.derived {
        let line = lines.iter().find(|(name, _)| *name == derived.name);
        let other = truth.derived.iter().find(|one| one.name == derived.name);
        let exact = line.map(|(_, slope)| *slope).or(other.map(|one| one.value));
        if let (Some(interval), Some(exact)) = (derived.interval, exact) {
            all.push((derived.name.clone(), inside(interval, exact)));
        }
    }
    all
}
