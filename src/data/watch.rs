//! What something long is at, and how far it has come.

use std::fmt;
use std::io::{self, Read};
use std::sync::Arc;

/// What something long is at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// So many bytes of a file are read.
    Bytes {
        /// How many.
        read: u64,
        /// As long as the file is, as far as that is known.
        all: u64,
    },
    /// So many of several are done, which take about as long as each other.
    Of {
        /// What they are, in plural.
        what: &'static str,
        /// How many are done.
        done: u64,
        /// How many there are.
        all: u64,
    },
    /// A search for a minimum, which does not know how long it will be.
    Search {
        /// How often the residuals have been linearised.
        linearised: u64,
        /// The latest cost; not a number before the first.
        cost: f64,
    },
}

/// Who is told what something long is at, from any thread; nobody by default.
///
/// ```
/// use phical::data::{Stage, Watch};
/// use std::sync::{Arc, Mutex};
/// let told = Arc::new(Mutex::new(Vec::new()));
/// let here = Arc::clone(&told);
/// let watch = Watch::new(move |stage| here.lock().expect("nobody panics").push(stage));
/// watch.tell(Stage::Of { what: "folds", done: 3, all: 4 });
/// assert_eq!(told.lock().expect("nobody panics").len(), 1);
/// ```
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<Told>>);

type Told = dyn Fn(Stage) + Send + Sync;

impl Watch {
    /// Calls a function with every stage.
    #[must_use]
    pub fn new(told: impl Fn(Stage) + Send + Sync + 'static) -> Watch {
        Watch(Some(Arc::new(told)))
    }

    /// Tells where it is.
    pub fn tell(&self, stage: Stage) {
        if let Some(told) = &self.0 {
            told(stage);
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
        self.watch.tell(Stage::Bytes { read: self.read, all: self.length.max(self.read) });
        Ok(read)
    }
}
