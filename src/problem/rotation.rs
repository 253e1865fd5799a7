//! Rotation vectors as points on the manifold of rotations, by unit quaternions: right at zero and at half a turn.

type Vector = [f64; 3];
type Quaternion = [f64; 4];

/// The quaternion (w, x, y, z) of a rotation vector.
fn exp(v: Vector) -> Quaternion {
    let half = 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    // sin(θ/2)/θ, by its series where the angle is small
    let s = if half < 1e-4 { 0.5 - half * half / 12.0 } else { half.sin() / (2.0 * half) };
    [half.cos(), s * v[0], s * v[1], s * v[2]]
}

fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The rotation vector of a quaternion; of the two that differ by a whole turn, the shorter one.
fn log(q: Quaternion) -> Vector {
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    let [w, x, y, z] = q.map(|c| sign * c);
    let s = (x * x + y * y + z * z).sqrt();
    // θ/sin(θ/2), by its series where the angle is small
    let factor = if s < 1e-4 { 2.0 / w * (1.0 - s * s / (3.0 * w * w)) } else { 2.0 * s.atan2(w) / s };
    [factor * x, factor * y, factor * z]
}

/// R(v)·R(ω) as a rotation vector: of the two that mean it, the one nearer to v, so that numbers do not jump.
pub(super) fn compose(v: Vector, omega: Vector) -> Vector {
    if omega == [0.0; 3] {
        return v;
    }
    let short = log(product(exp(v), exp(omega)));
    let length = short.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 {
        return short;
    }
    let long = short.map(|c| c * (1.0 - std::f64::consts::TAU / length));
    let distance = |w: Vector| (0..3).map(|i| (w[i] - v[i]).powi(2)).sum::<f64>();
    if distance(long) < distance(short) { long } else { short }
}

/// log(R(a)ᵀ·R(b)): how far b is turned from a, seen in a.
pub(super) fn difference(a: Vector, b: Vector) -> Vector {
    log(product(exp(a.map(|c| -c)), exp(b)))
}

/// The derivative of log(R(φ)·R(ω)) by ω at zero: the inverse of the right Jacobian,
/// J⁻¹ = I + ½\[φ\]× + (1/θ² − (1 + cos θ)/(2 θ sin θ)) \[φ\]×². Source: Chirikjian, Stochastic Models, Information Theory, and
/// Lie Groups 2 (2012), §10.6.
pub(super) fn right_jacobian_inverse(phi: Vector) -> [[f64; 3]; 3] {
    let square = phi.iter().map(|c| c * c).sum::<f64>();
    let theta = square.sqrt();
    let second = if theta < 1e-2 {
        1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    } else {
        1.0 / square - (1.0 + theta.cos()) / (2.0 * theta * theta.sin())
    };
    let [x, y, z] = phi;
    let hat = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let mut result = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let squared: f64 = (0..3).map(|k| hat[i][k] * hat[k][j]).sum();
            result[i][j] = f64::from(i == j) + 0.5 * hat[i][j] + second * squared;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn close(a: Vector, b: Vector, tolerance: f64) -> bool {
        (0..3).all(|i| (a[i] - b[i]).abs() <= tolerance)
    }

    proptest! {
        #[test]
        fn difference_undoes_compose(v in prop::array::uniform3(-2.0f64..2.0), w in prop::array::uniform3(-1.0f64..1.0), tiny in 0usize..3) {
            let w = w.map(|c| c * [1.0, 1e-6, 0.0][tiny]);
            prop_assert!(close(difference(v, compose(v, w)), w, 1e-14));
        }

        #[test]
        fn the_jacobian_is_that_of_differences(v in prop::array::uniform3(-1.5f64..1.5), tiny in 0usize..3) {
            let v = v.map(|c| c * [1.0, 1e-3, 0.0][tiny]);
            let exact = right_jacobian_inverse(v);
            let h = 1e-6;
            for j in 0..3 {
                let (mut plus, mut minus) = ([0.0; 3], [0.0; 3]);
                (plus[j], minus[j]) = (h, -h);
                let (p, m) = (compose(v, plus), compose(v, minus));
                for i in 0..3 {
                    prop_assert!(((p[i] - m[i]) / (2.0 * h) - exact[i][j]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn half_a_turn_does_not_jump() {
        let v = [PI, 0.0, 0.0];
        let beyond = compose(v, [1e-3, 0.0, 0.0]);
        assert!(close(beyond, [PI + 1e-3, 0.0, 0.0], 1e-12), "{beyond:?}");
        assert!(close(difference(v, beyond), [1e-3, 0.0, 0.0], 1e-12));
    }
}
