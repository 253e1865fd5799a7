//! QR(\[J r\]) of the data, block by block, and the sum of their squares.

use std::ops::Range;

use super::adjusted::Adjuster;
use super::block::{Block, Quantities};
use super::equations::{Equations, Sums};
use super::pass::{PIECE, Pass, Span, pieces, spans};
use super::programs::Jacobian;
use super::solving::Undefined;
use super::{Prior, Problem};
use crate::eval::ROWS;
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, norm};
use crate::solve::{NullSpace, Relation, null_space};

/// Which rows take part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// All of them.
    All,
    /// Some, from everywhere. What these see, all see.
    Sample,
}

/// Blocks of a sample.
pub(super) const SAMPLE: usize = 8;

/// What all rows see at the table's inputs of a direction that a sample does not see, as a share of what they see of its
/// parameters: noise tilts an invisible direction by less than this, and a single row among many shows more.
pub(super) const TILT: f64 = 1e-5;

/// A linearisation of the data, and what their rows add up to.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// QR(\[J r\]) of the data alone.
    pub information: SquareRootInformation,
    /// What the rows add up to.
    pub sums: Sums,
}

impl Problem<'_> {
    /// QR(\[J r\]) of the data alone, as the weights have it.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined.
    pub fn linearised(&self, point: &[f64]) -> Result<Linearised, Undefined> {
        let mut all = self.linearised_in(point, &self.all_pieces())?;
        self.with_absorbed(point, &mut all.sums, Some(&mut all.information))?;
        Ok(all)
    }

    /// The same of some rows, by block in pieces.
    pub(super) fn linearised_in(&self, point: &[f64], rows: &[Vec<Range<usize>>]) -> Result<Linearised, Undefined> {
        self.layout.fits(point)?;
        let place = self.places();
        let mut all = Linearised { information: SquareRootInformation::new(self.free.len()), sums: Sums::default() };
        for (block, rows) in self.blocks.iter().zip(rows).filter(|(_, rows)| !rows.is_empty()) {
            let jacobian = Equations::jacobian(self, block);
            let work = |piece: &Range<usize>| {
                let mut equations = Equations::with_derivatives(self, block, point);
                let mut part = Part::new(self, block, jacobian, &place, point);
                spans(block, piece.clone(), |span| {
                    let found = equations.run(span)?;
                    part.absorb(span, found)
                })?;
                Ok((part.information, equations.sums))
            };
            self.execution.fold(rows, work, |(part, sums): (SquareRootInformation, Sums)| {
                all.sums.add(&sums);
                all.information.merge(&part).map_err(Undefined::from)
            })?;
        }
        Ok(all)
    }

    /// The same, where the inputs are consistent with the point, with factors of the residuals alone: what can be seen at all.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined.
    pub fn at_consistent_inputs(&self, point: &[f64], rows: Rows) -> Result<SquareRootInformation, Undefined> {
        let rows: Vec<_> = self.blocks.iter().map(|block| chosen(block.table.rows(), rows)).collect();
        self.consistent_in(point, &rows)
    }

    /// The same of some rows, by block in pieces.
    pub(super) fn consistent_in(
        &self,
        point: &[f64],
        rows: &[Vec<Range<usize>>],
    ) -> Result<SquareRootInformation, Undefined> {
        self.layout.fits(point)?;
        let place = self.places();
        let mut all = SquareRootInformation::new(self.free.len());
        for (block, rows) in self.blocks.iter().zip(rows).filter(|(_, rows)| !rows.is_empty()) {
            let (groups, set) = (&block.combinations, self.execution.instructions());
            let jacobian = block.seen.free(&block.programs, groups, &self.layout, &place, &block.weights, set);
            let pass = Pass::new(block, &jacobian.compiled, &self.layout, point);
            let outputs = jacobian.compiled.outputs() * ROWS;
            let work = |piece: &Range<usize>| {
                let mut part = Part::new(self, block, jacobian, &place, point);
                let mut adjuster = Adjuster::new(self, block, point);
                let (mut adjusted, mut state) = (Vec::new(), pass.begin());
                spans(block, piece.clone(), |span| {
                    adjusted.clear();
                    adjusted.extend_from_slice(span.readings);
                    adjuster.adjust(span.combination, &mut adjusted);
                    let span = Span { readings: &adjusted, ..*span };
                    pass.run(span.combination, span.readings, &mut state);
                    part.absorb(&span, &mut state.outputs()[..outputs])
                })?;
                Ok(part.information)
            };
            self.execution.fold(rows, work, |part: SquareRootInformation| all.merge(&part).map_err(Undefined::from))?;
        }
        Ok(all)
    }

    /// Calls `visit(rows, numbers)` for every block of rows in turn, by one thread: whitened residuals and derivatives as they
    /// come, [`ROWS`] numbers for each column and residual, by column and then by residual, and the residuals themselves last.
    ///
    /// # Errors
    /// Where the rows cannot be read, or something is undefined.
    pub fn derivatives(&self, point: &[f64], mut visit: impl FnMut(Range<usize>, &[f64])) -> Result<(), Undefined> {
        self.layout.fits(point)?;
        for block in &self.blocks {
            let mut equations = Equations::with_derivatives(self, block, point);
            for piece in pieces(block.table.rows()) {
                spans(block, piece, |span| {
                    visit(span.first..span.first + span.count, equations.run(span)?);
                    Ok(())
                })?;
            }
        }
        Ok(())
    }

    /// What the rows add up to.
    ///
    /// # Errors
    /// Where a residual is undefined.
    pub fn sums(&self, point: &[f64]) -> Result<Sums, Undefined> {
        let mut total = self.sums_in(point, &self.all_pieces())?;
        self.with_absorbed(point, &mut total, None)?;
        Ok(total)
    }

    /// The same of some rows, by block in pieces.
    pub(super) fn sums_in(&self, point: &[f64], rows: &[Vec<Range<usize>>]) -> Result<Sums, Undefined> {
        self.layout.fits(point)?;
        let mut total = Sums::default();
        for (block, rows) in self.blocks.iter().zip(rows).filter(|(_, rows)| !rows.is_empty()) {
            // compiled before threads need it
            let _ = Equations::residuals(self, block, point);
            let work = |piece: &Range<usize>| {
                let mut equations = Equations::residuals(self, block, point);
                spans(block, piece.clone(), |span| equations.run(span).map(|_| ()))?;
                Ok::<Sums, Undefined>(equations.sums)
            };
            self.execution.fold(rows, work, |sums| {
                total.add(&sums);
                Ok(())
            })?;
        }
        if total.cost.is_finite() { Ok(total) } else { Err(LinalgError::NotFinite.into()) }
    }

    /// Calls `visit(block, length)` with the length of every row's whitened residuals, in order.
    pub(super) fn lengths(&self, point: &[f64], mut visit: impl FnMut(usize, f64)) -> Result<(), Undefined> {
        self.layout.fits(point)?;
        for (number, block) in self.blocks.iter().enumerate() {
            let mut equations = Equations::residuals(self, block, point);
            for piece in pieces(block.table.rows()) {
                spans(block, piece, |span| {
                    let found = equations.run(span)?;
                    for row in (0..span.count).filter(|&row| !block.excludes(span.first + row)) {
                        let square: f64 = found.chunks_exact(ROWS).map(|column| column[row] * column[row]).sum();
                        visit(number, square.sqrt());
                    }
                    Ok(())
                })?;
            }
        }
        Ok(())
    }

    /// What the data see at a point, with priors and constraints that are equations or without, judged where the inputs are consistent with it: at noisy inputs a
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
            let data = self.at_consistent_inputs(point, rows)?;
            let all = if priors { self.with_equations(self.with_priors(data, point)?, point)? } else { data };
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

    fn all_pieces(&self) -> Vec<Vec<Range<usize>>> {
        self.blocks.iter().map(|block| pieces(block.table.rows())).collect()
    }

    /// ‖R δ‖ by ‖C δ‖, where C has the lengths of R's columns, of a direction in tolerances.
    pub(super) fn tilt(&self, direction: &[f64], observed: &SquareRootInformation) -> f64 {
        let delta: Vec<f64> = direction.iter().zip(&self.scale).map(|(z, scale)| z * scale).collect();
        let lengths = observed.r().column_norms();
        let alone: Vec<f64> = delta.iter().zip(lengths).map(|(delta, length)| delta * length).collect();
        norm(&observed.r().mul_vec(&delta)) / norm(&alone).max(f64::MIN_POSITIVE)
    }

    /// Folds in the constraints that are equations, as large as what the data see: a direction that they see is not invisible.
    ///
    /// # Errors
    /// Where one of them is undefined, or an entry is not finite.
    pub fn with_equations(
        &self,
        mut information: SquareRootInformation,
        point: &[f64],
    ) -> Result<SquareRootInformation, Undefined> {
        let constraints = self.linearised_constraints(point)?;
        let size =
            |row: &mut dyn Iterator<Item = f64>| norm(&row.zip(&self.scale).map(|(a, s)| a * s).collect::<Vec<_>>());
        let seen = size(&mut information.r().column_norms().into_iter()).max(1.0);
        for constraint in constraints.iter().filter(|constraint| constraint.relation == Relation::Equal) {
            let own = size(&mut constraint.gradient.iter().copied());
            if own > 0.0 {
                let row: Vec<f64> =
                    constraint.gradient.iter().map(|a| a * seen / own).chain([constraint.value * seen / own]).collect();
                information.absorb(&mut Matrix::from_rows(row.len(), &[row]))?;
            }
        }
        Ok(information)
    }

    /// Folds in the rows of the priors.
    ///
    /// # Errors
    /// Where an entry is not finite.
    pub fn with_priors(
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

/// Brings the rows that a block has together at the beginning of each column.
fn close_up(columns: &mut [f64], residuals: usize, count: usize) {
    if residuals == 0 {
        return;
    }
    for column in columns.chunks_exact_mut(residuals * ROWS) {
        for i in 1..residuals {
            column.copy_within(i * ROWS..i * ROWS + count, i * count);
        }
    }
}

/// The free coordinate, and the number, of each column that rows of a combination have.
pub(super) fn columns_of(
    problem: &Problem,
    block: &Block,
    jacobian: &Jacobian,
    place: &[Option<usize>],
    combination: usize,
) -> Vec<(usize, usize)> {
    let groups = &block.combinations[combination];
    let to =
        |column: &super::programs::Column| place[problem.layout.groups[groups[column.slot]].first + column.component];
    let columns = jacobian.columns.iter().enumerate();
    columns.filter_map(|(k, column)| to(column).map(|to| (to, k))).collect()
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

    fn columns_of(&self, combination: usize) -> Vec<(usize, usize)> {
        columns_of(self.problem, self.block, self.jacobian, self.place, combination)
    }

    /// Takes in the columns of a span, residuals last.
    fn absorb(&mut self, span: &Span, found: &mut [f64]) -> Result<(), Undefined> {
        let m = self.block.measurement.residuals.len();
        let done = match &self.shared {
            Some(columns) => {
                let set = self.problem.execution.instructions();
                if span.count < ROWS {
                    close_up(found, m, span.count);
                }
                self.information.absorb_columns(set, columns, found, m * span.count, m * ROWS)
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
    fn absorb_mixed(&mut self, span: &Span, found: &[f64], m: usize) -> Result<(), LinalgError> {
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
                    self.mixed[to * MIXED + self.filled] += found[(k * m + i) * ROWS + row];
                }
                self.mixed[n * MIXED + self.filled] = found[(residuals + i) * ROWS + row];
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
