#include "acquisition/devices/line_trace.h"

#include <algorithm>

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
  // A line that is lost and found for days: of what begins before the oldest chunk, only the last is still read.
  while (streams_.size() > 1 && streams_[1].first_chunk <= chunks_dropped_) streams_.erase(streams_.begin());
}

void LineTrace::beginStream(TraceStream stream) {
  stream.first_chunk = chunks_dropped_ + chunks_.size();
  // One that brought no byte before the next began is of no use.
  if (!streams_.empty() && streams_.back().first_chunk == stream.first_chunk) streams_.pop_back();
  streams_.push_back(std::move(stream));
}

Trace LineTrace::content() const {
  Trace trace;
  trace.bytes_dropped = bytes_dropped_;
  for (const Chunk& chunk : chunks_) {
    trace.chunks.push_back({chunk.t_s, chunk.sent, trace.bytes.size(), chunk.bytes.size()});
    trace.bytes += chunk.bytes;
  }
  trace.streams = streams_;
  for (TraceStream& stream : trace.streams) stream.first_chunk -= std::min(stream.first_chunk, chunks_dropped_);
  return trace;
}

}  // namespace fieldtrue::acquisition
