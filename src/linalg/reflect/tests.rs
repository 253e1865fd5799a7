//! Every way of absorbing against one reflection after the other, written down plainly, on every instruction set.

use super::GROUP;
use crate::linalg::matrix::add_scaled;
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, dot, norm};
use crate::simd::InstructionSet;
use proptest::prelude::*;

/// Golub & Van Loan, §5.1.2, column by column.
fn plain(into: &SquareRootInformation, block: &Matrix) -> SquareRootInformation {
    let n = into.dimension();
    let (mut r, mut d, mut block) = (into.r().clone(), into.d().to_vec(), block.clone());
    for k in 0..n {
        let sigma = norm(block.column(k));
        if sigma == 0.0 {
            continue;
        }
        let alpha = r[(k, k)];
        let beta = -alpha.hypot(sigma).copysign(alpha);
        let v: Vec<f64> = block.column(k).iter().map(|entry| entry / (alpha - beta)).collect();
        r[(k, k)] = beta;
        for j in k + 1..=n {
            let top = if j < n { &mut r[(k, j)] } else { &mut d[k] };
            let s = (beta - alpha) / beta * (*top + dot(&v, block.column(j)));
            *top -= s;
            add_scaled(block.column_mut(j), -s, &v);
        }
    }
    let rest = into.rest() + dot(block.column(n), block.column(n));
    SquareRootInformation::from_parts(r, d, rest, into.rows() + block.rows()).unwrap()
}

/// (R d; 0 √rest): RᵀR, Rᵀd and the cost are the products of its columns.
fn augmented(information: &SquareRootInformation) -> Matrix {
    let n = information.dimension();
    let mut columns: Vec<Vec<f64>> = (0..n).map(|j| information.r().column(j).to_vec()).collect();
    columns.push([information.d(), &[information.rest().sqrt()]].concat());
    Matrix::from_columns(n + 1, &columns)
}

/// The largest difference of products of columns, as a share of the columns' lengths in `b`.
fn apart(a: &Matrix, b: &Matrix) -> f64 {
    let mut largest: f64 = 0.0;
    for j in 0..b.columns() {
        for i in 0..=j {
            let lengths = norm(b.column(i)) * norm(b.column(j));
            let difference = (dot(a.column(i), a.column(j)) - dot(b.column(i), b.column(j))).abs();
            if difference > 0.0 || lengths.is_nan() {
                largest = largest.max(if lengths > 0.0 { difference / lengths } else { f64::INFINITY });
            }
        }
    }
    largest
}

/// A factor of n parameters with some rows in it.
fn started(n: usize, entries: &[f64]) -> SquareRootInformation {
    let rows: Vec<&[f64]> = entries.chunks_exact(n + 1).collect();
    plain(&SquareRootInformation::new(n), &Matrix::from_rows(n + 1, &rows))
}

/// The block in a slice whose columns begin `ld` apart, with rubbish between them.
fn spread(block: &Matrix, ld: usize) -> Vec<f64> {
    let mut spread = vec![f64::NAN; ld * block.columns()];
    for j in 0..block.columns() {
        spread[j * ld..][..block.rows()].copy_from_slice(block.column(j));
    }
    spread
}

/// n, and the rows of R before and of the block; columns of many sizes, some of them zero.
fn case() -> impl Strategy<Value = (SquareRootInformation, Matrix)> {
    let entry = prop_oneof![4 => -1.0..1.0_f64, 1 => Just(0.0)];
    (1_usize..27, 0_usize..70, 0_usize..30).prop_flat_map(move |(n, rows, before)| {
        (
            prop::collection::vec(entry.clone(), before * (n + 1)),
            prop::collection::vec(entry.clone(), rows * (n + 1)),
            prop::collection::vec(prop_oneof![3 => Just(1.0), 1 => Just(0.0), 1 => Just(1e-12), 1 => Just(1e9)], n + 1),
        )
            .prop_map(move |(before, entries, scales)| {
                let columns: Vec<Vec<f64>> = (0..=n)
                    .map(|j| entries[j * rows..(j + 1) * rows].iter().map(|entry| entry * scales[j]).collect())
                    .collect();
                (started(n, &before), Matrix::from_columns(rows, &columns))
            })
    })
}

