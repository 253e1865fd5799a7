//! Rows one by one, where a block of rows cannot do them: equations that depend on each other, or steps that have to be
//! shortened before they lead anywhere.

use super::Problem;
use super::block::{Block, Quantities};
use super::inspect::Whitened;
use super::noise::{Noise, Spread};
use super::pass::{Pass, Span};
use super::programs::Jacobian;
use super::robust::RowLoss;
use super::solving::Undefined;
use super::whitening::{Whitening, whitening};
use crate::diag::{Code, Diagnostic};
use crate::eval;
use crate::linalg::{dot, norm};

/// Steps, shortened ones among them.
const STEPS: usize = 200;
/// A step this long, in standard deviations, is the last.
const STILL: f64 = 1e-9;
/// The same, and steps, where a loss changes weights on the way, by a constant share of what is left.
const STILL_OF_LOSS: f64 = 1e-6;
const STEPS_OF_LOSS: usize = 2_000;

/// A row done alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// Whitened residuals; zero for those left out.
    pub(super) residuals: Vec<f64>,
    /// The corrected readings.
    pub(super) readings: Vec<f64>,
    /// By column and then by whitened residual.
    pub(super) derivatives: Vec<f64>,
    /// How many equations were left out.
    pub(super) redundant: usize,
    /// What a loss of each input adds to ½‖residuals‖².
    pub(super) beyond: f64,
    /// Whether the corrections stood still at the end.
    pub(super) settled: bool,
}

/// Does rows alone, at one point.
pub(super) struct Alone<'a> {
    problem: &'a Problem<'a>,
    block: &'a Block<'a>,
    noise: &'a Noise,
    by_inputs: (Pass<'a>, eval::Block),
    jacobian: (&'a Jacobian, Pass<'a>, eval::Block),
    loss: Option<&'a RowLoss>,
    point: &'a [f64],
}

/// A row's equations at some readings: T·w is whitened.
struct Equations {
    /// w
    misclosure: Vec<f64>,
    /// σ of each corrected input
    sigma: Vec<f64>,
    /// what an error of one σ of each corrected input does to w
    by_error: Vec<Vec<f64>>,
    /// T, one row for each equation that counts
    whitening: Vec<Vec<f64>>,
    /// the conditions without variance
    without: Vec<Vec<f64>>,
    /// the corrections that come next
    next: Vec<f64>,
}

impl<'a> Alone<'a> {
    pub(super) fn new(problem: &'a Problem, block: &'a Block, noise: &'a Noise, point: &'a [f64]) -> Self {
        let set = problem.execution.instructions();
        let begin = |compiled| {
            let pass = Pass::new(block, compiled, &problem.layout, point);
            let state = pass.begin();
            (pass, state)
        };
        let by_inputs = begin(block.seen.by_inputs(&block.programs, &block.weights, set));
        let place = problem.places();
        let jacobian =
            block.seen.free(&block.programs, &block.combinations, &problem.layout, &place, &block.weights, set);
        let (pass, state) = begin(&jacobian.compiled);
        let loss = block.loss.as_ref().filter(|loss| loss.of_inputs());
        Alone { problem, block, noise, by_inputs, jacobian: (jacobian, pass, state), loss, point }
    }

    /// Corrects the readings of a row; `own` are the standard deviations that it has of its own.
    pub(super) fn row(&mut self, span: &Span, row: usize, own: &[f64]) -> Result<Row, Undefined> {
        let width = self.block.measurement.inputs.len();
        let read = &span.readings[row * width..(row + 1) * width];
        let one =
            Span { first: span.first + row, count: 1, combination: &span.combination[row..row + 1], readings: read };
        let mut v = vec![0.0; self.noise.inputs.len()];
        let mut at = self.equations(&one, &v, own)?;
        let (mut length, mut last, mut settled) = (1.0, f64::INFINITY, false);
        let (steps, still) = if self.loss.is_some() { (STEPS_OF_LOSS, STILL_OF_LOSS) } else { (STEPS, STILL) };
        for _ in 0..steps {
            let step: Vec<f64> = at.next.iter().zip(&v).map(|(next, v)| next - v).collect();
            let size = norm(&step.iter().zip(&at.sigma).map(|(step, sigma)| step / sigma).collect::<Vec<_>>());
            if size <= still {
                settled = true;
                break;
            }
            // a step that is longer than the last was taken too far
            length = if size > last { 0.5 * length } else { (2.0f64 * length).min(1.0) };
            last = size;
            let mut tried = length;
            at = loop {
                let moved: Vec<f64> = v.iter().zip(&step).map(|(v, step)| v + tried * step).collect();
                match self.equations(&one, &moved, own) {
                    Ok(found) => {
                        v = moved;
                        break found;
                    }
                    Err(undefined) if tried < 1e-6 => return Err(undefined),
                    Err(_) => tried *= 0.25,
                }
            };
        }
        let m = self.block.measurement.residuals.len();
        let mut residuals: Vec<f64> = at.whitening.iter().map(|t| dot(t, &at.misclosure)).collect();
        residuals.resize(m, 0.0);
        let readings = self.readings(read, &v);
        let of_input = |(v, sigma): (&f64, &f64)| {
            let square = (v / sigma).powi(2);
            self.loss.map_or(0.0, |loss| 0.5 * (loss.rho(square) - loss.weight_of_input(square) * square))
        };
        let beyond = v.iter().zip(&at.sigma).map(of_input).sum();
        let redundant = m - at.whitening.len();
        Ok(Row { residuals, readings, derivatives: Vec::new(), redundant, beyond, settled })
    }

