//! Whole tables through `taxel predict` beside the bare arithmetic, for every
//! shipped device: a table of loads is read, answered and written as CSV in
//! memory, on one core and on all; and the same loads go through the device's
//! own prediction in a plain loop. All in turns within one run; one core by the
//! time that its thread computed, all cores by the clock.
//!
//! `predict --rows N` (default 1000000).

use std::error::Error;
use std::fmt::Write as _;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

use serde_json::Map;
use taxel::device::{
    ChannelPredictor, Drive, InPlanePredictor, PiezoelectricPredictor, ThreeAxisPredictor,
};
use taxel::mechanics::Profile;
use taxel::predict::{Answers, Loads, Predictor, Refusal};
use taxel::sensor::Sensor;
use taxel::table::Format;
use taxel_bench::computed;

/// Turns of the three measurements.
const ROUNDS: usize = 5;
/// A load on a piezoelectric element is a search for two peaks over time,
/// hundreds of times the work of the others: one row for this many.
const PIEZOELECTRIC_SHARE: usize = 100;
/// Ramp of the steps on the piezoelectric element, s.
const RAMP: f64 = 0.01;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let rows = match words[..] {
        [] => 1_000_000,
        ["--rows", text] => text.parse::<usize>()?.max(PIEZOELECTRIC_SHARE),
        _ => return Err("usage: predict [--rows N]".into()),
    };
    let cores = std::thread::available_parallelism()?.get();
    println!("median (least) of {ROUNDS} rounds; {cores} cores");
    println!(
        "{:<17} {:>8} {:>7} {:>8} {:>17} {:>17} {:>14} {:>13} {:>13}",
        "device",
        "rows",
        "MB in",
        "MB out",
        "loop, ns/row",
        "1 core, ns/row",
        "ratio",
        "rows/s 1 core",
        "rows/s all"
    );

    let sensor = Sensor::shipped("three-axis-8x8").ok_or("is shipped")?;
    let three_axis = ThreeAxisPredictor::new(&sensor.three_axis()?);
    let forces: Vec<[f64; 3]> = (0..rows)
        .map(|i| {
            [
                60.0 * wave(i, 0.37),
                60.0 * wave(i, 0.61),
                30.0 + 30.0 * wave(i, 0.83),
            ]
        })
        .collect();
    let text = table(
        "force_x [mN],force_y [mN],force_z [mN]",
        &forces,
        |line, [x, y, z]| write!(line, "{x:.4},{y:.4},{z:.4}"),
    );
    measure("three-axis-8x8", &three_axis, &text, |load| {
        let force = [0, 1, 2].map(load);
        black_box(three_axis.predict(force));
    })?;

    let sensor = Sensor::shipped("in-plane-50um").ok_or("is shipped")?;
    let in_plane = InPlanePredictor::new(&sensor.in_plane()?);
    let compressions: Vec<f64> = (0..rows).map(|i| 0.1 + 0.1 * wave(i, 0.37)).collect();
    let text = table("compression", &compressions, |line, e| {
        write!(line, "{e:.6}")
    });
    measure("in-plane-50um", &in_plane, &text, |load| {
        black_box(in_plane.at_compression(load(1))).ok();
    })?;

    let sensor = Sensor::shipped("liquid-metal-2x4").ok_or("is shipped")?;
    let channels = ChannelPredictor::new(&sensor.channels()?);
    let pressures: Vec<f64> = (0..rows).map(|i| 25.0 + 25.0 * wave(i, 0.37)).collect();
    let text = table("pressure [kPa]", &pressures, |line, p| {
        write!(line, "{p:.4}")
    });
    measure("liquid-metal-2x4", &channels, &text, |load| {
        black_box(channels.predict(load(0), 1.0)).ok();
    })?;

    let sensor = Sensor::shipped("piezo-1.5mm").ok_or("is shipped")?;
    let element = PiezoelectricPredictor::new(&sensor.piezoelectric()?);
    let tops: Vec<f64> = (0..rows / PIEZOELECTRIC_SHARE)
        .map(|i| 50.0 + 49.0 * wave(i, 0.37))
        .collect();
    let text = table("profile,displacement [um],ramp [s]", &tops, |line, top| {
        write!(line, "step,{top:.4},{RAMP}")
    });
    measure("piezo-1.5mm", &element, &text, |load| {
        let step = Profile::Step { ramp: RAMP };
        black_box(element.test(&step, Drive::Displacement(load(1))));
    })
}

