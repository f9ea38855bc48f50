//! The functions of the header. Each checks its pointers, and none lets a panic out.
//!
//! # Safety
//! Of all of them: a pointer is null or valid for what its type and name say, a text has its end, and a client is null or open.
#![allow(unsafe_code, clippy::missing_safety_doc, reason = "a C ABI, whose contract is said once")]

use std::ffi::{CStr, CString, OsStr, c_char};
use std::os::unix::ffi::OsStrExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::slice;
use std::sync::LazyLock;
use std::time::Duration;

use nalgebra::{Quaternion, UnitQuaternion};
use wade_client::Address;
use wade_core::effects::Effect;
use wade_core::frame::{Vec3, up_from_quaternion, up_from_roll_pitch};
use wade_wire::Field;
use wade_wire::shm::Wait;

use crate::abi::{
    WADE_ABI_VERSION, WadeBatch, WadeCredentials, WadeForces, WadeOptions, WadeState, WadeStatus,
    WadeVehicle, WadeWait,
};
use crate::client::{Jacobian, WadeClient};
use crate::connection::status_of;
use crate::convert::write_text;
use crate::credentials::CredentialFiles;
use crate::pool::InCall;
use crate::vehicle;

/// Runs what a function does; a panic becomes a status.
fn guarded(run: impl FnOnce() -> WadeStatus) -> WadeStatus {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or(WadeStatus::Internal)
}

/// The text at a pointer, if it is one.
///
/// # Safety
/// The pointer is null or that of a text with its end.
unsafe fn text<'t>(pointer: *const c_char) -> Option<&'t str> {
    // SAFETY: as above.
    (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) })?.to_str().ok()
}

/// An address, if the text is one.
fn parsed(text: &str) -> Option<Address> {
    text.parse().ok()
}

/// The path at a pointer; none where it is null or the path is empty.
///
/// # Safety
/// The pointer is null or that of a text with its end.
unsafe fn path(pointer: *const c_char) -> Option<PathBuf> {
    // SAFETY: as above.
    let bytes = (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) })?.to_bytes();
    (!bytes.is_empty()).then(|| OsStr::from_bytes(bytes).into())
}

/// The files that a caller names; null names none.
///
/// # Safety
/// The pointer is null or valid, and so are its texts.
unsafe fn files(credentials: *const WadeCredentials) -> Result<CredentialFiles, WadeStatus> {
    if credentials.is_null() {
        return Ok(CredentialFiles::default());
    }
    // SAFETY: not null, so valid. The size is the first field whatever the size is.
    if unsafe { credentials.cast::<u32>().read() } as usize != size_of::<WadeCredentials>() {
        return Err(WadeStatus::AbiMismatch);
    }
    // SAFETY: of this size, so the fields are these; the texts are null or have their ends.
    let [ca, certificate, key, token] = unsafe {
        let given = &*credentials;
        [given.ca_file, given.certificate_file, given.key_file, given.token_file].map(|file| path(file))
    };
    Ok(CredentialFiles { ca, certificate, key, token })
}

/// Writes what fits of a text with its end.
///
/// # Safety
/// `buffer` is null or has room for `size` bytes.
unsafe fn write(text: &str, buffer: *mut c_char, size: usize) {
    if !buffer.is_null() && size > 0 {
        // SAFETY: as above.
        write_text(unsafe { slice::from_raw_parts_mut(buffer, size) }, text);
    }
}

/// Opens a client and begins to look for the server; does not wait for it. On WADE_STATUS_OK `*client` must be closed.
/// Otherwise (WADE_STATUS_ABI_MISMATCH, WADE_STATUS_INVALID_ARGUMENT, WADE_STATUS_INTERNAL) it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_client_open(
    options: *const WadeOptions,
    client: *mut *mut WadeClient,
) -> WadeStatus {
    // SAFETY: as of the caller.
    unsafe { wade_client_open_with_credentials(options, std::ptr::null(), client) }
}

