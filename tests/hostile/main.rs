//! Promise: whatever was killed, lost, full or overwritten, gRPC and HTTP are served, shared memory comes back or says why it
//! does not, and nothing is left behind.
//!
//! `WADE_HOSTILE_SECONDS` sets how long the random parts take together, `WADE_HOSTILE_SEED` repeats a run. One test alone: the
//! tracer waits for any child.

#[path = "../common/mod.rs"]
mod common;
mod machine;
mod trace;

use std::collections::BTreeSet;
use std::io::{BufRead, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use common::{Numbers, PATIENCE};
use machine::{Machine, NAMESPACE};
use nix::sys::signal::{Signal, kill};

/// How long the random parts take, in a run that says nothing else [s].
const SECONDS: f32 = 40.0;

/// How much more a server may have after it was harassed: memory that the allocator keeps [kB], connections of a moment.
const MORE_MEMORY: usize = 20_000;
const MORE_DESCRIPTORS: usize = 8;

fn setting<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
}

#[test]
fn a_server_starts_and_goes_on_whatever_is_done_to_it() {
    let seed: u64 = setting("WADE_HOSTILE_SEED", 31);
    let seconds: f32 = setting("WADE_HOSTILE_SECONDS", SECONDS);
    println!("seed {seed}, {seconds} s (WADE_HOSTILE_SEED, WADE_HOSTILE_SECONDS)");
    let mut numbers = Numbers::new(seed);
    let machine = Machine::new();
    let baseline = at_rest(&machine, Duration::ZERO);
    signalled(&machine);
    watched(&machine);
    lost(&machine);
    limited(&machine);
    full(&machine);
    foreign(&machine);
    terminated_under_clients(&machine);
    orphaned(&machine);
    until_back(&machine, &baseline);
    let part = Duration::from_secs_f32(seconds / 2.0);
    killed_at_system_calls(&machine, &mut numbers, part);
    until_back(&machine, &baseline);
    garbage(&machine, &mut numbers, part);
    until_back(&machine, &baseline);
}

/// Waits until servers that start and end leave no more than the first did: what the dead left is cleared beside the serving,
/// and a server that is given more time comes further.
fn until_back(machine: &Machine, baseline: &BTreeSet<String>) {
    let start = Instant::now();
    let mut lives = Duration::from_millis(100);
    loop {
        let files = at_rest(machine, lives);
        lives *= 2;
        if files == *baseline {
            return println!("files are back where they were after {:?}", start.elapsed());
        }
        assert!(start.elapsed() < PATIENCE, "left: {:?}", files.difference(baseline).collect::<Vec<_>>());
    }
}

/// What lies about after a server that was started, asked and, after it has lived this long more, ended.
fn at_rest(machine: &Machine, lives: Duration) -> BTreeSet<String> {
    let mut server = machine.start();
    server.until_shm();
    ask(machine);
    std::thread::sleep(lives);
    assert!(server.end().success());
    machine.files()
}

