//! Tables whose rows are in a temporary file are as those whose rows are in memory.

use std::ops::Range;

use proptest::prelude::*;

use super::super::store::IN_MEMORY;
use super::*;

const NAMES: [&str; 5] = ["a", "b", "c", "d", "e"];

/// A table of two keys and three readings that keeps so many bytes in memory. One row takes 36.
fn made(rows: Range<usize>, bound: usize) -> Table {
    let mut table = Table::with_bound(2, 3, bound);
    table.begin(&format!("from {}.csv", rows.start));
    for row in rows {
        let x = row as f64;
        // every other line is a comment here and there
        let line = (row % 7 != 3).then_some(2 * row + row % 2);
        table
            .push(&[NAMES[row % 5], NAMES[row * row % 5]], &[x, -x, 1.0 / (x + 1.0)], line)
            .expect("a row of the table");
    }
    table
}

fn assert_same(one: &Table, other: &Table) {
    assert_eq!((one.rows(), one.width()), (other.rows(), other.width()));
    let by_name = |table: &Table, row| (table.key(row, 0).to_owned(), table.key(row, 1).to_owned());
    for row in 0..one.rows() {
        assert_eq!(one.row(row).to_vec(), other.row(row).to_vec(), "row {row}");
        assert_eq!((by_name(one, row), one.place(row)), (by_name(other, row), other.place(row)), "row {row}");
        assert_eq!(one.key_index(row, 1), other.key_index(row, 1));
    }
    assert_eq!((one.names(0), one.names(1)), (other.names(0), other.names(1)));
}

/// What a piece says is what its rows say.
fn assert_piece(table: &Table, range: Range<usize>, buffer: &mut Buffer) {
    let rows = table.read(range.clone(), buffer).unwrap();
    assert_eq!((rows.first(), rows.len(), rows.is_empty()), (range.start, range.len(), range.is_empty()));
    assert_eq!(rows.readings().len(), range.len() * rows.width());
    for i in 0..rows.len() {
        let row = range.start + i;
        assert_eq!(table.row(row), rows.row(i));
        assert_eq!(rows.keys(i), [table.key_index(row, 0), table.key_index(row, 1)]);
        assert_eq!(rows.line(i), table.place(row).line);
    }
}

#[test]
fn whatever_is_kept_in_memory_the_table_is_the_same() {
    let all = made(0..1000, IN_MEMORY);
    assert_eq!(all.store().in_files(), 0);
    for (bound, in_files) in [(0, 1000), (100, 999), (36 * 400, 800), (36 * 1000, 1000), (36 * 1000 + 1, 0)] {
        let table = made(0..1000, bound);
        assert_eq!(table.store().in_files(), in_files, "{bound}");
        assert!(table.refused().is_none());
        assert_same(&table, &all);
    }
}

#[test]
fn memory_has_a_bound() {
    let mut table = Table::new(1, 9);
    let bytes = 9 * 8 + 2 * 4;
    let rows = 2 * IN_MEMORY / bytes + 1000;
    for row in 0..rows {
        table.push(&["a"], &[row as f64; 9], None).expect("a row of the table");
        let held = (table.rows() - table.store().in_files()) * bytes;
        assert!(held < IN_MEMORY, "{held}");
    }
    assert!(table.store().in_files() > 0);
    for row in [0, rows / 3, rows - 1] {
        assert_eq!(table.row(row), [row as f64; 9]);
    }
}

#[test]
fn copies_go_their_own_ways() {
    let mut one = made(0..500, 3600);
    let mut other = one.clone();
    for row in 500..900 {
        one.push(&["a", "b"], &[row as f64; 3], None).expect("a row of the table");
        other.push(&["b", "x"], &[-(row as f64); 3], None).expect("a row of the table");
    }
    assert_eq!(one.row(450), other.row(450));
    for row in 500..900 {
        assert_eq!((one.row(row)[0], one.key(row, 1)), (row as f64, "b"));
        assert_eq!((other.row(row)[0], other.key(row, 1)), (-(row as f64), "x"));
    }
    drop(one);
    assert_eq!(other.row(7)[0], 7.0);
}

#[test]
fn several_threads_read_at_once() {
    let table = made(0..20_000, 3600);
    let copy = table.clone();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let table = if thread % 2 == 0 { &table } else { &copy };
            scope.spawn(move || {
                let mut buffer = Buffer::default();
                for first in (thread * 5000..(thread + 1) * 5000).step_by(250) {
                    let rows = table.read(first..first + 250, &mut buffer).unwrap();
                    assert!((0..250).all(|i| rows.row(i)[0] == (first + i) as f64));
                }
            });
        }
    });
}

#[test]
fn appended_tables_need_not_be_in_memory() {
    let mut all = made(0..700, IN_MEMORY);
    all.append(&made(3..1800, IN_MEMORY)).unwrap();
    for (one, other) in [(360, 360), (IN_MEMORY, 360), (360, IN_MEMORY)] {
        let mut table = made(0..700, one);
        table.append(&made(3..1800, other)).unwrap();
        assert_same(&table, &all);
    }
    assert_eq!((all.rows(), all.row(700)[0], all.place(700).row), (2497, 3.0, Some(1)));
    assert_eq!(all.place(701).file, "from 3.csv");
}

#[test]
fn a_lost_file_is_no_panic() {
    let table = made(0..100, 360);
    table.store().ruin();
    let error = table.read(0..10, &mut Buffer::default()).unwrap_err();
    assert_eq!(Table::unreadable(&error).code.id(), "E002");
    assert!(table.row(3).iter().all(|reading| reading.is_nan()));
    assert_eq!((table.key(3, 0), table.key_index(3, 0), table.place(3).line), ("", u32::MAX, None));
    assert!(made(0..1, IN_MEMORY).append(&table).is_err());
}

#[test]
fn rows_without_readings_and_keys_are_counted() {
    let mut table = Table::with_bound(0, 0, 8);
    (1..10).for_each(|line| table.push(&[], &[], Some(line)).expect("a row of the table"));
    let mut buffer = Buffer::default();
    let rows = table.read(1..9, &mut buffer).unwrap();
    assert_eq!((rows.len(), rows.row(2).len(), rows.keys(3).len(), rows.line(7)), (8, 0, 0, Some(9)));
}

proptest! {
    #[test]
    fn pieces_have_the_rows_they_should(
        bound in 0..9000_usize,
        pieces in proptest::collection::vec((0..300_usize, 0..300_usize), 1..20),
    ) {
        let table = made(0..300, bound);
        let mut buffer = Buffer::default();
        for (one, other) in pieces {
            assert_piece(&table, one.min(other)..one.max(other), &mut buffer);
        }
    }
}
