//! The estimator of every array: frames to touch, through the reader of its device.

use std::any::Any;

use super::ChannelFacts;
use super::baseline::{Baseline, BaselineOptions};
use super::certainty::Certainty;
use super::contact::{Cell, Contact, normal_only};
use super::holding::Holding;
use super::judged::Judged;
use super::reader::{Drift, Known, Meaning, Reader, Rules, Total};
use super::rest::{Judge, Rest, RestCapture, RestRefused, standing_out};
use super::segmentation::Segmentation;
use super::steps::Steps;
use super::touch::{ChannelState, State, TaxelTouch, Touch, UNKNOWN};
use crate::acquisition::{Frame, Quantity, SignalUnit};
use crate::layout::{Mount, Wrench};
use crate::signal::board_of;

/// End of a rest capture, if a frame was its last.
pub type Captured = Option<Result<(), RestRefused>>;

/// A frame that the estimator cannot use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The frame has another number of channels than the device.
    #[error("the frame has {found} channels; the device has {expected}")]
    Channels {
        /// Channels of the frame.
        found: usize,
        /// Channels of the device.
        expected: usize,
    },
    /// The channels carry a quantity that the device does not have.
    #[error(
        "the frames carry {found_name}, the board of the sensor file gives {expected}{advice}",
        found_name = found.name()
    )]
    Quantity {
        /// Quantity of the frames.
        found: Quantity,
        /// Quantity of the board in the sensor file, with its unit.
        expected: String,
        /// What the sensor file would have to say, at the end of the sentence.
        advice: &'static str,
    },
    /// A device without a physical model, of which nothing was learned yet.
    #[error("nothing was learned of this device yet: train first")]
    Untrained,
    /// A device whose readings belong to several loads.
    #[error("{0}")]
    NotInvertible(String),
    /// A masked channel of a device without a physical model, whose maps need it.
    #[error("the channel \"{channel}\" is masked, but the maps were trained with it")]
    TrainedWithMasked {
        /// Group and name of the channel.
        channel: String,
    },
}

impl FrameError {
    /// Frames that carry `found` in the place of `expected`.
    pub(crate) fn quantity(found: Quantity, expected: &SignalUnit) -> Self {
        let name = expected.quantity.name();
        let expected = match expected.quantity {
            Quantity::Counts | Quantity::Raw => name.to_owned(),
            _ => format!("{name} in {}", expected.symbol),
        };
        let advice = board_of(found);
        Self::Quantity {
            found,
            expected,
            advice,
        }
    }
}

/// Turns frames of one device into touch; the same frames give the same touches.
///
/// A device gives its [`Reader`]; all else is the same for every device: which
/// channels can be used, the readings of the empty device and their drift, rest
/// capture, which taxels hang together in a contact, and totals.
pub struct ArrayEstimator {
    reader: Box<dyn Reader>,
    rules: Rules,
    /// Standard deviation of one reading as drawn, and in force, SI.
    drawn_noise: Vec<f64>,
    noise: Vec<f64>,
    steps: Steps,
    /// What is known of each channel: what the reader knows, and the noise that a capture saw of others.
    facts: Vec<ChannelFacts>,
    captured: Vec<Option<[f64; 2]>>,
    /// Channels that read at the high end while the device was at rest.
    at_end: Vec<bool>,
    /// True for a channel that had no reading when the zero of others was taken.
    absent: Vec<bool>,
    capture: Option<RestCapture>,
    /// True after the last frame of a rest capture.
    emptied: bool,
    /// True until the first rest capture of a device that needs one comes to its end.
    awaits_zero: bool,
    baseline: Option<Baseline>,
    still: StillWatch,
    holding: Holding,
    segmentation: Segmentation,
    cells: Vec<Cell>,
    /// True if a contact is on each channel.
    occupied: Vec<bool>,
    touch: Touch,
    last_time_ns: Option<u64>,
}

