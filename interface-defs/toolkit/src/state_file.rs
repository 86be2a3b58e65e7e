//! A file that keeps a state: a checkpoint, or the state at the end of a run, for another run that starts from it.
//!
//! ```text
//! 8 bytes   "RKFLSTA3"
//! 4 bytes   version of what follows, little-endian
//! 32 bytes  BLAKE3 of the rest
//!           the content, bincode 2 with integers of fixed length
//! ```
//!
//! It is there as a whole or not at all. Whoever writes it says in it by which build, and whoever reads it compares that.

use super::files;
use interface_defs::message;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io;
use std::path::Path;

/// What the file begins with.
const MARK: &[u8; 8] = b"RKFLSTA3";
/// Bytes before that of which the hash is taken.
const HEAD: usize = 44;

/// Why a state cannot be read.
#[derive(Debug)]
pub enum Unreadable {
    /// There is no such file, or the disk has failed.
    File(io::Error),
    /// It is of another version, or another build gave its content another layout.
    Foreign(String),
    /// It is not what was written.
    Damaged(String),
}

impl std::fmt::Display for Unreadable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::File(e) => write!(f, "it cannot be read: {e}"),
            Self::Foreign(what) => f.write_str(what),
            Self::Damaged(how) => write!(f, "it is damaged: {how}"),
        }
    }
}

/// Write `state` to `path`, as content of `version`: as a whole or not at all.
pub fn write(path: &Path, version: u32, state: &impl Serialize) -> io::Result<()> {
    let mut rest = Vec::new();
    message::append(state, &mut rest);
    let hash = blake3::hash(&rest);
    files::write(path, &[&MARK[..], &version.to_le_bytes(), hash.as_bytes(), &rest].concat())
}

/// Read what [`write`] has written to `path` as content of `version`.
pub fn read<S: DeserializeOwned>(path: &Path, version: u32) -> Result<S, Unreadable> {
    let bytes = files::read(path, files::STATE).map_err(Unreadable::File)?;
    if !bytes.starts_with(MARK) {
        let what = "it does not begin as the state of a run that this version writes".to_owned();
        let other = bytes.len() > MARK.len() && bytes.starts_with(&MARK[..MARK.len() - 1]);
        return Err(if other { Unreadable::Foreign(what) } else { Unreadable::Damaged(what) });
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
        let what = format!("it is of version {found}, and this program reads version {version}");
        return Err(Unreadable::Foreign(what));
    }
    // Its bytes are those that were written: what cannot be read was written otherwise.
    message::unpack(rest).map_err(|e| Unreadable::Foreign(format!("another build wrote it: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_that_is_claimed_takes_no_memory() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a.state");
        for claimed in [1 << 20, 1 << 40, u64::MAX] {
            let rest = u64::to_le_bytes(claimed);
            let sum = *blake3::hash(&rest).as_bytes();
            let bytes = [&MARK[..], &3_u32.to_le_bytes(), &sum, &rest].concat();
            std::fs::write(&path, bytes).expect("written");
            let said = read::<(String, Vec<f64>)>(&path, 3).expect_err("refused");
            assert!(matches!(said, Unreadable::Foreign(_)), "{said}");
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
            assert!(said.contains("damaged") || said.contains("version"), "byte {at}: {said}");
        }
        for length in 0..whole.len() {
            assert!(again(&whole[..length]).contains("damaged"), "{length} bytes");
        }
        std::fs::write(&path, &whole).expect("written");
        let other = read::<(Vec<f64>, String)>(&path, 4).expect_err("refused");
        assert_eq!(other.to_string(), "it is of version 3, and this program reads version 4");
        std::fs::write(&path, [b"RKFLSTA2", &whole[8..]].concat()).expect("written");
        let other = read::<(Vec<f64>, String)>(&path, 3).expect_err("refused");
        assert!(matches!(other, Unreadable::Foreign(_)), "{other}");
        let none = read::<(Vec<f64>, String)>(&temp.path().join("b"), 3).expect_err("none");
        assert!(matches!(none, Unreadable::File(_)));
    }
}
