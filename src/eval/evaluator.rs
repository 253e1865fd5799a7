use nalgebra::{Const, U1};
use num_dual::{Derivative, DualSVec64};

use crate::graph::{Tape, Undefined};

/// What a derivative is taken with respect to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaf {
    /// the parameter with this number
    Parameter(usize),
    /// the input with this number
    Input(usize),
}

/// Partials carried side by side in one dual number.
const LANES: usize = 8;

type Lanes = DualSVec64<LANES>;

/// Values and exact first derivatives of a tape's outputs, row after row.
///
/// ```
/// use phical::eval::{Evaluator, Leaf};
/// use phical::graph::{Graph, Tape};
/// let mut g = Graph::new();
/// let (q, x) = (g.parameter(0), g.input(0));
/// let y = g.mul(q, x);
/// let tape = Tape::lower(&g, &[y]);
/// let mut evaluator = Evaluator::new(&tape, vec![Leaf::Parameter(0), Leaf::Input(0)]);
/// evaluator.begin(&[3.0]);
/// let (mut value, mut derivative) = ([0.0], [0.0; 2]);
/// evaluator.row(&[5.0], &mut value, &mut derivative);
/// assert_eq!((value, derivative), ([15.0], [5.0, 3.0]));
/// ```
#[derive(Clone, Debug)]
pub struct Evaluator<'t> {
    tape: &'t Tape,
    leaves: Vec<Leaf>,
    /// one set of slots per group of [`LANES`] leaves
    lanes: Vec<Vec<Lanes>>,
    plain: Vec<f64>,
    parameters: Vec<f64>,
    inputs: Vec<Lanes>,
}

impl<'t> Evaluator<'t> {
    /// An evaluator of all outputs and their derivatives with respect to `leaves`, in that order.
    pub fn new(tape: &'t Tape, leaves: Vec<Leaf>) -> Self {
        Evaluator { tape, leaves, lanes: Vec::new(), plain: Vec::new(), parameters: Vec::new(), inputs: Vec::new() }
    }

    /// How many derivatives each output has.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// Sets the parameters, and runs what depends on them alone.
    pub fn begin(&mut self, parameters: &[f64]) {
        self.parameters.clear();
        self.parameters.extend_from_slice(parameters);
        self.plain = self.tape.begin(parameters);
        self.lanes = self
            .leaves
            .chunks(LANES)
            .map(|group| {
                let mut duals: Vec<Lanes> = parameters.iter().map(|&value| Lanes::from(value)).collect();
                for (lane, leaf) in group.iter().enumerate() {
                    if let Leaf::Parameter(index) = *leaf
                        && index < duals.len()
                    {
                        duals[index] = seeded(parameters[index], lane);
                    }
                }
                self.tape.begin(&duals)
            })
            .collect();
    }

    /// The outputs of one row.
    pub fn values(&mut self, inputs: &[f64], values: &mut [f64]) {
        self.tape.row(inputs, &mut self.plain);
        for (output, value) in values.iter_mut().enumerate() {
            *value = self.plain[self.tape.output_slot(output)];
        }
    }

    /// The outputs of one row, and their derivatives: `derivatives[output * leaves + leaf]`.
    pub fn row(&mut self, inputs: &[f64], values: &mut [f64], derivatives: &mut [f64]) {
        let width = self.leaves.len();
        if width == 0 {
            return self.values(inputs, values);
        }
        for (group, slots) in self.lanes.iter_mut().enumerate() {
            let leaves = &self.leaves[group * LANES..width.min((group + 1) * LANES)];
            self.inputs.clear();
            self.inputs.extend(inputs.iter().map(|&value| Lanes::from(value)));
            for (lane, leaf) in leaves.iter().enumerate() {
                if let Leaf::Input(index) = *leaf {
                    self.inputs[index] = seeded(inputs[index], lane);
                }
            }
            self.tape.row(&self.inputs, slots);
            for (output, value) in values.iter_mut().enumerate() {
                let result = &slots[self.tape.output_slot(output)];
                *value = result.re;
                let partials = result.eps.unwrap_generic(Const::<LANES>, U1);
                let into = &mut derivatives[output * width + group * LANES..][..leaves.len()];
                into.copy_from_slice(&partials.as_slice()[..leaves.len()]);
            }
        }
    }

    /// Why the outputs of this row, or their derivatives, are not numbers.
    pub fn undefined(&mut self, inputs: &[f64], derivatives: bool) -> Option<Undefined> {
        self.tape.row(inputs, &mut self.plain);
        self.tape.undefined(&self.plain, derivatives)
    }
}

fn seeded(value: f64, lane: usize) -> Lanes {
    let mut unit = nalgebra::SVector::<f64, LANES>::zeros();
    unit[lane] = 1.0;
    Lanes::new(value, Derivative::some(unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Graph;

    #[test]
    fn derivatives_cross_the_border_between_groups_of_lanes() {
        let mut g = Graph::new();
        let n = 19;
        let x = g.input(0);
        let mut sum = g.constant(0.0);
        for i in 0..n {
            let (q, weight) = (g.parameter(i), g.constant(f64::from(i)));
            let term = g.mul(q, weight);
            let term = g.mul(term, x);
            sum = g.add(sum, term);
        }
        let tape = Tape::lower(&g, &[sum, x]);
        let mut leaves: Vec<Leaf> = (0..n as usize).map(Leaf::Parameter).collect();
        leaves.push(Leaf::Input(0));
        let mut evaluator = Evaluator::new(&tape, leaves);
        evaluator.begin(&vec![1.0; n as usize]);
        let (mut values, mut derivatives) = ([0.0; 2], vec![9.0; 40]);
        evaluator.row(&[2.0], &mut values, &mut derivatives);
        assert_eq!(values, [342.0, 2.0]);
        for i in 0..19 {
            assert_eq!(derivatives[i], 2.0 * i as f64);
            assert_eq!(derivatives[20 + i], 0.0);
        }
        assert_eq!((derivatives[19], derivatives[39]), (171.0, 1.0));
    }
}
