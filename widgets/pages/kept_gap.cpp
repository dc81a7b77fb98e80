#include "widgets/pages/kept_gap.h"

#include <QCryptographicHash>
#include <sstream>

#include "calib/core/json_text.h"
#include "calib/gap/report_reader.h"
#include "calib/tables/table_writer.h"

namespace fieldtrue::widgets {
namespace {

using nlohmann::json;

/// Of the rows alone: what is stated about them may be completed later.
std::string fingerprintOf(const CalibrationTable& table) {
  std::ostringstream rows;
  writeNodeTable(rows, {{}, table.nodes});
  return QCryptographicHash::hash(QByteArray::fromStdString(rows.str()), QCryptographicHash::Sha256)
      .toHex()
      .toStdString();
}

json sceneJson(const std::optional<simulation::Scene>& scene) { return scene ? toJson(*scene) : json(); }

Result<std::optional<simulation::Scene>> sceneOf(const json& content, const std::string& name) {
  if (content.is_null()) return std::optional<simulation::Scene>();
  return simulation::sceneFromJson(content, name).map([](simulation::Scene scene) { return std::optional(scene); });
}

}  // namespace

std::string toText(const KeptGap& kept, const CalibrationTable& table) {
  json earlier = json::array();
  for (const auto& scene : kept.earlier) earlier.push_back(sceneJson(scene));
  const json content = {{"scene", sceneJson(kept.scene)},
                        {"earlier", std::move(earlier)},
                        {"rows", fingerprintOf(table)},
                        {"report", kept.report ? gap::toJson(*kept.report) : json()}};
  return content.dump();
}

Result<KeptGap> readKeptGap(const std::string& text, const CalibrationTable& table, const std::string& name) {
  FT_TRY(const json content, parseJson(text, name));
  if (!content.is_object() || !content.contains("scene") || !content.contains("rows"))
    return fail(ErrorCode::kBadInput, name + ": what it keeps of the diagnosis has no scene and rows");
  KeptGap kept;
  FT_TRY(kept.scene, sceneOf(content.at("scene"), name));
  for (const json& scene : content.value("earlier", json::array())) {
    FT_TRY(auto one, sceneOf(scene, name));
    kept.earlier.push_back(std::move(one));
  }
  const json report = content.value("report", json());
  if (report.is_null() || content.at("rows") != fingerprintOf(table)) return kept;
  FT_TRY(kept.report, gap::readGapReport(report, name));
  return kept;
}

}  // namespace fieldtrue::widgets
