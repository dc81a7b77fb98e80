#include "calib/correctors/harmonic/harmonic_field_step.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::correctors {

Linearisation linearised(std::span<const PlaceRow> rows, std::span<const Site> sites, const Chosen& chosen,
                         const Box& box, const Eigen::Vector3d& center_m, const RunControl& control) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  const auto n_sites = static_cast<Eigen::Index>(sites.size());
  Linearisation linear;
  linear.design.resize(3 * n, kPerSource * n_sites);
  linear.rigid.resize(3 * n, 6);
  linear.y.resize(3 * n);
  linear.scale.resize(sites.size());
  control.parallel_for(sites.size(), [&](std::size_t s) {
    auto columns = linear.design.middleCols<kPerSource>(kPerSource * static_cast<Eigen::Index>(s));
    const SourceBasis source(sites[s].at_m);
    double sum = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const PlaceRow& row = rows[static_cast<std::size_t>(i)];
      const Eigen::Matrix<double, 3, kPerSource> effect = effectOfSource(row.derivative, source);
      sum += effect.squaredNorm();
      columns.middleRows<3>(3 * i).noalias() = row.whitening * effect;
    }
    linear.scale[s] = std::sqrt(sum / static_cast<double>(n));
    columns /= linear.scale[s];
  });
  linear.present_effect = Eigen::VectorXd::Zero(3 * n);
  for (std::size_t k = 0; k < chosen.sites.size(); ++k)
    linear.present_effect += linear.design.middleCols<kPerSource>(kPerSource * chosen.sites[k]) *
                             (linear.scale[static_cast<std::size_t>(chosen.sites[k])] * chosen.tensors[k]);
  for (Eigen::Index i = 0; i < n; ++i) {
    const PlaceRow& row = rows[static_cast<std::size_t>(i)];
    const Eigen::Vector3d p_true_m = row.derivative.at_m + row.true_minus_corrected_m;
    linear.rigid.middleRows<3>(3 * i) = row.whitening * effectOfMotion(p_true_m, center_m);
    linear.y.segment<3>(3 * i) = row.whitening * row.true_minus_corrected_m;
  }
  linear.y += linear.present_effect;
  for (std::size_t s = 0; s < sites.size(); ++s)
    if (!isAllowedSite(sites[s], box))
      linear.design.middleCols<kPerSource>(kPerSource * static_cast<Eigen::Index>(s)).setZero();
  return linear;
}

std::vector<double> variancesIn(const Linearisation& linear, const Chosen& chosen) {
  std::vector<double> variances;
  for (std::size_t k = 0; k < chosen.sites.size(); ++k) {
    const double scale = linear.scale[static_cast<std::size_t>(chosen.sites[k])];
    variances.push_back(chosen.variances[k] * scale * scale);
  }
  return variances;
}

Chosen chosenBy(const GroupSelection& selection, const Linearisation& linear) {
  Chosen chosen;
  chosen.sites = selection.groups;
  for (std::size_t k = 0; k < chosen.sites.size(); ++k) {
    const double scale = linear.scale[static_cast<std::size_t>(chosen.sites[k])];
    chosen.tensors.push_back(selection.amplitudes.segment(kPerSource * static_cast<Eigen::Index>(k), kPerSource) /
                             scale);
    chosen.variances.push_back(selection.prior_variance[static_cast<Eigen::Index>(k)] / (scale * scale));
  }
  return chosen;
}

Chosen blended(const Chosen& before, const Chosen& after, double share) {
  Chosen blend;
  const auto add = [&blend](const Chosen& part, double weight) {
    for (std::size_t k = 0; k < part.sites.size(); ++k) {
      const auto found = std::find(blend.sites.begin(), blend.sites.end(), part.sites[k]);
      const auto at = static_cast<std::size_t>(found - blend.sites.begin());
      if (found == blend.sites.end()) {
        blend.sites.push_back(part.sites[k]);
        blend.tensors.push_back(weight * part.tensors[k]);
        blend.variances.push_back(part.variances[k]);
      } else {
        blend.tensors[at] += weight * part.tensors[k];
      }
    }
  };
  add(after, share);
  add(before, 1.0 - share);
  return blend;
}

}  // namespace fieldtrue::correctors
