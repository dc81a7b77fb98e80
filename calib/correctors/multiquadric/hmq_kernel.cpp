#include "calib/correctors/multiquadric/hmq_kernel.h"

#include <array>

#include "calib/correctors/multiquadric/hmq_kernel_plain.h"

namespace fieldtrue::correctors {
namespace {

using namespace hmq_kernel;

void sumsByRoots(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y, const double* alpha_z,
                 const double* p_m, std::size_t n_points, double* f) {
  plainSums(centers.x_m, centers.y_m, centers.z_m, centers.count, centers.r2_m2, alpha_x, alpha_y, alpha_z, p_m,
            n_points, f);
}

void sumsSingle(const MultiquadricArraysSingle& terms, const float* p_m, std::size_t n_points, float* f) {
  plainSums(terms.x_m, terms.y_m, terms.z_m, terms.count, terms.r2_m2, terms.alpha_x, terms.alpha_y, terms.alpha_z, p_m,
            n_points, f);
}

void weights(const MultiquadricArrays& centers, const double* p_m, double* w_m) { plainWeights(centers, p_m, w_m); }

double dot(const double* a, const double* b, std::size_t count) { return plainDot(a, b, count); }

struct KernelTable {
  std::array<MultiquadricKernel, kMostX86Kernels + 1> kernels;
  std::size_t count = 0;

  KernelTable() : count(x86Kernels(kernels.data())) {
    kernels[count++] = {"plain", weights, sumsByRoots, sumsByRoots, sumsSingle, dot};
  }
};

}  // namespace

std::span<const MultiquadricKernel> multiquadricKernels() {
  static const KernelTable table;
  return std::span(table.kernels).first(table.count);
}

void multiquadricWeights(const MultiquadricArrays& centers, const double* p_m, double* w_m) {
  multiquadricKernels().front().weights(centers, p_m, w_m);
}

void multiquadricSums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                      const double* alpha_z, const double* p_m, std::size_t n_points, double* f) {
  multiquadricKernels().front().sums(centers, alpha_x, alpha_y, alpha_z, p_m, n_points, f);
}

void multiquadricSumsSingle(const MultiquadricArraysSingle& terms, const float* p_m, std::size_t n_points, float* f) {
  multiquadricKernels().front().sums_single(terms, p_m, n_points, f);
}

double dotProduct(const double* a, const double* b, std::size_t count) {
  return multiquadricKernels().front().dot(a, b, count);
}

}  // namespace fieldtrue::correctors
