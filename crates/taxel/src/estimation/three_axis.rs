//! Four capacitances of each unit to a force with three components (P2).

use std::f64::consts::FRAC_2_SQRT_PI;

use super::capacitors::{capacitor_facts, capacitor_scale};
use super::numbers::convert_within;
use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::swap::SwapWatch;
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::unit::{Outcome, SearchOptions, UnitEstimate, estimate_unit};
use super::{ChannelFacts, FrameError, Wiring};
use crate::acquisition::Quantity;
use crate::calibration::ThreeAxisCalibration;
use crate::mechanics::{LoadHistory, Relaxation};
use crate::signal::NumberScale;
use crate::transduction::ThreeAxisModel;

/// Options of the reader of three-axis units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeAxisOptions {
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

impl Default for ThreeAxisOptions {
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

/// Names of the capacitors of a unit in the order of a frame.
pub const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];

/// Reads arrays of three-axis units.
#[derive(Debug, Clone)]
pub struct ThreeAxisReader {
    drawn: ThreeAxisCalibration,
    calibration: ThreeAxisCalibration,
    options: ThreeAxisOptions,
    /// Numbers of a frame to capacitances.
    scale: NumberScale,
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    /// Least and most that a capacitor without fault reads, F.
    bounds: Vec<[[f64; 4]; 2]>,
    relaxation: Vec<Relaxation<3>>,
    /// History of the force of each taxel along x, y and z.
    histories: Vec<[LoadHistory; 3]>,
    /// Seconds since each taxel last had a force.
    pause: Vec<f64>,
    strikes: Vec<u32>,
    swaps: SwapWatch,
    uncertain_until_ns: u64,
}

/// A reading below this share of the plate's rest capacitance is no plate.
const LEAST_SHARE: f64 = 0.2;
/// A reading above the closed plate by more than this is no plate either.
const MOST_SHARE: f64 = 1.05;
/// The capacitors of a unit drift alike, with the temperature; four equal errors
/// weigh in a force as much as four independent ones of twice the size.
const DRIFT_TOGETHER: f64 = 2.0;
/// A tile with less than this share of its air left counts as closed: a tile
/// that stands on its electrode reads what it read at first contact, give or
/// take the noise.
const CLOSED_SHARE: f64 = 0.05;

impl ThreeAxisReader {
    /// A reader of frames whose values are `quantity`.
    ///
    /// # Errors
    /// [`FrameError::Quantity`] when the device cannot have such values.
    pub fn new(
        calibration: ThreeAxisCalibration,
        quantity: Quantity,
        options: ThreeAxisOptions,
    ) -> Result<Self, FrameError> {
        let scale = capacitor_scale(calibration.channel, &calibration.unit, quantity)?;
        let taxels = calibration.layout.taxels();
        let deviations = calibration.deviation.as_flattened().iter();
        let masked = calibration.masked.as_flattened().iter();
        let facts = deviations
            .zip(masked)
            .map(|(sigma, masked)| capacitor_facts(&scale, *sigma, *masked));
        let mut reader = Self {
            channels: facts.collect(),
            meaning: meaning(&calibration),
            relaxation: vec![Relaxation::new(&calibration.relaxation); taxels],
            histories: vec![Default::default(); taxels],
            pause: vec![0.0; taxels],
            strikes: vec![0; taxels],
            swaps: SwapWatch::new(taxels),
            bounds: Vec::new(),
            uncertain_until_ns: 0,
            drawn: calibration.clone(),
            calibration,
            options,
            scale,
        };
        reader.tabulate();
        Ok(reader)
    }

    /// The calibration in force.
    pub fn calibration(&self) -> &ThreeAxisCalibration {
        &self.calibration
    }

    fn tabulate(&mut self) {
        let deviations = &self.calibration.deviation;
        let units = self.calibration.units.iter().zip(deviations);
        self.bounds = units.map(|(unit, sigma)| bounds(unit, sigma)).collect();
    }

