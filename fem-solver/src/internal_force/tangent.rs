//! The global tangent over the free degrees of freedom: pattern once, numbers as often as needed.

use crate::element::{Cable, Pace, Slack};
use crate::internal_force::assembly::Assembly;
use crate::linear_algebra::symmetric::SymmetricMatrix;
use crate::model::Model;
use crate::model::pressure::{TimedLoad, dofs_of_face, face_tangent};
use nalgebra::Matrix3;

/// Marks a degree of freedom that a support holds.
const CONSTRAINED: usize = usize::MAX;

/// `K` of `K x = r`, lower triangle, with what is needed to assemble and to solve it.
pub struct Tangent {
    /// Number of each degree of freedom among the free ones, or [`CONSTRAINED`].
    free: Vec<usize>,
    /// Degree of freedom of the structure of each free one.
    pub dofs: Vec<usize>,
    /// Its numbers and its factor, over the free degrees of freedom.
    pub matrix: SymmetricMatrix,
    /// Positions of the lower triangle of each cable, by rows.
    cables: Vec<[u32; 21]>,
    /// The other elements.
    assembly: Assembly,
    /// Whether elements that come in pieces do so here.
    in_pieces: bool,
    /// Degree of freedom of the structure at which each slip of an element in pieces is; they follow the free ones in the matrix.
    slips: Vec<usize>,
    /// Positions of the lower triangles of their tangents or of those of their pieces, by rows, one after the other, and whether each stands for its mirror
    /// image too: an element that comes back to a node, as a closed rope does, has entries beside its diagonal that lie on the
    /// structure's.
    elements: Vec<(u32, bool)>,
    /// Positions of the lower triangle of each face that pressure acts on, by rows, one after the other.
    faces: Vec<u32>,
    /// For each free degree of freedom whether a support that lets go later holds it now; empty without such supports.
    fixed: Vec<bool>,
    /// Number of assemblies so far: as long as it stays, so do the values and the factor.
    pub revision: u64,
}

impl Tangent {
    /// Pattern and positions of a structure, elements that come in pieces by these: as sparse as the structure, for solutions.
    pub fn new(model: &Model) -> Self {
        Self::with(model, true)
    }

    /// The same with all elements as a whole: the products of the matrix and its determinant count, too.
    pub fn whole(model: &Model) -> Self {
        Self::with(model, false)
    }

    fn with(model: &Model, in_pieces: bool) -> Self {
        let mut free = vec![CONSTRAINED; model.dof_count()];
        let mut dofs = Vec::new();
        for node in 0..model.node_count() {
            let turns = (0..3).filter_map(|c| model.rotation(node, c));
            let dofs_of_node = (0..3).map(|c| model.dof(node, c)).chain(turns);
            for dof in dofs_of_node.filter(|dof| !model.held[*dof]) {
                free[dof] = dofs.len();
                dofs.push(dof);
            }
        }
        let ends = |cable: &Cable| [0, 1, 2, 3, 4, 5].map(|i: usize| model.dof(cable.nodes[i / 3], i % 3));
        let places: Vec<_> =
            model.cables.iter().flat_map(|c| triangle(&free, &ends(c)).collect::<Vec<_>>()).collect();
        let assembly = Assembly::new(model);
        let (mut others, mut mirrored, mut slips) = (Vec::new(), Vec::new(), Vec::new());
        for (i, element) in model.elements.iter().enumerate() {
            let own = assembly.dofs(i);
            if !(in_pieces && element.constants().in_pieces) {
                others.extend(triangle(&free, own));
                mirrored
                    .extend(lower(own.len()).map(|(row, column)| row != column && own[row] == own[column]));
                continue;
            }
            let (mut before, last) = (CONSTRAINED, own.len() / 3 - 2);
            for (at, ends) in own.windows(6).step_by(3).enumerate() {
                let mut unknowns = [CONSTRAINED; 8];
                (0..6).for_each(|c| unknowns[c] = free[ends[c]]);
                unknowns[6] = before;
                if at < last {
                    before = dofs.len() + slips.len();
                    unknowns[7] = before;
                    slips.push(ends[3]);
                }
                others.extend(entries(&unknowns));
                mirrored.extend([false; 36]);
            }
        }
        let all = places.iter().chain(&others).flatten().copied();
        let matrix = SymmetricMatrix::new(dofs.len(), slips.len(), all);
        let place = |at: Option<(usize, usize)>| matrix.position(at);
        let cables = places.as_chunks::<21>().0.iter().map(|p| p.map(place)).collect();
        let elements = others.iter().map(|at| place(*at)).zip(mirrored).collect();
        // The nodes of a face are those of one element, whose entries the pattern has.
        let faces = model.timed.iter().chain(&model.live_pressures).flat_map(|load| &load.faces);
        let faces = faces
            .flat_map(|face| triangle(&free, &dofs_of_face(face, model.node_count())).collect::<Vec<_>>());
        let faces = faces.map(place).collect();
        let fixed = vec![false; if model.until.is_empty() { 0 } else { dofs.len() + slips.len() }];
        Self { free, dofs, matrix, cables, assembly, in_pieces, slips, elements, faces, fixed, revision: 0 }
    }

