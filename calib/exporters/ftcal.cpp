#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace ftcal {
namespace {

Result<Written> write(const ExportSubject& subject, const ExportOptions&, const std::filesystem::path& path,
                      const RunControl&) {
  FT_TRY_VOID(subject.corrector().save(path));
  return Written{};
}

}  // namespace
}  // namespace ftcal

Exporter ftcalExporter() {
  using namespace ftcal;
  return {.id = "ftcal",
          .label = "Fieldtrue calibration",
          .extension = ".ftcal.json",
          .reads_it = "Fieldtrue: apply, difference, the page Changes",
          .in_words = "metres; everything that the calibration knows",
          .knows_pose = true,
          .tells_error = false,
          .write = write};
}

}  // namespace fieldtrue::exporters
