//! Meshes as others send them: two blocks that were put together rightly or wrongly, in the plane and
//! in space, without a named group. None is solved wrong without a word.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use taxel_bodies::problem::{Body, ProblemFile};

/// Nodes and cells of a mesh that is being made.
#[derive(Default, Clone)]
struct Drawn {
    nodes: Vec<[f64; 3]>,
    /// Number of the group and corners.
    cells: Vec<(usize, Vec<usize>)>,
}

impl Drawn {
    /// Adds a block with nodes of its own: quadrilaterals or hexahedra, or what they are cut into.
    fn block(&mut self, group: usize, [low, high]: [[f64; 3]; 2], counts: [usize; 3], cut: bool) {
        let flat = counts[2] == 0;
        let first = self.nodes.len();
        let layers = if flat { 1 } else { counts[2] + 1 };
        for k in 0..layers {
            for j in 0..=counts[1] {
                for i in 0..=counts[0] {
                    let at = |d: usize, n: usize| {
                        low[d] + (high[d] - low[d]) * n as f64 / counts[d].max(1) as f64
                    };
                    self.nodes.push([at(0, i), at(1, j), at(2, k)]);
                }
            }
        }
        let node =
            |i: usize, j: usize, k: usize| first + i + (counts[0] + 1) * (j + (counts[1] + 1) * k);
        for k in 0..counts[2].max(1) {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    let face = |k: usize| {
                        [
                            node(i, j, k),
                            node(i + 1, j, k),
                            node(i + 1, j + 1, k),
                            node(i, j + 1, k),
                        ]
                    };
                    let mut corners = face(k).to_vec();
                    if !flat {
                        corners.extend(face(k + 1));
                    }
                    let parts: &[&[usize]] = match (flat, cut) {
                        (true, true) => &[&[0, 1, 2], &[0, 2, 3]],
                        (false, true) => &[
                            &[0, 1, 2, 6],
                            &[0, 2, 3, 6],
                            &[0, 3, 7, 6],
                            &[0, 7, 4, 6],
                            &[0, 4, 5, 6],
                            &[0, 5, 1, 6],
                        ],
                        (true, false) => &[&[0, 1, 2, 3]],
                        (false, false) => &[&[0, 1, 2, 3, 4, 5, 6, 7]],
                    };
                    for part in parts {
                        let corners = part.iter().map(|&at| corners[at]).collect();
                        self.cells.push((group, corners));
                    }
                }
            }
        }
    }

    /// Makes nodes at one place one where `here` says so.
    fn weld(&mut self, here: impl Fn([f64; 3]) -> bool) {
        let same = |a: [f64; 3], b: [f64; 3]| (0..3).all(|d| (a[d] - b[d]).abs() < 1e-9);
        for node in 0..self.nodes.len() {
            let place = self.nodes[node];
            let earlier = (0..node).find(|&other| here(place) && same(self.nodes[other], place));
            if let Some(other) = earlier {
                for (_, corners) in &mut self.cells {
                    for corner in corners.iter_mut().filter(|corner| **corner == node) {
                        *corner = other;
                    }
                }
            }
        }
    }

    /// The file; with middles of edges where `curved` asks for the second order.
    fn text(&self, second_order: bool) -> String {
        let mut drawn = self.clone();
        let edges: &[&[[usize; 2]]] = &[
            &[[0, 1], [1, 2], [2, 0]],
            &[[0, 1], [1, 2], [2, 3], [3, 0]],
            &[[0, 1], [1, 2], [2, 0], [3, 0], [2, 3], [1, 3]],
            &[
                [0, 1],
                [0, 3],
                [0, 4],
                [1, 2],
                [1, 5],
                [2, 3],
                [2, 6],
                [3, 7],
                [4, 5],
                [4, 7],
                [5, 6],
                [6, 7],
            ],
        ];
        let solid = drawn.nodes.iter().any(|node| node[2] != 0.0);
        let kind = |corners: usize| match (solid, corners) {
            (false, 3) => 0,
            (false, _) => 1,
            (true, 4) => 2,
            (true, _) => 3,
        };
        let codes = if second_order {
            [9, 16, 11, 17]
        } else {
            [2, 3, 4, 5]
        };
        let mut lines = Vec::new();
        let mut middles = std::collections::BTreeMap::new();
        for (number, (group, corners)) in self.cells.iter().enumerate() {
            let kind = kind(corners.len());
            let mut nodes = corners.clone();
            for [a, b] in edges[kind].iter().filter(|_| second_order) {
                let ends = [corners[*a].min(corners[*b]), corners[*a].max(corners[*b])];
                let middle = *middles.entry(ends).or_insert_with(|| {
                    let [a, b] = ends.map(|end| self.nodes[end]);
                    drawn
                        .nodes
                        .push(std::array::from_fn(|d| f64::midpoint(a[d], b[d])));
                    drawn.nodes.len() - 1
                });
                nodes.push(middle);
            }
            let nodes: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
            // Gmsh gives a group that is oriented against its entity a negative number.
            let sign = if number % 3 == 0 { "-" } else { "" };
            lines.push(format!(
                "{} {} 2 {sign}{group} 1 {}",
                number + 1,
                codes[kind],
                nodes.join(" ")
            ));
        }
        let nodes = drawn.nodes.iter().enumerate();
        let nodes = nodes.map(|(at, [x, y, z])| format!("{} {x:.16} {y:.16} {z:.16}", at + 1));
        let nodes: Vec<String> = nodes.collect();
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n{}\n$EndNodes\n$Elements\n{}\n{}\n$EndElements\n",
            nodes.len(),
            nodes.join("\n"),
            lines.len(),
            lines.join("\n")
        )
    }
}

