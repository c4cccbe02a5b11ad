/* Makes a call of the program fail, by LD_PRELOAD. Counted are the calls that write below the folder FAULT_FOLDER, or with
   FAULT_STDOUT the writes to standard output. At call number FAULT_AT, with FAULT_STICKY from there on:
     FAULT_ERRNO    the call fails with this number
     FAULT_SHORT    half of a write is done, the next one fails
     FAULT_KILL     the process is killed
     FAULT_COMMAND  a command of the shell runs before the call
   FAULT_COUNT: a file that gets the number of calls in the end. Other programs than FAULT_PROGRAM are left alone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static int calls, after_short;
static char followed[1024];

static const char *word(const char *name) { return getenv(name) ? getenv(name) : ""; }

static int active(void) { return strcmp(program_invocation_short_name, word("FAULT_PROGRAM")) == 0; }

static int below(const char *path) {
  return active() && !*word("FAULT_STDOUT") && *word("FAULT_FOLDER") && strstr(path, word("FAULT_FOLDER"));
}

/* Whether this call is to fail. */
static int fails(void) {
  int at = atoi(word("FAULT_AT"));
  calls++;
  if (at == 0 || (*word("FAULT_STICKY") ? calls < at : calls != at)) return 0;
  if (*word("FAULT_KILL")) raise(SIGKILL);
  if (*word("FAULT_COMMAND") && calls == at) {
    char command[4096];
    snprintf(command, sizeof command, "unset LD_PRELOAD; %s", word("FAULT_COMMAND"));
    if (system(command)) fprintf(stderr, "FAULT_COMMAND failed\n");
    return 0;
  }
  errno = atoi(word("FAULT_ERRNO"));
  return errno != 0;
}

int creat(const char *path, mode_t mode) {
  int (*real)(const char *, mode_t) = dlsym(RTLD_NEXT, "creat"), handle;
  if (below(path) && fails()) return -1;
  handle = real(path, mode);
  if (handle >= 0 && handle < 1024) followed[handle] = below(path);
  return handle;
}

int open(const char *path, int flags, ...) {
  int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open"), handle, counted;
  va_list more;
  va_start(more, flags);
  mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  counted = flags == O_WRONLY && below(path);
  if (counted && fails()) return -1;
  handle = real(path, flags, mode);
  if (counted && handle >= 0 && handle < 1024) followed[handle] = 1;
  return handle;
}

/* What is to be written of `length` bytes; -1: the write fails. */
static ssize_t let_through(int handle, size_t length) {
  int counted = handle == 1 && active() && *word("FAULT_STDOUT");
  if (handle >= 0 && handle < 1024 && followed[handle]) counted = 1;
  if (!counted) return length;
  if (after_short) {
    after_short = 0;
    errno = ENOSPC;
    return -1;
  }
  if (!fails()) return length;
  if (!*word("FAULT_SHORT") || length < 2) return -1;
  after_short = 1;
  return length / 2;
}

ssize_t write(int handle, const void *bytes, size_t length) {
  ssize_t (*real)(int, const void *, size_t) = dlsym(RTLD_NEXT, "write"), n = let_through(handle, length);
  return n < 0 ? -1 : real(handle, bytes, n);
}

ssize_t pwrite(int handle, const void *bytes, size_t length, off_t offset) {
  ssize_t (*real)(int, const void *, size_t, off_t) = dlsym(RTLD_NEXT, "pwrite"), n = let_through(handle, length);
  return n < 0 ? -1 : real(handle, bytes, n, offset);
}

int close(int handle) {
  int (*real)(int) = dlsym(RTLD_NEXT, "close"), bad = 0;
  if (handle >= 0 && handle < 1024 && followed[handle]) {
    followed[handle] = 0;
    bad = fails();
  }
  int number = errno, done = real(handle);
  errno = number;
  return bad ? -1 : done;
}

int rename(const char *old, const char *new) {
  int (*real)(const char *, const char *) = dlsym(RTLD_NEXT, "rename");
  if (below(new) && fails()) return -1;
  return real(old, new);
}

int link(const char *old, const char *new) {
  int (*real)(const char *, const char *) = dlsym(RTLD_NEXT, "link");
  if (below(new) && fails()) return -1;
  return real(old, new);
}

int mkdir(const char *path, mode_t mode) {
  int (*real)(const char *, mode_t) = dlsym(RTLD_NEXT, "mkdir");
  if (below(path) && fails()) return -1;
  return real(path, mode);
}

__attribute__((destructor)) static void tell(void) {
  FILE *file;
  if (!active() || !*word("FAULT_COUNT")) return;
  file = fopen(word("FAULT_COUNT"), "w");
  if (file) fprintf(file, "%d\n", calls);
  if (file) fclose(file);
}
