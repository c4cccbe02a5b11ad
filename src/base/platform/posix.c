/* The calls of the operating system that Gestell needs, for POSIX systems (Linux, macOS). windows.c defines the same functions for
   Windows; platform.f90 says what each function does. All names of files are UTF-8 and end with a zero byte. */
#ifndef _WIN32
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

int platform_gestell_is_windows(void) { return 0; }

int platform_gestell_exists(const char *name) { return access(name, F_OK) == 0; }

int platform_gestell_is_folder(const char *name) {
  struct stat status;
  if (stat(name, &status) != 0) return 0;
  if (!S_ISDIR(status.st_mode)) {
    errno = ENOTDIR;
    return 0;
  }
  return access(name, X_OK) == 0;
}

int64_t platform_gestell_size(const char *name) {
  struct stat status;
  return stat(name, &status) == 0 ? (int64_t)status.st_size : -1;
}

int platform_gestell_is_link(const char *name) {
  char target;
  return readlink(name, &target, 1) >= 0;
}

int platform_gestell_is_same(const char *one, const char *another) {
  struct stat status[2];
  if (stat(one, &status[0]) != 0 || stat(another, &status[1]) != 0) return 0;
  return status[0].st_dev == status[1].st_dev && status[0].st_ino == status[1].st_ino;
}

int platform_gestell_full_path(const char *name, char *path, int size) {
  char *full = realpath(name, NULL);
  int length = full ? (int)strlen(full) : -1;
  if (length > size) length = -1;
  if (length >= 0) memcpy(path, full, length);
  free(full);
  return length;
}

int platform_gestell_open_to_read(const char *name) { return open(name, O_RDONLY); }

int platform_gestell_open_to_write(const char *name) { return open(name, O_WRONLY); }

/* The mode restricts nothing: the user's umask does. */
int platform_gestell_create(const char *name) { return creat(name, 0666); }

int platform_gestell_close(int handle) { return close(handle); }

/* Some signals interrupt a call before it has done anything; the call is then repeated. */
int64_t platform_gestell_read(int handle, char *bytes, int64_t length, int64_t position) {
  ssize_t n;
  do n = position < 0 ? read(handle, bytes, length) : pread(handle, bytes, length, position);
  while (n < 0 && errno == EINTR);
  return n;
}

int64_t platform_gestell_write(int handle, const char *bytes, int64_t length, int64_t position) {
  ssize_t n;
  do n = position < 0 ? write(handle, bytes, length) : pwrite(handle, bytes, length, position);
  while (n < 0 && errno == EINTR);
  return n;
}

/* A file system without locks returns another number than EWOULDBLOCK. */
int platform_gestell_lock(int handle, int shared, int wait) {
  if (flock(handle, (shared ? LOCK_SH : LOCK_EX) | (wait ? 0 : LOCK_NB)) == 0) return 0;
  return errno == EWOULDBLOCK ? 1 : -1;
}

int platform_gestell_rename(const char *old, const char *new) { return rename(old, new); }

int platform_gestell_link(const char *old, const char *new) { return link(old, new); }

int platform_gestell_remove_file(const char *name) { return unlink(name) == 0 || errno == ENOENT ? 0 : -1; }

int platform_gestell_make_folder(const char *name) {
  if (mkdir(name, 0777) == 0) return 0;
  return errno == EEXIST ? 1 : -1;
}

int platform_gestell_remove_folder(const char *name) { return rmdir(name); }

int platform_gestell_message(char *text, int size) {
  const char *words = strerror(errno);
  int length = (int)strlen(words);
  if (length > size) length = size;
  memcpy(text, words, length);
  return length;
}

int platform_gestell_is_terminal(int handle) { return isatty(handle); }

int64_t platform_gestell_stack_limit(void) {
  struct rlimit limit;
  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur > INT64_MAX) return -1;
  return (int64_t)limit.rlim_cur;
}

void platform_gestell_prepare(void) {
  int handle;
  signal(SIGXFSZ, SIG_IGN);
  signal(SIGPIPE, SIG_IGN);
  do handle = open("/dev/null", O_RDONLY);
  while (handle >= 0 && handle <= STDERR_FILENO);
  if (handle >= 0) close(handle);
}

/* The words of the command line are used as they are. */
int platform_gestell_decode(const char *word, char *text, int size) {
  int length = (int)strlen(word);
  if (length > size) length = size;
  memcpy(text, word, length);
  return length;
}
#else
typedef int platform_gestell_nothing; /* ISO C forbids an empty file */
#endif
