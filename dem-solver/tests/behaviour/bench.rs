//! A solver, a mesh that a test moves, and what came of it.

use dem_solver::DemSolver;
use interface_defs::{
    Fault, FieldSpec, InterfaceMesh, Layout, Place, Plan, Ready, Sampling, Solver, Window, name,
};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// A prepared solver with its mesh.
pub struct Bench {
    pub solver: DemSolver,
    pub ready: Ready,
    pub takes: Layout,
    pub gives: Layout,
    pub input: Vec<f64>,
    pub output: Vec<f64>,
    pub time: f64,
    windows: u64,
}

/// What a bench is made of.
#[derive(Clone)]
pub struct Setup {
    pub scene: String,
    pub contact_mesh: Option<InterfaceMesh>,
    pub samples: u32,
    pub ends: bool,
    pub reach: bool,
    pub broken: bool,
    pub velocity: bool,
    pub shortcuts: bool,
    /// Length of the scene's windows [s].
    pub window: f64,
}

impl Setup {
    pub fn new(scene: impl Into<String>, contact_mesh: InterfaceMesh) -> Self {
        Self {
            scene: scene.into(),
            contact_mesh: Some(contact_mesh),
            samples: 1,
            ends: true,
            reach: false,
            broken: false,
            velocity: true,
            shortcuts: true,
            window: 1e-3,
        }
    }

    pub fn plan(&self) -> Plan {
        let field =
            |name, sampling| FieldSpec { samples: self.samples, ..FieldSpec::nodal(name, 3, sampling) };
        let mut plan = Plan {
            end_time: 1.0,
            window: self.window,
            partner_mesh: self.contact_mesh.clone(),
            ..Plan::default()
        };
        if self.contact_mesh.is_some() {
            plan.takes.push(field(name::DISPLACEMENT, Sampling::FromStart));
            if self.velocity {
                plan.takes.push(field(name::VELOCITY, Sampling::FromStart));
            }
            if self.broken {
                let lines = FieldSpec::nodal(name::BROKEN, 1, Sampling::Once);
                plan.takes.push(FieldSpec { place: Place::Line, ..lines });
            }
            plan.gives.push(field(name::FORCE, Sampling::Means));
            if self.ends {
                plan.gives.push(field(name::FORCE, Sampling::AtEnds));
            }
            if self.reach {
                plan.gives.push(FieldSpec::nodal(name::REACH, 1, Sampling::Once));
            }
        }
        plan
    }

    pub fn build(&self) -> Bench {
        let scene = Scene::from_text("test.toml", &self.scene).expect("a scene");
        let options = Options { out: None, shortcuts: self.shortcuts };
        let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
        let plan = self.plan();
        let ready = solver.prepare(&plan, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        let takes = Layout::new(&plan.takes, &ready.mesh, 0);
        let gives = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len());
        Bench {
            input: vec![0.0; takes.len()],
            output: ready.initial.clone(),
            time: 0.0,
            windows: 0,
            solver,
            ready,
            takes,
            gives,
        }
    }
}

impl Bench {
    /// Solve a window without committing it.
    pub fn solve(&mut self, length: f64) -> Result<(), Fault> {
        let window = Window { number: self.windows + 1, iteration: 1, start: self.time, length };
        self.solver.solve(&window, &self.input, &mut self.output)
    }

    /// Commit the window solved last.
    pub fn commit(&mut self, length: f64) {
        self.solver.commit().expect("committed");
        self.windows += 1;
        self.time += length;
    }

    /// Solve and commit.
    pub fn advance(&mut self, length: f64) {
        self.solve(length).unwrap_or_else(|f| panic!("{f}"));
        self.commit(length);
    }

    /// Value, smallest, largest of a gauge.
    pub fn gauge(&self, name: &str) -> [f64; 3] {
        let at = self.ready.gauges.iter().position(|g| g.name == name);
        let at = self.gives.gauge(at.unwrap_or_else(|| panic!("no gauge {name}")));
        self.output[at].try_into().expect("three numbers")
    }

    pub fn value(&self, name: &str) -> f64 {
        self.gauge(name)[0]
    }

    pub fn position(&self) -> Vector3<f64> {
        Vector3::new(self.value("rock_x"), self.value("rock_y"), self.value("rock_z"))
    }

    pub fn velocity(&self) -> Vector3<f64> {
        Vector3::new(self.value("rock_vx"), self.value("rock_vy"), self.value("rock_vz"))
    }

    /// Angular velocity in space.
    pub fn spin(&self) -> Vector3<f64> {
        let rock = &self.solver.model().rocks[0];
        rock.spin(&self.solver.state().bodies[0].motion)
    }

