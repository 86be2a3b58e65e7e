//! A terrain that a test makes, a rock on it, and what came of it.

use dem_solver::DemSolver;
use interface_defs::{Plan, Ready, Solver, Window};
use nalgebra::Vector3;
use std::fmt::Write as _;
use toolkit::program::Options;
use toolkit::scene::Scene;

pub const G: f64 = 9.81;

/// Triangles that a test makes.
#[derive(Clone)]
pub struct Mesh {
    pub nodes: Vec<Vector3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Numbers from -0.5 to 0.5, the same in each run.
pub fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

/// A plane that falls along x by `slope` degrees, `x` metres down the slope from and to, 20 m wide, of
/// `cells` x `across` rectangles; the origin lies on it.
pub fn plane(slope: f64, x: [f64; 2], cells: usize, across: usize) -> Mesh {
    let (sin, cos) = slope.to_radians().sin_cos();
    let mut nodes = Vec::new();
    for j in 0..=across {
        for i in 0..=cells {
            let s = x[0] + (x[1] - x[0]) * i as f64 / cells as f64;
            let y = 20.0 * (j as f64 / across as f64 - 0.5);
            nodes.push(Vector3::new(s * cos, y, -s * sin));
        }
    }
    let mut triangles = Vec::new();
    let n = (cells + 1) as u32;
    for j in 0..across as u32 {
        for i in 0..cells as u32 {
            let a = j * n + i;
            triangles.extend([[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]);
        }
    }
    Mesh { nodes, triangles }
}

impl Mesh {
    pub fn obj(&self) -> String {
        let mut text = String::new();
        for n in &self.nodes {
            let _ = writeln!(text, "v {:?} {:?} {:?}", n.x, n.y, n.z);
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        text
    }
}

/// A rock on a terrain.
pub struct Bench {
    pub solver: DemSolver,
    pub ready: Ready,
    pub output: Vec<f64>,
    pub windows: u64,
    pub time: f64,
    pub dir: tempfile::TempDir,
}

impl Bench {
    /// `scene` names the terrain `t.obj`, which is `mesh`.
    pub fn new(mesh: &Mesh, scene: &str, shortcuts: bool) -> Self {
        Self::beside(mesh, scene, shortcuts, &[])
    }

    /// The same, with `files` (name and text) beside the scene.
    pub fn beside(mesh: &Mesh, scene: &str, shortcuts: bool, files: &[(&str, &str)]) -> Self {
        let dir = tempfile::tempdir().expect("a directory");
        for (name, text) in files {
            std::fs::write(dir.path().join(name), text).expect("written");
        }
        std::fs::write(dir.path().join("t.obj"), mesh.obj()).expect("written");
        let scene =
            Scene::from_text(&dir.path().join("s.toml").display().to_string(), scene).expect("a scene");
        let options = Options { out: Some(dir.path().to_owned()), shortcuts };
        let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        Self { output: ready.initial.clone(), ready, solver, windows: 0, time: 0.0, dir }
    }

    pub fn advance(&mut self, length: f64) {
        self.windows += 1;
        let window = Window { number: self.windows, iteration: 1, start: self.time, length };
        self.solver.solve(&window, &[], &mut self.output).unwrap_or_else(|e| panic!("{e}"));
        self.solver.commit().expect("committed");
        self.time += length;
    }

    /// Windows of `length` until `end` or until all is over.
    pub fn run(&mut self, length: f64, end: f64) {
        while self.time < end - 1e-9 && !self.solver.has_ended() {
            self.advance(length);
        }
    }

    pub fn value(&self, name: &str) -> f64 {
        let at = self.ready.gauges.iter().position(|g| g.name == name);
        self.output[3 * at.unwrap_or_else(|| panic!("no gauge {name}"))]
    }

    pub fn position(&self) -> Vector3<f64> {
        Vector3::new(self.value("rock_x"), self.value("rock_y"), self.value("rock_z"))
    }

    /// Kinetic, potential and stored energy together.
    pub fn energy(&self) -> f64 {
        ["kinetic", "potential", "stored"].map(|part| self.value(&format!("energy_{part}_dem"))).iter().sum()
    }

    /// Rows of `trajectory.csv`.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(self.dir.path().join("trajectory.csv")).expect("written");
        let number = |t: &str| if t.is_empty() { f64::NAN } else { t.parse().expect("a number") };
        text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
    }

    /// Rows in which a contact begins.
    pub fn touches(&self) -> Vec<Vec<f64>> {
        let rows = self.rows();
        rows.windows(2).filter(|w| w[0][15] == 0.0 && w[1][15] == 1.0).map(|w| w[1].clone()).collect()
    }
}

/// A sphere of radius 0.2 m and 2500 kg/m3 whose contact point hangs 1 m above the origin of a plane of
/// `slope` degrees.
pub fn dropped(slope: f64, young: f64, restitution: f64, friction: f64, more: &str) -> String {
    let (sin, cos) = slope.to_radians().sin_cos();
    let at = [0.2 * sin, 0.0, 0.2 * cos + 1.0];
    format!(
        "end_time = 5.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = {at:?}\ndensity = 2500.0\n\
         shape = {{ type = \"sphere\", radius = 0.2 }}\n[terrain]\nfile = \"t.obj\"\n[[contact]]\n\
         law = \"hertz_mindlin\"\nyoung = {young:?}\npoisson = 0.25\nrestitution = {restitution:?}\n\
         friction = {friction:?}\n{more}"
    )
}
