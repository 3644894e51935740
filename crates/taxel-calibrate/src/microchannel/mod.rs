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

use crate::device_model::{Calibratable, DeviceModel, Fitted as FittedTo, Model, Task, best};
use crate::hysteresis::law_of;
use crate::options::{CalibrateOptions, NamedSensor, SyntheticOptions};
use crate::split::series_of;
use taxel::calibration::MicrochannelModel;
use taxel::electronics::DividerBoard;
use taxel::mechanics::PressureLaw;
use taxel::predict::LoadColumn;
use taxel::sensor::{Element, FoundChannels, Sensor};
use taxel::transduction::MicrochannelLayer;
use taxel_numerics::least_squares::{Fit, FitError, Parameter, Problem, fit};

use columns::{CHANNEL, COLUMNS};
use problem::{BIAS, Bench, EXPANSION, LEAD, Reading, SHARED, STIFFNESS};
use saturation::saturation_name;

static MODELS: [Model; 1] = [Model {
    name: "cell",
    about: "closing curve of the drawing times a stiffness, law of the liquid, leads",
}];
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
pub(super) struct MicrochannelCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    layers: [MicrochannelLayer; 2],
    /// Channels of the row and of the column layer.
    counts: [usize; 2],
    board: DividerBoard,
    /// Largest pressure that each layer's closing curve knows, Pa.
    highest: [f64; 2],
    all: Vec<usize>,
}

/// One fit.
type Fitted = FittedTo<Reading, Noise>;

/// What a fit found of the readings besides its parameters.
pub(crate) struct Noise {
    /// Readings beyond the end of the closing curves.
    beyond: usize,
    /// Noise of each channel whose deviations are not given, over that of the board.
    of_channel: Vec<f64>,
}

/// Searches start at these stiffnesses, and at these shares of the largest
/// force as bias.
const STIFFNESSES: [f64; 4] = [1.0, 3.0, 10.0, 40.0];
/// Least and largest stiffness: a pad that shares its force, or an oxide skin, is a stiffer array.
const STIFFNESS_BOUNDS: [f64; 2] = [0.02, 200.0];
const BIASES: [f64; 3] = [0.0, 0.1, 0.25];
/// Readings beyond the curves change with the fit, and so does the noise of a channel: a few
/// rounds settle them.
const MOST_ROUNDS: usize = 4;
/// Change of a noise, over it, that ends the rounds.
const SETTLED: f64 = 1e-2;
/// A channel whose residuals have less freedom has the noise of all of them: its own would be
/// off by a fifth and more.
const LEAST_FREEDOM: f64 = 12.0;

