//! The field at the edges of a tile of P2 against a table that another program computed.
#![allow(clippy::unwrap_used)]

use crate::common::{Row, UM, assert_near, p2_edges, p2_plates, table};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use taxel::transduction::{
    DrawnEdges, EDGE_ERROR, EdgeDrawing, EdgeEnvironment, EdgeLaw, INNER_DISTANCE, OUTER_DISTANCE,
    SolvedEdges, TileEdges, VACUUM_PERMITTIVITY,
};
use taxel_bodies::Afresh;
use taxel_bodies::transduction::EdgeSection;
use taxel_fem::field::cases::{Beside, FacingPlates};

fn section(row: &Row) -> EdgeSection {
    let distance = || row.si("neighbour_distance_um", UM);
    EdgeSection {
        air_gap: row.si("air_um", UM),
        insulation: row.si("insulation_um", UM),
        permittivity: row.at("eps_r"),
        electrode_thickness: row.si("copper_um", UM),
        half_width: row.si("half_width_um", UM),
        cavity: row.si("cavity_um", UM),
        environment: match row.text("environment") {
            "isolated" => EdgeEnvironment::Isolated,
            "grounded" => EdgeEnvironment::Grounded(distance()),
            _ => EdgeEnvironment::Row(distance()),
        },
        above: row.si("top_um", UM),
        grounded_plane: row.at("plane_below") == 1.0,
        ..EdgeSection::drawn(0.0, EdgeEnvironment::Isolated)
    }
}

