//! Four capacitors under one bump (P2): deformation to capacitance.

use schemars::JsonSchema;
use serde::Deserialize;

use super::solved_edges::SolvedEdges;
use super::tile_edges::{EdgeSlopes, TileEdges};
use super::tilted_plate::{VACUUM_PERMITTIVITY, mean_inverse_gap, mean_inverse_gaps};
use crate::mechanics::{SIDE_X, SIDE_Y, ThreeAxisDeformation};
use crate::of_drawing::OfDrawing;
use crate::quantity::{
    self, Checked, NonNegativeCapacitance, NonNegativeLength, OneOrList, PositiveLength,
    RelativePermittivity,
};

/// The capacitors as a sensor file gives them.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlatesDescription {
    /// Sides of an electrode along x and y, m.
    #[serde(deserialize_with = "quantity::list::<2, PositiveLength, _>")]
    #[schemars(with = "[Checked<PositiveLength>; 2]")]
    pub electrode: [f64; 2],
    /// Air between tile and insulation at rest, m: one for all four
    /// capacitors, or a list for 11, 12, 21, 22.
    #[serde(deserialize_with = "quantity::one_or_list::<4, PositiveLength, _>")]
    #[schemars(with = "OneOrList<4, PositiveLength>")]
    pub air_gap: [f64; 4],
    /// Thickness of the insulation on one electrode, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub insulation: f64,
    /// Relative permittivity of the insulation.
    #[serde(deserialize_with = "quantity::one::<RelativePermittivity, _>")]
    #[schemars(with = "Checked<RelativePermittivity>")]
    pub insulation_permittivity: f64,
    /// Constant capacitance parallel to each plate pair (fringe, leads), F:
    /// one for all four, or a list for 11, 12, 21, 22. Without the key the
    /// edges of the electrodes follow from the drawing, with all other
    /// electrodes grounded, and change with the air gap.
    #[serde(
        default,
        deserialize_with = "quantity::optional_one_or_list::<4, NonNegativeCapacitance, _>"
    )]
    #[schemars(with = "Option<OneOrList<4, NonNegativeCapacitance>>")]
    pub parallel_capacitance: Option<[f64; 4]>,
    /// Edges of a drawing that no table has.
    #[serde(skip)]
    pub solved_edges: OfDrawing<SolvedEdges>,
}

/// Four plate pairs: the electrical model of one unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plates {
    /// Sides of an electrode along x and y, m.
    pub electrode: [f64; 2],
    /// Air at rest, capacitors 11, 12, 21, 22, m.
    pub air_gap: [f64; 4],
    /// Insulation thickness over its relative permittivity, m.
    pub insulation_gap: f64,
    /// Constant parallel capacitance, F; beside the edges, where they are given.
    pub parallel_capacitance: [f64; 4],
    /// Edges of the electrodes; `None` where the parallel capacitance has them.
    pub edges: Option<TileEdges>,
}

/// Capacitance of one plate pair and what became of its air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlateReading {
    /// Capacitance, F. A closed pair reads its value at first contact: a
    /// lower bound.
    pub capacitance: f64,
    /// Smallest air gap over the tile, m; zero means closed.
    pub least_air_gap: f64,
}

/// Capacitances of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeAxisResponse {
    /// Capacitors 11, 12, 21, 22.
    pub plates: [PlateReading; 4],
}

impl ThreeAxisResponse {
    /// Capacitances 11, 12, 21, 22, F.
    pub fn capacitance(&self) -> [f64; 4] {
        self.plates.map(|plate| plate.capacitance)
    }

    /// Capacitors whose electrodes touch each other.
    pub fn closed(&self) -> [bool; 4] {
        self.plates.map(|plate| plate.least_air_gap <= 0.0)
    }

    /// The smallest air gap of the unit, m.
    pub fn least_air_gap(&self) -> f64 {
        self.plates
            .iter()
            .map(|plate| plate.least_air_gap)
            .fold(f64::INFINITY, f64::min)
    }
}

/// Most steps of Newton's method to the gap of a reading: from twice the gap it takes five.
const MOST_STEPS: usize = 40;
/// Share of its air below which a tile touches where the motion has ended.
const TOUCHING: f64 = 1e-12;

/// Capacitances 11, 12, 21, 22 with their slopes against the motion of the tiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlateSlopes {
    /// Capacitance, F.
    pub capacitance: [f64; 4],
    /// ∂C/∂w, F/m: closing at the centre.
    pub by_closing: [f64; 4],
    /// ∂C/∂α and ∂C/∂β, F: slopes of the tiles along x and y.
    pub by_slope: [[f64; 4]; 2],
}

