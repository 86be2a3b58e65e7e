//! The start of a run: who is there, what crosses the interface, where the interface mesh comes from.

use crate::guard::{self, breach, clause};
use crate::interface::Interface;
use crate::mapping::map;
use crate::observer::KeptRun;
use crate::passing::{self, Common, Passing};
use crate::patch::Patch;
use crate::rows::OWN_COLUMNS;
use crate::settings::{CouplingSettings, Scheme};
use crate::side::Side;
use interface_defs::{
    Code, Diagnostic, Failure, Fault, FaultKind, FieldSpec, Hello, InterfaceMesh, OnProgress, Participant,
    Plan, Sampling, capability, code, name,
};
use std::collections::HashMap;

/// What is agreed with both.
pub struct Agreement {
    /// The interface at t = 0.
    pub interface: Interface,
    /// What is known of the structure's motion, and of the contact solver's bodies, to be checked.
    pub motion: guard::Motion,
    /// The bodies.
    pub bodies: guard::Bodies,
    /// Both meshes at t = 0.
    pub meshes: [InterfaceMesh; 2],
    /// The contact solver.
    pub dem: Side,
    /// The structure's solver.
    pub fem: Side,
    /// The part of the net that crosses the interface; `None`: all of it, always.
    pub patch: Option<Patch>,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
}

impl Agreement {
    /// Longest window that both solve [s].
    pub fn largest_window(&self) -> f64 {
        self.dem.hello.largest_window.min(self.fem.hello.largest_window)
    }

    /// The program that cannot write its state down, if there is one.
    pub fn forgetful(&self) -> Option<&str> {
        let forgets = |hello: &&Hello| !hello.can(capability::CHECKPOINT);
        [&self.dem.hello, &self.fem.hello].into_iter().find(forgets).map(|hello| hello.program.as_str())
    }
}

/// Agree with both solvers. The structure is prepared first: the contact solver works on its interface mesh. With `resume` both
/// go on from states that they gave.
pub fn agree(
    settings: &CouplingSettings,
    end_time: f64,
    dem: &mut dyn Participant,
    fem: &mut dyn Participant,
    resume: Option<&KeptRun>,
    progress: OnProgress,
) -> Result<Agreement, Failure> {
    let _span = interface_defs::profile!("prepare");
    let (dem_hello, fem_hello) = (dem.hello()?, fem.hello()?);
    for (solver, hello) in [(dem.name(), &dem_hello), (fem.name(), &fem_hello)] {
        tracing::info!("{solver} is {}", hello.program);
        check_capabilities(settings, solver, hello)?;
        check_scene(settings, solver, hello)?;
    }
    if let Some(kept) = resume {
        fem.resume(&kept.fem)?;
        dem.resume(&kept.dem)?;
    }
    let fields = choose_fields(settings, &dem_hello, &fem_hello)?;
    let plan = |takes: &[FieldSpec], gives: &[FieldSpec]| Plan {
        end_time,
        // Longer windows are of flights alone.
        window: settings.time_window,
        takes: takes.to_vec(),
        gives: gives.to_vec(),
        ..Plan::default()
    };
    let fem_plan = plan(&fields.to_fem, &fields.from_fem);
    let mut fem_ready = fem.prepare(&fem_plan, progress)?;
    guard::check_ready(fem.name(), &fem_plan.gives, &fem_ready)?;
    let mut dem_plan = plan(&fields.to_dem, &fields.from_dem);
    let structure_mesh = fem_ready.mesh.clone();
    dem_plan.partner_mesh = Some(structure_mesh.clone());
    let mut dem_ready = dem.prepare(&dem_plan, progress)?;
    guard::check_ready(dem.name(), &dem_plan.gives, &dem_ready)?;

    if fields.broken.is_some() && structure_mesh.lines != dem_ready.mesh.lines {
        let what = "it takes the field \"broken\", and its mesh has other lines than the structure's";
        return Err(breach(dem.name(), clause::MESH, what));
    }
    let contradiction = |what| refuse(Diagnostic::error(code::CONTRADICTION, what));
    fields.common.check(&structure_mesh, &dem_ready.mesh).map_err(contradiction)?;
    let (mapping, quality) = map(settings.mapping.as_ref(), &structure_mesh, &dem_ready.mesh)
        .map_err(|why| refuse(why.about("coupling.mapping")))?;
    let mut warnings = std::mem::take(&mut fem_ready.warnings);
    warnings.append(&mut dem_ready.warnings);
    if let Some(quality) = quality {
        tracing::info!("mapping: {quality}");
        warnings.extend(quality.warnings());
    }

    let meshes = [dem_ready.mesh.clone(), structure_mesh.clone()];
    let dem_side = Side::new(dem.name(), dem_hello, &dem_plan, dem_ready);
    let fem_side = Side::new(fem.name(), fem_hello, &fem_plan, fem_ready);
    check_names(&dem_side, &fem_side)?;
    let patch = (!fields.local.is_empty() && mapping.is_identity() && fields.common.is_empty())
        .then(|| Patch::new(structure_mesh, settings.rings));
    let last = |name| {
        let range = fem_side.layout.last(name, Sampling::AtEnds).expect("chosen for every structure");
        &fem_side.initial[range]
    };
    let (u, v) = (last(name::DISPLACEMENT), last(name::VELOCITY));
    let motion = guard::Motion::new(u, v, settings.time_window);
    let bodies = guard::Bodies::new(&dem_side, settings.time_window);
    let sides = (&dem_side, &fem_side);
    let mut interface = Interface::new(mapping, sides, settings.samples as usize, (u, v));
    let unknown = fields.local.iter().chain(&fields.broken);
    interface.passing = Passing::new(&fields.common, unknown, &dem_side, &fem_side);
    if settings.measures_force() {
        interface.follow_force().map_err(|what| {
            refuse(of_key("measure", code::CONTRADICTION, format!("{}: {what}", dem_side.program)))
        })?;
    }
    Ok(Agreement { interface, motion, bodies, meshes, dem: dem_side, fem: fem_side, patch, warnings })
}

