use super::*;

/// An orthonormal basis of what vectors span, mixed so that none of them shows.
fn mixed(vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let k = vectors.len();
    let mut all: Vec<Vec<f64>> = (0..k)
        .map(|i| {
            // the product of i and j makes them independent: the sine of a sum would be two vectors only
            let weights = (0..k).map(|j| ((1 + i * k + 3 * j * j + 5 * i * j) as f64).sin());
            let mut sum = vec![0.0; vectors[0].len()];
            for (weight, vector) in weights.zip(vectors) {
                sum.iter_mut().zip(vector).for_each(|(sum, x)| *sum += weight * x);
            }
            sum
        })
        .collect();
    orthonormalise(&mut all);
    assert_eq!(all.len(), k);
    all
}

fn support(vector: &[f64]) -> Vec<usize> {
    (0..vector.len()).filter(|&j| vector[j] != 0.0).collect()
}

#[test]
fn one_vector_is_itself_without_its_rounding() {
    assert_eq!(sparsest(&[vec![-0.6, 1e-12, -0.8]]), [vec![0.6, 0.0, 0.8]]);
    assert!(sparsest(&[]).is_empty());
}

#[test]
fn hidden_vectors_are_found_again() {
    // a chain: each pair shares a coordinate with the next, so that the space is one part
    let chain: Vec<Vec<f64>> = (0..4)
        .map(|i| {
            let mut vector = vec![0.0; 9];
            [1.0, -2.0, 0.5].iter().enumerate().for_each(|(k, x)| vector[2 * i + k] = *x);
            vector
        })
        .collect();
    let found = sparsest(&mixed(&chain));
    let supports: Vec<Vec<usize>> = found.iter().map(|vector| support(vector)).collect();
    assert_eq!(supports, [[0, 1, 2], [2, 3, 4], [4, 5, 6], [6, 7, 8]]);
    for vector in &found {
        assert!((norm(vector) - 1.0).abs() < 1e-14);
        assert!(vector.iter().fold(0.0, |m: f64, x| if x.abs() > m.abs() { *x } else { m }) > 0.0);
    }
}

#[test]
fn many_are_found_without_trying_all() {
    // 14 of 44: too many choices to try
    let chain: Vec<Vec<f64>> = (0..14)
        .map(|i| {
            let mut vector = vec![0.0; 44];
            [1.0, 0.7, -1.3, 0.4, 0.9].iter().enumerate().for_each(|(k, x)| vector[3 * i + k] = x + 0.01 * i as f64);
            vector
        })
        .collect();
    assert!(choices(44, 13) > MOST_CHOICES);
    let found = sparsest(&mixed(&chain));
    assert_eq!(found.len(), 14);
    assert!(
        found.iter().all(|vector| support(vector).len() == 5),
        "{:?}",
        found.iter().map(|v| support(v)).collect::<Vec<_>>()
    );
}

#[test]
fn parts_share_no_coordinate() {
    let both = [vec![1.0, 1.0, 0.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, 1.0, 0.0, -1.0]];
    assert_eq!(separate(&mixed(&both)), [vec![0, 1], vec![3, 5]]);
}

#[test]
fn choices_are_counted_and_visited() {
    assert_eq!((choices(5, 2), choices(5, 5), choices(3, 0), choices(500, 250)), (10, 1, 1, usize::MAX));
    let mut all = Vec::new();
    each_choice(4, 2, |chosen| all.push(chosen.to_vec()));
    assert_eq!(all, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]);
    let mut none = 0;
    each_choice(2, 3, |_| none += 1);
    each_choice(2, 0, |chosen| none += 10 + chosen.len());
    assert_eq!(none, 10);
}
