//! Calibrates instruments and robots that are *declared, not programmed*.
//!
//! A text file states the kinematic chains, the parameters with units, bounds and priors, what is measured and how well, and
//! the equations that the truth would satisfy. phical turns it into exact derivatives, fits it, and says how far each result
//! can be trusted and which parameters the data cannot see.
//!
//! # The problem
//!
//! Parameters *q* live on a manifold (numbers, vectors, rotations, poses). Row *i* of the data has readings *xᵢ*, and the
//! model gives residuals *rᵢ(q) = f(q, xᵢ)* that vanish where parameters and readings are true. With weights *1/σ* and
//! Gaussian priors of some parameters around their nominal values, the estimate is
//!
//! > *q̂* = arg min ½ Σᵢ ‖*rᵢ(q)*/*σᵢ*‖² + ½ Σⱼ ((*qⱼ* ⊖ *nominalⱼ*)/*sⱼ*)²,  *min* ≤ *q* ≤ *max*,
//!
//! where the first sum, with errors of the readings declared, is Σᵢ min *vᵢ*ᵀ*Σ*⁻¹*vᵢ* over corrections that make the equations
//! hold, *f(q, xᵢ + vᵢ)* = 0; and among equally good points the one nearest to the nominal values in units of the parameters' tolerances. Derivatives
//! ∂r/∂q and ∂r/∂x are exact.
//!
//! # How data flow
//!
//! text ─[read](model::load())→ [Model](model::Model) ─[compile](compile::compile)→ [Program](compile::Program)
//! ─[bind](problem::Problem::bind)([data])→ [Problem](problem::Problem) ─[solve](solve::minimise)→
//! [Solution](solve::Solution) ─[analyse](fit::analyse)→ [Fit](fit::Fit) ─[report]→ text, JSON, HTML
//!
//! [`session`] joins these, and [`cli`] is the command line over it. The modules, in the order in which data meet them:
//!
//! | module | what it is |
//! |---|---|
//! | [`diag`] | mistakes and warnings with codes, places and cures |
//! | [`unit`](mod@unit) | units and dimensions |
//! | [`lang`] | the language of residuals: text to tree |
//! | [`model`] | what the file says, and the reference of its language |
//! | [`graph`] | scalars, vectors and motions as a graph, lowered to tapes |
//! | [`eval`] | tapes over numbers and dual numbers |
//! | [`compile`] | names, shapes and dimensions checked; model to program |
//! | [`data`] | tables from files |
//! | [`simulate`] | made-up tables, and the truth behind them |
//! | [`statistics`] | distributions, tests, robust losses |
//! | [`simd`] | the instruction set of the machine |
//! | [`linalg`] | the square-root information matrix |
//! | [`solve`] | least squares on a manifold |
//! | [`problem`] | a program bound to rows |
//! | [`fit`] | uncertainties, what is not estimable, a verdict |
//! | [`evaluate`] | residuals, Jacobians, and outputs with their uncertainty, at given values |
//! | [`identify`] | what data can see, before and after measuring |
//! | [`emit`](mod@emit) | residuals and derivatives as Rust, C or Python |
//! | [`survey`](mod@survey) | the rows of a fit as columns to draw, and the instrument as a picture |
//! | [`session`] | all stages joined |
//! | [`coverage`](mod@coverage) | whether the stated uncertainties are true |
//! | [`design`](mod@design) | which rows to measure |
//! | [`compare`] | two fits side by side |
//! | [`exchange`] | Denavit–Hartenberg tables and URDF files, read as models and written with calibrated numbers |
//! | [`report`] | text, JSON, HTML |
//! | [`cli`] | the command line |
//! | `testing` | strategies and assertions for property tests of models, with the feature `proptest` |
//!
//! [`guide`](mod@guide) is the user's guide, the same as `docs/`.
//!
//! # Example
//!
//! ```
//! use phical::compile::compile;
//! use phical::data::Table;
//! use phical::diag::Source;
//! use phical::fit::analyse;
//! use phical::model::load;
//! use phical::problem::{Options, Problem};
//! use phical::solve::{Settings, minimise};
//!
//! // an angle encoder whose disc sits off its axis: eccentricity, phase and zero
//! let source = Source::new("encoder.ron", r#"(
//!     name: "encoder",
//!     parameters: { "zero": Scalar(Free("0 rad")), "c": Scalar(Free("0 rad")), "s": Scalar(Free("0 rad")) },
//!     measurements: { "stop": (
//!         inputs: { "read": (unit: "rad"), "true": (unit: "rad") },
//!         residuals: { "r": "read - true - zero - c*cos(true) - s*sin(true)" },
//!     ) },
//! )"#);
//! let (model, _) = load(&source)?;
//! let (program, _) = compile(&model, &source, &[])?;
//! let mut table = Table::new(0, 2);
//! for k in 0..12 {
//!     let angle = 0.5 * f64::from(k);
//!     table.push(&[], &[angle + 0.01 + 0.002 * angle.cos() - 0.003 * angle.sin(), angle], None).expect("two readings");
//! }
//! let (problem, _) = Problem::bind(&program, vec![(0, table)], &Options::default())?;
//! let solution = minimise(&problem, problem.start.clone(), &Settings::default()).expect("it is defined everywhere");
//! let fit = analyse(&problem, solution).expect("here too");
//! assert!(fit.verdict().trustworthy());
//! for (parameter, truth) in fit.parameters.iter().zip([0.01, 0.002, -0.003]) {
//!     assert!((parameter.value - truth).abs() < 1e-14, "{}", parameter.name);
//! }
//! # Ok::<(), phical::diag::Diagnostics>(())
//! ```

#![cfg_attr(
    test,
    allow(
        clippy::get_unwrap,
        clippy::panic_in_result_fn,
        clippy::string_slice,
        clippy::unreachable,
        clippy::unwrap_in_result,
        reason = "a test that cannot go on fails; `clippy.toml` has no settings for these"
    )
)]

pub mod audit;
pub mod cli;
pub mod compare;
pub mod compile;
pub mod coverage;
pub mod data;
pub mod derive;
pub mod design;
pub mod diag;
pub mod emit;
pub mod eval;
pub mod evaluate;
pub mod exchange;
pub mod fit;
pub mod graph;
pub mod guide;
pub mod identify;
pub mod lang;
pub mod linalg;
pub mod model;
pub mod problem;
pub mod report;
pub mod session;
pub mod simd;
pub mod simulate;
pub mod solve;
pub mod statistics;
pub mod survey;
pub mod symbolic;
#[cfg(feature = "proptest")]
pub mod testing;
pub mod unit;
