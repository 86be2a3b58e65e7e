//! What the bindings share: a run from the command line to the exit code, the scene, and where declared fields lie.

use interface_defs::ipc::{Connection, interrupt, serve};
use interface_defs::solver::OnProgress;
use interface_defs::{Fault, FieldSpec, InterfaceMesh, Layout, Plan, Progress, Ready, Solver};
use std::ffi::OsString;
use std::ops::Range;
use std::path::PathBuf;

/// Take part in the run that `args` name (`serve SCENE --run ID --as NAME ...`), or tell the run why this solver cannot; returns the
/// exit code, and says on standard error what went wrong.
pub fn run(solver: Result<&mut dyn Solver, Fault>, args: &[OsString]) -> i32 {
    let failed = |what: &dyn std::fmt::Display, code| {
        eprintln!("error: {what}");
        code
    };
    let connection = match Connection::from_args(args.iter().cloned()) {
        Ok(connection) => connection,
        Err(what) => {
            let hint = "this program is started by a run: name it in a scene as [processes] fem = \"...\" (or dem) and \
                        start `rockfall run SCENE`";
            return failed(&format!("{what}\n{hint}"), 2);
        }
    };
    interrupt::install();
    match solver {
        Ok(solver) => serve::serve(solver, &connection).map_or_else(|failure| failed(&failure, 1), |()| 0),
        Err(fault) => {
            let _ = serve::refuse(&fault, &connection);
            failed(&fault, 1)
        }
    }
}

/// The scene's file: what follows `serve` in `args`.
pub fn scene_path(args: &[OsString]) -> Option<PathBuf> {
    args.iter().skip_while(|arg| *arg != "serve").nth(1).map(PathBuf::from)
}

/// The scene that `args` name, with every default; empty without one.
///
/// # Errors
/// What keeps the file from being read.
pub fn scene(args: &[OsString]) -> Result<toml::Table, String> {
    let Some(path) = scene_path(args) else { return Ok(toml::Table::new()) };
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    text.parse().map_err(|e| format!("{}: {e}", path.display()))
}

/// What takes progress, by a pointer that a foreign function can hold.
pub type Report = *mut dyn FnMut(Progress) -> Result<(), Fault>;

/// A pointer to `progress`, whose lifetime the compiler forgets. It must not be used once `prepare` has returned, nor by two at once.
pub fn pointer_to(progress: OnProgress) -> Report {
    let report: *mut (dyn FnMut(Progress) -> Result<(), Fault> + '_) = progress;
    // SAFETY: a pointer alone is not used; both types differ in their lifetime.
    unsafe { std::mem::transmute(report) }
}

/// One side of the exchange: for each declared field its place in the payload and the number of its samples, where the plan has it.
#[derive(Debug, Default)]
pub struct Side {
    /// In the order of the declaration.
    pub fields: Vec<Option<(Range<usize>, usize)>>,
    /// Numbers of all gauges, at the end.
    pub gauges: Range<usize>,
}

impl Side {
    /// Of `declared`, in payloads as `planned` on `mesh` with `gauges` gauges.
    pub fn new(declared: &[FieldSpec], planned: &[FieldSpec], mesh: &InterfaceMesh, gauges: usize) -> Self {
        let layout = Layout::new(planned, mesh, gauges);
        let place = |field: &FieldSpec| {
            let samples = as_planned(field, planned)?.sample_count();
            let first = layout.sample(&field.name, field.sampling, 0)?;
            let last = layout.last(&field.name, field.sampling)?;
            Some((first.start..last.end, samples))
        };
        Self { fields: declared.iter().map(place).collect(), gauges: layout.gauges() }
    }

    /// What a prepared solver takes and gives.
    pub fn both(takes: &[FieldSpec], gives: &[FieldSpec], plan: &Plan, ready: &Ready) -> (Self, Self) {
        let gauges = ready.gauges.len();
        (Self::new(takes, &plan.takes, &ready.mesh, 0), Self::new(gives, &plan.gives, &ready.mesh, gauges))
    }
}

/// A declared field as the plan has it, with the samples that travel.
pub fn as_planned<'a>(declared: &FieldSpec, planned: &'a [FieldSpec]) -> Option<&'a FieldSpec> {
    planned.iter().find(|f| f.name == declared.name && f.sampling == declared.sampling)
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::Sampling;

    #[test]
    fn declared_fields_are_found_in_the_plan_in_any_order_or_not_at_all() {
        let field = |name, sampling| FieldSpec::nodal(name, 3, sampling);
        let declared = [
            field("force", Sampling::Means),
            field("force", Sampling::AtEnds),
            field("reach", Sampling::Once),
        ];
        let mut planned = [field("reach", Sampling::Once), field("force", Sampling::AtEnds)];
        planned[1].samples = 2;
        let mesh = InterfaceMesh { coordinates: vec![0.0; 6], ..Default::default() };
        let side = Side::new(&declared, &planned, &mesh, 1);
        assert_eq!(side.fields, [None, Some((6..18, 2)), Some((0..6, 1))]);
        assert_eq!(side.gauges, 18..21);
    }

    #[test]
    fn the_scene_stands_behind_serve() {
        let args = |words: &[&str]| words.iter().map(OsString::from).collect::<Vec<_>>();
        assert_eq!(
            scene_path(&args(&["net", "--fine", "serve", "a.toml", "--run", "x"])),
            Some("a.toml".into())
        );
        assert_eq!(scene(&args(&["net"])), Ok(toml::Table::new()));
        assert!(scene(&args(&["net", "serve", "/no/such.toml"])).unwrap_err().contains("/no/such.toml"));
    }
}
