//! The state at t = 0: static equilibrium under the dead load.
//!
//! Newton from the structure as modelled. A net that is slack or without tension has no stiffness
//! across its plane there; it starts from a slightly sagged shape instead, the one that a soap
//! film of the same mesh would take (for a square net the sin-sin shape). What does not converge
//! under the whole load is loaded in steps.

use crate::assembly::Assembly;
use crate::config::NewtonConfig;
use crate::config::structure::FormFinding;
use crate::element::{AnyElement, Cable};
use crate::kernel::Kernel;
use crate::model::Model;
use crate::newton::{Failure, Info, Newton, OnIteration, Problem, spring_dofs};
use crate::tangent::Slack;
use nalgebra::Matrix3;

/// Depth of the sagged start, relative to the extent of the structure.
const START_SAG: f64 = 1e-3;
/// Settings of the iteration: the residual must lie at the level of rounding.
const SETTINGS: NewtonConfig = NewtonConfig { tolerance: 1e-12, max_iterations: 200, line_search: true };
/// Most steps of dynamic relaxation; Newton goes on from wherever it is then.
const MOST_RELAXING: usize = 20_000;
/// Residual, relative to the support forces, at which Newton takes over.
const RELAXED: f64 = 1e-4;
/// Steps after which the masses of dynamic relaxation are taken anew at the next peak.
const RETAKEN: usize = 50;
/// Most load steps before it gives up.
const MOST_STEPS: u32 = 32;

/// A structure in equilibrium.
#[derive(Debug, Clone)]
pub struct Form {
    /// Displacement from the structure as modelled [m].
    pub displacement: Vec<f64>,
    /// History of the elements there.
    pub history: Vec<f64>,
    /// Whether friction of ropes was left out, because with it no form was found.
    pub smoothed: bool,
}

/// Displacements [m] of static equilibrium under the dead load, moving supports at their place at
/// t = 0, and what it took.
///
/// Ropes with friction have many forms; where Newton does not come to one at once, they hang as they would without it,
/// with the same tension in every segment: a form that friction holds, too.
pub fn find_form(
    model: &Model,
    newton: &mut Newton,
    way: FormFinding,
    on_iteration: OnIteration,
) -> Result<(Form, Info), Failure> {
    let rough = |e: &AnyElement| matches!(e, AnyElement::SlidingCable(rope) if rope.friction > 0.0);
    if !model.elements.iter().any(rough) {
        return find(model, newton, way, MOST_STEPS, on_iteration);
    }
    match find(model, newton, way, 1, on_iteration) {
        Err(Failure::NotConverged { .. } | Failure::Unstable { .. }) => {}
        done => return done,
    }
    let mut smooth = model.clone();
    for element in &mut smooth.elements {
        if let AnyElement::SlidingCable(rope) = element {
            *rope = rope.smooth();
        }
    }
    let (mut form, info) = find(&smooth, &mut Newton::new(&smooth), way, MOST_STEPS, on_iteration)?;
    let mut assembly = Assembly::new(&smooth);
    let histories = model.elements.iter().enumerate().map(|(i, element)| match element {
        AnyElement::SlidingCable(rope) => rope.hung(assembly.gather(i, &form.displacement)),
        _ => assembly.history(i, &form.history).to_vec(),
    });
    form.history = histories.flatten().collect();
    form.smoothed = true;
    Ok((form, info))
}

/// The same by `most` load steps at most.
fn find(
    model: &Model,
    newton: &mut Newton,
    way: FormFinding,
    most: u32,
    on_iteration: OnIteration,
) -> Result<(Form, Info), Failure> {
    let mut start = vec![0.0; model.dof_count()];
    let history = model.start_history();
    let mut assembly = Assembly::new(model);
    model.prescribe(0.0, &mut start);
    let mut done = Info::default();
    if newton.tangent.is_empty() {
        return Ok((Form { displacement: start, history, smoothed: false }, done));
    }
    match way {
        FormFinding::ForceDensity => keep_force_densities(model, newton, &mut start),
        FormFinding::DynamicRelaxation => relax(model, newton, &history, &mut start),
        FormFinding::Static | FormFinding::None => {}
    }
    newton.tangent.assemble(model, &start, &history, 1.0, Slack::Exact);
    done.factorisations += 1;
    if newton.tangent.factorise().is_err() {
        sag(model, newton, &mut start);
        done.factorisations += 1;
    }
    let mut steps = 1;
    loop {
        let mut form = Form { displacement: start.clone(), history: history.clone(), smoothed: false };
        match loaded(model, newton, &mut assembly, steps, &mut form, &mut done, on_iteration) {
            Ok(()) => return Ok((form, done)),
            Err(failure @ (Failure::Stopped(_) | Failure::Broken { .. })) => return Err(failure),
            Err(failure) if steps >= most => return Err(failure),
            Err(_) => steps *= 2,
        }
    }
}

/// Equilibrium in `steps` steps of the load.
fn loaded(
    model: &Model,
    newton: &mut Newton,
    assembly: &mut Assembly,
    steps: u32,
    form: &mut Form,
    done: &mut Info,
    on_iteration: OnIteration,
) -> Result<(), Failure> {
    let zero = vec![0.0; form.displacement.len()];
    for step in 1..=steps {
        let part = f64::from(step) / f64::from(steps);
        let load: Vec<f64> = model.dead_load.iter().map(|p| part * p).collect();
        let problem = Problem {
            load: &load,
            start: &zero,
            inertia: 0.0,
            share: 1.0,
            mean_stress: false,
            history: &form.history,
            viscosity: (&[], 0.0),
        };
        let mut before = done.iterations;
        let info = newton.solve(model, &problem, &SETTINGS, &mut form.displacement, &mut |_, residual| {
            before += 1;
            on_iteration(before, residual)
        })?;
        assembly.settle(&model.elements, &form.displacement, &mut form.history);
        if let Some((element, tension)) = assembly.broken().first() {
            return Err(Failure::Broken { element: *element as usize, tension: *tension, part });
        }
        done.iterations += info.iterations;
        done.factorisations += info.factorisations;
        done.unstable = info.unstable;
        done.shifted_at = done.shifted_at.or(info.shifted_at);
    }
    Ok(())
}

