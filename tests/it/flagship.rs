//! The flagship against the oracle.

use phical::compile::Program;
use phical::data::Table;
use phical::problem::{Options, Problem, Selection, Weights};

use crate::close::close;
use crate::shared::{numbers, project, shared_json};

/// A compiled model from its text.
#[track_caller]
pub fn compiled(text: &str) -> Program {
    phical::testing::program(text)
}

/// The shipped flagship.
pub struct Flagship(pub Program);

pub fn flagship() -> Flagship {
    let text = std::fs::read_to_string(project("models/two_theodolite/model.ron")).expect("the model is there");
    Flagship(compiled(&text))
}

/// The paper's readings; the inputs after them are the tilts of the bar, zero where nothing is said.
pub const READINGS: usize = 9;

impl Flagship {
    /// How many inputs a line has.
    pub fn width(&self) -> usize {
        self.0.measurements[0].inputs.len()
    }

    /// The paper's 21 parameters on rows of nine readings, with the paper's weights.
    pub fn bound(&self, rows: &[f64]) -> Problem<'_> {
        let mut table = Table::new(0, self.width());
        for row in rows.chunks(READINGS) {
            let mut all = row.to_vec();
            all.resize(self.width(), 0.0);
            table.push(&[], &all, None).expect("a row of the table");
        }
        let selection = Selection { free: vec!["L1.b".into()], ..Selection::default() };
        let options = Options { weights: Some(Weights::Unit), selection, ..Options::default() };
        Problem::bind(&self.0, vec![(0, table)], &options).expect("it binds").0
    }
}

/// The oracle's rows and its parameter points.
pub fn oracle_rows() -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let oracle = shared_json("reference/two_theodolite_oracle.json")?;
    let rows = oracle["rows"].as_array()?.iter().flat_map(numbers).collect();
    Some((rows, oracle["at"].as_object()?.values().map(|at| numbers(&at["q"])).collect()))
}

#[test]
fn the_oracle_agrees_at_all_points() {
    let Some(oracle) = shared_json("reference/two_theodolite_oracle.json") else { return };
    let Some((rows, _)) = oracle_rows() else { return };
    let flagship = flagship();
    let problem = flagship.bound(&rows);
    let names: Vec<&str> = oracle["parameters"].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
    let free: Vec<&str> = problem.free.iter().map(|&c| problem.layout.coordinates[c].name.as_str()).collect();
    assert_eq!(free, names);
    let residuals: Vec<&str> = flagship.0.measurements[0].residuals.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(residuals, ["vo.x", "vo.y", "vo.z", "kci1", "kci2"]);
    let inputs: Vec<&str> = flagship.0.measurements[0].inputs.iter().map(|input| input.name.as_str()).collect();
    let readings: Vec<&str> = oracle["inputs"].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
    assert_eq!(inputs[..READINGS], readings);
    let flat = |value: &serde_json::Value| value.as_array().unwrap().iter().flat_map(numbers).collect::<Vec<f64>>();
    let (block, width) = (&problem.blocks[0], flagship.width());
    let mut seen = 0;
    for (point, at) in oracle["at"].as_object().unwrap() {
        let q = numbers(&at["q"]);
        block
            .jacobians(&problem.layout, &q, &problem.places(), |row| {
                close(row.residuals, &numbers(&at["r"][row.row]), 1e-11, &format!("{point} r {}", row.row));
                close(row.derivatives, &flat(&at["dr_dq"][row.row]), 1e-11, &format!("{point} dr/dq {}", row.row));
                seen += 1;
                Ok(())
            })
            .unwrap();
        block
            .input_jacobians(&problem.layout, &q, |row, evaluate| {
                let (mut values, mut derivatives) = (vec![0.0; 5], vec![0.0; 5 * width]);
                evaluate(&block.table.row(row), &mut values, &mut derivatives);
                let readings: Vec<f64> = derivatives.chunks(width).flat_map(|of| &of[..READINGS]).copied().collect();
                close(&readings, &flat(&at["dr_dx"][row]), 1e-11, &format!("{point} dr/dx {row}"));
                // p1 − p2 − length · direction: a bar that leans moves its upper end
                let length = block.table.row(row)[READINGS - 1];
                let tilts: Vec<f64> = derivatives.chunks(width).flat_map(|of| &of[READINGS..]).copied().collect();
                close(&tilts, &[-length, 0.0, 0.0, -length, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-15, "tilts");
                seen += 1;
            })
            .expect("a point of the problem");
    }
    assert_eq!(seen, 4 * 24);
}
