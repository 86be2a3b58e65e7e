//! Cost of trajectories, and of a contact step, over generated slopes. One thread; processor time.
//!
//! `cargo run --release -p dem-solver --example trajectories [SECONDS PER FIGURE [one | thousand | step-10 | step-27 | fixed-10 | ... | flat-27 | equal [STEPS PER CONTACT]]]`
//!
//! Targets: 20 trajectories per second and core with a rock of 1 000 spheres, 500 with one sphere, on a slope
//! of a million triangles; a contact step of a cluster of 1 000 and of 19 683 spheres over 100 352 triangles in
//! 4.4 and 10.2 microseconds (5 000 times less than the 22 and 51 ms of the reference implementation).

use dem_solver::DemSolver;
use dem_solver::random::SplitMix;
use dem_solver::rock::Motion;
use dem_solver::terrain::raster::Raster;
use interface_defs::ipc::serve::cpu_seconds;
use interface_defs::verdict::Fate;
use interface_defs::{Plan, Solver, Window};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::path::Path;
use toolkit::program::Options;
use toolkit::scene::Scene;

#[path = "../tests/support/slope.rs"]
mod slope;
use slope::Slope;

const INTERVAL: f64 = 0.1;
const END: f64 = 120.0;
/// Of the plane on which a cluster slides: height over length.
const FALL: f64 = 0.5;

/// What one sphere meets: a ball rolls on for ever where nothing resists it.
const SOFT: &str = "young = 1e8\nrolling_friction = 0.5\nrolling = \"spring\"\nrolling_damping = 0.3";

/// A rock of some 0.5 m3 and 1 300 kg; what it meets is firm soil.
fn scene(terrain: &str, shape: &str, contact: &str, steps: f64) -> String {
    format!(
        "end_time = {END:?}\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [40.0, 100.0, 210.0]\ndensity = 2600.0\n{shape}\n\
         [terrain]\nfile = \"{terrain}\"\n[[contact]]\nlaw = \"hertz_mindlin\"\npoisson = 0.25\n\
         restitution = 0.35\nfriction = 0.6\n{contact}\n[dem]\nsteps_per_contact = {steps:?}\n[output]\ninterval = {INTERVAL:?}\n"
    )
}

struct Runner {
    solver: DemSolver,
    output: Vec<f64>,
    time: f64,
    windows: u64,
}

impl Runner {
    fn new(dir: &Path, text: &str) -> Self {
        Self::with(dir, text, true)
    }

    fn with(dir: &Path, text: &str, shortcuts: bool) -> Self {
        let scene = Scene::from_text(&dir.join("s.toml").display().to_string(), text).expect("a scene");
        let mut solver =
            DemSolver::new(&scene, &Options { out: None, shortcuts }).unwrap_or_else(|e| panic!("{e}"));
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        Self { output: ready.initial, solver, time: 0.0, windows: 0 }
    }

    fn advance(&mut self, length: f64) {
        self.windows += 1;
        let window = Window { number: self.windows, iteration: 1, start: self.time, length };
        self.solver.solve(&window, &[], &mut self.output).unwrap_or_else(|e| panic!("{e}"));
        self.solver.commit().expect("committed");
        self.time += length;
    }

    fn release(&mut self, height: f64, y: f64, turn: [f64; 4]) {
        let model = self.solver.model();
        let ground = model.ground.as_ref().expect("a terrain");
        let at = Vector3::new(8.0, y, 0.0);
        let above = Vector3::new(at.x, at.y, ground.highest.z + ground.origin.z + 1.0) - ground.origin;
        let z = above.z - ground.height(&above, &-Vector3::z()).expect("on the slope") + ground.origin.z;
        let [a, b, c, d] = turn;
        let motion = Motion {
            position: Vector3::new(at.x, at.y, z + height),
            velocity: Vector3::new(4.0, 0.0, -2.0),
            orientation: UnitQuaternion::from_quaternion(Quaternion::new(a, b, c, d)),
            angular_momentum: Vector3::zeros(),
            acceleration: model.settings.gravity,
            torque: Vector3::zeros(),
        };
        self.solver.release(0, motion);
        (self.time, self.windows) = (0.0, 0);
    }
}

/// Release number `k`: place along the top, orientation.
fn start(k: usize) -> (f64, [f64; 4]) {
    let part = |f: f64| (k as f64 * f).fract();
    (
        20.0 + 160.0 * part(0.618_034),
        [1.0, part(0.414_214) - 0.5, part(0.732_051) - 0.5, part(0.236_068) - 0.5],
    )
}

