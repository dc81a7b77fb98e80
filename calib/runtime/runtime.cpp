#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "calib/core/exception_barrier.h"
#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/runtime/fieldtrue_runtime.h"
#include "calib/runtime/runtime_calibration.h"

/// The C interface over RuntimeCalibration.
struct fieldtrue_calibration {
  fieldtrue::runtime::RuntimeCalibration content;
};

namespace fieldtrue::runtime {
namespace {

thread_local std::string last_error;

fieldtrue_status statusOf(const Error& error) {
  last_error = error.message;
  switch (error.code) {
    case ErrorCode::kIo:
      return FIELDTRUE_UNREADABLE;
    case ErrorCode::kNewerVersion:
      return FIELDTRUE_NEWER_FILE;
    case ErrorCode::kBadInput:
      return FIELDTRUE_BAD_FILE;
    default:
      return FIELDTRUE_IMPOSSIBLE;
  }
}

fieldtrue_status badArgument(const char* sentence) {
  last_error = sentence;
  return FIELDTRUE_BAD_ARGUMENT;
}

/// Runs `make`, which gives a Result<RuntimeCalibration>, behind the barrier.
template <class Make>
fieldtrue_status made(fieldtrue_calibration** out, Make make) {
  const auto guarded = [&] {
    return make().map([](RuntimeCalibration content) {
      return std::make_unique<fieldtrue_calibration>(fieldtrue_calibration{std::move(content)});
    });
  };
  auto calibration = withBarrier("nothing was read", guarded);
  if (!calibration) return statusOf(calibration.error());
  *out = calibration->release();
  return FIELDTRUE_OK;
}

bool hasOrientation(const double* wxyz) {
  return std::any_of(wxyz, wxyz + 4, [](double value) { return value != 0.0; });
}

Pose poseFrom(const fieldtrue_pose& from) {
  Pose pose;
  pose.position_m = Eigen::Vector3d::Map(from.position_m);
  const double* q = from.orientation_wxyz;
  if (hasOrientation(q)) pose.orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  return pose;
}

void writePose(const Pose& pose, bool has_orientation, fieldtrue_pose& to) {
  Eigen::Vector3d::Map(to.position_m) = pose.position_m;
  const Eigen::Quaterniond q = canonical(pose.orientation);
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  for (int i = 0; i < 4; ++i) to.orientation_wxyz[i] = has_orientation ? wxyz[i] : 0.0;
}

std::optional<int> sensorOf(int sensor) { return sensor < 0 ? std::nullopt : std::optional(sensor); }

constexpr std::size_t kBlock = 256;

void correctBlock(const calibration::Evaluator& evaluator, std::optional<int> sensor, const fieldtrue_pose* tracked,
                  fieldtrue_pose* corrected, std::size_t n) {
  std::array<Pose, kBlock> poses;
  std::array<bool, kBlock> has_orientation;
  std::array<Eigen::Vector3d, kBlock> means_m;  // Of a correction of poses, where a row has none.
  std::array<std::optional<int>, kBlock> sensors;
  for (std::size_t i = 0; i < n; ++i) {
    poses[i] = poseFrom(tracked[i]);
    has_orientation[i] = hasOrientation(tracked[i].orientation_wxyz);
    sensors[i] = sensor;
    if (!has_orientation[i] && evaluator.takesOrientation())
      means_m[i] = evaluator.correctPosition_m(poses[i].position_m, sensor);
  }
  const std::span<Pose> block = std::span(poses).first(n);
  evaluator.correct(block, block, std::span(sensors).first(n));
  for (std::size_t i = 0; i < n; ++i) {
    if (!has_orientation[i] && evaluator.takesOrientation()) poses[i].position_m = means_m[i];
    writePose(poses[i], has_orientation[i], corrected[i]);
  }
}

}  // namespace
}  // namespace fieldtrue::runtime

using namespace fieldtrue;
using namespace fieldtrue::runtime;

const char* fieldtrue_version(void) { return FIELDTRUE_VERSION; }

fieldtrue_status fieldtrue_load(const char* path, fieldtrue_calibration** calibration) {
  if (calibration == nullptr) return badArgument("fieldtrue_load needs a place for the calibration.");
  *calibration = nullptr;
  if (path == nullptr) return badArgument("fieldtrue_load needs a path.");
  return made(calibration, [path] {
    const std::filesystem::path file(path);
    return readFile(file).and_then(
        [&](const std::string& text) { return RuntimeCalibration::fromText(text, file.filename().string()); });
  });
}

fieldtrue_status fieldtrue_load_memory(const char* text, size_t size, const char* name,
                                       fieldtrue_calibration** calibration) {
  if (calibration == nullptr) return badArgument("fieldtrue_load_memory needs a place for the calibration.");
  *calibration = nullptr;
  if (text == nullptr) return badArgument("fieldtrue_load_memory needs a text.");
  return made(calibration, [=] {
    return RuntimeCalibration::fromText(std::string(text, size), name != nullptr ? name : "The calibration");
  });
}

void fieldtrue_free(fieldtrue_calibration* calibration) { delete calibration; }

const char* fieldtrue_error(void) { return last_error.c_str(); }

