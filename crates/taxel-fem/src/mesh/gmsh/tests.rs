//! Small files of each version and type.

use super::Position::Line;
use super::*;
use crate::mesh::quality::{Quality, map_at, measure};
use crate::scalar::{determinant, inverse};

/// A file of format 2.2 from lines of nodes and elements.
fn old(nodes: &[&str], elements: &[&str]) -> String {
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n0 1 \"tip\"\n1 2 \"line\"\n\
         2 3 \"face\"\n2 4 \"plate\"\n3 5 \"body\"\n$EndPhysicalNames\n$Nodes\n{}\n{}\n$EndNodes\n\
         $Elements\n{}\n{}\n$EndElements\n",
        nodes.len(),
        nodes.join("\n"),
        elements.len(),
        elements.join("\n"),
    )
}

/// Edges and faces as the manual of Gmsh lists them, by their corners.
const HEXAHEDRON: [&[usize]; 19] = [
    &[0, 1],
    &[0, 3],
    &[0, 4],
    &[1, 2],
    &[1, 5],
    &[2, 3],
    &[2, 6],
    &[3, 7],
    &[4, 5],
    &[4, 7],
    &[5, 6],
    &[6, 7],
    &[0, 1, 2, 3],
    &[0, 1, 4, 5],
    &[0, 3, 4, 7],
    &[1, 2, 5, 6],
    &[2, 3, 6, 7],
    &[4, 5, 6, 7],
    &[0, 1, 2, 3, 4, 5, 6, 7],
];
const TETRAHEDRON: [&[usize]; 6] = [&[0, 1], &[1, 2], &[0, 2], &[0, 3], &[2, 3], &[1, 3]];
const TRIANGLE: [&[usize]; 3] = [&[0, 1], &[1, 2], &[2, 0]];
const SQUARE: [&[usize]; 5] = [&[0, 1], &[1, 2], &[2, 3], &[3, 0], &[0, 1, 2, 3]];

/// One sheared cell of `count` nodes; corners of the reference cell from `shape`.
fn one_cell(code: u32, shape: CellShape, middles: &[&[usize]], count: usize) -> String {
    let shear = |x: [f64; 3]| [2.0 * x[0] + 0.5 * x[1], x[1] + 0.25 * x[2], 3.0 * x[2]];
    let corners: Vec<[f64; 3]> = (0..shape.corner_count())
        .map(|n| shear(shape.node_at(n)))
        .collect();
    let mut points = corners.clone();
    for middle in middles {
        let sum = |k: usize| middle.iter().map(|&c| corners[c][k]).sum::<f64>();
        points.push([0, 1, 2].map(|k| sum(k) / middle.len() as f64));
    }
    let nodes: Vec<String> = points[..count]
        .iter()
        .enumerate()
        .map(|(n, [x, y, z])| format!("{} {x} {y} {z}", 10 * n + 7))
        .collect();
    let group = if shape.dimension() == 2 { 4 } else { 5 };
    let tags: Vec<String> = (0..count).map(|n| (10 * n + 7).to_string()).collect();
    let element = format!("1 {code} 2 {group} 1 {}", tags.join(" "));
    let nodes: Vec<&str> = nodes.iter().map(String::as_str).collect();
    old(&nodes, &[&element])
}

#[test]
fn cells_of_every_type_keep_volume_and_the_gradient_of_a_linear_field() {
    for (code, shape, middles, count, expected) in [
        (2, CellShape::Tri7, &TRIANGLE[..], 3, 1.0),
        (9, CellShape::Tri7, &TRIANGLE, 6, 1.0),
        (3, CellShape::Quad9, &SQUARE, 4, 8.0),
        (16, CellShape::Quad9, &SQUARE, 8, 8.0),
        (10, CellShape::Quad9, &SQUARE, 9, 8.0),
        (4, CellShape::Tet15, &TETRAHEDRON, 4, 1.0),
        (11, CellShape::Tet15, &TETRAHEDRON, 10, 1.0),
        (5, CellShape::Hex27, &HEXAHEDRON, 8, 48.0),
        (17, CellShape::Hex27, &HEXAHEDRON, 20, 48.0),
        (12, CellShape::Hex27, &HEXAHEDRON, 27, 48.0),
    ] {
        let mesh = read(&one_cell(code, shape, middles, count)).unwrap();
        assert_eq!(mesh.shape(0), shape);
        assert!((measure(&mesh, 0) - expected).abs() < 1e-12, "type {code}");
        Quality::of(&mesh).require(&mesh).unwrap();
        // u = 1 + 2 x - 3 y + 5 z at the nodes.
        let slope = [2.0, -3.0, 5.0];
        for point in shape.quadrature() {
            let map = map_at(&mesh, 0, point.at);
            let back = inverse(&map, determinant(&map));
            let shapes = shape.shapes(point.at);
            let mut reference = [0.0; 3];
            for (gradient, &node) in shapes.gradients.iter().zip(mesh.cell(0)) {
                let x = mesh.points[node as usize];
                let u = 1.0 + (0..3).map(|k| slope[k] * x[k]).sum::<f64>();
                for k in 0..3 {
                    reference[k] += u * gradient[k];
                }
            }
            for k in 0..shape.dimension() {
                let found: f64 = (0..3).map(|j| reference[j] * back[j][k]).sum();
                assert!((found - slope[k]).abs() < 1e-12, "type {code}");
            }
        }
    }
}

