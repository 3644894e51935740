//! Whole tables through `taxel predict` beside the bare arithmetic, for every
//! shipped device: a table of loads is read, answered and written as CSV in
//! memory, on one core and on all; and the same loads go through the device's
//! own prediction in a plain loop. All in turns within one run; one core by the
//! time that its thread computed, all cores by the clock.
//!
//! `predict --rows N` (default 1000000). First one column of the table is compared with
//! the device's own answers; it ends with 1 when they disagree. With `--agree` nothing is
//! timed.

use std::error::Error;
use std::fmt::Write as _;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

use serde_json::Map;
use taxel::device::{
    Drive, InPlanePredictor, MicrochannelPredictor, PiezoelectricPredictor, ThreeAxisPredictor,
};
use taxel::mechanics::Profile;
use taxel::predict::{Answers, Loads, Predictor, Refusal};
use taxel::sensor::Sensor;
use taxel::table::Format;
use taxel_bench::{computed, figure};

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
    let (rows, only_agree) = match words[..] {
        [] => (1_000_000, false),
        ["--rows", text] => (text.parse::<usize>()?.max(PIEZOELECTRIC_SHARE), false),
        ["--agree"] => (1000, true),
        _ => return Err("usage: predict [--rows N | --agree]".into()),
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
    let compared = Compared {
        column: "capacitance_12 [fF]",
        si_per_unit: 1e-15,
        only: only_agree,
    };
    measure("three-axis-8x8", &three_axis, &text, &compared, |load| {
        let force = [0, 1, 2].map(load);
        black_box(three_axis.predict(force)).response.capacitance()[1]
    })?;

    let sensor = Sensor::shipped("in-plane-50um").ok_or("is shipped")?;
    let in_plane = InPlanePredictor::new(&sensor.in_plane()?);
    let compressions: Vec<f64> = (0..rows).map(|i| 0.1 + 0.1 * wave(i, 0.37)).collect();
    let text = table("compression", &compressions, |line, e| {
        write!(line, "{e:.6}")
    });
    let compared = Compared {
        column: "change_mechanics [fF]",
        ..compared
    };
    measure("in-plane-50um", &in_plane, &text, &compared, |load| {
        let found = black_box(in_plane.at_compression(load(1)));
        found
            .ok()
            .and_then(|found| found.mechanics)
            .unwrap_or(f64::NAN)
    })?;

    let sensor = Sensor::shipped("liquid-metal-2x4").ok_or("is shipped")?;
    let channels = MicrochannelPredictor::new(&sensor.microchannels()?);
    let pressures: Vec<f64> = (0..rows).map(|i| 25.0 + 25.0 * wave(i, 0.37)).collect();
    let text = table("pressure [kPa]", &pressures, |line, p| {
        write!(line, "{p:.4}")
    });
    let compared = Compared {
        column: "column_change",
        si_per_unit: 1.0,
        ..compared
    };
    measure("liquid-metal-2x4", &channels, &text, &compared, |load| {
        let found = black_box(channels.predict(load(0), 1.0));
        found.map_or(f64::NAN, |found| found.layers[1].change)
    })?;

    let sensor = Sensor::shipped("piezo-1.5mm").ok_or("is shipped")?;
    let element = PiezoelectricPredictor::new(&sensor.piezoelectric()?);
    let tops: Vec<f64> = (0..rows / PIEZOELECTRIC_SHARE)
        .map(|i| 50.0 + 49.0 * wave(i, 0.37))
        .collect();
    let text = table("profile,displacement [um],ramp [s]", &tops, |line, top| {
        write!(line, "step,{top:.4},{RAMP}")
    });
    let compared = Compared {
        column: "a1 [mV]",
        si_per_unit: 1e-3,
        ..compared
    };
    measure("piezo-1.5mm", &element, &text, &compared, |load| {
        let step = Profile::Step { ramp: RAMP };
        let found = black_box(element.test(&step, Drive::Displacement(load(1))));
        found.map_or(f64::NAN, |found| found.first)
    })
}

