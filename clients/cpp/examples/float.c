// What the water does to a Husky that drives into it, in C.
//
//   float [ADDRESS]      "shm:wade" unless told otherwise

#include <stdio.h>

#include "wade_client.h"

int main(int argc, char **argv) {
  wade_options options = wade_default_options();
  options.address = argc > 1 ? argv[1] : "shm:wade";
  options.vehicle = "husky";

  wade_client *client = NULL;
  wade_status status = wade_client_open(&options, &client);
  if (status != WADE_STATUS_OK) {
    fprintf(stderr, "%s\n", wade_status_message(status));
    return 1;
  }
  if (wade_client_wait(client, 5000000000ULL) != WADE_STATUS_OK) {
    char reason[512];
    wade_client_reason(client, reason, sizeof reason);
    fprintf(stderr, "%s\n", reason);
    wade_client_close(client);
    return 1;
  }

  static wade_forces forces;
  for (int step = 0; step <= 4; ++step) {
    wade_state state = wade_default_state();
    state.depth_m = 0.05F * (float)step;
    state.velocity_mps[0] = 0.8F;
    status = wade_evaluate(client, &state, 1000000000ULL, &forces);
    printf("depth %.2f m: %-28s %7.1f %7.1f %7.1f N, %.0f us old\n", (double)state.depth_m, wade_status_message(status),
           (double)forces.force_n[0], (double)forces.force_n[1], (double)forces.force_n[2],
           forces.age_ns == WADE_NEVER ? 0.0 : (double)forces.age_ns * 1e-3);
  }
  wade_client_close(client);
  return status == WADE_STATUS_OK ? 0 : 1;
}
