//! Shell blocks of the manual are run as they stand, page by page, in a directory that has the files they speak of. Studies and runs are
//! made small by the changes that a page has here, and what is left out says why.

use std::fmt::Write as _;
use std::process::Command;
use tests::manual::{blocks, blocks_in, pages};
use tests::{Bench, example, program, repository};

/// Pages whose shell blocks are run here. Blocks in TOML of every page are compared with the schemas in `reference.rs`.
const RUN: &[&str] = &[
    "docs/approval.md",
    "docs/barrier.md",
    "docs/calibrate.md",
    "docs/clusters.md",
    "docs/ensemble.md",
    "docs/line-barrier.md",
    "docs/machines.md",
    "docs/own-rock.md",
    "docs/own-site.md",
    "docs/processes.md",
    "docs/report.md",
    "docs/rings.md",
    "docs/solvers.md",
    "docs/statistics.md",
    "docs/structures.md",
    "docs/trade.md",
];

/// Blocks that are not run here: page, language, and what runs them, or why nothing does.
const ELSEWHERE: &[(&str, &str, &str)] = &[
    ("README.md", "sh", ".ci/run"),
    ("CONTRIBUTING.md", "sh", ".ci/run"),
    ("ARCHITECTURE.md", "", "a picture in text"),
    ("dem-solver/examples/README.md", "sh", "needs valgrind"),
    ("fem-solver/examples/README.md", "", "needs valgrind"),
    ("docs/accuracy.md", "sh", "a second run of any scene; tests/tests/commands/refine.rs"),
    ("docs/calibrate.md", "", "docs/measured/calibrate.py"),
    ("docs/install.md", "sh", ".ci/run builds; the rest is of the shell"),
    ("docs/measured-falls.md", "sh", "needs data of others and 20 minutes; pages.rs compares the options"),
    ("docs/nightly.md", "sh", "hours; pages.rs compares the sections"),
    ("docs/numbers.md", "sh", "writes pages anew"),
    ("docs/performance.md", "sh", "any scene"),
    ("docs/runs.md", "sh", "any scene"),
    ("docs/own-net.md", "geo", "needs Gmsh; readme.rs runs the scene beside it on a mesh of Gmsh"),
    ("docs/processes.md", "ini", "needs systemd"),
    (
        "docs/solvers.md",
        "text",
        "lines that `rockfall conform` prints of a solver that lies; tests/tests/commands/conform.rs",
    ),
    ("docs/trade/barrier-impact.md", "", "written by `rockfall trade`"),
    ("docs/trade/cable-net.md", "", "written by `rockfall trade`"),
    ("docs/trade/walenstadt-compare.md", "", "written by `rockfall trade`"),
    ("interface-defs/bindings/c/README.md", "sh", "interface-defs/bindings/test"),
    ("interface-defs/bindings/golden/README.md", "python", "an encoder of the reader's own"),
    ("interface-defs/bindings/python/README.md", "python", "interface-defs/bindings/python/tests"),
    ("interface-defs/bindings/python/README.md", "sh", "interface-defs/bindings/test"),
    ("interface-defs/bindings/templates/c/README.md", "sh", "interface-defs/bindings/test"),
    ("interface-defs/bindings/templates/cpp/README.md", "sh", "interface-defs/bindings/test"),
    ("interface-defs/bindings/templates/fortran/README.md", "sh", "interface-defs/bindings/test"),
    ("interface-defs/bindings/templates/python/README.md", "sh", "interface-defs/bindings/test"),
    ("interface-defs/bindings/templates/rust/README.md", "sh", "interface-defs/bindings/test"),
    ("launch/adapters/README.md", "sh", "needs Kratos and CalculiX"),
    ("launch/adapters/export/README.md", "sh", "tests/tests/commands/export.rs"),
    ("launch/adapters/kratos/README.md", "sh", "launch/adapters/kratos/test"),
    ("launch/adapters/nets/README.md", "sh", "launch/adapters/nets/test"),
    ("launch/adapters/precice/README.md", "sh", "launch/adapters/precice/test"),
    ("tests/peer/README.md", "sh", "needs Kratos and CalculiX"),
];

/// Beginning of a line that is not run, and why.
const LEFT_OUT: [(&str, &str); 9] = [
    ("tmux ", "a terminal, which goes on behind it"),
    ("sed 1,2d lines", "the same"),
    ("ssh ", "needs a second machine"),
    (
        "rockfall bridge --connect",
        "waits for a run on a second machine; tests/tests/commands/bridge.rs has both",
    ),
    ("rockfall run mine.toml --set 'processes.fem=\"rockfall bridge", "the other end of that bridge"),
    ("openssl", "a token of the machine"),
    ("cargo ", "the suite itself"),
    (".ci/nightly", "hours"),
    ("SECONDS_EACH", "hours"),
];

