//! The sparsest basis of a subspace: what can be read of a null space.
//!
//! A basis from singular values mixes whatever it spans. What a person wants are the vectors that touch as few coordinates as
//! possible: those of minimal support (circuits, in the words of matroids). Any k − 1 independent coordinates put to zero leave
//! one vector of a k-dimensional space, and all circuits come about so; taking them in the order of their support, each that is
//! independent of those before, gives a basis whose every vector is as sparse as any basis allows (the greedy algorithm on a
//! matroid: Edmonds 1971; for null spaces Coleman & Pothen, SIAM J. Alg. Disc. Meth. 7 (1986) 527).
//!
//! The space first falls into parts that share no coordinate. Of a part all choices are tried where they are few, else those
//! that reweighted least squares (Chartrand & Yin 2008) finds, starting once from each coordinate. Nothing is random.

use std::collections::BTreeSet;

use super::{Matrix, cholesky, dot, norm, orthonormalise, svd};

/// An entry below this share of the largest is what rounding leaves of zero.
const ZERO: f64 = 1e-8;
/// Choices of coordinates that are tried one by one.
const MOST_CHOICES: usize = 20_000;
/// Products that all searches together may take in one of their rounds.
const MOST_WORK: usize = 100_000_000;
/// A vector that keeps less than this of its length beside others depends on them.
const DEPENDENT: f64 = 1e-6;

/// The sparsest basis of what the orthonormal `basis` spans: unit vectors, the largest entry of each positive.
///
/// ```
/// use phical::linalg::sparsest;
/// let h = 0.5_f64.sqrt();
/// // two pairs, mixed
/// let mixed = [vec![0.5, 0.5, 0.5, 0.5], vec![0.5, 0.5, -0.5, -0.5]];
/// let found = sparsest(&mixed);
/// assert!(found.iter().zip([[h, h, 0.0, 0.0], [0.0, 0.0, h, h]]).all(|(a, b)| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15)));
/// ```
pub fn sparsest(basis: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = parts(basis).iter().flat_map(Part::circuits).collect();
    all.iter_mut().for_each(|vector| orient(vector));
    let first = |vector: &[f64]| vector.iter().position(|x| *x != 0.0);
    all.sort_by_key(|vector| first(vector));
    all
}

/// The coordinates of the parts that a space falls into, which share none; coordinates that it does not touch are in no part.
pub fn separate(basis: &[Vec<f64>]) -> Vec<Vec<usize>> {
    parts(basis).into_iter().map(|part| part.coordinates).collect()
}

/// A unit vector whose largest entry is positive; of several that are as large, but for rounding, the first decides.
fn orient(vector: &mut [f64]) {
    const AS_LARGE: f64 = 1.0 - 1e-6;
    let most = vector.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let largest = vector.iter().copied().find(|x| x.abs() >= AS_LARGE * most).unwrap_or(1.0);
    let factor = largest.signum() / norm(vector).max(f64::MIN_POSITIVE);
    vector.iter_mut().for_each(|x| *x = if x.abs() <= ZERO * most { 0.0 } else { *x * factor });
}

/// A part of the space: its coordinates, and a basis of it, one row for each of them.
struct Part {
    length: usize,
    coordinates: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

fn parts(basis: &[Vec<f64>]) -> Vec<Part> {
    let (k, n) = (basis.len(), basis.first().map_or(0, Vec::len));
    let rows: Vec<Vec<f64>> = (0..n).map(|j| basis.iter().map(|vector| vector[j]).collect()).collect();
    let touched: Vec<usize> = (0..n).filter(|&j| norm(&rows[j]) > ZERO).collect();
    let mut known = vec![false; n];
    let mut all = Vec::new();
    for &seed in &touched {
        if known[seed] {
            continue;
        }
        known[seed] = true;
        let mut members = vec![seed];
        let mut next = 0;
        while let Some(&i) = members.get(next) {
            next += 1;
            // the projector onto the space links what belongs together
            for &j in touched.iter().filter(|&&j| dot(&rows[i], &rows[j]).abs() > ZERO) {
                if !std::mem::replace(&mut known[j], true) {
                    members.push(j);
                }
            }
        }
        members.sort_unstable();
        // the projector of a part is one as well: its singular values are 1 and 0
        let own: Vec<&[f64]> = members.iter().map(|&j| rows[j].as_slice()).collect();
        let Ok(found) = svd(&Matrix::from_rows(k, &own)) else { continue };
        let dimension = found.sigma.iter().filter(|sigma| **sigma > 0.5).count();
        let coordinates = |row: &&[f64]| (0..dimension).map(|c| dot(row, found.v.column(c))).collect();
        let rows = own.iter().map(coordinates).collect();
        all.push(Part { length: n, coordinates: members, rows });
    }
    all
}

impl Part {
    fn dimension(&self) -> usize {
        self.rows.first().map_or(0, Vec::len)
    }

