//! Frames of an array of three-axis units to touch.

use super::baseline::{Baseline, BaselineOptions};
use super::contact::{Cell, Contact};
use super::segmentation::Segmentation;
use super::unit::{Outcome, SearchOptions, UnitEstimate, estimate_unit};
use crate::acquisition::{Frame, Quantity};
use crate::calibration::{Calibration, RestCapture, RestRefused};
use crate::layout::{Mount, Wrench};
use crate::mechanics::{LoadHistory, Relaxation};
use crate::transduction::UnitModel;

/// How far a taxel's force can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// Four capacitors that agree.
    Ok = 0,
    /// Three capacitors (one is masked): a force without a check.
    Unchecked = 1,
    /// A tile touches its electrode: the force is a lower bound.
    Contact = 2,
    /// Beyond the full scale.
    OutOfRange = 3,
    /// The search did not end: the force is its last step.
    NotConverged = 4,
    /// The four capacitors contradict each other: for several frames, or
    /// plainly in this one.
    Inconsistent = 5,
    /// A capacitor gives an impossible reading; the force is from the others,
    /// or there is none.
    Faulty = 6,
    /// Not used.
    Masked = 7,
    /// The reading is at the end of what can be read: the value is a bound.
    Saturated = 8,
    /// Several places explain the readings equally well: this is one of them.
    Ambiguous = 9,
}

impl State {
    /// All states in the order of their codes.
    pub const ALL: [Self; 10] = [
        Self::Ok,
        Self::Unchecked,
        Self::Contact,
        Self::OutOfRange,
        Self::NotConverged,
        Self::Inconsistent,
        Self::Faulty,
        Self::Masked,
        Self::Saturated,
        Self::Ambiguous,
    ];

    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unchecked => "unchecked",
            Self::Contact => "contact",
            Self::OutOfRange => "out_of_range",
            Self::NotConverged => "not_converged",
            Self::Inconsistent => "inconsistent",
            Self::Faulty => "faulty",
            Self::Masked => "masked",
            Self::Saturated => "saturated",
            Self::Ambiguous => "ambiguous",
        }
    }
}

/// What one taxel feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaxelTouch {
    /// Capacitances 11, 12, 21, 22, F; `NaN` for no reading.
    pub capacitance: [f64; 4],
    /// Force x, y, z in the taxel's frame, N; `NaN` for none.
    pub force: [f64; 3],
    /// Its covariance, N².
    pub covariance: [[f64; 3]; 3],
    /// Signed consistency residual, one standard deviation wide; `NaN`: no check.
    pub residual: f64,
    /// How far the force can be trusted.
    pub state: State,
    /// Capacitors whose tile touches.
    pub touching: [bool; 4],
    /// Capacitors that are faulty or masked.
    pub unusable: [bool; 4],
}

impl TaxelTouch {
    /// Whether the force belongs into totals and contacts: there is one, and it
    /// is not known to be wrong.
    pub fn counts(&self) -> bool {
        !self.force[0].is_nan() && !matches!(self.state, State::Inconsistent | State::NotConverged)
    }

    /// Standard deviations of the force, N.
    pub fn deviation(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.covariance[axis][axis].sqrt())
    }
}

/// What the whole array feels in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Device time of the frame, ns.
    pub time_ns: u64,
    /// Each taxel, row by row.
    pub taxels: Vec<TaxelTouch>,
    /// Total force and moment in the sensor's frame over all taxels whose force
    /// counts; see [`Touch::left_out`].
    pub total: Wrench,
    /// Covariance of the total force, N².
    pub total_covariance: [[f64; 3]; 3],
    /// Centre of the normal force over all contacts on the developed surface,
    /// m, and its covariance xx, xy, yy, m²; `None` without contact.
    pub centre_of_pressure: Option<([f64; 2], [f64; 3])>,
    /// Contact regions, strongest first.
    pub contacts: Vec<Contact>,
    /// Index of the contact of each taxel, row by row.
    pub regions: Vec<Option<u32>>,
    /// Taxels whose force is not part of the totals and contacts, because it is
    /// known to be wrong (inconsistent, not converged) or there is none.
    pub left_out: usize,
    /// Channels whose reading was clipped, masked ones not counted.
    pub clipped: usize,
    /// Whether the force history is uncertain: a relaxing device, and a pause
    /// longer than three of its relaxation times not long ago.
    pub history_uncertain: bool,
}

