//! The units phical knows: one table, and what is looked up in it.

use std::f64::consts::TAU;

use super::Dimension;

/// One unit: `mantissa · 10^ten` in SI (metre, radian, second, kilogram, kelvin).
///
/// The power of ten stands apart so that products and conversions round once and not once per factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// What stands in the model file, `mm`.
    pub symbol: &'static str,
    /// The name in words, `millimetre`.
    pub name: &'static str,
    /// What it measures.
    pub dimension: Dimension,
    mantissa: f64,
    ten: i16,
}

const fn entry(symbol: &'static str, name: &'static str, dimension: Dimension, mantissa: f64, ten: i16) -> Entry {
    Entry { symbol, name, dimension, mantissa, ten }
}

const DEGREE: f64 = 1.745_329_251_994_329_6e-2; // π/180
const GON: f64 = 1.570_796_326_794_896_6e-2; // π/200
const MILLIGON: f64 = 1.570_796_326_794_896_6e-5; // π/200 000
const ARCMINUTE: f64 = 2.908_882_086_657_216e-4; // π/10 800
const ARCSECOND: f64 = 4.848_136_811_095_36e-6; // π/648 000

/// A plain number.
pub(super) const ONE: Entry = entry("1", "one", Dimension::NUMBER, 1.0, 0);

/// Every unit, by what it measures. A row added here is known everywhere.
pub const TABLE: &[Entry] = &{
    use Dimension as D;
    [
        entry("m", "metre", D::LENGTH, 1.0, 0),
        entry("mm", "millimetre", D::LENGTH, 1.0, -3),
        entry("cm", "centimetre", D::LENGTH, 1.0, -2),
        entry("dm", "decimetre", D::LENGTH, 1.0, -1),
        entry("km", "kilometre", D::LENGTH, 1.0, 3),
        entry("um", "micrometre", D::LENGTH, 1.0, -6),
        entry("µm", "micrometre", D::LENGTH, 1.0, -6),
        entry("nm", "nanometre", D::LENGTH, 1.0, -9),
        entry("in", "inch", D::LENGTH, 254.0, -4),
        entry("ft", "foot", D::LENGTH, 3048.0, -4),
        entry("rad", "radian", D::ANGLE, 1.0, 0),
        entry("mrad", "milliradian", D::ANGLE, 1.0, -3),
        entry("urad", "microradian", D::ANGLE, 1.0, -6),
        entry("µrad", "microradian", D::ANGLE, 1.0, -6),
        entry("deg", "degree", D::ANGLE, DEGREE, 0),
        entry("°", "degree", D::ANGLE, DEGREE, 0),
        entry("gon", "gon", D::ANGLE, GON, 0),
        entry("mgon", "milligon", D::ANGLE, MILLIGON, 0),
        entry("arcmin", "arcminute", D::ANGLE, ARCMINUTE, 0),
        entry("'", "arcminute", D::ANGLE, ARCMINUTE, 0),
        entry("arcsec", "arcsecond", D::ANGLE, ARCSECOND, 0),
        entry("\"", "arcsecond", D::ANGLE, ARCSECOND, 0),
        entry("turn", "turn", D::ANGLE, TAU, 0),
        entry("s", "second", D::TIME, 1.0, 0),
        entry("ms", "millisecond", D::TIME, 1.0, -3),
        entry("us", "microsecond", D::TIME, 1.0, -6),
        entry("µs", "microsecond", D::TIME, 1.0, -6),
        entry("ns", "nanosecond", D::TIME, 1.0, -9),
        entry("min", "minute", D::TIME, 60.0, 0),
        entry("h", "hour", D::TIME, 3600.0, 0),
        entry("kg", "kilogram", D::MASS, 1.0, 0),
        entry("g", "gram", D::MASS, 1.0, -3),
        entry("K", "kelvin", D::TEMPERATURE, 1.0, 0),
        ONE,
        entry("ppm", "part per million", D::NUMBER, 1.0, -6),
        entry("ppb", "part per billion", D::NUMBER, 1.0, -9),
        entry("%", "percent", D::NUMBER, 1.0, -2),
        entry("px", "pixel", D::NUMBER, 1.0, 0),
    ]
};

/// The unit with exactly this symbol; the Greek μ and the primes ′ ″ are taken for their twins in the table.
pub(super) fn find(symbol: &str) -> Option<&'static Entry> {
    let twin = |c| match c {
        'μ' => 'µ',
        '′' => '\'',
        '″' => '"',
        other => other,
    };
    TABLE.iter().find(|entry| symbol.chars().map(twin).eq(entry.symbol.chars()))
}

