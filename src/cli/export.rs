//! `phical export MODEL --to dh|mdh|urdf`

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::import::Robots;
use super::{Format, Outcome};
use crate::data::{Output, Written};
use crate::diag::{Code, Diagnostic, Diagnostics, Source};
use crate::exchange::{ChainValues, Exported, Target, Urdf, chain_name, export};
use crate::fit::Stated;
use crate::session::{Session, Values};

#[derive(Debug, Args)]
pub(super) struct Export {
    /// The model file
    model: PathBuf,
    /// As what
    #[arg(long, value_name = "FORMAT", value_enum)]
    to: Robots,
    /// Which chain [default: the only one]
    #[arg(long, value_name = "NAME")]
    chain: Option<String>,
    /// Leave out the chain's joints up to this one, such as the place of the robot in the frame of a tracker
    #[arg(long, value_name = "JOINT")]
    after: Option<String>,
    /// The values: a fit, or a JSON object of name and value [default: the nominal values]
    #[arg(long, value_name = "FIT.json")]
    fit: Option<String>,
    /// Tables without Hayati's beta, however far the common normal of nearly parallel axes is
    #[arg(long)]
    plain: bool,
    /// The URDF that the numbers go into
    #[arg(long, value_name = "FILE.urdf")]
    urdf: Option<PathBuf>,
    /// The link of the URDF at which the chain begins [default: the root]
    #[arg(long, value_name = "LINK", alias = "from")]
    base: Option<String>,
    /// The link at which it ends [default: the only one without children]
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// Write to a file, and the covariance of its numbers, where a fit has one, to FILE.covariance.csv
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Export {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
        self.suit().map_err(refused)?;
        let session = Session::open(&self.model, &[])?;
        let chain = chain_name(&session, self.chain.as_deref()).map_err(refused)?;
        let values = self.fit.as_deref().map(Values::read).transpose().map_err(refused)?;
        let given = values.as_ref().map(|values| values.values.clone()).unwrap_or_default();
        let stated = values.as_ref().map(|values| values.uncertainty(&session)).transpose().map_err(refused)?;
        let chain = ChainValues::of(&session, &chain, self.after.as_deref(), &given)?;
        let known = match &stated {
            Some(Stated::Known(known)) => Some(known),
            _ => None,
        };
        let mut warnings = session.warnings.clone();
        if let Some(Stated::Unknown(why)) = &stated {
            let message = format!("the numbers have no uncertainty: {why}");
            warnings.push(Diagnostic::warning(Code::NoUncertainty, message));
        }
        let units = &session.program.units;
        let exported = match self.to.convention() {
            Some(convention) => export(&chain, units, Target::Table { convention, plain: self.plain }, known)?,
            None => {
                let path = self.urdf.clone().unwrap_or_default();
                let source = Source::read(&path).map_err(refused)?;
                let urdf = Urdf::read(&source)?;
                let path = urdf.path(self.base.as_deref(), self.tip.as_deref())?;
                export(&chain, units, Target::Urdf { urdf: &urdf, path: &path }, known)?
            }
        };
        let written = self.write(&exported)?;
        warnings.extend(exported.warnings.clone());
        let shown = || match written.is_empty() {
            true => exported.text.clone(),
            false => written.iter().map(|(file, what)| format!("{file} written: {what}\n")).collect(),
        };
        let files: Vec<&str> = written.iter().map(|(file, _)| file.as_str()).collect();
        Ok(Outcome::new(format, shown, || exported_json(&exported, &chain, &files)).warned(warnings))
    }

    /// Refuses what the format has no use for.
    fn suit(&self) -> Result<(), Box<Diagnostic>> {
        let of_urdf = [("--urdf", self.urdf.is_some()), ("--base", self.base.is_some()), ("--tip", self.tip.is_some())];
        let wrong =
            |message: String, hint: &str| Err(Box::new(Diagnostic::error(Code::NotAvailable, message).hint(hint)));
        match self.to {
            Robots::Urdf if self.urdf.is_none() => wrong(
                "a URDF is more than its chain: the numbers go into an original".into(),
                "name it: `--urdf FILE.urdf`",
            ),
            Robots::Urdf if self.plain => {
                wrong("`--plain` is for tables, and `--to` says otherwise".into(), "leave it out")
            }
            Robots::Dh | Robots::Mdh => match of_urdf.iter().find(|(_, given)| *given) {
                Some((name, _)) => {
                    wrong(format!("`{name}` is for a URDF, and `--to` says otherwise"), "say `--to urdf`")
                }
                None => Ok(()),
            },
            Robots::Urdf => Ok(()),
        }
    }

    /// Writes all files or none; says what each is.
    fn write(&self, exported: &Exported) -> Result<Vec<(String, String)>, Diagnostics> {
        let Some(path) = &self.out else { return Ok(Vec::new()) };
        let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
        let mut beside = path.clone().into_os_string();
        beside.push(".covariance.csv");
        let beside = PathBuf::from(beside);
        let mut files = vec![(path.clone(), exported.text.clone(), format!("{} numbers", exported.values.len()))];
        if let Some(text) = exported.covariance_csv() {
            files.push((beside, text, "their covariance".to_owned()));
        }
        let outputs =
            files.iter().map(|(path, ..)| Output::open(path)).collect::<Result<Vec<_>, _>>().map_err(refused)?;
        let written: Vec<Written> = outputs
            .into_iter()
            .zip(&files)
            .map(|(out, (_, text, _))| out.write(|out| out.write_all(text.as_bytes())))
            .collect::<Result<_, _>>()
            .map_err(refused)?;
        written.into_iter().try_for_each(Written::put).map_err(refused)?;
        Ok(files.into_iter().map(|(path, _, what)| (path.display().to_string(), what)).collect())
    }
}

/// An export for programs.
fn exported_json(exported: &Exported, chain: &ChainValues, files: &[&str]) -> Value {
    let numbers = exported.names.iter().zip(&exported.units).zip(&exported.values).enumerate();
    let sigma = |k: usize| exported.covariance.as_ref().and_then(|all| all.sigma(k));
    let numbers: Vec<Value> = numbers
        .map(|(k, ((name, unit), value))| json!({"name": name, "value": value, "unit": unit, "sigma": sigma(k)}))
        .collect();
    json!({
        "chain": chain.name, "text": exported.text, "numbers": numbers, "files": files,
        "covariance": exported.covariance.as_ref().map(|all| json!({"names": exported.names, "matrix": all.matrix})),
    })
}
