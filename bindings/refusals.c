/* Everything that makes no sense is refused with its code and a message, and nothing crashes; what makes sense returns numbers that
 * agree with each other. The last line counts. */
#include <gestell.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static int passed, failed;
static gestell_error error;

static void expect(const char *name, int got, int wanted, const char *words) {
  char text[1000];
  int told = gestell_get_error(error, sizeof text, text);
  if (got == wanted && told == wanted && (!words || strstr(text, words))) {
    passed++;
  } else {
    failed++;
    printf("FAIL  %s: code %d, told %d, wanted %d, '%s' without '%s'\n", name, got, told, wanted, text, words ? words : "");
  }
}

static double constant;

/* y'' + (a - 2 q cos 2 t) y = 0 */
static void mathieu(double t, int dof, double *m, double *b, double *c, double *h, void *data) {
  double *parameters = data;
  (void)dof;
  (void)h;
  m[0] = 1;
  b[0] = 0;
  c[0] = parameters[0] - 2 * parameters[1] * cos(2 * t);
}

/* A rotor on unequal springs: B is not symmetric, so rows are not columns. y'' - 2 w z' = ..., z'' + 2 w y' ... */
static void gyroscope(double t, int dof, double *m, double *b, double *c, double *h, void *data) {
  (void)t;
  (void)dof;
  (void)data;
  m[0] = m[3] = 1;
  m[1] = m[2] = 0;
  b[0] = b[3] = 0.1;
  b[1] = -1;
  b[2] = 1;
  c[0] = c[3] = 4;
  c[1] = c[2] = 0;
  h[0] = 8;
}

static void garbage(double t, int dof, double *m, double *b, double *c, double *h, void *data) {
  (void)t;
  (void)data;
  for (int i = 0; i < dof * dof; i++) m[i] = b[i] = c[i] = constant;
  for (int i = 0; i < dof; i++) h[i] = constant;
}

static void check(const char *name, int good) {
  good ? passed++ : failed++;
  if (!good) printf("FAIL  %s\n", name);
}

/* Multipliers agree with the table of multipliers, and peak, rms, harmonics and history of eta with each other. */
static void compare_numbers(gestell_solution solution) {
  double re[6], im[6], bounds[6], column[6], numbers[4], amplitudes[500], history[2000];
  int orders, points, rows, columns;
  char unit[16], table[32];
  expect("multipliers", gestell_get_multipliers(solution, 6, re, im, bounds, error), 0, NULL);
  gestell_get_numbers(solution, "multipliers", 1, 6, column, error);
  check("real parts are those of the table", memcmp(re, column, sizeof re) == 0);
  gestell_get_numbers(solution, "multipliers", 2, 6, column, error);
  check("imaginary parts are those of the table", memcmp(im, column, sizeof im) == 0);
  check("bounds are small and positive", bounds[0] > 0 && bounds[0] < 1e-6 && bounds[5] > 0);
  int indices[6];
  expect("numbers of the multipliers", gestell_get_integers(solution, "multipliers", 0, 6, indices, error), 0, NULL);
  check("multipliers are numbered from 1", indices[0] == 1 && indices[5] == 6);
  expect("real numbers are no integers", gestell_get_integers(solution, "multipliers", 1, 6, indices, error), GESTELL_USAGE, "integer");
  expect("name", gestell_name_table(solution, 0, 32, table, error), 0, NULL);
  expect("of a table", gestell_shape_table(solution, table, &rows, &columns, error), 0, NULL);

  expect("vibration", gestell_describe_response(solution, "eta", &orders, &points, 16, unit, error), 0, NULL);
  check("eta is in m, and the arrays are large enough", strcmp(unit, "m") == 0 && orders <= 500 && points <= 2000);
  expect("null numbers", gestell_get_response(solution, "eta", NULL, orders, amplitudes, points, history, error), GESTELL_USAGE, "null");
  expect("few orders", gestell_get_response(solution, "eta", numbers, orders - 1, amplitudes, points, history, error), GESTELL_USAGE,
         "elements");
  expect("few points", gestell_get_response(solution, "eta", numbers, orders, amplitudes, points - 1, history, error), GESTELL_USAGE,
         "elements");
  expect("peak alone", gestell_get_response(solution, "eta", numbers, 0, NULL, 0, NULL, error), 0, NULL);
  expect("all", gestell_get_response(solution, "eta", numbers, orders, amplitudes, points, history, error), 0, NULL);
  double mean = 0, square = 0, peak = 0, parts = 0;
  for (int i = 0; i < points - 1; i++) {
    mean += history[i] / (points - 1);
    square += history[i] * history[i] / (points - 1);
    peak = fmax(peak, fabs(history[i]));
  }
  for (int i = 0; i < orders; i++) parts += amplitudes[i] * amplitudes[i] / 2;
  /* The history has so many points that its mean square is that of the vibration; its largest value is up to 1 % below the peak. */
  check("rms", fabs(sqrt(square) / numbers[1] - 1) < 1e-3);
  check("peak", peak <= numbers[0] * (1 + 1e-9) && peak > 0.99 * numbers[0]);
  check("Parseval", fabs((mean * mean + parts) / square - 1) < 1e-3);
  check("bounds of peak and rms", numbers[2] > 0 && numbers[2] < 1e-6 * numbers[0] && numbers[3] > 0 && numbers[3] < 1e-6 * numbers[1]);
}

