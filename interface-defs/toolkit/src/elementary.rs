//! Elementary functions that give the same bytes on every machine: those of the crate `libm`, under the names of the C library.
//!
//! Versions of the C library differ in their last bits, and one version does between processors, by fused products. Every call of
//! `f64::sin` and its like, here and in crates of others, is linked to the function of that name, and a program that defines it takes
//! its own: no call can be forgotten. That none of our programs asks the C library for one is tested (`tests/tests/commands/same_bytes.rs`).
//! Roots, remainders, and rounding to whole numbers are exact wherever they come from.

macro_rules! own {
    ($of:ty: $($name:ident($($x:ident),*))*) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name($($x: $of),*) -> $of {
            libm::$name($($x),*)
        }
    )*};
}

own! { f64:
    sin(x) cos(x) tan(x) asin(x) acos(x) atan(x) atan2(y, x)
    sinh(x) cosh(x) tanh(x)
    exp(x) exp2(x) exp10(x) expm1(x)
    log(x) log2(x) log10(x) log1p(x)
    pow(x, y) cbrt(x) hypot(x, y)
}

// What crates of others compute with single precision.
own! { f32: logf(x) powf(x, y) hypotf(x, y) }

/// What compilers make of a sine and a cosine of one angle.
///
/// # Safety
/// Both places can be written to.
#[unsafe(no_mangle)]
unsafe extern "C" fn sincos(x: f64, sin: *mut f64, cos: *mut f64) {
    let both = libm::sincos(x);
    // SAFETY: the caller's.
    unsafe { (*sin, *cos) = both };
}
