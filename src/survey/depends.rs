//! Whether what should be chance depends on something.

use crate::statistics::{Moments, Test, f_upper_tail};

/// Numbers in a group at least, on average.
const FEWEST: usize = 15;

/// Groups at most.
const MOST: usize = 12;

/// Neighbours along x, and where their y are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Group {
    /// the smallest x
    pub from: f64,
    /// the largest x
    pub to: f64,
    /// of the y
    pub moments: Moments,
}

/// How y goes with x.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependence {
    /// Neighbours along x, about as many in each.
    pub groups: Vec<Group>,
    /// Whether the groups' means differ by more than chance, where the scatter within them can be told.
    pub test: Option<Test>,
}

/// Groups y by x, and compares the scatter of the means with that within groups (one-way analysis of variance):
///
/// > F = Σ nₖ(ȳₖ − ȳ)²/(K − 1) / (Σ (y − ȳₖ)²/(n − K)),  F(K − 1, n − K) where y does not depend on x
///
/// None where x has fewer than two values, or there are too few numbers. R. A. Fisher, Statistical Methods for Research Workers (1925), VII.
pub fn dependence(x: &[f64], y: &[f64]) -> Option<Dependence> {
    let mut pairs: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    pairs.retain(|(x, y)| x.is_finite() && y.is_finite());
    pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
    let n = pairs.len();
    let wanted = (n / FEWEST).min(MOST);
    if wanted < 2 {
        return None;
    }
    let mut groups: Vec<Group> = Vec::with_capacity(wanted);
    for (i, &(x, y)) in pairs.iter().enumerate() {
        // equal x are together
        let full = i >= groups.len() * n / wanted;
        match groups.last_mut() {
            Some(group) if !full || group.to == x => {
                group.to = x;
                group.moments.push(y);
            }
            _ => {
                let mut moments = Moments::default();
                moments.push(y);
                groups.push(Group { from: x, to: x, moments });
            }
        }
    }
    if groups.len() < 2 {
        return None;
    }
    let mut all = Moments::default();
    pairs.iter().for_each(|(_, y)| all.push(*y));
    let (above, below) = (groups.len() - 1, n - groups.len());
    let within: f64 = groups.iter().map(|group| group.moments.squares()).sum();
    let between = (all.squares() - within).max(0.0);
    let statistic = (between / above as f64) / (within / below as f64);
    // what is within may be nothing but rounding
    let told = within > 1e-20 * n as f64 * all.mean().unwrap_or(0.0).powi(2) && statistic.is_finite();
    let upper_tail = f_upper_tail(statistic, above as f64, below as f64).filter(|_| told);
    Some(Dependence { groups, test: upper_tail.map(|upper_tail| Test { statistic, upper_tail }) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

    fn noise(seed: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || -> f64 { (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0 };
        ((0..n).map(|_| draw()).collect(), (0..n).map(|_| draw()).collect())
    }

    /// Under the hypothesis the tail is even: of 400, about 20 below 0.05.
    #[test]
    fn chance_is_seldom_called_a_dependence() {
        let few = (0..400)
            .filter(|&seed| {
                let (x, y) = noise(seed, 300);
                dependence(&x, &y).unwrap().test.unwrap().upper_tail < 0.05
            })
            .count();
        assert!((6..=38).contains(&few), "{few}");
    }

    #[test]
    fn a_trend_and_a_bow_are_found() {
        let (x, y) = noise(1, 300);
        for bend in [0.4_f64, -0.3] {
            let bent: Vec<f64> =
                x.iter().zip(&y).map(|(x, y)| y + bend * if bend > 0.0 { *x } else { x * x }).collect();
            assert!(dependence(&x, &bent).unwrap().test.unwrap().upper_tail < 1e-4);
        }
    }

    #[test]
    fn equal_x_stay_together_and_none_is_lost() {
        let x: Vec<f64> = (0..100).map(|i| f64::from(i % 3)).collect();
        let (_, y) = noise(2, 100);
        let found = dependence(&x, &y).unwrap();
        assert_eq!(found.groups.len(), 3);
        assert_eq!(found.groups.iter().map(|group| group.moments.count()).sum::<f64>(), 100.0);
        assert!(dependence(&[1.0; 50], &[2.0; 50]).is_none());
    }

    #[test]
    fn constant_numbers_have_no_test() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        assert!(dependence(&x, &[0.3; 100]).unwrap().test.is_none());
    }
}
