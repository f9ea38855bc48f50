# Every recipe is a plain command: run it by hand where `just` is not installed.

# list the recipes
default:
    @just --list

# format, lints and the quick tests: under two minutes once built
check:
    cargo fmt --check
    cargo clippy --all-targets -- -D warnings
    cargo test --lib --test repository

# every test of the Rust packages
test:
    cargo test

# what a clean clone must pass, clients included; installs the tools that tests need
ci:
    .ci/run

# the long fault and load tests, fuzzing and worlds: six hours
long:
    WADE_HOSTILE_SECONDS=3600 cargo test --test hostile -- --nocapture
    WADE_STORMS_S=60 cargo test --release --test storms -- --nocapture --test-threads 1
    tests/fuzz/run 1800
    WADE_SIMULATION_SEEDS=0..100000 cargo test --release -p wade-simulation --test seeds
    tests/simulation/faults/run

# write the tables of README.md and docs/src/results from the raw results, and those of effects from the sources
results:
    WADE_WRITE=1 cargo test --test repository results
