//! Every row at a solution as linear algebra: what each of its observations does to its equations.

use super::Problem;
use super::alone::Alone;
use super::block::Block;
use super::correction::{Corrector, Wanted};
use super::noise::Noise;
use super::pass::{Pass, pieces, spans};
use super::solving::Undefined;
use crate::linalg::{Matrix, dot};

/// What an observation of a row is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Observed {
    /// the reading of an input, by its number
    Input(usize),
    /// an equation with an error of its own, by its number
    Residual(usize),
}

/// One row's whitened equations: T w with T (M Mᵀ + E) Tᵀ = 1.
#[derive(Clone, Debug)]
pub struct Inspected<'a> {
    /// The block, by its number among those of the problem.
    pub block: usize,
    /// The row's number.
    pub row: usize,
    /// Its readings as they are.
    pub read: &'a [f64],
    /// Its readings corrected so that the equations hold; as they are where weights correct nothing.
    pub corrected: &'a [f64],
    /// T w.
    pub residuals: &'a [f64],
    /// T A, by equation and then by the columns.
    pub derivatives: &'a [f64],
    /// The free coordinates of the columns, by their place among the free.
    pub columns: &'a [usize],
    /// What an error of one standard deviation of each observation does to T w: by observation and then by equation.
    pub errors: &'a [Vec<f64>],
    /// The standard deviation of each observation.
    pub sigma: &'a [f64],
}

