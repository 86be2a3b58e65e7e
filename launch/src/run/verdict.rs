//! What the ends of the processes mean for the run.

use crate::front::stop::Stop;
use crate::run::children::{self, End, Outcome, how};
use interface_defs::diagnostic::{Diagnostic, code};
use std::fmt::Write;
use std::path::Path;
use toolkit::exit::Exit;
use toolkit::files;

/// Lines of a log that are quoted.
const QUOTED: usize = 10;

/// What became of the run that `leader` led; `Ok` if it is done.
pub fn verdict(outcome: &Outcome, leader: &str, log: &Path) -> Result<(), Stop> {
    let at = outcome.ends.iter().position(|end| end.name == leader);
    let Some(at) = at else { return Err(Stop::failed(code::PROCESS, format!("{leader} was never started"))) };
    let lead = &outcome.ends[at];
    // Who ended first, before its time: the cause, unless the leader names another one.
    let first = outcome.ends[..at].first().filter(|end| !end.forced);
    if lead.status.success() {
        return Ok(());
    }
    if outcome.interrupted {
        return Err(Stop::interrupted());
    }
    if lead.forced {
        return Err(match first {
            Some(end) => lost(end, log),
            None => Stop::failed(code::PROCESS, format!("{leader} did not end and was ended")),
        });
    }
    if lead.status.code().is_none() || lead.errors.is_empty() {
        return Err(match lead.exit() {
            exit @ Exit::Unreliable => {
                let what = format!("{leader} ended with exit code 3: unreliable");
                Stop { exit, ..Stop::failed(code::TRUST, what) }
            }
            _ => lost(lead, log),
        });
    }
    let mut errors = lead.errors.clone();
    if let Some(end) = first {
        let key = about(end);
        let is_of = |error: &&mut Diagnostic| error.code == code::PROCESS && error.key.as_ref() == Some(&key);
        if let Some(error) = errors.iter_mut().find(is_of) {
            let _ =
                write!(error.message, "\n{} ended: {}{}", end.name, how(end.status), quote(log, &end.name));
        }
    }
    Err(Stop { exit: lead.exit(), errors })
}

/// The key of the scene that a process stands for.
fn about(end: &End) -> String {
    format!("processes.{}", end.name)
}

/// A process that ended without a word from the leader about it.
fn lost(end: &End, log: &Path) -> Stop {
    let name = &end.name;
    if end.errors.is_empty() {
        let what = match end.status.code() {
            Some(0) => format!("{name} ended before the run was over"),
            _ => format!("{name} was lost ({})", how(end.status)),
        };
        let error = Diagnostic::error(code::PROCESS, what + &quote(log, name)).about(about(end));
        let exit = if end.exit() == Exit::BadInput { Exit::BadInput } else { Exit::Failed };
        return Stop { exit, errors: vec![error] };
    }
    if end.exit() == Exit::BadInput {
        return Stop { exit: Exit::BadInput, errors: end.errors.clone() };
    }
    let mut errors = end.errors.clone();
    errors.iter_mut().for_each(|error| error.message = format!("{name} failed: {}", error.message));
    Stop { exit: Exit::Failed, errors }
}

