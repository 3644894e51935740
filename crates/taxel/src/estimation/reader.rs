//! Part of the estimator that each device adds: from readings to values.

use std::any::Any;
use std::borrow::Cow;

use super::baseline::Baseline;
use super::contact::Cell;
use super::{Certainty, ChannelFacts, ChannelReadings, State, Touch, Wiring};
use crate::acquisition::SignalUnit;
use crate::layout::Layout;

/// A quantity and the unit in which people read it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Name, such as `resistance`.
    pub quantity: Cow<'static, str>,
    /// Unit for people, such as `ohm`.
    pub symbol: Cow<'static, str>,
    /// SI value of one such unit.
    pub si_per_unit: f64,
}

impl Scale {
    /// A scale whose names are known beforehand.
    pub const fn new(quantity: &'static str, symbol: &'static str, si_per_unit: f64) -> Self {
        Self {
            quantity: Cow::Borrowed(quantity),
            symbol: Cow::Borrowed(symbol),
            si_per_unit,
        }
    }

    /// The scale of readings in frames of `unit`: that unit where it is one of the `usual`
    /// quantity, else the usual one.
    pub(crate) fn of(unit: &SignalUnit, usual: Self) -> Self {
        if unit.quantity.name() != usual.quantity {
            return usual;
        }
        Self {
            quantity: usual.quantity,
            symbol: unit.symbol.clone().into(),
            si_per_unit: unit.si_per_unit,
        }
    }
}

/// Colours of an image of taxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// From nothing to full scale through the colours of heat.
    Heat,
    /// From black to white by the size of the value.
    Grayscale,
    /// From nothing upwards, as maps of pressure are shown.
    Map,
}

impl Picture {
    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Heat => "heat",
            Self::Grayscale => "grayscale",
            Self::Map => "map",
        }
    }
}

/// Meaning of the numbers of a [`Touch`], for people and programs.
#[derive(Debug, Clone, PartialEq)]
pub struct Meaning {
    /// Where the taxels are; without a pitch, a cell is one long.
    pub layout: Layout,
    /// True if the pitch is known; without it lengths are in cells.
    pub in_metres: bool,
    /// Name of each channel in the order of a frame, such as `row 0`.
    pub channels: Vec<String>,
    /// Which taxels the channels belong to.
    pub wiring: Wiring,
    /// Quantity of a channel, such as a resistance.
    pub reading: Scale,
    /// Quantity of a taxel's value, such as a force.
    pub value: Scale,
    /// Components of a value: 1 (pressing alone) or 3.
    pub components: usize,
    /// True if values of either sign occur in normal use.
    pub signed: bool,
    /// Value at the end of the colour scale, SI; none where it is not known.
    pub full_scale: Option<f64>,
    /// Value up to which the model was verified, SI, where that is stated.
    pub verified: Option<f64>,
    /// Colouring of the image of the taxels.
    pub picture: Picture,
    /// Factors that turn a sum of values into newtons: 1 for forces, the sides
    /// of a cell for pressures; none where values have no unit of force.
    pub newtons: Option<[f64; 2]>,
    /// True if the total force is a number of this device.
    pub total_known: bool,
}

impl Meaning {
    /// Unit of the forces of contacts.
    pub fn force_unit(&self) -> &'static str {
        match (self.newtons, &*self.value.quantity) {
            (Some(_), _) => "N",
            (None, "pressure") => "Pa",
            _ => "1",
        }
    }

    /// True if the values themselves add up, and their sum is not the total
    /// force.
    pub fn adds_up(&self) -> bool {
        self.components == 1
            && matches!(self.wiring, Wiring::PerTaxel(_))
            && self.newtons != Some([1.0; 2])
    }

    /// True if the values along z show tension as well as pressing. Nothing pulls on the others.
    pub fn pulls(&self) -> bool {
        self.signed && self.components == 1
    }

    /// Unit of positions.
    pub fn length_unit(&self) -> &'static str {
        if self.in_metres { "m" } else { "cells" }
    }

    /// Unit of the speeds of contacts.
    pub fn speed_unit(&self) -> &'static str {
        if self.in_metres { "m/s" } else { "cells/s" }
    }

    /// Spacing of rows and of columns, m, where it is known.
    pub fn pitch(&self) -> Option<[f64; 2]> {
        let [x, y] = self.layout.pitch;
        self.in_metres.then_some([y, x])
    }
}

