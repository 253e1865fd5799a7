//! Data on the way from readings that a point explains to those that were made.
//!
//! x(λ) = x − (1 − λ)(x ⊖ x₀), where x₀ are the readings nearest to x at which the equations hold at the point, f(q₀, x₀) = 0, and
//! angles take the short way. At λ = 0 the point is an exact solution, at λ = 1 the data are the table's.

use super::Problem;
use super::adjusted::Adjuster;
use super::pass::{pieces, spans};
use super::solving::Undefined;
use crate::data::{Buffer, Table};
use crate::unit::Dimension;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A problem with readings that can be moved.
#[derive(Clone, Debug)]
pub struct Path<'p> {
    /// of the rows that the point can explain
    problem: Problem<'p>,
    /// of each block
    consistent: Vec<Table>,
    /// Rows that no readings near their own make consistent with the point.
    pub left_out: usize,
}

impl<'p> Problem<'p> {
    /// The way from readings that are consistent with a point. Rows without such readings are not on it.
    ///
    /// # Errors
    /// Where rows cannot be read.
    pub fn path(&self, point: &[f64]) -> Result<Path<'p>, Undefined> {
        self.layout.fits(point)?;
        let mut consistent = Vec::with_capacity(self.blocks.len());
        let mut unmet: Vec<Vec<usize>> = vec![Vec::new(); self.blocks.len()];
        for (block, unmet) in self.blocks.iter().zip(&mut unmet) {
            let width = block.table.width();
            let mut adjuster = Adjuster::new(self, block, point);
            let mut adjusted = Vec::new();
            let mut table = Table::new(0, width);
            for piece in pieces(block.table.rows()) {
                spans(block, piece, |span| {
                    adjusted.clear();
                    adjusted.extend_from_slice(span.readings);
                    let met = adjuster.adjust(span.combination, &mut adjusted);
                    unmet.extend(met.iter().enumerate().filter(|(_, met)| !**met).map(|(row, _)| span.first + row));
                    (0..span.count).for_each(|row| table.put([], &adjusted[row * width..(row + 1) * width], None));
                    Ok(())
                })?;
            }
            consistent.push(table);
        }
        let left_out = unmet.iter().map(Vec::len).sum();
        Ok(Path { problem: self.without_rows(&unmet), consistent, left_out })
    }
}

impl<'p> Path<'p> {
    /// How many equations are on the way.
    pub fn equations(&self) -> usize {
        let of = |block: &super::Block| {
            (block.table.rows() - block.excluded.len().min(block.table.rows())) * block.measurement.residuals.len()
        };
        self.problem.blocks.iter().map(of).sum()
    }

    /// The problem at λ = `share`.
    ///
    /// # Errors
    /// Where rows cannot be read.
    pub fn at(&self, share: f64) -> Result<Problem<'p>, Undefined> {
        let mut problem = self.problem.clone();
        if share >= 1.0 {
            return Ok(problem);
        }
        for (block, consistent) in problem.blocks.iter_mut().zip(&self.consistent) {
            let of = &block.table;
            let angle: Vec<bool> =
                block.measurement.inputs.iter().map(|input| input.unit.dimension == Dimension::ANGLE).collect();
            let mut table = Table::new(block.measurement.keys.len(), of.width());
            let (mut read, mut other, mut moved) = (Buffer::default(), Buffer::default(), vec![0.0; of.width()]);
            for piece in pieces(of.rows()) {
                let unreadable = |error| Undefined(Box::new(Table::unreadable(&error)));
                let rows = of.read(piece.clone(), &mut read).map_err(unreadable)?;
                let near = consistent.read(piece.clone(), &mut other).map_err(unreadable)?;
                for i in 0..rows.len() {
                    for (k, moved) in moved.iter_mut().enumerate() {
                        let (x, way) = (rows.row(i)[k], rows.row(i)[k] - near.row(i)[k]);
                        let way = if angle[k] { way - TAU * (way / TAU).round() } else { way };
                        *moved = x - (1.0 - share) * way;
                    }
                    let name =
                        |column: usize| of.names(column).get(rows.keys(i)[column] as usize).map_or("", String::as_str);
                    table.push_with(name, &moved, rows.line(i));
                }
            }
            block.table = Arc::new(table);
        }
        Ok(problem)
    }
}
