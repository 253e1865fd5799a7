//! Robust losses: what a residual that does not fit is allowed to cost.
//!
//! With *u* ≥ 0 the norm of a whitened residual, all are functions of *s = u²*, and what is minimised is
//!
//! > ½ Σ ρ(s),  with ρ(0) = 0, ρ′(0) = 1, so that ρ(s) ≈ s for small s
//!
//! Its gradient is that of weighted least squares with weight(s) = ρ′(s), which falls from 1 and never rises: ρ is concave,
//! so that ½ Σ weight(sₖ) s bounds the change of the cost from above, and iterated reweighting never increases it (P. J.
//! Huber, Robust Statistics, 1981, 7.8). These are the conventions of Ceres; ψ(u) = u weight(u²) is the influence of a
//! residual. A kernel whose influence returns to zero is *redescending*: it ignores what is far out, but its cost has several
//! minima, so it needs a good start.
//!
//! | kernel | weight, with x = u/c | ρ/c² | constant c |
//! |---|---|---|---|
//! | [Huber](Kernel::Huber) | 1; 1/x from x = 1 | x²; 2x − 1 | 1.345 |
//! | [Fair](Kernel::Fair) | 1/(1 + x) | 2 (x − ln(1 + x)) | 1.3998 |
//! | [L1L2](Kernel::L1L2) | 1/√(1 + x²) | 2 (√(1 + x²) − 1) | 1.2871 |
//! | [Cauchy](Kernel::Cauchy) | 1/(1 + x²) | ln(1 + x²) | 2.3849 |
//! | [Geman–McClure](Kernel::GemanMcClure) | 1/(1 + x²)² | x²/(1 + x²) | 3.7874 |
//! | [Welsch](Kernel::Welsch) | exp(−x²) | 1 − exp(−x²) | 2.9846 |
//! | [Tukey](Kernel::Tukey) | (1 − x²)²; 0 from x = 1 | (1 − (1 − x²)³)/3; ⅓ | 4.6851 |
//! | [Andrews](Kernel::Andrews) | sin x/x; 0 from x = π | 2 (1 − cos x); 4 | 1.3387 |
//! | [Hampel](Kernel::Hampel) | 1; 1.5/x from 1.5; 1.5 (8 − x)/(4.5 x) from 3.5; 0 from 8 | piecewise | 0.9014 |
//! | [Danish](Kernel::Danish) | 1; exp(1 − x²) from x = 1 | x²; 2 − exp(1 − x²) | 2 |
//!
//! Sources: P. J. Huber, Ann. Math. Stat. 35 (1964), 73 (Huber); R. C. Fair, Ann. Econ. Soc. Meas. 3 (1974), 667 (Fair);
//! Holland & Welsch, Comm. Stat. A6 (1977), 813, for the 95 % constants of these, Cauchy, Welsch, Tukey and Andrews; Z. Zhang,
//! Image and Vision Computing 15 (1997), 59, table 1 (L1–L2 and Geman–McClure); Charbonnier et al., IEEE Trans. Image
//! Processing 6 (1997), 298 (L1–L2 with a scale); Beaton & Tukey, Technometrics 16 (1974), 147; D. F. Andrews et al., Robust
//! Estimates of Location (1972) (Andrews, Hampel); Koller & Stahel, Comp. Stat. Data Anal. 55 (2011), 2504 (Hampel at the
//! ratios 1.5 : 3.5 : 8, 95 %); Krarup & Kubik, The Danish method: experience and philosophy, DGK A98 (1983), and Krarup,
//! Juhl & Kubik, Götterdämmerung over least squares adjustment, ISP Congress Hamburg (1980), for the method of 1967. The
//! Danish method has been used with several exponents; here it is the one that joins the constant at x = 1, of which c = 2 is
//! the customary constant.

use super::efficiency;

