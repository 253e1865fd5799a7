use super::*;
use proptest::prelude::*;

/// A block of `rows` × (n + 1) filled from a list.
fn block(rows: usize, n: usize, entries: &[f64]) -> Matrix {
    Matrix::from_columns(rows, &(0..=n).map(|j| &entries[j * rows..(j + 1) * rows]).collect::<Vec<_>>())
}

fn close(a: f64, b: f64, scale: f64) -> bool {
    (a - b).abs() <= 1e-13 * scale
}

proptest! {
    /// ‖J δ + r‖² is the same by rows and by factor, however the rows are cut, and RᵀR = JᵀJ.
    #[test]
    fn keeps_every_sum_of_squares(
        rows in 1_usize..20, n in 1_usize..6, cut in 0_usize..20,
        entries in prop::collection::vec(-1.0..1.0_f64, 20 * 6), delta in prop::collection::vec(-2.0..2.0_f64, 6),
    ) {
        let whole = block(rows, n, &entries);
        let cut = cut.min(rows);
        let part = |range: std::ops::Range<usize>| {
            Matrix::from_columns(range.len(), &(0..=n).map(|j| &whole.column(j)[range.clone()]).collect::<Vec<_>>())
        };
        let (mut once, mut twice) = (SquareRootInformation::new(n), SquareRootInformation::new(n));
        let (mut head, mut tail) = (SquareRootInformation::new(n), SquareRootInformation::new(n));
        once.absorb(&mut whole.clone()).unwrap();
        twice.absorb(&mut part(0..cut)).unwrap();
        twice.absorb(&mut part(cut..rows)).unwrap();
        head.absorb(&mut part(0..cut)).unwrap();
        tail.absorb(&mut part(cut..rows)).unwrap();
        head.merge(&tail).unwrap();

        let mut at = delta[..n].to_vec();
        at.push(1.0);
        let residual = whole.mul_vec(&at);
        let expected = 0.5 * dot(&residual, &residual);
        let j = Matrix::from_columns(rows, &(0..n).map(|j| whole.column(j)).collect::<Vec<_>>());
        let gradient = j.transpose_mul_vec(whole.column(n));
        for information in [&once, &twice, &head] {
            prop_assert!(close(information.cost_at(&delta[..n]), expected, 1.0 + expected));
            prop_assert!(close(information.cost(), information.cost_at(&vec![0.0; n]), 1.0 + expected));
            prop_assert_eq!(information.rows(), rows);
            let gram = information.r().transpose().mul(information.r());
            let wanted = j.transpose().mul(&j);
            for (a, b) in gram.as_slice().iter().zip(wanted.as_slice()) {
                prop_assert!(close(*a, *b, 20.0));
            }
            for (a, b) in information.gradient().iter().zip(&gradient) {
                prop_assert!(close(*a, *b, 20.0));
            }
            for k in 0..n {
                prop_assert!(information.r().column(k)[k + 1..].iter().all(|&entry| entry == 0.0));
            }
        }
    }
}

#[test]
fn refuses_what_is_not_finite_and_stays_as_it_was() {
    let mut information = SquareRootInformation::new(1);
    information.absorb(&mut Matrix::from_rows(2, &[[2.0, 1.0]])).unwrap();
    let before = information.clone();
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        assert_eq!(information.absorb(&mut Matrix::from_rows(2, &[[bad, 1.0]])), Err(LinalgError::NotFinite));
        assert_eq!(information.absorb(&mut Matrix::from_rows(2, &[[1.0, bad]])), Err(LinalgError::NotFinite));
    }
    assert!(information.absorb(&mut Matrix::zeros(1, 3)).is_err());
    assert!(information.merge(&SquareRootInformation::new(2)).is_err());
    assert_eq!(information, before);
}

#[test]
fn large_and_small_entries_keep_their_digits() {
    for unit in [1e149, 1e-149, 1e-200] {
        let mut information = SquareRootInformation::new(2);
        let mut rows = Matrix::from_rows(3, &[[3.0 * unit, 0.0, 1.0], [4.0 * unit, 5.0 * unit, 2.0]]);
        information.absorb(&mut rows).unwrap();
        assert!((information.r()[(0, 0)].abs() / (5.0 * unit) - 1.0).abs() < 1e-15);
        assert!((information.r()[(1, 1)].abs() / (3.0 * unit) - 1.0).abs() < 1e-15);
        assert!(information.rest() < 1e-28);
    }
}

#[test]
fn parts_round_trip() {
    let mut information = SquareRootInformation::new(2);
    information.absorb(&mut Matrix::from_rows(3, &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 9.0, 9.0]])).unwrap();
    let again = SquareRootInformation::from_parts(
        information.r().clone(),
        information.d().to_vec(),
        information.rest(),
        information.rows(),
    );
    assert_eq!(again.as_ref(), Ok(&information));
    assert!(SquareRootInformation::from_parts(Matrix::zeros(2, 2), vec![0.0; 2], -1.0, 0).is_err());
    assert!(SquareRootInformation::from_parts(Matrix::zeros(2, 2), vec![f64::NAN; 2], 0.0, 0).is_err());
}
