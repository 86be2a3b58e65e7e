//! Quadrilaterals: membranes of them, shells that are split, through every reader and into the field files.

use crate::common::{Run, off, scene};
use crate::fields::array;
use fem_solver::FemSolver;
use interface_defs::message::Plan;
use interface_defs::solver::Solver;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// A disc of radius 1 m of quadrilaterals, `4 n` around: a square of `n` x `n` in the middle, four blocks of `n` x `n` around
/// it. Nodes and cells.
fn disc(n: usize) -> (Vec<[f64; 2]>, Vec<[usize; 4]>) {
    let (side, half) = (n + 1, 0.45);
    let inner = |i: usize| half * (2.0 * i as f64 / n as f64 - 1.0);
    let mut nodes: Vec<[f64; 2]> = (0..side * side).map(|k| [inner(k % side), inner(k / side)]).collect();
    let square = |i: usize, j: usize| j * side + i;
    let mut cells: Vec<[usize; 4]> = Vec::new();
    for j in 0..n {
        for i in 0..n {
            cells.push([square(i, j), square(i + 1, j), square(i + 1, j + 1), square(i, j + 1)]);
        }
    }
    // Around the square, against the clock from its lowest corner on the left.
    let mut ring: Vec<usize> = (0..n).map(|i| square(i, 0)).collect();
    ring.extend((0..n).map(|j| square(n, j)));
    ring.extend((0..n).map(|i| square(n - i, n)));
    ring.extend((0..n).map(|j| square(0, n - j)));
    let around = ring.len();
    let mut below = ring.clone();
    for layer in 1..=n {
        let part = layer as f64 / n as f64;
        let above: Vec<usize> = (0..around)
            .map(|k| {
                let angle = std::f64::consts::TAU * (k as f64 / around as f64 - 0.375);
                let [x, y] = nodes[ring[k]];
                nodes.push([(1.0 - part) * x + part * angle.cos(), (1.0 - part) * y + part * angle.sin()]);
                nodes.len() - 1
            })
            .collect();
        for k in 0..around {
            let next = (k + 1) % around;
            cells.push([below[k], above[k], above[next], below[next]]);
        }
        below = above;
    }
    (nodes, cells)
}

/// Depth of the middle of a clamped membrane, E h = 1e6 N/m, under q = 100 N/m2, of `disc(n)`.
fn hencky(n: usize, poisson: f64) -> f64 {
    let (nodes, cells) = disc(n);
    let mut share = vec![0.0; nodes.len()];
    for cell in &cells {
        // A quarter of the area of the two triangles at each corner: exact enough for what is nearly a parallelogram.
        let [a, b, c, d] = cell.map(|n| nodes[n]);
        let area = 0.5 * ((c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0]));
        cell.iter().for_each(|n| share[*n] += 0.25 * area);
    }
    let held: Vec<usize> =
        (0..nodes.len()).filter(|k| nodes[*k][0].hypot(nodes[*k][1]) > 1.0 - 1e-9).collect();
    let free = (0..nodes.len()).filter(|k| !held.contains(k));
    let loads: Vec<String> =
        free.map(|k| format!("{{ nodes = [{k}], force = [0.0, 0.0, {:?}] }}", -100.0 * share[k])).collect();
    let places: Vec<String> = nodes.iter().map(|[x, y]| format!("[{x:?}, {y:?}, 0.0]")).collect();
    let text = format!(
        r#"
end_time = 1.0
[structure]
nodes = [{}]
supports = [{{ nodes = {held:?} }}]
loads = [{}]
[[structure.parts]]
name = "skin"
element = "membrane"
cells = {cells:?}
thickness = 1e-3
density = 0.0
young = [1e9]
poisson = {poisson:?}
wrinkles = false
[fem]
integrator = "static"
"#,
        places.join(", "),
        loads.join(", ")
    );
    let run = Run::alone(&text, 0.1);
    let middle = nodes.iter().position(|[x, y]| x.hypot(*y) < 1e-9).expect("a node in the middle");
    -run.ready.mesh.coordinates[3 * middle + 2]
}

#[test]
fn a_membrane_of_quadrilaterals_bulges_as_hencky_says() {
    // V-F8: w0 = W a (q a / E h)^(1/3); strains of 1e-3.
    for (poisson, shape) in [(0.2, 0.677435326), (0.3, 0.653443345)] {
        let exact = shape * 1e-4_f64.cbrt();
        let (coarse, fine) = (hencky(4, poisson), hencky(8, poisson));
        assert!(off(fine, exact) < 5e-3 && off(fine, exact) < off(coarse, exact), "{coarse} {fine} {exact}");
    }
}

