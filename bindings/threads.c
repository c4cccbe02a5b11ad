/* Several threads read, change and solve machines at the same time: threads NUMBER INPUT... . Their results, messages of errors
   included, are those of one thread, byte by byte. With more than two threads, the library's own threads solve all inputs once more.
   The last line counts. */
#define _POSIX_C_SOURCE 200809L
#include <gestell.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { most = 8, kinds = 4, longest = 256 };
static const char *const tasks = "stability, response, forces, power, matrices, modes, balance, joints";
static char **inputs;
static int threads, count;

/* A text that grows. */
typedef struct { char *bytes; size_t size; } record;

static void add(record *to, const void *bytes, size_t size) {
  to->bytes = realloc(to->bytes, to->size + size);
  memcpy(to->bytes + to->size, bytes, size);
  to->size += size;
}

static void add_message(record *to, gestell_error error) {
  char text[4096] = "";
  gestell_get_error(error, sizeof text, text);
  add(to, text, strlen(text));
}

/* Verdict and all tables of a solution. */
static void add_solution(record *to, gestell_solution solution) {
  char table[longest], key[longest], unit[longest], error_key[longest], verdict[longest] = "";
  int tables = 0, rows, columns, kind, width;
  gestell_get_text(solution, "verdict", longest, verdict, NULL);
  add(to, verdict, strlen(verdict));
  gestell_count_tables(solution, &tables, NULL);
  for (int t = 0; t < tables; t++) {
    gestell_name_table(solution, t, longest, table, NULL);
    gestell_shape_table(solution, table, &rows, &columns, NULL);
    for (int c = 0; c < columns; c++) {
      gestell_describe_column(solution, table, c, longest, key, unit, error_key, &kind, &width, NULL);
      size_t size = (size_t)rows * (kind == GESTELL_WORDS ? (size_t)width : sizeof(double));
      void *values = calloc(size + 1, 1);
      if (kind == GESTELL_NUMBERS) gestell_get_numbers(solution, table, c, rows, values, NULL);
      if (kind == GESTELL_INTEGERS) gestell_get_integers(solution, table, c, rows, values, NULL);
      if (kind == GESTELL_WORDS) gestell_get_words(solution, table, c, rows, width, values, NULL);
      add(to, key, strlen(key));
      add(to, values, size);
      free(values);
    }
  }
}

/* Reads and solves one machine: unchanged, with another speed, or with one of two mistakes. */
static void examine(int job, record *to) {
  gestell_machine machine = gestell_new_machine();
  gestell_solution solution = NULL;
  gestell_error error = gestell_new_error();
  char speed[64];
  if (gestell_read(machine, inputs[job / kinds], error)) add_message(to, error);
  gestell_set(machine, "response.points", 36, NULL);
  snprintf(speed, sizeof speed, "%d", 100 + 7 * job);
  switch (job % kinds) {
  case 0: break;
  case 1: if (gestell_set_text(machine, "drive.speed_rpm", speed, error)) add_message(to, error); break;
  case 2: if (gestell_set_text(machine, "drive.sped_rpm", speed, error)) add_message(to, error); break;
  case 3: if (gestell_parse(machine, "&drive speed_rpm=1,2 /", error)) add_message(to, error); break;
  }
  if (job % kinds == 2) ;
  else if (gestell_solve(machine, tasks, &solution, error)) add_message(to, error);
  else add_solution(to, solution);
  gestell_delete_solution(&solution);
  gestell_delete_machine(&machine);
  gestell_delete_error(&error);
}

static record *results[most + 1];

/* Thread number n begins at another input than the others. */
static void *work(void *number) {
  int n = *(int *)number;
  for (int k = 0; k < count * kinds; k++) {
    int job = (k + n * count) % (count * kinds);
    examine(job, &results[n][job]);
  }
  return NULL;
}

/* All inputs at once. */
static int solve_together(void) {
  gestell_machine *machines = calloc((size_t)count, sizeof *machines);
  gestell_solution *solutions = calloc((size_t)count, sizeof *solutions);
  gestell_error *errors = calloc((size_t)count, sizeof *errors);
  int failed = 0;
  for (int i = 0; i < count; i++) {
    machines[i] = gestell_new_machine();
    errors[i] = gestell_new_error();
    gestell_read(machines[i], inputs[i], NULL);
    gestell_set(machines[i], "response.points", 36, NULL);
  }
  gestell_solve_many(count, machines, tasks, 2, solutions, errors);
  for (int i = 0; i < count; i++) {
    record got = {NULL, 0}, *alone = &results[0][i * kinds];
    if (solutions[i]) add_solution(&got, solutions[i]);
    else add_message(&got, errors[i]);
    if (got.size != alone->size || memcmp(got.bytes, alone->bytes, got.size)) failed++, printf("FAIL  together, %s\n", inputs[i]);
    free(got.bytes);
    gestell_delete_solution(&solutions[i]);
    gestell_delete_machine(&machines[i]);
    gestell_delete_error(&errors[i]);
  }
  free(machines), free(solutions), free(errors);
  return failed;
}

int main(int argc, char **argv) {
  pthread_t thread[most + 1];
  int numbers[most + 1], failed = 0, solved = 0;
  threads = argc > 2 ? atoi(argv[1]) : 0;
  if (threads < 1 || threads > most) return 1;
  inputs = argv + 2;
  count = argc - 2;
  for (int n = 0; n <= threads; n++) {
    numbers[n] = n;
    results[n] = calloc((size_t)(count * kinds), sizeof *results[n]);
  }
  work(&numbers[0]);
  for (int n = 1; n <= threads; n++) pthread_create(&thread[n], NULL, work, &numbers[n]);
  for (int n = 1; n <= threads; n++) pthread_join(thread[n], NULL);
  for (int job = 0; job < count * kinds; job++) {
    solved += results[0][job].size > 1000;
    for (int n = 1; n <= threads; n++) {
      record *one = &results[0][job], *other = &results[n][job];
      if (one->size == 0 || one->size != other->size || memcmp(one->bytes, other->bytes, one->size))
        failed++, printf("FAIL  thread %d, %s, kind %d: %zu and %zu bytes\n", n, inputs[job / kinds], job % kinds, one->size, other->size);
    }
  }
  if (solved < count) failed++, printf("FAIL  only %d machines solved\n", solved);
  if (threads > 2) failed += solve_together();
  printf("%d passed, %d failed\n", (threads + 1) * count * kinds - failed, failed);
  return failed != 0;
}
