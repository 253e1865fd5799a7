//! Householder reflections of a block of rows against a triangular factor, at the speed of the machine's vectors.
//!
//! Column k of the block, b, and entry α of R on the diagonal make one vector x = (α; b). With β = −sign(α)‖x‖, p = α − β,
//! v = (p; b) and γ = 2/vᵀv = −1/(β p), the reflection 1 − γ v vᵀ takes x to (β; 0): Golub & Van Loan, Matrix Computations
//! (4th ed.), §5.1.2, without the division of b by p. It changes row k of R and the block, nothing else.
//!
//! Four columns, a *panel*, are reflected together. The product of their reflections takes a column c, with t_i in row k_i of R,
//! to c − Σ sᵢ bᵢ and tᵢ − sᵢ pᵢ, where
//!
//! ```text
//! sᵢ = γᵢ (pᵢ tᵢ + bᵢᵀc − Σ_{l<i} bᵢᵀbₗ sₗ)          (1)
//! ```
//!
//! by substitution: the compact form of Schreiber & Van Loan, SIAM J. Sci. Stat. Comput. 10 (1989), 53–57, with its triangle
//! inverted. So a column is read twice for four reflections, and loads of bᵢ are shared by several columns. Sums run in a
//! fixed order: a factor is a function of the block and the instruction set.

use pulp::{Simd, WithSimd, bytemuck};

use super::{Matrix, norm};
use crate::simd::{largest_of, mul_add};

/// Columns that are reflected together.
const PANEL: usize = 4;

/// Rows come in groups of so many: a multiple of the lanes of every instruction set.
pub(super) const GROUP: usize = 8;

/// The narrowest vector has two lanes.
const MOST_STEPS: usize = GROUP / 2;

/// Between these, squares of a column and products with another one keep all their digits.
const SAFE: std::ops::Range<f64> = 1e-100..1e100;

/// Folds the rows of a block \[J r\] into R and d, and returns the sum of squares that is left.
pub(super) struct Fold<'a> {
    /// R, n × n.
    pub(super) r: &'a mut Matrix,
    /// d.
    pub(super) d: &'a mut [f64],
    /// Column by column, n + 1 of them, `ld` apart; overwritten.
    pub(super) block: &'a mut [f64],
    /// From one column to the next, a multiple of [`GROUP`].
    pub(super) ld: usize,
    /// Rows in use, a multiple of [`GROUP`] and at most `ld`.
    pub(super) rows: usize,
    /// Where the block is a trapezium: row i is zero in the columns before `starts[i]`, which increase; rows beyond are
    /// zero but for the residual.
    pub(super) starts: Option<&'a [usize]>,
}

impl WithSimd for Fold<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { r, d, block, ld, rows, starts } = self;
        let n = d.len();
        debug_assert!(ld.is_multiple_of(GROUP) && rows.is_multiple_of(GROUP) && rows <= ld);
        let (vectors, _) = S::as_mut_simd_f64s(&mut block[..ld * (n + 1)]);
        let (ld, rows) = (ld / S::F64_LANES, rows / S::F64_LANES);
        for k in (0..n).step_by(PANEL) {
            let width = PANEL.min(n - k);
            let height = match starts {
                None => rows,
                Some(starts) => {
                    let height = starts.partition_point(|&start| start < k + width);
                    (height.next_multiple_of(GROUP) / S::F64_LANES).min(rows)
                }
            };
            if height == 0 {
                continue;
            }
            let (panel, trailing) = vectors[k * ld..].split_at_mut(width * ld);
            let mut top = Top { r: &mut *r, d: &mut *d, k };
            match width {
                1 => reflect_panel::<S, 1>(simd, &mut top, panel, trailing, ld, height),
                2 => reflect_panel::<S, 2>(simd, &mut top, panel, trailing, ld, height),
                3 => reflect_panel::<S, 3>(simd, &mut top, panel, trailing, ld, height),
                _ => reflect_panel::<S, PANEL>(simd, &mut top, panel, trailing, ld, height),
            }
        }
        let (_, residual) = vectors.split_at(n * ld);
        squares(simd, &residual[..rows])
    }
}

