// The forces along a run, asked for by the C client: rows of 18 numbers in, rows of 6 out, and the derivatives at the end.
//
//     steps ADDRESS VEHICLE STEP < rows > forces
//
// A row is velocity, current, angular velocity, acceleration, angular acceleration (3 each), and then gravity's x and y and
// the water level. The first row is asked about without a time step, as a unit is at its initialization.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wade_client.h"

enum { COLUMNS = 18 };
static const uint64_t PATIENCE = 5000000000u;

static void fail(const char *what, wade_status status) {
  fprintf(stderr, "%s: %s\n", what, wade_status_message((int32_t)status));
  exit(1);
}

int main(int argc, char **argv) {
  if (argc != 4) return 2;
  const float step = strtof(argv[3], NULL);
  wade_options options = wade_default_options();
  options.address = argv[1];
  options.vehicle = argv[2];
  wade_client *client = NULL;
  wade_status status = wade_client_open(&options, &client);
  if (status != WADE_STATUS_OK) fail("open", status);
  status = wade_client_wait(client, PATIENCE);
  if (status != WADE_STATUS_OK) fail("wait", status);

  float row[COLUMNS];
  wade_state state = wade_default_state();
  static wade_forces forces;
  state.session = 7;
  state.flags = WADE_HAS_WATER_LEVEL;
  while (fread(row, sizeof *row, COLUMNS, stdin) == COLUMNS) {
    memcpy(state.velocity_mps, row, sizeof state.velocity_mps);
    memcpy(state.current_mps, row + 3, sizeof state.current_mps);
    memcpy(state.angular_velocity_radps, row + 6, sizeof state.angular_velocity_radps);
    memcpy(state.acceleration_mps2, row + 9, sizeof state.acceleration_mps2);
    memcpy(state.angular_acceleration_radps2, row + 12, sizeof state.angular_acceleration_radps2);
    state.gravity_direction[0] = row[15];
    state.gravity_direction[1] = row[16];
    state.gravity_direction[2] = -sqrtf(1.0f - row[15] * row[15] - row[16] * row[16]);
    state.water_level_m = row[17];
    status = wade_evaluate(client, &state, PATIENCE, &forces);
    if (status != WADE_STATUS_OK) fail("evaluate", status);
    fwrite(forces.force_n, sizeof(float), 3, stdout);
    fwrite(forces.moment_nm, sizeof(float), 3, stdout);
    state.time_step_s = step;
  }
  float jacobian[6 * WADE_JACOBIAN_COLUMNS];
  state.time_step_s = 0.0f;
  status = wade_evaluate_jacobian(client, &state, PATIENCE, &forces, jacobian);
  if (status != WADE_STATUS_OK) fail("evaluate with derivatives", status);
  fwrite(jacobian, sizeof *jacobian, sizeof jacobian / sizeof *jacobian, stdout);
  wade_client_close(client);
  return 0;
}