/// What both solvers of `mine.toml` may be replaced by: a program that takes options of its own.
const MY_SOLVER: &str = "#!/bin/sh
while [ \"$1\" != serve ]; do shift; done
case \" $* \" in *\" --as dem \"*) exec dem-solver \"$@\";; *) exec fem-solver \"$@\";; esac
";

#[test]
fn every_block_of_every_page_is_run_or_says_why_not() {
    let mut unused: Vec<_> =
        ELSEWHERE.iter().map(|(page, language, _)| (*page, language.to_string())).collect();
    let mut open = Vec::new();
    for page in pages() {
        for block in blocks(&page) {
            let (kind, here) = ((page.as_str(), block.language.clone()), RUN.contains(&page.as_str()));
            let elsewhere = ELSEWHERE.iter().any(|(p, l, _)| *p == kind.0 && *l == kind.1);
            unused.retain(|entry| *entry != kind);
            if !(elsewhere || kind.1 == "toml" || (kind.1 == "sh" && here)) {
                open.push(format!("{page}:{}: `{}`", block.line, block.language));
            }
        }
    }
    assert!(open.is_empty(), "nothing runs, and no entry of ELSEWHERE says why: {open:#?}");
    assert!(unused.is_empty(), "there are no such blocks any more: {unused:?}");
    let gone = |how: &&str| how.contains('/') && !how.contains(' ') && !repository().join(how).exists();
    let gone: Vec<_> = ELSEWHERE.iter().map(|(_, _, how)| *how).filter(gone).collect();
    assert!(gone.is_empty(), "not there: {gone:?}");
}

/// Run all blocks of a page in one directory, with these replacements (`$` is the end of a line without its comment); a few rocks are an unreliable sample, which is no failure here.
fn runs(page: &str, bench: &Bench, changes: &[(&str, &str)]) {
    let bin = program("rockfall").parent().expect("a directory").to_owned();
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").expect("a path"));
    let left = |line: &str| LEFT_OUT.iter().any(|(start, _)| line.trim_start().starts_with(start));
    assert!(RUN.contains(&page), "{page} is to be in RUN");
    let mut unused: Vec<&str> = changes.iter().map(|(from, _)| *from).collect();
    for tests::manual::Block { line: number, text: block, .. } in
        blocks(page).into_iter().filter(|block| block.language == "sh")
    {
        let mut script = String::from("rockfall() { command rockfall \"$@\" || [ $? = 3 ]; }\n");
        for line in block.lines() {
            let mut line = line.split("  #").next().expect("a part").trim_end().to_owned() + "$";
            for (from, to) in changes.iter().filter(|(from, _)| line.contains(from)).collect::<Vec<_>>() {
                unused.retain(|change| change != from);
                line = line.replace(from, to);
            }
            if !left(&line) {
                let _ = writeln!(script, "{}", line.trim_end_matches('$'));
            }
        }
        let output = Command::new("bash")
            .args(["-euo", "pipefail", "-c", &script])
            .env("PATH", &path)
            .current_dir(bench.path(""))
            .output()
            .expect("started");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{page}:{number}: {}\n{block}\n{said}", output.status);
    }
    assert!(unused.is_empty(), "{page} does not have {unused:?} any more");
}

fn write(bench: &Bench, name: &str, text: &str) {
    std::fs::write(bench.path(name), text).expect("written");
}

/// `launch` and what else of the repository a page speaks of.
fn with_repository(bench: &Bench) {
    for name in ["launch", "target", "docs"] {
        std::os::unix::fs::symlink(repository().join(name), bench.path(name)).expect("linked");
    }
}

/// `mine.toml`, a sphere on a net for a moment, and `my-solver`.
fn with_mine(bench: &Bench) {
    use std::os::unix::fs::PermissionsExt;
    let scene =
        std::fs::read_to_string(repository().join("launch/scenes/sphere-on-cable.toml")).expect("read");
    write(bench, "mine.toml", &scene);
    write(bench, "my-solver", MY_SOLVER);
    let mode = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(bench.path("my-solver"), mode).expect("may be started");
}

fn copy(bench: &Bench, from: &str, to: &str) {
    std::fs::copy(repository().join(from), bench.path(to)).expect("copied");
}

#[test]
#[ignore = "long"]
fn own_site() {
    let bench = Bench::new();
    with_repository(&bench);
    for name in ["cliff.geojson", "meadow.geojson", "road.geojson"] {
        copy(&bench, &format!("docs/example/{name}"), name);
    }
    copy(&bench, "launch/scenes/data/slope.asc", "dtm.asc");
    let small = "rockfall new site --spheres 20 --count 4 --volume 0.1 ";
    let changes = [
        ("dtm.tif", "dtm.asc"),
        ("rockfall new site ", small),
        (
            "study.toml --barrier site/barrier.toml --worst 10",
            "study.toml --barrier site/barrier.toml --worst 1",
        ),
    ];
    runs("docs/own-site.md", &bench, &changes);
    assert!(bench.path("out/study/report.html").exists() && bench.path("mine/study.toml").exists());
}

/// A slope of 1 in 2 towards the east below survey coordinates: 260 m by 160 m, cells of 2 m.
fn slope() -> String {
    let mut text = String::from("ncols 130\nnrows 80\nxllcorner 2682990\nyllcorner 1246980\ncellsize 2\n");
    for _ in 0..80 {
        let row: Vec<String> = (0..130).map(|column| format!("{:.2}", 1210.0 - f64::from(column))).collect();
        let _ = writeln!(text, "{}", row.join(" "));
    }
    text
}

#[test]
#[ignore = "long"]
fn many_releases() {
    let bench = Bench::new();
    let page = "docs/ensemble.md";
    let own = blocks_in(page, "toml");
    write(
        &bench,
        "fall.toml",
        &own[0].replace("spheres = 300", "spheres = 8").replace("valley.tif", "valley.asc"),
    );
    write(&bench, "study.toml", &own[1].replace("count = 1000", "count = 4"));
    write(&bench, "valley.asc", &slope());
    write(&bench, "barrier.toml", &barrier());
    runs(page, &bench, &[("--scene-of 17", "--scene-of 3")]);
    let few = ("--until road_energy_q95:5% --at-most 5000", "--until road_energy_q95:90% --at-most 12");
    runs("docs/statistics.md", &bench, &[("ensemble study.toml$", "ensemble study.toml --force$"), few]);
    let one = [("barrier.toml --worst 20", "barrier.toml --worst 1 --list-worst --force")];
    runs("docs/line-barrier.md", &bench, &one);
    let parts = [
        ("ensemble study.toml$", "ensemble study.toml --force$"),
        ("study.toml --chunks 16", "study.toml --out out/parts --chunks 2"),
        ("--threads 1 --members", "--out out/parts --threads 1 --members"),
    ];
    runs("docs/machines.md", &bench, &parts);
}

#[test]
fn own_rock() {
    let bench = Bench::new();
    let page = "docs/own-rock.md";
    write(&bench, "fall.toml", &blocks_in(page, "toml")[0].replace("spheres = 300", "spheres = 30"));
    write(&bench, "valley.asc", &slope());
    write(&bench, "boulder.stl", &boulder());
    runs(page, &bench, &[]);
    assert!(bench.path("out/fall/trajectory.svg").exists());
}

/// A box of 0.8 m by 0.7 m by 0.6 m, in STL.
fn boulder() -> String {
    let at = |i: usize| {
        [0.4, 0.35, 0.3].iter().enumerate().map(move |(b, h)| if i >> b & 1 == 1 { *h } else { -*h })
    };
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let facets = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|corners| {
        let vertices = corners.map(|i| {
            let [x, y, z]: [f64; 3] = at(i).collect::<Vec<_>>().try_into().expect("three");
            format!("vertex {x} {y} {z}\n")
        });
        format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", vertices.concat())
    });
    format!("solid boulder\n{}endsolid boulder\n", facets.collect::<String>())
}

