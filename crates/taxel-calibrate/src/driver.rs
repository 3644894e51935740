//! The one way from a table of readings to an outcome, for every device.

use rayon::prelude::*;

use taxel::InputError;
use taxel_ground::work::Parts;
use taxel_numerics::least_squares::{
    Direction, Estimate, FitError, Member, Parameter, Status, wide_profile_interval,
};

use crate::clock::{one_clock, same_moment};
use crate::device_model::{Calibratable, DeviceModel, Findings, FittedOf, Judged, Model, Task};
use crate::options::CalibrateOptions;
use crate::outcome::{
    CovarianceBlock, ModelComparison, Outcome, ResidualSummary, paired, search_in_words,
};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::split::{HoldOut, by_series, picked};

/// Calibrates one kind of device.
pub trait Calibrator: Calibratable {
    /// Fits the readings of one table.
    ///
    /// # Errors
    /// For readings of other sensors, of other units, or too few.
    fn calibrate(
        &self,
        table: &ReadingTable,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        self.calibrate_all(std::slice::from_ref(table), options)
    }

    /// Fits the readings of one table, and learns from the indentations of another
    /// where the device learns from them.
    ///
    /// # Errors
    /// As [`Self::calibrate`].
    fn calibrate_all(
        &self,
        tables: &[ReadingTable],
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError>;
}

impl<D: Findings> Calibrator for D {
    fn calibrate_all(
        &self,
        tables: &[ReadingTable],
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        let (indentations, readings): (Vec<_>, Vec<_>) = tables
            .iter()
            .partition(|table| self.has_indentations(table));
        if let Some(table) = [&indentations, &readings]
            .into_iter()
            .find_map(|of| of.get(1))
        {
            let message = "a second table of the same kind";
            return Err(InputError::whole(&table.file, message).help(
                "put the readings into one table, and indentations at positions into another",
            ));
        }
        let mut outcome = match (readings.first(), self.as_drawn()) {
            (Some(table), _) => constants(self, table, options)?,
            (None, Some(drawn)) => drawn,
            (None, None) => return Err(InputError::whole("readings", "there is no table")),
        };
        if let Some(table) = indentations.first() {
            self.learn(&mut outcome, table)?;
        }
        Ok(outcome)
    }
}

/// Place among `models` of the one that is asked for, by default the first.
fn wanted(models: &[Model], options: &CalibrateOptions) -> Result<usize, InputError> {
    let Some(name) = &options.model else {
        return Ok(0);
    };
    let found = models.iter().position(|known| known.name == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = models.iter().map(|model| model.name).collect();
        InputError::whole("--model", format!("\"{name}\" is no model of this device"))
            .help(format!("use one of: {}", names.join(", ")))
    })
}

/// The constants of the asked model, with the other models beside it.
fn constants<D: Findings>(
    device: &D,
    table: &ReadingTable,
    options: &CalibrateOptions,
) -> Result<Outcome, InputError> {
    let wanted = wanted(device.models(), options)?;
    one_clock(table, device.columns())?;
    same_moment(table, device.columns(), device.group())?;
    let mut remarks = table.remarks.clone();
    let (context, all) = device.readings(table, &mut remarks)?;
    let series = by_series(&all);
    let loading = series
        .iter()
        .map(|of| device.loading(&context, of, &mut remarks));
    let loading: Vec<Vec<D::Reading>> = loading.filter(|of| !of.is_empty()).collect();
    for readings in &loading {
        for loads in device.loads(&context, readings) {
            loads.enough(table)?;
        }
    }
    extrapolations(device, &context, &loading, options.hold_out, &mut remarks);
    let run = Run {
        device,
        context: &context,
        table,
        options,
        wanted,
        bodies: if D::SEPARATE {
            loading
        } else {
            vec![loading.concat()]
        },
        held: series.iter().map(|of| options.hold_out.of(of)).collect(),
        series,
    };
    let mut candidates = run.candidates(&mut remarks)?;
    let (models, hold_out) = run.compared(&candidates, &mut remarks)?;
    let bodies = readings_of::<D>(&candidates[0]);
    device.explained(&run.judged(&candidates[0], &bodies), table)?;
    if options.profile || D::CURVED {
        for fitted in &mut candidates[0] {
            run.profiled(fitted)?;
        }
    }
    let best = &candidates[0];
    let found = run.judged(best, &bodies);
    let constants = device.beside(&found, &mut remarks);
    let loops = device.hysteresis(&found);
    for one in &loops {
        remarks.push(Remark::whole(one.about.clone()));
    }
    let parameters = best
        .iter()
        .flat_map(|one| paired(&one.parameters, &one.fit));
    let mut outcome = Outcome {
        parameters: parameters.collect(),
        covariance: CovarianceBlock::of(best.iter().map(|one| &one.fit)),
        open: best.iter().flat_map(|one| device.open(one)).collect(),
        derived: device.derived(&found),
        noise: noise_in_words(device, best),
        search: searches_in_words(device, best),
        residuals: device.residuals(&found),
        hold_out,
        held_out: options.hold_out.words(),
        models,
        scope: device.scope(&found),
        remarks: Remark::gathered(remarks),
        figures: device.figures(&found, &candidates),
        ..Outcome::new(device.models()[wanted].name, &device.sensors())
    };
    if !constants.is_empty() {
        let covariance = diagonal(&constants);
        outcome.add_constants(constants, covariance);
    }
    outcome.add_loops(loops);
    Ok(outcome)
}

