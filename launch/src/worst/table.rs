//! What the barrier did to all chosen members: a row for each, counts, envelopes; and where in the user's file that stands which is
//! wrong in the scene of a member, most of which is the barrier's own.

use crate::front::stop::Stop;
use crate::run::sweep::{self, Ran};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Measure, Worse};
use interface_defs::verdict::Fate;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::history::column;
use toolkit::numbers::short;
use toolkit::scene::{Scene, at};
use toolkit::summary::{RunStatus, Summary};
use toolkit::{files, input_file};

/// One row for each member.
pub const VERDICTS: &str = "verdicts.csv";
/// Most members that a warning names.
const NAMED: usize = 5;

/// All measures, in the order in which they are first found.
fn measures<'a>(cases: &[&'a Case]) -> Vec<&'a Measure> {
    let mut found: Vec<&Measure> = Vec::new();
    let summaries = cases.iter().filter_map(|case| case.summary.as_ref());
    for measure in summaries.flat_map(|summary| &summary.measures) {
        if !found.iter().any(|known| known.name == measure.name) {
            found.push(measure);
        }
    }
    found
}

/// Write the rows.
pub fn write_rows(keys: &[String], cases: &[Case], dir: &Path) -> io::Result<()> {
    let cases: Vec<&Case> = cases.iter().collect();
    let mut table: Columns<&Case> = Columns::new();
    for key in keys {
        table = table.text(key, move |case: &&Case| match &case.entry[key] {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            number => number.to_string(),
        });
    }
    table = table
        .with("fate", |case| case.fate().map_or("", Fate::name).into())
        .with("status", |case| case.status.word().into());
    for measure in measures(&cases) {
        table = table
            .number(column(&measure.name, &measure.unit), move |case: &&Case| case.measure(&measure.name));
    }
    let table = table
        .text("sentence", |case| case.sentence().unwrap_or_default())
        .text("message", |case| case.notes())
        .csv(&cases)?;
    files::write(&dir.join(VERDICTS), table.as_bytes())
}

/// What the runs warn of, each kind once with the members of which it is said: the same words, or the same code and key where no run
/// says that more than once. Where the words differ, those of the first are said to be its own.
fn warnings(cases: &[Case]) -> Vec<Diagnostic> {
    let alike = |a: &Diagnostic, b: &Diagnostic| a.code == b.code && a.key == b.key;
    let is_once = |one: &Diagnostic| {
        cases.iter().all(|case| case.warnings.iter().filter(|other| alike(one, other)).count() < 2)
    };
    let mut found: Vec<(&Diagnostic, Vec<u64>, bool)> = Vec::new();
    for (case, warning) in cases.iter().flat_map(|case| case.warnings.iter().map(move |w| (case, w))) {
        let same = |(first, ..): &&mut (&Diagnostic, Vec<u64>, bool)| {
            *first == warning || (alike(first, warning) && is_once(warning))
        };
        match found.iter_mut().find(same) {
            Some((first, members, differ)) => {
                *differ |= *first != warning;
                if members.last() != Some(&case.member()) {
                    members.push(case.member());
                }
            }
            None => found.push((warning, vec![case.member()], false)),
        }
    }
    let said = |(first, members, differ): (&Diagnostic, Vec<u64>, bool)| {
        let of = format!("{} of {} members: {}", members.len(), cases.len(), listed(&members));
        let words = &first.message;
        let message = match differ {
            false => format!("{words} ({of})"),
            true => format!("member {}: {words} (likewise, each in words of its own, {of})", members[0]),
        };
        Diagnostic { message, ..first.clone() }
    };
    found.into_iter().map(said).collect()
}

fn listed(members: &[u64]) -> String {
    let names: Vec<String> = members.iter().take(NAMED).map(u64::to_string).collect();
    names.join(", ") + if members.len() > NAMED { ", ..." } else { "" }
}

/// Members of whose fate nothing can be said, and what to do.
fn undecided(cases: &[Case], barrier: &str) -> Option<Diagnostic> {
    // One that still moves has not come to the net, and may yet.
    let is_open = |case: &&Case| matches!(case.fate(), Some(Fate::Undecided | Fate::StillMoving));
    let open: Vec<u64> = cases.iter().filter(is_open).map(Case::member).collect();
    let said = || {
        let (count, all, names) = (open.len(), cases.len(), listed(&open));
        let what = format!("{count} of {all} members are not decided at the end of their runs ({names})");
        Diagnostic::warning(code::TRUST, what).try_instead(format!("raise end_time of {barrier}"))
    };
    (!open.is_empty()).then(said)
}

