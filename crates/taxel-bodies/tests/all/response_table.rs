//! Tables of bodies: a block between plates, whose answers are closed forms.

use std::collections::HashMap;
use std::sync::Mutex;

use taxel::solutions::{BodyDrawing, BodyFiles, BodyLoad, BodyOutput};
use taxel::transduction::ResponseTable;
use taxel_bodies::tabulate_body;
use taxel_bodies::transduction::{NoPoints, NoResponse, PointAnswer, Points, ResponseOptions};
use taxel_numerics::sobol;

/// Four cells over a block 2 mm wide and 1 mm high.
const MESH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n2 1 \"block\"\n1 2 \"bottom\"\n1 3 \"top\"\n1 4 \"left\"\n1 5 \"right\"\n$EndPhysicalNames\n\
$Nodes\n9\n1 0 0 0\n2 1 0 0\n3 2 0 0\n4 0 0.5 0\n5 1 0.5 0\n6 2 0.5 0\n7 0 1 0\n8 1 1 0\n9 2 1 0\n$EndNodes\n\
$Elements\n12\n1 3 2 1 1 1 2 5 4\n2 3 2 1 1 2 3 6 5\n3 3 2 1 1 4 5 8 7\n4 3 2 1 1 5 6 9 8\n5 1 2 2 2 1 2\n6 1 2 2 2 2 3\n7 1 2 3 3 7 8\n8 1 2 3 3 8 9\n9 1 2 4 4 1 4\n10 1 2 4 4 4 7\n11 1 2 5 5 3 6\n12 1 2 5 5 6 9\n$EndElements\n";

/// The block, smooth between plates: the upper one comes down by `travel`; the right side goes out by `pull`.
fn problem(compressibility: &str, pulled: bool) -> String {
    let pull = if pulled {
        "[[parameter]]\nname = \"pull\"\nvalues = [\"0.1 mm\"]\n[[support]]\non = \"right\"\nmoved = { by = \"pull\", x = 1 }\n"
    } else {
        ""
    };
    format!(
        "schema = 1\nname = \"block\"\ngeometry = {{ plane_strain = {{ depth = \"10 mm\" }} }}\n\
         [mesh]\nfile = \"block.msh\"\nunit = \"1 mm\"\n\
         [[material]]\nregions = [\"block\"]\nlaw = {{ neo_hookean = {{ shear_modulus = \"50 kPa\" }} }}\ncompressibility = {compressibility}\n\
         [[parameter]]\nname = \"travel\"\nvalues = [\"0.1 mm\"]\n{pull}\
         [[support]]\non = \"bottom\"\nheld = [\"y\"]\n\
         [[support]]\non = \"left\"\nheld = [\"x\"]\n\
         [[support]]\non = \"top\"\nmoved = {{ by = \"travel\", y = -1 }}\n\
         [capacitance]\nelectrodes = [\"top\", \"bottom\"]\n\
         [[capacitance.dielectric]]\nregions = [\"block\"]\npermittivity = 3\n\
         [output]\nreactions = [\"top\"]\n"
    )
}

fn drawing(text: String, loads: &[(&str, f64)], tolerance: f64) -> BodyDrawing {
    let load = |(name, high): &(&str, f64)| BodyLoad {
        name: (*name).into(),
        unit: "m",
        range: [0.0, *high],
    };
    let electrodes =
        |names: &[&str]| BodyOutput::Capacitance(names.iter().map(|name| (*name).into()).collect());
    BodyDrawing {
        problem: "block.toml".into(),
        files: BodyFiles {
            text,
            mesh: MESH.into(),
            identity: None,
        },
        loads: loads.iter().map(load).collect(),
        pressing: "travel".into(),
        force: BodyOutput::Column {
            name: "top_reaction_y".into(),
            unit: "N",
        },
        sign: -1.0,
        channels: vec![
            ("pair".into(), electrodes(&["bottom", "top"])),
            ("all".into(), electrodes(&["top"])),
        ],
        tolerance,
    }
}

fn incompressible() -> BodyDrawing {
    let text = problem("\"incompressible\"", false);
    drawing(text, &[("travel", 0.4e-3)], 1e-3)
}

