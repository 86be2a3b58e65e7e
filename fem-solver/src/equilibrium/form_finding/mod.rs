//! The state at t = 0: static equilibrium under the dead load.
//!
//! Newton from the structure as modelled. A net that is slack or without tension has no stiffness
//! across its plane there; it starts from a slightly sagged shape instead, the one that a soap
//! film of the same mesh would take (for a square net the sin-sin shape). Rings that are slack go slack
//! gradually at first ([`easing`]). What Newton does not bring to rest then falls and swings until it does ([`kinetic`]).

pub mod easing;
pub mod kinetic;

use crate::config::NewtonConfig;
use crate::config::structure::FormFinding;
use crate::element::{AnyElement, Cable, Slack};
use crate::equilibrium::form_finding::kinetic::{MOST_STEPS, Swing};
use crate::equilibrium::newton::{Failure, Info, Newton, OnIteration, Problem};
use crate::internal_force::Displacements;
use crate::internal_force::assembly::Assembly;
use crate::model::Model;
use crate::model::pressure::press;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Depth of the sagged start, relative to the extent of the structure.
const START_SAG: f64 = 1e-3;
/// Residual, relative to the forces: the level of rounding.
const TOLERANCE: f64 = 1e-12;
/// Most iterations where the scene does not say: from the structure as modelled, from a peak of the kinetic energy, and
/// with friction of ropes.
const MOST: (u32, u32, u32) = (200, 12, 60);
/// Peaks after which a form that is not stable is taken: nothing but a mechanism, which no force moves, is left.
const PATIENCE: usize = 3;
/// Most steps of dynamic relaxation; Newton goes on from wherever it is then.
const MOST_RELAXING: usize = 20_000;
/// Residual, relative to the support forces, at which Newton takes over.
const RELAXED: f64 = 1e-4;
/// Steps after which the masses of dynamic relaxation are taken anew at the next peak.
const RETAKEN: usize = 50;

/// Iterations times free degrees of freedom after which a structure that swings is given up, and iterations that it has at least: 10 s of
/// a processor of 2.5 GHz. A number of iterations, and no time, so that the answer does not depend on the machine.
const MOST_WORK: (u64, u64) = (28_000_000, 800);
/// Turn of a beam from which on it has fallen, and in a search that ends without a rest shape is about to [degrees].
const FALLEN: f64 = 30.0;
const FALLS: f64 = 5.0;
/// Nodes of a rope with friction, whose tangent couples each with each and cannot be taken in pieces, up to which a form is looked for
/// with its friction: three fields of 30 rings have 96.
const MOST_COUPLED: usize = 128;

/// A structure in equilibrium.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Form {
    /// Displacement from the structure as modelled [m].
    pub displacement: Vec<f64>,
    /// History of the elements there.
    pub history: Vec<f64>,
    /// Whether friction of ropes was left out, because with it no form was found.
    pub smoothed: bool,
}

/// Where a structure that has been through something begins.
#[derive(Debug, Clone, Copy)]
pub struct Basis<'a> {
    /// Displacement from the structure as modelled [m].
    pub displacement: &'a [f64],
    /// History of the elements.
    pub history: &'a [f64],
}

/// What form is wanted, and how it is looked for.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// The structure.
    pub model: &'a Model,
    /// Where Newton begins.
    pub method: FormFinding,
    /// Most Newton iterations of each approach; by default as many as it makes sense.
    pub most: Option<u32>,
    /// What the structure has been through. What its elements remember of it is theirs in the equilibrium, too.
    pub basis: Option<Basis<'a>>,
}

impl Wanted<'_> {
    /// The structure as modelled, or as it was left.
    pub fn as_it_is(&self) -> Form {
        let Self { model, basis, .. } = self;
        let (mut displacement, history) = match basis {
            Some(basis) => (basis.displacement.to_vec(), basis.history.to_vec()),
            None => (vec![0.0; model.dof_count()], model.start_history()),
        };
        model.prescribe_first(&mut displacement);
        Form { displacement, history, smoothed: false }
    }
}

/// A search for a rest shape: Newton's iteration, and what was done so far.
pub struct Search<'a> {
    /// What is looked for.
    pub wanted: Wanted<'a>,
    /// The iteration.
    pub newton: &'a mut Newton,
    /// What it took.
    pub done: Info,
    on_iteration: OnIteration<'a>,
}

