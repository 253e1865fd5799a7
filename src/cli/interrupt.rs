//! Ctrl-C, and a friendly `kill`.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::TERM_SIGNALS;
use signal_hook::flag;

use crate::problem::Stop;

/// What a signal to end does. Until there is something worth keeping it ends the program, as ever; from then on the first one
/// stops the work, which is reported and written as far as it is done, and the second ends the program.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    at_once: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
}

impl Interrupt {
    /// By the signals of this process. By default there are none.
    ///
    /// # Errors
    /// Where the system does not let them be handled.
    pub fn by_signals() -> io::Result<Self> {
        let interrupt = Interrupt { at_once: Arc::new(AtomicBool::new(true)), stop: Arc::default() };
        for &signal in TERM_SIGNALS {
            // in this order: the first signal that is heeded arms the second
            flag::register_conditional_default(signal, Arc::clone(&interrupt.at_once))?;
            flag::register(signal, Arc::clone(&interrupt.at_once))?;
            flag::register(signal, Arc::clone(&interrupt.stop))?;
        }
        Ok(interrupt)
    }

    /// What it stops once it is heeded.
    pub(super) fn stop(&self) -> Stop {
        Stop::from(Arc::clone(&self.stop))
    }

    /// From now on there is something worth keeping.
    pub(super) fn heed(&self) {
        if !self.stop().asked() {
            self.at_once.store(false, Ordering::Relaxed);
        }
    }
}
