//! `manifest.json`: every file of a finished run or study with its length and hash, written after all others; and whether a
//! directory still is what its run wrote.
//!
//! It shows what changed after the run, by whatever accident. It is no signature: who means to deceive can write another, so note
//! its `checksum` elsewhere where that matters.

use super::files::{self, Dir};
use super::provenance::{self, BuildId, build_id};
use super::run_dir::MANIFEST;
use interface_defs::diagnostic::{Diagnostic, Place, Severity, code};
use rustix::fs::FileType;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

/// Its version.
const FORMAT: u32 = 1;
/// Directories inside each other at most.
const DEPTH: usize = 16;

#[derive(Serialize, Deserialize)]
struct Manifest {
    format: u32,
    /// The program that wrote it.
    build: BuildId,
    /// By their paths in the directory.
    files: BTreeMap<String, Entry>,
    /// Hash of the same text with none.
    checksum: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Entry {
    bytes: u64,
    hash: String,
}

impl Manifest {
    fn text(mut self) -> io::Result<String> {
        self.checksum.clear();
        self.checksum = provenance::hash(serde_json::to_string_pretty(&self)?.as_bytes());
        Ok(serde_json::to_string_pretty(&self)? + "\n")
    }
}

/// Write the manifest of the run or study in `dir`, which has ended.
pub fn write(dir: &Path) -> io::Result<()> {
    let mut files = BTreeMap::new();
    walk(dir, "", &mut |name, file| {
        match file {
            Ok(file) => drop(files.insert(name, file)),
            // A link or a pipe is no file of the run.
            Err(e) => tracing::warn!("{name} is not in the manifest: {e}"),
        }
    })?;
    let manifest = Manifest { format: FORMAT, build: build_id().clone(), files, checksum: String::new() };
    files::write(&dir.join(MANIFEST), manifest.text()?.as_bytes())
}

/// [`write()`] it after the last file of a run or study. Without that the results are as good as with it.
pub fn seal(dir: &Path) {
    if let Err(e) = write(dir) {
        tracing::warn!("{}: no manifest: {e}", dir.display());
    }
}

/// What in `dir` is not as its run wrote it: errors for files that are missing or changed, notes for those that are new. Nothing:
/// it is what its run wrote, byte for byte. Without a manifest the one error is of kind [`code::RESULT_DIRECTORY`].
pub fn verify(dir: &Path) -> Vec<Diagnostic> {
    let of = |name: &str, what: String| {
        Diagnostic::error(code::PROVENANCE, what).at(Place::file(dir.join(name).display()))
    };
    let text = match files::read_text(&dir.join(MANIFEST)) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            let what = "there is none: the run has not come to its end, or an earlier version wrote it";
            return vec![
                of(MANIFEST, what.into())
                    .coded(code::RESULT_DIRECTORY)
                    .try_instead("go on with the run (--resume): that compares what was kept"),
            ];
        }
        Err(e) => return vec![of(MANIFEST, format!("it cannot be read: {e}"))],
    };
    let mut noted = match serde_json::from_str::<Manifest>(&text) {
        Ok(Manifest { format, .. }) if format != FORMAT => {
            let what = format!("it is of format {format}, and this program reads {FORMAT}");
            return vec![of(MANIFEST, what)];
        }
        // As it would be written again: a byte that was changed anywhere shows.
        Ok(manifest) => match (manifest.files.clone(), manifest.text()) {
            (noted, Ok(again)) if again == text => noted,
            _ => return vec![of(MANIFEST, "it was changed: its checksum is another".into())],
        },
        Err(e) => return vec![of(MANIFEST, format!("it was changed: it is no manifest ({e})"))],
    };
    let mut found = Vec::new();
    let walked = walk(dir, "", &mut |name, file| {
        let Some(noted) = noted.remove(&name) else {
            let what = "no file of the run: it came later";
            found.push(Diagnostic { severity: Severity::Note, ..of(&name, what.into()) });
            return;
        };
        match file {
            Err(e) => found.push(of(&name, format!("it cannot be read: {e}"))),
            Ok(now) if now == noted => {}
            Ok(Entry { bytes, .. }) => found.push(of(
                &name,
                match bytes == noted.bytes {
                    true => format!("it was changed, its {bytes} bytes are others"),
                    false => format!("it was changed: {bytes} bytes instead of {}", noted.bytes),
                },
            )),
        }
    });
    found.extend(walked.err().map(|e| of("", format!("it cannot be read: {e}"))));
    found.extend(noted.keys().map(|name| of(name, "it is missing".into())));
    found.sort_by_key(|what| std::cmp::Reverse(what.severity));
    found
}

/// Every file below `dir` but the manifest, and what belongs to a run at work.
fn walk(dir: &Path, below: &str, visit: &mut dyn FnMut(String, io::Result<Entry>)) -> io::Result<()> {
    let open = Dir::open(&dir.join(below))?;
    for (name, kind) in open.entries()? {
        let hidden = name.as_encoded_bytes().starts_with(b".") || files::is_temporary(&name);
        let path = format!("{below}{}", name.to_string_lossy());
        if hidden || path == MANIFEST {
            continue;
        }
        if kind == FileType::Directory {
            if below.matches('/').count() < DEPTH {
                walk(dir, &(path + "/"), visit)?;
            }
            continue;
        }
        let hashed = open.source(&name).and_then(provenance::hash_of);
        visit(path, hashed.map(|(hash, bytes)| Entry { bytes, hash: hash.text() }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_byte_that_is_changed_in_any_file_is_found_and_so_is_what_is_missing_or_new() {
        let temp = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a directory");
        let dir = temp.path();
        fs::create_dir(dir.join("fields")).expect("created");
        let names = ["history.csv", "summary.json", "run.json", "fields/rock_000001.vtu"];
        names
            .iter()
            .for_each(|name| fs::write(dir.join(name), format!("content of {name}")).expect("written"));
        let [none] = &verify(dir)[..] else { panic!("no manifest") };
        assert_eq!(none.code, code::RESULT_DIRECTORY);
        write(dir).expect("written");
        fs::write(dir.join(".rockfall.lock"), "x").expect("written");
        assert_eq!(verify(dir), []);
        for name in names {
            let path = dir.join(name);
            let whole = fs::read(&path).expect("there");
            for at in 0..whole.len() {
                let mut bytes = whole.clone();
                bytes[at] ^= 4;
                fs::write(&path, bytes).expect("written");
                let found = verify(dir);
                assert!(found.len() == 1 && found[0].to_string().contains(name), "{found:?}");
            }
            fs::write(&path, &whole[1..]).expect("written");
            assert!(verify(dir)[0].message.contains("bytes instead of"), "{name}");
            fs::remove_file(&path).expect("removed");
            assert_eq!(verify(dir)[0].message, "it is missing");
            rustix::fs::mknodat(rustix::fs::CWD, &path, FileType::Fifo, rustix::fs::Mode::RUSR, 0)
                .expect("a pipe");
            assert!(verify(dir)[0].message.contains("a pipe"), "{name}");
            fs::remove_file(&path).expect("removed");
            fs::write(&path, whole).expect("written");
        }
        let path = dir.join(MANIFEST);
        let whole = fs::read(&path).expect("there");
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            fs::write(&path, bytes).expect("written");
            let found = verify(dir);
            assert!(found.len() == 1 && found[0].to_string().contains(MANIFEST), "byte {at}: {found:?}");
        }
        fs::write(&path, whole).expect("written");
        fs::write(dir.join("notes.txt"), "mine").expect("written");
        let found = verify(dir);
        assert!(found.len() == 1 && found[0].severity == Severity::Note, "{found:?}");
    }
}