/// The shape of a loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// Square near zero, linear beyond.
    Huber,
    /// Between square and linear, nowhere of one kind.
    Fair,
    /// Huber without its kink, also called pseudo-Huber or Charbonnier.
    L1L2,
    /// Logarithmic far out: maximum likelihood for Cauchy's distribution.
    Cauchy,
    /// Bounded; its weight falls with the fourth power.
    GemanMcClure,
    /// Bounded; its weight is a Gaussian.
    Welsch,
    /// Tukey's biweight; rejects what is far out.
    Tukey,
    /// Andrews' sine; rejects what is far out.
    Andrews,
    /// Three straight pieces of influence; rejects what is far out.
    Hampel,
    /// Square near zero, then an exponentially falling weight.
    Danish,
}

/// All that is to be known of a kernel; ρ and the weight are given s and c.
struct Row {
    kernel: Kernel,
    name: &'static str,
    description: &'static str,
    tuning: f64,
    efficiency: f64,
    redescending: bool,
    /// Where the weight is not smooth, in units of c.
    kinks: &'static [f64],
    rho: fn(f64, f64) -> f64,
    weight: fn(f64, f64) -> f64,
}

/// The corners of Hampel's influence, in units of c.
const HAMPEL: [f64; 3] = [1.5, 3.5, 8.0];

static TABLE: [Row; 10] = [
    Row {
        kernel: Kernel::Huber,
        name: "huber",
        description: "square near zero, linear beyond",
        tuning: 1.345,
        efficiency: 0.95,
        redescending: false,
        kinks: &[1.0],
        rho: |s, c| if s <= c * c { s } else { 2.0 * c * s.sqrt() - c * c },
        weight: |s, c| if s <= c * c { 1.0 } else { c / s.sqrt() },
    },
    Row {
        kernel: Kernel::Fair,
        name: "fair",
        description: "square at zero, slowly becoming linear",
        tuning: 1.3998,
        efficiency: 0.95,
        redescending: false,
        kinks: &[],
        rho: |s, c| 2.0 * c * c * less_its_logarithm(s.sqrt() / c),
        weight: |s, c| 1.0 / (1.0 + s.sqrt() / c),
    },
    Row {
        kernel: Kernel::L1L2,
        name: "l1l2",
        description: "square near zero, linear beyond, without a kink (pseudo-Huber)",
        tuning: 1.2871,
        efficiency: 0.95,
        redescending: false,
        kinks: &[],
        rho: |s, c| 2.0 * s / (1.0 + (1.0 + s / (c * c)).sqrt()),
        weight: |s, c| 1.0 / (1.0 + s / (c * c)).sqrt(),
    },
    Row {
        kernel: Kernel::Cauchy,
        name: "cauchy",
        description: "logarithmic far out; large errors lose influence slowly",
        tuning: 2.3849,
        efficiency: 0.95,
        redescending: true,
        kinks: &[],
        rho: |s, c| c * c * (s / (c * c)).ln_1p(),
        weight: |s, c| 1.0 / (1.0 + s / (c * c)),
    },
    Row {
        kernel: Kernel::GemanMcClure,
        name: "geman-mcclure",
        description: "bounded; large errors lose influence fast",
        tuning: 3.7874,
        efficiency: 0.95,
        redescending: true,
        kinks: &[],
        rho: |s, c| s / (1.0 + s / (c * c)),
        weight: |s, c| (1.0 + s / (c * c)).powi(-2),
    },
    Row {
        kernel: Kernel::Welsch,
        name: "welsch",
        description: "bounded; the weight is a Gaussian",
        tuning: 2.9846,
        efficiency: 0.95,
        redescending: true,
        kinks: &[],
        rho: |s, c| -c * c * (-s / (c * c)).exp_m1(),
        weight: |s, c| (-s / (c * c)).exp(),
    },
    Row {
        kernel: Kernel::Tukey,
        name: "tukey",
        description: "biweight; bounded, ignores what is farther out than its constant",
        tuning: 4.6851,
        efficiency: 0.95,
        redescending: true,
        kinks: &[1.0],
        rho: |s, c| {
            let t = (s / (c * c)).min(1.0);
            c * c * t * (1.0 - t + t * t / 3.0)
        },
        weight: |s, c| (1.0 - (s / (c * c)).min(1.0)).powi(2),
    },
    Row {
        kernel: Kernel::Andrews,
        name: "andrews",
        description: "sine wave; bounded, ignores what is farther out than pi times its constant",
        tuning: 1.3387,
        efficiency: 0.95,
        redescending: true,
        kinks: &[std::f64::consts::PI],
        rho: |s, c| {
            let x = (s.sqrt() / c).min(std::f64::consts::PI);
            4.0 * c * c * (0.5 * x).sin().powi(2)
        },
        weight: |s, c| match s.sqrt() / c {
            0.0 => 1.0,
            x if x < std::f64::consts::PI => x.sin() / x,
            _ => 0.0,
        },
    },
    Row {
        kernel: Kernel::Hampel,
        name: "hampel",
        description: "three straight pieces of influence; ignores what is farther out than 8 times its constant",
        tuning: 0.9014,
        efficiency: 0.95,
        redescending: true,
        kinks: &HAMPEL,
        rho: |s, c| {
            let [a, b, end] = HAMPEL;
            let x = s.sqrt() / c;
            let linear = |x: f64| 2.0 * a * x - a * a;
            let left = ((end - x) / (end - b)).max(0.0);
            match x {
                _ if x <= a => s,
                _ if x <= b => c * c * linear(x),
                _ => c * c * (linear(b) + a * (end - b) * (1.0 - left * left)),
            }
        },
        weight: |s, c| {
            let [a, b, end] = HAMPEL;
            match s.sqrt() / c {
                x if x <= a => 1.0,
                x if x <= b => a / x,
                x => a * ((end - x) / (end - b)).max(0.0) / x,
            }
        },
    },
    Row {
        kernel: Kernel::Danish,
        name: "danish",
        description: "square near zero, then an exponentially falling weight, as geodesists use",
        tuning: 2.0,
        efficiency: 0.951,
        redescending: true,
        kinks: &[1.0],
        rho: |s, c| if s <= c * c { s } else { c * c * (1.0 - (1.0 - s / (c * c)).exp_m1()) },
        weight: |s, c| if s <= c * c { 1.0 } else { (1.0 - s / (c * c)).exp() },
    },
];

