//! Grids against what can be counted and measured by hand.

use super::*;
use crate::mesh::Grading;

fn uniform(breakpoints: &[f64], size: f64) -> Axis {
    let gradings: Vec<Grading> = breakpoints
        .windows(2)
        .map(|w| Grading::Uniform(((w[1] - w[0]) / size).round() as usize))
        .collect();
    Axis::new(breakpoints, &gradings).unwrap()
}

/// Half cell of a layer with a void: 300 x 500, void 0 < x < 200, 340 < y < 380.
fn half_cell(k: usize) -> Mesh {
    let size = 20.0 / k as f64;
    let x = uniform(&[0.0, 200.0, 300.0], size);
    let y = uniform(&[0.0, 340.0, 380.0, 500.0], size);
    Grid2::new([x, y], "solid")
        .void("void", [[0.0, 200.0], [340.0, 380.0]])
        .mesh()
        .unwrap()
}

/// A quarter block pressed on part of its top: n x n x n/2 cubes.
fn block(n: usize) -> Mesh {
    let side = |cells| Axis::uniform(0.0, cells as f64, cells).unwrap();
    Grid3::new([side(n), side(n), side(n / 2)], "solid")
        .mesh()
        .unwrap()
}

/// Integral of one over the cells, and of the outward normal times the place over all
/// named outer sides and walls: both are the measure of the solid.
fn measures(mesh: &Mesh, names: &[&str]) -> (f64, f64) {
    let volume = (0..mesh.cell_count())
        .map(|cell| crate::mesh::quality::measure(mesh, cell))
        .sum();
    let dimension = mesh.dimension();
    let mut flux = 0.0;
    for &facet in names.iter().flat_map(|&name| &mesh.surfaces[name]) {
        let shape = mesh.shape(facet.cell as usize).facet_shape();
        let at: Vec<[f64; 3]> = mesh
            .facet_nodes(facet)
            .map(|node| mesh.points[node as usize])
            .collect();
        for point in shape.quadrature() {
            let shapes = shape.shapes(point.at);
            let mut place = [0.0; 3];
            let mut t = [[0.0; 3]; 2];
            for (n, x) in at.iter().enumerate() {
                for k in 0..3 {
                    place[k] += shapes.values[n] * x[k];
                    t[0][k] += shapes.gradients[n][0] * x[k];
                    t[1][k] += shapes.gradients[n][1] * x[k];
                }
            }
            let normal = if dimension == 2 {
                [t[0][1], -t[0][0], 0.0]
            } else {
                let [s, t] = t;
                [
                    s[1] * t[2] - s[2] * t[1],
                    s[2] * t[0] - s[0] * t[2],
                    s[0] * t[1] - s[1] * t[0],
                ]
            };
            let out: f64 = (0..3).map(|k| normal[k] * place[k]).sum();
            flux += point.weight * out / dimension as f64;
        }
    }
    (volume, flux)
}

#[test]
fn the_half_cell_has_its_cells_nodes_and_walls() {
    for k in [1, 2, 4] {
        let mesh = half_cell(k);
        assert_eq!(mesh.cell_count(), (15 * 25 - 20) * k * k);
        let nodes = (30 * k + 1) * (50 * k + 1) - (20 * k) * (4 * k - 1);
        assert_eq!(mesh.points.len(), nodes);
        assert_eq!(mesh.surfaces["void.roof"].len(), 10 * k);
        assert_eq!(mesh.surfaces["void.floor"].len(), 10 * k);
        assert_eq!(mesh.surfaces["void.right"].len(), 2 * k);
        assert_eq!(mesh.surfaces["left"].len(), 23 * k);
        assert!(!mesh.surfaces.contains_key("void.left"));
        let names = ["left", "right", "bottom", "top", "void"];
        let all: usize = names.iter().map(|name| mesh.surfaces[*name].len()).sum();
        assert_eq!(all, mesh.boundary().len());
        // Gauss: the outward normals of a closed surface measure what it holds.
        let (area, flux) = measures(&mesh, &names);
        assert!((area / (300.0 * 500.0 - 200.0 * 40.0) - 1.0).abs() < 1e-12);
        assert!((flux / area - 1.0).abs() < 1e-12);
    }
}

#[test]
fn walls_face_as_they_are_called_and_stand_in_order() {
    let mesh = half_cell(2);
    let middles = |name: &str| -> Vec<[f64; 3]> {
        mesh.surfaces[name]
            .iter()
            .map(|&facet| {
                let middle = mesh.facet_nodes(facet).nth(2).unwrap();
                mesh.points[middle as usize]
            })
            .collect()
    };
    assert!(middles("void.roof").iter().all(|x| x[1] == 380.0));
    assert!(middles("void.floor").iter().all(|x| x[1] == 340.0));
    assert!(middles("void.right").iter().all(|x| x[0] == 200.0));
    assert!(middles("void.roof").windows(2).all(|w| w[0][0] < w[1][0]));
    assert!(middles("void.right").windows(2).all(|w| w[0][1] < w[1][1]));
}

