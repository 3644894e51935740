//! Bars in a pressed layer against independent finite elements (lengths um, stresses in
//! shear moduli of the layer).
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::needless_range_loop)]

use std::collections::{BTreeMap, BTreeSet};

use taxel_bodies::transduction::electrode_section::{BarStudy, Media};
use taxel_fem::field::electrostatics::{Electrostatics, Infinity};
use taxel_fem::field::geometry::Geometry;
use taxel_fem::field::laplace::{Coefficient, Domain, MeshMotion};
use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::Mesh;
use taxel_fem::study::layer::{Bar, Layer, LayerDivision, SideFace};

fn rubber(shear: f64) -> Material {
    Material::incompressible(Law::MooneyRivlin {
        c10: shear / 2.0,
        c01: 0.0,
    })
}

const ON_BASE: Layer = Layer {
    thickness: 950.0,
    loaded: 1750.0,
    beyond: 0.0,
    side: SideFace::OnBase,
    bar: None,
    gripped: false,
    division: USUAL,
};

/// The default, as a constant.
const USUAL: LayerDivision = LayerDivision {
    smallest: 0.05,
    at_bar: 0.05,
    growth: 1.5,
    largest: 0.1,
};

fn study(gap: f64, width: f64, ratio: f64) -> BarStudy {
    study_of(ON_BASE, gap, width, ratio)
}

fn study_of(layer: Layer, gap: f64, width: f64, ratio: f64) -> BarStudy {
    let bar = Bar {
        inner: gap / 2.0,
        width,
        height: 550.0,
        thickness: 100.0,
    };
    BarStudy::new(layer, bar, rubber(1.0), rubber(ratio)).unwrap()
}

fn rows(table: &str) -> Vec<Vec<f64>> {
    let lines = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().unwrap_or(f64::NAN))
                .collect()
        })
        .collect()
}

const SECTIONS: &str = include_str!("../reference/p1_fe_bars.csv");
const UNIFORM: Media = Media {
    layer: 1.0,
    above: 1.0,
    below: Some(1.0),
};

/// Greatest relative errors: stress, d mean, bottom, top, t at face, mean, width, C.
fn compare(gap: f64, width: f64, ratio: f64, compressions: &[f64]) -> [f64; 8] {
    let mut study = study(gap, width, ratio);
    println!("{} cells", study.study.solver.problem().mesh.cell_count());
    let mut worst = [0.0_f64; 8];
    for row in rows(SECTIONS) {
        if row[..3] != [gap, width, ratio] || !compressions.contains(&row[3]) {
            continue;
        }
        let start = std::time::Instant::now();
        let pressed = study.study.press(row[3]).unwrap();
        let shape = study.shape();
        let mechanics = start.elapsed();
        let c = study.capacitance(&[UNIFORM]).unwrap()[0].differential;
        let ours = [
            pressed.mean_stress,
            shape.gap / gap,
            shape.gap_bottom / gap,
            shape.gap_top / gap,
            shape.thickness_at_face / 100.0,
            shape.thickness / 100.0,
            shape.width / width,
            c,
        ];
        let mut errors = [0.0; 8];
        for (k, error) in errors.iter_mut().enumerate() {
            if row[4 + k] != 0.0 {
                *error = ours[k] / row[4 + k] - 1.0;
                worst[k] = worst[k].max(error.abs());
            }
        }
        println!(
            "e {} errors % {:+.3?} base {:.0} {mechanics:.1?} {:.1?}",
            row[3],
            errors.map(|e| 100.0 * e),
            pressed.on_base,
            start.elapsed()
        );
    }
    println!(
        "{gap} {width} {ratio} worst % {:.3?}",
        worst.map(|e| 100.0 * e)
    );
    worst
}

/// The table is exact to these shares, ours to as much again: stress 0.5 %, means 0.05 %,
/// corner values 0.1 % below a compression of 0.2 (see below); what was asked is 0.5 %.
fn check(worst: [f64; 8]) {
    let asked = [5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 1e-3];
    assert!(
        worst.iter().zip(asked).all(|(error, asked)| *error < asked),
        "{worst:?}"
    );
}

#[test]
fn bars_move_as_the_table_says() {
    check(compare(50.0, 1000.0, 1.75, &[0.0, 0.1, 0.2, 0.3]));
}

#[test]
#[ignore = "all sections of the table: minutes"]
fn all_sections() {
    let all: Vec<f64> = rows(SECTIONS).iter().map(|row| row[3]).collect();
    for (gap, width, ratio) in [
        (50.0, 1000.0, 1.75),
        (20.0, 1000.0, 1.0),
        (20.0, 1000.0, 1.75),
        (100.0, 1000.0, 1.75),
        (50.0, 300.0, 1.75),
    ] {
        check(compare(gap, width, ratio, &all));
    }
    // With bars so stiff the corner values of the table are exact to 1 % above 0.2.
    check(compare(50.0, 1000.0, 3.5, &all[..9]));
}

