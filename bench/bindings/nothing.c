/* The functions that a call for one machine takes, doing nothing: what is left is the package's own time. */
#include <gestell.h>
#include <stdlib.h>
#include <string.h>

static int there;

int gestell_get_version(int size, char *text) { strncpy(text, "0", size); return 0; }
gestell_error gestell_new_error(void) { return (gestell_error)&there; }
void gestell_delete_error(gestell_error *error) { *error = NULL; }
int gestell_get_error(gestell_error error, int size, char *message) { (void)error; (void)size; *message = 0; return 0; }
gestell_machine gestell_new_machine(void) { return (gestell_machine)&there; }
void gestell_delete_machine(gestell_machine *machine) { *machine = NULL; }
int gestell_read(gestell_machine machine, const char *file, gestell_error error) {
  (void)machine; (void)file; (void)error;
  return 0;
}
int gestell_set(gestell_machine machine, const char *path, double value, gestell_error error) {
  (void)machine; (void)path; (void)value; (void)error;
  return 0;
}
int gestell_solve(gestell_machine machine, const char *tasks, gestell_solution *solution, gestell_error error) {
  (void)machine; (void)tasks; (void)error;
  *solution = (gestell_solution)&there;
  return 0;
}
void gestell_delete_solution(gestell_solution *solution) { *solution = NULL; }
int gestell_size_text(gestell_solution solution, const char *what, int *size, gestell_error error) {
  (void)solution; (void)what; (void)error;
  *size = 7;
  return 0;
}
int gestell_get_text(gestell_solution solution, const char *what, int size, char *text, gestell_error error) {
  (void)solution; (void)what; (void)error;
  strncpy(text, "stable", size);
  return 0;
}
int gestell_count_multipliers(gestell_solution solution, int *count, gestell_error error) {
  (void)solution; (void)error;
  *count = 6;
  return 0;
}
int gestell_get_multipliers(gestell_solution solution, int count, double *re, double *im, double *bounds, gestell_error error) {
  (void)solution; (void)error;
  memset(re, 0, count * sizeof *re);
  memset(im, 0, count * sizeof *im);
  memset(bounds, 0, count * sizeof *bounds);
  return 0;
}
