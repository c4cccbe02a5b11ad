/* The frame of three mechanisms of data/ as a right-hand side y' = P y + f, as one would write it by hand.
 *
 * With SPACE it is that of a machine with six degrees of freedom (space.h).
 * y holds the rows of [Phi | x_p], six of seven numbers each, in balanced units: D^-1 [Phi D | x_p / size] with D = diag(unit).
 * Derivatives of the kinematics are with respect to the crank angle. Equation numbers are those of doc/theory.md. C and C++. */
#ifndef MODEL_H
#define MODEL_H
#include <math.h>
#include <string.h>

#ifdef SPACE
enum { states = 12 };
#else
enum { states = 6 };
#endif
enum { dofs = states / 2, columns = states + 1, numbers = columns * states };

static const double pi = 3.14159265358979323846;

typedef struct { double x, y, vx, vy, ax, ay; } point;

/* a1 to a4 of (4) to (7): value, first and second derivative. */
typedef struct { double a1[3], a2[3], a3[3], a4; } mass_functions;

typedef struct {
  double omega, period, mass, inertia, links_mass, links_inertia, xi, eta;
  double stiffness[dofs][dofs], damping[dofs][dofs], tensor[3][3];
  double unit[states], size;
} machine;

typedef void (*right_hand_side)(const machine *, double t, const double *y, double *dy);

/* ---- kinematics ------------------------------------------------------------------------------------------------- */

static inline point crank(double radius, double angle) {
  const double x = radius * cos(angle), y = radius * sin(angle);
  return (point){x, y, -y, x, -x, -y};
}

static inline point ground(double x, double y) { return (point){x, y, 0, 0, 0, 0}; }

/* The joint at l1 from p and l2 from q, left of the way from p to q. Its velocity v solves
 * (r - p).(v - v_p) = 0, (r - q).(v - v_q) = 0, its acceleration the same with -|v - v_p|^2, -|v - v_q|^2 on the right. */
static inline point dyad(point p, point q, double l1, double l2) {
  const double ex = q.x - p.x, ey = q.y - p.y, d2 = ex * ex + ey * ey;
  const double along = (d2 + (l1 - l2) * (l1 + l2)) / (2 * d2), across = sqrt(l1 * l1 / d2 - along * along);
  const double ux = along * ex - across * ey, uy = along * ey + across * ex, wx = ux - ex, wy = uy - ey;
  const double one = 1 / (ux * wy - uy * wx);
  const double gu = ux * p.vx + uy * p.vy, gw = wx * q.vx + wy * q.vy;
  const double vx = (gu * wy - gw * uy) * one, vy = (gw * ux - gu * wx) * one;
  const double pu = vx - p.vx, pv = vy - p.vy, qu = vx - q.vx, qv = vy - q.vy;
  const double hu = ux * p.ax + uy * p.ay - pu * pu - pv * pv, hw = wx * q.ax + wy * q.ay - qu * qu - qv * qv;
  return (point){p.x + ux, p.y + uy, vx, vy, (hu * wy - hw * uy) * one, (hw * ux - hu * wx) * one};
}

/* The point on the y-axis at l from p, above it. */
static inline point slider(point p, double l) {
  const double u = sqrt(l * l - p.x * p.x), v = -p.x * p.vx / u;
  return (point){0, p.y + u, 0, p.vy + v, 0, p.ay - (p.vx * p.vx + p.x * p.ax + v * v) / u};
}

/* A point of the body from p to q, `length` apart: `along` that way and `left` of it. */
static inline point carried(point p, point q, double length, double along, double left) {
  const double a = along / length, b = left / length;
  return (point){p.x + a * (q.x - p.x) - b * (q.y - p.y), p.y + a * (q.y - p.y) + b * (q.x - p.x),
                 p.vx + a * (q.vx - p.vx) - b * (q.vy - p.vy), p.vy + a * (q.vy - p.vy) + b * (q.vx - p.vx),
                 p.ax + a * (q.ax - p.ax) - b * (q.ay - p.ay), p.ay + a * (q.ay - p.ay) + b * (q.ax - p.ax)};
}

