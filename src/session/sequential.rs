//! A sequential fit: rows of files and of a pipe, as they come.

use super::choice::Chosen;
use super::saved::{Saved, State, state_json};
use super::{Bound, Choice, Session, UsedFile, failed};
use crate::compile::Measurement;
use crate::data::{self, STANDARD_INPUT, Table};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};
use crate::fit::{Fit, Tested, analyse_with};
use crate::problem::{Options, Problem, Undefined};
use crate::solve::{Keep, SequentialError, Settings};

/// How rows are taken in.
#[derive(Clone, Debug, Default)]
pub struct Sequence {
    /// Which of them are relinearised.
    pub keep: Keep,
    /// After how many rows there is something to tell; zero is never.
    pub every: usize,
    /// Saved states to go on from, merged.
    pub resume: Vec<String>,
}

/// Rows that are taken in together where nobody looks in between.
const TOGETHER: usize = 64;

/// Rows that were read, and the measurement whose rows come by standard input.
#[derive(Debug)]
pub struct Coming {
    tables: Vec<(usize, Table)>,
    piped: Option<String>,
}

/// Rows taken in one after the other, and what is known after them.
pub struct Running<'s, 't> {
    session: &'s Session,
    options: Options,
    sequence: Sequence,
    tell: &'t mut dyn FnMut(usize, &Fit),
    problem: Option<Problem<'s>>,
    state: Option<State>,
    files: Vec<UsedFile>,
    warnings: Diagnostics,
    rows: usize,
}

/// A measurement's table and its number; it is added where there is none.
#[allow(clippy::indexing_slicing, reason = "the number is that of a table just found or added")]
pub(super) fn table_of<'t>(
    tables: &'t mut Vec<(usize, Table)>,
    index: usize,
    declared: &Measurement,
) -> (usize, &'t mut Table) {
    let number = tables.iter().position(|(known, _)| *known == index).unwrap_or_else(|| {
        tables.push((index, Table::new(declared.keys.len(), declared.inputs.len())));
        tables.len() - 1
    });
    (number, &mut tables[number].1)
}

impl<'s, 't> Running<'s, 't> {
    /// Before the first row. `tell` is called with the number of rows and the fit of these.
    pub fn new(
        session: &'s Session,
        options: Options,
        sequence: Sequence,
        tell: &'t mut dyn FnMut(usize, &Fit),
    ) -> Self {
        let warnings = session.warnings.clone();
        let (problem, state, files) = (None, None, Vec::new());
        Running { session, options, sequence, tell, problem, state, files, warnings, rows: 0 }
    }

    /// Reads the rows of files, to be [taken in](Self::take_in). Saved states take the place of the model's own files.
    ///
    /// # Errors
    /// All mistakes of names, data and options.
    pub fn read(&mut self, choice: &Choice) -> Result<Coming, Diagnostics> {
        let mut piped = choice.clone();
        piped.files.retain(|(_, file)| file == STANDARD_INPUT);
        let files = choice.files.iter().filter(|(_, file)| file != STANDARD_INPUT).cloned().collect();
        let mut others = Choice { files, ..choice.clone() };
        if let [_, (name, _), ..] = &piped.files[..] {
            let message = format!("standard input can be read once only, and not for `{name}` too");
            return Err(self.stop(Diagnostic::error(Code::UnreadableFile, message)));
        }
        others.given_only |= !piped.files.is_empty() || !self.sequence.resume.is_empty();
        let nothing_else = others.given_only && others.files.is_empty();
        let chosen = match nothing_else {
            true => Chosen { tables: Vec::new(), files: Vec::new() },
            false => others.read(self.session, &mut self.warnings).ok_or_else(|| self.warnings.clone())?,
        };
        self.files = chosen.files;
        Ok(Coming { tables: chosen.tables, piped: piped.files.into_iter().next().map(|(name, _)| name) })
    }

    /// Takes in all rows of the saved states and of the files, those of standard input last and as they come, until it is stopped.
    ///
    /// # Errors
    /// Mistakes of states and options, or the first row that cannot be used; rows before it are taken in.
    pub fn take_in(&mut self, coming: Coming) -> Result<(), Diagnostics> {
        self.begin(coming.tables)?;
        match &coming.piped {
            Some(name) => self.follow(name),
            None => Ok(()),
        }
    }

    fn stop(&self, found: Diagnostic) -> Diagnostics {
        let mut all = self.warnings.clone();
        all.push(found);
        all
    }