/// A number from -1 to 1 that hardly repeats.
fn wave(index: usize, turn: f64) -> f64 {
    (index as f64 * turn).sin()
}

/// A table with one line per load.
fn table<T: Copy>(
    header: &str,
    loads: &[T],
    line: impl Fn(&mut String, T) -> std::fmt::Result,
) -> String {
    let mut text = format!("{header}\n");
    for load in loads {
        line(&mut text, *load).expect("text takes everything");
        text.push('\n');
    }
    text
}

/// Measures one device and prints its line; `bare` is its own prediction, and
/// gets the numbers of a load by column.
fn measure(
    name: &str,
    predictor: &dyn Predictor,
    text: &str,
    bare: impl Fn(&dyn Fn(usize) -> f64),
) -> Result<(), Box<dyn Error>> {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    // None stands for the number of cores.
    let (one, all) = (pool(1)?, pool(0)?);
    let loads = Loads::parse(name, text, predictor.load_columns())?;
    let rows = loads.len() as f64;
    let mut times = [const { Vec::new() }; 3];
    let mut ratios = Vec::new();
    let mut written = 0;
    for _ in 0..ROUNDS {
        let start = computed();
        for index in 0..loads.len() {
            let load = loads.load(index);
            bare(&|column| load.number(column).unwrap_or(0.0));
        }
        let arithmetic = computed() - start;
        let (result, on_one) = one.install(|| {
            let start = computed();
            (whole(name, predictor, text), computed() - start)
        });
        written = result?;
        let start = Instant::now();
        all.install(|| whole(name, predictor, text))?;
        let on_all = start.elapsed().as_secs_f64();
        ratios.push(on_one / arithmetic);
        for (times, time) in times.iter_mut().zip([arithmetic, on_one, on_all]) {
            times.push(time / rows);
        }
    }
    let sort = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        [values[values.len() / 2], values[0]]
    };
    let [arithmetic, on_one, on_all] = times.each_mut().map(sort);
    let ratio = sort(&mut ratios);
    let nanoseconds =
        |[median, least]: [f64; 2]| format!("{:.0} ({:.0})", median * 1e9, least * 1e9);
    println!(
        "{name:<17} {rows:>8} {:>7.1} {:>8.1} {:>17} {:>17} {:>14} {:>13.0} {:>13.0}",
        text.len() as f64 * 1e-6,
        written as f64 * 1e-6,
        nanoseconds(arithmetic),
        nanoseconds(on_one),
        format!("{:.2} ({:.2})", ratio[0], ratio[1]),
        1.0 / on_one[0],
        1.0 / on_all[0]
    );
    Ok(())
}

/// The whole way of a table: from its text to the text of the answers, whose
/// bytes are counted.
fn whole(name: &str, predictor: &dyn Predictor, text: &str) -> Result<usize, String> {
    let columns = predictor.load_columns();
    let loads = Loads::parse(name, text, columns).map_err(|error| error.to_string())?;
    let mut bytes = 0;
    let result = Answers::new(predictor, &loads).write(Format::Csv, &Map::new(), |piece| {
        bytes += black_box(piece).len();
        Ok::<(), String>(())
    });
    result.map(|()| bytes).map_err(|refusal| match refusal {
        Refusal::Load(index, why) => format!("line {}: {}", loads.line(index), why.message),
        Refusal::Sink(error) => error,
    })
}
