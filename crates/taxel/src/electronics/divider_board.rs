//! The board of channels: voltage dividers, scan, converter.

use super::{Code, Converter, Electronics, Scan, VoltageDivider};

/// One divider for each channel, read in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DividerBoard {
    /// The divider of each channel.
    pub divider: VoltageDivider,
    /// Voltage to counts.
    pub converter: Converter,
    period: f64,
    scan: Scan,
    channels: usize,
}

impl DividerBoard {
    /// The board for so many channels; `None` when its first stage is no
    /// divider.
    pub fn new(electronics: &Electronics, channels: usize) -> Option<Self> {
        Some(Self {
            divider: *electronics.voltage_divider()?,
            converter: electronics.converter?,
            period: electronics.period(),
            scan: electronics.scan,
            channels,
        })
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
    pub fn read(&self, resistance: f64, normal: f64) -> Code {
        let voltage = self.divider.voltage(resistance) + self.divider.noise * normal;
        self.converter.convert(voltage)
    }

    /// Standard deviation of one reading, V: noise and rounding to counts.
    pub fn deviation(&self) -> f64 {
        let step = self.converter.step();
        (self.divider.noise * self.divider.noise + step * step / 12.0).sqrt()
    }
}
