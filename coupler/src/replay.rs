//! Replay: one solver is asked again what a recording says that it was asked, and its answers are compared.

use interface_defs::ipc::remote::Remote;
use interface_defs::{
    Diagnostic, Failure, FieldSpec, Gauge, Hello, InterfaceMesh, Layout, Participant, Plan, Ready, Request,
    Status, code,
};
use serde::Serialize;
use std::fmt::Write;
use std::ops::Range;
use toolkit::recording::{Entry, Exchange, Reader};

/// What has come of a replay.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Part of the solver in the run, its program, and that of the recording.
    pub solver: String,
    /// See `solver`.
    pub program: String,
    /// See `solver`.
    pub recorded: String,
    /// Exchanges that were compared, and how many of their answers were equal to the byte.
    pub exchanges: u64,
    /// See `exchanges`.
    pub equal: u64,
    /// Bound of a difference, as a share of the largest number of its field so far.
    pub tolerance: f64,
    /// For each field and gauge its largest difference.
    pub fields: Vec<Compared>,
    /// The first answer that differs by more than the bound.
    pub first: Option<Difference>,
    /// Whether the recording ends before its run did.
    pub cut: bool,
}

/// A field or a gauge of all answers.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Compared {
    /// Its name.
    pub name: String,
    /// Largest number so far, and largest difference, as a share of it.
    pub largest: f64,
    /// See `largest`.
    pub difference: f64,
}

/// Where an answer differs.
#[derive(Debug, Clone, Serialize)]
pub struct Difference {
    /// Number of the exchange with this solver, from 1.
    pub exchange: u64,
    /// Window, and iteration in it.
    pub window: u64,
    /// See `window`.
    pub iteration: u32,
    /// Start of the window [s].
    pub time: f64,
    /// What differs, with both numbers.
    pub what: String,
}

impl Report {
    /// In words.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{} exchanges with {} ({}), recorded with {}: {} answers are equal to the byte\n",
            self.exchanges, self.solver, self.program, self.recorded, self.equal
        );
        for Compared { name, largest, difference } in self.fields.iter().filter(|f| f.difference > 0.0) {
            let _ = writeln!(
                text,
                "  {name}: differs by up to {difference:.1e} of its largest number, {largest:.4e}"
            );
        }
        if self.cut {
            text += "the recording ends before its run did\n";
        }
        match &self.first {
            None => text += "no answer differs by more than the bound\n",
            Some(Difference { exchange, window, iteration, time, what }) => {
                let _ = writeln!(
                    text,
                    "exchange {exchange} differs first: window {window} at t = {time:.6} s, iteration {iteration}: {what}"
                );
            }
        }
        text
    }
}

/// Where a mesh is another one than `before`, places and masses to `tolerance`, a share of the largest of them. Groups have no part in
/// what crosses, and masses none where one of the two does not know them.
fn other_mesh(own: &InterfaceMesh, before: &InterfaceMesh, tolerance: f64) -> Option<String> {
    let counts = |mesh: &InterfaceMesh| (mesh.node_count(), mesh.lines.len(), mesh.faces.len());
    let (new, old) = (counts(own), counts(before));
    if old != new {
        return Some(format!("its mesh has {new:?} nodes, lines and faces, recorded {old:?}"));
    }
    if (&own.lines, &own.faces) != (&before.lines, &before.faces) {
        return Some("its mesh has the same number of lines and faces, between other nodes".into());
    }
    let finite = |x: &&f64| x.is_finite();
    let apart = |a: &[f64], b: &[f64]| {
        let most = b.iter().filter(finite).fold(0.0, |most: f64, b| most.max(b.abs()));
        a.iter().zip(b).position(|(a, b)| a != b && ((a - b).abs() > tolerance * most || (a - b).is_nan()))
    };
    if let Some(at) = apart(&own.coordinates, &before.coordinates) {
        let (axis, x, x0) = (["x", "y", "z"][at % 3], own.coordinates[at], before.coordinates[at]);
        return Some(format!("node {} of its mesh has {axis} = {x:e} m, recorded {x0:e} m", at / 3));
    }
    let known = !own.masses.is_empty() && !before.masses.is_empty();
    let at = apart(&own.masses, &before.masses).filter(|_| known)?;
    Some(format!("node {at} of its mesh has {:e} kg, recorded {:e} kg", own.masses[at], before.masses[at]))
}

