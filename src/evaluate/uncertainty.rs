//! The uncertainty of derived quantities, and where it comes from.
//!
//! An output g(q, x) of estimated parameters q and readings x has, by the law of propagation of uncertainty (JCGM 100:2008,
//! GUM, 5.1.2 and 5.2.2; for several outputs at once JCGM 102:2011, 6.2), the covariance
//!
//! > V = G_q C G_qᵀ + G_x Σ G_xᵀ,  Σ = D ρ D
//!
//! with exact derivatives G, the covariance C of the parameters ([`Estimated`]), the declared standard deviations D of the
//! readings and their declared correlations ρ, whatever the weights of the fit. It is of first order.
//!
//! - Readings are taken as independent of the fit. Those of the calibration itself are not: there the result is about right
//!   where rows are many, and too small or too large by what one row has to say in the fit.
//! - Family members that were estimated for these very rows have a covariance of their own, with all else as it is; that it
//!   goes along with the errors of the fit and of these readings is neglected.
//! - Where an output changes along a direction that nothing determines, or with a parameter that is on a bound, or where
//!   nothing says how well a parameter is known, it has no uncertainty, and [`Gap`] says why.
//!
//! The budget splits the variance among the groups of inputs (their `group`, or what they measure) and the fits. Group G has
//! Σ_{k∈G} cₖ (ρ c)ₖ with c = D gₓ, which adds up where errors are correlated as well (a share can then be negative). Effective
//! degrees of freedom are those of Welch and Satterthwaite ([`effective_dof`], GUM G.4.1): only a fit that estimated the size
//! of errors has less than infinitely many.

use super::estimated::{Estimated, Why};
use crate::linalg::dot;
use crate::problem::{Block, Problem, Sensitivity, Undefined};
use crate::statistics::{coverage_factor, effective_dof};

/// The confidence that coverage factors are for.
pub const COVERAGE: f64 = 0.95;

/// Rows beyond which the covariances between outputs are not kept.
pub const MOST_COVARIANCES: usize = 1000;

/// A variance below this share of the terms that it is the sum of is rounding.
const ROUNDING: f64 = 1e-13;

/// The uncertainties of a measurement's outputs.
#[derive(Clone, Debug)]
pub struct Uncertainties {
    /// The measurement.
    pub measurement: String,
    /// By output.
    pub outputs: Vec<Uncertainty>,
    /// The covariance between outputs, by row, of [`MOST_COVARIANCES`] rows or less: in the outputs' reported units, none
    /// where one of the two has no uncertainty.
    pub covariance: Option<Vec<Vec<Vec<Option<f64>>>>>,
}

/// The uncertainty of one output.
#[derive(Clone, Debug, Default)]
pub struct Uncertainty {
    /// Its standard uncertainty in each row, in reported units.
    pub sigma: Vec<Option<f64>>,
    /// The root mean square of those.
    pub rms: Option<f64>,
    /// Each group of inputs and each fit, and its share of the variance, which is the mean over the rows that have one. They
    /// add to one.
    pub budget: Vec<(String, f64)>,
    /// How many degrees of freedom such a standard uncertainty has.
    pub effective_dof: Option<f64>,
    /// The factor for intervals of [`COVERAGE`].
    pub coverage_factor: Option<f64>,
    /// Why rows have none.
    pub gaps: Vec<Gap>,
}

/// Rows without an uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Gap {
    /// Why not.
    pub why: Why,
    /// The parameters that are to blame.
    pub parameters: Vec<String>,
    /// How many rows there are.
    pub rows: usize,
}

/// The uncertainties of all outputs at a point, from how well parameters are known and from the errors of the inputs. What no
/// one of `estimated` has among its coordinates is taken as exact.
///
/// ```
/// use phical::compile::compile;
/// use phical::data::Table;
/// use phical::diag::Source;
/// use phical::evaluate::{Estimated, uncertainties};
/// use phical::fit::JointUncertainty;
/// use phical::model::load;
/// use phical::problem::{Options, Problem};
///
/// // a length from an angle read to 0.1 mrad, by an arm of (2.00 ± 0.01) m
/// let source = Source::new("arm.ron", r#"(
///     name: "arm", units: (length: "m"),
///     parameters: { "arm": Scalar(Free("2 m")) },
///     measurements: { "arc": (
///         inputs: { "t": (unit: "rad", sigma: "0.1 mrad") }, residuals: { "r": "arm*t" }, outputs: { "s": "arm*t" },
///     ) },
/// )"#);
/// let (model, _) = load(&source)?;
/// let (program, _) = compile(&model, &source, &[])?;
/// let mut table = Table::new(0, 1);
/// table.push(&[], &[0.5], None).expect("one reading");
/// let (problem, _) = Problem::bind(&program, vec![(0, table)], &Options::default())?;
/// let known = JointUncertainty {
///     names: vec!["arm".into()], covariance: Some(vec![vec![1e-4]]), tolerances: vec![0.01],
///     on_bound: vec![false], null_directions: vec![], dof: 9.0,
/// };
/// let calibration = Estimated::new(&problem, "calibration", &known);
/// let all = uncertainties(&problem, &problem.start, &[calibration]).expect("it is defined");
/// let s = &all[0].outputs[0];
/// let (reading, arm) = (2.0 * 1e-4, 0.5 * 0.01);
/// assert!((s.sigma[0].unwrap() - f64::hypot(reading, arm)).abs() < 1e-15);
/// assert_eq!(s.budget[1].0, "calibration");
/// assert!((s.budget[1].1 - arm * arm / (reading * reading + arm * arm)).abs() < 1e-12);
/// # Ok::<(), phical::diag::Diagnostics>(())
/// ```
///
/// # Errors
/// Where the sigma of a reading is not positive.
pub fn uncertainties(
    problem: &Problem,
    point: &[f64],
    estimated: &[Estimated],
) -> Result<Vec<Uncertainties>, Undefined> {
    (0..problem.blocks.len()).map(|block| of_block(problem, block, point, estimated)).collect()
}

