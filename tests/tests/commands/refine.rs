//! `--refine`: a second run with half the steps says by how much the measures of the first may be off.

use tests::{Bench, Ended, program, scene};

#[test]
fn half_the_steps_give_the_uncertainties_and_leave_the_results_as_they_are() {
    let bench = Bench::new();
    let sets = ["--set", "end_time=0.75", "--set", "dem.time_step=2e-5"];
    let path = scene("walenstadt-compare");
    let plain = bench.done(&path, "plain", &sets);
    let refined = bench.done(&path, "refined", &[&sets[..], &["--refine"]].concat());
    assert_eq!(refined.history(), plain.history());
    assert!(refined.stdout.contains("half the steps:"), "{}", refined.stdout);
    let fine: serde_json::Value = serde_json::from_str(
        &std::fs::read_to_string(refined.out.join("refined/summary.json")).expect("a summary"),
    )
    .expect("JSON");
    let of = |ended: &Ended, name: &str| ended.summary()["measures"][name].clone();
    for name in ["max_deflection", "max_reaction_1ms", "max_cable_force"] {
        assert_eq!(of(&plain, name)["uncertainty_by"], "estimate");
        let (first, second) =
            (of(&refined, name), fine["measures"][name]["value"].as_f64().expect("a number"));
        assert_eq!(first["uncertainty_by"], "refinement");
        let (value, off) =
            (first["value"].as_f64().expect("a number"), first["uncertainty"].as_f64().expect("a number"));
        assert!(
            (off - 2.0 * (second - value).abs()).abs() <= 1e-9 * value.abs(),
            "{name}: {off}, {value} {second}"
        );
        // Both ways agree about what the run is worth.
        let estimate = of(&plain, name)["uncertainty"].as_f64().expect("a number");
        assert!(off < 2.0 * estimate, "{name}: {off} by refinement, {estimate} estimated");
    }
    let verified = std::process::Command::new(program("rockfall")).arg("verify").arg(&refined.out).output();
    assert!(verified.expect("started").status.success());
}
