//! Structures of the literature on stability, and their curves: for `paths.rs` and for the example `stability`.

use crate::common::Run;

/// One row of a curve.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Displacement of the node that is watched [m].
    pub moved: [f64; 3],
    /// Load factor.
    pub load: f64,
    /// Directions that are unstable.
    pub negative: f64,
}

/// A plane frame in x and z: a chain of beams through `corners`, each side of them cut into `cuts` of its own.
pub struct Frame {
    pub corners: Vec<[f64; 2]>,
    pub cuts: Vec<usize>,
    /// Whether the first and the last node are clamped; else they are pinned.
    pub clamped: bool,
    /// Further supports: corner and directions.
    pub held: Vec<(usize, &'static str)>,
    pub young: f64,
    pub area: f64,
    pub inertia: f64,
    /// Loads at the factor 1: corner and force in x and z.
    pub loads: Vec<(usize, [f64; 2])>,
    /// The corner that is watched.
    pub watched: usize,
}

impl Frame {
    /// Node of a corner.
    pub fn node(&self, corner: usize) -> usize {
        self.cuts[..corner].iter().sum()
    }

    pub fn points(&self) -> Vec<[f64; 2]> {
        let mut points = vec![self.corners[0]];
        for (ends, cuts) in self.corners.windows(2).zip(&self.cuts) {
            points.extend((1..=*cuts).map(|i| {
                let part = i as f64 / *cuts as f64;
                [0, 1].map(|c| ends[0][c] + part * (ends[1][c] - ends[0][c]))
            }));
        }
        points
    }

    /// The scene: a path at `speed`, the corner of the load watched.
    pub fn text(&self, speed: f64) -> String {
        let points = self.points();
        let count = points.len();
        let nodes: Vec<_> = points.iter().map(|[x, z]| format!("[{x:?}, 0.0, {z:?}]")).collect();
        let cells: Vec<_> = (1..count).map(|i| format!("[{}, {i}]", i - 1)).collect();
        let inner: Vec<_> = (1..count - 1).collect();
        let ends = if self.clamped { "xyz" } else { "xz" };
        let held: String = self
            .held
            .iter()
            .map(|(corner, directions)| format!("[[structure.supports]]\nnodes = [{}]\ndirections = \"{directions}\"\nrotations = \"xz\"\n", self.node(*corner)))
            .collect();
        let own: Vec<_> = self.held.iter().map(|(corner, _)| self.node(*corner)).collect();
        let inner: Vec<_> = inner.into_iter().filter(|i| !own.contains(i)).collect();
        let ends_held: Vec<_> = [0, count - 1].into_iter().filter(|i| !own.contains(i)).collect();
        let loads: String = self
            .loads
            .iter()
            .map(|(corner, [fx, fz])| {
                format!(
                    "[[structure.loads]]\nnodes = [{}]\nforce = [{fx:?}, 0.0, {fz:?}]\n",
                    self.node(*corner)
                )
            })
            .collect();
        let at = points[self.node(self.watched)];
        format!(
            r#"
end_time = 1.0
[structure]
nodes = [{nodes}]
[[structure.supports]]
nodes = {ends_held:?}
rotations = "{ends}"
[[structure.supports]]
nodes = {inner:?}
directions = "y"
rotations = "xz"
{held}
[[structure.parts]]
name = "frame"
element = "beam"
cells = [{cells}]
young = {young:?}
area = {area:?}
inertia = [{inertia:?}, {inertia:?}]
density = 1.0
{loads}
[fem]
integrator = "static"
path_speed = {speed:?}
[[gauge]]
name = "watched"
at = [{x:?}, 0.0, {z:?}]
quantity = "displacement"
"#,
            nodes = nodes.join(", "),
            cells = cells.join(", "),
            young = self.young,
            area = self.area,
            inertia = self.inertia,
            x = at[0],
            z = at[1],
        )
    }
}

/// Lee's frame: two legs of 1.2 m, pinned; the load a fifth along the beam.
pub fn lee(cuts: usize) -> Frame {
    Frame {
        corners: vec![[0.0, 0.0], [0.0, 1.2], [0.24, 1.2], [1.2, 1.2]],
        cuts: vec![5 * cuts, cuts, 4 * cuts],
        clamped: false,
        held: Vec::new(),
        young: 7.2e10,
        area: 6e-4,
        inertia: 2e-8,
        loads: vec![(2, [0.0, -1.0])],
        watched: 2,
    }
}

/// A hinged cylindrical panel of `cells` x `cells` pairs of triangles over a quarter, `thickness` [mm] thick; N and mm.
pub fn panel(cells: usize, thickness: f64, speed: f64) -> String {
    let (radius, half, angle) = (2540.0_f64, 254.0, 0.1_f64);
    let at = |i: usize, j: usize| {
        let a = angle * i as f64 / cells as f64;
        format!(
            "[{:?}, {:?}, {:?}]",
            radius * a.sin(),
            half * j as f64 / cells as f64,
            radius * a.cos() - radius
        )
    };
    let number = |i: usize, j: usize| j * (cells + 1) + i;
    let nodes: Vec<_> =
        (0..=cells).flat_map(|j| (0..=cells).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect();
    let triangles: Vec<_> = (0..cells)
        .flat_map(|j| (0..cells).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        })
        .collect();
    let side = |of: &dyn Fn(usize) -> usize| (1..cells).map(of).collect::<Vec<_>>();
    let hinge: Vec<_> = (1..=cells).map(|j| number(cells, j)).collect();
    let (middle_x, middle_y) = (side(&|j| number(0, j)), side(&|i| number(i, 0)));
    let (end_x, corner) = (number(0, cells), number(cells, 0));
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [{nodes}]
[[structure.supports]]
nodes = [0]
directions = "xy"
rotations = "xyz"
[[structure.supports]]
nodes = {middle_x:?}
directions = "x"
rotations = "yz"
[[structure.supports]]
nodes = [{end_x}]
directions = "x"
rotations = "yz"
[[structure.supports]]
nodes = {middle_y:?}
directions = "y"
rotations = "xz"
[[structure.supports]]
nodes = [{corner}]
rotations = "xz"
[[structure.supports]]
nodes = {hinge:?}
[[structure.parts]]
name = "panel"
element = "shell"
cells = {triangles:?}
thickness = {thickness:?}
density = 1.0
young = 3102.75
poisson = 0.3
[[structure.loads]]
nodes = [0]
force = [0.0, 0.0, -0.25]
[fem]
integrator = "static"
path_speed = {speed:?}
[[gauge]]
name = "watched"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
"#,
        nodes = nodes.join(", "),
    )
}

