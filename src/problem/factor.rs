//! QR(\[J r\]) of the data, block by block, and the sum of their squares.

use std::ops::Range;

use super::adjusted::{Adjuster, At};
use super::block::{Block, Quantities};
use super::pass::{PIECE, Pass, Span, pieces};
use super::programs::Jacobian;
use super::solving::Undefined;
use super::{Prior, Problem};
use crate::eval::{self, ROWS};
use crate::linalg::{LinalgError, SquareRootInformation, dot, norm};
use crate::solve::{NullSpace, null_space};

/// Which rows take part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// All of them.
    All,
    /// Some, from everywhere. What these see, all see.
    Sample,
}

/// Blocks of a sample.
const SAMPLE: usize = 8;

/// What all rows see at the table's inputs of a direction that a sample does not see, as a share of what they see of its
/// parameters: noise tilts an invisible direction by less than this, and a single row among many shows more.
const TILT: f64 = 1e-5;

impl Problem<'_> {
    /// QR(\[J r\]) of the data alone.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined.
    pub fn information(&self, point: &[f64], at: At, rows: Rows) -> Result<SquareRootInformation, Undefined> {
        let place = self.places();
        let mut all = SquareRootInformation::new(self.free.len());
        for block in &self.blocks {
            let (groups, set) = (&block.combinations, self.execution.instructions());
            let jacobian = block.seen.free(&block.programs, groups, &self.layout, &place, &block.weights, set);
            let pass = Pass::new(block, &jacobian.compiled, &self.layout, point);
            let work = |piece: &Range<usize>| {
                let mut part = Part::new(self, block, jacobian, &place, point);
                let mut adjuster = (at == At::Consistent).then(|| Adjuster::new(self, block, point));
                let mut adjust = adjuster.as_mut().map(|a| |c: &[u32], readings: &mut [f64]| a.adjust(c, readings));
                let adjust = adjust.as_mut().map(|adjust| adjust as &mut dyn FnMut(&[u32], &mut [f64]));
                pass.piece(piece.clone(), adjust, |span, found| part.absorb(span, found))?;
                Ok(part.information)
            };
            self.execution.fold(&chosen(block.table.rows(), rows), work, |part: SquareRootInformation| {
                all.merge(&part).map_err(Undefined::from)
            })?;
        }
        Ok(all)
    }

    /// Calls `visit(rows, numbers)` for every block of rows in turn, by one thread: whitened residuals and derivatives as they
    /// come, [`ROWS`] numbers for each column and residual, by column and then by residual, and the residuals themselves last.
    ///
    /// # Errors
    /// Where the rows cannot be read.
    pub fn derivatives(&self, point: &[f64], mut visit: impl FnMut(Range<usize>, &[f64])) -> Result<(), Undefined> {
        let place = self.places();
        for block in &self.blocks {
            let (groups, set) = (&block.combinations, self.execution.instructions());
            let jacobian = block.seen.free(&block.programs, groups, &self.layout, &place, &block.weights, set);
            let pass = Pass::new(block, &jacobian.compiled, &self.layout, point);
            for piece in pieces(block.table.rows()) {
                pass.piece(piece, None, |span, found| {
                    visit(span.first..span.first + span.count, &found.outputs()[..jacobian.compiled.outputs() * ROWS]);
                    Ok(())
                })?;
            }
        }
        Ok(())
    }

    /// Σ of the squares of the data's whitened residuals.
    ///
    /// # Errors
    /// Where a residual is undefined.
    pub fn sum_of_squares(&self, point: &[f64]) -> Result<f64, Undefined> {
        let mut total = 0.0;
        for block in &self.blocks {
            let compiled = block.seen.residuals(&block.programs, &block.weights, self.execution.instructions());
            let pass = Pass::new(block, compiled, &self.layout, point);
            let work = |piece: &Range<usize>| {
                let mut sum = 0.0;
                pass.piece(piece.clone(), None, |span, found| {
                    clear_rest(span.count, found);
                    let outputs = &found.outputs()[..compiled.outputs() * ROWS];
                    let squares = dot(outputs, outputs);
                    if !squares.is_finite() {
                        return Err(block.explain(Quantities::Residuals, &self.layout, point, span, false));
                    }
                    sum += squares;
                    Ok(())
                })?;
                Ok::<f64, Undefined>(sum)
            };
            self.execution.fold(&pieces(block.table.rows()), work, |sum| {
                total += sum;
                Ok(())
            })?;
        }
        if total.is_finite() { Ok(total) } else { Err(LinalgError::NotFinite.into()) }
    }

    /// What the data see at a point, with priors or without, judged where the inputs are consistent with it: at noisy inputs a
    /// symmetry of the model shows as a small singular value, and would be taken for knowledge. `observed` is the linearisation
    /// at the table's inputs, whose singular values are given where all is visible.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined.
    pub fn visible(
        &self,
        point: &[f64],
        priors: bool,
        observed: &SquareRootInformation,
    ) -> Result<NullSpace, Undefined> {
        let judge = |rows: Rows| {
            let data = self.information(point, At::Consistent, rows)?;
            let all = if priors { self.with_priors(data, point)? } else { data };
            Ok::<_, Undefined>(null_space(&all, &self.scale)?)
        };
        let few = self.blocks.iter().all(|block| block.table.rows() <= SAMPLE * ROWS);
        if few {
            return judge(Rows::All);
        }
        // more rows see more, never less
        let sample = judge(Rows::Sample)?;
        if sample.basis.is_empty() {
            let known = null_space(observed, &self.scale)?;
            return Ok(NullSpace { basis: Vec::new(), rank: self.free.len(), ..known });
        }
        if sample.basis.iter().all(|direction| self.tilt(direction, observed) <= TILT) {
            return Ok(sample);
        }
        judge(Rows::All)
    }

    /// ‖R δ‖ by ‖C δ‖, where C has the lengths of R's columns, of a direction in tolerances.
    fn tilt(&self, direction: &[f64], observed: &SquareRootInformation) -> f64 {
        let delta: Vec<f64> = direction.iter().zip(&self.scale).map(|(z, scale)| z * scale).collect();
        let lengths = observed.r().column_norms();
        let alone: Vec<f64> = delta.iter().zip(lengths).map(|(delta, length)| delta * length).collect();
        norm(&observed.r().mul_vec(&delta)) / norm(&alone).max(f64::MIN_POSITIVE)
    }

    /// Folds in the rows of the priors.
    pub(super) fn with_priors(
        &self,
        mut information: SquareRootInformation,
        point: &[f64],
    ) -> Result<SquareRootInformation, Undefined> {
        let mut rows = Prior::rows(self, point);
        if rows.rows() > 0 {
            information.absorb(&mut rows)?;
        }
        Ok(information)
    }
}

