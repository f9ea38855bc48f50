//! Promise: a client that gets no answer over shared memory says why, by asking for the one server it wants: what others left
//! behind that were killed is neither gone through nor cleared away. That is a server's work, and no start waits for it.

mod common;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use common::PATIENCE;
use common::process::{Process, state, until_answered};
use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{AttributeSpecifier, MessagingPattern, Service as _, ipc};
use tempfile::TempDir;
use wade_client::{ClientError, ShmClient};
use wade_wire::shm::Wait;
use wade_wire::shm::layout::{Names, SERVED_LAYOUT, SERVED_VEHICLES};

/// From here on this process and its children have an iceoryx2 of their own, in which nobody else cleans up.
struct OwnIceoryx {
    folder: TempDir,
    prefix: String,
}

impl OwnIceoryx {
    fn new() -> Self {
        let (folder, prefix) =
            (TempDir::new().expect("a folder"), format!("remains_{}_", std::process::id()));
        let root = folder.path().join("root/");
        let settings = format!("[global]\nroot-path = \"{}\"\nprefix = \"{prefix}\"\n", root.display());
        std::fs::create_dir(folder.path().join("config")).expect("a folder");
        std::fs::write(folder.path().join("config/iceoryx2.toml"), settings).expect("written");
        std::env::set_current_dir(folder.path()).expect("there");
        assert_eq!(Config::global_config().global.prefix.to_string(), prefix);
        Self { folder, prefix }
    }

    /// What lies in the memory.
    fn files(&self) -> impl Iterator<Item = PathBuf> {
        let all = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
        let ours = all.filter(|entry| entry.file_name().to_string_lossy().starts_with(&self.prefix));
        ours.map(|entry| entry.path())
    }

    /// Servers that were answering, and were killed.
    fn leave_remains<const N: usize>(&self, namespaces: [&str; N]) {
        let servers = namespaces.map(|namespace| self.start(namespace));
        for namespace in namespaces {
            until_answered(&mut client("husky", namespace));
        }
        servers.into_iter().for_each(Process::kill);
    }

    /// What one leaves that is killed while it makes or clears away a node is not found by iceoryx2 any more.
    fn clears_what_no_list_has(&self, ends: &str) {
        let serve = || {
            let server = self.start("lake");
            // one that asks the dead one still has no answer
            let client = ShmClient::new("husky", Wait::Block, Duration::from_millis(200));
            until_answered(&mut client.in_namespace("lake"));
            server.terminate();
            self.nodes_and_memory()
        };
        let start = Instant::now();
        let (mut before, mut after) = (serve(), serve());
        while before != after {
            assert!(start.elapsed() < PATIENCE, "{:?}", before.symmetric_difference(&after));
            (before, after) = (after, serve());
        }
        self.leave_remains(["lake"]);
        let lost: Vec<_> = self.nodes_and_memory().into_iter().filter(|file| file.ends_with(ends)).collect();
        assert!(!lost.is_empty(), "no file ends with {ends}");
        lost.iter().for_each(|file| std::fs::remove_file(file).expect("removed"));
        let start = Instant::now();
        loop {
            let left = serve();
            if left == before {
                return println!("{ends} lost: answered, and cleared away, after {:?}", start.elapsed());
            }
            assert!(start.elapsed() < PATIENCE, "{ends} lost: {:?}", left.symmetric_difference(&before));
        }
    }

    /// Paths of all files and folders of nodes and services.
    fn nodes_and_memory(&self) -> BTreeSet<String> {
        let mut found: BTreeSet<String> = self.files().map(|file| file.display().to_string()).collect();
        let mut folders = vec![self.folder.path().join("root")];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                if entry.path().is_dir() {
                    folders.push(entry.path());
                }
                found.insert(entry.path().display().to_string());
            }
        }
        found
    }

    fn start(&self, namespace: &str) -> Process {
        let settings = self.folder.path().join(namespace);
        std::fs::create_dir_all(&settings).expect("a folder");
        Process::start(&settings, namespace, "block")
    }
}

