//! A file that keeps a state: a checkpoint, or the state at the end of a run, for another run that starts from it.
//!
//! ```text
//! 8 bytes   "RKFLSTA2"
//! 4 bytes   version of what follows, little-endian
//! 32 bytes  BLAKE3 of the rest
//!           layout and program ([`super::provenance`]), then the content, bincode 2 with integers of fixed length
//! ```
//!
//! It is there as a whole or not at all. Whoever writes it says what the content is; nobody else has to read it.

use super::files;
use super::provenance::{self, Reader};
use interface_defs::{Diagnostic, code, message};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io;
use std::path::Path;

/// What the file begins with.
const MARK: &[u8; 8] = b"RKFLSTA2";
/// What it began with before states named their build.
const EARLIER: &[u8; 8] = b"RKFLSTAT";
/// Bytes before that of which the hash is taken.
const HEAD: usize = 44;

/// Why a state cannot be read.
#[derive(Debug)]
pub enum Unreadable {
    /// There is no such file, or the disk has failed.
    File(io::Error),
    /// It is of another version: that of the file, and that which is read here.
    Version(u32, u32),
    /// Another program wrote it, and this one does not know its layout.
    Foreign(Box<Diagnostic>),
    /// It is not what was written.
    Damaged(String),
}

impl std::fmt::Display for Unreadable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::File(e) => write!(f, "it cannot be read: {e}"),
            Self::Version(file, own) => {
                write!(f, "it is of version {file}, and this program reads version {own}")
            }
            Self::Foreign(why) => f.write_str(&why.message),
            Self::Damaged(how) => write!(f, "it is damaged: {how}"),
        }
    }
}

/// Write `state` to `path`, as content of `version`: as a whole or not at all.
pub fn write<S: Serialize + DeserializeOwned>(path: &Path, version: u32, state: &S) -> io::Result<()> {
    let mut rest = provenance::head::<S>();
    message::append(state, &mut rest);
    let hash = blake3::hash(&rest);
    files::write(path, &[&MARK[..], &version.to_le_bytes(), hash.as_bytes(), &rest].concat())
}

/// Read what [`write`] has written to `path` as content of `version`, by any program that has the same layout of it.
pub fn read<S: DeserializeOwned>(path: &Path, version: u32) -> Result<S, Unreadable> {
    let bytes = files::read(path, files::STATE).map_err(Unreadable::File)?;
    if bytes.starts_with(EARLIER) {
        let what = "an earlier version of this project wrote it, which named no build";
        return Err(Unreadable::Foreign(Box::new(Diagnostic::error(code::PROVENANCE, what))));
    }
    if !bytes.starts_with(MARK) {
        return Err(Unreadable::Damaged("it does not begin as the state of a run".into()));
    }
    let Some((head, rest)) = bytes.split_at_checked(HEAD) else {
        return Err(Unreadable::Damaged(format!("it ends after {} bytes", bytes.len())));
    };
    if blake3::hash(rest).as_bytes()[..] != head[12..] {
        let what = format!("the hash of its {} bytes is not the one that was written", rest.len());
        return Err(Unreadable::Damaged(what));
    }
    let found = u32::from_le_bytes(head[8..12].try_into().expect("four bytes"));
    if found != version {
        return Err(Unreadable::Version(found, version));
    }
    let content =
        provenance::open::<S>(rest, Reader::SameLayout).map_err(|e| Unreadable::Foreign(e.into()))?;
    message::unpack(content).map_err(|e| Unreadable::Damaged(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_that_is_claimed_takes_no_memory_and_no_other_layout_is_read() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a.state");
        for claimed in [1 << 20, 1 << 40, u64::MAX] {
            let mut rest = provenance::head::<(String, Vec<f64>)>();
            rest.extend(u64::to_le_bytes(claimed));
            let sum = *blake3::hash(&rest).as_bytes();
            let bytes = [&MARK[..], &3_u32.to_le_bytes(), &sum, &rest].concat();
            std::fs::write(&path, bytes).expect("written");
            let said = read::<(String, Vec<f64>)>(&path, 3).expect_err("refused");
            assert!(matches!(said, Unreadable::Damaged(_)), "{said}");
            let other = read::<(String, Vec<f32>)>(&path, 3).expect_err("refused");
            assert!(matches!(other, Unreadable::Foreign(_)), "{other}");
        }
    }

    #[test]
    fn a_state_is_read_as_it_was_written_and_any_changed_byte_is_found() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a.state");
        let state = (vec![0.1, -0.0, f64::MAX, 5e-324], "net".to_string());
        write(&path, 3, &state).expect("written");
        let read_back: (Vec<f64>, String) = read(&path, 3).expect("whole");
        assert_eq!(read_back, state);
        assert!(read_back.0[1].is_sign_negative());
        let again = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            read::<(Vec<f64>, String)>(&path, 3).expect_err("refused").to_string()
        };
        let whole = std::fs::read(&path).expect("there");
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            let said = again(&bytes);
            assert!(said.contains("damaged") || said.contains("is of version"), "byte {at}: {said}");
        }
        for length in 0..whole.len() {
            assert!(again(&whole[..length]).contains("damaged"), "{length} bytes");
        }
        std::fs::write(&path, &whole).expect("written");
        let other = read::<(Vec<f64>, String)>(&path, 4).expect_err("refused");
        assert_eq!(other.to_string(), "it is of version 3, and this program reads version 4");
        std::fs::write(&path, [&EARLIER[..], &whole[8..]].concat()).expect("written");
        let other = read::<(Vec<f64>, String)>(&path, 3).expect_err("refused");
        assert!(matches!(other, Unreadable::Foreign(_)), "{other}");
        let none = read::<(Vec<f64>, String)>(&temp.path().join("b"), 3).expect_err("none");
        assert!(matches!(none, Unreadable::File(_)));
    }
}
