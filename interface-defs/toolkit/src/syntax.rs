//! Text that is no TOML: what a user is likely to have done.

use interface_defs::diagnostic::{Diagnostic, Place, code};
use std::path::Path;

/// The text of the scene file `path`: UTF-8, with or without a byte order mark.
pub(crate) fn decode(path: &Path, bytes: Vec<u8>) -> Result<String, Diagnostic> {
    let name = path.display().to_string();
    let refuse = |what: &str| Diagnostic::in_file(name.as_str(), what).coded(code::SYNTAX);
    let save = "save the scene as plain text in UTF-8";
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(refuse("this is text in UTF-16, and a scene is in UTF-8")
            .try_instead(format!("{save}, as in PowerShell: Out-File -Encoding utf8")));
    }
    if bytes.contains(&0) {
        return Err(refuse("this is no text: it holds bytes of 0")
            .try_instead("a scene is a text file in TOML, like those in launch/scenes"));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let byte = e.as_bytes()[at];
        let text = String::from_utf8_lossy(e.as_bytes());
        let what = format!("byte {at}, 0x{byte:02x}, is not UTF-8 text");
        let place = Place::in_text(&name, &text, at..at + 1);
        Diagnostic::error(code::SYNTAX, what)
            .at(place)
            .try_instead(format!("{save}; a letter with an accent in another encoding?"))
    })?;
    if let Some(at) = lone_return(&text) {
        let line = 1 + text[..at].matches('\r').count();
        return Err(refuse(&format!("line {line} ends with a carriage return alone"))
            .try_instead("save the scene with line ends of Unix (LF) or Windows (CR LF)"));
    }
    Ok(text)
}

/// Where a carriage return stands that no line feed follows.
fn lone_return(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    (0..bytes.len()).find(|at| bytes[*at] == b'\r' && bytes.get(at + 1) != Some(&b'\n'))
}

/// What to try where the file `path` with `text` is no TOML from byte `at` on.
pub(crate) fn hint(path: &Path, text: &str, at: usize) -> Option<String> {
    if let Some(kind) = other_kind(path, text) {
        return Some(kind);
    }
    let start = text[..text.floor_char_boundary(at)].rfind('\n').map_or(0, |end| end + 1);
    let line = text[start..].lines().next()?;
    let code = line.split('#').next().unwrap_or(line);
    for (marks, cure) in [
        ("\u{2212}\u{2013}\u{2014}", "a minus is written as the hyphen -"),
        ("\u{201c}\u{201d}\u{201e}\u{2018}\u{2019}\u{ab}\u{bb}", "quotes are straight: \""),
    ] {
        if let Some(c) = code.chars().find(|c| marks.contains(*c)) {
            return Some(format!("{cure}; here is `{c}`, as word processors put it"));
        }
    }
    if code.chars().any(|c| !c.is_ascii() && c.is_whitespace()) {
        return Some("there is a special space in this line, as web pages have them: write it again".into());
    }
    if code.contains('\\') {
        return Some(
            "a backslash in \"...\" begins an escape: write paths with /, which works everywhere".into(),
        );
    }
    let Some((key, value)) = code.split_once('=') else { return no_equals(code) };
    let value = value.trim();
    if let Some(value) = value.strip_prefix('=') {
        return Some(format!("one = alone: {} = {}", key.trim(), value.trim()));
    }
    // A list of another language, or numbers with nothing between them.
    let listed =
        value.trim_matches(['(', ')', '[', ']']).split([';', ',', ' ']).filter(|word| !word.is_empty());
    let listed: Vec<&str> = listed.collect();
    if value.starts_with(['(', '['])
        && listed.len() > 1
        && listed.iter().all(|word| word.parse::<f64>().is_ok())
    {
        return Some(format!(
            "a list stands in brackets, with commas between its values: [{}]",
            listed.join(", ")
        ));
    }
    if let Some((before, after)) = value.split_once(',')
        && let (Ok(_), Ok(_)) = (before.trim().parse::<i64>(), after.trim().parse::<u64>())
    {
        let number = format!("{}.{}", before.trim(), after.trim());
        return Some(format!("a decimal comma? a number is written with a point: {number}"));
    }
    if let Some(before) = value.strip_suffix(';') {
        return Some(format!("a line ends without a semicolon: {}", before.trim_end()));
    }
    if let Some(hint) = of_other_language(value) {
        return Some(hint.into());
    }
    if value.strip_suffix('.').is_some_and(|whole| whole.parse::<i64>().is_ok()) {
        return Some(format!("digits stand behind the point, too: {value}0"));
    }
    let unit = |(_, unit): &(&str, &str)| unit.trim_start().starts_with(char::is_alphabetic);
    let number = value.split_once(' ').filter(unit).map_or(value, |(number, _)| number);
    let digits = number
        .trim_end_matches(|c: char| c.is_alphabetic() || "/%*\u{b0}\u{b2}\u{b3}".contains(c))
        .trim_end();
    if digits != value && digits.parse::<f64>().is_ok() {
        return Some(format!(
            "a number is written without its unit: {digits}, if that is in m, kg, s, N, Pa"
        ));
    }
    None
}

