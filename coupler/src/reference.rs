//! What this program reads of a scene and writes as results, for `rockfall schema`.

use crate::settings::CouplingSettings;
use toolkit::schema::{Entry, Share, Tables};

/// Its table and results.
pub fn share() -> Share {
    Tables::default().key::<CouplingSettings>("coupling").results(RESULTS).share()
}

const fn history(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("history.csv", name, unit, meaning)
}

const fn iteration(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("iterations.csv", name, unit, meaning)
}

const fn energy(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json: energy", name, unit, meaning)
}

const fn coupling(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json: coupling", name, unit, meaning)
}

const fn cost(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json: cost", name, unit, meaning)
}

const RESULTS: &[Entry] = &[
    history("time", "s", "end of the row's window"),
    history(
        "energy_imbalance",
        "J",
        "energy of the whole system that was made (above 0) or lost since the start",
    ),
    history(
        "energy_interface_defect",
        "J",
        "work on the structure minus work of the contact forces on the interface mesh",
    ),
    history("iterations", "1", "coupling iterations of the window"),
    history("residual", "1", "residual of the displacement at the accepted iteration [m]"),
    Entry::new(
        "summary.json",
        "energy_error",
        "1",
        "largest imbalance of the whole system's energy over the kinetic energy at impact",
    ),
    iteration("window", "1", "number of the window"),
    iteration("iteration", "1", "number of the iteration in it"),
    iteration("start", "s", "start of the window"),
    iteration("length", "s", "length of the window"),
    iteration("residual_displacement", "m", "residual of the displacement"),
    iteration("residual_velocity", "m", "residual of the velocity, times the window"),
    iteration(
        "increment",
        "m",
        "displacement of the interface mesh in the window, to which the residual is compared",
    ),
    iteration("factor", "1", "relaxation factor used"),
    iteration("seconds", "s", "wall time of the iteration"),
    energy("energy_error", "1", "the measure of that name"),
    energy("reference_J", "J", "energy to which `energy_error` relates: the kinetic one at impact"),
    energy(
        "kinetic_largest_J",
        "J",
        "one solver alone: largest kinetic energy at the end of a window; `max_kinetic_energy` is that of all steps",
    ),
    energy("imbalance_largest_J", "J", "largest imbalance of the energy of the whole system"),
    energy(
        "imbalance_contact_solver_J",
        "J",
        "part of the imbalance at the end that arose in the contact solver",
    ),
    energy("imbalance_structure_J", "J", "part that arose in the structural solver"),
    energy("imbalance_interface_J", "J", "part that arose between the two: the difference of the next two"),
    energy("interface_work_structure_J", "J", "work of the contact forces on the structure"),
    energy(
        "interface_work_mesh_J",
        "J",
        "work of the contact forces on the interface mesh as the contact solver moved it",
    ),
    energy("interface_defect_J", "J", "sum over the windows of the magnitude of that difference"),
    coupling("windows", "1", "committed windows"),
    coupling("iterations", "1", "coupling iterations of all windows"),
    coupling("iterations_per_window", "1", "their mean"),
    coupling("most_iterations", "1", "most iterations of one window"),
    coupling("windows_halved", "1", "windows that did not converge and were halved"),
    coupling(
        "windows_diverged",
        "1",
        "those of them that were given up before `max_iterations`: the residual grew, or stayed",
    ),
    coupling("windows_shortened", "1", "windows shorter than `coupling.time_window`"),
    coupling("windows_unconverged", "1", "windows accepted although they had not converged"),
    coupling("residual_largest_m", "m", "largest residual of an accepted window"),
    coupling(
        "selections",
        "1",
        "times that the nodes of the net that cross the interface were selected; with a yielding net",
    ),
    coupling(
        "residual_energy_share",
        "1",
        "interface residual as energy, the number that `limits.residual` bounds",
    ),
    cost("wall_s", "s", "wall time of the run"),
    cost(
        "stages",
        "s",
        "wall time of the preparation, `prepare_s`; of the time loop, `loop_s`, and of its parts before the first touch of the \
         structure, `flight_s`, and from there on, `impact_s`",
    ),
    cost("loop_s", "s", "wall time of the time loop"),
    cost("windows", "1", "committed windows"),
    cost("iterations", "1", "coupling iterations"),
    cost("exchanges", "1", "requests to both solvers together, each with its answer"),
    cost("exchange_microseconds", "us", "mean time of an exchange beside the computing of the solvers"),
    cost("peak_memory_bytes", "B", "largest memory of one process"),
    cost(
        "processes",
        "",
        "of each process `cpu_s` (processor time), `solve_s` (wall time inside the solver), `peak_memory_bytes` and `counts`",
    ),
    cost(
        "allocations_after_first_window",
        "1",
        "in `counts`: memory allocations from the end of the first window to that of the last",
    ),
];
