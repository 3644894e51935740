//! Stages: what lies between a load and the number of a frame, each a part of its own.
//!
//! ```text
//! load -> COVER -> CELL -> NETWORK -> READOUT -> number
//!                   |
//!                 MEMORY   what follows a load with a delay
//! ```
//!
//! A cover spreads the pressure on its surface over the cells below, a cell turns the pressure on
//! it into an electrical or physical value, a network joins the cells to channels, and a readout
//! makes the numbers of frames. Each part knows its own physics alone. [`Chain`] joins five of
//! them, and what a sensor needs is written once for all chains: prediction, facts, twin,
//! tolerances, information and the way back from a frame to pressures.
//!
//! A part of a user's own implements one of these traits and is registered with a key of the
//! sensor file ([`crate::device::Registry`]).

mod board;
mod body;
mod body_array;
mod cells;
mod chain;
mod force;
mod hysteresis;
mod in_plane;
mod layered;
mod lines;
mod magnet_field;
mod magnetic_skin;
mod memory;
mod one_to_one;
mod own;
mod points;
mod pressure_port;
mod resistor;
mod search;

use std::fmt;

use crate::drawing::View;
use crate::information::Information;
use crate::quantity::Dimension;
use crate::signal::NumberScale;
use taxel_ground::summary::Fact;
use taxel_numerics::least_squares::NORMAL_95;
use taxel_numerics::roots::ridders;

pub use board::{Board, LinearReadout};
pub use body::{BodyAxis, BodyChannel, BodyElement, BodyForce};
pub use body_array::{BodyArray, BodyMake};
pub use cells::{CellDescription, Cells, Share};
pub use chain::{Chain, ChainResponse, Parts};
pub use force::ForceCell;
pub use hysteresis::Hysteresis;
pub use in_plane::InPlaneCell;
pub use layered::{LayeredRubber, RubberLayer};
pub use lines::{Lines, NetworkDescription};
pub use magnet_field::{MagnetArray, MagnetMake, SuspendedMagnet};
pub use magnetic_skin::{
    MagnetCompliance, MagnetDescription, MagnetSuspension, MagneticSkin, MagneticSkinFabrication,
};
pub use memory::Creep;
pub use one_to_one::OneToOne;
pub use own::{OwnElement, OwnParts};
pub use points::{Point, PointReading, Points};
pub use pressure_port::PressurePort;
pub use resistor::{Conductance, Resistor};

/// A broken rule of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartError {
    /// Key below the element at which it is shown.
    pub key: String,
    /// The mistake, with its value and what is allowed.
    pub message: String,
    /// What to do.
    pub help: String,
}

/// A number of a part: what a calibration may fit and fabrication scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartParameter {
    /// Name, the same in sensor file, calibration and reports.
    pub name: &'static str,
    /// SI unit; empty for a plain number.
    pub unit: &'static str,
    /// Least and largest value that a calibration may find, SI.
    pub bounds: [f64; 2],
    /// True if readings under known loads can tell it.
    pub fitted: bool,
    /// True if it is each cell's own; false if all cells share it.
    pub per_cell: bool,
    /// True if its deviation is stated in its unit; false if over its value.
    pub absolute: bool,
}

impl PartParameter {
    /// How far a number of this value is off that is made within this deviation.
    pub fn off(&self, value: f64, deviation: f64) -> f64 {
        if self.absolute {
            deviation
        } else {
            deviation * value
        }
    }
}

/// What every part of a chain says of itself.
pub trait ChainPart: fmt::Debug + Send + Sync {
    /// Shows each number of the part to `each`, which may change it.
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let _ = each;
    }

    /// Quantities that follow from this part alone, for `taxel check`.
    fn facts(&self) -> Vec<Fact> {
        Vec::new()
    }

    /// Rules between the keys of the part.
    ///
    /// # Errors
    /// The first broken rule, at its key.
    fn check(&self) -> Result<(), PartError> {
        Ok(())
    }

    /// Views of the part to scale, below the view from above.
    fn views(&self) -> Vec<View> {
        Vec::new()
    }
}

/// Load on the surface to the loads at the cells.
pub trait Cover: ChainPart {
    /// A copy.
    fn boxed(&self) -> Box<dyn Cover>;

