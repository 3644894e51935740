//! A printed lattice with four magnets over five magnetometers, pressed by a probe on a stage:
//! rows of numbers without a header, as a host writes them.

use std::fmt::Write as _;

use super::Random;

/// The two files of a run.
pub(crate) struct Run {
    /// Host time, s, and 15 channels.
    pub(crate) sensor: String,
    /// Host time, s, the probe x, y, z, mm, and in the force run the scale, g (-1: nothing new).
    pub(crate) states: String,
}

/// Sides of the magnets and of the outer magnetometers from the middle, and height of the magnets, mm.
const MAGNETS: f64 = 6.0;
const MAGNETOMETERS: f64 = 8.0;
const HEIGHT: f64 = 20.0;
/// Dipole moment, counts mm^3.
const MOMENT: f64 = 5e6;
/// Distance at which a press moves a magnet half as far as under the probe, mm.
const REACH: f64 = 8.0;
/// Sideways share of that motion.
const SIDEWAYS: f64 = 0.3;
/// Creep of the magnets: shares and times, s.
const CREEP: [[f64; 2]; 2] = [[0.02, 5.0], [0.03, 60.0]];
/// Stiffness, N/mm and N/mm^3, and shares of it that relax, with their times, s.
const STIFFNESS: [f64; 2] = [1.95, 0.0115];
const RELAXATION: [[f64; 2]; 2] = [[0.08, 1.5], [0.10, 15.0]];
/// Noise of a reading, counts, and its steps along x, y and z.
const NOISE: f64 = 2.0;
const STEPS: [f64; 3] = [2.4, 2.4, 3.872];
/// Readings far from all magnets, those of the electronics.
const OFFSETS: [f64; 3] = [200.0, -1200.0, 6000.0];
/// N of the weight of 1 g.
pub(crate) const NEWTONS_PER_GRAM: f64 = 9.80665e-3;

/// The body and all that it remembers.
struct Lattice {
    /// Displacement of each magnet, mm, and what follows it slowly.
    magnets: [[f64; 3]; 4],
    slow: [[[f64; 3]; 2]; 4],
    /// Elastic force, N, and what follows it slowly.
    elastic: f64,
    relaxed: [f64; 2],
    random: Random,
}

impl Lattice {
    fn new(seed: u64) -> Self {
        Self {
            magnets: [[0.0; 3]; 4],
            slow: [[[0.0; 3]; 2]; 4],
            elastic: 0.0,
            relaxed: [0.0; 2],
            random: Random(seed),
        }
    }

    fn rest(magnet: usize) -> [f64; 2] {
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]][magnet].map(|side| side * MAGNETS)
    }

    /// Holds the probe at a place from the middle and at an indentation depth, mm, for a time, s.
    fn hold(&mut self, place: [f64; 2], depth: f64, time: f64) {
        let depth = depth.max(0.0);
        let toward = |from: f64, to: f64, delay: f64| to + (from - to) * (-time / delay).exp();
        for magnet in 0..4 {
            let away = [0, 1].map(|i| (Self::rest(magnet)[i] - place[i]) / REACH);
            let share = depth / (1.0 + away[0] * away[0] + away[1] * away[1]);
            let moved = [
                SIDEWAYS * share * away[0],
                SIDEWAYS * share * away[1],
                -share,
            ];
            self.magnets[magnet] = moved;
            for (slow, [_, delay]) in self.slow[magnet].iter_mut().zip(CREEP) {
                *slow = std::array::from_fn(|i| toward(slow[i], moved[i], delay));
            }
        }
        self.elastic = STIFFNESS[0] * depth + STIFFNESS[1] * depth.powi(3);
        for (relaxed, [_, delay]) in self.relaxed.iter_mut().zip(RELAXATION) {
            *relaxed = toward(*relaxed, self.elastic, delay);
        }
    }

    /// Force on the probe, N: it only pushes.
    fn force(&self) -> f64 {
        let relaxed = self.relaxed.iter().zip(RELAXATION);
        (self.elastic
            - relaxed
                .map(|(force, [share, _])| share * force)
                .sum::<f64>())
        .max(0.0)
    }

    /// Field of a dipole along z at each magnetometer, in the steps of the converter.
    fn readings(&mut self) -> [f64; 15] {
        let side = MAGNETOMETERS;
        let sensors = [
            [0.0, 0.0],
            [-side, -side],
            [side, -side],
            [-side, side],
            [side, side],
        ];
        std::array::from_fn(|channel| {
            let (sensor, axis) = (sensors[channel / 3], channel % 3);
            let field = (0..4).map(|magnet| {
                let [x, y] = Self::rest(magnet);
                let rest = [x, y, HEIGHT];
                let from: [f64; 3] = std::array::from_fn(|i| {
                    let creep = self.slow[magnet].iter().zip(CREEP);
                    let crept: f64 = creep.map(|(slow, [share, _])| share * slow[i]).sum();
                    let sensor = [sensor[0], sensor[1], 0.0][i];
                    sensor - (rest[i] + self.magnets[magnet][i] + crept)
                });
                let square: f64 = from.iter().map(|part| part * part).sum();
                let own = if axis == 2 { square } else { 0.0 };
                MOMENT * (3.0 * from[2] * from[axis] - own) / (square * square * square.sqrt())
            });
            let reading = OFFSETS[axis] + field.sum::<f64>() + NOISE * self.random.normal();
            (reading / STEPS[axis]).round() * STEPS[axis]
        })
    }

    fn write(&mut self, text: &mut String, time: f64) {
        let _ = write!(text, "{}", rounded(time, 1e4));
        for reading in self.readings() {
            let _ = write!(text, ",{}", rounded(reading, 10.0));
        }
        text.push('\n');
    }
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

