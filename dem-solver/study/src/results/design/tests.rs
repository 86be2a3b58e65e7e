use super::*;
use toolkit::scene::Scene;

fn judged(file: &Path, design: &Design, passing: &Passing, study: &Reliability) -> Checked {
    let mut found = Checked::default();
    write(file, "road", design, passing, study, &mut found).expect("written");
    found
}

/// By hand: 19.5 m/s * 1.05 * 1.02 = 20.8845 m/s; 2000 kg * 1.05 = 2100 kg; half of that times the square is 458 cJ.
#[test]
fn the_numbers_of_both_standards_are_those_by_hand() {
    let text = "[custom]\nbarrier_energy = 5e5\nbarrier_height = 4.0\nbarrier_elongation = 4.0\nbarrier_fields = 2\ndistance = 7.0\n\
        uni_11211_4 = { block_mass = 2000, trajectories = 1.05, topography = 1.02, block_survey = 1.05, weight = 1, \
        free_border = 0.5, level = \"MEL\" }\n\
        onr_24810 = { energy_quantile = 90, height_quantile = 50, energy_factor = 1.05, height_factor = 1.1 }\n";
    let scene = Scene::from_text("s.toml", text).expect("TOML");
    let design: Design = scene.read("custom").expect("valid").expect("there");
    design.check("custom", &scene).expect("valid");
    let speed: Vec<f64> = (0..=20).map(f64::from).map(|k| k + 0.5).collect();
    let speed = &speed[..];
    assert_eq!(quantile(speed, 0.95), 19.5);
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("design.csv");
    let passing =
        Passing { energy: &[1e5, 2e5, 3e5], height: &[1.0, 2.0, 3.0], speed, mass: &[900.0, 2000.5] };
    let checked = judged(&file, &design, &passing, &Reliability::default());
    let found: Vec<(&str, f64)> = checked.measures.iter().map(|m| (m.name.as_str(), m.value)).collect();
    let energy = 0.5 * 2100.0 * (20.8845 * 20.8845);
    let height = 2.9 * 1.05 * 1.02;
    for ((name, value), (due_name, due)) in found.iter().zip([
        ("road_uni_design_speed", 20.8845),
        ("road_uni_design_mass", 2100.0),
        ("road_uni_design_energy", energy),
        ("road_uni_required_energy", 1.2 * energy),
        ("road_uni_design_height", height),
        ("road_uni_required_height", height + 0.5),
        ("road_uni_required_distance", 6.0),
        ("road_onr_required_energy", 2.8e5 * 1.05),
        ("road_onr_required_height", 2.2),
    ]) {
        assert_eq!(*name, due_name);
        assert!((value / due - 1.0).abs() < 1e-12, "{name}: {value} {due}");
    }
    assert_eq!(found.len(), 9);
    let text = std::fs::read_to_string(&file).expect("a table");
    let satisfied: Vec<&str> = text.lines().skip(1).map(|l| l.rsplit(',').next().expect("a cell")).collect();
    // Three rocks bound no quantile but those that are lower than 37 %; a distance takes none.
    assert_eq!(satisfied, ["", "", "", "no", "", "not judged", "yes", "not judged", "not judged"], "{text}");
    assert!(
        checked.sentences[0].contains("UNI 11211-4: required are energy")
            && checked.sentences[0].contains("not satisfied")
    );
    let few = checked.warnings.iter().filter(|warning| warning.code == code::FEW_SAMPLES);
    assert_eq!((few.count(), checked.warnings.len()), (1, 1), "{:?}", checked.warnings);
    let of = |mass: &[f64], energy: &[f64]| {
        let passing = Passing { mass, energy, ..passing };
        let mut said = judged(&file, &design, &passing, &Reliability::default()).warnings;
        said.retain(|warning| warning.code != code::FEW_SAMPLES);
        said
    };
    for (mass, energy, words) in [
        (
            [300.0, 7938.0],
            [1e5, 2e5],
            "block_mass = 2000 kg, and the rocks that pass have 300 to 7938 kg, 1 of 2 are heavier",
        ),
        ([10.0, 190.0], [1e5, 2e5], "10 to 190 kg, 0 of 2 are heavier"),
        ([2e6, 3e6], [1e5, 2e5], "were it in tonnes, it would be 2000000 kg"),
        (
            [900.0, 2000.0],
            [1e5, 9e5],
            "requires 549565 J, and 1 of 2 rocks that pass have more energy, up to 900000 J: it takes",
        ),
    ] {
        let said = of(&mass, &energy);
        assert!(said.len() == 1 && said[0].to_string().contains(words), "{words}: {said:?}");
    }
    let passing = Passing { energy: &[1e5, 9e5], ..passing };
    let verdict = judged(&file, &design, &passing, &Reliability::default()).sentences.remove(0);
    let more =
        "energy 549565 J (1 of 2 rocks that pass have more energy, up to 900000 J), the barrier has 500000";
    assert!(verdict.contains(more), "{verdict}");
    let table = std::fs::read_to_string(&file).expect("a table");
    assert!(table.contains("; 1 of 2 rocks that pass have more energy"), "{table}");
}

