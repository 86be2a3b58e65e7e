//! One member from its start to its end, window by window as a run of its scene alone.

use super::base::Base;
use super::member::{Kept, Member};
use super::record::{How, Outcome};
use super::track::{Follower, Track};
use dem_rocks::DemSolver;
use dem_rocks::model::Model;
use dem_rocks::results::measures::penetration;
use dem_rocks::results::trajectory::Row;
use dem_solid::geometry::plan::Point;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::interrupt;
use interface_defs::verdict::Fate;
use interface_defs::{Plan, Solver};
use std::panic::{AssertUnwindSafe, catch_unwind};
use toolkit::energy;
use toolkit::limits::Evidence;
use toolkit::recorder::{Ledger, Step, Windows};
use toolkit::summary::{RunStatus, Summary};

/// What is tried where energy is made or lost over terrain.
const SHORTER: &str = "dem.steps_per_contact, or a lower contact.young";

/// Computes members, one after the other.
pub struct Runner<'a> {
    base: &'a Base,
    kept: Option<Kept>,
}

/// A member that falls.
struct Fall {
    solver: DemSolver,
    ledger: Ledger,
}

impl<'a> Runner<'a> {
    /// For the members of a study.
    pub fn new(base: &'a Base) -> Self {
        Self { base, kept: None }
    }

    /// Compute a member; `None`: a signal has ended it.
    pub fn run(&mut self, member: &Member) -> Option<(Outcome, Track)> {
        let kept = self.kept.take();
        let computed = catch_unwind(AssertUnwindSafe(|| self.attempt(member, kept)));
        computed.unwrap_or_else(|panic| {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a broken invariant");
            let fault = Diagnostic::new(format!("the computation broke: {words}"));
            Some((Outcome::failed(fault), Track::default()))
        })
    }

    fn attempt(&mut self, member: &Member, kept: Option<Kept>) -> Option<(Outcome, Track)> {
        let model = match self.base.model(member, kept) {
            Ok(model) => model,
            Err(what) => return Some((Outcome::failed(what), Track::default())),
        };
        let mut outcome = Outcome::of_start(&model);
        let fall = match Fall::begin(self.base, model) {
            Ok(fall) => fall,
            Err(what) => {
                outcome.fail(what);
                return Some((outcome, Track::default()));
            }
        };
        let mut follower = Follower::new(self.base, self.base.draws(member.number));
        let fall = self.advance(fall, &mut outcome, &mut follower)?;
        self.kept = Kept::of(member, fall.solver.into_model());
        Some((outcome, follower.end()))
    }

    fn advance(&self, mut fall: Fall, outcome: &mut Outcome, follower: &mut Follower) -> Option<Fall> {
        if self.base.follows() {
            let (model, body) = (fall.solver.model(), &fall.solver.state().bodies[0]);
            follower.row(&Row::of(model, 0, body, 0.0, false));
        }
        for step in windows(self.base) {
            if interrupt::requested() {
                return None;
            }
            if let Err(what) = fall.window(&step, self.base) {
                outcome.fail(what);
                break;
            }
            fall.solver.rows().iter().for_each(|row| follower.row(row));
            if fall.solver.has_ended() {
                break;
            }
        }
        fall.judge(self.base, outcome);
        Some(fall)
    }
}

/// The windows of a member, those of its scene alone.
fn windows(base: &Base) -> Windows {
    Windows::new(base.settings.end_time, base.settings.interval, f64::INFINITY)
}

/// A member in free flight at an instant of its fall.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    /// When [s].
    pub time: f64,
    /// Centre of mass [m], in the terrain's coordinates.
    pub position: [f64; 3],
    /// Its velocity [m/s].
    pub velocity: [f64; 3],
    /// Orientation of the axes of its shape.
    pub orientation: [f64; 4],
    /// Angular velocity [rad/s].
    pub spin: [f64; 3],
}

