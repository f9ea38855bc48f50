// wade from C: the forces of water on a wading vehicle. C11 and C++17. See clients/cpp/README.md.
//
// Body frame: x forward, y left, z up, origin at the center of the hull's bounding box. SI units, radians, single precision.
// Names are those of the wire (proto/wade/v1/hydrodynamics.proto). Made from src/ by tests/header.rs; not to be edited.

#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

// Version of everything in this header. A library of another one refuses to open a client.
#define WADE_ABI_VERSION 2

// Most surfaces of a vehicle.
#define WADE_MAX_SURFACES 64

// Most wheels whose speed a state has.
#define WADE_MAX_WHEELS 8

// Most effects of a vehicle.
#define WADE_MAX_EFFECTS 14

// Most states of one batch.
#define WADE_MAX_BATCH 4096

// Columns of the derivatives of force and moment; see `wade_evaluate_jacobian`.
#define WADE_JACOBIAN_COLUMNS 11

// Room for a name and its end.
#define WADE_NAME_SIZE 64

// The age of forces where there are none yet.
#define WADE_NEVER UINT64_MAX

// Flag of a state: no water pressure under the contact patches.
#define WADE_DRY_CONTACT 1

// Flag of a state: the caller adds `added_mass` to his own mass matrix, so that forces leave -M_A nu_dot out.
#define WADE_IMPLICIT_ADDED_MASS 2

// Flag of a state: `heading_rad` holds a value.
#define WADE_HAS_HEADING 4

// Flag of a state: `depth_rate_mps` holds a value.
#define WADE_HAS_DEPTH_RATE 8

// Flag of a state: `wheel_speed_radps` holds values.
#define WADE_HAS_WHEEL_SPEEDS 16

// Flag of a state: `water_level_m` holds the level, and `depth_m` is not read.
#define WADE_HAS_WATER_LEVEL 32

// Flag of a state: `bed_clearance_m` holds a value.
#define WADE_HAS_BED_CLEARANCE 64

// Flag of a state: `bed` holds a value.
#define WADE_HAS_BED 128

// Flag of a state: `wheel_water_level_m` holds values.
#define WADE_HAS_WHEEL_LEVELS 256

// Flag of a state: of the physical base the pressure of still water alone.
#define WADE_PHYSICS_HYDROSTATIC 512

// Flag of a state: of the physical base the pressure of still water and the drag.
#define WADE_PHYSICS_QUASI_STEADY 1024

// Flag of a state: the whole physical base, however the server is set.
#define WADE_PHYSICS_FULL 2048

// Flag of a state: `wave_vector_radpm`, `wave_amplitude_m` and `wave_phase_rad` hold values.
#define WADE_HAS_WAVE 8192

// Flag of a state: `current_exponent` holds a value.
#define WADE_HAS_CURRENT_EXPONENT 16384

// Flag of forces: no quantity lies outside the training domain.
#define WADE_IN_DOMAIN 1

// Flag of forces: the session begins with the state that these answer, at rest and dry. In the middle of a run it says that
// the server has forgotten the session.
#define WADE_SESSION_BEGINS 2

// Flag of forces: `added_mass` holds a matrix.
#define WADE_HAS_ADDED_MASS 4

// Flag of forces: the bundle has the physical base, and `damping`, `water_level_m`, `bed_clearance_m`, `bed` and
// `shaft_power_w` hold values.
#define WADE_HAS_BASE 8

// What came of a call.
typedef enum {
  // The forces answer the state of this call.
  WADE_STATUS_OK = 0,
  // No answer within the budget: the forces are the last ones, `age_ns` old.
  WADE_STATUS_TIMEOUT = 1,
  // No server there, or none any more; it is looked for in the background. The forces are the last ones.
  WADE_STATUS_NO_SERVER = 2,
  // The server serves no such vehicle. The forces are the last ones.
  WADE_STATUS_UNKNOWN_VEHICLE = 3,
  // The server is of another version: shared memory of another layout, or another service. The forces are the last ones.
  WADE_STATUS_LAYOUT_MISMATCH = 4,
  // A field of the state is wrong, which `invalid_field` and `invalid_problem` name. The forces are the last ones.
  WADE_STATUS_INVALID_STATE = 5,
  // The server is at a limit. The forces are the last ones.
  WADE_STATUS_RESOURCE_EXHAUSTED = 6,
  // The server refused for another reason. The forces are the last ones.
  WADE_STATUS_REFUSED = 7,
  // An argument of the call is wrong, such as a null pointer; nothing was written.
  WADE_STATUS_INVALID_ARGUMENT = 8,
  // The program was compiled with a header of another version than the library.
  WADE_STATUS_ABI_MISMATCH = 9,
  // A fault in this library; nothing was written. Please report it.
  WADE_STATUS_INTERNAL = 10,
  // A file of `wade_credentials` cannot be used, which the reason names; it is read again each second. The forces are the last
  // ones.
  WADE_STATUS_CREDENTIALS = 11,
} wade_status;

