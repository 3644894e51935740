//! Masks and moulds of the four devices against closed forms, over ranges of drawings and as
//! their files are read again.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use proptest::prelude::*;
use taxel::sensor::Sensor;
use taxel_fabricate::{File, Mask, Options, Plan, Polarity, Refused, files};

/// Areas are products and sums of lengths: round-off.
const AREA: f64 = 1e-9;
/// STL has numbers of 24 bits.
const VOLUME: f64 = 1e-6;

#[track_caller]
fn close(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs();
    assert!(
        error <= tolerance * expected.abs(),
        "{what}: {found} is not {expected}"
    );
}

fn sensor(name: &str, changes: &[(&str, String)]) -> Sensor {
    let mut text = Sensor::shipped_text(name).unwrap().to_owned();
    for (old, new) in changes {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    Sensor::parse(name, &text).unwrap()
}

fn mask<'p>(plan: &'p Plan, name: &str) -> &'p Mask {
    plan.masks.iter().find(|mask| mask.name == name).unwrap()
}

fn file(files: &[File], name: &str) -> Vec<u8> {
    files
        .iter()
        .find(|file| file.name == name)
        .unwrap()
        .bytes
        .clone()
}

/// Area of the closed polylines of a layer of a DXF file, m².
fn dxf_area(text: &str, layer: &str) -> f64 {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let pairs: Vec<(&str, &str)> = lines.chunks(2).map(|pair| (pair[0], pair[1])).collect();
    let mut area = 0.0;
    let mut corners: Vec<[f64; 2]> = Vec::new();
    let (mut kind, mut here) = ("", false);
    for (code, value) in pairs {
        match code {
            "0" => {
                kind = value;
                if kind == "VERTEX" {
                    corners.push([0.0; 2]);
                } else if kind == "SEQEND" && !corners.is_empty() {
                    if here {
                        area += shoelace(&corners);
                    }
                    corners.clear();
                }
            }
            "8" if kind == "POLYLINE" => here = value == layer,
            "10" if kind == "VERTEX" => corners.last_mut().unwrap()[0] = value.parse().unwrap(),
            "20" if kind == "VERTEX" => corners.last_mut().unwrap()[1] = value.parse().unwrap(),
            _ => {}
        }
    }
    area * 1e-6
}

fn shoelace(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let parts = corners
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - b[0] * a[1]);
    0.5 * parts.sum::<f64>()
}

/// Area of the boundaries of a layer and data type of a GDSII file, m², and all its texts.
fn gds_area(bytes: &[u8], layer: i16, kind: i16, grid: f64) -> (f64, Vec<String>) {
    let (mut at, mut area, mut here, mut boundary) = (0, 0.0, [0; 2], false);
    let mut texts = Vec::new();
    while at < bytes.len() {
        let length = usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
        let record = u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]);
        let data = &bytes[at + 4..at + length];
        let short = || i16::from_be_bytes([data[0], data[1]]);
        match record {
            0x0800 => boundary = true,
            0x0C00 => boundary = false,
            0x0D02 => here[0] = short(),
            0x0E02 => here[1] = short(),
            0x1906 => texts.push(String::from_utf8(data.to_vec()).unwrap()),
            0x1003 if boundary && here == [layer, kind] => {
                let numbers: Vec<f64> = data
                    .chunks(4)
                    .map(|four| f64::from(i32::from_be_bytes(four.try_into().unwrap())) * grid)
                    .collect();
                let corners: Vec<[f64; 2]> =
                    numbers.chunks(2).map(|two| [two[0], two[1]]).collect();
                assert_eq!(corners.first(), corners.last());
                area += shoelace(&corners[..corners.len() - 1]);
            }
            _ => {}
        }
        at += length;
    }
    assert_eq!(bytes[bytes.len() - 2..], [0x04, 0x00]);
    (area, texts)
}

/// Volume inside the triangles of a binary STL file, m³; every edge is there once each way.
fn stl_volume(bytes: &[u8]) -> f64 {
    assert!(!bytes.starts_with(b"solid"));
    let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
    assert_eq!(bytes.len(), 84 + 50 * count);
    let mut edges = std::collections::BTreeMap::new();
    let mut six = 0.0;
    for triangle in bytes[84..].chunks(50) {
        let numbers: Vec<f32> = triangle[..48]
            .chunks(4)
            .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
            .collect();
        let corners: Vec<[u32; 3]> = numbers[3..]
            .chunks(3)
            .map(|three| [three[0].to_bits(), three[1].to_bits(), three[2].to_bits()])
            .collect();
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let edge = (corners[from], corners[to]);
            *edges.entry(edge).or_insert(0) += 1;
        }
        let [a, b, c] = [0, 1, 2].map(|k| corners[k].map(|bits| f64::from(f32::from_bits(bits))));
        six += a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    for (edge, times) in &edges {
        assert_eq!(*times, 1);
        assert_eq!(edges.get(&(edge.1, edge.0)), Some(&1), "an open edge");
    }
    six / 6.0 * 1e-9
}

