//! The half cell: its area, its walls, its sizes.

use super::*;
use crate::mesh::quality::{map_at, measure};
use crate::scalar::determinant;
use proptest::prelude::*;

const SAMPLE: VoidCell = VoidCell {
    width: 400.0,
    height: 40.0,
    cover: 120.0,
    base: 340.0,
    pitch: 600.0,
    fillet: 0.0,
    division: CornerDivision {
        smallest: 0.01,
        segments: 2,
        growth: 1.5,
        largest: f64::INFINITY,
    },
};

fn area(mesh: &Mesh) -> f64 {
    (0..mesh.cell_count()).map(|cell| measure(mesh, cell)).sum()
}

fn middles(mesh: &Mesh, name: &str) -> Vec<[f64; 3]> {
    mesh.surfaces[name]
        .iter()
        .map(|&facet| mesh.points[mesh.facet_nodes(facet).last().unwrap() as usize])
        .collect()
}

/// Chord lengths of the facets of a surface.
fn lengths(mesh: &Mesh, name: &str) -> Vec<f64> {
    mesh.surfaces[name]
        .iter()
        .map(|&facet| {
            let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
            let [a, b] = [0, 1].map(|k| mesh.points[nodes[k] as usize]);
            (a[0] - b[0]).hypot(a[1] - b[1])
        })
        .collect()
}

/// Every cell is the right way round at its nodes, the boundary is all named, and the
/// area is that of the drawing within `tolerance`.
fn check(cell: &VoidCell, tolerance: f64) -> Mesh {
    let mesh = cell.mesh().unwrap();
    for number in 0..mesh.cell_count() {
        let shape = mesh.shape(number);
        for node in 0..shape.node_count() {
            let determinant = determinant(&map_at(&mesh, number, shape.node_at(node)));
            assert!(determinant > 0.0, "cell {number} node {node} of {cell:?}");
        }
    }
    let total = cell.base + cell.height + cell.cover;
    let round = (1.0 - std::f64::consts::FRAC_PI_4) * cell.fillet * cell.fillet;
    let exact = cell.pitch / 2.0 * total - cell.width / 2.0 * cell.height + 2.0 * round;
    assert!((area(&mesh) / exact - 1.0).abs() < tolerance, "{cell:?}");
    let sides = ["left", "right", "bottom", "top", "void"];
    let named: usize = sides.iter().map(|name| mesh.surfaces[*name].len()).sum();
    assert_eq!(named, mesh.boundary().len(), "{cell:?}");
    let length = |name: &str| lengths(&mesh, name).iter().sum::<f64>();
    assert!((length("left") - total + cell.height).abs() < 1e-9 * total);
    assert!((length("right") - total).abs() < 1e-9 * total);
    mesh
}

#[test]
fn the_usual_cell_needs_few_cells_for_its_smallest() {
    let mesh = check(&SAMPLE, 1e-12);
    assert!(mesh.cell_count() < 500, "{} cells", mesh.cell_count());
    for name in ["void.roof", "void.floor", "void.side", "void.side.lower"] {
        // A hundredth of the height, at the corner, first in order.
        assert!((lengths(&mesh, name)[0] - 0.4).abs() < 1e-9, "{name}");
    }
    assert!(middles(&mesh, "void.roof").iter().all(|x| x[1] == 380.0));
    assert!(middles(&mesh, "void.floor").iter().all(|x| x[1] == 340.0));
    assert!(middles(&mesh, "void.side").iter().all(|x| x[0] == 200.0));
}

