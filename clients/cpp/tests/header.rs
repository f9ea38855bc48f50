//! Promise: the committed header is that of the sources.

use std::path::Path;

#[test]
fn the_header_is_that_of_the_sources() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("settings");
    let bindings = ["abi", "client", "exports"]
        .iter()
        .fold(cbindgen::Builder::new().with_config(config), |builder, name| {
            builder.with_src(root.join("src").join(name).with_extension("rs"))
        })
        .generate()
        .expect("the sources are read");
    let mut made = Vec::new();
    bindings.write(&mut made);
    let committed = root.join("include/wade_client.h");
    if std::fs::read(&committed).expect("readable") != made {
        let fresh = Path::new(env!("CARGO_TARGET_TMPDIR")).join("wade_client.h");
        std::fs::write(&fresh, made).expect("written");
        panic!("the header is old: cp {} {}", fresh.display(), committed.display());
    }
}
