#include "acquisition/session/imported_session.h"

#include <QFile>
#include <QFileInfo>
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
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

bool belongTogether(const Node& a, const Node& b) {
  return a.sensor != b.sensor && a.role == b.role && a.index == b.index &&
         a.reference_from_sensor.position_m == b.reference_from_sensor.position_m &&
         a.reference_from_sensor.orientation.coeffs() == b.reference_from_sensor.orientation.coeffs();
}

/// The rows of one place: those of one node and visit that differ in their sensors alone.
struct PlaceRows {
  PlannedPlace place;
  std::vector<Node> rows;

  bool takes(const Node& row) const {
    return std::all_of(rows.begin(), rows.end(), [&](const Node& other) { return belongTogether(row, other); });
  }
};

/// Visits as they are, those that are taken already moved behind the last.
std::vector<PlaceRows> placesOf(const CalibrationTable& table) {
  std::map<int, int> last_visit;
  for (const Node& row : table.nodes) {
    int& last = last_visit.try_emplace(row.node, row.visit).first->second;
    last = std::max(last, row.visit);
  }
  std::map<std::pair<int, int>, std::size_t> taken;
  std::vector<PlaceRows> places;
  for (const Node& row : table.nodes) {
    const auto [at, is_free] = taken.try_emplace({row.node, row.visit}, places.size());
    if (!is_free && places[at->second].takes(row)) {
      places[at->second].rows.push_back(row);
    } else {
      places.push_back({placeOf(row, is_free ? row.visit : ++last_visit[row.node]), {row}});
    }
  }
  return places;
}

Plan planOf(const std::vector<PlaceRows>& places) {
  Plan plan;
  for (const PlaceRows& one : places) plan.explicit_places.push_back(one.place);
  return plan;
}

std::vector<ForeignTake> takesOf(const std::vector<PlaceRows>& places) {
  std::vector<ForeignTake> takes;
  for (const PlaceRows& one : places) takes.push_back({takes.size(), one.rows, {}});
  return takes;
}

/// Gives the samples to their takes. @return those of none
std::vector<LooseSample> giveSamples(const SampleTable& samples, std::vector<ForeignTake>& takes) {
  std::map<RowKey, std::size_t> take_of;
  for (const ForeignTake& take : takes)
    for (const Node& mean : take.means) take_of.emplace(RowKey{mean.node, mean.sensor, mean.visit}, take.place);
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

Result<void> fill(SessionStore& store, std::vector<ForeignTake> takes, const std::optional<SampleTable>& samples,
                  const std::string& source) {
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
  const std::vector<PlaceRows> places = placesOf(table);
  FT_TRY(const Plan plan, planFromJson(toJson(planOf(places)), source));
  if (QFileInfo::exists(path))
    return fail(ErrorCode::kIo, path.toStdString() + ": exists already; choose another name or open it");
  return replaceFileAtomically(path.toStdString(), [&](const std::filesystem::path& beside) -> Result<void> {
    // An empty file stands there, and a session is never made over one.
    QFile::remove(QString::fromStdString(beside.string()));
    FT_TRY(SessionStore store, SessionStore::create(QString::fromStdString(beside.string()), plan, table.metadata));
    return fill(store, takesOf(places), samples, source);
  });
}

}  // namespace fieldtrue::acquisition
