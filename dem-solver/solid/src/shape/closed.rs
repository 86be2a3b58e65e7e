//! From triangles to a closed surface: corners joined, holes closed and pieces chosen when asked for, triangles turned the
//! same way, flaws named with their place.

use super::crossing;
use super::holes;
use super::integrals::SolidIntegrals;
use super::pieces::{self, PieceChoice};
use super::surface::{Surface, place};
use crate::geometry::{by_first_use, is_flat};
use nalgebra::Vector3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Most triangles of a rock's surface.
pub const MOST_TRIANGLES: usize = 5_000_000;

/// Corners nearer than this share of the surface's size are joined, where those with equal
/// coordinates do not make it closed: files with single precision have such noise.
const WELD: f64 = 1e-6;

/// A triangle whose height is below this share of its longest edge has no direction.
const SLIVER: f64 = 1e-10;

/// Open edges that are more than those of small holes.
const MANY: usize = 50;

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
    /// A closed surface from corners and triangles, or why it is none; triangles are counted from 1, in the file's order. The second
    /// part says what was mended.
    pub fn from_indexed(
        points: Vec<Vector3<f64>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<(Self, Vec<String>), String> {
        Self::mended(points, triangles, &Mend::default())
    }

    /// The same, with what `mend` asks for done to them.
    pub fn mended(
        points: Vec<Vector3<f64>>,
        triangles: Vec<[u32; 3]>,
        mend: &Mend,
    ) -> Result<(Self, Vec<String>), String> {
        let count = triangles.len();
        if count > MOST_TRIANGLES {
            return Err(format!(
                "{count} triangles: up to {MOST_TRIANGLES} are possible; thin the surface out"
            ));
        }
        let enough = |count: usize| match count {
            0..4 => Err(format!("{count} triangles enclose nothing: 4 are the fewest")),
            _ => Ok(()),
        };
        enough(count)?;
        let finite: Vec<bool> = points.iter().map(|p| p.iter().all(|c| c.is_finite())).collect();
        if let Some(t) = triangles.iter().position(|t| t.iter().any(|p| !finite[*p as usize])) {
            return Err(format!("triangle {} has a coordinate that is not a finite number", t + 1));
        }
        let mut notes = Vec::new();
        let mut loose = Self { points, triangles };
        let mut numbers: Vec<usize> = (1..=count).collect();
        if loose.edges(&numbers).is_err() {
            let joined = loose.weld(&mut numbers);
            if joined > 0 {
                notes.push(format!("{joined} corners were joined with their neighbours"));
            }
        }
        if let Some(choice) = &mend.piece {
            let own = pieces::chosen(choice, &loose, &numbers, &mend.names)?;
            loose.triangles = own.iter().map(|t| loose.triangles[*t]).collect();
            numbers = own.iter().map(|t| numbers[*t]).collect();
        }
        if mend.close_holes {
            notes.extend(holes::close(&mut loose)?);
            let more = loose.triangles.len() - numbers.len();
            numbers.extend((0..more).map(|k| count + 1 + k));
        }
        enough(loose.triangles.len())?;
        if let Some(t) = (0..loose.triangles.len()).find(|t| is_flat(loose.corners(*t), SLIVER)) {
            return Err(flat(numbers[t], &loose.corners(t)[0]));
        }
        let edges = loose.edges(&numbers)?;
        let turned = loose.orient(&edges, &numbers, &mend.names)?;
        if turned > 0 {
            notes.push(format!("{turned} triangles were turned to face as their neighbours do"));
        }
        by_first_use(&mut loose.points, &mut loose.triangles);
        let volume = SolidIntegrals::of(&loose).volume;
        if volume < 0.0 {
            loose.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            notes.push("the surface was inside out: all its triangles were turned to face outwards".into());
        }
        match crossing::find(&loose) {
            Some((a, b, at)) => {
                let (a, b, at) = (numbers[a], numbers[b], place(&at));
                Err(format!("the surface runs through itself: triangles {a} and {b} cross near {at}"))
            }
            None => Ok((loose, notes)),
        }
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
        let triangles =
            self.triangles.iter().map(|t| t.map(|p| kept[p as usize])).zip(numbers.iter().copied());
        (self.triangles, *numbers) = triangles.filter(|([a, b, c], _)| a != b && b != c && c != a).unzip();
        joined
    }

    /// The two triangles at each edge, the edge from the smaller to the larger number of its ends.
    fn edges(&self, numbers: &[usize]) -> Result<HashMap<(u32, u32), [u32; 2]>, String> {
        const NONE: u32 = u32::MAX;
        let mut sides: HashMap<(u32, u32), [u32; 2]> = HashMap::with_capacity(self.triangles.len() * 3 / 2);
        let ends = |(a, b): (u32, u32)| {
            format!("from {} to {}", place(&self.points[a as usize]), place(&self.points[b as usize]))
        };
        for (t, corner) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corner[k], corner[(k + 1) % 3]);
                if a == b {
                    return Err(flat(numbers[t], &self.points[a as usize]));
                }
                let edge = (a.min(b), a.max(b));
                match sides.entry(edge) {
                    Entry::Vacant(free) => drop(free.insert([t as u32, NONE])),
                    Entry::Occupied(mut taken) if taken.get()[1] == NONE => taken.get_mut()[1] = t as u32,
                    Entry::Occupied(_) => {
                        let at = |t: &&[u32; 3]| t.contains(&edge.0) && t.contains(&edge.1);
                        let (count, ends, one) =
                            (self.triangles.iter().filter(at).count(), ends(edge), numbers[t]);
                        return Err(format!(
                            "{count} triangles share the edge {ends}, one of them triangle {one}: there must be two"
                        ));
                    }
                }
            }
        }
        let open = sides.iter().filter(|(_, t)| t[1] == NONE);
        let Some((edge, t)) = open.clone().min_by_key(|(edge, t)| (t[0], **edge)) else { return Ok(sides) };
        let count = open.count();
        let sheet = "; so many are those of a sheet, as a terrain is: [terrain] file = \"...\"";
        let (first, triangle) = (ends(*edge), numbers[t[0] as usize]);
        let more = if count > MANY { sheet } else { "" };
        Err(format!(
            "the surface is open: {count} edges have a triangle on one side only, the first {first}, of triangle {triangle}; \
             small holes are closed with `--close-holes`, in a scene with `shape.close_holes = true`{more}"
        ))
    }

    /// Turn triangles so that neighbours face alike, as most do. How many were turned.
    fn orient(
        &mut self,
        edges: &HashMap<(u32, u32), [u32; 2]>,
        numbers: &[usize],
        names: &[(usize, String)],
    ) -> Result<usize, String> {
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
                        return Err(format!(
                            "the triangles cannot be turned the same way (a surface with one side): the contradiction is at \
                             triangle {}",
                            numbers[other]
                        ));
                    }
                }
            }
        }
        if pieces > 1 {
            return Err(pieces::describe(self, numbers, names));
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
}

fn flat(triangle: usize, at: &Vector3<f64>) -> String {
    format!("triangle {triangle} near {} is degenerate: its corners lie on a line", place(at))
}

#[cfg(test)]
mod tests;
