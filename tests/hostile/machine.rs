//! A server in a process of its own, and an iceoryx2 that nobody else uses, so that a test may destroy what it likes.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

use crate::common::{PATIENCE, vehicles};

/// Name of the namespace; the iceoryx2 is its own already.
pub const NAMESPACE: &str = "hostile";

/// The folder in which servers and clients run, whose `config/iceoryx2.toml` gives them their own iceoryx2.
pub struct Machine {
    folder: TempDir,
    prefix: String,
}

impl Machine {
    pub fn new() -> Self {
        let (folder, prefix) =
            (TempDir::new().expect("a folder"), format!("hostile_{}_", std::process::id()));
        let root = folder.path().join("root/");
        let settings = format!("[global]\nroot-path = \"{}\"\nprefix = \"{prefix}\"\n", root.display());
        std::fs::create_dir(folder.path().join("config")).expect("a folder");
        std::fs::write(folder.path().join("config/iceoryx2.toml"), settings).expect("written");
        let settings = format!(
            "vehicles = \"{}\"\n[grpc]\nlisten = \"127.0.0.1:0\"\nunix_socket = \"{}\"\n[http]\nlisten = \"127.0.0.1:{}\"\n\
             [shm]\nnamespace = \"{NAMESPACE}\"\n",
            vehicles().display(),
            folder.path().join("wade.sock").display(),
            free_port(),
        );
        std::fs::write(folder.path().join("wade.toml"), settings).expect("written");
        std::env::set_current_dir(folder.path()).expect("there");
        Self { folder, prefix }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// What the names of this iceoryx2's files begin with.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The folder that stands for /tmp/iceoryx2.
    pub fn root(&self) -> PathBuf {
        self.path().join("root")
    }

    /// What lies in /dev/shm.
    pub fn segments(&self) -> Vec<PathBuf> {
        let all = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
        let ours = all.filter(|entry| entry.file_name().to_string_lossy().starts_with(&self.prefix));
        ours.map(|entry| entry.path()).collect()
    }

    /// Every file of this iceoryx2 but for the counter of nodes, which stays for ever.
    pub fn files(&self) -> BTreeSet<String> {
        let mut folders = vec![self.root()];
        let mut files: Vec<PathBuf> = self.segments();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                if entry.path().is_dir() { folders.push(entry.path()) } else { files.push(entry.path()) }
            }
        }
        let names = files.into_iter().map(|file| file.display().to_string());
        names.filter(|name| !name.ends_with(".global_mgmt")).collect()
    }

    fn address(&self) -> std::net::SocketAddr {
        let settings = std::fs::read_to_string(self.path().join("wade.toml")).expect("written");
        let listen = settings.rsplit_once("[http]\nlisten = \"").expect("an address").1;
        listen.split('"').next().and_then(|address| address.parse().ok()).expect("an address")
    }

    /// A server behind these words of a command line, such as a shell that limits it.
    pub fn start_by(&self, words: &[&str]) -> Server {
        self.launch("wade.toml", words)
    }

    /// The same with more settings.
    pub fn start_with(&self, settings: &str, words: &[&str]) -> Server {
        let usual = std::fs::read_to_string(self.path().join("wade.toml")).expect("written");
        std::fs::write(self.path().join("more.toml"), usual + settings).expect("written");
        self.launch("more.toml", words)
    }

    fn launch(&self, settings: &str, words: &[&str]) -> Server {
        let words: Vec<&str> = words.iter().copied().chain([env!("CARGO_BIN_EXE_wade")]).collect();
        let mut command = Command::new(words[0]);
        let log = std::fs::File::create(self.path().join("log")).expect("a file");
        command.args(&words[1..]).args(["serve", "--config", settings]).current_dir(self.path());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
        let (start, address) = (Instant::now(), self.address());
        let process = command.spawn().expect("the server starts");
        Server { process, address, start, log: self.path().join("log") }
    }

    pub fn start(&self) -> Server {
        self.start_by(&[])
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        for file in self.segments() {
            let _ = std::fs::remove_file(file);
        }
    }
}

fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("an address").port()
}

pub struct Server {
    pub process: Child,
    address: std::net::SocketAddr,
    start: Instant,
    log: PathBuf,
}

impl Server {
    pub fn pid(&self) -> Pid {
        Pid::from_raw(self.process.id().cast_signed())
    }

    /// The process that serves shared memory.
    pub fn worker(&self) -> Option<Pid> {
        let pid = self.process.id();
        let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).ok()?;
        let children = tasks
            .flatten()
            .map(|task| std::fs::read_to_string(task.path().join("children")).unwrap_or_default());
        let all = children.collect::<Vec<_>>().join(" ");
        all.split_whitespace().next()?.parse().ok().map(Pid::from_raw)
    }

    /// Resident memory of the server [kB].
    pub fn memory(&self) -> usize {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id())).expect("alive");
        let line =
            status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a process with memory");
        line.trim().trim_end_matches(" kB").parse().expect("a number")
    }

    /// Open descriptors of the server.
    pub fn descriptors(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.process.id())).expect("alive").count()
    }

    pub fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Status and body of /readyz; none where nobody answers.
    pub fn readyz(&self) -> Option<(u16, String)> {
        let mut stream = TcpStream::connect(self.address).ok()?;
        stream.set_read_timeout(Some(PATIENCE)).ok()?;
        stream.write_all(b"GET /readyz HTTP/1.0\r\nHost: localhost\r\n\r\n").ok()?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).ok()?;
        let (head, body) = answer.split_once("\r\n\r\n")?;
        Some((head.split(' ').nth(1)?.parse().ok()?, body.to_owned()))
    }

    /// Waits until /readyz says 200 and its body says this; the time since the start.
    pub fn until(&mut self, says: &str) -> Duration {
        let begin = Instant::now();
        loop {
            let found = self.readyz();
            if found.as_ref().is_some_and(|(status, body)| *status == 200 && body.contains(says)) {
                return self.start.elapsed();
            }
            let ended = self.process.try_wait().expect("asked");
            assert!(ended.is_none(), "the server ended: {ended:?}\n{}", self.log());
            assert!(begin.elapsed() < PATIENCE, "never said {says}: {found:?}\n{}", self.log());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Ready, whatever becomes of shared memory.
    pub fn until_ready(&mut self) -> Duration {
        self.until("\"ready\":true")
    }

    pub fn until_shm(&mut self) -> Duration {
        self.until("\"shared_memory\":\"ok\"")
    }

    /// Ends it by a signal that asks, and says how it ended.
    pub fn end(mut self) -> std::process::ExitStatus {
        kill(self.pid(), Signal::SIGTERM).expect("sent");
        let start = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().expect("asked") {
                return status;
            }
            assert!(start.elapsed() < PATIENCE, "it does not end\n{}", self.log());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Ends it where it has not ended by itself.
    pub fn kill_if_alive(mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }

    /// Ends it as nothing can prepare for.
    pub fn kill(mut self) {
        self.process.kill().expect("killed");
        let status = self.process.wait().expect("reaped");
        assert!(status.signal().is_some(), "{status:?}");
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
