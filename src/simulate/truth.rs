//! The true values of the parameters.

use std::collections::HashMap;

use super::draw::Stream;
use crate::compile::{Distribution, Parameter, Program, Scenario, Slot, coordinates};

/// True values, drawn when they are first asked for; the values do not depend on the order of asking.
pub(super) struct Truth<'p> {
    program: &'p Program,
    scenario: &'p Scenario,
    seed: u64,
    known: HashMap<(usize, String), Vec<f64>>,
    /// members of families, and parameters, in the order of their appearance
    asked: Vec<(usize, String)>,
}

impl<'p> Truth<'p> {
    pub(super) fn new(program: &'p Program, scenario: &'p Scenario, seed: u64) -> Self {
        Truth { program, scenario, seed, known: HashMap::new(), asked: Vec::new() }
    }

    /// The true numbers of a parameter, or of a member of a family.
    pub(super) fn values(&mut self, parameter: usize, member: &str) -> &[f64] {
        let (program, scenario, seed) = (self.program, self.scenario, self.seed);
        let asked = &mut self.asked;
        self.known.entry((parameter, member.to_owned())).or_insert_with(|| {
            let Some(of) = program.parameters.get(parameter) else { return Vec::new() };
            asked.push((parameter, member.to_owned()));
            let mut values = of.member(member).nominal.clone();
            for (name, distribution) in &scenario.truth {
                for found in coordinates(&program.parameters, name) {
                    let meant = found.parameter == parameter
                        && found.member.is_none_or(|wanted| wanted == "*" || wanted == member);
                    if let (true, Some(value)) = (meant, values.get_mut(found.component)) {
                        let purpose = format!("truth {}", full_name(of, member, found.component));
                        let drawn = Stream::new(seed, &purpose).draw(distribution, found.component);
                        *value = if let Distribution::Around(_) = distribution { *value + drawn } else { drawn };
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
            leaves.iter_mut().skip(slot.first_leaf).zip(values).for_each(|(leaf, value)| *leaf = *value);
        }
    }

    /// Every coordinate of every parameter, and of every member that has been asked for, in reported units.
    pub(super) fn reported(mut self) -> Vec<(String, f64)> {
        let mut all = Vec::new();
        for (parameter, of) in self.program.parameters.iter().enumerate() {
            if !of.family {
                self.values(parameter, "");
            }
            let members = self.asked.iter().filter(|(asked, _)| *asked == parameter);
            for (values, member) in members.filter_map(|key| Some((self.known.get(key)?, &key.1))) {
                for (component, (&value, &dimension)) in values.iter().zip(&of.dimensions).enumerate() {
                    all.push((full_name(of, member, component), self.program.units.to_reported(value, dimension)));
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
    let (name, suffix) = (&of.name, of.shape.suffixes().get(component).copied().unwrap_or_default());
    if of.family { format!("{name}[{member}]{suffix}") } else { format!("{name}{suffix}") }
}
