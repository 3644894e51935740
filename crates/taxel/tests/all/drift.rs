//! An hour of a drifting device: what is empty is followed, what touches is not.
#![allow(clippy::unwrap_used)]

use taxel::acquisition::{Delivery, Frame, Stimulus, Stream, Twin};
use taxel::estimation::{ArrayEstimator, Why};
use taxel::sensor::Sensor;

/// Frames a second of device time.
const RATE: f64 = 10.0;
/// Drift of each channel in its standard deviations per second: half of what is
/// followed.
const DRIFT: f64 = 0.005;

/// Pressing force with its deviation, N; none beside the rest values of the drawing.
fn pressed(estimator: &mut ArrayEstimator, frame: &Frame) -> Option<[f64; 2]> {
    let touch = estimator.push(frame).unwrap().0;
    touch.pressing_force()
}

/// A device with frames of its twin, empty and pressed, and a clock of its own.
struct Bench {
    estimator: ArrayEstimator,
    empty: Vec<Vec<f64>>,
    pressed: Vec<Vec<f64>>,
    /// Counts per second of each channel.
    drift: Vec<f64>,
    time: f64,
    sequence: u64,
}

fn frames(sensor: &Sensor, force: &str) -> (Stream, Vec<Vec<f64>>) {
    let path = format!("force = [\"0 N\", \"0 N\", \"{force}\"] }}");
    let script = format!(
        "schema = 1\nname = \"hold\"\nduration = \"60 s\"\n[[probe]]\ntaxel = [0, 0]\n\
         path = [{{ time = \"0 s\", {path}, {{ time = \"60 s\", {path}]\n"
    );
    let stimulus = Stimulus::parse("hold", &script).unwrap();
    let mut twin = Twin::new(sensor, &stimulus, 7).unwrap();
    let stream = twin.stream();
    let mut values = Vec::new();
    while values.len() < 600 {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            values.push(frame.values);
        }
    }
    (stream, values)
}

impl Bench {
    fn new(name: &str, force: &str) -> Self {
        let sensor = Sensor::shipped(name).unwrap();
        let (stream, empty) = frames(&sensor, "0 N");
        let (_, pressed) = frames(&sensor, force);
        let scatter = |channel: usize| {
            let count = empty.len() as f64;
            let mean = empty.iter().map(|frame| frame[channel]).sum::<f64>() / count;
            let squares = empty.iter().map(|frame| (frame[channel] - mean).powi(2));
            (squares.sum::<f64>() / count).sqrt()
        };
        Self {
            drift: (0..empty[0].len()).map(|i| DRIFT * scatter(i)).collect(),
            estimator: ArrayEstimator::new(sensor.device().unwrap().reader(&stream).unwrap()),
            empty,
            pressed,
            time: 0.0,
            sequence: 0,
        }
    }

    /// Mean force with the last stated deviation over the last ten seconds.
    fn run(&mut self, seconds: f64, touched: bool) -> [f64; 2] {
        let (steps, last) = ((RATE * seconds) as usize, (10.0 * RATE) as usize);
        let (mut sum, mut deviation) = (0.0, 0.0);
        for step in 0..steps {
            self.time += 1.0 / RATE;
            self.sequence += 1;
            let pool = if touched { &self.pressed } else { &self.empty };
            let values = &pool[self.sequence as usize % pool.len()];
            let drifted = values.iter().zip(&self.drift);
            let frame = Frame {
                sequence: self.sequence,
                time_ns: (1e9 * self.time) as u64,
                values: drifted.map(|(v, d)| v + d * self.time).collect(),
                ..Frame::default()
            };
            let found = pressed(&mut self.estimator, &frame);
            if step + last >= steps {
                let found = found.unwrap();
                sum += found[0] / last as f64;
                deviation = found[1];
            }
        }
        [sum, deviation]
    }
}

#[test]
fn an_hour_of_drift_and_ten_minutes_of_contact() {
    for (name, force) in [
        ("three-axis-unit", "10 mN"),
        ("in-plane-50um", "2 N"),
        ("liquid-metal-2x4", "3 mN"),
    ] {
        let mut bench = Bench::new(name, force);
        bench.estimator.begin_rest_capture(50);
        let [early, noise] = bench.run(20.0, false);
        let [late, _] = bench.run(3600.0, false);
        // An hour is 18 deviations of a channel.
        assert!(
            (late - early).abs() < noise,
            "{name}: {early} {late} {noise}"
        );
        let [begin, fresh] = bench.run(15.0, true);
        assert!(begin > 6.0 * noise, "{name}: {begin} {noise}");
        let [end, doubt] = bench.run(600.0, true);
        // The drift goes on unseen: three deviations of a channel, which the
        // stated deviation holds.
        assert!(doubt > fresh, "{name}: {doubt} {fresh}");
        assert!((end - begin).abs() < doubt, "{name}: {begin} {end} {doubt}");
        let [after, _] = bench.run(120.0, false);
        assert!(
            (after - early).abs() < noise,
            "{name}: {early} {after} {noise}"
        );
        let history: Vec<_> = bench.estimator.baseline().unwrap().history().collect();
        for why in [Why::Drift, Why::AfterContact] {
            assert!(
                history.iter().any(|change| change.why == why),
                "{name}: {why:?}"
            );
        }
        assert!(history.windows(2).all(|w| w[0].time_ns <= w[1].time_ns));
    }
}
