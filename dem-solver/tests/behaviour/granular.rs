//! Many separate spheres: exact collisions, balances, equal bytes, refusals.

use dem_solver::granular::GranularSolver;
use dem_solver::granular::check::check;
use dem_solver::granular::state::GranularState;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::{Plan, Solver, Window};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

struct Spheres {
    solver: GranularSolver,
    output: Vec<f64>,
    windows: u64,
    time: f64,
}

fn build(text: &str) -> Result<GranularSolver, String> {
    let scene = Scene::from_text("test.toml", text).map_err(|e| e.to_string())?;
    GranularSolver::new(&scene, &Options { out: None, shortcuts: true }).map_err(|e| e.to_string())
}

impl Spheres {
    fn new(text: &str) -> Self {
        let mut solver = build(text).unwrap_or_else(|e| panic!("{e}"));
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        Self { solver, output: ready.initial, windows: 0, time: 0.0 }
    }

    fn solve(&mut self, length: f64) {
        let window = Window { number: self.windows + 1, iteration: 1, start: self.time, length };
        self.solver.solve(&window, &[], &mut self.output).unwrap_or_else(|f| panic!("{f}"));
    }

    fn advance(&mut self, length: f64) {
        self.solve(length);
        self.solver.commit().expect("committed");
        self.windows += 1;
        self.time += length;
    }

    fn step(&self) -> f64 {
        self.solver.model().steps.step
    }

    /// Kinetic, potential, stored, dissipated.
    fn energies(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|i| self.output[3 * i])
    }

    fn energy(&self) -> f64 {
        self.energies().iter().sum()
    }

    fn state(&self) -> &GranularState {
        self.solver.state()
    }

    fn momentum(&self) -> Vector3<f64> {
        let pairs = self.state().velocity.iter().zip(&self.solver.model().mass);
        pairs.map(|(v, m)| v * *m).sum()
    }
}

fn settling(count: usize, more: &str, dem: &str) -> String {
    format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[spheres]]\ncount = {count}\nradius = [0.008, 0.012]\ndensity = 2500.0\n\
         velocity_scatter = 0.3\n[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [0.2, 0.2, 0.4]\n\
         [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e7\npoisson = 0.3\n{more}\n[dem]\n{dem}\n"
    )
}

const ROUGH: &str =
    "restitution = 0.5\nfriction = 0.4\nrolling_friction = 0.05\nrolling = \"spring\"\nrolling_damping = 0.3";

/// Two spheres that meet off the line of their centres exchange linear for angular momentum; the sum of
/// both about any point stays: to rounding of some hundred steps.
#[test]
fn an_oblique_collision_keeps_momentum_and_angular_momentum() {
    let ball = |x: f64, v: f64, y: f64| {
        let (low, high) = ([x - 0.1, y - 0.1, -0.1], [x + 0.1, y + 0.1, 0.1]);
        format!(
            "[[spheres]]\ncount = 1\nradius = [0.1, 0.1]\ndensity = 2500.0\nlowest = {low:?}\nhighest = {high:?}\n\
             velocity = [{v:?}, 0.0, 0.0]\n"
        )
    };
    let text = format!(
        "end_time = 1.0\n{}{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.3\n{ROUGH}\n",
        ball(-0.11, 2.0, 0.0),
        ball(0.11, -1.0, 0.07)
    );
    let mut it = Spheres::new(&text);
    let angular = |it: &Spheres| -> Vector3<f64> {
        let (s, model) = (it.state(), it.solver.model());
        (0..2)
            .map(|i| s.position[i].cross(&s.velocity[i]) * model.mass[i] + s.spin[i] * model.inertia[i])
            .sum()
    };
    let (p, l) = (it.momentum(), angular(&it));
    for _ in 0..40 {
        it.advance(1e-3);
    }
    assert!(it.state().spin[0].norm() > 0.1 && it.state().contacts == 0, "they have met and parted");
    assert!((it.momentum() - p).norm() < 1e-13 * p.norm());
    // The force acts at one point for both, in the middle of the step, where the arms are taken.
    assert!((angular(&it) - l).norm() < 1e-12 * l.norm(), "{} {l}", angular(&it));
}

