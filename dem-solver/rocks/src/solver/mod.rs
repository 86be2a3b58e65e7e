//! The solver as the contract sees it: hello, prepare, solve, commit, finish.
//!
//! What it computes with is a [`Model`] and a [`State`], by the [`crate::integrator`]; [`crate::guard`] watches the steps,
//! [`crate::results`] reports.

use crate::gate;
use crate::integrator::window::{KeptIntegrator, RockIntegrator, Solved};
use crate::model::between::{Between, rows, whole_pairs};
use crate::model::impact::Impact;
use crate::model::state::{Body, State};
use crate::model::{Model, Steps};
use crate::results::fields::{self, FieldFiles, KeptFields};
use crate::results::gauges::Gauges;
use crate::results::map::sheet::Imprint;
use crate::results::trajectory::{self, Row, Trajectory};
use crate::results::{self, map, measures, verdict};
use dem_contact::interface_mesh::ContactMesh;
use dem_contact::interface_mesh::crossings::Crossings;
use dem_contact::law::settings::of_presets;
use dem_contact::rock::{Motion, Rock};
use dem_contact::settings::{ContactSelection, STRUCTURE, Settings, limits};
use dem_solid::geometry::sphere_tree::SphereTree;
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Hello;
use interface_defs::message::capability;
use interface_defs::solver::OnProgress;
use interface_defs::{
    Fault, FieldSpec, InterfaceMesh, Place, Plan, Progress, Ready, Sampling, Selection, Solver, Statistics,
    Window, name,
};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;
use toolkit::checkpoint::{pack, unpack};
use toolkit::history::Mark;
use toolkit::program::Options;
use toolkit::run_dir;
use toolkit::scene::Scene;

mod partners;
use partners::{are_apart, enclose, lay_on_terrain, touch_by_faces};

/// Most times that steps are made finer where a contact asks for it.
const FINEST: usize = 64;

/// Most samples per window of any field.
const MOST_SAMPLES: u32 = 64;

/// What the solver writes down of itself at the end of a committed window: all that the next ones follow from.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    state: State,
    integrator: KeptIntegrator,
    fields: Option<KeptFields>,
    /// `trajectory.csv` as it was.
    trajectory: Option<Mark>,
}

/// Rocks as rigid sphere clusters, in contact with a mesh that the structure moves.
pub struct DemSolver {
    model: Model,
    notices: Vec<Diagnostic>,
    cautions: Vec<Diagnostic>,
    /// For errors that only the net brings to light.
    scene: Scene,
    /// True if a rock that starts inside the net is refused.
    guarded: bool,
    choice: Option<String>,
    options: Options,
    run: Option<RockIntegrator>,
    committed: State,
    trial: State,
    /// Of each rock its first touch of the net, as the first pass over the window at hand has seen it.
    touches: Vec<Option<Impact>>,
    fields: Option<FieldFiles>,
    trajectory: Option<Trajectory>,
    /// True if rows of the trajectories are kept although no file of them is written.
    pub(crate) keeps_rows: bool,
    /// The state from which it is to go on.
    resume: Option<Box<Kept>>,
}

impl DemSolver {
    /// The solver of a scene.
    pub fn new(scene: &Scene, options: &Options) -> Result<Self, Diagnostic> {
        Self::with_kept(scene, options, &[])
    }

