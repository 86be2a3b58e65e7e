//! `ensemble --dry-run` and `rockfall check STUDY`: what a study would compute and what that would cost; nothing is written.

use super::base::Base;
use super::settings::{Place, Variable};
use dem_rocks::DemSolver;
use dem_rocks::check::STEPS_PER_LOOK;
use dem_solid::geometry::plan;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::fmt::Write;
use std::time::Duration;
use toolkit::numbers::{four, three};
use toolkit::scene::Scene;
use toolkit::trial::Trial;

/// Members that are tried, spread over all, and how long each of them at most.
const TRIED: u64 = 8;
const LIMIT: Duration = Duration::from_millis(500);

/// Bytes on disk of a member, with maps, and at each line: as a million of them took (docs/performance.md).
const BYTES: [f64; 3] = [1230.0, 130.0, 230.0];
/// What is worth a word on disk [bytes].
const LARGE: f64 = 1e10;

/// What some members cost.
struct Cost {
    /// How many were tried, and how many of them did not come to their end.
    tried: usize,
    cut: usize,
    /// Wall time of one on the average, of those that were cut as if they moved until `end_time` [s].
    each: f64,
}

/// What a study is made of.
pub struct Preview<'a> {
    base: &'a Base,
    file: &'a Scene,
    threads: usize,
    cost: Cost,
    warnings: Vec<Diagnostic>,
}

impl<'a> Preview<'a> {
    /// Of a study that is valid, on so many threads; some of its members are tried.
    pub fn new(base: &'a Base, file: &'a Scene, threads: usize) -> Result<Self, Diagnostic> {
        let (members, settings) = (base.members(), &base.settings);
        let tried = members.min(TRIED);
        // The paths of those that were tried.
        let paths = RefCell::new(Vec::new());
        let place = |solver: &DemSolver| solver.state().bodies[0].motion.position;
        let fall = |at: u64| {
            let model = base.model(&base.member(1 + at * members / tried), None)?;
            let mut solver = DemSolver::of_model(model, &base.scene, base.follows());
            let mut path = vec![place(&solver)];
            let times = [settings.end_time, settings.interval, STEPS_PER_LOOK * solver.model().steps.step];
            let passed = RefCell::new(&mut path);
            let trial = Trial::new(&mut solver, times, LIMIT, |solver| {
                passed.borrow_mut().push(place(solver));
                false
            });
            paths.borrow_mut().push(path);
            trial.map_err(|fault| *fault.diagnostic)
        };
        // One that cannot be computed is a row with its reason, and costs little.
        let trials: Vec<Trial> = (0..tried).filter_map(|at| fall(at).ok()).collect();
        let each = trials.iter().map(|trial| trial.cost(settings.end_time)).sum::<f64>();
        let cut = trials.iter().filter(|trial| !trial.ended).count();
        let cost = Cost { tried: trials.len(), cut, each: each / trials.len() as f64 };
        let warnings = base.warnings.iter().map(|warning| base.scene.placed(warning.clone())).collect();
        let mut preview = Self { base, file, threads, cost, warnings };
        preview.warnings.extend(beside(base, file, &paths.into_inner()));
        let (days, disk) = (preview.whole() / 86_400.0, preview.disk());
        if days > 1.0 || disk > LARGE {
            let [days, disk] = [days, disk / 1e9].map(three);
            let what = format!(
                "the study would take some {days} days of wall time on this machine and {disk} GB of disk"
            );
            let cure = "fewer members show first what matters; `--chunks` divides the study between machines";
            let found = Diagnostic::warning(code::SIZE, what).about("release.0.count").try_instead(cure);
            preview.warnings.push(file.placed(found));
        }
        Ok(preview)
    }

    /// Wall time of all members [s].
    fn whole(&self) -> f64 {
        self.cost.each * self.base.members() as f64 / self.threads as f64
    }

    /// What its files take on disk [bytes].
    fn disk(&self) -> f64 {
        let (study, [each, mapped, line]) = (&self.base.study, BYTES);
        let mapped = if self.base.grid.is_some() { mapped } else { 0.0 };
        self.base.members() as f64 * (each + mapped + line * study.lines.len() as f64)
    }

