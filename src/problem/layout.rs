//! The coordinates of all parameters and family members, in the order of their declaration.

use std::collections::HashMap;

use super::Undefined;
use crate::compile::{Program, Role, Shape};
use crate::diag::{Code, Diagnostic};
use crate::unit::Dimension;

/// One number of a parameter.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// `L1.alpha`, `socket[front/0].x`
    pub name: String,
    /// What it measures.
    pub dimension: Dimension,
    /// Whether it is estimated.
    pub role: Role,
    /// Where it starts, and the centre of its prior.
    pub nominal: f64,
    /// Its lower bound, −∞ where there is none.
    pub min: f64,
    /// Its upper bound, ∞ where there is none.
    pub max: f64,
    /// The standard deviation of its prior, where there is one.
    pub sigma: Option<f64>,
    /// What counts as known well enough.
    pub tolerance: f64,
    /// Its parameter or member.
    pub group: usize,
}

/// A parameter, or a member of a family.
#[derive(Clone, Debug)]
pub struct Group {
    /// Which parameter.
    pub parameter: usize,
    /// Which member, of a family.
    pub member: Option<String>,
    /// Its shape.
    pub shape: Shape,
    /// The number of its first coordinate.
    pub first: usize,
}

/// All coordinates, and the groups they come in.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// The coordinates.
    pub coordinates: Vec<Coordinate>,
    /// Parameters and members.
    pub groups: Vec<Group>,
    names: HashMap<String, usize>,
}

impl Layout {
    /// Lays out the parameters of a program. `members` are the keys of each family, by parameter number.
    pub(super) fn new(program: &Program, members: &[Vec<String>]) -> Self {
        let mut layout = Layout::default();
        for (index, parameter) in program.parameters.iter().enumerate() {
            if !parameter.family {
                layout.push(program, index, None);
                continue;
            }
            for member in &members[index] {
                layout.push(program, index, Some(member));
            }
        }
        layout
    }

    fn push(&mut self, program: &Program, index: usize, member: Option<&String>) {
        let parameter = &program.parameters[index];
        let setting = member.map_or(&parameter.setting, |key| parameter.member(key));
        let group = self.groups.len();
        let first = self.coordinates.len();
        self.groups.push(Group { parameter: index, member: member.cloned(), shape: parameter.shape, first });
        for (k, suffix) in parameter.shape.suffixes().iter().enumerate() {
            let name = match member {
                Some(key) => format!("{}[{key}]{suffix}", parameter.name),
                None => format!("{}{suffix}", parameter.name),
            };
            self.names.insert(name.clone(), self.coordinates.len());
            self.coordinates.push(Coordinate {
                name,
                dimension: parameter.dimensions[k],
                role: setting.roles[k],
                nominal: setting.nominal[k],
                min: setting.min[k],
                max: setting.max[k],
                sigma: setting.sigma[k],
                tolerance: setting.tolerance[k],
                group,
            });
        }
    }

    /// Whether a point has a number for each coordinate.
    ///
    /// # Errors
    /// Where it has fewer or more.
    pub(super) fn fits(&self, point: &[f64]) -> Result<(), Undefined> {
        let (wanted, found) = (self.coordinates.len(), point.len());
        if found == wanted {
            return Ok(());
        }
        let message = format!("the point has {found} numbers, and there are {wanted} coordinates");
        Err(Undefined(Box::new(Diagnostic::error(Code::FieldCount, message))))
    }

    /// The number of a coordinate.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.get(name).copied()
    }

    /// The group of a parameter, or of its member.
    pub(super) fn group(&self, parameter: usize, member: Option<&str>) -> Option<usize> {
        self.groups.iter().position(|group| group.parameter == parameter && group.member.as_deref() == member)
    }

    /// The coordinates that a name stands for: one, all of a vector or pose, or all of a family (`socket[*]`).
    pub fn matching(&self, program: &Program, name: &str) -> Vec<usize> {
        let found = crate::compile::coordinates(&program.parameters, name);
        let of_group = |group: &Group, wanted: &crate::compile::Coordinate| {
            group.parameter == wanted.parameter
                && (wanted.member == Some("*") || wanted.member == group.member.as_deref())
        };
        let mut all: Vec<usize> = found
            .iter()
            .flat_map(|wanted| {
                self.groups.iter().filter(|group| of_group(group, wanted)).map(|group| group.first + wanted.component)
            })
            .collect();
        all.sort_unstable();
        all
    }
}
