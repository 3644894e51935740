//! The board behind a network: first stage, last stage and scan.

use super::{CellQuantity, ChainPart, ReadoutLaw};
use crate::electronics::{self, ChargeAmplifier, Electronics, LastStage, NUMBER, Scan};
use crate::quantity::{CAPACITANCE, CONDUCTANCE, FLUX_DENSITY, STRESS, VOLTAGE};
use crate::signal::NumberScale;

/// A first stage whose output is a straight line of the signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearReadout {
    /// Output at the signal zero, and per signal, SI.
    pub line: [f64; 2],
    /// Noise of one reading at the output, SI.
    pub noise: f64,
}

impl ChainPart for LinearReadout {}

impl ReadoutLaw for LinearReadout {
    fn boxed(&self) -> Box<dyn ReadoutLaw> {
        Box::new(*self)
    }

    fn input(&self, signal: f64) -> f64 {
        self.line[0] + self.line[1] * signal
    }

    fn signal(&self, input: f64) -> f64 {
        (input - self.line[0]) / self.line[1]
    }

    fn deviation(&self, of_input: f64) -> f64 {
        (of_input / self.line[1]).abs()
    }

    fn scale(&self, last: NumberScale) -> NumberScale {
        NumberScale {
            at_zero: self.signal(last.at_zero),
            per_number: last.per_number / self.line[1],
            ..last
        }
    }

    fn noise(&self) -> f64 {
        self.noise
    }
}

impl ChainPart for ChargeAmplifier {}

/// The signal is a capacitance.
impl ReadoutLaw for ChargeAmplifier {
    fn boxed(&self) -> Box<dyn ReadoutLaw> {
        Box::new(*self)
    }

    fn input(&self, signal: f64) -> f64 {
        self.voltage(signal)
    }

    fn signal(&self, input: f64) -> f64 {
        self.capacitance(input)
    }

    fn deviation(&self, of_input: f64) -> f64 {
        of_input * self.farad_per_volt()
    }

    fn noise(&self) -> f64 {
        self.noise
    }
}

/// The board of a [`super::Chain`].
#[derive(Debug)]
pub struct Board {
    /// What makes numbers of signals.
    pub readout: Box<dyn ReadoutLaw>,
    /// Stage that makes the numbers of a frame.
    pub last: LastStage,
    /// Order of reading.
    pub scan: Scan,
    /// Time between frames, s.
    pub period: f64,
}

impl Board {
    /// The board that reads signals of this kind.
    ///
    /// # Errors
    /// Keys of the readouts that can, where this one cannot.
    pub fn new(electronics: &Electronics, signal: CellQuantity) -> Result<Self, Vec<&'static str>> {
        let allowed = || match signal.dimension {
            Some(dimension) if *dimension == CAPACITANCE => {
                vec!["charge_amplifier", "capacitance_to_digital", "measured"]
            }
            Some(dimension) if *dimension == CONDUCTANCE => vec!["transimpedance"],
            Some(dimension) if *dimension == STRESS => vec!["pressure_chip", "measured"],
            Some(dimension) if *dimension == FLUX_DENSITY => vec!["magnetometer"],
            Some(dimension) if *dimension == NUMBER => vec!["digital"],
            Some(_) => vec!["measured"],
            None => vec!["reference_divider"],
        };
        let last = electronics.last_stage().ok_or_else(allowed)?;
        let direct = signal
            .dimension
            .is_some_and(|dimension| last.takes(dimension));
        let is = |wanted| signal.dimension == Some(wanted);
        let readout: Box<dyn ReadoutLaw> = match electronics.first_stage() {
            Some(electronics::Stage::Transimpedance(stage))
                if is(&CONDUCTANCE) && last.takes(&VOLTAGE) =>
            {
                Box::new(LinearReadout {
                    line: [0.0, stage.supply * stage.feedback],
                    noise: stage.noise,
                })
            }
            Some(electronics::Stage::ChargeAmplifier(stage))
                if is(&CAPACITANCE) && last.takes(&VOLTAGE) =>
            {
                Box::new(stage)
            }
            Some(electronics::Stage::ReferenceDivider(stage))
                if signal.dimension.is_none() && last.takes(&VOLTAGE) =>
            {
                Box::new(LinearReadout {
                    line: [0.0, stage.supply],
                    noise: stage.noise,
                })
            }
            None if direct => Box::new(LinearReadout {
                line: [electronics.ambient(), 1.0],
                noise: 0.0,
            }),
            _ => return Err(allowed()),
        };
        Ok(Self {
            readout,
            last,
            scan: electronics.scan,
            period: electronics.period(),
        })
    }
}
