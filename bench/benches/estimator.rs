//! Time of one frame, one unit and one evaluation of the model.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use taxel::acquisition::Frame;
use taxel::estimation::{SearchOptions, estimate_unit};
use taxel::sensor::Sensor;
use taxel::solutions::{Question, Solutions};
use taxel_bench::Scene;
use taxel_bodies::transduction::TableOptions;

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

/// Whole frames of sensors that are read by one curve a channel, pressed on all taxels, by the
/// closed form and by the table of the solved drawing.
fn looked_up(criterion: &mut Criterion) {
    for (name, force) in [("in-plane-50um", 10.0), ("liquid-metal-2x4", 1.0)] {
        // 64 taxels where there is one.
        let text = Sensor::shipped_text(name).expect("is shipped");
        let text = text.replacen("rows = 1\ncolumns = 1", "rows = 8\ncolumns = 8", 1);
        let text = text.replacen("frame_rate = \"100 Hz\"", "frame_rate = \"15 Hz\"", 1);
        let drawn = Sensor::parse(name, &text).expect("another size of array");
        let options = TableOptions {
            tolerance: 1e-3,
            ..TableOptions::default()
        };
        let table = taxel_bodies::tabulate(&drawn, &options, "bench", &mut |_| {});
        let table = table.expect("a shipped drawing is solved").text();
        let key = "\nmechanics = { table = \"path.json\" }\n\n[array]";
        let text = text.replacen("\n[array]", key, 1);
        let tabulated = Sensor::parse_with(name, &text, &mut OneTable(&table));
        for (how, sensor) in [
            ("closed form", &drawn),
            ("table", &tabulated.expect("its own table")),
        ] {
            let mut scene = Scene::pressed_everywhere(sensor, force);
            let taxels = sensor.array.rows * sensor.array.columns;
            let pressed = scene.pressed.clone();
            let name = format!("frame of {taxels} taxels, {name}, {how}");
            frames(criterion, &name, &mut scene, &pressed);
        }
    }
}

/// The folder of one table.
struct OneTable<'t>(&'t str);

impl Solutions for OneTable<'_> {
    fn kept(&mut self, _: &Question) -> Option<String> {
        None
    }

    fn keep(&mut self, _: &Question, _: &str) {}

    fn table(&mut self, _: &str) -> Result<String, String> {
        Ok(self.0.to_owned())
    }
}

criterion_group!(benches, whole_frames, one_unit, looked_up);
criterion_main!(benches);
