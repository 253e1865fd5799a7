//! From a graph of scalar operations to steps over blocks of rows.
//!
//! What does not vary with the row is computed once per iteration, by plain numbers (*uniforms*). The rest becomes steps on
//! slots, each slot holding one number of every row of a block. On the way products are fused with the sums they go into,
//! negations vanish into signs, sine and cosine of an angle become one step, like steps come together, and slots are used again
//! as soon as they are free.

use super::plan::Planner;
use super::{group, slots};
use crate::graph::{Counts, Graph, Operation, Scalar};

/// Where an operand stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// a slot: one number for each row
    Slot(u32),
    /// a number that is the same for all rows
    Uniform(u32),
    /// an output: one number for each row
    Output(u32),
}

/// Products that a sum has at most.
pub(super) const MOST_PRODUCTS: usize = 3;

/// Sums that are one step at most.
pub(super) const MOST_SUMS: usize = 3;

/// Operands that a step has at most.
pub(super) const MOST_OPERANDS: usize = MOST_PRODUCTS + MOST_SUMS * (MOST_PRODUCTS + 1);

/// What a step does. A result may be the opposite of a node's value; whoever uses it knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Action {
    /// Σ aᵢbᵢ \[+ c\], one or several sums that share their factors b: first products whose a are uniforms, which carry their
    /// signs, then positive ones, then negative ones. The operands are the b, then of each sum the a and the addend.
    Sum { uniform: u8, positive: u8, negative: u8, addend: Addend, sums: u8 },
    /// x + y
    Add,
    /// x − y
    Sub,
    /// x/y
    Div,
    /// −x
    Neg,
    /// x
    Copy,
    /// √x
    Sqrt,
    /// sin x, and cos x as the second result
    SinCos,
    /// a row of the table of operations, number by number
    Call(Operation),
}

/// What is added to the products of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Addend {
    None,
    PerRow,
    Uniform,
}

impl Action {
    /// How many operations it is, where a product and the sum it goes into are one.
    pub(super) fn operations(self) -> usize {
        match self {
            Action::Sum { uniform, positive, negative, sums, .. } => {
                usize::from((uniform + positive + negative) * sums)
            }
            Action::SinCos => 2,
            Action::Copy => 0,
            _ => 1,
        }
    }

    /// How many operands and results it has.
    fn size(self) -> (usize, usize) {
        match self {
            Action::Sum { uniform, positive, negative, addend, sums } => {
                let (products, sums) = (usize::from(uniform + positive + negative), usize::from(sums));
                (products + sums * (products + usize::from(addend != Addend::None)), sums)
            }
            Action::Add | Action::Sub | Action::Div | Action::Call(_) => (2, 1),
            Action::SinCos => (1, 2),
            Action::Neg | Action::Copy | Action::Sqrt => (1, 1),
        }
    }
}

/// One step. Operands that an action does not need are the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub(super) action: Action,
    pub(super) operands: [Place; MOST_OPERANDS],
    /// of each sum; a sine's second one is the cosine; those that an action does not have are the first
    pub(super) results: [Place; MOST_SUMS],
}

impl Step {
    /// The operands that it has.
    pub(super) fn operands(&self) -> &[Place] {
        &self.operands[..self.action.size().0]
    }

    /// The results that it has.
    pub(super) fn results(&self) -> &[Place] {
        &self.results[..self.action.size().1]
    }

    /// What steps have in common that are done together: what they do, and which operand of two is a uniform, if any.
    pub(super) fn kind(&self) -> (Action, Option<usize>) {
        let uniform = match self.action {
            Action::Sum { .. } => None,
            _ => self.operands[..2].iter().position(|operand| matches!(operand, Place::Uniform(_))),
        };
        (self.action, uniform)
    }
}

/// An operation on uniforms; its result is the next uniform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Prepare {
    pub(super) operation: Operation,
    pub(super) x: u32,
    pub(super) y: u32,
}

/// A program over blocks of rows.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    /// how many parameters come first among the uniforms
    parameters: usize,
    constants: Vec<f64>,
    prepare: Vec<Prepare>,
    /// the slots below this are the inputs
    pub(super) inputs: usize,
    /// how many slots there are
    pub(super) slots: usize,
    pub(super) steps: Vec<Step>,
    pub(super) outputs: usize,
    counts: Counts,
}

impl Schedule {
    pub(super) fn new(graph: &Graph, outputs: &[Scalar]) -> Schedule {
        let plan = Planner::new(graph, outputs);
        let mut steps = group::like(&plan.steps);
        let slots = slots::assign(&mut steps, plan.inputs);
        let per_row = steps.iter().map(|step| step.action.operations()).sum::<usize>() - plan.unused;
        let counts = Counts { per_iteration: plan.prepare.len(), per_row };
        Schedule {
            parameters: plan.parameters,
            constants: plan.constants,
            prepare: plan.prepare,
            inputs: plan.inputs,
            slots,
            steps,
            outputs: outputs.len(),
            counts,
        }
    }

    /// Operations: once per iteration, and per row.
    pub(super) fn counts(&self) -> Counts {
        self.counts
    }

    /// How many uniforms there are.
    pub(super) fn uniforms(&self) -> usize {
        self.parameters + self.constants.len() + self.prepare.len()
    }

    /// The uniforms at a point. `parameters` has at least as many numbers as the graph has parameters.
    pub(super) fn prepare(&self, parameters: &[f64]) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.uniforms());
        all.extend_from_slice(&parameters[..self.parameters]);
        all.extend_from_slice(&self.constants);
        for step in &self.prepare {
            let value = step.operation.apply(&all[step.x as usize], &all[step.y as usize]);
            all.push(value);
        }
        all
    }
}
