//! Closing curves of periodic plane-strain cells, computed with finite elements
//! (`tables/p4_cells.csv`, `docs/theory/microchannel.md`, section 4).

use std::sync::LazyLock;

use crate::solved_table::{SolvedRow, SolvedTable};

/// Width of the tabulated channels, um.
pub(super) const WIDTH: f64 = 400.0;
/// Pitch of the tabulated cells, um.
pub(super) const PITCH: f64 = 600.0;
/// Total thickness of the tabulated cells, um.
pub(super) const THICKNESS: f64 = 500.0;
/// Shear modulus of the tabulated cells, kPa.
pub(super) const SHEAR_MODULUS: f64 = 162.4;

/// One computed cell.
#[derive(Debug)]
pub(super) struct TabulatedCell {
    /// Height of the channel, um.
    pub(super) height: f64,
    /// Solid above the channel, um.
    pub(super) roof: f64,
    /// Loss of area ratio per net pressure at rest, 1/kPa.
    pub(super) compliance: f64,
    /// Area ratio at the first touch of roof and floor, where it was reached.
    pub(super) touch: Option<f64>,
    /// Greatest error of the net pressure, as a share.
    pub(super) error: f64,
    /// Area ratio and net pressure in kPa, from rest to the last row; beyond
    /// the touch with contact of roof and floor.
    pub(super) rows: Vec<(f64, f64)>,
}

/// The computed cells.
pub(super) static CELLS: LazyLock<Vec<TabulatedCell>> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p4_cells.csv"));
    let mut cells: Vec<TabulatedCell> = Vec::new();
    for row in table.rows() {
        let [height, roof] = ["height_um", "roof_um"].map(|column| row.number(column));
        let known = |cell: &TabulatedCell| cell.height == height && cell.roof == roof;
        if !cells.last().is_some_and(known) {
            cells.push(TabulatedCell::new(height, roof));
        }
        if let Some(cell) = cells.last_mut() {
            cell.take(&row);
        }
    }
    cells
});

impl TabulatedCell {
    fn new(height: f64, roof: f64) -> Self {
        Self {
            height,
            roof,
            compliance: f64::NAN,
            touch: None,
            error: f64::NAN,
            rows: Vec::new(),
        }
    }

    fn take(&mut self, row: &SolvedRow<'_>) {
        let [ratio, value] = ["area_ratio", "value"].map(|column| row.number(column));
        match row.text("quantity") {
            "error" => self.error = value,
            "compliance" => self.compliance = value,
            "touch" => self.touch = Some(ratio),
            _ => self.rows.push((ratio, value)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_read() {
        assert_eq!(CELLS.len(), 12);
        for cell in CELLS.iter() {
            let number = |value: f64| value.is_finite() && value > 0.0;
            assert!(number(cell.compliance) && number(cell.error), "{cell:?}");
            assert!(cell.rows.len() >= 14, "{cell:?}");
            assert!(cell.rows.iter().all(|row| number(row.0) && number(row.1)));
        }
    }
}
