use std::collections::BTreeMap;

use proptest::prelude::*;

use super::{Kind, Pattern};
use crate::graph::linear::Vertex;

/// Edges by their ends.
type Edges = BTreeMap<(Vertex, Vertex), Kind>;

/// A graph of leaves, inner vertices and outputs, in which edges lead on.
fn edges(leaves: u32, inner: u32, outputs: u32) -> impl Strategy<Value = Edges> {
    let n = leaves + inner + outputs;
    let kind = prop_oneof![Just(Kind::Unit), Just(Kind::PerIteration), Just(Kind::PerRow)];
    prop::collection::vec((0..n, 0..n, kind), 0..60).prop_map(move |all| {
        let leads = |u: u32, v: u32| u < v && u < leaves + inner && v >= leaves;
        all.into_iter().filter(|&(u, v, _)| leads(u, v)).map(|(u, v, kind)| ((u, v), kind)).collect()
    })
}

fn pattern(n: u32, edges: &Edges) -> Pattern {
    let mut pattern = Pattern::new(n as usize);
    edges.iter().for_each(|(&(u, v), &kind)| pattern.edge(u, v, kind));
    pattern
}

/// What eliminating vertices costs per row, edge by edge, and what is left.
fn eliminated(mut edges: Edges, order: &[Vertex]) -> (usize, Edges) {
    let mut cost = 0;
    for &v in order {
        let into: Vec<_> = edges.iter().filter(|((_, to), _)| *to == v).map(|((u, _), &kind)| (*u, kind)).collect();
        let out_of: Vec<_> =
            edges.iter().filter(|((from, _), _)| *from == v).map(|((_, w), &kind)| (*w, kind)).collect();
        edges.retain(|&(u, w), _| u != v && w != v);
        for &(w, second) in &out_of {
            for &(u, first) in &into {
                let product = match (first, second) {
                    (Kind::Unit, other) | (other, Kind::Unit) => other,
                    (Kind::PerIteration, Kind::PerIteration) => Kind::PerIteration,
                    _ => Kind::PerRow,
                };
                let multiplies = product == Kind::PerRow && first != Kind::Unit && second != Kind::Unit;
                let known = edges.get(&(u, w)).copied();
                let adds = known.is_some_and(|known| known == Kind::PerRow || product == Kind::PerRow);
                cost += usize::from(multiplies || adds);
                let joined = match known {
                    None => product,
                    Some(Kind::PerRow) => Kind::PerRow,
                    Some(_) if product == Kind::PerRow => Kind::PerRow,
                    Some(_) => Kind::PerIteration,
                };
                edges.insert((u, w), joined);
            }
        }
    }
    (cost, edges)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Patterns reach across the words of a set.
    #[test]
    fn the_cheapest_order_costs_what_is_said_and_no_more_than_forward_or_reverse(
        edges in (1u32..70, 1u32..12, 1u32..4).prop_flat_map(|(l, i, o)| edges(l, i, o).prop_map(move |e| (l, i, o, e))),
    ) {
        let (leaves, inner, outputs, edges) = edges;
        let inner: Vec<Vertex> = (leaves..leaves + inner).collect();
        let n = leaves + inner.len() as u32 + outputs;
        let (order, cost) = pattern(n, &edges).cheapest(&inner);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        prop_assert_eq!(&sorted, &inner);
        let (expected, left) = eliminated(edges.clone(), &order);
        prop_assert_eq!(cost, expected);
        let reverse: Vec<Vertex> = inner.iter().rev().copied().collect();
        for other in [&inner, &reverse] {
            let (other, also_left) = eliminated(edges.clone(), other);
            prop_assert!(cost <= other, "{} {}", cost, other);
            prop_assert!(left.keys().eq(also_left.keys()));
        }
    }
}

#[test]
fn neither_forward_nor_reverse_is_the_cheapest_of_a_waist() {
    // four leaves lead to one vertex through two layers of three, and from it to four outputs likewise
    let mut edges = Edges::new();
    let layers: [&[u32]; 7] =
        [&[0, 1, 2, 3], &[4, 5, 6], &[7, 8, 9], &[10], &[11, 12, 13], &[14, 15, 16], &[17, 18, 19, 20]];
    for pair in layers.windows(2) {
        for &u in pair[0] {
            pair[1].iter().for_each(|&v| {
                edges.insert((u, v), Kind::PerRow);
            });
        }
    }
    let inner: Vec<Vertex> = (4..17).collect();
    let reverse: Vec<Vertex> = (4..17).rev().collect();
    let (_, cost) = pattern(21, &edges).cheapest(&inner);
    let others = [eliminated(edges.clone(), &inner).0, eliminated(edges, &reverse).0];
    assert!(others.iter().all(|&other| cost < other), "{cost} {others:?}");
}

#[test]
fn products_with_what_is_the_same_for_all_rows_cost_only_where_rows_meet_them() {
    use Kind::{PerIteration, PerRow, Unit};
    // u → v → w, with and without an edge u → w
    for (first, second, known, cost) in [
        (Unit, Unit, None, 0),
        (Unit, PerRow, None, 0),
        (PerIteration, PerIteration, None, 0),
        (PerIteration, PerRow, None, 1),
        (PerRow, PerRow, None, 1),
        (PerRow, PerRow, Some(PerRow), 1),
        (Unit, PerRow, Some(Unit), 1),
        (Unit, Unit, Some(PerIteration), 0),
        (Unit, PerIteration, Some(PerRow), 1),
    ] {
        let mut edges = Edges::from([((0, 1), first), ((1, 2), second)]);
        edges.extend(known.map(|known| ((0, 2), known)));
        assert_eq!(pattern(3, &edges).cheapest(&[1]).1, cost, "{first:?} {second:?} {known:?}");
    }
}
