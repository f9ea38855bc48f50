// Water for MuJoCo: the plugin `wade.water` puts the forces of a wade server on a body, as passive forces, and the water that
// moves along into the mass matrix.
//
// At each evaluation of passive forces the state of the body goes to the server. The answer's wrench joins qfrc_passive. The
// added mass M_A of the answer joins M as J^T M_A J, J taking qvel to the velocity of the vehicle's center of mass and its angular
// velocity in body axes; what the rate of that velocity has beside J qacc, -omega x v, becomes a load. As a force M_A nu_dot would
// follow the acceleration of the step before, which no integration holds once the water weighs more than the body.
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "wade_client.h"

enum { MAX_NAME = 64, SPEEDS = WADE_MAX_WHEELS };

// Attributes of the plugin in the MJCF.
static const char *const ATTRIBUTES[] = {"vehicle", "address", "level", "current", "density", "wheels", "budget", "oldest", "wait"};

typedef struct {
  wade_client *client;
  int body;
  // Height of the water surface in the world [m], velocity of the water in the world [m/s], density [kg/m3].
  mjtNum level;
  mjtNum current[3];
  mjtNum density;
  // Joints whose speeds are those of the wheels.
  int wheel_count;
  int wheel_joint[SPEEDS];
  // Longest wait for an answer [ns], and oldest answer that still counts [ns].
  uint64_t budget_ns;
  uint64_t oldest_ns;
  // The run of states, and the simulated time of its last one.
  uint64_t session;
  mjtNum time;
  int has_time;
  // What the last answer was, so that a change is said once.
  wade_status status;
  wade_forces forces;
} Water;

static int fail(const char *format, ...) {
  char text[512];
  va_list values;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  mju_warning("wade.water: %s", text);
  return -1;
}

// An attribute, or its default where it is not given.
static const char *attribute(const mjModel *m, int instance, const char *name, const char *otherwise) {
  const char *value = mj_getPluginConfig(m, instance, name);
  return value != NULL && value[0] != '\0' ? value : otherwise;
}

// Reads one finite number, or three.
static int numbers(const char *name, const char *text, int count, mjtNum *out) {
  const char *rest = text;
  int read = 0;
  for (int i = 0; i < count; ++i) {
    char *end = NULL;
    errno = 0;
    const double value = strtod(rest, &end);
    if (end == rest || errno != 0 || !isfinite(value)) break;
    out[i] = value;
    rest = end;
    ++read;
  }
  while (*rest == ' ') ++rest;
  if (read == count && *rest == '\0') return 0;
  return fail("%s is \"%s\"; it must be %s", name, text, count == 1 ? "a number" : "three numbers");
}

// Reads a number of seconds as nanoseconds.
static int nanoseconds(const mjModel *m, int instance, const char *name, const char *otherwise, uint64_t *out) {
  mjtNum seconds;
  if (numbers(name, attribute(m, instance, name, otherwise), 1, &seconds) != 0) return -1;
  if (seconds < 0.0 || seconds > 3600.0) return fail("%s is %g s, not between 0 and 3600", name, seconds);
  *out = (uint64_t)(seconds * 1e9);
  return 0;
}

// Finds the hinges of the wheels by the names of their joints, with spaces between them.
static int wheels(const mjModel *m, int instance, Water *water) {
  const char *rest = attribute(m, instance, "wheels", "");
  while (*rest != '\0') {
    char name[MAX_NAME];
    const size_t length = strcspn(rest, " ");
    if (length >= sizeof name) return fail("wheels has a name that is too long");
    memcpy(name, rest, length);
    name[length] = '\0';
    rest += length + strspn(rest + length, " ");
    if (length == 0) continue;
    if (water->wheel_count == SPEEDS) return fail("wheels has more than %d joints", SPEEDS);
    const int joint = mj_name2id(m, mjOBJ_JOINT, name);
    if (joint < 0 || m->jnt_type[joint] != mjJNT_HINGE) return fail("wheels names %s, which is no hinge of this model", name);
    water->wheel_joint[water->wheel_count++] = joint;
  }
  return 0;
}

static int configure(const mjModel *m, int instance, Water *water) {
  water->body = -1;
  for (int body = 0; body < m->nbody; ++body) {
    if (m->body_plugin[body] == instance) {
      if (water->body >= 0) return fail("one instance stands on two bodies; give each vehicle its own");
      water->body = body;
    }
  }
  if (water->body <= 0) return fail("<plugin plugin=\"wade.water\"> must stand in the body of the vehicle");
  if (numbers("level", attribute(m, instance, "level", "0"), 1, &water->level) != 0 ||
      numbers("current", attribute(m, instance, "current", "0 0 0"), 3, water->current) != 0 ||
      numbers("density", attribute(m, instance, "density", "1000"), 1, &water->density) != 0 ||
      nanoseconds(m, instance, "budget", "1", &water->budget_ns) != 0 ||
      nanoseconds(m, instance, "oldest", "0", &water->oldest_ns) != 0) {
    return -1;
  }
  return wheels(m, instance, water);
}