/// A column of the results belongs to one gauge of one program.
fn check_names(dem: &Side, fem: &Side) -> Result<(), Failure> {
    let own = OWN_COLUMNS.iter().map(|column| ((*column).to_owned(), "coupler"));
    let gauges = |side| Side::columns(side).map(|column| (column, side.program.as_str()));
    let mut owners = HashMap::new();
    for (column, program) in own.chain(gauges(dem)).chain(gauges(fem)) {
        let Some(first) = owners.insert(column.clone(), program) else { continue };
        let what = match first == program {
            true => format!("{program} has two gauges with the column {column}"),
            false => format!("{first} and {program} both have a gauge with the column {column}"),
        };
        return Err(refuse(
            Diagnostic::error(code::NAME_TAKEN, what).try_instead("rename a rock or a gauge"),
        ));
    }
    Ok(())
}

fn check_capabilities(settings: &CouplingSettings, solver: &str, hello: &Hello) -> Result<(), Failure> {
    let program = &hello.program;
    if settings.scheme == Scheme::Strong && hello.repeats.is_none() {
        let what = format!(
            "strong coupling repeats windows, and {solver} ({program}) says that it cannot repeat one"
        );
        let why = of_key("scheme", code::CONTRADICTION, what);
        return Err(refuse(why.try_instead("use coupling.scheme = \"weak\" or another solver")));
    }
    if let Some(repeats) = hello.repeats {
        check_repeats(settings, solver, hello, repeats)?;
    }
    // A limit that is not a number is none.
    if hello.largest_window < settings.time_window || hello.largest_window.is_nan() {
        let (window, most) = (settings.time_window, hello.largest_window);
        let what =
            format!("coupling.time_window is {window} s, {solver} ({program}) takes windows up to {most} s");
        return Err(refuse(of_key("time_window", code::TIME_STEP, what)));
    }
    Ok(())
}

/// Iterations of a solver that repeats itself only to a tolerance agree no better than that.
fn check_repeats(
    settings: &CouplingSettings,
    solver: &str,
    hello: &Hello,
    repeats: f64,
) -> Result<(), Failure> {
    let program = &hello.program;
    if !(0.0..1.0).contains(&repeats) {
        let what =
            format!("{program} says that it repeats a window to {repeats}; 0 to 1 has a meaning, 0 is exact");
        return Err(breach(solver, clause::REPEATS, what));
    }
    if settings.scheme == Scheme::Strong && repeats > settings.tolerance {
        let what = format!(
            "coupling.tolerance is {:e}, {solver} ({program}) repeats a window to {repeats:e} only: iterations would end by chance",
            settings.tolerance
        );
        let hint = "raise coupling.tolerance above that, or use coupling.scheme = \"weak\"";
        return Err(refuse(of_key("tolerance", code::CONTRADICTION, what).try_instead(hint)));
    }
    Ok(())
}

