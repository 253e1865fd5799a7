//! The units of a model, and conversions to and from them.

use super::table::{ONE, Scale, find};
use super::{Base, Dimension, Entry, Unit, UnknownUnit};

/// The model's own unit for every base dimension: what a number without a unit means.
///
/// Inside, phical computes in these units, but always in radians: see [`Units::internal_factor`].
///
/// ```
/// use phical::unit::{Base, Dimension, Unit, Units};
///
/// let units = Units::default().with(Base::Angle, "deg")?;
/// let right = units.to_internal(100.0, Unit::parse("gon").unwrap());
/// assert_eq!(right, std::f64::consts::FRAC_PI_2);
/// assert_eq!(units.to_reported(right, Dimension::ANGLE), 90.0);
/// # Ok::<(), phical::unit::UnitsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    entries: [&'static Entry; 5],
}

/// A unit that a model cannot have as its own.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnitsError {
    /// The symbol is in no row of the table; products are none either.
    #[error(transparent)]
    Unknown(#[from] UnknownUnit),
    /// It is a unit of something else.
    #[error("`{symbol}` is a unit of {found}, not of {}", .wanted.name())]
    Dimension {
        /// The unit as written.
        symbol: String,
        /// What it measures.
        found: Dimension,
        /// What it should measure.
        wanted: Base,
    },
}

/// Millimetre, radian, second, kilogram, kelvin.
impl Default for Units {
    fn default() -> Units {
        let row = |symbol| find(symbol).unwrap_or(&ONE);
        Units { entries: ["mm", "rad", "s", "kg", "K"].map(row) }
    }
}

impl Units {
    /// The same with another unit for `base`.
    pub fn with(mut self, base: Base, symbol: &str) -> Result<Units, UnitsError> {
        let Some(entry) = find(symbol.trim()) else {
            let found = Unit::parse(symbol)?.dimension;
            return Err(UnitsError::Dimension { symbol: symbol.to_owned(), found, wanted: base });
        };
        if entry.dimension != Dimension::of(base) {
            let symbol = symbol.to_owned();
            return Err(UnitsError::Dimension { symbol, found: entry.dimension, wanted: base });
        }
        let own = self.entries.iter_mut().zip(Base::ALL).filter(|(_, known)| *known == base);
        own.for_each(|(known, _)| *known = entry);
        Ok(self)
    }

    /// The model's unit of `dimension` in SI.
    pub fn factor(&self, dimension: Dimension) -> f64 {
        let powers = self.entries.into_iter().zip(dimension.halves());
        powers.fold(Scale::ONE, |scale, (entry, halves)| scale.times(entry, halves)).value()
    }

    /// The unit of `dimension` that phical computes in, in SI: the model's, but the radian for angles.
    pub fn internal_factor(&self, dimension: Dimension) -> f64 {
        self.factor(dimension.without_angle())
    }

    /// The symbol of the model's unit of `dimension`: `mm`, `rad`, `mm/s`, `1`.
    pub fn symbol(&self, dimension: Dimension) -> String {
        dimension.write(self.entries.map(|entry| entry.symbol), "1")
    }

    /// The model's unit of `dimension`.
    pub fn unit(&self, dimension: Dimension) -> Unit {
        Unit { factor: self.factor(dimension), dimension }
    }

    /// A value given in `unit`, as phical computes with it.
    pub fn to_internal(&self, value: f64, unit: Unit) -> f64 {
        self.conversion(unit).to_internal(value)
    }

    /// How values given in `unit` become those that phical computes with, for many of them.
    pub fn conversion(&self, unit: Unit) -> Conversion {
        Conversion::new(unit.factor, self.internal_factor(unit.dimension))
    }

    /// A value as phical computes with it, in `unit`: where there is a double that [`to_internal`](Self::to_internal) takes back
    /// to the same bits, that one.
    pub fn from_internal(&self, value: f64, unit: Unit) -> f64 {
        let internal = self.internal_factor(unit.dimension);
        let there = Conversion::new(unit.factor, internal);
        let guess = Conversion::new(internal, unit.factor).to_internal(value);
        nearest(guess, value, |value| there.to_internal(value))
    }

    /// A value as phical computes with it, in the model's unit of its dimension.
    pub fn to_reported(&self, value: f64, dimension: Dimension) -> f64 {
        self.from_internal(value, self.unit(dimension))
    }

    /// The same as text for a message: ten digits and the unit.
    pub fn shown(&self, value: f64, dimension: Dimension) -> String {
        let reported = self.to_reported(value, dimension);
        // rounding of the conversion is nothing to show
        let short = format!("{reported:.9e}").parse::<f64>().unwrap_or(reported);
        let number = match short.abs() {
            size if size == 0.0 || (1e-4..1e15).contains(&size) => format!("{short}"),
            _ => format!("{short:e}"),
        };
        match self.symbol(dimension).as_str() {
            "1" => number,
            symbol => format!("{number} {symbol}"),
        }
    }
}

