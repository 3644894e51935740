//! Hysteresis: less force is left on unloading than the same value had on loading.

use super::Memory;
use crate::mechanics::{ForceHysteresis, LoadHistory};

/// The hysteresis that slow loops of a calibration identified.
#[derive(Debug, Clone)]
pub struct Hysteresis {
    law: ForceHysteresis,
    history: LoadHistory,
}

impl Hysteresis {
    /// The hysteresis of `law` in a cell that nothing has pressed.
    pub fn new(law: ForceHysteresis) -> Self {
        Self {
            law,
            history: LoadHistory::default(),
        }
    }
}

impl Memory for Hysteresis {
    /// The load itself: the law is one of reading it back, and the twin has none.
    fn respond(&mut self, load: f64, _elapsed: f64) -> f64 {
        load
    }

    fn recover(&mut self, cell_load: f64, _elapsed: f64) -> [f64; 2] {
        let share = self.law.share(&self.history.push(cell_load));
        [share * cell_load, share]
    }

    fn times(&self) -> Vec<f64> {
        Vec::new()
    }

    fn fresh(&self) -> Box<dyn Memory> {
        Box::new(Self::new(self.law))
    }
}
