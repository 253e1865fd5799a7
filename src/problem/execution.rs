//! With which instructions, by how many threads, until when, and who is told.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::data::{Stage, Watch};
use crate::simd::InstructionSet;

/// Pieces of which the results are kept before they are put together.
const AT_A_TIME: usize = 64;

/// A wish to stop, shared by whoever may have it and all that heed it: searches end where they are at their next iteration.
///
/// ```
/// use phical::problem::{Execution, Options, Stop};
/// let stop = Stop::default();
/// let options = Options { execution: Execution::default().until(&stop), ..Options::default() };
/// stop.now(); // from any thread
/// assert!(options.execution.stopped());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Stops all that heeds it.
    pub fn now(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it is time.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl From<Arc<AtomicBool>> for Stop {
    /// A flag that somebody else sets.
    fn from(flag: Arc<AtomicBool>) -> Self {
        Stop(flag)
    }
}

/// How rows are evaluated. The results of one instruction set are the same bits for any number of threads.
#[derive(Clone, Debug)]
pub struct Execution {
    set: InstructionSet,
    threads: Threads,
    stop: Stop,
    watch: Watch,
}

#[derive(Clone, Debug)]
enum Threads {
    /// the caller's
    One,
    /// those that the whole process shares
    Shared,
    Own(Arc<ThreadPool>),
}

impl Default for Execution {
    /// The widest vectors of the machine, on all its cores.
    fn default() -> Self {
        Self::new(InstructionSet::detect(), 0)
    }
}

impl Execution {
    /// Zero threads are as many as the machine has cores. Where threads cannot be made, the caller's own does the work.
    pub fn new(set: InstructionSet, threads: usize) -> Self {
        let own = |threads| ThreadPoolBuilder::new().num_threads(threads).build().map(Arc::new);
        let threads = match threads {
            0 => Threads::Shared,
            1 => Threads::One,
            many => own(many).map_or(Threads::One, Threads::Own),
        };
        Execution { set, threads, stop: Stop::default(), watch: Watch::default() }
    }

    /// The same until it is stopped.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Execution { stop: stop.clone(), ..self }
    }

    /// The same, while somebody is told what it is at.
    #[must_use]
    pub fn told_to(self, watch: &Watch) -> Self {
        Execution { watch: watch.clone(), ..self }
    }

    /// The same while nobody is told, for a part of something that tells of its parts.
    #[must_use]
    pub fn silent(&self) -> Self {
        Execution { watch: Watch::default(), ..self.clone() }
    }

    /// The same by the caller's thread alone and in silence, for work of which there is much beside it.
    #[must_use]
    pub fn alone(&self) -> Self {
        Execution { threads: Threads::One, ..self.silent() }
    }

    /// Tells where it is.
    pub fn tell(&self, stage: Stage) {
        self.watch.tell(stage);
    }

    /// Whether it is time to stop.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.stop.asked()
    }

    /// The instruction set.
    pub fn instructions(&self) -> InstructionSet {
        self.set
    }

    /// What `work` makes of every item, in their order; several at a time.
    pub fn each<I: Sync, R: Send>(&self, items: &[I], work: impl Fn(&I) -> R + Sync) -> Vec<R> {
        match &self.threads {
            Threads::One => items.iter().map(&work).collect(),
            Threads::Shared => items.par_iter().map(&work).collect(),
            Threads::Own(pool) => pool.install(|| items.par_iter().map(&work).collect()),
        }
    }

    /// The same, telling how many of `what`, in plural, are done.
    pub fn each_of<I: Sync, R: Send>(&self, what: &'static str, items: &[I], work: impl Fn(&I) -> R + Sync) -> Vec<R> {
        let done = AtomicU64::new(0);
        self.each(items, |item| {
            let result = work(item);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            self.tell(Stage::Of { what, done, all: items.len() as u64 });
            result
        })
    }

    /// Does `work` for every item, several at a time, and `fold`s the results in the order of the items; the first error in
    /// that order ends it.
    pub(super) fn fold<I: Sync, R: Send, E: Send>(
        &self,
        items: &[I],
        work: impl Fn(&I) -> Result<R, E> + Sync,
        mut fold: impl FnMut(R) -> Result<(), E>,
    ) -> Result<(), E> {
        let together = |some: &[I]| -> Vec<Result<R, E>> { some.par_iter().map(&work).collect() };
        for some in items.chunks(AT_A_TIME) {
            let results = match &self.threads {
                _ if some.len() == 1 => vec![work(&some[0])],
                Threads::One => {
                    some.iter().try_for_each(|item| fold(work(item)?))?;
                    continue;
                }
                Threads::Shared => together(some),
                Threads::Own(pool) => pool.install(|| together(some)),
            };
            results.into_iter().try_for_each(|result| fold(result?))?;
        }
        Ok(())
    }
}
