//! Calibration of crossing liquid-metal channels (P4) from a bench: pressure,
//! or force on an area, and the voltage or resistance of one channel or several.
//!
//! Lead resistance, expansion of the liquid's law and force bias are shared by
//! all channels, a stiffness by those of one layer; each channel has its own
//! resistance at rest.

mod checks;
mod columns;
mod hysteresis;
mod problem;
mod result;
mod saturation;
mod synthetic;

use crate::hysteresis::{law_of, on_loading};
use crate::outcome::{
    BenchOptions, CalibrateOptions, CalibratedSensor, Calibrator, CovarianceBlock, ModelComparison,
    NamedSensor, Outcome, open_in_words, paired, search_in_words, wanted,
};
use crate::readings::BenchData;
use crate::remark::Remark;
use crate::split::{Branch, branches};
use taxel::calibration::ChannelModel;
use taxel::electronics::{DividerBoard, Readout};
use taxel::mechanics::PressureLaw;
use taxel::predict::LoadColumn;
use taxel::sensor::{Element, FoundChannels, Sensor};
use taxel::transduction::ChannelLayer;
use taxel_numerics::least_squares::{
    Fit, FitError, FitOptions, NoiseSize, Parameter, Status, fit, profile_interval,
};
use taxel_recording::InputError;

use columns::{CHANNEL, COLUMNS};
use problem::{BIAS, Bench, EXPANSION, LEAD, Reading, SHARED, STIFFNESS};
use saturation::{Plateau, SATURATION};

const MODELS: [&str; 1] = ["cell"];
const NAMES: [&str; SHARED] = [
    "lead_resistance",
    "row.stiffness",
    "column.stiffness",
    "expansion",
    "force_bias",
];
const REST: &str = "rest_resistance";

/// Columns of answers that the uncertainty reaches.
pub(super) static UNCERTAIN: [&str; 4] = [
    "row_resistance",
    "row_voltage",
    "column_resistance",
    "column_voltage",
];

/// Calibrates one array of crossing channels.
pub(super) struct ChannelCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    layers: [ChannelLayer; 2],
    /// Channels of the row and of the column layer.
    counts: [usize; 2],
    board: DividerBoard,
    /// Largest pressure that each layer's closing curve knows, Pa.
    highest: [f64; 2],
    all: Vec<usize>,
}

/// One fit with what it was made of.
struct Fitted {
    parameters: Vec<Parameter>,
    fit: Fit,
    channels: Vec<usize>,
    readings: Vec<Reading>,
    options: FitOptions,
    /// Readings beyond the end of the closing curves.
    beyond: usize,
}

/// Searches start at these stiffnesses, and at these shares of the largest
/// force as bias.
const STIFFNESSES: [f64; 3] = [1.0, 3.0, 10.0];
const BIASES: [f64; 3] = [0.0, 0.1, 0.25];
/// Readings beyond the curves change with the fit: a few rounds settle them.
const MOST_ROUNDS: usize = 4;

