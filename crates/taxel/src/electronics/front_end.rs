//! The whole board: scan, charge amplifiers, converter.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ChargeAmplifier, Code, Converter, Scan};
use crate::quantity::{self, Checked, FrameRate};

/// The electronics as a sensor file gives them.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Electronics {
    /// Frames per second, Hz.
    #[serde(deserialize_with = "quantity::one::<FrameRate, _>")]
    #[schemars(with = "Checked<FrameRate>")]
    pub frame_rate: f64,
    /// Order of reading.
    pub scan: Scan,
    /// Capacitance to voltage.
    pub charge_amplifier: ChargeAmplifier,
    /// Voltage to counts.
    pub converter: Converter,
}

/// The board of an array of units with four capacitors each.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontEnd {
    electronics: Electronics,
    rows: usize,
    columns: usize,
}

impl FrontEnd {
    /// The board for `rows` x `columns` units.
    pub fn new(electronics: &Electronics, rows: usize, columns: usize) -> Self {
        Self {
            electronics: electronics.clone(),
            rows,
            columns,
        }
    }

    /// Time between frames, s.
    pub fn period(&self) -> f64 {
        1.0 / self.electronics.frame_rate
    }

    /// Time for one scan, s.
    pub fn scan_time(&self) -> f64 {
        self.electronics
            .scan
            .duration(2 * self.rows, 2 * self.columns)
    }

    /// Sampling time of a capacitor (0 to 3: 11, 12, 21, 22) of taxel `taxel`
    /// after the start of the frame, s.
    pub fn delay(&self, taxel: usize, capacitor: usize) -> f64 {
        let row = 2 * (taxel / self.columns) + capacitor / 2;
        let column = 2 * (taxel % self.columns) + capacitor % 2;
        self.electronics.scan.delay(row, column, 2 * self.columns)
    }

    /// Voltage before the converter, without noise, V.
    pub fn voltage(&self, capacitance: f64) -> f64 {
        self.electronics.charge_amplifier.voltage(capacitance)
    }

    /// One reading: `normal` is a draw of the standard normal distribution.
    pub fn read(&self, capacitance: f64, normal: f64) -> Code {
        let noise = self.electronics.charge_amplifier.noise * normal;
        self.electronics
            .converter
            .convert(self.voltage(capacitance) + noise)
    }

    /// Capacitance that the ideal board reads as `counts`, F.
    pub fn capacitance(&self, counts: f64) -> f64 {
        let voltage = self.electronics.converter.voltage(counts);
        self.electronics.charge_amplifier.capacitance(voltage)
    }

    /// Standard deviation of one reading, F: noise and rounding to counts.
    pub fn deviation(&self) -> f64 {
        let step = self.electronics.converter.step();
        let noise = self.electronics.charge_amplifier.noise;
        (noise * noise + step * step / 12.0).sqrt()
            * self.electronics.charge_amplifier.farad_per_volt()
    }

    /// The smallest and largest capacitance that is not clipped, F.
    pub fn span(&self) -> [f64; 2] {
        let [low, high] = self.electronics.converter.range;
        let amplifier = &self.electronics.charge_amplifier;
        [amplifier.capacitance(low), amplifier.capacitance(high)]
    }

    /// The largest code of the converter.
    pub fn highest_code(&self) -> u32 {
        self.electronics.converter.highest()
    }
}
