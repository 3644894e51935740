//! Readings of a body without a physical model to a contact with its position
//! and force, through maps that were learned.

use std::cell::LazyCell;
use std::collections::VecDeque;

use super::baseline::{FASTEST_DRIFT, STEADY};
use super::contact::{Cell, Contact, normal_only};
use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch, UNKNOWN};
use super::zero_doubt::{PauseMean, ZeroDoubt};
use super::{Certainty, ChannelFacts, Wiring};
use crate::layout::{ArrayDescription, Layout, Mount};
use crate::signal::{NumberScale, Position};
use crate::trained::{
    BeyondTraining, CONTRADICTS, ChannelSlope, Component, Estimate, ForceEstimator, PlaceEstimator,
    PositionEstimate, PositionEstimator, RelationWatch, Support, TrainedMaps, TrainingError,
};

/// The area that can be touched, in cells; its middle is the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainedArea {
    /// Rows of cells; row 0 is at +y.
    pub rows: usize,
    /// Columns of cells; column 0 is at -x.
    pub columns: usize,
    /// Size of a cell along x and y, m.
    pub pitch: [f64; 2],
}

impl TrainedArea {
    /// Half of its sides along x and y, m.
    pub fn half_sides(&self) -> [f64; 2] {
        [
            0.5 * self.pitch[0] * self.columns as f64,
            0.5 * self.pitch[1] * self.rows as f64,
        ]
    }

    fn layout(&self) -> Layout {
        Layout::new(&ArrayDescription {
            rows: self.rows,
            columns: self.columns,
            pitch: self.pitch,
            mount: Mount::Flat,
        })
    }

    /// Covariance xx, xy, yy of a position that may be anywhere on it, m².
    fn anywhere(&self) -> [f64; 3] {
        let [x, y] = self.half_sides();
        [x * x / 3.0, 0.0, y * y / 3.0]
    }
}

/// There is a contact above this many deviations of the force.
const CONTACT_DEVIATIONS: f64 = 3.0;
/// Times over which the drift that pauses show is followed, s: where it is within what the maps err by
/// anyway, and where it is more.
const FOLLOW: [f64; 2] = [2000.0, 300.0];
/// A cell is of the contact from this share of it on.
const CELL_SHARE: f64 = 0.05;
/// Frames that are kept, so that new rest values make the memory of the force from them: those
/// of a rest capture at the start.
const KEPT: usize = 64;
/// Readings over those of training at rest within which the board is as it was.
const SAME_BOARD: [f64; 2] = [0.2, 5.0];
/// Share of the readings by which they may differ from a multiple of those of training.
const ANOTHER_SCALE: f64 = 0.5;

/// Reads a body without a physical model, as one contact.
///
/// A cell holds the share of the force (without a force map: of the contact)
/// that the estimated position and its covariance put into it. A position that
/// the maps do not determine is the middle of the area with the covariance of
/// anywhere.
#[derive(Debug, Clone)]
pub struct TrainedReader {
    maps: TrainedMaps,
    area: TrainedArea,
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    /// Numbers of a frame to readings.
    scale: NumberScale,
    masked: Vec<bool>,
    position: Option<PositionEstimator>,
    place: Option<PlaceEstimator>,
    force: Option<ForceEstimator>,
    /// Reading of each channel at rest.
    rest: Vec<f64>,
    /// The readings of a frame less the drift of the empty channels; those that are wrong or
    /// missing are what the others say.
    values: Vec<f64>,
    /// Standard deviation of those.
    replaced: Vec<f64>,
    /// Standard deviation of what is left of the drift of each channel.
    drifted: Vec<f64>,
    /// Force of the empty body for a drift of every channel by its deviation, N; `NaN` before it was
    /// looked at.
    per_drift: f64,
    /// What the baseline took of the drift of each channel, up to the last frame.
    of_baseline: Vec<f64>,
    /// By how much the scaled readings differ from all that the frames of training explain.
    unexplained: f64,
    /// True if they are unlike all of training.
    unlike: bool,
    watch: Option<RelationWatch>,
    /// True once the rest of the device was captured.
    rested: bool,
    /// Frames of the rest capture under way, and of the last one that came to its end.
    captured: [usize; 2],
    /// For how long nothing has touched for sure, s.
    free_for: f64,
    /// The last frames: time, s, and readings.
    recent: VecDeque<(f64, Vec<f64>)>,
    /// True for all channels unless nothing touches for sure, and has not for long: a light touch
    /// is no drift, nor is creep, nor what is unlike all training.
    occupied: Vec<bool>,
    /// Doubts about the zero of the force and of its other components.
    doubts: Vec<ZeroDoubt>,
    /// Those about the rest of each channel, of a body that does not creep.
    of_channels: Vec<ZeroDoubt>,
    found: Found,
    /// The last contact, until one surely has ended.
    held: Option<Contact>,
}

