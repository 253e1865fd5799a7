//! A column of names, each stored once.

use std::collections::HashMap;

#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    names: Vec<String>,
    known: HashMap<String, u32>,
    last: u32,
}

impl Names {
    /// The number of a name, new or known.
    pub(super) fn intern(&mut self, name: &str) -> u32 {
        // neighbouring rows mostly have the same name, or the next one of a cycle
        let next = if self.last as usize + 1 < self.names.len() { self.last + 1 } else { 0 };
        for likely in [self.last, next] {
            if self.names.get(likely as usize).is_some_and(|known| known == name) {
                self.last = likely;
                return likely;
            }
        }
        self.last = match self.known.get(name) {
            Some(&known) => known,
            None => {
                let number = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
                self.names.push(name.to_owned());
                self.known.insert(name.to_owned(), number);
                number
            }
        };
        self.last
    }

    /// In the order of their first appearance.
    pub(super) fn all(&self) -> &[String] {
        &self.names
    }
}
