//! phical beside what else gives the flagship's residuals and derivatives: code derived by hand, dual numbers, and the code that
//! phical itself emits, all on the same lines, on one thread, in turns.
//!
//! `RUSTFLAGS="-C target-cpu=x86-64-v4" cargo bench --bench peers` builds the peers for AVX-512 (v3: for AVX2); phical finds
//! the instruction set at run time.
#![allow(clippy::print_stdout, reason = "a benchmark prints what it measured")]
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::string_slice,
    clippy::unreachable,
    clippy::unwrap_used,
    reason = "a benchmark that cannot go on ends"
)]

#[path = "peers/clock.rs"]
mod clock;
#[path = "peers/dual.rs"]
mod dual;
#[rustfmt::skip]
#[allow(dead_code, unreachable_pub, reason = "it is as `phical derive` writes it, and not all of it is timed")]
#[path = "peers/emitted.rs"]
mod emitted;
#[path = "peers/hand.rs"]
mod hand;
#[path = "peers/in_c.rs"]
mod in_c;
#[path = "peers/normal.rs"]
mod normal;

use std::hint::black_box;
use std::time::Instant;

use clock::{PUBLISHED_PEAK, Peer, measure, median, peak};
use hand::{Line, Rows, WIDTH};
use phical::compile::{Program, compile};
use phical::data::Table;
use phical::diag::Source;
use phical::model::load;
use phical::problem::{Execution, Options, Problem, Selection, Weights};
use phical::simd::InstructionSet;
use phical::simulate::simulate;
use phical::solve::{LeastSquares, Settings, minimise};

const MODEL: &str = include_str!("../models/two_theodolite/model.ron");
/// Lines of one pass; results go to buffers of this length.
const LINES: usize = 1_000;
/// Lines of whole fits, by hand and by phical: the same ones again and again.
const FITTED: [usize; 2] = [1_000, 100_000];
const ROUNDS: usize = 60;

/// The paper's 21 parameters on lines, from the nominal values or from others.
fn bound<'p>(program: &'p Program, lines: &[Line], start: &[(String, f64)], execution: Execution) -> Problem<'p> {
    // phical's lines have tilts as well, and they are zero
    let width = program.measurements[0].inputs.len();
    let mut table = Table::new(0, width);
    for line in lines {
        let mut all = line.to_vec();
        all.resize(width, 0.0);
        table.push(&[], &all, None).expect("a row of the table");
    }
    let selection = Selection { free: vec!["L1.b".into()], start: start.to_vec(), ..Selection::default() };
    let options = Options { weights: Some(Weights::Unit), selection, execution, ..Options::default() };
    Problem::bind(program, vec![(0, table)], &options).expect("it binds").0
}

/// What others do with the lines at a point.
fn others<'a>(q: &'a [f64], lines: &'a [Line]) -> Vec<Peer<'a>> {
    let pair = || hand::Pair::new(black_box(q));
    let mut values = vec![[0.0; 5]; lines.len()];
    let mut rows: Vec<Rows> = vec![[[0.0; WIDTH]; 5]; lines.len()];
    let mut dual_rows = rows.clone();
    vec![
        Peer::new("by hand, scalar: r + J", Some(219.0), move || {
            let pair = pair();
            lines.iter().zip(&mut rows).for_each(|(line, rows)| pair.linearise(line, rows));
            black_box(&mut rows);
        }),
        Peer::new("of it eight sines and cosines", Some(62.0), move || {
            let all = |line: &Line| line[..8].iter().map(|x| x.sin_cos()).fold(0.0, |sum, (s, c)| sum + s * c);
            black_box(lines.iter().map(all).sum::<f64>());
        }),
        Peer::new("by hand, scalar: r", Some(180.0), move || {
            let pair = pair();
            lines.iter().zip(&mut values).for_each(|(line, values)| *values = pair.residuals(line));
            black_box(&mut values);
        }),
        Peer::new("by hand, scalar: r + J, JᵀJ, Jᵀr", Some(390.0), move || {
            black_box(normal::Normal::new(black_box(q), lines));
        }),
        Peer::new("num-dual `DualSVec64<21>`: r + J", Some(1400.0), move || {
            let pair = dual::Pair::new(black_box(q));
            lines.iter().zip(&mut dual_rows).for_each(|(line, rows)| pair.linearise(line, rows));
            black_box(&mut dual_rows);
        }),
    ]
}

