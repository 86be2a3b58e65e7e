//! A net above the ground: a rock that meets both, alone and with another rock.

use crate::bench::{G, plane};
use dem_solver::DemSolver;
use dem_solver::model::state::Against;
use interface_defs::{FieldSpec, InterfaceMesh, Layout, Plan, Sampling, Solver, Window, name};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Nodes of the net along one side.
const ALONG: usize = 9;

/// An upright net of 1.6 m x 1.6 m at x = 2, cells of 0.2 m, its lowest wire 0.1 m above the ground.
fn upright(origin: &Vector3<f64>) -> InterfaceMesh {
    let mut mesh = InterfaceMesh::default();
    for j in 0..ALONG {
        for i in 0..ALONG {
            let at = Vector3::new(2.0, 0.2 * i as f64 - 0.8, 0.1 + 0.2 * j as f64) + origin;
            mesh.coordinates.extend(at.iter());
            let a = (j * ALONG + i) as u32;
            if i + 1 < ALONG {
                mesh.lines.push([a, a + 1]);
            }
            if j + 1 < ALONG {
                mesh.lines.push([a, a + ALONG as u32]);
            }
        }
    }
    mesh.line_radius = vec![0.005; mesh.lines.len()];
    mesh.masses = vec![0.3; mesh.node_count()];
    mesh
}

struct Bench {
    solver: DemSolver,
    takes: Layout,
    gives: Layout,
    gauges: Vec<String>,
    mesh: InterfaceMesh,
    output: Vec<f64>,
    time: f64,
    _dir: tempfile::TempDir,
}

