/* The calls of the operating system that Gestell needs, for Windows. posix.c defines the same functions for POSIX systems;
   platform.f90 says what each function does and where Windows does less. Names of files are UTF-8 and end with a zero byte. A name
   that is not valid UTF-8 is read in the code page of the system. Bytes are written unchanged: lines end with a line feed. */
#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <errno.h>
#include <fcntl.h>
#include <io.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>

/* Maximum number of characters of a path, and of bytes that one call reads or writes */
enum { LONGEST = 32768, PIECE = 1 << 30 };

/* Sets errno from the error of the last Windows call. Returns -1. */
static int fail(void) {
  switch (GetLastError()) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_NAME:
    case ERROR_INVALID_DRIVE:
    case ERROR_BAD_NETPATH: errno = ENOENT; break;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION: errno = EACCES; break;
    case ERROR_ALREADY_EXISTS:
    case ERROR_FILE_EXISTS: errno = EEXIST; break;
    case ERROR_DIR_NOT_EMPTY: errno = ENOTEMPTY; break;
    case ERROR_DIRECTORY: errno = ENOTDIR; break;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL: errno = ENOSPC; break;
    case ERROR_WRITE_PROTECT: errno = EROFS; break;
    case ERROR_FILENAME_EXCED_RANGE: errno = ENAMETOOLONG; break;
    case ERROR_NO_DATA:
    case ERROR_BROKEN_PIPE: errno = EPIPE; break;
    case ERROR_INVALID_HANDLE: errno = EBADF; break;
    default: errno = EIO;
  }
  return -1;
}

/* Copies a name to `wide`, which has room for LONGEST characters. A name that is too long becomes empty, so that no file has it. */
static const wchar_t *widen(const char *name, wchar_t *wide) {
  if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, name, -1, wide, LONGEST) == 0 &&
      MultiByteToWideChar(CP_ACP, 0, name, -1, wide, LONGEST) == 0)
    wide[0] = 0;
  return wide;
}

static DWORD attributes(const char *name) {
  wchar_t wide[LONGEST];
  DWORD found = GetFileAttributesW(widen(name, wide));
  if (found == INVALID_FILE_ATTRIBUTES) fail();
  return found;
}

/* Other processes may read, write, rename and remove the file meanwhile, as on POSIX systems. */
static HANDLE open_handle(const char *name, DWORD access, DWORD creation, DWORD flags) {
  wchar_t wide[LONGEST];
  return CreateFileW(widen(name, wide), access, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL, creation, flags,
                     NULL);
}

static int open_file(const char *name, DWORD access, DWORD creation) {
  HANDLE handle = open_handle(name, access, creation, FILE_ATTRIBUTE_NORMAL);
  return handle == INVALID_HANDLE_VALUE ? fail() : _open_osfhandle((intptr_t)handle, _O_BINARY);
}

static HANDLE handle_of(int handle) { return (HANDLE)_get_osfhandle(handle); }

static OVERLAPPED at(int64_t position) {
  OVERLAPPED place = {0};
  place.Offset = (DWORD)position;
  place.OffsetHigh = (DWORD)(position >> 32);
  return place;
}

int platform_gestell_is_windows(void) { return 1; }

int platform_gestell_exists(const char *name) { return attributes(name) != INVALID_FILE_ATTRIBUTES; }

int platform_gestell_is_folder(const char *name) {
  DWORD found = attributes(name);
  if (found != INVALID_FILE_ATTRIBUTES && !(found & FILE_ATTRIBUTE_DIRECTORY)) errno = ENOTDIR;
  return found != INVALID_FILE_ATTRIBUTES && (found & FILE_ATTRIBUTE_DIRECTORY);
}

int64_t platform_gestell_size(const char *name) {
  wchar_t wide[LONGEST];
  WIN32_FILE_ATTRIBUTE_DATA data;
  if (!GetFileAttributesExW(widen(name, wide), GetFileExInfoStandard, &data)) return fail();
  return (int64_t)data.nFileSizeHigh << 32 | data.nFileSizeLow;
}

int platform_gestell_is_link(const char *name) {
  DWORD found = attributes(name);
  return found != INVALID_FILE_ATTRIBUTES && (found & FILE_ATTRIBUTE_REPARSE_POINT);
}

static int identify(const char *name, BY_HANDLE_FILE_INFORMATION *identity) {
  HANDLE handle = open_handle(name, 0, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS);
  int found = handle != INVALID_HANDLE_VALUE && GetFileInformationByHandle(handle, identity);
  if (handle != INVALID_HANDLE_VALUE) CloseHandle(handle);
  return found;
}

int platform_gestell_is_same(const char *one, const char *another) {
  BY_HANDLE_FILE_INFORMATION a, b;
  return identify(one, &a) && identify(another, &b) && a.dwVolumeSerialNumber == b.dwVolumeSerialNumber &&
         a.nFileIndexHigh == b.nFileIndexHigh && a.nFileIndexLow == b.nFileIndexLow;
}