impl<'a> ChannelCalibrator<'a> {
    /// `None` for anything but one such array.
    pub(super) fn new(sensors: &'a [NamedSensor<'a>]) -> Option<Self> {
        let [named] = sensors else { return None };
        let array = named.sensor.channels().ok()?;
        let highest = |layer: usize| {
            let model = ChannelModel::new(&array.layers[layer], 1.0, 0.0, f64::INFINITY).ok()?;
            Some(model.highest_pressure())
        };
        Some(Self {
            highest: [highest(0)?, highest(1)?],
            all: (0..array.counts().iter().sum()).collect(),
            named,
            counts: array.counts(),
            board: array.board,
            layers: array.layers,
        })
    }

    fn layer_of(&self, channel: usize) -> usize {
        usize::from(channel >= self.counts[0])
    }

    /// Parameters of the drawing, all channels read.
    fn drawn(&self) -> Vec<f64> {
        let expansion = match &self.layers[0].liquid {
            PressureLaw::Paper(law) => law.expansion,
            _ => 1.0,
        };
        let mut at = vec![self.board.divider.lead, 1.0, 1.0, expansion, 0.0];
        at.extend(self.all.iter().map(|channel| self.drawn_rest(*channel)));
        at
    }

    fn drawn_rest(&self, channel: usize) -> f64 {
        self.layers[self.layer_of(channel)]
            .conductor
            .rest_resistance()
    }

    fn bench_of<'b>(&'b self, channels: &'b [usize], readings: &'b [Reading]) -> Bench<'b> {
        let usual = self.board.deviation();
        Bench {
            layers: &self.layers,
            divider: self.board.divider,
            channels,
            readings,
            noise: readings
                .iter()
                .map(|r| r.deviation.unwrap_or(usual))
                .collect(),
        }
    }

    fn parameters(&self, channels: &[usize], readings: &[Reading], at: &[f64]) -> Vec<Parameter> {
        let rest = self.drawn_rest(0);
        let force = checks::largest_force(readings);
        let read = |layer: usize| readings.iter().any(|r| r.layer == layer);
        let trapped = matches!(self.layers[0].liquid, PressureLaw::Paper(_));
        // Unit, least and largest value, a difference that matters, and whether
        // the readings can say anything of it.
        let shared = [
            ("ohm", [0.0, 10.0 * rest], 0.1 * rest, true),
            ("", [0.02, 50.0], 0.2 * at[1], read(0)),
            ("", [0.02, 50.0], 0.2 * at[2], read(1)),
            ("", [0.005, 20.0], 0.1, trapped),
            (
                "N",
                [-0.5 * force, 0.9 * force],
                (0.1 * force).max(f64::MIN_POSITIVE),
                force > 0.0,
            ),
        ];
        let places = shared.into_iter().enumerate();
        let shared = places.map(|(j, (unit, bounds, size, free))| Parameter {
            unit,
            bounds: if free { bounds } else { [at[j]; 2] },
            size,
            ..Parameter::new(NAMES[j], at[j])
        });
        let own = channels.iter().zip(&at[SHARED..]).map(|(channel, at)| {
            let drawn = self.drawn_rest(*channel);
            Parameter {
                unit: "ohm",
                bounds: [0.05 * drawn, 20.0 * drawn],
                size: 0.1 * drawn,
                ..Parameter::new(format!("{CHANNEL}_{channel}.{REST}"), *at)
            }
        });
        shared.chain(own).collect()
    }

    /// Starts of a search.
    fn starts(&self, readings: &[Reading]) -> Vec<Vec<f64>> {
        let divider = self.board.divider;
        let force = checks::largest_force(readings);
        let biases = if force > 0.0 {
            &BIASES[..]
        } else {
            &BIASES[..1]
        };
        let mut starts = Vec::new();
        for stiffness in STIFFNESSES {
            for bias in biases {
                let mut at = self.drawn();
                at.truncate(SHARED);
                // Off the bound, where nothing would be learned of it.
                at[LEAD] = at[LEAD].max(0.05 * self.drawn_rest(0));
                at[STIFFNESS[0]] = stiffness;
                at[STIFFNESS[1]] = stiffness;
                at[BIAS] = bias * force;
                for channel in checks::channels(readings) {
                    let voltage = checks::rest_voltage(readings, channel);
                    let sum = divider.reference * voltage / (divider.supply - voltage);
                    let rest = (sum - at[LEAD]).max(0.5 * sum);
                    at.push(if rest.is_finite() {
                        rest
                    } else {
                        self.drawn_rest(channel)
                    });
                }
                starts.push(at);
            }
        }
        starts
    }

    fn fit(
        &self,
        readings: &[Reading],
        options: &CalibrateOptions,
        starts: &[Vec<f64>],
    ) -> Result<Fitted, FitError> {
        let channels = checks::channels(readings);
        let given = readings.iter().all(|r| r.deviation.is_some());
        let fit_options = options.fitting(given);
        let once = |at: &[f64], kept: &[Reading]| {
            let parameters = self.parameters(&channels, kept, at);
            let bench = self.bench_of(&channels, kept);
            fit(&bench, &parameters, &fit_options).map(|found| (parameters, found))
        };
        let mut best: Option<(Vec<Parameter>, Fit)> = None;
        let mut failure = FitError::TooFew {
            readings: readings.len(),
            unknowns: SHARED + channels.len(),
        };
        for start in starts {
            match once(start, readings) {
                Ok(found) => {
                    let better = |best: &(_, Fit)| found.1.chi_square < best.1.chi_square;
                    if best.as_ref().is_none_or(better) {
                        best = Some(found);
                    }
                }
                Err(error) => failure = error,
            }
        }
        let (mut parameters, mut found) = best.ok_or(failure)?;
        let mut kept = readings.to_vec();
        for _ in 0..MOST_ROUNDS {
            let before = kept.len();
            let at = found.values();
            let bench = self.bench_of(&channels, readings);
            kept = readings
                .iter()
                .filter(|r| bench.ratio(&at, r).is_some_and(|at| !at.beyond))
                .copied()
                .collect();
            if kept.len() == before {
                break;
            }
            (parameters, found) = once(&at, &kept)?;
        }
        Ok(Fitted {
            parameters,
            fit: found,
            beyond: readings.len() - kept.len(),
            readings: kept,
            channels,
            options: fit_options,
        })
    }

    /// The readings of loading of each channel that are not saturated; remarks
    /// on those of unloading.
    fn loading(&self, readings: &[Reading], remarks: &mut Vec<Remark>) -> Vec<Reading> {
        let mut kept = Vec::new();
        for channel in &self.all {
            let of = readings.iter().filter(|r| r.channel == *channel);
            let loads: Vec<f64> = of.clone().map(|r| r.load.pressure(0.0)).collect();
            // Saturated readings say which way the load goes, too.
            let pairs = of.zip(branches(&loads)).filter(|(r, _)| !r.saturated);
            let (of, unloading): (Vec<Reading>, Vec<bool>) = pairs
                .map(|(r, branch)| (*r, branch == Branch::Unloading))
                .unzip();
            let name = format!("{CHANNEL}_{channel}");
            kept.extend(on_loading(&name, &of, &unloading, "", remarks));
        }
        kept
    }

    /// The plateau of each channel that reached one; marks its readings.
    fn plateaus(&self, all: &mut [Reading]) -> Vec<Option<Plateau>> {
        let loading = self.loading(all, &mut Vec::new());
        let plateau = |channel: &usize| {
            let of = loading.iter().filter(|r| r.channel == *channel);
            Plateau::find(&of.copied().collect::<Vec<_>>())
        };
        let plateaus: Vec<Option<Plateau>> = self.all.iter().map(plateau).collect();
        for reading in all {
            let plateau = plateaus[reading.channel];
            reading.saturated |= plateau.is_some_and(|plateau| plateau.holds(reading));
        }
        plateaus
    }

    /// Readings that the fit sees, and those held out.
    fn split(&self, readings: &[Reading], options: &CalibrateOptions) -> [Vec<Reading>; 2] {
        let mut parts = [Vec::new(), Vec::new()];
        for channel in &self.all {
            let of: Vec<&Reading> = readings.iter().filter(|r| r.channel == *channel).collect();
            let marked: Vec<bool> = of.iter().map(|r| r.marked).collect();
            for (reading, held) in of.into_iter().zip(options.hold_out.held(&marked)) {
                parts[usize::from(held)].push(*reading);
            }
        }
        parts
    }

    fn with_profiles(&self, fitted: &mut Fitted) -> Result<(), FitError> {
        for j in 0..fitted.parameters.len() {
            if fitted.fit.estimates[j].status == Status::Identified {
                let bench = self.bench_of(&fitted.channels, &fitted.readings);
                let interval =
                    profile_interval(&bench, &fitted.parameters, &fitted.options, &fitted.fit, j)?;
                fitted.fit.estimates[j].interval = interval;
            }
        }
        Ok(())
    }
}