const SQUARE_NODES: [&str; 4] = ["1 0 0 0", "2 1 0 0", "3 1 1 0", "4 0 1 0"];

#[test]
fn names_become_regions_surfaces_and_node_sets() {
    let mesh = read(&old(
        &SQUARE_NODES,
        &[
            "1 15 2 1 1 3",
            "2 1 2 2 1 2 1",
            "3 2 2 4 1 1 2 3",
            "4 2 2 4 1 1 4 3",
        ],
    ))
    .unwrap();
    assert_eq!(mesh.regions, ["plate"]);
    assert_eq!(mesh.node_sets["tip"].len(), 1);
    let nodes = mesh.nodes_of("line").unwrap();
    assert_eq!(nodes.len(), 3);
    assert!(nodes.iter().all(|&n| mesh.points[n as usize][1] == 0.0));
    // The second triangle is drawn clockwise.
    assert!((0..2).all(|cell| (measure(&mesh, cell) - 0.5).abs() < 1e-15));
    assert_eq!(mesh.boundary().len(), 4);
}

#[test]
fn faces_and_curves_of_a_body_are_found() {
    let text = one_cell(4, CellShape::Tet15, &TETRAHEDRON, 4).replace(
        "$Elements\n1\n",
        "$Elements\n3\n8 2 2 3 1 7 17 27\n9 1 2 2 1 7 37\n",
    );
    let mesh = read(&text).unwrap();
    let face = mesh.nodes_of("face").unwrap();
    assert_eq!(face.len(), 7);
    assert!(face.iter().all(|&n| mesh.points[n as usize][2] == 0.0));
    assert_eq!(mesh.node_sets["line"].len(), 3);
}

/// Two squares side by side in format 4.1, the second region in two groups of one name.
const NEW: &str = "$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 \"foot\"
2 2 \"soft side\"
2 3 \"hard side\"
$EndPhysicalNames
$Entities
1 1 2 0
1 0 0 0 0
4 0 0 0 2 0 0 1 1 2 1 -1
1 0 0 0 1 1 0 1 2 0
2 1 0 0 2 1 0 1 3 0
$EndEntities
$Nodes
2 6 1 6
0 1 0 1
1
0 0 0
2 1 1 5
2
3
4
5
6
1 0 0 0.1 0.2
2 0 0 0.1 0.2
0 1 0 0.1 0.2
1 1 0 0.1 0.2
2 1 0 0.1 0.2
$EndNodes
$Elements
4 5 1 5
0 1 15 1
1 1
1 4 1 2
2 1 2
3 2 3
2 1 3 1
4 1 2 5 4
2 2 3 1
5 2 3 6 5
$EndElements
$Periodic
0
$EndPeriodic
";

#[test]
fn the_new_format_is_read() {
    let mesh = read(NEW).unwrap();
    assert_eq!(mesh.regions, ["soft side", "hard side"]);
    assert_eq!((mesh.cell_count(), mesh.points.len()), (2, 15));
    assert_eq!(mesh.surfaces["foot"].len(), 2);
    assert_eq!(mesh.boundary().len(), 6);
    // Text from Windows.
    assert_eq!(
        read(&NEW.replace('\n', "\r\n")).unwrap().points,
        mesh.points
    );
}

