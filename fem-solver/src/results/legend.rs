//! Numbers of parts and groups in field files, and the legend that names them.

use crate::model::Model;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use toolkit::files;

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