/// Options of the array estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatorOptions {
    /// Search for the force of a unit.
    pub search: SearchOptions,
    /// A taxel is touched above this many standard deviations of its normal
    /// force; default 6.
    pub contact_deviations: f64,
    /// ... and above this share of the full scale; default 0.01.
    pub contact_share: f64,
    /// Bound of the consistency residual; default 4, which a sound unit
    /// exceeds in 6e-5 of all frames.
    pub residual_bound: f64,
    /// Frames in a row above the bound before a unit is called inconsistent;
    /// default 5.
    pub residual_persistence: u32,
    /// Residual that makes a unit inconsistent at once; default 6, which a
    /// sound unit exceeds in 2e-9 of all frames.
    pub residual_alarm: f64,
}

impl Default for EstimatorOptions {
    fn default() -> Self {
        Self {
            search: SearchOptions::default(),
            contact_deviations: 6.0,
            contact_share: 0.01,
            residual_bound: 4.0,
            residual_persistence: 5,
            residual_alarm: 6.0,
        }
    }
}

/// End of a rest capture, if a frame was its last.
pub type Captured = Option<Result<(), RestRefused>>;

/// A frame that the estimator cannot use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
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
    #[error("the channels carry {found:?}; this device has other ones")]
    Quantity {
        /// What they carry.
        found: Quantity,
    },
    /// A device without a physical model, of which nothing was learned yet.
    #[error("nothing was learned of this device yet: train first")]
    Untrained,
}

/// Turns frames into touch; the same frames give the same touches.
#[derive(Debug, Clone)]
pub struct Estimator {
    calibration: Calibration,
    options: EstimatorOptions,
    quantity: Quantity,
    /// Least and most that a capacitor without fault reads, F.
    bounds: Vec<[[f64; 4]; 2]>,
    relaxation: Vec<Relaxation<3>>,
    /// Of the force of each taxel along x, y and z.
    histories: Vec<[LoadHistory; 3]>,
    /// Seconds since each taxel last had a force.
    pause: Vec<f64>,
    strikes: Vec<u32>,
    segmentation: Segmentation,
    cells: Vec<Cell>,
    baseline: Baseline,
    readings: Vec<f64>,
    touch: Touch,
    last_time_ns: Option<u64>,
    uncertain_until_ns: u64,
    capture: Option<RestCapture>,
}

/// A reading below this share of the plate's rest capacitance is no plate.
const LEAST_SHARE: f64 = 0.2;
/// A reading above the closed plate by more than this is no plate either.
const MOST_SHARE: f64 = 1.05;
/// The capacitors of a unit drift alike, with the temperature; four equal errors
/// weigh in a force as much as four independent ones of twice the size.
const DRIFT_TOGETHER: f64 = 2.0;
/// A tile with less than this share of its air left counts as touching: a tile
/// that stands on its electrode reads what it read at first contact, which the
/// search meets from the open side.
const TOUCHING_SHARE: f64 = 0.05;
/// Unless contact stopped the search, only a capacitor above this share of the
/// most it can read may touch; below, even an edge is still open.
const NEAR_SHARE: f64 = 0.45;

impl Estimator {
    /// An estimator for frames whose values are `quantity`.
    ///
    /// # Errors
    /// [`FrameError::Quantity`] when the device cannot have such values.
    pub fn new(
        calibration: Calibration,
        quantity: Quantity,
        options: EstimatorOptions,
    ) -> Result<Self, FrameError> {
        if !matches!(quantity, Quantity::Counts | Quantity::Capacitance) {
            return Err(FrameError::Quantity { found: quantity });
        }
        let taxels = calibration.layout.taxels();
        let layout = &calibration.layout;
        let segmentation = Segmentation::new(layout.rows, layout.columns, layout.pitch);
        let noise = calibration.deviation.as_flattened().to_vec();
        let mut baseline = Baseline::new(BaselineOptions::new(noise));
        baseline.tare(0, &calibration.rest());
        let mut estimator = Self {
            baseline,
            readings: Vec::with_capacity(4 * taxels),
            relaxation: vec![Relaxation::new(&calibration.relaxation); taxels],
            histories: vec![Default::default(); taxels],
            pause: vec![0.0; taxels],
            strikes: vec![0; taxels],
            bounds: Vec::new(),
            touch: empty_touch(taxels),
            segmentation,
            cells: Vec::new(),
            calibration,
            options,
            quantity,
            last_time_ns: None,
            uncertain_until_ns: 0,
            capture: None,
        };
        estimator.tabulate();
        Ok(estimator)
    }

