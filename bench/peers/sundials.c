/* SUNDIALS: ARKODE's explicit pairs of orders 8(7), Fehlberg (erk8), and 6(5), Verner (erk6), erk8 also with equal steps
 * (erk8-steps), and CVODE's Adams methods (adams) with the fixed-point iteration. */
#include "model.h"
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

typedef struct { right_hand_side side; const machine *k; long evaluations; } problem;

static int right_side(realtype t, N_Vector y, N_Vector dy, void *given) {
  problem *p = (problem *)given;
  p->evaluations++;
  p->side(p->k, t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
  return 0;
}

static int runge_kutta(SUNContext context, problem *p, const char *method, double setting, N_Vector y) {
  const double period = p->k->period;
  const int order6 = strcmp(method, "erk6") == 0;
  realtype t = 0;
  void *memory = ERKStepCreate(right_side, 0, y, context);
  int status = ERKStepSetTableNum(memory, order6 ? ARKODE_VERNER_8_5_6 : ARKODE_FEHLBERG_13_7_8);
  ERKStepSetUserData(memory, p);
  ERKStepSetMaxNumSteps(memory, 100000000);
  ERKStepSetStopTime(memory, period);
  if (strcmp(method, "erk8-steps") == 0) {
    ERKStepSStolerances(memory, 1e-6, 1e-6);
    ERKStepSetFixedStep(memory, period / setting);
  } else {
    ERKStepSStolerances(memory, setting, setting);
  }
  if (status >= 0) status = ERKStepEvolve(memory, period, y, &t, ARK_NORMAL);
  ERKStepFree(&memory);
  return status < 0;
}

static int adams(SUNContext context, problem *p, double setting, N_Vector y) {
  const double period = p->k->period;
  realtype t = 0;
  void *memory = CVodeCreate(CV_ADAMS, context);
  SUNNonlinearSolver iteration = SUNNonlinSol_FixedPoint(y, 0, context);
  CVodeInit(memory, right_side, 0, y);
  CVodeSStolerances(memory, setting, setting);
  CVodeSetNonlinearSolver(memory, iteration);
  CVodeSetUserData(memory, p);
  CVodeSetMaxNumSteps(memory, 100000000);
  CVodeSetStopTime(memory, period);
  const int status = CVode(memory, period, y, &t, CV_NORMAL);
  CVodeFree(&memory);
  SUNNonlinSolFree(iteration);
  return status < 0;
}

static int integrate(right_hand_side side, const machine *k, const char *method, double setting, double *y,
                     long *evaluations) {
  problem p = {side, k, 0};
  SUNContext context;
  if (SUNContext_Create(0, &context)) return 1;
  N_Vector vector = N_VMake_Serial(numbers, y, context);
  const int failed = strcmp(method, "adams") == 0 ? adams(context, &p, setting, vector)
                                                  : runge_kutta(context, &p, method, setting, vector);
  N_VDestroy(vector);
  SUNContext_Free(&context);
  *evaluations = p.evaluations;
  return failed;
}

#include "serve.h"
