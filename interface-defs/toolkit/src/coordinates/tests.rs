use super::*;

const SQUARE: &str = "[[[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]]";

fn feature(name: &str, kind: &str, coordinates: &str) -> String {
    let properties = if name.is_empty() { "{}".into() } else { format!("{{\"name\": {name}}}") };
    format!(
        "{{\"type\": \"Feature\", \"properties\": {properties}, \"geometry\": {{\"type\": \"{kind}\", \"coordinates\": \
         {coordinates}}}}}"
    )
}

fn collection(system: &str, features: &[String]) -> String {
    let crs = match system {
        "" => String::new(),
        system => {
            format!("\"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \"{system}\"}}}}, ")
        }
    };
    format!("{{\"type\": \"FeatureCollection\", {crs}\"features\": [{}]}}", features.join(", "))
}

/// What `it = VALUE` holds beside a file `a.geojson` of this text.
fn read(value: &str, form: Form, text: &str) -> Result<Vec<[f64; 2]>, String> {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("a.geojson"), text).expect("written");
    let file = dir.path().join("s.toml");
    std::fs::write(&file, format!("[custom]\nit = {value}\n")).expect("written");
    let scene = Scene::load(&file, &[]).expect("TOML");
    let table: std::collections::BTreeMap<String, Coordinates> =
        scene.read("custom").map_err(|e| e.to_string())?.expect("there");
    let read = table["it"].read(form, "custom.it", &scene).map_err(|e| e.to_string());
    read.map(|points| points.to_vec()).map_err(|e| e.replace(&format!("{}/", dir.path().display()), ""))
}

#[test]
fn points_are_those_that_are_written_or_those_of_the_file() {
    let square = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
    let written = "[[0, 0], [4.0, 0], [4, 3], [0, 3]]";
    assert_eq!(read(written, Form::Polygon, "").as_ref(), Ok(&square));
    let one = collection("urn:ogc:def:crs:EPSG::2056", &[feature("", "Polygon", SQUARE)]);
    for text in [
        one.clone(),
        feature("", "MultiPolygon", &format!("[{SQUARE}]")),
        format!("{{\"type\": \"Polygon\", \"coordinates\": {SQUARE}}}"),
        // Beside features of another form.
        collection("", &[feature("", "Point", "[9, 9]"), feature("", "Polygon", SQUARE)]),
    ] {
        assert_eq!(read("\"a.geojson\"", Form::Polygon, &text).as_ref(), Ok(&square), "{text}");
    }
    let line = feature("", "LineString", "[[1, 2, 700.5], [3, 4.25, 701]]");
    assert_eq!(read("\"a.geojson\"", Form::Line, &line), Ok(vec![[1.0, 2.0], [3.0, 4.25]]));
    let points = [feature("", "MultiPoint", "[[1, 2], [3, 4]]"), feature("", "Point", "[5, 6]")];
    let due = vec![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
    assert_eq!(read("\"a.geojson\"", Form::Points, &collection("", &points)), Ok(due));
    let (west, east) =
        (feature("\"west\"", "Polygon", "[[[9, 9], [8, 9], [8, 8]]]"), feature("7", "Polygon", SQUARE));
    let both = collection("", &[west, east]);
    let of =
        |name: &str| read(&format!("{{ file = \"a.geojson\", name = \"{name}\" }}"), Form::Polygon, &both);
    assert_eq!(of("west"), Ok(vec![[9.0, 9.0], [8.0, 9.0], [8.0, 8.0]]));
    assert_eq!(of("7"), Ok(square));
}

#[test]
fn names_are_texts_or_whole_numbers_and_attributes_in_capitals() {
    let points =
        [feature("18.0", "Point", "[1, 2]"), feature("\"a\"", "Point", "[3, 4]").replace("name", "NAME")];
    let all = format!("\u{feff}{}", collection("", &points));
    for (name, due) in [("18", [1.0, 2.0]), ("\"18\"", [1.0, 2.0]), ("\"a\"", [3.0, 4.0])] {
        let value = format!("{{ file = \"a.geojson\", name = {name} }}");
        assert_eq!(read(&value, Form::Points, &all), Ok(vec![due]), "{name}");
    }
}

#[test]
fn a_layer_knows_its_coordinate_system() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("a.geojson");
    let one = [feature("", "Point", "[1, 2]")];
    for (system, due) in [
        ("urn:ogc:def:crs:EPSG::2056", Some(2056)),
        ("EPSG:25832", Some(25832)),
        ("", None),
        ("urn:x:local:7", None),
    ] {
        std::fs::write(&file, collection(system, &one)).expect("written");
        let scene = Scene::from_text("s.toml", "end_time = 1.0\n").expect("TOML");
        let read =
            Coordinates::<[f64; 2]>::of_file(&file).read(Form::Points, "end_time", &scene).expect("read");
        assert_eq!(read.system(), due, "{system}");
        assert!(read.check_system(None, "end_time", &scene).is_ok());
        let refused = read.check_system(Some(31254), "end_time", &scene).map_err(|e| e.headline());
        let what =
            |code| Err(format!("s.toml:1:12: its layer is in EPSG:{code}, and the terrain in EPSG:31254"));
        assert_eq!(refused, due.map_or(Ok(()), what));
    }
}

