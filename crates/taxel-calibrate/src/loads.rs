//! Checks of the loads of a fit.

use taxel::InputError;

use crate::readings::ReadingTable;

/// Loads must span this share of the largest one, where nothing else is known.
pub(crate) const LEAST_SPAN: f64 = 0.1;
/// Loads that are held out and exceed the others by this factor are extrapolated.
const BEYOND: f64 = 1.1;

/// The loads of some readings.
pub(crate) struct Loads {
    /// Name of their body, such as `taxel 3`; empty for all readings.
    pub(crate) name: String,
    /// Their column.
    pub(crate) column: &'static str,
    /// Unit of messages and its size in SI.
    pub(crate) unit: (&'static str, f64),
    /// SI.
    pub(crate) values: Vec<f64>,
    /// Least number of them.
    pub(crate) least: usize,
    /// Least span over the largest of them.
    pub(crate) span: f64,
    /// True if they must begin at rest, press, and be several beside rest.
    pub(crate) from_rest: bool,
}

/// Least and largest of some values.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

/// Largest less least value.
pub(crate) fn span(values: impl Iterator<Item = f64>) -> f64 {
    let [low, high] = range(values);
    (high - low).max(0.0)
}

impl Loads {
    /// Refuses loads that are too few, constant, turned, or far from rest.
    ///
    /// # Errors
    /// The first that is wrong, with what to do.
    pub(crate) fn enough(&self, table: &ReadingTable) -> Result<(), InputError> {
        let name = if self.name.is_empty() {
            String::new()
        } else {
            format!("{}: ", self.name)
        };
        let (unit, size) = self.unit;
        let wrong = |message: String, help: &str| {
            Err(table.error(self.column, format!("{name}{message}"), help))
        };
        if self.values.len() < self.least {
            let message = format!(
                "{} readings of loading; at least {} are needed",
                self.values.len(),
                self.least
            );
            return wrong(message, "take more readings");
        }
        let [least, most] = range(self.values.iter().copied());
        if self.from_rest && most <= 0.0 {
            let message = format!("no {} is above zero; pressing is positive", self.column);
            return wrong(message, "turn the sign of the column");
        }
        // What presses beside rest: one load there has one answer, of which gaps,
        // stiffness and stray parts are all a reason.
        let pressed = self.values.iter().copied();
        let pressed = pressed.filter(|load| !self.from_rest || *load > self.span * most);
        let [lightest, _] = range(pressed);
        let spans = |least: f64| most - least > self.span * most.abs().max(-least);
        if !(spans(least) && spans(lightest)) {
            let message = format!(
                "{} is constant, {:.4} to {:.4} {unit}",
                self.column,
                lightest / size,
                most / size
            );
            let help = if self.from_rest {
                "press with several loads, from rest to the largest of use"
            } else {
                "take readings of several loads to both sides, or leave the column out"
            };
            return wrong(message, help);
        }
        if self.from_rest && least > 0.5 * most {
            let message = format!(
                "{} goes from {:.4} to {:.4} {unit}, far from rest",
                self.column,
                least / size,
                most / size
            );
            return wrong(message, "begin at rest: its answer is part of the fit");
        }
        Ok(())
    }

    /// A remark where readings held out lie beyond the others.
    pub(crate) fn beyond(&self, held_out: &Self) -> Option<String> {
        let most = |loads: &Self| loads.values.iter().copied().fold(0.0, f64::max);
        let (inside, outside) = (most(self), most(held_out));
        let (unit, size) = self.unit;
        (outside > BEYOND * inside && inside > 0.0).then(|| {
            format!(
                "readings held out reach {:.4} {unit}, the others {:.4} {unit}: their error is that of an extrapolation",
                outside / size,
                inside / size
            )
        })
    }
}
