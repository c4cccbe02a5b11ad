/* A sweep in a child of fork, when the parent has computed one: fork INPUT. The last line counts. */
#define _POSIX_C_SOURCE 200809L
#include <gestell.h>
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

/* Rows of the sweep, 0 where it fails. */
static int rows_of(const char *input) {
  gestell_machine machine = gestell_new_machine();
  gestell_solution solution = NULL;
  int rows = 0, columns = 0;
  if (!gestell_read(machine, input, NULL) && !gestell_set(machine, "sweep.count", 3, NULL) &&
      !gestell_solve(machine, "sweep", &solution, NULL))
    gestell_shape_table(solution, "sweep", &rows, &columns, NULL);
  gestell_delete_solution(&solution);
  gestell_delete_machine(&machine);
  return rows;
}

int main(int argc, char **argv) {
  int failed = 0, rows;
  if (argc < 2) return 1;
  rows = rows_of(argv[1]);
  for (int k = 0; k < 3; k++) {
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
      alarm(600);
      _exit(rows_of(argv[1]));
    }
    waitpid(child, &status, 0);
    if (rows == 0 || !WIFEXITED(status) || WEXITSTATUS(status) != rows) {
      failed++;
      printf("FAIL  child %d: status %d, rows of the parent %d\n", k, status, rows);
    }
    if (rows_of(argv[1]) != rows) failed++, printf("FAIL  the parent after child %d\n", k);
  }
  printf("%d passed, %d failed\n", failed ? 0 : 6, failed);
  return failed != 0;
}
