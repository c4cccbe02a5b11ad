/* 100,000 calls, for a program that looks for leaks: leaks INPUT */
#include <gestell.h>
#include <stdio.h>
#include <stdlib.h>

static void coefficients(double t, int dof, double *m, double *b, double *c, double *h, void *data) {
  (void)t;
  (void)dof;
  (void)data;
  *m = 1;
  *b = 0.1;
  *c = 4;
  *h = 8;
}

/* Copies long texts: the input of the machine, what is composed of the results, and the values of a copy. Returns how many calls went
 * wrong. */
static int long_texts(gestell_machine machine, gestell_solution solution, gestell_error error) {
  const char *names[] = {"results", "page", "input", "mechanism_motion.svg"};
  gestell_machine copy = NULL;
  int size = 0, bad = gestell_size_input(machine, &size, error) != 0;
  char *place = malloc(size);
  bad += gestell_get_input(machine, size, place, error) != 0;
  for (int i = 0; i < 4; i++) {
    bad += gestell_size_text(solution, names[i], &size, error) != 0;
    place = realloc(place, size);
    bad += gestell_get_text(solution, names[i], size, place, error) != 0;
  }
  bad += gestell_copy_machine(machine, &copy, error) != 0 || gestell_remove(copy, "support", error) != 0;
  bad += gestell_size_parameters(copy, NULL, &size, error) != 0;
  place = realloc(place, size);
  bad += gestell_get_parameters(copy, NULL, size, place, error) != 0;
  bad += gestell_parse_named(copy, "&case", "pump.nml", error) != GESTELL_INPUT;
  gestell_delete_machine(&copy);
  free(place);
  return bad;
}

int main(int argc, char **argv) {
  gestell_machine machine = gestell_new_machine();
  gestell_error error = gestell_new_error();
  gestell_solution solution = NULL;
  double numbers[18];
  char text[64];
  int count, calls = 0, bad = 0;
  if (argc < 2) return 1;
  for (int k = 0; k < 3; k++) {
    bad += gestell_read(machine, argv[1], error) != 0;
    bad += gestell_set(machine, "drive.speed_rpm", 200 + 10 * k, error) != 0;
    bad += gestell_solve(machine, "stability, response", &solution, error) != 0;
    for (int i = 0; i < 5555; i++) {
      bad += gestell_count_multipliers(solution, &count, error) != 0 || count != 6;
      bad += gestell_get_multipliers(solution, 6, numbers, numbers + 6, numbers + 12, error) != 0;
      bad += gestell_get_text(solution, "verdict", 64, text, error) != 0;
      bad += gestell_get_text(solution, "opinion", 64, text, error) != GESTELL_USAGE;
      bad += gestell_get_numbers(solution, "multipliers", 1, 6, numbers, error) != 0;
      bad += gestell_get_numbers(solution, "none", 1, 6, numbers, error) != GESTELL_USAGE;
      calls += 6;
    }
    if (k == 0) bad += long_texts(machine, solution, error);
    bad += gestell_get_values(machine, "frame.origin", 2, numbers, error) != 0;
    bad += gestell_set(machine, "frame.orign", 1, error) != GESTELL_INPUT;
    bad += gestell_parse(machine, "&case", error) != GESTELL_INPUT;
    bad += gestell_solve_system(1, 1, coefficients, NULL, 1e-9, 64, text, numbers, 0, NULL, error) != 0;
    gestell_delete_solution(&solution);
    calls += 8;
  }
  gestell_delete_machine(&machine);
  gestell_delete_error(&error);
  printf("%d calls, %d of them wrong\n", calls + 19, bad);
  return bad != 0;
}
