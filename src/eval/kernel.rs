//! The inner loop: operations outside, rows inside.
//!
//! What a run of like steps does is looked up once; each step then goes over the rows of a block in vectors. A buffer begins
//! with the uniforms, one number each, which a step spreads over a vector once; slots and outputs follow, so many vectors each.
//! These are cells, for a result may take the slot of an operand; a step reads each vector before it writes it. All of it
//! passes through the nearest cache once for each block, so that what is short is fast: the code too.

use std::cell::Cell;

use pulp::{Simd, WithSimd, bytemuck};

use super::schedule::{Action, Addend, Place, Schedule};
use crate::graph::Operation;
use crate::simd::{mul_add, near_all, near_sin_cos, neg_mul_add, sin_cos};

/// Rows of a block.
pub const ROWS: usize = 64;

/// Steps of one kind.
#[derive(Clone, Debug)]
struct Group {
    action: Action,
    /// which of two operands is a uniform
    uniform: Option<usize>,
    /// of each step its operands and then its results, as positions: of a uniform among the uniforms, of the rest among slots
    /// and outputs
    positions: Vec<u32>,
}

/// A schedule with places as positions in a buffer.
#[derive(Clone, Debug)]
pub(super) struct Code {
    groups: Vec<Group>,
    pub(super) layout: Layout,
}

/// Where things stand in the buffer, in numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) slots: usize,
    pub(super) outputs: usize,
    pub(super) len: usize,
}

impl Code {
    pub(super) fn new(schedule: &Schedule) -> Code {
        // slots begin at a line of the cache
        let slots = schedule.uniforms().next_multiple_of(8);
        let outputs = slots + schedule.slots * ROWS;
        let layout = Layout { slots, outputs, len: outputs + schedule.outputs * ROWS };
        let at = |place: Place| match place {
            Place::Uniform(uniform) => uniform,
            Place::Slot(slot) => slot,
            Place::Output(output) => schedule.slots as u32 + output,
        };
        let mut groups: Vec<Group> = Vec::new();
        for step in &schedule.steps {
            let (action, uniform) = step.kind();
            let positions = step.operands().iter().chain(step.results()).map(|&place| at(place));
            match groups.last_mut() {
                Some(group) if (group.action, group.uniform) == (action, uniform) => group.positions.extend(positions),
                _ => groups.push(Group { action, uniform, positions: positions.collect() }),
            }
        }
        Code { groups, layout }
    }
}

/// Runs code on one block.
pub(super) struct Run<'a> {
    pub(super) code: &'a Code,
    /// uniforms and inputs are there already
    pub(super) numbers: &'a mut [f64],
}

impl WithSimd for Run<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match S::F64_LANES {
            8 => self.run::<S, { ROWS / 8 }>(simd),
            4 => self.run::<S, { ROWS / 4 }>(simd),
            _ => self.run::<S, { ROWS / 2 }>(simd),
        }
    }
}

