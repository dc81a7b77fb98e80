#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

namespace fieldtrue::testing {

/// One technique of the survey's table 2, by the best of its variants here.
struct Technique {
  std::string name;
  std::string survey_says;  ///< "average", "fair", "best".
  std::vector<std::string> variants;
};

/// @source survey by Kindratenko, table 2, column of the location error
inline const std::vector<Technique>& techniquesOfTable2() {
  static const std::vector<Technique> kTechniques = {
      {"trilinear", "average", {"trilinear:resample=briggs", "trilinear:resample=livingston"}},
      {"tetrahedral", "average", {"tetrahedral"}},
      {"local", "average", {"local_linear", "local_bump", "local_kindratenko:weight=linear"}},
      {"polynomial of degree 4", "best", {"polynomial:degree=4"}},
      {"neural network", "fair", {"neural_network"}},
      {"multiquadric", "best", {"hmq:r2_cm2=10", "hmq:r2_cm2=100", "hmq:r2_cm2=1000"}}};
  return kTechniques;
}

/// Error of each technique, by its best variant; techniques without a score are left out.
inline std::map<std::string, double> techniqueErrors(const std::map<std::string, double>& error_of_method) {
  std::map<std::string, double> errors;
  for (const Technique& technique : techniquesOfTable2())
    for (const std::string& variant : technique.variants)
      if (const auto found = error_of_method.find(variant); found != error_of_method.end()) {
        const auto [at, is_new] = errors.emplace(technique.name, found->second);
        if (!is_new) at->second = std::min(at->second, found->second);
      }
  return errors;
}

/// 1 for the lowest error; equal errors share a rank.
inline std::map<std::string, int> ranksOf(const std::map<std::string, double>& errors) {
  std::map<std::string, int> ranks;
  for (const auto& [name, error] : errors)
    ranks[name] = 1 + static_cast<int>(std::count_if(errors.begin(), errors.end(), [limit = error](const auto& other) {
                    return other.second < limit;
                  }));
  return ranks;
}

/// How far a ranking agrees with table 2: pairs of techniques that it calls unlike and that stand here in its order,
/// and all such pairs. It does not say whether "fair" is more or less than "average": such pairs are left out.
struct Agreement {
  int in_order = 0;
  int pairs = 0;
};

inline Agreement agreementWithTable2(const std::map<std::string, double>& errors) {
  Agreement agreement;
  for (const Technique& better : techniquesOfTable2())
    for (const Technique& worse : techniquesOfTable2()) {
      if (better.survey_says != "best" || worse.survey_says == "best") continue;
      if (!errors.contains(better.name) || !errors.contains(worse.name)) continue;
      ++agreement.pairs;
      agreement.in_order += errors.at(better.name) < errors.at(worse.name) ? 1 : 0;
    }
  return agreement;
}

}  // namespace fieldtrue::testing
