//! The board of an array of elements that give charge: one channel each.

use super::{ChargeBand, Delivered, Electronics, LastStage, Output, Scan, Stage};
use crate::quantity::{CHARGE, VOLTAGE};

/// Band, scan and last stage of an array of charge sources.
#[derive(Debug, Clone, PartialEq)]
pub struct ChargeBoard {
    frame_rate: f64,
    scan: Scan,
    /// Stage that makes the numbers of a frame.
    pub last: LastStage,
    rows: usize,
    columns: usize,
    /// Pass band for the charge of one element.
    pub band: ChargeBand,
    /// Output of the last analogue stage: a voltage, or a charge that is measured.
    pub output: Output,
}

impl ChargeBoard {
    /// The board for `rows` x `columns` elements of `capacitance`, F, and leak
    /// `resistance`, Ω; `None` when it takes no charge.
    pub fn new(
        electronics: &Electronics,
        [rows, columns]: [usize; 2],
        capacitance: f64,
        resistance: f64,
    ) -> Option<Self> {
        let last = electronics.last_stage()?;
        let volts = last.takes(&VOLTAGE);
        let (band, output) = match electronics.first_stage() {
            Some(Stage::VoltageAmplifier(stage)) if volts => {
                (stage.band(capacitance, resistance), stage.output)
            }
            Some(Stage::ChargeMode(stage)) if volts => {
                (stage.band(capacitance, resistance), stage.output)
            }
            None if last.takes(&CHARGE) => (ChargeBand::METER, Output::IDEAL),
            None if volts && matches!(last, LastStage::Instrument(_)) => {
                (ChargeBand::open(capacitance, resistance), Output::IDEAL)
            }
            _ => return None,
        };
        Some(Self {
            frame_rate: electronics.frame_rate,
            scan: electronics.scan,
            last,
            rows,
            columns,
            band,
            output,
        })
    }

    /// Time between frames, s.
    pub fn period(&self) -> f64 {
        1.0 / self.frame_rate
    }

    /// Time for one scan, s.
    pub fn scan_time(&self) -> f64 {
        self.scan.duration(self.rows, self.columns)
    }

    /// Sampling time of an element after the start of the frame, s.
    pub fn delay(&self, taxel: usize) -> f64 {
        let (row, column) = (taxel / self.columns, taxel % self.columns);
        self.scan.delay(row, column, self.columns)
    }

    /// Share of the channel before that a reading still holds: the multiplexer
    /// has not settled, exp(−channel time/settling).
    pub fn carried_over(&self) -> f64 {
        match self.scan {
            Scan::Multiplexed(scan) => (-scan.channel_time / self.output.settling).exp(),
            Scan::Simultaneous | Scan::RowParallel(_) => 0.0,
        }
    }

    /// One reading of the ideal `output`: `normal` is a draw of the
    /// standard normal distribution.
    pub fn read(&self, output: f64, normal: f64) -> Delivered {
        let noise = self.output.noise.hypot(self.last.noise());
        let (output, cut) = self.output.limited(output + noise * normal);
        let delivered = self.last.deliver(output);
        Delivered {
            clipped: delivered.clipped || cut,
            ..delivered
        }
    }

    /// Output that reads as `number`, V, or C of a charge that is measured.
    pub fn reading(&self, number: f64) -> f64 {
        self.last.scale().input(number)
    }

    /// Width of one count at the output; zero of an instrument.
    pub fn step(&self) -> f64 {
        self.last.step()
    }

    /// The least and the greatest output that is not clipped.
    pub fn span(&self) -> [f64; 2] {
        let [low, high] = self.last.range();
        [low.max(-self.output.limit), high.min(self.output.limit)]
    }

    /// Largest size of the output: the limit of the last analogue stage, or the range of an
    /// instrument.
    pub fn largest(&self) -> f64 {
        match self.last {
            LastStage::Converter(_) => self.output.limit,
            LastStage::Instrument(_) => self.output.limit.min(self.span()[1]),
        }
    }

    /// Standard deviation of one reading of the output: noise, and rounding to counts.
    pub fn deviation(&self) -> f64 {
        self.output.noise.hypot(self.last.deviation())
    }

    /// Name of the output, its SI unit at the end of a key, and its unit for people with the
    /// SI value: a voltage in mV, or what the instrument gives.
    pub fn unit(&self) -> OutputUnit {
        let voltage = OutputUnit {
            quantity: "voltage",
            key: "v",
            symbol: "mV",
            si_per_unit: 1e-3,
        };
        match self.last {
            LastStage::Converter(_) => voltage,
            LastStage::Instrument(measured) => OutputUnit {
                quantity: measured.unit.dimension.noun(),
                key: measured.unit.key(),
                symbol: measured.unit.symbol,
                si_per_unit: measured.unit.si_per_unit,
            },
        }
    }
}

/// Unit of the output of a board that takes charge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputUnit {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// SI unit as it ends a key.
    pub key: &'static str,
    /// Unit for people.
    pub symbol: &'static str,
    /// SI value of that unit.
    pub si_per_unit: f64,
}
