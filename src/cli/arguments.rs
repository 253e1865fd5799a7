//! Arguments that several subcommands share, and how they are read.

use clap::{Args, ValueEnum};

use crate::compile::{LossOf, Robust, Scenario};
use crate::diag::{Code, Diagnostic, Diagnostics, did_you_mean};
use crate::problem::{Selection, Weights};
use crate::session::{Session, Values};
use crate::statistics::{Kernel, Loss};

/// A file for a measurement: `M=FILE`.
pub(super) fn data(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, file)) if !name.is_empty() && !file.is_empty() => Ok((name.to_owned(), file.to_owned())),
        _ => Err("write MEASUREMENT=FILE, such as vo_line=lines.csv".into()),
    }
}

/// A number of rows for a measurement: `M=N`.
pub(super) fn rows(text: &str) -> Result<(String, usize), String> {
    let wanted = || "write MEASUREMENT=NUMBER, such as vo_line=300".to_owned();
    let (name, number) = text.split_once('=').filter(|(name, _)| !name.is_empty()).ok_or_else(wanted)?;
    number.trim().parse().map(|number| (name.to_owned(), number)).map_err(|_| wanted())
}

/// A scenario, or else the first, and how many rows its measurements get by their numbers.
pub(super) fn scenario_rows<'s>(
    session: &'s Session,
    name: Option<&str>,
    rows: &[(String, usize)],
    mistakes: &mut Diagnostics,
) -> Option<(&'s Scenario, Vec<(usize, usize)>)> {
    let scenario = collect(session.scenario(name), mistakes);
    let mut numbers = Vec::new();
    for (name, number) in rows {
        let Some(index) = collect(session.measurement(name), mistakes) else { continue };
        numbers.push((index, *number));
        let Some(scenario) = scenario else { continue };
        if scenario.measurements.iter().all(|simulated| simulated.measurement != index) {
            let message = format!("the scenario `{}` has no measurement `{name}`", scenario.name);
            mistakes.push(Diagnostic::error(Code::UnknownMeasurement, message));
        }
    }
    Some((scenario?, numbers))
}

/// A parameter, and the value it is held at: `P` or `P=V`. A member's key may contain the sign, as in `socket[a=b].x=1`.
pub(super) fn fix(text: &str) -> Result<(String, Option<String>), String> {
    let (_, rest) = text.split_at(text.rfind(']').unwrap_or(0));
    let value = rest.split_once('=').map(|(_, value)| value);
    let without_value = |value: &str| text.strip_suffix(value)?.strip_suffix('=');
    let name = value.and_then(without_value).unwrap_or(text);
    if name.is_empty() || value.is_some_and(|value| value.trim().is_empty()) {
        return Err("write PARAMETER or PARAMETER=VALUE, such as L1.b=\"0.2 mm\"".into());
    }
    Ok((name.to_owned(), value.map(str::to_owned)))
}

/// What is freed and what is held.
#[derive(Debug, Args)]
pub(super) struct Chosen {
    /// Hold a parameter, or a member or all of a family: at a value with its unit, or else where it starts
    #[arg(long, value_name = "P[=V]", value_parser = fix)]
    pub(super) fix: Vec<(String, Option<String>)>,
    /// Release a parameter that the model holds
    #[arg(long, value_name = "P")]
    pub(super) free: Vec<String>,
}

impl Chosen {
    pub(super) fn selection(&self, start: Option<&Values>) -> Selection {
        let start = start.map(|values| values.values.clone()).unwrap_or_default();
        Selection { fix: self.fix.clone(), free: self.free.clone(), start }
    }
}

/// How residuals are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Weighting {
    /// all alike
    Unit,
    /// by the declared sigmas of the residuals
    Sigma,
    /// by the declared sigmas of the inputs, and of the residuals: errors in variables
    Propagated,
}

