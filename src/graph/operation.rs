//! The table of scalar operations. Adding an operation is adding one row.
//!
//! A row states the operation's name, its arguments, where its value and where its derivative are defined, what it does to
//! dimensions, and its value over *any* number type of num-dual. Derivatives of every order follow from the last column.

use num_dual::DualNum;

use super::special::{atanc, stumpff};
use super::{Graph, Scalar};

/// A number on which programs run: `f64` or any dual number of the num-dual crate over it.
///
/// Comparisons look at the real part only, so code over a `Number` branches on [`num_dual::DualStruct::re`] and
/// nothing else.
pub trait Number: DualNum<Primitive = f64> {}

impl<T: DualNum<Primitive = f64>> Number for T {}

/// What an operation does to physical dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DimensionRule {
    /// Arguments and result have one dimension: `abs(x)`, `x + y`.
    Same,
    /// The dimensions multiply.
    Product,
    /// The dimensions divide.
    Quotient,
    /// The dimension's square root.
    Root,
    /// The first argument's dimension to the power of the second, a plain constant.
    Power,
    /// An angle or a number gives a number: `sin(x)`.
    OfAngle,
    /// A number gives a number: `exp(x)`.
    OfNumber,
    /// A number gives an angle: `asin(x)`.
    ToAngle,
    /// Two arguments of one dimension give an angle: `atan2(y, x)`.
    QuotientToAngle,
}

/// A row of the table, without the value column, which is generic: see [`Operation::apply`].
#[derive(Debug)]
pub struct Row {
    /// The operation.
    pub operation: Operation,
    /// Its name, as printed and, where `function` is true, as written in a model.
    pub name: &'static str,
    /// Whether a model calls it by its name.
    pub function: bool,
    /// One or two arguments.
    pub arity: usize,
    /// What it does to dimensions.
    pub dimensions: DimensionRule,
    /// Where the value exists.
    pub defined: fn(f64, f64) -> bool,
    /// Where, besides, the derivative exists.
    pub smooth: fn(f64, f64) -> bool,
    /// The domain in words, for diagnostics.
    pub domain: &'static str,
}