    /// One sample of a force field.
    pub fn force(&self, sampling: Sampling, sample: usize) -> Vec<Vector3<f64>> {
        let range = self.gives.sample(name::FORCE, sampling, sample).expect("in the plan");
        self.output[range].chunks_exact(3).map(|f| Vector3::new(f[0], f[1], f[2])).collect()
    }

    pub fn total_force(&self, sampling: Sampling) -> Vector3<f64> {
        self.force(sampling, 0).iter().sum()
    }

    /// Say which lines of the mesh are broken.
    pub fn tear(&mut self, broken: impl Fn(usize) -> bool) {
        let range = self.takes.sample(name::BROKEN, Sampling::Once, 0).expect("in the plan");
        let flags = self.input[range].iter_mut().enumerate();
        flags.for_each(|(line, flag)| *flag = f64::from(u8::from(broken(line))));
    }

    /// Write the displacement at sample `sample`, as a function of the node.
    pub fn displace(&mut self, sample: usize, u: impl Fn(usize, Vector3<f64>) -> Vector3<f64>) {
        let range = self.takes.sample(name::DISPLACEMENT, Sampling::FromStart, sample).expect("in the plan");
        for (node, out) in self.input[range].chunks_exact_mut(3).enumerate() {
            let c = &self.ready.mesh.coordinates[3 * node..3 * node + 3];
            out.copy_from_slice(u(node, Vector3::new(c[0], c[1], c[2])).as_slice());
        }
    }

    /// Energy that must be constant: all of the solver's less what it has received.
    pub fn energy(&self) -> f64 {
        ["kinetic", "potential", "stored", "dissipated"]
            .map(|part| self.value(&format!("energy_{part}_dem")))
            .iter()
            .sum::<f64>()
            - self.value("energy_received_dem")
    }

    /// Advance in windows of `length` until nothing has been touched for one window after a contact.
    pub fn until_separated(&mut self, length: f64) {
        let mut touched = false;
        for _ in 0..2_000_000 {
            self.advance(length);
            let [now, _, most] = self.gauge("contacts");
            if touched && now == 0.0 && most == 0.0 {
                return;
            }
            touched |= most > 0.0;
        }
        panic!("never separated");
    }
}

/// A rectangle in the plane z = 0, `cells` x `cells` squares of two triangles, from -size/2 to size/2.
pub fn plane(size: f64, cells: usize) -> InterfaceMesh {
    let n = cells + 1;
    let mut mesh = InterfaceMesh::default();
    for j in 0..n {
        for i in 0..n {
            let at = |i: usize| size * (i as f64 / cells as f64 - 0.5);
            mesh.coordinates.extend([at(i), at(j), 0.0]);
        }
    }
    for j in 0..cells {
        for i in 0..cells {
            let a = (j * n + i) as u32;
            let (b, c, d) = (a + 1, a + n as u32, a + n as u32 + 1);
            mesh.faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// The same with nodes of infinite mass: a fixed mesh that tells its masses.
pub fn fixed_plane(size: f64, cells: usize) -> InterfaceMesh {
    let mut mesh = plane(size, cells);
    mesh.masses = vec![f64::INFINITY; mesh.node_count()];
    mesh
}

/// A net in the plane z = 0: `cells` x `cells` cells of `spacing`, all wires of one `radius`, node mass 0.03 kg.
pub fn net(cells: usize, spacing: f64, radius: f64) -> InterfaceMesh {
    let n = cells + 1;
    let mut mesh = InterfaceMesh::default();
    for j in 0..n {
        for i in 0..n {
            let at = |i: usize| spacing * (i as f64 - 0.5 * cells as f64);
            mesh.coordinates.extend([at(i), at(j), 0.0]);
        }
    }
    for j in 0..n as u32 {
        for i in 0..n as u32 {
            let a = j * n as u32 + i;
            if i + 1 < n as u32 {
                mesh.lines.push([a, a + 1]);
            }
            if j + 1 < n as u32 {
                mesh.lines.push([a, a + n as u32]);
            }
        }
    }
    mesh.line_radius = vec![radius; mesh.lines.len()];
    mesh.masses = vec![0.03; mesh.node_count()];
    mesh
}

/// The rock of the drop test.
pub fn cube(spheres: u32, more: &str) -> String {
    format!(
        "[[rock]]\nmass = 180.0\nshape = {{ type = \"box\", size = [0.41, 0.41, 0.41] }}\ncluster.spheres = {spheres}\n{more}\n"
    )
}

/// A sphere.
pub fn sphere(radius: f64, density: f64, more: &str) -> String {
    format!("[[rock]]\ndensity = {density:?}\nshape = {{ type = \"sphere\", radius = {radius:?} }}\n{more}\n")
}