    /// Binds the rows of saved states and of files, and takes them in.
    fn begin(&mut self, files: Vec<(usize, Table)>) -> Result<(), Diagnostics> {
        let session = self.session;
        let mut tables = Vec::new();
        let mut saved = Vec::new();
        for file in &self.sequence.resume.clone() {
            let read = Saved::read(session, file).and_then(|saved| {
                let places = saved.take_rows(session, &mut tables)?;
                Ok((saved, places))
            });
            saved.push(read.map_err(|found| self.stop(*found))?);
        }
        let mut rows = Vec::new();
        for (index, table) in files {
            let declared = session.program.measurement(index).map_err(|found| self.stop(*found))?;
            let (block, all) = table_of(&mut tables, index, declared);
            let before = all.rows();
            all.append(&table).map_err(|error| self.stop(Table::unreadable(&error)))?;
            rows.extend((before..all.rows()).map(|row| (block, row)));
        }
        if tables.is_empty() {
            return Ok(());
        }
        self.bind(tables)?;
        let (Some(problem), keep) = (&self.problem, self.sequence.keep) else { return Ok(()) };
        let mut merged: Option<State> = None;
        for (saved, places) in &saved {
            let state = saved.state(problem, keep, places).map_err(|found| self.stop(*found))?;
            match &mut merged {
                None => merged = Some(state),
                Some(all) => all.merge(problem, &state).map_err(|error| self.stop(apart(&saved.file, error)))?,
            }
        }
        let taken = |state: &State| state.kept().len();
        self.rows = merged.as_ref().map_or(0, taken);
        self.state = merged;
        let mut rest = &rows[..];
        while !rest.is_empty() && !self.options.execution.stopped() {
            let (some, more) = rest.split_at(self.together().min(rest.len()));
            self.take(some).map_err(|found| self.stop(*found))?;
            rest = more;
        }
        Ok(())
    }

    /// How many rows come before somebody looks, or as many as are best taken in together.
    fn together(&self) -> usize {
        match self.sequence.every {
            0 => TOGETHER,
            every => (every - self.rows % every).min(TOGETHER),
        }
    }

    fn bind(&mut self, tables: Vec<(usize, Table)>) -> Result<(), Diagnostics> {
        match Problem::bind(&self.session.program, tables, &self.options) {
            Ok((problem, warnings)) => {
                if self.problem.is_none() {
                    self.warnings.extend(warnings);
                }
                self.problem = Some(problem);
                Ok(())
            }
            Err(mistakes) => {
                let mut all = self.warnings.clone();
                all.extend(mistakes);
                Err(all)
            }
        }
    }

    /// Takes in rows of the problem.
    fn take(&mut self, rows: &[(usize, usize)]) -> Result<(), Box<Diagnostic>> {
        let Some(problem) = &self.problem else { return Ok(()) };
        let keep = self.sequence.keep;
        let state =
            self.state.get_or_insert_with(|| State::new(problem, problem.start.clone(), keep, Settings::default()));
        state.add(problem, rows).map_err(|error| Box::new(failed(problem, error)))?;
        self.rows += rows.len();
        if self.sequence.every > 0 && self.rows.is_multiple_of(self.sequence.every) {
            let solution = state.estimate(problem).map_err(|error| Box::new(failed(problem, error)))?.clone();
            let fit = analyse_with(&problem.seen_by(state), solution, Tested::None);
            (self.tell)(self.rows, &fit.map_err(|Undefined(found)| found)?);
        }
        Ok(())
    }

    /// Takes in the rows of standard input as they come.
    fn follow(&mut self, name: &str) -> Result<(), Diagnostics> {
        let session = self.session;
        let index = session.measurement(name).map_err(|found| self.stop(*found))?;
        let mut found = Diagnostics::new();
        let mut refused = None;
        let execution = self.options.execution.clone();
        let stop = move || execution.stopped();
        let read = data::follow(&session.program, index, &mut found, &stop, &mut |row| match self.piped(index, row) {
            Ok(()) => true,
            Err(why) => {
                refused = Some(why);
                false
            }
        });
        if let Some(why) = refused {
            return Err(why);
        }
        let failed = found.has_errors();
        self.warnings.extend(found);
        if failed {
            return Err(self.warnings.clone());
        }
        let used = |file: data::FileRead| UsedFile {
            measurement: name.to_owned(),
            file: file.file,
            fingerprint: file.fingerprint,
            rows: file.rows,
        };
        self.files.extend(read.map(used));
        Ok(())
    }

