//! What the user frees, fixes and starts from.

use std::collections::HashSet;

use super::layout::Layout;
use crate::compile::{self, Program, Role};
use crate::diag::{Code, Diagnostic, Diagnostics, did_you_mean};

/// Changes to what the model says of its parameters.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Held at a value (with unit, as text), or else at the start value.
    pub fix: Vec<(String, Option<String>)>,
    /// Released.
    pub free: Vec<String>,
    /// Starting values in reported units; names of members that the data lack are passed over.
    pub start: Vec<(String, f64)>,
}

impl Selection {
    /// Applies the changes to a layout and to the point to start from.
    pub(super) fn apply(
        &self,
        program: &Program,
        layout: &mut Layout,
        point: &mut [f64],
        diagnostics: &mut Diagnostics,
    ) {
        for (name, value) in &self.start {
            match layout.find(name) {
                Some(c) => {
                    let coordinate = &layout.coordinates[c];
                    let unit = program.units.unit(coordinate.dimension);
                    point[c] = program.units.to_internal(*value, unit);
                }
                None if compile::coordinates(&program.parameters, name).is_empty() => {
                    diagnostics.push(unknown(program, name, Code::UnknownParameter));
                }
                None => {}
            }
        }
        for name in &self.free {
            let found = layout.matching(program, name);
            if found.is_empty() {
                diagnostics.push(unknown(program, name, Code::UnknownParameter));
            }
            for c in found {
                layout.coordinates[c].role = Role::Free;
            }
        }
        let mut valued = HashSet::new();
        for (name, value) in &self.fix {
            let found = layout.matching(program, name);
            if found.is_empty() {
                diagnostics.push(unknown(program, name, Code::UnknownParameter));
            }
            for c in found {
                let coordinate = &mut layout.coordinates[c];
                coordinate.role = Role::Held;
                if let Some(text) = value {
                    match compile::quantity(program, &format!("value of {name}"), text, coordinate.dimension) {
                        Ok(value) => {
                            point[c] = value;
                            valued.insert(c);
                        }
                        Err(mistakes) => diagnostics.extend(mistakes),
                    }
                }
            }
        }
        refuse_part_of_a_rotation(layout, &valued, diagnostics);
    }
}

/// A rotation turns by R·exp(ω), so a component of its vector keeps a value only where all three do.
fn refuse_part_of_a_rotation(layout: &Layout, valued: &HashSet<usize>, diagnostics: &mut Diagnostics) {
    for group in &layout.groups {
        let Some(first) = group.shape.rotation() else { continue };
        let all = group.first + first..group.first + first + 3;
        let part = all.clone().find(|c| valued.contains(c));
        let free = all.clone().any(|c| layout.coordinates[c].role == Role::Free);
        if let (Some(part), true) = (part, free) {
            let name = &layout.coordinates[part].name;
            let names: Vec<String> = all.map(|c| format!("`{}`", layout.coordinates[c].name)).collect();
            let message = format!("`{name}` cannot be held at a value while the rotation turns about other axes");
            let hint =
                format!("hold {} together, or leave the value out to hold the turn about that axis", names.join(", "));
            diagnostics.push(Diagnostic::error(Code::NotAdjustable, message).hint(hint));
        }
    }
}

fn unknown(program: &Program, name: &str, code: Code) -> Diagnostic {
    let names: Vec<&str> = program.parameters.iter().map(|p| p.name.as_str()).collect();
    let declared = program.constants.iter().any(|constant| constant == name);
    if declared {
        let message = format!("`{name}` is a constant or a tie of the model, not a parameter");
        return Diagnostic::error(Code::NotAdjustable, message).hint("declare it `Free(…)` or `Held(…)` in the model");
    }
    Diagnostic::error(code, format!("there is no parameter `{name}`"))
        .hint(did_you_mean(name, "parameters", &names).unwrap_or_else(|| "`phical check MODEL` lists them".to_owned()))
}
