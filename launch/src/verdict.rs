//! How a run ended: one exit code, one message.

use crate::stop::Stop;
use crate::supervise::{End, Outcome, log_path};
use interface_defs::toolkit::exit::Exit;
use std::fmt::Write;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::ExitStatus;

/// Lines of a log that are quoted.
const QUOTED: usize = 10;

/// What became of the run that `leader` led; `Ok` if it is done.
pub fn verdict(outcome: &Outcome, leader: &str, log: &Path) -> Result<(), Stop> {
    let at = outcome.ends.iter().position(|end| end.name == leader);
    let Some(at) = at else { return Err(Stop::failed(format!("{leader} was never started"))) };
    let lead = &outcome.ends[at];
    // Who ended first, before its time: the cause, unless the leader names another one.
    let first = outcome.ends[..at].first().filter(|end| !end.forced);
    if lead.status.success() {
        return Ok(());
    }
    if outcome.interrupted {
        return Err(Stop::failed("interrupted"));
    }
    if lead.forced {
        return Err(match first {
            Some(end) => lost(end, log),
            None => Stop::failed(format!("{leader} did not end and was ended")),
        });
    }
    if lead.status.code().is_none() {
        return Err(lost(lead, log));
    }
    let exit = match lead.status.code() {
        Some(2) => Exit::BadInput,
        Some(3) => Exit::Unreliable,
        _ => Exit::Failed,
    };
    let Some(mut message) = error_in(&read(log, leader)) else {
        return Err(match exit {
            Exit::Unreliable => {
                Stop { exit, message: format!("{leader} ended with exit code 3: unreliable") }
            }
            _ => lost(lead, log),
        });
    };
    if let Some(end) = first.filter(|end| message.contains(&format!("{} was lost", end.name))) {
        let _ = write!(message, "\n{} ended: {}{}", end.name, how(end.status), quote(log, end.name));
    }
    Err(Stop { exit, message })
}

/// A process that ended without a word from the leader about it.
fn lost(end: &End, log: &Path) -> Stop {
    let cause = error_in(&read(log, end.name));
    match (end.status.code(), cause) {
        (Some(2), Some(cause)) => Stop::input(format!("{}: {cause}", end.name)),
        (Some(_), Some(cause)) => Stop::failed(format!("{} failed: {cause}", end.name)),
        (Some(0), None) => {
            Stop::failed(format!("{} ended before the run was over{}", end.name, quote(log, end.name)))
        }
        _ => Stop::failed(format!("{} was lost ({}){}", end.name, how(end.status), quote(log, end.name))),
    }
}

fn how(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => format!("killed by signal {signal}"),
        (None, None) => "an unknown status".into(),
    }
}

/// The error that a program has reported last: from its `error: ` to the end.
pub fn error_in(text: &str) -> Option<String> {
    let at = text.rfind("\nerror: ").map(|at| at + 1).or(text.starts_with("error: ").then_some(0))?;
    Some(text[at + "error: ".len()..].trim_end().to_owned())
}

fn read(log: &Path, name: &str) -> String {
    String::from_utf8_lossy(&std::fs::read(log_path(log, name)).unwrap_or_default()).into_owned()
}

