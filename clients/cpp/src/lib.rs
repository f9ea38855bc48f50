//! wade's client behind a C ABI: `include/wade_client.h` is made from `abi` and `exports`.
//!
//! A call waits on nothing for longer than its budget: locks are tried until the deadline (`bounded`), the last answer is read
//! without one (`last`), and whatever takes its time (opening ports, connections, a broken link's end) is done by a thread of
//! the client's own. Over shared memory the calling thread asks by itself (`shm`); over gRPC it hands the question to that
//! thread (`grpc`). What a call needs in passing comes from memory set aside (`pool`), and no panic leaves the library.

pub mod abi;
mod bounded;
mod client;
mod connection;
mod convert;
mod credentials;
mod event;
mod exports;
mod grpc;
mod known;
mod last;
mod pool;
mod shm;
mod skipped;
mod vehicle;
mod worker;
