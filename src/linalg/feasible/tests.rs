//! Conflicts that are known, and points of conditions that a known point meets.

use super::*;
use proptest::prelude::*;

fn row(coefficients: &[f64], right: f64, equal: bool) -> Row {
    Row { coefficients: coefficients.to_vec(), right, equal }
}

const FREE: ([f64; 3], [f64; 3]) = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);

#[test]
fn the_smallest_conflict_is_named() {
    // x + y ≤ 1 and x − y ≤ −3 say x ≤ −1; x ≥ 0 contradicts, and nothing else does.
    let rows = [
        row(&[0.0, 0.0, 1.0], 5.0, true),
        row(&[1.0, 1.0, 0.0], 1.0, false),
        row(&[1.0, -1.0, 0.0], -3.0, false),
        row(&[0.0, 1.0, 1.0], 100.0, false),
    ];
    let lower = [0.0, -10.0, 0.0];
    let conditions = Conditions { lower: &lower, upper: &[9.0; 3], rows: &rows };
    let found = conflict(&conditions).unwrap().unwrap();
    assert_eq!(found, [Condition::Lower(0), Condition::Row(1), Condition::Row(2)]);
    assert_eq!(feasible_point(&conditions, &[0.0; 3]), Err(LinalgError::Infeasible));
    let lower = [-1.0, -10.0, 0.0];
    assert_eq!(conflict(&Conditions { lower: &lower, ..conditions }), Ok(None));
}

#[test]
fn equations_that_differ_only_on_the_right() {
    let rows = [row(&[1.0, 2.0, 0.0], 1.0, true), row(&[0.0, 0.0, 1.0], 0.0, true), row(&[2.0, 4.0, 0.0], 2.1, true)];
    let conditions = Conditions { lower: &FREE.0, upper: &FREE.1, rows: &rows };
    assert_eq!(conflict(&conditions).unwrap().unwrap(), [Condition::Row(0), Condition::Row(2)]);
    let same = [rows[0].clone(), row(&[2.0, 4.0, 0.0], 2.0, true)];
    assert_eq!(conflict(&Conditions { rows: &same, ..conditions }), Ok(None));
    // nothing cannot be one
    let nothing = [row(&[0.0; 3], 1.0, true)];
    assert_eq!(conflict(&Conditions { rows: &nothing, ..conditions }).unwrap().unwrap(), [Condition::Row(0)]);
    let crossed = Conditions { lower: &[0.0, 2.0, 0.0], upper: &[1.0; 3], rows: &rows };
    assert_eq!(conflict(&crossed).unwrap().unwrap(), [Condition::Lower(1), Condition::Upper(1)]);
}

proptest! {
    /// A conflict cannot be met, and without any one of its members it can; what a point meets has none.
    #[test]
    fn conflicts_are_irreducible(
        entries in prop::collection::vec(-1.0..1.0_f64, 7 * 4), rights in prop::collection::vec(-1.0..0.5_f64, 7),
        equal in prop::collection::vec(any::<bool>(), 7),
    ) {
        let rows: Vec<Row> =
            (0..7).map(|i| row(&entries[4 * i..4 * i + 4], rights[i], equal[i] && i < 3)).collect();
        let conditions = Conditions { lower: &[-0.5; 4], upper: &[0.7; 4], rows: &rows };
        match conflict(&conditions).unwrap() {
            None => {
                let point = feasible_point(&conditions, &[0.1; 4]).unwrap();
                prop_assert!(conditions.met(&point, 1e-9, |_| 0.0) && point.iter().all(|x| (-0.5..=0.7).contains(x)));
            }
            Some(found) => {
                prop_assert!(!met_without(&conditions, &found, None).unwrap());
                for k in 0..found.len() {
                    prop_assert!(met_without(&conditions, &found, Some(k)).unwrap());
                }
            }
        }
    }
}
