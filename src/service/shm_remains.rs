//! What servers and clients left in shared memory that were killed.
//!
//! What lies under the names of one namespace is put right before its services are opened, by the server that owns the
//! namespace: iceoryx2 waits for whoever began a service to finish it, for ever where that process is dead. The rest of the
//! machine is cleared beside the serving: iceoryx2 waits half a second for each damaged file, minutes where a machine lost
//! power again and again, so nobody's start waits for it.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, MessagingPattern, ServiceName, ipc};
use iceoryx2::service::Service;
use iceoryx2::service::service_hash::ServiceHash;

use wade_wire::shm::layout::Names;
use wade_wire::shm::{SHARED_MEMORY, config};

/// Longest time that a living client takes to finish a service that it has begun.
const FINISHING: Duration = Duration::from_millis(100);

/// What is known of the processes before this one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Remains {
    /// The last one crashed: nothing of the namespace is trusted.
    pub crashed: bool,
    /// Those that ended without giving back what they had.
    pub former: Vec<u32>,
}

/// The services of a namespace that serves these vehicles.
fn services<'n>(
    names: &Names,
    vehicles: impl Iterator<Item = &'n String>,
) -> Vec<(String, MessagingPattern)> {
    let events = [names.wake(), names.done(), names.served()];
    let mut services: Vec<_> = events.into_iter().map(|name| (name, MessagingPattern::Event)).collect();
    for vehicle in vehicles {
        for name in names.of_vehicle(vehicle) {
            services.push((name, MessagingPattern::RequestResponse));
        }
    }
    services
}

/// Puts the services of a namespace right, which this process owns: those that a dead process left unfinished are removed, or
/// that a broken node was in, and after a crash all of them, with everything else of the processes that crashed.
pub(super) fn prepare<'n>(names: &Names, vehicles: impl Iterator<Item = &'n String>, remains: &Remains) {
    let broken = broken_nodes();
    let mut removed = Vec::new();
    for (name, pattern) in services(names, vehicles) {
        let Some(file) = service_file(&name, pattern) else { continue };
        let is_left = remains.crashed || broken.iter().any(|node| node.services.contains(&file));
        if is_unfinished(&file) || (is_left && file.exists()) {
            remove_service(&file);
            removed.push(name);
        }
    }
    remove_nodes(broken);
    if !removed.is_empty() {
        tracing::info!(services = removed.join(" "), "removed what a process left that was killed");
    }
    if remains.crashed {
        for process in &remains.former {
            remove_files_of(*process);
        }
    }
}

/// Removes a service that cannot be opened.
pub(super) fn remove(name: &str, pattern: MessagingPattern) {
    if let Some(file) = service_file(name, pattern) {
        remove_service(&file);
    }
}

/// Removes the counter of nodes, which every process of this machine makes where it is missing. One that a process began and
/// did not finish keeps every node from being created.
pub(super) fn remove_node_counter() {
    for file in files_in(Path::new(SHARED_MEMORY)) {
        if file.to_string_lossy().ends_with(".global_mgmt") {
            let _ = fs::remove_file(file);
        }
    }
}

/// The file that says what a service is; the others are found by it.
pub(super) fn service_file(name: &str, pattern: MessagingPattern) -> Option<PathBuf> {
    let name: ServiceName = name.try_into().ok()?;
    let hash = ServiceHash::new::<<ipc::Service as Service>::ServiceNameHasher>(&name, pattern);
    let global = &Config::global_config().global;
    let file = format!("{}{hash}{}", global.prefix, global.service.static_config_storage_suffix);
    Some(services_folder().join(file))
}

/// Whether a service was begun and never finished: its file is still writable, or the memory that it names is not there.
fn is_unfinished(file: &Path) -> bool {
    let state = || {
        let Ok(metadata) = fs::symlink_metadata(file) else { return false };
        metadata.permissions().mode() & 0o200 != 0
            || fs::read_to_string(file).is_ok_and(|text| id_in(&text).is_none_or(|id| segment(id).is_none()))
    };
    if !state() {
        return false;
    }
    std::thread::sleep(FINISHING);
    state()
}

/// Number of a service, as its file has it.
fn id_in(text: &str) -> Option<u128> {
    let value = |key: &str| {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(key))?;
        line.trim_start().strip_prefix('=')?.trim().parse::<u64>().ok()
    };
    Some(u128::from(value("unique_value")?) << 64 | u128::from(value("payload_value")?))
}

/// The memory that a service of this number keeps its ports in.
fn segment(id: u128) -> Option<PathBuf> {
    let end = format!("_{id}{}", Config::global_config().global.service.dynamic_config_storage_suffix);
    files_in(Path::new(SHARED_MEMORY)).find(|file| file.to_string_lossy().ends_with(&end))
}

fn remove_service(file: &Path) {
    let id = fs::read_to_string(file).ok().and_then(|text| id_in(&text));
    if let Some(segment) = id.and_then(segment) {
        let _ = fs::remove_file(segment);
    }
    if let Err(error) = fs::remove_file(file)
        && error.kind() != std::io::ErrorKind::NotFound
    {
        tracing::warn!(file = %file.display(), %error, "a service that is unfinished cannot be removed");
    }
}

