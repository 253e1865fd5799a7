//! Every route at every sample, and what becomes of it.

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::super::formulas::{BEYOND, COPIES, MOST_DIGITS, digits};
use super::batch::{Batch, Sample};
use super::compare::{Column, Residuals, Row, engine};
use super::{CheckedRoute, CheckedRoutes, Route, WorstDerivative};
use crate::problem::{Block, Undefined};

/// One derivative by one route.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) value: f64,
    /// how far it scatters about the exact one, or how far off a difference may be
    pub(super) uncertainty: f64,
}

/// What is seen of a row at a point: by route, residual and column; nothing where a route shows nothing.
pub(super) struct Seen {
    /// its point, by number
    point: usize,
    row: Row,
    pub(super) routes: Vec<Vec<Option<Entry>>>,
}

/// What is seen of all samples; nothing of those where something is undefined.
pub(super) struct Looked {
    pub(super) seen: Vec<Option<Seen>>,
    /// what is not analytic, by block: the residual and the operation
    left_out: Vec<Vec<(usize, &'static str)>>,
}

/// The routes that are compared to rounding, all rows of a batch.
struct Rounded {
    rows: Vec<Row>,
    engine: Vec<Vec<f64>>,
    symbolic: Vec<Vec<f64>>,
    complex_step: Vec<Vec<Option<f64>>>,
}

impl Rounded {
    fn at(batch: &Batch, residuals: &[Residuals]) -> Result<Rounded, Undefined> {
        let row = |one: &Sample| {
            let block = &batch.problem.blocks[one.block];
            residuals[one.block].row(&batch.problem, block, one.row, &batch.points[one.point])
        };
        let rows = batch.samples.iter().map(row).collect::<Result<Vec<Row>, _>>()?;
        let of = |k: usize| &residuals[batch.samples[k].block];
        Ok(Rounded {
            engine: engine(batch, &rows)?,
            symbolic: rows.iter().enumerate().map(|(k, row)| of(k).symbolic(row)).collect(),
            complex_step: rows.iter().enumerate().map(|(k, row)| of(k).complex_step(row)).collect(),
            rows,
        })
    }

    /// How far a derivative of a row is off, by a route.
    fn off(&self, route: Route, sample: usize, entry: usize) -> Option<f64> {
        self.value(route, sample, entry).map(|value| value - self.rows[sample].exact[entry])
    }

    fn value(&self, route: Route, sample: usize, entry: usize) -> Option<f64> {
        match route {
            Route::Engine => self.engine[sample].get(entry).copied(),
            Route::Symbolic => self.symbolic[sample].get(entry).copied(),
            Route::ComplexStep => self.complex_step[sample].get(entry).copied().flatten(),
            Route::Differences => None,
        }
    }
}

impl Looked {
    pub(super) fn at(batch: &Batch, seed: u64) -> Result<Looked, Undefined> {
        let problem = &batch.problem;
        let residuals: Vec<Residuals> =
            problem.blocks.iter().map(|block| Residuals::for_all_routes(problem, block)).collect();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let here = Rounded::at(batch, &residuals)?;
        // copies of all points that differ in their last digits: what differs between them is rounding
        let copies = (0..COPIES).map(|_| Rounded::at(&batch.nudged(&mut random), &residuals));
        let copies: Vec<Rounded> = copies.collect::<Result<_, _>>()?;
        let mut seen = Vec::new();
        for (k, sample) in batch.samples.iter().enumerate() {
            let row = &here.rows[k];
            if !row.is_defined() {
                seen.push(None);
                continue;
            }
            let differences = residuals[sample.block].differences(problem, row, &batch.points[sample.point]);
            let entry = |route: Route, at: usize| match route {
                Route::Differences => differences[at].map(|(value, uncertainty)| Entry { value, uncertainty }),
                _ => {
                    let off = here.off(route, k, at)?;
                    let scatter = copies.iter().filter_map(|copy| Some((copy.off(route, k, at)? - off).abs()));
                    let uncertainty = scatter.filter(|size| size.is_finite()).fold(0.0, f64::max);
                    Some(Entry { value: here.value(route, k, at)?, uncertainty })
                }
            };
            let all = |route: Route| (0..row.exact.len()).map(|at| entry(route, at)).collect();
            let routes = Route::ALL.map(all).to_vec();
            seen.push(Some(routes));
        }
        let points = batch.samples.iter().map(|sample| sample.point);
        let seen = here.rows.into_iter().zip(points).zip(seen);
        let seen = seen.map(|((row, point), routes)| routes.map(|routes| Seen { point, row, routes }));
        let left_out = residuals.iter().zip(&problem.blocks).map(|(of, block)| {
            let all = 0..block.measurement.residuals.len();
            all.filter_map(|i| of.not_analytic(i).map(|operation| (i, operation.row().name))).collect()
        });
        Ok(Looked { seen: seen.collect(), left_out: left_out.collect() })
    }

