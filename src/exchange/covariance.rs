//! The covariance of exported numbers: *V = G C Gᵀ* with the covariance C of a fit (JCGM 102:2011, 6.2) and the exact derivatives G of the
//! conversion, by dual numbers.

use super::chain::{ChainValues, LANES, Lanes, partials};
use super::serial::Serial;
use crate::fit::JointUncertainty;

/// A number whose tolerance-scaled gradient has a larger share than this along what is not known depends on it.
const DEPENDS: f64 = 1e-6;

/// How well exported numbers are known together.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    /// By number and number; none where one of the two depends on what the fit does not determine.
    pub matrix: Vec<Vec<Option<f64>>>,
    /// The parameters that keep numbers from having an uncertainty.
    pub because: Vec<String>,
}

impl Covariance {
    /// The standard uncertainty of a number.
    pub fn sigma(&self, number: usize) -> Option<f64> {
        let variance = self.matrix.get(number)?.get(number).copied().flatten()?;
        Some(variance.max(0.0).sqrt())
    }
}

/// How numbers that are made of a chain change with its parameters: by number, then by coordinate, in internal units.
pub(super) fn gradients(
    chain: &ChainValues,
    convert: impl Fn(&Serial<Lanes>) -> Option<Vec<Lanes>>,
) -> Option<Vec<Vec<f64>>> {
    let n = chain.coordinates.len();
    let mut all: Vec<Vec<f64>> = Vec::new();
    for first in (0..n.max(1)).step_by(LANES) {
        let numbers = convert(&chain.lanes(first))?;
        all.resize(numbers.len(), Vec::with_capacity(n));
        for (row, number) in all.iter_mut().zip(&numbers) {
            row.extend(partials(number).into_iter().take(n - first));
        }
    }
    Some(all)
}

/// A standard uncertainty below this share of a number's size is rounding.
const ROUNDING: f64 = 1e-13;

/// The covariance of numbers with these gradients; `size` is what a number of each place is like.
pub(super) fn covariance(
    chain: &ChainValues,
    known: &JointUncertainty,
    gradients: &[Vec<f64>],
    size: impl Fn(usize) -> f64,
) -> Covariance {
    let m = gradients.len();
    let nothing = Covariance { matrix: vec![vec![None; m]; m], because: Vec::new() };
    let Some(of_fit) = known.covariance.as_ref().filter(|_| known.is_complete()) else { return nothing };
    // the fit's parameters that the chain has, with their place among its coordinates
    let places: Vec<Option<usize>> =
        known.names.iter().map(|name| chain.coordinates.iter().position(|own| own == name)).collect();
    // by parameter of the fit, in its reported units
    let by_fit = |gradient: &Vec<f64>| -> Vec<f64> {
        let entry = |place: &Option<usize>| {
            let at = (*place)?;
            Some(gradient.get(at)? * chain.factors.get(at)?)
        };
        places.iter().map(|place| entry(place).unwrap_or(0.0)).collect()
    };
    let rows: Vec<Vec<f64>> = gradients.iter().map(by_fit).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut because: Vec<String> = Vec::new();
    let mut defined = Vec::with_capacity(m);
    for row in &rows {
        let seen: Vec<f64> = row.iter().zip(&known.tolerances).map(|(g, tolerance)| g * tolerance).collect();
        let least = DEPENDS * dot(&seen, &seen).sqrt();
        let along = |direction: &&Vec<f64>| least > 0.0 && dot(direction, &seen).abs() > least;
        let invisible: Vec<&Vec<f64>> = known.null_directions.iter().filter(along).collect();
        let mut to_blame = Vec::new();
        for (j, name) in known.names.iter().enumerate() {
            let weight = |direction: &&Vec<f64>| direction.get(j).is_some_and(|w| w * w > crate::fit::NOT_ESTIMABLE);
            let on_bound = known.on_bound.get(j) == Some(&true) && seen.get(j).is_some_and(|g| g.abs() > least);
            if invisible.iter().any(weight) || on_bound {
                to_blame.push(name.clone());
            }
        }
        defined.push(to_blame.is_empty() && row.iter().all(|g| g.is_finite()));
        to_blame.retain(|name| !because.contains(name));
        because.extend(to_blame);
    }
    let products: Vec<Vec<f64>> = rows.iter().map(|row| of_fit.iter().map(|line| dot(line, row)).collect()).collect();
    let mut matrix = vec![vec![None; m]; m];
    for (i, line) in matrix.iter_mut().enumerate() {
        for (j, entry) in line.iter_mut().enumerate() {
            // from one side, so that the matrix is symmetric to the bit
            let (low, high) = (i.min(j), i.max(j));
            if defined.get(i) == Some(&true) && defined.get(j) == Some(&true) {
                *entry = products.get(low).zip(rows.get(high)).map(|(product, row)| dot(product, row));
            }
        }
    }
    let mut all = Covariance { matrix, because };
    let nothing: Vec<bool> = (0..m).map(|i| all.sigma(i).is_some_and(|sigma| sigma <= ROUNDING * size(i))).collect();
    for (line, row) in all.matrix.iter_mut().zip(&nothing) {
        for (entry, _) in line.iter_mut().zip(&nothing).filter(|(_, column)| *row || **column) {
            *entry = entry.map(|_| 0.0);
        }
    }
    all
}
