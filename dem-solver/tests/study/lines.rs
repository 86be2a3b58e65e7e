//! Lines and maps hold what passes, in closed form; designs follow from the tables of lines.

use super::*;

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
    let verdict = summary["warnings"].to_string();
    let strong = largest.values().filter(|values| values[2] > 1e4).count();
    assert!(
        verdict.contains("UNI 11211-4")
            && verdict.contains("the barrier has 50: not judged, ")
            && verdict.contains("rocks are too few for a bound of the 95 % quantile"),
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
            ("translation_energy_J", energy - number(crossing, "rotation_energy_J")),
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
    // Wilson's interval of 4 of 4 ends at 4 / 7.8415 and 1; four rocks are too few for an upper end of a high quantile.
    let interval = |name: &str| summary["measures"][name]["interval"].clone();
    let share = interval("road_passing_share");
    assert!((share[0].as_f64().expect("a number") - 0.510_109).abs() < 1e-6 && share[1] == 1.0, "{share}");
    let energy = interval("road_energy_q90");
    let low = energy[0].as_f64().expect("a number");
    assert!((energies[1]..=energies[2]).contains(&low) && energy[1].is_null(), "{energy}");
    assert!(interval("road_energy_largest").is_null());
    let exceedance = std::fs::read_to_string(place.path("out/lines/road_exceedance.csv")).expect("a table");
    let exceedance = self::rows(&exceedance);
    assert_eq!(number(&exceedance[0], "share_of_all"), 0.25);
    // Of 1 of 4, by hand: (2.92073 -+ 1.95996 sqrt(0.75 + 0.96036)) / 7.84146.
    for (end, exact) in [("low", 0.045_587), ("high", 0.699_358)] {
        let found = number(&exceedance[0], &format!("share_of_passing_{end}"));
        assert!((found - exact).abs() < 1e-5, "{found}");
    }
    let curve = std::fs::read_to_string(place.path("out/lines/road.svg")).expect("a picture");
    assert!(curve.contains("100.0 % [51.0, 100.0] of all rocks pass") && curve.contains(", too few]"));
    assert!(curve.contains("EPSG:2056") && curve.contains("rockfall ") && curve.contains("UNRELIABLE"));
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
        assert!((at(&raster("share_low.tif")) - 0.510_109).abs() < 1e-6);
        assert_eq!(at(&raster("share_high.tif")), 1.0);
        assert_eq!(raster("speed_q50_high.tif").nearest(x, 1_200_021.0), None, "four are too few");
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
    let file = rusqlite::Connection::open(place.path("out/maps/study.gpkg")).expect("a GeoPackage");
    let ask = |what: &str| -> i64 { file.query_row(what, [], |row| row.get(0)).expect("an answer") };
    assert_eq!(ask("SELECT count(*) FROM trajectories"), 4);
    assert_eq!(ask("SELECT srs_id FROM gpkg_contents WHERE table_name = 'trajectories'"), 2056);
    // A head of 8 bytes, then a point of z: each rock leaves the terrain at its eastern border.
    let places = file.prepare("SELECT geom, max_speed_m_per_s FROM ends ORDER BY member");
    let mut places = places.expect("columns");
    let mut found = places.query([]).expect("rows");
    for row in &rows {
        let of = found.next().expect("a row").expect("as many as members");
        let blob: Vec<u8> = of.get(0).expect("a geometry");
        let part = |k: usize| f64::from_le_bytes(blob[13 + 8 * k..21 + 8 * k].try_into().expect("8 bytes"));
        assert_eq!((&blob[..4], blob.len()), (&b"GP\0\x01"[..], 37));
        for (k, name) in ["end_x_m", "end_y_m", "end_z_m"].into_iter().enumerate() {
            assert!((part(k) - number(row, name)).abs() <= 5.1e-4, "{name}: {} {row:?}", part(k));
        }
        let speed: f64 = of.get(1).expect("a number");
        assert!((speed / number(row, "max_speed_m_per_s") - 1.0).abs() < 1e-5, "{speed}");
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
    let output = ask("ogrinfo", &["-al", "-so"], "study.gpkg").expect("part of the same package");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in ["Feature Count: 4", "3D Line String", "CH1903+ / LV95", "max_kinetic_energy_J: Real"] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

/// What QGIS makes of the layers: how it draws them, with the style that lies beside or in each.
const IN_QGIS: &str = r#"
import sys
from qgis.core import QgsApplication, QgsRasterLayer, QgsVectorLayer
application = QgsApplication([], False)
application.initQgis()
for name in ("speed_q50.tif", "speed_q50_low.tif", "count.tif"):
    layer = QgsRasterLayer(f"{sys.argv[1]}/{name}", name)
    items = layer.renderer().shader().rasterShaderFunction().colorRampItemList()
    print(name, layer.renderer().type(), len(items), items[0].color.name(), items[-1].color.name(), f"{items[-1].value:.6g}")
for name in ("trajectories", "ends"):
    layer = QgsVectorLayer(f"{sys.argv[1]}/study.gpkg|layername={name}", name, "ogr")
    print(name, layer.featureCount(), layer.crs().authid(), layer.renderer().type())
application.exitQgis()
"#;

#[test]
fn layers_have_their_style_in_qgis() {
    let place = flights();
    place.table("out", &[]);
    let ask = |arguments: &[&str]| {
        let mut command = Command::new("/usr/bin/python3");
        command.env("QT_QPA_PLATFORM", "offscreen").arg("-c").args(arguments).output()
    };
    if !ask(&["import qgis.core"]).is_ok_and(|output| output.status.success()) {
        return println!("skipped: QGIS is not installed for Python (Debian: python3-qgis)");
    }
    let maps = place.path("out/maps");
    let output = ask(&[IN_QGIS, maps.to_str().expect("a path")]).expect("it was there");
    let text = String::from_utf8_lossy(&output.stdout);
    let lines: Vec<&str> = text.lines().collect();
    let [speed, low, count, trajectories, ends] = lines[..] else { panic!("{text}{output:?}") };
    assert_eq!(speed.split_once(' ').map(|of| of.1), low.split_once(' ').map(|of| of.1), "one scale");
    assert!(
        count.starts_with("count.tif singlebandpseudocolor ") && count.ends_with(" #5a003c 4"),
        "{count}"
    );
    assert!(speed.starts_with("speed_q50.tif singlebandpseudocolor 17 #fff5be #5a003c "), "{speed}");
    assert_eq!(trajectories, "trajectories 4 EPSG:2056 singleSymbol");
    assert_eq!(ends, "ends 4 EPSG:2056 categorizedSymbol");
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
