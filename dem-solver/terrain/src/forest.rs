//! Forest: a drag `F = -alpha v` on a rock whose centre is below the effective height of the stand.
//!
//! One linear drag for all trunks and for rocks of any size, as in RAMMS; single trunks are not seen.

use super::Terrain;
use super::queries::Parabola;
use super::settings::ForestName;
use dem_solid::geometry::bounds;
use nalgebra::Vector3;

/// Drag of a forest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forest {
    /// alpha [kg/s].
    pub drag: f64,
    /// Height over the ground up to which it acts [m].
    pub height: f64,
}

impl Forest {
    /// From the keys of a table, which have been checked.
    pub fn of(drag: Option<f64>, height: Option<f64>) -> Option<Self> {
        Some(Self { drag: drag?, height: height? })
    }
}

impl ForestName {
    /// Drag of the stand [kg/s]: of 20, 35 and 50 m2 of trunks per hectare, the classes of RAMMS.
    pub fn drag(self) -> f64 {
        match self {
            Self::Open => 250.0,
            Self::Medium => 500.0,
            Self::Dense => 750.0,
        }
    }
}

/// Forests, in boxes that hold them.
#[derive(Debug, Clone, Default)]
pub struct Stands(Vec<(Vector3<f64>, Vector3<f64>)>);

impl Stands {
    /// On a terrain, gravity pointing along the unit vector `down`.
    pub fn new(ground: &Terrain, down: &Vector3<f64>) -> Self {
        let stand = |(zone, forest): (usize, &Option<Forest>)| {
            let forest = forest.as_ref()?;
            let of_zone = (0..ground.triangles.len() as u32).filter(|t| usize::from(ground.zone(*t)) == zone);
            let corners = of_zone.flat_map(|t| ground.corners(t));
            let [low, high] = bounds(corners.flat_map(|c| [c, c - down * forest.height]));
            (low.x <= high.x).then_some((low, high))
        };
        Self(ground.forests.iter().enumerate().filter_map(stand).collect())
    }

    /// True if there is none.
    pub fn are_none(&self) -> bool {
        self.0.is_empty()
    }

    /// Steps of `h` [s], at most `most`, in which a flight stays out of all of them for certain.
    pub fn steps_outside(&self, flight: &Parabola, h: f64, most: usize) -> usize {
        let mut steps = most;
        let meets = |steps: usize| {
            let (low, high) = flight.piece(0.0, h * steps as f64);
            self.0.iter().any(|(l, u)| (0..3).all(|a| low[a] <= u[a] && high[a] >= l[a]))
        };
        while steps > 0 && meets(steps) {
            steps /= 2;
        }
        steps
    }

    /// Force on a rock at `position`, local, with `velocity` [m/s] [N].
    pub fn force(
        &self,
        ground: &Terrain,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        down: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let holds = |(l, u): &(Vector3<f64>, Vector3<f64>)| {
            (0..3).all(|a| l[a] <= position[a] && position[a] <= u[a])
        };
        if !self.0.iter().any(holds) {
            return None;
        }
        let (height, triangle) = ground.below(position, down)?;
        let forest = ground.forests[usize::from(ground.zone(triangle))]?;
        (height <= forest.height).then(|| velocity * -forest.drag)
    }
}

impl Terrain {
    /// Largest drag of any forest on it [kg/s].
    pub fn largest_forest_drag(&self) -> f64 {
        self.forests.iter().flatten().map(|forest| forest.drag).fold(0.0, f64::max)
    }
}
