//! Readings corrected until a row's equations hold: Gauss–Helmert steps on blocks of rows, each from where the last one led.
//!
//! Steps contract: each moves the readings by a share ρ of what the one before did; ρ is about the curvature of the equations
//! times the size of the errors. Where the next step would be δ long, the whitened equations differ from those at the end by
//! ρ δ in their gradient and by ρ δ² in their cost. Rows that do not get there, or whose equations depend on each other, are
//! left to be done [alone](super::alone).

use super::Problem;
use super::block::Block;
use super::noise::{Noise, Spread};
use super::pass::{Pass, Span};
use super::propagated::Places;
use super::robust::RowLoss;
use super::solving::Undefined;
use crate::diag::{Code, Diagnostic};
use crate::eval::{self, ROWS};

/// Steps of a block; rows that need more are done alone.
const STEPS: usize = 12;
/// The same where a loss changes weights on the way.
const STEPS_OF_LOSS: usize = 60;

/// What the gradient of a row may lack at the end, and what its cost may: shares of what the first step says they are, but at
/// least of what they are where a row is one standard deviation off.
const GRADIENT: f64 = 1e-9;
const COST: f64 = 1e-13;

/// What is wanted of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// readings at which whitened equations are right
    Readings,
    /// residuals whose squares are the cost
    Residuals,
}

/// Corrects the readings of blocks of rows at one point.
pub(super) struct Corrector<'a> {
    block: &'a Block<'a>,
    noise: &'a Noise,
    pass: Pass<'a>,
    /// The numbers of a step: its inputs are the corrected readings, its outputs those of the last step.
    pub(super) state: eval::Block,
    deviations: Option<(Pass<'a>, eval::Block)>,
    places: Places,
    /// the standard deviations that rows have of their own, before a loss changes them
    own: Vec<[f64; ROWS]>,
    loss: Option<&'a RowLoss>,
    /// Rows of the span that are to be done alone.
    pub(super) left: Vec<usize>,
}

impl<'a> Corrector<'a> {
    pub(super) fn new(problem: &'a Problem, block: &'a Block, noise: &'a Noise, point: &[f64]) -> Self {
        let set = problem.execution.instructions();
        let begin = |compiled| {
            let pass = Pass::new(block, compiled, &problem.layout, point);
            let state = pass.begin();
            (pass, state)
        };
        let (pass, state) = begin(block.seen.step(&block.programs, noise, &block.weights, set));
        let decided = noise.own.iter().any(|own| own.of.is_some());
        let deviations = decided.then(|| begin(block.seen.deviations(&block.programs, noise, set)));
        Corrector {
            block,
            noise,
            pass,
            state,
            deviations,
            places: Places::new(&block.seen, noise),
            own: vec![[0.0; ROWS]; noise.own.len()],
            loss: block.loss.as_ref().filter(|loss| loss.of_inputs()),
            left: Vec::new(),
        }
    }

    /// Corrects the readings of a span.
    pub(super) fn settle(&mut self, span: &Span, wanted: Wanted) -> Result<(), Undefined> {
        self.pass.fill(span.combination, span.readings, &mut self.state);
        self.read(span)?;
        let k = self.noise.inputs.len();
        let steps = match (k, self.loss) {
            (0, _) => 1,
            (_, None) => STEPS,
            (_, Some(_)) => STEPS_OF_LOSS,
        };
        let mut before = [f64::INFINITY; ROWS];
        let mut right = [false; ROWS];
        let mut first = [1.0f64; ROWS];
        for _ in 0..steps {
            self.pass.compiled().run(&mut self.state);
            let mut all = true;
            for (row, &square) in self.state.output(k)[..span.count].iter().enumerate() {
                let shift = square.sqrt();
                let mut rate = 1.0;
                if before[row].is_infinite() {
                    first[row] = shift.max(1.0);
                } else if before[row] > 0.0 {
                    rate = (shift / before[row]).min(1.0);
                }
                right[row] = match wanted {
                    Wanted::Readings => rate * rate * shift <= GRADIENT * first[row],
                    Wanted::Residuals => rate * shift * shift <= COST * first[row] * first[row],
                };
                // a row without numbers waits for nothing
                all &= right[row] || shift.is_nan();
                before[row] = shift;
            }
            if wanted == Wanted::Readings || !all {
                self.advance();
            }
            if all {
                break;
            }
        }
        self.left = (0..span.count).filter(|&row| !right[row]).collect();
        Ok(())
    }