// How a call over shared memory waits for its answer.
typedef enum {
  // Sleeps until the server wakes it.
  WADE_WAIT_BLOCK = 0,
  // Polls without pause: faster by the time it takes to wake up, for the price of a core.
  WADE_WAIT_SPIN = 1,
} wade_wait;

// A quantity of which the training domain states a range; the places of `wade_forces.outside`.
typedef enum {
  // Horizontal speed through the water [m/s].
  WADE_QUANTITY_SPEED = 0,
  // Flow angle [rad]: pi/2 head-on or from behind, 0 from the side.
  WADE_QUANTITY_ANGLE = 1,
  // [kg/m3]
  WADE_QUANTITY_DENSITY = 2,
  // [m]
  WADE_QUANTITY_DEPTH = 3,
  // Angle between body z and up [rad].
  WADE_QUANTITY_TILT = 4,
  // Speed along body z [m/s].
  WADE_QUANTITY_VERTICAL_SPEED = 5,
  // [rad/s]
  WADE_QUANTITY_ANGULAR_SPEED = 6,
  // Distance to the nearest state that was learnt from, over what is usual among these [-].
  WADE_QUANTITY_DISTANCE = 7,
} wade_quantity;

// A client of one vehicle of one server. Any number of threads may call it; their calls are answered one at a time.
typedef struct wade_client wade_client;

// Where the server is and whom it is asked about. Begin with `wade_default_options()`.
typedef struct {
  // WADE_ABI_VERSION
  uint32_t abi_version;
  // sizeof(wade_state)
  uint32_t state_size;
  // sizeof(wade_forces)
  uint32_t forces_size;
  // A `wade_wait`, for shared memory.
  uint32_t wait;
  // Most states of a batch, up to WADE_MAX_BATCH; their room is reserved when the client is opened. 0: no batches.
  uint32_t max_batch;
  // 0
  uint32_t reserved;
  // "shm:NAMESPACE" for shared memory ("shm:wade" unless the server's shm.namespace says otherwise), "HOST:PORT" or
  // "http://HOST:PORT" for gRPC over TCP, "https://HOST:PORT" for the same over TLS, "unix:PATH" for gRPC over a Unix socket.
  // Copied.
  const char *address;
  // Name of the vehicle. Copied.
  const char *vehicle;
} wade_options;

// Which servers a client believes and what it shows them over TCP. Begin with `wade_default_credentials()`.
//
// Paths of files, each null or empty for none, and copied. The files are read at each connection, so that a client finds what was
// renewed when it connects again. Over shared memory and a Unix socket none is read: there the server knows its own user.
typedef struct {
  // sizeof(wade_credentials)
  uint32_t size;
  // 0
  uint32_t reserved;
  // PEM of the authorities whose servers are believed. None: those of the system.
  const char *ca_file;
  // PEM of the client's certificate, followed by those between it and its authority. With `key_file` alone.
  const char *certificate_file;
  // PEM of the private key of the certificate.
  const char *key_file;
  // A token, as `wade token` prints it. It is sent to another machine over "https://" alone.
  const char *token_file;
} wade_credentials;