#ifdef SPACE
#include "space.h"
#else
static inline void add_mass(mass_functions *a, double m, point c) {
  a->a1[0] += m * c.x, a->a1[1] += m * c.vx, a->a1[2] += m * c.ax;
  a->a2[0] += m * c.y, a->a2[1] += m * c.vy, a->a2[2] += m * c.ay;
  a->a3[0] += m * (c.x * c.x + c.y * c.y);
  a->a3[1] += 2 * m * (c.x * c.vx + c.y * c.vy);
  a->a3[2] += 2 * m * (c.vx * c.vx + c.vy * c.vy + c.x * c.ax + c.y * c.ay);
  a->a4 += m * (c.x * c.ay - c.y * c.ax);
}

static inline void add_link(mass_functions *a, point p, point q, double length, double m, double inertia, double along,
                            double left) {
  add_mass(a, m, carried(p, q, length, along, left));
  a->a4 += inertia * ((q.x - p.x) * (q.ay - p.ay) - (q.y - p.y) * (q.ax - p.ax)) / (length * length);
}

/* ---- the mechanisms of data/ ------------------------------------------------------------------------------------ */

static inline mass_functions four_bar(double angle) {
  const point o = ground(0, 0), b0 = ground(0.40, 0), a = crank(0.07, angle), b = dyad(a, b0, 0.37, 0.16);
  mass_functions s = {{0}, {0}, {0}, 0};
  add_link(&s, o, a, 0.07, 0.50, 0.0035, 0.03, 0);
  add_link(&s, a, b, 0.37, 0.60, 0.0070, 0.18, 0);
  add_link(&s, b0, b, 0.16, 0.25, 0.0060, 0.08, 0);
  return s;
}

static inline mass_functions slider_crank(double angle) {
  const point o = ground(0, 0), a = crank(0.05, angle), b = slider(a, 0.20);
  mass_functions s = {{0}, {0}, {0}, 0};
  add_link(&s, o, a, 0.05, 2.0, 0.002, 0.01, 0);
  add_link(&s, a, b, 0.20, 0.6, 0.003, 0.065, 0);
  add_mass(&s, 0.5, b);
  return s;
}

static inline mass_functions six_bar(double angle) {
  const point o = ground(0, 0), b0 = ground(0.22, 0), a = crank(0.08, angle), b = dyad(a, b0, 0.24, 0.18);
  const point c = carried(a, b, 0.24, 0.12, 0.10), e = carried(b0, b, 0.18, 0.18, -0.12), d = dyad(c, e, 0.22, 0.20);
  mass_functions s = {{0}, {0}, {0}, 0};
  add_link(&s, o, a, 0.08, 0.9, 0.0015, 0.02, 0);
  add_link(&s, a, b, 0.24, 1.4, 0.0110, 0.12, 0.033);
  add_link(&s, b0, b, 0.18, 1.2, 0.0080, 0.12, -0.04);
  add_link(&s, c, d, 0.22, 0.7, 0.0030, 0.11, 0);
  add_link(&s, e, d, 0.20, 1.0, 0.0060, 0.10, 0);
  return s;
}

static inline void add_support(machine *k, double x, double y, double kx, double ky, double bx, double by) {
  const double g[2][3] = {{1, 0, -y}, {0, 1, x}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      k->stiffness[i][j] += kx * g[0][i] * g[0][j] + ky * g[1][i] * g[1][j];
      k->damping[i][j] += bx * g[0][i] * g[0][j] + by * g[1][i] * g[1][j];
    }
}

static inline void scale_stiffness(machine *k, double factor) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) k->stiffness[i][j] *= factor;
}

/* ---- the frame -------------------------------------------------------------------------------------------------- */

