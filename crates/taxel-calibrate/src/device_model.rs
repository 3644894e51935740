//! What the driver of calibrations asks of a kind of device.

use taxel::figure::Figure;
use taxel::predict::LoadColumn;
use taxel_numerics::least_squares::{
    Estimate, Fit, FitError, FitOptions, NoiseSize, Parameter, Problem,
};
use taxel_recording::InputError;

use crate::hysteresis::Loops;
use crate::loads::Loads;
use crate::options::{CalibrateOptions, IndentationOptions, SyntheticOptions};
use crate::outcome::{CalibratedSensor, Derived, Outcome, ResidualSummary, Scope, open_in_words};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::split::OfSeries;

/// A model whose parameters readings can be fitted with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Model {
    /// Name, as after `--model`.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
}

/// What tables of a device look like, and tables whose truth is known.
pub trait Calibratable {
    /// Columns that a table may have, in the order of [`ReadingTable::number`].
    fn columns(&self) -> &'static [LoadColumn];

    /// Name of the column that says of which series a row is: one sensor, taxel or
    /// channel; empty where all rows are one series.
    fn group(&self) -> &'static str;

    /// Models that can be fitted, the usual one first.
    fn models(&self) -> &'static [Model];

    /// Synthetic calibration data as CSV, with their truth in comments.
    fn synthetic(&self, options: &SyntheticOptions) -> String;

    /// Synthetic indentations at known positions; none for a device that learns
    /// nothing from them.
    fn synthetic_indentations(&self, options: &IndentationOptions) -> Option<String> {
        let _ = options;
        None
    }
}

/// One model fitted to the readings of one body.
pub(crate) struct Fitted<R, N> {
    /// Place of the model.
    pub(crate) model: usize,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) fit: Fit,
    /// Readings that it was fitted to.
    pub(crate) readings: Vec<R>,
    /// Options of the profiles of its likelihood.
    pub(crate) options: FitOptions,
    /// Whether the noise was given with each reading.
    pub(crate) given: bool,
    /// Noise that was found.
    pub(crate) noise: N,
}

impl<R, N> Fitted<R, N> {
    /// Free parameters.
    pub(crate) fn unknowns(&self) -> usize {
        self.parameters.iter().filter(|p| p.is_free()).count()
    }
}

/// A fit of a device's model.
pub(crate) type FittedOf<D> = Fitted<<D as DeviceModel>::Reading, <D as DeviceModel>::Noise>;

/// One kind of device: its readings, its models with their parameters and slopes,
/// and what is said of a fit.
pub(crate) trait DeviceModel: Calibratable {
    /// One reading of a table.
    type Reading: OfSeries + Clone;
    /// What a fit finds of the noise.
    type Noise;
    /// What a table says of all its readings.
    type Context;

    /// Whether each series is a body with a fit of its own.
    const SEPARATE: bool = false;

    /// Key of the element in the sensor file.
    fn element(&self) -> &'static str;

    /// The sensors, with what their own parameters begin with.
    fn sensors(&self) -> Vec<CalibratedSensor>;

    /// The readings of a table in its order; what can be of no such device is an
    /// error.
    fn readings(
        &self,
        table: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<(Self::Context, Vec<Self::Reading>), InputError>;

    /// The readings of loading of each series.
    fn loading(
        &self,
        context: &Self::Context,
        series: &[Vec<Self::Reading>],
        remarks: &mut Vec<Remark>,
    ) -> Vec<Vec<Self::Reading>>;

    /// The loads of the readings of one series, for what they must span.
    fn loads(&self, context: &Self::Context, readings: &[Self::Reading]) -> Vec<Loads>;

    /// One fit for each body; `from` has those to all of its readings.
    fn fit_bodies(
        &self,
        context: &Self::Context,
        model: usize,
        bodies: &[Vec<Self::Reading>],
        options: &CalibrateOptions,
        from: Option<&[FittedOf<Self>]>,
    ) -> Result<Vec<FittedOf<Self>>, FitError>;

    /// The problem at its best values; `None` where the model has no answer.
    fn problem<'b>(
        &'b self,
        context: &'b Self::Context,
        fitted: &'b FittedOf<Self>,
    ) -> Option<Box<dyn Problem + 'b>>;

