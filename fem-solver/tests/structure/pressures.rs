//! Pressure on the faces of membranes and shells: closed forms, load stiffness, work.

use crate::common::{Run, coupled_plan, off};
use crate::loads::SCHEMES;
use interface_defs::Sampling;
use std::f64::consts::PI;

/// A quarter of a disc or of the octant of a sphere: a triangle of rows of nodes 0, 1, .. `n`, and the cells between them.
fn triangle(n: usize, at: impl Fn(f64, f64, f64) -> [f64; 3]) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let first = |row: usize| row * (row + 1) / 2;
    let (mut nodes, mut cells) = (Vec::new(), Vec::new());
    for row in 0..=n {
        for i in 0..=row {
            let share = |k: usize| k as f64 / n as f64;
            nodes.push(at(share(n - row), share(row - i), share(i)));
        }
    }
    for row in 0..n {
        for i in 0..=row {
            cells.push([first(row) + i, first(row + 1) + i, first(row + 1) + i + 1]);
            if i < row {
                cells.push([first(row) + i, first(row + 1) + i + 1, first(row) + i + 1]);
            }
        }
    }
    (nodes, cells)
}

/// The octant of a sphere of radius 1 m with its planes of symmetry held, the pressure of `pressures` on it.
pub fn octant(n: usize, material: &str, pressures: &str, fem: &str) -> String {
    let (nodes, cells) = triangle(n, |a, b, c| {
        let size = (a * a + b * b + c * c).sqrt();
        [a / size, b / size, c / size]
    });
    let plane = |c: usize| (0..nodes.len()).filter(|i| nodes[*i][c].abs() < 1e-12).collect::<Vec<_>>();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
form_finding = "none"
supports = [{{ group = "x0", directions = "x" }}, {{ group = "y0", directions = "y" }},
            {{ group = "z0", directions = "z" }}]
groups = [{{ name = "x0", nodes = {:?} }}, {{ name = "y0", nodes = {:?} }}, {{ name = "z0", nodes = {:?} }}]
{pressures}
[[structure.parts]]
name = "skin"
element = "membrane"
cells = {cells:?}
thickness = 1e-3
density = 1000.0
{material}
[[gauge]]
name = "x0"
group = "x0"
quantity = "force"
[fem]
{fem}
"#,
        plane(0),
        plane(1),
        plane(2)
    )
}

#[test]
fn a_sphere_under_pressure_has_the_stress_p_r_over_2_t() {
    let pressures =
        "pressures = [{ group = \"skin\", pressure = 1000.0, history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let error = |n: usize| {
        let text = octant(n, "young = [1e9]\npoisson = 0.3", pressures, "integrator = \"static\"");
        let mut run = Run::with(&text, coupled_plan(1.0, Sampling::AtEnds, 1, 1));
        run.step(1.0, &[]);
        let model = run.solver.model();
        // p r (1 - nu) / (2 E t) of the radius: 3.5e-4. The pressure does half of p times the volume that it gains.
        let growth = -run.value("energy_loads_fem") / (0.5 * 1000.0 * 0.5 * PI);
        let stress: f64 = model
            .elements
            .iter()
            .map(|element| {
                let u: Vec<f64> = element.nodes().iter().flat_map(|node| run.displacement(*node)).collect();
                let [large, small] = element.face_stresses(&u);
                0.5 * (large + small)
            })
            .sum::<f64>()
            / model.elements.len() as f64;
        // In balance to rounding: the symmetry plane carries the pressure on the polygon that it cuts out.
        let outline: Vec<_> = model.nodes.iter().filter(|p| p.x.abs() < 1e-12).collect();
        let angle = |p: &nalgebra::Vector3<f64>| p.z.atan2(p.y);
        let mut outline = outline;
        outline.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        let area: f64 = outline.windows(2).map(|e| 0.5 * (e[0].y * e[1].z - e[0].z * e[1].y)).sum();
        let grown = area * (1.0 + 2.0 * growth);
        assert!(off(-run.value("x0_fx_sum"), 1000.0 * grown) < 1e-4, "{} {grown}", run.value("x0_fx_sum"));
        (off(stress, 1000.0 / 2e-3), off(growth, 3.5e-4))
    };
    let (coarse, fine) = (error(6), error(12));
    assert!(fine.0 < 0.01 && fine.1 < 0.02, "{fine:?}");
    assert!(coarse.0 / fine.0 > 3.0 && coarse.1 / fine.1 > 3.0, "{coarse:?} {fine:?}: of second order");
}

