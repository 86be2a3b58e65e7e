//! What the programs report of themselves to `check`, brought together.

use crate::check::plan::Part;
use crate::check::stability::{Contact, Integrator, Limit, Node, Scheme, longest_window, steps};
use std::f64::consts::PI;
use toml::Value;
use toolkit::check::CheckReport;

/// A net gives way by at least this share of its narrower side while it brakes a rock.
const YIELD: f64 = 0.1;

/// Coupling iterations of a strong window in contact, as the drop test of Walenstadt took them; and where the contact solver advances
/// the net itself, as slope-barrier did.
const ITERATIONS: f64 = 4.5;
const ITERATIONS_YIELDING: f64 = 1.5;

/// What the coupler itself does in a pass [s], and for each node of the net, as measured on one core of 2.5 GHz: mapping, energies, rows.
const PASS: (f64, f64) = (4e-6, 6e-8);
/// Until the programs of a coupled run have found each other [s].
const MEETING: f64 = 0.06;

/// Numbers of the programs. Absent where there is no such program, or it does not report.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbers {
    /// End of the run [s].
    pub end_time: f64,
    /// The structure's solver.
    pub net: Side,
    /// The contact solver.
    pub contact: Side,
    /// Highest frequency of the net [rad/s].
    pub frequency: Option<f64>,
    /// Smallest mass of a node [kg].
    pub node_mass: Option<f64>,
    /// Largest stiffness of one contact with the structure [N/m].
    pub stiffness: Option<f64>,
    /// When the first rock comes to the net, and how long it is in contact with it [s].
    pub arrival: Option<f64>,
    pub touches: Option<f64>,
    /// Coupling iterations of a window while a rock touches the net.
    pub iterations: f64,
    /// Longest weak window.
    pub limit: Option<Limit>,
    /// Length of a window [s].
    pub window: Option<f64>,
    /// Their number.
    pub windows: Option<f64>,
    /// Seconds of an exchange.
    pub seconds_per_exchange: Option<f64>,
    /// Seconds of the coupler's own work in a pass, and of the preparation of a coupled run.
    pub seconds_per_pass: f64,
    pub preparation: f64,
    /// Parts of a window.
    pub samples: u32,
    /// Whether the coupling is weak.
    pub weak: bool,
    /// Whether the structure is in statics.
    pub is_static: bool,
    /// Whether the structure offers what a contact solver needs to advance the net itself.
    pub offers_tangents: bool,
}

/// A solver.
#[derive(Debug, Clone, Copy, Default)]
pub struct Side {
    /// Critical step [s].
    pub critical: Option<f64>,
    /// The same of a loaded net [s].
    pub loaded: Option<f64>,
    /// Its own step [s].
    pub step: Option<f64>,
    /// The longest step that is accurate [s].
    pub longest: Option<f64>,
    /// Seconds of a step.
    pub seconds: Option<f64>,
    /// Wall time of the whole run, from a trial of it; of rocks that fall on a net that of their fall as far as to it [s].
    pub run: Option<f64>,
    /// Time up to which it was tried, and when the run ends, if that was reached [s].
    pub tried: Option<f64>,
    pub ends: Option<f64>,
}

impl Side {
    /// Own steps in a window of `length` [s]; `None` if it does not report its step.
    pub fn steps(&self, length: f64) -> Option<f64> {
        Some(steps(length, self.step?) as f64)
    }
}

/// The reports, by part and name.
struct Reports<'a>(&'a [(Part, CheckReport)]);

