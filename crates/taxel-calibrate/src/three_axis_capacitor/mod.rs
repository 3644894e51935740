//! Calibration of three-axis units (P2) from a bench: forces of a gauge and
//! four capacitances or codes, for one taxel of an array or several.
//!
//! Rest, parallel capacitance, gap and the 3 × 3 compliance with its even
//! terms are one fit of each taxel. The twist is no column of it: four
//! capacitances are the readings, three displacements the model.

mod checks;
mod columns;
mod hysteresis;
mod noise;
mod problem;
mod result;
mod stiffness;
mod synthetic;

use rayon::prelude::*;

use crate::hysteresis::law_of;
use crate::outcome::{
    BenchOptions, CalibrateOptions, CalibratedSensor, Calibrator, CovarianceBlock, ModelComparison,
    NamedSensor, Outcome, wanted,
};
use crate::readings::BenchData;
use crate::remark::Remark;
use crate::split::picked;
use taxel::calibration::ChannelScale;
use taxel::predict::LoadColumn;
use taxel::sensor::{CalibratedUnit, Element, Sensor};
use taxel::transduction::UnitModel;
use taxel_numerics::least_squares::linear;
use taxel_numerics::least_squares::{
    Fit, FitError, FitOptions, Parameter, Status, fit, profile_interval,
};
use taxel_recording::InputError;

use checks::Measured;
use columns::{COLUMNS, TIME_AT};
use noise::Noise;
use problem::{Bench, COMPLIANCE, GAP, OWN, Reading, SINKING, name, unit, values, with_values};

/// What the names of the parameters of a taxel begin with.
const PREFIX: &str = "taxel_";

/// Calibrates the units of one array.
pub(super) struct ThreeAxisCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    drawn: UnitModel,
    made: Vec<UnitModel>,
    channel: ChannelScale,
    /// Of a reading by the board's own figures, F.
    deviation: f64,
}

static MODELS: [&str; 3] = ["matrix", "springs", "as-drawn"];

/// Which parameters are free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    /// All nine compliances and both sinkings.
    Matrix,
    /// No cross-talk.
    Springs,
    /// Only the air gaps.
    AsDrawn,
}

impl Model {
    const ALL: [Self; 3] = [Self::Matrix, Self::Springs, Self::AsDrawn];

    fn name(self) -> &'static str {
        MODELS[self as usize]
    }

    fn about(self) -> &'static str {
        match self {
            Self::Matrix => {
                "parallel capacitances, gaps, a full 3 x 3 compliance and the sinking of the bump"
            }
            Self::Springs => "the same without cross-talk",
            Self::AsDrawn => {
                "parallel capacitances and stiffnesses of the drawing; only the gaps are fitted"
            }
        }
    }

    /// Whether a parameter is free where a gauge moved the axes `moved`.
    ///
    /// Under a normal force alone cross-talk is not: four closings of their
    /// own would take from the shared stiffness what tells the parallel
    /// capacitances.
    fn frees(self, place: usize, moved: [bool; 3]) -> bool {
        let sides = moved[0] || moved[1];
        match place {
            0..GAP => self != Self::AsDrawn,
            GAP..COMPLIANCE => true,
            COMPLIANCE..SINKING => {
                let [row, axis] = [(place - COMPLIANCE) / 3, (place - COMPLIANCE) % 3];
                match self {
                    Self::Matrix => moved[axis] && (sides || row == axis),
                    Self::Springs => moved[axis] && row == axis,
                    Self::AsDrawn => false,
                }
            }
            _ => self != Self::AsDrawn && moved[place - SINKING],
        }
    }
}

/// A share of the rest capacitance, gap or stiffness that matters.
const SIZE: f64 = 0.05;
/// Rounds of weighing until noise and weights settle.
const MOST_ROUNDS: usize = 12;
const SETTLED: f64 = 1e-2;
/// A start at which a tile touches is made stiffer by this factor, this often.
const STIFFER: f64 = 1.1;
const TRIES: usize = 20;

/// One fitted model of one taxel.
struct Fitted {
    taxel: usize,
    parameters: Vec<Parameter>,
    fit: Fit,
    noise: Noise,
}

impl Fitted {
    fn unit(&self, drawn: &UnitModel) -> UnitModel {
        with_values(drawn, &self.fit.values())
    }
}

impl<'a> ThreeAxisCalibrator<'a> {
    /// `None` when the sensor is of another kind.
    pub(super) fn new(named: &'a NamedSensor<'a>) -> Option<Self> {
        let array = named.sensor.three_axis().ok()?;
        Some(Self {
            named,
            drawn: array.unit_model(),
            made: array.made(),
            channel: array.calibration().channel,
            deviation: array.board.deviation(),
        })
    }

