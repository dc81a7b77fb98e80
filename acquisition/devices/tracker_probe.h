#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldtrue::acquisition {

/// What a tracker told when it was asked, or by streaming.
struct ProbeAnswer {
  std::string model;                           ///< "Polhemus Fastrak, Lab 2".
  std::string firmware;                        ///< Empty where it was not told.
  std::vector<int> sensors;                    ///< Stations plugged in, counted from 1; empty where it was not told.
  std::vector<std::string> sensor_names = {};  ///< Where they have names.
};

/// How it is found out whether a tracker of one kind is on a line: the least that makes it answer.
struct TrackerProbe {
  std::vector<int> rates;  ///< Of a serial line [baud], the most usual first.
  std::string stop = {};   ///< Ends a stream, so that the answer can be told from it; nothing where it cannot be one.
  std::string ask = {};    ///< Asks who it is; empty = it is only listened to.
  int reply_ms = 400;      ///< Within which it answers.
  bool drops_rts = false;  ///< The line's RTS must be low, or the tracker is held in reset.
  int settle_ms = 100;     ///< After opening the line and after `stop`.
  int break_ms = 0;        ///< A break of that length before it is asked; 0 = none.
  /// Reads what was heard after asking. Must not take another tracker's answer for its own.
  std::optional<ProbeAnswer> (*answer)(std::string_view heard) = nullptr;
  /// Recognises a stream that runs already, whatever its settings; null where none can be told.
  std::optional<ProbeAnswer> (*stream)(std::string_view heard) = nullptr;
  std::string may_do = {};  ///< What asking may do to a unit, in a sentence.
};

/// An adapter, or a tracker's own socket, that belongs to a kind of tracker.
struct KnownUsb {
  int vendor = 0;
  int first_product = 0;
  int last_product = 0;
};

}  // namespace fieldtrue::acquisition
