//! Generated structures: each a mesh with named parts, as a file would give it.

mod barrier;
mod nets;
mod site;

pub use self::nets::{Generated, MadeFor};
pub(super) use self::site::check_point;
use self::site::{BarrierLine, Site};
use crate::config::generator::{Barrier, Generator, Held};
use crate::read::Key;
use interface_defs::diagnostic::Diagnostic;
use toolkit::ground::Area;
use toolkit::scene::Scene;

/// Make the structure of `[structure.generator]`.
pub fn generate(scene: &Scene, generator: &Generator) -> Result<Generated, Diagnostic> {
    let key = &key(scene);
    match generator {
        Generator::RectangularNet(net) => {
            check_counts(key, "cells", net.cells)?;
            key.positive(&[("spacing", net.spacing, "m")])?;
            check_place(key, net.origin, net.center)?;
            Ok(nets::rectangular_net(net))
        }
        Generator::RingNet(net) => {
            check_counts(key, "rings", net.rings)?;
            key.positive(&[("diameter", net.diameter, "m")])?;
            check_place(key, net.origin, net.center)?;
            if net.diagonal && net.rings.iter().any(|count| count % 2 == 0) {
                let what = format!("{:?} leaves a corner without a ring", net.rings);
                return key.refuse("rings", what, "two odd numbers of cells beside `diagonal`");
            }
            if net.held == Held::Corners && !net.diagonal {
                let what = "a ring net has no nodes at its corners";
                return key.refuse("held", what, "`edges`, or `none` and supports of your own");
            }
            Ok(nets::ring_net(net))
        }
        Generator::Barrier(table) => {
            check_barrier(key, table)?;
            let site = if table.is_placed() { Some(Site::of(scene, table)?) } else { None };
            Ok(barrier::barrier(table, site.as_ref()))
        }
    }
}

/// The area in which heights of the ground are needed for the barrier of `table`, whose `ground` is not named: none if its line has its own.
/// Further around it where its net `touches` the ground: a block takes it along.
pub fn area(scene: &Scene, table: &Barrier, touches: bool) -> Result<Option<Area>, Diagnostic> {
    check_barrier(&key(scene), table)?;
    let line = BarrierLine::of(scene, table)?;
    // A cell more, between whose heights the furthest anchor lies.
    let stands = table.anchor_distance.max(table.side_distance) + 2.0 * CELL;
    let margin = if touches { stands.max(SWEPT * table.height) } else { stands };
    Ok((!line.has_heights).then(|| Area {
        wants: "structure.generator.ground".into(),
        of: line.key.into(),
        line: line.points.iter().map(|p| [p.x, p.y]).collect(),
        epsg: line.system,
        margin,
        cell: CELL,
    }))
}

/// Distance of heights below a structure [m]: feet stand on kinks of the terrain within some centimetres.
pub(super) const CELL: f64 = 0.25;
/// How far from its line a net comes to the ground, in heights of its posts.
const SWEPT: f64 = 4.0;

/// Most cells or rings of a generated net.
const MOST_CELLS: usize = 4_000_000;

fn key(scene: &Scene) -> Key<'_> {
    Key { scene, key: "structure.generator".into() }
}

fn check_counts(key: &Key, name: &str, counts: [usize; 2]) -> Result<(), Diagnostic> {
    // Some kilobytes each while it is computed.
    let many = counts[0].saturating_mul(counts[1]) > MOST_CELLS;
    if !counts.contains(&0) && !many {
        return Ok(());
    }
    let words = if many { format!("too many, at most {MOST_CELLS} are made") } else { "none".into() };
    let what = format!("a net of {} x {} {name} is {words}", counts[0], counts[1]);
    key.refuse(name, what, format!("{name} = [20, 20]"))
}

fn check_place(key: &Key, origin: Option<[f64; 3]>, center: Option<[f64; 3]>) -> Result<(), Diagnostic> {
    if origin.is_some() && center.is_some() {
        return Err(key.invalid("center", "state either origin or center"));
    }
    Ok(())
}

/// Lengths of posts and distances between them that a barrier can have [m]: kits have 2 to 9 m, and 4 to 12 m.
const POSTS: [f64; 2] = [0.1, 40.0];
const FIELDS: [f64; 2] = [0.1, 200.0];
/// Most beams of which a post consists.
const MOST_BEAMS: usize = 100;

/// Refuse keys that leave each other without use.
fn check_use(key: &Key, table: &Barrier) -> Result<(), Diagnostic> {
    let (placed, on_ground) = (table.is_placed(), table.ground.is_some());
    let on_line = "there is neither line nor position: nothing will use it";
    let apart = "the posts stand on a line, whose length and `fields` say how far apart";
    let idle = [
        ("azimuth", !placed && table.azimuth.is_some(), on_line),
        ("length", !placed && table.length.is_some(), on_line),
        ("ground", !placed && on_ground, on_line),
        ("uphill", !placed && table.uphill.is_some(), on_line),
        ("spacing", placed && table.spacing.is_some(), apart),
        ("anchor_rise", on_ground && table.anchor_rise.is_some(), "the anchors lie on the ground"),
    ];
    let Some((name, _, why)) = idle.into_iter().find(|(_, idle, _)| *idle) else { return Ok(()) };
    key.refuse(name, format!("`{name}`: {why}"), format!("leave `{name}` out"))
}

fn check_barrier(key: &Key, table: &Barrier) -> Result<(), Diagnostic> {
    if table.fields == 0 {
        return Err(key.invalid("fields", "a barrier has one field at least"));
    }
    check_counts(key, "cells", [table.cells[0].saturating_mul(table.fields), table.cells[1]])?;
    check_use(key, table)?;
    let (height, spacing, lean, brake) = (table.height, table.spacing(), table.lean(), table.brake_length);
    key.positive(&[("spacing", spacing, "m"), ("height", height, "m")])?;
    key.positive(&[
        ("anchor_distance", table.anchor_distance, "m"),
        ("side_distance", table.side_distance, "m"),
    ])?;
    key.positive(&[("brake_length", brake, "m")])?;
    key.not_negative(&[("anchor_rise", table.anchor_rise(), "m")])?;
    for (name, value) in [("anchor_distance", table.anchor_distance), ("side_distance", table.side_distance)]
    {
        if value > FIELDS[1] {
            let what = format!("a {name} of {value} m: anchors of barriers lie within {} m", FIELDS[1]);
            return key.refuse(name, what, "it is written in metres: 400 cm is 4.0");
        }
    }
    for (name, value, [least, most]) in [("height", height, POSTS), ("spacing", spacing, FIELDS)] {
        if !(least..=most).contains(&value) {
            let what = format!(
                "a {name} of {value} m: posts of barriers are {} to {} m long, and stand up to {} m apart",
                POSTS[0], POSTS[1], FIELDS[1]
            );
            return key.refuse(name, what, "it is written in metres: 400 cm is 4.0");
        }
    }
    if !(1..=MOST_BEAMS).contains(&table.post_elements) {
        let what = format!("a post of {} beams: 1 to {MOST_BEAMS} can be", table.post_elements);
        return Err(key.invalid("post_elements", what));
    }
    if lean.abs() >= height {
        return Err(key.invalid("lean", format!("posts of {height} m cannot lean by {lean} m")));
    }
    let shortest = (0.5 * table.side_distance).min(table.anchor_distance);
    if brake >= shortest {
        let what = format!("a brake of {brake} m does not fit into {shortest} m of rope");
        return Err(key.invalid("brake_length", what));
    }
    Ok(())
}

#[cfg(test)]
mod site_tests;
