//! A Jacobian from a file beside the exact one of a session's model.

use std::path::Path;

use super::{Choice, Session, Values};
use crate::audit::{MatrixAudit, Refit, Sheet, Stack, audit_matrix, read_matrices, refit};
use crate::compile::Measurement;
use crate::data::Table;
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, Source};
use crate::evaluate::point;
use crate::problem::{Options, Problem, Selection, Undefined, Weights};

/// What is compared, and where.
#[derive(Clone, Debug, Default)]
pub struct Against {
    /// The file of the matrix.
    pub file: String,
    /// The point; that of the file or else the nominal values where it is not given.
    pub at: Option<Values>,
    /// Files of data by measurement; the rows of the file, or else the model's own, where there are none.
    pub data: Vec<(String, String)>,
    /// What is free.
    pub selection: Selection,
    /// Whether the problem is fitted with and without the mistakes.
    pub refit: bool,
}

/// A matrix of the file, compared.
#[derive(Clone, Debug)]
pub struct Compared {
    /// What the point is called.
    pub point: String,
    /// The verdict.
    pub audit: MatrixAudit,
    /// What the mistakes cost.
    pub refit: Option<Refit>,
}

impl Against {
    /// Compares every matrix of the file; with warnings.
    ///
    /// # Errors
    /// Where the file cannot be read, or a matrix does not fit the model and the data.
    pub fn run(&self, session: &Session) -> Result<(Vec<Compared>, Diagnostics), Diagnostics> {
        let source = Source::read(Path::new(&self.file)).map_err(|found| Diagnostics::from(*found))?;
        if self.file.ends_with(".ron") {
            let message = "a model is no matrix of numbers";
            let hint = "write formulas into the model's `derivatives` and say `--check`";
            let found = Diagnostic::error(Code::BadMatrix, message).at_data(DataPlace::file(&self.file)).hint(hint);
            return Err(found.into());
        }
        let sheets = read_matrices(&self.file, source.text())?;
        let (mut all, mut mistakes, mut warnings) = (Vec::new(), Diagnostics::new(), Diagnostics::new());
        for sheet in &sheets {
            match self.compare(session, sheet) {
                Ok((compared, more)) => {
                    all.push(compared);
                    warnings.extend(more);
                }
                Err(found) => mistakes.extend(found),
            }
        }
        if mistakes.has_errors() { Err(mistakes) } else { Ok((all, warnings)) }
    }

    fn compare(&self, session: &Session, sheet: &Sheet) -> Result<(Compared, Diagnostics), Diagnostics> {
        let options = Options {
            weights: Some(Weights::Unit),
            selection: self.selection.clone(),
            unconstrained: true,
            ..Options::default()
        };
        let own = if self.data.is_empty() { table(session, sheet) } else { None };
        let (problem, mut warnings) = match own {
            Some(table) => Problem::bind(&session.program, vec![table], &options)?,
            None => {
                let choice = Choice { files: self.data.clone(), given_only: true, ..Choice::default() };
                let mut bound = session.bind(&choice, &options)?;
                // a matrix of one measurement has the rows of that one alone
                if let Some(name) = &sheet.measurement {
                    session.measurement(name).map_err(|found| Diagnostics::from(*found))?;
                    bound.problem.blocks.retain(|block| block.measurement.name == *name);
                }
                (bound.problem, bound.warnings)
            }
        };
        warnings.0.retain(|warning| !matches!(warning.code, Code::StartProjected | Code::HeldOutside));
        let undefined = |Undefined(found): Undefined| Diagnostics::from(*found);
        let values = self.at.as_ref().map_or(sheet.values.as_slice(), |at| at.values.as_slice());
        let at = point(&problem, values);
        let exact = Stack::at(&problem, &at).map_err(undefined)?;
        let audit = audit_matrix(&self.file, &sheet.given, &problem, &at, &exact)?;
        let refit = match self.refit {
            true => Some(refit(&problem, &at, &exact, &audit).map_err(|found| Diagnostics::from(*found))?),
            false => None,
        };
        let stem =
            |values: &Values| Path::new(&values.file).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let named = self.at.as_ref().map_or_else(|| sheet.point.clone(), stem);
        Ok((Compared { point: named.unwrap_or_else(|| "nominal".into()), audit, refit }, warnings))
    }
}

/// The rows of data that the file has itself, where they are those of one measurement and say all that it reads.
fn table(session: &Session, sheet: &Sheet) -> Option<(usize, Table)> {
    let (names, rows) = sheet.rows.as_ref()?;
    let all = &session.program.measurements;
    let fits = |(_, measurement): &(usize, &Measurement)| {
        let named = sheet.measurement.as_ref().is_none_or(|name| *name == measurement.name);
        let known = names.iter().all(|name| measurement.inputs.iter().any(|input| input.name == *name));
        let complete = measurement.inputs.iter().all(|input| input.default.is_some() || names.contains(&input.name));
        named && known && complete && measurement.keys.is_empty() && !measurement.residuals.is_empty()
    };
    let (index, measurement) = all.iter().enumerate().find(fits)?;
    let units = &session.program.units;
    let mut table = Table::new(0, measurement.inputs.len());
    for row in rows {
        let reading = |input: &crate::compile::Input| {
            let given = names.iter().position(|name| *name == input.name).and_then(|k| row.get(k));
            let internal = |value: &f64| units.to_internal(*value, units.unit(input.unit.dimension));
            given.map(internal).or(input.default)
        };
        table.put([], &measurement.inputs.iter().map(reading).collect::<Option<Vec<f64>>>()?, None);
    }
    Some((index, table))
}