/// How a member flies at the last end of a window before `until` [s] at which nothing touches it and `is_far` holds of its
/// centre (local, seen from above). `None`: it never does.
pub fn flight_before(
    base: &Base,
    member: &Member,
    until: f64,
    is_far: &dyn Fn(Point) -> bool,
) -> Result<Option<Flight>, Diagnostic> {
    let mut fall = Fall::begin(base, base.model(member, None)?)?;
    let mut last = None;
    for step in windows(base).take_while(|step| step.window.end() < until) {
        fall.window(&step, base)?;
        let (model, body) = (fall.solver.model(), &fall.solver.state().bodies[0]);
        let motion = &body.motion;
        if body.contacts > 0 || !is_far([motion.position.x, motion.position.y]) {
            continue;
        }
        let rock = &model.rocks[0];
        let turn = rock.shape_orientation(motion);
        last = Some(Flight {
            time: step.window.end(),
            position: (motion.position + base.ground.origin).into(),
            velocity: motion.velocity.into(),
            orientation: [turn.w, turn.i, turn.j, turn.k],
            spin: rock.spin(motion).into(),
        });
    }
    Ok(last)
}

impl Fall {
    /// At the start of its run.
    fn begin(base: &Base, model: Model) -> Result<Self, Diagnostic> {
        let mut solver = DemSolver::of_model(model, &base.scene, base.follows());
        let (interval, end) = (base.settings.interval, base.settings.end_time);
        let plan = Plan { end_time: end, window: interval.min(end), ..Plan::default() };
        let ready = solver.prepare(&plan, &mut |_| Ok(())).map_err(|fault| *fault.diagnostic)?;
        let ledger = Ledger::new(ready, true).map_err(|fault| *fault.diagnostic)?;
        Ok(Self { ledger, solver })
    }

    fn window(&mut self, step: &Step, base: &Base) -> Result<(), Diagnostic> {
        let solved = self.ledger.solve(&mut self.solver, step);
        let fault = solved.err().or_else(|| self.ledger.diverged(step.end, &base.limits, SHORTER));
        fault.map_or(Ok(()), |fault| Err(*fault.diagnostic))
    }

    /// What became of the rock, and whether it is to be trusted.
    fn judge(&mut self, base: &Base, outcome: &mut Outcome) {
        let status = if outcome.status == RunStatus::Failed { RunStatus::Failed } else { RunStatus::Done };
        let mut summary = Summary::new(status);
        let state = self.solver.state();
        let body = &state.bodies[0];
        let depth = body.deepest.largest();
        if let Some((depth, time)) = depth {
            summary.measures.push(penetration("max_penetration", depth, time));
        }
        let balance = self.ledger.balance.as_ref();
        let error = balance.and_then(|balance| balance.error().map(|error| (error, balance.largest.1)));
        if let Some((error, time)) = error {
            summary.measures.push(energy::error_measure(error, time));
        }
        base.limits.judge(&mut summary, &Evidence { energy: SHORTER.into(), ..Evidence::default() });
        if summary.status == RunStatus::Unreliable {
            outcome.status = RunStatus::Unreliable;
            outcome.fault = summary.message.map(|why| Diagnostic::warning(code::TRUST, why));
        }
        let path = &body.path;
        let (how, time, position, velocity) = match path.ending {
            Some(end) if end.how == Fate::AtRest => (How::Rest, end.time, end.position, end.velocity),
            Some(end) => (How::Out, end.time, end.position, end.velocity),
            None => (How::Moving, state.time, body.motion.position, body.motion.velocity),
        };
        outcome.how = how;
        outcome.end = (position + base.ground.origin).into();
        outcome.end_velocity = velocity.into();
        (outcome.time, outcome.path) = (time, *path);
        outcome.penetration = depth.map_or(0.0, |(depth, _)| depth);
        outcome.energy_error = error.map_or(0.0, |(error, _)| error);
    }
}
