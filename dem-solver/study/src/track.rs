//! What is kept of a member's trajectory: the largest values in each cell of the maps, where it crosses lines, the trajectory itself, thinned.
//!
//! Between two rows of a trajectory (a touch begins or ends, a window ends) a rock flies a parabola, which is followed exactly;
//! in contact rows are close. Speed and energy of a flight are largest at an end of each piece; the height over the ground is
//! taken at both ends and in the middle.

use super::base::Base;
use super::path_quantity::{PathPoint, RASTERS, rasters};
use dem_rocks::results::trajectory::Row;
use dem_solid::geometry::plan::Point;
use dem_terrain::Terrain;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// The largest values of a member in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// The cell.
    pub cell: u32,
    /// Of the quantities that have [`rasters`], in their order.
    pub values: [f32; RASTERS],
}

/// Where a member crosses a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Crossing {
    /// Number of the line, from 0.
    pub line: u16,
    /// Distance along the line [m].
    pub along: f64,
    /// The member there.
    pub at: PathPoint,
}

/// What is kept of a trajectory.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// By cell, in ascending order.
    pub visits: Vec<Visit>,
    /// In the order of time.
    pub crossings: Vec<Crossing>,
    /// Its points: position (local) [m], speed [m/s].
    pub path: Vec<[f32; 4]>,
}

/// Follows a member row by row.
pub struct Follower<'a> {
    base: &'a Base,
    last: Option<Known>,
    visits: Vec<Visit>,
    place: FxHashMap<u32, usize>,
    cuts: Vec<f64>,
    track: Track,
    keeps_path: bool,
}

/// A row, with what the terrain says there.
#[derive(Clone, Copy)]
struct Known {
    row: Row,
    at: [f64; 2],
    /// Distance of the lowest point below the centre [m].
    lowest: Option<f64>,
}

/// Part of the piece from a row to the next: what is asked of it.
struct Piece<'a> {
    ground: &'a Terrain,
    from: Known,
    to: Known,
}

impl Piece<'_> {
    fn row(&self, share: f64) -> Row {
        match share {
            0.0 => self.from.row,
            1.0 => self.to.row,
            _ => self.from.row.towards(&self.to.row, share),
        }
    }

    /// Height of the lowest point, and of the centre, above the ground at a share of the piece.
    fn heights(&self, share: f64, row: &Row) -> Option<[f64; 2]> {
        let at = [0, 1].map(|k| self.from.at[k] + share * (self.to.at[k] - self.from.at[k]));
        let lowest = self.from.lowest? + share * (self.to.lowest? - self.from.lowest?);
        let centre = row.position()[2] - self.ground.origin.z - self.ground.ground_at(at)?;
        Some([centre - lowest, centre])
    }

    /// The member at a share of the piece, with its heights or without: they take a search in the terrain.
    fn point(&self, share: f64, with_heights: bool) -> PathPoint {
        let row = self.row(share);
        let (place, origin) = (row.position(), self.ground.origin);
        let heights = if with_heights { self.heights(share, &row) } else { None };
        let [height, centre] = heights.unwrap_or([f64::NAN; 2]);
        PathPoint {
            time: row.time(),
            position: [0, 1, 2].map(|k| place[k] - origin[k]),
            velocity: row.velocity(),
            centre,
            height,
            speed: row.speed(),
            energy: row.kinetic_energy(),
            rotation: row.rotation_energy(),
        }
    }
}

impl<'a> Follower<'a> {
    /// Of a member; `keeps_path`: whether its trajectory is drawn.
    pub fn new(base: &'a Base, keeps_path: bool) -> Self {
        let (visits, place, cuts) = (Vec::new(), FxHashMap::default(), Vec::new());
        Self { base, last: None, visits, place, cuts, track: Track::default(), keeps_path }
    }

    fn known(&self, row: &Row) -> Known {
        let (ground, place) = (&self.base.ground, row.position());
        let at = [place[0] - ground.origin.x, place[1] - ground.origin.y];
        let lowest =
            row.height().zip(ground.ground_at(at)).map(|(height, z)| place[2] - ground.origin.z - z - height);
        Known { row: *row, at, lowest }
    }

