#include "calib/correctors/base/fit_rows.h"

namespace fieldtrue::correctors {

FitData rowsOfFitData(const FitData& data, const std::vector<std::size_t>& rows) {
  FitData part;
  part.jig_sd_m = data.jig_sd_m;
  part.is_dipole = data.is_dipole;
  part.dimension = data.dimension;
  for (const std::size_t row : rows) {
    part.p_tracked_m.push_back(data.p_tracked_m[row]);
    part.p_true_m.push_back(data.p_true_m[row]);
    part.node.push_back(data.node[row]);
    if (!data.q_tracked.empty()) part.q_tracked.push_back(data.q_tracked[row]);
    if (!data.q_true.empty()) part.q_true.push_back(data.q_true[row]);
    if (!data.index.empty()) part.index.push_back(data.index[row]);
    if (!data.noise_m2.empty()) part.noise_m2.push_back(data.noise_m2[row]);
  }
  return part;
}

}  // namespace fieldtrue::correctors
