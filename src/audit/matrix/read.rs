//! Matrices from files: CSV of any separator, with or without a heading, or JSON in one of the forms that programs write.

#![deny(clippy::indexing_slicing, reason = "what a file says is only ever looked up")]

use csv::{ReaderBuilder, StringRecord, Trim};
use serde_json::Value;

use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};

/// A matrix of numbers, and what is said of its rows and columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// The columns, where they are named.
    pub names: Option<Vec<String>>,
    /// Of each row its row of data, from zero, and its residual, as far as they are named.
    pub labels: Vec<(Option<usize>, Option<String>)>,
    /// The numbers by rows.
    pub entries: Vec<Vec<f64>>,
}

/// A matrix, and where it was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// What the file calls the point, if anything.
    pub point: Option<String>,
    /// The measurement, if it is named.
    pub measurement: Option<String>,
    /// The values of the parameters in reported units, if they are there.
    pub values: Vec<(String, f64)>,
    /// The names of the inputs and the rows of data in reported units, if they are there.
    pub rows: Option<(Vec<String>, Vec<Vec<f64>>)>,
    /// The numbers.
    pub given: Given,
}

/// Words for the columns that say which row and which residual a row of the matrix is.
const ROW: &str = "row";
const RESIDUAL: &str = "residual";
/// Words for a matrix in an object.
const MATRIX: &[&str] = &["dr_dq", "jacobian", "matrix", "J"];

/// Reads the matrices of a file's text: one, or several of different points.
///
/// # Errors
/// Every cell that is empty, not a number or not finite, every row of another length; a JSON text of another form.
pub fn read_matrices(file: &str, text: &str) -> Result<Vec<Sheet>, Diagnostics> {
    let mut found = Diagnostics::new();
    let all = match text.trim_start().starts_with(['{', '[']) {
        true => json(file, text, &mut found),
        false => vec![Sheet { given: csv(file, text, &mut found), ..Sheet::default() }],
    };
    if !found.has_errors() && all.iter().any(|sheet| sheet.given.entries.is_empty()) {
        let nothing = Diagnostic::error(Code::NoRows, "the file has no matrix, or one without rows");
        found.push(nothing.at_data(DataPlace::file(file)));
    }
    if found.has_errors() { Err(found) } else { Ok(all) }
}

