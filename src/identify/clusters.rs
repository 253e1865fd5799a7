//! Which parameters cannot be told from which: clusters of correlation, and collinearity of each with all others.

use crate::fit::Covariance;
use crate::linalg::SquareRootInformation;

/// Parameters that are correlated by more than this belong to one cluster.
pub const CORRELATED: f64 = 0.9;

/// Parameters that hang together by large correlations.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// Its members, by their place among the free coordinates.
    pub members: Vec<usize>,
    /// The largest correlation in it, with its sign.
    pub strongest: f64,
}

/// Connected groups of two or more, the most strongly correlated first. `known` says which coordinates take part.
pub fn clusters(covariance: &Covariance, known: &[bool]) -> Vec<Cluster> {
    let n = known.len();
    let mut done: Vec<bool> = known.iter().map(|known| !known).collect();
    let mut all = Vec::new();
    for seed in 0..n {
        if std::mem::replace(&mut done[seed], true) {
            continue;
        }
        let mut cluster = Cluster { members: vec![seed], strongest: 0.0 };
        let mut next = 0;
        while let Some(&i) = cluster.members.get(next) {
            next += 1;
            for j in (0..n).filter(|&j| known[j] && j != i) {
                let Some(rho) = covariance.correlation(i, j).filter(|rho| rho.abs() > CORRELATED) else { continue };
                if rho.abs() > cluster.strongest.abs() {
                    cluster.strongest = rho;
                }
                if !std::mem::replace(&mut done[j], true) {
                    cluster.members.push(j);
                }
            }
        }
        if cluster.members.len() > 1 {
            cluster.members.sort_unstable();
            all.push(cluster);
        }
    }
    all.sort_by(|a, b| b.strongest.abs().total_cmp(&a.strongest.abs()));
    all
}

/// R² of each column of the Jacobian by all the others: 1 − 1/VIF with the variance inflation factor VIF = Cⱼⱼ ‖Rⱼ‖²
/// (Belsley, Kuh & Welsch 1980, §3.1; about the origin, for a calibration has no constant term). None where nothing is known.
pub fn multiple_correlations(
    information: &SquareRootInformation,
    covariance: &Covariance,
    known: &[bool],
) -> Vec<Option<f64>> {
    let lengths = information.r().column_norms();
    let of = |(j, length): (usize, &f64)| {
        let inflation = (covariance.sigma(j) * length).powi(2);
        (known[j] && inflation > 0.0).then(|| (1.0 - 1.0 / inflation).max(0.0))
    };
    lengths.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Held;
    use crate::linalg::Matrix;

    #[test]
    fn near_columns_make_a_cluster() {
        // columns 0 and 1 at an angle with cosine c: correlation −c, R² c²; column 2 is alone
        let c: f64 = 0.99;
        let r = Matrix::from_rows(3, &[[1.0, c, 0.0], [0.0, (1.0 - c * c).sqrt(), 0.0], [0.0, 0.0, 5.0]]);
        let information = SquareRootInformation::from_rows(&r, &[0.0; 3]).unwrap();
        let covariance = Covariance::new(&information, &[1.0; 3], &[], &Held::nothing(3)).unwrap();
        let found = clusters(&covariance, &[true; 3]);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].members, [0, 1]);
        assert!((found[0].strongest + c).abs() < 1e-12);
        let squares = multiple_correlations(&information, &covariance, &[true; 3]);
        assert!((squares[0].unwrap() - c * c).abs() < 1e-12 && squares[2].unwrap() < 1e-12);
        assert!(clusters(&covariance, &[true, false, true]).is_empty());
    }
}