/// The solver while it is asked.
struct Replay<'a> {
    remote: &'a mut Remote,
    report: Report,
    hello: Hello,
    layout: Layout,
    /// Its gauges, and those of the recording.
    gauges: [Vec<Gauge>; 2],
}

/// Ask `remote` what `recording` says, and compare the answers to `tolerance`, which is a share of the largest number of a field so far.
pub fn replay(remote: &mut Remote, recording: &mut Reader, tolerance: f64) -> Result<Report, Failure> {
    let solver = remote.name().to_string();
    let report = Report { solver: solver.clone(), tolerance, ..Report::default() };
    let (layout, gauges) = (Layout::default(), Default::default());
    let mut it = Replay { remote, report, hello: Hello::default(), layout, gauges };
    let unread = |why: Diagnostic| Failure::Fault { solver: "the recording".into(), fault: why.into() };
    while let Some(entry) = recording.next_entry().map_err(unread)? {
        match entry {
            Entry::Hello(of, hello) if of == solver => {
                it.hello = it.remote.hello()?;
                it.report.program.clone_from(&it.hello.program);
                it.report.recorded = hello.program;
            }
            Entry::Prepare(of, both) if of == solver => {
                let (plan, ready) = *both;
                it.prepare(&plan, ready)?;
            }
            Entry::Exchange(exchange) if exchange.solver == solver => it.exchange(&exchange)?,
            Entry::Finish(of, commit, _) if of == solver => {
                it.remote.finish(commit)?;
                return Ok(it.report);
            }
            _ => {}
        }
        if it.report.first.as_ref().is_some_and(|first| first.exchange == 0) {
            break;
        }
    }
    it.report.cut = recording.cut || it.report.first.is_none();
    it.remote.abort("the replay ends here");
    Ok(it.report)
}