impl<'a> MicrochannelCalibrator<'a> {
    /// `None` for anything but one such array.
    pub(super) fn new(sensors: &'a [NamedSensor<'a>]) -> Option<Self> {
        let [named] = sensors else { return None };
        let array = named.sensor.microchannels().ok()?;
        let highest = |layer: usize| {
            let model =
                MicrochannelModel::new(&array.layers[layer], 1.0, 0.0, f64::INFINITY).ok()?;
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
        let mut at = vec![self.board.signal.lead(), 1.0, 1.0, expansion, 0.0];
        at.extend(self.all.iter().map(|channel| self.drawn_rest(*channel)));
        at
    }

    fn drawn_rest(&self, channel: usize) -> f64 {
        self.layers[self.layer_of(channel)]
            .conductor
            .rest_resistance()
    }

    fn bench_of<'b>(&'b self, channels: &[usize], readings: &'b [Reading]) -> Bench<'b> {
        let usual = self.board.deviation();
        Bench {
            layers: &self.layers,
            signal: self.board.signal,
            channels: channels.to_vec(),
            readings,
            noise: readings
                .iter()
                .map(|r| r.deviation.unwrap_or(usual))
                .collect(),
        }
    }

    /// The same, with the noise of each channel that a fit has found.
    fn weighed<'b>(
        &'b self,
        channels: &[usize],
        readings: &'b [Reading],
        of_channel: &[f64],
    ) -> Bench<'b> {
        let mut bench = self.bench_of(channels, readings);
        for (reading, noise) in readings.iter().zip(&mut bench.noise) {
            if reading.deviation.is_none() {
                *noise *= of_channel[reading.channel];
            }
        }
        bench
    }

    /// Makes the noise of each channel that of its residuals; the largest change, over it.
    fn weigh_again(readings: &[Reading], found: &Fit, of_channel: &mut [f64]) -> f64 {
        let sums = |of: &dyn Fn(&Reading) -> bool| {
            let residuals = found.residuals.iter().zip(&found.leverage);
            let own = readings.iter().zip(residuals);
            let own = own.filter(|(reading, _)| reading.deviation.is_none() && of(reading));
            own.fold([0.0; 2], |[square, freedom], (_, (residual, leverage))| {
                [square + residual * residual, freedom + 1.0 - leverage]
            })
        };
        let all = sums(&|_| true);
        let mut changed = 0.0_f64;
        for channel in series_of(readings) {
            let own = sums(&|reading| reading.channel == channel);
            let [square, freedom] = if own[1] < LEAST_FREEDOM { all } else { own };
            if freedom >= 1.0 && square > 0.0 {
                let factor = (square / freedom).sqrt();
                changed = changed.max((factor - 1.0).abs());
                of_channel[channel] *= factor;
            }
        }
        changed
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
            ("", STIFFNESS_BOUNDS, 0.2 * at[1], read(0)),
            ("", STIFFNESS_BOUNDS, 0.2 * at[2], read(1)),
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
        let signal = self.board.signal.with_lead(0.0);
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
                // A layer that was not read stays as drawn.
                for (layer, place) in STIFFNESS.into_iter().enumerate() {
                    if readings.iter().any(|r| r.layer == layer) {
                        at[place] = stiffness;
                    }
                }
                at[BIAS] = bias * force;
                for channel in series_of(readings) {
                    let sum = signal.resistance(checks::rest_signal(readings, channel));
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

    /// The best fit over all starts.
    fn fit_from(
        &self,
        readings: &[Reading],
        options: &CalibrateOptions,
        starts: &[Vec<f64>],
    ) -> Result<Fitted, FitError> {
        let channels = series_of(readings);
        let given = readings.iter().all(|r| r.deviation.is_some());
        let fit_options = options.fitting(given);
        let once = |at: &[f64], kept: &[Reading], of_channel: &[f64]| {
            let parameters = self.parameters(&channels, kept, at);
            let bench = self.weighed(&channels, kept, of_channel);
            fit(&bench, &parameters, &fit_options).map(|found| (parameters, found))
        };
        let none = FitError::TooFew {
            readings: readings.len(),
            unknowns: SHARED + channels.len(),
        };
        let mut of_channel = vec![1.0; self.all.len()];
        // From each start, without the readings beyond the curve that it comes to.
        let from = |start: &Vec<f64>| {
            let (mut parameters, mut found) = once(start, readings, &of_channel)?;
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
                (parameters, found) = once(&at, &kept, &of_channel)?;
            }
            Ok((parameters, found, kept))
        };
        let found: Vec<_> = starts.iter().map(from).collect();
        // A curve that closes at once explains few readings, and those with ease.
        let most = found.iter().flatten().map(|(.., kept)| kept.len()).max();
        let enough = |kept: &Vec<Reading>| 2 * kept.len() > most.unwrap_or(0);
        let found = found
            .into_iter()
            .filter(|found| found.as_ref().map_or(true, |(.., kept)| enough(kept)));
        let per_reading =
            |(_, fit, kept): &(_, Fit, Vec<Reading>)| fit.chi_square / kept.len() as f64;
        let (mut parameters, mut found, kept) = best(found, none, |found| found, per_reading)?;
        for _ in 0..MOST_ROUNDS {
            let changed = Self::weigh_again(&kept, &found, &mut of_channel);
            (parameters, found) = once(&found.values(), &kept, &of_channel)?;
            if changed < SETTLED {
                break;
            }
        }
        Ok(Fitted {
            model: 0,
            parameters,
            fit: found,
            noise: Noise {
                beyond: readings.len() - kept.len(),
                of_channel,
            },
            readings: kept,
            options: fit_options,
            given,
        })
    }
}

impl Calibratable for MicrochannelCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        CHANNEL
    }

    fn models(&self) -> &'static [Model] {
        &MODELS
    }

    fn synthetic(&self, options: &SyntheticOptions) -> String {
        synthetic::table(self, options)
    }
}

impl DeviceModel for MicrochannelCalibrator<'_> {
    type Noise = Noise;

    fn sensors(&self) -> Vec<(&NamedSensor<'_>, &str)> {
        vec![(self.named, "")]
    }

    fn fit(&self, task: &Task<'_, Self>) -> Result<Fitted, FitError> {
        let starts = match task.from {
            Some(found) => vec![found.fit.values()],
            None => self.starts(task.readings),
        };
        self.fit_from(task.readings, task.options, &starts)
    }

    fn problem<'b>(
        &'b self,
        _: &'b Self::Context,
        fitted: &'b Fitted,
    ) -> Option<Box<dyn Problem + 'b>> {
        let channels = series_of(&fitted.readings);
        let of_channel = &fitted.noise.of_channel;
        Some(Box::new(self.weighed(
            &channels,
            &fitted.readings,
            of_channel,
        )))
    }
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
    let array = sensor.microchannels().map_err(|error| error.to_string())?;
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
    let signal = array.board.signal;
    let (drawn, name) = (array.board.saturation, saturation_name(&signal));
    let saturation =
        |channel: usize| value(&format!("{CHANNEL}_{channel}.{name}")).unwrap_or(drawn);
    let saturation = (0..array.counts().iter().sum()).map(saturation).collect();
    if let Element::Microchannel(element) = &mut sensor.element {
        element.found = Some(FoundChannels {
            stiffness,
            rest,
            saturation,
            lead,
            hysteresis: law_of("", value),
        });
        if let PressureLaw::Paper(law) = &mut element.liquid.pressure {
            law.expansion = expansion;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
