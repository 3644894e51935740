//! Why a link cannot be used.

/// Why a link cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The text names no link.
    #[error("--source \"{text}\": {message}")]
    Address {
        /// The text.
        text: String,
        /// What is wrong with it, and what to write.
        message: String,
    },
    /// It cannot be opened now; it may be later.
    #[error("{name}: {reason}")]
    Open {
        /// Name of the port, host or program.
        name: String,
        /// The reason, and what to do.
        reason: String,
    },
    /// It cannot be opened, and waiting does not help.
    #[error("{name}: {reason}")]
    Never {
        /// Name of the port, host or program.
        name: String,
        /// The reason, and what to do.
        reason: String,
    },
    /// The link was lost, and the run was to end then.
    #[error("{name}: {reason}; the run ends here because of --once")]
    Lost {
        /// Name of the port, host or program.
        name: String,
        /// How it was lost.
        reason: String,
    },
    /// The board says now that its frames hold something else.
    #[error(
        "{name}: the board has changed: {difference}; start again, so that its frames are read as it says now"
    )]
    Changed {
        /// Name of the port, host or program.
        name: String,
        /// What is different.
        difference: String,
    },
    /// The thread of the link could not be started.
    #[error("the system refused a thread for the link: {cause}")]
    Thread {
        /// The system's reason.
        cause: std::io::Error,
    },
}
