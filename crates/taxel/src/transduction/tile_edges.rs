//! The edges of a tile of a three-axis unit (P2): what they add to the capacitance of the
//! plates, by a law of the air gap and by a solution of the electric field.

use taxel_fem::field::FieldError;
use taxel_fem::field::cases::{Beside, FacingPlates, Neighbour};

use super::tilted_plate::VACUUM_PERMITTIVITY;

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

/// The section across one straight edge. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSection {
    /// Air between tile and insulation.
    pub air_gap: f64,
    /// Insulation on the lower electrode.
    pub insulation: f64,
    /// Relative permittivity of the insulation and of the layers around the electrodes.
    pub permittivity: f64,
    /// Thickness of an electrode.
    pub electrode_thickness: f64,
    /// Half of the width of an electrode.
    pub half_width: f64,
    /// Air beyond the edge, up to the wall.
    pub cavity: f64,
    /// What stands beside.
    pub environment: EdgeEnvironment,
    /// Solid above the air gap, the upper electrode included; air above it.
    pub above: f64,
    /// A grounded plane under the lower layer.
    pub grounded_plane: bool,
}

/// Width of a neighbour and solid below the lower electrode of the drawing, m.
const NEIGHBOUR_WIDTH: f64 = 400e-6;
const BELOW: f64 = 280e-6;
/// Where the field ends beyond the last cavity, m. It ends at the lower face of the solid too.
const MARGIN: f64 = 900e-6;
/// Air above the solid up to where the field ends, m. Chosen so that the drawn section at 6 um
/// agrees with the reference; from 300 to 900 um of air its excesses change by at most 0.7 %.
const AIR_ABOVE: f64 = 400e-6;
/// Refinement of the mesh: one step finer changes an excess of the drawing by 2e-4.
const LEVEL: u32 = 2;

impl EdgeSection {
    /// The section that P2 draws, with this air gap, m, and these surroundings.
    pub fn drawn(air_gap: f64, environment: EdgeEnvironment) -> Self {
        Self {
            air_gap,
            insulation: 6e-6,
            permittivity: 2.7,
            electrode_thickness: 20e-6,
            half_width: 200e-6,
            cavity: 100e-6,
            environment,
            above: 400e-6,
            grounded_plane: false,
        }
    }

    /// The excess e of one edge by finite elements: C = ε₀A/(a + d/ε_r) + ε₀ Σ l e over
    /// the edges of length l. Without unit.
    ///
    /// # Errors
    /// [`FieldError`] for lengths out of range.
    pub fn solve(&self) -> Result<f64, FieldError> {
        let beside = |distance| Neighbour {
            distance: distance / self.air_gap,
            width: NEIGHBOUR_WIDTH / self.air_gap,
        };
        let over = |length: f64| length / self.air_gap;
        FacingPlates {
            air: 1.0,
            insulation: over(self.insulation),
            permittivity: self.permittivity,
            plate: over(self.electrode_thickness),
            half_width: over(self.half_width),
            cavity: over(self.cavity),
            beside: match self.environment {
                EdgeEnvironment::Isolated => Beside::Nothing,
                EdgeEnvironment::Grounded(distance) => Beside::Grounded(beside(distance)),
                EdgeEnvironment::Row(distance) => Beside::Driven(beside(distance)),
            },
            above: over(self.above),
            below: over(BELOW),
            grounded_plane: self.grounded_plane,
            margin: over(MARGIN),
            air_above: over(AIR_ABOVE),
        }
        .edge_excess(LEVEL)
    }
}

/// The excess of an edge against the air gap a, e = p − q ln(a + s) with a in um: valid
/// for 2 to 8 um, all other lengths as P2 draws them.
#[derive(Debug, Clone, Copy, PartialEq)]
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

impl EdgeLaw {
    /// Air gaps of the fit, m.
    pub const AIR_GAPS: std::ops::RangeInclusive<f64> = 2e-6..=8e-6;
    /// No neighbour.
    pub const ISOLATED: Self = Self::new(4.2501, 0.6562, 1.6);
    /// A grounded neighbour at 300 um: the other tile of the unit.
    pub const GROUNDED_300: Self = Self::new(3.4360, 0.6746, 1.7);
    /// A grounded neighbour at 900 um: the next unit.
    pub const GROUNDED_900: Self = Self::new(3.8510, 0.6713, 1.7);
    /// The other tile of the unit, in the driven row.
    pub const ROW_300: Self = Self::new(4.0762, 0.7045, 1.8);
    /// The next unit, in the driven row.
    pub const ROW_900: Self = Self::new(4.2296, 0.6586, 1.6);

