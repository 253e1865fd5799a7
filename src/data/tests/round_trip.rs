use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::compile::Program;

/// What a file gives back.
fn again(program: &Program, table: &Table) -> Table {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("t.csv");
    write(program, 0, table, &path).and_then(Written::put).unwrap();
    let mut found = Diagnostics::new();
    let files = [DataFile { file: "t.csv".into(), ..DataFile::default() }];
    read(program, 0, &files, directory.path(), &mut found).unwrap_or_else(|| panic!("{found:?}"))
}

fn assert_same(one: &Table, other: &Table) {
    assert_eq!(one.rows(), other.rows());
    for row in 0..one.rows() {
        let bits = |table: &Table| table.row(row).iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(one), bits(other), "{:?} {:?}", one.row(row), other.row(row));
        for k in 0..2 {
            assert_eq!((one.key(row, k), one.key_index(row, k)), (other.key(row, k), other.key_index(row, k)));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn what_is_written_is_read(
        cells in proptest::collection::vec((-1e4..1e4_f64, -400.0..400.0_f64, 1e-9..1e9_f64, "[a-z#,;\"°]{1,4}", "[ab]"), 1..20),
    ) {
        let (program, _) = program("");
        let columns: Vec<Column> =
            program.measurements[0].inputs.iter().map(|input| Column::new(&program.units, input)).collect();
        let mut table = Table::new(2, 5);
        for (hz, v, length, place, hole) in &cells {
            let row = [columns[0].to_internal(*hz), columns[1].rounded(v.to_radians()), columns[2].to_internal(*length), 1.0 / length, -hz];
            // an angle that an instrument states in degrees, minutes and seconds
            let seconds = row[1] / std::f64::consts::PI * 648_000.0;
            let v = seconds / 648_000.0 * std::f64::consts::PI;
            table.push(&[place, hole], &[row[0], v, row[2], row[3], row[4]], None).expect("a row of the table");
        }
        assert_same(&table, &again(&program, &table));
    }
}

#[test]
fn whole_or_not_at_all() {
    let (program, _) = program("");
    let mut table = Table::new(2, 5);
    table.push(&["a", "b"], &[1.0, 2.0, 3.0, 4.0, 5.0], None).expect("a row of the table");
    let missing = write(&program, 0, &table, Path::new("/no/such/directory/t.csv")).unwrap_err();
    assert_eq!(missing.code.id(), "E043");

    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("t.csv");
    write(&program, 0, &table, &path).and_then(Written::put).unwrap();
    let before = std::fs::read(&path).unwrap();
    assert!(before.starts_with(b"place,hole,hz,v,length,t,n\na,b,57.2957"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let plain = directory.path().join("plain");
        std::fs::write(&plain, "").unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&plain));
    }
    table.push(&["a", "b"], &[f64::NAN; 5], None).expect("a row of the table");
    assert_eq!(write(&program, 0, &table, &path).unwrap_err().code.id(), "E043");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
}
