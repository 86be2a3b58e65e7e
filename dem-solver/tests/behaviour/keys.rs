//! Every key of `[[contact]]` with every partner: it changes what is computed, or it is refused by name.

use crate::bench::{Setup, net};
use dem_solver::DemSolver;
use dem_solver::check::check;
use dem_solver::granular::GranularSolver;
use dem_solver::law::normal::LawName;
use interface_defs::{Plan, Solver, Window};
use toolkit::program::Options;
use toolkit::scene::Scene;

/// What a rock or a sphere touches.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Touched {
    Net,
    Terrain,
    OtherRock,
    OtherSphere,
    Box,
    /// A rock in a box.
    BoxOfRock,
    /// Separate spheres and a rock on terrain.
    Mixed,
}

use Touched::{Box, BoxOfRock, Mixed, Net, OtherRock, OtherSphere, Terrain};

const ALL: [Touched; 7] = [Net, Terrain, OtherRock, OtherSphere, Box, BoxOfRock, Mixed];

/// A law with every part that a key may belong to.
const LAW: &str = "law = \"hertz_mindlin\"\nyoung = 1e7\npoisson = 0.2\nrestitution = 0.6\nfriction = 0.3\n\
                   friction_dynamic = 0.2\nrolling_friction = 0.1\nrolling = \"spring\"\nrolling_damping = 0.2\n";

/// For each key the lines of [`LAW`] that give way to it, what stands there instead, and where it is refused.
const KEYS: [(&str, &str, &str, &[Touched]); 22] = [
    ("law", "law = \"hertz_mindlin\"", "law = \"linear\"", &[]),
    ("young", "young = 1e7", "young = 2e7", &[]),
    ("poisson", "poisson = 0.2", "poisson = 0.4", &[]),
    ("partner_young", "", "partner_young = 3e7\npartner_poisson = 0.3", &[]),
    ("stiffness", "law = \"hertz_mindlin\"\nyoung = 1e7", "law = \"linear\"\nstiffness = 1e5", &[]),
    ("restitution", "restitution = 0.6", "restitution = 0.3", &[]),
    ("damping_ratio", "restitution = 0.6", "damping_ratio = 0.7", &[]),
    ("friction", "friction = 0.3\nfriction_dynamic = 0.2", "friction = 0.05", &[]),
    ("friction_dynamic", "friction_dynamic = 0.2", "friction_dynamic = 0.1", &[]),
    ("friction_decay", "", "friction_decay = 0.5", &[]),
    ("tangential", "", "tangential = \"secant\"", &[]),
    ("stiffness_ratio", "", "stiffness_ratio = 0.3", &[]),
    ("rolling_friction", "rolling_friction = 0.1", "rolling_friction = 0.02", &[]),
    ("rolling", "rolling = \"spring\"\nrolling_damping = 0.2", "rolling = \"constant\"", &[]),
    ("rolling_damping", "rolling_damping = 0.2", "rolling_damping = 0.0", &[]),
    (
        "rolling_friction_impact",
        "",
        "rolling_friction_impact = 0.3",
        &[Net, OtherRock, OtherSphere, Box, BoxOfRock],
    ),
    ("effective_mass", "", "effective_mass = \"rock\"", &[OtherSphere, Box]),
    (
        "friction_max",
        "friction_dynamic = 0.2",
        "friction_max = 2.0\nfriction_growth = 50.0\nfriction_relaxation = 100.0",
        &[Net, OtherRock, OtherSphere, Box, BoxOfRock],
    ),
    ("preset", "", "preset = \"meadow\"", &ALL),
    ("friction_growth", "", "friction_growth = 3.0", &ALL),
    ("scarring_drag", "", "scarring_drag = 2.0", &ALL),
    ("between", "law = \"hertz", "between = [\"rock\", \"nothing\"]\nlaw = \"hertz", &ALL),
];

