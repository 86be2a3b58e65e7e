//! Every file of a program is read and written through here, as if somebody else worked in the same directory to do harm.
//!
//! - A result is created exclusively under a random name, written, synced, renamed, and its directory is synced: it is there as a
//!   whole or not at all, also after a power cut. A file that grows ([`Stream`]) is created exclusively.
//! - Whatever stands at the name of a result is replaced, never followed and never written into.
//! - Only regular files are read, up to a limit, without waiting for pipes, and memory is taken for what the file holds.
//!
//! A directory is opened once, as [`Dir`]; the functions of a path open the directory in which it lies.

use interface_defs::{Diagnostic, Fault, FaultKind, code, ipc::interrupt};
use rustix::fd::OwnedFd;
use rustix::fs::{AtFlags, FileType, Mode, OFlags, Stat};
use rustix::io::Errno;
use std::collections::hash_map::RandomState;
use std::ffi::{OsStr, OsString};
use std::fs::{File, Metadata};
use std::hash::{BuildHasher, Hasher};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

mod map;
pub use map::Map;

#[cfg(test)]
mod tests;

/// Longest text of a program that is read: a summary, a record, a scene [bytes].
pub const TEXT: u64 = 256 << 20;
/// Longest state of a run that is read [bytes].
pub const STATE: u64 = 8 << 30;
/// Bytes that are read between two looks at whether the user has interrupted the program.
const CHUNK: u64 = 1 << 20;
/// Links that are followed to a directory.
const LINKS: u32 = 8;
/// Tries to create a file where somebody else creates one again and again.
const TRIES: u32 = 16;