impl Weighting {
    pub(super) fn weights(self) -> Weights {
        match self {
            Weighting::Unit => Weights::Unit,
            Weighting::Sigma => Weights::Sigma,
            Weighting::Propagated => Weights::Propagated,
        }
    }
}

/// What large residuals count.
#[derive(Debug, Args)]
pub(super) struct Robustness {
    /// What large residuals count, perhaps with its tuning constant, such as huber or tukey:4.685 [default: their squares]
    #[arg(long, value_name = "NAME[:K]")]
    pub(super) loss: Option<String>,
    /// Of what it is a function
    #[arg(long, value_enum, default_value_t = LossOfArgument::Row, requires = "loss")]
    loss_of: LossOfArgument,
    /// By which scale it measures them
    #[arg(long, value_enum, default_value_t = LossScale::Declared, requires = "loss")]
    loss_scale: LossScale,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LossOfArgument {
    /// all residuals of a row together
    Row,
    /// each corrected input
    Input,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LossScale {
    /// the declared standard deviations
    Declared,
    /// the middle of the residuals
    Estimated,
}

impl Robustness {
    pub(super) fn robust(&self) -> Result<Option<Robust>, Box<Diagnostic>> {
        let Some(text) = &self.loss else { return Ok(None) };
        let (name, tuning) = match text.split_once(':') {
            Some((name, tuning)) => (name, Some(tuning)),
            None => (text.as_str(), None),
        };
        let names: Vec<&str> = Kernel::ALL.iter().map(|kernel| kernel.name()).collect();
        let kernel = Kernel::from_name(name).ok_or_else(|| {
            let found = Diagnostic::error(Code::UnknownVariant, format!("there is no loss `{name}`"));
            Box::new(found.maybe_hint(did_you_mean(name, "losses", &names)))
        })?;
        let wrong =
            |why: String| Box::new(Diagnostic::error(Code::NotPositive, why).hint("write it as in `huber:1.345`"));
        let tuning = match tuning {
            Some(text) => Some(text.parse::<f64>().map_err(|_| wrong(format!("`{text}` is not a number")))?),
            None => None,
        };
        let loss = Loss::new(kernel, tuning).map_err(|error| wrong(error.to_string()))?;
        let of = match self.loss_of {
            LossOfArgument::Row => LossOf::Row,
            LossOfArgument::Input => LossOf::Input,
        };
        Ok(Some(Robust { loss, of, estimated: self.loss_scale == LossScale::Estimated }))
    }
}

/// The value, or its mistake among the others.
pub(super) fn collect<T>(found: Result<T, Box<Diagnostic>>, mistakes: &mut Diagnostics) -> Option<T> {
    found.map_err(|mistake| mistakes.push(*mistake)).ok()
}

/// A number of threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    /// Machines have fewer cores, and each thread takes memory.
    const MOST: usize = 1024;
    text.parse().ok().filter(|threads| *threads <= MOST).ok_or_else(|| format!("write a number up to {MOST}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs() {
        assert_eq!(data("m=a=b.csv"), Ok(("m".into(), "a=b.csv".into())));
        assert!(data("m").is_err() && data("=f").is_err() && data("m=").is_err());
        assert_eq!(rows("m=12"), Ok(("m".into(), 12)));
        assert!(rows("m=-1").is_err() && rows("m").is_err() && rows("m=1.5").is_err());
    }

    #[test]
    fn a_fixed_parameter_with_and_without_value() {
        assert_eq!(fix("L1.b"), Ok(("L1.b".into(), None)));
        assert_eq!(fix("L1.b=0.2 mm"), Ok(("L1.b".into(), Some("0.2 mm".into()))));
        assert_eq!(fix("s[a=b].x=1"), Ok(("s[a=b].x".into(), Some("1".into()))));
        assert_eq!(fix("s[a=b]"), Ok(("s[a=b]".into(), None)));
        assert!(fix("=1").is_err() && fix("").is_err() && fix("a= ").is_err());
    }
}
