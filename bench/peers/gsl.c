/* GSL's rk8pd (Prince and Dormand, order 8), with its control of the step (rk8pd) and with equal steps (rk8pd-steps),
 * and its Adams method of variable order (msadams). */
#include "model.h"
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

typedef struct { right_hand_side side; const machine *k; long evaluations; } problem;

static int right_side(double t, const double y[], double dy[], void *given) {
  problem *p = (problem *)given;
  p->evaluations++;
  p->side(p->k, t, y, dy);
  return GSL_SUCCESS;
}

static int integrate(right_hand_side side, const machine *k, const char *method, double setting, double *y,
                     long *evaluations) {
  problem p = {side, k, 0};
  gsl_odeiv2_system system = {right_side, 0, numbers, &p};
  const gsl_odeiv2_step_type *type = strcmp(method, "msadams") == 0 ? gsl_odeiv2_step_msadams : gsl_odeiv2_step_rk8pd;
  double t = 0;
  int status;

  gsl_set_error_handler_off();
  if (strcmp(method, "rk8pd-steps") == 0) {
    /* The step alone: `gsl_odeiv2_driver_apply_fixed_step` evaluates the slope at both ends of every step. */
    gsl_odeiv2_step *step = gsl_odeiv2_step_alloc(type, numbers);
    double error[numbers];
    const long steps = (long)setting;
    status = GSL_SUCCESS;
    for (long i = 0; i < steps && status == GSL_SUCCESS; i++)
      status = gsl_odeiv2_step_apply(step, k->period * i / steps, k->period / steps, y, error, 0, 0, &system);
    gsl_odeiv2_step_free(step);
  } else {
    gsl_odeiv2_driver *driver = gsl_odeiv2_driver_alloc_y_new(&system, type, k->period * 1e-4, setting, setting);
    status = gsl_odeiv2_driver_apply(driver, &t, k->period, y);
    gsl_odeiv2_driver_free(driver);
  }
  *evaluations = p.evaluations;
  return status != GSL_SUCCESS;
}

#include "serve.h"