    /// For people.
    pub fn text(&self) -> String {
        let Self { base, cost, .. } = self;
        let (study, end) = (&base.study, three(base.settings.end_time));
        let (file, scene, members) =
            (self.file.path().display(), base.scene.path().display(), base.members());
        let mut text =
            format!("{file}: {members} members of {scene}, each until it rests or {end} s have passed\n\n");
        let _ = writeln!(text, "{}\n", base.ground.describe());
        let mut line = |name: &str, what: String| {
            let _ = writeln!(text, "{name:<28} {what}");
        };
        let sampling = word(&study.sampling);
        line(
            "members",
            format!("{members}, {sampling}, seed {}, replicates {}", study.seed, study.replicates),
        );
        for (at, (release, count)) in study.releases.iter().zip(study.counts()).enumerate() {
            let Place { key, corners, .. } = release.place();
            let places = match key {
                "polygon" => format!("in {} m2", three(plan::area(corners))),
                "line" => format!("along {} m", three(plan::length(corners))),
                _ => format!("at {} points", corners.len()),
            };
            let height = match release.height {
                0.0 => "on the ground".into(),
                height => format!("{} m above it", three(height)),
            };
            let rate = release.blocks_per_year.map(|rate| format!(", {} blocks a year", three(rate)));
            let rate = rate.unwrap_or_default();
            line(&format!("release `{}`", release.name), format!("{count} {places}, {height}{rate}"));
            let own = study.variables[at].iter().filter(|_| study.variants().contains(&at));
            own.for_each(|variable| line(&format!("  {}", variable.name), spread(variable)));
        }
        for (own, local) in study.lines.iter().zip(&base.lines) {
            let barrier = own
                .barrier
                .map(|of| format!(", a barrier of {} kJ, {} m high", four(of.energy / 1e3), four(of.height)));
            let design = own.design.as_ref().map_or("", |_| ", a design");
            let length = three(plan::length(local));
            line(
                &format!("line `{}`", own.name),
                format!("{length} m{}{design}", barrier.unwrap_or_default()),
            );
        }
        if let Some(grid) = &base.grid {
            let [columns, rows] = grid.counts;
            line("maps", format!("{columns} x {rows} cells of {} m", four(grid.cell)));
        }
        let (tried, each, threads) = (cost.tried, three(cost.each), self.threads);
        let cut = match cost.cut {
            0 => String::new(),
            cut => format!("; at most: {cut} of them had not ended in the time that they were tried"),
        };
        line(
            "expected cost",
            format!(
                "{} s of wall time on {threads} threads: {each} s a member, as {tried} of them took{cut}",
                three(self.whole())
            ),
        );
        line("disk", format!("some {} MB", three(self.disk() / 1e6)));
        for warning in &self.warnings {
            let _ = writeln!(text, "warning: {warning}");
        }
        text
    }

    /// The same as data.
    pub fn json(&self) -> Value {
        let Self { base, file, threads, cost, warnings } = self;
        let study = &base.study;
        let releases = study.releases.iter().zip(study.counts()).map(|(release, count)| {
            json!({ "name": release.name, "members": count, "blocks_per_year": release.blocks_per_year })
        });
        let lines = study.lines.iter().zip(&base.lines).map(|(own, local)| {
            let barrier = own.barrier.map(|of| json!({ "energy_J": of.energy, "height_m": of.height }));
            json!({ "name": own.name, "length_m": plan::length(local), "barrier": barrier, "design": own.design.is_some() })
        });
        json!({
            "study": file.name(), "scene": base.scene.name(), "end_time_s": base.settings.end_time,
            "members": base.members(), "replicates": study.replicates, "seed": study.seed, "sampling": word(&study.sampling),
            "releases": releases.collect::<Vec<_>>(), "lines": lines.collect::<Vec<_>>(),
            "cells": base.grid.as_ref().map(|grid| grid.counts), "threads": threads,
            "members_tried": cost.tried, "members_cut": cost.cut,
            "seconds_per_member": Some(cost.each).filter(|each| each.is_finite()),
            "expected_cost_s": Some(self.whole()).filter(|cost| cost.is_finite()),
            "expected_disk_bytes": self.disk(), "warnings": warnings,
        })
    }
}

/// Lines that most of the members tried leave above them, and none passes.
fn beside(base: &Base, file: &Scene, paths: &[Vec<Vector3<f64>>]) -> Vec<Diagnostic> {
    let of_line = |(at, line): (usize, &Vec<plan::Point>)| {
        let lowest = line.iter().filter_map(|p| base.ground.ground_at(*p)).fold(f64::INFINITY, f64::min);
        let passes = |path: &Vec<Vector3<f64>>| {
            let mut steps = path.windows(2).map(|step| [0, 1].map(|k| [step[k].x, step[k].y]));
            steps.any(|step| line.windows(2).any(|own| plan::cross(&[own[0], own[1]], &step)))
        };
        let below = paths.iter().filter(|path| path.last().is_some_and(|end| end.z < lowest)).count();
        (2 * below > paths.len() && !paths.iter().any(passes)).then(|| {
            let (name, all) = (&base.study.lines[at].name, paths.len());
            let what = format!(
                "none of {all} members that were tried passes the line `{name}`, and {below} of them end lower than it lies: they pass beside it"
            );
            let found = Diagnostic::warning(code::PLACE, what).about(format!("line.{at}.points"));
            file.placed(found.try_instead("is it where rocks go? trajectory.svg of a member shows its path"))
        })
    };
    base.lines.iter().enumerate().filter_map(of_line).collect()
}

/// How it is written in a study.
fn word(value: &impl serde::Serialize) -> String {
    json!(value).as_str().unwrap_or_default().to_owned()
}

/// Between which values it lies.
fn spread(variable: &Variable) -> String {
    match (variable.distribution.range(), variable.distribution.values()) {
        (Some([low, high]), _) if low == high => four(low),
        (Some([low, high]), None) => format!("{} to {}", four(low), four(high)),
        (Some([low, high]), Some(all)) => {
            format!("{} values from {} to {}", all.len(), four(low), four(high))
        }
        (None, all) => format!("{} values", all.map_or(0, <[_]>::len)),
    }
}
