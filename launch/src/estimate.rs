//! `rockfall check`: what would run, critical steps, windows, cost, from the programs' own numbers.

use crate::events::Events;
use crate::plan::{Part, Plan};
use crate::record;
use crate::stop::Stop;
use crate::validate::validate;
use interface_defs::Window;
use interface_defs::toolkit::check::CheckReport;
use interface_defs::toolkit::scene::Scene;
use interface_defs::toolkit::summary::short;
use std::fmt::Write;
use std::path::Path;

/// The answer to `rockfall check`. The scene with every default filled in goes to `resolved`.
pub fn check(path: &Path, sets: &[String], resolved: Option<&Path>) -> Result<String, Stop> {
    let events = Events::watch().map_err(Stop::failed)?;
    let scene = Scene::load(path, sets)?;
    let plan = Plan::of(&scene)?;
    let reports = validate(&plan, path, sets, &events)?;
    if let Some(file) = resolved {
        let table = record::resolved(&scene, &plan, &reports)?;
        record::write_scene(file, &scene, &table, None)
            .map_err(|e| Stop::input(format!("{}: cannot be written: {e}", file.display())))?;
    }
    let mut text = String::new();
    let how = match plan.members.len() {
        1 => "1 process, no shared memory".to_owned(),
        n => format!("{n} processes over shared memory"),
    };
    let _ = writeln!(text, "{}: {how}, {} s", scene.name(), short(scene.end_time()?));
    for member in &plan.members {
        let program = member.program.display();
        let _ = writeln!(text, "\n{}: {program} {}", member.part.name(), member.arguments.join(" "));
        match reports.iter().find(|(part, _)| *part == member.part) {
            Some((_, report)) => report.builds.iter().for_each(|line| {
                let _ = writeln!(text, "  {line}");
            }),
            None => text.push_str("  named by the scene: it is not asked, and starts as it is\n"),
        }
    }
    let numbers = Numbers::of(&reports, scene.end_time()?);
    text.push('\n');
    text.push_str(&numbers.steps());
    text.push_str(&numbers.cost());
    for warning in warnings(&reports, scene.end_time()?) {
        let _ = writeln!(text, "warning: {warning}");
    }
    Ok(text)
}

/// What the user should know before the start, each once.
pub fn warnings(reports: &[(Part, CheckReport)], end_time: f64) -> Vec<String> {
    let of_programs = reports.iter().flat_map(|(_, report)| report.warnings.iter().cloned());
    let mut all: Vec<String> = Vec::new();
    for warning in of_programs.chain(Numbers::of(reports, end_time).warnings()) {
        if !all.contains(&warning) {
            all.push(warning);
        }
    }
    all
}

/// About as long as a net brakes a rock [s].
const DOUBLES: f64 = 0.1;

/// What the programs tell of themselves. Absent where there is no such program, or it does not tell.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers {
    end_time: f64,
    /// Critical step, own step [s], seconds per step.
    net: Side,
    contact: Side,
    /// Highest frequency of the net [rad/s].
    frequency: Option<f64>,
    /// Smallest mass that a node shows to a contact [kg].
    node_mass: Option<f64>,
    /// Largest stiffness of one contact [N/m].
    stiffness: Option<f64>,
    /// Largest stiffness of the structure at a node for its mass squared: that stiffness [N/m] and mass [kg].
    held: Option<(f64, f64)>,
    /// Tangential over normal stiffness of a contact with friction.
    tangential: Option<f64>,
    /// Damping ratio of the contact's dashpot.
    dashpot: Option<f64>,
    /// Mass that scales the dashpot [kg], where it is not the node's own.
    dashpot_mass: Option<f64>,
    window: Option<f64>,
    windows: Option<f64>,
    seconds_per_exchange: Option<f64>,
    weak: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Side {
    critical: Option<f64>,
    step: Option<f64>,
    seconds: Option<f64>,
}