/// The unit that was probably meant: another case, a name in words, a slip of the finger.
pub(super) fn suggest(symbol: &str) -> Option<&'static str> {
    let length = symbol.chars().count();
    if length > 24 {
        return None;
    }
    let lower = symbol.to_lowercase();
    let spelt = lower.replace("meter", "metre");
    let singular = spelt.strip_suffix('s').unwrap_or(&spelt);
    let named =
        |entry: &&Entry| entry.symbol.to_lowercase() == lower || [spelt.as_str(), singular].contains(&entry.name);
    let allowed = match length {
        0..=2 => 0,
        3..=5 => 1,
        _ => 2,
    };
    let near = || {
        let distance = |entry: &Entry| strsim::damerau_levenshtein(&lower, entry.symbol);
        let nearest = TABLE.iter().min_by_key(|entry| distance(entry))?;
        (distance(nearest) <= allowed).then_some(nearest)
    };
    // other names of the same thing, which are near to another
    let also = [("grad", "gon"), ("grade", "gon"), ("gradian", "gon"), ("sec", "s"), ("micron", "µm")];
    if let Some((_, right)) = also.iter().find(|(name, _)| [lower.as_str(), singular].contains(name)) {
        return Some(right);
    }
    TABLE.iter().find(named).or_else(near).map(|entry| entry.symbol)
}

/// A product of powers of units, rounded only by [`Scale::value`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    over: f64,
    under: f64,
    ten_halves: i32,
}

impl Scale {
    pub(super) const ONE: Scale = Scale { over: 1.0, under: 1.0, ten_halves: 0 };

    /// Times `entry` to the power `halves / 2`.
    pub(super) fn times(mut self, entry: &Entry, halves: i8) -> Scale {
        let power = f64::from(halves.unsigned_abs()) / 2.0;
        let factor = if power == 1.0 { entry.mantissa } else { entry.mantissa.powf(power) };
        *(if halves < 0 { &mut self.under } else { &mut self.over }) *= factor;
        self.ten_halves = self.ten_halves.saturating_add(i32::from(entry.ten) * i32::from(halves));
        self
    }

    /// The product as a number.
    pub(super) fn value(self) -> f64 {
        let root = if self.ten_halves % 2 == 0 { 1.0 } else { 10.0_f64.sqrt() };
        let ten = 10.0_f64.powi(self.ten_halves.div_euclid(2).abs());
        let over = self.over * root;
        if self.ten_halves < 0 { over / (self.under * ten) } else { over * ten / self.under }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn symbols_are_unique_and_in_the_reference() {
        let reference = include_str!("../../docs/language.md");
        let start = reference.find("Lengths:").expect("the list of units");
        let list = &reference[start..start + reference[start..].find("`pi`").expect("its end")];
        let mut listed: Vec<&str> = list.split('`').skip(1).step_by(2).flat_map(str::split_whitespace).collect();
        let mut known: Vec<&str> = TABLE.iter().map(|entry| entry.symbol).collect();
        listed.sort_unstable();
        known.sort_unstable();
        assert_eq!(listed, known);
        known.dedup();
        assert_eq!(known.len(), TABLE.len());
    }

    #[test]
    fn angles_are_the_nearest_doubles() {
        for (symbol, parts) in
            [("deg", 180.0), ("gon", 200.0), ("mgon", 2e5), ("arcmin", 10_800.0), ("arcsec", 648_000.0)]
        {
            let found = find(symbol).unwrap().mantissa;
            assert!((found * parts / PI - 1.0).abs() < 3e-16, "{symbol}");
        }
        assert_eq!(find("deg").unwrap().mantissa, 1.0_f64.to_radians());
    }

    #[test]
    fn suggestions() {
        for (wrong, right) in [
            ("MM", Some("mm")),
            ("Deg", Some("deg")),
            ("k", Some("K")),
            ("mmm", Some("mm")),
            ("arcsecs", Some("arcsec")),
            ("arsec", Some("arcsec")),
            ("degrees", Some("deg")),
            ("Millimeters", Some("mm")),
            ("grad", Some("gon")),
            ("microns", Some("µm")),
            ("x", None),
            ("ab", None),
            ("gear", None),
            ("", None),
        ] {
            assert_eq!(suggest(wrong), right, "{wrong}");
        }
        assert_eq!(suggest(&"m".repeat(100_000)), None);
    }
}
