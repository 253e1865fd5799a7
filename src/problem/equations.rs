//! The whitened equations of rows, however the weights have it: factors of the residuals, or corrected readings.

use super::Problem;
use super::alone::{Alone, Row};
use super::block::{Block, Quantities};
use super::correction::{Corrector, Wanted};
use super::noise::Noise;
use super::pass::{Pass, Span};
use super::programs::Jacobian;
use super::solving::Undefined;
use crate::eval::{self, ROWS};

/// What rows add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// What they add to the cost.
    pub cost: f64,
    /// Σ of the squares of whitened residuals, whatever a loss makes of them; with corrected readings Σ vᵀΣ⁻¹v.
    pub squares: f64,
    /// Equations that count: those of rows that take part and that say something of their own.
    pub equations: usize,
    /// Equations that said what others of their row say already.
    pub redundant: usize,
    /// Rows whose corrections did not stand still.
    pub unsettled: usize,
    /// Rows that a loss gives no weight.
    pub rejected: usize,
    /// Rows that take part.
    pub rows: usize,
    /// Of rows with a loss: Σ w s, Σ w m, Σ w² s and Σ h, with s the square of a row's length, m its equations, w its weight
    /// and h = w + 2 s w'/m.
    pub robust: [f64; 4],
}

impl Sums {
    /// Adds those of other rows.
    pub(super) fn add(&mut self, other: &Sums) {
        self.cost += other.cost;
        self.squares += other.squares;
        self.equations += other.equations;
        self.redundant += other.redundant;
        self.unsettled += other.unsettled;
        self.rejected += other.rejected;
        self.rows += other.rows;
        for (sum, other) in self.robust.iter_mut().zip(other.robust) {
            *sum += other;
        }
    }

    /// Whether a loss leaves nothing.
    pub fn all_rejected(&self) -> bool {
        self.rows > 0 && self.rejected == self.rows
    }

    /// σ₀ of what a loss of rows lets count, with so many parameters.
    pub fn robust_sigma0(&self, parameters: usize) -> Option<f64> {
        let [squares, equations, ..] = self.robust;
        let freedom = equations - parameters as f64;
        (freedom > 0.0).then(|| (squares / freedom).sqrt())
    }

    /// The factor of the standard uncertainties that a loss of rows brings: √(Σ w² s/(equations − parameters))/(Σ h/rows).
    pub fn robust_factor(&self, parameters: usize) -> Option<f64> {
        let [_, equations, spread, bend] = self.robust;
        let freedom = self.equations.checked_sub(parameters).filter(|&freedom| freedom > 0)?;
        let bend = bend / self.rows as f64;
        // what is left must be more than what is determined by it
        let enough = bend > 0.0 && equations > parameters as f64;
        enough.then(|| (spread / freedom as f64).sqrt() / bend)
    }
}

/// Evaluates the equations of spans of rows at one point.
pub(super) struct Equations<'a> {
    problem: &'a Problem<'a>,
    block: &'a Block<'a>,
    point: &'a [f64],
    pass: Pass<'a>,
    state: eval::Block,
    corrected: Option<Corrected<'a>>,
    /// columns before the residuals
    columns: Option<usize>,
    /// the first output that is a residual
    first: usize,
    pub(super) sums: Sums,
}

struct Corrected<'a> {
    noise: &'a Noise,
    corrector: Corrector<'a>,
    alone: Option<Alone<'a>>,
}

impl<'a> Equations<'a> {
    /// With derivatives by the columns of [`jacobian`](Self::jacobian).
    pub(super) fn with_derivatives(problem: &'a Problem, block: &'a Block, point: &'a [f64]) -> Self {
        let jacobian = Self::jacobian(problem, block);
        Self::new(problem, block, point, &jacobian.compiled, Some(jacobian.columns.len()))
    }

    /// Residuals alone.
    pub(super) fn residuals(problem: &'a Problem, block: &'a Block, point: &'a [f64]) -> Self {
        let set = problem.execution.instructions();
        let compiled = match &block.noise {
            None => block.seen.residuals(&block.programs, &block.weights, set),
            Some(noise) => block.seen.step(&block.programs, noise, &block.weights, set),
        };
        Self::new(problem, block, point, compiled, None)
    }

