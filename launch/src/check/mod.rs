//! `rockfall check`: what would run, critical steps, windows, cost, from the programs' own numbers.
//!
//! - [`prepared`]: all that comes before the record, for every command that reads a scene: each program checks the tables that are its
//!   own, and reports numbers
//! - [`plan`]: who takes part, by presence, and the program files
//! - [`ground`]: heights of the terrain for a structure that stands on it, and where files lie that one program hands to another
//! - [`choice`]: scheme, window and steps that the scene leaves open, from [`numbers`] and [`stability`] (the longest weak window)

pub mod choice;
pub mod ground;
pub mod numbers;
pub mod plan;
pub mod prepared;
pub mod stability;

use crate::check::choice::Preset;
use crate::check::numbers::{Numbers, Side};
use crate::check::prepared::Prepared;
use crate::front::stop::Stop;
use crate::run::children::Events;
use crate::run::record;
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;
use toolkit::arguments::Input;
use toolkit::check::Format;
use toolkit::numbers::{short, three};

/// How long a fall, or a structure alone, is tried [s].
const TRIAL: f64 = 0.5;
/// A cost beyond this is worth a question: a day [s].
const LONG: f64 = 86_400.0;
/// Nobody waits so long for a run: ten years [s].
const FOR_EVER: f64 = 10.0 * 365.0 * 86_400.0;

/// The answer to `rockfall check`. The scene with every default and every choice filled in goes to `resolved`.
pub fn check(input: &Input, resolved: Option<&Path>, format: Format) -> Result<String, Stop> {
    let prepared = Prepared::tried(input, |_| None, &Events::watch()?, Some(TRIAL))?;
    if let Some(file) = resolved {
        // A device or a directory would be replaced, not written to.
        if file.metadata().is_ok_and(|known| !known.is_file()) {
            let what = format!("--resolved {}: this is not a regular file", file.display());
            return Err(Stop::input(code::ARGUMENT, what)
                .hinted("name the file of a scene, as in --resolved full.toml"));
        }
        let mut table = prepared.resolved()?;
        // It is made again by whoever runs the scene.
        prepared.ground.forget(&mut table);
        record::write_scene(file, &prepared.scene, &table, None)
            .map_err(|e| Stop::input(code::FILE, format!("{}: cannot be written: {e}", file.display())))?;
    }
    let warnings = prepared.warnings()?;
    Ok(match format {
        Format::Json => format!("{}\n", prepared.json(&warnings)),
        Format::Text => {
            let warnings = warnings.iter().map(|warning| format!("warning: {warning}\n"));
            prepared.text()? + &warnings.collect::<String>()
        }
    })
}

impl Prepared {
    /// For people.
    fn text(&self) -> Result<String, Stop> {
        let mut text = String::new();
        let how = match self.plan.members.len() {
            1 => "1 process, no shared memory".to_owned(),
            n => format!("{n} processes over shared memory"),
        };
        let _ = writeln!(text, "{}: {how}, {} s", self.scene.name(), short(self.numbers.end_time));
        for member in &self.plan.members {
            let program = member.program.display();
            let _ = writeln!(text, "\n{}: {program} {}", member.part.name(), member.arguments.join(" "));
            match self.report(member.part) {
                Some(report) => report.builds.iter().for_each(|line| text += &format!("  {line}\n")),
                None => text += "  named by the scene: it is not asked, and starts as it is\n",
            }
        }
        text.push('\n');
        for choice in self.choices() {
            let _ = writeln!(text, "{:<28} {}", "chosen, not in the scene", choice.text());
        }
        if let Some(preset) = Preset::of(&self.scene.document()?) {
            let _ = writeln!(text, "{:<28} {}", "preset, as measured", preset.quote());
        }
        Ok(text + &self.numbers.steps() + &self.numbers.cost())
    }