/// The reading of a capacitor at rest, with what follows from it alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestReading {
    /// Capacitance, F.
    capacitance: f64,
    /// What is parallel to the plate pair at the air gap of the model, F.
    beside: f64,
    /// Air gap at which a parallel tile has this capacitance, m.
    air_gap: f64,
}

impl PlatesDescription {
    /// The model this description states; `edges` where no parallel capacitance is typed in.
    pub fn model(&self, edges: Option<TileEdges>) -> Plates {
        Plates {
            electrode: self.electrode,
            air_gap: self.air_gap,
            insulation_gap: self.insulation / self.insulation_permittivity,
            parallel_capacitance: self.parallel_capacitance.unwrap_or_default(),
            edges: match self.parallel_capacitance {
                Some(_) => None,
                None => edges,
            },
        }
    }
}

impl Plates {
    /// ε₀ times the electrode area, F m.
    pub fn permittivity_area(&self) -> f64 {
        VACUUM_PERMITTIVITY * self.electrode[0] * self.electrode[1]
    }

    /// Equivalent gap at rest of capacitor `i`: air + insulation/ε_r, m.
    pub fn rest_gap(&self, i: usize) -> f64 {
        self.air_gap[i] + self.insulation_gap
    }

    /// Capacitance at rest of capacitor `i`, F.
    pub fn rest_capacitance(&self, i: usize) -> f64 {
        self.beside_the_plate(i, self.air_gap[i]) + self.plate_capacitance(i)
    }

    /// Capacitance of the plate pair `i` at rest, F: without edges and what is parallel.
    pub fn plate_capacitance(&self, i: usize) -> f64 {
        self.permittivity_area() / self.rest_gap(i)
    }

    /// What the edges of capacitor `i` add at rest, without their corners, F; `None` where
    /// a parallel capacitance stands for them.
    pub fn edge_capacitance(&self, i: usize) -> Option<f64> {
        let edges = self.edges?;
        Some(edges.parallel(self.electrode, self.air_gap[i]))
    }

    /// Slope of the capacitance `i` against its air gap after the motion `deformation`, for
    /// a tile that stays as it is tilted, F/m; `None` when a tile touches.
    pub fn slope_after(&self, i: usize, deformation: &ThreeAxisDeformation) -> Option<f64> {
        // Of the edges only those of this tile.
        let plates = Self {
            edges: None,
            ..*self
        };
        let slopes = plates.respond_with_slopes(deformation)?;
        let air = self.air_gap[i] - deformation.closing[i];
        let edges = self.edges_at(i, air, deformation.slope);
        Some(-(slopes.by_closing[i] - edges.by_air_gap))
    }

    /// What `edges` add to capacitor `i` after the motion `deformation`, with their corners, F.
    pub fn edge_reading(
        &self,
        edges: TileEdges,
        i: usize,
        deformation: &ThreeAxisDeformation,
    ) -> f64 {
        let plates = Self {
            edges: Some(edges),
            ..*self
        };
        let air = self.air_gap[i] - deformation.closing[i];
        plates.edges_at(i, air, deformation.slope).capacitance
    }

    /// Slope of the capacitance `i` against its air gap at rest, F/m.
    pub fn slope_by_air_gap(&self, i: usize) -> f64 {
        let edges = self.edges_at(i, self.air_gap[i], [0.0; 2]);
        edges.by_air_gap - self.plate_capacitance(i) / self.rest_gap(i)
    }

    /// Closing that an effective gap reads per closing of the air gap of capacitor `i`, where
    /// the reader takes the whole capacitance for that of a plate: from the raw capacitance,
    /// d/dw of ε₀A (1/C₀ − 1/C), and from the normalised one, g₀ (1 − C₀/C) with
    /// g₀ = a + d/ε_r.
    ///
    /// A displacement that was read so, over its factor, is the closing; a stiffness that was
    /// read so, times its factor, is that of the closing. Both are 1 for plates alone.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
    /// let plates = sensor.three_axis().unwrap().unit_model().plates;
    /// let [raw, normalised] = plates.effective_gap_factors(0);
    /// assert!((raw - 0.755).abs() < 5e-3 && (normalised - 0.896).abs() < 5e-3);
    /// ```
    pub fn effective_gap_factors(&self, i: usize) -> [f64; 2] {
        let (total, slope) = (self.rest_capacitance(i), -self.slope_by_air_gap(i));
        [
            self.permittivity_area() * slope / (total * total),
            self.rest_gap(i) * slope / total,
        ]
    }

    /// Largest capacitance of capacitor `i`, F: no air left over the whole
    /// tile; infinite without insulation.
    pub fn closed_capacitance(&self, i: usize) -> f64 {
        self.beside_the_plate(i, 0.0) + self.permittivity_area() / self.insulation_gap
    }

