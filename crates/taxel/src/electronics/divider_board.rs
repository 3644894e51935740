//! The board of channels: what reads their resistances, scan, last stage.

use super::{Delivered, Electronics, LastStage, Scan, Stage};
use crate::quantity::{RESISTANCE, VOLTAGE};
use crate::signal::ResistanceSignal;

/// One reading of resistance for each channel, in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DividerBoard {
    /// Resistance of a channel to the signal that the last stage takes.
    pub signal: ResistanceSignal,
    /// Signal from which a channel counts as saturated.
    pub saturation: f64,
    /// Noise of the stage before the last one, in the unit of the signal.
    noise: f64,
    /// Stage that makes the numbers of a frame.
    pub last: LastStage,
    period: f64,
    scan: Scan,
    channels: usize,
}

impl DividerBoard {
    /// The board for so many channels; `None` when it takes no resistance.
    pub fn new(electronics: &Electronics, channels: usize) -> Option<Self> {
        let last = electronics.last_stage()?;
        let (signal, saturation, noise) = match electronics.first_stage() {
            Some(Stage::VoltageDivider(divider)) if last.takes(&VOLTAGE) => {
                (divider.signal(), divider.saturation, divider.noise)
            }
            None if last.takes(&RESISTANCE) => {
                let highest = last.range()[1];
                let lead = 0.0;
                let signal = ResistanceSignal::Resistance { lead, highest };
                (signal, highest, 0.0)
            }
            _ => return None,
        };
        Some(Self {
            signal,
            saturation,
            noise,
            last,
            period: electronics.period(),
            scan: electronics.scan,
            channels,
        })
    }

    /// True if `signal` counts as saturated: the channel is closed at some place, and its
    /// resistance says no more than that.
    pub fn saturated(&self, signal: f64) -> bool {
        signal >= self.saturation
    }

    /// Time between frames, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Time for one scan, s.
    pub fn scan_time(&self) -> f64 {
        self.scan.duration(1, self.channels)
    }

    /// Sampling time of a channel after the start of the frame, s.
    pub fn delay(&self, channel: usize) -> f64 {
        self.scan.delay(0, channel, self.channels)
    }

    /// One reading of a channel of `resistance`, Ω; `normal` is a draw of the
    /// standard normal distribution.
    pub fn read(&self, resistance: f64, normal: f64) -> Delivered {
        let noise = self.noise.hypot(self.last.noise());
        self.last
            .deliver(self.signal.of(resistance) + noise * normal)
    }

    /// Standard deviation of one reading, in the unit of the signal: noise, and rounding to
    /// counts.
    pub fn deviation(&self) -> f64 {
        self.noise.hypot(self.last.deviation())
    }

    /// Key of the noise in a sensor file.
    pub(crate) fn noise_key(&self) -> &'static str {
        match self.last {
            LastStage::Converter(_) => "electronics.readout.voltage_divider.noise",
            LastStage::Instrument(_) => "electronics.readout.measured.noise",
        }
    }
}