impl Run<'_> {
    #[inline(always)]
    fn run<S: Simd, const N: usize>(self, simd: S) {
        let (uniforms, rows) = self.numbers.split_at_mut(self.code.layout.slots);
        let vectors = Cell::from_mut(S::as_mut_simd_f64s(rows).0).as_slice_of_cells();
        let block = Vectors::<S, N> { simd, uniforms, rows: vectors.as_chunks().0 };
        for group in &self.code.groups {
            let (all, uniform) = (group.positions.as_slice(), group.uniform);
            match group.action {
                Action::Sum { uniform, positive, negative, addend, sums } => {
                    macro_rules! shapes {
                        ($($addend:ident [$($k:literal)*]: $shapes:tt;)*) => {
                            match (addend, sums) {
                                $($((Addend::$addend, $k) => shapes!($addend $k $shapes),)*)*
                                _ => debug_assert!(false, "one to three sums share factors, and with a uniform addend none do"),
                            }
                        };
                        ($addend:ident $k:literal [$(($u:literal, $p:literal, $m:literal))*]) => {
                            match (uniform, positive, negative) {
                                $(($u, $p, $m) => block.sums::<$u, $p, $m, { Addend::$addend as u8 }, $k>(all),)*
                                _ => debug_assert!(false, "sums of other signs are planned as their opposites"),
                            }
                        };
                    }
                    shapes!(
                        None [1 2 3]: [(0, 1, 0) (0, 2, 0) (0, 1, 1) (0, 3, 0) (0, 2, 1) (0, 1, 2) (0, 0, 3)
                            (1, 0, 0) (1, 1, 0) (1, 2, 0) (1, 1, 1) (2, 0, 0) (2, 1, 0) (3, 0, 0)];
                        PerRow [1 2 3]: [(0, 1, 0) (0, 0, 1) (0, 2, 0) (0, 1, 1) (0, 0, 2)
                            (0, 3, 0) (0, 2, 1) (0, 1, 2) (0, 0, 3) (1, 0, 0) (1, 1, 0) (1, 0, 1)
                            (1, 2, 0) (1, 1, 1) (1, 0, 2) (2, 0, 0) (2, 1, 0) (2, 0, 1) (3, 0, 0)];
                        Uniform [1]: [(0, 1, 0) (0, 2, 0) (0, 1, 1) (0, 3, 0) (0, 2, 1)
                            (1, 0, 0) (1, 1, 0) (1, 2, 0) (1, 1, 1) (2, 0, 0) (2, 1, 0) (3, 0, 0)];
                    )
                }
                Action::Add => block.two(all, uniform, |x, y| simd.add_f64s(x, y)),
                Action::Sub => block.two(all, uniform, |x, y| simd.sub_f64s(x, y)),
                Action::Div => block.two(all, uniform, |x, y| simd.div_f64s(x, y)),
                Action::Neg => block.one(all, uniform, |x| simd.neg_f64s(x)),
                Action::Copy => block.one(all, uniform, |x| x),
                Action::Sqrt => block.one(all, uniform, |x| simd.sqrt_f64s(x)),
                Action::SinCos => block.sin_cos(all),
                Action::Call(Operation::Abs) => block.two(all, uniform, |x, _| simd.abs_f64s(x)),
                Action::Call(Operation::AtLeast) => block.two(all, uniform, |x, y| {
                    simd.select_f64s(simd.greater_than_or_equal_f64s(x, y), x, simd.splat_f64s(f64::NAN))
                }),
                Action::Call(operation) => block.call(all, uniform, operation),
            }
        }
    }
}

/// The numbers of a block as vectors, N of them for each slot.
struct Vectors<'a, S: Simd, const N: usize> {
    simd: S,
    uniforms: &'a [f64],
    rows: &'a [[Cell<S::f64s>; N]],
}

