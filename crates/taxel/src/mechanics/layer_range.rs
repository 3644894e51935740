//! Where the laws of a compressed layer hold.

/// Largest relative compression at which the layer model was compared with
/// finite elements.
pub const LARGEST_COMPRESSION: f64 = 0.4;
/// Least half length over thickness for which the force was compared, unless
/// the end condition itself comes from finite elements.
pub const LEAST_ASPECT: f64 = 2.0;

/// Why a layer has no answer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayerError {
    /// A relative compression that no layer can have.
    #[error("a relative compression of {compression} is outside 0 (included) to 1 (excluded)")]
    Compression {
        /// Compression that was asked for.
        compression: f64,
    },
    /// A compression beyond the greatest force of the model.
    #[error(
        "a relative compression of {compression} is outside 0 to {limit:.3}, where the force of the model is greatest and begins to fall"
    )]
    Falling {
        /// Compression that was asked for.
        compression: f64,
        /// Compression of the greatest force.
        limit: f64,
    },
    /// A force that the model does not reach, or a pull.
    #[error(
        "a force of {force:.4e} N is outside 0 to {limit:.4e} N, the force at the largest compression of the model"
    )]
    Force {
        /// Force that was asked for, N.
        force: f64,
        /// Largest force, N.
        limit: f64,
    },
    /// The tabulated end condition does not reach to this layer.
    #[error(
        "a half length of {aspect:.3} thicknesses is below {least}, where the table of the end condition begins"
    )]
    AspectOutsideTable {
        /// Half length over thickness.
        aspect: f64,
        /// Where the table begins.
        least: f64,
    },
    /// The end condition leaves too little shear for a force that rises with
    /// the compression.
    #[error(
        "an end factor of {chi:.3} is below {least}: the force would not rise with compression"
    )]
    EndFactor {
        /// χ.
        chi: f64,
        /// Its least value.
        least: f64,
    },
}

/// Verified range of a layer, and the ranges beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LayerRange {
    /// Inside.
    Within,
    /// Compressed more than its force was compared with finite elements.
    CompressionAbove {
        /// That limit.
        limit: f64,
    },
    /// Shorter than its force was compared with finite elements: stretch and
    /// gap hold, the force does not.
    AspectBelow {
        /// Half length over thickness.
        aspect: f64,
        /// That limit.
        limit: f64,
    },
}
