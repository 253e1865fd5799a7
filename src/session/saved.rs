//! The state of a sequential fit as a JSON file: points and matrices by names, rows with their readings. Numbers are in internal
//! units and round-trip exactly.

use serde_json::{Map, Value, json};

use super::Session;
use crate::data::Table;
use crate::diag::{Code, DataPlace, Diagnostic, Source};
use crate::linalg::{LinalgError, Matrix, SquareRootInformation};
use crate::problem::Problem;
use crate::solve::{Absorbed, Keep, SequentialState, Settings};

/// What is known after some rows of a [`Problem`].
pub type State = SequentialState<Vec<f64>, (usize, usize)>;

/// What the file calls itself.
const KIND: &str = "phical state";

/// Values of coordinates by name.
type Point = Vec<(String, f64)>;

/// Whether a row is kept, and where it went: its table and its number there.
pub(super) type Placed = (bool, (usize, usize));

/// A state as its file has it.
#[derive(Clone, Debug)]
pub(super) struct Saved {
    /// The file, as given.
    pub(super) file: String,
    pub(super) weights: String,
    loss: Option<String>,
    free: Vec<String>,
    start: Point,
    estimate: Point,
    absorbed: Option<Absorbed<Point>>,
    /// by measurement: whether a row is kept or witnesses, its names and its readings
    rows: Vec<(String, Vec<Row>)>,
}

#[derive(Clone, Debug)]
struct Row {
    kept: bool,
    names: Vec<String>,
    readings: Vec<f64>,
}

/// The JSON of a state.
pub(super) fn state_json(session: &Session, problem: &Problem, state: &State) -> Value {
    let named = |point: &[f64]| -> Map<String, Value> {
        problem.layout.coordinates.iter().zip(point).map(|(c, value)| (c.name.clone(), json!(value))).collect()
    };
    let free: Vec<&str> = problem.free_coordinates().map(|c| c.name.as_str()).collect();
    let row = |kept: bool, table: &Table, row: usize| {
        let names: Vec<&str> = (0..table.keys()).map(|k| table.key(row, k)).collect();
        json!({ "kept": kept, "names": names, "readings": table.row(row).to_vec() })
    };
    let mut rows = Map::new();
    for (of, block) in problem.blocks.iter().enumerate() {
        let kept = state.kept().iter().filter(|(block, _)| *block == of).map(|(_, at)| row(true, &block.table, *at));
        let witnesses =
            state.witnesses().iter().filter(|(block, _)| *block == of).map(|(_, at)| row(false, &block.table, *at));
        rows.insert(block.measurement.name.clone(), json!(witnesses.chain(kept).collect::<Vec<_>>()));
    }
    let absorbed = state.absorbed();
    let of = &absorbed.information;
    let entries: Vec<Vec<f64>> =
        (0..of.dimension()).map(|i| (0..of.dimension()).map(|j| of.r()[(i, j)]).collect()).collect();
    let absorbed = (of.rows() > 0).then(|| {
        json!({
            "point": named(&absorbed.point), "r": entries, "d": of.d(), "rest": of.rest(), "equations": of.rows(),
            "beyond": absorbed.beyond,
        })
    });
    json!({
        "kind": KIND,
        "version": env!("CARGO_PKG_VERSION"),
        "model_fingerprint": session.fingerprint,
        "weights": problem.weights.name(),
        "loss": problem.robust_name(),
        "keep": state.keep().name(),
        "free": free,
        "start": named(state.start()),
        "estimate": named(state.point()),
        "absorbed": absorbed,
        "rows": rows,
    })
}

/// A state that does not fit.
fn bad(file: &str, why: impl Into<String>, hint: &str) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(Code::BadState, why).at_data(DataPlace::file(file)).hint(hint))
}

const ANEW: &str = "write one with `calibrate --solver sequential --save FILE`";

impl Saved {
    /// Reads one, made of the session's model.
    pub(super) fn read(session: &Session, file: &str) -> Result<Saved, Box<Diagnostic>> {
        let source = Source::read(std::path::Path::new(file))?;
        let json: Value = serde_json::from_str(source.text())
            .map_err(|error| bad(file, format!("`{file}` is not JSON: {error}"), ANEW))?;
        if json.get("kind").and_then(Value::as_str) != Some(KIND) {
            return Err(bad(file, format!("`{file}` is not the state of a sequential fit"), ANEW));
        }
        if json.get("model_fingerprint").and_then(Value::as_str) != Some(&session.fingerprint) {
            let why = format!("`{file}` is the state of another model than `{}`", session.path.display());
            return Err(bad(file, why, "go on with the model file as it was, or begin anew from the data"));
        }
        Self::parse(file, &json).ok_or_else(|| bad(file, format!("something in `{file}` is missing or wrong"), ANEW))
    }