/// Rows k, k + 1, … of (R d).
struct Top<'a> {
    r: &'a mut Matrix,
    d: &'a mut [f64],
    k: usize,
}

impl Top<'_> {
    /// Its part in column j of (R d).
    #[inline(always)]
    fn column(&mut self, j: usize) -> &mut [f64] {
        if j < self.d.len() { &mut self.r.column_mut(j)[self.k..] } else { &mut self.d[self.k..] }
    }
}

/// B reflections: v = (p; b), γ, and bᵢᵀbₗ for l < i. A column that is zero has p = γ = 0.
struct Reflections<const B: usize> {
    p: [f64; B],
    gamma: [f64; B],
    products: [[f64; B]; B],
}

impl<const B: usize> Reflections<B> {
    /// Formula (1), from the entries t of R and the products bᵢᵀc. The entries are brought up to date, too.
    #[inline(always)]
    fn factors(&self, t: &mut [f64], products: [f64; B]) -> [f64; B] {
        let mut s = [0.0; B];
        for i in 0..B {
            let mut sum = self.p[i] * t[i] + products[i];
            for (product, s_l) in self.products[i].iter().zip(&s[..i]) {
                sum -= product * s_l;
            }
            s[i] = self.gamma[i] * sum;
            t[i] -= s[i] * self.p[i];
        }
        s
    }
}

/// Reflects the B columns of a panel, and applies that to all columns behind it.
#[inline(always)]
fn reflect_panel<S: Simd, const B: usize>(
    simd: S,
    top: &mut Top<'_>,
    panel: &mut [S::f64s],
    trailing: &mut [S::f64s],
    ld: usize,
    height: usize,
) {
    let mut panel: [&mut [S::f64s]; B] = columns_of(panel.chunks_exact_mut(ld), height);
    let reflections = make_reflections(simd, top, &mut panel);
    if reflections.gamma.iter().all(|&gamma| gamma == 0.0) {
        return;
    }
    let mut j = top.k + B;
    // as many columns at once as there are registers for their products
    if S::REGISTER_COUNT >= 32 {
        let mut tiles = trailing.chunks_exact_mut(4 * ld);
        for tile in &mut tiles {
            apply::<S, B, 4>(simd, &reflections, top, &mut panel, tile, ld, j);
            j += 4;
        }
        let rest = tiles.into_remainder();
        match rest.len() / ld {
            1 => apply::<S, B, 1>(simd, &reflections, top, &mut panel, rest, ld, j),
            2 => apply::<S, B, 2>(simd, &reflections, top, &mut panel, rest, ld, j),
            3 => apply::<S, B, 3>(simd, &reflections, top, &mut panel, rest, ld, j),
            _ => {}
        }
    } else {
        let mut tiles = trailing.chunks_exact_mut(2 * ld);
        for tile in &mut tiles {
            apply::<S, B, 2>(simd, &reflections, top, &mut panel, tile, ld, j);
            j += 2;
        }
        let rest = tiles.into_remainder();
        if !rest.is_empty() {
            apply::<S, B, 1>(simd, &reflections, top, &mut panel, rest, ld, j);
        }
    }
}

