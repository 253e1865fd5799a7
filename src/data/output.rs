//! Files that are there as a whole or not at all.
//!
//! What is to be `fit.json` is written beside it, as `.fit.json.phical-` and six letters, and then moved to its place. The file is
//! locked meanwhile, so that one without a lock is what a killed run has left: the next run with the same output removes it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::diag::{Code, DataPlace, Diagnostic};

/// Bytes of a file's name that are kept in that of the file beside it; names of 255 are the longest.
const MOST_OF_NAME: usize = 200;

/// A place to be written to. Whatever is there stays until all is [put](Written::put).
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    /// what is there and no plain file, such as a pipe, is written into
    into: Option<File>,
}

/// A file that is written, and not yet in its place.
#[derive(Debug)]
pub struct Written {
    path: PathBuf,
    beside: Option<NamedTempFile>,
}

/// A file that cannot be written, and why; without the system's own words on paths, which are not the user's.
fn cannot(path: &Path, error: &io::Error) -> Box<Diagnostic> {
    let name = path.display().to_string();
    let why = match error.kind() {
        io::ErrorKind::Other | io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput => error.to_string(),
        kind => io::Error::from(kind).to_string(),
    };
    let found = Diagnostic::error(Code::CannotWrite, format!("`{name}` cannot be written: {why}"));
    Box::new(found.at_data(DataPlace::file(name)))
}

impl Output {
    /// Looks whether it can be written, so that a place where nothing can be is found before any work is done.
    ///
    /// # Errors
    ///
    /// [`Code::CannotWrite`]
    pub fn open(path: &Path) -> Result<Output, Box<Diagnostic>> {
        let path = path.to_owned();
        let into = match path.metadata() {
            Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(there) if !there.is_file() => File::options().write(true).open(&path).map(Some),
            _ => beside(&path).map(|_| None),
        };
        match into {
            Ok(into) => Ok(Output { path, into }),
            Err(error) => Err(cannot(&path, &error)),
        }
    }

    /// Writes the whole of it and puts it in its place.
    ///
    /// # Errors
    ///
    /// [`Code::CannotWrite`]; then what was there before is still there.
    pub fn finish(self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Box<Diagnostic>> {
        self.write(write)?.put()
    }

    /// Writes the whole of it; of several files that belong together none is put before all are written.
    ///
    /// # Errors
    ///
    /// [`Code::CannotWrite`]
    pub fn write(self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<Written, Box<Diagnostic>> {
        fn buffered(open: &mut dyn Write, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
            let mut out = io::BufWriter::new(open);
            write(&mut out)?;
            out.flush()
        }
        let Output { path, into } = self;
        let done = match into {
            Some(mut open) => buffered(&mut open, write).map(|()| None),
            None => locked(&path).and_then(|mut open| {
                buffered(open.as_file_mut(), write)?;
                // or else the move could reach the disk before what is moved
                open.as_file().sync_data()?;
                Ok(Some(open))
            }),
        };
        match done {
            Ok(beside) => Ok(Written { path, beside }),
            Err(error) => Err(cannot(&path, &error)),
        }
    }
}

impl Written {
    /// Puts it in its place.
    ///
    /// # Errors
    ///
    /// [`Code::CannotWrite`]; then what was there before is still there.
    pub fn put(self) -> Result<(), Box<Diagnostic>> {
        let Written { path, beside } = self;
        let Some(beside) = beside else { return Ok(()) };
        beside.persist(&path).map_err(|error| cannot(&path, &error.error))?;
        clear(&path);
        Ok(())
    }
}

/// What files beside a path are called.
fn prefix(path: &Path) -> String {
    let mut name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut most = name.len().min(MOST_OF_NAME);
    while !name.is_char_boundary(most) {
        most -= 1;
    }
    name.truncate(most);
    format!(".{name}.phical-")
}

fn directory(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A new file beside a path.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = prefix(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // as any new file: what the user's mask leaves of it
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory(path))
}

/// The same, locked. Somebody who clears up may have taken the first one away before it was locked, but not the second.
fn locked(path: &Path) -> io::Result<NamedTempFile> {
    loop {
        let open = beside(path)?;
        // where nothing can be locked nothing is cleared up
        if open.as_file().lock().is_err() || open.path().exists() {
            return Ok(open);
        }
    }
}

/// Removes what killed runs have left beside a path. Where that fails it will do no harm for longer.
fn clear(path: &Path) {
    let prefix = prefix(path);
    let Ok(all) = fs::read_dir(directory(path)) else { return };
    for entry in all.flatten().filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix)) {
        let left = File::options().write(true).open(entry.path());
        if left.is_ok_and(|left| left.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Makes a directory where there is none.
///
/// # Errors
///
/// [`Code::CannotWrite`]
pub fn make_directory(path: &Path) -> Result<(), Box<Diagnostic>> {
    fs::create_dir_all(path).map_err(|error| cannot(path, &error))
}
