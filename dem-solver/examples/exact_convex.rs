//! A prototype beside the solver: the exact convex block as a contact model of its own, against clusters of spheres.
//!
//! `cargo run --release -p dem-solver --example exact_convex`
//!
//! The block touches triangles where one of its corners lies behind one of them, where a node of theirs lies within the block,
//! and where one of their edges passes through it. The usual penalty law acts at each such point. Measured: the cost of a contact step
//! of a block of 0.8 m that comes down a rough slope, and by how much its energy is off after an elastic landing.
//!
//! | model | contact step [us] | error of the surface [m] | energy gained in an elastic landing, 50 and 200 steps per contact |
//! |---|---|---|---|
//! | cube as a block, 8 corners | 2.1 | 0 | 1.3e-3, 1.2e-3 |
//! | convex block of 33 corners | 2.3 | 0 | 3.3e-2, 3.3e-2 |
//! | cube of 64 spheres | 1.1 | 0.102 | 5.8e-4, 3.6e-5 (`over_rough_ground...` in the tests) |
//! | cube of 1 000 | 1.4 | 0.044 | |
//! | cube of 8 000 | 5.4 | 0.023 | |
//! | cube of 19 683 | 3.4 | 0.017 | |
//!
//! A block costs half as much again as a cluster of 1 000 spheres and has no error of shape: at equal accuracy it is the cheaper
//! one wherever a cluster would need some thousands, by 1.6 at 20 000. What it does not have is a force that follows
//! from an energy: from corner to edge to face the point, the normal and the depth change at once, so that a landing makes or
//! loses energy however fine the step, where spheres with `hierarchy = "continuous"` err by the square of it; it remembers no
//! friction, knows no wires and no hollow shapes. Hence clusters: 64 to 500 spheres where cost counts, 1 000 and more
//! where edges do. A block would be the choice for sharp convex rocks on terrain alone, once its force has an energy (that of the common
//! volume, say). The solver has none.

use dem_solver::DemSolver;
use dem_solver::geometry::closest::on_face;
use dem_solver::settings::Rotation;
use dem_solver::terrain::Terrain;
use dem_solver::terrain::slope::Slope;
use interface_defs::ipc::serve::cpu_seconds;
use interface_defs::toolkit::program::Options;
use interface_defs::toolkit::scene::Scene;
use interface_defs::{Plan, Solver, Window};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::path::Path;

/// Steps that are timed together.
const BATCH: usize = 50;
/// Turn of the block at its start.
const TURN: [f64; 4] = [1.0, 0.1, 0.3, 0.05];
/// Radius that the law takes for a corner or an edge [m].
const ROUND: f64 = 0.05;

/// A convex block: corners in its own frame, faces as `n . x <= d`.
struct Block {
    corners: Vec<Vector3<f64>>,
    faces: Vec<(Vector3<f64>, f64)>,
    edges: usize,
    reach: f64,
    mass: f64,
    inertia: Vector3<f64>,
}

impl Block {
    fn new(corners: Vec<Vector3<f64>>, triangles: &[[u32; 3]], mass: f64, inertia: Vector3<f64>) -> Self {
        let mut faces: Vec<(Vector3<f64>, f64)> = Vec::new();
        let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for &[a, b, c] in triangles {
            let [p, q, r] = [a, b, c].map(|n| corners[n as usize]);
            let normal = (q - p).cross(&(r - p)).normalize();
            let known = faces.iter().position(|(n, _)| (n - normal).norm() < 1e-9);
            let face = known.unwrap_or(faces.len());
            if known.is_none() {
                faces.push((normal, normal.dot(&p)));
            }
            for [i, j] in [[a, b], [b, c], [c, a]] {
                edges.entry([i.min(j), i.max(j)]).or_default().push(face);
            }
        }
        let edges = edges.values().filter(|f| f[0] != f[1]).count();
        let reach = corners.iter().map(|c| c.norm()).fold(0.0, f64::max);
        Self { corners, faces, edges, reach, mass, inertia }
    }
}