/// The reflections of a panel, one after the other. Each pass brings the columns up to date with the reflection before, and
/// multiplies column i, final by then, with all of them.
#[inline(always)]
fn make_reflections<S: Simd, const B: usize>(
    simd: S,
    top: &mut Top<'_>,
    panel: &mut [&mut [S::f64s]; B],
) -> Reflections<B> {
    let k = top.k;
    let mut made = Reflections { p: [0.0; B], gamma: [0.0; B], products: [[0.0; B]; B] };
    let mut s = [0.0; B];
    for i in 0..B {
        let mut products = advance_to(simd, panel, i, s);
        let alpha = top.column(k + i)[i];
        let square = alpha * alpha + products[i];
        if SAFE.contains(&products[i]) && SAFE.contains(&square) {
            let beta = -square.sqrt().copysign(alpha);
            made.p[i] = alpha - beta;
            made.gamma[i] = -1.0 / (beta * made.p[i]);
            top.column(k + i)[i] = beta;
        } else {
            let column = bytemuck::cast_slice_mut(panel[i]);
            (top.column(k + i)[i], made.p[i], made.gamma[i]) = scaled_reflection(alpha, column);
            products = advance_to(simd, panel, i, [0.0; B]);
        }
        made.products[i] = products;
        for j in i + 1..B {
            let t = &mut top.column(k + j)[i];
            s[j] = made.gamma[i] * (made.p[i] * *t + products[j]);
            *t -= s[j] * made.p[i];
        }
    }
    made
}

/// β, p and γ where squares might overflow or lose digits: b is divided by α − β, and p = 1. Nothing where b is zero.
#[cold]
#[inline(never)]
fn scaled_reflection(alpha: f64, b: &mut [f64]) -> (f64, f64, f64) {
    let sigma = norm(b);
    if sigma == 0.0 {
        return (alpha, 0.0, 0.0);
    }
    let beta = -alpha.hypot(sigma).copysign(alpha);
    for entry in b {
        *entry /= alpha - beta;
    }
    (beta, 1.0, (beta - alpha) / beta)
}

/// [`advance`] with a constant i, which unrolls its loops.
#[inline(always)]
fn advance_to<S: Simd, const B: usize>(simd: S, panel: &mut [&mut [S::f64s]; B], i: usize, s: [f64; B]) -> [f64; B] {
    match i {
        0 => advance::<S, B, 0>(simd, panel, s),
        1 => advance::<S, B, 1>(simd, panel, s),
        2 => advance::<S, B, 2>(simd, panel, s),
        _ => advance::<S, B, 3>(simd, panel, s),
    }
}

/// Takes sⱼ b₍ᵢ₋₁₎ from columns j ≥ i, and returns the products of column i with every column.
#[inline(always)]
fn advance<S: Simd, const B: usize, const I: usize>(simd: S, panel: &mut [&mut [S::f64s]; B], s: [f64; B]) -> [f64; B] {
    let mut taken = [simd.splat_f64s(0.0); B];
    for j in I..B {
        taken[j] = simd.splat_f64s(-s[j]);
    }
    let height = panel[0].len();
    let panel: [&mut [S::f64s]; B] = columns_of(panel.iter_mut().map(|column| &mut **column), height);
    let mut sums = [[simd.splat_f64s(0.0); B]; MOST_STEPS];
    let steps = GROUP / S::F64_LANES;
    for group in 0..height / steps {
        for (step, sums) in sums.iter_mut().take(steps).enumerate() {
            let row = group * steps + step;
            let mut entries = [simd.splat_f64s(0.0); B];
            for j in 0..B {
                entries[j] = panel[j][row];
            }
            if I > 0 {
                for j in I..B {
                    entries[j] = mul_add(simd, taken[j], entries[I - 1], entries[j]);
                    panel[j][row] = entries[j];
                }
            }
            for j in 0..B {
                sums[j] = mul_add(simd, entries[I], entries[j], sums[j]);
            }
        }
    }
    let mut products = [0.0; B];
    for j in 0..B {
        let mut sum = sums[0][j];
        for more in &sums[1..steps] {
            sum = simd.add_f64s(sum, more[j]);
        }
        products[j] = simd.reduce_sum_f64s(sum);
    }
    products
}

/// The beginnings of N columns, all of one length, which spares the loops over them their checks.
#[inline(always)]
fn columns_of<'a, V, const N: usize>(columns: impl Iterator<Item = &'a mut [V]>, height: usize) -> [&'a mut [V]; N] {
    let mut all: [&mut [V]; N] = std::array::from_fn(|_| Default::default());
    for (column, whole) in all.iter_mut().zip(columns) {
        *column = &mut whole[..height];
    }
    all
}

