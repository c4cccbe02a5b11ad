// Boost.odeint: Runge-Kutta-Fehlberg 7(8) with control of the step (rkf78) and with equal steps (rkf78-steps), and the
// extrapolation of Bulirsch and Stoer (bulirsch-stoer).
#include "model.h"
#include <array>
#include <boost/numeric/odeint.hpp>

namespace odeint = boost::numeric::odeint;
using state = std::array<double, numbers>;

static int integrate(right_hand_side side, const machine *k, const char *method, double setting, double *y,
                     long *evaluations) {
  long count = 0;
  auto right_side = [&](const state &x, state &dx, double t) {
    count++;
    side(k, t, x.data(), dx.data());
  };
  using fehlberg = odeint::runge_kutta_fehlberg78<state>;
  state x;
  std::copy(y, y + numbers, x.begin());
  try {
    if (std::strcmp(method, "rkf78-steps") == 0) {
      const long steps = static_cast<long>(setting);
      odeint::integrate_n_steps(fehlberg(), right_side, x, 0.0, k->period / steps, steps);
    } else if (std::strcmp(method, "rkf78") == 0) {
      odeint::integrate_adaptive(odeint::make_controlled<fehlberg>(setting, setting), right_side, x, 0.0, k->period,
                                 k->period * 1e-4);
    } else {
      odeint::bulirsch_stoer<state> stepper(setting, setting);
      odeint::integrate_adaptive(stepper, right_side, x, 0.0, k->period, k->period * 1e-4);
    }
  } catch (const std::exception &) {
    return 1;
  }
  std::copy(x.begin(), x.end(), y);
  *evaluations = count;
  return 0;
}

#include "serve.h"
