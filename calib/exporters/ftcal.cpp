#include "calib/exporters/ftcal.h"

namespace fieldtrue {
namespace {

Result<void> write(const Corrector& corrector, const std::filesystem::path& path) { return corrector.save(path); }

}  // namespace

Exporter ftcalExporter() {
  return {"ftcal", "Fieldtrue calibration", ".ftcal.json", "Fieldtrue and programs that link its runtime", write};
}

}  // namespace fieldtrue
