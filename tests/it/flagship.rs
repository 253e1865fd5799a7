//! The flagship against the oracle and against the paper's own formulas.

use phical::compile::{Program, compile};
use phical::data::Table;
use phical::diag::Source;
use phical::model::load;
use phical::problem::{Options, Problem, Selection};

use crate::close::close;
use crate::shared::{numbers, project, shared_json};

pub fn program(path: &str) -> Program {
    let source = Source::read(&project(path)).expect("the model is there");
    let (model, _) = load(&source).expect("it reads");
    compile(&model, &source, &[]).expect("it compiles").0
}

#[test]
fn the_oracle_agrees_at_all_points() {
    let Some(oracle) = shared_json("reference/two_theodolite_oracle.json") else { return };
    let program = program("models/two_theodolite/model.ron");
    let names: Vec<&str> = oracle["parameters"].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
    let readings: Vec<f64> = oracle["rows"].as_array().unwrap().iter().flat_map(numbers).collect();
    let table = Table { width: 9, readings, keys: Vec::new() };
    let selection = Selection { free: vec!["L1.b".into()], ..Selection::default() };
    let options = Options { selection, ..Options::default() };
    let (problem, _) = Problem::bind(&program, vec![(0, table)], &options).unwrap();
    let free: Vec<&str> = problem.free.iter().map(|&c| problem.layout.coordinates[c].name.as_str()).collect();
    assert_eq!(free, names);
    let residuals: Vec<&str> = program.measurements[0].residuals.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(residuals, ["vo.x", "vo.y", "vo.z", "kci1", "kci2"]);
    for (point, at) in oracle["at"].as_object().unwrap() {
        let q = numbers(&at["q"]);
        let block = &problem.blocks[0];
        let mut rows = 0;
        block
            .jacobians(&problem.layout, &q, &problem.places(), None, |row| {
                close(row.residuals, &numbers(&at["r"][row.row]), 1e-11, &format!("{point} r {}", row.row));
                let expected: Vec<f64> = at["dr_dq"][row.row].as_array().unwrap().iter().flat_map(numbers).collect();
                close(row.derivatives, &expected, 1e-11, &format!("{point} dr/dq {}", row.row));
                rows += 1;
                Ok(())
            })
            .unwrap();
        block.input_jacobians(&problem.layout, &q, |row, evaluate| {
            let (mut values, mut derivatives) = (vec![0.0; 5], vec![0.0; 45]);
            evaluate(block.table.row(row), &mut values, &mut derivatives);
            let expected: Vec<f64> = at["dr_dx"][row].as_array().unwrap().iter().flat_map(numbers).collect();
            close(&derivatives, &expected, 1e-11, &format!("{point} dr/dx {row}"));
            rows += 1;
        });
        assert_eq!(rows, 24);
    }
}