    /// The calibration in force.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The readings of the empty device, F, four for each taxel, and every
    /// change of them.
    pub fn baseline(&self) -> &Baseline {
        &self.baseline
    }

    /// Replaces the calibration. The relaxation history begins anew: it holds
    /// forces of the old one.
    pub fn recalibrate(&mut self, calibration: Calibration) {
        self.calibration = calibration;
        let noise = self.calibration.deviation.as_flattened().to_vec();
        self.baseline.set_noise(noise);
        self.baseline
            .tare(self.touch.time_ns, &self.calibration.rest());
        self.strikes.fill(0);
        self.relaxation
            .fill(Relaxation::new(&self.calibration.relaxation));
        self.histories.fill(Default::default());
        self.pause.fill(0.0);
        self.tabulate();
    }

    fn tabulate(&mut self) {
        let deviations = &self.calibration.deviation;
        let units = self.calibration.units.iter().zip(deviations);
        self.bounds = units.map(|(unit, sigma)| bounds(unit, sigma)).collect();
        let layout = &self.calibration.layout;
        let cell = |index| empty_cell(layout.flat_position(index));
        self.cells = (0..layout.taxels()).map(cell).collect();
    }

    /// Begins a rest capture over the next `frames` frames.
    pub fn begin_rest_capture(&mut self, frames: usize) {
        self.capture = Some(RestCapture::new(self.calibration.layout.taxels(), frames));
    }

    /// Whether a rest capture is under way.
    pub fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    /// Estimates one frame.
    ///
    /// The second value is the end of a rest capture, when this frame was its
    /// last.
    ///
    /// # Errors
    /// [`FrameError::Channels`] for a frame of another device.
    pub fn push(&mut self, frame: &Frame) -> Result<(&Touch, Captured), FrameError> {
        let taxels = self.calibration.layout.taxels();
        if frame.values.len() != 4 * taxels {
            return Err(FrameError::Channels {
                found: frame.values.len(),
                expected: 4 * taxels,
            });
        }
        let dt = self.step_time(frame.time_ns);
        self.touch.sequence = frame.sequence;
        self.touch.time_ns = frame.time_ns;
        self.touch.clipped = 0;
        for (taxel, values) in frame.values.chunks_exact(4).enumerate() {
            self.estimate_taxel(taxel, values, dt);
        }
        let captured = self.capture_frame();
        self.sum_up();
        self.follow_drift();
        Ok((&self.touch, captured))
    }

    /// Seconds since the last frame; marks the history after a long pause.
    fn step_time(&mut self, time_ns: u64) -> f64 {
        let last = self.last_time_ns.replace(time_ns).unwrap_or(time_ns);
        let dt = time_ns.saturating_sub(last) as f64 * 1e-9;
        let longest = self
            .relaxation
            .first()
            .map_or(0.0, Relaxation::longest_time);
        if longest > 0.0 && dt > 3.0 * longest {
            self.uncertain_until_ns = time_ns.saturating_add((3.0 * longest * 1e9) as u64);
        }
        self.touch.history_uncertain = time_ns < self.uncertain_until_ns;
        dt
    }

    fn capacitances(&mut self, taxel: usize, values: &[f64]) -> [f64; 4] {
        if self.quantity == Quantity::Capacitance {
            return std::array::from_fn(|i| values[i]);
        }
        let masked = self.calibration.masked[taxel];
        std::array::from_fn(|i| {
            self.calibration
                .channel
                .capacitance(values[i])
                .unwrap_or_else(|| {
                    self.touch.clipped += usize::from(!values[i].is_nan() && !masked[i]);
                    f64::NAN
                })
        })
    }