    fn parameters(
        &self,
        model: Model,
        taxel: usize,
        start: &UnitModel,
        moved: [bool; 3],
    ) -> Vec<Parameter> {
        let rest = start.rest();
        let compliance = self.drawn.suspension.compliance;
        let of = |place: usize, at: f64| -> ([f64; 2], f64) {
            match place {
                0..GAP => ([-0.5 * rest[place], 0.95 * rest[place]], SIZE * rest[place]),
                GAP..COMPLIANCE => {
                    let air = self.drawn.plates.air_gap[place - GAP];
                    ([0.02 * air, 20.0 * air], SIZE * air)
                }
                COMPLIANCE..SINKING => {
                    let [row, axis] = [(place - COMPLIANCE) / 3, (place - COMPLIANCE) % 3];
                    let own = (compliance[row][row] * compliance[axis][axis]).sqrt();
                    let bounds = if row == axis {
                        [0.01 * at, 100.0 * at]
                    } else {
                        [-own, own]
                    };
                    (bounds, SIZE * own)
                }
                _ => ([-1.0, 1.0], SIZE),
            }
        };
        values(start)
            .into_iter()
            .enumerate()
            .map(|(place, at)| {
                let (bounds, size) = of(place, at);
                Parameter {
                    unit: unit(place),
                    bounds: if model.frees(place, moved) {
                        bounds
                    } else {
                        [at; 2]
                    },
                    size,
                    ..Parameter::new(format!("{PREFIX}{taxel}.{}", name(place)), at)
                }
            })
            .collect()
    }

    /// A unit near the readings for given parallel capacitances: gaps by its
    /// rest, stiffness by straight lines through the published displacements.
    fn start(&self, model: Model, of: &[Reading], parallel: [f64; 4]) -> Option<UnitModel> {
        let mut unit = self.drawn;
        unit.plates.parallel_capacitance = parallel;
        let rest = checks::rest_of(of);
        let mut unit = unit.at_rest(rest)?;
        if model == Model::AsDrawn {
            return Some(unit);
        }
        for axis in 0..3 {
            let gauged: Vec<&Reading> = of.iter().filter(|r| r.gauged[axis]).collect();
            let design: Vec<Vec<f64>> = gauged.iter().map(|r| vec![r.force[axis], 1.0]).collect();
            let motion =
                |r: &&Reading| unit.effective_motion(rest, r.capacitance).displacement[axis];
            let target: Vec<f64> = gauged.iter().map(motion).collect();
            if let Some(line) = linear::solve(&design, &target)
                && line.coefficients[0] > 0.0
            {
                unit.suspension.compliance[axis][axis] = line.coefficients[0];
            }
        }
        for _ in 0..TRIES {
            if of.iter().all(|r| problem::misfit(&unit, r).is_some()) {
                break;
            }
            for entry in unit.suspension.compliance.as_flattened_mut() {
                *entry /= STIFFER;
            }
        }
        Some(unit)
    }

    /// The best fit of one taxel over the starts, with the noise that its
    /// readings show.
    fn fit(
        &self,
        model: Model,
        of: &[Reading],
        measured: Measured,
        options: &CalibrateOptions,
    ) -> Result<Fitted, FitError> {
        let drawn = self.drawn.plates.parallel_capacitance;
        let mut parallels = vec![measured.map_or(drawn, |(parallel, _)| parallel)];
        if model != Model::AsDrawn && measured.is_none() {
            let rest = checks::rest_of(of);
            parallels.extend([0.0, 0.15].map(|share| rest.map(|c| share * c)));
        }
        let mut best: Option<Fitted> = None;
        let mut failure = FitError::NoStart {
            name: name(0),
            value: parallels[0][0],
        };
        for parallel in parallels {
            let Some(start) = self.start(model, of, parallel) else {
                continue;
            };
            match self.fit_from(model, &start, of, measured, options) {
                Ok(found)
                    if best.as_ref().is_none_or(|best| {
                        found.noise.size(of, &found.fit) < best.noise.size(of, &best.fit)
                    }) =>
                {
                    best = Some(found);
                }
                Ok(_) => {}
                Err(error) => failure = error,
            }
        }
        best.ok_or(failure)
    }

