//! The model's constraints at a point: values and derivatives by the free coordinates.

use super::Problem;
use super::block::why;
use super::layout::Layout;
use super::solving::Undefined;
use crate::compile::{Constraint, Program};
use crate::diag::{Code, Diagnostic, Diagnostics, nearest};
use crate::graph::Operation;
use crate::solve::{self, Relation};

/// The share of the size of its terms by which a constraint among held parameters may be off: held values have been written
/// to some digits, and computed with.
const NEAR: f64 = 1e-9;

/// The constraints that free coordinates can meet or break.
#[derive(Clone, Debug, Default)]
pub(super) struct Conditions {
    /// The group of each slot.
    groups: Vec<usize>,
    /// The items of the program in which anything is free.
    active: Vec<usize>,
}

impl Conditions {
    /// The group of each slot; a member that no row names is a mistake.
    pub(super) fn groups(program: &Program, layout: &Layout, diagnostics: &mut Diagnostics) -> Option<Vec<usize>> {
        let mut groups = Vec::new();
        for slot in &program.constraints.slots {
            let group = layout.group(slot.parameter, slot.member.as_deref());
            if let (None, Some(key)) = (group, &slot.member) {
                let family = &program.parameters[slot.parameter].name;
                let members = layout.groups.iter().filter(|group| group.parameter == slot.parameter);
                let names: Vec<&str> = members.filter_map(|group| group.member.as_deref()).collect();
                let message = format!("a constraint names `{family}[{key}]`, and no row does");
                let hint = match nearest(key, names.iter().copied()) {
                    Some(near) => Some(format!("did you mean `{near}`?")),
                    None if program.measurements.iter().any(|m| m.keys.contains(key)) => {
                        Some(format!("`{key}` is a column of names; a constraint names the member itself"))
                    }
                    None => None,
                };
                let found = Diagnostic::error(Code::ConstraintMember, message).at(&program.source, slot.span);
                diagnostics.push(found.maybe_hint(hint));
            }
            groups.extend(group);
        }
        (groups.len() == program.constraints.slots.len()).then_some(groups)
    }

    pub(super) fn new(program: &Program, groups: Vec<usize>, layout: &Layout, free: &[usize]) -> Self {
        Conditions { groups, active: Vec::new() }.with_free(program, layout, free)
    }

    /// The same with other coordinates free.
    pub(super) fn with_free(&self, program: &Program, layout: &Layout, free: &[usize]) -> Self {
        let mut is_free = vec![false; layout.coordinates.len()];
        free.iter().for_each(|&c| is_free[c] = true);
        let touches = |item: &Constraint| self.coordinates(layout, item).any(|c| is_free[c]);
        // without groups they are left out
        let items = if self.groups.is_empty() { &[][..] } else { &program.constraints.items };
        let active = items.iter().enumerate().filter(|(_, item)| touches(item)).map(|(number, _)| number).collect();
        Conditions { groups: self.groups.clone(), active }
    }

    /// The coordinates of an item's columns.
    fn coordinates<'a>(&'a self, layout: &'a Layout, item: &'a Constraint) -> impl Iterator<Item = usize> + 'a {
        item.columns.iter().map(|&(slot, component)| layout.groups[self.groups[slot]].first + component)
    }

    fn leaves(&self, program: &Program, layout: &Layout, point: &[f64]) -> Vec<f64> {
        let mut leaves = vec![0.0; program.constraints.leaves];
        for (slot, &group) in program.constraints.slots.iter().zip(&self.groups) {
            let group = &layout.groups[group];
            let n = group.shape.dimension();
            leaves[slot.first_leaf..slot.first_leaf + n].copy_from_slice(&point[group.first..group.first + n]);
        }
        leaves
    }

    /// Reports those that held values break, and which no search can mend.
    pub(super) fn check_held(&self, program: &Program, layout: &Layout, point: &[f64], diagnostics: &mut Diagnostics) {
        let all = &program.constraints;
        if self.groups.is_empty() || self.active.len() == all.items.len() {
            return;
        }
        let leaves = self.leaves(program, layout, point);
        let (values, slopes) = (all.tape.evaluate(&leaves, &[]), all.derivatives.evaluate(&leaves, &[]));
        let mut first = 0;
        for (number, item) in all.items.iter().enumerate() {
            let slopes = &slopes[first..first + item.columns.len()];
            first += item.columns.len();
            if self.active.binary_search(&number).is_ok() {
                continue;
            }
            let (g, left, right) = (values[3 * number], values[3 * number + 1], values[3 * number + 2]);
            if !g.is_finite() {
                diagnostics.push(*undefined(program, number, &leaves, false).0);
                continue;
            }
            let off = if item.relation == Relation::Equal { g.abs() } else { g };
            let terms = self.coordinates(layout, item).zip(slopes).map(|(c, slope)| (slope * point[c]).abs());
            let size = left.abs() + right.abs() + terms.filter(|term| term.is_finite()).sum::<f64>();
            if off > NEAR * size {
                let shown = |value| program.units.shown(value, item.dimension);
                let message = format!(
                    "`{}` is not met by what is held: its sides are {} and {}, off by {}",
                    item.name,
                    shown(left),
                    shown(right),
                    shown(off)
                );
                let found = Diagnostic::error(Code::BrokenConstraint, message).at(&program.source, item.span);
                diagnostics.push(found.hint("free a parameter that it names, or correct a value"));
            }
        }
    }
}

