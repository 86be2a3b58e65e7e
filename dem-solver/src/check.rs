//! What the solver would build of a scene, with which step and at what cost.

use crate::gate::lengths::height;
use crate::net_contact;
use crate::settings::{
    BoxSettings, ContactSettings, DemSettings, RockSettings, Settings, Shape, SpheresSettings,
    TerrainSettings,
};
use crate::solver::DemSolver;
use interface_defs::InterfaceMesh;
use interface_defs::toolkit::check::CheckReport;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::program::Options;
use interface_defs::toolkit::scene::Scene;
use serde::Serialize;

/// Seconds per step and rock without contacts, as measured on one core of 2.5 GHz.
const SECONDS_PER_STEP: f64 = 2e-6;
/// Neighbours of a sphere that lies among others.
const NEIGHBOURS: f64 = 6.0;
/// Seconds per touching pair and step, likewise.
const SECONDS_PER_PAIR: f64 = 5e-8;

#[derive(Serialize)]
struct Resolved<'a> {
    gravity: [f64; 3],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    rock: &'a [RockSettings],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    spheres: &'a [SpheresSettings],
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    sides: Option<&'a BoxSettings>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contact: Option<&'a [ContactSettings]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    terrain: Option<&'a TerrainSettings>,
    dem: DemSettings,
}

/// Build everything of the scene but the net, and say what it is.
pub fn check(scene: &Scene) -> Result<CheckReport, InputError> {
    check_with(scene, None)
}

/// The same with the `net` that the structure offers: rocks that start in it are refused.
pub fn check_with(scene: &Scene, net: Option<&InterfaceMesh>) -> Result<CheckReport, InputError> {
    let solver = DemSolver::new(scene, &Options { out: None, shortcuts: true })?;
    let fem = scene.read::<toml::Table>("processes")?.is_some_and(|p| p.contains_key("fem"));
    if (fem || scene.has("structure")) && solver.model().laws.is_none() {
        return Err(scene
            .invalid("structure", "there is a net and no contact law: the rock would fall through it")
            .try_instead("add a table [[contact]]"));
    }
    if let Some(what) = solver.idle_selection().filter(|_| !fem && !scene.has("structure")) {
        return Err(scene.invalid("dem.contact_selection", what).try_instead("leave it out"));
    }
    let mut near = Vec::new();
    if let Some(net) = net {
        near = solver.check_net(net).map_err(|fault| InputError::new(fault.message))?;
    }
    let model = solver.model();
    let steps = &model.steps;
    let mut report = CheckReport {
        warnings: [solver.notices(), solver.cautions(), &near].concat(),
        ..CheckReport::default()
    };
    let (mut seconds, mut spheres, mut mass) = (0.0, 0, 0.0);
    let named = model.settings.named();
    for group in &model.settings.spheres {
        let [least, most] = group.radii();
        report.builds.push(format!(
            "`{}`: {} spheres of {least} to {most} m radius, each a rock of its own",
            group.name,
            group.total()
        ));
    }
    for rock in &model.rocks[named..] {
        seconds += SECONDS_PER_STEP + SECONDS_PER_PAIR * NEIGHBOURS;
        spheres += 1;
        mass += rock.mass;
    }
    if !model.planes.is_empty() {
        report.builds.push(format!("box of {} planes", model.planes.len()));
    }
    for (rock, settings) in model.rocks.iter().zip(&model.settings.rocks).take(named) {
        report.builds.push(format!(
            "rock `{}`: {}, {:.6} kg, moments of inertia {:.4} {:.4} {:.4} kg m2, {} spheres ({}) of \
             radius {:.6} m{}",
            rock.name,
            rock.solid.describe(),
            rock.mass,
            rock.inertia.x,
            rock.inertia.y,
            rock.inertia.z,
            rock.spheres.len(),
            rock.origin,
            rock.smallest_radius,
            if rock.has_equal_spheres() { "" } else { " and more" },
        ));
        if rock.spheres.len() > 1 || !matches!(settings.shape, Shape::Sphere { .. }) {
            let accuracy = rock.accuracy(settings)?;
            report.builds.push(format!("rock `{}`: error of the spheres: {accuracy}", rock.name));
            report.numbers.insert(format!("{}_surface_error_m", rock.name), accuracy.largest());
            report.numbers.insert(format!("{}_volume_error", rock.name), accuracy.volume);
        }
        report.clusters.extend(rock.made.iter().map(|made| (rock.name.clone(), made.clone())));
        // On a net with cells of a third of the rock, six rows of its spheres touch.
        seconds += SECONDS_PER_STEP + SECONDS_PER_PAIR * 6.0 * (rock.spheres.len() as f64).cbrt();
        spheres += rock.spheres.len();
        mass += rock.mass;
    }
    if let Some(ground) = &model.ground {
        report.builds.push(ground.describe());
        report.builds.extend_from_slice(solver.choices());
        for (at, rock) in model.rocks.iter().enumerate().take(named) {
            if let Some(height) = height(ground, &model.settings, at) {
                let what = format!("rock `{}`: its centre starts {height:.2} m above the terrain", rock.name);
                report.builds.push(what);
            }
        }
        report.numbers.insert("triangles".into(), ground.triangles.len() as f64);
    }
    match &model.laws {
        Some(laws) => {
            report.builds.extend(laws.describe());
            report.builds.push(format!(
                "step {:.4e} s; critical {:.4e} s for a landing at {:.2} m/s ({}) on a rigid fixed surface",
                steps.step,
                steps.critical,
                steps.speed,
                if model.ground.is_some() { "all its energy" } else { "free fall until end_time" }
            ));
        }
        None => report.builds.push(format!("no contact; step {:.4e} s", steps.step)),
    }
    if steps.step > steps.critical {
        report.warnings.push(format!(
            "dem.time_step = {:.3e} s lies above the critical step of {:.3e} s (allow_unstable)",
            steps.step, steps.critical
        ));
    }
    let numbers = [
        ("critical_step_s", steps.critical),
        ("time_step_s", steps.step),
        ("contact_duration_s", steps.contact),
        ("longest_step_s", steps.longest),
        ("seconds_per_step", seconds),
        ("spheres", spheres as f64),
        ("mass_kg", mass),
    ];
    report.numbers.extend(numbers.map(|(name, value)| (name.to_owned(), value)));
    report.numbers.extend(net_contact::numbers(model));
    report.resolved = resolved(&model.settings);
    Ok(report)
}

fn resolved(settings: &Settings) -> toml::Table {
    let dem = if settings.contacts.is_empty() { settings.dem.clone() } else { settings.dem.filled_in() };
    let tables = Resolved {
        gravity: settings.gravity.into(),
        rock: &settings.rocks[..settings.named()],
        spheres: &settings.spheres,
        sides: settings.sides.as_ref(),
        contact: (!settings.contacts.is_empty()).then_some(&settings.contacts),
        terrain: settings.terrain.as_ref(),
        dem,
    };
    toml::Table::try_from(tables).expect("tables of numbers and text are valid TOML")
}