    fn fit_from(
        &self,
        model: Model,
        start: &UnitModel,
        of: &[Reading],
        measured: Measured,
        options: &CalibrateOptions,
    ) -> Result<Fitted, FitError> {
        let taxel = of.first().map_or(0, |r| r.taxel);
        let moved = std::array::from_fn(|axis| of.iter().any(|r| r.gauged[axis]));
        let mut noise = Noise::first(of, self.deviation);
        let fit_options = options.fitting(noise::is_given(of));
        let mut at = *start;
        let mut found: Option<(Vec<Parameter>, Fit)> = None;
        for _ in 0..MOST_ROUNDS {
            let parameters = self.parameters(model, taxel, &at, moved);
            let bench =
                Bench::new(self.drawn, &at, of, &noise.of(of), measured).ok_or_else(|| {
                    FitError::NoStart {
                        name: name(GAP),
                        value: at.plates.air_gap[0],
                    }
                })?;
            let next = fit(&bench, &parameters, &fit_options)?;
            let step = moved_by(&next, &values(&at));
            at = with_values(&self.drawn, &next.values());
            let changed = noise.weigh_again(of, bench.whitening(), &next);
            found = Some((parameters, next));
            if changed.max(step) < SETTLED {
                break;
            }
        }
        let (parameters, fit) = found.ok_or(FitError::TooFew {
            readings: of.len(),
            unknowns: OWN,
        })?;
        Ok(Fitted {
            taxel,
            parameters,
            fit,
            noise,
        })
    }

    fn with_profiles(
        &self,
        fitted: &mut Fitted,
        of: &[Reading],
        measured: Measured,
    ) -> Result<(), FitError> {
        let unit = fitted.unit(&self.drawn);
        let Some(bench) = Bench::new(self.drawn, &unit, of, &fitted.noise.of(of), measured) else {
            return Ok(());
        };
        for j in 0..fitted.parameters.len() {
            if fitted.fit.estimates[j].status == Status::Identified {
                let options = FitOptions::default();
                fitted.fit.estimates[j].interval =
                    profile_interval(&bench, &fitted.parameters, &options, &fitted.fit, j)?;
            }
        }
        Ok(())
    }

    /// Fits of one model to all taxels.
    fn fits(
        &self,
        model: Model,
        taxels: &[Vec<Reading>],
        measured: Measured,
        options: &CalibrateOptions,
    ) -> Result<Vec<Fitted>, FitError> {
        taxels
            .par_iter()
            .map(|of| self.fit(model, of, measured, options))
            .collect()
    }
}

/// The largest step of a fit from where its weights were made, in deviations.
fn moved_by(found: &Fit, from: &[f64]) -> f64 {
    let steps = found.estimates.iter().zip(from).map(|(estimate, from)| {
        let step = (estimate.value - from).abs();
        if step > 0.0 {
            step / estimate.deviation
        } else {
            0.0
        }
    });
    steps.fold(0.0, f64::max)
}

/// Readings of each taxel that are held out, or are not.
fn pick(taxels: &[Vec<Reading>], options: &CalibrateOptions, held: bool) -> Vec<Vec<Reading>> {
    let of = |readings: &Vec<Reading>| {
        let marked: Vec<bool> = readings.iter().map(|r| r.marked).collect();
        let flags = options.hold_out.held(&marked);
        picked(readings, &flags, held)
    };
    taxels.iter().map(of).collect()
}