#[test]
fn files_of_all_devices_have_the_areas_and_volumes_of_their_plans() {
    for name in [
        "in-plane-20um",
        "in-plane-50um",
        "three-axis-8x8",
        "three-axis-unit",
        "piezo-1.5mm",
        "piezo-2.3mm",
        "liquid-metal-2x4",
    ] {
        let plan = Plan::of(&Sensor::shipped(name).unwrap()).unwrap();
        for (options, shrink) in [
            (Options::default(), 0.0),
            (
                Options {
                    mirror: true,
                    marks: true,
                    shrink: 0.02,
                    ..Options::default()
                },
                0.02,
            ),
            (
                Options {
                    polarity: Polarity::Inverted,
                    ..Options::default()
                },
                0.0,
            ),
        ] {
            let written = files(&plan, &options, "taxel test").unwrap();
            let dxf = String::from_utf8(file(&written, "masks.dxf")).unwrap();
            let gds = file(&written, "masks.gds");
            for (number, mask) in (1_i16..).zip(&plan.masks) {
                let area = match options.polarity {
                    Polarity::AsDrawn => mask.area(),
                    Polarity::Inverted => plan.field.area() - mask.area(),
                };
                let what = format!("{name} {}", mask.name);
                // The figures of the film of P3 fill the field: inverted nothing is left.
                let slack = AREA * plan.field.area();
                let layer = mask.name.to_uppercase();
                assert!(
                    (dxf_area(&dxf, &layer) - area).abs() <= slack,
                    "{what} in DXF"
                );
                let (found, texts) = gds_area(&gds, number, 0, options.grid);
                assert!((found - area).abs() <= slack, "{what} in GDSII");
                let marks = gds_area(&gds, number, 1, options.grid).0;
                assert_eq!(marks > 0.0, options.marks, "{what}");
                assert_eq!(
                    dxf_area(&dxf, &format!("{layer}-MARKS")) > 0.0,
                    options.marks
                );
                for missing in &plan.missing {
                    assert!(
                        texts.iter().any(|text| text.contains(missing.as_str())),
                        "{missing}"
                    );
                    assert!(dxf.contains(missing.as_str()), "{missing}");
                }
            }
            for mould in &plan.moulds {
                let mesh = mould.mesh(0.0);
                assert!(mesh.is_watertight(), "{name} {}", mould.name);
                let found = stl_volume(&file(&written, &format!("{}.stl", mould.name)));
                let factor = 1.0_f64 / (1.0 - shrink);
                close(mould.name, found, mesh.volume() * factor.powi(3), VOLUME);
            }
        }
    }
}

#[test]
fn a_plan_names_what_its_file_does_not_say() {
    for (name, words) in [
        ("in-plane-50um", ["leads", "recipe of the electrodes"]),
        ("three-axis-8x8", ["rows and columns", "pads"]),
        ("piezo-1.5mm", ["wiring", "film"]),
        ("liquid-metal-2x4", ["2.400 of its 91.920 mm", "needles"]),
    ] {
        let plan = Plan::of(&Sensor::shipped(name).unwrap()).unwrap();
        for word in words {
            assert!(
                plan.missing.iter().any(|what| what.contains(word)),
                "{name}: {word}"
            );
        }
    }
    for name in ["force-4x4", "eflesh-lattice"] {
        let error = Plan::of(&Sensor::shipped(name).unwrap()).unwrap_err();
        assert!(matches!(error, Refused::NoDrawing { .. }));
    }
    let bent = sensor(
        "three-axis-8x8",
        &[(
            "mount = \"flat\"",
            "mount = { cylinder = { radius = \"4 mm\" } }".into(),
        )],
    );
    assert!(
        Plan::of(&bent)
            .unwrap()
            .missing
            .iter()
            .any(|what| what.contains("cylinder"))
    );
}

#[test]
fn bumps_that_silicon_does_not_etch_have_no_mould_but_a_note() {
    let steep = sensor(
        "three-axis-unit",
        &[(
            "bump_height = \"300 um\"",
            "bump_height = \"250 um\"".into(),
        )],
    );
    let plan = Plan::of(&steep).unwrap();
    assert!(plan.moulds.is_empty());
    // The height that fits: (700 - 275.7)/2 um times the square root of 2.
    let note = plan
        .missing
        .iter()
        .find(|what| what.contains("mould of the bumps"));
    assert!(note.unwrap().contains("300.0254 um"), "{note:?}");
}

