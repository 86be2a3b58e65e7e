use super::*;

const DROP: &str = "[[rock]]\ncluster.spheres = 64\n[[rock]]\ncluster.spheres = 1\n[[contact]]\nyoung = 1e8\n\
    [structure]\ngenerator = { cells = [26, 26], spacing = 0.15 }\ncable = { area = 2e-5 }\n\
    [dem]\ncontact_selection = \"automatic\"\ntime_step = 1e-5\n[fem]\nintegrator = \"central_difference\"\n\
    [coupling]\nscheme = \"weak\"\ntime_window = 5e-5\nsamples = 1\ntolerance = 1e-4\nabsolute_tolerance = 0.0\n";

fn knobs(text: &str, in_use: &[(&'static str, f64)]) -> Vec<Knob> {
    of(&Base { resolved: &text.parse().expect("TOML"), in_use })
}

fn names(knobs: &[Knob]) -> Vec<&str> {
    knobs.iter().map(|knob| knob.name).collect()
}

#[test]
fn a_scene_has_the_knobs_whose_keys_it_has() {
    let coupled = knobs(DROP, &[("fem.time_step", 2e-5)]);
    assert_eq!(
        names(&coupled),
        [
            "scheme",
            "integrator",
            "window",
            "samples",
            "dem_step",
            "fem_step",
            "spheres",
            "refinement",
            "modulus",
            "contact_selection"
        ],
        "one tolerance is 0, so both stay as they are"
    );
    let alone =
        "[[rock]]\ncluster.spheres = 1\n[[contact]]\nstiffness = 1e6\n[dem]\nsteps_per_contact = 50.0\n";
    assert_eq!(names(&knobs(alone, &[("dem.time_step", 1e-5)])), ["steps_per_contact", "modulus"]);
    // A mesh file: nothing to refine.
    let mesh = "[structure]\nmesh = \"net.msh\"\ncable = { area = 1e-4 }\n[fem]\ntime_step = 1e-5\n";
    assert_eq!(names(&knobs(mesh, &[])), ["fem_step"]);
}

/// A name that another knob needs is one that it has: else it would never be turned.
#[test]
fn what_a_knob_needs_is_there() {
    for spec in REGISTRY {
        if let Some((other, name)) = spec.needs {
            let there = REGISTRY.iter().find(|s| s.name == other).unwrap_or_else(|| panic!("no {other}"));
            assert!(there.names.contains(&name), "{}", spec.name);
        }
    }
}

/// A yielding net is strong coupling: in weak windows nothing judges it.
#[test]
fn a_net_that_yields_is_a_scheme_of_its_own() {
    let text =
        |own: &str| format!("[coupling]\nscheme = {own}\nyielding_tolerance = 1e-4\nyielding_share = 0.1\n");
    let of = |own: &str| {
        let knobs = knobs(&text(own), &[]);
        assert_eq!(names(&knobs), ["scheme", "yielding_tolerance"]);
        [0.0, 1.0, 2.0]
            .map(|rung| (knobs[0].value(rung).expect("a name"), knobs[0].sets(rung).expect("sets")))
    };
    let named = |name: &str, sets: &[&str]| {
        (name.to_owned(), sets.iter().map(|set| (*set).to_owned()).collect::<Vec<_>>())
    };
    assert_eq!(
        of("\"weak\"\nyielding_net = false"),
        [
            named("weak", &["coupling.scheme=weak"]),
            named("yielding", &["coupling.scheme=strong", "coupling.yielding_net=true"]),
            named("strong", &["coupling.scheme=strong"])
        ]
    );
    assert_eq!(
        of("\"strong\"\nyielding_net = true")[1],
        named("weak", &["coupling.scheme=weak", "coupling.yielding_net=false"])
    );
}

#[test]
fn a_rung_is_a_set_of_each_of_its_keys() {
    let knobs = knobs(DROP, &[]);
    let sets = |name: &str, rung| knobs.iter().find(|k| k.name == name).expect("there").sets(rung);
    let text = |sets: &[&str]| Some(sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>());
    assert_eq!(sets("window", 2.0), text(&["coupling.time_window=2e-4"]));
    assert_eq!(sets("samples", -2.0), text(&["coupling.samples=4"]));
    assert_eq!(sets("samples", 1.0), None);
    assert_eq!(sets("spheres", 1.0), text(&["rock.0.cluster.spheres=8"]));
    assert_eq!(
        sets("refinement", -1.0),
        text(&[
            "structure.generator.cells=[52, 52]",
            "structure.generator.spacing=0.075",
            "structure.cable.area=1e-5"
        ])
    );
    assert_eq!(sets("refinement", 2.0), None, "26 is no multiple of 4");
    assert_eq!(sets("scheme", 1.0), text(&["coupling.scheme=strong"]));
    assert_eq!((sets("scheme", 2.0), sets("scheme", -1.0)), (None, None));
}

#[test]
fn a_name_that_no_knob_has_is_refused_and_the_others_stand_still() {
    let mut knobs = knobs(DROP, &[]);
    turn_only(&mut knobs, &["window".into(), "spheres".into()]).expect("both are there");
    let turned: Vec<&str> = knobs.iter().filter(|knob| knob.turned).map(|knob| knob.name).collect();
    assert_eq!(turned, ["window", "spheres"]);
    let error = turn_only(&mut knobs, &["windw".into()]).expect_err("misspelt").to_string();
    assert!(error.contains("did you mean `window`?"), "{error}");
    turn_only(&mut knobs, &[]).expect("all");
    assert!(knobs.iter().all(|knob| knob.turned));
}

fn space(pinned: &[(&str, &str)]) -> Space {
    let text = "[dem]\ntime_step = 1e-5\n[coupling]\nscheme = \"weak\"\ntime_window = 4e-5\nsamples = 1\ntolerance = 1e-4\n\
        absolute_tolerance = 1e-6\n[[contact]]\nyoung = 1e8\n";
    let resolved = text.parse().expect("TOML");
    let knobs = of(&Base { resolved: &resolved, in_use: &[("fem.time_step", 2e-5)] });
    let pinned = pinned.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    Space { starts: vec![Start { knobs, pinned }] }
}

#[test]
fn steps_that_no_window_lets_be_longer_are_one_point() {
    let space = space(&[]);
    let key = |rungs: &[(&'static str, f64)]| space.key(&rungs.iter().copied().collect());
    assert_eq!(key(&[("dem_step", 2.0)]), key(&[("dem_step", 5.0)]), "cut to the window of 4e-5 s");
    assert_ne!(key(&[("dem_step", 1.0)]), key(&[("dem_step", 2.0)]));
    assert_ne!(key(&[("dem_step", 2.0), ("window", 1.0)]), key(&[("dem_step", 3.0), ("window", 1.0)]));
    // Weak coupling does not use its tolerance.
    assert_eq!(key(&[("tolerance", 1.0)]), key(&[]));
    assert_ne!(key(&[("tolerance", 1.0), ("scheme", 1.0)]), key(&[("scheme", 1.0)]));
}

/// Whichever knob moves, what the programs have chosen stays; a knob of it moves from there.
#[test]
fn what_the_scene_leaves_open_is_held_while_a_knob_moves() {
    let space = space(&[("coupling.scheme", "weak"), ("fem.time_step", "2e-5"), ("coupling.other", "3")]);
    let sets = |rungs: &[(&'static str, f64)]| space.sets(&rungs.iter().copied().collect()).expect("a point");
    assert!(sets(&[]).is_empty());
    let held = ["coupling.scheme=weak", "fem.time_step=2e-5", "coupling.other=3"];
    assert_eq!(sets(&[("window", 1.0)]), [&["coupling.time_window=8e-5"], &held[..]].concat());
    assert_eq!(sets(&[("modulus", 1.0)]), [&["contact.0.young=2.5e7"], &held[..]].concat());
    assert_eq!(
        sets(&[("fem_step", 1.0)]),
        ["fem.time_step=4e-5", "coupling.scheme=weak", "coupling.other=3"]
    );
    let beside = space.with_sets(&Point::new(), vec!["coupling.scheme=strong".into()]).expect("a point");
    assert_eq!(beside, ["coupling.scheme=strong", "fem.time_step=2e-5", "coupling.other=3"]);
}

/// Values of a preset are the start of all knobs, and every one of them is named.
#[test]
fn a_preset_is_another_start_of_all_knobs() {
    let mut space = space(&[]);
    space.starts[0].knobs.insert(0, Knob::of_presets(["fast"].into_iter()));
    let text = "[coupling]\nscheme = \"strong\"\nyielding_net = true\ntime_window = 1e-3\nyielding_tolerance = 1e-5\nyielding_share = 0.3\n";
    let mut knobs = knobs(text, &[("fem.time_step", 1e-4)]);
    knobs.insert(0, space.starts[0].knobs[0].clone());
    let pinned =
        [("coupling.scheme", "strong"), ("coupling.yielding_net", "true"), ("coupling.time_window", "1e-3")];
    let pinned = pinned.map(|(key, value)| (key.to_owned(), value.to_owned())).to_vec();
    space.starts.push(Start { knobs, pinned });
    let preset = Point::from([(PRESET, 1.0)]);
    let longer = with(&preset, "window", 1.0);
    let sets = |point| space.sets(point).expect("a point");
    assert_eq!(
        sets(&preset),
        ["coupling.scheme=strong", "coupling.yielding_net=true", "coupling.time_window=1e-3"]
    );
    assert_eq!(
        sets(&longer),
        ["coupling.time_window=2e-3", "coupling.scheme=strong", "coupling.yielding_net=true"]
    );
    assert_eq!(space.label(&longer), "preset fast, window 2e-3");
    assert_eq!(space.arms()[1], preset, "it is among the first that are tried");
    let turned = |point: &Point| space.turned(point).map(|knob| knob.name).collect::<Vec<_>>();
    assert!(
        turned(&preset).contains(&"yielding_tolerance")
            && !turned(&Point::new()).contains(&"yielding_tolerance")
    );
    // 0.3 of the increment four times is more than all of it.
    assert_eq!(space.sets(&with(&preset, "yielding_tolerance", 1.0)), None);
    // The share is a part of what is computed, though a person is shown the tolerance alone.
    assert!(space.key(&preset).expect("a point").contains("yielding_share=0.3"), "{:?}", space.key(&preset));
    assert_eq!(space.refined(&preset, 1.0)[PRESET], 1.0);
}

#[test]
fn a_finer_point_costs_its_factors_and_a_coarser_one_no_less() {
    let space = space(&[]);
    let p = |rungs: &[(&'static str, f64)]| rungs.iter().copied().collect::<Point>();
    assert_eq!(space.dearer(&p(&[("window", 1.0)]), &p(&[("window", -1.0), ("dem_step", 3.0)])), 4.0);
    assert_eq!(space.refined(&p(&[]), 2.0), p(&[("window", -2.0), ("dem_step", -2.0), ("fem_step", -2.0)]));
    assert_eq!(space.arms(), [p(&[]), p(&[("scheme", 1.0)])]);
}
