//! Losses of a whole problem: taken away, made convex, given a scale.

use super::Problem;
use super::robust::RowLoss;
use super::solving::Undefined;
use crate::statistics::norm_scale;

impl<'p> Problem<'p> {
    fn with_losses(&self, of: impl Fn(usize, &RowLoss) -> Option<RowLoss>) -> Problem<'p> {
        let mut other = self.clone();
        for block in &mut other.blocks {
            block.loss = block.loss.as_ref().and_then(|loss| of(block.measurement.residuals.len(), loss));
        }
        other
    }

    /// Whether any rows have a loss.
    pub fn is_robust(&self) -> bool {
        self.blocks.iter().any(|block| block.loss.is_some())
    }

    /// Whether any have one of their length, by which they are weighted as a whole.
    pub fn robust_rows(&self) -> bool {
        self.blocks.iter().any(|block| block.loss.as_ref().is_some_and(|loss| !loss.of_inputs()))
    }

    /// Whether a loss gives up what is far off, so that the way to the minimum has to begin near it.
    pub fn redescends(&self) -> bool {
        self.blocks.iter().any(|block| block.loss.as_ref().is_some_and(|loss| loss.loss().kernel().redescending()))
    }

    /// The same rows with their squares.
    pub fn without_loss(&self) -> Problem<'p> {
        self.with_losses(|_, _| None)
    }

    /// The same rows with Huber's loss, which never gives up a row.
    pub fn with_convex_losses(&self) -> Problem<'p> {
        self.with_losses(|m, loss| Some(loss.convex(m)))
    }

    /// The same rows with other scales of their losses, by block.
    pub fn with_scales(&self, scales: &[Option<f64>]) -> Problem<'p> {
        let mut other = self.clone();
        for (block, scale) in other.blocks.iter_mut().zip(scales) {
            if let (Some(loss), Some(scale)) = (&mut block.loss, scale) {
                *loss = loss.with_scale(*scale);
            }
        }
        other
    }

    /// The scale of each block's whitened residuals at a point, from the middle of its rows' lengths, where its loss wants it
    /// estimated.
    ///
    /// # Errors
    /// Where a residual is undefined.
    pub fn estimated_scales(&self, point: &[f64]) -> Result<Vec<Option<f64>>, Undefined> {
        let plain = self.without_loss();
        let mut lengths: Vec<Vec<f64>> = vec![Vec::new(); self.blocks.len()];
        plain.lengths(point, |block, length| lengths[block].push(length))?;
        let scale = |(block, lengths): (&super::Block, &mut Vec<f64>)| {
            let wanted = block.loss.as_ref().is_some_and(|loss| loss.scale_is_estimated());
            let scale = wanted.then(|| norm_scale(lengths, block.measurement.residuals.len())).flatten();
            scale.filter(|scale| *scale > 0.0)
        };
        Ok(self.blocks.iter().zip(&mut lengths).map(scale).collect())
    }

    /// The scale of each block's loss, where there is one.
    pub fn scales(&self) -> Vec<Option<f64>> {
        self.blocks.iter().map(|block| block.loss.as_ref().map(RowLoss::scale)).collect()
    }

    /// What large residuals count, in words, where not their squares.
    pub fn robust_name(&self) -> Option<String> {
        let names: Vec<String> = self.blocks.iter().filter_map(|block| Some(block.loss.as_ref()?.name())).collect();
        let mut different: Vec<&String> = Vec::new();
        for name in &names {
            if !different.contains(&name) {
                different.push(name);
            }
        }
        let all = different.into_iter().cloned().collect::<Vec<_>>().join(", ");
        (!all.is_empty()).then_some(all)
    }

    /// The same rows without some, by block: rows as numbers.
    pub fn without_rows(&self, rows: &[Vec<usize>]) -> Problem<'p> {
        let mut other = self.clone();
        for (block, rows) in other.blocks.iter_mut().zip(rows) {
            let mut all: Vec<usize> = block.excluded.iter().chain(rows).copied().collect();
            all.sort_unstable();
            all.dedup();
            block.excluded = std::sync::Arc::new(all);
        }
        other
    }
}
