//! The command line, why a command ends, and the commands that are one file.
//!
//! - [`cli`]: what the user may ask for, and the manual page; [`stop`]: why a command ends, with its exit code; [`shell`]: words as a
//!   shell reads them
//! - [`status`]: how far a run, a study or a test for approval is, by its files; `rockfall verify`: whether they are what was written
//! - [`conform`](mod@conform): one program against the contract, with a partner of ours; [`replay`](mod@replay): one solver alone
//!   against a recording of a run; [`bridge`](mod@bridge): a solver that is elsewhere, over TCP
//! - [`reference`](mod@reference): schema and reference of what a scene may hold, put together from all programs

mod bridge;
pub mod cli;
mod conform;
mod reference;
mod replay;
pub mod shell;
mod status;
pub mod stop;
