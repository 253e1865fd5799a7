//! In which order vertices of a linearised graph are eliminated, found on its pattern alone.

use super::linear::Vertex;

/// What multiplying with a coefficient costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// 1 or −1: nothing
    Unit,
    /// the same for all rows: nothing per row, but with one that varies
    PerIteration,
    /// one for each row
    PerRow,
}

/// Inner vertices for which waists are looked for, at most, and how many of these are tried: each try takes a whole elimination.
const MOST_WAISTED: usize = 1024;
const WAISTS_TRIED: usize = 16;

/// A set of vertices, one bit each.
type Set = Vec<u64>;

/// Edges by kind, as sets of predecessors and successors.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    words: usize,
    into: Vec<Set>,
    per_row: Vec<Set>,
    unit: Vec<Set>,
    out_of: Vec<Set>,
}

/// How the next vertex is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Strategy {
    /// From the leaves on.
    Forward,
    /// From the outputs on.
    Reverse,
    /// Where fewest edges arise; among those, where fewest operations do. What is narrow is kept until last, so that
    /// derivatives go through it.
    Mixed,
}

/// An order, and what it costs.
type Priced = (Vec<Vertex>, usize);

impl Pattern {
    pub(super) fn new(vertices: usize) -> Self {
        let words = vertices.div_ceil(64);
        let empty = vec![vec![0; words]; vertices];
        Pattern { words, into: empty.clone(), per_row: empty.clone(), unit: empty.clone(), out_of: empty }
    }

    pub(super) fn edge(&mut self, u: Vertex, v: Vertex, kind: Kind) {
        let v_index = v as usize;
        insert(&mut self.into[v_index], u);
        insert(&mut self.out_of[u as usize], v);
        match kind {
            Kind::Unit => insert(&mut self.unit[v_index], u),
            Kind::PerIteration => {}
            Kind::PerRow => insert(&mut self.per_row[v_index], u),
        }
    }

    /// The cheapest order found, in which `inner` vertices are eliminated, and its operations per row.
    pub(super) fn cheapest(&self, inner: &[Vertex]) -> Priced {
        let run = |strategy| self.clone().run(inner, strategy);
        let (mixed, forward, reverse) = (run(Strategy::Mixed), run(Strategy::Forward), run(Strategy::Reverse));
        let through = self.through_waists(inner, reverse);
        [forward, through].into_iter().fold(mixed, |best, other| if other.1 < best.1 { other } else { best })
    }

    /// From the outputs on, but last what many leaves decide and many outputs hang on, as long as that is cheaper: outputs are
    /// differentiated by a waist, and the waist by the leaves.
    fn through_waists(&self, inner: &[Vertex], reverse: Priced) -> Priced {
        if inner.len() > MOST_WAISTED {
            return reverse;
        }
        let mut open = self.narrow(inner);
        let mut best = reverse;
        loop {
            let tried = open.iter().map(|&waist| {
                let mut order: Vec<Vertex> = best.0.iter().copied().filter(|&v| v != waist).collect();
                order.push(waist);
                let cost = self.clone().cost(&order);
                (order, cost)
            });
            match tried.min_by_key(|(_, cost)| *cost) {
                Some(found) if found.1 < best.1 => best = found,
                _ => return best,
            }
            open.retain(|v| best.0.last() != Some(v));
        }
    }

    /// The vertices through which most pairs of a leaf and an output go that could go through fewer.
    fn narrow(&self, inner: &[Vertex]) -> Vec<Vertex> {
        let reach = |edges: &[Set], order: &mut dyn Iterator<Item = usize>| {
            let mut ends: Vec<Set> = vec![vec![0; self.words]; edges.len()];
            for v in order {
                let mut all = vec![0; self.words];
                for u in members(&edges[v]) {
                    merge(&mut all, &ends[u as usize]);
                }
                if all.iter().all(|&word| word == 0) {
                    insert(&mut all, v as Vertex);
                }
                ends[v] = all;
            }
            ends
        };
        let n = self.into.len();
        let leaves = reach(&self.into, &mut (0..n));
        let outputs = reach(&self.out_of, &mut (0..n).rev());
        let spared = |v: &Vertex| {
            let [before, after] = [&leaves, &outputs].map(|ends| size(&ends[*v as usize]).saturating_sub(1));
            std::cmp::Reverse(before * after)
        };
        let mut narrow = inner.to_vec();
        narrow.sort_by_key(spared);
        narrow.truncate(WAISTS_TRIED);
        narrow
    }

    /// What an order costs.
    fn cost(&mut self, order: &[Vertex]) -> usize {
        let mut total = 0;
        for &v in order {
            total += self.price(v).1;
            self.eliminate(v);
        }
        total
    }

    fn run(mut self, inner: &[Vertex], strategy: Strategy) -> Priced {
        let mut order = inner.to_vec();
        match strategy {
            Strategy::Forward => {}
            Strategy::Reverse => order.reverse(),
            Strategy::Mixed => return self.mixed(order),
        }
        let total = self.cost(&order);
        (order, total)
    }