/// From which value on a taxel is touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Threshold {
    /// Above so many standard deviations of the taxel, and above a least value, SI.
    Deviations(f64, f64),
    /// Above this value, SI.
    Fixed(f64),
}

impl Threshold {
    /// The threshold of a taxel with this standard deviation, SI.
    pub(super) fn of(self, deviation: f64) -> f64 {
        match self {
            Self::Deviations(deviations, least) => least.max(deviations * deviation),
            Self::Fixed(threshold) => threshold,
        }
    }

    /// False if no taxel is touched by itself: the reader alone knows the contacts.
    pub(super) fn is_reached(self) -> bool {
        self != Self::Fixed(f64::INFINITY)
    }
}

/// How touched taxels are divided into contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Division {
    /// Each prominent peak is a contact: two fingers side by side are two.
    Peaks,
    /// All that hangs together, over a gap of one taxel too, is one contact, as on a map
    /// whose cells are finer than what presses.
    Regions {
        /// Taxels of the smallest region.
        least: usize,
    },
}

/// Which total an array has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Total {
    /// Over the taxels that count; those left out are counted.
    Counted,
    /// Known only while every taxel in use is: a reading is shared by several.
    Certain,
    /// None: the values do not add up.
    Unknown,
}

/// Rules of a rest capture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRules {
    /// Why the device takes none; the reason stands in the refusal.
    pub refused: Option<&'static str>,
    /// True if one is taken at the start of a run.
    pub at_start: bool,
    /// Channels that make one unit: a unit is captured whole or not at all.
    pub channels_per_unit: usize,
    /// Name of such a unit in messages.
    pub unit: &'static str,
    /// True if the noise of the readings is taken from the capture too.
    pub measures_noise: bool,
    /// True if a capture ends when a touch begins, with what came before it.
    pub ends_at_touch: bool,
}

/// How the readings of the empty device drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drift {
    /// They do not, or it does not show.
    None,
    /// They do, and are followed: a reading that leaves its baseline may be a contact.
    Followed,
    /// The same, but a contact that the reader knows ([`Reader::occupied`]) holds a channel that
    /// comes back to where it was.
    HeldByContact,
    /// They are followed wherever no contact is, which the reader knows
    /// ([`Reader::occupied`]).
    WithoutContact {
        /// Time between frames, s.
        period: f64,
    },
}

/// Rules of a device for the shared estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// When a taxel is touched.
    pub threshold: Threshold,
    /// Which touched taxels are one contact.
    pub division: Division,
    /// States whose value is part of totals and contacts, by code; a bound always is.
    pub counted: [bool; State::ALL.len()],
    /// Which total there is.
    pub total: Total,
    /// Drift of the readings of the empty device.
    pub drift: Drift,
    /// The rest capture.
    pub rest: RestRules,
}

/// A table of [`Rules::counted`].
pub(crate) fn counting(states: &[State]) -> [bool; State::ALL.len()] {
    let mut counted = [false; State::ALL.len()];
    for state in states {
        counted[*state as usize] = true;
    }
    counted
}

/// Knowledge of the channels when a frame is read.
#[derive(Debug, Clone, Copy)]
pub struct Known<'a> {
    /// Seconds since the frame before; `None` for the first, or after the
    /// device began anew.
    pub elapsed: Option<f64>,
    /// Standard deviation of one reading of each channel, SI.
    pub noise: &'a [f64],
    /// Readings of the empty device as they drift; none for a device whose
    /// readings do not.
    pub baseline: Option<&'a Baseline>,
    /// True if a rest capture is under way.
    pub capturing: bool,
}

impl Known<'_> {
    /// Drift of a channel since its rest value was taken, SI.
    #[inline]
    pub fn drift(&self, channel: usize) -> f64 {
        self.baseline
            .map_or(0.0, |baseline| baseline.drift(channel))
    }

    /// Variance of the reading that the empty channel would give, SI squared.
    #[inline]
    pub fn drift_variance(&self, channel: usize) -> f64 {
        self.baseline
            .map_or(0.0, |baseline| baseline.variance(channel))
    }
}

