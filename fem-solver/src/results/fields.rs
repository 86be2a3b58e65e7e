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

use crate::element::Cable;
use crate::internal_force::assembly::Assembly;
use crate::linear_algebra::node_major::{difference_to_node_major, to_node_major};
use crate::model::Model;
use crate::state::State;
use interface_defs::mesh::InterfaceMesh;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::rc::Rc;
use toolkit::files;
use toolkit::once::each_once;
use toolkit::vtu::{Cells, KeptSeries, Series, Vtu};

/// A series of field files at multiples of an interval.
pub struct Fields {
    model: Rc<Model>,
    series: Series,
    interval: f64,
    written: u64,
    /// Nodes at t = 0, x, y, z of one after the other [m].
    start: Vec<f64>,
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    /// The lines, and the section of each [m2], 0 where it has none.
    lines: Vec<[u32; 2]>,
    section: Vec<f64>,
    /// Whether there are moments of beams.
    beams: bool,
    legend: Legend,
    assembly: Assembly,
    faces: Option<Faces>,
}

/// The two series.
const LINES: &str = "structure";
const FACES: &str = "structure_faces";

/// Files written so far, for a run that goes on.
#[derive(Debug, Serialize, Deserialize)]
pub struct KeptFields {
    written: u64,
    lines: KeptSeries,
    faces: Option<KeptSeries>,
}

/// Names of the moments of beams, in the order of [`crate::element::Element::moments`].
const MOMENTS: [&str; 5] = [
    "bending_moment_1_start",
    "bending_moment_1_end",
    "bending_moment_2_start",
    "bending_moment_2_end",
    "torsion",
];

/// The faces.
struct Faces {
    series: Series,
    /// Nodes of all, one after the other, and where those of each end.
    nodes: Vec<u32>,
    ends: Vec<u32>,
    /// Whether some have moments.
    shells: bool,
}

impl Faces {
    /// Those of `model`; `None` where there are none.
    fn create(model: &Model, series: impl FnOnce() -> io::Result<Series>) -> io::Result<Option<Self>> {
        let cells = || model.elements.iter().map(|e| e.face_cell()).filter(|cell| !cell.is_empty());
        if cells().next().is_none() {
            return Ok(None);
        }
        let mut end = 0;
        let ends = cells().map(|cell| {
            end += cell.len() as u32;
            end
        });
        Ok(Some(Self {
            series: series()?,
            ends: ends.collect(),
            nodes: cells().flatten().map(|node| *node as u32).collect(),
            shells: model.elements.iter().any(|e| e.constants().rotates && !e.face_cell().is_empty()),
        }))
    }
}

impl Fields {
    /// A series in `dir`, a file at the first committed time at or after each multiple of `interval` [s], beginning with what is
    /// `kept` of a run that goes on.
    pub fn create(
        dir: &Path,
        interval: f64,
        mesh: &InterfaceMesh,
        model: &Rc<Model>,
        kept: Option<KeptFields>,
    ) -> io::Result<Self> {
        let (written, lines, faces) = kept.map_or((0, None, None), |k| (k.written, Some(k.lines), k.faces));
        let series = |name, kept| match kept {
            Some(kept) => Series::go_on(dir, name, kept),
            None => Series::create(dir, name),
        };
        let of_cables = model.cables.iter().map(|c| c.of.area);
        let of_others = model
            .elements
            .iter()
            .flat_map(|e| std::iter::repeat_n(e.constants().section, e.constants().lines));
        let sections = of_cables.chain(of_others);
        let (lines, legend) = (series(LINES, lines)?, Legend::new(model));
        legend.write(dir)?;
        Ok(Self {
            series: lines,
            interval,
            written,
            start: mesh.coordinates.clone(),
            displacement: vec![0.0; mesh.coordinates.len()],
            velocity: vec![0.0; mesh.coordinates.len()],
            lines: mesh.lines.clone(),
            section: sections.collect(),
            beams: model.elements.iter().any(|e| e.constants().has_moments),
            legend,
            assembly: Assembly::new(model),
            faces: Faces::create(model, || series(FACES, faces))?,
            model: model.clone(),
        })
    }

    /// The files written so far, all of them on the disk.
    pub fn kept(&mut self) -> io::Result<KeptFields> {
        let faces = self.faces.as_mut().map(|faces| faces.series.kept()).transpose()?;
        Ok(KeptFields { written: self.written, lines: self.series.kept()?, faces })
    }

