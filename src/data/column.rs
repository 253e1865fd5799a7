//! A column of readings as a file has it, and the numbers that phical computes with.

use crate::compile::Input;
use crate::unit::{Base, Conversion, TABLE, Unit, Units, nearest};

/// Converts between what stands in a column and internal units, from which the column's bias is subtracted.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    units: Units,
    unit: Unit,
    conversion: Conversion,
    bias: f64,
}

impl Column {
    /// The column of an input. One of degrees, minutes and seconds counts in radians here.
    #[must_use]
    pub fn new(units: &Units, input: &Input) -> Self {
        Column { units: *units, unit: input.unit, conversion: units.conversion(input.unit), bias: input.bias }
    }

    /// A number of the column in internal units, less the bias.
    #[must_use]
    pub fn to_internal(&self, value: f64) -> f64 {
        self.conversion.to_internal(value) - self.bias
    }

    /// The number of the column that [`to_internal`](Self::to_internal) takes to `reading`, or the nearest to it.
    #[must_use]
    pub fn from_internal(&self, reading: f64) -> f64 {
        nearest(self.units.from_internal(reading + self.bias, self.unit), reading, |value| self.to_internal(value))
    }

    /// The reading nearest to this one that the column can state.
    #[must_use]
    pub fn rounded(&self, reading: f64) -> f64 {
        self.to_internal(self.from_internal(reading))
    }
}

/// What a unit is called.
pub(super) fn symbol(unit: Unit, units: &Units) -> String {
    let same = |other: Unit| same(unit, other);
    if let Some(entry) = TABLE.iter().find(|entry| Unit::parse(entry.symbol).is_ok_and(same)) {
        return entry.symbol.to_owned();
    }
    let metre = Units::default().with(Base::Length, "m").unwrap_or_default();
    let known = [*units, Units::default(), metre].into_iter().find(|units| same(units.unit(unit.dimension)));
    match known {
        Some(units) => units.symbol(unit.dimension),
        None => format!("{} {}", unit.factor, metre.symbol(unit.dimension)),
    }
}

/// Whether two units are the same but for rounding.
pub(super) fn same(one: Unit, other: Unit) -> bool {
    one.dimension == other.dimension && (one.factor - other.factor).abs() <= 4.0 * f64::EPSILON * one.factor
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(unit: &str, bias: f64) -> Column {
        let (units, unit) = (Units::default(), Unit::parse(unit).unwrap());
        Column { units, unit, conversion: units.conversion(unit), bias }
    }

    #[test]
    fn what_a_column_states_is_found_again() {
        for unit in ["deg", "gon", "mrad", "m", "in", "s", "%", "km/h"] {
            for bias in [0.0, 0.125, -3e-4] {
                let column = column(unit, bias);
                let mut value = 1e-3;
                while value < 1e4 {
                    value *= 1.0437;
                    let reading = column.to_internal(value);
                    assert_eq!(column.to_internal(column.from_internal(reading)), reading, "{value} {unit} {bias}");
                    assert_eq!(column.rounded(reading), reading);
                }
            }
        }
    }

    /// Where adding the bias and dividing by the unit miss the number by rounding.
    #[test]
    fn neighbours_are_looked_at() {
        let column = column("deg", -3e-4);
        for value in [57.28305644510152, 14.321329811999988, 7.153003288652542] {
            let reading = column.to_internal(value);
            let plain = column.units.from_internal(reading + column.bias, column.unit);
            assert_ne!(column.to_internal(plain), reading);
            assert_eq!(column.to_internal(column.from_internal(reading)), reading);
        }
    }

    #[test]
    fn units_have_names() {
        for text in ["mm", "deg", "arcsec", "mm/s", "m/s", "1", "%"] {
            assert_eq!(symbol(Unit::parse(text).unwrap(), &Units::default()), text);
        }
        assert_eq!(symbol(Unit::parse("km/s").unwrap(), &Units::default()), "1000 m/s");
    }
}