impl Problem<'_> {
    /// The observations of each row of a block, in the order of [`Inspected::errors`]; none of a block that there is not.
    pub fn observations(&self, block: usize) -> Vec<Observed> {
        let Some(block) = self.blocks.get(block) else { return Vec::new() };
        let equations = block.measurement.residuals.len();
        match &block.noise {
            None => (0..equations).map(Observed::Residual).collect(),
            Some(noise) => {
                let inputs = noise.inputs.iter().map(|&(input, _)| Observed::Input(input));
                let own = (0..equations).filter(|&i| noise.residuals[i].is_some()).map(Observed::Residual);
                inputs.chain(own).collect()
            }
        }
    }

    /// Whether factors of its residuals say all of a block's errors, so that its observations are the whitened residuals.
    pub fn whitened_by_factors(&self, block: usize) -> bool {
        self.blocks.get(block).is_some_and(|block| block.noise.is_none())
    }

    /// The correlations between the errors of a block's observations, where there are any.
    pub fn observation_correlations(&self, block: usize) -> Option<Matrix> {
        let mixing = self.blocks.get(block)?.noise.as_ref()?.mixing.as_ref()?;
        let (all, k) = (self.observations(block).len(), mixing.rows());
        let mut matrix = Matrix::identity(all);
        for i in 0..k {
            for j in 0..k {
                matrix[(i, j)] = (0..k).map(|l| mixing[(i, l)] * mixing[(j, l)]).sum();
            }
        }
        Some(matrix)
    }

    /// Visits every row that takes part, in order.
    ///
    /// # Errors
    /// Where the rows cannot be read, something is undefined, or the point has not as many numbers as there are coordinates.
    pub fn inspect(&self, point: &[f64], mut visit: impl FnMut(&Inspected)) -> Result<(), Undefined> {
        self.layout.fits(point)?;
        (0..self.blocks.len()).try_for_each(|block| self.inspect_block(block, point, &mut visit))
    }

    fn inspect_block(&self, number: usize, point: &[f64], visit: &mut impl FnMut(&Inspected)) -> Result<(), Undefined> {
        let block = &self.blocks[number];
        let set = self.execution.instructions();
        let place = self.places();
        let (groups, layout) = (&block.combinations, &self.layout);
        let jacobian = block.seen.free(&block.programs, groups, layout, &place, &block.weights, set);
        let pass = Pass::new(block, &jacobian.compiled, layout, point);
        let mut state = pass.begin();
        let (m, width) = (block.measurement.residuals.len(), block.measurement.inputs.len());
        let n = jacobian.columns.len();
        let mut whitener = block.noise.as_ref().map(|noise| Whitener::new(self, block, noise, point));
        for piece in pieces(block.table.rows()) {
            spans(block, piece, |span| {
                let mut corrected = span.readings.to_vec();
                if let Some(whitener) = &mut whitener {
                    whitener.correct(span, &mut corrected)?;
                    whitener.alone.run(span.combination, &corrected);
                }
                pass.run(span.combination, &corrected, &mut state);
                for row in 0..span.count {
                    if block.excludes(span.first + row) {
                        continue;
                    }
                    let read = &span.readings[row * width..(row + 1) * width];
                    let at = &corrected[row * width..(row + 1) * width];
                    let members = &groups[span.combination[row] as usize];
                    let (mut columns, mut known) = (Vec::with_capacity(n), Vec::with_capacity(n));
                    for (k, column) in jacobian.columns.iter().enumerate() {
                        if let Some(place) = place[layout.groups[members[column.slot]].first + column.component] {
                            columns.push(place);
                            known.push(k);
                        }
                    }
                    let a: Vec<Vec<f64>> =
                        known.iter().map(|k| (0..m).map(|i| state.output(k * m + i)[row]).collect()).collect();
                    let whitened = match &whitener {
                        Some(whitener) => whitener.whiten(span, row, at)?,
                        None => Whitened::plain((0..m).map(|i| state.output(n * m + i)[row]).collect()),
                    };
                    let derivatives: Vec<f64> =
                        whitened.rows.iter().flat_map(|t| a.iter().map(|column| dot(t, column))).collect();
                    visit(&Inspected {
                        block: number,
                        row: span.first + row,
                        read,
                        corrected: at,
                        residuals: &whitened.residuals,
                        derivatives: &derivatives,
                        columns: &columns,
                        errors: &whitened.errors,
                        sigma: &whitened.sigma,
                    });
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// A row's whitening: rows of T, and what becomes of the rest.
pub(super) struct Whitened {
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) residuals: Vec<f64>,
    pub(super) errors: Vec<Vec<f64>>,
    pub(super) sigma: Vec<f64>,
}

impl Whitened {
    /// Where factors have whitened the residuals already, these are what was observed.
    fn plain(residuals: Vec<f64>) -> Whitened {
        let m = residuals.len();
        let rows: Vec<Vec<f64>> = (0..m).map(|i| (0..m).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        Whitened { errors: rows.clone(), rows, residuals, sigma: vec![1.0; m] }
    }
}

/// Corrects and whitens rows.
struct Whitener<'a> {
    noise: &'a Noise,
    corrector: Corrector<'a>,
    alone: Alone<'a>,
    width: usize,
}

impl<'a> Whitener<'a> {
    fn new(problem: &'a Problem, block: &'a Block, noise: &'a Noise, point: &'a [f64]) -> Self {
        Whitener {
            noise,
            corrector: Corrector::new(problem, block, noise, point),
            alone: Alone::new(problem, block, noise, point),
            width: block.measurement.inputs.len(),
        }
    }

    fn correct(&mut self, span: &super::pass::Span, readings: &mut [f64]) -> Result<(), Undefined> {
        self.corrector.settle(span, Wanted::Readings)?;
        for &(input, _) in &self.noise.inputs {
            let corrected = self.corrector.state.input(input);
            for (row, corrected) in corrected[..span.count].iter().enumerate() {
                readings[row * self.width + input] = *corrected;
            }
        }
        for row in self.corrector.left.clone() {
            let found = self.alone.row(span, row, &self.corrector.own(row))?;
            readings[row * self.width..(row + 1) * self.width].copy_from_slice(&found.readings);
        }
        Ok(())
    }

    fn whiten(&self, span: &super::pass::Span, row: usize, corrected: &[f64]) -> Result<Whitened, Undefined> {
        self.alone.whitened(span, row, corrected, &self.corrector.own(row))
    }
}