fn trajectories(dir: &Path, name: &str, shape: &str, contact: &str, steps: f64, target: f64, seconds: f64) {
    let mut runner = Runner::new(dir, &scene("million.asc", shape, contact, steps));
    let (mut most, mut rested, mut impacts, mut simulated, mut touching) = (0, 0, 0, 0.0, 0.0);
    let mut ends = Vec::new();
    let before = runner.solver.finish().expect("counts").counts;
    let clock = cpu_seconds();
    while (cpu_seconds() - clock) < seconds || ends.len() < 3 {
        let (y, turn) = start(ends.len());
        runner.release(1.5, y, turn);
        while runner.time < END - 1e-9 && !runner.solver.has_ended() {
            runner.advance(INTERVAL);
        }
        let body = &runner.solver.state().bodies[0];
        rested += usize::from(body.path.ending.is_some_and(|end| end.how == Fate::AtRest));
        most = most.max(body.path.impacts);
        impacts += body.path.impacts;
        touching += body.path.in_contact;
        simulated += runner.time;
        ends.push(body.motion.position);
    }
    let contact_mesh = cpu_seconds() - clock;
    let count = ends.len() as f64;
    let after = runner.solver.finish().expect("counts").counts;
    let of = |name: &str| {
        let find = |counts: &[(String, u64)]| counts.iter().find(|(n, _)| n == name).map_or(0, |(_, c)| *c);
        (find(&after) - find(&before)) as f64
    };
    let (step, critical) = (runner.solver.model().steps.step, runner.solver.model().steps.critical);
    println!(
        "{name}, {steps} steps per contact: {:.1} trajectories/s (target {target}); {} runs, {rested} at rest, {:.1} impacts on average, {most} at \
         most, {:.1} s each, {:.2} of it in contact",
        count / contact_mesh,
        ends.len(),
        impacts as f64 / count,
        simulated / count,
        touching / simulated
    );
    println!(
        "    step {step:.2e} s (critical {critical:.2e}), {:.0} contact steps of {:.0} ns, {:.1} touching pairs each, \
         {:.0} steps flown",
        of("sub_steps") / count,
        1e9 * contact_mesh / of("sub_steps"),
        of("contact_evaluations") / of("sub_steps"),
        of("flight_steps") / count
    );
    drop(runner);
    finer(dir, shape, contact, steps, &ends);
}

/// End points against those with four times finer steps.
fn finer(dir: &Path, shape: &str, contact: &str, steps: f64, ends: &[Vector3<f64>]) {
    let mut runner = Runner::new(dir, &scene("million.asc", shape, contact, 4.0 * steps));
    let count = ends.len().min(12);
    let mut apart = Vec::new();
    for (k, end) in ends.iter().take(count).enumerate() {
        let (y, turn) = start(k);
        runner.release(1.5, y, turn);
        while runner.time < END - 1e-9 && !runner.solver.has_ended() {
            runner.advance(INTERVAL);
        }
        apart.push((runner.solver.state().bodies[0].motion.position - end).norm());
    }
    apart.sort_by(f64::total_cmp);
    println!(
        "    end point against 4 times finer steps, {count} runs: median {:.2} m, largest {:.2} m",
        apart[count / 2],
        apart[count - 1]
    );
}

/// How a contact step is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Tumbling, steps as the contact asks for.
    Own,
    /// Tumbling, all steps of one length.
    Fixed,
    /// Sliding on one face down a plane, all steps of one length that is the same for all clusters: equal motion.
    Flat,
}