    /// The standard deviations that a row has of its own.
    pub(super) fn own(&self, row: usize) -> Vec<f64> {
        self.own.iter().map(|of| of[row]).collect()
    }

    /// What a loss of each input adds to ½‖residuals‖² of a row after [`settle`](Self::settle).
    pub(super) fn beyond_squares(&mut self, row: usize) -> f64 {
        let Some(loss) = self.loss else { return 0.0 };
        let mut sum = 0.0;
        for (j, &(input, spread)) in self.noise.inputs.iter().enumerate() {
            let Spread::PerRow(own) = spread else { continue };
            let v = self.state.input(input)[row] - self.state.input(self.places.read + j)[row];
            let square = (v / self.own[own][row]).powi(2);
            sum += 0.5 * (loss.rho(square) - loss.weight_of_input(square) * square);
        }
        sum
    }

    /// Goes to the readings that come next.
    fn advance(&mut self) {
        for (j, &(input, _)) in self.noise.inputs.iter().enumerate() {
            self.state.feed(j, input);
        }
        let Some(loss) = self.loss else { return };
        for (j, &(input, spread)) in self.noise.inputs.iter().enumerate() {
            let Spread::PerRow(own) = spread else { continue };
            let read: [f64; ROWS] = std::array::from_fn(|row| self.state.input(self.places.read + j)[row]);
            let loosened: [f64; ROWS] = std::array::from_fn(|row| {
                let (v, sigma) = (self.state.input(input)[row] - read[row], self.own[own][row]);
                sigma / loss.weight_of_input((v / sigma).powi(2)).sqrt()
            });
            self.state.input(self.places.own + own).copy_from_slice(&loosened);
        }
    }

    /// The readings as read, and the standard deviations that rows have of their own.
    fn read(&mut self, span: &Span) -> Result<(), Undefined> {
        for (j, &(input, _)) in self.noise.inputs.iter().enumerate() {
            self.state.copy_input(input, self.places.read + j);
        }
        if let Some((pass, state)) = &mut self.deviations {
            pass.run(span.combination, span.readings, state);
        }
        let mut decided = 0;
        for (j, own) in self.noise.own.iter().enumerate() {
            match (own.of, &self.deviations) {
                (Some(_), Some((_, state))) => {
                    let found = state.output(decided);
                    self.own[j] = std::array::from_fn(|row| own.factor * found[row]);
                    decided += 1;
                }
                _ => self.own[j] = [own.factor; ROWS],
            }
            let bad = self.own[j][..span.count].iter().position(|sigma| !(*sigma > 0.0 && sigma.is_finite()));
            if let Some(row) = bad {
                return Err(bad_sigma(self.block, self.noise, j, span.first + row, self.own[j][row]));
            }
            self.state.input(self.places.own + j).copy_from_slice(&self.own[j]);
        }
        Ok(())
    }
}

/// A standard deviation that is none.
fn bad_sigma(block: &Block, noise: &Noise, own: usize, row: usize, sigma: f64) -> Undefined {
    let is = |spread: &Spread| *spread == Spread::PerRow(own);
    let measurement = block.measurement;
    let of_input = noise.inputs.iter().find(|(_, spread)| is(spread)).map(|(i, _)| &measurement.inputs[*i].name);
    let of_residual = || {
        let at = noise.residuals.iter().position(|spread| spread.as_ref().is_some_and(is))?;
        Some(&measurement.residuals[at].name)
    };
    let name = of_input.or_else(of_residual).map_or("", String::as_str);
    let message = format!("measurement `{}`, row {}: the sigma of `{name}` is {sigma}", measurement.name, row + 1);
    let found = Diagnostic::error(Code::BadSigma, message).at_data(block.table.place(row));
    Undefined(Box::new(found.hint("a standard deviation is positive: correct the row, or the expression")))
}