    /// Whether it can stand over cells at this pitch, m.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, pitch: [f64; 2]) -> Result<(), PartError> {
        let _ = pitch;
        Ok(())
    }

    /// Mean pressure on a cell of the sides `cell`, m, per uniform pressure on a rectangle of the
    /// sides `patch`, m, whose centre lies at each pair of offsets along x and y from that of the
    /// cell, m: for the first y all x, then for the next.
    fn shares(&self, cell: [f64; 2], patch: [f64; 2], offsets: [&[f64]; 2]) -> Vec<f64>;

    /// Distance beyond which a share counts as zero, m.
    fn reach(&self) -> f64;

    /// Standard deviation over all positions of a point load of what the cells of the pitch
    /// `pitch`, m, add up to, over the load: what their sum cannot say of a total force.
    fn sampling(&self, cell: [f64; 2], pitch: [f64; 2]) -> f64;

    /// State beyond what the cover is known for, under this pressure, Pa, on a rectangle of the
    /// sides `patch`, m; none within.
    fn beyond(&self, pressure: f64, patch: [f64; 2]) -> Option<&'static str> {
        let _ = (pressure, patch);
        None
    }
}

/// The quantity that a cell has.
#[derive(Debug, Clone, Copy)]
pub struct CellQuantity {
    /// Name in columns, such as `conductance`.
    pub name: &'static str,
    /// Its dimension; none of a plain number.
    pub dimension: Option<&'static Dimension>,
    /// Unit for people, its SI value, and the SI unit as it ends a key.
    pub unit: (&'static str, f64, &'static str),
}

/// What loads a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellLoad {
    /// The mean pressure over it, Pa.
    Pressure,
    /// The force on its taxel, N.
    Force,
}

/// How far a value says something of the load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellState {
    /// It belongs to one load.
    Ok,
    /// It lies on the side of the value at rest that no load leads to.
    BelowRest,
    /// It lies beyond the end of the law: the load is at least that of the end.
    Beyond,
    /// Several loads have this value; the stated one is the least, or the likeliest.
    Ambiguous,
    /// The reading is at an end of its range.
    Saturated,
    /// No such cell has this value.
    Impossible,
    /// The signals contradict each other or the model.
    Inconsistent,
}

/// What the value of a cell says of the load on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellEstimate {
    /// The load, Pa or N, or its bound; `NaN` where the value says nothing of it.
    pub load: f64,
    /// How much the standard deviation of the value moves it; negative where the value falls under
    /// load, `NaN` of a bound.
    pub deviation: f64,
    /// How far the value says something of the load.
    pub state: CellState,
}

impl CellEstimate {
    /// A least load, and why it is no more than that.
    pub fn bound(load: f64, state: CellState) -> Self {
        Self {
            load,
            deviation: f64::NAN,
            state,
        }
    }

    /// Nothing, and why.
    pub fn nothing(state: CellState) -> Self {
        Self::bound(f64::NAN, state)
    }
}

/// Load on a cell to its value: a curve that rises or falls all the way.
pub trait CellLaw: ChainPart {
    /// A copy.
    fn boxed(&self) -> Box<dyn CellLaw>;

    /// The law of each cell of an array, row by row; one alone is that of all.
    fn each(&self) -> Vec<Box<dyn CellLaw>> {
        vec![self.boxed()]
    }

    /// What the value is.
    fn quantity(&self) -> CellQuantity;

    /// What loads it; a pressure by default.
    fn load(&self) -> CellLoad {
        CellLoad::Pressure
    }

    /// Sides of the area that the load acts on, m; none where they are not known.
    fn area(&self) -> Option<[f64; 2]>;

    /// Value under `load`, SI. Below zero the curve goes on as its mirror image about the value at
    /// rest, so that noise about zero has a load of either sign.
    fn value(&self, load: f64) -> f64;

    /// The load of a value: the inverse of [`Self::value`] within `largest` of either sign; `NaN`
    /// beyond. By default the root of the curve, bracketed.
    fn inverse(&self, value: f64, largest: f64) -> f64 {
        searched(|load| self.value(load), value, largest)
    }

    /// The load at which the law ends, Pa or N; infinite of a law for all loads.
    fn largest(&self) -> f64 {
        f64::INFINITY
    }

    /// What a value with this standard deviation says of a load up to `largest`. Where a curve is
    /// steep at rest its slope says nothing, so that by default the interval is the image of the
    /// 95 % interval of the value.
    fn estimate(&self, value: f64, deviation: f64, largest: f64) -> CellEstimate {
        image(self, value, deviation, largest)
    }