impl Calibrator for ThreeAxisCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        "taxel"
    }

    fn models(&self) -> &'static [&'static str] {
        &MODELS
    }

    fn calibrate(
        &self,
        data: &BenchData,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        let wanted = Model::ALL[wanted(&MODELS, options)?];
        let mut remarks = data.remarks.clone();
        let all = checks::readings(self, data, &mut remarks)?;
        let measured = checks::measured(data)?;
        let of = |taxel: usize| all.iter().filter(|r| r.taxel == taxel).copied().collect();
        let read: Vec<Vec<Reading>> = checks::taxels(&all).into_iter().map(of).collect();
        // Without a clock nothing says which readings are of unloading.
        let in_time = data.given[TIME_AT];
        let taxels: Vec<Vec<Reading>> = if in_time {
            let loading = |of: &Vec<Reading>| hysteresis::loading(of, &mut remarks);
            read.iter().map(loading).collect()
        } else {
            let message = "without a column time all readings are fitted as of loading";
            remarks.push(Remark::whole(message));
            read.clone()
        };
        for of in &taxels {
            checks::enough(data, of)?;
        }
        let (seen, unseen) = (pick(&taxels, options, false), pick(&taxels, options, true));
        let any_unseen = unseen.iter().any(|of| !of.is_empty());
        let wrong = |model: Model, note: &str, error: FitError| {
            let help =
                "check the units and the sensor file, press less far, or choose another --model";
            data.error("", format!("{}{note}: {error}", model.name()), help)
        };
        let mut best = Vec::new();
        let mut models = Vec::new();
        let mut hold_out = Vec::new();
        for model in Model::ALL {
            let fits = match self.fits(model, &taxels, measured, options) {
                Ok(fits) => fits,
                Err(error) if model == wanted => return Err(wrong(model, "", error)),
                Err(error) => {
                    let message = format!("{} was not fitted: {error}", model.name());
                    remarks.push(Remark::whole(message));
                    continue;
                }
            };
            let mut comparison = self.compared(model, &fits, &taxels);
            if any_unseen {
                match self.fits(model, &seen, measured, options) {
                    Ok(trained) => {
                        comparison.hold_out = Some(self.relative(&trained, &unseen, &taxels));
                        if model == wanted {
                            hold_out = self.residuals(&trained, &unseen, &taxels);
                        }
                    }
                    Err(error) if model == wanted => {
                        return Err(wrong(model, " without the readings held out", error));
                    }
                    Err(_) => {}
                }
            }
            if model == wanted {
                models.insert(0, comparison);
                best = fits;
            } else {
                models.push(comparison);
            }
        }
        self.remark_on(&best, &read, &mut remarks);
        let hysteresis = if in_time {
            hysteresis::of_array(self, &best, &read, options)
        } else {
            Vec::new()
        };
        if options.profile {
            for (fitted, of) in best.iter_mut().zip(&taxels) {
                self.with_profiles(fitted, of, measured)
                    .map_err(|error| wrong(wanted, "", error))?;
            }
        }
        for one in &hysteresis {
            remarks.push(Remark::whole(one.about.clone()));
        }
        let mut outcome = Outcome {
            element: Element::key(&self.named.sensor.element),
            model: wanted.name(),
            sensors: vec![CalibratedSensor::of(self.named, PREFIX)],
            parameters: result::parameters(&best),
            covariance: CovarianceBlock::of(best.iter().map(|fitted| &fitted.fit)),
            open: self.open(&best),
            places: None,
            derived: self.derived(&best, &taxels),
            noise: result::noise_in_words(&best, &taxels),
            search: result::searches_in_words(&best, &taxels),
            residuals: self.residuals(&best, &taxels, &taxels),
            hold_out,
            held_out: options.hold_out.words(),
            models,
            scope: result::scope(&all),
            remarks,
            figures: self.figures(&best, &taxels),
        };
        outcome.add_loops(hysteresis);
        Ok(outcome)
    }

    fn bench(&self, options: &BenchOptions) -> String {
        let made = self.made.first().unwrap_or(&self.drawn);
        synthetic::bench(made, options)
    }
}

impl ThreeAxisCalibrator<'_> {
    fn compared(&self, model: Model, fits: &[Fitted], taxels: &[Vec<Reading>]) -> ModelComparison {
        let free = |p: &&Parameter| p.is_free();
        ModelComparison {
            name: model.name(),
            about: model.about(),
            unknowns: fits
                .iter()
                .map(|fitted| fitted.parameters.iter().filter(free).count())
                .sum(),
            residual: self.relative(fits, taxels, taxels),
            hold_out: None,
        }
    }
}

/// Puts the calibrated units beside a sensor file's drawing; `value` looks a
/// parameter up.
///
/// # Errors
/// The name of a parameter that is missing.
pub(super) fn apply(
    sensor: &mut Sensor,
    prefix: &str,
    value: &dyn Fn(&str) -> Option<f64>,
) -> Result<(), String> {
    let count = sensor.layout().taxels();
    let Element::ThreeAxisCapacitor(element) = &mut sensor.element else {
        return Err("element".into());
    };
    let drawn = element.unit_model();
    let mut calibrated = Vec::new();
    for taxel in 0..count {
        let full = |place: usize| format!("{prefix}{taxel}.{}", name(place));
        if value(&full(0)).is_none() {
            continue;
        }
        let found = (0..OWN).map(|place| value(&full(place)).ok_or_else(|| full(place)));
        let at: Vec<f64> = found.collect::<Result<_, _>>()?;
        calibrated.push(CalibratedUnit {
            taxel,
            unit: with_values(&drawn, &at),
        });
    }
    if calibrated.is_empty() {
        return Err(format!("{prefix}0.{}", name(0)));
    }
    element.calibrated = calibrated;
    element.hysteresis = std::array::from_fn(|axis| law_of(&hysteresis::prefix(axis), value));
    Ok(())
}

#[cfg(test)]
mod tests;
