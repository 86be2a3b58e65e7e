//! What a study was computed from, and what of it has changed since.

use super::base::Base;
use interface_defs::diagnostic::Diagnostic;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use toolkit::files;
use toolkit::input_file::{self, hash, named_files, with_absolute_files};
use toolkit::scene::Scene;

/// What `base` is computed from: program, every `--set`, and the hashes of all files that are read, by path.
pub fn record(base: &Base, file: &Scene) -> Result<Value, Diagnostic> {
    let mut inputs = Map::new();
    for scene in [file, &base.scene] {
        let mut table = scene.document()?;
        with_absolute_files(&mut table, scene)?;
        let (text, barrier) = scene.parts();
        for path in named_files(&table).into_iter().chain(barrier.map(absolute)) {
            let name = path.display().to_string();
            inputs.insert(name, hash(&input_file::read(&path, files::STATE)?).into());
        }
        // As it was read.
        inputs.insert(absolute(scene.path()).display().to_string(), hash(text.as_bytes()).into());
    }
    Ok(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "study": file.path().display().to_string(),
        "scene": base.scene.path().display().to_string(),
        "sets": file.sets().collect::<Vec<_>>(),
        "shortcuts": base.shortcuts,
        "members": base.members(),
        "inputs": inputs,
        "fingerprint": base.fingerprint,
    }))
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// What differs between two records, in words.
pub fn changes(before: &Value, now: &Value) -> String {
    let mut all = Vec::new();
    let other = || "it was computed by another program".to_owned();
    // Of a program that recorded no more than the name.
    if before["inputs"].is_null() {
        return other();
    }
    if before["version"] != now["version"] {
        all.push(format!("it was computed by version {}", before["version"].as_str().unwrap_or("?")));
    }
    if before["shortcuts"] != now["shortcuts"] {
        all.push("--no-shortcuts is not as it was".into());
    }
    let sets = |of: &Value| -> Vec<String> {
        of["sets"].as_array().into_iter().flatten().filter_map(|set| Some(set.as_str()?.to_owned())).collect()
    };
    let (old, new) = (sets(before), sets(now));
    all.extend(new.iter().filter(|set| !old.contains(set)).map(|set| format!("--set {set} is new")));
    all.extend(old.iter().filter(|set| !new.contains(set)).map(|set| format!("--set {set} is missing")));
    let files = |of: &Value| of["inputs"].as_object().cloned().unwrap_or_default();
    let (old, new) = (files(before), files(now));
    for (path, hash) in &new {
        match old.get(path) {
            None => all.push(format!("{path} was not read then")),
            Some(known) if known != hash => all.push(format!("{path} has changed")),
            Some(_) => {}
        }
    }
    let gone = old.keys().filter(|path| !new.contains_key(*path));
    all.extend(gone.map(|path| format!("{path} is not read now")));
    if all.is_empty() {
        all.push(other());
    }
    all.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_said_and_nothing_that_is_not_known() {
        let record = |version: &str, sets: &[&str], inputs: Value| json!({"version": version, "shortcuts": true, "sets": sets, "inputs": inputs});
        let before = record("0.1.0", &["seed=1"], json!({"/a": "1", "/b": "1"}));
        let of = |now: Value| changes(&before, &now);
        assert_eq!(of(record("0.1.0", &["seed=1"], json!({"/a": "1", "/b": "2"}))), "/b has changed");
        assert_eq!(
            of(record("0.2.0", &[], json!({"/a": "1", "/c": "1"}))),
            "it was computed by version 0.1.0, --set seed=1 is missing, /c was not read then, /b is not read now"
        );
        // The same inputs, and a record of an earlier program that does not have them.
        assert_eq!(of(before.clone()), "it was computed by another program");
        assert_eq!(changes(&json!({"version": "0.1.0"}), &before), "it was computed by another program");
    }
}
