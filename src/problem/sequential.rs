//! Rows one by one: some of them linearised, one more, one counted otherwise, and what is left of those that are gone.

use std::ops::Range;
use std::sync::Arc;

use super::equations::Sums;
use super::factor::{Linearised, SAMPLE, TILT};
use super::pass::PIECE;
use super::prior::Prior;
use super::solving::turn;
use super::{Problem, Undefined, rotation};
use crate::eval::ROWS;
use crate::linalg::{Matrix, SquareRootInformation};
use crate::solve::{Absorbed, InRows, SequentialState, null_space};

/// A block, and the number of a row in it.
type Row = (usize, usize);

impl<'p> Problem<'p> {
    /// Adds a row of a measurement, and gives its name; none where the rows have to be bound anew, because the row names
    /// what none has named before.
    pub fn push(
        &mut self,
        measurement: usize,
        names: &[&str],
        readings: &[f64],
        line: Option<usize>,
    ) -> Option<(usize, usize)> {
        let number = self.blocks.iter().position(|block| block.index == measurement)?;
        let block = &mut self.blocks[number];
        block.push(names, readings, line).then(|| (number, block.table.rows() - 1))
    }

    /// The same with what is left of rows that are gone. Those that are here must not be among them.
    pub fn with_rows_absorbed(&self, absorbed: Absorbed<Vec<f64>>) -> Problem<'p> {
        let some = absorbed.information.rows() > 0;
        Problem { absorbed: some.then(|| Arc::new(absorbed)), ..self.clone() }
    }

    /// What a state has seen: the rows that it keeps, and what is left of the others.
    pub fn seen_by(&self, state: &SequentialState<Vec<f64>, (usize, usize)>) -> Problem<'p> {
        let mut kept = state.kept().to_vec();
        kept.sort_unstable();
        let gone = |(number, block): (usize, &super::Block)| {
            (0..block.table.rows()).filter(|&row| kept.binary_search(&(number, row)).is_err()).collect::<Vec<_>>()
        };
        let gone: Vec<Vec<usize>> = self.blocks.iter().enumerate().map(gone).collect();
        self.without_rows(&gone).with_rows_absorbed(state.absorbed().clone())
    }

    /// Adds what is left of rows that are gone.
    pub(super) fn with_absorbed(
        &self,
        point: &[f64],
        sums: &mut Sums,
        information: Option<&mut SquareRootInformation>,
    ) -> Result<(), Undefined> {
        let Some(absorbed) = &self.absorbed else { return Ok(()) };
        let (delta, turn) = self.step(&absorbed.point, point);
        let cost = absorbed.cost_at(&delta);
        let rows = absorbed.information.rows();
        sums.cost += cost;
        sums.squares += 2.0 * (cost - absorbed.beyond);
        sums.equations += rows;
        if let Some(all) = information {
            all.merge(&absorbed.information.recentred(&delta, turn.as_ref())?)?;
        }
        Ok(())
    }

    /// `to` ⊖ `from` of the free coordinates, and its derivative by ε in (`to` ⊕ ε) ⊖ `from`, where rotations are free.
    fn step(&self, from: &[f64], to: &[f64]) -> (Vec<f64>, Option<Matrix>) {
        let all = self.difference(from, to);
        let delta = self.of_free(&all);
        let place = self.places();
        let mut turned = None;
        for group in &self.layout.groups {
            let Some(first) = group.shape.rotation() else { continue };
            let at = group.first + first;
            let jacobian = rotation::right_jacobian_inverse(turn(&all, at));
            for i in 0..3 {
                for j in 0..3 {
                    if let (Some(row), Some(column)) = (place[at + i], place[at + j]) {
                        turned.get_or_insert_with(|| Matrix::identity(self.free.len()))[(row, column)] = jacobian[i][j];
                    }
                }
            }
        }
        (delta, turned)
    }

    /// Rows as pieces of each block: neighbours together.
    fn pieces_of(&self, rows: &[Row]) -> Result<Vec<Vec<Range<usize>>>, Undefined> {
        let mut pieces: Vec<Vec<Range<usize>>> = vec![Vec::new(); self.blocks.len()];
        for &(block, row) in rows {
            self.block(block)?.has_row(row)?;
            let of = &mut pieces[block];
            match of.last_mut() {
                Some(last) if last.end == row && last.len() < PIECE => last.end += 1,
                _ => of.push(row..row + 1),
            }
        }
        Ok(pieces)
    }
}

impl InRows for Problem<'_> {
    type Row = Row;

    fn rows(&self) -> Vec<Row> {
        let of = |(number, block): (usize, &super::Block)| {
            let taking_part: Vec<Row> =
                (0..block.table.rows()).filter(|&row| !block.excludes(row)).map(|row| (number, row)).collect();
            taking_part
        };
        self.blocks.iter().enumerate().flat_map(of).collect()
    }

    fn cost_of(&self, rows: &[Row], q: &Vec<f64>) -> Result<f64, Undefined> {
        Ok(self.sums_in(q, &self.pieces_of(rows)?)?.cost)
    }

    fn linearise_rows(&self, rows: &[Row], q: &Vec<f64>) -> Result<(f64, SquareRootInformation), Undefined> {
        let Linearised { information, sums } = self.linearised_in(q, &self.pieces_of(rows)?)?;
        Ok((sums.cost, information))
    }

    fn prior(&self, q: &Vec<f64>) -> Result<(f64, SquareRootInformation), Undefined> {
        let prior = self.with_priors(SquareRootInformation::new(self.free.len()), q)?;
        Ok((0.5 * Prior::sum_of_squares(self, q), prior))
    }

    fn between(&self, from: &Vec<f64>, to: &Vec<f64>) -> (Vec<f64>, Option<Matrix>) {
        self.step(from, to)
    }

    /// Judged where the inputs are consistent with q, by a sample where there are many rows.
    fn invisible_to(
        &self,
        rows: &[Row],
        priors: bool,
        q: &Vec<f64>,
        at: &SquareRootInformation,
    ) -> Result<Vec<Vec<f64>>, Undefined> {
        const MOST: usize = SAMPLE * ROWS;
        let judge = |rows: &[Row]| {
            let data = self.consistent_in(q, &self.pieces_of(rows)?)?;
            let all = if priors { self.with_priors(data, q)? } else { data };
            Ok::<_, Undefined>(null_space(&all, &self.scale)?.basis)
        };
        if rows.len() <= MOST {
            return judge(rows);
        }
        // more rows see more, never less
        let last = rows.len() - ROWS;
        let some: Vec<Row> = (0..SAMPLE)
            .map(|k| last * k / (SAMPLE - 1))
            .flat_map(|first| rows[first..first + ROWS].iter().copied())
            .collect();
        let sample = judge(&some)?;
        if sample.iter().all(|direction| at.rows() > 0 && self.tilt(direction, at) <= TILT) {
            return Ok(sample);
        }
        judge(rows)
    }

    fn set_weight(&mut self, (block, row): Row, weight: f64) {
        let Some(block) = self.blocks.get_mut(block) else { return };
        let excluded = Arc::make_mut(&mut block.excluded);
        match (excluded.binary_search(&row), weight > 0.0) {
            (Ok(at), true) => drop(excluded.remove(at)),
            (Err(at), false) => excluded.insert(at, row),
            _ => {}
        }
        let counted = Arc::make_mut(&mut block.counted);
        if weight > 0.0 && weight != 1.0 {
            counted.insert(row, weight);
        } else {
            counted.remove(&row);
        }
    }
}