    /// Wait until all states are written.
    pub fn finish(&mut self) -> io::Result<()> {
        let faces = self.faces.as_mut().map_or(Ok(()), |faces| faces.series.finish());
        self.series.finish().and(faces)
    }

    /// Write `state` at `time` if a multiple of the interval has been reached.
    pub fn offer(&mut self, origin: &[f64], state: &State, time: f64) -> io::Result<()> {
        // A time that is a multiple but for rounding counts as that multiple.
        let reached = (time / self.interval * (1.0 + 1e-12) + 1e-9).floor() as u64 + 1;
        if reached <= self.written {
            return Ok(());
        }
        self.written = reached;
        let nodes = self.model.node_count();
        difference_to_node_major(&state.displacement, origin, nodes, &mut self.displacement);
        to_node_major(&state.velocity, nodes, &mut self.velocity);
        let points = self.start.iter().zip(&self.displacement).map(|(start, u)| start + u);
        let points: Vec<f64> = points.collect();
        self.write_faces(state, &points, time)?;
        self.write_lines(state, &points, time)
    }

    /// The lines with their forces, stresses and moments.
    fn write_lines(&mut self, state: &State, points: &[f64], time: f64) -> io::Result<()> {
        let (model, count) = (&self.model, self.lines.len());
        let tension = |cable: &Cable| cable.response(&model.relative(&state.displacement, cable)).tension;
        // NaN where it is broken.
        let mut forces: Vec<f64> = model.cables.iter().map(tension).collect();
        let mut utilisation = vec![0.0; forces.len()];
        let yields = model.elements.iter().any(|e| e.constants().plastic.is_some());
        let mut plastic_strain = yields.then(|| vec![0.0; forces.len()]);
        let mut moments = self.beams.then(|| MOMENTS.map(|_| vec![0.0; count]));
        for (i, element) in model.elements.iter().enumerate() {
            let (first, history) = (forces.len(), self.assembly.history(i, &state.history));
            let u = self.assembly.gather(i, &state.displacement);
            forces.resize(first + element.constants().lines, 0.0);
            element.line_forces(u, history, &mut forces[first..]);
            let plastic = element.plastic_utilisation(u, history);
            let used = |force: &f64| {
                if force.is_nan() { 1.0 } else { element.force_utilisation(u, *force).max(plastic) }
            };
            utilisation.extend(forces[first..].iter().map(used));
            if let Some(plastic) = &mut plastic_strain {
                plastic.resize(forces.len(), element.constants().plastic.map_or(0.0, |at| history[at]));
            }
            if let Some(moments) = moments.as_mut().filter(|_| element.constants().has_moments) {
                for (own, moment) in moments.iter_mut().zip(element.moments(u, history)) {
                    own[first..forces.len()].fill(moment);
                }
            }
        }
        let broken: Vec<f64> = forces.iter().map(|force| flag(force.is_nan())).collect();
        forces.iter_mut().filter(|force| force.is_nan()).for_each(|force| *force = 0.0);
        let slack: Vec<f64> = forces.iter().map(|force| flag(*force == 0.0)).collect();
        let stress = |(force, area): (&f64, &f64)| if *area > 0.0 { force / area } else { 0.0 };
        let stress: Vec<f64> = forces.iter().zip(&self.section).map(stress).collect();
        let mut cell_data: Vec<(&str, usize, &[f64])> = Vec::new();
        if count > 0 {
            cell_data.extend([
                ("part", 1, &self.legend.line_parts[..]),
                ("group", 1, &self.legend.line_groups),
                ("axial_force", 1, &forces),
                ("stress", 1, &stress),
                ("utilisation", 1, &utilisation),
                ("slack", 1, &slack),
                ("broken", 1, &broken),
            ]);
            cell_data.extend(plastic_strain.iter().map(|strain| ("plastic_strain", 1, &strain[..])));
            let moments = MOMENTS.iter().zip(moments.iter().flatten());
            cell_data.extend(moments.map(|(name, values)| (*name, 1, &values[..])));
        }
        let vtu = Vtu {
            points,
            cells: if count == 0 { Cells::Vertices } else { Cells::Lines(&self.lines) },
            point_data: vec![
                ("displacement", 3, &self.displacement),
                ("velocity", 3, &self.velocity),
                ("group", 1, &self.legend.node_groups),
            ],
            cell_data,
        };
        self.series.add(time, &vtu)
    }

