//! A stiff element within a bonded incompressible layer under a rigid disc: the force normal
//! to it and the stress in its plane, from a table of finite-element solutions.
//!
//! `docs/theory/piezoelectric-array.md`, section 12, has the problem and its error.

use std::sync::OnceLock;

use super::bonded_disc::{DiscGrip, LayerRim};

/// Normal force and stress in the plane of an element under the middle of a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeatedElement {
    /// Force normal to the element over the mean pressure under the disc times its area.
    pub share: f64,
    /// Mean stress in its plane over the mean stress normal to it.
    pub in_plane: f64,
}

/// What the table was solved for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeatedSetting {
    /// Area of the disc, m².
    pub disc_area: f64,
    /// Area of the element, m².
    pub element_area: f64,
    /// Thickness of the element, m.
    pub element_thickness: f64,
    /// Thickness of the layer, m.
    pub thickness: f64,
}

/// A setting that the table does not hold, with the quantity at fault.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{quantity} is {found}; the stress in the plane of an element was solved for {allowed}")]
pub struct OutsideElementTable {
    /// Quantity at fault.
    pub quantity: &'static str,
    /// Its value with its unit.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
}

/// Area and thickness of the element of the table.
const ELEMENT_AREA: f64 = 4e-6;
const ELEMENT_THICKNESS: f64 = 0.127e-3;
/// Thicknesses at which all cases were solved, m.
const THICKNESSES: [f64; 2] = [1.5e-3, 2.3e-3];
/// Relative difference of lengths and areas that changes a share by less than its error.
const SAME: f64 = 2e-3;

impl SeatedElement {
    /// Charge of the element over the mean pressure of the disc times its area, C/N, for d33
    /// and d31, C/N: share · (d33 + 2 s d31).
    pub fn charge_per_force(&self, [d33, d31]: [f64; 2]) -> f64 {
        self.share * (d33 + 2.0 * self.in_plane * d31)
    }
}

impl SeatedSetting {
    /// Area of the disc of the table, m².
    pub const DISC_AREA: f64 = 100e-6;
    /// Largest error of the share: 1 % of the rows, and 0.7 % between their thicknesses, which is what a
    /// row that is left out shows in `crates/taxel/tests/all/p3_layer.rs`.
    pub const SHARE_ERROR: f64 = 0.02;
    /// Largest error of the charge: 3 % of the rows, and 2.4 % between their thicknesses, likewise.
    pub const CHARGE_ERROR: f64 = 0.055;

    fn check(&self) -> Result<(), OutsideElementTable> {
        let same = |found: f64, solved: f64| (found / solved - 1.0).abs() < SAME;
        for (quantity, found, solved, unit, scale) in [
            (
                "the area of the disc",
                self.disc_area,
                Self::DISC_AREA,
                "mm2",
                1e-6,
            ),
            (
                "the area of the element",
                self.element_area,
                ELEMENT_AREA,
                "mm2",
                1e-6,
            ),
            (
                "the thickness of the element",
                self.element_thickness,
                ELEMENT_THICKNESS,
                "mm",
                1e-3,
            ),
        ] {
            if !same(found, solved) {
                return Err(OutsideElementTable {
                    quantity,
                    found: format!("{:.4} {unit}", found / scale),
                    allowed: format!("{} {unit}", (solved / scale * 1e6).round() / 1e6),
                });
            }
        }
        let [lowest, highest] = THICKNESSES;
        if (lowest * (1.0 - SAME)..=highest * (1.0 + SAME)).contains(&self.thickness) {
            return Ok(());
        }
        Err(OutsideElementTable {
            quantity: "the thickness of the silicone",
            found: format!("{:.4} mm", self.thickness * 1e3),
            allowed: format!("{:.1} to {:.1} mm", lowest * 1e3, highest * 1e3),
        })
    }

    /// Stress of an element whose middle is `height`, m, above the base, its rim wetted:
    /// quadratic in the distance to the nearer face, straight in the thickness, good to [`Self::SHARE_ERROR`] and [`Self::CHARGE_ERROR`].
    ///
    /// # Errors
    /// [`OutsideElementTable`] for a setting that was not solved.
    pub fn element(
        &self,
        height: f64,
        rim: LayerRim,
        grip: DiscGrip,
    ) -> Result<SeatedElement, OutsideElementTable> {
        self.check()?;
        let middle = 0.5 * self.thickness;
        let in_the_middle = (height / middle - 1.0).abs() < 0.02;
        let case = match (rim, grip) {
            (LayerRim::Flush, DiscGrip::Gripped) => return Ok(self.flush(height)),
            (LayerRim::Wide, DiscGrip::Gripped) => "mid_wide",
            (LayerRim::Wide, DiscGrip::Slip) => "mid_wide_slip",
            (LayerRim::Flush, DiscGrip::Slip) => {
                return Err(OutsideElementTable {
                    quantity: "the contact",
                    found: "a sliding disc on a layer that ends with it".into(),
                    allowed: "a gripped disc, or a layer that goes on".into(),
                });
            }
        };
        if !in_the_middle {
            return Err(OutsideElementTable {
                quantity: "the height of the element in a layer that goes on",
                found: format!("{:.4} mm", height * 1e3),
                allowed: format!("the middle, {:.4} mm", middle * 1e3),
            });
        }
        Ok(self.at_thickness(|thickness| of(case, thickness)))
    }

