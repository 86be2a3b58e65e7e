//! Fuzzing on a stable compiler: each reader of `tests::readers` gets mutations of its corpus for some seconds.
//!
//! ```sh
//! cargo run --release -p tests --example fuzz -- 60 [TARGET]
//! ```
//! A panic, or a reader that takes more than ten seconds, ends it with exit code 1; the bytes are kept in `tests/fuzz/crashes`.

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tests::readers::TARGETS;
use tests::repository;

/// Longest that a reader may take for one input.
const LONGEST: Duration = Duration::from_secs(10);

/// A change of bytes: where, as a share of the length, and what.
#[derive(Debug, Clone)]
enum Change {
    Set(f64, u8),
    Flip(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Number(f64, u64),
    Double(f64, usize),
}

fn change() -> impl Strategy<Value = Change> {
    let numbers = prop_oneof![
        Just(0),
        Just(u64::MAX),
        Just(1 << 31),
        Just(1 << 32),
        Just(i64::MAX as u64),
        any::<u64>()
    ];
    let texts = prop::sample::select(vec![
        "-1",
        "1e308",
        "nan",
        "99999999999",
        "0",
        "\n",
        " ",
        "[[",
        "\"",
        "=",
        "\u{fc}",
    ]);
    prop_oneof![
        (0.0..1.0, any::<u8>()).prop_map(|(at, byte)| Change::Set(at, byte)),
        (0.0..1.0, 0_u8..8).prop_map(|(at, bit)| Change::Flip(at, 1 << bit)),
        (0.0..1.0, prop::collection::vec(any::<u8>(), 1..9))
            .prop_map(|(at, bytes)| Change::Insert(at, bytes)),
        (0.0..1.0, texts).prop_map(|(at, text)| Change::Insert(at, text.into())),
        (0.0..1.0, 1_usize..64).prop_map(|(at, count)| Change::Remove(at, count)),
        (0.0..1.0, numbers).prop_map(|(at, number)| Change::Number(at, number)),
        (0.0..1.0, 1_usize..64).prop_map(|(at, count)| Change::Double(at, count)),
    ]
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let place = |share: &f64| ((share * bytes.len() as f64) as usize).min(bytes.len());
        match self {
            Self::Set(at, byte) | Self::Flip(at, byte) if !bytes.is_empty() => {
                let at = place(at).min(bytes.len() - 1);
                bytes[at] = if matches!(self, Self::Set(..)) { *byte } else { bytes[at] ^ byte };
            }
            Self::Set(..) | Self::Flip(..) => {}
            Self::Insert(at, more) => {
                let at = place(at);
                bytes.splice(at..at, more.iter().copied());
            }
            Self::Remove(at, count) => {
                let at = place(at);
                bytes.drain(at..(at + count).min(bytes.len()));
            }
            Self::Number(at, number) => {
                let (at, end) = (place(at), bytes.len());
                bytes.splice(at..(at + 8).min(end), number.to_le_bytes());
            }
            Self::Double(at, count) => {
                let at = place(at);
                let part = bytes[at..(at + count).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
        }
    }
}

fn corpus(name: &str) -> Vec<Vec<u8>> {
    let entries =
        std::fs::read_dir(repository().join("tests/fuzz/corpus").join(name)).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    let mut all: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).expect("a file")).collect();
    all.push(Vec::new());
    all
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seconds: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(10);
    let only = arguments.next();
    std::panic::set_hook(Box::new(|_| {}));
    let mut bad = 0;
    for target in TARGETS.iter().filter(|target| only.as_deref().is_none_or(|name| name == target.name)) {
        let begun = Instant::now();
        let seeds = corpus(target.name);
        let mut runner = TestRunner::deterministic();
        let strategy = (0..seeds.len(), prop::collection::vec(change(), 0..6));
        let (mut count, mut slowest) = (0_u64, Duration::ZERO);
        while begun.elapsed() < Duration::from_secs(seconds) {
            let (seed, changes) = strategy.new_tree(&mut runner).expect("a value").current();
            let mut bytes = seeds[seed].clone();
            changes.iter().for_each(|change| change.apply(&mut bytes));
            let dir = tempfile::tempdir().expect("a directory");
            let started = Instant::now();
            let read = catch_unwind(AssertUnwindSafe(|| (target.read)(dir.path(), &bytes)));
            slowest = slowest.max(started.elapsed());
            count += 1;
            if read.is_err() || started.elapsed() > LONGEST {
                let kept = repository().join("tests/fuzz/crashes").join(format!("{}-{count}", target.name));
                std::fs::create_dir_all(kept.parent().expect("a folder")).expect("a directory");
                std::fs::write(&kept, &bytes).expect("written");
                println!(
                    "{}: {} kept in {}",
                    target.name,
                    if read.is_err() { "panic" } else { "slow" },
                    kept.display()
                );
                bad += 1;
                break;
            }
        }
        println!("{:16} {:2} seeds, {count} inputs, slowest {slowest:.1?}", target.name, seeds.len() - 1);
    }
    std::process::exit(i32::from(bad > 0));
}
