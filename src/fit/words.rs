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
    /// Its value, in its unit.
    pub value: f64,
}

/// A squared weight beyond this makes a parameter one of those that the sentence is about.
const TELLING: f64 = super::NOT_ESTIMABLE;
/// Weights below this are not worth a word.
const TOLD: f64 = 0.0005;
/// Parameters that are named.
const MOST: usize = 8;
/// Amounts that differ by less than this are called equal.
const EQUAL: f64 = 0.02;
/// Amounts are in proportion to the values where their quotients differ by less.
const IN_PROPORTION: f64 = 1e-3;
/// So many at least: of two, what is left of a rotation may look like it.
const LEAST_IN_PROPORTION: usize = 3;

/// What cannot be known, and the movement that shows it: "`L1.b` and `R1.b` can only be known in difference: moving both by 1 mm
/// changes no residual". The parameter with the largest weight moves by one unit. Where all move in proportion to their values, it is a
/// scale that cannot be known.
///
/// ```
/// use phical::fit::{Term, sentence};
/// let term = |name: &str, weight| Term { name: name.into(), weight, tolerance: 0.1, unit: "mm".into(), value: 0.0 };
/// assert_eq!(
///     sentence(&[term("L1.b", 0.7), term("R1.b", 0.7)]),
///     "`L1.b` and `R1.b` can only be known in difference: moving both by 1 mm changes no residual"
/// );
/// ```
pub fn sentence(terms: &[Term]) -> String {
    let Some(moved) = Movement::new(terms) else { return "nothing is known of a combination".into() };
    let way = moved.way();
    match (&moved.telling[..], moved.minor.is_empty() && moved.more == 0) {
        ([alone], true) => format!("`{}` is seen by nothing: no residual changes with it", alone.name),
        ([alone], false) if !moved.scale => {
            format!("`{}` cannot be known: moving {way} changes no residual", alone.name)
        }
        _ => format!("{} can only be known in {}: moving {way} changes no residual", moved.names(), moved.kind()),
    }
}

/// The movement alone: "`a` and `b` both by 1 mm", "`a` by 1 mm and `b` by -0.5 mrad".
pub fn movement(terms: &[Term]) -> String {
    let Some(moved) = Movement::new(terms) else { return String::new() };
    match (&moved.telling[..], moved.is_together()) {
        (_, true) if moved.telling.len() > 1 || moved.scale => format!("{} {}", moved.names(), moved.way()),
        ([alone], _) => moved.way().replacen("it", &alone.quoted(), 1),
        _ => moved.way(),
    }
}

/// How far a parameter goes.
struct Part {
    name: String,
    amount: f64,
    unit: String,
}

impl Part {
    fn quoted(&self) -> String {
        format!("`{}`", self.name)
    }
}

