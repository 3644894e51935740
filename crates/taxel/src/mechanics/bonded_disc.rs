//! A rigid disc on an incompressible layer that is bonded to a rigid base: its stiffness and
//! the pressure on the base, from a table of finite-element solutions.
//!
//! `docs/theory/piezoelectric-array.md`, section 12, has the problem;
//! `taxel_fem::study::disc` solves it, and a test repeats rows of the table.

use std::ops::RangeInclusive;
use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::soft_cover::gather;
use taxel_numerics::special::gauss_panel;

/// Where the layer ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LayerRim {
    /// With the disc, in a free edge.
    #[default]
    Flush,
    /// Far beyond the disc: six thicknesses or more.
    Wide,
}

/// Whether the layer slides along the disc.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DiscGrip {
    /// It sticks to the disc.
    #[default]
    Gripped,
    /// It slides without friction.
    Slip,
}

/// A rigid disc on a bonded incompressible layer; small strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondedDisc {
    /// Radius a of the disc, m.
    pub radius: f64,
    /// Thickness h of the layer, m.
    pub thickness: f64,
    /// Where the layer ends.
    pub rim: LayerRim,
    /// Whether it slides along the disc.
    pub grip: DiscGrip,
}

/// A disc that the table does not hold.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "a disc of radius {:.4} mm on a layer of {:.4} mm: the radius over the thickness, {:.4}, must be from {lowest} to {highest}",
    radius * 1e3, thickness * 1e3, radius / thickness
)]
pub struct OutsideDiscTable {
    /// Radius of the disc, m.
    pub radius: f64,
    /// Thickness of the layer, m.
    pub thickness: f64,
    /// Smallest radius over thickness.
    pub lowest: f64,
    /// Largest radius over thickness.
    pub highest: f64,
}

/// Rows nearer than this in the logarithm fill no gap: their errors would count more than what
/// they tell.
const GAP: f64 = 0.15;

/// Radii of the tabulated pressures over that of the disc.
const NODES: [f64; 11] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95];

/// A disc with its stiffness and the pressure under it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscPressure {
    disc: BondedDisc,
    /// Force times thickness over area, displacement and Young's modulus.
    stiffness: f64,
    /// Pressure on the base over the mean under the disc, at [`NODES`].
    pressures: [f64; 11],
    /// Share of the force within [`NODES`].
    within: [f64; 11],
    /// Pressure beyond the last node, up to the rim.
    at_rim: f64,
}

impl BondedDisc {
    /// Radius over thickness of the table.
    pub const ASPECTS: RangeInclusive<f64> = 0.5..=10.0;

    /// Stiffness and pressure on the base: cubic in ln(a/h) through the logarithms of the
    /// tabulated values. Between its rows 0.5 %.
    ///
    /// # Errors
    /// [`OutsideDiscTable`] for a radius over thickness outside [`BondedDisc::ASPECTS`].
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{BondedDisc, DiscGrip, LayerRim};
    /// let disc = BondedDisc {
    ///     radius: 5.642e-3,
    ///     thickness: 1.5e-3,
    ///     rim: LayerRim::Flush,
    ///     grip: DiscGrip::Gripped,
    /// };
    /// let pressed = disc.pressed()?;
    /// // Of the mean pressure, on a square of 2 mm in the middle.
    /// let share = pressed.share([0.0, 0.0], 2e-3).unwrap() / 0.04;
    /// assert!((share - 1.8154).abs() < 4e-3);
    /// # Ok::<(), taxel::mechanics::OutsideDiscTable>(())
    /// ```
    pub fn pressed(&self) -> Result<DiscPressure, OutsideDiscTable> {
        let aspect = self.radius / self.thickness;
        let rows = self.rows();
        // Rounding of the lengths.
        let allowed = *Self::ASPECTS.start() * (1.0 - 1e-9)..=*Self::ASPECTS.end() * (1.0 + 1e-9);
        if !allowed.contains(&aspect) || rows.len() < 4 {
            return Err(OutsideDiscTable {
                radius: self.radius,
                thickness: self.thickness,
                lowest: *Self::ASPECTS.start(),
                highest: *Self::ASPECTS.end(),
            });
        }
        let before = rows.iter().filter(|(at, _)| *at <= aspect).count();
        let first = before.saturating_sub(2).min(rows.len() - 4);
        let near = &rows[first..first + 4];
        let places: [f64; 4] = std::array::from_fn(|i| near[i].0.ln());
        let between = |value: &dyn Fn(&TableRow) -> f64| {
            let logarithms: [f64; 4] = std::array::from_fn(|i| value(near[i].1).ln());
            cubic(places, logarithms, aspect.ln()).exp()
        };
        let stiffness = between(&|row| row.stiffness);
        let pressures = std::array::from_fn(|node| between(&|row| row.pressures[node]));
        Ok(DiscPressure::new(*self, stiffness, pressures))
    }