impl Search<'_> {
    /// [`Newton::solve`] as one part of the search, to a residual of the first of `limits` relative to the forces in at most as
    /// many iterations as the second.
    pub fn solve(&mut self, problem: &Problem, limits: (f64, u32), u: &mut [f64]) -> Result<Info, Failure> {
        let settings = NewtonConfig {
            tolerance: limits.0,
            floor: 0.0,
            max_iterations: Some(limits.1),
            line_search: true,
        };
        let done = &mut self.done.iterations;
        let outcome = self.newton.solve(problem, &settings, u, &mut |_, residual| {
            *done += 1;
            (self.on_iteration)(*done, residual)
        });
        self.done.factorisations += outcome.as_ref().map_or(0, |info| info.factorisations);
        outcome
    }

    /// The same where the last iteration may still move, as in what is only a stage of the search.
    pub fn solve_stage(
        &mut self,
        problem: &Problem,
        limits: (f64, u32),
        u: &mut [f64],
    ) -> Result<Info, Failure> {
        self.newton.limits_travel = false;
        let outcome = self.solve(problem, limits, u);
        self.newton.limits_travel = true;
        outcome
    }

    /// Equilibrium under the dead load by Newton from `u`, and the history there.
    fn balanced(&mut self, u: &[f64], history: &[f64], most: u32) -> Result<Form, Failure> {
        let model = self.wanted.model;
        let (zero, pressures) = (vec![0.0; u.len()], model.pressures_at_start());
        let mut form = Form { displacement: u.to_vec(), history: history.to_vec(), smoothed: false };
        let problem = Problem::of_rest(model, &zero, history, &pressures);
        let info = self.solve(&problem, (TOLERANCE, most), &mut form.displacement)?;
        let elements = &mut self.newton.internal.elements;
        elements.advance(&model.elements, &form.displacement, &mut form.history);
        if let Some(broken) = elements.broken.first() {
            let (element, tension) = (broken.element as usize, broken.tension);
            return Err(Failure::Broken { element, tension, part: 1.0 });
        }
        self.done.unstable = info.unstable;
        self.done.shifted_at = self.done.shifted_at.or(info.shifted_at);
        Ok(form)
    }

    /// The same; none where Newton does not come to it.
    fn tried(&mut self, u: &[f64], history: &[f64], most: u32) -> Result<Option<Form>, Failure> {
        match self.balanced(u, history, most) {
            Err(Failure::NotConverged { .. } | Failure::Unstable { .. }) => Ok(None),
            outcome => outcome.map(Some),
        }
    }
}

/// Displacements [m] of static equilibrium under the dead load, moving supports at their place at
/// t = 0, and what it took.
///
/// Ropes with friction have many forms; where Newton does not come to one at once, or they are long, they hang as they would without it,
/// with the same tension in every segment: a form that friction holds, too.
pub fn find_form(
    wanted: Wanted,
    newton: &mut Newton,
    on_iteration: OnIteration,
) -> Result<(Form, Info), Failure> {
    let Wanted { model, most, basis, .. } = wanted;
    if !model.elements.iter().any(|element| element.frictionless().is_some()) {
        return find(wanted, newton, on_iteration);
    }
    let is_long =
        |element: &AnyElement| element.frictionless().is_some() && element.nodes().len() > MOST_COUPLED;
    if !model.elements.iter().any(is_long) {
        let mut start = Approach::new(wanted, newton, on_iteration);
        if let Some(form) = start.by_newton(most.unwrap_or(MOST.2))? {
            return Ok((form, start.search.done));
        }
    }
    let mut smooth = model.clone();
    for element in &mut smooth.elements {
        if let Some(without) = element.frictionless() {
            *element = without;
        }
    }
    let history = basis.map_or(Vec::new(), |basis| frictionless_history(model, basis.history));
    let basis = basis.map(|basis| Basis { history: &history, ..basis });
    let wanted = Wanted { model: &smooth, basis, ..wanted };
    let (mut form, info) = find(wanted, &mut Newton::new(&smooth), on_iteration)?;
    let mut assembly = Assembly::new(&smooth);
    let histories = model.elements.iter().enumerate().map(|(i, element)| {
        let own = assembly.history(i, &form.history);
        element.relaxed_history(assembly.gather(i, &form.displacement), own)
    });
    form.history = histories.flatten().collect();
    form.smoothed = true;
    Ok((form, info))
}

/// What of `history` a structure has whose ropes are without friction.
fn frictionless_history(model: &Model, history: &[f64]) -> Vec<f64> {
    let assembly = Assembly::new(model);
    let elements = model.elements.iter().enumerate();
    let own = elements.map(|(i, element)| element.frictionless_history(assembly.history(i, history)));
    own.flatten().copied().collect()
}

