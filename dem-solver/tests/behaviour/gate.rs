//! The gate: what is certainly wrong is refused with its place, the numbers and the cure; what is possible, but unusual, is warned of.

use crate::bench::{cube, fixed_plane, net, sphere};
use dem_solver::DemSolver;
use dem_solver::check::{check, check_with};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::message::FaultKind;
use interface_defs::{Plan, Solver};
use std::path::Path;
use toolkit::check::CheckReport;
use toolkit::program::Options;
use toolkit::scene::Scene;

const HEAD: &str = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n";
const CONTACT: &str =
    "[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.2\nrestitution = 0.5\nfriction = 0.5\n";

fn ball(more: &str) -> String {
    sphere(0.2, 2500.0, &format!("position = [0.0, 0.0, 1.0]\n{more}"))
}

/// Warnings of a check.
fn sentences(report: &CheckReport) -> Vec<String> {
    report.warnings.iter().map(Diagnostic::to_string).collect()
}

/// Warnings of the check of a scene that lies in `dir`.
fn said_in(dir: &Path, text: &str) -> Result<Vec<String>, String> {
    let name = dir.join("test.toml").display().to_string();
    let scene = Scene::from_text(&name, text).map_err(|e| e.to_string())?;
    check(&scene).map(|report| sentences(&report)).map_err(|e| e.to_string())
}

fn said(text: &str) -> Result<Vec<String>, String> {
    said_in(Path::new(""), text)
}

fn refused(text: &str, words: &[&str]) {
    let message = said(text).expect_err(text);
    assert!(message.starts_with("test.toml:") && message.contains("\n   = "), "place and cure: {message}");
    for word in words {
        assert!(message.contains(word), "{word:?} is not in:\n{message}");
    }
}

fn warned(text: &str, words: &[&str]) {
    let warnings = said(text).unwrap_or_else(|e| panic!("{e}"));
    let [warning] = &warnings[..] else { panic!("one warning: {warnings:?}\n{text}") };
    for word in words {
        assert!(warning.contains(word), "{word:?} is not in: {warning}");
    }
}

#[test]
fn a_sound_scene_says_nothing() {
    assert_eq!(said(&format!("{HEAD}{}{CONTACT}", ball(""))), Ok(vec![]));
}

#[test]
fn a_decimal_comma_is_refused_in_every_vector_of_a_rock() {
    let text = format!("{HEAD}{}", ball(""));
    for (from, to) in [
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0, 0, -9,81]"),
        ("position = [0.0, 0.0, 1.0]", "position = [0, 0, 1,5]"),
        ("position = [0.0, 0.0, 1.0]", "position = [0, 0, 1]\nvelocity = [0, 0, -2,5]"),
        ("position = [0.0, 0.0, 1.0]", "position = [0, 0, 1]\nangular_velocity = [0, 0, 2,5]"),
        ("position = [0.0, 0.0, 1.0]", "position = [0, 0, 1]\norientation = [1, 0, 0, 0,5]"),
    ] {
        refused(&text.replace(from, to), &["values where", "a decimal comma?"]);
    }
    let boxed = format!(
        "{HEAD}{}",
        cube(8, "position = [0.0, 0.0, 1.0]").replace("[0.41, 0.41, 0.41]", "[0,41, 0.41, 0.41]")
    );
    refused(&boxed, &["4 values where 3 are needed", "0.41"]);
}

#[test]
fn gravity_that_is_missing_large_or_small_is_named() {
    let with = |gravity: &str| format!("end_time = 1.0\n{gravity}\n{}", ball(""));
    warned(&with(""), &["names no gravity", "gravity = [0.0, 0.0, -9.81]"]);
    assert_eq!(said(&with("gravity = [0.0, 0.0, 0.0]")), Ok(vec![]));
    refused(&with("gravity = [0.0, 0.0, -9810.0]"), &["test.toml:2:11", "9810 m/s2", "mm/s2?"]);
    refused(&with("gravity = [0.0, 0.0, -981.0]"), &["cm/s2?"]);
    warned(&with("gravity = [0.0, 0.0, -32.2]"), &["32.2", "ft/s2?"]);
    warned(&with("gravity = [0.0, 0.0, -0.981]"), &["0.981", "9.81 m/s2"]);
    // A net that stands tilted, or a mesh from which it stands out.
    assert_eq!(said(&with("gravity = [0.0, -6.378, -6.378]")), Ok(vec![]));
    assert_eq!(said(&with("gravity = [0.0, 9.81, 0.0]")), Ok(vec![]));
}