/// x − ln(1 + x) without cancellation; x ≥ 0.
fn less_its_logarithm(x: f64) -> f64 {
    if x > 0.3 {
        return x - x.ln_1p();
    }
    // with v = x/(2 + x): ln(1 + x) = 2 Σ v²ʲ⁺¹/(2j + 1), and x − 2 v = x v
    let v = x / (2.0 + x);
    let square = v * v;
    let series = (1..=10).rev().fold(0.0, |sum, j| sum * square + 1.0 / f64::from(2 * j + 1));
    x * v - 2.0 * v * square * series
}

impl Kernel {
    /// All of them.
    pub const ALL: [Kernel; 10] = [
        Kernel::Huber,
        Kernel::Fair,
        Kernel::L1L2,
        Kernel::Cauchy,
        Kernel::GemanMcClure,
        Kernel::Welsch,
        Kernel::Tukey,
        Kernel::Andrews,
        Kernel::Hampel,
        Kernel::Danish,
    ];

    #[allow(clippy::indexing_slicing, reason = "the table has a row for each kernel, in their order")]
    fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The kernel of that name.
    pub fn from_name(name: &str) -> Option<Kernel> {
        TABLE.iter().find(|row| row.name == name).map(|row| row.kernel)
    }

    /// What it is, in a line.
    pub fn description(self) -> &'static str {
        self.row().description
    }

    /// The constant *c* where none is given: that of 95 % efficiency in one dimension, or the customary one.
    pub fn tuning(self) -> f64 {
        self.row().tuning
    }

    /// The efficiency in one dimension that [`tuning`](Kernel::tuning) has, to three digits.
    pub fn efficiency(self) -> f64 {
        self.row().efficiency
    }

    /// Whether the influence of a residual returns to zero as it grows, so that the cost may have several minima.
    pub fn redescending(self) -> bool {
        self.row().redescending
    }

    /// Where the weight is not smooth, in units of *c*.
    pub(super) fn kinks(self) -> &'static [f64] {
        self.row().kinks
    }
}

