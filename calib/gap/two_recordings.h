#pragma once

#include <memory>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/identify/shared_field.h"
#include "calib/recording/cleaning.h"

namespace fieldtrue::gap {

/// A recording with what is known of its noise.
struct Recording {
  recording::Cleaned cleaned;  ///< Its nodes are the rows.
  identify::GapRows rows;
  std::unique_ptr<identify::GapSearch> search;
};

/// @error kTooFewNodes below Thresholds::fewest_places usable places
Result<std::unique_ptr<Recording>> recordingOf(const CalibrationTable& table, const identify::Thresholds& thresholds);

/// The alignments of the earlier and of the later recording.
struct Alignments {
  identify::GapAlignment before;
  identify::GapAlignment now;
};

/// Of each row of the later recording: the earlier one's place where number and true position agree, else one of its
/// own.
std::vector<int> placesBefore(const Recording& before, const Recording& now);

/// An even choice of rows by where they are, so that two recordings of one grid keep the same places.
std::vector<std::size_t> evenlyPlaced(const identify::GapRows& rows, std::size_t most);

/// An even choice of rows of both recordings, positions or rotations, each beside its alignment.
identify::FieldReadings someOfBoth(const Recording& before, const Recording& now, const Alignments& alignments,
                                   std::span<const int> places, bool rotation);

/// The alignments under which both recordings show one field best. Each alone takes as much of the field for its own as
/// its places allow, and other places allow other parts: of two that differ by degrees the difference is no longer
/// linear. Found by Gauss and Newton on the density of both under a common smooth field.
Alignments alignedTogether(const Recording& before, const Recording& now, std::span<const int> places);

}  // namespace fieldtrue::gap
