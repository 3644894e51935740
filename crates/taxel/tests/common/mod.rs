//! Reading the reference tables.
#![allow(dead_code, clippy::unwrap_used, missing_docs, unreachable_pub)]

use std::collections::HashMap;
use std::path::Path;

use taxel::mechanics::{CellGeometry, MicrochannelSection, PaperLaw};
use taxel::transduction::{EdgeDrawing, INNER_DISTANCE, OUTER_DISTANCE, Plates};

/// A table as rows of column name to text.
pub fn table(name: &str) -> Vec<Row> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference")
        .join(name);
    // The tables of `taxel` are those of `taxel-bodies` too.
    let path = if own.exists() {
        own
    } else {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../taxel/tests/reference")
            .join(name)
    };
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(path)
        .unwrap();
    let rows: Vec<Row> = reader.deserialize().map(|row| Row(row.unwrap())).collect();
    assert!(!rows.is_empty(), "{name} has no rows");
    rows
}

pub struct Row(HashMap<String, String>);

impl Row {
    pub fn text(&self, column: &str) -> &str {
        self.0
            .get(column)
            .unwrap_or_else(|| panic!("no column {column}"))
    }

    /// The number in `column`.
    pub fn at(&self, column: &str) -> f64 {
        self.text(column).parse().unwrap()
    }

    /// The number in `column`, whose unit is worth `unit` in SI.
    pub fn si(&self, column: &str, unit: f64) -> f64 {
        // 1/unit is a whole power of ten: dividing by it rounds once.
        self.at(column) / (1.0 / unit).round()
    }
}

pub const UM: f64 = 1e-6;
pub const NM: f64 = 1e-9;
pub const MN: f64 = 1e-3;
pub const FF: f64 = 1e-15;
pub const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];

/// Asserts |value − expected| ≤ relative·|expected| + absolute.
#[track_caller]
pub fn assert_near(value: f64, expected: f64, relative: f64, absolute: f64, what: &str) {
    let allowed = relative * expected.abs() + absolute;
    assert!(
        (value - expected).abs() <= allowed,
        "{what}: {value:e}, expected {expected:e}, off by {:e}, allowed {allowed:e}",
        value - expected
    );
}

/// Named parameters of one set of a table.
pub type Parameters = HashMap<String, f64>;

/// A table whose head of comment lines names sets, `# b10: m_p=4e-6 k_p=2e9`:
/// the parameters of each set and the rows.
pub fn commented_table(name: &str) -> (HashMap<String, Parameters>, Vec<Row>) {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference")
        .join(name);
    // The tables of `taxel` are those of `taxel-bodies` too.
    let path = if own.exists() {
        own
    } else {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../taxel/tests/reference")
            .join(name)
    };
    let text = std::fs::read_to_string(path).unwrap();
    let sets = text
        .lines()
        .filter_map(|line| line.strip_prefix("# ")?.split_once(": "))
        .map(|(set, pairs)| (set.to_owned(), parameters(pairs)))
        .filter(|(_, parameters)| !parameters.is_empty())
        .collect();
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let rows: Vec<Row> = reader.deserialize().map(|row| Row(row.unwrap())).collect();
    assert!(!rows.is_empty(), "{name} has no rows");
    (sets, rows)
}

fn parameters(pairs: &str) -> Parameters {
    pairs
        .split_whitespace()
        .filter_map(|pair| pair.split_once('='))
        .filter_map(|(name, value)| Some((name.to_owned(), value.parse().ok()?)))
        .collect()
}

/// A cell of the P4 tables: channel 400 um wide, pitch 600 um, 500 um thick.
pub fn p4_cell(height: f64, roof: f64) -> CellGeometry {
    CellGeometry {
        section: MicrochannelSection::rectangle(400e-6, height * UM),
        roof: roof * UM,
        thickness: 500e-6,
        pitch: 600e-6,
    }
}

/// P4 Eq. 2 with its printed constants.
pub fn p4_law() -> PaperLaw {
    PaperLaw {
        expansion: 0.2,
        atmosphere: 101.325e3,
    }
}

/// The lengths of a row of `solved_p2_unit.csv`.
pub(crate) fn drawing(row: &Row) -> taxel::mechanics::UnitDrawing {
    let um = |column: &str| row.si(column, UM);
    taxel::mechanics::UnitDrawing {
        electrode: 400e-6,
        electrode_thickness: 20e-6,
        centre_distance: 700e-6,
        unit_side: 2.0 * um("cavity_outer_um"),
        wall_width: 2.0 * um("wall_half_um"),
        lower_layer: um("lower_um"),
        upper_layer: um("upper_um") + um("base_um"),
        bump_height: um("bump_height_um"),
        bump_base: 700e-6,
        bump_top: 2.0 * um("bump_top_half_um"),
        air_gap: um("air_um"),
        insulation: um("insulation_um"),
        pitch: 2e-3,
    }
}

/// The lengths of P2, in an array.
pub fn p2_edges() -> EdgeDrawing {
    EdgeDrawing {
        electrode: [400e-6; 2],
        air_gap: [6e-6; 2],
        insulation: 6e-6,
        permittivity: 2.7,
        electrode_thickness: 20e-6,
        cavity: [[100e-6; 2]; 2],
        below: 280e-6,
        above: 400e-6,
        inner: [INNER_DISTANCE; 2],
        outer: [Some(OUTER_DISTANCE); 2],
    }
}

/// The capacitors of P2.
pub fn p2_plates() -> Plates {
    Plates {
        electrode: [400e-6; 2],
        air_gap: [6e-6; 4],
        insulation_gap: 6e-6 / 2.7,
        parallel_capacitance: [0.0; 4],
        edges: Some(p2_edges().tabulated().unwrap().grounded),
    }
}
