//! Lengths that several checks ask for.

use dem_contact::contact::broad_phase::mesh_elements::inverse_square;
use dem_contact::interface_mesh::{Element, Kind};
use dem_contact::settings::Settings;
use dem_solid::geometry::closest::{on_face, on_line};
use dem_terrain::Terrain;
use nalgebra::Vector3;

/// Height [m] of a rock's centre of mass over the terrain at the start; `None` where there is none below it.
pub fn height(ground: &Terrain, settings: &Settings, at: usize) -> Option<f64> {
    ground.height(&(Vector3::from(settings.rocks[at].position) - ground.origin), &settings.down())
}

/// Distance of an element from a point [m].
pub fn distance(element: &Element, point: &Vector3<f64>, [a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    match element.kind {
        Kind::Point => (a - point).norm(),
        Kind::Line => {
            let edge = b - a;
            on_line(point, a, &edge, inverse_square(&edge)).to_point.norm()
        }
        Kind::Face => on_face(point, [a, b, c]).to_point.norm(),
    }
}
