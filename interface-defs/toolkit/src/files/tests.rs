pub(super) mod faults;

use super::*;
use crate::checkpoint::{Found, Store, Subject, pack, unpack};
use crate::history::{History, Mark};
use crate::run_dir::{CHECKPOINT, CLUSTERS, FIELDS, HISTORY, LOG, MANIFEST, RECORD, SCENE, STRUCTURE_STATE};
use crate::summary::{RunStatus, Summary};
use crate::vtu::{Cells, KeptSeries, Series, Vtu};
use crate::{checkpoint, manifest, state_file};
use faults::{Fault as Injection, Injected, Tree, restore, tree};
use std::cell::RefCell;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};

fn temp() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a directory")
}

fn names(dir: &Path) -> Vec<String> {
    let entries = Dir::open(dir).and_then(|dir| dir.entries()).expect("listed");
    entries.into_iter().map(|(name, _)| name.into_string().expect("text")).collect()
}

fn fifo(path: &Path) {
    rustix::fs::mknodat(rustix::fs::CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
}

#[test]
fn many_may_write_one_file_at_once() {
    let temp = temp();
    let path = temp.path().join("study.json");
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| (0..50).for_each(|_| write(&path, b"all the same").expect("written")));
        }
    });
    assert_eq!(fs::read(&path).expect("there"), b"all the same");
    assert_eq!(names(temp.path()), ["study.json"]);
}

#[test]
fn a_file_is_replaced_as_a_whole_and_nothing_is_left_beside_it() {
    let temp = temp();
    let path = temp.path().join("summary.json");
    write(&path, b"old").expect("written");
    write(&path, b"new").expect("written");
    assert_eq!(fs::read(&path).expect("there"), b"new");
    // A directory in the place of the file cannot be replaced: what was begun is removed.
    fs::create_dir(temp.path().join("taken")).expect("created");
    assert!(write(&temp.path().join("taken"), b"x").is_err());
    assert!(create(&temp.path().join("taken")).is_err());
    assert_eq!(names(temp.path()), ["summary.json", "taken"]);
}

#[test]
fn what_a_killed_process_left_is_known_by_its_name() {
    let temp = temp();
    let name = OsStr::new("summary.json");
    let left = temporary(name);
    fs::write(temp.path().join(&left), "half").expect("written");
    fs::write(temp.path().join("mine.tmp"), "mine").expect("written");
    assert!(is_temporary(&left) && !is_temporary(name) && !is_temporary("mine.tmp".as_ref()));
    assert!(!is_temporary("é.0123456789abcdeg.tmp".as_ref()));
    Dir::open(temp.path()).and_then(|dir| dir.sweep()).expect("swept");
    assert_eq!(names(temp.path()), ["mine.tmp"]);
}

#[test]
fn scratch_is_for_this_user_alone_and_goes_with_its_value() {
    let temp = temp();
    let scratch = Scratch::new(temp.path(), "member.toml", b"x").expect("written");
    assert_eq!(fs::metadata(scratch.path()).expect("there").permissions().mode() & 0o777, 0o600);
    assert!(scratch.path().to_string_lossy().ends_with(".member.toml"));
    drop(scratch);
    assert_eq!(names(temp.path()), [""; 0]);
}

#[test]
fn only_files_are_read_and_none_that_are_too_long() {
    let temp = temp();
    let at = |name: &str| temp.path().join(name);
    fs::write(at("file"), "content").expect("written");
    fifo(&at("pipe"));
    symlink("/dev/zero", at("zero")).expect("linked");
    symlink(at("file"), at("link")).expect("linked");
    assert_eq!(read(&at("file"), 7).expect("read"), b"content");
    assert_eq!(read(&at("file"), 6).expect_err("too long").kind(), io::ErrorKind::FileTooLarge);
    assert_eq!(read_input(&at("link"), TEXT).expect("a link of the user"), b"content");
    assert!(read(&at("link"), TEXT).is_err(), "a program wrote no link");
    for name in ["pipe", "zero", "."] {
        for refused in [read(&at(name), TEXT), read_input(&at(name), TEXT)] {
            assert!(refused.is_err(), "{name}");
        }
    }
    // A file that says it has more than there is memory for.
    let sparse = fs::File::create(at("sparse")).expect("created");
    if sparse.set_len(1 << 43).is_ok() {
        assert!(read(&at("sparse"), STATE).is_err());
    }
    // One that grows while it is read.
    assert!(read_all(fs::File::open("/proc/self/status").expect("there"), 10).is_err());
}