fn csv(file: &str, text: &str, found: &mut Diagnostics) -> Given {
    let comment = |line: &&str| !line.trim_start().starts_with(['#', '%']);
    let first = text.lines().filter(comment).find(|line| !line.trim().is_empty()).unwrap_or_default();
    let separator = [',', ';', '\t'].into_iter().find(|&one| first.contains(one));
    // comments stay as empty lines, so that lines count as in the file
    let lines = text.lines().map(|line| match (comment(&line), separator) {
        (false, _) => String::new(),
        (true, Some(_)) => line.to_owned(),
        (true, None) => line.split_whitespace().collect::<Vec<_>>().join(","),
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    let delimiter = separator.map_or(b',', |one| one as u8);
    let mut builder = ReaderBuilder::new();
    let mut reader =
        builder.has_headers(false).flexible(true).delimiter(delimiter).trim(Trim::All).from_reader(text.as_bytes());
    let mut records: Vec<StringRecord> = Vec::new();
    for record in reader.records() {
        match record {
            Ok(record) => records.push(record),
            Err(error) => {
                let why = Diagnostic::error(Code::UnreadableFile, format!("the file cannot be read: {error}"));
                found.push(why.at_data(DataPlace::file(file)));
            }
        }
    }
    let headed =
        records.first().is_some_and(|first| first.iter().any(|cell| number(cell).is_none() && !cell.is_empty()));
    let names: Option<Vec<String>> = headed.then(|| records.remove(0).iter().map(str::to_owned).collect());
    let mut given = Given::default();
    let width = names.as_ref().map_or_else(|| records.first().map_or(0, StringRecord::len), Vec::len);
    let name = |k: usize| names.as_ref().and_then(|all| all.get(k)).cloned().unwrap_or_else(|| (k + 1).to_string());
    // a first column without a name numbers the rows, as tables do that were written with their index
    let role = |k: usize| match names.as_ref().and_then(|all| all.get(k)).map(String::as_str) {
        Some("") if k == 0 => "index",
        name => name.unwrap_or_default(),
    };
    for (row, record) in records.iter().enumerate() {
        let place = |column: Option<usize>, value: Option<&str>| DataPlace {
            file: file.to_owned(),
            line: record.position().map(|at| at.line() as usize),
            row: Some(row + 1),
            column: column.map(name),
            value: value.map(str::to_owned),
        };
        if record.len() != width {
            let message = format!("the row has {} fields, and {width} are wanted", record.len());
            found.push(Diagnostic::error(Code::FieldCount, message).at_data(place(None, None)));
            continue;
        }
        let (mut entries, mut label) = (Vec::with_capacity(width), (None, None));
        for (k, cell) in record.iter().enumerate() {
            let mut refuse = |code: Code, what: &str| {
                found.push(Diagnostic::error(code, what).at_data(place(Some(k), Some(cell))));
            };
            match (role(k), number(cell)) {
                ("index", _) => (),
                (RESIDUAL, _) => label.1 = Some(cell.to_owned()),
                (ROW, Some(x)) if x >= 1.0 && x.fract() == 0.0 => label.0 = Some(x as usize - 1),
                (ROW, _) => refuse(Code::NotANumber, "rows are counted 1, 2, 3, …"),
                (_, Some(x)) if x.is_finite() => entries.push(x),
                (_, Some(_)) => refuse(Code::DataNotFinite, "a derivative is not finite"),
                (_, None) if cell.is_empty() => refuse(Code::EmptyCell, "a derivative is missing"),
                (_, None) => refuse(Code::NotANumber, "a derivative is not a number"),
            }
        }
        given.entries.push(entries);
        given.labels.push(label);
    }
    let columns = |all: Vec<String>| {
        let kept = all.into_iter().enumerate().filter(|(k, _)| !["index", ROW, RESIDUAL].contains(&role(*k)));
        kept.map(|(_, name)| name).collect()
    };
    given.names = names.clone().map(columns);
    given
}

fn number(cell: &str) -> Option<f64> {
    cell.parse().ok()
}

fn json(file: &str, text: &str, found: &mut Diagnostics) -> Vec<Sheet> {
    let whole: Value = match serde_json::from_str(text) {
        Ok(whole) => whole,
        Err(error) => {
            let place = DataPlace { line: Some(error.line()), ..DataPlace::file(file) };
            found.push(Diagnostic::error(Code::BadMatrix, format!("the file is not JSON: {error}")).at_data(place));
            return Vec::new();
        }
    };
    let mut sheets = Vec::new();
    match whole.get("measurements").and_then(Value::as_object) {
        Some(all) => {
            for (name, one) in all {
                let named = |sheet| Sheet { measurement: Some(name.clone()), ..sheet };
                sheets.extend(of_object(file, one, found).into_iter().map(named));
            }
        }
        None => sheets.extend(of_object(file, &whole, found)),
    }
    sheets
}

/// A matrix alone, one in an object, columns by name, or matrices at points as `jacobian --format json` writes them.
fn of_object(file: &str, value: &Value, found: &mut Diagnostics) -> Vec<Sheet> {
    let strings = |key: &str| {
        let all = value.get(key)?.as_array()?;
        all.iter().map(|one| one.as_str().map(str::to_owned)).collect::<Option<Vec<String>>>()
    };
    let (parameters, inputs, residuals) = (strings("parameters"), strings("inputs"), strings("residuals"));
    if let Some(points) = value.get("at").and_then(Value::as_object) {
        let mut sheets = Vec::new();
        for (name, at) in points {
            let Some(matrix) = at.get("dr_dq") else { continue };
            let mut given = matrix_of(file, matrix, parameters.clone(), residuals.as_deref(), found);
            if let (Some(by_inputs), Some(inputs)) = (at.get("dr_dx"), &inputs) {
                let more = matrix_of(file, by_inputs, Some(inputs.clone()), residuals.as_deref(), found);
                if more.entries.len() == given.entries.len() {
                    given.entries.iter_mut().zip(more.entries).for_each(|(row, more)| row.extend(more));
                    given.names = given.names.map(|names| [names, inputs.clone()].concat());
                }
            }
            let q: Option<Vec<f64>> = at.get("q").and_then(|q| serde_json::from_value(q.clone()).ok());
            let values = parameters.iter().flatten().cloned().zip(q.into_iter().flatten()).collect();
            let rows: Option<Vec<Vec<f64>>> =
                value.get("rows").and_then(|all| serde_json::from_value(all.clone()).ok());
            let rows = inputs.clone().zip(rows);
            sheets.push(Sheet { point: Some(name.clone()), measurement: None, values, rows, given });
        }
        return sheets;
    }
    let inside = MATRIX.iter().find_map(|key| value.get(key));
    let given = match (value.is_array(), inside) {
        (true, _) => matrix_of(file, value, None, None, found),
        (false, Some(matrix)) => matrix_of(file, matrix, parameters, residuals.as_deref(), found),
        (false, None) => by_columns(file, value, found),
    };
    vec![Sheet { given, ..Sheet::default() }]
}

/// An object of columns: name → numbers.
fn by_columns(file: &str, value: &Value, found: &mut Diagnostics) -> Given {
    let columns: Option<Vec<(String, &Vec<Value>)>> = value
        .as_object()
        .and_then(|all| all.iter().map(|(name, column)| Some((name.clone(), column.as_array()?))).collect());
    let Some(columns) = columns.filter(|all| !all.is_empty()) else {
        found.push(no_matrix(file));
        return Given::default();
    };
    let rows = columns.iter().map(|(_, column)| column.len()).max().unwrap_or(0);
    let cell = |row: usize| columns.iter().map(|(_, column)| column.get(row).cloned().unwrap_or(Value::Null)).collect();
    let matrix = (0..rows).map(|row| Value::Array(cell(row))).collect();
    let names = columns.iter().map(|(name, _)| name.clone()).collect();
    matrix_of(file, &Value::Array(matrix), Some(names), None, found)
}

/// Rows of numbers, or for each row of data one of residuals.
fn matrix_of(
    file: &str,
    value: &Value,
    names: Option<Vec<String>>,
    residuals: Option<&[String]>,
    found: &mut Diagnostics,
) -> Given {
    let mut given = Given { names, ..Given::default() };
    let Some(rows) = value.as_array() else {
        found.push(no_matrix(file));
        return given;
    };
    for (row, entries) in rows.iter().enumerate() {
        let Some(entries) = entries.as_array() else {
            found.push(no_matrix(file));
            return given;
        };
        if entries.first().is_some_and(Value::is_array) {
            for (i, entries) in entries.iter().enumerate() {
                let residual = residuals.and_then(|all| all.get(i)).cloned();
                let entries = entries.as_array().map(Vec::as_slice).unwrap_or_default();
                given.push(file, (Some(row), residual), entries, found);
            }
        } else {
            given.push(file, (None, None), entries, found);
        }
    }
    given
}

impl Given {
    fn push(&mut self, file: &str, label: (Option<usize>, Option<String>), row: &[Value], found: &mut Diagnostics) {
        let number = self.entries.len() + 1;
        let width = self.names.as_ref().map_or_else(|| self.entries.first().map_or(row.len(), Vec::len), Vec::len);
        let place = |column: Option<usize>| DataPlace {
            row: Some(number),
            column: column.map(|k| {
                let name = self.names.as_ref().and_then(|names| names.get(k));
                name.cloned().unwrap_or_else(|| (k + 1).to_string())
            }),
            ..DataPlace::file(file)
        };
        if row.len() != width {
            let message = format!("the row has {} numbers, and {width} are wanted", row.len());
            found.push(Diagnostic::error(Code::FieldCount, message).at_data(place(None)));
        }
        for (k, cell) in row.iter().enumerate() {
            if cell.as_f64().is_none_or(|x| !x.is_finite()) {
                // JSON has no NaN; programs write null, or a text
                let text = cell.as_str().map_or_else(|| cell.to_string(), str::to_owned);
                let known = cell.is_null() || text.parse::<f64>().is_ok_and(|x| !x.is_finite());
                let (code, what) = match known {
                    true => (Code::DataNotFinite, "a derivative is not finite"),
                    false => (Code::NotANumber, "a derivative is not a number"),
                };
                found.push(Diagnostic::error(code, what).at_data(DataPlace { value: Some(text), ..place(Some(k)) }));
            }
        }
        self.entries.push(row.iter().map(|cell| cell.as_f64().unwrap_or(f64::NAN)).collect());
        self.labels.push(label);
    }
}

fn no_matrix(file: &str) -> Diagnostic {
    Diagnostic::error(Code::BadMatrix, "there is no matrix of numbers in the file").at_data(DataPlace::file(file)).hint(
        "write CSV, [[…], …], {\"parameters\": […], \"jacobian\": [[…], …]}, columns by name, or what `jacobian --format json` prints",
    )
}
