//! The exact chain of the piezoelectric array beside real time: 8 channels,
//! 100 kS/s each, sample by sample on one core, in small blocks as they come.

use std::error::Error;
use std::hint::black_box;
use std::process::ExitCode;

use taxel_numerics::linear_chain::Chain;
use taxel::sensor::Sensor;
use taxel_bench::computed;

/// Channels.
const CHANNELS: usize = 8;
/// Samples a second of each channel.
const RATE: usize = 100_000;
/// Length of the signal, s.
const SECONDS: usize = 10;
/// Samples of each channel that are computed in a row.
const BLOCK: usize = 1000;
/// Passes over the whole signal.
const ROUNDS: usize = 11;

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
    for (name, transfer) in [
        (
            "output per displacement",
            array.output_per_displacement(array.path()?),
        ),
        ("output per force", array.output_per_force()),
    ] {
        let chain = Chain::new(&transfer)?;
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
    }
    Ok(())
}

/// How many times faster than real time the whole signal went through.
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
