//! Functions that are compiled for wide registers too.

/// Defines functions, each compiled twice: for any processor, and with AVX2. What a body calls must be `#[inline(always)]`, or
/// small, to share in that. Products are never fused with sums, so that both give the same bytes.
#[macro_export]
macro_rules! wide {
    ($($(#[$doc:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $out:ty)? $body:block)*) => {$(
        $(#[$doc])*
        $vis fn $name($($arg: $type),*) $(-> $out)? {
            #[inline(always)]
            fn narrow($($arg: $type),*) $(-> $out)? $body
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") {
                #[target_feature(enable = "avx2")]
                fn wide($($arg: $type),*) $(-> $out)? {
                    narrow($($arg),*)
                }
                // SAFETY: the processor has what the function is compiled for; it was asked a line above.
                return unsafe { wide($($arg),*) };
            }
            narrow($($arg),*)
        }
    )*};
}
