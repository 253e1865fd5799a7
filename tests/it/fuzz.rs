//! The corpus of the fuzzer replayed, and mutations of it that know where words begin.
//!
//! `PHICAL_FUZZ=1000000 PHICAL_SEED=7 cargo test --release fuzz` makes so many of each target, and others.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

use crate::shared::project;

#[path = "../fuzz/targets.rs"]
mod targets;

/// No input may take longer; a debug build on a busy machine is allowed for.
const PATIENCE: Duration = Duration::from_secs(20);

/// The corpus of a target, in the order of its names.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(project("tests/fuzz/corpus").join(target)).unwrap().flatten().map(|e| e.path()).collect();
    if target == "model" {
        files.extend(files_below(&project("models")));
        files.extend(files_below(&project("tests/ui")));
    }
    files.sort();
    files.iter().map(|file| fs::read(file).unwrap()).collect()
}

/// All models below a folder, right and wrong ones.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path());
    entries
        .flat_map(|path| match path.is_dir() {
            true => files_below(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|ending| ending == "ron"))
        .collect()
}

/// The words of the fuzzer's dictionary: what stands between the first and the last quote of a line, `\\`, `\"` and `\xAB` meaning
/// one byte.
fn dictionary(target: &str) -> Vec<Vec<u8>> {
    let text = fs::read_to_string(project("tests/fuzz/dictionary").join(target)).unwrap();
    let word = |line: &str| {
        let mut rest = &line.as_bytes()[line.find('"')? + 1..line.rfind('"')?];
        let mut word = Vec::new();
        while let [first, after @ ..] = rest {
            (rest, _) = match (first, after) {
                (b'\\', [b'x', hex @ ..]) => {
                    let digits = std::str::from_utf8(&hex[..2]).expect("two digits");
                    (&hex[2..], word.push(u8::from_str_radix(digits, 16).expect("a byte")))
                }
                (b'\\', [byte, after @ ..]) => (after, word.push(*byte)),
                _ => (after, word.push(*first)),
            };
        }
        Some(word)
    };
    text.lines().filter_map(word).collect()
}

fn env(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |n| n.parse().expect("a number"))
}

/// Where words, numbers and signs begin, and the end.
fn joints(text: &[u8]) -> Vec<usize> {
    let kind = |byte: u8| match byte {
        b'0'..=b'9' | b'.' => 0,
        b'a'..=b'z' | b'A'..=b'Z' | b'_' | 128.. => 1,
        b' ' | b'\n' => 2,
        other => 3 + other,
    };
    let mut found: Vec<usize> = (0..text.len()).filter(|&at| at == 0 || kind(text[at - 1]) != kind(text[at])).collect();
    found.push(text.len());
    found
}

/// A few words taken out, doubled, exchanged for those of another input or of the dictionary, or a byte changed.
fn mutated(all: &[Vec<u8>], words: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    let pick = |random: &mut ChaCha8Rng, most: usize| random.random_range(0..most.max(1));
    let mut text = all[pick(random, all.len())].clone();
    for _ in 0..1 + pick(random, 4) {
        let places = joints(&text);
        let from = pick(random, places.len());
        let to = (from + pick(random, 6)).min(places.len() - 1);
        let part = places[from]..places[to];
        let new = match random.random_range(0..6) {
            0 => Vec::new(),
            1 => text[part.clone()].repeat(2),
            2 => {
                let other = &all[pick(random, all.len())];
                let places = joints(other);
                let from = pick(random, places.len());
                other[places[from]..places[(from + pick(random, 12)).min(places.len() - 1)]].to_vec()
            }
            3 | 4 => words[pick(random, words.len())].clone(),
            _ => text[part.clone()].iter().map(|byte| byte ^ (1 << random.random_range(0..7))).collect(),
        };
        text.splice(part, new);
    }
    text
}

fn fuzzed(name: &str) {
    let (_, target) = targets::TARGETS.into_iter().find(|(known, _)| *known == name).expect("a target");
    let run = |data: &[u8]| {
        let begun = Instant::now();
        target(data);
        let text = String::from_utf8_lossy(data);
        assert!(begun.elapsed() < PATIENCE, "{name} takes {:?}: {text}", begun.elapsed());
    };
    let (all, words) = (corpus(name), dictionary(name));
    all.iter().for_each(|data| run(data));
    let mut random = ChaCha8Rng::seed_from_u64(env("PHICAL_SEED", 1));
    for _ in 0..env("PHICAL_FUZZ", 2000) {
        let data = mutated(&all, &words, &mut random);
        let survived = std::panic::catch_unwind(|| run(&data));
        assert!(survived.is_ok(), "{name}: {:?}", String::from_utf8_lossy(&data));
    }
}

#[test]
fn models_of_any_bytes() {
    fuzzed("model");
}

#[test]
fn expressions_of_any_bytes() {
    fuzzed("expression");
}

#[test]
fn tables_of_any_bytes() {
    fuzzed("csv");
}

#[test]
fn fits_of_any_bytes() {
    fuzzed("fit");
}

#[test]
fn matrices_of_any_bytes() {
    fuzzed("matrix");
}

#[test]
fn robots_of_any_bytes() {
    fuzzed("import");
}

#[test]
fn the_corpus_is_small() {
    let bytes: usize = targets::TARGETS.iter().flat_map(|(name, _)| corpus(name)).map(|data| data.len()).sum();
    assert!(bytes < 200_000, "{bytes} bytes");
}
