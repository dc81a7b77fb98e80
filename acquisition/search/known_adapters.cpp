#include "acquisition/search/known_adapters.h"

#include <QStandardPaths>
#include <algorithm>
#include <filesystem>

#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kLargestUsbNumber = 0xFFFF;

KnownAdapters::Row adapterRow(const JsonReader& json) {
  KnownAdapters::Row row;
  row.adapter.vendor = static_cast<int>(json["vendor"].integer(0, kLargestUsbNumber));
  row.adapter.product = static_cast<int>(json["product"].integer(0, kLargestUsbNumber));
  row.adapter.serial = json["serial"].text();
  row.adapter.description = json["description"].text();
  row.line = json["line"].text();
  row.device = json["device"].text();
  return row;
}

Result<std::vector<KnownAdapters::Row>> readAdapters(const std::string& path) {
  FT_TRY(const std::string text, readFile(path));
  FT_TRY(const nlohmann::json document, parseJson(text, path));
  return readJson<std::vector<KnownAdapters::Row>>(
      document, path, [](const JsonReader& json) { return json["adapters"].list(adapterRow); });
}

}  // namespace

KnownAdapters KnownAdapters::ofUser() {
  const QString folder = QStandardPaths::writableLocation(QStandardPaths::GenericConfigLocation);
  return KnownAdapters((folder + "/fieldtrue/adapters.json").toStdString());
}

KnownAdapters::KnownAdapters(std::string path) : path_(std::move(path)) {
  if (auto rows = readAdapters(path_)) rows_ = *std::move(rows);
}

void KnownAdapters::remember(const UsbAdapter& adapter, const std::string& line, const std::string& device) {
  constexpr std::size_t kMostRows = 50;
  if (adapter.serial.empty()) return;
  std::erase_if(rows_, [&](const Row& row) { return row.adapter.isSame(adapter) || row.line == line; });
  rows_.insert(rows_.begin(), {adapter, line, device});
  rows_.resize(std::min(rows_.size(), kMostRows));
  nlohmann::json document;
  for (const Row& row : rows_) {
    document["adapters"].push_back({{"vendor", row.adapter.vendor},
                                    {"product", row.adapter.product},
                                    {"serial", row.adapter.serial},
                                    {"description", row.adapter.description},
                                    {"line", row.line},
                                    {"device", row.device}});
  }
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(path_).parent_path(), ignored);
  (void)writeFileAtomically(path_, [&](std::ostream& out) { out << document.dump(2) << "\n"; });
}

std::string KnownAdapters::noteOn(const std::string& line, const std::optional<UsbAdapter>& adapter) const {
  if (!adapter) return {};
  for (const Row& row : rows_) {
    if (!row.adapter.isSame(*adapter)) continue;
    return row.line == line ? "This adapter had " + row.device + " on it."
                            : "This adapter was on " + row.line + " before, with " + row.device + " on it.";
  }
  return {};
}

std::optional<std::string> KnownAdapters::movedTo(const std::string& line, const std::string& system_folder) const {
  const auto row = std::find_if(rows_.begin(), rows_.end(), [&](const Row& known) { return known.line == line; });
  if (row == rows_.end()) return std::nullopt;
  const auto there = usbAdapterOf(line, system_folder);
  if (there && there->isSame(row->adapter)) return std::nullopt;
  return portOf(row->adapter, system_folder);
}

}  // namespace fieldtrue::acquisition