impl Side {
    /// Own steps in a window of `length` [s]; `None` if it does not tell its step.
    fn steps(&self, length: f64) -> Option<f64> {
        Some(Window { number: 1, iteration: 1, start: 0.0, length }.steps(self.step?) as f64)
    }
}

impl Numbers {
    fn of(reports: &[(Part, CheckReport)], end_time: f64) -> Self {
        let of = |part: Part, name: &str| {
            reports.iter().find(|(p, _)| *p == part).and_then(|(_, r)| r.numbers.get(name)).copied()
        };
        let side = |part| Side {
            critical: of(part, "critical_step_s"),
            step: of(part, "time_step_s"),
            seconds: of(part, "seconds_per_step"),
        };
        let weak = reports.iter().filter(|(part, _)| *part == Part::Coupler).any(|(_, report)| {
            report.resolved.get("coupling").and_then(|c| c.get("scheme")).and_then(|s| s.as_str())
                == Some("weak")
        });
        Self {
            end_time,
            net: side(Part::Fem),
            contact: side(Part::Dem),
            frequency: of(Part::Fem, "highest_frequency_rad_per_s"),
            node_mass: of(Part::Fem, "least_interface_mass_kg"),
            stiffness: of(Part::Dem, "contact_stiffness_n_per_m"),
            held: of(Part::Fem, "interface_stiffness_n_per_m")
                .zip(of(Part::Fem, "interface_stiffness_mass_kg")),
            tangential: of(Part::Dem, "tangential_ratio"),
            dashpot: of(Part::Dem, "dashpot_ratio"),
            dashpot_mass: of(Part::Dem, "dashpot_mass_kg"),
            window: of(Part::Coupler, "time_window_s"),
            windows: of(Part::Coupler, "windows"),
            seconds_per_exchange: of(Part::Coupler, "seconds_per_exchange"),
            weak,
        }
    }

    /// Critical step of net and contact together [s], `2 / sqrt(w^2 + k / m)`: a stiff contact on the
    /// lightest node of the net, the rock being heavy against it.
    ///
    /// Source: two-mass contact model with both sides explicit, rock mass to infinity.
    fn together(&self) -> Option<f64> {
        let (k, m, w) = (self.stiffness?, self.node_mass?, self.frequency?);
        Some(2.0 / (w * w + k / m).sqrt())
    }

    /// Longest window of a weak coupling [s], and what sets it: the contact's spring `2 sqrt(m / k)`, its dashpot
    /// `2 m / c` with `c = 2 ratio sqrt(m* k)`, or its friction, see [`Numbers::friction_limit`].
    ///
    /// Source: two-mass contact model, one pass.
    fn weak_limit(&self) -> Option<(f64, &'static str)> {
        let (m, k) = (self.node_mass?, self.stiffness?);
        let spring = (2.0 * (m / k).sqrt(), "spring");
        let dashpot = self.dashpot.map(|ratio| {
            let c = 2.0 * ratio * (self.dashpot_mass.unwrap_or(m) * k).sqrt();
            (2.0 * m / c, "dashpot")
        });
        let friction = self.friction_limit().map(|limit| (limit, "friction"));
        let others = dashpot.into_iter().chain(friction);
        Some(others.fold(spring, |least, limit| if limit.0 < least.0 { limit } else { least }))
    }

    /// Window in which the energy of a node under friction doubles in [`DOUBLES`] [s].
    ///
    /// One pass answers with one mean force to a wall that moves on straight. Between a contact of stiffness `k` and a
    /// structure that holds the node of mass m with `k_s`, the map of a window H has the determinant
    ///
    /// ```text
    /// 1 + k / k_s (2 sin^2(a / 2) - a / 2 sin a) = 1 + k k_s H^4 / (24 m^2) + ...      a = H sqrt(k_s / m)
    /// ```
    ///
    /// above 1 however short the window: energy grows at the rate `k k_s H^3 / (24 m^2)`. Along its normal a contact meets a
    /// net across its wires, where it is soft; friction holds it along them, where wires, and more so rings that unload, are
    /// stiff. Derived here; measured on nets of cables and of rings, which without friction gain nothing.
    fn friction_limit(&self) -> Option<f64> {
        let (held, m) = self.held?;
        let k = self.stiffness? * self.tangential?;
        Some((24.0 * m * m * std::f64::consts::LN_2 / (DOUBLES * k * held)).cbrt())
    }