#[test]
fn walls_pair_from_the_corner_on() {
    for fillet in [0.0, 4.0] {
        let cell = VoidCell { fillet, ..SAMPLE };
        let mesh = check(&cell, 1e-5);
        for (across, side, y) in [
            ("void.roof", "void.side.upper", 380.0),
            ("void.floor", "void.side.lower", 340.0),
        ] {
            let (across, side) = (middles(&mesh, across), middles(&mesh, side));
            assert!(side.len() > 4);
            for (a, s) in across.iter().zip(&side) {
                assert!(((200.0 - a[0]) - (s[1] - y).abs()).abs() < 1e-9);
                assert!(((200.0 - s[0]) - (a[1] - y).abs()).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn walls_of_the_void_follow_each_other() {
    for fillet in [0.0, 8.0] {
        let mesh = VoidCell { fillet, ..SAMPLE }.mesh().unwrap();
        let ends: Vec<[u32; 2]> = mesh.surfaces["void"]
            .iter()
            .map(|&facet| {
                let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
                [nodes[0], nodes[1]]
            })
            .collect();
        assert!(
            ends.windows(2)
                .all(|w| w[0][1] == w[1][0] || w[0][0] == w[1][1])
        );
    }
}

#[test]
fn nodes_of_a_fillet_lie_on_its_arc() {
    let division = CornerDivision {
        segments: 4,
        ..CornerDivision::default()
    };
    let cell = VoidCell {
        fillet: 4.0,
        division,
        ..SAMPLE
    };
    let mesh = check(&cell, 1e-7);
    let mut on_arc = 0;
    for node in mesh.nodes_of("void").unwrap() {
        let [x, y, _] = mesh.points[node as usize];
        if x > 196.0 + 1e-9 && y > 376.0 + 1e-9 {
            on_arc += 1;
            assert!(((x - 196.0).hypot(y - 376.0) - 4.0).abs() < 1e-12);
        }
    }
    // Twice as many facets as segments, two nodes each, without the ends of the arc.
    assert_eq!(on_arc, 2 * 8 - 1);
}

#[test]
fn lengths_that_make_no_cell_are_refused() {
    let refused = |cell: VoidCell| cell.mesh().is_err();
    assert!(matches!(
        VoidCell {
            pitch: 400.0,
            ..SAMPLE
        }
        .mesh(),
        Err(MeshError::NoWall { .. })
    ));
    assert!(refused(VoidCell {
        height: 0.0,
        ..SAMPLE
    }));
    assert!(refused(VoidCell {
        cover: f64::NAN,
        ..SAMPLE
    }));
    assert!(matches!(
        VoidCell {
            fillet: 20.0,
            ..SAMPLE
        }
        .mesh(),
        Err(MeshError::OutOfRange { value: 20.0, .. })
    ));
    assert!(refused(VoidCell {
        pitch: 1e10,
        ..SAMPLE
    }));
    let thin = CornerDivision {
        growth: 1.0,
        segments: 64,
        ..SAMPLE.division
    };
    assert!(refused(VoidCell {
        cover: 1.0,
        division: thin,
        ..SAMPLE
    }));
    for division in [
        CornerDivision {
            smallest: 0.0,
            ..SAMPLE.division
        },
        CornerDivision {
            segments: 0,
            ..SAMPLE.division
        },
        CornerDivision {
            growth: 3.0,
            ..SAMPLE.division
        },
        CornerDivision {
            largest: f64::NAN,
            ..SAMPLE.division
        },
    ] {
        assert!(refused(VoidCell { division, ..SAMPLE }));
    }
}

/// Neighbours on an arc far below the smallest cell once became one node.
#[test]
fn a_fillet_far_below_the_smallest_cell_keeps_its_nodes() {
    let division = CornerDivision {
        smallest: 0.433_246_544_709_263_2,
        segments: 4,
        ..CornerDivision::default()
    };
    check(
        &VoidCell {
            width: 20.0,
            height: 295.746_328_052_616_04,
            cover: 27.559_741_829_100_41,
            base: 281.645_551_161_331_2,
            pitch: 55.638_229_968_703_88,
            fillet: 0.165_063_457_591_477_06,
            division,
        },
        2e-3,
    );
}

/// A ring between the square round a corner and a fillet of nearly half of it was once thinner
/// than the distance at which nodes are one.
#[test]
fn a_fillet_of_nearly_half_the_square_leaves_no_thin_ring() {
    for below in [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.09, 0.11, 0.3] {
        for (fillet, smallest) in [(0.5 - 0.5 * below, 0.4), (0.0, 0.25 * (1.0 - below))] {
            let division = CornerDivision {
                smallest,
                ..CornerDivision::default()
            };
            let mut cell = VoidCell { division, ..SAMPLE };
            cell.fillet = fillet * Corner::new(&cell).unwrap().reach;
            let rings = Corner::new(&cell).unwrap().rings;
            assert!(
                rings.windows(2).all(|w| w[1] <= WIDEST_INNER * w[0]),
                "{rings:?}"
            );
            check(&cell, 2e-3);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_cell_is_sound(
        width in 20.0..1000.0_f64,
        height in 5.0..300.0_f64,
        cover in 5.0..300.0_f64,
        base in 5.0..300.0_f64,
        wall in 5.0..500.0_f64,
        smallest in 1e-3..0.5_f64,
        segments in 1..5_usize,
        round in prop::option::of(0.01..0.8_f64),
    ) {
        let mut cell = VoidCell {
            width, height, cover, base,
            pitch: width + 2.0 * wall,
            fillet: 0.0,
            division: CornerDivision { smallest, segments, ..CornerDivision::default() },
        };
        if let Some(part) = round {
            cell.fillet = part * Corner::new(&cell).unwrap().reach;
        }
        // The chord of a quadratic arc over 45 degrees misses 1e-3 of the small fillet.
        check(&cell, if round.is_some() { 2e-3 } else { 1e-11 });
    }
}