#[test]
fn solved_edges() {
    let mut wrong: Vec<String> = Vec::new();
    for row in table("solved_p2_edges.csv") {
        let (section, excess) = (section(&row), row.at("excess"));
        let found = section.solve().unwrap();
        // The table's own error.
        if (found / excess - 1.0).abs() > 1e-3 {
            wrong.push(format!("{section:?}: {found} for {excess}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Plates and solved edges, before the corners.
#[test]
fn solved_capacitance_of_the_drawing() {
    let edge = |distance| {
        let section = EdgeSection::drawn(6e-6, EdgeEnvironment::Grounded(distance));
        section.solve().unwrap()
    };
    let excess = 2.0 * (edge(INNER_DISTANCE) + edge(OUTER_DISTANCE));
    let total = p2_plates().plate_capacitance(0) + VACUUM_PERMITTIVITY * 400e-6 * excess;
    assert!((total - 204.45e-15).abs() < 0.15e-15, "{total}");
}

/// Plates without thickness in one dielectric: the conformal map gives
/// (1 + ln(2 pi w/g))/(2 pi); 0.1 um of copper add less than 1 % to it.
#[test]
fn thin_plates_approach_the_conformal_map() {
    // Far boundaries: 12 mm beside and above, 4 mm below. Lengths in um.
    let thin = FacingPlates {
        air: 6.0,
        insulation: 6.0,
        permittivity: 1.0,
        plate: 0.1,
        half_width: 200.0,
        cavity: 100.0,
        beside: Beside::Nothing,
        above: 400.0,
        below: 4000.0,
        grounded_plane: false,
        margin: 12_000.0,
        air_above: 12_000.0,
    };
    let turn = 2.0 * std::f64::consts::PI;
    let exact = (1.0 + (turn * 400.0 / 12.0).ln()) / turn;
    let found = thin.edge_excess(2).unwrap();
    assert!((exact - 1.0097).abs() < 1e-4, "{exact}");
    assert!((found - 1.018).abs() < 0.01 * exact, "{found}");
    assert!((found / exact - 1.0).abs() < 0.02, "{found}");
}

/// The law against the rows with the lengths it was fitted to.
#[test]
fn law_of_the_air_gap() {
    let mut rows = 0;
    for row in table("solved_p2_edges.csv") {
        let section = section(&row);
        if section != EdgeSection::drawn(section.air_gap, section.environment) {
            continue;
        }
        let Some(law) = EdgeLaw::tabulated(section.environment) else {
            continue;
        };
        let air = section.air_gap;
        assert_near(law.excess(air), row.at("excess"), 0.0, 1e-3, "excess");
        let (above, below) = (law.excess(air + 1e-10), law.excess(air - 1e-10));
        let slope = (above - below) / 2e-10;
        assert!((law.slope(air) / slope - 1.0).abs() < 1e-5);
        rows += 1;
    }
    assert_eq!(rows, 45);
}

/// What the corners add, by the field of one isolated capacitor in space, on three meshes: the rows of
/// `tables/p2_corners.csv`.
#[test]
#[ignore = "half a minute: three fields in space"]
fn corners_in_space() {
    let alone = EdgeSection::drawn(6e-6, EdgeEnvironment::Isolated);
    let rows = include_str!("../../../taxel/tables/p2_corners.csv");
    let rows = rows.lines().filter(|line| !line.starts_with('#')).skip(1);
    for (row, fine) in rows.zip([1.0, 1.15, 1.3]) {
        let row: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let ([space, edges], unknowns) = alone.square_alone(fine).unwrap();
        let [space, edges] = [space, edges].map(|farad| farad * 1e15);
        println!("{unknowns},{space:.2},{edges:.2}");
        for (found, kept) in [unknowns as f64, space, edges].into_iter().zip(row) {
            assert!((found - kept).abs() <= 5.1e-3, "{found} for {kept}");
        }
        // Another program.
        assert!((space - 213.26).abs() < 0.3, "{space}");
        assert!((space - edges + 0.43).abs() < 0.01, "{}", space - edges);
    }
}

/// Drawings between the rows of the table against their own field.
#[test]
fn drawings_between_the_rows() {
    for (air, insulation, permittivity, copper, inner) in [
        (5.0, 5.0, 2.7, 15.0, 300.0),
        (7.0, 8.0, 2.5, 20.0, 350.0),
        (4.0, 4.0, 2.9, 8.0, 450.0),
    ] {
        let drawing = EdgeDrawing {
            air_gap: [air * UM; 2],
            insulation: insulation * UM,
            permittivity,
            electrode_thickness: copper * UM,
            inner: [inner * UM; 2],
            ..p2_edges()
        };
        let section = EdgeSection {
            insulation: drawing.insulation,
            permittivity,
            electrode_thickness: drawing.electrode_thickness,
            ..EdgeSection::drawn(air * UM, EdgeEnvironment::Grounded(inner * UM))
        };
        let law = drawing.tabulated().unwrap().grounded.inner[0];
        let (found, solved) = (law.excess(air * UM), section.solve().unwrap());
        assert!(
            (found / solved - 1.0).abs() < EDGE_ERROR,
            "{drawing:?}: {found} {solved}"
        );
    }
}

/// The section of an inner (0) or an outer edge (1) of a drawing that an axis crosses.
fn section_of(drawing: &EdgeDrawing, axis: usize, side: usize, air_gap: f64) -> EdgeSection {
    let distance = [Some(drawing.inner[axis]), drawing.outer[axis]][side];
    let width = drawing.electrode[axis];
    EdgeSection {
        air_gap,
        insulation: drawing.insulation,
        permittivity: drawing.permittivity,
        electrode_thickness: drawing.electrode_thickness,
        half_width: 0.5 * width,
        cavity: drawing.cavity[axis][side],
        environment: distance.map_or(EdgeEnvironment::Isolated, EdgeEnvironment::Grounded),
        above: drawing.above,
        below: drawing.below,
        neighbour_width: width,
        grounded_plane: false,
        margin: 18.0 * width,
        air_above: 8.0 * width,
    }
}

/// A drawing all of whose lengths are those of P2 times random factors of at most `most`, in a
/// random size; the shares of its widest gap that are looked at are in `air`.
fn random_drawing(random: &mut ChaCha8Rng, most: f64) -> EdgeDrawing {
    let mut factor = |most: f64| f64::powf(most, 2.0 * random.random::<f64>() - 1.0);
    let drawn = p2_edges();
    loop {
        let scale = factor(3.0);
        let mut varied = |length: f64| length * scale * factor(most);
        let air = varied(6e-6);
        let found = EdgeDrawing {
            electrode: [400e-6 * scale; 2],
            air_gap: [air; 2],
            insulation: varied(drawn.insulation),
            electrode_thickness: varied(drawn.electrode_thickness),
            cavity: [[varied(100e-6), varied(100e-6)]; 2],
            above: varied(drawn.above),
            below: varied(drawn.below),
            inner: [varied(INNER_DISTANCE); 2],
            outer: [Some(varied(OUTER_DISTANCE)); 2],
            permittivity: 1.0 + 1.7 * factor(most.min(2.0)),
        };
        if found.is_section() {
            return found;
        }
    }
}

/// Largest part of the stated errors that `count` random drawings use at random air gaps, beside
/// their own fields on a finer mesh that ends farther away.
fn compare(
    seed: u64,
    count: usize,
    most: f64,
    edges: impl Fn(&EdgeDrawing) -> Option<DrawnEdges>,
) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut used, mut seen) = (0.0_f64, 0);
    while seen < count {
        let drawing = random_drawing(&mut random, most);
        let Some(edges) = edges(&drawing) else {
            continue;
        };
        seen += 1;
        let air = drawing.air_gap[0] * (0.4 + 0.9 * random.random::<f64>());
        let grounded = &edges.grounded;
        let square = drawing.electrode[0] == drawing.electrode[1];
        for (axis, side) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            if square && axis == 1 {
                continue;
            }
            let law = [grounded.inner, grounded.outer][side][axis];
            let section = section_of(&drawing, axis, side, air);
            let off = law.excess(air) / section.solve_at(3).unwrap() - 1.0;
            let share = off.abs() / edges.error;
            if share > used {
                used = share;
                println!("{seen}: {off:+.2e} of {:.2e}, {drawing:?}", edges.error);
            }
        }
    }
    used
}

/// Random drawings that the table has, all lengths at once.
#[test]
#[ignore = "minutes: cargo test --release -p taxel-bodies --test all p2_edges -- --ignored --nocapture of_the_table"]
fn a_hundred_random_drawings_of_the_table_are_within_its_error() {
    let used = compare(16, 100, 1.5, |drawing| drawing.tabulated().ok());
    println!("{used:.2} of the stated error used");
    assert!(used <= 1.0, "{used}");
}

fn solved(drawing: &EdgeDrawing) -> Option<DrawnEdges> {
    let beside = drawing.tabulated().is_err();
    beside.then(|| {
        SolvedEdges::of_unit(drawing, &mut Afresh)
            .unwrap()
            .edges(drawing)
    })
}

/// The same of drawings that no table has.
#[test]
fn edges_of_random_drawings_are_within_their_stated_errors() {
    let used = compare(17, 2, 2.0, solved);
    assert!(used <= 1.0, "{used}");
}

/// A rectangle has the edges of two sections: those that x crosses are of a square with its side along
/// x, and its plate and edges along y are of that one's length.
#[test]
fn edges_of_rectangles_are_those_of_both_sections() {
    let of_electrode = |electrode: [f64; 2]| {
        let drawing = EdgeDrawing {
            electrode,
            inner: electrode.map(|side| 700e-6 - side),
            outer: electrode.map(|side| Some(1600e-6 - side)),
            cavity: electrode.map(|side| [0.5 * (600e-6 - side), 100e-6]),
            air_gap: [11e-6; 2],
            ..p2_edges()
        };
        solved(&drawing).unwrap().grounded
    };
    let rectangle = of_electrode([400e-6, 250e-6]);
    let squares = [400e-6, 250e-6].map(|side| of_electrode([side; 2]));
    for (axis, square) in squares.iter().enumerate() {
        assert_eq!(rectangle.inner[axis], square.inner[axis]);
        assert_eq!(rectangle.outer[axis], square.outer[axis]);
    }
    assert_ne!(rectangle.inner[0], rectangle.inner[1]);
    let along = |edges: TileEdges, sides: [f64; 2]| {
        edges.at(sides, 11e-6, [0.0; 2]).capacitance - edges.corners
    };
    let turned = TileEdges {
        inner: [rectangle.inner[1], rectangle.inner[0]],
        outer: [rectangle.outer[1], rectangle.outer[0]],
        ..rectangle
    };
    let [one, other] = [
        along(rectangle, [400e-6, 250e-6]),
        along(turned, [250e-6, 400e-6]),
    ];
    assert!((one / other - 1.0).abs() < 1e-12, "{one} {other}");
}

#[test]
#[ignore = "minutes: cargo test --release -p taxel-bodies --test all p2_edges -- --ignored --nocapture hundred_solved"]
fn edges_of_a_hundred_solved_drawings_are_within_their_stated_errors() {
    let used = compare(18, 100, 3.0, solved);
    println!("{used:.2} of the stated errors used");
    assert!(used <= 1.0, "{used}");
}

/// What the corners of other drawings add, by the field of a capacitor alone in space, is some times what
/// is taken: in space a field falls faster than in the plane, which neighbours would hide.
#[test]
#[ignore = "a minute: cargo test --release -p taxel-bodies --test all p2_edges -- --ignored --nocapture corners_of_other"]
fn corners_of_other_drawings_in_space() {
    let mut random = ChaCha8Rng::seed_from_u64(19);
    let mut drawings = std::iter::repeat_with(|| random_drawing(&mut random, 1.5));
    let drawn = drawings
        .by_ref()
        .filter_map(|drawing| Some((drawing, drawing.tabulated().ok()?)));
    for (drawing, edges) in drawn.take(8) {
        for reach in [2.25, 9.0] {
            let alone = EdgeSection {
                environment: EdgeEnvironment::Isolated,
                margin: reach * drawing.electrode[0],
                air_above: reach / 2.25 * drawing.electrode[0],
                ..section_of(&drawing, 0, 1, drawing.air_gap[0])
            };
            let ([space, by_edges], _) = alone.square_alone(1.0).unwrap();
            let (found, taken) = (space - by_edges, edges.grounded.corners);
            println!(
                "field of {reach} sides: {:.2} fF of {:.1} in space, {:.2} fF taken",
                1e15 * found,
                1e15 * space,
                1e15 * taken
            );
            assert!((0.3..4.0).contains(&(found / taken)), "{drawing:?}");
        }
    }
}
