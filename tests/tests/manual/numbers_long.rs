//! Numbers of the manual that take minutes to compute: what the tables vary by `--set`, and what examples print, compared with the pages as in
//! `numbers.rs`. `.ci/nightly numbers`; with ROCKFALL_BLESS=1 the pages are written anew.

use std::path::Path;
use std::process::Command;
use tests::manual::{holds, holds_about, reached, rings, without};
use tests::{Bench, Ended, example, program, repository, scene};

/// A scene with these `--set`s, whatever it says of itself in the end.
fn run_of(bench: &Bench, scene: &Path, out: &str, sets: &[&str]) -> Ended {
    let own = sets.iter().chain(&["processes.wait=event"]).flat_map(|set| ["--set", *set]);
    let words: Vec<&str> = ["--force", "--quiet"].into_iter().chain(own).collect();
    let ended = bench.run(scene, out, &words);
    println!("{sets:?}: {:?} {}", ended.code, ended.stderr.lines().last().unwrap_or_default());
    assert!(matches!(ended.code, Some(0 | 3)), "{sets:?}: {}", ended.stderr);
    ended
}

fn run(bench: &Bench, name: &str, sets: &[&str]) -> Ended {
    run_of(bench, &scene(name), "out", sets)
}

/// The longest window in which `rockfall check` expects weak coupling to be stable [s].
fn longest_weak_window(name: &str, sets: &[&str]) -> f64 {
    let own = sets.iter().flat_map(|set| ["--set", *set]);
    let words = ["check", "--format", "json"].into_iter().chain(own);
    let output = Command::new(program("rockfall")).args(words).arg(scene(name)).output().expect("started");
    let checked: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    checked["longest_weak_window_s"].as_f64().expect("a number")
}

/// A count of the coupling.
fn count(ended: &Ended, name: &str) -> f64 {
    ended.summary()["coupling"][name].as_f64().unwrap_or_else(|| panic!("no {name}"))
}

