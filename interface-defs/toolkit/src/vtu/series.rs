//! A series of grids over time.

use super::{Grid, Vtu, escape};
use crate::files::{Dir, in_chunks};
use crate::provenance::Running;
use interface_defs::diagnostic::{Diagnostic, code};
use serde::{Deserialize, Serialize};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

/// States that may wait for the one that is being written.
const WAITING: usize = 1;

/// A series of grids over time: `name_000001.vtu`, ... and `name.pvd`.
///
/// A thread compresses and writes them while the solver goes on: a solver is waited for, and half of a run would pass
/// in writing. If the thread is behind by more than one state, adding waits for it. The PVD is replaced as a whole at each step, after the step's own file:
/// a run that is killed leaves a series that is complete up to there.
pub struct Series(Option<Writer>);

/// What a series has, for a run that goes on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptSeries {
    /// What its list says of its files.
    entries: String,
    /// Their number.
    count: u64,
    /// Hash of all of them, one after the other.
    hash: String,
}

enum Writer {
    /// Nothing is to be written.
    Idle(Box<Files>),
    /// At work; ends when nothing more is sent.
    Busy(SyncSender<(f64, Grid)>, JoinHandle<io::Result<Box<Files>>>),
}

impl Series {
    /// A new series in `dir`, which is created. An old one of the same name is overwritten.
    pub fn create(dir: &Path, name: &str) -> io::Result<Self> {
        let name =
            name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
        let files = Files {
            dir: Dir::create(dir)?,
            name,
            entries: String::new(),
            count: 0,
            hash: Running::default(),
        };
        Ok(Self(Some(Writer::Idle(Box::new(files)))))
    }

    /// Go on with a series of that name in `dir` as it was when it was [`Series::kept`]: later files are removed. An error of
    /// kind [`code::PROVENANCE`] ([`crate::files::fault`]) if a file was changed since.
    pub fn go_on(dir: &Path, name: &str, kept: KeptSeries) -> io::Result<Self> {
        let mut series = Self::create(dir, name)?;
        let Some(Writer::Idle(files)) = &mut series.0 else { unreachable!("nothing was added") };
        (files.entries, files.count) = (kept.entries, kept.count as usize);
        for number in 1..=files.count {
            in_chunks(files.dir.source(files.file(number).as_ref())?, &mut |chunk| {
                files.hash.add(chunk);
                Ok(())
            })?;
        }
        if files.hash.text() != kept.hash {
            let what = format!("the files {}_*.vtu are not those that the run wrote", files.name);
            let refused = Diagnostic::in_file(dir.display(), what).coded(code::PROVENANCE);
            return Err(io::Error::other(refused.try_instead("run it anew with --force")));
        }
        let own = |name: &OsStr| {
            let name = name.to_str().and_then(|name| name.strip_prefix(&files.name));
            // What a killed process had begun, too.
            if name.is_some_and(|name| name.starts_with(['_', '.']) && name.ends_with(".tmp")) {
                return true;
            }
            let number = name.and_then(|name| name.strip_prefix('_')?.strip_suffix(".vtu"));
            number.and_then(|number| number.parse().ok()).is_some_and(|number: usize| number > files.count)
        };
        for (name, _) in files.dir.entries()?.iter().filter(|(name, _)| own(name)) {
            files.dir.remove(name)?;
        }
        if files.count > 0 {
            files.write_list()?;
        }
        Ok(series)
    }

    /// What was added so far, all of it on the disk.
    pub fn kept(&mut self) -> io::Result<KeptSeries> {
        self.finish()?;
        let Some(Writer::Idle(files)) = &self.0 else { unreachable!("finished without an error") };
        Ok(KeptSeries { entries: files.entries.clone(), count: files.count as u64, hash: files.hash.text() })
    }

    /// Append the state at `time` [s]. What cannot be written is an error here, in the next call, or in [`Series::finish`].
    pub fn add(&mut self, time: f64, vtu: &Vtu) -> io::Result<()> {
        if let Some(Writer::Idle(files)) = self.0.take_if(|writer| matches!(writer, Writer::Idle(_))) {
            let (sender, receiver) = sync_channel(WAITING);
            let thread = Builder::new().name("field files".into()).spawn(|| files.write_all(receiver))?;
            self.0 = Some(Writer::Busy(sender, thread));
        }
        match &self.0 {
            Some(Writer::Busy(sender, _)) if sender.send((time, vtu.gather())).is_ok() => Ok(()),
            _ => self.finish(),
        }
    }

    /// Wait until all is written. After an error it adds and writes nothing more.
    pub fn finish(&mut self) -> io::Result<()> {
        match self.0.take() {
            Some(Writer::Busy(sender, thread)) => {
                drop(sender);
                let files =
                    thread.join().map_err(|_| io::Error::other("the thread that writes was lost"))??;
                self.0 = Some(Writer::Idle(files));
                Ok(())
            }
            idle @ Some(Writer::Idle(_)) => {
                self.0 = idle;
                Ok(())
            }
            None => Err(io::Error::other("they could not be written before")),
        }
    }
}

