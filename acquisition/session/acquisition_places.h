#pragma once

#include <map>

#include "acquisition/sampling/node_sampler.h"
#include "acquisition/sampling/reference_guess.h"
#include "acquisition/sampling/rig_fit.h"
#include "acquisition/session/session_store.h"

namespace fieldtrue::acquisition {

/// What is known of the places: what is recorded of each, how the takes fit each other, and where the next one belongs.
struct KnownPlaces {
  explicit KnownPlaces(const std::optional<SessionStore>& open_store) : store(open_store) {}

  /// What is read of a session when it is opened.
  struct Content {
    std::vector<PlaceState> states;
    std::vector<std::vector<Node>> rows;
    bool can_undo = false, can_redo = false;
    std::string page;
    std::string newest_fit;  ///< Empty when there is none.
    std::string gap;         ///< What the Gap page kept; empty when it kept nothing.
  };
  static Result<Content> read(const SessionStore& store);
  void fill(const Content& content);
  void clear();
  /// Reads again what is stored of one place. @return the samples of its live take
  Result<std::vector<Sample>> reload(std::size_t place);
  void setRows(std::size_t place, const std::vector<Node>& rows_now);
  const Node* counted(std::size_t place) const;  ///< The leading row; null where there is none, or it was skipped.
  void gatherDone();
  const Node* rowOf(std::size_t place, int sensor) const;  ///< Null where it has none.
  /// The row of the sensor that leads now; before one does, of the one that led there. Null without one.
  const Node* leading(std::size_t place) const;
  /// From now on this sensor tells how the takes fit, though some are led by another; none = of each its own.
  void leadBy(std::optional<int> sensor);
  /// The sensors that took the places, the leading one first; empty before the first take.
  std::vector<int> sensors() const;
  std::optional<std::size_t> next() const;
  /// The current place has been taken, or skipped, before.
  bool isRetake() const { return current && states[*current] != PlaceState::kPlanned; }
  const PlannedPlace& here() const { return store->places()[*current]; }  ///< Only where one is current.

  /// Takes that count, nearest to a place first, its own among them.
  std::vector<std::size_t> nearestTakes(std::size_t place, std::size_t most) const;
  std::vector<NeighbourTake> neighbours(std::size_t place, int sensor) const;
  /// Whether a sensor is where it was though the leading one has been carried there from another place: it does not
  /// ride on the jig. @param means_m of the take at the place, by sensor
  bool staysBehind(std::size_t place, const std::map<int, Eigen::Vector3d>& means_m, int leading, int sensor) const;
  RigFit fitOf(const std::vector<std::size_t>& takes) const;
  /// @param is_judged when given, marks the places that were judged
  void judgeAround(std::size_t place, std::vector<bool>* is_judged = nullptr);
  void judgeAll();

  void updateGuess();
  std::optional<double> distance_m(const std::optional<Sample>& live) const;  ///< To the current place.
  /// The same, where it is farther than a take there may be.
  std::optional<double> tooFar_m(const std::optional<Sample>& live) const;
  /// Not at the current place, as far as that can be told.
  bool isElsewhere(const std::optional<Sample>& live) const;

  std::optional<int> led_by;
  const std::optional<SessionStore>& store;  ///< None while no session is open.
  std::vector<PlaceState> states;
  std::vector<std::vector<Node>> rows;  ///< Of each place: one a sensor, the leading one first.
  /// Where each place's take belongs [m], NaN without one that counts: small, for each new take looks through all.
  std::vector<Eigen::Vector3d> takes_m;
  /// The leading rows not skipped, in any order: kept up, for gathering them costs each take more.
  std::vector<Node> done_nodes;
  bool can_undo = false, can_redo = false;
  std::map<std::size_t, double> misfits;  ///< Places whose takes do not fit the others, and how far they are off [m].

  std::optional<std::size_t> current;
  double spacing = 0.3;     ///< From the current place to the next one [m].
  double near_m = 0.0;      ///< Within this distance a resting sensor is taken to stand on the current place.
  Pose believed_reference;  ///< What is believed of the transmitter's place before the first take.
  ReferenceGuess guess;
  RigFit rig;  ///< The takes around the current place.
};

}  // namespace fieldtrue::acquisition
