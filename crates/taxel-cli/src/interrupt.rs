//! Ctrl-C during long work: what is done is kept.

/// Request of the user to stop.
pub(crate) struct Interrupt(taxel_serve::Interrupt);

impl Interrupt {
    /// Listens from now on; a second Ctrl-C ends the program at once.
    pub(crate) fn listen() -> Self {
        Self(taxel_serve::Interrupt::listen(|| {
            eprintln!("stopping after what is being solved; Ctrl-C again ends at once");
        }))
    }

    pub(crate) fn asked(&self) -> bool {
        self.0.asked()
    }
}
