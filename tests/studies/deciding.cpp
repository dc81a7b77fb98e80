#include "tests/studies/deciding.h"

#include <array>

namespace fieldtrue::testing {
namespace {

using identify::Thresholds;

template <auto Member>
Deciding one(const char* name, bool is_tried = true) {
  return {name, is_tried, [](const Thresholds& thresholds) { return static_cast<double>(thresholds.*Member); },
          [](Thresholds& thresholds, double factor) {
            auto& value = thresholds.*Member;
            value = static_cast<std::remove_reference_t<decltype(value)>>(factor * static_cast<double>(value));
          }};
}

template <auto Member>
Deciding ofLines(const char* name) {
  return {name, false, [](const Thresholds& thresholds) { return thresholds.lines.*Member; },
          [](Thresholds& thresholds, double factor) { thresholds.lines.*Member *= factor; }};
}

const std::array kDeciding = {
    one<&Thresholds::fewest_places>("fewest_places", false),
    one<&Thresholds::fewest_places_for_causes>("fewest_places_for_causes"),
    one<&Thresholds::astray>("astray"),
    one<&Thresholds::mirrored>("mirrored"),
    one<&Thresholds::worst_placing_m>("worst_placing_m"),
    one<&Thresholds::worst_placing_rad>("worst_placing_rad"),
    one<&Thresholds::stated_too_small>("stated_too_small"),
    one<&Thresholds::best_placing_m>("best_placing_m"),
    one<&Thresholds::best_placing_rad>("best_placing_rad"),
    one<&Thresholds::least_gain_first>("least_gain_first"),
    one<&Thresholds::least_gain_more>("least_gain_more"),
    one<&Thresholds::least_gain_exchange>("least_gain_exchange"),
    one<&Thresholds::implausible_cost>("implausible_cost"),
    one<&Thresholds::share_of_freer>("share_of_freer"),
    one<&Thresholds::other_kind_start>("other_kind_start"),
    one<&Thresholds::other_kind_share>("other_kind_share"),
    one<&Thresholds::least_nats>("least_nats"),
    one<&Thresholds::least_nats_of_several>("least_nats_of_several"),
    one<&Thresholds::least_share>("least_share"),
    one<&Thresholds::sure_of_structure>("sure_of_structure"),
    one<&Thresholds::sure_nats>("sure_nats"),
    one<&Thresholds::sure_unselected>("sure_unselected"),
    one<&Thresholds::sure_stray>("sure_stray"),
    one<&Thresholds::clearly_scattered>("clearly_scattered"),
    one<&Thresholds::partly_left>("partly_left"),
    one<&Thresholds::unexplained_left>("unexplained_left"),
    one<&Thresholds::temperature>("temperature"),
    one<&Thresholds::unknown_as_thing>("unknown_as_thing"),
    one<&Thresholds::unknown_as_other>("unknown_as_other"),
    one<&Thresholds::unknown_as_none>("unknown_as_none"),
    one<&Thresholds::same_signal>("same_signal"),
    one<&Thresholds::same_evidence>("same_evidence"),
    one<&Thresholds::twin_evidence>("twin_evidence"),
    one<&Thresholds::cost_of_failing>("cost_of_failing"),
    one<&Thresholds::cost_of_unselected>("cost_of_unselected"),
    one<&Thresholds::nameless_margin>("nameless_margin"),
    one<&Thresholds::mostly_scattered>("mostly_scattered"),
    one<&Thresholds::same_on_design>("same_on_design", false),
    one<&Thresholds::hard_on_design>("hard_on_design", false),
    one<&Thresholds::share_of_size>("share_of_size"),
    one<&Thresholds::share_of_distance>("share_of_distance"),
    one<&Thresholds::widest_place_m>("widest_place_m"),
    one<&Thresholds::wider_of_placed>("wider_of_placed"),
    one<&Thresholds::sure_trace>("sure_trace"),
    one<&Thresholds::false_discoveries>("false_discoveries"),
    one<&Thresholds::told_rest>("told_rest"),
    one<&Thresholds::told_tolerance>("told_tolerance"),
    one<&Thresholds::told_place>("told_place"),
    one<&Thresholds::sure_thing>("sure_thing"),
    one<&Thresholds::silent_axis>("silent_axis"),
    one<&Thresholds::open_cause>("open_cause", false),
    one<&Thresholds::least_separation>("least_separation", false),
    one<&Thresholds::sure_of_change>("sure_of_change", false),
    one<&Thresholds::far_surer>("far_surer", false),
    one<&Thresholds::far_off>("far_off", false),
    one<&Thresholds::fewest_far_off>("fewest_far_off", false),
    one<&Thresholds::gone_is_surer>("gone_is_surer", false),
    one<&Thresholds::told_rig_moved_mm>("told_rig_moved_mm", false),
    one<&Thresholds::told_rig_turned_deg>("told_rig_turned_deg", false),
    one<&Thresholds::told_scatter>("told_scatter", false),
    ofLines<&recording::LineRules::largest_chance>("lines.largest_chance"),
    ofLines<&recording::LineRules::least_excess>("lines.least_excess"),
    ofLines<&recording::LineRules::least_low_excess>("lines.least_low_excess"),
    ofLines<&recording::LineRules::least_lowest_excess>("lines.least_lowest_excess"),
};

// All members are eight bytes: one that is missing here does not compile.
static_assert(sizeof(Thresholds) == 8 * kDeciding.size());

}  // namespace

std::span<const Deciding> decidingOnes() { return kDeciding; }

}  // namespace fieldtrue::testing