    fn write_faces(&mut self, state: &State, points: &[f64], time: f64) -> io::Result<()> {
        let Some(faces) = &mut self.faces else { return Ok(()) };
        // Both of: stress, force per width, moment per width.
        let mut values: [[Vec<f64>; 2]; 3] = Default::default();
        let mut slack = Vec::with_capacity(faces.ends.len());
        let with_faces = self.model.elements.iter().enumerate().filter(|(_, e)| !e.face_cell().is_empty());
        for (i, element) in with_faces {
            let history = self.assembly.history(i, &state.history);
            let u = self.assembly.gather(i, &state.displacement);
            let stresses = element.face_stresses(u);
            let forces = stresses.map(|stress| stress * element.constants().thickness);
            for (to, own) in values.iter_mut().zip([stresses, forces, element.face_moments(u, history)]) {
                to.iter_mut().zip(own).for_each(|(to, own)| to.push(own));
            }
            slack.push(flag(stresses == [0.0; 2]));
        }
        let [stresses, forces, moments] = &values;
        let mut cell_data = vec![
            ("part", 1, &self.legend.face_parts[..]),
            ("group", 1, &self.legend.face_groups),
            ("stress_1", 1, &stresses[0]),
            ("stress_2", 1, &stresses[1]),
            ("force_1", 1, &forces[0]),
            ("force_2", 1, &forces[1]),
            ("slack", 1, &slack),
        ];
        if faces.shells {
            cell_data.extend([("moment_1", 1, &moments[0][..]), ("moment_2", 1, &moments[1])]);
        }
        let vtu = Vtu {
            points,
            cells: Cells::Polygons { nodes: &faces.nodes, ends: &faces.ends },
            point_data: vec![("displacement", 3, &self.displacement), ("velocity", 3, &self.velocity)],
            cell_data,
        };
        faces.series.add(time, &vtu)
    }
}

fn flag(is: bool) -> f64 {
    f64::from(u8::from(is))
}

/// File of the legend, beside the field files.
const LEGEND: &str = "structure_legend.json";

/// Numbers of part and group of each line, face and node; 0 = none.
struct Legend {
    line_parts: Vec<f64>,
    line_groups: Vec<f64>,
    face_parts: Vec<f64>,
    face_groups: Vec<f64>,
    node_groups: Vec<f64>,
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
    fn new(model: &Model) -> Self {
        let groups = model.groups.iter().map(|g| g.name.as_str());
        let names = each_once(groups.chain(model.parts.iter().map(|p| p.name.as_str())));
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
        let spread = |[of_cables, of_elements]: &[Vec<usize>; 2], faces: bool| -> Vec<f64> {
            let count = |i: usize| {
                let element = &model.elements[i];
                if faces { usize::from(!element.face_cell().is_empty()) } else { element.constants().lines }
            };
            let others = of_elements.iter().enumerate().flat_map(|(i, n)| std::iter::repeat_n(n, count(i)));
            let first = if faces { &[][..] } else { of_cables };
            first.iter().chain(others).map(|n| *n as f64).collect()
        };
        let groups = groups.map(|all| all.into_iter().map(|(number, _)| number).collect::<Vec<_>>());
        let none = || (0, "none".to_owned());
        let part_names =
            model.parts[..model.part_count].iter().enumerate().map(|(i, p)| (i + 1, p.name.clone()));
        let group_names = names.iter().enumerate().map(|(i, name)| (i + 1, (*name).to_owned()));
        Self {
            line_parts: spread(&parts, false),
            line_groups: spread(&groups, false),
            face_parts: spread(&parts, true),
            face_groups: spread(&groups, true),
            node_groups: node_groups.into_iter().map(|(number, _)| number as f64).collect(),
            names: LegendNames {
                part: std::iter::once(none()).chain(part_names).collect(),
                group: std::iter::once(none()).chain(group_names).collect(),
            },
        }
    }

    /// Write the names into `dir`.
    fn write(&self, dir: &Path) -> io::Result<()> {
        let text = serde_json::to_string_pretty(&self.names).map_err(io::Error::from)?;
        files::write(&dir.join(LEGEND), (text + "\n").as_bytes())
    }
}

/// Keep the smaller of two groups, by their sizes; the first where they are equal.
fn smaller(kept: &mut (usize, usize), other: (usize, usize)) {
    if other.1 < kept.1 {
        *kept = other;
    }
}