#[test]
fn a_grid_that_moves_an_edge_too_far_is_refused() {
    let odd = sensor(
        "in-plane-50um",
        &[("gap = \"50 um\"", "gap = \"50.13 um\"".into())],
    );
    let plan = Plan::of(&odd).unwrap();
    for (grid, accepted) in [
        (1e-9, true),
        (5e-9, true),
        (50e-9, true),
        (500e-9, false),
        (10e-6, false),
    ] {
        let options = Options {
            grid,
            ..Options::default()
        };
        let written = files(&plan, &options, "test");
        assert_eq!(written.is_ok(), accepted, "{grid}");
        if let Err(error) = written {
            // 0.1 % of the gap.
            let Refused::Grid {
                allowed,
                moved,
                mask,
                ..
            } = error
            else {
                panic!("{error}")
            };
            assert_eq!(mask, "electrodes");
            close("allowed", allowed, 50.13e-9, 1e-9);
            assert!(moved > allowed);
        }
    }
    let tiny = Options {
        grid: 1e-12,
        ..Options::default()
    };
    assert!(matches!(
        files(&plan, &tiny, "test"),
        Err(Refused::Reach { .. })
    ));
}

#[test]
fn layers_fill_the_device() {
    for (name, thickness) in [
        ("piezo-1.5mm", 1.5e-3 + 0.127e-3),
        ("liquid-metal-2x4", 420e-6),
    ] {
        let plan = Plan::of(&Sensor::shipped(name).unwrap()).unwrap();
        // Liquid reaches beyond the array: what of it lies in the array is the rest of its layer.
        let solid = |layer: &&taxel_fabricate::Layer| !layer.part.starts_with("channels");
        let inside: f64 = plan
            .layers
            .iter()
            .filter(solid)
            .map(|layer| layer.volume)
            .sum();
        let channels = plan
            .masks
            .iter()
            .filter(|mask| mask.name.ends_with("channels"));
        let liquid: f64 = channels.map(|mask| mask.area() * 20e-6).sum();
        close(name, inside + liquid, plan.field.area() * thickness, AREA);
    }
    let element = Plan::of(&Sensor::shipped("in-plane-50um").unwrap()).unwrap();
    let volume: f64 = element.layers.iter().map(|layer| layer.volume).sum();
    close("in-plane-50um", volume, 3.5e-3 * 10e-3 * 950e-6, AREA);
}

