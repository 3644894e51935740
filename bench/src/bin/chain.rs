//! The exact chain of the piezoelectric array beside real time: 8 channels,
//! 100 kS/s each, sample by sample on one core, in small blocks as they come. First
//! the beginning of the signal is compared with `peer_chain.py`, which solves the
//! same chain with 50 digits; it ends with 1 when they disagree.
//!
//! `PYTHON` names the interpreter that has mpmath (default `python3`). With
//! `--agree` nothing is timed.

use std::error::Error;
use std::hint::black_box;
use std::process::{Command, ExitCode};

use num_complex::Complex64;
use serde_json::json;
use taxel::sensor::Sensor;
use taxel_bench::{computed, figure};
use taxel_numerics::linear_chain::{Chain, Transfer};

/// Channels.
const CHANNELS: usize = 8;
/// Samples a second of each channel.
const RATE: usize = 100_000;
/// Length of the signal, s.
const SECONDS: usize = 10;
/// Samples of each channel that are computed in a row.
const BLOCK: usize = 1000;
/// Samples that are compared with the peer.
const COMPARED: usize = 1000;
/// Largest difference, as part of the largest output: rounding of modes that cancel.
const TOLERANCE: f64 = 1e-9;
/// Passes over the whole signal.
const ROUNDS: usize = 11;

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
    let sensor = Sensor::shipped("piezo-1.5mm").ok_or("is shipped")?;
    let array = sensor.piezoelectric()?;
    // The surface moves by up to 50 um at frequencies up to 1 kHz.
    let period = 1.0 / RATE as f64;
    let signal: Vec<f64> = (0..RATE * SECONDS)
        .map(|i| {
            let time = i as f64 * period;
            50e-6 * (std::f64::consts::TAU * 50.0 * time * time).sin()
        })
        .collect();
    let only_agree = std::env::args().any(|word| word == "--agree");
    let mut agree = true;
    for (name, transfer) in [
        (
            "output per displacement",
            array.output_per_displacement(array.path()?),
        ),
        ("output per force", array.output_per_force()),
    ] {
        let chain = Chain::new(&transfer)?;
        let apart = apart(&chain, &transfer, period, &signal[..COMPARED])?;
        println!("{name:<24} differs from the peer by {apart:.1e} of the largest output");
        agree &= apart < TOLERANCE;
        if only_agree {
            continue;
        }
        let mut ratios: Vec<f64> = (0..ROUNDS).map(|_| pass(&chain, period, &signal)).collect();
        ratios.sort_by(f64::total_cmp);
        let median = ratios[ROUNDS / 2];
        println!(
            "{name:<24} {CHANNELS} channels, {SECONDS} s at {RATE} samples/s: {median:.0} times \
             real time (median of {ROUNDS}, {:.0} to {:.0}), {:.1} ns per sample",
            ratios[0],
            ratios[ROUNDS - 1],
            1e9 / (median * (RATE * CHANNELS) as f64)
        );
        figure(&format!("chain.{}", name.replace(' ', "_")), median);
    }
    if !agree {
        println!("the results DISAGREE");
    }
    Ok(agree)
}

/// Largest difference from the peer over the samples `signal`, as part of the
/// largest output.
fn apart(
    chain: &Chain,
    transfer: &Transfer,
    period: f64,
    signal: &[f64],
) -> Result<f64, Box<dyn Error>> {
    let pairs = |numbers: &[Complex64]| -> Vec<[f64; 2]> {
        numbers
            .iter()
            .map(|number| [number.re, number.im])
            .collect()
    };
    let asked = json!({
        "factor": transfer.factor(),
        "zeros": pairs(transfer.zeros()),
        "poles": pairs(transfer.poles()),
        "period_s": period,
        "input": signal,
    });
    let file = std::env::temp_dir().join(format!("taxel-chain-{}.json", std::process::id()));
    std::fs::write(&file, asked.to_string())?;
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let answer = Command::new(&python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peer_chain.py"))
        .arg(&file)
        .output()?;
    std::fs::remove_file(&file)?;
    if !answer.status.success() {
        return Err(String::from_utf8_lossy(&answer.stderr).into());
    }
    let theirs: Vec<f64> = serde_json::from_slice(&answer.stdout)?;
    let (step, mut memory) = (chain.step(period), chain.settled(0.0));
    let mut worst = 0.0_f64;
    for (input, theirs) in signal.iter().zip(&theirs) {
        worst = worst.max((chain.advance(&mut memory, &step, *input) - theirs).abs());
    }
    let largest = theirs
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    Ok(worst / largest)
}

/// Speed of the whole signal over real time.
fn pass(chain: &Chain, period: f64, signal: &[f64]) -> f64 {
    let step = chain.step(period);
    let mut memories = vec![chain.settled(0.0); CHANNELS];
    let mut outputs = vec![0.0; BLOCK];
    let start = computed();
    for inputs in signal.chunks(BLOCK) {
        for memory in &mut memories {
            for (output, input) in outputs.iter_mut().zip(inputs) {
                *output = chain.advance(memory, &step, *input);
            }
            black_box(&outputs);
        }
    }
    SECONDS as f64 / (computed() - start)
}
