/* Gestell: vibrations and stability of elastically mounted machine frames. C and C++; see doc/c.md.
 *
 * Every function that can fail returns the code of its error, 0 for success: GESTELL_USAGE and so on. The last argument takes the
 * message too, and may be NULL. Text is UTF-8 and ends with a zero. Arrays are the caller's; ask for their sizes first.
 * A handle that is NULL is an error, never a crash. Nothing is printed, and no state is kept but what the handles hold. */
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

/* The version, such as "1.0.0", into size characters. */
int gestell_get_version(int size, char *text);

/* ---- errors: code and message of the last call that was given the handle */
gestell_error gestell_new_error(void);
void gestell_delete_error(gestell_error *error);
int gestell_get_error(gestell_error error, int size, char *message);

/* ---- machines, in the language of input files (doc/input.md); paths as those of --set */
gestell_machine gestell_new_machine(void);
void gestell_delete_machine(gestell_machine *machine);
int gestell_read(gestell_machine machine, const char *file, gestell_error error);
int gestell_parse(gestell_machine machine, const char *text, gestell_error error);
/* Groups, as "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16 /", to a machine that is there or to a new one. */
int gestell_add(gestell_machine machine, const char *groups, gestell_error error);
/* A whole number is set as one, so that keys of whole numbers take it. */
int gestell_set(gestell_machine machine, const char *path, double value, gestell_error error);
int gestell_set_text(gestell_machine machine, const char *path, const char *value, gestell_error error);
int gestell_count_values(gestell_machine machine, const char *path, int *count, gestell_error error);
int gestell_get_values(gestell_machine machine, const char *path, int count, double *values, gestell_error error);

/* ---- solutions: of the tasks of the input, or of these, as "stability, response" */
int gestell_solve(gestell_machine machine, const char *tasks, gestell_solution *solution, gestell_error error);
void gestell_delete_solution(gestell_solution *solution);

/* "verdict", "report" (for people; computed when it is asked for), "failure" (what could not be computed beside the verdict);
 * sizes count the zero at the end. */
int gestell_size_text(gestell_solution solution, const char *what, int *size, gestell_error error);
int gestell_get_text(gestell_solution solution, const char *what, int size, char *text, gestell_error error);

/* The multipliers, the largest first, with bounds on their errors. */
int gestell_count_multipliers(gestell_solution solution, int *count, gestell_error error);
int gestell_get_multipliers(gestell_solution solution, int count, double *re, double *im, double *bounds, gestell_error error);

/* The vibration of a quantity, as "f" or "probe(outlet).v": peak, rms, bounds on their errors; amplitudes of the orders 1, 2, ...
 * (harmonics of the period, where ratios of shafts make it several turns); values at equidistant times of the period, both ends
 * included. unit takes size characters, 16 at least; amplitudes and history may be NULL. */
int gestell_describe_response(gestell_solution solution, const char *quantity, int *orders, int *points, int size, char *unit,
                              gestell_error error);
int gestell_get_response(gestell_solution solution, const char *quantity, double numbers[4], int orders, double *amplitudes,
                         int points, double *history, gestell_error error);

/* The files that the program would write; the pictures too, by gnuplot, unless pictures is 0. */
int gestell_write(gestell_solution solution, const char *folder, int pictures, gestell_error error);

/* ---- tables (doc/output.md); tables and columns count from 0 */
int gestell_count_tables(gestell_solution solution, int *count, gestell_error error);
int gestell_name_table(gestell_solution solution, int index, int size, char *name, gestell_error error);
int gestell_shape_table(gestell_solution solution, const char *table, int *rows, int *columns, gestell_error error);
/* key, unit and error_key (the column with the errors) take size characters each; width: the longest of the words, at least 1, and
 * what gestell_get_words needs for each. */
int gestell_describe_column(gestell_solution solution, const char *table, int column, int size, char *key, char *unit,
                            char *error_key, int *kind, int *width, gestell_error error);
int gestell_get_numbers(gestell_solution solution, const char *table, int column, int rows, double *values, gestell_error error);
int gestell_get_integers(gestell_solution solution, const char *table, int column, int rows, int *values, gestell_error error);
int gestell_get_words(gestell_solution solution, const char *table, int column, int rows, int width, char *values,
                      gestell_error error);

/* ---- a system of your own: M q'' + B q' + C q = h, with dof degrees of freedom and that period. The function fills M, B, C, dof
 * rows of dof numbers each, and h (zeros at first) at a time from 0 to the period, which may come in any order; data is yours.
 * verdict takes size characters, 10 at least; multipliers 6 dof numbers: real parts, imaginary parts, bounds on the errors; motion,
 * unless NULL, 2 dof (points + 2): q and q' at points + 1 equidistant times of the periodic motion, and bounds on their errors. */
typedef void (*gestell_coefficients)(double t, int dof, double *m, double *b, double *c, double *h, void *data);
int gestell_solve_system(int dof, double period, gestell_coefficients coefficients, void *data, double tolerance, int size,
                         char *verdict, double *multipliers, int points, double *motion, gestell_error error);

#ifdef __cplusplus
}
#endif

#endif
