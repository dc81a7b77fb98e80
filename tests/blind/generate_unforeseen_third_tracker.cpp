#include <algorithm>
#include <array>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

Matrix3d plainCouplings(const SolvedPose& pose) {
  return pose.orientation.toRotationMatrix().transpose() * dipoleField(pose.position_m);
}

/// Magnitudes of all couplings of the session.
std::vector<double> magnitudes(const Scene& scene) {
  std::vector<double> list;
  for (const SolvedPose& pose : scene.poses)
    for (const double coupling : plainCouplings(pose).reshaped()) list.push_back(std::abs(coupling));
  return list;
}

Matrix3d anyMatrix(Random& random) {
  Matrix3d m;
  for (int column = 0; column < 3; ++column) m.col(column) = normalVector(random) / std::sqrt(3.0);
  return m;
}

/// Attitude whose yaw, pitch and roll are a factor of those given.
Quaterniond anglesTimes(double factor, const Quaterniond& attitude) {
  const Matrix3d m = attitude.toRotationMatrix();
  const double yaw_rad = std::atan2(m(1, 0), m(0, 0)), roll_rad = std::atan2(m(2, 1), m(2, 2));
  const double pitch_rad = std::asin(std::clamp(-m(2, 0), -1.0, 1.0));
  return Eigen::AngleAxisd(factor * yaw_rad, Vector3d::UnitZ()) *
         Eigen::AngleAxisd(factor * pitch_rad, Vector3d::UnitY()) *
         Eigen::AngleAxisd(factor * roll_rad, Vector3d::UnitX());
}

}  // namespace

/// The screen of the sensor's cable touches earth at the sensor, and a share of the drive current comes home that way.
Drawn drawScreenCurrent(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d box_m = beside(scene, toward, uniform(random, 0.1, 0.6));
  const Vector3d exit = direction(random);
  const double sags = uniform(random, 0.2, 1.0);
  const Eigen::RowVector3d share = direction(random).transpose();
  const auto apply = [=, up = scene.up](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d leaves = ((box_m - pose.position_m).normalized() - sags * up).normalized();
      const Vector3d beside_cable = pose.orientation * exit;
      addField(pose, size * leaves.cross(beside_cable) * share, couplings);
    });
  };
  const json parameters = {{"exit", listed(exit)}, {"sags", sags}, {"share", listed(share.transpose())}};
  return drawnOf({"drive_current_comes_home_by_the_screen", "drive current runs in the screen of the sensor's cable",
                  "field_per_moment_m3", 1e-6, 30, parameters, box_m},
                 apply);
}

/// The firmware finds the range by a straight line from the last fix, and has no time to repeat that often enough.
Drawn drawLastRange(const Setup& setup, Random& random) {
  const Course course = courseOf(setup);
  const double power = uniform(random, 2.5, 3.5);
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row& row, SolvedPose& pose) {
      const double ratio = course.poses[course.before(row)].position_m.norm() / std::max(0.05, pose.position_m.norm());
      const double short_by = 1 - ratio * (1 - (std::pow(ratio, power) - 1) / power);
      pose.position_m *= 1 - size * std::tanh(short_by);
    });
  };
  return drawnOf({"near:range_by_a_straight_line_from_the_last_fix", "the range falls short after a change of range",
                  "share_left", 1e-5, 0.9, json{{"power", power}}},
                 apply);
}

/// One bit of the converter weighs more than twice the next lower one.
Drawn drawWrongBit(const Setup& setup, Random& random) {
  const double typical = quantile(magnitudes(sceneOf(setup)), uniform(random, 0.3, 0.8));
  const double bit = typical * uniform(random, 0.5, 1.5);
  const double zero = uniform(random, 0, 2);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose&, Matrix3d& couplings) {
      const auto converted = [=](double c) {
        return c - 0.5 * size * bit * std::tanh(20 * std::sin(kPi * (c / bit + zero)));
      };
      couplings = couplings.unaryExpr(converted).eval();
    });
  };
  return drawnOf({"near:one_bit_of_the_converter_weighs_wrong", "one bit of the converter has a wrong weight",
                  "share_of_bit", 1e-5, 1, json{{"bit_per_m3", bit}, {"zero", zero}}},
                 apply);
}

/// Evading interference, the tracker hops between carriers, each with amplifiers calibrated on another day.
Drawn drawCarrierHops(const Setup& setup, Random& random) {
  const std::vector<double> hops_s = instants(random, sceneOf(setup), uniformInt(random, 2, 8));
  const int carriers = uniformInt(random, 2, 4);
  std::vector<Vector3d> receiver, transmitter;
  std::vector<int> used = {0};
  for (int carrier = 0; carrier < carriers; ++carrier) {
    receiver.push_back(normalVector(random));
    transmitter.push_back(0.7 * normalVector(random));
  }
  for (std::size_t n = 0; n < hops_s.size(); ++n)
    used.push_back((used.back() + uniformInt(random, 1, carriers - 1)) % carriers);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      const int hop = passed(hops_s, middleTime_s(row));
      const auto carrier = static_cast<std::size_t>(used[static_cast<std::size_t>(hop)]);
      const Vector3d rows = (size * receiver[carrier]).array().exp(),
                     columns = (size * transmitter[carrier]).array().exp();
      couplings = (rows.asDiagonal() * couplings * columns.asDiagonal()).eval();
    });
  };
  return drawnOf({"near:hops_between_unlike_carriers", "the tracker hops between carriers that were calibrated apart",
                  "log_gain", 1e-5, 0.5, json{{"hops_s", hops_s}, {"carriers", used}}},
                 apply);
}