fieldtrue_status fieldtrue_bake(const fieldtrue_calibration* calibration, double max_deviation_um, double max_angle_deg,
                                fieldtrue_calibration** baked) {
  if (baked == nullptr) return badArgument("fieldtrue_bake needs a place for the baked calibration.");
  *baked = nullptr;
  if (calibration == nullptr) return badArgument("fieldtrue_bake needs a calibration.");
  if (!(max_deviation_um > 0.0) || !(max_angle_deg > 0.0))
    return badArgument("fieldtrue_bake needs a largest deviation and a largest angle above 0.");
  return made(baked, [=] { return calibration->content.baked(1e-6 * max_deviation_um, max_angle_deg / kDegPerRad); });
}

fieldtrue_status fieldtrue_of_sensor(const fieldtrue_calibration* calibration, int sensor,
                                     fieldtrue_calibration** one) {
  if (one == nullptr) return badArgument("fieldtrue_of_sensor needs a place for the calibration of one sensor.");
  *one = nullptr;
  if (calibration == nullptr) return badArgument("fieldtrue_of_sensor needs a calibration.");
  return made(one, [=] { return calibration->content.ofSensor(sensor); });
}

void fieldtrue_correct(const fieldtrue_calibration* calibration, int sensor, const fieldtrue_pose* tracked,
                       fieldtrue_pose* corrected) {
  const calibration::Evaluator& evaluator = calibration->content.evaluator();
  const bool has_orientation = hasOrientation(tracked->orientation_wxyz);
  const Pose pose = poseFrom(*tracked);
  Pose answer = evaluator.correct(pose, sensorOf(sensor));
  if (!has_orientation && evaluator.takesOrientation())
    answer.position_m = evaluator.correctPosition_m(pose.position_m, sensorOf(sensor));
  writePose(answer, has_orientation, *corrected);
}

void fieldtrue_correct_many(const fieldtrue_calibration* calibration, int sensor, const fieldtrue_pose* tracked,
                            fieldtrue_pose* corrected, size_t n) {
  for (std::size_t start = 0; start < n; start += kBlock)
    correctBlock(calibration->content.evaluator(), sensorOf(sensor), tracked + start, corrected + start,
                 std::min(kBlock, n - start));
}

void fieldtrue_correct_positions(const fieldtrue_calibration* calibration, const double* tracked_m, double* corrected_m,
                                 size_t n) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  calibration->content.evaluator().correctPositions({reinterpret_cast<const Eigen::Vector3d*>(tracked_m), n},
                                                    {reinterpret_cast<Eigen::Vector3d*>(corrected_m), n});
}

double fieldtrue_uncertainty_m(const fieldtrue_calibration* calibration, const fieldtrue_pose* tracked) {
  const calibration::Evaluator& evaluator = calibration->content.evaluator();
  const Pose pose = poseFrom(*tracked);
  const auto known_m = hasOrientation(tracked->orientation_wxyz) ? evaluator.uncertaintyAt_m(pose)
                                                                 : evaluator.uncertainty_m(pose.position_m);
  return known_m.value_or(std::numeric_limits<double>::quiet_NaN());
}

int fieldtrue_inside(const fieldtrue_calibration* calibration, const double position_m[3]) {
  return calibration->content.evaluator().covers(Eigen::Vector3d::Map(position_m)) ? 1 : 0;
}

double fieldtrue_nearest_orientation_deg(const fieldtrue_calibration* calibration, const double orientation_wxyz[4]) {
  const double* q = orientation_wxyz;
  double nearest_rad = std::numeric_limits<double>::infinity();
  if (hasOrientation(q))
    for (const Eigen::Quaterniond& seen : calibration->content.orientationsSeen())
      nearest_rad =
          std::min(nearest_rad, angleBetween_rad(seen, Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized()));
  return std::isfinite(nearest_rad) ? kDegPerRad * nearest_rad : std::numeric_limits<double>::quiet_NaN();
}

int fieldtrue_takes_orientation(const fieldtrue_calibration* calibration) {
  return calibration->content.evaluator().takesOrientation() ? 1 : 0;
}

const char* fieldtrue_fact(const fieldtrue_calibration* calibration, const char* key) {
  const std::string* fact = key == nullptr ? nullptr : calibration->content.fact(key);
  return fact == nullptr ? nullptr : fact->c_str();
}

fieldtrue_match fieldtrue_setup_matches(const fieldtrue_calibration* calibration, const char* const* facts, size_t n,
                                        char* text, size_t size) {
  if (text != nullptr && size > 0) text[0] = '\0';
  const auto matched = withBarrier("the set-up was not compared", [&]() -> Result<SetupMatch> {
    Setup stated;
    for (std::size_t i = 0; i < n; ++i) {
      const std::string_view fact = facts[i];
      const std::size_t equals = fact.find('=');
      if (equals == std::string_view::npos)
        return fail(ErrorCode::kBadInput, "A fact is written as key=value, not '" + std::string(fact) + "'");
      FT_TRY_VOID(state(stated, fact.substr(0, equals), fact.substr(equals + 1)));
    }
    const std::string difference = differenceText(calibration->content.setup(), stated);
    if (text != nullptr && size > 0) {
      const std::size_t length = std::min(difference.size(), size - 1);
      std::memcpy(text, difference.data(), length);
      text[length] = '\0';
    }
    return match(calibration->content.setup(), stated);
  });
  if (!matched) {
    static_cast<void>(statusOf(matched.error()));
    return FIELDTRUE_MATCH_UNKNOWN;
  }
  switch (*matched) {
    case SetupMatch::kYes:
      return FIELDTRUE_MATCH_YES;
    case SetupMatch::kNo:
      return FIELDTRUE_MATCH_NO;
    case SetupMatch::kUnknown:
      break;
  }
  return FIELDTRUE_MATCH_UNKNOWN;
}
