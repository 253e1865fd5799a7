//! A design of a model, with what it would tell.

use super::criterion::{Criterion, Goal};
use super::experiment::{Experiment, Inverse};
use super::reach::{Reach, reach};
use super::search::{Picked, pick};
use super::setup::{Setup, stop};
use super::target::{Asked, Target, targets};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::identify::Probe;
use crate::linalg::dot;
use crate::problem::Problem;
use crate::simulate::Stream;
use crate::solve::LeastSquares;
use crate::statistics::median;

/// Random choices of as many rows that a design is held against.
pub const RANDOM: usize = 25;

/// What a design is to make small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The volume of the ellipsoid of uncertainty of all parameters.
    D,
    /// The mean variance of all parameters, in squared tolerances.
    A,
    /// The variance of the combination of parameters that is known worst, in squared tolerances.
    E,
    /// The mean variance of targets over a volume.
    Targets,
}

impl Aim {
    /// `d`, `a`, `e` or `targets`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Aim::D => "d",
            Aim::A => "a",
            Aim::E => "e",
            Aim::Targets => "targets",
        }
    }
}

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// Where candidates come from.
    pub candidates: Probe<'a>,
    /// What they are for.
    pub aim: Aim,
    /// The targets, with or without what is required of them.
    pub targets: Vec<Asked>,
    /// The rows in which targets are wanted; the candidates where there are none of their own.
    pub volume: Option<Problem<'a>>,
    /// How many rows; the smallest number that meets all requirements where none is said.
    pub rows: Option<usize>,
}

/// How well a target would be known, by the calibration alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Expected {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its standard uncertainty, root mean square over the volume.
    pub rms: f64,
    /// The largest in the volume.
    pub largest: f64,
    /// What is required.
    pub required: Option<f64>,
    /// The median of the root mean square for rows chosen at random; none where most of these see too little.
    pub random: Option<f64>,
}

/// How well a parameter would be known.
#[derive(Clone, Debug, PartialEq)]
pub struct Foretold {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its standard uncertainty; none where no candidate sees it.
    pub sigma: Option<f64>,
    /// What counts as known well enough.
    pub tolerance: f64,
}

/// Rows that were chosen, and what they would tell.
#[derive(Clone, Debug)]
pub struct Design<'a> {
    /// The candidates, at inputs that are consistent with the nominal values.
    pub problem: Problem<'a>,
    /// Candidates without consistent inputs.
    pub left_out: usize,
    /// By candidate: its block, its row there, and its row among those that there were.
    pub origin: Vec<(usize, usize, usize)>,
    /// What it is for.
    pub aim: Aim,
    /// The choice; all candidates, where even these do not meet what is required.
    pub picked: Picked,
    /// How many rows are needed, where that was asked.
    pub reach: Option<Reach>,
    /// How many rows the volume has.
    pub points: usize,
    /// What the targets are.
    pub targets: Vec<Target>,
    /// How well they would be known.
    pub expected: Vec<Expected>,
    /// How well parameters would be known.
    pub parameters: Vec<Foretold>,
    /// By how much an uncertainty of a random choice exceeds that of the design, in the sense of the criterion; the median.
    pub random_excess: Option<f64>,
    pub(super) volume: Problem<'a>,
    pub(super) spread: Vec<f64>,
}

impl Design<'_> {
    /// The chosen rows by block: their numbers in the problem, and among those that there were.
    #[must_use]
    pub fn chosen(&self) -> Vec<(usize, Vec<usize>, Vec<usize>)> {
        let of = |block: usize| {
            let mine = self.picked.chosen.iter().map(|&i| self.origin[i]).filter(|origin| origin.0 == block);
            let (rows, made) = mine.map(|(_, row, made)| (row, made)).unzip();
            (block, rows, made)
        };
        (0..self.problem.blocks.len()).map(of).collect()
    }

    /// Whether everything that is required is met.
    #[must_use]
    pub fn met(&self) -> bool {
        self.reach.as_ref().is_none_or(|reach| reach.reached)
    }
}

