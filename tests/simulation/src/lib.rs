//! The server in a world where network, clock and chance are simulated: the accept loop, admission, streams, sessions, reloads
//! and the drain are wade's own, and a seed says what happens.
//!
//! Everything runs on one thread whose clock moves only when nothing else can ([`tokio::time::pause`]); connections are made
//! in memory, and what travels over them comes in pieces, late, or not at all ([`network`]). Clients of every temper (`client`),
//! and some that mean harm (`hostile`), ask at random, while bundles change and the server is stopped (`world`); what they see is
//! compared with what a server owes (`ledger`).

pub mod bundle;
mod client;
mod hostile;
#[path = "../../common/http2.rs"]
pub mod http2;
mod ledger;
pub mod network;
mod served;
mod world;

pub use served::{Served, folder};
pub use world::{Seen, run};