#[test]
fn a_device_or_pipe_in_the_place_of_a_result_is_refused_at_once() {
    let temp = temp();
    let dir = temp.path();
    fs::create_dir(dir.join(CHECKPOINT)).expect("created");
    for name in ["summary.json", "checkpoint/1.state", "structure.state", HISTORY, MANIFEST] {
        fifo(&dir.join(name));
    }
    symlink("/dev/zero", dir.join("checkpoint/2.state")).expect("linked");
    assert!(Summary::read(dir).is_err());
    let found = Found::of(dir);
    assert!(found.newest.is_none() && found.unusable.len() == 2, "{found:?}");
    assert!(state_file::read::<u8>(&dir.join(STRUCTURE_STATE), 1).is_err());
    assert!(History::go_on(&dir.join(HISTORY), &[], &Mark { length: 1, hash: String::new() }).is_err());
    assert!(append(&dir.join(HISTORY)).is_err());
    assert_eq!(manifest::verify(dir).len(), 1);
}

#[test]
fn a_device_that_is_named_as_a_result_stays_where_it_is() {
    let temp = temp();
    let link = temp.path().join("stdout");
    symlink("/dev/null", &link).expect("linked");
    assert!(write(&link, b"x").is_err() && create(&link).is_err());
    assert!(link.is_symlink());
}

type Writer = fn(&Path) -> io::Result<()>;

/// Whatever writes a result, with the name of that.
fn writers() -> Vec<(&'static str, Writer)> {
    vec![
        (HISTORY, |dir| History::create(&dir.join(HISTORY), &["a".into()])?.row(&[1.0])),
        ("summary.json", |dir| Summary::new(RunStatus::Done).write(dir)),
        (RECORD, |dir| write(&dir.join(RECORD), b"{}")),
        (SCENE, |dir| write(&dir.join(SCENE), b"end_time = 1")),
        (MANIFEST, manifest::write),
        (STRUCTURE_STATE, |dir| state_file::write(&dir.join(STRUCTURE_STATE), 1, &7_u8)),
        ("fields/rock_000001.vtu", |dir| series(dir).map(drop)),
        ("fields/rock.pvd", |dir| series(dir).map(drop)),
        ("checkpoint/1.state", |dir| Store::new(dir, Subject::default(), 1.0, None).write(0.0, Vec::new())),
        ("clusters/block.xyzr", |dir| write(&dir.join(CLUSTERS).join("block.xyzr"), b"0 0 0 1")),
        ("log/dem.log", |dir| create(&dir.join(LOG).join("dem.log"))?.write_all(b"a line")),
    ]
}

fn series(dir: &Path) -> io::Result<Series> {
    let mut series = Series::create(&dir.join(FIELDS), "rock")?;
    add(&mut series)?;
    Ok(series)
}

fn add(series: &mut Series) -> io::Result<()> {
    let vtu = Vtu { points: &[1.0; 3], cells: Cells::Vertices, point_data: vec![], cell_data: vec![] };
    series.add(0.1, &vtu).and_then(|()| series.finish())
}

#[test]
fn a_link_at_the_name_of_a_result_is_replaced_and_what_it_leads_to_stays() {
    let temp = temp();
    let precious = temp.path().join("precious");
    fs::write(&precious, "as it was").expect("written");
    for (name, write) in writers() {
        for hard in [false, true] {
            let dir = temp.path().join(format!("{}-{hard}", name.replace('/', "-")));
            for folder in [CHECKPOINT, FIELDS, CLUSTERS, LOG] {
                fs::create_dir_all(dir.join(folder)).expect("created");
            }
            // Open to all, as a directory that a group shares.
            fs::set_permissions(&dir, fs::Permissions::from_mode(0o777)).expect("opened");
            for link in [name.to_owned(), format!("{name}.tmp")] {
                let linked = if hard {
                    fs::hard_link(&precious, dir.join(link))
                } else {
                    symlink(&precious, dir.join(link))
                };
                linked.expect("linked");
            }
            write(&dir).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(fs::read(&precious).expect("there"), b"as it was", "{name}");
            let about = fs::symlink_metadata(dir.join(name)).expect("there");
            assert!(about.is_file() && about.nlink() == 1, "{name}");
            // What is written on is no link either.
            fs::remove_file(dir.join(name)).expect("removed");
            let linked = if hard {
                fs::hard_link(&precious, dir.join(name))
            } else {
                symlink(&precious, dir.join(name))
            };
            linked.expect("linked");
            assert!(append(&dir.join(name)).is_err() && reopen(&dir.join(name), 0).is_err(), "{name}");
            assert_eq!(fs::read(&precious).expect("there"), b"as it was", "{name}");
        }
    }
}