#[test]
fn on_a_terrain_gravity_must_be_there_and_point_down() {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("t.obj"), "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nf 1 2 3\nf 1 3 4\n")
        .expect("written");
    let of = |gravity: &str| {
        said_in(
            dir.path(),
            &format!("end_time = 1.0\n{gravity}\n{}[terrain]\nfile = \"t.obj\"\n{CONTACT}", ball("")),
        )
    };
    assert_eq!(of("gravity = [0.0, 0.0, -9.81]"), Ok(vec![]));
    for (gravity, words) in [
        ("", "names no gravity"),
        ("gravity = [0.0, 0.0, 9.81]", "points up"),
        ("gravity = [0.0, -9.81, 0.0]", "90 degrees off -z"),
    ] {
        let message = of(gravity).expect_err(gravity);
        assert!(message.contains(words) && message.contains("[0.0, 0.0, -9.81]"), "{message}");
    }
    let tilted = of("gravity = [1.0, 0.0, -9.75]").expect("a warning");
    // atan(1 / 9.75) = 5.86 degrees.
    assert!(tilted.len() == 1 && tilted[0].contains("5.9 degrees off -z"), "{tilted:?}");
    assert_eq!(of("gravity = [0.0, 0.0, 0.0]"), Ok(vec![]));
}

#[test]
fn other_units_of_a_rock_are_named_with_what_they_would_be() {
    let with = |from: &str, to: &str| {
        let text = format!("{HEAD}{}{CONTACT}", ball(""));
        assert!(text.contains(from));
        text.replace(from, to)
    };
    refused(&with("density = 2500.0", "density = 2.5"), &["2.5 kg/m3", "g/cm3", "would be 2500 kg/m3"]);
    refused(&with("density = 2500.0", "density = 2.5e6"), &["in g/m3, it would be 2500 kg/m3"]);
    warned(&with("density = 2500.0", "density = 7850.0"), &["7850 kg/m3"]);
    // 4/3 pi 0.2^3 = 0.03351 m3.
    warned(&with("density = 2500.0", "mass = 1000.0"), &["29840 kg/m3", "0.03351 m3"]);
    refused(&with("radius = 0.2", "radius = 200.0"), &["400 m x 400 m", "metres"]);
    let large = said(&with("radius = 0.2", "radius = 12.0")).expect("a warning");
    assert!(large.iter().any(|w| w.contains("24 m x 24 m") && w.contains("metres")), "{large:?}");
    refused(&with("young = 1e9", "young = 30.0"), &["test.toml:10:9", "young = 30 Pa", "would be 3e10 Pa"]);
    warned(
        &with("friction = 0.5", "friction = 30.0").replace("friction = 30.0", "friction = 9.0"),
        &["friction of 9", "0.158"],
    );
    refused(&with("position", "velocity = [0.0, 0.0, -2000.0]\nposition"), &["2000 m/s", "90 km/h"]);
    warned(&with("position", "velocity = [0.0, 0.0, -90.0]\nposition"), &["324 km/h", "25 m/s"]);
    warned(
        &with("position", "angular_velocity = [0.0, 720.0, 0.0]\nposition"),
        &["720 rad/s", "12.57 rad/s"],
    );
    warned(&with("position", "orientation = [45.0, 0.0, 0.0, 1.0]\nposition"), &["length 45.01"]);
    warned(&with("position", "orientation = [0.0, 0.0, 0.0, 1.0]\nposition"), &["half a turn about z"]);
}

