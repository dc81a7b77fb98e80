#include "calib/importers/column_names.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <vector>

#include "calib/importers/text_table.h"

namespace fieldtrue::importers {
namespace {

using Words = std::vector<std::string>;

/// The words of a column's name in lower case: "posX [mm]" is pos, x, mm.
Words wordsOf(const std::string& name) {
  Words words(1);
  char last = ' ';
  for (const char c : name) {
    const bool is_letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
    const bool begins =
        is_letter && std::isupper(static_cast<unsigned char>(c)) && std::islower(static_cast<unsigned char>(last));
    if ((!is_letter || begins) && !words.back().empty()) words.emplace_back();
    if (is_letter) words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    last = c;
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

const std::set<std::string> kTruthWords{
    "true", "truth", "ref",     "reference", "gt",    "ground",  "groundtruth", "nominal", "rig",
    "jig",  "known", "phantom", "ideal",     "gold",  "target",  "expected",    "desired", "commanded",
    "wahr", "soll",  "planned", "set",       "robot", "optical", "vicon",       "cmm"};
const std::set<std::string> kReadingWords{"tracked", "tracker", "meas",   "measured", "measurement",
                                          "raw",     "reading", "actual", "real",     "sensor",
                                          "em",      "ist",     "stylus", "tip"};
const std::set<std::string> kQuaternionWords{"q", "quat", "quaternion", "rot", "rotation", "orientation", "ori"};
const std::set<std::string> kPositionWords{"p", "t", "pos", "position", "mean", "tracked", "meas", "measured", "raw"};
/// Columns that tell of a position how sure or how wrong it is.
const std::set<std::string> kNoPosition{"sd", "std", "sigma", "var", "cov", "err", "error", "norm", "rms", "residual"};

/// Names that stand for themselves, by the setting they are of.
const std::map<std::string, std::set<std::string>> kWholeNames{
    {"azimuth", {"azimuth", "az", "yaw"}},
    {"elevation", {"elevation", "el", "pitch"}},
    {"roll", {"roll"}},
    {"node", {"node", "place", "point", "landmark", "fiducial", "hole"}},
    {"sensor", {"sensor", "station", "channel", "tool", "port"}},
    {"visit", {"visit", "repeat", "repetition", "trial"}},
    {"time", {"time", "timestamp", "t", "seconds"}},
    {"status", {"status"}}};

std::string wholeName(const std::string& word) {
  for (const auto& [key, names] : kWholeNames)
    if (names.contains(word)) return key;
  return {};
}

/// Takes the axis letter out of a word like "px", "xpos" or "x1"; zero when it holds none.
char takeAxis(std::string& word) {
  const auto is_axis = [](char c) { return c == 'x' || c == 'y' || c == 'z'; };
  static const std::set<std::string> beside{"",   "p",       "t",    "pos",      "position", "true",  "ref",
                                            "gt", "tracked", "meas", "measured", "raw",      "sensor"};
  const auto rest = [](const std::string& text) {
    std::string letters = text;
    while (!letters.empty() && std::isdigit(static_cast<unsigned char>(letters.back()))) letters.pop_back();
    return letters;
  };
  if (word.empty()) return 0;
  if (is_axis(word.front()) && beside.contains(rest(word.substr(1)))) {
    const char axis = word.front();
    word.erase(0, 1);
    return axis;
  }
  if (is_axis(word.back()) && beside.contains(rest(word.substr(0, word.size() - 1)))) {
    const char axis = word.back();
    word.pop_back();
    return axis;
  }
  return 0;
}

/// The part of a quaternion that words name: w, x, y or z; zero when they name none.
char quaternionPart(Words& words) {
  const bool is_told =
      std::any_of(words.begin(), words.end(), [](const auto& w) { return kQuaternionWords.contains(w); });
  for (std::string& word : words) {
    const bool is_short = word.size() == 2 && word[0] == 'q';
    const bool is_part = is_short || (is_told && word.size() == 1);
    const char last = word.empty() ? ' ' : word.back();
    if (!is_part) continue;
    if (last >= '0' && last <= '3') return word = "q", "wxyz"[last - '0'];
    if (last == 'w' || last == 'x' || last == 'y' || last == 'z') return word = "q", last;
  }
  return 0;
}

/// Words that stand for units, and what they are called here.
const std::map<std::string, std::string> kUnitWords{{"deg", "deg"},     {"degrees", "deg"}, {"rad", "rad"},
                                                    {"radians", "rad"}, {"s", "s"},         {"sec", "s"},
                                                    {"ms", "ms"},       {"us", "us"},       {"ns", "ns"}};

std::string takeUnit(Words& words) {
  if (words.size() < 2) return {};
  const std::vector<std::string> lengths = lengthUnits();
  const auto other = kUnitWords.find(words.back());
  const bool is_length = std::find(lengths.begin(), lengths.end(), words.back()) != lengths.end();
  if (!is_length && other == kUnitWords.end()) return {};
  const std::string unit = is_length ? words.back() : other->second;
  words.pop_back();
  return unit;
}

std::string spaced(const Words& words) {
  std::string text;
  for (const std::string& word : words) (text += word) += ' ';
  return text;
}

}  // namespace

ColumnName readColumnName(const std::string& name) {
  Words words = wordsOf(name);
  ColumnName result;
  result.unit = takeUnit(words);
  if (std::any_of(words.begin(), words.end(), [](const auto& word) { return kNoPosition.contains(word); }))
    return result;
  if (const char part = quaternionPart(words)) {
    result.part = std::string("q") + part;
  } else {
    for (std::string& word : words) {
      if (const char axis = takeAxis(word)) {
        result.part = std::string(1, axis);
        break;
      }
    }
  }
  for (const std::string& word : words) {
    result.is_true = result.is_true || kTruthWords.contains(word);
    result.is_reading = result.is_reading || kReadingWords.contains(word);
    if (result.part.empty()) result.part = wholeName(word);
  }
  const bool is_angle = result.part == "azimuth" || result.part == "elevation" || result.part == "roll";
  if (is_angle) std::erase_if(words, [&](const std::string& word) { return wholeName(word) == result.part; });
  result.stem = spaced(words);
  return result;
}

std::string ownerOf(const std::string& stem) {
  Words words = wordsOf(stem);
  std::erase_if(
      words, [](const std::string& word) { return kQuaternionWords.contains(word) || kPositionWords.contains(word); });
  return spaced(words);
}

}  // namespace fieldtrue::importers
