//! Long work without the global interpreter lock, and how it ends early.

use std::num::NonZeroUsize;
use std::sync::OnceLock;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::marker::Ungil;
use pyo3::prelude::*;

use crate::interrupts::Interrupts;

/// How often a waiting call looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// What a command may need of it: as much as the main thread of the program has.
const STACK: usize = 8 << 20;

/// Lets the lock go while `work` runs: every long call comes through here.
pub fn without_the_lock<T: Ungil>(py: Python<'_>, work: impl FnOnce() -> T + Ungil) -> T {
    py.detach(work)
}

/// Runs `work` in a thread of its own and waits for it without the lock. Ctrl-C ends the wait with
/// `KeyboardInterrupt`, in whatever thread of Python the call was made; the work then runs on to its end, which
/// nobody waits for.
///
/// `threads` limits the threads that the work divides itself into; by default they are as many as the
/// machine has cores.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<NonZeroUsize>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let work = divided(threads, work)?;
    let interrupts = Interrupts::watch(py)?;
    let (told, hear) = channel();
    let thread = Builder::new()
        .name("errsep".to_owned())
        .stack_size(STACK)
        .spawn(move || told.send(work()))
        .map_err(|e| PyOSError::new_err(format!("no thread can be started: {e}")))?;
    let hear = std::sync::Mutex::new(hear);
    loop {
        let heard = without_the_lock(py, || match hear.lock() {
            Ok(hear) => hear.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match heard {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => interrupts.look(py)?,
            Err(RecvTimeoutError::Disconnected) => {
                let why = thread.join().err();
                let words = why.as_ref().and_then(|why| {
                    let owned = why.downcast_ref::<String>().map(String::as_str);
                    owned.or_else(|| why.downcast_ref::<&str>().copied())
                });
                return Err(PyRuntimeError::new_err(format!(
                    "errsep broke off, which is a fault of errsep: {}",
                    words.unwrap_or("it said no more")
                )));
            }
        }
    }
}

/// The process in which the threads that all calls share were started. A process forked from it has
/// not inherited them, and would wait for them for ever.
static STARTED_IN: OnceLock<u32> = OnceLock::new();

type Work<T> = Box<dyn FnOnce() -> T + Send>;

/// Threads that a core is given at most: more wait for each other and do nothing sooner, thousands hold up the machine.
const A_CORE: usize = 16;

/// The work, dividing itself into so many threads.
fn divided<T: Send + 'static>(
    threads: Option<NonZeroUsize>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<Work<T>> {
    let forked = *STARTED_IN.get_or_init(std::process::id) != std::process::id();
    let threads = match threads {
        None if !forked => return Ok(Box::new(work)),
        None => 0,
        Some(threads) => {
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            threads.get().min(A_CORE * cores)
        }
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .build()
        .map_err(|e| PyOSError::new_err(format!("no threads can be started: {e}")))?;
    Ok(Box::new(move || pool.install(work)))
}
