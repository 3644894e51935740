//! What a board makes of the resistance of a channel.

/// Signal of the resistance of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ResistanceSignal {
    /// The voltage of a divider whose lower arm is the channel with its leads:
    /// V = V_S R/(R_ref + R), R = channel + leads (P4 Eq. 3).
    Divider {
        /// Supply V_S, V.
        supply: f64,
        /// Reference resistor R_ref, Ω.
        reference: f64,
        /// Leads in series with a channel, Ω.
        lead: f64,
    },
    /// The resistance itself with its leads, Ω.
    Resistance {
        /// Leads in series with a channel, Ω: none with four wires.
        lead: f64,
        /// Largest reading, Ω.
        highest: f64,
    },
}

impl ResistanceSignal {
    /// Signal of a channel of `resistance`, Ω. An open channel (infinite) gives
    /// [`Self::open`].
    pub fn of(&self, resistance: f64) -> f64 {
        match *self {
            // Written with the quotient, so that an open channel is V_S.
            Self::Divider {
                supply,
                reference,
                lead,
            } => supply / (1.0 + reference / (resistance + lead)),
            Self::Resistance { lead, .. } => resistance + lead,
        }
    }

    /// Resistance of the channel that gives `signal`, Ω, for signals below
    /// [`Self::open`].
    pub fn resistance(&self, signal: f64) -> f64 {
        match *self {
            Self::Divider {
                supply,
                reference,
                lead,
            } => reference * signal / (supply - signal) - lead,
            Self::Resistance { lead, .. } => signal - lead,
        }
    }

    /// The same; none for a signal at [`Self::open`] or beyond.
    pub fn resistance_below_open(&self, signal: f64) -> Option<f64> {
        (signal < self.open()).then(|| self.resistance(signal))
    }

    /// Signal per resistance for a channel of `resistance`, Ω: of a divider
    /// V_S R_ref/(R_ref + R)².
    pub fn slope(&self, resistance: f64) -> f64 {
        match *self {
            Self::Divider {
                supply,
                reference,
                lead,
            } => {
                let sum = reference + lead + resistance;
                supply * reference / (sum * sum)
            }
            Self::Resistance { .. } => 1.0,
        }
    }

    /// Leads in series with a channel, Ω.
    pub fn lead(&self) -> f64 {
        match *self {
            Self::Divider { lead, .. } | Self::Resistance { lead, .. } => lead,
        }
    }

    /// The same with other leads, Ω.
    #[must_use]
    pub fn with_lead(mut self, ohms: f64) -> Self {
        match &mut self {
            Self::Divider { lead, .. } | Self::Resistance { lead, .. } => *lead = ohms,
        }
        self
    }

    /// Signal of an open channel.
    pub fn open(&self) -> f64 {
        match *self {
            Self::Divider { supply, .. } => supply,
            Self::Resistance { .. } => f64::INFINITY,
        }
    }

    /// The largest signal that there can be: that of an open channel, or the end of the range.
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Divider { supply, .. } => supply,
            Self::Resistance { highest, .. } => highest,
        }
    }

    /// True if the signal is a voltage.
    pub fn is_voltage(&self) -> bool {
        matches!(self, Self::Divider { .. })
    }

    /// Name of the signal and its SI unit.
    pub fn unit(&self) -> (&'static str, &'static str) {
        match self {
            Self::Divider { .. } => ("voltage", "V"),
            Self::Resistance { .. } => ("resistance", "ohm"),
        }
    }

    /// Unit of the signal for people, with its SI value.
    pub fn shown(&self) -> (&'static str, f64) {
        match self {
            Self::Divider { .. } => ("mV", 1e-3),
            Self::Resistance { .. } => ("ohm", 1.0),
        }
    }
}
