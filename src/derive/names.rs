//! By what one differentiates: names of parameters and inputs as leaves.

use crate::compile::{Measurement, Program};
use crate::diag::{Code, Diagnostic, Diagnostics, nearest};
use crate::graph::{Graph, Scalar};

/// A coordinate of a parameter, or an input, as a measurement uses it.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    pub(super) name: String,
    pub(super) leaf: Scalar,
    pub(super) free: bool,
}

/// All coordinates of parameters that a measurement uses, in the order of their declaration; members of families by the columns of
/// their keys.
pub(super) fn coordinates(program: &Program, measurement: &Measurement, graph: &Graph) -> Vec<Leaf> {
    let mut all = Vec::new();
    let mut slots: Vec<_> = measurement.slots.iter().collect();
    slots.sort_by_key(|slot| slot.parameter);
    for slot in slots {
        let Some(parameter) = program.parameters.get(slot.parameter) else { continue };
        let keys: Vec<&str> =
            slot.keys.iter().filter_map(|&key| measurement.keys.get(key)).map(String::as_str).collect();
        let name =
            if keys.is_empty() { parameter.name.clone() } else { format!("{}[{}]", parameter.name, keys.join(", ")) };
        for (i, suffix) in parameter.shape.suffixes().iter().enumerate() {
            let leaf = slot.first_leaf + parameter.shape.tangent_leaf(i);
            if let Some(leaf) = graph.known_parameter(leaf as u32) {
                all.push(Leaf { name: format!("{name}{suffix}"), leaf, free: parameter.setting.is_free(i) });
            }
        }
    }
    all
}

/// The leaves of some names, of parameters or inputs.
///
/// # Errors
/// Names that the measurement does not use.
pub(super) fn chosen(
    names: &[String],
    program: &Program,
    measurement: &Measurement,
    graph: &Graph,
) -> Result<Vec<Leaf>, Diagnostics> {
    let mut known = coordinates(program, measurement, graph);
    for (i, input) in measurement.inputs.iter().enumerate() {
        let leaf = graph.known_input(i as u32);
        known.extend(leaf.map(|leaf| Leaf { name: input.name.clone(), leaf, free: false }));
    }
    let mut diagnostics = Diagnostics::new();
    let mut found = Vec::new();
    for name in names {
        // `socket[front/0].x` and `socket[hole].x` are one formula
        let alike =
            |leaf: &&Leaf| leaf.name == *name || (without_key(&leaf.name) == without_key(name) && name.contains('['));
        match known.iter().find(alike) {
            Some(leaf) => found.push(leaf.clone()),
            None => {
                let message = format!("`{}` does not depend on a `{name}`", measurement.name);
                let hint = nearest(name, known.iter().map(|leaf| leaf.name.as_str()));
                let hint = hint.map(|near| format!("did you mean `{near}`?"));
                diagnostics.push(Diagnostic::error(Code::UnknownName, message).maybe_hint(hint));
            }
        }
    }
    if diagnostics.has_errors() { Err(diagnostics) } else { Ok(found) }
}

fn without_key(name: &str) -> String {
    match (name.split_once('['), name.rsplit_once(']')) {
        (Some((family, _)), Some((_, component))) => format!("{family}{component}"),
        _ => name.to_owned(),
    }
}
