//! Which program wrote what: the build of a program, the layout of a kept state, hashes of files.
//!
//! The proof of a build is the hash of the program that runs (BLAKE3 of `/proc/self/exe`, taken once and only where it is needed); the
//! commit is known where `ROCKFALL_COMMIT` was set when it was compiled, as whoever packages it does: nothing is compiled anew
//! because of a commit. Two builds of the same sources by the same compiler are the same program.

use super::files;
use interface_defs::diagnostic::{Diagnostic, code};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::OnceLock;

/// A build of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BuildId {
    /// Version of the project.
    pub version: String,
    /// Commit of its sources; `None`: it was not named when the program was compiled.
    pub commit: Option<String>,
    /// Hash of the program, 32 hexadecimal digits; `unknown` where the system does not show it.
    pub program: String,
}

impl std::fmt::Display for BuildId {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let commit = self.commit.as_deref().unwrap_or("unknown");
        write!(f, "{} (commit {commit}, program {})", self.version, self.program)
    }
}

/// The build of this program.
pub fn build_id() -> &'static BuildId {
    static OWN: OnceLock<BuildId> = OnceLock::new();
    OWN.get_or_init(|| BuildId {
        version: env!("CARGO_PKG_VERSION").into(),
        commit: option_env!("ROCKFALL_COMMIT").map(String::from),
        program: program(Path::new("/proc/self/exe")).unwrap_or_else(|_| "unknown".into()),
    })
}

/// The hash of the program at `path`, as [`BuildId::program`] has it. No signal cuts it short: the checkpoint of an interrupted run
/// needs it.
pub fn program(path: &Path) -> io::Result<String> {
    let mut hash = blake3::Hasher::new();
    hash.update_reader(File::open(path)?)?;
    Ok(hash.finalize().to_hex()[..DIGITS].to_owned())
}

/// What `--version` shows. The program is hashed only if that is asked for.
pub fn long_version() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| match std::env::args_os().any(|word| word == "--version") {
        true => build_id().to_string(),
        false => env!("CARGO_PKG_VERSION").into(),
    })
}

/// Date and time, in UTC; that of `SOURCE_DATE_EPOCH` [s] where it is set, for results that are to be the same bytes.
pub fn now() -> String {
    let set = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|seconds| seconds.parse().ok());
    let time = set.and_then(|seconds| chrono::DateTime::from_timestamp(seconds, 0));
    time.unwrap_or_else(chrono::Utc::now).format("%Y-%m-%d %H:%M UTC").to_string()
}

/// The hash of bytes that come one after the other.
#[derive(Debug, Clone, Default)]
pub struct Running(blake3::Hasher);

impl Running {
    /// Bytes that come next.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The hash of all so far, as it is written: `blake3:` and 64 hexadecimal digits.
    pub fn text(&self) -> String {
        format!("blake3:{}", self.0.finalize().to_hex())
    }
}

/// The hash of `bytes`.
pub fn hash(bytes: &[u8]) -> String {
    format!("blake3:{}", blake3::hash(bytes).to_hex())
}

/// The hash of all that `file` holds, and its length.
pub fn hash_of(file: impl io::Read) -> io::Result<(Running, u64)> {
    let (mut hash, mut length) = (Running::default(), 0);
    files::in_chunks(file, &mut |chunk| {
        hash.add(chunk);
        length += chunk.len() as u64;
        Ok(())
    })?;
    Ok((hash, length))
}

/// What a kept state begins with.
const MARK: &[u8; 4] = b"RKP2";
/// Digits of the hash of a program.
const DIGITS: usize = 32;

/// What stands before a kept state: a mark, and the program that writes it.
pub fn head() -> Vec<u8> {
    let program = build_id().program.bytes().chain(std::iter::repeat(b' ')).take(DIGITS);
    MARK.iter().copied().chain(program).collect()
}

/// The state behind [`head`], if this program wrote it: states are bytes without names, and no other program knows their
/// layout for certain. An error of kind [`code::PROVENANCE`] names both builds.
pub fn open(bytes: &[u8]) -> Result<&[u8], Diagnostic> {
    let own = head();
    let what = match bytes.split_at_checked(own.len()) {
        Some((head, state)) if head == own => return Ok(state),
        Some((head, _)) if head.starts_with(MARK) => {
            let theirs = String::from_utf8_lossy(&head[MARK.len()..]);
            let (theirs, own) = (theirs.trim_end(), build_id());
            format!("a kept state is of another build: it was written by program {theirs}, and this is {own}")
        }
        _ => "a kept state does not say which program wrote it".into(),
    };
    let cure = "use the programs that wrote it, or run it anew with --force or into another directory";
    Err(Diagnostic::error(code::PROVENANCE, what).try_instead(cure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_build_names_the_program_that_runs() {
        let exe = std::fs::read("/proc/self/exe").expect("readable");
        assert_eq!(hash(&exe)[7..7 + DIGITS], build_id().program);
        assert!(build_id().to_string().contains(&build_id().program));
        assert_eq!(long_version(), env!("CARGO_PKG_VERSION"));
    }

    #[test]
    fn a_state_of_another_build_is_refused_and_names_both() {
        let mut bytes = head();
        let length = bytes.len();
        bytes.extend(b"state");
        assert_eq!(open(&bytes), Ok(&b"state"[..]));
        bytes[length - 1] ^= 1;
        let build = open(&bytes).expect_err("another");
        let theirs = String::from_utf8_lossy(&bytes[length - DIGITS..length]);
        assert!(build.code == code::PROVENANCE && build.message.contains(&*theirs), "{build}");
        assert!(build.message.contains(&build_id().program), "{build}");
        for length in 0..length {
            assert!(open(&bytes[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn a_hash_of_parts_is_that_of_the_whole() {
        let mut hash_of_parts = Running::default();
        [&b"ab"[..], b"", b"c"].iter().for_each(|part| hash_of_parts.add(part));
        assert_eq!(hash_of_parts.text(), hash(b"abc"));
        let (of_file, length) = hash_of(&b"abc"[..]).expect("read");
        assert_eq!((of_file.text(), length), (hash(b"abc"), 3));
    }
}