    /// Marks the history after a pause of `elapsed` s.
    fn step_time(&mut self, time_ns: u64, elapsed: f64) -> bool {
        let longest = self
            .relaxation
            .first()
            .map_or(0.0, Relaxation::longest_time);
        if longest > 0.0 && elapsed > 3.0 * longest {
            self.uncertain_until_ns = time_ns.saturating_add((3.0 * longest * 1e9) as u64);
        }
        time_ns < self.uncertain_until_ns
    }

    fn estimate_taxel(
        &mut self,
        taxel: usize,
        known: &Known<'_>,
        capacitance: &[f64; 4],
        states: &mut [ChannelState; 4],
    ) -> TaxelTouch {
        let masked = self.calibration.masked[taxel];
        let channel = |i| 4 * taxel + i;
        let empty: [f64; 4] = std::array::from_fn(|i| capacitance[i] - known.drift(channel(i)));
        let [least, most] = self.bounds[taxel];
        let usable: [bool; 4] = std::array::from_fn(|i| {
            let sound = empty[i] > least[i] && empty[i] < most[i];
            states[i].usable() && sound
        });
        let faulty: [bool; 4] = std::array::from_fn(|i| !masked[i] && !usable[i]);
        let noise = self.calibration.deviation[taxel];
        let sigma = std::array::from_fn(|i| {
            let drift = DRIFT_TOGETHER * DRIFT_TOGETHER * known.drift_variance(channel(i));
            (noise[i] * noise[i] + drift).sqrt()
        });
        let unit = &self.calibration.units[taxel];
        let mut found = estimate_unit(unit, empty, sigma, usable, &self.options.search);
        let closed = closed(unit, &found);
        found.force[2] += sinking_by_noise(unit, &found);
        self.relax(taxel, &mut found, known.elapsed.unwrap_or(0.0));
        self.carry(taxel, &mut found);
        let state = self.judge(taxel, &found, closed.contains(&true), masked, faulty);
        for i in 0..4 {
            if faulty[i] && states[i].usable() {
                states[i] = ChannelState::Faulty;
            } else if closed[i] && state != State::Inconsistent && states[i].usable() {
                states[i] = ChannelState::Closed;
            }
        }
        if state == State::Inconsistent && !known.capturing {
            let unit = &self.calibration.units[taxel];
            self.swaps.push(taxel, *capacitance, unit, noise);
        }
        TaxelTouch {
            value: found.force,
            covariance: found.covariance,
            residual: found.signed_residual,
            state,
            counted: false,
        }
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
        closed: bool,
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
            Outcome::NotConverged if !closed => State::NotConverged,
            // Contact excuses no contradiction: closed tiles still lie in a plane.
            _ if alarm || *strikes >= self.options.residual_persistence => State::Inconsistent,
            Outcome::Blocked | Outcome::NotConverged => State::Closed,
            Outcome::Converged if closed => State::Closed,
            Outcome::Converged if beyond => State::OutOfRange,
            Outcome::Converged if masked_count == 1 => State::Unchecked,
            Outcome::Converged => State::Ok,
        }
    }
}