    /// True if the value is the load: of boards that give it themselves. A reading at an end of the
    /// range is then a bound of the load.
    fn is_the_load(&self) -> bool {
        false
    }

    /// False if no load brings a reading to an end of its range: such a reading is a fault.
    fn saturates(&self) -> bool {
        true
    }

    /// The law of a cell whose value at rest is this one, where that tells more of it than an
    /// offset; by default none, and values are counted from it.
    fn at_rest(&self, value: f64) -> Option<Box<dyn CellLaw>> {
        let _ = value;
        None
    }

    /// Why the cell cannot have this value at rest, as the end of a sentence that begins with the
    /// cell; none when it can.
    fn rest_problem(&self, value: f64) -> Option<String> {
        let _ = value;
        None
    }

    /// What the stated deviation leaves out, for `taxel check`; none if nothing.
    fn caveat(&self) -> Option<&'static str> {
        None
    }
}

/// The load within `largest` of either sign whose value on `curve` is `value`; `NaN` if there is none.
fn searched(curve: impl Fn(f64) -> f64, value: f64, largest: f64) -> f64 {
    let [low, high] = [-largest, largest].map(&curve);
    if value.is_nan() || (value - low) * (value - high) > 0.0 {
        return f64::NAN;
    }
    let sign = (high - low).signum();
    ridders([-largest, largest], |load| sign * (curve(load) - value))
}

/// The load of a value with the image of its 95 % interval.
fn image<L: CellLaw + ?Sized>(law: &L, value: f64, deviation: f64, largest: f64) -> CellEstimate {
    let load = law.inverse(value, largest);
    if load.is_nan() {
        let rest = law.value(0.0);
        let rises = law.value(largest) > rest;
        return if (value > rest) == rises {
            CellEstimate::bound(largest, CellState::Beyond)
        } else {
            CellEstimate::nothing(CellState::BelowRest)
        };
    }
    let ends = [-NORMAL_95, NORMAL_95].map(|side| law.inverse(value + side * deviation, largest));
    let half = match ends.map(f64::is_nan) {
        [false, false] => 0.5 * (ends[1] - ends[0]),
        [false, true] => load - ends[0],
        [true, false] => ends[1] - load,
        // Any load of the law may have this value.
        [true, true] => return CellEstimate::bound(load, CellState::Ambiguous),
    };
    CellEstimate {
        load,
        deviation: half / NORMAL_95,
        state: CellState::Ok,
    }
}

/// What a network made of the signals of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inverted {
    /// Value of each cell, SI; `NaN` where no value gives the signals.
    pub values: Vec<f64>,
    /// Standard deviation of each, SI.
    pub deviations: Vec<f64>,
    /// The part of it by the noise of the signals of this frame, SI; empty where that is all of it.
    pub by_noise: Vec<f64>,
    /// Part of each independent signal's noise in each value, a row for each value; empty where
    /// the errors of the values are independent.
    pub spread: Vec<Vec<f64>>,
    /// How far each value says something of its load, by the signals together; empty where the law
    /// of the cell decides it alone.
    pub states: Vec<CellState>,
    /// How far the signals of each taxel are from what any load gives, in standard deviations; empty
    /// of a network that reads no more than it has cells.
    pub misfits: Vec<f64>,
    /// False if the search did not end.
    pub converged: bool,
}

impl Inverted {
    /// Covariance of two values, SI.
    pub fn covariance(&self, one: usize, other: usize) -> f64 {
        match (self.spread.get(one), self.spread.get(other)) {
            (Some(a), Some(b)) => a.iter().zip(b).map(|(a, b)| a * b).sum(),
            _ if one == other => self.deviations[one] * self.deviations[one],
            _ => 0.0,
        }
    }

    /// Variance of Σ `weights`·value, SI.
    pub fn variance_of_sum(&self, weights: &[f64]) -> f64 {
        if self.spread.is_empty() {
            let cells = self.deviations.iter().zip(weights);
            return cells
                .filter(|(_, w)| **w != 0.0)
                .map(|(sigma, w)| (w * sigma).powi(2))
                .sum();
        }
        let mut parts = vec![0.0; self.spread[0].len()];
        for (row, weight) in self.spread.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
            for (part, share) in parts.iter_mut().zip(row) {
                *part += weight * share;
            }
        }
        parts.iter().map(|part| part * part).sum()
    }
}