impl std::fmt::Display for Kernel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// Why there is no such loss.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LossError {
    /// A constant that is no number of standard deviations.
    #[error("the tuning constant of a loss is a number of standard deviations between 1e-6 and 1e6, not {0}")]
    Tuning(f64),
    /// No constant has the efficiency that was asked for.
    #[error("no tuning constant gives {kernel} an efficiency of {efficiency:.4} in {dimension} dimensions")]
    Dimension {
        /// The kernel.
        kernel: Kernel,
        /// The efficiency in one dimension.
        efficiency: f64,
        /// The number of dimensions.
        dimension: usize,
    },
}

/// A kernel with its constant.
///
/// ```
/// use phical::statistics::{Kernel, Loss};
///
/// let loss = Loss::new(Kernel::Huber, None)?;
/// assert_eq!(loss.weight(1.0), 1.0);
/// assert_eq!(loss.weight(2.69 * 2.69), 0.5);
/// assert!((loss.efficiency(1) - 0.95).abs() < 1e-6);
/// # Ok::<(), phical::statistics::LossError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    kernel: Kernel,
    tuning: f64,
}

impl Loss {
    /// A kernel with a constant *c*, in standard deviations; without one, its own.
    ///
    /// # Errors
    /// Where the constant is not a number between 10⁻⁶ and 10⁶.
    pub fn new(kernel: Kernel, tuning: Option<f64>) -> Result<Loss, LossError> {
        let tuning = tuning.unwrap_or(kernel.tuning());
        if (1e-6..=1e6).contains(&tuning) { Ok(Loss { kernel, tuning }) } else { Err(LossError::Tuning(tuning)) }
    }

    /// The kernel.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Its constant *c*.
    pub fn tuning(&self) -> f64 {
        self.tuning
    }

    /// ρ(s), of the square s ≥ 0 of a whitened norm. Of NaN, and only of that, it is NaN.
    pub fn rho(&self, s: f64) -> f64 {
        representable(s).map_or(s, |s| (self.kernel.row().rho)(s, self.tuning))
    }

    /// weight(s) = ρ′(s), within [0, 1]. Of NaN, and only of that, it is NaN.
    pub fn weight(&self, s: f64) -> f64 {
        representable(s).map_or(s, |s| (self.kernel.row().weight)(s, self.tuning))
    }

    /// Whether a residual counts for nothing: its weight is exactly zero.
    pub fn rejects(&self, s: f64) -> bool {
        self.weight(s) == 0.0
    }

    /// The asymptotic efficiency, at normal errors in m dimensions, of the estimate of a location by this loss of the norm,
    /// relative to the mean: within \[0, 1\]. No dimension counts as one.
    ///
    /// > (E w(s) s)² / (m E w(s)² s),  s ~ χ²_m
    pub fn efficiency(&self, m: usize) -> f64 {
        efficiency::efficiency(self, m)
    }

    /// The same kernel with the constant at which its efficiency in m dimensions is what that of this loss is in one.
    ///
    /// # Errors
    /// Where there is none. In many dimensions the direction of a residual tells nearly all that its length does not: from
    /// ten on, the spatial median has 95 % itself, and with it every Huber, Fair and L1L2, whatever its constant.
    pub fn for_dimension(&self, m: usize) -> Result<Loss, LossError> {
        efficiency::for_dimension(self, m)
    }
}

/// s where its products with constants are numbers, if it is one.
fn representable(s: f64) -> Option<f64> {
    (!s.is_nan()).then(|| s.clamp(0.0, 1e290))
}

#[cfg(test)]
mod tests;