/// A length in whole nanometres, for a file.
fn nm(length: u32) -> String {
    format!("\"{length} nm\"")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn in_plane_capacitors(gap in 20_000_u32..200_000, width in 50_000_u32..1_400_000, thickness in 10_000_u32..150_000, depth in 1_000_000_u32..9_000_000) {
        let sensor = sensor("in-plane-50um", &[
            ("gap = \"50 um\"", format!("gap = {}", nm(gap))),
            ("width = \"1 mm\"", format!("width = {}", nm(width))),
            ("thickness = \"100 um\"", format!("thickness = {}", nm(thickness))),
            ("\ndepth = \"10 mm\"", format!("\ndepth = {}", nm(depth))),
            ("gap_deviation = \"1 um\"", "gap_deviation = \"0.1 um\"".into()),
            ("end_condition = \"short_layer\"", "end_condition = \"free\"".into()),
            ("stiffness = { modulus = { youngs_modulus = \"2.1 MPa\" } }", "stiffness = \"as_layer\"".into()),
            // What the narrowest gap of the thickest electrodes has, 1.9 pF, is within it.
            ("range = [\"0 V\", \"1 V\"]", "range = [\"0 V\", \"2 V\"]".into()),
        ]);
        let plan = Plan::of(&sensor).unwrap();
        let [width, thickness, depth] = [width, thickness, depth].map(|length| f64::from(length) * 1e-9);
        close("electrodes", mask(&plan, "electrodes").area(), 2.0 * width * depth, AREA);
        let body = 3.5e-3 * 10e-3;
        close("layer", mask(&plan, "layer").area(), body, AREA);
        // The tray: a block, less the cavity, with the ridges in it.
        let deep = 550e-6 + thickness;
        let block = (3.5e-3 + 6e-3) * (10e-3 + 6e-3) * (2e-3 + deep);
        let tray = block - body * deep + 2.0 * width * depth * thickness;
        let mesh = plan.moulds[0].mesh(0.0);
        prop_assert!(mesh.is_watertight());
        close("tray", mesh.volume(), tray, VOLUME);
        let written = files(&plan, &Options::default(), "test").unwrap();
        close("STL", stl_volume(&file(&written, "mould-tray.stl")), tray, VOLUME);
    }

    #[test]
    fn three_axis_arrays(rows in 1_usize..5, columns in 1_usize..5, wall in 20_000_u32..120_000, top in 100_000_u32..500_000, base in 520_000_u32..1_200_000) {
        let rise = 0.5 * f64::from(base - top) * 1e-9;
        let height = rise * std::f64::consts::SQRT_2;
        let sensor = sensor("three-axis-8x8", &[
            ("rows = 8", format!("rows = {rows}")),
            ("columns = 8", format!("columns = {columns}")),
            ("wall_width = \"100 um\"", format!("wall_width = {}", nm(wall))),
            ("bump_top = \"275.7 um\"", format!("bump_top = {}", nm(top))),
            ("bump_base = \"700 um\"", format!("bump_base = {}", nm(base))),
            ("bump_height = \"300 um\"", format!("bump_height = \"{:.6} um\"", height * 1e6)),
            ("insulation_permittivity = 2.7", "insulation_permittivity = 2.7\nparallel_capacitance = \"30 fF\"".into()),
        ]);
        let plan = Plan::of(&sensor).unwrap();
        let units = (rows * columns) as f64;
        let field = units * 4e-6;
        close("field", plan.field.area(), field, AREA);
        for name in ["lower-electrodes", "upper-electrodes"] {
            close(name, mask(&plan, name).area(), units * 4.0 * 400e-6 * 400e-6, AREA);
        }
        let cavity = 0.5 * (1300e-6 - f64::from(wall) * 1e-9);
        close("walls", mask(&plan, "walls").area(), field - 4.0 * units * cavity * cavity, AREA);
        let [base, top] = [base, top].map(|side| f64::from(side) * 1e-9);
        close("base", mask(&plan, "bump-base").area(), units * base * base, AREA);
        close("top", mask(&plan, "bump-top").area(), units * top * top, AREA);
        let frustum = height / 3.0 * (base * base + base * top + top * top);
        let wafer = field * (2e-3 + height) - units * frustum;
        let mesh = plan.moulds[0].mesh(0.0);
        prop_assert!(mesh.is_watertight());
        // The height is written to a picometre.
        close("wafer", mesh.volume(), wafer, VOLUME);
    }

    #[test]
    fn piezoelectric_arrays(rows in 1_usize..4, columns in 1_usize..4, side in 500_000_u32..3_900_000, share in 0.15_f64..0.9) {
        let sensor = sensor("piezo-1.5mm", &[
            ("rows = 2", format!("rows = {rows}")),
            ("columns = 4", format!("columns = {columns}")),
            ("side = \"2 mm\"", format!("side = {}", nm(side))),
            ("share_above = 0.5", format!("share_above = {share}")),
        ]);
        let plan = Plan::of(&sensor).unwrap();
        let plates = (rows * columns) as f64 * (f64::from(side) * 1e-9).powi(2);
        close("plates", mask(&plan, "plates").area(), plates, AREA);
        let [x, y] = [columns as f64 * 4e-3, rows as f64 * 4e-3];
        let ring = (x + 6e-3) * (y + 6e-3) - x * y;
        for (mould, height) in plan.moulds.iter().zip([(1.0 - share) * 1.5e-3, share * 1.5e-3 + 0.127e-3]) {
            let mesh = mould.mesh(0.0);
            prop_assert!(mesh.is_watertight());
            close(mould.name, mesh.volume(), ring * height, VOLUME);
        }
    }

    #[test]
    fn microchannels(rows in 1_usize..4, columns in 1_usize..6) {
        let sensor = sensor("liquid-metal-2x4", &[
            ("rows = 2", format!("rows = {rows}")),
            ("columns = 4", format!("columns = {columns}")),
        ]);
        let plan = Plan::of(&sensor).unwrap();
        let [x, y] = [columns as f64 * 600e-6, rows as f64 * 600e-6];
        let areas = [rows as f64 * 400e-6 * x, columns as f64 * 400e-6 * y];
        close("rows", mask(&plan, "row-channels").area(), areas[0], AREA);
        close("columns", mask(&plan, "column-channels").area(), areas[1], AREA);
        let plate = (x + 6e-3) * (y + 6e-3) * 2e-3;
        let ring = (x + 6e-3) * (y + 6e-3) - x * y;
        let volumes = [plate + areas[0] * 20e-6, plate + areas[1] * 20e-6, ring * 420e-6];
        for (mould, volume) in plan.moulds.iter().zip(volumes) {
            let mesh = mould.mesh(0.0);
            prop_assert!(mesh.is_watertight(), "{}", mould.name);
            close(mould.name, mesh.volume(), volume, VOLUME);
        }
    }
}
