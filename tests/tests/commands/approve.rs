//! A barrier from a kit file: in a scene, and under the launches of an approval test. The kit is coarse, so that all takes seconds.

use interface_defs::Fate;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use tests::browser::{between, browser, shown};
use tests::{Bench, Ended, program, repository, until};
use toolkit::scene::Scene;
use toolkit::summary::Summary;

/// Three fields of 6 m, posts of 2 m, rings of 0.4 m.
const KIT: &str = r#"[kit]
name = "small"
energy = 5e4 # of its largest test [J]

[structure]
supports = [{ group = "feet", rotations = "z" }, { group = "anchors" }]

[structure.generator]
type = "barrier"
height = 2.0
spacing = 6.0
net = "rings"
cells = [15, 5]
post_elements = 2
anchor_distance = 4.0
side_distance = 5.0

[structure.cable] # ropes that do not slide: 16 mm
young = 1e11
area = 1.18e-4
density = 7850.0
radius = 0.008

[[structure.parts]]
name = "rope_brakes"
element = "brake"
stiffness = 3e6
curve = [[0.02, 4e4], [1.2, 5e4]]
stroke = 1.2
mass = 8.0
radius = 0.02

[[structure.parts]]
name = "upslope_brakes"
element = "brake"
stiffness = 3e6
curve = [[0.02, 2.5e4], [1.0, 3e4]]
stroke = 1.0
mass = 6.0
radius = 0.02

[[structure.parts]]
name = "net"
element = "ring"
diameter = 0.4
perimeter = 1.128
perimeter_stiffness = 1e6
bending_stiffness = 2e4
mass = 0.5
radius = 0.006
rupture_force = 1e5

[[structure.parts]]
name = "top_rope"
element = "sliding_cable"
young = 1e11
area = 1.18e-4
density = 7850.0
prestress = 5e7
radius = 0.008
rupture_force = 4e5

[[structure.parts]]
name = "bottom_rope"
element = "sliding_cable"
young = 1e11
area = 1.18e-4
density = 7850.0
prestress = 5e7
radius = 0.008
rupture_force = 4e5

[[structure.parts]]
name = "side_ropes"
element = "cable"
prestress = 5e7
rupture_force = 4e5

[[structure.parts]]
name = "upslope_ropes"
element = "cable"
rupture_force = 4e5

[[structure.parts]]
name = "lateral_ropes"
element = "cable"
rupture_force = 4e5

[[structure.parts]]
name = "posts" # HE 100 B
element = "beam"
young = 2.1e11
area = 2.6e-3
inertia = [4.5e-6, 1.67e-6]
torsion = 9.3e-8
density = 7850.0
radius = 0.05
"#;

/// A block falls into the kit, which stands out from a wall: with so much for the structure.
fn scene(structure: &str) -> String {
    format!(
        r#"
end_time = 0.05
gravity = [0.0, 9.81, 0.0]

[[rock]]
name = "block"
position = [0.0, -0.3, 1.0]
velocity = [0.0, 15.0, 0.0]
mass = 444.0
shape = {{ type = "ead_block", size = 0.6 }}
cluster.spheres = 60

[[contact]]
law = "linear"
stiffness = 1e7
restitution = 0.5

{structure}

[fem]
integrator = "central_difference"
"#
    )
}

fn approve(bench: &Bench, out: &str, arguments: &[&str]) -> Command {
    let kit = bench.path("kit.toml");
    if !kit.exists() {
        std::fs::write(&kit, KIT).expect("written");
    }
    let mut command = Command::new(program("rockfall"));
    command.arg("approve").arg(kit).arg("--out").arg(bench.path(out)).args(["--speed", "15"]);
    if !arguments.contains(&"--time") {
        command.args(["--time", "0.35"]);
    }
    command.args(arguments).current_dir(bench.path("")).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn ended(bench: &Bench, out: &str, arguments: &[&str]) -> Ended {
    Ended::of(approve(bench, out, arguments).output().expect("started"), bench.path(out))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("written")
}

fn approval(ended: &Ended) -> Value {
    serde_json::from_str(&read(&ended.out.join("approval.json"))).expect("JSON")
}

/// A number of a launch of the first case.
fn number<'a>(approval: &'a Value, launch: &str, name: &str) -> &'a Value {
    let rows = launch_rows(approval, launch);
    rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no {name} in {launch}"))
}

