//! Bundles and states for the tests of the contract.

#[path = "../../../../tests/common/bundles.rs"]
mod bundles;
#[path = "../../../../tests/common/states.rs"]
mod states;

#[allow(unused_imports, reason = "every test binary uses a part")]
pub use bundles::*;