/// What was done to a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Done {
    /// Common nodes.
    Welded,
    /// The same with nodes in the middles of edges.
    SecondOrder,
    /// Cells inside out.
    Turned,
    /// Nodes of its own for each block, and a tie.
    Tied,
    /// The same, and a contact of the two sides.
    Touching,
    /// The same, and a contact of the outside with itself.
    TouchingAnywhere,
    /// Nodes of its own for each block.
    Apart,
    /// The same, of two meshes that do not match.
    Hanging,
    /// Common nodes on a part of the interface.
    PartlyWelded,
    /// The upper block reaches into the lower.
    Overlapping,
    /// A post in the lower block, in its place.
    Post,
    /// A cell that is there twice.
    Twice,
}

const ALL: [Done; 12] = [
    Done::Welded,
    Done::SecondOrder,
    Done::Turned,
    Done::Tied,
    Done::Touching,
    Done::TouchingAnywhere,
    Done::Apart,
    Done::Hanging,
    Done::PartlyWelded,
    Done::Overlapping,
    Done::Post,
    Done::Twice,
];

fn problem(flat: bool, height: f64, way: f64, regions: &str, more: &str) -> String {
    let (geometry, up) = if flat {
        ("{ plane_strain = { depth = \"10 mm\" } }", "y")
    } else {
        ("\"solid\"", "z")
    };
    let side = |axis: &str| {
        format!(
            "[[support]]\non = {{ plane = {{ axis = \"{axis}\", at = \"0 mm\" }} }}\nheld = [\"{axis}\"]\n"
        )
    };
    let third = if flat { String::new() } else { side("y") };
    format!(
        "schema = 1\nname = \"two blocks\"\ngeometry = {geometry}\nmesh = {{ file = \"mesh.msh\", unit = \"1 mm\" }}\n\
         [[material]]\nregions = {regions}\nlaw = {{ neo_hookean = {{ shear_modulus = \"100 kPa\" }} }}\ncompressibility = \"incompressible\"\n\
         [[parameter]]\nname = \"way\"\nvalues = [\"{way} mm\"]\n\
         [[support]]\non = {{ plane = {{ axis = \"{up}\", at = \"0 mm\" }}, name = \"bottom\" }}\nheld = [\"{up}\"]\n{}{third}\
         [[support]]\non = {{ plane = {{ axis = \"{up}\", at = \"{height} mm\" }} }}\nmoved = {{ by = \"way\", {up} = -1 }}\n\
         {more}[output]\nreactions = [\"bottom\"]\n",
        side("x")
    )
}