    fn estimate_taxel(&mut self, taxel: usize, values: &[f64], dt: f64) {
        let capacitance = self.capacitances(taxel, values);
        let masked = self.calibration.masked[taxel];
        let [least, most] = self.bounds[taxel];
        let faulty: [bool; 4] = std::array::from_fn(|i| {
            let sound = capacitance[i] > least[i] && capacitance[i] < most[i];
            !masked[i] && !sound
        });
        let usable: [bool; 4] = std::array::from_fn(|i| !masked[i] && !faulty[i]);
        let noise = self.calibration.deviation[taxel];
        let channel = |i| 4 * taxel + i;
        let sigma = std::array::from_fn(|i| {
            noise[i].hypot(DRIFT_TOGETHER * self.baseline.deviation(channel(i)))
        });
        let empty = std::array::from_fn(|i| capacitance[i] - self.baseline.drift(channel(i)));
        let unit = &self.calibration.units[taxel];
        let mut found = estimate_unit(unit, empty, sigma, usable, &self.options.search);
        let near = found.outcome == Outcome::Blocked
            || (0..4).any(|i| usable[i] && capacitance[i] > NEAR_SHARE * most[i]);
        let touching = if near {
            touching(unit, &found)
        } else {
            [false; 4]
        };
        self.relax(taxel, &mut found, dt);
        self.carry(taxel, &mut found);
        let state = self.judge(taxel, &found, touching.contains(&true), masked, faulty);
        self.touch.taxels[taxel] = TaxelTouch {
            capacitance,
            force: found.force,
            covariance: found.covariance,
            residual: found.signed_residual,
            state,
            touching,
            unusable: usable.map(|usable| !usable),
        };
    }

    /// Adds what the relaxing springs carry.
    fn relax(&mut self, taxel: usize, found: &mut UnitEstimate, dt: f64) {
        if self.calibration.relaxation.is_empty() {
            return;
        }
        // Without a force the springs relax unseen; the next force is joined to
        // the last one by a straight line.
        self.pause[taxel] += dt;
        if found.force[0].is_nan() {
            return;
        }
        let dt = std::mem::take(&mut self.pause[taxel]);
        let operator = &mut self.relaxation[taxel];
        let gain = operator.instant_gain(dt);
        found.force = operator.push(found.force, dt);
        found.covariance = found
            .covariance
            .map(|row| row.map(|value| value * gain * gain));
    }

    /// Leaves of the force of loading what is left on unloading.
    fn carry(&mut self, taxel: usize, found: &mut UnitEstimate) {
        for (axis, law) in self.calibration.hysteresis.iter().enumerate() {
            let Some(law) = law else { continue };
            let lags = self.histories[taxel][axis].push(found.force[axis]);
            let share = law.share(&lags);
            found.force[axis] *= share;
            for other in 0..3 {
                found.covariance[axis][other] *= share;
                found.covariance[other][axis] *= share;
            }
        }
    }

    fn judge(
        &mut self,
        taxel: usize,
        found: &UnitEstimate,
        touching: bool,
        masked: [bool; 4],
        faulty: [bool; 4],
    ) -> State {
        let strike = found.signed_residual.abs() > self.options.residual_bound;
        let alarm = found.signed_residual.abs() > self.options.residual_alarm;
        let strikes = &mut self.strikes[taxel];
        *strikes = if strike { strikes.saturating_add(1) } else { 0 };
        let beyond = found
            .force
            .iter()
            .any(|force| force.abs() > self.calibration.full_scale);
        let masked_count = masked.iter().filter(|masked| **masked).count();
        match found.outcome {
            _ if masked_count > 1 => State::Masked,
            _ if faulty.contains(&true) => State::Faulty,
            Outcome::TooFew => State::Faulty,
            Outcome::Blocked => State::Contact,
            _ if touching => State::Contact,
            Outcome::NotConverged => State::NotConverged,
            Outcome::Converged if alarm || *strikes >= self.options.residual_persistence => {
                State::Inconsistent
            }
            Outcome::Converged if beyond => State::OutOfRange,
            Outcome::Converged if masked_count == 1 => State::Unchecked,
            Outcome::Converged => State::Ok,
        }
    }

