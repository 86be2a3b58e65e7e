//! What this program reads of a scene and writes as results, for `rockfall schema`.

use crate::settings::CouplingSettings;
use toolkit::schema::{Entry, Share, Tables};

/// Its table and results.
pub fn share() -> Share {
    Tables::default().key::<CouplingSettings>("coupling").results(&Entry::table(RESULTS)).share()
}

/// As [`Entry::table`] reads it.
const RESULTS: &str = "
history.csv
    time | s | end of the row's window
    contact_force_x | N | force of the rocks on the structure, x, mean over the row's time
    contact_force_y | N | the same, y
    contact_force_z | N | the same, z
    energy_imbalance | J | energy of the whole system that was made (above 0) or lost since the start
    energy_interface_defect | J | work on the structure minus work of the contact forces on the interface mesh
    iterations | 1 | coupling iterations of the window
    residual | 1 | residual of the displacement at the accepted iteration [m]
summary.json
    energy_error | 1 | largest imbalance of the whole system's energy over the kinetic energy at impact
iterations.csv
    window | 1 | number of the window
    iteration | 1 | number of the iteration in it
    start | s | start of the window
    length | s | length of the window
    residual_displacement | m | residual of the displacement
    residual_velocity | m | residual of the velocity, times the window
    increment | m | displacement of the interface mesh in the window, to which the residual is compared
    factor | 1 | relaxation factor used
    seconds | s | wall time of the iteration
summary.json: energy
    energy_error | 1 | the measure of that name
    reference_J | J | energy to which `energy_error` relates: the kinetic one at impact
    kinetic_largest_J | J | one solver alone: largest kinetic energy at the end of a window; `max_kinetic_energy` is that of all steps
    imbalance_largest_J | J | largest imbalance of the energy of the whole system
    imbalance_contact_solver_J | J | part of the imbalance at the end that arose in the contact solver
    imbalance_structure_J | J | part that arose in the structural solver
    imbalance_interface_J | J | part that arose between the two: the difference of the next two
    interface_work_structure_J | J | work of the contact forces on the structure
    interface_work_mesh_J | J | work of the contact forces on the interface mesh as the contact solver moved it
    interface_defect_J | J | sum over the windows of the magnitude of that difference
summary.json: coupling
    windows | 1 | committed windows
    iterations | 1 | coupling iterations of all windows
    iterations_per_window | 1 | their mean
    most_iterations | 1 | most iterations of one window
    windows_halved | 1 | windows that did not converge and were halved
    windows_diverged | 1 | those of them that were given up before `max_iterations`: the residual grew, or stayed
    windows_shortened | 1 | windows shorter than `coupling.time_window`
    windows_unconverged | 1 | windows accepted although they had not converged
    residual_largest_m | m | largest residual of an accepted window
    selections | 1 | times that the nodes of the net that cross the interface were selected; with a yielding net
    residual_energy_share | 1 | interface residual as energy, the number that `limits.residual` bounds
summary.json: cost
    wall_s | s | wall time of the run
    stages | s | wall time of the preparation, `prepare_s`; of the time loop, `loop_s`, and of its parts before the first touch of the structure, `flight_s`, and from there on, `impact_s`
    loop_s | s | wall time of the time loop
    windows | 1 | committed windows
    iterations | 1 | coupling iterations
    exchanges | 1 | requests to both solvers together, each with its answer
    exchange_microseconds | us | mean time of an exchange beside the computing of the solvers
    peak_memory_bytes | B | largest memory of one process
    processes |  | of each process `cpu_s` (processor time), `solve_s` (wall time inside the solver), `peak_memory_bytes` and `counts`
    allocations_after_first_window | 1 | in `counts`: memory allocations from the end of the first window to that of the last
";