/// A scene in which `touched` is hit obliquely, under `law`.
fn scene(touched: Touched, law: &str) -> String {
    let head = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n";
    let cube = |name: &str, at: &str, more: &str| {
        format!(
            "[[rock]]\nname = \"{name}\"\nmass = 20.0\nposition = {at}\n{more}\n\
             shape = {{ type = \"box\", size = [0.3, 0.3, 0.3] }}\ncluster.spheres = 8\n"
        )
    };
    let falls = cube(
        "rock",
        "[0.02, 0.01, 0.151]",
        "velocity = [1.5, 0.4, -2.0]\nangular_velocity = [1.0, 2.0, 3.0]",
    );
    let dem = "[dem]\ntime_step = 2e-5\n";
    let spheres = |more: &str| {
        format!(
            "[[spheres]]\ncount = 40\nradius = [0.04, 0.05]\ndensity = 2500.0\nvelocity = [1.0, 0.5, -2.0]\n\
             velocity_scatter = 5.0\n{more}\n[[contact]]\n{law}{dem}"
        )
    };
    match touched {
        Net => format!("{head}{falls}[[contact]]\n{law}{dem}"),
        Terrain => format!("{head}{falls}[terrain]\nfile = \"t.obj\"\n[[contact]]\n{law}{dem}"),
        OtherRock => {
            let other = cube("other", "[0.05, 0.03, -0.16]", "velocity = [0.0, 0.0, 0.0]");
            format!("{head}{falls}{other}[[contact]]\n{law}{dem}")
        }
        OtherSphere => format!("{head}{}", spheres("lowest = [0.0, 0.0, 0.0]\nhighest = [0.45, 0.45, 0.45]")),
        Box => {
            let walls = "[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [0.5, 0.5, 0.5]";
            format!("{head}{}", spheres(walls))
        }
        BoxOfRock => {
            let sides = "[box]\nlowest = [-0.4, -0.4, -0.01]\nhighest = [0.4, 0.4, 0.5]\n";
            format!("{head}{falls}{sides}[[contact]]\n{law}{dem}")
        }
        Mixed => {
            let region =
                "lowest = [-0.2, -0.2, 0.35]\nhighest = [0.2, 0.2, 1.0]\n[terrain]\nfile = \"t.obj\"\n";
            format!("{head}{falls}{}", spheres(region))
        }
    }
}

/// Positions after 30 ms, or the message that refuses the scene.
fn outcome(touched: Touched, law: &str) -> Result<Vec<f64>, String> {
    let dir = tempfile::tempdir().expect("a directory");
    let obj = "v 0 0 -0.02\nv -0.4 -0.4 0\nv 0.4 -0.4 0\nv 0.4 0.4 0\nv -0.4 0.4 0\nf 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\n";
    std::fs::write(dir.path().join("t.obj"), obj).expect("written");
    let path = dir.path().join("s.toml").display().to_string();
    let text = scene(touched, law);
    let parsed = Scene::from_text(&path, &text).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    if matches!(touched, OtherSphere | Box) {
        let mut solver = GranularSolver::new(&parsed, &options).map_err(|e| e.to_string())?;
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).expect("prepared");
        let mut output = ready.initial;
        let window = Window { number: 1, iteration: 1, start: 0.0, length: 0.03 };
        solver.solve(&window, &[], &mut output).unwrap_or_else(|e| panic!("{touched:?} {law}: {e}"));
        solver.commit().expect("committed");
        return Ok(solver.state().position.iter().flat_map(|p| [p.x, p.y, p.z]).collect());
    }
    let mut solver = DemSolver::new(&parsed, &options).map_err(|e| e.to_string())?;
    if touched == Net {
        // Kinks and crossings within reach of the spheres.
        let mut mesh = net(6, 0.07, 0.004);
        mesh.coordinates
            .chunks_exact_mut(3)
            .enumerate()
            .for_each(|(node, c)| c[2] = -0.01 * (node % 3) as f64);
        let mut bench = Setup::new(text, mesh).build();
        (0..30).for_each(|_| bench.advance(1e-3));
        return Ok(bench.position().iter().copied().collect());
    }
    let plan = Plan { end_time: 1.0, window: 1e-3, ..Plan::default() };
    let mut output = solver.prepare(&plan, &mut |_| Ok(())).map_err(|fault| fault.to_string())?.initial;
    let window = Window { number: 1, iteration: 1, start: 0.0, length: 0.03 };
    solver.solve(&window, &[], &mut output).unwrap_or_else(|e| panic!("{touched:?} {law}: {e}"));
    solver.commit().expect("committed");
    Ok(solver
        .state()
        .bodies
        .iter()
        .flat_map(|b| b.motion.position.iter().copied().collect::<Vec<_>>())
        .collect())
}