/// The name of the measure that counts a fate.
fn counted(fate: Fate) -> String {
    format!("members_{}", fate.name())
}

/// What became of all of them, in a sentence; `None`: the summary is of no barrier.
pub fn outcome(summary: &Summary) -> Option<String> {
    let of = |name: &str| summary.measure(name);
    let fates = Fate::ALL.into_iter().map(|fate| (of(&counted(fate)), fate.words()));
    let failed = std::iter::once((of("members_failed"), "failed"));
    let counts = fates.chain(failed).filter_map(|(count, words)| Some((count.filter(|n| *n > 0.0)?, words)));
    let words: Vec<String> = counts.map(|(n, words)| format!("{n} {words}")).collect();
    let (reach, all, words) = (of("members_at_line")?, of("members")?, words.join(", "));
    let worst = of("members_computed")? + of("members_failed")?;
    Some(format!("{reach} of {all} members reach the line; of the {worst} worst: {words}"))
}

/// Counts of fates; of every measure that is worse in one direction the worst, with its member. Members that were chosen as the
/// worst are no sample: there are no quantiles. `barrier` is the file of its scene.
pub fn summary(chosen: &Chosen, cases: &[Case], barrier: &str) -> Summary {
    let bad: Vec<&Case> = cases.iter().filter(|case| case.status != RunStatus::Done).collect();
    let mut summary = Summary::new(RunStatus::Done);
    let uncounted = cases.iter().filter(|case| case.fate().is_none()).count();
    let mut counts = vec![
        ("members".to_owned(), chosen.members),
        ("members_at_line".into(), chosen.reach),
        ("members_computed".into(), (cases.len() - uncounted) as u64),
    ];
    let count = |fate| cases.iter().filter(|case| case.fate() == Some(fate)).count() as u64;
    counts.extend(Fate::ALL.into_iter().map(|fate| (counted(fate), count(fate))));
    counts.push(("members_failed".into(), uncounted as u64));
    summary.measures = counts.into_iter().map(|(name, n)| Measure::new(name, n as f64, "1")).collect();
    let trusted: Vec<&Case> = cases.iter().filter(|case| case.status == RunStatus::Done).collect();
    for measure in measures(&trusted) {
        let values = trusted.iter().filter_map(|case| Some((case.measure(&measure.name)?, case.member())));
        let (end, worst) = match measure.worse {
            Worse::Larger => ("largest", values.max_by(|a, b| a.0.total_cmp(&b.0))),
            Worse::Smaller => ("smallest", values.min_by(|a, b| a.0.total_cmp(&b.0))),
            // A place, a direction, a time: none is the worst.
            Worse::Neither => continue,
        };
        let Some((value, member)) = worst else { continue };
        let name = format!("{}_{end}", measure.name);
        let envelope = Measure::new(name, value, &measure.unit).of_member(Some(format!("member {member}")));
        summary.measures.push(envelope.ranked(measure.rank, measure.worse));
    }
    summary.measures.iter_mut().for_each(|measure| measure.source = "rockfall".into());
    summary.warnings.extend(undecided(cases, barrier));
    summary.warnings.extend(warnings(cases));
    let wall: f64 = cases.iter().filter_map(|case| case.summary.as_ref()?.cost.get("wall_s")?.as_f64()).sum();
    summary.cost.insert("wall_s".into(), json!(wall));
    if let Some(first) = bad.first() {
        let (count, all, member, why) = (bad.len(), cases.len(), first.member(), first.reason());
        let what = format!(
            "{count} of {all} members failed or are unreliable and are left out of the envelopes; the first, member {member}: {why}"
        );
        summary.doubt(vec![Diagnostic::error(code::TRUST, what)]);
    }
    summary
}

/// What the screen shows: a row for each member, then the counts.
pub fn screen(summary: &Summary, cases: &[Case], dir: &Path) -> String {
    let of = |value: Option<f64>, unit: &str| value.map_or("-".into(), |v| format!("{} {unit}", short(v)));
    let kilo = |value: Option<f64>| value.map(|v| 1e-3 * v);
    let table = Columns::new()
        .with("member", |case: &&Case| case.member().to_string())
        .with("chosen for", |case| {
            format!("{} {}", case.entry["chosen_for"].as_str().unwrap_or_default(), case.entry["rank"])
        })
        .with("energy", |case| of(kilo(case.number("kinetic_energy_J")), "kJ"))
        .with("height", |case| of(case.number("passing_height_m"), "m"))
        .with("speed", |case| of(case.number("speed_m_per_s"), "m/s"))
        .with("fate", |case| case.fate().map_or("-", Fate::words).into())
        .with("elongation", |case| of(case.measure("max_elongation"), "m"))
        .with("reaction 1 ms", |case| of(kilo(case.measure("max_reaction_1ms")), "kN"))
        .with("status", |case| case.status.word().into());
    let rows: Vec<&Case> = cases.iter().collect();
    let outcome = outcome(summary).map_or(String::new(), |sentence| sentence + "\n");
    table.aligned(&rows) + "\n" + &outcome + &summary.table(dir)
}

