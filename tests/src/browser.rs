//! Chromium as a witness of what a report shows.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What stands between the first `before` and the `after` behind it.
pub fn between<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    Some(text.split_once(before)?.1.split_once(after)?.0)
}

/// Chromium, where it is on PATH.
pub fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found =
        std::env::split_paths(&path).map(|dir| dir.join("chromium")).find(|program| program.is_file());
    if found.is_none() {
        println!("skipped: there is no chromium on PATH");
    }
    found
}

/// What the page in `dir` shows at `time` [s], as a browser has it, by the page's own account; an error in its console is one here.
pub fn shown(browser: &Path, dir: &Path, time: f64) -> (String, Value) {
    let profile = tempfile::tempdir().expect("a directory");
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args([
            "--enable-unsafe-swiftshader",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}/report.html#test={time}", dir.display()))
        .output()
        .expect("started");
    let said = String::from_utf8_lossy(&output.stderr);
    // What a driver of graphics says of its speed is no error of the page.
    let errors: Vec<&str> =
        said.lines().filter(|line| line.contains("CONSOLE") && !line.contains("GL Driver Message")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    let page = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        !page.contains("class=\"alarm failed\""),
        "{}",
        between(&page, "failed\">", "<").unwrap_or_default()
    );
    let known = between(&page, "id=\"test\" hidden=\"\">", "</pre>").expect("what it shows");
    let known: Value = serde_json::from_str(&known.replace("&gt;", ">").replace("&amp;", "&")).expect("JSON");
    assert_eq!(known["requests"], 0, "{known}");
    (page, known)
}
