//! The board of an array of elements that give charge: one channel each.

use super::{ChargeBand, Code, Converter, Electronics, Output, Readout, Scan};

/// Band, scan and converter of an array of charge sources.
#[derive(Debug, Clone, PartialEq)]
pub struct ChargeBoard {
    frame_rate: f64,
    scan: Scan,
    converter: Converter,
    rows: usize,
    columns: usize,
    /// Pass band for the charge of one element.
    pub band: ChargeBand,
    /// Output of the last analogue stage.
    pub output: Output,
}

impl ChargeBoard {
    /// The board for `rows` x `columns` elements of `capacitance`, F, and leak
    /// `resistance`, Ω; `None` when its first stage takes no charge.
    pub fn new(
        electronics: &Electronics,
        [rows, columns]: [usize; 2],
        capacitance: f64,
        resistance: f64,
    ) -> Option<Self> {
        let (band, output) = match &electronics.readout {
            Readout::VoltageAmplifier(stage) => (stage.band(capacitance, resistance), stage.output),
            Readout::ChargeMode(stage) => (stage.band(capacitance, resistance), stage.output),
            Readout::ChargeAmplifier(_) | Readout::VoltageDivider(_) | Readout::Digital(_) => {
                return None;
            }
        };
        Some(Self {
            frame_rate: electronics.frame_rate,
            scan: electronics.scan,
            converter: electronics.converter?,
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

    /// One reading of the ideal output `voltage`: `normal` is a draw of the
    /// standard normal distribution.
    pub fn read(&self, voltage: f64, normal: f64) -> Code {
        let (voltage, cut) = self.output.limited(voltage + self.output.noise * normal);
        let code = self.converter.convert(voltage);
        Code {
            clipped: code.clipped || cut,
            ..code
        }
    }

    /// Voltage in the middle of a code, V.
    pub fn voltage(&self, counts: f64) -> f64 {
        self.converter.voltage(counts)
    }

    /// Width of one count, V.
    pub fn step(&self) -> f64 {
        self.converter.step()
    }

    /// The least and the greatest voltage that is not clipped, V.
    pub fn span(&self) -> [f64; 2] {
        let [low, high] = self.converter.range;
        [low.max(-self.output.limit), high.min(self.output.limit)]
    }

    /// Standard deviation of one reading, V: noise and rounding to counts.
    pub fn deviation(&self) -> f64 {
        self.output.noise.hypot(self.step() / 12.0_f64.sqrt())
    }
}
