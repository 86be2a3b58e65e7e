//! Options that several programs have on their command lines: each is declared here, once.

use super::check::Format;
use super::log::LogFormat;
use super::progress::Form;
use super::run_dir;
use super::scene::Scene;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use interface_defs::{Diagnostic, RunId};
use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A path that goes on to other programs: one that begins with a dash would be taken for an option there.
pub fn path() -> impl TypedValueParser<Value = PathBuf> {
    let is_option = |path: &PathBuf| path.as_os_str().as_encoded_bytes().starts_with(b"-");
    PathBufValueParser::new().map(move |path| if is_option(&path) { Path::new(".").join(path) } else { path })
}

/// Which scene.
#[derive(Debug, Clone, Args)]
pub struct Input {
    /// Scene file (TOML, SI units)
    #[arg(value_parser = path())]
    pub scene: PathBuf,
    /// Set a value of the scene, as in --set coupling.scheme=weak --set rock.0.cluster.spheres=512
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub sets: Vec<String>,
}

impl Input {
    /// The scene with the values that are set.
    pub fn load(&self) -> Result<Scene, Diagnostic> {
        Scene::load(&self.scene, &self.sets)
    }
}

/// Where the results go.
#[derive(Debug, Clone, Args)]
pub struct ResultDir {
    /// Directory of the results [default: out/NAME for the scene NAME.toml]
    #[arg(long, value_name = "DIR", value_parser = path(), help_heading = "Results")]
    pub out: Option<PathBuf>,
}

impl ResultDir {
    /// The directory, for `scene`.
    pub fn of(&self, scene: &Scene) -> PathBuf {
        run_dir::location(self.out.as_deref(), scene)
    }
}

/// Of a program that owns the directory of the results.
#[derive(Debug, Clone, Args)]
pub struct Results {
    /// Where they go.
    #[command(flatten)]
    pub dir: ResultDir,
    /// Overwrite the run that the directory holds
    #[arg(long, conflicts_with = "resume", help_heading = "Results")]
    pub force: bool,
    /// Go on with the run that the directory holds, from its last checkpoint; without one it begins anew
    #[arg(long, help_heading = "Results")]
    pub resume: bool,
}

/// Where it is shown what takes how long.
#[derive(Debug, Clone, Args)]
pub struct Profiling {
    /// Write what each process does and when to this file (trace events, JSON), for ui.perfetto.dev
    #[arg(long, value_name = "FILE", value_parser = path(), help_heading = "Results")]
    pub profile: Option<PathBuf>,
}

/// Of a program that leads a run, alone or as the coupler.
#[derive(Debug, Clone, Args)]
pub struct Leader {
    /// Its directory.
    #[command(flatten)]
    pub results: Results,
    /// Print nothing but errors
    #[arg(long, help_heading = "Results")]
    pub quiet: bool,
    /// Print progress on stdout, five times a second
    #[arg(long, value_enum, value_name = "FORM", help_heading = "Results")]
    pub progress: Option<Form>,
    /// Where its times go.
    #[command(flatten)]
    pub profiling: Profiling,
}

/// Whether savings are used.
#[derive(Debug, Clone, Args)]
pub struct Savings {
    /// Switch off every shortcut (flight in closed form, skipped structure), to prove that it is harmless
    #[arg(long, help_heading = "Computation")]
    pub no_shortcuts: bool,
}

/// Of a program that another one starts.
#[derive(Debug, Clone, Args)]
pub struct Supervised {
    /// Number of the process that started this one: when it ends, this one ends too
    #[arg(long, value_name = "PID", help_heading = "Connection")]
    pub supervisor: Option<u32>,
}

/// Of a program that takes part in a run with others.
#[derive(Debug, Clone, Args)]
pub struct Membership {
    /// Name of the run, the same for all its programs: 1 to 16 letters, digits, dashes
    #[arg(long, value_name = "ID", help_heading = "Connection")]
    pub run: RunId,
    /// Who started it.
    #[command(flatten)]
    pub supervised: Supervised,
}

/// How a command answers.
#[derive(Debug, Clone, Args)]
pub struct AnswerForm {
    /// Form of the answer
    #[arg(long, value_enum, default_value_t, value_name = "FORM")]
    pub format: Format,
}

