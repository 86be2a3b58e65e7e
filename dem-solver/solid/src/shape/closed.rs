//! From triangles to a closed surface: corners joined, holes closed and pieces chosen when asked for, triangles turned the
//! same way, flaws named with their place.

use super::crossing;
use super::flaw::{Flaw, MOST_TRIANGLES};
use super::holes;
use super::integrals::SolidIntegrals;
use super::pieces::{PieceChoice, describe, name_at, of_triangles};
use super::surface::{Surface, joined};
use nalgebra::Vector3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Corners nearer than this share of the surface's size are joined, where those with equal
/// coordinates do not make it closed: files with single precision have such noise.
const WELD: f64 = 1e-6;

/// A triangle whose height is below this share of its longest edge has no direction.
const SLIVER: f64 = 1e-10;

/// What is done to triangles that are no closed surface, when it is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Mend {
    /// Close small holes.
    pub close_holes: bool,
    /// Of several closed surfaces take this one.
    pub piece: Option<PieceChoice>,
    /// What the file calls its parts, in its order, with the number of triangles before each.
    pub names: Vec<(usize, String)>,
}

impl Surface {
    /// A closed surface from loose triangles (three corners each), as an STL file has them. The
    /// second part says what was mended.
    pub fn from_soup(corners: &[[Vector3<f64>; 3]]) -> Result<(Self, Vec<String>), Flaw> {
        let (points, triangles) = joined(corners);
        Self::from_indexed(points, triangles)
    }