impl Drop for Series {
    /// A run that ends early leaves what was added until then.
    fn drop(&mut self) {
        // An error has no one to go to: whoever wants to know it finishes.
        let _ = self.finish();
    }
}

/// The files written so far.
struct Files {
    dir: Dir,
    name: String,
    entries: String,
    count: usize,
    /// Of the content of all files so far.
    hash: Running,
}

impl Files {
    fn write_all(mut self: Box<Self>, states: Receiver<(f64, Grid)>) -> io::Result<Box<Self>> {
        for (time, grid) in states {
            let _span = interface_defs::profile!("write fields");
            self.write(time, &grid)?;
        }
        Ok(self)
    }

    fn write(&mut self, time: f64, grid: &Grid) -> io::Result<()> {
        self.count += 1;
        let file = self.file(self.count);
        let bytes = grid.to_bytes();
        self.dir.write(file.as_ref(), &bytes)?;
        self.hash.add(&bytes);
        let _ =
            writeln!(self.entries, "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>", escape(&file));
        self.write_list()
    }

    /// Name of file number `number`.
    fn file(&self, number: usize) -> String {
        format!("{}_{number:06}.vtu", self.name)
    }

    fn write_list(&self) -> io::Result<()> {
        let text = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n\
             <Collection>\n{}</Collection>\n</VTKFile>\n",
            self.entries
        );
        self.dir.write(format!("{}.pvd", self.name).as_ref(), text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vtu::Cells;

    fn add(series: &mut Series, step: u32) -> io::Result<()> {
        let points = [f64::from(step), 0.0, 0.0];
        let vtu = Vtu { points: &points, cells: Cells::Vertices, point_data: vec![], cell_data: vec![] };
        series.add(f64::from(step) * 0.1, &vtu)
    }

    #[test]
    fn the_series_lists_only_files_that_are_there_and_goes_on_after_a_pause() {
        let dir = tempfile::tempdir().expect("a directory");
        let fields = dir.path().join("fields");
        let mut series = Series::create(&fields, "rock 1").expect("created");
        for step in 1..=3 {
            add(&mut series, step).expect("added");
            // At any moment: the thread may be anywhere.
            let pvd = std::fs::read_to_string(fields.join("rock_1.pvd")).unwrap_or_default();
            let files: Vec<&str> = pvd.split("file=\"").skip(1).filter_map(|r| r.split('"').next()).collect();
            assert!(
                files.len() <= step as usize && files.iter().all(|f| fields.join(f).exists()),
                "{files:?}"
            );
            if step != 2 {
                series.finish().expect("written");
                let pvd = std::fs::read_to_string(fields.join("rock_1.pvd")).expect("a series");
                assert_eq!(pvd.matches("<DataSet").count(), step as usize);
            }
        }
        let pvd = std::fs::read_to_string(fields.join("rock_1.pvd")).expect("a series");
        assert!(
            pvd.contains("timestep=\"0.30000000000000004\" part=\"0\" file=\"rock_1_000003.vtu\""),
            "{pvd}"
        );
    }

    #[test]
    fn a_series_that_is_gone_on_with_has_what_it_had_and_nothing_later() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut series = Series::create(dir.path(), "rock").expect("created");
        (1..=2).for_each(|step| add(&mut series, step).expect("added"));
        let kept = series.kept().expect("written");
        assert!(dir.path().join("rock_000002.vtu").exists());
        let list = || std::fs::read_to_string(dir.path().join("rock.pvd")).expect("a list");
        let before = list();
        (3..=5).for_each(|step| add(&mut series, step).expect("added"));
        drop(series);
        let after = list();
        let mut series = Series::go_on(dir.path(), "rock", kept).expect("there");
        assert_eq!(list(), before);
        assert!(!dir.path().join("rock_000003.vtu").exists() && !dir.path().join("rock_000005.vtu").exists());
        (3..=5).for_each(|step| add(&mut series, step).expect("added"));
        drop(series);
        assert_eq!(list(), after);
    }

    #[test]
    fn what_cannot_be_written_is_an_error_at_the_latest_when_it_ends() {
        let dir = tempfile::tempdir().expect("a directory");
        let fields = dir.path().join("fields");
        let mut series = Series::create(&fields, "rock").expect("created");
        std::fs::remove_dir(&fields).expect("removed");
        let added = add(&mut series, 1);
        assert!(added.and_then(|()| series.finish()).is_err());
        assert!(add(&mut series, 2).is_err());
    }

    #[test]
    fn a_series_that_is_dropped_has_written_all() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut series = Series::create(dir.path(), "rock").expect("created");
        for step in 1..=5 {
            add(&mut series, step).expect("added");
        }
        drop(series);
        let pvd = std::fs::read_to_string(dir.path().join("rock.pvd")).expect("a series");
        assert_eq!(pvd.matches("<DataSet").count(), 5);
    }
}
