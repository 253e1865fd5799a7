//! How well parameters are known together: taken from a fit, or read back from its file.

use serde_json::{Map, Value};

use super::estimate::Fit;
use super::file::wrong;
use crate::diag::Diagnostic;

/// The joint uncertainty of the parameters that a fit estimated, in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct JointUncertainty {
    /// The parameters that were free.
    pub names: Vec<String>,
    /// Their covariance, that of the minimum-norm datum where not all are estimable; none where nothing tells the scale.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// What counts as known well enough of each.
    pub tolerances: Vec<f64>,
    /// Which are on one of their bounds.
    pub on_bound: Vec<bool>,
    /// What nothing determines: tolerance-scaled unit vectors.
    pub null_directions: Vec<Vec<f64>>,
    /// The degrees of freedom of the scale of the covariance; infinite where it is declared.
    pub dof: f64,
}

/// What a file of values says of their uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub enum Stated {
    /// how well the values are known
    Known(JointUncertainty),
    /// nothing, and why
    Unknown(String),
}

/// How far two halves of a covariance may differ, in standard deviations: they were rounded one by one.
const ASYMMETRY: f64 = 1e-9;

impl JointUncertainty {
    /// Whether everything is said of each of the names.
    pub(crate) fn is_complete(&self) -> bool {
        let n = self.names.len();
        let of_all = |row: &Vec<f64>| row.len() == n;
        self.tolerances.len() == n
            && self.on_bound.len() == n
            && self.null_directions.iter().all(of_all)
            && self.covariance.as_ref().is_none_or(|all| all.len() == n && all.iter().all(of_all))
    }

    /// That of a fit in memory.
    pub fn of(fit: &Fit) -> JointUncertainty {
        let names: Vec<String> = fit.parameters.iter().map(|p| p.name.clone()).collect();
        let factor: Vec<f64> = fit.parameters.iter().map(|p| p.reported).collect();
        let row = |(i, row): (usize, &Vec<f64>)| row.iter().zip(&factor).map(|(x, f)| x * f * factor[i]).collect();
        let covariance = fit.covariance.as_ref().map(|c| c.entries.iter().enumerate().map(row).collect());
        let direction = |of: &Vec<(String, f64)>| {
            let weight = |name: &String| of.iter().find(|(known, _)| known == name).map_or(0.0, |(_, weight)| *weight);
            names.iter().map(weight).collect()
        };
        JointUncertainty {
            covariance,
            tolerances: fit.parameters.iter().map(|p| p.tolerance).collect(),
            on_bound: fit.parameters.iter().map(|p| p.at_bound).collect(),
            null_directions: fit.null_directions.iter().map(direction).collect(),
            dof: fit.confidence.dof.map_or(f64::INFINITY, |dof| dof as f64),
            names,
        }
    }
}

impl Stated {
    /// What a fit file, or an object of name and value, says.
    ///
    /// # Errors
    /// Where it says something that cannot be: a covariance of another size, of parameters that the fit has not, or such as no
    /// errors have.
    pub fn read(file: &str, json: &Value) -> Result<Stated, Box<Diagnostic>> {
        let unknown = |why: &str| Ok(Stated::Unknown(why.to_owned()));
        let Some(parameters) = json.get("parameters").and_then(Value::as_array) else {
            return unknown("the file states values, and not how well they are known");
        };
        let covariance = match json.get("covariance") {
            None => return unknown("the fit says nothing of its covariance; write it anew with `calibrate --out`"),
            Some(Value::Null) => return unknown("nothing tells the fit how large errors are"),
            Some(covariance) => covariance,
        };
        if json.get("converged").and_then(Value::as_bool) == Some(false) {
            return unknown("the fit did not converge");
        }
        let reader = Reader { file };
        let names = reader.names(parameters)?;
        let tolerances =
            parameters.iter().zip(&names).map(|(p, name)| reader.tolerance(p, name)).collect::<Result<_, _>>()?;
        let on_bound = parameters.iter().zip(&names).map(|(p, name)| {
            let on = p.get("at_bound").and_then(Value::as_bool);
            on.ok_or_else(|| wrong(file, format!("`{name}` does not say whether it is `at_bound`")))
        });
        Ok(Stated::Known(JointUncertainty {
            on_bound: on_bound.collect::<Result<_, _>>()?,
            covariance: Some(reader.covariance(covariance, &names)?),
            null_directions: reader.null_directions(json, &names)?,
            dof: reader.dof(json)?,
            tolerances,
            names,
        }))
    }
}