    /// Takes in a row of standard input: a table of it alone.
    fn piped(&mut self, index: usize, row: &Table) -> Result<(), Diagnostics> {
        let declared = self.session.program.measurement(index).map_err(|found| self.stop(*found))?;
        let names: Vec<&str> = (0..declared.keys.len()).map(|k| row.key(0, k)).collect();
        let readings = row.row(0);
        let pushed = self.problem.as_mut().and_then(|p| p.push(index, &names, &readings, row.place(0).line));
        let at = match pushed {
            Some(at) => at,
            None => self.bind_with(index, declared, row)?,
        };
        self.take(&[at]).map_err(|found| {
            let place = DataPlace { file: "standard input".to_owned(), ..row.place(0) };
            self.stop(found.at_data(place))
        })
    }

    /// Binds anew with a row that names what no row has named before.
    fn bind_with(&mut self, index: usize, declared: &Measurement, row: &Table) -> Result<(usize, usize), Diagnostics> {
        let before = self.problem.take();
        let tables = before.iter().flat_map(|p| p.blocks.iter().map(|b| (b.index, Table::clone(&b.table))));
        let mut tables: Vec<(usize, Table)> = tables.collect();
        let (block, all) = table_of(&mut tables, index, declared);
        all.append(row).map_err(|error| self.stop(Table::unreadable(&error)))?;
        let at = (block, all.rows().saturating_sub(1));
        let bound = self.bind(tables);
        if bound.is_err() {
            self.problem = before;
            return bound.map(|()| at);
        }
        if let (Some(before), Some(problem), Some(state)) = (&before, &self.problem, self.state.take()) {
            self.state = Some(among_more(state, before, problem).map_err(|found| self.stop(*found))?);
        }
        Ok(at)
    }

    /// The JSON of the state, where any row has been taken in.
    pub fn saved(&self) -> Option<serde_json::Value> {
        Some(state_json(self.session, self.problem.as_ref()?, self.state.as_ref()?))
    }

    /// The problem that is left to be solved where the state has seen all: the rows that it keeps, and what is left of the others,
    /// from its estimate on.
    ///
    /// # Errors
    /// Where there are no rows, or the search cannot start.
    pub fn finish(mut self) -> Result<Bound<'s>, Diagnostics> {
        let none = Diagnostic::error(Code::NoRows, "there are no rows of data");
        let (Some(problem), Some(mut state)) = (self.problem.take(), self.state.take()) else {
            return Err(self.stop(none.hint("name a file by `--data MEASUREMENT=FILE`, or go on with `--resume`")));
        };
        let solution = state.estimate(&problem).map_err(|error| self.stop(failed(&problem, error)))?;
        let start = solution.point.clone();
        let mut problem = problem.seen_by(&state);
        problem.start = start;
        Ok(Bound { session: self.session, problem, files: self.files, warnings: self.warnings, read_ns: 0 })
    }
}

/// The state among the coordinates of a problem that has more of them.
fn among_more(state: State, before: &Problem, after: &Problem) -> Result<State, Box<Diagnostic>> {
    let place = after.places();
    let to: Vec<Option<usize>> = before.layout.coordinates.iter().map(|c| after.layout.find(&c.name)).collect();
    let point = |from: &Vec<f64>| {
        let mut point = after.start.clone();
        to.iter().zip(from).for_each(|(to, value)| {
            if let Some(known) = to.and_then(|to| point.get_mut(to)) {
                *known = *value;
            }
        });
        point
    };
    let n = after.free.len();
    // what is not free any more has no column: the factor refuses one beyond all
    let column = |c: &usize| to.get(*c).copied().flatten().and_then(|c| *place.get(c)?).unwrap_or(n);
    let columns: Vec<usize> = before.free.iter().map(column).collect();
    let embedded = state.embedded(point, |information| information.embedded(n, &columns));
    embedded.map_err(|error| Undefined::from(error).0)
}

/// Why states cannot be merged.
fn apart(file: &str, error: SequentialError<Undefined>) -> Diagnostic {
    match error {
        SequentialError::Undefined(Undefined(found)) => *found,
        SequentialError::Linalg(error) => *Undefined::from(error).0,
        SequentialError::Points => {
            let message = format!("`{file}` and another state have absorbed rows at different points");
            let hint = "make all parts with `--hold-point` from one `--start`, or keep their rows with `--keep all`";
            Diagnostic::error(Code::DifferentPoints, message).at_data(DataPlace::file(file)).hint(hint)
        }
    }
}
