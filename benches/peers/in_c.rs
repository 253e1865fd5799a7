//! Emitted C, compiled when the bench runs: a process of its own that times itself when asked, in turns with the others.

use std::cell::RefCell;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::rc::Rc;

use phical::simd::InstructionSet;

use super::clock::Peer;

struct Process {
    child: Child,
    ask: ChildStdin,
    answer: BufReader<ChildStdout>,
    _folder: tempfile::TempDir,
}

impl Process {
    /// ns per line, once.
    fn time(&mut self, what: &str) -> f64 {
        writeln!(self.ask, "{what}").and_then(|()| self.ask.flush()).expect("it listens");
        let mut line = String::new();
        self.answer.read_line(&mut line).expect("it answers");
        let ns: f64 = line.trim().parse().expect("a number");
        assert!(ns > 0.0, "the emitted C is undefined on a line");
        ns
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The peers, built for the same instructions as the bench; none, with a loud line, where there is no compiler.
pub(crate) fn peers(q: &[f64], lines: &[Vec<f64>], built: InstructionSet) -> Vec<Peer<'static>> {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("timed");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/timed.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-std=gnu99", "-O3", "-fno-math-errno", "-fno-trapping-math", "-fno-tree-slp-vectorize"]);
    match built {
        InstructionSet::Avx512 => _ = compiler.arg("-march=x86-64-v4"),
        InstructionSet::Avx2 => _ = compiler.arg("-march=x86-64-v3"),
        _ => {}
    }
    let compiled = compiler.arg(source).arg("-o").arg(&program).arg("-lm").status();
    if !compiled.is_ok_and(|status| status.success()) {
        println!("SKIPPED: emitted C, for cc is not present or refuses it");
        return Vec::new();
    }
    let mut child = Command::new(&program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it starts");
    let (mut ask, answer) = (child.stdin.take().expect("a pipe"), child.stdout.take().expect("a pipe"));
    let numbers = |all: &[f64]| all.iter().map(|value| format!("{value:?} ")).collect::<String>();
    let lines_text: String = lines.iter().map(|line| numbers(line)).collect();
    writeln!(ask, "{}\n{}\n{lines_text}", numbers(q), lines.len()).expect("it listens");
    let process = Process { child, ask, answer: BufReader::new(answer), _folder: folder };
    let process = Rc::new(RefCell::new(process));
    [("emitted C: r + J", "j"), ("emitted C, 8 rows at a time: r + J", "v")]
        .map(|(name, what)| {
            let process = Rc::clone(&process);
            Peer::elsewhere(name, move || process.borrow_mut().time(what))
        })
        .into()
}
