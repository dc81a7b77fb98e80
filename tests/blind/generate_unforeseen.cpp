#include "tests/blind/generate_unforeseen.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace blind {
namespace unforeseen {

Scene sceneOf(const Setup& setup) {
  Scene scene;
  scene.up = setup.tracker_from_jig * Vector3d::UnitZ();
  scene.duration_s = std::max(1.0, setup.duration_s());
  for (const Row& row : setup.rows) {
    scene.poses.push_back(setup.expected(row));
    const Vector3d& p_m = scene.poses.back().position_m;
    scene.middle_m += p_m / static_cast<double>(setup.rows.size());
    scene.lowest_m = std::min(scene.lowest_m, p_m.dot(scene.up));
    scene.highest_m = std::max(scene.highest_m, p_m.dot(scene.up));
  }
  return scene;
}

Span spanOf(const Setup& setup) {
  Span span;
  for (const Row& row : setup.rows) {
    span.low_m = span.low_m.cwiseMin(row.place_m);
    span.high_m = span.high_m.cwiseMax(row.place_m);
  }
  return span;
}

double extent_m(const Scene& scene, const Vector3d& toward) {
  double farthest_m = 0;
  for (const SolvedPose& pose : scene.poses)
    farthest_m = std::max(farthest_m, (pose.position_m - scene.middle_m).dot(toward));
  return farthest_m;
}

Vector3d beside(const Scene& scene, const Vector3d& toward, double clearance_m) {
  Vector3d at_m = scene.middle_m + (extent_m(scene, toward) + clearance_m) * toward;
  while (at_m.norm() < 0.5) at_m += 0.1 * toward;
  return at_m;
}

Vector3d level(Random& random, const Vector3d& up) {
  const Vector3d any = direction(random);
  const Vector3d side = any - any.dot(up) * up;
  return side.norm() > 0.05 ? side.normalized() : up.unitOrthogonal();
}

Vector3d keptAway(const Vector3d& p_m, double distance_m) {
  const double r_m = p_m.norm();
  if (r_m >= distance_m) return p_m;
  return r_m > 1e-9 ? Vector3d(p_m * (distance_m / r_m)) : Vector3d(0, 0, -distance_m);
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

double middleTime_s(const Row& row) { return 0.5 * (row.start_s + row.end_s); }

int passed(const std::vector<double>& instants_s, double time_s) {
  return static_cast<int>(std::count_if(instants_s.begin(), instants_s.end(), [&](double s) { return s <= time_s; }));
}

std::vector<double> instants(Random& random, const Scene& scene, int count) {
  std::vector<double> list_s;
  for (int n = 1; n <= count; ++n) list_s.push_back(scene.duration_s * (n + uniform(random, -0.3, 0.3)) / (count + 1));
  return list_s;
}

std::size_t Course::before(const Row& row) const {
  const auto next = std::lower_bound(start_s.begin(), start_s.end(), row.start_s - 1e-6);
  return next == start_s.begin() ? 0 : static_cast<std::size_t>(next - start_s.begin() - 1);
}

Course courseOf(const Setup& setup) {
  std::vector<Row> rows = setup.rows;
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.start_s < b.start_s; });
  Course course;
  for (const Row& row : rows) {
    course.start_s.push_back(row.start_s);
    course.poses.push_back(setup.expected(row));
  }
  return course;
}

Matrix3d echo(const Vector3d& at_m, const Matrix3d& polarizability_m3, const Vector3d& p_m) {
  return dipoleField(keptAway(p_m - at_m, 0.12)) * polarizability_m3 * dipoleField(at_m);
}

void addField(const SolvedPose& pose, const Matrix3d& field, Matrix3d& couplings) {
  couplings += pose.orientation.toRotationMatrix().transpose() * field;
}

void turnAbout(const Vector3d& pivot_m, const Vector3d& rotation_rad, Vector3d& p_m, Quaterniond& attitude) {
  p_m = pivot_m + turned(rotation_rad, Quaterniond::Identity()) * (p_m - pivot_m);
  attitude = turned(rotation_rad, attitude);
}

Drawn drawnOf(const Story& story, std::function<void(World&, double size)> apply) {
  const auto describe = [story](double size, json& effect) {
    effect["parameters"] = story.parameters;
    effect["parameters"][story.size_name] = size;
    if (story.location_m) effect["location_m"] = listed(*story.location_m);
  };
  const auto apply_at_size = [apply = std::move(apply)](World& world, double size, ShapeChange) { apply(world, size); };
  return {"unforeseen:" + story.words, story.phrase, story.smallest, story.largest, apply_at_size, describe};
}

}  // namespace unforeseen

