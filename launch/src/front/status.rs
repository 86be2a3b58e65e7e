//! `rockfall status`: how far a run, a study or a test for approval is, by the files in its directory; `rockfall verify`: whether that is what its run or
//! study wrote. Nothing is started or changed.

use crate::approve;
use crate::front::stop::Stop;
use crate::run::progress::far;
use crate::worst;
use interface_defs::diagnostic::{Severity, code};
use serde_json::json;
use std::path::{Display, Path};
use std::time::SystemTime;
use toolkit::check::Format;
use toolkit::checkpoint::{self, Found};
use toolkit::exit::Exit;
use toolkit::files::{self, Dir};
use toolkit::manifest;
use toolkit::owner::holder;
use toolkit::run_dir::{BARRIER, CHUNK_ENDS, CHUNKS, HISTORY, JOURNAL, MEMBERS, STUDY_RECORD, SUMMARY};
use toolkit::summary::{RunStatus, Summary};

/// The text for the screen, and the exit code.
pub fn status(dir: &Path) -> Result<(String, Exit), Stop> {
    let name = there(dir)?;
    let running = holder(dir).map(|(_, process)| match process {
        Some(pid) => format!("process {pid} is writing to it"),
        None => "a process is writing to it".into(),
    });
    if dir.join(STUDY_RECORD).exists() {
        let study: serde_json::Value = files::read_json(&dir.join(STUDY_RECORD)).unwrap_or_default();
        return Ok(of_study(dir, study["members"].as_u64().unwrap_or(0), running));
    }
    if approve::is_one(dir) {
        return Ok(approve::status(dir, running));
    }
    if dir.join(SUMMARY).exists() {
        return ended(dir, true);
    }
    if !dir.join(HISTORY).exists() {
        let none = || {
            let what = format!("{name}: there is no run and no study in this directory");
            Stop::input(code::RESULT_DIRECTORY, what)
        };
        let prepared = |running| (format!("{name}: a run is being prepared, {running}\n"), Exit::Done);
        return running.map(prepared).ok_or_else(none);
    }
    let (far, seen) = (far(dir), age(&dir.join(HISTORY)));
    Ok(match running {
        Some(running) => {
            let kept = last_checkpoint(dir);
            (format!("{name}: still running: {far}; last row {seen}; {kept}; {running}\n"), Exit::Done)
        }
        None => {
            let killed = "no process of this machine is writing to it: it was killed";
            let text = format!("{name}: a run without an end: {far}; last row {seen}; {killed}\n");
            (text + &resumable(dir), Exit::Failed)
        }
    })
}

/// The name of a directory, which must be there.
fn there(dir: &Path) -> Result<Display<'_>, Stop> {
    let none = || {
        let is = if dir.exists() {
            "this is a file, and the directory of results is asked for here"
        } else {
            "there is no such directory"
        };
        Stop::input(code::ARGUMENT, format!("{}: {is}", dir.display()))
    };
    dir.is_dir().then(|| dir.display()).ok_or_else(none)
}

/// A run or a study that has a summary.
fn ended(dir: &Path, of_run: bool) -> Result<(String, Exit), Stop> {
    let summary = Summary::read(dir).map_err(|e| {
        Stop::failed(code::FILE_CONTENT, format!("{}: {SUMMARY} cannot be read: {e}", dir.display()))
    })?;
    let mut text = format!("{}: {}\n", dir.display(), summary.status.word());
    for sentence in summary.sentences().into_iter().chain(summary.message) {
        text += &format!("  {sentence}\n");
    }
    if of_run && matches!(summary.status, RunStatus::Failed | RunStatus::Interrupted) {
        text += &resumable(dir);
    }
    Ok((text, Exit::of(summary.status)))
}

/// From where a run can go on.
fn resumable(dir: &Path) -> String {
    match Found::of(dir).newest {
        Some(newest) => {
            let kept = last_checkpoint(dir);
            format!("  rockfall run ... --resume goes on at t = {:.6} s; {kept}\n", newest.time)
        }
        None => "  there is no checkpoint to go on from\n".into(),
    }
}

