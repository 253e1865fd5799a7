//! Dimensions: products of powers of length, angle, time, mass and temperature.

use std::fmt;

/// A base dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Base {
    /// In SI the metre.
    Length,
    /// In SI the radian, which is the number 1: see [`Dimension::compatible`].
    Angle,
    /// In SI the second.
    Time,
    /// In SI the kilogram.
    Mass,
    /// In SI the kelvin.
    Temperature,
}

impl Base {
    /// All of them, in the order of their declaration.
    pub const ALL: [Base; 5] = [Base::Length, Base::Angle, Base::Time, Base::Mass, Base::Temperature];

    /// The name in messages and in the model file, `length`.
    pub fn name(self) -> &'static str {
        match self {
            Base::Length => "length",
            Base::Angle => "angle",
            Base::Time => "time",
            Base::Mass => "mass",
            Base::Temperature => "temperature",
        }
    }
}

/// The dimension of a quantity: an exponent for every [`Base`], counted in halves so that square roots stay exact.
///
/// Operations whose exponents can no longer be written (beyond ±64, or finer than a half) give `None`.
///
/// ```
/// use phical::unit::Dimension;
///
/// let area = Dimension::LENGTH.pow(2.0).unwrap();
/// assert_eq!(area.sqrt(), Some(Dimension::LENGTH));
/// assert_eq!(Dimension::LENGTH.checked_div(Dimension::TIME).unwrap().to_string(), "length/time");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Dimension {
    halves: [i8; 5],
}

impl Dimension {
    /// A plain number.
    pub const NUMBER: Dimension = Dimension { halves: [0; 5] };
    /// A length.
    pub const LENGTH: Dimension = Dimension::of(Base::Length);
    /// An angle.
    pub const ANGLE: Dimension = Dimension::of(Base::Angle);
    /// A time.
    pub const TIME: Dimension = Dimension::of(Base::Time);
    /// A mass.
    pub const MASS: Dimension = Dimension::of(Base::Mass);
    /// A temperature.
    pub const TEMPERATURE: Dimension = Dimension::of(Base::Temperature);

    /// The first power of a base dimension.
    pub const fn of(base: Base) -> Dimension {
        let halves = match base {
            Base::Length => [2, 0, 0, 0, 0],
            Base::Angle => [0, 2, 0, 0, 0],
            Base::Time => [0, 0, 2, 0, 0],
            Base::Mass => [0, 0, 0, 2, 0],
            Base::Temperature => [0, 0, 0, 0, 2],
        };
        Dimension { halves }
    }

    /// Twice the exponent of each [`Base`], in the order of [`Base::ALL`].
    pub fn halves(self) -> [i8; 5] {
        self.halves
    }

    /// The dimension of a product.
    #[must_use]
    pub fn checked_mul(self, other: Dimension) -> Option<Dimension> {
        self.zip(other, i8::checked_add)
    }

    /// The dimension of a quotient.
    #[must_use]
    pub fn checked_div(self, other: Dimension) -> Option<Dimension> {
        self.zip(other, i8::checked_sub)
    }

    /// The dimension of a power; `None` where an exponent would be no multiple of a half.
    #[must_use]
    pub fn pow(self, exponent: f64) -> Option<Dimension> {
        let mut halves = [0; 5];
        for (new, old) in halves.iter_mut().zip(self.halves) {
            if old != 0 {
                let product = f64::from(old) * exponent;
                let whole = product.fract() == 0.0 && product.abs() <= f64::from(i8::MAX);
                *new = if whole { product as i8 } else { return None };
            }
        }
        Some(Dimension { halves })
    }

    /// The dimension of a square root.
    #[must_use]
    pub fn sqrt(self) -> Option<Dimension> {
        self.pow(0.5)
    }

    /// Whether this is a plain number; an angle is none, see [`Dimension::without_angle`].
    pub fn is_number(self) -> bool {
        self == Dimension::NUMBER
    }

    /// The same with angles taken for the plain numbers they are.
    #[must_use]
    pub fn without_angle(self) -> Dimension {
        let [length, _, time, mass, temperature] = self.halves;
        Dimension { halves: [length, 0, time, mass, temperature] }
    }

    /// Whether both are equal when angles are taken for plain numbers, as an arc is a radius times an angle.
    pub fn compatible(self, other: Dimension) -> bool {
        self.without_angle() == other.without_angle()
    }