/// What of the terrain is near.
struct Near {
    at: Vector3<f64>,
    triangles: Vec<([Vector3<f64>; 3], Vector3<f64>)>,
    nodes: Vec<Vector3<f64>>,
    edges: Vec<[Vector3<f64>; 2]>,
}

impl Near {
    fn look(&mut self, ground: &Terrain, at: Vector3<f64>, radius: f64) {
        self.at = at;
        self.triangles.clear();
        let (mut nodes, mut edges) = (Vec::new(), Vec::new());
        ground.about(&at, radius, |t| {
            let [a, b, c] = ground.corners(t);
            // The tree gives some that are further away.
            if on_face(&at, [&a, &b, &c]).to_point.norm_squared() > radius * radius {
                return;
            }
            self.triangles.push(([a, b, c], (b - a).cross(&(c - a)).normalize()));
            let [i, j, k] = ground.triangles[t as usize];
            nodes.extend([i, j, k]);
            edges.extend([[i, j], [j, k], [k, i]].map(|[i, j]| [i.min(j), i.max(j)]));
        });
        nodes.sort_unstable();
        nodes.dedup();
        edges.sort_unstable();
        edges.dedup();
        self.nodes = nodes.iter().map(|n| ground.nodes[*n as usize]).collect();
        self.edges = edges.iter().map(|e| e.map(|n| ground.nodes[n as usize])).collect();
    }
}

