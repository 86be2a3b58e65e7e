use super::*;
use crate::tagged;
use serde::{Deserialize, Serialize};

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rock {
    mass: f64,
    cluster: Option<Cluster>,
    law: Option<Law>,
    velocity: Option<[f64; 3]>,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Cluster {
    spheres: usize,
}

tagged! {
    #[derive(Debug, PartialEq, Serialize)]
    enum Law by "type" (rename_all = "snake_case", deny_unknown_fields) {
        Hertz { restitution: f64 },
        Linear { stiffness: f64 },
    }
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Scheme {
    Weak,
    Strong,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Coupling {
    scheme: Scheme,
}

fn scene(text: &str, sets: &[&str]) -> Result<Scene, Diagnostic> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    Scene::new(&SCENE, "s.toml".into(), text.into(), &sets)
}

fn rocks(text: &str, sets: &[&str]) -> Result<Vec<Rock>, String> {
    let scene = scene(text, sets).map_err(|e| e.to_string())?;
    scene.read("rock").map(Option::unwrap_or_default).map_err(|e| e.to_string())
}

/// Text of the error, with its first line checked.
fn refused(text: &str, sets: &[&str], first_line: &str) -> String {
    let error = rocks(text, sets).expect_err("it must be refused");
    assert_eq!(error.lines().next(), Some(first_line), "{error}");
    error
}

#[test]
fn an_unknown_key_is_shown_in_its_line_with_the_nearest_name() {
    let error = refused("end_time = 1\n[[rock]]\n  mas = 3\n", &[], "s.toml:3:3: unknown key `mas`");
    let rest = "\n   |\n 3 |   mas = 3\n   |   ^^^\n   = did you mean `mass`? known here: \
                `mass`, `cluster`, `law`, `velocity`";
    assert!(error.ends_with(rest), "{error}");
    refused("[[rock]]\nmass = 1\n[rock.cluster]\nsphere = 3\n", &[], "s.toml:4:1: unknown key `sphere`");
    refused("[[rock]]\nmass = 1\ncluster = { sphere = 3 }", &[], "s.toml:3:13: unknown key `sphere`");
    refused("[[rock]]\nmass = 1\n[[rock]]\nmass = 1\ncolour = 3", &[], "s.toml:5:1: unknown key `colour`");
}

#[test]
fn an_unknown_key_at_the_top_is_refused_and_custom_is_not_looked_into() {
    let error = refused("[structur]\n", &[], "s.toml:1:2: unknown key `structur` at the top of the scene");
    assert!(error.contains("did you mean `structure`?"), "{error}");
    refused("endtime = 1", &[], "s.toml:1:1: unknown key `endtime` at the top of the scene");
    assert!(rocks("[custom]\nanything = { goes = nan }", &[]).is_ok());
}

#[test]
fn an_unknown_name_is_shown_with_the_nearest() {
    let scene = scene("# a comment\n[coupling]\nscheme = \"week\"\n", &[]).expect("TOML");
    let error = scene.read::<Coupling>("coupling").expect_err("no such scheme").to_string();
    assert!(error.starts_with("s.toml:3:10: unknown value `week`\n"), "{error}");
    assert!(error.ends_with("did you mean `weak`? known here: `weak`, `strong`"), "{error}");
}

#[test]
fn inside_a_tagged_table_the_position_is_that_of_the_key_or_value_itself() {
    let law = |inside: &str| format!("[[rock]]\nmass = 1\nlaw = {{ {inside} }}\n");
    refused(&law("type = \"herz\""), &[], "s.toml:3:16: unknown value `herz`");
    refused(&law("type = \"hertz\", restitutoin = 1"), &[], "s.toml:3:25: unknown key `restitutoin`");
    refused(
        &law("type = \"hertz\", restitution = \"x\""),
        &[],
        "s.toml:3:39: wrong type: string \"x\", expected a number",
    );
    refused(&law("type = \"linear\""), &[], "s.toml:3:7: the key `stiffness` is missing here");
}

#[test]
fn a_wrong_type_and_a_missing_key_are_shown_at_their_place() {
    refused(
        "title = \"ä\"\n[[rock]]\nmass = \"heavy\"",
        &[],
        "s.toml:3:8: wrong type: string \"heavy\", expected a number",
    );
    refused("[rock]\nmass = 1", &[], "s.toml:1:1: wrong type: map, expected an array");
    refused("[[rock]]\nvelocity = [1, 2]\nmass = 1", &[], "s.toml:2:12: 2 values where 3 are needed");
    refused(
        "[[rock]]\nmass = 1\ncluster.spheres = -5",
        &[],
        "s.toml:3:19: wrong value: integer `-5`, expected a whole number, not negative",
    );
    refused("[[rock]]\n", &[], "s.toml:1:1: the key `mass` is missing here");
}

#[test]
fn a_decimal_comma_makes_one_number_too_many_and_is_named() {
    let text = "[[rock]]\nmass = 1\nvelocity = [0, 0, -9,81]\n";
    let error = refused(text, &[], "s.toml:3:12: 4 values where 3 are needed");
    assert!(error.ends_with("a decimal comma? a number is written with a point: -9.81"), "{error}");
    let error = refused(
        "[[rock]]\nmass = 1\n",
        &["rock.0.velocity=[1,5, 2.5, 3.5]"],
        "--set rock.0.velocity=[1,5, 2.5, 3.5]: 4 values where 3 are needed",
    );
    assert!(error.ends_with("with a point: 1.5"), "{error}");
    // Nothing there that a comma could have cut.
    let error = refused(
        "[[rock]]\nvelocity = [0.5, 0.5, 1.5, 2.5]\nmass = 1",
        &[],
        "s.toml:2:12: 4 values where 3 are needed",
    );
    assert!(!error.contains("comma"), "{error}");
    let error =
        refused("[[rock]]\nvelocity = [0, 5]\nmass = 1", &[], "s.toml:2:12: 2 values where 3 are needed");
    assert!(!error.contains("comma"), "{error}");
    // In a tagged table.
    let scene =
        scene("gravity = [0, 0, -9,81]\n[coupling]\nlaw = { type = \"box\", size = [0,4, 0,5, 1] }\n", &[])
            .expect("TOML");
    let error = scene.gravity().expect_err("four numbers").to_string();
    assert!(error.starts_with("s.toml:1:11: 4 values where 3 are needed"), "{error}");
    #[derive(Debug, Deserialize)]
    struct Coupling {
        #[allow(dead_code)]
        law: Shape,
    }
    tagged! {
        #[derive(Debug, Serialize)]
        enum Shape by "type" (rename_all = "snake_case") {
            Box { size: [f64; 3] },
        }
    }
    let error = scene.read::<Coupling>("coupling").expect_err("five numbers").to_string();
    assert!(error.starts_with("s.toml:3:30: 5 values where 3 are needed"), "{error}");
}

#[test]
fn numbers_that_are_not_finite_and_text_that_is_no_toml_are_refused() {
    refused("[[rock]]\nmass = nan", &[], "s.toml:2:8: `nan` is not a finite number");
    refused("[[rock]]\nvelocity = [0, -inf, 0]", &[], "s.toml:2:16: `-inf` is not a finite number");
    refused("[[rock]]\nmass = 1e999", &[], "s.toml:2:8: `1e999` is not a finite number");
    refused(
        "[[rock]]\nmass = 1",
        &["rock.0.mass=inf"],
        "--set rock.0.mass=inf: `inf` is not a finite number",
    );
    let error = rocks("[[rock]\nmass = 1", &[]).expect_err("no TOML");
    assert!(error.starts_with("s.toml:1:"), "{error}");
    let error = rocks("title = \"a\"\ntitle = \"b\"", &[]).expect_err("no TOML");
    assert!(error.starts_with("s.toml:2:1: duplicate key"), "{error}");
}

#[test]
fn a_fingerprint_is_of_text_and_sets() {
    let of = |text: &str, sets: &[&str]| scene(text, sets).expect("TOML").fingerprint();
    // FNV-1a of no byte is its offset basis.
    assert_eq!(of("", &[]), "fnv1a64:cbf29ce484222325");
    assert_eq!(of("title = \"a\"", &["end_time=1"]), of("title = \"a\"", &["end_time=1"]));
    let others = [of("", &["end_time=1"]), of("end_time=1", &[]), of("", &["end_time=1", "title=a"])];
    assert!(others.iter().all(|one| others.iter().filter(|other| *other == one).count() == 1));
}

#[test]
fn a_missing_file_is_named() {
    let error = Scene::load(Path::new("no/such.toml"), &[]).expect_err("it is not there").to_string();
    assert!(error.starts_with("no/such.toml: there is no such file"), "{error}");
}

#[test]
fn a_set_replaces_adds_and_makes_tables_on_the_way() {
    let text = "[[rock]]\nmass = 1\n[[rock]]\nmass = 2\nvelocity = [1, 2, 3]\n";
    let sets = ["rock.1.mass = 1e2", "rock.0.cluster.spheres=512", "rock.1.velocity.2=-9.5", "title=a b"];
    let scene = scene(text, &sets).expect("applied");
    let read: Vec<Rock> = scene.read("rock").expect("valid").expect("there");
    assert_eq!(read[0].cluster, Some(Cluster { spheres: 512 }));
    assert_eq!((read[1].mass, read[1].velocity), (100.0, Some([1.0, 2.0, -9.5])));
    assert_eq!(scene.read::<String>("title").expect("text"), Some("a b".into()));
    assert_eq!(scene.text(), text);
    assert_eq!(scene.document().expect("a table")["rock"][1]["mass"].as_float(), Some(100.0));
}

#[test]
fn a_fault_in_a_set_is_shown_in_the_set() {
    let text = "[[rock]]\nmass = 1\n";
    let error = refused(
        text,
        &["rock.0.mass=heavy"],
        "--set rock.0.mass=heavy: wrong type: string \"heavy\", expected a number",
    );
    assert!(error.ends_with("   | rock.0.mass=heavy\n   |             ^^^^^"), "{error}");
    let comma = "--set rock.0.mass=1,2: wrong type: string \"1,2\", expected a number";
    let error = refused(text, &["rock.0.mass=1,2"], comma);
    assert!(error.ends_with("a decimal comma? a number is written with a point: 1.2"), "{error}");
    let error = refused(text, &["title=x", "rock.0.mas=2"], "--set rock.0.mas=2: unknown key `mas`");
    assert!(error.contains("\n   | rock.0.mas=2\n   |        ^^^\n   = did you mean `mass`?"), "{error}");
    refused(text, &["rok.0.mass=2"], "--set rok.0.mass=2: unknown key `rok` at the top of the scene");
    refused("[[rock]]\nmas = 1\n", &["rock.0.velocity=[0, 0, 1]"], "s.toml:2:1: unknown key `mas`");
}

#[test]
fn a_set_that_cannot_be_applied_is_refused_by_name() {
    let text = "[[rock]]\nmass = 1\n";
    refused(text, &["rock.mass"], "--set rock.mass: there is no `=`");
    refused(text, &["=3"], "--set =3: this is no path of keys");
    refused(text, &["a..b=3"], "--set a..b=3: this is no path of keys");
    refused(
        text,
        &["rock.1.mass=2"],
        "--set rock.1.mass=2: `1` is no item of `rock`, which holds one item; its number is 0",
    );
    refused(
        text,
        &["rock.mass=2"],
        "--set rock.mass=2: `mass` is no item of `rock`, which holds one item; its number is 0",
    );
    refused(
        text,
        &["rock.0.mass.kg=2"],
        "--set rock.0.mass.kg=2: `rock.0.mass` is a value (integer), it holds no keys",
    );
}

#[test]
fn a_semantic_fault_is_located_at_its_key_or_at_the_nearest_table() {
    let scene = scene("[dem]\n\n[[rock]]\nmass = -1\n", &["dem.time_step=-1"]).expect("TOML");
    let first = |key: &str| scene.invalid(key, "no").to_string().lines().next().expect("a line").to_owned();
    assert_eq!(first("rock.0.mass"), "s.toml:4:8: no");
    assert_eq!(first("rock.0.density"), "s.toml:3:1: no");
    assert_eq!(first("rock.7.mass"), "s.toml:3:1: no");
    assert_eq!(first("dem.time_step"), "--set dem.time_step=-1: no");
    assert_eq!(first("fem.time_step"), "s.toml: no");
}

#[test]
fn end_time_is_due_and_gravity_may_be_absent() {
    let of = |text: &str| scene(text, &[]).expect("TOML").end_time().map_err(|e| e.to_string());
    assert_eq!(of("end_time = 2"), Ok(2.0));
    assert!(of("end_time = 0.0").expect_err("none").starts_with("s.toml:1:12: the end time is 0 s"));
    assert!(of("").expect_err("missing").starts_with("s.toml: the key `end_time` is missing; write"));
    assert_eq!(scene("", &[]).expect("TOML").gravity(), Ok([0.0; 3]));
    assert_eq!(scene("gravity = [0, 0, -9.81]", &[]).expect("TOML").gravity(), Ok([0.0, 0.0, -9.81]));
}

#[test]
fn paths_count_from_the_scene_file() {
    let scene = Scene::from_text("scenes/drop.toml", "").expect("TOML");
    assert_eq!(scene.resolve(Path::new("../net.msh")), Path::new("scenes/../net.msh"));
    assert_eq!(scene.resolve(Path::new("/abs/net.msh")), Path::new("/abs/net.msh"));
}

/// What a program adds to a document is in none of its lines: the file that it follows from is named.
#[test]
fn what_is_wrong_in_added_text_is_said_of_the_file_that_it_follows_from() {
    let sets = ["gravity=[0, 0, -1]".to_owned()];
    let scene = Scene::new(&SCENE, "s.toml".into(), "end_time = 1.0\n".into(), &sets).expect("valid");
    let scene = scene.with_more("\n[[contact]]\nlaw = \"linear\"\n", Path::new("b.toml")).expect("valid");
    assert_eq!(scene.invalid("contact.0.law", "no").headline(), "b.toml: no");
    assert_eq!(scene.invalid("end_time", "no").headline(), "s.toml:1:12: no");
    assert!(scene.invalid("gravity", "no").headline().starts_with("--set gravity=[0, 0, -1]"));
}

/// Keys and codes are what programs decide by.
#[test]
fn an_error_has_its_key_and_code() {
    let of = |text: &str| {
        let read = scene(text, &[]).and_then(|scene| scene.read::<Vec<Rock>>("rock"));
        let error = read.expect_err(text);
        (error.key.unwrap_or_default(), error.code)
    };
    let at = |key: &str, code| (key.to_owned(), code);
    assert_eq!(
        of("[[rock]]\nmass = 1\ncluster.spheres = \"9\""),
        at("rock.0.cluster.spheres", code::WRONG_TYPE)
    );
    assert_eq!(of("[[rock]]\nmass = 1\n[[rock]]"), at("rock.1.mass", code::MISSING_KEY));
    assert_eq!(of("[[rock]]\nmas = 1"), at("rock.0.mas", code::UNKNOWN_KEY));
    assert_eq!(of("[[rock]]\nvelocity = [1]"), at("rock.0.velocity", code::WRONG_LENGTH));
    assert_eq!(of("[[rock]]\nlaw.type = \"herz\""), at("rock.0.law.type", code::UNKNOWN_NAME));
    assert_eq!(of("[[rock]]\nmass = inf").1, code::NOT_FINITE);
    assert_eq!(of("[[rock]]\nmass = ").1, code::SYNTAX);
    assert_eq!(of("rok = 1"), at("rok", code::UNKNOWN_KEY));
}

#[test]
fn a_document_in_place_of_the_text_is_read_as_exactly_and_errors_point_to_the_text() {
    let scene = scene("custom.day = 2020-01-02\n[[rock]]\nmass = 1\n", &["rock.0.mass=3.5"]).expect("TOML");
    let document = scene.document().expect("a table");
    assert!(document["custom"]["day"].is_datetime());
    assert_eq!(scene.patched(document.clone()).document(), Ok(document.clone()));
    let with = |mass: toml::Value| {
        let mut document = document.clone();
        document["rock"][0]["mass"] = mass;
        let patched = scene.patched(document);
        patched.read::<Vec<Rock>>("rock").map(|rocks| rocks.map(|rocks| rocks[0].mass))
    };
    let odd = 0.1 + 0.2;
    assert_eq!(with(odd.into()), Ok(Some(odd)));
    let error = with("heavy".into()).expect_err("a text");
    assert_eq!((error.key.as_deref(), error.code.clone()), (Some("rock.0.mass"), code::WRONG_TYPE));
    let line = error.headline();
    assert_eq!(line, "--set rock.0.mass=3.5: wrong type: string \"heavy\", expected a number");
    let error = scene.read_value::<[f64; 2]>("rock.0", &vec![1.0].into()).expect_err("one number");
    assert_eq!(
        (error.headline().as_str(), error.code),
        ("s.toml:2:1: 1 values where 2 are needed", code::WRONG_LENGTH)
    );
}
