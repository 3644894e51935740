//! The dome of `own_dome.csv`, solved through a problem file on a mesh of its own: a dome on two electrodes on a
//! board, with one between base and cap.

use std::fmt::Write as _;

use taxel::table::Cell;
use taxel_bodies::problem::{Body, Ended, ProblemFile};

/// Columns of cells: over the base and under the cap, and beyond the cap. They are close at the edges of the
/// electrodes, and at the axis, where the probe touches first.
const COLUMNS: [f64; 34] = [
    0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.25, 1.5, 1.7, 1.85, 1.93, 1.97, 1.99, 1.997,
    2.0, 2.003, 2.01, 2.03, 2.07, 2.15, 2.3, 2.4, 2.46, 2.485, 2.495, 2.5, 2.505, 2.515, 2.54, 2.6,
    2.75,
];
const OUTER: [f64; 15] = [
    3.0, 3.2, 3.5, 3.75, 3.88, 3.95, 3.98, 3.993, 4.0, 4.007, 4.02, 4.05, 4.12, 4.4, 5.0,
];
/// Rows of the base, and of the cap from its foot to its top.
const BASE: [f64; 13] = [
    0.0, 0.004, 0.015, 0.04, 0.1, 0.25, 0.5, 0.75, 0.9, 0.96, 0.985, 0.996, 1.0,
];
const CAP: [f64; 13] = [
    0.0, 0.004, 0.015, 0.04, 0.1, 0.22, 0.36, 0.5, 0.64, 0.76, 0.86, 0.94, 1.0,
];
/// Radius of the sphere whose cap is 3 wide and 1.5 high.
const SPHERE: f64 = 3.75;

/// Six-node triangles of second order by the parameters of their corners, which `place` maps to radius
/// and height, and curves by two.
struct Mesh {
    nodes: Vec<[f64; 2]>,
    elements: Vec<(usize, usize, Vec<usize>)>,
}

impl Mesh {
    fn node(&mut self, at: [f64; 2]) -> usize {
        let near = |known: &[f64; 2]| (known[0] - at[0]).hypot(known[1] - at[1]) < 1e-7;
        if let Some(known) = self.nodes.iter().position(near) {
            return known + 1;
        }
        self.nodes.push(at);
        self.nodes.len()
    }

    fn add(
        &mut self,
        kind: usize,
        group: usize,
        corners: &[[f64; 2]],
        place: &dyn Fn([f64; 2]) -> [f64; 2],
    ) {
        let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let mut nodes: Vec<usize> = corners
            .iter()
            .map(|corner| self.node(place(*corner)))
            .collect();
        let sides = if corners.len() == 2 { 1 } else { corners.len() };
        for side in 0..sides {
            let at = middle(corners[side], corners[(side + 1) % corners.len()]);
            nodes.push(self.node(place(at)));
        }
        self.elements.push((kind, group, nodes));
    }

    /// Two triangles in a cell; one where its right side has no height, whose upper and lower sides meet there.
    fn cell(&mut self, [a, b]: [f64; 2], [c, d]: [f64; 2], place: &dyn Fn([f64; 2]) -> [f64; 2]) {
        if place([b, c])[1] < place([b, d])[1] {
            self.add(9, 1, &[[a, c], [b, c], [a, d]], place);
            self.add(9, 1, &[[b, c], [b, d], [a, d]], place);
            return;
        }
        let middle = 0.5 * (a + b);
        let points = [
            [a, c],
            [b, c],
            [a, d],
            [middle, c],
            [middle, d],
            [a, 0.5 * (c + d)],
        ];
        let nodes = points.map(|point| self.node(place(point)));
        self.elements.push((9, 1, nodes.to_vec()));
    }
}

const GROUPS: [(usize, &str); 8] = [
    (2, "solid"),
    (1, "axis"),
    (1, "centre"),
    (1, "ring"),
    (1, "bottom"),
    (1, "electrode_top"),
    (1, "skin"),
    (1, "rim"),
];

/// The mesh as MSH 2.2, mm.
fn mesh() -> String {
    let mut mesh = Mesh {
        nodes: Vec::new(),
        elements: Vec::new(),
    };
    let base = |at: [f64; 2]| at;
    let cap = |[r, t]: [f64; 2]| {
        [
            r,
            1.0 + t * ((SPHERE * SPHERE - r * r).sqrt() - 2.25).max(0.0),
        ]
    };
    let all: Vec<f64> = COLUMNS.iter().chain(&OUTER).copied().collect();
    for r in all.windows(2) {
        for z in BASE.windows(2) {
            mesh.cell([r[0], r[1]], [z[0], z[1]], &base);
        }
        let group = if r[1] <= 2.0 {
            3
        } else if r[0] >= 2.5 && r[1] <= 4.0 {
            4
        } else {
            5
        };
        mesh.add(8, group, &[[r[0], 0.0], [r[1], 0.0]], &base);
        if r[1] <= 2.0 {
            mesh.add(8, 6, &[[r[0], 1.0], [r[1], 1.0]], &base);
        }
        if r[1] <= 3.0 {
            for t in CAP.windows(2) {
                mesh.cell([r[0], r[1]], [t[0], t[1]], &cap);
            }
            mesh.add(8, 7, &[[r[0], 1.0], [r[1], 1.0]], &cap);
        }
    }
    for (rows, place) in [
        (&BASE[..], &base as &dyn Fn([f64; 2]) -> [f64; 2]),
        (&CAP[..], &cap),
    ] {
        for z in rows.windows(2) {
            mesh.add(8, 2, &[[0.0, z[0]], [0.0, z[1]]], place);
        }
    }
    let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n7\n");
    for (number, (dimension, name)) in GROUPS.iter().enumerate().take(7) {
        let _ = writeln!(text, "{dimension} {} \"{name}\"", number + 1);
    }
    let _ = writeln!(text, "$EndPhysicalNames\n$Nodes\n{}", mesh.nodes.len());
    for (number, [r, z]) in mesh.nodes.iter().enumerate() {
        let _ = writeln!(text, "{} {r} {z} 0", number + 1);
    }
    let _ = writeln!(text, "$EndNodes\n$Elements\n{}", mesh.elements.len());
    for (number, (kind, group, nodes)) in mesh.elements.iter().enumerate() {
        let nodes: Vec<String> = nodes.iter().map(usize::to_string).collect();
        let _ = writeln!(
            text,
            "{} {kind} 2 {group} {group} {}",
            number + 1,
            nodes.join(" ")
        );
    }
    text.push_str("$EndElements\n");
    text
}

