//! Code, and what its arguments mean.

use serde_json::{Map, Value, json};

use crate::emit::{Emitted, Language, Number, Routine};

/// The code and what its arguments mean: of one measurement as it is, of several by name under `measurements`.
pub fn emitted_json(emitted: &Emitted, language: Language) -> Value {
    let mut all = Map::new();
    all.insert("language".into(), json!(language.name()));
    all.insert("code".into(), json!(emitted.code));
    match emitted.routines.as_slice() {
        [one] => all.extend(of_routine(one)),
        several => {
            let each: Map<String, Value> =
                several.iter().map(|one| (one.measurement.clone(), Value::Object(of_routine(one)))).collect();
            all.insert("measurements".into(), Value::Object(each));
        }
    }
    Value::Object(all)
}

fn of_routine(routine: &Routine) -> Map<String, Value> {
    let numbers = |all: &[Number]| {
        let each = all.iter().map(|number| json!({ "name": number.name, "unit": number.unit }));
        Value::Array(each.collect())
    };
    let (prepare, functions) = routine.operations();
    let per_row: Map<String, Value> = functions.into_iter().map(|(name, count)| (name.into(), json!(count))).collect();
    let entries = [
        ("measurement", json!(routine.measurement)),
        ("parameters", numbers(&routine.parameters)),
        ("columns", json!(routine.columns)),
        ("inputs", numbers(&routine.inputs)),
        ("members", numbers(&routine.members)),
        ("member_columns", json!(routine.member_columns)),
        ("residuals", numbers(&routine.residuals)),
        ("operations", json!({ "prepare": prepare, "per_row": per_row })),
    ];
    entries.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}
