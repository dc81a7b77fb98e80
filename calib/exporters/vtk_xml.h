#pragma once

#include <Eigen/Core>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/exporters/export_subject.h"

/// VTK's XML files, of version 1.0 with 64-bit lengths.
namespace fieldtrue::exporters {

/// Opening of a file; the facts stand in a comment.
std::string vtkHead(const std::string& type, const Facts& facts);

/// An array of doubles, inline and in base64. @param numbers all components of the first point, then of the second
std::string vtkArray(const std::string& name, int components, const std::vector<double>& numbers);
std::string vtkArray(const std::string& name, const std::vector<Eigen::Vector3d>& vectors);
/// An array of 64-bit integers.
std::string vtkIntegers(const std::string& name, const std::vector<std::int64_t>& numbers);

/// The numbers of an array, whether it is text, inline or appended, plain or compressed by zlib.
/// @param root of the document, for appended data
/// @error kBadInput
Result<std::vector<double>> vtkNumbers(const pugi::xml_node& root, const pugi::xml_node& array);

}  // namespace fieldtrue::exporters
