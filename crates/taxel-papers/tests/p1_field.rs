//! Runs of `papers/p1.toml`: finite elements of the in-plane sensor's layer and cross-section.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use taxel::mechanics::{ElectrodeStiffness, LayerKinematics};
use taxel::sensor::Sensor;
use taxel::transduction::InPlaneModel;
use taxel_bodies::transduction::{FieldState, SolvedInPlane};
use taxel_fem::material::{Law, Material};
use taxel_fem::study::layer::{Layer, LayerDivision, LayerStudy, SideFace};
use taxel_papers::Paper;

fn model(gap: u32) -> InPlaneModel {
    let sensor = Sensor::shipped(&format!("in-plane-{gap}um")).unwrap();
    sensor.in_plane().unwrap().model()
}

fn solve(model: &InPlaneModel, most: f64) -> SolvedInPlane {
    SolvedInPlane::solve(model, most, &|_| false, &mut |_| {}).unwrap()
}

/// The run `field` by our own elements: fall of the capacitance over that of the facing sides
/// with the same electrodes, for each gap.
#[test]
#[ignore = "three sensors: a minute"]
fn figures_of_the_ledger() {
    let (mut least, mut greatest) = (f64::INFINITY, 0.0_f64);
    for gap in [20, 50, 100] {
        let model = model(gap);
        let way = solve(&model, 0.4);
        let rest = *way.rest();
        let facing = |state: &FieldState| {
            8.8541878188e-12 * 2.4 * model.electrodes.depth * state.thickness / state.gap
        };
        println!(
            "gap {gap}, ended {:?} {}",
            way.last().compression,
            way.ended.is_some()
        );
        for e in [0.1, 0.2, 0.3, 0.4] {
            let Some(state) = way.at(e) else { continue };
            let closed = model.layer.compress(e).unwrap().mean_stress;
            let over_facing =
                (rest.capacitance - state.capacitance) / (facing(&rest) - facing(&state));
            if e <= 0.3 {
                least = least.min(over_facing);
                greatest = greatest.max(over_facing);
            }
            println!(
                "e {e}: change {:.4} fF, over facing {:.4}, force over closed form {:.4}, d/D {:.4}, t/T {:.4}, stress {:.4}",
                (rest.capacitance - state.capacitance) * 1e15,
                over_facing,
                state.mean_stress / closed,
                state.gap / rest.gap,
                state.thickness / rest.thickness,
                state.mean_stress
            );
        }
    }
    // Stored from independent finite elements with three decimals; ours are 0.9964 and 1.1054.
    let stored = &Paper::P1.table().run("field").unwrap().values;
    assert!((least - stored["low"]).abs() < 2e-3, "{least}");
    assert!((greatest - stored["high"]).abs() < 2e-3, "{greatest}");
    let mut soft = model(50);
    soft.electrodes.stiffness = ElectrodeStiffness::AsLayer;
    let way = solve(&soft, 0.1);
    println!("soft d/D {:.5}", way.last().gap / way.rest().gap);
}

/// Largest errors of the closed form against the middle of a layer of four thicknesses with
/// free ends on a wider base: place across over f, less one; height over the thickness.
fn interior_errors(study: &LayerStudy, compression: f64) -> [f64; 2] {
    let kinematics = LayerKinematics::new(compression).unwrap();
    let mesh = &study.solver.problem().mesh;
    let places = study.solver.state().places(mesh);
    let mut worst = [0.0_f64; 2];
    for (x, y) in mesh.points.iter().zip(places) {
        // As far from the ends as the layer allows.
        if x[0] > 0.25 {
            continue;
        }
        let height = kinematics.slab(0.0, x[1]);
        worst[1] = worst[1].max((y[1] - height).abs());
        if x[0] > 0.0 {
            let across = y[0] / (x[0] * kinematics.stretch(x[1]));
            worst[0] = worst[0].max((across - 1.0).abs());
        }
    }
    worst
}

#[test]
fn the_middle_of_a_layer_moves_as_the_closed_form() {
    let layer = Layer {
        thickness: 1.0,
        loaded: 2.0,
        beyond: 0.0,
        side: SideFace::OnBase,
        bar: None,
        gripped: false,
        division: LayerDivision::default(),
    };
    let rubber = Material::incompressible(Law::MooneyRivlin { c10: 0.5, c01: 0.0 });
    let mut study = LayerStudy::new(layer, rubber, None).unwrap();
    let mut rows = 0;
    for stored in &Paper::P1.table().run("interior").unwrap().rows {
        let pressed = study.press(stored[0]).unwrap();
        let [across, height] = interior_errors(&study, stored[0]);
        let closed = LayerKinematics::new(stored[0])
            .unwrap()
            .mean_stress(2.0, 1.0);
        let force = pressed.mean_stress / closed;
        println!("{},{across:.2e},{height:.2e},{force:.4}", stored[0]);
        // The stored errors are bounds, rounded up; a force is stored with four digits.
        assert!(across < stored[1] && height < stored[2], "{stored:?}");
        assert!((force - stored[3]).abs() < 1e-3, "{stored:?}");
        rows += 1;
    }
    assert_eq!(rows, 4);
}