fn made(drawing: &BodyDrawing, jobs: usize, points: &dyn Points) -> ResponseTable {
    let options = ResponseOptions {
        jobs,
        ..ResponseOptions::default()
    };
    tabulate_body(drawing, options, points, "test", &mut |_| {}).unwrap()
}

#[test]
fn a_block_between_smooth_plates_is_met_with_its_slopes() {
    let table = made(&incompressible(), 1, &NoPoints);
    let file = table.file();
    assert_eq!((file.certificate.points, file.ended.clone()), (59, None));
    assert!(file.certificate.worst.iter().all(|worst| *worst <= 1e-3));
    let (width, height, depth, modulus) = (2e-3, 1e-3, 10e-3, 50e3);
    let permittivity = 3.0 * 8.8541878188e-12;
    for step in 0..=40 {
        let travel = 0.4e-3 * f64::from(step) / 40.0;
        // Plane strain: the stress is G (λ⁻² - λ²) on a side that is 1/λ as wide.
        let stretch = 1.0 - travel / height;
        let force = modulus * (stretch.powi(-3) - stretch) * width * depth;
        let capacitance = permittivity * width * depth / (height * stretch * stretch);
        let by_travel = [
            modulus * (3.0 * stretch.powi(-4) + 1.0) * width * depth / height,
            2.0 * capacitance / (stretch * height),
        ];
        let read = table.at(&[travel]);
        let full = [2.4, 1.5e-12];
        // The tolerance of the table, of a range of at most these.
        assert!((read[0].value - force).abs() < 1e-3 * full[0], "{travel}");
        for channel in [1, 2] {
            assert!(
                (read[channel].value - capacitance).abs() < 1e-3 * full[1],
                "{travel}"
            );
        }
        for (read, slope) in read.iter().zip(by_travel) {
            // Slopes within 2 %.
            assert!(
                (read.slopes[0] / slope - 1.0).abs() < 0.02,
                "{travel}: {read:?} {slope}"
            );
        }
    }
}

/// Keeps points in memory, and counts those that were not known.
#[derive(Default)]
struct Kept(Mutex<(HashMap<Vec<u64>, PointAnswer>, usize)>);

fn key(at: &[f64]) -> Vec<u64> {
    at.iter().map(|value| value.to_bits()).collect()
}

impl Points for Kept {
    fn known(&self, at: &[f64]) -> Option<PointAnswer> {
        self.0.lock().unwrap().0.get(&key(at)).cloned()
    }

    fn keep(&self, at: &[f64], answer: &PointAnswer) {
        let mut kept = self.0.lock().unwrap();
        kept.0.insert(key(at), answer.clone());
        kept.1 += 1;
    }
}

fn compressible() -> BodyDrawing {
    let text = problem("{ quadratic = { bulk_modulus = \"100 kPa\" } }", true);
    drawing(text, &[("pull", 0.3e-3), ("travel", 0.3e-3)], 5e-3)
}

