//! `wade completions` and `wade man`: what a shell and `man` know of the command line, made from its definition.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{Cli, emit};

/// Print the completions of a shell
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade completions bash > ~/.local/share/bash-completion/completions/wade
  wade completions zsh > ~/.zfunc/_wade
  wade completions fish > ~/.config/fish/completions/wade.fish")]
pub struct Completions {
    /// Which
    shell: Shell,
}

impl Completions {
    /// Prints the script.
    pub fn run(&self) -> Result<ExitCode> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "wade", &mut script);
        emit(&String::from_utf8(script)?)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Write a man page of every command
#[derive(Debug, Args)]
#[command(after_help = "Example:
  wade man --out ~/.local/share/man/man1 && man wade-soak")]
pub struct Man {
    /// Folder for wade.1, wade-serve.1 and so on; it is made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Man {
    /// Writes the pages.
    pub fn run(&self) -> Result<ExitCode> {
        let place = || self.out.display().to_string();
        std::fs::create_dir_all(&self.out).with_context(place)?;
        clap_mangen::generate_to(Cli::command(), &self.out).with_context(place)?;
        emit(&format!("{}\n", self.out.join("wade.1").display()))?;
        Ok(ExitCode::SUCCESS)
    }
}
