//! Studies: every member is the run of its own scene, whatever was computed before it, on how many threads, in which chunks,
//! and after which kill.

mod doubts;
mod drawn;

use dem_solver::terrain::slope::Slope;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SCENE: &str = "end_time = 20.0\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nname = \"block\"\nposition = [2600012.0, 1200020.0, 1040.0]\ndensity = 2600.0\n\
    shape = { type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.spheres = 27\n\
    [terrain]\nfile = \"slope.asc\"\n\
    [[contact]]\nlaw = \"hertz_rock\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.2\nfriction = 0.6\n";

const STUDY: &str = "scene = \"fall.toml\"\nseed = 3\nmost_failed = 0.2\n\
    [[release]]\nname = \"cliff\"\npolygon = [[2600005.0, 1200010.0], [2600015.0, 1200012.0], [2600010.0, 1200030.0]]\ncount = 14\n\
    [[release]]\npoints = [[2600020.5, 1200020.25], [2600018.0, 1200022.0]]\nheight = 2.0\ncount = 6\n\
    [vary]\norientation = \"uniform\"\nspeed = { uniform = [0.5, 4.0] }\nspin = 2.0\n\
    contact.0.friction = { normal = [0.6, 0.05] }\ndem.steps_per_contact = { choice = [40, 45] }\n\
    [maps]\ncell = 2.0\n[[line]]\nname = \"road\"\npoints = [[2600035.0, 1200005.0], [2600035.0, 1200035.0]]\n";

/// A directory with scene, study and terrain.
struct Place {
    temp: tempfile::TempDir,
}