/// What the parts of a variance are of: groups of inputs, then fits.
struct Parts<'a> {
    groups: Vec<&'a str>,
    /// the group of each measured input
    group: Vec<usize>,
    correlations: Option<&'a Vec<Vec<f64>>>,
    estimated: &'a [Estimated],
    /// the fit and its own number of each coordinate, in the order in which they were asked for
    owner: Vec<(usize, usize)>,
}

/// One row's covariance of outputs.
struct Row {
    total: Vec<Vec<f64>>,
    /// by output: the variance by part
    parts: Vec<Vec<f64>>,
    /// by output: why it has none, the parameters being those of a fit
    refused: Vec<Option<(Why, usize, Vec<usize>)>>,
}

impl<'a> Parts<'a> {
    fn new(block: &'a Block, estimated: &'a [Estimated]) -> Self {
        let mut groups: Vec<&str> = Vec::new();
        let mut group = Vec::new();
        for input in block.measured_inputs() {
            let name = block.measurement.inputs[input].group.as_str();
            let known = groups.iter().position(|known| *known == name);
            group.push(known.unwrap_or_else(|| {
                groups.push(name);
                groups.len() - 1
            }));
        }
        let of = |(fit, all): (usize, &Estimated)| (0..all.coordinates.len()).map(move |j| (fit, j));
        Parts {
            groups,
            group,
            correlations: block.measurement.correlations.as_ref(),
            estimated,
            owner: estimated.iter().enumerate().flat_map(of).collect(),
        }
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.groups.iter().copied().chain(self.estimated.iter().map(|all| all.name.as_str()))
    }

    fn row(&self, of: &Sensitivity, outputs: usize) -> Row {
        let (n, k) = (of.columns.len(), of.sigma.len());
        let gradient = |output: usize| &of.by_coordinates[output * n..(output + 1) * n];
        let mut row = Row {
            total: vec![vec![0.0; outputs]; outputs],
            parts: vec![Vec::with_capacity(self.groups.len() + self.estimated.len()); outputs],
            refused: vec![None; outputs],
        };
        let mut size = vec![0.0; outputs];

        // of the readings
        let by_deviation = |output: usize| -> Vec<f64> {
            of.by_inputs[output * k..(output + 1) * k].iter().zip(of.sigma).map(|(g, sigma)| g * sigma).collect()
        };
        let c: Vec<Vec<f64>> = (0..outputs).map(by_deviation).collect();
        for j in 0..outputs {
            let mixed: Vec<f64> = match self.correlations {
                None => c[j].clone(),
                Some(rho) => rho.iter().map(|row| dot(row, &c[j])).collect(),
            };
            for (line, c) in row.total.iter_mut().zip(&c) {
                line[j] += dot(c, &mixed);
            }
            let mut groups = vec![0.0; self.groups.len()];
            for ((&group, c), mixed) in self.group.iter().zip(&c[j]).zip(&mixed) {
                groups[group] += c * mixed;
                size[j] += (c * mixed).abs();
            }
            row.parts[j].extend(groups);
        }

        // of the fits
        for (fit, estimated) in self.estimated.iter().enumerate() {
            let mine: Vec<usize> = (0..n).filter(|&at| self.owner[of.columns[at]].0 == fit).collect();
            let columns: Vec<usize> = mine.iter().map(|&at| self.owner[of.columns[at]].1).collect();
            let g: Vec<Vec<f64>> =
                (0..outputs).map(|output| mine.iter().map(|&at| gradient(output)[at]).collect()).collect();
            for j in 0..outputs {
                let (product, without_signs) = estimated.times(&columns, &g[j]);
                for (line, g) in row.total.iter_mut().zip(&g) {
                    line[j] += dot(g, &product);
                }
                row.parts[j].push(dot(&g[j], &product));
                size[j] += g[j].iter().zip(&without_signs).map(|(g, c)| g.abs() * c).sum::<f64>();
                if row.refused[j].is_none() {
                    row.refused[j] = estimated.refuses(&columns, &g[j]).map(|(why, of)| (why, fit, of));
                }
            }
        }
        for j in 0..outputs {
            let numbers = || gradient(j).iter().chain(&c[j]);
            let variance = row.total[j][j];
            let why = match () {
                () if numbers().any(|number| !number.is_finite()) || !variance.is_finite() => Why::NoDerivative,
                () if row.refused[j].is_some() => continue,
                () if size[j] == 0.0 => Why::Nothing,
                () if variance <= ROUNDING * size[j] => Why::Rounding,
                () => continue,
            };
            row.refused[j] = Some((why, 0, Vec::new()));
        }
        row
    }
}

