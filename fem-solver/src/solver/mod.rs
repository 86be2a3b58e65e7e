//! The structure as a [`Solver`]: the contract's verbs, and nothing else.

pub mod check;
pub mod export;
pub mod reference;
pub mod site;

use crate::config::Config;
use crate::config::scheme::Scheme;
use crate::equilibrium::form_finding::Form;
use crate::equilibrium::newton::Info;
use crate::integrator::interface_force::{Loads, MOST_SAMPLES, Needs};
use crate::integrator::local;
use crate::integrator::start::Start;
use crate::integrator::window::{Exchange, KeptWindows, WindowSolver, other_structure};
use crate::internal_force::assembly::Event;
use crate::internal_force::tangent::scale_masses;
use crate::model::Model;
use crate::model::rope_ends::{self, RopeEnd};
use crate::results::energy::Energies;
use crate::results::fields::{Fields, KeptFields};
use crate::results::parts;
use crate::results::record::{MEANS, Probes, Recorder};
use crate::state::inherited::{End, Inherited};
use crate::state::{Critical, Peak, State};
use interface_defs::diagnostic::{Code, Diagnostic, Place, Severity, code};
use interface_defs::field::{self, FieldSpec, Sampling, name};
use interface_defs::message::{
    Fault, Gauge, Hello, Measure, Plan, Progress, Ready, Statistics, Worse, capability,
};
use interface_defs::selection::Selection;
use interface_defs::solver::{OnProgress, Solver, Window};
use interface_defs::verdict::Torn;
use serde::{Deserialize, Serialize};
use std::array::from_fn;
use std::ops::Range;
use std::rc::Rc;
use toolkit::checkpoint::{pack, unpack};
use toolkit::output::Output;
use toolkit::program::Options;
use toolkit::run_dir;
use toolkit::scene::Scene;
use toolkit::start_from::At;

/// Steps within a mean of the reaction and a window for which memory is set aside, at most.
const MOST_REMEMBERED: f64 = 2e5;
/// Share of its time at which a run has come to its end, but for rounding.
const AT_END: f64 = 1e-9;
/// Windows are halved that often before a run gives up.
const HALVINGS: f64 = 64.0;
/// Most ruptures or yielding elements that are named one by one.
const MOST_NAMED: usize = 20;
/// Ranks of `max_reaction_1ms`, `max_cable_force`, `max_reaction`, `sag` and `max_reaction_10ms` among all measures of a run.
const RANKS: [u16; 5] = [60, 70, 260, 270, 65];

/// A structure of cables, springs and masses.
pub struct FemSolver {
    scene: Scene,
    config: Config,
    options: Options,
    field_interval: Option<f64>,
    model: Rc<Model>,
    probes: Probes,
    gauges: Vec<Gauge>,
    /// State from which the structure starts, if not as modelled.
    inherited: Option<Inherited>,
    /// The state from which it is to go on.
    resume: Option<Box<Kept>>,
    prepared: Option<Prepared>,
}

/// Data that exist from the preparation on.
struct Prepared {
    windows: WindowSolver,
    fields: Option<Fields>,
    sag: Option<f64>,
    /// The form that was found, and what that took.
    form: (Form, Info),
    /// End of the last window solved [s].
    time: f64,
    /// End of the last window accepted, and of the run [s].
    accepted: f64,
    end_time: f64,
    /// Lines whose rupture the answer reports; none if nobody asks.
    broken: Option<BrokenLines>,
    /// Ruptures before the run.
    torn: Vec<Event>,
    /// Whether something touches the structure from outside.
    touched: bool,
    rope_ends: Vec<RopeEnd>,
}

impl Prepared {
    /// Say in `output` which lines are broken, by `now` or before the run.
    fn report_broken(&self, now: &[Event], output: &mut [f64]) {
        if let Some(lines) = &self.broken
            && let Some(at) = self.windows.place(name::BROKEN)
        {
            lines.write(self.torn.iter().chain(now), &mut output[at]);
        }
    }

    /// Write the committed state at `time` to the field files, if there are any and it is their turn.
    fn offer_fields(&mut self, time: f64) -> Result<(), Fault> {
        let Some(fields) = &mut self.fields else { return Ok(()) };
        fields.offer(&self.windows.origin, &self.windows.committed, time).map_err(unwritten)
    }
}

