//! The edges of a tile of a three-axis unit (P2): what they add to the capacitance of the
//! plates, by a law of the air gap and by a solution of the electric field.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};
use wide::f64x4;

use super::tilted_plate::VACUUM_PERMITTIVITY;
use crate::solved_table::{SolvedRow, SolvedTable, interpolated};

/// What the field of an edge sees around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EdgeEnvironment {
    /// No neighbour.
    Isolated,
    /// A neighbour at this distance from edge to edge, m, with both electrodes at 0 V.
    Grounded(f64),
    /// A neighbour at this distance from edge to edge, m, whose upper electrode is driven
    /// with the own one.
    Row(f64),
}

/// The excess of an edge against the air gap a, e = p − q ln(a + s) with a in um: valid
/// for 2 to 8 um, all other lengths as P2 draws them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EdgeLaw {
    /// p, without unit.
    pub constant: f64,
    /// q, without unit.
    pub factor: f64,
    /// s, um.
    pub shift: f64,
}

/// One um in m.
const UM: f64 = 1e-6;
/// Least of (a + s)/s: the law has no meaning where a search would pass it.
const LEAST_REACH: f64 = 1e-2;
/// Shifts of the law that are tried, tenths of a um.
const SHIFTS: std::ops::RangeInclusive<u8> = 5..=40;
/// The air gap of the drawing at which the other lengths were varied, m.
const DRAWN_AIR: f64 = 6e-6;

impl EdgeLaw {
    /// Air gaps of the fit, m.
    pub const AIR_GAPS: std::ops::RangeInclusive<f64> = 2e-6..=8e-6;
    /// The law of the drawn section with what stands beside it, fitted to the rows of
    /// `tables/solved_p2_edges.csv`; `None` for surroundings that the table has at no other
    /// air gap.
    ///
    /// # Example: the other tile of the unit, grounded
    /// ```
    /// use taxel::transduction::{EdgeEnvironment, EdgeLaw, INNER_DISTANCE};
    /// let law = EdgeLaw::tabulated(EdgeEnvironment::Grounded(INNER_DISTANCE)).unwrap();
    /// assert!((law.excess(6e-6) - 2.0588).abs() < 1e-3);
    /// assert_eq!(EdgeLaw::tabulated(EdgeEnvironment::Grounded(1e-3)), None);
    /// ```
    pub fn tabulated(environment: EdgeEnvironment) -> Option<Self> {
        let laws = &EXCESSES.laws;
        let of = |inner: usize, outer: usize, distance: f64| {
            let near = |drawn: f64| (distance - drawn).abs() <= 1e-9 * drawn;
            match () {
                () if near(INNER_DISTANCE) => Some(laws[inner]),
                () if near(OUTER_DISTANCE) => Some(laws[outer]),
                () => None,
            }
        };
        match environment {
            EdgeEnvironment::Isolated => Some(laws[0]),
            EdgeEnvironment::Grounded(distance) => of(1, 2, distance),
            EdgeEnvironment::Row(distance) => of(3, 4, distance),
        }
    }

    /// The law through points of air gap, um, and excess: least squares for p and q at each
    /// shift, of which the best is taken. Tenths of a um are fine enough: the law is within
    /// 1e-3 of the points, as they are of the field.
    fn fitted(points: &[[f64; 2]]) -> Self {
        let nothing = Self {
            constant: f64::NAN,
            factor: f64::NAN,
            shift: f64::NAN,
        };
        let fits = SHIFTS.map(|tenths| {
            let shift = 0.1 * f64::from(tenths);
            let count = points.len() as f64;
            let logs = || points.iter().map(|[air, _]| (air + shift).ln());
            let mean_log = logs().sum::<f64>() / count;
            let mean = points.iter().map(|[_, excess]| excess).sum::<f64>() / count;
            let about = || logs().map(|log| log - mean_log).zip(points);
            let product: f64 = about()
                .map(|(log, [_, excess])| log * (excess - mean))
                .sum();
            let square: f64 = about().map(|(log, _)| log * log).sum();
            let factor = -product / square;
            let law = Self {
                constant: mean + factor * mean_log,
                factor,
                shift,
            };
            let off = |[air, excess]: &[f64; 2]| (law.excess(air * UM) - excess).powi(2);
            (points.iter().map(off).sum::<f64>(), law)
        });
        let best = fits.min_by(|(one, _), (other, _)| one.total_cmp(other));
        best.map_or(nothing, |(_, law)| law)
    }

