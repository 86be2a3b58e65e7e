//! Before the first run: the scene is checked as for a run, and its knobs are found.

use super::Arguments;
use super::knobs::{self, Base};
use super::point::Space;
use super::report::{Facts, quoted};
use super::store::Identity;
use crate::events::Events;
use crate::numbers::Numbers;
use crate::prepared::Prepared;
use crate::record;
use crate::stop::Stop;
use crate::sweep;
use interface_defs::diagnostic::code;
use std::path::{Path, PathBuf};
use toolkit::arguments::Input;
use toolkit::provenance;

/// What a study starts from.
pub struct Setup {
    /// Its knobs.
    pub space: Space,
    /// Directory of the study.
    pub out: PathBuf,
    /// What the study is of.
    pub identity: Identity,
    /// Set in every run: what costs time and is not measured.
    pub always: Vec<String>,
    /// For the page.
    pub facts: Facts,
}

impl Setup {
    /// Of a scene. Nothing has run yet where it is refused.
    pub fn of(arguments: &Arguments, events: &Events) -> Result<Self, Stop> {
        let input = &arguments.input;
        let prepared = Prepared::of(input, |_| None, events)?;
        let mut resolved = prepared.resolved()?;
        prepared.ground.forget(&mut resolved);
        let Prepared { scene, plan, numbers, .. } = &prepared;
        let end_time = numbers.end_time;
        let steps = [("dem.time_step", numbers.contact.step), ("fem.time_step", numbers.net.step)];
        let in_use: Vec<_> = steps.iter().filter_map(|(key, step)| Some((*key, (*step)?))).collect();
        let document = scene.document()?;
        let chosen = prepared.choices().map(|choice| format!("{}.{}", choice.key.0, choice.key.1));
        let unnamed = steps.iter().filter(|(key, _)| knobs::at(&document, key).is_none());
        let open = chosen.chain(unnamed.map(|(key, _)| (*key).to_owned())).collect();
        let mut knobs = knobs::of(&Base { resolved: &resolved, in_use: &in_use });
        knobs::turn_only(&mut knobs, &arguments.knobs)?;
        let space = Space { knobs, open };
        let fault = |e: std::io::Error| {
            let what = format!("{}: an input file cannot be read: {e}", scene.path().display());
            Stop::input(code::FILE, what)
        };
        let foreign = plan.members.iter().filter(|member| member.foreign).map(|member| &member.program);
        let hash = |program: &PathBuf| (program.display().to_string(), provenance::program(program).ok());
        let identity = Identity {
            scene: scene.fingerprint(),
            inputs: record::hashes(scene, &resolved).map_err(fault)?,
            build: sweep::build().clone(),
            foreign: foreign.map(hash).collect(),
        };
        let out =
            arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}-trade", scene.name())));
        // Field files cost time and disk, and no measure comes from them.
        let fields = knobs::at(&document, "output.fields")
            .map(|_| format!("output.fields={}", knobs::float(end_time)));
        let sets = input.sets.iter().fold(String::new(), |all, set| all + " --set " + &quoted(set));
        let facts = Facts {
            scene: scene.name(),
            command: quoted(&input.scene.display().to_string()) + &sets,
            end_time,
            budget: arguments.budget,
            processors: std::thread::available_parallelism().map_or(1, usize::from),
        };
        Ok(Self { space, out, identity, always: fields.into_iter().collect(), facts })
    }
}

/// Numbers of the programs for the scene with these `--set`s besides; `None` if it is refused so.
pub fn numbers(input: &Input, sets: &[String], events: &Events) -> Option<Numbers> {
    let mut input = input.clone();
    input.sets.extend_from_slice(sets);
    Some(Prepared::of(&input, |_| None, events).ok()?.numbers)
}
