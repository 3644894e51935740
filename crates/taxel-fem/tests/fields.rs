//! Fields against exact theory and independent programs.
//!
//! The reference tables are solutions of other programs; their headers say how they
//! were made and how exact they are.

use taxel_fem::field::cases::{
    Bars, COAXIAL_DISCS, COPLANAR_STRIPS, FieldCase, OPPOSED_STRIPS, Surroundings, bars,
    bars_above_base, coaxial_discs, coplanar_strips, corner_square, cube, disc,
    ideal_dielectric_field, opposed_strips, sphere,
};

/// Accuracy asked of a field solver here.
const ASKED: f64 = 1e-4;

/// Energies lie above the exact ones (Dirichlet's principle), but for the shape of the
/// circle and the last digit of the reference, both below this.
const BELOW: f64 = -2e-7;

fn check(case: &FieldCase, allowed: f64) {
    let error = case.error();
    assert!(
        BELOW < error && error < allowed,
        "{}: {} instead of {}, {error:.1e} with {} cells",
        case.name,
        case.ours,
        case.reference,
        case.cells
    );
}

#[test]
fn coplanar_strips_follow_the_conformal_map() {
    for (ratio, reference) in COPLANAR_STRIPS {
        check(&coplanar_strips(ratio, reference, 3).unwrap(), ASKED);
    }
}

#[test]
fn opposed_strips_follow_their_integral_equation() {
    for (ratio, reference) in OPPOSED_STRIPS {
        check(&opposed_strips(ratio, reference, 3).unwrap(), ASKED);
    }
}

#[test]
fn coaxial_discs_follow_love_1949() {
    for (ratio, reference) in COAXIAL_DISCS {
        check(&coaxial_discs(ratio, reference, 3).unwrap(), ASKED);
    }
}

#[test]
fn isolated_bodies_have_their_capacitance() {
    check(&disc(3).unwrap(), ASKED);
    check(&sphere(3).unwrap(), ASKED);
    // In space the mesh is coarse: four times the size of a cell at level 2 gives the
    // error of level 1, and between them it must fall at least as that of linear cells.
    let [coarse, fine] = [1, 2].map(|level| cube(level).unwrap());
    check(&coarse, 5e-3);
    check(&fine, coarse.error() / 4.0);
}

#[test]
fn errors_fall_with_the_level() {
    // Two more levels halve the cells at least and take the edges 16 times finer, whose
    // energy is in proportion to their size.
    let errors = [1, 2, 3].map(|level| coplanar_strips(1.0, 1.56340192, level).unwrap().error());
    assert!(
        errors[1] < errors[0] / 4.0 && errors[2] < errors[1] / 3.0,
        "{errors:?}"
    );
}

#[test]
fn the_corner_of_a_bend_counts_as_its_conformal_map_says() {
    let case = corner_square(3).unwrap();
    // The power at 1 V is too large, so the resistance is too small.
    assert!(case.error() < 1e-9 && case.error() > -ASKED, "{case:?}");
}

#[test]
fn the_pull_in_of_an_ideal_dielectric_is_at_the_sixth_root_of_four() {
    let at = 4.0_f64.powf(1.0 / 6.0);
    // Digits of the reference.
    assert!((ideal_dielectric_field(at) - 0.68736).abs() < 5e-6);
    for away in [at - 1e-3, at + 1e-3] {
        assert!(ideal_dielectric_field(away) < ideal_dielectric_field(at));
    }
}

/// Rows of a table without its comments and its head.
fn rows(table: &str) -> impl Iterator<Item = Vec<&str>> {
    let lines = table.lines().filter(|line| !line.starts_with('#'));
    lines.skip(1).map(|line| line.split(',').collect())
}

fn number(text: &str) -> f64 {
    text.parse().expect("the tables hold numbers")
}

#[test]
fn bars_side_by_side_agree_with_boundary_elements() {
    let table = include_str!("reference/p1_cap_undeformed.csv");
    for row in rows(table) {
        let [thickness, gap, width, reference] = [0, 1, 2, 3].map(|k| number(row[k]));
        let case = bars(thickness, gap, width, reference, 3).unwrap();
        // The table is exact to 2e-5, for narrow bars to 1e-4.
        let exact = if width <= 50.0 { 1e-4 } else { 2e-5 };
        assert!(case.error().abs() < ASKED + exact, "{case:?}");
    }
}

/// Media above and below the layer for a name of the table.
fn surroundings(name: &str) -> Surroundings {
    let (above, below) = match name {
        "uniform" => (2.4, Some(2.4)),
        "air_above" => (1.0, Some(2.4)),
        "air_above_glass_below" => (1.0, Some(5.5)),
        "air_above_below" => (1.0, Some(1.0)),
        "grounded_base" => (1.0, None),
        "grounded_base_uniform" => (2.4, None),
        other => panic!("unknown surroundings {other}"),
    };
    Surroundings {
        layer: 2.4,
        // The table has the layer 3500 wide, air beside it, and the base unbounded.
        layer_end: Some(1750.0),
        above,
        below,
    }
}

#[test]
fn bars_in_a_layer_agree_with_an_independent_solution() {
    let table = include_str!("reference/p1_cap_surroundings.csv");
    let rows: Vec<_> = rows(table).filter(|row| row[2] == "0").collect();
    let mut compared = 0;
    for row in rows.iter().filter(|row| !row[3].ends_with("_mutual")) {
        let shape = Bars {
            gap: number(row[0]),
            width: number(row[1]),
            thickness: 100.0,
            height: 550.0,
            layer: 950.0,
        };
        let (differential, mutual, _) = bars_above_base(shape, surroundings(row[3]), 2).unwrap();
        for (name, ours) in [
            (row[3].to_owned(), differential),
            (format!("{}_mutual", row[3]), mutual),
        ] {
            let same = |other: &&Vec<&str>| other[0] == row[0] && other[3] == name;
            if let Some(reference) = rows.iter().find(same) {
                let error = ours / number(reference[4]) - 1.0;
                // The table is exact to about 1e-3; a layer without ends would be off by
                // 1.2e-3 to 7e-3 wherever there is air.
                assert!(error.abs() < 1e-3, "{reference:?}: {ours}, {error:.1e}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 24);
}
