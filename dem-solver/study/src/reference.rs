//! What editors and the reference know of a study file, and of the tables that it leads to.

use super::quantity;
use super::settings::{Maps, REPLICATES, REPORT, Release, Sampling, ScreenLine};
use super::vary::Vary;
use toolkit::exit::Exit;
use toolkit::program::Extra;
use toolkit::schema::{Share, Tables};
use toolkit::screen::show;

/// The hidden subcommand that prints it as JSON.
pub const COMMAND: Extra = Extra {
    command: || clap::Command::new("study-schema").about("Print the JSON schema of a study file").hide(true),
    run: |_| {
        show(&share().to_json());
        Ok(Exit::Done)
    },
};

/// Keys of a study, with their texts.
pub fn share() -> Share {
    Tables::default()
        .value::<String>("title", "Title of the study, for reports.")
        .value::<String>(
            "scene",
            "Scene of one fall, of which each member is a variant: one `[[rock]]`, `[terrain]` and `[[contact]]`; relative to the study.",
        )
        .value::<u64>("seed", "Another number, other members. Default 1.")
        .value::<Sampling>("sampling", "How members are spread over what varies. Default `latin_hypercube`.")
        .value::<u32>(
            REPLICATES,
            "How often all releases are drawn, each time with other members; with a larger number a study is extended. Default 1.",
        )
        .value::<f64>(
            "most_failed",
            "Share of members that may fail or be unreliable in a study that is done. Default 0.01.",
        )
        .value::<bool>(
            REPORT,
            "Whether `rockfall` writes `report.html`, the results as one page. Default: it does.",
        )
        .key::<Vec<Release>>("release")
        .key::<Vary>("vary")
        .key::<Maps>("maps")
        .key::<Vec<ScreenLine>>("line")
        .results(&quantity::reference())
        .share()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_a_study_is_described_and_no_other() {
        let share = share();
        let mut known: Vec<&str> = share.properties.keys().map(String::as_str).collect();
        let mut read = toolkit::scene::STUDY.keys.to_vec();
        known.sort_unstable();
        read.sort_unstable();
        assert_eq!(known, read);
    }
}