impl ArrayEstimator {
    /// An estimator of the device that `reader` reads.
    pub fn new(reader: Box<dyn Reader>) -> Self {
        let rules = reader.rules();
        let layout = &reader.meaning().layout;
        let channels = reader.channels().len();
        let noise = reader.noise();
        let cell = |index| empty_cell(layout.flat_position(index));
        let cells: Vec<Cell> = (0..layout.taxels()).map(cell).collect();
        let mut estimator = Self {
            holding: Holding::new(cells.len()),
            segmentation: Segmentation::new(
                layout.rows,
                layout.columns,
                layout.pitch,
                rules.division,
            ),
            touch: Touch::new(channels, cells.len()),
            cells,
            occupied: vec![false; channels],
            rules,
            baseline: (rules.drift != Drift::None).then(|| {
                let usual = BaselineOptions::new(noise.clone());
                Baseline::new(match rules.drift {
                    Drift::WithoutContact { period } => BaselineOptions {
                        contacts_known: true,
                        settling: SETTLED,
                        period,
                        ..usual
                    },
                    Drift::HeldByContact => BaselineOptions {
                        held_by_contact: true,
                        ..usual
                    },
                    Drift::Followed | Drift::None => usual,
                })
            }),
            captured: vec![None; channels],
            at_end: vec![false; channels],
            absent: vec![false; channels],
            capture: None,
            emptied: false,
            awaits_zero: false,
            still: StillWatch::new(channels),
            steps: Steps::new(&*reader, &noise),
            facts: reader.channels().to_vec(),
            drawn_noise: noise.clone(),
            noise,
            last_time_ns: None,
            reader,
        };
        estimator.find_noise();
        estimator.take_rest();
        estimator
    }

    /// Says by which steps the wire gives the channels, in the unit of a frame: 0 for none, `NaN`
    /// where it is not known.
    pub fn set_steps(&mut self, steps: &[f64]) {
        self.reader.set_steps(steps);
        self.facts.clone_from_slice(self.reader.channels());
        self.steps.state(steps);
        self.find_noise();
    }

    /// The noise in force: that of the last rest capture or the drawn one, and no less than steps
    /// leave.
    fn find_noise(&mut self) {
        let drawn = self.drawn_noise.iter().zip(&self.captured).enumerate();
        for (noise, (channel, (drawn, captured))) in self.noise.iter_mut().zip(drawn) {
            *noise = self
                .steps
                .at_least(channel, captured.map_or(*drawn, |[_, noise]| noise));
        }
    }

    /// Meaning of readings and values.
    pub fn meaning(&self) -> &Meaning {
        self.reader.meaning()
    }

    /// Where a trained device was pressed in training: from and to along x and y, m. None of
    /// devices that know their whole area.
    pub fn trained_area(&self) -> Option<[[f64; 2]; 2]> {
        self.reader.trained_area()
    }

    /// Rules for this device.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// Facts of each channel, in the order and unit of a frame.
    pub fn channels(&self) -> &[ChannelFacts] {
        &self.facts
    }

    /// The reader, if it is of this type.
    pub fn reader<R: Reader>(&self) -> Option<&R> {
        let reader: &dyn Any = &*self.reader;
        reader.downcast_ref()
    }

    /// Pairs of channels of a unit, one of which has changed places.
    pub fn swapped(&self, unit: usize) -> &[[usize; 2]] {
        self.reader.swapped(unit)
    }

    /// The readings of the empty device, SI, and every change of them; none for
    /// a device whose readings do not drift.
    pub fn baseline(&self) -> Option<&Baseline> {
        self.baseline.as_ref()
    }

    /// The touch of the last frame.
    pub fn touch(&self) -> &Touch {
        &self.touch
    }

    /// The same, to be completed by who follows contacts.
    pub(super) fn touch_mut(&mut self) -> &mut Touch {
        &mut self.touch
    }