    /// The same as data, with what was chosen by its dotted key.
    fn json(&self, warnings: &[Diagnostic]) -> Value {
        let process = |member: &crate::check::plan::Member| {
            let report = self.report(member.part);
            json!({
                "name": member.part.name(),
                "program": member.program.display().to_string(),
                "arguments": member.arguments,
                "builds": report.map(|report| &report.builds),
                "numbers": report.map(|report| &report.numbers),
            })
        };
        let chosen = (self.choices())
            .map(|choice| (format!("{}.{}", choice.key.0, choice.key.1), json!(choice.value)));
        json!({
            "scene": self.scene.name(),
            "end_time_s": self.numbers.end_time,
            "processes": self.plan.members.iter().map(process).collect::<Vec<_>>(),
            "chosen": chosen.collect::<serde_json::Map<_, _>>(),
            "longest_weak_window_s": self.numbers.limit.map(|limit| limit.window),
            "expected_cost_s": self.numbers.expected_cost().filter(|cost| cost.is_finite()),
            "warnings": warnings,
        })
    }
}

impl Numbers {
    fn steps(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, critical: Option<f64>, note: String| {
            if let Some(critical) = critical {
                let _ = writeln!(text, "{name:<28} {} s{note}", short(critical));
            }
        };
        let of = |before: &str, value: Option<f64>, unit: &str| {
            value.map_or(String::new(), |v| format!("{before}{} {unit}", short(v)))
        };
        let own = |side: &Side| {
            of(" at rest, ", side.loaded, "s loaded") + &of("; its own step is ", side.step, "s")
        };
        line("critical step, net", self.net.critical, own(&self.net));
        line("critical step, contact", self.contact.critical, own(&self.contact));
        let (stiffness, mass) = (of("", self.stiffness, "N/m"), of("", self.node_mass, "kg"));
        let note = format!("; a contact of {stiffness} on a node of {mass}");
        line("critical step, together", self.together(), note);
        if let Some(limit) = self.limit {
            line("longest weak window", Some(limit.window), format!("; what sets it: {}", limit.cause));
        }
        text
    }

    fn cost(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, what: String| {
            let _ = writeln!(text, "{name:<28} {what}");
        };
        let (Some(windows), Some(length)) = (self.windows, self.window) else {
            // One solver alone: its steps over the whole time.
            for (side, less) in [(&self.net, ""), (&self.contact, "; less if all come to rest")] {
                let steps = side.steps(self.end_time);
                let Some(cost) = side.run.or_else(|| Some(steps? * side.seconds?)) else { continue };
                let cost = three(cost);
                let [tried, ends] = [side.tried, side.ends].map(|time| time.map(short));
                if let Some(steps) = steps {
                    line("steps", format!("up to {}", short(steps)));
                }
                line(
                    "expected cost",
                    match (tried, ends) {
                        (_, Some(ends)) => {
                            format!("{cost} s of wall time, as tried: the run ends at {ends} s")
                        }
                        (Some(tried), _) => {
                            format!("up to {cost} s of wall time, as tried as far as {tried} s{less}")
                        }
                        _ => format!("up to {cost} s of wall time"),
                    },
                );
            }
            return text;
        };
        line("windows", format!("{} of {} s", short(windows), short(length)));
        let mut unknown = Vec::new();
        for (name, side) in [("net", &self.net), ("contact", &self.contact)] {
            match side.steps(length) {
                Some(steps) => line(&format!("steps per window, {name}"), short(steps)),
                None => unknown.push(name),
            }
        }
        let unknown = (!unknown.is_empty()).then(|| unknown.join(" and the "));
        let without =
            unknown.map_or("".into(), |of| format!(" and the steps of the {of}, which are not known"));
        let cost = self.expected_cost().unwrap_or(f64::NAN);
        let cost = three(cost);
        let (about, less) = match (self.arrival, self.contact.ends, self.contact.tried.map(short)) {
            (Some(_), ..) | (.., None) => ("some", String::new()),
            (_, Some(ends), _) => ("some", format!("; as tried, the fall ends at {} s", short(ends))),
            (.., Some(tried)) => {
                ("up to some", format!("; until {tried} s no rock comes to the net, as tried"))
            }
        };
        line(
            "expected cost",
            format!("{about} {cost} s of wall time on a machine that does nothing else{without}{less}"),
        );
        text
    }