    /// The same; spheres of rocks that were made before are looked for beside the scene and in these folders, a prepared terrain in these.
    pub fn with_kept(scene: &Scene, options: &Options, folders: &[PathBuf]) -> Result<Self, Diagnostic> {
        let settings = Settings::of(scene)?;
        let rocks = settings.rocks.iter().enumerate().map(|(at, rock)| Rock::new(at, rock, scene, folders));
        let (rocks, notices): (Vec<Rock>, Vec<_>) = rocks.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let mut notices: Vec<Diagnostic> = notices.into_iter().flatten().collect();
        for (at, (rock, table)) in rocks.iter().zip(&settings.rocks).enumerate().take(settings.named()) {
            notices.extend(limits::of_rock(at, table, rock.mass));
        }
        notices.extend(limits::of_contacts(&settings.contacts));
        notices.extend(of_presets(&settings.contacts));
        notices.extend(settings.notices.iter().cloned());
        let terrain = settings.terrain.as_ref();
        let ground = terrain.map(|terrain| Terrain::with_kept(scene, terrain, folders));
        let mut ground = ground.transpose()?;
        let origin = ground.as_ref().map_or_else(Vector3::zeros, |g| g.origin);
        let trees = rocks.iter().map(|r| SphereTree::new(&r.spheres)).collect();
        let mut model = Model::new(settings, rocks, trees, origin);
        model.shortcuts = options.shortcuts;
        let choice = match &mut ground {
            Some(ground) => lay_on_terrain(&mut model, ground, scene)?,
            None => None,
        };
        notices.extend(ground.iter().flat_map(|ground| ground.notices.iter().cloned()));
        model.ground = ground.map(Arc::new);
        let mut cautions = gate::of_scene(&model.settings, &model.rocks, scene)?;
        model.between = Between::new(model.laws.as_ref(), &model.settings, scene)?;
        model.pair_wholes = whole_pairs(model.laws.as_ref(), model.between.as_ref(), &model.rocks);
        enclose(&mut model, scene)?;
        gate::ground::check(&model, scene)?;
        if model.rocks.len() > 1 && model.between.is_none() {
            let what = "there is no table [[contact]]: the rocks fall through each other";
            let noticed = Diagnostic::warning(code::MISSING_KEY, what).about("rock");
            notices.push(noticed.try_instead("add one"));
        }
        if scene.has("structure") {
            touch_by_faces(&mut model);
        }
        model.steps = Steps::new(&model, scene)?;
        cautions.extend(gate::of_model(&model, scene)?);
        let options = options.clone();
        let mut it = Self { notices, cautions, choice, options, ..Self::of_model(model, scene, false) };
        are_apart(&it.model, &mut it.committed, scene)?;
        it.trial = it.committed.clone();
        Ok(it)
    }

    /// Where a rock touches the net for the first time is found in the first pass: in later ones the net gives way to it from the
    /// window's start on, in a straight line.
    fn keep_touches(&mut self, iteration: u32) {
        let bodies = self.trial.bodies.iter_mut().zip(&self.committed.bodies);
        for (first, (trial, before)) in self.touches.iter_mut().zip(bodies) {
            if iteration == 1 {
                *first = trial.track.touch;
            }
            if before.track.touch.is_none() && trial.track.touch.is_some() {
                trial.track.touch = first.or(trial.track.touch);
            }
        }
    }

    /// The solver of a model that has been prepared and checked. It writes no files, and keeps the rows of the trajectories where
    /// `keeps_rows` asks for them.
    pub fn of_model(model: Model, scene: &Scene, keeps_rows: bool) -> Self {
        let state = State::start(&model);
        Self {
            options: Options { out: None, shortcuts: model.shortcuts },
            model,
            notices: Vec::new(),
            cautions: Vec::new(),
            scene: scene.clone(),
            guarded: false,
            choice: None,
            run: None,
            committed: state.clone(),
            touches: vec![None; state.bodies.len()],
            trial: state,
            fields: None,
            trajectory: None,
            keeps_rows,
            resume: None,
        }
    }

    /// Its model, for another run with parts of it.
    pub fn into_model(self) -> Model {
        self.model
    }

    /// Rows of the trajectories in the window solved last; none where nobody asked for them.
    pub fn rows(&self) -> &[Row] {
        self.run.as_ref().map_or(&[], RockIntegrator::rows)
    }

    /// The same for a user's scene: it is not prepared with a rock inside the net.
    #[must_use]
    pub fn guarded(mut self) -> Self {
        self.guarded = true;
        self
    }