fn of_study(dir: &Path, members: u64, running: Option<String>) -> (String, Exit) {
    if let Ok((text, exit)) = ended(dir, false) {
        return with_barrier(dir, text, exit);
    }
    let mut lines = 0_u64;
    let mut count = |bytes: &[u8]| {
        lines += bytes.iter().filter(|byte| **byte == b'\n').count() as u64;
        Ok(())
    };
    // A table that cannot be read has no rows.
    let _ = files::source(&dir.join(MEMBERS)).and_then(|file| files::in_chunks(file, &mut count));
    let rows = lines.saturating_sub(1);
    let share = |count: u64| 100.0 * count as f64 / members.max(1) as f64;
    let (complete, begun) = chunks(&dir.join(CHUNKS));
    let of_chunks: u64 = complete.iter().map(|[first, last]| last + 1 - first).sum();
    let mut text = format!("{}: a study of {members} members\n", dir.display());
    if dir.join(MEMBERS).exists() {
        let (share, age) = (share(rows), age(&dir.join(MEMBERS)));
        text += &format!("  {rows} rows in {MEMBERS}, {share:.1} %; last row {age}\n");
    }
    if !complete.is_empty() || !begun.is_empty() {
        let (share, complete, parts) = (share(of_chunks), complete.len(), begun.len());
        text += &format!(
            "  {complete} chunks complete, {of_chunks} members, {share:.1} %; {parts} chunks begun\n"
        );
        for [first, last] in begun {
            text += &format!("  begun: {first}..{last}\n");
        }
    }
    match running {
        Some(running) => text += &format!("  {running}\n"),
        None if of_chunks >= members => {
            text += "  all members are there: rockfall ensemble without --members collects them\n";
        }
        None => {
            text += "  no process of this machine is collecting: the same command with --resume goes on\n";
            // Tasks on other machines are not seen from here; who has begun to collect is.
            if dir.join(CHUNKS).join(JOURNAL).exists() {
                return (text, Exit::Failed);
            }
        }
    }
    (text, Exit::Done)
}

/// A study that has ended, and how far the runs against its barrier are where there are any.
fn with_barrier(dir: &Path, mut text: String, exit: Exit) -> (String, Exit) {
    let barrier = dir.join(BARRIER);
    let Some((done, all)) = worst::progress(&barrier) else { return (text, exit) };
    text += &format!("  barrier: {done} of {all} members run\n");
    if let Ok(summary) = Summary::read(&barrier) {
        text += &format!("  barrier: {}\n", summary.status.word());
        for sentence in worst::outcome(&summary).into_iter().chain(summary.message) {
            text += &format!("    {sentence}\n");
        }
        let of_barrier = Exit::of(summary.status);
        return (text, if exit == Exit::Done { of_barrier } else { exit });
    }
    let (at_work, exit) = match [dir, &barrier].into_iter().find_map(holder) {
        Some((_, Some(pid))) => (format!("process {pid} is at work"), exit),
        Some((_, None)) => ("a process is at work".into(), exit),
        None => ("no process of this machine is at work: the same command goes on".into(), Exit::Failed),
    };
    (text + &format!("  {at_work}\n"), exit)
}

/// Ranges of complete chunks and of those at work, by their names.
fn chunks(dir: &Path) -> (Vec<[u64; 2]>, Vec<[u64; 2]>) {
    let (mut complete, mut begun) = (Vec::new(), Vec::new());
    let entries = Dir::open(dir).and_then(|dir| dir.entries()).unwrap_or_default();
    for (name, _) in &entries {
        let path = Path::new(name);
        let (Some(stem), Some(end)) = (path.file_stem(), path.extension()) else { continue };
        let range = stem.to_str().and_then(|s| s.split_once('-'));
        let Some((Ok(first), Ok(last))) = range.map(|(a, b)| (a.parse(), b.parse())) else { continue };
        match CHUNK_ENDS.iter().position(|known| end == *known) {
            Some(0) => complete.push([first, last]),
            Some(_) => begun.push([first, last]),
            None => {}
        }
    }
    complete.sort_unstable();
    begun.sort_unstable();
    (complete, begun)
}

/// How long ago the last checkpoint was written.
fn last_checkpoint(dir: &Path) -> String {
    let since = checkpoint::age(dir).map(|age| format!("last checkpoint {} s ago", age.as_secs()));
    since.unwrap_or("no checkpoint yet".into())
}

