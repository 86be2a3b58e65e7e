//! What processes print, in files of bounded length: a program that prints without end fills no disk.
//!
//! A process writes into its log itself, so that its last words are there even if this program was killed. What lies between the
//! beginning and the end is given back to the disk while it goes on, and left out when it has ended.

use rustix::fs::{FallocateFlags, OFlags, fallocate, fcntl_setfl};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use toolkit::files;

/// What is kept of a beginning, and of an end [bytes].
const KEPT: u64 = 8 << 20;
/// How often the length is looked at.
pub const LOOK: Duration = Duration::from_millis(250);

/// Where the output of a process goes.
pub fn path(dir: &Path, name: &str) -> PathBuf {
    dir.join(format!("{name}.log"))
}

/// A log that others write to.
#[derive(Debug)]
pub struct Log {
    file: File,
    /// Where the beginning ends.
    head: u64,
    /// Up to where what is behind the beginning was given back.
    freed: u64,
}

impl Log {
    /// Of the file at `path`, with a handle for those who write to it.
    pub fn open(path: &Path) -> io::Result<(Self, File)> {
        let to = files::append(path)?.into_file();
        // Two writers share it, and none overwrites the other; one that was created here appends too.
        fcntl_setfl(&to, OFlags::APPEND)?;
        let length = to.metadata()?.len();
        let file = files::reopen(path, length)?.into_file();
        let head = length + KEPT;
        Ok((Self { file, head, freed: head }, to))
    }

    /// Give back what is in the middle. A file system that cannot do that keeps it until the end.
    pub fn look(&mut self) {
        let end = self.file.metadata().map_or(0, |data| data.len()).saturating_sub(KEPT);
        if end > self.freed {
            let flags = FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE;
            let _ = fallocate(&self.file, flags, self.freed, end - self.freed);
            self.freed = end;
        }
    }

    /// Nobody writes to it any more: leave the middle out.
    pub fn finish(&mut self) -> io::Result<()> {
        self.look();
        let length = self.file.metadata()?.len();
        // Somebody may have emptied it meanwhile.
        if self.freed == self.head || length < self.freed {
            return Ok(());
        }
        let kept = (length - self.freed).min(KEPT);
        let mut tail = vec![0; kept as usize];
        self.file.read_exact_at(&mut tail, length - kept)?;
        let line = tail.iter().position(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let left_out = length - self.head - (tail.len() - line) as u64;
        let mut end = format!("\n[{left_out} bytes were left out here]\n").into_bytes();
        end.extend_from_slice(&tail[line..]);
        self.file.write_all_at(&end, self.head)?;
        self.file.set_len(self.head + end.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn the_beginning_and_the_end_are_kept_and_the_middle_takes_no_room() {
        use std::os::unix::fs::MetadataExt;
        let temp = tempfile::tempdir().expect("a directory");
        let path = path(temp.path(), "dem");
        let (mut log, mut to) = Log::open(&path).expect("opened");
        let line = |n: u64| format!("line {n:>10}\n");
        let lines = 5 * KEPT / 16;
        for n in 0..lines {
            to.write_all(line(n).as_bytes()).expect("written");
            if n % 100_000 == 0 {
                log.look();
            }
        }
        log.look();
        let data = path.metadata().expect("there");
        assert!(data.blocks() * 512 <= 3 * KEPT, "{} blocks of {} bytes", data.blocks(), data.len());
        log.finish().expect("shortened");
        let text = std::fs::read_to_string(&path).expect("text");
        assert!(text.len() as u64 <= 2 * KEPT + 100, "{}", text.len());
        assert!(text.starts_with(&line(0)) && text.ends_with(&line(lines - 1)));
        let note = text.lines().find(|line| line.ends_with("left out here]")).expect("it is said");
        let bytes: u64 = note[1..].split(' ').next().expect("a number").parse().expect("a number");
        let kept = text.len() as u64 - note.len() as u64 - 2;
        assert_eq!(bytes + kept, 16 * lines);
        // What is short stays as it is, and a second one goes on behind the first.
        let short = temp.path().join("short.log");
        for _ in 0..2 {
            let (mut log, mut to) = Log::open(&short).expect("opened");
            to.write_all(b"a\n").expect("written");
            log.finish().expect("nothing to do");
        }
        assert_eq!(std::fs::read(&short).expect("there"), b"a\na\n");
    }
}
