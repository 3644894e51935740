//! The estimator beside the same least squares in NumPy: same frames, one
//! thread each, in turns. Ends with 1 when their results disagree.
//!
//! `PYTHON` names the interpreter that has NumPy (default `python3`). With
//! `--agree` nothing is timed.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitCode, Stdio};
use std::time::Instant;

use serde_json::{Value, json};
use taxel::acquisition::Frame;
use taxel::calibration::ThreeAxisCalibration;
use taxel::estimation::{SearchOptions, UnitEstimate, estimate_unit};
use taxel::signal::Position;
use taxel_bench::{Scene, figure};

/// Turns of both programs; each is one pass over all frames or more.
const ROUNDS: usize = 21;
/// Passes over all frames in one turn of the estimator, which is faster.
const PASSES: usize = 20;
/// Largest difference of the forces, N.
const FORCE_TOLERANCE: f64 = 1e-9;
/// Largest difference of standard deviations, N: to 1e-6 of about 50 uN.
const DEVIATION_TOLERANCE: f64 = 1e-10;
/// Largest difference of residuals, standard deviations.
const RESIDUAL_TOLERANCE: f64 = 1e-5;
/// Most that following the drift of readings without drift may move a force, in its
/// standard deviations.
const DRIFT_TOLERANCE: f64 = 1.0;