    /// Residual of the signal over its range in `all`, root of the mean square.
    fn relative(
        &self,
        context: &Self::Context,
        fits: &[FittedOf<Self>],
        readings: &[Vec<Self::Reading>],
        all: &[Vec<Self::Reading>],
    ) -> f64;

    /// Residuals of each kind of reading, with the ranges of `all`.
    fn residuals(
        &self,
        context: &Self::Context,
        fits: &[FittedOf<Self>],
        readings: &[Vec<Self::Reading>],
        all: &[Vec<Self::Reading>],
    ) -> Vec<ResidualSummary>;

    /// Whether the readings can be what their columns say, after the fit.
    fn explained(
        &self,
        context: &Self::Context,
        table: &ReadingTable,
        fits: &[FittedOf<Self>],
    ) -> Result<(), InputError> {
        let _ = (context, table, fits);
        Ok(())
    }

    /// Independent constants beside those of the fit, and remarks on all of it;
    /// `series` are all readings, those of unloading included.
    fn beside(
        &self,
        context: &Self::Context,
        fits: &[FittedOf<Self>],
        series: &[Vec<Self::Reading>],
        remarks: &mut Vec<Remark>,
    ) -> Vec<(Parameter, Estimate)> {
        let _ = (context, fits, series, remarks);
        Vec::new()
    }

    /// The hysteresis of the device; `held` says which readings of each series are
    /// held out.
    fn hysteresis(
        &self,
        context: &Self::Context,
        fits: &[FittedOf<Self>],
        series: &[Vec<Self::Reading>],
        held: &[Vec<bool>],
    ) -> Vec<Loops> {
        let _ = (context, fits, series, held);
        Vec::new()
    }

    /// Name of a body, where there may be several.
    fn body(&self, fitted: &FittedOf<Self>) -> Option<String> {
        let _ = fitted;
        None
    }

    /// Combinations of parameters that are not identifiable, in words.
    fn open(&self, fits: &[FittedOf<Self>]) -> Vec<String> {
        let words = |fitted: &FittedOf<Self>| open_in_words(&fitted.parameters, &fitted.fit);
        fits.iter().flat_map(words).collect()
    }

    /// Quantities that follow, with their intervals.
    fn derived(&self, context: &Self::Context, fits: &[FittedOf<Self>]) -> Vec<Derived> {
        let _ = (context, fits);
        Vec::new()
    }

    /// What noise that was not given was found, as a part of a sentence.
    fn noise(&self, fits: &[FittedOf<Self>]) -> String;

    /// Ranges of the readings.
    fn scope(
        &self,
        context: &Self::Context,
        fits: &[FittedOf<Self>],
        series: &[Vec<Self::Reading>],
    ) -> Vec<Scope>;

    /// Readings, models and residuals; the first candidate is the one in use.
    fn figures(&self, context: &Self::Context, candidates: &[Vec<FittedOf<Self>>]) -> Vec<Figure>;

    /// Whether a table has indentations at known positions.
    fn has_indentations(&self, table: &ReadingTable) -> bool {
        let _ = table;
        false
    }

    /// The constants of the drawing, for a device that may learn from indentations
    /// alone.
    fn as_drawn(&self) -> Option<Outcome> {
        None
    }

    /// Adds what the indentations of a table teach.
    fn learn(&self, outcome: &mut Outcome, table: &ReadingTable) -> Result<(), InputError> {
        let _ = (outcome, table);
        Ok(())
    }
}

impl CalibrateOptions {
    /// Options of the fits, by whether the noise is given with every reading.
    pub(crate) fn fitting(&self, given: bool) -> FitOptions {
        use taxel_numerics::least_squares::Loss;
        FitOptions {
            noise: if given {
                NoiseSize::Given
            } else {
                NoiseSize::Estimated
            },
            loss: if self.robust {
                Loss::Huber
            } else {
                Loss::Square
            },
            ..FitOptions::default()
        }
    }
}