    /// What does not change in a run.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Why a contact selection that the scene names would choose nothing, where there is no net.
    pub fn idle_selection(&self) -> Option<&'static str> {
        let named = self.model.settings.dem.contact_selection != ContactSelection::Automatic;
        (named && self.model.ground.is_none()).then_some(
            "dem.contact_selection without terrain and without a structure: rocks touch each \
             other sphere by sphere, there is nothing to choose",
        )
    }

    /// What the user should know of the scene, before anything is known of a mesh.
    pub fn notices(&self) -> &[Diagnostic] {
        &self.notices
    }

    /// What the user should look at twice, before anything is known of a net.
    pub fn cautions(&self) -> &[Diagnostic] {
        &self.cautions
    }

    /// Refuse rocks that start with their surface in the net that the structure offers.
    pub fn check_net(&self, mesh: &InterfaceMesh) -> Result<Vec<Diagnostic>, Fault> {
        let net = ContactMesh::new(mesh)?.from(&self.model.origin);
        Ok(gate::start::in_net(&self.model, &net, &self.scene)?)
    }

    /// What was chosen where the scene leaves it open, and why.
    pub fn choice(&self) -> Option<&str> {
        self.choice.as_deref()
    }

    /// The committed state.
    pub fn state(&self) -> &State {
        &self.committed
    }

    /// Begin anew at t = 0 with rock number `rock` in another motion, its position in the user's
    /// coordinates; terrain and trees stay. To be called between prepare and the first solve.
    pub fn release(&mut self, rock: usize, motion: Motion) {
        let body = &mut self.committed.bodies[rock];
        self.model.settings.rocks[rock].position = motion.position.into();
        let motion = Motion { position: motion.position - self.model.origin, ..motion };
        *body = Body {
            histories: std::mem::take(&mut body.histories),
            terrain_histories: std::mem::take(&mut body.terrain_histories),
            box_histories: std::mem::take(&mut body.box_histories),
            ..Body::new(motion)
        };
        body.part();
        self.committed.between_rocks.end();
        (self.committed.time, self.committed.dissipated, self.committed.received) = (0.0, 0.0, 0.0);
        self.committed.broken = 0;
    }

    /// Let wires touch the faces of rocks, or, where the mesh has faces too, all of it their spheres.
    fn wires_touch_faces(&mut self, mesh: &ContactMesh, warnings: &mut Vec<Diagnostic>) -> Result<(), Fault> {
        let by_faces = |model: &Model| model.rocks.iter().any(|rock| rock.faces.is_some());
        let before = by_faces(&self.model);
        if !mesh.has_faces() {
            touch_by_faces(&mut self.model);
        } else if before {
            self.model.rocks.iter_mut().for_each(|rock| rock.faces = None);
            let what = "the structure's mesh has faces: it touches the rock's spheres, each by its own radius, whatever the law";
            warnings.push(Diagnostic::warning(code::TRUST, what).about("contact"));
        }
        if by_faces(&self.model) != before {
            self.model.steps =
                Steps::new(&self.model, &self.scene).map_err(|refused| Fault::input(refused.to_string()))?;
        }
        Ok(())
    }

    fn contact_mesh(
        &mut self,
        plan: &Plan,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Option<ContactMesh>, Fault> {
        let Some(mesh) = &plan.partner_mesh else { return Ok(None) };
        let mut contact_mesh = ContactMesh::new(mesh)?.from(&self.model.origin);
        let Some(laws) = &self.model.laws else {
            return Err(Fault::input(
                "there is a net and no contact law: the rock would fall through it; add a table [[contact]]",
            ));
        };
        if self.guarded {
            warnings.extend(gate::start::in_net(&self.model, &contact_mesh, &self.scene)?);
        }
        let selection = self.model.settings.dem.contact_selection;
        let (continuous, why) = selection.choose("net", || contact_mesh.unshared());
        if continuous {
            contact_mesh.crossings = Some(Crossings::new(&contact_mesh.nodes, &contact_mesh.elements));
        }
        if selection == ContactSelection::Automatic && !continuous {
            // Energy may be made or lost: the user should know.
            warnings.push(Diagnostic::warning(code::TRUST, why).about("dem.contact_selection"));
        } else {
            tracing::info!("{why}");
        }
        let materials = [STRUCTURE.to_owned()];
        self.model.rows = rows(laws, &self.model.settings, &materials)
            .map_err(|[what, advice]| Fault::input(format!("{what}; {advice}")))?;
        self.wires_touch_faces(&contact_mesh, warnings)?;
        let laws = self.model.laws.as_ref().expect("there are some");
        let yields = |n: &&u16| laws.surfaces[**n as usize].yielding.is_some();
        if let Some(number) = self.model.rows.iter().flatten().find(yields) {
            let name = laws.settings[usize::from(*number)].law.name();
            return Err(Fault::input(format!(
                "`{name}` is a contact of rocks with terrain, and here also of one with the net; add a table [[contact]] for the net"
            )));
        }
        if laws.use_local_masses() && contact_mesh.inverse_mass.is_none() {
            self.model.laws = Some(laws.clone().without_local_masses());
            let what = "the structure does not report its nodal masses: contacts damp with the rock's whole mass \
                        (effective_mass = \"rock\")";
            warnings.push(Diagnostic::warning(code::TRUST, what));
        }
        Ok(Some(contact_mesh))
    }
}

