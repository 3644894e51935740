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

use crate::device_model::{
    Calibratable, DeviceModel, Fitted as FittedTo, Model as NamedModel, Task, best,
};
use crate::hysteresis::law_of;
use crate::options::{CalibrateOptions, NamedSensor, SyntheticOptions};
use taxel::device::ThreeAxisArray;
use taxel::predict::LoadColumn;
use taxel::sensor::{CalibratedUnit, Element, Sensor};
use taxel::signal::NumberScale;
use taxel::transduction::{ThreeAxisModel, TileEdges};
use taxel_numerics::least_squares::{Fit, FitError, FitOptions, Parameter, Problem, fit};

use checks::Context;
use columns::COLUMNS;
use noise::Noise;
use problem::{
    Bench, COMPLIANCE, GAP, Known, Measured, OWN, Reading, SINKING, name, unit, values, with_values,
};

/// Prefix of the names of the parameters of a taxel.
const PREFIX: &str = "taxel_";

/// Calibrates the units of one array.
pub(super) struct ThreeAxisCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    drawn: ThreeAxisModel,
    made: Vec<ThreeAxisModel>,
    channel: NumberScale,
    /// Standard deviation of a reading by the board's own figures, F.
    deviation: f64,
    /// What the surroundings may add to the edges of the drawing, least and greatest, F.
    beside_edges: Option<[f64; 2]>,
}

static MODELS: [NamedModel; 3] = [
    NamedModel {
        name: "matrix",
        about: "parallel capacitances, gaps, a full 3 x 3 compliance and the sinking of the bump",
    },
    NamedModel {
        name: "springs",
        about: "the same without cross-talk",
    },
    NamedModel {
        name: "as-drawn",
        about: "parallel capacitances and stiffnesses of the drawing; only the gaps are fitted",
    },
];

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

    /// True if a parameter is free where a gauge moved the axes `moved`.
    ///
    /// Under a normal force alone cross-talk is not: four closings of their
    /// own would take from the shared stiffness what identifies the parallel
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

/// Least and greatest capacitance that the surroundings of a drawing may add to its edges, F:
/// over a grounded plane, and of a capacitor alone. `None` where it is typed in.
fn beside_edges(array: &ThreeAxisArray<'_>) -> Option<[f64; 2]> {
    let plates = array.unit_model().plates;
    let drawn = plates.edge_capacitance(0)?;
    let surroundings = array.edges().ok()?.surroundings;
    let of = |edges: TileEdges| edges.parallel(plates.electrode, plates.air_gap[0]) - drawn;
    Some(surroundings.map(of))
}

/// Middle and standard deviation of what lies anywhere between two limits alike (GUM 4.3.7).
fn even_between([least, greatest]: [f64; 2]) -> [f64; 2] {
    let half = 0.5 * (greatest - least);
    [least + half, half / 3_f64.sqrt()]
}

/// One fitted model of one taxel.
type Fitted = FittedTo<Reading, Noise>;

impl<'a> ThreeAxisCalibrator<'a> {
    /// `None` when the sensor is of another kind.
    pub(super) fn new(named: &'a NamedSensor<'a>) -> Option<Self> {
        let array = named.sensor.three_axis().ok()?;
        Some(Self {
            named,
            drawn: array.unit_model(),
            beside_edges: beside_edges(&array),
            made: array.made(),
            channel: array.calibration().channel,
            deviation: array.board.deviation(),
        })
    }

    /// Parallel capacitances that are known before the readings: those that were measured; else,
    /// where the edges follow from the drawing, what its surroundings may add to them.
    fn known(&self, measured: Measured) -> Option<Known> {
        let by_drawing = |limits: [f64; 2]| {
            let [middle, deviation] = even_between(limits);
            Known::common(middle, deviation)
        };
        let measured = measured.map(Known::measured);
        measured.or_else(|| self.beside_edges.map(by_drawing))
    }

    fn parameters(
        &self,
        model: Model,
        taxel: usize,
        start: &ThreeAxisModel,
        moved: [bool; 3],
    ) -> Vec<Parameter> {
        let rest = start.rest();
        let [compliance, here] = [&self.drawn, start].map(|unit| unit.suspension.compliance);
        // Sizes that change from where a fit comes out to where another does as deviations do,
        // C_par's nearly as the square of what the air gap holds and that of a compliance as
        // its root: what is identified is then no matter of how the noise fell.
        let facing = |unit: &ThreeAxisModel, place: usize| {
            1.0 - unit.plates.parallel_capacitance[place] / unit.rest()[place]
        };
        let of = |place: usize, at: f64| -> ([f64; 2], f64) {
            match place {
                0..GAP => {
                    let share = facing(start, place) / facing(&self.drawn, place);
                    let bounds = [-0.5 * rest[place], 0.95 * rest[place]];
                    (bounds, SIZE * rest[place] * share.powi(2))
                }
                GAP..COMPLIANCE => {
                    let air = self.drawn.plates.air_gap[place - GAP];
                    ([0.02 * air, 20.0 * air], SIZE * air)
                }
                COMPLIANCE..SINKING => {
                    let [row, axis] = [(place - COMPLIANCE) / 3, (place - COMPLIANCE) % 3];
                    let own = (compliance[row][row] * compliance[axis][axis]).sqrt();
                    let size = (here[row][row] * here[axis][axis]).powf(0.25) * own.sqrt();
                    let bounds = if row == axis {
                        [0.01 * at, 100.0 * at]
                    } else {
                        [-own, own]
                    };
                    (bounds, SIZE * size)
                }
                _ => ([-1.0, 1.0], SIZE),
            }
        };
        values(start)
            .into_iter()
            .enumerate()
            .map(|(place, at)| {
                let (bounds, size) = of(place, at);
                let free = model.frees(place, moved);
                Parameter {
                    unit: unit(place),
                    bounds: if free { bounds } else { [at; 2] },
                    size,
                    ..Parameter::new(format!("{PREFIX}{taxel}.{}", name(place)), at)
                }
            })
            .collect()
    }

