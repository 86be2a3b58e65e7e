//! A scene before its start: who takes part, what each program says of it, and what was chosen where it leaves something open.

use crate::choice::{self, Chosen};
use crate::events::Events;
use crate::ground::Ground;
use crate::kind;
use crate::numbers::Numbers;
use crate::plan::{Part, Plan};
use crate::record;
use crate::stop::Stop;
use crate::validate::validate;
use interface_defs::diagnostic::{Diagnostic, Severity};
use std::path::PathBuf;
use toml::Table;
use toolkit::arguments::Input;
use toolkit::check::CheckReport;
use toolkit::limits::Limits;
use toolkit::output::Output;
use toolkit::scene::Scene;

/// A scene that could be started.
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// Who takes part.
    pub plan: Plan,
    /// Heights that were made for it; they last as long as this.
    pub ground: Ground,
    /// What the programs say, with what was chosen.
    pub reports: Vec<(Part, CheckReport)>,
    /// What was chosen.
    pub chosen: Vec<Chosen>,
    /// The programs' numbers.
    pub numbers: Numbers,
}

impl Prepared {
    /// The scene of `input`; `home` is the directory of its results, if it is to have one. Nothing is started where it is refused.
    pub fn of(
        input: &Input,
        home: impl FnOnce(&Scene) -> Option<PathBuf>,
        events: &Events,
    ) -> Result<Self, Stop> {
        let (scene, plan) = kind::load(input)?;
        let ground = Ground::of(&scene, &plan, input, home(&scene).as_deref(), events)?;
        let mut reports = validate(&plan, ground.input(), events)?;
        let chosen = choice::complete(&scene, &plan, &mut reports)?;
        let numbers = Numbers::of(&reports, scene.end_time()?);
        Ok(Self { scene, plan, ground, reports, chosen, numbers })
    }

    /// The scene with every default and every choice filled in.
    pub fn resolved(&self) -> Result<Table, Diagnostic> {
        record::resolved(&self.scene, &self.plan, &self.reports)
    }

    /// What was chosen that a scene could name.
    pub fn choices(&self) -> impl Iterator<Item = &Chosen> {
        self.chosen.iter().filter(|choice| choice.is_of_scene())
    }

    /// What a program says.
    pub fn report(&self, part: Part) -> Option<&CheckReport> {
        self.reports.iter().find(|(of, _)| *of == part).map(|(_, report)| report)
    }

    /// What the user should know before the start, each once, with its place in the scene where it is about a key.
    ///
    /// An error: the run would take for ever.
    pub fn warnings(&self) -> Result<Vec<Diagnostic>, Diagnostic> {
        Ok(self.doubts()?.into_iter().map(|warning| self.scene.placed(warning)).collect())
    }

    /// The same without places.
    pub fn doubts(&self) -> Result<Vec<Diagnostic>, Diagnostic> {
        let of_cost = self.numbers.of_cost();
        if let Some(refused) = of_cost.clone().filter(|found| found.severity == Severity::Error) {
            return Err(self.scene.placed(refused));
        }
        let of_programs = self.reports.iter().flat_map(|(_, report)| report.warnings.iter().cloned());
        let of_tables = Output::warnings(&self.scene)?.into_iter().chain(Limits::of(&self.scene)?.warnings());
        let mut all: Vec<Diagnostic> = Vec::new();
        for warning in of_programs.chain(self.numbers.of_window()).chain(of_cost).chain(of_tables) {
            if !all.contains(&warning) {
                all.push(warning);
            }
        }
        Ok(all)
    }
}