    /// Begins a rest capture over the next `frames` frames.
    pub fn begin_rest_capture(&mut self, frames: usize) {
        self.await_zero();
        self.capture = Some(RestCapture::new(self.noise.len(), frames, false));
    }

    /// Begins one that nobody asked for: it is refused if a taxel stands out, which may be
    /// pressed.
    pub fn begin_unasked_rest_capture(&mut self, frames: usize) {
        self.await_zero();
        self.capture = Some(RestCapture::new(self.noise.len(), frames, true));
    }

    /// True if the device needs a rest capture, and none is in force.
    pub fn needs_zero(&self) -> bool {
        self.rules.rest.at_start && self.rules.rest.refused.is_none() && !self.is_tared()
    }

    /// From now on no zero is known before a rest capture that the device needs.
    pub fn await_zero(&mut self) {
        self.awaits_zero = self.needs_zero();
    }

    /// True if a rest capture is in force.
    pub fn is_tared(&self) -> bool {
        self.captured.iter().any(Option::is_some)
    }

    /// True if a rest capture is under way.
    pub fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    /// Returns to the rest values of the calibration.
    pub fn clear_rest(&mut self) {
        self.captured.fill(None);
        self.at_end.fill(false);
        self.absent.fill(false);
        self.awaits_zero = false;
        self.renew();
    }

    /// The rest values in force.
    pub fn rest(&self) -> Rest {
        Rest {
            captured: self.captured.clone(),
            at_end: self.at_end.clone(),
            values: self.touch.channels.rest.clone(),
        }
    }

    /// Puts back rest values that this estimator gave, bit for bit.
    pub fn restore_rest(&mut self, rest: &Rest) {
        if rest.captured.len() == self.captured.len() {
            self.captured.clone_from(&rest.captured);
            self.at_end.clone_from(&rest.at_end);
            let absent = rest.captured.iter().map(Option::is_none);
            self.absent = absent.map(|absent| absent && self.is_tared()).collect();
            self.awaits_zero = false;
            self.renew();
        }
    }

    /// Estimates one frame.
    ///
    /// The second value is the end of a rest capture, when this frame was its
    /// last.
    ///
    /// # Errors
    /// [`FrameError::Channels`] for a frame of another device.
    pub fn push(&mut self, frame: &Frame) -> Result<(&Touch, Captured), FrameError> {
        let expected = self.noise.len();
        if frame.values.len() != expected {
            return Err(FrameError::Channels {
                found: frame.values.len(),
                expected,
            });
        }
        if !self.reader.takes(frame.time_ns) {
            return Ok((&self.touch, None));
        }
        if self.steps.look(&frame.values) {
            self.find_noise();
        }
        // The device was empty: no taxel holds a touch that began on another zero.
        if std::mem::take(&mut self.emptied) {
            self.segmentation.forget();
            self.touch.regions.fill(None);
        }
        let elapsed = self.elapsed(frame.time_ns);
        self.touch.sequence = frame.sequence;
        self.touch.time_ns = frame.time_ns;
        self.touch.zero_known = !self.awaits_zero;
        self.take_readings(&frame.values, elapsed.unwrap_or(0.0));
        let known = Known {
            elapsed,
            noise: &self.noise,
            baseline: self.baseline.as_ref(),
            capturing: self.capture.is_some(),
        };
        self.reader.read(&known, &mut self.touch);
        let captured = self.capture_frame();
        self.sum_up();
        self.find_contacts(elapsed.unwrap_or(0.0));
        self.find_below_zero();
        self.judge();
        // A frame that ends a rest capture was read with the rest before it.
        if !matches!(captured, Some(Ok(()))) {
            self.follow_drift();
        }
        Ok((&self.touch, captured))
    }