    /// Set the time between histories and displacements.
    pub fn set_pace(&mut self, pace: Pace) {
        self.assembly.pace = pace;
    }

    /// `share` times the tangent of all elements at the displacements `u`.
    pub fn assemble(&mut self, model: &Model, u: &[f64], history: &[f64], share: f64, slack: Slack) {
        self.assemble_blocks(model, share, |cable| {
            let w = model.relative(u, cable);
            let response = cable.response(&w);
            match slack {
                Slack::Regularised(part) if response.slack => {
                    Matrix3::from_diagonal_element(part * cable.axial_stiffness())
                }
                Slack::Taut if response.slack => {
                    let d = cable.span + w;
                    2.0 * cable.slope() * d * d.transpose()
                }
                _ => response.tangent,
            }
        });
        let mut places = self.elements.iter();
        for (i, element) in model.elements.iter().enumerate() {
            if self.in_pieces && element.constants().in_pieces {
                self.assembly.pieces(i, element, (u, history), slack, |k| {
                    for ((row, column), (at, _)) in lower(8).zip(&mut places) {
                        self.matrix.add(*at, share * k[row][column]);
                    }
                });
                continue;
            }
            let k = self.assembly.tangent(i, element, u, history, slack);
            let n = k.len().isqrt();
            for ((row, column), (at, mirrored)) in lower(n).zip(&mut places) {
                let both = k[row * n + column] + k[column * n + row];
                let counts = if *mirrored { 1.0 } else { 0.5 };
                self.matrix.add(*at, share * counts * both);
            }
        }
    }

    /// The same with a tangent of one's own for each cable.
    pub fn assemble_blocks(&mut self, model: &Model, share: f64, block: impl Fn(&Cable) -> Matrix3<f64>) {
        self.revision += 1;
        self.matrix.clear();
        for (cable, at) in model.cables.iter().zip(&self.cables) {
            let k = share * block(cable);
            for ((row, column), at) in lower(6).zip(at) {
                // Products are rounded in one order: the block beside the diagonal is that of the first node and the second.
                let beside = row / 3 != column / 3;
                let own = if beside { -k[(column % 3, row % 3)] } else { k[(row % 3, column % 3)] };
                self.matrix.add(*at, own);
            }
        }
        for (node, stiffness) in &model.springs {
            for (c, k) in stiffness.iter().enumerate() {
                let free = self.free[model.dof(*node, c)];
                if free != CONSTRAINED {
                    self.matrix.add_diagonal(free, share * k);
                }
            }
        }
    }