    /// The excess at an air gap, m. Without unit. A search may ask for gaps a little below
    /// zero.
    pub fn excess(self, air_gap: f64) -> f64 {
        self.constant - self.factor * self.reach(air_gap).ln()
    }

    /// The law through points of air gap, m, and excess, whose middle air gap is `middle`, m.
    pub fn through(points: &[[f64; 2]], middle: f64) -> Self {
        let scale = middle / DRAWN_AIR;
        let points: Vec<_> = points
            .iter()
            .map(|[air, excess]| [air / (scale * UM), *excess])
            .collect();
        Self::fitted(&points).of_drawing(scale, 1.0)
    }

    /// True of numbers that a law may have.
    pub(super) fn is_sound(self) -> bool {
        let numbers = [self.constant, self.factor, self.shift];
        numbers.iter().all(|number| number.is_finite()) && self.shift > 0.0
    }

    /// The law of a share of this excess.
    pub(super) fn share(self, share: f64) -> Self {
        self.of_drawing(1.0, share)
    }

    /// The slope of the excess against the air gap, 1/m.
    pub fn slope(self, air_gap: f64) -> f64 {
        -self.factor / (self.reach(air_gap) * UM)
    }

    /// a + s in um, which stays above zero.
    fn reach(self, air_gap: f64) -> f64 {
        (air_gap / UM + self.shift).max(LEAST_REACH * self.shift)
    }

    /// The law of a drawing whose lengths are all `scale` times as long and whose excess is
    /// `share` of this one: e(a/scale)·share.
    fn of_drawing(self, scale: f64, share: f64) -> Self {
        Self {
            constant: share * (self.constant + self.factor * scale.ln()),
            factor: share * self.factor,
            shift: scale * self.shift,
        }
    }

    /// A law between this one and `other`, through the excess `excess` at the drawn air gap.
    fn towards(self, other: Self, share: f64, excess: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        let law = Self {
            constant: 0.0,
            factor: mix(self.factor, other.factor),
            shift: mix(self.shift, other.shift),
        };
        Self {
            constant: excess - law.excess(DRAWN_AIR),
            ..law
        }
    }
}

/// Distance to the other tile of the unit in P2, m.
pub const INNER_DISTANCE: f64 = 300e-6;
/// Distance to the next unit in P2, m.
pub const OUTER_DISTANCE: f64 = 900e-6;

/// The four edges of a tile (P2) as a term of its capacitance, all other electrodes grounded:
/// C = ε₀ Σ l e(a) over the edges of length l, with the air gap a at each edge, and corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileEdges {
    /// The edges towards the middle of the unit that x and that y cross.
    pub inner: [EdgeLaw; 2],
    /// The edges towards the next unit.
    pub outer: [EdgeLaw; 2],
    /// What the corners add, F.
    pub corners: f64,
}

/// Capacitance of the edges of a tile with its slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSlopes {
    /// Edges and corners, F.
    pub capacitance: f64,
    /// ∂C/∂a of the air gap at the centre of the tile, F/m.
    pub by_air_gap: f64,
    /// ∂C/∂α and ∂C/∂β of the slopes of the tile, F.
    pub by_slope: [f64; 2],
}

impl TileEdges {
    /// Four edges of one law, without corners.
    pub(super) fn alike(law: EdgeLaw) -> Self {
        Self {
            inner: [law; 2],
            outer: [law; 2],
            corners: 0.0,
        }
    }

