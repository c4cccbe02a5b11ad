/* Watt's six-bar beside the middle plane of its frame, six degrees of freedom u, theta (validation/space/watt_beside.nml), as a
 * right-hand side y' = P y + f written by hand: the equations about rest of doc/theory.md, "in space". Included by model.h. */

/* S, J, H about F in the frame's axes, which are those of the mechanism: S, S', S'', then J, J' and H, H'. */
typedef struct { double s[3][3], j[2][3][3], h[2][3]; } sums;

static inline void add_body(sums *a, double m, point c, double z) {
  const double r[3] = {c.x, c.y, z}, v[3] = {c.vx, c.vy, 0}, rr = c.x * c.x + c.y * c.y + z * z,
               rv = 2 * (c.x * c.vx + c.y * c.vy);
  a->s[0][0] += m * c.x, a->s[0][1] += m * c.y, a->s[0][2] += m * z;
  a->s[1][0] += m * c.vx, a->s[1][1] += m * c.vy;
  a->s[2][0] += m * c.ax, a->s[2][1] += m * c.ay;
  for (int i = 0; i < 3; i++) {
    a->j[0][i][i] += m * rr;
    a->j[1][i][i] += m * rv;
    for (int k = 0; k < 3; k++) {
      a->j[0][i][k] -= m * r[i] * r[k];
      a->j[1][i][k] -= m * (r[i] * v[k] + v[i] * r[k]);
    }
  }
  a->h[0][0] -= m * z * c.vy, a->h[0][1] += m * z * c.vx, a->h[0][2] += m * (c.x * c.vy - c.y * c.vx);
  a->h[1][0] -= m * z * c.ay, a->h[1][1] += m * z * c.ax, a->h[1][2] += m * (c.x * c.ay - c.y * c.ax);
}

/* A link from p to q with moments of inertia along it, across it and about the normal. */
static inline void add_bar(sums *a, point p, point q, double length, double m, const double *inertia, double along, double left,
                           double z) {
  const double one = 1 / length, cx = (q.x - p.x) * one, cy = (q.y - p.y) * one, dx = (q.vx - p.vx) * one,
               dy = (q.vy - p.vy) * one, change = 2 * (inertia[0] - inertia[1]) * cx * dx,
               shear = (inertia[0] - inertia[1]) * (cx * dy + dx * cy), cross = (inertia[0] - inertia[1]) * cx * cy;
  add_body(a, m, carried(p, q, length, along, left), z);
  a->j[0][0][0] += inertia[0] * cx * cx + inertia[1] * cy * cy, a->j[0][1][1] += inertia[0] * cy * cy + inertia[1] * cx * cx;
  a->j[0][2][2] += inertia[2];
  a->j[0][0][1] += cross, a->j[0][1][0] += cross;
  a->j[1][0][0] += change, a->j[1][1][1] -= change;
  a->j[1][0][1] += shear, a->j[1][1][0] += shear;
  a->h[0][2] += inertia[2] * (cx * dy - cy * dx);
  a->h[1][2] += inertia[2] * (cx * (q.ay - p.ay) - cy * (q.ax - p.ax)) * one;
}

static inline point moved(point p, double x, double y) { return (point){p.x + x, p.y + y, p.vx, p.vy, p.ax, p.ay}; }

static inline sums six_bar_beside(const machine *k, double angle) {
  static const double slim[3][3] = {{0, 0.0015, 0.0015}, {0, 0.0030, 0.0030}, {0, 0.0060, 0.0060}};
  static const double wide[2][3] = {{0.0030, 0.0080, 0.0110}, {0.0025, 0.0055, 0.0080}};
  const point o = ground(k->xi, k->eta), b0 = ground(k->xi + 0.22, k->eta), a = moved(crank(0.08, angle), k->xi, k->eta);
  const point b = dyad(a, b0, 0.24, 0.18), c = carried(a, b, 0.24, 0.12, 0.10), e = carried(b0, b, 0.18, 0.18, -0.12);
  const point d = dyad(c, e, 0.22, 0.20);
  sums s = {{{0}}, {{{0}}}, {{0}}};
  add_bar(&s, o, a, 0.08, 0.9, slim[0], 0.02, 0, 0.14);
  add_bar(&s, a, b, 0.24, 1.4, wide[0], 0.12, 0.033, 0.152);
  add_bar(&s, b0, b, 0.18, 1.2, wide[1], 0.12, -0.04, 0.164);
  add_bar(&s, c, d, 0.22, 0.7, slim[1], 0.11, 0, 0.164);
  add_bar(&s, e, d, 0.20, 1.0, slim[2], 0.10, 0, 0.152);
  return s;
}

/* [a] in rows and columns of g from (row, column) on, times a factor. */
static inline void add_cross(double g[6][columns], int row, int column, double factor, const double *a) {
  g[row][column + 1] -= factor * a[2], g[row][column + 2] += factor * a[1];
  g[row + 1][column] += factor * a[2], g[row + 1][column + 2] -= factor * a[0];
  g[row + 2][column] -= factor * a[1], g[row + 2][column + 1] += factor * a[0];
}