    /// The same with derivatives.
    pub(super) fn row_with_derivatives(&mut self, span: &Span, row: usize, own: &[f64]) -> Result<Row, Undefined> {
        let mut found = self.row(span, row, own)?;
        let width = self.block.measurement.inputs.len();
        let read = &span.readings[row * width..(row + 1) * width];
        let combination = &span.combination[row..row + 1];
        let one = Span { first: span.first + row, count: 1, combination, readings: read };
        let v: Vec<f64> = self.noise.inputs.iter().map(|&(i, _)| found.readings[i] - read[i]).collect();
        let at = self.equations(&one, &v, own)?;
        let (jacobian, pass, state) = &mut self.jacobian;
        pass.run(combination, &found.readings, state);
        let m = self.block.measurement.residuals.len();
        let columns = jacobian.columns.len();
        let entry = |i: usize, column: usize| state.output(column * m + i)[0];
        let groups = &self.block.combinations[combination[0] as usize];
        found.derivatives = vec![0.0; m * columns];
        for (column, known) in jacobian.columns.iter().enumerate() {
            let a: Vec<f64> = (0..m).map(|i| entry(i, column)).collect();
            for (i, t) in at.whitening.iter().enumerate() {
                found.derivatives[column * m + i] = dot(t, &a);
            }
            let coordinate = self.problem.layout.groups[groups[known.slot]].first + known.component;
            let moved = self.problem.layout.coordinates[coordinate].tolerance * norm(&a);
            let violated = |t: &Vec<f64>| (dot(t, &a) / norm(t)).abs() > 1e-6 * norm(&a) && moved > 0.0;
            if self.problem.free.contains(&coordinate) && at.without.iter().any(violated) {
                return Err(self.without_noise(&one, coordinate));
            }
        }
        if found.derivatives.iter().any(|derivative| !derivative.is_finite()) {
            return Err(self.undefined(&one, &found.readings, true));
        }
        Ok(found)
    }

    /// The whitening of a row at corrected readings that have been [run](Self::run), with what errors of its observations do.
    pub(super) fn whitened(
        &self,
        span: &Span,
        row: usize,
        corrected: &[f64],
        own: &[f64],
    ) -> Result<Whitened, Undefined> {
        let width = self.block.measurement.inputs.len();
        let read = &span.readings[row * width..(row + 1) * width];
        let combination = &span.combination[row..row + 1];
        let one = Span { first: span.first + row, count: 1, combination, readings: read };
        let v: Vec<f64> = self.noise.inputs.iter().map(|&(i, _)| corrected[i] - read[i]).collect();
        let at = self.linearised(&one, row, corrected, &v, own)?;
        let residuals = at.whitening.iter().map(|t| dot(t, &at.misclosure)).collect();
        let k = v.len();
        let mut errors: Vec<Vec<f64>> =
            (0..k).map(|j| at.whitening.iter().map(|t| dot(t, &at.by_error[j])).collect()).collect();
        let mut sigma = at.sigma.clone();
        for (i, of) in self.noise.residuals.iter().enumerate() {
            if let Some(of) = of {
                let own = match of {
                    Spread::Constant(sigma) => *sigma,
                    Spread::PerRow(number) => own[*number],
                };
                errors.push(at.whitening.iter().map(|t| t[i] * self.block.weights[i] * own).collect());
                sigma.push(own);
            }
        }
        Ok(Whitened { rows: at.whitening, residuals, errors, sigma })
    }