/// Williams' toggle: two beams of 12.943 in with a rise of 0.386 in, clamped; inches and pounds.
pub fn toggle(cuts: usize) -> Frame {
    // E A = 1.885e6 lb, E I = 9.27e3 lb in2.
    Frame {
        corners: vec![[0.0, 0.0], [12.943, 0.386], [25.886, 0.0]],
        cuts: vec![cuts, cuts],
        clamped: true,
        held: Vec::new(),
        young: 1.03e7,
        area: 1.885e6 / 1.03e7,
        inertia: 9.27e3 / 1.03e7,
        loads: vec![(1, [0.0, -1.0])],
        watched: 1,
    }
}

/// A column of 4 m, pinned, 16 beams or as many as told, with a bow of a sine of `bow` [m]; `along` z. The load in units of
/// Euler's.
pub fn column(beams: usize, bow: f64) -> Frame {
    let (length, young, area, inertia) = (4.0, 2.1e11, 5.381e-3, 2.492e-5);
    let corners = (0..=beams)
        .map(|i| {
            let part = i as f64 / beams as f64;
            [bow * (std::f64::consts::PI * part).sin(), length * part]
        })
        .collect();
    let euler = std::f64::consts::PI.powi(2) * young * inertia / (length * length);
    Frame {
        corners,
        cuts: vec![1; beams],
        clamped: false,
        held: vec![(beams, "xy")],
        young,
        area,
        inertia,
        loads: vec![(beams, [0.0, -euler])],
        watched: beams,
    }
}

/// Half span [m], rise [m] and `E I` [N m2] of the arch, and its rise over the radius of gyration of its section.
pub const ARCH: [f64; 4] = [5.0, 0.1, 7e5, 5.5];

/// A shallow arch, pinned, in the shape of a sine, under a sine of load whose largest value is 1 N/m.
pub fn arch(beams: usize) -> Frame {
    let [half, rise, bending, slender] = ARCH;
    let part = |i: usize| i as f64 / beams as f64;
    let sine = |i: usize| (std::f64::consts::PI * part(i)).sin();
    let (length, area) = (2.0 * half / beams as f64, 1e-2);
    let inertia = area * (rise / slender).powi(2);
    Frame {
        corners: (0..=beams).map(|i| [2.0 * half * part(i), rise * sine(i)]).collect(),
        cuts: vec![1; beams],
        clamped: false,
        held: Vec::new(),
        young: bending / inertia,
        area,
        inertia,
        loads: (1..beams).map(|i| (i, [0.0, -length * sine(i)])).collect(),
        watched: beams / 2,
    }
}

/// The same scene with a path that turns into branches.
pub fn turning(text: &str) -> String {
    text.replace("[[gauge]]", "path_at_branch = \"turn\"\n[[gauge]]")
}

/// The first `rows` rows of a path, one every `window` [s].
pub fn follow(text: &str, window: f64, rows: usize) -> (Run, Vec<Point>) {
    let mut run = Run::alone(text, window);
    let mut points = Vec::new();
    for _ in 0..rows {
        run.step(window, &[]);
        points.push(Point {
            moved: ["x", "y", "z"].map(|c| run.value(&format!("watched_u{c}"))),
            load: run.value("load_factor"),
            negative: run.value("negative_pivots"),
        });
    }
    (run, points)
}
