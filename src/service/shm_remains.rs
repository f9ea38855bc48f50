//! What servers and clients left in shared memory that were killed. Clearing it away waits half a second for each file of
//! theirs that is damaged, minutes where a machine lost power again and again, so nobody's start waits for it.

use std::sync::atomic::{AtomicBool, Ordering};

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeState};
use iceoryx2::prelude::{CallbackProgression, ipc};

/// The settings of every node here: what was left in a service is cleared when that service is opened, and the rest of the
/// machine by [`clear`] alone, not by whoever comes or goes.
pub(super) fn config() -> Config {
    let mut config = Config::global_config().clone();
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config
}

/// Clears away what is left on this machine, one dead process after the other, until `stop` turns true.
pub(crate) fn clear(stop: &AtomicBool) {
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
