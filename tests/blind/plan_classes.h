#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace blind {

using Classes = std::vector<std::vector<std::string>>;

/// Classes of effects that the design of a node table cannot tell apart, as `plan-check` of the program under test
/// declares them before anything is answered: effects joined by pairs of R2 above 0.9, and by pairs of which it says
/// that they are told apart from a larger strength only.
/// @param cli fieldtrue-cli
/// @param ids every effect of the catalogue; each comes out in exactly one class
/// @param rho strength of the weakest effect of the session, gap to noise; 0: none
/// @return nothing when the program fails or prints no pairs
std::optional<Classes> planCheckClasses(const std::filesystem::path& cli, const std::filesystem::path& nodes,
                                        const std::vector<std::string>& ids, double rho);

/// Joins every two ids of which `alike` says so, and what is joined to either.
template <typename Alike>
Classes joinedClasses(const std::vector<std::string>& ids, const Alike& alike) {
  std::vector<std::size_t> group(ids.size());
  for (std::size_t a = 0; a < ids.size(); ++a) group[a] = a;
  for (std::size_t a = 0; a < ids.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (group[a] == group[b] || !alike(a, b)) continue;
      const std::size_t from = group[a], to = group[b];
      for (std::size_t& g : group)
        if (g == from) g = to;
    }
  Classes classes;
  for (std::size_t g = 0; g < ids.size(); ++g) {
    std::vector<std::string> members;
    for (std::size_t a = 0; a < ids.size(); ++a)
      if (group[a] == g) members.push_back(ids[a]);
    if (!members.empty()) classes.push_back(std::move(members));
  }
  return classes;
}

}  // namespace blind
