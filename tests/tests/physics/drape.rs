//! A block below a drape net: the net lies on the ground, and where its lower edge is held it stops the block against the slope.

use interface_defs::Fate;
use std::path::Path;
use tests::{Bench, Ended, scene};

/// The scene with a coarser net.
const SMALL: [&str; 4] =
    ["--set", "structure.generator.cells=[8, 9]", "--set", "structure.generator.spacing=1.0"];
/// The lower edge of the net held as well.
const POCKET: [&str; 2] = [
    "--set",
    "structure.supports=[{ group = \"y_min\", motion = [[0.0, 0.0, 1.149, 0.964]] }, { group = \"y_max\" }]",
];

#[test]
#[ignore = "long"]
fn a_pocket_stops_the_block_against_the_slope_and_a_free_edge_lets_it_go() {
    let bench = Bench::new();
    let free = bench.done(&scene("drape"), "free", &SMALL);
    let pocket = bench.done(&scene("drape"), "pocket", &[&SMALL[..], &POCKET].concat());
    // It may bounce in the pocket afterwards.
    assert!(
        matches!(pocket.fates()[..], [Fate::Stopped | Fate::Rebounded | Fate::Undecided]),
        "{:?}",
        pocket.fates()
    );
    assert_eq!(free.fates(), [Fate::WentThrough]);
    // At first the net is at rest: supports and ground carry its weight. Between two held edges it hangs clear of the slope.
    let first = |run: &Ended, column: &str| run.column(column)[0];
    let weight = first(&pocket, "reaction_z_N");
    let ground = first(&free, "ground_force_z_N");
    assert_eq!(first(&pocket, "ground_force_z_N"), 0.0);
    assert!(ground > 0.1 * weight, "{ground} N");
    assert!((first(&free, "reaction_z_N") + ground - weight).abs() < 1e-6 * weight);
    // The slope falls along y: smooth, it pushes by the tangent of 50 degrees as much that way.
    let along = first(&free, "ground_force_y_N");
    assert!((along / ground - 50_f64.to_radians().tan()).abs() < 1e-3, "{along} N, {ground} N");
    for run in [&free, &pocket] {
        assert!(run.measure("energy_error") < 5e-3);
    }
}

#[test]
fn heights_are_made_for_the_place_and_the_ground_and_the_resolved_scene_runs_again() {
    let bench = Bench::new();
    let first = bench.done(&scene("drape"), "out", &[&SMALL[..], &["--set", "end_time=0.05"]].concat());
    let resolved = std::fs::read_to_string(first.out.join("scene.toml")).expect("a scene");
    let named = format!("ground = \"{}\"", first.out.join("ground.asc").display());
    assert!(resolved.contains(&named), "{resolved}");
    let again = bench.done(&first.out.join("scene.toml"), "again", &[]);
    let rows = |out: &Path| std::fs::read(out.join("history.csv")).expect("rows");
    assert!(rows(&first.out) == rows(&again.out), "the resolved scene gives other rows");
}
