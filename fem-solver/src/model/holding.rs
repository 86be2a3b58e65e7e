//! Supports: what holds, until when, and what moves.

use super::Model;
use super::pressure::Motion;
use crate::config::structure::{StructureConfig, SupportEntry, TurningConfig};
use crate::read::refuse;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// Part of the extent of the structure below which a motion is rounding.
const ROUNDING: f64 = 1e-12;

impl Model {
    /// All supports of the scene.
    pub(super) fn add_supports(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        let mut until = vec![f64::NEG_INFINITY; self.dof_count()];
        for (i, entry) in table.supports.iter().enumerate() {
            let key = format!("structure.supports.{i}");
            check(scene, &key, entry)?;
            let mut moves = false;
            for node in self.place(scene, &key, entry.place())? {
                for dof in self.supported(node, entry) {
                    match entry.released_at {
                        Some(time) => until[dof] = until[dof].max(time),
                        None => self.held[dof] = true,
                    }
                }
                moves |= self.move_support(scene, &key, node, entry)?;
            }
            let angles = entry.turning.iter().flat_map(|turning| &turning.angles);
            if !moves && angles.into_iter().any(|row| row[1] != 0.0) {
                let what = "nothing turns: its nodes lie on the axis, or it holds them in no direction in which they would move";
                let hint = "rotations = \"xyz\" turns the ends of beams at the nodes as well";
                return refuse(scene, &format!("{key}.turning"), what, hint);
            }
        }
        // What another support holds for ever is not let go.
        until.iter_mut().zip(&self.held).filter(|(_, held)| **held).for_each(|(t, _)| *t = f64::NEG_INFINITY);
        if until.iter().any(|t| t.is_finite()) {
            self.until = until;
        }
        Ok(())
    }

    /// Degrees of freedom of a node that an entry supports.
    fn supported(&self, node: usize, entry: &SupportEntry) -> Vec<usize> {
        let letters = |of: &str| ['x', 'y', 'z'].map(|c| of.contains(c));
        let (along, about) = (letters(&entry.directions), letters(&entry.rotations));
        let directions = (0..3).filter(|c| along[*c]).map(|c| self.dof(node, c));
        directions.chain((0..3).filter(|c| about[*c]).filter_map(|c| self.rotation(node, c))).collect()
    }

    /// The motion that an entry prescribes for a node, if any. Whether it moves anything.
    fn move_support(
        &mut self,
        scene: &Scene,
        key: &str,
        node: usize,
        entry: &SupportEntry,
    ) -> Result<bool, Diagnostic> {
        let supported = self.supported(node, entry);
        let (name, rows, motions) = match &entry.turning {
            Some(turning) => ("turning", "turning.angles", self.turns(node, turning)),
            None if entry.motion.is_empty() => return Ok(false),
            None => ("motion", "motion", self.moves(node, &entry.motion)),
        };
        let motions = motions.map_err(|what| scene.invalid(&format!("{key}.{rows}"), what))?;
        let key = format!("{key}.{name}");
        let mut moves = false;
        for (dof, motion) in motions {
            let name = self.dof_name(dof);
            if !supported.contains(&dof) {
                if entry.turning.is_none() && motion.size() > 0.0 {
                    let (size, directions) = (motion.size(), &entry.directions);
                    let what = format!(
                        "{name} is to move by up to {size} m, and directions = \"{directions}\" does not hold it there"
                    );
                    let hint = "name all directions of the motion, or write 0.0 for this one";
                    return refuse(scene, &key, what, hint);
                }
                continue;
            }
            if self.moving.iter().any(|(other, _)| *other == dof) {
                return Err(scene.invalid(&key, format!("{name} has two motions")));
            }
            moves |= motion.size() > ROUNDING * self.extent();
            self.moving.push((dof, motion));
        }
        Ok(moves)
    }