/// Signals that ask for something other than an end, a second server, and a server that needs shared memory.
fn signalled(machine: &Machine) {
    let mut server = machine.start();
    server.until_shm();
    for (signal, says) in
        [(Signal::SIGUSR1, "status"), (Signal::SIGUSR2, "status"), (Signal::SIGHUP, "serves")]
    {
        let before = server.log().matches(says).count();
        kill(server.pid(), signal).expect("sent");
        let start = Instant::now();
        while server.log().matches(says).count() == before {
            assert!(start.elapsed() < PATIENCE, "{signal}: {}", server.log());
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    let mut second = Command::new(env!("CARGO_BIN_EXE_wade"));
    second.args([
        "serve",
        "--config",
        "wade.toml",
        "--listen",
        "127.0.0.1:0",
        "--unix-socket",
        "",
        "--http",
        "",
    ]);
    let mut second = second.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("a second server");
    let mut log = std::io::BufReader::new(second.stderr.take().expect("piped")).lines().map_while(Result::ok);
    let explained = format!("another server, process {}, serves the namespace", server.pid());
    assert!(log.any(|line| line.contains(&explained) && line.contains("--namespace")));
    kill(nix::unistd::Pid::from_raw(second.id().cast_signed()), Signal::SIGTERM).expect("sent");
    assert!(second.wait().expect("reaped").success(), "the second serves the rest until it is ended");
    kill(server.pid(), Signal::SIGQUIT).expect("sent");
    assert!(server.process.wait().expect("reaped").success(), "SIGQUIT drains");

    let required = "[ready]\nrequire = [\"grpc\", \"shm\"]\n";
    let server = machine.start_with(required, &["sh", "-c", "ulimit -n 64; exec \"$0\" \"$@\""]);
    let start = Instant::now();
    while !server.readyz().is_some_and(|(status, body)| status == 503 && body.contains("file descriptors")) {
        assert!(start.elapsed() < PATIENCE, "{:?}", server.readyz());
    }
    assert!(server.end().success());
}

/// What a service manager hears, and a process of shared memory that hangs.
fn watched(machine: &Machine) {
    let path = machine.path().join("notify");
    let socket = std::os::unix::net::UnixDatagram::bind(&path).expect("a socket");
    // read all the time, as a service manager does: a full socket would hold the server up
    let heard = Arc::new(Mutex::new(String::new()));
    let hearing = Arc::clone(&heard);
    std::thread::spawn(move || {
        let mut message = [0; 256];
        while let Ok(length) = socket.recv(&mut message) {
            *hearing.lock().expect("no panic") += &String::from_utf8_lossy(&message[..length]);
        }
    });
    let hears = |says: &str| {
        let start = Instant::now();
        while !std::mem::take(&mut *heard.lock().expect("no panic")).contains(says) {
            assert!(start.elapsed() < PATIENCE, "never heard {says}");
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    let notify = format!("NOTIFY_SOCKET={}", path.display());
    let mut server = machine.start_by(&["env", &notify, "WATCHDOG_USEC=20000000"]);
    hears("WATCHDOG=1");
    server.until_shm();
    let hanging = server.worker().expect("a process of shared memory");
    kill(hanging, Signal::SIGSTOP).expect("sent");
    let start = Instant::now();
    while server.worker().is_none_or(|worker| worker == hanging) {
        assert!(start.elapsed() < PATIENCE, "it is replaced\n{}", server.log());
        std::thread::sleep(Duration::from_millis(20));
    }
    server.until_shm();
    hears("WATCHDOG=1");
    println!("a process of shared memory that hangs was replaced after {:?}", start.elapsed());
    assert!(server.end().success());
    hears("STOPPING=1");
}

/// A client in a process of its own: a damaged segment may end it, but not the test.
fn asked(machine: &Machine) -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(["query", "--vehicle", "husky", "--speed", "0.5", "--depth", "0.15", "--transport", "shm"]);
    command.args(["--namespace", NAMESPACE]).current_dir(machine.path());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn ask(machine: &Machine) {
    let start = Instant::now();
    while !asked(machine) {
        assert!(start.elapsed() < PATIENCE, "shared memory does not answer");
    }
}

/// The server is killed, and what it had in memory or on disk is gone.
fn lost(machine: &Machine) {
    for what in ["/dev/shm", "/tmp/iceoryx2", "unfinished services", "nothing"] {
        let mut server = machine.start();
        server.until_shm();
        server.kill();
        match what {
            "/dev/shm" => machine.segments().iter().for_each(|file| remove(file)),
            "/tmp/iceoryx2" => std::fs::remove_dir_all(machine.root()).expect("removed"),
            "unfinished services" => {
                for service in std::fs::read_dir(machine.root().join("services")).expect("there").flatten() {
                    set_mode(&service.path(), 0o600);
                }
            }
            _ => {}
        }
        let mut server = machine.start();
        let ready = server.until_ready();
        let shm = server.until_shm();
        ask(machine);
        println!("killed, {what} lost: ready after {ready:?}, shared memory after {shm:?}");
        // the same under a server that lives
        let parent = server.pid();
        if what != "nothing" {
            machine.segments().iter().for_each(|file| remove(file));
            let _ = std::fs::remove_dir_all(machine.root());
            ask(machine);
            server.until_shm();
        }
        assert_eq!(parent, server.pid());
        assert!(server.end().success(), "{what}");
    }
}

fn remove(file: &Path) {
    // another process may have been quicker
    let _ = std::fs::remove_file(file);
}

fn set_mode(file: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(file, std::fs::Permissions::from_mode(mode)).expect("changed");
}

/// Limits of descriptors, locked memory and address space.
fn limited(machine: &Machine) {
    let mut server = machine.start_by(&["sh", "-c", "ulimit -n 64; exec \"$0\" \"$@\""]);
    let ready = server.until_ready();
    server.until("file descriptors");
    println!("64 descriptors: ready after {ready:?}, and the reason names them");
    assert!(server.end().success());
    // too few to serve everybody with: who asks for /readyz is answered in his turn
    for descriptors in [36, 38, 40, 42, 44] {
        let limit = format!("ulimit -n {descriptors}; exec \"$0\" \"$@\"");
        let mut server = machine.start_by(&["sh", "-c", &limit]);
        let start = Instant::now();
        while server.readyz().is_none() && server.process.try_wait().expect("asked").is_none() {
            assert!(start.elapsed() < PATIENCE, "{descriptors} descriptors: {}", server.log());
            std::thread::sleep(Duration::from_millis(5));
        }
        server.kill_if_alive();
    }

    let mut server = machine.start_by(&["sh", "-c", "ulimit -l 0; exec \"$0\" \"$@\""]);
    server.until_shm();
    assert!(server.end().success());

    // too little for anything, enough for gRPC, enough for all
    for megabytes in [20, 60, 120, 200, 400] {
        let limit = format!("ulimit -v {}; exec \"$0\" \"$@\"", megabytes * 1024);
        let mut server = machine.start_by(&["sh", "-c", &limit]);
        let start = Instant::now();
        let mut outcome = "neither ready nor ended".to_owned();
        while start.elapsed() < Duration::from_secs(3) {
            if let Some(status) = server.process.try_wait().expect("asked") {
                outcome = format!("ended: {status}");
                break;
            }
            if let Some((200, body)) = server.readyz() {
                outcome = body;
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        println!("{megabytes} MB of address space: {}", outcome.trim());
        server.kill_if_alive();
        let mut next = machine.start();
        next.until_ready();
        next.until_shm();
        assert!(next.end().success(), "the next start serves");
    }
}

/// A /dev/shm without room: the server says so, serves the rest, and takes up shared memory when there is room.
fn full(machine: &Machine) {
    if !nix::unistd::geteuid().is_root() {
        return println!("skipped: a full /dev/shm needs root for a mount of its own");
    }
    let mount = "mount -t tmpfs -o size=64k tmpfs /dev/shm && exec \"$0\" \"$@\"";
    let mut server = machine.start_by(&["unshare", "-m", "sh", "-c", mount]);
    let ready = server.until_ready();
    server.until("kB free");
    println!("/dev/shm of 64 kB: ready after {ready:?}, and the reason is its room");
    let enlarge = ["-m", "-t"].map(str::to_owned);
    let status = Command::new("nsenter")
        .args(&enlarge[1..])
        .arg(server.process.id().to_string())
        .args(&enlarge[..1])
        .args(["mount", "-o", "remount,size=64m", "/dev/shm"])
        .status();
    if status.is_ok_and(|status| status.success()) {
        server.until_shm();
        println!("enlarged: shared memory is served");
    } else {
        println!("skipped: nsenter cannot enlarge it here");
    }
    assert!(server.end().success());
}

/// Files and folders of another user.
fn foreign(machine: &Machine) {
    if !nix::unistd::geteuid().is_root() {
        return println!("skipped: another user's files need root");
    }
    // nobody may see the folder of the test, but may change nothing in that of iceoryx2
    set_mode(machine.path(), 0o777);
    set_mode(&machine.root(), 0o755);
    let nobody = "exec setpriv --reuid 65534 --regid 65534 --clear-groups \"$0\" \"$@\"";
    let mut server = machine.start_by(&["sh", "-c", nobody]);
    let start = Instant::now();
    while server.readyz().is_none() && server.process.try_wait().expect("asked").is_none() {
        assert!(start.elapsed() < PATIENCE, "{}", server.log());
        std::thread::sleep(Duration::from_millis(10));
    }
    if server.process.try_wait().expect("asked").is_some() {
        println!("skipped: another user cannot run this program here: {}", server.log().trim());
    } else {
        let ready = server.until_ready();
        server.until("belongs to the user with the number 0");
        println!("/tmp/iceoryx2 of another user: ready after {ready:?}, {:?}", server.readyz());
        assert!(server.end().success());
    }
    remove(&machine.path().join("wade.sock"));
}

/// Answers a line for each line, by a client that it keeps.
const PYTHON: &str = "
import sys, time, wade
client = wade.ShmClient('hostile', timeout_s=0.2)
for line in sys.stdin:
    while True:
        try:
            client.evaluate('husky', wade.State(depth_m=0.15))
            break
        except wade.WadeError:
            time.sleep(0.001)
    print('answered', flush=True)
";

/// A Python process with a client; none, with a printed reason, where the package or what it needs is not here.
fn python(machine: &Machine) -> Option<Child> {
    let program = std::env::var("WADE_PYTHON").unwrap_or_else(|_| "python3".into());
    let package = concat!(env!("CARGO_MANIFEST_DIR"), "/clients/python/src");
    let run = |script: &str| {
        let mut command = Command::new(&program);
        command.args(["-c", script]).env("PYTHONPATH", package).current_dir(machine.path());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        command.spawn().ok()
    };
    if !run("import wade, iceoryx2")
        .is_some_and(|mut child| child.wait().is_ok_and(|status| status.success()))
    {
        println!("skipped: {program} (WADE_PYTHON) cannot import wade and iceoryx2");
        return None;
    }
    run(PYTHON)
}

/// Clients live through restarts of their server by SIGTERM.
fn terminated_under_clients(machine: &Machine) {
    use wade_client::ShmClient;
    use wade_wire::shm::Wait;
    let mut clients = [Wait::Block, Wait::Spin]
        .map(|wait| ShmClient::new("husky", wait, Duration::from_millis(200)).in_namespace(NAMESPACE));
    let state = wade_wire::State { depth: 0.15, ..Default::default() };
    let mut python = python(machine);
    for _ in 0..3 {
        let mut server = machine.start();
        server.until_shm();
        if let Some(python) = &mut python {
            let (input, output) =
                (python.stdin.as_mut().expect("piped"), python.stdout.as_mut().expect("piped"));
            input.write_all(b"\n").expect("Python lives");
            let mut line = [0; 9];
            output.read_exact(&mut line).expect("Python lives and is answered");
        }
        for client in &mut clients {
            let start = Instant::now();
            while client.evaluate(&state).is_err() {
                assert!(start.elapsed() < PATIENCE, "a living client finds the next server");
            }
        }
        assert!(server.end().success());
    }
    if let Some(mut python) = python {
        drop(python.stdin.take());
        assert!(python.wait().expect("reaped").success());
    }
}

/// A listener and a segment of a process that is dead and has no node, as a kill in the middle of iceoryx2's clearing leaves.
fn orphaned(machine: &Machine) {
    let mut process = Command::new("true").spawn().expect("started");
    let number = u128::from(process.id()) << 64 | 1;
    assert!(process.wait().expect("reaped").success());
    for (folder, end) in [(machine.root(), "event"), ("/dev/shm".into(), "data")] {
        std::fs::write(folder.join(format!("{}{number}.{end}", machine.prefix())), []).expect("written");
    }
}

/// Kills the server where the process of shared memory makes one system call or another: while it starts, while a client
/// opens, and while it closes.
fn killed_at_system_calls(machine: &Machine, numbers: &mut Numbers, part: Duration) {
    let begin = Instant::now();
    let (mut rounds, mut slowest, mut late) = (0_u32, Duration::ZERO, 0_u32);
    // how many calls each phase makes, learnt as it goes
    let mut most = [4000.0_f32, 400.0, 1500.0];
    while begin.elapsed() < part || rounds < 3 {
        let phase = rounds as usize % 3;
        let number = numbers.between(1.0, most[phase]) as u64;
        let mut server = machine.start();
        let mut client = None;
        if phase == 0 {
            trace::follow(&trace::threads(server.pid()));
        } else {
            server.until_shm();
            let worker = server.worker().expect("a process of shared memory");
            trace::follow(&trace::threads(worker));
            if phase == 1 {
                let namespace = ["--namespace", NAMESPACE, "--transport", "shm", "--vehicle", "husky"];
                let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
                command.arg("query").args(namespace).args(["--speed", "0.5", "--depth", "0.15"]);
                command.current_dir(machine.path()).stdout(Stdio::null()).stderr(Stdio::null());
                client = Some(command.spawn().expect("a client"));
            } else {
                kill(server.pid(), Signal::SIGTERM).expect("sent");
            }
        }
        let made = trace::kill_at(&server, number);
        if made < number {
            most[phase] = most[phase].min(made.max(10) as f32);
        }
        drop(server);
        if let Some(mut client) = client {
            let _ = client.kill();
            let _ = client.wait();
        }
        let mut server = machine.start();
        let ready = server.until_ready();
        let shm = server.until_shm();
        late += u32::from(ready > Duration::from_secs(1));
        slowest = slowest.max(shm);
        if !asked(machine) {
            ask(machine);
        }
        assert!(server.end().success(), "round {rounds}, phase {phase}, call {made}");
        rounds += 1;
    }
    println!(
        "killed at {rounds} system calls (up to {most:?} in start, open, close): {late} starts were ready after more than a \
         second, shared memory at the latest after {slowest:?}"
    );
}

/// Random bytes in the segments of a server that serves a client.
fn garbage(machine: &Machine, numbers: &mut Numbers, part: Duration) {
    let begin = Instant::now();
    let mut server = machine.start();
    server.until_shm();
    let (mut rounds, mut ended, mut outages) = (0_u32, 0_u32, Vec::new());
    let before = [server.memory(), server.descriptors()];
    while begin.elapsed() < part || rounds < 3 {
        ask(machine);
        let worker = server.worker();
        for file in machine.segments() {
            let Ok(length) = file.metadata().map(|metadata| metadata.len()) else { continue };
            let Ok(mut segment) = std::fs::File::options().write(true).open(&file) else { continue };
            for _ in 0..16 {
                let bytes: Vec<u8> = (0..64).map(|_| numbers.between(0.0, 256.0) as u8).collect();
                let at = (f64::from(numbers.between(0.0, 1.0)) * length.min(1 << 16) as f64) as u64;
                let written = segment.seek(SeekFrom::Start(at)).and_then(|_| {
                    segment.write_all(&bytes[..bytes.len().min((length - at.min(length)) as usize)])
                });
                written.expect("written");
            }
        }
        let start = Instant::now();
        let alive = server.readyz().map(|(status, _)| status);
        assert_eq!(alive, Some(200), "round {rounds}: gRPC and HTTP go on\n{}", server.log());
        // a question that is answered, or a process that is started again
        loop {
            if asked(machine) {
                break;
            }
            assert!(
                start.elapsed() < 2 * PATIENCE,
                "round {rounds}: {:?}\n{}",
                server.readyz(),
                server.log()
            );
        }
        server.until_shm();
        outages.push(start.elapsed());
        ended += u32::from(server.worker() != worker);
        rounds += 1;
    }
    outages.sort();
    let (median, slowest) = (outages[outages.len() / 2], outages.last().copied().unwrap_or_default());
    println!(
        "{rounds} rounds of garbage: the server lived, the process of shared memory was replaced in {ended}, a new client had \
         its answer after {median:?} in half of them and {slowest:?} at the latest"
    );
    let after = [server.memory(), server.descriptors()];
    println!("memory [kB] and descriptors of the server: {before:?} before, {after:?} after");
    assert!(after[0] < before[0] + MORE_MEMORY && after[1] < before[1] + MORE_DESCRIPTORS);
    assert!(server.end().success());
    // the clients died of the garbage too, and what they left is damaged: iceoryx2 cannot tell whose it was
    for file in machine.segments() {
        if !file.to_string_lossy().ends_with(".global_mgmt") {
            remove(&file);
        }
    }
    let _ = std::fs::remove_dir_all(machine.root());
}