/// Turns the readings of one device into values of its taxels.
///
/// The estimator owns what is the same for all devices: masks, faults, rest
/// capture, baseline, segmentation, totals. A reader has the model of one
/// device, and what that model remembers.
pub trait Reader: Any + Send {
    /// Meaning of readings and values; does not change.
    fn meaning(&self) -> &Meaning;

    /// Facts of each channel, in the order and unit of a frame.
    fn channels(&self) -> &[ChannelFacts];

    /// Takes the steps by which the wire gives the channels, in the unit of a frame: a coarse one
    /// hides noise.
    fn set_steps(&mut self, _steps: &[f64]) {}

    /// Rules for the device; do not change.
    fn rules(&self) -> Rules;

    /// Standard deviation of one reading of each channel as drawn, SI.
    fn noise(&self) -> Vec<f64>;

    /// Reading of each channel of the empty device, SI: the rest values in
    /// force; `NaN` where it is not known.
    fn rest(&self) -> Vec<f64>;

    /// True if a frame of this time, ns, can still be read. A device with a
    /// memory does not take one that is late.
    fn takes(&self, _time_ns: u64) -> bool {
        true
    }

    /// Converts the values of a frame to readings. The states come in as `Ok`
    /// or `Masked`; a reading at an end of the range becomes `Saturated`, one
    /// that the channel cannot give `Faulty`. Returns the number of readings at
    /// an end of the range, masked ones not counted.
    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize;

    /// Writes the value of each taxel, and which electrodes touch each other,
    /// from the readings of a frame. The taxels are those of the frame before.
    fn read(&mut self, known: &Known<'_>, touch: &mut Touch);

    /// Finds contacts by other means than touched cells that hang together, or
    /// their positions better than as centres of force; the contacts of the
    /// touched cells are in `touch`.
    fn locate(&mut self, _cells: &[Cell], _touch: &mut Touch) {}

    /// True if a contact may be on each channel, where the taxels do not say it.
    fn occupied(&self) -> Option<&[bool]> {
        None
    }

    /// Reading of each channel as it would be if its last touch had passed, SI, which the
    /// baseline takes where nothing occupies it; none where that is the reading itself.
    fn empty(&self) -> Option<&[f64]> {
        None
    }

    /// Why a unit cannot have these mean readings, SI, at rest (`NaN`: none);
    /// `None` when it can.
    fn rest_problem(&self, _unit: usize, _rest: &[f64]) -> Option<String> {
        None
    }

    /// Begins anew from a device whose channels read `rest` when empty, SI, with
    /// this noise; `NaN` where a channel is as drawn. The memory of the device
    /// begins anew.
    fn set_rest(&mut self, rest: &[f64], noise: &[f64]);

    /// Standard deviation of the value of a taxel by the noise of its channels alone, SI, where its
    /// covariance has more in it: what a touch must exceed. None where it has not.
    fn by_noise(&self, _taxel: usize) -> Option<f64> {
        None
    }

    /// The force that is held on a taxel whose `value` fades, with its standard deviation, SI; none
    /// where values do not fade.
    fn held(&self, _taxel: usize, _value: f64) -> Option<[f64; 2]> {
        None
    }

    /// Variance of the sum of the counted values, which is `sum`, SI squared, where their errors
    /// are not independent; none where they are.
    fn sum_variance(&self, _sum: f64) -> Option<f64> {
        None
    }

    /// True if a load reaches cells around it, so that contacts have a part in what cells that are not
    /// touched read; default false.
    fn spreads_loads(&self) -> bool {
        false
    }

    /// How much a total force says that is no sum of taxels.
    fn total_certainty(&self) -> Certainty {
        Certainty::Exact
    }

    /// Where a trained device was pressed in training: from and to along x and y, m. None of
    /// devices that know their whole area.
    fn trained_area(&self) -> Option<[[f64; 2]; 2]> {
        None
    }

    /// False for a taxel that the device does not have: nothing presses there.
    fn exists(&self, _taxel: usize) -> bool {
        true
    }

    /// Pairs of channels of a unit, one of which has changed places.
    fn swapped(&self, _unit: usize) -> &[[usize; 2]] {
        &[]
    }
}