#[test]
fn a_table_over_two_parameters_keeps_to_its_tolerance_and_does_not_depend_on_jobs_or_stops() {
    let drawing = compressible();
    let kept = Kept::default();
    let whole = made(&drawing, 1, &kept);
    assert_eq!(whole.text(), made(&drawing, 3, &NoPoints).text());
    // A run that was stopped after any number of points goes on to the same file.
    let all: Vec<_> = kept.0.lock().unwrap().0.clone().into_iter().collect();
    for share in [0, 5, 9] {
        let some = Kept::default();
        let known = all.len() * share / 10;
        some.0
            .lock()
            .unwrap()
            .0
            .extend(all[..known].iter().cloned());
        assert_eq!(made(&drawing, 2, &some).text(), whole.text());
        assert_eq!(some.0.lock().unwrap().1, all.len() - known);
    }
    // Other points than those that were looked at: one in 200 of 5 % + 2 deviations may be off.
    let exact = BodyDrawing {
        tolerance: 1e-9,
        ..drawing.clone()
    };
    let fresh = Kept::default();
    let ranges: Vec<f64> = (0..3)
        .map(|k| whole.file().span(k))
        .map(|[a, b]| b - a)
        .collect();
    let options = ResponseOptions {
        most_points: 80,
        ..ResponseOptions::default()
    };
    let none = tabulate_body(&exact, options, &fresh, "test", &mut |_| {});
    assert!(
        matches!(none, Err(NoResponse::Tolerance { .. })),
        "{none:?}"
    );
    let mut off = 0;
    let fresh = fresh.0.into_inner().unwrap().0;
    for (at, answer) in &fresh {
        let at: Vec<f64> = at.iter().map(|bits| f64::from_bits(*bits)).collect();
        let read = whole.at(&at);
        let missed = read.iter().zip(answer.as_ref().unwrap()).zip(&ranges);
        off += usize::from(
            missed
                .into_iter()
                .any(|((read, solved), range)| (read.value - solved).abs() > 5e-3 * range),
        );
    }
    // At most 5 % and two deviations of that count.
    let most = 0.05 * fresh.len() as f64 + 2.0 * (0.0475 * fresh.len() as f64).sqrt();
    assert!((off as f64) < most, "{off} of {}", fresh.len());
}

#[test]
fn slopes_over_two_parameters_are_those_of_the_solver() {
    let drawing = compressible();
    let table = made(&drawing, 2, &NoPoints);
    for place in sobol(2, 10, Some(77)) {
        let at = table.file().in_box(&place);
        let step = 1e-6;
        for along in 0..2 {
            let ends = [-step, step].map(|step| {
                let mut there = at.clone();
                there[along] += step;
                taxel_bodies::solve_point(&drawing, &there).unwrap()
            });
            let read = table.at(&at);
            for (output, read) in read.iter().enumerate() {
                let slope = (ends[1][output] - ends[0][output]) / (2.0 * step);
                let [low, high] = table.file().span(output);
                let scale = (high - low) / 0.3e-3;
                // 2 % of the mean slope over the box, or of its own.
                let bar = 0.02 * slope.abs().max(scale);
                assert!(
                    (read.slopes[along] - slope).abs() < bar,
                    "{at:?} {output} {along}: {} {slope}",
                    read.slopes[along]
                );
            }
        }
    }
}

#[test]
fn a_problem_without_what_is_asked_says_what_it_has() {
    let asked = |change: &dyn Fn(&mut BodyDrawing)| {
        let mut drawing = incompressible();
        change(&mut drawing);
        let options = ResponseOptions::default();
        tabulate_body(&drawing, options, &NoPoints, "test", &mut |_| {})
            .unwrap_err()
            .to_string()
    };
    let message = asked(&|drawing| drawing.loads[0].name = "trawel".into());
    assert!(
        message.contains("no parameter \"trawel\"\nhelp: give one of: travel"),
        "{message}"
    );
    let message = asked(&|drawing| {
        drawing.force = BodyOutput::Column {
            name: "plate_force_y".into(),
            unit: "N",
        };
    });
    assert!(message.contains("no output plate_force_y"), "{message}");
    let message = asked(&|drawing| {
        drawing.channels[0].1 = BodyOutput::Capacitance(vec!["top".into(), "side".into()]);
    });
    assert!(
        message.contains("no capacitance of top and side\nhelp: it has capacitance_top_bottom"),
        "{message}"
    );
    let message = asked(&|drawing| drawing.loads[0].unit = "Pa");
    assert!(
        message.contains("is a length, its range in the sensor file is in Pa"),
        "{message}"
    );
}

#[test]
fn a_box_beyond_the_solution_ends_where_it_does() {
    let text = problem("\"incompressible\"", false);
    // A free surface of an incompressible neo-Hookean solid creases where it is compressed to 0.544
    // (Biot 1963); four cells know that within a few parts in 100.
    let table = made(&drawing(text, &[("travel", 1.2e-3)], 5e-2), 1, &NoPoints);
    let end = table.file().parameters[0].range[1];
    assert!((0.44e-3..0.47e-3).contains(&end), "{end}");
    assert!(table.file().ended.is_some());
}
