//! `skyway man`: the manual pages, in roff.

use super::files;
use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway man | man -l -               read it now
  skyway man --dir /usr/share/man/man1   install a page for every command";

/// Arguments of `skyway man`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Man {
    /// Write a page for every command into this directory, instead of the main page to standard output
    #[arg(long, value_name = "DIRECTORY")]
    dir: Option<PathBuf>,
}

impl Man {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let command = super::definition();
        let Some(directory) = &self.dir else {
            let mut page = Vec::new();
            clap_mangen::Man::new(command)
                .render(&mut page)
                .map_err(Stop::failed)?;
            output.raw(&page)?;
            return Ok(Verdict::Done);
        };
        files::create_directory(directory)?;
        clap_mangen::generate_to(command, directory).map_err(|error| {
            Stop::failed(format!("cannot write to {}: {error}", directory.display()))
        })?;
        output.note(&format!("wrote the pages to {}", directory.display()));
        Ok(Verdict::Done)
    }
}