/// Move `u` to where every cable keeps its force per length `q_0` as modelled: `sum q_0 (x_j - x_i) = -p`, one linear
/// system. Nothing happens where that has no solution.
///
/// Source: Schek (1974), CMAME 3, 115.
fn keep_force_densities(model: &Model, newton: &mut Newton, u: &mut [f64]) {
    let density = |cable: &Cable| cable.initial_pull_per_length().max(0.0);
    newton.tangent.assemble_blocks(model, 1.0, |cable| Matrix3::from_diagonal_element(density(cable)));
    newton.tangent.add_film(model, u, &model.start_history(), START_SAG);
    if newton.tangent.factorise().is_err() {
        return;
    }
    let mut force = model.dead_load.clone();
    for cable in &model.cables {
        let pull = density(cable) * (cable.span + model.relative(u, cable));
        for c in 0..3 {
            force[model.dof(cable.nodes[0], c)] += pull[c];
            force[model.dof(cable.nodes[1], c)] -= pull[c];
        }
    }
    let dofs = newton.tangent.dofs().to_vec();
    let mut shape: Vec<f64> = dofs.iter().map(|dof| force[*dof]).collect();
    newton.tangent.solve(&mut shape);
    dofs.iter().zip(&shape).for_each(|(dof, w)| u[*dof] += w);
}

/// Let `u` swing towards equilibrium with masses of one's own choosing, stopped at every peak of the kinetic energy.
///
/// Steps of length 1 with `m_a = sum_b |K_ab| / 2`, half of what Gershgorin's circles ask for at the structure's
/// stiffness when all is taut; what stiffens beyond is noticed by forces that grow, and the masses are taken anew.
///
/// Source: Cundall (1976), Explicit finite-difference methods in geomechanics; handbook 2.8.
fn relax(model: &Model, newton: &mut Newton, history: &[f64], u: &mut [f64]) {
    let mut kernel = Kernel::new(&model.cables, model.node_count());
    let mut assembly = Assembly::new(model);
    let springs = spring_dofs(model);
    let n = u.len();
    let free: Vec<bool> = model.held.iter().map(|held| !held).collect();
    let (mut velocity, mut force) = (vec![0.0; n], vec![0.0; n]);
    let mut mass = fictitious_masses(model, newton, history, u);
    let (mut energy, mut since) = (0.0, 0);
    for _ in 0..MOST_RELAXING {
        force.copy_from_slice(&model.dead_load);
        kernel.pull(u, &mut force);
        assembly.pull(&model.elements, u, history, &mut force);
        springs.iter().for_each(|(dof, k)| force[*dof] -= k * u[*dof]);
        let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
        let residual = norm(&mut (0..n).filter(|i| free[*i]).map(|i| force[i]));
        let held = norm(&mut (0..n).filter(|i| !free[*i]).map(|i| force[i]));
        if residual <= RELAXED * held.max(f64::MIN_POSITIVE) {
            return;
        }
        let before = energy;
        energy = 0.0;
        for i in (0..n).filter(|i| free[*i] && mass[*i] > 0.0) {
            velocity[i] += 2.0 * force[i] / mass[i];
            energy += 0.5 * mass[i] * velocity[i] * velocity[i];
        }
        since += 1;
        if energy < before || !energy.is_finite() {
            velocity.fill(0.0);
            energy = 0.0;
            if since > RETAKEN {
                mass = fictitious_masses(model, newton, history, u);
                since = 0;
            }
            continue;
        }
        u.iter_mut().zip(&velocity).for_each(|(u, v)| *u += v);
    }
}

/// A bound of the stiffness of each degree of freedom, the same in all directions of a node: what is soft across a cable
/// becomes stiff as the cable turns.
fn fictitious_masses(model: &Model, newton: &mut Newton, history: &[f64], u: &[f64]) -> Vec<f64> {
    let mut sums = newton.tangent.row_sums(model, u, history);
    for node in 0..model.node_count() {
        let dofs = [0, 1, 2].map(|c| model.dof(node, c));
        let most = dofs.iter().map(|dof| sums[*dof]).fold(0.0, f64::max);
        dofs.iter().for_each(|dof| sums[*dof] = most);
    }
    sums
}

/// Add the shape of a soap film under the dead load, [`START_SAG`] deep.
fn sag(model: &Model, newton: &mut Newton, u: &mut [f64]) {
    newton.tangent.assemble_blocks(model, 1.0, |cable| {
        Matrix3::from_diagonal_element(START_SAG * cable.axial_stiffness())
    });
    newton.tangent.add_film(model, u, &model.start_history(), START_SAG);
    if newton.tangent.factorise().is_err() {
        // Something is connected to no support: Newton says what, with a shifted tangent.
        return;
    }
    let dofs = newton.tangent.dofs().to_vec();
    let mut shape: Vec<f64> = dofs.iter().map(|dof| model.dead_load[*dof]).collect();
    newton.tangent.solve(&mut shape);
    let depth = shape.iter().fold(0.0, |a, b| f64::max(a, b.abs()));
    if depth > 0.0 {
        let factor = START_SAG * model.extent() / depth;
        dofs.iter().zip(&shape).for_each(|(dof, w)| u[*dof] += factor * w);
    }
}