    /// With its article: `a length`, `an angle`.
    pub fn noun(self) -> String {
        let name = self.to_string();
        let article = if name.starts_with('a') { "an" } else { "a" };
        format!("{article} {name}")
    }

    /// The product with one symbol per base dimension: `mm/s^2`, `1/s`, `m^0.5`; `number` where nothing is left.
    pub(super) fn write(self, symbols: [&str; 5], number: &str) -> String {
        let mut over = String::new();
        let mut under = String::new();
        for (symbol, halves) in symbols.into_iter().zip(self.halves) {
            let size = halves.unsigned_abs();
            if halves > 0 {
                over += if over.is_empty() { "" } else { "*" };
                over += &power(symbol, size);
            } else if halves < 0 {
                under += "/";
                under += &power(symbol, size);
            }
        }
        match (over.is_empty(), under.is_empty()) {
            (true, true) => number.to_owned(),
            (true, false) => format!("1{under}"),
            (false, _) => over + &under,
        }
    }

    fn zip(self, other: Dimension, op: impl Fn(i8, i8) -> Option<i8>) -> Option<Dimension> {
        let mut halves = self.halves;
        for (a, b) in halves.iter_mut().zip(other.halves) {
            *a = op(*a, b)?;
        }
        Some(Dimension { halves })
    }
}

/// `symbol` to the power `halves / 2`.
fn power(symbol: &str, halves: u8) -> String {
    match halves {
        2 => symbol.to_owned(),
        _ => format!("{symbol}^{}", f64::from(halves) / 2.0),
    }
}

/// `length`, `length/time`, `1/time^2`, `length^0.5`, `number`.
impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.write(Base::ALL.map(Base::name), "number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_powers() {
        let speed = Dimension::LENGTH.checked_div(Dimension::TIME).unwrap();
        assert_eq!(speed.checked_mul(Dimension::TIME), Some(Dimension::LENGTH));
        assert_eq!(speed.pow(0.0), Some(Dimension::NUMBER));
        assert_eq!(speed.pow(-1.0), Dimension::TIME.checked_div(Dimension::LENGTH));
        let volume = Dimension::LENGTH.pow(3.0).unwrap();
        assert_eq!(volume.pow(1.0 / 3.0), Some(Dimension::LENGTH));
        assert_eq!(volume.sqrt().and_then(|d| d.pow(2.0)), Some(volume));
    }

    #[test]
    fn what_cannot_be_written_is_refused() {
        assert_eq!(Dimension::LENGTH.sqrt().and_then(Dimension::sqrt), None);
        for exponent in [0.3, 64.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Dimension::LENGTH.pow(exponent), None, "{exponent}");
            let far = Dimension::NUMBER.pow(exponent);
            assert_eq!(far, Some(Dimension::NUMBER), "{exponent}");
        }
        let far = Dimension::LENGTH.pow(63.0).unwrap();
        assert_eq!(far.checked_mul(Dimension::LENGTH), None);
    }

    #[test]
    fn angles_are_numbers() {
        let arc = Dimension::LENGTH.checked_mul(Dimension::ANGLE).unwrap();
        assert!(arc.compatible(Dimension::LENGTH) && arc != Dimension::LENGTH);
        assert!(!Dimension::ANGLE.is_number() && Dimension::ANGLE.without_angle().is_number());
        assert!(!arc.compatible(Dimension::TIME));
    }

    #[test]
    fn display() {
        let text = |over: Dimension, under: Dimension| over.checked_div(under).unwrap().to_string();
        assert_eq!(text(Dimension::NUMBER, Dimension::NUMBER), "number");
        assert_eq!(text(Dimension::ANGLE, Dimension::NUMBER), "angle");
        assert_eq!(text(Dimension::LENGTH, Dimension::TIME.pow(2.0).unwrap()), "length/time^2");
        assert_eq!(text(Dimension::NUMBER, Dimension::TIME), "1/time");
        assert_eq!(text(Dimension::LENGTH.sqrt().unwrap(), Dimension::NUMBER), "length^0.5");
        let both = Dimension::TIME.checked_mul(Dimension::TEMPERATURE).unwrap();
        assert_eq!(text(Dimension::MASS.checked_mul(Dimension::LENGTH).unwrap(), both), "length*mass/time/temperature");
    }
}
