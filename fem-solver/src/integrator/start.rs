//! The start of a run: form finding, critical step, time step. What `check` prints and `prepare` does.

use crate::config::structure::FormFinding;
use crate::config::{Config, Integrator};
use crate::element::AnyElement;
use crate::equilibrium::form_finding::{Basis, Form, Wanted, fallen, find_form};
use crate::equilibrium::newton::{Failure, Info, Newton};
use crate::integrator::critical_step::highest_frequency;
use crate::internal_force::Displacements;
use crate::internal_force::tangent::Tangent;
use crate::model::Model;
use crate::model::validation::loading::unseen_rows;
use crate::state::inherited::Inherited;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Fault;
use std::time::{Duration, Instant};
use toolkit::output::Output;
use toolkit::scene::Scene;
use toolkit::start_from::{At, Origin};

/// Residual, relative to load and internal force, below which a structure is at rest; where Newton stops at rounding, some 1e-10 is left.
const AT_REST: f64 = 1e-9;
/// Time between two reports of form finding.
const BETWEEN_REPORTS: Duration = Duration::from_millis(500);
/// Share of the critical step that is taken by default.
const DEFAULT_SHARE: f64 = 0.5;
/// Critical step of a loaded net over that at rest: at rest two wires in line hold a node, drawn to a cone up to four do, and the
/// frequency is the root of twice the stiffness. The drop test holds at 0.74 and diverges at 0.81.
pub const LOADED: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Hint for posts that fall over.
const STAND: &str = "move the anchors further away from it, raise them, or let it lean the other way (structure.generator.lean, anchor_distance)";

/// A structure at t = 0.
pub struct Start {
    /// Its form.
    pub form: Form,
    /// Its motion beside that of the scene, velocity [m/s] and, where it is known, acceleration [m/s2]; `None`: not at all.
    pub motion: Option<[Vec<f64>; 2]>,
    /// Whether something of it was torn before.
    pub torn: bool,
    /// Energies that the books begin with: dissipated by damping, work of the interface force, of moving supports, of loads
    /// with a history [J].
    pub booked: [f64; 4],
    /// Force of dead load and elements on every degree of freedom [N].
    pub force: Vec<f64>,
    /// Whether it is in static equilibrium, to rounding.
    pub at_rest: bool,
    /// Force that nothing balances, over the forces of supports and dead load.
    pub unbalanced: f64,
    /// Highest angular frequency [rad/s]; 0 in statics.
    pub frequency: f64,
    /// Critical step of central differences [s], infinite where nothing is stiff.
    pub critical_step: f64,
    /// Longest time step [s]; infinite = one step per window.
    pub time_step: f64,
    /// Largest axial force [N].
    pub cable_force: f64,
    /// Work of form finding.
    pub form_finding: Info,
    /// Remarks for the user.
    pub warnings: Vec<Diagnostic>,
    /// The Newton iteration, for the implicit schemes.
    pub newton: Newton,
}

/// Called with what is being done.
pub type OnProgress<'a> = &'a mut dyn FnMut(String) -> Result<(), Fault>;

impl Start {
    /// Find the form, the critical step and the time step of `model`; a form that was found before, and what that took, is `known`.
    pub fn new(
        scene: &Scene,
        config: &Config,
        model: &Model,
        inherited: Option<&Inherited>,
        known: Option<&(Form, Info)>,
        on_progress: OnProgress,
    ) -> Result<Self, Fault> {
        let (whole, at_start) = (model, model.at_start());
        let model = &*at_start;
        let (nodes, elements) = (model.node_count(), model.cables.len() + model.elements.len());
        on_progress(format!("{nodes} nodes, {elements} elements: analysing"))?;
        let mut newton = Newton::new(model);
        let moves = inherited.filter(|inherited| inherited.origin.at == At::Motion);
        let basis = inherited
            .map(|Inherited { end, .. }| Basis { displacement: &end.displacement, history: &end.history });
        let way = if moves.is_some() { FormFinding::None } else { config.structure.form_finding };
        let wanted = Wanted { model, method: way, most: config.fem.newton.max_iterations, basis };
        let (form, form_finding) = match known {
            Some(known) => known.clone(),
            None => found(scene, wanted, &mut newton, on_progress)?,
        };
        let Form { displacement, history, smoothed } = &form;
        let mut force = model.load_at_start(displacement);
        let internal = &mut newton.internal;
        let cable_force =
            internal.subtract(model, Displacements::At(displacement), history, &mut force).sqrt();
        let booked = match inherited {
            Some(Inherited { origin: Origin { at: At::Motion, .. }, end, .. }) => end.booked,
            // The books begin anew: what the elements have dissipated by now is none of this run's.
            Some(_) => [-internal.energy(model, displacement, history).dissipated, 0.0, 0.0, 0.0],
            None => [0.0; 4],
        };
        let residual = newton.tangent.norm(&force);
        let scale = force.iter().chain(&model.dead_load).map(|f| f * f).sum::<f64>().sqrt();
        // What is let go later moves in the steps to come, not in form finding.
        let mut of_run = (!whole.until.is_empty()).then(|| Newton::new(whole));
        let statics = config.fem.integrator == Integrator::Static;
        let tangent = &mut of_run.as_mut().unwrap_or(&mut newton).tangent;
        let frequency = if statics { 0.0 } else { frequency(whole, tangent, &form) };
        let mut warnings = notes(model, inherited, *smoothed);
        warnings.extend(lies(model, displacement));
        // Whoever reads the log sees why form finding took so long; its answer does not depend on a shift.
        if let Some(dof) = form_finding.shifted_at {
            tracing::warn!(
                "form finding: the tangent was not positive, first at {}; it was shifted, which slows Newton down",
                model.dof_name(dof)
            );
        }
        if (statics || form_finding.unstable.is_some())
            && !newton.tangent.dofs.is_empty()
            && let Some(dof) = newton.not_held(model, displacement, history)
        {
            warnings.push(not_stiff(scene, model, dof, statics)?);
        }
        let time_step = time_step(scene, config, frequency, &mut warnings)?;
        // A window is one step at least; that of a coupled run is chosen elsewhere.
        let rows = if scene.has("rock") { f64::INFINITY } else { Output::of(scene)?.interval };
        if time_step.min(rows).is_finite() {
            warnings.extend(unseen_rows(config, time_step.min(rows)));
        }
        let at_rest = moves.is_none() && (residual <= AT_REST * scale || residual == 0.0);
        Ok(Self {
            form,
            motion: moves.map(|from| from.motion(model, &config.fem.integrator.to_string())),
            torn: inherited.is_some_and(|from| !from.end.torn.is_empty()),
            booked,
            force,
            at_rest,
            unbalanced: if residual == 0.0 { 0.0 } else { residual / scale },
            frequency,
            critical_step: 2.0 / frequency,
            time_step,
            cable_force,
            form_finding,
            warnings,
            newton: of_run.unwrap_or(newton),
        })
    }
}

