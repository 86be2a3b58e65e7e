//! `rockfall verify`: whether a directory is what its run or study wrote, file by file; and what it is compared with.

use crate::stop::Stop;
use interface_defs::diagnostic::{Severity, code};
use serde_json::json;
use std::path::Path;
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::manifest;

/// Write down what lies in `dir`, after the last file of its run or study. Without that the results are as good as with it.
pub fn seal(dir: &Path) {
    if let Err(e) = manifest::write(dir) {
        tracing::warn!("{}: no manifest: {e}", dir.display());
    }
}

/// The answer, and the exit code. An error: there is nothing to compare with.
pub fn verify(dir: &Path, format: Format) -> Result<(String, Exit), Stop> {
    let name = dir.display();
    if !dir.is_dir() {
        return Err(Stop::input(code::ARGUMENT, format!("{name}: there is no such directory")));
    }
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

    #[test]
    fn what_is_new_is_a_note_and_what_changed_has_another_exit_code_than_what_is_no_run() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        let said = |format| verify(dir, format).expect("a run");
        std::fs::write(dir.join("history.csv"), "time_s\n0\n").expect("written");
        assert_eq!(verify(dir, Format::Text).expect_err("no run").exit, Exit::BadInput);
        assert_eq!(verify(&dir.join("none"), Format::Text).expect_err("not there").exit, Exit::BadInput);
        seal(dir);
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