    fn flush(&self, height: f64) -> SeatedElement {
        // Bonded base and gripped disc: the layer is the same upside down.
        let depth = height.min(self.thickness - height);
        self.at_thickness(|thickness| {
            let cases = ["base", "low", "mid"];
            let rows = cases.map(|case| row(case, thickness));
            let [base, low, middle] = rows.map(|row| row.map_or(f64::NAN, |row| row.height));
            // The same share of the way from the base to the middle.
            let way = (depth - base) / (0.5 * self.thickness - base);
            let at = base + way.clamp(0.0, 1.0) * (middle - base);
            let places = [base, low, middle];
            let quadratic = |value: fn(&SeatedElement) -> f64| -> f64 {
                let weight = |i: usize| -> f64 {
                    let others = (0..3).filter(|j| *j != i);
                    others
                        .map(|j| (at - places[j]) / (places[i] - places[j]))
                        .product()
                };
                (0..3)
                    .map(|i| weight(i) * value(&of(cases[i], thickness)))
                    .sum()
            };
            SeatedElement {
                share: quadratic(|element| element.share),
                in_plane: quadratic(|element| element.in_plane),
            }
        })
    }

    /// Between the two thicknesses of the table.
    fn at_thickness(&self, element: impl Fn(f64) -> SeatedElement) -> SeatedElement {
        let [thin, thick] = THICKNESSES.map(element);
        let [from, to] = THICKNESSES;
        let part = (self.thickness - from) / (to - from);
        let mix = |a: f64, b: f64| a + (b - a) * part;
        SeatedElement {
            share: mix(thin.share, thick.share),
            in_plane: mix(thin.in_plane, thick.in_plane),
        }
    }

    /// Least and greatest charge over the mean pressure of the disc times the area of the
    /// element, C/N, for d33 and d31, C/N: over where the element lies, whether its rim is
    /// wetted, whether the layer goes on and slides, a ceramic of 0.267 mm, and a tolerance
    /// of ±20 % on d33. Continuous stiff electrodes, which give several times as much, are
    /// left out.
    ///
    /// # Errors
    /// [`OutsideElementTable`] for a setting that was not solved.
    pub fn charge_interval(&self, constants: [f64; 2]) -> Result<[f64; 2], OutsideElementTable> {
        self.check()?;
        let charges = cases().map(|case| {
            let element = self.at_thickness(|thickness| of(case, thickness));
            element.charge_per_force(constants)
        });
        let (least, greatest) = charges.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| {
            (a.min(q), b.max(q))
        });
        Ok([
            least * (1.0 - D33_TOLERANCE),
            greatest * (1.0 + D33_TOLERANCE),
        ])
    }
}

/// Relative tolerance of d33 from one piece of ceramic to the next.
const D33_TOLERANCE: f64 = 0.2;

/// One solution of the table.
#[derive(Debug, Clone, PartialEq)]
struct TableRow {
    case: &'static str,
    /// Thickness of the layer and height of the middle of the element, m.
    thickness: f64,
    height: f64,
    /// Thickness of a continuous electrode, m.
    sheet: f64,
    element: SeatedElement,
}

/// The table with its source and its error in its head.
const TABLE: &str = include_str!("tables/solved_p3_element.csv");

fn table() -> &'static [TableRow] {
    static ROWS: OnceLock<Vec<TableRow>> = OnceLock::new();
    ROWS.get_or_init(|| {
        let lines = TABLE.lines().filter(|line| !line.starts_with('#'));
        lines.filter_map(parse).collect()
    })
}

/// A row; `None` for the header.
fn parse(line: &'static str) -> Option<TableRow> {
    let cells: Vec<&str> = line.split(',').collect();
    let at = |index: usize| cells.get(index)?.parse::<f64>().ok();
    Some(TableRow {
        case: cells.first()?,
        thickness: at(1)? * 1e-3,
        height: at(2)? * 1e-3,
        sheet: at(6)? * 1e-3,
        element: SeatedElement {
            share: at(10)?,
            in_plane: at(11)?,
        },
    })
}

fn row(case: &str, thickness: f64) -> Option<&'static TableRow> {
    table()
        .iter()
        .find(|row| row.case == case && (row.thickness - thickness).abs() < 1e-9)
}

fn of(case: &str, thickness: f64) -> SeatedElement {
    let missing = SeatedElement {
        share: f64::NAN,
        in_plane: f64::NAN,
    };
    row(case, thickness).map_or(missing, |row| row.element)
}

/// Cases without continuous electrodes that were solved at both thicknesses.
fn cases() -> impl Iterator<Item = &'static str> {
    let [thin, thick] = THICKNESSES;
    table()
        .iter()
        .filter(move |row| (row.thickness - thin).abs() < 1e-9 && row.sheet == 0.0)
        .map(|row| row.case)
        .filter(move |case| row(case, thick).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_read_whole() {
        assert_eq!(table().len(), 22);
        assert_eq!(cases().count(), 8);
    }
}