macro_rules! operations {
    ($( $(#[$doc:meta])* $variant:ident $name:literal $function:ident $arity:literal $dimensions:ident
        |$x:ident, $y:ident| $value:expr;
        partials |$g:ident, $px:ident, $py:ident, $f:ident| $partials:expr;
        defined $defined:expr; smooth $smooth:expr; $domain:literal )*) => {
        /// A scalar operation of one or two arguments.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Operation { $( $(#[$doc])* $variant, )* }

        /// Every operation, in the order of the table.
        pub const OPERATIONS: &[Row] = &[ $( Row {
            operation: Operation::$variant, name: $name, function: $function, arity: $arity,
            dimensions: DimensionRule::$dimensions, defined: $defined, smooth: $smooth, domain: $domain,
        }, )* ];

        impl Operation {
            /// The operation's value. A unary operation does not look at `y`.
            #[inline]
            pub fn apply<T: Number>(self, x: &T, y: &T) -> T {
                match self { $( Operation::$variant => { let ($x, $y) = (x, y); let _ = $y; $value } )* }
            }

            /// The derivatives of f = self(x, y) by x and by y, as nodes. They have no value where the operation is not
            /// smooth. A whole constant y has none: zero is given.
            pub(crate) fn partials(self, g: &mut Graph, x: Scalar, y: Scalar, f: Scalar) -> [Scalar; 2] {
                match self { $( Operation::$variant => {
                    let ($g, $px, $py, $f) = (g, x, y, f);
                    let _ = (&$g, $px, $py, $f);
                    $partials
                } )* }
            }
        }
    };
}

operations! {
    /// x + y
    Add "+" false 2 Same |x, y| x.clone() + y;
        partials |g, x, y, f| [g.constant(1.0), g.constant(1.0)];
        defined |_, _| true; smooth |_, _| true; "everywhere"
    /// x − y
    Sub "-" false 2 Same |x, y| x.clone() - y;
        partials |g, x, y, f| [g.constant(1.0), g.constant(-1.0)];
        defined |_, _| true; smooth |_, _| true; "everywhere"
    /// x · y
    Mul "*" false 2 Product |x, y| x.clone() * y;
        partials |g, x, y, f| [y, x];
        defined |_, _| true; smooth |_, _| true; "everywhere"
    /// x / y
    Div "/" false 2 Quotient |x, y| x.clone() / y;
        partials |g, x, y, f| { let r = g.recip(y); let fr = g.mul(f, r); [r, g.neg(fr)] };
        defined |_, y| y != 0.0; smooth |_, _| true; "where the divisor is not zero"
    /// −x
    Neg "neg" false 1 Same |x, _y| -x.clone();
        partials |g, x, y, f| [g.constant(-1.0), g.constant(0.0)];
        defined |_, _| true; smooth |_, _| true; "everywhere"
    /// xⁿ, n a whole constant
    PowInteger "^" false 2 Power |x, n| power(x, n.re() as i32);
        partials |g, x, y, f| {
            // n xⁿ⁻¹
            let n = g.value(y).unwrap_or(f64::NAN);
            let (less, n) = (g.constant(n - 1.0), g.constant(n));
            let power = g.apply(Operation::PowInteger, x, less);
            [g.mul(n, power), g.constant(0.0)]
        };
        defined |x, n| x != 0.0 || n >= 0.0; smooth |_, _| true; "where the base of a negative power is not zero"
    /// xʸ = exp(y log x)
    Pow "^" false 2 Power |x, y| (x.ln() * y).exp();
        partials |g, x, y, f| {
            // (f y/x, f log x)
            let (ratio, log) = (g.div(y, x), g.unary(Operation::Log, x));
            [g.mul(f, ratio), g.mul(f, log)]
        };
        defined |x, _| x > 0.0; smooth |_, _| true; "where the base of a broken power is positive"
    /// √x
    Sqrt "sqrt" true 1 Root |x, _y| x.sqrt();
        partials |g, x, y, f| { let half = g.constant(0.5); [g.div(half, f), g.constant(0.0)] };
        defined |x, _| x >= 0.0; smooth |x, _| x > 0.0; "where its argument is positive"
    /// eˣ
    Exp "exp" true 1 OfNumber |x, _y| x.exp();
        partials |g, x, y, f| [f, g.constant(0.0)];
        defined |_, _| true; smooth |_, _| true; "everywhere"
    /// natural logarithm
    Log "log" true 1 OfNumber |x, _y| x.ln();
        partials |g, x, y, f| [g.recip(x), g.constant(0.0)];
        defined |x, _| x > 0.0; smooth |_, _| true; "where its argument is positive"
    /// sine
    Sin "sin" true 1 OfAngle |x, _y| x.sin();
        partials |g, x, y, f| [g.unary(Operation::Cos, x), g.constant(0.0)];
        defined |x, _| x.is_finite(); smooth |_, _| true; "everywhere"
    /// cosine
    Cos "cos" true 1 OfAngle |x, _y| x.cos();
        partials |g, x, y, f| { let sine = g.unary(Operation::Sin, x); [g.neg(sine), g.constant(0.0)] };
        defined |x, _| x.is_finite(); smooth |_, _| true; "everywhere"
    /// tangent
    Tan "tan" true 1 OfAngle |x, _y| x.tan();
        partials |g, x, y, f| { let (one, square) = (g.constant(1.0), g.mul(f, f)); [g.add(one, square), g.constant(0.0)] };
        defined |x, _| x.is_finite(); smooth |_, _| true; "everywhere but at odd quarter turns"
    /// arc sine
    Asin "asin" true 1 ToAngle |x, _y| x.asin();
        partials |g, x, y, f| { let d = inverse_root(g, x); [d, g.constant(0.0)] };
        defined |x, _| x.abs() <= 1.0; smooth |x, _| x.abs() < 1.0; "where its argument is between -1 and 1"
    /// arc cosine
    Acos "acos" true 1 ToAngle |x, _y| x.acos();
        partials |g, x, y, f| { let d = inverse_root(g, x); [g.neg(d), g.constant(0.0)] };
        defined |x, _| x.abs() <= 1.0; smooth |x, _| x.abs() < 1.0; "where its argument is between -1 and 1"
    /// arc tangent
    Atan "atan" true 1 ToAngle |x, _y| x.atan();
        partials |g, x, y, f| {
            let (one, square) = (g.constant(1.0), g.mul(x, x));
            let sum = g.add(one, square);
            [g.recip(sum), g.constant(0.0)]
        };
        defined |_, _| true; smooth |_, _| true; "everywhere"
    /// the angle of the point (y, x): first argument over second, all four quadrants
    Atan2 "atan2" true 2 QuotientToAngle |y, x| angle(y, x);
        partials |g, x, y, f| {
            // (x, −y)/r²; the first argument is y
            let r = g.apply(Operation::Hypot, x, y);
            let inverse = g.recip(r);
            let (sin, cos) = (g.mul(x, inverse), g.mul(y, inverse));
            let by_x = g.mul(sin, inverse);
            [g.mul(cos, inverse), g.neg(by_x)]
        };
        defined |y, x| y != 0.0 || x != 0.0; smooth |_, _| true; "where its arguments are not both zero"
    /// √(x² + y²) without overflow: what the angle of a point is differentiated by
    Hypot "hypot" false 2 Same |x, y| hypotenuse(x, y);
        partials |g, x, y, f| [g.div(x, f), g.div(y, f)];
        defined |_, _| true; smooth |x, y| x != 0.0 || y != 0.0; "everywhere, with a point at the origin"
    /// |x|
    Abs "abs" true 1 Same |x, _y| match x.re() {
            re if re < 0.0 => -x.clone(),
            re if re > 0.0 => x.clone(),
            // zero, with no derivative
            _ => (x.clone() * x).sqrt(),
        };
        partials |g, x, y, f| { let sign = g.div(x, f); [sign, g.constant(0.0)] };
        defined |_, _| true; smooth |x, _| x != 0.0; "everywhere, with a corner at zero"
    /// x brought into (−π, π] by whole turns
    Wrap "wrap" true 1 Same |x, _y| x.clone() - turns(x.re());
        partials |g, x, y, f| [g.constant(1.0), g.constant(0.0)];
        defined |x, _| x.is_finite(); smooth |_, _| true; "everywhere"
    /// x, and not a number below y: how a function says where it ends
    AtLeast "at_least" true 2 Same |x, y| if x.re() >= y.re() { x.clone() } else { T::from(f64::NAN) };
        partials |g, x, y, f| [g.constant(1.0), g.constant(0.0)];
        defined |x, y| x >= y; smooth |_, _| true; "where its first argument reaches the second"
    /// Stumpff's function c_y(x), y a whole constant: exact rotations at angle zero
    Stumpff "stumpff" false 2 OfNumber |x, k| stumpff(k.re() as u32, x);
        partials |g, x, y, f| {
            // (k c_{k+2} − c_{k+1})/2
            let k = g.value(y).unwrap_or(f64::NAN);
            let [first, second] = [1.0, 2.0].map(|more| g.constant(k + more));
            let [first, second] = [first, second].map(|k| g.apply(Operation::Stumpff, x, k));
            let [half, half_k] = [-0.5, k / 2.0].map(|c| g.constant(c));
            let [first, second] = [g.mul(half, first), g.mul(half_k, second)];
            [g.add(second, first), g.constant(0.0)]
        };
        defined |x, _| x >= 0.0; smooth |_, _| true; "where its argument is not negative"
    /// Σ (−x)ⁱ/(2i + 2y + 1), y a whole constant: exact rotation vectors at angle zero
    Atanc "atanc" false 2 OfNumber |x, n| atanc(n.re() as u32, x);
        partials |g, x, y, f| {
            // ½((2n + 1) g_{n+1} − 1/(1 + x))
            let n = g.value(y).unwrap_or(f64::NAN);
            let (one, next) = (g.constant(1.0), g.constant(n + 1.0));
            let next = g.apply(Operation::Atanc, x, next);
            let [half, factor] = [-0.5, n + 0.5].map(|c| g.constant(c));
            let sum = g.add(one, x);
            let [first, second] = [g.mul(factor, next), g.div(half, sum)];
            [g.add(first, second), g.constant(0.0)]
        };
        defined |x, _| x >= 0.0; smooth |_, _| true; "where its argument is not negative"
}

impl Operation {
    /// The operation's row in [`OPERATIONS`].
    pub fn row(self) -> &'static Row {
        &OPERATIONS[self as usize]
    }

    /// The operation that a model calls by this name.
    pub fn function(name: &str) -> Option<Operation> {
        OPERATIONS.iter().find(|row| row.function && row.name == name).map(|row| row.operation)
    }
}