    /// Capacitance `i` of a parallel tile that came nearer by `closing`, m, in F.
    pub fn parallel_reading(&self, i: usize, closing: f64) -> f64 {
        let gap = self.rest_gap(i) - closing;
        self.beside_the_plate(i, self.air_gap[i] - closing) + self.permittivity_area() / gap
    }

    /// Air gap, m, at which a parallel tile has the capacitance `reading`, F, at `i`: not a
    /// number where there is none.
    ///
    /// g = ε₀ab/(C − C_par − C_edge), where C_edge follows from the gap itself: a few steps
    /// of Newton's method.
    pub fn air_gap_from(&self, i: usize, reading: f64) -> f64 {
        self.air_gap_near(i, self.beside_the_plate(i, self.air_gap[i]), reading)
    }

    /// The same, with what is parallel to the plate pair at its air gap, F.
    fn air_gap_near(&self, i: usize, beside: f64, reading: f64) -> f64 {
        let mut air = self.air_gap[i];
        let plate = reading - beside;
        let first = self.permittivity_area() / plate - self.insulation_gap;
        if self.edges.is_none() {
            return first;
        }
        if first.is_finite() && first > 0.0 && plate > 0.0 {
            air = first;
        }
        for _ in 0..MOST_STEPS {
            let gap = air + self.insulation_gap;
            let edges = self.edges_at(i, air, [0.0; 2]);
            let plate = self.permittivity_area() / gap;
            let slope = edges.by_air_gap - plate / gap;
            let step = (reading - plate - edges.capacitance - self.parallel_capacitance[i]) / slope;
            // The capacitance bends upward: from a gap that is too wide a step goes too far.
            let next = air + step.max(-0.75 * gap);
            if !next.is_finite() {
                return f64::NAN;
            }
            air = next;
            if step.abs() <= 1e-14 * gap {
                return air;
            }
        }
        f64::NAN
    }

    /// The capacitance `rest` of capacitor `i`, F, as that from which closings are read.
    pub fn rest_reading(&self, i: usize, rest: f64) -> RestReading {
        let beside = self.beside_the_plate(i, self.air_gap[i]);
        RestReading {
            capacitance: rest,
            beside,
            air_gap: self.air_gap_near(i, beside, rest),
        }
    }

    /// Closing of a parallel tile `i` from rest to the capacitance `now`, m.
    pub fn effective_closing(&self, i: usize, rest: RestReading, now: f64) -> f64 {
        let beside = rest.beside;
        if self.edges.is_some() {
            let closing = rest.air_gap - self.air_gap_near(i, beside, now);
            if closing.is_finite() {
                return closing;
            }
        }
        let (rest, now) = (rest.capacitance - beside, now - beside);
        // The difference of the reciprocals without their cancellation.
        self.permittivity_area() * (now - rest) / (rest * now)
    }

    /// Nearly the closing of a parallel tile `i` from rest to the capacitance `now`, m: exact
    /// for plates alone, and to second order in what the edges change.
    pub fn nearly_closing(&self, i: usize, now: f64) -> f64 {
        let edges = self.edges_at(i, self.air_gap[i], [0.0; 2]);
        let now = now - self.parallel_capacitance[i] - edges.capacitance;
        let area = self.permittivity_area();
        let closing = self.rest_gap(i) - area / now;
        // The plates have less of the change than the reading: a step of Newton's method.
        let plate = now * now / area;
        closing * plate / (plate - edges.by_air_gap)
    }

    /// What is parallel to the plate pair `i` with `air` under a parallel tile, F.
    fn beside_the_plate(&self, i: usize, air: f64) -> f64 {
        self.parallel_capacitance[i] + self.edges_at(i, air, [0.0; 2]).capacitance
    }

    /// Edges of tile `i`, with `air` under its centre, m; nothing where they are not given.
    fn edges_at(&self, i: usize, air: f64, slope: [f64; 2]) -> EdgeSlopes {
        let none = EdgeSlopes {
            capacitance: 0.0,
            by_air_gap: 0.0,
            by_slope: [0.0; 2],
        };
        self.edges.map_or(none, |edges| {
            let sides = [SIDE_X[i], SIDE_Y[i]];
            let rise =
                std::array::from_fn(|axis| 0.5 * self.electrode[axis] * sides[axis] * slope[axis]);
            let at = edges.at(self.electrode, air, rise);
            EdgeSlopes {
                by_slope: std::array::from_fn(|axis| sides[axis] * at.by_slope[axis]),
                ..at
            }
        })
    }

    /// Smallest air gap over each tile, m; negative where the motion would
    /// push a tile into its electrode.
    pub fn air_gaps(&self, deformation: &ThreeAxisDeformation) -> [f64; 4] {
        let [p, q] = self.half_rise(deformation.slope);
        std::array::from_fn(|i| {
            let nearer = (p + q).max(deformation.bulge[i]);
            self.air_gap[i] - deformation.closing[i] - nearer
        })
    }

