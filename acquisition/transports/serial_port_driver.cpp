#include <libserialport.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "acquisition/transports/line_driver.h"
#include "acquisition/transports/line_errors.h"
#include "acquisition/transports/serial_ports.h"

namespace fieldtrue::acquisition {
namespace {

class SerialPortDriver : public LineDriver {
 public:
  ~SerialPortDriver() override { SerialPortDriver::close(); }

  Result<int> open(const std::string& path, int baud) override {
    if (const sp_return found = sp_get_port_by_name(path.c_str(), &port_); found != SP_OK) {
      port_ = nullptr;
      if (::access(path.c_str(), F_OK) != 0) return tl::unexpected(lineOpenError(path, errno));
      return fail(ErrorCode::kUnsupported, path + " is not a serial port");
    }
    if (sp_open(port_, SP_MODE_READ_WRITE) != SP_OK) {
      const int reason = sp_last_error_code();
      sp_free_port(std::exchange(port_, nullptr));
      if (reason == ENOTTY || reason == EINVAL) return fail(ErrorCode::kUnsupported, path + " has no modem lines");
      return tl::unexpected(lineOpenError(path, reason));
    }
    open_ = true;
    sp_get_port_handle(port_, &descriptor_);
    auto ready = configure(path, baud);
    if (!ready) {
      close();
      return tl::unexpected(ready.error());
    }
    return descriptor_;
  }

  void close() override {
    if (!port_) return;
    if (open_) {
      ::ioctl(descriptor_, TIOCNXCL);
      sp_close(port_);
    }
    sp_free_port(port_);
    port_ = nullptr;
    open_ = false;
    descriptor_ = -1;
  }

  long read(char* to, std::size_t size) override {
    const int n = sp_nonblocking_read(port_, to, size);
    return n < 0 ? -1 : n;
  }

  long write(const char* from, std::size_t size) override {
    const int n = sp_nonblocking_write(port_, from, size);
    return n < 0 ? -1 : n;
  }

  bool setBaud(int baud) override { return sp_set_baudrate(port_, baud) == SP_OK; }
  void setRequestToSend(bool on) override { sp_set_rts(port_, on ? SP_RTS_ON : SP_RTS_OFF); }
  void setBreak(bool on) override { on ? sp_start_break(port_) : sp_end_break(port_); }

 private:
  Result<void> configure(const std::string& path, int baud) {
    if (auto locked = lockLine(path, descriptor_); !locked) return locked;
    const bool framed = sp_set_bits(port_, 8) == SP_OK && sp_set_parity(port_, SP_PARITY_NONE) == SP_OK &&
                        sp_set_stopbits(port_, 1) == SP_OK && sp_set_flowcontrol(port_, SP_FLOWCONTROL_NONE) == SP_OK;
    if (!framed) return fail(ErrorCode::kDevice, path + " cannot be set to 8 data bits, no parity, 1 stop bit");
    if (!setBaud(baud)) {
      return fail(ErrorCode::kDevice, path + " cannot be set to " + std::to_string(baud) +
                                          " baud; the tracker's rates are 2400 4800 9600 19200 38400 57600 115200");
    }
    return {};
  }

  sp_port* port_ = nullptr;
  bool open_ = false;
  int descriptor_ = -1;
};

std::string textOr(const char* text, const char* otherwise) { return text && *text ? text : otherwise; }

}  // namespace

std::unique_ptr<LineDriver> makeSerialPortDriver() { return std::make_unique<SerialPortDriver>(); }

bool isSerialPort(const std::string& path) {
  sp_port* port = nullptr;
  if (sp_get_port_by_name(path.c_str(), &port) != SP_OK) return false;
  sp_free_port(port);
  return true;
}

std::vector<SerialPortInfo> listSerialPorts() {
  std::vector<SerialPortInfo> found;
  sp_port** ports = nullptr;
  if (sp_list_ports(&ports) != SP_OK) return found;
  for (sp_port** port = ports; *port; ++port) {
    found.push_back({sp_get_port_name(*port), textOr(sp_get_port_description(*port), "serial line")});
  }
  sp_free_port_list(ports);
  return found;
}

}  // namespace fieldtrue::acquisition
