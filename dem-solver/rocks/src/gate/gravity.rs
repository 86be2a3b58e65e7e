//! Gravity: whether it is there, whether it points down, and whether it is in m/s2.

use super::units::Judged;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// Gravity of the Earth as a scene writes it.
const EARTH: &str = "gravity = [0.0, 0.0, -9.81]";
/// What no one calls another unit or another planet [m/s2]: that of the Earth along a slope or in a lift is in it.
const USUAL: [f64; 2] = [8.0, 11.0];
/// Beyond it no one can mean m/s2: a centrifuge for models of slopes reaches 5 000 m/s2 at its very end, and has no rocks.
const LARGEST: f64 = 500.0;
/// Largest angle with -z on a terrain of which nothing is said, and from which on it is refused [degrees].
const UPRIGHT: f64 = 1.0;
const LYING: f64 = 60.0;

/// Refuse a gravity `g` [m/s2] that no one can mean, with or without a terrain; else what the user should know.
pub fn check(g: Vector3<f64>, terrain: bool, scene: &Scene) -> Judged {
    let size = g.norm();
    if !scene.has("gravity") {
        let none = "[0.0, 0.0, 0.0] says that there is none";
        if terrain {
            let what = "the scene has a terrain and names no gravity: rocks would fly on straight above it";
            return Err(scene
                .invalid("terrain", what)
                .coded(code::MISSING_KEY)
                .try_instead(format!("write {EARTH} at the top of the scene; {none}")));
        }
        let what = "the scene names no gravity, so nothing falls";
        let doubted = Diagnostic::warning(code::UNUSUAL_VALUE, what).about("rock");
        return Ok(vec![doubted.try_instead(format!("write {EARTH}, {none}"))]);
    }
    if size == 0.0 {
        return Ok(Vec::new());
    }
    if size > LARGEST {
        let unit = match size {
            s if (9_000.0..10_500.0).contains(&s) => ": in mm/s2?",
            s if (900.0..1_050.0).contains(&s) => ": in cm/s2?",
            _ => "",
        };
        return Err(scene
            .invalid(
                "gravity",
                format!("a gravity of {size} m/s2, {:.0} times that of the Earth{unit}", size / 9.81),
            )
            .coded(code::LIKELY_UNIT)
            .try_instead(format!("it is written in m/s2: {EARTH}")));
    }
    let mut warnings = Vec::new();
    let doubt = |code, what: String| Diagnostic::warning(code, what).about("gravity");
    if terrain {
        let angle = (-g.z / size).clamp(-1.0, 1.0).acos().to_degrees();
        let [x, y, z] = g.into();
        if angle > 90.0 {
            let what = format!("gravity [{x}, {y}, {z}] points up, and z is upward on a terrain");
            return scene.refuse("gravity", what, format!("turn its sign round: {EARTH}"));
        }
        if angle >= LYING {
            let what =
                format!("gravity [{x}, {y}, {z}] is {angle:.0} degrees off -z, and z is upward on a terrain");
            return scene.refuse("gravity", what, format!("turn it down: {EARTH}"));
        }
        if angle > UPRIGHT {
            let what = format!(
                "[{x}, {y}, {z}] is {angle:.1} degrees off -z: the terrain counts as tilted by as much"
            );
            warnings.push(doubt(code::UNUSUAL_VALUE, what).try_instead(format!("straight down is {EARTH}")));
        }
    }
    if !(USUAL[0]..=USUAL[1]).contains(&size) {
        let (unit, code) = match (31.5..33.0).contains(&size) {
            true => (", in ft/s2?", code::LIKELY_UNIT),
            false => ("", code::UNUSUAL_VALUE),
        };
        let what = format!("{size:.4} m/s2{unit}: that of the Earth is 9.81 m/s2");
        warnings.push(doubt(code, what));
    }
    Ok(warnings)
}