/// A problem with its mesh, and the height of each block.
struct Case {
    done: Done,
    /// In the plane; cut into triangles or tetrahedra.
    flat: bool,
    cut: bool,
    drawn: Drawn,
    wide: [f64; 2],
    heights: [f64; 2],
    /// Of the whole, where the upper block reaches into the lower.
    height: f64,
}

/// Stretch along the height.
const STRETCH: f64 = 0.9;

impl Case {
    fn of(seed: u64) -> Self {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let done = ALL[chance.random_range(0..ALL.len())];
        let flat = chance.random_range(0..2) == 0;
        let cut = chance.random_range(0..2) == 0;
        let up = if flat { 1 } else { 2 };
        let mut counts = [
            1 + chance.random_range(0..2),
            1 + chance.random_range(0..2),
            usize::from(!flat),
        ];
        let wide = [chance.random_range(1.0..3.0), chance.random_range(1.0..3.0)];
        let heights = [chance.random_range(0.5..2.0), chance.random_range(0.5..2.0)];
        let block = |low: f64, high: f64| {
            let mut ends = [[0.0; 3], [wide[0], if flat { 0.0 } else { wide[1] }, 0.0]];
            ends[0][up] = low;
            ends[1][up] = high;
            ends
        };
        let mut drawn = Drawn::default();
        if done == Done::PartlyWelded {
            counts[0] = 2;
        }
        drawn.block(1, block(0.0, heights[0]), counts, cut);
        let finer = [
            Done::Hanging,
            Done::Tied,
            Done::Touching,
            Done::TouchingAnywhere,
        ];
        counts[0] += usize::from(finer.contains(&done));
        let sunk = match done {
            Done::Overlapping => chance.random_range(0.01..0.9) * heights[0].min(heights[1]),
            _ => 0.0,
        };
        let height = heights[0] + heights[1] - sunk;
        if done == Done::Post {
            let mut ends = block(0.2 * heights[0], 0.7 * heights[0]);
            for d in (0..2).filter(|&d| d != up) {
                ends[0][d] = chance.random_range(0.1..0.4) * wide[d];
                ends[1][d] = chance.random_range(0.6..0.9) * wide[d];
            }
            drawn.block(3, ends, counts, cut);
        }
        drawn.block(2, block(heights[0] - sunk, height), counts, cut);
        let mut case = Self {
            done,
            flat,
            cut,
            drawn,
            wide,
            heights,
            height,
        };
        case.join(up);
        case.disorder(&mut chance);
        case
    }

    /// Makes common nodes of the seam, or of a part of it.
    fn join(&mut self, up: usize) {
        let (seam, wide) = (self.heights[0], self.wide[0]);
        let on_seam = |place: [f64; 3]| (place[up] - seam).abs() < 1e-9;
        match self.done {
            Done::PartlyWelded => self
                .drawn
                .weld(|place| on_seam(place) && place[0] < 0.6 * wide),
            Done::Welded | Done::SecondOrder | Done::Turned | Done::Post | Done::Twice => {
                self.drawn.weld(on_seam);
            }
            _ => {}
        }
    }

    /// Turns cells inside out, or repeats one.
    fn disorder(&mut self, chance: &mut ChaCha8Rng) {
        let flat = self.flat;
        let cells = &mut self.drawn.cells;
        match self.done {
            Done::Turned => {
                for (number, (_, corners)) in cells.iter_mut().enumerate() {
                    if number > 0 && chance.random_range(0..2) == 0 {
                        continue;
                    }
                    let order: &[usize] = match corners.len() {
                        3 => &[0, 2, 1],
                        4 if flat => &[0, 3, 2, 1],
                        4 => &[0, 2, 1, 3],
                        _ => &[4, 5, 6, 7, 0, 1, 2, 3],
                    };
                    *corners = order.iter().map(|&at| corners[at]).collect();
                }
            }
            Done::Twice => {
                let cell = cells[chance.random_range(0..cells.len())].clone();
                cells.push(cell);
            }
            _ => {}
        }
    }