#[test]
fn the_block_has_its_cells_nodes_and_sides() {
    let n = 4;
    let mesh = block(n);
    assert_eq!(mesh.cell_count(), n * n * n / 2);
    assert_eq!(mesh.points.len(), (2 * n + 1) * (2 * n + 1) * (n + 1));
    let names = ["left", "right", "front", "back", "bottom", "top"];
    let (volume, flux) = measures(&mesh, &names);
    assert!((volume - 32.0).abs() < 1e-12 && (flux - 32.0).abs() < 1e-12);
    let on = |name: &str, axis: usize, value: f64| {
        let nodes = mesh.nodes_of(name).unwrap();
        assert!(
            nodes
                .iter()
                .all(|&n| mesh.points[n as usize][axis] == value),
            "{name}"
        );
    };
    on("left", 0, 0.0);
    on("right", 0, 4.0);
    on("front", 1, 0.0);
    on("back", 1, 4.0);
    on("bottom", 2, 0.0);
    on("top", 2, 2.0);
}

#[test]
fn a_cavity_in_space_has_six_walls() {
    let axis = || uniform(&[0.0, 1.0, 2.0, 3.0], 0.5);
    let mesh = Grid3::new([axis(), axis(), axis()], "solid")
        .void("hole", [[1.0, 2.0]; 3])
        .mesh()
        .unwrap();
    let names = ["left", "right", "front", "back", "bottom", "top", "hole"];
    let (volume, flux) = measures(&mesh, &names);
    assert!((volume - 26.0).abs() < 1e-12 && (flux - 26.0).abs() < 1e-12);
    for (name, axis, value) in [
        ("hole.left", 0, 1.0),
        ("hole.right", 0, 2.0),
        ("hole.front", 1, 1.0),
        ("hole.back", 1, 2.0),
        ("hole.floor", 2, 1.0),
        ("hole.roof", 2, 2.0),
    ] {
        assert_eq!(mesh.surfaces[name].len(), 4);
        let nodes = mesh.nodes_of(name).unwrap();
        assert!(
            nodes
                .iter()
                .all(|&n| mesh.points[n as usize][axis] == value)
        );
    }
}

#[test]
fn boxes_and_a_rule_give_the_same_mesh() {
    let axis = || uniform(&[0.0, 1.0, 2.0, 3.0], 0.5);
    let grid = Grid2::new([axis(), axis()], "below")
        .region("above", [[0.0, 3.0], [2.0, 3.0]])
        .void("hole", [[0.0, 1.0], [1.0, 3.0]]);
    let by_boxes = grid.mesh().unwrap();
    let by_rule = grid
        .mesh_by(&|x| match x {
            [x, y, _] if x < 1.0 && y > 1.0 => Part::Void("hole"),
            [_, y, _] if y > 2.0 => Part::Region("above"),
            _ => Part::Region("below"),
        })
        .unwrap();
    assert_eq!(by_boxes.points, by_rule.points);
    assert_eq!(by_boxes.surfaces, by_rule.surfaces);
    assert_eq!(by_boxes.regions, ["below", "above"]);
    for cell in 0..by_boxes.cell_count() {
        assert_eq!(by_boxes.cell(cell), by_rule.cell(cell));
        assert_eq!(by_boxes.region_of(cell), by_rule.region_of(cell));
    }
}

#[test]
fn wrong_boxes_are_refused() {
    let axis = || uniform(&[0.0, 1.0, 2.0, 3.0], 0.5);
    let grid = || Grid2::new([axis(), axis()], "solid");
    let whole = [0.0, 3.0];
    assert!(matches!(
        grid().void("hole", [[1.0, 1.5], [1.0, 2.0]]).mesh(),
        Err(MeshError::OffBreakpoint {
            axis: 0,
            value: 1.5,
            ..
        })
    ));
    assert!(matches!(
        grid().void("hole", [[1.0, 2.0], [2.0, 1.0]]).mesh(),
        Err(MeshError::InsideOut { axis: 1, .. })
    ));
    assert!(matches!(
        grid().void("hole", [[1.0, 1.0], [1.0, 2.0]]).mesh(),
        Err(MeshError::InsideOut { axis: 0, .. })
    ));
    assert!(matches!(
        grid().void("hole", [[f64::NAN, 1.0], [1.0, 2.0]]).mesh(),
        Err(MeshError::InsideOut { .. })
    ));
    let (left, right) = ([[0.0, 2.0], [1.0, 2.0]], [[1.0, 3.0], [1.0, 2.0]]);
    assert!(matches!(
        grid().void("one", left).void("two", right).mesh(),
        Err(MeshError::Contradiction { .. })
    ));
    assert!(matches!(
        grid().region("one", left).region("two", right).mesh(),
        Err(MeshError::Contradiction { .. })
    ));
    assert!(matches!(
        grid().void("slit", [whole, [1.0, 2.0]]).mesh(),
        Err(MeshError::Pieces { pieces: 2, .. })
    ));
    assert!(matches!(
        grid().void("all", [whole, whole]).mesh(),
        Err(MeshError::NothingLeft)
    ));
    assert!(matches!(
        grid().void("top", [[1.0, 2.0], [1.0, 2.0]]).mesh(),
        Err(MeshError::ReservedName { .. })
    ));
    let fine = || Axis::uniform(0.0, 1.0, 50_000).unwrap();
    assert!(matches!(
        Grid2::new([fine(), fine()], "solid").mesh(),
        Err(MeshError::TooManyCells { .. })
    ));
}