/* Links are not followed. */
int platform_gestell_full_path(const char *name, char *path, int size) {
  wchar_t wide[LONGEST], full[LONGEST];
  DWORD length;
  int n, i;
  if (!platform_gestell_exists(name)) return -1;
  length = GetFullPathNameW(widen(name, wide), LONGEST, full, NULL);
  if (length == 0 || length >= LONGEST) return -1;
  n = WideCharToMultiByte(CP_UTF8, 0, full, (int)length, path, size, NULL, NULL);
  for (i = 0; i < n; i++)
    if (path[i] == '\\') path[i] = '/';
  return n > 0 ? n : -1;
}

int platform_gestell_open_to_read(const char *name) { return open_file(name, GENERIC_READ, OPEN_EXISTING); }

int platform_gestell_open_to_write(const char *name) { return open_file(name, GENERIC_READ | GENERIC_WRITE, OPEN_EXISTING); }

int platform_gestell_create(const char *name) { return open_file(name, GENERIC_READ | GENERIC_WRITE, CREATE_ALWAYS); }

int platform_gestell_close(int handle) { return _close(handle); }

int64_t platform_gestell_read(int handle, char *bytes, int64_t length, int64_t position) {
  OVERLAPPED place = at(position);
  DWORD n = 0, wanted = length < PIECE ? (DWORD)length : PIECE;
  if (ReadFile(handle_of(handle), bytes, wanted, &n, position < 0 ? NULL : &place)) return n;
  if (GetLastError() == ERROR_HANDLE_EOF || GetLastError() == ERROR_BROKEN_PIPE) return 0;
  return fail();
}

/* _isatty is true for NUL too, GetConsoleMode is not. */
int platform_gestell_is_terminal(int handle) {
  DWORD mode;
  return GetConsoleMode(handle_of(handle), &mode) != 0;
}

/* A console gets UTF-16, whatever its code page is. */
int64_t platform_gestell_write(int handle, const char *bytes, int64_t length, int64_t position) {
  OVERLAPPED place = at(position);
  DWORD n = 0, wanted = length < PIECE ? (DWORD)length : PIECE;
  HANDLE file = handle_of(handle);
  wchar_t *wide = NULL;
  int wide_length = 0;
  if (platform_gestell_is_terminal(handle) && wanted > 0) wide = malloc(wanted * sizeof *wide);
  if (wide) wide_length = MultiByteToWideChar(CP_UTF8, 0, bytes, (int)wanted, wide, (int)wanted);
  if (wide_length > 0) {
    if (!WriteConsoleW(file, wide, wide_length, &n, NULL)) wanted = (DWORD)fail();
    free(wide);
    return wanted == (DWORD)-1 ? -1 : (int64_t)wanted;
  }
  free(wide);
  return WriteFile(file, bytes, wanted, &n, position < 0 ? NULL : &place) ? (int64_t)n : fail();
}

/* One byte far behind the end is locked: on Windows no other process can read or write what is locked. */
int platform_gestell_lock(int handle, int shared, int wait) {
  OVERLAPPED place = at((int64_t)1 << 62);
  DWORD flags = (shared ? 0 : LOCKFILE_EXCLUSIVE_LOCK) | (wait ? 0 : LOCKFILE_FAIL_IMMEDIATELY);
  if (LockFileEx(handle_of(handle), flags, 0, 1, 0, &place)) return 0;
  return GetLastError() == ERROR_LOCK_VIOLATION || GetLastError() == ERROR_IO_PENDING ? 1 : fail();
}

int platform_gestell_rename(const char *old, const char *new) {
  wchar_t wide[2][LONGEST];
  return MoveFileExW(widen(old, wide[0]), widen(new, wide[1]), MOVEFILE_REPLACE_EXISTING) ? 0 : fail();
}

int platform_gestell_link(const char *old, const char *new) {
  wchar_t wide[2][LONGEST];
  return CreateHardLinkW(widen(new, wide[1]), widen(old, wide[0]), NULL) ? 0 : fail();
}

int platform_gestell_remove_file(const char *name) {
  wchar_t wide[LONGEST];
  if (DeleteFileW(widen(name, wide))) return 0;
  fail();
  return errno == ENOENT ? 0 : -1;
}

int platform_gestell_make_folder(const char *name) {
  wchar_t wide[LONGEST];
  if (CreateDirectoryW(widen(name, wide), NULL)) return 0;
  fail();
  return errno == EEXIST ? 1 : -1;
}

int platform_gestell_remove_folder(const char *name) {
  wchar_t wide[LONGEST];
  return RemoveDirectoryW(widen(name, wide)) ? 0 : fail();
}

int platform_gestell_message(char *text, int size) {
  const char *words = strerror(errno);
  int length = (int)strlen(words);
  if (length > size) length = size;
  memcpy(text, words, length);
  return length;
}

/* The stack of a program is set when it is linked. */
int64_t platform_gestell_stack_limit(void) { return -1; }

/* No signal ends a program that writes to a closed pipe. Files do not get the numbers of standard streams. */
void platform_gestell_prepare(void) {}

int platform_gestell_decode(const char *word, char *text, int size) {
  wchar_t wide[LONGEST];
  int length = WideCharToMultiByte(CP_UTF8, 0, widen(word, wide), -1, text, size, NULL, NULL);
  return length > 0 ? length - 1 : 0;
}
#else
typedef int platform_gestell_nothing; /* ISO C forbids an empty file */
#endif
