//! The way back of the in-plane capacitive sensor (P1): capacitance to compression and force, where
//! the curve allows.

use taxel_numerics::{MonotoneCurve, OnCurve, roots};

use super::in_plane_model::{InPlaneError, InPlaneModel, InPlaneState};

/// Where a curve of capacitance against compression turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// Compression of the first maximum of C₀ − C.
    pub maximum: f64,
    /// Compression of the lowest value behind it.
    pub minimum: f64,
}

/// Capacitance to compression and force.
#[derive(Debug, Clone, PartialEq)]
pub struct InPlaneInverse {
    model: InPlaneModel,
    /// Changes, F, and compressions between which a reading is looked for; rising.
    places: Vec<[f64; 2]>,
    last: InPlaneState,
    turning: Option<Turning>,
}

/// Parts of the range in which a compression is looked for: with these a search takes a third of
/// the steps.
const BRACKETS: usize = 64;

impl InPlaneModel {
    /// The way back from capacitance to force, with the range in which there
    /// is one.
    ///
    /// # Errors
    /// Those of [`InPlaneModel::check`].
    pub fn inverse(&self) -> Result<InPlaneInverse, InPlaneError> {
        self.check()?;
        // Up to its largest compression a checked device always responds.
        let change = |e: f64| self.respond(e).map_or(f64::NAN, |state| state.change);
        let range = roots::one_to_one(self.largest_compression(), change);
        let turning = range.first_maximum.zip(range.later_minimum);
        let place = |k: usize| range.end * k as f64 / BRACKETS as f64;
        let mut places: Vec<[f64; 2]> = (0..=BRACKETS)
            .map(|k| [change(place(k)), place(k)])
            .collect();
        // One-to-one curves rise; rounding of flat ones may not.
        places.dedup_by(|after, before| after[0] <= before[0]);
        Ok(InPlaneInverse {
            model: self.clone(),
            places,
            last: self.respond(range.end)?,
            turning: turning.map(|(maximum, minimum)| Turning { maximum, minimum }),
        })
    }
}

/// Compression below which the way back of a device is of no use.
const LEAST_RANGE: f64 = 1e-3;

impl InPlaneInverse {
    /// Checks that forces can be read over a range worth the name.
    ///
    /// # Errors
    /// [`InPlaneError::NotInvertible`].
    pub fn check(&self) -> Result<(), InPlaneError> {
        let compression = self.last.layer.kinematics.compression();
        if compression < LEAST_RANGE {
            return Err(InPlaneError::NotInvertible { compression });
        }
        Ok(())
    }

    /// The model that is inverted.
    pub fn model(&self) -> &InPlaneModel {
        &self.model
    }

    /// The last state whose capacitance belongs to one compression only.
    pub fn last(&self) -> &InPlaneState {
        &self.last
    }

    /// Where the curve turns, if that is what ends the range; otherwise the
    /// model ends there.
    pub fn turning(&self) -> Option<Turning> {
        self.turning
    }

    /// The state at a capacitance, F.
    ///
    /// # Errors
    /// [`InPlaneError::AboveRest`] and [`InPlaneError::BeyondInvertible`].
    pub fn state_from_capacitance(&self, capacitance: f64) -> Result<InPlaneState, InPlaneError> {
        let rest = self.model.rest_capacitance();
        if capacitance > rest {
            return Err(InPlaneError::AboveRest { capacitance, rest });
        }
        self.state_from_change(rest - capacitance)
    }

    /// The force at a fall C₀ − C of the capacitance, N: odd in it, so that
    /// noise about zero has no bias; beyond the range the force at its end.
    pub fn force_from_change(&self, change: f64) -> f64 {
        let inside = change.abs().min(self.last.change);
        let force = self
            .state_from_change(inside)
            .map_or(f64::NAN, |state| state.layer.force);
        force.copysign(change)
    }

    /// The state at a fall C₀ − C of the capacitance, F.
    ///
    /// # Errors
    /// As [`InPlaneInverse::state_from_capacitance`].
    pub fn state_from_change(&self, change: f64) -> Result<InPlaneState, InPlaneError> {
        let rest = self.model.rest_capacitance();
        if change < 0.0 {
            let capacitance = rest - change;
            return Err(InPlaneError::AboveRest { capacitance, rest });
        }
        let compression = self.last.layer.kinematics.compression();
        // A value that is not a number is beyond, too.
        if !(0.0..=self.last.change).contains(&change) {
            return Err(InPlaneError::BeyondInvertible {
                change,
                limit: self.last.change,
                compression,
            });
        }
        let misfit = |e: f64| {
            let state = self.model.respond(e);
            state.map_or(f64::NAN, |state| state.change) - change
        };
        let above = self.places.partition_point(|[known, _]| *known < change);
        let place = |at: Option<&[f64; 2]>, end: f64| at.map_or(end, |[_, place]| *place);
        let bracket = [
            place(above.checked_sub(1).and_then(|k| self.places.get(k)), 0.0),
            place(self.places.get(above), compression),
        ];
        self.model.respond(roots::ridders(bracket, misfit))
    }
}

