#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace {

Result<void> write(const calibration::Corrector& corrector, const std::filesystem::path& path) {
  return corrector.save(path);
}

}  // namespace

Exporter ftcalExporter() {
  return {.id = "ftcal",
          .label = "Fieldtrue calibration",
          .extension = ".ftcal.json",
          .reads_it = "Fieldtrue",
          .write = write};
}

}  // namespace fieldtrue::exporters
