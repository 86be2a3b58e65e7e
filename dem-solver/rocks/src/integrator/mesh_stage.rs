//! A rock's surroundings in a window: near elements, their motion, pairs that may touch.
//!
//! Nothing here is state: it can be thrown away at any time without changing a result, but for the length of flights, and the
//! nodes that are selected. A run that goes on takes it along, and so takes the same windows.

use crate::integrator::schedule::Request;
use crate::model::Model;
use dem_contact::contact::broad_phase::mesh_elements::{NearList, NodeBox, Sweep};
use dem_contact::contact::broad_phase::mesh_pairs::{Instant, MeshPairs};
use dem_contact::contact::mesh::{MeshForces, MeshScene};
use dem_contact::interface_mesh::ContactMesh;
use dem_contact::interface_mesh::local_net::LocalNet;
use dem_contact::interface_mesh::motion::{MotionFields, NodeMotion, Seam, largest_difference};
use dem_contact::law::table::SurfaceLaws;
use dem_contact::rock::Motion;
use interface_defs::Fault;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Skin of the near list, as a share of the rock's reach: for the rock of the drop test
/// at 6 m/s a pass over the mesh each 9 ms.
const NEAR_SKIN: f64 = 0.15;

/// A window for the surroundings of one rock.
#[derive(Clone, Copy)]
pub struct MeshWindow<'a> {
    /// What it is computed from.
    pub request: Request<'a>,
    /// The mesh.
    pub contact_mesh: &'a ContactMesh,
    /// Places of its motion in the input.
    pub fields: &'a MotionFields,
    /// Largest distance that a node that is not sent has moved since the surroundings were listed [m].
    pub travel: f64,
    /// In its first step: displacement of the nodes that are sent at the end of the window before, if a contact remembers
    /// it [m].
    pub predicted: Option<&'a [f64]>,
    /// The net where it is advanced here; else it moves as the input says.
    pub net: Option<&'a LocalNet>,
}

impl<'a> MeshWindow<'a> {
    /// With a mesh that moves as the input says, of which all nodes are sent.
    pub fn new(request: Request<'a>, contact_mesh: &'a ContactMesh, fields: &'a MotionFields) -> Self {
        Self { request, contact_mesh, fields, travel: 0.0, predicted: None, net: None }
    }
}

/// The surroundings of one rock.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MeshStage {
    rock: usize,
    near: NearList,
    #[serde(skip)]
    motion: NodeMotion,
    /// Pairs that may touch.
    pub pairs: MeshPairs,
    /// Contacts and forces.
    #[serde(skip)]
    pub evaluation: MeshForces,
    /// Displacement of every node when the near list was made [m].
    reference: Vec<f64>,
    /// Furthest that a node is from there in this window [m].
    moved: f64,
    /// Where not all nodes are sent: how much nearer the rock a node may be at the window's start, or at its end, than when
    /// the near list was made [m]; and where the rock started.
    approach: f64,
    start: Vector3<f64>,
    #[serde(skip)]
    sweep: Option<Sweep>,
    #[serde(skip)]
    boxes: Vec<NodeBox>,
    /// Times that the near list was made.
    pub refreshes: u64,
}

impl MeshStage {
    /// Of rock number `rock`.
    pub fn new(model: &Model, rock: usize, contact_mesh: &ContactMesh, fields: &MotionFields) -> Self {
        let segments = fields.segments();
        let mut stage = Self {
            rock,
            near: NearList::new(contact_mesh),
            motion: NodeMotion::default(),
            pairs: MeshPairs::new(&model.rocks[rock], contact_mesh, segments),
            evaluation: MeshForces::default(),
            reference: vec![0.0; 3 * contact_mesh.nodes.len()],
            moved: 0.0,
            approach: 0.0,
            start: Vector3::zeros(),
            sweep: None,
            boxes: Vec::with_capacity(contact_mesh.nodes.len()),
            refreshes: 0,
        };
        let nodes = contact_mesh.nodes.len();
        stage.motion.reserve(nodes, segments);
        stage.evaluation.reserve(nodes, contact_mesh.elements.len(), Self::most_contacts(model, rock));
        stage
    }