    /// Straight motions of a node by rows of displacements.
    fn moves(&self, node: usize, rows: &[[f64; 4]]) -> Result<Vec<(usize, Motion)>, String> {
        let along = |c: usize| {
            let rows: Vec<_> = rows.iter().map(|row| (row[0], row[1 + c])).collect();
            Ok((self.dof(node, c), Motion::new(&rows)?))
        };
        (0..3).map(along).collect()
    }

    /// Motions of a node that turns about an axis: its place on a circle, its rotation by the angle.
    fn turns(&self, node: usize, turning: &TurningConfig) -> Result<Vec<(usize, Motion)>, String> {
        let axis = Vector3::from(turning.axis).try_normalize(0.0).unwrap_or_default();
        let arm = self.nodes[node] - Vector3::from(turning.through);
        let radius = arm - axis * axis.dot(&arm);
        let ahead = axis.cross(&radius);
        let rows =
            |factor: f64| turning.angles.iter().map(|row| (row[0], factor * row[1])).collect::<Vec<_>>();
        let mut all = Vec::new();
        for c in 0..3 {
            all.push((self.dof(node, c), Motion::new(&rows(1.0))?.on_circle(radius[c], ahead[c])));
            if let Some(dof) = self.rotation(node, c) {
                all.push((dof, Motion::new(&rows(axis[c]))?));
            }
        }
        Ok(all)
    }

    /// Whether a support holds a degree of freedom in the step of `h` from `start` [s]: one that lets go does so at the end
    /// of a step that is nearest.
    pub fn holds(&self, dof: usize, start: f64, h: f64) -> bool {
        self.held[dof] || self.until.get(dof).is_some_and(|until| *until > start + 0.5 * h)
    }

    /// Whether a support holds a degree of freedom, if not for ever.
    pub fn held_first(&self, dof: usize) -> bool {
        self.held[dof] || self.until.get(dof).is_some_and(|until| *until > 0.0)
    }

    /// Whether a node is held in all directions, if not for ever.
    pub fn held_at_first(&self, node: usize) -> bool {
        (0..3).all(|c| self.held_first(self.dof(node, c)))
    }

    /// Degrees of freedom that supports let go.
    pub fn released(&self) -> Vec<usize> {
        (0..self.until.len()).filter(|dof| self.until[*dof].is_finite()).collect()
    }
}

/// Letters, axes and times of an entry.
fn check(scene: &Scene, key: &str, entry: &SupportEntry) -> Result<(), Diagnostic> {
    let no_axis = |letters: &str| letters.chars().any(|c| !"xyz".contains(c));
    if no_axis(&entry.rotations) {
        let what = format!("`{}` is no set of axes, write letters of xyz", entry.rotations);
        return Err(scene.invalid(&format!("{key}.rotations"), what));
    }
    if (entry.directions.is_empty() && entry.rotations.is_empty()) || no_axis(&entry.directions) {
        let what = format!("`{}` is no set of directions, write letters of xyz", entry.directions);
        let hint = "directions = \"xyz\" holds all, which is the default; \"z\" holds z alone";
        return refuse(scene, &format!("{key}.directions"), what, hint);
    }
    if let Some(time) = entry.released_at.filter(|time| *time < 0.0) {
        let what = format!("a support lets go at {time} s, before the run begins");
        return Err(scene.invalid(&format!("{key}.released_at"), what).try_instead("leave out the support"));
    }
    let Some(turning) = &entry.turning else { return Ok(()) };
    if !entry.motion.is_empty() {
        return Err(scene.invalid(&format!("{key}.turning"), "a support has either motion or turning"));
    }
    // Squares of tiny numbers are 0.
    if Vector3::from(turning.axis).try_normalize(0.0).is_none() {
        return Err(scene.invalid(&format!("{key}.turning.axis"), "the axis has no direction"));
    }
    if turning.angles.is_empty() {
        let what = "there are no angles: nothing turns";
        let hint = "rows are [t, angle] in s and rad, as [[0.0, 0.0], [1.0, 1.57]]";
        return refuse(scene, &format!("{key}.turning.angles"), what, hint);
    }
    Ok(())
}