/// How logs look.
#[derive(Debug, Clone, Args)]
pub struct Logging {
    /// Form of the log lines on stderr; with json `rockfall` draws no bar. RUST_LOG=debug prints more
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORM")]
    pub log_format: LogFormat,
}

/// Of `cluster`: what a cluster is made of, and into which file.
#[derive(Debug, Clone, Args)]
pub struct ClusterArguments {
    /// Closed surface (.stl, .obj), or a built-in shape, as in box:1.2,0.8,0.6; all of them below
    #[arg(value_name = "SHAPE")]
    pub shape: String,
    /// Most spheres, 1 to 50000. A round shape may take fewer: a sphere is one
    #[arg(long, short = 'n', value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spheres: u32,
    /// File to write: `x y z r` per line [m], in the shape's own axes
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
    /// Metres per unit of a surface file
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    pub scale: f64,
    /// Close small holes of a surface file, as scans have them; their number and area are printed
    #[arg(long)]
    pub close_holes: bool,
    /// Of several closed surfaces in a file take this one: its number, from 1, or its name in the file
    #[arg(long, value_name = "NUMBER|NAME")]
    pub piece: Option<String>,
    /// `medial`: by the error; `lattice`: equal spheres in rows (boxes; the largest number that fills it)
    #[arg(long, value_name = "HOW", default_value = "medial", value_parser = ["medial", "lattice"])]
    pub method: String,
    /// `volume`: as much outside of the solid as lacks inside; `largest`: as far outside as inside, the
    /// smallest largest error; `inside`: never outside
    #[arg(long, value_name = "WHERE", default_value = "volume", value_parser = ["volume", "largest", "inside"])]
    pub fit: String,
    /// Least radius [m]: small spheres make edges sharp, and are soft; what only smaller ones reach stays uncovered
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub smallest_radius: f64,
    /// Largest distance of the two surfaces [m]: a cluster beyond it is refused. Default: 15 % of the diagonal of the
    /// shape's box, and no more than 0.9 times the radius of the largest ball that fits into it
    #[arg(long, value_name = "M")]
    pub largest_error: Option<f64>,
    /// Write the spheres (points with a radius) as a VTU file too
    #[arg(long, value_name = "FILE")]
    pub vtu: Option<PathBuf>,
}

/// Of `export`: the structure of which scene.
#[derive(Debug, Clone, Args)]
pub struct StructureArguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
    /// Nodes where they come to rest at t = 0, in place of the structure as modelled
    #[arg(long)]
    pub at_rest: bool,
}

/// The same, and into which file.
#[derive(Debug, Clone, Args)]
pub struct ExportArguments {
    /// The structure.
    #[command(flatten)]
    pub structure: StructureArguments,
    /// File to write: .inp (CalculiX, Abaqus), .mdpa (Kratos), .msh (Gmsh), these by python3, or .json (structure.json, for other programs)
    #[arg(long, value_name = "FILE", value_parser = path())]
    pub to: PathBuf,
}

/// Numbers of members, from `first` to `last`, both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemberRange {
    /// The first, from 1.
    pub first: u64,
    /// The last.
    pub last: u64,
}

impl MemberRange {
    /// All members from 1 to `members` in `count` parts, whose sizes differ by one at most; no more parts than members.
    pub fn parts(members: u64, count: u64) -> Vec<Self> {
        let count = count.min(members);
        let end = |part: u64| (u128::from(members) * u128::from(part) / u128::from(count)) as u64;
        (0..count).map(|part| Self { first: end(part) + 1, last: end(part + 1) }).collect()
    }
}

impl Display for MemberRange {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.last)
    }
}

impl FromStr for MemberRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once("..").map(|(first, last)| (first.trim().parse(), last.trim().parse()));
        match numbers {
            Some((Ok(first), Ok(last))) => Ok(Self { first, last }),
            _ => Err("write the first and the last member, as in 1..100".into()),
        }
    }
}

/// How well a measure of a study must be known.
#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy {
    /// Its name.
    pub measure: String,
    /// Half of its interval over its value, at most.
    pub share: f64,
}

