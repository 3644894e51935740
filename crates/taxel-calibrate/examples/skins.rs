//! Trains on folders of recordings of a skin and judges what live says of a further one.
//!
//! `cargo run --release -p taxel-calibrate --example skins -- FOLDER…`: each folder has `sensor.toml`, runs to
//! train on in `runs/` and one more in `next/`. A line for each folder: errors of the pressing force (N), of the
//! other components and of the place (mm) over the further run, the share within the 95 % intervals, what
//! training stated of held-out runs, and what it took.

use std::path::Path;
use std::time::Instant;
use std::{env, fs};

use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainingFile, train,
};
use taxel_recording::Frame;

type Failed = Box<dyn std::error::Error>;

fn files(folder: &Path) -> Result<Vec<TrainingFile>, Failed> {
    let mut paths: Vec<_> = fs::read_dir(folder)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()?;
    paths.sort();
    let file = |path: std::path::PathBuf| -> Result<TrainingFile, Failed> {
        Ok(TrainingFile {
            text: fs::read_to_string(&path)?,
            name: path.display().to_string(),
        })
    };
    paths.into_iter().map(file).collect()
}

#[derive(Default)]
struct Tally {
    square: f64,
    inside: f64,
    count: f64,
}

impl Tally {
    fn push(&mut self, [value, deviation]: [f64; 2], truth: f64) {
        if value.is_finite() && deviation.is_finite() && truth.is_finite() {
            self.square += (value - truth).powi(2);
            self.inside += f64::from(u8::from((value - truth).abs() < 1.96 * deviation));
            self.count += 1.0;
        }
    }

    fn rms(&self) -> f64 {
        (self.square / self.count).sqrt()
    }

    fn show(&self) -> String {
        format!(
            "{:.4} {:.1} %",
            self.rms(),
            100.0 * self.inside / self.count
        )
    }
}

fn judged(folder: &Path) -> Result<String, Failed> {
    let start = Instant::now();
    let text = fs::read_to_string(folder.join("sensor.toml"))?;
    let sensor = Sensor::parse("sensor.toml", &text)?;
    let named = NamedSensor {
        name: "sensor.toml",
        text: &text,
        sensor: &sensor,
    };
    let groups: Vec<Vec<TrainingFile>> = files(&folder.join("runs"))?
        .into_iter()
        .map(|file| vec![file])
        .collect();
    let outcome = train(&named, &groups, &CalibrateOptions::default())?;
    let seconds = start.elapsed().as_secs_f64();
    let file = outcome.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "runs",
        data_hash: "0",
    });
    let length = file.len();
    if env::var_os("REMARKS").is_some() {
        for remark in &outcome.outcome.remarks {
            eprintln!("{remark}");
        }
    }
    let calibrated = CalibrationFile::parse("c.toml", &file)?.apply("c.toml", &named)?;
    let array = calibrated.trained()?;
    let mut estimator = ArrayEstimator::new(calibrated.device()?.reader(&array.stream())?);
    estimator.begin_unasked_rest_capture(50);
    let map = outcome.maps.force.clone().ok_or("no map of the force")?;
    let mut further = files(&folder.join("next"))?;
    let further = further.swap_remove(0);
    let mut lines = further.text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| head.iter().position(|title| *title == name);
    let channels: Vec<usize> = (0..head.len())
        .filter(|at| head[*at].starts_with("channel_"))
        .collect();
    let rows: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().unwrap_or(f64::NAN))
                .collect()
        })
        .collect();
    let force = column("force_z [N]").ok_or("no force")?;
    let top = rows.iter().map(|row| row[force]).fold(0.0, f64::max);
    let first = rows
        .iter()
        .position(|row| row[force] > 0.05 * top)
        .unwrap_or(0);
    let (mut of_force, mut of_shear, mut of_place) =
        (Tally::default(), Tally::default(), Tally::default());
    let (mut missing, mut flagged) = (0, 0);
    let mut wrong = vec![0; channels.len()];
    let quiet = &rows[..(first * 7 / 10).clamp(5, 25)];
    let rest = channels
        .iter()
        .map(|at| quiet.iter().map(|row| row[*at]).sum::<f64>() / quiet.len() as f64);
    let mut alone = taxel::trained::ForceEstimator::new(map, rest.collect())?;
    let mut of_maps = Tally::default();
    for (number, row) in rows.iter().enumerate() {
        let frame = Frame {
            sequence: number as u64,
            time_ns: (row[0] * 1e9).round() as u64,
            values: channels.iter().map(|at| row[*at]).collect(),
            ..Frame::default()
        };
        let (touch, _) = estimator.push(&frame)?;
        if let Ok(own) = alone.push(row[0], &frame.values) {
            of_maps.push([own.value, own.deviation], row[force]);
            if env::var_os("TRACE").is_some() {
                eprintln!(
                    "{} {} {} {} {} {} {:?}",
                    row[0],
                    row[force],
                    own.value,
                    own.deviation,
                    touch.total.force[2],
                    touch.total_covariance[2][2].sqrt(),
                    touch.channels.states.iter().filter(|s| !s.usable()).count()
                );
            }
        }
        if !touch.zero_known {
            continue;
        }
        let found = touch.pressing_force().unwrap_or([f64::NAN; 2]);
        missing += usize::from(!found[0].is_finite());
        flagged += usize::from(touch.channels.states.iter().any(|state| !state.usable()));
        for (count, state) in wrong.iter_mut().zip(&touch.channels.states) {
            *count += usize::from(!state.usable());
        }
        of_force.push(found, row[force]);
        for (axis, name) in ["force_x [N]", "force_y [N]"].into_iter().enumerate() {
            if let Some(at) = column(name) {
                of_shear.push(
                    [
                        touch.total.force[axis],
                        touch.total_covariance[axis][axis].sqrt(),
                    ],
                    row[at],
                );
            }
        }
        let (Some(x), Some(y)) = (column("x [mm]"), column("y [mm]")) else {
            continue;
        };
        if row[force] > 0.05 * top && row[x].is_finite() {
            if let Some(contact) = touch.contacts.first() {
                let [xx, _, yy] = contact.covariance;
                of_place.push([1e3 * contact.centre[0], 1e3 * xx.sqrt()], row[x]);
                of_place.push([1e3 * contact.centre[1], 1e3 * yy.sqrt()], row[y]);
            }
        }
    }
    let wrong: Vec<String> = (1..)
        .zip(&wrong)
        .filter(|(_, count)| **count > 0)
        .map(|(c, count)| format!("{c}:{count}"))
        .collect();
    let held = outcome.outcome.hold_out.iter();
    let held: Vec<String> = held
        .filter(|one| one.name.starts_with("force") || one.name.starts_with("place"))
        .map(|one| format!("{:.4}", one.root_mean_square))
        .collect();
    Ok(format!(
        "{:<20} maps {} force {} missing {missing} shear {} place {:.3} {} held out {} flagged {flagged} ({}) of {} {seconds:.1} s file {} kB",
        folder.file_name().unwrap_or_default().display(),
        of_maps.show(),
        of_force.show(),
        of_shear.show(),
        std::f64::consts::SQRT_2 * of_place.rms(),
        of_place.show(),
        held.join(" "),
        wrong.join(" "),
        rows.len(),
        length / 1000
    ))
}

#[allow(clippy::print_stdout, clippy::print_stderr, reason = "it is a program")]
fn main() {
    for folder in env::args().skip(1) {
        match judged(Path::new(&folder)) {
            Ok(line) => println!("{line}"),
            Err(error) => println!("{folder}: {error}"),
        }
    }
}