/// Estimates of the maps for one frame.
#[derive(Debug, Clone, Default)]
struct Found {
    position: Option<PositionEstimate>,
    force: Option<Estimate>,
    /// Other components with their deviations.
    components: Vec<(Component, [f64; 2])>,
    /// Force and components as the maps give them, with their deviations if the zeros are right.
    stated: Vec<[f64; 2]>,
    /// True if there is a contact; none where that is not known.
    contact: Option<bool>,
    /// True if the frame, or an estimate, is beyond what was trained: contacts and pauses are found as
    /// of any frame.
    beyond: bool,
    /// True if the force is surely greater than any of training: that is the least that presses.
    least: bool,
    /// Share of the contact in each cell.
    shares: Vec<f64>,
}

impl Found {
    fn state(&self) -> State {
        match self.force.map(|force| force.support) {
            Some(Support::Outside) => State::OutOfRange,
            Some(Support::Trained) if self.beyond => State::OutOfRange,
            _ => State::Ok,
        }
    }

    /// How much the force says: of what is beyond training no more than a bound is known. A frame that is only
    /// farther from those of training, as of a body that has crept longer, has a deviation that holds.
    fn certainty(&self) -> Certainty {
        match self.state() {
            State::OutOfRange if self.least => Certainty::AtLeast,
            State::OutOfRange if self.beyond => Certainty::Unknown,
            _ => Certainty::Exact,
        }
    }
}

impl TrainedReader {
    /// A reader of the device whose channels are called `names` and read on the scale
    /// `reading`. `full_scale` is the force at the end of the colours, N.
    ///
    /// # Errors
    /// [`TrainingError`] for maps that were changed by hand.
    pub fn new(
        maps: TrainedMaps,
        area: TrainedArea,
        names: Vec<String>,
        reading: Scale,
        full_scale: f64,
    ) -> Result<Self, TrainingError> {
        maps.check()?;
        // Without positions the area is one cell.
        let [x, y] = area.half_sides();
        let area = match maps.position {
            Some(_) => area,
            None => TrainedArea {
                rows: 1,
                columns: 1,
                pitch: [2.0 * x, 2.0 * y],
            },
        };
        let channels = names.len();
        let rest = maps.rest.as_ref().map(|rest| rest.mean.clone());
        Ok(Self {
            channels: facts(&maps, channels, &reading.symbol),
            scale: NumberScale::VALUES,
            masked: vec![false; area.rows * area.columns],
            values: vec![f64::NAN; channels],
            replaced: vec![0.0; channels],
            drifted: vec![0.0; channels],
            per_drift: f64::NAN,
            of_baseline: vec![0.0; channels],
            unexplained: 0.0,
            unlike: false,
            watch: maps.relation.clone().map(RelationWatch::new).transpose()?,
            rested: false,
            captured: [0; 2],
            free_for: 0.0,
            recent: VecDeque::with_capacity(KEPT),
            occupied: vec![false; channels],
            doubts: doubts(&maps),
            of_channels: vec![ZeroDoubt::default(); channels],
            meaning: meaning(&maps, &area, names, reading, full_scale),
            position: maps
                .position
                .clone()
                .map(PositionEstimator::new)
                .transpose()?,
            place: place_estimator(&maps, rest.clone())?,
            force: force_estimator(&maps, rest.clone())?,
            rest: rest.unwrap_or_else(|| vec![f64::NAN; channels]),
            found: Found::default(),
            held: None,
            area,
            maps,
        })
    }

    /// Shows no value in these cells, row by row, and does without these channels.
    #[must_use]
    pub fn with_masked(mut self, cells: impl IntoIterator<Item = bool>, channels: &[bool]) -> Self {
        for (own, masked) in self.masked.iter_mut().zip(cells) {
            *own = masked;
        }
        for (own, masked) in self.channels.iter_mut().zip(channels) {
            own.masked |= *masked;
        }
        self
    }

    /// Reads the numbers of an instrument by `scale`, with its range; `deviation` is that of
    /// one number, unless training found more of it at rest.
    #[must_use]
    pub fn with_instrument(mut self, scale: NumberScale, deviation: f64) -> Self {
        let found = self.maps.rest.iter().flat_map(|rest| &rest.deviation);
        let found = found.map(|reading| reading / scale.per_number.abs());
        let found = found.chain(std::iter::repeat(0.0));
        for (facts, found) in self.channels.iter_mut().zip(found) {
            facts.deviation = deviation.max(found);
            facts.resolution = scale.step;
            facts.span = scale.alive();
        }
        self.scale = scale;
        self
    }

