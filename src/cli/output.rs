//! Files that are there as a whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::diag::{Code, DataPlace, Diagnostic};

/// A file being written. Until it is finished, whatever was there before stays.
#[derive(Debug)]
pub(super) struct Output {
    file: NamedTempFile,
    path: PathBuf,
}

fn cannot(path: &Path, error: &dyn std::error::Error) -> Box<Diagnostic> {
    let name = path.display().to_string();
    let found = Diagnostic::error(Code::CannotWrite, format!("`{name}` cannot be written: {error}"));
    Box::new(found.at_data(DataPlace::file(name)))
}

impl Output {
    /// Opens it, so that a place where nothing can be written is found before any work is done.
    pub(super) fn open(path: &Path) -> Result<Output, Box<Diagnostic>> {
        let directory = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if path.is_dir() {
            return Err(cannot(path, &std::io::Error::from(std::io::ErrorKind::IsADirectory)));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".phical-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // as any new file: what the user's mask leaves of it
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(directory).map_err(|error| cannot(path, &error))?;
        Ok(Output { file, path: path.to_owned() })
    }

    /// Writes the whole of it and puts it in its place.
    pub(super) fn finish(mut self, text: &str) -> Result<(), Box<Diagnostic>> {
        self.file.write_all(text.as_bytes()).map_err(|error| cannot(&self.path, &error))?;
        self.file.persist(&self.path).map(drop).map_err(|error| cannot(&self.path, &error.error))
    }
}

/// A directory, made where there is none.
pub(super) fn directory(path: &Path) -> Result<(), Box<Diagnostic>> {
    std::fs::create_dir_all(path).map_err(|error| cannot(path, &error))
}
