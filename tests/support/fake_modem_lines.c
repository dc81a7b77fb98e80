/* Preloaded before a test of the serial back end: a pseudo-terminal has no modem lines, and libserialport refuses to
   open a port without them. Answers the modem line requests itself and passes every other one on. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <sys/ioctl.h>
#include <termios.h>

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
