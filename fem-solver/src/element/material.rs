//! The uniaxial law: elastic, hardening by a table, an end of the plastic travel; and rupture.
//!
//! ```text
//! S = s_0 + E (e - p)                      p = plastic strain, a = its sum of magnitudes
//! |S| <= Y(a)                              straight between the rows of a table, constant beyond
//! a <= limit                               beyond: elastic again (the end stop of a brake)
//! |S| = Y(a) g(da/dt)                      while it flows, where a table says what speed does; g(0) = 1
//! stored S^2 / 2 E,  dissipated int_0^a Y  per unit of what S e is work of
//! ```
//!
//! Strain and stress, or elongation and force: the law does not care. A backward Euler return mapping,
//! exact for one dimension. Source: Simo and Hughes (1998), Computational Inelasticity, section 1.4.

/// Numbers in the history of a law: plastic strain, its accumulated magnitude, broken (0 or 1), energy
/// lost at rupture (per unit as above).
pub const HISTORY: usize = 4;

/// Halvings of what flows in a step: to rounding.
const BISECTIONS: u32 = 52;

/// A uniaxial law.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// `E`, above 0.
    pub modulus: f64,
    /// `s_0`.
    pub prestress: f64,
    /// Whether it carries no compression.
    pub tension_only: bool,
    /// Rows `(a, Y)`, `a` increasing from 0; empty = elastic.
    pub hardening: Vec<(f64, f64)>,
    /// Largest `a`; infinite = no end stop.
    pub limit: f64,
    /// Rows `(da/dt, g)`, both increasing from more than 0 and from 1 or more; empty = speed does nothing.
    pub speeds: Vec<(f64, f64)>,
}

/// Stress and stiffness at a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stress {
    /// `S`.
    pub stress: f64,
    /// `dS/de`, 0 where slack.
    pub modulus: f64,
    /// Whether it is slack.
    pub slack: bool,
    /// History after the strain.
    pub history: [f64; HISTORY],
}

impl Law {
    /// An elastic law.
    pub fn elastic(modulus: f64, prestress: f64, tension_only: bool) -> Self {
        Self {
            modulus,
            prestress,
            tension_only,
            hardening: Vec::new(),
            limit: f64::INFINITY,
            speeds: Vec::new(),
        }
    }

    /// Stress at `strain`, from `history`, if nothing flows on the way there.
    pub fn trial(&self, strain: f64, history: &[f64]) -> f64 {
        self.prestress + self.modulus * (strain - history[0])
    }

    /// Stress at `strain`, from `history`.
    pub fn stress(&self, strain: f64, history: &[f64]) -> Stress {
        let now = [history[0], history[1], history[2], history[3]];
        let [plastic, accumulated, broken, lost] = now;
        let elastic = self.trial(strain, history);
        if broken > 0.0 || self.tension_only && elastic < 0.0 {
            return Stress { stress: 0.0, modulus: 0.0, slack: true, history: now };
        }
        let (flow, slope) = self.flow(elastic.abs(), accumulated);
        if flow == 0.0 {
            return Stress { stress: elastic, modulus: self.modulus, slack: false, history: now };
        }
        let stress = elastic - elastic.signum() * self.modulus * flow;
        let hardens = |hardening: f64| self.modulus * hardening / (self.modulus + hardening);
        let modulus = slope.map_or(self.modulus, hardens);
        let history = [plastic + elastic.signum() * flow, accumulated + flow, 0.0, lost];
        Stress { stress, modulus, slack: false, history }
    }

    /// The same `1 / rate` [s] after `history`: backward Euler in what flows. `rate` 0: as slowly as it may be.
    pub fn stress_at(&self, rate: f64, strain: f64, history: &[f64]) -> Stress {
        let slow = self.stress(strain, history);
        let (accumulated, most) = (history[1], slow.history[1] - history[1]);
        if self.speeds.is_empty() || rate == 0.0 || most <= 0.0 {
            return slow;
        }
        let elastic = self.trial(strain, history);
        let bears = |flow: f64| self.yield_stress(accumulated + flow) * self.factor(flow * rate).0;
        let (mut low, mut high) = (0.0, most);
        for _ in 0..BISECTIONS {
            let flow = 0.5 * (low + high);
            let flows_on = elastic.abs() - self.modulus * flow > bears(flow);
            *(if flows_on { &mut low } else { &mut high }) = flow;
        }
        let flow = high;
        let stress = elastic - elastic.signum() * self.modulus * flow;
        let (_, by_speed) = self.factor(flow * rate);
        // What the hardening adds to that is small beside it.
        let hardens = self.yield_stress(accumulated + flow) * by_speed * rate;
        let modulus = self.modulus * hardens / (self.modulus + hardens);
        let beyond = (stress.abs() - self.yield_stress(accumulated + flow)).max(0.0) * flow;
        let [plastic, _, broken, lost] = [history[0], history[1], history[2], history[3]];
        let history = [plastic + elastic.signum() * flow, accumulated + flow, broken, lost + beyond];
        Stress { stress, modulus, slack: false, history }
    }

