//! How far long work is, for whoever shows it.
//!
//! Work of many parts counts them here, on any thread. A program that shows progress listens; without
//! a listener a part costs one addition.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// What is done of a work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is counted, in a few words.
    pub what: &'static str,
    /// Parts that are done, of so many.
    pub done: u64,
    /// All parts.
    pub of: u64,
}

/// Hears of work as it begins, of each part that is done, and `None` once the work is over.
pub type Listener = fn(Option<Progress>);

static LISTENER: OnceLock<Listener> = OnceLock::new();
static COUNTED: AtomicBool = AtomicBool::new(false);

/// From now on `listener` hears of all work of this process; the first one stays.
pub fn heard_by(listener: Listener) {
    let _ = LISTENER.set(listener);
}

/// Work of so many parts, until it is dropped. Of work within other counted work nothing is heard.
#[derive(Debug)]
pub struct Parts {
    what: &'static str,
    of: u64,
    done: AtomicU64,
    heard: bool,
}

impl Parts {
    /// Begins work of `of` parts.
    pub fn new(what: &'static str, of: u64) -> Self {
        let parts = Self {
            what,
            of,
            done: AtomicU64::new(0),
            heard: !COUNTED.swap(true, Ordering::Relaxed),
        };
        parts.done(0);
        parts
    }

    /// So many more parts are done.
    pub fn done(&self, parts: u64) {
        let done = self.done.fetch_add(parts, Ordering::Relaxed) + parts;
        self.tell(Some(Progress {
            what: self.what,
            done: done.min(self.of),
            of: self.of,
        }));
    }

    fn tell(&self, progress: Option<Progress>) {
        if let Some(listener) = LISTENER.get().filter(|_| self.heard) {
            listener(progress);
        }
    }
}

impl Drop for Parts {
    fn drop(&mut self) {
        self.tell(None);
        if self.heard {
            COUNTED.store(false, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    static HEARD: Mutex<Vec<Option<[u64; 2]>>> = Mutex::new(Vec::new());

    #[test]
    fn each_part_of_the_outer_work_is_heard() {
        heard_by(|progress| {
            let mut heard = HEARD.lock().expect("no listener panics");
            heard.push(progress.map(|progress| [progress.done, progress.of]));
        });
        for _ in 0..2 {
            let outer = Parts::new("fits", 2);
            let inner = Parts::new("iterations", 9);
            inner.done(1);
            outer.done(1);
            drop(inner);
            outer.done(3);
        }
        let once = [Some([0, 2]), Some([1, 2]), Some([2, 2]), None];
        let heard = HEARD.lock().expect("no listener panics");
        assert_eq!(*heard, [once, once].concat());
    }
}