// The state of a vehicle in the water. Begin with `wade_default_state()`.
typedef struct {
  // Number of a run of states that follow each other, for effects that remember; 0 for none. Over shared memory a client may
  // run many at a time; over gRPC another number begins another run, and batches have none.
  uint64_t session;
  // WADE_DRY_CONTACT, WADE_IMPLICIT_ADDED_MASS, those named WADE_HAS_ and one of those named WADE_PHYSICS_
  uint32_t flags;
  // Entries of `wheel_speed_radps` and `wheel_water_level_m` that hold a value, where the flags say so: one for each wheel of the
  // vehicle; 0 for four.
  uint32_t wheel_count;
  // Undisturbed water surface above the ground-contact plane at the body origin [m]; negative where it is below.
  float depth_m;
  // Signed height of the still-water plane above the body origin along up [m], for any attitude.
  float water_level_m;
  // Distance from the ground-contact plane down to the bed [m]. Not given: on the bed up to the level at which the vehicle
  // floats, and off it from there.
  float bed_clearance_m;
  // Share of the motion through the water that is motion over the bed: 0 parked to 1 driving. Not given: from the
  // velocities.
  float bed;
  // Density of the water [kg/m3].
  float density_kgpm3;
  // Velocity over ground [m/s]; through the water where there is no current.
  float velocity_mps[3];
  // Velocity of the water over ground, body frame [m/s].
  float current_mps[3];
  // Angular velocity [rad/s].
  float angular_velocity_radps[3];
  // Acceleration [m/s2].
  float acceleration_mps2[3];
  // Angular acceleration [rad/s2].
  float angular_acceleration_radps2[3];
  // Unit vector along gravity (down), body frame; see `wade_gravity_from_roll_pitch` and `wade_gravity_from_quaternion`.
  float gravity_direction[3];
  // Angle from the world's x to the body's x [rad].
  float heading_rad;
  // Rate at which the water rises at the body origin [m/s].
  float depth_rate_mps;
  // By axle from the front, left before right [rad/s]; of four wheels front left, front right, rear left, rear right.
  float wheel_speed_radps[WADE_MAX_WHEELS];
  // Time since the state before it in the session [s]. The steps of states that could not be asked for want of time are added
  // to the next one that is.
  float time_step_s;
  // A regular wave about the level, of linear theory: wave number along the direction in which it travels, body frame [rad/m].
  // For this and the next four the vehicle needs the physical base.
  float wave_vector_radpm[3];
  // Half the height of the wave from trough to crest [m].
  float wave_amplitude_m;
  // k . x - w t of the wave at the body origin [rad]: a crest at 0, and after it the water falls. w^2 = g k tanh(k h).
  float wave_phase_rad;
  // Height of the water surface above the body origin along up at each wheel [m], in the order of `wheel_speed_radps`; the level
  // is then that at the body origin. Not beside a wave.
  float wheel_water_level_m[WADE_MAX_WHEELS];
  // Exponent n of the profile of the current over the height s h over the bed, current_mps (1 + n) s^n.
  float current_exponent;
} wade_state;

// The load of one effect that was added to the model.
typedef struct {
  // Number of `Effect` on the wire; see `wade_effect_name`.
  uint32_t effect;
  // Why it is zero: number of `LeftOut` on the wire; 0 where it is not left out.
  uint32_t left_out;
  // [N]
  float force_n[3];
  // About `about_m` [N m].
  float moment_nm[3];
} wade_effect_load;

// What the water does to the vehicle, body frame. All zero, with an age of WADE_NEVER, where there was no answer yet.
typedef struct {
  // Time from the call whose state these answer to the end of this call [ns]; WADE_NEVER where there was no answer yet.
  uint64_t age_ns;
  // Counts the answers of this client from 1 on, so that one that was seen before is known; 0 where there was none yet, and in
  // a batch.
  uint64_t answer;
  // The server's own time [ns]; in a batch over gRPC that of the whole.
  uint64_t compute_ns;
  // WADE_IN_DOMAIN, WADE_SESSION_BEGINS, WADE_HAS_ADDED_MASS, WADE_HAS_BASE
  uint32_t flags;
  // Which field of this call's state is wrong, where the status says so; see `wade_field_name`. Else 0.
  uint32_t invalid_field;
  // What is wrong with it; see `wade_problem_message`. Else 0.
  uint32_t invalid_problem;
  // Version of the bundle that answered.
  uint32_t bundle_version;
  // Entries of the arrays per surface that hold a value, in the order of `wade_vehicle`; the others are zero.
  uint32_t surface_count;
  // Entries of `effects` that hold a load.
  uint32_t effect_count;
  // Power that the shafts of the wheels put in [W]; NaN of a server that does not state it.
  float shaft_power_w;
  // Net force [N].
  float force_n[3];
  // Net moment about `about_m` [N m].
  float moment_nm[3];
  // Center of mass [m].
  float about_m[3];
  // One standard deviation of the net force [N].
  float uncertainty_n[3];
  // One standard deviation of the net moment [N m].
  float moment_uncertainty_nm[3];
  // Height of the still-water plane above the body origin along up [m], as used.
  float water_level_m;
  // Distance from the ground-contact plane to the bed [m], as used.
  float bed_clearance_m;
  // Share of the motion through the water that is motion over the bed, as used.
  float bed;
  // How far each `wade_quantity` lies outside the training domain, in its unit: negative below, positive above, 0 within.
  float outside[8];
  // How far the state lies outside the box in which the effects were seen: depth, speed, acceleration, angular speed, density.
  float effects_outside[5];
  // Added mass and inertia about `about_m` by rows, forces first [kg, kg m, kg m2], where the flags say so.
  float added_mass[36];
  // Linear damping by waves about `about_m` by rows, forces first [kg/s, kg m/s, kg m2/s]: the wrench is -B nu. Zero in a
  // session, whose memory has it.
  float damping[36];
  // Force on each surface [N].
  float surface_force_n[WADE_MAX_SURFACES][3];
  // Point at which it acts [m].
  float surface_point_m[WADE_MAX_SURFACES][3];
  // Moment of the load of each surface about that point [N m].
  float surface_couple_nm[WADE_MAX_SURFACES][3];
  // Share of each surface under water.
  float wetted_fraction[WADE_MAX_SURFACES];
  // Share of the effects' forces that acts on each surface [N]: a part of `effects`, not to be added to them.
  float effect_surface_force_n[WADE_MAX_SURFACES][3];
  // The loads of the effects: with those of the surfaces they sum to `force_n` and `moment_nm`.
  wade_effect_load effects[WADE_MAX_EFFECTS];
  // Where the weights come from, such as "analytic".
  char provenance[WADE_NAME_SIZE];
} wade_forces;

