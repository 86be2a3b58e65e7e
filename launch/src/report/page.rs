//! A page: title, status, sections, and the data of what is drawn, in one file without a request.

use base64::Engine as _;
use serde::Serialize;
use serde_json::{Map, Value};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::summary::RunStatus;
pub use toolkit::vtu::escape;

/// How it looks.
const STYLE: &str = include_str!("page.css");
/// What draws in it, in this order.
const SCRIPTS: [&str; 6] = [
    include_str!("shared.js"),
    include_str!("curves.js"),
    include_str!("views.js"),
    include_str!("maps.js"),
    include_str!("hits.js"),
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
        let data = Value::from(self.data.clone()).to_string().replace('<', "\\u003c");
        // In a style a quotation mark would end the text.
        let quoted: String = self.title.chars().filter(|c| !"\"\\<\n".contains(*c)).collect();
        let (title, status) = (escape(&self.title), self.status.word());
        let style = STYLE.replace("TITLE", &format!("{quoted} ({status})"));
        let (body, script) = (&self.body, SCRIPTS.concat());
        format!(
            include_str!("page.html"),
            title = title,
            status = status,
            style = style,
            body = body,
            data = data,
            script = script
        )
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

/// A text as HTML, with what stands between backquotes as it is written in files.
pub fn named(text: &str) -> String {
    let code =
        |(k, part): (usize, &str)| if k % 2 == 1 { format!("<code>{part}</code>") } else { part.into() };
    escape(text).split('`').enumerate().map(code).collect()
}

/// A list of texts; nothing where there are none.
pub fn list(items: impl Iterator<Item = String>) -> String {
    let items: String =
        items.map(|item| format!("<li>{}</li>\n", named(&item).replace('\n', "<br>"))).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>") }
}

/// A number that is shown as `shown`, with all of its digits behind it, as a file of results has it.
pub fn number(value: impl Serialize, shown: &str) -> String {
    let exact = serde_json::to_string(&value).unwrap_or_default();
    format!("<data value=\"{exact}\">{}</data>", escape(shown))
}

/// Below this, in its SI unit, a number is a rounding error of one that is 0.
pub fn unless_noise(value: f64) -> f64 {
    if value.abs() < 1e-9 { 0.0 } else { value }
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
    let mut lines = columns.lines(rows);
    // A column without content is none.
    let kept: Vec<bool> =
        (0..lines[0].len()).map(|k| lines[1..].iter().any(|line| !line[k].is_empty())).collect();
    for line in &mut lines {
        let mut kept = kept.iter();
        line.retain(|_| kept.next() == Some(&true));
    }
    let mut lines = lines.into_iter();
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
