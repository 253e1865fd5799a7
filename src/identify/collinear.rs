//! Which columns of a Jacobian nearly depend on each other, and whose uncertainties that spoils.
//!
//! With the columns brought to unit length, X = U diag(μ) Vᵀ, each small μₖ is a near dependency. Its condition index is
//! ηₖ = μ₁/μₖ, and the variance of parameter j is a sum over all of them, φⱼ = Σₖ vⱼₖ²/μₖ²; the share πₖⱼ = vⱼₖ²/μₖ²/φⱼ says which
//! of the dependencies it comes from (Belsley, Kuh & Welsch, Regression Diagnostics, 1980, §3.2). Columns of unit length make all of
//! it independent of units and of tolerances.

use crate::linalg::{LinalgError, Matrix, svd};

/// A dependency is worth a word beyond this condition index (Belsley, Kuh & Welsch 1980, §3.3: 30 is moderate to strong).
pub const CONDITION_INDEX: f64 = 30.0;
/// A dependency spoils what it holds more than this share of the variance of.
pub const PROPORTION: f64 = 0.5;
/// A dependency is one between two columns at least.
const LEAST: usize = 2;
/// Members that a sentence names.
const NAMED: usize = 6;

/// The condition indices of a Jacobian, and the variance-decomposition proportions.
#[derive(Clone, Debug, PartialEq)]
pub struct Collinearity {
    /// The columns' parameters.
    pub names: Vec<String>,
    /// η, from 1 on, as many as there are columns; infinite where columns depend on each other exactly.
    pub indices: Vec<f64>,
    /// π, by condition index and then by column: each column's sum to 1. Not a number where an index is infinite.
    pub proportions: Vec<Vec<f64>>,
}

/// A near dependency, and the parameters that it spoils.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependency {
    /// Its condition index.
    pub index: f64,
    /// Those with more than [`PROPORTION`] of their variance from it, the largest first.
    pub members: Vec<(String, f64)>,
}

impl Collinearity {
    /// Of the columns of a Jacobian, or of its triangular factor. A column of zeros has no direction: it is left out.
    ///
    /// # Errors
    /// Where an entry is not finite.
    ///
    /// ```
    /// use phical::identify::Collinearity;
    /// use phical::linalg::Matrix;
    /// // two columns at an angle with cosine 0.999, and one across
    /// let c: f64 = 0.999;
    /// let x = Matrix::from_rows(3, &[[1.0, 2.0 * c, 0.0], [0.0, 2.0 * (1.0 - c * c).sqrt(), 0.0], [0.0, 0.0, 7.0]]);
    /// let found = Collinearity::new(vec!["a".into(), "b".into(), "z".into()], &x)?;
    /// let near = found.dependencies();
    /// assert!((near[0].index - ((1.0 + c) / (1.0 - c)).sqrt()).abs() < 1e-9);
    /// assert!(near[0].sentence().starts_with("`a` and `b` are nearly collinear: condition index 45"));
    /// # Ok::<(), phical::linalg::LinalgError>(())
    /// ```
    pub fn new(mut names: Vec<String>, columns: &Matrix) -> Result<Collinearity, LinalgError> {
        let lengths = columns.column_norms();
        let seen: Vec<usize> = (0..columns.columns()).filter(|&j| lengths[j] > 0.0).collect();
        names = seen.iter().map(|&j| std::mem::take(&mut names[j])).collect();
        let unit = |&j: &usize| columns.column(j).iter().map(|x| x / lengths[j]).collect();
        let unit: Vec<Vec<f64>> = seen.iter().map(unit).collect();
        let found = svd(&Matrix::from_columns(columns.rows(), &unit))?;
        let n = seen.len();
        let part = |k: usize, j: usize| (found.v[(j, k)] / found.sigma[k]).powi(2);
        let variance: Vec<f64> = (0..n).map(|j| (0..n).map(|k| part(k, j)).sum()).collect();
        Ok(Collinearity {
            names,
            indices: found.sigma.iter().map(|sigma| found.sigma[0] / sigma).collect(),
            proportions: (0..n).map(|k| (0..n).map(|j| part(k, j) / variance[j]).collect()).collect(),
        })
    }