impl Calibrator for ChannelCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        CHANNEL
    }

    fn models(&self) -> &'static [&'static str] {
        &MODELS
    }

    fn calibrate(
        &self,
        data: &BenchData,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        wanted(&MODELS, options)?;
        let mut remarks = data.remarks.clone();
        let mut all = checks::readings(self, data, &mut remarks)?;
        let plateaus = self.plateaus(&mut all);
        let readings = self.loading(&all, &mut remarks);
        checks::enough(data, &readings)?;
        let refused = |error: FitError| {
            let help = "check the units and the sensor file, or take more readings";
            data.error("", error.to_string(), help)
        };
        let mut fitted = self
            .fit(&readings, options, &self.starts(&readings))
            .map_err(refused)?;
        if options.profile {
            self.with_profiles(&mut fitted).map_err(refused)?;
        }
        if fitted.beyond > 0 {
            remarks.push(Remark::whole(format!(
                "{} readings lie beyond the end of the closing curves and are left out",
                fitted.beyond
            )));
        }
        let [seen, unseen] = self.split(&fitted.readings, options);
        let mut hold_out = Vec::new();
        let mut held_residual = None;
        if !unseen.is_empty() {
            let starts = [fitted.fit.values()];
            let trained = self.fit(&seen, options, &starts).map_err(refused)?;
            hold_out = self.residuals(&trained, &unseen);
            held_residual = Some(self.relative(&trained, &unseen));
        }
        let channels = &fitted.channels;
        let saturated = saturation::parameters(self, channels, &plateaus, &all, &mut remarks);
        let hysteresis = hysteresis::of_array(self, &fitted, &all, options);
        if let Some(found) = &hysteresis {
            remarks.push(Remark::whole(found.about.clone()));
        }
        let found = &fitted.fit;
        let mut outcome = Outcome {
            element: self.named.sensor.element.key(),
            model: MODELS[0],
            sensors: vec![CalibratedSensor::of(self.named, "")],
            parameters: paired(&fitted.parameters, found),
            covariance: CovarianceBlock::of([found]),
            open: open_in_words(&fitted.parameters, found),
            places: None,
            derived: Vec::new(),
            noise: match fitted.options.noise {
                NoiseSize::Given => "given with each reading".into(),
                NoiseSize::Estimated => "estimated from the residuals".into(),
            },
            search: search_in_words(found, fitted.options.noise == NoiseSize::Given),
            residuals: self.residuals(&fitted, &fitted.readings),
            hold_out,
            held_out: options.hold_out.words(),
            models: vec![ModelComparison {
                name: MODELS[0],
                about: "closing curve of the drawing times a stiffness, law of the liquid, leads",
                unknowns: fitted.parameters.iter().filter(|p| p.is_free()).count(),
                residual: self.relative(&fitted, &fitted.readings),
                hold_out: held_residual,
            }],
            scope: result::scope(&fitted),
            figures: self.figures(&fitted),
            remarks,
        };
        let variances: Vec<f64> = saturated
            .iter()
            .map(|(_, at)| at.deviation.powi(2))
            .collect();
        outcome.add_constants(saturated, diagonal(&variances));
        outcome.add_loops(hysteresis);
        Ok(outcome)
    }

    fn bench(&self, options: &BenchOptions) -> String {
        synthetic::bench(self, options)
    }
}

