//! Compiles proto/ in Rust. Nothing else.

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message;

/// The messages of every interface, from this crate's folder.
const PROTO: &str = "../../proto";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed={PROTO}");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let files = ["wade/v1/hydrodynamics.proto", "wade/v1/admin.proto", "inference/grpc_service.proto"];
    let descriptors = protox::compile(files, [PROTO])?;
    // reflection and JSON need no comments, which are most of it
    let mut plain = descriptors.clone();
    plain.file.iter_mut().for_each(|file| file.source_code_info = None);
    fs::write(out.join("descriptors.bin"), plain.encode_to_vec())?;
    // how to connect is for the crates that do
    tonic_prost_build::configure().build_transport(false).compile_fds(descriptors)?;
    Ok(())
}