    /// What the baseline has come to follow of a drift is not taken off twice.
    fn take_over(&mut self, known: &Known<'_>) {
        for (channel, last) in self.of_baseline.iter_mut().enumerate() {
            let now = known.drift(channel);
            if let Some(watch) = self.watch.as_mut().filter(|_| now != *last) {
                watch.give(channel, now - *last);
            }
            *last = now;
        }
    }

    /// Replaces readings that are missing or that the others contradict.
    fn watch(&mut self, known: &Known<'_>, channels: &mut ChannelReadings) {
        self.replaced.fill(0.0);
        self.unexplained = 0.0;
        self.unlike = false;
        channels.residuals.fill(f64::NAN);
        if self.another_scale(&channels.readings) {
            for (channel, value) in self.values.iter_mut().enumerate() {
                if channels.states[channel].usable() {
                    channels.states[channel] = ChannelState::Faulty;
                    channels.residuals[channel] = f64::INFINITY;
                }
                *value = f64::NAN;
            }
            return;
        }
        let Some(watch) = &mut self.watch else {
            return;
        };
        let tared = watch.relation().tared;
        let off = |rest: f64| if tared { rest } else { 0.0 };
        for (value, rest) in self.values.iter_mut().zip(&self.rest) {
            *value -= off(*rest);
        }
        let unknown = tared && (known.capturing || !self.rested);
        let elapsed = known.elapsed.unwrap_or(0.0);
        let judged = watch.judge(elapsed, &mut self.values, unknown).clone();
        self.unexplained = judged.unexplained;
        self.unlike = judged.unlike;
        for (at, channel) in watch.relation().standard.used.iter().enumerate() {
            self.replaced[*channel] = judged.deviation[at];
            if judged.left_out[at] && channels.states[*channel].usable() {
                channels.states[*channel] = ChannelState::Faulty;
                channels.residuals[*channel] = judged.scores[at].max(CONTRADICTS);
            }
        }
        for (value, rest) in self.values.iter_mut().zip(&self.rest) {
            *value += off(*rest);
        }
    }

    /// True if all readings are those of training on another scale, as in another unit or with
    /// another gain; only of a device that reads far from zero at rest.
    fn another_scale(&self, readings: &[f64]) -> bool {
        let (Some(rest), Some(watch)) = (&self.maps.rest, &self.watch) else {
            return false;
        };
        let standard = &watch.relation().standard;
        let used = || standard.used.iter().zip(&standard.scale);
        let sum = |of: &dyn Fn(usize, f64) -> f64| -> f64 {
            used().map(|(channel, scale)| of(*channel, *scale)).sum()
        };
        let square = sum(&|channel, _| rest.mean[channel].powi(2));
        let spread = sum(&|_, scale| scale * scale);
        if square < 25.0 * spread {
            return false;
        }
        let ratio = sum(&|channel, _| rest.mean[channel] * readings[channel]) / square;
        let [low, high] = SAME_BOARD;
        if !ratio.is_finite() || (low..=high).contains(&ratio) {
            return false;
        }
        let off = sum(&|channel, _| (readings[channel] - ratio * rest.mean[channel]).powi(2));
        off < (ANOTHER_SCALE * ratio).powi(2) * square
    }

    fn remember(&mut self, time: f64) {
        let mut slot = if self.recent.len() == KEPT {
            self.recent.pop_front().unwrap_or_default()
        } else {
            (0.0, Vec::new())
        };
        slot.0 = time;
        slot.1.clone_from(&self.values);
        self.recent.push_back(slot);
    }

