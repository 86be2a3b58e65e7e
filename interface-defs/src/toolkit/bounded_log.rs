//! A log of bounded length: its beginning and its end are kept, what a program says in between without end is not.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;

/// What a log keeps of its beginning, and of its end [bytes].
pub const KEPT: u64 = 8 << 20;

/// A file that keeps the first and the last of what is written to it. It can be read at any time: what is written stands in it at
/// once, and it is never longer than what is kept and as much again as the end.
#[derive(Debug)]
pub struct BoundedLog {
    file: File,
    /// Where the beginning ends.
    head_end: u64,
    /// Where the end begins: behind the note, if there is one.
    tail_start: u64,
    tail: u64,
    length: u64,
    left_out: u64,
}

impl BoundedLog {
    /// Go on at the end of `file`, which is open to read and write, and not to append; of what comes from here on keep the first `head` and the last `tail` bytes.
    ///
    /// An error: the length of the file is not known.
    pub fn new(file: File, head: u64, tail: u64) -> io::Result<Self> {
        let length = file.metadata()?.len();
        let head_end = length + head;
        Ok(Self { file, head_end, tail_start: head_end, tail: tail.max(1), length, left_out: 0 })
    }

    /// Nothing more comes: no more than the end is kept behind the beginning. Bytes that were left out.
    ///
    /// An error: the file could not be shortened.
    pub fn finish(mut self) -> io::Result<u64> {
        if self.length > self.tail_start + self.tail {
            self.shorten()?;
        }
        Ok(self.left_out)
    }

    /// Move the last bytes, from the beginning of a line on, to where the beginning ends.
    fn shorten(&mut self) -> io::Result<()> {
        let mut end = vec![0; self.tail as usize];
        let from = self.length - self.tail;
        self.file.read_exact_at(&mut end, from)?;
        let line = end.iter().position(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        self.left_out += from + line as u64 - self.tail_start;
        let note = format!("\n[{} bytes were left out here]\n", self.left_out);
        self.file.write_all_at(note.as_bytes(), self.head_end)?;
        self.tail_start = self.head_end + note.len() as u64;
        self.file.write_all_at(&end[line..], self.tail_start)?;
        self.length = self.tail_start + (end.len() - line) as u64;
        self.file.set_len(self.length)
    }
}

impl Write for BoundedLog {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let part = &bytes[..bytes.len().min(self.tail as usize)];
        self.file.write_all_at(part, self.length)?;
        self.length += part.len() as u64;
        if self.length > self.tail_start + 2 * self.tail {
            self.shorten()?;
        }
        Ok(part.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stands in a log of 20 and 30 bytes after `write`, and how much was left out.
    fn logged(before: &str, write: impl FnOnce(&mut BoundedLog)) -> (String, u64) {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(before.as_bytes()).expect("written");
        let mut log = BoundedLog::new(file.reopen().expect("opened"), 20, 30).expect("begun");
        write(&mut log);
        let left_out = log.finish().expect("finished");
        (std::fs::read_to_string(file.path()).expect("read"), left_out)
    }

    #[test]
    fn what_is_short_stays_as_it_is() {
        for length in [0, 1, 20, 50] {
            let text = "x".repeat(length);
            let written = text.clone();
            let (log, left_out) =
                logged("before\n", |log| log.write_all(written.as_bytes()).expect("written"));
            assert_eq!((log, left_out), (format!("before\n{text}"), 0));
        }
    }

    #[test]
    fn of_what_is_long_the_beginning_and_the_last_lines_stay() {
        let all: String = (0..1000).map(|line| format!("line {line:03}\n")).collect();
        let (log, left_out) =
            logged("", |log| (0..1000).for_each(|i| writeln!(log, "line {i:03}").expect("written")));
        assert_eq!(
            log,
            format!("{}\n[{left_out} bytes were left out here]\nline 997\nline 998\nline 999\n", &all[..20])
        );
        assert_eq!(left_out as usize, all.len() - 20 - 27);
        // The same in one piece.
        let written = all.clone();
        assert_eq!(logged("", |log| log.write_all(written.as_bytes()).expect("written")), (log, left_out));
    }

    #[test]
    fn one_line_without_end_is_bounded_at_any_time() {
        let (log, left_out) = logged("", |log| {
            for _ in 0..10_000 {
                log.write_all(b"no end").expect("written");
                assert!(log.file.metadata().expect("there").len() < 20 + 2 * 30 + 60);
            }
        });
        assert_eq!(left_out, 60_000 - 20 - 30);
        assert!(
            log.starts_with("no endno endno endno\n[59950 bytes") && log.ends_with("no endno end"),
            "{log}"
        );
    }
}
