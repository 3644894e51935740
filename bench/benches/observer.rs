//! Time of what follows estimation in a frame of 64 taxels: segmentation into
//! contacts, tracking, events, and the health of 256 channels.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use taxel::acquisition::{Delivery, Finger, FingerPoint, Frame, Link, Stimulus, Stream, Twin};
use taxel::device::Device;
use taxel::estimation::{ArrayEstimator, MapNoise, MapReader, Observer, Touch};
use taxel::sensor::Sensor;
use taxel_bench::{Scene, computed};

/// The shipped array and what its frames mean.
fn stream() -> (Sensor, Stream) {
    let sensor = Sensor::shipped("three-axis-8x8").expect("is shipped");
    let script = Stimulus::shipped_text("finger").expect("is shipped");
    let stimulus = Stimulus::parse("finger", script).expect("is shipped and tested");
    let twin = Twin::new(&sensor, &stimulus, 1).expect("the script fits the array");
    let stream = twin.stream();
    (sensor, stream)
}

/// The frames of the scene, each with its touch.
fn touched(scene: &mut Scene) -> Vec<(Frame, Touch)> {
    let frames = scene.pressed.clone();
    let mut found = Vec::new();
    for frame in frames {
        let touch = scene.estimator.push(&frame).expect("fits").0.clone();
        found.push((frame, touch));
    }
    found
}

fn observed(criterion: &mut Criterion) {
    let (sensor, stream) = stream();
    let array = sensor.three_axis().expect("is a three-axis array");
    let mut scene = Scene::new();
    let channels = scene.estimator.channels().to_vec();
    let wiring = scene.estimator.meaning().wiring;
    let mut observer = Observer::new(array.observed(&stream), channels, wiring);
    let frames = touched(&mut scene);
    let mut next = frames.iter().cycle();
    let mut time_ns = 0;
    criterion.bench_function("tracks, events, health of 64 taxels", |bencher| {
        bencher.iter(|| {
            let (frame, touch) = next.next().expect("the cycle never ends");
            // Time goes on while the frames come again.
            time_ns += 16_666_667;
            let frame = Frame {
                time_ns,
                ..frame.clone()
            };
            black_box(observer.push(black_box(&frame), touch).len())
        });
    });
}

/// Of a map nothing but the division into contacts costs time.
fn segmented(criterion: &mut Criterion) {
    let (_, stream) = stream();
    let stream = Stream {
        channels_per_taxel: 1,
        present: vec![true; 64],
        threshold: Some(0.3e-3),
        ..stream
    };
    let mut estimator =
        ArrayEstimator::new(Box::new(MapReader::new(&stream, &MapNoise::default())));
    let maps: Vec<Frame> = touched(&mut Scene::new())
        .into_iter()
        .map(|(frame, touch)| Frame {
            values: touch.taxels.iter().map(|taxel| taxel.value[2]).collect(),
            ..frame
        })
        .collect();
    let mut next = maps.iter().cycle();
    criterion.bench_function("segmentation of 64 cells, with their sums", |bencher| {
        bencher.iter(|| {
            let frame = next.next().expect("the cycle never ends");
            black_box(
                estimator
                    .push(black_box(frame))
                    .expect("fits")
                    .0
                    .contacts
                    .len(),
            )
        });
    });
}

/// When the fingers come and go, s, and when they come again.
const PRESSED: [f64; 2] = [0.5, 1.5];
const AGAIN: f64 = 4.0;

/// Frames of 4 x 6 plates under two fingers that swell and fade, then of the rest after.
fn two_fingers(sensor: &Sensor) -> (Stream, Vec<Frame>) {
    let finger = |at: [f64; 2], most: f64| Finger {
        radius: 2.3e-3,
        path: (0..=20)
            .map(|k| FingerPoint {
                time: PRESSED[0] + 0.05 * f64::from(k),
                at,
                force: [
                    0.0,
                    0.0,
                    most * (0.6 + 0.4 * f64::from(k % 2)) * f64::from(u8::from(k % 20 != 0)),
                ],
            })
            .collect(),
    };
    let script = Stimulus {
        schema: 1,
        name: "two fingers".into(),
        duration: AGAIN + 0.5,
        finger: vec![finger([-4e-3, 0.0], 0.5), finger([5e-3, 1e-3], 1.0)],
        probe: Vec::new(),
        slider: Vec::new(),
        fault: Vec::new(),
        outage: Vec::new(),
        link: Link::default(),
    };
    let mut twin = Twin::new(sensor, &script, 1).expect("the script fits the array");
    let stream = twin.stream();
    let mut frames = Vec::new();
    while frames
        .last()
        .is_none_or(|frame: &Frame| frame.time_ns < (AGAIN * 1e9) as u64)
    {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            frames.push(frame);
        }
    }
    (stream, frames)
}

/// Frames of which the computing time is taken, apart from what other programs take.
const FRAMES: usize = 2000;

/// Whole frames of plates in silicone under two fingers: charge, force, division, and the positions
/// of two contacts that are solved for together.
fn pairs_on_plates(criterion: &mut Criterion) {
    let text = Sensor::shipped_text("piezo-1.5mm").expect("is shipped");
    let text = text
        .replace("rows = 2", "rows = 4")
        .replace("columns = 4", "columns = 6")
        .replace("frame_rate = \"1 kHz\"", "frame_rate = \"400 Hz\"");
    let sensor = Sensor::parse("piezo-4x6", &text).expect("more elements");
    let (stream, frames) = two_fingers(&sensor);
    let device = sensor.device().expect("has a device");
    let reader = device.reader(&stream).expect("reads its stream");
    let mut estimator = ArrayEstimator::new(reader);
    let [begin, end] = PRESSED.map(|time| (time * 1e9) as u64);
    let begun = frames.partition_point(|frame| frame.time_ns < begin);
    for frame in &frames[..begun] {
        estimator.push(frame).expect("fits");
    }
    let pressed = begin + 50_000_000..end - 50_000_000;
    let round = &frames[begun..];
    let step = round[1].time_ns - round[0].time_ns;
    let (mut next, mut time_ns) = (round.iter().cycle(), round[0].time_ns);
    // The next frame under both fingers; those of the rests before it are not timed.
    let mut contacts = |timed: &mut dyn FnMut(&mut dyn FnMut() -> usize)| {
        loop {
            let original = next.next().expect("the cycle never ends");
            time_ns += step;
            let frame = Frame {
                time_ns,
                ..original.clone()
            };
            let mut push = || {
                let touch = estimator.push(black_box(&frame)).expect("fits").0;
                black_box(touch.contacts.len())
            };
            if pressed.contains(&original.time_ns) {
                return timed(&mut push);
            }
            push();
        }
    };
    criterion.bench_function("4 x 6 plates under two fingers, whole frame", |bencher| {
        bencher.iter_custom(|frames| {
            let mut sum = Duration::ZERO;
            for _ in 0..frames {
                contacts(&mut |push| {
                    let begun = Instant::now();
                    push();
                    sum += begun.elapsed();
                });
            }
            sum
        });
    });
    let (mut pairs, mut sum) = (0, 0.0);
    for _ in 0..FRAMES {
        contacts(&mut |push| {
            let begun = computed();
            pairs += usize::from(push() == 2);
            sum += computed() - begun;
        });
    }
    let each = sum / FRAMES as f64;
    println!(
        "two contacts in {pairs} of {FRAMES} frames, each computed in {:.3} ms, those of 10 ms in {:.2} ms",
        1e3 * each,
        1e3 * each * 1e7 / step as f64,
    );
}

criterion_group!(benches, observed, segmented, pairs_on_plates);
criterion_main!(benches);
