//! A straight line of scalar operations: what is left of a graph once geometry is lowered.

use super::lower::Lowering;
use super::{Graph, Node, Number, Operation, Scalar, Varies};

/// One operation on two slots; a unary one names its operand twice. Its result is the next slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// what is done
    pub operation: Operation,
    /// slot of the first operand
    pub x: u32,
    /// slot of the second
    pub y: u32,
}

/// How many operations run once per iteration, and how many once per row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// what depends on parameters alone
    pub per_iteration: usize,
    /// what depends on the row
    pub per_row: usize,
}

/// A straight-line program in two parts: what parameters alone decide, then what each row decides.
///
/// Slots are, in this order: parameters, inputs, constants, results. Every value is in its slot after a run, so that an
/// undefined operation can be named.
#[derive(Clone, Debug)]
pub struct Tape {
    parameters: usize,
    inputs: usize,
    constants: Vec<f64>,
    instructions: Vec<Instruction>,
    per_iteration: usize,
    outputs: Vec<u32>,
}

impl Tape {
    /// Lowers what the outputs need of a graph, and nothing else.
    pub fn lower(graph: &Graph, outputs: &[Scalar]) -> Tape {
        let mut lowering = Lowering::new(graph, &[]);
        let outputs = lowering.outputs(outputs);
        Tape::of_scalars(&lowering.to, &outputs)
    }

    fn of_scalars(graph: &Graph, outputs: &[Scalar]) -> Tape {
        let needed = graph.needed(outputs);
        let ids = || (0..graph.len()).filter(|&id| needed[id]);
        let (mut parameters, mut inputs, mut constants) = (0, 0, Vec::new());
        for id in ids() {
            match graph.node(id as u32) {
                Node::Parameter(index) => parameters = parameters.max(index as usize + 1),
                Node::Input(index) => inputs = inputs.max(index as usize + 1),
                Node::Constant(bits) => constants.push(f64::from_bits(bits)),
                _ => {}
            }
        }
        let mut slot = vec![0u32; graph.len()];
        let first_constant = parameters + inputs;
        let mut next_constant = first_constant as u32;
        for id in ids() {
            match graph.node(id as u32) {
                Node::Parameter(index) => slot[id] = index,
                Node::Input(index) => slot[id] = parameters as u32 + index,
                Node::Constant(_) => {
                    slot[id] = next_constant;
                    next_constant += 1;
                }
                _ => {}
            }
        }
        let mut instructions = Vec::new();
        let mut per_iteration = 0;
        for part in [Varies::PerIteration, Varies::PerRow] {
            for id in ids() {
                // an undefined constant, such as 1/0, is left to run, and to be named, with the parameters
                let varies = graph.node_varies(id as u32).max(Varies::PerIteration);
                if let (Node::Apply(operation, x, y), true) = (graph.node(id as u32), varies == part) {
                    slot[id] = next_constant + instructions.len() as u32;
                    instructions.push(Instruction { operation, x: slot[x.0 as usize], y: slot[y.0 as usize] });
                }
            }
            if part == Varies::PerIteration {
                per_iteration = instructions.len();
            }
        }
        let outputs = outputs.iter().map(|output| slot[output.0 as usize]).collect();
        Tape { parameters, inputs, constants, instructions, per_iteration, outputs }
    }

    /// How many operations there are.
    pub fn counts(&self) -> Counts {
        Counts { per_iteration: self.per_iteration, per_row: self.instructions.len() - self.per_iteration }
    }

    /// One more than the largest parameter number used.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// One more than the largest input number used.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// How many outputs there are.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// The instructions, those of the iteration first.
    pub fn instructions(&self) -> &[Instruction] {
        &self.instructions
    }

    /// Slots for a run over `T`, filled with the parameters and all that follows from them alone.
    ///
    /// `parameters` has at least [`Tape::parameters`] numbers.
    pub fn begin<T: Number>(&self, parameters: &[T]) -> Vec<T> {
        let mut slots = Vec::with_capacity(self.first_result() + self.instructions.len());
        slots.extend_from_slice(&parameters[..self.parameters]);
        slots.resize(self.parameters + self.inputs, T::from(0.0));
        slots.extend(self.constants.iter().map(|&value| T::from(value)));
        slots.resize(self.first_result() + self.instructions.len(), T::from(0.0));
        self.run(0..self.per_iteration, &mut slots);
        slots
    }

