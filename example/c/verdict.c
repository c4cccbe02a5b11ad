/* The verdict on the machine of an input file, and the force on the ground. */
#include <gestell.h>
#include <stdio.h>

int main(int argc, char **argv) {
  gestell_error error = gestell_new_error();
  gestell_machine machine = gestell_new_machine();
  gestell_solution solution = NULL;
  double force[4];
  char text[1000] = "";
  int code = gestell_read(machine, argc > 1 ? argv[1] : NULL, error);
  if (!code) code = gestell_solve(machine, "stability, response", &solution, error);
  if (!code) code = gestell_get_response(solution, "f", force, 0, NULL, 0, NULL, error);
  if (!code) code = gestell_get_text(solution, "verdict", sizeof text, text, error);
  if (code) gestell_get_error(error, sizeof text, text);
  printf("%s\n", text);
  if (!code) printf("force on the ground %.4f N, to %.1e N\n", force[0], force[2]);
  gestell_delete_solution(&solution);
  gestell_delete_machine(&machine);
  gestell_delete_error(&error);
  return code;
}
