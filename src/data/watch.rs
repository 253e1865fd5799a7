//! How far something long has come.

use std::fmt;
use std::io::{self, Read};
use std::sync::Arc;

/// Who is told how far something long has come, from any thread; nobody by default.
///
/// ```
/// use std::sync::atomic::{AtomicU64, Ordering};
/// use std::sync::Arc;
/// let told = Arc::new(AtomicU64::new(0));
/// let here = Arc::clone(&told);
/// let watch = phical::data::Watch::new(move |done, all| here.store(100 * done / all, Ordering::Relaxed));
/// watch.tell(3, 4);
/// assert_eq!(told.load(Ordering::Relaxed), 75);
/// ```
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<Told>>);

type Told = dyn Fn(u64, u64) + Send + Sync;

impl Watch {
    /// Calls a function with how much is done, and of how much.
    #[must_use]
    pub fn new(told: impl Fn(u64, u64) + Send + Sync + 'static) -> Watch {
        Watch(Some(Arc::new(told)))
    }

    /// Tells how much is done, and of how much.
    pub fn tell(&self, done: u64, all: u64) {
        if let Some(told) = &self.0 {
            told(done, all);
        }
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Watch(told)" } else { "Watch(nobody)" })
    }
}

/// A file that tells how far it has been read.
#[derive(Debug)]
pub(super) struct Watched<R> {
    pub(super) from: R,
    pub(super) read: u64,
    pub(super) length: u64,
    pub(super) watch: Watch,
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(into)?;
        self.read += read as u64;
        self.watch.tell(self.read, self.length.max(self.read));
        Ok(read)
    }
}
