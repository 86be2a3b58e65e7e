//! Sources of known rates: frequencies at a line in closed form, and what a barrier there leaves of them.

use super::*;

/// Flights over a plane from two sources: one of equal blocks with speeds evenly from 10 to 14 m/s, a quarter of them away from the line;
/// one of equal speeds with volumes by a power law.
const SOURCES: &str = "scene = \"fall.toml\"\nmost_failed = 1.0\n\
    [[release]]\nname = \"cliff\"\npoints = [[2600010.0, 1200020.5]]\nheight = 20.0\ncount = 300\nblocks_per_year = 0.4\n\
    [release.vary]\nspeed = { uniform = [10.0, 14.0] }\nazimuth = { choice = [90.0, 270.0], weights = [3, 1] }\n\
    [[release]]\nname = \"face\"\npoints = [[2600010.0, 1200020.5]]\nheight = 20.0\ncount = 200\nblocks_per_year = 0.06\n\
    [release.vary]\nspeed = 12.0\nvolume = { power_law = [0.05, 2.0, 0.8] }\n\
    [vary]\nvolume = 0.1\nazimuth = 90.0\nspeed = 11.0\n\
    [maps]\ncell = 2.0\n\
    [[line]]\nname = \"road\"\npoints = [[2600015.25, 1200030.0], [2600015.25, 1200010.0]]\n\
    [line.barrier]\nenergy = 2e4\nheight = 19.5\n";

const RATES: [f64; 2] = [0.4, 0.06];
const DENSITY: f64 = 2600.0;
const BARRIER: [f64; 2] = [2e4, 19.5];

/// Kinetic energy at the line, and how far a rock has dropped there.
fn at_line(volume: f64, speed: f64) -> [f64; 2] {
    let drop = 9.81 * 5.25 / speed;
    [0.5 * DENSITY * volume * (speed * speed + drop * drop), 0.5 * 9.81 * (5.25 / speed).powi(2)]
}

fn radius(volume: f64) -> f64 {
    (0.75 * volume / std::f64::consts::PI).cbrt()
}

/// Where a rising function passes 0.
fn root([mut low, mut high]: [f64; 2], of: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *if of(middle) < 0.0 { &mut low } else { &mut high } = middle;
    }
    0.5 * (low + high)
}

/// Shares of both sources with more than this speed, and more than this volume.
fn faster(speed: f64) -> f64 {
    0.75 * (14.0 - speed.clamp(10.0, 14.0)) / 4.0
}

fn larger(volume: f64) -> f64 {
    let [v, least, most] = [volume.clamp(0.05, 2.0), 0.05, 2.0].map(|v: f64| v.powf(-0.8));
    (v - most) / (least - most)
}

/// Share of each source that reaches an energy at the line: it rises with speed and volume.
fn reaching(energy: f64) -> [f64; 2] {
    let speed = root([10.0, 14.0], |speed| at_line(0.1, speed)[0] - energy);
    [faster(speed), larger(energy / at_line(1.0, 12.0)[0])]
}

fn frequency(shares: [f64; 2]) -> f64 {
    RATES[0] * shares[0] + RATES[1] * shares[1]
}

fn summary(place: &Place) -> serde_json::Value {
    let text = std::fs::read_to_string(place.path("out/summary.json")).expect("a summary");
    serde_json::from_str(&text).expect("JSON")
}

fn sources(text: &str) -> Place {
    let place = flights();
    place.write("study.toml", text);
    place.table("out", &[]);
    place
}

/// Frequency of the energy of a row, and the ends of its interval.
fn of_row(row: &HashMap<String, String>) -> [f64; 3] {
    ["", "_low", "_high"].map(|end| number(row, &format!("energy_frequency_per_year{end}")))
}

