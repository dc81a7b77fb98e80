#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tests/blind/generate_effects.h"
#include "tests/blind/plan_classes.h"
#include "tests/blind/session.h"

namespace blind {

/// A finished session: the two tables as text and its truth.
struct GeneratedSession {
  std::string nodes_csv;
  std::string samples_csv;
  std::string unseen_csv;  ///< Places that are not in the tables, with the exact pose the tracker would report.
  nlohmann::json truth;
};

/// Gaps to noise that are asked for.
inline constexpr std::array<double, 4> kLevels = {0.35, 0.7, 1.4, 2.8};

struct SessionWish {
  std::string shelf;            ///< none, single, pairs, off, unforeseen, signals
  std::optional<double> level;  ///< gap to noise of a single effect; nothing: drawn
  bool samples = false;         ///< sample tables for all, not for a quarter of the sessions whatever their shelf
  std::size_t most_rows = 0;    ///< 0: any number
  std::string kind;             ///< of an unforeseen effect; "": drawn
};

/// A session with what it was made of.
struct MadeSession {
  Setup setup;
  std::vector<Placed> effects;  ///< None on the shelves none and signals.
  GeneratedSession tables;
};

/// Draws one session.
/// @param seed of this session alone: the same seed gives the same bytes
MadeSession makeSession(const SessionWish& wish, std::uint64_t seed);

/// Seeds of the sessions of a set, in their order.
/// @param seed of the set
/// @param count number of sessions, at least 1
std::vector<std::uint64_t> sessionSeeds(std::uint64_t seed, std::size_t count);

/// What room, rig and electronics do with these effects, as drawn.
World worldOf(const std::vector<Placed>& effects);

/// Every effect of the catalogue, in order of name.
std::vector<std::string> catalogueIds();

/// Every unforeseen kind of a batch, in their order.
/// @param batch 1 is the oldest
std::vector<std::string> unforeseenIds(std::size_t batch);

/// Faults of the sample stream of one session; zero or one: none.
struct StreamFault {
  double line_hz = 0, line_amplitude = 0;  ///< amplitude of the coupling [m^-3]
  double range_power = 0;                  ///< noise grows by this power of the range more
  double range_factor = 1;
  double hidden_filter = 0;  ///< correlation that n_effective does not admit
  double quantum_m = 0;
  double flip_share = 0;
};

/// Adds seating, filtered noise and faults, and writes the tables.
/// @return node table and, where asked for, sample table
GeneratedSession recordSession(const Setup& setup, const World& world, const Alignment& alignment,
                               const StreamFault& fault, bool samples, Random& random);

/// Places that no table holds: 150 within the box of the grid and 50 outside, up to one pitch away, at times spread
/// over the session, each with the pose that the tracker would report without noise or seating error, the rig's
/// systematic error kept.
/// @return a table with `inside` (1 or 0), t_s, i, j, k, place and attitude as the drawing has them, and the exact pose
std::string recordUnseen(const Setup& setup, const World& world, Random& random);

}  // namespace blind
