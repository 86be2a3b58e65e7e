//! The start of a run: who is there, what crosses the interface, where the interface mesh comes from.

use crate::energy::Account;
use crate::interface::{Interface, Places};
use crate::mapping::map;
use crate::settings::{CouplingSettings, Scheme};
use interface_defs::message::capability;
use interface_defs::solver::OnProgress;
use interface_defs::{
    Failure, Fault, FieldSpec, Gauge, Hello, Layout, Participant, Plan, Ready, Sampling, name,
};

/// What is agreed with one solver.
pub struct Side {
    /// Its part in the run and its program, for messages: `fem (fem-solver 0.1)`.
    pub program: String,
    /// Its gauges.
    pub gauges: Vec<Gauge>,
    /// Layout of its answers.
    pub layout: Layout,
    /// Its part in the balance of energy.
    pub account: Account,
    /// Its answer at t = 0.
    pub initial: Vec<f64>,
    /// Whether it solves a window again from the committed state.
    pub repeatable: bool,
}

impl Side {
    fn new(name: &str, hello: &Hello, plan: &Plan, ready: Ready) -> Self {
        let program = format!("{name} ({})", hello.program);
        let layout = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len());
        let account = Account::new(&ready.gauges, &layout, &ready.initial);
        let repeatable = hello.can(capability::REPEATABLE);
        Self { program, gauges: ready.gauges, layout, account, initial: ready.initial, repeatable }
    }
}

