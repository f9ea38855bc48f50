//! Promise: the log of a start says in short, plain lines what runs, with which settings, and where it answers.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Longest wait for a server to be ready.
const START: Duration = Duration::from_secs(60);
/// Widest line of the log of a start, but for paths, which are as long as they are.
const WIDTH: usize = 110;

/// Any free port.
const FREE: &str = "127.0.0.1:0";

/// A command that serves in a place of its own, on these addresses of gRPC and HTTP.
fn serve_on(place: &TempDir, [grpc, http]: [&str; 2]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    let socket = place.path().join("wade.sock");
    command.args(["serve", "--with-parent", "--shm", "off", "--listen", grpc, "--http", http]);
    command.arg("--unix-socket").arg(socket).arg("--vehicles").arg(crate::common::vehicles());
    command.env_remove("WADE_LOG").env_remove("WADE_CONFIG");
    command
}

fn serve(place: &TempDir) -> Command {
    serve_on(place, [FREE; 2])
}

/// What a server writes until it is ready, or until it ends.
fn log_of_start(mut child: Child, place: &TempDir) -> String {
    let (file, begun) = (place.path().join("log"), Instant::now());
    let read = || std::fs::read_to_string(&file).unwrap_or_default();
    while !read().contains("ready in") && begun.elapsed() < START {
        if child.try_wait().expect("a child").is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = child.kill();
    child.wait().expect("a child");
    read()
}

#[test]
fn the_log_of_a_start_is_plain_short_and_complete() {
    let place = TempDir::new().expect("a folder");
    let log = std::fs::File::create(place.path().join("log")).expect("a file");
    let child = serve(&place).stderr(log).stdout(Stdio::null()).spawn().expect("the program runs");
    let log = log_of_start(child, &place);
    assert!(!log.contains('\u{1b}'), "no colors in a file: {log}");
    let vehicles = std::path::absolute(crate::common::vehicles()).expect("a path");
    let socket = place.path().join("wade.sock");
    for part in [
        env!("CARGO_PKG_VERSION"),
        "commit=",
        "settings: the defaults",
        &vehicles.display().to_string(),
        &format!("unix:{}", socket.display()),
        "shared memory: off",
        "page at http://127.0.0.1:",
        "husky",
        "ready in ",
    ] {
        assert!(log.contains(part), "{part} is missing:\n{log}");
    }
    let paths = vehicles.as_os_str().len();
    for line in log.lines() {
        assert!(line.chars().count() <= WIDTH + paths, "too long: {line}");
    }
}

#[test]
fn a_terminal_gets_colors_unless_it_wants_none() {
    for (no_color, colored) in [(None, true), (Some(""), true), (Some("1"), false)] {
        let place = TempDir::new().expect("a folder");
        let command = serve(&place);
        let words: Vec<String> = std::iter::once(command.get_program())
            .chain(command.get_args())
            .map(|word| format!("'{}'", word.to_str().expect("UTF-8")))
            .collect();
        // script gives the program a terminal; the server ends with it
        let mut script = Command::new("script");
        script.args(["--quiet", "--flush", "--return", "--command", &format!("exec {}", words.join(" "))]);
        script.arg(place.path().join("log")).env_remove("NO_COLOR");
        if let Some(value) = no_color {
            script.env("NO_COLOR", value);
        }
        let child =
            script.stdin(Stdio::null()).stdout(Stdio::null()).spawn().expect("script of util-linux runs");
        let log = log_of_start(child, &place);
        assert!(log.contains("ready in"), "{log}");
        assert_eq!(log.contains('\u{1b}'), colored, "NO_COLOR = {no_color:?}: {log}");
    }
}

#[test]
fn a_second_server_hears_who_has_the_address_and_the_way_out() {
    let place = TempDir::new().expect("a folder");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let taken_at = taken.local_addr().expect("an address").to_string();
    for (addresses, flag, key) in
        [([&taken_at, FREE], "--listen", "grpc.listen"), ([FREE, &taken_at], "--http", "http.listen")]
    {
        let mut command = serve_on(&place, addresses);
        command.stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program runs");
        let mut text = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut text).expect("text");
        assert_eq!(child.wait().expect("a child").code(), Some(1));
        for part in [&taken_at as &str, flag, key, &std::process::id().to_string()] {
            assert!(text.contains(part), "{part} is missing: {text}");
        }
    }
}
