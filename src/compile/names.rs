//! Names of parameters, members and coordinates, as people write them.

use super::program::Parameter;

/// A coordinate that a name stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coordinate<'n> {
    /// The parameter's number.
    pub parameter: usize,
    /// The member's key, for a family; `*` is all.
    pub member: Option<&'n str>,
    /// Which of its coordinates.
    pub component: usize,
}

/// The coordinates that a name stands for: `L1.alpha`, `target` (all of it), `target.x`, `socket[front/0].x`, `socket[*]`.
/// Empty where there is no such parameter.
pub fn coordinates<'n>(parameters: &[Parameter], name: &'n str) -> Vec<Coordinate<'n>> {
    let (base, member, suffix) = match name.split_once('[') {
        Some((base, rest)) => match rest.rsplit_once(']') {
            Some((member, suffix)) => (base, Some(member), suffix),
            None => return Vec::new(),
        },
        None => (name, None, ""),
    };
    for (index, parameter) in parameters.iter().enumerate() {
        let suffix = match (member, base.strip_prefix(parameter.name.as_str())) {
            (None, Some(suffix)) if !parameter.family => suffix,
            (Some(_), Some("")) if parameter.family => suffix,
            _ => continue,
        };
        let suffixes = parameter.shape.suffixes();
        let found: Vec<usize> = if suffix.is_empty() {
            (0..suffixes.len()).collect()
        } else {
            suffixes.iter().position(|&known| known == suffix).into_iter().collect()
        };
        if !found.is_empty() {
            return found.into_iter().map(|component| Coordinate { parameter: index, member, component }).collect();
        }
    }
    Vec::new()
}
