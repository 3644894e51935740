//! The fit of three in-plane sensors beside SciPy: the same readings, model,
//! slopes, start and sizes, one thread each, in turns. Ends with 1 when they
//! disagree.
//!
//! `PYTHON` names the interpreter that has SciPy (default `python3`). With
//! `--agree` nothing is timed: one round, and MINPACK's method alone.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use serde_json::{Value, json};
use taxel::mechanics::LayerKinematics;
use taxel::sensor::Sensor;
use taxel_bench::figure;
use taxel_calibrate::{
    CalibrateOptions, HoldOut, NamedSensor, ReadingTable, SyntheticOptions, calibrator,
};
use taxel_numerics::least_squares::{Estimate, FitOptions, Parameter, Problem, fit};

const ROUNDS: usize = 21;
/// Values may differ by this share of their standard deviations: both searches
/// stop within rounding of the same minimum.
const TOLERANCE: f64 = 1e-4;

fn main() -> ExitCode {
    match run() {
        Ok(agree) => ExitCode::from(u8::from(!agree)),
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Largest difference of the peer's numbers from ours, in our deviations.
fn largest_difference(theirs: &Value, ours: &[Estimate], number: impl Fn(&Estimate) -> f64) -> f64 {
    let apart = ours.iter().enumerate().map(|(at, estimate)| {
        let theirs = theirs[at].as_f64().unwrap_or(f64::INFINITY);
        (theirs - number(estimate)).abs() / estimate.deviation
    });
    apart.fold(0.0, f64::max)
}

fn run() -> Result<bool, Box<dyn Error>> {
    let sensors = shipped()?;
    let named: Vec<NamedSensor<'_>> = sensors
        .iter()
        .map(|sensor| NamedSensor {
            name: &sensor.name,
            text: "",
            sensor,
        })
        .collect();
    let calibrator = calibrator(&named)?;
    let text = calibrator.synthetic(&SyntheticOptions {
        cycles: 1,
        readings: 400,
        noise: 0.002,
        ..SyntheticOptions::default()
    });
    let data = ReadingTable::parse("bench", &text, calibrator.columns(), calibrator.group())?;
    let three = Three::new(&sensors, &data)?;
    let parameters = three.parameters();
    let options = FitOptions::default();
    let file = std::env::temp_dir().join(format!("taxel-fit-{}.json", std::process::id()));
    std::fs::write(&file, three.export(&parameters).to_string())?;
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peer_scipy.py");
    let mut peer = Command::new(python)
        .arg(script)
        .arg(&file)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut input = peer.stdin.take().ok_or("no input")?;
    let mut lines = BufReader::new(peer.stdout.take().ok_or("no output")?).lines();
    lines.next().ok_or("the peer did not start")??;
    let mut agree = true;
    let mut times = [const { Vec::new() }; 3];
    let mut ratios = [const { Vec::new() }; 2];
    let only_agree = std::env::args().any(|word| word == "--agree");
    let (rounds, methods) = if only_agree {
        (1, &["lm"][..])
    } else {
        (ROUNDS, &["lm", "trf"][..])
    };
    for round in 0..rounds {
        let begun = Instant::now();
        let ours = fit(&three, &parameters, &options)?;
        let seconds = begun.elapsed().as_secs_f64();
        times[0].push(seconds);
        for (place, method) in methods.iter().copied().enumerate() {
            writeln!(input, "fit {method}")?;
            let theirs: Value = serde_json::from_str(&lines.next().ok_or("the peer ended")??)?;
            let peer_seconds = theirs["seconds"].as_f64().ok_or("no time")?;
            times[1 + place].push(peer_seconds);
            ratios[place].push(peer_seconds / seconds);
            let worst = largest_difference(&theirs["values"], &ours.estimates, |e| e.value);
            let deviations =
                largest_difference(&theirs["deviations"], &ours.estimates, |e| e.deviation);
            // With bounds SciPy may end elsewhere: only its time counts.
            agree &= method == "trf" || (worst <= TOLERANCE && deviations <= TOLERANCE);
            if round == 0 {
                println!(
                    "{method}: values apart by {worst:.1e} of their deviations, deviations by {deviations:.1e}; steps {} ours, {} theirs; sum of squares {:.6} ours, {:.6} theirs",
                    ours.iterations,
                    theirs["evaluations"],
                    ours.chi_square,
                    theirs["square_sum"].as_f64().unwrap_or(f64::NAN)
                );
            }
        }
    }
    drop(input);
    peer.wait()?;
    std::fs::remove_file(&file)?;
    if only_agree {
        return Ok(agree);
    }
    let [ours, lm, trf] = times.map(median);
    println!(
        "one fit, 17 parameters, {} readings: taxel {:.2} ms",
        three.readings(),
        1e3 * ours
    );
    println!("SciPy lm {:.1} ms, trf {:.1} ms", 1e3 * lm, 1e3 * trf);
    let [lm, trf] = ratios.map(median);
    println!("ratio, median of {ROUNDS} rounds: lm {lm:.1}, trf {trf:.1}");
    figure("calibrate.fit_ms", 1e3 * ours);
    figure("calibrate.lm", lm);
    figure("calibrate.trf", trf);
    let begun = Instant::now();
    let options = CalibrateOptions {
        hold_out: HoldOut::default(),
        ..CalibrateOptions::default()
    };
    calibrator.calibrate(&data, &options)?;
    println!(
        "whole calibration (three models, all starts, noise, hold-out): {:.1} ms",
        1e3 * begun.elapsed().as_secs_f64()
    );
    Ok(agree)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The shipped sensors under the published law.
fn shipped() -> Result<Vec<Sensor>, Box<dyn Error>> {
    ["in-plane-20um", "in-plane-50um", "in-plane-100um"]
        .iter()
        .map(|name| {
            let text = Sensor::shipped_text(name).ok_or("is shipped")?;
            let text = text.replace("law = \"mechanics\"", "law = \"published\"");
            // One end factor for all compressions, as in the fit.
            let text = text.replace("\"short_layer\"", "{ given = { chi = 0.909 } }");
            Ok(Sensor::parse(name, &text)?)
        })
        .collect()
}

/// Readings of one sensor with what of them does not depend on parameters.
struct One {
    /// ε₀ε_r w_e T/D.
    scale: f64,
    rest: f64,
    sigma: [f64; 2],
    rows: Vec<Row>,
}

struct Row {
    e: f64,
    over_gap: f64,
    logarithm: f64,
    /// ε₀ε_r w_e T/d.
    per: f64,
    /// Force per modulus: `alone` + χ·`by_factor`.
    alone: f64,
    by_factor: f64,
    force: f64,
    capacitance: f64,
}

struct Three(Vec<One>);

impl Three {
    fn new(sensors: &[Sensor], data: &ReadingTable) -> Result<Self, Box<dyn Error>> {
        let one = |sensor: &Sensor| -> Result<One, Box<dyn Error>> {
            let model = sensor.in_plane()?.model();
            let layer = model.layer;
            let scale = model.rest_capacitance_without_fringe();
            let (gap, aspect) = (model.electrodes.gap, layer.aspect());
            let mut rows = Vec::new();
            for row in 0..data.len() {
                let of = data.number(row, 5).ok_or("no gap")?;
                let displacement = data.number(row, 3).ok_or("no displacement")?;
                if (of / gap - 1.0).abs() > 0.1 || displacement <= 0.0 {
                    continue;
                }
                let kinematics = LayerKinematics::new(displacement / layer.thickness)?;
                let unit = layer.contact_area() / 3.0;
                let alone = unit * kinematics.mean_stress(aspect, 0.0);
                let stretch = 1.0 + layer.stretch_excess(&kinematics, model.electrodes.middle());
                rows.push(Row {
                    e: kinematics.compression(),
                    over_gap: displacement / gap,
                    logarithm: (displacement / gap).ln(),
                    per: scale / stretch,
                    alone,
                    by_factor: unit * kinematics.mean_stress(aspect, 1.0) - alone,
                    force: data.number(row, 2).ok_or("no force")?,
                    capacitance: data.number(row, 4).ok_or("no capacitance")?,
                });
            }
            let rest = model.rest_capacitance();
            let largest = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).fold(0.0, f64::max);
            Ok(One {
                sigma: [
                    0.002 * largest(&|row| row.force),
                    0.002 * largest(&|row| rest - row.capacitance),
                ],
                scale,
                rest,
                rows,
            })
        };
        Ok(Self(sensors.iter().map(one).collect::<Result<_, _>>()?))
    }

    fn parameters(&self) -> Vec<Parameter> {
        let parameter = |start: f64, bounds: [f64; 2], size: f64| Parameter {
            bounds,
            size,
            ..Parameter::new("", start)
        };
        let mut parameters = vec![
            parameter(1.2e6, [6e4, 2.4e7], 1.2e5),
            parameter(0.85, [0.65, 20.0], 0.1),
        ];
        for one in &self.0 {
            parameters.extend([
                parameter(
                    1.01 * one.rest,
                    [0.1 * one.rest, 10.0 * one.rest],
                    0.01 * one.rest,
                ),
                parameter(1.0, [1e-3, 100.0], 0.3),
                parameter(0.0, [-0.95, 3.0], 0.1),
                parameter(0.8, [0.05, 1.0], 0.1),
                parameter(10.0, [0.05, 100.0], 3.0),
            ]);
        }
        parameters
    }

    fn export(&self, parameters: &[Parameter]) -> Value {
        let sensors: Vec<Value> = self
            .0
            .iter()
            .map(|one| {
                let all = |of: &dyn Fn(&Row) -> f64| one.rows.iter().map(of).collect::<Vec<_>>();
                json!({
                    "scale": one.scale,
                    "sigma_f": one.sigma[0],
                    "sigma_c": one.sigma[1],
                    "e": all(&|row| row.e),
                    "u": all(&|row| row.over_gap),
                    "logu": all(&|row| row.logarithm),
                    "per": all(&|row| row.per),
                    "s0": all(&|row| row.alone),
                    "s1": all(&|row| row.by_factor),
                    "f": all(&|row| row.force),
                    "c": all(&|row| row.capacitance),
                })
            })
            .collect();
        let all = |of: &dyn Fn(&Parameter) -> f64| parameters.iter().map(of).collect::<Vec<_>>();
        json!({
            "sensors": sensors,
            "start": all(&|p| p.start),
            "low": all(&|p| p.bounds[0]),
            "high": all(&|p| p.bounds[1]),
            "sizes": all(&|p| p.size),
        })
    }

    fn rows(&self) -> usize {
        self.0.iter().map(|one| one.rows.len()).sum()
    }
}

impl Problem for Three {
    fn readings(&self) -> usize {
        2 * self.rows()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let (mut index, rows) = (0, self.rows());
        for (sensor, one) in self.0.iter().enumerate() {
            let own = &at[2 + 5 * sensor..7 + 5 * sensor];
            for row in &one.rows {
                let thinned = -(-own[4] * row.e).exp_m1();
                let facing = one.scale - row.per * (1.0 - (1.0 - own[3]) * thinned);
                let change = facing * own[1] * (own[2] * row.logarithm).exp();
                let force = at[0] * (row.alone + at[1] * row.by_factor);
                residuals[index] = (row.capacitance - own[0] + change) / one.sigma[1];
                residuals[rows + index] = (row.force - force) / one.sigma[0];
                index += 1;
            }
        }
        true
    }

    fn slopes(&self, _: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        let (mut index, rows) = (0, self.rows());
        for column in columns.iter_mut() {
            column.fill(0.0);
        }
        for (sensor, one) in self.0.iter().enumerate() {
            let first = 2 + 5 * sensor;
            let own = &at[first..first + 5];
            for row in &one.rows {
                let gone = (-own[4] * row.e).exp();
                let facing = one.scale - row.per * (1.0 - (1.0 - own[3]) * (1.0 - gone));
                let power = (own[2] * row.logarithm).exp() / one.sigma[1];
                let thinning = own[1] * power * row.per;
                columns[first][index] = -1.0 / one.sigma[1];
                columns[first + 1][index] = facing * power;
                columns[first + 2][index] = own[1] * facing * power * row.logarithm;
                columns[first + 3][index] = -thinning * (1.0 - gone);
                columns[first + 4][index] = thinning * (1.0 - own[3]) * row.e * gone;
                let stress = row.alone + at[1] * row.by_factor;
                columns[0][rows + index] = -stress / one.sigma[0];
                columns[1][rows + index] = -at[0] * row.by_factor / one.sigma[0];
                index += 1;
            }
        }
        true
    }
}
