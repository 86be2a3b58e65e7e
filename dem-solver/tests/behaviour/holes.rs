//! Files of surfaces with several bodies and with holes.

use crate::covers::run;
use dem_solver::DemSolver;
use dem_solver::shape::{Surface, builtin};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Two bodies in a file are distinguished by their names and volumes, one is taken when asked for, and holes are closed
/// when asked for, in a scene too.
#[test]
fn files_with_several_bodies_and_with_holes_are_refused_with_a_cure_that_works() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = |name: &str| dir.path().join(name).display().to_string();
    let block = builtin::ellipsoid(Vector3::repeat(0.5), 2);
    let obj = |name: &str, scale: f64, shift: f64, leave: usize, first: usize| {
        let mut text = format!("o {name}\n");
        for p in &block.points {
            text += &format!("v {:?} {:?} {:?}\n", scale * p.x + shift, scale * p.y, scale * p.z);
        }
        for t in &block.triangles[leave..] {
            text +=
                &format!("f {} {} {}\n", t[0] as usize + first, t[1] as usize + first, t[2] as usize + first);
        }
        text
    };
    let (two, open, out) = (path("two.obj"), path("open.obj"), path("c.xyzr"));
    let small = obj("small", 0.5, 3.0, 0, block.points.len() + 1);
    std::fs::write(&two, obj("large", 1.0, 0.0, 0, 1) + &small).expect("written");
    std::fs::write(&open, obj("scan", 1.0, 0.0, 1, 1)).expect("written");
    let (code, text) = run(&[&two, "-n", "20", "-o", &out]);
    assert!(
        code == 2 && text.contains("`large`") && text.contains("Piece 2 `small`: 320 triangles"),
        "{text}"
    );
    let volume = dem_solver::shape::SolidIntegrals::of(&block).volume / 8.0;
    for piece in ["2", "small"] {
        let (code, text) = run(&[&two, "-n", "20", "--piece", piece, "-o", &out]);
        assert!(code == 0 && text.contains(&format!("volume {volume:.6e}")[..14]), "{text}");
    }
    let (code, text) = run(&[&two, "-n", "20", "--piece", "smal", "-o", &out]);
    assert!(code == 2 && text.contains("no piece is called `smal`: the file has `large`, `small`"), "{text}");
    let (code, text) = run(&[&two, "-n", "20", "--piece", "3", "-o", &out]);
    assert!(code == 2 && text.contains("no piece 3: the surface has 2"), "{text}");
    let (code, text) = run(&[&open, "-n", "20", "-o", &out]);
    assert!(code == 2 && text.contains("--close-holes"), "{text}");
    let (code, text) = run(&[&open, "-n", "20", "--close-holes", "-o", &out]);
    assert!(code == 0 && text.contains("note: 1 hole was closed, 9."), "{text}");
    three_holes_are_closed_and_measured(&path("three.obj"), &out, &block);
    let scene = format!(
        "end_time = 1.0\n[[rock]]\nposition = [0.0, 0.0, 1.0]\ndensity = 2600.0\ncluster.spheres = 20\n\
         shape = {{ type = \"mesh\", file = {open:?}, close_holes = true }}\n"
    );
    let scene = Scene::from_text("test.toml", &scene).expect("a scene");
    let solver = DemSolver::new(&scene, &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        solver.notices().iter().any(|n| n.message.contains("1 hole was closed")),
        "{:?}",
        solver.notices()
    );
}

/// Three single triangles that do not touch: their own areas are those of the holes.
fn three_holes_are_closed_and_measured(file: &str, out: &str, block: &Surface) {
    let holes = [0, 100, 200];
    let shared = |a: usize, b: usize| block.triangles[a].iter().any(|p| block.triangles[b].contains(p));
    assert!(!shared(0, 100) && !shared(100, 200) && !shared(0, 200));
    let mut text = String::new();
    for p in &block.points {
        text += &format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z);
    }
    for (_, t) in block.triangles.iter().enumerate().filter(|(k, _)| !holes.contains(k)) {
        text += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    std::fs::write(file, text).expect("written");
    let (code, text) = run(&[file, "-n", "20", "--close-holes", "-o", out]);
    let area: f64 = holes.iter().map(|t| block.area(*t)).sum();
    let stated = format!("note: 3 holes were closed, {area:.3e} m2 together");
    assert!(code == 0 && text.contains(&stated), "{stated}: {text}");
    let volume = dem_solver::shape::SolidIntegrals::of(block).volume;
    assert!(text.contains(&format!("volume {volume:.9e} m3")[..18]), "{volume}: {text}");
}
