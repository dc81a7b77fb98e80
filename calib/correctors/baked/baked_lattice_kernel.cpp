#include "calib/correctors/baked/baked_lattice_kernel.h"

#include <array>
#include <cstring>

#if defined(__x86_64__)
#define FIELDTRUE_LATTICE_X86
#endif
#define FIELDTRUE_INLINE __attribute__((always_inline)) inline

namespace fieldtrue::correctors {
namespace {

/// Floats of one register of each instruction set.
typedef float Lanes4 __attribute__((vector_size(16), aligned(4)));
#ifdef FIELDTRUE_LATTICE_X86
typedef float Lanes8 __attribute__((vector_size(32), aligned(4)));
typedef float Lanes16 __attribute__((vector_size(64), aligned(4)));
#endif

FIELDTRUE_INLINE int cellOf(const LatticeArrays& lattice, int axis, double x_m, double* fraction) {
  const double highest = lattice.counts[axis] - 2;
  double t = (x_m - lattice.origin_m[axis]) / lattice.spacing_m;
  t = t > 1.0 ? t : 1.0;
  t = t < highest ? t : highest;
  int cell = static_cast<int>(t);
  cell = cell < lattice.counts[axis] - 3 ? cell : lattice.counts[axis] - 3;
  *fraction = t - cell;
  return cell;
}

/// Weights of the four coefficients around a position in a cell.
FIELDTRUE_INLINE void splineWeights(float u, float* w) {
  const float v = 1.0F - u;
  w[0] = v * v * v * (1.0F / 6.0F);
  w[1] = 2.0F / 3.0F - u * u * (1.0F - 0.5F * u);
  w[2] = 2.0F / 3.0F - v * v * (1.0F - 0.5F * v);
  w[3] = u * u * u * (1.0F / 6.0F);
}

/// Where a point stands: its first coefficient, and the weights along each axis.
struct Stencil {
  const float* corner;
  float w[3][4];
};

struct Strides {
  std::size_t row;
  std::size_t plane;
};

/// Finds the stencil and asks for its 16 rows of four coefficients, so that they are near when they are summed.
FIELDTRUE_INLINE void prepare(const LatticeArrays& lattice, const Strides& strides, const double* p_m,
                              Stencil* stencil) {
  int cell[3];
  for (int axis = 0; axis < 3; ++axis) {
    double u = 0.0;
    cell[axis] = cellOf(lattice, axis, p_m[axis], &u);
    splineWeights(static_cast<float>(u), stencil->w[axis]);
  }
  stencil->corner = lattice.coefficients + static_cast<std::size_t>(cell[0] - 1) * strides.plane +
                    static_cast<std::size_t>(cell[1] - 1) * strides.row + static_cast<std::size_t>(cell[2] - 1) * 4;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = 0; b < 4; ++b) {
      const float* row = stencil->corner + a * strides.plane + b * strides.row;
      __builtin_prefetch(row);
      __builtin_prefetch(row + 15);
    }
}

/// The 64 coefficients summed along the first two axes register by register, then along the last.
template <class Lanes>
FIELDTRUE_INLINE void sumUp(const Stencil& stencil, const Strides& strides, float* value) {
  constexpr std::size_t kLanes = sizeof(Lanes) / sizeof(float);
  constexpr std::size_t kParts = 16 / kLanes;
  Lanes sum[kParts] = {};
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = 0; b < 4; ++b) {
      const float w = stencil.w[0][a] * stencil.w[1][b];
      const float* row = stencil.corner + a * strides.plane + b * strides.row;
      for (std::size_t part = 0; part < kParts; ++part) {
        Lanes lanes;
        std::memcpy(&lanes, row + part * kLanes, sizeof lanes);
        sum[part] += w * lanes;
      }
    }
  float columns[16];
  std::memcpy(columns, sum, sizeof columns);
  const float* w = stencil.w[2];
  for (std::size_t k = 0; k < 4; ++k)
    value[k] = (w[0] * columns[k] + w[1] * columns[4 + k]) + (w[2] * columns[8 + k] + w[3] * columns[12 + k]);
}

template <class Lanes>
FIELDTRUE_INLINE void valuesBy(const LatticeArrays& lattice, const double* p_m, std::size_t n_points, float* values) {
  constexpr std::size_t kBlock = 16;
  Stencil stencils[kBlock];
  const std::size_t row = 4 * static_cast<std::size_t>(lattice.counts[2]);
  const Strides strides{row, row * static_cast<std::size_t>(lattice.counts[1])};
  for (std::size_t start = 0; start < n_points; start += kBlock) {
    const std::size_t count = n_points - start < kBlock ? n_points - start : kBlock;
    for (std::size_t i = 0; i < count; ++i) prepare(lattice, strides, p_m + 3 * (start + i), &stencils[i]);
    for (std::size_t i = 0; i < count; ++i) sumUp<Lanes>(stencils[i], strides, values + 4 * (start + i));
  }
}

void baseline(const LatticeArrays& lattice, const double* p_m, std::size_t n_points, float* values) {
  valuesBy<Lanes4>(lattice, p_m, n_points, values);
}

#ifdef FIELDTRUE_LATTICE_X86
__attribute__((target("avx512f,avx512vl,avx512dq,avx512bw,avx2,fma"))) void avx512(const LatticeArrays& lattice,
                                                                                   const double* p_m,
                                                                                   std::size_t n_points,
                                                                                   float* values) {
  valuesBy<Lanes16>(lattice, p_m, n_points, values);
}

__attribute__((target("avx2,fma"))) void avx2(const LatticeArrays& lattice, const double* p_m, std::size_t n_points,
                                              float* values) {
  valuesBy<Lanes8>(lattice, p_m, n_points, values);
}
#endif

struct KernelTable {
  std::array<LatticeKernel, 3> kernels;
  std::size_t count = 0;

  KernelTable() {
#ifdef FIELDTRUE_LATTICE_X86
    const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
      kernels[count++] = {"avx512", avx512};
    if (has_avx2) kernels[count++] = {"avx2", avx2};
#endif
    kernels[count++] = {"plain", baseline};
  }
};

}  // namespace

int latticeCell(const LatticeArrays& lattice, int axis, double x_m, double* fraction) {
  return cellOf(lattice, axis, x_m, fraction);
}

std::span<const LatticeKernel> latticeKernels() {
  static const KernelTable table;
  return std::span(table.kernels).first(table.count);
}

void latticeValues(const LatticeArrays& lattice, const double* p_m, std::size_t n_points, float* values) {
  latticeKernels().front().values(lattice, p_m, n_points, values);
}

}  // namespace fieldtrue::correctors