fn of_block(
    problem: &Problem,
    number: usize,
    point: &[f64],
    estimated: &[Estimated],
) -> Result<Uncertainties, Undefined> {
    let block = &problem.blocks[number];
    let (measurement, units) = (block.measurement, &problem.program.units);
    let (rows, m) = (block.table.rows(), measurement.outputs.len());
    let reported: Vec<f64> = measurement.outputs.iter().map(|o| units.to_reported(1.0, o.dimension)).collect();
    let parts = Parts::new(block, estimated);
    let mut outputs = vec![Uncertainty { sigma: vec![None; rows], ..Uncertainty::default() }; m];
    let mut sums = vec![vec![0.0; parts.names().count()]; m];
    let mut known = vec![0usize; m];
    let mut covariance = (rows <= MOST_COVARIANCES).then(|| Vec::with_capacity(rows));
    if m > 0 {
        let coordinates: Vec<usize> = estimated.iter().flat_map(|all| all.coordinates.iter().copied()).collect();
        problem.sensitivities(number, point, &coordinates, |found| {
            let row = parts.row(found, m);
            for (j, output) in outputs.iter_mut().enumerate() {
                match &row.refused[j] {
                    None => {
                        output.sigma[found.row] = Some(row.total[j][j].sqrt() * reported[j]);
                        known[j] += 1;
                        sums[j].iter_mut().zip(&row.parts[j]).for_each(|(sum, part)| *sum += part);
                    }
                    Some((why, fit, of)) => {
                        let name = |&k: &usize| &problem.layout.coordinates[estimated[*fit].coordinates[k]].name;
                        output.gap(*why, of.iter().map(name));
                    }
                }
            }
            if let Some(all) = &mut covariance {
                let has = |j: usize| row.refused[j].is_none();
                let entry = |i: usize, j: usize| row.total[i][j] * reported[i] * reported[j];
                let line = |i: usize| (0..m).map(|j| (has(i) && has(j)).then(|| entry(i, j))).collect();
                all.push((0..m).map(line).collect());
            }
        })?;
    }
    for (((output, sums), known), reported) in outputs.iter_mut().zip(sums).zip(known).zip(reported) {
        output.summarise(&parts, &sums, known, reported);
    }
    Ok(Uncertainties { measurement: measurement.name.clone(), outputs, covariance })
}

impl Uncertainty {
    fn gap<'n>(&mut self, why: Why, parameters: impl Iterator<Item = &'n String>) {
        let at = self.gaps.iter().position(|gap| gap.why == why).unwrap_or_else(|| {
            self.gaps.push(Gap { why, parameters: Vec::new(), rows: 0 });
            self.gaps.len() - 1
        });
        let gap = &mut self.gaps[at];
        gap.rows += 1;
        for name in parameters {
            if !gap.parameters.contains(name) {
                gap.parameters.push(name.clone());
            }
        }
    }

    /// `sums` are the variances by part over the rows that have one.
    fn summarise(&mut self, parts: &Parts, sums: &[f64], known: usize, reported: f64) {
        let total: f64 = sums.iter().sum();
        if known == 0 || total <= 0.0 {
            return;
        }
        let (readings, fits) = sums.split_at(parts.groups.len());
        let deviation = |variance: f64| (variance / total).max(0.0).sqrt();
        let mut contributions = vec![(deviation(readings.iter().sum()), f64::INFINITY)];
        contributions.extend(fits.iter().zip(parts.estimated).map(|(sum, all)| (deviation(*sum), all.dof)));
        // a fit without degrees of freedom has no covariance, and contributes nothing
        contributions.retain(|(deviation, _)| *deviation > 0.0);
        self.rms = Some((total / known as f64).sqrt() * reported);
        self.budget = parts.names().zip(sums).map(|(name, sum)| (name.to_owned(), sum / total)).collect();
        self.effective_dof = effective_dof(&contributions);
        self.coverage_factor = self.effective_dof.and_then(|dof| coverage_factor(COVERAGE, dof));
    }
}