/// The same where no rope has friction.
fn find(wanted: Wanted, newton: &mut Newton, on_iteration: OnIteration) -> Result<(Form, Info), Failure> {
    let mut start = Approach::new(wanted, newton, on_iteration);
    let mut form = start.by_newton(wanted.most.unwrap_or(MOST.0))?;
    // A net as modelled falls far, and is no nearer to its rest shape so: that would cost it half as many iterations again.
    if form.is_none() && wanted.basis.is_some() {
        form = start.eased()?;
    }
    let form = form.map_or_else(|| start.swinging(), Ok)?;
    Ok((form, start.search.done))
}

/// Where an approach begins.
struct Approach<'a> {
    search: Search<'a>,
    u: Vec<f64>,
    /// The same where Newton begins, which needs stiffness in every direction.
    sagged: Vec<f64>,
    history: Vec<f64>,
}

impl<'a> Approach<'a> {
    fn new(wanted: Wanted<'a>, newton: &'a mut Newton, on_iteration: OnIteration<'a>) -> Self {
        let Wanted { model, method, basis, .. } = wanted;
        let Form { displacement: mut u, mut history, .. } = wanted.as_it_is();
        let (mut done, mut sagged) = (Info::default(), Vec::new());
        if !newton.tangent.dofs.is_empty() {
            match method {
                // Its force densities as modelled are not those of a structure that has been through something.
                FormFinding::ForceDensity if basis.is_none() => keep_force_densities(model, newton, &mut u),
                FormFinding::DynamicRelaxation => relax(model, newton, &mut history, &mut u),
                _ => {}
            }
            newton.tangent.assemble(model, &u, &history, 1.0, Slack::Exact);
            done.factorisations += 1;
            sagged.clone_from(&u);
            if newton.tangent.factorise().is_err() {
                sag(model, newton, &mut sagged);
                done.factorisations += 1;
            }
        }
        Self { search: Search { wanted, newton, done, on_iteration }, u, sagged, history }
    }

    /// By Newton alone; none where it does not come to a rest shape.
    fn by_newton(&mut self, most: u32) -> Result<Option<Form>, Failure> {
        if self.search.newton.tangent.dofs.is_empty() {
            let (displacement, history) = (self.u.clone(), self.history.clone());
            return Ok(Some(Form { displacement, history, smoothed: false }));
        }
        self.search.tried(&self.sagged, &self.history, most)
    }

    /// Most iterations from near by.
    fn most(&self) -> u32 {
        self.search.wanted.most.unwrap_or(MOST.1)
    }

    /// By Newton with rings that go slack gradually; none where there are no rings, or where that does not end in a stable rest shape.
    fn eased(&mut self) -> Result<Option<Form>, Failure> {
        let (mut u, mut history) = (self.u.clone(), self.history.clone());
        if !easing::approach(&mut self.search, &mut u, &mut history)? {
            return Ok(None);
        }
        let form = self.search.tried(&u, &history, self.most())?;
        Ok(form.filter(|_| self.search.done.unstable.is_none()))
    }

    /// Falling and swinging, by Newton from each peak of the kinetic energy.
    fn swinging(&mut self) -> Result<Form, Failure> {
        self.swung().map_err(|why| match most_turned(self.search.wanted.model, &self.u, FALLS) {
            _ if matches!(why, Failure::Stopped(_)) => why,
            Some((element, angle)) => Failure::Falls { element, angle, why: Box::new(why) },
            None => why,
        })
    }

    fn swung(&mut self) -> Result<Form, Failure> {
        let most_iterations =
            (MOST_WORK.0 / self.search.newton.tangent.dofs.len().max(1) as u64).max(MOST_WORK.1);
        let most = self.most();
        let Self { search, u, history, .. } = self;
        let (mut swing, mut unstable) = (Swing::new(search.wanted.model), 0);
        for _ in 0..MOST_STEPS {
            let peak = swing.advance(search, u, history)?;
            if search.done.iterations > most_iterations {
                break;
            }
            if !peak {
                continue;
            }
            if let Some(form) = search.tried(u, history, most)? {
                // A post on its tip is in balance, too: it falls on.
                if search.done.unstable.is_none() || unstable >= PATIENCE {
                    return Ok(form);
                }
                unstable += 1;
            }
            swing.stop();
        }
        Err(swing.moves())
    }
}

