//! Time and memory of a run.

use std::time::Instant;

/// Clock and computing time since its beginning.
pub(crate) struct Meter {
    clock: Instant,
    computed: f64,
}

impl Meter {
    pub(crate) fn start() -> Self {
        Self {
            clock: Instant::now(),
            computed: computed(),
        }
    }

    /// Seconds by the clock.
    pub(crate) fn wall(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    /// Seconds that this thread computed.
    pub(crate) fn cpu(&self) -> f64 {
        computed() - self.computed
    }
}

/// Time that the calling thread has computed, s; Linux counts it. Where it does not,
/// zero.
fn computed() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|word| word.parse().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}

/// Greatest memory of this process so far, MB; zero where Linux does not report it.
pub(crate) fn peak_megabytes() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes = text
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    (kilobytes.unwrap_or(0.0) / 1024.0).round()
}
