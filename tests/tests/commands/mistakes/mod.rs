//! Mistakes of users: none is silent, and each message names cause, place and cure. `rockfall run` says the same as
//! `rockfall check`, and starts and writes nothing.

mod commands;
mod damaged;
mod files;
mod more;
mod refused;
mod scenes;
mod warned;

use damaged::of_damaged_files;
use files::of_files;
use more::of_table;
use refused::REFUSED;
use scenes::{ALL, MESH, NET, SLOPE, STUDY};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use tests::Bench;
use warned::WARNED;

/// A scene or file with a mistake, and what must be said of it.
#[derive(Default)]
struct Mistake {
    what: &'static str,
    scene: String,
    files: Vec<(&'static str, Vec<u8>)>,
    set: Option<&'static str>,
    /// Refused; else warned of.
    refused: bool,
    /// Where, as the message begins: `scene.toml:16:13`.
    place: &'static str,
    cause: &'static str,
    cure: &'static str,
}

impl Mistake {
    fn is_kit(&self) -> bool {
        self.scene.contains("[kit]")
    }

    /// Whether `rockfall run` takes what it is in.
    fn is_run(&self) -> bool {
        !self.is_kit() && !self.scene.contains("[[line]]")
    }
}

/// What the mistake is, the scene, what is replaced in it by what (`+` in front: added at its end), place in the scene,
/// cause, cure.
type Row = (&'static str, &'static str, [&'static str; 2], [&'static str; 3]);

/// Files beside a scene that are right.
fn beside(scene: &str) -> Vec<(&'static str, Vec<u8>)> {
    match scene {
        MESH => vec![("net.msh", scenes::mesh(|p| p).into())],
        SLOPE => vec![("valley.asc", scenes::valley().into())],
        STUDY => vec![("valley.asc", scenes::valley().into()), ("fall.toml", SLOPE.into())],
        _ => Vec::new(),
    }
}

fn of_rows(rows: &'static [Row], refused: bool) -> impl Iterator<Item = Mistake> {
    rows.iter().map(move |&(what, scene, [from, to], [place, cause, cure])| {
        assert!(from == "+" || scene.contains(from), "{what}: {from}");
        let text = if from == "+" { format!("{scene}{to}") } else { scene.replacen(from, to, 1) };
        Mistake { what, scene: text, files: beside(scene), set: None, refused, place, cause, cure }
    })
}

/// On the command line.
fn of_arguments() -> Vec<Mistake> {
    [
        ("key that is not there", "rock.0.mas=5", "unknown key `mas`", "did you mean `mass`?"),
        ("number of the table left out", "rock.mass=5", "`mass` is no item of `rock`", "its number is 0"),
        ("unit", "coupling.time_window=0.2ms", "expected a number", "in SI units: 0.0002"),
        ("no brackets", "rock.0.position=0,0,3", "expected an array of length 3", "as in [0,0,3]"),
        ("colon", "end_time:3", "there is no `=`", "write KEY=VALUE"),
    ]
    .into_iter()
    .map(|(what, set, cause, cure)| Mistake {
        what,
        scene: NET.into(),
        set: Some(set),
        refused: true,
        place: "--set",
        cause,
        cure,
        ..Mistake::default()
    })
    .collect()
}

fn all() -> Vec<Mistake> {
    let rows = of_rows(REFUSED, true).chain(of_rows(WARNED, false));
    rows.chain(of_table()).chain(of_files()).chain(of_damaged_files()).chain(of_arguments()).collect()
}

/// Exit code, standard output, standard error of `rockfall WORD scene.toml ARGUMENTS`, started beside its files.
fn rockfall(dir: &Path, word: &str, mistake: &Mistake, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(tests::program("rockfall"));
    // A kit is checked as for its approval.
    match mistake.is_kit() {
        true => command.args(["approve", "scene.toml", "--dry-run"]),
        false => command.args([word, "scene.toml"]).args(arguments),
    };
    command.current_dir(dir);
    if let Some(set) = mistake.set {
        command.args(["--set", set]);
    }
    let output = command.output().expect("started");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn written(mistake: &Mistake) -> Bench {
    let bench = Bench::new();
    bench.scene(&mistake.scene);
    mistake
        .files
        .iter()
        .for_each(|(name, content)| std::fs::write(bench.path(name), content).expect("written"));
    bench
}

/// What the mistake lacks in what is said, if anything.
fn judged(mistake: &Mistake) -> Result<(), String> {
    let bench = written(mistake);
    let (code, out, err) = rockfall(&bench.path(""), "check", mistake, &[]);
    let place = if mistake.place.starts_with(|c: char| c.is_ascii_digit()) {
        format!("scene.toml:{}: ", mistake.place)
    } else {
        mistake.place.into()
    };
    let said = if mistake.refused {
        let errors = err.matches("error: ").count();
        if code != Some(2) || errors != 1 {
            return Err(format!("{}: code {code:?}, {errors} errors: {err}{out}", mistake.what));
        }
        err.split("error: ").nth(1).unwrap_or_default().to_owned()
    } else {
        let warnings = out.lines().chain(err.lines()).filter_map(|line| line.strip_prefix("warning: "));
        let Some(warning) =
            warnings.into_iter().find(|w| w.contains(mistake.cause)).filter(|_| code == Some(0))
        else {
            return Err(format!(
                "{}: code {code:?}, no warning with \"{}\": {err}{out}",
                mistake.what, mistake.cause
            ));
        };
        warning.to_owned()
    };
    for (what, words) in [("cause", mistake.cause), ("cure", mistake.cure)] {
        if !said.contains(words) {
            return Err(format!("{}: the {what} \"{words}\" is not in: {said}", mistake.what));
        }
    }
    match said.starts_with(&place) {
        true => Ok(()),
        false => Err(format!("{}: it does not begin with {place}: {said}", mistake.what)),
    }
}

/// Each of `mistakes` by `judge`, on two threads; all that is lacking, one a line.
fn lacking(mistakes: &[Mistake], judge: impl Fn(&Mistake) -> Result<(), String> + Sync) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let work = || {
        let take = || mistakes.get(next.fetch_add(1, Ordering::Relaxed));
        std::iter::from_fn(take).filter_map(|mistake| judge(mistake).err()).collect::<Vec<_>>()
    };
    std::thread::scope(|scope| {
        let both = [scope.spawn(work), scope.spawn(work)];
        both.into_iter().flat_map(|thread| thread.join().expect("no panic")).collect()
    })
}

fn none_is_silent(mistakes: &[Mistake]) {
    let lacking = lacking(mistakes, judged);
    assert!(lacking.is_empty(), "{} of {}:\n{}", lacking.len(), mistakes.len(), lacking.join("\n"));
}

#[test]
#[ignore = "long"]
fn no_mistake_is_silent_and_each_message_names_cause_place_and_cure() {
    let mistakes = all();
    assert!(mistakes.len() >= 500, "{}", mistakes.len());
    none_is_silent(&mistakes);
}

/// A sample of all kinds.
#[test]
fn no_mistake_of_some_is_silent() {
    none_is_silent(&all().into_iter().skip(7).step_by(17).collect::<Vec<_>>());
}

/// Without a mistake nothing is said of them.
#[test]
#[ignore = "long"]
fn the_scenes_themselves_are_without_a_word() {
    for (name, text) in ALL {
        let right = Mistake { scene: text.into(), files: beside(text), ..Mistake::default() };
        let (code, out, err) = rockfall(&written(&right).path(""), "check", &right, &[]);
        assert!(code == Some(0) && !(out + &err).contains("warning:"), "{name}");
    }
}

/// A sample of all kinds.
#[test]
fn run_says_the_same_words_as_check_and_writes_nothing() {
    let mistakes: Vec<Mistake> = all().into_iter().filter(|m| m.refused && m.is_run()).step_by(20).collect();
    assert!(mistakes.len() >= 10, "{}", mistakes.len());
    let lacking = lacking(&mistakes, |mistake| {
        let bench = written(mistake);
        let (_, _, checked) = rockfall(&bench.path(""), "check", mistake, &[]);
        let (code, _, run) = rockfall(&bench.path(""), "run", mistake, &["--out", "results"]);
        let error = |text: &str| text.split_once("error: ").map(|(_, error)| error.to_owned());
        if code != Some(2) || error(&checked) != error(&run) {
            return Err(format!("{}: code {code:?}\ncheck: {checked}\nrun: {run}", mistake.what));
        }
        match bench.path("results").exists() {
            true => Err(format!("{}: results were written", mistake.what)),
            false => Ok(()),
        }
    });
    assert!(lacking.is_empty(), "{}", lacking.join("\n"));
}
