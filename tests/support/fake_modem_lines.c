/* Preloaded before a test of the serial back end. A pseudo-terminal has no modem lines, and libserialport refuses to
   open a port without them: answers the modem line requests itself and passes every other one on. And the machine may
   have no serial port to list: with FIELDTRUE_FAKE_TTYS set, that folder stands for /sys/class/tty. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

typedef int (*ioctl_function)(int, unsigned long, ...);

static int modem_lines = TIOCM_CTS | TIOCM_DSR | TIOCM_CAR;

int ioctl(int descriptor, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  switch (request) {
    case TIOCMGET:
      *(int*)argument = modem_lines;
      return 0;
    case TIOCMSET:
      modem_lines = *(int*)argument;
      return 0;
    case TIOCMBIS:
      modem_lines |= *(int*)argument;
      return 0;
    case TIOCMBIC:
      modem_lines &= ~*(int*)argument;
      return 0;
    default:
      break;
  }
  union {
    void* object;
    ioctl_function function;
  } next = {dlsym(RTLD_NEXT, "ioctl")};
  return next.function(descriptor, request, argument);
}

static const char* redirected(const char* path, char* room) {
  static const char* const kClass = "/sys/class/tty";
  const char* fake = getenv("FIELDTRUE_FAKE_TTYS");
  if (!fake || !path || strncmp(path, kClass, strlen(kClass)) != 0) return path;
  snprintf(room, PATH_MAX, "%s%s", fake, path + strlen(kClass));
  return room;
}

DIR* opendir(const char* path) {
  union {
    void* object;
    DIR* (*function)(const char*);
  } next = {dlsym(RTLD_NEXT, "opendir")};
  char room[PATH_MAX];
  return next.function(redirected(path, room));
}

FILE* fopen(const char* path, const char* mode) {
  union {
    void* object;
    FILE* (*function)(const char*, const char*);
  } next = {dlsym(RTLD_NEXT, "fopen")};
  char room[PATH_MAX];
  return next.function(redirected(path, room), mode);
}

ssize_t readlink(const char* path, char* target, size_t size) {
  union {
    void* object;
    ssize_t (*function)(const char*, char*, size_t);
  } next = {dlsym(RTLD_NEXT, "readlink")};
  char room[PATH_MAX];
  return next.function(redirected(path, room), target, size);
}

int lstat(const char* path, struct stat* status) {
  char room[PATH_MAX];
  return fstatat(AT_FDCWD, redirected(path, room), status, AT_SYMLINK_NOFOLLOW);
}

/* What lstat was called in libraries linked against a C library older than 2.33. */
int __lxstat(int version, const char* path, struct stat* status) {
  (void)version;
  return lstat(path, status);
}