    /// Add to the tangent, for each element that is no cable, `part` of its largest stiffness between its nodes, in every
    /// direction: a soap film over what it spans.
    pub fn add_film(&mut self, model: &Model, u: &[f64], history: &[f64], part: f64) {
        let mut places = self.elements.iter();
        for (i, element) in model.elements.iter().enumerate() {
            if self.in_pieces && element.constants().in_pieces {
                self.assembly.pieces(i, element, (u, history), Slack::Taut, |k| {
                    let stiffness = (0..6).map(|d| k[d][d]).fold(0.0, f64::max) * part;
                    for ((row, column), (at, _)) in lower(8).zip(&mut places) {
                        let film = if row == column { stiffness } else { -stiffness };
                        let along = row % 3 == column % 3 && row < 6;
                        self.matrix.add(*at, if along { film } else { (row == column).into() });
                    }
                });
                continue;
            }
            let k = self.assembly.tangent(i, element, u, history, Slack::Taut);
            let n = k.len().isqrt();
            let stiffness = (0..n).map(|d| k[d * n + d]).fold(0.0, f64::max) * part;
            let nodes = element.nodes().len();
            let per_node = n / nodes;
            for ((row, column), (at, mirrored)) in lower(n).zip(&mut places) {
                let counts = if *mirrored { 2.0 } else { 1.0 };
                let share = if row == column { nodes as f64 - 1.0 } else { -counts };
                if row % per_node == column % per_node && row % per_node < 3 {
                    self.matrix.add(*at, share * stiffness);
                } else if row == column {
                    self.matrix.add(*at, stiffness);
                }
            }
        }
    }

    /// Add `share` times what the pressures [Pa] on the faces of `loads` take from the stiffness at `u`: its symmetric part,
    /// which is all of it but at free edges.
    pub fn add_pressures(&mut self, loads: &[TimedLoad], pressures: &[f64], u: &[f64], share: f64) {
        let mut places = self.faces.chunks_exact(45);
        for (load, pressure) in loads.iter().zip(pressures) {
            for (face, places) in load.faces.iter().zip(&mut places) {
                let k = face_tangent(&load.corners(face, u), *pressure);
                for ((row, column), at) in lower(9).zip(places) {
                    self.matrix.add(*at, 0.5 * share * (k[row][column] + k[column][row]));
                }
            }
        }
    }

    /// Add `factor` times what stands in `amounts` for each degree of freedom of the structure; empty = nothing.
    pub fn add_diagonal(&mut self, amounts: &[f64], factor: f64) {
        if amounts.is_empty() {
            return;
        }
        for (j, dof) in self.dofs.iter().enumerate() {
            self.matrix.add_diagonal(j, factor * amounts[*dof]);
        }
    }

    /// Sum of the magnitudes in each row of the tangent at `u` when all is taut, for every degree of freedom of the
    /// structure: a bound of its stiffness.
    pub fn row_sums(&mut self, model: &Model, u: &[f64], history: &[f64]) -> Vec<f64> {
        self.assemble(model, u, history, 1.0, Slack::Taut);
        let mut sums = vec![0.0; model.dof_count()];
        self.matrix.each(|row, _, value| sums[self.dofs[row]] += value.abs());
        sums
    }

    /// From now on these degrees of freedom of the structure, and no others, are fixed beside those that are held.
    pub fn fix(&mut self, dofs: &[usize]) {
        self.fixed.fill(false);
        for free in dofs.iter().map(|dof| self.free[*dof]).filter(|free| *free != CONSTRAINED) {
            self.fixed[free] = true;
        }
    }

    /// The numbers of the free degrees of freedom, out of those of all.
    pub fn gather(&self, all: &[f64], free: &mut [f64]) {
        free.iter_mut().zip(&self.dofs).for_each(|(free, dof)| *free = all[*dof]);
    }

    /// The numbers of all degrees of freedom where those of the free ones are given and the others are 0.
    pub fn scatter(&self, free: &[f64], all: &mut [f64]) {
        all.fill(0.0);
        free.iter().zip(&self.dofs).for_each(|(free, dof)| all[*dof] = *free);
    }

    /// Norm of a vector over all degrees of freedom, the free ones alone.
    pub fn norm(&self, all: &[f64]) -> f64 {
        self.dofs.iter().map(|dof| all[*dof].powi(2)).sum::<f64>().sqrt()
    }