    pub(super) fn verdict(&self, batch: &Batch, number: usize) -> CheckedRoutes {
        let block = &batch.problem.blocks[number];
        let here = || batch.samples.iter().zip(&self.seen).filter(|(sample, _)| sample.block == number);
        let rows: Vec<&Seen> = here().filter_map(|(_, seen)| seen.as_ref()).collect();
        CheckedRoutes {
            measurement: block.measurement.name.clone(),
            points: rows.len(),
            undefined: here().count() - rows.len(),
            derivatives: rows.iter().map(|seen| seen.row.exact.len()).sum(),
            routes: Route::ALL.into_iter().map(|route| self.of_route(route, batch, number, &rows)).collect(),
        }
    }

    fn of_route(&self, route: Route, batch: &Batch, number: usize, rows: &[&Seen]) -> CheckedRoute {
        let block = &batch.problem.blocks[number];
        let mut found =
            CheckedRoute { route, agrees: true, compared: 0, digits: MOST_DIGITS, worst: None, left_out: None };
        let mut most = -1.0;
        for seen in rows {
            let scales = scales(&seen.row);
            for (at, entry) in seen.routes[route as usize].iter().enumerate() {
                let (Some(Entry { value, uncertainty }), exact) = (entry, seen.row.exact[at]) else { continue };
                let off = (value - exact).abs();
                let allowed = match route {
                    Route::Differences => *uncertainty,
                    _ => BEYOND * (uncertainty + f64::EPSILON * scales[at].max(value.abs())),
                };
                found.compared += 1;
                found.digits = found.digits.min(digits(off, scales[at]));
                // what is not a number is near nothing
                found.agrees &= off <= allowed;
                let share = if off.is_nan() { f64::INFINITY } else { off / allowed.max(f64::MIN_POSITIVE) };
                if share > most {
                    most = share;
                    found.worst = Some(seen.derivative(batch, block, at, *value));
                }
            }
        }
        let all: usize = rows.iter().map(|seen| seen.row.exact.len()).sum();
        found.left_out = self.why_left_out(route, number, block, all - found.compared);
        found
    }

    fn why_left_out(&self, route: Route, number: usize, block: &Block, missing: usize) -> Option<String> {
        match (route, missing) {
            (_, 0) => None,
            (Route::ComplexStep, _) => {
                let residuals = &block.measurement.residuals;
                let all = &self.left_out[number];
                let named = all.iter().map(|(i, operation)| match all.len() == residuals.len() {
                    true => format!("`{operation}` is not analytic"),
                    false => format!("`{operation}` of `{}` is not analytic", residuals[*i].name),
                });
                let mut named: Vec<String> = named.collect();
                named.dedup();
                Some(named.join(", "))
            }
            _ => Some(format!("{missing} too uncertain to show anything")),
        }
    }
}

/// For each entry of a row, the largest derivative of its residual by anything of the same kind.
fn scales(of: &Row) -> Vec<f64> {
    let n = of.columns.len();
    let kind = |column: &Column| (column.dimension.without_angle(), column.is_input());
    let scale = |at: usize| {
        let line = of.columns.iter().zip(&of.exact[at / n * n..]);
        let alike = line.filter(|(column, _)| kind(column) == kind(&of.columns[at % n]));
        alike.fold(0.0_f64, |most, (_, derivative)| most.max(derivative.abs()))
    };
    (0..of.exact.len()).map(scale).collect()
}

impl Seen {
    /// An entry, in reported units.
    fn derivative(&self, batch: &Batch, block: &Block, at: usize, value: f64) -> WorstDerivative {
        let units = &batch.problem.program.units;
        let n = self.row.columns.len();
        let (residual, column) = (&block.measurement.residuals[at / n], &self.row.columns[at % n]);
        let factor = units.to_reported(1.0, residual.dimension) / units.to_reported(1.0, column.dimension);
        let point = &batch.points[self.point];
        let number = |of: &Column| (of.name.clone(), units.to_reported(of.value(&self.row, point), of.dimension));
        WorstDerivative {
            residual: residual.name.clone(),
            by: column.name.clone(),
            value: value * factor,
            exact: self.row.exact[at] * factor,
            at: self.row.columns.iter().map(number).collect(),
        }
    }
}
