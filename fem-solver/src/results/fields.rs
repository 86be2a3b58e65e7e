//! Field files for ParaView.
//!
//! `structure`: its lines with displacement, velocity, `axial_force` [N], `stress` [Pa] (axial
//! force by the section as modelled; 0 where there is none, as in rings and brakes), `utilisation` (axial force over
//! `rupture_force`, or strain over `rupture_strain`, the larger; 0 without either, 1 where broken), and the flags `slack`
//! and `broken`; where there are beams, `bending_moment_1_start` to `bending_moment_2_end` [N m] in the plane of each cross
//! axis, positive where it bends the beam towards that axis, and `torsion` [N m], the same along an element.
//! `structure_faces`: its triangles and quadrilaterals, where there are any, with both principal stresses [Pa] (of the middle
//! surface; of a quadrilateral their mean), the principal forces per width `force_1`, `force_2` [N/m], the flag `slack`, and
//! where there are shells the principal bending moments per width `moment_1`, `moment_2` [N m/m].
//! `part` and `group` number parts and named sets; `structure_legend.json` says their names.

use crate::internal_force::assembly::Assembly;
use crate::linear_algebra::node_major::{difference_to_node_major, to_node_major};
use crate::model::Model;
use crate::state::State;
use interface_defs::mesh::InterfaceMesh;
use interface_defs::message::Fault;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use toolkit::files;
use toolkit::vtu::{Cells, KeptSeries, Series, Vtu};

/// A series of field files at multiples of an interval.
pub struct Fields {
    series: Series,
    interval: f64,
    written: u64,
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    points: Vec<f64>,
    tension: Vec<f64>,
    /// Section of each line [m2], 0 where it has none.
    section: Vec<f64>,
    stress: Vec<f64>,
    slack: Vec<f64>,
    broken: Vec<f64>,
    utilisation: Vec<f64>,
    /// Of beams: both bending moments at both ends, and torsion; empty without beams.
    moments: Vec<[f64; MOMENTS.len()]>,
    legend: Legend,
    assembly: Assembly,
    faces: Option<Faces>,
}

/// The two series.
const LINES: &str = "structure";
const FACES: &str = "structure_faces";

/// What was written, for a run that goes on.
#[derive(Debug, Serialize, Deserialize)]
pub struct KeptFields {
    written: u64,
    lines: KeptSeries,
    faces: Option<KeptSeries>,
}

/// Names of the moments of beams, in the order of [`crate::element::Moments`].
const MOMENTS: [&str; 5] = [
    "bending_moment_1_start",
    "bending_moment_1_end",
    "bending_moment_2_start",
    "bending_moment_2_end",
    "torsion",
];

/// The faces: their series, both principal stresses, forces and moments per width, and whether they are slack.
struct Faces {
    series: Series,
    /// Nodes of all, one after the other, and where those of each end.
    nodes: Vec<u32>,
    ends: Vec<u32>,
    stresses: [Vec<f64>; 2],
    forces: [Vec<f64>; 2],
    /// Empty without shells.
    moments: [Vec<f64>; 2],
    slack: Vec<f64>,
}

impl Faces {
    fn create(dir: &Path, model: &Model) -> Result<Option<Self>, Fault> {
        let cells = || model.elements.iter().map(|e| e.face_cell()).filter(|cell| !cell.is_empty());
        let count = cells().count();
        if count == 0 {
            return Ok(None);
        }
        let memory = |count: usize| [0, 1].map(|_| vec![0.0; count]);
        let mut end = 0;
        let ends = cells().map(|cell| {
            end += cell.len() as u32;
            end
        });
        let shells = model.elements.iter().any(|e| e.rotates() && !e.face_cell().is_empty());
        Ok(Some(Self {
            series: Series::create(dir, FACES).map_err(|e| cannot_write(&e))?,
            ends: ends.collect(),
            nodes: cells().flatten().map(|node| *node as u32).collect(),
            stresses: memory(count),
            forces: memory(count),
            moments: memory(if shells { count } else { 0 }),
            slack: vec![0.0; count],
        }))
    }
}

