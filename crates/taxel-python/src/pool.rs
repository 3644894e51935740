//! Work outside the interpreter: on threads of its own, with an ear for Ctrl-C.
//!
//! Rayon's global pool does not survive `fork`: its threads stay in the parent, and the first
//! parallel call of a child would wait for them for ever. So there is one pool for each process,
//! made when it is first needed. In a child the pool of the parent is left alone.

use std::mem;
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::fault::{Fault, value_error};

/// Time between two looks for a signal.
const LOOK: Duration = Duration::from_millis(20);

/// The pool with the process that it is of and the threads that were asked for.
struct Pool {
    process: u32,
    asked: usize,
    threads: Option<Arc<ThreadPool>>,
}

static POOL: Mutex<Pool> = Mutex::new(Pool {
    process: 0,
    asked: 0,
    threads: None,
});

/// Sets and returns the number of threads that work uses; 0 for one for each core, None to ask.
#[pyfunction]
#[pyo3(signature = (number = None))]
pub(crate) fn threads(number: Option<i64>) -> PyResult<usize> {
    if let Some(number) = number {
        let number = usize::try_from(number)
            .ok()
            .filter(|number| *number <= 1024);
        let number = number.ok_or_else(|| value_error("threads: must be from 0 to 1024"))?;
        let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
        pool.asked = number;
        // Work under way ends on the threads that it has.
        left(&mut pool);
    }
    Ok(current()?.current_num_threads())
}

/// Lets go of the threads: of a process that was forked they do not exist here.
fn left(pool: &mut Pool) {
    if let Some(threads) = pool.threads.take()
        && pool.process != std::process::id()
    {
        mem::forget(threads);
    }
}

fn current() -> Result<Arc<ThreadPool>, Fault> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if pool.process != process {
        left(&mut pool);
        pool.process = process;
    }
    if let Some(threads) = &pool.threads {
        return Ok(Arc::clone(threads));
    }
    let made = rayon::ThreadPoolBuilder::new()
        .num_threads(pool.asked)
        .build();
    let made = made.map_err(|error| Fault::Solve(format!("no threads for the work: {error}")))?;
    let made = Arc::new(made);
    pool.threads = Some(Arc::clone(&made));
    Ok(made)
}

/// Request of the user to stop.
#[derive(Clone, Copy)]
pub(crate) struct Request<'a>(&'a Arc<AtomicBool>);

/// What unwinds work that the user has stopped.
struct Stopped;

impl Request<'_> {
    /// True once the user wants to stop.
    pub(crate) fn asked(self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// The request for who outlives it.
    pub(crate) fn flag(self) -> Arc<AtomicBool> {
        Arc::clone(self.0)
    }

    /// Leaves work that has no other way to end, if the user wants to stop.
    pub(crate) fn leave(self) {
        if self.asked() {
            // No panic: nothing is told, and the caller below takes it.
            panic::resume_unwind(Box::new(Stopped));
        }
    }
}

/// Does `work` on the pool, without the interpreter.
///
/// # Errors
/// Those of `work`, and the exception of a signal handler, such as `KeyboardInterrupt`.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(Request<'_>) -> Result<T, Fault> + Send,
) -> PyResult<T> {
    let pool = current()?;
    let stop = Arc::new(AtomicBool::new(false));
    let mut raised = None;
    let result = py.detach(|| {
        let (done, heard) = mpsc::channel();
        std::thread::scope(|scope| {
            let (stop, pool) = (&stop, &pool);
            let worker = scope.spawn(move || {
                // Dropped at the end, also of work that unwinds.
                let _done: mpsc::Sender<()> = done;
                pool.install(|| work(Request(stop)))
            });
            let look = |py: Python<'_>| py.check_signals();
            while heard.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none()
                    && let Err(error) = Python::attach(look)
                {
                    raised = Some(error);
                    stop.store(true, Ordering::Relaxed);
                }
            }
            worker.join()
        })
    });
    match (result, raised) {
        (_, Some(raised)) => Err(raised),
        (Ok(result), None) => Ok(result?),
        (Err(payload), None) => panic::resume_unwind(payload),
    }
}
