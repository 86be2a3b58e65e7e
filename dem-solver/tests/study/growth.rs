//! A study that is extended: its members stay as they are, and all that follows is as if they had been computed in one go.

use super::*;
use serde_json::Value;

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON")
}

#[test]
#[ignore = "long"]
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
#[ignore = "long"]
fn a_replicate_can_be_a_task_and_another_count_is_another_study() {
    let place = Place::new(STUDY);
    place.table("out", &[]);
    let more = ["--set", "replicates=2"];
    assert!(place.run("out", &[&more[..], &["--members", "21..40"]].concat()).status.success());
    assert_eq!(place.table("out", &[&more[..], &["--resume"]].concat()), place.table("once", &more));
    let other = place.run("out", &["--resume", "--set", "release.0.count=34"]);
    let said = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(other.status.code() == Some(2) && said.contains("`replicates` may be raised"), "{said}");
    for (set, words) in [("replicates=0", "is the least"), ("replicates=1000000", "members: up to")] {
        let refused = place.run("no", &["--set", set]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(words), "{said}");
    }
}

/// The same members twice would look like twice as many.
#[test]
fn a_full_factorial_without_random_numbers_has_no_replicates() {
    let place = Place::new(
        "scene = \"fall.toml\"\nsampling = \"full_factorial\"\n[[release]]\npoints = [[2600020.5, 1200020.25]]\n\
         [vary]\nspeed = { uniform = [0.5, 4.0], levels = 3 }\n",
    );
    for more in [["--set", "replicates=2"], ["--until", "max_speed_q50:5%"]] {
        let refused = place.run("out", &more);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains("nothing is random"), "{said}");
    }
}

#[test]
#[ignore = "long"]
fn members_are_added_until_a_measure_is_known_as_well_as_is_asked() {
    let place = Place::new(STUDY);
    let asked = |out: &str, arguments: &[&str]| {
        let output = place.run(out, arguments);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for (until, words) in [
        ("road_enrgy_q50:5%", "did you mean `road_energy_q50`?"),
        ("members_left:5%", "`road_passing_share`, `road_energy_q10`"),
        ("road_energy_q50:5", "road_energy_q95:5%"),
    ] {
        let (code, said) = asked("none", &["--until", until]);
        assert!(code == Some(2) && said.contains(words), "{until}: {said}");
    }
    let (code, said) = asked("none", &["--until", "road_speed_q50:10%", "--at-most", "19"]);
    assert!(code == Some(2) && said.contains("19: the study itself has 20 members"), "{said}");
    assert!(!place.path("none").exists());

    let until = ["--until", "road_speed_q50:8%", "--at-most", "1000"];
    let (code, said) = asked("out", &until);
    assert_eq!(code, Some(0), "{said}");
    let summary = json(&place.path("out/summary.json"));
    let known = |summary: &Value| {
        let of = &summary["measures"]["road_speed_q50"];
        let [value, low, high] = [&of["value"], &of["interval"][0], &of["interval"][1]];
        let [value, low, high] = [value, low, high].map(|number| number.as_f64().expect("a number"));
        assert!(low < value && value < high, "{of}");
        0.5 * (high - low) / value
    };
    let members = summary["measures"]["members"]["value"].as_f64().expect("a number");
    assert!(known(&summary) <= 0.08 && members > 20.0 && members % 20.0 == 0.0, "{members}");
    assert!(summary["warnings"].to_string().contains("road_speed_q50 is known to"), "{summary}");
    // The study that it came to, in one go; and again, with nothing to compute.
    let replicates = format!("replicates={}", members / 20.0);
    assert_eq!(place.read("out"), place.table("once", &["--set", &replicates]));
    assert!(place.files("out") == place.files("once"));
    assert_eq!(asked("out", &[&until[..], &["--resume"]].concat()).0, Some(0));
    let again = json(&place.path("out/summary.json"));
    assert_eq!(again["cost"]["members_computed"], 0);

    // The most members that may be are too few.
    let (code, said) = asked("few", &["--until", "road_energy_q95:5%", "--at-most", "45"]);
    assert!(
        code == Some(3) && said.contains("with 40 members, the most that may be; 5 % were asked for"),
        "{said}"
    );
    let summary = json(&place.path("few/summary.json"));
    assert_eq!(
        (&summary["status"], &summary["reasons"][0]["code"]),
        (&"unreliable".into(), &"few-samples".into())
    );
    // 40 rocks are too few for an upper end, and that is said.
    assert!(summary["measures"]["road_energy_q95"]["interval"][1].is_null());
}
