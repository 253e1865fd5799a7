//! The complex step: f′(x) = Im f(x + ih)/h − O(h²), with nothing subtracted, so that h may be so small that h² is nothing.
//! Source: Squire & Trapp, Using Complex Variables to Estimate Derivatives of Real Functions, SIAM Review 40 (1998) 110,
//! doi:10.1137/S003614459631241X.
//!
//! It needs functions that are analytic, with imaginary parts that keep their digits however small they are: those of the inverse
//! functions are written so here. `atan2`, `hypot`, `wrap` and `at_least` are continued from the real numbers about the point:
//! lengths without conjugation, turns and limits taken from the real parts. |z| alone cannot be: it is real everywhere.

use num_complex::Complex64;

use crate::graph::{Graph, Operation, Scalar, Tape};

/// h, whose square is nothing beside any number.
const STEP: f64 = 1e-200;

/// A scalar over complex numbers.
#[derive(Clone, Debug)]
pub(super) struct ComplexStep(Tape);

impl ComplexStep {
    /// What an output needs of a graph.
    ///
    /// # Errors
    /// The operation that is not analytic.
    pub(super) fn new(graph: &Graph, output: Scalar) -> Result<ComplexStep, Operation> {
        let tape = Tape::lower(graph, &[output]);
        let analytic = |operation: Operation| operation != Operation::Abs;
        match tape.instructions().iter().find(|instruction| !analytic(instruction.operation)) {
            Some(instruction) => Err(instruction.operation),
            None => Ok(ComplexStep(tape)),
        }
    }

    /// The derivative where some of the parameters or of the inputs, those that `moves` holds for, change together.
    pub(super) fn derivative(
        &self,
        (parameters, inputs): (&[f64], &[f64]),
        moves: impl Fn(Result<usize, usize>) -> bool,
    ) -> f64 {
        let step = |value: f64, moves: bool| Complex64::new(value, if moves { STEP } else { 0.0 });
        let parameters: Vec<_> = parameters.iter().enumerate().map(|(k, &value)| step(value, moves(Ok(k)))).collect();
        let inputs: Vec<_> = inputs.iter().enumerate().map(|(k, &value)| step(value, moves(Err(k)))).collect();
        let found =
            self.0.evaluate_by(&parameters, &inputs, Complex64::from, |operation, x, y| apply(operation, *x, *y));
        found.first().map_or(f64::NAN, |value| value.im / STEP)
    }
}

/// An operation on complex numbers near the real ones.
fn apply(operation: Operation, x: Complex64, y: Complex64) -> Complex64 {
    let undefined = Complex64::from(f64::NAN);
    match operation {
        Operation::Add => x + y,
        Operation::Sub => x - y,
        Operation::Mul => x * y,
        Operation::Div => x / y,
        Operation::Neg => -x,
        Operation::PowInteger => x.powi(y.re as i32),
        Operation::Pow => (logarithm(x) * y).exp(),
        Operation::Sqrt => root(x),
        Operation::Exp => x.exp(),
        Operation::Log => logarithm(x),
        Operation::Sin => x.sin(),
        Operation::Cos => x.cos(),
        Operation::Tan => x.sin() / x.cos(),
        Operation::Asin => arc_sine(x),
        Operation::Acos => arc_cosine(x),
        Operation::Atan => arc_tangent(x),
        Operation::Atan2 => angle(x, y),
        Operation::Hypot => root(x * x + y * y),
        Operation::Abs => undefined,
        Operation::Wrap => x - (x.re - Operation::Wrap.apply(&x.re, &x.re)),
        Operation::AtLeast => {
            if x.re >= y.re {
                x
            } else {
                undefined
            }
        }
        Operation::Stumpff => stumpff(y.re as u32, x),
        Operation::Atanc => atanc(y.re as u32, x),
    }
}

/// log z = log |z| + i arg z
fn logarithm(z: Complex64) -> Complex64 {
    Complex64::new(z.norm().ln(), z.im.atan2(z.re))
}

/// √z = t + i y/(2t), t = √((|z| + x)/2), for x ≥ 0; of zero that does not move, zero.
fn root(z: Complex64) -> Complex64 {
    if z.re < 0.0 {
        return Complex64::from(f64::NAN);
    }
    let t = (0.5 * (z.norm() + z.re)).sqrt();
    Complex64::new(t, if z.im == 0.0 { 0.0 } else { 0.5 * z.im / t })
}

/// Re asin z = atan(x/Re(√(1 − z) √(1 + z))), Im asin z = asinh Im(conj √(1 − z) · √(1 + z)). Source: W. Kahan, Branch Cuts for Complex
/// Elementary Functions, in: The State of the Art in Numerical Analysis (1987) 165.
fn arc_sine(z: Complex64) -> Complex64 {
    let (below, above) = (root(1.0 - z), root(1.0 + z));
    Complex64::new(z.re.atan2((below * above).re), (below.conj() * above).im.asinh())
}

/// Re acos z = 2 atan(Re √(1 − z)/Re √(1 + z)), Im acos z = asinh Im(conj √(1 + z) · √(1 − z)). Source: as [`arc_sine`].
fn arc_cosine(z: Complex64) -> Complex64 {
    let (below, above) = (root(1.0 - z), root(1.0 + z));
    Complex64::new(2.0 * below.re.atan2(above.re), (above.conj() * below).im.asinh())
}