/// Where the middle of the lattice is on the stage of the position run, mm.
pub(crate) const MIDDLE: [f64; 2] = [287.0, -100.0];
/// Passes of 11 x 11 presses, 1 mm apart, and indentation depth of a press, mm.
pub(crate) const PASSES: usize = 5;
pub(crate) const SIDE: usize = 11;
const PRESS_DEPTH: f64 = 2.0;

/// Presses on a grid, pass after pass, one row each.
pub(crate) fn position_run() -> Run {
    let mut lattice = Lattice::new(1);
    let mut run = Run {
        sensor: String::new(),
        states: String::new(),
    };
    let mut time = 0.0;
    for press in 0..PASSES * SIDE * SIDE {
        let at = [press / SIDE % SIDE, press % SIDE].map(|step| step as f64 - 5.0);
        // The stage travels with the probe in the air, and farther to the next line and the next pass.
        let travel = match press {
            0 => 0.0,
            _ if press % (SIDE * SIDE) == 0 => 60.0,
            _ if press % SIDE == 0 => 8.0,
            _ => 2.2466,
        };
        lattice.hold(at, 0.0, travel);
        lattice.hold(at, PRESS_DEPTH, 2.0);
        time += travel + 2.0;
        let read = time + 1e-3 * lattice.random.uniform();
        lattice.write(&mut run.sensor, read);
        let asked = read + 3e-3 * lattice.random.uniform();
        let [x, y] = [0, 1].map(|i| MIDDLE[i] + at[i]);
        let _ = writeln!(run.states, "{},{x},{y},143.0177", rounded(asked, 1e4));
    }
    run
}

/// Rows of the force run, of which the first ones are at rest.
pub(crate) const FORCE_ROWS: usize = 1095;
const REST_ROWS: usize = 15;
/// Period of the cycles, s; they go from [`TOP`] to 12 mm below it, and touch 1 mm below it.
const CYCLE: f64 = 36.0;
const PAUSE: f64 = 1.1;
const TOP: f64 = 288.0;
const CLEARANCE: f64 = 1.0;
/// The scale measures by its own clock, s.
const SCALE_PERIOD: f64 = 0.1999;

/// Height of the probe, mm, at a time after the rest, s: down and up, with a pause at each end.
fn height(time: f64) -> f64 {
    let half = CYCLE / 2.0 + PAUSE;
    let (count, within) = ((time / half).floor(), time % half);
    let phase = std::f64::consts::PI * (within / (CYCLE / 2.0)).min(1.0);
    let down = if count % 2.0 == 0.0 {
        phase
    } else {
        std::f64::consts::PI + phase
    };
    TOP - 6.0 * (1.0 - down.cos())
}

/// Three cycles of force on the middle, with the force of every row, N.
pub(crate) fn force_run_and_truth() -> (Run, Vec<f64>) {
    let mut lattice = Lattice::new(2);
    let mut run = Run {
        sensor: String::new(),
        states: String::new(),
    };
    let mut truth = Vec::new();
    let (mut time, mut start) = (0.0, 0.0);
    let (mut measured, mut grams) = (0, 0.0);
    for row in 0..FORCE_ROWS {
        if row < REST_ROWS {
            start = time;
        }
        let until = |time: f64| height((time - start).max(0.0));
        // Up to this row in steps of at most 5 ms; the scale measures where its clock says so.
        let step = match row {
            0 => 0.0,
            _ if row < REST_ROWS => 0.0352,
            _ if row % 2 == 0 => 0.0706,
            _ => 0.1341,
        };
        let steps = (step / 5e-3_f64).ceil() as usize;
        for _ in 0..steps {
            time += step / steps as f64;
            lattice.hold(
                [0.5, -0.3],
                TOP - CLEARANCE - until(time),
                step / steps as f64,
            );
            let tick = (time / SCALE_PERIOD) as usize;
            if tick > measured {
                measured = tick;
                grams = rounded(lattice.force() / NEWTONS_PER_GRAM, 100.0);
            }
        }
        lattice.write(&mut run.sensor, time);
        truth.push(lattice.force());
        let asked = time + 3e-3 * lattice.random.uniform();
        let shown = if row < REST_ROWS || row % 2 == 0 {
            grams
        } else {
            -1.0
        };
        let z = rounded(until(time), 1e4);
        let _ = writeln!(run.states, "{},315,-100,{z},{shown}", rounded(asked, 1e4));
    }
    (run, truth)
}

/// The files of [`force_run_and_truth`].
pub(crate) fn force_run() -> Run {
    force_run_and_truth().0
}
