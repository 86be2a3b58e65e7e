//! The directory of a study: what belongs to which file, what is computed already, and what it was computed from.
//!
//! `chunks/main.journal` has the members that `ensemble` without `--members` computed, `chunks/A-B.chunk` those of a finished
//! `--members A..B`, `chunks/A-B.part` those of one at work. `clusters` has the spheres of its rocks, which every later start reads.
//! All other files are made of these, in the order of the members.

use super::base::Base;
use super::record::{Found, Record, Records, complete};
use super::results;
use interface_defs::diagnostic::Diagnostic;
use serde_json::{Map, Value, json};
use std::io;
use std::path::{Path, PathBuf};
use toolkit::files::{self, Dir};
use toolkit::input_file::{self, hash, named_files, with_absolute_files};
use toolkit::provenance;
use toolkit::run_dir::{
    BARRIER, CHUNK_ENDS, CHUNKS, CLUSTERS, JOURNAL, MANIFEST, MEMBERS, SCENE, STUDY_RECORD, SUMMARY,
};
use toolkit::scene::Scene;

/// The study file as it was.
pub const STUDY: &str = "study.toml";
/// Of a calibration its results for programs, the same for people, and its file as it was.
pub const CALIBRATION: [&str; 3] = ["calibration.json", "calibration.md", "calibration.toml"];
/// What ends the name of a chunk that is complete.
const DONE: &str = CHUNK_ENDS[0];