    fn parse(file: &str, json: &Value) -> Option<Saved> {
        let list = |value: &Value| -> Option<Vec<f64>> {
            value.as_array()?.iter().map(|x| x.as_f64().filter(|x| x.is_finite())).collect()
        };
        let texts = |value: &Value| -> Option<Vec<String>> {
            value.as_array()?.iter().map(|x| x.as_str().map(str::to_owned)).collect()
        };
        let point = |value: &Value| -> Option<Point> {
            value.as_object()?.iter().map(|(name, x)| Some((name.clone(), x.as_f64()?))).collect()
        };
        let absorbed = |value: &Value| -> Option<Absorbed<Point>> {
            let entries: Vec<Vec<f64>> = value.get("r")?.as_array()?.iter().map(list).collect::<Option<_>>()?;
            let n = entries.len();
            if entries.iter().any(|row| row.len() != n) {
                return None;
            }
            let rows = usize::try_from(value.get("equations")?.as_u64()?).ok()?;
            let (d, rest) = (list(value.get("d")?)?, value.get("rest")?.as_f64()?);
            let r = Matrix::from_rows(n, &entries);
            let information = SquareRootInformation::from_parts(r, d, rest, rows).ok()?;
            Some(Absorbed { point: point(value.get("point")?)?, information, beyond: value.get("beyond")?.as_f64()? })
        };
        let row = |value: &Value| {
            let (names, readings) = (texts(value.get("names")?)?, list(value.get("readings")?)?);
            Some(Row { kept: value.get("kept")?.as_bool()?, names, readings })
        };
        let rows = |(name, all): (&String, &Value)| {
            Some((name.clone(), all.as_array()?.iter().map(row).collect::<Option<Vec<_>>>()?))
        };
        let saved = Saved {
            file: file.to_owned(),
            weights: json.get("weights")?.as_str()?.to_owned(),
            loss: json.get("loss")?.as_str().map(str::to_owned),
            free: texts(json.get("free")?)?,
            start: point(json.get("start")?)?,
            estimate: point(json.get("estimate")?)?,
            absorbed: match json.get("absorbed")? {
                Value::Null => None,
                value => Some(absorbed(value)?),
            },
            rows: json.get("rows")?.as_object()?.iter().map(rows).collect::<Option<_>>()?,
        };
        let fits = saved.absorbed.as_ref().is_none_or(|a| a.information.dimension() == saved.free.len());
        fits.then_some(saved)
    }

    /// Its rows, added to tables by measurement number; gives where those that are kept, and those that witness, went.
    pub(super) fn take_rows(
        &self,
        session: &Session,
        tables: &mut Vec<(usize, Table)>,
    ) -> Result<Vec<Placed>, Box<Diagnostic>> {
        let mut places = Vec::new();
        for (name, rows) in self.rows.iter().filter(|(_, rows)| !rows.is_empty()) {
            let index = session.measurement(name)?;
            let declared = session.program.measurement(index)?;
            let (keys, inputs) = (declared.keys.len(), declared.inputs.len());
            if rows.iter().any(|row| row.names.len() != keys || row.readings.len() != inputs) {
                return Err(bad(&self.file, format!("rows of `{name}` have not as many numbers as the model"), ANEW));
            }
            let (block, table) = super::sequential::table_of(tables, index, declared);
            table.begin(&self.file);
            for row in rows {
                table.put(row.names.iter().map(String::as_str), &row.readings, None);
                places.push((row.kept, (block, table.rows() - 1)));
            }
        }
        Ok(places)
    }

    /// The state of a problem that has its rows.
    pub(super) fn state(&self, problem: &Problem, keep: Keep, places: &[Placed]) -> Result<State, Box<Diagnostic>> {
        let hint = "resume with the same `--weights`, `--loss`, `--fix` and `--free`";
        if self.weights != problem.weights.name() || self.loss != problem.robust_name() {
            let of = |weights: &str, loss: &Option<String>| match loss {
                Some(loss) => format!("{weights} with {loss}"),
                None => weights.to_owned(),
            };
            let (then, now) = (of(&self.weights, &self.loss), of(problem.weights.name(), &problem.robust_name()));
            return Err(bad(&self.file, format!("its weights were {then}, and are {now}"), hint));
        }
        let known = |name: &&str| self.start.iter().any(|(known, _)| known == name);
        let now: Vec<&str> = problem.free_coordinates().map(|c| c.name.as_str()).filter(known).collect();
        let differs = now.iter().find(|name| !self.free.iter().any(|free| free == *name));
        let differs =
            differs.copied().or_else(|| self.free.iter().map(String::as_str).find(|free| !now.contains(free)));
        if let Some(name) = differs {
            return Err(bad(&self.file, format!("`{name}` was free and is held, or the other way round"), hint));
        }
        let point = |from: &Point| {
            let mut point = problem.start.clone();
            for (name, value) in from {
                if let Some(known) = problem.layout.find(name).and_then(|c| point.get_mut(c)) {
                    *known = *value;
                }
            }
            point
        };
        let n = problem.free.len();
        let places_of_free = problem.places();
        let absorbed = match &self.absorbed {
            None => Absorbed::new(point(&self.start), n),
            Some(found) => {
                // a coordinate that is not free has no column: the factor refuses one beyond all
                let column =
                    |name: &String| problem.layout.find(name).and_then(|c| *places_of_free.get(c)?).unwrap_or(n);
                let columns: Vec<usize> = self.free.iter().map(column).collect();
                let information = found.information.embedded(n, &columns);
                let wrong = |error: LinalgError| bad(&self.file, error.to_string(), ANEW);
                Absorbed { point: point(&found.point), information: information.map_err(wrong)?, beyond: found.beyond }
            }
        };
        let of = |wanted: bool| places.iter().filter(|(kept, _)| *kept == wanted).map(|(_, row)| *row).collect();
        let points = (point(&self.start), point(&self.estimate));
        Ok(State::from_parts(points, (keep, Settings::default()), (of(true), of(false)), absorbed))
    }
}