    /// The baseline takes what no contact explains.
    fn follow_drift(&mut self) {
        let taxels = &self.touch.taxels;
        self.readings.clear();
        self.readings
            .extend(taxels.iter().flat_map(|taxel| taxel.capacitance));
        let regions = &self.touch.regions;
        self.baseline
            .push(self.touch.time_ns, &self.readings, |channel| {
                regions[channel / 4].is_some()
            });
    }

    fn capture_frame(&mut self) -> Option<Result<(), RestRefused>> {
        let capture = self.capture.as_mut()?;
        if !capture.push(self.touch.taxels.iter().map(|taxel| taxel.capacitance)) {
            return None;
        }
        let result = capture.finish(&self.calibration);
        self.capture = None;
        Some(result.map(|calibration| self.recalibrate(calibration)))
    }

    fn sum_up(&mut self) {
        let layout = &self.calibration.layout;
        let mut total = Wrench::default();
        let mut covariance = [[0.0; 3]; 3];
        self.touch.left_out = 0;
        for (index, taxel) in self.touch.taxels.iter().enumerate() {
            if !taxel.counts() {
                self.touch.left_out += 1;
                continue;
            }
            total.add(&layout.wrench(index, taxel.force));
            // On a plane all taxels stand alike.
            let turned = match layout.mount {
                Mount::Flat => taxel.covariance,
                Mount::Cylinder(_) => layout.turn_covariance(index, &taxel.covariance),
            };
            for (sum, row) in covariance.iter_mut().flatten().zip(turned.iter().flatten()) {
                *sum += row;
            }
        }
        self.touch.total = total;
        self.touch.total_covariance = covariance;
        let floor = self.options.contact_share * self.calibration.full_scale;
        for (cell, taxel) in self.cells.iter_mut().zip(&self.touch.taxels) {
            cell.force = taxel.force;
            cell.weight = if taxel.counts() {
                taxel.force[2]
            } else {
                f64::NAN
            };
            cell.deviation = taxel.covariance[2][2].sqrt();
            cell.force_covariance = taxel.covariance;
            cell.state = taxel.state;
            cell.threshold = floor.max(self.options.contact_deviations * cell.deviation);
        }
        let cell = |index: usize| self.cells[index];
        self.touch.centre_of_pressure = self.segmentation.run(cell, &mut self.touch.contacts);
        self.segmentation.label(&mut self.touch.regions);
    }
}

/// Least and most that a capacitor without fault reads, F.
fn bounds(unit: &UnitModel, sigma: &[f64; 4]) -> [[f64; 4]; 2] {
    let plates = &unit.plates;
    let beyond = |share: f64, reading: f64, i: usize| {
        let parallel = plates.parallel_capacitance[i];
        parallel + share * (reading - parallel)
    };
    [
        std::array::from_fn(|i| beyond(LEAST_SHARE, plates.rest_capacitance(i), i)),
        std::array::from_fn(|i| {
            beyond(MOST_SHARE, plates.closed_capacitance(i), i) + 6.0 * sigma[i]
        }),
    ]
}

/// Capacitors that touch at the estimated force.
fn touching(unit: &UnitModel, found: &UnitEstimate) -> [bool; 4] {
    let (_, response) = unit.predict(found.force);
    std::array::from_fn(|i| {
        response.plates[i].least_air_gap < TOUCHING_SHARE * unit.plates.air_gap[i]
    })
}

fn empty_cell(position: [f64; 2]) -> Cell {
    Cell {
        position,
        weight: f64::NAN,
        deviation: f64::NAN,
        threshold: f64::NAN,
        force: [f64::NAN; 3],
        force_covariance: [[f64::NAN; 3]; 3],
        state: State::Masked,
    }
}

fn empty_touch(taxels: usize) -> Touch {
    let taxel = TaxelTouch {
        capacitance: [f64::NAN; 4],
        force: [f64::NAN; 3],
        covariance: [[f64::NAN; 3]; 3],
        residual: f64::NAN,
        state: State::Masked,
        touching: [false; 4],
        unusable: [true; 4],
    };
    Touch {
        sequence: 0,
        time_ns: 0,
        taxels: vec![taxel; taxels],
        total: Wrench::default(),
        total_covariance: [[0.0; 3]; 3],
        centre_of_pressure: None,
        contacts: Vec::new(),
        regions: Vec::new(),
        left_out: taxels,
        clipped: 0,
        history_uncertain: false,
    }
}
