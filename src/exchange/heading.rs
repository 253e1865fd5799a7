//! The heading of a table: which column is what, and in which unit.

use super::rows::Convention;
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, did_you_mean};
use crate::unit::{Dimension, Unit};

/// What a column of a table is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Name,
    Reads,
    Theta,
    D,
    A,
    Alpha,
    Beta,
    Offset,
    Sign,
    Min,
    Max,
}

impl Column {
    const ALL: [(Column, &'static [&'static str]); 11] = [
        (Column::Name, &["joint", "name", "link"]),
        (Column::Reads, &["reads", "type"]),
        (Column::Theta, &["theta", "θ"]),
        (Column::D, &["d"]),
        (Column::A, &["a"]),
        (Column::Alpha, &["alpha", "α"]),
        (Column::Beta, &["beta", "β"]),
        (Column::Offset, &["offset"]),
        (Column::Sign, &["sign"]),
        (Column::Min, &["min", "lower"]),
        (Column::Max, &["max", "upper"]),
    ];

    fn of(word: &str) -> Option<Column> {
        let word = word.to_lowercase();
        Column::ALL.iter().find(|(_, names)| names.contains(&word.as_str())).map(|(column, _)| *column)
    }

    fn dimension(self) -> Option<Dimension> {
        match self {
            Column::Theta | Column::Alpha | Column::Beta => Some(Dimension::ANGLE),
            Column::D | Column::A => Some(Dimension::LENGTH),
            _ => None,
        }
    }
}

/// Units of a table's lengths and angles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableUnits {
    /// The symbol of its lengths, if given.
    pub length: Option<String>,
    /// The symbol of its angles, if given.
    pub angle: Option<String>,
}

/// A heading that was understood.
pub(super) struct Heading {
    /// By column of the file; none for what is passed over.
    pub(super) columns: Vec<Option<Column>>,
    /// The unit of each column that has one of its own.
    pub(super) units: Vec<Option<Unit>>,
    /// What the headings say of the units of lengths and angles.
    pub(super) stated: TableUnits,
    /// Which the heading says it is, by `[dh]` or `[mdh]` behind the name's.
    pub(super) convention: Option<Convention>,
}

/// A word, and what stands in brackets behind it.
fn split(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    let inside = |open: char, close: char| {
        let (word, rest) = cell.split_once(open)?;
        rest.trim_end().strip_suffix(close).map(|unit| (word.trim(), Some(unit.trim())))
    };
    inside('[', ']').or_else(|| inside('(', ')')).unwrap_or((cell, None))
}

/// Reads the heading of a file; all that is wrong with it is told.
pub(super) fn heading(file: &str, line: usize, cells: &[&str], found: &mut Diagnostics) -> Heading {
    let mut all = Heading { columns: Vec::new(), units: Vec::new(), stated: TableUnits::default(), convention: None };
    let place = |column: &str| DataPlace {
        file: file.to_owned(),
        line: Some(line),
        column: Some(column.to_owned()),
        ..DataPlace::default()
    };
    for cell in cells {
        let (word, bracket) = split(cell);
        let column = Column::of(word);
        let mut unit = None;
        match column {
            // what an export says of uncertainties, and columns without a name
            None if word.is_empty() || word.to_lowercase().starts_with("sigma_") => {}
            None => {
                let names: Vec<&str> = Column::ALL.iter().filter_map(|(_, names)| names.first().copied()).collect();
                let wrong = Diagnostic::error(Code::ColumnUnknown, format!("a table of joints has no column `{word}`"));
                found.push(wrong.at_data(place(word)).maybe_hint(did_you_mean(word, "columns", &names)));
            }
            Some(known) if all.columns.contains(&Some(known)) => {
                let wrong = Diagnostic::error(Code::ColumnTwice, format!("the column `{word}` stands twice"));
                found.push(wrong.at_data(place(word)).hint("remove one"));
            }
            Some(Column::Name) => match bracket.map(str::to_lowercase).as_deref() {
                Some("dh") => all.convention = Some(Convention::Dh),
                Some("mdh") => all.convention = Some(Convention::ModifiedDh),
                _ => {}
            },
            Some(known) => {
                if let (Some(symbol), Some(dimension)) = (bracket, known.dimension()) {
                    match unit_of(symbol, dimension) {
                        Ok(factor) => {
                            unit = Some(factor);
                            let stated = if dimension == Dimension::ANGLE {
                                &mut all.stated.angle
                            } else {
                                &mut all.stated.length
                            };
                            stated.get_or_insert_with(|| symbol.to_owned());
                        }
                        Err(wrong) => found.push(wrong.at_data(place(word))),
                    }
                }
            }
        }
        all.columns.push(column);
        all.units.push(unit);
    }
    for (wanted, names) in Column::ALL {
        let needed = matches!(wanted, Column::Theta | Column::D | Column::A | Column::Alpha);
        if needed && !all.columns.contains(&Some(wanted)) {
            let name = names.first().copied().unwrap_or_default();
            let wrong = Diagnostic::error(Code::ColumnMissing, format!("there is no column `{name}`"));
            let place = DataPlace { file: file.to_owned(), line: Some(line), ..DataPlace::default() };
            let hint = "the first line names the columns: theta, d, a, alpha, in any order, perhaps with a unit, `theta [deg]`";
            found.push(wrong.at_data(place).hint(hint));
        }
    }
    all
}

/// A unit of lengths or angles.
///
/// # Errors
/// Where there is no such unit, or it is one of something else.
pub(super) fn unit_of(symbol: &str, dimension: Dimension) -> Result<Unit, Box<Diagnostic>> {
    let unit = Unit::parse(symbol).map_err(|error| {
        let meant = error.suggestion.as_ref().map(|symbol| format!("did you mean `{symbol}`? "));
        let hint =
            Some(format!("{}units of a table are such as `mm`, `m`, `in`, `deg`, `rad`", meant.unwrap_or_default()));
        Box::new(Diagnostic::error(Code::UnknownUnit, error.to_string()).maybe_hint(hint))
    })?;
    if unit.dimension != dimension {
        let message = format!("{} is wanted here, and `{symbol}` is a unit of something else", dimension.noun());
        let hint = "lengths are in units such as `m`, `mm`, `in`, and angles in `rad`, `deg`, `mrad`";
        return Err(Box::new(Diagnostic::error(Code::WrongUnit, message).hint(hint)));
    }
    Ok(unit)
}