/* M eliminated once for C, B and h together: with -[C B h] = [F; D], theta'' = (J + [S]^2 / m)^-1 (D - [S] F / m) and
 * u'' = (F + [S] theta'') / m, then y' for all columns. */
static inline void frame_in_space(const machine *k, sums a, const double *y, double *dy) {
  const double w = k->omega, w2 = w * w, one_m = 1 / (k->mass + k->links_mass), *s = a.s[0];
  double g[6][columns], j[3][3], inverse[3][3];

  for (int r = 0; r < 6; r++) {
    for (int c = 0; c < 6; c++) {
      g[r][c] = -k->stiffness[r][c];
      g[r][6 + c] = -k->damping[r][c];
    }
    g[r][12] = r < 3 ? -w2 * a.s[2][r] : -w2 * a.h[1][r - 3];
  }
  add_cross(g, 0, 3, w2, a.s[2]);
  add_cross(g, 0, 9, 2 * w, a.s[1]);
  add_cross(g, 3, 9, w, a.h[0]);
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      g[3 + r][9 + c] -= w * a.j[1][r][c];
      j[r][c] = k->tensor[r][c] + a.j[0][r][c] + s[r] * s[c] * one_m;
    }
  for (int r = 0; r < 3; r++) j[r][r] -= (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) * one_m;
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
      inverse[r][c] = j[r1][c1] * j[r2][c2] - j[r1][c2] * j[r2][c1];
    }
  const double one = 1 / (j[0][0] * inverse[0][0] + j[0][1] * inverse[1][0] + j[0][2] * inverse[2][0]);
  for (int c = 0; c < columns; c++) {
    const double unit = c < states ? k->unit[c] : 1 / k->size;
    const double f[3] = {g[0][c] * one_m, g[1][c] * one_m, g[2][c] * one_m};
    const double d[3] = {g[3][c] - s[1] * f[2] + s[2] * f[1], g[4][c] - s[2] * f[0] + s[0] * f[2],
                         g[5][c] - s[0] * f[1] + s[1] * f[0]};
    double turn[3];
    for (int r = 0; r < 3; r++) turn[r] = one * (inverse[r][0] * d[0] + inverse[r][1] * d[1] + inverse[r][2] * d[2]);
    const double back[3] = {s[1] * turn[2] - s[2] * turn[1], s[2] * turn[0] - s[0] * turn[2], s[0] * turn[1] - s[1] * turn[0]};
    for (int r = 0; r < 3; r++) {
      g[r][c] = (f[r] + one_m * back[r]) * unit / k->unit[6 + r];
      g[3 + r][c] = turn[r] * unit / k->unit[9 + r];
    }
  }

  for (int i = 0; i < 6; i++) {
    const double rate = k->unit[6 + i] / k->unit[i];
    for (int c = 0; c < columns; c++) dy[columns * i + c] = rate * y[columns * (6 + i) + c];
    double row[columns] = {0};
    row[12] = g[i][12];
    for (int n = 0; n < states; n++)
      for (int c = 0; c < columns; c++) row[c] += g[i][n] * y[columns * n + c];
    for (int c = 0; c < columns; c++) dy[columns * (6 + i) + c] = row[c];
  }
}

static void six_bar_beside_side(const machine *k, double t, const double *y, double *dy) {
  frame_in_space(k, six_bar_beside(k, k->omega * t), y, dy);
}

static void scale_stiffness(machine *k, double factor) {
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) k->stiffness[i][j] *= factor;
}

static right_hand_side find_machine(const char *name, double rpm, machine *k) {
  static const double tensor[3][3] = {{2.2, 0.1, -0.2}, {0.1, 2.4, 0.15}, {-0.2, 0.15, 2.5}};
  static const double stiffness[3] = {4.0e4, 1.0e5, 4.0e4}, damping[3] = {40.0, 75.0, 40.0};
  if (strcmp(name, "watt_beside") != 0) return 0;
  memset(k, 0, sizeof *k);
  memcpy(k->tensor, tensor, sizeof tensor);
  k->omega = rpm * pi / 30;
  k->period = 60 / rpm;
  k->mass = 60.0, k->xi = -0.10, k->eta = 0.15, k->links_mass = 5.2;
  for (int n = 0; n < 4; n++) {
    const double x = n % 2 ? 0.30 : -0.30, y = -0.20, z = n < 2 ? 0.18 : -0.18;
    const double g[3][6] = {{1, 0, 0, 0, z, -y}, {0, 1, 0, -z, 0, x}, {0, 0, 1, y, -x, 0}};
    for (int a = 0; a < 3; a++)
      for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) {
          k->stiffness[i][j] += stiffness[a] * g[a][i] * g[a][j];
          k->damping[i][j] += damping[a] * g[a][i] * g[a][j];
        }
  }
  return six_bar_beside_side;
}