impl FemSolver {
    /// The structure of `scene`. Computes nothing yet; what is wrong with the scene's numbers is found
    /// here, what only form finding shows in [`Solver::prepare`] and by `check`.
    pub fn new(scene: &Scene, options: &Options) -> Result<Self, Diagnostic> {
        let config = Config::of(scene)?;
        let mut model = Model::build(scene, &config)?;
        if let Some(step) = config.fem.mass_scaling {
            scale_masses(&mut model, step);
        }
        let inherited = Inherited::of(scene, &model, config.fem.integrator)?;
        let (probes, recorded) = Recorder::probes(scene, &model, &config.gauges)?;
        let mut gauges = Energies::gauges(&model);
        gauges.extend(recorded);
        let field_interval = if scene.has("output") { Output::of(scene)?.fields } else { None };
        Ok(Self {
            scene: scene.clone(),
            config,
            options: options.clone(),
            field_interval,
            model: Rc::new(model),
            probes,
            gauges,
            inherited,
            resume: None,
            prepared: None,
        })
    }

    /// The structure as numbers.
    pub fn model(&self) -> &Model {
        &self.model
    }

    fn prepared(&mut self) -> Result<&mut Prepared, Fault> {
        let missing = || Fault::broken("a window was asked for before the preparation");
        self.prepared.as_mut().ok_or_else(missing)
    }

    /// Make ready for windows from `start`, under a plan that has been checked.
    pub(crate) fn begin(&mut self, mut start: Start, plan: &Plan) -> Result<Ready, Fault> {
        let mesh = self.model.interface_mesh(&start.form.displacement);
        let (loads, load_warnings) =
            Loads::new(Needs::of(Scheme::of(&self.config.fem)), plan, &mesh, self.model.dof_count())?;
        let step = start.time_step.min(plan.window);
        // Steps are that short for longer than 1 ms where hardly any run goes on.
        let shortest = [step / HALVINGS, 0.5 * step];
        let samples: [usize; 2] =
            from_fn(|i| ((MEANS[i] + plan.window) / shortest[i]).min(MOST_REMEMBERED) as usize + 16);
        let recorder = Recorder::new(&self.model, &self.probes, &start.form, &start.force, samples);
        let warnings = [&start.warnings[..], &load_warnings].concat();
        let sag = self.model.sag(&start.form.displacement);
        let form = (start.form.clone(), start.form_finding);
        start.newton.keeps_factor = self.options.shortcuts;
        let exchange = Exchange { recorder, loads, plan, mesh: &mesh, shortcuts: self.options.shortcuts };
        let mut windows = WindowSolver::new(&self.model, &self.config, start, exchange);
        let (_, answer) = interface_defs::participant::payload_lengths(
            plan,
            &Ready { mesh: mesh.clone(), gauges: self.gauges.clone(), ..Ready::default() },
        );
        let mut initial = vec![0.0; answer];
        windows.initial(&mut initial);
        let broken = windows.place(name::BROKEN).map(|_| BrokenLines::new(&self.model));
        let torn = self.inherited.as_ref().map_or(Vec::new(), |from| from.end.torn.clone());
        let mut prepared = Prepared {
            form,
            windows,
            fields: None,
            sag,
            time: 0.0,
            accepted: 0.0,
            end_time: plan.end_time,
            broken,
            torn,
            touched: !plan.takes.is_empty(),
            rope_ends: self.model.rope_ends(),
        };
        prepared.report_broken(&[], &mut initial);
        let resume = self.resume.take();
        let resumes = resume.is_some();
        let mut kept_fields = None;
        if let Some(kept) = resume {
            prepared.windows.go_on(kept.windows)?;
            (prepared.time, prepared.accepted, kept_fields) = (kept.accepted, kept.accepted, kept.fields);
        }
        if let (Some(out), Some(interval)) = (&self.options.out, self.field_interval) {
            let dir = out.join(run_dir::FIELDS);
            let fields =
                Fields::create(&dir, interval, &mesh, &self.model, kept_fields).map_err(unwritten)?;
            prepared.fields = Some(fields);
            if !resumes {
                prepared.offer_fields(0.0)?;
            }
        }
        self.prepared = Some(prepared);
        Ok(Ready { mesh, gauges: self.gauges.clone(), initial, warnings, ..Ready::default() })
    }