impl Reports<'_> {
    fn number(&self, part: Part, name: &str) -> Option<f64> {
        self.0.iter().find(|(p, _)| *p == part).and_then(|(_, r)| r.numbers.get(name)).copied()
    }

    fn value(&self, part: Part, table: &str, key: &str) -> Option<&Value> {
        let (_, report) = self.0.iter().find(|(p, _)| *p == part)?;
        report.resolved.get(table)?.get(key)
    }

    fn integer(&self, key: &str) -> Option<u32> {
        self.value(Part::Coupler, "coupling", key)?.as_integer().and_then(|n| n.try_into().ok())
    }

    fn side(&self, part: Part) -> Side {
        Side {
            critical: self.number(part, "critical_step_s"),
            loaded: self.number(part, "loaded_critical_step_s"),
            step: self.number(part, "time_step_s"),
            longest: self.number(part, "longest_step_s"),
            seconds: self.number(part, "seconds_per_step"),
            run: self.number(part, "run_s"),
            tried: self.number(part, "tried_s"),
            ends: self.number(part, "ends_s"),
        }
    }

    /// How the structure is advanced; `None` for statics, and if it does not say.
    fn integrator(&self) -> Option<Integrator> {
        let number = |key: &str| self.value(Part::Fem, "fem", key).and_then(Value::as_float);
        let family = |alpha_m: f64, alpha_f: f64| Integrator::Implicit {
            alpha_m,
            alpha_f,
            beta: 0.25 * (1.0 - alpha_m + alpha_f).powi(2),
            gamma: 0.5 - alpha_m + alpha_f,
        };
        match self.value(Part::Fem, "fem", "integrator")?.as_str()? {
            "central_difference" => Some(Integrator::Explicit),
            "generalized_alpha" => {
                let r = number("rho_inf")?;
                Some(family((2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)))
            }
            "bossak" => Some(family(number("alpha")?, 0.0)),
            "newmark" => Some(Integrator::Implicit {
                alpha_m: 0.0,
                alpha_f: 0.0,
                beta: number("beta")?,
                gamma: number("gamma")?,
            }),
            _ => None,
        }
    }

    fn node(&self) -> Option<Node> {
        let of = |name| self.number(Part::Fem, name);
        let held = of("interface_stiffness_mass_kg").zip(of("interface_stiffness_n_per_m"));
        Some(Node { mass: of("least_interface_mass_kg")?, held })
    }

    /// How long a rock touches the net [s]: half a period of a spring that brakes it over twice the share by which a net gives way
    /// at least.
    fn touches(&self) -> Option<f64> {
        let of = |name| self.number(Part::Dem, name);
        let speed = (2.0 * of("landing_energy_j")? / of("mass_kg")?).sqrt();
        let distance = 2.0 * YIELD * self.number(Part::Fem, "interface_extent_m")?;
        Some(PI * distance / speed).filter(|time| time.is_finite())
    }

    /// A node alone has no size, and a rock bounces off it.
    fn bounces(&self) -> Option<f64> {
        self.number(Part::Dem, "contact_duration_s").filter(|time| *time > 0.0)
    }

    /// Coupling iterations of a window in contact.
    fn iterations(&self) -> f64 {
        let of = |key| self.value(Part::Coupler, "coupling", key);
        match of("scheme").and_then(Value::as_str) {
            Some("weak") | None => 1.0,
            _ if of("yielding_net").and_then(Value::as_bool) == Some(true) => ITERATIONS_YIELDING,
            _ => ITERATIONS,
        }
    }

    /// The contact with the structure: at its stiffest as in a flat landing on something rigid, and as it is while the net
    /// brakes the rock. That is a force `2 E / s` for a rock of energy E that comes to rest within s, shared by the spheres
    /// of a face, or the blow on a single node, whichever is stiffer.
    fn contact(&self, node: Node) -> Option<Contact> {
        let of = |name| self.number(Part::Dem, name);
        let peak = of("contact_stiffness_n_per_m").filter(|k| *k > 0.0)?;
        let exponent = of("contact_exponent").unwrap_or(0.0);
        let braking = || {
            let extent = self.number(Part::Fem, "interface_extent_m")?;
            let force = 2.0 * of("landing_energy_j")? / (YIELD * extent) / of("facing_spheres")?;
            let share = (force / of("contact_force_n")?).min(1.0);
            let blow = of("landing_energy_j")? * node.mass / of("mass_kg")?;
            let of_blow = (blow / of("contact_energy_j")?).min(1.0);
            let soft = share.powf(exponent);
            let blown = of_blow.powf(exponent / (1.0 + 2.0 * exponent));
            // Small spheres share the wires of a node; those count whose lowest parts lie on a wire.
            let (pitch, patch) =
                (of("sphere_pitch_m")?, of("contact_patch_m")? * share.powf(0.5 * (1.0 - exponent)));
            let along = self.number(Part::Fem, "interface_length_per_node_m").unwrap_or(0.0) / pitch;
            let together = ((2.0 * patch / pitch).min(1.0) * along).max(1.0);
            Some((soft.max(blown) * peak, (together * soft * peak, together)))
        };
        let (sustained, shared) = braking().unwrap_or((peak, (peak, 1.0)));
        Some(Contact {
            kink: exponent == 0.0,
            peak,
            sustained,
            shared,
            ratio: of("dashpot_ratio").unwrap_or(0.0),
            dashpot_mass: of("dashpot_mass_kg"),
            friction: of("tangential_ratio"),
        })
    }

    fn limit(&self) -> Option<Limit> {
        let node = self.node()?;
        let scheme = Scheme {
            predictor: self.integer("predictor").unwrap_or(1),
            samples: self.integer("samples").unwrap_or(1),
            integrator: self.integrator()?,
            step: self.number(Part::Fem, "time_step_s").unwrap_or(f64::INFINITY),
        };
        Some(longest_window(node, &self.contact(node)?, &scheme))
    }
}

