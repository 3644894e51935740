//! How much a number says: all, a least value, or nothing.

/// How much a total, the force of a contact or the value of an event says; the worse, the greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[repr(u8)]
pub enum Certainty {
    /// The number with its standard deviation.
    #[default]
    Exact = 0,
    /// No less than the number: something that presses is not part of it, or reads no more than a
    /// bound.
    AtLeast = 1,
    /// Nothing is known.
    Unknown = 2,
}

impl Certainty {
    /// All of them in the order of their codes.
    pub const ALL: [Self; 3] = [Self::Exact, Self::AtLeast, Self::Unknown];

    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::AtLeast => "at_least",
            Self::Unknown => "unknown",
        }
    }
}
