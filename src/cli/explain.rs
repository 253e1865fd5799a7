//! `phical explain CODE`

use clap::Args;
use serde_json::{Value, json};

use super::{Format, Outcome};
use crate::diag::{Code, nearest};
use crate::report::{Align, Grid};

#[derive(Debug, Args)]
pub(super) struct Explain {
    /// A code such as E012; without one all are listed
    #[arg(value_parser = code)]
    code: Option<Code>,
    /// List all codes
    #[arg(long, conflicts_with = "code")]
    all: bool,
}

fn code(text: &str) -> Result<Code, String> {
    Code::from_id(text).ok_or_else(|| {
        let upper = text.trim().to_uppercase();
        match nearest(&upper, Code::ALL.iter().map(|code| code.id())) {
            Some(near) => format!("there is no such code; did you mean {near}? `phical explain` lists all"),
            None => "there is no such code; `phical explain` lists all".into(),
        }
    })
}

fn object(code: Code) -> Value {
    json!({ "code": code.id(), "title": code.title(), "explanation": code.explanation(), "example": code.example() })
}

impl Explain {
    pub(super) fn run(self, format: Format) -> Outcome {
        let one = |code: Code| {
            format!("{code}: {}\n\n{}\n\nFor example:\n\n{}", code.title(), code.explanation(), code.example())
        };
        let all = || {
            let mut grid = Grid::new(&[Align::Left, Align::Left]);
            Code::ALL.iter().for_each(|code| grid.row([code.id(), code.title()]));
            grid.text("")
        };
        let list = || json!({ "codes": Code::ALL.iter().map(|code| object(*code)).collect::<Vec<_>>() });
        Outcome::new(format, || self.code.map_or_else(all, one), || self.code.map_or_else(list, object))
    }
}
