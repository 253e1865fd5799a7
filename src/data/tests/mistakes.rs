//! Each mistake at its place: the file as it stands, then `code line row column value` of what is reported.

use super::*;
use crate::diag::Place;

const HEADING: &str = "place,hole,hz,v,length,n\n";

/// `E031 3 2 hz ``: what is reported, without the words. A place in the model is the text it points at.
fn found(data: &str, text: &str) -> Vec<String> {
    let Err((found, source)) = table(data, text.as_bytes()) else { return Vec::new() };
    found
        .iter()
        .map(|d| match &d.place {
            Some(Place::Data(place)) => {
                assert_eq!(place.file, "d.csv");
                let number = |n: Option<usize>| n.map_or("-".to_owned(), |n| n.to_string());
                let text = |t: &Option<String>| t.clone().map_or("-".to_owned(), |t| format!("`{t}`"));
                let (line, row) = (number(place.line), number(place.row));
                format!("{} {line} {row} {} {}", d.code, text(&place.column), text(&place.value))
            }
            Some(Place::Text { span, .. }) => format!("{} {}", d.code, &source.text()[span.range()]),
            None => format!("{} nowhere", d.code),
        })
        .collect()
}

fn expect(cases: &[(&str, &str, &[&str])]) {
    for (data, text, expected) in cases {
        assert_eq!(found(&format!("(file: \"d.csv\"{data})"), text), *expected, "{data}\n{text}");
    }
}

#[test]
fn of_cells() {
    let of = |rows: &str| format!("{HEADING}{rows}");
    expect(&[
        ("", &of("a,0,1,1-0-0,1,1\na,0,,1-0-0,1,1\n"), &["E031 3 2 `hz` ``"]),
        ("", &of("a,,1,1-0-0,1,1\n"), &["E031 2 1 `hole` ``"]),
        ("", &of("\n# x\na,0,1,1-0-0,one,1\n"), &["E032 4 1 `length` `one`"]),
        ("", &of("a,0,NaN,1-0-0,1,-inf\n"), &["E033 2 1 `hz` `NaN`", "E033 2 1 `n` `-inf`"]),
        ("", &of("a,0,1,1-60-0,1,1\n"), &["E036 2 1 `v` `1-60-0`"]),
        ("", &of("a,0,1,1-0-0,1\r\na,0,1,1-0-0,1,1,1\r\n"), &["E034 2 1 - -", "E034 3 2 - -"]),
        ("", "place;hole;hz;v;length;n\na;0;1,5;1-0-0;1;1\n", &["E032 2 1 `hz` `1,5`"]),
        // a quote that is never closed
        ("", &of("a,0,1,1-0-0,1,\"1\na,0"), &["E032 2 1 `n` `1\na,0`"]),
        // all of them at once
        (
            "",
            &of("a,0,x,y,z,1\na,0,1\n"),
            &["E032 2 1 `hz` `x`", "E036 2 1 `v` `y`", "E032 2 1 `length` `z`", "E034 3 2 - -"],
        ),
    ]);
}