    /// Bound of the residual due to rounding of the displacements `u` and of `forces` that cancel at nodes [N]. `memory` is as
    /// long as the free degrees of freedom are many.
    pub fn noise(&mut self, u: &[f64], forces: f64, memory: &mut [f64]) -> f64 {
        memory.iter_mut().zip(&self.dofs).for_each(|(size, dof)| *size = u[*dof].abs());
        2.0 * f64::EPSILON * (self.matrix.bound(memory) + (self.dofs.len() as f64).sqrt() * forces)
    }

    /// The free degree of freedom, as one of the structure, at which `all` is largest; 0 where none is free.
    pub fn worst(&self, all: &[f64]) -> usize {
        let size = |dof: &&usize| all[**dof].abs();
        self.dofs.iter().max_by(|a, b| size(a).total_cmp(&size(b))).copied().unwrap_or(0)
    }

    /// Factorise what was assembled; the error is the degree of freedom of the structure whose pivot is the first that
    /// is not positive.
    pub fn factorise(&mut self) -> Result<(), usize> {
        self.matrix.leave_out(&self.fixed);
        self.matrix.factorise().map_err(|unknown| self.dof(unknown))
    }

    /// The same with pivots of either sign; returns how many are negative. The error is a degree of freedom of the structure
    /// where the tangent is no number.
    pub fn factorise_signed(&mut self) -> Result<usize, usize> {
        self.matrix.leave_out(&self.fixed);
        self.matrix.factorise_signed().map_err(|unknown| self.dof(unknown))
    }

    /// Degree of freedom of the structure of the first negative pivot of the last factorisation, if there is one.
    pub fn first_negative(&self) -> Option<usize> {
        self.matrix.cholesky.first_negative().map(|unknown| self.dof(unknown))
    }

    /// Degree of freedom of the structure of an unknown, or at which it slips.
    fn dof(&self, unknown: usize) -> usize {
        self.dofs.get(unknown).copied().unwrap_or_else(|| self.slips[unknown - self.dofs.len()])
    }
}

/// Row and column of each entry of a lower triangle of order `n`, by rows.
fn lower(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(|row| (0..=row).map(move |column| (row, column)))
}

/// Row and column, in the lower triangle of all, of each entry of the lower triangle of one element, by rows.
fn triangle<'a>(free: &'a [usize], dofs: &'a [usize]) -> impl Iterator<Item = Option<(usize, usize)>> + 'a {
    lower(dofs.len()).map(|(row, column)| entry(free[dofs[row]], free[dofs[column]]))
}

/// The same of unknowns of the matrix.
fn entries(unknowns: &[usize; 8]) -> impl Iterator<Item = Option<(usize, usize)>> {
    lower(8).map(|(row, column)| entry(unknowns[row], unknowns[column]))
}

fn entry(a: usize, b: usize) -> Option<(usize, usize)> {
    (a != CONSTRAINED && b != CONSTRAINED).then(|| (a.max(b), a.min(b)))
}

/// Add to the masses of nodes that move what they need for steps of `step` [s], by Gershgorin's bound of the highest
/// frequency of the structure as modelled: `m_a >= (step / 2)^2 sum_b |K_ab|`. Weights stay.
pub fn scale_masses(model: &mut Model, step: f64) {
    let (u, history) = (vec![0.0; model.dof_count()], model.start_history());
    let rows = Tangent::new(model).row_sums(model, &u, &history);
    let need = |dof: usize| 0.25 * step * step * rows[dof];
    for node in 0..model.nodes.len() {
        let most = (0..3).map(|c| need(model.dof(node, c))).fold(model.mass[node], f64::max);
        model.added_mass += most - model.mass[node];
        model.mass[node] = most;
    }
    for (number, node) in model.turning.iter().enumerate() {
        let needs = (0..3).filter_map(|c| model.rotation(*node, c)).map(need);
        model.inertia[number] = needs.fold(model.inertia[number], f64::max);
    }
}