    /// The edges of a tile with sides `electrode`, m, whose centre has `air` under it, m.
    /// `rise` is half of what the gap falls over the tile along x and y, m, positive where
    /// it falls outward.
    pub fn at(&self, electrode: [f64; 2], air: f64, rise: [f64; 2]) -> EdgeSlopes {
        // The four edges at once: logarithms are what a search spends its time on.
        let ([ix, iy], [ox, oy]) = (self.inner, self.outer);
        let of = |key: fn(EdgeLaw) -> f64| f64x4::new([ix, ox, iy, oy].map(key));
        let [along_y, along_x] = [1, 0].map(|axis| VACUUM_PERMITTIVITY * electrode[axis]);
        let length = f64x4::new([along_y, along_y, along_x, along_x]);
        let air = air + f64x4::new([rise[0], -rise[0], rise[1], -rise[1]]);
        let shift = of(|law| law.shift);
        let reach = (air * f64x4::splat(1.0 / UM) + shift).max(shift * LEAST_REACH);
        let factor = length * of(|law| law.factor);
        let excess = length * of(|law| law.constant) - factor * reach.ln();
        let [a, b, c, d] = (-factor / (reach * UM)).to_array();
        EdgeSlopes {
            capacitance: self.corners + excess.reduce_add(),
            by_air_gap: a + b + c + d,
            by_slope: [(a - b) * 0.5 * electrode[0], (c - d) * 0.5 * electrode[1]],
        }
    }

    /// Edges without corners of a tile that lies parallel, F.
    pub fn parallel(&self, electrode: [f64; 2], air: f64) -> f64 {
        self.at(electrode, air, [0.0; 2]).capacitance - self.corners
    }
}

/// The lengths of a unit that its edges follow from, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeDrawing {
    /// Sides of the electrode along x and y.
    pub electrode: [f64; 2],
    /// Narrowest and widest air gap of the unit.
    pub air_gap: [f64; 2],
    /// Insulation on the lower electrode.
    pub insulation: f64,
    /// Its relative permittivity, and of the layers around.
    pub permittivity: f64,
    /// Thickness of an electrode.
    pub electrode_thickness: f64,
    /// Air beyond the inner and the outer edges, up to the wall, along x and along y.
    pub cavity: [[f64; 2]; 2],
    /// Solid above the air gap.
    pub above: f64,
    /// Solid below the lower electrode.
    pub below: f64,
    /// Distance from edge to edge to the other tile of the unit, along x and y.
    pub inner: [f64; 2],
    /// The same to the next unit; `None` without one.
    pub outer: [Option<f64>; 2],
}

/// The edges of the tiles of a drawing, and what may be around them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnEdges {
    /// All other electrodes grounded.
    pub grounded: TileEdges,
    /// Where they add least and most, without corners: with a grounded plane under the array, and
    /// of a capacitor alone.
    pub surroundings: [TileEdges; 2],
    /// Largest relative error of an excess.
    pub error: f64,
}

/// A length of the drawing for which the edges are not tabulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutsideEdges {
    /// Key of the sensor file that is off, below the element.
    pub key: &'static str,
    /// What is off.
    pub quantity: &'static str,
    /// Its value over `unit`.
    pub given: f64,
    /// Least and greatest value over `unit`.
    pub range: [f64; 2],
    /// Unit for people, with a space before it; empty for plain numbers.
    pub unit: &'static str,
}

impl std::fmt::Display for OutsideEdges {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [least, greatest] = self.range;
        let (given, unit) = (self.given, self.unit);
        let quantity = self.quantity;
        write!(
            f,
            "the edges of the electrodes follow from the drawing for {quantity} from \
             {least:.4}{unit} to {greatest:.4}{unit}, not for {given:.4}{unit}"
        )
    }
}