    fn readings(&self, read: &[f64], v: &[f64]) -> Vec<f64> {
        let mut readings = read.to_vec();
        for (&(input, _), v) in self.noise.inputs.iter().zip(v) {
            readings[input] += v;
        }
        readings
    }

    /// Runs residuals and their derivatives by inputs on a span of rows, for [`whitened`](Self::whitened).
    pub(super) fn run(&mut self, combination: &[u32], readings: &[f64]) {
        let (pass, state) = &mut self.by_inputs;
        pass.run(combination, readings, state);
    }

    /// The equations linearised at corrections v.
    fn equations(&mut self, one: &Span, v: &[f64], own: &[f64]) -> Result<Equations, Undefined> {
        let readings = self.readings(one.readings, v);
        self.run(one.combination, &readings);
        self.linearised(one, 0, &readings, v, own)
    }

    /// The same from what has been run, of which this row is one.
    fn linearised(
        &self,
        one: &Span,
        row: usize,
        readings: &[f64],
        v: &[f64],
        own: &[f64],
    ) -> Result<Equations, Undefined> {
        let (m, width) = (self.block.measurement.residuals.len(), readings.len());
        let numbers: Vec<f64> = (0..m * (width + 1)).map(|output| self.by_inputs.1.output(output)[row]).collect();
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(self.undefined(one, readings, false));
        }
        let (f, b) = numbers.split_at(m);
        let k = v.len();
        let spread = |spread: Spread| match spread {
            Spread::Constant(sigma) => sigma,
            Spread::PerRow(at) => own[at],
        };
        let declared: Vec<f64> = self.noise.inputs.iter().map(|&(_, of)| spread(of)).collect();
        let loosen = |(sigma, v): (&f64, &f64)| match self.loss {
            Some(loss) => sigma / loss.weight_of_input((v / sigma).powi(2)).sqrt(),
            None => *sigma,
        };
        let sigma: Vec<f64> = declared.iter().zip(v).map(loosen).collect();
        let by_input = |i: usize, j: usize| b[i * width + self.noise.inputs[j].0];
        let mut misclosure = f.to_vec();
        let mut mixed = vec![vec![0.0; k + m]; m];
        for i in 0..m {
            for j in 0..k {
                misclosure[i] -= by_input(i, j) * v[j];
                match &self.noise.mixing {
                    None => mixed[i][j] = by_input(i, j) * sigma[j],
                    Some(c) => mixed[i][j] = (j..k).map(|l| by_input(i, l) * sigma[l] * c[(l, j)]).sum(),
                }
            }
            if let Some(Some(of)) = self.noise.residuals.get(i) {
                mixed[i][k + i] = self.block.weights[i] * spread(*of);
            }
        }
        let Whitening { rows: whitening, without } = whitening(&mixed)?;
        // v = −D C Mᵀ Tᵀ T w
        let mut next = vec![0.0; k];
        for t in &whitening {
            let share = dot(t, &misclosure);
            for (j, next) in next.iter_mut().enumerate() {
                *next -= share * (0..m).map(|i| mixed[i][j] * t[i]).sum::<f64>();
            }
        }
        if let Some(c) = &self.noise.mixing {
            next = c.mul_vec(&next);
        }
        next.iter_mut().zip(&sigma).for_each(|(next, sigma)| *next *= sigma);
        let by_error = (0..k).map(|j| (0..m).map(|i| by_input(i, j) * declared[j]).collect()).collect();
        Ok(Equations { misclosure, sigma: declared, by_error, whitening, without, next })
    }

    fn undefined(&self, one: &Span, readings: &[f64], derivatives: bool) -> Undefined {
        let at = Span { readings, ..*one };
        self.block.explain(Quantities::Residuals, &self.problem.layout, self.point, &at, derivatives)
    }

    fn without_noise(&self, one: &Span, coordinate: usize) -> Undefined {
        let (measurement, name) = (self.block.measurement, &self.problem.layout.coordinates[coordinate].name);
        let message = format!(
            "measurement `{}`, row {}: a combination of its equations has no error, and would determine `{name}` exactly",
            measurement.name,
            one.first + 1
        );
        let found = Diagnostic::error(Code::NoNoise, message).at_data(self.block.table.place(one.first));
        Undefined(Box::new(found.hint("give another input a sigma, or the residuals, or remove an equation")))
    }
}