/// Chooses rows among candidates, before anything is measured.
///
/// A line that can be measured at four places, and is wanted at all of them:
///
/// ```
/// use phical::compile::compile;
/// use phical::design::{Aim, Asked, Request, design};
/// use phical::diag::Source;
/// use phical::identify::{Inputs, Probe};
/// use phical::model::load;
/// use phical::problem::Options;
///
/// let source = Source::new("line.ron", r#"(
///     name: "line",
///     parameters: { "a": Scalar(Free(0)), "b": Scalar(Free(0)) },
///     measurements: { "point": (
///         inputs: { "x": (), "y": (sigma: 0.1) }, residuals: { "r": "y - (a + b*x)" }, outputs: { "line": "a + b*x" },
///     ) },
///     scenarios: { "places": (measurements: { "point": (
///         rows: 40, draw: { "x": Cycle([-2, -1, 1, 2]) }, set: { "y": "a + b*x" },
///     ) }) },
/// )"#);
/// let (model, _) = load(&source)?;
/// let (program, _) = compile(&model, &source, &[])?;
/// let inputs = Inputs::Scenario(&program.scenarios[0]);
/// let candidates = Probe { program: &program, options: Options::default(), inputs, rows: vec![], seed: 0 };
/// let target = Asked { expression: "line".into(), required: None };
/// let found = design(&Request { candidates, aim: Aim::Targets, targets: vec![target], volume: None, rows: Some(10) })?;
/// // five at either end: σ² (1 + mean x² / 4) / 10
/// assert!((found.expected[0].rms - 0.1 * f64::sqrt((1.0 + 2.5 / 4.0) / 10.0)).abs() < 1e-12);
/// assert!(found.picked.excess() < 1e-4);
/// # Ok::<(), phical::diag::Diagnostics>(())
/// ```
///
/// # Errors
/// Mistakes of names and scenarios, no candidates, more rows than candidates or so few that something remains unseen, and targets
/// that no candidate sees, with the direction.
pub fn design<'a>(request: &Request<'a>) -> Result<Design<'a>, Diagnostics> {
    let setup = Setup::new(&request.candidates)?;
    let candidates = setup.experiment.candidates();
    let real = setup.problem.weights.are_real();
    if request.rows.is_none() && !real {
        let message = "nothing tells how large errors are, so no uncertainty can be required";
        let hint = "give sigmas to the inputs or to the residuals, or ask for a number of rows with `--pick`";
        return Err(Diagnostic::error(Code::BadRequirement, message).hint(hint).into());
    }
    if let Some(wanted) = request.rows
        && (wanted == 0 || wanted > candidates)
    {
        let message = match wanted {
            0 => "no rows are wanted".to_owned(),
            _ => format!("{wanted} rows are wanted, and there are {candidates} candidates"),
        };
        let found = Diagnostic::error(Code::TooManyRows, message);
        return Err(found.hint("ask for fewer, or give more candidates with `--rows MEASUREMENT=NUMBER`").into());
    }
    if request.aim != Aim::Targets
        && let Some(blind) = setup.first_blind()
    {
        let message = format!("the criterion needs all parameters, and no candidate sees this: {blind}");
        let hint = "hold one of these parameters, or design for a `--target` that does not depend on them";
        return Err(Diagnostic::error(Code::TargetUnseen, message).hint(hint).into());
    }
    let volume = request.volume.clone().unwrap_or_else(|| setup.problem.clone());
    let targets = targets(&setup, &volume, &request.targets)?;
    let n = setup.experiment.coordinates();
    let tolerances = setup.in_tolerances();
    let criterion = match request.aim {
        Aim::D => Criterion::Determinant,
        Aim::A => Criterion::Trace(tolerances),
        Aim::E => Criterion::Eigenvalue(tolerances),
        Aim::Targets if request.rows.is_none() => {
            Criterion::Largest(targets.iter().map(|target| target.mean_rows(n)).collect())
        }
        Aim::Targets => Criterion::Trace(targets.iter().flat_map(|target| target.mean_rows(n)).collect()),
    };
    let (picked, reach) = match request.rows {
        Some(rows) => (pick(&setup.experiment, &criterion, rows).map_err(stop)?, None),
        None => {
            let (picked, reach) = reach(&setup.experiment, &criterion).map_err(stop)?;
            (picked, Some(reach))
        }
    };
    let Some(picked) = picked else {
        let rows = request.rows.unwrap_or(candidates);
        let message =
            format!("no choice of {rows} of the {candidates} candidates determines all that they tell together");
        let hint = format!("ask for more: {n} unknowns want as many equations, priors among them; or hold parameters");
        return Err(Diagnostic::error(Code::TooFewRows, message).hint(hint).into());
    };
    told(setup, request, volume, targets, &criterion, picked, reach).map_err(stop)
}

