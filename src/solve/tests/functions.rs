//! The test functions of Moré, Garbow & Hillstrom, "Testing Unconstrained Optimization Software", ACM TOMS 7 (1981) 17,
//! and their published minima.

use super::{Closure, Dual};
use num_dual::DualNum;

/// A test function.
pub(super) struct Function {
    pub(super) name: &'static str,
    pub(super) start: &'static [f64],
    /// Sums of squares that are minima.
    pub(super) minima: &'static [f64],
    pub(super) residuals: fn(&[Dual]) -> Vec<Dual>,
}

impl Function {
    pub(super) fn closure(&self) -> Closure<impl Fn(&[Dual]) -> Option<Vec<Dual>>> {
        let residuals = self.residuals;
        Closure::new(self.start.len(), move |q| Some(residuals(q)))
    }
}

fn c(value: f64) -> Dual {
    Dual::from_re(value)
}

fn over(count: usize, residual: impl Fn(f64) -> Dual) -> Vec<Dual> {
    (1..=count).map(|i| residual(i as f64)).collect()
}

const BARD: [f64; 15] = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.1, 4.39];

const GAUSSIAN: [f64; 15] = [
    0.0009, 0.0044, 0.0175, 0.054, 0.1295, 0.242, 0.3521, 0.3989, 0.3521, 0.242, 0.1295, 0.054, 0.0175, 0.0044, 0.0009,
];

const MEYER: [f64; 16] = [
    34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0, 6005.0, 5147.0, 4427.0,
    3820.0, 3307.0, 2872.0,
];

const KOWALIK_Y: [f64; 11] = [0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246];

const KOWALIK_U: [f64; 11] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625];

const OSBORNE1: [f64; 33] = [
    0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.85, 0.818, 0.784, 0.751, 0.718, 0.685, 0.658, 0.628, 0.603,
    0.58, 0.558, 0.538, 0.522, 0.506, 0.49, 0.478, 0.467, 0.457, 0.448, 0.438, 0.431, 0.424, 0.42, 0.414, 0.411, 0.406,
];

const OSBORNE2: [f64; 65] = [
    1.366, 1.191, 1.112, 1.013, 0.991, 0.885, 0.831, 0.847, 0.786, 0.725, 0.746, 0.679, 0.608, 0.655, 0.616, 0.606,
    0.602, 0.626, 0.651, 0.724, 0.649, 0.649, 0.694, 0.644, 0.624, 0.661, 0.612, 0.558, 0.533, 0.495, 0.5, 0.423,
    0.395, 0.375, 0.372, 0.391, 0.396, 0.405, 0.428, 0.429, 0.523, 0.562, 0.607, 0.653, 0.672, 0.708, 0.633, 0.668,
    0.645, 0.632, 0.591, 0.559, 0.597, 0.625, 0.739, 0.71, 0.729, 0.72, 0.636, 0.581, 0.428, 0.292, 0.162, 0.098,
    0.054,
];

/// fᵢ = Σ (j − 1) xⱼ tʲ⁻² − (Σ xⱼ tʲ⁻¹)² − 1 at t = i/29, then x₁ and x₂ − x₁² − 1.
fn watson(x: &[Dual]) -> Vec<Dual> {
    let mut residuals = over(29, |i| {
        let t = i / 29.0;
        let (mut slope, mut value, mut power) = (c(0.0), c(0.0), 1.0);
        for (j, x_j) in x.iter().enumerate() {
            value += x_j.clone() * power;
            if j + 1 < x.len() {
                slope += x[j + 1].clone() * (power * (j + 1) as f64);
            }
            power *= t;
        }
        slope - value.powi(2) - 1.0
    });
    residuals.push(x[0].clone());
    residuals.push(x[1].clone() - x[0].powi(2) - 1.0);
    residuals
}