impl FromStr for Accuracy {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (measure, share) = text.rsplit_once(':').unwrap_or_default();
        let percent = share.trim().strip_suffix('%').and_then(|share| share.trim().parse::<f64>().ok());
        match percent.filter(|percent| *percent > 0.0 && *percent < 100.0 && !measure.is_empty()) {
            Some(percent) => Ok(Self { measure: measure.into(), share: percent / 100.0 }),
            None => Err("write a measure and a share of it, as in road_energy_q95:5%".into()),
        }
    }
}

/// Of what computes the members of a study: on how many threads, and where the results go.
#[derive(Debug, Clone, Args)]
pub struct Computation {
    /// Threads [default: as many as there are cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Computation")]
    pub threads: Option<u32>,
    /// Whether savings are used.
    #[command(flatten)]
    pub savings: Savings,
    /// Where they go.
    #[command(flatten)]
    pub dir: ResultDir,
    /// Begin anew in a directory that holds a study
    #[arg(long, conflicts_with = "resume", help_heading = "Results")]
    pub force: bool,
    /// Go on with a study that was interrupted or killed
    #[arg(long, help_heading = "Results")]
    pub resume: bool,
    /// Print nothing but errors
    #[arg(long, help_heading = "Results")]
    pub quiet: bool,
    /// Print progress on stdout, five times a second
    #[arg(long, value_enum, value_name = "FORM", help_heading = "Results")]
    pub progress: Option<Form>,
}

/// Of `ensemble`: which study, which part of it, and where its results go.
#[derive(Debug, Clone, Args)]
pub struct EnsembleArguments {
    /// Study file (TOML): a scene, where rocks start, what varies
    #[arg(value_name = "STUDY", value_parser = path())]
    pub study: PathBuf,
    /// Set a value of the study, as in --set seed=2 --set release.0.count=1000, or with `barrier.` before it one of the barrier's
    /// scene, as in --set barrier.coupling.time_window=1e-4
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub sets: Vec<String>,
    /// Compute these members alone, both included, as one task of many; a call without --members collects the results
    #[arg(long, value_name = "A..B", conflicts_with_all = ["force", "resume"], help_heading = "Computation")]
    pub members: Option<MemberRange>,
    /// Print the members of the study in N equal parts, as --members takes them, one in a line; compute nothing
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["members", "force", "resume"], help_heading = "Computation")]
    pub chunks: Option<u64>,
    /// Add replicates of the study until half of the 95 % interval of this measure is no more than that share of it
    #[arg(long, value_name = "MEASURE:SHARE", conflicts_with_all = ["members", "chunks", "scene_of", "barrier"], help_heading = "Computation")]
    pub until: Option<Accuracy>,
    /// Most members that --until goes to [default: ten times those of the study]
    #[arg(long, value_name = "N", requires = "until", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Computation")]
    pub at_most: Option<u64>,
    /// Check the study, say what it would compute and what that costs, by some of its members, with --barrier also the barrier; compute
    /// nothing: `rockfall check STUDY`
    #[arg(long, conflicts_with_all = ["members", "chunks", "until", "force", "resume", "scene_of", "list_worst", "run_worst"], help_heading = "Computation")]
    pub dry_run: bool,
    /// Form of the answer to --dry-run
    #[arg(
        long,
        value_enum,
        default_value_t,
        value_name = "FORM",
        requires = "dry_run",
        help_heading = "Computation"
    )]
    pub format: Format,
    /// Write the complete scene of one member, which `rockfall run` computes as the study does
    #[arg(long, value_name = "N", conflicts_with_all = ["members", "chunks"], value_parser = clap::value_parser!(u64).range(1..), help_heading = "One member")]
    pub scene_of: Option<u64>,
    /// File of that scene [default: it is printed]
    #[arg(long, short, value_name = "FILE", requires = "scene_of", conflicts_with_all = ["members", "chunks", "run_worst", "list_worst"], help_heading = "One member")]
    pub output: Option<PathBuf>,
    /// Run the worst members again, coupled, against the barrier of this scene, which stands on a line; `rock` and `terrain` are
    /// the study's, `end_time` is how long is computed after a member has reached the line
    #[arg(long, value_name = "SCENE", value_parser = path(), conflicts_with = "chunks", help_heading = "Barrier")]
    pub barrier: Option<PathBuf>,
    /// How many: in turn those with the most energy, the highest, the nearest to an end of the line
    #[arg(long, value_name = "N", requires = "barrier", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..), help_heading = "Barrier")]
    pub worst: u32,
    /// Compute the study, print the numbers of the worst members, one in a line, as --run-worst takes them; run none of them
    #[arg(long, requires = "barrier", conflicts_with_all = ["members", "run_worst", "scene_of"], help_heading = "Barrier")]
    pub list_worst: bool,
    /// Run this one of the worst members that --list-worst has chosen, as one task of many; a call without it collects the results
    #[arg(long, value_name = "MEMBER", requires = "barrier", conflicts_with_all = ["members", "scene_of", "force"], help_heading = "Barrier")]
    pub run_worst: Option<u64>,
    /// Where the barrier stands, from the program that builds it (JSON)
    #[arg(long, value_name = "JSON", hide = true)]
    pub site: Option<String>,
    /// Started by `rockfall`, which goes on when this has ended: nothing goes on without it
    #[arg(long, hide = true)]
    pub watched: bool,
    /// How it is computed, and where the results go.
    #[command(flatten)]
    pub computation: Computation,
}