/// The double within a few steps of `guess` that `of` takes nearest to `wanted`.
pub fn nearest(guess: f64, wanted: f64, of: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 4;
    let error = |value: f64| (of(value) - wanted).abs();
    let (mut best, mut least) = (guess, error(guess));
    let (mut down, mut up) = (guess, guess);
    for _ in 0..STEPS {
        if least == 0.0 {
            break;
        }
        (down, up) = (down.next_down(), up.next_up());
        for value in [down, up] {
            if error(value) < least {
                (best, least) = (value, error(value));
            }
        }
    }
    best
}

/// From values in units of one size to values in units of another, by their ratio.
///
/// The ratio is taken the way it is at least one, where it mostly is a whole number that a double holds exactly: a
/// conversion between decimal units then rounds once, so that `5 µm` is the double next to 0.005 mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    multiply: bool,
    by: f64,
}

impl Conversion {
    fn new(from: f64, to: f64) -> Conversion {
        if from >= to {
            Conversion { multiply: true, by: whole(from / to) }
        } else {
            Conversion { multiply: false, by: whole(to / from) }
        }
    }

    /// A value given in the unit, as phical computes with it.
    #[must_use]
    pub fn to_internal(&self, value: f64) -> f64 {
        if self.multiply { value * self.by } else { value / self.by }
    }
}

/// The whole number within rounding of `ratio`, else `ratio`.
fn whole(ratio: f64) -> f64 {
    let round = ratio.round();
    if (ratio - round).abs() <= 4.0 * f64::EPSILON * round { round } else { ratio }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::TABLE;

    fn unit(text: &str) -> Unit {
        Unit::parse(text).unwrap()
    }

    #[test]
    fn decimal_units_round_once() {
        let units = Units::default();
        for (text, value, expected) in [
            ("mm", 0.7, 0.7),
            ("m", 0.1, 100.0),
            ("µm", 5.0, 0.005),
            ("nm", 3.0, 3e-6),
            ("m/s", 343.0, 343_000.0),
            ("mm^2", 0.3, 0.3),
            ("m^-1", 7.0, 0.007),
            ("deg", 90.0, std::f64::consts::FRAC_PI_2),
            ("mrad", 0.05, 0.05 / 1000.0),
            ("ppm", 3.0, 3e-6),
        ] {
            assert_eq!(units.to_internal(value, unit(text)), expected, "{text}");
            assert_eq!(units.from_internal(expected, unit(text)), value, "{text}");
        }
    }

    #[test]
    fn every_whole_number_of_decimal_units_rounds_once() {
        for (own, other, ratio) in
            [("mm", "µm", 1e3), ("mm", "nm", 1e6), ("cm", "nm", 1e7), ("dm", "µm", 1e5), ("m", "nm", 1e9)]
        {
            let units = Units::default().with(Base::Length, own).unwrap();
            for whole in 1..1000 {
                let value = f64::from(whole);
                let (there, back) = (value / ratio, value * ratio);
                assert_eq!(units.to_internal(value, unit(other)), there, "{other}");
                assert_eq!(units.from_internal(value, unit(other)), back, "{other}");
            }
        }
    }

    #[test]
    fn there_and_back() {
        let units = Units::default().with(Base::Angle, "gon").and_then(|units| units.with(Base::Length, "ft")).unwrap();
        for entry in TABLE {
            let there = units.to_internal(1.25, unit(entry.symbol));
            let back = units.from_internal(there, unit(entry.symbol));
            assert!((back - 1.25).abs() < 1e-15, "{}", entry.symbol);
        }
        let arc = Dimension::LENGTH.checked_mul(Dimension::ANGLE).unwrap();
        assert_eq!(units.internal_factor(arc), 0.3048);
        assert!((units.to_reported(std::f64::consts::PI, arc) - 200.0).abs() < 1e-13);
    }

    #[test]
    fn symbols_are_units() {
        let units = Units::default().with(Base::Angle, "\"").unwrap();
        let area = Dimension::LENGTH.pow(-2.0).unwrap();
        for dimension in [Dimension::NUMBER, Dimension::ANGLE, area, Dimension::MASS.sqrt().unwrap()] {
            let symbol = units.symbol(dimension);
            assert_eq!(Unit::parse(&symbol), Ok(units.unit(dimension)), "{symbol}");
        }
        assert_eq!(units.symbol(Dimension::LENGTH.checked_div(Dimension::TIME).unwrap()), "mm/s");
        assert_eq!(units.symbol(Dimension::NUMBER), "1");
    }

    #[test]
    fn refused() {
        let message = |base, symbol| Units::default().with(base, symbol).unwrap_err().to_string();
        assert_eq!(message(Base::Length, "deg"), "`deg` is a unit of angle, not of length");
        assert_eq!(message(Base::Length, "mm*mm"), "`mm*mm` is a unit of length^2, not of length");
        assert_eq!(message(Base::Time, "sek"), "`sek` is not a unit");
    }
}