impl Fields {
    /// A series in `dir`, a file at the first committed time at or after each multiple of `interval` [s].
    pub fn create(dir: &Path, interval: f64, mesh: &InterfaceMesh, model: &Model) -> Result<Self, Fault> {
        let series = Series::create(dir, LINES).map_err(|e| cannot_write(&e))?;
        let n = mesh.coordinates.len();
        let memory = || vec![0.0; n];
        let legend = Legend::new(model);
        legend.write(dir).map_err(|e| cannot_write(&e))?;
        let beams = model.elements.iter().any(|e| e.has_moments());
        Ok(Self {
            series,
            interval,
            written: 0,
            displacement: memory(),
            velocity: memory(),
            points: memory(),
            tension: vec![0.0; mesh.lines.len()],
            section: sections(model),
            stress: vec![0.0; mesh.lines.len()],
            slack: vec![0.0; mesh.lines.len()],
            broken: vec![0.0; mesh.lines.len()],
            utilisation: vec![0.0; mesh.lines.len()],
            moments: vec![[0.0; MOMENTS.len()]; if beams { mesh.lines.len() } else { 0 }],
            legend,
            assembly: Assembly::new(model),
            faces: Faces::create(dir, model)?,
        })
    }

    /// Go on with the series in `dir` as they were when they were [`Fields::kept`].
    pub fn go_on(mut self, dir: &Path, kept: KeptFields) -> Result<Self, Fault> {
        self.written = kept.written;
        self.series = Series::go_on(dir, LINES, kept.lines).map_err(|e| cannot_write(&e))?;
        if let (Some(faces), Some(kept)) = (&mut self.faces, kept.faces) {
            faces.series = Series::go_on(dir, FACES, kept).map_err(|e| cannot_write(&e))?;
        }
        Ok(self)
    }

    /// What was written so far, all of it on the disk.
    pub fn kept(&mut self) -> Result<KeptFields, Fault> {
        let lines = self.series.kept().map_err(|e| cannot_write(&e))?;
        let faces = self.faces.as_mut().map(|faces| faces.series.kept());
        Ok(KeptFields {
            written: self.written,
            lines,
            faces: faces.transpose().map_err(|e| cannot_write(&e))?,
        })
    }

    /// Wait until all states are written.
    pub fn finish(&mut self) -> Result<(), Fault> {
        let faces = self.faces.as_mut().map_or(Ok(()), |faces| faces.series.finish());
        self.series.finish().and(faces).map_err(|e| cannot_write(&e))
    }

    /// Write `state` at `time` if a multiple of the interval has been reached.
    pub fn offer(
        &mut self,
        model: &Model,
        mesh: &InterfaceMesh,
        origin: &[f64],
        state: &State,
        time: f64,
    ) -> Result<(), Fault> {
        // A time that is a multiple but for rounding counts as that multiple.
        let reached = (time / self.interval * (1.0 + 1e-12) + 1e-9).floor() as u64 + 1;
        if reached <= self.written {
            return Ok(());
        }
        self.written = reached;
        let nodes = model.node_count();
        difference_to_node_major(&state.displacement, origin, nodes, &mut self.displacement);
        to_node_major(&state.velocity, nodes, &mut self.velocity);
        for ((point, start), u) in self.points.iter_mut().zip(&mesh.coordinates).zip(&self.displacement) {
            *point = start + u;
        }
        self.collect_lines(model, state);
        if self.faces.is_some() {
            self.write_faces(model, state, time)?;
        }
        self.write_lines(mesh, time)
    }

    /// Forces, stresses and moments of all lines.
    fn collect_lines(&mut self, model: &Model, state: &State) {
        let (cables, others) = self.tension.split_at_mut(model.cables.len());
        for (tension, cable) in cables.iter_mut().zip(&model.cables) {
            *tension = cable.response(&model.relative(&state.displacement, cable)).tension;
        }
        let mut at = 0;
        for (i, element) in model.elements.iter().enumerate() {
            let count = element.line_count();
            let history = self.assembly.history(i, &state.history);
            let u = self.assembly.gather(i, &state.displacement);
            let forces = &mut others[at..at + count];
            element.line_forces(u, history, forces);
            let first = model.cables.len() + at;
            for (share, force) in self.utilisation[first..first + count].iter_mut().zip(&*forces) {
                *share = if force.is_nan() { 1.0 } else { element.utilisation(u, *force) };
            }
            if element.has_moments() {
                self.moments[first..first + count].fill(element.moments(u, history).flat());
            }
            at += count;
        }
        for (force, (slack, broken)) in
            self.tension.iter_mut().zip(self.slack.iter_mut().zip(&mut self.broken))
        {
            *broken = f64::from(u8::from(force.is_nan()));
            *force = if force.is_nan() { 0.0 } else { *force };
            *slack = f64::from(u8::from(*force == 0.0));
        }
        for ((stress, force), area) in self.stress.iter_mut().zip(&self.tension).zip(&self.section) {
            *stress = if *area > 0.0 { force / area } else { 0.0 };
        }
    }

