use super::*;
use crate::simulate::truth::Truth;

fn flagship() -> Program {
    program(include_str!("../../../models/two_theodolite/model.ron"))
}

/// All residuals of all rows, at the truth or at the nominal values.
fn residuals(program: &Program, table: &Table, at_truth: bool) -> Vec<Vec<f64>> {
    let mut scenario = program.scenarios[0].clone();
    if !at_truth {
        scenario.truth.clear();
    }
    let measurement = &program.measurements[0];
    let mut leaves = vec![0.0; measurement.leaves];
    Truth::new(program, &scenario, 1).fill(&measurement.slots, &[], &mut leaves);
    (0..table.rows()).map(|row| measurement.tape.evaluate(&leaves, &table.row(row))).collect()
}

#[test]
fn exact_readings_leave_nothing_at_the_truth() {
    let program = flagship();
    let made = made(&program, &Options { exact: true, ..Options::default() });
    let table = &made.tables[0].1;
    assert_eq!(table.rows(), 300);
    for all in residuals(&program, table, true) {
        assert!(all[..3].iter().all(|r| r.abs() < 1e-9), "{all:?}");
        // moments of lines metres apart: millimetres squared over the distance
        assert!(all[3..].iter().all(|r| r.abs() < 1e-9), "{all:?}");
    }
    assert!(made.truth.contains(&("R0.a".to_owned(), 2405.0)));
    assert_eq!(made.truth.len(), 21);
    // the front side: the line of sight looks along -x at zero reading
    assert!((0..300).all(|row| table.row(row)[..8].iter().all(|angle| angle.abs() < std::f64::consts::FRAC_PI_2)));
}

#[test]
fn uncalibrated_errors_are_the_papers() {
    let program = flagship();
    let options = Options { rows: vec![(0, 5000)], ..Options::default() };
    let all = residuals(&program, &made(&program, &options).tables[0].1, false);
    // DESIGN §8: 14.6 10.2 9.7 and 6.6 6.1 5.2; the paper: 14.19 9.7 10.3 and 6.37 6.38 5.51
    for (axis, (mean, sigma)) in [(14.5, 6.5), (10.2, 6.1), (9.7, 5.2)].into_iter().enumerate() {
        let errors: Vec<f64> = all.iter().map(|r| r[axis].abs()).collect();
        let found = moments(&errors);
        assert!((found.0 / mean - 1.0).abs() < 0.04, "{axis}: {found:?}");
        assert!((found.1 / sigma - 1.0).abs() < 0.05, "{axis}: {found:?}");
    }
}

#[test]
fn noise_is_what_is_declared() {
    let program = flagship();
    let options = |exact| Options { rows: vec![(0, 4000)], exact, ..Options::default() };
    let (noisy, exact) = (made(&program, &options(false)), made(&program, &options(true)));
    let arcsec = std::f64::consts::PI / 648_000.0;
    let mut before = vec![0.0; 4000];
    for input in 0..8 {
        let difference = |row| noisy.tables[0].1.row(row)[input] - exact.tables[0].1.row(row)[input];
        let errors: Vec<f64> = (0..4000).map(|row| difference(row) / arcsec).collect();
        let (mean, sigma) = moments(&errors);
        // four standard errors
        assert!((mean - 1.88).abs() < 4.0 * 17.59 / 4000f64.sqrt(), "{input}: {mean}");
        assert!((sigma / 17.59 - 1.0).abs() < 4.0 / 8000f64.sqrt(), "{input}: {sigma}");
        let products: Vec<f64> = errors.iter().zip(&before).map(|(one, other)| (one - 1.88) * (other - 1.88)).collect();
        assert!(input == 0 || moments(&products).0.abs() < 4.0 * 17.59 * 17.59 / 4000f64.sqrt(), "{input}: not alone");
        before = errors;
    }
    assert!((0..4000).all(|row| noisy.tables[0].1.row(row)[8] == exact.tables[0].1.row(row)[8]));
}

#[test]
fn a_seed_gives_the_same_bytes_and_more_rows_keep_the_first() {
    let program = flagship();
    let of = |rows, seed| made(&program, &Options { rows: vec![(0, rows)], seed, ..Options::default() });
    let (one, again, longer, other) = (of(40, None), of(40, Some(1)), of(90, None), of(40, Some(2)));
    let bytes = |made: &Simulated| {
        let mut bytes = Vec::new();
        crate::data::write_to(&program, 0, &made.tables[0].1, &mut bytes).unwrap();
        bytes
    };
    assert_eq!(bytes(&one), bytes(&again));
    assert_ne!(bytes(&one), bytes(&other));
    assert!(same(&one.tables[0].1, &longer.tables[0].1, 40));
    assert_eq!((&one.truth, &one.truth), (&longer.truth, &other.truth));
}
