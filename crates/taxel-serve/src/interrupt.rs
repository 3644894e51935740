//! Ctrl-C during long work, so that what is done can be kept.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Request of the user to stop.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Listens from now on; `first` hears of the first Ctrl-C, a second one ends the
    /// program at once.
    pub fn listen(first: impl FnOnce() + Send + 'static) -> Self {
        let interrupt = Self::default();
        let flag = interrupt.clone();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build();
            let Ok(runtime) = runtime else { return };
            runtime.block_on(async {
                if tokio::signal::ctrl_c().await.is_ok() {
                    flag.0.store(true, Ordering::Relaxed);
                    first();
                    if tokio::signal::ctrl_c().await.is_ok() {
                        std::process::exit(1);
                    }
                }
            });
        });
        interrupt
    }

    /// True if Ctrl-C was pressed.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