    fn write_lines(&mut self, mesh: &InterfaceMesh, time: f64) -> Result<(), Fault> {
        let separate: Vec<Vec<f64>> = (0..if self.moments.is_empty() { 0 } else { MOMENTS.len() })
            .map(|m| self.moments.iter().map(|of| of[m]).collect())
            .collect();
        let mut cell_data: Vec<(&str, usize, &[f64])> = Vec::new();
        if !mesh.lines.is_empty() {
            cell_data.extend([
                ("part", 1, &self.legend.line_parts[..]),
                ("group", 1, &self.legend.line_groups),
                ("axial_force", 1, &self.tension),
                ("stress", 1, &self.stress),
                ("utilisation", 1, &self.utilisation),
                ("slack", 1, &self.slack),
                ("broken", 1, &self.broken),
            ]);
            cell_data.extend(MOMENTS.iter().zip(&separate).map(|(name, values)| (*name, 1, &values[..])));
        }
        let vtu = Vtu {
            points: &self.points,
            cells: if mesh.lines.is_empty() { Cells::Vertices } else { Cells::Lines(&mesh.lines) },
            point_data: vec![
                ("displacement", 3, &self.displacement),
                ("velocity", 3, &self.velocity),
                ("group", 1, &self.legend.node_groups),
            ],
            cell_data,
        };
        self.series.add(time, &vtu).map_err(|e| cannot_write(&e))
    }

    fn write_faces(&mut self, model: &Model, state: &State, time: f64) -> Result<(), Fault> {
        let Some(faces) = &mut self.faces else { return Ok(()) };
        let with_faces = model.elements.iter().enumerate().filter(|(_, e)| !e.face_cell().is_empty());
        for (face, (i, element)) in with_faces.enumerate() {
            let history = self.assembly.history(i, &state.history);
            let u = self.assembly.gather(i, &state.displacement);
            let (stresses, moments) = (element.face_stresses(u), element.face_moments(u, history));
            for k in 0..2 {
                faces.stresses[k][face] = stresses[k];
                faces.forces[k][face] = stresses[k] * element.thickness();
                if let Some(moment) = faces.moments[k].get_mut(face) {
                    *moment = moments[k];
                }
            }
            faces.slack[face] = f64::from(u8::from(stresses == [0.0; 2]));
        }
        let mut cell_data = vec![
            ("part", 1, &self.legend.face_parts[..]),
            ("group", 1, &self.legend.face_groups),
            ("stress_1", 1, &faces.stresses[0]),
            ("stress_2", 1, &faces.stresses[1]),
            ("force_1", 1, &faces.forces[0]),
            ("force_2", 1, &faces.forces[1]),
            ("slack", 1, &faces.slack),
        ];
        if !faces.moments[0].is_empty() {
            cell_data.extend([("moment_1", 1, &faces.moments[0][..]), ("moment_2", 1, &faces.moments[1])]);
        }
        let vtu = Vtu {
            points: &self.points,
            cells: Cells::Polygons { nodes: &faces.nodes, ends: &faces.ends },
            point_data: vec![("displacement", 3, &self.displacement), ("velocity", 3, &self.velocity)],
            cell_data,
        };
        faces.series.add(time, &vtu).map_err(|e| cannot_write(&e))
    }
}

/// Section of each line [m2], 0 where it has none.
fn sections(model: &Model) -> Vec<f64> {
    let cables = model.cables.iter().map(|c| c.area);
    let others = model.elements.iter().flat_map(|e| std::iter::repeat_n(e.section(), e.line_count()));
    cables.chain(others).collect()
}

