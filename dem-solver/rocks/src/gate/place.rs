//! A start that is not on its terrain: in which units or axes it would be.

use super::lengths::height as height_at_start;
use crate::model::Model;
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use toolkit::numbers::{four, percent};

/// Height above the terrain from which on something is said [m].
const HIGH: f64 = 200.0;
/// Width of a terrain of which cells in millimetres are the likelier reason [m].
const WIDE: f64 = 50_000.0;
/// The lowest dry land [m].
const DEEPEST_LAND: f64 = -440.0;
/// Relative departure up to which a height is one in another unit.
const ALIKE: f64 = 0.03;

/// What a start at `place` beside a terrain from `low` to `high` may have been meant as; `size` is the rock's [m].
pub fn beside(place: &Vector3<f64>, low: &Vector3<f64>, high: &Vector3<f64>, size: f64) -> Option<String> {
    let on = |x: f64, y: f64| (low.x..=high.x).contains(&x) && (low.y..=high.y).contains(&y);
    let (x, y, z) = (place.x, place.y, place.z);
    let position =
        |what: &str, [x, y, z]: [f64; 3]| Some(format!("{what} Then write position = [{x:?}, {y:?}, {z:?}]"));
    let width = (high.x - low.x).max(high.y - low.y);
    if width < 2.0 * size {
        let [width, size] = [width, size].map(four);
        return Some(format!(
            "it is {width} m wide and the rock {size} m: are its coordinates in kilometres, or is it the file of a rock?"
        ));
    }
    if on(y, x) {
        return position("are x and y exchanged?", [y, x, z]);
    }
    for (factor, unit) in [(1e3, "kilometres"), (1e-3, "millimetres"), (0.3048, "feet")] {
        if on(factor * x, factor * y) {
            return position(&format!("is it in {unit}?"), [factor * x, factor * y, factor * z]);
        }
    }
    if on(x + 2e6, y + 1e6) {
        return position("is it in the older survey coordinates LV03?", [x + 2e6, y + 1e6, z]);
    }
    let far = low.x.abs().max(low.y.abs()) > 1e4;
    if far && x.abs() <= 180.0 && y.abs() <= 180.0 && (x.fract() != 0.0 || y.fract() != 0.0) {
        return Some(
            "are these longitude and latitude? Project them to the terrain's coordinates, as with gdaltransform".into(),
        );
    }
    if far && x.abs() < width && y.abs() < width {
        return position("does it count from the terrain's corner?", [low.x + x, low.y + y, z]);
    }
    // What is upward in the file lies along its y.
    if (low.x..=high.x).contains(&x)
        && (low.y..=high.y + width).contains(&z)
        && (low.z..=high.z).contains(&-y)
    {
        return Some("is y upward in the file? It must be turned so that z is".into());
    }
    (width > WIDE).then(|| format!("it is {} km wide: is its cell size in millimetres?", four(1e-3 * width)))
}

/// What heights of the terrain may be where it is at `ground` [m] under a rock at `z` [m].
pub fn other_heights(ground: f64, z: f64) -> Option<&'static str> {
    let alike = |a: f64, b: f64| (a / b - 1.0).abs() < ALIKE;
    let ratio = ground / z;
    [
        (3.2808, "are the heights of the terrain in feet? Then convert them to metres"),
        (0.3048, "is its height in feet? Then convert it to metres"),
        (1000.0, "are the heights of the terrain in millimetres? Then convert them to metres"),
        (100.0, "are the heights of the terrain in centimetres? Then convert them to metres"),
        (0.001, "are the heights of the terrain in kilometres? Then convert them to metres"),
        (-1.0, "do the heights of the terrain count downwards? z must be upward: turn their sign round"),
    ]
    .into_iter()
    .find(|(factor, _)| alike(ratio, *factor))
    .map(|(_, what)| what)
}