/// What the four corners of a tile of P2 add, F: negative, the edges count them twice. From
/// the field of one isolated capacitor in space (`tables/p2_corners.csv`).
pub fn corner_capacitance() -> f64 {
    *CORNERS
}

/// What the corners of another drawing add, F: they are of the size of the effective gap.
pub(super) fn corners_of(drawing: &EdgeDrawing) -> f64 {
    let [least, greatest] = drawing.air_gap;
    let gap = (least * greatest).sqrt() + drawing.insulation / drawing.permittivity;
    corner_capacitance() * gap / (6e-6 + 6e-6 / 2.7)
}

static CORNERS: LazyLock<f64> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p2_corners.csv"));
    // The last row has the finest mesh.
    let finest = table.rows().last();
    finest.map_or(f64::NAN, |row| {
        (row.number("in_space_fF") - row.number("by_edges_fF")) * 1e-15
    })
});

/// Largest relative error of an excess of [`EdgeDrawing::tabulated`] away from the drawing of
/// P2, and on it: that of the table and that of the law.
pub const EDGE_ERROR: f64 = 0.05;
const DRAWN_ERROR: f64 = 2e-3;

impl EdgeDrawing {
    /// True if the lengths make a section: electrodes on layers, a wall between cavities.
    pub fn is_section(&self) -> bool {
        let walled = |axis: usize| {
            let [inner, outer] = self.cavity[axis];
            let beyond = self.outer[axis].is_none_or(|distance| distance > 2.0 * outer);
            inner > 0.0 && outer > 0.0 && self.inner[axis] > 2.0 * inner && beyond
        };
        let [along_x, along_y] = self.electrode;
        let lengths = [
            along_x,
            along_y,
            self.insulation,
            self.electrode_thickness,
            self.below,
            self.air_gap[0],
        ];
        lengths.into_iter().all(|length| length > 0.0)
            && self.above > self.electrode_thickness
            && walled(0)
            && walled(1)
    }

    /// The edges by the table.
    ///
    /// Excesses depend on ratios of lengths alone, so that the drawing is scaled to the tile
    /// of the table; each other length then enters by the rows in which it was varied alone.
    ///
    /// # Errors
    /// [`OutsideEdges`] for a length beyond the table.
    pub fn tabulated(&self) -> Result<DrawnEdges, OutsideEdges> {
        let (scale, share) = self.scaled()?;
        let table = &*EXCESSES;
        let alone = table.laws[0].of_drawing(scale, share);
        let beside = |distance: f64| table.law(distance / scale).of_drawing(scale, share);
        let inner = self.inner.map(beside);
        let outer = self.outer.map(|distance| distance.map_or(alone, beside));
        let [inner_share, outer_share] = table.over_plane;
        let mut distances = self
            .inner
            .iter()
            .map(|distance| (*distance, INNER_DISTANCE));
        let beyond = self
            .outer
            .iter()
            .flatten()
            .map(|distance| (*distance, OUTER_DISTANCE));
        let as_drawn = same(share, 1.0)
            && distances.all(|(distance, drawn)| same(distance, scale * drawn))
            && { beyond }.all(|(distance, drawn)| same(distance, scale * drawn));
        Ok(DrawnEdges {
            grounded: TileEdges {
                inner,
                outer,
                corners: corners_of(self),
            },
            surroundings: [
                TileEdges {
                    inner: inner.map(|law| law.share(inner_share)),
                    outer: outer.map(|law| law.share(outer_share)),
                    corners: 0.0,
                },
                TileEdges::alike(alone),
            ],
            error: if as_drawn { DRAWN_ERROR } else { EDGE_ERROR },
        })
    }

