//! The whole board: scan, first stage, last stage.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    CapacitanceToDigital, ChargeAmplifier, ChargeMode, Converter, Delivered, LastStage,
    Magnetometer, Measured, PressureChip, ReferenceDivider, Scan, Transimpedance, VoltageAmplifier,
    VoltageDivider,
};
use crate::quantity::{self, CAPACITANCE, Checked, FrameRate, Noise, VOLTAGE};
use crate::signal::NumberScale;

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
    /// Voltage to counts; every readout but `digital` and `measured` needs it.
    #[serde(default)]
    pub converter: Option<Converter>,
}

/// Frames this many times farther apart than those of the device have times in another unit.
const OTHER_UNIT: f64 = 300.0;

/// Message and help about frames of a recording that are `step` s apart, of a device with frames at
/// `frame_rate` Hz; `None` where the times may be in seconds.
pub fn times_in_another_unit(step: f64, frame_rate: f64) -> Option<[String; 2]> {
    (step * frame_rate >= OTHER_UNIT).then(|| {
        let message = format!(
            "the frames are {step:.3} s apart, those of the sensor file {:.3} s ({frame_rate} Hz): the times are in another unit",
            1.0 / frame_rate
        );
        let help = "times without a unit are in s: name the columns in a first line, such as time [ms],channel_1,channel_2, or correct electronics.frame_rate";
        [message, help.to_owned()]
    })
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
    /// Current of a column of a matrix to voltage.
    Transimpedance(Transimpedance),
    /// Resistor at each column of a matrix.
    ReferenceDivider(ReferenceDivider),
    /// Chips that give capacitances.
    CapacitanceToDigital(CapacitanceToDigital),
    /// Chips that give absolute pressures.
    PressureChip(PressureChip),
    /// Chips that give the magnetic field along three axes.
    Magnetometer(Magnetometer),
    /// Chips that deliver numbers.
    Digital(Digital),
    /// An instrument that gives the quantity itself, such as a capacitance in pF.
    Measured(Measured),
}

/// Stage between an element and a voltage.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Stage {
    /// Capacitance to voltage.
    ChargeAmplifier(ChargeAmplifier),
    /// Charge to the voltage on the source's own capacitance.
    VoltageAmplifier(VoltageAmplifier),
    /// Charge to the voltage on the capacitor of an amplifier.
    ChargeMode(ChargeMode),
    /// Resistance to voltage.
    VoltageDivider(VoltageDivider),
    /// Current of a column of a matrix to voltage.
    Transimpedance(Transimpedance),
    /// Resistor at each column of a matrix.
    ReferenceDivider(ReferenceDivider),
}

/// Chips with converters of their own, whose numbers are taken as they are.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Digital {
    /// Unit of the numbers.
    pub unit: DigitalUnit,
    /// Standard deviation of one reading of cells, in that unit, 0 to 1e9; of counts beside that of
    /// rounding, and zero by default.
    #[serde(default, deserialize_with = "quantity::some::<Noise, _>")]
    #[schemars(with = "Option<Checked<Noise>>")]
    pub noise: Option<f64>,
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
            Self::Transimpedance(_) => "transimpedance",
            Self::ReferenceDivider(_) => "reference_divider",
            Self::CapacitanceToDigital(_) => "capacitance_to_digital",
            Self::PressureChip(_) => "pressure_chip",
            Self::Magnetometer(_) => "magnetometer",
            Self::Digital(_) => "digital",
            Self::Measured(_) => "measured",
        }
    }
}

impl Stage {
    /// Key of the stage in a sensor file.
    pub fn key(&self) -> &'static str {
        match self {
            Self::ChargeAmplifier(_) => "charge_amplifier",
            Self::VoltageAmplifier(_) => "voltage_amplifier",
            Self::ChargeMode(_) => "charge_mode",
            Self::VoltageDivider(_) => "voltage_divider",
            Self::Transimpedance(_) => "transimpedance",
            Self::ReferenceDivider(_) => "reference_divider",
        }
    }
}

impl Electronics {
    /// The stage between an element and a voltage, if there is one.
    pub fn first_stage(&self) -> Option<Stage> {
        match self.readout {
            Readout::ChargeAmplifier(stage) => Some(Stage::ChargeAmplifier(stage)),
            Readout::VoltageAmplifier(stage) => Some(Stage::VoltageAmplifier(stage)),
            Readout::ChargeMode(stage) => Some(Stage::ChargeMode(stage)),
            Readout::VoltageDivider(stage) => Some(Stage::VoltageDivider(stage)),
            Readout::Transimpedance(stage) => Some(Stage::Transimpedance(stage)),
            Readout::ReferenceDivider(stage) => Some(Stage::ReferenceDivider(stage)),
            Readout::Measured(measured) => measured.stage,
            Readout::CapacitanceToDigital(_)
            | Readout::PressureChip(_)
            | Readout::Magnetometer(_)
            | Readout::Digital(_) => None,
        }
    }

    /// Key of what is below the first stage in a sensor file.
    pub(crate) fn stage_key(&self, below: &str) -> String {
        match self.readout {
            Readout::Measured(_) => format!("electronics.readout.measured.stage.{below}"),
            _ => format!("electronics.readout.{below}"),
        }
    }