#[test]
fn what_is_not_one_feature_of_the_form_is_refused_with_what_to_try() {
    let west = feature("\"west\"", "Polygon", SQUARE);
    let both = collection("", &[west.clone(), feature("\"east\"", "Polygon", SQUARE)]);
    let holes = feature("", "Polygon", "[[[0, 0], [4, 0], [4, 3]], [[1, 1], [2, 1], [2, 2]]]");
    let bare = [feature("", "Polygon", SQUARE), feature("", "Polygon", SQUARE)];
    let line = feature("", "LineString", "[[1, 2], [3, 4]]");
    let two_parts = feature("\"a\"", "MultiPolygon", &format!("[{SQUARE}, {SQUARE}]"));
    let null = "{\"type\": \"Feature\", \"properties\": {\"fid\": 1}, \"geometry\": null}".to_owned();
    let degrees = "urn:ogc:def:crs:OGC:1.3:CRS84";
    let file = "\"a.geojson\"";
    let named = |name: &str| format!("{{ file = \"a.geojson\", name = \"{name}\" }}");
    for (value, text, what, hint) in [
        (
            file,
            &both,
            "there are 2 polygons: `west`, `east`; one is needed",
            "it = { file = \"a.geojson\", name = \"west\" }",
        ),
        (
            file,
            &collection("", &bare),
            "there are 2 polygons; one is needed",
            "give each feature an attribute `name`",
        ),
        (file, &holes, "the polygon has holes", "draw it without"),
        (file, &line, "a polygon is needed, and there is `LineString`", ""),
        (
            file,
            &collection(degrees, std::slice::from_ref(&west)),
            "it is in degrees of longitude and latitude (urn:",
            "system of the terrain",
        ),
        (file, &"PK\u{3}\u{4}".to_owned(), "this is no GeoJSON", "Export"),
        (file, &"{\"type\": \"Polygon\"}".to_owned(), "this is no GeoJSON", "Export"),
        (
            &named("wset"),
            &both,
            "no feature is named `wset`: there are `west`, `east`",
            "did you mean `west`?",
        ),
        (&named("a"), &collection("", &bare), "none of its 2 features has an attribute `name`", ""),
        (
            "\"b.geojson\"",
            &west,
            "b.geojson: there is no such file",
            "did you mean a.geojson, which lies there?",
        ),
        (file, &two_parts, "the feature has 2 parts; a polygon is needed", "Multipart to Singleparts"),
        (file, &collection("", &[]), "a polygon is needed, and the file has no feature", ""),
        (file, &null, "and there is `a feature without geometry`", ""),
        (&named("a"), &null, "has an attribute `name`; attributes are `fid`", ""),
        ("[[1, 2], [3]]", &west, "1", "2"),
        ("{ file = \"a.geojson\", nam = \"x\" }", &west, "nam", "name"),
        ("4", &west, "points [[x, y], ...], or the name of a GeoJSON file", ""),
    ] {
        let refused = read(value, Form::Polygon, text).expect_err(value);
        assert!(
            refused.contains("s.toml:2:") && refused.contains(what) && refused.contains(hint),
            "{refused}"
        );
    }
}