/// Values of all cells to the signals of the channels, by default one for each cell.
pub trait Network: ChainPart {
    /// A copy.
    fn boxed(&self) -> Box<dyn Network>;

    /// Whether it can join so many cells.
    ///
    /// # Errors
    /// Why not.
    fn joins(&self, count: usize) -> Result<(), PartError> {
        let _ = count;
        Ok(())
    }

    /// Number of channels that it makes of so many cells: the same number for each taxel.
    fn channels(&self, cells: usize) -> usize {
        cells
    }

    /// Name of a channel of a taxel, by its number; none where row, column and axis say it.
    fn channel_name(&self, of_taxel: usize) -> Option<&str> {
        let _ = of_taxel;
        None
    }

    /// The network whose cells read these signals without a load, where its own law says more than
    /// that their values are counted from it.
    fn at_rest(&self, signals: &[f64]) -> Option<Box<dyn Network>> {
        let _ = signals;
        None
    }

    /// True if its deviations have those of its fabrication in them.
    fn knows_its_make(&self) -> bool {
        false
    }

    /// What signals with the deviations `noise` say of the values of a taxel about these ones, beside
    /// all else that moves them; none of a network whose cells alone do.
    fn information(&self, values: &[f64], taxel: usize, noise: &[f64]) -> Option<Information> {
        let _ = (values, taxel, noise);
        None
    }

    /// Quantities of a taxel that lie between its values and its signals, for people.
    fn between(&self, taxel: usize, values: &[f64]) -> Vec<(CellQuantity, f64)> {
        let _ = (taxel, values);
        Vec::new()
    }

    /// Whether it joins cells with values of this kind.
    fn takes(&self, of_cell: CellQuantity) -> bool {
        let _ = of_cell;
        true
    }

    /// What the signals are.
    fn quantity(&self, of_cell: CellQuantity) -> CellQuantity;

    /// Signals of all channels, SI, at the values of all cells, row by row.
    fn read(&self, values: &[f64], signals: &mut [f64]);

    /// The values behind `signals` with the deviations `noise`, all SI. On entry `found` has the
    /// values to start from: those of the frame before. The network is that without the lines
    /// ([`Self::lines`]) all of whose signals are `NaN`, whose cells have no value.
    fn invert(&self, signals: &[f64], noise: &[f64], found: &mut Inverted);

    /// Cells of each line that several share: one that breaks takes them all with it. None by default.
    fn lines(&self) -> Vec<Vec<usize>> {
        Vec::new()
    }

    /// Quantities that need the cell's values at rest and at full load, for `taxel check`.
    fn facts_at(&self, rest: f64, pressed: f64) -> Vec<Fact> {
        let _ = (rest, pressed);
        Vec::new()
    }
}

/// Signal of a channel to the input of the last stage of the board, and its noise.
pub trait ReadoutLaw: ChainPart {
    /// A copy.
    fn boxed(&self) -> Box<dyn ReadoutLaw>;

    /// Input of the last stage at a signal, SI, as the board is.
    fn input(&self, signal: f64) -> f64;

    /// Signal that the board as drawn would have at this input of the last stage, SI.
    fn signal(&self, input: f64) -> f64;

    /// A standard deviation at the input of the last stage as one of the signal, SI.
    fn deviation(&self, of_input: f64) -> f64;

    /// Numbers of a frame to signals, from those to inputs of the last stage.
    fn scale(&self, last: NumberScale) -> NumberScale {
        let at_zero = self.signal(last.at_zero);
        NumberScale {
            at_zero,
            per_number: self.signal(last.input(1.0)) - at_zero,
            ..last
        }
    }

    /// Noise at the input of the last stage without that of the last stage itself, SI.
    fn noise(&self) -> f64;
}

/// What follows a load with a delay: the load at a cell under a load above it, and back.
pub trait Memory: fmt::Debug + Send + Sync {
    /// The load at the cell, `elapsed` s after the last call.
    fn respond(&mut self, pressure: f64, elapsed: f64) -> f64;

    /// The load above the cell from that at it, `elapsed` s after the last call, and the
    /// slope of the one by the other.
    fn recover(&mut self, cell_load: f64, elapsed: f64) -> [f64; 2];

    /// Time constants, s.
    fn times(&self) -> Vec<f64>;

    /// A memory of nothing, of the same law.
    fn fresh(&self) -> Box<dyn Memory>;
}
