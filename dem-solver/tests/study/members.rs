//! A member is the run of a scene of its own: its numbers, its end, its rock, the place where it starts.

use super::*;

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
        let measure = if row["ending"] == "rest" { "runout_distance" } else { "exit_distance" };
        let (own, alone) =
            (number(row, "run_out_m"), value(measure).unwrap_or_else(|| panic!("{measure} in {summary}")));
        // Both from the same end; the one counts in local coordinates.
        assert!((own - alone).abs() < 1e-8, "{own} {alone}");
        let ended = measures[measure]["time_s"].as_f64().expect("a time");
        assert!((number(row, "time_s") - ended).abs() <= f64::EPSILON * ended);
    }
}

/// `--scene-of N` is the scene of member N: a run of it ends at the place of its row at its time, whatever varies, shapes that are
/// scaled and ground that remembers included.
#[test]
#[ignore = "long"]
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
            let measure = if row["ending"] == "rest" { "runout_distance" } else { "exit_distance" };
            let alone =
                |key: &str| summary["measures"][measure][key].as_f64().unwrap_or_else(|| panic!("{summary}"));
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

/// A rock of another size is the scene's rock with all lengths scaled: the same as one that is made at that size.
#[test]
fn a_scaled_cluster_is_the_one_that_is_made_at_that_size() {
    use dem_solver::rock::Rock;
    use dem_solver::settings::Settings;
    use toolkit::scene::Scene;
    let made = |volume: f64, shape: &str| {
        let text = SCENE
            .replace("shape = { type = \"box\", size = [0.8, 0.7, 0.6] }", shape)
            .replace("SIZE", &format!("{volume:?}"))
            .replace("spheres = 27", "spheres = 60");
        let scene = Scene::from_text("fall.toml", &text).expect("a scene");
        let settings = Settings::of(&scene).unwrap_or_else(|e| panic!("{e}"));
        Rock::new(0, &settings.rocks[0], &scene, &[]).unwrap_or_else(|e| panic!("{e}")).0
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
    use dem_solver::study::gate;
    use toolkit::scene::STUDY as KIND;
    use toolkit::scene::Scene;
    let place = Place::new(STUDY);
    let file = Scene::load_as(&KIND, &place.path("study.toml"), &[]).expect("a study");
    let base = gate::read(&file, true, &[]).unwrap_or_else(|e| panic!("{e}"));
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

/// The spheres of a rock are made by the first task of a study; others read them from its directory, and make them again where they
/// were changed. With several shapes each has its file. The table is the same.
#[test]
#[ignore = "long"]
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

/// The first task of a machine prepares the terrain for all of them; where that was changed it is prepared again. The end removes it.
#[test]
fn a_terrain_is_prepared_once_for_all_tasks() {
    let place = Place::new(STUDY);
    let kept = place.path("out/clusters/terrain.kept");
    let task = |members: &str| place.command("out", &["--quiet", "--members", members]).spawn();
    let tasks = ["1..5", "6..10", "6..10", "11..15"].map(|members| task(members).expect("started"));
    assert!(tasks.into_iter().all(|mut task| task.wait().expect("ended").success()));
    let bytes = std::fs::read(&kept).expect("prepared");
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 1;
    std::fs::write(&kept, damaged).expect("written");
    assert!(place.run("out", &["--members", "16..18"]).status.success());
    assert!(std::fs::read(&kept).expect("prepared") == bytes);
    assert_eq!(place.table("out", &[]), place.table("whole", &[]));
    assert!(place.files("out") == place.files("whole") && !kept.exists());
}
