//! The rows again, with inputs that are consistent with a point: what a model can see is judged there.

use super::Problem;
use super::adjusted::Adjuster;
use super::pass::{pieces, spans};
use super::solving::Undefined;
use crate::data::Table;

/// Tables whose rows have inputs for which all residuals vanish.
#[derive(Clone, Debug)]
pub struct Consistent {
    /// By measurement number, ready to be bound.
    pub tables: Vec<(usize, Table)>,
    /// Rows without such inputs near theirs, which are left out.
    pub left_out: usize,
    /// By table, the number that each of its rows had.
    pub kept: Vec<Vec<usize>>,
}

impl Problem<'_> {
    /// Moves the inputs of every row, as little as possible, to where its residuals vanish at a point.
    ///
    /// # Errors
    /// Where the rows cannot be read.
    pub fn consistent(&self, point: &[f64]) -> Result<Consistent, Undefined> {
        self.layout.fits(point)?;
        let mut all = Consistent { tables: Vec::new(), left_out: 0, kept: Vec::new() };
        for block in &self.blocks {
            let mut adjuster = Adjuster::new(self, block, point);
            let width = block.table.width();
            let mut table = Table::new(block.measurement.keys.len(), width);
            let (mut adjusted, mut kept) = (Vec::new(), Vec::new());
            for piece in pieces(block.table.rows()) {
                spans(block, piece, |span| {
                    adjusted.clear();
                    adjusted.extend_from_slice(span.readings);
                    adjuster.adjust(span.combination, &mut adjusted);
                    for (i, good) in adjuster.holds(span.combination, &adjusted).into_iter().enumerate() {
                        let row = span.first + i;
                        if !good || block.excludes(row) {
                            all.left_out += 1;
                            continue;
                        }
                        kept.push(row);
                        table.push_with(|key| block.table.key(row, key), &adjusted[i * width..(i + 1) * width], None);
                    }
                    Ok(())
                })?;
            }
            all.tables.push((block.index, table));
            all.kept.push(kept);
        }
        Ok(all)
    }
}
