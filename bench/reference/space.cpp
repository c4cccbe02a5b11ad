// Adds the case of six degrees of freedom to bench/reference.dat, from the right-hand side of bench/peers/space.h in long double:
//
//     g++ -O2 bench/reference/space.cpp -o space && ./space >>bench/reference.dat
//
// Two tolerances, whose difference is told, as in reference.f90. Units balance the states: 1/sqrt(m), 1/sqrt(J_ii), times w_max for
// velocities, w_max the square root of the greatest C_ii/M_ii of the mean turn's first angle.
#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <cstdio>
#include <cstring>
using std::cos;
using std::sin;
using std::sqrt;
#define SPACE
#define double long double
#include "../peers/model.h"
using state = std::array<double, numbers>;

static state integrate(right_hand_side side, const machine &k, double tolerance) {
  namespace odeint = boost::numeric::odeint;
  state y{};
  for (int i = 0; i < states; i++) y[columns * i + i] = 1;
  auto right_side = [&](const state &x, state &dx, double t) { side(&k, t, x.data(), dx.data()); };
  using fehlberg = odeint::runge_kutta_fehlberg78<state, double, state, double>;
  odeint::integrate_adaptive(odeint::make_controlled<fehlberg>(tolerance, tolerance), right_side, y, 0.0L, k.period,
                             k.period * 1e-4L);
  return y;
}

static void row(const char *key, const double *values, int n) {
  std::printf("%s", key);
  for (int i = 0; i < n; i++) std::printf(" %27.20Le", values[i]);
  std::printf("\n");
}

/* x0 = (E - Phi)^-1 x_p. */
static void start(const state &y, double *x0) {
  double a[states][columns];
  for (int i = 0; i < states; i++)
    for (int j = 0; j < columns; j++) a[i][j] = j < states ? (i == j) - y[columns * i + j] : y[columns * i + j];
  for (int k = 0; k < states; k++) {
    int pivot = k;
    for (int i = k + 1; i < states; i++)
      if (std::abs(a[i][k]) > std::abs(a[pivot][k])) pivot = i;
    std::swap(a[k], a[pivot]);
    for (int i = 0; i < states; i++) {
      const double factor = a[i][k] / a[k][k];
      for (int j = k; i != k && j < columns; j++) a[i][j] -= factor * a[k][j];
    }
  }
  for (int i = 0; i < states; i++) x0[i] = a[i][states] / a[i][i];
}

int main() {
  machine k;
  const double rpm = 180, tolerances[2] = {1e-15L, 1e-17L};
  const right_hand_side side = find_machine("watt_beside", rpm, &k);
  const sums a = six_bar_beside(&k, 0);
  double fastest = 0, x0[2][states], norm[3] = {0, 0, 0}, change[3] = {0, 0, 0};
  for (int i = 0; i < 6; i++) {
    const double m = i < 3 ? k.mass + k.links_mass : k.tensor[i - 3][i - 3] + a.j[0][i - 3][i - 3];
    fastest = std::fmax(fastest, sqrt(k.stiffness[i][i] / m));
    k.unit[i] = 1 / sqrt(m);
  }
  for (int i = 0; i < 6; i++) k.unit[6 + i] = fastest * k.unit[i];
  k.size = 1;
  const state y[2] = {integrate(side, k, tolerances[0]), integrate(side, k, tolerances[1])};
  for (int n = 0; n < 2; n++) start(y[n], x0[n]);
  for (int i = 0; i < states; i++)
    for (int j = 0; j < columns; j++) {
      const double scale = j < states ? k.unit[i] / k.unit[j] : k.unit[i];
      norm[j == states] += std::pow(y[1][columns * i + j] * scale, 2);
      change[j == states] += std::pow((y[1][columns * i + j] - y[0][columns * i + j]) * scale, 2);
    }
  for (int i = 0; i < states; i++) {
    norm[2] += std::pow(x0[1][i] * k.unit[i], 2);
    change[2] += std::pow((x0[1][i] - x0[0][i]) * k.unit[i], 2);
  }
  std::printf("case watt_beside %.3Lf %.3Lf\n", rpm, fastest * k.period);
  row("scale", k.unit, states);
  double values[states];
  for (int i = 0; i < states; i++) {
    for (int j = 0; j < states; j++) values[j] = y[1][columns * i + j] * k.unit[i] / k.unit[j];
    row("phi", values, states);
  }
  for (int i = 0; i < states; i++) values[i] = y[1][columns * i + states] * k.unit[i];
  row("xp", values, states);
  for (int i = 0; i < states; i++) values[i] = x0[1][i] * k.unit[i];
  row("x0", values, states);
  std::printf("change %9.2Le %9.2Le %9.2Le\n", sqrt(change[0] / norm[0]), sqrt(change[1] / norm[1]), sqrt(change[2] / norm[2]));
}