/// xⁿ by repeated squaring: the same multiplications on `f64` and on duals, and exact where they are.
fn power<T: Number>(x: &T, n: i32) -> T {
    let mut square = if n < 0 { x.recip() } else { x.clone() };
    let mut result = None;
    let mut left = n.unsigned_abs();
    while left > 0 {
        if left & 1 == 1 {
            result = Some(match result {
                None => square.clone(),
                Some(so_far) => square.clone() * so_far,
            });
        }
        left >>= 1;
        if left > 0 {
            square = square.clone() * square;
        }
    }
    result.unwrap_or_else(|| T::from(1.0))
}

/// The angle of the point (y, x), with derivatives at quarter turns too, where that of arctan(y/x) is lost: the angle of its
/// value, plus that of the point turned back by it, which is (0, r) but for derivatives.
fn angle<T: Number>(y: &T, x: &T) -> T {
    let (y0, x0) = (y.re(), x.re());
    let length = y0.hypot(x0);
    let (sin, cos) = (y0 / length, x0 / length);
    let along = x.clone() * cos + y.clone() * sin;
    let across = y.clone() * cos - x.clone() * sin;
    let value = across.re();
    ((across - value) / along).atan() + y0.atan2(x0)
}

/// √(x² + y²) by the larger of the two.
fn hypotenuse<T: Number>(x: &T, y: &T) -> T {
    let scale = x.re().abs().max(y.re().abs());
    if scale == 0.0 || !scale.is_finite() {
        return (x.clone() * x + y.clone() * y).sqrt();
    }
    let (x, y) = (x.clone() / scale, y.clone() / scale);
    (x.clone() * &x + y.clone() * &y).sqrt() * scale
}

