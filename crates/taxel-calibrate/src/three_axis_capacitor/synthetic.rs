//! Synthetic calibration data of a three-axis unit, of known true constants.

use std::fmt::Write as _;

use super::problem::{least_gap, name, unit, values};
use crate::hysteresis;
use crate::options::SyntheticOptions;
use taxel::mechanics::LoadHistory;
use taxel::transduction::ThreeAxisModel;
use taxel_numerics::Noise;

/// Share of the readings at rest before each cycle.
const AT_REST: f64 = 0.1;
/// Side forces are pushed under this share of the largest normal force.
const PRELOAD: f64 = 0.3;

/// Readings of one made unit, taxel 0 of an array, as CSV.
///
/// Each cycle begins at rest, presses up and down, then pushes to both sides
/// along x and along y under a light pressing force. Forces reach as far as
/// closes `compression` of the air. A tilted probe turns the gauge about y;
/// along each axis the force on loading exceeds that on unloading by `hysteresis`.
pub(super) fn table(made: &ThreeAxisModel, options: &SyntheticOptions) -> String {
    let truth = tilted(made, options.tilt);
    let most = largest(made, options.compression);
    let loads: Vec<Option<[f64; 3]>> = (0..options.readings)
        .map(|i| load(most, options, i))
        .collect();
    let answers: Vec<[f64; 4]> = loads
        .iter()
        .map(|force| truth.predict(force.unwrap_or_default()).1.capacitance())
        .collect();
    let rest = made.rest();
    let change = answers
        .iter()
        .flat_map(|c| c.iter().zip(&rest).map(|(c, rest)| (c - rest).abs()))
        .fold(0.0, f64::max);
    let gauge = options.noise * most.into_iter().fold(0.0, f64::max);
    let mut noise = Noise::seeded(options.seed);
    let mut text = options.head(&["hysteresis", "drift", "tilt"]);
    for (place, value) in values(&truth).into_iter().enumerate() {
        text.push_str(&crate::synthetic::truth(&name(place), value, unit(place)));
    }
    text.push_str(
        "time [s],taxel,rest,force_x [mN],force_y [mN],force_z [mN],capacitance_11 [fF],capacitance_12 [fF],\
         capacitance_21 [fF],capacitance_22 [fF]\n",
    );
    let law = hysteresis::synthetic(options.hysteresis);
    let mut histories = [LoadHistory::default(); 3];
    for (i, (force, capacitance)) in loads.iter().zip(&answers).enumerate() {
        let is_rest = force.is_none();
        let _ = write!(text, "{:.1},0,{}", 0.1 * i as f64, u8::from(is_rest));
        let force = force.unwrap_or_default();
        for (force, history) in force.into_iter().zip(&mut histories) {
            let error = gauge * noise.normal();
            let carried = force * law.share(&history.push(force));
            let read = if is_rest { 0.0 } else { carried + error };
            let _ = write!(text, ",{:.6}", read * 1e3);
        }
        let drift = options.drifted(change, i);
        for c in capacitance {
            let read = c + drift + options.noise * change * noise.normal();
            let _ = write!(text, ",{:.6}", read * 1e15);
        }
        text.push('\n');
    }
    text
}

/// The unit as a gauge sees it that is turned by `tilt`, rad, about y: S·R.
pub(super) fn tilted(made: &ThreeAxisModel, tilt: f64) -> ThreeAxisModel {
    let (sin, cos) = tilt.sin_cos();
    let turn = [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]];
    let mut unit = *made;
    unit.suspension.compliance = made
        .suspension
        .compliance
        .map(|row| std::array::from_fn(|column| (0..3).map(|k| row[k] * turn[k][column]).sum()));
    unit
}

/// Largest forces: a normal force that closes `share` of the air, and side
/// forces that close as much of it on their side as a third of that.
fn largest(made: &ThreeAxisModel, share: f64) -> [f64; 3] {
    let air = least_gap(made);
    let compliance = made.suspension.compliance;
    let side = |axis: usize| 2.0 * share * air / (3.0 * compliance[axis][axis]);
    [side(0), side(1), share * air / compliance[2][2]]
}

/// Force of a reading along each axis, N; none where nothing touches.
fn load([x, y, z]: [f64; 3], options: &SyntheticOptions, index: usize) -> Option<[f64; 3]> {
    let phase = options.phase(index);
    if phase < AT_REST {
        return None;
    }
    let part = 3.0 * (phase - AT_REST) / (1.0 - AT_REST);
    let along = part.fract();
    // Up and down once; for the sides to plus, through zero to minus, and back.
    let up = 1.0 - (2.0 * along - 1.0).abs();
    let side = 1.0 - (4.0 * ((along + 0.25).fract() - 0.5)).abs();
    Some(match part as u32 {
        0 => [0.0, 0.0, z * up],
        1 => [x * side, 0.0, PRELOAD * z],
        _ => [0.0, y * side, PRELOAD * z],
    })
}