#[test]
fn a_surface_in_millimetres_is_refused_with_the_scale_that_makes_it_metres() {
    let dir = tempfile::tempdir().expect("a directory");
    let corner = |i: usize| [0, 1, 2].map(|b| if i >> b & 1 == 1 { 800.0 } else { 0.0 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = String::new();
    for i in 0..8 {
        let [x, y, z] = corner(i);
        text += &format!("v {x} {y} {z}\n");
    }
    for face in faces {
        let [a, b, c, d] = face.map(|n: usize| n + 1);
        text += &format!("f {a} {b} {c} {d}\n");
    }
    std::fs::write(dir.path().join("block.obj"), text).expect("written");
    let of = |scale: &str| {
        let shape =
            format!("shape = {{ type = \"mesh\", file = \"block.obj\"{scale} }}\ncluster.spheres = 20\n");
        said_in(dir.path(), &format!("{HEAD}[[rock]]\ndensity = 2600.0\nposition = [0.0, 0.0, 1.0]\n{shape}"))
    };
    let message = of("").expect_err("800 m");
    assert!(message.contains("800 m x 800 m x 800 m") && message.contains("scale = 0.001"), "{message}");
    assert_eq!(of(", scale = 0.001"), Ok(vec![]));
}

#[test]
fn a_cluster_file_of_another_body_is_refused_or_warned_of() {
    let dir = tempfile::tempdir().expect("a directory");
    let of = |spheres: &str| {
        std::fs::write(dir.path().join("c.txt"), spheres).expect("written");
        let text = "[[rock]]\ndensity = 2600.0\nposition = [0.0, 0.0, 1.0]\nshape = { type = \"box\", size = [0.4, 0.4, 0.8] }\n\
                    cluster.file = \"c.txt\"\n";
        said_in(dir.path(), &format!("{HEAD}{text}"))
    };
    // Two rows of four: each sphere touches the faces.
    let lattice = |scale: f64, shift: f64| {
        let mut text = String::new();
        for (x, y) in [(-0.1, -0.1), (0.1, -0.1), (-0.1, 0.1), (0.1, 0.1)] {
            for z in [-0.3, -0.1, 0.1, 0.3] {
                text += &format!("{} {} {} {}\n", scale * x + shift, scale * y, scale * z, 0.101 * scale);
            }
        }
        text
    };
    assert_eq!(of(&lattice(1.0, 0.0)), Ok(vec![]));
    for (text, words) in [
        (lattice(1000.0, 0.0), "millimetres"),
        (lattice(3.0, 0.0), "the spheres of c.txt fill a box of"),
        (lattice(1.0, 0.3), "off that of the shape"),
    ] {
        let message = of(&text).expect_err(words);
        assert!(message.contains(words) && message.contains("test.toml:7"), "{message}");
    }
    let large = of(&lattice(1.4, 0.0)).expect("a warning");
    assert!(
        large[0].contains("0.5628 m x 0.5628 m x 1.123 m") && large[0].contains("0.4 m x 0.4 m x 0.8 m"),
        "{large:?}"
    );
    let beside = of(&lattice(1.0, 0.06)).expect("a warning");
    assert!(beside[0].contains("0.06 m x 0 m x 0 m off"), "{beside:?}");
}

/// A slope of 45 degrees: the centre of a sphere stands sqrt(2) radii above it where it touches.
#[test]
fn the_surface_of_a_rock_and_not_its_centre_must_be_free_of_the_terrain() {
    let dir = tempfile::tempdir().expect("a directory");
    let slope = "v -5 -5 5\nv 5 -5 -5\nv 5 5 -5\nv -5 5 5\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(dir.path().join("t.obj"), slope).expect("written");
    let touching = 0.2 * 2.0_f64.sqrt();
    let of = |z: f64| {
        let rock = sphere(0.2, 2500.0, &format!("position = [0.0, 0.0, {z:?}]"));
        said_in(dir.path(), &format!("{HEAD}{rock}[terrain]\nfile = \"t.obj\"\n{CONTACT}"))
    };
    assert_eq!(of(touching + 1e-3), Ok(vec![]));
    assert_eq!(of(touching - 1e-4), Ok(vec![]), "a touch");
    let message = of(0.2).expect_err("0.2 m above the terrain along z, 0.14 m from it");
    // 0.2 - 0.2 / sqrt(2) = 0.05858; free from sqrt(2) 0.2 = 0.28284 on.
    assert!(message.contains("reaches 0.05858 m into it"), "{message}");
    assert!(message.contains("try position = [0.0, 0.0, 0.283]"), "{message}");
    let message = of(-0.3).expect_err("below");
    assert!(message.contains("0.30 m below the terrain") && message.contains("0.283]"), "{message}");
    assert_eq!(of(0.283), Ok(vec![]), "the position that was offered");
}

#[test]
fn a_rock_that_starts_in_the_net_is_refused_by_check_and_run_in_the_same_words() {
    let text = |z: f64, more: &str| {
        format!("{HEAD}{}{CONTACT}", cube(64, &format!("position = [0.0, 0.0, {z:?}]\n{more}")))
    };
    let of = |text: &str, mesh: interface_defs::InterfaceMesh| {
        let scene = Scene::from_text("test.toml", text).expect("a scene");
        let checked = check_with(&scene, Some(&mesh), None).map(|_| ()).map_err(|e| e.to_string());
        let mut solver =
            DemSolver::new(&scene, &Options::default()).unwrap_or_else(|e| panic!("{e}")).guarded();
        let plan = Plan { end_time: 1.0, window: 1e-3, partner_mesh: Some(mesh), ..Plan::default() };
        let prepared = solver.prepare(&plan, &mut |_| Ok(())).map(|_| ());
        if let Err(fault) = &prepared {
            assert_eq!(fault.kind, FaultKind::Input);
        }
        assert_eq!(checked, prepared.map_err(|f| f.to_string()));
        checked
    };
    assert_eq!(of(&text(0.2055, ""), fixed_plane(1.0, 1)), Ok(()));
    // 64 spheres in a cube of 0.41 m reach its faces; the lower one stands at 0.1 m - 0.205 m.
    let message = of(&text(0.1, ""), fixed_plane(1.0, 1)).expect_err("inside");
    assert!(message.starts_with("test.toml:") && message.contains("starts inside the net"), "{message}");
    assert!(message.contains("of radius 0.0713 m overlaps the face"), "{message}");
    assert!(message.contains("try position = [0.0, 0.0, 0.206]"), "{message}");
    // Moved back where it came from.
    let message = of(&text(0.1, "velocity = [0.0, 0.0, 5.0]"), fixed_plane(1.0, 1)).expect_err("inside");
    assert!(message.contains("try position = [0.0, 0.0, -0.206]"), "{message}");
    let message = of(&text(0.1, ""), net(8, 0.15, 0.0)).expect_err("among wires");
    assert!(message.contains("overlaps the line between nodes"), "{message}");
    assert_eq!(of(&text(0.206, ""), net(8, 0.15, 0.0)), Ok(()));
}

#[test]
fn a_landing_that_is_too_soft_and_a_time_that_is_too_short_are_told_with_the_numbers() {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("t.obj"), "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nf 1 2 3\nf 1 3 4\n")
        .expect("written");
    let of = |z: f64, young: &str, end: &str| {
        let rock = sphere(0.2, 2500.0, &format!("position = [0.0, 0.0, {z:?}]"));
        let contact = CONTACT.replace("1e9", young);
        let head = HEAD.replace("end_time = 1.0", &format!("end_time = {end}"));
        said_in(dir.path(), &format!("{head}{rock}[terrain]\nfile = \"t.obj\"\n{contact}")).expect("possible")
    };
    assert_eq!(of(5.2, "1e9", "5.0"), Vec::<String>::new());
    let soft = of(5.2, "1e5", "5.0");
    // sqrt(2 g 5 m) = 9.905 m/s; (5 pi / 4 rho v^2 / E*)^(2/5) = (9.631e5 / 1.0417e5)^0.4 = 2.43: more than twice.
    assert!(
        soft.len() == 1 && soft[0].contains("9.905 m/s") && soft[0].contains("more than twice"),
        "{soft:?}"
    );
    let soft = of(5.2, "1e6", "5.0");
    // (9.631e5 / 1.0417e6)^0.4 = 0.9691; half of it takes 0.9691^2.5 / 0.5^2.5 = 5.23 times the modulus.
    assert!(soft.len() == 1 && soft[0].contains("0.9691 of their radius"), "{soft:?}");
    let asked: f64 = soft[0]
        .split("young = ")
        .nth(1)
        .and_then(|t| t.split(' ').next())
        .expect("a modulus")
        .parse()
        .expect("a number");
    assert!((asked / 5.233e6 - 1.0).abs() < 0.01, "{asked}");
    // A fall of 5 m takes sqrt(2 5 / 9.81) = 1.00964 s.
    let short = of(5.2, "1e9", "0.9");
    assert!(short.len() == 1 && short[0].contains("a fall of 5 m takes 1.01 s"), "{short:?}");
}

/// Sign, axis or time of a rock's start: it never touches the net.
#[test]
fn a_rock_that_does_not_reach_the_net_is_warned_of_with_the_distance() {
    let of = |z: f64, more: &str, head: &str| {
        let text = format!("{head}{}{CONTACT}", cube(64, &format!("position = [0.0, 0.0, {z:?}]\n{more}")));
        let scene = Scene::from_text("test.toml", &text).expect("a scene");
        sentences(&check_with(&scene, Some(&fixed_plane(1.0, 1)), None).unwrap_or_else(|e| panic!("{e}")))
    };
    assert_eq!(of(2.0, "", HEAD), Vec::<String>::new());
    assert_eq!(of(2.0, "velocity = [0.0, 0.0, -50.0]", HEAD), Vec::<String>::new(), "fast");
    for (warnings, words) in [
        (of(3.0, "", &HEAD.replace("-9.81", "9.81")), "sign of gravity wrong? gravity = [0.0, 0.0, -9.81]"),
        (
            of(3.0, "velocity = [0.0, 0.0, 25.0]", HEAD),
            "sign of its velocity wrong? velocity = [0.0, 0.0, -25.0]",
        ),
        (of(-3.0, "", HEAD), "sign of its height wrong? position = [0.0, 0.0, 3.0]"),
        // 8.8 m down to its sphere take 1.34 s.
        (of(9.0, "", &HEAD.replace("end_time = 1.0", "end_time = 0.5")), "nearest at end_time = 0.5 s"),
        // Just above the plane, and up so fast that it is not back in time.
        (of(0.21, "velocity = [0.0, 0.0, 25.0]", HEAD), "moves away from the first moment on"),
    ] {
        let [warning] = &warnings[..] else { panic!("one warning: {warnings:?}") };
        assert!(warning.starts_with("rock.0.position: "), "{warning}");
        assert!(warning.contains("does not reach the net") && warning.contains(words), "{warning}");
    }
}

/// Meshes of terrain: heights in millimetres, and z in the place of y.
#[test]
fn a_terrain_mesh_in_millimetres_or_on_its_side_is_named() {
    let dir = tempfile::tempdir().expect("a directory");
    let of = |corners: [[f64; 3]; 4], place: &str| {
        let mut text = String::new();
        for [x, y, z] in corners {
            text += &format!("v {x} {y} {z}\n");
        }
        std::fs::write(dir.path().join("t.obj"), text + "f 1 2 3\nf 1 3 4\n").expect("written");
        let rock = sphere(0.2, 2500.0, &format!("position = {place}"));
        said_in(dir.path(), &format!("{HEAD}{rock}[terrain]\nfile = \"t.obj\"\n{CONTACT}"))
    };
    let flat = [[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [5.0, 5.0, 1.0], [-5.0, 5.0, 1.0]];
    assert_eq!(of(flat, "[0.0, 0.0, 1.0]"), Ok(vec![]));
    let high = flat.map(|[x, y, z]| [1e3 * x, 1e3 * y, 1e3 * (z + 100.0)]);
    let message = of(high, "[0.0, 0.0, 1.0]").expect_err("100 km");
    assert!(message.contains("t.obj: heights from 1e5 to 1.01e5 m"), "{message}");
    // The same surface with y upward: 10 m2 from above, 100 m2 seen along y.
    let upright = flat.map(|[x, y, z]| [x, z, -y]);
    let warnings = of(upright, "[0.0, 0.5, 7.0]").expect("a warning");
    assert!(
        warnings.iter().any(|w| w.contains("seen along y") && w.contains("upward axis is y")),
        "{warnings:?}"
    );
}

#[test]
fn a_mass_in_tonnes_a_restitution_in_percent_and_a_size_in_centimetres_are_refused() {
    let text = format!("{HEAD}{}{CONTACT}", ball(""));
    // 4/3 pi 0.2^3 2500 = 83.78 kg.
    refused(&text.replace("density = 2500.0", "mass = 0.0838"), &["2.501 kg/m3", "in tonnes", "mass = 83.8"]);
    refused(&text.replace("restitution = 0.5", "restitution = 50"), &["50 % is restitution = 0.5"]);
    refused(&text.replace("radius = 0.2", "radius = 20"), &["40 m x 40 m x 40 m", "metres"]);
}

/// Of two rocks each is looked at; one that the other may push to the net is not.
#[test]
fn of_several_rocks_each_that_misses_the_net_is_warned_of() {
    let stone = |x: f64, more: &str| {
        format!("{}{more}", sphere(0.2, 2500.0, &format!("name = \"stone\"\nposition = [{x:?}, 0.0, 2.0]\n")))
    };
    let of = |stone: String| {
        let text = format!("{HEAD}{}{stone}{CONTACT}", cube(64, "position = [0.0, 0.0, 2.0]\n"));
        let scene = Scene::from_text("test.toml", &text).expect("a scene");
        sentences(&check_with(&scene, Some(&fixed_plane(1.0, 1)), None).unwrap_or_else(|e| panic!("{e}")))
    };
    assert_eq!(of(stone(0.7, "")), Vec::<String>::new());
    let beside = of(stone(9.0, ""));
    assert!(
        beside.len() == 1 && beside[0].starts_with("rock.1.position: rock `stone` does not reach"),
        "{beside:?}"
    );
    assert!(beside[0].contains("the middle of the net is at"), "{beside:?}");
    // It comes down from the side, through the place where the other falls.
    assert_eq!(of(stone(9.0, "velocity = [-20.0, 0.0, 0.0]\n")), Vec::<String>::new());
}

/// On a terrain: a net that stands beside it, or above what the rock can get to; and no law for a net.
#[test]
fn a_net_that_no_rock_of_a_terrain_can_get_to_and_one_without_a_law_are_named() {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("t.obj"), "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nf 1 2 3\nf 1 3 4\n")
        .expect("written");
    let of = |contact: &str, by: [f64; 3]| {
        let name = dir.path().join("test.toml").display().to_string();
        let text = format!("{HEAD}[structure]\n{}[terrain]\nfile = \"t.obj\"\n{contact}", ball(""));
        let mut net = net(4, 1.0, 0.0);
        net.coordinates.chunks_exact_mut(3).for_each(|p| (0..3).for_each(|a| p[a] += by[a]));
        let scene = Scene::from_text(&name, &text).expect("a scene");
        check_with(&scene, Some(&net), None).map(|r| sentences(&r)).map_err(|e| e.to_string())
    };
    assert_eq!(of(CONTACT, [0.0, 0.0, 0.2]), Ok(vec![]));
    let beside = of(CONTACT, [500.0, 0.0, 0.2]).expect("a warning");
    assert!(beside.len() == 1 && beside[0].contains("m beside the terrain"), "{beside:?}");
    let above = of(CONTACT, [0.0, 0.0, 40.0]).expect("a warning");
    assert!(above.len() == 1 && above[0].contains("above all that the rock can get to"), "{above:?}");
    let falls = said(&format!("{HEAD}{}[structure]\n", ball(""))).expect_err("no law");
    assert!(falls.contains("no contact law") && falls.contains("add a table [[contact]]"), "{falls}");
}

/// Numbers that fit another unit, in tables that are not a rock's.
#[test]
fn other_units_of_contact_terrain_clusters_and_gravel_are_named() {
    let of = |from: &str, to: &str| {
        let text = format!("{HEAD}{}{CONTACT}", ball(""));
        assert!(text.contains(from));
        text.replace(from, to)
    };
    refused(
        &of("restitution = 0.5", "damping_ratio = 20.0"),
        &["damping_ratio = 20 is more than 1", "in per cent, it would be 0.2"],
    );
    warned(
        &of("restitution = 0.5", "damping_ratio = 2.0"),
        &["contact.0.damping_ratio: 2 is more than 1", "in per cent, it would be 0.02"],
    );
    warned(
        &of("friction = 0.5", "friction = 0.5\nrolling_friction = 50.0"),
        &["rolling friction of 50", "89 degrees"],
    );
    warned(&of("young = 1e9", "young = 3e4"), &["contact.0.young: ", "in MPa, it would be 3e10 Pa"]);
    // 165 times 0.45359 kg over 0.028317 m3.
    warned(
        &of("density = 2500.0", "density = 165.0"),
        &["rock.0.density: ", "in lb/ft3, it would be 2643 kg/m3"],
    );
    // 9.81 times 800.
    warned(&of("end_time = 1.0", "end_time = 800.0"), &["end_time: 800 s", "7848 m/s", "end_time = 0.8"]);
    let rock = |cluster: &str| {
        format!("{HEAD}{}", cube(27, "position = [0.0, 0.0, 1.0]\n")).replace("cluster.spheres = 27", cluster)
    };
    let medial = rock("cluster.spheres = 27\ncluster.method = \"medial\"\ncluster.smallest_radius = 50.0");
    refused(&medial, &["no sphere above 0.205", "50 mm is 0.05"]);
    let loose = rock("cluster.spheres = 27\ncluster.largest_error = 20.0");
    warned(&loose, &["rock.0.cluster.largest_error: ", "largest_error of 20 m", "20 mm is 0.02"]);
    let gravel = |radius: &str, size: &str| {
        let text = format!("{HEAD}[[spheres]]\ncount = 30\nradius = {radius}\ndensity = 2500.0\n[box]\n");
        format!("{text}lowest = [0.0, 0.0, 0.0]\nhighest = {size}\n{CONTACT}")
    };
    let said_of = |text: &str| {
        let scene = Scene::from_text("test.toml", text).expect("a scene");
        let settings = dem_solver::settings::Settings::of_spheres(&scene).map_err(|e| e.to_string())?;
        dem_solver::gate::of_spheres(&settings, &scene).map_err(|e| e.to_string())
    };
    assert_eq!(said_of(&gravel("[0.009, 0.011]", "[0.2, 0.2, 0.2]")), Ok(vec![]));
    let wide = said_of(&gravel("[0.009, 0.011]", "[200, 200, 200]")).expect("a warning");
    assert!(wide.len() == 1 && wide[0].to_string().starts_with("box: 200 m x 200 m x 200 m"), "{wide:?}");
    let large = said_of(&gravel("[9.0, 11.0]", "[0.2, 0.2, 0.2]")).expect_err("too large");
    assert!(large.starts_with("test.toml:5:10: ") && large.contains("9 mm is 0.009"), "{large}");
}

/// A default that does not fill the box evenly takes as many as do; who asks for a number hears what came of it.
#[test]
fn who_asks_for_no_number_of_spheres_hears_nothing_of_it() {
    let rock = |cluster: &str| {
        format!(
            "{HEAD}[[rock]]\nposition = [0.0, 0.0, 1.0]\ndensity = 2600.0\nshape = {{ type = \"box\", size = [0.5, 0.4, 0.3] \
             }}\n{cluster}"
        )
    };
    assert_eq!(said(&rock("")), Ok(vec![]));
    warned(&rock("cluster.spheres = 64\n"), &["64 spheres do not fill the box evenly; took 5 x 4 x 3 = 60"]);
    assert_eq!(said(&rock("cluster.spheres = 60\n")), Ok(vec![]));
}
