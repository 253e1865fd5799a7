//! Reports: one file that needs nothing else, the same by both ways to it, small however many rows there are, and alive in a browser.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

use crate::cli::{ends, json, model, path};

/// A report of a shipped model, its figures, and its fit.
fn reported(name: &str, extra: &[&str]) -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let (page, fit, figures) = (path(&directory, "a.html"), path(&directory, "fit.json"), path(&directory, "figures"));
    let mut arguments = vec!["calibrate".to_owned(), model(name)];
    arguments.extend(extra.iter().map(|&argument| argument.to_owned()));
    arguments.extend(["--report", &page, "--out", &fit, "--figures", &figures].map(str::to_owned));
    let output = Command::new(env!("CARGO_BIN_EXE_phical")).args(&arguments).output().unwrap();
    assert!(output.status.code().is_some_and(|code| code < 2), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let html = fs::read_to_string(&page).unwrap();
    (directory, html)
}

/// All shipped models with data here.
const SHIPPED: [&str; 7] = [
    "two_theodolite",
    "known_distances",
    "panda_sockets",
    "shared_errors",
    "published/york_line",
    "published/levelling_net",
    "nist/Misra1a",
];

/// Sections that every report of the flagship has.
const SECTIONS: [&str; 9] =
    ["parameters", "instrument", "residuals", "corrections", "dependence", "known", "search", "suspects", "provenance"];

#[test]
fn a_report_needs_nothing_else_and_has_all_sections() {
    let (directory, html) = reported("two_theodolite", &[]);
    for section in SECTIONS {
        assert!(html.contains(&format!("<section id=\"{section}\">")), "{section}");
    }
    for outside in ["http:", "https:", "src=", "@import", "url(", "<link"] {
        assert!(!html.contains(outside), "{outside}");
    }
    // the truth lies beside the data, and the model holds one parameter away from it
    assert!(html.contains("<th>truth</th>") && html.contains("Held away from the truth: L1.b"));
    assert!(html.contains("Trustworthy."));
    // figures as files, each a drawing with its own style
    let figures: Vec<_> = fs::read_dir(directory.path().join("figures")).unwrap().flatten().collect();
    assert!(figures.len() >= 20, "{}", figures.len());
    for figure in figures {
        let svg = fs::read_to_string(figure.path()).unwrap();
        assert!(svg.contains("<svg xmlns=") && svg.contains("<style>") && svg.trim_end().ends_with("</svg>"));
    }
}

#[test]
fn a_fit_file_gives_the_same_report() {
    for name in SHIPPED {
        let (directory, html) = reported(name, &[]);
        let (fit, again) = (path(&directory, "fit.json"), path(&directory, "b.html"));
        Command::new(env!("CARGO_BIN_EXE_phical")).args(["report", &fit, "--out", &again]).output().unwrap();
        assert!(html == fs::read_to_string(&again).unwrap(), "{name}");
    }
}

#[test]
fn invisible_directions_are_told_and_not_trusted() {
    let (_directory, html) = reported("two_theodolite", &["--free", "L1.b"]);
    assert!(html.contains("Not trustworthy.") && html.contains("can only be known in difference"));
    assert!(html.contains("class=\"verdict not\""));
}

/// A copy of a model with its data in a folder of its own.
fn copied(name: &str) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(Path::new(&model(name)).parent().unwrap()).unwrap().flatten() {
        fs::copy(entry.path(), directory.path().join(entry.file_name())).unwrap();
    }
    directory
}

#[test]
fn what_has_changed_since_is_said() {
    let directory = copied("two_theodolite");
    let (model, fit, page) = (path(&directory, "model.ron"), path(&directory, "fit.json"), path(&directory, "r.html"));
    ends(0, &["calibrate", &model, "--out", &fit]);
    let data = path(&directory, "vo_line.csv");
    let text = fs::read_to_string(&data).unwrap();
    let (rest, _) = text.trim_end().rsplit_once('\n').unwrap();
    fs::write(&data, rest).unwrap();
    let found = json(0, &["report", &fit, "--out", &page]);
    assert!(found["left_out"][0].as_str().unwrap().contains("not those of the fit"), "{found}");
    // with the rows of the fit given, nothing is left out
    let elsewhere = path(&directory, "elsewhere.csv");
    fs::write(&elsewhere, &text).unwrap();
    let found = json(0, &["report", &fit, "--out", &page, "--data", &format!("vo_line={elsewhere}")]);
    assert_eq!(found["left_out"], Value::Array(Vec::new()));
    // a model that has changed shows no rows, one that is gone neither; the fit is shown all the same
    fs::write(&model, fs::read_to_string(&model).unwrap() + "\n// more\n").unwrap();
    let found = json(0, &["report", &fit, "--out", &page]);
    assert!(found["left_out"][0].as_str().unwrap().contains("has changed since"), "{found}");
    fs::remove_file(&model).unwrap();
    let found = json(0, &["report", &fit]);
    let html = found["html"].as_str().unwrap();
    assert!(html.contains("are not shown") && html.contains("<section id=\"parameters\">"));
    assert!(!html.contains("<section id=\"residuals\">"));
}

