//! One cell: its number, or what is wrong with it.

use crate::diag::Code;
use crate::unit::{Unit, parse_dms};

/// What is wrong with a cell, without its place.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Wrong {
    pub(super) code: Code,
    pub(super) message: String,
    pub(super) hint: Option<String>,
}

/// The text of a cell without the space around it, for a message.
pub(super) fn shown(cell: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(cell.trim_ascii());
    match text.char_indices().nth(MOST) {
        None => text.into_owned(),
        Some((end, _)) => format!("{}…", text.split_at(end).0),
    }
}

/// A finite number. `unit` is what the column counts in.
pub(super) fn number(cell: &[u8], unit: &str) -> Result<f64, Wrong> {
    let cell = cell.trim_ascii();
    match std::str::from_utf8(cell).ok().and_then(|text| text.parse::<f64>().ok()) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(not_finite(cell)),
        None => Err(not_a_number(cell, unit)),
    }
}

/// An angle in degrees, minutes and seconds, as radians.
pub(super) fn angle(cell: &[u8]) -> Result<f64, Wrong> {
    /// Characters of an angle; with all digits that count it has about thirty.
    const LONGEST: usize = 200;
    let text = text(cell)?;
    if text.len() > LONGEST {
        let message = format!("`{}` is longer than any angle", shown(cell));
        return Err(Wrong { code: Code::BadAngle, message, hint: None });
    }
    parse_dms(text).map_err(|error| Wrong {
        code: Code::BadAngle,
        message: error.to_string(),
        hint: text
            .parse::<f64>()
            .is_ok()
            .then(|| "decimal degrees are declared by `unit: \"deg\"`, radians by `unit: \"rad\"`".to_owned()),
    })
}

/// A name.
pub(super) fn text(cell: &[u8]) -> Result<&str, Wrong> {
    match std::str::from_utf8(cell).map(str::trim) {
        Ok("") => Err(Wrong { code: Code::EmptyCell, message: "the cell is empty".to_owned(), hint: None }),
        Ok(text) => Ok(text),
        Err(_) => Err(Wrong {
            code: Code::UnreadableFile,
            message: "the cell is not UTF-8 text".to_owned(),
            hint: Some("save the file again as UTF-8".to_owned()),
        }),
    }
}

pub(super) fn not_finite(cell: &[u8]) -> Wrong {
    let message = format!("`{}` is not a finite number", shown(cell));
    Wrong { code: Code::DataNotFinite, message, hint: Some("remove the row".to_owned()) }
}

fn not_a_number(cell: &[u8], unit: &str) -> Wrong {
    if cell.is_empty() {
        let hint = "fill it in, or remove the row".to_owned();
        return Wrong { code: Code::EmptyCell, message: "the cell is empty".to_owned(), hint: Some(hint) };
    }
    let text = String::from_utf8_lossy(cell);
    let number = |text: &str| text.parse::<f64>().is_ok();
    let unit_after = || {
        let at = text.find(|c: char| !matches!(c, '0'..='9' | '+' | '-' | '.'))?;
        let (value, unit) = text.split_at(at);
        (number(value) && Unit::parse(unit).is_ok()).then_some(())
    };
    let hint = if number(&text.replacen(',', ".", 1)) {
        Some(format!("a decimal comma? Decimals are written with a point: `{}`", text.replacen(',', ".", 1)))
    } else if number(&text.replace('−', "-")) {
        Some(format!("a minus is written `-`: `{}`", text.replace('−', "-")))
    } else if number(&text.replace([',', '\'', ' ', '\u{a0}', '_'], "")) {
        Some("digits are not grouped".to_owned())
    } else if unit_after().is_some() {
        Some(format!("a cell has no unit; the column counts in {unit}"))
    } else if parse_dms(&text).is_ok() {
        Some("degrees, minutes and seconds are declared by `unit: \"d-m-s\"`".to_owned())
    } else {
        None
    };
    Wrong { code: Code::NotANumber, message: format!("`{}` is not a number", shown(cell)), hint }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_what_is_none() {
        for (text, value) in [("1.5", 1.5), (" -2e-3 ", -2e-3), ("+7", 7.0), ("4.9e-324", 5e-324)] {
            assert_eq!(number(text.as_bytes(), "mm"), Ok(value));
        }
        for (text, code, hint) in [
            ("1,5", "E032", "decimal comma? Decimals are written with a point: `1.5`"),
            ("−3", "E032", "`-3`"),
            ("1 000", "E032", "grouped"),
            ("2 mm", "E032", "counts in mm"),
            ("12-34-56", "E032", "d-m-s"),
            ("", "E031", "fill it in"),
            ("NaN", "E033", "remove"),
            ("1e400", "E033", "remove"),
        ] {
            let wrong = number(text.as_bytes(), "mm").unwrap_err();
            assert_eq!(wrong.code.id(), code, "{text}");
            assert!(wrong.hint.unwrap().contains(hint), "{text}");
        }
        assert_eq!(number(b"\xff", "mm").unwrap_err().code, Code::NotANumber);
        assert_eq!(angle(b"12.5").unwrap_err().code, Code::BadAngle);
        assert!(shown(&[b'9'; 100]).ends_with('…'));
    }
}
