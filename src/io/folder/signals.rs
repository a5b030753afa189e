//! Ctrl-C and a request to end wait while a folder is put in place.

/// While this lives, the signals SIGINT and SIGTERM wait; one that came ends the program when it is
/// dropped. At other times they end the program at once, as they do without it.
pub(super) struct Held {
    #[cfg(unix)]
    _inner: unix::Held,
}

impl Held {
    /// Holds the signals back; where the system refuses, they are not held.
    pub fn new() -> Self {
        Self {
            #[cfg(unix)]
            _inner: unix::Held::new(),
        }
    }
}

#[cfg(unix)]
mod unix {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;
    use signal_hook::low_level::emulate_default_handler;

    pub(super) struct Held {
        free: Arc<AtomicBool>,
        came: Arc<AtomicUsize>,
    }

    impl Held {
        pub(super) fn new() -> Self {
            let free = Arc::new(AtomicBool::new(false));
            let came = Arc::new(AtomicUsize::new(0));
            for signal in [SIGINT, SIGTERM] {
                let number = usize::try_from(signal).unwrap_or(0);
                // Without a handler the signal ends the program at once: the folder is still whole.
                let _ = flag::register_conditional_default(signal, Arc::clone(&free))
                    .and_then(|_| flag::register_usize(signal, Arc::clone(&came), number));
            }
            Self { free, came }
        }
    }

    impl Drop for Held {
        fn drop(&mut self) {
            self.free.store(true, Ordering::SeqCst);
            let came = self.came.load(Ordering::SeqCst);
            if let Ok(signal @ 1..) = i32::try_from(came) {
                let _ = emulate_default_handler(signal);
            }
        }
    }
}