/* Several machines at once have the solutions that they have one by one. */
static void solve_many(gestell_machine machine) {
  gestell_machine machines[3] = {NULL, gestell_new_machine(), NULL};
  gestell_solution solutions[3] = {NULL, NULL, NULL}, alone = NULL;
  gestell_error errors[3] = {gestell_new_error(), gestell_new_error(), gestell_new_error()};
  double re[2][6], im[6], bounds[6];
  char text[200];
  gestell_copy_machine(machine, &machines[0], error);
  gestell_copy_machine(machine, &machines[2], error);
  gestell_set(machines[2], "drive.speed_rpm", 300, error);
  for (int with_errors = 0; with_errors < 2; with_errors++) {
    int code = gestell_solve_many(3, machines, "stability", 2, solutions, with_errors ? errors : NULL);
    check("the code of the empty machine", code == GESTELL_INPUT && !solutions[1]);
    for (int i = 0; i < 3; i += 2) {
      gestell_solve(machines[i], "stability", &alone, error);
      gestell_get_multipliers(solutions[i], 6, re[0], im, bounds, error);
      expect("multipliers of one of several", gestell_get_multipliers(alone, 6, re[1], im, bounds, error), 0, NULL);
      check("one of several is as alone", memcmp(re[0], re[1], sizeof re[0]) == 0);
      gestell_delete_solution(&alone);
      gestell_delete_solution(&solutions[i]);
    }
  }
  gestell_get_error(errors[1], 200, text);
  check("its message", strstr(text, "machine is empty") && gestell_get_error(errors[0], 200, text) == 0);
  check("no machines", gestell_solve_many(0, machines, NULL, 0, solutions, NULL) == 0);
  check("a negative number", gestell_solve_many(-1, machines, NULL, 0, solutions, NULL) == GESTELL_USAGE);
  check("no place", gestell_solve_many(1, machines, NULL, 0, NULL, NULL) == GESTELL_USAGE);
  for (int i = 0; i < 3; i++) gestell_delete_machine(&machines[i]), gestell_delete_error(&errors[i]);
}