/// A folder of a study, and how its files end.
type Files = (&'static str, &'static [&'static str]);
/// What follows from all members.
const RESULTS: [Files; 2] =
    [(results::MAPS, &["tif", "svg", "gpkg", "qml"]), (results::LINES, &["csv", "svg"])];

/// The directory of a study.
pub struct Directory {
    dir: PathBuf,
}

/// Where records are.
pub struct Index {
    /// Each file, and its records once one of them was read.
    files: Vec<(PathBuf, Option<Records>)>,
    /// For each member from 1 on the number of its file and its place there.
    places: Vec<Option<(u32, u64)>>,
}

impl Directory {
    /// At this place.
    pub fn new(dir: &Path) -> Self {
        Self { dir: dir.to_owned() }
    }

    /// Where it is.
    pub fn place(&self) -> &Path {
        &self.dir
    }

    /// A file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// The journal of all members.
    pub fn main(&self) -> PathBuf {
        self.dir.join(CHUNKS).join(JOURNAL)
    }

    /// The files of the members from `first` to `last`: complete, and at work.
    pub fn chunk(&self, first: u64, last: u64) -> [PathBuf; 2] {
        CHUNK_ENDS.map(|end| self.dir.join(CHUNKS).join(format!("{first:08}-{last:08}.{end}")))
    }

    /// A fault of it.
    pub fn fault(&self, what: impl std::fmt::Display) -> Diagnostic {
        Diagnostic::in_file(self.dir.display(), what.to_string())
    }

    /// Whether a run over all members has begun here.
    pub fn has_begun(&self) -> bool {
        self.main().exists() || self.path(SUMMARY).exists()
    }

    /// Whether this study has begun here, if it has, with as many members and the same arguments of --set; another one is refused.
    /// Nothing is changed.
    pub fn holds(&self, base: &Base, file: &Scene) -> Result<Option<bool>, Diagnostic> {
        if !self.path(STUDY_RECORD).exists() {
            return Ok(None);
        }
        let known: Value = files::read_json(&self.path(STUDY_RECORD)).unwrap_or_default();
        if known["fingerprint"].as_str() == Some(&base.fingerprint) {
            let has_sets = known["sets"] == json!(file.sets().collect::<Vec<_>>());
            return Ok(Some(has_sets && known["members"] == base.members()));
        }
        let changes = changes(&known, &record(base, file)?);
        let cure = "choose another with --out, or begin anew with --force; with the same falls `replicates` may be raised, and barriers, \
                    designs, names and blocks_per_year changed";
        Err(self.fault(format!("this directory holds another study: {changes}")).try_instead(cure))
    }

    /// Make the directory that of this study, or find that it is another's.
    pub fn begin(&self, base: &Base, file: &Scene) -> Result<(), Diagnostic> {
        let unwritable = |e: io::Error| self.fault(format!("no results can be written here: {e}"));
        let known = self.holds(base, file)?;
        Dir::create(&self.dir.join(CHUNKS)).map_err(unwritable)?;
        // With more replicates or another barrier it is the same study, and its record another one.
        let is_as_it_was = known == Some(true)
            && files::read(&self.path(STUDY), files::TEXT).is_ok_and(|text| text == file.text().as_bytes());
        if is_as_it_was {
            return base.keep_clusters(&self.path(CLUSTERS)).map_err(unwritable);
        }
        let record = record(base, file)?;
        if known.is_some() {
            // Results that do not come again, such as those of a line with another name.
            self.clear_folders(&RESULTS).map_err(unwritable)?;
        }
        // Tasks begin at the same time.
        files::write(&self.path(STUDY), file.text().as_bytes())
            .and_then(|()| files::write(&self.path(SCENE), base.scene.text().as_bytes()))
            .and_then(|()| files::write_json(&self.path(STUDY_RECORD), &record))
            .and_then(|()| base.keep_clusters(&self.path(CLUSTERS)))
            .map_err(unwritable)
    }

    /// Remove what a study has written here, and no other file.
    pub fn clear(&self) -> io::Result<()> {
        for name in [STUDY_RECORD, STUDY, SCENE, MEMBERS, SUMMARY, MANIFEST].into_iter().chain(CALIBRATION) {
            files::remove(&self.path(name))?;
        }
        self.clear_folders(&[
            (CHUNKS, &[CHUNK_ENDS[0], CHUNK_ENDS[1], "journal"]),
            (CLUSTERS, &["xyzr", "kept"]),
        ])?;
        self.clear_folders(&RESULTS)
    }

    /// Remove files with these extensions.
    fn clear_folders(&self, folders: &[Files]) -> io::Result<()> {
        for (folder, ends) in folders {
            let Ok(dir) = Dir::open(&self.dir.join(folder)) else { continue };
            for (name, _) in dir.entries()? {
                if Path::new(&name).extension().is_some_and(|e| ends.iter().any(|end| e == *end)) {
                    dir.remove(&name)?;
                }
            }
        }
        Ok(())
    }

    /// Remove what killed processes had begun to write among the results. For whoever alone writes them.
    pub fn sweep(&self) -> io::Result<()> {
        let folders = [results::MAPS, results::LINES, BARRIER].map(|name| Dir::open(&self.dir.join(name)));
        folders.into_iter().flatten().try_for_each(|dir| dir.sweep())
    }

    /// All records of complete chunks and of the journal, whose records are `own`, of up to `most` members.
    pub fn index(&self, base: &Base, own: &[Found], most: u64) -> Result<Index, Diagnostic> {
        let mut index = Index { files: vec![(self.main(), None)], places: vec![None; most as usize] };
        index.take(0, own);
        let chunks = self.dir.join(CHUNKS);
        let entries = Dir::open(&chunks).and_then(|dir| dir.entries()).map_err(|e| self.fault(e))?;
        let chunks = entries.iter().map(|(name, _)| chunks.join(name));
        let chunks = chunks.filter(|path| path.extension().is_some_and(|e| e == DONE));
        for path in chunks {
            let found = complete(&path, &base.fingerprint)
                .map_err(|refused| refused.try_instead("remove it, or begin anew with --force"))?;
            index.files.push((path, None));
            index.take(index.files.len() as u32 - 1, &found);
        }
        Ok(index)
    }
}

impl Index {
    fn take(&mut self, file: u32, found: &[Found]) {
        for Found { number, at } in found {
            let place = usize::try_from(*number).ok().and_then(|n| self.places.get_mut(n.checked_sub(1)?));
            if let Some(place) = place {
                place.get_or_insert((file, *at));
            }
        }
    }

    /// A record has been added to the journal.
    pub fn add(&mut self, found: Found) {
        self.take(0, &[found]);
    }

    /// Of the members up to `last` those that are in no file, in order.
    pub fn missing(&self, last: u64) -> Vec<u64> {
        (1..=last).zip(&self.places).filter(|(_, place)| place.is_none()).map(|(number, _)| number).collect()
    }

    /// The record of a member; `None`: it is in no file.
    pub fn record(&mut self, number: u64) -> io::Result<Option<Record>> {
        let Some((file, at)) = self.places[number as usize - 1] else { return Ok(None) };
        let (path, open) = &mut self.files[file as usize];
        let records = match open {
            Some(records) => records,
            None => open.insert(Records::open(path)?),
        };
        records.at(at).map(Some)
    }
}

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
        for (path, text) in std::iter::once((scene.path(), text)).chain(scene.kit()) {
            inputs.insert(absolute(path).display().to_string(), hash(text.as_bytes()).into());
        }
    }
    let maps = base.study.maps.as_ref().map(|maps| json!([maps.cell, maps.trajectories]));
    let lines: Vec<_> = base.study.lines.iter().map(|line| line.points.to_vec()).collect();
    Ok(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "date": provenance::now(),
        "followed": hash(json!([maps, lines]).to_string().as_bytes()),
        "study": file.path().display().to_string(),
        "scene": base.scene.path().display().to_string(),
        "sets": file.sets().collect::<Vec<_>>(),
        "shortcuts": base.shortcuts,
        "members": base.members(),
        "replicates": base.study.replicates,
        "shared": shared(base),
        "inputs": inputs,
        "fingerprint": base.fingerprint,
    }))
}

/// Of a calibration what its falls depend on beside its files.
fn shared(base: &Base) -> Option<Value> {
    let of = |(at, values): &(usize, Vec<f64>)| json!([base.study.varied()[*at].name, values]);
    let all = base.shared.iter().map(of).collect::<Vec<_>>();
    (!all.is_empty()).then(|| json!([all, base.study.counts(), base.lines]))
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
    if before["shared"] != now["shared"] {
        all.push("parameters, sets, seed, the number of falls or lines are not as they were".into());
    }
    if before["followed"].is_string() && before["followed"] != now["followed"] {
        all.push(
            "points of lines, or cells or trajectories of maps, are not as they were (of a fall is kept what it did there, not where else it \
             was)"
                .into(),
        );
    }
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
