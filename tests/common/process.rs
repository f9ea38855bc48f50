//! A process that a test can kill, such as a server of shared memory alone.

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use wade_client::ShmClient;
use wade_wire::State;
use wade_wire::shm::layout::Answer;

use crate::common::{PATIENCE, vehicles};

pub struct Process(Child);

impl Process {
    pub fn start(folder: &Path, namespace: &str, wait: &str) -> Self {
        let file = folder.join("wade.toml");
        let settings = format!(
            "vehicles = \"{}\"\n[grpc]\nlisten = \"\"\nunix_socket = \"\"\n[http]\nlisten = \"\"\n\
             [shm]\nnamespace = \"{namespace}\"\nwait = \"{wait}\"\n[log]\nfilter = \"error\"\n",
            vehicles().display()
        );
        std::fs::write(&file, settings).expect("written");
        let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
        Self::of(command.arg("serve").arg("--config").arg(file))
    }

    /// Starts a command, which ends with its owner.
    pub fn of(command: &mut Command) -> Self {
        Self(command.stdin(Stdio::null()).spawn().expect("the process starts"))
    }

    /// Ends it as nothing can prepare for.
    pub fn kill(mut self) {
        self.0.kill().expect("killed");
        let status = self.0.wait().expect("reaped");
        assert_eq!(status.signal(), Some(9));
    }

    /// Ends it as an administrator does.
    #[allow(dead_code, reason = "not every test that has a server ends one in order")]
    pub fn terminate(mut self) {
        let pid = nix::unistd::Pid::from_raw(self.0.id().cast_signed());
        nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM).expect("sent");
        assert!(self.0.wait().expect("reaped").success());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A state that is answered.
pub fn state() -> State {
    State { depth: 0.15, velocity: [0.5, 0.0, 0.0], ..State::default() }
}

/// Asks until somebody answers.
pub fn until_answered(client: &mut ShmClient) -> Answer {
    let start = Instant::now();
    loop {
        match client.evaluate(&state()) {
            Ok(answer) => return answer,
            Err(error) => assert!(start.elapsed() < PATIENCE, "never answered: {error}"),
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