    /// `g` at a speed, and its slope: straight between the rows, constant beyond.
    fn factor(&self, speed: f64) -> (f64, f64) {
        let mut from = (0.0, 1.0);
        for row in &self.speeds {
            let slope = (row.1 - from.1) / (row.0 - from.0);
            if speed < row.0 {
                return (from.1 + slope * (speed - from.0), slope);
            }
            from = *row;
        }
        (from.1, 0.0)
    }

    /// Stress at `strain`, from `history`, if nothing more flows but what no speed holds up.
    pub fn held(&self, strain: f64, history: &[f64]) -> f64 {
        let [accumulated, broken] = [history[1], history[2]];
        let elastic = self.trial(strain, history);
        let slack = broken > 0.0 || self.tension_only && elastic < 0.0;
        if self.speeds.is_empty() || slack || accumulated >= self.limit {
            return self.stress(strain, history).stress;
        }
        let most = self.yield_stress(accumulated) * self.factor(f64::INFINITY).0;
        elastic.clamp(-most, most)
    }

    /// Plastic strain from the trial stress of `size`, and the slope of the table there; `None` where
    /// the travel has come to its end.
    fn flow(&self, size: f64, accumulated: f64) -> (f64, Option<f64>) {
        if self.hardening.is_empty() || size <= self.yield_stress(accumulated) {
            return (0.0, Some(0.0));
        }
        let next = self.hardening.partition_point(|(a, _)| *a <= accumulated);
        let mut from = (accumulated, self.yield_stress(accumulated));
        for row in self.hardening[next..].iter().copied().chain([(f64::INFINITY, 0.0)]) {
            let slope = if row.0.is_finite() { (row.1 - from.1) / (row.0 - from.0) } else { 0.0 };
            // |S| - E (a - a_0) = Y + H (a - a_row)
            let excess = size - self.modulus * (from.0 - accumulated) - from.1;
            let end = from.0 + excess / (self.modulus + slope);
            if end <= row.0 || !row.0.is_finite() {
                let stopped = end > self.limit;
                let flow = end.min(self.limit).max(accumulated) - accumulated;
                return (flow, (!stopped).then_some(slope));
            }
            from = row;
        }
        (0.0, Some(0.0))
    }

    /// `Y` at the accumulated plastic strain `a`.
    pub fn yield_stress(&self, a: f64) -> f64 {
        let next = self.hardening.partition_point(|(at, _)| *at <= a);
        match (next.checked_sub(1).map(|i| self.hardening[i]), self.hardening.get(next)) {
            (Some(from), Some(to)) => from.1 + (to.1 - from.1) * (a - from.0) / (to.0 - from.0),
            (Some(from), None) => from.1,
            _ => f64::INFINITY,
        }
    }

    /// Energy stored and dissipated at `strain`, from `history`.
    pub fn energy(&self, strain: f64, history: &[f64]) -> (f64, f64) {
        let (stress, accumulated) = match self.speeds.is_empty() {
            true => {
                let answer = self.stress(strain, history);
                (answer.stress, answer.history[1])
            }
            false => (self.held(strain, history), history[1]),
        };
        let dissipated = history[3] + self.plastic_work(accumulated);
        let stored = if history[2] > 0.0 { 0.0 } else { stress * stress / (2.0 * self.modulus) };
        (stored, dissipated)
    }

    /// Mark `history` as broken at `strain`: what was stored is lost.
    pub fn break_off(&self, strain: f64, history: &mut [f64]) {
        let (stored, _) = self.energy(strain, history);
        history[2] = 1.0;
        history[3] += stored;
    }

    /// `int_0^a Y`.
    fn plastic_work(&self, a: f64) -> f64 {
        let mut work = 0.0;
        for pair in self.hardening.windows(2) {
            let to = a.min(pair[1].0);
            if to <= pair[0].0 {
                return work;
            }
            let end = pair[0].1 + (pair[1].1 - pair[0].1) * (to - pair[0].0) / (pair[1].0 - pair[0].0);
            work += 0.5 * (pair[0].1 + end) * (to - pair[0].0);
        }
        self.hardening.last().map_or(0.0, |last| work + last.1 * (a - last.0).max(0.0))
    }
}

/// Limits at which something breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rupture {
    /// Axial force [N]; infinite = never.
    pub force: f64,
    /// Strain, of the measure of the element; infinite = never.
    pub strain: f64,
}

impl Rupture {
    /// Never.
    pub const NEVER: Self = Self { force: f64::INFINITY, strain: f64::INFINITY };

    /// Whether it breaks under `force` at `strain`.
    pub fn at(&self, force: f64, strain: f64) -> bool {
        force > self.force || strain > self.strain
    }