    /// Wall time of steps and exchanges alone [s], for one coupling iteration per window.
    pub fn of_steps(&self) -> Option<f64> {
        self.cost_with(|windows, _, pass| windows * pass)
    }

    /// Wall time of the run [s], `wall_s` of its summary, as far as it is known. A strong window takes its iterations while a rock
    /// touches the net; before, the net is at rest.
    pub fn expected_cost(&self) -> Option<f64> {
        self.cost_with(|_, length, pass| {
            let Side { run, tried, ends, .. } = self.contact;
            let before = self.arrival.or(ends.map(|_| self.end_time)).or(tried).unwrap_or(0.0);
            let moving = self.end_time - before;
            let contact = self.touches.unwrap_or(f64::INFINITY).min(moving);
            let passes = (moving + (self.iterations - 1.0) * contact) / length;
            self.preparation + run.unwrap_or(0.0) + passes * pass
        })
    }

    /// That of one solver alone; of two as `coupled` makes it of the number of windows, their length and what passing one once costs [s].
    fn cost_with(&self, coupled: impl Fn(f64, f64, f64) -> f64) -> Option<f64> {
        let of = |side: &Side, length: f64| Some(side.steps(length)? * side.seconds.unwrap_or(0.0));
        let Some((windows, length)) = self.windows.zip(self.window) else {
            let sides = [&self.net, &self.contact].into_iter();
            return sides.flat_map(|side| side.run.or_else(|| of(side, self.end_time))).next();
        };
        // One request and one answer with each of the two solvers, and their steps.
        let mut pass = self.seconds_per_pass + 2.0 * self.seconds_per_exchange.unwrap_or(0.0);
        for side in [&self.net, &self.contact] {
            pass += of(side, length).unwrap_or(0.0);
        }
        Some(coupled(windows, length, pass))
    }

    /// What is to be said of a run that takes days, or that never ends.
    pub fn of_cost(&self) -> Option<Diagnostic> {
        let cost = self.expected_cost().filter(|cost| *cost > LONG)?;
        let seconds = |side: &Side| side.seconds.zip(side.step).map_or(0.0, |(seconds, step)| seconds / step);
        let (net, contact) = (seconds(&self.net), seconds(&self.contact));
        let exchange = self.seconds_per_exchange.zip(self.window).map_or(0.0, |(s, window)| 2.0 * s / window);
        let key = match () {
            () if exchange > net.max(contact) => "coupling.time_window",
            () if net >= contact => "fem.time_step",
            () => "dem.time_step",
        };
        let days = short((cost / 86_400.0).round());
        let what = format!("the run would take some {days} days of wall time, most of it because of {key}");
        let found = Diagnostic::warning(code::SIZE, what).about(key);
        let severity = if cost > FOR_EVER { Severity::Error } else { Severity::Warning };
        Some(
            Diagnostic { severity, ..found }.try_instead("lengthen it, or leave it out; or shorten end_time"),
        )
    }

