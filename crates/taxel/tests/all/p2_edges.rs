//! The edges of a tile of P2: their law, and what the capacitors are with them.
#![allow(clippy::unwrap_used)]

use crate::common::{UM, assert_near, p2_edges, p2_plates};
use taxel::mechanics::{SIDE_X, SIDE_Y, ThreeAxisDeformation};
use taxel::sensor::Sensor;
use taxel::transduction::{
    EdgeDrawing, EdgeEnvironment, EdgeLaw, INNER_DISTANCE, OUTER_DISTANCE, Plates,
    VACUUM_PERMITTIVITY, corner_capacitance,
};

/// The published coefficients of the law in um, from the same rows by another fit.
#[test]
fn coefficients_of_the_law() {
    let grounded = EdgeEnvironment::Grounded;
    for (environment, constant, factor, shift) in [
        (EdgeEnvironment::Isolated, 4.2501, 0.6562, 1.6),
        (grounded(INNER_DISTANCE), 3.4360, 0.6746, 1.7),
        (grounded(OUTER_DISTANCE), 3.8510, 0.6713, 1.7),
        (EdgeEnvironment::Row(INNER_DISTANCE), 4.0762, 0.7045, 1.8),
    ] {
        let law = EdgeLaw::tabulated(environment).unwrap();
        assert_near(law.constant, constant, 0.0, 1e-4, "constant");
        assert_near(law.factor, factor, 0.0, 1e-4, "factor");
        assert_near(law.shift, shift, 0.0, 1e-9, "shift");
    }
    assert_eq!(EdgeLaw::tabulated(grounded(0.5e-3)), None);
}

/// Edges that meet at a right angle count the field at the corner twice; the overlap of two
/// strips as wide as the gap is the size of what is to be taken away.
#[test]
fn corners_are_of_the_size_of_a_plane_corner() {
    let gap = 6e-6 + 6e-6 / 2.7;
    let overlap = VACUUM_PERMITTIVITY * 4.0 * gap;
    let ratio = -corner_capacitance() / overlap;
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
    assert!(
        (corner_capacitance() + 0.43e-15).abs() < 1e-20,
        "{}",
        corner_capacitance()
    );
}

/// P2 as drawn: plates, edges, total, interval of the surroundings and slope.
#[test]
fn capacitance_of_the_drawing() {
    let plates = p2_plates();
    let (plate, edges) = (
        plates.plate_capacitance(0),
        plates.edge_capacitance(0).unwrap(),
    );
    assert!((plate - 172.30e-15).abs() < 0.01e-15);
    assert!((edges - 32.2e-15).abs() < 0.1e-15, "{edges}");
    assert!((plate + edges - 204.45e-15).abs() < 0.15e-15);
    assert!((204.0e-15..204.5e-15).contains(&plates.rest_capacitance(0)));
    let ends = p2_edges().tabulated().unwrap().surroundings;
    let [least, greatest] = ends.map(|edges| plate + edges.parallel([400e-6; 2], 6e-6));
    assert!((least - 199.6e-15).abs() < 0.05e-15, "{least}");
    assert!((greatest - 213.65e-15).abs() < 0.05e-15, "{greatest}");
    assert!((plates.slope_by_air_gap(0) + 22.3e-9).abs() < 0.2e-9);
    let step = 1e-10;
    let by_difference =
        (plates.parallel_reading(0, -step) - plates.parallel_reading(0, step)) / (2.0 * step);
    assert!((plates.slope_by_air_gap(0) / by_difference - 1.0).abs() < 1e-6);
}

/// Of the slope, the edges have 1.24 fF/um.
#[test]
fn slope_of_the_edges() {
    let without = Plates {
        edges: None,
        ..p2_plates()
    };
    let edges = p2_plates().slope_by_air_gap(0) - without.slope_by_air_gap(0);
    assert!((edges + 1.24e-9).abs() < 0.01e-9, "{edges}");
}

/// What an effective gap reads of a closing.
#[test]
fn effective_gap_factors() {
    let [raw, normalised] = p2_plates().effective_gap_factors(0);
    assert!((raw - 0.755).abs() < 0.005, "{raw}");
    assert!((normalised - 0.896).abs() < 0.005, "{normalised}");
    // Plates alone read what they are.
    let without = Plates {
        edges: None,
        ..p2_plates()
    };
    for factor in without.effective_gap_factors(0) {
        assert!((factor - 1.0).abs() < 1e-12, "{factor}");
    }
}