/// Rows of one call of the emitted code that takes several.
const ROWS: usize = phical::emit::ROWS;

/// What the emitted Rust does with the lines, tilts and all.
fn emitted_rust<'a>(q: &'a [f64], lines: &[Vec<f64>]) -> Vec<Peer<'a>> {
    let q: &[f64; 21] = q.try_into().expect("the paper's parameters");
    let single: Vec<[f64; 11]> = lines.iter().map(|line| line[..].try_into().expect("eleven readings")).collect();
    let together: Vec<[[f64; ROWS]; 11]> = single
        .chunks_exact(ROWS)
        .map(|rows| std::array::from_fn(|k| std::array::from_fn(|row| rows[row][k])))
        .collect();
    let mut rows = vec![([0.0; 5], [[0.0; 21]; 5]); single.len()];
    let mut rows_together = vec![([[0.0; ROWS]; 5], [[[0.0; ROWS]; 21]; 5]); together.len()];
    vec![
        Peer::new("emitted Rust: r + J", None, move || {
            let p = emitted::vo_line::prepare(black_box(q));
            for (x, (r, dr_dq)) in single.iter().zip(&mut rows) {
                emitted::vo_line::jacobian(&p, x, r, dr_dq).expect("defined");
            }
            black_box(&mut rows);
        }),
        Peer::new("emitted Rust, 8 rows at a time: r + J", None, move || {
            let p = emitted::vo_line::prepare(black_box(q));
            for (x, (r, dr_dq)) in together.iter().zip(&mut rows_together) {
                emitted::vo_line::jacobian_rows(&p, x, r, dr_dq).expect("defined");
            }
            black_box(&mut rows_together);
        }),
    ]
}

/// What phical does with the same lines, each way of it a row of the table.
fn phical<'a>(set: InstructionSet, problem: &'a Problem) -> Vec<Peer<'a>> {
    let q = &problem.start;
    let name = |what: &str| format!("phical, {}: {what}", set.name());
    vec![
        Peer::new(name("r"), None, move || {
            black_box(problem.cost(black_box(q)).ok());
        }),
        Peer::new(name("r + J"), None, move || {
            black_box(problem.derivatives(black_box(q), |_, found| _ = black_box(found)).ok());
        }),
        Peer::new(name("r + J, QR([J r])"), None, move || {
            black_box(problem.linearise(black_box(q)).ok());
        }),
    ]
}

/// Other programs on the machine make times longer, never shorter: ratios are of the least ones, as the peak is.
fn table(peers: &[Peer], times: &[Vec<f64>], peak: f64) {
    println!(
        "| peer | ns per line: least | median | least, ratio | median of ratios | published × {PUBLISHED_PEAK} / {peak:.1} | least / that |"
    );
    println!("|---|---|---|---|---|---|---|");
    let least = |own: &[f64]| own.iter().copied().fold(f64::INFINITY, f64::min);
    for (peer, own) in peers.iter().zip(times) {
        let (name, ns, middle, ratio) = (&peer.name, least(own), median(own), least(own) / least(&times[0]));
        let expected = peer.published.map(|published| published * PUBLISHED_PEAK / peak);
        let (scaled, share) = expected
            .map_or_else(Default::default, |ns_there| (format!("{ns_there:.0}"), format!("{:.2}", ns / ns_there)));
        // of rounds, in which both had their turns one after the other
        let ratios: Vec<f64> = own.iter().zip(&times[0]).map(|(own, first)| own / first).collect();
        let middle_ratio = median(&ratios);
        println!("| {name} | {ns:.0} | {middle:.0} | {ratio:.2} | {middle_ratio:.2} | {scaled} | {share} |");
    }
}