impl<S: Simd, const N: usize> Vectors<'_, S, N> {
    #[inline(always)]
    fn uniform(&self, at: usize) -> S::f64s {
        self.simd.splat_f64s(self.uniforms[at])
    }

    /// Applies a function of one operand.
    #[inline(always)]
    fn one(&self, steps: &[u32], uniform: Option<usize>, f: impl Fn(S::f64s) -> S::f64s) {
        for [x, to] in steps.as_chunks().0 {
            let (x, to) = (*x as usize, &self.rows[*to as usize]);
            match uniform {
                None => {
                    let x = &self.rows[x];
                    for i in 0..N {
                        to[i].set(f(x[i].get()));
                    }
                }
                Some(_) => {
                    let value = f(self.uniform(x));
                    for to in to {
                        to.set(value);
                    }
                }
            }
        }
    }

    /// Applies a function of two operands, one of which may be a uniform.
    #[inline(always)]
    fn two(&self, steps: &[u32], uniform: Option<usize>, f: impl Fn(S::f64s, S::f64s) -> S::f64s) {
        for [x, y, to] in steps.as_chunks().0 {
            let (x, y, to) = (*x as usize, *y as usize, &self.rows[*to as usize]);
            match uniform {
                None => {
                    let (x, y) = (&self.rows[x], &self.rows[y]);
                    for i in 0..N {
                        to[i].set(f(x[i].get(), y[i].get()));
                    }
                }
                Some(0) => {
                    let (x, y) = (self.uniform(x), &self.rows[y]);
                    for i in 0..N {
                        to[i].set(f(x, y[i].get()));
                    }
                }
                Some(_) => {
                    let (x, y) = (&self.rows[x], self.uniform(y));
                    for i in 0..N {
                        to[i].set(f(x[i].get(), y));
                    }
                }
            }
        }
    }

    /// K sums of products with shared factors: U with a uniform, P more, less M others, and of an addend. Written out, for
    /// what is generic over the number of operands does not stay in registers.
    #[inline(always)]
    fn sums<const U: usize, const P: usize, const M: usize, const ADDEND: u8, const K: usize>(&self, steps: &[u32]) {
        let simd = self.simd;
        let products = U + P + M;
        let width = products + usize::from(ADDEND != Addend::None as u8);
        for step in steps.chunks_exact(products + K * (width + 1)) {
            // what is not there is what surely is, which costs nothing
            let row = |k: usize, there: bool| &self.rows[step[if there { k } else { 0 }] as usize];
            let splat = |k: usize, there: bool| match there {
                true => self.uniform(step[k] as usize),
                false => simd.splat_f64s(0.0),
            };
            let b = (row(0, true), row(1, products > 1), row(2, products > 2));
            macro_rules! own {
                ($sum:literal) => {{
                    let (first, there) = (products + $sum * width, $sum < K);
                    (
                        (
                            row(first, there && U < 1),
                            row(first + 1, there && U < 2 && products > 1),
                            row(first + 2, there && U < 3 && products > 2),
                        ),
                        (
                            splat(first, there && U > 0),
                            splat(first + 1, there && U > 1),
                            splat(first + 2, there && U > 2),
                        ),
                        row(first + products, there && ADDEND == Addend::PerRow as u8),
                        splat(first + products, there && ADDEND == Addend::Uniform as u8),
                        &self.rows[step[products + K * width + if there { $sum } else { 0 }] as usize],
                    )
                }};
            }
            let (first, second, third) = (own!(0), own!(1), own!(2));
            for i in 0..N {
                let x0 = b.0[i].get();
                let x1 = if products > 1 { b.1[i].get() } else { x0 };
                let x2 = if products > 2 { b.2[i].get() } else { x0 };
                macro_rules! sum {
                    ($own:ident) => {{
                        let (a, uniform, addend, uniform_addend, _) = $own;
                        let mut sum = match ADDEND {
                            0 => x0,
                            1 => addend[i].get(),
                            _ => uniform_addend,
                        };
                        let y = if U > 0 { uniform.0 } else { a.0[i].get() };
                        sum = match ADDEND {
                            0 if U + P > 0 => simd.mul_f64s(y, x0),
                            0 => simd.neg_f64s(simd.mul_f64s(y, x0)),
                            _ if U + P > 0 => mul_add(simd, y, x0, sum),
                            _ => neg_mul_add(simd, y, x0, sum),
                        };
                        if products > 1 {
                            let y = if U > 1 { uniform.1 } else { a.1[i].get() };
                            sum = if U + P > 1 { mul_add(simd, y, x1, sum) } else { neg_mul_add(simd, y, x1, sum) };
                        }
                        if products > 2 {
                            let y = if U > 2 { uniform.2 } else { a.2[i].get() };
                            sum = if U + P > 2 { mul_add(simd, y, x2, sum) } else { neg_mul_add(simd, y, x2, sum) };
                        }
                        sum
                    }};
                }
                // all are computed before any is written, for a result may stand where an operand stood
                let one = sum!(first);
                let two = if K > 1 { sum!(second) } else { one };
                let three = if K > 2 { sum!(third) } else { one };
                first.4[i].set(one);
                if K > 1 {
                    second.4[i].set(two);
                }
                if K > 2 {
                    third.4[i].set(three);
                }
            }
        }
    }

    #[inline(always)]
    fn sin_cos(&self, steps: &[u32]) {
        for [angle, sine, cosine] in steps.as_chunks().0 {
            let [angle, sine, cosine] = [angle, sine, cosine].map(|&at| &self.rows[at as usize]);
            // asked of all rows first, so that the loop proper has no branch
            let mut near = true;
            for x in angle {
                near &= near_all(self.simd, x.get());
            }
            if near {
                for i in 0..N {
                    let (s, c) = near_sin_cos(self.simd, angle[i].get());
                    sine[i].set(s);
                    cosine[i].set(c);
                }
            } else {
                for i in 0..N {
                    let (s, c) = sin_cos(self.simd, angle[i].get());
                    sine[i].set(s);
                    cosine[i].set(c);
                }
            }
        }
    }

    /// A row of the table of operations, number by number.
    #[inline(never)]
    fn call(&self, steps: &[u32], uniform: Option<usize>, operation: Operation) {
        self.two(steps, uniform, |x, y| {
            let mut result = x;
            let (xs, ys) = ([x], [y]);
            let (xs, ys) = (bytemuck::cast_slice::<S::f64s, f64>(&xs), bytemuck::cast_slice::<S::f64s, f64>(&ys));
            let results = bytemuck::cast_slice_mut::<S::f64s, f64>(std::slice::from_mut(&mut result));
            for ((result, x), y) in results.iter_mut().zip(xs).zip(ys) {
                *result = operation.apply(x, y);
            }
            result
        });
    }
}
