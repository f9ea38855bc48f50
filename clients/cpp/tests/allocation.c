// Promise: a call allocates nothing, whatever comes of it. Every allocation of this program and of the library goes through the
// functions below, which count those of the thread that calls.

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "wade_client.h"

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

// volatile: a compiler knows malloc, and takes it to change nothing
static _Thread_local volatile unsigned long allocations;

void *malloc(size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) {
  ++allocations;
  return __libc_realloc(old, size);
}

void *aligned_alloc(size_t alignment, size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void **out, size_t alignment, size_t size) {
  ++allocations;
  *out = __libc_memalign(alignment, size);
  return *out == NULL ? ENOMEM : 0;
}

enum { BATCH = 300 };

static wade_state states[BATCH];
static wade_forces forces[BATCH];

static int failed(const char *address, const char *what) {
  fprintf(stderr, "%s: %s\n", address, what);
  return 1;
}

static void prepare(void) {
  for (int i = 0; i < BATCH; ++i) {
    states[i] = wade_default_state();
    states[i].depth_m = 0.15F;
  }
}

static int allocates_nothing(const char *address, uint32_t wait) {
  wade_options options = wade_default_options();
  options.address = address;
  options.vehicle = "husky";
  options.wait = wait;
  options.max_batch = BATCH;
  wade_client *client = NULL;
  if (wade_client_open(&options, &client) != WADE_STATUS_OK) return failed(address, "not opened");
  if (wade_client_wait(client, 60000000000ULL) != WADE_STATUS_OK) return failed(address, "not connected");
  wade_state wrong = states[0];
  wrong.depth_m = -1.0F;
  int answered = 0;
  const unsigned long before = allocations;
  for (int i = 0; i < 200; ++i) {
    states[0].session = (uint64_t)(i % 2);
    answered += wade_evaluate(client, &states[0], 10000000000ULL, &forces[0]) == WADE_STATUS_OK;
    (void)wade_evaluate(client, &states[0], 0, &forces[0]);
    (void)wade_evaluate(client, &states[0], 20000, &forces[0]);
    (void)wade_evaluate(client, &wrong, 1000000000ULL, &forces[0]);
  }
  states[0].session = 0;
  for (int i = 0; i < 3; ++i) {
    answered += wade_evaluate_batch(client, states, BATCH, 60000000000ULL, forces, NULL) == WADE_STATUS_OK;
    (void)wade_evaluate_batch(client, states, BATCH, 0, forces, NULL);
  }
  const unsigned long counted = allocations - before;
  wade_client_close(client);
  if (answered != 203) return failed(address, "not every patient call was answered");
  if (counted != 0) {
    fprintf(stderr, "%s: %lu allocations in calls\n", address, counted);
    return 1;
  }
  return 0;
}

// A server that is not there is asked for nothing.
static int allocates_nothing_without_a_server(void) {
  wade_options options = wade_default_options();
  options.address = "shm:nobody_serves_here";
  options.vehicle = "husky";
  wade_client *client = NULL;
  if (wade_client_open(&options, &client) != WADE_STATUS_OK) return failed("nobody", "not opened");
  const unsigned long before = allocations;
  wade_status status = WADE_STATUS_OK;
  for (int i = 0; i < 100; ++i) status = wade_evaluate(client, &states[0], 1000000, &forces[0]);
  const unsigned long counted = allocations - before;
  wade_client_close(client);
  if (status != WADE_STATUS_NO_SERVER) return failed("nobody", wade_status_message(status));
  return counted == 0 ? 0 : failed("nobody", "allocations in calls");
}

int main(int argc, char **argv) {
  const unsigned long before = allocations;
  void *volatile kept = malloc(64); // a compiler may leave out what nobody sees
  free(kept);
  if (allocations == before) return failed("malloc", "is not counted");
  prepare();
  int failures = allocates_nothing_without_a_server();
  for (int i = 1; i < argc; ++i) {
    failures += allocates_nothing(argv[i], WADE_WAIT_BLOCK) + allocates_nothing(argv[i], WADE_WAIT_SPIN);
  }
  return failures != 0 || argc < 2;
}