fn told<'a>(
    setup: Setup<'a>,
    request: &Request<'a>,
    volume: Problem<'a>,
    targets: Vec<Target>,
    criterion: &Criterion,
    picked: Picked,
    reach: Option<Reach>,
) -> Result<Design<'a>, crate::linalg::LinalgError> {
    let experiment = &setup.experiment;
    let inverse = experiment.of(&picked.chosen).inverse();
    let inverse = inverse.ok_or(crate::linalg::LinalgError::Singular(0))?;
    let goal = Goal::new(experiment, criterion)?;
    let mut gradients = Vec::new();
    for target in &targets {
        gradients.push(experiment.transformed(&target.gradients)?);
    }
    let (mut medians, mut excess) = (vec![Vec::new(); targets.len()], Vec::new());
    let seed = request.candidates.seed;
    // there is no other choice than all
    let others = if picked.chosen.len() < experiment.candidates() { RANDOM } else { 0 };
    for k in 0..others {
        let mut chosen = Stream::new(seed, &format!("random design {k}")).order(experiment.candidates());
        chosen.truncate(picked.chosen.len());
        let Some(inverse) = experiment.of(&chosen).inverse() else { continue };
        medians.iter_mut().zip(&gradients).for_each(|(all, rows)| all.push(mean(&inverse, rows).sqrt()));
        excess.extend(goal.at(&inverse).map(|pull| picked.against(pull.value)));
    }
    // a middle of those that see enough would flatter chance
    let known = excess.len() > RANDOM / 2;
    let middle = |all: &mut Vec<f64>| if known { median(all) } else { None };
    let expected = targets.iter().zip(&gradients).zip(&mut medians).map(|((target, rows), random)| Expected {
        name: target.name.clone(),
        unit: target.unit.clone(),
        rms: mean(&inverse, rows).sqrt() * target.reported,
        largest: variances(&inverse, rows).fold(0.0, f64::max).sqrt() * target.reported,
        required: target.required,
        random: middle(random).map(|sigma| sigma * target.reported),
    });
    let expected = expected.collect();
    let random_excess = middle(&mut excess);

    let of = experiment.transformed(&setup.in_tolerances())?;
    let units = &setup.problem.program.units;
    let scale = setup.problem.scale();
    let n = experiment.coordinates();
    let mut parameters = Vec::new();
    for ((j, &c), estimable) in setup.problem.free.iter().enumerate().zip(setup.estimable()) {
        let coordinate = &setup.problem.layout.coordinates[c];
        let sigma = variances(&inverse, &of[j * n..(j + 1) * n]).sum::<f64>().sqrt() * scale[j];
        parameters.push(Foretold {
            name: coordinate.name.clone(),
            unit: units.symbol(coordinate.dimension),
            sigma: estimable.then(|| units.to_reported(sigma, coordinate.dimension)),
            tolerance: units.to_reported(coordinate.tolerance, coordinate.dimension),
        });
    }
    let spread = gradients.iter().map(|rows| effective(experiment, &inverse, rows)).collect();
    let points = volume.blocks.iter().enumerate();
    let points = points.filter(|(at, _)| targets.iter().any(|t| t.places.iter().any(|(block, _)| block == at)));
    Ok(Design {
        points: points.map(|(_, block)| block.table.rows()).sum(),
        problem: setup.problem,
        left_out: setup.left_out,
        origin: setup.origin,
        aim: request.aim,
        picked,
        reach,
        targets,
        expected,
        parameters,
        random_excess,
        volume,
        spread,
    })
}

fn variances<'a>(inverse: &'a Inverse, rows: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let n = inverse.n;
    rows.chunks_exact(n).map(move |row| inverse.root.chunks_exact(n).map(|l| dot(l, row).powi(2)).sum::<f64>())
}

fn mean(inverse: &Inverse, rows: &[f64]) -> f64 {
    let count = (rows.len() / inverse.n).max(1);
    variances(inverse, rows).sum::<f64>() / count as f64
}

/// The degrees of freedom of a mean of squares with covariance V: (tr V)²/tr V² (Satterthwaite 1946; Box 1954).
fn effective(experiment: &Experiment, inverse: &Inverse, rows: &[f64]) -> f64 {
    let n = experiment.coordinates();
    // V has the eigenvalues of Wᵀ W, W = rows L⁻ᵀ
    let half = super::experiment::products(n, rows, &inverse.root);
    let mut gram = vec![0.0; n * n];
    for row in half.chunks_exact(n) {
        for (line, a) in gram.chunks_exact_mut(n).zip(row) {
            line.iter_mut().zip(row).for_each(|(entry, b)| *entry += a * b);
        }
    }
    let trace: f64 = (0..n).map(|i| gram[i * n + i]).sum();
    let squares: f64 = dot(&gram, &gram);
    if squares > 0.0 { trace * trace / squares } else { 1.0 }
}