// What came of a batch beside its forces.
typedef struct {
  // Time from the call that the forces answer to the end of this call [ns]; WADE_NEVER where no batch was answered yet.
  uint64_t age_ns;
  // Which state is wrong, where the status says so.
  uint32_t invalid_index;
  // As in `wade_forces`.
  uint32_t invalid_field;
  // As in `wade_forces`.
  uint32_t invalid_problem;
  // 0
  uint32_t reserved;
} wade_batch;

// A range of the training domain.
typedef struct {
  // Smallest value.
  double minimum;
  // Largest value.
  double maximum;
} wade_range;

// A named region of the hull.
typedef struct {
  // As in vehicle.toml.
  char name[WADE_NAME_SIZE];
  // bottom, front, rear, side, wheel or track.
  char kind[16];
  // [m]
  float centroid_m[3];
  // Mean outward normal.
  float normal[3];
  // [m2]
  double area_m2;
} wade_surface;

// What the server says of a vehicle.
typedef struct {
  // Its name.
  char name[WADE_NAME_SIZE];
  // Where the weights come from, such as "analytic".
  char provenance[WADE_NAME_SIZE];
  // Version of the bundle.
  uint32_t bundle_version;
  // Entries of `surfaces` that hold one.
  uint32_t surface_count;
  // Entries of `effects` that hold one.
  uint32_t effect_count;
  // Numbers of `Effect` on the wire, in the order of the answers; see `wade_effect_name`.
  uint32_t effects[WADE_MAX_EFFECTS];
  // [m]
  double length_m;
  // [m]
  double width_m;
  // [m]
  double height_m;
  // z of the ground-contact plane [m].
  double z0_m;
  // [kg]
  double mass_kg;
  // [m]
  float center_of_mass_m[3];
  // About the center of mass, by rows.
  double inertia_kgm2[9];
  // By `wade_quantity`; infinite where there is no range.
  wade_range domain[8];
  // In the order of the answers.
  wade_surface surfaces[WADE_MAX_SURFACES];
} wade_vehicle;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Opens a client and begins to look for the server; does not wait for it. On WADE_STATUS_OK `*client` must be closed.
// Otherwise (WADE_STATUS_ABI_MISMATCH, WADE_STATUS_INVALID_ARGUMENT, WADE_STATUS_INTERNAL) it is null.
wade_status wade_client_open(const wade_options *options, wade_client **client);

// As `wade_client_open`, for a server that is reached over TLS or asks who calls. Null credentials name no file.
//
// A file that cannot be used does not keep the client from opening: it is not connected then, with WADE_STATUS_CREDENTIALS, and
// `wade_client_reason` names the file.
wade_status wade_client_open_with_credentials(const wade_options *options,
                                              const wade_credentials *credentials,
                                              wade_client **client);

// Waits until the client is connected to its server, or the time is over: then says why it is not.
wade_status wade_client_wait(const wade_client *client, uint64_t timeout_ns);

// Closes a client; null is none. No call may be under way in it. Takes two seconds at most: what is not
// given up by then, since the system is slow to open a connection, is given up later by the client's own thread.
void wade_client_close(wade_client *client);

// Why the client is not connected, in a sentence with its end: returns its length, and writes what fits. Empty where it is
// connected.
size_t wade_client_reason(const wade_client *client, char *buffer, size_t size);

