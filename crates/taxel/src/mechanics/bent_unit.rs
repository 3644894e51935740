//! The gap of a P2 unit that is bent to a radius, read from a solved section
//! (`tables/solved_p2_bending.csv`).

use std::sync::LazyLock;

use super::elastic_unit::UnitDrawing;
use crate::solved_table::{SolvedRow, SolvedTable, interpolated};

/// Closing of the air gap of a bent unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BentGap {
    /// Closing for a bottom that follows the cylinder and slides along it, with a Poisson's
    /// ratio of 0.49, m.
    pub closing: f64,
    /// The same for a bottom that is glued and rubber that is nearly incompressible, 0.499,
    /// m: the rubber has nowhere to go but into the cavity.
    pub glued: f64,
}

/// Relative deviation from the section that was solved.
const SAME: f64 = 0.05;
/// One um in m.
const UM: f64 = 1e-6;

/// Radius of the table, and the lengths of its section, m: half a wall, half a unit, half
/// a pitch, lower and upper layers, air gap, insulation, electrode.
const RADIUS: f64 = 4e-3;
const SECTION: [f64; 8] = [50e-6, 650e-6, 1000e-6, 300e-6, 400e-6, 6e-6, 6e-6, 400e-6];

/// The rows of the table.
#[derive(Debug)]
struct Rows {
    /// Height of the unstretched plane over the gap and closing, um: sliding, 0.49.
    sliding: Vec<[f64; 2]>,
    /// Closing of a glued bottom with 0.499 over that of a sliding one with 0.49.
    glued: f64,
}

static ROWS: LazyLock<Rows> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/solved_p2_bending.csv"));
    let of = |bottom: &'static str, poisson: f64| {
        table.rows().filter(move |row: &SolvedRow<'_>| {
            row.text("bottom") == bottom && (row.number("poisson") - poisson).abs() < 1e-9
        })
    };
    let point = |row: SolvedRow<'_>| [row.number("neutral_z_um"), row.number("closing_um_at_4mm")];
    let mut sliding: Vec<_> = of("sliding", 0.49).map(point).collect();
    sliding.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let glued = of("glued", 0.499).map(point).next();
    let same = glued.map_or(f64::NAN, |[plane, _]| interpolated(&sliding, plane));
    Rows {
        glued: glued.map_or(f64::NAN, |[_, closing]| closing / same),
        sliding,
    }
});

impl UnitDrawing {
    /// What bending to the radius `radius`, m, does to the air gap, when the plane at the
    /// height `plane`, m, above the lower face of the upper electrodes is not stretched.
    ///
    /// closing = κ [c₁ + c₂ (z_gap − z_n)], linear in the curvature κ = 1/`radius` and in the
    /// plane. `pitch` in m. `None` for another section than that of P2, in any scale: it was
    /// not solved.
    pub fn bent(&self, pitch: f64, radius: f64, plane: f64) -> Option<BentGap> {
        let scale = self.electrode / SECTION[SECTION.len() - 1];
        let lengths = [
            0.5 * self.wall_width,
            0.5 * self.unit_side,
            0.5 * pitch,
            self.lower_layer,
            self.upper_layer,
            self.air_gap,
            self.insulation,
            self.electrode,
        ];
        let same = |(given, known): (&f64, &f64)| (given / (scale * known) - 1.0).abs() <= SAME;
        if !lengths.iter().zip(&SECTION).all(same) || radius <= 0.0 {
            return None;
        }
        let rows = &*ROWS;
        let closing = interpolated(&rows.sliding, plane / (scale * UM)) * UM;
        let closing = closing * scale * scale * RADIUS / radius;
        Some(BentGap {
            closing,
            glued: closing * rows.glued,
        })
    }
}
