//! Names of parameters, members and coordinates, as people write them.

use super::core;
use super::prelude::PRELUDE;
use super::program::Parameter;

/// Whether a name means something in the language already, so that a chain or a joint is better called otherwise.
pub fn is_taken(name: &str) -> bool {
    let of_prelude = |head: &str| head.split('(').next() == Some(name);
    name == "pi" || core::arity(name).is_some() || PRELUDE.iter().any(|(head, _)| of_prelude(head))
}

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

/// The coordinates that a name stands for: `L1.alpha`, `L1.*`, `target` (all of it), `target.x`, `socket[front/0].x`, `socket[*]`.
/// Empty where there is no such parameter.
pub fn coordinates<'n>(parameters: &[Parameter], name: &'n str) -> Vec<Coordinate<'n>> {
    if let Some(joint) = name.strip_suffix(".*") {
        let of_joint = |p: &Parameter| p.name.strip_prefix(joint).is_some_and(|rest| rest.starts_with('.'));
        let all = parameters.iter().enumerate().filter(|(_, p)| of_joint(p) && !p.family);
        let each = |(parameter, p): (usize, &Parameter)| {
            (0..p.shape.suffixes().len()).map(move |component| Coordinate { parameter, member: None, component })
        };
        return all.flat_map(each).collect();
    }
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