/// As `wade_client_open`, for a server that is reached over TLS or asks who calls. Null credentials name no file.
///
/// A file that cannot be used does not keep the client from opening: it is not connected then, with WADE_STATUS_CREDENTIALS, and
/// `wade_client_reason` names the file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_client_open_with_credentials(
    options: *const WadeOptions,
    credentials: *const WadeCredentials,
    client: *mut *mut WadeClient,
) -> WadeStatus {
    guarded(|| {
        if options.is_null() || client.is_null() {
            return WadeStatus::InvalidArgument;
        }
        // SAFETY: not null, so valid. The version is the first field whatever the version is.
        let abi_version = unsafe {
            *client = std::ptr::null_mut();
            options.cast::<u32>().read()
        };
        if abi_version != WADE_ABI_VERSION {
            return WadeStatus::AbiMismatch;
        }
        // SAFETY: of this version, so the fields are these.
        let options = unsafe { &*options };
        let sizes = [options.state_size as usize, options.forces_size as usize];
        if sizes != [size_of::<WadeState>(), size_of::<WadeForces>()] {
            return WadeStatus::AbiMismatch;
        }
        let wait = match options.wait {
            wait if wait == WadeWait::Block as u32 => Wait::Block,
            wait if wait == WadeWait::Spin as u32 => Wait::Spin,
            _ => return WadeStatus::InvalidArgument,
        };
        // SAFETY: the texts are null or have their ends.
        let (address, vehicle) = unsafe { (text(options.address), text(options.vehicle)) };
        let (Some(address), Some(vehicle)) = (address.and_then(parsed), vehicle) else {
            return WadeStatus::InvalidArgument;
        };
        // SAFETY: null or valid.
        let files = match unsafe { files(credentials) } {
            Ok(files) => files,
            Err(status) => return status,
        };
        let Some(opened) = WadeClient::open(&address, vehicle, files, wait, options.max_batch) else {
            return WadeStatus::InvalidArgument;
        };
        // SAFETY: not null, so valid.
        unsafe { *client = Box::into_raw(Box::new(opened)) };
        WadeStatus::Ok
    })
}

/// Waits until the client is connected to its server, or the time is over: then says why it is not.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_client_wait(client: *const WadeClient, timeout_ns: u64) -> WadeStatus {
    guarded(|| {
        // SAFETY: null or open.
        let Some(client) = (unsafe { client.as_ref() }) else { return WadeStatus::InvalidArgument };
        client.connection().wait(Duration::from_nanos(timeout_ns))
    })
}

/// Closes a client; null is none. No call may be under way in it. Takes two seconds at most: what is not
/// given up by then, since the system is slow to open a connection, is given up later by the client's own thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_client_close(client: *mut WadeClient) {
    guarded(|| {
        if !client.is_null() {
            // SAFETY: it was made by `wade_client_open`, and is not used any more.
            unsafe { Box::from_raw(client) }.close();
        }
        WadeStatus::Ok
    });
}

/// Why the client is not connected, in a sentence with its end: returns its length, and writes what fits. Empty where it is
/// connected.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_client_reason(
    client: *const WadeClient,
    buffer: *mut c_char,
    size: usize,
) -> usize {
    let mut length = 0;
    guarded(|| {
        // SAFETY: null or open.
        let Some(client) = (unsafe { client.as_ref() }) else { return WadeStatus::InvalidArgument };
        let reason = client.connection().reason();
        length = reason.len();
        // SAFETY: null, or with room for `size` bytes.
        unsafe { write(&reason, buffer, size) };
        WadeStatus::Ok
    });
    length
}

/// The forces in a state, within a budget [ns].
///
/// Waits for the answer for at most the budget, and not at all for a server that is known to be gone. Without an answer to this
/// state `forces` gets the last answer that this client had, with its age. The question stays open: an answer that comes late
/// becomes the last one. So a budget of 0 never waits: it asks, and gives the answer to an earlier call.
/// Allocates nothing and holds no lock for longer than its budget.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_evaluate(
    client: *mut WadeClient,
    state: *const WadeState,
    budget_ns: u64,
    forces: *mut WadeForces,
) -> WadeStatus {
    guarded(|| {
        // SAFETY: null or valid; what `forces` holds are numbers, for which every bit pattern is a value.
        let given = unsafe { (client.as_ref(), state.as_ref(), forces.as_mut()) };
        let (Some(client), Some(state), Some(forces)) = given else { return WadeStatus::InvalidArgument };
        let _in_call = InCall::begin();
        client.evaluate(state, budget_ns, forces, None)
    })
}

/// The forces in a state and their derivatives, within a budget [ns]; as `wade_evaluate`, which costs a third to a fifth of it.
///
/// On WADE_STATUS_OK `jacobian` gets the derivatives of `force_n` and `moment_nm` in this state: 6 rows of WADE_JACOBIAN_COLUMNS
/// numbers, by the velocity (3), the angular velocity (3), the water level, a turn of the body about its axes (3), and the
/// density, each with the others held. Otherwise `jacobian` is as it was. Over shared memory the first call opens a port
/// within its budget, which takes milliseconds. A vehicle without the physical base has no derivatives: it is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_evaluate_jacobian(
    client: *mut WadeClient,
    state: *const WadeState,
    budget_ns: u64,
    forces: *mut WadeForces,
    jacobian: *mut f32,
) -> WadeStatus {
    guarded(|| {
        // SAFETY: null or valid; what is written to are numbers, for which every bit pattern is a value.
        let given = unsafe {
            (client.as_ref(), state.as_ref(), forces.as_mut(), jacobian.cast::<Jacobian>().as_mut())
        };
        let (Some(client), Some(state), Some(forces), Some(jacobian)) = given else {
            return WadeStatus::InvalidArgument;
        };
        let _in_call = InCall::begin();
        client.evaluate(state, budget_ns, forces, Some(jacobian))
    })
}

