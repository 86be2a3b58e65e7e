//! A coupled run ends once its rocks lie still in the net, and nothing else changes by it.

use interface_defs::verdict::Fate;
use tests::{Bench, Ended, scene};

/// Seconds that the scene gives it.
const END: f64 = 6.0;

/// A block that is laid on the net of the drop test, whose swinging is damped.
fn laid(bench: &Bench, out: &str, more: &[&str]) -> Ended {
    let end = format!("end_time={END}");
    let sets = [
        &end,
        "rock.0.position=[0.0,0.0,0.17]",
        "contact.0.friction=0.5",
        "contact.0.restitution=0.2",
        "structure.damping=300.0",
        "coupling.scheme=strong",
        "coupling.yielding_net=true",
        "coupling.time_window=1e-3",
    ];
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).chain(more.iter().copied()).collect();
    bench.done(&scene("walenstadt-compare"), out, &words)
}

#[test]
#[ignore = "long"]
fn a_rock_at_rest_in_the_net_ends_the_run_and_stays_where_it_is_if_it_goes_on() {
    let bench = Bench::new();
    let (short, long) = (laid(&bench, "short", &[]), laid(&bench, "long", &["--no-shortcuts"]));
    assert_eq!((short.fates(), long.fates()), (vec![Fate::Stopped], vec![Fate::Stopped]));
    let then = |ended: &Ended| ended.summary()["verdict"][0]["then"].clone();
    for ended in [&short, &long] {
        assert_eq!(then(ended)["fate"], "at_rest", "{}", ended.summary()["verdict"]);
    }
    let time = |ended: &Ended| then(ended)["time"].as_f64().expect("a number");
    assert!(time(&short) < 0.7 * END, "{}", time(&short));
    assert_eq!(time(&long), END);
    for measure in ["impact_speed", "max_travel", "max_reaction_1ms", "max_cable_force"] {
        let off = long.measure(measure) / short.measure(measure) - 1.0;
        assert!(off.abs() < 1e-6, "{measure}: {off}");
    }
    let heights = long.column("rock_z_m");
    let times = long.column("time_s");
    let at_rest = heights[times.iter().position(|t| *t >= time(&short)).expect("a row")];
    // So much damping lets it settle for a while.
    let drift = heights.last().expect("a row") - at_rest;
    assert!(drift.abs() < 5e-4, "{drift} m");
}
