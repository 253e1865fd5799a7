//! `phical import FILE`

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::{Format, Outcome};
use crate::data::Output;
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, Source};
use crate::exchange::{Convention, Robot, TableUnits, Urdf, model_text, read_table, robot_of};

/// What a robot is stated as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Robots {
    /// A Denavit-Hartenberg table
    Dh,
    /// A modified one, as Craig has it
    Mdh,
    /// A URDF
    Urdf,
}

impl Robots {
    /// How rows are multiplied, where there are rows.
    pub(super) fn convention(self) -> Option<Convention> {
        match self {
            Robots::Dh => Some(Convention::Dh),
            Robots::Mdh => Some(Convention::ModifiedDh),
            Robots::Urdf => None,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct Import {
    /// A table of joints (.csv), or a URDF
    file: PathBuf,
    /// What it is [default: by its ending, and a table by its heading]
    #[arg(long = "as", value_name = "FORMAT", value_enum)]
    robots: Option<Robots>,
    /// Of a URDF, the link at which the chain begins [default: the root]
    #[arg(long, value_name = "LINK", alias = "base")]
    from: Option<String>,
    /// Of a URDF, the link at which it ends [default: the only one without children]
    #[arg(long, value_name = "LINK", alias = "tip")]
    to: Option<String>,
    /// What the model and its chain are called [default: as in the file, or as the file]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// The unit of a table's lengths, where its heading does not say [default: m]
    #[arg(long, value_name = "UNIT")]
    length: Option<String>,
    /// The unit of a table's angles, where its heading does not say [default: rad]
    #[arg(long, value_name = "UNIT")]
    angle: Option<String>,
    /// Write to a file
    #[arg(long, value_name = "MODEL.ron")]
    out: Option<PathBuf>,
}

impl Import {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
        let source = Source::read(&self.file).map_err(refused)?;
        let mut robot = self.robot(&source)?;
        if let Some(name) = &self.name {
            robot.name.clone_from(name);
        }
        let file =
            self.file.file_name().map_or_else(|| source.name().to_owned(), |name| name.to_string_lossy().into_owned());
        let imported = model_text(&robot, &file);
        let shown = match &self.out {
            Some(path) => {
                Output::open(path)
                    .and_then(|out| out.finish(|out| out.write_all(imported.text.as_bytes())))
                    .map_err(refused)?;
                let path = path.display();
                format!(
                    "{path} written: chain `{}` of {} joints, {} numbers free\n",
                    imported.chain,
                    imported.joints.len(),
                    imported.free
                )
            }
            None => imported.text.clone(),
        };
        let json = || {
            json!({
                "model": imported.text, "chain": imported.chain, "joints": imported.joints, "free": imported.free,
                "source": robot.source, "out": self.out.as_ref().map(|path| path.display().to_string()),
            })
        };
        Ok(Outcome::new(format, || shown, json))
    }

    fn robot(&self, source: &std::sync::Arc<Source>) -> Result<Robot, Diagnostics> {
        let ending = self.file.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let robots = match (self.robots, ending.as_deref()) {
            (Some(robots), _) => Some(robots),
            (None, Some("urdf" | "xml")) => Some(Robots::Urdf),
            (None, Some("csv" | "tsv" | "txt")) => None,
            (None, _) if source.text().trim_start().starts_with('<') => Some(Robots::Urdf),
            (None, _) => {
                let message = "neither its ending nor its beginning says what the file is";
                let found = Diagnostic::error(Code::WhichFormat, message).at_data(DataPlace::file(source.name()));
                return Err(found.hint("say `--as dh`, `--as mdh` or `--as urdf`").into());
            }
        };
        let of_urdf = [("--from", self.from.is_some()), ("--to", self.to.is_some())];
        let of_table = [("--length", self.length.is_some()), ("--angle", self.angle.is_some())];
        let (others, kind) = match robots {
            Some(Robots::Urdf) => (of_table, "a URDF, which is in metres and radians"),
            _ => (of_urdf, "a table, which is one chain"),
        };
        if let Some((name, _)) = others.iter().find(|(_, given)| *given) {
            let found = Diagnostic::error(Code::NotAvailable, format!("`{name}` has no meaning for {kind}"));
            let hint = "`--from` and `--to` choose a chain of a URDF, `--length` and `--angle` are units of a table: leave it out";
            return Err(found.hint(hint).into());
        }
        if robots == Some(Robots::Urdf) {
            let urdf = Urdf::read(source)?;
            let path = urdf.path(self.from.as_deref(), self.to.as_deref())?;
            return Ok(robot_of(&urdf, &path));
        }
        let units = TableUnits { length: self.length.clone(), angle: self.angle.clone() };
        read_table(source, robots.and_then(Robots::convention), &units)
    }
}