// Opens the client and waits for the server.
static int connect(const mjModel *m, int instance, Water *water) {
  const char *vehicle = attribute(m, instance, "vehicle", "");
  if (vehicle[0] == '\0') return fail("the attribute vehicle is missing: <config key=\"vehicle\" value=\"husky\"/>");
  const char *address = attribute(m, instance, "address", "shm:wade");
  uint64_t wait_ns;
  if (nanoseconds(m, instance, "wait", "2", &wait_ns) != 0) return -1;
  wade_options options = wade_default_options();
  options.address = address;
  options.vehicle = vehicle;
  wade_status status = wade_client_open(&options, &water->client);
  if (status != WADE_STATUS_OK) return fail("address \"%s\", vehicle \"%s\": %s", address, vehicle, wade_status_message(status));
  status = wade_client_wait(water->client, wait_ns);
  if (status == WADE_STATUS_OK) return 0;
  char reason[384];
  wade_client_reason(water->client, reason, sizeof reason);
  return fail("no %s at %s: %s", vehicle, address, reason);
}

static void destroy(mjData *d, int instance) {
  Water *water = (Water *)d->plugin_data[instance];
  if (water == NULL) return;
  wade_client_close(water->client);
  free(water);
  d->plugin_data[instance] = 0;
}

static int init(const mjModel *m, mjData *d, int instance) {
  static uint64_t sessions = 0;
  Water *water = calloc(1, sizeof *water);
  if (water == NULL) return -1;
  d->plugin_data[instance] = (uintptr_t)water;
  water->session = __atomic_add_fetch(&sessions, 1, __ATOMIC_RELAXED);
  water->forces.age_ns = WADE_NEVER;
  if (configure(m, instance, water) == 0 && connect(m, instance, water) == 0) return 0;
  destroy(d, instance);
  return -1;
}

// The run begins again, at rest and dry.
static void reset(const mjModel *m, mjtNum *state, void *data, int instance) {
  (void)m, (void)state, (void)instance;
  Water *water = data;
  if (water == NULL) return;
  // far from those of other runs of this process
  water->session += UINT64_C(1) << 32;
  water->has_time = 0;
}

static int nstate(const mjModel *m, int instance) {
  (void)m, (void)instance;
  return 0;
}

static void set3(float to[3], const mjtNum from[3]) {
  for (int i = 0; i < 3; ++i) to[i] = (float)from[i];
}

// The state of the body; velocities in body axes at its origin, angular first.
static wade_state state_of(const mjModel *m, const mjData *d, Water *water, const mjtNum velocity[6]) {
  const mjtNum *world_from_body = d->xmat + 9 * water->body;
  wade_state state = wade_default_state();
  state.session = water->session;
  state.flags = WADE_HAS_WATER_LEVEL | WADE_IMPLICIT_ADDED_MASS | WADE_HAS_HEADING;
  state.water_level_m = (float)(water->level - d->xpos[3 * water->body + 2]);
  state.density_kgpm3 = (float)water->density;
  state.heading_rad = (float)atan2(world_from_body[3], world_from_body[0]);
  set3(state.velocity_mps, velocity + 3);
  set3(state.angular_velocity_radps, velocity);
  mjtNum current[3], down[3];
  mju_mulMatTVec3(current, world_from_body, water->current);
  set3(state.current_mps, current);
  for (int i = 0; i < 3; ++i) down[i] = -world_from_body[6 + i];
  set3(state.gravity_direction, down);
  if (water->wheel_count > 0) {
    state.flags |= WADE_HAS_WHEEL_SPEEDS;
    state.wheel_count = (uint32_t)water->wheel_count;
    for (int i = 0; i < water->wheel_count; ++i) {
      state.wheel_speed_radps[i] = (float)d->qvel[m->jnt_dofadr[water->wheel_joint[i]]];
    }
  }
  // an evaluation again at the same time moves nothing on
  if (water->has_time && d->time > water->time) state.time_step_s = (float)(d->time - water->time);
  return state;
}