/// Remarks where readings held out lie beyond the others.
fn extrapolations<D: DeviceModel>(
    device: &D,
    context: &D::Context,
    loading: &[Vec<D::Reading>],
    hold_out: HoldOut,
    remarks: &mut Vec<Remark>,
) {
    for readings in loading {
        let held = hold_out.of(readings);
        let loads = |wanted| {
            let part = picked(readings, &held, wanted);
            device.loads(context, &part).into_iter().next()
        };
        if let (Some(inside), Some(outside)) = (loads(false), loads(true))
            && let Some(message) = inside.beyond(&outside)
        {
            remarks.push(Remark::whole(message));
        }
    }
}

/// One calibration on its way.
struct Run<'a, D: DeviceModel> {
    device: &'a D,
    context: &'a D::Context,
    table: &'a ReadingTable,
    options: &'a CalibrateOptions,
    /// Place of the model that is asked for.
    wanted: usize,
    /// Readings of loading of each body.
    bodies: Vec<Vec<D::Reading>>,
    /// All readings of each series, and which are held out.
    series: Vec<Vec<D::Reading>>,
    held: Vec<Vec<bool>>,
}

/// The readings that each of these was fitted to.
fn readings_of<D: DeviceModel>(fits: &[FittedOf<D>]) -> Vec<Vec<D::Reading>> {
    fits.iter().map(|one| one.readings.clone()).collect()
}

