//! Statics by load steps that adapt.

use crate::common::{Run, coupled_plan, off};
use crate::loads::{oscillator, refused};
use crate::pressures::octant;
use interface_defs::Sampling;

/// A cantilever of 10 m, E I = 1000 N m2, under a load that grows to `load` on its tip in 1 s.
pub fn cantilever(load: f64, fem: &str) -> String {
    let nodes: Vec<_> = (0..=20).map(|i| [0.5 * f64::from(i), 0.0, 0.0]).collect();
    let cells: Vec<_> = (0..20).map(|i| [i, i + 1]).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
supports = [{{ nodes = [0], rotations = "xyz" }}]
loads = [{{ nodes = [20], force = [0.0, 0.0, {load:?}], history = [[0.0, 0.0], [1.0, 1.0]] }}]
[[structure.parts]]
name = "post"
element = "beam"
cells = {cells:?}
young = 1e7
area = 1.0
inertia = [1e-4, 1e-4]
density = 1.0
[fem]
integrator = "static"
{fem}
[[gauge]]
name = "tip"
at = [10.0, 0.0, 0.0]
quantity = "displacement"
"#
    )
}

#[test]
fn load_steps_that_adapt_bend_a_cantilever_to_its_elastica_at_any_output_interval() {
    // Mattiasson (1981), Int. J. Numer. Meth. Eng. 17, 145: at P L^2 / E I = 10 the tip has gone 0.81061 L across and
    // 0.55500 L along.
    let tip = |window: f64| {
        let text = cantilever(100.0, "load_steps = { first = 0.01 }");
        let mut run = Run::alone(&text, window);
        let count = (1.0 / window).round() as usize;
        (0..count).for_each(|_| run.step(window, &[]));
        (run.value("tip_uz"), run.value("tip_ux"), run.count("sub_steps"))
    };
    let (once, often) = (tip(1.0), tip(0.05));
    for (across, along, _) in [once, often] {
        // 20 chords of the curve: some 1e-3 too short.
        assert!(off(across, 8.1061) < 3e-3 && off(along, -5.55) < 3e-3, "{across} {along}");
    }
    assert!((once.0 - often.0).abs() < 1e-7, "{once:?} {often:?}");
    assert!(once.2 < 90 && often.2 < 90, "{once:?} {often:?}");
}

#[test]
fn where_one_step_fails_load_steps_that_adapt_come_to_the_end() {
    let pressures = "pressures = [{ group = \"skin\", pressure = 3e4, history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let text = |fem: &str| {
        let fem = format!("integrator = \"static\"\n{fem}");
        octant(6, "young = [1e8]\npoisson = 0.3", pressures, &fem)
    };
    let mut run = Run::with(&text(""), coupled_plan(1.0, Sampling::AtEnds, 1, 1));
    let fault = run.solve(1.0, &[]).expect_err("a slack balloon takes no such pressure at once");
    assert!(fault.diagnostic.message.contains("step 1 of 8"), "{}", fault.diagnostic.message);
    let growth = |window: f64| {
        let text = text("load_steps = { first = 0.1, shortest = 1e-6 }");
        let mut run = Run::with(&text, coupled_plan(window, Sampling::AtEnds, 1, 1));
        (0..(1.0 / window).round() as usize).for_each(|_| run.step(window, &[]));
        assert!(run.count("refused_steps") > 0);
        run.displacement(0)[0]
    };
    let (once, often) = (growth(1.0), growth(0.25));
    assert!(once > 0.08 && (once - often).abs() < 1e-7, "{once} {often}");
}

#[test]
fn load_steps_end_with_a_message_where_they_end() {
    // One iteration never does for what is not linear: every step fails, down to the shortest.
    let text =
        cantilever(100.0, "load_steps = { first = 0.01, shortest = 1e-3 }\n[fem.newton]\nmax_iterations = 1");
    let mut run = Run::alone(&text, 1.0);
    let fault = run.solve(1.0, &[]).expect_err("cannot be");
    for words in ["statics ends at t = 0", "after 1 iterations", "none below 1.000e-3 s", "fem.path_speed"] {
        assert!(fault.diagnostic.message.contains(words), "{}", fault.diagnostic.message);
    }
}

#[test]
fn load_steps_of_no_statics_are_refused() {
    let fem = "integrator = \"newmark\"\nload_steps = { first = 0.1 }";
    let message = refused(&cantilever(1.0, "").replace("integrator = \"static\"", fem));
    assert!(message.contains("belongs to the integrator static, not to newmark"), "{message}");
    assert!(refused(&cantilever(1.0, "load_steps = { first = 0.0 }")).contains("must lie above 0"));
    let message = refused(&cantilever(1.0, "load_steps = { first = 0.1, shortest = 0.2 }"));
    assert!(message.contains("longer than the first"), "{message}");
}

#[test]
fn load_steps_take_a_force_from_outside_as_one_step_does() {
    let text = |fem: &str| {
        oscillator("integrator = \"static\"", 1.0, "[[0.0, 0.0], [1.0, 1.0]]")
            .replace("[fem]", &format!("[fem]\n{fem}"))
    };
    for fem in ["", "load_steps = { first = 0.03 }"] {
        let mut run = Run::with(&text(fem), coupled_plan(0.5, Sampling::AtEnds, 2, 1));
        // 30 N after a quarter of a second, 50 after half of one: joined by straight lines, and so is the work.
        let force = [0.0, 0.0, 30.0, 0.0, 0.0, 50.0];
        run.step(0.5, &force);
        assert!((run.displacement(0)[2] - 1.0).abs() < 1e-9, "{fem}: {:?}", run.displacement(0));
        // u = F / k with F of both: in all k u^2 / 2 = 50 J.
        assert!((run.value("energy_stored_fem") - 50.0).abs() < 1e-7);
        assert!(run.balance().abs() < 1e-7, "{fem}: {}", run.balance());
    }
}
