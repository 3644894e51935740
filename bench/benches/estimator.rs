//! Time of one frame, one unit and one evaluation of the model.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use taxel::acquisition::Frame;
use taxel::estimation::{SearchOptions, estimate_unit};
use taxel_bench::Scene;

/// The taxel under the finger.
const CENTRE: usize = 27;

fn frames(criterion: &mut Criterion, name: &str, scene: &mut Scene, frames: &[Frame]) {
    let mut next = frames.iter().cycle();
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            let frame = next.next().expect("the cycle never ends");
            let (touch, _) = scene.estimator.push(black_box(frame)).expect("fits");
            black_box(touch.total.force)
        });
    });
}

fn whole_frames(criterion: &mut Criterion) {
    let mut scene = Scene::new();
    let (rest, pressed) = (scene.rest.clone(), scene.pressed.clone());
    frames(
        criterion,
        "frame 8x8, press with shear",
        &mut scene,
        &pressed,
    );
    frames(criterion, "frame 8x8, at rest", &mut scene, &rest);
    let mut scene = Scene::with_edges();
    let pressed = scene.pressed.clone();
    frames(
        criterion,
        "frame 8x8 with edges, press with shear",
        &mut scene,
        &pressed,
    );
}

fn one_unit(criterion: &mut Criterion) {
    let mut scene = Scene::new();
    let frame = scene.pressed[0].clone();
    let (touch, _) = scene.estimator.push(&frame).expect("fits");
    let readings = std::array::from_fn(|i| touch.channels.readings[4 * CENTRE + i]);
    let force = touch.taxels[CENTRE].value;
    let calibration = scene.calibration();
    let (unit, sigma) = (calibration.units[CENTRE], calibration.deviation[CENTRE]);
    let options = SearchOptions::default();
    criterion.bench_function("estimate_unit, pressed", |bencher| {
        bencher.iter(|| estimate_unit(&unit, black_box(readings), sigma, [true; 4], &options));
    });
    criterion.bench_function("linearise, pressed", |bencher| {
        bencher.iter(|| unit.linearise(black_box(force)));
    });
    criterion.bench_function("predict, pressed", |bencher| {
        bencher.iter(|| unit.predict(black_box(force)).1.capacitance());
    });
}

criterion_group!(benches, whole_frames, one_unit);
criterion_main!(benches);
