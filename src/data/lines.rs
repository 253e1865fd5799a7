//! Bytes of a file with all lines ended alike, so that lines can be counted.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use memchr::memchr;

/// Reads bytes with `\r\n` and `\r` turned into `\n`, and one at the end where it lacks.
#[derive(Debug)]
pub(super) struct Lines<R> {
    from: R,
    /// whether the last byte taken was a `\r`, so that a `\n` now belongs to it
    after_return: bool,
    /// whether what was given out ends with a line's end
    ended: bool,
    /// whether the last line lacked its end
    cut: Rc<Cell<bool>>,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(from: R) -> Self {
        Lines { from, after_return: false, ended: true, cut: Rc::default() }
    }

    /// Says, once the last line is given out, whether it lacked its end.
    pub(super) fn cut(&self) -> Rc<Cell<bool>> {
        Rc::clone(&self.cut)
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if into.is_empty() {
            return Ok(0);
        }
        let mut given = 0;
        loop {
            let have = self.from.fill_buf()?;
            if have.is_empty() {
                if self.ended {
                    return Ok(0);
                }
                self.ended = true;
                self.cut.set(true);
                into[0] = b'\n';
                return Ok(1);
            }
            let mut taken = 0;
            while taken < have.len() && given < into.len() {
                if std::mem::take(&mut self.after_return) && have[taken] == b'\n' {
                    taken += 1;
                    continue;
                }
                let most = (have.len() - taken).min(into.len() - given);
                let plain = memchr(b'\r', &have[taken..taken + most]).unwrap_or(most);
                into[given..given + plain].copy_from_slice(&have[taken..taken + plain]);
                (taken, given) = (taken + plain, given + plain);
                if plain < most {
                    into[given] = b'\n';
                    self.after_return = true;
                    (taken, given) = (taken + 1, given + 1);
                }
            }
            self.from.consume(taken);
            if given > 0 {
                self.ended = into[given - 1] == b'\n';
                return Ok(given);
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
