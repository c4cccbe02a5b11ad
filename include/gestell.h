/* Gestell: vibrations and stability of elastically mounted machine frames, for C and C++. See doc/c.md.
 *
 * Every function that can fail returns 0 for success or the code of its error: GESTELL_USAGE and so on. The last argument, which
 * may be NULL, also receives the error's message. Text is UTF-8 and ends with a zero byte. The caller allocates all arrays; other
 * functions return the sizes they need. A NULL handle is an error and does not crash. The library prints nothing and keeps no
 * state outside the handles. */
#ifndef GESTELL_H
#define GESTELL_H

#ifdef __cplusplus
extern "C" {
#endif

enum { GESTELL_SUCCESS, GESTELL_USAGE, GESTELL_INPUT, GESTELL_IMPOSSIBLE, GESTELL_FAILED };
enum { GESTELL_NUMBERS, GESTELL_INTEGERS, GESTELL_WORDS };

typedef struct gestell_error_s *gestell_error;
typedef struct gestell_machine_s *gestell_machine;
typedef struct gestell_solution_s *gestell_solution;

/* Copies the version, for example "1.0.0", to text, which has room for size characters. */
int gestell_get_version(int size, char *text);

/* ---- errors: gestell_get_error returns code and message of the last call that used the handle */
gestell_error gestell_new_error(void);
void gestell_delete_error(gestell_error *error);
int gestell_get_error(gestell_error error, int size, char *message);

/* ---- machines, in the language of input files (doc/input.md); a path names a number as in the option --set */
gestell_machine gestell_new_machine(void);
int gestell_copy_machine(gestell_machine machine, gestell_machine *copy, gestell_error error);
void gestell_delete_machine(gestell_machine *machine);
int gestell_read(gestell_machine machine, const char *file, gestell_error error);
int gestell_parse(gestell_machine machine, const char *text, gestell_error error);
/* As gestell_parse; messages and reports call the text by the name, for example that of the file from which it comes. */
int gestell_parse_named(gestell_machine machine, const char *text, const char *name, gestell_error error);
/* Adds groups, for example "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16 /". The machine may still be empty. */
int gestell_add(gestell_machine machine, const char *groups, gestell_error error);
/* Removes groups, for example "support(2)" or, all of them, "probe". */
int gestell_remove(gestell_machine machine, const char *groups, gestell_error error);
/* Sets the number at a path, in the units of the input. Keys that require a whole number accept a whole value. */
int gestell_set(gestell_machine machine, const char *path, double value, gestell_error error);
int gestell_set_text(gestell_machine machine, const char *path, const char *value, gestell_error error);
/* Count and copy the numbers at a path. */
int gestell_count_values(gestell_machine machine, const char *path, int *count, gestell_error error);
int gestell_get_values(gestell_machine machine, const char *path, int count, double *values, gestell_error error);
/* The values at a path, or all if path is NULL, in JSON: an array with an object for each key that the input contains. Its members are
 * path, values (numbers or strings), unit, meaning, least, most and others as for the machine in results.json. The size includes the
 * zero byte at the end. */
int gestell_size_parameters(gestell_machine machine, const char *path, int *size, gestell_error error);
int gestell_get_parameters(gestell_machine machine, const char *path, int size, char *text, gestell_error error);
/* The machine as the text of an input file, with all values set and groups added. The size includes the zero byte at the end. */
int gestell_size_input(gestell_machine machine, int *size, gestell_error error);
int gestell_get_input(gestell_machine machine, int size, char *text, gestell_error error);

/* ---- solutions: gestell_solve runs the tasks of the input (tasks is NULL) or those listed, for example "stability, response" */
int gestell_solve(gestell_machine machine, const char *tasks, gestell_solution *solution, gestell_error error);
void gestell_delete_solution(gestell_solution *solution);
/* Solves count machines on several cores: threads is the number of threads, or 0 for the default of OpenMP. solutions[i] becomes NULL
 * where machine i cannot be solved; errors[i], unless errors is NULL, then receives the message. Returns the code of the first machine
 * that cannot be solved, or 0. Not faster with a library built without OpenMP. */
int gestell_solve_many(int count, const gestell_machine *machines, const char *tasks, int threads, gestell_solution *solutions,
                       const gestell_error *errors);

/* The text `what` is "verdict", "report" (the program's report), "results" (all results and the machine in JSON, as in
 * results.json), "input" (an input file that requests the same results), "page" (the report as an HTML page, without gnuplot's
 * pictures) or "failure" (why a result other than the verdict could not be computed; empty if there is none). Texts are composed on
 * request. Sizes include the zero byte at the end. */
int gestell_size_text(gestell_solution solution, const char *what, int *size, gestell_error error);
int gestell_get_text(gestell_solution solution, const char *what, int size, char *text, gestell_error error);

/* The multipliers in descending magnitude: real parts, imaginary parts and bounds on their errors. */
int gestell_count_multipliers(gestell_solution solution, int *count, gestell_error error);
int gestell_get_multipliers(gestell_solution solution, int count, double *re, double *im, double *bounds, gestell_error error);

/* The vibration of a quantity, for example "f" or "probe(outlet).v". numbers receives peak, rms, and bounds on the errors of both.
 * amplitudes receives the amplitudes of the orders 1, 2, ...; if gear ratios make the period several turns long, those of the
 * harmonics of the period. history receives the values at equidistant times of the period, both ends included. amplitudes and
 * history may be NULL. unit has room for size characters; 16 are enough. */
int gestell_describe_response(gestell_solution solution, const char *quantity, int *orders, int *points, int size, char *unit,
                              gestell_error error);
int gestell_get_response(gestell_solution solution, const char *quantity, double numbers[4], int orders, double *amplitudes,
                         int points, double *history, gestell_error error);

/* Writes the program's files to the folder. Unless pictures is 0, gnuplot draws the pictures too. */
int gestell_write(gestell_solution solution, const char *folder, int pictures, gestell_error error);

/* ---- tables (doc/output.md); the indices of tables and columns start at 0 */
int gestell_count_tables(gestell_solution solution, int *count, gestell_error error);
int gestell_name_table(gestell_solution solution, int index, int size, char *name, gestell_error error);
int gestell_shape_table(gestell_solution solution, const char *table, int *rows, int *columns, gestell_error error);
/* key, unit and error_key (key of the column with the error bounds, or empty) have room for size characters each. kind is
 * GESTELL_NUMBERS, GESTELL_INTEGERS or GESTELL_WORDS. width is the length of the longest word, at least 1; gestell_get_words copies
 * rows words of width characters each. */
int gestell_describe_column(gestell_solution solution, const char *table, int column, int size, char *key, char *unit,
                            char *error_key, int *kind, int *width, gestell_error error);
int gestell_get_numbers(gestell_solution solution, const char *table, int column, int rows, double *values, gestell_error error);
int gestell_get_integers(gestell_solution solution, const char *table, int column, int rows, int *values, gestell_error error);
int gestell_get_words(gestell_solution solution, const char *table, int column, int rows, int width, char *values,
                      gestell_error error);

/* ---- a system of your own: M q'' + B q' + C q = h with dof degrees of freedom and periodic coefficients.
 * The function `coefficients` fills M, B and C (dof rows of dof numbers each) and h (zero on entry) at the time t. Times lie
 * between 0 and the period and come in any order. data is passed on to the function unchanged.
 * verdict has room for size characters; 10 are enough. multipliers receives 6 dof numbers: 2 dof real parts, 2 dof imaginary parts
 * and 2 dof bounds on the errors. motion, unless NULL, receives 2 dof (points + 2) numbers: q and q' at points + 1 equidistant
 * times of the periodic motion, then bounds on their errors. */
typedef void (*gestell_coefficients)(double t, int dof, double *m, double *b, double *c, double *h, void *data);
int gestell_solve_system(int dof, double period, gestell_coefficients coefficients, void *data, double tolerance, int size,
                         char *verdict, double *multipliers, int points, double *motion, gestell_error error);

#ifdef __cplusplus
}
#endif

#endif