/// Microseconds per contact step of a cluster on the slope.
fn contact_step(dir: &Path, along: u32, target: f64, seconds: f64, way: Way) {
    let spheres = along.pow(3);
    let shape = format!("shape = {{ type = \"box\", size = [0.8, 0.8, 0.8] }}\ncluster.spheres = {spheres}");
    let mut text = scene("small.asc", &shape, "young = 1e10", 30.0);
    if way == Way::Flat {
        text = text.replace("small.asc", "flat.asc").replace("friction = 0.6", "friction = 0.2");
    }
    let mut runner = Runner::new(dir, &text);
    if way != Way::Own {
        let step = if way == Way::Flat { 1e-5 } else { runner.solver.model().steps.step };
        text = text.replace("steps_per_contact = 30.0", &format!("time_step = {step:?}"));
        runner = Runner::new(dir, &text);
    }
    if way == Way::Flat {
        let half = 0.5 * FALL.atan();
        runner.release(0.4 / FALL.atan().cos() + 0.002, 30.0, [half.cos(), 0.0, half.sin(), 0.0]);
    } else {
        runner.release(1.0, 30.0, [1.0, 0.1, 0.3, 0.05]);
    }
    // Down to the ground first.
    while runner.solver.state().bodies[0].contacts == 0 {
        runner.advance(1e-3);
    }
    let count = |runner: &mut Runner, name: &str| {
        let counts = runner.solver.finish().expect("counts").counts;
        counts.iter().find(|(n, _)| n == name).map_or(0, |(_, c)| *c) as f64
    };
    let names = ["sub_steps", "contact_evaluations", "candidate_refreshes"];
    let before = names.map(|n| count(&mut runner, n));
    let clock = cpu_seconds();
    let mut in_steps = 0.0;
    while (cpu_seconds() - clock) < seconds && !runner.solver.has_ended() {
        let steps = count(&mut runner, "sub_steps");
        let one = cpu_seconds();
        runner.advance(1e-3);
        // Windows that flew cost nothing to speak of, and are no contact steps.
        if count(&mut runner, "sub_steps") > steps {
            in_steps += cpu_seconds() - one;
        }
    }
    let [steps, pairs, searches] = [0, 1, 2].map(|k| count(&mut runner, names[k]) - before[k]);
    let (each, touching) = (1e6 * in_steps / steps, pairs / steps);
    println!(
        "{} contact step, {spheres} spheres over {} triangles: {each:.2} us (target {target}), {touching:.1} touching pairs, a \
         search each {:.0} steps, {:.2} us beyond 100 ns per touching pair",
        format!("{way:?}").to_lowercase(),
        runner.solver.model().ground.as_ref().expect("a terrain").triangles.len(),
        steps / searches.max(1.0),
        each - 0.1 * touching
    );
}

/// Both clusters along the motions of the coarse one that tumbles, lifted so that they touch alike, in steps of one
/// length: equal work. Microseconds per contact step.
fn equal_motion(dir: &Path, seconds: f64) {
    let shape = |along: u32| {
        let spheres = along.pow(3);
        format!("shape = {{ type = \"box\", size = [0.8, 0.8, 0.8] }}\ncluster.spheres = {spheres}")
    };
    let text = |along| scene("small.asc", &shape(along), "young = 1e10", 30.0);
    let mut coarse = Runner::new(dir, &text(10));
    coarse.release(1.0, 30.0, [1.0, 0.1, 0.3, 0.05]);
    let mut motions = Vec::new();
    while motions.len() < 4000 && !coarse.solver.has_ended() {
        coarse.advance(1e-3);
        let body = &coarse.solver.state().bodies[0];
        if body.contacts > 0 {
            motions.push(body.motion);
        }
    }
    let down = Vector3::new(0.5, 0.0, -1.0).normalize();
    let depths: Vec<f64> = motions
        .iter()
        .map(|m| coarse.solver.model().rocks[0].depth(m, &down) - m.position.dot(&down))
        .collect();
    let both = [10, 27].map(|along| {
        let fixed = text(along).replace("steps_per_contact = 30.0", "time_step = 1e-5");
        // No look for a flight: a look in each of these short windows would be none of a step's work.
        let mut runner = Runner::with(dir, &fixed, false);
        let count = |runner: &mut Runner, name: &str| {
            let counts = runner.solver.finish().expect("counts").counts;
            counts.iter().find(|(n, _)| n == name).map_or(0, |(_, c)| *c) as f64
        };
        // For each window: seconds, steps, touching pairs.
        let mut sums = vec![[0.0; 3]; motions.len()];
        let clock = cpu_seconds();
        while cpu_seconds() - clock < seconds {
            for ((motion, depth), sum) in motions.iter().zip(&depths).zip(&mut sums) {
                let mut motion = *motion;
                let own = runner.solver.model().rocks[0].depth(&motion, &down) - motion.position.dot(&down);
                motion.position += down * (depth - own) + runner.solver.model().origin;
                runner.solver.release(0, motion);
                let names = ["sub_steps", "contact_evaluations"];
                let before = names.map(|n| count(&mut runner, n));
                let one = cpu_seconds();
                let window = Window { number: 1, iteration: 1, start: 0.0, length: 1e-3 };
                let solved = runner.solver.solve(&window, &[], &mut runner.output).is_ok();
                let one = cpu_seconds() - one;
                let [steps, pairs] = [0, 1].map(|k| count(&mut runner, names[k]) - before[k]);
                let gentle = solved && runner.solver.commit().is_ok() && {
                    let body = &runner.solver.state().bodies[0];
                    body.deepest.largest().is_none_or(|(depth, _)| depth < 0.2)
                };
                if gentle && pairs >= steps {
                    *sum = [sum[0] + one, sum[1] + steps, sum[2] + pairs];
                }
            }
        }
        sums
    });
    // Windows in which both touch all the time, and no sphere is pressed in so far that the watch looks closer.
    let common = |k: usize| both.iter().all(|sums| sums[k][1] > 0.0);
    for (sums, spheres) in both.iter().zip([1000, 19_683]) {
        let chosen = || (0..motions.len()).filter(|k| common(*k));
        let [spent, steps, pairs] = [0, 1, 2].map(|part| chosen().map(|k| sums[k][part]).sum::<f64>());
        let (each, touching) = (1e6 * spent / steps, pairs / steps);
        println!(
            "equal motion in {} windows, {spheres} spheres: {each:.2} us per contact step, {touching:.1} touching pairs, \
             {:.2} us beyond 100 ns per touching pair",
            chosen().count(),
            each - 0.1 * touching
        );
    }
}