#[test]
fn a_soft_balloon_is_blown_up_in_a_few_iterations() {
    // A stretch of 10 % in ten steps: where the load stiffness is not in the tangent, each iteration leaves some percent
    // of the error before, and so few are not enough.
    let pressures = "pressures = [{ group = \"skin\", pressure = 3e4, history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let text =
        octant(6, "young = [1e8]\npoisson = 0.3\nwrinkles = false", pressures, "integrator = \"static\"");
    let mut run = Run::with(&text, coupled_plan(0.1, Sampling::AtEnds, 1, 1));
    for n in 0..10 {
        let before = run.count("newton_iterations");
        run.step(0.1, &[]);
        let taken = run.count("newton_iterations") - before;
        assert!(n == 0 || taken <= 5, "{taken} iterations in step {n}");
    }
    let growth = run.displacement(0)[0];
    assert!(growth > 0.08, "{growth}");
    assert_eq!(run.count("refined_windows"), 0);
}

#[test]
fn the_work_of_pressure_closes_the_balance_in_every_scheme() {
    let pressures = "damping = 3.0\n\
                     pressures = [{ group = \"skin\", pressure = 1e4, history = [[0.0, 0.0], [0.01, 1.0], [0.02, 0.2]] }]";
    for scheme in SCHEMES {
        let error = |step: f64| {
            let fem = format!("time_step = {step:?}\n{scheme}");
            let text = octant(3, "young = [1e8]\npoisson = 0.3\nwrinkles = false", pressures, &fem);
            let mut run = Run::alone(&text, 4e-3);
            let start = run.balance();
            let (mut most, mut work) = (0.0_f64, 0.0_f64);
            for _ in 0..10 {
                run.step(4e-3, &[]);
                most = most.max((run.balance() - start).abs());
                work = work.max(run.value("energy_loads_fem").abs());
            }
            assert!(work > 10.0, "{work}");
            most / work
        };
        let (coarse, fine) = (error(2e-4), error(1e-4));
        // Elements without the mean stress of a step have an error of second order in the midpoint rule, too.
        assert!(fine < 0.02 && coarse / fine > 2.0, "{scheme}: {coarse:.2e} {fine:.2e}");
    }
}

/// A disc of radius 1 m, 1 cm thick, in rings of triangles; its rim is clamped.
fn plate(rings: usize, pressure: f64) -> String {
    let (mut nodes, mut cells) = (vec![[0.0, 0.0, 0.0]], Vec::new());
    let first = |ring: usize| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    for ring in 1..=rings {
        for i in 0..6 * ring {
            let (r, angle) = (ring as f64 / rings as f64, PI * i as f64 / (3 * ring) as f64);
            nodes.push([r * angle.cos(), r * angle.sin(), 0.0]);
        }
        let node = |ring: usize, i: usize| if ring == 0 { 0 } else { first(ring) + i % (6 * ring) };
        for side in 0..6 {
            for i in 0..ring {
                let (outer, inner) = (side * ring + i, side * (ring - 1) + i);
                cells.push([node(ring - 1, inner), node(ring, outer), node(ring, outer + 1)]);
                if i + 1 < ring {
                    cells.push([node(ring - 1, inner), node(ring, outer + 1), node(ring - 1, inner + 1)]);
                }
            }
        }
    }
    let rim: Vec<_> = (first(rings)..nodes.len()).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
supports = [{{ nodes = {rim:?}, rotations = "xyz" }}]
pressures = [{{ group = "plate", pressure = {pressure:?} }}]
[[structure.parts]]
name = "plate"
element = "shell"
cells = {cells:?}
thickness = 0.01
density = 0.0
young = 2.1e11
[fem]
integrator = "static"
"#
    )
}

/// Hencky's deflection of a clamped disc without bending stiffness, without prestress, nu = 0.3, over its radius.
fn hencky(load: f64) -> f64 {
    // The series of Fichter (1997), NASA TP 3658, without its terms of the pressure's direction; b_0 for nu = 0.3.
    let b = 1.7244_f64;
    let terms = [1.0, 1.0 / 2.0, 5.0 / 9.0, 55.0 / 72.0, 7.0 / 6.0, 205.0 / 108.0, 17051.0 / 5292.0];
    load.cbrt() * terms.iter().zip([1, 4, 7, 10, 13, 16, 19]).map(|(a, n)| a / b.powi(n)).sum::<f64>()
}

