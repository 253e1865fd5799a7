//! The covariance of an estimate from its triangular factor.

use crate::linalg::{LinalgError, Matrix, SquareRootInformation, dot, norm, orthonormalise, same_size, solve_upper};

/// What does not move to first order, beside what is invisible.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// Whether each coordinate is on a bound.
    pub on_bound: Vec<bool>,
    /// The gradients of the constraints that hold as equations.
    pub gradients: Vec<Vec<f64>>,
}

impl Held {
    /// Nothing, of so many coordinates.
    pub fn nothing(coordinates: usize) -> Held {
        Held { on_bound: vec![false; coordinates], gradients: Vec::new() }
    }
}

/// A covariance matrix of the free coordinates; zero rows and columns for those that are on a bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    /// Row by row.
    pub entries: Vec<Vec<f64>>,
    root: Vec<Vec<f64>>,
}

impl Covariance {
    /// C of min ‖R δ + d‖ where what is `held` does not move, and directions of `invisible` (orthonormal in z = δ/scale) are
    /// those of the minimum-norm datum: C = S B (Mᵀ M)⁻¹ Bᵀ S with M = R S B, the columns of B an orthonormal basis of what is
    /// visible and may move.
    ///
    /// # Errors
    /// Where what remains has no full rank, or what is held or invisible is of another size than the scale.
    pub fn new(
        information: &SquareRootInformation,
        scale: &[f64],
        invisible: &[Vec<f64>],
        held: &Held,
    ) -> Result<Covariance, LinalgError> {
        let n = scale.len();
        for found in
            invisible.iter().chain(&held.gradients).map(Vec::len).chain([information.dimension(), held.on_bound.len()])
        {
            same_size(n, found)?;
        }
        let unit = |j: usize| {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            unit
        };
        let scaled = |z: &[f64]| z.iter().zip(scale).map(|(z, s)| z * s).collect::<Vec<f64>>();
        let mut basis: Vec<Vec<f64>> = Vec::new();
        if invisible.is_empty() && held.gradients.is_empty() {
            // the unit vectors themselves: no digit is lost to a change of basis
            basis.extend((0..n).filter(|&j| !held.on_bound[j]).map(|j| scaled(&unit(j))));
        } else {
            let mut hidden = invisible.to_vec();
            hidden.extend((0..n).filter(|&j| held.on_bound[j]).map(unit));
            // aᵀδ = (S a)ᵀz
            hidden.extend(held.gradients.iter().map(|gradient| scaled(gradient)));
            orthonormalise(&mut hidden);
            // what Gram–Schmidt leaves of the unit vectors is the complement
            let (fixed, mut all) = (hidden.len(), hidden);
            all.extend((0..n).map(unit));
            orthonormalise(&mut all);
            basis.extend(all[fixed..].iter().map(|z| scaled(z)));
        }
        let k = basis.len();
        let columns: Vec<Vec<f64>> = basis.iter().map(|delta| information.r().mul_vec(delta)).collect();
        let m = Matrix::from_columns(n, &columns);
        let factor = SquareRootInformation::from_rows(&m, &vec![0.0; n])?;
        // root = S B M⁻¹, one column for each column of the inverse: C = root rootᵀ
        let mut root = vec![vec![0.0; n]; k];
        for (i, column) in root.iter_mut().enumerate() {
            let mut unit = vec![0.0; k];
            unit[i] = 1.0;
            let inverse = solve_upper(factor.r(), &unit)?;
            for (weight, delta) in inverse.iter().zip(&basis) {
                for (entry, d) in column.iter_mut().zip(delta) {
                    *entry += weight * d;
                }
            }
        }
        Covariance::from_root(root, n)
    }

    /// Columns whose products with themselves sum to it: C = root·rootᵀ.
    pub fn root(&self) -> &[Vec<f64>] {
        &self.root
    }

    /// The covariance of errors that are `factor` times as large.
    pub fn scaled(&self, factor: f64) -> Covariance {
        let times = |rows: &[Vec<f64>], by: f64| rows.iter().map(|row| row.iter().map(|x| by * x).collect()).collect();
        Covariance { entries: times(&self.entries, factor * factor), root: times(&self.root, factor) }
    }

    /// S C Sᵀ with S = I − N (N_P)⁻¹ E_P (Baarda 1973): the covariance at the datum that holds the coordinates P, where the columns
    /// of N, `invisible`, are directions that the data do not see.
    ///
    /// # Errors
    /// Where P does not fix them, is not as many, or one is not among the coordinates.
    pub fn with_datum(&self, invisible: &[Vec<f64>], held: &[usize]) -> Result<Covariance, LinalgError> {
        let k = invisible.len();
        if held.len() != k {
            return Err(LinalgError::Shape { expected: k, found: held.len() });
        }
        let n = self.entries.len();
        invisible.iter().try_for_each(|direction| same_size(n, direction.len()))?;
        if let Some(&found) = held.iter().find(|&&p| p >= n) {
            return Err(LinalgError::Shape { expected: n, found });
        }
        // rows of N_P brought to one size, for metres stand beside radians
        let rows: Vec<Vec<f64>> = held.iter().map(|&p| invisible.iter().map(|n| n[p]).collect()).collect();
        let sizes: Vec<f64> = rows.iter().map(|row| norm(row)).collect();
        if let Some(empty) = sizes.iter().position(|size| *size == 0.0) {
            return Err(LinalgError::Singular(empty));
        }
        let scaled: Vec<Vec<f64>> =
            rows.iter().zip(&sizes).map(|(row, size)| row.iter().map(|x| x / size).collect()).collect();
        let matrix = Matrix::from_rows(k, &scaled);
        let moved = |column: &Vec<f64>| {
            let wanted: Vec<f64> = held.iter().zip(&sizes).map(|(&p, size)| -column[p] / size).collect();
            let factor = SquareRootInformation::from_rows(&matrix, &wanted)?;
            let negative: Vec<f64> = factor.d().iter().map(|d| -d).collect();
            let weights = solve_upper(factor.r(), &negative)?;
            let mut column = column.clone();
            for (weight, direction) in weights.iter().zip(invisible) {
                column.iter_mut().zip(direction).for_each(|(x, n)| *x -= weight * n);
            }
            held.iter().for_each(|&p| column[p] = 0.0);
            Ok(column)
        };
        let root = self.root.iter().map(moved).collect::<Result<Vec<_>, LinalgError>>()?;
        Covariance::from_root(root, n)
    }