    /// The scale of the drawing over that of the table, and the share of the excess that its
    /// other lengths leave.
    fn scaled(&self) -> Result<(f64, f64), OutsideEdges> {
        let [along_x, along_y] = self.electrode;
        if !same(along_y, along_x) {
            return Err(OutsideEdges {
                key: "plates.electrode",
                quantity: "square electrodes, along y",
                given: along_y / UM,
                range: [along_x / UM; 2],
                unit: " um",
            });
        }
        let scale = along_x / (2.0 * EXCESSES.half_width * UM);
        let um = scale * UM;
        let within = |key, quantity, given: f64, unit: &'static str, size: f64, range: [f64; 2]| {
            let outside = OutsideEdges {
                key,
                quantity,
                given: given / size,
                range: range.map(|end| end * if unit.is_empty() { 1.0 } else { scale }),
                unit,
            };
            let [least, greatest] = outside.range;
            let slack = 1e-9 * greatest;
            if (least - slack..=greatest + slack).contains(&outside.given) {
                Ok(())
            } else {
                Err(outside)
            }
        };
        let gaps = [EdgeLaw::AIR_GAPS.start(), EdgeLaw::AIR_GAPS.end()].map(|gap| gap / UM);
        for gap in self.air_gap {
            within("plates.air_gap", "an air gap", gap, " um", UM, gaps)?;
        }
        let mut share = 1.0;
        for (place, (key, quantity, given)) in [
            ("plates.insulation", "an insulation", self.insulation),
            (
                "plates.insulation_permittivity",
                "a permittivity of the insulation",
                self.permittivity,
            ),
            (
                "outline.electrode_thickness",
                "an electrode thickness",
                self.electrode_thickness,
            ),
            (
                "outline.wall_width",
                "air beyond the electrode",
                // Square electrodes have the same air along x and y.
                0.5 * (self.cavity[0][0] + self.cavity[0][1]),
            ),
            (
                "outline.electrode_layer",
                "a solid above the air gap",
                self.above,
            ),
        ]
        .into_iter()
        .enumerate()
        {
            let rows = &EXCESSES.varied[place];
            let plain = place == 1;
            let known = [rows.first(), rows.last()].map(|end| end.map_or(f64::NAN, |end| end[0]));
            let [least, greatest] = known.map(f64::exp);
            let (unit, size) = if plain { ("", 1.0) } else { (" um", UM) };
            // A wider cavity than that of the table changes nothing that its error leaves.
            let wider = if place == 3 { 2.0 } else { 1.0 };
            within(key, quantity, given, unit, size, [least, wider * greatest])?;
            let over = if plain { given } else { given / um };
            let over = over.ln().min(known[1]);
            share *= interpolated(rows, over).exp();
        }
        for distance in self.inner {
            let (key, quantity) = ("suspension.centre_distance", "tiles apart");
            within(key, quantity, distance, " um", UM, DISTANCES)?;
        }
        Ok((scale, share))
    }
}

/// Distances of neighbours over those of P2 that are taken, um.
const DISTANCES: [f64; 2] = [150.0, 1600.0];

/// The excesses of `tables/solved_p2_edges.csv`.
#[derive(Debug)]
struct Excesses {
    /// Half width of the tile, um.
    half_width: f64,
    /// Excess at the drawn air gap of a tile alone.
    isolated: f64,
    /// ln(distance, um) and ln(isolated excess − excess) of grounded neighbours.
    distances: Vec<[f64; 2]>,
    /// For insulation, permittivity, electrode, cavity and solid above: ln(value) and
    /// ln(excess over that of the drawing).
    varied: [Vec<[f64; 2]>; 5],
    /// Against the air gap: of a tile alone, beside grounded neighbours at [`INNER_DISTANCE`]
    /// and [`OUTER_DISTANCE`], beside those of a driven row.
    laws: [EdgeLaw; 5],
    /// Share of the excess over a grounded plane: inner and outer neighbours.
    over_plane: [f64; 2],
}

static EXCESSES: LazyLock<Excesses> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/solved_p2_edges.csv"));
    Excesses::read(&table)
});