/// The last lines of a log.
fn quote(log: &Path, name: &str) -> String {
    let text = read(log, name);
    let lines: Vec<&str> = text.lines().collect();
    let path = log_path(log, name);
    if lines.is_empty() {
        return format!("; it printed nothing ({})", path.display());
    }
    let mut out = format!("\nlast lines of {}:", path.display());
    for line in &lines[lines.len().saturating_sub(QUOTED)..] {
        let _ = write!(out, "\n  | {line}");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const KILLED: i32 = 9;

    fn code(code: i32) -> i32 {
        code << 8
    }

    fn judge(
        ends: &[(&'static str, i32, bool)],
        interrupted: bool,
        logs: &[(&str, &str)],
    ) -> Result<(), Stop> {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        for (name, text) in logs {
            std::fs::write(log_path(dir, name), text).expect("written");
        }
        let ends = ends
            .iter()
            .map(|&(name, raw, forced)| End { name, status: ExitStatus::from_raw(raw), forced })
            .collect();
        verdict(&Outcome { ends, interrupted }, "coupler", dir)
    }

    #[test]
    fn a_run_is_done_when_its_leader_says_so() {
        assert_eq!(judge(&[("dem", 0, false), ("fem", 0, false), ("coupler", 0, false)], false, &[]), Ok(()));
        assert_eq!(judge(&[("coupler", 0, false), ("fem", KILLED, true)], true, &[]), Ok(()));
    }

    #[test]
    fn the_message_of_the_coupler_is_told_and_the_log_of_the_lost_one_quoted() {
        let logs =
            [("coupler", "INFO x\nerror: fem was lost: its process ended in window 3\n"), ("fem", "a\nb\n")];
        let stop = judge(
            &[("fem", KILLED, false), ("dem", code(1), false), ("coupler", code(1), false)],
            false,
            &logs,
        )
        .expect_err("failed");
        assert_eq!(stop.exit, Exit::Failed);
        let expected =
            "fem was lost: its process ended in window 3\nfem ended: killed by signal 9\nlast lines of ";
        assert!(stop.message.starts_with(expected), "{}", stop.message);
        assert!(stop.message.ends_with("fem.log:\n  | a\n  | b"), "{}", stop.message);
    }

    #[test]
    fn a_failure_of_the_coupling_itself_quotes_nobody() {
        let logs = [
            ("coupler", "error: window 3: not converged\ntry less\n"),
            ("dem", "error: ended by the coupler\n"),
        ];
        let stop =
            judge(&[("dem", code(1), false), ("coupler", code(1), false)], false, &logs).expect_err("failed");
        assert_eq!(stop, Stop::failed("window 3: not converged\ntry less"));
        let logs = [("coupler", "error: s.toml:3:1: no\n")];
        assert_eq!(judge(&[("coupler", code(2), false)], false, &logs), Err(Stop::input("s.toml:3:1: no")));
    }

    #[test]
    fn a_run_beyond_a_bound_of_trust_is_unreliable_with_the_words_of_its_leader() {
        let logs = [("coupler", "error: unreliable: energy_error is 48 %\n")];
        for (logs, says) in [
            (&logs[..], "unreliable: energy_error is 48 %"),
            (&[], "coupler ended with exit code 3: unreliable"),
        ] {
            let stop = judge(&[("coupler", code(3), false)], false, logs).expect_err("unreliable");
            assert_eq!(stop, Stop { exit: Exit::Unreliable, message: says.into() });
        }
    }

    #[test]
    fn a_coupler_that_is_killed_is_named() {
        let stop =
            judge(&[("coupler", KILLED, false), ("dem", code(1), false)], false, &[]).expect_err("failed");
        assert!(stop.message.starts_with("coupler was lost (killed by signal 9)"), "{}", stop.message);
    }

    #[test]
    fn who_ended_before_the_coupler_could_see_it_is_named_with_its_own_words() {
        let coupler = ("coupler", code(1), true);
        let logs = [("coupler", "error: interrupted\n"), ("fem", "error: s.toml:1:2: no such law\n")];
        let stop = judge(&[("fem", code(2), false), coupler], false, &logs).expect_err("failed");
        assert_eq!(stop, Stop::input("fem: s.toml:1:2: no such law"));
        let stop = judge(&[("fem", 0, false), coupler], false, &logs[..1]).expect_err("failed");
        assert!(
            stop.message.starts_with("fem ended before the run was over; it printed nothing"),
            "{}",
            stop.message
        );
    }

    #[test]
    fn an_interrupted_run_says_so_and_nothing_else() {
        let ends = [("coupler", code(1), false), ("dem", KILLED, true)];
        assert_eq!(
            judge(&ends, true, &[("coupler", "error: interrupted\n")]),
            Err(Stop::failed("interrupted"))
        );
    }
}
