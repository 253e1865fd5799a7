//! Files that are there as a whole or not at all.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::diag::{Code, DataPlace, Diagnostic};

/// A file being written. Until it is finished, whatever was there before stays.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// written beside its place, then moved there
    Beside(NamedTempFile),
    /// what is there and no plain file, such as a pipe, is written into
    Into(std::fs::File),
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
    /// Opens it, so that a place where nothing can be written is found before any work is done.
    ///
    /// # Errors
    ///
    /// [`Code::CannotWrite`]
    pub fn open(path: &Path) -> Result<Output, Box<Diagnostic>> {
        let file = |kind| Output { path: path.to_owned(), kind };
        match path.metadata() {
            Ok(there) if there.is_dir() => return Err(cannot(path, &io::ErrorKind::IsADirectory.into())),
            Ok(there) if !there.is_file() => {
                let open = std::fs::File::options().write(true).open(path);
                return open.map(|open| file(Kind::Into(open))).map_err(|error| cannot(path, &error));
            }
            _ => {}
        }
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        builder.prefix(".phical-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // as any new file: what the user's mask leaves of it
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        builder.tempfile_in(directory).map(|open| file(Kind::Beside(open))).map_err(|error| cannot(path, &error))
    }

    /// Writes the whole of it and puts it in its place.
    ///
    /// # Errors
    ///
    /// [`Code::CannotWrite`]; then what was there before is still there.
    pub fn finish(self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Box<Diagnostic>> {
        fn buffered(open: &mut dyn Write, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
            let mut out = io::BufWriter::new(open);
            write(&mut out)?;
            out.flush()
        }
        let Output { path, kind } = self;
        let done = match kind {
            Kind::Into(mut open) => buffered(&mut open, write),
            Kind::Beside(mut open) => buffered(open.as_file_mut(), write)
                .and_then(|()| open.persist(&path).map(drop).map_err(|error| error.error)),
        };
        done.map_err(|error| cannot(&path, &error))
    }
}

/// Makes a directory where there is none.
///
/// # Errors
///
/// [`Code::CannotWrite`]
pub fn make_directory(path: &Path) -> Result<(), Box<Diagnostic>> {
    std::fs::create_dir_all(path).map_err(|error| cannot(path, &error))
}
