//! A unit from its text: `mm`, `m/s^2`, `1/s`, `kg*m`.

use super::table::{Scale, find, suggest};
use super::{Dimension, Entry};

/// A unit: how large it is and what it measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// The unit in SI: metre, radian, second, kilogram, kelvin.
    pub factor: f64,
    /// What it measures.
    pub dimension: Dimension,
}

/// A text that is no unit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{symbol}` is not a unit")]
pub struct UnknownUnit {
    /// The part of the text that is not known.
    pub symbol: String,
    /// The unit that was probably meant.
    pub suggestion: Option<String>,
}

impl UnknownUnit {
    fn new(symbol: &str) -> UnknownUnit {
        UnknownUnit { symbol: symbol.to_owned(), suggestion: suggest(symbol).map(str::to_owned) }
    }
}

impl Unit {
    /// The unit of a plain number.
    pub const ONE: Unit = Unit { factor: 1.0, dimension: Dimension::NUMBER };

    /// Reads a whole text as a unit: symbols of the [table](super::TABLE), their products, quotients and powers, with no
    /// spaces inside. Exponents are multiples of a half.
    ///
    /// ```
    /// use phical::unit::Unit;
    ///
    /// assert_eq!(Unit::parse("mm/s^2")?.factor, 1e-3);
    /// assert_eq!(Unit::parse("s^-1")?, Unit::parse("1/s")?);
    /// assert_eq!(Unit::parse("MM").unwrap_err().suggestion.as_deref(), Some("mm"));
    /// # Ok::<(), phical::unit::UnknownUnit>(())
    /// ```
    pub fn parse(text: &str) -> Result<Unit, UnknownUnit> {
        let text = text.trim();
        let mut product = Product::ONE;
        let mut rest = text;
        let mut divide = false;
        loop {
            let (symbol, after) = leading_symbol(rest, true);
            let entry = find(symbol).ok_or_else(|| UnknownUnit::new(if symbol.is_empty() { text } else { symbol }))?;
            rest = product.read(entry, after, divide).ok_or_else(|| UnknownUnit::new(text))?;
            if rest.is_empty() {
                return product.unit().ok_or_else(|| UnknownUnit::new(text));
            }
            (divide, rest) = strip_operator(rest).ok_or_else(|| UnknownUnit::new(text))?;
        }
    }

    /// Reads the longest unit at the start of `text`, and says how many bytes it takes.
    ///
    /// A further factor counts only where its whole symbol is a unit and no `(`, `[` or `.name` follows it: `mm/x` and
    /// `mm/s.x` begin with the unit `mm`.
    pub fn prefix(text: &str) -> Result<(usize, Unit), UnknownUnit> {
        let (symbol, after) = leading_symbol(text, false);
        let first = find(symbol).ok_or_else(|| UnknownUnit::new(symbol))?;
        let mut product = Product::ONE;
        // all but what follows the exponent
        let refuse = |after: &str| {
            let rest = after.trim_start_matches(is_exponent);
            UnknownUnit { symbol: text.strip_suffix(rest).unwrap_or(text).to_owned(), suggestion: None }
        };
        let mut rest = product.read(first, after, false).ok_or_else(|| refuse(after))?;
        while let Some((divide, further)) = strip_operator(rest) {
            let (symbol, after) = leading_symbol(further, false);
            let Some(entry) = find(symbol).filter(|_| !continues_name(after)) else {
                break;
            };
            rest = product.read(entry, after, divide).ok_or_else(|| refuse(after))?;
        }
        let unit = product.unit().ok_or_else(|| refuse(rest))?;
        Ok((text.len() - rest.len(), unit))
    }
}

/// Whether a unit can begin with this character.
pub fn starts_unit(c: char) -> bool {
    is_letter(c) || is_mark(c)
}

/// A product of units in the making.
struct Product {
    scale: Scale,
    dimension: Option<Dimension>,
}