    fn estimate(&mut self, time: f64) -> Result<Found, TrainingError> {
        let values = &self.values;
        let force = self.force.as_mut().map(|force| force.push(time, values));
        let mut force = force.transpose()?;
        let mut components = self
            .force
            .as_ref()
            .map(ForceEstimator::components)
            .unwrap_or_default();
        let (stated, beyond) = force
            .as_mut()
            .map(|force| self.doubt(force, &mut components))
            .unwrap_or_default();
        let least = beyond.pressed_harder && !self.unlike;
        if let Some((force, map)) = force.as_mut().zip(self.force.as_ref()).filter(|_| least) {
            (force.value, force.deviation) = (map.map().pressing.range[1], stated[0][1]);
        }
        let (beyond, harder) = (beyond.surely, beyond.pressed_harder);
        let open = self.replaced.iter().zip(&self.drifted);
        let open: Vec<f64> = open
            .map(|(replaced, drift)| replaced.hypot(*drift))
            .collect();
        let position = self.position.as_mut();
        // A frame unlike all training indentations determines no position.
        let tared = position
            .as_ref()
            .is_some_and(|position| position.map().tared);
        let moved: Vec<f64> = match &self.maps.rest {
            Some(trained) if tared => {
                let rests = self.rest.iter().zip(&trained.mean);
                let values = values.iter().zip(rests);
                values
                    .map(|(value, (own, trained))| value - own + trained)
                    .collect()
            }
            _ => values.clone(),
        };
        let position = position
            .map(|map| map.estimate_open(&moved, &open))
            .transpose()?;
        let place = self.place.as_mut();
        let place = place.map(|map| map.push(time, values, &open)).transpose()?;
        let by_pattern = place.is_some();
        // The surface knows depths; where a contact is the mixture says, if there is one.
        let depth = position.and_then(|position| position.depth);
        let position = place
            .map(|place| PositionEstimate { depth, ..place })
            .or(position);
        let trained = position.filter(|position| position.support == Support::Trained);
        let pressed =
            |force: &Estimate| self.shown(&stated, 0) > open_at(&stated, 0, force.deviation);
        let contact = match &force {
            Some(force) if pressed(force) || force.support == Support::Trained => {
                Some(pressed(force))
            }
            // A frame unlike all presses may be one of another depth, or none.
            _ => trained.map(|_| true),
        };
        // What leaves nothing to see at rest may be drift.
        let unlike = self.unlike && contact != Some(false);
        let outside = |force: &Estimate| force.support == Support::Outside;
        // A pattern without its size has a reach of its own, and channels that saturate change it.
        let far = if by_pattern {
            harder
        } else {
            beyond || force.as_ref().is_some_and(outside)
        };
        let beyond_position = unlike || far || trained.is_none();
        let beyond = beyond || unlike;
        // Where the readings are beyond training, the maps do not say how far a position is off.
        let position = position.map(|position| match self.area.anywhere() {
            [xx, xy, yy] if beyond_position => PositionEstimate {
                covariance: [[xx, xy], [xy, yy]],
                depth: None,
                ..position
            },
            _ => position,
        });
        Ok(Found {
            beyond,
            least,
            components,
            stated,
            shares: self.shares(position.as_ref(), contact),
            position,
            force,
            contact,
        })
    }

    /// True if surely nothing touches.
    fn is_free(&self) -> bool {
        let found = &self.found;
        let mut components = found.components.iter().zip(1..);
        let trained = |force: &Estimate| force.support == Support::Trained;
        found.contact == Some(false)
            && found.force.as_ref().is_some_and(trained)
            && components.all(|((_, [_, deviation]), number)| {
                self.shown(&found.stated, number).abs() < open_at(&found.stated, number, *deviation)
            })
    }

    /// What an estimate shows beyond what the empty body shows of late.
    fn shown(&self, stated: &[[f64; 2]], number: usize) -> f64 {
        stated[number][0] - self.doubts[number].level()
    }

    /// Widens the deviations of force and components by what is open about the readings, and by the
    /// doubts about their zeros; returns what was stated without drift and doubts, the force as the
    /// map gives it, and what is beyond training.
    fn doubt(
        &self,
        force: &mut Estimate,
        components: &mut [(Component, [f64; 2])],
    ) -> (Vec<[f64; 2]>, BeyondTraining) {
        let mut stated = vec![[force.value, force.deviation]];
        stated.extend(components.iter().map(|(_, estimate)| *estimate));
        let mut drift = vec![0.0; stated.len()];
        // They are found once, if at all.
        let slopes = LazyCell::new(|| {
            let map = self.force.as_ref();
            map.map_or_else(Vec::new, |map| map.slopes().collect())
        });
        if let Some(map) = &self.force {
            stated[0][0] = map.unbounded();
            let open = self.replaced.iter().chain(&self.drifted);
            if open.clone().any(|deviation| *deviation > 0.0) {
                for (number, slopes) in slopes.iter().enumerate() {
                    let of = |deviations: &[f64], slope: fn(&ChannelSlope) -> f64| {
                        let terms = slopes.iter().map(slope).zip(deviations);
                        let squares = terms.map(|(slope, deviation)| (slope * deviation).powi(2));
                        squares.sum::<f64>().sqrt()
                    };
                    let [_, deviation] = &mut stated[number];
                    *deviation = deviation.hypot(of(&self.replaced, |slope| slope.fast));
                    if !self.creeps() {
                        drift[number] = of(&self.drifted, |slope| slope.slow);
                    }
                }
            }
        }
        let deviations = components.iter_mut().map(|(_, [_, deviation])| deviation);
        let deviations = std::iter::once(&mut force.deviation).chain(deviations);
        let known = stated.iter().zip(drift).zip(&self.doubts);
        for (deviation, (([_, stated], drift), doubt)) in deviations.zip(known) {
            let zero = doubt.deviation().hypot(doubt.level());
            *deviation = stated.hypot(drift).hypot(zero);
        }
        // What is unlike training decides no contact.
        let Some(map) = &self.force else {
            return (stated, BeyondTraining::default());
        };
        let deviations =
            || std::iter::once(force.deviation).chain(components.iter().map(|(_, own)| own[1]));
        let estimates: Vec<[f64; 2]> = stated
            .iter()
            .zip(deviations())
            .map(|([value, _], deviation)| [*value, deviation])
            .collect();
        let beyond = map.beyond_training(self.unexplained, &estimates, || slopes.as_slice());
        let deviations = components.iter_mut().map(|(_, [_, deviation])| deviation);
        let deviations = std::iter::once(&mut force.deviation).chain(deviations);
        for (deviation, beyond) in deviations.zip(&beyond.deviations) {
            *deviation = deviation.hypot(*beyond);
        }
        (stated, beyond)
    }

