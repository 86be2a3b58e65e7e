//! What a configuration of preCICE says of one participant: its mesh, its data, its coupling scheme.

use crate::input;
use interface_defs::Failure;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::path::{Path, PathBuf};

/// A participant of a coupling scheme.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Names {
    /// The configuration.
    pub config: PathBuf,
    /// The participant.
    pub participant: String,
    /// The mesh that it provides.
    pub mesh: String,
    /// Data that it reads from, and writes to, that mesh.
    pub reads: Vec<String>,
    /// See `reads`.
    pub writes: Vec<String>,
    /// Its coupling scheme.
    pub scheme: Scheme,
}

/// A coupling scheme.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scheme {
    /// `serial-implicit` and so on.
    pub kind: String,
    /// Participants; the first computes a window first, in a serial scheme.
    pub order: [String; 2],
    /// Length of a window [s]; 0 or below: the first participant says it.
    pub window: f64,
    /// End of the run [s].
    pub end_time: f64,
}

impl Names {
    /// Read the configuration in `file`.
    pub fn read(file: &Path, participant: &str) -> Result<Self, Failure> {
        let text =
            std::fs::read_to_string(file).map_err(|e| input(format!("--config {}: {e}", file.display())))?;
        let names = Self::parse(&text, participant);
        let names = names.map_err(|why| input(format!("--config {}: {why}", file.display())))?;
        Ok(Self { config: file.into(), ..names })
    }

    fn parse(text: &str, participant: &str) -> Result<Self, String> {
        let mut names = Self { participant: participant.into(), ..Self::default() };
        let (mut known, mut inside, mut scheme) = (Vec::new(), String::new(), Scheme::default());
        let mut reader = Reader::from_str(text);
        loop {
            let event = reader.read_event().map_err(|e| format!("byte {}: {e}", reader.error_position()))?;
            let (tag, opens) = match &event {
                Event::Start(tag) => (tag, true),
                Event::Empty(tag) => (tag, false),
                Event::Eof => break,
                Event::End(tag) => {
                    if tag.name().as_ref().starts_with(b"coupling-scheme:") {
                        let own = scheme.order.iter().any(|name| name == participant);
                        let scheme = std::mem::take(&mut scheme);
                        if own {
                            names.scheme = scheme;
                        }
                    }
                    if tag.name().as_ref() == b"participant" {
                        inside.clear();
                    }
                    continue;
                }
                _ => continue,
            };
            let of = |key: &str| attribute(tag, key).unwrap_or_default();
            let number = |key: &str| {
                let value = of(key);
                value.parse::<f64>().map_err(|e| format!("{key} = \"{value}\" is no number: {e}"))
            };
            let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
            match name.as_str() {
                "participant" => {
                    known.push(of("name"));
                    if opens {
                        inside = of("name");
                    }
                }
                "provide-mesh" if inside == participant => match names.mesh.is_empty() {
                    true => names.mesh = of("name"),
                    false => return Err(format!("{participant} provides two meshes; one is coupled")),
                },
                "read-data" if inside == participant => names.reads.push(of("name")),
                "write-data" if inside == participant => names.writes.push(of("name")),
                "participants" => scheme.order = [of("first"), of("second")],
                "time-window-size" if of("value").is_empty() => scheme.window = 0.0,
                "time-window-size" => scheme.window = number("value")?,
                "max-time" => scheme.end_time = number("value")?,
                other => {
                    if let Some(kind) = other.strip_prefix("coupling-scheme:") {
                        scheme = Scheme { kind: kind.into(), ..Scheme::default() };
                    }
                }
            }
        }
        if !known.iter().any(|name| name == participant) {
            return Err(format!("no participant is called {participant}; there are {}", known.join(", ")));
        }
        if names.mesh.is_empty() {
            return Err(format!("{participant} provides no mesh: <provide-mesh name=\"...\"/> is missing"));
        }
        if names.scheme.end_time <= 0.0 {
            return Err(format!("the coupling scheme of {participant} has no <max-time value=\"...\"/>"));
        }
        Ok(names)
    }

    /// Of `list` the data whose names begin with `word`; the second part: whether they are of the end of a window, as names that end in
    /// `-End` say.
    pub fn of<'a>(list: &'a [String], word: &'a str) -> impl Iterator<Item = (&'a str, bool)> {
        list.iter()
            .filter(move |name| name.starts_with(word))
            .map(|name| (name.as_str(), name.ends_with("-End")))
    }

    /// Whether windows are repeated until they converge.
    pub fn is_implicit(&self) -> bool {
        self.scheme.kind.ends_with("implicit")
    }

    /// Whether it computes a window without having seen what the other one does in it.
    pub fn goes_ahead(&self) -> bool {
        !self.is_implicit()
            && (self.scheme.kind.starts_with("parallel") || self.scheme.order[0] == self.participant)
    }
}

fn attribute(tag: &BytesStart, key: &str) -> Option<String> {
    let found = tag.try_get_attribute(key).ok()??;
    Some(found.unescape_value().ok()?.into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"<precice-configuration>
        <participant name="Other"><provide-mesh name="O"/><read-data name="Force" mesh="O"/></participant>
        <participant name="Rock"><provide-mesh name="R"/><write-data name="Force-End" mesh="R"/>
            <read-data name="Displacement" mesh="R"/></participant>
        <coupling-scheme:serial-explicit><participants first="Rock" second="Other"/><max-time value="0.1"/>
            <time-window-size value="1e-3"/></coupling-scheme:serial-explicit></precice-configuration>"#;

    #[test]
    fn a_participant_has_its_own_mesh_data_and_scheme() {
        let names = Names::parse(TEXT, "Rock").expect("read");
        assert_eq!((names.mesh.as_str(), names.reads.len(), names.writes.len()), ("R", 1, 1));
        assert_eq!(Names::of(&names.writes, "Force").collect::<Vec<_>>(), [("Force-End", true)]);
        assert_eq!((names.scheme.window, names.scheme.end_time), (1e-3, 0.1));
        assert!(names.goes_ahead() && !names.is_implicit());
        assert!(!Names::parse(TEXT, "Other").expect("read").goes_ahead());
    }

    #[test]
    fn what_is_missing_is_named() {
        assert!(Names::parse(TEXT, "Stone").unwrap_err().contains("there are Other, Rock"));
        assert!(Names::parse(&TEXT.replace("max-time", "x"), "Rock").unwrap_err().contains("max-time"));
        assert!(Names::parse(&TEXT.replace("0.1", "soon"), "Rock").unwrap_err().contains("\"soon\""));
        assert!(Names::parse("<a", "Rock").is_err());
    }
}
