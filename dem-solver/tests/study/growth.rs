//! A study that is extended: its members stay as they are, and all that follows is as if they had been computed in one go.

use super::*;
use serde_json::Value;

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON")
}

#[test]
fn replicates_extend_a_study_in_every_sampling_to_the_bytes_of_one_go() {
    for sampling in ["latin_hypercube", "random", "sobol", "full_factorial"] {
        let study = STUDY.replace("count = 14", "count = 7").replace("count = 6", "count = 3");
        let place = Place::new(&format!("sampling = \"{sampling}\"\n{study}"));
        let first = place.table("grown", &[]);
        let files = place.files("grown");
        let all = place.table("grown", &["--resume", "--set", "replicates=3"]);
        let of = rows(&all);
        let own = of.len() / 3;
        assert!(all.starts_with(&first) && rows(&first).len() == own, "{sampling}");
        assert_eq!(all, place.table("once", &["--set", "replicates=3"]), "{sampling}");
        let journal =
            |out: &str| std::fs::read(place.path(out).join("chunks/main.journal")).expect("a journal");
        assert!(
            journal("grown") == journal("once") && place.files("grown") == place.files("once"),
            "{sampling}"
        );
        let record = json(&place.path("grown/study.json"));
        assert_eq!((&record["members"], &record["replicates"]), (&(3 * own).into(), &3.into()));
        // Other members in each replicate, of the same releases.
        for number in [0, own - 1] {
            let turns = [0, own, 2 * own].map(|before| of[number + before]["orientation_w"].clone());
            assert!(turns[0] != turns[1] && turns[1] != turns[2], "{sampling}: {turns:?}");
            assert_eq!(of[number]["release"], of[number + own]["release"]);
        }
        // With fewer again it is as it was.
        assert_eq!(first, place.table("grown", &["--resume"]));
        assert!(place.files("grown") == files, "{sampling}");
    }
}

/// A replicate may be computed as a task of its own; another `count` is another hypercube, and the refusal says what to raise.
#[test]
fn a_replicate_can_be_a_task_and_another_count_is_another_study() {
    let place = Place::new(STUDY);
    place.table("out", &[]);
    let more = ["--set", "replicates=2"];
    assert!(place.run("out", &[&more[..], &["--members", "21..40"]].concat()).status.success());
    assert_eq!(place.table("out", &[&more[..], &["--resume"]].concat()), place.table("once", &more));
    let other = place.run("out", &["--resume", "--set", "release.0.count=34"]);
    let said = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(other.status.code() == Some(2) && said.contains("`replicates` alone may be raised"), "{said}");
    for (set, words) in [("replicates=0", "is the least"), ("replicates=1000000", "members: up to")] {
        let refused = place.run("no", &["--set", set]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(words), "{said}");
    }
}