/// Force against the fall of the capacitance, found once and then looked up: for the frames of an
/// array.
///
/// Between states of the model lie cubics with its slopes; states are added until the cubics pass
/// halfway between them within 1e-8 of the force at the end of the range. With those as nodes, too, a
/// force is within 1e-7 of it, also beside the kinks of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceCurve {
    inverse: InPlaneInverse,
    /// N against F, from rest on; none of a range without width.
    curve: Option<MonotoneCurve>,
}

/// Largest error of the cubics of a [`ForceCurve`] halfway, as a share of the force at the end of its range.
const CURVE_TOLERANCE: f64 = 1e-8;
/// Halvings of a part of the range: the published law has no slope at rest.
const MOST_HALVINGS: usize = 24;

/// A state of the model on a [`ForceCurve`].
#[derive(Debug, Clone, Copy)]
struct Node {
    compression: f64,
    /// Change of the capacitance, F, and force, N.
    point: [f64; 2],
    /// Force per change, N/F.
    slope: f64,
}

impl ForceCurve {
    /// The curve of a way back.
    pub fn new(inverse: InPlaneInverse) -> Self {
        let mut nodes = vec![inverse.node(0.0)];
        for place in inverse.places.iter().skip(1) {
            let left = nodes[nodes.len() - 1];
            inverse.add_nodes(left, inverse.node(place[1]), MOST_HALVINGS, &mut nodes);
        }
        // Rounding of a flat curve may not rise.
        nodes.dedup_by(|after, before| (0..2).any(|k| after.point[k] <= before.point[k]));
        let points = nodes.iter().map(|node| node.point).collect();
        let slopes: Vec<f64> = nodes.iter().map(|node| node.slope).collect();
        Self {
            curve: MonotoneCurve::with_slopes(points, &slopes).ok(),
            inverse,
        }
    }

    /// The way back that it is the curve of.
    pub fn inverse(&self) -> &InPlaneInverse {
        &self.inverse
    }

    /// As [`InPlaneInverse::force_from_change`], looked up.
    pub fn force(&self, change: f64) -> f64 {
        let force = match self.curve.as_ref().map(|curve| curve.at(change.abs())) {
            Some(OnCurve::Inside { value, .. }) => value,
            Some(OnCurve::Below(end) | OnCurve::Above(end)) => end[1],
            None => self.inverse.last.layer.force,
        };
        force.copysign(change)
    }
}

impl InPlaneInverse {
    fn node(&self, compression: f64) -> Node {
        // Up to its end a checked range always responds.
        let point = |e: f64| {
            let state = self.model.respond(e);
            state.map_or([f64::NAN; 2], |state| [state.change, state.layer.force])
        };
        let end = self.last.layer.kinematics.compression();
        // The published law bends ever more sharply towards rest.
        let step = (0.1 * compression).clamp(1e-7, 1e-5);
        let [low, high] =
            [compression - step, compression + step].map(|e| point(e.clamp(0.0, end)));
        Node {
            compression,
            point: point(compression),
            slope: (high[1] - low[1]) / (high[0] - low[0]),
        }
    }

    /// Adds what a curve needs from `left`, which is there, to `right`.
    fn add_nodes(&self, left: Node, right: Node, halvings: usize, nodes: &mut Vec<Node>) {
        let middle = self.node(0.5 * (left.compression + right.compression));
        let cubic =
            MonotoneCurve::with_slopes(vec![left.point, right.point], &[left.slope, right.slope]);
        let tolerance = CURVE_TOLERANCE * self.last.layer.force;
        // Points that make no curve are flat to rounding.
        let off = cubic.map_or(0.0, |cubic| match cubic.at(middle.point[0]) {
            OnCurve::Inside { value, .. } => (value - middle.point[1]).abs(),
            OnCurve::Below(_) | OnCurve::Above(_) => 0.0,
        });
        if off > tolerance && halvings > 0 {
            self.add_nodes(left, middle, halvings - 1, nodes);
            self.add_nodes(middle, right, halvings - 1, nodes);
        } else {
            nodes.extend([middle, right]);
        }
    }
}
