//! Newton iteration with line search: one for statics and for every implicit step.
//!
//! Solves `r(u) = p - k_M M (u - u_0) - f_int(u_0 + s (u - u_0)) = 0` for the free degrees of
//! freedom. Here `p` is load less what is known of inertia and damping, `k_M` the inertia of the scheme
//! (0 in statics) and `s = 1 - alpha_f` the share of the step at which forces balance. The midpoint
//! rule takes the mean stress of the step in place of the stress in its middle, so that it stores
//! exactly the work that it does ([`Displacements::Step`]); the tangent stays that of the middle.

use crate::config::NewtonConfig;
use crate::element::Slack;
use crate::internal_force::tangent::Tangent;
use crate::internal_force::{Displacements, InternalForce};
use crate::linear_algebra::lanes::{inner, norm};
use crate::model::Model;
use crate::model::pressure::press;
use interface_defs::message::Fault;
use serde::{Deserialize, Serialize};

/// The last iteration of a statics or of a step moves less than this share of the whole displacement.
pub(crate) const LEAST_TRAVEL: f64 = 1e-6;
/// Part of its axial stiffness that a slack cable shows in the tangent of statics.
pub(crate) const SLACK_SHARE: f64 = 1e-6;
/// A step along the direction of Newton is taken if the work of the residual falls below this share.
const ENOUGH: f64 = 0.8;
/// Most evaluations of a line search.
const MOST_SEARCHES: usize = 60;
/// Rounding never counts for more than this of the forces: what flies off is not in balance.
pub(crate) const COARSEST: f64 = 1e-7;
/// Most iterations in statics where the scene does not say: with nothing but weak springs across, each follows a bent valley of energy by
/// some way alone.
const MOST_OF_STATICS: u32 = 120;
/// An implicit step keeps its factorisation as long as an iteration takes the residual below this share:
/// inertia rules the tangent there, and another solution costs a fifth of a new factorisation.
const GOOD_ENOUGH: f64 = 0.1;
/// A pivot below this part of its diagonal entry is rounding: nothing holds there.
const NOTHING: f64 = 1e-13;
/// Largest shift of a tangent that is not positive, relative to its largest diagonal entry.
const LARGEST_SHIFT: f64 = 1e2;

/// What is to be solved. All slices over all degrees of freedom.
pub struct Problem<'a> {
    /// The structure.
    pub model: &'a Model,
    /// `p` [N].
    pub load: &'a [f64],
    /// `u_0` [m].
    pub start: &'a [f64],
    /// `k_M` [1/s2].
    pub inertia: f64,
    /// `s`, above 0 and at most 1.
    pub share: f64,
    /// Whether cables pull with their mean stress between `u_0` and `u`.
    pub mean_stress: bool,
    /// Committed history of the elements.
    pub history: &'a [f64],
    /// Viscosity of each degree of freedom [N s/m], empty = none, and what it counts in stiffness [1/s].
    pub viscosity: (&'a [f64], f64),
    /// Pressure of each load of the model that presses on faces [Pa]; empty = none.
    pub pressures: &'a [f64],
}

impl<'a> Problem<'a> {
    /// Of `model` at rest under its loads at t = 0, beside the displacement `start` [m].
    pub fn of_rest(model: &'a Model, start: &'a [f64], history: &'a [f64], pressures: &'a [f64]) -> Self {
        Self {
            model,
            load: &model.dead_load,
            start,
            inertia: 0.0,
            share: 1.0,
            mean_stress: false,
            history,
            viscosity: (&[], 0.0),
            pressures,
        }
    }

    fn slack(&self) -> Slack {
        if self.inertia > 0.0 { Slack::Exact } else { Slack::Regularised(SLACK_SHARE) }
    }
}

