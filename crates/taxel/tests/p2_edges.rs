//! The edges of a tile of P2 against a table that another program computed.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Row, UM, assert_near, table};
use taxel::transduction::{
    EdgeEnvironment, EdgeLaw, EdgeSection, GROUNDED, INNER_DISTANCE, OUTER_DISTANCE, TileWithEdges,
};
use taxel_fem::field::cases::{Beside, FacingPlates};

const DRAWN: TileWithEdges = TileWithEdges {
    side: 400e-6,
    insulation_gap: 6e-6 / 2.7,
};

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
    let total = DRAWN.plate(6e-6) + 8.8541878188e-12 * DRAWN.side * excess;
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
        let law = match section.environment {
            EdgeEnvironment::Isolated => EdgeLaw::ISOLATED,
            EdgeEnvironment::Grounded(d) if (d - 300e-6).abs() < 1e-9 => EdgeLaw::GROUNDED_300,
            EdgeEnvironment::Grounded(d) if (d - 900e-6).abs() < 1e-9 => EdgeLaw::GROUNDED_900,
            EdgeEnvironment::Row(d) if (d - 300e-6).abs() < 1e-9 => EdgeLaw::ROW_300,
            EdgeEnvironment::Row(_) => EdgeLaw::ROW_900,
            EdgeEnvironment::Grounded(_) => continue,
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

/// P2 as drawn: plates, edges, total, interval of the surroundings and slope.
#[test]
fn capacitance_of_the_drawing() {
    let air = 6e-6;
    let total = DRAWN.plate(air) + DRAWN.edges(air, GROUNDED);
    assert!((total - 204.45e-15).abs() < 0.15e-15);
    assert!((204.0e-15..204.5e-15).contains(&DRAWN.total(air)));
    let [least, greatest] = DRAWN.surroundings(air).unwrap();
    assert!((least - 199.6e-15).abs() < 0.05e-15, "{least}");
    assert!((greatest - 213.65e-15).abs() < 0.05e-15, "{greatest}");
    assert!((DRAWN.slope(air) + 22.3e-9).abs() < 0.2e-9);
    let step = 1e-10;
    let slope = (DRAWN.total(air + step) - DRAWN.total(air - step)) / (2.0 * step);
    assert!((DRAWN.slope(air) / slope - 1.0).abs() < 1e-6);
}

/// What an effective gap reads of a closing.
#[test]
fn effective_gap_factors() {
    let [raw, normalised] = DRAWN.effective_gap_factors(6e-6);
    assert!((raw - 0.755).abs() < 0.005, "{raw}");
    assert!((normalised - 0.896).abs() < 0.005, "{normalised}");
}
