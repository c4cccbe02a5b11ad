/* A table of the machine of an input file as lines of numbers and words: table FILE TABLE [PATH NUMBER]. The last column's name and
 * all errors go to standard error. */
#include <gestell.h>
#include <stdio.h>
#include <stdlib.h>

static int give_up(gestell_error error) {
  char text[1000];
  int code = gestell_get_error(error, sizeof text, text);
  fprintf(stderr, "%s\n", text);
  return code;
}

int main(int argc, char **argv) {
  /* static: what an error leaves behind is not lost to the address sanitizer */
  static gestell_error error;
  static gestell_machine machine;
  static gestell_solution solution;
  int rows, columns, i, k;
  if (argc < 3) return 1;
  error = gestell_new_error();
  machine = gestell_new_machine();
  if (gestell_read(machine, argv[1], error)) return give_up(error);
  if (argc > 4 && gestell_set(machine, argv[3], atof(argv[4]), error)) return give_up(error);
  if (gestell_solve(machine, NULL, &solution, error)) return give_up(error);
  if (gestell_shape_table(solution, argv[2], &rows, &columns, error)) return give_up(error);
  double *values = malloc(sizeof *values * (size_t)rows * (size_t)columns);
  char **words = calloc((size_t)columns, sizeof *words);
  int *widths = calloc((size_t)columns, sizeof *widths);
  for (k = 0; k < columns; k++) {
    char key[100], unit[100], bound[100];
    int kind, code;
    if (gestell_describe_column(solution, argv[2], k, sizeof key, key, unit, bound, &kind, &widths[k], error)) return give_up(error);
    printf(k ? ",%s" : "%s", key);
    if (kind == GESTELL_WORDS) {
      words[k] = malloc((size_t)rows * (size_t)widths[k] + 1);
      code = gestell_get_words(solution, argv[2], k, rows, widths[k], words[k], error);
    } else if (kind == GESTELL_INTEGERS) {
      int *whole = malloc(sizeof *whole * (size_t)rows);
      code = gestell_get_integers(solution, argv[2], k, rows, whole, error);
      for (i = 0; i < rows; i++) values[i + k * rows] = whole[i];
      free(whole);
    } else {
      code = gestell_get_numbers(solution, argv[2], k, rows, &values[k * rows], error);
    }
    if (code) return give_up(error);
  }
  putchar('\n');
  for (i = 0; i < rows; i++) {
    for (k = 0; k < columns; k++) {
      if (k) putchar(',');
      if (words[k]) printf("%.*s", widths[k], words[k] + i * widths[k]);
      else printf("%.17g", values[i + k * rows]);
    }
    putchar('\n');
  }
  for (k = 0; k < columns; k++) free(words[k]);
  free(words);
  free(widths);
  free(values);
  gestell_delete_solution(&solution);
  gestell_delete_machine(&machine);
  gestell_delete_error(&error);
  return 0;
}
