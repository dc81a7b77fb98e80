#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "calib/exporters/lattice_export.h"

namespace fieldtrue::exporters {

/// A displacement field as ITK has it: world coordinates left-posterior-superior in millimetres, x fastest. The frame
/// of the calibration is taken as right-anterior-superior, as 3D Slicer does, so that x and y change sign.
struct ItkField {
  std::array<int, 3> size = {0, 0, 0};
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< Columns: the directions of i, j and k.
  std::vector<Eigen::Vector3d> vectors_mm;

  static ItkField of(const LatticeField& field);
  /// @error kBadInput where the axes are not at right angles, or sizes and vectors do not match
  Result<LatticeField> lattice() const;
};

/// What all of ITK's formats share; write and read are left to the format.
LatticeForm itkForm(double bytes_per_point);

/// For the menus: unit, frame and direction.
inline constexpr const char* kItkWords =
    "millimetres; the calibration's frame taken as RAS, written as LPS; points move from measured to true";

/// Facts that every ITK file adds.
Facts itkFacts(Facts facts);

/// Three numbers as text, blanks between.
std::string threeNumbers(const Eigen::Vector3d& v, const char* between = " ");
/// Numbers of a text that stand between blanks, commas and brackets. @error kBadInput naming what is no number
Result<std::vector<double>> numbersIn(const std::string& text);

}  // namespace fieldtrue::exporters