/// The last lines of a log.
pub fn quote(log: &Path, name: &str) -> String {
    let path = children::log_file(log, name);
    let text = String::from_utf8_lossy(&files::read(&path, files::TEXT).unwrap_or_default()).into_owned();
    let lines: Vec<&str> = text.lines().collect();
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
    use std::os::unix::process::ExitStatusExt;
    use std::process::ExitStatus;

    const KILLED: i32 = 9;

    fn status(code: i32) -> i32 {
        code << 8
    }

    /// `ends`: name, raw status, whether it was forced, what it said.
    fn judge(
        ends: &[(&str, i32, bool, Option<Diagnostic>)],
        interrupted: bool,
        logs: &[(&str, &str)],
    ) -> Result<(), Stop> {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        for (name, text) in logs {
            std::fs::write(children::log_file(dir, name), text).expect("written");
        }
        let end = |(index, (name, raw, forced, said)): (usize, &(&str, i32, bool, Option<Diagnostic>))| End {
            index,
            name: (*name).into(),
            status: ExitStatus::from_raw(*raw),
            forced: *forced,
            stdout: Vec::new(),
            stderr: Vec::new(),
            errors: said.iter().cloned().collect(),
        };
        let ends = ends.iter().enumerate().map(end).collect();
        verdict(&Outcome { ends, interrupted, too_slow: false }, "coupler", dir)
    }

    fn says(what: &str) -> Option<Diagnostic> {
        Some(Diagnostic::error(code::OTHER, what))
    }

    #[test]
    fn a_run_is_done_when_its_leader_says_so() {
        let fine = [("dem", 0, false, None), ("fem", 0, false, None), ("coupler", 0, false, None)];
        assert_eq!(judge(&fine, false, &[]), Ok(()));
        assert_eq!(judge(&[("coupler", 0, false, None), ("fem", KILLED, true, None)], true, &[]), Ok(()));
    }

    #[test]
    fn the_error_of_the_coupler_stays_and_the_log_of_the_lost_one_is_quoted() {
        let what = "fem was lost: its process ended in window 3";
        let of_process = |key: &str| Some(Diagnostic::error(code::PROCESS, what).about(key));
        let ends = |key| {
            let said = of_process(key);
            [
                ("fem", KILLED, false, None),
                ("dem", status(1), false, None),
                ("coupler", status(1), false, said),
            ]
        };
        let stop = judge(&ends("processes.fem"), false, &[("fem", "a\nb\n")]).expect_err("failed");
        assert_eq!((stop.exit, stop.errors.len()), (Exit::Failed, 1));
        let message = &stop.errors[0].message;
        assert!(
            message.starts_with(&format!("{what}\nfem ended: killed by signal 9\nlast lines of ")),
            "{message}"
        );
        assert!(message.ends_with("fem.log:\n  | a\n  | b"), "{message}");
        // It decides by the key, and not by the words.
        let other = judge(&ends("processes.dem"), false, &[("fem", "a\nb\n")]).expect_err("failed");
        assert_eq!(other.errors[0].message, what);
    }

    #[test]
    fn a_failure_of_the_coupling_itself_quotes_nobody() {
        let coupler = ("coupler", status(1), false, says("window 3: not converged"));
        let stop = judge(&[("dem", status(1), false, says("ended by the coupler")), coupler], false, &[]);
        assert_eq!(stop, Err(Stop::failed(code::OTHER, "window 3: not converged")));
        assert_eq!(
            judge(&[("coupler", status(2), false, says("no"))], false, &[]),
            Err(Stop::input(code::OTHER, "no"))
        );
    }

    #[test]
    fn a_run_beyond_a_bound_of_trust_is_unreliable_with_the_words_of_its_leader() {
        for (said, due) in [
            (says("unreliable: energy_error is 48 %"), "unreliable: energy_error is 48 %"),
            (None, "coupler ended with exit code 3: unreliable"),
        ] {
            let stop = judge(&[("coupler", status(3), false, said)], false, &[]).expect_err("unreliable");
            assert_eq!((stop.exit, stop.errors[0].message.as_str()), (Exit::Unreliable, due));
        }
    }

    /// What a program of others prints is quoted, and decides nothing.
    #[test]
    fn who_says_nothing_as_data_is_quoted() {
        let log = [("coupler", "error: s.toml:1:2: no such law\n")];
        let stop = judge(&[("coupler", status(1), false, None)], false, &log).expect_err("failed");
        assert!(
            stop.errors[0].message.starts_with("coupler was lost (exit code 1)\nlast lines of"),
            "{stop:?}"
        );
        assert!(stop.errors[0].message.ends_with("  | error: s.toml:1:2: no such law"), "{stop:?}");
    }

    #[test]
    fn a_coupler_that_is_killed_is_named() {
        let ends = [("coupler", KILLED, false, None), ("dem", status(1), false, None)];
        let stop = judge(&ends, false, &[]).expect_err("failed");
        assert!(stop.errors[0].message.starts_with("coupler was lost (killed by signal 9)"), "{stop:?}");
    }

    #[test]
    fn who_ended_before_the_coupler_could_see_it_is_named_with_its_own_words() {
        let coupler = || ("coupler", status(1), true, says("interrupted"));
        let stop = judge(&[("fem", status(2), false, says("no such law")), coupler()], false, &[]);
        assert_eq!(stop, Err(Stop::input(code::OTHER, "no such law")));
        let stop = judge(&[("fem", 0, false, None), coupler()], false, &[]).expect_err("failed");
        assert!(
            stop.errors[0].message.starts_with("fem ended before the run was over; it printed nothing"),
            "{stop:?}"
        );
    }

    #[test]
    fn an_interrupted_run_says_so_and_nothing_else() {
        let ends = [("coupler", status(1), false, says("interrupted")), ("dem", KILLED, true, None)];
        assert_eq!(judge(&ends, true, &[]), Err(Stop::interrupted()));
    }
}