    fn steps(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, critical: Option<f64>, note: String| {
            if let Some(critical) = critical {
                let _ = writeln!(text, "{name:<28} {} s{note}", short(critical));
            }
        };
        let own = |side: &Side| {
            side.step.map_or(String::new(), |step| format!("; its own step is {} s", short(step)))
        };
        line("critical step, net", self.net.critical, own(&self.net));
        line("critical step, contact", self.contact.critical, own(&self.contact));
        let of =
            |value: Option<f64>, unit: &str| value.map_or(String::new(), |v| format!("{} {unit}", short(v)));
        let mass = of(self.node_mass, "kg");
        let stiffness = of(self.stiffness, "N/m");
        line(
            "critical step, together",
            self.together(),
            format!("; a contact of {stiffness} on a node of {mass}"),
        );
        if let Some((limit, part)) = self.weak_limit() {
            line(
                "longest weak window",
                Some(limit),
                format!("; above it the contact's {part} grows from pass to pass"),
            );
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
            for side in [&self.net, &self.contact] {
                if let (Some(steps), Some(seconds)) = (side.steps(self.end_time), side.seconds) {
                    line("steps", short(steps));
                    line("expected cost", format!("up to {} s of wall time", short(steps * seconds)));
                }
            }
            return text;
        };
        line("windows", format!("{} of {} s", short(windows), short(length)));
        // One request and one answer with each of the two solvers, and their steps.
        let mut pass = 2.0 * self.seconds_per_exchange.unwrap_or(0.0);
        let mut untold = Vec::new();
        for (name, side) in [("net", &self.net), ("contact", &self.contact)] {
            match side.steps(length) {
                Some(steps) => {
                    line(&format!("steps per window, {name}"), short(steps));
                    pass += steps * side.seconds.unwrap_or(0.0);
                }
                None => untold.push(name),
            }
        }
        let per = if self.weak { "" } else { " for one coupling iteration per window" };
        let without = if untold.is_empty() {
            String::new()
        } else {
            format!(" and the steps of the {}, which are not known", untold.join(" and the "))
        };
        line("expected cost", format!("up to {} s of wall time{per}{without}", short(windows * pass)));
        text
    }