    /// Key of the range of the last stage in a sensor file.
    pub(crate) fn range_key(&self) -> &'static str {
        match self.readout {
            Readout::CapacitanceToDigital(_) => "electronics.readout.capacitance_to_digital.range",
            Readout::PressureChip(_) => "electronics.readout.pressure_chip.range",
            Readout::Magnetometer(_) => "electronics.readout.magnetometer.range",
            Readout::Digital(_) | Readout::Measured(_) => "electronics.readout.measured.range",
            _ => "electronics.converter.range",
        }
    }

    /// The stage that makes the numbers of a frame; none where a converter is missing.
    pub fn last_stage(&self) -> Option<LastStage> {
        match self.readout {
            Readout::Digital(chips) => {
                let numbers = Measured::of_numbers(chips.unit.symbol(), chips.noise.unwrap_or(0.0));
                Some(LastStage::Instrument(numbers))
            }
            Readout::Measured(measured) => Some(LastStage::Instrument(measured)),
            Readout::CapacitanceToDigital(chip) => Some(LastStage::Instrument(chip.instrument())),
            Readout::PressureChip(chip) => Some(LastStage::Instrument(chip.instrument())),
            Readout::Magnetometer(chip) => Some(LastStage::Instrument(chip.instrument())),
            _ => self.converter.map(LastStage::Converter),
        }
    }

    /// Pressure that chips read at rest, Pa; zero of all other boards.
    pub fn ambient(&self) -> f64 {
        match self.readout {
            Readout::PressureChip(chip) => chip.ambient,
            _ => 0.0,
        }
    }

    /// The capacitance-to-digital chips, if the board has them.
    pub fn capacitance_to_digital(&self) -> Option<&CapacitanceToDigital> {
        match &self.readout {
            Readout::CapacitanceToDigital(chip) => Some(chip),
            _ => None,
        }
    }

    /// The magnetometers, if the board has them.
    pub fn magnetometer(&self) -> Option<&Magnetometer> {
        match &self.readout {
            Readout::Magnetometer(chip) => Some(chip),
            _ => None,
        }
    }

    /// Reference resistor at the columns of a matrix, Ω, if there is one.
    pub fn reference(&self) -> Option<f64> {
        match self.first_stage()? {
            Stage::ReferenceDivider(divider) => Some(divider.reference),
            _ => None,
        }
    }

    /// The instrument, if the board is one.
    pub fn measured(&self) -> Option<&Measured> {
        match &self.readout {
            Readout::Measured(measured) => Some(measured),
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
pub struct CapacitanceBoard {
    /// Capacitors along each side of a unit: two or one.
    side: usize,
    frame_rate: f64,
    scan: Scan,
    /// Capacitance to voltage; none before an instrument that gives capacitances.
    amplifier: Option<ChargeAmplifier>,
    /// Stage that makes the numbers of a frame.
    pub last: LastStage,
    rows: usize,
    columns: usize,
}

impl CapacitanceBoard {
    /// The board for `rows` x `columns` units; `None` when it takes no capacitance.
    pub fn new(electronics: &Electronics, rows: usize, columns: usize) -> Option<Self> {
        Self::with_side(2, electronics, rows, columns)
    }

    /// The board for `rows` x `columns` single capacitors; `None` when it takes no
    /// capacitance.
    pub fn of_single(electronics: &Electronics, rows: usize, columns: usize) -> Option<Self> {
        Self::with_side(1, electronics, rows, columns)
    }

    fn with_side(
        side: usize,
        electronics: &Electronics,
        rows: usize,
        columns: usize,
    ) -> Option<Self> {
        let last = electronics.last_stage()?;
        let amplifier = match electronics.first_stage() {
            Some(Stage::ChargeAmplifier(amplifier)) if last.takes(&VOLTAGE) => Some(amplifier),
            None if last.takes(&CAPACITANCE) => None,
            _ => return None,
        };
        Some(Self {
            side,
            frame_rate: electronics.frame_rate,
            scan: electronics.scan,
            amplifier,
            last,
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

    /// Voltage before the last stage, without noise, V; none where there is no amplifier.
    pub fn voltage(&self, capacitance: f64) -> Option<f64> {
        Some(self.amplifier?.voltage(capacitance))
    }

    /// One reading: `normal` is a draw of the standard normal distribution.
    pub fn read(&self, capacitance: f64, normal: f64) -> Delivered {
        let amplifier = self.amplifier.as_ref();
        let input = amplifier.map_or(capacitance, |stage| stage.voltage(capacitance));
        self.last
            .deliver(input + self.noise(self.last.noise()) * normal)
    }

    /// Noise at the input of the last stage, with that of the last stage itself.
    fn noise(&self, last: f64) -> f64 {
        self.amplifier.map_or(0.0, |stage| stage.noise).hypot(last)
    }

    /// Capacitance per unit at the input of the last stage.
    fn farad_per_input(&self) -> f64 {
        let amplifier = self.amplifier.as_ref();
        amplifier.map_or(1.0, ChargeAmplifier::farad_per_volt)
    }

    fn capacitance(&self, input: f64) -> f64 {
        let amplifier = self.amplifier.as_ref();
        amplifier.map_or(input, |stage| stage.capacitance(input))
    }

    /// Numbers of a frame to the capacitances, F, that the ideal board reads so.
    pub fn scale(&self) -> NumberScale {
        let last = self.last.scale();
        let at_zero = self.capacitance(last.at_zero);
        NumberScale {
            at_zero,
            per_number: self.capacitance(last.input(1.0)) - at_zero,
            ..last
        }
    }

    /// Standard deviation of one reading, F: noise, and rounding to counts.
    pub fn deviation(&self) -> f64 {
        self.noise(self.last.deviation()) * self.farad_per_input()
    }

    /// The smallest and largest capacitance that is not clipped, F.
    pub fn span(&self) -> [f64; 2] {
        self.last.range().map(|end| self.capacitance(end))
    }

    /// Key of the noise in a sensor file.
    pub(crate) fn noise_key(&self) -> &'static str {
        match self.last {
            LastStage::Converter(_) => "electronics.readout.charge_amplifier.noise",
            LastStage::Instrument(_) => "electronics.readout.measured.noise",
        }
    }
}