/// The best of three runs in seconds, and what the last one gave.
fn best<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = Instant::now();
        let found = black_box(run());
        (start.elapsed().as_secs_f64(), found)
    };
    let (first, second, (third, found)) = (timed().0, timed().0, timed());
    (first.min(second).min(third), found)
}

/// Whole fits from the nominal values.
fn fits(program: &Program, lines: &[Line], peak: f64) {
    println!("\n| fit | lines | ms | published, scaled | cost | trials |");
    println!("|---|---|---|---|---|---|");
    let many = |count: usize| lines.iter().copied().cycle().take(count).collect::<Vec<Line>>();
    for count in FITTED {
        let many = many(count);
        let start = bound(program, lines, &[], Execution::default()).start;
        let (seconds, normal::Fitted { cost, trials }) = best(|| normal::fit(black_box(&start), &many));
        let (ms, expected) = (1e3 * seconds, 307e-5 * count as f64 * PUBLISHED_PEAK / peak);
        println!("| by hand, scalar, own LM | {count} | {ms:.1} | {expected:.1} | {cost:.9e} | {trials} |");
    }
    for (count, threads) in FITTED.into_iter().flat_map(|count| [(count, 1), (count, 2)]) {
        let problem = bound(program, &many(count), &[], Execution::new(InstructionSet::detect(), threads));
        let run = || minimise(&problem, problem.start.clone(), &Settings::default()).expect("it starts");
        let (seconds, solution) = best(run);
        let (ms, cost, trials) = (1e3 * seconds, solution.cost, solution.trace.len());
        println!("| phical, `minimise`, threads: {threads} | {count} | {ms:.1} | | {cost:.9e} | {trials} |");
    }
}

fn main() {
    let source = Source::new("model.ron", MODEL);
    let (model, _) = load(&source).expect("it reads");
    let program = compile(&model, &source, &[]).expect("it compiles").0;
    let options = phical::simulate::Options { rows: vec![(0, LINES)], ..Default::default() };
    let simulated = simulate(&program, &program.scenarios[0], &options).expect("it simulates");
    let row = |row| simulated.tables[0].1.row(row)[..9].try_into().expect("nine readings");
    let lines: Vec<Line> = (0..LINES).map(row).collect();
    let built = clock::built_for();
    // phical finds wide vectors by itself; it is shown with those of its peers, and with fewer
    let own_sets = InstructionSet::available();
    let at_truth = |set| (set, bound(&program, &lines, &simulated.truth, Execution::new(set, 1)));
    let problems: Vec<(InstructionSet, Problem)> = own_sets.into_iter().map(at_truth).collect();
    let point = problems[0].1.start.clone();

    // where the peers have wide vectors, the baseline has them too
    let wanted = |set: &InstructionSet| *set != InstructionSet::Baseline || built == InstructionSet::Baseline;
    let sets = InstructionSet::available().into_iter().filter(wanted);
    let peaks: Vec<(InstructionSet, f64)> = sets.map(|set| (set, peak(set))).collect();
    let own = peaks.iter().find(|(set, _)| *set == built).map_or(f64::NAN, |found| found.1);
    let mut peers = others(&point, &lines);
    let whole: Vec<Vec<f64>> = (0..LINES).map(|row| simulated.tables[0].1.row(row).to_vec()).collect();
    peers.extend(emitted_rust(&point, &whole));
    peers.extend(in_c::peers(&point, &whole, built));
    peers.extend(problems.iter().flat_map(|(set, problem)| phical(*set, problem)));
    let times = measure(&mut peers, LINES, ROUNDS);
    table(&peers, &times, own);
    fits(&program, &lines, own);

    let peaks: Vec<String> = peaks.iter().map(|(set, peak)| format!("{} {peak:.1}", set.name())).collect();
    println!(
        "\nPeers built for {}, one thread, {ROUNDS} rounds of {LINES} lines. Peak in GFLOP/s: {}.",
        built.name(),
        peaks.join(", ")
    );
    if built == InstructionSet::Baseline {
        println!("Without RUSTFLAGS=\"-C target-cpu=...\" the peers have no wide vectors and no fused multiply-add.");
    }
}