impl Product {
    const ONE: Product = Product { scale: Scale::ONE, dimension: Some(Dimension::NUMBER) };

    /// Takes in a factor with the exponent at the start of `after`; gives what follows that exponent, `None` where the
    /// exponent is no multiple of a half or too large.
    fn read<'t>(&mut self, entry: &Entry, after: &'t str, divide: bool) -> Option<&'t str> {
        let (exponent, rest) = leading_exponent(after);
        let halves = 2.0 * if divide { -exponent } else { exponent };
        if halves.fract() != 0.0 || halves.abs() > f64::from(i8::MAX) {
            return None;
        }
        self.scale = self.scale.times(entry, halves as i8);
        let power = entry.dimension.pow(halves / 2.0);
        self.dimension = self.dimension.zip(power).and_then(|(product, power)| product.checked_mul(power));
        Some(rest)
    }

    fn unit(&self) -> Option<Unit> {
        let factor = self.scale.value();
        self.dimension.filter(|_| factor.is_normal()).map(|dimension| Unit { factor, dimension })
    }
}

/// The symbol at the start, and what follows it: a word, a mark such as `°` (with what is stuck to it, as in `°C`), or `1` where
/// that may be.
fn leading_symbol(text: &str, one: bool) -> (&str, &str) {
    let mut characters = text.chars();
    let is_word = |c: char| is_letter(c) || c.is_ascii_digit();
    let rest = match characters.next() {
        Some('1') if one => characters.as_str(),
        Some(c) if is_mark(c) && !characters.clone().next().is_some_and(is_letter) => characters.as_str(),
        Some(c) if starts_unit(c) => characters.as_str().trim_start_matches(is_word),
        _ => text,
    };
    text.split_at(text.len() - rest.len())
}

/// The exponent at the start, `^2`, `^-1`, `^0.5`: its value, and what follows it. Without one, the value is 1.
fn leading_exponent(text: &str) -> (f64, &str) {
    let Some(after) = text.strip_prefix('^') else {
        return (1.0, text);
    };
    let unsigned = after.strip_prefix(['-', '−']).unwrap_or(after);
    let after_digits = |text: &str| -> Option<usize> {
        let rest = text.trim_start_matches(|c: char| c.is_ascii_digit());
        (rest.len() < text.len()).then_some(rest.len())
    };
    let Some(after_whole) = after_digits(unsigned) else {
        return (1.0, text);
    };
    let (_, fraction) = unsigned.split_at(unsigned.len() - after_whole);
    let left = fraction.strip_prefix('.').and_then(after_digits).unwrap_or(after_whole);
    let (size, rest) = unsigned.split_at(unsigned.len() - left);
    let size = size.parse().unwrap_or(f64::INFINITY);
    (if unsigned.len() < after.len() { -size } else { size }, rest)
}

/// Takes `*` (also `·`, `×`) or `/` from the start: whether it divides, and the rest.
fn strip_operator(text: &str) -> Option<(bool, &str)> {
    let divided = text.strip_prefix('/').map(|rest| (true, rest));
    divided.or_else(|| text.strip_prefix(['*', '·', '×', '⋅']).map(|rest| (false, rest)))
}

/// Whether the word before is a name after all: a call, a family or a field.
fn continues_name(after: &str) -> bool {
    after.starts_with(['(', '[']) || after.strip_prefix('.').is_some_and(|field| field.starts_with(is_letter))
}

fn is_letter(c: char) -> bool {
    c.is_alphabetic() && c != 'º' || c == '_'
}

fn is_mark(c: char) -> bool {
    matches!(c, '°' | '\'' | '"' | '%' | '′' | '″')
}