// Asks, and says once where that changes for the worse. True where there are forces to go by.
static int ask(Water *water, const wade_state *state, mjtNum time) {
  const wade_status status = wade_evaluate(water->client, state, water->budget_ns, &water->forces);
  if (status == WADE_STATUS_OK) {
    water->time = time;
    water->has_time = 1;
  }
  const int usable = status == WADE_STATUS_OK ||
                     (water->forces.age_ns != WADE_NEVER && water->forces.age_ns <= water->oldest_ns);
  if (status != water->status) {
    water->status = status;
    if (status == WADE_STATUS_INVALID_STATE) {
      fail("%s %s", wade_field_name(water->forces.invalid_field), wade_problem_message(water->forces.invalid_problem));
    } else if (status != WADE_STATUS_OK) {
      char reason[384] = "";
      wade_client_reason(water->client, reason, sizeof reason);
      fail("%s; %s. %s", wade_status_message(status), usable ? "the last forces stay" : "no forces until it answers", reason);
    }
  }
  return usable;
}

// Adds J^T M_A J to the mass matrix, and gives the load of what the rate of the velocity has beside J qacc.
static void add_mass(const mjModel *m, mjData *d, const Water *water, const mjtNum center[3], const mjtNum velocity[6],
                     mjtNum load[6]) {
  const mjtNum *world_from_body = d->xmat + 9 * water->body;
  mj_markStack(d);
  mjtNum *in_world = mj_stackAllocNum(d, 6 * m->nv);
  mjtNum *in_body = mj_stackAllocNum(d, 6 * m->nv);
  mjtNum *product = mj_stackAllocNum(d, 6 * m->nv);
  mj_jac(m, d, in_world, in_world + 3 * m->nv, center, water->body);
  for (int half = 0; half < 2; ++half) {
    mju_mulMatTMat(in_body + 3 * half * m->nv, world_from_body, in_world + 3 * half * m->nv, 3, 3, m->nv);
  }
  mjtNum mass[36];
  for (int i = 0; i < 36; ++i) mass[i] = water->forces.added_mass[i];
  mju_mulMatMat(product, mass, in_body, 6, 6, m->nv);
  for (int row = 0; row < m->nv; ++row) {
    for (int place = m->M_rowadr[row]; place < m->M_rowadr[row] + m->M_rownnz[row]; ++place) {
      const int column = m->M_colind[place];
      mjtNum sum = 0.0;
      for (int k = 0; k < 6; ++k) sum += in_body[k * m->nv + row] * product[k * m->nv + column];
      d->M[place] += sum;
    }
  }
  mj_factorM(m, d);
  mj_freeStack(d);
  mjtNum turn[3];
  mju_cross(turn, velocity, velocity + 3);
  for (int row = 0; row < 6; ++row) load[row] += mju_dot3(mass + 6 * row, turn);
}

static void compute(const mjModel *m, mjData *d, int instance, int capability) {
  (void)capability;
  Water *water = (Water *)d->plugin_data[instance];
  if (water == NULL) return;
  if (water->has_time && d->time < water->time) reset(m, NULL, water, instance);
  mjtNum velocity[6];
  mj_objectVelocity(m, d, mjOBJ_XBODY, water->body, velocity, 1);
  const wade_state state = state_of(m, d, water, velocity);
  if (!ask(water, &state, d->time)) return;
  const wade_forces *forces = &water->forces;
  const mjtNum *world_from_body = d->xmat + 9 * water->body;
  mjtNum load[6], center[3], about[3], force[3], moment[3];
  for (int i = 0; i < 3; ++i) {
    load[i] = forces->force_n[i];
    load[i + 3] = forces->moment_nm[i];
    about[i] = forces->about_m[i];
  }
  mju_mulMatVec3(center, world_from_body, about);
  mju_addTo3(center, d->xpos + 3 * water->body);
  if (forces->flags & WADE_HAS_ADDED_MASS) add_mass(m, d, water, center, velocity, load);
  mju_mulMatVec3(force, world_from_body, load);
  mju_mulMatVec3(moment, world_from_body, load + 3);
  mj_applyFT(m, d, force, moment, center, water->body, d->qfrc_passive);
}

mjPLUGIN_LIB_INIT(wade_water) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = "wade.water";
  plugin.nattribute = sizeof ATTRIBUTES / sizeof *ATTRIBUTES;
  plugin.attributes = ATTRIBUTES;
  plugin.capabilityflags = mjPLUGIN_PASSIVE;
  plugin.nstate = nstate;
  plugin.init = init;
  plugin.destroy = destroy;
  plugin.reset = reset;
  plugin.compute = compute;
  mjp_registerPlugin(&plugin);
}
