//! Questions of the calibration driver to a kind of device.

use taxel::InputError;
use taxel::figure::Figure;
use taxel::predict::LoadColumn;
use taxel_numerics::least_squares::{
    Fit, FitError, FitOptions, NoiseSize, Parameter, Problem, student_quantile,
};

use crate::hysteresis::Loops;
use crate::loads::Loads;
use crate::options::{CalibrateOptions, IndentationOptions, NamedSensor, SyntheticOptions};
use crate::outcome::{
    Constants, Derived, Outcome, ResidualSummary, Scope, open_in_words, relative,
};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::split::OfSeries;

/// A model whose parameters readings can be fitted with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Model {
    /// Name, as after `--model`.
    pub name: &'static str,
    /// Name for messages.
    pub about: &'static str,
}

/// Columns of the tables of a device, and synthetic tables.
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
    /// True if the noise was given with each reading.
    pub(crate) given: bool,
    /// Noise that was found.
    pub(crate) noise: N,
}

impl<R, N> Fitted<R, N> {
    /// Half a 95 % interval in standard deviations of a quantity that follows.
    pub(crate) fn quantile(&self) -> f64 {
        let known = self.given && self.fit.scale == 1.0;
        let freedom = if known {
            f64::INFINITY
        } else {
            self.fit.freedom as f64
        };
        student_quantile(0.975, freedom)
    }

    /// Free parameters.
    pub(crate) fn unknowns(&self) -> usize {
        self.parameters.iter().filter(|p| p.is_free()).count()
    }
}

/// A fit of a device's model.
pub(crate) type FittedOf<D> = Fitted<<D as DeviceReadings>::Reading, <D as DeviceModel>::Noise>;

/// Properties of a whole table, and its readings in order.
pub(crate) type ReadingsOf<D> = (
    <D as DeviceReadings>::Context,
    Vec<<D as DeviceReadings>::Reading>,
);

/// Input of the fit of one body.
pub(crate) struct Task<'a, D: DeviceModel> {
    pub(crate) context: &'a D::Context,
    /// Place of the model.
    pub(crate) model: usize,
    /// Readings of the body.
    pub(crate) readings: &'a [D::Reading],
    pub(crate) options: &'a CalibrateOptions,
    /// The fit to all of its readings, when some are held out.
    pub(crate) from: Option<&'a FittedOf<D>>,
}

/// Fits of one model with the readings that judge them.
pub(crate) struct Judged<'a, D: DeviceModel> {
    pub(crate) context: &'a D::Context,
    /// One for each body.
    pub(crate) fits: &'a [FittedOf<D>],
    /// Readings of each body that judge its fit: those that it was fitted to, or
    /// those that were held out.
    pub(crate) readings: &'a [Vec<D::Reading>],
    /// Readings of loading of each body, for their ranges.
    pub(crate) all: &'a [Vec<D::Reading>],
    /// All readings of each series, those of unloading included.
    pub(crate) series: &'a [Vec<D::Reading>],
    /// Which of them are held out.
    pub(crate) held: &'a [Vec<bool>],
}

/// The readings of one kind of device.
pub(crate) trait DeviceReadings: Calibratable + Sized + Sync {
    /// One reading of a table.
    type Reading: OfSeries + Clone + Send + Sync;
    /// Properties of a whole table.
    type Context: Sync;

    /// The readings of a table; what can be of no such device is an error.
    fn readings(
        &self,
        table: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<ReadingsOf<Self>, InputError>;

    /// The readings of loading of one series.
    fn loading(
        &self,
        context: &Self::Context,
        of: &[Self::Reading],
        remarks: &mut Vec<Remark>,
    ) -> Vec<Self::Reading> {
        let _ = (context, remarks);
        of.to_vec()
    }

    /// The loads of the readings of one series, for what they must span.
    fn loads(&self, context: &Self::Context, of: &[Self::Reading]) -> Vec<Loads>;
}

/// The models of one kind of device, with their parameters and slopes.
pub(crate) trait DeviceModel: DeviceReadings {
    /// Noise found by a fit.
    type Noise: Send + Sync;

    /// True if each series is a body with a fit of its own.
    const SEPARATE: bool = false;

    /// True if parameters that are badly known bend away from straight lines within their
    /// intervals.
    const CURVED: bool = false;

    /// The sensors, with what the names of their own parameters begin with.
    fn sensors(&self) -> Vec<(&NamedSensor<'_>, &str)>;

    /// The best fit to the readings of one body.
    fn fit(&self, task: &Task<'_, Self>) -> Result<FittedOf<Self>, FitError>;

    /// The problem at its best values; `None` where the model has no answer.
    fn problem<'b>(
        &'b self,
        context: &'b Self::Context,
        fitted: &'b FittedOf<Self>,
    ) -> Option<Box<dyn Problem + 'b>>;

    /// True if a table has indentations at known positions.
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

/// Results of the fits of a device.
pub(crate) trait Findings: DeviceModel {
    /// Residuals of each kind of reading; first that of the signal.
    fn residuals(&self, of: &Judged<'_, Self>) -> Vec<ResidualSummary>;

    /// Residual of the signal over its range, root of the mean square.
    fn relative(&self, of: &Judged<'_, Self>) -> f64 {
        relative(&self.residuals(of))
    }

    /// True if the readings can be what their columns say, after the fit.
    fn explained(&self, of: &Judged<'_, Self>, table: &ReadingTable) -> Result<(), InputError> {
        let _ = (of, table);
        Ok(())
    }

    /// Independent constants beside those of the fit, and remarks on all of it.
    fn beside(&self, of: &Judged<'_, Self>, remarks: &mut Vec<Remark>) -> Constants {
        let _ = (of, remarks);
        Vec::new()
    }

    /// The hysteresis of the device.
    fn hysteresis(&self, of: &Judged<'_, Self>) -> Vec<Loops> {
        let _ = of;
        Vec::new()
    }

    /// Name of a body, where there may be several.
    fn body(&self, fitted: &FittedOf<Self>) -> Option<String> {
        let _ = fitted;
        None
    }

    /// Combinations of parameters of a body that are not identifiable, in words.
    fn open(&self, fitted: &FittedOf<Self>) -> Vec<String> {
        open_in_words(&fitted.parameters, &fitted.fit)
    }

    /// Quantities that follow, with their intervals.
    fn derived(&self, of: &Judged<'_, Self>) -> Vec<Derived> {
        let _ = of;
        Vec::new()
    }

    /// The noise found where none was given, as a part of a sentence.
    fn noise(&self, fits: &[FittedOf<Self>]) -> String {
        let _ = fits;
        String::new()
    }

    /// Ranges of the readings.
    fn scope(&self, of: &Judged<'_, Self>) -> Vec<Scope>;

    /// Readings, models and residuals; the first candidate is the one in use.
    fn figures(&self, of: &Judged<'_, Self>, candidates: &[Vec<FittedOf<Self>>]) -> Vec<Figure>;
}

/// The fit of the least `size` over several starts; else the last failure, without any
/// start `none`.
pub(crate) fn best<S, F>(
    starts: impl IntoIterator<Item = S>,
    none: FitError,
    mut fit: impl FnMut(S) -> Result<F, FitError>,
    size: impl Fn(&F) -> f64,
) -> Result<F, FitError> {
    let (mut best, mut failure) = (None, none);
    for start in starts {
        match fit(start) {
            Ok(found) if best.as_ref().is_none_or(|best| size(&found) < size(best)) => {
                best = Some(found);
            }
            Ok(_) => {}
            Err(error) => failure = error,
        }
    }
    best.ok_or(failure)
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