/// What is said of a terrain that lies deeper than any land.
pub fn below_all_land(ground: &Terrain) -> Option<Diagnostic> {
    let [low, high] = ground.extent().map(|corner| corner.z);
    (high < DEEPEST_LAND).then(|| {
        let [low, high] = [low, high].map(four);
        let what = format!(
            "its heights reach from {low} to {high} m, and no land lies below {DEEPEST_LAND} m (the Dead Sea): do they \
             count downwards? z must be upward: turn their sign round"
        );
        Diagnostic::warning(code::LIKELY_UNIT, what).about("terrain.file")
    })
}

/// Nodes of a terrain from which on its heights are judged as a whole; share of its triangles that are level, or of its nodes at which
/// not all triangles lie in one plane, from which on whole metres are steps; edges of its triangles that are coarse, and how far a node alone may stand out [m].
const NODES: usize = 1000;
const STEPS: f64 = 0.1;
const CREASED: f64 = 0.3;
const COARSE: f64 = 20.0;
const ALONE: f64 = 100.0;

/// What is said of heights that no survey gives: all equal, whole metres, those of a picture, one that stands out alone; and of triangles
/// that are too large for rocks to bounce on.
pub fn heights(ground: &Terrain) -> Option<Diagnostic> {
    let (nodes, all) = (&ground.nodes, ground.triangles.len());
    if nodes.len() < NODES {
        return None;
    }
    let [low, high] = ground.extent();
    let said = |what: String, cure: &str| {
        Some(Diagnostic::warning(code::UNUSUAL_VALUE, what).about("terrain.file").try_instead(cure))
    };
    let count = nodes.len();
    if low.z == high.z {
        return said(
            format!("all {count} heights of the terrain are {} m", low.z),
            "does the file hold heights?",
        );
    }
    let is_level = |t: &usize| {
        let [a, b, c] = ground.corners(*t as u32);
        a.z == b.z && b.z == c.z
    };
    if nodes.iter().map(|node| node.z + ground.origin.z).all(|z| (z - z.round()).abs() < 1e-6) {
        let level = (0..all).filter(is_level).count() as f64 / all as f64;
        if low.z >= 0.0 && high.z <= 255.0 {
            let what = format!(
                "all {count} heights of the terrain are whole numbers from 0 to 255, as in a picture or a hillshade"
            );
            return said(what, "take the terrain's heights in metres, with decimals");
        }
        let (creased, edge) = (creased(ground), edge(ground));
        if (STEPS..1.0 - STEPS).contains(&level) || creased > CREASED && edge <= COARSE {
            let (edge, [level, creased]) = (four(edge), [level, creased].map(percent));
            let what = format!(
                "all {count} heights of the terrain are whole metres in cells of {edge} m, {level} of its triangles are level, and \
                 {creased} of its nodes lie on edges: it has steps that the ground has not"
            );
            return said(what, "take a terrain whose heights have decimals");
        }
    }
    // How far a node stands above and below those of all its triangles.
    let mut apart = vec![[f64::INFINITY; 2]; nodes.len()];
    for corners in ground.triangles.iter() {
        for (k, own) in corners.iter().enumerate() {
            for other in [corners[(k + 1) % 3], corners[(k + 2) % 3]] {
                let above = nodes[*own as usize].z - nodes[other as usize].z;
                let [up, down] = &mut apart[*own as usize];
                (*up, *down) = (up.min(above), down.min(-above));
            }
        }
    }
    let alone = |[up, down]: &[f64; 2]| up.max(*down) > ALONE && up.max(*down) < f64::INFINITY;
    if let Some(at) = apart.iter().position(alone) {
        let [x, y, z] = (nodes[at] + ground.origin).into();
        let most = four(apart[at][0].max(apart[at][1]));
        let what =
            format!("the height {} m at ({x:.1}, {y:.1}) lies {most} m or more from all around it", four(z));
        return said(
            what,
            "an error of the survey, or a mark of cells without height: correct it, or name it with nodata_value",
        );
    }
    let edge = edge(ground);
    if edge > COARSE {
        let what = format!(
            "triangles of the terrain are {} m wide: rocks bounce on ground as flat as that",
            four(edge)
        );
        return said(what, "a terrain model of 0.5 to 5 m cells shows the ground that rocks hit");
    }
    None
}