/// What the rocks' program leaves: which members, and what they bring to the line.
#[derive(Debug, Deserialize)]
pub struct Chosen {
    /// Members of the study.
    pub members: u64,
    /// How many of them reach the line.
    pub reach: u64,
    /// What is known of each chosen one, in order.
    pub columns: Vec<String>,
    /// A table for each chosen one.
    pub chosen: Vec<Value>,
}

impl Chosen {
    /// Read the file.
    pub fn read(path: &Path) -> Result<Self, Stop> {
        files::read_json(path).map_err(|e| {
            let what = format!("{}: {e}; are all programs of one version?", path.display());
            Stop::failed(code::FILE_CONTENT, what)
        })
    }
}

/// A chosen member with what became of it.
#[derive(Debug)]
pub struct Case {
    /// What it brings to the line.
    pub entry: Value,
    /// How its run ended.
    pub status: RunStatus,
    /// Why it is not done.
    pub reasons: Vec<Diagnostic>,
    /// What it came to, where it was computed.
    pub summary: Option<Summary>,
    /// What its run warns of, without places in its own scene.
    pub warnings: Vec<Diagnostic>,
}

impl Case {
    /// The case whose run in `place` has ended before, of the same scene. An error: programs of another build computed it.
    pub fn finished(entry: &Value, place: &Path) -> Result<Option<Self>, Diagnostic> {
        let Some((of, ())) = sweep::kept(place)? else { return Ok(None) };
        let Ok(summary) = Summary::read(place) else { return Ok(None) };
        let case = Self::of(entry, summary);
        // A process that was lost says nothing of the scene.
        let lost = case.status == RunStatus::Interrupted
            || case.reasons.iter().any(|reason| reason.code == code::PROCESS);
        let same = scene(place).is_ok_and(|now| now == of);
        Ok(Some(case).filter(|_| same && !lost))
    }

    /// The case whose run has ended now.
    pub fn ended(entry: &Value, place: &Path, ran: Ran) -> Result<Self, Stop> {
        let Some(summary) = ran.summary else {
            let (entry, status, reasons) = (entry.clone(), RunStatus::Failed, ran.errors);
            return Ok(Self { entry, status, reasons, summary: None, warnings: Vec::new() });
        };
        let of = scene(place).map_err(|e| Stop::failed(code::FILE, format!("{}: {e}", place.display())))?;
        sweep::keep(place, &of, ())?;
        Ok(Self::of(entry, summary))
    }

    fn of(entry: &Value, summary: Summary) -> Self {
        let placeless = |warning: &Diagnostic| Diagnostic { place: None, ..warning.clone() };
        // Which measures are not there is of less weight than what is wrong.
        let (absent, mut warnings): (Vec<_>, Vec<_>) =
            summary.warnings.iter().map(placeless).partition(|warning| warning.code == code::ABSENT_MEASURE);
        warnings.extend(absent);
        let reasons = summary.reasons.clone();
        Self { entry: entry.clone(), status: summary.status, reasons, summary: Some(summary), warnings }
    }

    /// Its number.
    pub fn member(&self) -> u64 {
        self.entry["member"].as_u64().unwrap_or_default()
    }

    /// A number that it brings to the line.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.entry[key].as_f64()
    }

    /// What became of it, in a sentence.
    pub fn sentence(&self) -> Option<String> {
        let sentences = self.summary.as_ref()?.sentences();
        (!sentences.is_empty()).then(|| sentences.join("; "))
    }

    /// What became of its rock; `None`: it could not be computed.
    pub fn fate(&self) -> Option<Fate> {
        let computed = self.summary.as_ref().filter(|summary| summary.status != RunStatus::Failed)?;
        computed.verdict.first().map(|verdict| verdict.fate)
    }

    /// A result of its run.
    pub fn measure(&self, name: &str) -> Option<f64> {
        self.summary.as_ref()?.measure(name)
    }

    /// Why it is not done, in one line.
    pub fn reason(&self) -> String {
        let all: Vec<String> = self.reasons.iter().map(Diagnostic::headline).collect();
        all.join("; ").replace('\n', "; ")
    }

    /// The same, and what its run warns of.
    pub fn notes(&self) -> String {
        let reason = Some(self.reason()).filter(|reason| !reason.is_empty());
        let warnings = self.warnings.iter().map(|warning| format!("warning: {warning}"));
        reason.into_iter().chain(warnings).collect::<Vec<_>>().join("; ").replace('\n', "; ")
    }

    /// What the screen shows of it.
    pub fn words(&self) -> String {
        match self.status {
            RunStatus::Done => self.sentence().unwrap_or_else(|| "no verdict".into()),
            status => format!("{}: {}", status.word(), self.reason()),
        }
    }
}