/// What to try where a line has no `=`.
fn no_equals(code: &str) -> Option<String> {
    let (key, value) = code.trim().split_once([':', ' '])?;
    let value = value.trim_start_matches([':', ' ']);
    let is_key = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c));
    (is_key && !value.trim().is_empty()).then(|| format!("a key and its value: {key} = {}", value.trim()))
}

/// What to try where a value is written as in another language.
fn of_other_language(value: &str) -> Option<&'static str> {
    let digit = |c: char| c.is_ascii_digit();
    let between = |marks: &str| {
        let chars: Vec<char> = value.chars().collect();
        chars.windows(3).any(|w| digit(w[0]) && marks.contains(w[1]) && (digit(w[2]) || w[2] == '-'))
    };
    if value.contains("//") {
        Some("a comment begins with #")
    } else if matches!(value, "True" | "TRUE" | "False" | "FALSE" | "yes" | "no" | "on" | "off")
        || value.contains(" = True")
        || value.contains(" = False")
    {
        Some("there are two, in small letters: true, false")
    } else if between("'") {
        Some("a number has no separators: 2600.0")
    } else if between("*/^") && !value.contains('"') {
        Some("nothing is computed here: write the number, as in 2e-4")
    } else {
        None
    }
}

/// What a file is that is no scene at all.
fn other_kind(path: &Path, text: &str) -> Option<String> {
    let first = text.trim_start_matches('\u{feff}').lines().find(|line| !line.trim().is_empty())?.trim();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let toml = "a scene is a text file in TOML, like those in launch/scenes";
    if first.starts_with('{') {
        return Some(format!("this looks like JSON; {toml}"));
    }
    if extension != "toml" && first.starts_with("ncols") {
        return Some(format!(
            "this looks like a grid of terrain, which a scene names: [terrain] file = \"...\"; {toml}"
        ));
    }
    if extension != "toml" && (first.starts_with("$MeshFormat") || first.starts_with('*')) {
        return Some(format!(
            "this looks like a mesh, which a scene names: [structure] mesh = \"...\"; {toml}"
        ));
    }
    (!first.starts_with('#') && !first.contains('=') && !first.starts_with('[')).then(|| {
        let table = if first.contains([',', ';']) { "this looks like a table (CSV); " } else { "" };
        format!("{table}{toml}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn text_that_is_no_toml_is_named_with_place_and_cure() {
        for (text, place, cure) in [
            ("end_time = 1,5\n", "s.toml:1:13", "a decimal comma? a number is written with a point: 1.5"),
            ("end_time = 1.5 s\n", "s.toml:1:12", "without its unit: 1.5"),
            ("angle = 31\u{b0}\n", "s.toml:1:9", "without its unit: 31"),
            ("end_time = 5.0 kg/m3\n", "s.toml:1:12", "without its unit: 5.0"),
            ("end_time == 5.0\n", "s.toml:1:11", "one = alone: end_time = 5.0"),
            ("title = \"a\"\nend_time : 5.0\n", "s.toml:2:10", "a key and its value: end_time = 5.0"),
            ("end_time = 5.\n", "s.toml:1:14", "digits stand behind the point, too: 5.0"),
            ("output.iterations = yes\n", "s.toml:1:21", "true, false"),
            (
                "gravity = (0.0, 0.0, -9.81)\n",
                "s.toml:1:15",
                "with commas between its values: [0.0, 0.0, -9.81]",
            ),
            (
                "gravity = [0.0; 0.0; -9.81]\n",
                "s.toml:1:12",
                "with commas between its values: [0.0, 0.0, -9.81]",
            ),
            (
                "gravity = [0.0 0.0 -9.81]\n",
                "s.toml:1:12",
                "with commas between its values: [0.0, 0.0, -9.81]",
            ),
            ("end_time = 5.0;\n", "s.toml:1:15", "a line ends without a semicolon: 5.0"),
            ("gravity = [0, 0, \u{2212}9.81]\n", "s.toml:1:18", "a minus is written as the hyphen -"),
            ("title = \u{201c}a\u{201d}\n", "s.toml:1:9", "quotes are straight"),
            ("end_time\u{a0}= 1.0\n", "s.toml:1:9", "a special space"),
            ("title = \"data\\slope.asc\"\n", "s.toml:1:15", "write paths with /"),
            ("end_time = 1.5 // s\n", "s.toml:1:12", "a comment begins with #"),
            ("title = \"a\"\nend_time: 1.5\n", "s.toml:2:11", "end_time = 1.5"),
            ("title = \"a\"\nend_time 1.5\n", "s.toml:2:10", "end_time = 1.5"),
            ("end_time = 2*10^3\n", "s.toml:1:12", "write the number"),
            ("end_time = 3/2\n", "s.toml:1:12", "write the number"),
            ("end_time = 2'600.0\n", "s.toml:1:13", "no separators"),
            ("output.iterations = True\n", "s.toml:1:21", "small letters"),
            ("{\"end_time\": 1}\n", "s.toml:1:1", "looks like JSON"),
            ("time_s,rock_x_m\n0,1\n", "s.toml:1:7", "looks like a table (CSV)"),
        ] {
            let message = Scene::from_text("s.toml", text).map(|_| ()).expect_err(text).to_string();
            assert!(message.starts_with(place) && message.contains(cure), "{message}");
        }
        let message =
            Scene::from_text("t.asc", "ncols 3\nnrows 2\n").map(|_| ()).expect_err("a grid").to_string();
        assert!(message.contains("[terrain] file"), "{message}");
        let message = Scene::from_text("n.msh", "$MeshFormat\n").map(|_| ()).expect_err("a mesh").to_string();
        assert!(message.contains("[structure] mesh"), "{message}");
    }

    #[test]
    fn brackets_and_the_place_of_a_key_are_named_and_intervals_that_fill_a_disk() {
        use crate::output::Output;
        let of = |text: &str| Scene::from_text("s.toml", text).and_then(|s| Output::of(&s)).map(|_| ());
        let message = of("[output]\nend_time = 1.0\n").expect_err("a key of the scene").to_string();
        assert!(
            message.starts_with("s.toml:2:1") && message.contains("before the first [table]"),
            "{message}"
        );
        let rock = Scene::from_text("s.toml", "[rock]\nmass = 1.0\n").expect("a scene");
        let message = rock.read::<Vec<toml::Table>>("rock").expect_err("one").to_string();
        assert!(message.starts_with("s.toml:1:1") && message.contains("[[rock]]"), "{message}");
        // 2 s in pieces of 1e-9 s.
        let message = of("end_time = 2.0\noutput.fields = 1e-9\n").expect_err("many").to_string();
        assert!(
            message.contains("s.toml:2:17") && message.contains("2.0e9 sets of field files"),
            "{message}"
        );
        assert!(message.contains("fields = 0.01"), "{message}");
        assert_eq!(of("end_time = 2.0\noutput.interval = 1e-7\noutput.fields = 1e-4\n"), Ok(()));
        assert!(of("end_time = 2.0\noutput.interval = 1e-9\n").is_err());
    }

    #[test]
    fn bytes_that_are_no_plain_text_are_named_and_usual_text_files_are_read() {
        let of = |bytes: &[u8]| decode(Path::new("s.toml"), bytes.to_vec()).map_err(|e| e.to_string());
        let text = "# W\u{fc}rfel\nend_time = 1.0\n";
        for bytes in
            [text.into(), text.replace('\n', "\r\n"), format!("\u{feff}{text}"), text.replace(" = ", "\t=\t")]
        {
            let read = of(bytes.as_bytes()).expect("text");
            assert_eq!(Scene::from_text("s.toml", &read).and_then(|s| s.end_time()), Ok(1.0), "{bytes:?}");
        }
        let utf16: Vec<u8> =
            [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        let message = of(&utf16).expect_err("UTF-16");
        assert!(message.contains("UTF-16") && message.contains("save the scene"), "{message}");
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let message = of(&latin).expect_err("Latin-1");
        assert!(message.starts_with("s.toml:1:4: byte 3, 0xfc") && message.contains("UTF-8"), "{message}");
        assert!(of(&[0, 1, 2, 255]).expect_err("binary").contains("this is no text"));
        let message = of(text.replace('\n', "\r").as_bytes()).expect_err("CR alone");
        assert!(message.contains("line 1 ends with a carriage return alone"), "{message}");
    }
}
