use super::*;
use crate::element::ring::formula::Vector;
use crate::element::ring::mechanisms::Mechanism;
use crate::element::ring::tightening::{Bundle, Strength};
use crate::element::tests::checks::random;
use crate::element::{Answer, Pace, Ring, Slack};
use crate::linear_algebra::lanes::longest_displacement;
use nalgebra::Vector3;

/// A ring over these nodes and sides, of a law whose numbers are off by 5 % of `off`, that breaks or not.
type Make = fn(Vec<usize>, Vec<Vector>, [f64; 4], bool) -> AnyElement;

/// The spans of so many sides.
fn sides<const N: usize>(spans: &[Vector]) -> [Vector; N] {
    std::array::from_fn(|i| spans[i])
}

fn ring(nodes: Vec<usize>, spans: Vec<Vector>, off: [f64; 4], breaks: bool) -> AnyElement {
    let [a, b, c, d] = off.map(|off| 1.0 + 0.05 * off);
    let (perimeter, width) =
        (Mechanism::new(1.2 * a, 2e5 * b, 3.0), Mechanism::new(0.42 * c, 1e4 * d, 100.0));
    let rupture = if breaks { 2e4 } else { f64::INFINITY };
    let law = match nodes.len() {
        3 => RingLaw::Three(Mechanisms { spans: sides(&spans), perimeter, width, rupture, ease: 0.0 }),
        _ => RingLaw::Four(Mechanisms { spans: sides(&spans), perimeter, width, rupture, ease: 0.0 }),
    };
    Ring { nodes, law, section: 0.0, mass: 0.6, radius: 0.0 }.into()
}

fn wire_ring(nodes: Vec<usize>, spans: Vec<Vector>, off: [f64; 4], breaks: bool) -> AnyElement {
    let [a, b, c, d] = off.map(|off| 1.0 + 0.05 * off);
    let bundle =
        Bundle { turns: 7.0, wire: 3e-3 * a, diameter: 0.4 * b, young: 1.5e11 * c, yields: 1.7e9 * d };
    let strength = if breaks {
        Strength::new(1.77e9 * bundle.area(), [0.55, 0.37])
    } else {
        Strength::even(f64::INFINITY)
    };
    let law = match nodes.len() {
        2 => RingLaw::WireTwo(Wire::new(&bundle, sides(&spans), strength)),
        3 => RingLaw::WireThree(Wire::new(&bundle, sides(&spans), strength)),
        _ => RingLaw::WireFour(Wire::new(&bundle, sides(&spans), strength)),
    };
    Ring { nodes, law, section: bundle.area(), mass: 0.6, radius: 0.0 }.into()
}

/// Rings over `count` nodes each in rows of `columns`, then some over any nodes; a few of one law, then a few of another.
fn net(
    make: Make,
    (count, columns): (usize, usize),
    random: &mut impl FnMut() -> f64,
) -> (Vec<AnyElement>, usize) {
    let rows = 3;
    let row = columns + 1;
    let nodes = row * (rows + 1);
    let place = |node: usize| Vector3::new((node % row) as f64, (node / row) as f64, 0.0) * 0.3;
    let (mut rings, mut off) = (Vec::new(), [0.0; 4]);
    for k in 0..rows * columns + 5 {
        let (i, j) = (k % columns, k / columns);
        let corners = [j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i];
        let own = if j < rows { corners } else { [0, 2, 5, 7].map(|step| (k + step) % nodes) };
        let own = own[..count].to_vec();
        let spans = (0..count).map(|a| (place(own[(a + 1) % count]) - place(own[a])).into()).collect();
        if k % 11 == 0 {
            off = off.map(|_| random());
        }
        rings.push(make(own, spans, off, k / 11 != 1));
    }
    (rings, nodes)
}

const LAWS: [Make; 2] = [ring, wire_ring];
/// Over 4 and 3 nodes, in rows that make blocks, and in shorter ones.
const SIZES: [(usize, usize); 4] = [(4, 9), (4, 3), (3, 12), (3, 2)];

/// Displacements at the start of a step, in its middle, and histories, broken and stretched ones among them.
struct Moment {
    start: Vec<f64>,
    middle: Vec<f64>,
    history: Vec<f64>,
    length: usize,
}

fn moment(elements: &[AnyElement], nodes: usize, random: &mut impl FnMut() -> f64) -> Moment {
    let length = elements[0].start_history().len();
    let start: Vec<f64> = (0..3 * nodes).map(|_| 0.1 * random()).collect();
    // Now far enough for a ring to break, now hardly at all.
    let farthest = 0.02 * (0.5 + random()).powi(4);
    let middle = start.iter().map(|u| u + farthest * random()).collect();
    let mut history: Vec<f64> = elements.iter().flat_map(|e| e.start_history()).collect();
    for (k, own) in history.chunks_mut(length).enumerate() {
        own[PERIMETER..].iter_mut().for_each(|most| *most = (0.1 * random()).max(0.0));
        own[BROKEN] = f64::from(u8::from(k % 7 == 3));
    }
    Moment { start, middle, history, length }
}

fn local(element: &AnyElement, nodes: usize, u: &[f64]) -> Vec<f64> {
    element.nodes().iter().flat_map(|node| [0, 1, 2].map(|c| u[c * nodes + node])).collect()
}

/// Force, history and tension of one ring alone.
fn alone(element: &AnyElement, u: &[f64], history: &[f64]) -> (Vec<f64>, Vec<f64>, f64) {
    let (mut force, mut after) = (vec![0.0; u.len()], history.to_vec());
    let mut answer =
        Answer { force: &mut force, tangent: None, slack: Slack::Exact, history: &mut after, tension: 0.0 };
    element.respond(Pace::default(), u, history, &mut answer);
    let tension = answer.tension;
    (force, after, tension)
}