#[test]
fn a_directory_that_is_a_link_of_another_user_is_not_followed_and_nothing_in_it_removed() {
    let temp = temp();
    let (dir, elsewhere) = (temp.path().join("out"), temp.path().join("elsewhere"));
    fs::create_dir(&elsewhere).expect("created");
    fs::create_dir(&dir).expect("created");
    fs::write(elsewhere.join("1.state"), "precious").expect("written");
    symlink(&elsewhere, dir.join(CHECKPOINT)).expect("linked");
    // Who is the administrator can give the link to somebody else.
    if rustix::process::geteuid().is_root() {
        let other = Some(rustix::fs::Uid::from_raw(12345));
        rustix::fs::chownat(rustix::fs::CWD, dir.join(CHECKPOINT), other, None, AtFlags::SYMLINK_NOFOLLOW)
            .expect("given");
        let written = Store::new(&dir, Subject::default(), 1.0, None).write(0.0, Vec::new());
        assert!(written.expect_err("refused").to_string().contains("a link of another user"));
        assert!(crate::run_dir::remove_checkpoints(&dir).is_err());
        assert_eq!(names(&elsewhere), ["1.state"]);
        fs::remove_file(dir.join(CHECKPOINT)).expect("removed");
        symlink("../elsewhere", dir.join(CHECKPOINT)).expect("linked");
    }
    // One of the user's own is.
    Store::new(&dir, Subject::default(), 1.0, None).write(0.0, Vec::new()).expect("written");
    assert!(Found::of(&dir).newest.is_some());
    crate::run_dir::remove_checkpoints(&dir).expect("removed");
    assert_eq!(names(&elsewhere), [""; 0]);
    symlink("round", temp.path().join("round")).expect("linked");
    assert!(Dir::open(&temp.path().join("round")).is_err());
}

#[test]
fn a_directory_that_others_can_exchange_is_known() {
    let temp = temp();
    let dir = temp.path().join("open/out");
    fs::create_dir_all(&dir).expect("created");
    let exposed = || Dir::open(&dir).and_then(|dir| dir.exposed()).expect("seen");
    let set = |name: &str, mode| {
        fs::set_permissions(temp.path().join(name), fs::Permissions::from_mode(mode)).expect("changed");
    };
    assert_eq!(exposed(), None);
    // Open to all, and ours: names in it are safe, since they are created exclusively.
    set("open/out", 0o777);
    assert_eq!(exposed(), None);
    set("open", 0o777);
    let above = fs::canonicalize(temp.path().join("open")).expect("there");
    assert_eq!(exposed(), Some(Exposed::Above(above)));
    set("open", 0o1777);
    assert_eq!(exposed(), None);
    if rustix::process::geteuid().is_root() {
        std::os::unix::fs::chown(&dir, Some(12345), None).expect("given");
        assert_eq!(exposed(), Some(Exposed::ToOwner));
    }
}

/// A run in small: rows, checkpoints that know them, fields, a summary, a manifest.
#[derive(Default)]
struct Run {
    /// Steps that were done when something was kept, and what.
    kept: Vec<(usize, KeptSeries)>,
}

fn a_run(dir: &Path, steps: &dyn Fn() -> usize, run: &RefCell<Run>) -> io::Result<()> {
    let mut history = History::create(&dir.join(HISTORY), &["time_s".into()])?;
    let mut store = Store::new(dir, Subject::default(), 1.0, None);
    let mut fields = Series::create(&dir.join(FIELDS), "rock")?;
    for window in 1..=3 {
        history.row(&[f64::from(window)])?;
        add(&mut fields)?;
        history.sync()?;
        let kept = fields.kept()?;
        store.write(f64::from(window), vec![("run".into(), pack(&(history.mark(), kept.clone())))])?;
        run.borrow_mut().kept.push((steps(), kept));
    }
    Summary::new(RunStatus::Done).write(dir)?;
    manifest::write(dir)
}

fn prepared(temp: &tempfile::TempDir) -> PathBuf {
    let dir = temp.path().join("out");
    [CHECKPOINT, FIELDS].iter().for_each(|name| fs::create_dir_all(dir.join(name)).expect("created"));
    dir
}

