//! From lines to the cells of rows.
//!
//! Lines without a quote are split where the separators stand, which costs little more than to look at the bytes. From the first
//! quote on, the rest of the file is left to the reader that knows what quotes mean. Both skip empty lines and comments.

use std::io::{self, Cursor, Read};

use csv::{ByteRecord, Reader, ReaderBuilder};
use memchr::{memchr, memchr_iter, memchr3_iter};

use super::lines::{MOST_BYTES, too_long};

const BUFFER: usize = 1 << 16;

/// The cells of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record<'a> {
    /// all cells, one after the other
    pub(super) text: &'a [u8],
    /// where each ends
    ends: &'a [usize],
    /// bytes between one and the next
    gap: usize,
}

impl<'a> Record<'a> {
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Where a cell is in the text; at its begin, with nothing in it, where there is none.
    pub(super) fn range(&self, cell: usize) -> std::ops::Range<usize> {
        let before = cell.checked_sub(1).and_then(|before| self.ends.get(before));
        let start = before.map_or(0, |end| end + self.gap);
        self.ends.get(cell).map_or(0..0, |&end| start..end)
    }

    pub(super) fn cell(&self, cell: usize) -> &'a [u8] {
        self.text.get(self.range(cell)).unwrap_or_default()
    }

    pub(super) fn cells(self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.len()).map(move |cell| self.cell(cell))
    }
}

/// Reads records from lines that all end with `\n`.
pub(super) struct Records<R: Read> {
    from: Source<R>,
    delimiter: u8,
    /// lines that are over
    lines: usize,
    /// the line on which the record begins, counted from one
    line: usize,
    ends: Vec<usize>,
}

enum Source<R: Read> {
    /// what has been read, where the record stands in it, where the next line begins
    Plain {
        buffer: Vec<u8>,
        record: std::ops::Range<usize>,
        next: usize,
        rest: R,
    },
    Quoted {
        reader: Box<Reader<Rest<R>>>,
        record: ByteRecord,
    },
    /// between the two
    Nothing,
}

impl<R: Read> Records<R> {
    /// `head` is what has been read of the lines already.
    pub(super) fn new(head: Vec<u8>, rest: R, delimiter: u8) -> Self {
        let from = Source::Plain { buffer: head, record: 0..0, next: 0, rest };
        Records { from, delimiter, lines: 0, line: 0, ends: Vec::new() }
    }

    /// Goes to the next record, where there is one.
    pub(super) fn advance(&mut self) -> io::Result<bool> {
        match self.plain()? {
            Some(found) => Ok(found),
            None => self.quoted(),
        }
    }

    /// The record that was gone to.
    pub(super) fn record(&self) -> Record<'_> {
        let (text, gap) = match &self.from {
            Source::Plain { buffer, record, .. } => (buffer.get(record.clone()).unwrap_or_default(), 1),
            Source::Quoted { record, .. } => (record.as_slice(), 0),
            Source::Nothing => (&[][..], 0),
        };
        Record { text, ends: &self.ends, gap }
    }

    /// The line on which it begins, counted from one.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// `None` where a quote stands in the way.
    fn plain(&mut self) -> io::Result<Option<bool>> {
        let Source::Plain { buffer, record, next, rest } = &mut self.from else { return Ok(None) };
        loop {
            self.ends.clear();
            let (_, ahead) = buffer.split_at_checked(*next).unwrap_or_default();
            let mut end = None;
            if ahead.starts_with(b"#") {
                end = memchr(b'\n', ahead);
            } else {
                for at in memchr3_iter(self.delimiter, b'\n', b'"', ahead) {
                    match ahead.get(at) {
                        Some(b'\n') => {
                            end = Some(at);
                            break;
                        }
                        Some(b'"') => return Ok(None),
                        _ => self.ends.push(at),
                    }
                }
            }
            let Some(end) = end else {
                buffer.drain(..*next);
                *next = 0;
                let have = buffer.len();
                buffer.resize((2 * have).max(BUFFER), 0);
                let (_, room) = buffer.split_at_mut(have);
                let read = read_some(rest, room);
                buffer.truncate(have + *read.as_ref().unwrap_or(&0));
                match read? {
                    0 => return Ok(Some(false)),
                    _ => continue,
                }
            };
            let comment = ahead.starts_with(b"#");
            let start = *next;
            *next += end + 1;
            self.lines += 1;
            if end > 0 && !comment {
                self.line = self.lines;
                self.ends.push(end);
                *record = start..start + end;
                return Ok(Some(true));
            }
        }
    }

    fn quoted(&mut self) -> io::Result<bool> {
        if let Source::Plain { .. } = self.from
            && let Source::Plain { mut buffer, next, rest, .. } = std::mem::replace(&mut self.from, Source::Nothing)
        {
            buffer.drain(..next);
            let reader = ReaderBuilder::new()
                .has_headers(false)
                .flexible(true)
                .comment(Some(b'#'))
                .delimiter(self.delimiter)
                .buffer_capacity(BUFFER)
                .from_reader(Limited { from: Cursor::new(buffer).chain(rest), left: MOST_BYTES });
            self.from = Source::Quoted { reader: Box::new(reader), record: ByteRecord::new() };
        }
        let Source::Quoted { reader, record } = &mut self.from else { return Ok(false) };
        // a quote that is never closed makes one row of all that follows
        reader.get_mut().left = MOST_BYTES;
        if !reader.read_byte_record(record)? {
            return Ok(false);
        }
        self.ends.clear();
        self.ends.extend((0..record.len()).filter_map(|cell| record.range(cell)).map(|range| range.end));
        self.line = self.lines + first_line(record, reader.position().line());
        Ok(true)
    }
}