/// Call `found` with each contact of the block at `position`, turned by `turn`: point, normal out of the ground, depth [m].
fn contacts(
    block: &Block,
    near: &Near,
    position: &Vector3<f64>,
    turn: &Matrix3<f64>,
    corners: &mut Vec<Vector3<f64>>,
    mut found: impl FnMut(Vector3<f64>, Vector3<f64>, f64),
) {
    corners.clear();
    corners.extend(block.corners.iter().map(|c| position + turn * c));
    let deepest = 0.25 * block.reach;
    for ([a, b, c], normal) in &near.triangles {
        for corner in corners.iter() {
            let height = normal.dot(&(corner - a));
            let inside = |p: &Vector3<f64>, q: &Vector3<f64>| (q - p).cross(&(corner - p)).dot(normal) >= 0.0;
            if height < 0.0 && height > -deepest && inside(a, b) && inside(b, c) && inside(c, a) {
                found(*corner, *normal, -height);
            }
        }
    }
    let square = block.reach * block.reach;
    for node in &near.nodes {
        let own = turn.tr_mul(&(node - position));
        if own.norm_squared() > square {
            continue;
        }
        let mut shallowest = (f64::NEG_INFINITY, Vector3::zeros());
        for (normal, level) in &block.faces {
            let height = normal.dot(&own) - level;
            if height > shallowest.0 {
                shallowest = (height, *normal);
            }
        }
        if shallowest.0 < 0.0 {
            found(*node, turn * -shallowest.1, -shallowest.0);
        }
    }
    for [a, b] in &near.edges {
        let start = turn.tr_mul(&(a - position));
        let way = turn.tr_mul(&(b - a));
        let closest = (-start.dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        if (start + way * closest).norm_squared() > square {
            continue;
        }
        // The part of the edge within the block, and the faces by which it comes and goes.
        let (mut enters, mut leaves) = ((0.0, None), (1.0, None));
        for (normal, level) in &block.faces {
            let (height, rate) = (normal.dot(&start) - level, normal.dot(&way));
            if rate < 0.0 && -height / rate > enters.0 {
                enters = (-height / rate, Some(normal));
            } else if rate > 0.0 && -height / rate < leaves.0 {
                leaves = (-height / rate, Some(normal));
            } else if rate == 0.0 && height > 0.0 {
                leaves.0 = -1.0;
            }
            if enters.0 > leaves.0 {
                break;
            }
        }
        if let ((from, Some(m)), (to, Some(n))) = (enters, leaves)
            && from < to
            && let Some(out) = (m + n).try_normalize(0.0)
        {
            let middle = start + way * (0.5 * (from + to));
            let depth = 0.25 * (to - from) * way.cross(&out).norm();
            found(position + turn * middle, turn * -out, depth);
        }
    }
}

/// What a run of the block gave.
struct Result {
    seconds: f64,
    steps: usize,
    contacts: usize,
    /// Energy after the first landing over that before.
    kept: f64,
}

/// From `position` at 6 m/s down the slope until it leaves or `limit` steps are done; with `bounce` until it has parted from
/// its first landing, without friction and dashpot.
fn run(
    ground: &Terrain,
    block: &Block,
    position: Vector3<f64>,
    h: f64,
    limit: usize,
    bounce: bool,
) -> Result {
    let gravity = -Vector3::z() * 9.81;
    let stiffness = 4.0 / 3.0 * 1e9 / 0.9375 * ROUND.sqrt();
    let (mut x, mut v, mut l) = (position, Vector3::x() * 6.0, Vector3::zeros());
    let mut q = UnitQuaternion::from_quaternion(Quaternion::from(TURN));
    let margin = 0.3 * block.reach;
    let mut near =
        Near { at: Vector3::repeat(f64::INFINITY), triangles: vec![], nodes: vec![], edges: vec![] };
    let mut corners = Vec::with_capacity(block.corners.len());
    let energy = |x: &Vector3<f64>, v: &Vector3<f64>, q: &UnitQuaternion<f64>, l: &Vector3<f64>| {
        let own = q.inverse_transform_vector(l);
        let turning = 0.5 * own.dot(&own.component_div(&block.inertia));
        block.mass * (0.5 * v.norm_squared() - gravity.dot(&(x - position))) + turning
    };
    let start = energy(&x, &v, &q, &l);
    let mut seen = Result { seconds: 0.0, steps: 0, contacts: 0, kept: f64::NAN };
    let mut touched = false;
    for _ in 0..limit / BATCH {
        let clock = cpu_seconds();
        let (mut touching, mut found) = (0, 0);
        for _ in 0..BATCH {
            x += v * (0.5 * h);
            q = Rotation::Exact.turn(&q, &l, &block.inertia, 0.5 * h);
            if (x - near.at).norm() > margin {
                near.look(ground, x, block.reach + margin);
            }
            let turn = q.to_rotation_matrix().into_inner();
            let spin = turn * turn.tr_mul(&l).component_div(&block.inertia);
            let (mut force, mut torque, before) = (Vector3::zeros(), Vector3::zeros(), found);
            contacts(block, &near, &x, &turn, &mut corners, |point, normal, depth| {
                let arm = point - x;
                let past = v + spin.cross(&arm);
                let approach = past.dot(&normal);
                let elastic = stiffness * depth * depth.sqrt();
                let mut push = normal * elastic;
                if !bounce {
                    let pressed = elastic * (1.0 - 0.3 * approach).max(0.0);
                    let slip = past - normal * approach;
                    push = normal * pressed - slip * (0.3 * pressed / (slip.norm() + 1e-3));
                }
                force += push;
                torque += arm.cross(&push);
                found += 1;
            });
            touching += usize::from(found > before);
            v += (force / block.mass + gravity) * h;
            l += torque * h;
            x += v * (0.5 * h);
            q = Rotation::Exact.turn(&q, &l, &block.inertia, 0.5 * h);
        }
        touched |= touching > 0;
        if touching == BATCH {
            seen.seconds += cpu_seconds() - clock;
            seen.steps += BATCH;
            seen.contacts += found;
        }
        if (bounce && touched && touching == 0) || x.x > ground.highest.x - 2.0 || !x.x.is_finite() {
            seen.kept = energy(&x, &v, &q, &l) / start;
            break;
        }
    }
    seen
}

fn scene(shape: &str) -> String {
    let [a, b, c, d] = TURN;
    format!(
        "end_time = 120.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [20.0, 30.0, 61.0]\nvelocity = [6.0, 0.0, 0.0]\n\
         orientation = [{a:?}, {b:?}, {c:?}, {d:?}]\ndensity = 2600.0\n{shape}\n[terrain]\nfile = \"slope.asc\"\n[[contact]]\n\
         law = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.35\nfriction = 0.3\n\
         hierarchy = \"continuous\"\n[dem]\ntime_step = 2e-5\n"
    )
}

fn solver(dir: &Path, shape: &str) -> (DemSolver, Vec<f64>) {
    let path = dir.join("s.toml").display().to_string();
    let scene = Scene::from_text(&path, &scene(shape)).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
    let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    (solver, ready.initial)
}

/// The same block of spheres, by the solver.
fn cluster(dir: &Path, spheres: u32) {
    let shape = format!("shape = {{ type = \"box\", size = [0.8, 0.8, 0.8] }}\ncluster.spheres = {spheres}");
    let (mut solver, mut output) = solver(dir, &shape);
    let count = |solver: &mut DemSolver, name: &str| {
        let counts = solver.finish().expect("finished").counts;
        counts.iter().find(|(n, _)| n == name).map_or(0, |(_, c)| *c) as f64
    };
    let (mut seconds, mut steps, mut pairs, mut number) = (0.0, 0.0, 0.0, 0_u32);
    while number < 4_000 && !solver.has_ended() {
        let start = 1e-3 * f64::from(number);
        number += 1;
        let before = ["sub_steps", "contact_evaluations"].map(|n| count(&mut solver, n));
        let window = Window { number: u64::from(number), iteration: 1, start, length: 1e-3 };
        let clock = cpu_seconds();
        solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
        let taken = cpu_seconds() - clock;
        solver.commit().expect("committed");
        let taken_steps = count(&mut solver, "sub_steps") - before[0];
        // Windows that touched throughout.
        if taken_steps >= BATCH as f64 && solver.state().bodies[0].contacts > 0 {
            seconds += taken;
            steps += taken_steps;
            pairs += count(&mut solver, "contact_evaluations") - before[1];
        }
    }
    let rock = &solver.model().rocks[0];
    let error = rock.accuracy(&solver.model().settings.rocks[0]).expect("a shape").largest();
    println!(
        "cluster of {} spheres: {:.2} us per contact step, {:.1} touching; its surface is {error:.4} m off at most",
        rock.spheres.len(),
        1e6 * seconds / steps,
        pairs / steps
    );
}

fn main() {
    let dir = tempfile::tempdir().expect("a directory");
    let slope = Slope {
        corner: [0.0, 0.0],
        spacing: 0.5,
        counts: [225, 225],
        drop: 60.0,
        foot: 0.0,
        benches: 4,
        roughness: 0.08,
        seed: 5,
    };
    slope.raster().write_asc(&dir.path().join("slope.asc")).expect("written");
    for (name, shape) in [
        ("cube", "shape = { type = \"box\", size = [0.8, 0.8, 0.8] }\ncluster.spheres = 1"),
        (
            "random convex block",
            "shape = { type = \"random_convex\", size = [0.8, 0.8, 0.8], seed = 3, points = 40 }\ncluster.spheres = 64",
        ),
    ] {
        let (solver, _) = solver(dir.path(), shape);
        let (rock, ground) = (&solver.model().rocks[0], solver.model().ground.as_ref().expect("a terrain"));
        let (corners, triangles) = rock.solid.surface();
        let block = Block::new(corners, &triangles, rock.mass, rock.inertia);
        let above = Vector3::new(20.0, 30.0, 100.0) - ground.origin;
        let level = above.z - ground.height(&above, &-Vector3::z()).expect("on the slope");
        let start = Vector3::new(above.x, above.y, level + 1.0);
        let timed = run(ground, &block, start, 2e-5, 1_000_000, false);
        // A landing lasts some 8 ms.
        let kept = [1.6e-4, 4e-5].map(|h| run(ground, &block, start, h, 1_000_000, true).kept - 1.0);
        println!(
            "{name} as a block of {} corners, {} edges, {} faces: {:.2} us per contact step, {:.1} contacts; energy after an \
             elastic landing {:+.1e}, with a fourth of the step {:+.1e}",
            block.corners.len(),
            block.edges,
            block.faces.len(),
            1e6 * timed.seconds / timed.steps as f64,
            timed.contacts as f64 / timed.steps as f64,
            kept[0],
            kept[1]
        );
    }
    for spheres in [64, 1000, 8000, 19_683] {
        cluster(dir.path(), spheres);
    }
}