/// Reads the parts of a file.
struct Reader<'a> {
    file: &'a str,
}

impl Reader<'_> {
    fn wrong<T>(&self, why: impl Into<String>) -> Result<T, Box<Diagnostic>> {
        Err(wrong(self.file, why.into()))
    }

    fn names(&self, parameters: &[Value]) -> Result<Vec<String>, Box<Diagnostic>> {
        let name = |value: &Value| value.get("name").and_then(Value::as_str).map(str::to_owned);
        let Some(names) = parameters.iter().map(name).collect::<Option<Vec<String>>>() else {
            return self.wrong("a parameter has no name");
        };
        match (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
            Some(twice) => self.wrong(format!("the parameter `{}` is there twice", names[twice])),
            None => Ok(names),
        }
    }

    fn tolerance(&self, parameter: &Value, name: &str) -> Result<f64, Box<Diagnostic>> {
        match parameter.get("tolerance").and_then(Value::as_f64) {
            Some(tolerance) if tolerance > 0.0 && tolerance.is_finite() => Ok(tolerance),
            _ => self.wrong(format!("the tolerance of `{name}` is not a positive number")),
        }
    }

    /// The place of a name among those of the parameters.
    fn place(&self, names: &[String], name: &str, what: &str) -> Result<usize, Box<Diagnostic>> {
        match names.iter().position(|known| known == name) {
            Some(place) => Ok(place),
            None => self.wrong(format!("{what} names `{name}`, which is not among the parameters of the fit")),
        }
    }

    /// The matrix, in the order of the parameters.
    fn covariance(&self, value: &Value, names: &[String]) -> Result<Vec<Vec<f64>>, Box<Diagnostic>> {
        let n = names.len();
        let list = |of: &Value, key: &str| of.get(key).and_then(Value::as_array).cloned();
        let (Some(own), Some(rows)) = (list(value, "names"), list(value, "matrix")) else {
            return self.wrong("the covariance has no `names` and `matrix`");
        };
        if own.len() != n || rows.len() != n || rows.iter().any(|row| row.as_array().map_or(0, Vec::len) != n) {
            let message = format!("the covariance is not one of {n} parameters, each of which it names once");
            return self.wrong(message);
        }
        let mut at = Vec::with_capacity(n);
        for name in &own {
            let place = self.place(names, name.as_str().unwrap_or_default(), "the covariance")?;
            if at.contains(&place) {
                return self.wrong(format!("the covariance names `{}` twice", names[place]));
            }
            at.push(place);
        }
        let mut matrix = vec![vec![0.0; n]; n];
        for (row, &i) in rows.iter().zip(&at) {
            for (entry, &j) in row.as_array().into_iter().flatten().zip(&at) {
                match entry.as_f64() {
                    Some(entry) if entry.is_finite() => matrix[i][j] = entry,
                    _ => {
                        let message = format!("the covariance of `{}` and `{}` is not a number", names[i], names[j]);
                        return self.wrong(message);
                    }
                }
            }
        }
        for i in 0..n {
            if matrix[i][i] < 0.0 {
                return self.wrong(format!("the variance of `{}` is negative", names[i]));
            }
            for j in 0..i {
                let both = (matrix[i][i] * matrix[j][j]).sqrt();
                let (one, other) = (matrix[i][j], matrix[j][i]);
                if (one - other).abs() > ASYMMETRY * both || one.abs() > (1.0 + ASYMMETRY) * both {
                    let message = format!("no errors have the covariance of `{}` and `{}`", names[j], names[i]);
                    return self.wrong(message);
                }
            }
        }
        Ok(matrix)
    }

    fn null_directions(&self, json: &Value, names: &[String]) -> Result<Vec<Vec<f64>>, Box<Diagnostic>> {
        let Some(all) = json.get("null_directions").and_then(Value::as_array) else {
            return self.wrong("the fit does not say which directions are not determined");
        };
        let direction = |value: &Value| {
            let Some(combination) = value.get("combination").and_then(Value::as_object) else {
                return self.wrong("a null direction has no `combination`");
            };
            self.weights(combination, names)
        };
        all.iter().map(direction).collect()
    }

    fn weights(&self, combination: &Map<String, Value>, names: &[String]) -> Result<Vec<f64>, Box<Diagnostic>> {
        let mut weights = vec![0.0; names.len()];
        for (name, weight) in combination {
            match weight.as_f64() {
                Some(weight) if weight.is_finite() => weights[self.place(names, name, "a null direction")?] = weight,
                _ => return self.wrong(format!("the weight of `{name}` in a null direction is not a number")),
            }
        }
        Ok(weights)
    }

    fn dof(&self, json: &Value) -> Result<f64, Box<Diagnostic>> {
        match json.get("confidence").and_then(|confidence| confidence.get("dof")) {
            Some(Value::Null) => Ok(f64::INFINITY),
            Some(dof) if dof.as_f64().is_some_and(|dof| dof > 0.0) => Ok(dof.as_f64().unwrap_or(f64::INFINITY)),
            _ => self.wrong("the fit does not say with how many degrees of freedom it knows the size of errors"),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn fit() -> Value {
        let parameter = |name: &str| json!({"name": name, "value": 1, "tolerance": 0.1, "at_bound": false});
        json!({
            "parameters": [parameter("a"), parameter("b")],
            "covariance": {"names": ["b", "a"], "matrix": [[4.0, 1.0], [1.0, 9.0]]},
            "null_directions": [{"combination": {"b": 1.0}}],
            "confidence": {"level": 0.95, "dof": 7},
        })
    }

    #[test]
    fn it_is_read_in_the_order_of_the_parameters() {
        let Ok(Stated::Known(found)) = Stated::read("fit.json", &fit()) else { panic!("known") };
        assert_eq!(found.covariance, Some(vec![vec![9.0, 1.0], vec![1.0, 4.0]]));
        assert_eq!((found.null_directions, found.dof), (vec![vec![0.0, 1.0]], 7.0));
        assert_eq!((found.tolerances, found.on_bound), (vec![0.1; 2], vec![false; 2]));
    }

    #[test]
    fn what_cannot_be_is_refused_and_what_is_absent_is_unknown() {
        let with = |path: &str, value: Value| {
            let mut fit = fit();
            *fit.pointer_mut(path).expect("it is there") = value;
            Stated::read("fit.json", &fit)
        };
        let matrix = "/covariance/matrix";
        for (path, value) in [
            (matrix, json!([[4.0, 1.0]])),
            (matrix, json!([[4.0, 1.0], [1.0]])),
            (matrix, json!([[4.0, null], [1.0, 9.0]])),
            (matrix, json!([[4.0, 1.0], [2.0, 9.0]])),
            (matrix, json!([[4.0, 7.0], [7.0, 9.0]])),
            (matrix, json!([[-4.0, 0.0], [0.0, 9.0]])),
            (matrix, json!("none")),
            ("/covariance", json!(3)),
            ("/covariance/names", json!(["a", "c"])),
            ("/covariance/names", json!(["a", "a"])),
            ("/covariance/names", json!(["a", 1])),
            ("/parameters/0/tolerance", json!(0)),
            ("/parameters/0/at_bound", json!(null)),
            ("/parameters/0/name", json!("b")),
            ("/null_directions", json!(null)),
            ("/null_directions/0", json!([1])),
            ("/null_directions/0/combination", json!({"z": 1})),
            ("/null_directions/0/combination", json!({"a": "x"})),
            ("/confidence/dof", json!(0)),
            ("/confidence", json!({})),
        ] {
            assert!(with(path, value.clone()).is_err(), "{path} {value}");
        }
        assert!(matches!(with("/covariance", Value::Null), Ok(Stated::Unknown(_))));
        assert!(matches!(Stated::read("x", &json!({"a": 1})), Ok(Stated::Unknown(_))));
        assert!(matches!(Stated::read("x", &json!({"parameters": []})), Ok(Stated::Unknown(_))));
    }
}