    /// Leave the state at the end for a run that starts from it: that of a run that has come to its end, and no other.
    /// Returns what the user should know.
    fn leave_state(&self, prepared: &Prepared) -> Option<Diagnostic> {
        let out = self.options.out.as_ref()?;
        if prepared.accepted < prepared.end_time * (1.0 - AT_END) {
            return None;
        }
        let path = out.join(run_dir::STRUCTURE_STATE);
        let (state, name) = (&prepared.windows.committed, self.config.fem.integrator.to_string());
        let end = End::new(&self.model, state, prepared.accepted, &name, &prepared.torn);
        let why = end.write(&path).err()?;
        let what = format!("it cannot be written, so no run can start from this one: {why}");
        Some(Diagnostic::warning(code::NOT_WRITTEN, what).at(Place::file(path.display())))
    }

    /// Refuse a plan that asks for what this solver has not declared.
    fn check_plan(&self, plan: &Plan) -> Result<(), Fault> {
        let known = |fields: &[FieldSpec], asked: &FieldSpec, any_sampling: bool| {
            let what = |f: &FieldSpec| (f.name.clone(), f.components, f.place);
            let fits =
                |f: &FieldSpec| what(f) == what(asked) && (any_sampling || f.sampling == asked.sampling);
            fields.iter().any(fits) && (1..=MOST_SAMPLES).contains(&asked.samples)
        };
        let hello = self.hello();
        if let Some(asked) = plan.gives.iter().find(|asked| !known(&hello.gives, asked, false)) {
            return Err(Fault::input(format!("fem-solver cannot give the field {asked:?}")));
        }
        if self.config.fem.path_speed.is_some() && !plan.takes.is_empty() {
            let what = "fem.path_speed follows a path of equilibrium, which no force from outside acts on";
            return Err(Fault::input(what));
        }
        let means = |asked: &FieldSpec| matches!(asked.sampling, Sampling::Means | Sampling::AtEnds);
        match plan.takes.iter().find(|asked| !known(&hello.takes, asked, means(asked))) {
            Some(asked) => Err(Fault::input(format!("fem-solver cannot take the field {asked:?}"))),
            None => Ok(()),
        }
    }
}

/// Warnings of one kind: the first ones one by one, and how many more `did` until the last one, at its time [s].
fn named<T>(
    code: Code,
    all: &[T],
    words: impl Fn(&T) -> String,
    (did, time): (&str, impl Fn(&T) -> f64),
) -> Vec<Diagnostic> {
    let mut named: Vec<_> = all.iter().take(MOST_NAMED).map(words).collect();
    if let Some(last) = all.get(MOST_NAMED..).and_then(|rest| rest.last()) {
        named.push(format!("{} more {did} until t = {:.6} s", all.len() - MOST_NAMED, time(last)));
    }
    named.into_iter().map(|what| Diagnostic::warning(code.clone(), what)).collect()
}

/// Ruptures.
fn ruptures(model: &Model, events: &[Event]) -> Vec<Diagnostic> {
    let words = |event: &Event| {
        let (time, force) = (event.time, event.tension);
        let member = model.member_name(event.element as usize, None);
        format!("rupture at t = {time:.6} s: {member} broke under {force:.4e} N")
    };
    named(code::RUPTURE, events, words, ("broke", |event: &Event| event.time))
}

/// Elements that have yielded, with the largest plastic strain that each is left with.
fn yields(model: &Model, committed: &State) -> (Option<Measure>, Vec<Diagnostic>) {
    let mut all: Vec<(usize, f64, f64)> = Vec::new();
    for (number, (element, own)) in model.elements.iter().zip(model.histories()).enumerate() {
        let strain = element.constants().plastic.map_or(0.0, |at| committed.history[own][at]);
        if strain > 0.0 {
            let event = committed.yields.iter().find(|event| event.element as usize == number);
            all.push((number, strain, event.map_or(0.0, |event| event.time)));
        }
    }
    let most = all.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(number, strain, time)| {
        let measure = Measure::new("max_plastic_strain", *strain, "1").at(*time);
        let member = model.member_name(*number, None);
        measure.of_member(Some(member)).ranked(Measure::ORDINARY, Worse::Larger)
    });
    all.sort_by(|a, b| a.2.total_cmp(&b.2));
    let words = |(number, strain, time): &(usize, f64, f64)| {
        let member = model.member_name(*number, None);
        format!(
            "yield at t = {time:.6} s: {member}; its largest plastic strain is {:.2} % at the end",
            100.0 * strain
        )
    };
    (most, named(code::YIELD, &all, words, ("yielded", |all: &(usize, f64, f64)| all.2)))
}

