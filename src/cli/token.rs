//! `wade token`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use wade::service::access::{Role, Token};

use super::emit;

/// Draw a token, add its digest to the file of a server, and print it
///
/// The server that names the file as access.tokens knows the token within two seconds. It is printed once and is in no file:
/// who asks the server shows it as `authorization: Bearer TOKEN`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade token rig-7 --roles query --file tokens.toml > rig-7.token
  wade token prometheus --roles observe --file tokens.toml")]
pub struct TokenCommand {
    /// What the log calls the token
    name: String,
    /// What its holder may do: query, observe, administer
    #[arg(long, value_delimiter = ',', required = true)]
    roles: Vec<Role>,
    /// File of the server's tokens; made where there is none
    #[arg(long, value_name = "FILE")]
    file: PathBuf,
}

impl TokenCommand {
    pub fn run(self) -> Result<ExitCode> {
        let token = Token::add(&self.file, &self.name, &self.roles)?;
        emit(&format!("{token}\n"))?;
        eprintln!("{} knows it as \"{}\"; it is shown this once", self.file.display(), self.name);
        Ok(ExitCode::SUCCESS)
    }
}