    /// Take in the next row.
    pub fn row(&mut self, row: &Row) {
        let to = self.known(row);
        let Some(from) = self.last.replace(to) else {
            return self.visit(&Piece { ground: &self.base.ground, from: to, to }, [0.0; 2]);
        };
        let piece = Piece { ground: &self.base.ground, from, to };
        if let Some(grid) = self.base.grid {
            let mut cuts = std::mem::take(&mut self.cuts);
            grid.cuts(from.at, to.at, &mut cuts);
            let mut begin = 0.0;
            for &end in cuts.iter().chain(&[1.0]) {
                self.visit(&piece, [begin, end]);
                begin = end;
            }
            self.cuts = cuts;
        }
        for (number, line) in self.base.lines.iter().enumerate() {
            cross(&piece, number as u16, line, &mut self.track.crossings);
        }
        if self.keeps_path {
            self.draw(&piece);
        }
    }

    /// The largest values between two shares of a piece, in the cell in their middle.
    fn visit(&mut self, piece: &Piece, [begin, end]: [f64; 2]) {
        let Some(grid) = &self.base.grid else { return };
        let middle = 0.5 * (begin + end);
        let at = [0, 1].map(|k| piece.from.at[k] + middle * (piece.to.at[k] - piece.from.at[k]));
        let Some(cell) = grid.at(at) else { return };
        let found = *self.place.entry(cell).or_insert_with(|| {
            self.visits.push(Visit { cell, values: [0.0; RASTERS] });
            self.visits.len() - 1
        });
        // In contact the lowest point is at the ground.
        let flies = !(piece.from.row.touches() && piece.to.row.touches());
        // Of a flight its middle too.
        let looks = [(begin, false), (end, false), (middle, true)];
        let count = if begin == end { 1 } else { 2 + usize::from(flies) };
        for (share, is_between) in &looks[..count] {
            let at = piece.point(*share, flies);
            let values = self.visits[found].values.iter_mut().zip(rasters());
            // Speed and energies are largest at an end: between them rounding alone could make them larger.
            let own = values.filter(|(_, (quantity, _))| !is_between || quantity.peaks_in_flight);
            // A height that is not known counts as none.
            own.for_each(|(kept, (quantity, _))| *kept = kept.max((quantity.of)(&at) as f32));
        }
    }

    /// Points of the trajectory, about two cells of the map apart.
    fn draw(&mut self, piece: &Piece) {
        let step = 2.0 * self.base.grid.map_or(1.0, |grid| grid.cell);
        let way = (0..2).map(|k| (piece.to.at[k] - piece.from.at[k]).powi(2)).sum::<f64>().sqrt();
        let add = |path: &mut Vec<[f32; 4]>, row: &Row| {
            let origin = self.base.ground.origin;
            let place = row.position();
            let [x, y, z] = [0, 1, 2].map(|k| (place[k] - origin[k]) as f32);
            path.push([x, y, z, row.speed() as f32]);
        };
        if self.track.path.is_empty() {
            add(&mut self.track.path, &piece.from.row);
        }
        let parts = (way / step).ceil().max(1.0) as usize;
        (1..parts).for_each(|k| add(&mut self.track.path, &piece.row(k as f64 / parts as f64)));
        let last = self.track.path[self.track.path.len() - 1];
        let there = [piece.to.at[0] as f32, piece.to.at[1] as f32];
        let apart = f64::from((there[0] - last[0]).hypot(there[1] - last[1]));
        if apart >= 0.5 * step || (piece.to.row.touches() && !piece.from.row.touches() && apart > 0.1 * step)
        {
            add(&mut self.track.path, &piece.to.row);
        }
    }

    /// All of it.
    pub fn end(mut self) -> Track {
        self.visits.sort_by_key(|visit| visit.cell);
        self.track.visits = self.visits;
        self.track
    }
}

/// Where a piece of a trajectory crosses a line.
fn cross(piece: &Piece, number: u16, line: &[Point], found: &mut Vec<Crossing>) {
    let (a, b) = (piece.from.at, piece.to.at);
    let way = [b[0] - a[0], b[1] - a[1]];
    let before = found.len();
    let mut passed = 0.0;
    for pair in line.windows(2) {
        let side = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = side[0].hypot(side[1]);
        let det = way[0] * side[1] - way[1] * side[0];
        let off = [pair[0][0] - a[0], pair[0][1] - a[1]];
        let (share, along) =
            ((off[0] * side[1] - off[1] * side[0]) / det, (off[0] * way[1] - off[1] * way[0]) / det);
        // A row on the line belongs to the piece that ends there.
        if share > 0.0 && share <= 1.0 && (0.0..1.0).contains(&along) {
            found.push(Crossing {
                line: number,
                along: passed + along * length,
                at: piece.point(share, true),
            });
        }
        passed += length;
    }
    found[before..].sort_by(|a, b| a.at.time.total_cmp(&b.at.time));
}
