//! Work that takes long says what it is and how far it is, on the standard error.

use std::io::{IsTerminal as _, Write as _};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

use crate::note;

/// Work under way: from its first second on it says what it is, how far, and how long it will
/// take, until this is dropped. Of several at a time the last begun speaks.
///
/// It says so by itself, so that work which reports nothing for a while is not silent.
#[derive(Debug)]
pub struct Progress {
    number: u64,
}

/// Silence before the first line: below a second, with what a busy machine takes to wake up.
const SILENCE: Duration = Duration::from_millis(800);
/// Time between two lines: on a terminal, and in a log.
const LIVE: Duration = Duration::from_millis(200);
const LOG: Duration = Duration::from_secs(10);
/// Time between two looks at the work.
const LOOK: Duration = Duration::from_millis(100);

/// What is known of work under way.
#[derive(Debug)]
struct Work {
    number: u64,
    what: String,
    start: Instant,
    fraction: Option<f64>,
    said: Option<Instant>,
}

/// Work under way, and the number of the next.
#[derive(Debug)]
struct Works {
    now: Vec<Work>,
    next: u64,
}

static WORKS: Mutex<Works> = Mutex::new(Works {
    now: Vec::new(),
    next: 0,
});

fn works() -> MutexGuard<'static, Works> {
    // A poisoned lock still holds a whole value.
    WORKS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Progress {
    /// Progress of `what`, which begins now.
    pub fn new(what: impl Into<String>) -> Self {
        static WATCH: Once = Once::new();
        WATCH.call_once(|| {
            // Without the thread the work is silent, and done all the same.
            let _ = std::thread::Builder::new()
                .name("progress".into())
                .spawn(watch);
        });
        let mut works = works();
        let number = works.next;
        works.next += 1;
        works.now.push(Work {
            number,
            what: what.into(),
            start: Instant::now(),
            fraction: None,
            said: None,
        });
        Self { number }
    }

    /// Hears that a fraction of the work is done.
    pub fn at(&self, fraction: f64) {
        let mut works = works();
        let work = works.now.iter_mut().find(|work| work.number == self.number);
        if let Some(work) = work {
            work.fraction = Some(fraction);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        let mut works = works();
        let place = works.now.iter().position(|work| work.number == self.number);
        let said = place.is_some_and(|place| works.now.remove(place).said.is_some());
        drop(works);
        if said && std::io::stderr().is_terminal() {
            let _ = write!(std::io::stderr(), "\r{:<70}\r", "");
        }
    }
}

impl Work {
    /// Its line, once one is due.
    fn line(&mut self, pause: Duration) -> Option<String> {
        let due = match self.said {
            None => self.start.elapsed() >= SILENCE,
            Some(said) => said.elapsed() >= pause,
        };
        if !due {
            return None;
        }
        self.said = Some(Instant::now());
        let gone = self.start.elapsed().as_secs_f64();
        Some(match self.fraction {
            Some(fraction) if fraction > 0.0 => format!(
                "{}: {:.0} %, about {:.0} s left",
                self.what,
                100.0 * fraction,
                gone * (1.0 - fraction) / fraction
            ),
            _ => format!("{}: {gone:.0} s so far", self.what),
        })
    }
}

fn watch() {
    let live = std::io::stderr().is_terminal();
    loop {
        std::thread::sleep(LOOK);
        // Whoever hears the line may wait for something that waits for the lock.
        let line = {
            let mut works = works();
            let work = works.now.last_mut();
            work.and_then(|work| work.line(if live { LIVE } else { LOG }))
        };
        match line {
            Some(line) if live => {
                let _ = write!(std::io::stderr(), "\r{line:<70}");
                let _ = std::io::stderr().flush();
            }
            Some(line) => note!("{line}"),
            None => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_speaks_within_a_second_and_says_how_far() {
        let now = Instant::now();
        let mut work = Work {
            number: 0,
            what: "solving".into(),
            start: now,
            fraction: None,
            said: None,
        };
        assert_eq!(work.line(LOG), None);
        work.start = now
            .checked_sub(Duration::from_secs(20))
            .expect("the machine runs longer");
        assert_eq!(work.line(LOG).as_deref(), Some("solving: 20 s so far"));
        assert_eq!(work.line(LOG), None);
        work.said = Some(work.start);
        work.fraction = Some(0.25);
        let line = work.line(LOG);
        assert_eq!(line.as_deref(), Some("solving: 25 %, about 60 s left"));
    }
}
