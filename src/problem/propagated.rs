//! The errors-in-variables estimate as a graph: one Gauss–Helmert step of a row, and its whitened equations.
//!
//! A row says f(q, x + v) + e = 0 of its readings x, whose errors v have the covariance Σ = D C Cᵀ D (D the standard
//! deviations, C·Cᵀ the correlations), and of its equations' own errors e with the variances E. Its share of the cost is
//! min ½(vᵀΣ⁻¹v + eᵀE⁻¹e). Linearised at corrected readings x + v₀, with A = ∂f/∂q and B = ∂f/∂x there,
//!
//! w = f(q, x + v₀) − B v₀,  W = B Σ Bᵀ + E = L Lᵀ,  v = −Σ Bᵀ W⁻¹ w,
//!
//! the share is ½‖L⁻¹w‖², which is repeated at x + v until v stands still. Then L⁻¹A are the derivatives of the whitened
//! residual L⁻¹w, in that their gradient is that of the cost: d cost/dq = Aᵀ W⁻¹ w, since a minimum over v does not change
//! to first order with v. (Wolf 1979; Britt & Luecke, Technometrics 15, 1973, 233; for a line, York 1966.)
//!
//! All of it is scalar operations on rows, so that it runs on blocks of rows as any residual does.

use super::noise::{Noise, Spread};
use super::programs::{Column, Seen};
use crate::graph::{Graph, Operation, Scalar, View, differentiate};

/// A pivot of W below this share of its diagonal entry: equations depend on each other, and the row is left to what knows how
/// to deal with that. Its numbers are NaN here.
pub(super) const DEPENDENT: f64 = 1e-9;

/// The numbers of a row's program after those of the measurement itself: readings as read, then its own deviations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    /// The first of the readings as read, of the inputs that are corrected.
    pub(super) read: usize,
    /// The first of the standard deviations that rows have of their own.
    pub(super) own: usize,
}

impl Places {
    pub(super) fn new(seen: &Seen, noise: &Noise) -> Places {
        let read = seen.measurement.inputs.len() + seen.gathered().len();
        Places { read, own: read + noise.inputs.len() }
    }
}

/// A row's equations, whitened.
pub(super) struct Whitened {
    pub(super) graph: Graph,
    /// L⁻¹w
    pub(super) residuals: Vec<Scalar>,
    /// L⁻¹A, by column and then by residual
    pub(super) derivatives: Vec<Scalar>,
    /// the readings x + v that come next, of the inputs that are corrected
    pub(super) next: Vec<Scalar>,
    /// Σ ((v − v₀)/σ)²
    pub(super) shift: Scalar,
}

