//! Numbers with their units: `17.59 arcsec`, `9.8 m/s^2`, `90°`, `12°34'56.7"`.

use std::ops::Range;

use super::{ParseError, ParseErrorKind, is_name};
use crate::unit::{Unit, scan_marked, starts_unit};

/// A number, its unit, and where it ends.
type Quantity = (f64, Option<(String, Unit)>, usize);

/// Reads the number at byte `start`, where a digit or a point with a digit stands, and the unit after it.
pub(super) fn number(text: &str, start: usize) -> Result<Quantity, ParseError> {
    let literal = literal_end(text, start)?;
    let (number, after) = (between(text, start, literal), from(text, literal));
    let minutes = after.strip_prefix('°').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    if minutes {
        return marked(text, start);
    }
    let value = value(number).map_err(|error| error.at(start))?;
    let after = after.trim_start();
    if !after.starts_with(starts_unit) {
        return Ok((value, None, literal));
    }
    let unit_start = text.len() - after.len();
    let (length, unit) = Unit::prefix(after).map_err(|unknown| {
        let begin = after.find(&unknown.symbol).map_or(unit_start, |at| unit_start + at);
        let end = begin + unknown.symbol.len();
        let error = ParseError::new(ParseErrorKind::UnknownUnit, begin..end, unknown.to_string());
        let symbol = &unknown.symbol;
        match unknown.suggestion {
            Some(meant) if is_name(symbol) => {
                error.hint(format!("did you mean `{number} {meant}`? A product is written `{number}*{symbol}`"))
            }
            Some(meant) => error.hint(format!("did you mean `{number} {meant}`?")),
            None if is_name(symbol) => error.hint(format!("a product is written `{number}*{symbol}`")),
            None if symbol.contains('^') => error.hint("the exponents of units are multiples of a half"),
            None => error,
        }
    })?;
    let end = unit_start + length;
    if !(value * unit.factor).is_finite() {
        return Err(bad(start..end, "the number is too large"));
    }
    Ok((value, Some((between(text, unit_start, end).to_owned(), unit)), end))
}

/// Reads degrees, minutes and seconds as decimal degrees.
fn marked(text: &str, start: usize) -> Result<Quantity, ParseError> {
    let part = |c: char| c.is_ascii_digit() || matches!(c, '.' | '°' | '\'' | '"' | '′' | '″');
    let all = start..text.len() - from(text, start).trim_start_matches(part).len();
    let refuse =
        |message: String| bad(all.clone(), message).hint("degrees, minutes and seconds are written `12°34'56.7\"`");
    let (length, degrees) = scan_marked(from(text, start)).map_err(|error| refuse(error.to_string()))?;
    let unit = Unit::parse("°").map_err(|unknown| refuse(unknown.to_string()))?;
    Ok((degrees, Some(("°".to_owned(), unit)), start + length))
}

/// The text from a byte on; nothing where that is past its end or within a character.
fn from(text: &str, start: usize) -> &str {
    text.get(start..).unwrap_or_default()
}

/// The text between two bytes.
fn between(text: &str, start: usize, end: usize) -> &str {
    text.get(start..end).unwrap_or_default()
}

/// Where the number without its unit ends.
fn literal_end(text: &str, start: usize) -> Result<usize, ParseError> {
    let digits = |at: usize| text.len() - from(text, at).trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let mut end = digits(start);
    if from(text, end).starts_with('.') {
        end = digits(end + 1);
    }
    if let Some(exponent) = from(text, end).strip_prefix(['e', 'E']) {
        let power = exponent.strip_prefix(['+', '-', '−']).unwrap_or(exponent);
        let power_start = text.len() - power.len();
        let power_end = digits(power_start);
        if power_end > power_start {
            end = power_end;
        } else if !exponent.starts_with(starts_unit) {
            let written = between(text, start, power_start);
            return Err(bad(start..power_start, format!("the exponent of `{written}` has no digits")));
        }
    }
    match from(text, end).chars().next() {
        Some('.') => Err(bad(start..end + 1, format!("`{}` has a point too many", between(text, start, end + 1)))),
        Some('_') => Err(bad(start..end + 1, "the digits of a number are not grouped")),
        _ => Ok(end),
    }
}

/// The value of a number without its unit.
fn value(literal: &str) -> Result<f64, ParseError> {
    let all = 0..literal.len();
    let value: f64 = match literal.replace('−', "-").parse() {
        Ok(value) => value,
        Err(_) => return Err(bad(all, format!("`{literal}` is not a number"))),
    };
    let mantissa = literal.split(['e', 'E']).next().unwrap_or(literal);
    if !value.is_finite() {
        Err(bad(all, "the number is too large"))
    } else if value == 0.0 && mantissa.contains(|c| matches!(c, '1'..='9')) {
        Err(bad(all, "the number is too small; write 0"))
    } else {
        Ok(value)
    }
}

fn bad(span: Range<usize>, message: impl Into<String>) -> ParseError {
    ParseError::new(ParseErrorKind::BadNumber, span, message)
}
