#include "acquisition/devices/openigtlink_survey.h"

#include <algorithm>
#include <set>

#include "acquisition/protocols/sample_status.h"

namespace fieldtrue::acquisition {
namespace {

bool isSamePose(const Pose& a, const Pose& b) {
  return a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs();
}

bool isSameSource(const IgtlSource& a, const IgtlSource& b) { return a.name == b.name && a.type == b.type; }

std::string quoted(const std::string& name) { return "\"" + name + "\""; }

}  // namespace

void IgtlSurvey::add(std::string_view bytes, double arrival_s) {
  constexpr int kFine = 1;
  std::vector<IgtlMessage> messages;
  parser_.add(bytes, messages);
  for (const IgtlMessage& message : messages) {
    const auto readings = readingsOf(message.header, message.body);
    for (const IgtlReading& reading : readings.value_or(std::vector<IgtlReading>{})) {
      take(message.header, reading, arrival_s);
    }
    const auto status = serverStatusOf(message.header, message.body);
    if (status && status->code != kFine) trouble_ = status;
  }
}

void IgtlSurvey::take(const IgtlHeader& header, const IgtlReading& reading, double arrival_s) {
  const IgtlSource source{reading.name, *igtlPoseType(header.type), header.device};
  auto known =
      std::find_if(heard_.begin(), heard_.end(), [&](const Heard& h) { return isSameSource(h.source, source); });
  if (known == heard_.end()) {
    Heard first;
    first.source = source;
    first.first_s = arrival_s;
    known = heard_.insert(heard_.end(), first);
  }
  const bool newer = header.stamp > known->stamp;
  const bool repeated = header.stamp == known->stamp && isSamePose(reading.tracker_from_sensor, known->pose);
  known->is_clock = known->is_clock && header.stamp != 0 && (newer || repeated);
  known->advances = known->advances || (known->n > 0 && newer);
  known->stamp = header.stamp;
  known->pose = reading.tracker_from_sensor;
  known->last_s = arrival_s;
  ++known->n;
  known->n_poses += reading.status.empty() ? 1 : 0;
  if (!reading.status.empty()) known->status = reading.status;
}

IgtlSurvey::Choice IgtlSurvey::choose(const std::vector<std::string>& wanted) const {
  constexpr double kUnknownRate_hz = 10.0;
  constexpr int kEnoughForARate = 3;
  Choice choice;
  choice.stamped = true;
  std::map<std::string, const Heard*> best;
  std::map<std::string, std::string> useless;
  for (const Heard& heard : heard_) {
    if (heard.n_poses == 0) {
      useless.emplace(heard.source.name, heard.status);
      continue;
    }
    const auto [at, is_first] = best.try_emplace(heard.source.name, &heard);
    if (!is_first && heard.source.type < at->second->source.type) at->second = &heard;
  }
  for (const auto& [name, status] : useless) {
    if (!best.contains(name)) choice.refused.push_back(quoted(name) + ": " + igtlStatusMeaning(status));
  }
  std::vector<std::string> names = wanted;
  if (wanted.empty()) {
    for (const auto& [name, heard] : best) names.push_back(name);
  }
  for (const std::string& name : names) {
    const auto found = best.find(name);
    if (found == best.end()) {
      choice.sources.push_back({name, {}, {}});
      continue;
    }
    const Heard& heard = *found->second;
    choice.sources.push_back(heard.source);
    choice.stamped = choice.stamped && heard.is_clock && heard.advances;
    const double span_s = heard.last_s - heard.first_s;
    if (heard.n >= kEnoughForARate && span_s > 0.0) {
      choice.rate_hz = std::max(choice.rate_hz, static_cast<double>(heard.n - 1) / span_s);
    }
  }
  if (choice.rate_hz == 0.0) choice.rate_hz = kUnknownRate_hz;
  return choice;
}

std::string IgtlSurvey::summary() const {
  std::string text;
  const auto add_part = [&text](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  for (const Heard& heard : heard_) {
    add_part(std::string(nameOf(heard.source.type)) + " of " + quoted(heard.source.name));
  }
  for (const auto& [type, count] : parser_.passedOver()) {
    // A question is a client's; a line that echoes is no server.
    if (!type.starts_with("GET_")) add_part(type + " (" + std::to_string(count) + ")");
  }
  if (parser_.wrong_crcs() > 0) add_part(std::to_string(parser_.wrong_crcs()) + " messages with a wrong CRC");
  if (trouble_) {
    add_part("the word " + quoted(trouble_->name.empty() ? std::to_string(trouble_->code) : trouble_->name) +
             (trouble_->message.empty() ? "" : " (" + trouble_->message + ")"));
  }
  return text;
}

IgtlReadings::IgtlReadings(std::shared_ptr<std::vector<IgtlSource>> sources, bool stamped, bool takes_newcomers)
    : sources_(std::move(sources)), stamped_(stamped), takes_newcomers_(takes_newcomers) {}

void IgtlReadings::add(std::string_view bytes, std::vector<Reading>& out) {
  messages_.clear();
  parser_.add(bytes, messages_);
  for (const IgtlMessage& message : messages_) read(message, out);
}

std::optional<std::size_t> IgtlReadings::sourceOf(const IgtlSource& heard, bool is_pose) {
  const auto named =
      std::find_if(sources_->begin(), sources_->end(), [&](const IgtlSource& s) { return s.name == heard.name; });
  const auto index = static_cast<std::size_t>(named - sources_->begin());
  if (named == sources_->end()) {
    if (!takes_newcomers_ || !is_pose) return std::nullopt;
    sources_->push_back(heard);
    return index;
  }
  // Wanted by name before it was heard: the first message it comes in is the one.
  if (named->message_device.empty()) *named = heard;
  return isSameSource(*named, heard) ? std::optional(index) : std::nullopt;
}

void IgtlReadings::read(const IgtlMessage& message, std::vector<Reading>& out) {
  auto readings = readingsOf(message.header, message.body);
  if (!readings) return;
  const IgtlPoseType type = *igtlPoseType(message.header.type);
  const auto unit_s =
      stamped_ && message.header.stamp != 0 ? std::optional(secondsOfIgtlStamp(message.header.stamp)) : std::nullopt;
  std::set<std::size_t> there;
  for (IgtlReading& reading : *readings) {
    const auto index = sourceOf({reading.name, type, message.header.device}, reading.status.empty());
    if (!index || !there.insert(*index).second) continue;
    const auto [last, is_first] = last_.try_emplace(*index);
    const bool repeated = !is_first && stamped_ && last->second.stamp == message.header.stamp &&
                          isSamePose(last->second.pose, reading.tracker_from_sensor);
    last->second = {message.header.stamp, reading.tracker_from_sensor};
    if (repeated) continue;
    Sample sample{0.0, static_cast<int>(*index), reading.tracker_from_sensor, std::move(reading.status)};
    out.push_back({std::move(sample), unit_s});
  }
  if (type != IgtlPoseType::kTrackingData && type != IgtlPoseType::kQuaternionData) return;
  for (std::size_t i = 0; i < sources_->size(); ++i) {
    const IgtlSource& source = (*sources_)[i];
    if (source.type != type || source.message_device != message.header.device || there.contains(i)) continue;
    out.push_back({{0.0, static_cast<int>(i), {}, kStatusMissing}, unit_s});
  }
}

}  // namespace fieldtrue::acquisition