    /// Go on with what was listed when the run was kept: how long nothing touches is said by the list at hand.
    pub fn go_on(&mut self, kept: Self) {
        let Self { motion, evaluation, boxes, .. } = std::mem::replace(self, kept);
        (self.motion, self.evaluation, self.boxes) = (motion, evaluation, boxes);
    }

    /// Contacts for which there is room from the start.
    pub fn most_contacts(model: &Model, rock: usize) -> usize {
        4 * model.rocks[rock].spheres.len() + 64
    }

    /// A window begins with the rock at `start`, which something may throw `kick` [m] off its flight.
    pub fn begin(&mut self, view: MeshWindow, start: &Motion, kick: f64) -> Result<(), Fault> {
        let (sweep, need) = self.sweep(view, start, kick);
        self.sweep = Some(sweep);
        self.start = start.position;
        self.measure(view);
        if !self.covers(view, &start.position, 3.0 * self.moved, need) {
            self.rebuild(view, start, 0, need)?;
        }
        self.read(view)?;
        self.pairs.begin(start, &self.motion);
        Ok(())
    }

    /// List the surroundings anew for a window that begins with the rock at `start`; returns the nodes.
    pub fn list(&mut self, view: MeshWindow, start: &Motion, kick: f64) -> Result<&[u32], Fault> {
        let (_, need) = self.sweep(view, start, kick);
        self.rebuild(view, start, 0, need)?;
        Ok(&self.near.nodes)
    }

    /// The space that the rock may sweep, and how far from its start all must be listed [m].
    fn sweep(&self, view: MeshWindow, start: &Motion, kick: f64) -> (Sweep, f64) {
        let Request { model, length, .. } = view.request;
        let (rock, gravity) = (&model.rocks[self.rock], &model.settings.gravity);
        let sweep = Sweep::new(rock, start, gravity, (length, view.fields.segments()), kick);
        (sweep, sweep.need(rock, view.contact_mesh).max(self.need_of_pairs(view)))
    }

    /// Time from `now`, the end of a window, on in which the rock touches nothing, were the net to stay as it is [s].
    pub fn free_time(&self, view: MeshWindow, now: &Motion) -> f64 {
        let rock = &view.request.model.rocks[self.rock];
        let (covered, centre) = self.near.coverage();
        let approach = match view.fields.is_partial() {
            true => self.approach + (now.position - self.start).norm(),
            false => 3.0 * self.moved + (now.position - centre).norm(),
        };
        let (speed, pull) = (now.velocity.norm(), view.request.model.settings.gravity.norm());
        let clear = |distance: f64| {
            let gap = distance - self.need_of_pairs(view);
            // gap = speed t + pull t^2 / 2, in the form that does not cancel.
            let root = (speed * speed + 2.0 * pull * gap.max(0.0)).sqrt();
            if gap > 0.0 { 2.0 * gap / (speed + root).max(f64::MIN_POSITIVE) } else { 0.0 }
        };
        let most = rock.reach / speed.max(f64::MIN_POSITIVE);
        // All were at least as far as the nearest one when the list was made. If that is not enough, what is listed is measured.
        let sure = clear(self.near.nearest - approach);
        if sure >= most {
            return most;
        }
        let listed = self.near.nearest_to(view.contact_mesh, &self.motion, &now.position);
        clear(listed.min(covered - approach)).max(sure).min(most)
    }

    /// Nothing that was listed counts any more: the mesh has other elements.
    pub fn forget(&mut self) {
        self.near.invalidate();
    }

    fn need_of_pairs(&self, view: MeshWindow) -> f64 {
        view.request.model.rocks[self.rock].reach + view.contact_mesh.largest_radius + self.pairs.skin
    }

