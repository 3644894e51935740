//! Every number of a trained skin while its channels drift, also beside a channel that dies: its
//! intervals hold.
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stdout, reason = "shows what is held")]

use std::fmt::Write as _;

use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainingFile, train,
};
use taxel_numerics::Noise;
use taxel_recording::Frame;

const CHANNELS: usize = 12;
const STEP: f64 = 0.04;

/// A press: place, mm, depth, mm, and force along x, N.
#[derive(Debug, Clone, Copy)]
struct Press {
    place: [f64; 2],
    depth: f64,
    shear: f64,
}

impl Press {
    const NONE: Self = Self {
        place: [0.0; 2],
        depth: 0.0,
        shear: 0.0,
    };

    fn force(self) -> f64 {
        2.0 * self.depth + 0.3 * self.depth * self.depth
    }

    /// What a channel of a grid of 4 x 3 reads more than at rest.
    fn shown(self, channel: usize) -> f64 {
        let grid = [channel % 4, channel / 4].map(|at| at as f64);
        let [dx, dy] = [
            self.place[0] - 6.0 * (grid[0] - 1.5),
            self.place[1] - 6.0 * (grid[1] - 1.0),
        ];
        let near = (-(dx * dx + dy * dy) / (60.0 + 20.0 * self.depth)).exp();
        (300.0 * self.depth + 15.0 * self.shear * dx) * near
    }
}

/// Numbers that fill 0 to 1 evenly.
fn even(number: usize, step: f64) -> f64 {
    (number as f64 * step).fract()
}

fn press(number: usize) -> Press {
    Press {
        place: [
            16.0 * even(number, 0.8191725134) - 8.0,
            12.0 * even(number, 0.6710436067) - 6.0,
        ],
        depth: 0.5 + 2.0 * even(number, 0.5497004779),
        shear: 2.0 * even(number, 0.4503599627) - 1.0,
    }
}

fn values(press: Press, noise: &mut Noise) -> Vec<f64> {
    let channel = |c: usize| 500.0 + 20.0 * c as f64 + press.shown(c);
    (0..CHANNELS).map(|c| channel(c) + noise.normal()).collect()
}

fn sensor_text() -> String {
    let names: Vec<String> = (1..=CHANNELS).map(|c| format!("\"c{c}\"")).collect();
    format!(
        "schema = 2\nname = \"drift\"\n[array]\nrows = 8\ncolumns = 8\npitch = \"3 mm\"\nmount = \"flat\"\n\
         [element.trained]\nfull_scale = \"10 N\"\ngroups = [{{ name = \"chip\", channels = [{}] }}]\n\
         [electronics]\nframe_rate = \"25 Hz\"\nscan = \"simultaneous\"\n\
         readout = {{ digital = {{ unit = \"counts\" }} }}\n",
        names.join(", ")
    )
}

/// A run over places and depths, and two of forces.
fn recordings() -> Vec<Vec<TrainingFile>> {
    let head = |columns: &str| {
        let mut text = format!("time [s],{columns}");
        (1..=CHANNELS).for_each(|c| write!(text, ",channel_{c}").unwrap());
        text
    };
    let row = |text: &mut String, time: f64, given: &[f64], values: &[f64]| {
        write!(text, "\n{time}").unwrap();
        for number in given.iter().chain(values) {
            write!(text, ",{number}").unwrap();
        }
    };
    let mut noise = Noise::seeded(1);
    let mut places = head("x [mm],y [mm],z [mm]");
    for number in 0..1500 {
        let press = Press {
            shear: 0.0,
            ..press(number)
        };
        let given = [press.place[0], press.place[1], press.depth];
        row(
            &mut places,
            number as f64,
            &given,
            &values(press, &mut noise),
        );
    }
    let mut groups = vec![("places.csv", places)];
    for (name, first) in [("one.csv", 0), ("two.csv", 400)] {
        let mut forces = head("force_x [N],force_z [N]");
        for frame in 0..6000 {
            let rests = frame < 100 || frame % 20 >= 14;
            let press = if rests {
                Press::NONE
            } else {
                press(first + frame / 20)
            };
            let given = [press.shear, press.force()];
            row(
                &mut forces,
                STEP * frame as f64,
                &given,
                &values(press, &mut noise),
            );
        }
        groups.push((name, forces));
    }
    let file = |(name, text): (&str, String)| {
        vec![TrainingFile {
            name: name.into(),
            text: text + "\n",
        }]
    };
    groups.into_iter().map(file).collect()
}

