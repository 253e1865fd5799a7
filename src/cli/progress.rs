//! A line on the terminal while something takes long.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::data::{Stage, Watch};

/// What takes no longer shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// A fall of the cost below this share of it ends a search.
const ENDS: f64 = 1e-12;

/// Whether nothing is drawn at all; of the whole process, as standard error is.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Draws nothing from now on, or whatever there is to draw.
pub(super) fn be_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

/// Shows what is being done on standard error, where that is a terminal; nothing else can see it. The line is gone with the
/// last that tells it.
pub(super) fn shown() -> Watch {
    let line = Mutex::new(Line { begun: Instant::now(), bar: None, search: Search::default() });
    Watch::new(move |stage| {
        // somebody else is telling
        if let Ok(mut line) = line.try_lock() {
            line.tell(stage);
        }
    })
}

struct Line {
    begun: Instant,
    /// of what is being done, and what that is
    bar: Option<(&'static str, ProgressBar)>,
    search: Search,
}

impl Line {
    fn tell(&mut self, stage: Stage) {
        match stage {
            Stage::Bytes { read, all } => self.count(("read", "{bytes} of {total_bytes}"), read, all),
            Stage::Of { what, done, all } => self.count((what, "{human_pos} of {human_len}"), done, all),
            Stage::Search { linearised, cost } => {
                self.search.note(linearised, cost);
                let said = self.search.said();
                let bar = self.bar("", "{spinner} {msg}", None);
                bar.set_message(said);
                bar.tick();
            }
        }
    }

    /// So many of all are done; the line goes when all are.
    fn count(&mut self, (what, counted): (&'static str, &str), done: u64, all: u64) {
        let template = format!("{counted} {what} [{{elapsed}}, {{eta}} left]");
        let bar = self.bar(what, &template, Some(all));
        bar.set_length(all);
        bar.set_position(done);
        if done >= all {
            self.clear();
        }
    }

    /// The bar of what is being done, seen from when patience is at an end.
    fn bar(&mut self, what: &'static str, template: &str, all: Option<u64>) -> &ProgressBar {
        if self.bar.as_ref().is_some_and(|(of, _)| *of != what) {
            self.clear();
        }
        let (_, bar) = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
            (what, ProgressBar::with_draw_target(all, ProgressDrawTarget::hidden()).with_style(style))
        });
        if bar.is_hidden() && self.begun.elapsed() >= PATIENCE && !QUIET.load(Ordering::Relaxed) {
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        bar
    }

    fn clear(&mut self) {
        if let Some((_, bar)) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.clear();
    }
}

/// What is seen of a search from outside.
#[derive(Default)]
struct Search {
    begun: Option<Instant>,
    linearised: u64,
    /// of the last three points that were better than all before
    costs: Vec<f64>,
}

impl Search {
    fn note(&mut self, linearised: u64, cost: f64) {
        if linearised <= self.linearised || self.begun.is_none() {
            *self = Search { begun: Some(Instant::now()), ..Search::default() };
        }
        self.linearised = linearised;
        if cost.is_finite() && self.costs.last().is_none_or(|last| cost < *last) {
            self.costs.push(cost);
            if self.costs.len() > 3 {
                self.costs.remove(0);
            }
        }
    }

    fn said(&self) -> String {
        let elapsed = self.begun.map(|begun| begun.elapsed()).unwrap_or_default();
        let mut said = format!("iteration {}", self.linearised);
        if let Some(cost) = self.costs.last() {
            said += &format!(", cost {cost:.6e}");
        }
        said += &format!(" [{:#}", HumanDuration(elapsed));
        if let Some(more) = linearisations_left(&self.costs) {
            let left = elapsed.as_secs_f64() / self.linearised.max(1) as f64 * more;
            said += &format!(", about {:#} left", HumanDuration(Duration::try_from_secs_f64(left).unwrap_or_default()));
        }
        said + "]"
    }
}

/// As far as the last three costs tell, where each fall is the same share of the one before: until one is as small as ends
/// a search. Quadratic convergence is faster than that.
fn linearisations_left(costs: &[f64]) -> Option<f64> {
    let &[first, second, third] = costs else { return None };
    let (before, fall) = (first - second, second - third);
    let share = fall / before;
    let left = (ENDS * third.abs() / fall).ln() / share.ln();
    (fall > 0.0 && share < 1.0 && left.is_finite()).then(|| left.max(0.0).ceil())
}

#[cfg(test)]
mod tests {
    use super::{Search, linearisations_left};

    #[test]
    fn falls_by_the_same_share_are_counted_to_their_end() {
        // the cost 1 + 10⁻ᵏ falls by 0.9·10⁻ᵏ: by less than 10⁻¹² from k = 12 on
        for k in 2..12 {
            let cost = |k: i32| 1.0 + 10.0_f64.powi(-k);
            let left = linearisations_left(&[cost(k - 2), cost(k - 1), cost(k)]).expect("an estimate");
            assert!((left - f64::from(12 - k)).abs() <= 1.0, "{left} after {k}");
        }
        assert_eq!(linearisations_left(&[3.0, 2.0]), None);
        // falls that grow tell nothing
        assert_eq!(linearisations_left(&[3.0, 2.9, 2.0]), None);
        assert_eq!(linearisations_left(&[3.0, 2.0, 2.0]), None);
    }

    #[test]
    fn a_search_that_begins_again_is_told_anew() {
        let mut search = Search::default();
        search.note(1, f64::NAN);
        assert!(search.said().starts_with("iteration 1 ["), "{}", search.said());
        for (k, cost) in [(2, 9.0), (3, 5.0), (4, 7.0), (5, 4.0)] {
            search.note(k, cost);
        }
        assert_eq!(search.costs, [9.0, 5.0, 4.0]);
        assert!(search.said().starts_with("iteration 5, cost 4.000000e0 [0s, about 0s left"), "{}", search.said());
        search.note(1, 3.0);
        assert_eq!((search.linearised, &search.costs[..]), (1, &[3.0][..]));
    }
}
