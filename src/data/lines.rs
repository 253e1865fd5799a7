//! Bytes of a file with all lines ended alike, so that lines can be counted.

use std::cell::Cell;
use std::io::{self, BufRead, Read, Write};
use std::rc::Rc;

use memchr::{memchr, memrchr};

/// Bytes of a line, and of a row that goes over several: what is longer is no table, and would fill the memory.
pub(super) const MOST_BYTES: usize = 16 << 20;

/// What is said of a line or row beyond that.
pub(super) fn too_long() -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("a row is longer than {} MiB", MOST_BYTES >> 20))
}

/// Reads bytes with `\r\n` and `\r` turned into `\n`, and one at the end where it lacks.
#[derive(Debug)]
pub(super) struct Lines<R> {
    from: R,
    /// whether the last byte taken was a `\r`, so that a `\n` now belongs to it
    after_return: bool,
    /// whether what was given out ends with a line's end
    ended: bool,
    /// bytes of the line so far
    length: usize,
    /// whether the last line lacked its end
    cut: Rc<Cell<bool>>,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(from: R) -> Self {
        Lines { from, after_return: false, ended: true, length: 0, cut: Rc::default() }
    }

    /// Says, once the last line is given out, whether it lacked its end.
    pub(super) fn cut(&self) -> Rc<Cell<bool>> {
        Rc::clone(&self.cut)
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let room = into.len();
        if room == 0 {
            return Ok(0);
        }
        loop {
            let have = self.from.fill_buf()?;
            if have.is_empty() {
                if self.ended {
                    return Ok(0);
                }
                self.ended = true;
                self.cut.set(true);
                return (&mut *into).write(b"\n");
            }
            let (mut from, mut to) = (have, &mut *into);
            while let Some((byte, rest)) = from.split_first()
                && !to.is_empty()
            {
                if std::mem::take(&mut self.after_return) && *byte == b'\n' {
                    from = rest;
                    continue;
                }
                let near = from.get(..to.len()).unwrap_or(from);
                let (plain, special) = near.split_at(memchr(b'\r', near).unwrap_or(near.len()));
                to.write_all(plain)?;
                from = from.split_at(plain.len()).1;
                if let (true, Some((_, rest))) = (!special.is_empty(), from.split_first()) {
                    to.write_all(b"\n")?;
                    self.after_return = true;
                    from = rest;
                }
            }
            let (given, taken) = (room - to.len(), have.len() - from.len());
            self.from.consume(taken);
            if let Some(read) = into.get(..given).filter(|read| !read.is_empty()) {
                self.ended = read.ends_with(b"\n");
                self.length = match memrchr(b'\n', read) {
                    Some(end) => given - end - 1,
                    None => self.length + given,
                };
                return if self.length > MOST_BYTES { Err(too_long()) } else { Ok(given) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufReader;

    #[test]
    fn lines_end_alike_whatever_the_buffers() {
        for (text, expected) in
            [("a\r\nb\rc\nd", "a\nb\nc\nd\n"), ("", ""), ("\r\n\r\n", "\n\n"), ("\r\r\n\n", "\n\n\n"), ("x\n", "x\n")]
        {
            for buffer in 1..6 {
                let mut out = String::new();
                Lines::new(BufReader::with_capacity(buffer, text.as_bytes())).read_to_string(&mut out).unwrap();
                assert_eq!(out, expected, "{text:?}");
            }
        }
    }
}