/// What is agreed with both.
pub struct Agreement {
    /// The interface at t = 0.
    pub interface: Interface,
    /// The contact solver.
    pub dem: Side,
    /// The structure's solver.
    pub fem: Side,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Agree with both solvers. The structure is prepared first: the contact solver works on its interface mesh.
pub fn agree(
    settings: &CouplingSettings,
    end_time: f64,
    dem: &mut dyn Participant,
    fem: &mut dyn Participant,
    progress: OnProgress,
) -> Result<Agreement, Failure> {
    let (dem_hello, fem_hello) = (dem.hello()?, fem.hello()?);
    for (solver, hello) in [(dem.name(), &dem_hello), (fem.name(), &fem_hello)] {
        tracing::info!("{solver} is {}", hello.program);
        check_capabilities(settings, solver, hello)?;
        check_scene(settings, solver, hello)?;
    }
    let fields = choose_fields(settings, &dem_hello, &fem_hello)?;
    let plan = |takes: &[FieldSpec], gives: &[FieldSpec]| Plan {
        end_time,
        window: settings.time_window,
        takes: takes.to_vec(),
        gives: gives.to_vec(),
        partner_mesh: None,
    };
    let fem_plan = plan(&fields.to_fem, &fields.from_fem);
    let mut fem_ready = fem.prepare(&fem_plan, progress)?;
    let mut dem_plan = plan(&fields.to_dem, &fields.from_dem);
    let structure_mesh = fem_ready.mesh.clone();
    dem_plan.partner_mesh = Some(structure_mesh.clone());
    let mut dem_ready = dem.prepare(&dem_plan, progress)?;

    if fields.to_dem.iter().any(|f| f.name == name::BROKEN) && structure_mesh.lines != dem_ready.mesh.lines {
        return Err(Failure::Contract {
            solver: dem.name().into(),
            what: "it takes the field \"broken\", and its mesh has other lines than the structure's".into(),
        });
    }
    let (mapping, quality) = map(settings.mapping.as_ref(), &structure_mesh, &dem_ready.mesh)
        .map_err(|what| refuse(format!("coupling.mapping: {what}")))?;
    let mut warnings = std::mem::take(&mut fem_ready.warnings);
    warnings.append(&mut dem_ready.warnings);
    if !mapping.is_identity() {
        tracing::info!("mapping: {quality}");
        warnings.extend(quality.warnings());
    }

    let to_dem = Layout::new(&dem_plan.takes, &dem_ready.mesh, 0);
    let to_fem = Layout::new(&fem_plan.takes, &structure_mesh, 0);
    let (dem_side, fem_side) = (
        Side::new(dem.name(), &dem_hello, &dem_plan, dem_ready),
        Side::new(fem.name(), &fem_hello, &fem_plan, fem_ready),
    );
    let places = Places::new(&to_dem, &dem_side.layout, &to_fem, &fem_side.layout, settings.samples as usize);
    let last = |name| {
        let range = fem_side.layout.last(name, Sampling::AtEnds).expect("chosen for every structure");
        &fem_side.initial[range]
    };
    if settings.measures_force() && places.dem_force.is_empty() {
        return Err(refuse(format!(
            "coupling.measure: {} gives no mean force over the parts of a window, so that it cannot be judged; measure displacement \
             and velocity",
            dem_side.program
        )));
    }
    let mut interface = Interface::new(mapping, places, last(name::DISPLACEMENT), last(name::VELOCITY));
    if settings.measures_force() {
        interface.follow_force();
    }
    Ok(Agreement { interface, dem: dem_side, fem: fem_side, warnings })
}

fn check_capabilities(settings: &CouplingSettings, solver: &str, hello: &Hello) -> Result<(), Failure> {
    if settings.scheme == Scheme::Strong && !hello.can(capability::REPEATABLE) {
        return Err(refuse(format!(
            "strong coupling repeats windows, and {solver} ({}) does not declare \"{}\"; \
             use coupling.scheme = \"weak\" or another solver",
            hello.program,
            capability::REPEATABLE
        )));
    }
    // NaN is no limit anyone meant.
    if hello.largest_window < settings.time_window || hello.largest_window.is_nan() {
        return Err(refuse(format!(
            "coupling.time_window is {} s, {solver} ({}) takes windows up to {} s",
            settings.time_window, hello.program, hello.largest_window
        )));
    }
    Ok(())
}

/// Programs that have read different scenes compute different things, and nobody would see it.
fn check_scene(settings: &CouplingSettings, solver: &str, hello: &Hello) -> Result<(), Failure> {
    let theirs = hello.capabilities.iter().find(|word| word.starts_with(capability::SCENE));
    match (&settings.scene, theirs) {
        (Some(ours), Some(theirs)) if ours != theirs => Err(refuse(format!(
            "{solver} ({}) and the coupler have read different scenes ({theirs}, {ours}); start all programs of a run \
             with one scene file and the same --set",
            hello.program
        ))),
        _ => Ok(()),
    }
}

/// Fields of the four payloads.
struct Fields {
    to_dem: Vec<FieldSpec>,
    from_dem: Vec<FieldSpec>,
    to_fem: Vec<FieldSpec>,
    from_fem: Vec<FieldSpec>,
}

fn choose_fields(settings: &CouplingSettings, dem: &Hello, fem: &Hello) -> Result<Fields, Failure> {
    let samples = settings.samples;
    let find = |list: &[FieldSpec], name: &str, sampling: Sampling| {
        let found = list.iter().find(|f| f.name == name && f.sampling == sampling)?;
        let samples = if sampling == Sampling::Once { 1 } else { samples };
        (found.samples >= samples).then(|| FieldSpec { samples, ..found.clone() })
    };
    let need = |who: &str, program: &str, verb: &str, list: &[FieldSpec], name: &str, sampling: Sampling| {
        find(list, name, sampling).ok_or_else(|| {
            refuse(format!(
                "{who} ({program}) does not {verb} the field \"{name}\" ({sampling:?}, {samples} per window), \
                 which this coupling needs"
            ))
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
    if let (Some(given), Some(taken)) =
        (find(&fem.gives, name::BROKEN, Once), find(&dem.takes, name::BROKEN, Once))
        && given == taken
    {
        from_fem.push(given);
        to_dem.push(taken);
    }
    // The structure's list says which load balances its scheme (handbook 3.7): mean, end, or both.
    let mut to_fem = Vec::new();
    let mut from_dem = Vec::new();
    for sampling in [Means, AtEnds] {
        if let Some(load) = find(&fem.takes, name::FORCE, sampling) {
            from_dem.push(need("dem", dem_name, "give", &dem.gives, name::FORCE, sampling)?);
            to_fem.push(load);
        }
    }
    if to_fem.is_empty() {
        return Err(refuse(format!(
            "fem ({fem_name}) takes no \"{}\" as mean over {samples} parts of a window or at their ends",
            name::FORCE
        )));
    }
    // The work is booked with the mean force, whatever the structure takes.
    if !from_dem.iter().any(|f| f.sampling == Means) {
        from_dem.extend(find(&dem.gives, name::FORCE, Means));
    }
    // Who may be touched is asked for only where convergence is judged.
    if settings.scheme == Scheme::Strong {
        from_dem.extend(find(&dem.gives, name::REACH, Once));
    }
    Ok(Fields { to_dem, from_dem, to_fem, from_fem })
}

/// The user's input is refused: exit code 2.
pub fn refuse(message: String) -> Failure {
    Failure::Fault { solver: "coupler".into(), fault: Fault::input(message) }
}
