//! Four capacitors under one bump (P2): deformation to capacitance.

use schemars::JsonSchema;
use serde::Deserialize;

use super::tilted_plate::{VACUUM_PERMITTIVITY, mean_inverse_gap, mean_inverse_gaps};
use crate::mechanics::Deformation;
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
    /// one for all four, or a list for 11, 12, 21, 22.
    #[serde(deserialize_with = "quantity::one_or_list::<4, NonNegativeCapacitance, _>")]
    #[schemars(with = "OneOrList<4, NonNegativeCapacitance>")]
    pub parallel_capacitance: [f64; 4],
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
    /// Constant parallel capacitance, F.
    pub parallel_capacitance: [f64; 4],
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
pub struct Response {
    /// Capacitors 11, 12, 21, 22.
    pub plates: [PlateReading; 4],
}

impl Response {
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

impl PlatesDescription {
    /// The model this description states.
    pub fn model(&self) -> Plates {
        Plates {
            electrode: self.electrode,
            air_gap: self.air_gap,
            insulation_gap: self.insulation / self.insulation_permittivity,
            parallel_capacitance: self.parallel_capacitance,
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
        self.parallel_capacitance[i] + self.permittivity_area() / self.rest_gap(i)
    }

    /// Largest capacitance of capacitor `i`, F: no air left over the whole
    /// tile; infinite without insulation.
    pub fn closed_capacitance(&self, i: usize) -> f64 {
        self.parallel_capacitance[i] + self.permittivity_area() / self.insulation_gap
    }

    /// Smallest air gap over each tile, m; negative where the motion would
    /// push a tile into its electrode.
    pub fn air_gaps(&self, deformation: &Deformation) -> [f64; 4] {
        let [p, q] = self.half_rise(deformation.slope);
        std::array::from_fn(|i| self.air_gap[i] - deformation.closing[i] - p - q)
    }

    /// Share of the motion, from rest, at which the first tile touches; 1 while
    /// all are open.
    pub fn open_share(&self, deformation: &Deformation) -> f64 {
        let air = self.air_gaps(deformation);
        (0..4)
            .filter(|i| air[*i] < 0.0)
            .map(|i| self.air_gap[i] / (self.air_gap[i] - air[i]))
            .fold(1.0, f64::min)
    }

    /// Capacitances for a motion of the tiles.
    ///
    /// C_i = C_par,i + ε₀ab·m(d_air,i + d_ins/ε_ins − w_i, αa/2, βb/2)
    /// (P2 section 4). The motion ends where the first tile touches: beyond,
    /// all four capacitances stay as they are there.
    pub fn respond(&self, deformation: &Deformation) -> Response {
        let share = self.open_share(deformation);
        let reached = deformation.at_share(share);
        let [p, q] = self.half_rise(reached.slope);
        let air = self.air_gaps(&reached);
        let plates = std::array::from_fn(|i| {
            // Rounding leaves a little air where the tile touches.
            let closed = air[i] <= 0.0 || (share < 1.0 && air[i] < TOUCHING * self.air_gap[i]);
            let (gap, least_air_gap) = if closed {
                (self.insulation_gap + p + q, 0.0)
            } else {
                (self.rest_gap(i) - reached.closing[i], air[i])
            };
            let mean = mean_inverse_gap(gap, p, q).map_or(f64::INFINITY, |mean| mean.value);
            let capacitance = self.parallel_capacitance[i] + self.permittivity_area() * mean;
            PlateReading {
                capacitance,
                least_air_gap,
            }
        });
        Response { plates }
    }

    /// Capacitances with their slopes, or `None` when a tile touches.
    pub fn respond_with_slopes(&self, deformation: &Deformation) -> Option<PlateSlopes> {
        self.slopes_above(0.0, deformation)
    }

    /// The same formula continued past first contact, as if the insulation gave
    /// way to half of its thickness: a search may pass there. `None` beyond.
    pub fn respond_past_contact(&self, deformation: &Deformation) -> Option<PlateSlopes> {
        self.slopes_above(-0.5 * self.insulation_gap, deformation)
    }

    /// Capacitances with their slopes while every air gap is above `least`, m.
    fn slopes_above(&self, least: f64, deformation: &Deformation) -> Option<PlateSlopes> {
        if !self.air_gaps(deformation).iter().all(|air| *air > least) {
            return None;
        }
        let [p, q] = self.half_rise(deformation.slope);
        let gap = std::array::from_fn(|i| self.rest_gap(i) - deformation.closing[i]);
        let means = mean_inverse_gaps(gap, p, q)?;
        let scale = self.permittivity_area();
        let [by_x, by_y] = [0, 1]
            .map(|axis| scale * 0.5 * self.electrode[axis] * deformation.slope[axis].signum());
        Some(PlateSlopes {
            capacitance: std::array::from_fn(|i| {
                self.parallel_capacitance[i] + scale * means.value[i]
            }),
            by_closing: means.by_gap.map(|by_gap| -scale * by_gap),
            by_slope: [
                means.by_p.map(|by_p| by_x * by_p),
                means.by_q.map(|by_q| by_y * by_q),
            ],
        })
    }

    /// Half the rise of a tile along its two sides, m.
    fn half_rise(&self, slope: [f64; 2]) -> [f64; 2] {
        [
            0.5 * self.electrode[0] * slope[0].abs(),
            0.5 * self.electrode[1] * slope[1].abs(),
        ]
    }
}