    /// True if the body creeps so long after a contact that the baseline is held meanwhile.
    fn creeps(&self) -> bool {
        self.maps
            .rest
            .as_ref()
            .is_some_and(|rest| rest.recovery > 0.0)
    }

    /// Finds what is left of the drift of each channel: what the baseline does not know of it and what
    /// the channel shows of it in pauses; or, where creep would hide a drift from both, a drift of all
    /// channels by as many of their deviations as explains what the force shows in pauses.
    fn find_drift(&mut self, known: &Known<'_>) {
        let Some(rest) = &self.maps.rest else {
            return;
        };
        let doubt = self.doubts.first().map_or(0.0, ZeroDoubt::deviation);
        let share = doubt / self.per_drift;
        let creeps = rest.recovery > 0.0;
        // The rest that the drift counts from is a mean of so many readings.
        let frames = self.captured[1].max(1) as f64;
        for (channel, (drifted, own)) in self.drifted.iter_mut().zip(&rest.deviation).enumerate() {
            *drifted = if creeps {
                Some(share * own)
                    .filter(|drift| drift.is_finite())
                    .unwrap_or(0.0)
            } else if self.rested {
                let variance = known.drift_variance(channel) + own * own / frames;
                variance.sqrt().hypot(self.of_channels[channel].deviation())
            } else {
                known.drift_variance(channel).sqrt()
            };
        }
    }

    /// What a frame, `free` of contacts or not, says of the zero.
    fn look_at_zero(&mut self, elapsed: f64, free: bool) {
        if let Some(rest) = self.maps.rest.as_ref().filter(|_| self.rested) {
            let channels = self.of_channels.iter_mut().zip(&self.values);
            let at_rest = self.rest.iter().zip(&rest.deviation);
            for ((doubt, value), (rest, deviation)) in channels.zip(at_rest) {
                doubt.push(elapsed, free.then_some([value - rest, *deviation]));
            }
        }
        if let Some(watch) = &mut self.watch {
            if free && self.rested {
                watch.rest(elapsed);
            } else {
                watch.fade((-elapsed / STEADY).exp());
            }
        }
        let stated = self.found.stated.iter();
        let pauses: Vec<Option<PauseMean>> = self
            .doubts
            .iter_mut()
            .zip(stated)
            .map(|(doubt, stated)| doubt.push(elapsed, free.then_some(*stated)))
            .collect();
        if pauses.iter().any(Option::is_some) {
            self.look_at_pauses(&pauses);
        }
        if let Some(watch) = self.watch.as_mut().filter(|_| !free) {
            watch.forget_pause();
        }
    }

    /// What the pauses of the force and of its other components say of drift.
    fn look_at_pauses(&mut self, pauses: &[Option<PauseMean>]) {
        let (Some(rest), Some(map)) = (&self.maps.rest, &self.force) else {
            return;
        };
        let all: Vec<Vec<ChannelSlope>> = map.slopes().collect();
        for ((pause, doubt), slopes) in pauses.iter().zip(&mut self.doubts).zip(&all) {
            let Some(pause) = pause else { continue };
            // For a change of each channel by its deviation, SI.
            let slopes = slopes.iter().zip(&rest.deviation);
            let square = slopes.map(|(slope, deviation)| (slope.slow * deviation).powi(2));
            doubt.show(pause, FASTEST_DRIFT * square.sum::<f64>().sqrt());
        }
        let (Some(Some(pause)), Some(slopes)) = (pauses.first(), all.first()) else {
            return;
        };
        // Creep shows in pauses, too: what the stated deviation does not explain is a drift for sure.
        let doubted = self
            .doubts
            .first()
            .is_some_and(|doubt| doubt.deviation() > 0.0);
        self.take_off(pause, slopes, doubted);
    }