impl Solver for DemSolver {
    fn hello(&self) -> Hello {
        let field = |name, components, sampling, samples| FieldSpec {
            samples,
            ..FieldSpec::nodal(name, components, sampling)
        };
        Hello {
            program: format!("dem-solver {}", env!("CARGO_PKG_VERSION")),
            repeats: Some(0.0),
            capabilities: vec![capability::SELECTS.into(), capability::CHECKPOINT.into()],
            takes: vec![
                field(name::DISPLACEMENT, 3, Sampling::FromStart, MOST_SAMPLES),
                field(name::VELOCITY, 3, Sampling::FromStart, MOST_SAMPLES),
                FieldSpec { place: Place::Line, ..field(name::BROKEN, 1, Sampling::Once, 1) },
                field(name::FORCE, 3, Sampling::Means, MOST_SAMPLES),
                field(name::LOCAL_FORCE, 3, Sampling::Once, 1),
                field(name::LOCAL_FORCE_RATE, 3, Sampling::Once, 1),
                FieldSpec { place: Place::Pair, ..field(name::LOCAL_TANGENT, 9, Sampling::Once, 1) },
                FieldSpec { place: Place::Whole, ..field(name::LOCAL_DAMPING, 1, Sampling::Once, 1) },
                FieldSpec { place: Place::Whole, ..field(name::TRAVEL, 1, Sampling::Once, 1) },
            ],
            gives: vec![
                field(name::FORCE, 3, Sampling::Means, MOST_SAMPLES),
                field(name::FORCE, 3, Sampling::AtEnds, MOST_SAMPLES),
                field(name::REACH, 1, Sampling::Once, 1),
                field(name::DISPLACEMENT, 3, Sampling::AtEnds, MOST_SAMPLES),
                FieldSpec { place: Place::Whole, ..field(name::FREE_TIME, 1, Sampling::Once, 1) },
            ],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        check_plan(&self.hello(), plan)?;
        if plan.partner_mesh.is_none()
            && let Some(what) = self.idle_selection()
        {
            return Err(Fault::input(format!("{what}; leave it out")));
        }
        let mut warnings = [&self.notices[..], &self.cautions].concat();
        if plan.partner_mesh.is_some() {
            progress(Progress {
                what: "preparing contact with the structure's mesh".into(),
                done: f64::NAN,
                ..Progress::default()
            })?;
        }
        let contact_mesh = self.contact_mesh(plan, &mut warnings)?;
        self.committed = State::start(&self.model);
        let rows = self.keeps_rows || self.options.out.is_some();
        let mut run = RockIntegrator::new(&self.model, contact_mesh, plan, rows);
        run.reserve(&mut self.committed);
        let initial = run.initial(&self.model, &mut self.committed, plan)?;
        self.trial = self.committed.clone();
        run.reserve(&mut self.trial);
        self.run = Some(run);
        let mut resume = self.resume.take();
        self.open_files(resume.as_deref_mut())?;
        if let Some(kept) = resume {
            self.go_on(*kept);
        }
        let mesh = plan.partner_mesh.clone().unwrap_or_default();
        Ok(Ready { mesh, gauges: Gauges::declared(&self.model), initial, warnings, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let run = prepared(self.run.as_mut(), "to solve")?;
        let mut finer = self.committed.finer;
        loop {
            self.trial.copy(&self.committed);
            self.trial.finer = finer;
            match run.solve(&self.model, &mut self.trial, window, input, output)? {
                Solved::Done => {
                    self.keep_touches(window.iteration);
                    return Ok(());
                }
                Solved::TooCoarse if finer >= FINEST => {
                    return Err(Fault::window(format!(
                        "the contacts are so stiff, or nodes of the net so light, that {FINEST} times as many steps as \
                         dem.time_step makes are not enough; shorten it"
                    )));
                }
                Solved::TooCoarse => finer *= 2,
            }
        }
    }

    fn select(&mut self, selection: Option<&mut Selection>) -> Result<(), Fault> {
        prepared(self.run.as_mut(), "to select")?.select(selection.as_deref(), &mut self.committed);
        Ok(())
    }

    fn reach(&mut self, window: &Window, input: &[f64], nodes: &mut Vec<u32>) -> Result<(), Fault> {
        let run = prepared(self.run.as_mut(), "for its reach")?;
        run.reach(&self.model, &self.committed, window, input, nodes)
    }

    fn commit(&mut self) -> Result<(), Fault> {
        std::mem::swap(&mut self.committed, &mut self.trial);
        if let (Some(trajectory), Some(run)) = (&mut self.trajectory, &self.run) {
            trajectory.add(run.rows())?;
        }
        self.write_fields()
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        let run = prepared(self.run.as_ref(), "for its state")?;
        let (integrator, state) = run.kept(&self.committed);
        let fields = self.fields.as_mut().map(FieldFiles::kept).transpose()?;
        let trajectory = self.trajectory.as_ref().map(Trajectory::kept).transpose()?;
        Ok(pack(&Kept { state, integrator, fields, trajectory }))
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.resume = Some(Box::new(unpack(state)?));
        Ok(())
    }

    fn has_ended(&self) -> bool {
        self.model.ground.is_some() && self.committed.bodies.iter().all(|b| b.path.ending.is_some())
    }

    fn is_at_rest(&self) -> bool {
        let settings = &self.model.settings;
        let rests = |body: &Body| body.path.ending.is_some() || body.track.rests(settings, self.trial.time);
        self.trial.bodies.iter().all(rests)
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let counts = self.run.as_ref().map(RockIntegrator::counts).unwrap_or_default();
        let net = self.run.as_ref().and_then(RockIntegrator::net);
        let verdicts = verdict::verdicts(&self.model, &self.committed, net);
        let mut out = Statistics { verdicts, counts, ..Statistics::default() };
        measures::results(&self.model, &self.committed, net.is_some(), &mut out);
        self.trajectories(&mut out);
        let unwritten = self.fields.as_mut().and_then(|fields| fields.finish().err());
        out.warnings.extend(unwritten.map(results::not_written));
        Ok(out)
    }
}

impl DemSolver {
    /// Open the files of results: new ones, or those of a run that goes on from `kept`.
    fn open_files(&mut self, kept: Option<&mut Kept>) -> Result<(), Fault> {
        (self.fields, self.trajectory) = (None, None);
        let Some(out) = self.options.out.clone() else { return Ok(()) };
        let (fields, trajectory) = match kept {
            Some(kept) => (kept.fields.take(), kept.trajectory.take()),
            None => (None, None),
        };
        if let Some(interval) = self.model.settings.fields {
            let dir = out.join("fields");
            match fields {
                Some(kept) => self.fields = Some(FieldFiles::go_on(&dir, interval, &self.model, kept)?),
                None => {
                    self.fields = Some(FieldFiles::create(&dir, interval, &self.model)?);
                    self.write_fields()?;
                }
            }
        }
        if self.model.ground.is_some() && self.model.settings.named() > 0 {
            self.trajectory = Some(match trajectory {
                Some(mark) => Trajectory::go_on(&out, &mark)?,
                None => Trajectory::create(&out, &self.model, &self.committed)?,
            });
        }
        Ok(())
    }

    /// Stand where `kept` was.
    fn go_on(&mut self, kept: Kept) {
        let Some(run) = &mut self.run else { return };
        run.go_on(kept.integrator);
        self.committed = kept.state;
        run.reserve(&mut self.committed);
        self.trial = self.committed.clone();
        run.reserve(&mut self.trial);
    }

    /// Measures of the trajectories over the terrain, and their picture.
    fn trajectories(&self, out: &mut Statistics) {
        let Some(ground) = &self.model.ground else { return };
        for at in 0..self.model.settings.named() {
            measures::of_trajectory(&self.model, ground, at, &self.committed, out);
        }
        let (Some(trajectory), Some(dir)) = (&self.trajectory, &self.options.out) else { return };
        let trajectories = trajectory::trajectories(&self.model, ground, &trajectory.rows);
        let fields = self.fields.as_ref().map_or(Ok(()), |fields| fields.write_trajectories(&trajectories));
        let (path, bodies) = (dir.join(map::PICTURE), &self.committed.bodies);
        let mesh = self.run.as_ref().and_then(|run| Some(run.net()?.0));
        let system = Imprint::system(&self.scene, self.model.settings.terrain.as_ref());
        let title = self.scene.read("title").ok().flatten();
        let imprint = Imprint::new(title, &dir.join(run_dir::RECORD), system);
        for (name, written) in [
            (map::PICTURE, map::write(&path, &self.model, ground, &trajectories, bodies, mesh, &imprint)),
            (fields::TRAJECTORIES, fields),
        ] {
            if let Err(e) = written {
                let what = format!("{name} cannot be written: {e}");
                out.warnings.push(Diagnostic::warning(code::NOT_WRITTEN, what));
            }
        }
    }

    fn write_fields(&mut self) -> Result<(), Fault> {
        let (model, state) = (&self.model, &self.committed);
        self.fields.as_mut().map_or(Ok(()), |fields| fields.write_if_due(model, state))
    }
}

fn prepared<T>(run: Option<T>, what: &str) -> Result<T, Fault> {
    run.ok_or_else(|| Fault::broken(format!("asked {what} before it was prepared")))
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
