//! A [`Problem`] as a solver sees it.

use super::Problem;
use super::factor::Linearised;
use super::prior::Prior;
use super::rotation;
use crate::diag::{Code, Diagnostic};
use crate::linalg::{LinalgError, SquareRootInformation};
use crate::solve::{Constraint, LeastSquares, Stacked};
use crate::unit::Dimension;

/// Why the residuals have no value or no derivative at a point.
#[derive(Clone, Debug)]
pub struct Undefined(pub Box<Diagnostic>);

impl From<LinalgError> for Undefined {
    fn from(error: LinalgError) -> Self {
        Undefined(Box::new(Diagnostic::error(Code::UndefinedAtStart, error.to_string())))
    }
}

impl std::fmt::Display for Undefined {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.message)
    }
}

impl std::error::Error for Undefined {}

impl Problem<'_> {
    /// Whether a point has a number for each coordinate.
    ///
    /// # Errors
    /// Where it has fewer or more.
    pub fn fits(&self, point: &[f64]) -> Result<(), Undefined> {
        self.layout.fits(point)
    }

    /// The place of each coordinate among the free ones.
    pub fn places(&self) -> Vec<Option<usize>> {
        let mut place = vec![None; self.layout.coordinates.len()];
        for (k, &coordinate) in self.free.iter().enumerate() {
            place[coordinate] = Some(k);
        }
        place
    }

    /// The free coordinates, in their order.
    pub fn free_coordinates(&self) -> impl ExactSizeIterator<Item = &super::Coordinate> + Clone {
        self.free.iter().map(|&c| &self.layout.coordinates[c])
    }

    /// The numbers of the free coordinates among those of all, such as a point or a [`difference`](Self::difference).
    pub fn of_free(&self, all: &[f64]) -> Vec<f64> {
        self.free.iter().map(|&c| number(all, c)).collect()
    }

    /// The size of a coordinate's value at a point, of which rounding is a share.
    pub(super) fn size(&self, coordinate: usize, q: &[f64]) -> f64 {
        let known = &self.layout.coordinates[coordinate];
        let least = if known.dimension == Dimension::ANGLE { 1.0 } else { known.tolerance };
        number(q, coordinate).abs().max(least)
    }
}

/// A coordinate of a point; a point that is too short, which is refused wherever something is evaluated, has no number there.
pub(super) fn number(point: &[f64], coordinate: usize) -> f64 {
    point.get(coordinate).copied().unwrap_or(f64::NAN)
}

/// The rotation vector that begins at a coordinate.
pub(super) fn turn(point: &[f64], first: usize) -> [f64; 3] {
    [0, 1, 2].map(|k| number(point, first + k))
}

impl LeastSquares for Problem<'_> {
    type Point = Vec<f64>;
    type Error = Undefined;

    fn dimension(&self) -> usize {
        self.free.len()
    }

    fn cost(&self, q: &Vec<f64>) -> Result<f64, Undefined> {
        Ok(self.sums(q)?.cost + 0.5 * Prior::sum_of_squares(self, q))
    }

    fn linearise(&self, q: &Vec<f64>) -> Result<SquareRootInformation, Undefined> {
        self.with_priors(self.linearised(q)?.information, q)
    }

    fn evaluate(&self, q: &Vec<f64>) -> Result<(f64, SquareRootInformation), Undefined> {
        let Linearised { information, sums } = self.linearised(q)?;
        let cost = sums.cost + 0.5 * Prior::sum_of_squares(self, q);
        Ok((cost, self.with_priors(information, q)?))
    }

    fn retract(&self, q: &Vec<f64>, delta: &[f64]) -> Vec<f64> {
        let mut moved = q.clone();
        moved.resize(self.layout.coordinates.len(), f64::NAN);
        let mut turns = vec![[0.0; 3]; self.layout.groups.len()];
        for (&coordinate, &step) in self.free.iter().zip(delta) {
            let known = &self.layout.coordinates[coordinate];
            let group = &self.layout.groups[known.group];
            match group.shape.rotation() {
                Some(first) if coordinate - group.first >= first => {
                    turns[known.group][coordinate - group.first - first] = step;
                }
                // all the way to a bound is that bound, whatever rounding makes of the sum
                _ if step <= known.min - moved[coordinate] => moved[coordinate] = known.min,
                _ if step >= known.max - moved[coordinate] => moved[coordinate] = known.max,
                _ => moved[coordinate] = (moved[coordinate] + step).clamp(known.min, known.max),
            }
        }
        for (group, turn) in self.layout.groups.iter().zip(turns) {
            if let Some(first) = group.shape.rotation() {
                let at = group.first + first;
                let composed = rotation::compose(self::turn(&moved, at), turn);
                moved[at..at + 3].copy_from_slice(&composed);
            }
        }
        moved
    }

    fn offset(&self, q: &Vec<f64>) -> Vec<f64> {
        self.of_free(&Prior::offsets(self, q))
    }

    fn scale(&self) -> &[f64] {
        &self.scale
    }

    /// The value itself, since 3000 mm carry the rounding of 3000 mm; an angle's sine and cosine that of one.
    fn magnitude(&self, q: &Vec<f64>) -> Vec<f64> {
        self.free.iter().map(|&c| self.size(c, q)).collect()
    }

    fn bounds(&self, q: &Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let bound = |f: fn(&super::Coordinate) -> f64| {
            self.free.iter().map(|&c| f(&self.layout.coordinates[c]) - number(q, c)).collect()
        };
        (bound(|c| c.min), bound(|c| c.max))
    }

    fn stopped(&self) -> bool {
        self.execution.stopped()
    }

    /// The model's, without those in which nothing is free: in the order of [`Problem::constrained`].
    fn constraints(&self, q: &Vec<f64>) -> Result<Vec<Constraint>, Undefined> {
        self.linearised_constraints(q)
    }

    /// Whitened equations in the order of blocks and rows.
    fn stacked(&self, q: &Vec<f64>) -> Result<Option<Stacked>, Undefined> {
        self.all_equations(q).map(Some)
    }

    /// Judged where the inputs are consistent with q.
    fn invisible(&self, q: &Vec<f64>, at: &SquareRootInformation) -> Result<Vec<Vec<f64>>, Undefined> {
        Ok(self.visible(q, true, at)?.basis)
    }
}