/// Builds it, with derivatives by the columns' leaves.
pub(super) fn whitened(seen: &Seen, noise: &Noise, weights: &[f64], view: &View, leaves: &[Scalar]) -> Whitened {
    let measurement = seen.measurement;
    let places = Places::new(seen, noise);
    let source = &measurement.graph;
    let mut all = leaves.to_vec();
    all.extend(noise.inputs.iter().filter_map(|&(input, _)| source.known_input(input as u32)));
    let derived = differentiate(source, &measurement.equations, &all, view);
    let (m, n, k) = (derived.values.len(), leaves.len(), noise.inputs.len());
    let mut g = derived.graph;
    let f = derived.values;
    let entry = |i: usize, j: usize| derived.derivatives[i * (n + k) + j];

    let spread = |g: &mut Graph, spread: Spread| match spread {
        Spread::Constant(sigma) => g.constant(sigma),
        Spread::PerRow(own) => g.input((places.own + own) as u32),
    };
    let sigma: Vec<Scalar> = noise.inputs.iter().map(|&(_, of)| spread(&mut g, of)).collect();
    let before: Vec<Scalar> = (0..k)
        .map(|j| {
            let corrected = g.input(noise.inputs[j].0 as u32);
            let read = g.input((places.read + j) as u32);
            g.sub(corrected, read)
        })
        .collect();

    // w = f − B v₀, and M = B D C, of which W is M Mᵀ + E
    let (mut w, mut mixed) = (Vec::with_capacity(m), vec![Vec::with_capacity(k); m]);
    for i in 0..m {
        let terms: Vec<(Scalar, Scalar)> = (0..k).map(|j| (entry(i, n + j), before[j])).collect();
        let moved = sum_of_products(&mut g, &terms);
        w.push(g.sub(f[i], moved));
        let by_deviation: Vec<Scalar> = (0..k).map(|j| g.mul(entry(i, n + j), sigma[j])).collect();
        mixed[i] = match &noise.mixing {
            None => by_deviation,
            Some(c) => (0..k)
                .map(|j| {
                    let terms: Vec<_> = (j..k).map(|l| (by_deviation[l], g.constant(c[(l, j)]))).collect();
                    sum_of_products(&mut g, &terms)
                })
                .collect(),
        };
    }
    let mut l = vec![Vec::with_capacity(m); m];
    let mut inverse = Vec::with_capacity(m);
    for j in 0..m {
        for i in j..m {
            let terms: Vec<_> = mixed[i].iter().copied().zip(mixed[j].iter().copied()).collect();
            let mut covariance = sum_of_products(&mut g, &terms);
            if i == j
                && let Some(Some(of)) = noise.residuals.get(i)
            {
                let (own, weight) = (spread(&mut g, *of), g.constant(weights[i]));
                let own = g.mul(weight, own);
                let square = g.mul(own, own);
                covariance = g.add(covariance, square);
            }
            let known: Vec<_> = (0..j).map(|p| (l[i][p], l[j][p])).collect();
            let known = sum_of_products(&mut g, &known);
            let rest = g.sub(covariance, known);
            if i == j {
                let share = g.constant(DEPENDENT);
                let least = g.mul(share, covariance);
                let pivot = g.apply(Operation::AtLeast, rest, least);
                let root = g.unary(Operation::Sqrt, pivot);
                inverse.push(g.recip(root));
                l[i].push(root);
            } else {
                let scaled = g.mul(rest, inverse[j]);
                l[i].push(scaled);
            }
        }
    }
    let forward = |g: &mut Graph, b: &[Scalar]| {
        let mut y: Vec<Scalar> = Vec::with_capacity(m);
        for i in 0..m {
            let known: Vec<_> = (0..i).map(|p| (l[i][p], y[p])).collect();
            let known = sum_of_products(g, &known);
            let rest = g.sub(b[i], known);
            y.push(g.mul(rest, inverse[i]));
        }
        y
    };
    let residuals = forward(&mut g, &w);
    let mut derivatives = Vec::with_capacity(n * m);
    for column in 0..n {
        let a: Vec<Scalar> = (0..m).map(|i| entry(i, column)).collect();
        derivatives.extend(forward(&mut g, &a));
    }

    // λ = W⁻¹w, v = −D C Mᵀ λ
    let mut lambda = residuals.clone();
    for i in (0..m).rev() {
        let known: Vec<_> = (i + 1..m).map(|p| (l[p][i], lambda[p])).collect();
        let known = sum_of_products(&mut g, &known);
        let rest = g.sub(residuals[i], known);
        lambda[i] = g.mul(rest, inverse[i]);
    }
    let whitened: Vec<Scalar> = (0..k)
        .map(|j| {
            let terms: Vec<_> = (0..m).map(|i| (mixed[i][j], lambda[i])).collect();
            sum_of_products(&mut g, &terms)
        })
        .collect();
    let (mut next, mut shifts) = (Vec::with_capacity(k), Vec::with_capacity(k));
    for j in 0..k {
        let deviation = match &noise.mixing {
            None => whitened[j],
            Some(c) => {
                let terms: Vec<_> = (0..=j).map(|p| (g.constant(c[(j, p)]), whitened[p])).collect();
                sum_of_products(&mut g, &terms)
            }
        };
        let v = g.mul(sigma[j], deviation);
        let read = g.input((places.read + j) as u32);
        next.push(g.sub(read, v));
        // −(v − v₀)/σ
        let reciprocal = g.recip(sigma[j]);
        let old = g.mul(before[j], reciprocal);
        let shift = g.add(deviation, old);
        shifts.push((shift, shift));
    }
    let shift = sum_of_products(&mut g, &shifts);
    Whitened { graph: g, residuals, derivatives, next, shift }
}

/// Columns whose leaves the residuals know, and these leaves.
pub(super) fn known(seen: &Seen, columns: Vec<Column>) -> (Vec<Column>, Vec<Scalar>) {
    let leaf = |column: &Column| {
        let slot = &seen.measurement.slots[column.slot];
        let shape = seen.program.parameters[slot.parameter].shape;
        seen.measurement.graph.known_parameter((slot.first_leaf + shape.tangent_leaf(column.component)) as u32)
    };
    columns.into_iter().filter_map(|column| leaf(&column).map(|leaf| (column, leaf))).unzip()
}

fn sum_of_products(g: &mut Graph, terms: &[(Scalar, Scalar)]) -> Scalar {
    let mut sum = g.constant(0.0);
    for &(x, y) in terms {
        let product = g.mul(x, y);
        sum = g.add(sum, product);
    }
    sum
}