/// The barrier has what 59 rocks ask for, the largest of which bounds the 95 % quantile: enough, unless the study is unreliable; 58 are too few.
#[test]
fn no_barrier_is_satisfied_by_too_few_rocks_or_an_unreliable_study() {
    let text = "[custom]\nbarrier_energy = 5e5\nbarrier_height = 4.0\n\
        onr_24810 = { energy_quantile = 95, height_quantile = 95, energy_factor = 1.05, height_factor = 1.1 }\n";
    let scene = Scene::from_text("s.toml", text).expect("TOML");
    let design: Design = scene.read("custom").expect("valid").expect("there");
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("design.csv");
    let of = |count: usize, energy: f64, study: Reliability| {
        let (energy, ones) = (vec![energy; count], vec![1.0; count]);
        let passing = Passing { energy: &energy, height: &ones, speed: &ones, mass: &ones };
        let verdict = judged(&file, &design, &passing, &study).sentences.remove(0);
        let table = std::fs::read_to_string(&file).expect("a table");
        let cells = table.lines().skip(1).map(|l| l.rsplit(',').next().expect("a cell").to_owned());
        (cells.collect::<Vec<_>>(), verdict)
    };
    let whole = Reliability::default();
    let unreliable = Reliability { is_unreliable: true, doubts: 0 };
    let doubted = Reliability { is_unreliable: false, doubts: 2 };
    for (count, energy, study, cells, words) in [
        (
            59,
            1e5,
            whole,
            ["yes", "yes"],
            "height 1.1 m (at most 1.1 with 95 % confidence), the barrier has 4: satisfied",
        ),
        (
            58,
            1e5,
            whole,
            ["not judged"; 2],
            "4: not judged, 58 rocks are too few for a bound of the 95 % quantile, which takes 59",
        ),
        (
            20,
            1e5,
            whole,
            ["not judged"; 2],
            "4: not judged, 20 rocks are too few for a bound of the 95 % quantile, which takes 59",
        ),
        (59, 1e5, unreliable, ["not judged"; 2], "4: not judged, the study is unreliable"),
        (
            59,
            1e6,
            unreliable,
            ["no", "not judged"],
            "500000 (59 of 59 rocks that pass have more): not satisfied",
        ),
        (59, 1e5, doubted, ["yes", "yes"], "satisfied; 2 warnings about the input of this study are open"),
    ] {
        let (found, verdict) = of(count, energy, study);
        assert!(found == cells && verdict.contains(words), "{words}: {found:?} {verdict}");
    }
}

/// A barrier that bears the quantile of the sample, and not what the quantile may be.
#[test]
fn a_barrier_between_a_quantile_and_its_bound_is_not_called_sufficient() {
    let text = "[custom]\nbarrier_energy = 9.7e4\n\
        onr_24810 = { energy_quantile = 95, height_quantile = 95, energy_factor = 1.0, height_factor = 1.0 }\n";
    let scene = Scene::from_text("s.toml", text).expect("TOML");
    let design: Design = scene.read("custom").expect("valid").expect("there");
    let dir = tempfile::tempdir().expect("a directory");
    let energy: Vec<f64> = (1..=100).map(|i| 1e3 * f64::from(i)).collect();
    let passing = Passing { energy: &energy, height: &energy, speed: &energy, mass: &energy };
    let checked = judged(&dir.path().join("design.csv"), &design, &passing, &Reliability::default());
    let said = &checked.sentences[0];
    assert!(said.contains("(at most 99000 with 95 % confidence), the barrier has 97000"), "{said}");
    assert!(said.contains("not judged: more members may show that it is too weak"), "{said}");
    let upper =
        checked.measures.iter().find(|m| m.name == "road_onr_required_energy_upper").expect("a measure");
    assert_eq!(upper.value, 99e3);
}

