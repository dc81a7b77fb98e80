#include "calib/core/json_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace fieldtrue {

namespace {

struct TooDeep {};

/// Stops the parser at the first bracket that lies too deep, before there is a tree to take down.
bool keepShallow(int depth, nlohmann::json::parse_event_t event, nlohmann::json&) {
  using Event = nlohmann::json::parse_event_t;
  if ((event == Event::object_start || event == Event::array_start) && depth >= kDeepestJson) throw TooDeep();
  return true;
}

/// Line of a byte of a text, counted from 1.
std::size_t lineOf(const std::string& text, std::size_t byte) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(byte, text.size()));
  return 1 + static_cast<std::size_t>(std::count(text.begin(), end, '\n'));
}

/// The beginning of a text that no bracket opens, as far as it can be printed: a file of another kind. Else empty.
std::string otherBeginning(const std::string& text, JsonComments comments) {
  constexpr std::size_t kShown = 24;
  const std::string of_json = comments == JsonComments::kSkipped ? "{[\"/" : "{[\"";
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos || of_json.find(text[first]) != std::string::npos) return {};
  const auto begin = text.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(std::min(kShown, text.size() - first));
  return {begin, std::find_if(begin, end, [](char c) { return c < ' ' || c > '~'; })};
}

std::string notJson(const std::string& text, JsonComments comments) {
  const std::string beginning = otherBeginning(text, comments);
  if (!beginning.empty())
    return "this is not valid JSON but a file of another kind: it begins with \"" + beginning + "\"";
  return "this is not valid JSON; look for a missing comma, quote or bracket there or just before, or for a file that "
         "was cut short";
}

}  // namespace

Result<nlohmann::json> parseJson(const std::string& text, const std::string& name, JsonComments comments) {
  try {
    return nlohmann::json::parse(text, keepShallow, true, comments == JsonComments::kSkipped);
  } catch (const TooDeep&) {
    return fail(ErrorCode::kBadInput, name + ": its brackets are nested more than " + std::to_string(kDeepestJson) +
                                          " deep; no file of Fieldtrue is, so this is not one or it is damaged");
  } catch (const nlohmann::json::parse_error& e) {
    const std::size_t byte = e.byte == 0 ? 0 : e.byte - 1;
    return fail(ErrorCode::kBadInput,
                name + ", line " + std::to_string(lineOf(text, byte)) + ": " + notJson(text, comments));
  } catch (const nlohmann::json::exception&) {
    return fail(ErrorCode::kBadInput, name + ": a number in it is too large to be read");
  }
}

}  // namespace fieldtrue
