//! A line on the terminal while a fit takes long.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A fit that takes no longer shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// Iterations and cost on standard error, where that is a terminal; nothing else can see it.
pub(super) struct Progress {
    begun: Instant,
    bar: RefCell<Option<ProgressBar>>,
}

impl Progress {
    pub(super) fn new() -> Self {
        Progress { begun: Instant::now(), bar: RefCell::new(None) }
    }

    /// Says that something long is being done, where it is long, until it is dropped.
    pub(super) fn working(long: bool, what: &'static str) -> Self {
        let progress = Progress::new();
        if long {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_message(what);
            bar.enable_steady_tick(Duration::from_millis(200));
            *progress.bar.borrow_mut() = Some(bar);
        }
        progress
    }

    /// Says how far it is.
    pub(super) fn tell(&self, iteration: usize, cost: f64) {
        if self.begun.elapsed() < PATIENCE {
            return;
        }
        let mut bar = self.bar.borrow_mut();
        let bar = bar.get_or_insert_with(|| {
            // drawn only where standard error is a terminal
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]");
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner())).with_elapsed(PATIENCE)
        });
        bar.set_message(format!("iteration {iteration}, cost {cost:.6e}"));
        bar.tick();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.borrow_mut().take() {
            bar.finish_and_clear();
        }
    }
}