/// The rows that are evaluated, in pieces.
fn chosen(rows: usize, which: Rows) -> Vec<Range<usize>> {
    if which == Rows::All || rows <= SAMPLE * ROWS {
        return pieces(rows);
    }
    // blocks from everywhere, the first and the last among them
    let last = rows - ROWS;
    (0..SAMPLE).map(|k| last * k / (SAMPLE - 1)).map(|first| first..first + ROWS).collect()
}

/// Zeros for the rows that a block has not.
fn clear_rest(count: usize, found: &mut eval::Block) {
    if count < ROWS {
        for output in found.outputs().chunks_exact_mut(ROWS) {
            output[count..].fill(0.0);
        }
    }
}

/// Brings the rows that a block has together at the beginning of each column.
fn close_up(columns: &mut [f64], residuals: usize, count: usize) {
    for column in columns.chunks_exact_mut(residuals * ROWS) {
        for i in 1..residuals {
            column.copy_within(i * ROWS..i * ROWS + count, i * count);
        }
    }
}

/// The factor of one piece in the making.
struct Part<'a> {
    problem: &'a Problem<'a>,
    block: &'a Block<'a>,
    jacobian: &'a Jacobian,
    place: &'a [Option<usize>],
    point: &'a [f64],
    information: SquareRootInformation,
    /// the columns, where all rows share them
    shared: Option<Vec<usize>>,
    /// rows of several combinations, with all columns
    mixed: Vec<f64>,
    filled: usize,
}