    /// The problem file.
    fn text(&self) -> String {
        let axis = if self.flat { "y" } else { "z" };
        let seam = |of: &str| {
            format!(
                "{{ plane = {{ axis = \"{axis}\", at = \"{} mm\" }}, of = \"{of}\", name = \"of {of}\" }}",
                self.heights[0]
            )
        };
        let more = match self.done {
            Done::Tied => format!("[[tie]]\nsurfaces = [{}, {}]\n", seam("2"), seam("1")),
            Done::Touching => format!(
                "[[contact]]\nname = \"seam\"\nsurfaces = [{}, {}]\nfriction = 0\n",
                seam("2"),
                seam("1")
            ),
            Done::TouchingAnywhere => "[[contact]]\nname = \"seam\"\nsurfaces = [{ outside = true }, { outside = true }]\nfriction = 0\n".to_owned(),
            _ => String::new(),
        };
        let regions = match self.done {
            Done::Post => "[\"1\", \"2\", \"3\"]",
            _ => "[\"1\", \"2\"]",
        };
        let way = (1.0 - STRETCH) * self.height;
        problem(self.flat, self.height, way, regions, &more)
    }

    /// What the message says, of a mesh that is refused.
    fn refused(&self) -> Option<&'static str> {
        match self.done {
            Done::Apart | Done::Hanging | Done::PartlyWelded => Some("lie on each other"),
            Done::Overlapping | Done::Post => Some("fill one place"),
            Done::Twice => Some("has the corners of cell"),
            _ => None,
        }
    }

    /// Force of the block without a seam, N, and the share of it that may be wrong.
    fn force(&self) -> [f64; 2] {
        let lateral = if self.flat { -3 } else { -2 };
        let depth = if self.flat { 1e-2 } else { 1e-3 * self.wide[1] };
        let stress = 100e3 * (f64::powi(STRETCH, lateral) - STRETCH);
        // A contact accepts an overlap of 1e-4 of the side of a cell, which is that much less way; the
        // force grows by up to 1.5 times the share of the way.
        let sides = self.wide.iter().chain(&self.heights);
        let side = sides.fold(0.0, |most: f64, side| most.max(*side));
        let share = match self.done {
            Done::Touching | Done::TouchingAnywhere => {
                1.5 * 1e-4 * side / ((1.0 - STRETCH) * self.height)
            }
            _ => 1e-5,
        };
        [stress * 1e-3 * self.wide[0] * depth, share]
    }

    /// What is wrong with its answer, if anything is.
    fn wrong(&self) -> Option<String> {
        let text = self.text();
        let mesh = self.drawn.text(self.done == Done::SecondOrder);
        let file = ProblemFile::parse("problem.toml", &text).unwrap();
        let made = Body::new(file, ("problem.toml", &text), ("mesh.msh", mesh.as_bytes()));
        let mut body = match (made, self.refused()) {
            (Err(error), Some(word)) if error.to_string().contains(word) => return None,
            (Ok(_), Some(_)) => return Some("it was accepted".to_owned()),
            (Err(error), _) => return Some(error.to_string()),
            (Ok(body), None) => body,
        };
        let mut notes = body.notes().iter();
        if notes.any(|note| note.contains("inside out")) != (self.done == Done::Turned) {
            return Some(format!("{:?}", body.notes()));
        }
        if let Err(failure) = body.step(|_| true) {
            return Some(body.explain(&failure));
        }
        let name = if self.flat {
            "bottom_reaction_y"
        } else {
            "bottom_reaction_z"
        };
        let columns = body.columns();
        let at = columns
            .iter()
            .position(|column| column.name == name)
            .unwrap();
        let taxel::table::Cell::Number(force) = body.cells()[1][at] else {
            return Some("no force".to_owned());
        };
        let [exact, share] = self.force();
        ((force / exact - 1.0).abs() > share).then(|| format!("{force} for {exact} N"))
    }
}