/// The form that is `wanted`, and what it took to find it.
fn found(
    scene: &Scene,
    wanted: Wanted,
    newton: &mut Newton,
    on_progress: OnProgress,
) -> Result<(Form, Info), Fault> {
    let Wanted { model, method, .. } = wanted;
    if method == FormFinding::None {
        return Ok((wanted.as_it_is(), Info::default()));
    }
    find_form(wanted, newton, &mut now_and_then(on_progress)).map_err(|failure| match failure {
        Failure::Stopped(fault) => fault,
        failure => not_found(scene, model, method, &failure).into(),
    })
}

/// Highest angular frequency of the structure in its `form`, with what contacts of lines add [rad/s]; 0 where nothing can move.
fn frequency(model: &Model, tangent: &mut Tangent, form: &Form) -> f64 {
    if tangent.dofs.is_empty() {
        return 0.0;
    }
    let own = highest_frequency(model, tangent, &form.displacement, &form.history);
    own.hypot(model.contact.as_ref().map_or(0.0, |lines| lines.frequency(model)))
}

/// Reports of form finding, not more often than anyone reads.
fn now_and_then(on_progress: OnProgress) -> impl FnMut(u64, f64) -> Result<(), Fault> {
    let mut last: Option<Instant> = None;
    move |iteration, residual| {
        if last.is_some_and(|at| at.elapsed() < BETWEEN_REPORTS) {
            return Ok(());
        }
        last = Some(Instant::now());
        on_progress(format!("form finding: iteration {iteration}, residual {residual:.1e} times its limit"))
    }
}

/// Remarks for the user on how the structure was built and its form found.
fn notes(model: &Model, inherited: Option<&Inherited>, smoothed: bool) -> Vec<Diagnostic> {
    let mut warnings = model.warnings.clone();
    warnings.extend(inherited.iter().flat_map(|from| from.warnings.iter().cloned()));
    if model.added_mass > 0.0 {
        let all: f64 = model.mass.iter().sum();
        let (added, own) = (model.added_mass, all - model.added_mass);
        let what = format!(
            "mass scaling added {added:.4} kg to {own:.4} kg: impacts are slower and forces of inertia larger by as much"
        );
        warnings.push(Diagnostic::warning(code::TRUST, what));
    }
    if smoothed {
        warnings.push(Diagnostic::warning(
            code::NOT_CONVERGED,
            "with friction of the ropes no rest shape was found (or they are long): they hang as they would without, with one tension each; \
             friction acts from t = 0 on",
        ));
    }
    warnings
}

/// A warning if a beam has fallen over in form finding.
fn lies(model: &Model, displacement: &[f64]) -> Option<Diagnostic> {
    let (number, most) = fallen(model, displacement)?;
    let what = format!(
        "{} has turned by {most:.0} degrees in form finding: it has fallen over, and the net with it",
        model.member_name(number, None)
    );
    Some(Diagnostic::warning(code::GEOMETRY, what).try_instead(STAND))
}

