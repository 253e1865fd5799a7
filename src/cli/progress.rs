//! A line on the terminal while a fit takes long.

use std::cell::RefCell;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::data::Watch;

/// A fit that takes no longer shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// Whether nothing is drawn at all; of the whole process, as standard error is.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Draws nothing from now on, or whatever there is to draw.
pub(super) fn be_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

/// Standard error, which shows something only where it is a terminal.
fn drawn() -> ProgressDrawTarget {
    if QUIET.load(Ordering::Relaxed) { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

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
            let bar = ProgressBar::with_draw_target(None, drawn()).with_message(what);
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
            let bar = ProgressBar::with_draw_target(None, drawn());
            let style = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]");
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner())).with_elapsed(PATIENCE)
        });
        bar.set_message(format!("iteration {iteration}, cost {cost:.6e}"));
        bar.tick();
    }
}

/// How many of a known number of runs are done, and how long the others will take; told from any thread.
pub(super) struct Counted {
    begun: Instant,
    shown: AtomicBool,
    bar: ProgressBar,
}

impl Counted {
    pub(super) fn new(all: u64, what: &'static str) -> Self {
        let bar = ProgressBar::with_draw_target(Some(all), ProgressDrawTarget::hidden()).with_message(what);
        let style = ProgressStyle::with_template("{msg} {pos} of {len} [{elapsed}, {eta} left]");
        let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Counted { begun: Instant::now(), shown: AtomicBool::new(false), bar }
    }

    pub(super) fn tell(&self) {
        if self.begun.elapsed() >= PATIENCE && !self.shown.swap(true, Ordering::Relaxed) {
            self.bar.set_draw_target(drawn());
        }
        self.bar.inc(1);
    }
}

/// Shows how much of a file has been read, and how long the rest will take.
pub(super) fn reading() -> Watch {
    watch("reading", "bytes")
}

/// Shows how many of something known are done, and how long the others will take, once it takes long; until all are done.
pub(super) fn watch(what: &'static str, units: &'static str) -> Watch {
    let shown: Mutex<Option<(Instant, ProgressBar)>> = Mutex::new(None);
    Watch::new(move |done, all| {
        // somebody else is telling
        let Ok(mut shown) = shown.try_lock() else { return };
        let (begun, bar) = shown.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(Some(all), ProgressDrawTarget::hidden()).with_message(what);
            let template = match units {
                "bytes" => "{msg} {bytes} of {total_bytes} [{elapsed}, {eta} left]",
                _ => "{msg} {human_pos} of {human_len} rows [{elapsed}, {eta} left]",
            };
            let style = ProgressStyle::with_template(template);
            (Instant::now(), bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())))
        });
        if bar.is_hidden() && begun.elapsed() >= PATIENCE {
            bar.set_draw_target(drawn());
        }
        bar.set_length(all);
        bar.set_position(done);
        if done >= all {
            bar.finish_and_clear();
            *shown = None;
        }
    })
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.borrow_mut().take() {
            bar.finish_and_clear();
        }
    }
}