/// The element that came closest to breaking: whether it does depends on small differences, and with it what breaks after it.
fn near_ruptures(model: &Model, state: &State) -> Option<Diagnostic> {
    let near = state.close.iter().chain(&state.spared);
    let (element, share) = near.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let member = model.member_name(*element as usize, None);
    let (tore, share) = (state.events.len(), 100.0 * share);
    let depends = match tore {
        0 => "whether anything tears".to_owned(),
        1 => "what tore (1 element)".to_owned(),
        _ => format!("what tore ({tore} elements)"),
    };
    let what = format!("{depends} depends on the step: {member} came to {share:.1} % of its strength");
    let cure = "run it with --refine, or move the start by millimetres: what tears then, too, is certain";
    Some(Diagnostic::warning(code::NEAR_RUPTURE, what).try_instead(cure))
}

/// A warning if something was torn before the run.
fn torn_before(count: usize) -> Option<Diagnostic> {
    let were = if count == 1 { "1 element was".to_owned() } else { format!("{count} elements were") };
    let what = format!("{were} torn before, in the run that this one starts from");
    (count > 0).then(|| Diagnostic::warning(code::RUPTURE, what))
}

/// Ruptures of each part, in the order of its first one; `None` where nothing can break.
fn torn(model: &Model, events: &[Event]) -> Option<Vec<Torn>> {
    if events.is_empty() {
        return model.elements.iter().any(|e| e.constants().can_break).then(Vec::new);
    }
    let mut all: Vec<Torn> = Vec::new();
    for event in events {
        let element = event.element as usize;
        let part = model.part_of(0, element);
        let part = part.map_or("the structure", |part| part.name.as_str());
        match all.iter_mut().find(|torn| torn.part == part) {
            Some(torn) => (torn.elements, torn.last) = (torn.elements + 1, event.time),
            None => all.push(Torn {
                part: part.into(),
                elements: 1,
                first: event.time,
                last: event.time,
                force: event.tension,
                member: model.member_name(element, None),
            }),
        }
    }
    Some(all)
}

/// The limit points and branch points of a path, and the first of them.
fn critical_loads(state: &State) -> Vec<Measure> {
    let measure = |name: String, point: &Critical| Measure::new(name, point.factor, "1").at(point.time);
    let first = state.critical.first().map(|point| measure("critical_load_factor".into(), point));
    let mut counts = [0, 0];
    let all = state.critical.iter().map(|point| {
        let count = &mut counts[point.kind as usize];
        *count += 1;
        measure(format!("{}_point_{count}", point.kind.name()), point)
    });
    first.into_iter().chain(all).collect()
}

/// A warning if a path goes on unstable, and from where.
fn unstable_path(state: &State) -> Option<Diagnostic> {
    let (time, factor) = state.along.unstable_from?;
    let (at, time, factor) = match state.critical.iter().find(|p| p.negative > 0) {
        Some(point) => (format!("the {} point at ", point.kind.name()), point.time, point.factor),
        None => (String::new(), time, factor),
    };
    let what = format!(
        "the path of equilibrium is unstable from {at}t = {time:.6} s, load factor {factor:.6e}: under these loads alone the \
         structure snaps or buckles there"
    );
    let hint = "the column negative_pivots says where it is stable again";
    Some(Diagnostic::warning(code::TRUST, what).try_instead(hint))
}

