//! What a wrong derivative looks like.

use std::f64::consts::PI;

/// A number beside the exact one, and what rounding allows between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// As given.
    pub given: f64,
    /// As it is.
    pub exact: f64,
    /// What rounding allows.
    pub allowed: f64,
}

/// A guess at what is wrong with a set of numbers, all of one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// They are those of the other sign.
    Negative,
    /// They are all zero.
    Zero,
    /// They are a constant multiple, which has no name.
    Factor(f64),
    /// They are a constant multiple, of either sign, for a reason: `per degree instead of per radian`.
    Scale(f64, &'static str),
    /// They are not defined.
    Undefined,
}

/// Multiples with a name. The factor is given over exact.
const SCALES: &[(f64, &str)] = &[
    (2.0, "twice as large"),
    (0.5, "half as large"),
    (PI / 180.0, "per degree instead of per radian"),
    (180.0 / PI, "in degrees instead of radians"),
    (PI / 200.0, "per gon instead of per radian"),
    (200.0 / PI, "in gon instead of radians"),
    (PI / 180.0 / 3600.0, "per arc second instead of per radian"),
    (180.0 / PI * 3600.0, "in arc seconds instead of radians"),
    (
        1e-3,
        "a thousandth: per millimetre or milliradian instead of per metre or radian, or metres instead of millimetres",
    ),
    (1e3, "a thousand times as large: in millimetres or milliradians instead of metres or radians"),
    (1e-6, "a millionth"),
    (1e6, "a million times as large"),
    (25.4, "in millimetres instead of inches"),
    (1.0 / 25.4, "in inches instead of millimetres"),
];

impl Cause {
    /// The cause of a constant multiple.
    pub fn of_factor(factor: f64) -> Cause {
        match factor {
            0.0 => Cause::Zero,
            -1.0 => Cause::Negative,
            _ => {
                let known = SCALES.iter().find(|(scale, _)| (factor.abs() / scale - 1.0).abs() < 1e-6);
                known.map_or(Cause::Factor(factor), |(scale, words)| Cause::Scale(scale.copysign(factor), words))
            }
        }
    }

    /// What it says of something, in words.
    pub fn sentence(&self) -> String {
        format!("it {}", self.predicate(false))
    }

    /// The same of one or many: `are the negative`.
    pub fn predicate(&self, many: bool) -> String {
        let verb = if many { "are" } else { "is" };
        match self {
            Cause::Negative => format!("{verb} the negative"),
            Cause::Zero => format!("{verb} zero"),
            Cause::Factor(factor) => format!("{verb} {factor:.6} times what {verb} right, everywhere"),
            Cause::Scale(factor, words) if *factor < 0.0 => format!("{verb} {words}, and the negative"),
            Cause::Scale(_, words) => format!("{verb} {words}"),
            Cause::Undefined => format!("{verb} undefined where the derivative is not"),
        }
    }
}

/// The multiple with a name, of either sign, that a factor is within a share of; 1 and 0 are such.
pub(super) fn named_factor(factor: f64, within: f64) -> Option<f64> {
    if factor == 0.0 {
        return Some(0.0);
    }
    let names = std::iter::once(1.0).chain(SCALES.iter().map(|(scale, _)| *scale));
    names.flat_map(|scale| [scale, -scale]).find(|scale| (factor / scale - 1.0).abs() <= within)
}

/// What a set of numbers looks like beside the exact ones; none where nothing simple is seen.
pub fn cause(all: &[Seen]) -> Option<Cause> {
    if all.iter().any(|one| !one.given.is_finite()) {
        return Some(Cause::Undefined);
    }
    let telling: Vec<&Seen> = all.iter().filter(|one| one.exact.abs() > 1e3 * one.allowed).collect();
    if telling.is_empty() {
        return None;
    }
    if all.iter().all(|one| one.given.abs() <= one.allowed) {
        return Some(Cause::Zero);
    }
    // the multiple that most speaks for
    let best = telling.iter().max_by(|a, b| (a.exact.abs() / a.allowed).total_cmp(&(b.exact.abs() / b.allowed)))?;
    let factor = best.given / best.exact;
    let fits = |factor: f64, one: &Seen| {
        (one.given - factor * one.exact).abs() <= one.allowed * (1.0 + factor.abs()) + 1e-9 * one.given.abs()
    };
    if factor == 0.0 || !all.iter().all(|one| fits(factor, one)) {
        return None;
    }
    Some(if (factor + 1.0).abs() < 1e-9 { Cause::Negative } else { Cause::of_factor(factor) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(pairs: &[(f64, f64)]) -> Vec<Seen> {
        pairs.iter().map(|&(given, exact)| Seen { given, exact, allowed: 1e-13 }).collect()
    }

    #[test]
    fn simple_causes_have_names() {
        let truth = [3.0, -0.2, 17.5, 0.0];
        let scaled = |factor: f64| seen(&truth.map(|x| (factor * x, x)));
        assert_eq!(cause(&scaled(-1.0)), Some(Cause::Negative));
        assert_eq!(cause(&scaled(0.0)), Some(Cause::Zero));
        assert!(matches!(cause(&scaled(180.0 / PI)), Some(Cause::Scale(_, "in degrees instead of radians"))));
        assert!(matches!(cause(&scaled(1.7)), Some(Cause::Factor(f)) if (f - 1.7).abs() < 1e-12));
        let mut off = scaled(2.0);
        off[2].given += 1e-3;
        assert_eq!(cause(&off), None);
        off[2].given = f64::NAN;
        assert_eq!(cause(&off), Some(Cause::Undefined));
        assert_eq!(cause(&seen(&[(1.0, 0.0)])), None);
    }
}
