//! Registration of methods that a scene names by `type`.

/// An enum of methods, chosen by `type = "..."` in a scene, that derefs to their trait.
///
/// A new method is one file, its `mod` line and a line here: it is then loadable, public, in the reference, listed in the error for
/// a misspelt name, and tried by the tests of its folder. Without the line here its file is code that nothing uses, which does
/// not pass the compiler's lints.
macro_rules! registry {
    ($(#[$doc:meta])* pub enum $any:ident: $method:ident { $($name:literal => $file:ident::$kind:ident,)+ }) => {
        $(pub use $file::$kind;)+

        toolkit::tagged! {
            $(#[$doc])*
            #[derive(Debug, Clone, serde::Serialize, schemars::JsonSchema)]
            #[allow(missing_docs)] // A method's own doc comment says what it is, in the schema too.
            pub enum $any by "type" () {
                $(
                    #[serde(rename = $name)]
                    $kind($kind),
                )+
            }
        }

        impl $any {
            /// The names that a scene may write.
            pub const NAMES: &[&str] = &[$($name),+];
        }

        impl std::ops::Deref for $any {
            type Target = dyn $method;

            fn deref(&self) -> &Self::Target {
                match self { $(Self::$kind(method) => method,)+ }
            }
        }

        impl std::ops::DerefMut for $any {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self { $(Self::$kind(method) => method,)+ }
            }
        }
    };
}
pub(crate) use registry;
