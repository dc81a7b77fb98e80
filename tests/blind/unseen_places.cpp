#include "tests/blind/unseen_places.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"

namespace blind {
namespace {

using nlohmann::json;

/// Mean squares over some of the places.
struct Squares {
  double n = 0.0;
  double start_m2 = 0.0, after_m2 = 0.0;
  double start_rad2 = 0.0, after_rad2 = 0.0;

  json toJson() const {
    const double count = std::max(1.0, n);
    return {{"n", n},
            {"start_m2", start_m2 / count},
            {"after_m2", after_m2 / count},
            {"start_rad2", start_rad2 / count},
            {"after_rad2", after_rad2 / count}};
  }
};

}  // namespace

SessionTable sealedPlaces(const std::filesystem::path& folder, const json& session) {
  const std::filesystem::path sealed = folder / "unseen" / (session.at("file").get<std::string>() + ".csv");
  if (sha256Hex(textOf(sealed)) != session.at("unseen_sha256").get<std::string>())
    throw std::runtime_error(sealed.string() + " was changed after it was sealed");
  return readTable(sealed);
}

json comparedWithSealed(const SessionTable& nodes, const SessionTable& unseen, std::span<const SolvedPose> after) {
  const BareAlignment bare = bareAlignment(nodes);
  Squares inside, outside;
  for (std::size_t place = 0; place < unseen.rows.size(); ++place) {
    const auto& sealed = unseen.rows[place];
    const SolvedPose truth = trackedPose(unseen, sealed);
    const SolvedPose start = bare.reported(truePose(unseen, sealed));
    Squares& squares = sealed[unseen.neededColumn("inside")] == "1" ? inside : outside;
    squares.n += 1.0;
    squares.start_m2 += (start.position_m - truth.position_m).squaredNorm();
    squares.after_m2 += (after[place].position_m - truth.position_m).squaredNorm();
    squares.start_rad2 += rotationBetween(start.orientation, truth.orientation).squaredNorm();
    squares.after_rad2 += rotationBetween(after[place].orientation, truth.orientation).squaredNorm();
  }
  return {{"inside", inside.toJson()}, {"outside", outside.toJson()}};
}

}  // namespace blind
