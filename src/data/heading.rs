//! From the names of a file's columns to where each key and each input comes from.

use super::column::{same, symbol};
use crate::compile::{Input, Measurement, Program, column_constant};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, did_you_mean, nearest};
use crate::model::{DataFile, Quantity, Text};
use crate::unit::{Dimension, Unit, parse_dms};

/// What is read: a measurement's file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading<'a> {
    pub(super) program: &'a Program,
    pub(super) measurement: &'a Measurement,
    pub(super) file: &'a DataFile,
    /// the file's name, as shown
    pub(super) name: &'a str,
}

/// Where a value comes from: a cell of the row, or the same value for the whole file.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Origin<T> {
    Cell(usize),
    Whole(T),
}

/// Where each key and each input of a file comes from.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) keys: Vec<Origin<String>>,
    pub(super) inputs: Vec<Origin<f64>>,
}

impl Reading<'_> {
    /// The plan for a file whose columns have these names; `line` is the heading's. All mistakes are reported.
    pub(super) fn plan(&self, names: &[String], line: Option<usize>, found: &mut Diagnostics) -> Option<Plan> {
        let mut own = Diagnostics::new();
        self.check_declared(&mut own);
        let claims = self.claims(names, line, &mut own);
        let unclaimed = names.iter().enumerate().filter(|(at, _)| !claims.contains(&Some(*at)));
        let free: Vec<&str> = unclaimed.map(|(_, name)| name.as_str()).collect();
        let Measurement { keys, inputs, .. } = self.measurement;
        let mut plan = Plan { keys: Vec::new(), inputs: Vec::new() };
        for (key, claim) in keys.iter().zip(&claims) {
            let constant = self.file.constants.entry(key);
            if let (Some(_), Some((name, _))) = (claim, constant) {
                own.push(self.twice(name));
            }
            plan.keys.push(match (constant, claim) {
                (Some((_, quantity)), _) => Origin::Whole(key_name(quantity)),
                (None, Some(at)) => Origin::Cell(*at),
                (None, None) => {
                    own.push(self.missing(key, &free, line));
                    Origin::Whole(String::new())
                }
            });
        }
        for (input, claim) in inputs.iter().zip(claims.iter().skip(keys.len())) {
            let constant = self.file.constants.entry(&input.name);
            if let (Some(_), Some((name, _))) = (claim, constant) {
                own.push(self.twice(name));
            }
            plan.inputs.push(match (constant, claim, input.default) {
                (Some((name, quantity)), ..) => {
                    Origin::Whole(self.constant(name, quantity, input, &mut own).unwrap_or(0.0))
                }
                (None, Some(at), _) => Origin::Cell(*at),
                (None, None, Some(default)) if !free.iter().any(|name| alike(name, &input.name)) => {
                    Origin::Whole(default)
                }
                (None, None, _) => {
                    own.push(self.missing(&input.name, &free, line));
                    Origin::Whole(0.0)
                }
            });
        }
        let failed = own.has_errors();
        found.extend(own);
        (!failed).then_some(plan)
    }

    /// Names of `columns` and `constants` that belong to nothing or stand twice.
    fn check_declared(&self, found: &mut Diagnostics) {
        let wanted: Vec<&str> = self.wanted().collect();
        let unknown = |name: &Text| {
            let message = format!("`{}` is neither an input nor a key of `{}`", name.value, self.measurement.name);
            let hint = did_you_mean(&name.value, "inputs and keys", &wanted);
            self.in_model(Code::ColumnUnknown, message, name).maybe_hint(hint)
        };
        for (at, name) in self.file.columns.iter().enumerate() {
            let text = name.value.trim();
            if text == "_" {
                continue;
            }
            if !wanted.contains(&text) {
                found.push(
                    unknown(name).maybe_hint(
                        nearest(text, wanted.iter().copied())
                            .is_none()
                            .then(|| "a column that is not used is named `_`".to_owned()),
                    ),
                );
            } else if self.file.columns.iter().take(at).any(|before| before.value.trim() == text) {
                let message = format!("the column `{text}` stands twice");
                found.push(self.in_model(Code::ColumnTwice, message, name));
            }
        }
        for name in self.file.constants.keys() {
            if !wanted.contains(&name.value.as_str()) {
                found.push(unknown(name));
            }
        }
    }

    fn wanted(&self) -> impl Iterator<Item = &str> {
        let inputs = self.measurement.inputs.iter().map(|input| input.name.as_str());
        self.measurement.keys.iter().map(String::as_str).chain(inputs)
    }

    /// For each key, then each input, which column has its name.
    fn claims(&self, names: &[String], line: Option<usize>, found: &mut Diagnostics) -> Vec<Option<usize>> {
        let Measurement { keys, inputs, .. } = self.measurement;
        let keys = keys.iter().map(|key| (key.as_str(), None));
        let mut claims = Vec::new();
        for (wanted, input) in keys.chain(inputs.iter().map(|input| (input.name.as_str(), Some(input)))) {
            let mut having = names.iter().enumerate().filter(|(_, name)| *name == wanted).map(|(at, _)| at);
            let mut claim = having.next();
            let mut twice = having.next().is_some();
            if let (None, Some(input)) = (claim, input) {
                for (at, name) in names.iter().enumerate() {
                    let Some((_, unit)) = split_unit(name).filter(|(base, _)| *base == wanted) else { continue };
                    twice |= claim.is_some();
                    claim = Some(at);
                    found.extend(self.check_unit(input, unit, name, line));
                }
            }
            if twice && self.file.columns.is_empty() {
                let message = format!("the column `{wanted}` stands twice");
                let place = self.place(line, wanted);
                found.push(Diagnostic::error(Code::ColumnTwice, message).at_data(place).hint("rename or remove one"));
            }
            claims.push(claim);
        }
        claims
    }

    /// What is wrong with the unit that a heading states.
    fn check_unit(&self, input: &Input, unit: &str, name: &str, line: Option<usize>) -> Option<Diagnostic> {
        let units = &self.program.units;
        let declared = if input.dms { "d-m-s".to_owned() } else { symbol(input.unit, units) };
        let dms = matches!(unit, "d-m-s" | "dms");
        let place = DataPlace { value: Some(name.to_owned()), ..self.place(line, &input.name) };
        let wrong = |message: String| {
            let hint = format!("declare `unit: \"{unit}\"` for `{}`, or convert the column", input.name);
            Some(Diagnostic::error(Code::WrongUnit, message).at_data(place.clone()).hint(hint))
        };
        if input.dms || dms {
            let message = format!("the column `{}` counts in {unit}, and {declared} is declared", input.name);
            return if input.dms && dms { None } else { wrong(message) };
        }
        let stated = match unit {
            "" | "-" => Unit::ONE,
            _ => match Unit::parse(unit) {
                Ok(unit) => unit,
                Err(error) => {
                    let hint = match &error.suggestion {
                        Some(near) => format!("did you mean `{near}`? {declared} is declared"),
                        None => format!("{declared} is declared"),
                    };
                    return Some(Diagnostic::error(Code::UnknownUnit, error.to_string()).at_data(place).hint(hint));
                }
            },
        };
        if same(stated, input.unit) {
            return None;
        }
        let (of, wanted) = (stated.dimension, input.unit.dimension);
        let message = if of == wanted {
            format!("the column `{}` counts in {unit}, and {declared} is declared", input.name)
        } else {
            format!("the column `{}` counts in {unit} ({of}), and {declared} ({wanted}) is declared", input.name)
        };
        wrong(message)
    }

    /// The value of an input that is the same for the whole file, less its bias, as any reading.
    fn constant(&self, name: &Text, quantity: &Quantity, input: &Input, found: &mut Diagnostics) -> Option<f64> {
        let value = match quantity {
            Quantity::Text(text) if input.dms && parse_dms(&text.value).is_ok() => parse_dms(&text.value).ok(),
            Quantity::Number(number) if input.dms && number.value != 0.0 => {
                let message = format!("`{}` has no minutes and seconds", number.value);
                let hint = "write degrees, minutes and seconds as text, `\"12-34-56.7\"`, or a number with its unit";
                found.push(self.in_model(Code::BadAngle, message, name).hint(hint));
                None
            }
            _ => column_constant(self.program, quantity, input.unit, found),
        }?;
        if value.is_finite() {
            return Some(value - input.bias);
        }
        found.push(self.in_model(Code::NotFinite, "the value is not finite".to_owned(), name));
        None
    }

    fn missing(&self, name: &str, free: &[&str], line: Option<usize>) -> Diagnostic {
        let message = format!("the column `{name}` is missing");
        let near =
            nearest(name, free.iter().copied()).map(|near| format!("did you mean `{near}`? Its name is not `{name}`"));
        let hint = near.or_else(|| match line {
            None => Some("name it in `columns`, or give its value in `constants`".to_owned()),
            Some(_) if free.is_empty() => None,
            Some(_) => did_you_mean(name, "other columns", free),
        });
        Diagnostic::error(Code::ColumnMissing, message).at_data(self.place(line, name)).maybe_hint(hint)
    }

    fn twice(&self, name: &Text) -> Diagnostic {
        let message = format!("`{}` is a column of `{}` and also a constant", name.value, self.name);
        self.in_model(Code::ColumnTwice, message, name).hint("remove the constant, or skip the column")
    }

    fn in_model(&self, code: Code, message: String, name: &Text) -> Diagnostic {
        Diagnostic::error(code, message).at(&self.program.source, name.span)
    }

    pub(super) fn place(&self, line: Option<usize>, column: &str) -> DataPlace {
        DataPlace { line, column: Some(column.to_owned()), ..DataPlace::file(self.name) }
    }
}

/// A key that is the same for the whole file.
fn key_name(quantity: &Quantity) -> String {
    match quantity {
        Quantity::Text(text) => text.value.clone(),
        Quantity::Number(number) => number.value.to_string(),
    }
}

/// `hzL1 [deg]` or `hzL1 (deg)` as name and unit.
fn split_unit(name: &str) -> Option<(&str, &str)> {
    let (open, inner) = match name.strip_suffix(']') {
        Some(inner) => ('[', inner),
        None => ('(', name.strip_suffix(')')?),
    };
    let (base, unit) = inner.split_once(open)?;
    Some((base.trim(), unit.trim()))
}

/// Whether two names differ in nothing but case, spaces and underscores.
fn alike(one: &str, other: &str) -> bool {
    let plain = |name: &str| -> String {
        name.chars().filter(|c| !c.is_whitespace() && *c != '_').flat_map(char::to_lowercase).collect()
    };
    plain(one) == plain(other)
}

/// What is said of a column's unit in messages about its cells.
pub(super) fn unit_name(program: &Program, input: &Input) -> String {
    match input.unit.dimension {
        Dimension::NUMBER if same(input.unit, Unit::ONE) => "plain numbers".to_owned(),
        _ => symbol(input.unit, &program.units),
    }
}