#[test]
fn of_headings() {
    expect(&[
        ("", "place,hole,v,length,n\na,0,1-0-0,1,1\n", &["E028 1 - `hz` -"]),
        ("", "# x\nplace,hole,Hz,v,lenght,n\na,0,1,1-0-0,1,1\n", &["E028 2 - `hz` -", "E028 2 - `length` -"]),
        // a default is no excuse for a slip of the shift key
        ("", "place,hole,hz,v,length,n,T\na,0,1,1-0-0,1,1,280\n", &["E028 1 - `t` -"]),
        ("", "place,hole,hz,v,length,n,hz\na,0,1,1-0-0,1,1,1\n", &["E030 1 - `hz` -"]),
        ("", "place,hole,hz [deg],v,length,n,hz(deg)\na,0,1,1-0-0,1,1,1\n", &["E030 1 - `hz` -"]),
        ("", "place,hole,hz [rad],v,length,n\na,0,1,1-0-0,1,1\n", &["E012 1 - `hz` `hz [rad]`"]),
        (
            "",
            "place,hole,hz,v [deg],length (s),n\na,0,1,1-0-0,1,1\n",
            &["E012 1 - `v` `v [deg]`", "E012 1 - `length` `length (s)`"],
        ),
        ("", "place,hole,hz [dge],v,length,n\na,0,1,1-0-0,1,1\n", &["E011 1 - `hz` `hz [dge]`"]),
        ("", "", &["E035 - - - -"]),
        ("", "# nothing\n\n", &["E035 - - - -"]),
        ("", HEADING, &["E035 - - - -"]),
        (
            ", columns: [\"n\"], header: true, constants: {\"place\": \"\", \"hole\": \"\", \"hz\": 0, \"v\": 0, \"length\": 0}",
            "n\n",
            &["E035 - - - -"],
        ),
    ]);
}

#[test]
fn of_the_model() {
    let constants = |more: &str| format!(", constants: {{\"place\": \"p\", \"hole\": \"h\"{more}}}");
    let line = "hz,v,length,n\n1,1-0-0,1,1\n";
    expect(&[
        (
            ", columns: [\"hz\", \"hzz\", \"v\", \"length\", \"n\"], constants: {\"place\": \"\", \"hole\": \"\"}",
            "1,1,1-0,1,1\n",
            &["E029 hzz"],
        ),
        (
            ", columns: [\"hz\", \"hz\", \"v\", \"length\", \"n\"], constants: {\"place\": \"\", \"hole\": \"\"}",
            "1,1,1-0,1,1\n",
            &["E030 hz"],
        ),
        (
            ", columns: [\"hz\", \"v\", \"n\"], constants: {\"place\": \"\", \"hole\": \"\"}",
            "1,1-0,1\n",
            &["E028 - - `length` -"],
        ),
        (&constants(", \"hloe\": 1"), line, &["E029 hloe"]),
        (&constants(", \"hz\": 1"), line, &["E030 hz"]),
        (&constants(", \"t\": \"5 mm\""), line, &["E012 5 mm"]),
        (&constants(", \"t\": \"5 kelvins\""), line, &["E011 kelvins"]),
        (&constants(", \"v\": 12.5"), "hz,length,n\n1,1,1\n", &["E036 v"]),
    ]);
}

#[test]
fn the_words_help() {
    let words = |text: &str| {
        let (found, _) = table("(file: \"d.csv\")", text.as_bytes()).unwrap_err();
        crate::diag::text(&found, false)
    };
    for (text, part) in [
        ("place,hole,Hz,v,length,n\na,0,1,1-0-0,1,1\n", "did you mean `Hz`?"),
        ("place,hole,hz [rad],v,length,n\na,0,1,1-0-0,1,1\n", "the column `hz` counts in rad, and deg is declared"),
        ("place,hole,hz [s],v,length,n\na,0,1,1-0-0,1,1\n", "counts in s (time), and deg (angle) is declared"),
        ("place;hole;hz;v;length;n\na;0;1,5;1-0-0;1;1\n", "decimal comma"),
        ("place,hole,hz,v,length,n\na,0,1 deg,1-0-0,1,1\n", "a cell has no unit; the column counts in deg"),
    ] {
        assert!(words(text).contains(part), "{}", words(text));
    }
}

#[test]
fn a_ruined_file_is_not_quoted_in_full() {
    let text = format!("{HEADING}{}", "a,0,x,1-0-0,1,1\n".repeat(1000));
    let all = found("(file: \"d.csv\")", &text);
    assert_eq!(all.len(), 21);
    assert_eq!(all[20], "E032 22 21 - -");
    let (last, _) = table("(file: \"d.csv\")", text.as_bytes()).unwrap_err();
    assert_eq!(last.0[20].message, "980 more mistakes from here on");
}