/// Rows that are folded at a time where each has columns of its own.
const MIXED: usize = 256;

impl<'a> Part<'a> {
    fn new(
        problem: &'a Problem<'a>,
        block: &'a Block<'a>,
        jacobian: &'a Jacobian,
        place: &'a [Option<usize>],
        point: &'a [f64],
    ) -> Self {
        debug_assert!(PIECE.is_multiple_of(ROWS));
        let n = problem.free.len();
        let mut part = Part {
            problem,
            block,
            jacobian,
            place,
            point,
            information: SquareRootInformation::new(n),
            shared: None,
            mixed: Vec::new(),
            filled: 0,
        };
        if jacobian.columns.iter().all(|column| !column.gathered) {
            part.shared = Some(part.columns_of(0).into_iter().map(|(to, _)| to).collect());
        } else {
            part.mixed = vec![0.0; MIXED * (n + 1)];
        }
        part
    }

    /// The free coordinate, and the number, of each column that rows of a combination have.
    fn columns_of(&self, combination: usize) -> Vec<(usize, usize)> {
        let groups = &self.block.combinations[combination];
        let to = |column: &super::programs::Column| {
            self.place[self.problem.layout.groups[groups[column.slot]].first + column.component]
        };
        let columns = self.jacobian.columns.iter().enumerate();
        columns.filter_map(|(k, column)| to(column).map(|to| (to, k))).collect()
    }

    fn absorb(&mut self, span: &Span, found: &mut eval::Block) -> Result<(), Undefined> {
        let m = self.block.measurement.residuals.len();
        let done = match &self.shared {
            Some(columns) => {
                let set = self.problem.execution.instructions();
                let all = &mut found.outputs()[..(columns.len() + 1) * m * ROWS];
                if span.count < ROWS {
                    close_up(all, m, span.count);
                }
                self.information.absorb_columns(set, columns, all, m * span.count, m * ROWS)
            }
            None => self.absorb_mixed(span, found, m),
        };
        let undefined = |_| {
            let (layout, point) = (&self.problem.layout, self.point);
            self.block.explain(Quantities::Residuals, layout, point, span, true)
        };
        done.map_err(undefined)
    }

    /// Rows that each touch the members they name.
    fn absorb_mixed(&mut self, span: &Span, found: &eval::Block, m: usize) -> Result<(), LinalgError> {
        let n = self.problem.free.len();
        let residuals = self.jacobian.columns.len() * m;
        let mut known: Option<(u32, Vec<(usize, usize)>)> = None;
        for (row, &combination) in span.combination.iter().enumerate() {
            if known.as_ref().is_none_or(|(of, _)| *of != combination) {
                known = Some((combination, self.columns_of(combination as usize)));
            }
            let columns = known.as_ref().map_or(&[][..], |(_, columns)| columns);
            for i in 0..m {
                for &(to, k) in columns {
                    // two members that a row names can be one
                    self.mixed[to * MIXED + self.filled] += found.output(k * m + i)[row];
                }
                self.mixed[n * MIXED + self.filled] = found.output(residuals + i)[row];
                self.filled += 1;
                if self.filled == MIXED {
                    self.fold_mixed()?;
                }
            }
        }
        // what is left must not wait for rows of another span, or an error would be told of those
        self.fold_mixed()
    }

    fn fold_mixed(&mut self) -> Result<(), LinalgError> {
        let set = self.problem.execution.instructions();
        let done = self.information.absorb_block(set, &mut self.mixed, self.filled, MIXED);
        self.mixed.fill(0.0);
        self.filled = 0;
        done
    }
}
