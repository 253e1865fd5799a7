//! Which files are read for which measurement.

use std::path::{Path, PathBuf};

use super::Session;
use crate::data::{self, Table, Watch};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::model::{DataFile, DataRole};

/// Which data are used: those of the model with a role, but for measurements that are given files of their own.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Files by measurement, relative to the working directory; `-` is standard input. They take the place of the model's.
    pub files: Vec<(String, String)>,
    /// Which of the model's files are used otherwise.
    pub role: DataRole,
    /// Whether measurements without files of their own are left out, where any has some.
    pub given_only: bool,
    /// Measurements that take no part.
    pub without: Vec<String>,
    /// Who is told how many bytes of a file have been read.
    pub watch: Watch,
}

/// A file that rows came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsedFile {
    /// The measurement.
    pub measurement: String,
    /// The file, as given.
    pub file: String,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub fingerprint: String,
    /// How many rows it has.
    pub rows: usize,
}

/// Tables by measurement number, and where they are from.
pub(super) struct Chosen {
    pub(super) tables: Vec<(usize, Table)>,
    pub(super) files: Vec<UsedFile>,
}

impl Choice {
    /// Reads all files; `None` where anything is wrong with any.
    pub(super) fn read(&self, session: &Session, diagnostics: &mut Diagnostics) -> Option<Chosen> {
        let mut chosen = Chosen { tables: Vec::new(), files: Vec::new() };
        let mut sound = true;
        for name in self.files.iter().map(|(name, _)| name).chain(&self.without) {
            if let Err(unknown) = session.measurement(name) {
                diagnostics.push(*unknown);
                sound = false;
            }
        }
        if self.files.iter().filter(|(_, file)| file == data::STANDARD_INPUT).count() > 1 {
            let message = "standard input can be read once only";
            diagnostics
                .push(Diagnostic::error(Code::UnreadableFile, message).hint("give one of the files by its name"));
            return None;
        }
        for (index, measurement) in session.program.measurements.iter().enumerate() {
            let own: Vec<&str> = self
                .files
                .iter()
                .filter(|(name, _)| *name == measurement.name)
                .map(|(_, file)| file.as_str())
                .collect();
            let left_out = self.given_only && own.is_empty() && !self.files.is_empty();
            if left_out || self.without.contains(&measurement.name) {
                continue;
            }
            let (files, directory): (Vec<DataFile>, PathBuf) = if own.is_empty() {
                let files = measurement.data.iter().filter(|file| file.role == self.role).cloned().collect();
                (files, session.directory().to_owned())
            } else {
                let file = |&path: &&str| DataFile { file: path.into(), ..DataFile::default() };
                (own.iter().map(file).collect(), PathBuf::new())
            };
            if files.is_empty() {
                let alone = measurement.data.is_empty() && measurement.inputs.is_empty() && measurement.keys.is_empty();
                if alone && self.role == DataRole::Calibrate {
                    chosen.tables.push((index, single()));
                }
                continue;
            }
            match chosen.files_of(session, index, &files, (&directory, &self.watch), diagnostics) {
                Some(table) if table.rows() > 0 => chosen.tables.push((index, table)),
                Some(_) => {
                    let message = format!("measurement `{}` has no data and takes no part", measurement.name);
                    let found = Diagnostic::warning(Code::DatasetAbsent, message);
                    diagnostics.push(found.at(&session.program.source, measurement.span));
                }
                None => sound = false,
            }
        }
        sound.then_some(chosen)
    }
}

impl Chosen {
    /// One table of all files of a measurement.
    fn files_of(
        &mut self,
        session: &Session,
        index: usize,
        files: &[DataFile],
        (directory, watch): (&Path, &Watch),
        diagnostics: &mut Diagnostics,
    ) -> Option<Table> {
        let read = data::read_files(&session.program, index, files, directory, watch, diagnostics)?;
        let measurement = &session.program.measurements.get(index)?.name;
        self.files.extend(read.files.into_iter().filter(|file| file.rows > 0).map(|file| UsedFile {
            measurement: measurement.clone(),
            file: file.file,
            fingerprint: file.fingerprint,
            rows: file.rows,
        }));
        Some(read.table)
    }
}

/// The only row of a measurement that reads nothing.
fn single() -> Table {
    let mut table = Table::new(0, 0);
    table.put([], &[], None);
    table
}
