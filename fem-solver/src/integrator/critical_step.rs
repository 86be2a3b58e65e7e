//! The critical step of central differences, `2 / w`, from the highest frequency of the structure.
//!
//! `w^2` is the largest eigenvalue of `M^-1/2 K M^-1/2`. The top of the spectrum of a net is dense, and
//! plain power iteration creeps; Lanczos takes the same products and needs some tens of them. Lost
//! orthogonality only repeats eigenvalues that are found already.

use crate::element::Slack;
use crate::internal_force::assembly::Assembly;
use crate::internal_force::tangent::Tangent;
use crate::linear_algebra::lanes::inner;
use crate::model::Model;
use nalgebra::Matrix3;

/// Most products.
const MOST: usize = 400;
/// Relative change of `w^2` over [`APART`] products at which it is taken for found.
const CONVERGED: f64 = 1e-10;
/// Products between two looks.
const APART: usize = 8;

/// Highest angular frequency [rad/s] at the displacements `u`, slack cables counted as just taut. 0 if
/// nothing can move or nothing is stiff. Every free degree of freedom must have a mass.
pub fn highest_frequency(model: &Model, tangent: &mut Tangent, u: &[f64], history: &[f64]) -> f64 {
    tangent.assemble(model, u, history, 1.0, Slack::Taut);
    let n = tangent.dofs.len();
    let root: Vec<f64> = tangent.dofs.iter().map(|dof| 1.0 / model.dof_mass(*dof).sqrt()).collect();
    let (mut diagonal, mut beside) = (Vec::with_capacity(MOST), Vec::with_capacity(MOST));
    let (mut before, mut now) = (vec![0.0; n], start_vector(n));
    let (mut scaled, mut next) = (vec![0.0; n], vec![0.0; n]);
    let (mut link, mut found) = (0.0, 0.0);
    for k in 1..=MOST.min(n) {
        scaled.iter_mut().zip(&now).zip(&root).for_each(|((s, x), r)| *s = x * r);
        tangent.matrix.multiply(&scaled, &mut next);
        next.iter_mut().zip(&root).for_each(|(y, r)| *y *= r);
        let along = inner(&next, &now);
        next.iter_mut().zip(&now).zip(&before).for_each(|((y, x), b)| *y -= along * x + link * b);
        link = inner(&next, &next).sqrt();
        diagonal.push(along);
        beside.push(link);
        let exhausted = link <= 1e-14 * along.abs() || k == MOST.min(n);
        if k.is_multiple_of(APART) || exhausted {
            let top = largest_eigenvalue(&diagonal, &beside);
            let settled = (top - found).abs() <= CONVERGED * top;
            found = top;
            if settled || exhausted {
                break;
            }
        }
        std::mem::swap(&mut before, &mut now);
        now.iter_mut().zip(&next).for_each(|(x, y)| *x = y / link);
    }
    found.max(0.0).sqrt()
}

/// Stiffness [N/m] and mass [kg] of a typical node of the interface: in the stiffest direction, its neighbours held, slack
/// elements counted as just taut and rings as unloading. Typical is the median by stiffness over mass squared, of all
/// nodes that can move and that lines or faces hold; `None` where there is none.
pub fn typical_stiffness(model: &Model, u: &[f64], history: &[f64]) -> Option<(f64, f64)> {
    let mut blocks = vec![Matrix3::<f64>::zeros(); model.node_count()];
    for cable in &model.cables {
        let d = cable.span + model.relative(u, cable);
        let pull = cable.response(&model.relative(u, cable)).pull_per_length;
        let block = 2.0 * cable.slope() * d * d.transpose() + Matrix3::from_diagonal_element(pull);
        cable.nodes.iter().for_each(|node| blocks[*node] += block);
    }
    let mut assembly = Assembly::new(model);
    for (i, element) in model.elements.iter().enumerate() {
        let nodes = element.nodes();
        let tangent = assembly.tangent(i, element, u, history, Slack::Taut);
        let n = tangent.len().isqrt();
        for (place, node) in nodes.iter().enumerate() {
            let at = place * (n / nodes.len());
            blocks[*node] += Matrix3::from_fn(|a, b| tangent[(at + a) * n + at + b]);
        }
    }
    let mut touched = vec![false; model.node_count()];
    let lines = model.lines().flat_map(|(line, _)| line);
    let faces = model.elements.iter().flat_map(|e| e.faces()).flatten();
    lines.chain(faces).for_each(|node| touched[node] = true);
    let free =
        (0..model.node_count()).filter(|n| touched[*n] && !model.fully_held(*n) && model.mass[*n] > 0.0);
    let mut all: Vec<(f64, f64)> =
        free.map(|node| (blocks[node].symmetric_eigenvalues().max(), model.mass[node])).collect();
    all.sort_by(|(k, m), (l, n)| (k / (m * m)).total_cmp(&(l / (n * n))));
    all.get(all.len() / 2).copied()
}

/// A unit vector without symmetry, the same in every run.
fn start_vector(n: usize) -> Vec<f64> {
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    let mut x: Vec<f64> = (0..n)
        .map(|_| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        })
        .collect();
    let length = inner(&x, &x).sqrt();
    x.iter_mut().for_each(|x| *x /= length);
    x
}

/// Largest eigenvalue of a symmetric tridiagonal matrix, by bisection on the signs of its pivots.
fn largest_eigenvalue(diagonal: &[f64], beside: &[f64]) -> f64 {
    let n = diagonal.len();
    let above = |i: usize| if i > 0 { beside[i - 1] } else { 0.0 };
    let below = |i: usize| if i + 1 < n { beside[i] } else { 0.0 };
    let mut low = diagonal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut high = (0..n).map(|i| diagonal[i] + above(i) + below(i)).fold(low, f64::max);
    // All pivots of T - x are negative if and only if x lies above every eigenvalue.
    let above_all = |x: f64| {
        let mut pivot = -1.0;
        (0..n).all(|i| {
            pivot = diagonal[i] - x - above(i) * above(i) / pivot;
            pivot < 0.0
        })
    };
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if above_all(middle) { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chain_of_unit_springs_has_its_known_top_eigenvalue() {
        // Eigenvalues of the matrix (-1, 2, -1) of order n are 2 - 2 cos(k pi / (n + 1)).
        let n = 40;
        let exact = 2.0 - 2.0 * (n as f64 * std::f64::consts::PI / (n as f64 + 1.0)).cos();
        let top = largest_eigenvalue(&vec![2.0; n], &vec![1.0; n]);
        assert!((top / exact - 1.0).abs() < 1e-14 * n as f64, "{top} is not {exact}");
    }
}