#[test]
fn a_flat_membrane_is_blown_up_to_henckys_deflection_at_once_or_from_nothing() {
    let text = |rings: usize, history: &str, fem: &str| {
        let membrane = "young = [1e9]\npoisson = 0.3";
        plate(rings, 10.0)
            .replace("pressure = 10.0", &format!("pressure = 10.0{history}"))
            .replace("shell", "membrane")
            .replace("young = 2.1e11", membrane)
            .replace("thickness = 0.01", "thickness = 0.001")
            .replace(", rotations = \"xyz\"", "")
            .replace("integrator = \"static\"", &format!("integrator = \"static\"\n{fem}"))
    };
    let exact = hencky(10.0 / (1e9 * 1e-3));
    let height = |rings: usize| Run::alone(&text(rings, "", ""), 1.0).ready.mesh.coordinates[2];
    let (coarse, fine) = (off(height(4), exact), off(height(8), exact));
    assert!(fine < 0.01 && coarse / fine > 2.5, "{coarse:.2e} {fine:.2e}");
    // From flat, where nothing holds it across its plane.
    let ramp = text(8, ", history = [[0.0, 0.0], [1.0, 1.0]]", "load_steps = { first = 0.01 }");
    let mut run = Run::with(&ramp, coupled_plan(0.5, Sampling::AtEnds, 1, 1));
    run.step(0.5, &[]);
    run.step(0.5, &[]);
    assert!(off(run.displacement(0)[2], height(8)) < 1e-6, "{}", run.displacement(0)[2]);
}

#[test]
fn a_clamped_plate_bends_under_pressure_by_p_a4_over_64_d() {
    // Form finding takes a constant pressure, downward here: against the normals.
    let rigidity = 2.1e11 * 1e-6 / (12.0 * 0.91);
    let (exact, mut errors) = (-100.0 / (64.0 * rigidity), Vec::new());
    for rings in [4, 8] {
        let run = Run::alone(&plate(rings, -100.0), 1.0);
        errors.push(off(run.ready.mesh.coordinates[2], exact));
    }
    assert!(errors[1] < 0.02 && errors[0] / errors[1] > 2.5, "{errors:?}");
}

/// A pyramid of six membranes on a regular hexagon of 1 m, `height` high, its base held and its tip guided, under 1 Pa from
/// outside.
fn pyramid(height: f64) -> String {
    let mut nodes = vec![[0.0, 0.0, height]];
    nodes.extend((0..6).map(|i| f64::from(i) * PI / 3.0).map(|a| [a.cos(), a.sin(), 0.0]));
    let cells: Vec<_> = (0..6).map(|i| [0, 1 + i, 1 + (i + 1) % 6]).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
supports = [{{ nodes = [1, 2, 3, 4, 5, 6] }}, {{ nodes = [0], directions = "xy" }}]
pressures = [{{ group = "skin", pressure = -1.0 }}]
[[structure.parts]]
name = "skin"
element = "membrane"
cells = {cells:?}
thickness = 1e-3
density = 1000.0
young = [1e9]
poisson = 0.3
wrinkles = false
[fem]
integrator = "static"
path_speed = 0.1
[[gauge]]
name = "tip"
at = [0.0, 0.0, {height:?}]
quantity = "displacement"
"#
    )
}

#[test]
fn a_pyramid_snaps_through_under_pressure_along_the_curve_of_its_energy() {
    // Its volume is A h / 3, whatever its height: p = 3 U' / A. Each face is stretched along its slope alone, s^2 = 3/4 + h^2:
    // U = 6 area t E / (1 - nu^2) e^2 / 2, e = (s^2 - s_0^2) / (2 s_0^2).
    let (high, area) = (0.1_f64, 1.5 * 3.0_f64.sqrt());
    let slope = 0.75 + high * high;
    let stiffness = 6.0 * 0.5 * slope.sqrt() * 1e-3 * 1e9 / 0.91;
    let pressure = |h: f64| 3.0 / area * stiffness * (high * high - h * h) / (2.0 * slope) * h / slope;
    let mut run = Run::alone(&pyramid(high), 0.05);
    let start = run.balance();
    let (mut most, mut least) = (0.0_f64, 0.0_f64);
    for n in 1..=46 {
        run.step(0.05, &[]);
        let (h, factor) = (high + run.value("tip_uz"), run.value("load_factor"));
        assert!((h - (high - 0.005 * f64::from(n))).abs() < 1e-9, "the tip goes its way: {h}");
        assert!((factor - pressure(h)).abs() < 1e-6 * pressure(0.05), "{h}: {factor} {}", pressure(h));
        (most, least) = (most.max(factor), least.min(factor));
        // The work of a step is that of the mean of its ends: the rest is of second order in its length.
        let whole = 0.5 * stiffness * (0.5 * high * high / slope).powi(2);
        assert!((run.balance() - start).abs() < 3e-3 * whole, "{h}: {} of {whole} J", run.balance() - start);
    }
    // Limit points at h = high / sqrt 3 and below the base.
    let limit = pressure(high / 3.0_f64.sqrt());
    assert!(
        off(run.measure("limit_point_1"), limit) < 1e-4 && off(run.measure("limit_point_2"), -limit) < 1e-4
    );
    assert!(most > 0.95 * limit && least < -0.95 * limit);
}
