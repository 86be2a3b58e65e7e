//! A cluster is made once for a run: by the check before the start. The run reads it.

use tests::Bench;

const SCENE: &str = "end_time = 0.01\n[[rock]]\nname = \"block\"\nposition = [0, 0, 5]\ndensity = 2600.0\n\
                     shape = { type = \"ead_block\", size = 0.41 }\ncluster.spheres = 40\n";

/// How often a log says that spheres are being made, and that they are read.
fn said(log: &str) -> [usize; 2] {
    ["making a cluster of", "40 spheres of "].map(|words| log.matches(words).count())
}

#[test]
fn a_cluster_is_made_once_and_the_run_reads_it() {
    let bench = Bench::new();
    let scene = bench.scene(SCENE);
    let run = bench.done(&scene, "out", &[]);
    let file = bench.path("out/clusters/block.xyzr");
    let kept = std::fs::read_to_string(&file).expect("the cluster beside the scene of the run");
    let log = std::fs::read_to_string(bench.path("out/log/dem.log")).expect("the solver's log");
    assert_eq!(said(&log), [0, 1], "{log}");
    // The same run by the solver alone, which makes them itself, and from the file that was kept.
    let alone = bench.done(&bench.path("out/scene.toml"), "again", &[]);
    assert_eq!(run.column("block_z_m"), alone.column("block_z_m"));
    assert_eq!(std::fs::read_to_string(bench.path("again/clusters/block.xyzr")).expect("kept"), kept);
    // One that was changed by hand is made anew.
    std::fs::write(&file, kept.replace("0.", "1.")).expect("written");
    let changed = bench.done(&scene, "out", &["--force"]);
    assert_eq!(run.column("block_z_m"), changed.column("block_z_m"));
    assert_eq!(std::fs::read_to_string(&file).expect("kept"), kept);
}