    const fn new(constant: f64, factor: f64, shift: f64) -> Self {
        Self {
            constant,
            factor,
            shift,
        }
    }

    /// The excess at an air gap, m. Without unit.
    pub fn excess(self, air_gap: f64) -> f64 {
        self.constant - self.factor * (air_gap / UM + self.shift).ln()
    }

    /// The slope of the excess against the air gap, 1/m.
    pub fn slope(self, air_gap: f64) -> f64 {
        -self.factor / ((air_gap / UM + self.shift) * UM)
    }
}

/// What the four corners of a tile add, F: negative, the edges count them twice. From the
/// field of one isolated capacitor in space, P2 as drawn.
pub const CORNERS: f64 = -0.43e-15;
/// A tile with its edges: sides as drawn in P2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileWithEdges {
    /// Side of the square electrode, m.
    pub side: f64,
    /// Insulation over its relative permittivity, m.
    pub insulation_gap: f64,
}

impl TileWithEdges {
    /// Capacitance of the plates without edges, F.
    pub fn plate(&self, air_gap: f64) -> f64 {
        VACUUM_PERMITTIVITY * self.side * self.side / (air_gap + self.insulation_gap)
    }

    /// What two edges towards the unit and two outward ones add, F.
    pub fn edges(&self, air_gap: f64, [inner, outer]: [EdgeLaw; 2]) -> f64 {
        2.0 * VACUUM_PERMITTIVITY * self.side * (inner.excess(air_gap) + outer.excess(air_gap))
    }

    /// All neighbours grounded: plates, edges and corners, F.
    pub fn total(&self, air_gap: f64) -> f64 {
        self.plate(air_gap) + self.edges(air_gap, GROUNDED) + CORNERS
    }

    /// Slope of [`TileWithEdges::total`] against the air gap, F/m.
    pub fn slope(&self, air_gap: f64) -> f64 {
        let edges: f64 = GROUNDED.map(|law| law.slope(air_gap)).iter().sum();
        -self.plate(air_gap) / (air_gap + self.insulation_gap)
            + 2.0 * VACUUM_PERMITTIVITY * self.side * edges
    }

    /// Least and greatest capacitance by the surroundings, before the corners, F: a
    /// grounded plane under the array, whose field is solved, and a capacitor alone.
    ///
    /// # Errors
    /// [`FieldError`] for air gaps out of range.
    pub fn surroundings(&self, air_gap: f64) -> Result<[f64; 2], FieldError> {
        let over_plane = |distance| {
            EdgeSection {
                grounded_plane: true,
                ..EdgeSection::drawn(air_gap, EdgeEnvironment::Grounded(distance))
            }
            .solve()
        };
        let excess = over_plane(INNER_DISTANCE)? + over_plane(OUTER_DISTANCE)?;
        let least = 2.0 * VACUUM_PERMITTIVITY * self.side * excess;
        let greatest = self.edges(air_gap, [EdgeLaw::ISOLATED; 2]);
        Ok([least, greatest].map(|edges| self.plate(air_gap) + edges))
    }

    /// Closing that an effective gap reads per closing of the air gap: from the raw
    /// capacitance, d/dw of ε₀A (1/C₀ − 1/C), and from the normalised one, g₀ (1 − C₀/C),
    /// with g₀ = a + d/ε_r.
    pub fn effective_gap_factors(&self, air_gap: f64) -> [f64; 2] {
        let (total, slope) = (self.total(air_gap), -self.slope(air_gap));
        let gap = air_gap + self.insulation_gap;
        [
            VACUUM_PERMITTIVITY * self.side * self.side * slope / (total * total),
            gap * slope / total,
        ]
    }
}

/// Distance to the other tile of the unit, of [`EdgeLaw::GROUNDED_300`], m.
pub const INNER_DISTANCE: f64 = 300e-6;
/// Distance to the next unit, of [`EdgeLaw::GROUNDED_900`], m.
pub const OUTER_DISTANCE: f64 = 900e-6;
/// The edges of a tile among grounded neighbours: inner, outer.
pub const GROUNDED: [EdgeLaw; 2] = [EdgeLaw::GROUNDED_300, EdgeLaw::GROUNDED_900];