    /// The sparsest basis of the part.
    fn circuits(&self) -> Vec<Vec<f64>> {
        let k = self.dimension();
        let mut known = BTreeSet::new();
        let mut found: Vec<(usize, f64, Vec<f64>)> = Vec::new();
        let mut add = |combination: Vec<f64>| {
            let mut vector: Vec<f64> = self.rows.iter().map(|row| dot(row, &combination)).collect();
            orient(&mut vector);
            let support: Vec<usize> = (0..vector.len()).filter(|&i| vector[i] != 0.0).collect();
            if known.insert(support.clone()) {
                let spread = vector.iter().map(|x| x.abs()).sum();
                found.push((support.len(), spread, vector));
            }
        };
        if choices(self.rows.len(), k.saturating_sub(1)) <= MOST_CHOICES {
            each_choice(self.rows.len(), k.saturating_sub(1), |chosen| {
                let zeros: Vec<&[f64]> = chosen.iter().map(|&i| self.rows[i].as_slice()).collect();
                if let Some(combination) = left_over(&zeros, k) {
                    add(combination);
                }
            });
        } else {
            // from as many coordinates as there is time for
            let each = self.rows.len() * k * k;
            let every = (self.rows.len() * each).div_ceil(MOST_WORK).max(1);
            (0..self.rows.len()).step_by(every).filter_map(|i| self.through_coordinate(i)).for_each(&mut add);
        }
        // as sparse as may be; of those as sparse the more concentrated, which is easier to read
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut chosen: Vec<Vec<f64>> = Vec::new();
        let mut spanned: Vec<Vec<f64>> = Vec::new();
        let rest = (0..k).map(|c| self.rows.iter().map(|row| row[c]).collect::<Vec<f64>>());
        for vector in found.into_iter().map(|(.., vector)| vector).chain(rest) {
            if chosen.len() == k {
                break;
            }
            if beside(&spanned, &vector) > DEPENDENT {
                spanned.push(vector.clone());
                orthonormalise(&mut spanned);
                chosen.push(vector);
            }
        }
        let scattered = |vector: Vec<f64>| {
            let mut full = vec![0.0; self.length];
            self.coordinates.iter().zip(vector).for_each(|(&j, x)| full[j] = x);
            full
        };
        chosen.into_iter().map(scattered).collect()
    }

