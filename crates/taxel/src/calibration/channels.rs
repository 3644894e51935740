//! What is known of an array of crossing channels.

use crate::mechanics::MonotoneCurve;

/// All that estimation needs to know of two layers of crossing channels.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelCalibration {
    /// Channels along x, one for each row of taxels; row 0 is at +y.
    pub rows: Vec<ChannelModel>,
    /// Channels along y, one for each column of taxels; column 0 is at -x.
    pub columns: Vec<ChannelModel>,
    /// Counts to resistance.
    pub scale: DividerScale,
}

/// One channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelModel {
    /// Resistance at rest without leads, Ω.
    pub rest_resistance: f64,
    /// Relative change R/R₀ − 1 to the pressure in Pa on one taxel of the
    /// channel that makes it, from (0, 0) to the end of what is known.
    pub pressure: MonotoneCurve,
    /// Standard deviation of one reading, V.
    pub deviation: f64,
}

/// Counts of a channel to its resistance, through the divider
/// V = V_S R/(R_ref + R), R = channel + leads (P4 Eq. 3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DividerScale {
    /// Voltage at code zero, V.
    pub volt_at_zero: f64,
    /// Voltage per count, V.
    pub volt_per_count: f64,
    /// The largest code; it and zero mean a clipped reading.
    pub highest_code: f64,
    /// Supply V_S, V.
    pub supply: f64,
    /// Reference resistor R_ref, Ω.
    pub reference: f64,
    /// Leads in series with a channel, Ω.
    pub lead: f64,
    /// Voltage from which a channel counts as saturated, V.
    pub saturation: f64,
}

/// What one reading says of its channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChannelSignal {
    /// Resistance without leads, Ω.
    Resistance(f64),
    /// Closed at some place.
    Saturated,
    /// No reading, or one that no channel gives.
    Impossible,
}

impl ChannelModel {
    /// The largest pressure that the model knows, Pa.
    pub fn highest_pressure(&self) -> f64 {
        self.pressure.end()[1]
    }
}

impl DividerScale {
    /// What a code says of its channel; a NaN is no reading.
    ///
    /// Code zero and the largest code are outside the converter's range: the
    /// first is impossible, the second saturated.
    pub fn signal(&self, counts: f64) -> ChannelSignal {
        let voltage = self.volt_at_zero + self.volt_per_count * counts;
        if counts >= self.highest_code || voltage >= self.saturation.min(self.supply) {
            return ChannelSignal::Saturated;
        }
        let resistance = self.reference * voltage / (self.supply - voltage) - self.lead;
        if counts > 0.0 && resistance > 0.0 {
            ChannelSignal::Resistance(resistance)
        } else {
            ChannelSignal::Impossible
        }
    }

    /// dR/dV at a resistance without leads in Ω, Ω/V: (R_ref + R)²/(V_S R_ref).
    pub fn slope(&self, resistance: f64) -> f64 {
        let sum = self.reference + self.lead + resistance;
        sum * sum / (self.supply * self.reference)
    }
}
