//! The whole board: scan, charge amplifiers, converter.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ChargeAmplifier, ChargeMode, Code, Converter, Scan, VoltageAmplifier, VoltageDivider};
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
    /// Stage that turns the response of a taxel into a voltage.
    pub readout: Readout,
    /// Voltage to counts; every readout but `digital` needs it.
    #[serde(default)]
    pub converter: Option<Converter>,
}

/// First stage of the board; the header in the file names it. Each kind of
/// element has its own kinds of stage.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Readout {
    /// Capacitance to voltage.
    ChargeAmplifier(ChargeAmplifier),
    /// Charge to the voltage on the source's own capacitance.
    VoltageAmplifier(VoltageAmplifier),
    /// Charge to the voltage on the capacitor of an amplifier.
    ChargeMode(ChargeMode),
    /// Resistance to voltage.
    VoltageDivider(VoltageDivider),
    /// Chips that deliver numbers.
    Digital(Digital),
}

/// Chips with converters of their own, whose numbers are taken as they are.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Digital {
    /// Unit of the numbers.
    pub unit: DigitalUnit,
}

/// Unit of the numbers of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DigitalUnit {
    /// Codes of a converter.
    Counts,
    /// Anything else that grows with the signal.
    Arbitrary,
}

impl DigitalUnit {
    /// The unit as people read it.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Counts => "counts",
            Self::Arbitrary => "raw",
        }
    }
}

impl Readout {
    /// Key of the stage in a sensor file.
    pub fn key(&self) -> &'static str {
        match self {
            Self::ChargeAmplifier(_) => "charge_amplifier",
            Self::VoltageAmplifier(_) => "voltage_amplifier",
            Self::ChargeMode(_) => "charge_mode",
            Self::VoltageDivider(_) => "voltage_divider",
            Self::Digital(_) => "digital",
        }
    }
}

impl Electronics {
    /// The charge amplifier, if that is the first stage.
    pub fn charge_amplifier(&self) -> Option<&ChargeAmplifier> {
        match &self.readout {
            Readout::ChargeAmplifier(amplifier) => Some(amplifier),
            _ => None,
        }
    }

    /// The voltage divider, if that is the first stage.
    pub fn voltage_divider(&self) -> Option<&VoltageDivider> {
        match &self.readout {
            Readout::VoltageDivider(divider) => Some(divider),
            _ => None,
        }
    }

    /// Time between frames, s.
    pub fn period(&self) -> f64 {
        1.0 / self.frame_rate
    }
}

/// The board of an array of units with four capacitors each, or with one.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontEnd {
    /// Capacitors along each side of a unit: two or one.
    side: usize,
    frame_rate: f64,
    scan: Scan,
    amplifier: ChargeAmplifier,
    converter: Converter,
    rows: usize,
    columns: usize,
}

impl FrontEnd {
    /// The board for `rows` x `columns` units; `None` when its first stage is
    /// no charge amplifier.
    pub fn new(electronics: &Electronics, rows: usize, columns: usize) -> Option<Self> {
        Self::with_side(2, electronics, rows, columns)
    }

    /// The board for `rows` x `columns` single capacitors; `None` when its
    /// first stage is no charge amplifier.
    pub fn of_single(electronics: &Electronics, rows: usize, columns: usize) -> Option<Self> {
        Self::with_side(1, electronics, rows, columns)
    }

    fn with_side(
        side: usize,
        electronics: &Electronics,
        rows: usize,
        columns: usize,
    ) -> Option<Self> {
        Some(Self {
            side,
            frame_rate: electronics.frame_rate,
            scan: electronics.scan,
            amplifier: *electronics.charge_amplifier()?,
            converter: electronics.converter?,
            rows,
            columns,
        })
    }

    /// Time between frames, s.
    pub fn period(&self) -> f64 {
        1.0 / self.frame_rate
    }

    /// Time for one scan, s.
    pub fn scan_time(&self) -> f64 {
        self.scan
            .duration(self.side * self.rows, self.side * self.columns)
    }

    /// Sampling time of a capacitor (0 to 3: 11, 12, 21, 22; 0 if there is
    /// only one) of taxel `taxel` after the start of the frame, s.
    pub fn delay(&self, taxel: usize, capacitor: usize) -> f64 {
        let side = self.side;
        let row = side * (taxel / self.columns) + capacitor / side;
        let column = side * (taxel % self.columns) + capacitor % side;
        self.scan.delay(row, column, side * self.columns)
    }

    /// Voltage before the converter, without noise, V.
    pub fn voltage(&self, capacitance: f64) -> f64 {
        self.amplifier.voltage(capacitance)
    }

    /// One reading: `normal` is a draw of the standard normal distribution.
    pub fn read(&self, capacitance: f64, normal: f64) -> Code {
        let noise = self.amplifier.noise * normal;
        self.converter.convert(self.voltage(capacitance) + noise)
    }

    /// Capacitance that the ideal board reads as `counts`, F.
    pub fn capacitance(&self, counts: f64) -> f64 {
        let voltage = self.converter.voltage(counts);
        self.amplifier.capacitance(voltage)
    }

    /// Standard deviation of one reading, F: noise and rounding to counts.
    pub fn deviation(&self) -> f64 {
        let step = self.converter.step();
        let noise = self.amplifier.noise;
        (noise * noise + step * step / 12.0).sqrt() * self.amplifier.farad_per_volt()
    }

    /// The smallest and largest capacitance that is not clipped, F.
    pub fn span(&self) -> [f64; 2] {
        let [low, high] = self.converter.range;
        let amplifier = &self.amplifier;
        [amplifier.capacitance(low), amplifier.capacitance(high)]
    }

    /// The largest code of the converter.
    pub fn highest_code(&self) -> u32 {
        self.converter.highest()
    }
}