/// Removes what iceoryx2 finds by a port or a service, and so not where a process was killed before it had told anybody of it:
/// segments that a dead process answered in, its connections with itself, its listeners, and the memory of services that no
/// file names.
pub(crate) fn remove_untold_of(process: u32) {
    let global = &Config::global_config().global;
    let named: Vec<u128> =
        files_in(&services_folder()).filter_map(|file| id_in(&fs::read_to_string(file).ok()?)).collect();
    let of = |suffix: &str, name: &str| name.strip_suffix(suffix).map(numbers_in);
    let [segment, connection, listener, service] = [
        &global.service.data_segment_suffix,
        &global.service.connection_suffix,
        &global.service.event_connection_suffix,
        &global.service.dynamic_config_storage_suffix,
    ]
    .map(ToString::to_string);
    remove_where(process, |name| {
        name.ends_with(&segment)
            || name.trim_end_matches("_mgmt").ends_with(&listener)
            || of(&connection, name).is_some_and(|ends| ends.iter().all(|end| process_of(*end) == process))
            || of(&service, name).is_some_and(|ids| ids.iter().all(|id| !named.contains(id)))
    });
}

/// Removes whatever bears the number of a process that is dead: segments, connections, nodes.
fn remove_files_of(process: u32) {
    remove_where(process, |_| true);
}

/// The numbers in a name that are iceoryx2's: the upper half is that of a process and a counter.
fn numbers_in(name: &str) -> Vec<u128> {
    let numbers = name.split(|c: char| !c.is_ascii_digit()).filter_map(|number| number.parse().ok());
    numbers.filter(|number| *number > u128::from(u64::MAX)).collect()
}

fn process_of(number: u128) -> u32 {
    (number >> 64) as u32
}

/// Whether a process is dead, which one is too that nobody has waited for.
fn is_gone(process: u32) -> bool {
    let Ok(stat) = fs::read_to_string(format!("/proc/{process}/stat")) else { return true };
    // the state follows the name, which may hold anything
    stat.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with(['Z', 'X']))
}

fn remove_where(process: u32, chosen: impl Fn(&str) -> bool) {
    if !is_gone(process) {
        // the number is another's by now
        return;
    }
    let global = &Config::global_config().global;
    let root = PathBuf::from(global.root_path().to_string());
    let nodes = nodes_folder();
    let prefix = global.prefix.to_string();
    for folder in [Path::new(SHARED_MEMORY), &root, &nodes] {
        for file in files_in(folder) {
            let name = name_of(&file);
            if numbers_in(&name).iter().all(|number| process_of(*number) != process)
                || !chosen(&name)
                || !(name.starts_with(&prefix) || folder == nodes)
            {
                continue;
            }
            let _ = if file.is_dir() { fs::remove_dir_all(&file) } else { fs::remove_file(&file) };
        }
    }
}

