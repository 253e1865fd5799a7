//! A direction that no residual sees, in words and units.

/// One parameter's part in a direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// `L1.b`
    pub name: String,
    /// Its component of the unit vector, in tolerances.
    pub weight: f64,
    /// Its tolerance, in its unit.
    pub tolerance: f64,
    /// Its unit.
    pub unit: String,
}

/// A squared weight beyond this makes a parameter one of those that the sentence is about.
const TELLING: f64 = super::NOT_ESTIMABLE;
/// Weights below this are not worth a word.
const TOLD: f64 = 0.0005;
/// Parameters that are named.
const MOST: usize = 8;
/// Amounts that differ by less than this are called equal.
const EQUAL: f64 = 0.02;

/// What cannot be known, and the movement that shows it: "`L1.b` and `R1.b` can only be known in difference: moving both by 1 mm
/// changes no residual". The parameter with the largest weight moves by one unit.
///
/// ```
/// use phical::fit::{Term, sentence};
/// let term = |name: &str, weight| Term { name: name.into(), weight, tolerance: 0.1, unit: "mm".into() };
/// assert_eq!(
///     sentence(&[term("L1.b", 0.7), term("R1.b", 0.7)]),
///     "`L1.b` and `R1.b` can only be known in difference: moving both by 1 mm changes no residual"
/// );
/// ```
pub fn sentence(terms: &[Term]) -> String {
    let Some(moved) = Movement::new(terms) else { return "nothing is known of a combination".into() };
    let names: Vec<&str> = moved.telling.iter().map(|part| part.name.as_str()).collect();
    let way = moved.way();
    match (&names[..], moved.minor.is_empty()) {
        ([alone], true) => format!("`{alone}` is seen by nothing: no residual changes with it"),
        ([alone], false) => format!("`{alone}` cannot be known: moving {way} changes no residual"),
        _ => format!("{} can only be known in {}: moving {way} changes no residual", list(&names), moved.kind()),
    }
}

/// The movement alone: "both by 1 mm", "`a` by 1 mm and `b` by -0.5 mrad".
pub fn movement(terms: &[Term]) -> String {
    Movement::new(terms).map_or_else(String::new, |moved| moved.way())
}

/// How far a parameter goes.
struct Part {
    name: String,
    amount: f64,
    unit: String,
}

struct Movement {
    telling: Vec<Part>,
    minor: Vec<Part>,
    more: usize,
}

impl Movement {
    fn new(terms: &[Term]) -> Option<Movement> {
        let mut all: Vec<&Term> = terms.iter().filter(|term| term.weight.abs() >= TOLD).collect();
        // in the order of their declaration where they are as large but for rounding
        all.sort_by_key(|term| std::cmp::Reverse((term.weight.abs() * 1e6).round() as u64));
        let first = all.first()?;
        let (_, per_unit) = told(&first.unit);
        let step = first.weight * first.tolerance * per_unit;
        let part = |term: &&Term| {
            let (unit, per_unit) = told(&term.unit);
            Part {
                name: term.name.clone(),
                amount: term.weight * term.tolerance * per_unit / step,
                unit: unit.to_owned(),
            }
        };
        let telling = all.iter().take_while(|term| term.weight * term.weight > TELLING).count().clamp(1, MOST);
        let shown = all.len().min(MOST.max(telling));
        Some(Movement {
            telling: all[..telling].iter().map(part).collect(),
            minor: all[telling..shown].iter().map(part).collect(),
            more: all.len() - shown,
        })
    }

    /// Whether all go as far, and all the same way.
    fn alike(&self) -> (bool, bool) {
        let unit = &self.telling[0].unit;
        let as_far = |part: &Part| part.unit == *unit && (part.amount.abs() - 1.0).abs() < EQUAL;
        (self.telling.iter().all(as_far), self.telling.iter().all(|part| part.amount > 0.0))
    }

