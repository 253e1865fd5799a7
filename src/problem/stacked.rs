//! All whitened equations one by one, for costs that are no sums of squares.

use super::equations::Equations;
use super::factor::columns_of;
use super::pass::{pieces, spans};
use super::prior::Prior;
use super::{Problem, Undefined};
use crate::eval::ROWS;
use crate::linalg::Matrix;
use crate::solve::Stacked;

impl Problem<'_> {
    /// Whitened equations and their derivatives by the free coordinates in the order of blocks, rows and residuals, zeros for rows
    /// that take no part; then the priors.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined.
    pub fn all_equations(&self, point: &[f64]) -> Result<Stacked, Undefined> {
        self.layout.fits(point)?;
        let (n, place) = (self.free.len(), self.places());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for block in &self.blocks {
            let jacobian = Equations::jacobian(self, block);
            let m = block.measurement.residuals.len();
            let residuals = jacobian.columns.len() * m;
            let mut equations = Equations::with_derivatives(self, block, point);
            for piece in pieces(block.table.rows()) {
                spans(block, piece, |span| {
                    let found = equations.run(span)?;
                    for (row, &combination) in span.combination.iter().enumerate() {
                        let columns = columns_of(self, block, jacobian, &place, combination as usize);
                        for i in 0..m {
                            let mut entries = vec![0.0; n + 1];
                            for &(to, k) in &columns {
                                // two members that a row names can be one
                                entries[to] += found[(k * m + i) * ROWS + row];
                            }
                            entries[n] = found[(residuals + i) * ROWS + row];
                            rows.push(entries);
                        }
                    }
                    Ok(())
                })?;
            }
        }
        let priors = Prior::rows(self, point);
        rows.extend((0..priors.rows()).map(|i| (0..=n).map(|j| priors[(i, j)]).collect()));
        let residual = rows.iter().map(|row| row[n]).collect();
        Ok(Stacked { jacobian: Matrix::from_rows(n, &rows), residual, priors: priors.rows() })
    }
}
