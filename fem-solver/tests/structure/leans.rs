//! Rest shapes of barriers on slopes: at every lean, and with the lean that is taken where the scene names none.

use crate::common::{Run, scene};
use crate::rest::barrier;
use fem_solver::FemSolver;
use interface_defs::message::Plan;
use nalgebra::Vector3;
use std::fs;
use tempfile::TempDir;
use toolkit::program::Options;

/// A slope that falls along x by `angle` degrees, as two rows of two heights.
fn slope(angle: f64) -> TempDir {
    let dir = tempfile::tempdir().expect("a directory");
    let fall = 60.0 * angle.to_radians().tan();
    let row = format!("{:?} {:?}\n", 500.0 + fall, 500.0 - fall);
    let text = format!("ncols 2\nnrows 2\nxllcenter 2599940\nyllcenter 1199940\ncellsize 120\n{row}{row}");
    fs::write(dir.path().join("g.asc"), text).expect("written");
    dir
}

/// A barrier of rings or cables on that slope.
fn placed(dir: &TempDir, lean: Option<f64>, rings: bool) -> String {
    let own = barrier(lean.unwrap_or(0.0), 10, 0.0, "static", 0.0);
    let line = own.lines().find(|line| line.starts_with("lean = ")).expect("a lean").to_owned();
    let place = format!(
        "position = [2600000, 1200000]\nazimuth = 0.0\nlength = 30.0\nground = {:?}",
        dir.path().join("g.asc")
    );
    let own = own.replace("anchor_rise = 0.0", &place);
    let own = if lean.is_none() { own.replace(&line, "") } else { own };
    if rings {
        return own;
    }
    let (head, tail) = own.split_once("[[structure.parts]]\nname = \"net\"").expect("a net");
    let (_, tail) = tail.split_once("[[structure.parts]]").expect("more parts");
    let net = "[[structure.parts]]\nname = \"net\"\nelement = \"cable\"\narea = 2.5e-5\nprestress = 2e6\n";
    format!("{head}{net}[[structure.parts]]{tail}").replace("net = \"rings\"", "net = \"square\"")
}

/// Largest turn of a post from where it was modelled, and its angle to the slope as modelled [degrees].
fn posts(run: &Run, angle: f64) -> (f64, f64) {
    let model = run.solver.model();
    let group = |name: &str| &model.groups.iter().find(|g| g.name == name).expect("a group").nodes;
    let at_rest = |n: usize| Vector3::from_column_slice(&run.ready.mesh.coordinates[3 * n..][..3]);
    let mut most: (f64, f64) = (0.0, 0.0);
    for (foot, head) in group("feet").iter().zip(group("heads")).map(|(a, b)| (*a as usize, *b as usize)) {
        let (was, is) = (model.nodes[head] - model.nodes[foot], at_rest(head) - at_rest(foot));
        let up = Vector3::new(-angle.to_radians().cos(), 0.0, angle.to_radians().sin());
        most = (most.0.max(was.angle(&is).to_degrees()), was.angle(&up).to_degrees());
    }
    most
}

fn at_rest(text: &str) -> Run {
    // Shortcuts would leave out what rests.
    let solver = FemSolver::new(&scene(text), &Options { out: None, shortcuts: false });
    let plan = Plan { end_time: 1.0, window: 1e-2, ..Plan::default() };
    let mut run = Run::of(solver.unwrap_or_else(|e| panic!("{e}")), plan);
    let weight = 9.81 * run.solver.model().mass.iter().sum::<f64>();
    let carried = run.value("reaction_z");
    (0..5).for_each(|_| run.step(1e-2, &[]));
    let energy = run.value("energy_kinetic_fem");
    assert!((carried / weight - 1.0).abs() < 1e-3, "{carried} N of {weight} N");
    assert!(energy < 1e-6, "{energy} J");
    run
}

#[test]
fn barriers_on_a_slope_come_to_rest_at_every_lean() {
    let dir = slope(35.0);
    for rings in [true, false] {
        for lean in [0.0, 10.0, 20.0, 30.0] {
            let run = at_rest(&placed(&dir, Some(lean), rings));
            let (turned, _) = posts(&run, 35.0);
            println!("rings {rings}, lean {lean} degrees: posts turn by {turned:.1} degrees");
            // Ropes that sag pull a post over that leans by less.
            assert!(lean <= 20.0 || turned < 2.0, "{lean}: {turned}");
        }
    }
}

#[test]
fn the_lean_that_is_taken_holds_the_posts_on_every_slope() {
    for angle in [10.0, 25.0, 35.0, 45.0, 55.0] {
        let dir = slope(angle);
        for rings in [true, false] {
            let run = at_rest(&placed(&dir, None, rings));
            let (turned, to_slope) = posts(&run, angle);
            println!(
                "slope {angle}, rings {rings}: posts at {to_slope:.1} degrees to it turn by {turned:.1} degrees"
            );
            assert!(turned < 2.0, "{angle}: {turned}");
            // 75 degrees to the slope, where that leans by 25 degrees from the vertical at least.
            let expected = if angle >= 40.0 { 75.0 } else { 90.0 - angle + 25.0 };
            assert!((to_slope - expected).abs() < 1e-6, "{to_slope}");
        }
    }
}