/// Why there is no solution.
#[derive(Debug, Clone)]
pub enum Failure {
    /// The residual did not become small.
    NotConverged {
        /// Iterations done.
        iterations: u32,
        /// Norm of the last residual [N].
        residual: f64,
        /// What it had to be [N].
        limit: f64,
        /// Degree of freedom with the largest residual.
        worst: usize,
        /// Where the residual is small enough, but the last iterations still moved by more than 1e-6 of the
        /// whole way: how far the last one moved [m].
        moving: Option<f64>,
        /// Degree of freedom of the first pivot that was not positive, if the last tangent had to be shifted.
        unstable: Option<usize>,
    },
    /// The tangent stays indefinite, whatever is added to it.
    Unstable {
        /// Degree of freedom with the pivot that is not positive.
        dof: usize,
    },
    /// A path of equilibrium turns by more than a step may, however short.
    Turns {
        /// By how much [rad].
        angle: f64,
    },
    /// Something breaks before there is anything to touch it.
    Broken {
        /// Number of the element.
        element: usize,
        /// What it carried [N].
        tension: f64,
        /// Share of the dead load that acted.
        part: f64,
    },
    /// Something does not come to rest: the fastest node, its speed [m/s], and how many are about as fast.
    Moves(usize, f64, usize),
    /// A beam has fallen over on the way to a rest shape, which was not found.
    Falls {
        /// Number of the element.
        element: usize,
        /// By how much it has turned [degrees].
        angle: f64,
        /// What ended the search.
        why: Box<Failure>,
    },
    /// Whoever listens to the progress has stopped it.
    Stopped(Fault),
}

impl Failure {
    /// In words, with the names of nodes.
    pub fn describe(&self, model: &Model) -> String {
        match self {
            Self::NotConverged { iterations, residual, limit, worst, moving, unstable } => {
                let what = match moving {
                    Some(way) => format!(
                        "Newton did not converge: after {iterations} iterations the residual is small enough, {residual:.2e} N \
                         of {limit:.2e} N allowed, but the last one still moved {way:.2e} m"
                    ),
                    None => format!(
                        "Newton did not converge: residual {residual:.2e} N > {limit:.2e} N after {iterations} iterations, \
                         largest at {}",
                        model.dof_name(*worst)
                    ),
                };
                let free = unstable.map_or(String::new(), |dof| {
                    format!(
                        "; the tangent is not positive, first at {} (free to move, slack, or buckled)",
                        model.dof_name(dof)
                    )
                });
                what + &free
            }
            Self::Unstable { dof } => format!(
                "no stable equilibrium: a pivot at {} is not positive (slack, not connected to a support, or buckled)",
                model.dof_name(*dof)
            ),
            Self::Turns { angle } => format!(
                "the path of equilibrium turns by {:.0} degrees within its shortest step: it ends here, or jumps",
                angle.to_degrees()
            ),
            Self::Broken { element, tension, part } => format!(
                "{} breaks under {:.0} % of the dead load alone, at {tension:.4e} N",
                model.member_name(*element, None),
                100.0 * part
            ),
            Self::Moves(node, speed, count) => format!(
                "it does not come to rest: node {} moves at {speed:.2e} m/s, and {count} nodes in all at a tenth of that or more",
                model.node_name(*node)
            ),
            Self::Falls { element, angle, why } => format!(
                "{} has turned by {angle:.0} degrees, it falls over; {}",
                model.member_name(*element, None),
                why.describe(model)
            ),
            Self::Stopped(fault) => fault.to_string(),
        }
    }
}

/// What an iteration did.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Info {
    /// Newton iterations.
    pub iterations: u64,
    /// Factorisations, those that failed included.
    pub factorisations: u64,
    /// Factorisations that were spared, because the factor at hand was that of the tangent asked for.
    pub kept_factors: u64,
    /// Degree of freedom of the first pivot that was not positive, if the last tangent had to be shifted.
    pub unstable: Option<usize>,
    /// The same of the first tangent that had to be shifted.
    pub shifted_at: Option<usize>,
}

/// Called after each iteration: its number and the residual relative to what is asked for.
pub type OnIteration<'a> = &'a mut dyn FnMut(u64, f64) -> Result<(), Fault>;