/// The curve of energies holds the closed form within its interval, and so do values of return periods and the frequency itself.
#[test]
#[ignore = "long"]
fn frequencies_of_two_sources_hold_the_closed_form() {
    for (sampling, seeds, least) in [("latin_hypercube", 1..=2, 1.0), ("random", 1..=4, 0.9)] {
        let (mut held, mut all) = (0, 0);
        for seed in seeds {
            let place = sources(&format!("sampling = \"{sampling}\"\nseed = {seed}\n{SOURCES}"));
            let table =
                std::fs::read_to_string(place.path("out/lines/road_exceedance.csv")).expect("a table");
            let rows = rows(&table);
            for row in &rows {
                let [often, low, high] = of_row(row);
                assert!(low <= often && often <= high);
                assert!((number(row, "energy_return_period_years") * often - 1.0).abs() < 1e-12);
            }
            // At energies that are chosen before: those of the members have a member that reaches them for certain.
            for share in (1..100).map(|k| 0.36 * f64::from(k) / 100.0) {
                let energy = root([0.0, 1e6], |energy| share - frequency(reaching(energy)));
                let Some(row) = rows.iter().rfind(|row| number(row, "energy_J") >= energy) else { continue };
                let [_, low, high] = of_row(row);
                (held, all) = (held + usize::from((low..=high).contains(&share)), all + 1);
            }
            let measures = &summary(&place)["measures"];
            let [mut inside, mut known] = [0, 0];
            for (name, exact) in [10.0, 30.0, 100.0, 300.0].map(|years| {
                let energy = root([0.0, 1e6], |energy| 1.0 / years - frequency(reaching(energy)));
                (format!("road_energy_{years}_years"), energy)
            }) {
                let of = &measures[&name];
                // Of 300 blocks with none above, the cliff may still send 0.4 * 3.84 / 303.84 a year: more than one in 300 years.
                let [low, high] = [0, 1].map(|end| of["interval"][end].as_f64());
                assert!(low.is_some() && high.is_none() == name.contains("_300_"), "{name}: {of}");
                inside += usize::from(low <= Some(exact) && high.is_none_or(|high| exact <= high));
                known += 1;
                println!("{sampling} {seed}: {name} {} {}, exact {exact}", of["value"], of["interval"]);
            }
            assert!(inside + usize::from(sampling == "random") >= known, "{inside} of {known}");
            let of = &measures["road_passing_frequency"];
            let [low, high] = [0, 1].map(|end| of["interval"][end].as_f64().expect("an end"));
            println!("{sampling} {seed}: {} [{low}, {high}], exact 0.36", of["value"]);
            assert!(sampling == "random" || low < 0.36 && 0.36 < high);
            if sampling == "latin_hypercube" {
                assert!((of["value"].as_f64().expect("a number") - 0.36).abs() < 0.4 / 300.0 + 1e-9);
                let map = dem_solver::terrain::formats::raster(&place.path("out/maps/frequency.tif"));
                let cell = map.unwrap_or_else(|e| panic!("{e}")).nearest(2_600_015.0, 1_200_021.0);
                assert!(
                    cell.is_some_and(|often| (often / of["value"].as_f64().expect("one") - 1.0).abs() < 1e-6)
                );
            }
        }
        println!("{sampling}: {held} of {all} points of the curve hold the closed form");
        assert!(f64::from(held as u32) >= least * f64::from(all as u32), "{sampling}: {held} of {all}");
    }
}