/// Edges of the triangles, as of a grid [m].
fn edge(ground: &Terrain) -> f64 {
    let [low, high] = ground.extent();
    (2.0 * (high.x - low.x) * (high.y - low.y) / ground.triangles.len() as f64).sqrt()
}

/// Share of the nodes whose triangles do not all lie in one plane.
fn creased(ground: &Terrain) -> f64 {
    let mut normals: Vec<Option<Vector3<f64>>> = vec![None; ground.nodes.len()];
    let mut creased = vec![false; ground.nodes.len()];
    for (at, nodes) in ground.triangles.iter().enumerate() {
        let [a, b, c] = ground.corners(at as u32);
        let normal = (b - a).cross(&(c - a)).normalize();
        for node in nodes.map(|node| node as usize) {
            creased[node] |= (*normals[node].get_or_insert(normal) - normal).norm() > 1e-3;
        }
    }
    creased.iter().filter(|creased| **creased).count() as f64 / creased.len() as f64
}

/// What is said of a rock that starts very high above the terrain.
pub fn above(model: &Model, ground: &Terrain, at: usize) -> Option<Diagnostic> {
    let height = height_at_start(ground, &model.settings, at).filter(|height| *height > HIGH)?;
    let z = model.settings.rocks[at].position[2];
    let cure = other_heights(z - height, z)
        .unwrap_or("is its height right, and are the heights of the terrain in metres?");
    let what = format!("rock `{}` starts {} m above the terrain", model.rocks[at].name, four(height));
    Some(Diagnostic::warning(code::PLACE, what).about(model.settings.place_key(at)).try_instead(cure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_in_other_units_or_axes_is_named_with_the_one_that_is_meant() {
        let (low, high) =
            (Vector3::new(2.683e6, 1.247e6, 1140.0), Vector3::new(2.68312e6, 1.24708e6, 1200.0));
        let said =
            |x: f64, y: f64, z: f64| beside(&Vector3::new(x, y, z), &low, &high, 0.8).unwrap_or_default();
        for ((x, y, z), words, cure) in [
            ((1.24704e6, 2.68301e6, 1202.0), "x and y exchanged", "[2683010.0, 1247040.0, 1202.0]"),
            ((2683.01, 1247.04, 1.202), "in kilometres", "[2683010.0, 1247040.0, 1202.0]"),
            ((683_010.0, 247_040.0, 1202.0), "LV03", "[2683010.0, 1247040.0, 1202.0]"),
            ((8.54, 47.37, 1202.0), "longitude and latitude", "gdaltransform"),
            ((10.0, 40.0, 1202.0), "from the terrain's corner", "[2683010.0, 1247040.0, 1202.0]"),
        ] {
            let said = said(x, y, z);
            assert!(said.contains(words) && said.contains(cure), "{said}");
        }
        assert_eq!(said(2.69e6, 1.25e6, 1202.0), "");
        let of = |low: [f64; 3], high: [f64; 3], place: [f64; 3]| {
            beside(&place.into(), &low.into(), &high.into(), 0.8).unwrap_or_default()
        };
        // 2.0 m by 1.0 m of a terrain that is 2 km long; 40 m x 80 m of slope that stand upright in their file.
        assert!(of([0.0; 3], [1.2, 1.0, 0.6], [10.0, 20.0, 98.0]).contains("in kilometres"));
        assert!(of([0.0, 60.0, -40.0], [80.0, 100.0, 0.0], [10.0, 20.0, 98.0]).contains("is y upward"));
        assert!(
            of([2e6, 1e6, 0.0], [2.2e6, 1.1e6, 9.0], [3e6, 3e6, 9.0])
                .contains("is its cell size in millimetres")
        );
    }

    #[test]
    fn heights_in_other_units_are_known_by_their_ratio() {
        assert!(other_heights(3937.0, 1202.0).is_some_and(|w| w.contains("feet")));
        assert!(other_heights(1.2, 1202.0).is_some_and(|w| w.contains("kilometres")));
        assert!(other_heights(-1195.0, 1202.0).is_some_and(|w| w.contains("downwards")));
        assert_eq!(other_heights(1250.0, 1202.0), None);
    }
}