std::span<const std::vector<Kind>> unforeseenBatches() {
  using namespace unforeseen;
  constexpr auto kRigAxes = Kind::Needs::kRigAxes;
  constexpr auto kLayers = Kind::Needs::kLayers;
  static const std::vector<Kind> kFirst = {
      {"unforeseen:near:steel_door_left_ajar", 1, drawDoor},
      {"unforeseen:hip_pushes_carts_into_contact", 1, drawTouchingCarts},
      {"unforeseen:excess_transmitter_cable_coiled", 1, drawCoiledCable},
      {"unforeseen:near:raised_floor_pedestals", 1, drawPedestals},
      {"unforeseen:near:ceiling_grid_with_open_joints", 1, drawCeilingGrid},
      {"unforeseen:near:blind_lowered_slat_by_slat", 1, drawBlind},
      {"unforeseen:near:step_stool_for_high_places", 1, drawStepStool},
      {"unforeseen:near:eddy_tail_in_next_slot", 1, drawEddyTail},
      {"unforeseen:hinged_board_not_flat", 1, drawFoldedBoard, kRigAxes},
      {"unforeseen:eccentric_measuring_wheel", 1, drawEccentricWheel, kRigAxes},
      {"unforeseen:arm_creeps_between_retightenings", 1, drawCreepingArm, kRigAxes},
      {"unforeseen:taut_cable_pulls_sensor", 1, drawTautCable},
      {"unforeseen:near:holder_screw_backs_out", 1, drawLooseHolder},
      {"unforeseen:floating_floor_tilts_under_operator", 1, drawFloatingFloor, kRigAxes},
      {"unforeseen:shift_change_reads_with_parallax", 1, drawParallax, kRigAxes},
      {"unforeseen:near:fan_sways_hanging_transmitter", 1, drawSwayingTransmitter},
      {"unforeseen:backlash_in_alternate_rows", 1, drawBacklash, kLayers},
      {"unforeseen:near:second_page_from_older_drawing", 1, drawSecondPage, kRigAxes},
      {"unforeseen:post_twists_as_it_dries", 1, drawTwistingPost, kRigAxes},
      {"unforeseen:near:amplifier_switches_range", 1, drawRangeSwitch},
      {"unforeseen:dead_zone_in_demodulator", 1, drawDeadZone},
      {"unforeseen:cable_loop_picks_up_midway", 1, drawCableLoop},
      {"unforeseen:near:adaptive_filter_not_settled_far_out", 1, drawUnsettledFilter},
      {"unforeseen:multiplexer_remembers_second_sensor", 1, drawMultiplexer},
      {"unforeseen:supply_sags_when_autoclave_heats", 1, drawSaggingSupply},
      {"unforeseen:coarse_trig_table", 1, drawCoarseTable},
      {"unforeseen:near:coordinate_clips_at_wall", 1, drawClippedCoordinate},
      {"unforeseen:loudspeaker_magnet_biases_core", 1, drawBiasedCore},
      {"unforeseen:wireless_sensor_slips_phase", 1, drawPhaseSlip},
      {"unforeseen:fused_compass_near_steel", 1, drawFusedCompass},
      {"unforeseen:handover_to_second_transmitter", 1, drawHandover},
  };
  static const std::vector<Kind> kSecond = {
      {"unforeseen:wristwatch_on_the_left_hand", 1, drawWristwatch},
      {"unforeseen:table_frame_rises_with_the_places", 1, drawRisingFrame},
      {"unforeseen:tracker_next_door_beats", 1, drawTrackerNextDoor},
      {"unforeseen:drive_current_leaks_along_a_pipe", 1, drawLeakToPipe},
      {"unforeseen:near:wheelchair_rolls_past", 1, drawWheelchair},
      {"unforeseen:tuned_gate_drifts_through_resonance", 1, drawTunedGate},
      {"unforeseen:long_beam_has_a_pole_at_its_end", 1, drawLongBeam},
      {"unforeseen:air_jet_bends_the_stem", 1, drawAirJet},
      {"unforeseen:lamp_dragged_after_the_operator", 1, drawDraggedLamp},
      {"unforeseen:near:board_cups_once_the_sun_is_on_it", 1, drawCuppedBoard, kRigAxes},
      {"unforeseen:near:steel_screws_under_a_few_places", 1, drawScrews},
      {"unforeseen:each_hole_marked_from_the_last", 1, drawChainedHoles, kRigAxes},
      {"unforeseen:tape_hook_bent_when_places_were_found", 1, drawBentHook, kRigAxes},
      {"unforeseen:block_squared_by_eye_from_one_spot", 1, drawSquaredByEye, kRigAxes},
      {"unforeseen:near:countdown_too_short_for_long_ways", 1, drawShortCountdown},
      {"unforeseen:near:spacers_under_layers_are_wedges", 1, drawWedgedSpacers, kLayers},
      {"unforeseen:two_sensors_share_a_checkerboard", 1, drawCheckerboard, kLayers},
      {"unforeseen:cable_winds_up_walking_round", 1, drawWoundCable},
      {"unforeseen:paper_template_puckers_round_glue", 1, drawPuckeredTemplate, kRigAxes},
      {"unforeseen:near:correction_map_of_another_room_left_on", 1, drawForeignMap},
      {"unforeseen:near:output_held_within_a_band", 1, drawHeldOutput},
      {"unforeseen:near:broken_strand_opens_when_bent", 1, drawBrokenStrand},
      {"unforeseen:near:coordinates_cut_to_few_bits", 1, drawCutBits},
      {"unforeseen:near:gain_control_slow_to_release", 1, drawSlowRelease},
      {"unforeseen:hemisphere_guard_pushes_off_a_plane", 1, drawHemisphereGuard},
      {"unforeseen:near:one_coil_slipped_within_the_sensor", 1, drawSlippedCoil},
  };
  static const std::vector<Kind> kThird = {
      {"unforeseen:near:fan_drive_sweeps_across_the_carrier", 1, drawSweepingDrive},
      {"unforeseen:lift_sets_off_between_slots", 1, drawLift},
      {"unforeseen:near:stimulator_fires_in_trains", 1, drawStimulator},
      {"unforeseen:near:compressor_iron_saturates_while_running", 1, drawCompressor},
      {"unforeseen:near:counterweight_swings_against_the_sensor", 1, drawCounterweight},
      {"unforeseen:near:tall_posts_are_carbon_tubes", 1, drawCarbonPosts},
      {"unforeseen:near:cleaning_robot_runs_under_the_jig", 1, drawCleaningRobot},
      {"unforeseen:cable_reel_gives_off_turns", 1, drawCableReel},
      {"unforeseen:near:warm_glue_creeps_whichever_way_is_down", 1, drawWarmGlue},
      {"unforeseen:cork_keeps_the_dents_of_the_last_places", 1, drawDentedCork, kRigAxes},
      {"unforeseen:handwheel_turns_lost_until_the_stop", 1, drawLostTurns, kRigAxes},
      {"unforeseen:near:resin_wells_out_of_some_holes", 1, drawResin, kRigAxes},
      {"unforeseen:heights_levelled_with_a_sloping_sight", 1, drawSlopingSight, kRigAxes},
      {"unforeseen:near:tired_arm_droops_at_high_places", 1, drawTiredArm, kRigAxes},
      {"unforeseen:near:unlocked_castors_roll_at_each_push", 1, drawCastors, kRigAxes},
      {"unforeseen:near:block_turned_round_where_cable_is_short", 1, drawTurnedBlock},
      {"unforeseen:drive_current_comes_home_by_the_screen", 1, drawScreenCurrent},
      {"unforeseen:near:range_by_a_straight_line_from_the_last_fix", 1, drawLastRange},
      {"unforeseen:near:one_bit_of_the_converter_weighs_wrong", 1, drawWrongBit},
      {"unforeseen:near:hops_between_unlike_carriers", 1, drawCarrierHops},
      {"unforeseen:near:slack_is_laid_along_the_drive_cable", 1, drawSlackCable},
      {"unforeseen:near:firmware_has_too_few_digits_of_pi", 1, drawShortPi},
      {"unforeseen:near:halves_of_the_demodulator_do_not_balance", 1, drawUnlikeHalves},
      {"unforeseen:near:shorted_turn_comes_and_goes", 1, drawShortedTurn},
      {"unforeseen:near:window_slips_and_carriers_leak", 1, drawSlippingWindow},
  };
  static const std::array kBatches = {kFirst, kSecond, kThird};
  return kBatches;
}

}  // namespace blind