/// What comes, and what a barrier does with it, add up; each share and frequency is that of its closed form.
#[test]
fn shares_at_a_barrier_add_up_to_one() {
    let place = sources(SOURCES);
    let summary = summary(&place);
    let value = |name: &str| {
        summary["measures"][format!("road_{name}")]["value"].as_f64().unwrap_or_else(|| panic!("{name}"))
    };
    let fates = ["not_reached", "stopped", "went_through", "passed_over"];
    let sum = |what: &str| fates.iter().map(|fate| value(&format!("{fate}_{what}"))).sum::<f64>();
    assert!((sum("share") - 1.0).abs() < 1e-12 && (sum("frequency") - 0.46).abs() < 1e-12);
    for what in ["share", "frequency"] {
        let behind = value(&format!("went_through_{what}")) + value(&format!("passed_over_{what}"));
        assert!((value(&format!("behind_barrier_{what}")) - behind).abs() < 1e-12);
    }
    // Over it: fast ones, and large ones, whose centre is higher.
    let over_speed = root([10.0, 14.0], |speed| 20.0 + radius(0.1) - at_line(0.1, speed)[1] - BARRIER[1]);
    let over_volume = root([0.05, 2.0], |volume| 20.0 + radius(volume) - at_line(1.0, 12.0)[1] - BARRIER[1]);
    let over = [faster(over_speed), larger(over_volume)];
    let strong = reaching(BARRIER[0]);
    let (rates, members) = (RATES, [300.0, 200.0]);
    for (fate, due) in [
        ("not_reached", [0.25, 0.0]),
        ("stopped", [0.75 - strong[0], 1.0 - strong[1]]),
        ("went_through", [strong[0] - over[0], strong[1] - over[1]]),
        ("passed_over", over),
        ("behind_barrier", strong),
    ] {
        let share = (members[0] * due[0] + members[1] * due[1]) / 500.0;
        let exact = [("share", share), ("frequency", rates[0] * due[0] + rates[1] * due[1])];
        for (what, exact) in exact {
            let name = format!("road_{fate}_{what}");
            let of = &summary["measures"][&name]["interval"];
            let [low, high] = [0, 1].map(|end| of[end].as_f64().expect("an end"));
            println!("{name} {} [{low}, {high}], exact {exact}", value(&format!("{fate}_{what}")));
            assert!(low <= exact && exact <= high, "{name}: [{low}, {high}] {exact}");
        }
    }
    let said = summary["warnings"].to_string();
    assert!(said.contains("a member of `cliff` stands for more blocks a year than one of `face`"), "{said}");
}

/// Behind the barrier of another line counts what goes through or over it: of the closed form the share that is stronger or higher. A line
/// before it, and the line of the barrier itself, lose nothing. With another capacity the same falls are judged again.
#[test]
#[ignore = "long"]
fn lines_behind_a_barrier_have_what_passes_it_from_the_same_falls() {
    let line = |name: &str, x: f64| {
        format!("[[line]]\nname = \"{name}\"\npoints = [[{x}, 1200030.0], [{x}, 1200010.0]]\n")
    };
    let study = format!("{SOURCES}{}{}", line("before", 2_600_013.0), line("behind", 2_600_020.25));
    let place = sources(&study);
    let of = |name: &str| summary(&place)["measures"][name].clone();
    let value = |name: &str| of(name)["value"].as_f64().unwrap_or_else(|| panic!("{name}"));
    let journal = || std::fs::read(place.path("out/chunks/main.journal")).expect("a journal");
    let falls = journal();
    for (turn, capacity) in [(0, BARRIER[0]), (1, 1.5e4), (2, 5e7)] {
        if turn > 0 {
            place.table("out", &["--resume", "--set", &format!("line.0.barrier.energy={capacity:e}")]);
        }
        assert!(journal() == falls, "the falls are those that were computed");
        let crossings = |line: &str| {
            rows(&std::fs::read_to_string(place.path(&format!("out/lines/{line}.csv"))).expect("a table"))
        };
        let pass = |row: &&HashMap<String, String>| {
            number(row, "kinetic_energy_J") > capacity || number(row, "centre_height_m") > BARRIER[1]
        };
        let net = crossings("road");
        let passing: Vec<&str> = net.iter().filter(pass).map(|row| row["member"].as_str()).collect();
        assert!(passing.len() > 10 && passing.len() < net.len(), "{}", passing.len());
        assert_eq!(value("behind_with_barriers_passing"), passing.len() as f64);
        assert_eq!(value("behind_passing"), net.len() as f64);
        let energies =
            crossings("behind").into_iter().filter(|row| passing.contains(&row["member"].as_str()));
        let most = energies.map(|row| number(&row, "kinetic_energy_J")).fold(0.0, f64::max);
        assert_eq!(value("behind_with_barriers_energy_largest"), most);
        for what in ["passing_share", "passing_frequency", "energy_q95"] {
            assert_eq!(of(&format!("before_{what}")), of(&format!("before_with_barriers_{what}")));
        }
        for what in ["share", "frequency"] {
            let both = ["behind_with_barriers_passing", "road_behind_barrier"]
                .map(|name| of(&format!("{name}_{what}")));
            assert!(["value", "interval"].iter().all(|part| both[0][part] == both[1][part]), "{both:?}");
        }
        assert!(of("road_with_barriers_passing").is_null(), "no other line has a barrier");
        // What is not stopped by its strength passes over by its height alone, at fewer speeds and sizes.
        let over_speed = root([10.0, 14.0], |speed| 20.0 + radius(0.1) - at_line(0.1, speed)[1] - BARRIER[1]);
        let over_volume =
            root([0.05, 2.0], |volume| 20.0 + radius(volume) - at_line(1.0, 12.0)[1] - BARRIER[1]);
        let strong = reaching(capacity);
        let due = frequency([strong[0].max(faster(over_speed)), strong[1].max(larger(over_volume))]);
        let [low, high] =
            [0, 1].map(|end| of("behind_with_barriers_passing_frequency")["interval"][end].as_f64());
        println!(
            "{capacity:e}: {} {low:?} {high:?}, exact {due}",
            value("behind_with_barriers_passing_frequency")
        );
        assert!(low <= Some(due) && Some(due) <= high);
        let lost = net.len() - passing.len();
        let said = summary(&place)["warnings"].to_string();
        assert!(said.contains(&format!("stop {lost} of the {} rocks that come here", net.len())), "{said}");
    }
    // As if it had been computed so, but for the file of the study and the arguments.
    place.write("study.toml", &study.replace("energy = 2e4", "energy = 5e7"));
    place.table("anew", &[]);
    let lines = |out: &str| {
        let all = std::fs::read_dir(place.path(out).join("lines")).expect("a folder");
        let mut all: Vec<_> = all.map(|file| file.expect("a file").path()).collect();
        all.sort();
        all.iter()
            .map(|path| (path.file_name().map(ToOwned::to_owned), std::fs::read(path).expect("read")))
            .collect::<Vec<_>>()
    };
    assert!(lines("anew") == lines("out"));
    // Without a barrier nothing lies behind one, and another name is another file.
    let bare = study.split("[line.barrier]").next().expect("text").replace("\"road\"", "\"way\"");
    place.write("study.toml", &(bare + &line("before", 2_600_013.0) + &line("behind", 2_600_020.25)));
    place.table("out", &["--resume"]);
    let names: Vec<_> = lines("out").into_iter().filter_map(|(name, _)| name).collect();
    assert!(
        names.len() == 9
            && names.iter().all(
                |name| name.to_string_lossy().contains("way") || !name.to_string_lossy().contains("road")
            ),
        "{names:?}"
    );
}