/// The gap that a reading implies is the one that made it.
#[test]
fn a_reading_gives_its_gap_back() {
    let plates = p2_plates();
    for micrometres in [0.3, 2.0, 5.0, 6.0, 7.5, 12.0, 40.0] {
        let air = micrometres * UM;
        let reading = plates.parallel_reading(0, plates.air_gap[0] - air);
        let found = plates.air_gap_from(0, reading);
        // Rounding of the capacitance over its slope, the least at the widest gap.
        assert!((found / air - 1.0).abs() < 1e-11, "{micrometres}: {found}");
    }
}

/// Slopes of the capacitance of tilted tiles against differences.
#[test]
fn slopes_with_edges_are_derivatives() {
    let plates = p2_plates();
    let at = |d: [f64; 3]| ThreeAxisDeformation {
        displacement: d,
        closing: std::array::from_fn(|i| d[2] + 0.5 * (SIDE_X[i] * d[0] + SIDE_Y[i] * d[1])),
        slope: [d[0] / 700e-6, d[1] / 700e-6],
        bulge: [0.0; 4],
    };
    let point = [0.7e-6, -0.4e-6, 1.1e-6];
    let slopes = plates.respond_with_slopes(&at(point)).unwrap();
    let step = 1e-10;
    for axis in 0..2 {
        let (mut up, mut down) = (point, point);
        up[axis] += step;
        down[axis] -= step;
        let [up, down] = [up, down].map(|d| plates.respond(&at(d)).capacitance());
        let side = [SIDE_X, SIDE_Y][axis];
        for i in 0..4 {
            let by_chain = 0.5 * side[i] * slopes.by_closing[i] + slopes.by_slope[axis][i] / 700e-6;
            let by_difference = (up[i] - down[i]) / (2.0 * step);
            // Central differences: error about the square of a step of 1e-4 of the gap.
            assert!((by_chain / by_difference - 1.0).abs() < 1e-6, "{axis} {i}");
        }
    }
}

/// Twice the size has twice the capacitance: excesses depend on ratios alone.
#[test]
fn the_law_scales_with_the_drawing() {
    let (small, mut large) = (p2_edges(), p2_edges());
    for length in [
        &mut large.insulation,
        &mut large.electrode_thickness,
        &mut large.above,
        &mut large.below,
    ] {
        *length *= 2.0;
    }
    large.air_gap = large.air_gap.map(|gap| 2.0 * gap);
    large.electrode = large.electrode.map(|side| 2.0 * side);
    large.cavity = large.cavity.map(|cavity| cavity.map(|air| 2.0 * air));
    large.inner = large.inner.map(|distance| 2.0 * distance);
    large.outer = large.outer.map(|distance| distance.map(|d| 2.0 * d));
    let of = |drawing: EdgeDrawing, scale: f64| {
        let edges = drawing.tabulated().unwrap().grounded;
        edges.at([scale * 400e-6; 2], scale * 5e-6, [scale * 1e-7, 0.0])
    };
    let (small, large) = (of(small, 1.0), of(large, 2.0));
    assert!((large.capacitance / small.capacitance - 2.0).abs() < 1e-12);
    assert!((large.by_air_gap / small.by_air_gap - 1.0).abs() < 1e-12);
}

/// Plates farther apart than they are wide are refused at their gap, before anything is solved.
#[test]
fn a_gap_wider_than_its_electrodes_is_refused() {
    let shipped = Sensor::shipped_text("three-axis-8x8").unwrap();
    let wide = shipped.replace("air_gap = \"6 um\"", "air_gap = \"401 um\"");
    let error = Sensor::parse("wide.toml", &wide).unwrap_err();
    assert!(error.key.ends_with("plates.air_gap"), "{error:?}");
    assert!(error.help.contains("at most 400 um"), "{error:?}");
}

/// A length beyond the table is named with its range.
#[test]
fn lengths_beyond_the_table_are_named() {
    let thick = EdgeDrawing {
        insulation: 20.0 * UM,
        ..p2_edges()
    };
    let outside = thick.tabulated().unwrap_err();
    assert_eq!(outside.key, "plates.insulation");
    let words = outside.to_string();
    assert!(
        words.contains("from 3.0000 um to 9.0000 um, not for 20.0000 um"),
        "{words}"
    );
}