/// The barrier of `studies/barrier.toml` just below the release of the page, where some of few rocks come.
fn barrier() -> String {
    let path = repository().join("launch/scenes/studies/barrier.toml");
    let text = std::fs::read_to_string(path).expect("read");
    let line = text.lines().find(|line| line.trim_start().starts_with("line = ")).expect("a line");
    text.replace(line, "line = [[2683030.0, 1247071.0], [2683030.0, 1247059.0]]")
}

#[test]
fn solvers() {
    let bench = Bench::new();
    with_mine(&bench);
    with_repository(&bench);
    runs("docs/solvers.md", &bench, &[("run mine.toml --record", "run mine.toml --force --record")]);
}

#[test]
fn processes() {
    let bench = Bench::new();
    with_mine(&bench);
    with_repository(&bench);
    let changes =
        [("launch/run.sh mine.toml$", "launch/run.sh mine.toml >/dev/null$"), ("taskset", "true taskset")];
    runs("docs/processes.md", &bench, &changes);
}

#[test]
fn clusters() {
    let bench = Bench::new();
    runs("docs/clusters.md", &bench, &[("--spheres 300", "--spheres 20")]);
    assert!(bench.path("rock.xyzr").exists());
}

#[test]
fn structures() {
    let bench = Bench::new();
    with_repository(&bench);
    runs("docs/structures.md", &bench, &[]);
}

