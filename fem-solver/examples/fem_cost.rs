//! What a Newton iteration and an explicit step cost: `cargo run --release -p fem-solver --example fem_cost [-- --full]`.
//!
//! Square cable nets, edges held. One Newton iteration is assembly, factorisation and solution, on one thread;
//! processor time counts, so that a busy machine disturbs less. `--full` goes on to 1e6 degrees of freedom. The growth is the
//! exponent of the time and of the memory between each size and the next, and of a straight line through all of them.
//! What was measured stands in `README.md` beside this.

use fem_solver::config::Config;
use fem_solver::element::Slack;
use fem_solver::integrator::explicit::Explicit;
use fem_solver::internal_force::tangent::Tangent;
use fem_solver::model::Model;
use fem_solver::state::State;
use std::time::Instant;
use toolkit::scene::Scene;

/// A net of `side` x `side` nodes with the cables of the drop test, prestressed.
fn net(side: usize) -> Model {
    let cells = side - 1;
    let text = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\n\
         generator = {{ type = \"rectangular_net\", cells = [{cells}, {cells}], spacing = 0.15, boundary_cables = false }}\n\
         cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0, prestress = 1e7 }}\n"
    );
    built(&text)
}

/// The model of a scene.
fn built(text: &str) -> Model {
    let scene = Scene::from_text("net.toml", text).unwrap_or_else(|e| panic!("{e}"));
    let config = Config::of(&scene).unwrap_or_else(|e| panic!("{e}"));
    Model::build(&scene, &config).unwrap_or_else(|e| panic!("{e}"))
}

/// The same net out of a mesh file whose nodes and elements are numbered at random, as a mesh generator may.
fn shuffled(side: usize) -> Model {
    let mut seed = 1_u64;
    let mut numbers: Vec<usize> = (0..side * side).collect();
    let mut shuffle = |numbers: &mut Vec<usize>| {
        for i in (1..numbers.len()).rev() {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            numbers.swap(i, (seed >> 33) as usize % (i + 1));
        }
    };
    shuffle(&mut numbers);
    let regular = net(side);
    let mut order: Vec<usize> = (0..regular.cables.len()).collect();
    shuffle(&mut order);
    let mut place = vec![0; numbers.len()];
    numbers.iter().enumerate().for_each(|(old, new)| place[*new] = old);
    let mut mesh = String::from("*NODE\n");
    for (number, old) in place.iter().enumerate() {
        let p = regular.nodes[*old];
        mesh += &format!("{}, {}, {}, {}\n", number + 1, p.x, p.y, p.z);
    }
    mesh += "*ELEMENT, TYPE=T3D2, ELSET=net\n";
    for (i, cable) in order.iter().enumerate() {
        let [a, b] = regular.cables[*cable].nodes.map(|n| numbers[n] + 1);
        mesh += &format!("{}, {a}, {b}\n", i + 1);
    }
    mesh += "*NSET, NSET=edge\n";
    for node in (0..regular.nodes.len()).filter(|n| regular.fully_held(*n)) {
        mesh += &format!("{}\n", numbers[node] + 1);
    }
    let directory = tempfile::tempdir().expect("there is room for a mesh");
    let path = directory.path().join("net.inp");
    std::fs::write(&path, mesh).expect("the mesh can be written");
    built(&format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\nmesh = {:?}\n\
         cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0, prestress = 1e7 }}\n\
         supports = [{{ group = \"edge\" }}]\n",
        path.display()
    ))
}

/// Time that this thread has had a processor [s], so that a busy machine disturbs little; wall time where the system does
/// not tell.
fn processor_seconds(started: &Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| started.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// Mean time of `what` over so many rounds [s], the first left out.
fn time(rounds: usize, mut what: impl FnMut()) -> f64 {
    what();
    let started = Instant::now();
    let before = processor_seconds(&started);
    (0..rounds).for_each(|_| what());
    (processor_seconds(&started) - before) / rounds as f64
}

/// A displacement without symmetry.
fn displaced(model: &Model) -> Vec<f64> {
    (0..model.dof_count())
        .map(|dof| if model.held[dof] { 0.0 } else { 1e-6 * (dof as f64 * 0.7).sin() })
        .collect()
}

fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kb| kb.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}

/// What one size costs.
struct Cost {
    dofs: f64,
    /// Newton iteration [s].
    time: f64,
    /// Largest memory of the process so far [MB]: sizes increase.
    peak: f64,
}

/// Exponent of growth of `what` with the degrees of freedom: slope of the straight line through the logarithms that has
/// the least squares.
fn exponent(costs: &[Cost], what: impl Fn(&Cost) -> f64) -> f64 {
    let n = costs.len() as f64;
    let points = costs.iter().map(|c| (c.dofs.ln(), what(c).ln()));
    let (x, y) = points.clone().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (above, below) =
        points.fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x).powi(2)));
    above / below
}

