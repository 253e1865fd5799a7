//! Diagnostics as text for people and as JSON for programs. The only file that knows the crate which draws them.

use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use serde_json::{Map, Value};

use super::{DataPlace, Diagnostic, Place, Severity, Source, Span};

/// How many are shown to people: nobody reads more, and the text around each has to be found.
const MOST_SHOWN: usize = 100;

/// The diagnostics sorted by place, as compilers show them, of very many the first; `colour` adds terminal colours.
#[must_use]
pub fn text<'a>(diagnostics: impl IntoIterator<Item = &'a Diagnostic>, colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let mut out = String::new();
    let all = sorted(diagnostics);
    for diagnostic in all.iter().take(MOST_SHOWN) {
        out.push_str(&renderer.render(&[group(diagnostic)]));
        out.push_str("\n\n");
    }
    if all.len() > MOST_SHOWN {
        out.push_str(&format!("and {} more; `--format json` has all\n\n", all.len() - MOST_SHOWN));
    }
    out
}

/// Sorted by place, each said once.
fn sorted<'a>(diagnostics: impl IntoIterator<Item = &'a Diagnostic>) -> Vec<&'a Diagnostic> {
    let mut all: Vec<_> = diagnostics.into_iter().collect();
    all.sort_by(|a, b| a.key().cmp(&b.key()));
    all.dedup_by(|a, b| a.key() == b.key());
    all
}

fn group(diagnostic: &Diagnostic) -> Group<'_> {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut group = Group::with_title(level.primary_title(diagnostic.message.as_str()).id(diagnostic.code.id()));
    match &diagnostic.place {
        Some(Place::Text { source, span }) => {
            for snippet in snippets(source, *span, &diagnostic.labels) {
                group = group.element(snippet);
            }
        }
        Some(Place::Data(data)) => {
            let mut origin = Origin::path(data.file.as_str());
            if let Some(line) = data.line {
                origin = origin.line(line);
            }
            group = group.element(origin);
            let words = cell(data);
            if !words.is_empty() {
                group = group.element(Level::NOTE.message(words));
            }
        }
        None => {}
    }
    if let Some(hint) = &diagnostic.hint {
        group = group.element(Level::HELP.message(hint.as_str()));
    }
    group
}

/// One snippet per text that is pointed into, the one with the mistake first.
fn snippets<'a>(
    source: &'a Arc<Source>,
    span: Span,
    labels: &'a [(Place, String)],
) -> Vec<Snippet<'a, annotate_snippets::Annotation<'a>>> {
    let mut sources: Vec<&Arc<Source>> = vec![source];
    for (place, _) in labels {
        if let Place::Text { source, .. } = place
            && !sources.iter().any(|known| Arc::ptr_eq(known, source))
        {
            sources.push(source);
        }
    }
    let open = |text: &Arc<Source>| Arc::ptr_eq(text, source);
    sources
        .into_iter()
        .map(|text| {
            let mut snippet = Snippet::source(text.text()).path(text.name());
            if open(text) {
                snippet = snippet.annotation(AnnotationKind::Primary.span(span.range()));
            }
            for (place, words) in labels {
                if let Place::Text { source, span } = place
                    && Arc::ptr_eq(source, text)
                {
                    snippet = snippet.annotation(AnnotationKind::Context.span(span.range()).label(words.as_str()));
                }
            }
            snippet
        })
        .collect()
}

fn cell(data: &DataPlace) -> String {
    let parts = [
        data.row.map(|row| format!("row {row}")),
        data.column.as_ref().map(|name| format!("column `{name}`")),
        data.value.as_ref().map(|value| format!("reads `{value}`")),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The diagnostics sorted by place, one object each.
#[must_use]
pub fn json<'a>(diagnostics: impl IntoIterator<Item = &'a Diagnostic>) -> Value {
    sorted(diagnostics).into_iter().map(object).collect()
}

fn object(diagnostic: &Diagnostic) -> Value {
    let mut out = Map::new();
    let mut put = |key: &str, value: Value| out.insert(key.to_owned(), value);
    put("code", diagnostic.code.id().into());
    put("severity", diagnostic.severity.name().into());
    put("message", diagnostic.message.as_str().into());
    match &diagnostic.place {
        Some(Place::Text { source, span }) => {
            let (start, end) = (source.position(span.start), source.position(span.end));
            put("file", source.name().into());
            put("line", start.line.into());
            put("column", start.column.into());
            put("end_line", end.line.into());
            put("end_column", end.column.into());
        }
        Some(Place::Data(data)) => {
            put("file", data.file.as_str().into());
            put("line", data.line.into());
            put("row", data.row.into());
            put("column_name", data.column.as_deref().into());
            put("value", data.value.as_deref().into());
        }
        None => {
            put("file", Value::Null);
        }
    }
    put("hint", diagnostic.hint.as_deref().into());
    Value::Object(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Code;

    #[test]
    fn text_shows_line_label_and_hint() {
        let source = Source::new("m.ron", "(\n  a: 1,\n  a: 2,\n)");
        let found = Diagnostic::error(Code::Duplicate, "`a` is given twice")
            .at(&source, Span::new(12, 13))
            .label(&source, Span::new(4, 5), "first here")
            .hint("remove one");
        let plain = text(std::slice::from_ref(&found), false);
        assert_eq!(
            plain,
            "\
error[E007]: `a` is given twice
 --> m.ron:3:3
  |
2 |   a: 1,
  |   - first here
3 |   a: 2,
  |   ^
  |
  = help: remove one

"
        );
        assert!(!plain.contains('\u{1b}'));
        assert!(text(&[found], true).contains('\u{1b}'));
    }

    #[test]
    fn data_places_show_row_and_column() {
        let found = Diagnostic::error(Code::NotANumber, "a number is wanted").at_data(DataPlace {
            file: "vo.csv".into(),
            line: Some(3),
            row: Some(2),
            column: Some("hz".into()),
            value: Some("abc".into()),
        });
        let shown = text(std::slice::from_ref(&found), false);
        assert!(shown.contains("vo.csv:3"), "{shown}");
        assert!(shown.contains("row 2, column `hz`, reads `abc`"), "{shown}");
        let json = json(&[found]);
        assert_eq!(json[0]["row"], 2);
        assert_eq!(json[0]["column_name"], "hz");
        assert_eq!(json[0]["hint"], Value::Null);
    }

    #[test]
    fn json_has_lines_and_columns() {
        let source = Source::new("m.ron", "(µ: 1,\n b: 2)");
        let found = Diagnostic::error(Code::UnknownField, "no field").at(&source, Span::new(9, 10));
        let json = json(&[found]);
        assert_eq!(json[0]["code"], "E003");
        assert_eq!((&json[0]["line"], &json[0]["column"]), (&2.into(), &2.into()));
        assert_eq!(json[0]["end_column"], 3);
    }

    #[test]
    fn odd_spans_and_empty_texts_do_not_panic() {
        for text_of in ["", "\n", "µ", "a\r\nb\t"] {
            let source = Source::new("m", text_of);
            for start in 0..6 {
                for end in 0..6 {
                    let found = Diagnostic::error(Code::Syntax, "odd\n\u{7}text")
                        .at(&source, Span::new(start, end))
                        .label(&source, Span::new(end, start), "");
                    let _ = (text(std::slice::from_ref(&found), true), json(&[found]));
                }
            }
        }
    }
}
