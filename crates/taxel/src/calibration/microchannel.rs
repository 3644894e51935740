//! Model of an array of crossing microchannels for estimation.

use crate::layout::Layout;
use crate::mechanics::{ClosingState, ForceHysteresis, MicrochannelError, Stretch};
use crate::signal::{NumberScale, Position, ResistanceSignal};
use crate::transduction::MicrochannelLayer;
use taxel_numerics::{MonotoneCurve, OnCurve, roots};
use taxel_recording::SignalUnit;

/// All that estimation needs to know of two layers of crossing channels.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelCalibration {
    /// Where the taxels are.
    pub layout: Layout,
    /// Channels along x, one for each row of taxels; row 0 is at +y.
    pub rows: Vec<MicrochannelModel>,
    /// Channels along y, one for each column of taxels; column 0 is at -x.
    pub columns: Vec<MicrochannelModel>,
    /// Numbers of a frame to resistance.
    pub scale: ChannelScale,
    /// Taxels that are not used, row by row.
    pub masked: Vec<bool>,
    /// Hysteresis of the pressure, where slow loops identified it.
    pub hysteresis: Option<ForceHysteresis>,
}

/// One channel.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelModel {
    /// Resistance at rest without leads, Ω.
    pub rest_resistance: f64,
    /// Relative change R/R₀ − 1 to the pressure in Pa on one taxel of the
    /// channel that makes it, from (0, 0) to the end of what is known.
    pub pressure: MonotoneCurve,
    /// Standard deviation of one reading, in the unit of its signal: V, or Ω.
    pub deviation: f64,
    /// Signal from which it counts as saturated.
    pub saturation: f64,
}

/// Numbers of a frame to the resistance of a channel: to the signal of the channel, a
/// voltage V = V_S R/(R_ref + R) (P4 Eq. 3) or the resistance itself, and from there to R,
/// which is channel + leads.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelScale {
    /// Numbers to signals.
    pub numbers: NumberScale,
    /// Signal of a resistance.
    pub signal: ResistanceSignal,
    /// Quantity and unit of the numbers.
    pub unit: SignalUnit,
}

/// Resistance of a microchannel by one reading, or why there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MicrochannelSignal {
    /// Resistance without leads, Ω.
    Resistance(f64),
    /// Closed at some place.
    Saturated,
    /// No reading, or one that no channel gives.
    Impossible,
}

/// Points that a pressure curve begins with.
const POINTS: u32 = 64;
/// Error of a pressure curve between its points, as a share of its largest pressure: less than a step of
/// a converter of 16 bits. At the first touch, where the curve bends, an error of a thousandth would be ten
/// times that of the noise.
const TOLERANCE: f64 = 1e-5;

impl MicrochannelModel {
    /// The model of a channel of `layer` of which one taxel takes `share` of
    /// the length; `deviation` of one reading and `saturation` in the unit of its
    /// signal.
    ///
    /// # Errors
    /// [`MicrochannelError`] when pressing one taxel does not change the resistance
    /// of the channel one way.
    pub fn new(
        layer: &MicrochannelLayer,
        share: f64,
        deviation: f64,
        saturation: f64,
    ) -> Result<Self, MicrochannelError> {
        let end = highest_known(layer, share)?;
        let at = |pressure: f64| {
            let response = layer.respond(&pressed(share, pressure))?;
            let change = if pressure > 0.0 { response.change } else { 0.0 };
            Ok::<_, MicrochannelError>([change, pressure])
        };
        let step = end / f64::from(POINTS);
        let points = (0..=POINTS).map(|i| at(step * f64::from(i)));
        let points = points.collect::<Result<_, _>>()?;
        let pressure = MonotoneCurve::refined(points, TOLERANCE * end, at)?;
        Ok(Self {
            rest_resistance: layer.conductor.rest_resistance(),
            pressure,
            deviation,
            saturation,
        })
    }

    /// Standard deviation of the pressure on one taxel from one reading at
    /// rest, Pa: σ_V · dR/dV/R₀ · dp/d(R/R₀).
    pub fn rest_pressure_deviation(&self, scale: &ChannelScale) -> f64 {
        self.signal_slope(0.0, scale)
            .map_or(f64::NAN, |slope| self.deviation / slope)
    }

