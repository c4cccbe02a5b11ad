/* Adding a group costs the same however many there are: memory is asked for as often for the second 300 as for the first.
   With all groups copied each time it is three times as often. The last line counts. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <gestell.h>
#include <stdio.h>
#include <stdlib.h>

static long asked;

void *malloc(size_t size) {
  static void *(*real)(size_t);
  if (!real) real = (void *(*)(size_t))dlsym(RTLD_NEXT, "malloc");
  asked++;
  return real(size);
}

static long add(gestell_machine machine, int groups, int *failures) {
  long before = asked;
  for (int i = 0; i < groups; i++)
    *failures += gestell_add(machine, "&support position=0.1,0.2, stiffness=1e5,1e5 /", NULL) != 0;
  return asked - before;
}

int main(void) {
  enum { many = 300 };
  gestell_machine machine = gestell_new_machine();
  int failures = 0, count = 0;
  long first = add(machine, many, &failures), second = add(machine, many, &failures);
  gestell_count_values(machine, "support.stiffness", &count, NULL);
  gestell_delete_machine(&machine);
  int good = failures == 0 && count == 4 * many && first > many && second < 1.5 * first;
  if (!good) printf("FAIL  %d failures, %d values, %ld requests for the first groups, %ld for the others\n", failures, count, first, second);
  printf("%d passed, %d failed\n", good, !good);
  return !good;
}