/// What an example of the workspace prints.
fn printed(name: &str, arguments: &str) -> String {
    let output = Command::new(example(name)).args(arguments.split_whitespace()).output().expect("started");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// A row that an example prints as the page has it: the first `keys` cells say which one it is; of each cell up to `last` that begins with a
/// number, that number is compared.
fn holds_row(page: &str, row: &str, keys: usize, last: usize) {
    let cells: Vec<&str> = row.trim().trim_matches('|').split('|').map(str::trim).collect();
    let mut values = Vec::new();
    let own = cells.iter().enumerate().take(last).map(|(at, cell)| {
        let (first, rest) =
            cell.split_once(' ').map_or((*cell, String::new()), |(a, b)| (a, format!(" {b}")));
        match first.parse::<f64>() {
            Ok(value) if at >= keys => {
                values.push(value);
                format!("{{}}{rest}")
            }
            _ => (*cell).to_owned(),
        }
    });
    let template = format!("| {} |", own.collect::<Vec<_>>().join(" | "));
    println!("{template} {values:?}");
    holds(page, &template, &values);
}

/// What a table calls a variant of the barrier, and its runs.
const VARIED: &[(&str, &[&[&str]])] = &[
    (
        "bundle factor of the rings 1.6, 2.6 (here 1)",
        &[&["structure.parts.2.bundle_factor=1.6"], &["structure.parts.2.bundle_factor=2.6"]],
    ),
    (
        "friction in the bearing ropes 0.1, 0.3 (here 0)",
        &[
            &["structure.parts.3.friction=0.1", "structure.parts.4.friction=0.1"],
            &["structure.parts.3.friction=0.3", "structure.parts.4.friction=0.3"],
        ],
    ),
    (
        "force of all brakes x 0.8",
        &[&[
            "structure.parts.0.curve=[[0.03,9.6e4],[1.6,1.2e5]]",
            "structure.parts.1.curve=[[0.02,5.6e4],[1.2,7.2e4]]",
        ]],
    ),
    (
        "force of all brakes x 1.2",
        &[&[
            "structure.parts.0.curve=[[0.03,1.44e5],[1.6,1.8e5]]",
            "structure.parts.1.curve=[[0.02,8.4e4],[1.2,1.08e5]]",
        ]],
    ),
    (
        "brakes 20 % stronger at 5 m/s",
        &[&["structure.parts.0.speed=[[5.0,1.2]]", "structure.parts.1.speed=[[5.0,1.2]]"]],
    ),
    (
        "friction of the block 0.2, 0.6 (here 0.4)",
        &[&["contact.0.friction=0.2"], &["contact.0.friction=0.6"]],
    ),
    ("contact of the block 5e6 N/m (here 1e7)", &[&["contact.0.stiffness=5e6"]]),
    (
        "ropes of 70 GPa (here 94.5)",
        &[&[
            "structure.parts.3.young=7e10",
            "structure.parts.4.young=7e10",
            "structure.parts.5.young=7e10",
            "structure.parts.6.young=7e10",
            "structure.parts.7.young=7e10",
        ]],
    ),
    ("posts of S355", &[&["structure.parts.8.steel=S355"]]),
    (
        "feet and anchors on 2e7 N/m",
        &[&[
            "structure.supports=[{group=\"feet\",rotations=\"z\",stiffness=2e7},{group=\"anchors\",stiffness=2e7}]",
        ]],
    ),
    ("impact 1 m beside the middle", &[&["rock.0.position=[1.0,-0.05,2.0]"]]),
    ("impact 0.5 m above the middle", &[&["rock.0.position=[0.0,-0.05,2.5]"]]),
];

#[test]
#[ignore = "long"]
fn a_barrier_of_which_little_is_known() {
    let bench = Bench::new();
    let page = "docs/measured/barrier-impact.md";
    for (what, cases) in VARIED {
        let mut unreliable = false;
        let runs: Vec<[f64; 6]> = (cases.iter())
            .map(|sets| {
                let ended = run(&bench, "barrier-impact", sets);
                let kilo = |name: &str| ended.measure(name) / 1e3;
                let summary = ended.summary();
                unreliable |= summary["status"] == "unreliable";
                println!("{what}: {} torn {}", summary["status"], summary["torn"]);
                let torn = ["elements", "first"].map(|key| summary["torn"][0][key].as_f64().unwrap_or(0.0));
                let strength = 0.9 * 0.356 * 0.022_f64.powi(2) * 1.77e9 / 1e3;
                match sets[0] {
                    "structure.parts.2.bundle_factor=2.6" => {
                        holds_about(page, "with the bundle factor 2.6 ({} of 1 080, from {} s)", &torn);
                    }
                    set if set.contains("supports") => {
                        holds_about(page, "the largest force of a foot is {} kN", &[kilo("feet_force_max")]);
                        assert_eq!(torn, [0.0; 2]);
                    }
                    set => {
                        assert_eq!(torn, [0.0; 2], "{set}");
                        if set == "structure.parts.3.friction=0.3" {
                            let share = 100.0 * kilo("bottom_rope_tension_max") / strength;
                            holds_about(page, "the bottom rope reaches {} % of its strength", &[share]);
                        }
                    }
                }
                let strain = summary["measures"]["max_plastic_strain"]["value"].as_f64();
                [
                    ended.measure("max_travel"),
                    ended.measure("rope_brakes_elongation_max"),
                    kilo("bottom_rope_tension_max"),
                    kilo("side_ropes_tension_max"),
                    kilo("max_reaction_10ms"),
                    100.0 * strain.unwrap_or(0.0),
                ]
            })
            .collect();
        // Behind a number may stand a remark; a run that is not reliable is so by its reaction.
        let remark = |at: usize| match (*what, at) {
            ("force of all brakes x 0.8", 1) => ", at the stop",
            (_, 4) if unreliable => ", unreliable",
            _ => "",
        };
        let cell = vec!["{}"; cases.len()].join(", ");
        let cells: Vec<String> = (0..6).map(|at| format!("{cell}{}", remark(at))).collect();
        let values: Vec<f64> = (0..6).flat_map(|at| runs.iter().map(move |run| run[at])).collect();
        holds_about(page, &format!("| {what} | {} |", cells.join(" | ")), &values);
    }
}

#[test]
#[ignore = "long"]
fn a_barrier_in_weak_windows() {
    let bench = Bench::new();
    for window in ["1.25e-5", "2.5e-5", "4.8e-5", ""] {
        let keys = ["coupling.time_window", "dem.time_step", "fem.time_step"];
        let steps = keys.map(|key| format!("{key}={window}"));
        let mut sets: Vec<&str> = steps.iter().map(String::as_str).chain(["coupling.scheme=weak"]).collect();
        let mut row = format!("weak, {window}");
        if window.is_empty() {
            sets.clear();
            row = "as shipped: yielding net, 4.2e-4, steps 3.8e-5".into();
        }
        let ended = run(&bench, "barrier-impact", &sets);
        let deflection = ended.measure("max_deflection");
        let values =
            [deflection, ended.measure("max_reaction_1ms") / 1e3, 100.0 * ended.measure("energy_error")];
        println!("{row} {values:?} {}", ended.summary()["status"]);
        holds_about("docs/measured/defaults.md", &format!("| {row} | {{}} | {{}} | {{}} % |"), &values);
        let words = match window {
            "2.5e-5" => "friction of the block): {} m with weak coupling in windows of 2.5e-5 s",
            "" => "2.5e-5 s, {} m as shipped, in windows of 0.42 ms",
            _ => continue,
        };
        holds_about("docs/measured/yielding-net.md", words, &[deflection]);
    }
}

#[test]
#[ignore = "long"]
fn energy_of_weak_coupling() {
    let bench = Bench::new();
    let windows = ["1e-5", "2e-5", "5e-5", "1e-4"];
    let (rock, smooth) =
        (["rock.0.cluster.spheres=4096", "contact.0.friction=1.0"], ["contact.0.friction=0.0"]);
    for (row, own, from) in [
        ("`walenstadt-exp1`", &[][..], 0),
        ("the same without friction", &smooth, 0),
        ("the same, 4 096 spheres, friction 1.0", &rock, 3),
    ] {
        let errors: Vec<f64> = (windows[from..].iter())
            .map(|window| {
                let keys = ["coupling.time_window", "dem.time_step", "fem.time_step"];
                let steps = keys.map(|key| format!("{key}={window}"));
                let weak = steps.iter().map(String::as_str).chain(["coupling.scheme=weak"]);
                let sets: Vec<&str> = weak.chain(own.iter().copied()).collect();
                let ended = run(&bench, "walenstadt-exp1", &sets);
                100.0 * ended.measure("energy_error")
            })
            .collect();
        let longest = longest_weak_window("walenstadt-exp1", &[own, &["coupling.scheme=weak"]].concat());
        println!("{row} {errors:?} {longest}");
        let cells = "- | ".repeat(from) + &vec!["{} %"; 4 - from].join(" | ");
        let beyond = if from == 0 { "failed" } else { "-" };
        holds(
            "docs/measured/schemes.md",
            &format!("| {row} | {cells} | {beyond} | {{}} |"),
            &[&errors[..], &[longest]].concat(),
        );
    }
    for friction in [&[][..], &smooth] {
        let own = [friction, &["coupling.scheme=weak", "coupling.time_window=2e-4"]].concat();
        let words: Vec<&str> = own.iter().flat_map(|set| ["--set", *set]).chain(["--force"]).collect();
        assert_eq!(bench.run(&scene("walenstadt-exp1"), "out", &words).code, Some(1), "{own:?}");
    }
    let ended = run(&bench, "walenstadt-exp1", &[]);
    holds(
        "docs/measured/schemes.md",
        "`walenstadt-exp1` gains {} of the energy",
        &[ended.measure("energy_error")],
    );
}

#[test]
#[ignore = "long"]
fn iterations_by_acceleration() {
    let bench = Bench::new();
    let page = "docs/measured/schemes.md";
    let of = |name: &str, window: &str, own: &[&str]| {
        let window = format!("coupling.time_window={window}e-3");
        let case: &[&str] = match name {
            "cable-net" => &["dem.time_step=2e-5", "end_time=0.2"],
            _ => &["end_time=0.9"],
        };
        let ended = run(&bench, name, &[&["coupling.scheme=strong", &window], case, own].concat());
        let [all, halved, windows] =
            ["iterations", "windows_halved", "windows"].map(|key| count(&ended, key));
        let measure = if name == "cable-net" { "centre_uz_min" } else { "max_deflection" };
        println!("{all} {halved} {windows} {}", ended.measure(measure));
        ([all / (windows + halved), all, halved], ended.measure(measure))
    };
    for (name, window) in [
        ("walenstadt-compare", "0.5"),
        ("walenstadt-compare", "1"),
        ("walenstadt-exp1", "0.2"),
        ("cable-net", "0.5"),
    ] {
        let runs = ["aitken", "anderson", "iqn_ils"]
            .map(|how| of(name, window, &[&format!("coupling.acceleration.type={how}")]));
        let cells = ["{} ({}, {})"; 3].join(" | ");
        holds(page, &format!("| `{name}`, {window} ms | {cells} |"), &runs.map(|run| run.0).concat());
        if (name, window) == ("walenstadt-compare", "0.5") {
            let [least, most] = range(&runs.map(|run| run.1));
            holds(page, "Deflections at 0.5 ms differ by {}.", &[most / least - 1.0]);
        }
    }
    let reused = [("0.5", "1"), ("1", "1"), ("0.5", "5")].map(|(window, before)| {
        let before = format!("coupling.acceleration.reused_windows={before}");
        of("walenstadt-compare", window, &["coupling.acceleration.type=iqn_ils", &before]).0
    });
    let words = "IQN-ILS takes {} iterations at 0.5 ms and {} at 1 ms ({} and {} windows halved), with 5 at 0.5 ms {}:";
    let values = [reused[0][1], reused[1][1], reused[0][2], reused[1][2], reused[2][1]];
    println!("{values:?}");
    holds(page, words, &values);
}

#[test]
#[ignore = "long"]
fn spheres_and_moduli_of_the_drop_test() {
    let bench = Bench::new();
    let page = "docs/measured/drop-test.md";
    let run = |spheres: &str, own: &[&str]| {
        let spheres = format!("rock.0.cluster.spheres={spheres}");
        run(&bench, "walenstadt-compare", &[&["end_time=0.78", &spheres], own].concat())
    };
    let of = |spheres: &str, own: &[&str]| {
        let ended = run(spheres, own);
        ["max_deflection", "max_reaction_1ms", "energy_error"].map(|name| ended.measure(name))
    };
    let strong = ["coupling.scheme=strong", "coupling.time_window=2e-4"];
    let rock = |spheres: &str, young: &str| {
        let young = format!("contact.0.young={young}");
        of(spheres, &[&strong[..], &["contact.0.law=hertz_rock", &young]].concat())
    };
    let mut all = Vec::new();
    for (row, count) in [("4 096", "4096"), ("21 952", "21952")] {
        let (weak, strongly) = (of(count, &[]), of(count, &strong));
        let values = [weak[0], strongly[0], weak[1], strongly[1], weak[2], strongly[2]];
        println!("{row} {values:?}");
        holds(page, &format!("| {row} | {{}} | {{}} | {{}} / {{}} | {{}} / {{}} |"), &values);
        let rock = rock(count, "1e8");
        println!("hertz_rock {rock:?}");
        let remark = if count == "21952" { " (wires half a radius between spheres)" } else { "" };
        let values = [strongly[0], strongly[1], rock[0], rock[1]];
        holds(page, &format!("| {row} | {{}}, {{}}{remark} | {{}}, {{}} |"), &values);
        all.push(rock);
    }
    let moduli = ["1e8", "1e9", "1e10"].map(|young| rock("64", young));
    println!("{moduli:?}");
    let values: Vec<f64> = moduli.iter().flat_map(|row| [row[0], row[1]]).collect();
    holds(page, "| 64 | 0.49514, 33 823 | {}, {} | {}, {} | {}, {} |", &values);
    let apart = [0, 1].map(|at| (all[1][at] / moduli[0][at] - 1.0).abs());
    holds(page, "`hertz_rock` differs by {} in the deflection and by {} in the reaction", &apart);
    let stiff = of("21952", &[&strong[..], &["contact.0.young=1e9"]].concat());
    holds(page, "(21 952 of 1e9 Pa: {} m)", &stiff[..1]);
    let finer = [
        "coupling.scheme=strong",
        "coupling.time_window=1e-4",
        "dem.time_step=2.5e-6",
        "fem.time_step=1.25e-5",
    ];
    let finer = of("64", &[&finer[..], &["contact.0.law=hertz_rock"]].concat());
    holds(page, "two times finer give {} m", &finer[..1]);
    let samples = of("21952", &[&strong[..], &["coupling.samples=4"]].concat());
    println!("{apart:?} {stiff:?} {finer:?} {samples:?}");
    holds(page, "exchanges its motion at four instants and gives {} N", &samples[1..2]);
    let share = run("21952", &[]).summary()["coupling"]["residual_energy_share"].as_f64().expect("a number");
    holds(page, "its interface residual is {} % of the energy at impact", &[100.0 * share]);
    let short = ["coupling.time_window=1e-5", "dem.time_step=1e-5", "fem.time_step=1e-5"];
    holds(page, "weak windows of 1e-5 s {} N)", &of("21952", &short)[1..2]);
}

/// The least and the largest.
fn range(values: &[f64]) -> [f64; 2] {
    [
        values.iter().copied().fold(f64::INFINITY, f64::min),
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

#[test]
#[ignore = "long"]
fn a_drape_net_by_rounding() {
    let bench = Bench::new();
    let page = "docs/measured/drape.md";
    let held = "structure.supports=[{ group = \"y_min\", motion = [[0.0, 0.0, 1.149, 0.964]] }, { group = \"y_max\" }]";
    let four = [
        "rock.0.cluster.spheres=40",
        "rock.0.cluster.spheres=100",
        "rock.0.cluster.spheres=200",
        "structure.damping=1e-9",
    ];
    let speeds = |ended: &Ended| -> Vec<f64> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| ended.column(&format!("block_v{axis}_m_per_s")));
        (0..x.len()).map(|i| x[i].hypot(y[i]).hypot(z[i])).collect()
    };
    let edge =
        |ended: &Ended| ended.column("block_y_m").iter().position(|y| *y >= 8.55).map(|at| speeds(ended)[at]);
    let largest = |ended: &Ended, names: [&str; 3]| {
        let [x, y, z] = names.map(|name| ended.column(name));
        (0..x.len()).map(|i| x[i].hypot(y[i]).hypot(z[i])).fold(0.0, f64::max) / 1e3
    };
    let of = |lower: &[&str]| {
        let runs = four.map(|set| {
            let ended = run(&bench, "drape", &[lower, &[set]].concat());
            let summary = ended.summary();
            let verdict = &summary["verdict"][0];
            println!("{} {}", summary["status"], verdict["sentence"]);
            let ground = ["ground_force_x_N", "ground_force_y_N", "ground_force_z_N"];
            [
                edge(&ended).unwrap_or(f64::NAN),
                *speeds(&ended).last().expect("a row"),
                largest(&ended, ground),
                ended.measure("max_cable_force") / 1e3,
                ended.measure("max_reaction_1ms") / 1e3,
                100.0 * ended.measure("energy_error"),
                verdict["braking_time"].as_f64().unwrap_or(f64::NAN),
                summary["measures"]["max_travel"]["value"].as_f64().unwrap_or(f64::NAN),
            ]
        });
        println!("{runs:?}");
        [0, 1, 2, 3, 4, 5, 6, 7].map(|at| range(&runs.map(|run| run[at])))
    };
    let (free, pocket) = (of(&[]), of(&[held]));
    let text = std::fs::read_to_string(scene("drape")).expect("a scene");
    let tables = text.replace("data/", &format!("{}/launch/scenes/data/", repository().display()));
    let rock: Vec<_> = (tables.split("\n["))
        .filter(|table| !table.starts_with("structure") && !table.contains("\"structure\""))
        .collect();
    let ended = run_of(&bench, &bench.scene(&rock.join("\n[")), "out", &[]);
    let alone = [edge(&ended).expect("there"), *speeds(&ended).last().expect("a row")];
    println!("{alone:?} {free:?} {pocket:?}");
    for (template, values) in [
        ("| at the lower edge (y = 8.55 m) | {} m/s |", vec![alone[0]]),
        (
            "leaves with {} to {} m/s | is stopped before it, in {} to {} s over {} to {} m |",
            [free[0], pocket[6], pocket[7]].concat(),
        ),
        (
            "| its speed at 2.2 s [m/s] | {} | {} to {} | {} to {} |",
            [&alone[1..], &free[1], &pocket[1]].concat(),
        ),
        ("| largest force of the ground on the net, mean over a row [kN] | | {} to {} |", free[2].to_vec()),
        ("| largest force in a rope [kN] | | {} to {} | {} to {} |", [free[3], pocket[3]].concat()),
        ("| support reaction, mean over 1 ms [kN] | | {} to {} | {} to {} |", [free[4], pocket[4]].concat()),
        ("| `energy_error` | | {} to {} % | {} to {} % |", [free[5], pocket[5]].concat()),
    ] {
        holds_about(page, template, &values);
    }
}

#[test]
#[ignore = "long"]
fn a_net_comes_to_rest_by_damping() {
    let bench = Bench::new();
    let first = run(&bench, "barrier-sel", &[]);
    let from = format!("start_from={{ run = \"{}\", at = \"motion\" }}", first.out.display());
    let sets = [from.as_str(), "structure.damping=8.0", "end_time=3.0"];
    let path = without(&bench, "barrier-sel", &["[[rock]]", "[[contact]]", "[coupling]", "[dem]"]);
    let second = run_of(&bench, &path, "second", &sets);
    let heights = [1, 2, 3].map(|at| *second.column(&format!("left_height_{at}_m")).last().expect("a row"));
    println!("{heights:?}");
    holds_about("docs/measured/barrier-sel.md", "comes to heights of {}, {} and {} m", &heights);
    let brakes = *second.column("rope_brakes_elongation_max_m").last().expect("a row");
    let found = run_of(
        &bench,
        &scene("barrier-sel"),
        "third",
        &[&format!("start_from={}", first.out.display()), "end_time=0.001"],
    );
    let heights = [1, 2, 3].map(|at| found.column(&format!("left_height_{at}_m"))[0]);
    let rest = found.column("rope_brakes_elongation_max_m")[0];
    holds_about("docs/measured/barrier-sel.md", "(form finding: {}, {}, {} m)", &heights);
    holds_about(
        "docs/measured/barrier-sel.md",
        "with a largest brake elongation of {} m ({} m)",
        &[brakes, rest],
    );
}

#[test]
#[ignore = "long"]
fn a_yielding_net_beside_fine_weak_windows() {
    let table = printed("yielding", "");
    for row in table.lines().filter(|row| row.starts_with("| 64 ") || row.starts_with("| 512 ")) {
        holds_row("docs/measured/yielding-net.md", row, 4, 14);
    }
}

#[test]
#[ignore = "long"]
fn a_yielding_net_in_short_windows() {
    let bench = Bench::new();
    for window in ["1e-5", "2.5e-5"] {
        let window_set = format!("coupling.time_window={window}");
        let peaks = ["rock", "local"].map(|mass| {
            let mass = format!("contact.0.effective_mass={mass}");
            let sets = ["coupling.scheme=strong", "coupling.yielding_net=true", "dem.time_step=2e-5"];
            run(&bench, "cable-net", &[&sets[..], &[&window_set, &mass]].concat()).measure("centre_uz_min")
        });
        println!("{window} {peaks:?}");
        holds("docs/measured/yielding-net.md", &format!("| {window} | {{}} | {{}} |"), &peaks);
    }
}

/// Where the rocks of the example `yielding` start.
const START: [&str; 2] = ["rock.0.position=[0.0,0.0,0.16]", "rock.0.velocity=[0.0,0.0,-6.2565]"];

#[test]
#[ignore = "long"]
fn presets_beside_fine_weak_windows() {
    let bench = Bench::new();
    let drop = |spheres: &str, young: &str, rough: bool| {
        let (friction, wire) = if rough { ("0.4", "2") } else { ("0", "0") };
        let radius = if rough { "0.002" } else { "0.0" };
        let row = format!("drop test, {spheres} spheres, {young} Pa, friction {friction}, wire {wire} mm");
        let own = [
            format!("rock.0.cluster.spheres={spheres}"),
            format!("contact.0.young={young}"),
            format!("contact.0.friction={friction}"),
            format!("structure.cable.radius={radius}"),
            "dem.contact_selection=nearest".into(),
            "end_time=0.3".into(),
            "limits.weak_window=2.0".into(),
        ];
        let sets: Vec<String> = own.into_iter().chain(START.map(str::to_owned)).collect();
        (row, "walenstadt-compare", sets, "1e-5", "max_deflection")
    };
    let both = |spheres, young| [drop(spheres, young, false), drop(spheres, young, true)];
    let mut cases: Vec<_> = [("64", "1e7"), ("64", "1e8"), ("64", "1e9"), ("512", "1e8"), ("512", "1e9")]
        .into_iter()
        .flat_map(|(spheres, young)| both(spheres, young))
        .collect();
    for mass in ["rock", "local"] {
        let sets = ["limits.penetration=2.0", "limits.energy_error=10.0", "dem.contact_selection=nearest"];
        let sets = sets.into_iter().map(str::to_owned).chain([format!("contact.0.effective_mass={mass}")]);
        cases.push((format!("cable net, {mass} mass"), "cable-net", sets.collect(), "1e-5", "centre_uz_min"));
    }
    cases.push(("barrier".into(), "barrier-impact", Vec::new(), "1.25e-5", "max_deflection"));
    for (row, name, common, step, deflection) in &cases {
        let path = without(&bench, name, &["[coupling]", "[dem]", "[fem]", "[output]"]);
        let of = |own: &[String]| {
            let sets: Vec<&str> = common.iter().chain(own).map(String::as_str).collect();
            let ended = run_of(&bench, &path, "out", &sets);
            [deflection, "max_reaction_1ms", "energy_error"].map(|name| ended.measure(name))
        };
        let keys = ["coupling.time_window", "dem.time_step", "fem.time_step"];
        let weak = keys.map(|key| format!("{key}={step}"));
        let exact = of(&[&weak[..], &["coupling.scheme=weak".into()]].concat());
        let values: Vec<f64> = ["fast", "balanced", "accurate"]
            .iter()
            .flat_map(|preset| {
                let found = of(&[format!("coupling.preset={preset}")]);
                [found[0] / exact[0] - 1.0, found[1] / exact[1] - 1.0, found[2]].map(|share| 100.0 * share)
            })
            .collect();
        println!("{row} {exact:?} {values:.3?}");
        let cells = ["{} % | {} % | {} %"; 3].join(" | ");
        holds("docs/measured/yielding-net.md", &format!("| {row} | {cells} |"), &values);
    }
}

#[test]
#[ignore = "long"]
fn small_and_large_masses() {
    let bench = Bench::new();
    for (row, mass, young, end) in [
        ("1 kg", "1.0", "1e8", "0.2"),
        ("10 kg", "10.0", "1e8", "0.2"),
        ("10 t, to 0.165 s", "1e4", "1e10", "0.165"),
        ("10 t", "1e4", "1e10", "0.2"),
    ] {
        let of = |own: &[&str]| {
            let physics = [
                format!("rock.0.mass={mass}"),
                format!("contact.0.young={young}"),
                format!("end_time={end}"),
            ];
            let yields =
                ["coupling.scheme=strong", "coupling.yielding_net=true", "dem.contact_selection=continuous"];
            let physics = physics.iter().map(String::as_str).collect::<Vec<_>>();
            let sets = [&yields[..], &START, &physics, own].concat();
            100.0 * run(&bench, "walenstadt-compare", &sets).measure("energy_error")
        };
        let fine = [
            "coupling.time_window=2.5e-4",
            "coupling.samples=10",
            "dem.time_step=5e-6",
            "fem.time_step=2.5e-5",
        ];
        let values = [
            of(&["coupling.time_window=1e-3"]),
            of(&["coupling.time_window=5e-4", "coupling.samples=10"]),
            of(&fine),
        ];
        println!("{row} {values:?}");
        holds("docs/measured/yielding-net.md", &format!("| {row} | {{}} % | {{}} % | {{}} % |"), &values);
    }
}

/// The rows of `wire_ring` and `ring`, and a chain of the referee.
#[test]
#[ignore = "long"]
fn rings_that_touch() {
    let page = "docs/measured/rings.md";
    let common = "panel across=7 friction=0.2 speed=3 mass=8";
    for (row, options, strands) in [
        (
            "| **`wire_ring`** R7, 45, 2 % (0.294) | 3.19",
            "element=1 rows=45 pitch=0.294 way=1.62",
            [35e3, 49e3],
        ),
        ("| 45, 5 %, cap | 3.09", "element=1 rows=45 pitch=0.284 cap=1 way=1.62", [35e3, 49e3]),
        ("| 0, 2 % | 2.93 | 1.18", "element=1 rows=0 across=10 pitch=0.294 way=1.62", [35e3, 49e3]),
        ("| R12, 45, 5 % | 3.09", "element=1 rows=45 pitch=0.284 turns=12 way=1.62", [55e3, 83e3]),
        ("| **`ring`** R7, 45, 2 % | 3.19", "element=2 rows=45 pitch=0.294 way=1.62", [35e3, 49e3]),
        ("| 45, 5 % | 3.09 | 1.47", "element=2 rows=45 pitch=0.284 way=1.62", [35e3, 49e3]),
        ("| 0, 2 % | 2.93 | 1.12", "element=2 rows=0 across=10 pitch=0.294 way=1.62", [35e3, 49e3]),
    ] {
        let panel = rings(&format!("{common} {options}"));
        let [a, b] = strands.map(|strand| reached(&panel, 2, strand));
        let values = [a[0], b[0], a[1] / 1e3, b[1] / 1e3, a[3] / 1e3, b[3] / 1e3];
        println!("{row} {values:?}");
        // Rows that bear the same name are told apart by their first deflection.
        let (first, from) = if row.matches('|').count() > 2 { (" /", 1) } else { (" | {} /", 0) };
        holds(page, &format!("{row}{first} {{}} | {{}} / {{}} | {{}} / {{}} |"), &values[from..]);
    }
    let extension = reached(&rings("chain beams=48 friction=0.2"), 1, 69.7e3)[0];
    holds(page, "| | 48 | {} | |", &[extension]);
}

/// The sixty, in the order of the table: one template of all rows, as some bear the same words.
#[test]
#[ignore = "long"]
fn sixty_combinations() {
    let (mut template, mut values) = (Vec::new(), Vec::new());
    for line in printed("limits", "").lines().skip(1) {
        let words: Vec<&str> = line.split(' ').collect();
        let of = |key: &str| {
            let value = words.iter().find_map(|word| word.strip_prefix(key));
            value.unwrap_or_else(|| panic!("no {key} in {line}")).replace('_', " ")
        };
        if words[0].parse::<usize>().is_err() || words[1].starts_with("are") {
            continue;
        }
        let (scheme, samples, predictor) =
            (of("coupling.scheme="), of("coupling.samples="), of("coupling.predictor="));
        let mut cells =
            format!("`{}` | {scheme} | {samples}, {predictor} | {} | {{}}", words[1], of("fem.integrator="));
        values.push(words[3].parse::<f64>().expect("a window"));
        for word in &words[5..8] {
            let value: f64 = word.parse().expect("a number");
            cells += if value.is_nan() { " | -" } else { " | {} %" };
            values.extend((!value.is_nan()).then_some(100.0 * value));
        }
        template.push(format!("| {cells} | {} |", words[4]));
    }
    assert_eq!(template.len(), 60);
    holds("docs/measured/combinations.md", &template.join(" "), &values);
}