impl Drop for OwnIceoryx {
    fn drop(&mut self) {
        for file in self.files() {
            let _ = std::fs::remove_file(file);
        }
    }
}

fn client(vehicle: &str, namespace: &str) -> ShmClient {
    ShmClient::new(vehicle, Wait::Block, PATIENCE).in_namespace(namespace)
}

fn error(vehicle: &str, namespace: &str) -> ClientError {
    client(vehicle, namespace).evaluate(&state()).expect_err("nobody answers")
}

fn is_there(namespace: &str) -> bool {
    let service = Names::new(namespace).evaluate("husky");
    let name = service.as_str().try_into().expect("a name");
    ipc::Service::does_exist(&name, Config::global_config(), MessagingPattern::RequestResponse).expect("told")
}

/// Tells whether they are there, until they are as expected or patience ends.
fn until_there<const N: usize>(namespaces: [&str; N], expected: [bool; N]) {
    let start = Instant::now();
    while namespaces.map(is_there) != expected && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(namespaces.map(is_there), expected);
}

/// A node that leaves the remains alone.
fn node() -> Node<ipc::Service> {
    let mut config = Config::global_config().clone();
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    NodeBuilder::new().config(&config).create().expect("a node")
}

#[test]
fn the_reason_is_right_among_the_remains_of_other_servers() {
    let own = OwnIceoryx::new();
    for ends in [".node_monitor", "node.details"] {
        own.clears_what_no_list_has(ends);
    }
    // names that begin as ours does, and the other way round
    let others = ["ford", "ford-2", "for", "bed"];
    own.leave_remains(others);

    let error_without_server = error("husky", "ford-1");
    assert!(matches!(error_without_server, ClientError::NoServer { .. }), "{error_without_server:?}");
    assert!(error_without_server.to_string().contains("is wade serve running"), "{error_without_server}");
    assert_eq!(others.map(is_there), [true; 4], "what others left is theirs");

    // a server of another layout
    let node = node();
    let attributes = AttributeSpecifier::new()
        .define(&SERVED_LAYOUT.try_into().expect("a key"), &"v9".try_into().expect("a value"))
        .and_then(|told| {
            told.define(&SERVED_VEHICLES.try_into().expect("a key"), &"husky".try_into().expect("a value"))
        })
        .expect("two attributes");
    let name = Names::new("ford-1").served().as_str().try_into().expect("a name");
    let foreign = node.service_builder(&name).event().create_with_attributes(&attributes).expect("created");
    let found = error("husky", "ford-1");
    assert!(matches!(&found, ClientError::Layout { found, .. } if found == "v9"), "{found:?}");
    drop((foreign, node));

    // one that was killed, asked for by name, is nobody, and is cleared away by whoever opens it
    let found = error("husky", "bed");
    assert!(matches!(found, ClientError::NoServer { .. }), "{found:?}");
    assert_eq!(others.map(is_there), [true, true, true, false]);

    // a server that serves others, which clears away the rest
    let server = own.start("ford-1");
    until_answered(&mut client("husky", "ford-1"));
    let found = error("nautilus", "ford-1");
    let ClientError::UnknownVehicle { served, .. } = &found else { panic!("{found:?}") };
    assert_eq!(served, &["husky", "warthog"]);
    until_there(others, [false; 4]);
    server.kill();

    // as after a loss of power: iceoryx2 waits half a second for each file to be finished by whoever began it, and longer than
    // anybody's patience for all
    own.leave_remains(others);
    let damaged: Vec<_> =
        own.files().filter(|file| file.extension().is_some_and(|it| it == "dynamic")).collect();
    assert!(damaged.len() >= 4 * others.len(), "{damaged:?}");
    for file in damaged {
        std::fs::write(file, "").expect("emptied");
    }
    let server = own.start("fort");
    until_answered(&mut client("husky", "fort"));
    server.kill();
}