/// Near the box the sensor's cable is too long, and its slack is laid down along the transmitter's.
Drawn drawSlackCable(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d box_m = beside(scene, toward, uniform(random, 0.1, 0.6));
  std::vector<double> ways_m;
  for (const SolvedPose& pose : scene.poses) ways_m.push_back((pose.position_m - box_m).norm());
  const double cable_m = quantile(ways_m, uniform(random, 0.4, 0.8));
  const Matrix3d pairs = anyMatrix(random);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      couplings += size * std::max(0.0, cable_m - (pose.position_m - box_m).norm()) * pairs;
    });
  };
  return drawnOf(
      {"near:slack_is_laid_along_the_drive_cable", "slack of the sensor's cable picks up from the drive cable",
       "coupling_per_length_m4", 1e-6, 30, json{{"cable_m", cable_m}}, box_m},
      apply);
}

/// An old routine turns angles from half turns into radians with too few digits of pi.
Drawn drawShortPi(const Setup&, Random& random) {
  const bool attitude_too = uniform(random, 0, 1) < 0.6;
  const double elevation_share = uniform(random, 0, 1) < 0.7 ? 1.0 : 0.0;
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const Vector3d p_m = pose.position_m;
      const double azimuth_rad = (1 - size) * std::atan2(p_m.y(), p_m.x());
      const double elevation_rad = (1 - elevation_share * size) * std::atan2(p_m.z(), p_m.head<2>().norm());
      const double level_m = p_m.norm() * std::cos(elevation_rad);
      pose.position_m = {level_m * std::cos(azimuth_rad), level_m * std::sin(azimuth_rad),
                         p_m.norm() * std::sin(elevation_rad)};
      if (attitude_too) pose.orientation = anglesTimes(1 - size, pose.orientation);
    });
  };
  return drawnOf(
      {"near:firmware_has_too_few_digits_of_pi", "angles are computed with a pi that is too small", "share_missing",
       1e-6, 0.05, json{{"attitude_too", attitude_too}, {"elevation_share", elevation_share}}},
      apply);
}

/// The two halves of each demodulator do not balance, so that a little of a signal's magnitude adds to it.
Drawn drawUnlikeHalves(const Setup& setup, Random& random) {
  const double rounded = 0.2 * quantile(magnitudes(sceneOf(setup)), uniform(random, 0.1, 0.5));
  Vector3d unlike = Vector3d::Ones();
  for (double& other : unlike.tail<2>()) other = uniform(random, -1, 1);
  std::swap(unlike(0), unlike(uniformInt(random, 0, 2)));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose&, Matrix3d& couplings) {
      const Matrix3d sizes = couplings.unaryExpr([=](double c) { return std::hypot(c, rounded) - rounded; });
      couplings += size * unlike.asDiagonal() * sizes;
    });
  };
  return drawnOf({"near:halves_of_the_demodulator_do_not_balance", "positive and negative couplings have unlike gains",
                  "difference", 1e-5, 0.8, json{{"unlike", listed(unlike)}, {"rounded_per_m3", rounded}}},
                 apply);
}

/// As the transmitter warms and cools, two turns of a coil touch and part again; while they touch, they oppose it.
Drawn drawShortedTurn(const Setup& setup, Random& random) {
  const std::vector<double> changes_s = instants(random, sceneOf(setup), uniformInt(random, 2, 9));
  const int first = uniformInt(random, 0, 1);
  const Vector3d coil = Vector3d::Unit(uniformInt(random, 0, 2));
  const Vector3d turn = (coil + 0.4 * direction(random)).normalized();
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      if ((passed(changes_s, middleTime_s(row)) + first) % 2 == 0) return;
      couplings = (couplings - size * (couplings * turn) * turn.transpose()).eval();
    });
  };
  return drawnOf(
      {"near:shorted_turn_comes_and_goes", "two turns of a transmitter coil touch now and then", "share_opposed", 1e-5,
       0.9, json{{"changes_s", changes_s}, {"touch_at_first", first}, {"turn", listed(turn)}}},
      apply);
}

/// The three coils have a carrier each; the window of the analysis slips, and they leak into each other in slow beats.
Drawn drawSlippingWindow(const Setup& setup, Random& random) {
  const double low = uniform(random, 0.6, 3.0), high = uniform(random, 0.6, 3.0);
  const Matrix3d part = anyMatrix(random);
  Matrix3d cycles, phases;
  cycles << 0, low, low + high, -low, 0, high, -low - high, -high, 0;
  for (double& phase : phases.reshaped()) phase = uniform(random, 0, 1);
  const auto apply = [=, duration_s = sceneOf(setup).duration_s](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      const Matrix3d turns = cycles * (middleTime_s(row) / duration_s) + phases;
      Matrix3d leak = part.cwiseProduct((2 * kPi * turns).array().cos().matrix());
      leak.diagonal().setZero();
      couplings += (size * couplings * leak).eval();
    });
  };
  return drawnOf(
      {"near:window_slips_and_carriers_leak", "carriers of the three coils leak into each other in slow beats", "leak",
       1e-5, 1, json{{"low_cycles", low}, {"high_cycles", high}}},
      apply);
}

}  // namespace blind::unforeseen
