//! Generated from proto/wade/v1 and proto/inference.

#![allow(missing_docs, clippy::all, reason = "generated; the comments are in the .proto files")]
tonic::include_proto!("wade.v1");

/// Generated from proto/inference.
pub mod inference {
    tonic::include_proto!("inference");
}

/// The descriptors of everything in proto/, for reflection.
pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));
