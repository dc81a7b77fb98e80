#include "acquisition/session/imported_session.h"

#include <QFile>
#include <QFileInfo>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "acquisition/plan/plan.h"
#include "acquisition/session/session_store.h"
#include "calib/core/file_io.h"

namespace fieldtrue::acquisition {
namespace {

using RowKey = std::tuple<int, int, int>;  // node, sensor, visit

PlannedPlace placeOf(const Node& row, int visit) {
  PlannedPlace place;
  place.node = row.node;
  place.visit = visit;
  place.index = row.index;
  place.reference_from_sensor = row.reference_from_sensor;
  place.role = row.role == NodeRole::kValidation ? NodeRole::kValidation : NodeRole::kFit;
  return place;
}

/// Visits as they are, those that are taken already moved behind the last.
Plan planOf(const CalibrationTable& table) {
  std::map<int, int> last_visit;
  for (const Node& row : table.nodes) {
    int& last = last_visit.try_emplace(row.node, row.visit).first->second;
    last = std::max(last, row.visit);
  }
  std::set<std::pair<int, int>> taken;
  Plan plan;
  for (const Node& row : table.nodes) {
    const bool is_free = taken.emplace(row.node, row.visit).second;
    plan.explicit_places.push_back(placeOf(row, is_free ? row.visit : ++last_visit[row.node]));
  }
  return plan;
}

std::vector<ForeignTake> takesOf(const CalibrationTable& table) {
  std::vector<ForeignTake> takes;
  for (const Node& row : table.nodes) takes.push_back({takes.size(), row, {}});
  return takes;
}

/// Gives the samples to their takes. @return those of none
std::vector<LooseSample> giveSamples(const SampleTable& samples, std::vector<ForeignTake>& takes) {
  std::map<RowKey, std::size_t> take_of;
  for (const ForeignTake& take : takes)
    take_of.emplace(RowKey{take.mean.node, take.mean.sensor, take.mean.visit}, take.place);
  std::vector<LooseSample> loose;
  for (const SampleRow& row : samples.rows) {
    const auto take = take_of.find({row.node, row.sample.sensor, row.visit});
    if (take == take_of.end())
      loose.push_back({row.sample, {}});
    else
      takes[take->second].samples.push_back(row.sample);
  }
  return loose;
}

Result<void> fill(SessionStore& store, const CalibrationTable& table, const std::optional<SampleTable>& samples,
                  const std::string& source) {
  std::vector<ForeignTake> takes = takesOf(table);
  std::vector<LooseSample> loose;
  if (samples) loose = giveSamples(*samples, takes);
  FT_TRY_VOID(store.keepLoose(loose));
  FT_TRY_VOID(store.storeForeign(takes));
  FT_TRY_VOID(store.setState("page", "compare"));
  return store.addEvent("imported", source);
}

}  // namespace

Result<void> makeSession(const QString& path, const CalibrationTable& table, const std::optional<SampleTable>& samples,
                         const std::string& source) {
  // Read as it will be when the session is opened: what a plan cannot hold is told now.
  FT_TRY(const Plan plan, planFromJson(toJson(planOf(table)), source));
  if (QFileInfo::exists(path))
    return fail(ErrorCode::kIo, path.toStdString() + ": exists already; choose another name or open it");
  return replaceFileAtomically(path.toStdString(), [&](const std::filesystem::path& beside) -> Result<void> {
    // An empty file stands there, and a session is never made over one.
    QFile::remove(QString::fromStdString(beside.string()));
    FT_TRY(SessionStore store, SessionStore::create(QString::fromStdString(beside.string()), plan, table.metadata));
    return fill(store, table, samples, source);
  });
}

}  // namespace fieldtrue::acquisition