    /// Radius over thickness and solution of the rows for this contact, in order. The upper
    /// half of a layer between two gripped discs slides on its middle plane: with a free edge
    /// a sliding disc is a gripped one on twice the layer, whose rows fill gaps.
    fn rows(&self) -> Vec<(f64, &'static TableRow)> {
        let own = |row: &TableRow| row.rim == self.rim && row.grip == self.grip;
        let rows = table().iter().filter(|row| own(row));
        let mut rows: Vec<_> = rows.map(|row| (row.aspect, row)).collect();
        if self.rim == LayerRim::Flush {
            let factor = match self.grip {
                DiscGrip::Gripped => 0.5,
                DiscGrip::Slip => 2.0,
            };
            for row in table() {
                let aspect = factor * row.aspect;
                let near = |(at, _): &(f64, &TableRow)| (aspect / at).ln().abs() < GAP;
                if row.rim == self.rim && row.grip != self.grip && !rows.iter().any(near) {
                    rows.push((aspect, row));
                }
            }
        }
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        rows
    }
}

impl DiscPressure {
    fn new(disc: BondedDisc, stiffness: f64, pressures: [f64; 11]) -> Self {
        let mut pressed = Self {
            disc,
            stiffness,
            pressures,
            within: [0.0; 11],
            at_rim: 0.0,
        };
        for node in 1..NODES.len() {
            let [from, to] = [NODES[node - 1], NODES[node]];
            let ring = gauss_panel(from, to, |r| 2.0 * r * pressed.inside(r));
            pressed.within[node] = pressed.within[node - 1] + ring;
        }
        let [last, before] = [10, 9].map(|node| pressures[node]);
        let end = NODES[10];
        pressed.at_rim = match disc.rim {
            // The base carries the whole force.
            LayerRim::Flush => (1.0 - pressed.within[10]) / (1.0 - end * end),
            // The middle of the last ring on the straight line through the last two.
            LayerRim::Wide => last + 0.5 * (last - before),
        };
        pressed
    }

    /// Cubic through the four nearest nodes up to the last one; `r` over the radius.
    fn inside(&self, r: f64) -> f64 {
        let after = NODES.iter().filter(|node| **node <= r).count();
        let node = |at: usize| (NODES[at], self.pressures[at]);
        let near: [(f64, f64); 4] = if after < 2 {
            // The function is even: the node before the first is the second.
            [(-NODES[1], self.pressures[1]), node(0), node(1), node(2)]
        } else {
            let first = (after - 2).min(NODES.len() - 4);
            std::array::from_fn(|i| node(first + i))
        };
        cubic(near.map(|(at, _)| at), near.map(|(_, value)| value), r)
    }

    /// Pressure on the base at a distance from the axis, m, over the mean pressure under the
    /// disc; `None` beyond the rim of a layer that goes on, where there is no table.
    pub fn pressure(&self, radius: f64) -> Option<f64> {
        let r = radius / self.disc.radius;
        // Rounding of the lengths.
        if r <= NODES[10] * (1.0 + 1e-9) {
            Some(self.inside(r))
        } else if r <= 1.0 {
            Some(self.at_rim)
        } else {
            (self.disc.rim == LayerRim::Flush).then_some(0.0)
        }
    }

