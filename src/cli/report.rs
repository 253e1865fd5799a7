//! `phical report FIT.json`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::arguments::data;
use super::{Format, Outcome};
use crate::data::{Output, Written, make_directory};
use crate::diag::Diagnostics;
use crate::fit::Document;
use crate::report::{Page, Reported, page};
use crate::session::{Looked, Session, Shown, Values, look_again};

/// Where a report and its figures go.
#[derive(Debug, Args)]
pub(super) struct Paper {
    /// Write a report: one HTML file that needs no network
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write the figures of the report as SVG files
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// The true values, for a report of made-up data [default: truth.json beside the data]
    #[arg(long, value_name = "FILE.json")]
    truth: Option<String>,
}

/// Places that can be written.
pub(super) struct Opened<'a> {
    paper: &'a Paper,
    report: Option<Output>,
}

impl Paper {
    /// Opens them, so that a place where nothing can be written is found before any work; none where nothing is wanted.
    pub(super) fn open(&self) -> Result<Option<Opened<'_>>, Diagnostics> {
        if self.report.is_none() && self.figures.is_none() {
            return Ok(None);
        }
        let refused = |found: Box<crate::diag::Diagnostic>| Diagnostics::from(*found);
        if let Some(directory) = &self.figures {
            make_directory(directory).map_err(refused)?;
        }
        let report = self.report.as_deref().map(Output::open).transpose().map_err(refused)?;
        Ok(Some(Opened { paper: self, report }))
    }
}

/// A report that is written, and not yet in its place.
pub(super) struct Drawn {
    pub(super) files: Vec<Written>,
    page: Page,
    figures: Vec<String>,
}

impl Opened<'_> {
    /// Draws the report and writes it.
    pub(super) fn write(self, fit: Document, looked: Looked, directory: &Path) -> Result<Drawn, Diagnostics> {
        let refused = |found: Box<crate::diag::Diagnostic>| Diagnostics::from(*found);
        let looked = looked.with_truth(self.paper.truth.as_deref(), directory, &fit).map_err(refused)?;
        let Looked { rows, checked, scene, truth, left_out } = looked;
        let page = page(&Reported { fit, rows, checked, scene, truth, left_out });
        let (mut files, mut figures) = (Vec::new(), Vec::new());
        if let Some(report) = self.report {
            files.push(report.write(|out| out.write_all(page.html.as_bytes())).map_err(refused)?);
        }
        if let Some(directory) = &self.paper.figures {
            for (name, svg) in &page.figures {
                let path = directory.join(name);
                let file = Output::open(&path).and_then(|out| out.write(|out| out.write_all(svg.as_bytes())));
                files.push(file.map_err(refused)?);
                figures.push(path.display().to_string());
            }
        }
        Ok(Drawn { files, page, figures })
    }
}

#[derive(Debug, Args)]
pub(super) struct Report {
    /// A fit, as `calibrate --out` writes it
    fit: String,
    /// The model file [default: where it was]
    #[arg(long, value_name = "MODEL")]
    model: Option<PathBuf>,
    /// The rows of the fit, where they are not where they were
    #[arg(long, value_name = "M=FILE", value_parser = data)]
    data: Vec<(String, String)>,
    /// Show these rows, which took no part in the fit, instead of its own
    #[arg(long, value_name = "M=FILE", value_parser = data, conflicts_with = "data")]
    check: Vec<(String, String)>,
    /// Where the page goes [default: standard output]
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    /// Write the figures as SVG files
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// The true values of made-up data [default: truth.json beside the data]
    #[arg(long, value_name = "FILE.json")]
    truth: Option<String>,
}

impl Report {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let refused = |found: Box<crate::diag::Diagnostic>| Diagnostics::from(*found);
        let values = Values::read(&self.fit).map_err(refused)?;
        let fit = Document::of(&self.fit, &values.json).map_err(refused)?;
        let paper = Paper { report: self.out.clone(), figures: self.figures, truth: self.truth };
        let opened = paper.open()?.unwrap_or(Opened { paper: &paper, report: None });
        let model = self.model.unwrap_or_else(|| PathBuf::from(&fit.provenance.model));
        let directory = model.parent().map_or_else(PathBuf::new, Path::to_owned);
        let shown = if self.check.is_empty() { Shown::Fitted(&self.data) } else { Shown::Checked(&self.check) };
        let looked = match Session::open(&model, &[]) {
            Ok(session) => look_again(&values, &fit, &session, shown).map_err(refused)?,
            Err(mistakes) => {
                let why = mistakes.iter().next().map_or(String::new(), |found| found.message.clone());
                let why = format!("Rows and the instrument are not shown: {why}. `--model` says where the model is.");
                Looked { left_out: vec![why], ..Looked::default() }
            }
        };
        let left_out = looked.left_out.clone();
        let trustworthy = fit.trustworthy;
        let Drawn { files, page, figures } = opened.write(fit, looked, &directory)?;
        files.into_iter().try_for_each(Written::put).map_err(refused)?;
        let report = self.out.map(|path| path.display().to_string());
        let text = || match &report {
            Some(path) => {
                let figures =
                    if figures.is_empty() { String::new() } else { format!(" and {} figures", figures.len()) };
                format!(
                    "{path}{figures} written\n{}",
                    left_out.iter().map(|why| format!("{why}\n")).collect::<String>()
                )
            }
            None => page.html.clone(),
        };
        let json = || {
            let html = report.is_none().then_some(&page.html);
            json!({"report": report, "html": html, "figures": figures, "left_out": left_out, "trustworthy": trustworthy})
        };
        Ok(Outcome::new(format, text, json).trusted(trustworthy))
    }
}
