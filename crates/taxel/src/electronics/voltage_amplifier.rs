//! Reading the charge of a piezoelectric element: as the voltage on its own
//! capacitance, or moved to the capacitor of an amplifier.

use crate::linear::Transfer;

/// A stage of high input impedance that follows the voltage of the element
/// (P3 Eq. 25, figure 7(b)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoltageAmplifier {
    /// Gain; 1 for a follower.
    pub gain: f64,
}

impl VoltageAmplifier {
    /// Output per voltage of the element.
    pub fn transfer(&self) -> Transfer {
        Transfer::constant(self.gain)
    }
}

/// A charge amplifier: the element between ground and the inverting input,
/// R_f parallel to C_f as feedback (P3 Eq. 26).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChargeMode {
    /// Feedback resistance R_f, Ω.
    pub feedback_resistance: f64,
    /// Feedback capacitance C_f, F.
    pub feedback_capacitance: f64,
    /// Open-loop gain A₀; infinite for the ideal amplifier.
    pub open_loop_gain: f64,
}

impl ChargeMode {
    /// Output voltage per charge of a source of `capacitance` C, F, and
    /// `leak_resistance` R, Ω; V/C.
    ///
    /// −s/(s C_f′ + 1/R_f′) with C_f′ = C_f + (C + C_f)/A₀ and
    /// 1/R_f′ = 1/R_f + (1/R + 1/R_f)/A₀: Kirchhoff's law at the inverting
    /// input, which stays at −V/A₀. The ideal amplifier gives
    /// −s R_f/(1 + s R_f C_f), and −1/C_f above its corner (P3 Eq. 26).
    pub fn transfer(&self, capacitance: f64, leak_resistance: f64) -> Transfer {
        let per_gain = 1.0 / self.open_loop_gain;
        let feedback =
            self.feedback_capacitance + (capacitance + self.feedback_capacitance) * per_gain;
        let leak = 1.0 / self.feedback_resistance;
        let leak = leak + (1.0 / leak_resistance + leak) * per_gain;
        Transfer::high_pass(-1.0 / feedback, feedback / leak)
    }
}