fn main() -> ExitCode {
    match run() {
        Ok(agree) => ExitCode::from(u8::from(!agree)),
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<bool, Box<dyn Error>> {
    let mut scene = Scene::new();
    let file = std::env::temp_dir().join(format!("taxel-compare-{}.json", std::process::id()));
    std::fs::write(&file, export(&scene).to_string())?;
    let peer = Peer::start(&file);
    let only_agree = std::env::args().any(|word| word == "--agree");
    let result = peer.and_then(|mut peer| {
        let agree = agree(&mut scene, &peer.forces()?)?;
        if !only_agree {
            measure(&mut scene, &mut peer)?;
        }
        Ok(agree)
    });
    std::fs::remove_file(&file)?;
    result
}

/// Times both in turns and prints the medians.
fn measure(scene: &mut Scene, peer: &mut Peer) -> Result<(), Box<dyn Error>> {
    let mut theirs = Vec::new();
    let mut ours = [Vec::new(), Vec::new()];
    let mut ratios = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        let taxel = [units_alone(scene), whole_frame(scene)?];
        let numpy = peer.turn()?;
        theirs.push(numpy);
        for (i, taxel) in taxel.into_iter().enumerate() {
            ours[i].push(taxel);
            ratios[i].push(numpy / taxel);
        }
    }
    println!(
        "NumPy, 64 units        {:8.2} us per frame",
        median(&mut theirs)
    );
    for (i, (name, short)) in [
        ("taxel, 64 units", "units"),
        ("taxel, whole frame", "frame"),
    ]
    .into_iter()
    .enumerate()
    {
        let (taxel, ratio) = (median(&mut ours[i]), median(&mut ratios[i]));
        let (least, most) = (ratios[i][0], ratios[i][ROUNDS - 1]);
        println!(
            "{name:<22} {taxel:8.2} us per frame, {:6.0} frames/s, ratio {ratio:.1} \
             (median of {ROUNDS} rounds, {least:.1} to {most:.1})",
            1e6 / taxel
        );
        figure(&format!("compare.{short}_us"), taxel);
        figure(&format!("compare.{short}"), ratio);
    }
    Ok(())
}

/// Microseconds per frame of just what the peer does: counts to force,
/// covariance and residual of each unit.
fn units_alone(scene: &Scene) -> f64 {
    let calibration = scene.calibration();
    let start = Instant::now();
    for _ in 0..PASSES {
        for frame in &scene.pressed {
            for taxel in 0..calibration.units.len() {
                std::hint::black_box(unit_alone(calibration, frame, taxel));
            }
        }
    }
    start.elapsed().as_secs_f64() * 1e6 / (PASSES * scene.pressed.len()) as f64
}

/// One unit of a frame by its calibration, without any history.
fn unit_alone(calibration: &ThreeAxisCalibration, frame: &Frame, taxel: usize) -> UnitEstimate {
    let options = SearchOptions::default();
    let counts = &frame.values[4 * taxel..];
    let channel = calibration.channel;
    let capacitance = std::array::from_fn(|i| match channel.position(counts[i]) {
        Position::Inside => channel.input(counts[i]),
        Position::Dead | Position::AtEnd => f64::NAN,
    });
    let (unit, sigma) = (&calibration.units[taxel], calibration.deviation[taxel]);
    estimate_unit(unit, capacitance, sigma, [true; 4], &options)
}

/// Microseconds per frame of the estimator of the array.
fn whole_frame(scene: &mut Scene) -> Result<f64, Box<dyn Error>> {
    let start = Instant::now();
    for _ in 0..PASSES {
        for frame in &scene.pressed {
            std::hint::black_box(scene.estimator.push(frame)?);
        }
    }
    Ok(start.elapsed().as_secs_f64() * 1e6 / (PASSES * scene.pressed.len()) as f64)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Compares all results of all frames for the work that both do, and prints the
/// largest differences. The whole frame follows drift besides, which the peer does
/// not: by how much that moves a force is printed and bounded by its deviation.
fn agree(scene: &mut Scene, peer: &Value) -> Result<bool, Box<dyn Error>> {
    let (mut force, mut deviation, mut residual) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut drift = 0.0_f64;
    let number = |value: &Value| value.as_f64().unwrap_or(f64::INFINITY);
    for index in 0..scene.pressed.len() {
        for unit in 0..scene.calibration().units.len() {
            let found = unit_alone(scene.calibration(), &scene.pressed[index], unit);
            let theirs = |key: &str| &peer[key][index][unit];
            for axis in 0..3 {
                let off = number(&theirs("force")[axis]) - found.force[axis];
                force = force.max(off.abs());
                let off = number(&theirs("deviation")[axis]) - found.deviation()[axis];
                deviation = deviation.max(off.abs());
            }
            // The sign of a residual near zero is chance.
            let off = number(theirs("residual")).abs() - found.signed_residual.abs();
            residual = residual.max(off.abs());
        }
        for (unit, [value, sigma]) in scene.estimate(index)?.into_iter().enumerate() {
            let off = number(&peer["force"][index][unit][2]) - value;
            drift = drift.max(off.abs() / sigma);
        }
    }
    println!(
        "largest difference: force {force:.1e} N, its deviation {deviation:.1e} N, residual {residual:.1e}; \
         the whole frame, which follows drift: {drift:.2} deviations"
    );
    let agree = force < FORCE_TOLERANCE
        && deviation < DEVIATION_TOLERANCE
        && residual < RESIDUAL_TOLERANCE
        && drift < DRIFT_TOLERANCE;
    if !agree {
        println!("the results DISAGREE");
    }
    Ok(agree)
}

/// Model and frames for the peer.
fn export(scene: &Scene) -> Value {
    let calibration: &ThreeAxisCalibration = scene.calibration();
    let first = &calibration.units[0];
    let units = || calibration.units.iter();
    json!({
        "electrode_m": first.plates.electrode,
        "insulation_gap_m": first.plates.insulation_gap,
        "air_gap_m": units().map(|unit| unit.plates.air_gap).collect::<Vec<_>>(),
        "parallel_capacitance_f": units().map(|unit| unit.plates.parallel_capacitance).collect::<Vec<_>>(),
        "compliance_m_per_n": first.suspension.compliance,
        "centre_distance_m": first.suspension.centre_distance,
        "tile_tilt": first.suspension.tile_tilt,
        "bump_sinking": first.suspension.bump_sinking,
        "deviation_f": calibration.deviation,
        "farad_at_zero": calibration.channel.at_zero,
        "farad_per_count": calibration.channel.per_number,
        "frames": scene.pressed.iter().map(|frame| frame.values.clone()).collect::<Vec<_>>(),
    })
}

/// The Python program, which answers one line for each line.
struct Peer {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    fn start(scene: &Path) -> Result<Self, Box<dyn Error>> {
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
        let mut child = Command::new(&python)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peer_numpy.py"))
            .arg(scene)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{python}: {error}"))?;
        let input = child.stdin.take().ok_or("no stdin")?;
        let output = BufReader::new(child.stdout.take().ok_or("no stdout")?);
        let mut peer = Self {
            child,
            input,
            output,
        };
        match peer.line()?.trim() {
            "ready" => Ok(peer),
            _ => Err(format!("{python} failed; name one that has NumPy: PYTHON=...").into()),
        }
    }

    fn line(&mut self) -> Result<String, Box<dyn Error>> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(line)
    }

    fn turn(&mut self) -> Result<f64, Box<dyn Error>> {
        writeln!(self.input, "round")?;
        Ok(self.line()?.trim().parse()?)
    }

    fn forces(&mut self) -> Result<Value, Box<dyn Error>> {
        writeln!(self.input, "forces")?;
        Ok(serde_json::from_str(&self.line()?)?)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It is this program's own child and holds nothing to save.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
