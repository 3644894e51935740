//! Frames: what any source of readings delivers.

/// One reading of every channel of a device.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Running number given by the device; a jump means lost frames.
    pub sequence: u64,
    /// Device time of the start of the frame, ns.
    pub time_ns: u64,
    /// One value per channel in SI units (see [`Stream::unit`]), taxel by
    /// taxel, row by row; `NaN` where there is no reading.
    pub values: Vec<f64>,
    /// Arrival of its last byte by the steady clock of this computer, ns since the source was
    /// opened; `None` for frames that did not come over a link.
    pub host_ns: Option<u64>,
    /// What is not certain about the frame.
    pub flags: FrameFlags,
}

/// What is not certain about a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameFlags(u8);

impl FrameFlags {
    /// Nothing is uncertain.
    pub const NONE: Self = Self(0);
    /// The wire has no check that would show damage of a value.
    pub const UNCHECKED_WIRE: Self = Self(1);
    /// The device time is not the device's own: it follows from the counter or from the arrival.
    pub const INFERRED_TIME: Self = Self(2);

    /// The flags as one number, as recordings hold them.
    pub fn bits(self) -> u8 {
        self.0
    }

    /// The flags of such a number; unknown bits are kept.
    pub fn of_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// These flags and those of `other`.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// True if all flags of `other` are set.
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// Meaning of the frames of a source.
#[derive(Debug, Clone, PartialEq)]
pub struct Stream {
    /// Name of the source.
    pub name: String,
    /// Rows of taxels; row 0 is the first one of the device's drawing.
    pub rows: usize,
    /// Columns of taxels.
    pub columns: usize,
    /// Channels of one taxel (4 for the three-axis capacitor, 1 for a
    /// pressure map).
    pub channels_per_taxel: usize,
    /// Quantity of the channel values and the unit people read it in.
    pub unit: SignalUnit,
    /// Spacing of rows and of columns, m, where the source states it.
    pub pitch: Option<[f64; 2]>,
    /// Time between frames, s, where the source states it.
    pub period: Option<f64>,
    /// Readings at or below this (in the SI unit) are noise, where the source
    /// states it.
    pub threshold: Option<f64>,
    /// `false` for a channel that does not exist; as long as a frame.
    pub present: Vec<bool>,
}

impl Stream {
    /// Counts of a converter, `channels_per_taxel` for each of `rows` x `columns`
    /// taxels, every `period` s; `pitch` of rows and of columns in m; without a name.
    pub fn of_counts(
        [rows, columns]: [usize; 2],
        pitch: [f64; 2],
        channels_per_taxel: usize,
        period: f64,
    ) -> Self {
        Self {
            name: String::new(),
            rows,
            columns,
            channels_per_taxel,
            unit: SignalUnit {
                quantity: Quantity::Counts,
                symbol: "counts".into(),
                si_per_unit: 1.0,
            },
            pitch: Some(pitch),
            period: Some(period),
            threshold: None,
            present: vec![true; channels_per_taxel * rows * columns],
        }
    }

    /// Number of channels of a frame.
    pub fn channels(&self) -> usize {
        self.rows * self.columns * self.channels_per_taxel
    }
}

/// The quantity that a channel carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Counts of an analogue-to-digital converter.
    Counts,
    /// Capacitance, F.
    Capacitance,
    /// Voltage, V.
    Voltage,
    /// Resistance, Ω.
    Resistance,
    /// Charge, C.
    Charge,
    /// Force on each taxel, N.
    Force,
    /// Pressure, Pa.
    Pressure,
    /// Magnetic flux density, T.
    FluxDensity,
    /// A number whose meaning the source does not state.
    Raw,
}

impl Quantity {
    /// All quantities.
    const ALL: [Self; 9] = [
        Self::Counts,
        Self::Capacitance,
        Self::Voltage,
        Self::Resistance,
        Self::Charge,
        Self::Force,
        Self::Pressure,
        Self::FluxDensity,
        Self::Raw,
    ];

    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Counts => "counts",
            Self::Capacitance => "capacitance",
            Self::Voltage => "voltage",
            Self::Resistance => "resistance",
            Self::Charge => "charge",
            Self::Force => "force",
            Self::Pressure => "pressure",
            Self::FluxDensity => "flux_density",
            Self::Raw => "raw",
        }
    }

    /// The quantity of this name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.name() == name)
    }
}

/// A quantity, and the unit in which people read it.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalUnit {
    /// The quantity; values are stored in its SI unit.
    pub quantity: Quantity,
    /// The unit shown to people, such as `mmHg`.
    pub symbol: String,
    /// SI value of one shown unit: shown = SI / `si_per_unit`.
    pub si_per_unit: f64,
}
