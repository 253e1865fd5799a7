//! The nonlinear regression sets of NIST's Statistical Reference Datasets that the project ships as models, against their
//! certified values, from both of their starts.

use phical::compile::compile;
use phical::data::read;
use phical::diag::{Diagnostics, Source};
use phical::fit::{Fit, read_values};
use phical::model::load;
use phical::problem::Selection;
use phical::solve::Conic;

use crate::close::digits;
use crate::fitting::{bound, fit, fit_by};
use crate::shared::{numbers, project, shared_json};

/// Digits that the issue asks of parameters and of standard deviations.
const PARAMETERS: f64 = 7.0;
const DEVIATIONS: f64 = 6.0;
/// The sum of squares is certified to eleven digits, and flat at its minimum.
const SUM_OF_SQUARES: f64 = 9.0;

/// Fits a shipped set from its nominal values, or from the second start that lies beside it.
fn fit_set(name: &str, second_start: bool, conic: bool) -> Fit {
    let folder = project("models/nist").join(name);
    let text = |file: &str| std::fs::read_to_string(folder.join(file)).expect("the set is shipped");
    let source = Source::new("model.ron", text("model.ron"));
    let (model, _) = load(&source).expect("a right model");
    let (program, _) = compile(&model, &source, &[]).expect("a right model");
    let mut found = Diagnostics::new();
    let table = read(&program, 0, &program.measurements[0].data, &folder, &mut found).expect("readable data");
    let start = match second_start {
        true => read_values("start2.json", &text("start2.json")).expect("values"),
        false => vec![],
    };
    let problem = bound(&program, &[table], Selection { start, ..Selection::default() }, None);
    if conic { fit_by(&problem, &Conic::default()) } else { fit(&problem) }
}

/// All orders of three terms of two parameters each.
const TERMS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The worst digits of parameters and of standard deviations; a missing standard deviation has none.
fn worst(fit: &Fit, values: &[f64], deviations: &[f64], order: &[usize]) -> (f64, f64) {
    assert_eq!(fit.parameters.len(), values.len());
    let least = |found: &dyn Fn(usize) -> Option<f64>, expected: &[f64]| {
        let each = order.iter().enumerate().map(|(i, &j)| found(j).map_or(0.0, |found| digits(found, expected[i])));
        each.fold(f64::INFINITY, f64::min)
    };
    (least(&|j| Some(fit.parameters[j].value), values), least(&|j| fit.parameters[j].sigma, deviations))
}

#[test]
fn all_sets_from_both_starts() {
    let Some(certified) = shared_json("data/nist_strd/certified.json") else { return };
    let sets = certified.as_array().expect("a list");
    assert_eq!(sets.len(), 15);
    let mut short = Vec::new();
    for set in sets {
        let name = set["name"].as_str().expect("a name");
        let (values, deviations) = (numbers(&set["certified"]), numbers(&set["certified_sd"]));
        let sum_of_squares = set["rss"].as_f64().expect("a number");
        for (second, conic) in [(false, false), (true, false), (false, true), (true, true)] {
            let fit = fit_set(name, second, conic);
            let straight: Vec<usize> = (0..values.len()).collect();
            let orders: Vec<Vec<usize>> = match name.starts_with("Lanczos") {
                true => TERMS.iter().map(|terms| terms.iter().flat_map(|t| [2 * t, 2 * t + 1]).collect()).collect(),
                false => vec![straight],
            };
            let all = orders.iter().map(|order| worst(&fit, &values, &deviations, order));
            let (of_values, of_deviations) = all.max_by(|a, b| a.0.total_cmp(&b.0)).expect("an order");
            let of_sum = digits(fit.sum_of_squares, sum_of_squares);
            // the data of Lanczos1 are exact, so its residuals are rounding
            let rounding = name == "Lanczos1";
            let good = fit.status.converged()
                && of_values >= PARAMETERS
                && (rounding || of_deviations >= DEVIATIONS)
                && (rounding || of_sum >= SUM_OF_SQUARES);
            let line = format!(
                "{name} start {} by {}: {} after {} iterations; digits {of_values:.1}, sd {of_deviations:.1}, sum {of_sum:.1}",
                if second { 2 } else { 1 },
                if conic { "conic steps" } else { "LM" },
                fit.status.name(),
                fit.iterations
            );
            eprintln!("{line}");
            if !good {
                short.push(line);
            }
        }
    }
    assert!(short.is_empty(), "{short:#?}");
}