/// Of each mesh the force is that of a block without a seam, or a word says why there is none.
fn none_is_wrong_without_a_word(seeds: std::ops::Range<u64>) {
    let wrong = seeds.filter_map(|seed| {
        let case = Case::of(seed);
        let wrong = case.wrong()?;
        let Case {
            done, flat, cut, ..
        } = case;
        Some(format!(
            "seed {seed}, {done:?}, flat {flat}, cut {cut}: {wrong}"
        ))
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn of_60_meshes_none_is_wrong_without_a_word() {
    none_is_wrong_without_a_word(0..60);
}

#[test]
#[ignore = "the long form of the test above"]
fn of_1000_meshes_none_is_wrong_without_a_word() {
    none_is_wrong_without_a_word(0..1000);
}

fn body(text: &str, mesh: &str) -> Result<Body, taxel::InputError> {
    let file = ProblemFile::parse("problem.toml", text)?;
    Body::new(file, ("problem.toml", text), ("mesh.msh", mesh.as_bytes()))
}

/// A square of 3 mm, with or without its middle.
fn square(holed: bool) -> String {
    let mut drawn = Drawn::default();
    drawn.block(1, [[0.0; 3], [3.0, 3.0, 0.0]], [3, 3, 0], false);
    if holed {
        drawn.cells.remove(4);
    }
    drawn.text(false)
}

#[test]
fn a_field_across_an_unmeshed_cavity_is_noted() {
    let electrodes = "[capacitance]\nelectrodes = [\"bottom\", { plane = { axis = \"y\", at = \"3 mm\" } }]\n\
                      [[capacitance.dielectric]]\nregions = [\"1\"]\npermittivity = 3\n";
    let text = problem(true, 3.0, 0.1, "[\"1\"]", electrodes);
    let notes = |holed: bool| body(&text, &square(holed)).unwrap().notes().to_vec();
    assert_eq!(notes(false), [""; 0]);
    let [note] = &notes(true)[..] else {
        panic!("{:?}", notes(true));
    };
    // The middle one of the three lines from below to above.
    for part in [
        "\"bottom\" and \"y = 3\"",
        "1.0000 mm",
        "(1.5000, 1.5000",
        "33 %",
    ] {
        assert!(note.contains(part), "{part}: {note}");
    }
}

#[test]
fn moduli_in_two_units_are_refused_and_auxetic_solids_are_not() {
    let text = problem(true, 3.0, 0.1, "[\"1\"]", "");
    let soft = "compressibility = { quadratic = { bulk_modulus = \"1 kPa\" } }";
    let slip = text.replace("compressibility = \"incompressible\"", soft);
    let refused = |text: &str| body(text, &square(false)).err().unwrap().to_string();
    assert!(
        refused(&slip).contains("Poisson's ratio is -0.95"),
        "{}",
        refused(&slip)
    );
    let meant = slip.replace(soft, &format!("{soft}\nauxetic = true"));
    let lines = body(&meant, &square(false)).unwrap().description();
    assert!(
        lines[0].starts_with("body: 3.0000 x 3.0000 mm"),
        "{lines:?}"
    );
    assert!(lines[1].contains("Poisson's ratio -0.95"), "{lines:?}");
    let idle = text.replace("[[parameter]]", "auxetic = true\n[[parameter]]");
    assert!(refused(&idle).contains("material.0.auxetic"));
}

#[test]
fn a_selection_that_selects_nothing_is_refused_at_its_key() {
    let text = problem(true, 3.0, 0.1, "[\"1\"]", "");
    for (from, to, word) in [
        ("at = \"3 mm\"", "at = \"4 mm\"", "support.2.on"),
        (
            "plane = { axis = \"y\", at = \"3 mm\" }",
            "name = \"top\"",
            "nothing is selected",
        ),
        (
            "plane = { axis = \"y\", at = \"3 mm\" }",
            "of = \"skin\"",
            "no region \"skin\"",
        ),
        (
            "axis = \"y\", at = \"3 mm\"",
            "axis = \"z\", at = \"3 mm\"",
            "does not extend along z",
        ),
        (
            "axis = \"y\", at = \"3 mm\" }",
            "axis = \"y\", at = \"3 mm\" }, name = \"bottom\"",
            "another selection",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let error = body(&text.replace(from, to), &square(false)).err().unwrap();
        assert!(error.to_string().contains(word), "{word}: {error}");
    }
}