/// Figures 5 to 7 of Sultan & Wager: what calibration does to the readings of bars that took no part in it.
#[test]
fn a_report_can_show_rows_that_took_no_part() {
    let directory = tempfile::tempdir().unwrap();
    let (model, fit, page) = (model("two_theodolite"), path(&directory, "fit.json"), path(&directory, "r.html"));
    ends(0, &["calibrate", &model, "--out", &fit]);
    ends(
        0,
        &["simulate", &model, "--rows", "vo_line=500", "--seed", "4711", "--exact", "--out", &path(&directory, "")],
    );
    let rows = path(&directory, "vo_line.csv");
    let found = json(0, &["report", &fit, "--out", &page, "--check", &format!("vo_line={rows}")]);
    let said = found["left_out"][0].as_str().unwrap();
    assert!(said.contains("took no part in the fit") && said.contains("vo_line.csv"), "{said}");
    let html = fs::read_to_string(&page).unwrap();
    assert!(
        html.contains(said) && html.contains("by what the fit does not know") && !html.contains("By more than chance")
    );
    // without noise all that is left of the millimetres before is what the fit does not know
    let values = phical::session::Values::read(&fit).unwrap();
    let document = phical::fit::Document::of(&fit, &values.json).unwrap();
    let session = phical::session::Session::open(Path::new(&model), &[]).unwrap();
    let given = [("vo_line".to_owned(), rows)];
    let shown = phical::session::Shown::Checked(&given);
    let looked = phical::session::look_again(&values, &document, &session, shown).unwrap();
    let of = &looked.rows[0];
    assert_eq!(of.rows, 500);
    let mean = |values: &[f64]| values.iter().map(|v| v.abs()).sum::<f64>() / values.len() as f64;
    for axis in ["vo.x", "vo.y", "vo.z"] {
        let residual = of.residuals.iter().find(|r| r.after.name == axis).unwrap();
        let (before, after) = (mean(residual.before.as_deref().unwrap()), mean(&residual.after.values));
        assert!(before > 5.0 && after < 0.2, "{axis}: {before} mm before, {after} mm after");
    }
}

#[test]
fn names_are_not_markup() {
    let directory = copied("nist/Misra1a");
    let file = path(&directory, "model.ron");
    let text = fs::read_to_string(&file).unwrap();
    let at = text.find("name: \"").unwrap() + 7;
    fs::write(&file, format!("{}<script>alert(1)</script>&amp;{}", &text[..at], &text[at..])).unwrap();
    let page = path(&directory, "r.html");
    ends(0, &["calibrate", &file, "--report", &page]);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("&lt;script&gt;alert(1)") && !html.contains("<script>alert"));
}

#[test]
fn an_unmodelled_effect_is_framed() {
    // theodolites whose bars are longer than stated by a part of themselves
    let directory = copied("two_theodolite");
    let data = path(&directory, "vo_line.csv");
    let text = fs::read_to_string(&data).unwrap();
    let (heading, rows) = text.split_once('\n').unwrap();
    let column = heading.split(',').position(|name| name.trim().starts_with("length")).unwrap();
    let stretched = rows.lines().map(|row| {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        let length: f64 = cells[column].trim().parse().unwrap();
        cells[column] = (length + 2.0 * ((length - 350.0) / 100.0).powi(2)).to_string();
        cells.join(",")
    });
    fs::write(&data, format!("{heading}\n{}\n", stretched.collect::<Vec<_>>().join("\n"))).unwrap();
    let page = path(&directory, "r.html");
    let output = Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(["calibrate", &path(&directory, "model.ron"), "--report", &page])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "chi-squared says so too");
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("residuals depend: ") && html.contains("vo.z on length"));
}

/// The flagship's report of very many rows: its size does not grow with them.
fn of_many_rows(rows: usize) -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let (file, out) = (model("two_theodolite"), directory.path().display().to_string());
    ends(0, &["simulate", &file, "--rows", &format!("vo_line={rows}"), "--out", &out]);
    let (page, data) = (path(&directory, "many.html"), format!("vo_line={}", path(&directory, "vo_line.csv")));
    ends(0, &["calibrate", &file, "--data", &data, "--weights", "unit", "--report", &page]);
    let html = fs::read_to_string(&page).unwrap();
    (directory, html)
}

#[test]
fn a_report_of_many_rows_is_as_small() {
    let (_directory, html) = of_many_rows(6_000);
    let elements = html.matches("<path").count() + html.matches("<rect").count() + html.matches("<circle").count();
    assert!(html.len() < 3_000_000 && elements < 20_000, "{} bytes, {elements} elements", html.len());
}

