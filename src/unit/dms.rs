//! Degrees, minutes and seconds: `12-34-56.7`, `12 34 56.7`, `12:34:56.7`, `12°34'56.7"`.

use std::f64::consts::PI;

/// Why a text is no angle in degrees, minutes and seconds.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DmsError {
    /// Nothing at all, or nothing but a sign.
    #[error("an angle in degrees, minutes and seconds is missing")]
    Empty,
    /// A single number without a mark: it might as well be decimal degrees, or `ddd.mmss`.
    #[error("`{0}` has no minutes; write degrees-minutes-seconds, such as 12-34-56.7")]
    NoMinutes(String),
    /// More than three fields.
    #[error("`{0}` has more than degrees, minutes and seconds")]
    TooMany(String),
    /// A field with nothing in it.
    #[error("the {0} are missing")]
    EmptyField(&'static str),
    /// A field that is not a plain decimal number.
    #[error("the {0} `{1}` are not a number")]
    NotANumber(&'static str, String),
    /// Only the last field may have decimals.
    #[error("the {0} `{1}` have decimals, though {2} follow")]
    Decimals(&'static str, String, &'static str),
    /// Minutes and seconds end at 60.
    #[error("the {0} `{1}` are not below 60")]
    Sixty(&'static str, String),
    /// A field of the form with marks that does not end with its mark.
    #[error("the {0} do not end with `{1}`")]
    NoMark(&'static str, char),
}

/// A field of an angle: its name, the mark that ends it, other marks that may, and how many seconds of arc one of it is.
struct Field {
    name: &'static str,
    mark: char,
    others: &'static [&'static str],
    seconds: f64,
}

const DEGREES: Field = Field { name: "degrees", mark: '°', others: &[], seconds: 3600.0 };
const MINUTES: Field = Field { name: "minutes", mark: '\'', others: &["′"], seconds: 60.0 };
const SECONDS: Field = Field { name: "seconds", mark: '"', others: &["″", "''"], seconds: 1.0 };
const FIELDS: [Field; 3] = [DEGREES, MINUTES, SECONDS];

/// Reads an angle in degrees, minutes and seconds, or degrees and minutes, and gives radians.
///
/// A sign in front belongs to the whole: `-0-30-00` is minus half a degree.
///
/// ```
/// use phical::unit::parse_dms;
///
/// assert_eq!(parse_dms("-90-00-00.0")?, -std::f64::consts::FRAC_PI_2);
/// assert_eq!(parse_dms("30°15'")?, parse_dms("30 15 00")?);
/// assert!(parse_dms("12-60-00").is_err());
/// # Ok::<(), phical::unit::DmsError>(())
/// ```
pub fn parse_dms(text: &str) -> Result<f64, DmsError> {
    let text = text.trim();
    let unsigned = text.strip_prefix(['-', '−', '+']).unwrap_or(text);
    let negative = unsigned.len() < text.len() && !text.starts_with('+');
    let seconds = if unsigned.is_empty() {
        return Err(DmsError::Empty);
    } else if unsigned.contains('°') {
        let close = unsigned.replace("° ", "°").replace("' ", "'").replace("′ ", "′");
        let (length, degrees) = scan_marked(&close)?;
        if length < close.len() {
            return Err(DmsError::TooMany(text.to_owned()));
        }
        degrees * 3600.0
    } else {
        seconds(&split(unsigned, text)?)?
    };
    let radians = seconds / 648_000.0 * PI;
    Ok(if negative { -radians } else { radians })
}

/// Reads `12°34'56.7"`, `12°34'` or `12°` at the start of a text: how many bytes it takes, and decimal degrees.
pub fn scan_marked(text: &str) -> Result<(usize, f64), DmsError> {
    let mut fields: Vec<&str> = Vec::new();
    let mut rest = text;
    for field in FIELDS {
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        if end == 0 && !fields.is_empty() {
            break;
        }
        let (digits, marked) = rest.split_at(end);
        fields.push(digits);
        let other = || field.others.iter().find_map(|mark| marked.strip_prefix(mark));
        rest = marked.strip_prefix(field.mark).or_else(other).ok_or(DmsError::NoMark(field.name, field.mark))?;
    }
    Ok((text.len() - rest.len(), seconds(&fields)? / 3600.0))
}

/// The fields between the separators; the first character that is none of a number's says which separator it is.
fn split<'a>(unsigned: &'a str, text: &str) -> Result<Vec<&'a str>, DmsError> {
    let separator = unsigned.chars().find(|&c| !c.is_ascii_digit() && c != '.');
    match separator {
        None => Err(DmsError::NoMinutes(text.to_owned())),
        Some(c) if c.is_whitespace() => Ok(unsigned.split_whitespace().collect()),
        Some(c @ ('-' | ':' | '−')) => Ok(unsigned.split(c).collect()),
        Some(_) => Err(DmsError::NotANumber(DEGREES.name, unsigned.to_owned())),
    }
}

