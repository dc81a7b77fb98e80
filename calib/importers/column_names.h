#pragma once

#include <string>

/// What people call the columns of a table of poses.
namespace fieldtrue::importers {

/// What a column is by its name.
struct ColumnName {
  std::string part;         ///< "x", "qw", "azimuth", "node"; empty: not recognised.
  bool is_true = false;     ///< A word for the truth is in it.
  bool is_reading = false;  ///< A word for what a tracker said is in it.
  std::string stem;         ///< What is left of the name: columns of one group share it.
  std::string unit;         ///< As the name says; empty: it says nothing.
};

ColumnName readColumnName(const std::string& name);

/// What a stem says of whose columns these are: "stylus q" and "stylus" are of one thing.
std::string ownerOf(const std::string& stem);

}  // namespace fieldtrue::importers
