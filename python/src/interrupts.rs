//! Ctrl-C, in whatever thread a call waits for it.
//!
//! Python tells only its main thread of a signal. For calls from other threads the signal is counted where it
//! arrives, in a handler that goes on to Python's own.

use std::sync::atomic::{AtomicUsize, Ordering};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// How often Ctrl-C was pressed since the first call from another thread than the main one.
static PRESSED: AtomicUsize = AtomicUsize::new(0);

/// What ends a call: Ctrl-C, as long as Python's answer to it is `KeyboardInterrupt`.
pub struct Interrupts {
    is_main: bool,
    seen: AtomicUsize,
}

impl Interrupts {
    /// Watches for Ctrl-C from now on.
    pub fn watch(py: Python<'_>) -> PyResult<Self> {
        let threading = py.import("threading")?;
        let own = threading.call_method0("get_ident")?;
        let main = threading.call_method0("main_thread")?.getattr("ident")?;
        let is_main = own.eq(main)?;
        if !is_main {
            handler::put_in_front();
        }
        Ok(Self {
            is_main,
            seen: AtomicUsize::new(PRESSED.load(Ordering::Relaxed)),
        })
    }

    /// Looks for Ctrl-C. Signals of all kinds are handled here in the main thread.
    ///
    /// # Errors
    /// `KeyboardInterrupt`, or what a handler of the program raises.
    pub fn look(&self, py: Python<'_>) -> PyResult<()> {
        if self.is_main {
            return py.check_signals();
        }
        // A handler that Python has put there since would not count.
        handler::put_in_front();
        let pressed = PRESSED.load(Ordering::Relaxed);
        if self.seen.swap(pressed, Ordering::Relaxed) != pressed && raises(py)? {
            return Err(PyKeyboardInterrupt::new_err(()));
        }
        Ok(())
    }
}

/// Whether Python answers Ctrl-C with `KeyboardInterrupt`, by itself or for asyncio's tasks. A program with a
/// handler of its own sees to its calls itself.
fn raises(py: Python<'_>) -> PyResult<bool> {
    let signal = py.import("signal")?;
    let handler = signal.call_method1("getsignal", (signal.getattr("SIGINT")?,))?;
    if handler.is(&signal.getattr("default_int_handler")?) {
        return Ok(true);
    }
    let function = handler.getattr("func").unwrap_or(handler);
    let module = function
        .getattr("__module__")
        .and_then(|m| m.extract::<String>());
    Ok(module.is_ok_and(|module| module == "asyncio.runners"))
}

#[cfg(unix)]
mod handler {
    use std::mem::{MaybeUninit, transmute};
    use std::ptr::{null, null_mut};
    use std::sync::atomic::{AtomicUsize, Ordering};

    use libc::{SA_SIGINFO, SIG_DFL, SIG_IGN, SIGINT, c_int, sigaction};

    use super::PRESSED;

    /// The handler that was there.
    static BEFORE: AtomicUsize = AtomicUsize::new(SIG_DFL);

    extern "C" fn count(signal: c_int) {
        PRESSED.fetch_add(1, Ordering::Relaxed);
        let before = BEFORE.load(Ordering::Relaxed);
        if before != SIG_DFL && before != SIG_IGN {
            // SAFETY: `put_in_front` keeps only the addresses of handlers that take the signal alone.
            let before: extern "C" fn(c_int) = unsafe { transmute(before) };
            before(signal);
        }
    }

    /// Counts each Ctrl-C before the handler that is there; where there is none, nothing is changed. Python
    /// changes its own only with its lock held, as this is called.
    pub fn put_in_front() {
        let own = count as extern "C" fn(c_int) as usize;
        let mut now = MaybeUninit::<sigaction>::uninit();
        // SAFETY: the system fills `now` and takes nothing.
        if unsafe { sigaction(SIGINT, null(), now.as_mut_ptr()) } != 0 {
            return;
        }
        // SAFETY: it was filled.
        let mut now = unsafe { now.assume_init() };
        let there = now.sa_sigaction;
        let is_other = now.sa_flags & SA_SIGINFO != 0;
        if there == own || there == SIG_DFL || there == SIG_IGN || is_other {
            return;
        }
        BEFORE.store(there, Ordering::Relaxed);
        now.sa_sigaction = own;
        // SAFETY: `count` only adds to a number and goes on to the handler that was there, with its flags.
        unsafe { sigaction(SIGINT, &raw const now, null_mut()) };
    }
}

#[cfg(not(unix))]
mod handler {
    /// Only the main thread is told of Ctrl-C.
    pub fn put_in_front() {}
}