/// All of them.
fn launch_rows<'a>(approval: &'a Value, launch: &str) -> &'a [Value] {
    let launches = approval["cases"][0]["launches"].as_array().expect("launches");
    let launch = launches.iter().find(|of| of["launch"] == launch).expect("a launch");
    launch["numbers"].as_array().expect("numbers")
}

/// Every number of the kit as defined stands in the page with all of its digits, in the row of its name, and a browser shows it.
fn is_in_the_page(approval: &Value, out: &Path) {
    let page = read(&out.join("report.html"));
    for launch in approval["cases"][0]["launches"].as_array().expect("launches") {
        for row in launch["numbers"].as_array().expect("numbers") {
            let name = row["name"].as_str().expect("a name");
            let cells = between(&page, &format!("<code>{name}</code>"), "</tr>")
                .unwrap_or_else(|| panic!("no {name}"));
            let vector = row["vector"].as_array().into_iter().flatten();
            for value in [&row["value"], &row["share"], &row["time_s"]]
                .into_iter()
                .chain(vector)
                .filter(|of| of.is_f64())
            {
                assert!(
                    cells.contains(&format!("<data value=\"{value}\">")),
                    "{name}: no {value} in {cells}"
                );
            }
        }
    }
    for criterion in approval["cases"][0]["criteria"].as_array().expect("criteria") {
        assert!(
            page.contains(&format!("<td>{}</td>", criterion["name"].as_str().expect("a name"))),
            "{criterion}"
        );
    }
    if let Some(browser) = browser() {
        let (_, known) = shown(&browser, out, 0.1);
        assert!(known["curves"].as_u64().expect("a count") >= 9, "{known}");
    }
}

