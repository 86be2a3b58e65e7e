//! A structure that is kept and goes on answers to the last bit as one that was never stopped, whatever its scheme.

use crate::common::{Run, WALENSTADT, solver};
use crate::curves::{ARCH, arch, lee, panel, toggle};
use crate::load_steps::cantilever;
use interface_defs::diagnostic::code;
use interface_defs::message::{Fault, Plan};
use interface_defs::solver::Solver;

/// `count` windows of `length` [s]; kept and gone on with by another solver before each of the windows in `stops`.
fn answers(text: &str, length: f64, count: usize, stops: &[usize]) -> Vec<Vec<u64>> {
    let mut run = Run::alone(text, length);
    let window = |number: usize| {
        if stops.contains(&number) {
            let state = run.solver.save().expect("it keeps its state");
            let mut next = solver(text);
            next.resume(&state).expect("its own state");
            let (time, number) = (run.time, run.number);
            run = Run::of(next, Plan { end_time: 1.0, window: length, ..Plan::default() });
            (run.time, run.number) = (time, number);
        }
        run.step(length, &[]);
        run.output.iter().map(|x| x.to_bits()).collect()
    };
    (0..count).map(window).collect()
}

fn goes_on(what: &str, text: &str, length: f64, count: usize) {
    let whole = answers(text, length, count, &[]);
    let stopped = answers(text, length, count, &[1, count / 3, count / 2, count - 1]);
    let first = whole.iter().zip(&stopped).position(|(a, b)| a != b);
    if let Some(i) = first {
        for (j, (a, b)) in whole[i].iter().zip(&stopped[i]).enumerate().filter(|(_, (a, b))| a != b) {
            println!("{j} of {}: {:e} {:e}", whole[i].len(), f64::from_bits(*a), f64::from_bits(*b));
        }
    }
    assert_eq!(first, None, "{what}: windows of {count} differ from this one on");
    let moved = whole.first() != whole.last();
    assert!(moved, "{what}: nothing has happened");
}

#[test]
fn along_paths_of_equilibrium() {
    goes_on("Lee's frame, through limits and turns", &lee(2).text(1.0), 0.02, 60);
    goes_on("a toggle", &toggle(4).text(1.0), 0.02, 20);
    goes_on("a shell", &panel(2, 12.7, 20.0), 0.02, 20);
    // Onto the branch: half of the span over half of the windows.
    let turns = "path_at_branch = \"turn\"\n[[gauge]]";
    goes_on("an arch that turns aside", &arch(12).text(0.2 * ARCH[1]).replace("[[gauge]]", turns), 0.5, 40);
}

#[test]
fn in_load_steps_that_adapt() {
    goes_on("a cantilever", &cantilever(100.0, "load_steps = { first = 0.01 }"), 0.05, 20);
}

#[test]
fn in_dynamics_of_every_scheme() {
    for scheme in ["central_difference", "generalized_alpha", "bossak", "newmark", "static"] {
        let step = if scheme == "static" { "" } else { "time_step = 1e-4\n" };
        let load = "\n[[structure.loads]]\nnodes = [300]\nforce = [3.0, 0.0, -400.0]\nhistory = [[0.0, 0.0], [0.01, 1.0]]\n";
        let fem = format!("{load}[fem]\nintegrator = \"{scheme}\"\n{step}");
        goes_on(scheme, &format!("{WALENSTADT}{fem}"), 1e-3, 12);
    }
}

#[test]
fn what_another_structure_has_kept_is_refused() {
    let fem = |scheme: &str| format!("{WALENSTADT}[fem]\nintegrator = \"{scheme}\"\ntime_step = 1e-4\n");
    let state = Run::alone(&fem("newmark"), 1e-3).solver.save().expect("it keeps its state");
    let refused = |fault: Fault| assert_eq!(fault.diagnostic.code, code::PROVENANCE, "{fault}");
    let smaller = fem("newmark").replace("[26, 26]", "[25, 26]");
    refused(solver(&smaller).resume(&state).expect_err("other nodes"));
    // One gauge more, which the answers that were kept do not have.
    let gauge = "[[gauge]]\nname = \"mid\"\nat = [0.0, 0.0, 0.0]\nquantity = \"displacement\"\n";
    let mut other = solver(&(fem("newmark") + gauge));
    other.resume(&state).expect("the same nodes");
    let plan = Plan { end_time: 1.0, window: 1e-3, ..Plan::default() };
    refused(other.prepare(&plan, &mut |_| Ok(())).expect_err("other gauges"));
    assert!(solver(&fem("newmark")).resume(&state[..state.len() / 2]).is_err());
}
