//! The linearised graph, and its reduction to a Jacobian by eliminating vertices in the cheapest order.
//!
//! A vertex is a number that changes; an edge u → v carries the coefficient ∂v/∂u. Eliminating a vertex v joins each u → v
//! with each v → w: c(u, w) += c(v, w)·c(u, v). When only leaves and outputs are left, the edges are the Jacobian. Eliminating
//! from the leaves on is forward mode, from the outputs on reverse mode; the cheapest order is mostly neither. Source:
//! Griewank & Walther, Evaluating Derivatives (2nd ed., 2008), §9, §10.

use super::order::{Kind, Pattern};
use super::{Graph, Operation, Scalar, Varies};

/// Inner vertices for which the cheapest order is looked for, at most: its sets take the square of their number.
const MOST_ORDERED: usize = 4096;

/// The number of a vertex.
pub(super) type Vertex = u32;

/// A linearised graph. Leaves come first, and a vertex after all that lead to it.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    leaves: usize,
    /// each vertex's predecessors and coefficients
    into: Vec<Vec<(Vertex, Scalar)>>,
}

impl Linear {
    pub(super) fn new(leaves: usize) -> Self {
        Linear { leaves, into: vec![Vec::new(); leaves] }
    }

    pub(super) fn leaf(&self, k: usize) -> Vertex {
        k as Vertex
    }

    /// A new vertex that is the sum of terms.
    pub(super) fn vertex(&mut self, terms: Vec<(Vertex, Scalar)>) -> Vertex {
        self.into.push(terms);
        (self.into.len() - 1) as Vertex
    }

    /// ∂outputs/∂leaves, by output and then by leaf; entries that are zero for every row are the constant zero.
    pub(super) fn jacobian(self, outputs: &[Vertex], graph: &mut Graph) -> Vec<Scalar> {
        let needed = self.needed(outputs);
        let (leaves, n) = (self.leaves, self.into.len());
        let mut elimination = Elimination { graph, into: vec![Vec::new(); n], out_of: vec![Vec::new(); n] };
        for (v, terms) in self.into.into_iter().enumerate().filter(|(v, _)| needed[*v]) {
            for (u, coefficient) in terms {
                elimination.join(u, v as Vertex, coefficient);
            }
        }
        let inner = (leaves..n).filter(|&v| needed[v]).map(|v| v as Vertex);
        let inner: Vec<Vertex> = inner.filter(|v| !outputs.contains(v)).collect();
        for v in elimination.order(inner, leaves > outputs.len()) {
            elimination.eliminate(v);
        }
        let mut jacobian = vec![elimination.graph.constant(0.0); outputs.len() * leaves];
        for (i, &output) in outputs.iter().enumerate() {
            for &(leaf, coefficient) in &elimination.into[output as usize] {
                jacobian[i * leaves + leaf as usize] = coefficient;
            }
        }
        jacobian
    }

    /// Which vertices lead to an output.
    fn needed(&self, outputs: &[Vertex]) -> Vec<bool> {
        let mut needed = vec![false; self.into.len()];
        for &output in outputs {
            needed[output as usize] = true;
        }
        for v in (0..needed.len()).rev() {
            if needed[v] {
                self.into[v].iter().for_each(|&(u, _)| needed[u as usize] = true);
            }
        }
        needed
    }
}

fn kind(graph: &Graph, coefficient: Scalar) -> Kind {
    match graph.value(coefficient) {
        Some(value) if value.abs() == 1.0 => Kind::Unit,
        _ if graph.varies(coefficient) == Varies::PerRow => Kind::PerRow,
        _ => Kind::PerIteration,
    }
}

/// The edges that are left, with their coefficients as nodes of a graph.
struct Elimination<'g> {
    graph: &'g mut Graph,
    into: Vec<Vec<(Vertex, Scalar)>>,
    /// successors, and some that are eliminated
    out_of: Vec<Vec<Vertex>>,
}

impl Elimination<'_> {
    /// The order in which inner vertices are eliminated: the cheapest, or, where there are very many, from the outputs or the
    /// leaves on.
    fn order(&self, mut inner: Vec<Vertex>, reverse: bool) -> Vec<Vertex> {
        if inner.len() > MOST_ORDERED {
            if reverse {
                inner.reverse();
            }
            return inner;
        }
        let mut pattern = Pattern::new(self.into.len());
        for (v, edges) in self.into.iter().enumerate() {
            for &(u, coefficient) in edges {
                pattern.edge(u, v as Vertex, kind(self.graph, coefficient));
            }
        }
        pattern.cheapest(&inner).0
    }

    /// Adds to the coefficient of an edge, which may be new.
    fn join(&mut self, u: Vertex, w: Vertex, coefficient: Scalar) {
        let edges = &mut self.into[w as usize];
        match edges.iter_mut().find(|(from, _)| *from == u) {
            Some((_, known)) => *known = self.graph.add(*known, coefficient),
            None => {
                edges.push((u, coefficient));
                self.out_of[u as usize].push(w);
            }
        }
    }

    fn eliminate(&mut self, v: Vertex) {
        let into = std::mem::take(&mut self.into[v as usize]);
        let out_of = std::mem::take(&mut self.out_of[v as usize]);
        for &w in &out_of {
            // none where w is eliminated already
            let Some(at) = self.into[w as usize].iter().position(|(from, _)| *from == v) else { continue };
            let (_, second) = self.into[w as usize].swap_remove(at);
            for &(u, first) in &into {
                let product = self.graph.apply(Operation::Mul, second, first);
                self.join(u, w, product);
            }
        }
    }
}

#[cfg(test)]
mod tests;