#[test]
fn mistakes_are_shown_with_their_line() {
    let plate = |element: &str| read(&old(&SQUARE_NODES, &[element])).unwrap_err();
    // The first element stands in line 21.
    assert_eq!(
        plate("1 3 2 0 1 1 2 3 4"),
        GmshError::NoRegion { line: Line(21) }
    );
    assert_eq!(
        plate("1 7 2 4 1 1 2 3 4 5"),
        GmshError::UnknownType {
            line: Line(21),
            code: 7,
            count: 1
        }
    );
    assert_eq!(
        plate("1 3 2 4 1 1 2 3 8"),
        GmshError::MissingNode {
            line: Line(21),
            node: 8
        }
    );
    assert!(matches!(
        plate("1 3 2 4 1 1 2 3"),
        GmshError::Count {
            line: Line(21),
            found: 3,
            expected: 4,
            ..
        }
    ));
    assert!(matches!(
        plate("1 3 2 4 1 1 2 3 x"),
        GmshError::NotANumber { line: Line(21), .. }
    ));
    assert_eq!(plate("1 1 2 2 1 1 2"), GmshError::NoCells);
    let read_two = |a: &str, b: &str| read(&old(&SQUARE_NODES, &[a, b])).unwrap_err();
    assert!(matches!(
        read_two("1 2 2 4 1 1 2 3", "2 1 2 2 1 2 4"),
        GmshError::NotASide { line: Line(22), .. }
    ));
    assert!(matches!(
        read_two("1 2 2 4 1 1 2 3", "2 15 2 1 1 4"),
        GmshError::OffTheCells {
            line: Line(22),
            node: 4,
            ..
        }
    ));
    assert!(matches!(
        read_two("1 2 2 4 1 1 2 3", "2 2 2 3 1 1 2 3"),
        GmshError::Cell { line: Line(22), .. }
    ));
    let raised = read(&old(
        &["1 0 0 0", "2 1 0 0", "3 1 1 0.5"],
        &["1 2 2 4 1 1 2 3"],
    ));
    assert!(matches!(raised, Err(GmshError::NotPlane { node: 3, .. })));
    let twice = read(&old(&["1 0 0 0", "1 1 0 0"], &[]));
    assert_eq!(
        twice.unwrap_err(),
        GmshError::RepeatedNode {
            line: Line(15),
            node: 1
        }
    );
}

#[test]
fn wrong_files_are_refused() {
    let error = |from: &str, to: &str| read(&NEW.replacen(from, to, 1)).unwrap_err();
    assert_eq!(
        error("$MeshFormat", "solid x"),
        GmshError::Format { line: Line(1) }
    );
    assert_eq!(
        error("4.1 0 8", "4.1 1 8"),
        GmshError::Binary { line: Line(2) }
    );
    assert!(matches!(
        error("4.1 0 8", "4.0 0 8"),
        GmshError::Version { line: Line(2), .. }
    ));
    assert!(matches!(
        error("2 6 1 6", "2 7 1 6"),
        GmshError::Count {
            found: 6,
            expected: 7,
            ..
        }
    ));
    assert!(matches!(
        error("2 1 1 5", "2 1 1 6"),
        GmshError::Count { .. } | GmshError::NotANumber { .. }
    ));
    assert!(matches!(
        error("4 5 1 5", "3 5 1 5"),
        GmshError::Count { .. }
    ));
    assert!(matches!(
        error("4 5 1 5", "-1 5 1 5"),
        GmshError::NotANumber { .. }
    ));
    assert!(matches!(
        error("1 2 0\n2 1", "2 2 3 0\n2 1"),
        GmshError::SeveralRegions { .. }
    ));
    assert!(matches!(
        error("1 0 0 0 0\n", "1 0 0 0 5\n"),
        GmshError::Count { line: Line(12), .. }
    ));
    assert_eq!(read("").unwrap_err(), GmshError::Format { line: Line(1) });
    for cut in (20..NEW.len() - 20).step_by(7) {
        // A file that was cut off is never read as a smaller mesh, and never panics.
        let result = read(&NEW[..cut]);
        assert!(
            result.is_err() || cut + 1 >= NEW.find("$Periodic").unwrap(),
            "{cut}"
        );
    }
}