    /// The program of the derivatives.
    pub(super) fn jacobian(problem: &'a Problem, block: &'a Block) -> &'a Jacobian {
        let (groups, set, layout) = (&block.combinations, problem.execution.instructions(), &problem.layout);
        let place = problem.places();
        match &block.noise {
            None => block.seen.free(&block.programs, groups, layout, &place, &block.weights, set),
            Some(noise) => block.seen.whitened(&block.programs, noise, groups, layout, &place, &block.weights, set),
        }
    }

    fn new(
        problem: &'a Problem,
        block: &'a Block,
        point: &'a [f64],
        compiled: &'a eval::Compiled,
        columns: Option<usize>,
    ) -> Self {
        let pass = Pass::new(block, compiled, &problem.layout, point);
        let state = pass.begin();
        let corrected = block.noise.as_ref().map(|noise| Corrected {
            noise,
            corrector: Corrector::new(problem, block, noise, point),
            alone: None,
        });
        let m = block.measurement.residuals.len();
        let first = match (&corrected, columns) {
            (_, Some(columns)) => columns * m,
            (None, None) => 0,
            (Some(corrected), None) => corrected.noise.inputs.len() + 1,
        };
        Equations { problem, block, point, pass, state, corrected, columns, first, sums: Sums::default() }
    }

    /// Evaluates a span: its columns one after the other, residuals last, [`ROWS`] numbers for each equation; zeros for rows
    /// that take no part or that a span has not. What a loss leaves of the rows is in them, and [`sums`](Self::sums) has
    /// counted them.
    pub(super) fn run(&mut self, span: &Span) -> Result<&mut [f64], Undefined> {
        let m = self.block.measurement.residuals.len();
        let mut beyond = [0.0; ROWS];
        match &mut self.corrected {
            None => self.pass.run(span.combination, span.readings, &mut self.state),
            Some(corrected) => {
                let wanted = if self.columns.is_some() { Wanted::Readings } else { Wanted::Residuals };
                corrected.corrector.settle(span, wanted)?;
                let from = &mut corrected.corrector;
                if self.columns.is_some() {
                    for input in 0..self.pass.compiled().inputs() {
                        self.state.input(input).copy_from_slice(from.state.input(input));
                    }
                    self.pass.compiled().run(&mut self.state);
                } else {
                    // the step's own program, whose residuals are those wanted
                    self.state.outputs().copy_from_slice(from.state.outputs());
                }
                for (row, beyond) in beyond[..span.count].iter_mut().enumerate() {
                    *beyond = from.beyond_squares(row);
                }
            }
        }
        // what is not a number in a block may be one alone, so nothing is judged before that
        let alone = self.alone(span, &mut beyond)?;
        self.weigh(span, &beyond, m)?;
        self.sums.redundant += alone.redundant;
        self.sums.equations -= alone.redundant;
        self.sums.unsettled += alone.unsettled;
        let (first, last) = if self.columns.is_some() { (0, self.first + m) } else { (self.first, self.first + m) };
        Ok(&mut self.state.outputs()[first * ROWS..last * ROWS])
    }

    /// Rows that a block of rows could not do.
    fn alone(&mut self, span: &Span, beyond: &mut [f64]) -> Result<Sums, Undefined> {
        let mut sums = Sums::default();
        let Some(corrected) = &mut self.corrected else { return Ok(sums) };
        if corrected.corrector.left.is_empty() {
            return Ok(sums);
        }
        let (problem, block, point, noise) = (self.problem, self.block, self.point, corrected.noise);
        let alone = corrected.alone.get_or_insert_with(|| Alone::new(problem, block, noise, point));
        for &row in &corrected.corrector.left {
            if self.block.excludes(span.first + row) {
                continue;
            }
            let own = corrected.corrector.own(row);
            let found: Row = match self.columns {
                Some(_) => alone.row_with_derivatives(span, row, &own)?,
                None => alone.row(span, row, &own)?,
            };
            let outputs = self.state.outputs();
            for (output, number) in found.derivatives.iter().enumerate() {
                outputs[output * ROWS + row] = *number;
            }
            for (i, residual) in found.residuals.iter().enumerate() {
                outputs[(self.first + i) * ROWS + row] = *residual;
            }
            beyond[row] = found.beyond;
            sums.redundant += found.redundant;
            sums.unsettled += usize::from(!found.settled);
        }
        Ok(sums)
    }

    /// Counts the rows, and gives each its weight.
    fn weigh(&mut self, span: &Span, beyond: &[f64], m: usize) -> Result<(), Undefined> {
        let (block, first) = (self.block, self.first);
        let outputs = self.state.outputs();
        let mut squares = [0.0; ROWS];
        for column in outputs[first * ROWS..(first + m) * ROWS].chunks_exact(ROWS) {
            for (square, residual) in squares.iter_mut().zip(column) {
                *square += residual * residual;
            }
        }
        let of_rows = block.loss.as_ref().filter(|loss| !loss.of_inputs());
        let mut factors = [1.0; ROWS];
        let mut taking_part = 0;
        let once = block.counts_once();
        let mut whole = of_rows.is_none() && span.count == ROWS;
        factors[span.count..].fill(0.0);
        for row in 0..span.count {
            if block.excludes(span.first + row) {
                factors[row] = 0.0;
                whole = false;
                continue;
            }
            let square = squares[row];
            if !square.is_finite() {
                let (layout, what) = (&self.problem.layout, Quantities::Residuals);
                return Err(block.explain(what, layout, self.point, span, false));
            }
            taking_part += 1;
            let times = if once { 1.0 } else { block.weight(span.first + row) };
            if !once {
                factors[row] = times.sqrt();
                whole = false;
            }
            self.sums.squares += times * square;
            match of_rows {
                Some(loss) => {
                    let weight = loss.weight(square);
                    factors[row] = (times * weight).sqrt();
                    self.sums.cost += 0.5 * times * loss.rho(square);
                    self.sums.rejected += usize::from(weight == 0.0);
                    let (of_row, m) = (loss.bend(square, m), m as f64);
                    let terms = [weight * square, weight * m, weight * weight * square, of_row];
                    self.sums.robust.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                }
                None if once => self.sums.cost += 0.5 * square + beyond[row],
                None => self.sums.cost += times * (0.5 * square + beyond[row]),
            }
        }
        self.sums.rows += taking_part;
        self.sums.equations += taking_part * m;
        if whole {
            return Ok(());
        }
        let from = if self.columns.is_some() { 0 } else { first };
        for column in outputs[from * ROWS..(first + m) * ROWS].chunks_exact_mut(ROWS) {
            for (number, factor) in column.iter_mut().zip(&factors) {
                // not a number times zero is not zero
                *number = if *factor == 0.0 { 0.0 } else { *number * factor };
            }
        }
        Ok(())
    }
}
