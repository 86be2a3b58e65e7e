//! Ctrl-C, SIGTERM and a closed terminal: remembered in a flag, so that a run ends in order.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// From now on the first SIGINT, SIGTERM or SIGHUP sets the flag, and the second ends the process at once. A file that
/// reaches its largest size (`ulimit -f`) is an error of the write, and no longer ends the process.
pub fn install() {
    let flag = FLAG.get_or_init(|| Arc::new(AtomicBool::new(false)));
    for signal in ending() {
        // Order matters: at the first signal the flag is still unset when the shutdown looks at it.
        let _ = signal_hook::flag::register_conditional_shutdown(signal, 1, Arc::clone(flag));
        let _ = signal_hook::flag::register(signal, Arc::clone(flag));
    }
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
}

/// The signals that end a run: SIGHUP is none of them where it was ignored at the start, as `nohup` does.
///
/// SIGINT is one even if it was ignored: a shell starts what runs in the background so, and `kill -INT` must reach it.
pub fn ending() -> Vec<i32> {
    let mut signals = vec![SIGINT, SIGTERM];
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    if !ignores(&status, SIGHUP) {
        signals.push(SIGHUP);
    }
    signals
}

/// Whether the process of this `/proc/PID/status` ignores `signal`.
fn ignores(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & (1 << (signal - 1)) != 0)
}

/// Whether a signal has come since [`install`].
pub fn requested() -> bool {
    FLAG.get().is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// From now on this process ends even where it is at work on something that looks at nothing else: ten times a second it is asked
/// whether the process must `end`, and once that has been so for `grace`, `end` is given the reason.
pub fn watch<R>(
    grace: Duration,
    must_end: impl Fn() -> Option<R> + Send + 'static,
    end: impl Fn(R) + Send + 'static,
) {
    std::thread::spawn(move || {
        let mut since: Option<Instant> = None;
        loop {
            std::thread::sleep(LOOK);
            let reason = must_end();
            since = reason.as_ref().map(|_| since.unwrap_or_else(Instant::now));
            if let Some(reason) = reason.filter(|_| since.is_some_and(|since| since.elapsed() > grace)) {
                return end(reason);
            }
        }
    });
}

/// How often a process at work is watched.
const LOOK: Duration = Duration::from_millis(100);

/// Be killed as soon as the thread ends that has started this process.
pub fn end_with_parent() -> std::io::Result<()> {
    Ok(rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ignored_signal_is_read_from_the_mask_of_the_process() {
        let status = "Name:\tx\nSigIgn:\t0000000000000001\nSigCgt:\t0000000000004002\n";
        assert!(ignores(status, SIGHUP) && !ignores(status, SIGINT) && !ignores(status, SIGTERM));
        assert!(!ignores("", SIGHUP));
    }
}