fn newton(side: usize, rounds: usize) -> Cost {
    let model = net(side);
    let u = displaced(&model);
    let started = Instant::now();
    let mut tangent = Tangent::new(&model);
    let analysis = started.elapsed().as_secs_f64();
    let assembly = time(rounds, || tangent.assemble(&model, &u, &[], 1.0, Slack::Exact));
    let factor = time(rounds, || tangent.factorise().expect("a prestressed net is stable"));
    let mut x = vec![1.0; tangent.dofs.len()];
    let solution = time(rounds, || {
        x.fill(1.0);
        tangent.matrix.solve(&mut x);
    });
    let all = assembly + factor + solution;
    println!(
        "{:>8} nodes {:>8} cables {:>8} dofs: analysis {:>9.2} ms, assembly {:>8.3}, factor {:>9.3}, solution {:>8.3} = {:>9.3} ms; factor {:.1} MB, peak {:.0} MB",
        model.node_count(),
        model.cables.len(),
        model.dof_count(),
        1e3 * analysis,
        1e3 * assembly,
        1e3 * factor,
        1e3 * solution,
        1e3 * all,
        8e-6 * tangent.matrix.cholesky.factor_len() as f64,
        peak_memory_mb(),
    );
    Cost { dofs: model.dof_count() as f64, time: all, peak: peak_memory_mb() }
}

fn explicit(name: &str, model: &Model) {
    let mut explicit = Explicit::new(model);
    let n = model.dof_count();
    let mut state = State { displacement: displaced(model), velocity: vec![0.0; n], ..State::default() };
    let steps = (2_000_000 / model.cables.len()).max(3);
    let mut rounds: Vec<f64> = (0..25)
        .map(|_| {
            let started = Instant::now();
            (0..steps).for_each(|_| {
                explicit.step(model, &mut state, 0.0, 1e-6);
            });
            1e9 * started.elapsed().as_secs_f64() / (steps * model.cables.len()) as f64
        })
        .collect();
    rounds.sort_by(f64::total_cmp);
    println!(
        "{name:>12} {:>8} cables, {:>7} runs: {:.2} ns per cable and step (median of 25 rounds; least {:.2})",
        model.cables.len(),
        explicit.internal.cables.run_count(),
        rounds[12],
        rounds[0],
    );
}

fn main() {
    let full = std::env::args().any(|a| a == "--full");
    println!("Newton iteration (targets: 729 nodes 1.28 ms, 3364 nodes 5.2 ms)");
    let sides: &[(usize, usize)] = &[(19, 200), (27, 200), (58, 60), (101, 20), (183, 8), (317, 4), (578, 2)];
    let sides = if full { sides } else { &sides[..5] };
    let costs: Vec<_> = sides.iter().map(|(side, rounds)| newton(*side, *rounds)).collect();
    for pair in costs.windows(2) {
        println!(
            "growth from {:>7} to {:>7} dofs: time {:.2}, memory {:.2}",
            pair[0].dofs,
            pair[1].dofs,
            exponent(pair, |c| c.time),
            exponent(pair, |c| c.peak)
        );
    }
    println!(
        "growth of all: time {:.2}, memory {:.2}",
        exponent(&costs, |c| c.time),
        exponent(&costs, |c| c.peak)
    );
    println!("Explicit step (target: 3 ns)");
    for side in [27, 58, 183] {
        explicit("regular", &net(side));
        explicit("shuffled", &shuffled(side));
    }
}