    fn mixed(mut self, mut open: Vec<Vertex>) -> Priced {
        let mut order = Vec::with_capacity(open.len());
        let mut total = 0;
        let mut prices = vec![(0, 0); self.into.len()];
        let mut stale = vec![u64::MAX; self.words];
        while !open.is_empty() {
            for &v in open.iter().filter(|&&v| contains(&stale, v)) {
                prices[v as usize] = self.price(v);
            }
            stale.fill(0);
            let Some(at) = (0..open.len()).min_by_key(|&at| prices[open[at] as usize]) else { break };
            let v = open.remove(at);
            total += prices[v as usize].1;
            // prices change of its neighbours, and of all that share a successor with it
            merge(&mut stale, &self.into[v as usize]);
            merge(&mut stale, &self.out_of[v as usize]);
            for w in members(&self.out_of[v as usize]) {
                merge(&mut stale, &self.into[w as usize]);
            }
            for w in self.eliminate(v) {
                merge(&mut stale, &self.into[w as usize]);
            }
            order.push(v);
        }
        (order, total)
    }

    fn kind(&self, u: Vertex, w: Vertex) -> Kind {
        match w as usize {
            w if contains(&self.unit[w], u) => Kind::Unit,
            w if contains(&self.per_row[w], u) => Kind::PerRow,
            _ => Kind::PerIteration,
        }
    }

    /// By how many edges eliminating v makes the graph larger, and how many operations per row it takes. A product and the sum
    /// it goes into are one operation.
    fn price(&self, v: Vertex) -> (i64, usize) {
        let at = v as usize;
        let (into, per_row, unit) = (&self.into[at], &self.per_row[at], &self.unit[at]);
        let (mut fill, mut cost) = (-i64::from(size(into)), 0);
        for w in members(&self.out_of[at]) {
            let kind = self.kind(v, w);
            let w = w as usize;
            for word in 0..self.words {
                let (all, rows, units) = (into[word], per_row[word], unit[word]);
                let (known, known_rows) = (self.into[w][word], self.per_row[w][word]);
                fill += i64::from((all & !known).count_ones());
                let operations = match kind {
                    Kind::Unit => (rows & known) | (all & !rows & known_rows),
                    Kind::PerIteration => rows | (all & known_rows),
                    Kind::PerRow => (all & !units) | (units & known),
                };
                cost += operations.count_ones() as usize;
            }
            fill -= 1;
        }
        (fill, cost)
    }

    /// Joins what leads to v with what follows from it; the latter is returned.
    fn eliminate(&mut self, v: Vertex) -> Vec<Vertex> {
        let at = v as usize;
        let after: Vec<Vertex> = members(&self.out_of[at]).collect();
        for &w in &after {
            let kind = self.kind(v, w);
            let w = w as usize;
            for word in 0..self.words {
                let (all, rows, units) = (self.into[at][word], self.per_row[at][word], self.unit[at][word]);
                let known = self.into[w][word];
                self.into[w][word] |= all;
                self.per_row[w][word] |= if kind == Kind::PerRow { all } else { rows };
                let new_units = if kind == Kind::Unit { units & !known } else { 0 };
                self.unit[w][word] = (self.unit[w][word] & !all) | new_units;
            }
            for sets in [&mut self.into, &mut self.per_row, &mut self.unit] {
                remove(&mut sets[w], v);
            }
        }
        let out_of = std::mem::take(&mut self.out_of[at]);
        for u in members(&self.into[at]).collect::<Vec<_>>() {
            merge(&mut self.out_of[u as usize], &out_of);
            remove(&mut self.out_of[u as usize], v);
        }
        self.out_of[at] = vec![0; self.words];
        after
    }
}

fn insert(set: &mut Set, v: Vertex) {
    set[v as usize / 64] |= 1 << (v % 64);
}

fn remove(set: &mut Set, v: Vertex) {
    set[v as usize / 64] &= !(1 << (v % 64));
}

fn contains(set: &Set, v: Vertex) -> bool {
    set[v as usize / 64] >> (v % 64) & 1 == 1
}

fn merge(set: &mut Set, other: &Set) {
    for (word, more) in set.iter_mut().zip(other) {
        *word |= more;
    }
}

fn size(set: &Set) -> u32 {
    set.iter().map(|word| word.count_ones()).sum()
}

fn members(set: &Set) -> impl Iterator<Item = Vertex> + '_ {
    set.iter().enumerate().flat_map(|(at, &word)| {
        let mut left = word;
        std::iter::from_fn(move || {
            (left != 0).then(|| {
                let bit = left.trailing_zeros();
                left &= left - 1;
                at as Vertex * 64 + bit
            })
        })
    })
}

#[cfg(test)]
mod tests;