/// A warning about a degree of freedom without stiffness at rest; in statics an error, unless something moves or loads
/// the structure later: that may stiffen it on the way, as it does a flat net.
fn not_stiff(scene: &Scene, model: &Model, dof: usize, statics: bool) -> Result<Diagnostic, Fault> {
    let steady = model.timed.iter().all(|load| load.factor.rests(0.0, f64::INFINITY));
    if statics && model.moving.is_empty() && steady {
        let what = format!(
            "the structure is a mechanism: {} can move without any force, so statics has no answer",
            model.dof_name(dof)
        );
        let refused = scene.invalid("structure", what).coded(code::GEOMETRY).try_instead(
            "support or connect that node, give the cables tension, or choose an integrator with inertia",
        );
        return Err(refused.into());
    }
    let held = if statics {
        "what moves or loads it must stiffen it first"
    } else {
        "it is held there by nothing but inertia"
    };
    let what = format!("the structure at rest has no stiffness for {}: {held}", model.dof_name(dof));
    Ok(Diagnostic::warning(code::GEOMETRY, what))
}

fn not_found(scene: &Scene, model: &Model, way: FormFinding, failure: &Failure) -> Diagnostic {
    let mut what =
        format!("no static equilibrium under the dead load was found: {}", failure.describe(model));
    if let Some((force, element)) = most_pulled(model) {
        what +=
            &format!("; as it is built, before it may move, the largest force is {force:.3e} N in {element}");
    }
    if let Failure::Broken { element, .. } = failure {
        let of_part = model.parts[..model.part_count].iter().position(|p| p.elements.contains(element));
        let key = of_part.map_or("structure".into(), |part| format!("structure.parts.{part}.rupture_force"));
        return scene.invalid(&key, what).coded(code::RUPTURE).try_instead(
            "a larger rupture_force, in newtons (300 kN is 3e5), or rupture_strain; or less load or prestress",
        );
    }
    if let Some((node, count)) = model.adrift() {
        let what = format!(
            "nothing holds node {} and what hangs together with it, {count} nodes in all: there is no support and no spring, \
             and a load acts",
            model.node_name(node)
        );
        return scene.invalid("structure", what).coded(code::GEOMETRY).try_instead(
            "add supports = [{ group = \"name of a group\" }]; or write form_finding = \"none\" for what shall fall",
        );
    }
    if let Failure::Falls { .. } = failure {
        let hint =
            format!("{STAND}; or write form_finding = \"none\" with damping, where it comes to rest in time");
        return scene.invalid("structure.form_finding", what).coded(code::NOT_CONVERGED).try_instead(hint);
    }
    let other = match way {
        FormFinding::DynamicRelaxation => {
            "form_finding = \"none\" with damping, so that it comes to rest in time"
        }
        _ => "form_finding = \"dynamic_relaxation\" where much is slack, or \"none\"",
    };
    scene.invalid("structure.form_finding", what).coded(code::NOT_CONVERGED).try_instead(format!(
        "support or connect that node, give the cables tension or the rings less room, or write {other}"
    ))
}

/// The largest axial force of the structure as it is built [N], and in which element: rings too small for their cells, a rope too short.
fn most_pulled(model: &Model) -> Option<(f64, String)> {
    let of = |(number, element): (usize, &AnyElement)| {
        let still = vec![0.0; if element.constants().rotates { 6 } else { 3 } * element.nodes().len()];
        let mut forces = vec![0.0; element.constants().forces];
        element.line_forces(&still, &element.start_history(), &mut forces);
        (forces.into_iter().map(f64::abs).fold(0.0, f64::max), number)
    };
    let (force, number) = model.elements.iter().enumerate().map(of).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (force > 0.0).then(|| (force, model.member_name(number, None)))
}

/// The longest step: as the scene says, else by default.
fn time_step(
    scene: &Scene,
    config: &Config,
    frequency: f64,
    warnings: &mut Vec<Diagnostic>,
) -> Result<f64, Diagnostic> {
    let critical = 2.0 / frequency;
    let explicit = config.fem.integrator == Integrator::CentralDifference;
    if !explicit {
        return Ok(config.fem.time_step.unwrap_or(f64::INFINITY));
    }
    let step = config.fem.time_step.unwrap_or(DEFAULT_SHARE * critical);
    if step > critical * (1.0 + 1e-9) {
        let what = format!(
            "the time step {step:.4e} s lies above the critical one, {critical:.4e} s (highest frequency {frequency:.4e} rad/s)"
        );
        if !config.fem.allow_unstable {
            return Err(scene.invalid("fem.time_step", what).coded(code::TIME_STEP).try_instead(format!(
                "at most {:.2e}, an implicit integrator, or allow_unstable = true",
                LOADED * critical
            )));
        }
        warnings.push(Diagnostic::warning(code::TIME_STEP, what).about("fem.time_step"));
    } else if step > LOADED * critical {
        let (share, most) = (100.0 * step / critical, 100.0 * LOADED);
        let what = format!(
            "the time step is {share:.0} % of the critical one at rest; in a loaded net more wires pull a node the same way, and \
             more than {most:.0} % may become unstable"
        );
        warnings.push(Diagnostic::warning(code::TIME_STEP, what).about("fem.time_step"));
    }
    Ok(step)
}