    /// Follows the drift that a pause shows in level and rate: that of what looks like no touch, and
    /// the force that the empty body shows, N, as the least drift, in deviations of the channels, that explains
    /// it; sooner where its zero is `doubted`.
    fn take_off(&mut self, pause: &PauseMean, slopes: &[ChannelSlope], doubted: bool) {
        let (Some(rest), Some(watch)) = (&self.maps.rest, &mut self.watch) else {
            return;
        };
        let gains = FOLLOW.map(|follow| {
            let stay = (-pause.since / follow).exp();
            if rest.recovery > 0.0 {
                [1.0 - stay * stay, (1.0 - stay).powi(2) / pause.since]
            } else {
                // The baseline knows the rates of a body that does not creep.
                [1.0 - stay, 0.0]
            }
        });
        watch.follow(gains);
        // For a change of each channel by its deviation, N.
        let slopes = slopes.iter().zip(&rest.deviation);
        let slopes: Vec<f64> = slopes
            .map(|(slope, deviation)| slope.slow * deviation)
            .collect();
        let square: f64 = slopes.iter().map(|slope| slope * slope).sum();
        if square <= 0.0 {
            return;
        }
        self.per_drift = square.sqrt();
        let [share, rate] = gains[usize::from(doubted)];
        for (channel, (slope, deviation)) in slopes.iter().zip(&rest.deviation).enumerate() {
            let drift = pause.value * slope / square * deviation;
            watch.take_off(channel, share * drift, rate * drift);
        }
    }

    /// Share of the contact in each cell, row by row; even without a contact,
    /// `NaN` where it is not known.
    fn shares(&self, position: Option<&PositionEstimate>, contact: Option<bool>) -> Vec<f64> {
        let cells = self.area.rows * self.area.columns;
        let Some(position) = position.filter(|_| contact == Some(true)) else {
            let known = contact == Some(false) || (contact.is_some() && cells == 1);
            return vec![if known { 1.0 / cells as f64 } else { f64::NAN }; cells];
        };
        let [x, y] = self.area.half_sides();
        let [dx, dy] = position.deviation();
        let columns = slices(
            self.area.columns,
            -x,
            self.area.pitch[0],
            position.position[0],
            dx,
        );
        // Row 0 is at +y.
        let rows = slices(
            self.area.rows,
            -y,
            self.area.pitch[1],
            -position.position[1],
            dy,
        );
        let cells = rows.iter().flat_map(|r| columns.iter().map(move |c| r * c));
        cells.collect()
    }

    fn contact(&self, touch: &Touch) -> Contact {
        let found = &self.found;
        let (centre, covariance) = match &found.position {
            Some(position) => {
                let [[xx, xy], [_, yy]] = position.covariance;
                (position.position, [xx, xy, yy])
            }
            None => ([0.0; 2], self.area.anywhere()),
        };
        let force = found.force.map(|force| [force.value, force.deviation]);
        let [force, deviation] = force.unwrap_or([f64::NAN; 2]);
        // Without a map of them the forces along x and y count as none.
        let side = |axis: usize, unknown: f64| {
            let known = Some(touch.total.force[axis]).filter(|force| force.is_finite());
            known.unwrap_or(unknown)
        };
        let mut force_covariance = normal_only(deviation);
        for (axis, row) in force_covariance.iter_mut().enumerate().take(2) {
            if touch.total.force[axis].is_finite() {
                row[axis] = touch.total_covariance[axis][axis];
            }
        }
        let taxels = touch.regions.iter().flatten().count();
        let greater = |a: &usize, b: &usize| found.shares[*a].total_cmp(&found.shares[*b]);
        let peak_taxel = (0..found.shares.len()).max_by(greater).unwrap_or(0);
        let state = found.state();
        Contact {
            taxels,
            area: taxels as f64 * self.area.pitch[0] * self.area.pitch[1],
            centre,
            covariance,
            force: [side(0, 0.0), side(1, 0.0), force],
            force_covariance,
            torsion: f64::NAN,
            peak: touch.taxels[peak_taxel].pressed(),
            peak_taxel,
            bound: (state == State::OutOfRange).then_some(state),
            certainty: found.certainty(),
            ..Contact::default()
        }
    }
}