/// Variances as a covariance.
fn diagonal(variances: &[f64]) -> Vec<Vec<f64>> {
    let row = |i: usize| {
        let entry = |j: usize| if i == j { variances[i] } else { 0.0 };
        (0..variances.len()).map(entry).collect()
    };
    (0..variances.len()).map(row).collect()
}

/// Puts calibrated values in the place of a sensor file's constants; `value`
/// looks a parameter up. Channels that were not read stay as drawn.
///
/// # Errors
/// The name of a parameter that is missing.
pub(super) fn apply(
    sensor: &mut Sensor,
    value: &dyn Fn(&str) -> Option<f64>,
) -> Result<(), String> {
    let find = |place: usize| value(NAMES[place]).ok_or_else(|| NAMES[place].to_owned());
    let stiffness = [find(STIFFNESS[0])?, find(STIFFNESS[1])?];
    let (lead, expansion) = (find(LEAD)?, find(EXPANSION)?);
    let array = sensor.channels().map_err(|error| error.to_string())?;
    let rest = |(layer, count): (usize, usize)| {
        let drawn = array.layers[layer].conductor.rest_resistance();
        let first = layer * array.counts()[0];
        (first..first + count)
            .map(|channel| value(&format!("{CHANNEL}_{channel}.{REST}")).map_or(1.0, |r| r / drawn))
            .collect::<Vec<f64>>()
    };
    let rest = array
        .counts()
        .into_iter()
        .enumerate()
        .flat_map(rest)
        .collect();
    let drawn = array.board.divider.saturation;
    let saturation =
        |channel: usize| value(&format!("{CHANNEL}_{channel}.{SATURATION}")).unwrap_or(drawn);
    let saturation = (0..array.counts().iter().sum()).map(saturation).collect();
    if let Element::LiquidMetalChannel(element) = &mut sensor.element {
        element.found = Some(FoundChannels {
            stiffness,
            rest,
            saturation,
            hysteresis: law_of("", value),
        });
        if let PressureLaw::Paper(law) = &mut element.liquid.pressure {
            law.expansion = expansion;
        }
    }
    if let Readout::VoltageDivider(divider) = &mut sensor.electronics.readout {
        divider.lead = lead;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
