//! Numbers that begin where a line of the cache does.

/// A buffer of numbers, aligned to 64 bytes, so that no vector lies across two lines.
#[derive(Debug, Default)]
pub struct Aligned {
    storage: Vec<f64>,
    first: usize,
    len: usize,
}

const ALIGNMENT: usize = 64;

impl Aligned {
    /// So many zeros.
    pub fn zeros(len: usize) -> Self {
        let storage = vec![0.0; len + ALIGNMENT / size_of::<f64>()];
        // the compiler may say that it does not know, and then nothing is lost but time
        let first = storage.as_ptr().align_offset(ALIGNMENT).min(storage.len() - len);
        Aligned { storage, first, len }
    }

    /// The numbers.
    pub fn as_slice(&self) -> &[f64] {
        &self.storage[self.first..self.first + self.len]
    }

    /// The numbers.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.storage[self.first..self.first + self.len]
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut copy = Aligned::zeros(self.len);
        copy.as_mut_slice().copy_from_slice(self.as_slice());
        copy
    }
}