/// The surfaces take momentum; energy goes nowhere but into what is booked. Second order of the step, and
/// the jump of the dashpots at touch: 1e-3 of the energy put in at 50 steps per contact.
#[test]
fn a_settling_box_loses_the_energy_that_it_books() {
    let mut it = Spheres::new(&settling(500, ROUGH, ""));
    let start = it.energy();
    let lost = |it: &Spheres| it.energies()[3];
    let mut worst = 0.0_f64;
    let mut before = 0.0;
    for _ in 0..40 {
        it.advance(5e-3);
        worst = worst.max((it.energy() - start).abs());
        assert!(lost(&it) >= before, "dissipation grows");
        before = lost(&it);
    }
    assert!(lost(&it) > 0.5, "{:?}", it.energies());
    assert!(worst < 1e-3 * lost(&it), "{worst} J of {} J", lost(&it));
    assert!(it.state().contacts > 500, "{} contacts", it.state().contacts);
}

#[test]
fn the_bytes_do_not_depend_on_windows_or_what_was_solved_before() {
    let run = |dem: &str, steps: u64, repeat: bool| {
        let mut it = Spheres::new(&settling(700, ROUGH, dem));
        let h = 2.0_f64.powi(-15);
        for window in 0..4096 / steps {
            if repeat {
                it.solve(h * steps as f64 * if window % 2 == 0 { 3.0 } else { 0.5 });
            }
            it.advance(h * steps as f64);
        }
        it
    };
    let step = "time_step = 0.000030517578125\n";
    let reference = run(step, 128, false);
    assert!(reference.state().histories.len() > 200, "{}", reference.state().histories.len());
    assert!(run(step, 32, false).state() == reference.state(), "shorter windows");
    assert!(run(step, 128, true).state() == reference.state(), "other windows solved before");
}

/// Two smooth spheres in a smooth box, 1e6 steps. Every touch starts and ends within a step and errs by
/// order h^2.5, with either sign: the energy walks at random and does not drift. 4 000 impacts of
/// 3e-6 each at 50 steps per contact would add up to 1e-2 if they had one sign; a walk stays below 1e-3.
#[test]
fn in_a_frictionless_box_the_energy_does_not_drift() {
    let text = "end_time = 1.0\n[[spheres]]\ncount = 2\nradius = [0.1, 0.1]\ndensity = 2500.0\nvelocity_scatter = 1.0\n\
                [box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [0.5, 0.6, 0.7]\n\
                [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.3\nrestitution = 1.0\n";
    let mut it = Spheres::new(text);
    let start = it.energy();
    let length = it.step() * 1e4;
    let mut worst = 0.0_f64;
    for _ in 0..100 {
        it.advance(length);
        worst = worst.max((it.energy() / start - 1.0).abs());
    }
    assert!(worst < 1e-3, "{worst:.2e}");
    assert_eq!(it.energies()[3], 0.0);
}

/// Lengths times s, times times sqrt(s), stresses times s: nothing else may change, but for rounding,
/// which collisions amplify by some powers of ten each.
#[test]
fn a_box_of_another_size_gives_the_same_answer() {
    let run = |s: f64| {
        let text = format!(
            "end_time = {:?}\ngravity = [0.0, 0.0, -9.81]\n[[spheres]]\ncount = 60\nradius = [{:?}, {:?}]\ndensity = 2500.0\n\
             velocity_scatter = {:?}\n[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [{:?}, {:?}, {:?}]\n\
             [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = {:?}\npoisson = 0.3\nrestitution = 0.5\nfriction = 0.4\n\
             friction_dynamic = 0.3\nfriction_decay = {:?}\nrolling_friction = 0.05\n",
            s.sqrt(),
            0.04 * s,
            0.05 * s,
            0.3 * s.sqrt(),
            0.5 * s,
            0.5 * s,
            1.0 * s,
            1e7 * s,
            5.0 / s.sqrt()
        );
        let mut it = Spheres::new(&text);
        for _ in 0..20 {
            it.advance(5e-3 * s.sqrt());
        }
        assert!(it.state().contacts > 0);
        let places: Vec<f64> = it.state().position.iter().flat_map(|x| [x.x / s, x.y / s, x.z / s]).collect();
        (places, it.step() / s.sqrt())
    };
    let (places, step) = run(1.0);
    for s in [0.1, 10.0] {
        let (scaled, other) = run(s);
        assert!((other / step - 1.0).abs() < 1e-12, "{other} {step}");
        for (a, b) in places.iter().zip(&scaled) {
            assert!((a - b).abs() < 1e-9, "{a} {b} at {s}");
        }
    }
}

