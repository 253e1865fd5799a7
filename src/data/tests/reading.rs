use std::fs;
use std::path::Path;

use proptest::prelude::*;

use super::*;

const PLAIN: &str = "(file: \"d.csv\")";

fn rows(data: &str, text: &str) -> Table {
    table(data, text.as_bytes()).unwrap_or_else(|(found, _)| panic!("{}", crate::diag::text(&found, false)))
}

#[test]
fn units_bias_default_and_names() {
    let table =
        rows(PLAIN, "n,place,hole,hz,extra,v,length\n1e-3, front ,0,90,x,-90-00-00,10.5\n2,back,0,-180,,0 30 0,1\n");
    use std::f64::consts::{FRAC_PI_2, PI};
    assert_eq!(table.row(0), [FRAC_PI_2, -FRAC_PI_2, 10.0, 293.0, 1e-3]);
    assert_eq!(table.row(1), [-PI, 1800.0 / 648_000.0 * PI, 0.5, 293.0, 2.0]);
    assert_eq!((table.key(0, 0), table.key(1, 0), table.names(1)), ("front", "back", &["0".to_owned()][..]));
    assert_eq!((table.place(1).line, table.place(1).row), (Some(3), Some(2)));
}

#[test]
fn lines_are_counted_through_comments_quotes_and_blanks() {
    for end in ["\n", "\r\n", "\r"] {
        let text = [
            "\u{feff}# a comment, with a comma",
            "",
            "place;hole;hz;v;length;n;\"a",
            "note\"",
            "   ",
            "a;0;1;1-0-0;1;1;\"two",
            "lines\"",
            "# another",
            "",
            "a;0;2;1-0-0;1;1;x",
        ]
        .join(end);
        for text in [text.clone(), text + end] {
            let table = rows(PLAIN, &text);
            let places: Vec<_> = (0..2).map(|row| (table.place(row).line, table.place(row).row)).collect();
            assert_eq!(places, [(Some(6), Some(1)), (Some(10), Some(2))], "{end:?}");
        }
    }
}

#[test]
fn files_without_a_heading() {
    let columns = "columns: [\"hz\", \"_\", \"v\", \"length\", \"n\"], constants: {\"place\": \"front\", \"hole\": 0, \"t\": \"290 K\"}";
    let data = format!("(file: \"d.csv\", {columns})");
    for text in ["1,x,1-0-0,3,4\n", "1;x;1-0-0;3;4", "1\tx\t1-0-0\t3\t4"] {
        let table = rows(&data, text);
        assert_eq!((table.row(0)[2..].to_vec(), table.key(0, 1)), (vec![2.5, 290.0, 4.0], "0"));
        assert_eq!(table.place(0).line, Some(1));
    }
    let table = rows(&format!("(file: \"d.csv\", header: true, {columns})"), "Base (°),?,a,b,c\n1,x,1-0-0,3,4\n");
    assert_eq!((table.rows(), table.place(0).line, table.place(0).row), (1, Some(2), Some(1)));
    // numbers count in the column's unit, and the bias is subtracted as from any reading
    let table = rows(
        "(file: \"d.csv\", constants: {\"hz\": 180, \"v\": \"12-30-00\", \"length\": \"1 m\", \"n\": \"pi/2\"})",
        "place,hole\na,b\n",
    );
    assert_eq!(
        table.row(0),
        [std::f64::consts::PI, crate::unit::parse_dms("12-30").unwrap(), 999.5, 293.0, std::f64::consts::FRAC_PI_2]
    );
}

#[test]
fn a_heading_may_say_the_unit() {
    let table = rows(PLAIN, "place,hole,hz [deg],v (d-m-s),length[mm],n [1],t (K)\na,0,90,1-0-0,3,4,280\n");
    assert_eq!(table.row(0)[2..], [2.5, 280.0, 4.0]);
    assert_eq!(rows(PLAIN, "place,hole,hz (°),v,length,n\na,0,90,1-0-0,3,4\n").rows(), 1);
}

#[test]
fn several_files_and_absent_ones() {
    let directory = tempfile::tempdir().unwrap();
    let heading = "hole,hz,v,length,n\n";
    fs::write(directory.path().join("one.csv"), format!("{heading}a,1,1-0,1,1\nb,1,1-0,1,1\n")).unwrap();
    fs::write(directory.path().join("two.csv"), format!("{heading}c,1,1-0,1,1\n")).unwrap();
    let data = "(file: \"one.csv\", constants: {\"place\": \"p\"}), (file: \"gone.csv\", optional: true), \
                (file: \"two.csv\", constants: {\"place\": \"q\"})";
    let (program, files) = program(data);
    let mut found = Diagnostics::new();
    let table = read(&program, 0, &files, directory.path(), &mut found).unwrap();
    let codes: Vec<&str> = found.iter().map(|d| d.code.id()).collect();
    assert_eq!((codes, table.rows(), table.key(2, 0), table.key(2, 1)), (vec!["W003"], 3, "q", "c"));
    assert!(table.place(2).file.ends_with("two.csv"));
    assert_eq!(table.place(2).row, Some(1));

    let missing: DataFile = DataFile { file: "gone.csv".into(), ..DataFile::default() };
    let folder = DataFile { file: ".".into(), ..DataFile::default() };
    let mut found = Diagnostics::new();
    assert!(read(&program, 0, &[missing, folder], Path::new(directory.path()), &mut found).is_none());
    let codes: Vec<&str> = found.iter().map(|d| d.code.id()).collect();
    assert_eq!(codes, ["E027", "E002"]);
}

proptest! {
    #[test]
    fn no_bytes_panic(text in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = table(PLAIN, &text);
        let headed = [b"place,hole,hz,v,length,n\n".as_slice(), &text].concat();
        let _ = table(PLAIN, &headed);
        let _ = table("(file: \"d\", header: true, columns: [\"hz\", \"v\", \"n\"], constants: {\"place\": \"\"})", &text);
    }

    #[test]
    fn nothing_like_a_table_panics(text in "([a-z0-9.,;\t\"'#\r\n \\-\\[\\]()°]|hz|v|length|place|hole|n|\n|,){0,60}") {
        let _ = table(PLAIN, text.as_bytes());
    }
}