/// The iteration, with its memory.
pub struct Newton {
    /// Tangent of the structure.
    pub tangent: Tangent,
    /// Whether the factor at hand serves again where the same tangent is asked for: all iterations of a coupling begin at
    /// one committed state, and the first tangent of each is that of the one before, bit for bit. Measured on the drop test
    /// in strong windows of one implicit step of 0.2 ms: 1 074 factorisations in place of 3 540, 4.0 s in place of 6.5.
    pub keeps_factor: bool,
    /// Degrees of freedom that a support holds which lets go later.
    fixed: Vec<usize>,
    /// Whether the last iteration must have moved little, too.
    pub limits_travel: bool,
    factored: Factored,
    /// The internal force that is balanced.
    pub internal: InternalForce,
    mass: Vec<f64>,
    residual: Vec<f64>,
    balance_at: Vec<f64>,
    accepted: Vec<f64>,
    direction: Vec<f64>,
    free: Vec<f64>,
    /// Largest size of terms that elements other than cables take differences of [N].
    coarseness: f64,
    /// Of the structure as modelled [m].
    extent: f64,
}

/// What the factor at hand was made of.
#[derive(Default)]
struct Factored {
    /// [`Tangent::revision`] then; 0 = none.
    revision: u64,
    /// Where forces balanced [m].
    at: Vec<f64>,
    history: Vec<f64>,
    /// Inertia, share, and what viscosity counts.
    numbers: [f64; 3],
    pressures: Vec<f64>,
}

impl Factored {
    fn numbers(problem: &Problem) -> [f64; 3] {
        [problem.inertia, problem.share, problem.viscosity.1]
    }

    /// Whether it is the factor of the tangent at `at`, to the last bit.
    fn is_of(&self, revision: u64, at: &[f64], problem: &Problem) -> bool {
        let same = |a: &[f64], b: &[f64]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
        };
        self.revision == revision
            && same(&self.numbers, &Self::numbers(problem))
            && same(&self.at, at)
            && same(&self.history, problem.history)
            && same(&self.pressures, problem.pressures)
    }
}

/// Sizes of one evaluation [N].
struct Sizes {
    residual: f64,
    scale: f64,
    tension: f64,
    load: f64,
}

impl Newton {
    /// Memory for `model`.
    pub fn new(model: &Model) -> Self {
        let tangent = Tangent::new(model);
        let n = model.dof_count();
        Self {
            keeps_factor: true,
            fixed: Vec::with_capacity(model.until.len()),
            limits_travel: true,
            factored: Factored {
                at: vec![0.0; n],
                history: Vec::with_capacity(model.start_history().len()),
                pressures: Vec::with_capacity(model.timed.len()),
                ..Factored::default()
            },
            internal: InternalForce::new(model),
            mass: (0..n).map(|dof| model.dof_mass(dof)).collect(),
            residual: vec![0.0; n],
            balance_at: vec![0.0; n],
            accepted: vec![0.0; n],
            direction: vec![0.0; n],
            free: vec![0.0; tangent.dofs.len()],
            extent: model.extent(),
            coarseness: model.elements.iter().map(|e| e.coarseness()).fold(0.0, f64::max),
            tangent,
        }
    }

    /// From now on these degrees of freedom, and no others, are fixed beside those that are held.
    pub fn fix(&mut self, dofs: &[usize]) {
        if dofs != self.fixed {
            dofs.clone_into(&mut self.fixed);
            self.tangent.fix(dofs);
            self.factored.revision = 0;
        }
    }

    /// The degree of freedom that the structure does not hold in the static equilibrium `u`, if any: a pivot that is
    /// not positive once rounding is taken from the diagonal. Slack cables count as soft ones.
    pub fn not_held(&mut self, model: &Model, u: &[f64], history: &[f64]) -> Option<usize> {
        self.tangent.assemble(model, u, history, 1.0, Slack::Regularised(SLACK_SHARE));
        self.tangent.matrix.weaken(NOTHING);
        self.tangent.factorise().err()
    }

