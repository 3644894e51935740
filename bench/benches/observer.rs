//! Time of what follows estimation in a frame of 64 taxels: segmentation into
//! contacts, tracking, events, and the health of 256 channels.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use taxel::acquisition::{Frame, Stimulus, Stream, Twin};
use taxel::device::Device;
use taxel::estimation::{ArrayEstimator, MapNoise, MapReader, Observer, Touch};
use taxel::sensor::Sensor;
use taxel_bench::Scene;

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

criterion_group!(benches, observed, segmented);
criterion_main!(benches);
