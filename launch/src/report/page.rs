//! A page: title, status, sections, and the data of what is drawn, in one file without a request.

use base64::Engine as _;
use serde::Serialize;
use serde_json::{Map, Value};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::summary::RunStatus;

/// What it is made of; each has one place in the page.
const FRAME: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// In this order: what all share first.
const SCRIPTS: [&str; 5] = [
    include_str!("shared.js"),
    include_str!("curves.js"),
    include_str!("views.js"),
    include_str!("maps.js"),
    include_str!("replay.js"),
];

/// A page.
pub struct Page {
    title: String,
    status: RunStatus,
    body: String,
    /// What the scripts draw, by name.
    data: Map<String, Value>,
}

impl Page {
    /// Without a section.
    pub fn new(title: &str, status: RunStatus) -> Self {
        Self { title: title.into(), status, body: String::new(), data: Map::new() }
    }

    /// One more section, whose content is HTML. None where it is empty.
    pub fn section(&mut self, title: &str, html: &str) {
        if !html.is_empty() {
            let title = escape(title);
            self.body += &format!("<section><h2>{title}</h2>\n{html}\n</section>\n");
        }
    }

    /// Data for the scripts.
    pub fn data(&mut self, name: &str, value: impl Into<Value>) {
        self.data.insert(name.into(), value.into());
    }

    /// The file.
    pub fn html(&self) -> String {
        // Within a script `</` would end it, wherever it stands.
        let data = Value::from(self.data.clone()).to_string().replace("</", "<\\/");
        let (title, status) = (escape(&self.title), self.status.word());
        // In a style a quotation mark would end the text, and so would `</`.
        let quoted: String = self.title.chars().filter(|c| !"\"\\<\n".contains(*c)).collect();
        let style = STYLE.replace("TITLE", &format!("{quoted} ({status})"));
        let script = SCRIPTS.concat();
        let places = [
            ("TITLE", &*title),
            ("STATUS", status),
            ("STYLE", &style),
            ("BODY", &self.body),
            ("DATA", &data),
            ("SCRIPT", &script),
        ];
        let mut parts = FRAME.split("@@");
        let mut text = parts.next().unwrap_or_default().to_owned();
        // Every second part is the name of a place: what is put in is not searched again.
        while let (Some(name), Some(rest)) = (parts.next(), parts.next()) {
            text += places.iter().find(|(place, _)| *place == name).map_or("", |(_, content)| content);
            text += rest;
        }
        text
    }
}

/// The last name of a path.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A picture of a file, with its title.
pub fn picture(file: &Path, title: &str) -> io::Result<String> {
    let data = base64::engine::general_purpose::STANDARD.encode(files::read(file, files::TEXT)?);
    let title = escape(title);
    Ok(format!(
        "<figure><figcaption>{title}</figcaption><img class=\"paper\" alt=\"{title}\" src=\"data:image/svg+xml;base64,{data}\"></figure>\n"
    ))
}

/// A text as it may stand in HTML, within quotation marks too.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A list of texts; nothing where there are none.
pub fn list(items: impl Iterator<Item = String>) -> String {
    let items: String =
        items.map(|item| format!("<li>{}</li>\n", escape(&item).replace('\n', "<br>"))).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>") }
}

/// A number that is shown as `shown`, with all of its digits behind it, as a file of results has it.
pub fn number(value: impl Serialize, shown: &str) -> String {
    let exact = serde_json::to_string(&value).unwrap_or_default();
    format!("<data value=\"{exact}\">{}</data>", escape(shown))
}

/// A button that takes curves and replay to a time [s].
pub fn moment(time: f64, shown: &str) -> String {
    format!("<button data-time=\"{time}\">{}</button>", number(time, shown))
}

/// A table whose cells are HTML; nothing where there are no rows.
pub fn table<R>(caption: &str, columns: &Columns<R>, rows: &[R]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let caption = escape(caption);
    let mut lines = columns.lines(rows).into_iter();
    let row = |tag: &str, cells: Vec<String>| -> String {
        let cells: String = cells.iter().map(|cell| format!("<{tag}>{cell}</{}>", &tag[..2])).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let head = row("th scope=\"col\"", lines.next().unwrap_or_default());
    let body: String = lines.map(|cells| row("td", cells)).collect();
    format!(
        "<div class=\"wide\"><table>\n<caption>{caption}</caption>\n<thead>{head}</thead>\n<tbody>\n{body}</tbody>\n</table></div>"
    )
}