#[test]
fn a_scene_with_a_kit_is_the_scene_written_in_full() {
    let bench = Bench::new();
    std::fs::write(bench.path("kit.toml"), KIT).expect("written");
    let of_kit = "[structure]\nkit = \"kit.toml\"\ndamping = 1.0\n[structure.generator]\nanchor_rise = 0.0\n";
    let tables = KIT.split_once("[structure]\n").expect("a structure").1;
    let full = format!("[structure]\ndamping = 1.0\n{tables}")
        .replace("type = \"barrier\"\n", "type = \"barrier\"\nanchor_rise = 0.0\n");
    let first = bench.done(&bench.scene(&scene(of_kit)), "kit", &[]);
    let record = read(&first.out.join("run.json"));
    assert!(record.contains("kit.toml\": \"fnv1a64:"), "{record}");
    // Nothing of the kit is needed any more.
    std::fs::remove_file(bench.path("kit.toml")).expect("removed");
    let resolved = read(&first.out.join("scene.toml"));
    assert!(!resolved.contains("kit"), "{resolved}");
    let again = bench.done(&first.out.join("scene.toml"), "again", &[]);
    let second = bench.done(&bench.scene(&scene(&full)), "full", &[]);
    assert!(first.rows() > 20 && first.history() == second.history() && first.history() == again.history());

    // The structure's program alone reads the same.
    std::fs::write(bench.path("kit.toml"), KIT).expect("written");
    let alone = "end_time = 0.01\ngravity = [0.0, 9.81, 0.0]\n";
    let histories = [of_kit, &full].map(|structure| {
        let scene = bench.scene(&format!("{alone}{structure}"));
        let out = bench.path("alone");
        let done = Command::new(program("fem-solver"))
            .arg("run")
            .arg(scene)
            .arg("--out")
            .arg(&out)
            .arg("--force")
            .output();
        let done = done.expect("started");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        read(&out.join("history.csv"))
    });
    assert_eq!(histories[0], histories[1]);

    // A value that a program refuses is said with file and line of the kit.
    std::fs::write(bench.path("kit.toml"), KIT.replace("stroke = 1.2", "strok = 1.2")).expect("written");
    let refused = bench.run(&bench.scene(&scene(of_kit)), "refused", &[]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(refused.stderr.contains("kit.toml:29:1: unknown key `strok`"), "{}", refused.stderr);
    assert!(!bench.path("refused").exists());
}

#[test]
#[ignore = "long"]
fn every_criterion_has_the_number_of_its_run_and_an_interrupted_study_gives_the_same_bytes() {
    let bench = Bench::new();
    let weak = ["--sel", "16.5", "--vary", "structure.parts.2.rupture_force=2000"];
    let ended = ended(&bench, "out", &weak);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    let approval = approval(&ended);
    assert_eq!((&approval["verdict"], &approval["class"]), (&"pass".into(), &0.into()), "{approval:#}");
    assert!(ended.stdout.contains("verdict: pass (1 of 2 cases failed); "), "{}", ended.stdout);
    // The report is kept, and has what concludes from it.
    assert_eq!(read(&ended.out.join("approval.txt")), ended.stdout);
    for words in [
        "/kit.toml, fnv1a64:",
        "; rockfall 0.2.0; 20",
        "h_N m",
        "run again",
        "failed criteria",
        "after MEL (A from 0.5, B from 0.3, else C; no criterion)",
        "small at 50 kJ, as defined: it keeps every criterion that was assessed. 1 of 1 variations change that",
        "This is a computation, and no approval.",
    ] {
        assert!(ended.stdout.contains(words), "{words}: {}", ended.stdout);
    }
    // No verdict on the block where block and net settle; a try that fails, as other spheres lie in the net, is followed by another.
    let settling = ended.stderr.lines().filter(|line| line.contains("settling phase"));
    let settling: Vec<&str> = settling.filter(|line| !line.contains("failed: ")).collect();
    assert!(!settling.is_empty() && settling.iter().all(|line| !line.contains("rock `")), "{settling:#?}");
    assert!(settling.iter().any(|line| line.contains("settling phase: residual height ")), "{settling:#?}");
    let dir = ended.out.join("runs/as_defined");
    let of = |number: &Value| number["value"].as_f64().expect("a number");
    for (launch, run, energy) in
        [("SEL 1", "sel_1", 16.5e3), ("SEL 2", "sel_2", 16.5e3), ("MEL", "mel", 50e3)]
    {
        // One that is not to be trusted was made again.
        let finer = dir.join(format!("{run}_accurate"));
        let place = if finer.exists() { finer } else { dir.join(run) };
        let summary = Summary::read(&place).expect("a summary");
        let measure = |name: &str| summary.measure(name).unwrap_or_else(|| panic!("no {name}"));
        let found = |name: &str| of(number(&approval, launch, name));
        for name in ["impact_energy", "impact_speed", "max_elongation"] {
            assert_eq!(found(name), measure(name), "{launch} {name}");
        }
        // It touches with the energy of the test: the corners of the block are cut, and come a little later.
        assert!((found("impact_energy") / energy - 1.0).abs() < 0.01, "{launch}: {}", found("impact_energy"));
        let way = summary.measures.iter().find(|m| m.name == "max_elongation").expect("a way");
        let time = way.time.expect("a time") - measure("time_of_impact");
        assert!((found("braking_time") - time).abs() < 1e-12, "{launch}");
        let fall = found("block_mass") * 9.81 * way.value;
        assert!((found("absorbed_energy") - found("impact_energy") - fall).abs() < 1e-6 * fall, "{launch}");
        assert_eq!(found("top_rope tension"), measure("approve_top_rope_tension_max"));
        // Less what is elastic; of the most used brake it is what `parts` of the run says.
        let off = measure("approve_rope_brakes_1_elongation_max") - found("rope_brakes 1 travel");
        assert!((0.0..5e4 / 3e6).contains(&off), "{launch}: {off}");
        let travels = |row: &&Value| {
            row["name"].as_str().is_some_and(|of| of.starts_with("rope_brakes") && of.ends_with("travel"))
        };
        let shares =
            launch_rows(&approval, launch).iter().filter(travels).filter_map(|row| row["share"].as_f64());
        let brakes = summary.parts.iter().find(|part| part.part == "rope_brakes").expect("brakes");
        let most = shares.fold(0.0, f64::max);
        assert!((most - brakes.share()).abs() < 2e-3, "{launch}: {most} {brakes:?}");
        // Energies of parts sum up to that of the structure.
        let parts: f64 =
            summary.parts.iter().map(|part| found(&format!("energy {} dissipated", part.part))).sum();
        let whole: f64 = summary.parts.iter().map(|part| part.dissipated).sum();
        assert!(
            parts == whole && whole > 0.5 * found("energy structure_dissipated"),
            "{launch}: {parts} {whole}"
        );
        let share = number(&approval, launch, "top_rope tension")["share"].as_f64().expect("a share");
        assert!((share - found("top_rope tension") / 4e5).abs() < 1e-12);
        // A mean of a force that is not negative lies below its peaks, and the peak of means below that of their parts.
        let [mean, smooth, raw] =
            ["mean", "peak_1ms", "peak_raw"].map(|name| found(&format!("block_force_{name}")));
        assert!(0.0 < mean && mean < smooth && smooth <= raw, "{launch}: {mean} {smooth} {raw}");
        // A brake that stays elastic does no work.
        let rows = approval["cases"][0]["launches"].as_array().expect("launches").iter();
        let works = rows.flat_map(|of| of["numbers"].as_array().expect("numbers"));
        let mut works = works.filter(|row| row["name"].as_str().is_some_and(|of| of.ends_with(" work")));
        assert!(works.all(|row| of(row) >= 0.0), "{approval:#}");
        let work = found("energy brakes");
        assert!(0.0 < work && work < found("energy structure_dissipated") * 1.01, "{launch}: {work}");
        // A post is one, of however many beams.
        let rows = approval["cases"][0]["launches"][0]["numbers"].as_array().expect("numbers");
        assert_eq!(
            rows.iter().filter(|row| row["name"].as_str().is_some_and(|of| of.ends_with("tilt"))).count(),
            4
        );
        let foot = number(&approval, launch, "foot_1 force");
        let vector: Vec<f64> =
            foot["vector"].as_array().expect("three").iter().filter_map(Value::as_f64).collect();
        assert!((vector.iter().map(|f| f * f).sum::<f64>().sqrt() / of(foot) - 1.0).abs() < 1e-12);
    }
    is_in_the_page(&approval, &ended.out);
    // Block left in, at rest: that of the run which brings it there.
    let last = ["sel_1_rest_4", "sel_1_rest_3", "sel_1_rest_2", "sel_1_rest_1"].map(|name| dir.join(name));
    let last = last.iter().find(|place| place.join("summary.json").exists()).expect("at rest");
    let height =
        Summary::read(last).expect("a summary").measure("approve_left_height_end").expect("a height");
    let [left, share, before] = ["h_R", "h_R/h_N", "h_N"].map(|name| of(number(&approval, "SEL 1", name)));
    assert_eq!(left, height);
    assert!(
        share == left / before && (0.7..0.8).contains(&share) && (1.9..2.0).contains(&before),
        "{share} {before}"
    );
    // The nominal height is that before the first launch, however low the net hangs before the second.
    let second = if dir.join("sel_2_accurate").exists() { "sel_2_accurate" } else { "sel_2" };
    let history = read(&dir.join(second).join("history.csv"));
    let mut rows = history.lines().map(|row| row.split(','));
    let column = rows.next().expect("names").position(|name| name == "approve_top_height_m");
    let lower = rows.next().expect("a row").nth(column.expect("a height")).expect("a cell");
    let lower: f64 = lower.parse().expect("a number");
    assert!(of(number(&approval, "SEL 2", "h_N")) == before && lower < before, "{lower} {before}");
    // The second launch hits a net that hangs lower, with brakes that have given way.
    let used = |launch| of(number(&approval, launch, "rope_brakes 1 travel"));
    assert!(used("SEL 2") > used("SEL 1"), "{} {}", used("SEL 2"), used("SEL 1"));
    let scene = Scene::load(&dir.join("sel_2.toml"), &[]).expect("a scene").document().expect("a table");
    assert!(scene["rock"][0]["position"][1].as_float() > Some(0.0), "{}", scene["rock"]);
    // A row for each number, in the table too.
    let table = read(&ended.out.join("approval.csv"));
    assert!(table.starts_with("case,launch,name,value,unit,time_s,share,x,y,z,member,note\n"), "{table}");
    let cases = approval["cases"].as_array().expect("cases");
    let launches = cases.iter().filter_map(|case| case["launches"].as_array()).flatten();
    let rows: usize = launches.map(|launch| launch["numbers"].as_array().map_or(0, Vec::len)).sum();
    assert_eq!(table.lines().count() - 1, rows);
    // A weak net fails by name.
    assert_eq!(approval["cases"][1]["verdict"], "fail", "{approval:#}");
    let criteria = approval["cases"][1]["criteria"].as_array().expect("criteria");
    let failed: Vec<&Value> = criteria.iter().filter(|criterion| criterion["result"] == "fail").collect();
    assert_eq!(
        (&failed[0]["launch"], &failed[0]["name"]),
        (&"SEL 1".into(), &"stopped".into()),
        "{criteria:#?}"
    );
    assert_eq!(approval["cases"][1]["launches"][0]["fate"], Fate::WentThrough.name());
    let stands = approval["stands"].as_str().expect("a sentence");
    let first =
        "pass (1 of 2 cases failed); structure.parts.2.rupture_force=2000 makes it FAIL: SEL 1 stopped, ";
    assert!(stands.starts_with(first) && stands.contains(", MEL stopped"), "{stands}");
    // What tore is used up.
    let used = &approval["cases"][1]["utilisation"][0];
    assert!(used["name"] == "net" && used["of"] == "torn" && used["share"].as_f64() >= Some(1.0), "{used}");

    // The first case of the same test is there; the second one is interrupted in the middle of its run.
    std::fs::create_dir_all(bench.path("cut/runs")).expect("created");
    let copied = Command::new("cp")
        .arg("-r")
        .args(["out/runs/as_defined", "cut/runs/as_defined"])
        .current_dir(bench.path(""))
        .status();
    assert!(copied.expect("started").success());
    let child = approve(&bench, "cut", &weak).spawn().expect("started");
    let history = bench.path("cut/runs/structure.parts.2.rupture_force=2000/sel_1/history.csv");
    until("the second case", || (std::fs::metadata(&history).ok()?.len() > 0).then_some(()));
    kill_process(Pid::from_child(&child), Signal::INT).expect("it runs");
    let cut = Ended::of(child.wait_with_output().expect("ended"), bench.path("cut"));
    assert_eq!(cut.code, Some(1), "{}", cut.stderr);
    assert!(
        cut.stderr.contains("1 of 2 cases are judged") && cut.stderr.contains("the same command goes on"),
        "{}",
        cut.stderr
    );
    let again = self::ended(&bench, "cut", &weak);
    assert_eq!(again.code, Some(0), "{}", again.stderr);
    assert!(!again.stderr.contains("as defined, "), "what was finished is kept: {}", again.stderr);
    for name in ["approval.json", "approval.csv"] {
        assert_eq!(read(&again.out.join(name)), read(&ended.out.join(name)), "{name}");
    }
    // Another test does not take the place of this one.
    let other = self::ended(&bench, "out", &["--sel", "15", "--no-variations"]);
    assert_eq!(other.code, Some(2), "{}", other.stderr);
    assert!(other.stderr.contains("of another test") && other.stderr.contains("--force"), "{}", other.stderr);
}

#[test]
#[ignore = "long"]
fn what_cannot_be_tested_is_refused_before_anything_starts() {
    let bench = Bench::new();
    let refused = |arguments: &[&str], what: &[&str]| {
        let ended = ended(&bench, "out", arguments);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        what.iter().for_each(|what| assert!(ended.stderr.contains(what), "{}", ended.stderr));
        assert!(!bench.path("out").exists(), "{arguments:?} left something");
    };
    refused(&["--energy", "200"], &["has an edge of 0.9865", "a third of the height", "--speed "]);
    refused(&["--density", "2000"], &["--density", "2000 kg/m3", "2500 to 3000"]);
    refused(&["--energy=0"], &["--energy", "must lie above 0"]);
    refused(&["--energy", "1e-3"], &["--energy", "has 1 J: barriers are tested with 5000 J", "in kJ"]);
    refused(&["--time", "1e-3"], &["--time", "nothing is stopped so soon"]);
    refused(&["--sel", "20"], &["--sel", "more than a third of the largest launch, 50 kJ"]);
    refused(&["--vary", "brake_force"], &["there is no `=`"]);
    refused(&["--vary", "brake_force=much"], &["`much` is not a number"]);
    refused(&["--vary", "place=moon"], &["`moon` is not a place: post, edge_field, top_rope"]);
    refused(&["--vary", "bundle_factor=2"], &["there is nothing in the kit that `bundle_factor` changes"]);
    refused(&["--vary", "structure.parts.0.strok=2"], &["unknown key `strok`", "structure.parts.0.strok=2"]);
    refused(
        &["--set", "structure.generator.line=[[0.0, 0.0], [9.0, 0.0]]"],
        &["the test has a site of its own"],
    );
    // Nor does a directory that holds something else become one of results.
    std::fs::create_dir(bench.path("other")).expect("created");
    std::fs::write(bench.path("other/notes.txt"), "mine").expect("written");
    let other = ended(&bench, "other", &[]);
    assert_eq!(other.code, Some(2), "{}", other.stderr);
    assert!(other.stderr.contains("holds something else"), "{}", other.stderr);
    assert_eq!(std::fs::read_dir(bench.path("other")).expect("there").count(), 1);
    // What is wrong with the structure is said of the kit, though its site is checked elsewhere.
    std::fs::write(bench.path("kit.toml"), KIT.replace("name = \"net\"\n", "name = \"nets\"\n"))
        .expect("written");
    refused(&[], &["kit.toml:", "`net`"]);
    let mesh =
        KIT.split_once("[structure.generator]").expect("a generator").0.to_owned() + "mesh = \"net.inp\"\n";
    std::fs::write(bench.path("kit.toml"), mesh).expect("written");
    refused(&[], &["kit.toml:", "the test is of a barrier"]);
    std::fs::write(bench.path("kit.toml"), KIT.replace("energy = 5e4 # of its largest test [J]\n", ""))
        .expect("written");
    refused(&[], &["kit.toml:1:", "the energy of the largest launch is not known", "--energy KJ"]);
    let contradiction = KIT.replace("energy = 5e4", "class = 5\nenergy = 5e5");
    std::fs::write(bench.path("kit.toml"), contradiction).expect("written");
    let said = "class 5 is of at least 2000 kJ, and `energy` is 500 kJ, of class 2";
    refused(&[], &["kit.toml:3:", said, "class = 2, or a higher energy"]);
    std::fs::write(bench.path("kit.toml"), KIT.replace("type = \"barrier\"", "type = \"ring_net\""))
        .expect("written");
    refused(&[], &["the test is of a barrier"]);
    // An element in no part: where in the kit, and what to write.
    let (before, after) = KIT.split_once("[structure.cable]").expect("a cable");
    let parts = &after[after.find("[[structure.parts]]").expect("parts")..];
    let without = parts.replace("[[structure.parts]]\nname = \"side_ropes\"\nelement = \"cable\"\nprestress = 5e7\nrupture_force = 4e5\n", "");
    assert_ne!(parts, without);
    std::fs::write(bench.path("kit.toml"), before.to_owned() + &without).expect("written");
    refused(
        &[],
        &["kit.toml:5:", "`side_ropes` is in no part", "with name = \"side_ropes\", element = \"cable\""],
    );
}

#[test]
fn a_kit_is_checked_without_a_run_and_rockfall_check_says_how() {
    let bench = Bench::new();
    let steel = KIT.find("young = 2.1e11\narea = 2.6e-3").expect("posts");
    let kit = KIT[..steel].to_owned() + "section = \"HE 100 B\"\nsteel = \"S235\"\nradius = 0.05\n";
    std::fs::write(bench.path("kit.toml"), kit).expect("written");
    let dry = ended(&bench, "out", &["--dry-run", "--sel", "16", "--vary", "place=post"]);
    assert_eq!(dry.code, Some(0), "{}", dry.stderr);
    assert!(
        dry.stdout.contains("place=post  SEL 1, SEL 2, MEL") && dry.stdout.contains("nothing was run"),
        "{}",
        dry.stdout
    );
    let row = dry.stdout.lines().find(|line| line.starts_with("as defined")).expect("a case");
    let mut last = row.split_whitespace().rev().map(|cell| cell.parse::<f64>().expect("a number"));
    let [most, least] = [0, 1].map(|_| last.next().expect("two"));
    assert!((1.0..7.0).contains(&(most / least)), "{row}");
    let weak = "structure.parts.8.up: `posts` stand with the weak axis";
    assert!(dry.stderr.contains("kit.toml:") && dry.stderr.matches(weak).count() == 1, "{}", dry.stderr);
    assert!(!bench.path("out").exists());
    let check =
        Command::new(program("rockfall")).arg("check").arg(bench.path("kit.toml")).output().expect("started");
    let said = String::from_utf8_lossy(&check.stderr);
    assert!(
        check.status.code() == Some(2) && said.contains("this is a kit") && said.contains("--dry-run"),
        "{said}"
    );
}

#[test]
fn the_kits_that_come_with_the_project_are_valid_and_their_brakes_have_room() {
    for entry in std::fs::read_dir(repository().join("launch/kits")).expect("kits").flatten() {
        let (kit, about) = Scene::load_kit(&entry.path()).expect("a kit");
        assert!(about.name.is_some() && about.energy.is_some() && about.class.is_some());
        let document = kit.document().expect("a table");
        let structure = &document["structure"];
        let brakes = structure["parts"]
            .as_array()
            .expect("parts")
            .iter()
            .find(|part| part["name"].as_str() == Some("rope_brakes"));
        let stroke = brakes.expect("brakes")["stroke"].as_float().expect("a stroke");
        // Of the bottom rope, before the outer post; a brake is 1 m long.
        let side = structure["generator"]["side_distance"].as_float().expect("a distance");
        assert!(0.5 * side - 1.0 > stroke, "{}", entry.path().display());
    }
}
