// Round trips from C, one after the other, beside a control in the same run: a bare echo of as many bytes between two processes
// over a pair of Unix sockets, which sleep and wake as client and server do. Blocks of calls alternate between the rows, so that
// what the machine does else falls on all of them. Nothing here fails on a time.
//
//   latency ADDRESS... [--calls N] [--blocks N] [--pin]      --pin: this process on the first of its cores; start the server so too

#define _GNU_SOURCE
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "wade_client.h"

enum { MAX_ROWS = 12, QUERY_BYTES = 136, ANSWER_BYTES = 3328 };

typedef struct row {
  char name[96];
  wade_client *client; // null: the echo
  int session;
  double *us;
  size_t count;
} row;

static double now_us(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec * 1e6 + (double)time.tv_nsec * 1e-3;
}

static int ascending(const void *left, const void *right) {
  const double a = *(const double *)left, b = *(const double *)right;
  return (a > b) - (a < b);
}

static int whole(int socket, char *bytes, size_t size, int is_write) {
  while (size > 0) {
    const ssize_t moved = is_write ? write(socket, bytes, size) : read(socket, bytes, size);
    if (moved <= 0) return 0;
    bytes += moved;
    size -= (size_t)moved;
  }
  return 1;
}

static pid_t start_echo(int *socket) {
  int pair[2];
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0) return -1;
  const pid_t process = fork();
  if (process == 0) {
    static char bytes[ANSWER_BYTES];
    close(pair[0]);
    while (whole(pair[1], bytes, QUERY_BYTES, 0) && whole(pair[1], bytes, ANSWER_BYTES, 1)) {
    }
    _exit(0);
  }
  close(pair[1]);
  *socket = pair[0];
  return process;
}

static int ask(row *row, int echo) {
  static wade_forces forces;
  static char bytes[ANSWER_BYTES];
  const double start = now_us();
  if (row->client == NULL) {
    if (!whole(echo, bytes, QUERY_BYTES, 1) || !whole(echo, bytes, ANSWER_BYTES, 0)) return 0;
  } else {
    wade_state state = wade_default_state();
    state.depth_m = 0.35F; // every surface of a Husky is wet
    state.velocity_mps[0] = 0.6F;
    state.velocity_mps[1] = 0.2F;
    state.session = (uint64_t)row->session;
    if (wade_evaluate(row->client, &state, 5000000000ULL, &forces) != WADE_STATUS_OK) return 0;
  }
  row->us[row->count++] = now_us() - start;
  return 1;
}

static int open_row(row *row, const char *address, wade_wait wait, int session) {
  wade_options options = wade_default_options();
  options.address = address;
  options.vehicle = "husky";
  options.wait = (uint32_t)wait;
  row->session = session;
  const char *kind = strncmp(address, "shm:", 4) == 0 ? (wait == WADE_WAIT_SPIN ? "polling" : "blocking")
                     : session != 0                   ? "stream"
                                                      : "unary";
  snprintf(row->name, sizeof row->name, "%.70s, %s", address, kind);
  return wade_client_open(&options, &row->client) == WADE_STATUS_OK &&
         wade_client_wait(row->client, 30000000000ULL) == WADE_STATUS_OK;
}

int main(int argc, char **argv) {
  static row rows[MAX_ROWS];
  size_t row_count = 1, calls = 100, blocks = 50;
  int echo = -1;
  snprintf(rows[0].name, sizeof rows[0].name, "control: bare echo");
  for (int i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--pin") == 0) {
      cpu_set_t allowed, one;
      CPU_ZERO(&one);
      sched_getaffinity(0, sizeof allowed, &allowed);
      for (int core = 0; core < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++core) {
        if (CPU_ISSET(core, &allowed)) CPU_SET(core, &one);
      }
      sched_setaffinity(0, sizeof one, &one);
    }
  }
  // before the clients have threads
  const pid_t echoing = start_echo(&echo);
  if (echoing < 0) return 1;
  for (int i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--pin") == 0) continue;
    if (i + 1 < argc && strcmp(argv[i], "--calls") == 0) {
      calls = (size_t)strtoul(argv[++i], NULL, 10);
    } else if (i + 1 < argc && strcmp(argv[i], "--blocks") == 0) {
      blocks = (size_t)strtoul(argv[++i], NULL, 10);
    } else if (row_count + 2 <= MAX_ROWS) {
      const int is_shm = strncmp(argv[i], "shm:", 4) == 0;
      if (!open_row(&rows[row_count], argv[i], WADE_WAIT_BLOCK, 0) ||
          !open_row(&rows[row_count + 1], argv[i], is_shm ? WADE_WAIT_SPIN : WADE_WAIT_BLOCK, is_shm ? 0 : 1)) {
        fprintf(stderr, "%s: not connected\n", argv[i]);
        return 1;
      }
      row_count += 2;
    }
  }
  for (size_t i = 0; i < row_count; ++i) rows[i].us = calloc(calls * blocks + 1, sizeof(double));
  for (size_t block = 0; block < blocks; ++block) {
    for (size_t i = 0; i < row_count; ++i) {
      for (size_t call = 0; call < calls; ++call) {
        if (!ask(&rows[i], echo)) {
          fprintf(stderr, "%s: no answer\n", rows[i].name);
          return 1;
        }
      }
    }
  }
  printf("%-90s %9s %9s %9s %9s  [us]\n", "", "p50", "p95", "p99", "least");
  for (size_t i = 0; i < row_count; ++i) {
    qsort(rows[i].us, rows[i].count, sizeof(double), ascending);
    const double *us = rows[i].us;
    const size_t count = rows[i].count;
    printf("%-90s %9.1f %9.1f %9.1f %9.1f\n", rows[i].name, us[count / 2], us[count * 95 / 100], us[count * 99 / 100], us[0]);
    free(rows[i].us);
    wade_client_close(rows[i].client);
  }
  close(echo);
  waitpid(echoing, NULL, 0);
  return 0;
}
