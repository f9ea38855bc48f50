# Every recipe is a plain command: run it by hand where `just` is not installed.

# list the recipes
default:
    @just --list

# format, lints and the quick tests: under two minutes once built
check:
    cargo fmt --check
    cargo clippy --all-targets -- -D warnings
    cargo test --lib --test layers --test repository

# every test of the Rust packages
test:
    cargo test

# what a clean clone must pass, clients included; installs the tools that tests need
ci:
    .ci/run

# the long fault and load tests: an hour
long:
    cargo test --release -- --ignored

# write the tables of README.md and docs/src/results from the raw results
results:
    WADE_WRITE=1 cargo test --test repository results