/// Media of a name of the table.
fn media(name: &str) -> Media {
    let (above, below) = match name {
        "uniform" => (2.4, Some(2.4)),
        "air_above" => (1.0, Some(2.4)),
        "air_above_glass_below" => (1.0, Some(5.5)),
        "air_above_below" => (1.0, Some(1.0)),
        "grounded_base" => (1.0, None),
        "grounded_base_uniform" => (2.4, None),
        other => panic!("unknown surroundings {other}"),
    };
    Media {
        layer: 2.4,
        above,
        below,
    }
}

/// Greatest relative errors of the capacitance and of its fall over the rows of a gap.
fn surroundings(gap: f64, compressions: &[f64]) -> [f64; 2] {
    let table = include_str!("../../../taxel/tests/reference/p1_cap_surroundings.csv");
    let rows: Vec<(f64, &str, f64)> = table
        .lines()
        .filter_map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let own = cells.first()?.parse::<f64>().ok()? == gap;
            own.then(|| {
                (
                    cells[2].parse().unwrap(),
                    cells[3],
                    cells[4].parse().unwrap(),
                )
            })
        })
        .collect();
    let mut study = study(gap, 1000.0, 1.75);
    let mut rest = BTreeMap::new();
    let (mut worst, mut compared) = ([0.0_f64; 2], 0);
    for &compression in compressions {
        study.study.press(compression).unwrap();
        for &(_, name, reference) in rows.iter().filter(|row| row.0 == compression) {
            let stem = name.trim_end_matches("_mutual");
            let found = study.capacitance(&[media(stem)]).unwrap()[0];
            let ours = if stem == name {
                found.differential
            } else {
                found.mutual
            };
            let error = ours / reference - 1.0;
            let first = *rest.entry(name).or_insert((ours, reference));
            let fall = [first.0 - ours, first.1 - reference];
            // Where the fall nearly vanishes it is no measure: there its error is that of
            // the capacitances.
            let size = fall[1].abs().max(0.05 * first.1);
            let of_fall = (fall[0] - fall[1]) / size;
            println!(
                "{gap} {compression} {name} {ours:.4} {:+.3} % fall {:+.2} %",
                100.0 * error,
                100.0 * of_fall
            );
            worst = [worst[0].max(error.abs()), worst[1].max(of_fall.abs())];
            compared += 1;
        }
    }
    assert_eq!(compared, 8 * compressions.len());
    worst
}

#[test]
fn surroundings_count_as_the_table_says() {
    let worst = surroundings(50.0, &[0.0, 0.1, 0.3]);
    assert!(worst[0] < 6e-3 && worst[1] < 2e-2, "{worst:?}");
}

#[test]
#[ignore = "all gaps: a minute"]
fn all_surroundings() {
    for gap in [20.0, 50.0, 100.0] {
        let worst = surroundings(gap, &[0.0, 0.05, 0.1, 0.2, 0.3]);
        assert!(worst[0] < 6e-3 && worst[1] < 2e-2, "{gap}: {worst:?}");
    }
}

/// Capacitances among air at steps of a compression, freely and with the base at zero, and how
/// far they are from the parabola through three neighbours.
fn in_air(layer: Layer, gap: f64, compressions: &[f64]) -> Vec<[f64; 3]> {
    let mut study = study_of(layer, gap, 1000.0, 1.75);
    // The field is looked at where the outline goes, whatever cells at the foot do.
    study.study.solver.settings.whole_cells = false;
    let found = compressions.iter().map(|&compression| {
        study.study.press(compression).unwrap();
        let found = study.capacitance(&[media("air_above"), media("grounded_base")]);
        let found = found.unwrap();
        println!("{gap} {compression} {found:?}");
        [
            found[0].differential,
            found[1].differential,
            found[1].mutual,
        ]
    });
    found.collect()
}

/// Greatest third difference over the first value: a jump counts up to three times.
fn jump(values: &[[f64; 3]]) -> f64 {
    let third = |at: &[[f64; 3]], k: usize| {
        (at[3][k] - 3.0 * at[2][k] + 3.0 * at[1][k] - at[0][k]).abs() / values[0][k]
    };
    let all = values
        .windows(4)
        .flat_map(|at| (0..3).map(move |k| third(at, k)));
    all.fold(0.0, f64::max)
}

fn even_steps(to: f64, count: u32) -> Vec<f64> {
    (0..=count)
        .map(|k| to * f64::from(k) / f64::from(count))
        .collect()
}

const FREE: Layer = Layer {
    side: SideFace::Free,
    ..ON_BASE
};

fn wide() -> Layer {
    Layer {
        beyond: 3800.0,
        division: LayerDivision::beside_probe(),
        ..ON_BASE
    }
}

#[test]
fn the_field_is_found_where_the_side_face_passes_under_the_base() {
    let values = in_air(FREE, 50.0, &even_steps(0.28, 14));
    // Third differences of the curve and of the noise of new meshes are 2e-4 of it; a base that
    // springs from node to node made 1e-3.
    assert!(jump(&values) < 4e-4, "{}", jump(&values));
    // Up to where the face has hardly moved below the base it is that of the wider base.
    let wider = in_air(ON_BASE, 50.0, &[0.0, 0.06]);
    for (k, value) in wider[1].into_iter().enumerate() {
        assert!((values[3][k] / value - 1.0).abs() < 1e-5);
    }
}

