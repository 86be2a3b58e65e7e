//! What would be built of a scene of many spheres, with which step and at what cost.

use super::GranularSolver;
use crate::check::{above_critical, resolved};
use dem_contact::law::table::Laws;
use dem_contact::settings::{OF_ROCKS_IN_CONTACT, OF_ROCKS_IN_DEM};
use interface_defs::diagnostic::Diagnostic;
use toolkit::check::CheckReport;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Seconds per sphere and step, as measured for a packing with friction on one core of 2.5 GHz.
const SECONDS_PER_SPHERE: f64 = 2e-7;

/// Build everything of the scene, and say what it is.
pub fn check(scene: &Scene) -> Result<CheckReport, Diagnostic> {
    let solver = GranularSolver::new(scene, &Options::default())?;
    let model = solver.model();
    let (settings, steps) = (&model.settings, &model.steps);
    let mut report = CheckReport { warnings: solver.cautions.clone(), ..CheckReport::default() };
    for (number, group) in settings.spheres.iter().enumerate() {
        let of = |i: &usize| usize::from(model.group[*i]) == number;
        let mass: f64 = (0..model.mass.len()).filter(of).map(|i| model.mass[i]).sum();
        let (name, total, [least, most]) = (&group.name, group.total(), group.radii());
        report.builds.push(format!("`{name}`: {total} spheres of {least} to {most} m radius, {mass:.6} kg"));
    }
    report.builds.push(format!("box of {} planes", model.planes.len()));
    report.builds.extend(Laws::new(&settings.contacts).iter().flat_map(Laws::describe));
    report.builds.push(format!(
        "step {:.4e} s; critical {:.4e} s for impacts at {:.2} m/s and the weight of the packing",
        steps.step, steps.critical, steps.speed
    ));
    report.warnings.extend(above_critical(steps.step, steps.critical));
    let numbers = [
        ("critical_step_s", steps.critical),
        ("time_step_s", steps.step),
        ("contact_stiffness_n_per_m", steps.stiffness),
        ("seconds_per_step", SECONDS_PER_SPHERE * model.mass.len() as f64),
        ("spheres", model.mass.len() as f64),
        ("mass_kg", model.mass.iter().sum()),
    ];
    report.numbers = numbers.map(|(name, value)| (name.to_owned(), value)).into();
    report.resolved = resolved(settings, settings.dem.clone());
    leave_out_of_rocks(&mut report.resolved);
    Ok(report)
}

/// Leave out what rocks alone have: written down it would be refused.
fn leave_out_of_rocks(resolved: &mut toml::Table) {
    if let Some(dem) = resolved.get_mut("dem").and_then(toml::Value::as_table_mut) {
        dem.retain(|key, _| !OF_ROCKS_IN_DEM.iter().any(|(own, _)| **own == *key));
    }
    let contacts = resolved.get_mut("contact").and_then(toml::Value::as_array_mut);
    for table in contacts.into_iter().flatten().filter_map(toml::Value::as_table_mut) {
        table.retain(|key, _| !OF_ROCKS_IN_CONTACT.iter().any(|(own, _)| **own == *key));
    }
}