#[test]
#[ignore = "long"]
fn approvals_and_barriers() {
    let bench = Bench::new();
    with_repository(&bench);
    write(&bench, "KIT.toml", &blocks_in("docs/approval.md", "toml")[0]);
    let checked = [("-1000.toml", "-1000.toml --dry-run"), ("--vary brake", "--dry-run --vary brake")];
    runs("docs/approval.md", &bench, &checked);
    copy(&bench, "launch/scenes/site.toml", "site.toml");
    std::os::unix::fs::symlink(repository().join("launch/scenes/data"), bench.path("data")).expect("linked");
    let short = " --set end_time=0.004";
    let barrier = [
        ("SCENE", "site.toml".to_owned()),
        ("barrier-sel.toml", format!("barrier-sel.toml{short}")),
        ("barrier-impact.toml", format!("barrier-impact.toml --force{short}")),
    ];
    let barrier = barrier.each_ref().map(|(from, to)| (*from, to.as_str()));
    runs("docs/barrier.md", &bench, &barrier);
    // Of the run before.
    runs(
        "docs/report.md",
        &bench,
        &[("out/barrier-impact --pdf", "out/first"), ("out/barrier-impact", "out/first")],
    );
}

/// Sixty sets, the least that are taken, of balls down the slope of the page's example.
#[test]
#[ignore = "long"]
fn calibration() {
    let bench = Bench::new();
    with_repository(&bench);
    let page = "docs/calibrate.md";
    let scenes = repository().join("launch/scenes");
    let own = |name: &str| std::fs::read_to_string(scenes.join(name)).expect("read");
    let fall = own("slope-fall.toml").replace("data/", "launch/scenes/data/");
    let ball = fall.replace(
        r#"{ type = "norm_rock", form = "111", volume = 0.3 }"#,
        r#"{ type = "sphere", radius = 0.4 }"#,
    );
    write(&bench, "fall.toml", &ball.replace("cluster.spheres = 64\n", ""));
    let varied = |line: &&str| !["contact.0.", "orientation"].iter().any(|key| line.starts_with(key));
    let study = own("studies/slope.toml")
        .replace("../slope-fall.toml", "fall.toml")
        .replace("count = 200", "count = 4");
    write(&bench, "study.toml", &study.lines().filter(varied).collect::<Vec<_>>().join("\n"));
    let file = blocks_in(page, "toml")[0].replace("of = 30", "of = 4");
    write(&bench, "calibrate.toml", &format!("sets = 60\n{file}"));
    let values = "stop_m,speed_m_per_s,jump_height_m\n80,10,0.5\n85,11,0.6\n90,12,0.7\n95,13,0.8\n";
    ["half.csv", "other.csv"].iter().for_each(|name| write(&bench, name, values));
    runs(page, &bench, &[]);
    let found = std::fs::read_to_string(bench.path("out/calibrate/calibration.md")).expect("the page");
    // The heads of the tables are those that the page shows.
    let shown = blocks_in(page, "");
    let columns = |line: &str| line.split('|').map(str::trim).map(str::to_owned).collect::<Vec<_>>();
    for head in
        shown[0].lines().filter(|line| line.starts_with("| parameter") || line.starts_with("| observed"))
    {
        assert!(found.lines().any(|line| columns(line) == columns(head)), "{head}\n{found}");
    }
}

#[test]
fn rings() {
    let bench = Bench::new();
    let example = example("rings");
    let by_name = format!("{} ", example.display());
    // Fewer beams; a panel takes minutes.
    let changes = [
        ("cargo run --release -p fem-solver --example rings -- ", by_name.as_str()),
        ("chain beams=96", "chain beams=8"),
        ("points=4 beams=64", "points=4 beams=24"),
        ("panel rows=45", "chain way=0.01 rows=45"),
    ];
    runs("docs/rings.md", &bench, &changes);
}

#[test]
fn what_accuracy_costs() {
    let bench = Bench::new();
    copy(&bench, "launch/scenes/sphere-on-cable.toml", "scene.toml");
    let short =
        [("SCENE", "scene.toml --set end_time=0.02"), ("--budget 10m", "--runs 8"), ("=0.49514", "=0.0367")];
    runs("docs/trade.md", &bench, &short);
    assert!(bench.path("out/windows/trade.md").exists());
}
