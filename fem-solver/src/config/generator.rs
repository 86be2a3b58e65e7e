//! `[structure.generator]`: structures that are made from a few numbers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use toolkit::coordinates::Coordinates;
use toolkit::tagged;

tagged! {
    /// A generated structure.
    #[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
    pub enum Generator by "type" (rename_all = "snake_case") {
        /// Square cells of cables in the plane of x and y.
        RectangularNet(RectangularNet),
        /// Rings in the plane of x and y.
        RingNet(RingNet),
        /// A barrier as a whole.
        Barrier(Barrier),
    }
}

/// `type = "rectangular_net"`: square cells of cables in the plane of x and y.
///
/// Group of elements: `net`. Groups of nodes: `edges`, `corners`, `interior`, `x_min`, `x_max`, `y_min`, `y_max`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangularNet {
    /// Cells in x and y.
    pub cells: [usize; 2],
    /// Edge of a cell [m].
    pub spacing: f64,
    /// Corner with the smallest x and y [m]; default the scene's origin. Not together with `center`.
    pub origin: Option<[f64; 3]>,
    /// Middle of the net [m], instead of `origin`.
    pub center: Option<[f64; 3]>,
    /// Which nodes are supported. Default `edges`.
    #[serde(default)]
    pub held: Held,
    /// Whether cables run along the frame. Default true.
    #[serde(default = "crate::element::cable::yes")]
    pub boundary_cables: bool,
}

/// Which nodes of a generated net are held, in all directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Held {
    /// All nodes of the frame.
    #[default]
    Edges,
    /// The four corners.
    Corners,
    /// None: `supports` says which.
    None,
}

/// `type = "ring_net"`: rings in the plane of x and y, each in contact with four neighbours.
///
/// Neighbouring rings share the node of their contact. The part `net` says what a ring becomes: a `ring`,
/// or with `element = "cable"` a closed polygon of cables through its contacts. That polygon is modelled
/// at its chords, 0.9 of the perimeter of a round ring: a ring of wire without bending stiffness pulls
/// only when it is stretched to a square of its perimeter, which `prestress = -0.117 E` says.
///
/// Group of elements: `net`. Groups of nodes: `edges`, `interior`, `x_min`, `x_max`, `y_min`, `y_max`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingNet {
    /// Rings in x and y; with `diagonal` cells, two odd numbers.
    pub rings: [usize; 2],
    /// Diameter of a ring, and distance of the middles of neighbours [m].
    pub diameter: f64,
    /// Rows at 45 degrees to the edges: a ring in every second cell of `diameter / sqrt(2)`, from the corners on.
    #[serde(default)]
    pub diagonal: bool,
    /// Corner with the smallest x and y [m]; default the scene's origin. Not together with `center`.
    pub origin: Option<[f64; 3]>,
    /// Middle of the net [m], instead of `origin`.
    pub center: Option<[f64; 3]>,
    /// Which nodes are supported: `edges` (default) or `none`.
    #[serde(default)]
    pub held: Held,
}