/// Lengths of the drawing in the columns of the table.
const DRAWN: [(&str, f64); 6] = [
    ("insulation_um", 6.0),
    ("eps_r", 2.7),
    ("copper_um", 20.0),
    ("cavity_um", 100.0),
    ("top_um", 400.0),
    ("air_um", 6.0),
];

impl Excesses {
    fn read(table: &SolvedTable) -> Self {
        let half_width = 200.0;
        // Rows that have all of the drawing but the columns named.
        let rows =
            |environment: &'static str, distance: Option<f64>, free: &'static [&'static str]| {
                table.rows().filter(move |row: &SolvedRow<'_>| {
                    let drawn = |(column, value): &(&str, f64)| {
                        free.contains(column) || same(row.number(column), *value)
                    };
                    row.text("environment") == environment
                        && same(row.number("half_width_um"), half_width)
                        && distance.is_none_or(|d| same(row.number("neighbour_distance_um"), d))
                        && DRAWN.iter().all(drawn)
                })
            };
        let open = |row: &SolvedRow<'_>| row.number("plane_below") == 0.0;
        let excess = |row: &SolvedRow<'_>| row.number("excess");
        let inner = INNER_DISTANCE / UM;
        let of = |distance: f64, plane: bool| {
            let mut found = rows("grounded", Some(distance), &[]).filter(|row| open(row) != plane);
            found.next().map_or(f64::NAN, |row| excess(&row))
        };
        let isolated = rows("isolated", None, &[])
            .next()
            .map_or(f64::NAN, |row| excess(&row));
        // The wall stands in the middle between near tiles.
        let near = rows("grounded", None, &["cavity_um"]).filter(|row| {
            let [distance, cavity] = [row.number("neighbour_distance_um"), row.number("cavity_um")];
            open(row) && (same(cavity, 100.0) || distance < inner)
        });
        let distances = near.map(|row| {
            let distance = row.number("neighbour_distance_um");
            [distance.ln(), (isolated - excess(&row)).ln()]
        });
        let base = of(inner, false);
        let varied = |columns: &'static [&'static str; 1]| {
            let points = rows("grounded", Some(inner), columns).filter(open);
            sorted(points.map(|row| [row.number(columns[0]).ln(), (excess(&row) / base).ln()]))
        };
        let outer = OUTER_DISTANCE / UM;
        let law = |environment: &'static str, distance: Option<f64>| {
            let rows = rows(environment, distance, &["air_um"]).filter(open);
            let points = sorted(rows.map(|row| [row.number("air_um"), excess(&row)]));
            EdgeLaw::fitted(&points)
        };
        Self {
            laws: [
                law("isolated", None),
                law("grounded", Some(inner)),
                law("grounded", Some(outer)),
                law("row", Some(inner)),
                law("row", Some(outer)),
            ],
            half_width,
            isolated,
            distances: sorted(distances),
            varied: [
                varied(&["insulation_um"]),
                varied(&["eps_r"]),
                varied(&["copper_um"]),
                varied(&["cavity_um"]),
                varied(&["top_um"]),
            ],
            over_plane: [inner, outer].map(|d| of(d, true) / of(d, false)),
        }
    }

    /// The law for a grounded neighbour at `distance`, m, in the scale of the table.
    fn law(&self, distance: f64) -> EdgeLaw {
        let taken = |distance: f64| interpolated(&self.distances, (distance / UM).ln()).exp();
        let (inner, outer) = (taken(INNER_DISTANCE), taken(OUTER_DISTANCE));
        let here = taken(distance);
        let excess = self.isolated - here;
        if here > outer {
            let share = ((inner - here) / (inner - outer)).max(0.0);
            self.laws[1].towards(self.laws[2], share, excess)
        } else {
            let share = (outer - here) / outer;
            self.laws[2].towards(self.laws[0], share, excess)
        }
    }
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9 * b.abs()
}

/// Points in the order of x, each x once.
fn sorted(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut points: Vec<_> = points.collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points.dedup_by(|a, b| a[0] == b[0]);
    points
}