    fn warnings(&self) -> Option<String> {
        let (window, (limit, part)) = (self.window?, self.weak_limit()?);
        (self.weak && window > limit).then(|| {
            format!(
                "weak coupling with a window of {} s fails where a contact becomes as stiff as {} N/m on a node of \
                 {} kg: its {part} sets the limit there, {} s; shorten coupling.time_window or use scheme = \"strong\"",
                short(window),
                short(self.stiffness.unwrap_or(f64::NAN)),
                short(self.node_mass.unwrap_or(f64::NAN)),
                short(limit)
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let net = report(&[
            ("critical_step_s", 1e-4),
            ("time_step_s", 1e-5),
            ("seconds_per_step", 1e-6),
            ("highest_frequency_rad_per_s", 2e4),
            ("least_interface_mass_kg", 0.03),
        ]);
        let contact = report(&[
            ("critical_step_s", 2e-2),
            ("time_step_s", 2e-5),
            ("seconds_per_step", 3e-6),
            ("contact_stiffness_n_per_m", 1e6),
        ]);
        Numbers::of(&[(Part::Coupler, coupler), (Part::Fem, net), (Part::Dem, contact)], 1.0)
    }

    #[test]
    fn net_and_contact_together_are_stiffer_than_each() {
        let numbers = coupled(5e-5);
        // w^2 = 4e8, k/m = 1e6 / 0.03.
        let exact = 2.0 / (4e8_f64 + 1e6 / 0.03).sqrt();
        assert!((numbers.together().expect("known") / exact - 1.0).abs() < 1e-15);
        assert!((numbers.weak_limit().expect("known").0 - 2.0 * 3e-8_f64.sqrt()).abs() < 1e-18);
        assert!(
            numbers.steps().contains("a contact of 1000000 N/m on a node of 0.03 kg"),
            "{}",
            numbers.steps()
        );
    }

    #[test]
    fn the_cost_counts_steps_and_exchanges_of_every_window() {
        let text = coupled(5e-5).cost();
        // 1000 windows of 2 exchanges, 5 steps of the net, 3 of the contact: 20 + 5 + 9 us each.
        assert!(text.contains("up to 0.034 s of wall time"), "{text}");
        assert!(
            text.contains("steps per window, net        5\n") && text.contains("contact    3\n"),
            "{text}"
        );
        let alone = report(&[("time_step_s", 1e-3), ("seconds_per_step", 1e-6)]);
        let text = Numbers::of(&[(Part::Dem, alone)], 1.0).cost();
        assert!(text.contains(" 1000\n") && text.contains("up to 0.001 s"), "{text}");
    }

    #[test]
    fn a_weak_window_beyond_the_limit_is_warned_of() {
        assert_eq!(coupled(5e-5).warnings(), None);
        assert!(
            coupled(1e-3)
                .warnings()
                .expect("too long")
                .contains("its spring sets the limit there, 0.00034641 s")
        );
    }

    /// The regression case of the reference: 97.5 kg in a dashpot that acts on a node of 0.03 kg.
    #[test]
    fn a_dashpot_of_the_rocks_mass_on_a_light_node_sets_the_limit() {
        let numbers = Numbers {
            node_mass: Some(0.0296),
            stiffness: Some(31e3),
            dashpot: Some(0.667),
            dashpot_mass: Some(97.5),
            ..Numbers::default()
        };
        let exact = 0.0296 / (0.667 * (97.5_f64 * 31e3).sqrt());
        let (limit, part) = numbers.weak_limit().expect("known");
        assert!((limit / exact - 1.0).abs() < 1e-12 && part == "dashpot", "{limit} {part}");
        let local = Numbers { dashpot_mass: None, ..numbers };
        assert!(local.weak_limit().expect("known").0 > 50.0 * limit);
    }

    /// A node of mass m on a spring to the ground and one to a contact that sees it move on straight.
    #[test]
    fn friction_doubles_the_energy_of_a_node_in_the_time_that_is_said() {
        let (m, k, held): (f64, f64, f64) = (0.315, 1e7, 1.2e8);
        let numbers = Numbers {
            node_mass: Some(m),
            stiffness: Some(k),
            tangential: Some(1.0),
            held: Some((held, m)),
            ..Numbers::default()
        };
        let (h, part) = numbers.weak_limit().expect("known");
        assert_eq!(part, "friction");
        let (w, mut u, mut v) = ((held / m).sqrt(), 1e-3, 0.0);
        let energy = |u: f64, v: f64| 0.5 * m * v * v + 0.5 * (k + held) * u * u;
        let (start, (sine, cosine)) = (energy(u, v), (w * h).sin_cos());
        for _ in 0..(DOUBLES / h) as usize {
            let still = -k * (u + 0.5 * h * v) / held;
            (u, v) = (still + (u - still) * cosine + v / w * sine, v * cosine - (u - still) * w * sine);
        }
        // The next term of the series is a^2 / 30 of the first, of the exponent; the energy itself swings by as much as k / k_s.
        let gain = energy(u, v) / start;
        assert!((gain / 2.0 - 1.0).abs() < 0.1, "{gain}");
        let smooth = Numbers { tangential: None, ..numbers };
        assert_eq!(smooth.weak_limit().expect("known").1, "spring");
    }

    #[test]
    fn what_a_program_does_not_tell_is_left_out() {
        let numbers = Numbers::of(&[], 1.0);
        assert_eq!(
            (numbers.steps(), numbers.cost(), numbers.warnings()),
            (String::new(), String::new(), None)
        );
    }
}
