//! Which process listens on an address, from /proc: for errors that say who is in the way.

use std::fmt;
use std::net::SocketAddr;
use std::path::Path;

/// State LISTEN in /proc/net/tcp.
const LISTEN: &str = "0A";

/// A process that listens. Another user's cannot be seen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Occupant {
    /// Its process id.
    pub pid: u32,
    /// Its name.
    pub name: String,
}

impl fmt::Display for Occupant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {})", self.name, self.pid)
    }
}

/// Who listens on this TCP port.
pub fn of_tcp(address: SocketAddr) -> Option<Occupant> {
    let port = format!(":{:04X}", address.port());
    let listens = |line: &&str| {
        let mut fields = line.split_whitespace().skip(1);
        fields.next().is_some_and(|local| local.ends_with(&port)) && fields.nth(1) == Some(LISTEN)
    };
    ["/proc/net/tcp", "/proc/net/tcp6"].into_iter().find_map(|table| {
        let table = std::fs::read_to_string(table).ok()?;
        // the tenth field is the inode of the socket
        owner(table.lines().find(listens)?.split_whitespace().nth(9)?)
    })
}

/// Who listens on this Unix socket.
pub fn of_unix(path: &Path) -> Option<Occupant> {
    let table = std::fs::read_to_string("/proc/net/unix").ok()?;
    let path = path.to_str()?;
    let mut sockets = table.lines().filter(|line| line.split_whitespace().nth(7) == Some(path));
    sockets.find_map(|line| owner(line.split_whitespace().nth(6)?))
}

/// The process that has a socket open.
fn owner(inode: &str) -> Option<Occupant> {
    let socket = format!("socket:[{inode}]");
    let processes = std::fs::read_dir("/proc").ok()?.flatten();
    let mut pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let pid = pids.find(|pid| {
        let files = std::fs::read_dir(format!("/proc/{pid}/fd")).into_iter().flatten().flatten();
        files.map(|file| file.path()).any(|file| {
            std::fs::read_link(file).is_ok_and(|target| target.as_os_str().to_str() == Some(&socket))
        })
    })?;
    let name = std::fs::read_to_string(format!("/proc/{pid}/comm")).ok()?;
    Some(Occupant { pid, name: name.trim().to_owned() })
}

/// The sentence for an address that could not be had: who has it, and how to choose another.
pub(super) fn in_the_way(source: &std::io::Error, occupant: Option<Occupant>, way_out: &str) -> String {
    match (source.kind(), occupant) {
        (std::io::ErrorKind::AddrInUse, Some(occupant)) => {
            format!("{occupant} listens there; stop it, or choose another address with {way_out}")
        }
        (std::io::ErrorKind::AddrInUse, None) => {
            format!("another program listens there; stop it, or choose another address with {way_out}")
        }
        _ => source.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listener_is_found_by_port_and_by_path() {
        let tcp = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("socket");
        let _unix = std::os::unix::net::UnixListener::bind(&path).expect("a socket");
        let found = [of_tcp(tcp.local_addr().expect("an address")), of_unix(&path)];
        assert_eq!(found.map(|occupant| occupant.map(|o| o.pid)), [Some(std::process::id()); 2]);
        drop(tcp);
        assert_eq!(of_unix(&folder.path().join("absent")), None);
    }
}
