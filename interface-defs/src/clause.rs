//! Clauses of `PROTOCOL.md` by number: what a message about a breach names, and what `rockfall conform` goes through.

macro_rules! clauses {
    ($($(#[doc = $about:literal])+ $name:ident = $number:literal;)+) => {
        $($(#[doc = $about])+ pub const $name: &str = $number;)+
        /// All of them in order, each with what it is about.
        pub const ALL: &[(&str, &str)] = &[$(($number, concat!($($about),+))),+];
    };
}

clauses! {
    /// joins, and answers each message
    JOINS = "4.1";
    /// an answer repeats its request
    HEADER = "2.3";
    /// one version of the contract
    VERSION = "3.5";
    /// numbers: as many as agreed, finite, gauges in their range
    NUMBERS = "4.3";
    /// the scene that was read
    SCENE = "5.1";
    /// the interface mesh
    MESH = "5.2";
    /// samples of a window, in order
    SAMPLES = "5.3";
    /// the answer at t = 0
    INITIAL = "5.4";
    /// every solve starts from the committed state
    COMMITTED = "5.5";
    /// a commit is done
    COMMIT = "5.6";
    /// start and length of a window are used
    LENGTH = "5.7";
    /// windows are repeated
    REPEATS = "5.8";
    /// motion is what velocity says
    VELOCITY = "5.9";
    /// nodes of infinite mass
    HELD = "5.10";
    /// masses of nodes
    MASSES = "5.11";
    /// force is taken, and its work
    FORCE = "5.12";
    /// contact pushes, and what pushes is pushed
    REACTION = "5.13";
}
