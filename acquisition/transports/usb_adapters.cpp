#include "acquisition/transports/usb_adapters.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>

#include "acquisition/transports/line_errors.h"

namespace fieldtrue::acquisition {
namespace {

namespace fs = std::filesystem;

std::string firstLine(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::optional<int> hexNumber(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// The port's device lies in the adapter's folder, a few levels down.
std::optional<UsbAdapter> adapterAbove(fs::path folder) {
  constexpr int kLevels = 6;
  for (int level = 0; level < kLevels && folder.has_relative_path(); ++level, folder = folder.parent_path()) {
    const auto vendor = hexNumber(firstLine(folder / "idVendor"));
    const auto product = hexNumber(firstLine(folder / "idProduct"));
    if (!vendor || !product) continue;
    UsbAdapter adapter{*vendor, *product, firstLine(folder / "serial"), firstLine(folder / "manufacturer")};
    const std::string name = firstLine(folder / "product");
    adapter.description += (adapter.description.empty() || name.empty() ? "" : " ") + name;
    return adapter;
  }
  return std::nullopt;
}

}  // namespace

bool UsbAdapter::isSame(const UsbAdapter& other) const {
  return !serial.empty() && vendor == other.vendor && product == other.product && serial == other.serial;
}

std::optional<UsbAdapter> usbAdapterOf(const std::string& path, const std::string& system_folder) {
  const std::string name = fs::path(resolvedPath(path)).filename().string();
  std::error_code missing;
  const fs::path device = fs::canonical(fs::path(system_folder) / "class" / "tty" / name / "device", missing);
  return missing ? std::nullopt : adapterAbove(device);
}

std::vector<UsbPort> usbPorts(const std::string& system_folder) {
  std::vector<UsbPort> ports;
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(fs::path(system_folder) / "class" / "tty", unreadable)) {
    const std::string path = "/dev/" + entry.path().filename().string();
    if (auto adapter = usbAdapterOf(path, system_folder)) ports.push_back({path, std::move(*adapter)});
  }
  std::sort(ports.begin(), ports.end(), [](const UsbPort& a, const UsbPort& b) { return a.path < b.path; });
  return ports;
}

std::optional<std::string> portOf(const UsbAdapter& adapter, const std::string& system_folder) {
  for (const UsbPort& port : usbPorts(system_folder)) {
    if (port.adapter.isSame(adapter)) return port.path;
  }
  return std::nullopt;
}

}  // namespace fieldtrue::acquisition