/// Each number in another unit than its own: refused or doubted, with what it would be.
#[test]
fn numbers_of_a_design_that_are_likelier_in_other_units_are_said() {
    let all = "onr_24810 = { energy_quantile = 99, height_quantile = 95, energy_factor = 1.05, height_factor = 1.1 }\n\
        uni_11211_4 = { block_mass = 2000, trajectories = 1.05, topography = 1.02, block_survey = 1.05, weight = 1, \
        free_border = 0.5, level = \"MEL\" }\n";
    let of = |text: &str| {
        let scene = Scene::from_text("s.toml", &format!("[custom]\n{text}")).expect("TOML");
        let design: Design = scene.read("custom").expect("valid").expect("there");
        design.check("custom", &scene).map_err(|e| e.to_string())
    };
    assert_eq!(of(all), Ok(Vec::new()));
    for (more, words) in [
        ("barrier_energy = 2000", "were it in kJ, it would be 2000000 J"),
        ("barrier_energy = 2e9", "barrier_energy = 2e9 J is very much: it must be 10000 to 1e8 J"),
        ("barrier_height = 400", "were it in cm, it would be 4 m"),
        ("barrier_elongation = 4400", "were it in mm, it would be 4.4 m"),
        ("barrier_fields = 0", "one field at least"),
    ] {
        let refused = of(&format!("{more}\n{all}")).expect_err(more);
        assert!(refused.starts_with("s.toml:2:") && refused.contains(words), "{refused}");
    }
    for (before, after, words) in [
        ("block_mass = 2000", "block_mass = 0.4", "were it in tonnes, it would be 400 kg"),
        ("topography = 1.02", "topography = 5", "topography = 5 is very much: it must be 1 to 3"),
        ("free_border = 0.5", "free_border = 50", "were it in cm, it would be 0.5 m"),
    ] {
        let refused = of(&all.replace(before, after)).expect_err(after);
        assert!(refused.starts_with("s.toml:3:") && refused.contains(words), "{refused}");
    }
    for (before, after, words) in [
        ("block_mass = 2000", "block_mass = 6", "were it in tonnes, it would be 6000 kg"),
        ("topography = 1.02", "topography = 1.5", "1.02 to 1.10"),
        ("onr", "barrier_height = 20\nonr", "20 m is very much; barriers are 2 to 10 m high"),
        ("height_factor = 1.1", "height_factor = 2", "height_factor: 2 is very much"),
    ] {
        let warned = of(&all.replacen(before, after, 1)).expect(after);
        assert!(
            warned.len() == 1 && warned[0].place.is_some() && warned[0].to_string().contains(words),
            "{warned:?}"
        );
    }
}

#[test]
fn factors_below_one_and_a_design_without_standard_are_refused() {
    for (text, what) in [
        ("barrier_energy = 1.0", "no standard"),
        (
            "onr_24810 = { energy_quantile = 0.95, height_quantile = 95, energy_factor = 1, height_factor = 1 }",
            "a quantile in %",
        ),
        (
            "onr_24810 = { energy_quantile = 99, height_quantile = 95, energy_factor = 0.9, height_factor = 1 }",
            "it must be 1 to 3",
        ),
        (
            "barrier_height = -1.0\nonr_24810 = { energy_quantile = 99, height_quantile = 95, energy_factor = 1, height_factor = 1 }",
            "above 0",
        ),
    ] {
        let scene = Scene::from_text("s.toml", &format!("[custom]\n{text}\n")).expect("TOML");
        let design: Design = scene.read("custom").expect("valid").expect("there");
        let refused = design.check("custom", &scene).expect_err(text).to_string();
        assert!(refused.contains(what), "{refused}");
    }
}