impl<'p> Problem<'p> {
    /// The constraints in which anything is free, in the order in which solvers see them. Those among held parameters alone
    /// are met, or the problem could not have been bound.
    pub fn constrained(&self) -> impl ExactSizeIterator<Item = &'p Constraint> + '_ {
        let items = &self.program.constraints.items;
        self.conditions.active.iter().map(|&number| &items[number])
    }

    /// Values and gradients of [`Problem::constrained`] at a point.
    ///
    /// # Errors
    /// Where one of them is undefined there.
    pub fn linearised_constraints(&self, point: &[f64]) -> Result<Vec<solve::Constraint>, Undefined> {
        self.layout.fits(point)?;
        let Conditions { active, .. } = &self.conditions;
        if active.is_empty() {
            return Ok(Vec::new());
        }
        let all = &self.program.constraints;
        let leaves = self.conditions.leaves(self.program, &self.layout, point);
        let (values, slopes) = (all.tape.evaluate(&leaves, &[]), all.derivatives.evaluate(&leaves, &[]));
        let place = self.places();
        let mut found = Vec::with_capacity(active.len());
        let (mut first, mut active) = (0, active.iter().peekable());
        for (number, item) in all.items.iter().enumerate() {
            let slopes = &slopes[first..first + item.columns.len()];
            first += item.columns.len();
            if active.next_if(|&&next| next == number).is_none() {
                continue;
            }
            let (value, sides) = (values[3 * number], &values[3 * number + 1..3 * number + 3]);
            let mut magnitude = sides[0].abs() + sides[1].abs();
            let mut gradient = vec![0.0; self.free.len()];
            let mut defined = value.is_finite();
            for (coordinate, &slope) in self.conditions.coordinates(&self.layout, item).zip(slopes) {
                let size = slope.abs() * self.size(coordinate, point);
                if size.is_finite() {
                    magnitude += size;
                }
                if let Some(column) = place[coordinate] {
                    defined &= slope.is_finite();
                    gradient[column] += slope;
                }
            }
            if !defined {
                return Err(undefined(self.program, number, &leaves, true));
            }
            let (relation, magnitude) = (item.relation, magnitude.max(f64::MIN_POSITIVE));
            found.push(solve::Constraint { relation, value, gradient, magnitude });
        }
        Ok(found)
    }
}

/// Why an item has no value, or, with `derivatives`, no derivative.
fn undefined(program: &Program, number: usize, leaves: &[f64], derivatives: bool) -> Undefined {
    let all = &program.constraints;
    let mut slots = all.tape.begin(leaves);
    all.tape.row(&[], &mut slots);
    let found = [false, derivatives].into_iter().find_map(|derivatives| all.tape.undefined(&slots, derivatives));
    // the first operation of all may be that of another item
    let found = found.filter(|found| found.spoils.contains(&(3 * number)));
    let item = &all.items[number];
    let why = found.as_ref().map_or("it has no value or no derivative here".to_owned(), why);
    let message = format!("constraint `{}`: {why}", item.name);
    let hint = match found.map(|found| found.operation) {
        Some(Operation::AtLeast) => "the parameters are at the edge of what the model describes: start elsewhere",
        _ => "start elsewhere, or write the constraint so that it is defined there",
    };
    let found = Diagnostic::error(Code::UndefinedAtStart, message).at(&program.source, item.span);
    Undefined(Box::new(found.hint(hint)))
}
