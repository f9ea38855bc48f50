//! Compiles proto/ in Rust and stamps the commit. Nothing else.

use std::{env, error::Error, fs, path::PathBuf, process::Command};

use prost::Message;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=proto");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let files = ["wade/v1/hydrodynamics.proto", "wade/v1/admin.proto", "inference/grpc_service.proto"];
    let descriptors = protox::compile(files, ["proto"])?;
    fs::write(out.join("descriptors.bin"), descriptors.encode_to_vec())?;
    tonic_prost_build::configure().compile_fds(descriptors)?;

    println!("cargo:rerun-if-changed=.git/HEAD");
    println!("cargo:rerun-if-changed=.git/refs");
    println!("cargo:rustc-env=WADE_COMMIT={}", commit().unwrap_or_else(|| "unknown".into()));
    Ok(())
}

/// The short commit, with a plus sign where the tree differs from it; absent outside a checkout.
fn commit() -> Option<String> {
    let output =
        Command::new("git").args(["describe", "--always", "--dirty=+", "--abbrev=12"]).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