/// All of them.
pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "Rosenbrock",
        start: &[-1.2, 1.0],
        minima: &[0.0],
        residuals: |x| vec![(x[1].clone() - x[0].powi(2)) * 10.0, -x[0].clone() + 1.0],
    },
    Function {
        name: "FreudensteinRoth",
        start: &[0.5, -2.0],
        minima: &[0.0, 48.98425367924],
        residuals: |x| {
            let (a, b) = (&x[0], &x[1]);
            vec![
                a.clone() + ((-b.clone() + 5.0) * b - 2.0) * b - 13.0,
                a.clone() + ((b.clone() + 1.0) * b - 14.0) * b - 29.0,
            ]
        },
    },
    Function {
        name: "PowellBadlyScaled",
        start: &[0.0, 1.0],
        minima: &[0.0],
        residuals: |x| vec![x[0].clone() * &x[1] * 1e4 - 1.0, (-x[0].clone()).exp() + (-x[1].clone()).exp() - 1.0001],
    },
    Function {
        name: "BrownBadlyScaled",
        start: &[1.0, 1.0],
        minima: &[0.0],
        residuals: |x| vec![x[0].clone() - 1e6, x[1].clone() - 2e-6, x[0].clone() * &x[1] - 2.0],
    },
    Function {
        name: "Beale",
        start: &[1.0, 1.0],
        minima: &[0.0],
        residuals: |x| {
            [1.5, 2.25, 2.625].iter().zip(1..).map(|(y, i)| x[0].clone() * (x[1].powi(i) - 1.0) + *y).collect()
        },
    },
    Function {
        name: "JennrichSampson",
        start: &[0.3, 0.4],
        minima: &[124.362182355615],
        residuals: |x| over(10, |i| -((x[0].clone() * i).exp() + (x[1].clone() * i).exp()) + 2.0 + 2.0 * i),
    },
    Function {
        name: "HelicalValley",
        start: &[-1.0, 0.0, 0.0],
        minima: &[0.0],
        residuals: |x| {
            let half = if x[0].re < 0.0 { 0.5 } else { 0.0 };
            let theta = (x[1].clone() / &x[0]).atan() / std::f64::consts::TAU + half;
            let radius = (x[0].powi(2) + x[1].powi(2)).sqrt();
            vec![(x[2].clone() - theta * 10.0) * 10.0, (radius - 1.0) * 10.0, x[2].clone()]
        },
    },
    Function {
        name: "Bard",
        start: &[1.0, 1.0, 1.0],
        minima: &[0.00821487730657897],
        residuals: |x| {
            over(15, |u| {
                let v = 16.0 - u;
                let w = u.min(v);
                -(x[0].clone() + (x[1].clone() * v + x[2].clone() * w).recip() * u) + BARD[u as usize - 1]
            })
        },
    },
    Function {
        name: "Gaussian",
        start: &[0.4, 1.0, 0.0],
        minima: &[1.12793276961912e-08],
        residuals: |x| {
            over(15, |i| {
                let t = (8.0 - i) / 2.0;
                x[0].clone() * (-x[1].clone() * (-x[2].clone() + t).powi(2) / 2.0).exp() - GAUSSIAN[i as usize - 1]
            })
        },
    },
    Function {
        name: "Meyer",
        start: &[0.02, 4000.0, 250.0],
        minima: &[87.9458551709],
        residuals: |x| {
            over(16, |i| x[0].clone() * (x[1].clone() / (x[2].clone() + 45.0 + 5.0 * i)).exp() - MEYER[i as usize - 1])
        },
    },
    Function {
        name: "Box3D",
        start: &[0.0, 10.0, 20.0],
        minima: &[0.0],
        residuals: |x| {
            over(10, |i| {
                let t = 0.1 * i;
                (x[0].clone() * -t).exp() - (x[1].clone() * -t).exp() - x[2].clone() * ((-t).exp() - (-10.0 * t).exp())
            })
        },
    },
    Function {
        name: "PowellSingular",
        start: &[3.0, -1.0, 0.0, 1.0],
        minima: &[0.0],
        residuals: |x| {
            vec![
                x[0].clone() + x[1].clone() * 10.0,
                (x[2].clone() - &x[3]) * 5_f64.sqrt(),
                (x[1].clone() - x[2].clone() * 2.0).powi(2),
                (x[0].clone() - &x[3]).powi(2) * 10_f64.sqrt(),
            ]
        },
    },
    Function {
        name: "Wood",
        start: &[-3.0, -1.0, -3.0, -1.0],
        minima: &[0.0],
        residuals: |x| {
            vec![
                (x[1].clone() - x[0].powi(2)) * 10.0,
                -x[0].clone() + 1.0,
                (x[3].clone() - x[2].powi(2)) * 90_f64.sqrt(),
                -x[2].clone() + 1.0,
                (x[1].clone() + &x[3] - 2.0) * 10_f64.sqrt(),
                (x[1].clone() - &x[3]) / 10_f64.sqrt(),
            ]
        },
    },
    Function {
        name: "KowalikOsborne",
        start: &[0.25, 0.39, 0.415, 0.39],
        minima: &[0.000307505603849238],
        residuals: |x| {
            over(11, |i| {
                let (u, y) = (KOWALIK_U[i as usize - 1], KOWALIK_Y[i as usize - 1]);
                -x[0].clone() * (x[1].clone() * u + u * u) / (x[2].clone() * u + &x[3] + u * u) + y
            })
        },
    },
    Function {
        name: "BrownDennis",
        start: &[25.0, 5.0, -5.0, -1.0],
        minima: &[85822.2016263563],
        residuals: |x| {
            over(20, |i| {
                let t = i / 5.0;
                (x[0].clone() + x[1].clone() * t - t.exp()).powi(2)
                    + (x[2].clone() + x[3].clone() * t.sin() - t.cos()).powi(2)
            })
        },
    },
    Function {
        name: "Osborne1",
        start: &[0.5, 1.5, -1.0, 0.01, 0.02],
        minima: &[5.46489469748e-05],
        residuals: |x| {
            over(33, |i| {
                let t = 10.0 * (i - 1.0);
                -(x[0].clone() + x[1].clone() * (x[3].clone() * -t).exp() + x[2].clone() * (x[4].clone() * -t).exp())
                    + OSBORNE1[i as usize - 1]
            })
        },
    },
    Function {
        name: "BiggsEXP6",
        start: &[1.0, 2.0, 1.0, 1.0, 1.0, 1.0],
        minima: &[0.00565565, 0.0],
        residuals: |x| {
            over(13, |i| {
                let t = 0.1 * i;
                let y = (-t).exp() - 5.0 * (-10.0 * t).exp() + 3.0 * (-4.0 * t).exp();
                let e = |j: usize| (x[j].clone() * -t).exp();
                x[2].clone() * e(0) - x[3].clone() * e(1) + x[5].clone() * e(4) - y
            })
        },
    },
    Function {
        name: "Osborne2",
        start: &[1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5],
        minima: &[0.0401377362935],
        residuals: |x| {
            over(65, |i| {
                let t = (i - 1.0) / 10.0;
                let bell = |a: usize, b: usize, w: usize| x[a].clone() * (-(-x[b].clone() + t).powi(2) * &x[w]).exp();
                let first = x[0].clone() * (x[4].clone() * -t).exp();
                -(first + bell(1, 8, 5) + bell(2, 9, 6) + bell(3, 10, 7)) + OSBORNE2[i as usize - 1]
            })
        },
    },
    Function {
        name: "Watson6",
        start: &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        minima: &[0.00228767005355],
        residuals: |x| watson(x),
    },
    Function {
        name: "Watson9",
        start: &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        minima: &[1.39976013864e-06],
        residuals: |x| watson(x),
    },
    Function {
        name: "Watson12",
        start: &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        minima: &[4.72238e-10],
        residuals: |x| watson(x),
    },
];
