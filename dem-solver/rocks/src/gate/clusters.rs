//! A file of spheres that is not of this rock: of another size, at another place, turned, or of another body.

use super::units::{Judged, extents};
use dem_contact::rock::Rock;
use dem_contact::settings::RockSettings;
use dem_solid::cluster::volume::excess;
use dem_solid::geometry::bounds;
use dem_solid::geometry::sphere::extent;
use interface_defs::diagnostic::{Diagnostic, code};
use toolkit::numbers::four;
use toolkit::scene::Scene;

/// Edges of the box around the spheres over those of the rock: beyond the first something is said, beyond the second it is refused.
const EDGES: [f64; 2] = [1.25, 2.0];
/// Distance of the middles of both boxes, in edges of the rock, likewise.
const MIDDLES: [f64; 2] = [0.1, 0.5];
/// Volume of the spheres over that of the rock, least and largest of which nothing is said: eight spheres fill a cube by half.
const VOLUME: [f64; 2] = [0.4, 1.5];
/// Columns for the volume: 1 % is good enough here.
const COLUMNS: usize = 64;

/// Compare the spheres of rock number `at` with its shape, if they come from a file.
pub fn check(at: usize, rock: &Rock, table: &RockSettings, scene: &Scene) -> Judged {
    let Some(file) = table.cluster.as_ref().and_then(|c| c.file.as_ref()) else { return Ok(Vec::new()) };
    let points = &rock.solid.drawn.points;
    let spheres = || rock.spheres.iter().map(|s| (s.centre, s.radius));
    let (ours, theirs) = (extent(points.iter().map(|p| (*p, 0.0))), extent(spheres()));
    let [low, high] = bounds(points.iter().copied());
    let off = rock.lowest_corner * 0.5 + rock.highest_corner * 0.5 - (low * 0.5 + high * 0.5);
    let name =
        file.file_name().map_or_else(|| file.display().to_string(), |n| n.to_string_lossy().into_owned());
    let [found, due] = [theirs, ours].map(extents);
    let sizes = format!("the spheres of {name} fill a box of {found}, the shape one of {due}");
    let ratios = [0, 1, 2].map(|a| theirs[a] / ours[a]);
    let worst = ratios.iter().map(|r| r.max(1.0 / r)).fold(1.0, f64::max);
    let shift = (0..3).map(|a| off[a].abs() / ours[a]).fold(0.0, f64::max);
    let (whose, off) = (&rock.name, extents(off.into()));
    let described = format!("rock `{whose}`: {sizes}");
    let key = format!("rock.{at}.cluster.file");
    let refuse = |what: String, cure: &str| {
        Err(scene.invalid(&key, what).coded(code::GEOMETRY).try_instead(cure.to_owned()))
    };
    let doubt = |what: String| Diagnostic::warning(code::GEOMETRY, what).about(key.clone());
    if worst > EDGES[1] {
        let thousand = ratios.iter().all(|r| (500.0..2_000.0).contains(r) || (5e-4..2e-3).contains(r));
        let cure = if thousand {
            "one of the two is in millimetres: write both in metres"
        } else {
            "make one of this shape with `dem-solver cluster`, or name the shape that it is of"
        };
        return refuse(described, cure);
    }
    let shifted =
        format!("rock `{whose}`: the middle of the spheres of {name} lies {off} off that of the shape");
    if shift > MIDDLES[1] {
        let cure = "both are written in the shape's own axes; make one with `dem-solver cluster`";
        return refuse(shifted, cure);
    }
    let mut warnings = Vec::new();
    if worst > EDGES[0] {
        let cure = "are its radii diameters, or is it of another rock?";
        warnings.push(doubt(described).try_instead(cure));
    }
    if shift > MIDDLES[0] {
        warnings.push(doubt(shifted));
    }
    let volume = 1.0 + excess(&rock.solid.drawn, &rock.spheres, COLUMNS);
    if !(VOLUME[0]..=VOLUME[1]).contains(&volume) {
        let [share, volume] = [volume, rock.solid.volume()].map(four);
        let what = format!(
            "rock `{whose}`: the spheres of {name} fill {share} of the volume of the shape, {volume} m3"
        );
        warnings.push(doubt(what).try_instead("radii are in the fourth column, in metres"));
    }
    Ok(warnings)
}
