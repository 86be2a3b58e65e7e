//! Fuzzing on a stable compiler: each reader of `tests::readers` gets mutations of its corpus for some seconds.
//!
//! ```sh
//! cargo run --release -p tests --example fuzz -- 60 [TARGET]...
//! cargo run --release -p tests --example fuzz -- read TARGET FILE
//! cargo run --release -p tests --example fuzz -- names
//! cargo run --release -p tests --example fuzz -- seeds DIR
//! ```
//! A panic, or a reader that takes more than ten seconds, ends it with exit code 1; the bytes are kept in `tests/fuzz/crashes`. Those of an
//! abort are still in `rockfall-fuzz-TARGET` of the temporary directory. `names` prints
//! the readers, `seeds` writes their seeds into a folder each, for another fuzzer.

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tests::readers::{TARGETS, Target};
use tests::{repository, seeds};

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

/// Write the seeds of all readers to `dir`.
fn write_seeds(dir: &Path) {
    for target in TARGETS {
        let own = dir.join(target.name);
        std::fs::create_dir_all(&own).expect("a directory");
        for (number, seed) in seeds(target).iter().enumerate() {
            std::fs::write(own.join(format!("seed-{number}")), seed).expect("written");
        }
    }
}

/// What a reader makes of one file.
fn read_once(name: &str, file: &Path) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("the name of a reader");
    let (dir, started) = (tempfile::tempdir().expect("a directory"), Instant::now());
    let accepted = (target.read)(dir.path(), &std::fs::read(file).expect("a file"));
    println!("{name}: {} after {:.1?}", if accepted { "accepted" } else { "refused" }, started.elapsed());
}

/// Keep the bytes by which a reader fell.
fn keep(name: &str, how: &str, bytes: &[u8]) {
    let kept = repository().join("tests/fuzz/crashes").join(format!("{name}-{how}"));
    std::fs::create_dir_all(kept.parent().expect("a folder")).expect("a directory");
    std::fs::write(&kept, bytes).expect("written");
    println!("{name}: {how}, kept in {}", kept.display());
}

/// The input that is being read, since when.
type UnderWay = Mutex<Option<(Instant, Vec<u8>)>>;

/// End the process when a reader takes too long: one that hangs does not come back.
fn watch(name: &'static str, under_way: &UnderWay) -> ! {
    loop {
        std::thread::sleep(Duration::from_secs(1));
        if let Some((since, bytes)) = &*under_way.lock().expect("no panic holds it")
            && since.elapsed() > LONGEST
        {
            keep(name, "slow", bytes);
            std::process::exit(1);
        }
    }
}

/// Mutations of the seeds for so long; whether nothing fell.
fn fuzz(target: &Target, time: Duration) -> bool {
    let (begun, mut seeds, name) = (Instant::now(), seeds(target), target.name);
    seeds.push(Vec::new());
    let last = std::env::temp_dir().join(format!("rockfall-fuzz-{name}"));
    let under_way = Arc::new(UnderWay::default());
    let watched = under_way.clone();
    std::thread::spawn(move || watch(name, &watched));
    // Each run goes where none has been.
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &rand_seed());
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    let strategy = (0..seeds.len(), prop::collection::vec(change(), 0..6));
    let (mut count, mut accepted, mut slowest) = (0_u64, 0_u64, Duration::ZERO);
    let mut fell = false;
    while begun.elapsed() < time && !fell {
        let (seed, changes) = strategy.new_tree(&mut runner).expect("a value").current();
        let mut bytes = seeds[seed].clone();
        changes.iter().for_each(|change| change.apply(&mut bytes));
        let dir = tempfile::tempdir().expect("a directory");
        std::fs::write(&last, &bytes).expect("written");
        let started = Instant::now();
        *under_way.lock().expect("no panic holds it") = Some((started, bytes.clone()));
        let read = catch_unwind(AssertUnwindSafe(|| (target.read)(dir.path(), &bytes)));
        *under_way.lock().expect("no panic holds it") = None;
        slowest = slowest.max(started.elapsed());
        count += 1;
        accepted += u64::from(matches!(read, Ok(true)));
        fell = read.is_err();
        if fell {
            keep(name, "panic", &bytes);
        }
    }
    let _ = std::fs::remove_file(last);
    let seeds = seeds.len() - 1;
    println!("{name:24} {seeds:2} seeds, {count:8} inputs, {accepted:8} accepted, slowest {slowest:.1?}");
    !fell
}

fn rand_seed() -> [u8; 32] {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970");
    let mut seed = [0; 32];
    seed[..16].copy_from_slice(&now.as_nanos().to_le_bytes());
    seed
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.first().map(String::as_str) {
        Some("names") => return TARGETS.iter().for_each(|target| println!("{}", target.name)),
        Some("read") => return read_once(&words[1], Path::new(&words[2])),
        Some("seeds") => return write_seeds(Path::new(words.get(1).expect("a directory"))),
        _ => {}
    }
    let seconds = words.first().map_or(10, |text| text.parse().expect("seconds"));
    let only = words.get(1..).unwrap_or_default();
    if std::env::var_os("FUZZ_SHOW").is_none() {
        std::panic::set_hook(Box::new(|_| {}));
    }
    let wanted =
        TARGETS.iter().filter(|target| only.is_empty() || only.iter().any(|name| name == target.name));
    let fell = wanted.filter(|target| !fuzz(target, Duration::from_secs(seconds))).count();
    std::process::exit(i32::from(fell > 0));
}