/// A result is whole or as it was, and a later run goes on or begins anew.
fn check(dir: &Path, at: usize) {
    let found = Found::of(dir);
    assert!(found.unusable.is_empty(), "{at}: {found:?}");
    if let Some(newest) = found.newest {
        let part = newest.part("run").expect("a part");
        let (mark, kept): (Mark, KeptSeries) = unpack(part).expect("whole");
        History::go_on(&dir.join(HISTORY), &["time_s".into()], &mark).unwrap_or_else(|e| panic!("{at}: {e}"));
        Series::go_on(&dir.join(FIELDS), "rock", kept).unwrap_or_else(|e| panic!("{at}: {e}"));
    }
    if dir.join("summary.json").exists() {
        assert_eq!(Summary::read(dir).expect("whole").status, RunStatus::Done, "{at}");
    }
    if let Ok(list) = fs::read_to_string(dir.join("fields/rock.pvd")) {
        assert!(list.ends_with("</VTKFile>\n"), "{at}");
        for file in list.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
            let text = fs::read_to_string(dir.join(FIELDS).join(file)).expect("listed");
            assert!(text.ends_with("</VTKFile>\n"), "{at}");
        }
    }
    crate::run_dir::make_free(dir, true).unwrap_or_else(|e| panic!("{at}: {e}"));
    assert_eq!(tree(dir), Tree::new(), "{at}: something is left for ever");
}

#[test]
fn a_power_cut_at_any_moment_leaves_what_a_later_run_can_use() {
    let temp = temp();
    let dir = prepared(&temp);
    let injected = Injected::new(&dir, None);
    let run = RefCell::default();
    a_run(&dir, &|| injected.steps(), &run).expect("written");
    assert_eq!(manifest::verify(&dir), []);
    let cuts = injected.power_cuts(&Tree::new());
    assert!(cuts.len() > 300, "{}", cuts.len());
    for (at, left) in &cuts {
        let _ = prepared(&temp);
        restore(&dir, left);
        // What was kept before is there.
        let before = run.borrow().kept.iter().filter(|(steps, _)| steps <= at).count();
        let newest = Found::of(&dir).newest.map_or(0, |newest| newest.number);
        assert!(newest >= before as u64, "{at}: {newest} of {before}");
        check(&dir, *at);
    }
}

#[test]
fn a_file_that_is_written_over_is_the_old_or_the_new_after_a_power_cut() {
    let temp = temp();
    let path = temp.path().join("structure.state");
    state_file::write(&path, 1, &"old".to_owned()).expect("written");
    let before = tree(temp.path());
    let injected = Injected::new(temp.path(), None);
    state_file::write(&path, 1, &"new".to_owned()).expect("written");
    let steps = injected.steps();
    for (at, left) in injected.power_cuts(&before) {
        restore(temp.path(), &left);
        let content: String = state_file::read(&path, 1).unwrap_or_else(|e| panic!("{at}: {e}"));
        assert!(if at == steps { content == "new" } else { content == "old" || content == "new" }, "{at}");
    }
}

#[test]
fn a_disk_that_fails_or_is_full_at_any_step_is_an_error_and_nothing_is_half_there() {
    let temp = temp();
    let dir = prepared(&temp);
    let injected = Injected::new(&dir, None);
    a_run(&dir, &|| 0, &RefCell::default()).expect("written");
    let steps = injected.steps();
    drop(injected);
    for fault in [Injection::Full, Injection::Torn, Injection::Io, Injection::Short] {
        for at in 0..steps {
            let _ = prepared(&temp);
            restore(&dir, &Tree::new());
            let injected = Injected::new(&dir, Some((at, fault)));
            let outcome = a_run(&dir, &|| 0, &RefCell::default());
            drop(injected);
            match fault {
                Injection::Short => assert_eq!(outcome.map_err(|e| e.to_string()), Ok(()), "{at}"),
                // A step that takes no space does not fail on a full disk, but a later one.
                Injection::Full | Injection::Torn if at + 3 >= steps => {}
                _ => assert!(outcome.is_err(), "{fault:?} at {at}"),
            }
            check(&dir, at);
        }
    }
}

#[test]
fn a_checkpoint_that_fails_leaves_the_one_before_and_the_next_is_written() {
    let temp = temp();
    let dir = prepared(&temp);
    let part = |of: u8| vec![("dem".to_owned(), vec![of; 9])];
    let mut store = Store::new(&dir, Subject::default(), 1e-9, None);
    store.write(1.0, part(1)).expect("written");
    store.write(2.0, part(2)).expect("written");
    for fault in [Injection::Full, Injection::Torn, Injection::Io] {
        let injected = Injected::new(&dir, Some((1, fault)));
        assert!(store.write(3.0, part(3)).is_err());
        drop(injected);
        let found = Found::of(&dir);
        assert!(found.newest.is_some_and(|newest| newest.time == 2.0) && checkpoint::age(&dir).is_some());
    }
    store.write(4.0, part(4)).expect("written");
    assert_eq!(Found::of(&dir).newest.map(|newest| (newest.number, newest.time)), Some((3, 4.0)));
    assert_eq!(names(&dir.join(CHECKPOINT)), ["1.state", "2.state"]);
}