    /// What is to be said of a weak window beyond the limit.
    pub fn of_window(&self) -> Option<Diagnostic> {
        let (window, limit) = (self.window?, self.limit?);
        (self.weak && window > limit.window).then(|| {
            let [k, m] = [self.stiffness, self.node_mass].map(|known| short(known.unwrap_or(f64::NAN)));
            let (window, cause, longest) = (short(window), limit.cause, short(limit.window));
            let what = format!(
                "weak coupling with a window of {window} s is wrong where a contact becomes as stiff as {k} N/m on a node of {m} kg: \
                 {cause} sets the limit there, {longest} s"
            );
            Diagnostic::warning(code::TIME_STEP, what)
                .about("coupling.time_window")
                .try_instead("shorten coupling.time_window or use scheme = \"strong\"")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::plan::Part;
    use toolkit::check::CheckReport;

    fn report(numbers: &[(&str, f64)]) -> CheckReport {
        CheckReport {
            numbers: numbers.iter().map(|(k, v)| (k.to_string(), *v)).collect(),
            ..Default::default()
        }
    }

    fn coupled(window: f64) -> Numbers {
        let mut coupler =
            report(&[("time_window_s", window), ("windows", 1000.0), ("seconds_per_exchange", 1e-5)]);
        coupler.resolved = "[coupling]\nscheme = \"weak\"".parse().expect("TOML");
        let mut net = report(&[
            ("critical_step_s", 1e-4),
            ("time_step_s", 1e-5),
            ("seconds_per_step", 1e-6),
            ("highest_frequency_rad_per_s", 2e4),
            ("least_interface_mass_kg", 0.03),
        ]);
        net.resolved = "[fem]\nintegrator = \"central_difference\"".parse().expect("TOML");
        let contact = report(&[
            ("critical_step_s", 2e-2),
            ("time_step_s", 2e-5),
            ("seconds_per_step", 3e-6),
            ("contact_stiffness_n_per_m", 1e6),
            ("contact_exponent", 1.0 / 3.0),
        ]);
        Numbers::of(&[(Part::Coupler, coupler), (Part::Fem, net), (Part::Dem, contact)], 0.05)
    }

    #[test]
    fn net_and_contact_together_are_stiffer_than_each() {
        let numbers = coupled(5e-5);
        // w^2 = 4e8, k/m = 1e6 / 0.03.
        let exact = 2.0 / (4e8_f64 + 1e6 / 0.03).sqrt();
        assert!((numbers.together().expect("known") / exact - 1.0).abs() < 1e-15);
        // Its spring would bear 0.8 * 2 sqrt(m / k) = 0.28 ms, which a mean over 1 ms does not.
        let limit = numbers.limit.expect("known");
        assert!(limit.window == 1.25e-4 && limit.cause.contains("1 ms"), "{limit:?}");
        assert!(
            numbers.steps().contains("a contact of 1000000 N/m on a node of 0.03 kg"),
            "{}",
            numbers.steps()
        );
    }

    #[test]
    fn the_cost_counts_steps_and_exchanges_of_every_window() {
        let text = coupled(5e-5).cost();
        // 1000 windows of 2 exchanges, 5 steps of the net, 3 of the contact: 20 + 5 + 9 us each, and 4 us of the coupler's own; 0.06 s before.
        assert!(text.contains("some 0.098 s of wall time"), "{text}");
        assert!(
            text.contains("steps per window, net        5\n") && text.contains("contact    3\n"),
            "{text}"
        );
        let alone = report(&[("time_step_s", 1e-3), ("seconds_per_step", 1e-6)]);
        let text = Numbers::of(&[(Part::Dem, alone)], 1.0).cost();
        assert!(text.contains(" up to 1000\n") && text.contains("up to 0.001 s"), "{text}");
    }

    #[test]
    fn a_weak_window_beyond_the_limit_is_warned_of() {
        assert_eq!(coupled(5e-5).of_window(), None);
        assert!(
            coupled(1e-3)
                .of_window()
                .expect("too long")
                .message
                .contains("over 1 ms, which it has to resolve sets the limit there, 0.000125 s")
        );
    }

    #[test]
    fn a_run_that_takes_days_is_warned_of_and_one_that_never_ends_is_refused() {
        let with_step =
            |step: f64| Numbers { net: Side { step: Some(step), ..coupled(5e-5).net }, ..coupled(5e-5) };
        assert_eq!(coupled(5e-5).of_cost(), None);
        // 0.05 s of it, in steps that take 1e-6 s of wall time each.
        let long = with_step(1e-14).of_cost().expect("58 days");
        assert_eq!((long.severity, &long.code), (Severity::Warning, &code::SIZE));
        assert!(long.key.as_deref() == Some("fem.time_step") && long.message.contains(" 58 days"), "{long}");
        let never = with_step(1e-18).of_cost().expect("centuries");
        assert_eq!(never.severity, Severity::Error);
    }

    #[test]
    fn what_a_program_does_not_tell_is_left_out() {
        let numbers = Numbers::of(&[], 1.0);
        assert_eq!(
            (numbers.steps(), numbers.cost(), numbers.of_window()),
            (String::new(), String::new(), None)
        );
    }
}