    /// A circuit through a coordinate: Σ wᵢ zᵢ² is minimised with this one at 1 and wᵢ = 1/(zᵢ² + ε²), again and again; what is
    /// smallest in the end is put to zero.
    fn through_coordinate(&self, through: usize) -> Option<Vec<f64>> {
        const ROUNDS: i32 = 24;
        let k = self.dimension();
        let mut z = vec![1.0; self.rows.len()];
        for round in 0..ROUNDS {
            let floor = 0.5_f64.powi(round).max(1e-6);
            let mut m = Matrix::zeros(k, k);
            for (row, z) in self.rows.iter().zip(&z) {
                let weight = 1.0 / (z * z + floor * floor);
                for a in 0..k {
                    for b in 0..k {
                        m[(a, b)] += weight * row[a] * row[b];
                    }
                }
            }
            let l = cholesky(&m)?;
            let x = super::solve_upper_transposed(&l.transpose(), &self.rows[through]).ok()?;
            let c = super::solve_upper(&l.transpose(), &x).ok()?;
            let own = dot(&c, &self.rows[through]);
            z = self.rows.iter().map(|row| dot(row, &c) / own).collect();
        }
        let mut order: Vec<usize> = (0..z.len()).filter(|&i| i != through).collect();
        order.sort_by(|&a, &b| z[a].abs().total_cmp(&z[b].abs()));
        let mut spanned = vec![self.rows[through].clone()];
        orthonormalise(&mut spanned);
        let mut zeros: Vec<&[f64]> = Vec::new();
        for i in order {
            if zeros.len() + 1 == k {
                break;
            }
            if beside(&spanned, &self.rows[i]) > DEPENDENT {
                spanned.push(self.rows[i].clone());
                orthonormalise(&mut spanned);
                zeros.push(&self.rows[i]);
            }
        }
        left_over(&zeros, k)
    }
}

/// What is left of a vector's length beside orthonormal ones, as a share of it.
fn beside(orthonormal: &[Vec<f64>], vector: &[f64]) -> f64 {
    let mut rest = vector.to_vec();
    // twice, for the first time loses digits
    for _ in 0..2 {
        for known in orthonormal {
            let share = dot(known, &rest);
            rest.iter_mut().zip(known).for_each(|(rest, known)| *rest -= share * known);
        }
    }
    norm(&rest) / norm(vector).max(f64::MIN_POSITIVE)
}

/// The one vector that is orthogonal to k − 1 rows; none where they depend on each other. Gauss–Jordan with full pivots.
fn left_over(rows: &[&[f64]], k: usize) -> Option<Vec<f64>> {
    let mut a: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| {
            let length = norm(row).max(f64::MIN_POSITIVE);
            row.iter().map(|x| x / length).collect()
        })
        .collect();
    let mut free: Vec<usize> = (0..k).collect();
    let mut pivots: Vec<usize> = Vec::new();
    for step in 0..a.len() {
        let size = |i: usize, j: usize| a[i][j].abs();
        let all = (step..a.len()).flat_map(|i| free.iter().map(move |&j| (i, j)));
        let (row, column) = all.max_by(|&(i, j), &(p, q)| size(i, j).total_cmp(&size(p, q)))?;
        if size(row, column) <= DEPENDENT {
            return None;
        }
        a.swap(step, row);
        let pivot = a[step][column];
        a[step].iter_mut().for_each(|x| *x /= pivot);
        let own = a[step].clone();
        for (_, other) in a.iter_mut().enumerate().filter(|(i, _)| *i != step) {
            let factor = other[column];
            other.iter_mut().zip(&own).for_each(|(x, own)| *x -= factor * own);
        }
        free.retain(|&j| j != column);
        pivots.push(column);
    }
    let &[last] = &free[..] else { return None };
    let mut found = vec![0.0; k];
    found[last] = 1.0;
    pivots.iter().zip(&a).for_each(|(&pivot, row)| found[pivot] = -row[last]);
    Some(found)
}

/// n over k, or more than can be counted.
pub fn choices(n: usize, k: usize) -> usize {
    let k = k.min(n.saturating_sub(k));
    (0..k).try_fold(1_usize, |all, i| Some(all.checked_mul(n - i)? / (i + 1))).unwrap_or(usize::MAX)
}

/// Calls `visit` with every choice of k out of n, in lexical order.
pub fn each_choice(n: usize, k: usize, mut visit: impl FnMut(&[usize])) {
    if k > n {
        return;
    }
    let mut chosen: Vec<usize> = (0..k).collect();
    loop {
        visit(&chosen);
        let Some(at) = (0..k).rev().find(|&at| chosen[at] < n - k + at) else { return };
        chosen[at] += 1;
        for next in at + 1..k {
            chosen[next] = chosen[next - 1] + 1;
        }
    }
}

#[cfg(test)]
mod tests;
