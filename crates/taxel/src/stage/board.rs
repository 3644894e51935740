//! The board behind a network: first stage, last stage and scan.

use super::{CellQuantity, Readout, Stage};
use crate::electronics::{self, Electronics, LastStage, Scan};
use crate::quantity::{CONDUCTANCE, STRESS, VOLTAGE};

/// A first stage whose output is a straight line of the signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearReadout {
    /// Output at the signal zero, and per signal, SI.
    pub line: [f64; 2],
    /// Noise of one reading at the output, SI.
    pub noise: f64,
}

impl Stage for LinearReadout {}

impl Readout for LinearReadout {
    fn boxed(&self) -> Box<dyn Readout> {
        Box::new(*self)
    }

    fn line(&self) -> [f64; 2] {
        self.line
    }

    fn noise(&self) -> f64 {
        self.noise
    }
}

/// The board of a [`super::Chain`].
#[derive(Debug)]
pub struct Board {
    /// What makes numbers of signals.
    pub readout: Box<dyn Readout>,
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
            Some(dimension) if *dimension == CONDUCTANCE => vec!["transimpedance"],
            Some(dimension) if *dimension == STRESS => vec!["pressure_chip", "measured"],
            Some(_) => vec!["measured"],
            None => vec!["reference_divider"],
        };
        let last = electronics.last_stage().ok_or_else(allowed)?;
        let direct = signal
            .dimension
            .is_some_and(|dimension| last.takes(dimension));
        let of_conductance = signal
            .dimension
            .is_some_and(|dimension| *dimension == CONDUCTANCE);
        let readout = match electronics.first_stage() {
            Some(electronics::Stage::Transimpedance(stage))
                if of_conductance && last.takes(&VOLTAGE) =>
            {
                LinearReadout {
                    line: [0.0, stage.supply * stage.feedback],
                    noise: stage.noise,
                }
            }
            Some(electronics::Stage::ReferenceDivider(stage))
                if signal.dimension.is_none() && last.takes(&VOLTAGE) =>
            {
                LinearReadout {
                    line: [0.0, stage.supply],
                    noise: stage.noise,
                }
            }
            None if direct => LinearReadout {
                line: [electronics.ambient(), 1.0],
                noise: 0.0,
            },
            _ => return Err(allowed()),
        };
        Ok(Self {
            readout: Box::new(readout),
            last,
            scan: electronics.scan,
            period: electronics.period(),
        })
    }
}
