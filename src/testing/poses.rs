//! Random rotations and poses.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

/// Rotation vectors in radians. Eight in ten are distributed evenly over all rotations (Shoemake, Uniform random rotations, Graphics
/// Gems III, 1992); the others are the edges of what a rotation vector can say: identity, and half-turns, about any axis and about
/// those of the frame. They shrink to identity.
///
/// ```
/// use proptest::prelude::*;
/// proptest!(|(r in phical::testing::rotations())| {
///     let angle = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
///     prop_assert!(angle <= 3.141592653589794);
/// });
/// ```
pub fn rotations() -> impl Strategy<Value = [f64; 3]> {
    let along = (prop::sample::select(vec![-PI, PI]), 0..3usize);
    let of_frame = along.prop_map(|(turn, axis)| std::array::from_fn(|k| if k == axis { turn } else { 0.0 }));
    let half = even().prop_map(|r| {
        let angle = length(r);
        if angle > 0.0 { r.map(|x| x / angle * PI) } else { [PI, 0.0, 0.0] }
    });
    prop_oneof![2 => Just([0.0; 3]), 16 => even(), 1 => half, 1 => of_frame]
}

/// Poses: a translation within so far along each axis, evenly, or none, then a rotation vector as of [`rotations`].
///
/// ```
/// use proptest::prelude::*;
/// proptest!(|(pose in phical::testing::poses(500.0))| {
///     prop_assert!(pose[..3].iter().all(|x| x.abs() <= 500.0));
/// });
/// ```
pub fn poses(reach: f64) -> impl Strategy<Value = [f64; 6]> {
    let somewhere = prop::array::uniform3(-1.0..=1.0f64).prop_map(move |shares| shares.map(|share| share * reach));
    let translation = prop_oneof![1 => Just([0.0; 3]), 9 => somewhere];
    (translation, rotations()).prop_map(|([x, y, z], [rx, ry, rz])| [x, y, z, rx, ry, rz])
}

fn length(r: [f64; 3]) -> f64 {
    r.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Evenly distributed rotation vectors: a unit quaternion (w, x, y, z) that is even on the sphere of four dimensions, its two halves
/// so arranged that zeros are the identity.
fn even() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(0.0..1.0f64).prop_map(|[share, one, other]| {
        let (first, second) = ((1.0 - share).sqrt(), share.sqrt());
        let mut w = first * (TAU * one).cos();
        let mut v = [first * (TAU * one).sin(), second * (TAU * other).sin(), second * (TAU * other).cos()];
        if w < 0.0 {
            (w, v) = (-w, v.map(|x| -x));
        }
        let sine = length(v);
        if sine > 0.0 { v.map(|x| x / sine * 2.0 * sine.atan2(w)) } else { [0.0; 3] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Rotation3, Vector3};
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;

    /// Evenly distributed rotations have a mean matrix of zero and turn by π/2 + 2/π on average, for their angle has the density
    /// (1 − cos θ)/π.
    #[test]
    fn rotations_are_even() {
        const MANY: usize = 20_000;
        let mut runner = TestRunner::deterministic();
        let (strategy, mut mean, mut angle) = (even(), Matrix3::zeros(), 0.0);
        for _ in 0..MANY {
            let r = strategy.new_tree(&mut runner).unwrap().current();
            mean += Rotation3::new(Vector3::from(r)).matrix() / MANY as f64;
            angle += length(r) / MANY as f64;
        }
        assert!(mean.amax() < 0.02, "{mean}");
        assert!((angle - (PI / 2.0 + 2.0 / PI)).abs() < 0.02, "{angle}");
    }

    #[test]
    fn edges_occur() {
        let mut runner = TestRunner::deterministic();
        let (strategy, mut identities, mut half_turns) = (poses(10.0), 0, 0);
        for _ in 0..1000 {
            let pose = strategy.new_tree(&mut runner).unwrap().current();
            let angle = length([pose[3], pose[4], pose[5]]);
            identities += usize::from(angle == 0.0);
            half_turns += usize::from((angle - PI).abs() < 1e-12);
            assert!(angle <= PI + 1e-12 && pose[..3].iter().all(|x| x.abs() <= 10.0));
        }
        assert!(identities > 75 && half_turns > 75, "{identities} {half_turns}");
    }
}
