// To add an exporter:
// 1. Write `calib/exporters/<id>.cpp` with one function that returns its row, declared in rows.h.
// 2. State the subject's facts in the file: unit, frames, handedness, direction, methods, places, date, errors,
// software.
// 3. Write with writeFileAtomically, or replaceFileAtomically where a library wants a name; numbers with formatNumber
//    (no locale), no time of writing. A lattice gives write and read to writeLattice or writeFixedLattice.
// 4. Add the row below, in the order menus shall show it.
// 5. Add to tests/calib/exporters/<id>_test.cpp a reading back by something other than the exporter. The contract test
//    (written, not empty, same bytes twice, error on a folder that is not there) runs over every row by itself.
#include "calib/exporters/registry.h"

#include <vector>

#include "calib/exporters/exporter.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {

std::span<const Exporter> exporters() {
  // Those for one purpose stand together.
  static const std::vector<Exporter> rows = {
      ftcalExporter(),       itkNrrdExporter(),      itkMhaExporter(),  itkTfmExporter(),    itkH5Exporter(),
      vtkVtiExporter(),      vtkLandmarksExporter(), vtkVtpExporter(),  vruiGridExporter(),  vruiForwardGridExporter(),
      csvExporter(),         latticeCsvExporter(),   numpyExporter(),   matlabExporter(),    polynomialJsonExporter(),
      polynomialCExporter(), plusXmlExporter(),      vrpnCfgExporter(), caveTableExporter(), syzygyTableExporter(),
      trackdPluginExporter()};
  return rows;
}

Result<const Exporter*> findExporter(std::string_view id) {
  std::string known;
  for (const Exporter& exporter : exporters()) {
    if (exporter.id == id) return &exporter;
    known += (known.empty() ? "" : ", ") + exporter.id;
  }
  return fail(ErrorCode::kBadInput, "No export format is called '" + std::string(id) + "'; there are: " + known);
}

}  // namespace fieldtrue::exporters
