//! Why a virtual device cannot run.

use std::path::PathBuf;
use taxel::shown;

use crate::source::SourceError;

/// Why a virtual device cannot run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// The text names no place for the wire, or none for commands.
    #[error("{option} \"{text}\": {message}")]
    Place {
        /// The option.
        option: &'static str,
        /// The text.
        text: String,
        /// What is wrong with it, and what to write.
        message: String,
    },
    /// The wire cannot be opened or written.
    #[error("{name}: {cause}")]
    Wire {
        /// Name of the port or address.
        name: String,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The file of the truth cannot be written.
    #[error("{}: cannot be written: {cause}", shown::path(path))]
    Truth {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The name of the port cannot be told.
    #[error("cannot print the name of the port: {cause}")]
    NotTold {
        /// The system's reason.
        cause: std::io::Error,
    },
    /// What is played failed.
    #[error("{0}")]
    Source(#[from] SourceError),
}
