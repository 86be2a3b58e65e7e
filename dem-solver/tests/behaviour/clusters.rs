//! Clusters: flat landings, measures of an impact.

use crate::bench::{Bench, Setup, cube, fixed_plane};
use interface_defs::Solver;
use interface_defs::diagnostic::code;
use interface_defs::verdict::Fate;

fn land(spheres: u32, mass: &str, steps: f64) -> Bench {
    let more = "position = [0.0, 0.0, 0.205]\nvelocity = [0.0, 0.0, -1.0]";
    let scene = format!(
        "end_time = 1.0\n{}[[contact]]\nlaw = \"linear\"\nstiffness = 1e6\ndamping_ratio = 0.25527564\n\
         effective_mass = \"{mass}\"\n[dem]\nsteps_per_contact = {steps:?}\n",
        cube(spheres, more)
    );
    let mut bench = Setup::new(scene, fixed_plane(1.0, 1)).build();
    let h = bench.solver.model().steps.step;
    bench.until_separated(h);
    bench
}

/// V-D10: with the rock's whole mass in each of N dashpots the restitution falls with N; with its share
/// it is that of one contact. At 1000 steps per contact the second order leaves some 1e-5.
#[test]
fn restitution_of_a_flat_landing_stays_that_of_one_contact_with_the_local_mass() {
    for (spheres, with_whole_mass) in [(8, 0.292565), (64, 0.131604), (512, 0.046144)] {
        let local = land(spheres, "local", 1000.0);
        assert!((local.velocity().z - 0.5).abs() < 5e-5, "{}", local.velocity().z);
        assert!(local.spin().norm() < 1e-12, "a flat landing turns nothing");
        let whole = land(spheres, "rock", 1000.0);
        assert!((whole.velocity().z - with_whole_mass).abs() < 1e-3, "{}", whole.velocity().z);
    }
}

fn measure(bench: &mut Bench, name: &str) -> (f64, Option<f64>) {
    let statistics = bench.solver.finish().expect("finished");
    let found = statistics.measures.iter().find(|m| m.name == name);
    let measure = found.unwrap_or_else(|| panic!("no {name}: {:?}", statistics.warnings));
    (measure.value, measure.time)
}

/// A drop of 2 m: v = sqrt(2 g 2) at the passing of the mesh's level, to rounding, whatever the windows.
#[test]
fn the_impact_is_where_the_lowest_point_passes_the_level_of_the_wall_at_rest() {
    for window in [5e-5, 1.3e-3, 0.1] {
        let scene = format!(
            "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\n\
             poisson = 0.2\nrestitution = 0.5\n[dem]\ntime_step = 5e-5\n",
            cube(64, "position = [0.0, 0.0, 2.205]")
        );
        let mut bench = Setup::new(scene, fixed_plane(2.0, 3)).build();
        while bench.time < 0.8 {
            bench.advance(window);
        }
        let (speed, time) = measure(&mut bench, "impact_speed");
        assert!((speed - 6.26418391).abs() < 1e-8, "{speed}");
        assert!((time.expect("a time") - 0.638550857).abs() < 1e-9, "{time:?}");
        assert!((measure(&mut bench, "time_of_impact").0 - 0.638550857).abs() < 1e-9);
        assert!((measure(&mut bench, "impact_energy").0 - 180.0 * 9.81 * 2.0).abs() < 1e-6);
        let (rebound, _) = measure(&mut bench, "rebound_speed");
        assert!((rebound / 6.26418391 - 0.5).abs() < 0.02, "{rebound}");
        let (deepest, at) = measure(&mut bench, "max_deflection");
        let (braking, _) = measure(&mut bench, "braking_time");
        // The first touch is dated by its overlap, half a step of 5e-5 s at worst.
        assert!((at.expect("a time") - braking - 0.638550857).abs() < 2.5e-5);
        let (penetration, _) = measure(&mut bench, "max_penetration");
        let radius = 0.8 * 0.41 / 4.6;
        // Mid-step overlap against the depth at step ends: half a step of the curvature.
        assert!((penetration * radius / deepest - 1.0).abs() < 1e-3, "{penetration} {deepest}");
    }
}

#[test]
fn measures_that_never_came_about_are_absent_with_a_reason() {
    let scene = format!(
        "end_time = 1.0\n{}[[contact]]\nlaw = \"linear\"\nstiffness = 1e6\nrestitution = 1.0\n",
        cube(1, "position = [0.0, 0.0, 1.0]")
    );
    let mut bench = Setup::new(scene, fixed_plane(1.0, 1)).build();
    bench.advance(1e-3);
    let statistics = bench.solver.finish().expect("finished");
    assert!(statistics.measures.is_empty());
    let [why] = &statistics.warnings[..] else { panic!("{:?}", statistics.warnings) };
    assert_eq!(why.code, code::ABSENT_MEASURE);
    assert!(why.message.contains("impact_speed") && why.message.contains("not touched the net"), "{why}");
    let [verdict] = &statistics.verdicts[..] else { panic!("{:?}", statistics.verdicts) };
    assert_eq!((verdict.rock.as_str(), verdict.fate), ("rock", Fate::AtRest));
}