/// `type = "barrier"`: a barrier as a whole, in the manner of EAD 340059: posts, net, bearing ropes
/// with brakes, ropes to the slope with brakes, anchors.
///
/// Without `line` and `position` it stands in axes of its own: x runs along the barrier and is 0 in its middle, y points down
/// the slope (the direction in which rocks come), z upwards; the feet lie on y = z = 0. With one of them it stands on the
/// terrain: `docs/barrier.md`.
///
/// | group of elements | made for | what |
/// |---|---|---|
/// | `net` | cables or rings | the net between the ropes |
/// | `posts` | beams | foot to head |
/// | `top_rope`, `bottom_rope` | sliding cables | along heads (feet) and the net's edge, from brake to brake |
/// | `side_ropes` | cables | along the net's two sides, foot to head |
/// | `rope_brakes` | brakes | ends of the bearing ropes to the side anchors |
/// | `upslope_ropes` | cables | two from each head towards the slope |
/// | `upslope_brakes` | brakes | their ends to the anchors in the slope |
/// | `lateral_ropes` | cables | heads of the outer posts to the side anchors |
///
/// Groups of nodes besides: `feet`, `heads`, `side_anchors`, `upslope_anchors`, `anchors`, `free_net`
/// (the net without feet and heads), `middle_field`, and `impact`: what of the net lies within 0.6 m
/// (a block of 3 200 kg is some 1.2 m wide) of the middle of the middle field, or the node next to
/// it. Nothing is held: `supports` says what.
///
/// The defaults are the arrangement of the test: three fields, the block into the middle of the
/// middle one (Geosciences 2019, 9(1), 49, section 2), 10 m each. The other lengths are chosen,
/// within what kits of this class have (posts of 3 to 5 m), and no manufacturer's: the drawing of a
/// kit goes before them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Barrier {
    /// Fields between posts. Of a `line` of several pieces, each has as many as keep the longest field short.
    pub fields: usize,
    /// Distance of the posts [m]. Default 10; not with `line` or `position`, whose length says it.
    pub spacing: Option<f64>,
    /// Length of the posts [m].
    pub height: f64,
    /// Beams of which a post consists, one above the other: 1 bears loads at head and foot alone, a post that is struck takes 8.
    pub post_elements: usize,
    /// How far the heads lie down the slope of the feet [m]; below 0: towards the slope. Default with `line` or `position`: posts stand
    /// at 75 degrees to the slope, steeper than its normal, and lean by 25 degrees from the vertical at least; in axes of its own 0.
    pub lean: Option<f64>,
    /// Cells (or rings) of the net in a field, and between the bearing ropes.
    pub cells: [usize; 2],
    /// What the net is made of.
    pub net: BarrierNet,
    /// How far the anchors of the upslope ropes lie up the slope of the feet [m], as seen from above.
    pub anchor_distance: f64,
    /// How far they lie above the feet [m]. Default 4; not with `ground`, on which they lie.
    pub anchor_rise: Option<f64>,
    /// How far the side anchors lie beyond the outer posts [m], as seen from above; those of the bottom rope at half of it.
    pub side_distance: f64,
    /// Length of a brake before it gives way [m].
    pub brake_length: f64,
    /// The line of the posts' feet: two points or more, `[x, y]` [m] on the ground or `[x, y, z]` [m], or a GeoJSON file. A post stands
    /// at each.
    pub line: Option<Coordinates<Vec<f64>>>,
    /// The middle of the line, `[x, y]` or `[x, y, z]` [m], in place of `line`; with `azimuth` and `length`.
    pub position: Option<Vec<f64>>,
    /// Direction of the line [degrees from y (north), clockwise as seen from above: 90 is x (east)].
    pub azimuth: Option<f64>,
    /// Length of the line as seen from above [m].
    pub length: Option<f64>,
    /// Heights of the ground around the line: an ESRI grid (`.asc`), from the directory of the scene. Where points have two
    /// numbers and the scene has `[terrain]`, `rockfall` makes it of that by itself.
    pub ground: Option<PathBuf>,
    /// On which side of the line, seen from its first point, the slope rises. Default: as the ground does; without `ground` it
    /// is required.
    pub uphill: Option<Side>,
}

impl Default for Barrier {
    fn default() -> Self {
        Self {
            fields: 3,
            spacing: None,
            height: 4.0,
            post_elements: 1,
            lean: None,
            cells: [20, 8],
            net: BarrierNet::Square,
            anchor_distance: 6.0,
            anchor_rise: None,
            side_distance: 5.0,
            brake_length: 1.0,
            line: None,
            position: None,
            azimuth: None,
            length: None,
            ground: None,
            uphill: None,
        }
    }
}

impl Barrier {
    /// Distance of the posts in own axes [m].
    pub fn spacing(&self) -> f64 {
        self.spacing.unwrap_or(10.0)
    }

    /// Height of the upslope anchors above the feet, without ground [m].
    pub fn anchor_rise(&self) -> f64 {
        self.anchor_rise.unwrap_or(4.0)
    }

    /// How far the heads lie down the slope of the feet in own axes [m].
    pub fn lean(&self) -> f64 {
        self.lean.unwrap_or(0.0)
    }

    /// Whether it stands on a line of the terrain.
    pub fn is_placed(&self) -> bool {
        self.line.is_some() || self.position.is_some()
    }
}

/// A side of a line, seen from its first point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// To the left.
    Left,
    /// To the right.
    Right,
}

impl Generator {
    /// Whether it says itself where on the terrain it stands.
    pub fn is_placed(&self) -> bool {
        matches!(self, Self::Barrier(barrier) if barrier.is_placed())
    }

    /// The raster of the ground that it stands on, where it names one.
    pub fn ground(&self) -> Option<&PathBuf> {
        match self {
            Self::Barrier(barrier) => barrier.ground.as_ref(),
            Self::RectangularNet(_) | Self::RingNet(_) => None,
        }
    }

    /// With what is chosen where nothing is stated.
    pub fn filled_in(&self) -> Self {
        let mut filled = self.clone();
        if let Self::Barrier(barrier) = &mut filled {
            if !barrier.is_placed() {
                barrier.spacing = Some(barrier.spacing());
            }
            if barrier.ground.is_none() {
                barrier.anchor_rise = Some(barrier.anchor_rise());
            }
        }
        filled
    }
}

/// What the net of a barrier is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BarrierNet {
    /// Cables along both directions of the cells; cells are as long as field and height make them.
    Square,
    /// A ring in each cell.
    Rings,
    /// Rows of rings at 45 degrees to the ropes: a ring in every second cell, which it touches at the corners, so that its diameter is the
    /// cell's diagonal.
    DiagonalRings,
}