/* (9) to (12), M eliminated once for C, B and h together: G = -M^-1 [C B] and M^-1 h, then y' for all columns. */
static inline void frame(const machine *k, mass_functions a, const double *y, double *dy) {
  const double w = k->omega, w2 = w * w, m = k->mass + k->links_mass;
  const double m13 = -(k->links_mass * k->eta + a.a2[0]), m23 = k->links_mass * k->xi + a.a1[0];
  const double m33 = k->inertia + k->links_inertia + k->links_mass * (k->xi * k->xi + k->eta * k->eta) + a.a3[0] +
                     2 * (k->xi * a.a1[0] + k->eta * a.a2[0]);
  const double one_m = 1 / m, p = m13 * one_m, q = m23 * one_m, one_j = 1 / (m33 - m13 * p - m23 * q);
  double g[3][7];

  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      g[i][j] = -k->stiffness[i][j];
      g[i][3 + j] = -k->damping[i][j];
    }
  g[0][2] += w2 * a.a2[2];
  g[1][2] -= w2 * a.a1[2];
  g[0][5] += 2 * w * a.a2[1];
  g[1][5] -= 2 * w * a.a1[1];
  g[2][5] -= w * (a.a3[1] + 2 * (k->xi * a.a1[1] + k->eta * a.a2[1]));
  g[0][6] = -w2 * a.a1[2];
  g[1][6] = -w2 * a.a2[2];
  g[2][6] = -w2 * (k->xi * a.a2[2] - k->eta * a.a1[2] + a.a4);
  for (int j = 0; j < 7; j++) {
    const double unit = j < 6 ? k->unit[j] : 1 / k->size;
    const double turn = (g[2][j] - p * g[0][j] - q * g[1][j]) * one_j;
    const double first = g[0][j] * one_m - p * turn, second = g[1][j] * one_m - q * turn;
    g[0][j] = first * unit / k->unit[3];
    g[1][j] = second * unit / k->unit[4];
    g[2][j] = turn * unit / k->unit[5];
  }

  for (int i = 0; i < 3; i++) {
    const double rate = k->unit[3 + i] / k->unit[i];
    for (int c = 0; c < columns; c++) dy[columns * i + c] = rate * y[columns * (3 + i) + c];
    double row[columns] = {0, 0, 0, 0, 0, 0, g[i][6]};
    for (int j = 0; j < 6; j++)
      for (int c = 0; c < columns; c++) row[c] += g[i][j] * y[columns * j + c];
    for (int c = 0; c < columns; c++) dy[columns * (3 + i) + c] = row[c];
  }
}

static void four_bar_side(const machine *k, double t, const double *y, double *dy) { frame(k, four_bar(k->omega * t), y, dy); }
static void slider_crank_side(const machine *k, double t, const double *y, double *dy) {
  frame(k, slider_crank(k->omega * t), y, dy);
}
static void six_bar_side(const machine *k, double t, const double *y, double *dy) { frame(k, six_bar(k->omega * t), y, dy); }

/* The machine of a name and its right-hand side; 0 if there is none. Units and size stay to be set. */
static right_hand_side find_machine(const char *name, double rpm, machine *k) {
  memset(k, 0, sizeof *k);
  k->omega = rpm * pi / 30;
  k->period = 60 / rpm;
  if (strcmp(name, "khang_four_bar") == 0) {
    k->mass = 18.0, k->inertia = 0.78, k->xi = -0.20, k->eta = 0.20, k->links_mass = 1.35, k->links_inertia = 0.0165;
    for (int i = 0; i < 4; i++) add_support(k, -0.30 + 0.20 * i, -0.20, 196133.0, 196133.0, 0, 0);
    k->damping[0][0] = 0.5, k->damping[1][1] = 0.5, k->damping[2][2] = 0.05;
    return four_bar_side;
  }
  if (strcmp(name, "compressor") == 0) {
    k->mass = 45.0, k->inertia = 1.6, k->xi = 0, k->eta = 0.05, k->links_mass = 3.1, k->links_inertia = 0.005;
    add_support(k, -0.20, -0.25, 6.0e4, 1.2e5, 60.0, 120.0);
    add_support(k, 0.20, -0.25, 6.0e4, 1.2e5, 60.0, 120.0);
    return slider_crank_side;
  }
  if (strcmp(name, "watt_six_bar") == 0) {
    k->mass = 60.0, k->inertia = 2.5, k->xi = -0.10, k->eta = 0.15, k->links_mass = 5.2, k->links_inertia = 0.0295;
    add_support(k, -0.30, -0.20, 8.0e4, 2.0e5, 80.0, 150.0);
    add_support(k, 0.30, -0.20, 8.0e4, 2.0e5, 80.0, 150.0);
    return six_bar_side;
  }
  return 0;
}
#endif
#endif