impl Replay<'_> {
    fn prepare(&mut self, plan: &Plan, before: Ready) -> Result<(), Failure> {
        let Hello { program, takes, gives, .. } = &self.hello;
        let is = |a: &FieldSpec, b: &FieldSpec| {
            (&a.name, a.components, a.place, a.sampling) == (&b.name, b.components, b.place, b.sampling)
        };
        for (asked, own, verb) in [(&plan.takes, takes, "take"), (&plan.gives, gives, "give")] {
            if let Some(field) = asked.iter().find(|field| !own.iter().any(|o| is(o, field))) {
                let what = format!(
                    "{program} does not {verb} the field `{}`, which crosses in the recording",
                    field.name
                );
                let hint = "record a run without it, as with --set coupling.yielding_net=false";
                let why = Diagnostic::error(code::CONTRADICTION, what).try_instead(hint);
                return Err(Failure::Fault { solver: self.report.solver.clone(), fault: why.into() });
            }
        }
        let ready = self.remote.prepare(plan, &mut |_| Ok(()))?;
        if let Some(what) = other_mesh(&ready.mesh, &before.mesh, self.report.tolerance) {
            self.differ(None, what);
        }
        self.gauges = [ready.gauges, before.gauges];
        self.layout = Layout::new(&plan.gives, &ready.mesh, 0);
        Ok(())
    }

    fn exchange(&mut self, recorded: &Exchange) -> Result<(), Failure> {
        self.report.exchanges += 1;
        let [own, before] = self.gauges.each_ref().map(|gauges| 3 * gauges.len());
        let request = recorded.request();
        let expects = request.expects.map(|n| n.saturating_sub(before) + own);
        self.remote
            .send(Request { expects, ..request }, &mut |payload| payload.copy_from_slice(&recorded.sent))?;
        let status = self.remote.receive()?;
        let good = |status| matches!(status, Some(Status::Done | Status::Rest));
        let was = Status::from_number(recorded.status);
        if status == Status::Failed {
            let fault = self.remote.explain()?;
            if was != Some(status) {
                self.differ(Some(recorded), format!("the window failed: {fault}"));
            }
            return Ok(());
        }
        if was != Some(status) && !(good(was) && good(Some(status))) {
            self.differ(
                Some(recorded),
                format!("its status is {}, recorded {}", status as u32, recorded.status),
            );
            return Ok(());
        }
        let answer = self.remote.answer().to_vec();
        let listed = self.remote.listed();
        if (listed, answer.len() - own) != (recorded.listed as usize, recorded.answer.len() - before) {
            let what = format!(
                "{} numbers, {listed} of them a list, recorded {} and {}",
                answer.len() - own,
                recorded.answer.len() - before,
                recorded.listed
            );
            self.differ(Some(recorded), what);
            return Ok(());
        }
        let fields = answer.len() - listed - own;
        let mut equal = true;
        for (name, range) in self.blocks(fields, recorded) {
            let (new, old) = (&answer[range.clone()], &recorded.answer[range]);
            equal &= self.compare(recorded, &name, new, old);
        }
        let [gauges, others] = self.gauges.clone();
        for (at, gauge) in gauges.iter().enumerate() {
            // Of a program of another make the gauges are others.
            let Some(other) = others.iter().position(|o| o.name == gauge.name) else { continue };
            // Least and largest of a window follow from a solver's own steps, which may be others where a bound is given.
            let count = if self.report.tolerance > 0.0 { 1 } else { 3 };
            let of = |payload: &[f64], at: usize| payload[fields + 3 * at..fields + 3 * at + count].to_vec();
            equal &= self.compare(recorded, &gauge.name, &of(&answer, at), &of(&recorded.answer, other));
        }
        equal &= self.compare(
            recorded,
            "list",
            &answer[answer.len() - listed..],
            &recorded.answer[recorded.answer.len() - listed..],
        );
        self.report.equal += u64::from(equal);
        Ok(())
    }

    /// Name and place of each field in an answer with `fields` numbers of fields.
    fn blocks(&self, fields: usize, exchange: &Exchange) -> Vec<(String, Range<usize>)> {
        if exchange.selection.0 != 0 || fields != self.layout.len() {
            return vec![("fields".into(), 0..fields)];
        }
        let mut at = 0;
        let of = |field: &FieldSpec| {
            let samples = (0..).map_while(|k| self.layout.sample(&field.name, field.sampling, k));
            let length = samples.take(field.sample_count()).map(|sample| sample.len()).sum::<usize>();
            at += length;
            (field.name.clone(), at - length..at)
        };
        self.layout.fields().map(of).collect()
    }

    /// Compare the numbers `new` of a field with `old`; true if they are equal to the byte.
    fn compare(&mut self, exchange: &Exchange, name: &str, new: &[f64], old: &[f64]) -> bool {
        if old.is_empty() {
            return true;
        }
        let known = self.report.fields.iter().position(|f| f.name == name);
        let at = known.unwrap_or_else(|| {
            self.report.fields.push(Compared { name: name.into(), ..Compared::default() });
            self.report.fields.len() - 1
        });
        let field = &mut self.report.fields[at];
        field.largest = old.iter().map(|v| v.abs()).fold(field.largest, f64::max);
        let mut worst = None;
        for (place, (a, b)) in
            new.iter().zip(old).enumerate().filter(|(_, (a, b))| a.to_bits() != b.to_bits())
        {
            let share = (a - b).abs() / field.largest;
            // Where nothing but zeros were recorded, or one of them is no number, everything else is another answer.
            let share = if share.is_nan() { f64::from(a != b) * f64::MAX } else { share };
            field.difference = field.difference.max(share);
            if share > self.report.tolerance && worst.is_none_or(|(most, _)| share > most) {
                worst = Some((share, place));
            }
        }
        if let Some((_, place)) = worst {
            let what =
                format!("number {} of {name} is {:e}, recorded {:e}", place + 1, new[place], old[place]);
            self.differ(Some(exchange), what);
        }
        new.iter().zip(old).all(|(a, b)| a.to_bits() == b.to_bits())
    }

    fn differ(&mut self, exchange: Option<&Exchange>, what: String) {
        let (window, iteration) = exchange.map_or((0, 0), |e| e.window);
        let time = exchange.map_or(0.0, |e| e.span.0);
        let found = Difference { exchange: self.report.exchanges, window, iteration, time, what };
        self.report.first.get_or_insert(found);
    }
}
