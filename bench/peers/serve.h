/* What every compiled peer does around its integrator: it reads orders from standard input, a line each,
 *
 *     machine rpm method setting seconds size unit_1 ... unit_n
 *
 * integrates over one period again and again for about so many seconds, and answers in one line
 *
 *     shortest time, median time, runs, evaluations, Phi(T) in rows of six or twelve, x0
 *
 * or "failed". The setting is a tolerance or a number of steps, as the method wants. The machine's name may be followed by a
 * factor of the stiffness, as in khang_four_bar*0.5. Included once, after `integrate`. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { most_runs = 1001 };

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* x0 = (E - Phi)^-1 x_p, in balanced units, by elimination with pivots. */
static void periodic_start(const double *y, double *x0) {
  double a[states][columns];
  for (int i = 0; i < states; i++)
    for (int j = 0; j < columns; j++) a[i][j] = j < states ? (i == j) - y[columns * i + j] : y[columns * i + j];
  for (int k = 0; k < states; k++) {
    int pivot = k;
    for (int i = k + 1; i < states; i++)
      if (fabs(a[i][k]) > fabs(a[pivot][k])) pivot = i;
    for (int j = 0; j < columns; j++) {
      const double swapped = a[k][j];
      a[k][j] = a[pivot][j];
      a[pivot][j] = swapped;
    }
    for (int i = k + 1; i < states; i++) {
      const double factor = a[i][k] / a[k][k];
      for (int j = k; j < columns; j++) a[i][j] -= factor * a[k][j];
    }
  }
  for (int i = states - 1; i >= 0; i--) {
    x0[i] = a[i][states];
    for (int j = i + 1; j < states; j++) x0[i] -= a[i][j] * x0[j];
    x0[i] /= a[i][i];
  }
}

static int solve(right_hand_side side, const machine *k, const char *method, double setting, double *y, double *x0,
                 long *evaluations) {
  for (int i = 0; i < numbers; i++) y[i] = 0;
  for (int i = 0; i < states; i++) y[columns * i + i] = 1;
  *evaluations = 0;
  if (integrate(side, k, method, setting, y, evaluations)) return 1;
  periodic_start(y, x0);
  return 0;
}

int main(void) {
  char name[64], method[64];
  double rpm, setting, seconds;
  machine k;
  static double times[most_runs];

  while (scanf("%63s %lf %63s %lf %lf", name, &rpm, method, &setting, &seconds) == 5) {
    char *factor = strchr(name, '*');
    if (factor) *factor++ = 0;
    const right_hand_side side = find_machine(name, rpm, &k);
    if (side && factor) scale_stiffness(&k, atof(factor));
    double y[numbers], x0[states];
    long evaluations = 0;
    int runs = 0, failed = side == 0 || scanf("%lf", &k.size) != 1;
    for (int i = 0; i < states; i++) failed |= scanf("%lf", &k.unit[i]) != 1;
    for (const double begin = now(); !failed && runs < most_runs && (runs == 0 || now() - begin < seconds); runs++) {
      const double start = now();
      failed = solve(side, &k, method, setting, y, x0, &evaluations);
      times[runs] = now() - start;
    }
    if (failed) {
      puts("failed");
    } else {
      qsort(times, runs, sizeof *times, ascending);
      printf("%.9e,%.9e,%d,%ld", times[0], times[runs / 2], runs, evaluations);
      for (int i = 0; i < states; i++)
        for (int j = 0; j < states; j++) printf(",%.17e", y[columns * i + j] * k.unit[i] / k.unit[j]);
      for (int i = 0; i < states; i++) printf(",%.17e", x0[i] * k.size * k.unit[i]);
      putchar('\n');
    }
    fflush(stdout);
  }
  return 0;
}