/// What a page says in headless Chromium once a script that is put at its end has run: the text of the element `#told`. None, loudly,
/// where there is no Chromium. The console must be silent.
fn in_browser(directory: &TempDir, html: &str, script: &str) -> Option<String> {
    let name = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success()));
    let Some(name) = name else {
        eprintln!("SKIPPED: there is no Chromium to open a report in");
        return None;
    };
    let told = format!("<pre id=\"told\"></pre><script>\"use strict\";{script}</script></body>");
    let page = directory.path().join("opened.html");
    fs::write(&page, html.replacen("</body>", &told, 1)).unwrap();
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(name)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"])
        .args([
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--enable-logging=stderr",
            "--v=0",
        ])
        .arg("--dump-dom")
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let console: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(console.is_empty(), "{console:?}");
    let (_, rest) = dom.split_once("<pre id=\"told\">").unwrap_or_else(|| panic!("no page: {log}"));
    Some(rest.split("</pre>").next().unwrap().to_owned())
}

/// Drags, turns the wheel, presses a key, moves to another row, and tells what the picture was after each.
const PLAYED: &str = r#"
const told = [], scene = document.getElementById("scene"), svg = scene.ownerSVGElement;
const drawn = () => scene.innerHTML;
const say = (what) => told.push(what);
const first = drawn();
const pointer = (type, x, y) => svg.dispatchEvent(new PointerEvent(type, { clientX: x, clientY: y, pointerId: 1, bubbles: true }));
pointer("pointerdown", 100, 100); pointer("pointermove", 160, 120); pointer("pointerup", 160, 120);
const turned = drawn(); say(turned !== first ? "turned" : "not turned");
pointer("pointermove", 260, 120); say(drawn() === turned ? "let go" : "not let go");
svg.dispatchEvent(new WheelEvent("wheel", { deltaY: -300, cancelable: true })); say(drawn() !== turned ? "nearer" : "not nearer");
const near = drawn();
svg.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" })); say(drawn() !== near ? "by key" : "not by key");
const shot = document.getElementById("shot"), row = document.getElementById("shown").textContent;
shot.value = 5; shot.dispatchEvent(new Event("input")); say(document.getElementById("shown").textContent !== row ? "row" : "no row");
say(/NaN|undefined|Infinity/.test(drawn()) ? "broken" : "sound");
say(scene.querySelectorAll("ellipse").length > 40 ? "ellipsoids" : "no ellipsoids");
say(document.documentElement.scrollWidth <= window.innerWidth + 1 ? "fits" : "does not fit");
document.getElementById("told").textContent = told.join(", ");
"#;

#[test]
fn the_picture_turns_in_a_browser() {
    let (directory, html) = reported("two_theodolite", &[]);
    if let Some(told) = in_browser(&directory, &html, PLAYED) {
        assert_eq!(told, "turned, let go, nearer, by key, row, sound, ellipsoids, fits");
    }
}

#[test]
fn the_first_view_is_the_drawing_without_a_script() {
    let (directory, html) = reported("two_theodolite", &[]);
    let (_, drawing) = html.split_once("<g id=\"scene\">").unwrap();
    let drawing = drawing.split("<script").next().unwrap();
    // the places of the points, as drawn by the program and by the page's script
    let points = |text: &str| -> Vec<(f64, f64)> {
        let circles = text.split("<circle class=\"point\" cx=\"").skip(1);
        let place = |circle: &str| {
            let mut numbers = circle.split('"');
            Some((numbers.next()?.parse().ok()?, numbers.nth(1)?.parse().ok()?))
        };
        circles.filter_map(place).collect()
    };
    let ours = points(drawing);
    let script = "document.getElementById('told').textContent = [...document.querySelectorAll('#scene circle.point')].map((c) => `<circle class=\"point\" cx=\"${c.getAttribute('cx')}\" cy=\"${c.getAttribute('cy')}\"`).join('');";
    let Some(told) = in_browser(&directory, &html, script) else { return };
    let theirs = points(&told.replace("&lt;", "<").replace("&quot;", "\""));
    assert!(ours.len() > 40 && ours.len() == theirs.len(), "{} and {}", ours.len(), theirs.len());
    for (one, other) in ours.iter().zip(&theirs) {
        // numbers on the page are rounded to six digits, places to a tenth
        assert!((one.0 - other.0).abs() <= 0.11 && (one.1 - other.1).abs() <= 0.11, "{one:?} and {other:?}");
    }
}

#[test]
fn every_shipped_model_opens_without_a_complaint() {
    for name in SHIPPED {
        let (directory, html) = reported(name, &[]);
        let script = "document.getElementById('told').textContent = document.querySelectorAll('section').length;";
        let Some(told) = in_browser(&directory, &html, script) else { return };
        assert!(told.parse::<usize>().unwrap() >= 4, "{name}: {told}");
        assert!(!html.contains("NaN"), "{name}");
    }
}

/// How long a page of 100,000 rows takes to open, for the note; a time is not asserted.
#[test]
#[allow(clippy::print_stdout, reason = "what it is for")]
fn the_time_to_open_is_told() {
    let rows = if std::env::var_os("PHICAL_LONG").is_some() { 100_000 } else { 3_000 };
    let (directory, html) = of_many_rows(rows);
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    // after all is parsed and drawn, and laid out
    let script = "document.body.getBoundingClientRect(); document.getElementById('told').textContent = Math.round(performance.now());";
    if let Some(told) = in_browser(&directory, &html, script) {
        println!("{rows} rows: {} bytes, opened after {told} ms", html.len());
    }
}