struct Movement {
    /// Those that the sentence is about.
    telling: Vec<Part>,
    /// Others that move with them, as far as they are named.
    minor: Vec<Part>,
    /// How many are not.
    more: usize,
    /// Whether all move in proportion to their values.
    scale: bool,
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
        let telling = all.iter().take_while(|term| term.weight * term.weight > TELLING).count().max(1);
        let shown = all.len().min(MOST.max(telling));
        Some(Movement {
            telling: all[..telling].iter().map(part).collect(),
            minor: all[telling..shown].iter().map(part).collect(),
            more: all.len() - shown,
            scale: are_in_proportion(&all),
        })
    }

    /// Those that the sentence is about, by name.
    fn names(&self) -> String {
        match self.scale {
            true => counted(self.telling.iter().chain(&self.minor).map(Part::quoted).collect(), self.more),
            false => counted(self.telling.iter().map(Part::quoted).collect(), 0),
        }
    }

    /// Whether one amount is that of all.
    fn is_together(&self) -> bool {
        self.scale || self.alike() == (true, true)
    }

    /// Whether all go as far, and all the same way.
    fn alike(&self) -> (bool, bool) {
        let unit = &self.telling[0].unit;
        let as_far = |part: &Part| part.unit == *unit && (part.amount.abs() - 1.0).abs() < EQUAL;
        (self.telling.iter().all(as_far), self.telling.iter().all(|part| part.amount > 0.0))
    }

    fn kind(&self) -> &'static str {
        if self.scale {
            return "proportion";
        }
        match (self.alike(), self.telling.len()) {
            ((true, true), 2) => "difference",
            ((true, true), _) => "their differences",
            ((true, false), 2) => "sum",
            _ => "combination",
        }
    }

    fn way(&self) -> String {
        if self.scale {
            return "all by 0.1 % of themselves".into();
        }
        let each = |parts: &[Part]| -> Vec<String> {
            parts.iter().map(|part| format!("`{}` by {}", part.name, quantity(part.amount, &part.unit))).collect()
        };
        let mut way = match (&self.telling[..], self.alike()) {
            ([alone], _) => format!("it by {}", quantity(1.0, &alone.unit)),
            ([first, _], (true, true)) => format!("both by {}", quantity(1.0, &first.unit)),
            ([first, ..], (true, true)) => format!("all by {}", quantity(1.0, &first.unit)),
            (parts, _) => counted(each(parts), 0),
        };
        if !self.minor.is_empty() || self.more > 0 {
            way += &format!(", with {},", counted(each(&self.minor), self.more));
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

/// "a, b and c", of many the first, and how many more.
fn counted(mut names: Vec<String>, more: usize) -> String {
    let more = more + names.len().saturating_sub(MOST);
    names.truncate(MOST);
    if more > 0 {
        names.push(format!("{more} more"));
    }
    match &names[..] {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Whether all are of one unit and move by the same share of their values.
fn are_in_proportion(all: &[&Term]) -> bool {
    let [first, rest @ ..] = all else { return false };
    let share = |term: &Term| term.weight * term.tolerance / term.value;
    let of_first = share(first);
    let as_first = |term: &&Term| term.unit == first.unit && (share(term) / of_first - 1.0).abs() < IN_PROPORTION;
    all.len() >= LEAST_IN_PROPORTION && of_first.is_finite() && rest.iter().all(as_first)
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
            value: 0.0,
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
    fn many_are_counted() {
        let names: Vec<String> = (1..=11).map(|i| format!("p{i}")).collect();
        let all: Vec<(&str, f64, f64, &str)> = names.iter().map(|name| (name.as_str(), 0.3, 1.0, "mm")).collect();
        assert_eq!(
            of(&all),
            "`p1`, `p2`, `p3`, `p4`, `p5`, `p6`, `p7`, `p8` and 3 more can only be known in their differences: \
             moving all by 1 mm changes no residual"
        );
    }

    #[test]
    fn a_scale_is_called_so() {
        let term = |name: &str, value: f64, tolerance: f64| Term {
            name: name.into(),
            weight: value / tolerance / 1000.0,
            tolerance,
            unit: "mm".into(),
            value,
        };
        let mut all = [term("x", 600.0, 1.0), term("y", -148.3, 0.5), term("z", 52.6, 1.0)];
        assert_eq!(
            sentence(&all),
            "`x`, `y` and `z` can only be known in proportion: moving all by 0.1 % of themselves changes no residual"
        );
        assert_eq!(movement(&all), "`x`, `y` and `z` all by 0.1 % of themselves");
        all[1].weight *= 1.01;
        assert!(sentence(&all).contains("in combination"), "{}", sentence(&all));
    }

    #[test]
    fn movements_say_what_moves() {
        let term =
            |name: &str, weight| Term { name: name.into(), weight, tolerance: 1.0, unit: "mm".into(), value: 0.0 };
        assert_eq!(movement(&[term("a", 0.7), term("b", 0.7)]), "`a` and `b` both by 1 mm");
        assert_eq!(movement(&[term("a", 0.7), term("b", -0.7)]), "`a` by 1 mm and `b` by -1 mm");
        assert_eq!(movement(&[term("bit", 1.0)]), "`bit` by 1 mm");
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([1.0, -0.37512, 1234.0, 0.0, 12.5, 1e-7].map(short), ["1", "-0.375", "1234", "0", "12.5", "1.0e-7"]);
    }
}