impl Place {
    fn new(study: &str) -> Self {
        let temp = tempfile::tempdir().expect("a directory");
        let slope = Slope {
            corner: [2_600_000.0, 1_200_000.0],
            spacing: 1.0,
            counts: [61, 41],
            drop: 35.0,
            foot: 1000.0,
            benches: 2,
            roughness: 0.05,
            seed: 5,
        };
        slope.raster().write_asc(&temp.path().join("slope.asc")).expect("written");
        let place = Self { temp };
        place.write("fall.toml", SCENE);
        place.write("study.toml", study);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.temp.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn command(&self, out: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dem-solver"));
        command.arg("ensemble").arg(self.path("study.toml")).arg("--out").arg(self.path(out)).args(arguments);
        command
    }

    fn run(&self, out: &str, arguments: &[&str]) -> Output {
        self.command(out, arguments).output().expect("started")
    }

    /// The table of a study that ends well.
    fn table(&self, out: &str, arguments: &[&str]) -> String {
        let output = self.run(out, arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        self.read(out)
    }

    /// The maps and what passes the line, byte by byte.
    fn files(&self, out: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let mut all = Vec::new();
        for folder in ["maps", "lines"] {
            let entries = std::fs::read_dir(self.path(out).join(folder)).expect("a folder");
            for path in entries.map(|entry| entry.expect("an entry").path()) {
                let name = Path::new(folder).join(path.file_name().expect("a name"));
                all.push((name, std::fs::read(path).expect("read")));
            }
        }
        all.sort();
        assert!(all.len() > 40, "{}", all.len());
        all
    }

    fn read(&self, out: &str) -> String {
        std::fs::read_to_string(self.path(out).join("members.csv")).expect("a table")
    }
}

/// The rows of a table by the names of its columns.
fn rows(table: &str) -> Vec<HashMap<String, String>> {
    let mut lines = table.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    lines.map(|cells| header.iter().cloned().zip(cells).collect()).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name}: {}", row[name]))
}

/// `dem-solver run` of a scene with a member's numbers ends at the same place at the same time, to the last bit.
#[test]
fn a_member_is_the_run_of_its_own_scene() {
    let place = Place::new(STUDY);
    let table = place.table("out", &["--threads", "2"]);
    let rows = rows(&table);
    assert_eq!(rows.len(), 20);
    for row in [&rows[0], &rows[7], &rows[19]] {
        let list = |names: &[&str]| {
            format!(
                "[{}]",
                names.iter().map(|n| format!("{:?}", number(row, n))).collect::<Vec<_>>().join(", ")
            )
        };
        let scene = SCENE
            .replace(
                "position = [2600012.0, 1200020.0, 1040.0]",
                &format!(
                    "position = {}\nvelocity = {}\norientation = {}\nangular_velocity = {}",
                    list(&["x_m", "y_m", "z_m"]),
                    list(&["vx_m_per_s", "vy_m_per_s", "vz_m_per_s"]),
                    list(&["orientation_w", "orientation_x", "orientation_y", "orientation_z"]),
                    list(&["wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s"]),
                ),
            )
            .replace("density = 2600.0", &format!("mass = {:?}", number(row, "mass_kg")))
            .replace("friction = 0.6", &format!("friction = {}", row["contact.0.friction"]))
            + &format!("[dem]\nsteps_per_contact = {}\n", row["dem.steps_per_contact"]);
        place.write("member.toml", &scene);
        let out = place.path(&format!("member {}", row["member"]));
        let output = Command::new(env!("CARGO_BIN_EXE_dem-solver"))
            .arg("run")
            .arg(place.path("member.toml"))
            .arg("--out")
            .arg(&out)
            .output()
            .expect("started");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let summary = std::fs::read_to_string(out.join("summary.json")).expect("a summary");
        let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
        let measures = &summary["measures"];
        let value = |name: &str| measures[name]["value"].as_f64();
        for (column, name) in [
            ("max_speed_m_per_s", "max_speed"),
            ("max_kinetic_energy_J", "max_kinetic_energy"),
            ("max_jump_height_m", "max_jump_height"),
            ("impacts", "impacts"),
            ("max_penetration", "max_penetration"),
            ("energy_error", "energy_error"),
            ("contact_time_fraction", "contact_time_fraction"),
        ] {
            let (own, alone) = (number(row, column), value(name).expect(name));
            // A number of JSON is read to the last bit but one.
            assert!(
                (own - alone).abs() <= f64::EPSILON * own.abs(),
                "{column} of member {}: {own} {alone}",
                row["member"]
            );
        }
        let way = if row["ending"] == "rest" { "runout_distance" } else { "exit_distance" };
        let (own, alone) =
            (number(row, "run_out_m"), value(way).unwrap_or_else(|| panic!("{way} in {summary}")));
        // Both from the same end; the one counts in local coordinates.
        assert!((own - alone).abs() < 1e-8, "{own} {alone}");
        let ended = measures[way]["time_s"].as_f64().expect("a time");
        assert!((number(row, "time_s") - ended).abs() <= f64::EPSILON * ended);
    }
}

/// `--scene-of N` is the scene of member N: a run of it ends at the place of its row at its time, whatever varies, shapes that are
/// scaled and ground that remembers included.
#[test]
fn the_scene_of_a_member_ends_where_its_row_says() {
    let shapes = "shape = { choice = [{ type = \"norm_rock\", form = \"111\", volume = 0.2 }, { type = \"sphere\", radius = 0.3 }, \
        { type = \"random_convex\", size = [0.9, 0.7, 0.5] }] }\n";
    let vary = format!(
        "[vary]\nvolume = {{ lognormal = [0.3, 1.7] }}\ndensity = {{ uniform = [2400.0, 2700.0] }}\n{shapes}"
    );
    let place = Place::new(&STUDY.replace("[vary]\n", &vary).replace("[40, 45]", "[60, 66]"));
    for (scene, kind) in [
        (SCENE.to_owned(), "as it is"),
        (SCENE.replace("cluster.spheres", "scale = 1.3\ncluster.spheres"), "scaled"),
    ] {
        place.write("fall.toml", &scene);
        let table = place.table(kind, &["--threads", "2"]);
        let rows = rows(&table);
        let differ: std::collections::HashSet<_> = rows.iter().map(|row| row["mass_kg"].clone()).collect();
        assert_eq!((rows.len(), differ.len()), (20, 20));
        // Who still moves at the end has no place of rest to compare.
        let ended = rows.iter().filter(|row| row["ending"] != "moving");
        assert!(ended.clone().count() > 14);
        for row in ended.step_by(3) {
            let file = place.path("one.toml");
            let written = place.run(kind, &["--scene-of", &row["member"], "-o", &file.display().to_string()]);
            assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
            let out = place.path(&format!("{kind} {}", row["member"]));
            let mut command = Command::new(env!("CARGO_BIN_EXE_dem-solver"));
            let output = command.arg("run").arg(&file).arg("--out").arg(&out).output().expect("started");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let summary = std::fs::read_to_string(out.join("summary.json")).expect("a summary");
            let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
            let way = if row["ending"] == "rest" { "runout_distance" } else { "exit_distance" };
            let alone =
                |key: &str| summary["measures"][way][key].as_f64().unwrap_or_else(|| panic!("{summary}"));
            let (own, ended) = (number(row, "run_out_m"), number(row, "time_s"));
            assert!(
                (own - alone("value")).abs() < 1e-8,
                "{kind} {}: {own} {}",
                row["member"],
                alone("value")
            );
            assert!((ended - alone("time_s")).abs() <= f64::EPSILON * ended, "{kind} {}", row["member"]);
        }
    }
    let none = place.run("as it is", &["--scene-of", "21"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&none.stderr).contains("--scene-of: 21: the members of this study are 1..20")
    );
}

/// Both standards, from the table of the line alone: the largest values of each member, their quantiles, times the factors.
#[test]
fn the_design_of_a_line_follows_from_its_table() {
    let design = "[line.design]\nbarrier_energy = 1e4\nbarrier_height = 50.0\nbarrier_elongation = 4.0\n\
        [line.design.uni_11211_4]\nblock_mass = 900.0\ntrajectories = 1.1\ntopography = 1.02\nblock_survey = 1.05\nweight = 1.01\n\
        free_border = 0.6\nlevel = \"SEL\"\ndistance_factor = 1.4\n\
        [line.design.onr_24810]\nenergy_quantile = 99.0\nheight_quantile = 90.0\nenergy_factor = 1.15\nheight_factor = 1.3\n";
    let place = Place::new(&format!("{STUDY}{design}"));
    place.table("out", &[]);
    let line = std::fs::read_to_string(place.path("out/lines/road.csv")).expect("a table");
    let mut largest: HashMap<String, [f64; 3]> = HashMap::new();
    for row in rows(&line) {
        let most = largest.entry(row["member"].clone()).or_insert([f64::NEG_INFINITY; 3]);
        for (most, name) in most.iter_mut().zip(["speed_m_per_s", "centre_height_m", "kinetic_energy_J"]) {
            *most = most.max(number(&row, name));
        }
    }
    // Linear between the two members beside the place of the quantile.
    let quantile = |column: usize, share: f64| {
        let mut all: Vec<f64> = largest.values().map(|values| values[column]).collect();
        all.sort_by(f64::total_cmp);
        let at = share * (all.len() - 1) as f64;
        let (low, high) = (all[at as usize], all[(at as usize + 1).min(all.len() - 1)]);
        low * (1.0 - at.fract()) + high * at.fract()
    };
    assert!(largest.len() > 10, "{}", largest.len());
    let speed = quantile(0, 0.95) * 1.1 * 1.02;
    let height = quantile(1, 0.95) * 1.1 * 1.02;
    let summary = std::fs::read_to_string(place.path("out/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    for (name, due) in [
        ("uni_design_speed", speed),
        ("uni_design_energy", 0.5 * 900.0 * 1.05 * 1.01 * speed * speed),
        ("uni_required_energy", 0.5 * 900.0 * 1.05 * 1.01 * speed * speed),
        ("uni_required_height", height + 0.6),
        ("uni_required_distance", 5.6),
        ("onr_required_energy", 1.15 * quantile(2, 0.99)),
        ("onr_required_height", 1.3 * quantile(1, 0.90)),
    ] {
        let value =
            summary["measures"][format!("road_{name}")]["value"].as_f64().unwrap_or_else(|| panic!("{name}"));
        assert!((value / due - 1.0).abs() < 1e-12, "{name}: {value} {due}");
    }
    let verdict = summary["verdict"].to_string();
    let strong = largest.values().filter(|values| values[2] > 1e4).count();
    assert!(
        verdict.contains("UNI 11211-4")
            && verdict.contains("the barrier has 50: not judged, ")
            && verdict.contains("rocks are too few for a quantile of 95 %"),
        "{verdict}"
    );
    assert!(
        verdict.contains("ONR 24810")
            && verdict.contains(&format!(
                "the barrier has 10000 ({strong} of {} rocks that pass have more): not satisfied",
                largest.len()
            )),
        "{verdict}"
    );
    let few = summary["warnings"].to_string();
    assert!(few.contains("more members are required"), "{few}");
}

#[test]
fn threads_chunks_and_their_order_leave_every_byte_as_it_is() {
    let place = Place::new(STUDY);
    let one = place.table("one", &["--threads", "1"]);
    assert_eq!(one, place.table("two", &["--threads", "2"]));
    for range in ["15..20", "4..9", "1..2"] {
        assert!(place.run("chunks", &["--members", range]).status.success());
        assert!(place.run("chunks", &["--members", range]).status.success(), "a task given out twice");
    }
    assert!(!place.path("chunks").join("members.csv").exists());
    assert_eq!(one, place.table("chunks", &[]));
    for other in ["two", "chunks"] {
        assert!(place.files("one") == place.files(other), "{other}");
    }
    let again = place.run("one", &[]);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--resume"));
    assert_eq!(one, place.table("one", &["--resume"]));
    assert_eq!(one, place.table("one", &["--force"]));
    let other = place.run("one", &["--resume", "--set", "seed=4"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("another study"));
    assert_ne!(one, place.table("other", &["--set", "seed=4"]));
}

/// Killed at times all over the study, and gone on with, until it is whole: nothing is lost, nothing is there twice.
#[test]
fn a_study_that_was_killed_again_and_again_ends_with_the_same_table() {
    let place = Place::new(&STUDY.replace("count = 14", "count = 60"));
    let begun = std::time::Instant::now();
    let whole = place.table("whole", &["--threads", "2"]);
    let journal = std::fs::read(place.path("whole/chunks/main.journal")).expect("a journal");
    let least = begun.elapsed().mul_f64(0.3);
    let mut kills = 0;
    for attempt in 0_u32.. {
        let resume: &[&str] = if attempt == 0 { &[] } else { &["--resume"] };
        let mut child = place.command("killed", resume).spawn().expect("started");
        // Fractions of the golden ratio: times all over the study.
        let share = (f64::from(attempt) * 0.618_034).fract();
        std::thread::sleep(least.mul_f64(1.0 + 2.0 * share));
        if child.try_wait().expect("asked").is_some_and(|status| status.success()) {
            break;
        }
        child.kill().expect("killed");
        child.wait().expect("waited for");
        kills += 1;
        let rows = place.path("killed").join("members.csv");
        if let Ok(rows) = std::fs::read_to_string(rows) {
            let complete = rows.rfind('\n').map_or("", |end| &rows[..=end]);
            assert!(whole.starts_with(complete));
        }
        assert!(attempt < 200, "it does not come to its end");
    }
    assert!(kills > 0);
    assert_eq!(place.read("killed"), whole);
    assert!(place.files("killed") == place.files("whole"));
    assert_eq!(std::fs::read(place.path("killed/chunks/main.journal")).expect("a journal"), journal);
}

/// A rock of another size is the scene's rock with all lengths scaled: the same as one that is made at that size.
#[test]
fn a_scaled_cluster_is_the_one_that_is_made_at_that_size() {
    use dem_solver::rock::Rock;
    use dem_solver::settings::Settings;
    use interface_defs::toolkit::scene::Scene;
    let made = |volume: f64, shape: &str| {
        let text = SCENE
            .replace("shape = { type = \"box\", size = [0.8, 0.7, 0.6] }", shape)
            .replace("SIZE", &format!("{volume:?}"))
            .replace("spheres = 27", "spheres = 60");
        let scene = Scene::from_text("fall.toml", &text).expect("a scene");
        let settings = Settings::of(&scene).unwrap_or_else(|e| panic!("{e}"));
        Rock::new(0, &settings.rocks[0], &scene).unwrap_or_else(|e| panic!("{e}")).0
    };
    let norm = "shape = { type = \"norm_rock\", form = \"111\", volume = SIZE }";
    let cube = "shape = { type = \"box\", size = [SIZE, SIZE, SIZE] }";
    // Powers of two leave every digit. With other factors rounding may let the maker choose between equally good places for a
    // sphere in another way: a member's rock is the scaled one.
    for (shape, small, factor, large, error) in
        [(norm, 0.25, 2.0, 2.0, 1e-14), (norm, 4.0, 0.5, 0.5, 1e-14), (cube, 0.5, 1.7, 0.85, 1e-14)]
    {
        let own = made(large, shape);
        let scaled = made(small, shape).scaled(factor, own.mass);
        assert_eq!(scaled.spheres.len(), own.spheres.len());
        for (a, b) in scaled.spheres.iter().zip(&own.spheres) {
            let apart = (a.centre - b.centre).norm() + (a.radius - b.radius).abs();
            assert!(apart < error, "{shape} times {factor}: {apart:e}");
        }
        assert!((scaled.inertia - own.inertia).norm() < 1e-12 * own.inertia.norm());
        assert!((scaled.solid.volume() / own.solid.volume() - 1.0).abs() < 1e-12);
        assert!((scaled.reach / own.reach - 1.0).abs() < 1e-9);
        assert_eq!(scaled.outermost, own.outermost);
    }
}

/// On the ground a rock touches it and is in it nowhere; higher up it is free by as much.
#[test]
fn members_start_on_the_ground_and_not_in_it() {
    use dem_solver::study::base::Base;
    use dem_solver::study::settings::STUDY as KIND;
    use interface_defs::toolkit::scene::Scene;
    let place = Place::new(STUDY);
    let file = Scene::load_as(&KIND, &place.path("study.toml"), &[]).expect("a study");
    let base = Base::new(&file, true).unwrap_or_else(|e| panic!("{e}"));
    for number in 1..=base.members() {
        let member = base.member(number);
        let model = base.model(&member, None).unwrap_or_else(|e| panic!("{e}"));
        let (rock, table) = (&model.rocks[0], &model.settings.rocks[0]);
        let mut motion = rock.start(table, model.settings.gravity);
        motion.position -= model.origin;
        let near = |lift: f64| {
            let nearest = rock.spheres.iter().map(|sphere| {
                let centre =
                    motion.position + motion.orientation * sphere.centre - nalgebra::Vector3::z() * lift;
                let reach = (0..).map(|k| 1e-3 * f64::from(k)).find(|r| base.ground.is_near(&centre, *r));
                reach.expect("somewhere there is ground") - sphere.radius
            });
            nearest.fold(f64::INFINITY, f64::min)
        };
        let height = if member.release == 0 { 0.0 } else { 2.0 };
        let gap = near(height);
        assert!((-1e-6..2e-3).contains(&gap), "member {number}: {gap}");
        if height > 0.0 {
            assert!(near(0.0) > 1.0, "member {number}");
        }
        let speed = nalgebra::Vector3::from(table.velocity);
        assert!(speed.z < 0.0, "down the line of fall: {speed}");
        assert!((nalgebra::Vector3::from(table.angular_velocity).norm() - 2.0).abs() < 1e-12);
    }
}

/// A member that cannot be computed is a row, and the study says how many there are: here those above a hole in the terrain.
#[test]
fn a_member_that_fails_is_a_row_with_its_reason() {
    let place = Place::new(&STUDY.replace("most_failed = 0.2", "most_failed = 0.01"));
    place.write("fall.toml", &SCENE.replace("[terrain]\n", "[terrain]\nnodata = \"cut\"\n"));
    let text = std::fs::read_to_string(place.path("slope.asc")).expect("a terrain");
    let mut rows: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    let first = rows.len() - 41;
    // Rows go from north to south, with 41 of them: heights at x = 9 to 11 m and y = 14 to 17 m.
    rows[first + 40 - 17..=first + 40 - 14].iter_mut().for_each(|row| row[9..=11].fill("-9999"));
    let mut lines: Vec<String> = rows.iter().map(|row| row.join(" ")).collect();
    if !text.to_lowercase().contains("nodata") {
        lines.insert(first, "NODATA_value -9999".into());
    }
    place.write("slope.asc", &(lines.join("\n") + "\n"));
    let output = place.run("out", &[]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let table = place.read("out");
    let failed = table.lines().skip(1).filter(|row| row.contains(",failed,")).count();
    assert!(failed > 0 && failed < 10, "{failed}");
    assert_eq!(table.lines().count(), 21);
    let summary = std::fs::read_to_string(place.path("out/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["measures"]["members_failed"]["value"].as_f64(), Some(failed as f64));
    assert_eq!(summary["status"], "unreliable");
}

/// The tables are files of their own even where a path has no directory yet.
#[test]
fn results_lie_where_they_are_asked_for() {
    let place = Place::new(&STUDY.replace("count = 14", "count = 1").replace("count = 6", "count = 1"));
    place.table("a/b", &[]);
    for name in ["study.json", "study.toml", "scene.toml", "summary.json"] {
        assert!(Path::new(&place.path("a/b")).join(name).exists(), "{name}");
    }
}

const FLIGHT: &str = "end_time = 1.5\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nposition = [2600012.0, 1200020.0, 1040.0]\ndensity = 2600.0\nshape = { type = \"sphere\", radius = 0.3 }\n\
    [terrain]\nfile = \"slope.asc\"\n\
    [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\nrestitution = 0.2\nfriction = 0.6\n";

const FLIGHTS: &str = "scene = \"fall.toml\"\nmost_failed = 1.0\n\
    [[release]]\npoints = [[2600010.0, 1200020.5]]\nheight = 20.0\ncount = 4\n\
    [vary]\nspeed = { choice = [10.0, 14.0], weights = [3, 1] }\nazimuth = 90.0\n\
    [maps]\ncell = 2.0\nepsg = 2056\n\
    [[line]]\nname = \"road\"\npoints = [[2600015.25, 1200030.0], [2600015.25, 1200010.0]]\n";

/// A study over level ground.
fn flights() -> Place {
    let place = Place::new(FLIGHTS);
    place.write("fall.toml", FLIGHT);
    let level = "ncols 61\nnrows 41\nxllcenter 2600000\nyllcenter 1200000\ncellsize 1\n".to_owned()
        + &("1000 ".repeat(61) + "\n").repeat(41);
    place.write("slope.asc", &level);
    place
}

/// Flights are parabolas: energy, height and place at a line, and the largest values in every cell that is passed, in closed form.
#[test]
fn lines_and_maps_hold_what_flies_past() {
    let place = flights();
    let rows = rows(&place.table("out", &[]));
    let (g, mass) = (9.81, number(&rows[0], "mass_kg"));
    let table = std::fs::read_to_string(place.path("out/lines/road.csv")).expect("a table");
    let crossings = self::rows(&table);
    assert_eq!(crossings.len(), 4);
    let mut energies = Vec::new();
    for (row, crossing) in rows.iter().zip(&crossings) {
        let (v, z) = (number(row, "vx_m_per_s"), number(row, "z_m") - 1000.0);
        assert!((0.0..1e-3).contains(&(z - 20.3)), "{z}");
        let t = 5.25 / v;
        let energy = 0.5 * mass * (v * v + (g * t).powi(2));
        energies.push(energy);
        for (name, exact) in [
            ("time_s", t),
            ("along_m", 9.5),
            ("x_m", 2_600_015.25),
            ("y_m", 1_200_020.5),
            ("centre_height_m", z - 0.5 * g * t * t),
            ("passing_height_m", z - 0.3 - 0.5 * g * t * t),
            ("speed_m_per_s", (v * v + (g * t).powi(2)).sqrt()),
            ("kinetic_energy_J", energy),
            ("rotation_energy_J", 0.0),
            ("vz_m_per_s", -g * t),
        ] {
            let found = number(crossing, name);
            // Places of a survey have seven digits before the point.
            assert!((found - exact).abs() < 1e-8 * exact.abs().max(1.0), "{name}: {found} {exact}");
        }
    }
    energies.sort_by(f64::total_cmp);
    let summary = std::fs::read_to_string(place.path("out/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let measure = |name: &str| summary["measures"][name]["value"].as_f64().expect(name);
    // Of four numbers the 90 % quantile lies at 2.7 between the third and the fourth.
    let exact = energies[2] + 0.7 * (energies[3] - energies[2]);
    assert!((measure("road_energy_q90") / exact - 1.0).abs() < 1e-9);
    assert_eq!(measure("road_passing_share"), 1.0);
    let exceedance = std::fs::read_to_string(place.path("out/lines/road_exceedance.csv")).expect("a table");
    let exceedance = self::rows(&exceedance);
    assert_eq!(number(&exceedance[0], "share_of_all"), 0.25);
    assert!((number(&exceedance[0], "energy_J") / energies[3] - 1.0).abs() < 1e-9);
    let raster = |name: &str| {
        let file = place.path("out/maps").join(name);
        dem_solver::terrain::formats::raster(&file).unwrap_or_else(|e| panic!("{e}"))
    };
    let (count, speed, height) =
        (raster("count.tif"), raster("speed_q99.tif"), raster("jump_height_q99.tif"));
    let mut fastest: Vec<f64> = rows.iter().map(|row| number(row, "vx_m_per_s")).collect();
    fastest.sort_by(f64::total_cmp);
    let z = number(&rows[0], "z_m") - 1000.3;
    for cell in 0..7 {
        let x = 2_600_011.0 + 2.0 * f64::from(cell);
        let at = |r: &dem_solver::terrain::raster::Raster| r.nearest(x, 1_200_021.0).expect("passed");
        assert_eq!(at(&count), 4.0);
        let out = |v: f64| (v * v + (g * 2.0 * f64::from(cell + 1) / v).powi(2)).sqrt();
        let mut values: Vec<f64> = fastest.iter().map(|v| out(*v)).collect();
        values.sort_by(f64::total_cmp);
        let exact = values[2] + 0.97 * (values[3] - values[2]);
        assert!((at(&speed) / exact - 1.0).abs() < 1e-6, "{cell}: {} {exact}", at(&speed));
        let heights = |v: f64| z - 0.5 * g * (2.0 * f64::from(cell) / v).powi(2);
        let (low, high) = (heights(fastest[2]), heights(fastest[3]));
        let exact = low + 0.97 * (high - low);
        assert!((at(&height) / exact - 1.0).abs() < 1e-6, "{cell}: {} {exact}", at(&height));
        assert_eq!(count.nearest(x, 1_200_023.0), None);
    }
    let ways = std::fs::read_to_string(place.path("out/maps/trajectories.geojson")).expect("ways");
    let ways: serde_json::Value = serde_json::from_str(&ways).expect("JSON");
    assert_eq!(ways["features"].as_array().map(Vec::len), Some(4));
    assert_eq!(ways["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::2056");
}

/// The spheres of a rock are made by the first task of a study; others read them from its directory, and make them again where they
/// were changed. With several shapes each has its file. The table is the same.
#[test]
fn spheres_are_made_once_and_kept_in_the_directory_of_the_study() {
    let shape = "shape = { type = \"box\", size = [0.8, 0.7, 0.6] }";
    let norm = "{ type = \"norm_rock\", form = \"111\", volume = 0.2 }";
    let other = "{ type = \"norm_rock\", form = \"221\", volume = 0.3 }";
    let shapes = format!("[vary]\nshape = {{ choice = [{norm}, {other}] }}\n");
    for (study, files) in [
        (STUDY.to_owned(), &["block.xyzr"][..]),
        (STUDY.replace("[vary]\n", &shapes), &["block_1.xyzr", "block_2.xyzr"]),
    ] {
        let place = Place::new(&study);
        place.write("fall.toml", &SCENE.replace(shape, &format!("shape = {}", norm.replace("0.2", "0.25"))));
        let said = |arguments: &[&str]| {
            let output = place.run("out", arguments);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{said}");
            said
        };
        assert!(said(&["--members", "1..8"]).contains("making a cluster"));
        let folder = place.path("out/clusters");
        assert!(files.iter().all(|file| folder.join(file).is_file()));
        assert!(!said(&["--members", "9..14"]).contains("making a cluster"));
        let first = folder.join(files[0]);
        let text = std::fs::read_to_string(&first).expect("spheres");
        std::fs::write(&first, text.clone() + "0.0 0.0 0.0 0.05\n").expect("written");
        assert!(said(&[]).contains("making a cluster"), "it was changed");
        assert_eq!(std::fs::read_to_string(&first).expect("spheres"), text);
        assert!(!said(&["--resume"]).contains("making a cluster"));
        assert_eq!(place.read("out"), place.table("whole", &[]));
    }
}

/// What leaves the terrain in flight does so on a parabola, with its velocity at the border.
#[test]
fn the_row_of_a_member_that_leaves_the_terrain_has_its_velocity_there() {
    let place = flights();
    place.write("study.toml", &FLIGHTS.replace("{ choice = [10.0, 14.0], weights = [3, 1] }", "40.0"));
    for row in rows(&place.table("out", &[])) {
        assert_eq!(row["ending"], "left");
        let time = (2_600_060.0 - number(&row, "x_m")) / number(&row, "vx_m_per_s");
        for (name, exact) in [
            ("time_s", time),
            ("end_x_m", 2_600_060.0),
            ("end_vx_m_per_s", 40.0),
            ("end_vy_m_per_s", 0.0),
            ("end_vz_m_per_s", -9.81 * time),
        ] {
            // Places of a survey have seven digits before the point.
            let found = number(&row, name);
            assert!((found - exact).abs() < 1e-8 * exact.abs().max(1.0), "{name}: {found} {exact}");
        }
    }
}

/// GDAL, with which QGIS reads: extent, coordinate system, cells without a value.
#[test]
fn maps_are_read_by_gdal() {
    let place = flights();
    place.table("out", &[]);
    let ask = |program: &str, arguments: &[&str], file: &str| {
        Command::new(program).args(arguments).arg(place.path("out/maps").join(file)).output()
    };
    let Ok(output) = ask("gdalinfo", &["-json", "-stats"], "count.tif") else {
        return println!("skipped: gdalinfo is not installed (Debian: gdal-bin)");
    };
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        info["cornerCoordinates"]["upperLeft"],
        serde_json::json!([2_600_000.0, 1_200_040.0]),
        "{info}"
    );
    assert_eq!(info["cornerCoordinates"]["lowerRight"], serde_json::json!([2_600_060.0, 1_200_000.0]));
    let system = info["coordinateSystem"]["wkt"].as_str().unwrap_or_default();
    assert!(system.contains("CH1903+ / LV95") && system.contains("2056"), "{system}");
    let band = &info["bands"][0];
    assert_eq!((band["noDataValue"].as_f64(), band["maximum"].as_f64()), (Some(-9999.0), Some(4.0)));
    let output = ask("ogrinfo", &["-al", "-so"], "trajectories.geojson").expect("part of the same package");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in ["Feature Count: 4", "3D Line String", "CH1903+ / LV95", "max_kinetic_energy_J: Real"] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

/// A line at the border of the terrain, where a height is not known of every rock that passes.
#[test]
fn a_line_at_the_border_has_heights_as_far_as_they_are_known() {
    let place = flights();
    let text = FLIGHTS.replace("2600015.25", "2600060.0").replace("[10.0, 14.0]", "[35.0, 60.0]");
    place.write("study.toml", &text);
    place.table("out", &[]);
    let table = std::fs::read_to_string(place.path("out/lines/road_exceedance.csv")).expect("a table");
    assert!(!rows(&table).is_empty());
}
