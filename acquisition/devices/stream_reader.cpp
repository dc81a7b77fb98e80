#include "acquisition/devices/stream_reader.h"

#include <utility>

namespace fieldtrue::acquisition {

StreamReader::StreamReader(StreamPlan plan, double rate_hz, double clock_speed, QString summary)
    : plan_(std::move(plan)), rate_hz_(rate_hz), summary_(std::move(summary)), unit_clock_(clock_speed) {
  FT_CHECK(plan_.parser != nullptr && rate_hz_ > 0.0);
}

StreamReader::Batch StreamReader::read(std::string_view bytes, double arrival_s) {
  std::vector<Reading> readings;
  plan_.parser->add(bytes, readings);
  std::map<int, std::size_t> left;
  for (const Reading& reading : readings) ++left[reading.sample.sensor];
  Batch batch;
  batch.samples.reserve(readings.size());
  for (Reading& reading : readings) {
    Sample sample = stamped(reading, arrival_s, --left[reading.sample.sensor], batch.remarks);
    if (plan_.watches_mirrors) hemisphere_.check(sample);
    noteStatus(sample, batch.remarks);
    batch.samples.push_back(std::move(sample));
  }
  return batch;
}

Sample StreamReader::stamped(Reading& reading, double arrival_s, std::size_t later_in_bunch, QStringList& remarks) {
  Sample sample = std::move(reading.sample);
  if (reading.unit_s) {
    sample.time_s = unit_clock_.stamp(arrival_s, *reading.unit_s);
    if (unit_clock_.jumped()) {
      remarks << QString("%1; its clock jumped by %2 s").arg(summary_).arg(unit_clock_.jump_s(), 0, 'f', 2);
    }
  } else {
    SampleClock& clock = clocks_.try_emplace(sample.sensor, 1.0 / rate_hz_).first->second;
    sample.time_s = clock.stamp(arrival_s, later_in_bunch);
  }
  return sample;
}

void StreamReader::noteStatus(const Sample& sample, QStringList& remarks) {
  std::string& last = last_status_[sample.sensor];
  if (last == sample.status) return;
  last = sample.status;
  remarks << (last.empty() ? summary_
                           : QString("%1 %2: %3")
                                 .arg(plan_.part)
                                 .arg(sample.sensor + 1)
                                 .arg(QString::fromStdString(plan_.meaning(last))));
}

}  // namespace fieldtrue::acquisition
