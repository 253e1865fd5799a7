use proptest::prelude::*;

use super::*;
use crate::graph::Tape;

const LEAVES: usize = 3;

/// Terms of inner vertices: a predecessor, and a coefficient, which may be one, minus one, a constant, or vary.
type Terms = Vec<Vec<(u8, u8)>>;

fn terms() -> impl Strategy<Value = Terms> {
    prop::collection::vec(prop::collection::vec(any::<(u8, u8)>(), 0..4), 1..10)
}

/// The linearised graph, its coefficients as numbers, and what they are in rows.
fn build(terms: &Terms, g: &mut Graph) -> (Linear, Vec<Vec<(Vertex, f64)>>) {
    let pool = [
        (g.constant(1.0), 1.0),
        (g.constant(-1.0), -1.0),
        (g.constant(0.5), 0.5),
        (g.constant(0.0), 0.0),
        (g.parameter(0), 0.7),
        (g.input(0), -1.25),
        (g.input(1), 3.0),
    ];
    let mut linear = Linear::new(LEAVES);
    let mut numbers: Vec<Vec<(Vertex, f64)>> = vec![Vec::new(); LEAVES];
    for terms in terms {
        let earlier = numbers.len();
        let all: Vec<(Vertex, (Scalar, f64))> = terms
            .iter()
            .map(|&(u, c)| ((usize::from(u) % earlier) as Vertex, pool[usize::from(c) % pool.len()]))
            .collect();
        linear.vertex(all.iter().map(|&(u, (node, _))| (u, node)).collect());
        numbers.push(all.iter().map(|&(u, (_, number))| (u, number)).collect());
    }
    (linear, numbers)
}

/// The sum over all paths from u to v of the products of coefficients.
fn paths(numbers: &[Vec<(Vertex, f64)>], u: Vertex, v: Vertex) -> f64 {
    if u == v {
        return 1.0;
    }
    numbers[v as usize].iter().map(|&(w, coefficient)| coefficient * paths(numbers, u, w)).sum()
}

/// The Jacobian of outputs that are vertices of their own, as numbers.
fn jacobian(mut linear: Linear, outputs: &[Vertex], mut g: Graph) -> Vec<f64> {
    let one = g.constant(1.0);
    let outputs: Vec<Vertex> = outputs.iter().map(|&output| linear.vertex(vec![(output, one)])).collect();
    let found = linear.jacobian(&outputs, &mut g);
    Tape::lower(&g, &found).evaluate(&[0.7], &[-1.25, 3.0])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn a_jacobian_is_the_sum_over_all_paths(terms in terms(), picks in prop::collection::vec(any::<u8>(), 1..4)) {
        let mut g = Graph::new();
        let (linear, numbers) = build(&terms, &mut g);
        let outputs: Vec<Vertex> = picks.iter().map(|&pick| (usize::from(pick) % numbers.len()) as Vertex).collect();
        let found = jacobian(linear, &outputs, g);
        for (i, &output) in outputs.iter().enumerate() {
            for leaf in 0..LEAVES {
                let expected = paths(&numbers, leaf as Vertex, output);
                let found = found[i * LEAVES + leaf];
                prop_assert!((found - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "{} {}", found, expected);
            }
        }
    }
}

#[test]
fn very_many_vertices_are_eliminated_too() {
    // a ladder of two sides: uᵢ = c uᵢ₋₁ + vᵢ₋₁, vᵢ = vᵢ₋₁ − c uᵢ₋₁
    let mut g = Graph::new();
    let (one, c) = (g.constant(1.0), g.input(1));
    let minus = g.neg(c);
    let mut linear = Linear::new(LEAVES);
    let (mut u, mut v) = (linear.leaf(0), linear.leaf(1));
    let value = 0.003;
    let mut expected = [[1.0f64, 0.0], [0.0, 1.0]];
    for _ in 0..MOST_ORDERED {
        (u, v) = (linear.vertex(vec![(u, c), (v, one)]), linear.vertex(vec![(v, one), (u, minus)]));
        let [a, b] = expected;
        expected = [[value * a[0] + b[0], value * a[1] + b[1]], [b[0] - value * a[0], b[1] - value * a[1]]];
    }
    for (outputs, side) in [(vec![u], vec![0]), (vec![u, v, u, v], vec![0, 1, 0, 1])] {
        let (mut linear, mut g) = (linear.clone(), g.clone());
        let own: Vec<Vertex> = outputs.iter().map(|&output| linear.vertex(vec![(output, one)])).collect();
        let found = linear.jacobian(&own, &mut g);
        let found = Tape::lower(&g, &found).evaluate(&[], &[0.0, value]);
        for (i, &side) in side.iter().enumerate() {
            for (found, expected) in found[i * LEAVES..].iter().zip(expected[side]) {
                assert!((found - expected).abs() <= 1e-9 * (1e-3 + expected.abs()), "{found} {expected}");
            }
            assert_eq!(found[i * LEAVES + 2], 0.0);
        }
    }
}