/// Two quadrilaterals and a triangle beside each other, 3 m x 1 m less a corner, in each format that is read.
const FILES: [(&str, &str); 3] = [
    (
        "skin.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"skin\"\n$EndPhysicalNames\n$Nodes\n7\n1 0 0 0\n2 1 0 0\n\
         3 2 0 0\n4 3 0 0\n5 0 1 0\n6 1 1 0\n7 2 1 0\n$EndNodes\n$Elements\n3\n1 3 2 1 1 1 2 6 5\n2 3 2 1 1 2 3 7 6\n\
         3 2 2 1 1 3 4 7\n$EndElements\n",
    ),
    (
        "skin.inp",
        "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n4, 3, 0, 0\n5, 0, 1, 0\n6, 1, 1, 0\n7, 2, 1, 0\n\
         *ELEMENT, TYPE=M3D4R, ELSET=skin\n1, 1, 2, 6, 5\n2, 2, 3, 7, 6\n*ELEMENT, TYPE=M3D3, ELSET=skin\n3, 3, 4, 7\n",
    ),
    (
        "skin.mdpa",
        "Begin Nodes\n1 0 0 0\n2 1 0 0\n3 2 0 0\n4 3 0 0\n5 0 1 0\n6 1 1 0\n7 2 1 0\nEnd Nodes\n\
         Begin Elements MembraneElement3D4N\n1 0 1 2 6 5\n2 0 2 3 7 6\nEnd Elements\n\
         Begin Elements MembraneElement3D3N\n3 0 3 4 7\nEnd Elements\n\
         Begin SubModelPart skin\nBegin SubModelPartNodes\n1\n2\n3\n4\n5\n6\n7\nEnd SubModelPartNodes\n\
         Begin SubModelPartElements\n1\n2\n3\nEnd SubModelPartElements\nEnd SubModelPart\n",
    ),
];

fn from_file(dir: &std::path::Path, (file, content): (&str, &str), part: &str) -> Scene {
    std::fs::write(dir.join(file), content).unwrap();
    let path = dir.join("test.toml");
    let text = format!(
        "end_time = 0.1\n[structure]\nmesh = \"{file}\"\nform_finding = \"none\"\nsupports = [{{ group = \"skin\" }}]\n\
         [[structure.parts]]\nname = \"skin\"\n{part}\n[output]\nfields = 0.1\n"
    );
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_reader_gives_quadrilaterals_and_the_field_file_shows_them() {
    let skin =
        "element = \"membrane\"\nthickness = 1e-3\ndensity = 1e3\nyoung = [1e8]\nprestress = [2e6, 1e6]";
    for file in FILES {
        let dir = tempfile::tempdir().unwrap();
        let scene = from_file(dir.path(), file, skin);
        let options = Options { out: Some(dir.path().to_owned()), shortcuts: true };
        let solver = FemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
        // Areas of 1, 1 and 1/2 m2; a quadrilateral gives a quarter of its mass to each corner.
        assert!(off(solver.model().mass.iter().sum::<f64>(), 2.5) < 1e-14, "{}", file.0);
        assert!(
            off(solver.model().mass[0], 0.25) < 1e-14
                && off(solver.model().mass[6], 0.5 / 3.0 + 0.25) < 1e-14
        );
        let mut run = Run::of(solver, Plan { end_time: 0.1, window: 0.1, ..Plan::default() });
        assert_eq!(
            run.ready.mesh.faces,
            [[0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 6]],
            "{}",
            file.0
        );
        run.step(0.1, &[]);
        run.solver.finish().unwrap();
        let faces = dir.path().join("fields/structure_faces_000002.vtu");
        for (name, exact) in [
            ("stress_1", 2e6),
            ("stress_2", 1e6),
            ("force_1", 2e3),
            ("force_2", 1e3),
            ("part", 1.0),
            ("slack", 0.0),
        ] {
            let values = array(&faces, name);
            assert!(
                values.len() == 3 && values.iter().all(|v| (v - exact).abs() <= 1e-12 * exact),
                "{name} {values:?}"
            );
        }
    }
}

#[test]
fn quadrilaterals_of_shell_are_split_and_that_is_said() {
    let skin = "element = \"shell\"\nthickness = 1e-3\ndensity = 1e3\nyoung = 1e8";
    let dir = tempfile::tempdir().unwrap();
    let scene = from_file(dir.path(), FILES[1], skin);
    let report = fem_solver::solver::check::check(&scene, None).expect("a scene");
    let said = report.warnings.iter().any(|w| {
        w.message == "part `skin`: 2 quadrilaterals of shell are split into two triangles each, along the shorter diagonal"
    });
    assert!(said, "{:?}", report.warnings);
    let solver = FemSolver::new(&scene, &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(solver.model().elements.len(), 5);
}

#[test]
fn the_shorter_diagonal_splits_a_shell_and_what_is_not_convex_is_refused() {
    let text = |corner: &str, part: &str| {
        format!(
            "end_time = 1.0\n[structure]\nnodes = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], {corner}, [0.0, 1.0, 0.0]]\n\
             supports = [{{ nodes = [0, 1] }}]\nform_finding = \"none\"\n[[structure.parts]]\nname = \"skin\"\n\
             cells = [[0, 1, 2, 3]]\nthickness = 1e-3\ndensity = 1e3\n{part}\n"
        )
    };
    let shell = |corner: &str| {
        let solver = crate::common::solver(&text(corner, "element = \"shell\"\nyoung = 1e8"));
        solver.model().elements.iter().map(|e| e.nodes().to_vec()).collect::<Vec<_>>()
    };
    assert_eq!(shell("[3.0, 2.0, 0.0]"), [[0, 1, 3], [1, 2, 3]]);
    assert_eq!(shell("[1.0, 1.0, 0.0]"), [[0, 1, 2], [0, 2, 3]]);
    let membrane = "element = \"membrane\"\nyoung = [1e8]";
    let refused = match FemSolver::new(&scene(&text("[0.2, 0.2, 0.0]", membrane)), &Options::default()) {
        Ok(_) => panic!("must be refused"),
        Err(error) => error.to_string(),
    };
    assert!(
        refused.contains("the quadrilateral of nodes [0, 1, 2, 3] has no area or is not convex"),
        "{refused}"
    );
}