/// Of `calibrate`: what was observed, what is searched, and where the results go.
#[derive(Debug, Clone, Args)]
pub struct CalibrateArguments {
    /// Calibration file (TOML): a study, parameters with the ranges that are searched, what was observed
    #[arg(value_name = "FILE", value_parser = path())]
    pub file: PathBuf,
    /// Set a value of the file, as in --set sets=400
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub sets: Vec<String>,
    /// How it is computed, and where the results go.
    #[command(flatten)]
    pub computation: Computation,
    /// How it answers.
    #[command(flatten)]
    pub answer: AnswerForm,
}

/// What a `--set` of the barrier's scene begins with.
const OF_BARRIER: &str = "barrier.";

impl EnsembleArguments {
    /// Every `--set` of the study, and every one of the barrier's scene, as that takes it.
    pub fn sets(&self) -> Result<(Vec<String>, Vec<String>), Diagnostic> {
        let (of_barrier, of_study): (Vec<String>, Vec<String>) =
            self.sets.iter().cloned().partition(|set| set.starts_with(OF_BARRIER));
        if let Some(set) = of_barrier.first().filter(|_| self.barrier.is_none()) {
            let what = "this is a value of the barrier's scene, and there is no barrier";
            return Err(Diagnostic::in_file(format!("--set {set}"), what).try_instead("--barrier SCENE"));
        }
        let own = of_barrier.iter().filter_map(|set| set.strip_prefix(OF_BARRIER)).map(String::from);
        Ok((of_study, own.collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        dir: ResultDir,
    }

    #[test]
    fn a_name_that_begins_with_a_dash_is_no_option_of_a_program_started_with_it() {
        let line = ["p", "--out=-x", "--set", "-k=1", "--set=a=-2", "--", "-s.toml"];
        let cli = Cli::try_parse_from(line).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(cli.dir.out.as_deref(), Some(Path::new("./-x")));
        assert_eq!(cli.input.scene, Path::new("./-s.toml"));
        assert_eq!(cli.input.sets, ["-k=1", "a=-2"]);
        // What was meant as an option is not taken for a directory.
        assert!(Cli::try_parse_from(["p", "s.toml", "--out", "-x"]).is_err());
        let cli = Cli::try_parse_from(["p", "s.toml", "--out", "a/-x"]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(cli.dir.out.as_deref(), Some(Path::new("a/-x")));
    }

    #[test]
    fn an_accuracy_is_a_measure_and_a_share_of_it() {
        assert_eq!(
            "road_energy_q95: 5 %".parse(),
            Ok(Accuracy { measure: "road_energy_q95".into(), share: 0.05 })
        );
        for wrong in ["road_energy_q95", "road_energy_q95:5", "road_energy_q95:0%", ":5%", "a:x%", "a:100%"] {
            assert!(wrong.parse::<Accuracy>().is_err_and(|e| e.contains("road_energy_q95:5%")), "{wrong}");
        }
    }
}