    /// Seconds since the last frame; none for the first, or after a device that
    /// began anew.
    fn elapsed(&mut self, time_ns: u64) -> Option<f64> {
        let last = self.last_time_ns.replace(time_ns)?;
        (time_ns >= last).then(|| (time_ns - last) as f64 * 1e-9)
    }

    /// Readings of a frame with the state of each channel.
    fn take_readings(&mut self, values: &[f64], elapsed: f64) {
        let channels = &mut self.touch.channels;
        for (state, facts) in channels.states.iter_mut().zip(&self.facts) {
            *state = if facts.masked {
                ChannelState::Masked
            } else {
                ChannelState::Ok
            };
        }
        self.touch.clipped = self.reader.convert(values, channels);
        for (state, at_end) in channels.states.iter_mut().zip(&self.at_end) {
            if *at_end && *state == ChannelState::Saturated {
                *state = ChannelState::Faulty;
            }
        }
        self.still
            .push(values, elapsed, &self.facts, &mut channels.states);
        // A channel that was not there when the zero of the others was taken has none: what it reads is no force.
        if self.capture.is_none() {
            for (state, absent) in channels.states.iter_mut().zip(&self.absent) {
                if *absent && state.usable() {
                    *state = ChannelState::Faulty;
                }
            }
        }
    }

    fn capture_frame(&mut self) -> Captured {
        let capture = self.capture.as_mut()?;
        if let Some(reason) = self.rules.rest.refused {
            self.capture = None;
            return Some(Err(RestRefused::NotTaken { reason }));
        }
        let channels = &self.touch.channels;
        let rules = &self.rules.rest;
        if !capture.push(&channels.readings, &channels.states, &self.noise, rules) {
            return None;
        }
        let capture = self.capture.take()?;
        if capture.unasked
            && let Some(refused) = self.standing_out()
        {
            return Some(Err(refused));
        }
        let found = capture.finish(&mut self.captured, &self.noise, rules, &&*self.reader);
        Some(found.map(|at_end| {
            capture.learn(&mut self.facts);
            self.at_end = at_end;
            let zeros = self.captured.iter().enumerate();
            self.absent = zeros
                .map(|(channel, zero)| zero.is_none() && capture.has_none(channel))
                .collect();
            self.awaits_zero = false;
            self.emptied = true;
            self.renew();
        }))
    }

    /// The taxel that stands out from the others in the last frame, if one does: why a capture
    /// that nobody asked for would be refused.
    pub fn standing_out(&self) -> Option<RestRefused> {
        let taxels = &self.touch.taxels;
        // Beside the rest values of the drawing many contradict themselves.
        let values = taxels.iter().map(TaxelTouch::pressed).enumerate();
        let threshold = |taxel: usize| {
            self.rules
                .threshold
                .of(by_noise(&*self.reader, taxel, &taxels[taxel]))
        };
        let (taxel, others) = standing_out(values, threshold)?;
        let meaning = self.reader.meaning();
        let columns = meaning.layout.columns;
        let [value, median, scatter] = [taxels[taxel].pressed(), others[0], others[1]]
            .map(|si| si / meaning.value.si_per_unit);
        let unit = &meaning.value.symbol;
        Some(RestRefused::StandsOut {
            row: taxel / columns,
            column: taxel % columns,
            value: format!("{value:.3} {unit}"),
            others: format!("{median:.3} +- {scatter:.3} {unit}"),
        })
    }

    /// Begins anew from the captured rest values.
    fn renew(&mut self) {
        let captured = self.captured.iter();
        let rest: Vec<f64> = captured
            .map(|captured| captured.map_or(f64::NAN, |[value, _]| value))
            .collect();
        self.find_noise();
        self.reader.set_rest(&rest, &self.noise);
        // Of a taxel without a value the new rest says that nothing is on it.
        let taxels = self.touch.taxels.iter().zip(&mut self.touch.regions);
        for (_, region) in taxels.filter(|(taxel, _)| !taxel.counted) {
            *region = None;
        }
        self.take_rest();
    }