impl Reader for ThreeAxisReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn rules(&self) -> Rules {
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Deviations(
                self.options.contact_deviations,
                self.options.contact_share * self.calibration.full_scale,
            ),
            counted: counting(&[
                State::Ok,
                State::Unchecked,
                State::Closed,
                State::OutOfRange,
                State::Faulty,
                State::Masked,
            ]),
            total: Total::Counted,
            drift: Drift::Followed,
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: 4,
                unit: "taxel",
                measures_noise: true,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        self.drawn.deviation.as_flattened().to_vec()
    }

    fn rest(&self) -> Vec<f64> {
        self.calibration.rest()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        convert_within(&self.scale, values, channels)
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        touch.history_uncertain = self.step_time(touch.time_ns, known.elapsed.unwrap_or(0.0));
        let Touch {
            channels, taxels, ..
        } = touch;
        let readings = channels.readings.as_chunks::<4>().0;
        let states = channels.states.as_chunks_mut::<4>().0;
        let units = readings.iter().zip(states).zip(taxels);
        for (taxel, ((readings, states), touch)) in units.enumerate() {
            *touch = self.estimate_taxel(taxel, known, readings, states);
        }
    }

    fn rest_problem(&self, unit: usize, rest: &[f64]) -> Option<String> {
        let readings = std::array::from_fn(|i| rest.get(i).copied().unwrap_or(f64::NAN));
        if self.drawn.units[unit].at_rest(readings).is_some() {
            return None;
        }
        let most = readings.into_iter().fold(0.0, f64::max);
        Some(format!(
            "taxel {unit} reads {:.1} fF, which leaves no air gap; check it or mask it",
            1e15 * most
        ))
    }

    fn set_rest(&mut self, rest: &[f64], noise: &[f64]) {
        let captured = rest.as_chunks::<4>().0.iter().zip(noise.as_chunks::<4>().0);
        for (taxel, (rest, noise)) in captured.enumerate() {
            let drawn = self.drawn.units[taxel];
            // The values were accepted when they were captured.
            self.calibration.units[taxel] = drawn.at_rest(*rest).unwrap_or(drawn);
            self.calibration.deviation[taxel] = *noise;
        }
        // The histories hold forces of the old units.
        self.relaxation
            .fill(Relaxation::new(&self.calibration.relaxation));
        self.histories.fill(Default::default());
        self.pause.fill(0.0);
        self.strikes.fill(0);
        self.swaps.forget();
        self.tabulate();
    }

    fn swapped(&self, unit: usize) -> &[[usize; 2]] {
        self.swaps.pairs(unit)
    }
}

fn meaning(calibration: &ThreeAxisCalibration) -> Meaning {
    let layout = &calibration.layout;
    let name = |taxel: usize, capacitor: &str| {
        let (row, column) = (taxel / layout.columns, taxel % layout.columns);
        format!("r{row}c{column}.{capacitor}")
    };
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: (0..layout.taxels())
            .flat_map(|taxel| CAPACITORS.map(|capacitor| name(taxel, capacitor)))
            .collect(),
        wiring: Wiring::PerTaxel(4),
        reading: Scale::of(&calibration.unit, Scale::new("capacitance", "fF", 1e-15)),
        value: Scale::new("force", "mN", 1e-3),
        components: 3,
        signed: true,
        full_scale: Some(calibration.full_scale),
        verified: Some(calibration.usable_force),
        picture: Picture::Heat,
        newtons: Some([1.0; 2]),
        total_known: true,
    }
}

/// Least and most that a capacitor without fault reads, F.
fn bounds(unit: &ThreeAxisModel, sigma: &[f64; 4]) -> [[f64; 4]; 2] {
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

/// Capacitors whose electrodes touch at the estimated force.
fn closed(unit: &ThreeAxisModel, found: &UnitEstimate) -> [bool; 4] {
    let air = unit.plates.air_gaps(&unit.suspension.deform(found.force));
    std::array::from_fn(|i| air[i] < CLOSED_SHARE * unit.plates.air_gap[i])
}

/// What the noise of F_x and F_y takes off the pressing force, N.
///
/// The sinking c|F_x| is subtracted as estimated, but noise alone makes |F_x|
/// √(2/π)·σ without any side force. c·(2/√π)·σ·exp(−F_x²/2σ²) has this
/// expectation at F_x = 0 and ends within a few σ.
fn sinking_by_noise(unit: &ThreeAxisModel, found: &UnitEstimate) -> f64 {
    let expected = |axis: usize| {
        let (sinking, deviation) = (
            unit.suspension.bump_sinking[axis],
            found.covariance[axis][axis].sqrt(),
        );
        if sinking == 0.0 {
            return 0.0;
        }
        let off = found.force[axis] / deviation;
        sinking * FRAC_2_SQRT_PI * deviation * (-0.5 * off * off).exp()
    };
    expected(0) + expected(1)
}