/// One step of writing, for tests that let it fail.
#[derive(Debug)]
#[cfg_attr(not(test), expect(dead_code, reason = "tests look at what is done"))]
enum Step<'a> {
    Create,
    Write(&'a [u8]),
    Cut(u64),
    Sync,
    Rename(&'a Path),
    Remove,
    SyncDir,
}

/// How many bytes of the step may be written.
#[cfg(not(test))]
#[inline]
fn allow(_: Step, _: &Path) -> io::Result<usize> {
    Ok(usize::MAX)
}
#[cfg(test)]
use tests::faults::allow;

/// A directory that was opened: what is done in it is done there, even if its name leads elsewhere a moment later.
#[derive(Debug)]
pub struct Dir {
    fd: OwnedFd,
    path: PathBuf,
}

impl Dir {
    /// Open the directory at `path`. A link in its place is followed if it belongs to this user or the administrator.
    pub fn open(path: &Path) -> io::Result<Self> {
        Self::follow(path, LINKS)
    }

    /// The same, created with those above it where it is not there.
    pub fn create(path: &Path) -> io::Result<Self> {
        if !path.is_dir() {
            std::fs::create_dir_all(path)?;
            Self::open(parent(path))?.sync()?;
        }
        Self::open(path)
    }

    fn follow(path: &Path, links: u32) -> io::Result<Self> {
        let path = or_here(path.components().as_path());
        let flags = OFlags::NOFOLLOW | OFlags::CLOEXEC;
        match rustix::fs::open(path, flags | OFlags::DIRECTORY, Mode::empty()) {
            Ok(fd) => Ok(Self { fd, path: path.to_owned() }),
            Err(Errno::NOTDIR | Errno::LOOP) if links > 0 => {
                // The link itself is held: nobody can exchange it between the look at its owner and its content.
                let link = rustix::fs::open(path, flags | OFlags::PATH, Mode::empty())?;
                let about = rustix::fs::fstat(&link)?;
                if FileType::from_raw_mode(about.st_mode) != FileType::Symlink {
                    return Err(Errno::NOTDIR.into());
                }
                if !is_ours(about.st_uid) {
                    let what = format!("{} is a link of another user", path.display());
                    return refuse(io::ErrorKind::PermissionDenied, what);
                }
                let to = rustix::fs::readlinkat(&link, "", Vec::new())?;
                Self::follow(&parent(path).join(OsStr::from_bytes(to.as_bytes())), links - 1)
            }
            Err(e) => Err(e.into()),
        }
    }

    /// Its path, as it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Why files in it are not safe from other users, if they are not: it, or one above it, is theirs or open to all.
    pub fn exposed(&self) -> io::Result<Option<Exposed>> {
        let own = rustix::fs::fstat(&self.fd)?;
        if !is_ours(own.st_uid) {
            return Ok(Some(Exposed::ToOwner));
        }
        let open = |about: Stat| {
            let mode = Mode::from_raw_mode(about.st_mode);
            !is_ours(about.st_uid) || (mode.contains(Mode::WOTH) && !mode.contains(Mode::SVTX))
        };
        let whole = std::fs::canonicalize(&self.path)?;
        let found = whole.ancestors().skip(1).find(|path| rustix::fs::stat(*path).is_ok_and(open));
        Ok(found.map(|path| Exposed::Above(path.to_owned())))
    }

    /// What lies in it: names, and whether each is a directory.
    pub fn entries(&self) -> io::Result<Vec<(OsString, FileType)>> {
        let mut entries = Vec::new();
        for entry in rustix::fs::Dir::read_from(&self.fd)? {
            let entry = entry?;
            let name = OsStr::from_bytes(entry.file_name().to_bytes());
            if name != "." && name != ".." {
                let about = rustix::fs::statat(&self.fd, name, AtFlags::SYMLINK_NOFOLLOW)?;
                entries.push((name.to_owned(), FileType::from_raw_mode(about.st_mode)));
            }
        }
        entries.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(entries)
    }

    /// Write `bytes` to the file `name`. One that could not be written leaves the old one as it was. Any number of processes, of
    /// other machines too, may do so at the same time.
    pub fn write(&self, name: &OsStr, bytes: &[u8]) -> io::Result<()> {
        self.write_parts(name, &[bytes])
    }

    /// [`Dir::write`] of several parts, one behind the other.
    pub fn write_parts(&self, name: &OsStr, parts: &[&[u8]]) -> io::Result<()> {
        let beside = temporary(name);
        let begun = self.new_file(&beside, 0o666);
        let all = |mut file: Stream| {
            parts.iter().try_for_each(|part| file.write_all(part)).and_then(|()| file.sync())
        };
        let written = begun.and_then(all);
        let renamed = written.and_then(|()| self.rename(&beside, name));
        if renamed.is_err() {
            let _ = self.remove(&beside);
        }
        renamed?;
        self.sync()
    }

    /// Create the file `name`, to be written bit by bit; what stands at that name is removed. The name is on the disk at once.
    pub fn stream(&self, name: &OsStr) -> io::Result<Stream> {
        let mut tries = 0..TRIES;
        loop {
            match self.new_file(name, 0o666) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && tries.next().is_some() => {
                    self.remove(name)?;
                }
                done => {
                    self.sync()?;
                    return done;
                }
            }
        }
    }

    /// The file `name` to write at its end; created where there is none.
    pub fn append(&self, name: &OsStr) -> io::Result<Stream> {
        match self.new_file(name, 0o666) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => self.known(name, OFlags::APPEND),
            done => done,
        }
    }

    /// The file `name` as it was when it had `length` bytes, to be written on: what came after is cut off.
    pub fn reopen(&self, name: &OsStr, length: u64) -> io::Result<Stream> {
        let mut stream = self.known(name, OFlags::empty())?;
        stream.cut(length)?;
        Ok(stream)
    }

    /// All of the file `name`, which may have `limit` bytes. A link is not followed.
    pub fn read(&self, name: &OsStr, limit: u64) -> io::Result<Vec<u8>> {
        read_all(self.source(name)?, limit)
    }

    /// The file `name`, to be read. A link is not followed.
    pub fn source(&self, name: &OsStr) -> io::Result<File> {
        regular(self.open_at(name, OFlags::RDONLY)?)
    }

    /// Remove the file `name`, if it is there. Of a link, the link.
    pub fn remove(&self, name: &OsStr) -> io::Result<()> {
        allow(Step::Remove, &self.path.join(name))?;
        match rustix::fs::unlinkat(&self.fd, name, AtFlags::empty()) {
            Err(Errno::NOENT) => Ok(()),
            other => Ok(other?),
        }
    }

    /// Remove every file that a process began to [`Dir::write`] and was killed. For whoever alone writes here.
    pub fn sweep(&self) -> io::Result<()> {
        let mut left = self.entries()?;
        left.retain(|(name, kind)| *kind != FileType::Directory && is_temporary(name));
        left.iter().try_for_each(|(name, _)| self.remove(name))
    }

    /// All names in it are on the disk when this returns.
    pub fn sync(&self) -> io::Result<()> {
        allow(Step::SyncDir, &self.path)?;
        match rustix::fs::fsync(&self.fd) {
            // Some network file systems cannot sync a directory.
            Err(Errno::INVAL) => Ok(()),
            other => Ok(other?),
        }
    }

    fn rename(&self, from: &OsStr, to: &OsStr) -> io::Result<()> {
        allow(Step::Rename(&self.path.join(to)), &self.path.join(from))?;
        Ok(rustix::fs::renameat(&self.fd, from, &self.fd, to)?)
    }

    fn new_file(&self, name: &OsStr, mode: u32) -> io::Result<Stream> {
        let path = self.path.join(name);
        allow(Step::Create, &path)?;
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let file = rustix::fs::openat(&self.fd, name, flags, Mode::from_raw_mode(mode))?.into();
        Ok(Stream { file, path })
    }

    /// A file of ours to write on: not one that somebody has linked here from elsewhere.
    fn known(&self, name: &OsStr, how: OFlags) -> io::Result<Stream> {
        let file = sole(self.open_at(name, OFlags::RDWR | how)?)?;
        Ok(Stream { file, path: self.path.join(name) })
    }

    fn open_at(&self, name: &OsStr, how: OFlags) -> io::Result<File> {
        let flags = how | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        Ok(rustix::fs::openat(&self.fd, name, flags, Mode::empty())?.into())
    }
}

