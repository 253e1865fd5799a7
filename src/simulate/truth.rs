//! The true values of the parameters.

use std::collections::HashMap;

use super::draw::Stream;
use crate::compile::{Parameter, Program, Scenario, Slot, coordinates};

/// True values, drawn when they are first asked for; the values do not depend on the order of asking.
pub(super) struct Truth<'p> {
    program: &'p Program,
    scenario: &'p Scenario,
    seed: u64,
    known: HashMap<(usize, String), Vec<f64>>,
    /// members of families in the order of their appearance
    members: Vec<Vec<String>>,
}

impl<'p> Truth<'p> {
    pub(super) fn new(program: &'p Program, scenario: &'p Scenario, seed: u64) -> Self {
        let members = vec![Vec::new(); program.parameters.len()];
        Truth { program, scenario, seed, known: HashMap::new(), members }
    }

    /// The true numbers of a parameter, or of a member of a family.
    pub(super) fn values(&mut self, parameter: usize, member: &str) -> &[f64] {
        let (program, scenario, seed) = (self.program, self.scenario, self.seed);
        let of = &program.parameters[parameter];
        let members = &mut self.members[parameter];
        self.known.entry((parameter, member.to_owned())).or_insert_with(|| {
            members.push(member.to_owned());
            let mut values = of.member(member).nominal.clone();
            for (name, distribution) in &scenario.truth {
                for found in coordinates(&program.parameters, name) {
                    let meant = found.parameter == parameter
                        && found.member.is_none_or(|wanted| wanted == "*" || wanted == member);
                    if let (true, Some(value)) = (meant, values.get_mut(found.component)) {
                        let purpose = format!("truth {}", full_name(of, member, found.component));
                        *value = Stream::new(seed, &purpose).draw(distribution, found.component);
                    }
                }
            }
            values
        })
    }

    /// Fills in the leaves of slots, for a row with these names; leaves of perturbations stay zero.
    pub(super) fn fill(&mut self, slots: &[Slot], names: &[&str], leaves: &mut [f64]) {
        for slot in slots {
            let member = member(slot, names);
            let values = self.values(slot.parameter, &member);
            leaves[slot.first_leaf..slot.first_leaf + values.len()].copy_from_slice(values);
        }
    }

    /// Every coordinate of every parameter, and of every member that has been asked for, in reported units.
    pub(super) fn reported(mut self) -> Vec<(String, f64)> {
        let mut all = Vec::new();
        for (parameter, of) in self.program.parameters.iter().enumerate() {
            if !of.family {
                self.values(parameter, "");
            }
            for member in std::mem::take(&mut self.members[parameter]) {
                for (component, value) in self.values(parameter, &member).to_vec().into_iter().enumerate() {
                    let value = self.program.units.to_reported(value, of.dimensions[component]);
                    all.push((full_name(of, &member, component), value));
                }
            }
        }
        all
    }
}

/// The member that a row's names choose, empty where there is no family.
pub(super) fn member(slot: &Slot, names: &[&str]) -> String {
    slot.keys.iter().map(|&key| names.get(key).copied().unwrap_or("")).collect::<Vec<_>>().join("/")
}

fn full_name(of: &Parameter, member: &str, component: usize) -> String {
    let (name, suffix) = (&of.name, of.shape.suffixes()[component]);
    if of.family { format!("{name}[{member}]{suffix}") } else { format!("{name}{suffix}") }
}
