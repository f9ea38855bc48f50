//! Every block of commands in README runs as it stands, in a scratch copy.
//!
//! Three things are stood in for: building (`cargo`) gives the program that this test was built with, `pip` looks at
//! what it is pointed to (clients/python/test installs it and runs the block of Python), and `wade serve` gets addresses
//! of its own, since another server may run on this machine.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::{root, text};

/// Longest time that a server takes to start on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Relative tolerance of figures shown in README: the order of sums differs by machine.
const TOLERANCE: f64 = 0.02;

/// Blocks of commands of README.
fn blocks() -> Vec<String> {
    let readme = text("README.md");
    let parts = readme.split("\n```sh\n").skip(1);
    parts.map(|part| part.split("\n```").next().expect("its end").to_owned()).collect()
}

fn script(path: &Path, body: &str) {
    std::fs::write(path, format!("#!/bin/sh\nset -eu\n{body}\n")).expect("written");
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("made executable");
}

/// A port that was free a moment ago.
fn port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a port").port()
}

/// A copy of what the commands read, and the programs that they call.
struct Scratch {
    folder: TempDir,
    http: u16,
}

impl Scratch {
    fn new() -> Self {
        let folder = TempDir::new().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        for name in ["tests", "clients", "src", "Cargo.toml", "Cargo.lock"] {
            symlink(root().join(name), path(name)).expect("linked");
        }
        for name in ["bin", "installed", "data"] {
            std::fs::create_dir(path(name)).expect("made");
        }
        let http = port();
        let settings = format!(
            "[grpc]\nlisten = \"127.0.0.1:{}\"\nunix_socket = \"{}\"\n[shm]\nnamespace = \"readme-{}\"\n[http]\nlisten = \"127.0.0.1:{http}\"\n",
            port(),
            path("wade.sock").display(),
            std::process::id()
        );
        std::fs::write(path("serve.toml"), settings).expect("written");
        let wade = env!("CARGO_BIN_EXE_wade");
        script(
            &path("wade"),
            &format!(
                "case \"$1\" in\nserve) exec {wade} \"$@\" --config {0}/serve.toml ;;\ngap) exec {wade} \"$@\" --server unix:{0}/wade.sock ;;\n*) exec {wade} \"$@\" ;;\nesac",
                folder.path().display()
            ),
        );
        script(
            &path("bin/cargo"),
            &format!(
                "case \"$*\" in\n'install --path . --locked') test -f Cargo.lock && cp {0}/wade {0}/installed/ ;;\ntest) ;;\n*) echo \"unexpected: cargo $*\" >&2; exit 2 ;;\nesac",
                folder.path().display()
            ),
        );
        script(
            &path("bin/pip"),
            "test \"$1\" = install\nfor last; do :; done\ntest -f \"$last/pyproject.toml\"",
        );
        Self { folder, http }
    }

    fn command(&self, block: &str) -> Command {
        let path = |name: &str| self.folder.path().join(name);
        let search = std::env::var("PATH").expect("a path");
        let search = format!("{}:{}:{search}", path("bin").display(), path("installed").display());
        let mut command = Command::new("sh");
        command.args(["-e", "-c", block]).current_dir(self.folder.path()).env("PATH", search);
        command.env("XDG_DATA_HOME", path("data")).env_remove("WADE_VEHICLES").env_remove("WADE_CONFIG");
        command
    }

    fn run(&self, block: &str) -> String {
        let output = self.command(block).output().expect("a shell");
        assert!(output.status.success(), "{block}\n{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    }

    fn is_ready(&self) -> bool {
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", self.http)) else { return false };
        let mut answer = String::new();
        let asked = stream.write_all(b"GET /readyz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        asked.is_ok() && stream.read_to_string(&mut answer).is_ok() && answer.starts_with("HTTP/1.1 200")
    }

    /// Starts the block's server, waits until it is ready, and ends it as a user does.
    fn serve(&self, block: &str) {
        let mut server = self.command(&format!("exec {block}"));
        let mut server = server.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("a shell");
        let started = Instant::now();
        while !self.is_ready() && started.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(50));
        }
        let was_ready = self.is_ready();
        let process = nix::unistd::Pid::from_raw(i32::try_from(server.id()).expect("a process"));
        nix::sys::signal::kill(process, nix::sys::signal::Signal::SIGINT).expect("signaled");
        let status = server.wait().expect("it ends");
        assert!(was_ready && status.success(), "{block}: ready {was_ready}, {status}");
    }
}

/// Whether two lines say the same: words are equal, numbers nearly.
fn agree(shown: &str, printed: &str) -> bool {
    let [shown, printed] = [shown, printed].map(|line| line.split_whitespace().collect::<Vec<_>>());
    let near = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= TOLERANCE * a.abs().max(1.0),
        _ => a == b,
    };
    shown.len() <= printed.len() && shown.iter().zip(&printed).all(|(a, b)| near(a, b))
}

#[test]
fn every_block_of_commands_runs_and_prints_what_is_shown() {
    let scratch = Scratch::new();
    let mut printed = String::new();
    let blocks_of_commands = blocks();
    assert!(blocks_of_commands.len() >= 5, "README shows how: {blocks_of_commands:?}");
    for block in &blocks_of_commands {
        if block.starts_with("wade serve") {
            scratch.serve(block);
        } else {
            printed += &scratch.run(block);
        }
    }
    // a block without a language shows what the commands before it print; the first split is that of closing fences
    let readme = text("README.md");
    let (_, after) = readme.split_once("\n```\n\n```\n").expect("README shows what is printed");
    let shown: Vec<&str> = after.split("\n```").next().expect("its end").lines().collect();
    assert!(shown.len() >= 4, "{shown:?}");
    let mut rest = printed.lines();
    for line in shown {
        assert!(
            rest.any(|candidate| agree(line, candidate)),
            "README shows `{line}`, which is not printed:\n{printed}"
        );
    }
}