#[test]
fn blocks_give_the_bytes_of_rings_alone_and_tell_who_bears_the_step() {
    let mut noise = random(21);
    for make in LAWS {
        let (mut bore, mut gave_way, mut rows, mut slack, mut back) = (0, 0, 0, 0, 0);
        for (size, _) in SIZES.into_iter().flat_map(|size| (0..60).map(move |round| (size, round))) {
            let (elements, nodes) = net(make, size, &mut noise);
            let Moment { start, middle, history, length } = moment(&elements, nodes, &mut noise);
            let mut rings = Rings::new(&elements, nodes, &vec![0; elements.len()], |i| length * i);
            let mut next = 0;
            while next < elements.len() {
                let block = rings.block_at(next).0.expect("all are rings");
                let own = rings.elements(block);
                assert!(own.start == next && !own.is_empty() && own.len() <= WIDTH);
                let (mut force, mut after) = (vec![0.0; 3 * nodes], history.clone());
                let farthest = longest_displacement(&start, &middle, nodes);
                let used = rings.pull_ahead(block, (&start, &middle), farthest, &history);
                let largest = rings.hand_back(block, &mut force, &mut after);
                let (mut force_alone, mut after_alone) = (vec![0.0; 3 * nodes], history.clone());
                let (mut largest_alone, mut used_alone) = (0.0, 0.0);
                for (i, element) in elements.iter().enumerate().take(own.end).skip(next) {
                    let before = &history[length * i..][..length];
                    let (f, h, tension) = alone(element, &local(element, nodes, &middle), before);
                    for (k, node) in element.nodes().iter().enumerate() {
                        (0..3).for_each(|c| force_alone[c * nodes + node] -= f[3 * k + c]);
                    }
                    after_alone[length * i..][..length].copy_from_slice(&h);
                    largest_alone = f64::max(largest_alone, tension);
                    let end: Vec<f64> = start.iter().zip(&middle).map(|(a, b)| a + 2.0 * (b - a)).collect();
                    let at_end = element.utilisation_bound(&local(element, nodes, &end), before);
                    if !element.is_broken(before) {
                        used_alone = f64::max(used_alone, at_end);
                        slack += usize::from(tension == 0.0);
                        back += usize::from(tension > 0.0 && h[PERIMETER] == before[PERIMETER]);
                    }
                }
                assert_eq!(largest.to_bits(), f64::to_bits(largest_alone));
                assert!(used == used_alone || used < FAR && used_alone <= used, "{used} {used_alone}");
                (bore, gave_way) = (bore + usize::from(used <= 1.0), gave_way + usize::from(used > 1.0));
                assert_eq!(after, after_alone);
                // Two rings of one block may share nodes; at these the order of the sum may be another.
                let size = largest + 1e4;
                for (f, g) in force.iter().zip(&force_alone) {
                    assert!((f - g).abs() <= 4.0 * f64::EPSILON * size, "{f} {g}");
                }
                rows += usize::from(rings.blocks[block].is_row());
                next = own.end;
            }
        }
        let often = [bore, gave_way, rows, slack, back];
        assert!(often.iter().all(|times| *times > 40), "{often:?}");
    }
}

#[test]
fn blocks_end_where_rings_are_others() {
    let mut noise = random(5);
    let [(mut elements, nodes), (others, _)] =
        [ring as Make, wire_ring].map(|make| net(make, (4, 9), &mut noise));
    elements.truncate(6);
    elements.extend_from_slice(&others[6..20]);
    let (two, _) = net(wire_ring, (2, 9), &mut noise);
    elements.push(two[0].clone());
    let rings = Rings::new(&elements, nodes, &vec![0; elements.len()], |i| 5 * i);
    let ends: Vec<usize> = (0..elements.len()).map(|i| rings.block_at(i).1).collect();
    assert_eq!(ends, [[6; 6].as_slice(), &[11; 5], &[18; 7], &[20; 2], &[21]].concat());
    assert_eq!(rings.block_at(20).0, None);
}

#[test]
fn energies_and_tensions_of_blocks_are_those_of_rings_alone() {
    let mut noise = random(4);
    for (make, size) in LAWS.into_iter().flat_map(|make| SIZES.map(|size| (make, size))) {
        let (elements, nodes) = net(make, size, &mut noise);
        for _ in 0..20 {
            let Moment { middle, history, length, .. } = moment(&elements, nodes, &mut noise);
            let mut rings = Rings::new(&elements, nodes, &vec![0; elements.len()], |i| length * i);
            let mut next = 0;
            while next < elements.len() {
                let block = rings.block_at(next).0.expect("all are rings");
                let own = rings.elements(block);
                let before = |i: usize| &history[length * i..][..length];
                let u = |i: usize| local(&elements[i], nodes, &middle);
                let tensions = rings.tensions(block, &middle, &history);
                for i in own.clone() {
                    assert_eq!(
                        tensions[i - next].to_bits(),
                        alone(&elements[i], &u(i), before(i)).2.to_bits()
                    );
                }
                let mut sum = Energy::default();
                let (could, with_energy) = rings.add_energy(block, &middle, &history, &mut sum);
                let bytes = |of: Lanes| of.map(f64::to_bits)[..own.len()].to_vec();
                assert_eq!(bytes(with_energy), bytes(tensions));
                assert_eq!(could, own.clone().all(|i| !elements[i].is_broken(before(i))));
                if could {
                    let mut exact = Energy::default();
                    for i in own.clone() {
                        let energy = elements[i].energy(&u(i), before(i));
                        exact.stored += energy.stored;
                        exact.dissipated += energy.dissipated;
                    }
                    assert_eq!(sum, exact);
                }
                next = own.end;
            }
        }
    }
}
