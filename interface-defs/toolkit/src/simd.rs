//! Wide registers: which of them the loops of this process use, and how a loop is compiled for them.
//!
//! Results never depend on the path, only their cost does: lane counts and the order of sums are fixed in each loop, products are
//! never fused with sums, and nothing else of a processor is asked for.

use interface_defs::diagnostic::{Diagnostic, code};
use pulp::Arch;
#[cfg(target_arch = "x86_64")]
use pulp::x86;
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

/// The variable of the environment that chooses the path by hand.
pub const VARIABLE: &str = "ROCKFALL_SIMD";

/// Registers of a code path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// What each processor of the architecture has: 128 bits on x86-64 and on 64-bit Arm.
    Portable,
    /// 256 bits.
    Avx2,
    /// 512 bits.
    Avx512,
}

/// All paths, narrowest first, with their names.
pub const PATHS: [(Path, &str); 3] =
    [(Path::Portable, "portable"), (Path::Avx2, "avx2"), (Path::Avx512, "avx512")];

/// The chosen path as its place in [`PATHS`]; `UNKNOWN`: not asked yet.
static CHOSEN: AtomicU8 = AtomicU8::new(UNKNOWN);
const UNKNOWN: u8 = u8::MAX;

impl Path {
    /// Its name in [`VARIABLE`] and in `run.json`.
    pub fn name(self) -> &'static str {
        PATHS[self as usize].1
    }

    /// Its registers; `None`: this processor lacks them.
    #[inline]
    pub fn arch(self) -> Option<Arch> {
        match self {
            Self::Portable => Some(Arch::Scalar),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => x86::V4::try_new().map(Arch::V4),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => None,
        }
    }

    /// Whether this processor has its registers.
    pub fn is_there(self) -> bool {
        self.arch().is_some()
    }

    /// The widest that this processor has.
    fn widest() -> Self {
        PATHS.iter().rev().map(|(path, _)| *path).find(|path| path.is_there()).unwrap_or(Self::Portable)
    }

    /// What [`VARIABLE`] asks for; the widest where it is not set.
    ///
    /// # Errors
    /// If it names no path, or one that this processor lacks.
    fn asked() -> Result<Self, Diagnostic> {
        let Some(name) = std::env::var_os(VARIABLE) else { return Ok(Self::widest()) };
        let there: Vec<_> = PATHS.iter().filter(|(path, _)| path.is_there()).map(|(_, name)| *name).collect();
        let refuse = |what: String| {
            let hint =
                format!("this processor has {}; without {VARIABLE} the widest is taken", there.join(", "));
            Err(Diagnostic::error(code::ARGUMENT, what).about(VARIABLE).try_instead(hint))
        };
        match PATHS.iter().find(|(_, known)| name == *known) {
            Some((path, _)) if path.is_there() => Ok(*path),
            Some((_, name)) => refuse(format!("{VARIABLE} = {name}: this processor has no such registers")),
            None => refuse(format!("{VARIABLE} = {}: no such code path", name.display())),
        }
    }
}

/// The path of this process: what [`VARIABLE`] asks for, else the widest that the processor has.
#[inline]
pub fn path() -> Path {
    match PATHS.get(usize::from(CHOSEN.load(Relaxed))) {
        Some((path, _)) => *path,
        // Programs have refused a wrong name by now; a library alone takes what is there.
        None => choose().unwrap_or_else(|_| take(Path::widest())),
    }
}

/// Choose the path of this process; each program does so before anything else.
///
/// # Errors
/// If [`VARIABLE`] names no path, or one that this processor lacks.
pub fn choose() -> Result<Path, Diagnostic> {
    Path::asked().map(take)
}

/// From now on this path is taken.
fn take(path: Path) -> Path {
    CHOSEN.store(path as u8, Relaxed);
    path
}

/// The registers of the path of this process, to dispatch on: what is dispatched and what it calls must be `#[inline(always)]`, or
/// small, to share in them.
#[inline]
pub fn arch() -> Arch {
    path().arch().unwrap_or(Arch::Scalar)
}

/// Do `what` in them. The bound makes closures such that they are called once: one that could be called again is called through a
/// function of its own, which is compiled for the narrowest registers.
#[inline(always)]
pub fn widely<R>(what: impl FnOnce() -> R) -> R {
    arch().dispatch(what)
}

/// Defines functions, each compiled for every path. What a body calls must be `#[inline(always)]`, or small, to share in that.
///
/// Beside [`arch`], as arguments of a function are known not to overlap, what a closure holds is not.
#[macro_export]
macro_rules! wide {
    ($($(#[$doc:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $out:ty)? $body:block)*) => {$(
        $(#[$doc])*
        $vis fn $name($($arg: $type),*) $(-> $out)? {
            #[inline(always)]
            fn portable($($arg: $type),*) $(-> $out)? $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2($($arg: $type),*) $(-> $out)? {
                    portable($($arg),*)
                }
                #[target_feature(enable = "avx2,avx512f,avx512vl,avx512dq,avx512bw")]
                fn avx512($($arg: $type),*) $(-> $out)? {
                    portable($($arg),*)
                }
                // SAFETY: a path is chosen only where the processor has its registers.
                match $crate::simd::path() {
                    $crate::simd::Path::Avx512 => return unsafe { avx512($($arg),*) },
                    $crate::simd::Path::Avx2 => return unsafe { avx2($($arg),*) },
                    $crate::simd::Path::Portable => {}
                }
            }
            portable($($arg),*)
        }
    )*};
}