fn main() {
    let seconds = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(10.0);
    let dir = tempfile::tempdir().expect("a directory");
    let slope = Slope {
        corner: [0.0, 0.0],
        spacing: 0.4,
        counts: [1001, 501],
        drop: 200.0,
        foot: 0.0,
        benches: 4,
        roughness: 0.08,
        seed: 5,
    };
    let clock = cpu_seconds();
    slope.raster().write_asc(&dir.path().join("million.asc")).expect("written");
    let small = Slope { counts: [225, 225], spacing: 0.5, drop: 60.0, ..slope };
    small.raster().write_asc(&dir.path().join("small.asc")).expect("written");
    let row: Vec<String> = (0..225).map(|i| format!("{}", FALL * (112.0 - 0.5 * f64::from(i)))).collect();
    let head = "ncols 225\nnrows 225\nxllcenter 0\nyllcenter 0\ncellsize 0.5\n";
    std::fs::write(dir.path().join("flat.asc"), format!("{head}{}", (row.join(" ") + "\n").repeat(225)))
        .expect("written");
    println!("two slopes generated and written in {:.2} s", (cpu_seconds() - clock));
    let clock = cpu_seconds();
    let sphere = "shape = { type = \"sphere\", radius = 0.5 }";
    let cube = "shape = { type = \"box\", size = [0.8, 0.8, 0.8] }\ncluster.spheres = 1000";
    let runner = Runner::new(dir.path(), &scene("million.asc", sphere, SOFT, 30.0));
    println!(
        "{} triangles read and made ready in {:.2} s",
        runner.solver.model().ground.as_ref().expect("a terrain").triangles.len(),
        (cpu_seconds() - clock)
    );
    drop(runner);
    let only = std::env::args().nth(2).unwrap_or_default();
    let wanted = |name: &str| only.is_empty() || only == name;
    // What accuracy costs: from coarse to fine.
    let finenesses = match std::env::args().nth(3).and_then(|s| s.parse().ok()) {
        Some(steps) => vec![steps],
        None => vec![10.0, 20.0, 40.0],
    };
    for steps in finenesses {
        if wanted("one") {
            trajectories(dir.path(), "one sphere", sphere, SOFT, steps, 500.0, seconds);
        }
        if wanted("thousand") {
            trajectories(dir.path(), "1 000 spheres", cube, "young = 3e9", steps, 20.0, seconds);
        }
    }
    if wanted("equal") {
        equal_motion(dir.path(), seconds);
    }
    for (name, way) in [("step", Way::Own), ("fixed", Way::Fixed), ("flat", Way::Flat)] {
        for (along, target) in [(10, 4.4), (27, 10.2)] {
            if wanted(&format!("{name}-{along}")) {
                contact_step(dir.path(), along, target, seconds, way);
            }
        }
    }
}
