/* The rate of fused multiply-adds that one core reaches in registers, in 1e9 floating point operations a second: the best of
 * many short runs. Build with -O3 -march=native. */
#include <stdio.h>
#include <time.h>

#if defined __AVX512F__
enum { width = 64 };
#elif defined __AVX__
enum { width = 32 };
#else
enum { width = 16 };
#endif
enum { chains = 12, rounds = 200000 }; /* more chains than the latency times the units needs, fewer than registers */
typedef double vector __attribute__((vector_size(width)));

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(void) {
  const vector zero = {0}, x = zero + 0.999, y = zero + 1e-3;
  vector a[chains];
  double best = 1e9, sum = 0;
  for (int i = 0; i < chains; i++) a[i] = zero + i;
  for (int run = 0; run < 300; run++) {
    const double begin = now();
    for (long k = 0; k < rounds; k++)
      for (int i = 0; i < chains; i++) a[i] = a[i] * x + y;
    const double time = now() - begin;
    if (time < best) best = time;
  }
  for (int i = 0; i < chains; i++) sum += a[i][0];
  printf("%.1f\n", 2.0 * rounds * chains * (width / sizeof(double)) / best * 1e-9);
  return sum == 0;
}