    /// A unit near the readings for given parallel capacitances: gaps by its
    /// rest, stiffness by straight lines through the published displacements.
    fn start(&self, model: Model, of: &[Reading], parallel: [f64; 4]) -> Option<ThreeAxisModel> {
        let mut unit = self.drawn;
        unit.plates.parallel_capacitance = parallel;
        let rest = checks::rest_of(of);
        let mut unit = unit.at_rest(rest)?;
        if model == Model::AsDrawn {
            return Some(unit);
        }
        for axis in 0..3 {
            if let Some([slope, _]) = checks::compliance(&unit, of, axis)
                && slope > 0.0
            {
                unit.suspension.compliance[axis][axis] = slope;
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

    /// The best fit of one taxel from a unit near it, with the noise that its readings
    /// show.
    fn fit_from(
        &self,
        model: Model,
        start: &ThreeAxisModel,
        of: &[Reading],
        known: Option<Known>,
        options: &CalibrateOptions,
    ) -> Result<Fitted, FitError> {
        let taxel = taxel(of);
        let moved = std::array::from_fn(|axis| of.iter().any(|r| r.gauged[axis]));
        let mut noise = Noise::first(of, self.deviation);
        let given = noise::is_given(of);
        let fit_options = options.fitting(given);
        let mut at = *start;
        let mut found: Option<(Vec<Parameter>, Fit)> = None;
        for round in 0..MOST_ROUNDS {
            let parameters = self.parameters(model, taxel, &at, moved);
            let touching = || FitError::NoStart {
                name: name(GAP),
                value: at.plates.air_gap[0],
            };
            let bench = Bench::new(&self.drawn, (&at, round > 0), of, &noise.of(of), known);
            let bench = bench.ok_or_else(touching)?;
            let next = fit(&bench, &parameters, &fit_options)?;
            let step = moved_by(&next, &values(&at));
            at = with_values(&self.drawn, &next.values());
            let changed = noise.weigh_again(of, &bench, &next);
            found = Some((parameters, next));
            if round > 0 && changed.max(step) < SETTLED {
                break;
            }
        }
        let (parameters, fit) = found.ok_or(FitError::TooFew {
            readings: of.len(),
            unknowns: OWN,
        })?;
        Ok(Fitted {
            model: model as usize,
            parameters,
            fit,
            readings: of.to_vec(),
            options: FitOptions::default(),
            given,
            noise,
        })
    }

    /// The unit of a fit.
    fn unit(&self, fitted: &Fitted) -> ThreeAxisModel {
        with_values(&self.drawn, &fitted.fit.values())
    }
}

/// The taxel of some readings.
fn taxel(of: &[Reading]) -> usize {
    of.first().map_or(0, |reading| reading.taxel)
}

/// Its name in messages.
fn in_words(of: &[Reading]) -> String {
    format!("taxel {}", taxel(of))
}

/// Its name before those of its parameters.
fn name_of(of: &[Reading]) -> String {
    format!("{PREFIX}{}", taxel(of))
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

impl Calibratable for ThreeAxisCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        "taxel"
    }

    fn models(&self) -> &'static [NamedModel] {
        &MODELS
    }

    fn synthetic(&self, options: &SyntheticOptions) -> String {
        let made = self.made.first().unwrap_or(&self.drawn);
        synthetic::table(made, options)
    }
}

impl DeviceModel for ThreeAxisCalibrator<'_> {
    type Noise = Noise;

    const SEPARATE: bool = true;

    fn sensors(&self) -> Vec<(&NamedSensor<'_>, &str)> {
        vec![(self.named, PREFIX)]
    }

    fn fit(&self, task: &Task<'_, Self>) -> Result<Fitted, FitError> {
        let (model, of) = (Model::ALL[task.model], task.readings);
        let measured = task.context.measured;
        let drawn = self.drawn.plates.parallel_capacitance;
        let mut parallels = vec![measured.map_or(drawn, |(parallel, _)| parallel)];
        if model != Model::AsDrawn && measured.is_none() {
            let rest = checks::rest_of(of);
            parallels.extend([0.0, 0.15].map(|share| rest.map(|c| share * c)));
        }
        let none = FitError::NoStart {
            name: name(0),
            value: parallels[0][0],
        };
        let starts = parallels
            .iter()
            .filter_map(|parallel| self.start(model, of, *parallel));
        let known = self.known(measured);
        let from = |start| self.fit_from(model, &start, of, known, task.options);
        best(starts, none, from, |found| found.noise.size(of, &found.fit))
    }

    fn problem<'b>(
        &'b self,
        context: &'b Context,
        fitted: &'b Fitted,
    ) -> Option<Box<dyn Problem + 'b>> {
        let (readings, unit) = (&fitted.readings, self.unit(fitted));
        let noise = fitted.noise.of(readings);
        let bench = Bench::new(
            &self.drawn,
            (&unit, true),
            readings,
            &noise,
            self.known(context.measured),
        )?;
        Some(Box::new(bench))
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
    let drawn = element.unit_model(&sensor.array);
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