    /// Bounds on the displacement of any node since the near list was made; and, where not all are sent, on how much nearer the
    /// rock they have come.
    fn measure(&mut self, view: MeshWindow) {
        if view.fields.is_partial() {
            let shift = self.start - self.near.coverage().1;
            let sent = view.fields.furthest_from(view.request.input, &self.reference, &shift);
            self.approach = sent.max(shift.norm() + view.travel);
            return;
        }
        let largest =
            view.fields.displacements(view.request.input).map(|u| largest_difference(u, &self.reference));
        self.moved = 3.0_f64.sqrt() * largest.fold(0.0, f64::max);
    }

    /// True if everything within `need` [m] of a rock at `now` is listed, nodes having moved by `moved` [m].
    fn covers(&self, view: MeshWindow, now: &Vector3<f64>, moved: f64, need: f64) -> bool {
        match view.fields.is_partial() {
            true => self.near.coverage().0 - self.approach - (now - self.start).norm() >= need,
            false => self.near.covers(now, moved, need),
        }
    }

    /// List what is near `now`, the mesh as at sample `sample`, good for `need` and a skin. It takes all nodes.
    fn rebuild(&mut self, view: MeshWindow, now: &Motion, sample: usize, need: f64) -> Result<(), Fault> {
        if view.fields.is_partial() {
            let rock = &view.request.model.rocks[self.rock].name;
            return Err(Fault::beyond(format!("rock `{rock}` may come upon nodes that are not sent")));
        }
        let rock = &view.request.model.rocks[self.rock];
        if let Some(displacement) = view.fields.displacements(view.request.input).nth(sample) {
            self.reference.copy_from_slice(displacement);
        }
        self.measure(view);
        let coverage = need + 3.0 * self.moved + NEAR_SKIN * rock.reach;
        let nodes = &view.contact_mesh.nodes;
        let at = |n: u32| nodes[n as usize] + view.fields.displacement(view.request.input, sample, n);
        self.near.build(view.contact_mesh, at, now.position, coverage);
        self.pairs.invalidate();
        self.refreshes += 1;
        Ok(())
    }

    fn read(&mut self, view: MeshWindow) -> Result<(), Fault> {
        let (Request { input, length, .. }, nodes) = (view.request, &view.contact_mesh.nodes);
        let read = self.motion.read(view.fields, input, nodes, &self.near.nodes, length);
        read.map_err(|node| {
            // The list may have been made of such numbers.
            self.near.invalidate();
            Fault::window(format!(
                "the displacement of interface node {node} is not finite; the structure has diverged"
            ))
        })
    }

    /// Make sure that every pair that touches at `now` is listed.
    pub fn update(&mut self, view: MeshWindow, now: &Motion, at: Instant) -> Result<(), Fault> {
        let rock = &view.request.model.rocks[self.rock];
        if let Some(net) = view.net {
            let place = |node: &u32| view.fields.place(*node).map(|at| net.node(at as usize));
            self.motion.place(self.near.nodes.iter().filter_map(place));
            if self.pairs.is_good_for(rock, now, &self.motion) {
                return Ok(());
            }
        } else if self.pairs.is_good(rock, now, at) {
            return Ok(());
        }
        let need = self.need_of_pairs(view);
        if !self.covers(view, &now.position, self.moved, need) {
            self.rebuild(view, now, at.segment, need)?;
            self.read(view)?;
        }
        let tree = &view.request.model.trees[self.rock];
        self.pairs.search(rock, tree, view.contact_mesh, (&self.near, &self.motion), now, at);
        Ok(())
    }

