//! Bytes of a file, read ahead and fingerprinted by a thread of their own while those before them are understood.

use std::io::{self, BufRead, Read};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::Duration;

use sha2::{Digest, Sha256};

/// Bytes that are read at once, and how often the thread may do so before anything is asked for.
const PIECE: usize = 1 << 18;
const AHEAD: usize = 2;

/// How long nobody looks whether it is time to stop.
const PATIENCE: Duration = Duration::from_millis(50);

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn fingerprint(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new_with_prefix(bytes))
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads what another reader gives, and takes the fingerprint of it.
pub(super) struct Ahead<'a> {
    /// pieces; the last one is empty and has the fingerprint of all
    from: Receiver<io::Result<(Vec<u8>, Option<String>)>>,
    /// pieces to be filled again
    back: Sender<Vec<u8>>,
    piece: Vec<u8>,
    at: usize,
    fingerprint: Option<String>,
    stop: Option<&'a dyn Fn() -> bool>,
}

impl<'a> Ahead<'a> {
    pub(super) fn new(input: impl Read + Send + 'static) -> io::Result<Self> {
        let (full, from) = sync_channel(AHEAD);
        let (back, empty) = channel();
        // nobody waits for it: it may hang on a terminal where nothing more is typed, and ends when nothing is wanted
        thread::Builder::new().name("reader".to_owned()).spawn(move || read(input, &full, &empty))?;
        Ok(Ahead { from, back, piece: Vec::new(), at: 0, fingerprint: None, stop: None })
    }

    /// The same with an end where `stop` says so.
    pub(super) fn until(self, stop: &'a dyn Fn() -> bool) -> Self {
        Ahead { stop: Some(stop), ..self }
    }

    /// Of all bytes, once the end is reached.
    pub(super) fn fingerprint(self) -> Option<String> {
        self.fingerprint
    }
}

/// Fills pieces until there is nothing more, or nobody takes them.
fn read(mut input: impl Read, full: &SyncSender<io::Result<(Vec<u8>, Option<String>)>>, empty: &Receiver<Vec<u8>>) {
    let mut hash = Sha256::new();
    loop {
        let mut piece = empty.try_recv().unwrap_or_default();
        piece.resize(PIECE, 0);
        let next = match input.read(&mut piece) {
            Ok(read) => {
                piece.truncate(read);
                hash.update(&piece);
                let end = piece.is_empty().then(|| hexadecimal(std::mem::take(&mut hash)));
                Ok((piece, end))
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => Err(error),
        };
        let last = !matches!(next, Ok((_, None)));
        if full.send(next).is_err() || last {
            return;
        }
    }
}

impl BufRead for Ahead<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.at == self.piece.len() && self.fingerprint.is_none() {
            // a reader that has gone took nothing with it but a buffer
            let _ = self.back.send(std::mem::take(&mut self.piece));
            self.at = 0;
            let next = loop {
                match self.from.recv_timeout(PATIENCE) {
                    Ok(next) => break next,
                    Err(RecvTimeoutError::Timeout) if !self.stop.is_some_and(|stop| stop()) => {}
                    Err(RecvTimeoutError::Timeout) => return Ok(&[]),
                    Err(RecvTimeoutError::Disconnected) => return Err(io::Error::other("reading has stopped")),
                }
            };
            (self.piece, self.fingerprint) = next?;
        }
        Ok(self.piece.get(self.at..).unwrap_or_default())
    }

    fn consume(&mut self, bytes: usize) {
        self.at += bytes;
    }
}

impl Read for Ahead<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(into)?;
        self.consume(read);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_and_the_fingerprint_that_everyone_knows() {
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(fingerprint(b"abc"), abc);
        let mut ahead = Ahead::new(&b"abc"[..]).unwrap();
        assert_eq!(io::read_to_string(&mut ahead).unwrap(), "abc");
        assert_eq!(ahead.fingerprint().as_deref(), Some(abc));
    }

    #[test]
    fn many_pieces_are_one_text() {
        let text: Vec<u8> = (0..PIECE * 9 / 2).map(|i| (i % 251) as u8).collect();
        let mut ahead = Ahead::new(io::Cursor::new(text.clone())).unwrap();
        let mut read = Vec::new();
        ahead.read_to_end(&mut read).unwrap();
        assert!(read == text);
        assert_eq!(ahead.fingerprint().unwrap(), fingerprint(&text));
    }

    #[test]
    fn errors_come_through_and_unread_bytes_stop_nobody() {
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("broken"))
            }
        }
        let mut ahead = Ahead::new(b"abc".chain(Broken)).unwrap();
        assert_eq!(io::read_to_string(&mut ahead).unwrap_err().to_string(), "broken");
        assert!(ahead.fill_buf().is_err());
        assert_eq!(ahead.fingerprint(), None);
        let mut ahead = Ahead::new(io::repeat(b'x')).unwrap();
        assert_eq!(ahead.fill_buf().unwrap()[0], b'x');
    }
}