    /// The larger of both over its limit; 0 where there is none.
    pub fn share(&self, force: f64, strain: f64) -> f64 {
        (force / self.force).max(strain / self.strain).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// V-F12: N_y = 50 kN, k = 5e6 N/m, H = 1e5 N/m.
    fn brake() -> Law {
        let (k, h) = (5e6, 1e5);
        Law { hardening: vec![(0.0, 5e4), (1.0, 5e4 + h)], ..Law::elastic(k, 0.0, true) }
    }

    #[test]
    fn a_brake_yields_hardens_and_unloads_as_it_should() {
        // The numbers are printed to 8 to 10 digits.
        let law = brake();
        let loaded = law.stress(0.02, &[0.0; HISTORY]);
        assert!((loaded.stress / 50980.392157 - 1.0).abs() < 1e-11, "{}", loaded.stress);
        assert!((loaded.modulus / (5e6 * 1e5 / 5.1e6) - 1.0).abs() < 1e-14);
        let (_, dissipated) = law.energy(0.02, &[0.0; HISTORY]);
        assert!((dissipated / 495.0019 - 1.0).abs() < 1e-7, "{dissipated}");
        let unloaded = law.stress(0.009803921569, &loaded.history);
        assert!(unloaded.stress.abs() < 1e-5, "{}", unloaded.stress);
        assert!(law.stress(0.0, &loaded.history).slack);
    }

    #[test]
    fn a_brake_drawn_fast_bears_more_and_dissipates_what_is_put_in() {
        let law = Law { speeds: vec![(5.0, 1.2), (10.0, 1.3)], ..brake() };
        for (speed, factor) in [(2.5, 1.1), (5.0, 1.2), (8.0, 1.26), (20.0, 1.3)] {
            let h = 1e-5;
            let (mut history, mut e, mut work) = ([0.0; HISTORY], 0.0, 0.0);
            while history[1] < 0.5 {
                e += h * speed;
                let now = law.stress_at(1.0 / h, e, &history);
                work += now.stress * h * speed;
                history = now.history;
            }
            let now = law.stress_at(1.0 / h, e + h * speed, &history);
            let bears = factor * law.yield_stress(now.history[1]);
            // It hardens while it flows, by a fiftieth of its stiffness: so much slower it flows.
            assert!((now.stress / bears - 1.0).abs() < 5e-3, "{speed} m/s: {} for {bears}", now.stress);
            let (stored, dissipated) = law.energy(e, &history);
            assert!(
                ((stored + dissipated) / work - 1.0).abs() < 1e-3,
                "{speed} m/s: {stored} {dissipated} {work}"
            );
            let at = |e: f64| law.stress_at(1.0 / h, e, &history).stress;
            let (step, place) = (1e-7, e + 0.8 * h * speed);
            let slope = (at(place + step) - at(place - step)) / (2.0 * step);
            let stated = law.stress_at(1.0 / h, place, &history).modulus;
            assert!((slope - stated).abs() < 0.03 * law.modulus, "{speed} m/s: {slope}, {stated}");
        }
        assert_eq!(law.stress_at(0.0, 0.02, &[0.0; HISTORY]), brake().stress(0.02, &[0.0; HISTORY]));
    }

    #[test]
    fn one_step_over_several_rows_ends_where_many_small_ones_do() {
        let law = Law {
            hardening: vec![(0.0, 1.0), (0.1, 2.0), (0.15, 2.1), (0.4, 5.0)],
            limit: 0.3,
            ..Law::elastic(20.0, 0.0, false)
        };
        for end in [0.12, 0.25, 0.3, 0.45, 0.8] {
            let at_once = law.stress(end, &[0.0; HISTORY]);
            let mut history = [0.0; HISTORY];
            let mut work = 0.0;
            let (steps, mut before) = (2000, 0.0);
            for step in 1..=steps {
                let now = law.stress(end * f64::from(step) / f64::from(steps), &history);
                work += 0.5 * (before + now.stress) * end / f64::from(steps);
                (history, before) = (now.history, now.stress);
            }
            assert!(
                (at_once.stress - before).abs() < 1e-12 && (at_once.history[1] - history[1]).abs() < 1e-12
            );
            let (stored, dissipated) = law.energy(end, &[0.0; HISTORY]);
            // The trapezoidal rule errs in the four steps with a kink, by E (end / steps)^2 / 8 each.
            assert!((stored + dissipated - work).abs() < 4.0 * 20.0 * (end / 2000.0_f64).powi(2), "{end}");
            assert!(at_once.history[1] <= 0.3 + 1e-15);
        }
    }

    #[test]
    fn what_breaks_loses_what_it_had_stored_and_carries_nothing_more() {
        let law = brake();
        let mut history = law.stress(0.02, &[0.0; HISTORY]).history;
        let (stored, dissipated) = law.energy(0.02, &history);
        law.break_off(0.02, &mut history);
        assert_eq!(law.energy(0.03, &history), (0.0, stored + dissipated));
        assert_eq!(law.stress(0.03, &history).stress, 0.0);
    }
}