    /// Takes the reader's rest values into touch and baseline.
    fn take_rest(&mut self) {
        self.touch.channels.rest = self.reader.rest();
        if let Some(baseline) = &mut self.baseline {
            baseline.set_noise(self.noise.clone());
            baseline.tare(self.touch.time_ns, &self.touch.channels.rest);
        }
    }

    /// Which taxels count, and what they add up to.
    fn sum_up(&mut self) {
        let counted = &self.rules.counted;
        let pulls = self.reader.meaning().pulls();
        let touch = &mut self.touch;
        touch.left_out = 0;
        for taxel in &mut touch.taxels {
            // A bound counts on any device: a press beyond the range is a contact all the more.
            let counts = counted[taxel.state as usize] || taxel.state.is_bound();
            // At its low end a reading bounds from above what cannot pull: that says nothing.
            let low = taxel.state == State::Saturated && !pulls && taxel.pressed() <= 0.0;
            taxel.counted = counts && !low && !taxel.pressed().is_nan();
            touch.left_out += usize::from(!taxel.counted);
        }
        let meaning = self.reader.meaning();
        let counting = || touch.taxels.iter().filter(|taxel| taxel.counted);
        let [sum, variance] = counting().fold([0.0; 2], |[sum, variance], taxel| {
            [sum + taxel.pressed(), variance + taxel.covariance[2][2]]
        });
        touch.sum = sum;
        touch.total = UNKNOWN;
        touch.total_covariance = [[f64::NAN; 3]; 3];
        let adds_up = self.rules.total != Total::Unknown;
        let Some([first, second]) = meaning.newtons.filter(|_| adds_up) else {
            return;
        };
        if meaning.components == 3 {
            (touch.total, touch.total_covariance) = vector_total(meaning, &touch.taxels);
            return;
        }
        touch.total.force[2] = sum * first * second;
        let variance = self.reader.sum_variance(sum).unwrap_or(variance);
        let deviation = variance.sqrt() * first * second;
        touch.total_covariance[2][2] = deviation * deviation;
    }

    /// How much the total and the contacts say; what they do not say is taken back.
    fn judge(&mut self) {
        let touch = &mut self.touch;
        let meaning = self.reader.meaning();
        let pulls = meaning.pulls();
        let touched: f64 = touch.contacts.iter().map(|contact| contact.force[2]).sum();
        let spread = self.reader.spreads_loads() && touched > 0.0;
        let [total, variance] = [touch.total.force[2], touch.total_covariance[2][2]];
        for contact in &mut touch.contacts {
            if spread && total > touched {
                // What a cover carries to cells that are not touched belongs to the contacts.
                let share = contact.force[2] / touched;
                contact.noise *= total / touched;
                contact.force[2] = share * total;
                contact.force_covariance[2][2] = share * variance;
            }
            contact.say_no_more(meaning.components, pulls);
        }
        let unknown = |contact: &&Contact| contact.certainty == Certainty::Unknown;
        let held = touch.contacts.iter().find(unknown);
        let mut judged = Judged::default();
        if let Some(held) = held {
            touch.centre_of_pressure = None;
            // A force that is no sum of taxels has its own interval.
            if self.rules.total != Total::Unknown || touch.total.force[2].is_nan() {
                judged.limit(Certainty::Unknown, held.bound.unwrap_or(State::Unchecked));
            }
        }
        match self.rules.total {
            Total::Counted | Total::Certain => {
                // A reading that several taxels share leaves nothing certain once one is not.
                let all = self.rules.total == Total::Certain;
                for (index, taxel) in touch.taxels.iter().enumerate() {
                    let unknown = all && !taxel.counted && taxel.state != State::Masked;
                    if taxel.counted || self.reader.exists(index) {
                        judged.add(taxel, pulls || unknown);
                    }
                }
                if touch.left_out == touch.taxels.len() {
                    judged.certainty = Certainty::Unknown;
                }
            }
            Total::Unknown if touch.total.force[2].is_nan() => {
                judged.certainty = Certainty::Unknown;
            }
            Total::Unknown => judged.limit(self.reader.total_certainty(), State::OutOfRange),
        }
        (touch.total_certainty, touch.total_reason) = (judged.certainty, judged.reason);
        if judged.certainty != Certainty::Exact {
            let force = touch.total.force[2];
            touch.total = UNKNOWN;
            touch.moment_deviation = [f64::NAN; 3];
            let variance = touch.total_covariance[2][2];
            touch.total_covariance = [[f64::NAN; 3]; 3];
            if judged.certainty == Certainty::AtLeast {
                touch.total.force[2] = force;
                touch.total_covariance[2][2] = variance;
            }
        }
    }

