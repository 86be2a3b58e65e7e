//! The solver as the contract sees it: hello, prepare, solve, commit, finish.
//!
//! - [`state`]: what is committed and what is tried
//! - [`zone`]: a rock's surroundings in a window
//! - [`window`]: the steps of a window ([`cut`], [`watch`](mod@watch)), and [`flight`] where there is nothing to meet
//! - [`gauges`], [`measures`], [`fields`]: what is told of it

pub mod cut;
pub mod fields;
pub mod flight;
pub mod gauges;
pub mod measures;
pub mod state;
pub mod watch;
pub mod window;
pub mod zone;

use crate::contact::laws::Laws;
use crate::critical::Steps;
use crate::rock::Rock;
use crate::rock::overlap::met;
use crate::search::tree::SphereTree;
use crate::settings::{STRUCTURE, Settings};
use crate::wall::Wall;
use crate::wall::hierarchy::Crossings;
use fields::Fields;
use gauges::Gauges;
use interface_defs::message::{Hello, capability};
use interface_defs::solver::OnProgress;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::program::Options;
use interface_defs::toolkit::scene::Scene;
use interface_defs::{Fault, FieldSpec, Plan, Progress, Ready, Sampling, Solver, Statistics, Window, name};
use state::State;
use window::Run;

/// Most samples per window of any field.
const MOST_SAMPLES: u32 = 64;

/// Counts of work done since the start, repeated windows included.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Own steps, times rocks.
    pub sub_steps: u64,
    /// Windows in which nothing was in reach, solved in closed form.
    pub flight_windows: u64,
    /// Evaluations of a contact.
    pub contact_evaluations: u64,
}

/// What does not change in a run.
pub struct Model {
    /// What the scene says.
    pub settings: Settings,
    /// The rocks.
    pub rocks: Vec<Rock>,
    /// A tree over the spheres of each.
    pub trees: Vec<SphereTree>,
    /// The laws of contact; `None`: nothing is touched.
    pub laws: Option<Laws>,
    /// For each rock the number of its law with the structure.
    pub rows: Vec<Vec<u16>>,
    /// The step.
    pub steps: Steps,
    /// Whether savings may be used.
    pub shortcuts: bool,
}

/// Rocks as rigid sphere clusters, in contact with a wall that the structure moves.
pub struct DemSolver {
    model: Model,
    notices: Vec<String>,
    options: Options,
    run: Option<Run>,
    committed: State,
    trial: State,
    fields: Option<Fields>,
}

impl DemSolver {
    /// The solver of a scene.
    pub fn new(scene: &Scene, options: &Options) -> Result<Self, InputError> {
        let settings = Settings::of(scene)?;
        let (rocks, notices): (Vec<Rock>, Vec<_>) = settings.rocks.iter().map(Rock::new).unzip();
        let laws = Laws::new(&settings.contacts);
        let steps = Steps::new(&settings, &rocks, laws.as_ref(), scene)?;
        let trees = rocks.iter().map(|r| SphereTree::new(&r.spheres)).collect();
        let state = State::start(&settings, &rocks);
        let model =
            Model { settings, rocks, trees, laws, rows: Vec::new(), steps, shortcuts: options.shortcuts };
        if let Some((a, b)) = rocks_that_met(&model, &state) {
            let what = format!(
                "rock `{}` and rock `{}` overlap at the start",
                name_of(&model, a),
                name_of(&model, b)
            );
            return Err(scene
                .invalid(&format!("rock.{a}.position"), what)
                .try_instead("contact between rocks is not part of this version: move them apart"));
        }
        Ok(Self {
            model,
            notices: notices.into_iter().flatten().collect(),
            options: options.clone(),
            run: None,
            committed: state.clone(),
            trial: state,
            fields: None,
        })
    }

    /// What does not change in a run.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What the user should know of the scene, before anything is known of a wall.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The committed state.
    pub fn state(&self) -> &State {
        &self.committed
    }

    fn wall(&mut self, plan: &Plan, warnings: &mut Vec<String>) -> Result<Option<Wall>, Fault> {
        let Some(mesh) = &plan.wall else { return Ok(None) };
        let mut wall = Wall::new(mesh)?;
        let Some(laws) = &self.model.laws else {
            return Err(Fault::input(
                "there is a wall and no contact law: the rock would fall through it; add a table [[contact]]",
            ));
        };
        if laws.continuous() {
            wall.crossings = Some(Crossings::new(&wall.nodes, &wall.elements));
        }
        let materials = [STRUCTURE.to_owned()];
        let rows = self.model.settings.rocks.iter().map(|rock| {
            laws.row(&rock.material, &materials).map_err(|wall| {
                let rock = &rock.material;
                Fault::input(format!(
                    "no table [[contact]] is for `{rock}` and `{wall}`; add one with between = [\"{rock}\", \"{wall}\"], \
                     or one without `between` for all others"
                ))
            })
        });
        self.model.rows = rows.collect::<Result<_, _>>()?;
        if laws.use_local_masses() && wall.inverse_mass.is_none() {
            self.model.laws = Some(laws.clone().without_local_masses());
            warnings.push(
                "the structure does not tell its nodal masses: contacts damp with the rock's whole mass \
                 (effective_mass = \"rock\")"
                    .into(),
            );
        }
        Ok(Some(wall))
    }
}

