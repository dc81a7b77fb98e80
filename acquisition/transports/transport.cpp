#include "acquisition/transports/transport.h"

#include <charconv>
#include <optional>

#include "acquisition/transports/line_errors.h"
#include "acquisition/transports/local_transport.h"
#include "acquisition/transports/tcp_transport.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kDefaultBaud = 115200;

std::optional<int> wholeNumber(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Result<std::unique_ptr<Transport>> makeTcp(const std::string& address, std::string_view host_and_port) {
  const std::size_t colon = host_and_port.rfind(':');
  const auto port = colon == std::string_view::npos ? std::nullopt : wholeNumber(host_and_port.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535 || colon == 0) {
    return fail(ErrorCode::kBadInput,
                "\"" + address + "\" is not an address: tcp:HOST:PORT with a port of 1 to 65535 is needed");
  }
  const std::string host(host_and_port.substr(0, colon));
  return std::make_unique<TcpTransport>(QString::fromStdString(host), static_cast<quint16>(*port));
}

std::unique_ptr<Transport> makeLocal(const std::string& path, int baud) {
  std::vector<std::unique_ptr<LineDriver>> drivers;
  const std::string resolved = resolvedPath(path);
  const bool serial = !isPseudoTerminal(resolved) && isSerialPort(resolved);
  if (serial) drivers.push_back(makeSerialPortDriver());
  drivers.push_back(makeTermiosDriver());
  return std::make_unique<LocalTransport>(serial ? resolved : path, baud, std::move(drivers));
}

}  // namespace

Result<std::unique_ptr<Transport>> makeTransport(const std::string& address) {
  constexpr std::string_view kTcp = "tcp:";
  if (address.starts_with(kTcp)) return makeTcp(address, std::string_view(address).substr(kTcp.size()));
  std::string path = address;
  int baud = kDefaultBaud;
  if (const std::size_t at = address.rfind('@'); at != std::string::npos) {
    const auto given = wholeNumber(std::string_view(address).substr(at + 1));
    if (!given || *given <= 0) {
      return fail(ErrorCode::kBadInput,
                  "\"" + address.substr(at + 1) + "\" is not a baud rate; write e.g. /dev/ttyUSB0@115200");
    }
    baud = *given;
    path.resize(at);
  }
  if (path.empty()) {
    return fail(ErrorCode::kBadInput, "No line is named; write e.g. /dev/ttyUSB0@115200 or tcp:localhost:4000");
  }
  return makeLocal(path, baud);
}

}  // namespace fieldtrue::acquisition
