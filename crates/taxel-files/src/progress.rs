//! Work that takes long says what it is and how far it is, on the standard error.

use std::io::{IsTerminal as _, Write as _};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

use taxel_ground::work;

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
    /// Parts that it counts, and since when.
    parts: Option<(work::Progress, Instant)>,
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
            work::heard_by(hear);
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
            parts: None,
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
        let far = |since: Instant, fraction: f64| {
            let gone = since.elapsed().as_secs_f64();
            if fraction > 0.0 {
                format!("about {:.0} s left", gone * (1.0 - fraction) / fraction)
            } else {
                format!("{gone:.0} s so far")
            }
        };
        Some(match (self.parts, self.fraction) {
            (Some((work::Progress { what, done, of }, since)), _) => {
                let fraction = done as f64 / of.max(1) as f64;
                let counted = if of < COUNTABLE {
                    format!("{done} of {of}")
                } else {
                    format!("{:.0} %", 100.0 * fraction)
                };
                format!("{what}: {counted}, {}", far(since, fraction))
            }
            (None, Some(fraction)) if fraction > 0.0 => {
                let far = far(self.start, fraction);
                format!("{}: {:.0} %, {far}", self.what, 100.0 * fraction)
            }
            _ => format!("{}: {}", self.what, far(self.start, 0.0)),
        })
    }
}

/// Parts are counted below this number; of more the share is said.
const COUNTABLE: u64 = 1000;

/// Hears of the parts of the work that was begun last.
fn hear(parts: Option<work::Progress>) {
    if let Some(work) = works().now.last_mut() {
        let since = work.parts.map(|(_, since)| since);
        work.parts = parts.map(|parts| (parts, since.unwrap_or_else(Instant::now)));
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
            parts: None,
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
        for (done, of, line) in [
            (0, 7, "fits: 0 of 7, 20 s so far"),
            (5, 7, "fits: 5 of 7, about 8 s left"),
            (25_000, 40_000, "fits: 62 %, about 12 s left"),
        ] {
            let what = "fits";
            work.parts = Some((work::Progress { what, done, of }, work.start));
            work.said = None;
            assert_eq!(work.line(LOG).as_deref(), Some(line));
        }
    }
}