/// How long ago a file was written.
fn age(path: &Path) -> String {
    let written = path.symlink_metadata().and_then(|about| about.modified()).ok();
    let age = written.and_then(|time| SystemTime::now().duration_since(time).ok()).unwrap_or_default();
    format!("{} s ago", age.as_secs())
}

/// The answer, and the exit code. An error: there is nothing to compare with.
pub fn verify(dir: &Path, format: Format) -> Result<(String, Exit), Stop> {
    let name = there(dir)?;
    let found = manifest::verify(dir);
    if let Some(none) = found.iter().find(|what| what.code == code::RESULT_DIRECTORY) {
        return Err(none.clone().into());
    }
    let changed = found.iter().filter(|what| what.severity == Severity::Error).count();
    let text = match format {
        Format::Json => {
            let answer = json!({ "directory": name.to_string(), "changed": changed, "diagnostics": found });
            format!("{answer}\n")
        }
        Format::Text => {
            let outcome = match changed {
                0 => "all files are as they were written".into(),
                n => format!("{n} files are not as they were written"),
            };
            found.iter().fold(format!("{name}: {outcome}\n"), |text, what| text + &format!("  {what}\n"))
        }
    };
    Ok((text, if changed == 0 { Exit::Done } else { Exit::Failed }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::verdict::{Ending, Fate, Verdict};
    use std::fs::File;
    use std::time::Duration;
    use toolkit::run_dir::{CHECKPOINT, SCENE};

    #[test]
    fn a_run_is_as_far_as_its_last_whole_row() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        assert_eq!(status(dir).expect_err("nothing there").exit, Exit::BadInput);
        assert_eq!(status(&dir.join("none")).expect_err("not there").exit, Exit::BadInput);
        std::fs::write(dir.join(SCENE), "end_time = 8\n").expect("written");
        std::fs::write(dir.join(HISTORY), "time_s,a\n0,1\n2,1\n4,").expect("written");
        let (text, exit) = status(dir).expect("a run");
        assert!(text.contains("2.0000 s of 8 s, 25.0 %") && text.contains("it was killed"), "{text}");
        assert_eq!(exit, Exit::Failed);
        assert_eq!(last_checkpoint(dir), "no checkpoint yet");
        std::fs::create_dir(dir.join(CHECKPOINT)).expect("created");
        for (name, past) in [("1.state", 90), ("2.state", 3600)] {
            let file = File::create(dir.join(CHECKPOINT).join(name)).expect("created");
            file.set_modified(SystemTime::now() - Duration::from_secs(past)).expect("set");
        }
        // Rounded down, and a test may be held up.
        let said = last_checkpoint(dir);
        let seconds = said.strip_prefix("last checkpoint ").and_then(|rest| rest.strip_suffix(" s ago"));
        assert!(seconds.and_then(|s| s.parse().ok()).is_some_and(|s: u64| (90..3000).contains(&s)), "{said}");
        let mut summary = Summary::new(RunStatus::Unreliable);
        let position = [1.0, 2.0, 3.0];
        let ending = Ending { fate: Fate::AtRest, time: 7.5, position, speed: 0.0, on_terrain: true };
        summary.verdict.push(Verdict::of("block", ending));
        summary.write(dir).expect("written");
        let (text, exit) = status(dir).expect("a run");
        assert!(text.contains("unreliable\n  rock `block` came to rest"), "{text}");
        assert_eq!(exit, Exit::Unreliable);
    }

    #[test]
    fn a_study_is_as_far_as_its_rows_and_chunks() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        std::fs::write(dir.join(STUDY_RECORD), "{\"members\": 200}").expect("written");
        std::fs::create_dir(dir.join(CHUNKS)).expect("created");
        for name in ["00000001-00000050.chunk", "00000051-00000060.part", "main.journal"] {
            std::fs::write(dir.join(CHUNKS).join(name), "").expect("written");
        }
        std::fs::write(dir.join(MEMBERS), "member\n1\n2\n3\n").expect("written");
        let (text, exit) = status(dir).expect("a study");
        for words in [
            "200 members",
            "3 rows in members.csv, 1.5 %",
            "1 chunks complete, 50 members, 25.0 %",
            "begun: 51..60",
            "--resume",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        // It has begun, has not ended, and no process is at work.
        assert_eq!(exit, Exit::Failed);
        std::fs::remove_file(dir.join(CHUNKS).join(JOURNAL)).expect("removed");
        assert_eq!(status(dir).expect("tasks alone").1, Exit::Done);
    }

    #[test]
    fn runs_against_the_barrier_are_counted() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        let barrier = dir.join(BARRIER);
        std::fs::write(dir.join(STUDY_RECORD), "{\"members\": 200}").expect("written");
        Summary::new(RunStatus::Done).write(dir).expect("written");
        let plain = status(dir).expect("a study");
        assert!(plain.1 == Exit::Done && !plain.0.contains("barrier"), "{}", plain.0);
        std::fs::create_dir_all(barrier.join("17")).expect("created");
        let chosen = r#"{"line": "barrier", "members": 200, "reach": 9, "columns": [], "chosen": [{"member": 17}, {"member": 4}]}"#;
        std::fs::write(barrier.join("chosen.json"), chosen).expect("written");
        crate::run::sweep::keep(&barrier.join("17"), "a scene", ()).expect("written");
        let (text, exit) = status(dir).expect("a study");
        assert!(text.contains("barrier: 1 of 2 members run") && text.contains("goes on"), "{text}");
        assert_eq!(exit, Exit::Failed);
        Summary::new(RunStatus::Unreliable).write(&barrier).expect("written");
        let (text, exit) = status(dir).expect("a study");
        assert!(text.contains("barrier: unreliable"), "{text}");
        assert_eq!(exit, Exit::Unreliable);
    }

    #[test]
    fn a_test_for_approval_is_as_far_as_its_cases_and_the_run_that_has_begun() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        let begun = dir.join("runs/as_defined/sel_1");
        std::fs::create_dir_all(&begun).expect("created");
        let said = || status(dir).expect("a test");
        let text = said().0;
        assert!(text.contains(" cases judged") && text.contains("begun: as_defined/sel_1: "), "{text}");
        crate::run::sweep::keep(&begun, "a scene", ()).expect("written");
        let report = |verdict: &str, all: u64| {
            let cases = json!([{ "case": "as defined", "verdict": verdict }]);
            let report = json!({ "all_cases": all, "stands": "pass (0 of 1 cases failed)", "cases": cases });
            std::fs::write(dir.join("approval.json"), report.to_string()).expect("written");
        };
        report("pass", 3);
        let (text, exit) = said();
        for words in ["1 of 3 cases judged", "  as defined: pass\n", "verdict so far: pass (0 of 1"] {
            assert!(text.contains(words) && !text.contains("begun"), "{words}: {text}");
        }
        assert!(text.contains("the same command goes on") && exit == Exit::Failed, "{text}");
        for (verdict, ends) in [("fail", Exit::Done), ("not_settled", Exit::Unreliable)] {
            report(verdict, 1);
            assert_eq!(said().1, ends);
        }
    }

    #[test]
    fn what_is_new_is_a_note_and_what_changed_has_another_exit_code_than_what_is_no_run() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        let said = |format| verify(dir, format).expect("a run");
        std::fs::write(dir.join("history.csv"), "time_s\n0\n").expect("written");
        assert_eq!(verify(dir, Format::Text).expect_err("no run").exit, Exit::BadInput);
        assert_eq!(verify(&dir.join("none"), Format::Text).expect_err("not there").exit, Exit::BadInput);
        manifest::write(dir).expect("written");
        assert_eq!(said(Format::Text).1, Exit::Done);
        std::fs::write(dir.join("notes.txt"), "mine").expect("written");
        let (text, exit) = said(Format::Text);
        assert!(exit == Exit::Done && text.contains("notes.txt: no file of the run"), "{text}");
        std::fs::write(dir.join("history.csv"), "time_s\n1\n").expect("written");
        let (text, exit) = said(Format::Json);
        let answer: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!((exit, &answer["changed"]), (Exit::Failed, &json!(1)));
        assert_eq!(answer["diagnostics"][0]["code"], "provenance");
        let place = answer["diagnostics"][0]["place"]["file"].as_str().expect("a place");
        assert!(place.ends_with("history.csv"), "{place}");
    }
}