/// The forces in `count` states, within a budget [ns]; `forces` has room for as many.
///
/// On WADE_STATUS_OK all of them answer this call, from one bundle. Otherwise `forces` is as it was, so that an array that is
/// used again holds the last answer, and `batch->age_ns` says how old that is. `batch` may be null. A batch that is not
/// answered within its budget is not kept: a budget of 0 gets none. Over gRPC its states must agree in their flags.
/// Allocates nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_evaluate_batch(
    client: *mut WadeClient,
    states: *const WadeState,
    count: usize,
    budget_ns: u64,
    forces: *mut WadeForces,
    batch: *mut WadeBatch,
) -> WadeStatus {
    guarded(|| {
        // SAFETY: null or valid.
        let Some(client) = (unsafe { client.as_ref() }) else { return WadeStatus::InvalidArgument };
        // what is longer than any batch is no length
        if states.is_null() || forces.is_null() || count > crate::abi::WADE_MAX_BATCH as usize {
            return WadeStatus::InvalidArgument;
        }
        // SAFETY: valid for `count` values, which are numbers.
        let (states, forces) =
            unsafe { (slice::from_raw_parts(states, count), slice::from_raw_parts_mut(forces, count)) };
        let mut told = WadeBatch::default();
        let _in_call = InCall::begin();
        let status = client.evaluate_batch(states, budget_ns, forces, &mut told);
        // SAFETY: null or valid.
        if let Some(batch) = unsafe { batch.as_mut() } {
            *batch = told;
        }
        status
    })
}

/// Asks a server, at most as long as the timeout, what it serves under a name: names of surfaces, sizes, mass, domain. `address` as
/// in `wade_options`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_get_vehicle(
    address: *const c_char,
    vehicle: *const c_char,
    timeout_ns: u64,
    out: *mut WadeVehicle,
) -> WadeStatus {
    let none = std::ptr::null();
    // SAFETY: as of the caller.
    unsafe {
        wade_get_vehicle_with_credentials(address, vehicle, none, timeout_ns, out, std::ptr::null_mut(), 0)
    }
}

/// As `wade_get_vehicle`, for a server that is reached over TLS or asks who calls. Null credentials name no file. Where there is no
/// answer, `reason` gets what fits of a sentence with its end that says why; it may be null.
#[allow(clippy::too_many_arguments, reason = "C has no owned text to give back")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_get_vehicle_with_credentials(
    address: *const c_char,
    vehicle: *const c_char,
    credentials: *const WadeCredentials,
    timeout_ns: u64,
    out: *mut WadeVehicle,
    reason: *mut c_char,
    reason_size: usize,
) -> WadeStatus {
    guarded(|| {
        // SAFETY: null, or with room for so many bytes.
        let explain = |text: &str| unsafe { write(text, reason, reason_size) };
        explain("");
        // SAFETY: the texts are null or have their ends; `out` is null or valid.
        let given = unsafe { (text(address).and_then(parsed), text(vehicle), out.as_mut()) };
        let (Some(address), Some(vehicle), Some(out)) = given else { return WadeStatus::InvalidArgument };
        // SAFETY: null or valid.
        let files = match unsafe { files(credentials) } {
            Ok(files) => files,
            Err(status) => return status,
        };
        // connecting and asking have half of it each
        match vehicle::get(address, vehicle.to_owned(), files, Duration::from_nanos(timeout_ns / 2)) {
            Ok(vehicle) => {
                *out = *vehicle;
                WadeStatus::Ok
            }
            Err(error) => {
                explain(&error.to_string());
                status_of(&error)
            }
        }
    })
}

/// Unit vector along gravity of a body with this roll and pitch [rad]: positive roll lowers the right side, positive pitch the
/// nose (REP-103).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_gravity_from_roll_pitch(
    roll_rad: f32,
    pitch_rad: f32,
    gravity_direction: *mut f32,
) {
    let up = up_from_roll_pitch(roll_rad.into(), pitch_rad.into());
    // SAFETY: null or room for three.
    unsafe { write_vector(gravity_direction, -up.into_inner()) };
}