#[test]
fn what_makes_no_sense_of_spheres_is_refused_with_its_place() {
    let text = settling(100, "restitution = 0.5", "");
    let cases = [
        (text.replace("count = 100", "count = 100000"), "the region has room for"),
        (text.replace("count = 100", "count = 0"), "1 to 10000000"),
        (text.replace("[0.008, 0.012]", "[0.012, 0.008]"), "the smaller first"),
        (text.replace("[0.008, 0.012]", "[0.008, 0.15]"), "m wide, a sphere"),
        (text.replace("density = 2500.0", "density = -1.0"), "above 0"),
        (
            text.replace("density = 2500.0", "density = 2.5"),
            "were it in g/cm3 or t/m3, it would be 2500 kg/m3",
        ),
        (text.replace("density = 2500.0", "density = 2.5e6"), "were it in g/m3, it would be 2500 kg/m3"),
        (text.replace("[box]", "[box]\nopen = [\"top\"]"), "no side `top`"),
        (text.replace("0.2, 0.4]", "0.2, -0.4]"), "the box reaches from"),
        (
            text.replace("[[contact]]", "[[contact]]\nbetween = [\"rock\", \"sand\"]"),
            "nothing is of the material `sand`",
        ),
        (
            text.replace("[[contact]]", "[[contact]]\nbetween = [\"rock\", \"rock\"]"),
            "no table [[contact]] is for `rock` and `wall`",
        ),
        (format!("{text}time_step = 0.01\n"), "above the critical step"),
        (text[..text.find("[[contact]]").expect("there")].to_owned(), "no contact law"),
        (
            text.replace("[box]", "[[spheres]]\ncount = 50\nradius = [0.01, 0.01]\ndensity = 2500.0\n[box]"),
            "pairs overlap at the start",
        ),
        (
            text.replace("[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [0.2, 0.2, 0.4]\n", ""),
            "there is no [box]",
        ),
    ];
    for (text, expected) in cases {
        let message = build(&text).err().unwrap_or_else(|| panic!("not refused: {text}"));
        assert!(message.contains(expected), "{expected:?} is not in:\n{message}\n{text}");
        assert!(message.starts_with("test.toml"), "{message}");
    }
}

#[test]
fn the_resolved_scene_of_spheres_reads_back_to_the_same_check() {
    let first =
        check(&Scene::from_text("a.toml", &settling(100, ROUGH, "")).expect("a scene")).expect("checked");
    let again = format!("end_time = 1.0\n{}", first.resolved);
    let second = check(&Scene::from_text("a.toml", &again).expect("a scene")).expect("checked");
    assert_eq!(first, second);
    assert_eq!(first.numbers["spheres"], 100.0);
}