fn cannot_write(error: &std::io::Error) -> Fault {
    Fault::broken(format!("the field files of the structure cannot be written: {error}"))
}

/// File of the legend, beside the field files.
pub const LEGEND: &str = "structure_legend.json";

/// Which part and group each cell and point belongs to; 0 = none.
pub struct Legend {
    /// Part of each line.
    pub line_parts: Vec<f64>,
    /// Group of each line.
    pub line_groups: Vec<f64>,
    /// Part of each face.
    pub face_parts: Vec<f64>,
    /// Group of each face.
    pub face_groups: Vec<f64>,
    /// Group of each node.
    pub node_groups: Vec<f64>,
    names: LegendNames,
}

#[derive(Serialize)]
struct LegendNames {
    part: BTreeMap<usize, String>,
    group: BTreeMap<usize, String>,
}

impl Legend {
    /// Of `model`. A part is what the scene names so; a group any named set. What is in several has the number of the
    /// smallest.
    pub fn new(model: &Model) -> Self {
        let mut names: Vec<&str> = model.groups.iter().map(|g| g.name.as_str()).collect();
        names.extend(
            model.parts.iter().map(|p| p.name.as_str()).filter(|n| !names.contains(n)).collect::<Vec<_>>(),
        );
        let number = |name: &str| 1 + names.iter().position(|n| *n == name).expect("is listed");
        let mut node_groups = vec![(0, usize::MAX); model.node_count()];
        for group in &model.groups {
            let own = (number(&group.name), group.nodes.len());
            group.nodes.iter().for_each(|n| smaller(&mut node_groups[*n as usize], own));
        }
        let (cables, elements) = (model.cables.len(), model.elements.len());
        let mut groups = [vec![(0, usize::MAX); cables], vec![(0, usize::MAX); elements]];
        let mut parts = [vec![0; cables], vec![0; elements]];
        for (i, part) in model.parts.iter().enumerate() {
            let own = (number(&part.name), part.cables.len() + part.elements.len());
            for (kind, members) in [&part.cables, &part.elements].into_iter().enumerate() {
                for member in members {
                    smaller(&mut groups[kind][*member], own);
                    if i < model.part_count && parts[kind][*member] == 0 {
                        parts[kind][*member] = i + 1;
                    }
                }
            }
        }
        // Lines are the cables, then those of the other elements; one cell of faces is one element.
        let spread = |of: [Vec<usize>; 2], faces: bool| -> Vec<f64> {
            let [of_cables, of_elements] = of;
            let count = |i: usize| {
                let element = &model.elements[i];
                if faces { usize::from(!element.face_cell().is_empty()) } else { element.line_count() }
            };
            let others =
                of_elements.into_iter().enumerate().flat_map(|(i, n)| std::iter::repeat_n(n, count(i)));
            let first = if faces { Vec::new() } else { of_cables };
            first.into_iter().chain(others).map(|n| n as f64).collect()
        };
        let groups = groups.map(|all| all.into_iter().map(|(number, _)| number).collect::<Vec<_>>());
        let none = || (0, "none".to_owned());
        let part_names =
            model.parts[..model.part_count].iter().enumerate().map(|(i, p)| (i + 1, p.name.clone()));
        let group_names = names.iter().enumerate().map(|(i, name)| (i + 1, (*name).to_owned()));
        Self {
            line_parts: spread(parts.clone(), false),
            line_groups: spread(groups.clone(), false),
            face_parts: spread(parts, true),
            face_groups: spread(groups, true),
            node_groups: node_groups.into_iter().map(|(number, _)| number as f64).collect(),
            names: LegendNames {
                part: std::iter::once(none()).chain(part_names).collect(),
                group: std::iter::once(none()).chain(group_names).collect(),
            },
        }
    }

    /// Write the names into `dir`.
    pub fn write(&self, dir: &Path) -> std::io::Result<()> {
        let text = serde_json::to_string_pretty(&self.names).map_err(std::io::Error::from)?;
        files::write(&dir.join(LEGEND), (text + "\n").as_bytes())
    }
}

/// Keep the smaller of two groups, by their sizes; the first where they are equal.
fn smaller(kept: &mut (usize, usize), other: (usize, usize)) {
    if other.1 < kept.1 {
        *kept = other;
    }
}