    /// What is worth a word: condition indices beyond [`CONDITION_INDEX`] with two or more proportions beyond [`PROPORTION`], the
    /// worst first.
    pub fn dependencies(&self) -> Vec<Dependency> {
        let of = |(&index, proportions): (&f64, &Vec<f64>)| {
            let all = self.names.iter().cloned().zip(proportions.iter().copied());
            let mut members: Vec<(String, f64)> = all.filter(|(_, proportion)| *proportion > PROPORTION).collect();
            members.sort_by(|a, b| b.1.total_cmp(&a.1));
            (index > CONDITION_INDEX && members.len() >= LEAST).then_some(Dependency { index, members })
        };
        self.indices.iter().zip(&self.proportions).rev().filter_map(of).collect()
    }
}

impl Dependency {
    /// Who depends on whom, how strongly, and how much of their variances comes from it.
    pub fn sentence(&self) -> String {
        let named: Vec<String> = self.members.iter().take(NAMED).map(|(name, _)| format!("`{name}`")).collect();
        let more = self.members.len().saturating_sub(NAMED);
        let names = match &named[..] {
            _ if more > 0 => format!("{} and {more} more", named.join(", ")),
            [first @ .., last] => format!("{} and {last}", first.join(", ")),
            [] => String::new(),
        };
        let least = self.members.iter().fold(1.0, |least: f64, (_, proportion)| least.min(*proportion));
        format!(
            "{names} are nearly collinear: condition index {:.0}, from which {:.0} % or more of each one's variance comes",
            self.index,
            (100.0 * least).floor()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(n: usize) -> Vec<String> {
        (0..n).map(|j| format!("p{j}")).collect()
    }

    /// Two unit columns at an angle with cosine c: μ² = 1 ± c, v = (1, ±1)/√2, so η = √((1 + c)/(1 − c)) and π = (1 + c)/2.
    #[test]
    fn closed_form() {
        for c in [0.5_f64, 0.99, -0.9999] {
            let lengths = [3.0, 1e-4, 800.0];
            let unit = [[1.0, c, 0.0], [0.0, (1.0 - c * c).sqrt(), 0.0], [0.0, 0.0, 1.0]];
            let found = Collinearity::new(names(3), &Matrix::from_rows(3, &unit).scale_columns(&lengths)).unwrap();
            let c = c.abs();
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-10 * b.max(1.0), "{a} {b}");
            close(found.indices[0], 1.0);
            close(found.indices[1], (1.0 + c).sqrt());
            close(found.indices[2], ((1.0 + c) / (1.0 - c)).sqrt());
            for (k, expected) in
                [[(1.0 - c) / 2.0, (1.0 - c) / 2.0, 0.0], [0.0, 0.0, 1.0], [(1.0 + c) / 2.0, (1.0 + c) / 2.0, 0.0]]
                    .iter()
                    .enumerate()
            {
                found.proportions[k].iter().zip(expected).for_each(|(a, b)| close(*a, *b));
            }
            let told = found.dependencies();
            assert_eq!(told.len(), usize::from(c > 0.999), "{c}");
            if let Some(only) = told.first() {
                assert_eq!(only.members.len(), 2);
                assert_eq!(
                    only.sentence(),
                    "`p0` and `p1` are nearly collinear: condition index 141, from which 99 % or more of each one's variance comes"
                );
            }
        }
    }

    #[test]
    fn columns_of_zeros_and_single_ones_depend_on_nothing() {
        let found = Collinearity::new(names(2), &Matrix::from_rows(2, &[[0.0, 2.0], [0.0, 1.0]])).unwrap();
        assert_eq!(
            (found.names, found.indices, found.proportions),
            (vec!["p1".to_owned()], vec![1.0], vec![vec![1.0]])
        );
        let none = Collinearity::new(Vec::new(), &Matrix::zeros(0, 0)).unwrap();
        assert!(none.indices.is_empty() && none.dependencies().is_empty());
    }
}