/// The beam that stands most elsewhere than it was modelled, and by how many degrees; none where that is little. A post that fell over is
/// a shape at rest, too.
pub fn fallen(model: &Model, u: &[f64]) -> Option<(usize, f64)> {
    most_turned(model, u, FALLEN)
}

fn most_turned(model: &Model, u: &[f64], least: f64) -> Option<(usize, f64)> {
    let turned = |element: &AnyElement| {
        let nodes = element.nodes();
        let (first, last) = (*nodes.first()?, *nodes.last()?);
        let span = model.nodes[last] - model.nodes[first];
        let moved = model.vector(u, last) - model.vector(u, first);
        element.constants().has_moments.then(|| span.angle(&(span + moved)).to_degrees())
    };
    let all =
        model.elements.iter().enumerate().filter_map(|(number, element)| Some((number, turned(element)?)));
    all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, angle)| *angle > least)
}

/// Move `u` to where every cable keeps its force per length `q_0` as modelled: `sum q_0 (x_j - x_i) = -p`, one linear
/// system. Nothing happens where that has no solution.
///
/// Source: Schek (1974), CMAME 3, 115.
fn keep_force_densities(model: &Model, newton: &mut Newton, u: &mut [f64]) {
    let density = |cable: &Cable| cable.initial_pull_per_length().max(0.0);
    let mut force = model.load_at_start(u);
    for cable in &model.cables {
        let pull = density(cable) * (cable.span + model.relative(u, cable));
        for c in 0..3 {
            force[model.dof(cable.nodes[0], c)] += pull[c];
            force[model.dof(cable.nodes[1], c)] -= pull[c];
        }
    }
    if let Some(shape) = film(model, newton, u, density, &force) {
        newton.tangent.dofs.iter().zip(&shape).for_each(|(dof, w)| u[*dof] += w);
    }
}

/// Displacements of the free degrees of freedom under `force` [N] where cables are as stiff as that [N/m] in every direction, and
/// the other elements soap films; none where nothing holds some of them.
fn film(
    model: &Model,
    newton: &mut Newton,
    u: &[f64],
    stiffness: impl Fn(&Cable) -> f64,
    force: &[f64],
) -> Option<Vec<f64>> {
    let tangent = &mut newton.tangent;
    tangent.assemble_blocks(model, 1.0, |cable| Matrix3::from_diagonal_element(stiffness(cable)));
    tangent.add_film(model, u, &model.start_history(), START_SAG);
    tangent.factorise().ok()?;
    let mut shape = vec![0.0; tangent.dofs.len()];
    tangent.gather(force, &mut shape);
    tangent.matrix.solve(&mut shape);
    Some(shape)
}

/// Let `u` swing towards equilibrium with masses of one's own choosing, stopped at every peak of the kinetic energy.
///
/// Steps of length 1 with `m_a = sum_b |K_ab| / 2`, half of what Gershgorin's circles ask for at the structure's
/// stiffness when all is taut; what stiffens beyond is noticed by forces that grow, and the masses are taken anew.
///
/// Source: Cundall (1976), Explicit finite-difference methods in geomechanics.
fn relax(model: &Model, newton: &mut Newton, history: &mut [f64], u: &mut [f64]) {
    let pressures = model.pressures_at_start();
    let n = u.len();
    let free: Vec<bool> = model.held.iter().map(|held| !held).collect();
    let (mut velocity, mut force) = (vec![0.0; n], vec![0.0; n]);
    let mut mass = fictitious_masses(model, newton, history, u);
    let (mut energy, mut since) = (0.0, 0);
    for _ in 0..MOST_RELAXING {
        force.copy_from_slice(&model.dead_load);
        press(&model.timed, &pressures, u, &mut force);
        newton.internal.subtract(model, Displacements::At(u), history, &mut force);
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
        newton.internal.elements.advance_rotations(&model.elements, u, history);
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
    let stiffness = |cable: &Cable| START_SAG * cable.axial_stiffness();
    // Else something is connected to no support: Newton says what, with a shifted tangent.
    let Some(shape) = film(model, newton, u, stiffness, &model.load_at_start(u)) else { return };
    let depth = shape.iter().fold(0.0, |a, b| f64::max(a, b.abs()));
    if depth > 0.0 {
        let factor = START_SAG * model.extent() / depth;
        newton.tangent.dofs.iter().zip(&shape).for_each(|(dof, w)| u[*dof] += factor * w);
    }
}
