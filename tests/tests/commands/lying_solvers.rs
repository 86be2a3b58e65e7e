//! Solvers that break the contract: each ends the run with its own message, and loses no row.

use tests::{Bench, Ended, example, scene, word};

fn run_with(lie: &str, settings: &[&str]) -> Ended {
    let bench = Bench::new();
    let scene = bench.scene(&format!(
        "end_time = 0.1\n[coupling]\nscheme = \"strong\"\ntime_window = 1e-3\n[processes]\ntimeout = 2\n\
         dem = \"{}\"\nfem = \"{} {lie}\"\n",
        word(example("weight")),
        word(example("liar"))
    ));
    let ended = bench.run(&scene, "out", settings);
    Ended { out: "gone".into(), ..ended_with_rows(ended) }
}

/// The rows are counted before the bench's directory goes.
fn ended_with_rows(ended: Ended) -> Ended {
    let rows = ended.rows();
    Ended { stdout: format!("{}\nrows {rows}", ended.stdout), ..ended }
}

fn refused(lie: &str, code: i32, words: &[&str]) {
    let ended = run_with(lie, &[]);
    assert_eq!(ended.code, Some(code), "{lie}: {}", ended.stderr);
    for word in words {
        assert!(ended.stderr.contains(word), "{lie}: \"{word}\" is not in: {}", ended.stderr);
    }
}

fn refused_after_three_rows(lie: &str, words: &[&str]) {
    let ended = run_with(lie, &[]);
    assert_eq!(ended.code, Some(1), "{lie}: {}", ended.stderr);
    for word in words {
        assert!(ended.stderr.contains(word), "{lie}: \"{word}\" is not in: {}", ended.stderr);
    }
    assert!(ended.stdout.contains("rows 3"), "{lie}: {}", ended.stdout);
}

#[test]
fn who_does_not_lie_comes_through() {
    let ended = run_with("none", &[]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(ended.stdout.contains("rows 100"), "{}", ended.stdout);
}

#[test]
fn an_answer_to_another_request_is_named_with_both_numbers() {
    refused_after_three_rows("window", &["fem", "window 5", "asked was window 4"]);
    refused_after_three_rows("sequence", &["fem", "answered sequence", "asked was sequence"]);
    refused_after_three_rows("iteration", &["answered iteration 2, asked was iteration 1"]);
    refused_after_three_rows("run", &["answered run", "asked was run"]);
    refused_after_three_rows("length", &["a window with length 0.002 s, asked was length 0.001 s"]);
    refused_after_three_rows("status", &["status 7 has no meaning"]);
}

#[test]
fn an_answer_of_the_wrong_length_is_named_with_both_numbers() {
    refused_after_three_rows("short", &["its answer has 4 numbers", "make 9"]);
}

#[test]
fn a_number_that_is_not_finite_is_named_with_field_node_and_window() {
    refused_after_three_rows("nan", &["fem", "window 4", "\"velocity\" at item 0, component 1 is NaN"]);
    refused_after_three_rows("infinite-gauge", &["fem", "gauge \"truth\" is inf"]);
}

#[test]
fn another_protocol_and_garbage_are_told_apart() {
    refused("protocol", 1, &["fem", "speaks protocol 0, this program speaks protocol 3"]);
    refused(
        "garbage",
        1,
        &["fem", "cannot be read", "it is a Hello, whose field \"", "does not fit from byte"],
    );
}

#[test]
#[ignore = "long"]
fn who_does_not_answer_is_named_at_the_deadline() {
    refused_after_three_rows(
        "silent",
        &["no answer from fem in window 4", "of 2.0 s", "its process is alive"],
    );
    refused("mute", 1, &["no answer from fem at the start of the run", "of 2.0 s"]);
}

#[test]
fn what_a_solver_cannot_do_is_refused_before_the_start() {
    refused("unrepeatable", 2, &["strong coupling repeats windows", "fem", "cannot repeat one"]);
    refused("small-window", 2, &["coupling.time_window is 0.001 s", "up to 0.000000001 s"]);
    refused("rough", 2, &["coupling.tolerance is 1e-4, fem (liar (rough)) repeats a window to 1e-2 only"]);
    refused("rougher", 1, &["fem breaks the interface contract", "repeats a window to 2;"]);
    refused("two-meshes", 1, &["fem breaks the interface contract", "it offers 2 interface meshes"]);
    for looser in ["coupling.tolerance=1e-2", "coupling.scheme=weak"] {
        let ended = run_with("rough", &["--set", looser]);
        assert_eq!(ended.code, Some(0), "{looser}: {}", ended.stderr);
    }
    let weak = run_with("unrepeatable", &["--set", "coupling.scheme=weak"]);
    assert_eq!(weak.code, Some(0), "{}", weak.stderr);
}

/// Soft contact of a cluster jumps where a wire goes from one sphere to the next: that is no breach of the contract.
#[test]
fn a_contact_that_jumps_is_not_accused() {
    let bench = Bench::new();
    let ended = bench.run(&scene("walenstadt-compare"), "out", &["--set", "contact.0.young=3125000.0"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
}