/// Who else can exchange the files of a directory.
#[derive(Debug, PartialEq, Eq)]
pub enum Exposed {
    /// Its owner, who is another user.
    ToOwner,
    /// Whoever may write to this directory above it.
    Above(PathBuf),
}

/// A file that is written bit by bit.
#[derive(Debug)]
pub struct Stream {
    file: File,
    path: PathBuf,
}

impl Stream {
    /// The file itself.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// The file itself, for a process that is started with it.
    pub fn into_file(self) -> File {
        self.file
    }

    /// Cut it to `length` bytes and go on there.
    pub fn cut(&mut self, length: u64) -> io::Result<()> {
        allow(Step::Cut(length), &self.path)?;
        self.file.set_len(length)?;
        self.file.seek(SeekFrom::Start(length))?;
        Ok(())
    }

    /// What was written is on the disk itself when this returns.
    pub fn sync(&self) -> io::Result<()> {
        allow(Step::Sync, &self.path)?;
        self.file.sync_data()
    }

    /// An error if the name leads to another file, or none: what is written is lost, and the system gives no error.
    pub fn check(&self) -> io::Result<()> {
        let (written, named) = (self.file.metadata()?, std::fs::symlink_metadata(&self.path));
        if named.is_ok_and(|named| (named.dev(), named.ino()) == (written.dev(), written.ino())) {
            return Ok(());
        }
        let what = format!("{} was removed or replaced while the run wrote to it", self.path.display());
        refuse(io::ErrorKind::NotFound, what)
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let most = allow(Step::Write(bytes), &self.path)?.min(bytes.len());
        self.file.write(&bytes[..most])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A file for another program of this user to read, which is removed with this value.
#[derive(Debug)]
pub struct Scratch {
    dir: Dir,
    name: OsString,
}

impl Scratch {
    /// Write `bytes` to a new file in `dir`, best the directory of a run; its name begins with a random word and ends with `name`.
    pub fn new(dir: &Path, name: &str, bytes: &[u8]) -> io::Result<Self> {
        let dir = Dir::open(dir)?;
        let name = OsString::from(format!("{:016x}.{name}", random()));
        let mut file = dir.new_file(&name, 0o600)?;
        let scratch = Self { dir, name };
        file.write_all(bytes)?;
        Ok(scratch)
    }

    /// Where it lies.
    pub fn path(&self) -> PathBuf {
        self.dir.path.join(&self.name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = self.dir.remove(&self.name);
    }
}

/// Functions of a path: those of [`Dir`] in the directory in which it lies.
macro_rules! at_path {
    ($($(#[$doc:meta])+ $name:ident = $of:ident($($argument:ident: $type:ty)?) -> $out:ty;)+) => {$(
        $(#[$doc])+
        pub fn $name(path: &Path $(, $argument: $type)?) -> io::Result<$out> {
            let (dir, name) = split(path)?;
            dir.$of(name $(, $argument)?)
        }
    )+};
}

/// [`Dir::write`] to `path`.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_parts(path, &[bytes])
}

/// [`Dir::write_parts`] to `path`.
pub fn write_parts(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    let (dir, name) = replaceable(path)?;
    dir.write_parts(name, parts)
}

/// [`Dir::stream`] at `path`.
pub fn create(path: &Path) -> io::Result<Stream> {
    let (dir, name) = replaceable(path)?;
    dir.stream(name)
}

/// Where a new file takes the place of what is there: not of a device, such as `/dev/stdout`, which it would replace for all.
fn replaceable(path: &Path) -> io::Result<(Dir, &OsStr)> {
    let is_device = |about: Metadata| {
        let kind = about.file_type();
        kind.is_char_device() || kind.is_block_device()
    };
    if path.metadata().is_ok_and(is_device) {
        return refuse(io::ErrorKind::InvalidInput, "this is a device; name a file");
    }
    split(path)
}

at_path! {
    /// [`Dir::append`] to `path`.
    append = append() -> Stream;
    /// [`Dir::reopen`] of `path`.
    reopen = reopen(length: u64) -> Stream;
    /// [`Dir::read`] of `path`: a file that a program has written.
    read = read(limit: u64) -> Vec<u8>;
    /// [`Dir::source`] at `path`.
    source = source() -> File;
}

/// [`read`] of a text.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path, TEXT)?).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))
}

/// [`write()`] a value as JSON, for people and programs.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> io::Result<()> {
    write(path, (serde_json::to_string_pretty(value)? + "\n").as_bytes())
}

/// A value of a JSON file, as text of a limited length.
pub fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> io::Result<T> {
    Ok(serde_json::from_str(&read_text(path)?)?)
}

/// An error of this module for whoever runs a solver: bad input if it carries a [`Diagnostic`], else a file that failed.
pub fn fault(error: io::Error) -> Fault {
    match error.downcast::<Diagnostic>() {
        Ok(refused) => refused.into(),
        Err(error) => Fault::new(FaultKind::Broken, Diagnostic::error(code::NOT_WRITTEN, error.to_string())),
    }
}

/// [`Dir::remove`] of `path`; without its directory, it is not there either.
pub fn remove(path: &Path) -> io::Result<()> {
    if_there(split(path))?.map_or(Ok(()), |(dir, name)| dir.remove(name))
}

/// What was found, of something that need not be there.
pub fn if_there<T>(found: io::Result<T>) -> io::Result<Option<T>> {
    match found {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        found => found.map(Some),
    }
}

/// The file of a user at `path`, to be read: links are followed, and nothing is waited for.
pub fn input(path: &Path) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    regular(rustix::fs::open(path, flags, Mode::empty())?.into())
}

/// All of the file of a user at `path`, which may have `limit` bytes.
pub fn read_input(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    read_all(input(path)?, limit)
}

/// All that `file` holds, up to `limit` bytes. The user may interrupt it.
fn read_all(file: File, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let length = file.metadata()?.len();
    if length <= limit {
        bytes.try_reserve_exact(length as usize)?;
    }
    in_chunks(&file, &mut |chunk| {
        bytes.try_reserve(chunk.len())?;
        bytes.extend_from_slice(chunk);
        if length.max(bytes.len() as u64) <= limit {
            return Ok(());
        }
        let what = format!("it is longer than the {limit} bytes that are read of such a file");
        refuse(io::ErrorKind::FileTooLarge, what)
    })?;
    Ok(bytes)
}

/// Give all of `file` to `take`, chunk by chunk. The user may interrupt it.
pub fn in_chunks(mut file: impl Read, take: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
    let mut chunk = Vec::new();
    loop {
        chunk.clear();
        file.by_ref().take(CHUNK).read_to_end(&mut chunk)?;
        if chunk.is_empty() {
            return Ok(());
        }
        take(&chunk)?;
        if chunk.len() as u64 == CHUNK && interrupt::requested() {
            return Err(io::Error::other("interrupted"));
        }
    }
}

/// The same file, if it is one: a pipe or device may have no end.
fn regular(file: File) -> io::Result<File> {
    if file.metadata()?.is_file() {
        return Ok(file);
    }
    refuse(io::ErrorKind::InvalidInput, "this is no file: a directory, a device, a pipe or a socket")
}

/// The same file, if it is one that has no other name, by which it may be precious to somebody.
pub(crate) fn sole(file: File) -> io::Result<File> {
    let file = regular(file)?;
    if file.metadata()?.nlink() == 1 {
        return Ok(file);
    }
    refuse(io::ErrorKind::InvalidInput, "the file has a second name (a hard link), and is not written to")
}

fn refuse<T>(kind: io::ErrorKind, what: impl Into<String>) -> io::Result<T> {
    Err(io::Error::new(kind, what.into()))
}

fn is_ours(user: u32) -> bool {
    user == rustix::process::geteuid().as_raw() || user == 0
}

fn split(path: &Path) -> io::Result<(Dir, &OsStr)> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
    Ok((Dir::open(parent(path))?, name))
}

fn parent(path: &Path) -> &Path {
    or_here(path.parent().unwrap_or(path))
}

fn or_here(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

/// Differs from call to call and from process to process; that nobody else has it is seen when the file is created.
fn random() -> u64 {
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_u32(std::process::id());
    hasher.finish()
}

/// What the names of files that are being written end with, after a random word.
const TEMPORARY: &str = ".tmp";

fn temporary(name: &OsStr) -> OsString {
    let mut beside = name.to_owned();
    beside.push(format!(".{:016x}{TEMPORARY}", random()));
    beside
}

/// Whether a file of this name was being written.
pub fn is_temporary(name: &OsStr) -> bool {
    let name = name.as_bytes().strip_suffix(TEMPORARY.as_bytes()).unwrap_or_default();
    name.len() > 17
        && name[name.len() - 17] == b'.'
        && name[name.len() - 16..].iter().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(b))
}