impl Reader for TrainedReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn trained_area(&self) -> Option<[[f64; 2]; 2]> {
        let surface = &self.maps.position.as_ref()?.surface;
        Some([0, 1].map(|axis| surface.range(axis)))
    }

    fn rules(&self) -> Rules {
        let without_force = "these positions are learned from readings as they come";
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Fixed(f64::INFINITY),
            counted: counting(&[State::Ok, State::OutOfRange]),
            // The force is that of the contact, not the sum of the cells.
            total: Total::Unknown,
            drift: if self.maps.rest.is_some() {
                Drift::HeldByContact
            } else {
                Drift::None
            },
            rest: RestRules {
                refused: self.maps.rest.is_none().then_some(without_force),
                at_start: true,
                channels_per_unit: 1,
                unit: "channel",
                measures_noise: false,
                ends_at_touch: true,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        match &self.maps.rest {
            Some(rest) => rest.deviation.clone(),
            None => vec![f64::NAN; self.channels.len()],
        }
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        for (reading, value) in channels.readings.iter_mut().zip(values) {
            *reading = self.scale.input(*value);
        }
        let mut clipped = 0;
        for (state, value) in channels.states.iter_mut().zip(values) {
            let position = self.scale.position(*value);
            if position == Position::Inside || *state == ChannelState::Masked {
                continue;
            }
            clipped += usize::from(value.is_finite());
            *state = if value.is_finite() && position == Position::AtEnd {
                ChannelState::Saturated
            } else {
                ChannelState::Faulty
            };
        }
        clipped
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        let channels = &mut touch.channels;
        for (channel, value) in self.values.iter_mut().enumerate() {
            *value = if channels.states[channel].usable() {
                channels.readings[channel] - known.drift(channel)
            } else {
                f64::NAN
            };
        }
        self.captured[0] = if known.capturing {
            self.captured[0] + 1
        } else {
            0
        };
        self.take_over(known);
        self.watch(known, channels);
        self.find_drift(known);
        if self.force.is_some() {
            self.remember(touch.time_ns as f64 * 1e-9);
        }
        // A channel that the maps need has no reading: nothing else can fail.
        let Ok(found) = self.estimate(touch.time_ns as f64 * 1e-9) else {
            self.found = Found::default();
            self.occupied.fill(true);
            touch.taxels.fill(TaxelTouch::without_value(State::Faulty));
            return;
        };
        self.found = found;
        let free = self.is_free();
        self.free_for = match known.elapsed {
            Some(elapsed) if free => self.free_for + elapsed,
            _ => 0.0,
        };
        self.look_at_zero(known.elapsed.unwrap_or(0.0), free);
        let found = &self.found;
        let recovery = self.maps.rest.as_ref().map_or(0.0, |rest| rest.recovery);
        self.occupied.fill(!free || self.free_for < recovery);
        let (value, deviation) = match found.force {
            Some(force) => (force.value, force.deviation),
            None => (1.0, f64::NAN),
        };
        let free = found.contact == Some(false);
        let unknown = found.certainty() == Certainty::Unknown;
        let cells = touch.taxels.iter_mut().zip(&found.shares);
        for ((taxel, share), masked) in cells.zip(&self.masked) {
            let state = match share.is_nan() {
                _ if *masked => State::Masked,
                true => State::OutOfRange,
                false => found.state(),
            };
            *taxel = if *masked || unknown {
                TaxelTouch::without_value(state)
            } else {
                let value = if free { 0.0 } else { share * value };
                TaxelTouch::pressing(value, share * deviation, state)
            };
        }
    }

    fn total_certainty(&self) -> Certainty {
        self.found.certainty()
    }

    fn locate(&mut self, _cells: &[Cell], touch: &mut Touch) {
        let found = &self.found;
        touch.contacts.clear();
        touch.regions.fill(None);
        touch.centre_of_pressure = None;
        touch.depth = None;
        touch.total = UNKNOWN;
        if let Some(force) = found.force {
            touch.total.force[2] = force.value;
            touch.total_covariance[2][2] = force.deviation * force.deviation;
        }
        touch.moment_deviation = [f64::NAN; 3];
        for (component, [value, deviation]) in &found.components {
            match component {
                Component::ForceX | Component::ForceY => {
                    let axis = usize::from(*component == Component::ForceY);
                    touch.total.force[axis] = *value;
                    touch.total_covariance[axis][axis] = deviation * deviation;
                }
                Component::MomentX | Component::MomentY | Component::MomentZ => {
                    let axis = match component {
                        Component::MomentX => 0,
                        Component::MomentY => 1,
                        _ => 2,
                    };
                    touch.total.moment[axis] = *value;
                    touch.moment_deviation[axis] = *deviation;
                }
            }
        }
        match (found.contact, self.held) {
            (Some(true), _) => {}
            // Nobody saw the contact end.
            (None, Some(held)) => {
                touch.regions[held.peak_taxel] = Some(0);
                touch.contacts.push(Contact {
                    certainty: Certainty::Unknown,
                    bound: touch.taxels.first().map(|taxel| taxel.state),
                    ..held
                });
                return;
            }
            _ => {
                self.held = None;
                return;
            }
        }
        for (region, share) in touch.regions.iter_mut().zip(&found.shares) {
            let member = share.is_nan() || *share >= CELL_SHARE;
            *region = member.then_some(0);
        }
        touch.depth = found.position.and_then(|position| position.depth);
        let contact = self.contact(touch);
        touch.centre_of_pressure = Some((contact.centre, contact.covariance));
        self.held = Some(contact);
        touch.contacts.push(contact);
    }

    fn occupied(&self) -> Option<&[bool]> {
        self.maps.rest.is_some().then_some(&self.occupied)
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        let Some(trained) = &self.maps.rest else {
            return;
        };
        for ((own, rest), trained) in self.rest.iter_mut().zip(rest).zip(&trained.mean) {
            *own = if rest.is_nan() { *trained } else { *rest };
        }
        self.rested = rest.iter().any(|rest| rest.is_finite());
        self.held = None;
        if self.captured[0] > 0 {
            self.captured[1] = self.captured[0];
        }
        self.doubts = doubts(&self.maps);
        self.of_channels.fill(ZeroDoubt::default());
        if let Some(watch) = &mut self.watch {
            watch.forget_drift();
        }
        // The maps were accepted when the reader was made.
        if let Ok(force) = force_estimator(&self.maps, Some(self.rest.clone())) {
            self.force = force;
        }
        if let Ok(place) = place_estimator(&self.maps, Some(self.rest.clone())) {
            self.place = place;
        }
        // The memories begin with the first frame of the capture.
        for (time, values) in &self.recent {
            // A frame without a reading was left out before, too.
            if let Some(force) = &mut self.force {
                let _ = force.push(*time, values);
            }
            if let Some(place) = &mut self.place {
                let _ = place.push(*time, values, &[]);
            }
        }
    }
}

