//! With which instructions, and by how many threads.

use std::sync::Arc;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::simd::InstructionSet;

/// Pieces of which the results are kept before they are put together.
const AT_A_TIME: usize = 64;

/// How rows are evaluated. The results of one instruction set are the same bits for any number of threads.
#[derive(Clone, Debug)]
pub struct Execution {
    set: InstructionSet,
    threads: Threads,
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
        Execution { set, threads }
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
