//! The same table, byte for byte, on how many threads, in which chunks and after which kill it may be.

use super::*;

#[test]
#[ignore = "long"]
fn threads_chunks_and_their_order_leave_every_byte_as_it_is() {
    let place = Place::new(STUDY);
    let one = place.table("one", &["--threads", "1"]);
    assert_eq!(one, place.table("two", &["--threads", "2"]));
    for range in ["15..20", "4..9", "1..2"] {
        assert!(place.run("chunks", &["--members", range]).status.success());
        assert!(place.run("chunks", &["--members", range]).status.success(), "a task given out twice");
    }
    assert!(!place.path("chunks").join("members.csv").exists());
    assert_eq!(one, place.table("chunks", &[]));
    for other in ["two", "chunks"] {
        assert!(place.files("one") == place.files(other), "{other}");
    }
    let again = place.run("one", &[]);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--resume"));
    assert_eq!(one, place.table("one", &["--resume"]));
    assert_eq!(one, place.table("one", &["--force"]));
    let other = place.run("one", &["--resume", "--set", "seed=4"]);
    assert_eq!(other.status.code(), Some(2));
    let said = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(said.contains("holds another study: --set seed=4 is new; choose another"), "{said}");
    assert_ne!(one, place.table("other", &["--set", "seed=4"]));
}

/// Killed at times all over the study, and gone on with, until it is whole: nothing is lost, nothing is there twice.
#[test]
#[ignore = "long"]
fn a_study_that_was_killed_again_and_again_ends_with_the_same_table() {
    let place = Place::new(&STUDY.replace("count = 14", "count = 60"));
    let whole = place.table("whole", &["--threads", "2"]);
    let journal = std::fs::read(place.path("whole/chunks/main.journal")).expect("a journal");
    let kept = place.path("killed/chunks/main.journal");
    let bytes = || std::fs::metadata(&kept).map_or(0, |journal| journal.len());
    let mut kills = 0;
    loop {
        let before = bytes();
        let resume: &[&str] = if kills == 0 { &[] } else { &["--resume"] };
        let mut child = place.command("killed", resume).spawn().expect("started");
        // Fractions of the golden ratio: somewhere in the next twelfth of what is kept of all members, in the middle of a row
        // as well as behind one. One in five is killed at once, before it adds any.
        let share = (f64::from(kills) * 0.618_034).fract();
        let more = if kills % 5 == 4 { 0 } else { 1 + (share * journal.len() as f64 / 12.0) as u64 };
        while bytes() < before + more && child.try_wait().expect("asked").is_none() {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        if child.try_wait().expect("asked").is_some_and(|status| status.success()) {
            break;
        }
        child.kill().expect("killed");
        child.wait().expect("waited for");
        kills += 1;
        let rows = place.path("killed").join("members.csv");
        if let Ok(rows) = std::fs::read_to_string(rows) {
            let complete = rows.rfind('\n').map_or("", |end| &rows[..=end]);
            assert!(whole.starts_with(complete));
        }
        assert!(kills < 200, "it does not come to its end");
    }
    println!("killed {kills} times");
    assert!(kills > 0);
    assert_eq!(place.read("killed"), whole);
    assert!(place.files("killed") == place.files("whole"));
    assert_eq!(std::fs::read(place.path("killed/chunks/main.journal")).expect("a journal"), journal);
}

/// The tables are files of their own even where a path has no directory yet.
#[test]
fn results_lie_where_they_are_asked_for() {
    let place = Place::new(&STUDY.replace("count = 14", "count = 1").replace("count = 6", "count = 1"));
    place.table("a/b", &[]);
    for name in ["study.json", "study.toml", "scene.toml", "summary.json"] {
        assert!(Path::new(&place.path("a/b")).join(name).exists(), "{name}");
    }
}

/// What a study was computed from is on record; a file that is another now is named.
#[test]
fn what_has_changed_since_a_study_began_is_named() {
    let place = Place::new(STUDY);
    place.table("out", &["--set", "seed=4"]);
    let record = std::fs::read_to_string(place.path("out/study.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    assert_eq!(record["sets"], serde_json::json!(["seed=4"]));
    let names = ["fall.toml", "slope.asc", "study.toml"].map(|name| place.path(name).display().to_string());
    assert!(record["inputs"].as_object().expect("a table").keys().eq(&names));
    for hash in names.iter().map(|name| &record["inputs"][name]) {
        assert!(hash.as_str().expect("text").starts_with("fnv1a64:"));
    }
    let refused = |words: &[&str], expected: &str| {
        let output = place.run("out", words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(expected), "{expected}: {said}");
    };
    let go_on = ["--resume", "--set", "seed=4"];
    refused(&go_on[..1], "holds another study: --set seed=4 is missing; ");
    refused(&[&go_on[..], &["--no-shortcuts"]].concat(), "study: --no-shortcuts is not as it was; ");
    let slope = std::fs::read_to_string(place.path("slope.asc")).expect("read");
    place.write("slope.asc", &slope.replacen("10", "11", 4).replace("cellsize 1\n", "cellsize 1.0\n"));
    refused(&go_on, "slope.asc has changed; ");
    place.write("slope.asc", &slope);
    place.write("study.toml", &STUDY.replace("2600035.0, 1200005.0", "2600036.0, 1200005.0"));
    refused(&go_on, "study: points of lines, or cells or trajectories of maps, are not as they were");
    refused(&go_on, "study.toml has changed; ");
    place.write("study.toml", STUDY);
    place.table("out", &go_on);
}