fn estimator() -> ArrayEstimator {
    let text = sensor_text();
    let sensor = Sensor::parse("drift.toml", &text).unwrap();
    let named = NamedSensor {
        name: "drift.toml",
        text: &text,
        sensor: &sensor,
    };
    let trained = train(&named, &recordings(), &CalibrateOptions::default()).unwrap();
    let file = trained.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "runs",
        data_hash: "0",
    });
    let file = CalibrationFile::parse("c.toml", &file).unwrap();
    let calibrated = file.apply("c.toml", &named).unwrap();
    let stream = calibrated.trained().unwrap().stream();
    let device = calibrated.device().unwrap();
    ArrayEstimator::new(device.reader(&stream).unwrap())
}

/// Shares of x, y, depth, force along x and z within their 95 % intervals, over `minutes` of touches
/// of two seconds with pauses of three, while the channels drift by about three deviations per hour
/// and one of them, from a time on, s, reads `dead`.
fn held(minutes: f64, dead: Option<(f64, f64)>) -> [f64; 5] {
    let mut estimator = estimator();
    estimator.begin_unasked_rest_capture(50);
    let mut noise = Noise::seeded(9);
    let drift: Vec<f64> = (0..CHANNELS)
        .map(|_| 3.0 / 3600.0 * noise.normal())
        .collect();
    let (mut inside, mut count) = ([0.0; 5], [0.0; 5]);
    for frame in 0..(60.0 * minutes / STEP) as usize {
        let (number, within) = (frame / 125, frame % 125);
        let press = if within < 75 {
            Press::NONE
        } else {
            press(5000 + number)
        };
        let time = STEP * frame as f64;
        let mut read = values(press, &mut noise);
        read.iter_mut()
            .zip(&drift)
            .for_each(|(value, rate)| *value += rate * time);
        if let Some((_, reads)) = dead.filter(|(from, _)| time >= *from) {
            read[5] = reads;
        }
        let frame = Frame {
            sequence: frame as u64,
            time_ns: (time * 1e9).round() as u64,
            values: read,
            ..Frame::default()
        };
        let (touch, _) = estimator.push(&frame).unwrap();
        // Half a second after it begins, and after the rest capture.
        if within < 88 {
            continue;
        }
        let deviation = |variance: f64| 1.96 * variance.sqrt();
        let mut judge = |kind: usize, found: f64, truth: f64, interval: f64| {
            inside[kind] += f64::from(u8::from((found - truth).abs() <= interval));
            count[kind] += 1.0;
        };
        let force = touch.total.force;
        for (kind, axis, truth) in [(3, 0, press.shear), (4, 2, press.force())] {
            judge(
                kind,
                force[axis],
                truth,
                deviation(touch.total_covariance[axis][axis]),
            );
        }
        let Some(contact) = touch.contacts.first() else {
            continue;
        };
        for axis in 0..2 {
            let variance = contact.covariance[2 * axis];
            judge(
                axis,
                contact.centre[axis],
                1e-3 * press.place[axis],
                deviation(variance),
            );
        }
        if let Some([depth, spread]) = touch.depth {
            judge(2, depth, 1e-3 * press.depth, 1.96 * spread);
        }
    }
    let shares = std::array::from_fn(|kind| inside[kind] / count[kind]);
    println!("{dead:?}: {shares:.3?} of {count:?}");
    shares
}

/// Half an hour: all that a trained skin states holds while its channels drift.
#[test]
fn all_intervals_hold_under_drift() {
    for share in held(30.0, None) {
        assert!(share > 0.93, "{share}");
    }
}

/// The same, and a channel dies after five minutes: no reading, or zero.
#[test]
fn all_intervals_hold_under_drift_beside_a_dead_channel() {
    for reads in [f64::NAN, 0.0] {
        for share in held(20.0, Some((300.0, reads))) {
            assert!(share > 0.93, "{reads}: {share}");
        }
    }
}
