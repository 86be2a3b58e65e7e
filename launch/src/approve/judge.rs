//! Each criterion of the test, with its number, its bound, and what follows.

use super::layout::{BarrierPart, NET};
use super::measured::{Launch, NOMINAL, Row};
use super::site::{Test, Which};
use interface_defs::verdict::Fate;
use serde::Serialize;
use toolkit::numbers::three;

/// Least residual height after SEL 1, in that before (EAD 340059-00-0106).
const LEFT_AFTER_SEL: f64 = 0.7;
/// The same of category A and of category B after MEL.
pub const CATEGORIES: [(f64, &str); 2] = [(0.5, "A"), (0.3, "B")];

interface_defs::worded! {
    /// What follows.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Result with words {
        /// It is kept.
        Pass = "pass",
        /// It is not.
        Fail = "FAIL",
        /// Nothing can be said, and it decides nothing.
        NotExamined = "not examined",
        /// It cannot be decided by runs that are not to be trusted, or by a number that is too near.
        NotSettled = "not settled",
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

/// The category by the residual height in that before.
pub fn category(share: f64) -> &'static str {
    CATEGORIES.iter().find(|(least, _)| share >= *least).map_or("C", |(_, name)| name)
}

/// Of a criterion: its name, number and bound with their unit, what follows, and why.
type Judgement = (&'static str, Option<(f64, f64)>, &'static str, Result, String);

/// All criteria.
pub fn all(test: &Test, launches: &[Launch]) -> Vec<Criterion> {
    let absent = |why: &str| ("stopped", None, "1", Result::NotExamined, why.to_owned());
    let mut all = Vec::new();
    let mut add = |which: Which, (name, number, unit, result, why): Judgement| {
        let (value, bound) = number.unzip();
        all.push(Criterion { launch: which.name(), name, value, bound, unit, result, why });
    };
    if test.kit.sel.is_none() {
        add(Which::Sel1, absent("class 0 has no SEL launches (ETAG 027); --sel KJ makes them"));
    }
    for launch in launches {
        let mut found = vec![stopped(launch), clear_of_ground(launch)];
        if launch.which == Which::Sel1 {
            found.extend([left(launch), tearing(test, launch, false), tearing(test, launch, true)]);
        }
        for mut found in found {
            // Nothing passes or fails by a run that is not to be trusted.
            if let Some(doubt) = &launch.doubt {
                (found.3, found.4) = (Result::NotSettled, doubt.clone());
            }
            add(launch.which, found);
        }
        if launch.which == Which::Sel1 && launches.iter().all(|other| other.which != Which::Sel2) {
            let why = "not run: the block of SEL 1 was not stopped, or that run does not count";
            add(Which::Sel2, absent(why));
        }
    }
    all
}

/// Whether it still moved at the end.
fn is_open(launch: &Launch) -> bool {
    matches!(launch.fate, Some(Fate::Undecided | Fate::StillMoving))
}

fn stopped(launch: &Launch) -> Judgement {
    let (result, why) = match launch.stopped {
        _ if is_open(launch) => {
            let why = "it is still being stopped at the end of the run: --time S, longer";
            (Result::NotSettled, why.into())
        }
        true => (Result::Pass, launch.words()),
        false => (Result::Fail, launch.words()),
    };
    ("stopped", None, "1", result, why)
}

fn clear_of_ground(launch: &Launch) -> Judgement {
    let clear = launch.value("clearance_block").zip(launch.value("clearance_net"));
    let clear = clear.map(|(block, net)| (block.min(net), 0.0));
    let result = match clear {
        _ if is_open(launch) => Result::NotSettled,
        Some((clear, _)) if clear > 0.0 => Result::Pass,
        Some(_) => Result::Fail,
        None => Result::NotExamined,
    };
    let why = "clearance of block and net above the reference slope up to maximum elongation";
    ("no ground contact", clear, "m", result, why.into())
}

