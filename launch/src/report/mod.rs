//! `rockfall report`: the results of a run as one page, `report.html`, that opens from disk without a request; with `--pdf` for print.
//!
//! Every number of a table is that of `summary.json`; nothing is computed again. A kind of results is a file here that makes a [`page`].

use crate::front::stop::Stop;
use crate::run::children::{self, Destination, Events, Job, Rules};
use clap::Args;
use interface_defs::diagnostic::{Diagnostic, code};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use toolkit::exit::Exit;
use toolkit::files;
use toolkit::run_dir::{APPROVAL, REPORT, STUDY_RECORD, SUMMARY, TRADE};
use toolkit::screen::show;

mod approval;
mod curves;
mod frames;
pub mod page;
mod run;
mod study;
pub mod table;
mod trade;

/// What makes the page of a directory.
type Maker = fn(&Path) -> io::Result<page::Page>;
/// Kinds of results, each by a file that only it has; a run has the last.
const KINDS: [(&str, Maker); 5] = [
    (STUDY_RECORD, study::page),
    (APPROVAL, approval::page),
    (TRADE[0], trade::page),
    (TRADE[1], trade::page),
    (SUMMARY, run::page),
];

/// What makes the page of the results in `dir`; `None`: they are not complete.
fn maker(dir: &Path) -> Option<Maker> {
    // A study has its summary at its end; `rockfall trade` has a record of the same name, and none.
    let holds = |name: &str| dir.join(name).exists() && (name != STUDY_RECORD || dir.join(SUMMARY).exists());
    KINDS.iter().find(|(name, _)| holds(name)).map(|(_, maker)| *maker)
}

/// The same for print.
const PRINT: &str = "report.pdf";
/// Browsers that print without a window, in the order in which they are tried.
const BROWSERS: [&str; 5] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge"];
/// Longest time that a browser may take [s].
const PRINTING: Duration = Duration::from_secs(120);
/// How it prints, without asking anything of anybody.
const SILENT: &str = "--headless --disable-gpu --enable-unsafe-swiftshader --no-first-run --disable-background-networking \
                      --disable-component-update --disable-sync --disable-quic --no-pdf-header-footer --virtual-time-budget=10000";

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Directory of the results
    pub dir: PathBuf,
    /// Write `report.pdf` too, A4, by a browser on PATH (Chromium, Chrome or Edge)
    #[arg(long)]
    pub pdf: bool,
}

/// Write the report of a directory anew.
pub fn report(ReportArguments { dir, pdf }: &ReportArguments) -> Result<Exit, Stop> {
    let browser = pdf.then(browser).transpose()?;
    if maker(dir).is_none() {
        let what = format!("{}: there is no {SUMMARY}, and so no run that has ended", dir.display());
        return Err(Stop::input(code::RESULT_DIRECTORY, what));
    }
    let unwritten = |e: io::Error| Stop::failed(code::FILE, format!("{}: no report: {e}", dir.display()));
    write(dir).map_err(unwritten)?;
    show(&format!("{}\n", dir.join(REPORT).display()));
    let Some(browser) = browser else { return Ok(Exit::Done) };
    print(&browser, &dir.join(REPORT), &dir.join(PRINT))?;
    show(&format!("{}\n", dir.join(PRINT).display()));
    Ok(Exit::Done)
}

/// Write the report of the results in `dir`. One that was printed before is removed: it may be of another run.
pub fn write(dir: &Path) -> io::Result<()> {
    files::remove(&dir.join(PRINT))?;
    let page = maker(dir).ok_or(io::ErrorKind::NotFound)?(dir)?;
    files::write(&dir.join(REPORT), page.html().as_bytes())
}

/// The same at the end of a run or study: without it the results are as good as with it.
pub fn close(dir: &Path) {
    if let Err(e) = write(dir) {
        tracing::warn!("{}: no report: {e}", dir.display());
    }
}

/// The first browser that there is.
fn browser() -> Result<PathBuf, Stop> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let dirs: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let mut all = BROWSERS.iter().flat_map(|name| dirs.iter().map(move |dir| dir.join(name)));
    all.find(|program| program.is_file()).ok_or_else(|| {
        let what = format!("--pdf: no browser is on PATH that could print: {}", BROWSERS.join(", "));
        let cure = format!("install one of them, or open {REPORT} in any browser and print it from there");
        Diagnostic::error(code::PROCESS, what).try_instead(cure).into()
    })
}

/// Let `browser` print a page as PDF.
fn print(browser: &Path, from: &Path, to: &Path) -> Result<(), Stop> {
    let failed = |what: String| Stop::failed(code::PROCESS, format!("{}: {what}", browser.display()));
    let scratch = tempfile::tempdir().map_err(|e| failed(format!("it has no place to work in: {e}")))?;
    let (profile, out) = (scratch.path().join("profile"), scratch.path().join("printed.pdf"));
    let mut command = Command::new(browser);
    command.current_dir(from.parent().unwrap_or(from)).args(SILENT.split_whitespace());
    // A browser refuses to shut the administrator off from the rest of the machine.
    command.args(rustix::process::getuid().is_root().then_some("--no-sandbox"));
    command.arg(format!("--user-data-dir={}", profile.display()));
    command.arg(format!("--print-to-pdf={}", out.display())).arg(from.file_name().unwrap_or_default());
    let rules = Rules { grace: Some(children::GRACE_OF_RUN), limit: Some(PRINTING), ..Rules::default() };
    let job = Job { name: "the browser".into(), command, input: None, output: Destination::Captured };
    let (end, too_slow) = children::one(job, rules, &Events::watch()?)?;
    let from = from.display();
    if too_slow {
        return Err(failed(format!("it has not printed {from} within {} s", PRINTING.as_secs())));
    }
    let nothing =
        |e| failed(format!("it ended with {} and printed nothing of {from}: {e}", children::how(end.status)));
    let printed = files::read_input(&out, files::TEXT).map_err(nothing)?;
    files::write(to, &printed).map_err(|e| failed(format!("{} cannot be written: {e}", to.display())))
}
