#include "acquisition/devices/line_trace.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace fieldtrue::acquisition {
namespace {

constexpr std::size_t kBesideEachChunk = 64;  ///< About what a chunk takes beside its bytes.

}  // namespace

void LineTrace::add(double t_s, bool sent, std::string_view bytes) {
  if (bytes.empty()) return;
  chunks_.push_back({t_s, sent, std::string(bytes)});
  kept_ += bytes.size() + kBesideEachChunk;
  while (kept_ > most_bytes_ && chunks_.size() > 1) {
    const std::size_t oldest = chunks_.front().bytes.size();
    kept_ -= oldest + kBesideEachChunk;
    bytes_dropped_ += oldest;
    ++chunks_dropped_;
    chunks_.pop_front();
  }
  // Of a line that is lost and found for days only the streams are kept that have a chunk.
  const std::size_t last = streams_.size() - (streaming_ ? 1 : 0);
  std::size_t gone = 0;
  while (gone < last && streams_[gone].end_chunk <= chunks_dropped_) ++gone;
  streams_.erase(streams_.begin(), streams_.begin() + static_cast<std::ptrdiff_t>(gone));
}

void LineTrace::beginStream(TraceStream stream) {
  endStream();
  stream.first_chunk = chunks_dropped_ + chunks_.size();
  streams_.push_back(std::move(stream));
  streaming_ = true;
}

void LineTrace::endStream() {
  if (streaming_) streams_.back().end_chunk = chunks_dropped_ + chunks_.size();
  streaming_ = false;
}

Trace LineTrace::content() const {
  Trace trace;
  trace.bytes_dropped = bytes_dropped_;
  for (const Chunk& chunk : chunks_) {
    trace.chunks.push_back({chunk.t_s, chunk.sent, trace.bytes.size(), chunk.bytes.size()});
    trace.bytes += chunk.bytes;
  }
  trace.streams = streams_;
  if (streaming_) trace.streams.back().end_chunk = chunks_dropped_ + chunks_.size();
  for (TraceStream& stream : trace.streams) {
    for (std::size_t* chunk : {&stream.first_chunk, &stream.end_chunk}) *chunk -= std::min(*chunk, chunks_dropped_);
  }
  return trace;
}

}  // namespace fieldtrue::acquisition