/// Unit vector along gravity of a body with this attitude: unit quaternion w, x, y, z that takes body vectors to the world, z up.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wade_gravity_from_quaternion(
    world_from_body: *const f32,
    gravity_direction: *mut f32,
) {
    // SAFETY: null or four numbers.
    let Some(quaternion) = (unsafe { world_from_body.cast::<[f32; 4]>().as_ref() }) else { return };
    let [w, x, y, z] = quaternion.map(f64::from);
    let up = up_from_quaternion(&UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)));
    // SAFETY: null or room for three.
    unsafe { write_vector(gravity_direction, -up.into_inner()) };
}

/// # Safety
/// `to` is null or has room for three numbers.
unsafe fn write_vector(to: *mut f32, vector: Vec3) {
    // SAFETY: as above.
    if let Some(to) = unsafe { to.cast::<[f32; 3]>().as_mut() } {
        *to = [vector.x as f32, vector.y as f32, vector.z as f32];
    }
}

/// A sentence for a status. Never null.
#[unsafe(no_mangle)]
pub extern "C" fn wade_status_message(status: i32) -> *const c_char {
    let message = match WadeStatus::from_code(status) {
        Some(WadeStatus::Ok) => c"the forces answer this call",
        Some(WadeStatus::Timeout) => c"no answer within the budget",
        Some(WadeStatus::NoServer) => c"no server there; it is looked for in the background",
        Some(WadeStatus::UnknownVehicle) => c"the server does not serve this vehicle",
        Some(WadeStatus::LayoutMismatch) => {
            c"the server is of another version; install the client that came with it"
        }
        Some(WadeStatus::InvalidState) => c"a field of the state is wrong",
        Some(WadeStatus::ResourceExhausted) => c"the server is at a limit",
        Some(WadeStatus::Refused) => c"the server refused",
        Some(WadeStatus::InvalidArgument) => c"an argument of the call is wrong",
        Some(WadeStatus::AbiMismatch) => {
            c"the program was compiled with a header of another version than the library"
        }
        Some(WadeStatus::Internal) => c"a fault in the client library",
        Some(WadeStatus::Credentials) => c"a file of the credentials cannot be used",
        None => c"no status of this library",
    };
    message.as_ptr()
}

/// Name of a field of `wade_state`, from `invalid_field`. Never null.
#[unsafe(no_mangle)]
pub extern "C" fn wade_field_name(field: u32) -> *const c_char {
    static NAMES: LazyLock<Vec<CString>> =
        LazyLock::new(|| names(|code| Field::from_code(code).map(Field::name)));
    name(&NAMES, field)
}

/// What can be wrong with a field, from `invalid_problem`. Never null.
#[unsafe(no_mangle)]
pub extern "C" fn wade_problem_message(problem: u32) -> *const c_char {
    let message = match problem {
        1 => c"must be finite",
        2 => c"is beyond anything physical",
        3 => c"must not be negative",
        4 => c"must be greater than zero",
        5 => c"must have length 1",
        7 => c"must have one value for each wheel of the vehicle",
        8 => c"is set, which the server does not support yet",
        9 => c"has a value, but its flag is not set",
        _ => c"is wrong",
    };
    message.as_ptr()
}

/// Name of an effect, such as "added_mass". Never null.
#[unsafe(no_mangle)]
pub extern "C" fn wade_effect_name(effect: u32) -> *const c_char {
    static NAMES: LazyLock<Vec<CString>> =
        LazyLock::new(|| names(|code| Effect::from_code(code).map(Effect::name)));
    name(&NAMES, effect)
}

/// Version of the library's binary interface.
#[unsafe(no_mangle)]
pub extern "C" fn wade_abi_version() -> u32 {
    WADE_ABI_VERSION
}

/// Names by number, with their ends; empty where a number has none.
fn names(name: impl Fn(u32) -> Option<&'static str>) -> Vec<CString> {
    (0..64).map(|code| CString::new(name(code).unwrap_or_default()).unwrap_or_default()).collect()
}

fn name(names: &[CString], number: u32) -> *const c_char {
    names.get(number as usize).map_or(c"".as_ptr(), |name| name.as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_status() {
        assert_eq!(guarded(|| panic!("planted")), WadeStatus::Internal);
    }

    #[test]
    fn every_problem_of_the_wire_has_a_sentence_of_its_own() {
        let of = |problem| {
            // SAFETY: the texts are static.
            unsafe { CStr::from_ptr(wade_problem_message(problem)) }
        };
        let sentences: std::collections::BTreeSet<_> = (0..6).map(of).collect();
        assert_eq!(sentences.len(), 6);
    }
}