/// The residual height after SEL 1.
fn left(launch: &Launch) -> Judgement {
    let numbers = ["h_R/h_N", NOMINAL, "h_R_least", "h_R_most"].map(|name| launch.value(name));
    let [Some(share), Some(before), Some(least), Some(most)] = numbers else {
        return ("residual height", None, "1", Result::NotExamined, launch.no_height());
    };
    let bound = LEFT_AFTER_SEL * before;
    let mut why = "h_R/h_N at rest, block still in the net".to_owned();
    let result = match (least >= bound, most < bound) {
        (true, _) => Result::Pass,
        (_, true) => Result::Fail,
        _ => {
            why = format!("it still swings from {} to {} m", three(least), three(most));
            Result::NotSettled
        }
    };
    ("residual height", Some((share, LEFT_AFTER_SEL)), "1", result, why)
}

/// Of the net: openings below twice what they were. Where a mesh tears, two become one; where none does, its sides hold, and a mesh
/// cannot open to more than the circle of its perimeter. Of all other parts: none in two, and so many tore.
fn tearing(test: &Test, launch: &Launch, net: bool) -> Judgement {
    let names = |breaks: bool| {
        let of = |part: &&BarrierPart| (part.name == NET) == net && part.can_break == breaks;
        test.layout.parts.iter().filter(of).map(|part| part.name.as_str()).collect::<Vec<_>>().join(", ")
    };
    let torn = launch.torn.iter().flatten().filter(|torn| (torn.part == NET) == net);
    let torn: Vec<String> = torn.map(ToString::to_string).collect();
    // Of a rope that did not tear, a force above its strength is one of single steps: neither holds for certain.
    let beyond = |row: &&Row| !net && row.unit == "N" && row.share.is_some_and(|share| share >= 1.0);
    let (result, why) = match launch.rows.iter().find(beyond) {
        _ if !torn.is_empty() => (Result::Fail, torn.join("; ")),
        _ if names(true).is_empty() && net => {
            (Result::NotExamined, "the net has no strength: it cannot tear".into())
        }
        _ if names(true).is_empty() => (Result::NotExamined, "no rope, brake or post has a strength".into()),
        Some(row) => (Result::NotSettled, format!("{} came above its strength, and did not tear", row.name)),
        None if net => {
            let why = "no mesh tore; an intact mesh can open by at most 4/π in area";
            (Result::Pass, why.into())
        }
        None if names(false).is_empty() => (Result::Pass, "nothing tore".into()),
        None => {
            let why = format!("nothing tore; without a strength, and not assessed: {}", names(false));
            (Result::Pass, why)
        }
    };
    let number = Some((torn.len() as f64, 0.0)).filter(|_| !net && result != Result::NotExamined);
    let name = match net {
        true => "mesh openings less than twice their initial size",
        false => "no connecting part broken",
    };
    (name, number, "1", result, why)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_that_is_not_known_has_the_reason_of_what_became_of_the_block() {
        let launch = |fate, stopped| Launch {
            which: Which::Mel,
            run: String::new(),
            last: Default::default(),
            doubt: None,
            fate: Some(fate),
            stopped,
            finer: false,
            torn: None,
            used: Vec::new(),
            rows: Vec::new(),
        };
        for (fate, stays, words) in [
            (Fate::Stopped, true, "stopped"),
            (Fate::Rebounded, true, "stopped, then thrown back"),
            (Fate::Stopped, false, "stopped, and left the net in the settling phase"),
            (Fate::WentThrough, false, "went through"),
        ] {
            let launch = launch(fate, stays);
            let (result, why) = (stopped(&launch).3, stopped(&launch).4);
            assert_eq!((result, &*why), (if stays { Result::Pass } else { Result::Fail }, words));
            let of_height = left(&launch).4;
            assert!(if stays {
                of_height.contains("not brought to rest")
            } else {
                of_height.ends_with(words)
            });
            assert!(!of_height.contains("not stopped"), "{of_height}");
        }
    }

    #[test]
    fn the_category_is_that_of_the_residual_height() {
        let of = [0.62, 0.5, 0.49, 0.3, 0.29, -0.1].map(category);
        assert_eq!(of, ["A", "A", "B", "B", "C", "C"]);
    }
}