impl Solver for FemSolver {
    fn hello(&self) -> Hello {
        let given = |name| FieldSpec { samples: MOST_SAMPLES, ..FieldSpec::nodal(name, 3, Sampling::AtEnds) };
        let mut gives = vec![given(name::DISPLACEMENT), given(name::VELOCITY)];
        if self.model.elements.iter().any(|element| element.constants().can_break) {
            let broken = FieldSpec::nodal(name::BROKEN, 1, Sampling::Once);
            gives.push(FieldSpec { place: field::Place::Line, ..broken });
        }
        gives.push(FieldSpec {
            place: field::Place::Whole,
            ..FieldSpec::nodal(name::TRAVEL, 1, Sampling::Once)
        });
        gives.extend(local::offered(&self.model, &self.config.fem).unwrap_or_default());
        Hello {
            program: concat!("fem-solver ", env!("CARGO_PKG_VERSION")).into(),
            capabilities: vec![capability::SELECTS.into(), capability::CHECKPOINT.into()],
            repeats: Some(0.0),
            takes: Needs::of(Scheme::of(&self.config.fem)).fields(),
            gives,
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        self.check_plan(plan)?;
        if !plan.takes.is_empty()
            && let Err(why) = local::offered(&self.model, &self.config.fem)
        {
            tracing::info!(
                "the structure offers no forces and tangents for a net that yields in the contact solver: {why}"
            );
        }
        let mut report = |what| progress(Progress { what, done: f64::NAN, ..Progress::default() });
        let (known, inherited) = (self.resume.as_ref().map(|kept| &kept.form), self.inherited.as_ref());
        let start = Start::new(&self.scene, &self.config, &self.model, inherited, known, &mut report)?;
        self.begin(start, plan)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let prepared = self.prepared()?;
        prepared.time = window.end();
        prepared.windows.solve(window, input, output)?;
        prepared.report_broken(&prepared.windows.trial.events, output);
        Ok(())
    }

    fn is_at_rest(&self) -> bool {
        let Some(prepared) = &self.prepared else { return false };
        let model = &self.model;
        let changes = model.until.iter().any(|until| *until > prepared.time);
        !changes && model.moving.is_empty() && model.timed.is_empty() && prepared.windows.trial.rests()
    }

    fn commit(&mut self) -> Result<(), Fault> {
        self.prepared()?.windows.commit();
        let prepared = self.prepared.as_mut().expect("asked for above");
        prepared.accepted = prepared.time;
        rope_ends::watch(&prepared.rope_ends, &self.model, &mut prepared.windows.committed, prepared.time);
        prepared.offer_fields(prepared.time)
    }

    fn select(&mut self, selection: Option<&mut Selection>) -> Result<(), Fault> {
        let prepared = self.prepared()?;
        if let Some(broken) = &mut prepared.broken {
            broken.select(selection.as_deref());
        }
        prepared.windows.select(selection);
        Ok(())
    }

    fn committed(&mut self, output: &mut [f64]) -> Result<(), Fault> {
        let prepared = self.prepared()?;
        prepared.windows.write_committed(prepared.accepted, output);
        prepared.report_broken(&prepared.windows.committed.events, output);
        Ok(())
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        let prepared = self.prepared()?;
        let fields = prepared.fields.as_mut().map(Fields::kept).transpose().map_err(unwritten)?;
        let (form, windows) = (prepared.form.clone(), prepared.windows.kept());
        Ok(pack(&Kept { form, windows, accepted: prepared.accepted, fields }))
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        let kept: Kept = unpack(state)?;
        let Form { displacement, history, .. } = &kept.form.0;
        if (displacement.len(), history.len()) != (self.model.dof_count(), self.model.start_history().len()) {
            return Err(other_structure());
        }
        self.resume = Some(Box::new(kept));
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let fields = self.prepared.as_mut().and_then(|prepared| prepared.fields.as_mut());
        let lost = fields.and_then(|fields| fields.finish().err()).map(|error| {
            Diagnostic { severity: Severity::Warning, ..*unwritten(error).diagnostic }
                .coded(code::NOT_WRITTEN)
        });
        let Some(prepared) = &self.prepared else {
            return Err(Fault::broken("asked for results before the preparation"));
        };
        let (model, committed) = (&self.model, &prepared.windows.committed);
        let (peaks, events) = (committed.peaks, &committed.events);
        let (mut measures, mut warnings) = (Vec::new(), ruptures(model, events));
        let (plastic, yielded) = yields(model, committed);
        measures.extend(plastic);
        warnings.extend(yielded);
        warnings.extend(near_ruptures(model, committed));
        warnings.extend(rope_ends::warnings(&prepared.rope_ends, model, committed));
        warnings.extend(torn_before(prepared.torn.len()));
        if let Some(first) = events.first()
            && prepared.touched
            && prepared.broken.is_none()
        {
            let (from, count) = (first.time, events.len());
            let what = format!(
                "what is broken is still touched, from t = {from:.6} s on ({count} elements): the contact solver does not take the \
                 field \"broken\""
            );
            warnings.push(Diagnostic::warning(code::TRUST, what));
        }
        if model.is_supported() {
            measures.push(peak("max_reaction", peaks.reaction, RANKS[2]));
            measures.push(peak("max_reaction_1ms", peaks.mean_reaction[0], RANKS[0]));
            if model.vibrates() {
                measures.push(peak("max_reaction_10ms", peaks.mean_reaction[1], RANKS[4]));
            }
        } else {
            warnings.push(Diagnostic::absent("max_reaction", "the structure has no supports"));
        }
        if model.lines().next().is_none() {
            warnings.push(Diagnostic::absent("max_cable_force", "the structure has no cables"));
        } else {
            measures.push(peak("max_cable_force", peaks.cable_force, RANKS[1]));
            measures.push(Measure::new("cable_force_beside", peaks.cable_force_beside, "N"));
        }
        measures.extend(self.probes.measures(&self.config.gauges, model, committed, prepared.time));
        match prepared.sag {
            Some(sag) => measures.push(Measure::new("sag", sag, "m").ranked(RANKS[3], Worse::Larger)),
            None => {
                let why = "no weight acts on the structure, or nothing is held";
                warnings.push(Diagnostic::absent("sag", why));
            }
        }
        warnings.extend(self.leave_state(prepared));
        measures.extend(critical_loads(committed));
        warnings.extend(unstable_path(committed));
        let counts = &prepared.windows.counts;
        // The books of a run that starts at rest begin anew.
        let anew = self.inherited.as_ref().is_some_and(|from| from.origin.at == At::Rest);
        let before = anew.then_some(&prepared.form.0);
        warnings.extend(counts.warnings(model, self.config.fem.load_steps.is_some()));
        warnings.extend(lost);
        Ok(Statistics {
            measures,
            torn: torn(model, events),
            parts: Some(parts::used(model, committed, prepared.windows.energy(), before)),
            counts: counts.named(),
            warnings,
            ..Statistics::default()
        })
    }
}

fn unwritten(error: std::io::Error) -> Fault {
    Fault::broken(format!("the field files of the structure cannot be written: {error}"))
}

/// The largest force of a run.
fn peak(name: &str, peak: Peak, rank: u16) -> Measure {
    Measure::new(name, peak.value, "N").at(peak.time).ranked(rank, Worse::Larger)
}

/// The lines of each element, and where an answer speaks of them.
struct BrokenLines {
    /// Lines of each element in the interface mesh, where those of the fast kernel come first.
    of_elements: Vec<Range<usize>>,
    /// Place of each line of the mesh in the field, [`Selection::OUT`] where it is not selected.
    place: Vec<u32>,
}

impl BrokenLines {
    /// Of all lines of `model`.
    fn new(model: &Model) -> Self {
        let mut next = model.cables.len();
        let lines = model.elements.iter().map(|element| {
            let first = next;
            next += element.constants().lines;
            first..next
        });
        let of_elements = lines.collect();
        Self { of_elements, place: (0..next as u32).collect() }
    }

    /// Speak of the selected lines alone, or of all.
    fn select(&mut self, selection: Option<&Selection>) {
        let Some(selection) = selection else {
            return self.place.iter_mut().enumerate().for_each(|(line, place)| *place = line as u32);
        };
        self.place.fill(Selection::OUT);
        for (place, line) in selection.lines.iter().enumerate() {
            self.place[*line as usize] = place as u32;
        }
    }

    /// Write 1 for each line that broke in `events`, else 0.
    fn write<'a>(&self, events: impl Iterator<Item = &'a Event>, flags: &mut [f64]) {
        flags.fill(0.0);
        for line in events.flat_map(|event| self.of_elements[event.element as usize].clone()) {
            if let Some(flag) = flags.get_mut(self.place[line] as usize) {
                *flag = 1.0;
            }
        }
    }
}

/// All that the next windows follow from.
#[derive(Serialize, Deserialize)]
struct Kept {
    /// The form at t = 0 and what it took, so that it is not looked for again.
    form: (Form, Info),
    windows: KeptWindows,
    /// End of the last window accepted [s].
    accepted: f64,
    fields: Option<KeptFields>,
}