fn problem(shape: &str, depths: &[&str]) -> String {
    let values: Vec<String> = depths
        .iter()
        .map(|depth| format!("\"{depth} mm\""))
        .collect();
    format!(
        "schema = 1\nname = \"dome on electrodes\"\ngeometry = \"axisymmetric\"\n\
         [mesh]\nfile = \"dome.msh\"\nunit = \"1 mm\"\n\
         [[material]]\nregions = [\"solid\"]\nlaw = {{ neo_hookean = {{ shear_modulus = \"50 kPa\" }} }}\ncompressibility = \"incompressible\"\n\
         [[parameter]]\nname = \"depth\"\nvalues = [{}]\n\
         [[support]]\non = \"centre\"\nheld = [\"x\", \"y\"]\n\
         [[support]]\non = \"ring\"\nheld = [\"x\", \"y\"]\n\
         [[support]]\non = \"bottom\"\nheld = [\"x\", \"y\"]\n\
         [[support]]\non = \"axis\"\nheld = [\"x\"]\n\
         [[obstacle]]\nname = \"probe\"\nsurface = \"skin\"\nshape = {shape}\nmoved = {{ by = \"depth\", y = -1 }}\nfriction = 0\n\
         [capacitance]\nelectrodes = [\"centre\", \"ring\", \"electrode_top\"]\n\
         [[capacitance.dielectric]]\nregions = [\"solid\"]\npermittivity = 2.8\n",
        values.join(", ")
    )
}

/// Rows of the reference: depth, force in N, and the capacitances between centre and top, ring and top, centre and
/// ring, in fF.
fn reference(probe: &str) -> Vec<[f64; 5]> {
    let text = include_str!("../../../taxel/tests/reference/own_dome.csv");
    let rows = text.lines().filter(|line| line.starts_with(probe));
    rows.map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |at: usize| cells[at].parse::<f64>().unwrap();
        [number(2), number(3), -number(4), -number(5), -number(6)]
    })
    .collect()
}

fn compare(probe: &str, shape: &str) {
    let rows = reference(probe);
    let depths: Vec<String> = rows.iter().map(|row| row[0].to_string()).collect();
    let depths: Vec<&str> = depths.iter().map(String::as_str).collect();
    let text = problem(shape, &depths);
    let file = ProblemFile::parse("dome.toml", &text).unwrap();
    let mut body = Body::new(file, ("dome.toml", &text), ("dome.msh", mesh().as_bytes())).unwrap();
    while body.done() < body.steps() {
        assert_eq!(body.step(|_| true).unwrap(), Ended::Done);
    }
    let columns: Vec<String> = body.columns().into_iter().map(|one| one.name).collect();
    let at = |name: &str| columns.iter().position(|column| column == name).unwrap();
    let columns = [
        at("probe_force_y"),
        at("capacitance_centre_electrode_top"),
        at("capacitance_ring_electrode_top"),
        at("capacitance_centre_ring"),
    ];
    for (cells, row) in body.cells().iter().skip(1).zip(&rows) {
        let value = |column: usize| match cells[columns[column]] {
            Cell::Number(value) => value,
            _ => f64::NAN,
        };
        let force = -value(0);
        let off = force / row[1] - 1.0;
        println!(
            "{probe} {} mm: {force:.6} N, off by {:.3} %",
            row[0],
            100.0 * off
        );
        // The bar for a mesh as it is, from 0.1 mm on 0.8 %; above that few cells touch, and the
        // reference itself is known to 0.2 %.
        assert!(
            off.abs() < if row[0] < 0.1 { 0.03 } else { 0.008 },
            "{row:?} {force}"
        );
        for (column, expected) in row[2..].iter().enumerate() {
            let off = 1e15 * value(1 + column) / expected - 1.0;
            println!("  off by {:.4} %", 100.0 * off);
            // The bar for capacitances.
            assert!(off.abs() < 0.0015, "{row:?} {column}: {off}");
        }
    }
}

#[test]
fn the_dome_under_a_sphere_has_the_forces_and_capacitances_of_the_reference() {
    compare(
        "sphere",
        "{ sphere = { centre = [\"0 mm\", \"6.5 mm\", \"0 mm\"], radius = \"4 mm\" } }",
    );
}

#[test]
fn the_dome_under_a_plate_has_the_forces_and_capacitances_of_the_reference() {
    compare(
        "plate",
        "{ plane = { point = [\"0 mm\", \"2.5 mm\", \"0 mm\"], normal = [0, -1, 0] } }",
    );
}