#[test]
fn the_field_is_found_where_the_layer_folds_beside_a_probe() {
    let values = in_air(wide(), 50.0, &even_steps(0.1, 6));
    assert!(jump(&values) < 4e-4, "{}", jump(&values));
}

#[test]
#[ignore = "all gaps and bodies: minutes"]
fn the_field_goes_as_far_as_the_solid() {
    for gap in [20.0, 50.0, 100.0] {
        for (layer, to) in [(ON_BASE, 0.4), (FREE, 0.28), (wide(), 0.13)] {
            let jump = jump(&in_air(layer, gap, &even_steps(to, 20)));
            println!("{gap} {to} {jump:.1e}");
            assert!(jump < 6e-4, "{gap} {layer:?}: {jump}");
        }
    }
}

/// Cells that are not taken over from the layer, above the base, alone, with their nodes
/// numbered as in all.
fn outside(mesh: &Mesh) -> Mesh {
    let mut outside = Mesh::default();
    outside.points.clone_from(&mesh.points);
    let region = outside.region("above");
    for cell in 0..mesh.cell_count() {
        let own = &mesh.regions[mesh.region_of(cell)];
        let kept = ["layer", "bar"].contains(&own.as_str()) && mesh.cell(cell).len() == 9;
        if own == "above" || (own == "layer" && !kept) {
            outside.add_cell(mesh.shape(cell), region, mesh.cell(cell));
        }
    }
    outside
}

#[test]
fn harmonic_extension_and_new_mesh_agree() {
    let mut study = study(50.0, 1000.0, 1.75);
    study.study.press(0.05).unwrap();
    let solver = &study.study.solver;
    let (solid, state) = (&solver.problem().mesh, solver.state());
    let rest = study.section(&vec![[0.0; 3]; solid.points.len()]).unwrap();
    let mut moved = vec![[0.0; 3]; rest.mesh.points.len()];
    // At rest the nodes that are those of the layer lie at their places.
    let digits = |x: [f64; 3]| x.map(f64::to_bits);
    let own = solid.points.iter().map(|&x| digits(x));
    let own: BTreeMap<[u64; 3], usize> = own.zip(0..).collect();
    let mut inner = BTreeSet::new();
    for (to, &x) in rest.mesh.points.iter().enumerate() {
        if let Some(&from) = own.get(&digits(x)) {
            moved[to] = state.displacement[from];
            inner.insert(to as u32);
        }
    }
    let mut outside = outside(&rest.mesh);
    let present: BTreeSet<u32> = (0..outside.cell_count())
        .flat_map(|cell| outside.cell(cell).to_vec())
        .collect();
    let ball: BTreeSet<u32> = rest.mesh.nodes_of("ball").unwrap().into_iter().collect();
    // One potential for each node of the layer's outline that moves.
    let outline: Vec<u32> = present
        .iter()
        .copied()
        .filter(|node| inner.contains(node) && rest.mesh.points[*node as usize][1] > 0.0)
        .collect();
    let names: Vec<String> = outline.iter().map(u32::to_string).collect();
    for (name, &node) in names.iter().zip(&outline) {
        outside.node_sets.insert(name.clone(), vec![node]);
    }
    for component in 0..2 {
        let held = present.iter().copied().filter(|node| {
            let x = rest.mesh.points[*node as usize];
            let still = x[1] == 0.0 || ball.contains(node) || (component == 0 && x[0] == 0.0);
            still && !outline.contains(node)
        });
        let held = held.collect();
        outside.node_sets.insert("held".to_owned(), held);
        let found = Electrostatics {
            domain: Domain {
                mesh: &outside,
                geometry: Geometry::Plane,
                motion: MeshMotion::None,
                exterior: None,
            },
            permittivities: &[("above", Coefficient::Scalar(1.0))],
            conductors: &names.iter().map(String::as_str).collect::<Vec<_>>(),
            floating: &[],
            zero: &["held"],
            infinity: Infinity::Free,
        }
        .capacitance()
        .unwrap();
        for &node in present.iter().filter(|node| !inner.contains(node)) {
            moved[node as usize][component] = outline
                .iter()
                .zip(&found.potentials)
                .map(|(&at, potential)| moved[at as usize][component] * potential[node as usize])
                .sum();
        }
    }
    for name in ["uniform", "air_above", "grounded_base"] {
        let anew = study.capacitance(&[media(name)]).unwrap()[0];
        let pulled = rest
            .solve_moved(media(name), MeshMotion::PulledBack(&moved))
            .unwrap();
        println!("{name} {anew:?} {pulled:?}");
        // Both are exact to a few 1e-4, most of it the same.
        for (a, b) in [
            (anew.differential, pulled.differential),
            (anew.mutual, pulled.mutual),
        ] {
            assert!((a / b - 1.0).abs() < 1e-4, "{name}: {a} {b}");
        }
    }
}