    fn from_root(root: Vec<Vec<f64>>, n: usize) -> Result<Covariance, LinalgError> {
        let entry = |i: usize, j: usize| root.iter().map(|column| column[i] * column[j]).sum::<f64>();
        let entries: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
        if entries.iter().flatten().any(|value| !value.is_finite()) {
            return Err(LinalgError::NotFinite);
        }
        Ok(Covariance { entries, root })
    }

    /// The variance of a quantity with this gradient by the free coordinates.
    pub fn variance_of(&self, gradient: &[f64]) -> f64 {
        self.root.iter().map(|column| dot(column, gradient).powi(2)).sum()
    }

    /// The standard deviation of a coordinate; that of one that there is not is no number.
    pub fn sigma(&self, i: usize) -> f64 {
        let variance = self.entries.get(i).and_then(|row| row.get(i));
        variance.map_or(f64::NAN, |variance| variance.max(0.0).sqrt())
    }

    /// The correlation of two coordinates, `None` where one has no variance, or there is none of them.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let (a, b) = (self.sigma(i), self.sigma(j));
        (a > 0.0 && b > 0.0).then(|| if i == j { 1.0 } else { (self.entries[i][j] / (a * b)).clamp(-1.0, 1.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn information(rows: &[[f64; 3]]) -> SquareRootInformation {
        SquareRootInformation::from_rows(&Matrix::from_rows(3, rows), &vec![0.0; rows.len()]).unwrap()
    }

    /// x and y measured with σ 1 and 2, x + y known: they are one measurement of the difference; the variance is 1/(1 + ¼).
    #[test]
    fn what_a_constraint_holds_has_no_variance() {
        let all = information(&[[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]]);
        let known = Held { gradients: vec![vec![3.0, 3.0, 0.0], vec![-1.0, -1.0, 0.0]], ..Held::nothing(3) };
        let c = Covariance::new(&all, &[1.0, 7.0, 0.1], &[], &known).unwrap();
        for i in 0..2 {
            assert!((c.sigma(i) - 0.8f64.sqrt()).abs() < 1e-14);
        }
        assert!(c.variance_of(&[1.0, 1.0, 0.0]) < 1e-28);
        assert!((c.sigma(2) - 1.0).abs() < 1e-14);
        let both = Held { on_bound: vec![true, false, false], ..known };
        let c = Covariance::new(&all, &[1.0, 7.0, 0.1], &[], &both).unwrap();
        assert!(c.sigma(0) < 1e-14 && c.sigma(1) < 1e-14 && (c.sigma(2) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn independent_measurements_have_their_own_variances() {
        let all = information(&[[2.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 0.5]]);
        let c = Covariance::new(&all, &[1.0; 3], &[], &Held::nothing(3)).unwrap();
        assert_eq!([c.sigma(0), c.sigma(1), c.sigma(2)], [0.5, 0.25, 2.0]);
        assert_eq!(c.correlation(0, 1), Some(0.0));
        let c = Covariance::new(&all, &[1.0; 3], &[], &Held { on_bound: vec![false, true, false], gradients: vec![] })
            .unwrap();
        assert_eq!([c.sigma(0), c.sigma(1), c.sigma(2)], [0.5, 0.0, 2.0]);
    }

    #[test]
    fn a_difference_alone_has_the_minimum_norm_variance() {
        // x − y is measured with σ = 1: at the datum x + y = const each moves by half of it
        let all = information(&[[1.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]);
        let half = 0.5f64.sqrt();
        let c = Covariance::new(&all, &[1.0; 3], &[vec![half, half, 0.0]], &Held::nothing(3)).unwrap();
        for i in 0..2 {
            assert!((c.sigma(i) - 0.5).abs() < 1e-15);
        }
        assert!((c.correlation(0, 1).unwrap() + 1.0).abs() < 1e-12);
        assert!((c.sigma(2) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_change_of_datum_is_the_covariance_with_it_held() {
        // x − y and y + z are measured: one direction (1, 1, −1) is not seen
        let all = information(&[[2.0, -2.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]]);
        let third = 1.0 / 3.0_f64.sqrt();
        let direction = vec![third, third, -third];
        let free = Covariance::new(&all, &[1.0; 3], std::slice::from_ref(&direction), &Held::nothing(3)).unwrap();
        for held in 0..3 {
            let mut one = Held::nothing(3);
            one.on_bound[held] = true;
            let expected = Covariance::new(&all, &[1.0; 3], &[], &one).unwrap();
            let found = free.with_datum(std::slice::from_ref(&direction), &[held]).unwrap();
            for (a, b) in found.entries.iter().flatten().zip(expected.entries.iter().flatten()) {
                assert!((a - b).abs() < 1e-14, "{:?} {:?}", found.entries, expected.entries);
            }
        }
        assert!(free.with_datum(&[direction], &[]).is_err());
        assert!(free.with_datum(&[vec![0.0, 1.0, 0.0]], &[0]).is_err());
    }
}