    /// Nothing pulls on a device that is pressed: its zero is wrong. A device that shows
    /// tension too says nothing of its zero.
    fn find_below_zero(&mut self) {
        if self.reader.meaning().pulls() {
            return;
        }
        for (index, taxel) in self.touch.taxels.iter_mut().enumerate() {
            let noise = by_noise(&*self.reader, index, taxel);
            let threshold = self.rules.threshold.of(noise);
            let below = threshold > 0.0 && taxel.pressed() < -threshold;
            if below && taxel.counted && taxel.state == State::Ok {
                taxel.state = State::BelowZero;
            }
        }
    }

    fn find_contacts(&mut self, elapsed: f64) {
        if !self.rules.threshold.is_reached() {
            self.reader.locate(&self.cells, &mut self.touch);
            return;
        }
        let meaning = self.reader.meaning();
        let [first, second] = meaning.newtons.unwrap_or([1.0; 2]);
        let newtons = first * second;
        let vector = meaning.components == 3;
        let taxels = self.touch.taxels.iter().zip(&self.touch.regions);
        for (index, (cell, (taxel, region))) in self.cells.iter_mut().zip(taxels).enumerate() {
            cell.state = taxel.state;
            // Nobody saw a touch end on a taxel of which nothing is known any more.
            if !taxel.counted && region.is_some() && taxel.state != State::BelowZero {
                cell.certainty = Certainty::Unknown;
                (cell.deviation, cell.threshold) = (cell.weight, 0.0);
                continue;
            }
            let held = self.reader.held(index, taxel.pressed());
            let [value, deviation] =
                held.unwrap_or_else(|| [taxel.pressed(), taxel.pressed_deviation()]);
            cell.weight = if taxel.counted { value } else { f64::NAN };
            cell.certainty = if taxel.state.is_bound() {
                Certainty::AtLeast
            } else {
                Certainty::Exact
            };
            cell.deviation = deviation;
            (cell.force, cell.force_covariance) = if vector {
                (taxel.value, taxel.covariance)
            } else {
                let force = [0.0, 0.0, value * newtons];
                (force, normal_only(cell.deviation * newtons))
            };
            let noise = self.reader.by_noise(index).unwrap_or(deviation);
            cell.noise = if vector { noise } else { noise * newtons };
            cell.threshold = match self.rules.threshold {
                // Electrodes that touch each other are touch already.
                _ if taxel.state == State::Closed => 0.0,
                threshold => {
                    let known = [cell.weight, threshold.of(noise)];
                    let touched = region.is_some();
                    self.holding.threshold(index, touched, elapsed, known)
                }
            };
        }
        let touch = &mut self.touch;
        touch.centre_of_pressure = self.segmentation.run(&mut self.cells, &mut touch.contacts);
        self.segmentation.label(&mut touch.regions);
        touch.merged = self.segmentation.merged();
        self.reader.locate(&self.cells, touch);
    }

