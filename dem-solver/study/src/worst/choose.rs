//! Which members are hardest on a barrier: in turn the one with the most energy, the highest, the nearest to an end of the line.

use std::collections::BTreeSet;

/// What a member brings to the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// Its number.
    pub member: u64,
    /// Kinetic energy [J].
    pub energy: f64,
    /// Height of its lowest point above the ground [m]; not a number where that is not known.
    pub height: f64,
    /// Distance from the nearer end of the line, along it [m].
    pub edge: f64,
}

/// Why a member is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// The member, by its place among all.
    pub at: usize,
    /// For which quantity.
    pub reason: &'static str,
    /// Its rank in that, from 1.
    pub rank: usize,
}

/// A quantity that is worse the larger it is: its name, and its value.
type Order = (&'static str, fn(&Arrival) -> f64);

/// The three orders, in the order of their turns.
const ORDERS: [Order; 3] = [("energy", |a| a.energy), ("height", |a| a.height), ("edge", |a| -a.edge)];

/// Choose `count` members, in turn the worst by each order that is not chosen yet. Of equal ones the first.
pub fn choose(arrivals: &[Arrival], count: usize) -> Vec<Choice> {
    let mut lists = ORDERS.map(|(reason, of)| {
        let mut list: Vec<usize> = (0..arrivals.len()).filter(|at| !of(&arrivals[*at]).is_nan()).collect();
        list.sort_by(|a, b| of(&arrivals[*b]).total_cmp(&of(&arrivals[*a])).then(a.cmp(b)));
        (reason, list.into_iter().enumerate())
    });
    let (mut chosen, mut known) = (Vec::new(), BTreeSet::new());
    let count = count.min(arrivals.len());
    while chosen.len() < count {
        let before = chosen.len();
        for (reason, list) in &mut lists {
            if chosen.len() < count
                && let Some((rank, at)) = list.find(|(_, at)| known.insert(*at))
            {
                chosen.push(Choice { at, reason, rank: rank + 1 });
            }
        }
        if chosen.len() == before {
            break;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_chosen_in_turn_and_each_once() {
        let of = |member, energy, height, edge| Arrival { member, energy, height, edge };
        let all = [
            of(1, 5.0, 1.0, 9.0),
            of(2, 9.0, 3.0, 8.0),
            of(3, 9.0, 2.0, 0.5),
            of(4, 1.0, f64::NAN, 1.0),
            of(5, 0.0, 0.0, 20.0),
        ];
        let names = |count| {
            let chosen = choose(&all, count);
            chosen.iter().map(|c| format!("{} {} {}", all[c.at].member, c.reason, c.rank)).collect::<Vec<_>>()
        };
        // The highest is the one with the most energy, the first of two: the next in height has its turn.
        assert_eq!(names(4), ["2 energy 1", "3 height 2", "4 edge 2", "1 energy 3"]);
        assert_eq!(names(2), names(4)[..2]);
        assert_eq!(names(20).len(), 5);
        assert_eq!(choose(&[], 3), []);
    }
}
