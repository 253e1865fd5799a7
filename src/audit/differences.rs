//! Central differences, extrapolated to a step of zero (Ridders, "Accurate computation of F'(x) and F'(x) F''(x)", Advances in
//! Engineering Software 4 (1982) 75), which says how far they can be trusted.

/// The derivative at zero of each of the `m` components of `f`, and how uncertain it is; infinitely where `f` is not defined. The
/// steps go from 0.04 to 0.0006, so that what `f` is moved by should be of the size of one.
///
/// ```
/// let found = phical::audit::differences(2, |h| Some(vec![(1.0 + h).ln(), 3.0 * h]));
/// for ((derivative, uncertainty), exact) in found.into_iter().zip([1.0, 3.0]) {
///     assert!(uncertainty < 1e-8 && (derivative - exact).abs() < 1e-9);
/// }
/// ```
pub fn differences(m: usize, f: impl Fn(f64) -> Option<Vec<f64>>) -> Vec<(f64, f64)> {
    const LEVELS: usize = 7;
    const FIRST: f64 = 0.04;
    let mut best = vec![(f64::NAN, f64::INFINITY); m];
    // two estimates may agree by chance: the second best says how uncertain the best is
    let mut second = best.clone();
    let mut rows: Vec<Vec<Vec<f64>>> = Vec::new();
    for level in 0..LEVELS {
        let h = FIRST / f64::from(1u32 << level);
        let (Some(plus), Some(minus)) = (f(h), f(-h)) else {
            rows.clear();
            continue;
        };
        let mut row = vec![(0..m).map(|i| (plus[i] - minus[i]) / (2.0 * h)).collect::<Vec<f64>>()];
        if let Some(above) = rows.last() {
            let mut power = 1.0;
            for column in 0..above.len() {
                power *= 4.0;
                let finer: Vec<f64> =
                    (0..m).map(|i| row[column][i] + (row[column][i] - above[column][i]) / (power - 1.0)).collect();
                for i in 0..m {
                    let error = (finer[i] - row[column][i]).abs().max((finer[i] - above[column][i]).abs());
                    if error < best[i].1 {
                        second[i] = std::mem::replace(&mut best[i], (finer[i], error));
                    } else if error < second[i].1 {
                        second[i] = (finer[i], error);
                    }
                }
                row.push(finer);
            }
        }
        rows.push(row);
    }
    for (best, second) in best.iter_mut().zip(&second) {
        best.1 = best.1.max((best.0 - second.0).abs());
    }
    // coarse steps may agree across a corner that fine ones see
    if let Some(finest) = rows.last() {
        for (best, finest) in best.iter_mut().zip(&finest[0]) {
            if (best.0 - finest).abs() > 1e-4 * (1.0 + best.0.abs()) {
                best.1 = f64::INFINITY;
            }
        }
    }
    best
}