impl<D: Findings> Run<'_, D> {
    fn name(&self, model: usize) -> &'static str {
        self.device.models()[model].name
    }

    /// Fits with the readings that judge them.
    fn judged<'b>(
        &'b self,
        fits: &'b [FittedOf<D>],
        readings: &'b [Vec<D::Reading>],
    ) -> Judged<'b, D> {
        Judged {
            context: self.context,
            fits,
            readings,
            all: &self.bodies,
            series: &self.series,
            held: &self.held,
        }
    }

    fn refused(&self, model: usize, note: &str, error: &FitError) -> InputError {
        let help = if note.is_empty() {
            "check the units and the sensor file, take more readings, or choose another --model"
        } else {
            "hold out fewer readings, or take more"
        };
        let message = format!("{}{note}: {error}", self.name(model));
        self.table.error("", message, help)
    }

    /// One fit for each body; `from` has those to all of its readings.
    fn fitted(
        &self,
        model: usize,
        bodies: &[Vec<D::Reading>],
        from: Option<&[FittedOf<D>]>,
    ) -> Result<Vec<FittedOf<D>>, FitError> {
        let one = |place: usize| {
            self.device.fit(&Task {
                context: self.context,
                model,
                readings: &bodies[place],
                options: self.options,
                from: from.map(|fits| &fits[place]),
            })
        };
        (0..bodies.len()).into_par_iter().map(one).collect()
    }

    /// The fits of all models that have an answer, those of the asked one first.
    fn candidates(&self, remarks: &mut Vec<Remark>) -> Result<Vec<Vec<FittedOf<D>>>, InputError> {
        let mut candidates = Vec::new();
        let models = self.device.models().len();
        let parts = Parts::new("fitting the models", models as u64);
        for model in 0..models {
            match self.fitted(model, &self.bodies, None) {
                Ok(fits) if model == self.wanted => candidates.insert(0, fits),
                Ok(fits) => candidates.push(fits),
                Err(error) if model == self.wanted => return Err(self.refused(model, "", &error)),
                Err(error) => {
                    let message = format!("{} was not fitted: {error}", self.name(model));
                    remarks.push(Remark::whole(message));
                }
            }
            parts.done(1);
        }
        Ok(candidates)
    }

    /// The models beside each other, with their errors at readings that a second
    /// fit does not see; of the asked one all residuals there.
    fn compared(
        &self,
        candidates: &[Vec<FittedOf<D>>],
        remarks: &mut Vec<Remark>,
    ) -> Result<(Vec<ModelComparison>, Vec<ResidualSummary>), InputError> {
        let (mut models, mut hold_out) = (Vec::new(), Vec::new());
        for (place, fits) in candidates.iter().enumerate() {
            let model = fits.first().map_or(self.wanted, |fitted| fitted.model);
            let used = readings_of::<D>(fits);
            let mut comparison = ModelComparison {
                name: self.name(model),
                about: self.device.models()[model].about,
                unknowns: fits.iter().map(FittedOf::<D>::unknowns).sum(),
                residual: self.device.relative(&self.judged(fits, &used)),
                hold_out: None,
            };
            let part = |wanted: bool| -> Vec<Vec<D::Reading>> {
                let of = |readings: &Vec<D::Reading>| {
                    picked(readings, &self.options.hold_out.of(readings), wanted)
                };
                used.iter().map(of).collect()
            };
            let (seen, unseen) = (part(false), part(true));
            if unseen.iter().any(|readings| !readings.is_empty()) {
                match self.fitted(model, &seen, Some(fits)) {
                    Ok(others) => {
                        let others = self.judged(&others, &unseen);
                        comparison.hold_out = Some(self.device.relative(&others));
                        if place == 0 {
                            hold_out = self.device.residuals(&others);
                        }
                    }
                    Err(error) if place == 0 => {
                        return Err(self.refused(model, " without the readings held out", &error));
                    }
                    Err(error) => remarks.push(Remark::whole(format!(
                        "{} was not fitted without the readings held out: {error}",
                        self.name(model)
                    ))),
                }
            }
            models.push(comparison);
        }
        Ok((models, hold_out))
    }

    /// Intervals of what is identified from profiles of the likelihood: of all with
    /// `--profile`, else of what is so badly known that the bend of the model matters. What
    /// its profile leaves open to one side is not identifiable.
    fn profiled(&self, fitted: &mut FittedOf<D>) -> Result<(), InputError> {
        let Some(problem) = self.device.problem(self.context, fitted) else {
            return Ok(());
        };
        let interval = |j: usize, width: f64| {
            let (parameters, found) = (&fitted.parameters, &fitted.fit);
            let options = &fitted.options;
            wide_profile_interval(problem.as_ref(), parameters, options, found, j, width)
        };
        let size = |j: usize| fitted.parameters[j].size;
        let identified = |j: &usize| fitted.fit.estimates[*j].status == Status::Identified;
        let wanted = |j: &usize| {
            self.options.profile || fitted.fit.estimates[*j].deviation > BENT * size(*j)
        };
        let places = (0..fitted.parameters.len()).filter(identified);
        let places: Vec<usize> = places.filter(wanted).collect();
        let parts = Parts::new("intervals by profiles", places.len() as u64);
        let intervals: Vec<(usize, [f64; 2], [f64; 2])> = places
            .into_iter()
            .map(|j| {
                let found = (j, interval(j, 1.0)?, interval(j, FAR)?);
                parts.done(1);
                Ok(found)
            })
            .collect::<Result<_, FitError>>()
            .map_err(|error| self.refused(self.wanted, "", &error))?;
        let opened = |(j, interval, far): (usize, [f64; 2], [f64; 2])| {
            let value = fitted.fit.estimates[j].value;
            let [below, above] = far.map(|end| (end - value).abs());
            let reach = below.max(above) / (FAR * fitted.quantile()) / size(j);
            let open = reach > 1.0 && fitted.parameters[j].prior.is_none();
            let direction = open.then(|| Direction {
                members: vec![Member {
                    parameter: j,
                    share: 1.0,
                }],
                deviation: reach,
                remedy: problem.remedy(&[j]),
            });
            (j, interval, direction)
        };
        let found: Vec<_> = intervals.into_iter().map(opened).collect();
        drop(problem);
        for (j, interval, direction) in found {
            let estimate = &mut fitted.fit.estimates[j];
            estimate.interval = interval;
            if let Some(direction) = direction {
                estimate.status = Status::NotIdentifiable;
                estimate.interval = fitted.parameters[j].bounds;
                fitted.fit.directions.push(direction);
            }
        }
        Ok(())
    }
}

/// Deviation over its size above which the interval of a parameter of a curved model is that
/// of its profile.
const BENT: f64 = 0.3;
/// Widths of the interval within which a parameter must be known: a fit that noise took to
/// where the model is steep would else count as a good one.
const FAR: f64 = 2.0;

/// Covariance of independent constants.
fn diagonal(constants: &[(Parameter, Estimate)]) -> Vec<Vec<f64>> {
    let row = |i: usize| {
        let mut row = vec![0.0; constants.len()];
        row[i] = constants[i].1.deviation.powi(2);
        row
    };
    (0..constants.len()).map(row).collect()
}

/// Origin of the noise.
fn noise_in_words<D: Findings>(device: &D, fits: &[FittedOf<D>]) -> String {
    if !fits.iter().all(|one| one.given) {
        return format!("estimated from the residuals{}", device.noise(fits));
    }
    let scale = fits.iter().map(|one| one.fit.scale).fold(0.0, f64::max);
    if scale <= 1.0 {
        return "given with each reading; chi-square agrees".into();
    }
    format!(
        "given with each reading, but chi-square refutes it: deviations and intervals are inflated by {}{scale:.2}",
        if fits.len() > 1 { "up to " } else { "" }
    )
}

/// Ends of the searches.
fn searches_in_words<D: Findings>(device: &D, fits: &[FittedOf<D>]) -> String {
    let of = |one: &FittedOf<D>| {
        let ended = search_in_words(&one.fit, one.given);
        match device.body(one) {
            Some(body) => format!("{body}: {ended}"),
            None => ended,
        }
    };
    fits.iter().map(of).collect::<Vec<_>>().join("; ")
}