    /// Share of the motion, from rest, at which the first tile touches; 1 while
    /// all are open.
    pub fn open_share(&self, deformation: &ThreeAxisDeformation) -> f64 {
        let air = self.air_gaps(deformation);
        (0..4)
            .filter(|i| air[*i] < 0.0)
            .map(|i| self.air_gap[i] / (self.air_gap[i] - air[i]))
            .fold(1.0, f64::min)
    }

    /// Capacitances for a motion of the tiles.
    ///
    /// C_i = C_par,i + ε₀ab·m(d_air,i + d_ins/ε_ins − w_i, αa/2, βb/2) + ε₀ Σ l·e(a)
    /// (P2 section 4), the last with the air gap a at the middle of each edge. The motion ends where the first tile touches: beyond,
    /// all four capacitances stay as they are there.
    pub fn respond(&self, deformation: &ThreeAxisDeformation) -> ThreeAxisResponse {
        let share = self.open_share(deformation);
        let reached = deformation.at_share(share);
        let [p, q] = self.half_rise(reached.slope);
        let air = self.air_gaps(&reached);
        let plates = std::array::from_fn(|i| {
            // Rounding leaves a little air where the tile touches.
            let closed = air[i] <= 0.0 || (share < 1.0 && air[i] < TOUCHING * self.air_gap[i]);
            let (gap, least_air_gap) = if closed {
                // The hottest point touches: nearer than the corner of a plane tile.
                let gap = self.rest_gap(i) - reached.closing[i];
                (gap.max(self.insulation_gap + p + q), 0.0)
            } else {
                (self.rest_gap(i) - reached.closing[i], air[i])
            };
            let mean = mean_inverse_gap(gap, p, q).map_or(f64::INFINITY, |mean| mean.value);
            let edges = self.edges_at(i, gap - self.insulation_gap, reached.slope);
            let capacitance =
                self.parallel_capacitance[i] + edges.capacitance + self.permittivity_area() * mean;
            PlateReading {
                capacitance,
                least_air_gap,
            }
        });
        ThreeAxisResponse { plates }
    }

    /// Capacitances with their slopes, or `None` when a tile touches.
    pub fn respond_with_slopes(&self, deformation: &ThreeAxisDeformation) -> Option<PlateSlopes> {
        self.slopes_above(0.0, deformation)
    }

    /// The same formula continued past first contact, as if the insulation gave
    /// way to half of its thickness: a search may pass there. `None` beyond.
    pub fn respond_past_contact(&self, deformation: &ThreeAxisDeformation) -> Option<PlateSlopes> {
        self.slopes_above(-0.5 * self.insulation_gap, deformation)
    }

    /// Capacitances with their slopes while every air gap is above `least`, m.
    fn slopes_above(&self, least: f64, deformation: &ThreeAxisDeformation) -> Option<PlateSlopes> {
        if !self.air_gaps(deformation).iter().all(|air| *air > least) {
            return None;
        }
        let [p, q] = self.half_rise(deformation.slope);
        let gap = std::array::from_fn(|i| self.rest_gap(i) - deformation.closing[i]);
        let means = mean_inverse_gaps(gap, p, q)?;
        let scale = self.permittivity_area();
        let [by_x, by_y] = [0, 1]
            .map(|axis| scale * 0.5 * self.electrode[axis] * deformation.slope[axis].signum());
        let mut slopes = PlateSlopes {
            capacitance: std::array::from_fn(|i| {
                self.parallel_capacitance[i] + scale * means.value[i]
            }),
            by_closing: means.by_gap.map(|by_gap| -scale * by_gap),
            by_slope: [
                means.by_p.map(|by_p| by_x * by_p),
                means.by_q.map(|by_q| by_y * by_q),
            ],
        };
        if self.edges.is_some() {
            for i in 0..4 {
                let air = self.air_gap[i] - deformation.closing[i];
                let edges = self.edges_at(i, air, deformation.slope);
                slopes.capacitance[i] += edges.capacitance;
                slopes.by_closing[i] -= edges.by_air_gap;
                slopes.by_slope[0][i] += edges.by_slope[0];
                slopes.by_slope[1][i] += edges.by_slope[1];
            }
        }
        Some(slopes)
    }

    /// Half the rise of a tile along its two sides, m.
    fn half_rise(&self, slope: [f64; 2]) -> [f64; 2] {
        [
            0.5 * self.electrode[0] * slope[0].abs(),
            0.5 * self.electrode[1] * slope[1].abs(),
        ]
    }
}