proptest! {
    #[test]
    fn agrees_with_one_reflection_after_the_other((start, block) in case(), spare in 0_usize..3) {
        let n = start.dimension();
        let rows = block.rows();
        let wanted = plain(&start, &block);
        // RᵀR = R₀ᵀR₀ + JᵀJ
        let stack = {
            let top = augmented(&start);
            let columns: Vec<Vec<f64>> = (0..=n).map(|j| [top.column(j), block.column(j)].concat()).collect();
            Matrix::from_columns(n + 1 + rows, &columns)
        };
        let nonzero: Vec<usize> = (0..n).filter(|&j| block.column(j).iter().any(|&entry| entry != 0.0)).collect();
        for set in InstructionSet::available() {
            let odd = rows + spare;
            let mut found = start.clone();
            found.absorb_block(set, &mut spread(&block, odd), rows, odd).unwrap();
            prop_assert!(apart(&augmented(&found), &stack) < 1e-13, "{}", set.name());
            prop_assert!(apart(&augmented(&found), &augmented(&wanted)) < 1e-13);
            prop_assert_eq!(found.rows(), wanted.rows());
            for k in 0..n {
                prop_assert!(found.r().column(k)[k + 1..].iter().all(|&entry| entry == 0.0));
            }
            // the same bits, wherever the columns begin
            let even = (rows + spare).next_multiple_of(GROUP);
            let mut again = start.clone();
            again.absorb_block(set, &mut spread(&block, even), rows, even).unwrap();
            prop_assert_eq!(&again, &found);

            let mut columns: Vec<&[f64]> = nonzero.iter().map(|&j| block.column(j)).collect();
            columns.push(block.column(n));
            let local = Matrix::from_columns(rows, &columns);
            let mut found = start.clone();
            found.absorb_columns(set, &nonzero, &mut spread(&local, even), rows, even).unwrap();
            prop_assert!(apart(&augmented(&found), &stack) < 1e-13, "{}", set.name());
            prop_assert_eq!(found.rows(), wanted.rows());
        }
        let mut other = SquareRootInformation::new(n);
        other.absorb(&mut block.clone()).unwrap();
        let mut merged = start.clone();
        merged.merge(&other).unwrap();
        prop_assert!(apart(&augmented(&merged), &stack) < 1e-13);
        prop_assert_eq!(merged.rows(), wanted.rows());
    }

    /// Where columns depend on others but for 1e-10, ‖R x‖ = ‖J x‖ has, along what they nearly leave unseen, the digits that
    /// the entries have. From JᵀJ it would have none: it is known to 1e-8 only.
    #[test]
    fn nearly_dependent_columns_keep_their_digits(
        entries in prop::collection::vec(-1.0..1.0_f64, 40 * 13), scales in prop::collection::vec(-12_i32..=0, 13),
    ) {
        let mut columns: Vec<Vec<f64>> = entries.chunks_exact(40).map(<[f64]>::to_vec).collect();
        let dependent = [1, 2, 3, 5, 8, 11];
        for j in dependent {
            let before = columns[j - 1].clone();
            columns[j].iter_mut().for_each(|entry| *entry *= 1e-10);
            add_scaled(&mut columns[j], 1.0, &before);
        }
        // powers of two: no rounding
        let scales: Vec<f64> = scales.iter().map(|&scale| 8.0_f64.powi(scale)).collect();
        let block = Matrix::from_columns(40, &columns).scale_columns(&scales);
        for set in InstructionSet::available() {
            let mut found = SquareRootInformation::new(12);
            found.absorb_block(set, &mut spread(&block, 40), 40, 40).unwrap();
            for j in dependent {
                let mut x = vec![0.0; 13];
                (x[j - 1], x[j]) = (-1.0 / scales[j - 1], 1.0 / scales[j]);
                let (by_factor, by_rows) = (norm(&found.r().mul_vec(&x[..12])), norm(&block.mul_vec(&x)));
                prop_assert!((by_factor - by_rows).abs() < 1e-13, "{}: {by_factor:e}, {by_rows:e}", set.name());
            }
        }
    }
}

/// Large, and larger than a square can be: the scaled reflections, in every place of a panel.
#[test]
fn columns_of_every_size_agree_with_the_plain_algorithm() {
    for unit in [1e148, 1e60, 1e-60, 1e-149, 1e-200] {
        for place in 0..6 {
            let columns: Vec<Vec<f64>> = (0..7_u32)
                .map(|j| {
                    let size = if j == place { unit } else { 1.0 };
                    (0..11_u32).map(|i| size * f64::from((7 * i * i + 3 * j * j + i * j) % 13 + 1)).collect()
                })
                .collect();
            let block = Matrix::from_columns(11, &columns);
            let wanted = plain(&SquareRootInformation::new(6), &block);
            for set in InstructionSet::available() {
                let mut found = SquareRootInformation::new(6);
                found.absorb_block(set, &mut spread(&block, 16), 11, 16).unwrap();
                for j in 0..6 {
                    for i in 0..=j {
                        let apart = (found.r()[(i, j)] - wanted.r()[(i, j)]).abs() / norm(block.column(j));
                        assert!(apart < 1e-13, "{unit:e} {place} {}: ({i}, {j}) {apart:e}", set.name());
                    }
                }
            }
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    for set in InstructionSet::available() {
        let mut information = SquareRootInformation::new(2);
        let shape = |result| assert!(matches!(result, Err(LinalgError::Shape { .. })), "{result:?}");
        shape(information.absorb_block(set, &mut [0.0; 23], 8, 8));
        shape(information.absorb_block(set, &mut [0.0; 24], 9, 8));
        shape(information.absorb_columns(set, &[1, 0], &mut [0.0; 24], 8, 8));
        shape(information.absorb_columns(set, &[1, 1], &mut [0.0; 24], 8, 8));
        shape(information.absorb_columns(set, &[2], &mut [0.0; 16], 8, 8));
        // in a vector, and in what is left of one
        for place in [0, 8, 20] {
            for bad in [f64::NAN, f64::INFINITY, 1e200, -1e151] {
                let mut block = [1.0; 33];
                block[place] = bad;
                assert_eq!(information.absorb_block(set, &mut block, 11, 11), Err(LinalgError::NotFinite));
                assert_eq!(information.absorb_columns(set, &[0, 1], &mut block, 11, 11), Err(LinalgError::NotFinite));
            }
        }
        assert_eq!(information, SquareRootInformation::new(2));
        // no rows, no parameters
        information.absorb_block(set, &mut [], 0, 0).unwrap();
        information.absorb_columns(set, &[], &mut [3.0], 1, 1).unwrap();
        assert_eq!((information.rows(), information.rest()), (1, 9.0));
        let mut none = SquareRootInformation::new(0);
        none.absorb_block(set, &mut [3.0, 4.0], 2, 2).unwrap();
        assert_eq!((none.rows(), none.cost()), (2, 12.5));
    }
}