#[test]
fn rates_of_some_releases_alone_are_refused_and_so_is_a_design_of_unequal_members() {
    let design = "[line.design.onr_24810]\nenergy_quantile = 99.0\nheight_quantile = 90.0\nenergy_factor = 1.15\nheight_factor = 1.3\n";
    for (text, words) in [
        (
            SOURCES.replace("blocks_per_year = 0.06\n", ""),
            "some releases have blocks_per_year, and this one has none",
        ),
        (
            SOURCES.replace("blocks_per_year = 0.06", "blocks_per_year = 0.0"),
            "blocks_per_year = 0: it must lie above 0",
        ),
        (format!("{SOURCES}{design}"), "those of `cliff` stand for more blocks a year than those of `face`"),
        (SOURCES.replace("volume = 0.1\n", ""), "`volume` varies at this release alone"),
        (SOURCES.replace("speed = 12.0", "speed = -12.0"), "a speed has no sign"),
        (
            SOURCES.replace("speed = 12.0\n", "speed = 12.0\norientation = \"uniform\"\n"),
            "unknown quantity `orientation`",
        ),
        (SOURCES.replace("energy = 2e4", "energy = 200.0"), "were it in kJ, it would be"),
    ] {
        let place = flights();
        place.write("study.toml", &text);
        let refused = place.run("out", &[]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(words), "{words}: {said}");
    }
    // In proportion to their rates they are one sample.
    let equal = SOURCES.replace("count = 200", "count = 45") + design;
    let place = sources(&equal);
    assert!(!summary(&place)["warnings"].to_string().contains("count all alike"));
}