/// Cells of every type in an order that is inside out are turned, with all their nodes.
#[test]
fn cells_inside_out_are_turned() {
    for (code, shape, middles, count) in [
        (9, CellShape::Tri7, &TRIANGLE[..], 6),
        (10, CellShape::Quad9, &SQUARE, 9),
        (4, CellShape::Tet15, &TETRAHEDRON, 4),
        (11, CellShape::Tet15, &TETRAHEDRON, 10),
        (5, CellShape::Hex27, &HEXAHEDRON, 8),
        (17, CellShape::Hex27, &HEXAHEDRON, 20),
        (12, CellShape::Hex27, &HEXAHEDRON, 27),
    ] {
        let text = one_cell(code, shape, middles, count);
        let right = read_file(text.as_bytes()).unwrap();
        // A mirror image: the first coordinate with the other sign.
        let mirrored: String = text
            .lines()
            .map(|line| {
                let words: Vec<&str> = line.split(' ').collect();
                match &words[..] {
                    [tag, x, y, z] if tag.parse::<u32>().is_ok() && x.parse::<f64>().is_ok() => {
                        format!("{tag} {} {y} {z}\n", -x.parse::<f64>().unwrap())
                    }
                    _ => format!("{line}\n"),
                }
            })
            .collect();
        let turned = read_file(mirrored.as_bytes()).unwrap();
        assert_eq!([right.turned, turned.turned], [0, 1], "type {code}");
        Quality::of(&turned.mesh).require(&turned.mesh).unwrap();
        let volumes = [&right, &turned].map(|drawing| measure(&drawing.mesh, 0));
        assert!((volumes[0] - volumes[1]).abs() < 1e-12, "type {code}");
        // Nodes in the middles of edges and sides stay there: no side is bent.
        assert!(
            !crate::mesh::quality::is_curved(&turned.mesh, 0),
            "type {code}"
        );
    }
}

#[test]
fn groups_without_names_are_called_by_their_numbers() {
    let mesh = read(&old(
        &SQUARE_NODES,
        &[
            "1 15 2 8 1 3",
            "2 1 2 -8 1 2 1",
            "3 2 2 -9 1 1 2 3",
            "4 2 2 9 1 1 4 3",
        ],
    ))
    .unwrap();
    assert_eq!(mesh.regions, ["9"]);
    // The point and the curve of one number are different groups.
    assert_eq!(mesh.node_sets["point 8"].len(), 1);
    assert_eq!(mesh.surfaces["curve 8"].len(), 1);
}

#[test]
fn one_name_may_be_that_of_a_surface_and_of_points() {
    let text = old(
        &SQUARE_NODES,
        &["1 15 2 1 1 3", "2 1 2 2 1 2 1", "3 3 2 4 1 1 2 3 4"],
    );
    let mesh = read(&text.replace("\"tip\"", "\"line\"")).unwrap();
    assert_eq!(mesh.surfaces["line"].len(), 1);
    // The three nodes of the line, and the point.
    assert_eq!(mesh.nodes_of("line").unwrap().len(), 4);
}

#[test]
fn parametric_nodes_and_partitions_are_read() {
    let plain = old(&SQUARE_NODES, &["1 3 2 4 1 1 2 3 4"]);
    let parametric = plain
        .replace("$Nodes", "$ParametricNodes")
        .replace("$EndNodes", "$EndParametricNodes")
        .replace("1 0 0 0\n", "1 0 0 0 0 1\n")
        .replace("2 1 0 0\n", "2 1 0 0 1 3 0.5\n")
        .replace("3 1 1 0\n", "3 1 1 0 2 7 0.1 0.2\n")
        .replace("4 0 1 0\n", "4 0 1 0 3 1\n");
    let [plain, parametric] = [plain, parametric].map(|text| read(&text).unwrap());
    assert_eq!(plain.points, parametric.points);
    // The second square is that of a part of the surface 2.
    let parts = "$PartitionedEntities\n2\n0\n0 0 1 0\n5 2 2 1 2 1 0 0 2 1 0 1 3 0\n$EndPartitionedEntities\n";
    let parted = NEW
        .replace("$Nodes\n", &format!("{parts}$Nodes\n"))
        .replace("2 2 3 1\n5 2 3 6 5", "2 5 3 1\n5 2 3 6 5");
    let (whole, parted) = (read(NEW).unwrap(), read(&parted).unwrap());
    assert_eq!(whole.regions, parted.regions);
    assert_eq!(whole.cell_count(), parted.cell_count());
}
