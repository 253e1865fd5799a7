use super::kernel::{Code, ROWS, Run};
use super::schedule::Schedule;
use crate::graph::{Counts, Graph, Scalar};
use crate::simd::{Aligned, InstructionSet};

/// Scalars of a graph as a program over blocks of [`ROWS`] rows.
///
/// ```
/// use phical::eval::{Compiled, ROWS};
/// use phical::graph::{Graph, View, differentiate};
/// use phical::simd::InstructionSet;
/// let mut g = Graph::new();
/// let (q, x) = (g.parameter(0), g.input(0));
/// let y = g.mul(q, x);
/// let derived = differentiate(&g, &[y], &[q], &View::default());
/// let compiled = Compiled::new(&derived.graph, &[derived.values[0], derived.derivatives[0]], InstructionSet::detect());
///
/// let mut block = compiled.begin(&[3.0]);
/// block.input(0).copy_from_slice(&[5.0; ROWS]);
/// compiled.run(&mut block);
/// assert_eq!((block.output(0)[7], block.output(1)[7]), (15.0, 5.0));
/// ```
#[derive(Clone, Debug)]
pub struct Compiled {
    schedule: Schedule,
    code: Code,
    set: InstructionSet,
}

/// The numbers of one block.
#[derive(Clone, Debug, Default)]
pub struct Block {
    numbers: Aligned,
    slots: usize,
    outputs: usize,
}

impl Compiled {
    /// Compiles what the outputs need of a graph of scalar operations.
    pub fn new(graph: &Graph, outputs: &[Scalar], set: InstructionSet) -> Compiled {
        let schedule = Schedule::new(graph, outputs);
        let code = Code::new(&schedule);
        Compiled { schedule, code, set }
    }

    /// Operations: once per iteration, and per row. A fused product and sum are one, a sine or a cosine is one.
    pub fn counts(&self) -> Counts {
        self.schedule.counts()
    }

    /// One more than the largest number of an input.
    pub fn inputs(&self) -> usize {
        self.schedule.inputs
    }

    /// How many outputs there are.
    pub fn outputs(&self) -> usize {
        self.schedule.outputs
    }

    /// How many numbers of each row are kept at a time.
    pub fn slots(&self) -> usize {
        self.schedule.slots
    }

    /// A block whose rows have these parameters. There are at least as many of them as the graph has.
    pub fn begin(&self, parameters: &[f64]) -> Block {
        let layout = self.code.layout;
        // vectors behind the last one may be looked at, though not used
        let mut numbers = Aligned::zeros(layout.len + ROWS);
        let uniforms = self.schedule.prepare(parameters);
        numbers.as_mut_slice()[..uniforms.len()].copy_from_slice(&uniforms);
        Block { numbers, slots: layout.slots, outputs: layout.outputs }
    }

    /// Computes all outputs of the rows whose inputs are in the block, which this program has begun.
    pub fn run(&self, block: &mut Block) {
        self.set.run(Run { code: &self.code, numbers: block.numbers.as_mut_slice() });
    }
}

impl Block {
    /// The numbers of an input, to be set before a run.
    pub fn input(&mut self, input: usize) -> &mut [f64] {
        let first = self.slots + input * ROWS;
        &mut self.numbers.as_mut_slice()[first..first + ROWS]
    }

    /// The numbers of an output after a run.
    pub fn output(&self, output: usize) -> &[f64] {
        let first = self.outputs + output * ROWS;
        &self.numbers.as_slice()[first..first + ROWS]
    }

    /// Makes an output of the last run an input of the next.
    pub fn feed(&mut self, output: usize, input: usize) {
        let (from, to) = (self.outputs + output * ROWS, self.slots + input * ROWS);
        self.numbers.as_mut_slice().copy_within(from..from + ROWS, to);
    }

    /// Gives an input the numbers of another.
    pub fn copy_input(&mut self, from: usize, to: usize) {
        let (from, to) = (self.slots + from * ROWS, self.slots + to * ROWS);
        self.numbers.as_mut_slice().copy_within(from..from + ROWS, to);
    }

    /// All outputs, one after the other, which may be overwritten.
    pub fn outputs(&mut self) -> &mut [f64] {
        let end = self.numbers.as_slice().len() - ROWS;
        &mut self.numbers.as_mut_slice()[self.outputs..end]
    }
}