/// The first two rocks whose spheres overlap.
pub(crate) fn rocks_that_met(model: &Model, state: &State) -> Option<(usize, usize)> {
    let motion = |i: usize| &state.bodies[i].motion;
    (1..model.rocks.len()).find_map(|b| {
        (0..b)
            .find(|&a| met(&model.rocks[b], motion(b), &model.rocks[a], motion(a), &model.trees[a]))
            .map(|a| (a, b))
    })
}

pub(crate) fn name_of(model: &Model, rock: usize) -> &str {
    &model.rocks[rock].name
}

impl Solver for DemSolver {
    fn hello(&self) -> Hello {
        let field = |name, components, sampling, samples| FieldSpec {
            samples,
            ..FieldSpec::nodal(name, components, sampling)
        };
        Hello {
            program: format!("dem-solver {}", env!("CARGO_PKG_VERSION")),
            capabilities: vec![capability::REPEATABLE.into()],
            takes: vec![
                field(name::DISPLACEMENT, 3, Sampling::FromStart, MOST_SAMPLES),
                field(name::VELOCITY, 3, Sampling::FromStart, MOST_SAMPLES),
            ],
            gives: vec![
                field(name::FORCE, 3, Sampling::Means, MOST_SAMPLES),
                field(name::FORCE, 3, Sampling::AtEnds, MOST_SAMPLES),
                field(name::REACH, 1, Sampling::Once, 1),
            ],
            largest_window: f64::INFINITY,
        }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        check_plan(&self.hello(), plan)?;
        let mut warnings = self.notices.clone();
        if plan.wall.is_some() {
            progress(Progress { what: "making the wall of the structure's mesh".into(), done: f64::NAN })?;
        }
        let wall = self.wall(plan, &mut warnings)?;
        self.committed = State::start(&self.model.settings, &self.model.rocks);
        let mut run = Run::new(&self.model, wall, plan);
        for body in &mut self.committed.bodies {
            body.reserve(run.most_contacts());
        }
        let initial = run.initial(&self.model, &mut self.committed, plan)?;
        self.trial = self.committed.clone();
        for body in &mut self.trial.bodies {
            body.reserve(run.most_contacts());
        }
        self.run = Some(run);
        self.fields = None;
        if let (Some(interval), Some(out)) = (self.model.settings.fields, &self.options.out) {
            self.fields = Some(Fields::create(&out.join("fields"), interval, &self.model)?);
            self.write_fields()?;
        }
        let mesh = plan.wall.clone().unwrap_or_default();
        Ok(Ready { mesh, gauges: Gauges::declared(&self.model.rocks), initial, warnings })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let run = self.run.as_mut().ok_or_else(|| Fault::broken("asked to solve before it was prepared"))?;
        self.trial.copy(&self.committed);
        run.solve(&self.model, &mut self.trial, window, input, output)
    }

    fn commit(&mut self) -> Result<(), Fault> {
        std::mem::swap(&mut self.committed, &mut self.trial);
        self.write_fields()
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let counts = self.run.as_ref().map(Run::counts).unwrap_or_default();
        let wall = self.run.as_ref().is_some_and(Run::has_wall);
        let (measures, warnings) = measures::results(&self.model.rocks, &self.committed, wall);
        Ok(Statistics { measures, counts, warnings, ..Statistics::default() })
    }
}

impl DemSolver {
    fn write_fields(&mut self) -> Result<(), Fault> {
        match &mut self.fields {
            Some(fields) => fields.write_if_due(&self.model, &self.committed),
            None => Ok(()),
        }
    }
}

/// Refuse a plan that asks for what was not offered.
fn check_plan(hello: &Hello, plan: &Plan) -> Result<(), Fault> {
    for (asked, offered) in [(&plan.takes, &hello.takes), (&plan.gives, &hello.gives)] {
        for field in asked {
            let fits = |o: &FieldSpec| {
                (&o.name, o.components, o.place, o.sampling)
                    == (&field.name, field.components, field.place, field.sampling)
            };
            let known = offered.iter().find(|o| fits(o)).ok_or_else(|| {
                Fault::broken(format!("the plan has the field {field:?}, which dem-solver has not offered"))
            })?;
            if field.samples == 0 || field.samples > known.samples {
                return Err(Fault::broken(format!(
                    "the plan has {} samples of `{}`: 1 to {} are possible",
                    field.samples, field.name, known.samples
                )));
            }
        }
    }
    Ok(())
}