/// What is left to be read once a quote was seen.
type Rest<R> = Limited<io::Chain<Cursor<Vec<u8>>, R>>;

/// Gives so many bytes at most before it is asked for another row.
struct Limited<R> {
    from: R,
    left: usize,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(into)?;
        self.left = self.left.checked_sub(read).ok_or_else(too_long)?;
        Ok(read)
    }
}

fn read_some(from: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
    loop {
        match from.read(into) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}

/// The line on which a record begins, where the reader is at line `after`. All lines end with `\n` here.
fn first_line(record: &ByteRecord, after: u64) -> usize {
    let text = record.as_slice();
    let inside = memchr_iter(b'\n', text).count();
    // a quote that is never closed has swallowed its own line's end too
    let own = usize::from(text.last() != Some(&b'\n'));
    usize::try_from(after).unwrap_or(usize::MAX).saturating_sub(inside + own).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Found = Vec<(usize, Vec<Vec<u8>>)>;

    fn ours(head: &str, rest: impl Read) -> Found {
        let mut records = Records::new(head.into(), rest, b',');
        let mut found = Vec::new();
        while records.advance().unwrap() {
            found.push((records.line(), records.record().cells().map(<[u8]>::to_vec).collect()));
        }
        found
    }

    fn by_the_reader(text: &str) -> Found {
        let mut reader =
            ReaderBuilder::new().has_headers(false).flexible(true).comment(Some(b'#')).from_reader(text.as_bytes());
        let (mut record, mut found) = (ByteRecord::new(), Vec::new());
        while reader.read_byte_record(&mut record).unwrap() {
            let line = first_line(&record, reader.position().line());
            found.push((line, record.iter().map(<[u8]>::to_vec).collect()));
        }
        found
    }

    /// Gives no more than a few bytes at once.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let most = into.len().min(self.1);
            self.0.read(&mut into[..most])
        }
    }

    proptest! {
        #[test]
        fn records_are_those_of_the_reader(
            lines in proptest::collection::vec("[a1# ,;é]{0,8}|#.{0,4}|(\"[a,\n\"]{0,4}\",?){1,2}|a\"b,\"|1,2,3", 0..12),
            head in 0..12_usize,
            step in 1..9_usize,
        ) {
            let text: String = lines.iter().map(|line| line.replace('\r', "") + "\n").collect();
            let head = lines.iter().take(head).map(|line| line.replace('\r', "").len() + 1).sum();
            let found = ours(&text[..head], Slow(&text.as_bytes()[head..], step));
            prop_assert_eq!(found, by_the_reader(&text), "{:?}", text);
        }
    }

    #[test]
    fn lines_may_be_longer_than_the_buffer() {
        let cell = "x".repeat(BUFFER + 7);
        let text = format!("a,{cell}\n\n# {cell}\n{cell},{cell},\nb\n");
        let found = ours("", text.as_bytes());
        assert!(found == by_the_reader(&text));
        assert_eq!(
            found.iter().map(|(line, cells)| (*line, cells.len())).collect::<Vec<_>>(),
            [(1, 2), (4, 3), (5, 1)]
        );
    }
}