    /// Contacts and forces, and what they are evaluated with. The pairs must be good.
    pub fn parts<'a>(&'a mut self, view: MeshWindow<'a>) -> (&'a mut MeshForces, MeshScene<'a>) {
        let model = view.request.model;
        let laws = SurfaceLaws { laws: model.surfaces(), row: &model.rows[self.rock], materials: &[] };
        let seam = view.predicted.and_then(|predicted| {
            let actual = view.fields.displacements(view.request.input).next()?;
            Some(Seam { predicted, actual, fields: view.fields })
        });
        let scene = MeshScene {
            rock: &model.rocks[self.rock],
            faces: model.rocks[self.rock].faces.as_ref(),
            laws,
            contact_mesh: view.contact_mesh,
            list: &self.pairs,
            motion: &self.motion,
            moves_net: view.net.is_some(),
            seam,
        };
        (&mut self.evaluation, scene)
    }

    /// Add forces and stiffnesses of the contacts to the nodes of a net that is advanced here.
    pub fn load(&self, fields: &MotionFields, net: &mut LocalNet) {
        let of =
            self.pairs.numbers.iter().zip(&self.evaluation.node_forces).zip(&self.evaluation.node_stiffness);
        for ((number, force), stiffness) in of {
            let Some(place) = fields.place(*number) else { continue };
            let place = place as usize;
            net.force[3 * place..][..3].iter_mut().zip(force.iter()).for_each(|(sum, f)| *sum += f);
            net.stiffness[place][0] += stiffness[0];
            net.stiffness[place][1] += stiffness[1];
        }
    }

    /// Displacement of the listed nodes over segment `segment` [m], in the order of the pair list.
    pub fn increments(&self, segment: usize) -> impl Iterator<Item = &nalgebra::Vector3<f64>> {
        self.pairs.nodes.iter().map(move |a| self.motion.increment(segment, *a as usize))
    }

    /// True if the rock may reach an element in the window that began at `start`.
    pub fn in_reach(&mut self, view: MeshWindow, start: &Motion) -> bool {
        let mut any = false;
        self.reached(view, start, |_| {
            any = true;
            false
        });
        any
    }

    /// Mark the nodes of every element that the rock may reach in the window that began at `start`.
    pub fn mark_reach(&mut self, view: MeshWindow, start: &Motion, marks: &mut [f64]) {
        self.reached(view, start, |number| {
            mark(view, number, marks);
            true
        });
    }

    /// True if anything touched at the instant looked at last.
    pub fn touches(&self) -> bool {
        !self.evaluation.touch.contacts.is_empty()
    }

    /// Mark the nodes of every element that touches: where a bound was too narrow, what happened is reported all the same.
    pub fn mark_touched(&self, view: MeshWindow, marks: &mut [f64]) {
        for contact in &self.evaluation.touch.contacts {
            mark(view, self.pairs.elements[contact.element as usize].number, marks);
        }
    }

    fn reached(&mut self, view: MeshWindow, start: &Motion, mut found: impl FnMut(u32) -> bool) {
        let rock = &view.request.model.rocks[self.rock];
        let sweep = self.sweep.expect("begun");
        let (near, nodes, boxes) = (&self.near, &self.motion, &mut self.boxes);
        sweep.reached(rock, start, view.contact_mesh, (near, nodes), boxes, |element| found(element.number));
    }
}

/// Mark the nodes of element number `number`.
fn mark(view: MeshWindow, number: u32, marks: &mut [f64]) {
    let own = view.contact_mesh.elements[number as usize].own_nodes();
    own.iter().filter_map(|node| view.fields.place(*node)).for_each(|place| marks[place as usize] = 1.0);
}

/// Add the forces on the mesh's nodes, times `share`, to the field that begins at `field`.
pub fn add_forces(stage: &MeshStage, fields: &MotionFields, output: &mut [f64], field: usize, share: f64) {
    for (number, force) in stage.pairs.numbers.iter().zip(&stage.evaluation.node_forces) {
        let Some(place) = fields.place(*number) else { continue };
        let at = field + 3 * place as usize;
        for (o, f) in output[at..at + 3].iter_mut().zip(force.iter()) {
            *o += f * share;
        }
    }
}