/// Programs that have read different scenes compute different things, and nothing else would show it.
fn check_scene(settings: &CouplingSettings, solver: &str, hello: &Hello) -> Result<(), Failure> {
    let theirs = &hello.scene;
    match &settings.scene {
        Some(ours) if !theirs.is_empty() && ours != theirs => {
            let program = &hello.program;
            let what =
                format!("{solver} ({program}) and the coupler have read different scenes ({theirs}, {ours})");
            let hint = format!(
                "start all programs of a run with one scene file and the same --set (PROTOCOL.md, clause {})",
                clause::SCENE
            );
            Err(refuse(Diagnostic::error(code::PROVENANCE, what).try_instead(hint)))
        }
        _ => Ok(()),
    }
}

/// Fields of the four payloads.
struct Fields {
    to_dem: Vec<FieldSpec>,
    from_dem: Vec<FieldSpec>,
    to_fem: Vec<FieldSpec>,
    from_fem: Vec<FieldSpec>,
    /// Lines of the structure that are broken; `None`: not both know of them.
    broken: Option<FieldSpec>,
    /// Fields of a yielding net that are passed on from the structure; none if there is no such net.
    local: Vec<FieldSpec>,
    /// Those among them that the coupler knows by name alone.
    common: Common,
}

fn choose_fields(settings: &CouplingSettings, dem: &Hello, fem: &Hello) -> Result<Fields, Failure> {
    let samples = settings.samples;
    let find = |list: &[FieldSpec], name: &str, sampling: Sampling| {
        let found = list.iter().find(|f| f.name == name && f.sampling == sampling && f.interface == 0)?;
        let samples = if sampling == Sampling::Once { 1 } else { samples };
        (found.samples >= samples).then(|| FieldSpec { samples, ..found.clone() })
    };
    let need = |who: &str, program: &str, verb: &str, list: &[FieldSpec], name: &str, sampling: Sampling| {
        find(list, name, sampling).ok_or_else(|| {
            let what = format!(
                "{who} ({program}) does not {verb} the field \"{name}\" ({sampling:?}, {samples} per window), which \
                 this coupling needs"
            );
            let fewer = list.iter().find(|f| f.name == name && f.sampling == sampling).map(|f| f.samples);
            let hint = fewer.map(|n| format!("coupling.samples = {n} is what it has; it may declare the field with more"));
            refuse(Diagnostic::error(code::CONTRACT, what).try_if(hint))
        })
    };
    use Sampling::{AtEnds, FromStart, Means, Once};
    let (dem_name, fem_name) = (dem.program.as_str(), fem.program.as_str());

    let mut to_dem = vec![need("dem", dem_name, "take", &dem.takes, name::DISPLACEMENT, FromStart)?];
    to_dem.extend(find(&dem.takes, name::VELOCITY, FromStart));
    let mut from_fem = vec![
        need("fem", fem_name, "give", &fem.gives, name::DISPLACEMENT, AtEnds)?,
        need("fem", fem_name, "give", &fem.gives, name::VELOCITY, AtEnds)?,
    ];
    // What is broken is sent as long as both know of it.
    let mut broken = find(&fem.gives, name::BROKEN, Once);
    broken = broken.filter(|given| find(&dem.takes, name::BROKEN, Once).is_some_and(|taken| taken == *given));
    from_fem.extend(broken.clone());
    to_dem.extend(broken.clone());
    // The structure's list says with which load its scheme keeps energy: mean, end, or both.
    let mut to_fem = Vec::new();
    let mut from_dem = Vec::new();
    for sampling in [Means, AtEnds] {
        if let Some(load) = find(&fem.takes, name::FORCE, sampling) {
            from_dem.push(need("dem", dem_name, "give", &dem.gives, name::FORCE, sampling)?);
            to_fem.push(load);
        }
    }
    if to_fem.is_empty() {
        let what = format!(
            "fem ({fem_name}) takes no \"{}\" as mean over {samples} parts of a window or at their ends",
            name::FORCE
        );
        return Err(refuse(Diagnostic::error(code::CONTRACT, what)));
    }
    // The work is booked with the mean force, whatever the structure takes.
    if !from_dem.iter().any(|f| f.sampling == Means) {
        from_dem.extend(find(&dem.gives, name::FORCE, Means));
    }
    // Who may be touched is asked for only where convergence is judged.
    if settings.scheme == Scheme::Strong {
        from_dem.extend(find(&dem.gives, name::REACH, Once));
    }
    // A long window in which something touches after all is tried again: both must be able to.
    if settings.flight_window > 0.0 && [dem, fem].iter().all(|hello| hello.repeats.is_some()) {
        from_dem.extend(find(&dem.gives, name::FREE_TIME, Once));
    }
    let common = Common {
        to_contact: passing::common(&fem.gives, &dem.takes, samples),
        to_structure: passing::common(&dem.gives, &fem.takes, samples),
    };
    for (payloads, fields) in [
        ([&mut from_fem, &mut to_dem], &common.to_contact),
        ([&mut from_dem, &mut to_fem], &common.to_structure),
    ] {
        payloads.into_iter().for_each(|payload| payload.extend_from_slice(fields));
    }
    let mut fields = Fields { to_dem, from_dem, to_fem, from_fem, broken, common, local: Vec::new() };
    if settings.yielding_net {
        match fields.yield_with(dem, fem, &find) {
            // In strong coupling it is asked for already.
            Ok(()) if settings.scheme == Scheme::Weak => {
                fields.from_dem.extend(find(&dem.gives, name::REACH, Once));
            }
            Ok(()) => {}
            Err(what) => tracing::warn!(
                "coupling.yielding_net: {what}; the net is moved by the structure alone, and the window must be short"
            ),
        }
    }
    Ok(fields)
}