/// All fields as seconds of arc.
fn seconds(fields: &[&str]) -> Result<f64, DmsError> {
    if fields.len() > FIELDS.len() {
        return Err(DmsError::TooMany(fields.join("-")));
    }
    let mut total = 0.0;
    let mut rest = fields.iter().zip(FIELDS).peekable();
    let mut first = true;
    while let Some((field, Field { name, seconds, .. })) = rest.next() {
        if field.is_empty() {
            return Err(DmsError::EmptyField(name));
        }
        let plain = field.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
        let value = field.parse::<f64>().ok().filter(|value| plain && value.is_finite());
        let value = value.ok_or_else(|| DmsError::NotANumber(name, (*field).to_owned()))?;
        if !std::mem::take(&mut first) && value >= 60.0 {
            return Err(DmsError::Sixty(name, (*field).to_owned()));
        }
        if let Some((_, next)) = rest.peek()
            && field.contains('.')
        {
            return Err(DmsError::Decimals(name, (*field).to_owned(), next.name));
        }
        total += value * seconds;
    }
    if total.is_finite() { Ok(total) } else { Err(DmsError::NotANumber(DEGREES.name, fields.join("-"))) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn forms() {
        let reference = (12.0_f64 + 34.0 / 60.0 + 56.7 / 3600.0).to_radians();
        for text in [
            "12-34-56.7",
            "12 34 56.7",
            "12:34:56.7",
            "12°34'56.7\"",
            "12° 34' 56.7\"",
            "12°34′56.7″",
            "12°34'56.7''",
            "+012-34-56.70",
        ] {
            let found = parse_dms(text).unwrap();
            assert!((found - reference).abs() < 1e-15, "{text}");
            let negative = format!("-{}", text.trim_start_matches('+'));
            assert_eq!(parse_dms(&negative), Ok(-found));
            assert_eq!(parse_dms(&negative.replacen('-', " −", 1)), Ok(-found));
        }
        for (text, degrees) in [
            ("12-34.5", 12.575),
            ("12°", 12.0),
            ("12.5°", 12.5),
            ("12°34.5'", 12.575),
            ("-0-30", -0.5),
            ("-0°30'", -0.5),
            ("400-0-0", 400.0),
        ] {
            assert!((parse_dms(text).unwrap().to_degrees() - degrees).abs() < 1e-12, "{text}");
        }
        assert_eq!(parse_dms("180-00-00"), Ok(PI));
    }

    #[test]
    fn refused() {
        use DmsError::*;
        let own = str::to_owned;
        for (text, error) in [
            ("", Empty),
            (" - ", Empty),
            ("12", NoMinutes(own("12"))),
            ("12.3456", NoMinutes(own("12.3456"))),
            ("12-34-56-7", TooMany(own("12-34-56-7"))),
            ("12°34'56\"7", TooMany(own("12°34'56\"7"))),
            ("12--56", EmptyField("minutes")),
            ("12-34-", EmptyField("seconds")),
            ("°34'", EmptyField("degrees")),
            ("12-34:56", NotANumber("minutes", own("34:56"))),
            ("12-3x-56", NotANumber("minutes", own("3x"))),
            ("12-1e1-56", NotANumber("minutes", own("1e1"))),
            ("--12-30", EmptyField("degrees")),
            ("12 -34", NotANumber("minutes", own("-34"))),
            ("x", NotANumber("degrees", own("x"))),
            ("nan-0", NotANumber("degrees", own("nan-0"))),
            ("12.5-34", Decimals("degrees", own("12.5"), "minutes")),
            ("12-34.5-1", Decimals("minutes", own("34.5"), "seconds")),
            ("12-60", Sixty("minutes", own("60"))),
            ("12-59-60.0", Sixty("seconds", own("60.0"))),
            ("12°34", NoMark("minutes", '\'')),
            ("12°34'56", NoMark("seconds", '"')),
        ] {
            assert_eq!(parse_dms(text), Err(error), "{text}");
        }
        assert!(parse_dms(&format!("{}-0", "9".repeat(400))).is_err());
    }

    proptest! {
        #[test]
        fn nothing_panics(text in r#"([0-9.°'"′″:\- −]|\PC){0,16}"#) {
            let _ = (parse_dms(&text), scan_marked(&text));
        }
    }
}
