//! What is solved of the elastic unit of P2, from its drawing.

use serde::{Deserialize, Serialize};

use super::elastic_unit::{UnitCompliance, UnitDrawing};

/// A unit under one normal force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressed {
    /// Force on the top of the whole unit, N.
    pub force: f64,
    /// Mean closing of the cavity between the electrodes, m.
    pub closing: f64,
    /// Least air gap, m; negative within the overlap that is accepted.
    pub least_gap: f64,
    /// Where it is at rest, x and y from the middle of the unit, m.
    pub least_at: [f64; 2],
    /// Share of the area between the electrodes on which floor and roof touch.
    pub touching: f64,
    /// Capacitance between the electrodes without edges, F: ε₀ ∫ dA/(air + insulation/ε_r) over
    /// the distances after deformation.
    pub capacitance: f64,
    /// Mean air gap along the edges of the electrode next to the wall and along the outer ones, m.
    pub edge_gaps: [f64; 2],
}

/// A unit with vented cavities under normal forces on its flat top, at large strain and with
/// contact of floor and roof.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedUnit {
    /// By rising force, from rest on; the first touch is one of them.
    pub states: Vec<Pressed>,
    /// At the force at which floor and roof of a cavity touch first; none below it.
    pub touch: Option<Pressed>,
    /// Why it ends before the largest force; none where it does not.
    pub ended: Option<String>,
}

impl PressedUnit {
    /// The unit under a normal force, N: straight lines between the solved states, of the
    /// capacitance those of its reciprocal, the effective gap; beyond the last state that one, a
    /// bound. `None` for a pull.
    pub fn at(&self, force: f64) -> Option<Pressed> {
        let next = self.states.partition_point(|state| state.force < force);
        let end = *self.states.get(next).or(self.states.last())?;
        if end.force <= force {
            return Some(end);
        }
        let start = self.states.get(next.checked_sub(1)?)?;
        let share = (force - start.force) / (end.force - start.force);
        let between = |a: f64, b: f64| a + share * (b - a);
        Some(Pressed {
            force,
            closing: between(start.closing, end.closing),
            least_gap: between(start.least_gap, end.least_gap),
            least_at: end.least_at,
            touching: between(start.touching, end.touching),
            capacitance: 1.0 / between(1.0 / start.capacitance, 1.0 / end.capacitance),
            edge_gaps: [0, 1].map(|edge| between(start.edge_gaps[edge], end.edge_gaps[edge])),
        })
    }
}

/// Closings per force of a drawing that no table has: solved once, and kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SolvedStiffness {
    /// Of a unit that is cut out of the array, and of one with mirror images beside it.
    pub sides: [UnitCompliance; 2],
}

impl SolvedStiffness {
    /// True of numbers that a unit may have.
    pub(crate) fn is_sound(&self) -> bool {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        self.sides.iter().all(|side| {
            let strips = side.strips.iter().flat_map(|strip| {
                let [a, b] = [strip.by_side_force, strip.by_downward_force];
                [a[0], a[1], b[0], b[1], strip.stick]
            });
            let [along, across] = side.tilt_x;
            let finite = [side.tilt_z, along, across];
            let mut all = strips.chain(finite);
            [side.c_zz, side.c_xx, side.hot_z, side.hot_x, side.error].map(positive) == [true; 5]
                && [side.volume_by_force, side.volume_by_pressure].map(positive) == [true; 2]
                && [side.opening_by_pressure, side.cavity_volume].map(positive) == [true; 2]
                && all.all(f64::is_finite)
        })
    }
}

impl UnitDrawing {
    /// True if the lengths make a unit: a wall, electrodes within their cavities, and a frame
    /// round these.
    pub fn is_unit(&self) -> bool {
        let rising = [
            0.0,
            self.wall_width,
            self.centre_distance - self.electrode,
            self.centre_distance + self.electrode,
            self.unit_side,
            self.pitch,
        ];
        let layers = self.lower_layer.min(self.upper_layer);
        let [inner, outer] = self.bump_bases();
        rising.windows(2).all(|pair| pair[0] < pair[1])
            && [
                self.bump_height,
                self.air_gap,
                self.insulation,
                self.electrode_thickness,
            ]
            .iter()
            .all(|length| *length > 0.0)
            && self.electrode_thickness < layers
            && self.bump_top > 0.0
            && self.bump_top <= self.bump_base
            && inner < self.bump_base
            && self.bump_base < outer
    }

    /// Sides between which a bump's base ends over the electrodes, where its cells and theirs meet, m.
    pub fn bump_bases(&self) -> [f64; 2] {
        [-1.0, 1.0].map(|side| self.centre_distance + side * self.electrode)
    }
}