fn files_in(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// The files of services as they were when the services were opened.
#[derive(Debug, Clone, Default)]
pub(crate) struct ServiceFiles(std::sync::Arc<std::sync::Mutex<Vec<(PathBuf, Identity)>>>);

/// Device and number of a file.
type Identity = (u64, u64);

fn identity(file: &Path) -> Option<Identity> {
    fs::symlink_metadata(file).ok().map(|metadata| (metadata.dev(), metadata.ino()))
}

impl ServiceFiles {
    /// Remembers the file of a service that is open.
    pub(super) fn add(&self, name: &str, pattern: MessagingPattern) {
        let known = service_file(name, pattern).and_then(|file| Some((identity(&file)?, file)));
        if let Some((identity, file)) = known {
            self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((file, identity));
        }
    }

    /// Whether a client that opens these services finds the ones that are served.
    pub(crate) fn are_in_place(&self) -> bool {
        let files = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        files.iter().all(|(file, before)| identity(file) == Some(*before))
    }
}

/// A node of a dead process.
struct DeadNode {
    id: u128,
    /// Files of the services that it was in.
    services: Vec<PathBuf>,
}

impl DeadNode {
    fn is_in_no_service(&self) -> bool {
        self.services.iter().all(|service| !service.exists())
    }
}

/// Dead nodes without monitor or details, as one leaves that was killed while it made or cleared a node. iceoryx2 does not find
/// them, or gives up on them, and takes a second for each service that they were in.
fn broken_nodes() -> Vec<DeadNode> {
    let global = &Config::global_config().global;
    let (prefix, nodes) = (global.prefix.to_string(), nodes_folder());
    dead_nodes(|id| {
        let monitor = nodes.join(format!("{prefix}{id}{}", global.node.monitor_suffix));
        let details = nodes.join(format!("{id}/{prefix}node{}", global.node.static_config_suffix));
        !monitor.exists() || !details.exists()
    })
}

/// Dead nodes among those that are chosen, on a second look too: the number of a process says nothing of one in another
/// container, which may have nodes that live, or be at work on one.
fn dead_nodes(is_chosen: impl Fn(u128) -> bool) -> Vec<DeadNode> {
    let global = &Config::global_config().global;
    let (nodes, tag) = (nodes_folder(), global.node.service_tag_suffix.to_string());
    let look = || -> BTreeSet<u128> {
        let ids = files_in(&nodes).flat_map(|file| numbers_in(&name_of(&file)));
        ids.filter(|id| is_gone(process_of(*id)) && is_chosen(*id)).collect()
    };
    let seen = look();
    if seen.is_empty() {
        return Vec::new();
    }
    std::thread::sleep(FINISHING);
    let Some(living) = living_processes() else { return Vec::new() };
    let dead = look().into_iter().filter(|id| seen.contains(id) && !living.contains(&process_of(*id)));
    let node = |id: u128| {
        let names = files_in(&nodes.join(id.to_string()))
            .filter_map(|file| Some(name_of(&file).strip_suffix(&tag)?.to_owned()));
        let suffix = global.service.static_config_storage_suffix.to_string();
        let services = names.map(|name| services_folder().join(name + &suffix)).collect();
        DeadNode { id, services }
    };
    dead.map(node).collect()
}

/// Processes with a node that holds the lock of its monitor, in whatever container; none where they cannot be listed.
fn living_processes() -> Option<BTreeSet<u32>> {
    let mut living = BTreeSet::new();
    Node::<ipc::Service>::list(&config(), |node| {
        if let NodeState::Alive(node) = node {
            living.insert(process_of(node.id().value()));
        }
        CallbackProgression::Continue
    })
    .ok()?;
    Some(living)
}

fn nodes_folder() -> PathBuf {
    let global = &Config::global_config().global;
    PathBuf::from(global.root_path().to_string()).join(global.node.directory.to_string())
}

fn services_folder() -> PathBuf {
    let global = &Config::global_config().global;
    PathBuf::from(global.root_path().to_string()).join(global.service.directory.to_string())
}

fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Removes the dead nodes that iceoryx2 left and that were in no service that is left, and the ports of dead processes that no
/// node is left of. The others' services are put right by who owns them.
fn sweep() {
    remove_nodes(dead_nodes(|_| true));
    without_a_node().into_iter().for_each(remove_untold_of);
}

/// Dead processes that left a listener or a segment and no node, as one does whose node was cleared away up to a file that
/// iceoryx2 looked for and did not yet find. A process has its node before its first port and until after its last, in
/// whatever container, so the ports are listed before the nodes.
fn without_a_node() -> BTreeSet<u32> {
    let global = &Config::global_config().global;
    let root = PathBuf::from(global.root_path().to_string());
    let (prefix, nodes) = (global.prefix.to_string(), nodes_folder());
    let suffixes = [&global.service.event_connection_suffix, &global.service.data_segment_suffix]
        .map(ToString::to_string);
    let processes = |folder: &Path, chosen: &dyn Fn(&str) -> bool| -> BTreeSet<u32> {
        let names = files_in(folder).map(|file| name_of(&file)).filter(|name| chosen(name));
        names.flat_map(|name| numbers_in(&name)).map(process_of).collect()
    };
    let is_port = |name: &str| {
        let name = name.strip_prefix(&prefix);
        name.is_some_and(|name| suffixes.iter().any(|end| name.trim_end_matches("_mgmt").ends_with(end)))
    };
    let mut left = processes(Path::new(SHARED_MEMORY), &is_port);
    left.extend(processes(&root, &is_port));
    let with_nodes = processes(&nodes, &|_| true);
    left.into_iter().filter(|process| !with_nodes.contains(process) && is_gone(*process)).collect()
}

fn remove_nodes(dead: Vec<DeadNode>) {
    dead.iter().filter(|node| node.is_in_no_service()).for_each(|node| remove_files_of(process_of(node.id)));
}

/// Clears away what is left on this machine, one dead process after the other, until `stop` turns true.
pub(crate) fn clear(stop: &AtomicBool) {
    // iceoryx2 may take seconds for each of the others, and may give up on some
    sweep();
    let (mut cleared, mut left) = (0_u32, 0_u32);
    let listed = Node::<ipc::Service>::list(&config(), |node| {
        if stop.load(Ordering::Relaxed) {
            return CallbackProgression::Stop;
        }
        if let NodeState::Dead(dead) = node {
            match dead.try_remove_stale_resources() {
                Ok(()) => cleared += 1,
                Err(error) => {
                    left += 1;
                    tracing::debug!(?error, "clearing away what a process left that was killed");
                }
            }
        }
        CallbackProgression::Continue
    });
    if !stop.load(Ordering::Relaxed) {
        sweep();
    }
    if let Err(error) = listed {
        tracing::warn!(?error, "what killed processes left in shared memory cannot be listed");
    }
    if left > 0 {
        tracing::warn!(
            processes = left,
            "what they left in shared memory cannot be cleared away: with no server or client running, delete /tmp/iceoryx2 \
             and /dev/shm/iox2_*"
        );
    }
    if cleared > 0 {
        tracing::info!(processes = cleared, "cleared away what they left in shared memory");
    }
}