impl Numbers {
    /// From the reports of the programs of a run to `end_time` [s].
    pub fn of(reports: &[(Part, CheckReport)], end_time: f64) -> Self {
        let reports = Reports(reports);
        let window = reports.number(Part::Coupler, "time_window_s");
        let interface = reports.0.iter().find_map(|(_, report)| report.interface.as_ref());
        Self {
            end_time,
            net: reports.side(Part::Fem),
            contact: reports.side(Part::Dem),
            frequency: reports.number(Part::Fem, "highest_frequency_rad_per_s"),
            node_mass: reports.number(Part::Fem, "least_interface_mass_kg"),
            stiffness: reports.number(Part::Dem, "contact_stiffness_n_per_m"),
            arrival: reports.number(Part::Dem, "arrival_s"),
            touches: reports.touches().or_else(|| reports.bounces()),
            iterations: reports.iterations(),
            limit: reports.limit(),
            window,
            windows: reports
                .number(Part::Coupler, "windows")
                .or_else(|| Some(steps(end_time, window?) as f64)),
            seconds_per_exchange: reports.number(Part::Coupler, "seconds_per_exchange"),
            seconds_per_pass: PASS.0 + PASS.1 * interface.map_or(0.0, |mesh| mesh.node_count() as f64),
            preparation: MEETING + reports.number(Part::Fem, "prepare_s").unwrap_or(0.0),
            samples: reports.integer("samples").unwrap_or(1),
            weak: reports.value(Part::Coupler, "coupling", "scheme").and_then(Value::as_str) == Some("weak"),
            is_static: reports.value(Part::Fem, "fem", "integrator").and_then(Value::as_str)
                == Some("static"),
            offers_tangents: reports.number(Part::Fem, "tangents_for_contact").is_some(),
        }
    }

    /// Critical step of net and contact together [s], `2 / sqrt(w^2 + k / m)`: a stiff contact on the
    /// lightest node of the net, the rock being heavy against it.
    ///
    /// Source: two-mass contact model with both sides explicit, rock mass to infinity.
    pub fn together(&self) -> Option<f64> {
        let (k, m, w) = (self.stiffness?, self.node_mass?, self.frequency?);
        Some(2.0 / (w * w + k / m).sqrt())
    }
}
