//! Random graphs of geometry.

use proptest::prelude::*;

use crate::graph::{Axis, Frame, Graph, Operation, Rotation, Scalar, Vector};

pub(crate) const PARAMETERS: usize = 8;
pub(crate) const INPUTS: usize = 3;

/// What a node is made of, whatever there is to make it from.
pub(crate) type Gene = (u8, u8, u8, u8);

pub(crate) fn genes() -> impl Strategy<Value = Vec<Gene>> {
    prop::collection::vec(any::<Gene>(), 1..16)
}

/// Parameters and two rows of inputs: all zero, or anything, or some of each.
pub(crate) fn point() -> impl Strategy<Value = (Vec<f64>, Vec<Vec<f64>>)> {
    let all = |zeros: f64| {
        let number =
            move || prop::bool::weighted(zeros).prop_flat_map(|zero| if zero { 0.0..=0.0 } else { -1.5..=1.5 });
        let row = prop::collection::vec(number(), INPUTS);
        (prop::collection::vec(number(), PARAMETERS), prop::collection::vec(row, 2))
    };
    prop_oneof![all(0.0), all(1.0), all(0.5)]
}

struct Pools {
    scalars: Vec<Scalar>,
    vectors: Vec<Vector>,
    rotations: Vec<Rotation>,
    frames: Vec<Frame>,
}

fn pick<T: Copy>(pool: &[T], k: u8) -> T {
    pool[usize::from(k) % pool.len()]
}

/// A graph of geometry, with numbers that are read off it.
pub(crate) fn build(genes: &[Gene]) -> (Graph, Vec<Scalar>) {
    let mut g = Graph::new();
    let mut scalars: Vec<Scalar> = (0..PARAMETERS as u32).map(|i| g.parameter(i)).collect();
    scalars.extend((0..INPUTS as u32).map(|i| g.input(i)));
    scalars.extend([0.0, 0.7].map(|c| g.constant(c)));
    let vectors = vec![
        g.constant_vector([1.0, 2.0, -0.5]),
        g.vector(scalars[0], scalars[1], scalars[2]),
        g.vector(scalars[8], scalars[3], scalars[9]),
    ];
    let rotations = vec![g.exp_rotation(vectors[1]), g.turn(Axis::Y, scalars[10])];
    let frames = vec![g.frame(rotations[0], vectors[2]), g.screw(Axis::X, scalars[4], scalars[5])];
    let mut pools = Pools { scalars, vectors, rotations, frames };
    let mut outputs = Vec::new();
    for &gene in genes {
        match gene.0 % 4 {
            0 => pools.rotation(&mut g, gene),
            1 => pools.frame(&mut g, gene),
            2 => pools.vector(&mut g, gene),
            _ => outputs.push(pools.read(&mut g, gene)),
        }
    }
    let last = pools.frames.len() as u8 - 1;
    outputs.push(pools.read(&mut g, (0, 0, last, 1)));
    outputs.push(pools.read(&mut g, (4, 1, pools.rotations.len() as u8 - 1, 2)));
    (g, outputs)
}

impl Pools {
    fn rotation(&mut self, g: &mut Graph, (what, a, b, c): Gene) {
        let axis = Axis::ALL[usize::from(c) % 3];
        let (r, s) = (pick(&self.rotations, a), pick(&self.rotations, b));
        let made = match what / 4 % 8 {
            0 => g.turn(axis, pick(&self.scalars, a)),
            1 => g.exp_rotation(pick(&self.vectors, a)),
            2 => {
                let one = g.constant(1.0);
                let [x, y, z] = [a, b, c].map(|k| pick(&self.scalars, k));
                g.quaternion(one, x, y, z)
            }
            3 => {
                let [x, y, z] = Axis::ALL.map(|axis| g.column(r, axis));
                g.columns(y, z, x)
            }
            4 => g.inverse_rotation(r),
            5 => g.rotation_of(pick(&self.frames, a)),
            _ => g.compose_rotation(r, s),
        };
        self.rotations.push(made);
    }

    fn frame(&mut self, g: &mut Graph, (what, a, b, c): Gene) {
        let axis = Axis::ALL[usize::from(c) % 3];
        let (f, h) = (pick(&self.frames, a), pick(&self.frames, b));
        let made = match what / 4 % 8 {
            0 => {
                let link = [a, b, c, a ^ b].map(|k| pick(&self.scalars, k));
                g.phi_joint(pick(&self.scalars, a.wrapping_add(c)), pick(&self.scalars, b ^ c), link)
            }
            1 => g.screw(axis, pick(&self.scalars, a), pick(&self.scalars, b)),
            2 => g.frame(pick(&self.rotations, a), pick(&self.vectors, b)),
            3 => g.inverse_frame(f),
            4 => {
                let last = pick(&self.frames, self.frames.len() as u8 - 1);
                g.compose_frame(f, last)
            }
            _ => g.compose_frame(f, h),
        };
        self.frames.push(made);
    }

    fn vector(&mut self, g: &mut Graph, (what, a, b, c): Gene) {
        let axis = Axis::ALL[usize::from(c) % 3];
        let (u, v) = (pick(&self.vectors, a), pick(&self.vectors, b));
        let made = match what / 4 % 10 {
            0 => g.transform(pick(&self.frames, a), v),
            1 => g.rotate(pick(&self.rotations, a), v),
            2 => g.column(pick(&self.rotations, a), axis),
            3 => g.origin(pick(&self.frames, a)),
            4 => g.cross(u, v),
            5 => {
                let lifted = self.lifted(g, u);
                g.unit(lifted)
            }
            6 => g.log_rotation(pick(&self.rotations, a)),
            7 => g.add_vector(u, v),
            8 => g.sub_vector(u, v),
            _ => g.scale(pick(&self.scalars, a), v),
        };
        // kept short, so that what is made of it is no less well determined
        let made = if (4..9).contains(&(what / 4 % 10)) {
            let tenth = g.constant(0.1);
            g.scale(tenth, made)
        } else {
            made
        };
        self.vectors.push(made);
    }

    /// A vector that is not zero.
    fn lifted(&self, g: &mut Graph, v: Vector) -> Vector {
        let away = g.constant_vector([30.0, -20.0, 10.0]);
        g.add_vector(v, away)
    }

    fn read(&self, g: &mut Graph, (what, a, b, c): Gene) -> Scalar {
        let axis = Axis::ALL[usize::from(c) % 3];
        let v = match what / 4 % 6 {
            0 => g.transform(pick(&self.frames, b), pick(&self.vectors, a)),
            1 => g.log_rotation(pick(&self.rotations, b)),
            2 => return g.dot(pick(&self.vectors, a), pick(&self.vectors, b)),
            3 => {
                let lifted = self.lifted(g, pick(&self.vectors, b));
                return g.norm(lifted);
            }
            4 => {
                let s = pick(&self.scalars, a);
                let v = g.rotate(pick(&self.rotations, b), pick(&self.vectors, a));
                let (x, sine) = (g.component(v, axis), g.unary(Operation::Sin, s));
                return g.mul(x, sine);
            }
            _ => pick(&self.vectors, b),
        };
        g.component(v, axis)
    }
}
