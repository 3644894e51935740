//! Files as Gmsh writes them: every type of element that there is a cell for, in both formats,
//! as text and binary. `meshes/make.py` makes them.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use taxel_fem::mesh::gmsh::{GmshError, read_file};
use taxel_fem::mesh::quality::{Quality, measure};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::load::traction;

fn file(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes");
    std::fs::read(folder.join(name)).unwrap()
}

/// A plate of 2 x 1 or a block of 2 x 1 x 0.5, see `make.py`.
#[track_caller]
fn is_whole(name: &str, cells: usize) {
    let drawing = read_file(&file(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mesh = &drawing.mesh;
    assert_eq!(mesh.cell_count(), cells, "{name}");
    assert_eq!(mesh.regions, ["soft", "hard"], "{name}");
    Quality::of(mesh).require(mesh).unwrap();
    let plane = mesh.dimension() == 2;
    let depth = if plane { 1.0 } else { 0.5 };
    for region in 0..2 {
        let own = (0..mesh.cell_count()).filter(|&cell| mesh.region_of(cell) == region);
        let size: f64 = own.map(|cell| measure(mesh, cell)).sum();
        // Rounding of some hundred sums.
        assert!((size - depth).abs() < 1e-12, "{name}: {size}");
    }
    let kinematics = if plane {
        Kinematics::PlaneStrain
    } else {
        Kinematics::Solid
    };
    // The top of a block is its cover, that of a plate an edge.
    for (surface, expected) in [("left", depth), ("top", 2.0)] {
        let forces = traction(mesh, kinematics, &mesh.surfaces[surface], |_| {
            [1.0, 0.0, 0.0]
        });
        let area: f64 = forces.iter().map(|(_, force)| force[0]).sum();
        assert!((area - expected).abs() < 1e-12, "{name} {surface}: {area}");
    }
    let corner = &mesh.node_sets["corner"];
    assert_eq!(corner.len(), 1, "{name}");
    assert_eq!(mesh.points[corner[0] as usize], [0.0; 3], "{name}");
    let axes: &[usize] = match (plane, name.starts_with("xz")) {
        (true, true) => &[0, 2],
        (true, false) => &[0, 1],
        _ => &[0, 1, 2],
    };
    assert_eq!(drawing.axes, axes, "{name}");
}

#[test]
fn every_type_of_element_is_read() {
    for (kind, cells) in [
        ("tri3", 28),
        ("tri6", 28),
        ("quad4", 8),
        ("quad8", 8),
        ("quad9", 8),
        ("xz", 8),
        ("hex8", 16),
        ("hex20", 16),
        ("hex27", 16),
        // Three tetrahedra for each of 56 wedges.
        ("wedge6", 168),
        ("wedge15", 168),
        ("wedge18", 168),
        ("tet4", 133),
        ("tet10", 133),
    ] {
        is_whole(&format!("{kind}-4.1-binary.msh"), cells);
    }
}

#[test]
fn all_formats_give_the_same_mesh() {
    for (kind, cells) in [("tri6", 28), ("wedge15", 168), ("hex27", 16)] {
        let formats = ["4.1-binary", "4.1-text", "2.2-binary", "2.2-text"];
        let meshes = formats.map(|format| {
            let name = format!("{kind}-{format}.msh");
            is_whole(&name, cells);
            read_file(&file(&name)).unwrap().mesh
        });
        for mesh in &meshes[1..] {
            assert_eq!(mesh.points.len(), meshes[0].points.len(), "{kind}");
            for (found, expected) in mesh.points.iter().zip(&meshes[0].points) {
                for (found, expected) in found.iter().zip(expected) {
                    // Text has 16 digits.
                    assert!((found - expected).abs() < 1e-15, "{kind}");
                }
            }
            for cell in 0..cells {
                assert_eq!(mesh.cell(cell), meshes[0].cell(cell), "{kind}");
            }
        }
    }
}

#[test]
fn an_element_without_a_cell_is_refused_by_name_and_count() {
    let error = read_file(&file("pyramid-4.1-binary.msh")).unwrap_err();
    assert!(matches!(
        error,
        GmshError::UnknownType {
            code: 7,
            count: 1,
            ..
        }
    ));
    let message = error.to_string();
    assert!(message.contains("1 pyramids of first order"), "{message}");
}

#[test]
fn a_binary_file_that_was_cut_off_is_refused_and_never_panics() {
    for name in ["wedge15-4.1-binary.msh", "hex27-2.2-binary.msh"] {
        let whole = file(name);
        let elements = whole.windows(9).position(|at| at == b"$Elements").unwrap();
        let end = whole
            .windows(12)
            .position(|at| at == b"$EndElements")
            .unwrap();
        for cut in (0..end).step_by(301).chain((elements..end).step_by(13)) {
            assert!(read_file(&whole[..cut]).is_err(), "{name} {cut}");
        }
        // Any byte may be wrong.
        for at in (0..whole.len()).step_by(29) {
            let mut wrong = whole.clone();
            wrong[at] ^= 0x55;
            let _ = read_file(&wrong);
        }
    }
}
