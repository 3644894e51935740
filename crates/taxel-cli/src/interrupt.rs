//! Ctrl-C and other requests to end during long work.

use crate::outputs;

/// Request of the user to stop.
pub(crate) struct Interrupt(taxel_serve::Interrupt);

impl Interrupt {
    /// Listens from now on; a second request ends the program at once.
    pub(crate) fn listen() -> Self {
        Self::listen_with(|_| note!("stopping; what is done is kept"))
    }

    /// Listens from now on; `first` hears the number of the first signal.
    pub(crate) fn listen_with(first: impl FnOnce(i32) + Send + 'static) -> Self {
        Self(taxel_serve::Interrupt::listen(first))
    }

    /// The request itself.
    pub(crate) fn flag(&self) -> &taxel_serve::Interrupt {
        &self.0
    }

    pub(crate) fn asked(&self) -> bool {
        self.0.asked()
    }
}

/// From now on a signal that ends the program also removes the file that is half written.
pub(crate) fn leave_nothing_unfinished() {
    Interrupt::listen_with(|signal| {
        outputs::remove_unfinished();
        // The code that a shell gives to a program that a signal has ended.
        std::process::exit(128 + signal);
    });
}
