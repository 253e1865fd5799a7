//! Where operations are tried, and how their operands come to them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::graph::{Graph, Operation, Scalar};

/// How an operand varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Row,
    Uniform,
    Constant,
}

pub(super) const KINDS: [Kind; 3] = [Kind::Row, Kind::Uniform, Kind::Constant];

/// Points with the operands that all of them share: those that do not vary with the row.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    pub(super) kinds: [Kind; 2],
    pub(super) points: Vec<[f64; 2]>,
}

impl Batch {
    /// The operands as nodes.
    pub(super) fn operands(&self, g: &mut Graph) -> [Scalar; 2] {
        [0, 1].map(|k| match self.kinds[k] {
            Kind::Row => g.input(k as u32),
            Kind::Uniform => g.parameter(k as u32),
            Kind::Constant => g.constant(self.points[0][k]),
        })
    }

    /// The points as they arrive: −0 and 0 are one constant.
    pub(super) fn arriving(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.points.iter().map(|point| {
            [0, 1].map(|k| if self.kinds[k] == Kind::Constant && point[k] == 0.0 { 0.0 } else { point[k] })
        })
    }
}

/// Operations whose second operand is a whole constant.
pub(super) fn whole(operation: Operation) -> bool {
    matches!(operation, Operation::PowInteger | Operation::Stumpff | Operation::Atanc)
}

/// Positive numbers from the least to the greatest, dense where functions end, turn or change their method.
fn magnitudes() -> Vec<f64> {
    let mut all = vec![0.0, 5e-324, 1e-310, f64::MIN_POSITIVE, 1e-300, 1e-200, 1e-154, 1e-20, 1e-9, 1e-3, 0.01, 0.1];
    all.extend([
        0.01f64.next_down(),
        0.25,
        0.3,
        0.5f64.next_down(),
        0.5,
        0.6,
        0.75,
        0.99,
        0.999_999,
        1.0f64.next_down(),
    ]);
    all.extend([1.0, 1.0f64.next_up(), 1.2, 1.5, FRAC_PI_2.next_down(), FRAC_PI_2, FRAC_PI_2.next_up(), 2.0, 2.5, 3.0]);
    all.extend([
        PI.next_down(),
        PI,
        PI.next_up(),
        4.0,
        1.5 * PI,
        TAU.next_down(),
        TAU,
        TAU.next_up(),
        7.0,
        17.25,
        64.5,
    ]);
    all.extend([700.0, 709.7, 709.8, 745.2, 1e4, 1e5, 1e5f64.next_up(), 123_456.789, 1e9, 1e16, 1e154, 1e200, 1e300]);
    all.extend([f64::MAX, f64::INFINITY]);
    all
}

/// All operands of an operation, in pairs.
fn pairs(operation: Operation) -> Vec<[f64; 2]> {
    let mut all: Vec<f64> = magnitudes().into_iter().flat_map(|x| [x, -x]).collect();
    all.push(f64::NAN);
    let seconds: Vec<f64> = match operation {
        Operation::PowInteger => [-9, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 8, 17, 64].map(f64::from).to_vec(),
        Operation::Stumpff => (0..5).map(f64::from).collect(),
        Operation::Atanc => (0..3).map(f64::from).collect(),
        _ if operation.row().arity == 1 => vec![1.0],
        _ => all.clone(),
    };
    all.iter().flat_map(|&x| seconds.iter().map(move |&y| [x, y])).collect()
}

/// Every way for operands to arrive, over all pairs, or a part of them where each is a program of its own.
pub(super) fn batches(operation: Operation) -> Vec<Batch> {
    let pairs = pairs(operation);
    let mut batches = Vec::new();
    for first in KINDS {
        for second in KINDS {
            let unary = operation.row().arity == 1;
            if (whole(operation) || unary) && second != Kind::Constant {
                continue;
            }
            let kinds = [first, second];
            let same =
                |a: &[f64; 2], b: &[f64; 2]| (0..2).all(|k| kinds[k] == Kind::Row || a[k].to_bits() == b[k].to_bits());
            let step = if !kinds.contains(&Kind::Row) && pairs.len() > 1000 { 41 } else { 1 };
            let mut of_kind: Vec<Batch> = Vec::new();
            for point in pairs.iter().step_by(step) {
                match of_kind.iter_mut().find(|batch| same(&batch.points[0], point)) {
                    Some(batch) => batch.points.push(*point),
                    None => of_kind.push(Batch { kinds, points: vec![*point] }),
                }
            }
            batches.append(&mut of_kind);
        }
    }
    batches
}

#[test]
fn points_reach_every_border() {
    for row in crate::graph::OPERATIONS {
        let pairs = pairs(row.operation);
        let inside = |p: &&[f64; 2]| (row.defined)(p[0], p[1]);
        let defined = pairs.iter().filter(inside).count();
        assert!(defined > 20, "{}", row.name);
        let everywhere = (row.defined)(f64::NAN, 1.0);
        assert!(everywhere || defined < pairs.len(), "{}", row.name);
    }
}

#[test]
fn every_operand_arrives_in_every_way() {
    for row in crate::graph::OPERATIONS {
        let batches = batches(row.operation);
        let ways = if row.arity == 2 && !whole(row.operation) { 9 } else { 3 };
        let mut kinds: Vec<[Kind; 2]> = batches.iter().map(|batch| batch.kinds).collect();
        kinds.dedup();
        assert_eq!(kinds.len(), ways, "{}", row.name);
        assert!(batches.iter().any(|batch| batch.points.len() > crate::eval::ROWS), "{}", row.name);
    }
}