impl Bench {
    /// Terrain z = 0 and net, both moved by `origin`; the rocks of `scene` are where it says.
    fn new(scene: &str, origin: &Vector3<f64>) -> Self {
        let dir = tempfile::tempdir().expect("a directory");
        let mut ground = plane(0.0, [-8.0, 8.0], 8, 5);
        ground.nodes.iter_mut().for_each(|n| *n += origin);
        std::fs::write(dir.path().join("t.obj"), ground.obj()).expect("written");
        let path = dir.path().join("s.toml").display().to_string();
        let scene = Scene::from_text(&path, scene).expect("a scene");
        let options = Options { out: None, shortcuts: true };
        let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
        let field = |name, sampling| FieldSpec { samples: 1, ..FieldSpec::nodal(name, 3, sampling) };
        let mesh = upright(origin);
        let plan = Plan {
            end_time: 1.0,
            window: 1e-3,
            partner_mesh: Some(mesh.clone()),
            takes: vec![
                field(name::DISPLACEMENT, Sampling::FromStart),
                field(name::VELOCITY, Sampling::FromStart),
            ],
            gives: vec![
                field(name::FORCE, Sampling::Means),
                FieldSpec::nodal(name::REACH, 1, Sampling::Once),
            ],
            ..Plan::default()
        };
        let ready = solver.prepare(&plan, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        Self {
            takes: Layout::new(&plan.takes, &ready.mesh, 0),
            gives: Layout::new(&plan.gives, &ready.mesh, ready.gauges.len()),
            gauges: ready.gauges.iter().map(|g| g.name.clone()).collect(),
            output: ready.initial,
            solver,
            mesh,
            time: 0.0,
            _dir: dir,
        }
    }

    /// A window in which the net bulges, to and fro.
    fn advance(&mut self, length: f64) {
        let mut input = vec![0.0; self.takes.len()];
        for (sample, t) in [(0, self.time), (1, self.time + length)] {
            let range = |name| self.takes.sample(name, Sampling::FromStart, sample).expect("planned");
            let bulge = |node: usize| {
                let (i, j) = (node % ALONG, node / ALONG);
                let part = |k: usize| (std::f64::consts::PI * k as f64 / (ALONG - 1) as f64).sin();
                part(i) * part(j)
            };
            let (sin, cos) = (30.0 * t).sin_cos();
            for node in 0..self.mesh.node_count() {
                input[range(name::DISPLACEMENT).start + 3 * node] = 0.05 * sin * bulge(node);
                input[range(name::VELOCITY).start + 3 * node] = 0.05 * 30.0 * cos * bulge(node);
            }
        }
        let window = Window { number: 1, iteration: 1, start: self.time, length };
        self.solver.solve(&window, &input, &mut self.output).unwrap_or_else(|f| panic!("{f}"));
        self.solver.commit().expect("committed");
        self.time += length;
    }

    fn value(&self, name: &str) -> f64 {
        let at = self.gauges.iter().position(|g| g == name).unwrap_or_else(|| panic!("no gauge {name}"));
        self.output[self.gives.gauge(at)][0]
    }

    /// Energy that must be constant.
    fn energy(&self) -> f64 {
        let part = |part: &str| self.value(&format!("energy_{part}_dem"));
        part("kinetic") + part("potential") + part("stored") + part("dissipated") - part("received")
    }

    fn forces(&self) -> Vec<Vector3<f64>> {
        let range = self.gives.sample(name::FORCE, Sampling::Means, 0).expect("planned");
        self.output[range].chunks_exact(3).map(|f| Vector3::new(f[0], f[1], f[2])).collect()
    }

    /// Every node that was loaded in the window is in reach.
    fn reach_holds_what_is_loaded(&self) {
        let reach = &self.output[self.gives.sample(name::REACH, Sampling::Once, 0).expect("planned")];
        for (node, force) in self.forces().iter().enumerate() {
            assert!(force.norm() == 0.0 || reach[node] == 1.0, "{}: node {node} is not in reach", self.time);
        }
    }
}

const LAW: &str =
    "[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\nrestitution = 0.6\nfriction = 0.4\n";

/// A cube that bounces off the ground into the net, and falls back.
fn cube(origin: &Vector3<f64>, more: &str) -> String {
    let at: [f64; 3] = (Vector3::new(0.0, 0.125, 0.75) + origin).into();
    format!(
        "end_time = 2.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nmass = 50.0\nposition = {at:?}\nvelocity = [6.0, 0.0, -3.0]\n\
         orientation = [0.9, 0.2, -0.3, 0.1]\nshape = {{ type = \"box\", size = [0.4, 0.4, 0.4] }}\ncluster.spheres = 64\n\
         [terrain]\nfile = \"t.obj\"\n{LAW}{more}"
    )
}

/// The balance of energy with what the net brought, and that of momentum with what ground, net and gravity gave. Friction, dashpot and a moving
/// mesh: between first and second order (`with_a_moving_wall_the_received_work_closes_the_balance` has the same), here of 1 125 J.
#[test]
fn a_rock_meets_the_ground_and_then_a_moving_net_and_the_balances_close() {
    let zero = Vector3::zeros();
    let errors = [5e-5, 1.25e-5].map(|step| {
        let mut bench = Bench::new(&cube(&zero, &format!("[dem]\ntime_step = {step:e}\n")), &zero);
        let (start, mut worst, mut push, mut on_terrain) = (bench.energy(), 0.0_f64, zero, 0);
        while bench.time < 0.6 {
            let before = bench.value("rock_vx");
            bench.advance(1e-3);
            bench.reach_holds_what_is_loaded();
            let force: Vector3<f64> = bench.forces().iter().sum();
            push += force * 1e-3;
            let body = &bench.solver.state().bodies[0];
            if force.norm() > 0.0 && body.terrain_histories.is_empty() {
                // In the air the net alone changes the speed along x.
                let gained = 50.0 * (bench.value("rock_vx") - before);
                if body.path.contact_since.is_none() {
                    assert!((gained + force.x * 1e-3).abs() < 1e-9 * 50.0 * 6.0, "{gained} {}", force.x);
                }
            }
            on_terrain += usize::from(!body.terrain_histories.is_empty());
            worst = worst.max((bench.energy() - start).abs());
        }
        println!("steps of {step:e} s: imbalance {worst:.2e} J; the net took {push:.1?} N s");
        assert!(on_terrain > 5, "it met the ground");
        assert!(push.x > 50.0 * 4.0, "and the net, which took {push}");
        assert!(bench.value("rock_x") < 2.0, "it did not pass");
        assert!(bench.value("energy_received_dem").abs() > 5.0, "the net has worked");
        worst
    });
    assert!(errors[0] < 5e-3 * 1125.0, "{errors:?}");
    assert!((errors[0] / errors[1]).log2() / 2.0 > 1.0, "{errors:?}");
}

/// Where the map puts them: nodes of multiples of 0.2 m are rounded to 5e-10 m at 2.6e6 m, and nothing else changes.
#[test]
fn ground_and_net_in_coordinates_of_a_survey_give_the_same_answer() {
    let run = |origin: Vector3<f64>| {
        let mut bench = Bench::new(&cube(&origin, ""), &origin);
        (0..400).for_each(|_| bench.advance(1e-3));
        bench.solver.state().bodies[0].motion.position - origin + bench.solver.model().origin
    };
    let here = run(Vector3::zeros());
    let there = run(Vector3::new(2_600_000.0, 1_200_000.0, 1_500.0));
    println!("{:.1e} m apart", (there - here).norm());
    // After ground and net: as in `flight_in_closed_form_changes_no_more_than_rounding`, each impact makes some times as much of it.
    assert!((there - here).norm() < 1e3 * 5e-10, "{there} {here}");
}

/// A light ball waits a metre before the net; a heavy one throws it there within one window of 17 ms, into wires that its own
/// flight would never have come near.
#[test]
fn a_rock_thrown_into_the_net_within_a_window_has_its_wires_in_reach() {
    let ball = |name: &str, mass: f64, radius: f64, x: f64, speed: f64| {
        format!(
            "[[rock]]\nname = \"{name}\"\nmass = {mass:?}\nposition = [{x:?}, 0.0, 0.9]\nvelocity = [{speed:?}, 0.0, 0.0]\n\
             shape = {{ type = \"sphere\", radius = {radius:?} }}\n"
        )
    };
    let rocks = ball("light", 2.0, 0.15, 1.0, 0.0) + &ball("heavy", 2000.0, 0.5, 0.3, 40.0);
    let scene =
        format!("end_time = 1.0\ngravity = [0.0, 0.0, {:?}]\n{rocks}[terrain]\nfile = \"t.obj\"\n{LAW}", -G);
    let mut bench = Bench::new(&scene, &Vector3::zeros());
    bench.advance(0.017);
    assert!(bench.forces().iter().any(|f| f.norm() > 0.0), "it met the net in its first window");
    bench.reach_holds_what_is_loaded();
}

/// A rock that meets ground and net has one deepest overlap, the larger of both; a touch of the ground before the net is no impact.
#[test]
fn ground_before_the_net_is_no_impact_and_the_deepest_overlap_stands_once() {
    let zero = Vector3::zeros();
    let mut bench = Bench::new(&cube(&zero, ""), &zero);
    let mut on_terrain = None;
    let mut first = None;
    while bench.time < 0.6 {
        bench.advance(1e-3);
        if !bench.solver.state().bodies[0].terrain_histories.is_empty() && on_terrain.is_none() {
            on_terrain = Some(bench.time);
        }
        if first.is_none() && bench.forces().iter().any(|f| f.norm() > 0.0) {
            first = Some(bench.time);
        }
    }
    let (ground, net) = (on_terrain.expect("it met the ground"), first.expect("and the net"));
    let end = bench.solver.finish().expect("finished");
    let all = |name: &str| -> Vec<f64> {
        end.measures.iter().filter(|m| m.name == name).map(|m| m.value).collect()
    };
    let [impact] = all("time_of_impact")[..] else { panic!("{:?}", end.measures) };
    assert!(ground < net - 0.01 && impact <= net && impact > net - 1e-3, "{ground} {impact} {net}");
    let depths = &bench.solver.state().bodies[0].deepest;
    let [both] = all("max_penetration")[..] else { panic!("not once: {:?}", end.measures) };
    let (of_net, of_ground) = (depths.of(Against::Net).0, depths.of(Against::Terrain).0);
    assert!(of_net > 0.0 && of_ground > 0.0 && both == of_net.max(of_ground));
    let names: Vec<_> = end.measures.iter().map(|m| &m.name).collect();
    assert!(names.iter().enumerate().all(|(at, name)| !names[..at].contains(name)), "{names:?}");
}