    fn kind(&self) -> &'static str {
        match (self.alike(), self.telling.len()) {
            ((true, true), 2) => "difference",
            ((true, true), _) => "their differences",
            ((true, false), 2) => "sum",
            _ => "combination",
        }
    }

    fn way(&self) -> String {
        let each = |parts: &[Part]| -> Vec<String> {
            parts.iter().map(|part| format!("`{}` by {}", part.name, quantity(part.amount, &part.unit))).collect()
        };
        let mut way = match (&self.telling[..], self.alike()) {
            ([alone], _) => format!("it by {}", quantity(1.0, &alone.unit)),
            ([first, _], (true, true)) => format!("both by {}", quantity(1.0, &first.unit)),
            ([first, ..], (true, true)) => format!("all by {}", quantity(1.0, &first.unit)),
            (parts, _) => list_plain(&each(parts)),
        };
        if !self.minor.is_empty() {
            let mut minor = each(&self.minor);
            if self.more > 0 {
                minor.push(format!("{} more", self.more));
            }
            way += &format!(", with {},", list_plain(&minor));
        }
        way
    }
}

/// The unit that a movement is told in, and how many of it are one of the given.
fn told(unit: &str) -> (&str, f64) {
    match unit {
        "rad" => ("mrad", 1e3),
        "m" => ("mm", 1e3),
        "1" => ("", 1.0),
        other => (other, 1.0),
    }
}

fn quantity(amount: f64, unit: &str) -> String {
    let number = short(amount);
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// Three digits at most.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let decimals = 2 - value.abs().log10().floor() as i32;
    if !(-3..=6).contains(&decimals) {
        return format!("{value:.1e}");
    }
    let text = format!("{value:.*}", decimals.max(0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// `a`, `b` and `c`, in quotes.
fn list(names: &[&str]) -> String {
    list_plain(&names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>())
}

fn list_plain(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(all: &[(&str, f64, f64, &str)]) -> String {
        let term = |&(name, weight, tolerance, unit): &(&str, f64, f64, &str)| Term {
            name: name.into(),
            weight,
            tolerance,
            unit: unit.into(),
        };
        sentence(&all.iter().map(term).collect::<Vec<_>>())
    }

    #[test]
    fn directions_are_told_in_words() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert_eq!(
            of(&[("L1.a", 1e-6, 0.1, "mm"), ("L1.b", half, 0.1, "mm"), ("R1.b", half, 0.1, "mm")]),
            "`L1.b` and `R1.b` can only be known in difference: moving both by 1 mm changes no residual"
        );
        assert_eq!(
            of(&[("b", half, 0.1, "mm"), ("c", -half, 0.1, "mm")]),
            "`b` and `c` can only be known in sum: moving `b` by 1 mm and `c` by -1 mm changes no residual"
        );
        assert_eq!(of(&[("J7.d", 1.0, 0.1, "mm")]), "`J7.d` is seen by nothing: no residual changes with it");
        assert_eq!(of(&[]), "nothing is known of a combination");
        assert_eq!(
            of(&[("x", 0.8, 0.1, "mm"), ("turn", -0.6, 5e-5, "rad")]),
            "`x` and `turn` can only be known in combination: moving `x` by 1 mm and `turn` by -0.375 mrad changes no residual"
        );
        assert_eq!(
            of(&[("x", 0.999, 0.1, "m"), ("y", 0.03, 0.1, "m")]),
            "`x` cannot be known: moving it by 1 mm, with `y` by 0.03 mm, changes no residual"
        );
        let same: Vec<(&str, f64, f64, &str)> = ["a", "b", "c"].map(|name| (name, 0.577, 2.0, "1")).into();
        assert_eq!(
            of(&same),
            "`a`, `b` and `c` can only be known in their differences: moving all by 1 changes no residual"
        );
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([1.0, -0.37512, 1234.0, 0.0, 12.5, 1e-7].map(short), ["1", "-0.375", "1234", "0", "12.5", "1.0e-7"]);
    }
}
