//! The hysteresis of the rubber round channels: pressure of loading by the
//! signal beside that of the bench.

use super::problem::{BIAS, Load, Reading};
use super::{Fitted, MicrochannelCalibrator};
use crate::hysteresis::{Loops, Named, Sample, identify, samples, steps};
use crate::split::series_of;
use taxel_numerics::roots;

impl MicrochannelCalibrator<'_> {
    /// The hysteresis from the readings of all channels in their order, those of
    /// unloading included; `None` when they identify none.
    pub(super) fn loops(
        &self,
        fitted: &Fitted,
        series: &[Vec<Reading>],
        held_out: &[Vec<bool>],
    ) -> Option<Loops> {
        let channels = series_of(&fitted.readings);
        let curve = |at| Curve {
            calibrator: self,
            channels: &channels,
            at,
        };
        let here = curve(fitted.fit.values());
        let fits = |of: &[Reading]| of.first().is_some_and(|r| channels.contains(&r.channel));
        let pairs = series.iter().zip(held_out).filter(|(of, _)| fits(of));
        let known = pairs.flat_map(|(of, held)| {
            let pairs = here.known(of).into_iter().zip(held);
            pairs.filter_map(|(one, held)| Some((one?, *held)))
        });
        let (known, held): (Vec<Inverted>, Vec<bool>) = known.unzip();
        let found: Vec<Sample> = known.iter().map(|one| one.sample).collect();
        let mut moved = steps(&fitted.fit).into_iter().map(|at| {
            let there = curve(at);
            known.iter().map(|one| there.pressure(one)).collect()
        });
        let named = Named {
            prefix: "",
            title: "Hysteresis of all channels".into(),
            quantity: "pressure",
            unit: ("kPa", 1e3),
        };
        identify(&found, &mut moved, &held, &named)
    }
}

/// Pressures on loading are looked for up to this factor of the largest one.
const BEYOND: f64 = 1.5;
/// Below this share of the largest pressure the noise is as there.
const LEAST: f64 = 1e-3;
/// Step of a difference over the pressure, for smooth curves.
const STEP: f64 = 1e-4;

/// A reading whose signal says which pressure it would be on loading.
struct Inverted {
    reading: Reading,
    /// Pa.
    pressure: f64,
    /// Slope of the signal against the pressure.
    rise: f64,
    sample: Sample,
}

/// The curves of loading for the parameters `at`.
struct Curve<'a> {
    calibrator: &'a MicrochannelCalibrator<'a>,
    channels: &'a [usize],
    at: Vec<f64>,
}

impl Curve<'_> {
    /// Pressures of the readings of one channel by their signals.
    fn known(&self, of: &[Reading]) -> Vec<Option<Inverted>> {
        let bias = self.at[BIAS];
        let pressures: Vec<f64> = of.iter().map(|r| r.load.pressure(bias)).collect();
        let highest = BEYOND * pressures.iter().copied().fold(0.0, f64::max);
        let known: Vec<Option<f64>> = of.iter().map(|r| self.loading(r, highest)).collect();
        let readings = of.iter().zip(&known).zip(&pressures);
        // Where the signal says no more than "at least", the bench says how far
        // the load went: from there its way back counts.
        let loading: Vec<f64> = readings
            .map(|((reading, known), pressure)| match known {
                Some(known) if !reading.saturated => *known,
                _ => known.unwrap_or(0.0).max(*pressure),
            })
            .collect();
        let samples = samples(&loading, &pressures, &pressures);
        let triples = samples.into_iter().zip(of).zip(known);
        triples
            .map(|((sample, reading), known)| {
                let pressure = known.filter(|_| !reading.saturated)?;
                let rise = self.rise(reading, pressure.max(LEAST * highest))?;
                let usual = self.calibrator.board.deviation();
                let noise = reading.deviation.unwrap_or(usual) / (rise * highest);
                Some(Inverted {
                    reading: *reading,
                    pressure,
                    rise,
                    sample: sample.with_noise(noise),
                })
            })
            .collect()
    }

    /// Signal of a reading at another pressure.
    fn signal(&self, reading: &Reading, pressure: f64) -> Option<f64> {
        let load = Load::Pressure(pressure);
        let bench = self.calibrator.bench_of(self.channels, &[]);
        bench.predict(&self.at, &Reading { load, ..*reading })
    }

    /// Pressure on loading up to `highest` at which the curve has the signal of
    /// a reading, Pa; `None` where it does not reach it.
    fn loading(&self, reading: &Reading, highest: f64) -> Option<f64> {
        // Not a number where the model has no answer.
        let misfit = |pressure: f64| {
            let signal = self.signal(reading, pressure);
            signal.map_or(f64::NAN, |signal| signal - reading.signal)
        };
        let ends = [0.0, highest].map(misfit);
        if ends[0] >= 0.0 {
            return Some(0.0);
        }
        (ends[0] < 0.0 && ends[1] > 0.0).then(|| roots::ridders([0.0, highest], misfit))
    }

    /// Slope of the signal of a reading against the pressure; `None` where it does
    /// not rise.
    fn rise(&self, reading: &Reading, pressure: f64) -> Option<f64> {
        let step = STEP * pressure;
        let [below, above] = [pressure - step, pressure + step].map(|at| self.signal(reading, at));
        Some((above? - below?) / (2.0 * step)).filter(|rise| *rise > 0.0)
    }

    /// The pressure of a reading by this curve, which is near the one that
    /// gave it, Pa.
    fn pressure(&self, known: &Inverted) -> f64 {
        let signal = self.signal(&known.reading, known.pressure);
        let off = signal.map_or(0.0, |signal| signal - known.reading.signal);
        known.pressure - off / known.rise
    }
}