    /// Solve, starting from the guess in `u`, whose held degrees of freedom stay as they are.
    pub fn solve(
        &mut self,
        problem: &Problem,
        settings: &NewtonConfig,
        u: &mut [f64],
        on_iteration: OnIteration,
    ) -> Result<Info, Failure> {
        let mut info = Info::default();
        let most = settings.max_iterations.unwrap_or_else(|| match problem.inertia {
            0.0 => MOST_OF_STATICS,
            _ => settings.most_iterations(),
        });
        let mut sizes = self.evaluate(problem, u);
        let (mut rounding, mut moved_little, mut shift) = (0.0, true, 0.0);
        let (mut last_residual, mut moved) = (0.0, 0.0);
        loop {
            let limit = settings.tolerance * sizes.scale;
            if sizes.residual <= rounding || (sizes.residual <= limit && moved_little) {
                return Ok(info);
            }
            let exhausted = info.iterations >= u64::from(most);
            if exhausted && sizes.residual <= settings.floor {
                return Ok(info);
            }
            if exhausted || !sizes.residual.is_finite() {
                return Err(Failure::NotConverged {
                    iterations: info.iterations as u32,
                    residual: sizes.residual,
                    limit: limit.max(rounding),
                    worst: self.tangent.worst(&self.residual),
                    moving: (sizes.residual <= limit).then_some(moved),
                    unstable: info.unstable,
                });
            }
            let keep = problem.inertia > 0.0 && sizes.residual < GOOD_ENOUGH * last_residual;
            if !keep {
                self.factorise(problem, &mut shift, &mut info)?;
            }
            last_residual = sizes.residual;
            self.aim();
            let (length, before) = (largest(&self.direction), inner(&self.direction, &self.residual));
            self.accepted.copy_from_slice(u);
            let step = self.step(problem, u, before, settings.line_search, &mut sizes);
            rounding = self.rounding(u, &sizes);
            let travel = u.iter().zip(problem.start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            moved = step * length;
            moved_little = !self.limits_travel || moved <= LEAST_TRAVEL * travel;
            info.iterations += 1;
            on_iteration(info.iterations, sizes.residual / limit.max(rounding)).map_err(Failure::Stopped)?;
        }
    }

    /// Residual that rounding leaves at `u` [N]: of `u` itself, of the tensions that cancel at a node, and of what elements
    /// take differences of. Where there are no forces at all, what is below the rounding of positions, squared.
    fn rounding(&mut self, u: &[f64], sizes: &Sizes) -> f64 {
        let noise = self.tangent.noise(u, sizes.tension + self.coarseness, &mut self.free);
        let root = (self.tangent.dofs.len() as f64).sqrt();
        // Without load, where all forces are what elements leave of differences, there is nothing to balance.
        if sizes.load == 0.0 && sizes.scale <= f64::EPSILON * root * self.coarseness {
            return sizes.scale;
        }
        let least = f64::EPSILON * f64::EPSILON * self.tangent.matrix.largest_diagonal() * self.extent * root;
        noise.min(COARSEST * sizes.scale).max(least)
    }

    /// Residual at `u`, and the sizes of what it is made of.
    fn evaluate(&mut self, problem: &Problem, u: &[f64]) -> Sizes {
        for ((at, u1), u0) in self.balance_at.iter_mut().zip(u).zip(problem.start) {
            *at = u0 + problem.share * (u1 - u0);
        }
        self.residual.fill(0.0);
        let at = if problem.mean_stress {
            Displacements::Step { before: problem.start, after: u, middle: &self.balance_at }
        } else {
            Displacements::At(&self.balance_at)
        };
        let tension = self.internal.subtract(problem.model, at, problem.history, &mut self.residual).sqrt();
        let internal = norm(&self.residual);
        let pressing = press(&problem.model.timed, problem.pressures, &self.balance_at, &mut self.residual);
        let (mut inertia, mut load) = (0.0, pressing);
        for (i, r) in self.residual.iter_mut().enumerate() {
            let mut inert = problem.inertia * self.mass[i] * (u[i] - problem.start[i]);
            if let Some(c) = problem.viscosity.0.get(i) {
                inert += problem.viscosity.1 * c * (u[i] - problem.start[i]);
            }
            inertia += inert * inert;
            load += problem.load[i] * problem.load[i];
            *r += problem.load[i] - inert;
        }
        self.fixed.iter().for_each(|dof| self.residual[*dof] = 0.0);
        let residual = self.tangent.norm(&self.residual);
        Sizes { residual, scale: internal.max(inertia.sqrt()).max(load.sqrt()), tension, load }
    }

    /// Factorise the tangent at the last evaluation; one that is not positive is shifted.
    fn factorise(&mut self, problem: &Problem, shift: &mut f64, info: &mut Info) -> Result<(), Failure> {
        let Problem { model, history, share, pressures, .. } = *problem;
        *shift *= 0.1;
        if *shift < 1e-12 {
            *shift = 0.0;
        }
        // The slack of statics and dynamics differs with the inertia.
        let revision = self.tangent.revision;
        if self.keeps_factor && *shift == 0.0 && self.factored.is_of(revision, &self.balance_at, problem) {
            info.kept_factors += 1;
            info.unstable = None;
            return Ok(());
        }
        self.factored.revision = 0;
        loop {
            self.tangent.assemble(model, &self.balance_at, history, share, problem.slack());
            self.tangent.add_pressures(&model.timed, pressures, &self.balance_at, share);
            self.tangent.add_diagonal(&self.mass, problem.inertia);
            self.tangent.add_diagonal(problem.viscosity.0, problem.viscosity.1);
            let scale = self.tangent.matrix.largest_diagonal().max(f64::MIN_POSITIVE);
            if *shift > 0.0 {
                self.tangent.matrix.shift(*shift * scale);
            }
            info.factorisations += 1;
            match self.tangent.factorise() {
                Ok(()) => break,
                Err(dof) if *shift >= LARGEST_SHIFT => return Err(Failure::Unstable { dof }),
                Err(dof) => {
                    info.unstable = Some(dof);
                    info.shifted_at = info.shifted_at.or(Some(dof));
                    *shift = (10.0 * *shift).max(1e-8);
                }
            }
        }
        if *shift == 0.0 {
            info.unstable = None;
            self.factored.revision = self.tangent.revision;
            self.factored.at.copy_from_slice(&self.balance_at);
            history.clone_into(&mut self.factored.history);
            pressures.clone_into(&mut self.factored.pressures);
            self.factored.numbers = Factored::numbers(problem);
        }
        Ok(())
    }

    /// Newton's direction at the last evaluation, by the last factorisation.
    fn aim(&mut self) {
        self.tangent.gather(&self.residual, &mut self.free);
        self.tangent.matrix.solve(&mut self.free);
        self.tangent.scatter(&self.free, &mut self.direction);
    }

    /// Move along the direction, shortened where the whole of it overshoots. Returns the share.
    ///
    /// The energy is least where the work of the residual along the direction, `g(s)`, is 0; it starts
    /// above. Below 0 lies too far. Between the two, regula falsi with Illinois' halving; far
    /// apart in size, first by decades.
    fn step(
        &mut self,
        problem: &Problem,
        u: &mut [f64],
        before: f64,
        search: bool,
        sizes: &mut Sizes,
    ) -> f64 {
        let (mut s, mut near, mut far) = (1.0, (0.0, before), (f64::INFINITY, 0.0));
        for _ in 0..MOST_SEARCHES {
            for ((u, a), d) in u.iter_mut().zip(&self.accepted).zip(&self.direction) {
                *u = a + s * d;
            }
            *sizes = self.evaluate(problem, u);
            let work = inner(&self.direction, &self.residual);
            if !search || work.abs() <= ENOUGH * before.abs() || (work > 0.0 && s == 1.0) {
                break;
            }
            if work > 0.0 {
                near = (s, work);
                far.1 *= 0.5;
            } else {
                far = (s, if work.is_finite() { work } else { f64::NEG_INFINITY });
                near.1 *= if near.0 > 0.0 { 0.5 } else { 1.0 };
            }
            let falsi = near.0 + (far.0 - near.0) * near.1 / (near.1 - far.1);
            let decade = near.0.max(0.1 * far.0);
            s = if far.0 > 10.0 * falsi.max(near.0) || !falsi.is_finite() { decade } else { falsi };
        }
        s
    }
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, b| f64::max(a, b.abs()))
}
