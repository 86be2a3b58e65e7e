//! Each criterion of the test, with its number, its bound, and what follows.

use super::layout::NET;
use super::measured::{Launch, Which};
use super::site::Test;
use interface_defs::verdict::Fate;
use serde::Serialize;
use toolkit::numbers::three;

/// Least part of the height that is left after SEL 1 (EAD 340059-00-0106).
const LEFT_AFTER_SEL: f64 = 0.7;
/// The same of category A and of category B after MEL.
const CATEGORIES: [(f64, &str); 2] = [(0.5, "A"), (0.3, "B")];

/// What follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Result {
    /// It is kept.
    Pass,
    /// It is not.
    Fail,
    /// Nothing can be said, and it decides nothing.
    NotExamined,
    /// It cannot be decided by runs that are not to be trusted, or by a number that is too near.
    NotSettled,
}

impl Result {
    /// In words.
    pub fn words(self) -> &'static str {
        ["pass", "FAIL", "not examined", "not settled"][self as usize]
    }
}

/// A criterion.
#[derive(Debug, Clone, Serialize)]
pub struct Criterion {
    /// Of which launch.
    pub launch: &'static str,
    /// Which.
    pub name: &'static str,
    /// The number.
    pub value: Option<f64>,
    /// Its bound.
    pub bound: Option<f64>,
    /// Unit of both.
    pub unit: &'static str,
    /// What follows.
    pub result: Result,
    /// Why, or how it is judged.
    pub why: String,
}

/// The category by the share of the height that is left.
pub fn category(share: f64) -> &'static str {
    CATEGORIES.iter().find(|(least, _)| share >= *least).map_or("C", |(_, name)| name)
}

/// All criteria.
pub fn all(test: &Test, launches: &[Launch]) -> Vec<Criterion> {
    let of = |which| launches.iter().find(|launch| launch.which == which);
    let absent = |which, why| vec![Criterion { why, ..blank(which, "stopped") }];
    let mut found = match of(Which::Sel1) {
        Some(first) => {
            let more = [left(first), tearing(test, first, false), tearing(test, first, true)];
            let second = of(Which::Sel2).map(common).unwrap_or_else(|| {
                let why = "not run: the block of SEL 1 was not stopped, or that run does not count";
                absent(Which::Sel2, why.into())
            });
            let more = more.into_iter().map(|criterion| trusted(first, criterion));
            common(first).into_iter().chain(more).chain(second).collect()
        }
        None => absent(Which::Sel1, "class 0 has no SEL launches (ETAG 027); --sel KJ makes them".into()),
    };
    found.extend(of(Which::Mel).into_iter().flat_map(common));
    found
}

fn blank(which: Which, name: &'static str) -> Criterion {
    let (launch, result) = (which.name(), Result::NotExamined);
    Criterion { launch, name, value: None, bound: None, unit: "1", result, why: String::new() }
}

/// Nothing passes or fails by a run that is not to be trusted.
fn trusted(launch: &Launch, criterion: Criterion) -> Criterion {
    match &launch.doubt {
        Some(doubt) => Criterion { result: Result::NotSettled, why: doubt.clone(), ..criterion },
        None => criterion,
    }
}

/// Those of every launch.
fn common(launch: &Launch) -> Vec<Criterion> {
    let open = matches!(launch.fate, Some(Fate::Undecided | Fate::StillMoving));
    let words = launch.fate.map_or("no verdict", Fate::words);
    let slipped = matches!(launch.fate, Some(Fate::Stopped | Fate::Rebounded)) && !launch.stopped;
    let stopped = Criterion {
        result: match launch.stopped {
            _ if open => Result::NotSettled,
            true => Result::Pass,
            false => Result::Fail,
        },
        why: match (open, slipped) {
            (true, _) => "it is still being stopped at the end of the run: --time S, longer".into(),
            (_, true) => format!("{words}, and left the net as it came to rest"),
            _ => words.into(),
        },
        ..blank(launch.which, "stopped")
    };
    let clear = launch.value("clearance_block").zip(launch.value("clearance_net"));
    let clear = clear.map(|(block, net)| block.min(net));
    let ground = Criterion {
        value: clear,
        bound: Some(0.0),
        unit: "m",
        result: match clear {
            _ if open => Result::NotSettled,
            Some(clear) if clear > 0.0 => Result::Pass,
            Some(_) => Result::Fail,
            None => Result::NotExamined,
        },
        why: "block, and net where it hits, above the slope through the feet until the largest elongation"
            .into(),
        ..blank(launch.which, "no ground contact")
    };
    [stopped, ground].map(|criterion| trusted(launch, criterion)).into()
}

/// The height left after SEL 1.
fn left(launch: &Launch) -> Criterion {
    let of = blank(launch.which, "height left");
    let numbers = ["h_R/h_N", "h_N", "h_R_least", "h_R_most"].map(|name| launch.value(name));
    let [Some(share), Some(before), Some(least), Some(most)] = numbers else {
        return Criterion { why: "the block was not stopped, or not brought to rest".into(), ..of };
    };
    let bound = LEFT_AFTER_SEL * before;
    let at_rest = || "h_R/h_N at rest, block left in".to_owned();
    let (result, why) = match (least >= bound, most < bound) {
        (true, _) => (Result::Pass, at_rest()),
        (_, true) => (Result::Fail, at_rest()),
        _ => (Result::NotSettled, format!("it still swings from {} to {} m", three(least), three(most))),
    };
    Criterion { value: Some(share), bound: Some(LEFT_AFTER_SEL), result, why, ..of }
}

/// Of the net: openings below twice what they were. Where a mesh tears, two become one; where none does, its sides hold, and a mesh
/// cannot open to more than the circle of its perimeter. Of all other parts: none in two, and so many tore.
fn tearing(test: &Test, launch: &Launch, net: bool) -> Criterion {
    let parts = || test.layout.parts.iter().filter(|part| (part.name == NET) == net);
    let torn = launch.torn.iter().flatten().filter(|torn| (torn.part == NET) == net);
    let torn: Vec<String> = torn.map(ToString::to_string).collect();
    let weak = parts().any(|part| part.can_break);
    let strong: Vec<_> = parts().filter(|part| !part.can_break).map(|part| part.name.as_str()).collect();
    let (name, nothing) = match net {
        true => ("openings below twice the initial", "the net has no strength: it cannot tear"),
        false => ("no connection part in two", "no rope, brake or post has a strength"),
    };
    let (result, why) = match (torn.is_empty(), weak) {
        (false, _) => (Result::Fail, torn.join("; ")),
        (_, false) => (Result::NotExamined, nothing.to_owned()),
        _ if net => {
            let why = "no mesh tore; a mesh whose sides hold opens to the circle of its perimeter at most, 4/pi of a square";
            (Result::Pass, why.into())
        }
        _ if strong.is_empty() => (Result::Pass, String::new()),
        _ => (Result::Pass, format!("without a strength, and so not examined: {}", strong.join(", "))),
    };
    let number = |of: f64| Some(of).filter(|_| !net && result != Result::NotExamined);
    let (value, bound) = (number(torn.len() as f64), number(0.0));
    Criterion { value, bound, result, why, ..blank(launch.which, name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_category_is_that_of_the_height_that_is_left() {
        let of = [0.62, 0.5, 0.49, 0.3, 0.29, -0.1].map(category);
        assert_eq!(of, ["A", "A", "B", "B", "C", "C"]);
    }
}
