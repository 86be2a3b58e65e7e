//! XYZ text: three numbers per line, separated by blanks, commas or semicolons; further columns are not
//! read. Lines that are empty or begin with `#` are passed over, and so is one line of column names.

use super::format::{Format, Reader};
use toolkit::words::{ReadError, comma, has_comma, number, shown};

/// This format.
pub const FORMAT: Format = Format {
    name: "a list of points",
    extensions: &["xyz"],
    also: &["txt", "csv"],
    begins: |head| head.line().count() >= 3 && head.line().all(|word| word.parse::<f64>().is_ok()),
    read: Reader::Points(read),
};

fn read(bytes: &[u8]) -> Result<Vec<[f64; 3]>, ReadError> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut named = false;
    let mut counted = true;
    for (line, text) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let separates = |b: &u8| b.is_ascii_whitespace() || matches!(b, b',' | b';');
        let mut words = text.split(separates).filter(|w| !w.is_empty()).peekable();
        match words.peek() {
            None => continue,
            Some(first) if first.starts_with(b"#") => continue,
            Some(first) if points.is_empty() && !named && is_name(first) => {
                named = true;
                continue;
            }
            Some(_) => {}
        }
        // Blanks or semicolons between numbers that have commas inside: each comma would cut one in two.
        let outer = |b: &u8| b.is_ascii_whitespace() || *b == b';';
        let fields: Vec<&[u8]> = text.split(outer).filter(|w| !w.is_empty()).take(3).collect();
        if let (3, Some(word)) = (fields.len(), fields.iter().find(|w| has_comma(w))) {
            let what =
                format!("`{}` is two numbers to this reader, which separates by commas too", shown(word));
            return Err(comma(word, ReadError::at(line, what)));
        }
        let mut point = [0.0; 3];
        for (value, name) in point.iter_mut().zip(["x", "y", "z"]) {
            let fault = |what: String| ReadError::at(line, what);
            let Some(word) = words.next() else { return Err(fault(format!("the line has no {name}"))) };
            *value = number(word).ok_or_else(|| fault(format!("`{}` is no {name}", shown(word))))?;
        }
        // A first of four columns that counts the lines.
        let number = points.len() as f64;
        counted &= words.next().is_some() && (point[0] == number || point[0] == number + 1.0);
        points.push(point);
    }
    if counted && points.len() > 2 {
        let what = "the first of its columns counts the lines: x, y and z must be the first three";
        return Err(ReadError::new(what).try_instead("remove that column"));
    }
    if points.is_empty() {
        return Err("the file has no point".into());
    }
    Ok(points)
}

/// True for the name of a column: letters, perhaps in quotes.
fn is_name(word: &[u8]) -> bool {
    number(word).is_none()
        && word.len() <= 32
        && word.iter().all(|b| b.is_ascii_alphanumeric() || b"_\"'/".contains(b))
}
