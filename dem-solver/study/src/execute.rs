//! Members on the cores of this machine. They are computed in any order and handed on in theirs.

use super::base::Base;
use super::record::Record;
use super::runner::Runner;
use interface_defs::ipc::interrupt;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

/// Members that may be computed before one that takes long: what is known of them waits in memory.
const AHEAD: usize = 4096;
/// How long a core waits for the others before it looks again.
const WAIT: Duration = Duration::from_millis(2);

/// Compute the members `todo`, on `threads` threads; `take` gets them in that order. False: a signal, or `take`, has ended it.
pub fn compute(base: &Base, todo: &[u64], threads: usize, mut take: impl FnMut(Record) -> bool) -> bool {
    let (next, taken, ended) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let (to_main, from_all) = channel::<(usize, Option<Record>)>();
    let work = |to_main: std::sync::mpsc::Sender<(usize, Option<Record>)>| {
        let mut runner = Runner::new(base);
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(number) = todo.get(at) else { return };
            while at > taken.load(Ordering::Relaxed) + AHEAD && !ended.load(Ordering::Relaxed) {
                std::thread::sleep(WAIT);
            }
            if ended.load(Ordering::Relaxed) || interrupt::requested() {
                let _ = to_main.send((at, None));
                return;
            }
            let outcome = runner.run(&base.member(*number));
            let record = outcome.map(|(outcome, track)| Record { number: *number, outcome, track });
            let stop = record.is_none();
            if to_main.send((at, record)).is_err() || stop {
                return;
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let to_main = to_main.clone();
            scope.spawn(|| work(to_main));
        }
        drop(to_main);
        let mut early = BTreeMap::new();
        let mut due = 0;
        for (at, record) in from_all {
            early.insert(at, record);
            while let Some(record) = early.remove(&due) {
                due += 1;
                taken.store(due, Ordering::Relaxed);
                if ended.load(Ordering::Relaxed) || !record.is_some_and(&mut take) {
                    ended.store(true, Ordering::Relaxed);
                }
            }
        }
        due == todo.len() && !ended.load(Ordering::Relaxed)
    })
}