/// The column of a table that is compared with the device's own answers.
struct Compared {
    column: &'static str,
    si_per_unit: f64,
    /// True if nothing is timed.
    only: bool,
}

/// Largest relative difference of a printed number: the fewest digits that come back
/// exactly, in another unit.
const TOLERANCE: f64 = 1e-14;

/// Compares one column of the answers with the device's own.
fn agree(
    name: &str,
    text: &str,
    answers: &str,
    compared: &Compared,
    bare: impl Fn(usize) -> f64,
) -> Result<(), Box<dyn Error>> {
    let mut lines = answers.lines();
    let header = lines.next().ok_or("the answers have no header")?;
    let column = header.split(',').position(|name| name == compared.column);
    let column = column.ok_or_else(|| format!("{name}: no column {}", compared.column))?;
    let mut worst = 0.0_f64;
    let mut rows = 0;
    for (index, line) in lines.enumerate() {
        let cell = line.split(',').nth(column).unwrap_or_default();
        let printed = cell.parse().unwrap_or(f64::NAN) * compared.si_per_unit;
        let own = bare(index);
        if !(printed.is_nan() && own.is_nan()) {
            let apart = (printed - own).abs() / own.abs().max(f64::MIN_POSITIVE);
            worst = worst.max(if apart.is_nan() { f64::INFINITY } else { apart });
        }
        rows += 1;
    }
    if rows + 1 != text.lines().count() || worst > TOLERANCE {
        return Err(format!("{name}: the results DISAGREE by {worst:.1e} over {rows} rows").into());
    }
    println!(
        "{name:<17} {rows} rows agree to {worst:.1e} ({})",
        compared.column
    );
    Ok(())
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
    compared: &Compared,
    bare: impl Fn(&dyn Fn(usize) -> f64) -> f64,
) -> Result<(), Box<dyn Error>> {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    // None stands for the number of cores.
    let (one, all) = (pool(1)?, pool(0)?);
    let loads = Loads::parse(name, text, predictor.load_columns())?;
    let rows = loads.len() as f64;
    let own = |index: usize| {
        let load = loads.load(index);
        bare(&|column| load.number(column).unwrap_or(0.0))
    };
    let mut answers = String::new();
    whole(name, predictor, text, |piece| answers.push_str(piece))?;
    agree(name, text, &answers, compared, own)?;
    drop(answers);
    if compared.only {
        return Ok(());
    }
    let mut times = [const { Vec::new() }; 3];
    let mut ratios = Vec::new();
    let mut written = 0;
    for _ in 0..ROUNDS {
        let start = computed();
        for index in 0..loads.len() {
            black_box(own(index));
        }
        let arithmetic = computed() - start;
        let (result, on_one) = one.install(|| {
            let start = computed();
            (bytes(name, predictor, text), computed() - start)
        });
        written = result?;
        let start = Instant::now();
        all.install(|| bytes(name, predictor, text))?;
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
    figure(&format!("predict.{name}_ns"), 1e9 * on_one[0]);
    figure(&format!("predict.{name}"), ratio[0]);
    Ok(())
}

/// Bytes of the answers of a whole table.
fn bytes(name: &str, predictor: &dyn Predictor, text: &str) -> Result<usize, String> {
    let mut bytes = 0;
    whole(name, predictor, text, |piece| {
        bytes += black_box(piece).len();
    })?;
    Ok(bytes)
}

/// The whole way of a table: from its text to the text of the answers, piece by piece.
fn whole(
    name: &str,
    predictor: &dyn Predictor,
    text: &str,
    mut take: impl FnMut(&str),
) -> Result<(), String> {
    let columns = predictor.load_columns();
    let loads = Loads::parse(name, text, columns).map_err(|error| error.to_string())?;
    let result = Answers::new(predictor, &loads).write(Format::Csv, &Map::new(), |piece| {
        take(piece);
        Ok::<(), String>(())
    });
    result.map_err(|refusal| match refusal {
        Refusal::Load(index, why) => format!("line {}: {}", loads.line(index), why.message),
        Refusal::Sink(error) => error,
    })
}