/// Facts of the channels: the noise where nothing pressed in training.
fn facts(maps: &TrainedMaps, channels: usize, symbol: &str) -> Vec<ChannelFacts> {
    let noise = maps.rest.as_ref().filter(|_| symbol == "counts");
    let step = |channel: usize| {
        noise
            .and_then(|rest| rest.step.get(channel))
            .copied()
            .unwrap_or(0.0)
    };
    let channel_facts = |channel: usize| {
        let unknown = ChannelFacts::unknown(true);
        match noise.and_then(|rest| rest.deviation.get(channel)) {
            Some(deviation) => ChannelFacts {
                deviation: *deviation,
                resolution: step(channel),
                // A press that is not known to be one yet is no noise; the others tell.
                quietest: true,
                ..unknown
            },
            None => unknown,
        }
    };
    let watched = |channel: usize| ChannelFacts {
        masked: !maps.use_channel(channel),
        ..channel_facts(channel)
    };
    (0..channels).map(watched).collect()
}

/// A contact shows this much: many deviations. What a doubt hides is no more than one of them, else
/// it would grow by the touches it hides.
fn open_at(stated: &[[f64; 2]], number: usize, deviation: f64) -> f64 {
    CONTACT_DEVIATIONS * deviation.min(std::f64::consts::SQRT_2 * stated[number][1])
}

fn doubts(maps: &TrainedMaps) -> Vec<ZeroDoubt> {
    let estimates = maps
        .force
        .as_ref()
        .map_or(0, |force| 1 + force.components.len());
    vec![ZeroDoubt::default(); estimates]
}

fn force_estimator(
    maps: &TrainedMaps,
    rest: Option<Vec<f64>>,
) -> Result<Option<ForceEstimator>, TrainingError> {
    match (&maps.force, rest) {
        (Some(force), Some(rest)) => ForceEstimator::new(force.clone(), rest).map(Some),
        _ => Ok(None),
    }
}

fn place_estimator(
    maps: &TrainedMaps,
    rest: Option<Vec<f64>>,
) -> Result<Option<PlaceEstimator>, TrainingError> {
    match (&maps.place, rest) {
        (Some(place), Some(rest)) => PlaceEstimator::new(place.clone(), rest).map(Some),
        _ => Ok(None),
    }
}

/// Share of the normal law about `mean` in each of `count` slices that begin
/// at `first`, the outermost with all that lies beyond.
fn slices(count: usize, first: f64, width: f64, mean: f64, deviation: f64) -> Vec<f64> {
    let below = |edge: usize| match edge {
        0 => 0.0,
        edge if edge == count => 1.0,
        edge => {
            let at = first + width * edge as f64;
            0.5 * libm::erfc((mean - at) / (deviation * std::f64::consts::SQRT_2))
        }
    };
    (0..count).map(|k| below(k + 1) - below(k)).collect()
}

fn meaning(
    maps: &TrainedMaps,
    area: &TrainedArea,
    channels: Vec<String>,
    reading: Scale,
    full_scale: f64,
) -> Meaning {
    let force = maps.force.is_some();
    Meaning {
        layout: area.layout(),
        in_metres: true,
        channels,
        wiring: Wiring::Shared {
            taxels: area.rows * area.columns,
        },
        reading,
        value: if force {
            Scale::new("force", "N", 1.0)
        } else {
            Scale::new("share of the contact", "", 1.0)
        },
        components: 1,
        signed: false,
        full_scale: Some(if force { full_scale } else { 1.0 }),
        verified: None,
        picture: Picture::Heat,
        newtons: Some([1.0; 2]),
        total_known: force,
    }
}