    /// Runs the row's part on slots that [`Tape::begin`] made. `inputs` has at least [`Tape::inputs`] numbers.
    pub fn row<T: Number>(&self, inputs: &[T], slots: &mut [T]) {
        slots[self.parameters..self.parameters + self.inputs].clone_from_slice(&inputs[..self.inputs]);
        self.run(self.per_iteration..self.instructions.len(), slots);
    }

    /// The slot of an output.
    pub fn output_slot(&self, output: usize) -> usize {
        self.outputs[output] as usize
    }

    /// All outputs at one point, for tests and single values.
    pub fn evaluate<T: Number>(&self, parameters: &[T], inputs: &[T]) -> Vec<T> {
        let mut slots = self.begin(parameters);
        self.row(inputs, &mut slots);
        self.outputs.iter().map(|&slot| slots[slot as usize].clone()).collect()
    }

    /// All outputs at one point over numbers of any kind: with what becomes of a constant, and of an operation.
    pub fn evaluate_by<T: Clone>(
        &self,
        parameters: &[T],
        inputs: &[T],
        constant: impl Fn(f64) -> T,
        mut apply: impl FnMut(Operation, &T, &T) -> T,
    ) -> Vec<T> {
        let mut slots = Vec::with_capacity(self.first_result() + self.instructions.len());
        slots.extend_from_slice(&parameters[..self.parameters]);
        slots.extend_from_slice(&inputs[..self.inputs]);
        slots.extend(self.constants.iter().map(|&value| constant(value)));
        for Instruction { operation, x, y } in &self.instructions {
            let result = apply(*operation, &slots[*x as usize], &slots[*y as usize]);
            slots.push(result);
        }
        self.outputs.iter().map(|&slot| slots[slot as usize].clone()).collect()
    }

    /// The first operation outside its domain in a run over `f64`, and which outputs it spoils. With `derivatives`, points where
    /// the value exists but its derivative does not count too.
    pub fn undefined(&self, slots: &[f64], derivatives: bool) -> Option<Undefined> {
        let first = self.first_result();
        self.instructions.iter().enumerate().find_map(|(i, instruction)| {
            let (x, y) = (slots[instruction.x as usize], slots[instruction.y as usize]);
            let row = instruction.operation.row();
            let varies = instruction.x as usize >= first || (instruction.x as usize) < self.parameters + self.inputs;
            let inside = (row.defined)(x, y) && (!derivatives || !varies || (row.smooth)(x, y));
            let result = slots[first + i];
            (!inside || !result.is_finite()).then(|| Undefined {
                operation: instruction.operation,
                x,
                y,
                spoils: self.depend_on(i),
            })
        })
    }

    /// The outputs that an instruction reaches.
    fn depend_on(&self, instruction: usize) -> Vec<usize> {
        let first = self.first_result();
        let mut reached = vec![false; first + self.instructions.len()];
        reached[first + instruction] = true;
        for (i, later) in self.instructions.iter().enumerate().skip(instruction + 1) {
            reached[first + i] = reached[later.x as usize] || reached[later.y as usize];
        }
        (0..self.outputs.len()).filter(|&output| reached[self.output_slot(output)]).collect()
    }

    /// Which parameters and inputs an output depends on at all: (parameters, inputs).
    pub fn dependencies(&self, output: usize) -> (Vec<bool>, Vec<bool>) {
        let first = self.first_result();
        let mut wanted = vec![false; first + self.instructions.len()];
        wanted[self.output_slot(output)] = true;
        for (i, instruction) in self.instructions.iter().enumerate().rev() {
            if wanted[first + i] {
                wanted[instruction.x as usize] = true;
                wanted[instruction.y as usize] = true;
            }
        }
        let inputs = wanted[self.parameters..self.parameters + self.inputs].to_vec();
        wanted.truncate(self.parameters);
        (wanted, inputs)
    }

    fn first_result(&self) -> usize {
        self.parameters + self.inputs + self.constants.len()
    }

    fn run<T: Number>(&self, part: std::ops::Range<usize>, slots: &mut [T]) {
        let first = self.first_result();
        for i in part {
            let Instruction { operation, x, y } = self.instructions[i];
            slots[first + i] = operation.apply(&slots[x as usize], &slots[y as usize]);
        }
    }
}

/// An operation that has no value, or no derivative, at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Undefined {
    /// the operation
    pub operation: Operation,
    /// its first operand's value
    pub x: f64,
    /// its second's
    pub y: f64,
    /// the outputs that depend on it
    pub spoils: Vec<usize>,
}