fn is_exponent(c: char) -> bool {
    c.is_ascii_digit() || matches!(c, '^' | '-' | '−' | '.')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::unit::TABLE;

    #[test]
    fn factors() {
        for (text, factor, dimension) in [
            ("1", 1.0, "number"),
            ("%", 1e-2, "number"),
            ("mm", 1e-3, "length"),
            ("μm", 1e-6, "length"),
            ("in", 0.0254, "length"),
            ("mm^2", 1e-6, "length^2"),
            ("km/h", 1000.0 / 3600.0, "length/time"),
            ("mm/s^2", 1e-3, "length/time^2"),
            ("s^-1", 1.0, "1/time"),
            ("1/s", 1.0, "1/time"),
            ("g·m²", 0.0, ""),
            ("g·m", 1e-3, "length*mass"),
            ("mm^0.5", 1e-3_f64.sqrt(), "length^0.5"),
            ("m*s/m", 1.0, "time"),
            (" deg/s ", 1.0_f64.to_radians(), "angle/time"),
        ] {
            match Unit::parse(text) {
                Ok(unit) => {
                    assert!((unit.factor / factor - 1.0).abs() < 1e-15, "{text}: {}", unit.factor);
                    assert_eq!(unit.dimension.to_string(), dimension, "{text}");
                }
                Err(_) => assert_eq!(dimension, "", "{text}"),
            }
        }
    }

    #[test]
    fn refused() {
        for (text, symbol, suggestion) in [
            ("", "", None),
            ("MM", "MM", Some("mm")),
            ("mm/S", "S", Some("s")),
            ("mm/", "mm/", Some("mm")),
            ("mm s", "mm s", None),
            ("mm^", "mm^", Some("mm")),
            ("mm^0.3", "mm^0.3", None),
            ("mm^99", "mm^99", None),
            ("km^60*h^60", "km^60*h^60", None),
            ("°C", "°C", None),
            ("2", "2", None),
            ("mm2", "mm2", Some("mm")),
        ] {
            let error = Unit::parse(text).unwrap_err();
            assert_eq!((error.symbol.as_str(), error.suggestion.as_deref()), (symbol, suggestion), "{text}");
        }
        assert_eq!(UnknownUnit::new("MM").to_string(), "`MM` is not a unit");
    }

    #[test]
    fn longest_prefix() {
        for (text, taken) in [
            ("mm", "mm"),
            ("mm/x", "mm"),
            ("mm/s", "mm/s"),
            ("mm/s2", "mm"),
            ("mm/s^2*x", "mm/s^2"),
            ("mm/s.x", "mm"),
            ("mm*h(2)", "mm"),
            ("mm*h[k]", "mm"),
            ("mm /s", "mm"),
            ("mm/1", "mm"),
            ("m^n", "m"),
            ("m^-n", "m"),
            ("m^-2n", "m^-2"),
            ("°+1", "°"),
            ("m^2^3", "m^2"),
        ] {
            assert_eq!(Unit::prefix(text).map(|(end, _)| &text[..end]).as_deref(), Ok(taken), "{text}");
        }
        for (text, symbol) in [("x/mm", "x"), ("m^2.7*x", "m^2.7"), ("m/s^2.7 + 1", "m/s^2.7"), ("°C", "°C")] {
            assert_eq!(Unit::prefix(text).unwrap_err().symbol, symbol, "{text}");
        }
    }

    #[test]
    fn every_unit_reads_as_itself() {
        for entry in TABLE {
            let unit = Unit::parse(entry.symbol).unwrap();
            assert_eq!(unit.dimension, entry.dimension);
            assert_eq!(Unit::parse(&format!("{0}*{0}/{0}", entry.symbol)).unwrap().dimension, entry.dimension);
        }
    }

    proptest! {
        #[test]
        fn nothing_panics(text in r#"([mskgµ°'"%1_²x^*/.\-0-9 ]|\PC){0,12}"#) {
            let _ = Unit::parse(&text);
            if let Ok((end, unit)) = Unit::prefix(&text) {
                prop_assert_eq!(Unit::parse(&text[..end]).ok(), Some(unit));
            }
        }
    }
}