    /// Force over displacement of the disc, N/m, for a layer of this Young's modulus, Pa.
    pub fn stiffness(&self, modulus: f64) -> f64 {
        let area = std::f64::consts::PI * self.disc.radius * self.disc.radius;
        self.stiffness * modulus * area / self.disc.thickness
    }

    /// Share of the force of the disc on a square of side `side`, m, on the base, whose centre
    /// is `offset`, m, away from the axis. `None` where it reaches beyond the rim of a layer
    /// that goes on.
    pub fn share(&self, offset: [f64; 2], side: f64) -> Option<f64> {
        let corner = offset.map(|along| along.abs() + 0.5 * side);
        let beyond = corner[0].hypot(corner[1]) > self.disc.radius * (1.0 + 1e-9);
        if beyond && self.disc.rim == LayerRim::Wide {
            return None;
        }
        // Panels as long as a third of a thickness resolve the pressure at the rim to 1e-4.
        let panels = (3.0 * side / self.disc.thickness).ceil().max(4.0) as usize;
        Some(gather(offset, side, panels, |radius| {
            self.mean_share(radius)
        }))
    }

    /// Share of the force within `radius` over its square, 1/m².
    fn mean_share(&self, radius: f64) -> f64 {
        let (r, area) = (radius / self.disc.radius, radius * radius);
        if r < 1e-9 {
            return self.pressures[0] / (self.disc.radius * self.disc.radius);
        }
        if r >= 1.0 {
            return 1.0 / area;
        }
        let node = NODES.iter().rposition(|node| *node <= r).unwrap_or(0);
        let from = NODES[node];
        let rest = if node == NODES.len() - 1 {
            self.at_rim * (r * r - from * from)
        } else {
            gauss_panel(from, r, |r| 2.0 * r * self.inside(r))
        };
        (self.within[node] + rest) / area
    }
}

/// The cubic through four points, at `x`.
fn cubic(places: [f64; 4], values: [f64; 4], x: f64) -> f64 {
    let others = |i: usize| (0..4).filter(move |j| *j != i);
    let weight = |i: usize| -> f64 {
        others(i)
            .map(|j| (x - places[j]) / (places[i] - places[j]))
            .product()
    };
    (0..4).map(|i| weight(i) * values[i]).sum()
}

/// One solution of the table.
#[derive(Debug, Clone, Copy)]
struct TableRow {
    rim: LayerRim,
    grip: DiscGrip,
    aspect: f64,
    stiffness: f64,
    pressures: [f64; 11],
}

/// The tables, each with its source and its error in its head.
const TABLES: [&str; 2] = [
    include_str!("tables/solved_p3_layer.csv"),
    include_str!("tables/bonded_disc.csv"),
];

fn table() -> &'static [TableRow] {
    static ROWS: OnceLock<Vec<TableRow>> = OnceLock::new();
    ROWS.get_or_init(|| {
        let lines = TABLES.into_iter().flat_map(str::lines);
        let lines = lines.filter(|line| !line.starts_with('#'));
        lines.filter_map(parse).collect()
    })
}

/// A row; `None` for the header.
fn parse(line: &str) -> Option<TableRow> {
    let (contact, numbers) = line.split_once(',')?;
    let (grip, rim) = contact.split_once('_')?;
    let mut numbers = numbers.split(',').map(|cell| cell.parse::<f64>().ok());
    let mut next = || numbers.next().flatten();
    let (aspect, stiffness) = (next()?, next()?);
    let mut pressures = [0.0; 11];
    for pressure in &mut pressures {
        *pressure = next()?;
    }
    Some(TableRow {
        rim: match rim {
            "flush" => LayerRim::Flush,
            "wide" => LayerRim::Wide,
            _ => return None,
        },
        grip: match grip {
            "gripped" => DiscGrip::Gripped,
            "slip" => DiscGrip::Slip,
            _ => return None,
        },
        aspect,
        stiffness,
        pressures,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_read_whole() {
        assert_eq!(table().len(), 40 + 12);
    }
}