/// Hash of the scene that the run in `place` is of.
fn scene(place: &Path) -> io::Result<String> {
    files::read(&place.with_extension("toml"), files::TEXT).map(|bytes| input_file::hash(&bytes))
}

/// What a member's scene has from the study, or from both.
const OF_STUDY: [&str; 6] = ["rock", "terrain", "gravity", "contact", "end_time", "title"];

/// The scene of a member that was made to be checked.
pub struct Generated<'a> {
    /// Its file, as diagnostics name it.
    pub file: String,
    /// The barrier that it was made with.
    pub barrier: &'a Scene,
}

impl Generated<'_> {
    /// What is said of it, as something about the barrier's file where the key is from there.
    pub fn placed(&self, mut said: Diagnostic) -> Diagnostic {
        if said.key.as_deref().is_some_and(|key| self.is_of_barrier(key)) {
            return self.barrier.placed(Diagnostic { place: None, ..said });
        }
        if let Some(place) = said.place.as_deref_mut().filter(|place| place.file == self.file) {
            place.file = format!("the scene of member 1 against {}", self.barrier.path().display());
        }
        said
    }

    fn is_of_barrier(&self, key: &str) -> bool {
        let first = key.split('.').next().unwrap_or_default();
        !OF_STUDY.contains(&first) && self.barrier.document().is_ok_and(|table| at(&table, key).is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::diagnostic::{Place, code};
    use interface_defs::verdict::{Ending, Verdict};

    fn case(member: u64, status: RunStatus, fate: Fate, elongation: f64) -> Case {
        let mut summary = Summary::new(status);
        let ending = Ending { fate, time: 1.0, position: [0.0; 3], speed: 3.0, on_terrain: true };
        summary.verdict.push(Verdict::of("r", ending));
        let measure = |name: &str, value, unit: &str| Measure::new(name, value, unit);
        summary.measures = vec![
            measure("max_elongation", elongation, "m").ranked(50, Worse::Larger),
            measure("posts_tension_min", -elongation, "N")
                .ranked(60, Worse::Smaller)
                .of_member(Some("post 2".into())),
            measure("impact_time", elongation, "s"),
        ];
        let why = || vec![Diagnostic::error(code::TRUST, "why")];
        Case {
            entry: json!({ "member": member, "chosen_for": "energy" }),
            status,
            reasons: if status == RunStatus::Done { Vec::new() } else { why() },
            summary: Some(summary),
            warnings: Vec::new(),
        }
    }

    fn chosen() -> Chosen {
        let (columns, chosen) = (Vec::new(), Vec::new());
        Chosen { members: 200, reach: 50, columns, chosen }
    }

    #[test]
    fn fates_are_counted_and_envelopes_name_their_member() {
        let mut cases = vec![
            case(7, RunStatus::Done, Fate::AtRest, 1.0),
            case(9, RunStatus::Done, Fate::LeftTerrain, 3.0),
            case(4, RunStatus::Done, Fate::AtRest, 2.0),
        ];
        let done = summary(&chosen(), &cases, "b.toml");
        assert_eq!(done.status, RunStatus::Done);
        let sentence = outcome(&done).expect("of a barrier");
        assert_eq!(
            sentence,
            "50 of 200 members reach the line; of the 3 worst: 2 at rest, 1 left the terrain"
        );
        let of = |name: &str| {
            let one = done.measures.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("{name}"));
            (one.value, one.member.as_deref().unwrap_or_default().to_owned(), one.rank)
        };
        assert_eq!(of("max_elongation_largest"), (3.0, "member 9".into(), 50));
        assert_eq!(of("posts_tension_min_smallest"), (-3.0, "member 9".into(), 60));
        // A time is not worse in any direction, and the worst are no sample.
        assert!(done.measures.iter().all(|m| !m.name.contains("impact") && !m.name.contains("_q")));
        assert_eq!(
            (done.measure("members_at_rest"), done.measure("members_passed_over")),
            (Some(2.0), Some(0.0))
        );
        cases.push(case(1, RunStatus::Unreliable, Fate::AtRest, 9.0));
        let bad = summary(&chosen(), &cases, "b.toml");
        assert_eq!((bad.status, bad.measure("max_elongation_largest")), (RunStatus::Unreliable, Some(3.0)));
        assert!(bad.message.unwrap_or_default().contains("1 of 4 members"), "what is left out is said");
        let dir = tempfile::tempdir().expect("a directory");
        write_rows(&["member", "chosen_for"].map(String::from), &cases, dir.path()).expect("written");
        let text = std::fs::read_to_string(dir.path().join(VERDICTS)).expect("a table");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "member,chosen_for,fate,status,max_elongation_m,posts_tension_min_N,impact_time_s,sentence,message"
        );
        assert!(
            lines[4].starts_with("1,energy,at_rest,unreliable,9,-9,9,\"rock `r` came to rest")
                && lines[4].ends_with(",why"),
            "{}",
            lines[4]
        );
    }

    #[test]
    fn warnings_of_the_runs_are_said_once_with_their_members() {
        let mut cases = vec![
            case(7, RunStatus::Done, Fate::Stopped, 1.0),
            case(9, RunStatus::Done, Fate::Undecided, 3.0),
            case(4, RunStatus::Done, Fate::StillMoving, 2.0),
        ];
        let turned = |by: u32| {
            Diagnostic::warning(code::GEOMETRY, format!("posts have turned by {by} degrees"))
                .about("structure")
        };
        let absent = |name: &str| Diagnostic::absent(name, "no impact");
        cases[0].warnings = vec![turned(76), absent("a"), absent("b")];
        cases[2].warnings = vec![turned(8), absent("b")];
        let summary = summary(&chosen(), &cases, "b.toml");
        let said: Vec<&str> = summary.warnings.iter().map(|warning| warning.message.as_str()).collect();
        assert_eq!(
            said,
            [
                "2 of 3 members are not decided at the end of their runs (9, 4)",
                "member 7: posts have turned by 76 degrees (likewise, each in words of its own, 2 of 3 members: 7, 4)",
                "a is absent: no impact (1 of 3 members: 7)",
                "b is absent: no impact (2 of 3 members: 7, 4)",
            ]
        );
        assert_eq!(summary.warnings[0].hint.as_deref(), Some("raise end_time of b.toml"));
        assert_eq!(summary.measure("members_undecided"), Some(1.0));
        cases[2].reasons = vec![Diagnostic::error(code::OTHER, "why\nthis")];
        assert_eq!(
            cases[2].notes(),
            "why; this; warning: structure: posts have turned by 8 degrees; warning: b is absent: no impact"
        );
    }

    #[test]
    fn what_is_wrong_is_named_in_the_file_of_the_user() {
        let own = "# mine\n[dem]\ntime_step = 1e-2\n[[structure.parts]]\nname = \"a\"\n[[structure.parts]]\nname = \"b\"\n";
        let barrier = Scene::from_text("barrier.toml", own).expect("valid");
        let generated = Generated { file: "/t/m.toml".into(), barrier: &barrier };
        let at = |key: &str| {
            let place = Place::in_text("/t/m.toml", "end_time = 1.5\n[dem]\ntime_step = 0.01\n", 33..37);
            Diagnostic::error(code::TIME_STEP, "too long").about(key).try_instead("shorten it").at(place)
        };
        let said = generated.placed(at("dem.time_step")).to_string();
        assert!(said.starts_with("barrier.toml:3:13: too long"), "{said}");
        assert!(said.contains("3 | time_step = 1e-2") && said.ends_with("= shorten it"), "{said}");
        assert!(generated.placed(at("structure.parts.1.name")).to_string().starts_with("barrier.toml:7:"));
        for key in ["rock.0.density", "dem.steps_per_contact"] {
            let said = generated.placed(at(key)).to_string();
            assert!(said.starts_with("the scene of member 1 against barrier.toml:3:"), "{said}");
        }
        let warning = Diagnostic::warning(code::OTHER, "a post has turned");
        assert_eq!(generated.placed(warning.clone()), warning);
        let long = Diagnostic::warning(code::TIME_STEP, "long").about("dem.time_step");
        assert_eq!(generated.placed(long).to_string(), "barrier.toml:3:13: dem.time_step: long");
    }
}