/// Re atan z = ½ arg(1 − x² − y² + 2ix), Im atan z = ¼ log(1 + 4y/(x² + (1 − y)²)).
fn arc_tangent(z: Complex64) -> Complex64 {
    let (x, y) = (z.re, z.im);
    let re = 0.5 * (2.0 * x).atan2((1.0 - x) * (1.0 + x) - y * y);
    Complex64::new(re, 0.25 * (4.0 * y / (x * x + (1.0 - y) * (1.0 - y))).ln_1p())
}

/// The angle of (y, x) by the quotient that is at most one: arctan(y/x), or ½π − arctan(x/y), and whole or half turns of the real
/// parts.
fn angle(y: Complex64, x: Complex64) -> Complex64 {
    let whole = y.re.atan2(x.re);
    let part = if x.re.abs() >= y.re.abs() { arc_tangent(y / x) } else { -arc_tangent(x / y) };
    Complex64::new(whole, part.im)
}

/// Below this argument, power series. They converge everywhere and lose no digits so near to zero.
const SERIES: f64 = 1.0;

/// c_k(z) = Σ (−z)ⁱ/(k + 2i)!, and by c_{j+2} = (1/j! − c_j)/z from c₀ = cos √z or c₁ = sin √z/√z.
fn stumpff(k: u32, z: Complex64) -> Complex64 {
    if z.re < SERIES {
        let mut term = Complex64::from((1..=k).map(|j| 1.0 / f64::from(j)).product::<f64>());
        let mut sum = term;
        for i in 1..14 {
            let n = f64::from(k + 2 * i);
            term = -term * z / (n * (n - 1.0));
            sum += term;
        }
        return sum;
    }
    let angle = root(z);
    let (mut c, first) = if k.is_multiple_of(2) { (angle.cos(), 0) } else { (angle.sin() / angle, 1) };
    let mut factorial = 1.0;
    for j in (first..k).step_by(2) {
        c = (1.0 / factorial - c) / z;
        factorial *= f64::from((j + 1) * (j + 2));
    }
    c
}

/// g_n(z) = Σ (−z)ⁱ/(2i + 2n + 1), and by g_{n+1} = (1/(2n + 1) − g_n)/z from g₀ = arctan √z/√z.
fn atanc(n: u32, z: Complex64) -> Complex64 {
    if z.re < 0.05 {
        let mut sum = Complex64::from(0.0);
        for i in (0..16).rev() {
            sum = 1.0 / f64::from(2 * i + 2 * n + 1) - sum * z;
        }
        return sum;
    }
    let square = root(z);
    let mut g = arc_tangent(square) / square;
    for j in 0..n {
        g = (1.0 / f64::from(2 * j + 1) - g) / z;
    }
    g
}

#[cfg(test)]
mod tests {
    use num_dual::Dual64;

    use super::*;
    use crate::graph::OPERATIONS;

    /// Every operation of the table, by either argument, is that of dual numbers in value and derivative.
    #[test]
    fn every_operation_has_the_derivative_of_dual_numbers() {
        let points = [-7.5, -2.0, -0.9, -0.3, -1e-9, 0.0, 1e-9, 0.02, 0.3, 0.7, 0.999, 1.0, 1.5, 2.0, 4.0, 9.0, 400.0];
        let mut compared = 0;
        for row in OPERATIONS {
            let whole = matches!(row.operation, Operation::PowInteger | Operation::Stumpff | Operation::Atanc);
            let seconds: &[f64] = if whole { &[0.0, 1.0, 2.0, 3.0] } else { &points };
            for &x in &points {
                for &y in if row.arity == 1 { &seconds[..1] } else { seconds } {
                    for by in 0..if row.arity == 1 || whole { 1 } else { 2 } {
                        // at the edges the derivative does not exist
                        let least = row.operation == Operation::AtLeast && x <= y;
                        if !(row.defined)(x, y) || !(row.smooth)(x, y) || least {
                            continue;
                        }
                        let one = |k: usize| if k == by { 1.0 } else { 0.0 };
                        let expected = row.operation.apply(&Dual64::new(x, one(0)), &Dual64::new(y, one(1)));
                        let found =
                            apply(row.operation, Complex64::new(x, STEP * one(0)), Complex64::new(y, STEP * one(1)));
                        if row.operation == Operation::Abs {
                            assert!(found.re.is_nan());
                            continue;
                        }
                        if !(expected.re.is_finite() && expected.eps.is_finite()) {
                            continue;
                        }
                        // the recurrence of dual numbers loses digits just above its series
                        let close = if row.operation == Operation::Atanc { 1e-8 } else { 2e-13 };
                        let near = |a: f64, b: f64| (a - b).abs() <= close * (1.0 + b.abs());
                        let place = format!("{} at ({x}, {y}) by {by}: {found}, {expected}", row.name);
                        assert!(near(found.re, expected.re), "{place}");
                        assert!(near(found.im / STEP, expected.eps), "{place}");
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 1000, "{compared}");
    }

    #[test]
    fn a_modulus_is_named() {
        let mut graph = Graph::new();
        let (q, x) = (graph.parameter(0), graph.input(0));
        let product = graph.mul(q, x);
        let modulus = graph.unary(Operation::Abs, product);
        assert_eq!(ComplexStep::new(&graph, modulus).unwrap_err(), Operation::Abs);
        let step = ComplexStep::new(&graph, product).expect("products are analytic");
        assert_eq!(step.derivative((&[3.0], &[5.0]), |leaf| leaf == Ok(0)), 5.0);
        assert_eq!(step.derivative((&[3.0], &[5.0]), |leaf| leaf == Err(0)), 3.0);
    }
}