    /// The baseline takes what no contact explains.
    fn follow_drift(&mut self) {
        let Some(baseline) = &mut self.baseline else {
            return;
        };
        let touch = &self.touch;
        let (time_ns, readings) = (touch.time_ns, &touch.channels.readings);
        if let Some(occupied) = self.reader.occupied() {
            self.occupied.copy_from_slice(occupied);
        } else {
            let wiring = self.reader.meaning().wiring;
            wiring.mark_touched(&touch.regions, &mut self.occupied);
        }
        let readings = self.reader.empty().unwrap_or(readings);
        baseline.push(time_ns, readings, |channel| self.occupied[channel]);
    }
}

impl Judge for &dyn Reader {
    fn name(&self, channel: usize) -> &str {
        let name = self.meaning().channels.get(channel);
        name.map_or("a channel", String::as_str)
    }

    fn facts(&self, channel: usize) -> &ChannelFacts {
        &self.channels()[channel]
    }

    fn problem(&self, unit: usize, rest: &[f64]) -> Option<String> {
        self.rest_problem(unit, rest)
    }
}

/// Standard deviation of a taxel's value by noise alone, SI.
fn by_noise(reader: &dyn Reader, index: usize, taxel: &TaxelTouch) -> f64 {
    reader
        .by_noise(index)
        .unwrap_or_else(|| taxel.pressed_deviation())
}

/// Total force and moment over the counted taxels of three components, and the
/// covariance of the force.
fn vector_total(meaning: &Meaning, taxels: &[TaxelTouch]) -> (Wrench, [[f64; 3]; 3]) {
    let layout = &meaning.layout;
    let mut total = Wrench::default();
    let mut covariance = [[0.0; 3]; 3];
    for (index, taxel) in taxels.iter().enumerate().filter(|(_, taxel)| taxel.counted) {
        total.add(&layout.wrench(index, taxel.value));
        // On a plane all taxels stand alike.
        let turned = match layout.mount {
            Mount::Flat => taxel.covariance,
            Mount::Cylinder(_) => layout.turn_covariance(index, &taxel.covariance),
        };
        for (sum, row) in covariance.iter_mut().flatten().zip(turned.iter().flatten()) {
            *sum += row;
        }
    }
    (total, covariance)
}

fn empty_cell(position: [f64; 2]) -> Cell {
    Cell {
        position,
        weight: f64::NAN,
        deviation: f64::NAN,
        threshold: f64::NAN,
        force: [f64::NAN; 3],
        force_covariance: [[f64::NAN; 3]; 3],
        noise: f64::NAN,
        state: State::Masked,
        certainty: Certainty::Exact,
    }
}

/// Settling time of readers that say themselves when a channel is empty, s: it only keeps the
/// beginning of the next contact out.
const SETTLED: f64 = 0.05;

/// Finds channels that give the same reading again and again.
#[derive(Debug, Clone)]
struct StillWatch {
    last: Vec<f64>,
    /// For how long, s, and how often in a row, the reading was the same.
    still: Vec<[f64; 2]>,
}

/// A reading that does not change for this time is stuck, s.
const STILL: f64 = 1.0;

impl StillWatch {
    fn new(channels: usize) -> Self {
        Self {
            last: vec![f64::NAN; channels],
            still: vec![[0.0; 2]; channels],
        }
    }

    /// Takes the values of a frame; a channel that stands still is faulty.
    fn push(
        &mut self,
        values: &[f64],
        elapsed: f64,
        facts: &[ChannelFacts],
        states: &mut [ChannelState],
    ) {
        let slots = self.last.iter_mut().zip(&mut self.still);
        for (index, ((last, still), value)) in slots.zip(values).enumerate() {
            *still = if *last == *value {
                [still[0] + elapsed, still[1] + 1.0]
            } else {
                [0.0; 2]
            };
            *last = *value;
            if still[0] >= STILL
                && states[index].usable()
                && facts[index].stands_still(*value, still[1])
            {
                states[index] = ChannelState::Faulty;
            }
        }
    }
}