/// Applies the reflections of a panel to T columns, the first of which is column j.
#[inline(always)]
fn apply<S: Simd, const B: usize, const T: usize>(
    simd: S,
    reflections: &Reflections<B>,
    top: &mut Top<'_>,
    panel: &mut [&mut [S::f64s]; B],
    tile: &mut [S::f64s],
    ld: usize,
    j: usize,
) {
    let height = panel[0].len();
    let panel: [&mut [S::f64s]; B] = columns_of(panel.iter_mut().map(|column| &mut **column), height);
    let tile: [&mut [S::f64s]; T] = columns_of(tile.chunks_exact_mut(ld), height);
    let mut sums = [[simd.splat_f64s(0.0); B]; T];
    for row in 0..height {
        let mut b = [simd.splat_f64s(0.0); B];
        for i in 0..B {
            b[i] = panel[i][row];
        }
        for t in 0..T {
            let entry = tile[t][row];
            for i in 0..B {
                sums[t][i] = mul_add(simd, b[i], entry, sums[t][i]);
            }
        }
    }
    let mut s = [[simd.splat_f64s(0.0); B]; T];
    for t in 0..T {
        let mut products = [0.0; B];
        for i in 0..B {
            products[i] = simd.reduce_sum_f64s(sums[t][i]);
        }
        let factors = reflections.factors(top.column(j + t), products);
        for i in 0..B {
            s[t][i] = simd.splat_f64s(-factors[i]);
        }
    }
    for row in 0..height {
        // all loads before the first store, beyond which the compiler would load again
        let (mut b, mut entries) = ([simd.splat_f64s(0.0); B], [simd.splat_f64s(0.0); T]);
        for i in 0..B {
            b[i] = panel[i][row];
        }
        for t in 0..T {
            entries[t] = tile[t][row];
        }
        for i in 0..B {
            for t in 0..T {
                entries[t] = mul_add(simd, s[t][i], b[i], entries[t]);
            }
        }
        for t in 0..T {
            tile[t][row] = entries[t];
        }
    }
}

/// Σ of the squares.
#[inline(always)]
fn squares<S: Simd>(simd: S, x: &[S::f64s]) -> f64 {
    let mut sums = [simd.splat_f64s(0.0); 4];
    let (fours, rest) = x.as_chunks::<4>();
    for four in fours {
        for (sum, &entry) in sums.iter_mut().zip(four) {
            *sum = mul_add(simd, entry, entry, *sum);
        }
    }
    for (sum, &entry) in sums.iter_mut().zip(rest) {
        *sum = mul_add(simd, entry, entry, *sum);
    }
    let [a, b, c, d] = sums;
    simd.reduce_sum_f64s(simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d)))
}

/// Looks through the columns of a block, each `rows` long and `ld` apart, before it is folded: how many are zero, or nothing
/// where an entry is not a number of at most `LARGEST`.
pub(super) struct Scan<'a> {
    pub(super) block: &'a [f64],
    pub(super) ld: usize,
    pub(super) rows: usize,
}

/// Entries beyond this are refused: the sum of their squares would overflow.
pub(super) const LARGEST: f64 = 1e150;

impl WithSimd for Scan<'_> {
    type Output = Option<usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<usize> {
        let mut zeros = 0;
        for column in self.block.chunks(self.ld.max(1)) {
            let column = &column[..self.rows];
            let (vectors, rest) = S::as_simd_f64s(column);
            let sum = squares(simd, vectors) + rest.iter().map(|entry| entry * entry).sum::<f64>();
            // a sum of squares that is neither tiny nor huge needs no second look; NaN does
            if !SAFE.contains(&sum) {
                let largest = largest_of(column);
                if largest > LARGEST {
                    return None;
                }
                zeros += usize::from(largest == 0.0);
            }
        }
        Some(zeros)
    }
}

#[cfg(test)]
mod tests;