int main(int argc, char **argv) {
  gestell_machine machine = gestell_new_machine();
  gestell_solution solution = NULL;
  double numbers[64], parameters[2] = {1, 0.2};
  char text[64], unit[16];
  int count, rows, columns, kind;
  const double pi = acos(-1.0);
  if (argc < 2) return 1;
  error = gestell_new_error();

  expect("no machine yet", gestell_solve(machine, NULL, &solution, error), GESTELL_INPUT, "machine is empty");
  expect("null machine", gestell_read(NULL, argv[1], error), GESTELL_USAGE, "null");
  expect("null file", gestell_read(machine, NULL, error), GESTELL_USAGE, "null");
  expect("null text", gestell_parse(machine, NULL, error), GESTELL_USAGE, "null");
  expect("no file", gestell_read(machine, "no/such/file.nml", error), GESTELL_INPUT, "no such file");
  expect("rubbish", gestell_parse(machine, "rubbish", error), GESTELL_INPUT, "text:1");
  expect("empty", gestell_parse(machine, "", error), GESTELL_INPUT, "empty");
  expect("missing group", gestell_parse(machine, "&case /", error), GESTELL_INPUT, "&drive");
  expect("null groups", gestell_add(machine, NULL, error), GESTELL_USAGE, "null");
  expect("unknown group", gestell_add(machine, "&jiont name='A' /", error), GESTELL_INPUT, "&joint");
  expect("a group", gestell_add(machine, "&drive speed_rpm=240 /", error), 0, NULL);
  expect("twice", gestell_add(machine, "&drive speed_rpm=240 /", error), GESTELL_INPUT, "only once");
  expect("not enough of them", gestell_solve(machine, NULL, &solution, error), GESTELL_INPUT, "&frame");
  expect("read", gestell_read(machine, argv[1], error), 0, NULL);
  expect("unknown path", gestell_set(machine, "drive.speed_rp", 1, error), GESTELL_INPUT, "did you mean 'speed_rpm'");
  expect("NaN", gestell_set(machine, "drive.speed_rpm", nan(""), error), GESTELL_INPUT, "finite");
  expect("infinite", gestell_set(machine, "drive.speed_rpm", 1 / (0.0 * parameters[0]), error), GESTELL_INPUT, "finite");
  expect("whole number", gestell_set(machine, "response.points", 7, error), 0, NULL);
  expect("negative whole number", gestell_set(machine, "joint(B).branch", -1, error), 0, NULL);
  expect("no whole number", gestell_set(machine, "response.points", 7.5, error), GESTELL_INPUT, "whole number");
  expect("too large a whole number", gestell_set(machine, "response.points", 1e12, error), GESTELL_INPUT, "too large");
  expect("as it was", gestell_set(machine, "joint(B).branch", 1, error), 0, NULL);
  expect("null path", gestell_set(machine, NULL, 1, error), GESTELL_USAGE, "null");
  expect("null value", gestell_set_text(machine, "model.frame", NULL, error), GESTELL_USAGE, "null");
  expect("a word", gestell_set_text(machine, "model.frame", "round", error), 0, NULL);
  expect("that is none", gestell_solve(machine, NULL, &solution, error), GESTELL_INPUT, "round");
  expect("another", gestell_set_text(machine, "model.frame", "rest", error), 0, NULL);
  expect("null count", gestell_count_values(machine, "frame.origin", NULL, error), GESTELL_USAGE, "null");
  expect("count", gestell_count_values(machine, "frame.origin", &count, error), 0, NULL);
  gestell_machine copy = machine;
  expect("null copy", gestell_copy_machine(machine, NULL, error), GESTELL_USAGE, "null");
  expect("copy of nothing", gestell_copy_machine(NULL, &copy, error), GESTELL_USAGE, "null");
  expect("no copy", gestell_remove(copy, "support", error), GESTELL_USAGE, "null");
  expect("copy", gestell_copy_machine(machine, &copy, error), 0, NULL);
  expect("null groups to remove", gestell_remove(copy, NULL, error), GESTELL_USAGE, "null");
  expect("no such group", gestell_remove(copy, "support(9)", error), GESTELL_INPUT, "support(9)");
  expect("remove", gestell_remove(copy, "support(4)", error), 0, NULL);
  expect("removed", gestell_size_parameters(copy, "support(4).stiffness", &count, error), GESTELL_INPUT, "from 1 to 3");
  expect("not from the original", gestell_size_parameters(machine, "support(4).stiffness", &count, error), 0, NULL);
  expect("null size of parameters", gestell_size_parameters(machine, NULL, NULL, error), GESTELL_USAGE, "null");
  expect("short parameters", gestell_get_parameters(machine, "model.frame", 9, text, error), GESTELL_USAGE, "elements");
  expect("no place for parameters", gestell_get_parameters(machine, "model.frame", 999, NULL, error), GESTELL_USAGE, "null");
  expect("null name", gestell_parse_named(copy, "&case /", NULL, error), GESTELL_USAGE, "null");
  expect("a text by name", gestell_parse_named(copy, "&case /", "pump.nml", error), GESTELL_INPUT, "pump.nml");
  gestell_delete_machine(&copy);
  expect("wrong count", gestell_get_values(machine, "frame.origin", count + 1, numbers, error), GESTELL_USAGE, "elements");
  expect("null place", gestell_get_values(machine, "frame.origin", count, NULL, error), GESTELL_USAGE, "null");
  expect("short input", gestell_get_input(machine, 3, text, error), GESTELL_USAGE, "elements");
  expect("null size", gestell_size_input(machine, NULL, error), GESTELL_USAGE, "null");
  expect("unknown task", gestell_solve(machine, "dance", &solution, error), GESTELL_INPUT, "dance");
  expect("null solution's place", gestell_solve(machine, "stability", NULL, error), GESTELL_USAGE, "null");
  expect("nothing to take apart", gestell_count_multipliers(solution, &count, error), GESTELL_USAGE, "null");
  expect("solve", gestell_solve(machine, "stability", &solution, error), 0, NULL);
  expect("short text", gestell_get_text(solution, "verdict", 3, text, error), GESTELL_USAGE, "elements");
  expect("negative size", gestell_get_text(solution, "verdict", -1, text, error), GESTELL_USAGE, "elements");
  expect("unknown text", gestell_get_text(solution, "opinion", 64, text, error), GESTELL_USAGE, "opinion");
  expect("no vibration", gestell_describe_response(solution, "f", &rows, &columns, 16, unit, error), GESTELL_INPUT, "response");
  expect("wrong number", gestell_get_multipliers(solution, 5, numbers, numbers, numbers, error), GESTELL_USAGE, "6");
  expect("null multipliers", gestell_get_multipliers(solution, 6, numbers, NULL, numbers, error), GESTELL_USAGE, "null");
  expect("no table", gestell_shape_table(solution, "response", &rows, &columns, error), GESTELL_USAGE, "no table");
  expect("table by number", gestell_name_table(solution, 99, 64, text, error), GESTELL_USAGE, "index of the table");
  expect("table by a negative number", gestell_name_table(solution, -1, 64, text, error), GESTELL_USAGE, "index of the table");
  expect("shape", gestell_shape_table(solution, "multipliers", &rows, &columns, error), 0, NULL);
  expect("no column", gestell_get_numbers(solution, "multipliers", columns, rows, numbers, error), GESTELL_USAGE, "index of the column");
  expect("wrong rows", gestell_get_numbers(solution, "multipliers", 1, rows - 1, numbers, error), GESTELL_USAGE, "elements");
  expect("wrong kind", gestell_get_words(solution, "multipliers", 1, rows, 1, text, error), GESTELL_USAGE, "not contain words");
  expect("null column", gestell_get_numbers(solution, "multipliers", 1, rows, NULL, error), GESTELL_USAGE, "null");
  expect("short names", gestell_describe_column(solution, "multipliers", 1, 1, text, text, text, &kind, &count, error), GESTELL_USAGE,
         "elements");
  expect("nowhere to write", gestell_write(solution, "/dev/null/there", 0, error), GESTELL_USAGE, "/dev/null/there");
  expect("null folder", gestell_write(solution, NULL, 0, error), GESTELL_USAGE, "null");
  gestell_delete_solution(&solution);
  expect("null solution", gestell_write(solution, "there", 0, error), GESTELL_USAGE, "null");
  expect("a probe", gestell_add(machine, "&probe name='outlet', position=0.1,0.1 /", error), 0, NULL);
  gestell_set(machine, "response.points", 720, error);
  expect("response", gestell_solve(machine, "stability, response", &solution, error), 0, NULL);
  compare_numbers(solution);
  solve_many(machine);
  expect("its name", gestell_describe_column(solution, "probes", 0, 64, text, text, text, &kind, &count, error), 0, NULL);
  for (int width = -1; width < count; width++)
    expect("too narrow for a word", gestell_get_words(solution, "probes", 0, 1, width, text, error), GESTELL_USAGE, "must have 6 elements");
  expect("words", gestell_get_words(solution, "probes", 0, 1, count, text, error), 0, NULL);
  if (count == 6 && strncmp(text, "outlet", 6) == 0) passed++;
  else failed++, printf("FAIL  the probe's name: %d characters, %.6s\n", count, text);
  gestell_delete_solution(&solution);
  expect("deleted", gestell_count_tables(solution, &count, error), GESTELL_USAGE, "null");
  gestell_delete_solution(&solution);
  gestell_delete_solution(NULL);

  expect("Mathieu", gestell_solve_system(1, pi, mathieu, parameters, 1e-12, 64, text, numbers, 0, NULL, error), 0, NULL);
  /* The exponent 0.0995364372755138 of a = 1, q = 0.2, known to 16 digits; rho = -exp(0.0995... pi). */
  double wanted = -exp(0.0995364372755138 * pi);
  if (strcmp(text, "unstable") == 0 && fabs(numbers[0] - wanted) < 1e-12) passed++;
  else failed++, printf("FAIL  Mathieu: %s, %.17g, known %.17g\n", text, numbers[0], wanted);
  expect("gyroscope", gestell_solve_system(2, 1.0, gyroscope, NULL, 1e-10, 64, text, numbers, 3, numbers + 12, error), 0, NULL);
  /* At rest q = h / c = (2, 0) at all times, whatever B. */
  int rests = 1;
  for (int i = 0; i < 4; i++) rests = rests && fabs(numbers[12 + 4 * i] - 2) < 1e-9 && fabs(numbers[13 + 4 * i]) < 1e-9;
  /* s = (y + i z)'s exponents: s^2 + (0.1 + i) s + 4 = 0, so the sum of all arguments and |rho| are known: prod rho = exp(-0.2). */
  double product = 1;
  for (int i = 0; i < 4; i++) product *= hypot(numbers[i], numbers[4 + i]);
  if (rests && fabs(product - exp(-0.2)) < 1e-9) passed++;
  else failed++, printf("FAIL  gyroscope: product %.17g, q %.17g\n", product, numbers[12]);
  constant = nan("");
  expect("NaN from the function", gestell_solve_system(2, 1.0, garbage, NULL, 1e-9, 64, text, numbers, 0, NULL, error),
         GESTELL_FAILED, NULL);
  constant = 0;
  expect("no mass", gestell_solve_system(2, 1.0, garbage, NULL, 1e-9, 64, text, numbers, 0, NULL, error), GESTELL_FAILED, NULL);
  expect("no function", gestell_solve_system(1, pi, NULL, NULL, 1e-9, 64, text, numbers, 0, NULL, error), GESTELL_USAGE, "null");
  expect("no degree of freedom", gestell_solve_system(0, pi, mathieu, parameters, 1e-9, 64, text, numbers, 0, NULL, error),
         GESTELL_INPUT, NULL);
  expect("minus one", gestell_solve_system(-1, pi, mathieu, parameters, 1e-9, 64, text, numbers, 0, NULL, error), GESTELL_INPUT, NULL);
  expect("too many", gestell_solve_system(1 << 30, pi, mathieu, parameters, 1e-9, 64, text, numbers, 0, NULL, error), GESTELL_INPUT,
         "degrees of freedom");
  expect("no period", gestell_solve_system(1, 0, mathieu, parameters, 1e-9, 64, text, numbers, 0, NULL, error), GESTELL_INPUT, NULL);
  expect("no tolerance", gestell_solve_system(1, pi, mathieu, parameters, nan(""), 64, text, numbers, 0, NULL, error), GESTELL_INPUT,
         NULL);
  expect("no points", gestell_solve_system(1, pi, mathieu, parameters, 1e-9, 64, text, numbers, -1, numbers, error), GESTELL_INPUT,
         NULL);
  gestell_delete_machine(&machine);
  gestell_delete_error(&error);
  gestell_delete_error(NULL);
  printf("%d passed, %d failed\n", passed, failed);
  return failed != 0;
}