/// 1/√(1 − x²), by factors that keep their digits near ±1.
fn inverse_root(g: &mut Graph, x: Scalar) -> Scalar {
    let one = g.constant(1.0);
    let (below, above) = (g.sub(one, x), g.add(one, x));
    let product = g.mul(below, above);
    let root = g.unary(Operation::Sqrt, product);
    g.recip(root)
}

/// The whole turns to take from x so that the rest is in (−π, π].
fn turns(x: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    ((x - PI) / TAU).ceil() * TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual2_64;

    #[test]
    fn the_table_is_in_the_order_of_the_enum() {
        for (i, row) in OPERATIONS.iter().enumerate() {
            assert_eq!(row.operation as usize, i);
            assert_eq!(row.operation.row().name, row.name);
        }
    }

    #[test]
    fn powers_are_products() {
        assert_eq!(power(&3.0, 5), 243.0);
        assert_eq!(power(&2.0, -2), 0.25);
        assert_eq!(power(&0.0, 0), 1.0);
    }

    #[test]
    fn the_angle_of_a_point_has_derivatives_all_around() {
        for k in 0..16 {
            // (x, y) itself is exact on the axes
            let (y, x) =
                [(0.0, 2.0), (1.5, 2.0), (3.0, 0.0), (2.0, -0.5), (0.0, -1.0), (-1.0, -3.0), (-0.25, 0.0), (-3.0, 1.0)]
                    [k % 8];
            let (along_y, along_x) = (f64::from(u8::from(k < 8)), f64::from(u8::from(k >= 8)));
            let dual = |value, first| Dual2_64::new(value, first, 0.0);
            let found = Operation::Atan2.apply(&dual(y, along_y), &dual(x, along_x));
            let square = x * x + y * y;
            // θ′ = (x ẏ − y ẋ)/r², and θ″ = −θ′ (r²)′/r²
            let first = (x * along_y - y * along_x) / square;
            let second = -first * 2.0 * (x * along_x + y * along_y) / square;
            assert_eq!(found.re, y.atan2(x));
            assert!((found.v1 - first).abs() < 1e-15 && (found.v2 - second).abs() < 1e-14, "({y}, {x}): {found:?}");
        }
    }

    #[test]
    fn below_the_least_there_is_no_number() {
        assert_eq!(Operation::AtLeast.apply(&1.0, &1.0), 1.0);
        assert!(Operation::AtLeast.apply(&0.5f64, &1.0).is_nan());
        assert!(Operation::AtLeast.apply(&Dual2_64::from(0.5), &Dual2_64::from(1.0)).re.is_nan());
    }

    #[test]
    fn wrapping_keeps_half_a_turn_positive() {
        use std::f64::consts::PI;
        let wrap = |x: f64| Operation::Wrap.apply(&x, &x);
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
        assert_eq!(wrap(0.5), 0.5);
    }
}