impl Fields {
    /// Add what a yielding net needs of both solvers, or say what is missing.
    fn yield_with(
        &mut self,
        dem: &Hello,
        fem: &Hello,
        find: &impl Fn(&[FieldSpec], &str, Sampling) -> Option<FieldSpec>,
    ) -> Result<(), String> {
        if let Some(hello) = [dem, fem].into_iter().find(|hello| !hello.can(capability::SELECTS)) {
            return Err(format!("{} cannot select nodes of the net", hello.program));
        }
        let both = |name: &str| {
            let given = find(&fem.gives, name, Sampling::Once)
                .ok_or_else(|| format!("{} does not offer \"{name}\"", fem.program))?;
            let taken = find(&dem.takes, name, Sampling::Once);
            taken.filter(|t| *t == given).ok_or_else(|| format!("{} does not take \"{name}\"", dem.program))
        };
        let needed = [name::LOCAL_FORCE, name::LOCAL_FORCE_RATE, name::LOCAL_TANGENT];
        let mut local = needed.into_iter().map(both).collect::<Result<Vec<_>, _>>()?;
        local.extend(both(name::LOCAL_DAMPING));
        let lacks = |what: &str| format!("{} lacks {what}", dem.program);
        let star = find(&dem.takes, name::FORCE, Sampling::Means);
        let star = star.ok_or_else(|| lacks("\"force\" as input"))?;
        let own = find(&dem.gives, name::DISPLACEMENT, Sampling::AtEnds);
        let own = own.ok_or_else(|| lacks("\"displacement\" in its answer"))?;
        let travel = both(name::TRAVEL).ok();
        tracing::info!("the contact solver advances the net in reach itself");
        self.from_fem.extend(local.iter().cloned().chain(travel.clone()));
        self.to_dem.extend(local.iter().cloned().chain([star]).chain(travel));
        self.from_dem.push(own);
        self.local = local;
        Ok(())
    }
}

/// The user's input is refused: exit code 2.
pub fn refuse(why: Diagnostic) -> Failure {
    Failure::Fault { solver: "coupler".into(), fault: Fault::new(FaultKind::Input, why) }
}

/// An error of this kind about a key of `[coupling]`.
fn of_key(key: &str, code: Code, what: String) -> Diagnostic {
    Diagnostic::error(code, what).about(format!("coupling.{key}"))
}
