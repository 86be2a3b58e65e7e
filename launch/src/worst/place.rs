//! Where in the user's file that stands which is wrong in the scene of a member: most of that scene is the barrier's own.

use interface_defs::toolkit::scene::Scene;
use toml::Value;

/// What a member's scene has from the study, or from both.
const OF_STUDY: [&str; 6] = ["rock", "terrain", "gravity", "contact", "end_time", "title"];

/// The scene of a member that was made to be checked.
pub struct Generated<'a> {
    /// Its file, as messages name it.
    pub file: String,
    /// Its text.
    pub text: String,
    /// The barrier that it was made with.
    pub barrier: &'a Scene,
}

impl Generated<'_> {
    /// What the user knows it as.
    fn name(&self) -> String {
        format!("the scene of member 1 against {}", self.barrier.path().display())
    }

    /// A message about it, one or several, as one about the barrier's file where the key is from there.
    pub fn error(&self, message: &str) -> String {
        let all = message
            .split("\nerror: ")
            .map(|one| self.of_barrier(one).unwrap_or_else(|| one.replace(&self.file, &self.name())));
        all.collect::<Vec<_>>().join("\nerror: ")
    }

    /// A warning that begins with its key, likewise.
    pub fn warning(&self, warning: &str) -> String {
        match warning.split_once(": ") {
            Some((key, _)) if self.is_of_barrier(key) => self.barrier.placed(warning),
            _ => warning.replace(&self.file, &self.name()),
        }
    }

    fn of_barrier(&self, message: &str) -> Option<String> {
        let (number, rest) = message.strip_prefix(&self.file)?.strip_prefix(':')?.split_once(':')?;
        let what = rest.split_once(": ")?.1;
        let key = key_of(&self.text, number.parse().ok()?)?;
        if !self.is_of_barrier(&key) {
            return None;
        }
        let mut error = self.barrier.invalid(&key, what.lines().next()?);
        if let Some(hint) = hint(what) {
            error = error.try_instead(hint);
        }
        Some(error.to_string())
    }

    fn is_of_barrier(&self, key: &str) -> bool {
        let first = key.split('.').next().unwrap_or_default();
        !OF_STUDY.contains(&first)
            && self.barrier.document().is_ok_and(|table| has(&Value::Table(table), key))
    }
}

/// What is to be tried, behind the quoted line.
fn hint(message: &str) -> Option<&str> {
    let mut start = 0;
    for line in message.split_inclusive('\n') {
        if let Some(rest) = line.trim_start().strip_prefix("= ") {
            return Some(message[start + line.len() - rest.len()..].trim_end());
        }
        start += line.len();
    }
    None
}

fn has(value: &Value, key: &str) -> bool {
    let found = key.split('.').try_fold(value, |value, part| match part.parse::<usize>() {
        Ok(at) => value.get(at),
        Err(_) => value.get(part),
    });
    found.is_some()
}

/// The key of a line (from 1) of a text that a program has written: `[table]` and `[[array]]` above it and `key = ` in it.
fn key_of(text: &str, number: usize) -> Option<String> {
    let (mut table, mut arrays) = (String::new(), Vec::<String>::new());
    let mut line = "";
    for text in text.lines().take(number) {
        line = text.trim();
        if let Some(name) = line.strip_prefix("[[").and_then(|rest| rest.strip_suffix("]]")) {
            table = format!("{name}.{}", arrays.iter().filter(|known| *known == name).count());
            arrays.push(name.into());
        } else if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            table = name.into();
        }
    }
    match line.split_once(" = ") {
        Some((key, _)) if table.is_empty() => Some(key.into()),
        Some((key, _)) => Some(format!("{table}.{key}")),
        None => (!table.is_empty()).then_some(table),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_named_in_the_file_of_the_user() {
        let own = "# mine\n[dem]\ntime_step = 1e-2\n[[structure.parts]]\nname = \"a\"\n[[structure.parts]]\nname = \"b\"\n";
        let barrier = Scene::from_text("barrier.toml", own).expect("valid");
        let text = "end_time = 1.5\n[dem]\ntime_step = 0.01\n[[rock]]\ndensity = 3\n[[structure.parts]]\nname = \"a\"\n\
                    [[structure.parts]]\nname = \"b\"\n";
        let generated = Generated { file: "/t/m.toml".into(), text: text.into(), barrier: &barrier };
        assert_eq!(key_of(text, 9).as_deref(), Some("structure.parts.1.name"));
        assert_eq!(key_of(text, 1).as_deref(), Some("end_time"));
        let said = generated.error(
            "/t/m.toml:3:13: a step of 0.01 s is above the critical step\n  |\n3 | time_step = 0.01\n  |             ^^^^\n  = shorten it",
        );
        assert!(said.starts_with("barrier.toml:3:13: a step of 0.01 s is above"), "{said}");
        assert!(said.contains("3 | time_step = 1e-2") && said.trim_end().ends_with("= shorten it"), "{said}");
        let of_rock = generated.error("/t/m.toml:5:1: no\nerror: /t/m.toml:9:1: what\n  |\n");
        let due = "the scene of member 1 against barrier.toml:5:1: no\nerror: barrier.toml:7:";
        assert!(of_rock.starts_with(due), "{of_rock}");
        assert!(
            generated.warning("dem.time_step: long").starts_with("barrier.toml:3:13: dem.time_step: long")
        );
        assert_eq!(generated.warning("a post has turned: x"), "a post has turned: x");
    }
}
