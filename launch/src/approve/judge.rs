//! Each criterion of the test, with its number, its bound, and what follows.

use super::measured::{Launch, Which, is_caught};
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
    let mut found = Vec::new();
    let absent = |which: Which, why: &str| blank(which, "stopped", why);
    match (test.sel(), of(Which::Sel1)) {
        (Some(_), Some(first)) => {
            found.extend(common(first));
            found.push(trusted(first, left(first)));
            found.push(trusted(first, connections(test, first)));
            found.push(trusted(first, openings(test, first)));
            match of(Which::Sel2) {
                Some(second) => found.extend(common(second)),
                None => found.push(absent(
                    Which::Sel2,
                    "not run: the block of SEL 1 was not stopped, or that run does not count",
                )),
            }
        }
        _ => found.push(absent(Which::Sel1, "class 0 has no SEL launches (ETAG 027); --sel KJ makes them")),
    }
    found.extend(of(Which::Mel).into_iter().flat_map(common));
    found
}

fn blank(which: Which, name: &'static str, why: impl Into<String>) -> Criterion {
    let (result, why) = (Result::NotExamined, why.into());
    Criterion { launch: which.name(), name, value: None, bound: None, unit: "1", result, why }
}

/// Nothing passes or fails by a run that is not to be trusted.
fn trusted(launch: &Launch, criterion: Criterion) -> Criterion {
    match &launch.doubt {
        Some(doubt) => Criterion { result: Result::NotSettled, why: doubt.clone(), ..criterion },
        None => criterion,
    }
}

/// Those of every launch.
fn common(launch: &Launch) -> [Criterion; 2] {
    let of = |name| blank(launch.which, name, "");
    let stopped = match launch.fate {
        Some(Fate::Undecided | Fate::StillMoving) => Criterion {
            result: Result::NotSettled,
            why: "it is still being stopped at the end of the run: --time S, longer".into(),
            ..of("stopped")
        },
        fate => {
            let words = fate.map_or("no verdict", Fate::words);
            let slipped = fate.is_some_and(is_caught) && !launch.stopped;
            let why =
                if slipped { format!("{words}, and left the net as it came to rest") } else { words.into() };
            Criterion {
                result: if launch.stopped { Result::Pass } else { Result::Fail },
                why,
                ..of("stopped")
            }
        }
    };
    let clear =
        launch.value("clearance_block").zip(launch.value("clearance_net")).map(|(block, net)| block.min(net));
    let ground = Criterion {
        value: clear,
        bound: Some(0.0),
        unit: "m",
        result: match clear {
            Some(clear) if clear > 0.0 => Result::Pass,
            Some(_) => Result::Fail,
            None => Result::NotExamined,
        },
        why: "block, and net where it hits, above the slope through the feet until the largest elongation"
            .into(),
        ..of("no ground contact")
    };
    [trusted(launch, stopped), trusted(launch, ground)]
}

/// The height left after SEL 1.
fn left(launch: &Launch) -> Criterion {
    let of = blank(launch.which, "height left", "the block was not stopped, or not brought to rest");
    let numbers = ["h_R/h_N", "h_N", "h_R_least", "h_R_most"].map(|name| launch.value(name));
    let [Some(share), Some(before), Some(least), Some(most)] = numbers else { return of };
    let bound = LEFT_AFTER_SEL * before;
    let (result, why) = match (least >= bound, most < bound) {
        (true, _) => (Result::Pass, "h_R/h_N at rest, block left in".to_owned()),
        (_, true) => (Result::Fail, "h_R/h_N at rest, block left in".into()),
        _ => (Result::NotSettled, format!("it still swings from {} to {} m", three(least), three(most))),
    };
    Criterion { value: Some(share), bound: Some(LEFT_AFTER_SEL), result, why, ..of }
}

/// No connection part in two: all that is not net.
fn connections(test: &Test, launch: &Launch) -> Criterion {
    let (net, others): (Vec<_>, Vec<_>) = test.layout.parts.iter().partition(|part| part.is_net());
    let of = blank(launch.which, "no connection part in two", "no rope, brake or post has a strength");
    let torn = launch.torn.iter().flatten().filter(|torn| net.iter().all(|net| net.name != torn.part));
    let torn: Vec<_> = torn.map(ToString::to_string).collect();
    let names = |can| {
        others.iter().filter(|p| p.can_break == can).map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")
    };
    if !torn.is_empty() {
        return Criterion {
            value: Some(torn.len() as f64),
            bound: Some(0.0),
            result: Result::Fail,
            why: torn.join("; "),
            ..of
        };
    }
    if names(true).is_empty() {
        return of;
    }
    let why = match names(false) {
        none if none.is_empty() => String::new(),
        none => format!("without a strength, and so not examined: {none}"),
    };
    Criterion { value: Some(0.0), bound: Some(0.0), result: Result::Pass, why, ..of }
}

/// Openings of the net below twice what they were. Where a mesh tears, two become one; where none does, its sides hold, and a mesh
/// cannot open to more than the circle of its perimeter.
fn openings(test: &Test, launch: &Launch) -> Criterion {
    let of =
        blank(launch.which, "openings below twice the initial", "the net has no strength: it cannot tear");
    let net: Vec<_> = test.layout.parts.iter().filter(|part| part.is_net()).collect();
    let torn = launch.torn.iter().flatten().filter(|torn| net.iter().any(|net| net.name == torn.part));
    let torn: Vec<_> = torn.map(ToString::to_string).collect();
    match (torn.is_empty(), net.iter().any(|net| net.can_break)) {
        (false, _) => Criterion { result: Result::Fail, why: torn.join("; "), ..of },
        (true, true) => {
            let why = "no mesh tore; a mesh whose sides hold opens to the circle of its perimeter at most, 4/pi of a square";
            Criterion { result: Result::Pass, why: why.into(), ..of }
        }
        (true, false) => of,
    }
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
