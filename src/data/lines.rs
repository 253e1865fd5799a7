//! Bytes of a file with all lines ended alike, so that lines can be counted.

use std::io::{self, BufRead, Read};

/// Reads bytes with `\r\n` and `\r` turned into `\n`, and one at the end where it lacks.
#[derive(Debug)]
pub(super) struct Lines<R> {
    from: R,
    /// whether the last byte taken was a `\r`, so that a `\n` now belongs to it
    after_return: bool,
    /// whether what was given out ends with a line's end
    ended: bool,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(from: R) -> Self {
        Lines { from, after_return: false, ended: true }
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if into.is_empty() {
            return Ok(0);
        }
        loop {
            let have = self.from.fill_buf()?;
            if have.is_empty() {
                if self.ended {
                    return Ok(0);
                }
                self.ended = true;
                into[0] = b'\n';
                return Ok(1);
            }
            if std::mem::take(&mut self.after_return) && have[0] == b'\n' {
                self.from.consume(1);
                continue;
            }
            let most = have.len().min(into.len());
            let (taken, given) = match have[..most].iter().position(|&byte| byte == b'\r') {
                None => {
                    into[..most].copy_from_slice(&have[..most]);
                    (most, most)
                }
                Some(at) => {
                    into[..at].copy_from_slice(&have[..at]);
                    into[at] = b'\n';
                    self.after_return = true;
                    (at + 1, at + 1)
                }
            };
            self.ended = into[given - 1] == b'\n';
            self.from.consume(taken);
            return Ok(given);
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
