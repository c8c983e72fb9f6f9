//! `skyway completions`: what a shell completes after `skyway`.

use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Args;
use clap_complete::Shell;

const EXAMPLES: &str = "\
Examples:
  skyway completions bash > ~/.local/share/bash-completion/completions/skyway
  skyway completions fish > ~/.config/fish/completions/skyway.fish";

/// Arguments of `skyway completions`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let mut script = Vec::new();
        let mut command = super::definition();
        clap_complete::generate(self.shell, &mut command, "skyway", &mut script);
        output.raw(&script)?;
        Ok(Verdict::Done)
    }
}