// The forces in a state, within a budget [ns].
//
// Waits for the answer for at most the budget, and not at all for a server that is known to be gone. Without an answer to this
// state `forces` gets the last answer that this client had, with its age. The question stays open: an answer that comes late
// becomes the last one. So a budget of 0 never waits: it asks, and gives the answer to an earlier call.
// Allocates nothing and holds no lock for longer than its budget.
wade_status wade_evaluate(wade_client *client, const wade_state *state, uint64_t budget_ns, wade_forces *forces);

// The forces in a state and their derivatives, within a budget [ns]; as `wade_evaluate`, which costs a third to a fifth of it.
//
// On WADE_STATUS_OK `jacobian` gets the derivatives of `force_n` and `moment_nm` in this state: 6 rows of WADE_JACOBIAN_COLUMNS
// numbers, by the velocity (3), the angular velocity (3), the water level, a turn of the body about its axes (3), and the
// density, each with the others held. Otherwise `jacobian` is as it was. Over shared memory the first call opens a port
// within its budget, which takes milliseconds. A vehicle without the physical base has no derivatives: it is refused.
wade_status wade_evaluate_jacobian(wade_client *client,
                                   const wade_state *state,
                                   uint64_t budget_ns,
                                   wade_forces *forces,
                                   float *jacobian);

// The forces in `count` states, within a budget [ns]; `forces` has room for as many.
//
// On WADE_STATUS_OK all of them answer this call, from one bundle. Otherwise `forces` is as it was, so that an array that is
// used again holds the last answer, and `batch->age_ns` says how old that is. `batch` may be null. A batch that is not
// answered within its budget is not kept: a budget of 0 gets none. Over gRPC its states must agree in their flags.
// Allocates nothing.
wade_status wade_evaluate_batch(wade_client *client,
                                const wade_state *states,
                                size_t count,
                                uint64_t budget_ns,
                                wade_forces *forces,
                                wade_batch *batch);

// Asks a server, at most as long as the timeout, what it serves under a name: names of surfaces, sizes, mass, domain. `address` as
// in `wade_options`.
wade_status wade_get_vehicle(const char *address,
                             const char *vehicle,
                             uint64_t timeout_ns,
                             wade_vehicle *out);

// As `wade_get_vehicle`, for a server that is reached over TLS or asks who calls. Null credentials name no file. Where there is no
// answer, `reason` gets what fits of a sentence with its end that says why; it may be null.
wade_status wade_get_vehicle_with_credentials(const char *address,
                                              const char *vehicle,
                                              const wade_credentials *credentials,
                                              uint64_t timeout_ns,
                                              wade_vehicle *out,
                                              char *reason,
                                              size_t reason_size);

// Unit vector along gravity of a body with this roll and pitch [rad]: positive roll lowers the right side, positive pitch the
// nose (REP-103).
void wade_gravity_from_roll_pitch(float roll_rad, float pitch_rad, float *gravity_direction);

// Unit vector along gravity of a body with this attitude: unit quaternion w, x, y, z that takes body vectors to the world, z up.
void wade_gravity_from_quaternion(const float *world_from_body,
                                  float *gravity_direction);

// A sentence for a status. Never null.
const char *wade_status_message(int32_t status);

// Name of a field of `wade_state`, from `invalid_field`. Never null.
const char *wade_field_name(uint32_t field);

// What can be wrong with a field, from `invalid_problem`. Never null.
const char *wade_problem_message(uint32_t problem);

// Name of an effect, such as "added_mass". Never null.
const char *wade_effect_name(uint32_t effect);

// Version of the library's binary interface.
uint32_t wade_abi_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

// Options that are complete but for `address` and `vehicle`.
static inline wade_options wade_default_options(void) {
  wade_options options;
  memset(&options, 0, sizeof options);
  options.abi_version = WADE_ABI_VERSION;
  options.state_size = (uint32_t)sizeof(wade_state);
  options.forces_size = (uint32_t)sizeof(wade_forces);
  options.wait = WADE_WAIT_BLOCK;
  return options;
}

// Credentials that name no file.
static inline wade_credentials wade_default_credentials(void) {
  wade_credentials credentials;
  memset(&credentials, 0, sizeof credentials);
  credentials.size = (uint32_t)sizeof(wade_credentials);
  return credentials;
}

// A vehicle at rest and level, in fresh water of no depth.
static inline wade_state wade_default_state(void) {
  wade_state state;
  memset(&state, 0, sizeof state);
  state.density_kgpm3 = 1000.0F;
  state.gravity_direction[2] = -1.0F;
  return state;
}
