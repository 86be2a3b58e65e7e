//! Registration of methods that a scene names by `type`.

/// An enum of methods, chosen by `type = "..."` in a scene, that derefs to their trait.
///
/// A new method is one file and one line here: it is then loadable, and listed in the error for a
/// misspelt name.
macro_rules! registry {
    ($(#[$doc:meta])* pub enum $any:ident: $method:ident { $($name:literal => $kind:ident,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(tag = "type")]
        #[allow(missing_docs)] // A method's own doc comment says what it is, in the schema too.
        pub enum $any {
            $(
                #[serde(rename = $name)]
                $kind($kind),
            )+
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