/// Spheres where a file has them, at the velocity of the table; masses by hand.
#[test]
fn spheres_of_a_file_start_where_it_has_them() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("s.xyzr");
    let listed = [[0.05, 0.05, 0.05, 0.01], [0.1, 0.1, 0.2, 0.02], [0.15, 0.05, 0.3, 0.012]];
    let line = |s: &[f64; 4]| format!("{:?} {:?}, {:?}\t{:?}\n", s[0], s[1], s[2], s[3]);
    let lines: String = listed.iter().map(line).collect();
    std::fs::write(&file, format!("# x y z r\n{lines}")).expect("written");
    let scene = |file: &str| {
        settling(3, "restitution = 0.5", "")
            .replace(
                "count = 3\nradius = [0.008, 0.012]",
                &format!("file = {file:?}\nvelocity = [1.0, 0.0, 0.0]"),
            )
            .replace("velocity_scatter = 0.3", "")
    };
    let text = scene(&file.display().to_string());
    let solver = build(&text).unwrap_or_else(|e| panic!("{e}"));
    for (k, [x, y, z, r]) in listed.into_iter().enumerate() {
        assert_eq!(solver.state().position[k], Vector3::new(x, y, z));
        assert_eq!(solver.state().velocity[k], Vector3::x());
        let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * r * r * r;
        assert!((solver.model().mass[k] / mass - 1.0).abs() < 1e-14 && solver.model().radius[k] == r);
    }
    let checked = |text: &str| check(&Scene::from_text("a.toml", text).expect("a scene")).expect("checked");
    let first = checked(&text);
    assert_eq!(first.numbers["spheres"], 3.0);
    assert!(first.builds[0].contains("3 spheres of 0.01 to 0.02 m radius"), "{:?}", first.builds);
    assert_eq!(
        checked(&format!("end_time = 1.0\n{}", first.resolved)),
        first,
        "the resolved scene reads back"
    );
    // Spheres of a packing at rest overlap a little: said, and computed.
    let write = |text: &str| std::fs::write(&file, text).expect("written");
    write("0.05 0.05 0.05 0.01\n0.0698 0.05 0.05 0.01\n");
    let mut solver = build(&text).unwrap_or_else(|e| panic!("{e}"));
    let said = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}")).warnings;
    assert!(
        said.iter().any(|w| w.message.contains("1 pair overlaps at the start, the deepest by 2.00 %")),
        "{said:?}"
    );
    for (content, expected) in [
        ("0.05 0.05 0.05 0.01\n0.068 0.05 0.05 0.01\n", "the deepest by 20.00 % of the smaller radius"),
        ("", "the file has no spheres"),
        ("0.05 0.05 0.05 0.01\n0.1 0.1 0.1\n", "s.xyzr:2: a number is missing"),
        ("0.05 0.05 0.05 0.01\n0.1 0.1 0.1 -0.01\n", "s.xyzr:2: a radius of -0.01 m: it must lie above 0"),
        ("0.05 0.05 0.05 0.01\n0.1 x 0.1 0.01\n", "s.xyzr:2: `x` is not a number"),
        ("0.05 0.05 0.05 0.01 7\n", "s.xyzr:1: `7` after x y z r"),
        ("0.05 0.05 0.05 0.01\n0.05 0.05 0.05 0.01\n", "the same sphere as in line 1"),
        ("50 50 50 10\n", "beyond the side `+x` of the box"),
        (
            "0.05 0.05 0.05 0.01\n0.1 0.1 0.005 0.01\n",
            "sphere 2 of 2 (0.1 0.1 0.005, radius 0.01 m) reaches 5.000e-3 m",
        ),
    ] {
        write(content);
        let message = build(&text).err().unwrap_or_else(|| panic!("not refused: {content}"));
        assert!(message.contains(expected) && message.starts_with("test.toml"), "{expected:?}: {message}");
        // As `rockfall check` says it.
        let checked = check(&Scene::from_text("test.toml", &text).expect("a scene")).expect_err("refused");
        assert_eq!(checked.to_string(), message);
    }
    let missing = build(&scene("nowhere.xyzr")).err().expect("no such file");
    assert!(
        missing.starts_with("test.toml:4:8") && missing.contains("nowhere.xyzr: there is no such file"),
        "{missing}"
    );
    for (key, value) in [("count", "3"), ("radius", "[0.1, 0.1]"), ("lowest", "[0, 0, 0]")] {
        let both = text.replace("[box]", &format!("{key} = {value}\n[box]"));
        let message = build(&both).err().expect("both");
        assert!(message.contains(&format!("keep one of `file` and `{key}`")), "{message}");
    }
    let neither = settling(3, "restitution = 0.5", "").replace("count = 3", "");
    let message = build(&neither).err().expect("no count");
    assert!(message.contains("has no `count`") && message.contains("add count = 1000, or"), "{message}");
}

#[test]
fn spheres_of_another_density_than_rock_are_named_by_check_and_run() {
    let said = |density: &str| {
        let text = settling(10, "restitution = 0.5", "").replace("2500.0", density);
        let warnings = check(&Scene::from_text("a.toml", &text).expect("a scene")).expect("checked").warnings;
        let mut solver = build(&text).unwrap_or_else(|e| panic!("{e}"));
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        let found = |warnings: &[Diagnostic]| {
            let of_density = warnings.iter().filter(|w| w.key.as_deref() == Some("spheres.0.density"));
            of_density.map(|w| w.message.clone()).collect()
        };
        let [checked, run]: [Vec<String>; 2] = [found(&warnings), found(&ready.warnings)];
        assert_eq!(checked, run);
        run
    };
    assert_eq!(said("2500.0"), [""; 0]);
    let steel = said("7850.0");
    assert!(steel.len() == 1 && steel[0].contains("spheres `spheres`: 7850 kg/m3 is very much"), "{steel:?}");
}