    /// Slope of the signal of the channel against the pressure on one taxel, V/Pa or Ω/Pa;
    /// none beyond what is known.
    pub fn signal_slope(&self, pressure: f64, scale: &ChannelScale) -> Option<f64> {
        let [largest, end] = self.pressure.end();
        if !(0.0..=end).contains(&pressure) {
            return None;
        }
        let at = |change: f64| match self.pressure.at(change) {
            OnCurve::Inside { value, .. }
            | OnCurve::Below([_, value])
            | OnCurve::Above([_, value]) => value,
        };
        let (change, by_change) = if pressure == 0.0 {
            (0.0, self.pressure.start_slope())
        } else {
            let change = roots::ridders([0.0, largest], |change| at(change) - pressure);
            match self.pressure.at(change) {
                OnCurve::Inside { slope, .. } => (change, slope),
                _ => return None,
            }
        };
        let resistance = self.rest_resistance * (1.0 + change);
        Some(self.rest_resistance / (scale.slope(resistance) * by_change))
    }

    /// The largest pressure that the model knows, Pa.
    pub fn highest_pressure(&self) -> f64 {
        self.pressure.end()[1]
    }

    /// Resistance at which the readings of the channel end, Ω; infinite without such
    /// an end.
    pub fn saturated_resistance(&self, scale: &ChannelScale) -> f64 {
        if self.saturation < scale.signal.open() {
            scale.resistance(self.saturation)
        } else {
            f64::INFINITY
        }
    }

    /// The pressure at which the channel saturates, or else the largest one
    /// that the model knows, Pa.
    pub fn saturated_pressure(&self, scale: &ChannelScale) -> f64 {
        let change = scale.resistance(self.saturation) / self.rest_resistance - 1.0;
        match self.pressure.at(change) {
            OnCurve::Inside { value, .. } => value,
            _ => self.highest_pressure(),
        }
    }
}

/// One taxel of a channel pressed, the rest not.
fn pressed(share: f64, pressure: f64) -> [Stretch; 2] {
    let rest = Stretch {
        share: 1.0 - share,
        pressure: 0.0,
    };
    [Stretch { share, pressure }, rest]
}

/// Pressure on one taxel at which its closing curve ends, Pa.
fn highest_known(layer: &MicrochannelLayer, share: f64) -> Result<f64, MicrochannelError> {
    let known = |pressure| {
        let response = layer.respond(&pressed(share, pressure))?;
        let state = response.channel.sections[0].state;
        Ok::<_, MicrochannelError>(!matches!(state, ClosingState::Beyond { .. }))
    };
    let [mut low, _] = layer.closing.end();
    // The liquid carries the rest; with a law that lets nothing close there is
    // no end, and a million times the curve's own is enough.
    let mut high = 2.0 * low;
    while known(high)? && high < 1e6 * low {
        high *= 2.0;
    }
    while high - low > 1e-12 * high {
        let middle = 0.5 * (low + high);
        if known(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(low)
}

impl ChannelScale {
    /// Resistance of a microchannel by a number of a frame; it saturates at the signal
    /// `saturation`; a NaN is no reading.
    ///
    /// A number at the low end is impossible, one at the high end saturated.
    pub fn read(&self, number: f64, saturation: f64) -> MicrochannelSignal {
        let signal = self.numbers.input(number);
        let position = self.numbers.position(number);
        if position == Position::AtEnd && number > self.numbers.ends[0]
            || signal >= saturation.min(self.signal.open())
        {
            return MicrochannelSignal::Saturated;
        }
        let resistance = self.resistance(signal);
        if position == Position::Inside && resistance > 0.0 {
            MicrochannelSignal::Resistance(resistance)
        } else {
            MicrochannelSignal::Impossible
        }
    }

    /// Resistance without leads at a signal below that of an open channel, Ω.
    pub fn resistance(&self, signal: f64) -> f64 {
        self.signal.resistance(signal)
    }

    /// Resistance per signal at a resistance without leads in Ω: of a divider
    /// (R_ref + R)²/(V_S R_ref), Ω/V.
    pub fn slope(&self, resistance: f64) -> f64 {
        1.0 / self.signal.slope(resistance)
    }
}
