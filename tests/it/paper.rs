//! The paper's own formulas, coded by hand: (13)–(17) for points, (20)–(22) for the consistency index, with the derivatives of
//! axes and origins by products of 4×4 matrices in which one factor is differentiated.

use nalgebra::{Matrix4, Vector3, matrix};

use crate::close::close;
use crate::flagship::{flagship, oracle_rows};

type Line = (Vector3<f64>, Vector3<f64>);

/// (A2) and its derivative by the angle.
fn first(angle: f64) -> [Matrix4<f64>; 2] {
    let (s, c) = angle.sin_cos();
    [
        matrix![-s, 0.0, c, 0.0; c, 0.0, s, 0.0; 0.0, 1.0, 0.0, 0.0; 0.0, 0.0, 0.0, 1.0],
        matrix![-c, 0.0, -s, 0.0; -s, 0.0, c, 0.0; 0.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0],
    ]
}

/// (A3) and its derivatives by a, b, α, β.
fn second([a, b, alpha, beta]: [f64; 4]) -> [Matrix4<f64>; 5] {
    let (sa, ca) = alpha.sin_cos();
    let (sb, cb) = beta.sin_cos();
    let mut da = Matrix4::zeros();
    da[(2, 3)] = 1.0;
    let mut db = Matrix4::zeros();
    (db[(0, 3)], db[(1, 3)]) = (cb, sb);
    [
        matrix![cb, -sb * ca, sb * sa, b * cb; sb, cb * ca, -cb * sa, b * sb; 0.0, sa, ca, a; 0.0, 0.0, 0.0, 1.0],
        da,
        db,
        matrix![0.0, sb * sa, sb * ca, 0.0; 0.0, -cb * sa, -cb * ca, 0.0; 0.0, ca, -sa, 0.0; 0.0, 0.0, 0.0, 0.0],
        matrix![-sb, -cb * ca, cb * sa, -b * sb; cb, -sb * ca, sb * sa, b * cb; 0.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0],
    ]
}

fn line(m: &Matrix4<f64>) -> Line {
    (m.fixed_view::<3, 1>(0, 3).into(), m.fixed_view::<3, 1>(0, 2).into())
}

/// A line of sight and its derivatives by the twelve numbers of its three links.
fn sight(links: &[[f64; 4]; 3], hz: f64, v: f64) -> (Line, Vec<Line>) {
    let angles = [std::f64::consts::FRAC_PI_2, hz, v];
    let factors: Vec<_> = (0..3).map(|i| (first(angles[i])[0], second(links[i]))).collect();
    let whole = factors.iter().fold(Matrix4::identity(), |m, (t, a)| m * t * a[0]);
    let mut derivatives = Vec::new();
    for link in 0..3 {
        for k in 1..5 {
            let product =
                (0..3).fold(Matrix4::identity(), |m, i| m * factors[i].0 * factors[i].1[if i == link { k } else { 0 }]);
            derivatives.push(line(&product));
        }
    }
    (line(&whole), derivatives)
}

/// (13)–(15) and (20), and their derivatives (16), (17), (22).
struct Observed {
    point: Vector3<f64>,
    kci: f64,
    d_point: Vec<Vector3<f64>>,
    d_kci: Vec<f64>,
}

fn observe(left: &(Line, Vec<Line>), right: &(Line, Vec<Line>)) -> Observed {
    let ((pl, zl), (pr, zr)) = (left.0, right.0);
    let c = zl.dot(&zr);
    let dp = pl - pr;
    let dz = zr * c - zl; // (14)
    let h = dz.dot(&dp) / (1.0 - c * c); // (13)
    let zero = (Vector3::zeros(), Vector3::zeros());
    let both = left.1.iter().map(|&l| (l, zero)).chain(right.1.iter().map(|&r| (zero, r)));
    let (mut d_point, mut d_kci) = (Vec::new(), Vec::new());
    for ((d_pl, d_zl), (d_pr, d_zr)) in both {
        let d_c = d_zl.dot(&zr) + zl.dot(&d_zr);
        let d_dz = d_zr * c + zr * d_c - d_zl;
        // (17)
        let d_h = (dz.dot(&(d_pl - d_pr)) + dp.dot(&d_dz) + 2.0 * h * c * d_c) / (1.0 - c * c);
        d_point.push(d_pl + h * d_zl + zl * d_h); // (16)
        // (22)
        d_kci.push(
            zr.dot(&(d_pl.cross(&zl) + pl.cross(&d_zl)))
                + d_zr.dot(&pl.cross(&zl))
                + zl.dot(&(d_pr.cross(&zr) + pr.cross(&d_zr)))
                + d_zl.dot(&pr.cross(&zr)),
        );
    }
    // (20) and (21) are one number
    let kci = -dp.dot(&zr.cross(&zl));
    let also = zr.dot(&pl.cross(&zl)) + zl.dot(&pr.cross(&zr));
    assert!((kci - also).abs() <= 1e-9 * (1.0 + dp.norm()));
    Observed { point: pl + h * zl, kci, d_point, d_kci }
}

/// The 21 parameters among the 24 numbers of the six links: L0 and R0 have no b, L0 no a.
fn is_parameter(k: usize) -> bool {
    !matches!(k, 0 | 1 | 13)
}

#[test]
fn the_papers_formulas_agree() {
    let Some((rows, points)) = oracle_rows() else { return };
    let problem_program = flagship();
    let problem = problem_program.bound(&rows);
    for q in points {
        let mut all = q.iter();
        let mut links = [[0.0; 4]; 6];
        for k in (0..24).filter(|&k| is_parameter(k)) {
            links[k / 4][k % 4] = *all.next().unwrap();
        }
        let left = [links[0], links[1], links[2]];
        let right = [links[3], links[4], links[5]];
        let block = &problem.blocks[0];
        block
            .jacobians(&problem.layout, &q, &problem.places(), |found| {
                let x = block.table.row(found.row);
                let upper = observe(&sight(&left, x[0], x[1]), &sight(&right, x[2], x[3]));
                let lower = observe(&sight(&left, x[4], x[5]), &sight(&right, x[6], x[7]));
                let vo = upper.point - lower.point - Vector3::z() * x[8]; // (4)
                let residuals = [vo.x, vo.y, vo.z, upper.kci, lower.kci];
                // the values cancel from points metres away, the derivatives do not
                close(found.residuals, &residuals, 1e-11, "residuals");
                for i in 0..5 {
                    let expected: Vec<f64> = (0..24)
                        .filter(|&k| is_parameter(k))
                        .map(|k| match i {
                            3 => upper.d_kci[k],
                            4 => lower.d_kci[k],
                            _ => upper.d_point[k][i] - lower.d_point[k][i], // (18)
                        })
                        .collect();
                    close(
                        &found.derivatives[i * 21..(i + 1) * 21],
                        &expected,
                        1e-12,
                        &format!("residual {i}, row {}", found.row),
                    );
                }
                Ok(())
            })
            .unwrap();
    }
}
