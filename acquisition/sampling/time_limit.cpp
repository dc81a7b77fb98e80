#include "acquisition/sampling/time_limit.h"

#include <array>
#include <string_view>
#include <utility>

namespace fieldtrue::acquisition {

namespace {

constexpr std::array<std::pair<std::string_view, AtTimeLimit>, 4> kNames{{
    {"keep", AtTimeLimit::kKeep},
    {"again", AtTimeLimit::kAgain},
    {"skip", AtTimeLimit::kSkip},
    {"ask", AtTimeLimit::kAsk},
}};

}  // namespace

Result<AtTimeLimit> readAtTimeLimit(const std::string& text) {
  for (const auto& [name, at_time_limit] : kNames)
    if (text == name) return at_time_limit;
  return fail(ErrorCode::kBadInput,
              "'" + text + "' says not what to do when a take's time is over: keep, again, " + "skip or ask does");
}

}  // namespace fieldtrue::acquisition
