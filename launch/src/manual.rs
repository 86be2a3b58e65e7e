//! The manual page: one page with the options of all commands, or a page for each in a directory.

use clap::Command;
use clap_mangen::Man;
use std::io::{self, Write};
use std::path::Path;
use toolkit::files::{self, Dir};

/// All pages, one for the program and one for each command, into `dir`.
pub fn write(mut program: Command, dir: &Path) -> io::Result<()> {
    Dir::create(dir)?;
    let mut page = Vec::new();
    one_page(program.clone(), &mut page)?;
    program.build();
    clap_mangen::generate_to(program.clone(), dir)?;
    // The page of the program has everything.
    files::write(&dir.join(format!("{}.1", program.get_name())), &page)
}

/// One page with synopsis and options of every command of `program`.
pub fn one_page(mut program: Command, page: &mut Vec<u8>) -> io::Result<()> {
    program.build();
    let man = Man::new(program.clone());
    man.render_title(page)?;
    man.render_name_section(page)?;
    man.render_synopsis_section(page)?;
    man.render_description_section(page)?;
    man.render_options_section(page)?;
    for command in program.get_subcommands().filter(|c| !c.is_hide_set() && c.get_name() != "help") {
        section(program.get_name(), command, page)?;
    }
    man.render_version_section(page)
}

/// One command: a section with subsections for its synopsis and options.
fn section(program: &str, command: &Command, page: &mut Vec<u8>) -> io::Result<()> {
    writeln!(page, ".SH \"{program} {}\"", command.get_name())?;
    // Those of the whole program are listed above.
    let hidden = ["log_format", "help"];
    let own = command.clone().mut_args(|arg| {
        let hide = hidden.contains(&arg.get_id().as_str());
        arg.hide(hide)
    });
    let has_options = own.get_arguments().any(|arg| !arg.is_hide_set());
    let man = Man::new(own);
    let mut part = Vec::new();
    man.render_description_section(&mut part)?;
    man.render_synopsis_section(&mut part)?;
    if has_options {
        man.render_options_section(&mut part)?;
    }
    if command.get_after_help().is_some() {
        man.render_extra_section(&mut part)?;
    }
    let text = String::from_utf8_lossy(&part);
    for line in text.lines() {
        match line.strip_prefix(".SH ") {
            // The description follows the heading at once.
            Some("DESCRIPTION") => {}
            Some("EXTRA") => writeln!(page, ".SS NOTES")?,
            Some(heading) => writeln!(page, ".SS {heading}")?,
            None => writeln!(page, "{line}")?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, ArgAction};

    fn program() -> Command {
        let flag = Arg::new("dry").long("dry-run").action(ArgAction::SetTrue).help("Write nothing");
        let run = Command::new("run").about("Do it").arg(flag);
        Command::new("tool").version("1.2").about("A tool").subcommand(run)
    }

    #[test]
    fn one_page_has_the_options_of_the_commands() {
        let mut page = Vec::new();
        one_page(program(), &mut page).expect("rendered");
        let page = String::from_utf8(page).expect("text");
        let at = |what: &str| page.find(what).unwrap_or_else(|| panic!("no `{what}` in\n{page}"));
        assert!(at(".SH NAME") < at(".SH \"tool run\"") && at(".SH \"tool run\"") < at("Write nothing"));
        assert!(at("\\-\\-dry\\-run") > at(".SS SYNOPSIS"), "{page}");
        assert_eq!(page.matches(".TH ").count(), 1);
    }

    #[test]
    fn a_directory_gets_a_page_for_each_command_too() {
        let dir = tempfile::tempdir().expect("a directory");
        write(program(), dir.path()).expect("written");
        let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).expect("a page");
        assert!(read("tool.1").contains("Write nothing") && read("tool-run.1").contains("Write nothing"));
    }
}