    /// A closed surface from corners and triangles. The second part says what was mended.
    pub fn from_indexed(
        points: Vec<Vector3<f64>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<(Self, Vec<String>), Flaw> {
        Self::mended(points, triangles, &Mend::default())
    }

    /// The same, with what `mend` asks for done to them.
    pub fn mended(
        points: Vec<Vector3<f64>>,
        triangles: Vec<[u32; 3]>,
        mend: &Mend,
    ) -> Result<(Self, Vec<String>), Flaw> {
        if triangles.len() > MOST_TRIANGLES {
            return Err(Flaw::TooMany(triangles.len()));
        }
        if triangles.len() < 4 {
            return Err(Flaw::TooFew(triangles.len()));
        }
        let finite: Vec<bool> = points.iter().map(|p| p.iter().all(|c| c.is_finite())).collect();
        if let Some(t) = triangles.iter().position(|t| t.iter().any(|p| !finite[*p as usize])) {
            return Err(Flaw::NotFinite(t + 1));
        }
        let mut notes = Vec::new();
        let mut loose = Self { points, triangles };
        let triangles_of_file = loose.triangles.len();
        let mut numbers: Vec<usize> = (1..=triangles_of_file).collect();
        if loose.edges(&numbers).is_err() {
            let joined = loose.weld(&mut numbers);
            if joined > 0 {
                notes.push(format!("{joined} corners were joined with their neighbours"));
            }
        }
        if let Some(choice) = &mend.piece {
            let piece = chosen(choice, &loose, &numbers, &mend.names)?;
            loose.keep(piece, &mut numbers)?;
        }
        if mend.close_holes {
            notes.extend(holes::close(&mut loose)?);
            let more = loose.triangles.len() - numbers.len();
            numbers.extend((0..more).map(|k| triangles_of_file + 1 + k));
        }
        if loose.triangles.len() < 4 {
            return Err(Flaw::TooFew(loose.triangles.len()));
        }
        if let Some(t) = (0..loose.triangles.len()).find(|t| loose.is_flat(*t)) {
            return Err(Flaw::Flat(numbers[t], loose.corners(t)[0]));
        }
        let edges = loose.edges(&numbers)?;
        let turned = loose.orient(&edges, &numbers)?;
        if turned > 0 {
            notes.push(format!("{turned} triangles were turned to face as their neighbours do"));
        }
        loose.drop_unused();
        let volume = SolidIntegrals::of(&loose).volume;
        if volume <= 0.0 {
            return Err(Flaw::Inverted(volume));
        }
        match crossing::find(&loose) {
            Some((a, b, place)) => Err(Flaw::Crossing(numbers[a], numbers[b], place)),
            None => Ok((loose, notes)),
        }
    }

    /// Keep one of its pieces.
    fn keep(&mut self, piece: u32, numbers: &mut Vec<usize>) -> Result<(), Flaw> {
        let (of, count) = of_triangles(self);
        if piece == 0 || piece as usize > count {
            return Err(Flaw::NoPiece(piece, count));
        }
        let mut own = of.iter().map(|k| *k + 1 == piece as usize);
        self.triangles.retain(|_| own.next() == Some(true));
        let mut own = of.iter().map(|k| *k + 1 == piece as usize);
        numbers.retain(|_| own.next() == Some(true));
        Ok(())
    }

    fn is_flat(&self, triangle: usize) -> bool {
        let [a, b, c] = self.corners(triangle);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        (b - a).cross(&(c - a)).norm() <= SLIVER * longest
    }

    /// Join corners that are nearly the same; triangles that lose a corner vanish. How many were joined.
    fn weld(&mut self, numbers: &mut Vec<usize>) -> usize {
        let reach = WELD * self.size();
        if reach <= 0.0 {
            return 0;
        }
        let (lowest, _) = self.bounds();
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let mut joined = 0;
        let kept: Vec<u32> = (0..self.points.len() as u32)
            .map(|i| {
                let p = self.points[i as usize];
                let cell = [0, 1, 2].map(|k| ((p[k] - lowest[k]) / reach).floor() as i64);
                for step in 0..27 {
                    let near = [cell[0] + step % 3 - 1, cell[1] + step / 3 % 3 - 1, cell[2] + step / 9 - 1];
                    let same = cells.get(&near).and_then(|others| {
                        others.iter().find(|o| (self.points[**o as usize] - p).norm() < reach)
                    });
                    if let Some(same) = same {
                        joined += 1;
                        return *same;
                    }
                }
                cells.entry(cell).or_default().push(i);
                i
            })
            .collect();
        let mut left = Vec::with_capacity(self.triangles.len());
        let mut left_numbers = Vec::with_capacity(numbers.len());
        for (t, n) in self.triangles.iter().zip(numbers.iter()) {
            let [a, b, c] = t.map(|p| kept[p as usize]);
            if a != b && b != c && c != a {
                left.push([a, b, c]);
                left_numbers.push(*n);
            }
        }
        self.triangles = left;
        *numbers = left_numbers;
        joined
    }

    /// The two triangles at each edge, the edge from the smaller to the larger number of its ends.
    fn edges(&self, numbers: &[usize]) -> Result<HashMap<(u32, u32), [u32; 2]>, Flaw> {
        const NONE: u32 = u32::MAX;
        let mut sides: HashMap<(u32, u32), [u32; 2]> = HashMap::with_capacity(self.triangles.len() * 3 / 2);
        let ends = |(a, b): (u32, u32)| [self.points[a as usize], self.points[b as usize]];
        for (t, corner) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corner[k], corner[(k + 1) % 3]);
                if a == b {
                    return Err(Flaw::Flat(numbers[t], self.points[a as usize]));
                }
                match sides.entry((a.min(b), a.max(b))) {
                    Entry::Vacant(place) => {
                        place.insert([t as u32, NONE]);
                    }
                    Entry::Occupied(mut place) if place.get()[1] == NONE => place.get_mut()[1] = t as u32,
                    Entry::Occupied(place) => {
                        let edge = *place.key();
                        let at = |t: &&[u32; 3]| t.contains(&edge.0) && t.contains(&edge.1);
                        let count = self.triangles.iter().filter(at).count();
                        return Err(Flaw::Branched(numbers[t], ends(edge), count));
                    }
                }
            }
        }
        let open = sides.iter().filter(|(_, t)| t[1] == NONE);
        match open.clone().min_by_key(|(edge, t)| (t[0], **edge)) {
            Some((edge, t)) => Err(Flaw::Open(numbers[t[0] as usize], ends(*edge), open.count())),
            None => Ok(sides),
        }
    }

    /// Turn triangles so that neighbours face alike, as most do. How many were turned.
    fn orient(&mut self, edges: &HashMap<(u32, u32), [u32; 2]>, numbers: &[usize]) -> Result<usize, Flaw> {
        let count = self.triangles.len();
        // 0: not seen, 1: as it is, 2: turned.
        let mut state = vec![0_u8; count];
        let mut pieces = 0;
        let mut stack = Vec::new();
        for start in 0..count {
            if state[start] != 0 {
                continue;
            }
            pieces += 1;
            state[start] = 1;
            stack.push(start);
            while let Some(t) = stack.pop() {
                for k in 0..3 {
                    let (a, b) = (self.triangles[t][k], self.triangles[t][(k + 1) % 3]);
                    let both = edges[&(a.min(b), a.max(b))];
                    let other = (if both[0] as usize == t { both[1] } else { both[0] }) as usize;
                    // Neighbours that face alike run along their edge in opposite directions.
                    let runs_alike = (0..3)
                        .any(|k| self.triangles[other][k] == a && self.triangles[other][(k + 1) % 3] == b);
                    let due = if runs_alike { 3 - state[t] } else { state[t] };
                    if state[other] == 0 {
                        state[other] = due;
                        stack.push(other);
                    } else if state[other] != due {
                        return Err(Flaw::OneSided(numbers[other]));
                    }
                }
            }
        }
        if pieces > 1 {
            return Err(Flaw::Pieces(describe(self, numbers)));
        }
        let turned = state.iter().filter(|s| **s == 2).count();
        let minority = if turned * 2 > count { 1 } else { 2 };
        for (triangle, state) in self.triangles.iter_mut().zip(&state) {
            if *state == minority {
                triangle.swap(1, 2);
            }
        }
        Ok(turned.min(count - turned))
    }

    fn drop_unused(&mut self) {
        let mut place = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        for corner in self.triangles.as_flattened_mut() {
            let at = &mut place[*corner as usize];
            if *at == u32::MAX {
                *at = points.len() as u32;
                points.push(self.points[*corner as usize]);
            }
            *corner = *at;
        }
        self.points = points;
    }
}

/// The number of the piece that is asked for, from 1. `numbers` are those of the triangles in the file.
fn chosen(
    choice: &PieceChoice,
    surface: &Surface,
    numbers: &[usize],
    names: &[(usize, String)],
) -> Result<u32, Flaw> {
    let asked = match choice {
        PieceChoice::Number(number) => return Ok(*number),
        PieceChoice::Name(name) => name,
    };
    let (of, count) = of_triangles(surface);
    let name = |k: usize| of.iter().position(|p| *p == k).and_then(|t| name_at(names, numbers[t]));
    let same: Vec<usize> = (0..count).filter(|k| name(*k) == Some(asked)).map(|k| k + 1).collect();
    match same[..] {
        [number] => Ok(number as u32),
        _ => {
            let mut all: Vec<String> = (0..count).filter_map(name).cloned().collect();
            all.dedup();
            Err(Flaw::NoName(asked.clone(), same, all))
        }
    }
}

#[cfg(test)]
mod tests;
