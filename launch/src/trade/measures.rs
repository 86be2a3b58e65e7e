//! Which measures are compared, and numbers of the command line.

use super::study::Study;
use crate::stop::Stop;
use interface_defs::diagnostic::Diagnostic;
use toolkit::explain::suggestion;

/// Measures by default: the first of each line that the scene has. A later block counts where an earlier has none.
const DEFAULTS: &[&[&[&str]]] = &[
    &[&["max_deflection", "max_travel", "max_elongation"], &["max_reaction_1ms"]],
    &[&["runout_distance"], &["max_speed"], &["max_jump_height"]],
];
/// Most gauges that are compared by default, where there is nothing else.
const GAUGES: usize = 4;

/// Choose the measures of `study` as soon as a run has some: those that are asked for, those with a given reference, else the
/// usual ones.
pub fn choose(study: &mut Study, asked: &[String]) -> Result<(), Stop> {
    if !study.measures.is_empty() {
        return Ok(());
    }
    let Some(run) = study.runs.iter().find(|run| !run.outcome.measures.is_empty()) else {
        return Ok(());
    };
    let there = &run.outcome.measures;
    let known: Vec<&String> = there.keys().collect();
    let given = study.given.keys().map(|name| (name, "--reference"));
    let named = asked.iter().map(|name| (name, "--measure")).chain(given);
    for (name, option) in named {
        if !there.contains_key(name) {
            let what = format!("{option} {name}: this scene gives no measure of that name");
            let cure = suggestion(name, &known).unwrap_or_default();
            return Err(Diagnostic::new(what).try_instead(cure).into());
        }
    }
    let chosen = if asked.is_empty() { usual(&known) } else { asked.to_vec() };
    let mut unique = Vec::new();
    for name in chosen.into_iter().chain(study.given.keys().cloned()) {
        if !unique.contains(&name) {
            unique.push(name);
        }
    }
    if unique.is_empty() {
        let list: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
        let what = "none of the usual measures is given by this scene";
        let cure = format!("name some with --measure; known here: {}", list.join(", "));
        return Err(Diagnostic::new(what).try_instead(cure).into());
    }
    study.measures = unique;
    Ok(())
}

fn usual(known: &[&String]) -> Vec<String> {
    let has = |name: &&&str| known.iter().any(|k| k == *name);
    for block in DEFAULTS {
        let first = block.iter().filter_map(|line| line.iter().find(has));
        let found: Vec<String> = first.map(|name| (*name).to_owned()).collect();
        if !found.is_empty() {
            return found;
        }
    }
    // Extremes of gauges, of which the scene says that they matter.
    let extremes = known.iter().filter(|name| name.ends_with("_min") || name.ends_with("_max"));
    extremes.take(GAUGES).map(|name| (*name).clone()).collect()
}

/// A duration as 90s, 10m, 1h30m; a bare number is seconds.
pub fn duration(text: &str) -> Result<f64, String> {
    let refuse = || format!("{text} is no duration; write 90s, 10m or 1h30m");
    let mut total = 0.0;
    let mut rest = text.trim();
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let value: f64 = rest[..digits].parse().map_err(|_| refuse())?;
        let unit = rest[digits..].find(|c: char| c.is_ascii_digit()).map_or(rest.len(), |at| digits + at);
        total += value
            * match rest[digits..unit].trim() {
                "s" | "" => 1.0,
                "m" | "min" => 60.0,
                "h" => 3600.0,
                _ => return Err(refuse()),
            };
        rest = &rest[unit..];
    }
    if total > 0.0 { Ok(total) } else { Err(refuse()) }
}

/// `NAME=VALUE`.
pub fn given(text: &str) -> Result<(String, f64), String> {
    let pair =
        text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse::<f64>().ok()?)));
    match pair {
        Some((name, value)) if value.is_finite() && !name.is_empty() => Ok((name.to_owned(), value)),
        _ => Err(format!("{text} is no value of a measure; write NAME=VALUE, as in max_deflection=0.495")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_units() {
        for (text, seconds) in
            [("90s", 90.0), ("10m", 600.0), ("1h30m", 5400.0), ("2.5m", 150.0), ("45", 45.0)]
        {
            assert_eq!(duration(text), Ok(seconds));
        }
        for text in ["", "0s", "10x", "m", "-5m"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_reference_has_a_name_and_a_number() {
        assert_eq!(given("max_deflection=0.49514"), Ok(("max_deflection".into(), 0.49514)));
        for text in ["max_deflection", "=1", "a=b", "a=inf"] {
            assert!(given(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_usual_measures_are_those_that_are_there() {
        let pick = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            usual(&names.iter().collect::<Vec<_>>())
        };
        assert_eq!(
            pick(&["max_elongation", "max_reaction_1ms", "max_travel"]),
            ["max_travel", "max_reaction_1ms"]
        );
        assert_eq!(pick(&["max_speed", "x_min"]), ["max_speed"]);
        assert_eq!(pick(&["sag", "x_min", "x_max"]), ["x_min", "x_max"]);
        assert!(pick(&["sag"]).is_empty());
    }
}