#[test]
fn every_key_of_a_contact_works_with_every_partner_or_is_refused_by_name() {
    let mut wrong = Vec::new();
    for touched in ALL {
        let plain = outcome(touched, LAW).unwrap_or_else(|e| panic!("{touched:?}: {e}"));
        for (key, old, new, refused) in KEYS {
            let law = if old.is_empty() { format!("{LAW}{new}\n") } else { LAW.replace(old, new) };
            assert_ne!(law, LAW, "{key}");
            match outcome(touched, &law) {
                Ok(other) if refused.contains(&touched) => {
                    wrong.push(format!("{key} with {touched:?}: taken, {other:?}"))
                }
                // Surfaces resist the rock by one law: the kind is of contacts between rocks and of heaps.
                Ok(_) if key == "rolling" && matches!(touched, Net | Terrain | BoxOfRock) => {}
                Ok(other) if other == plain => wrong.push(format!("{key} with {touched:?}: ignored")),
                Ok(_) => {}
                Err(why) if !refused.contains(&touched) => {
                    wrong.push(format!("{key} with {touched:?}: {why}"))
                }
                Err(why) if !why.contains(key) && !why.contains("nothing") => {
                    wrong.push(format!("{key} with {touched:?} is not named: {why}"));
                }
                Err(_) => {}
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A key that stands for the partner's side alone in a scene is refused where nothing has that side.
#[test]
fn tables_of_the_other_engine_are_refused_by_both_names() {
    let refused = |text: &str| {
        let scene = Scene::from_text("test.toml", text).expect("a scene");
        let options = Options::default();
        let spheres = text.contains("[[spheres]]");
        let rocks = || DemSolver::new(&scene, &options).err().map(|e| e.to_string());
        let balls = || GranularSolver::new(&scene, &options).err().map(|e| e.to_string());
        (if spheres { balls() } else { rocks() }).unwrap_or_else(|| panic!("not refused: {text}"))
    };
    let rocks = scene(OtherRock, LAW);
    let balls = scene(Box, LAW);
    for (text, names) in [
        (format!("{balls}rotation = \"exact\"\n"), ["`rotation`", "[[spheres]]"]),
        (format!("{balls}contact_selection = \"nearest\"\n"), ["`contact_selection`", "[[spheres]]"]),
    ] {
        let message = refused(&text);
        assert!(names.iter().all(|name| message.contains(name)), "{names:?} are not in {message}");
        assert!(message.starts_with("test.toml:"), "{message}");
    }
    let alone =
        Scene::from_text("test.toml", &format!("{rocks}contact_selection = \"nearest\"\n")).expect("a scene");
    let message = check(&alone).expect_err("refused").to_string();
    assert!(message.contains("contact_selection") && message.contains("terrain"), "{message}");
}

/// A law that is added to the registry is tried here with every partner.
#[test]
fn every_law_works_with_every_partner_or_is_refused_by_name() {
    let usual = "law = \"hertz_mindlin\"\nyoung = 1e7";
    for touched in ALL {
        let hertz = outcome(touched, LAW).expect("works");
        for law in LawName::ALL {
            let name = law.name();
            let own = law.own_keys().into_iter().map(|key| format!("{key} = 1e6\n"));
            let with = |more: &str| LAW.replace(usual, &format!("law = \"{name}\"\n{more}"));
            // With a modulus, else with one of its own keys; the last refusal counts.
            let tried = ["young = 1e7\n".to_owned()].into_iter().chain(own).map(|more| {
                let without = with(&more).replace("poisson = 0.2\n", "stiffness_ratio = 0.8\n");
                outcome(touched, &with(&more)).or_else(|_| outcome(touched, &without))
            });
            let moved = tried.reduce(|best, next| best.or(next)).expect("one at least");
            match moved {
                Ok(moved) => {
                    let same = matches!(law, LawName::HertzMindlin)
                        || *law == LawName::HertzRock && matches!(touched, OtherSphere | Box);
                    assert_eq!(moved == hertz, same, "{name} with {touched:?}");
                }
                Err(refused) => assert!(
                    matches!(law, LawName::HertzRock | LawName::Ground)
                        && refused.contains(&format!("`{name}`")),
                    "{name} with {touched:?}: {refused}"
                ),
            }
        }
    }
}
